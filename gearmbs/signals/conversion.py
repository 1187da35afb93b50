"""Displacement, velocity and acceleration into each other, in the frequency domain and within a stated band."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import scipy.fft
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.signal import DIMENSIONS, like, rate_of, unit_dimension, units_of

Dimension = Literal["displacement", "velocity", "acceleration"]
DERIVATIVE = {"displacement": 0, "velocity": 1, "acceleration": 2}
TAPER = 0.25
"""Part of the edge's frequency over which the window falls at either end of the band."""
EDGE_PERIODS = 6.0
"""Periods of the lowest frequency that are lost at either end: the fall there, `TAPER` wide, rings over 1.5 reciprocal
widths."""


def convert(
    signal: xr.DataArray,
    to: Dimension,
    *,
    band: tuple[float, float],
    edges: Literal["trim", "keep"] = "trim",
) -> xr.DataArray:
    """Integrate or differentiate to displacement, velocity or acceleration, in SI units.

    Each channel's spectrum is multiplied by (2 pi i f)^n, n = -2 ... 2, inside the band; outside, the response falls
    to zero by half a cosine over a quarter of the band's edge frequency: zero below 0.75 low and above 1.25 high.
    Nothing outside remains, the mean least of all: integration does not drift, differentiation adds no noise from
    beyond.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), each channel in a unit of displacement, velocity or acceleration ("g" is gravity).
    to : {"displacement", "velocity", "acceleration"}
        What to convert to: m, m/s or m/s^2.
    band : (float, float)
        Low and high end of the band in Hz, 0 < low < high; high is capped at half the sampling rate.
    edges : {"trim", "keep"}
        "trim" (default) fades the record in and out and drops 6 / low seconds at either end: what remains is right.
        "keep" keeps the length by reflecting the record at its ends; over those 6 / low seconds the result is
        approximate, the more so the further a component lies above `low` (by integration).

    Returns
    -------
    xarray.DataArray
        In SI units, attribute `band`.

    Raises
    ------
    SignalError
        If the band or a unit does not fit, or nothing remains after trimming.
    """
    rate = rate_of(signal)
    low, high = (float(f) for f in band)
    if to not in DERIVATIVE:
        raise SignalError(f"to: must be one of {list(DERIVATIVE)}, got {to!r}")
    if not 0.0 < low < high or low >= rate / 2:
        raise SignalError(f"band: must be 0 < low < high with low below {rate / 2:g} Hz, got {band}")
    if edges not in ("keep", "trim"):
        raise SignalError(f"edges: must be 'keep' or 'trim', got {edges!r}")
    high = min(high, rate / 2)
    n = signal.sizes["time"]
    margin = math.ceil(EDGE_PERIODS * rate / low)
    if edges == "trim" and n <= 2 * margin:
        raise SignalError(
            f"signal: {n / rate:g} s are too short to drop {margin / rate:g} s at either end; "
            "raise band[0] or pass edges='keep'"
        )
    pad = min(n - 1, margin)
    columns = []
    for column, unit in zip(signal.values.T, units_of(signal)):
        dimension, factor = unit_dimension(unit)
        if dimension not in DERIVATIVE:
            raise SignalError(f"units: {unit!r} is a unit of {dimension}, which cannot be converted to {to}")
        column = factor * (column - column.mean())
        power = DERIVATIVE[to] - DERIVATIVE[dimension]
        if edges == "trim":
            fade = _fade(margin // 2)
            column[: fade.size] *= fade
            column[n - fade.size :] *= fade[::-1]
            columns.append(_multiply(column, rate, power, low, high, margin)[margin : n - margin])
        else:
            fade = _fade(pad)
            extended = np.concatenate((fade * column[pad:0:-1], column, fade[::-1] * column[-2 : -pad - 2 : -1]))
            columns.append(_multiply(extended, rate, power, low, high, 0)[pad : pad + n])
    first = margin if edges == "trim" else 0
    return like(
        signal,
        np.stack(columns, axis=1),
        t0=float(signal["time"].values[first]),
        units=DIMENSIONS[to],
        band=(low, high),
    )


def _multiply(column: np.ndarray, rate: float, power: int, low: float, high: float, zeros: int) -> np.ndarray:
    """Apply (2 pi i f)^power times the band's window; `zeros` keeps the ends from wrapping around."""
    length = scipy.fft.next_fast_len(column.size + zeros, real=True)
    frequency = scipy.fft.rfftfreq(length, 1.0 / rate)
    line = scipy.fft.rfft(column, length)
    line[1:] *= band_window(frequency[1:], low, high) * (2j * np.pi * frequency[1:]) ** power
    line[0] = 0.0
    if length % 2 == 0 and power % 2:
        line[-1] = 0.0
    return scipy.fft.irfft(line, length)[: column.size]


def _fade(count: int) -> np.ndarray:
    return 0.5 * (1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count)) if count else np.empty(0)


def band_window(frequency: np.ndarray, low: float, high: float) -> np.ndarray:
    """One inside [low, high], zero outside [0.75 low, 1.25 high], half a cosine between."""
    rise = np.clip((frequency - (1.0 - TAPER) * low) / (TAPER * low), 0.0, 1.0)
    fall = np.clip(((1.0 + TAPER) * high - frequency) / (TAPER * high), 0.0, 1.0)
    return 0.25 * (1.0 - np.cos(np.pi * rise)) * (1.0 - np.cos(np.pi * fall))
