"""Accelerations, reactions and projection at output times against closed forms."""

import numpy as np
import pytest

from gearmbs.mechanism import Mechanism

LENGTH, MASS, G = 0.7, 1.3, 9.81


def pendulum(kind: str) -> Mechanism:
    m = Mechanism("pendulum", gravity=(0.0, -G, 0.0))
    bob = m.body("bob", MASS, (1e-9, 1e-9, 1e-9), position=(LENGTH, 0.0, 0.0))
    if kind == "revolute":
        m.revolute("pin", bob.marker((-LENGTH, 0.0, 0.0)), m.ground.marker((0.0, 0.0, 0.0)))
    else:
        m.distance("pin", bob.marker((0.0, 0.0, 0.0)), m.ground.marker((0.0, 0.0, 0.0)))
    return m


@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
def test_pin_force_of_a_pendulum(integrator):
    """Released level, at the angle s below: tension 3 m g sin s, so the pin pulls with m g (3 sin s) along the rod."""
    solution = pendulum("revolute").simulate(0.8, rate=500, tol=1e-9, integrator=integrator)
    r = solution.com_position("bob")
    along = r / LENGTH
    tension = -3.0 * MASS * G * along[:, 1]
    force, _ = solution.reaction("pin")
    np.testing.assert_allclose(force, -tension[:, None] * along, atol=2e-6 * MASS * G)


def test_outputs_satisfy_the_constraints_better_than_the_integrator():
    """The outputs are projected onto the circle, to rounding; what the interpolant returns is off by 7e-10."""
    solution = pendulum("distance").simulate(2.0, rate=200, tol=1e-5)
    raw = solution.result.y[:, [u.name.startswith("R_") for u in solution.system.unknowns()]]
    strayed = np.abs(np.linalg.norm(raw, axis=1) - LENGTH).max()
    assert 1e-11 < strayed < 1e-8
    np.testing.assert_allclose(np.linalg.norm(solution.com_position("bob"), axis=1), LENGTH, atol=1e-12)
    assert solution.constraint_violation.max() == pytest.approx(strayed, rel=1e-3)


def test_acceleration_is_the_second_derivative_of_the_position():
    """Differences of order 4 at 1 kHz: error about (omega h)^4 = (6 / 1000)^4 = 1e-9 of the acceleration."""
    solution = pendulum("revolute").simulate(0.5, rate=1000, tol=1e-10)
    r, h = solution.com_position("bob"), 1e-3
    second = (-r[4:] + 16 * r[3:-1] - 30 * r[2:-2] + 16 * r[1:-3] - r[:-4]) / (12 * h * h)
    np.testing.assert_allclose(solution.com_acceleration("bob")[2:-2], second, atol=2e-4)
