"""Between index pulses so many marks pass: missing and doubled pulses, with them and, told as doubtful, without."""

from __future__ import annotations

import re

import numpy as np
import pytest

from gearmbs.signals import SignalError, instantaneous_speed, pulse_train, torsional_vibration
from gearmbs.signals.encoders.pulses import angle_of_pulses
from tests.says import says
from tests.signals.encoders.test_uneven_marks import SPEED, passed, uneven

TURNS = 40


def record(lines, errors=None, turns=TURNS, **motion):
    """Return times, numbers, errors of the marks and index pulses half a pitch before mark 0, at constant speed."""
    errors = np.zeros(lines) if errors is None else errors
    times, n = passed(lines, errors, turns=turns, **motion)
    return times, n, errors, (2 * np.pi * np.arange(1, turns - 1) - np.pi / lines) / SPEED


def doubled(times, at):
    return np.sort(np.append(times, times[at] + 0.2 * (times[np.asarray(at) + 1] - times[at])))


def assert_right(train, times, numbers, errors):
    """All pulses that are kept are those of their marks, mark 0 that behind the index; the motion is right."""
    at = np.searchsorted(times, train.times - 1e-12)
    np.testing.assert_array_equal(train.times, times[at])
    off = train.numbers - numbers[at]
    assert np.all(off == off[0])
    assert off[0] % train.lines == 0
    assert abs(torsional_vibration(train, errors)).max() < 1e-8
    assert abs(instantaneous_speed(angle_of_pulses(train, errors)) - SPEED).max() < 1e-4 * SPEED


def told(times, lines):
    """Return the remarks, or the refusal."""
    try:
        return " ".join(pulse_train(times, lines).notes)
    except SignalError as refused:
        return str(refused)


@pytest.mark.parametrize("turn", [1, 2, 20, 38])
@pytest.mark.parametrize("lines", [8, 60])
def test_a_lost_mark_behind_the_index_is_no_contradiction(lines, turn):
    times, n, errors, index = record(lines)
    train = pulse_train(np.delete(times, np.flatnonzero(n == turn * lines)), lines, index=index)
    assert_right(train, times, n, errors)
    assert re.search(says("1 pulse", "missing"), " ".join(train.notes))
    assert train.turns == (n[-1] - n[0]) / lines


@pytest.mark.parametrize("amount", [0.0, 0.2])
@pytest.mark.parametrize("lines", [8, 60])
@pytest.mark.parametrize("apart", [1, 2, 3, 7])
def test_one_lost_and_one_doubled_beside_it(lines, apart, amount):
    """The count is unchanged: the times tell."""
    times, n, errors, index = record(lines, uneven(lines, amount))
    seen = np.delete(doubled(times, 100 + apart), 100)
    train = pulse_train(seen, lines, index=index)
    assert_right(train, times, n, errors)
    assert train.notes
    # a pulse or two that nobody can be sure of are left out
    assert times.size - train.times.size <= 4


@pytest.mark.parametrize("every", [6, 10])
def test_two_reflectors_one_weak(every):
    times, n, errors, index = record(2)
    weak = np.arange(2, times.size, every)
    train = pulse_train(np.delete(times, weak), 2, index=index)
    assert_right(train, times, n, errors)
    assert re.search(says(f"{weak.size} pulses", "missing"), " ".join(train.notes))


@pytest.mark.parametrize(("lines", "amount"), [(2, 0.2), (3, 0.2), (8, 0.4), (60, 0.25)])
def test_a_mark_doubled_in_each_turn_from_the_tenth_on(lines, amount):
    times, n, errors, index = record(lines, uneven(lines, amount))
    twice = np.arange(10 * lines, times.size - 1, lines)
    train = pulse_train(doubled(times, twice), lines, index=index)
    assert_right(train, times, n, errors)
    assert re.search(says("too many"), " ".join(train.notes))


@pytest.mark.parametrize("amount", [0.0, 0.2])
@pytest.mark.parametrize("share", [0.005, 0.02])
def test_many_lost_pulses_are_counted_by_index_pulses_and_doubted_without(share, amount):
    times, n, errors, index = record(60, uneven(60, amount), turns=60)
    seen = times[np.random.default_rng(4).random(times.size) > share]
    assert_right(pulse_train(seen, 60, index=index), times, n, errors)
    assert re.search(says("CHECK THE COUNT", "index"), " ".join(pulse_train(seen, 60).notes))


@pytest.mark.parametrize(("lines", "amount"), [(2, 0.0), (2, 0.3), (3, 0.2), (8, 0.4), (60, 0.25)])
@pytest.mark.parametrize("what", ["weak", "doubled"])
def test_without_index_pulses_a_count_that_is_not_sure_is_told(what, lines, amount):
    """A mark that is weak in each third turn, or doubled in each from the tenth on."""
    times = record(lines, uneven(lines, amount))[0]
    if what == "weak":
        seen = np.delete(times, np.arange(lines, times.size, 3 * lines))
    else:
        seen = doubled(times, np.arange(10 * lines, times.size - 1, lines))
    text = told(seen, lines)
    assert any(re.search(words, text) for words in (says("CHECK THE COUNT", "index"), says("lines", "missing")))


@pytest.mark.parametrize("known", [{}, {"swing": 4e-3}, {"rise": 40.0}, {"jitter": 1e-5}])
@pytest.mark.parametrize("lines", [2, 8, 60])
def test_sound_records_are_not_doubted(lines, known):
    times, n, _, _ = record(lines, uneven(lines, 0.2), **known)
    index = np.interp(lines * np.arange(1, TURNS - 1) - 0.5, n, times)
    for train in (pulse_train(times, lines), pulse_train(times, lines, index=index)):
        assert not train.notes
        np.testing.assert_array_equal(train.numbers - train.numbers[0], n - n[0])


def test_index_pulses_that_come_with_a_mark():
    """Now a tick before, now behind."""
    times, n, _, _ = record(8, uneven(8, 0.2))
    at_mark = times[n % 8 == 0][1:]
    index = at_mark + 1e-7 * np.random.default_rng(2).choice([-1, 1], at_mark.size)
    train = pulse_train(np.delete(times, [100, 203]), 8, index=index)
    off = train.numbers - np.delete(n, [100, 203])
    assert np.all(off == off[0])
    assert re.search(says("2 pulses", "missing"), " ".join(train.notes))


def test_lost_index_pulses_and_lines_that_index_pulses_contradict():
    times, n, errors, index = record(60)
    train = pulse_train(np.delete(times, 300), 60, index=np.delete(index, [5, 6, 20]))
    assert_right(train, times, n, errors)
    with pytest.raises(SignalError, match=says("index", "60", "59")):
        pulse_train(times, 59, index=index)
    for lines in (1, 3):
        # two reflectors: one mark a turn too many, and too few
        with pytest.raises(SignalError, match=says("index", "lines")):
            pulse_train(record(2)[0], lines, index=record(2)[3])


def test_faults_that_index_pulses_show_are_refused_on_request():
    times, _, _, index = record(8)
    with pytest.raises(SignalError, match=says("faults", "missing", "mend")):
        pulse_train(np.delete(times, 100), 8, index=index, faults="refuse")


@pytest.mark.parametrize("lines", [4, 8])
def test_half_orders_bend_nothing_beyond_the_last_index_pulse(lines):
    """Of a swing by 0.1 rad a cubic through the index pulses is a pulse off two turns behind the last one."""
    clock = np.linspace(0.0, 2.0, 200_001)
    angle = SPEED * clock + 0.1 * np.sin(0.5 * SPEED * clock) + 0.02 * np.sin(2.3 * SPEED * clock)
    n = np.arange(3, TURNS * lines)
    times = np.interp(2 * np.pi * n / lines + uneven(lines, 0.1)[n % lines], angle, clock)
    index = np.interp(2 * np.pi * np.arange(1, TURNS - 1) - np.pi / lines, angle, clock)
    train = pulse_train(times, lines, index=index)
    np.testing.assert_array_equal(train.numbers - train.numbers[0], n - n[0])


@pytest.mark.parametrize(("lines", "every"), [(2, 2), (4, 2), (4, 4), (60, 2), (3, 3)])
def test_marks_lost_from_some_turn_on(lines, every):
    """Of two even marks all intervals are alike again, twice as long: the jump tells, or index pulses count."""
    times, n, errors, index = record(lines)
    seen = times[(n < 20 * lines) | (n % every != 1)]
    assert re.search(says("CHECK THE COUNT", "index"), told(seen, lines))
    if lines // every == 1:
        train = pulse_train(seen, lines, index=index)
        assert train.turns == np.ptp(n[np.isin(times, seen)]) / lines
        assert abs(instantaneous_speed(angle_of_pulses(train, errors)) - SPEED).max() < 1e-4 * SPEED


def test_a_mark_doubled_from_some_turn_on():
    """One mark a turn, twice its pulses."""
    times = record(1)[0]
    seen = np.sort(np.append(times, times[20:-1] + 0.5 * np.diff(times[20:])))
    assert re.search(says("CHECK THE COUNT", "index"), told(seen, 1))


@pytest.mark.parametrize(("amount", "share"), [(0.01, 0.001), (0.01, 0.05), (0.2, 0.01)])
def test_many_lines_of_which_no_turn_is_whole(amount, share):
    """1024 lines: of each turn some are lost; the steps count them, turns beside each other give the marks."""
    times, n, _, _ = record(1024, uneven(1024, amount), turns=12, swing=2e-4)
    index = np.interp(1024 * np.arange(1, 11) - 0.5, n, times)
    seen = times[np.random.default_rng(2).random(times.size) > share]
    train = pulse_train(seen, 1024, index=index)
    np.testing.assert_array_equal(train.times, seen)
    off = train.numbers - n[np.searchsorted(times, seen)]
    assert np.all(off == off[0])
    assert off[0] % 1024 == 0
    assert re.search(says("missing", "Mended"), " ".join(train.notes))
