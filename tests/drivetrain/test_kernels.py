"""Exact derivatives of the torques about an axis and of the bearing with clearance, against differences."""

import numpy as np
import pytest

from gearmbs.bearings.clearance import ClearanceForce
from gearmbs.drivetrain.torque_element import ACCOUNTS, ShaftTorque
from gearmbs.mechanism import Diagnostic, Mechanism
from gearmbs.mechanism.parts.elements import State
from gearmbs.mechanism.parts.functions import constant
from tests.drivetrain.support import differences, evaluate, frame, rotation

TABLE = (1.0, 0.0, 3.0, -50.0, 10.0, 60.0, 5.0, 2.0, -4.0, 0.1, -0.05, -0.2)
TURN = (-1.0, 2 * np.pi, 3.0, 0.0, 3.0, 2 * np.pi, 1.0, 2.0, 1.0, 0.5, -0.3, 0.5)
LAWS = {
    "kloss": ("kloss", (1.0, 157.0, 0.0, 138.0, 0.18), 1, 0, 0),
    "kloss with lag": ("kloss", (-1.0, 157.0, 0.02, 138.0, 0.18), 1, 0, 1),
    "circuit": ("circuit", (1.0, 157.0, 0.0, 900.0, 0.6, 0.5, 2.1), 1, 0, 0),
    "circuit with lag": ("circuit", (1.0, 157.0, 0.01, 900.0, 0.6, 0.5, 2.1), 1, 0, 1),
    "controller": ("controller", (1.0, 2.0, 30.0, 500.0), 1, 0, 1),
    "controller at its limit": ("controller", (1.0, 20.0, 30.0, 300.0), 1, 0, 1),
    "clutch": ("clutch", (0.1, 3e3, 2e5, 4.0, 0.0, 1.0, 5e3, 0.05, 0.1), 0, 1, 0),
    "clutch beyond": ("clutch", (0.1, 3e3, 2e5, 4.0, 0.0, 1.0, 5e3, 0.05, 0.01), 0, 1, 0),
    "dead band": ("clutch", (0.1, 3e3, 2e5, 4.0, 0.05, 0.5, 0.0, 0.0, 0.01), 0, 1, 0),
    "pump": ("pump", (1.0, 2.5e-1, 7.0, 0.1, 9.0, 3.0, 0.1, 0.0, 0.9, 0.08, -0.02), 1, 1, 0),
    "pump with lag": ("pump", (-1.0, 2.5e-1, 7.0, 0.1, 9.0, 3.0, 0.1, 0.1, 0.9, 0.08, -0.02), 1, 1, 1),
    "resistance": ("resistance", (20.0, 0.3, 0.01, 15.0), 1, 0, 0),
    "table over speed": ("table", TABLE, 1, 0, 0),
    "table over angle": ("table", TURN, 1, 1, 0),
}


def frames(spin=23.0, angle=0.35, shift=(1.2e-4, -0.7e-4, 0.3e-4)):
    tilted = rotation((0.3, -0.4, 0.2))
    one = frame(shift, tilted @ rotation((0.002, -0.003, 0.0)) @ rotation((0, 0, angle)),
                (0.01, -0.02, 0.005), tilted @ (0.3, -0.2, spin))  # fmt: skip
    return np.array([one, frame((0, 0, 0), tilted, (0.002, 0.001, -0.003), (0.1, 0.4, -0.2))])


def markers():
    m = Mechanism("two")
    a, b = m.body("a", 1.0, (1, 1, 1)), m.body("b", 1.0, (1, 1, 1))
    return a.marker(), b.marker()


@pytest.mark.parametrize("law", LAWS)
def test_derivatives_of_laws(law):
    name, parameters, times, angles, states = LAWS[law]
    element = ShaftTorque(
        "x", *markers(), name, parameters, times=(constant(1.0),) * times, counts_angle=bool(angles),
        own_states=(State("x.z"),) * states, own_diagnostics=(*ACCOUNTS, Diagnostic("own", "1")),
    )  # fmt: skip
    inputs = [*((30.0 if "pump" in law else 40.0 if "controller" in law else 0.7,) * times), *((0.3,) * angles)]
    z = (3e-5 if "pump" in law else 3.0,) * states
    *_, exact, _ = evaluate(element, frames(), z, inputs)
    rough = differences(element, frames(), z, inputs)
    assert np.abs(rough).max() > 0.0
    np.testing.assert_allclose(exact, rough, atol=2e-7 * np.abs(rough).max())


@pytest.mark.parametrize(("depth", "speed"), [(1e-5, 1.0), (1e-3, 1.0), (1e-5, -1.0)])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_derivatives_of_the_clearance_bearing(depth, speed, exponent):
    element = ClearanceForce("x", *markers(), (1e-4, 1e7, exponent, 50.0 * speed, depth))
    both = frames()
    wrench, _, exact, told = evaluate(element, both)
    rough = differences(element, both, (), (), 1e-9)
    assert np.linalg.norm(wrench) > 0.0
    assert told[2] > 0.0
    np.testing.assert_allclose(exact, rough, atol=3e-6 * np.abs(rough).max())


def test_clearance_bearing_is_silent_inside_and_never_pulls():
    inside = ClearanceForce("x", *markers(), (2e-4, 1e7, 1.0, 50.0, 1e-6))
    assert not np.any(evaluate(inside, frames())[0])
    both = frames()
    radial = both[0, :3] - both[1, :3]
    # leaving so fast that damping would pull
    both[0, 12:15] = -50.0 * radial / np.linalg.norm(radial)
    element = ClearanceForce("x", *markers(), (1e-4, 1e7, 1.0, 1e5, 1e-7))
    wrench, _, _, told = evaluate(element, both)
    assert not np.any(wrench)
    assert told[1] > 0.0
