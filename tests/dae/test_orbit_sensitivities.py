"""Derivatives of steady motions against closed forms, independent shooting, and differences of motions."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.studies import Case, case_mechanism
from tests.dae.test_orbits import reference
from tests.says import says

TAU = 2.0 * np.pi


def slide(force: str, mass: float = 1.0, tilt: float = 0.0) -> Mechanism:
    """A mass on a slide under a force along it, and an acceleration (m/s^2)."""
    m = Mechanism("oscillator", gravity=(tilt, 0.0, 0.0))
    body = m.body("mass", mass=mass, inertia=(1.0, 1.0, 1.0))
    m.translational("slide", body, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    m.load("force", body.marker(name="I"), m.ground.marker(name="J"), fx=force)
    return m


def position(solution):
    return solution.com_position("mass")[:, 0]


@pytest.mark.slow
def test_a_linear_oscillator_has_the_derivatives_of_its_frequency_response():
    """c = A / (k - m w^2 + i d w)."""

    def build(amplitude, damping, stiffness, mass):
        return slide(f"{amplitude!r}*COS(2*TIME)-{damping!r}*VX(I,J)-{stiffness!r}*DX(I,J)", mass)

    values = {"amplitude": 3.0, "damping": 0.3, "stiffness": 9.0, "mass": 1.0}
    found = gm.steady_sensitivities(build, values, TAU / 2.0, tol=1e-9)
    below = 9.0 - 4.0 + 0.6j
    wanted = {"amplitude": 1.0 / below, "damping": -6j / below**2, "stiffness": -3.0 / below**2, "mass": 12 / below**2}
    for name, derivative in wanted.items():
        # the tolerance, as part of a motion of half a metre
        assert found.harmonics(name, position)[1] == pytest.approx(derivative, rel=2e-5)
    assert found.motion.stable


@pytest.mark.slow
def test_a_duffing_oscillator_moves_as_by_an_independent_shooting():
    found = gm.steady_sensitivities(
        lambda amplitude: slide(f"{amplitude!r}*COS(1.2*TIME)-0.1*VX(I,J)-DX(I,J)-DX(I,J)**3"),
        {"amplitude": 0.3}, TAU / 1.2, tol=1e-10,
    )  # fmt: skip
    speed = found.motion.solution.com_velocity("mass")[:, 0]
    start = np.array([position(found.motion.solution)[0], speed[0]])

    def started(amplitude):
        def force(t, x, v):
            return amplitude * np.cos(1.2 * t) - 0.1 * v - x - x**3

        return reference(force, lambda x: -1.0 - 3.0 * x * x, 0.1, TAU / 1.2, start)[0]

    wanted = (started(0.3003) - started(0.2997)) / 6e-4
    by = [found.derivative("amplitude", of)[0] for of in (position, lambda s: s.com_velocity("mass")[:, 0])]
    # of the difference the square of 1e-3, times what the curve bends
    assert by == pytest.approx(wanted, rel=1e-4, abs=1e-4 * np.abs(wanted).max())


@pytest.mark.slow
def test_a_length_that_moves_the_start_along_its_constraints():
    """A pendulum that a torque swings: where its body starts follows from the length at each angle."""

    def build(length):
        m = Mechanism("pendulum", gravity=(0.0, -9.81, 0.0))
        bob = m.body("bob", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.0, -length, 0.0))
        m.revolute("pin", m.ground, bob, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))
        bob_at, base = bob.marker(name="I"), m.ground.marker(name="J")
        m.load("swing", bob_at, base, tz="2*COS(2*TIME)-0.8*WZ(I,J)")
        return m

    def height(solution):
        return solution.com_position("bob")[:, 1]

    for lump in (False, True):
        found = gm.steady_sensitivities(build, {"length": 1.0}, TAU / 2.0, tol=1e-9, lump=lump)
        sides = [gm.steady(build(length), TAU / 2.0, tol=1e-10, lump=lump) for length in (1.002, 0.998)]
        wanted = (sides[0].harmonics(height) - sides[1].harmonics(height)) / 0.004
        assert np.abs(found.harmonics("length", height) - wanted).max() < 1e-4 * np.abs(wanted).max()


@pytest.mark.slow
def test_a_gear_pair_against_motions_beside_it():
    base = Case(operation={"speed": "1000 rpm", "run_up": "10 ms"})

    def build(torque, damping):
        return case_mechanism(base.changed(operation={"torque": torque}, contact={"damping": damping}))

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    values, period = {"torque": 100.0, "damping": 298520.0}, 1.0 / base.mesh_frequency
    found = gm.steady_sensitivities(build, values, period, t_start=0.01, tol=1e-9)

    def lines(**changed):
        return gm.steady(build(**(values | changed)), period, t_start=0.01, tol=1e-10).harmonics(force)

    for name, value in values.items():
        by = 5e-3 * value
        wanted = (lines(**{name: value + by}) - lines(**{name: value - by})) / (2.0 * by)
        off = np.abs(found.harmonics(name, force) - wanted).max() / np.abs(wanted).max()
        # differences at that distance bend by 2e-3
        assert off < 5e-3


def test_what_changes_the_period_is_refused_and_what_leaves_it_is_not():
    def build(frequency, amplitude):
        return slide(f"{amplitude!r}*COS({frequency!r}*TIME)-0.3*VX(I,J)-9*DX(I,J)")

    with pytest.raises(ModelError, match=says("frequency", "changes the period")):
        gm.steady_sensitivities(build, {"frequency": 2.0, "amplitude": 3.0}, TAU / 2.0)
    assert gm.steady_sensitivities(lambda amplitude: build(2.0, amplitude), {"amplitude": 3.0}, TAU / 2.0).values


def test_what_drifts_with_a_parameter_is_refused_and_what_swings_is_not():
    def build(push, amplitude):
        return slide(f"{amplitude!r}*COS(2*TIME)", tilt=push)

    with pytest.raises(ModelError, match=says("push", "drifts")):
        gm.steady_sensitivities(build, {"push": (0.0, 1.0), "amplitude": 3.0}, TAU / 2.0, attracting=False, tol=1e-9)
    free = gm.steady_sensitivities(
        lambda amplitude: build(0.0, amplitude), {"amplitude": 3.0}, TAU / 2.0, attracting=False, tol=1e-9
    )
    assert free.harmonics("amplitude", position)[1] == pytest.approx(-0.25, rel=1e-5)
