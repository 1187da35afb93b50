"""The crank-slider behind a pair: its torque, its flank changes, a broken tooth and an eccentric wheel."""

import numpy as np
import pytest

from gearmbs.drivetrain import RunSettings
from gearmbs.gears import faults
from gearmbs.signals.orders import harmonic_amplitudes
from gearmbs.studies import CrankSlider, run_train


def test_inertia_torque_in_closed_form():
    """r 50 mm, l 200 mm, 1 kg, 100 rpm: 0.172960 N m at 36.66 and 323.34 degrees, sign changes at 76.72 and 283.28."""
    slider = CrankSlider()
    angle = np.linspace(0.0, 2.0 * np.pi, 720001)
    torque = slider.torque(angle)
    assert np.abs(torque).max() == pytest.approx(0.172960, abs=5e-7)
    assert np.rad2deg(angle[np.argmax(torque)]) == pytest.approx(323.34, abs=0.005)
    assert np.rad2deg(angle[np.argmin(torque)]) == pytest.approx(36.66, abs=0.005)
    assert torque[:-1].mean() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(np.rad2deg(slider.flank_changes()), [0.0, 76.72, 180.0, 283.28], atol=0.005)


def test_four_flank_changes_a_turn():
    slider = CrankSlider()
    train = slider.train()
    solution = slider.build().simulate(0.05 + 2 * 0.6, every_step=True, tol=1e-7, rate_scale=train.rate_scale)
    told = solution.contact("mesh")
    side = (told["pairs_drive"] > 0).astype(int) - (told["pairs_back"] > 0).astype(int)
    touching = (side != 0) & (solution.t > 0.05)
    changes = np.count_nonzero(np.diff(side[touching]))
    assert changes == 8


def recorded(*some):
    slider = CrankSlider(load=20.0, backlash=3e-4, settings=(("friction", False), ("faults", some)))
    run = RunSettings(settling=0.1, duration=2.4, tolerance=1e-6)
    return slider, run_train(slider.train(), run, mechanism=slider.build())


def test_broken_tooth_shows_once_a_turn_of_its_wheel():
    slider, record = recorded(faults.BrokenTooth(wheel="driven", lost=0.9, tooth=7))
    rate = record.attrs["run_rate"]
    jerk = np.abs(np.diff(record.normal_force.values[:, 0], 2))
    places = np.flatnonzero(jerk > 0.5 * jerk.max()) / rate
    first = places[np.insert(np.diff(places) > 0.05, 0, True)]
    assert first.size == 4
    np.testing.assert_allclose(np.diff(first) * slider.speed / (2 * np.pi), 1.0, atol=0.01)


def test_eccentric_wheel_has_its_first_sidebands():
    lines = []
    for some in ((), (faults.Eccentricity(wheel="driven", amount="80 um"),)):
        slider, record = recorded(*some)
        values = np.ascontiguousarray(record.transmission_error.values)
        turns = slider.speed / (2 * np.pi)
        lines.append(np.abs(harmonic_amplitudes(values, record.attrs["run_rate"], turns, np.arange(57.0, 64.0)))[:, 0])
    healthy, eccentric = (row / row[3] for row in lines)
    for side in (2, 4):
        assert eccentric[side] > 5.0 * healthy[side]
        assert eccentric[side] > 2.0 * max(eccentric[k] for k in (0, 1, 5, 6))
