"""The crank-slider behind a pair: its torque, its flank changes, a broken tooth and an eccentric wheel."""

import numpy as np
import pytest

from gearmbs.drivetrain import RunSettings
from gearmbs.gears import faults
from gearmbs.signals import analyse
from gearmbs.studies import CrankSlider, run_train, train_signal
from tests.studies.presets import agrees_with_its_file


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


def test_the_file_is_the_pair():
    agrees_with_its_file("crank_slider", CrankSlider().train())
    other = CrankSlider(teeth=(21, 50), backlash=3e-4).train()
    assert [wheel.gear.teeth for wheel in other.wheels] == [21, 50]
    assert other.pairs["mesh"].backlash == 3e-4
    assert other.speeds["crank"] == pytest.approx(100.0 * np.pi / 30.0)


@pytest.mark.slow
@pytest.mark.parametrize("tol", [1e-6, 1e-7])
def test_four_flank_changes_a_turn(tol):
    """The flank that carries, by the impulse over 20 degrees of the crank: unloaded wheels clatter where it changes."""
    slider = CrankSlider()
    train = slider.train()
    turn = 2.0 * np.pi / slider.speed
    solution = slider.build().simulate(3.1 * turn, every_step=True, tol=tol, rate_scale=train.rate_scale)
    told = solution.contact("mesh")
    force = np.where(told["pairs_drive"] > 0, 1.0, -1.0) * told["normal_force"]
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(solution.t))])
    ends = turn * (1.0 + np.arange(2 * 18 + 1) / 18.0)
    sense = np.sign(np.diff(np.interp(ends, solution.t, impulse)))
    assert np.count_nonzero(np.diff(np.append(sense, sense[0]))) == 8


def recorded(*some, duration=2.4, tolerance=1e-6):
    slider = CrankSlider(load=20.0, backlash=3e-4, settings=(("friction", False), ("faults", some)))
    run = RunSettings(settling=0.1, duration=duration, tolerance=tolerance)
    return slider, run_train(slider.train(), run, mechanism=slider.build())


@pytest.mark.slow
def test_broken_tooth_shows_once_a_turn_of_its_wheel():
    slider, record = recorded(faults.BrokenTooth(wheel="driven", lost=0.9, tooth=7))
    rate = record.attrs["run_rate"]
    jerk = np.abs(np.diff(record.normal_force.values[:, 0], 2))
    places = np.flatnonzero(jerk > 0.5 * jerk.max()) / rate
    first = places[np.insert(np.diff(places) > 0.05, 0, True)]
    assert first.size == 4
    np.testing.assert_allclose(np.diff(first) * slider.speed / (2 * np.pi), 1.0, atol=0.01)


@pytest.mark.slow
def test_eccentric_wheel_has_its_first_sidebands():
    """By `analyse` on the recorded speed: the lines one crank order beside each mesh harmonic rise, no others."""
    beside = []
    for some in ((), (faults.Eccentricity(wheel="driven", amount="80 um"),)):
        # the first sidebands of the healthy pair are the integrator's errors alone: -59 to -66 dB at 1e-7
        _, record = recorded(*some, duration=4.8, tolerance=1e-7)
        report = analyse(train_signal(record, "speed"), wheel=2)
        lines = report.sidebands.squeeze("channel")
        beside.append(20.0 * np.log10(lines / lines.sel(sideband=0)))
    healthy, eccentric = beside
    rise = eccentric - healthy
    # of the slider's own torque, twice a turn, come the second ones
    for harmonic in (1, 2, 3):
        for side in (-1, 1):
            others = [float(rise.sel(harmonic=harmonic, sideband=k)) for k in (2 * side, 3 * side)]
            assert float(rise.sel(harmonic=harmonic, sideband=side)) > 20.0
            assert max(others) < 10.0
            assert float(eccentric.sel(harmonic=harmonic, sideband=side)) > -42.0
