"""Signals of planetary sets: lines at the sensor, averages, bands, the phenomenological model."""

import math

import numpy as np
import pytest

from gearmbs.signals import (
    PlanetaryModel,
    SignalError,
    angular_resample,
    carrier_lines,
    fixed_sensor,
    make_signal,
    mesh_bands,
    order_spectrum,
    phase_from_speed,
    planetary_average,
)
from tests.says import says

LINES = {
    (100, 4): {96: 0.104, 100: 0.828, 104: 0.104},
    (70, 4): {64: 0.011, 68: 0.471, 70: 0.0, 72: 0.471, 76: 0.011},
    (56, 3): {54: 0.353, 57: 0.536, 60: 0.078},
    (99, 3): {96: 0.183, 99: 0.621, 102: 0.183},
    (62, 5): {60: 0.588, 65: 0.306},
}
"""Amplitudes of carrier orders at a fixed sensor, path function exp(4 (cos - 1)), by ring teeth and planets."""


@pytest.mark.parametrize("case", LINES)
def test_lines_at_a_fixed_sensor(case):
    teeth, planets = case
    lines = carrier_lines(teeth, planets)
    theta = 2 * math.pi * np.arange(4096) / 4096
    spectrum = 2 * np.abs(np.fft.rfft(PlanetaryModel((20, 30, teeth), planets, (1.0,)).values(theta))) / theta.size
    for order, amplitude in LINES[case].items():
        assert lines[order] == pytest.approx(amplitude, abs=6e-4)
        assert spectrum[order] == pytest.approx(lines[order], abs=1e-9)


def test_the_mesh_line_of_seventy_teeth_and_four_planets_vanishes():
    signal = PlanetaryModel((30, 20, 70), 4, (1.0,)).signal(8.0, 4096.0, 1.0)
    spectrum = 2 * np.abs(np.fft.rfft(signal.values[:, 0])) / signal.sizes["time"]
    at = {order: spectrum[order * 8] for order in (68, 70, 72)}
    assert 20 * math.log10(at[70] / at[68]) < -100
    # a bar of the mesh harmonic that knows the sidebands hears what is there
    band = mesh_bands(signal, 1.0, 70, 4, harmonics=1)
    assert float(band[0, 0]) == pytest.approx(math.sqrt(0.5 * (2 * 0.471**2 + 2 * 0.011**2)), rel=2e-3)


def test_unequal_spacing():
    angles = np.radians([0, 91.4, 180, 271.4])
    lines = carrier_lines(99, angles, sidebands=5)
    heard = {n for n, a in lines.items() if a > 1e-9}
    assert heard == {94, 96, 98, 100, 102, 104}
    assert max(lines, key=lines.get) == 98


def test_a_ring_without_a_path_has_no_sidebands():
    theta = 2 * math.pi * np.arange(4096) / 4096
    spectrum = np.abs(np.fft.rfft(PlanetaryModel((28, 36, 100), 4, (1.0,), sharpness=0.0).values(theta)))
    assert spectrum[100] > 1
    assert np.delete(spectrum, 100).max() < 1e-9 * spectrum[100]


@pytest.mark.parametrize("fault", ["planet", "sun", "ring"])
def test_faults_make_lines_at_their_orders(fault):
    teeth, planets = (28, 36, 100), 4
    turns, points = 63, 1024
    theta = 2 * math.pi * np.arange(turns * points) / points
    sound, faulty = (
        np.abs(np.fft.rfft(PlanetaryModel(teeth, planets, (1.0,), fault=f).values(theta))) for f in (None, fault)
    )
    # against the carrier: a planet's tooth z_r / z_p, the sun's z_r / z_s, the ring's once a turn
    step = {"planet": 100 / 36, "sun": 100 / 28, "ring": 1.0}[fault]
    grown = np.flatnonzero(faulty - sound > 1e-3 * sound.max()) / turns
    assert grown.size
    # whole multiples of the carrier's order around the fault's sidebands, which the path makes
    beside = grown[:, None] - 100 - step * np.array([-1, 0, 1])
    assert np.abs(beside - np.round(beside)).min(axis=1).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("teeth", [(23, 31, 85), (24, 30, 84)])
@pytest.mark.parametrize("which", ["planet", "sun"])
def test_averages_find_the_faulty_tooth(which, teeth):
    count = 3
    sun, own, ring = teeth
    rate, carrier = 20_000.0, 2.0
    turns = 40
    times = np.arange(round(turns / carrier * rate)) / rate
    theta = 2 * math.pi * carrier * times
    angles = 2 * math.pi * np.arange(count) / count
    tooth = 5
    sources = np.zeros((times.size, count))
    for k, psi in enumerate(angles):
        mesh = ring * (theta + psi) / (2 * math.pi)  # teeth of the ring passed, from the sensor
        wheel = mesh
        if which == "sun":
            wheel = ring * theta / (2 * math.pi) - sun * psi / (2 * math.pi)
        number = own if which == "planet" else sun
        off = (wheel - tooth + number / 2) % number - number / 2
        hit = np.exp(-((off / 0.3) ** 2)) * (1.0 if which == "sun" or k == 1 else 0.0)
        sources[:, k] = np.cos(2 * math.pi * mesh) + 3 * hit
    signal = make_signal(fixed_sensor(sources, theta, count), rate)
    phase = phase_from_speed(signal, 2 * math.pi * carrier)
    average = planetary_average(signal, phase, teeth, which, planets=count, planet=1)
    number = own if which == "planet" else sun
    assert average.sizes["angle"] == number * 32
    values = average.values[:, 0] - np.cos(2 * math.pi * np.arange(number * 32) / 32) * 0.9
    strongest = np.argmax(values) / 32
    assert abs((strongest - tooth + number / 2) % number - number / 2) < 0.3
    assert values.max() > 6 * np.median(np.abs(values))


def test_order_tracking_by_the_carrier():
    signal = PlanetaryModel((30, 20, 70), 4, (1.0,)).signal(10.0, 4096.0, 1.3)
    tracked = angular_resample(signal, phase_from_speed(signal, 2 * math.pi * 1.3), samples_per_rev=1024)
    spectrum = order_spectrum(tracked, segment=10)
    assert float(spectrum.sel(order=68, method="nearest")[0]) == pytest.approx(0.471, rel=0.01)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: PlanetaryModel((1, 2, 3), 0), says("planets", "0", "1 or more")),
        (lambda: PlanetaryModel((20, 30, 80), 3, fault="shaft"), says("fault", "'shaft'", "'sun'")),
        (lambda: PlanetaryModel((20, 30, 80), 3, planet=3), says("planet", "3", "0 to 2")),
        (lambda: fixed_sensor(np.zeros((5, 2)), np.zeros(5), 3), says("sources", "(5, 2)", "5 angles", "3 planets")),
    ],
)
def test_errors(build, words):
    with pytest.raises(SignalError, match=words):
        build()
