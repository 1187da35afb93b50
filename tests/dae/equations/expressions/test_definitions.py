"""First and second derivatives of position-level leaves from definitions, against complex steps of plain formulas."""

import numpy as np
import pytest

from gearmbs.dae.equations.expressions import derived as D
from gearmbs.dae.equations.expressions.opcodes import KIN_AXES

STEP = 1e-30


def turn(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == 0 else [[c, -s, 0], [s, c, 0], [0, 0, 1]])


def body(theta, fixed):
    """Return a vector of a body in global components, and a row with its Euler axes."""
    first = turn(2, theta[0])
    second = first @ turn(0, theta[1])
    row = np.zeros(KIN_AXES + 9, dtype=complex)
    row[KIN_AXES:] = [0, 0, 1, *first[:, 0], *second[:, 2]]
    return second @ turn(2, theta[2]) @ fixed, row


def leaf(q, fixed, name):
    """Return value, arguments of the kernels: R and theta of i, of j, theta of k."""
    (arm_i, one), (arm_j, two), (e, three) = (body(q[at : at + 3], s) for at, s in zip((3, 9, 12), fixed))
    x = q[0:3] + arm_i - q[6:9] - arm_j
    if name == "length":
        return np.sqrt(x @ x), (arm_i, arm_j, x, one, two)
    return x @ e, (arm_i, arm_j, x, e, one, two, three)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ["along", "length"])
def test_derivatives_by_complex_steps(name, seed):
    rng = np.random.default_rng(seed)
    q, fixed, n = rng.uniform(-1, 1, 15), rng.uniform(-1, 1, (3, 3)), 15 if name == "along" else 12
    slopes, curves = np.zeros(n), np.zeros((n, n))
    own = [part.real.copy() for part in leaf(q + 0j, fixed, name)[1]]
    getattr(D, f"{name}_slopes").py_func(*own, slopes)
    getattr(D, f"{name}_curves").py_func(*own, curves)
    for p in range(n):
        moved = q + 0j
        moved[p] += 1j * STEP
        value, parts = leaf(moved, fixed, name)
        assert slopes[p] == pytest.approx(value.imag / STEP, rel=1e-10, abs=1e-12)
        gradient = np.zeros(n, dtype=complex)
        getattr(D, f"{name}_slopes").py_func(*parts, gradient)
        row = np.where(np.arange(n) >= p, curves[p], curves[:, p])
        assert row == pytest.approx(gradient.imag / STEP, rel=1e-10, abs=1e-12)
