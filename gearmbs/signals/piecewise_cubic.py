"""The kernel of `gearmbs.signals.monotone_cubic`: in one pass, with no table of coefficients."""

import numpy as np
from numba import float64, void

from gearmbs.kernels.jit import njit

_VEC = float64[::1]
_MAT = float64[:, ::1]


@njit(cache=True, error_model="numpy", forceinline=True)
def _inner(h0, h1, left, right):
    """Return the derivative between two intervals of given lengths and differences."""
    if not left * right > 0.0:
        return 0.0
    w1, w2 = 2.0 * h1 + h0, h1 + 2.0 * h0
    return (w1 + w2) * left * (right / (w1 * right + w2 * left))


@njit(cache=True, error_model="numpy", forceinline=True)
def _end(h0, h1, near, far):
    """Return the derivative at an end from three points, limited to keep the shape."""
    d = ((2.0 * h0 + h1) * near - h0 * far) / (h0 + h1)
    if np.sign(d) != np.sign(near):
        return 0.0
    if np.sign(near) != np.sign(far) and abs(d) > 3.0 * abs(near):
        return 3.0 * near
    return d


@njit(cache=True, error_model="numpy", forceinline=True)
def _derivative(x, y, k, c):
    """Return the derivative at point k of column c."""
    n = x.size
    if n == 2:
        return (y[1, c] - y[0, c]) / (x[1] - x[0])
    first = min(max(k - 1, 0), n - 3)
    h0, h1 = x[first + 1] - x[first], x[first + 2] - x[first + 1]
    left, right = (y[first + 1, c] - y[first, c]) / h0, (y[first + 2, c] - y[first + 1, c]) / h1
    if k == 0:
        return _end(h0, h1, left, right)
    if k == n - 1:
        return _end(h1, h0, right, left)
    return _inner(h0, h1, left, right)


@njit(void(_VEC, _MAT, _VEC, _MAT), cache=True, error_model="numpy", nogil=True)
def interpolate(x, y, at, out):
    """Write the interpolant of each column of y at the points ``at`` to a row of ``out``."""
    n, m = y.shape
    # derivative at the end of the interval, difference over the next one
    end, ahead = np.zeros(m), np.zeros(m)
    p, k, known = 0, 0, -2
    while p < at.size:
        if not x[k] <= at[p]:
            k = 0
        if k + 1 < n - 1 and at[p] >= x[k + 1]:
            k += 1
            if k + 1 < n - 1 and at[p] >= x[k + 1]:
                k = min(max(np.searchsorted(x, at[p], side="right") - 1, 0), n - 2)
        stop = p + 1
        while stop < at.size and at[stop] >= x[k] and (at[stop] < x[k + 1] or k + 1 == n - 1):
            stop += 1
        h = x[k + 1] - x[k]
        follows, is_inner = k == known + 1, k + 2 < n
        h_next = x[k + 2] - x[k + 1] if is_inner else h
        per_h, per_next = 1.0 / h, 1.0 / h_next
        for c in range(m):
            slope = ahead[c] if follows else (y[k + 1, c] - y[k, c]) * per_h
            near = end[c] if follows else _derivative(x, y, k, c)
            if is_inner:
                ahead[c] = (y[k + 2, c] - y[k + 1, c]) * per_next
                end[c] = _inner(h, h_next, slope, ahead[c])
            else:
                end[c] = _derivative(x, y, k + 1, c)
            cubic = (near + end[c] - 2.0 * slope) * per_h
            second, third = (slope - near) * per_h - cubic, cubic * per_h
            for q in range(p, stop):
                s = at[q] - x[k]
                out[c, q] = ((third * s + second) * s + near) * s + y[k, c]
        p, known = stop, k
