"""What a simulator tells behind jumps and corners of inputs: states beside contacts, turns, times that are reached."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gearmbs as gm
from gearmbs.mechanism.solve.simulate import StopAt


def disc(moment: float = 0.5) -> tuple[gm.Mechanism, str, str]:
    """Return a disc on a pin, and the names of the pin's markers."""
    m = gm.Mechanism("disc")
    body = m.body("d", mass=1.0, inertia=(1, 1, moment))
    pin = m.revolute("p", body, m.ground, axis=(0, 0, 1))
    return m, pin.i.name, pin.j.name


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF"])
def test_a_stop_between_the_first_two_points_behind_a_jump_is_met(integrator):
    """J w' = u + 1 - 50 a - 0.01 w - 3000 max(0, a - 0.002): a smooth solution of what lies behind it pulls before."""
    m, i, j = disc()
    m.torsion_spring("s", m.joints["p"].i, m.joints["p"].j, stiffness=50.0, damping=0.01)
    m.input("u", "N m", 0.0)
    m.axis_torque("t", m.joints["p"].i, m.joints["p"].j, f"u+1-3000*MAX(0,AZ({i},{j})-.002)")
    times = 0.0476 + 3e-3 * np.arange(-3, 2)
    exact, state, before = [], np.zeros(2), 0.0
    for t, u in zip(times, (0.0, 0.0, -0.3, 0.4, 0.4), strict=True):

        def rates(_, y, u=u):
            return [y[1], (u + 1 - 50 * y[0] - 0.01 * y[1] - 3000 * max(0.0, y[0] - 0.002)) / 0.5]

        for a, b in zip(*(np.linspace(before, t, 20)[k : 19 + k] for k in (0, 1)), strict=True):
            state = solve_ivp(rates, (a, b), state, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        exact.append(state[1])
        before = t
    sim = gm.Simulator(m, 0.1, tol=1e-7, integrator=integrator)
    for t, u, speed in zip(times, (None, None, -0.3, 0.4, None), exact, strict=True):
        if u is not None:
            sim.set("u", u)
        sim.advance(float(t))
        # 504 tolerances where the block behind the jump did not look at its start; with nothing set a kink costs 6, and
        # here each of three starts and the kink leave some tolerances
        assert sim.get("angular_velocity", "d")[2] == pytest.approx(speed, abs=30e-7)


@pytest.mark.slow
@pytest.mark.parametrize("tol", [1e-6, 1e-7])
def test_stiffnesses_that_jump_by_a_stop_are_followed(tol):
    """Two discs on a spring of random stiffness each 3 ms, one of which runs into stops, by a Runge-Kutta method."""
    rng = np.random.default_rng(2)
    m = gm.Mechanism("two")
    one, two = (m.body(name, mass=1.0, inertia=(1, 1, moment)) for name, moment in (("a", 0.5), ("b", 0.8)))
    pins = [m.revolute(f"p{k}", body, m.ground, axis=(0, 0, 1)) for k, body in enumerate((one, two))]
    m.torsion_spring("s", pins[0].i, pins[1].i, stiffness=50.0, damping=0.31)
    m.torsion_spring("r", pins[0].i, pins[1].i, stiffness=400.0, damping=0.0)
    turned = f"AZ({pins[0].i.name},{pins[0].j.name})"
    stop = f"1-0.1*WZ({pins[0].i.name},{pins[0].j.name})-3000*MAX(0,{turned}-.002)+3000*MAX(0,-{turned}-.002)"
    m.axis_torque("t", pins[0].i, pins[0].j, stop)
    sim = gm.Simulator(m, 0.2, tol=tol)
    state, worst, stiffness = np.zeros(4), 0.0, 50.0
    for k in range(40):
        if rng.random() < 0.9:
            stiffness = float(rng.uniform(0.0, 900.0))
            sim.set("s.stiffness", stiffness)

        def rates(_, y, stiffness=stiffness):
            spring = -(400.0 + stiffness) * (y[0] - y[1]) - 0.31 * (y[2] - y[3])
            other = 1.0 - 0.1 * y[2] - 3000.0 * max(0.0, y[0] - 0.002) + 3000.0 * max(0.0, -y[0] - 0.002)
            return [y[2], y[3], (spring + other) / 0.5, -spring / 0.8]

        for _ in range(6):
            state = solve_ivp(rates, (0.0, 5e-4), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        sim.advance(3e-3 * (k + 1))
        found = [sim.get("angular_velocity", name)[2] for name in "ab"]
        worst = max(worst, float(np.abs(found - state[2:]).max()))
    assert worst < 30.0 * tol


def test_a_speed_that_is_led_has_no_jump():
    """The speed goes evenly to 100 rad/s and on to 300: trapezoids, 50 rad and 250."""
    m, *_ = disc()
    m.rotation("drive", m.joints["p"], m.input("speed", "rad/s", 0.0), level="velocity")
    sim = gm.Simulator(m, 3.0)
    for t, speed, angle in ((1.0, 10.0, 5.0), (2.0, 30.0, 25.0)):
        sim.set("speed", speed, hold=1)
        sim.advance(t)
        assert sim.get("joint_angle", "p") == pytest.approx(angle, abs=1e-6)
    assert not sim.solution().jumped
    sim.set("speed", 3.0)
    sim.advance(3.0)
    assert sim.solution().jumped == {2.0}


@pytest.mark.parametrize("record", [False, True])
def test_turns_that_were_told_are_those_of_the_state(record):
    """The speed is a sine of eight turns, told at points of which the solution keeps none, or all."""
    m, *_ = disc(2.0)
    m.torque("T", m.bodies["d"], m.input("u", "N m", 0.0))
    sim = gm.Simulator(m, 10.0)
    for k in range(1, 201):
        sim.set("u", 400.0 * float(np.sin(0.03 * k)))
        sim.advance(0.01 * k, record=record)
        angle = sim.get("joint_angle", "p")
    assert angle > 20.0 * np.pi
    state = sim.state()
    sim.advance(3.0, record=record)
    later = sim.get("joint_angle", "p")
    sim.restore(state)
    assert sim.get("joint_angle", "p") == pytest.approx(angle, abs=1e-9)
    sim.advance(3.0, record=record)
    assert sim.get("joint_angle", "p") == pytest.approx(later, abs=1e-9)


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF"])
def test_a_point_behind_a_stop_an_ulp_before_it_is_reached_on_a_line(integrator):
    for k in range(2, 8):
        end = 0.05 * k
        m, *_ = disc()
        m.torque("T", m.bodies["d"], m.input("u", "N m", 0.0))
        m.differential_state("clock", "1.0")
        sim = gm.Simulator(m, 1.0, integrator=integrator, stops=[StopAt("clock", end)])
        sim.advance(end - 0.05)
        sim.set("u", 4.0, hold=1)
        stops = 0
        while sim.t < end:
            stops += sim.advance(end) is not None
        sim.advance(end + 0.04)
        assert sim.get("input", "u") == pytest.approx(4.0)
