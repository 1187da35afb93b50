"""Tachos whose edges scatter, and pulses too many or missing where a record begins or ends."""

import re
import warnings

import numpy as np
import pytest

from gearmbs.signals import SignalError, make_signal, phase_from_tacho
from gearmbs.signals.rotation.mesh_shaft import mesh_shaft
from gearmbs.signals.rotation.shaft import Known
from tests.says import says

RATE, SECONDS, TEETH, TURN = 3200.0, 6.0, 23, 2.0 * np.pi
TIME = np.arange(round(RATE * SECONDS)) / RATE
STEADY = 25.0 * TIME + 0.3
SWAYING = STEADY + 25.0 / 15.0 / (TURN * 0.3) * np.sin(TURN * 0.3 * TIME)
LINES = 2.0 / np.sqrt(2.0), 0.6 / np.sqrt(2.0)
"""Of the mesh of `record`, RMS."""


def record(turns, tacho):
    noise = np.random.default_rng(3).standard_normal(TIME.size)
    mesh = TURN * TEETH * turns
    return make_signal({"a": 2.0 * np.cos(mesh) + 0.6 * np.cos(2 * mesh + 1.0) + 0.1 * noise, "tacho": tacho}, RATE)


def analysed(turns, tacho, per_rev=1):
    """The first mesh lines over the angle, RMS, the mean speed in rpm, and the remarks."""
    notes = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        shaft, left = mesh_shaft(record(turns, tacho), (TEETH,), Known(tacho="tacho", pulses_per_rev=per_rev), notes)
    phase = shaft.phase
    part = left.sel(time=phase["time"], channel="a").values
    weight = np.gradient(phase.values) * (1.0 - np.cos(TURN * (phase.values - phase.values[0]) / np.ptp(phase.values)))
    lines = [abs(np.sum(weight * part * np.exp(-1j * TEETH * k * phase.values))) for k in (1, 2)]
    return np.sqrt(2.0) * np.array(lines) / weight.sum(), shaft.speed * 30.0 / np.pi, " ".join(notes)


def pulses(turns, extra=(), lost=()):
    """A pulse of 5 % of a turn once a turn; more at some numbers of turns, and none in others."""
    level = np.where((turns % 1.0 < 0.05) & ~np.isin(np.floor(turns), lost), 5.0, 0.0)
    for at in extra:
        level[(turns >= at) & (turns < at + 0.05)] = 5.0
    return level


@pytest.mark.parametrize("noise", [0.02, 0.05, 0.1])
def test_edges_that_scatter_leave_the_mesh_line(noise):
    """A sine with noise: its edges are off by that many rad, 23 times as much of the mesh."""
    scatter = noise * np.random.default_rng(1).standard_normal(TIME.size)
    lines, _, notes = analysed(STEADY, np.cos(TURN * STEADY) + scatter)
    assert lines[0] == pytest.approx(LINES[0], rel=0.05)
    # an eighth of the scatter is left, 0.3 rad at twice the mesh
    assert 0.8 * LINES[1] < lines[1] < 1.05 * LINES[1]
    assert "scatter" in notes


def test_where_more_than_scatter_moves_the_speed_the_loss_is_told():
    scatter = 0.1 * np.random.default_rng(1).standard_normal(TIME.size)
    lines, _, notes = analysed(SWAYING, np.cos(TURN * SWAYING) + scatter)
    assert 0.8 * LINES[0] < lines[0] < LINES[0]
    assert "CHECK THE SPEED" in notes


def test_a_shaft_whose_speed_does_change_from_turn_to_turn_is_followed():
    """Two turns longer, two shorter, again and again: the mesh, 0.7 rad to and fro, says that the shaft does so."""
    turns = STEADY + 0.015 / np.pi * np.sin(TURN * 0.25 * STEADY + 0.25 * np.pi)
    lines, _, notes = analysed(turns, np.cos(TURN * turns))
    assert lines == pytest.approx(LINES, rel=0.03)
    assert "scatter" not in notes


def test_edges_that_do_not_scatter_are_taken_as_they_are():
    lines, _, notes = analysed(SWAYING, np.cos(TURN * SWAYING))
    assert lines == pytest.approx(LINES, rel=0.01)
    assert "scatter" not in notes


def swinging(hertz, radians=0.05):
    return STEADY + radians / TURN * np.sin(TURN * hertz * TIME)


def test_a_shaft_that_swings_between_sparse_pulses_is_told_by_what_stands_beside_the_mesh():
    """Edges of every fifth turn, without any noise, see swings of 7.3 Hz as 2.3 Hz: these are no edges that scatter."""
    turns = swinging(7.3)
    lines, _, notes = analysed(turns, np.cos(TURN * 0.2 * turns), 0.2)
    assert lines[0] < 0.9 * LINES[0]
    assert re.search(says("CHECK THE SPEED", "swings between the pulses", "more pulses a turn"), notes)
    assert "What it leaves takes" not in notes


def test_a_shaft_that_swings_slowly_between_sparse_pulses_is_followed():
    turns = swinging(0.7)
    lines, _, notes = analysed(turns, np.cos(TURN * 0.2 * turns), 0.2)
    assert lines == pytest.approx(LINES, rel=0.02)
    assert "swings between" not in notes


SWINGS = {
    "hunting, one pulse": (swinging(2.3, 0.15), 1),
    "a joint of 20 degrees, 16 pulses": (STEADY + 0.031 / TURN * np.sin(TURN * 2.0 * STEADY), 16),
    "a misfire, 16 pulses": (STEADY + 0.05 / TURN * np.sin(TURN * 0.5 * STEADY), 16),
}


@pytest.mark.parametrize("case", SWINGS)
def test_a_mesh_line_that_stands_over_the_angle_of_a_tacho_contradicts_none(case):
    """Over time the swings spread it into sidebands: 3.4 rad of the mesh leave less at its own place than beside it."""
    turns, per_rev = SWINGS[case]
    lines, speed, notes = analysed(turns, np.cos(TURN * per_rev * turns), per_rev)
    assert lines == pytest.approx(LINES, rel=0.03)
    assert speed == pytest.approx(1500.0, rel=1e-3)
    assert "CHECK" not in notes


@pytest.mark.parametrize("case", SWINGS)
def test_a_tacho_that_turns_at_another_speed_is_contradicted_though_the_shaft_swings(case):
    turns, per_rev = SWINGS[case]
    _, _, notes = analysed(turns, np.cos(TURN * per_rev * 1.014 * turns), per_rev)
    assert "CHECK THE SPEED" in notes


LAST = int(STEADY[-1])
ENDS = {
    "one too many in the first turn": {"extra": [1.2]},
    "one too many late in the first turn": {"extra": [1.8]},
    "one too many in the last turn": {"extra": [LAST + 0.2]},
    "lost last but one": {"lost": [LAST - 1]},
    "lost second": {"lost": [2]},
}


@pytest.mark.parametrize("fault", ENDS)
def test_pulses_too_many_or_missing_at_the_ends_are_left_out(fault):
    lines, speed, notes = analysed(STEADY, pulses(STEADY, **ENDS[fault]))
    # an edge is known to half a sample, 0.4 % of a turn
    assert speed == pytest.approx(1500.0, rel=1e-4)
    assert lines == pytest.approx(LINES, rel=0.03)
    assert "it is cut there" in notes
    assert "varies" not in notes


def test_pulses_at_the_ends_are_refused_or_kept_on_request():
    one = make_signal({"tacho": pulses(STEADY, extra=[LAST + 0.2])}, RATE)
    with pytest.raises(SignalError, match=says("faults", "last", "keep")):
        phase_from_tacho(one, faults="refuse")
    kept = phase_from_tacho(one, faults="keep")
    assert float(kept[-1] - kept[0]) == pytest.approx(TURN * LAST, abs=0.3)


def test_a_start_from_rest_loses_no_pulse():
    """The first turns of a shaft that starts are longer than those behind them, with all pulses there."""
    turns = 4.0 * TIME**2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        phase = phase_from_tacho(make_signal({"tacho": pulses(turns)}, RATE))
    assert float(phase[-1] - phase[0]) == pytest.approx(TURN * np.floor(turns[-1] - 1), abs=0.1)
