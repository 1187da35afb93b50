"""From values at uneven times, such as an integrator's own steps, to an evenly sampled signal without aliases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int16, int64, void
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

KNOWN = 4
"""Values at an end of those known so far that have no slope yet of the cubic through all, and one more."""

_VEC, _ROWS = float64[::1], float64[:, ::1]


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
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if t.ndim != 1 or values.shape[:1] != t.shape:
        raise SignalError(f"t: has shape {t.shape}, values {values.shape}; give one row of values a time")
    if not np.all(np.diff(t) > 0.0):
        raise SignalError("t: the times do not increase; sort them and drop repeated ones")
    samples = EvenSamples(rate, start, stop, fine_rate=fine_rate)
    samples.take(t, values.reshape(t.size, -1))
    even = np.ascontiguousarray(samples.finish()[0])
    t0 = float(samples.t[0])
    return make_signal(even, rate, units=units, channels=channels, t0=t0, speed=speed, teeth=teeth)


class EvenSamples:
    """Samples of an evenly sampled signal, made while the values at uneven times come; see `even_signal`.

    Of the values only those are kept of which samples are still to be made.

    Parameters
    ----------
    rate, start, stop, fine_rate
        As for `even_signal`.
    smooth, linear, held : int
        So many of the last columns go through no filter: they are samples of the monotone cubic, of straight lines, or
        the last values before, which are numbers of something: whole, and small.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times of the samples, s.
    """

    def __init__(
        self,
        rate: float,
        start: float,
        stop: float,
        *,
        fine_rate: float = FINE_RATE,
        smooth: int = 0,
        linear: int = 0,
        held: int = 0,
    ) -> None:
        self.rate = check_rate(rate)
        self._span = start, stop
        self._factor = _fine_factor(self.rate, fine_rate)
        self._first, self._last = int(np.ceil(start * self.rate - 1e-6)), int(np.floor(stop * self.rate + 1e-6))
        self.t = self._first / self.rate + np.arange(max(self._last - self._first + 1, 0)) / self.rate
        taps = decimation_taps(self._factor, self._factor * self.rate)
        self._weights = np.ascontiguousarray(taps[::-1])
        self._sharp = np.cumsum([held, linear, smooth])[::-1]
        self._low: int | None = None
        self._next = 0
        # each column on end, as the kernels take it
        self._t, self._columns = np.empty(0), np.empty((0, 0))
        self._even, self._held = np.empty((0, 0)), np.empty((held, 0), np.int16)

    def take(self, t: np.ndarray, columns: np.ndarray) -> None:
        """Take values, (m, columns), at increasing times behind those taken before; make what they decide."""
        if self._low is None:
            self._low = self._next = max(self._first - MARGIN, int(np.ceil(t[0] * self.rate - 1e-6)))
            held = len(self._held)
            self._even = np.empty((columns.shape[1] - held, self.t.size))
            self._held = np.empty((held, self.t.size), np.int16)
            self._t, self._columns = t, np.ascontiguousarray(columns.T)
        else:
            self._t = np.concatenate([self._t, t])
            self._columns = np.concatenate([self._columns, columns.T], axis=1)
        self._go_on(self._last + MARGIN, is_last=False)

    def finish(self) -> tuple[np.ndarray, np.ndarray]:
        """Return all samples, those that are not held and those that are, each column on end in memory.

        Raises
        ------
        SignalError
            If the times do not cover the span.
        """
        t = self._t
        if self._low is None or not t.size:
            raise SignalError("t: there are no times; give those of the span and some beyond both ends")
        high = min(self._last + MARGIN, int(np.floor(t[-1] * self.rate + 1e-6)))
        if self._first < self._low or self._last > high:
            start, stop = self._span
            raise SignalError(
                f"start, stop: {start:g} to {stop:g} s is not within the times {self._low / self.rate:g} to {t[-1]:g} s"
            )
        self._go_on(high, is_last=True)
        return self._even.T, self._held.T

    def known(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return times and columns of the samples made so far, and of the values behind them."""
        made = min(max(self._next - self._first, 0), self.t.size)
        behind = int(np.searchsorted(self._t, self.t[made - 1], side="right")) if made else 0
        samples = np.concatenate([self._even[:, :made], self._held[:, :made]]).T
        return [(self.t[:made], samples), (self._t[behind:], self._columns[:, behind:].T)]

    def _go_on(self, high: int, *, is_last: bool) -> None:
        """Make samples in blocks up to number ``high``, or as far as the slopes of the cubic are known."""
        assert self._low is not None
        half = self._weights.size // 2
        while self._next <= high:
            last = min(self._next + BLOCK - 1, high)
            reach = min(last + half / self._factor, high) / self.rate
            if not is_last and (self._t.size < KNOWN or self._t[-KNOWN] < reach):
                break
            self._block(last, high, half)
            self._next = last + 1
        if not is_last:
            spent = int(np.searchsorted(self._t, (self._next - half / self._factor - 1.0) / self.rate)) - KNOWN
            if spent > 0:
                self._t, self._columns = self._t[spent:].copy(), self._columns[:, spent:].copy()

    def _block(self, last: int, high: int, half: int) -> None:
        """Make the samples from the next one to number ``last``."""
        assert self._low is not None
        t, columns, even = self._t, self._columns, self._even
        begin = max(self._first - self._next, 0)
        rows = slice(self._next + begin - self._first, min(last, self._last) + 1 - self._first)
        if rows.stop <= rows.start:
            # all of it lies in the margin behind the span
            return
        n = last - self._next + 1
        smooth, linear = (len(columns) - int(k) for k in self._sharp[:2])
        # the filter has a gain of one: what does not change, as forces along spur wheels' shafts, comes out as it is
        changing = [c for c in range(smooth) if columns[c, 0] != columns[c, -1] or np.ptp(columns[c]) != 0.0]
        constant = [c for c in range(smooth) if c not in changing]
        even[constant, rows] = columns[constant, :1]
        if changing:
            values = columns[changing]
            fine = _fine(t, values, self.rate, self._factor, (self._low, high), (self._next, last), half)
            room = np.empty(n)
            for channel, source in zip(changing, fine, strict=True):
                products(source, self._weights, self._factor, room)
                even[channel, rows] = room[begin : begin + rows.stop - rows.start]
        at = self.t[rows]
        if linear > smooth:
            even[smooth:linear, rows] = monotone_cubic(t, columns[smooth:linear].T, np.clip(at, t[0], t[-1])).T
        if linear < len(columns):
            between(t, columns[linear:], at, even[linear:, rows], self._held[:, rows])


def _fine_factor(rate: float, fine_rate: float) -> int:
    """Return the least even multiple of a rate that is not below another one."""
    return max(2, 2 * int(np.ceil(0.5 * fine_rate / rate)))


def _fine(
    t: np.ndarray,
    columns: np.ndarray,
    rate: float,
    factor: int,
    span: tuple[int, int],
    wanted: tuple[int, int],
    half: int,
) -> np.ndarray:
    """Return the samples at ``factor`` times the rate that a filter of half length ``half`` spans, a row a column.

    ``span`` and ``wanted`` are the first and last sample, at the rate itself, of what is known and of what is to come
    out of the filter. Beyond the span the values are continued by point reflection in its end samples.
    """
    first, last = wanted[0] * factor - half, wanted[1] * factor + half
    low, high = span[0] * factor, span[1] * factor
    grid = np.arange(max(first, low), min(last, high) + 1) / (factor * rate)
    before, after = max(low - first, 0), max(last - high, 0)
    known = np.empty((len(columns), grid.size))
    interpolate(t, columns, np.clip(grid, t[0], t[-1]), known)
    if not before and not after:
        return known
    ahead = 2.0 * known[:, :1] - known[:, before:0:-1]
    return np.concatenate([ahead, known, 2.0 * known[:, -1:] - known[:, -2 : -after - 2 : -1]], axis=1)


# The kernel of filters that lower the rate: only the samples that are kept are computed, four of them at a time, so
# that a weight is read once for all of them.


@njit(
    void(_VEC, _VEC, int64, _VEC),
    cache=True,
    error_model="numpy",
    fastmath={"contract": True, "reassoc": True},
    nogil=True,
)
def products(values, weights, every, out):
    """Write the products of ``weights`` with the values from each ``every``-th one on."""
    fours = out.size - out.size % 4
    for k in range(0, fours, 4):
        first = every * k
        second, third, fourth = first + every, first + 2 * every, first + 3 * every
        one, two, three, four = 0.0, 0.0, 0.0, 0.0
        for i in range(weights.size):
            weight = weights[i]
            one += weight * values[first + i]
            two += weight * values[second + i]
            three += weight * values[third + i]
            four += weight * values[fourth + i]
        out[k], out[k + 1], out[k + 2], out[k + 3] = one, two, three, four
    for k in range(fours, out.size):
        total = 0.0
        for i in range(weights.size):
            total += weights[i] * values[every * k + i]
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
    columns = np.ascontiguousarray(np.asarray(y, dtype=float).reshape(x.size, -1).T)
    out = np.empty((len(columns), at.size))
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
        return (y[c, 1] - y[c, 0]) / (x[1] - x[0])
    first = min(max(k - 1, 0), n - 3)
    h0, h1 = x[first + 1] - x[first], x[first + 2] - x[first + 1]
    left, right = (y[c, first + 1] - y[c, first]) / h0, (y[c, first + 2] - y[c, first + 1]) / h1
    if k == 0:
        return _end(h0, h1, left, right)
    if k == n - 1:
        return _end(h1, h0, right, left)
    return _inner(h0, h1, left, right)


@njit(void(_VEC, _ROWS, _VEC, _ROWS), cache=True, error_model="numpy", nogil=True)
def interpolate(x, y, at, out):
    """Write the interpolant of each row of y at the points ``at`` to a row of ``out``."""
    m, n = y.shape
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
            slope = ahead[c] if follows else (y[c, k + 1] - y[c, k]) * per_h
            near = end[c] if follows else _derivative(x, y, k, c)
            if is_inner:
                ahead[c] = (y[c, k + 2] - y[c, k + 1]) * per_next
                end[c] = _inner(h, h_next, slope, ahead[c])
            else:
                end[c] = _derivative(x, y, k + 1, c)
            cubic = (near + end[c] - 2.0 * slope) * per_h
            second, third = (slope - near) * per_h - cubic, cubic * per_h
            for q in range(p, stop):
                s = at[q] - x[k]
                out[c, q] = ((third * s + second) * s + near) * s + y[c, k]
        p, known = stop, k


@njit(void(_VEC, _ROWS, _VEC, float64[:, :], int16[:, :]), cache=True, error_model="numpy", nogil=True)
def between(x, y, at, linear, held):
    """Write straight lines through the first rows of y at the points ``at``, and the last values before of the others.

    Points increase; before the first value and behind the last one these go on.
    """
    lines, n, k = linear.shape[0], x.size, 0
    for p in range(at.size):
        while k + 2 < n and x[k + 1] <= at[p]:
            k += 1
        inside = x[0] <= at[p] < x[n - 1]
        end = 0 if at[p] < x[0] else n - 1
        for c in range(lines):
            if inside:
                linear[c, p] = (y[c, k + 1] - y[c, k]) / (x[k + 1] - x[k]) * (at[p] - x[k]) + y[c, k]
            else:
                linear[c, p] = y[c, end]
        for c in range(held.shape[0]):
            held[c, p] = np.int16(y[lines + c, k if inside else end])
