"""Spectral correlation, deconvolution and zones of severity against what is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.signals import (
    SignalError,
    make_signal,
    maximum_correlated_kurtosis,
    minimum_entropy,
    spectral_correlation,
    vibration_zones,
)
from tests.says import says

RATE = 10000.0
TIME = np.arange(100_000) / RATE
PATH = np.exp(-np.arange(80) / 20.0) * np.cos(0.9 * np.arange(80) + 0.3)
PERIOD = 200


def noise(seed=0, size=TIME.size):
    return np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize("depth", [0.3, 0.8])
@pytest.mark.slow
def test_correlation_of_modulated_noise(depth):
    """Of (1 + m cos) times noise of unit variance: S(0) = 2 (1 + m^2/2)/rate one-sided, and lines of m and m^2/4."""
    values = (1.0 + depth * np.cos(2 * np.pi * 40.0 * TIME)) * noise()
    found = spectral_correlation(values, "200 Hz", rate=RATE)
    power = 1.0 + depth**2 / 2.0
    inner = found.isel(frequency=slice(5, -5))
    assert abs(inner["correlation"][0]).mean() == pytest.approx(2.0 * power / RATE, rel=0.02)
    for cyclic, line in ((40.0, depth), (80.0, depth**2 / 4.0)):
        at = inner.sel(cyclic=cyclic, method="nearest")
        assert abs(complex(at["correlation"].mean())) == pytest.approx(2.0 * line / RATE, rel=0.05, abs=3e-6)
    coherence = inner["coherence"].mean("frequency")
    assert float(coherence.sel(cyclic=40.0, method="nearest")) == pytest.approx(depth / power, rel=0.05)
    assert float(coherence.sel(cyclic=slice(50.0, 70.0)).mean()) < 0.04


def test_coherence_shows_the_carriers_that_an_envelope_of_all_hides():
    carrier = np.convolve(noise(1), PATH, mode="same") * (1.0 + np.cos(2 * np.pi * 33.0 * TIME))
    found = spectral_correlation(0.3 * carrier + 6.0 * noise(2), 100.0, rate=RATE)
    line = found["coherence"].sel(cyclic=33.0, method="nearest")
    assert float(line.idxmax()) == pytest.approx(0.9 * RATE / (2 * np.pi), rel=0.06)
    assert float(found["envelope"].where(found["cyclic"] > 1.0).idxmax()) == pytest.approx(33.0, abs=0.1)


def test_what_a_spectral_correlation_refuses():
    signal = make_signal(noise(), RATE, channels=["a"])
    with pytest.raises(SignalError, match=says("highest", "4000", "2500")):
        spectral_correlation(signal, "4 kHz")
    with pytest.raises(SignalError, match=says("blocks", "longer record")):
        spectral_correlation(signal.isel(time=slice(0, 300)), 100.0)
    with pytest.raises(SignalError, match=says("channel", "b", "a")):
        spectral_correlation(signal, 100.0, channel="b")


def blows(knock=0.0, level=0.35):
    """Forty blows of 1 behind a path in noise, and one of another size behind another path."""
    out = np.zeros(8000)
    out[100::PERIOD] = 1.0
    other = knock * np.exp(-np.arange(80) / 20.0) * np.cos(2.2 * np.arange(80))
    heard = np.convolve(out, PATH)[: out.size] + level * noise(1, out.size)
    heard[4321 : 4321 + other.size] += other
    return heard


def folded(values):
    """Mean square over the period of the blows: its largest by its median."""
    turn = (values.reshape(-1, PERIOD) ** 2).mean(axis=0)
    return turn.max() / np.median(turn)


def test_blows_behind_a_path_are_sharpened():
    values = blows()
    for found in (
        minimum_entropy(values, rate=RATE),
        maximum_correlated_kurtosis(values, "20 ms", rate=RATE),
        maximum_correlated_kurtosis(values, 0.02, shifts=3, rate=RATE),
    ):
        assert folded(found.values[:, 0]) > 3.0 * folded(values)
        rising = np.diff(found.attrs["kurtosis"][0])
        assert rising.size
        assert np.all(rising > 0.0)
        assert float(found.std()) == pytest.approx(values.std())


def test_a_single_knock_draws_minimum_entropy_and_not_the_one_that_knows_the_period():
    values = blows(knock=4.0)

    def without_the_knock(found):
        kept = found.copy()
        kept[4200:4600] = 0.0
        return folded(kept)

    entropy = minimum_entropy(values, rate=RATE).values[:, 0]
    correlated = maximum_correlated_kurtosis(values, 0.02, rate=RATE).values[:, 0]
    assert 4321 <= int(np.argmax(np.abs(entropy))) < 4321 + 144
    assert without_the_knock(entropy) < 0.5 * without_the_knock(values)
    assert without_the_knock(correlated) > 3.0 * without_the_knock(values)


def test_what_deconvolution_refuses():
    with pytest.raises(SignalError, match=says("period", "shifts=1", "samples")):
        maximum_correlated_kurtosis(blows(), 1e-4, rate=RATE)
    with pytest.raises(SignalError, match=says("length", "5000", "quarter")):
        minimum_entropy(blows(), length=5000, rate=RATE)
    with pytest.raises(SignalError, match=says("rounds", "0", "1 or more")):
        minimum_entropy(blows(), rounds=0, rate=RATE)
    silent = minimum_entropy(np.zeros(1000), rate=RATE)
    assert not silent.values.any()


@pytest.mark.parametrize(
    ("velocity", "group", "support", "zone"),
    [
        (1.3, 2, "rigid", "A"), (1.5, 2, "rigid", "B"), (2.7, 2, "rigid", "B"), (2.9, 2, "rigid", "C"),
        (4.6, 2, "rigid", "D"), (4.4, 2, "flexible", "B"), (4.6, 1, "flexible", "B"), (7.2, 1, "rigid", "D"),
        (10.9, 1, "flexible", "C"),
    ],
)  # fmt: skip
def test_zones_at_their_limits(velocity, group, support, zone):
    """At 100 Hz, where the velocity decides: 4.5 mm/s are 7.2 um."""
    wave = 1e-3 * velocity * np.sqrt(2.0) * np.cos(2 * np.pi * 100.0 * TIME)
    table = vibration_zones(wave, "3000 rpm", group=group, support=support, rate=RATE, units="m/s")
    assert table["zone"][0] == table["velocity_zone"][0] == zone
    assert table["velocity"][0] == pytest.approx(1e-3 * velocity, rel=1e-3)


def test_slow_machines_need_limits_of_the_displacement_which_then_decides():
    omega = 2 * np.pi * 5.0
    wave = 60e-6 * omega**2 * np.sqrt(2.0) * np.cos(omega * TIME)
    limits = ("10 um", "50 um", 100e-6)
    table = vibration_zones(wave, "300 rpm", rate=RATE, units="m/s^2", displacement=limits)
    assert table["displacement"][0] == pytest.approx(60e-6, rel=0.02)
    assert (table["velocity_zone"][0], table["displacement_zone"][0], table["zone"][0]) == ("B", "C", "C")
    assert "long" in table["meaning"][0]
    with pytest.raises(SignalError, match=says("displacement", "300 rpm", "zones A, B and C")):
        vibration_zones(wave, "300 rpm", rate=RATE, units="m/s^2")
    quick = vibration_zones(wave, "600 rpm", rate=RATE, units="m/s^2")
    assert "displacement_zone" not in quick
    assert quick["zone"][0] == quick["velocity_zone"][0]


def test_what_zones_refuse():
    with pytest.raises(SignalError, match=says("group, support", "3", "rigid")):
        vibration_zones(TIME, "1500 rpm", group=3, rate=RATE, units="m/s")
    with pytest.raises(SignalError, match=says("100 rpm", "120 rpm")):
        vibration_zones(TIME, "100 rpm", rate=RATE, units="m/s")
    with pytest.raises(SignalError, match=says("units", "Pa")):
        vibration_zones(TIME, "1500 rpm", rate=RATE, units="Pa")
    with pytest.raises(SignalError, match=says("displacement", "50 um", "increase")):
        vibration_zones(TIME, "300 rpm", rate=RATE, units="m/s", displacement=("50 um", "20 um", "90 um"))


def test_zones_need_a_record_as_long_and_as_fast_as_their_band():
    wave = 10.0 * np.cos(2 * np.pi * 25.0 * np.arange(12800) / 12800.0)
    with pytest.raises(SignalError, match=says("0.0117 s", "10 Hz", "0.5 s")):
        vibration_zones(wave[:150], "1500 rpm", rate=12800, units="mm/s")
    with pytest.raises(SignalError, match=says("rate", "15 Hz", "2000 Hz")):
        vibration_zones(wave, "1500 rpm", rate=15, units="mm/s")
    short = vibration_zones(wave[:6400], "1500 rpm", rate=12800, units="mm/s")
    assert short["velocity"][0] == pytest.approx(7.07e-3, rel=0.02)
    assert not short["meaning"][0].startswith("at least")
    slow = vibration_zones(wave[::32], "1500 rpm", rate=400, units="mm/s")
    assert slow["zone"][0] == "D"
    assert slow["meaning"][0].startswith("at least")
    assert "200 Hz" in slow["meaning"][0]


def test_zones_of_ones_own_limits_of_velocity():
    """As of a standard for gear units: 3 mm/s is in zone C of the tables, in B of these."""
    time = np.arange(50000) / 10000.0
    wave = 3.0 * np.sqrt(2.0) * np.cos(2 * np.pi * 25 * time)
    known = {"rate": 10000.0, "units": "mm/s"}
    assert vibration_zones(wave, "1500 rpm", **known)["zone"][0] == "C"
    own = vibration_zones(wave, "1500 rpm", velocity=("2 mm/s", "4 mm/s", 0.008), **known)
    assert own["velocity_zone"][0] == "B"
    for wrong in (("4 mm/s", "2 mm/s", "8 mm/s"), ("2 mm/s", "4 mm/s")):
        with pytest.raises(SignalError, match=says("velocity", "zones", "increase")):
            vibration_zones(wave, "1500 rpm", velocity=wrong, **known)
