"""Spectra of a record's squared envelope in which lines of a bearing are looked for.

Three, for no one suits all defects: the prewhitened record as a whole, in which lines of gears are levelled, and in one
band, usually that of the highest kurtosis; and the mean over many narrow bands of the record flattened over
neighbourhoods of its spectrum. The last is the integral of the squared spectral coherence over the carrier, after
Antoni's enhanced envelope spectrum: weak lines that stand in many bands add up, and blows at perfectly even times,
which prewhitening lowers to the noise, are kept.

References
----------
.. [1] J. Antoni, G. Xin, N. Hamzaoui, Fast computation of the spectral correlation, Mechanical Systems and Signal
   Processing 92 (2017) 248-277.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import scipy.fft
import xarray as xr

from .angular import angular_resample
from .bearing_evidence import EnvelopeSpectrum, power_of, squared_envelope
from .envelope import kurtogram
from .errors import SignalError
from .separation import level_lines, prewhiten
from .signal import like, rate_of

EDGE = 0.95
"""Share of half the sampling rate above which no band is chosen: filters against aliasing end there."""
LEAST_LINES = 3.0
"""A band is at least so many times as wide as the highest fundamental."""
MOST_BANDS = 64
NEIGHBOURHOOD = 4.0
"""Width over which a spectrum is flattened, in shaft turns."""


def envelope_spectra(
    signal: xr.DataArray,
    turns: float,
    highest: float,
    *,
    band: tuple[float, float] | None = None,
    phase: xr.DataArray | None = None,
) -> tuple[tuple[float, float], list[EnvelopeSpectrum]]:
    """Return the band of one channel, and the spectra of its squared envelope.

    Parameters
    ----------
    signal : xarray.DataArray
        One channel.
    turns, highest : float
        Turns of the shaft and highest fundamental looked for, Hz.
    band : (float, float), optional
        Hz; default that of the kurtogram. A band that is given is the only part that is looked at.
    phase : xarray.DataArray, optional
        Angle of the shaft, rad: envelopes are followed in angle, and frequencies are those at the mean speed.
    """
    rate = rate_of(signal)
    chosen = choose_band(signal, highest) if band is None else (float(band[0]), float(band[1]))
    if not 0.0 <= chosen[0] < chosen[1] <= rate / 2:
        raise SignalError(f"band: must lie inside 0 to {rate / 2:g} Hz, got {band}")
    white = prewhiten(signal).values[:, 0]
    words = f"{chosen[0]:.0f} to {chosen[1]:.0f} Hz"

    def spectrum(square: np.ndarray, sampled: float, where: str) -> EnvelopeSpectrum:
        if phase is not None:
            square, sampled = _in_angle(signal, square, sampled, phase, turns)
        power = power_of(square)
        return EnvelopeSpectrum.of(power, sampled / square.size, turns, where)

    found = [] if band is not None else [spectrum(squared_envelope(white, rate, None), rate, "whole record")]
    found.append(spectrum(squared_envelope(white, rate, chosen), rate, words))
    flat = level_lines(signal, NEIGHBOURHOOD * turns).values[:, 0]
    limits = chosen if band is not None else (0.0, EDGE * rate / 2)
    pieces = [spectrum(square, sampled, "") for square, sampled in _narrow_bands(flat, rate, limits, highest)]
    size = min(piece.ratio.size for piece in pieces)
    mean = np.mean([piece.ratio[:size] for piece in pieces], axis=0)
    where = f"mean of {len(pieces)} bands" + ("" if band is None else f" in {words}")
    found.append(EnvelopeSpectrum.of(mean, pieces[0].step, turns, where))
    return chosen, found


def _narrow_bands(
    values: np.ndarray, rate: float, limits: tuple[float, float], highest: float
) -> Iterator[tuple[np.ndarray, float]]:
    """Yield the squared envelope in each of equal bands that do not overlap, and its sampling rate."""
    line = scipy.fft.rfft(values - values.mean())
    step = rate / values.size
    first, last = max(int(limits[0] / step), 1), min(int(limits[1] / step), line.size)
    width = max(int(LEAST_LINES * highest / step), (last - first) // MOST_BANDS)
    count = max((last - first) // width, 1)
    width = (last - first) // count
    for k in range(count):
        piece = line[first + k * width : first + (k + 1) * width]
        # the square of an envelope has twice the band's width
        yield np.abs(scipy.fft.ifft(piece, 2 * width)) ** 2, 2 * width * step


def _in_angle(
    signal: xr.DataArray, square: np.ndarray, sampled: float, phase: xr.DataArray, turns: float
) -> tuple[np.ndarray, float]:
    """Return a squared envelope over the angle of the shaft, and samples a second at the mean speed."""
    rate = rate_of(signal)
    if square.size != signal.sizes["time"]:
        at = np.arange(signal.sizes["time"]) * (sampled / rate)
        square = np.interp(at, np.arange(square.size), square)
    angular = angular_resample(like(signal, square[:, None]), phase)
    return angular.values[:, 0], float(angular.attrs["samples_per_rev"]) * turns


def choose_band(signal: xr.DataArray, highest: float) -> tuple[float, float]:
    """Return the band of highest kurtosis that is wide enough for a line and its sidebands, Hz.

    Parameters
    ----------
    signal : xarray.DataArray
        One channel counts, the first.
    highest : float
        Highest fundamental, Hz.
    """
    rate, n = rate_of(signal), min(signal.sizes["time"], 1 << 17)
    fits = int(math.log2(max(rate / 2 / (LEAST_LINES * highest), 2.0)))
    levels = max(1, min(fits, int(math.log2(max(n // 32, 2)))))
    found = kurtogram(signal, levels=levels)
    width, centre = found["bandwidth"].values, found["centre"].values
    value = np.where(np.isfinite(found["kurtosis"].values[:, 0]), found["kurtosis"].values[:, 0], -np.inf)
    good = (centre + 0.5 * width <= EDGE * rate / 2) | (found["bands"].values == 1)
    best = int(np.argmax(np.where(good & (width >= LEAST_LINES * highest), value, -np.inf)))
    top = min(centre[best] + 0.5 * width[best], EDGE * rate / 2)
    return float(centre[best] - 0.5 * width[best]), float(top)
