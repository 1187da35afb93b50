"""Torsional vibration of any order, pulses that few samples show, and pulses far from the others."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gearmbs.signals import (
    SignalError,
    order_spectrum,
    pulse_train,
    pulses_of_channel,
    to_signal,
    torsional_vibration,
)
from tests.says import says

LINES, SPEED = 60, 60.0


def train(order, turns=64, size=1e-3):
    times = np.linspace(0.0, turns * math.tau / SPEED, 400 * turns)
    angle = SPEED * times + size * np.sin(order * SPEED * times)
    numbers = np.arange(2, int(angle[-1] / math.tau * LINES) - 2)
    return pulse_train(CubicSpline(angle, times)(math.tau / LINES * numbers), LINES)


@pytest.mark.parametrize("order", [0.25, 1 / 3, 0.5, 1.0, 1.5, 2.5, 3.5, 7.0, 11.25])
def test_torsional_vibration_has_its_height_at_any_order(order):
    """Over means of a turn order 1/2 came at 0.132 of its height, 1.5 at 1.469; the ends of splines cost 3 %."""
    found = torsional_vibration(train(order))
    turned = math.tau * order * found["angle"].values
    lines = np.linalg.lstsq(np.stack((np.sin(turned), np.cos(turned)), 1), found.values[:, 0], rcond=None)[0]
    assert np.hypot(*lines) == pytest.approx(1e-3, rel=0.03 if order < 1.0 else 0.005)


def test_what_filled_marks_cost_is_told():
    """A wheel of 60-2-2: two gaps of three pitches take 7.3e-4 k^2 from order k, here a quarter of its wave apart."""
    whole = train(5.0)
    there = ~np.isin(whole.numbers % LINES, [10, 11, 43, 44])
    found = torsional_vibration(pulse_train(whole.times[there], LINES))
    (note,) = (note for note in found.attrs["notes"] if "straight lines" in note)
    share = float(re.search(r"k ([\d.]+) k\^2 %", note)[1]) / 100.0
    turned = math.tau * 5.0 * found["angle"].values
    lines = np.linalg.lstsq(np.stack((np.sin(turned), np.cos(turned)), 1), found.values[:, 0], rcond=None)[0]
    assert 1.0 - np.hypot(*lines) / 1e-3 == pytest.approx(25.0 * share, rel=0.15)
    assert not any("straight lines" in note for note in torsional_vibration(whole).attrs["notes"])


def test_a_shaft_that_runs_down_vibrates_no_more_for_it():
    times = np.linspace(0.0, 6.0, 30000)
    angle = SPEED * times - 2.0 * times**2
    numbers = np.arange(2, int(angle[-1] / math.tau * LINES))
    down = pulse_train(CubicSpline(angle, times)(math.tau / LINES * numbers), LINES)
    assert np.abs(torsional_vibration(down).values).max() < 1e-6


@pytest.mark.parametrize("shape", ["square", "sine"])
@pytest.mark.parametrize(("rate", "seen"), [(1500.0, None), (2500.0, None), (20e3, True)])
def test_pulses_that_few_samples_show_are_refused(shape, rate, seen):
    """1000 pulses a second, of which 1500 Hz show 500."""
    phase = 1000.0 * (np.arange(int(rate)) / rate + 1e-5)
    volts = 5.0 * (phase % 1.0 < 0.5) if shape == "square" else np.sin(math.tau * phase)
    signal = to_signal(volts, rate=rate, units="V")
    if seen is None:
        with pytest.raises(SignalError, match=says("ch1", "samples a pulse", "rate")):
            pulses_of_channel(signal, 100)
        return
    found = pulses_of_channel(signal, 100)
    assert found.mean_speed == pytest.approx(20.0 * math.pi, rel=1e-3)
    # an edge within one sample of twenty of a pulse: 2 pi/(2 * 20 * 100)
    assert any("0.0016 rad" in note for note in found.notes) == (shape == "square")


@pytest.mark.parametrize("cut", [slice(1, 900), slice(-900, -1)])
def test_a_pulse_far_from_all_others_is_left_out_and_said_to_be(cut):
    times = np.delete(np.arange(3000) / 1000.0, cut)
    found = pulse_train(times, 100)
    assert found.mean_speed == pytest.approx(20.0 * math.pi)
    assert any("left out" in note for note in found.notes)
    with pytest.raises(SignalError, match=says("encoder", "left out", "faults='keep'")):
        pulse_train(times, 100, faults="refuse")
    # four reflectors, one quarter of a turn without any
    uneven = np.sort(np.concatenate([np.arange(20) + part for part in (0.0, 0.1, 0.2, 0.5)]))
    assert pulse_train(uneven, 4, faults="keep").times.size == pulse_train(uneven, 4).times.size


@pytest.mark.parametrize("turns", [63, 64, 65, 66])
@pytest.mark.parametrize("order", [0.25, 0.5, 1.5, 7.0])
def test_half_and_quarter_orders_are_lines_of_the_spectrum(order, turns):
    """Between two lines of a Hann window 15 % of the height are missing."""
    found = order_spectrum(torsional_vibration(train(order, turns)))
    assert float(found["order"].sel(order=order, method="nearest")) == pytest.approx(order, abs=1e-9)
    assert float(found.sel(order=order, method="nearest")[0]) == pytest.approx(1e-3, rel=0.03 if order < 1.0 else 0.005)


@pytest.mark.parametrize(("turns", "told"), [(5, True), (9, True), (17, False), (40, False)])
def test_records_too_short_for_half_orders_say_so(turns, told):
    found = torsional_vibration(train(0.5, turns))
    lines = order_spectrum(found)
    half, quarter = (float(lines.sel(order=order, method="nearest")[0]) for order in (0.5, 0.25))
    assert any(re.search(says("encoder", "orders below 1"), note) for note in found.attrs["notes"]) == told
    if not told:
        assert half == pytest.approx(1e-3, rel=0.02)
        assert quarter < 2e-5


def test_what_marks_cannot_show_is_in_the_attributes():
    """Order 40 of 60 marks is folded onto 20."""
    found = torsional_vibration(train(40.0))
    lines = order_spectrum(found)
    # marks pass where the shaft is by then: 40 times a milliradian of phase
    assert float(lines.sel(order=20.0, method="nearest")[0]) == pytest.approx(1e-3, rel=0.04)
    assert found.attrs["highest_order"] == 30.0
    assert any(re.search(says("60 lines", "30", "folded"), note) for note in found.attrs["notes"])
    volts = to_signal(5.0 * ((40.0 * np.arange(40000) / 2000.0) % 1.0 < 0.5), rate=2000.0, units="V")
    assert any("half a sample" in note for note in torsional_vibration(pulses_of_channel(volts, 60)).attrs["notes"])
