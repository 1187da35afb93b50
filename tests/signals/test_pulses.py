"""Missing and extra tacho pulses: mended where the intervals tell, and speeds that only look like them."""

import math
import warnings

import numpy as np
import pytest

from gearmbs.signals import SignalError, analyse, make_signal, phase_from_tacho
from gearmbs.signals.rotation.phase import pulse_faults
from tests.says import says

RATE = 5000.0


def fluctuating(t, part, turns=20.0):
    """Speed in Hz around 10 that fluctuates by a part of itself, with a period of so many revolutions."""
    return 10.0 * (1.0 + part * np.sin(math.tau * 10.0 / turns * t + 0.3))


COURSES = {
    "30 % over twenty turns": lambda t: fluctuating(t, 0.3),
    "30 % over three turns": lambda t: fluctuating(t, 0.3, 3.0),
    "50 % over seven turns": lambda t: fluctuating(t, 0.5, 7.0),
    "run-up from rest": lambda t: 50.0 * np.minimum(t / 3.0, 1.0),
    "fast run-up": lambda t: 10.0 + 30.0 * np.clip((t - 3.0) / 0.3, 0.0, 1.0),
    "jerk": lambda t: 10.0 + 30.0 * (1.0 - np.exp(-np.maximum(t - 3.0, 0.0) / 0.05)),
    "run-down": lambda t: 50.0 * np.maximum(1.0 - t / 5.0, 0.001),
    "loss of speed at a load": lambda t: 10.0 - 5.0 * (t > 3.0) * np.exp(-np.maximum(t - 3.0, 0.0) / 0.3),
}


def pulse_times(course, seconds=8.0, per_rev=1):
    t = np.arange(round(seconds * RATE)) / RATE
    angle = np.cumsum(course(t)) / RATE
    return np.interp(np.arange(1, int(angle[-1] * per_rev)) / per_rev, angle, t)


def tacho(edges, seconds=8.0, **others):
    """A record with pulses of 1 ms at these times."""
    t = np.arange(round(seconds * RATE)) / RATE
    at = np.searchsorted(edges, t, side="right") - 1
    return make_signal({**others, "tacho": 5.0 * ((at >= 0) & (t - edges[at] < 1e-3))}, RATE)


@pytest.mark.parametrize("name", COURSES)
def test_no_course_of_the_speed_is_taken_for_a_fault(name):
    edges = pulse_times(COURSES[name])
    assert pulse_faults(edges, 1.0) == []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        phase = phase_from_tacho(tacho(edges))
    assert "notes" not in phase.attrs


@pytest.mark.parametrize("seed", range(3))
def test_intervals_that_scatter_are_no_fault(seed):
    steps = np.random.default_rng(seed).lognormal(0.0, 0.3, 300)
    assert pulse_faults(np.cumsum(0.1 * steps), 1.0) == []


@pytest.mark.parametrize("name", ["30 % over twenty turns", "run-up from rest", "run-down"])
@pytest.mark.parametrize("missing", [[30], [30, 31], [25, 40], [30, 35]])
def test_missing_pulses_are_counted(name, missing):
    edges = pulse_times(COURSES[name])
    with pytest.warns(UserWarning, match=f"{len(missing)} pulses?.*missing.*between"):
        mended = phase_from_tacho(tacho(np.delete(edges, missing)))
    turns = mended.values[-1] / math.tau
    assert turns == pytest.approx(edges.size - 1, abs=0.1)
    truth = np.interp(mended["time"].values, edges, math.tau * np.arange(edges.size))
    assert np.abs(mended.values - truth).max() < 0.1 * math.tau
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kept = phase_from_tacho(tacho(np.delete(edges, missing)), faults="keep")
    assert kept.values[-1] / math.tau == pytest.approx(edges.size - 1 - len(missing), abs=0.1)
    with pytest.raises(SignalError, match=r"missing.*faults='mend'"):
        phase_from_tacho(tacho(np.delete(edges, missing)), faults="refuse")


@pytest.mark.parametrize("name", ["30 % over twenty turns", "run-up from rest", "run-down"])
@pytest.mark.parametrize("part", [0.1, 0.4, 0.85])
def test_extra_pulses_are_left_out(name, part):
    edges = pulse_times(COURSES[name])
    more = np.insert(edges, 31, edges[30] + part * (edges[31] - edges[30]))
    with pytest.warns(UserWarning, match="1 pulse is too many"):
        mended = phase_from_tacho(tacho(more))
    truth = np.interp(mended["time"].values, edges, math.tau * np.arange(edges.size))
    assert np.abs(mended.values - truth).max() < 0.2 * math.tau


def test_a_gap_of_no_whole_number_is_named_and_left():
    edges = pulse_times(lambda t: fluctuating(t, 0.02))
    later = np.r_[edges[:30], edges[30:] + 0.05]
    with pytest.warns(UserWarning, match=says("1", "1.5", "interval between pulses")):
        phase = phase_from_tacho(tacho(later))
    assert phase.values[-1] / math.tau == pytest.approx(np.sum(later < 8.0) - 1, abs=0.6)


def test_a_wheel_with_a_gap_and_uneven_marks():
    even = pulse_times(lambda t: fluctuating(t, 0.05), 3.0, 20)
    gap = even[np.arange(even.size) % 20 < 18]
    # two teeth of twenty are missing once a revolution: with twenty to the turn they count, with eighteen they do not
    assert {fault.missing for fault in pulse_faults(gap, 20.0)} == {2}
    assert pulse_faults(gap, 18.0) == []
    fine = pulse_times(lambda t: fluctuating(t, 0.05), 8.0, 3)
    assert pulse_faults(fine[np.arange(fine.size) % 3 < 2], 2.0) == []


def test_an_analysis_says_what_was_mended():
    edges = pulse_times(lambda t: fluctuating(t, 0.02))
    t = np.arange(round(8.0 * RATE)) / RATE
    angle = np.interp(t, edges, math.tau * np.arange(edges.size))
    record = tacho(np.delete(edges, [40]), a=np.cos(17 * angle))
    with pytest.warns(UserWarning, match=says("Tacho", "1 pulse", "3.9997", "Mended")):
        report = analyse(record, 17, tacho="tacho")
    assert report.harmonics["orders"].values[0, 0] == pytest.approx(math.sqrt(0.5), rel=0.03)
    assert any("1 pulse is missing" in note for note in report.notes)
    with pytest.raises(SignalError, match="faults: must be"):
        phase_from_tacho(record, "tacho", faults="yes")
