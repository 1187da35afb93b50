"""From values at uneven times, such as an integrator's own steps, to an evenly sampled signal without aliases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from .errors import SignalError
from .filters import decimate
from .monotone_cubic import monotone_cubic
from .signal import check_rate, make_signal

FINE_RATE = 400e3
"""Rate, Hz, that the values are interpolated to at least before the anti-alias filter."""

MARGIN = 64
"""Samples interpolated beyond the span where the times reach so far, so that the filter's ends lie outside."""


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
    rate = check_rate(rate)
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    if t.ndim != 1 or values.shape[:1] != t.shape:
        raise SignalError(f"t: has shape {t.shape}, values {values.shape}; give one row of values a time")
    if not np.all(np.diff(t) > 0.0):
        raise SignalError("t: the times do not increase; sort them and drop repeated ones")
    factor = max(2, 2 * int(np.ceil(0.5 * fine_rate / rate)))
    first, last = int(np.ceil(start * rate - 1e-6)), int(np.floor(stop * rate + 1e-6))
    low, high = first - MARGIN, last + MARGIN
    low, high = max(low, int(np.ceil(t[0] * rate - 1e-6))), min(high, int(np.floor(t[-1] * rate + 1e-6)))
    if first < low or last > high:
        raise SignalError(f"start, stop: {start:g} to {stop:g} s is not within the times {t[0]:g} to {t[-1]:g} s")
    fine = np.arange(low * factor, high * factor + 1) / (factor * rate)
    signal = make_signal(
        monotone_cubic(t, values, np.clip(fine, t[0], t[-1])),
        factor * rate,
        units=units,
        channels=channels,
        t0=float(fine[0]),
        speed=speed,
        teeth=teeth,
    )
    even = decimate(signal, rate, edges="extend")
    return even.isel(time=slice(first - low, last - low + 1))
