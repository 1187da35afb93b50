"""Simulators exported as they stand: what has been set in them goes on as it does in Python."""

import shutil

import pytest

import gearmbs as gm
from gearmbs.native import export
from tests.native.support import Instance, Library

COMPILER = shutil.which("cc") or shutil.which("gcc")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(COMPILER is None, reason="no C compiler is installed")]


def disc():
    m = gm.Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(2.0, 2.0, 2.0))
    m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    m.torque("drive", body, m.input("load", "N m"))
    m.output("speed", ("angular_velocity", "disc", "z"))
    return m


def test_an_output_may_be_a_quantity_that_is_an_expression(tmp_path):
    m = disc()
    m.output("shown", ("evaluate", "300 + WZ(pin.I, pin.J)"))
    made = export(m, tmp_path, t_end=1.0, processor="native")
    assert (list(made.outputs), made.left_out) == (["speed", "shown"], [])
    instance = Instance(Library(made.library))
    instance.set("load", 4.0)
    instance.advance(0.5)
    assert instance.get("shown") == 300.0 + instance.get("speed")


@pytest.mark.parametrize("from_state", [False, True])
def test_a_line_that_has_ended_is_held(from_state, tmp_path):
    """2 N m until 0.5 s, evenly to 6 until 0.75 s, and 6 from there on: 2 w = 1 + 1 + 6 (t - 0.75)."""
    m = disc()
    sim = gm.Simulator(m, 2.0, lump=False)
    sim.set("load", 2.0)
    sim.advance(0.5)
    sim.set("load", 6.0, hold=1)
    sim.advance(0.75)
    if from_state:
        sim = gm.Simulator(m, 2.0, initial=sim.state(), lump=False)
    instance = Instance(Library(export(sim, tmp_path, processor="native").library))
    for t in (1.0, 2.0):
        instance.advance(t)
        sim.advance(t)
        assert instance.number("load") == sim.get("input", "load") == 6.0
        assert instance.get("speed") == sim.get("output", "speed") == pytest.approx(1.0 + 3.0 * (t - 0.75), rel=1e-6)
