"""Tachos of several uneven reflectors: a lost pulse is mended, or the count is told to be unsure."""

import warnings

import numpy as np
import pytest

from gearmbs.signals import make_signal, phase_from_tacho

RATE, SECONDS = 20_000.0, 4.0
TIME = np.arange(round(RATE * SECONDS)) / RATE
PLACES = {2: (0.0, 0.35), 3: (0.0, 0.2, 0.7), 4: (0.0, 0.22, 0.5, 0.71)}
COURSES = {
    "even": 15.0 * TIME,
    "swaying": 15.0 * TIME + 0.1 * np.sin(2 * np.pi * 1.5 * TIME),
    "rising": 10.0 * TIME + 1.5 * TIME**2,
}


def tacho(places, turns, lost=(), doubled=()):
    """Pulses of 3 % of a turn at some places of it; lost and doubled ones by their numbers."""
    number = len(places) * np.floor(turns)
    level = np.zeros(turns.size)
    for k, place in enumerate(places):
        inside = (turns % 1.0 >= place) & (turns % 1.0 < place + 0.03)
        own = number + k
        level[inside & ~np.isin(own, lost)] = 1.0
        level[inside & np.isin(own, doubled) & (turns % 1.0 >= place + 0.01) & (turns % 1.0 < place + 0.02)] = 0.0
    return make_signal({"tacho": level}, RATE, units="V")


def counted(signal, lines):
    """Return turns between the first and the last pulse, and what is said."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        phase = phase_from_tacho(signal, pulses_per_rev=lines)
    return float(phase[-1] - phase[0]) / (2 * np.pi), [str(one.message) for one in said]


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("lines", PLACES)
def test_whole_records_of_uneven_reflectors_are_not_doubted(lines, course):
    turns, said = counted(tacho(PLACES[lines], COURSES[course]), lines)
    assert not any("CHECK" in one for one in said)
    assert turns == pytest.approx(COURSES[course][-1], abs=1.01)


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("lines", PLACES)
@pytest.mark.parametrize("fault", ["lost", "doubled"])
def test_lost_and_doubled_pulses_are_mended_or_the_count_is_told(fault, lines, course):
    """Each of one turn's reflectors, and one in each third turn."""
    whole, _ = counted(tacho(PLACES[lines], COURSES[course]), lines)
    every = np.arange(lines * 6, lines * 40, 3 * lines)
    for gone in (*([lines * 20 + k] for k in range(lines)), every):
        turns, said = counted(tacho(PLACES[lines], COURSES[course], **{fault: gone}), lines)
        assert said
        assert abs(turns - whole) < 0.01 or any("CHECK THE COUNT" in one for one in said), (gone, turns - whole, said)


@pytest.mark.parametrize("places", [(0.0, 0.5), (0.0, 0.45)])
def test_a_reflector_that_is_weak_in_each_third_turn_is_told(places):
    """Two of three turns are not enough to say what a turn is; turns had been lost in silence."""
    whole, _ = counted(tacho(places, COURSES["even"]), 2)
    turns, said = counted(tacho(places, COURSES["even"], lost=np.arange(2, 118, 6)), 2)
    assert abs(turns - whole) < 0.01 or any("CHECK THE COUNT" in one for one in said)


@pytest.mark.parametrize("course", COURSES)
@pytest.mark.parametrize("places", [(0.0, 0.5), (0.0, 0.45), PLACES[2], PLACES[3]])
@pytest.mark.parametrize("fault", ["lost", "doubled"])
def test_a_mark_that_is_lost_or_doubled_from_some_turn_on_is_told(fault, places, course):
    """Of two even marks all intervals are alike again behind it: turns had been halved in silence."""
    lines, angle = len(places), COURSES[course]
    whole, _ = counted(tacho(places, angle), lines)
    for mark in range(lines):
        gone = np.arange(lines * 20 + mark, lines * (angle[-1] + 1), lines)
        turns, said = counted(tacho(places, angle, **{fault: gone}), lines)
        assert abs(turns - whole) < 0.01 or any("CHECK THE COUNT" in one for one in said), (mark, turns - whole, said)


@pytest.mark.parametrize("lines", [1, 2])
def test_a_speed_that_changes_within_some_turns_is_no_lost_mark(lines):
    """From 900 to 1500 rpm within four turns, steady before and behind."""
    turns = np.cumsum(np.interp(TIME, [0.0, 2.0, 2.2, 4.0], [15.0, 15.0, 25.0, 25.0])) / RATE
    _, said = counted(tacho((0.0, 0.5)[:lines], turns), lines)
    assert not said
