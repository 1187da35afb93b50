"""Small DAEs the tests share."""

from __future__ import annotations

import numpy as np
from numba import njit

from gearmbs.dae.problem import HOOK_SIG, JACOBIAN_SIG, RESIDUAL_SIG, DAEProblem

GRAVITY = 9.81


@njit(RESIDUAL_SIG, error_model="numpy")
def pendulum_residual(t, y, yp, out, idata, rdata, work):
    """Unit pendulum, stabilised index 2: y = (x, y, u, v, lambda, mu)."""
    out[0] = yp[0] - y[2] + y[0] * y[5]
    out[1] = yp[1] - y[3] + y[1] * y[5]
    out[2] = yp[2] + y[0] * y[4]
    out[3] = yp[3] + y[1] * y[4] + rdata[0]
    out[4] = 0.5 * (y[0] ** 2 + y[1] ** 2 - 1.0)
    out[5] = y[0] * y[2] + y[1] * y[3]


@njit(JACOBIAN_SIG, error_model="numpy")
def pendulum_jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Columns x, y, u, v, lambda, mu."""
    for i in range(2):
        vals[4 * i] = cj + y[5]
        vals[4 * i + 1] = y[4]
        vals[4 * i + 2] = y[i]
        vals[4 * i + 3] = y[2 + i]
        vals[8 + 3 * i] = -1.0
        vals[9 + 3 * i] = cj
        vals[10 + 3 * i] = y[i]
        vals[14 + i] = y[i]
        vals[16 + i] = y[i]


def pendulum() -> DAEProblem:
    """Return the pendulum released from the horizontal."""
    differential = np.array([True] * 4 + [False] * 2)
    return DAEProblem(
        n=6,
        residual=pendulum_residual,
        jacobian=pendulum_jacobian,
        indptr=np.array([0, 4, 8, 11, 14, 16, 18]),
        indices=np.array([0, 2, 4, 5, 1, 3, 4, 5, 0, 2, 5, 1, 3, 5, 2, 3, 0, 1]),
        idata=np.zeros(1, dtype=np.int64),
        rdata=np.array([GRAVITY]),
        work_size=1,
        y0=np.array([1.0, 0, 0, 0, 0, 0]),
        yp0=np.array([0.0, 0, 0, -GRAVITY, 0, 0]),
        error_mask=differential.copy(),
        atol_scale=np.array([1.0, 1, 4, 4, 30, 4]),
        scale=np.array([1.0, 1, 4, 4, 30, 4]),
        differential=differential,
        names=["x", "y", "u", "v", "lambda", "mu"],
    )


@njit(RESIDUAL_SIG, error_model="numpy")
def angle_residual(t, y, yp, out, idata, rdata, work):
    """Forced rotor with its angle counted from a reference of ``idata[0]`` turns: y = (angle, rate)."""
    out[0] = yp[0] - y[1]
    out[1] = yp[1] - np.cos(y[0]) + 0.3 * y[1] - rdata[0]


@njit(JACOBIAN_SIG, error_model="numpy")
def angle_jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Full 2 x 2."""
    vals[0] = cj
    vals[1] = np.sin(y[0])
    vals[2] = -1.0
    vals[3] = cj + 0.3


@njit(HOOK_SIG, error_model="numpy")
def turn_back(t, hist, npast, idata, rdata, work):
    """Take whole turns out of the angle when it has passed one, in all stored points, and count them."""
    if hist[0, 0] < 2.0 * np.pi:
        return 0
    for j in range(npast):
        hist[j, 0] -= 2.0 * np.pi
    idata[0] += 1
    return 1


def rotor(with_hook: bool) -> DAEProblem:
    """Return the rotor, with its angle kept within a turn by the hook or running free."""
    everything = np.ones(2, dtype=bool)
    return DAEProblem(
        n=2,
        residual=angle_residual,
        jacobian=angle_jacobian,
        indptr=np.array([0, 2, 4]),
        indices=np.array([0, 1, 0, 1]),
        idata=np.zeros(1, dtype=np.int64),
        rdata=np.array([2.0]),
        work_size=1,
        y0=np.array([0.0, 0.0]),
        yp0=np.array([0.0, 3.0]),
        error_mask=everything,
        atol_scale=np.ones(2),
        scale=np.ones(2),
        differential=everything,
        hook=turn_back if with_hook else None,
    )
