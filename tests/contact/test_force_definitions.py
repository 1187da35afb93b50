"""Forces of a slice, and friction in a section, against jets of the formulas and complex steps.

The laws of pressure and friction are functions here, of which kernels are handed values and slopes.
"""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.contact.forces import derived as D
from gearmbs.contact.layout import POINTS, WEIGHTS
from tests.jets import jets

STIFFNESS, EXPONENT, DAMPING, WIDTH = 3e9, 1.3, 2e4, 2.5e-3
GAPS = {"whole": (-3e-5, -5e-5), "ends on the right": (-3e-5, 1e-5), "ends on the left": (2e-5, -4e-5)}
RATES = (0.02, -0.05)


def compared(found, exact):
    assert found == pytest.approx(exact, rel=1e-10, abs=1e-13 * np.max(np.abs(exact)))


def bounds(g0, g1, case):
    end = g0 / (g0 - g1)
    return (0.1, 0.95) if case == "whole" else (0.1, end) if case == "ends on the right" else (end, 0.95)


def nodal(g0, g1, r0, r1, low, high):
    """Return the forces on both nodes of a slice."""
    forces = [0.0, 0.0]
    for t, weight in zip(POINTS, WEIGHTS):
        u = low + (high - low) * t
        depth, rate = -(g0 + u * (g1 - g0)), -(r0 + u * (r1 - r0))
        force = WIDTH * weight * (high - low) * (STIFFNESS * depth**EXPONENT + DAMPING * depth * rate)
        forces = [forces[0] + (1.0 - u) * force, forces[1] + u * force]
    return forces


@pytest.mark.parametrize("case", GAPS)
def test_forces_of_a_slice_have_exact_derivatives(case):
    (g0, g1), (r0, r1) = GAPS[case], RATES
    low, high = bounds(g0, g1, case)
    clips = (float(case == "ends on the left"), float(case == "ends on the right"))
    rows = []
    for t in POINTS:
        u = low + (high - low) * t
        depth, rate = -(g0 + u * (g1 - g0)), -(r0 + u * (r1 - r0))
        elastic = STIFFNESS * depth**EXPONENT
        rows.append((
            elastic + DAMPING * depth * rate, EXPONENT * elastic / depth + DAMPING * rate, DAMPING * depth,
            elastic, elastic * depth / (EXPONENT + 1.0),
        ))  # fmt: skip
    p, by_depth, by_rate, elastic, energy = zip(*rows)
    weights = [WIDTH * weight for weight in WEIGHTS]
    values = D.slice_forces.py_func(r0, r1, low, high, *weights, *p, *elastic, *energy)
    left, right = nodal(g0, g1, r0, r1, low, high)
    compared(values[:2], [left, right])
    assert sum(values[2:4]) == pytest.approx(sum(w * e for w, e in zip(weights, elastic)) * (high - low), rel=1e-13)
    found = D.slice_slopes.py_func(g0, g1, r0, r1, low, high, *weights, *p, *by_depth, *by_rate, *clips)
    x = jets([g0, g1, r0, r1, 0.0, 0.0])
    ends = bounds(*x[:2], case)
    # a bound moves with the gaps where the touch ends there, and by itself
    left, right = nodal(*x[:4], ends[0] + x[4], ends[1] + x[5])
    compared(found[:4], -np.array([*left.gradient[:2], *right.gradient[:2]]))
    compared(found[4:7], -np.array([left.gradient[2], left.gradient[3], right.gradient[3]]))
    compared(found[7:], [left.gradient[4], right.gradient[4], left.gradient[5], right.gradient[5]])


TWIST = np.array([0.3, -0.2, 0.1, 4.0, -3.0, 150.0])
POINT = np.array([0.23, 0.0167, 0.0402, 5e-3])  # alpha, along normal, tangent and axis
FORCE = 1234.0


def ratio(speed):
    """Return mu over the speed, of a smooth law, and the derivative of that over the speed."""
    decay = np.exp(-speed / 3.0)
    value = 0.1 + 0.05 * decay
    return value / speed, (-0.05 / 3.0 * decay * speed - value) / speed**3


def friction(alpha, normal, tangent, place, force, twist, slope):
    """Return the wrench of friction from the sliding velocity in space."""
    lean, across = np.cos(slope), np.sin(slope)
    n, t = np.array([np.sin(alpha), np.cos(alpha), 0.0 * alpha]), np.array([np.cos(alpha), -np.sin(alpha), 0.0 * alpha])
    z = np.array([0.0, 0.0, 1.0])
    at = normal * n + tangent * t + place * z
    velocity = twist[:3] + np.array([
        twist[4] * at[2] - twist[5] * at[1], twist[5] * at[0] - twist[3] * at[2], twist[3] * at[1] - twist[4] * at[0],
    ])  # fmt: skip
    line = lean * z - across * n
    speeds = velocity @ t, velocity @ line
    value, _ = ratio(np.sqrt(speeds[0] * speeds[0] + speeds[1] * speeds[1]))
    pull = -force * value * (speeds[0] * t + speeds[1] * line)
    moment = [at[1] * pull[2] - at[2] * pull[1], at[2] * pull[0] - at[0] * pull[2], at[0] * pull[1] - at[1] * pull[0]]
    return np.array([*pull, *moment]), speeds


@pytest.mark.parametrize("slope", [0.0, 0.26])
def test_friction_has_exact_derivatives(slope):
    exact, speeds = friction(*POINT, FORCE, TWIST, slope)
    point = (np.sin(POINT[0]), np.cos(POINT[0]), *POINT[1:], np.cos(slope), np.sin(slope))
    compared(D.sliding.py_func(*TWIST, *point), speeds)
    law, law_slope = ratio(np.hypot(*speeds))
    *wrench, power = D.friction_wrench.py_func(*TWIST, *point, law, FORCE)
    compared(wrench, exact)
    assert power == pytest.approx(exact @ TWIST, rel=1e-12)
    moves = np.array([0.7, -0.02, 0.05, 0.5, 3e6])
    moved, by_force = np.zeros((6, 6, 2)), np.zeros((6, 2))
    D.friction_along.py_func(*TWIST, *point, law, FORCE, law_slope, *moves, moved, 3, 1)
    step = 1e-30j
    along, _ = friction(*(POINT + step * moves[:4]), FORCE + step * moves[4], TWIST, slope)
    compared(moved[:, 3, 1], np.imag(along) / 1e-30)
    D.friction_by_twist.py_func(*TWIST, *point, law, FORCE, law_slope, moved, by_force, 1)
    for k in range(6):
        turned, _ = friction(*POINT, FORCE, TWIST + step * np.eye(6)[k], slope)
        compared(moved[:, k, 1], np.imag(turned) / 1e-30)
    compared(by_force[:, 1], exact / FORCE)
