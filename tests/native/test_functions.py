"""Exported models with forces of a user's own functions, compiled by numba; what is in Python is refused by name."""

import math
import shutil

import numba
import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import ModelError
from gearmbs.native import export
from tests.native.support import Instance, Library
from tests.says import says

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]


@numba.njit
def sine_of(x, size):
    return size * math.sin(x)


def restoring(t, frames, states, parameters, wrench, rates, diagnostics):
    """A torque by the angle, of which the frame has the sine, one by the speed, and a filter of it."""
    last = -1
    wrench[0, 5] = -sine_of(frames[0, 6], parameters[0]) - parameters[1] * frames[0, last] - 0.1 * states[0]
    rates[0] = frames[0, last] - states[0]
    diagnostics[0] = wrench[0, 5]


def telling(t, frames, states, parameters, wrench, rates, diagnostics):
    """Print, which is Python's."""
    print(t)


def disc():
    m = gm.Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, m.input("load", "N m", 1.0))
    m.output("speed", ("angular_velocity", "disc", "z"))
    return m, body


def of_function(kernel):
    m, body = disc()
    m.force("own", kernel, body.marker(name="centre"), parameters=[3.0, 0.2], states={"z": 0.5}, diagnostics=["torque"])
    return m


@pytest.mark.parametrize("kernel", [restoring, numba.njit(restoring), numba.njit(fastmath=True)(restoring)])
def test_a_function_of_a_user_is_compiled_at_the_export(kernel, tmp_path):
    """Whatever numba compiles: other compiled functions that it calls, counts from the end, states and diagnostics."""
    m = of_function(kernel)
    told = ["speed", ("diagnostics", "own", "torque"), ("state", "own.z")]
    instance = Instance(Library(export(m, tmp_path, t_end=5.0, outputs=told, processor="native").library))
    sim = gm.Simulator(m, 5.0, lump=False)
    for k, t in enumerate(np.linspace(0.0, 5.0, 101)[1:].tolist()):
        if k == 40:
            instance.set("load", 2.5)
            sim.set("load", 2.5)
        instance.advance(t)
        sim.advance(t)
        if k % 7 == 6:
            wanted = [sim.get("output", "speed"), sim.get("diagnostics", "own")["torque"], sim.get("state", "own.z")]
            np.testing.assert_array_equal(instance.outputs(), wanted)


@gm.force_law
def magnet(i, j, strength):
    apart = i.origin - j.origin
    return gm.Wrench(energy=-strength / np.sqrt(apart @ apart))


def test_a_force_law_is_exported(tmp_path):
    """A ball about a magnet: force and derivatives follow from the energy, in the library as in Python."""
    m = gm.Mechanism("magnets")
    ball = m.body("ball", mass=0.1, inertia=(1e-5, 1e-5, 1e-5), position=(0.2, 0, 0), velocity=(0, 0.4, 0))
    m.force("magnet", magnet, ball.marker(), m.ground.marker(), parameters={"strength": 0.004})
    m.output("x", ("com_position", "ball", "x"))
    instance = Instance(Library(export(m, tmp_path, t_end=1.0, processor="native").library))
    sim = gm.Simulator(m, 1.0, lump=False)
    for t in (0.3, 0.7, 1.0):
        instance.advance(t)
        sim.advance(t)
        assert instance.outputs()[0] == sim.get("output", "x")


def test_functions_of_python_are_refused_by_name(tmp_path):
    m = of_function(telling)
    with pytest.raises(ModelError, match=says("telling", "print", "leave out")):
        export(m, tmp_path, t_end=1.0)
    m, _ = disc()
    m.function("SPRING", lambda angle: -3.0 * math.sin(angle))
    pin = m.joints["pin"]
    m.axis_torque("own", pin.i, pin.j, "SPRING(AZ(pin.I, pin.J))")
    with pytest.raises(ModelError, match=says("SPRING", "without", "Python")):
        export(m, tmp_path, t_end=1.0)
    # the same torque as an expression
    m, _ = disc()
    pin = m.joints["pin"]
    m.axis_torque("own", pin.i, pin.j, "-3*SIN(AZ(pin.I, pin.J))")
    instance = Instance(Library(export(m, tmp_path, t_end=1.0, processor="native").library))
    instance.advance(1.0)
    sim = gm.Simulator(m, 1.0, lump=False)
    sim.advance(1.0)
    assert instance.outputs()[0] == sim.get("output", "speed")


@numba.njit
def of_gamma(t, frames, states, parameters, wrench, rates, diagnostics):
    """A function that numba has in Python's part."""
    wrench[0, 5] = math.gamma(3.0 + frames[0, 0])


def test_what_a_library_has_not_is_named(tmp_path):
    m, body = disc()
    m.force("own", of_gamma, body.marker(name="centre"), diagnostics=["torque"])
    with pytest.raises(ModelError, match=says("numba_gamma", "library", "loops")):
        export(m, tmp_path, t_end=1.0, processor="native")


def test_inputs_that_prescribe_positions_are_told(tmp_path):
    """They cannot jump and keep their values; a speed by a coupling to the input can be set: J w' = c (input - w)."""
    m, _ = disc()
    m.rotation("motor", m.joints["pin"], m.input("angle", "rad", 0.0))
    m.parameter("rate", "rad/s", 0.0)
    other = m.body("other", mass=1.0, inertia=(1.0, 1.0, 1.0))
    m.rotation("turn", m.revolute("other pin", other, m.ground, axis=(0, 0, 1)), "rate*TIME")
    made = export(m, tmp_path, t_end=1.0, processor="native")
    assert (sorted(made.held), list(made.numbers)) == (["angle", "rate"], ["load"])
    instance = Instance(Library(made.library))
    instance.set("load", 5.0)
    instance.advance(0.5)
    assert instance.get("speed") == pytest.approx(0.0, abs=1e-9)
    m, _ = disc()
    m.input("turning", "rad/s", 2.0)
    pin, c, inertia = m.joints["pin"], 80.0, 2.0
    m.axis_torque("coupling", pin.i, pin.j, f"{c}*(turning - WZ(pin.I, pin.J))")
    made = export(m, tmp_path / "coupled", t_end=1.0, processor="native", tol=1e-8)
    assert made.held == []
    instance = Instance(Library(made.library))
    instance.set("load", 0.0)
    for t, turning, before in ((0.1, 2.0, 0.0), (0.2, 5.0, None)):
        instance.set("turning", turning)
        before = instance.get("speed") if before is None else before
        instance.advance(t)
        wanted = turning + (before - turning) * math.exp(-c * 0.1 / inertia)
        assert instance.get("speed") == pytest.approx(wanted, rel=1e-5)


def threaded(i, j, t, pitch, lead):
    x, y, z = i.position(j)
    turned = i.orientation(j)
    return [x, y, turned[0, 2], turned[1, 2], z - pitch / (2.0 * np.pi) * i.angle(j) - lead * np.sin(9.0 * t) ** 2]


def test_constraints_by_laws_are_the_same_bit_for_bit(tmp_path):
    """Over some turns, with their reactions."""
    m = gm.Mechanism("nut", gravity=(0.0, 0.0, -9.81))
    nut = m.body("nut", 2.0, (0.03, 0.05, 0.04), angular_velocity=(0.0, 0.0, 40.0), velocity=(0.0, 0.0, 6.0 / math.pi))
    places = nut.marker(name="I"), m.ground.marker(name="J")
    m.general_constraint("thread", threaded, *places, parameters={"pitch": 0.3, "lead": 0.01})
    instance = Instance(Library(export(m, tmp_path, t_end=0.5, outputs="all", processor="native").library))
    sim = gm.Simulator(m, 0.5)
    for t in np.linspace(0.0, 0.5, 21)[1:].tolist():
        instance.advance(t)
        sim.advance(t)
        told = [instance.get(f"thread.reaction.{name}") for name in ("fx", "fy", "fz", "tx", "ty", "tz")]
        np.testing.assert_array_equal(told, np.concatenate(sim.get("reaction", "thread")))
        place = [instance.get(f"nut.com_position.{axis}") for axis in "xyz"]
        np.testing.assert_array_equal(place, sim.get("com_position", "nut"))
