"""Functions of time for motions and torques, with their first two derivatives.

The kinds are closed forms; ``TAPE`` evaluates a parsed expression of time. The parameters of ``PIECEWISE`` are the
number n of pieces, the n - 1 times between them, and of each piece the time it counts from and the coefficients c0 to
c4 of its polynomial.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit

CONSTANT = 0
STEP = 1
STEP_INTEGRAL = 2
HARMONIC = 3
POLYNOMIAL = 4
TAPE = 5
STEP5 = 6
STEP5_INTEGRAL = 7
PIECEWISE = 8

PIECE_SIZE = 6


@njit(cache=True, error_model="numpy", forceinline=True)
def cubic(x):
    """Return STEP on the unit interval, eq. (11), and its slope, for x from 0 to 1."""
    return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)


@njit("UniTuple(float64, 4)(float64, int64)", cache=True, error_model="numpy")
def smooth_step(x, quintic):
    """Return STEP (cubic) or STEP5 (quintic) on the unit interval: integral from 0, value, slope, curvature."""
    if x <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    if x >= 1.0:
        return x - 0.5, 1.0, 0.0, 0.0
    if quintic == 0:
        value, slope = cubic(x)
        return x**3 * (1.0 - 0.5 * x), value, slope, 6.0 - 12.0 * x
    value = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    integral = x**4 * (2.5 - 3.0 * x + x * x)
    slope = 30.0 * x * x * (1.0 - x) ** 2
    return integral, value, slope, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)


@njit("UniTuple(float64, 3)(int64, float64[::1], int64, float64)", cache=True, error_model="numpy")
def evaluate(kind, par, k, t):
    """Return f(t), f'(t), f''(t) of the function with parameters ``par[k:]``."""
    if kind == CONSTANT:
        return par[k], 0.0, 0.0
    if kind == STEP or kind == STEP5:
        t0, f0, t1, f1 = par[k], par[k + 1], par[k + 2], par[k + 3]
        width = t1 - t0
        _, value, slope, curvature = smooth_step((t - t0) / width, 1 if kind == STEP5 else 0)
        rise = f1 - f0
        return f0 + rise * value, rise * slope / width, rise * curvature / width**2
    if kind == STEP_INTEGRAL or kind == STEP5_INTEGRAL:
        t0, f0, t1, f1, start = par[k], par[k + 1], par[k + 2], par[k + 3], par[k + 4]
        width = t1 - t0
        integral, value, slope, _ = smooth_step((t - t0) / width, 1 if kind == STEP5_INTEGRAL else 0)
        rise = f1 - f0
        return start + f0 * (t - t0) + rise * width * integral, f0 + rise * value, rise * slope / width
    if kind == HARMONIC:
        amplitude, omega, phase, offset = par[k], par[k + 1], par[k + 2], par[k + 3]
        s, c = np.sin(omega * t + phase), np.cos(omega * t + phase)
        return offset + amplitude * s, amplitude * omega * c, -amplitude * omega * omega * s
    if kind == PIECEWISE:
        pieces = int(par[k])
        low, high = 0, pieces - 1
        while low < high:
            middle = (low + high) // 2
            if t < par[k + 1 + middle]:
                high = middle
            else:
                low = middle + 1
        k += pieces + PIECE_SIZE * low
        x = t - par[k]
        c0, c1, c2, c3, c4 = par[k + 1], par[k + 2], par[k + 3], par[k + 4], par[k + 5]
        return (
            c0 + x * (c1 + x * (c2 + x * (c3 + x * c4))),
            c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * 4.0 * c4)),
            2.0 * c2 + x * (6.0 * c3 + x * 12.0 * c4),
        )
    degree = int(par[k])
    f, f1, f2 = 0.0, 0.0, 0.0
    for j in range(degree, -1, -1):
        f2 = f2 * t + 2.0 * f1
        f1 = f1 * t + f
        f = f * t + par[k + 1 + j]
    return f, f1, f2
