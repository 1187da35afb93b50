"""Phase, order tracking, time-synchronous averages and speed from the mesh line."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    angular_resample,
    estimate_speed,
    instantaneous_speed,
    make_signal,
    order_spectrum,
    phase_from_line,
    phase_from_speed,
    phase_from_tacho,
    time_synchronous_average,
)
from gearmbs.signals.rotation.angular import interpolate
from tests.says import says

RATE = 12800.0


def ramp(seconds=4.0, f0=20.0, f1=30.0, rate=RATE):
    """Times and shaft angle of a run-up from f0 to f1 Hz."""
    t = np.arange(round(seconds * rate)) / rate
    return t, 2 * np.pi * (f0 * t + 0.5 * (f1 - f0) / seconds * t**2)


@pytest.mark.parametrize(("ratio", "bound"), [(0.1, 2e-6), (0.25, 3e-5), (0.4, 1e-3)])
def test_interpolation_between_samples(ratio, bound):
    n = np.arange(150_000)
    x = np.cos(2 * np.pi * ratio * n + 0.1)
    at = np.arange(300.0, 149_000.0, 0.7317)
    assert np.abs(interpolate(x, at) - np.cos(2 * np.pi * ratio * at + 0.1)).max() < bound


def test_tacho_phase_of_a_run_up():
    t, angle = ramp()
    pulses = 5.0 * (np.cos(4 * angle) > 0.3) + 0.05 * np.cos(777 * t)
    signal = make_signal({"acc": np.zeros_like(t), "tacho": pulses}, RATE)
    phase = phase_from_tacho(signal, "tacho", pulses_per_rev=4)
    truth = np.interp(phase["time"].values, t, angle)
    error = phase.values - truth
    # an edge is known to one sample, 2 pi 30 / 12800 = 0.0147 rad; the spline swings half as far again
    assert np.ptp(error) < 1.5 * 0.0147
    speed = instantaneous_speed(phase)
    inner = speed[500:-500]
    assert np.abs(inner.values / (2 * np.pi * np.interp(inner["time"].values, [0, 4], [20, 30])) - 1).max() < 0.03


def test_tacho_with_a_sine_is_exact_to_interpolation():
    t, angle = ramp(2.0, 25.0, 25.0)
    phase = phase_from_tacho(make_signal(np.sin(angle + 0.2), RATE))
    error = phase.values - np.interp(phase["time"].values, t, angle)
    assert np.ptp(error) < 1e-5


@pytest.mark.parametrize(
    ("values", "kwargs", "match"),
    [
        (np.zeros(1000), {}, "0 pulses"),
        (np.r_[np.zeros(10), np.ones(10)], {}, "1 pulses"),
        (np.sin(np.arange(1000.0)), {"threshold": 5.0}, "0 pulses cross the threshold 5"),
        (np.sin(np.arange(1000.0)), {"pulses_per_rev": 0}, "pulses_per_rev"),
        (np.sin(np.arange(1000.0)), {"channel": "nope"}, "there is no 'nope'"),
    ],
)
def test_tacho_errors(values, kwargs, match):
    with pytest.raises(SignalError, match=match):
        phase_from_tacho(make_signal(values, RATE), **kwargs)


def test_order_tracking_of_a_run_up_gives_one_line():
    _, angle = ramp(4.0)
    signal = make_signal(2.0 * np.cos(29 * angle) + 0.5 * np.cos(3.5 * angle), RATE, units="m/s^2")
    phase = phase_from_speed(signal, 1.0).copy(data=angle)
    angular = angular_resample(signal, phase)
    lines = order_spectrum(angular, segment=20.0)
    assert lines.sel(order=29.0, method="nearest").item() == pytest.approx(2.0, rel=1e-4)
    assert lines.sel(order=3.5, method="nearest").item() == pytest.approx(0.5, rel=1e-4)
    away = lines.where((abs(lines["order"] - 29) > 0.3) & (abs(lines["order"] - 3.5) > 0.3), drop=True)
    assert away.max() < 1e-4
    assert lines.attrs["units"] == "m/s^2"
    assert order_spectrum(angular, scaling="density").attrs["units"] == "(m/s^2)^2/order"


@pytest.mark.slow
@settings(max_examples=10, deadline=None, derandomize=True)
@given(f0=st.floats(10.0, 40.0), change=st.floats(0.6, 1.6), teeth=st.integers(10, 40))
def test_average_keeps_what_turns_with_the_shaft(f0, change, teeth):
    t, angle = ramp(3.0, f0, f0 * change)
    shaft = np.cos(teeth * angle + 0.5) + 0.3 * np.cos(angle)
    signal = make_signal(shaft + np.cos(2 * np.pi * 333.3 * t), RATE)
    phase = phase_from_speed(signal, 1.0).copy(data=angle)
    average = time_synchronous_average(signal, phase)
    theta = 2 * np.pi * average["angle"].values
    expected = np.cos(teeth * theta + 0.5) + 0.3 * np.cos(theta)
    assert np.abs(average.values[:, 0] - expected).max() < 3.0 / math.sqrt(average.attrs["averages"])
    clean = time_synchronous_average(make_signal(shaft, RATE), phase)
    assert np.abs(clean.values[:, 0] - expected).max() < 1e-3


def test_average_over_several_revolutions_and_its_progress():
    _, angle = ramp(2.0, 25.0, 25.0)
    signal = make_signal(np.cos(2.5 * angle), RATE)
    phase = phase_from_speed(signal, 50 * np.pi)
    seen = []
    two = time_synchronous_average(signal, phase, revolutions=2, progress=lambda f, s: seen.append(f))
    theta = 2 * np.pi * two["angle"].values
    np.testing.assert_allclose(two.values[:, 0], np.cos(2.5 * theta), atol=1e-4)
    # over one revolution order 2.5 alternates in sign: it averages to nothing over an even number of turns
    one = time_synchronous_average(signal.isel(time=slice(0, round(48 * RATE / 25) + 1)), phase)
    assert one.attrs["averages"] == 48
    assert np.abs(one.values).max() < 1e-3
    assert seen[-1] == 1.0


def test_phase_from_the_mesh_line():
    t = np.arange(round(5 * RATE)) / RATE
    wobble = 2 * np.pi * 30.0 * t + 0.1 * np.sin(2 * np.pi * 0.7 * t)
    rng = np.random.default_rng(4)
    x = np.cos(32 * wobble) + 0.5 * np.cos(31 * wobble) + 0.3 * rng.standard_normal(t.size)
    signal = make_signal({"poor": rng.standard_normal(t.size), "good": x}, RATE)
    phase = phase_from_line(signal, 960.0, 32)
    assert phase.attrs["channel"] == "good"
    error = phase.values - np.interp(phase["time"].values, t, wobble)
    assert np.ptp(error) < 3e-3
    assert phase.sizes["time"] > t.size - 3.9 / (0.15 * 30) * RATE
    with pytest.raises(SignalError, match=says("1000 samples", "10687", "widen half_bandwidth")):
        phase_from_line(signal[:1000], 960.0, 32)


def test_average_by_the_mesh_line_needs_no_tacho():
    t = np.arange(round(6 * RATE)) / RATE
    angle = 2 * np.pi * 25.0 * t + 0.5 * np.sin(2 * np.pi * 0.4 * t)
    depth = 0.4
    x = (1 + depth * np.cos(angle)) * np.cos(32 * angle)
    signal = make_signal(x, RATE)
    average = time_synchronous_average(signal, phase_from_line(signal, 800.0, 32))
    lines = np.abs(np.fft.rfft(average.values[:, 0])) * 2 / average.sizes["angle"]
    assert lines[32] == pytest.approx(1.0, rel=1e-2)
    assert lines[31] == pytest.approx(depth / 2, rel=3e-2)
    assert lines[33] == pytest.approx(depth / 2, rel=3e-2)


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    rpm=st.floats(300.0, 3000.0),
    teeth=st.integers(17, 60),
    seed=st.integers(0, 10_000),
    noise=st.sampled_from([0.0, 1e-3, 0.1]),
)
def test_speed_from_mesh_harmonics(rpm, teeth, seed, noise):
    gmf = teeth * rpm / 60
    if gmf >= RATE / 4.1:
        return
    rng = np.random.default_rng(seed)
    t = np.arange(25600) / RATE
    x = noise * rng.standard_normal(t.size)
    for k in range(1, 9):
        if k * gmf < RATE / 2:
            x += rng.uniform(0.1, 1) * np.cos(2 * np.pi * k * gmf * t + rng.uniform(0, 6))
    found = estimate_speed(make_signal(x, RATE), teeth)
    assert found.gmf == pytest.approx(gmf, abs=0.05)
    assert found.speed == pytest.approx(2 * math.pi * rpm / 60, rel=1e-3)


def test_speed_errors():
    noise = make_signal(np.random.default_rng(0).standard_normal(50_000), RATE)
    with pytest.raises(SignalError, match=says("signal", "speed_range", "mesh line stands")):
        estimate_speed(noise, 29)
    with pytest.raises(MissingMetadataError, match="teeth is missing"):
        estimate_speed(noise)
    with pytest.raises(SignalError, match="speed_range"):
        estimate_speed(noise, 29, speed_range=(1e4, 2e4))


def test_phase_must_increase_and_overlap():
    signal = make_signal(np.ones(1000), RATE)
    phase = phase_from_speed(signal, 100.0)
    with pytest.raises(SignalError, match=says("phase", "0.0628125 s", "give the angle")):
        angular_resample(signal, phase.copy(data=-phase.values))
    with pytest.raises(SignalError, match="does not overlap"):
        angular_resample(signal, phase.assign_coords(time=phase["time"] + 100.0))
    with pytest.raises(SignalError, match=says("average", "needed")):
        time_synchronous_average(signal, phase, revolutions=50)
