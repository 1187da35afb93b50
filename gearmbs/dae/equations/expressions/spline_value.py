"""Kernels that read the tables of cubics of `gearmbs.dae.equations.expressions.splines`."""

from __future__ import annotations

import math

from gearmbs.dae.equations.expressions.splines import TABLE_HEAD
from gearmbs.kernels.jit import njit


@njit("int64(float64[::1], int64, int64, float64)", cache=True, nogil=True)
def _interval(table, start, n, v):
    """Return k with table[start+k] <= v < table[start+k+1], clipped to 0 .. n-2."""
    low, high = 0, n - 1
    while high - low > 1:
        mid = (low + high) // 2
        if v >= table[start + mid]:
            low = mid
        else:
            high = mid
    return low


@njit("UniTuple(float64, 5)(float64[::1], int64, int64, float64)", cache=True, nogil=True, error_model="numpy")
def _curve(table, at, curve, x):
    """Return value and four x derivatives of one curve of the table at offset ``at``."""
    n = int(table[at])
    curves = int(table[at + 1])
    xs = at + TABLE_HEAD
    k = _interval(table, xs, n, x)
    c = xs + n + curves + 4 * ((n - 1) * curve + k)
    c0, c1, c2, c3 = table[c], table[c + 1], table[c + 2], table[c + 3]
    d = x - table[xs + k]
    low, high = table[xs], table[xs + n - 1]
    if x < low or x > high:
        e = (low if x < low else high) - table[xs + k]
        f = c0 + e * (c1 + e * (c2 + e * c3))
        f1 = c1 + e * (2.0 * c2 + 3.0 * c3 * e)
        f2 = 0.0 if table[at + 2] != 0.0 else 2.0 * c2 + 6.0 * c3 * e
        d -= e
        return f + d * (f1 + 0.5 * d * f2), f1 + d * f2, f2, 0.0, 0.0
    return c0 + d * (c1 + d * (c2 + d * c3)), c1 + d * (2.0 * c2 + 3.0 * c3 * d), 2.0 * c2 + 6.0 * c3 * d, 6.0 * c3, 0.0


@njit("UniTuple(float64, 6)(float64[::1], int64, int64, float64, float64)", cache=True, nogil=True, error_model="numpy")
def spline_value(table, at, order, x, z):
    """Return the ``order``-th x derivative of a spline and its partials: f, f_x, f_z, f_xx, f_xz, f_zz."""
    if math.isnan(x) or math.isnan(z):
        return math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    curves = int(table[at + 1])
    if curves == 1:
        d = _curve(table, at, 0, x)
        if order == 0:
            return d[0], d[1], 0.0, d[2], 0.0, 0.0
        if order == 1:
            return d[1], d[2], 0.0, d[3], 0.0, 0.0
        return d[2], d[3], 0.0, d[4], 0.0, 0.0
    zs = at + TABLE_HEAD + int(table[at])
    if z <= table[zs] or z >= table[zs + curves - 1]:
        d = _curve(table, at, 0 if z <= table[zs] else curves - 1, x)
        return d[0], d[1], 0.0, d[2], 0.0, 0.0
    k = _interval(table, zs, curves, z)
    low = _curve(table, at, k, x)
    high = _curve(table, at, k + 1, x)
    width = table[zs + k + 1] - table[zs + k]
    s = (z - table[zs + k]) / width
    return (
        low[0] + s * (high[0] - low[0]),
        low[1] + s * (high[1] - low[1]),
        (high[0] - low[0]) / width,
        low[2] + s * (high[2] - low[2]),
        (high[1] - low[1]) / width,
        0.0,
    )
