"""A simulator that stops where a state passes a value."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism, ModelError
from gearmbs.mechanism.solve.simulate import StopAt
from tests.says import says


def swinging():
    """A mass that swings, x = 0.1 sin 10 t, with its place as a state."""
    m = Mechanism("swing")
    body = m.body("body", mass=2.0, inertia=(0.1, 0.1, 0.1), velocity=(1.0, 0.0, 0.0))
    guide = m.translational("guide", body, m.ground, axis=(1, 0, 0))
    m.spring_damper(
        "spring", guide.i, m.ground.marker(name="far", position=(-10.0, 0, 0)), stiffness=200.0, length=10.0
    )
    m.algebraic_state("place", "DX(guide.I)")
    m.torque("idle", body, m.input("load", "N m"), axis=(1, 0, 0))
    return m


def test_advance_ends_where_a_state_passes_a_value(tmp_path):
    """At the zeros and at 0.05 m of the way, without another step; from states of before and behind too."""
    stops = [StopAt("place", 0.05, 1), StopAt("place", 0.0, -1)]
    sim, told, states = gm.Simulator(swinging(), 2.0, tol=1e-9, stops=stops), [], []
    while sim.t < 1.0:
        state = sim.state()
        stop = sim.advance(1.0)
        told.append((sim.t, None if stop is None else stops.index(stop)))
        states.append(state)
    turn = 0.2 * np.pi
    wanted = [(np.pi / 60, 0), (0.1 * np.pi, 1), (turn + np.pi / 60, 0), (turn + 0.1 * np.pi, 1), (1.0, None)]
    assert [which for _, which in told] == [which for _, which in wanted]
    np.testing.assert_allclose([t for t, _ in told], [t for t, _ in wanted], atol=1e-7)
    plain = gm.Simulator(swinging(), 2.0, tol=1e-9)
    for t, _ in told:
        plain.advance(t)
    np.testing.assert_array_equal(sim.solution().result.y[1:], plain.solution().result.y[1:])
    for k in (3, 1, 2):
        sim.restore(states[k])
        other = gm.Simulator(swinging(), 2.0, tol=1e-9, stops=stops, initial=states[k])
        read = gm.State.load(states[k].save(tmp_path / "s.npz"))
        for one in (sim, other, gm.Simulator(swinging(), 2.0, tol=1e-9, stops=stops, initial=read)):
            assert stops.index(one.advance(1.0)) == told[k][1]
            assert one.t == pytest.approx(told[k][0], rel=1e-13)
    sim.restore(states[1])
    sim.set("load", 0.3)
    assert stops.index(sim.advance(1.0)) == 1
    gone_on = gm.Simulator(swinging(), 2.0, tol=1e-9, initial=states[2])
    assert gone_on.advance(1.0) is None
    np.testing.assert_allclose(gone_on.get("com_position", "body"), plain.get("com_position", "body"), atol=1e-7)
    with pytest.raises(ModelError, match=says("lump", "False")):
        gm.Simulator(swinging(), 2.0, stops=stops, lump=True)
    with pytest.raises(ModelError, match=says("plase", "place")):
        gm.Simulator(swinging(), 2.0, stops=[StopAt("plase")])


def jumping(level):
    """A disc at rest whose sum of speed and an input jumps with the input, or whose speed does."""
    m = Mechanism("jumps")
    disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    if level is None:
        m.torque("drive", disc, m.input("u", "N m"))
        m.algebraic_state("al", "WZ(pin.I, pin.J) + u")
    else:
        m.rotation("drive", pin, m.input("u", "rad/s"), level=level)
        m.algebraic_state("al", "WZ(pin.I, pin.J)")
    return m


@pytest.mark.parametrize("level", [None, "velocity"])
def test_a_stop_that_a_jump_passes_is_told_where_it_jumps(level):
    """Once, at the time of the jump, up or down as it asks for; the motion goes on as without stops."""
    stops = [StopAt("al", 5.0, 1), StopAt("al", 4.0, -1)]
    sim, plain = (gm.Simulator(jumping(level), 2.0, tol=1e-9, stops=some) for some in (stops, []))
    for one in (sim, plain):
        one.advance(0.5)
        one.set("u", 10.0)
    assert (sim.advance(1.0), sim.t) == (stops[0], 0.5)
    assert (sim.advance(0.75), sim.t) == (None, 0.75)
    plain.advance(0.75)
    np.testing.assert_allclose(sim.get("angular_velocity", "disc"), plain.get("angular_velocity", "disc"), rtol=1e-7)
    sim.set("u", -10.0)
    assert (sim.advance(1.0), sim.t) == (stops[1], 0.75)
    # a jump that stays above or below passes nothing, nor does what is set before the start
    for u in (-20.0, 1.0, 3.0, 3.0):
        sim.set("u", u)
        assert sim.advance(sim.t + 0.01) is None
    first = gm.Simulator(jumping(level), 2.0, tol=1e-9, stops=stops)
    first.set("u", 10.0)
    assert first.advance(0.5) is None
    np.testing.assert_array_equal(sim.solution().t, [0.0, 0.5, 0.75, *(0.75 + 0.01 * np.arange(1, 5))])


def test_a_controller_jumps_past_a_stop_at_its_sample():
    """A point of the solution lies there, with the values up to the jump."""
    stop = StopAt("al", 5.0)
    sim = gm.Simulator(jumping(None), 2.0, tol=1e-9, stops=[stop])
    sim.control("u", lambda t, _: 10.0 if t > 0.25 else 0.0, sample_time=0.1)
    assert (sim.advance(1.0), sim.t) == (stop, pytest.approx(0.3))
    np.testing.assert_allclose(sim.solution().state("al"), [0.0, 0.0], atol=1e-12)
    assert (sim.advance(1.0), sim.t) == (None, 1.0)
    np.testing.assert_allclose(sim.get("angular_velocity", "disc"), [0.0, 0.0, 0.7 * 5.0], atol=1e-7)


@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF"])
def test_a_stop_at_a_point_or_by_rounding_behind_it_is_told_once(integrator):
    """A clock passes at a time that is asked for, or a few units of its last digit after it, and so do others."""
    stops = [StopAt("clock", 0.5), StopAt("twice", 1.0), StopAt("back", -0.5)]
    m = swinging()
    for name, rate in (("clock", "1"), ("twice", "2"), ("back", "-1")):
        m.differential_state(name, rate)
    sim = gm.Simulator(m, 2.0, stops=stops, integrator=integrator)
    first = sim.advance(1.0)
    assert first in stops
    at = sim.t
    for units in (-3, -1, 0, 1):
        sim = gm.Simulator(m, 2.0, stops=stops, integrator=integrator)
        told, t = [], at + units * np.spacing(at)
        for end in (t, 1.0):
            while (stop := sim.advance(float(end))) is not None:
                told.append(stop.state)
                assert sim.t == pytest.approx(0.5, rel=1e-9)
                if len(told) == 1:
                    # what is told goes on from a state too
                    sim.restore(sim.state())
        assert sorted(told) == ["back", "clock", "twice"]


def clocked(led=False):
    """A free disc under a torque that is set, a clock, and what an input that is set adds to it."""
    m = Mechanism("disc")
    disc = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    pin = m.revolute("pin", disc, m.ground, axis=(0, 0, 1))
    m.torque("drive", disc, m.input("load", "N m"))
    if led:
        m.rotation("turn", pin, m.input("speed", "rad/s"), level="velocity")
    m.input("u", "s")
    m.differential_state("clock", "1")
    m.algebraic_state("sum", "DIF(clock) + u")
    return m


@pytest.mark.parametrize("name", ["load", "speed"])
@pytest.mark.parametrize("integrator", ["WSTIFF", "GSTIFF"])
def test_a_stop_at_the_sample_of_a_controller_is_told_once(integrator, name):
    """The sample lies within a step, in which the clock passes at it but for rounding, before it or behind."""
    m = clocked(led=name == "speed")
    for n in (3, 7) if name == "load" else (3,):
        for points in ((0.027, 0.054), (0.02, 0.04), (0.03, 0.06), (0.06,)):
            stop = StopAt("clock", 0.01 * n)
            sim = gm.Simulator(m, 1.0, tol=1e-7, stops=[stop], integrator=integrator)
            sim.control(name, lambda t, _: 1.0 + t, sample_time=0.01)
            told = []
            for end in (*points, 0.08):
                while (found := sim.advance(end)) is not None:
                    told.append((found, sim.t))
            assert told == [(stop, pytest.approx(0.01 * n, rel=1e-12))]


@pytest.mark.parametrize("units", [-40, -20, 0, 3])
def test_a_stop_that_is_told_passes_once_where_what_is_set_moves_it_by_rounding(units):
    """A few units of the last digit behind a stop its state falls below the value by as few, and passes it again."""
    stop = StopAt("sum", 0.05)
    sim = gm.Simulator(clocked(), 1.0, tol=1e-7, stops=[stop])
    assert sim.advance(0.1) == stop
    sim.advance(sim.t + 3 * np.spacing(sim.t))
    sim.set("u", units * np.spacing(0.05))
    assert (sim.advance(0.1), sim.t) == (None, 0.1)
    # by more it is another passage
    sim.set("u", -0.06)
    assert sim.advance(0.105) == stop
    assert (sim.advance(0.105), sim.advance(0.2), sim.t) == (None, stop, pytest.approx(0.11, rel=1e-9))
