"""Jumps of inputs and parameters that change how the equations depend on the unknowns."""

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.mechanism import Mechanism

BAND, DRAG = 1.0, 200.0
"""Half the width of a dead zone of speeds, rad/s, and the drag outside of it, N m s/rad."""


def disc(torque, make="input"):
    """Return a disc of 1 kg m2 under a torque that is an expression of a number ``u``."""
    m = Mechanism("disc")
    body = m.body("disc", mass=1.0, inertia=(1.0, 1.0, 1.0))
    pin = m.revolute("pin", body, m.ground, axis=(0, 0, 1))
    getattr(m, make)("u", "rad/s", 0.0)
    m.axis_torque("load", pin.i, pin.j, torque.replace("w", "WZ(pin.I, pin.J)"))
    return m


def worst(m, values, dt, exact, tol):
    """Return the largest error of the speed, in tolerances, where a number is set anew at each point."""
    sim, speed, off = gm.Simulator(m, len(values) * dt, tol=tol), 0.0, 0.0
    for k, u in enumerate(values.tolist()):
        sim.set("u", u)
        sim.advance((k + 1) * dt)
        speed = exact(speed, u)
        off = max(off, abs(sim.get("angular_velocity", "disc")[2] - speed) / tol)
    return off


@pytest.mark.parametrize("make", ["input", "parameter"])
def test_the_edges_of_a_dead_zone_jump(make):
    """The speed goes to the nearer edge of the band about u and stays there: each jump takes the drag on or off.

    The past that follows a jump has to be that of the new drag, else what it is off by adds up, ten tolerances here.
    """
    dt, values = 1e-3, np.random.default_rng(1).uniform(-5.0, 5.0, 150)

    def exact(w, u):
        edge = min(max(w, u - BAND), u + BAND)
        return edge + (w - edge) * np.exp(-DRAG * dt)

    m = disc(f"-{DRAG}*(MAX(0, w-u-{BAND}) + MIN(0, w-u+{BAND}))", make)
    assert worst(m, values, dt, exact, 1e-6) < 5.0


def test_a_damping_jumps():
    """At each point another one: with the rate of the old one kept, the error would be that of its square."""
    dt, values = 1e-3, np.random.default_rng(2).uniform(0.0, 200.0, 100)

    def exact(w, u):
        return 3.0 / u + (w - 3.0 / u) * np.exp(-u * dt)

    assert worst(disc("3 - u*w"), values, dt, exact, 1e-4) < 5.0
