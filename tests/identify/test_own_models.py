"""Parameters of mechanisms, drivetrains and planetary sets, from harmonics, orders and signals over time."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearmbs as gm
from gearmbs.gears import planetary, planetary_mechanism
from gearmbs.identify import Free, IdentifyError, MotionProblem, SignalProblem, fit, order_table
from gearmbs.mechanism import Mechanism
from gearmbs.signals import make_signal
from tests.says import says

FREE = [Free("stiffness", 7.0), Free("damping", 0.5)]
STIFFNESS, DAMPING = 9.0, 0.3
COLUMNS = ["case", "channel", "harmonic", "value", "sigma"]


def slide(force: str, speed: float = 0.0) -> Mechanism:
    """A mass of 1 kg on a slide."""
    m = Mechanism("oscillator", gravity=(0.0, 0.0, 0.0))
    body = m.body("mass", mass=1.0, inertia=(1.0, 1.0, 1.0), velocity=(speed, 0.0, 0.0))
    m.translational("slide", body, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.load("force", body.marker(name="I"), m.ground.marker(name="J"), fx=force)
    return m


def shaken(stiffness, damping):
    return slide(f"3*COS(2*TIME)+COS(4*TIME)-{damping!r}*VX(I,J)-{stiffness!r}*DX(I,J)")


def swinging(stiffness, damping):
    return slide(f"-{damping!r}*VX(I,J)-{stiffness!r}*DX(I,J)", speed=1.0)


def response(number):
    """Amplitude of the first or second harmonic of `shaken`: F / |k - w^2 + i d w|."""
    force, w = ((3.0, 2.0), (1.0, 4.0))[number - 1]
    return force / abs(STIFFNESS - w * w + 1j * DAMPING * w)


@pytest.mark.slow
def test_an_oscillator_from_two_harmonics_of_two_channels():
    rows = [("a", c, k, response(k) * (2.0 * k) ** (c == "v") / 2**0.5, 0.01) for c in "xv" for k in (1, 2)]
    table = pd.DataFrame(rows, columns=COLUMNS)
    problem = MotionProblem(table, shaken, FREE, {"x": "DX(I,J)", "v": "VX(I,J)"}, period=np.pi, tol=1e-8)
    found = problem.fit()
    # levels are those of a frequency response to 2e-5; they fix the damping to 30 times their own accuracy
    np.testing.assert_allclose(found.values, [STIFFNESS, DAMPING], rtol=1e-3)
    assert problem.motions < 15
    assert not found.notes


@pytest.mark.slow
def test_lines_of_a_spectrum_over_orders_are_harmonics():
    lines = np.zeros((81, 1))
    lines[[40, 80], 0] = response(1), response(2)
    spectrum = xr.DataArray(
        lines, dims=("order", "channel"), coords={"order": np.arange(81) / 40.0 * 29.0, "channel": ["x"]},
        attrs={"scaling": "amplitude"},
    )  # fmt: skip
    table = order_table({"a": spectrum}, [29.0, 58.0], first=29.0)
    np.testing.assert_allclose(table["value"], [response(1) / 2**0.5, response(2) / 2**0.5])
    assert table["harmonic"].tolist() == [1, 2]
    problem = MotionProblem(table, shaken, FREE, {"x": "DX(I,J)"}, period=np.pi, frequency=1.0 / np.pi, tol=1e-8)
    np.testing.assert_allclose(problem.fit().values, [STIFFNESS, DAMPING], rtol=1e-3)
    for settings, words in (({"first": 28.0}, ("29", "28")), ({"first": 1.0}, ("80", "58"))):
        with pytest.raises(IdentifyError, match=says("orders", *words)):
            order_table({"a": spectrum}, [29.0, 80.0], **settings)


@pytest.mark.slow
def test_an_oscillator_from_a_signal_with_profiles_beside_intervals():
    rate, t = 20.0, np.arange(100) / 20.0
    w = np.sqrt(STIFFNESS - DAMPING**2 / 4.0)
    x = np.exp(-0.5 * DAMPING * t) * np.sin(w * t) / w
    signal = make_signal({"x": x + 0.01 * np.random.default_rng(0).standard_normal(t.size)}, rate, units="m")
    problem = SignalProblem(signal, swinging, FREE, {"x": "DX(I,J)"}, sigma=0.01)
    found = problem.fit()
    assert problem.runs < 15
    assert (np.abs(np.log(found.values / [STIFFNESS, DAMPING])) < 3.0 * found.z_errors).all()
    linear, profiled = found.interval("damping"), found.profile_interval("damping", points=7)
    # the problem is almost linear over its errors: the two kinds of intervals differ by what its curvature is
    assert profiled == pytest.approx(linear, rel=5e-3)
    table = found.table(profiles=True)
    assert table.loc["damping", "profile_low"] == pytest.approx(linear[0], rel=5e-3)


@pytest.mark.slow
def test_what_is_missing_is_named():
    table = pd.DataFrame([("a", "x", 1, 1.0, 0.02), ("a", "x", 2, 1.0, 0.02)], columns=COLUMNS)
    with pytest.raises(IdentifyError, match=says("results", "channel x", "y")):
        MotionProblem(table, shaken, FREE, {"y": "DX(I,J)"}, period=np.pi)
    with pytest.raises(IdentifyError, match=says("measured", "a", "b")):
        MotionProblem(table, {"b": shaken}, FREE, {"x": "DX(I,J)"}, period=np.pi)
    with pytest.raises(IdentifyError, match=says("model of case 'a'", "period")):
        MotionProblem(table, shaken, FREE, {"x": "DX(I,J)"}).fit()
    with pytest.raises(IdentifyError, match=says("frequency", "0.5", "whole number")):
        MotionProblem(table, shaken, FREE, {"x": "DX(I,J)"}, period=np.pi, frequency=0.5).fit()
    with pytest.raises(IdentifyError, match=says("free", "also", "stiffness")):
        MotionProblem(table, shaken, [Free("stiffness", 7.0, also={"damping": 1.0})], {"x": "DX(I,J)"})


@pytest.mark.slow
def test_a_drivetrain_from_the_harmonics_of_its_mesh():
    """The load and the stiffness of a clutch, from the force of the teeth and the torque of the clutch."""
    from tests.studies.test_steady import train as pair_with_flywheel

    base = pair_with_flywheel(gm.drivetrain.SpeedDrive(name="drive", shaft="in", speed="1000 rpm"))

    def made(torque, stiffness):
        return base.changed("load", torque=torque).changed("clutch", stiffness=stiffness)

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    def power(solution):
        return force(solution) * solution.angular_velocity("out")[:, 2]

    results = {"force": force, "power": power}
    motion = gm.steady(made(60.0, 2e4))
    lines = {name: np.abs(motion.harmonics(of)) / 2**0.5 for name, of in results.items()}
    rows = [("a", name, k, lines[name][k], 0.02) for name in results for k in (1, 2, 3)]
    problem = MotionProblem(
        pd.DataFrame(rows, columns=COLUMNS), made, [Free("torque", 50.0), Free("stiffness", 2.5e4)], results, tol=1e-9
    )
    matrix = problem.derivatives()
    other = [np.log(np.abs(gm.steady(made(50.0 * f, 2.5e4), tol=1e-9).harmonics(force)[1:])) for f in (1.02, 0.98)]
    wanted = (other[0] - other[1]) / 0.04 / 0.02
    assert np.abs(matrix[:3, 0] - wanted).max() < 0.03 * np.abs(wanted).max()
    found = problem.fit()
    assert found["torque"] == pytest.approx(60.0, rel=5e-3)
    assert problem.motions < 15
    assert not found.notes


@pytest.mark.slow
def test_a_planetary_set_from_the_harmonics_of_a_mesh():
    gears = planetary((24, 30, 84), "1.5 mm", planets=3, backlash_sun="0.05 mm", backlash_ring="0.05 mm")
    period = 60.0 / (24 * 600.0)

    def made(torque):
        return planetary_mechanism(
            gears, speeds={"sun": "600 rpm"}, torques={"ring": -torque}, held="carrier", run_up=0
        )

    results = {name: lambda s, name=name: s.contact(name)["normal_force"] for name in ("sun-planet 1", "planet 1-ring")}
    truth = gm.steady(made(50.0), period)
    rows = [
        (n, r, k, abs(truth.harmonics(of)[k]) / 2**0.5, 0.02)
        for n in "a"
        for r, of in results.items()
        for k in (1, 2, 3)
    ]
    problem = MotionProblem(pd.DataFrame(rows, columns=COLUMNS), made, [Free("torque", 45.0)], results, period=period)
    assert problem.fit()["torque"] == pytest.approx(50.0, rel=1e-2)


@pytest.mark.slow
def test_frequencies_are_of_channels_that_there_are_and_may_be_texts():
    """3 cos 2t + cos 4t on k = 9 and d = 0.3: of frequency 2/pi Hz the line is 1/|k - 16 + 1.2 i|, RMS."""
    table = pd.DataFrame([("a", "x", 1, 1.0, 0.02)], columns=COLUMNS)

    def level(frequency):
        problem = MotionProblem(table, shaken, FREE, {"x": "DX(I,J)"}, period=np.pi, frequency=frequency)
        return float(np.exp(problem.predictions([np.array([9.0, 0.3])])[0])[0])

    expected = 1.0 / abs(9.0 - 16.0 + 1.2j) / np.sqrt(2.0)
    for frequency in (2.0 / np.pi, {"x": 2.0 / np.pi}, {"x": f"{2000.0 / np.pi!r} mHz"}):
        assert level(frequency) == pytest.approx(expected, rel=1e-4)
    with pytest.raises(IdentifyError, match=says("frequency", "X", "x")):
        level({"X": 2.0 / np.pi})


def measured_signal(t, damping=DAMPING):
    w = np.sqrt(STIFFNESS - damping**2 / 4.0)
    values = np.exp(-0.5 * damping * t) * np.sin(w * t) / w
    return xr.DataArray(values[:, None], dims=("time", "channel"), coords={"time": t, "channel": ["x"]})


@pytest.mark.slow
def test_a_fit_that_finds_no_values_says_why():
    t = np.arange(20) / 20.0

    def broken(stiffness, damping):
        return slide("-SQRT(-1)")

    problem = SignalProblem(measured_signal(t), broken, FREE, {"x": "DX(I,J)"}, sigma=0.01)
    for asked in (problem.fit, problem.derivatives):
        with pytest.raises(IdentifyError, match=says("give", "A run failed", "SQRT(-1)")):
            asked()


def test_times_that_fall_are_refused_before_anything_runs():
    t = np.array([0.0, 0.2, 0.1])
    with pytest.raises(IdentifyError, match=says("signals: measured", "0.1 s", "0.2 s", "later")):
        SignalProblem(measured_signal(t), swinging, FREE, {"x": "DX(I,J)"}, sigma=0.01)


def test_starts_with_units_are_read_in_si_or_refused():
    t = np.arange(20) / 20.0

    def problem(start, **bounds):
        return SignalProblem(
            measured_signal(t), swinging, [Free("stiffness", start, **bounds), FREE[1]], {"x": "DX(I,J)"}, sigma=0.01
        )

    read = problem("0.007 N/mm", low="1 N/m", high=30.0).free[0]
    assert (read.start, read.low, read.high) == pytest.approx((7.0, 1.0, 30.0))
    with pytest.raises(IdentifyError, match=says("stiffness", "7 pumps", "unit")):
        problem("7 pumps")
    with pytest.raises(IdentifyError, match=says("stiffness", "25 Hz", "157.08 in rad/s")):
        problem("25 Hz")
    with pytest.raises(IdentifyError, match=says("low", "1 N/m", "number")):
        fit(lambda p: p, [1.0], [Free("a", 2.0, low="1 N/m")])


@pytest.mark.slow
def test_a_start_without_derivatives_takes_differences_there():
    """A damping of zero has no place in the text of a force: that start has no derivative by it, its neighbours do."""
    t = np.arange(60) / 20.0
    free = [Free("stiffness", 8.0), Free("damping", 0.0, low=-1.0, high=1.0, log=False)]
    problem = SignalProblem(measured_signal(t), swinging, free, {"x": "DX(I,J)"}, sigma=0.01)
    found = problem.fit()
    np.testing.assert_allclose(found.values, [STIFFNESS, DAMPING], rtol=1e-4)
    assert any("differences" in note and "damping" in note for note in found.notes)
