"""Derivatives of a noisy simulation by central differences, with a step that fits its noise, and what noise is left
in them.

A default step of a general-purpose optimiser, 1e-8 of the parameter, drowns in the integrator's local errors.
Measured on mesh
harmonics: at a tolerance of 1e-8 a step of 1e-2 in ln p is right to a few percent, and so are half of it and twice it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

SIMULATION_STEP = 1e-2
"""Step in ln p, or part of the parameter, for simulations."""

SMOOTH_STEP = float(np.finfo(float).eps) ** (1.0 / 3.0)
"""The same for functions exact to rounding: balances rounding against the third derivative."""

Many = Callable[[Sequence[np.ndarray]], list[np.ndarray]]


def steps(z: np.ndarray, logs: np.ndarray, step: float) -> np.ndarray:
    """Return the step of each coordinate: absolute for logarithms, else a part of its magnitude."""
    size = np.where(logs, 1.0, np.where(z == 0.0, 1.0, np.abs(z)))
    return step * size


def central(
    many: Many, z: np.ndarray, h: np.ndarray, low: np.ndarray | None = None, high: np.ndarray | None = None
) -> np.ndarray:
    """Return the matrix of central differences, shape (m, n); at a bound the points are moved inside.

    Parameters
    ----------
    many : callable
        Values of the function, each of shape (m,), for several points at once, so that they may be computed side by
        side.
    z, h : ndarray, shape (n,)
        Point and steps.
    low, high : ndarray, optional
        Bounds.
    """
    points, widths = [], []
    for k, width in enumerate(h):
        up, down = z.copy(), z.copy()
        up[k] = z[k] + width if high is None else min(z[k] + width, high[k])
        down[k] = z[k] - width if low is None else max(z[k] - width, low[k])
        points += [up, down]
        widths.append(up[k] - down[k])
    values = many(points)
    return np.array([(values[2 * k] - values[2 * k + 1]) / widths[k] for k in range(len(h))]).T


def noise_of_columns(many: Many, z: np.ndarray, h: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return how far the norm of each column is uncertain: its difference from that at half the step.

    Parameters
    ----------
    matrix : ndarray, shape (m, n)
        Differences at the step h.
    """
    half = central(many, z, 0.5 * h)
    return np.linalg.norm(matrix - half, axis=0)
