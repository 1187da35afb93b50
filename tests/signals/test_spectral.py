"""Conversion, envelope, spectral kurtosis and cepstrum against closed forms."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.signals import (
    SignalError,
    convert,
    envelope,
    envelope_spectrum,
    kurtogram,
    make_signal,
    power_cepstrum,
    spectral_kurtosis,
    units_of,
)
from gearmbs.signals.conversion import band_window
from gearmbs.signals.signal.units import unit_dimension
from tests.says import says

RATE = 12800.0
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    frequency=st.floats(15.0, 4500.0),
    start=st.sampled_from(list(POWER)),
    to=st.sampled_from(list(POWER)),
    phase=st.floats(-3.0, 3.0),
    offset=st.floats(-100.0, 100.0),
)
@pytest.mark.slow
def test_a_sine_converts_by_powers_of_its_frequency(frequency, start, to, phase, offset):
    t = np.arange(4 * 12800) / RATE
    w = 2 * np.pi * frequency
    units = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
    signal = make_signal(offset + 3 * np.cos(w * t + phase), RATE, units=units[start])
    result = convert(signal, to, band=(10.0, 5000.0))
    factor = (1j * w) ** (POWER[to] - POWER[start])
    expected = 3 * np.real(factor * np.exp(1j * (w * result["time"].values + phase)))
    assert np.abs(result.values[:, 0] - expected).max() < 2e-3 * 3 * abs(factor)
    assert units_of(result) == [units[to]]
    assert result.attrs["band"] == (10.0, 5000.0)


def test_there_and_back_again():
    rng = np.random.default_rng(0)
    t = np.arange(4 * 12800) / RATE
    x = sum(rng.uniform(0.1, 1) * np.cos(2 * np.pi * f * t + f) for f in rng.uniform(30, 4000, 20))
    signal = make_signal(x, RATE, units="m/s")
    back = convert(convert(signal, "displacement", band=(10.0, 5000.0)), "velocity", band=(10.0, 5000.0))
    inside = slice(round(float(back["time"][0]) * RATE), round(float(back["time"][0]) * RATE) + back.sizes["time"])
    assert np.abs(back.values[:, 0] - x[inside]).max() < 1e-3 * np.abs(x).max()


def test_nothing_outside_the_band_remains():
    t = np.arange(4 * 12800) / RATE
    signal = make_signal(np.cos(2 * np.pi * 5 * t) + np.cos(2 * np.pi * 3000 * t), RATE, units="m/s^2")
    result = convert(signal, "velocity", band=(100.0, 2000.0))
    assert np.abs(result.values).max() < 1e-3 / (2 * np.pi * 100)
    window = band_window(np.array([74.9, 100.0, 2000.0, 2501.0, 87.5]), 100.0, 2000.0)
    np.testing.assert_allclose(window, [0, 1, 1, 0, 0.5], atol=1e-12)


def test_units_convert_to_si_and_keep_edges():
    t = np.arange(12800) / RATE
    signal = make_signal(
        {"a": np.cos(2 * np.pi * 500 * t), "b": np.cos(2 * np.pi * 500 * t)}, RATE, units=["g", "mm/s"]
    )
    result = convert(signal, "acceleration", band=(50.0, 5000.0))
    assert np.abs(result.values[:, 0]).max() == pytest.approx(9.80665, rel=1e-3)
    assert np.abs(result.values[:, 1]).max() == pytest.approx(1e-3 * 2 * np.pi * 500, rel=1e-3)
    kept = convert(signal, "acceleration", band=(50.0, 5000.0), edges="keep")
    assert kept.sizes == signal.sizes
    same = convert(signal, "acceleration", band=("50 Hz", "5 kHz"), edges="keep")
    np.testing.assert_array_equal(same.values, kept.values)


@pytest.mark.parametrize(
    ("unit", "dimension", "factor"),
    [
        ("m/s2", "acceleration", 1.0),
        ("m/s²", "acceleration", 1.0),
        ("g", "acceleration", 9.80665),
        ("mm/s", "velocity", 1e-3),
        ("µm", "displacement", 1e-6),
        ("kN", "force", 1e3),
        ("inch/s", "velocity", 0.0254),
    ],
)
def test_unit_dimensions(unit, dimension, factor):
    assert unit_dimension(unit) == (dimension, pytest.approx(factor))


@pytest.mark.parametrize("unit", ["unknown", "", "V", "bananas", "m/s/"])
def test_units_that_measure_no_vibration(unit):
    with pytest.raises(SignalError, match="is not a unit of"):
        convert(make_signal(np.ones(20000), RATE, units=unit), "velocity", band=(10.0, 100.0))


@pytest.mark.parametrize(
    ("kwargs", "match"),
    [
        ({"to": "jerk", "band": (10.0, 100.0)}, "to: .*one of"),
        ({"to": "velocity", "band": (100.0, 10.0)}, says("band", "(100.0, 10.0)", "6400 Hz")),
        ({"to": "velocity", "band": (10.0, 6401.0)}, says("band", "(10.0, 6401.0)", "6400 Hz")),
        ({"to": "velocity", "band": (0.0, 10.0)}, says("band", "(0.0, 10.0)", "6400 Hz")),
        ({"to": "velocity", "band": ("10 mm", "1 kHz")}, says("band", "10 mm", "Hz")),
        ({"to": "velocity", "band": (1.0, 10.0)}, says("1.5625 s", "6 s", "raise band[0]", "edges='keep'")),
    ],
)
def test_conversion_errors(kwargs, match):
    with pytest.raises(SignalError, match=match):
        convert(make_signal(np.ones(20000), RATE, units="m/s^2"), **kwargs)


def test_a_band_may_end_at_half_the_rate():
    signal = make_signal(np.sin(np.arange(20000.0)), RATE, units="m/s^2")
    assert convert(signal, "velocity", band=(100.0, 6400.0)).attrs["band"] == (100.0, 6400.0)


def test_envelope_of_an_am_tone():
    t = np.arange(2 * 12800) / RATE
    modulation = 1 + 0.5 * np.cos(2 * np.pi * 30 * t)
    signal = make_signal(2 * modulation * np.cos(2 * np.pi * 2000 * t) + np.cos(2 * np.pi * 300 * t), RATE, units="g")
    result = envelope(signal, (1800.0, 2200.0))
    expected = 2 * (1 + 0.5 * np.cos(2 * np.pi * 30 * result["time"].values))
    assert np.abs(result.values[:, 0] - expected)[1000:-1000].max() < 1e-3
    lines = envelope_spectrum(signal, (1800.0, 2200.0), segment=0.5)
    assert lines.sel(frequency=30.0).item() == pytest.approx(1.0, rel=1e-3)
    assert units_of(lines) == ["g"]
    with pytest.raises(SignalError, match=says("band", "6400 Hz", "(2000.0, 7000.0)")):
        envelope(signal, (2000.0, 7000.0))


def test_spectral_kurtosis_of_noise_tone_and_bursts():
    rng = np.random.default_rng(8)
    n = 400_000
    noise = rng.standard_normal(n)
    flat = spectral_kurtosis(make_signal(noise, RATE), segment=128)
    # circular Gaussian lines: 0 with standard error 2 / sqrt(frames) = 0.02 to 0.04
    assert np.nanmax(np.abs(flat.values)) < 0.25
    t = np.arange(n) / RATE
    tone = spectral_kurtosis(make_signal(np.cos(2 * np.pi * 2000 * t), RATE), segment=128)
    assert tone.sel(frequency=2000.0).item() == pytest.approx(-1.0, abs=1e-6)  # |X| is constant: 1 - 2
    bursts = np.zeros(n)
    ring = np.exp(-np.arange(200) / 40) * np.cos(2 * np.pi * 3000 / RATE * np.arange(200))
    for start in range(0, n - 200, 1600):
        bursts[start : start + 200] += 4 * ring
    found = spectral_kurtosis(make_signal(bursts + noise, RATE), segment=128)
    best = float(found["frequency"][np.nanargmax(found.values[:, 0])])
    assert abs(best - 3000) <= 150
    assert np.nanmax(found.values) > 1


@pytest.mark.slow
def test_kurtogram_of_noise_tone_and_bursts():
    rng = np.random.default_rng(8)
    n = 1 << 18
    noise = rng.standard_normal(n)
    quiet = kurtogram(make_signal(noise, RATE), levels=4)
    assert np.abs(quiet["kurtosis"].values).max() < 0.2
    assert quiet["bands"].values[:6].tolist() == [1, 2, 2, 3, 3, 3]
    t = np.arange(n) / RATE
    tone = kurtogram(make_signal(np.cos(2 * np.pi * 1000 * t), RATE), levels=3)
    assert tone["kurtosis"].values[0, 0] == pytest.approx(-1.0, abs=1e-3)
    bursts = noise.copy()
    ring = np.exp(-np.arange(300) / 60) * np.cos(2 * np.pi * 3000 / RATE * np.arange(300))
    for start in range(0, n - 300, 3000):
        bursts[start : start + 300] += 10 * ring
    found = kurtogram(make_signal(bursts, RATE), levels=5)
    low = found["best_centre"].item() - found["best_bandwidth"].item() / 2
    high = found["best_centre"].item() + found["best_bandwidth"].item() / 2
    assert low <= 3000 <= high
    assert found["best_kurtosis"].item() > 5
    with pytest.raises(SignalError, match=says("levels", "7", "16 bins", "100 samples")):
        kurtogram(make_signal(np.ones(100), RATE))


def test_cepstrum_of_an_echo():
    # |1 + a e^(-i w T)|^2 has the logarithm 2 sum_k (-1)^(k+1) a^k / k cos(k w T): a at T, -a^2/2 at 2 T, a^3/3 at 3 T
    x = np.zeros(1024)
    x[10], x[60] = 1.0, 0.5
    cepstrum = power_cepstrum(make_signal(x, RATE)).values[:, 0]
    assert cepstrum[50] == pytest.approx(0.5, abs=1e-3)
    assert cepstrum[100] == pytest.approx(-0.125, abs=1e-3)
    assert cepstrum[150] == pytest.approx(0.5**3 / 3, abs=1e-3)


def test_cepstrum_finds_the_spacing_of_sidebands():
    t = np.arange(4 * 12800) / RATE
    rng = np.random.default_rng(0)
    x = sum(np.cos(2 * np.pi * (2000 + 32 * k) * t + rng.uniform(0, 6)) for k in range(-30, 31))
    signal = make_signal(x + 1e-2 * rng.standard_normal(t.size), RATE)
    cepstrum = power_cepstrum(signal, segment=1.0, window="hann")
    window = (cepstrum["quefrency"] > 0.02) & (cepstrum["quefrency"] < 0.05)
    best = float(cepstrum["quefrency"][window][cepstrum.values[window, 0].argmax()])
    assert best == pytest.approx(1 / 32, rel=0.01)
    with pytest.raises(SignalError, match=says("channel 'ch1'", "sample 0", "logarithm")):
        power_cepstrum(make_signal(np.zeros(100), RATE))
    assert math.isfinite(float(cepstrum.max()))
