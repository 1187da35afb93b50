"""Records whose speed changes: known speeds in any shape, angle through standstill, orders, maps, Campbell diagrams."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearmbs as gm
from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    analyse,
    angular_resample,
    campbell,
    critical_speeds,
    make_signal,
    order_map,
    order_track,
    phase_from_speed,
    phase_from_tacho,
    spectrogram,
    speed_curve,
    to_signal,
    waterfall,
)
from tests.says import says

RATE = 12800.0
RUN_UP = [("0 s", "0 rpm"), ("0.5 s", "0 rpm"), ("4.5 s", "3000 rpm"), ("5 s", "3000 rpm")]
RPM = math.pi / 30


def times(seconds=5.0):
    return np.arange(round(seconds * RATE)) / RATE


def run_up(noise=0.01):
    """A rest, a run-up to 3000 rpm and half a second there; orders 1, 29 and 58 of amplitude 0.3, 1 and 0.5."""
    angle = speed_curve(RUN_UP).angle(times())
    x = 0.3 * np.cos(angle) + np.cos(29 * angle) + 0.5 * np.cos(58 * angle)
    x = x + noise * np.random.default_rng(0).standard_normal(angle.size)
    return to_signal({"a": x}, rate="12.8 kHz", units="m/s^2", speed=RUN_UP), angle


@pytest.mark.parametrize(
    "speed",
    [
        [(0.0, 0.0), (2.0, 100.0)],
        [("0 s", "0 rad/s"), ("2000 ms", "100 rad/s")],
        ([0.0, 1.0, 2.0], [0.0, 50.0, 100.0]),
        np.array([[0.0, 0.0], [2.0, 100.0]]),
        lambda t: 50.0 * t,
        pd.Series([0.0, 100.0], index=[0.0, 2.0]),
        xr.DataArray([0.0, 100.0 / RPM], dims="time", coords={"time": [0.0, 2.0]}, attrs={"units": "rpm"}),
        [(0.0, 0.0), (2.0, -100.0)],
    ],
)
def test_a_speed_in_any_shape_is_the_same_ramp(speed):
    signal = make_signal(np.zeros(2000), 1000.0)
    phase = phase_from_speed(signal, speed)
    np.testing.assert_allclose(phase.values, 25.0 * signal["time"].values ** 2, atol=1e-3)


def test_angle_is_the_exact_integral_of_the_curve():
    curve = speed_curve([(1.0, 10.0), (2.0, 30.0), (4.0, 0.0)])
    t = np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0])
    np.testing.assert_allclose(curve.angle(t), [0.0, 10.0, 17.5, 30.0, 52.5, 60.0, 60.0])


@pytest.mark.parametrize(
    ("speed", "said"),
    [
        ("12 mm", says("speed", "'12 mm'", "quantity in rad/s")),
        ([(0.0, 10.0), (0.0, 20.0)], says("speed", "point 2", "increase")),
        ([(0.0, 10.0), (1.0, -20.0)], "turns back at t = 1 s"),
        ([(0.0, 0.0), (1.0, 0.0)], "zero throughout"),
        ([(0.0, np.nan), (1.0, 1.0)], says("speed", "NaN", "give")),
        ([1.0, 2.0, 3.0], says("speed", "list of points")),
        ({"a": 1}, "is no speed"),
        (-5.0, says("speed", "-5.0", "positive")),
        ([(10.0, 5.0), (11.0, 5.0)], says("10", "11 s", "0", "curve spans")),
    ],
)
def test_speeds_that_cannot_be(speed, said):
    with pytest.raises(SignalError, match=said):
        phase_from_speed(make_signal(np.zeros(100), 100.0), speed)


@pytest.mark.slow
def test_angular_resampling_through_standstill_is_short_and_free_of_aliases():
    t = times()
    signal, angle = run_up(0.0)
    # a tone fixed in frequency: an order that runs off to infinity where the shaft stands
    tone = make_signal(np.cos(2 * np.pi * 1000 * t), RATE)
    phase = phase_from_speed(tone, RUN_UP)
    resampled = angular_resample(signal, phase, samples_per_rev=256)
    assert resampled.sizes["angle"] == pytest.approx(256 * angle[-1] / (2 * np.pi), abs=2)
    at = 2 * np.pi * resampled["angle"].values
    expected = 0.3 * np.cos(at) + np.cos(29 * at) + 0.5 * np.cos(58 * at)
    inside = slice(300, -300)
    assert np.abs(resampled.values[inside, 0] - expected[inside]).max() < 2e-3
    slow = angular_resample(tone, phase, samples_per_rev=64)
    # 1000 Hz is order 32, half of 64, at 31.25 Hz or 1875 rpm: below, it must not come back as an alias
    before = slow["angle"].values * 2 * np.pi < np.interp(0.5 + 4.0 * 1500 / 3000, t, angle)
    assert np.abs(slow.values[before][200:]).max() < 1e-4
    assert angular_resample(signal, phase).sizes["angle"] < 10 * signal.sizes["time"]


@pytest.mark.slow
def test_rest_in_the_middle_costs_nothing():
    points = [(0, 0), (2, 100.0), (3, 0), (4, 0), (5, 100.0)]
    angle = speed_curve(points).angle(times())
    tracked = order_track(make_signal(np.cos(20 * angle), RATE), points, 20.0)
    assert np.abs(tracked.values - 1.0).max() < 0.01


def test_tracked_orders_are_constant_from_rest_to_full_speed():
    signal, _ = run_up()
    tracked = order_track(signal, orders=[1.0, 29.0, 58.0])
    for k, amplitude in enumerate((0.3, 1.0, 0.5)):
        np.testing.assert_allclose(tracked.values[:, k, 0], amplitude, rtol=0.01)
    assert tracked["speed"].values[-1] == pytest.approx(3000 * RPM, rel=1e-6)
    rms = order_track(signal, orders=29, scaling="rms")
    np.testing.assert_allclose(rms.values, 1 / math.sqrt(2), rtol=0.01)


def test_samples_without_a_rate_are_asked_for_it():
    samples = np.sin(np.arange(12800) / 10.0)
    for track in (order_track, order_map, spectrogram):
        with pytest.raises(SignalError, match=says("rate=", "pass to_signal")):
            track(samples, speed="1000 rpm")


def test_orders_in_the_place_of_the_speed_are_told():
    signal = make_signal(np.sin(np.arange(4000) / 10.0), 1000.0, speed=10.0)
    with pytest.raises(SignalError, match=says("orders=", "21", "42")):
        order_track(signal, [21, 42])


def test_order_map_keeps_orders_in_their_columns():
    signal, _ = run_up()
    found = order_map(signal, maximum=70.0)
    orders = found["order"].values
    near = np.abs(orders - 29) < 5
    lines = orders[near][found.values[:, near, 0].argmax(axis=1)]
    assert np.abs(lines / 29.0 - 1.0).max() < 0.01
    np.testing.assert_allclose(found.values[:, np.argmin(np.abs(orders - 29)), 0], 1.0, atol=0.2)


@pytest.mark.slow
def test_the_same_from_a_tacho_a_channel_of_speed_and_an_angle():
    signal, angle = run_up(0.0)
    speed = speed_curve(RUN_UP).at(times()) / RPM
    both = make_signal(
        {"a": signal.values[:, 0], "pulse": (np.sin(angle) > 0.95) * 5.0, "n": speed},
        RATE,
        units=["m/s^2", "V", "rpm"],
    )
    phase = xr.DataArray(angle, dims="time", coords={"time": both["time"].values}, attrs={"units": "rad"})
    for known in ({"tacho": "pulse"}, {"speed_channel": "n"}, {"phase": phase}, {"speed": phase}):
        tracked = order_track(both, orders=29, **known).sel(channel="a")
        assert np.abs(tracked.values[4:] - 1.0).max() < 0.03, known
    assert np.all(np.diff(phase_from_tacho(both, "pulse").values) > 0)
    with pytest.raises(SignalError, match="tacho and speed_channel: give one"):
        order_track(both, orders=29, tacho="pulse", speed_channel="n")
    with pytest.raises(MissingMetadataError, match="speed is missing"):
        order_track(both, orders=29)
    with pytest.raises(SignalError, match=says("'V'", "say its unit")):
        order_track(both, orders=29, speed_channel="pulse")


def test_a_speed_that_is_given_wins_over_the_signals_own():
    signal, angle = run_up(0.0)
    own = signal.assign_coords(angle=("time", 2.0 * angle))
    half = order_track(to_signal(own, speed=RUN_UP), orders=29)
    assert np.abs(half.values - 1.0).max() < 0.01
    assert np.abs(order_track(own, RUN_UP, 29).values - 1.0).max() < 0.01


def test_spectrogram_and_waterfall_of_a_run_up():
    signal, _ = run_up()
    slices = spectrogram(signal, segment=0.1)
    for time in (2.5, 4.8):
        here = slices.sel(time=time, method="nearest")
        expected = 29 * float(here["speed"]) / (2 * np.pi)
        assert float(here["frequency"][int(here.values[:, 0].argmax())]) == pytest.approx(expected, abs=25)
    lines = waterfall(signal, steps=20, maximum=2000.0)
    assert lines.sizes["speed"] == 20
    assert np.all(np.diff(lines["speed"].values) > 0)
    assert np.isnan(spectrogram(make_signal(np.ones(1000), 100.0)).coords.get("speed", np.nan)).all()


def test_waterfall_of_a_sweep():
    t = times(1.0)
    sweep = {f"{n} rpm": to_signal(np.cos(2 * np.pi * 20 * n / 60 * t), rate=RATE) for n in (900, 600, 1200)}
    lines = waterfall(sweep)
    np.testing.assert_allclose(lines["speed"].values / RPM, [600, 900, 1200])
    assert lines["frequency"].values[lines.values[:, :, 0].argmax(axis=1)].tolist() == [200.0, 300.0, 400.0]
    with pytest.raises(MissingMetadataError, match="record 1 of a waterfall"):
        waterfall(list(sweep.values()))
    with pytest.raises(SignalError, match="2 speeds for 3 records"):
        waterfall(list(sweep.values()), [1.0, 2.0])


def test_campbell_finds_the_critical_speeds():
    speeds = np.linspace(0.0, 100.0, 11) * 2 * np.pi
    found = campbell(lambda w: [300.0 + w / (2 * np.pi), 0.0, 1000.0], speeds, {"1×": 1.0, "20×": 20.0})
    table = critical_speeds(found)
    # 300 + n = 20 n at n = 300 / 19, and 1000 = 20 n at n = 50, in turns a second
    assert table["speed_rpm"].to_numpy() == pytest.approx([60 * 300 / 19, 3000.0])
    assert table["order"].tolist() == ["20×", "20×"]
    assert found.sizes["mode"] == 2
    with pytest.raises(SignalError, match=says("speeds", "'10 rpm'", "'5 rpm'", "increasing")):
        campbell([300.0], ["10 rpm", "5 rpm"])
    with pytest.raises(SignalError, match="does not fit 3 speeds"):
        campbell(np.ones((2, 4)), [1.0, 2.0, 3.0])
    with pytest.raises(SignalError, match=says("modes", "oscillates", "Campbell", "rigid")):
        campbell([0.0], [1.0, 2.0])


@pytest.mark.slow
def test_analysis_of_a_pair_that_speeds_up_follows_it_in_angle():
    signal, _ = run_up()
    report = analyse(signal, 29)
    np.testing.assert_allclose(
        report.harmonics["band"].values[:2, 0], [1 / math.sqrt(2), 0.5 / math.sqrt(2)], rtol=0.02
    )
    np.testing.assert_allclose(
        report.harmonics["orders"].values[:2, 0], [1 / math.sqrt(2), 0.5 / math.sqrt(2)], rtol=0.02
    )
    assert report.speed_range[1] == pytest.approx(3000 * RPM, rel=0.01)
    assert any("speed varies from 0.0 to 3000.0 rpm" in note for note in report.notes)
    plain = analyse(signal)
    first = plain.orders.set_index("order").loc[1.0, "rms"]
    assert first == pytest.approx(0.3 / math.sqrt(2), rel=0.02)


@pytest.mark.slow
def test_orders_of_what_becomes_a_signal():
    signal, _ = run_up()
    table = pd.DataFrame({"time": signal["time"].values, "a": signal.values[:, 0], "b": signal.values[:, 0]})
    tracks = order_track(table, RUN_UP, orders=(29, 58))
    np.testing.assert_array_equal(tracks.sel(channel="a"), tracks.sel(channel="b"))
    np.testing.assert_allclose(tracks.sel(channel="b").median("time"), [1.0, 0.5], rtol=1e-2)
    assert order_map(table, RUN_UP)["channel"].values.tolist() == ["a", "b"]


def test_columns_of_an_array_are_modes_that_may_cross():
    """300 + 100 x and 350 - 40 x against 500 x Hz over 3000 rpm: crossings at x = 3/4 and 350/540, by hand."""
    given = np.array([[300.0, 350.0], [400.0, 310.0]])
    for columns in ([0, 1], [1, 0]):
        found = gm.signals.critical_speeds(gm.campbell(given[:, columns], ["0 rpm", "3000 rpm"], {"mesh": 10}))
        speeds = np.sort(found["speed_rpm"])
        np.testing.assert_allclose(speeds, [3000.0 * 350.0 / 540.0, 2250.0], rtol=1e-12)
        np.testing.assert_allclose(np.sort(found["frequency_hz"]), 10.0 * speeds / 60.0, rtol=1e-12)


def test_rows_of_a_function_are_followed_by_their_frequencies():
    """Eigenvalues come in any order: here the second speed's are turned round."""
    rows = {0.0: [300.0, 350.0], 314.0: [420.0, 310.0]}
    diagram = gm.campbell(lambda speed: np.array(rows[speed]), [0.0, 314.0], [1])
    np.testing.assert_allclose(diagram["frequency"], [[300.0, 350.0], [310.0, 420.0]])
