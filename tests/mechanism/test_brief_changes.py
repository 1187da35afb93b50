"""Bumps in tables, and pulses of steps, that are narrower than the steps of a run: none is passed unseen."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.dae.model.brief import brief_changes
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts import functions
from tests.generators import cases, seed

KINDS = ("CUBSPL", "AKISPL", "curve", "polyline", "STEP", "IF")
KNOTS = 10_000
SPAN = 10.0


def disc(kind, at, height=1.0):
    """A disc of 2 kg m^2 under a slow torque with a bump 3 points wide of 1 N m s; return its last speed, too.

    That is half of the integral of chords, from which those of splines differ by some per cent of the bump.
    """
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    times = np.linspace(0.0, SPAN, KNOTS)
    torque, first, apart = 0.1 * np.sin(0.7 * times), int(at / SPAN * KNOTS), times[1]
    torque[first : first + 3] += height * np.array([0.5, 1.0, 0.5]) / (2.0 * apart)
    speed = np.trapezoid(torque, times) / 2.0
    width = 2.0 * apart
    pulses = {
        "STEP": f"{height}*(STEP(TIME, {at}, 0, {at + width}, {1.0 / width})"
        f" - STEP(TIME, {at + width}, 0, {at + 2.0 * width}, {1.0 / width}))",
        "IF": f"IF(TIME - {at}: 0, 0, IF(TIME - {at + width}: {height / width}, 0, 0))",
    }
    if kind in pulses:
        m.torque("drive", body, pulses[kind])
        return m, 0.5 * height
    if kind in ("curve", "polyline"):
        m.torque("drive", body, getattr(functions, kind)(times, torque))
        return m, speed
    m.spline("table", times, torque)
    m.torque("drive", body, f"{kind}(TIME, 0, table)")
    return m, speed


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_bump_is_seen(kind, integrator):
    rng = np.random.default_rng(seed())
    for at in rng.uniform(0.5, 9.5, cases(2)):
        m, speed = disc(kind, float(at))
        solution = m.simulate(SPAN, tol=1e-6, rate=1.0, integrator=integrator)
        assert solution.success, solution.message
        assert solution.angular_velocity("disc")[-1, 2] == pytest.approx(speed, abs=0.02)


def test_steps_of_ones_own_see_it_too():
    """With the same steps; and from a state before it on."""
    m, _ = disc("AKISPL", 7.0)
    times = np.linspace(0.0, SPAN, 41)
    one = m.simulate(SPAN, t_eval=times)
    sim = gm.Simulator(m, SPAN)
    for t in times[1:]:
        sim.advance(t)
        if t == times[20]:
            state = sim.state()
    np.testing.assert_array_equal(sim.solution().result.y, one.result.y)
    later = m.simulate(SPAN, t_eval=times[20:], initial=state)
    np.testing.assert_array_equal(later.result.y, one.result.y[20:])


@pytest.mark.parametrize("kind", KINDS[:4])
def test_tables_without_one_are_left_alone(kind):
    m, _ = disc(kind, 5.0, height=0.0)
    assert brief_changes(m.compile().model, 0.0, SPAN) == []


def test_rough_tables_corners_and_lone_steps_are_left_alone():
    """They are seen by any step: noise is everywhere, what is beyond a corner or a step stays."""
    times = np.linspace(0.0, SPAN, KNOTS)
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.spline("noise", times, np.random.default_rng(seed()).normal(size=KNOTS))
    m.spline("corner", times, np.abs(times - 4.0))
    m.torque("a", body, "AKISPL(TIME, 0, noise)")
    m.torque("b", body, "AKISPL(TIME, 0, corner)")
    m.torque("c", body, "STEP(TIME, 5, 0, 6, 1)")
    assert brief_changes(m.compile().model, 0.0, SPAN) == []


def test_times_are_those_of_the_argument():
    """Of a table over 2 (TIME - 1): its bump at 8 is met at 5."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    x = np.linspace(-2.0, 18.0, 20_001)
    m.spline("table", x, np.exp(-(((x - 8.0) / 0.002) ** 2)))
    m.torque("drive", body, "CUBSPL(2*(TIME - 1), 0, table)")
    first, top, last = brief_changes(m.compile().model, 0.0, SPAN)
    assert 4.995 < first < 5.0 < last < 5.005
    assert top == pytest.approx(5.0, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
def test_a_pulse_that_ends_with_the_run_is_seen(integrator):
    """A torque of 100 N m over the last millisecond of 1.001 s, on 2 kg m^2, without breakpoints and with them."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, "IF(TIME - 1: 0, 100, IF(TIME - 1.001: 100, 0, 0))")
    for options in ({}, {"breakpoints": [1.0, 1.001]}):
        solution = m.simulate(1.001, rate=10.0, integrator=integrator, **options)
        assert solution.angular_velocity("disc")[-1, 2] == pytest.approx(0.05, rel=1e-6)


LONGER = {
    "IF": "IF(TIME - 4: 0, 1, IF(TIME - {end}: 1, 0, 0))",
    "STEP": "STEP(TIME, 4, 0, {top}, 2) - STEP(TIME, {top}, 0, {end}, 2)",
    "HAVSIN": "HAVSIN(TIME, 4, 0, {top}, 2) - HAVSIN(TIME, {top}, 0, {end}, 2)",
    "polyline": None,
    "curve": None,
}


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("kind", LONGER)
def test_a_longer_pulse_on_what_is_at_rest_is_seen(kind, integrator):
    """Steps are as long as a fifth of the run there: pulses of 1/200 to 1/10 of it, with 1 N m on average."""
    for length in (0.05, 0.3, 1.0):
        m = Mechanism("disc")
        body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
        m.revolute("pin", body, m.ground, axis=(0, 0, 1))
        top, end = 4.0 + 0.5 * length, 4.0 + length
        text = LONGER[kind]
        given = (
            text.format(top=top, end=end) if text else getattr(functions, kind)([0, 4, top, end, 10], [0, 0, 2, 0, 0])
        )
        m.torque("drive", body, given)
        solution = m.simulate(SPAN, tol=1e-6, rate=1.0, integrator=integrator)
        assert solution.angular_velocity("disc")[-1, 2] == pytest.approx(0.5 * length, rel=0.02)


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("speed", [100.0, -150.0])
@pytest.mark.slow
def test_a_prescribed_angle_whose_speed_jumps_gains_no_turns(integrator, speed):
    """Behind the last jump the angle stands still; by the speed before it a long step would be 16 turns and more."""
    m = Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(1.0, 1.0, 1.0))
    pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.rotation("drive", pin, f"INTEGRAL(IF(TIME-1: 0, {speed}, IF(TIME-1.002: {speed}, 0, 0)), 0, 2)")
    angle = m.simulate(2.0, rate=50, integrator=integrator, breakpoints=(1.0, 1.002)).joint_angle("pin")
    np.testing.assert_allclose(angle[52:], 0.002 * speed, rtol=1e-5)
