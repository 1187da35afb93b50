"""RMS of the GMF harmonics, decimation, scaling, Newton and spectra against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.signals import (
    MissingMetadataError,
    SignalError,
    band_rms,
    decimate,
    dynamic_rms,
    force_components,
    force_to_acceleration,
    gmf_rms,
    harmonic_amplitudes,
    make_signal,
    resample,
    rms_factor,
    scale_states,
    spectrum,
)
from tests.says import says


def periodic(rate, gmf, amplitudes, seconds=1.0, mean=0.0, phase=0.3):
    t = np.arange(round(rate * seconds)) / rate
    return mean + sum(a * np.cos(2 * np.pi * k * gmf * t + k * phase) for k, a in enumerate(amplitudes, 1))


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    rpm=st.floats(600.0, 2500.0),
    amplitudes=st.lists(st.floats(0.01, 1.0), min_size=3, max_size=4),
    mean=st.floats(-1e4, 1e4),
    seconds=st.floats(0.4, 2.0),
)
def test_band_and_orders_agree_on_periodic_signals(rpm, amplitudes, mean, seconds):
    gmf = 29 * rpm / 60
    signal = make_signal(
        periodic(12800.0, gmf, amplitudes, seconds, mean), 12800.0, speed=2 * math.pi * rpm / 60, teeth=29
    )
    table = gmf_rms(signal)
    exact = np.array(amplitudes[:3]) / math.sqrt(2)  # RMS of A cos is A / sqrt(2)
    np.testing.assert_allclose(table["orders"][:, 0], exact, rtol=1e-3)
    np.testing.assert_allclose(table["band"][:, 0], table["orders"][:, 0], rtol=1e-3)
    np.testing.assert_allclose(table["frequency"], gmf * np.arange(1, 4))


def test_weak_harmonic_next_to_a_strong_one():
    rate, gmf = 12800.0, 483.3333
    values = periodic(rate, gmf, [100.0, 1.0, 0.1])
    table = gmf_rms(make_signal(values, rate), gmf)
    np.testing.assert_allclose(table["orders"][:, 0], np.array([100.0, 1.0, 0.1]) / math.sqrt(2), rtol=1e-4)
    np.testing.assert_allclose(table["band"][:, 0], table["orders"][:, 0], rtol=1e-3)


def test_band_counts_sidebands_and_orders_do_not():
    rate, gmf, shaft, depth = 12800.0, 480.0, 16.0, 0.4
    t = np.arange(12800) / rate
    am = (1 + depth * np.cos(2 * np.pi * shaft * t)) * np.cos(2 * np.pi * gmf * t)
    table = gmf_rms(make_signal(am, rate, teeth=30), gmf, harmonics=1)
    # carrier 1/sqrt 2; two sidebands of depth/2 each: mean square 1/2 + 2 (depth/2)^2 / 2
    assert table["orders"].item() == pytest.approx(1 / math.sqrt(2), rel=1e-6)
    assert table["band"].item() == pytest.approx(math.sqrt(0.5 + depth**2 / 4), rel=1e-3)


@pytest.mark.parametrize("turns", [0.95, 1.0, 1.02, 1.5, 1.9, 2.5, 3.3])
def test_sidebands_of_records_of_a_few_turns(turns):
    rate, gmf, shaft, depth = 12800.0, 491.0, 491.0 / 29.0, 0.4
    t = np.arange(int(turns * rate / shaft)) / rate
    am = (1 + depth * np.cos(2 * np.pi * shaft * t + 1.0)) * np.cos(2 * np.pi * gmf * t)
    table = gmf_rms(make_signal(am, rate, teeth=29), gmf, harmonics=1)
    # the band-pass takes 26 mesh periods
    assert (table.attrs["orders_turns"], table.attrs["band_turns"]) == (int(turns), int(turns - 26 / 29))
    found = {"orders": 1 / math.sqrt(2), "band": math.sqrt(0.5 + depth**2 / 4)}
    for way, wanted in found.items():
        off = abs(table[way].item() / wanted - 1.0)
        # a Hann weight over a single turn has half of a sideband in its line: 0.1 of 1
        assert off < 1e-3 if table.attrs[f"{way}_turns"] else off > 5e-3


def test_gmf_does_not_depend_on_where_the_record_starts_or_on_its_rate():
    gmf = 29 * 1000 / 60
    base = periodic(51200.0, gmf, [1.0, 0.5, 0.25, 0.1], 1.1)
    full = decimate(make_signal(base, 51200.0), 12800.0)
    later = decimate(make_signal(base[round(51200 / gmf) :], 51200.0), 12800.0)
    finer = make_signal(base, 51200.0)
    reference = gmf_rms(full, gmf)
    for other in (gmf_rms(later, gmf), gmf_rms(finer, gmf)):
        for way in ("band", "orders"):
            np.testing.assert_allclose(other[way], reference[way], rtol=5e-4)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    order=st.floats(1.0, 8.0),
    phase=st.floats(-3.0, 3.0),
    amplitude=st.floats(1e-3, 1e3),
    periods=st.floats(40.0, 300.0),
)
def test_harmonic_amplitude_and_phase(order, phase, amplitude, periods):
    order = round(order)
    rate, f = 10000.0, 123.4567
    t = np.arange(round(periods * rate / f)) / rate
    x = 5.0 + amplitude * np.cos(2 * np.pi * order * f * t + phase)
    c = harmonic_amplitudes(x[:, None], rate, f, np.array([order]))[0, 0]
    assert abs(c - amplitude * np.exp(1j * phase)) < 2e-4 * (amplitude + 5.0 / periods)


@pytest.mark.parametrize("name", ["speed", "angle"])
def test_gmf_of_a_speed_that_varies_asks_for_a_constant_one(name):
    """A part of the record at one speed is the twin, and so is a speed that is given."""
    t = np.arange(25600) / 12800.0
    speed = np.where(t < 1.0, 50.0 + 50.0 * t, 100.0)
    angle = np.cumsum(speed) / 12800.0
    signal = make_signal(np.cos(30.0 * angle), 12800.0, teeth=30)
    signal = signal.assign_coords({name: ("time", speed if name == "speed" else angle)})
    with pytest.raises(SignalError, match=says("speed", "477.", "954.", "constant", "pass")):
        gmf_rms(signal)
    late = signal.isel(time=slice(12801, None))
    levels = gmf_rms(late, harmonics=1)
    assert float(levels["orders"][0, 0]) == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert gmf_rms(signal, speed=100.0).attrs["gmf"] == pytest.approx(levels.attrs["gmf"])


def test_gmf_asks_for_missing_metadata_by_name():
    signal = make_signal(np.ones(1000), 12800.0)
    with pytest.raises(MissingMetadataError, match="speed is missing") as caught:
        gmf_rms(signal)
    assert caught.value.name == "speed"
    with pytest.raises(MissingMetadataError, match="teeth is missing"):
        gmf_rms(signal, speed=100.0)


@pytest.mark.parametrize(
    ("kwargs", "match"),
    [
        ({"gmf": 3000.0}, says("band", "5250", "6750", "6400", "sampling rate")),
        ({"gmf": -1.0}, "gmf: must be a positive"),
        ({"gmf": 480.0, "half_width": 0.8}, "half_width"),
        ({"gmf": 480.0, "harmonics": 0}, says("harmonics", "0", "at least 1")),
        ({"gmf": 480.0, "harmonics": 2.5}, r"harmonics: .*whole number, got 2\.5"),
        ({"gmf": 480.0, "harmonics": True}, "harmonics: .*whole number, got True"),
    ],
)
def test_gmf_refuses_what_it_cannot_do(kwargs, match):
    with pytest.raises(SignalError, match=match):
        gmf_rms(make_signal(np.sin(np.arange(12800.0)), 12800.0), **kwargs)


def test_gmf_short_record_says_what_it_needs():
    with pytest.raises(SignalError, match=says("300 samples", "480 Hz", "685", "longer record")):
        gmf_rms(make_signal(np.sin(np.arange(300.0)), 12800.0), 480.0)


def test_band_rms_is_zero_phase_and_needs_no_periodicity():
    rate = 12800.0
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(1 << 17)
    # white noise of unit variance has density 2 / rate: the band, 2 h wide and T for two halves of the transitions,
    # holds 2 (2 h + T) / rate
    got = band_rms(make_signal(noise, rate), 2000.0, half_width=200.0, transition=100.0).item()
    assert got == pytest.approx(math.sqrt(2 * (400.0 + 100.0) / rate), rel=0.03)


def test_decimation_keeps_the_pass_band_and_stops_aliases():
    old, new = 51200.0, 12800.0
    t = np.arange(51200) / old
    freqs_pass, freqs_stop = [10.0, 1000.0, 3333.0, 5120.0], [6400.0, 7000.0, 12800.0, 20000.0]
    for f in freqs_pass:
        out = decimate(make_signal(np.sin(2 * np.pi * f * t), old), new)
        assert np.abs(out.values[:, 0] - np.sin(2 * np.pi * f * out["time"].values)).max() < 2e-5
    for f in freqs_stop:
        out = decimate(make_signal(np.sin(2 * np.pi * f * t), old), new)
        assert np.abs(out.values).max() < 2e-5  # 100 dB is 1e-5


def test_decimation_edges_and_length():
    x = make_signal(np.arange(5000.0), 51200.0)
    kept = decimate(x, 12800.0, edges="extend")
    assert kept.sizes["time"] == 1250
    # a straight line continues as itself under point reflection
    np.testing.assert_allclose(kept.values[:, 0], np.arange(0.0, 5000.0, 4.0), atol=5e-2)
    short = decimate(x, 12800.0)
    np.testing.assert_allclose(short.values[:, 0], short["time"].values * 51200.0, atol=5e-2)
    with pytest.raises(SignalError, match="whole multiple"):
        decimate(x, 12000.0)


def test_decimation_in_blocks_equals_one_convolution():
    from gearmbs.signals import filters

    rng = np.random.default_rng(0)
    x = rng.standard_normal((200_001, 2))
    taps = filters.decimation_taps(4, 51200.0)
    got, first = filters.apply_zero_phase(x, taps, "trim", 4)
    whole = np.convolve(x[:, 1], taps, mode="valid")[::4]
    np.testing.assert_allclose(got[:, 1], whole, atol=1e-12)
    assert first == taps.size // 2


def test_resample_by_a_ratio():
    t = np.arange(44100) / 44100.0
    out = resample(make_signal(np.sin(2 * np.pi * 500 * t), 44100.0), 12800.0)
    inner = slice(500, -500)
    expected = np.sin(2 * np.pi * 500 * out["time"].values)
    assert np.abs(out.values[inner, 0] - expected[inner]).max() < 1e-4


def test_scaling_keeps_the_healthy_factor():
    t = np.arange(1000) / 1000.0
    healthy = make_signal(7.0 + 2.0 * np.sin(2 * np.pi * 10 * t), 1000.0)
    fault = make_signal(1.0 + 6.0 * np.sin(2 * np.pi * 10 * t), 1000.0)
    scaled = scale_states({"healthy": healthy, "fault": fault}, 5.0)
    assert dynamic_rms(scaled["healthy"]).item() == pytest.approx(5.0)
    assert dynamic_rms(scaled["fault"]).item() == pytest.approx(15.0)  # three times the healthy amplitude
    assert scaled["fault"].values.mean() == pytest.approx(0.0, abs=1e-12)
    assert scaled["fault"].attrs["scale_factor"] == pytest.approx(5.0 / math.sqrt(2.0))  # RMS of 2 sin is sqrt 2
    with pytest.raises(SignalError, match="does not vary"):
        rms_factor(make_signal(np.full(10, 3.0), 10.0), 1.0)
    with pytest.raises(SignalError, match="no state 'healthy'"):
        scale_states({"a": healthy}, 1.0)


def test_force_components_and_newton():
    alpha = math.radians(20.0)
    force = make_signal({"x": [3.0, 0.0], "y": [4.0, 1.0], "z": [12.0, 0.0]}, 10.0, units="N")
    parts = force_components(force, pressure_angle=alpha)
    np.testing.assert_allclose(parts.sel(channel="line_of_centres"), [3.0, 0.0])
    np.testing.assert_allclose(parts.sel(channel="tangential"), [4.0, 1.0])  # z cross x is y
    np.testing.assert_allclose(
        parts.sel(channel="line_of_action"), [4 * math.cos(alpha) + 3 * math.sin(alpha), math.cos(alpha)]
    )
    np.testing.assert_allclose(parts.sel(channel="resultant"), [13.0, 1.0])  # sqrt(9 + 16 + 144)
    acceleration = force_to_acceleration(parts, 2.0)
    assert acceleration.attrs["units"] == "m/s^2"
    np.testing.assert_allclose(acceleration.values, parts.values / 2.0)
    with pytest.raises(SignalError, match="must be in N"):
        force_to_acceleration(acceleration, 2.0)
    with pytest.raises(SignalError, match=says("mass", "0.0", "positive", "kg")):
        force_to_acceleration(parts, 0.0)


def test_components_turn_with_the_frame():
    rng = np.random.default_rng(1)
    vector = rng.standard_normal((20, 3))
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    plain = force_components(make_signal(vector, 1.0, channels=["x", "y", "z"]), pressure_angle=0.4)
    turned = force_components(
        make_signal(vector @ turn.T, 1.0, channels=["x", "y", "z"]),
        pressure_angle=0.4,
        centre_line=5 * turn[:, 0],
        axis=turn[:, 2],
    )
    np.testing.assert_allclose(turned.values, plain.values, atol=1e-12)


def test_spectrum_scalings():
    rate, n, amplitude = 1024.0, 4096, 3.0
    t = np.arange(n) / rate
    signal = make_signal(10.0 + amplitude * np.sin(2 * np.pi * 64 * t), rate, units="m/s^2")
    expected = {"amplitude": amplitude, "rms": amplitude / math.sqrt(2), "power": amplitude**2 / 2}
    for scaling, value in expected.items():
        for window in ("hann", "boxcar", "flattop"):
            line = spectrum(signal, scaling=scaling, window=window, segment=1024)
            assert line.sel(frequency=64.0).item() == pytest.approx(value, rel=1e-9)
    assert spectrum(signal, scaling="power").attrs["units"] == "(m/s^2)^2"
    density = spectrum(signal, scaling="density", segment=512)
    assert density.attrs["units"] == "(m/s^2)^2/Hz"
    # the density integrates to the mean square, A^2 / 2
    assert density.values.sum() * 2.0 == pytest.approx(amplitude**2 / 2, rel=1e-9)


def test_density_of_white_noise_is_twice_its_variance_over_the_rate():
    rng = np.random.default_rng(5)
    density = spectrum(make_signal(2.0 * rng.standard_normal(1 << 18), 1000.0), scaling="density", segment=1024)
    assert density.values[1:-1].mean() == pytest.approx(2 * 4.0 / 1000.0, rel=0.01)


def test_spectrum_at_the_ends_of_the_axis():
    # alternating +-1 is a line at half the rate with amplitude 1; a constant is a line at zero
    x = make_signal(2.0 + (-1.0) ** np.arange(64), 64.0)
    line = spectrum(x, window="boxcar", detrend=False)
    assert line.values[-1, 0] == pytest.approx(1.0)
    assert line.values[0, 0] == pytest.approx(2.0)
