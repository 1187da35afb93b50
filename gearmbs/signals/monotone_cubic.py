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
        Where to evaluate, within ``x``; fastest if it increases.

    Returns
    -------
    ndarray, shape (m,) or (m, columns)
        Each column on end in memory.

    References
    ----------
    .. [1] F. N. Fritsch, J. Butland, A method for constructing local monotone piecewise cubic interpolants, SIAM J.
       Sci. Stat. Comput. 5, 1984.
    """
    from gearmbs.signals.piecewise_cubic import interpolate

    x, at = np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(at, dtype=float)
    columns = np.ascontiguousarray(y, dtype=float).reshape(x.size, -1)
    out = np.empty((columns.shape[1], at.size))
    interpolate(x, columns, at, out)
    return out.T.reshape(at.shape + y.shape[1:])
