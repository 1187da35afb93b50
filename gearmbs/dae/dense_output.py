"""Dense output: the BDF polynomials of all steps, evaluated anywhere in the span."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, types

from gearmbs._jit import njit

_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


@njit(types.void(float64, _VEC, int64, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def lagrange_weights(t, nodes, count, value, slope):
    """Weights of the polynomial through ``count`` nodes, for its value and its slope at ``t``.

    Parameters
    ----------
    t : float
        Where the polynomial is wanted.
    nodes : ndarray
        Distinct times; the first ``count`` are used.
    count : int
        Number of nodes, one more than the degree.
    value, slope : ndarray
        Written in the first ``count`` places.
    """
    for j in range(count):
        # value and derivative of prod_m (t - t_m)/(t_j - t_m) by the product rule
        v = 1.0
        d = 0.0
        tj = nodes[j]
        for m in range(count):
            if m != j:
                q = 1.0 / (tj - nodes[m])
                d = (d * (t - nodes[m]) + v) * q
                v *= (t - nodes[m]) * q
        value[j] = v
        slope[j] = d


@njit(types.void(_VEC, _VEC, int64, _MAT, int64, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def combine(value, slope, count, rows, first, y, yp):
    """Write ``y = sum value[j] rows[first + j]`` and ``yp`` likewise with ``slope``."""
    n = y.shape[0]
    for i in range(n):
        y[i] = value[0] * rows[first, i]
        yp[i] = slope[0] * rows[first, i]
    for j in range(1, count):
        a = value[j]
        b = slope[j]
        for i in range(n):
            y[i] += a * rows[first + j, i]
            yp[i] += b * rows[first + j, i]


@njit(types.void(_VEC, _IVEC, _IVEC, _VEC, _MAT, _MAT, _MAT), cache=True, nogil=True, error_model="numpy")
def evaluate_many(times, ends, orders, nodes, rows, y, yp):
    """Write value and slope at each of ``times``, on the polynomial of the step that ends in row ``ends[i]``."""
    value = np.empty(8)
    slope = np.empty(8)
    for i in range(times.shape[0]):
        k = orders[ends[i]]
        lagrange_weights(times[i], nodes[ends[i] - k : ends[i] + 1], k + 1, value, slope)
        combine(value, slope, k + 1, rows, ends[i] - k, y[i], yp[i])


class DenseOutput:
    """Piecewise polynomial through the stored points of a BDF run.

    Each step of order k is the polynomial through its end point and the k points stored before it. Where the
    stored history was rewritten (a change of coordinates, a restart, a re-interpolation) the new history
    precedes the next step as rows of order 0.

    Parameters
    ----------
    t : ndarray, shape (r,)
        Times of the stored points.
    y : ndarray, shape (r, n)
        Values of the stored points.
    orders : ndarray of int, shape (r,)
        Order of the step that ends in each point, 0 for points that only serve as history.
    """

    def __init__(self, t: np.ndarray, y: np.ndarray, orders: np.ndarray):
        self._t = np.ascontiguousarray(t, dtype=float)
        self._y = np.ascontiguousarray(y, dtype=float)
        self._orders = np.ascontiguousarray(orders, dtype=np.int64)
        self._steps = np.flatnonzero(self._orders > 0)
        self._ends = self._t[self._steps]
        self.t_min = float(self._t[self._steps[0] - 1]) if len(self._steps) else float(self._t[0])
        self.t_max = float(self._ends[-1]) if len(self._steps) else float(self._t[0])

    def evaluate(self, t: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return y and y' at ``t``.

        Parameters
        ----------
        t : float or ndarray, shape (m,)
            Times within ``[t_min, t_max]``.

        Returns
        -------
        y, yp : ndarray, shape (n,) or (m, n)

        Raises
        ------
        ValueError
            If a time lies outside the span of the run.
        """
        times = np.atleast_1d(np.asarray(t, dtype=float))
        slack = 1e-12 * max(abs(self.t_min), abs(self.t_max))
        if times.size and (times.min() < self.t_min - slack or times.max() > self.t_max + slack):
            raise ValueError(
                f"t = {times.min():g} .. {times.max():g} leaves the integrated span {self.t_min:g} .. {self.t_max:g}; "
                "integrate further to evaluate there"
            )
        y = np.empty((times.size, self._y.shape[1]))
        yp = np.empty_like(y)
        if not len(self._steps):
            y[:] = self._y[0]
            yp[:] = 0.0
        else:
            pieces = np.minimum(np.searchsorted(self._ends, times, side="left"), len(self._steps) - 1)
            evaluate_many(times, self._steps[pieces], self._orders, self._t, self._y, y, yp)
        if np.ndim(t) == 0:
            return y[0], yp[0]
        return y, yp

    def __call__(self, t: float | np.ndarray) -> np.ndarray:
        """Return y at ``t``, shape (n,) or (m, n)."""
        return self.evaluate(t)[0]

    def derivative(self, t: float | np.ndarray) -> np.ndarray:
        """Return y' at ``t``, shape (n,) or (m, n)."""
        return self.evaluate(t)[1]
