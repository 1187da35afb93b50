"""From values at uneven times, such as an integrator's own steps, to an evenly sampled signal without aliases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numba import float64, int64, void

from gearmbs.kernels.jit import njit
from gearmbs.signals.errors import SignalError
from gearmbs.signals.filters import decimation_taps
from gearmbs.signals.signal.signal import check_rate, make_signal

if TYPE_CHECKING:
    import xarray as xr

FINE_RATE = 400e3
"""Rate, Hz, that the values are interpolated to at least before the anti-alias filter."""

MARGIN = 64
"""Samples interpolated beyond the span where the times reach so far, so that the filter's ends lie outside."""

BLOCK = 4096
"""Samples that come out of the filter at a time, so that its input stays in the processor's cache."""

GAIN_POINTS = 1 << 14
"""Points at which the gain of the filter is known, thirty and more to its transition."""

_VEC, _MAT = float64[::1], float64[:, ::1]


def even_signal(
    t: np.ndarray,
    values: np.ndarray,
    rate: float,
    *,
    start: float,
    stop: float,
    fine_rate: float = FINE_RATE,
    units: str = "unknown",
    channels: Sequence[str] | None = None,
    speed: float | None = None,
    teeth: Sequence[int] | None = None,
) -> xr.DataArray:
    """Return an evenly sampled signal of values known at uneven times.

    A monotone cubic (PCHIP) runs through the values, is sampled at a multiple of ``rate`` and brought down by the
    zero-phase anti-alias filter of :func:`gearmbs.signals.decimate`. Sampling at ``rate`` directly would fold
    everything above half of it, such as the sharp edges of tooth contact, onto the lines below.

    Parameters
    ----------
    t : ndarray, shape (m,)
        Increasing times, s, dense enough to resolve what happens; an integrator's accepted steps are.
    values : ndarray, shape (m,) or (m, channels)
    rate : float
        Sampling rate of the result, Hz.
    start, stop : float
        Span of the result, s, within ``t`` with a margin of 32 samples or more at both ends for the filter; samples
        lie at whole multiples of 1/rate.
    fine_rate : float
        The rate interpolated to is the least even multiple of ``rate`` not below this, Hz.
    units, channels, speed, teeth
        As for :func:`gearmbs.signals.make_signal`.

    Returns
    -------
    DataArray
        Dimensions (time, channel).

    Raises
    ------
    SignalError
        If the times do not increase or do not cover the span.
    """
    # whoever analyses a file does not wait for a compiler

    rate = check_rate(rate)
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if t.ndim != 1 or values.shape[:1] != t.shape:
        raise SignalError(f"t: has shape {t.shape}, values {values.shape}; give one row of values a time")
    if not np.all(np.diff(t) > 0.0):
        raise SignalError("t: the times do not increase; sort them and drop repeated ones")
    factor = _fine_factor(rate, fine_rate)
    first, last = int(np.ceil(start * rate - 1e-6)), int(np.floor(stop * rate + 1e-6))
    low, high = first - MARGIN, last + MARGIN
    low, high = max(low, int(np.ceil(t[0] * rate - 1e-6))), min(high, int(np.floor(t[-1] * rate + 1e-6)))
    if first < low or last > high:
        raise SignalError(f"start, stop: {start:g} to {stop:g} s is not within the times {t[0]:g} to {t[-1]:g} s")
    columns = values.reshape(t.size, -1)
    # the filter has a gain of one: what does not change, as forces along the shafts of spur wheels, comes out as it is
    changes = [column[0] != column[-1] or np.ptp(column) != 0.0 for column in columns.T]
    changing = np.flatnonzero(changes)
    # each column on end, as the kernel takes it
    even = np.empty((columns.shape[1], high - low + 1)).T
    even[:] = columns[0]
    if changing.size < columns.shape[1]:
        columns = np.ascontiguousarray(columns[:, changing])
    taps = decimation_taps(factor, factor * rate)
    weights = np.ascontiguousarray(taps[::-1])
    for k in range(0, len(even) if changing.size else 0, BLOCK):
        rows = slice(k, min(k + BLOCK, len(even)))
        fine = _fine(t, columns, rate, factor, (low, high), (low + rows.start, low + rows.stop - 1), taps.size // 2)
        for channel, source in zip(changing, fine.T, strict=True):
            products(np.ascontiguousarray(source), weights, factor, even.T[channel, rows])
    return make_signal(
        np.ascontiguousarray(even[first - low : last - low + 1]),
        rate,
        units=units,
        channels=channels,
        t0=first / rate,
        speed=speed,
        teeth=teeth,
    )


def _fine_factor(rate: float, fine_rate: float) -> int:
    """Return the least even multiple of a rate that is not below another one."""
    return max(2, 2 * int(np.ceil(0.5 * fine_rate / rate)))


def even_signal_gain(rate: float, frequencies: np.ndarray) -> np.ndarray:
    """Return by how much `even_signal` multiplies lines at some frequencies, Hz, of what it samples at ``rate``."""
    factor = _fine_factor(rate, FINE_RATE)
    gain = np.abs(np.fft.rfft(decimation_taps(factor, factor * rate), GAIN_POINTS))
    return np.interp(frequencies, np.linspace(0.0, 0.5 * factor * rate, gain.size), gain)


def _fine(
    t: np.ndarray,
    columns: np.ndarray,
    rate: float,
    factor: int,
    span: tuple[int, int],
    wanted: tuple[int, int],
    half: int,
) -> np.ndarray:
    """Return the samples at ``factor`` times the rate that a filter of half length ``half`` spans.

    ``span`` and ``wanted`` are the first and last sample, at the rate itself, of what is known and of what is to come
    out of the filter. Beyond the span the values are continued by point reflection in its end samples.
    """
    first, last = wanted[0] * factor - half, wanted[1] * factor + half
    low, high = span[0] * factor, span[1] * factor
    grid = np.arange(max(first, low), min(last, high) + 1) / (factor * rate)
    known = monotone_cubic(t, columns, np.clip(grid, t[0], t[-1]))
    before, after = max(low - first, 0), max(last - high, 0)
    parts = [known]
    if before:
        parts.insert(0, 2.0 * known[0] - known[before:0:-1])
    if after:
        parts.append(2.0 * known[-1] - known[-2 : -after - 2 : -1])
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


# The kernel of filters that lower the rate: only the samples that are kept are computed.


@njit(
    void(_VEC, _VEC, int64, _VEC),
    cache=True,
    error_model="numpy",
    fastmath={"contract": True, "reassoc": True},
    nogil=True,
)
def products(values, weights, every, out):
    """Write the products of ``weights`` with the values from each ``every``-th one on."""
    for k in range(out.size):
        first = every * k
        total = 0.0
        for i in range(weights.size):
            total += weights[i] * values[first + i]
        out[k] = total


# Piecewise cubic through given values that rises and falls where they do, and not between.
#
# As `scipy.interpolate.PchipInterpolator`, whose import takes longer than many a simulation; in one pass, with no table
# of coefficients.


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
    x, at = np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(at, dtype=float)
    columns = np.ascontiguousarray(y, dtype=float).reshape(x.size, -1)
    out = np.empty((columns.shape[1], at.size))
    interpolate(x, columns, at, out)
    return out.T.reshape(at.shape + y.shape[1:])


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
