"""Piecewise cubic through given values that rises and falls where they do, and not between.

As `scipy.interpolate.PchipInterpolator`, whose import takes longer than many a simulation.
"""

from __future__ import annotations

import numpy as np


def monotone_cubic(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the monotone piecewise cubic Hermite interpolant of some values.

    Slopes inside are harmonic means of the neighbouring differences, weighted by the intervals, and zero where the
    differences change sign; at the ends they are of second order, limited to keep the shape.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Increasing, two or more.
    y : ndarray, shape (n,) or (n, columns)
    at : ndarray, shape (m,)
        Where to evaluate, within ``x``.

    Returns
    -------
    ndarray, shape (m,) or (m, columns)

    References
    ----------
    .. [1] F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J.
       Sci. Stat. Comput. 5, 1984.
    """
    shape = (-1,) + (1,) * (y.ndim - 1)
    h = np.diff(x).reshape(shape)
    slope = np.diff(y, axis=0) / h
    d = _derivatives(h, slope)
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    s = (at - x[k]).reshape(shape)
    third = (d[:-1] + d[1:] - 2.0 * slope) / h
    second = (slope - d[:-1]) / h - third
    third /= h
    return ((third[k] * s + second[k]) * s + d[k]) * s + y[k]


def _derivatives(h: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return the derivatives at the points, from the intervals and the differences over them."""
    if len(slope) == 1:
        return np.concatenate([slope, slope])
    left, right = slope[:-1], slope[1:]
    w1, w2 = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    flat = np.sign(left) * np.sign(right) <= 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (w1 + w2) / (w1 / left + w2 / right)
    inside = np.where(flat, 0.0, mean)
    ends = (_end(h[0], h[1], slope[0], slope[1]), _end(h[-1], h[-2], slope[-1], slope[-2]))
    return np.concatenate([ends[0][None], inside, ends[1][None]])


def _end(h0: np.ndarray, h1: np.ndarray, near: np.ndarray, far: np.ndarray) -> np.ndarray:
    """Return the derivative at an end from three points, limited to keep the shape."""
    d = ((2.0 * h0 + h1) * near - h0 * far) / (h0 + h1)
    d = np.where(np.sign(d) != np.sign(near), 0.0, d)
    overshoots = (np.sign(near) != np.sign(far)) & (np.abs(d) > 3.0 * np.abs(near))
    return np.where(overshoots, 3.0 * near, d)
