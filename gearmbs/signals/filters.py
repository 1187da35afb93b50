"""Zero-phase FIR filters: design by the Kaiser formula, application with the delay taken out, edges stated.

A symmetric filter of odd length 2h + 1 delays by exactly h samples; shifting its output back leaves no phase at
all. Only samples at least h from either end are computed from the record alone; `edges` says what to do about
the rest.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np

from gearmbs.signals.errors import SignalError
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import check_rate, like, rate_of
from gearmbs.signals.signal.units import Given

if TYPE_CHECKING:
    import xarray as xr

# Symmetric FIR filters by Kaiser's window, and their convolution with long records.
#
# As in `scipy.signal`, whose import takes longer than many a simulation.


def kaiser_order(attenuation: float, width: float) -> tuple[int, float]:
    """Return the length and the shape parameter of Kaiser's window.

    Parameters
    ----------
    attenuation : float
        Of the stop band and, as ripple 10^(-attenuation/20), of the pass band, dB; at least 8.
    width : float
        Of the transition, as a fraction of half the sampling rate.

    Returns
    -------
    length : int
    beta : float

    References
    ----------
    .. [1] J. F. Kaiser, Nonrecursive digital filter design using the I0-sinh window function, ISCAS 1974.
    """
    if attenuation < 8.0:
        raise ValueError(f"attenuation is {attenuation:g} dB; Kaiser's formula holds from 8 dB on")
    length = math.ceil((attenuation - 7.95) / 2.285 / (math.pi * width) + 1)
    if attenuation > 50.0:
        beta = 0.1102 * (attenuation - 8.7)
    elif attenuation > 21.0:
        beta = 0.5842 * (attenuation - 21.0) ** 0.4 + 0.07886 * (attenuation - 21.0)
    else:
        beta = 0.0
    return length, beta


def windowed_sinc(length: int, cutoffs: float | Sequence[float], kind: str, rate: float, beta: float) -> np.ndarray:
    """Return a symmetric FIR filter of odd length by Kaiser's window, with a gain of one in the pass band.

    Parameters
    ----------
    length : int
    cutoffs : float or pair
        Middle of the transition band or bands, Hz.
    kind : {"lowpass", "highpass", "bandpass", "bandstop"}
    rate : float
        Sampling rate, Hz.
    beta : float
        Shape of the window.

    Returns
    -------
    ndarray, shape (length,)
    """
    edges = np.atleast_1d(cutoffs) / (0.5 * rate)
    passes_zero = kind in ("lowpass", "bandstop")
    marks = np.concatenate([[0.0] if passes_zero else [], edges, [] if edges.size % 2 == passes_zero else [1.0]])
    bands = marks.reshape(-1, 2)
    place = np.arange(length) - 0.5 * (length - 1)
    taps = np.zeros(length)
    for left, right in bands:
        taps += right * np.sinc(right * place) - left * np.sinc(left * place)
    taps *= np.kaiser(length, beta)
    left, right = bands[0]
    at = 0.0 if left == 0.0 else 1.0 if right == 1.0 else 0.5 * (left + right)
    return taps / np.sum(taps * np.cos(np.pi * place * at))


def convolve_valid(values: np.ndarray, taps: np.ndarray, every: int = 1) -> np.ndarray:
    """Return the fully supported part of a convolution.

    All samples are computed by overlapping pieces of the Fourier transform, each of several one by one.

    Parameters
    ----------
    values : ndarray, shape (n,)
    taps : ndarray, shape (m,)
    every : int
        Return only each of so many samples, from the first on; the others are not computed.

    Returns
    -------
    ndarray, shape (ceil((n - m + 1) / every),)
    """
    return _each_of_several(values, taps, every) if every > 1 else next(convolutions(values, taps[None]))


def convolutions(values: np.ndarray, filters: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the fully supported parts of convolutions of values with filters, (k, m), from one transform of them."""
    length = filters.shape[1]
    lap = length - 1
    count = values.size - lap
    # about where the transforms cost least a sample
    size = 1 << (min(8 * length, values.size) - 1).bit_length()
    step = size - lap
    pieces = -(-count // step)
    padded = np.zeros((pieces - 1) * step + size)
    padded[: values.size] = values
    rows = np.lib.stride_tricks.sliding_window_view(padded, size)[::step]
    spectrum = np.fft.rfft(rows, axis=1)
    for taps in filters:
        # the first supported sample comes first
        shifted = np.zeros(size)
        shifted[size - lap :], shifted[: length - lap] = taps[:lap], taps[lap:]
        yield np.fft.irfft(spectrum * np.fft.rfft(shifted), size, axis=1)[:, :step].ravel()[:count]


def _each_of_several(values: np.ndarray, taps: np.ndarray, every: int) -> np.ndarray:
    """Return each ``every``-th sample of the fully supported part of a convolution.

    As many samples as fit into one filter length come from two neighbouring stretches of the values, by a matrix with
    the taps further down in each column: a product of matrices, which is quicker than one of vectors for each sample.
    """
    count = -(-(values.size - taps.size + 1) // every)
    together = -(-taps.size // every)
    step = together * every
    stretches = np.zeros((-(-count // together) + 1, step))
    used = min(values.size, stretches.size)
    stretches.reshape(-1)[:used] = values[:used]
    shifted = np.zeros((2 * step, together))
    for k in range(together):
        shifted[every * k : every * k + taps.size, k] = taps[::-1]
    products = stretches[:-1] @ shifted[:step]
    products += stretches[1:] @ shifted[step:]
    return products.ravel()[:count]


Edges = Literal["trim", "extend"]
ATTENUATION_DB = 100.0
"""Attenuation of the stop band, where nothing else is asked for: below the noise of a recorder of 16 bits, 98 dB."""
DECIMATE_PASS = 0.4
"""Part of the new rate up to which decimation leaves a signal as it is: 2.5 samples a period, as analysers have it
(2.56)."""
DECIMATE_STOP = 0.5
"""Part of the new rate from which nothing is left: half of it, so that nothing is folded back."""
BLOCK = 1 << 16


@functools.lru_cache(maxsize=64)
def kaiser_taps(
    cutoffs: float | tuple[float, float], width: float, rate: float, kind: str, attenuation: float
) -> np.ndarray:
    """Symmetric FIR filter of odd length, read-only: the same array for the same settings.

    Parameters
    ----------
    cutoffs : float or pair
        Middle of the transition band or bands in Hz.
    width : float
        Width of the transition in Hz.
    rate : float
        Sampling rate in Hz.
    kind : {"lowpass", "highpass", "bandpass", "bandstop"}
    attenuation : float
        Stop-band attenuation in dB; the pass-band ripple is 10^(-attenuation/20) as well.

    Returns
    -------
    ndarray of shape (2 h + 1,)

    References
    ----------
    .. [1] J. F. Kaiser, Nonrecursive digital filter design using the I0-sinh window function, ISCAS 1974.
    """
    count, beta = kaiser_order(attenuation, width / (0.5 * rate))
    taps = windowed_sinc(count | 1, cutoffs, kind, rate, beta)
    taps.setflags(write=False)
    return taps


def apply_zero_phase(values: np.ndarray, taps: np.ndarray, edges: Edges, step: int = 1) -> tuple[np.ndarray, int]:
    """Filter along axis 0 without delay and keep every `step`-th sample.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
    taps : ndarray of shape (2 h + 1,), symmetric
    edges : {"trim", "extend"}
        "trim": drop the h samples at either end that reach outside the record.
        "extend": continue the record by point reflection in its end samples; as many samples come out as went in.

    Returns
    -------
    filtered : ndarray of shape (m, channels)
    first : int
        Index in `values` of the first sample that came out.

    Raises
    ------
    SignalError
        If the record is shorter than the filter ("trim") or than half of it ("extend").
    """
    half = taps.size // 2
    n = values.shape[0]
    need = taps.size if edges == "trim" else half + 1
    if edges not in ("trim", "extend"):
        raise SignalError(f"edges: must be 'trim' or 'extend', got {edges!r}")
    if n < need:
        raise SignalError(
            f"signal: has {n} samples, the filter needs at least {need} (edges={edges!r}); "
            "give a longer record or a wider transition band"
        )
    length = n - taps.size + 1 if edges == "trim" else n
    result = np.empty(((length + step - 1) // step, values.shape[1]))
    for channel, column in enumerate(values.T):
        source = np.ascontiguousarray(column, dtype=float)
        if edges == "extend":
            source = np.concatenate(
                (2 * source[0] - source[half:0:-1], source, 2 * source[-1] - source[-2 : -half - 2 : -1])
            )
        result[:, channel] = _valid(source, taps, step)
    return result, half if edges == "trim" else 0


def _valid(source: np.ndarray, taps: np.ndarray, step: int) -> np.ndarray:
    """Every `step`-th fully supported sample of the convolution, in blocks so that scratch memory stays bounded."""
    count = source.size - taps.size + 1
    out = np.empty((count + step - 1) // step)
    block = max(1, BLOCK // step) * step
    for start in range(0, count, block):
        stop = min(start + block, count)
        piece = convolve_valid(source[start : stop + taps.size - 1], taps, step)
        out[start // step : start // step + piece.size] = piece
    return out


@takes_data(low="frequency", high="frequency", transition="frequency")
def bandpass(
    signal: Any,
    low: Given,
    high: Given,
    *,
    transition: Given,
    edges: Edges = "trim",
    attenuation: float = ATTENUATION_DB,
    **_data: Unpack[DataKeywords],
) -> xr.DataArray:
    """Zero-phase band-pass, flat from `low` to `high` and down by `attenuation` beyond the transition bands.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    low, high : float or str
        Pass band in Hz, or as text with a unit.
    transition : float or str
        Width of each transition band, likewise.
    edges : {"trim", "extend"}
        See `apply_zero_phase`.
    attenuation : float
        Stop-band attenuation in dB.

    Returns
    -------
    xarray.DataArray
        Same rate; shorter by the filter's length less one if edges are trimmed.

    Raises
    ------
    SignalError
        If the band does not fit between 0 and half the sampling rate, or the record is too short.
    """
    taps = bandpass_taps(rate_of(signal), float(low), float(high), float(transition), attenuation)
    # A static load can be thousands of times the vibration; taking it out first spares the stop band.
    values, first = apply_zero_phase(signal.values - signal.values.mean(axis=0), taps, edges)
    return like(signal, values, t0=float(signal["time"].values[first]))


@functools.lru_cache(maxsize=64)
def bandpass_taps(rate: float, low: float, high: float, transition: float, attenuation: float) -> np.ndarray:
    """The filter of `bandpass`; SignalError if the band does not fit below half the sampling rate."""
    if not (0.0 < transition and 0.0 < low - transition / 2 and low < high and high + transition / 2 < rate / 2):
        raise SignalError(
            f"band: {low:g} to {high:g} Hz with transitions of {transition:g} Hz must lie between 0 and "
            f"{rate / 2:g} Hz (half the sampling rate)"
        )
    return kaiser_taps((low - transition / 2, high + transition / 2), transition, rate, "bandpass", attenuation)


def filtered_mean_squares(columns: np.ndarray, filters: np.ndarray, count: int) -> np.ndarray:
    """Mean squares of the first `count` fully supported samples of mean-free columns behind filters, block by block.

    Parameters
    ----------
    columns : ndarray, shape (columns, n)
    filters : ndarray, shape (filters, m)
    count : int

    Returns
    -------
    ndarray, shape (filters, columns)
    """
    lap = filters.shape[1] - 1
    total = np.zeros((len(filters), len(columns)))
    for c, column in enumerate(columns):
        mean = column.mean()
        for start in range(0, count, BLOCK):
            stop = min(start + BLOCK, count)
            for k, piece in enumerate(convolutions(column[start : stop + lap] - mean, filters)):
                total[k, c] += np.einsum("n,n->", piece, piece)
    return total / count


@functools.lru_cache(maxsize=64)
def decimation_taps(ratio: int, rate: float, attenuation: float = ATTENUATION_DB) -> np.ndarray:
    """The anti-alias filter of `decimate`: flat to 0.4 of the new rate, down by `attenuation` from 0.5 of it."""
    new_rate = rate / ratio
    middle = 0.5 * (DECIMATE_PASS + DECIMATE_STOP) * new_rate
    return kaiser_taps(middle, (DECIMATE_STOP - DECIMATE_PASS) * new_rate, rate, "lowpass", attenuation)


def decimate(
    signal: xr.DataArray, rate: float, *, edges: Edges = "trim", attenuation: float = ATTENUATION_DB
) -> xr.DataArray:
    """Lower the sampling rate by a whole number, with a zero-phase FIR anti-alias filter.

    The filter is flat to 10^(-attenuation/20) up to 0.4 of the new rate and at least `attenuation` down from half
    the new rate on, so that nothing aliases anywhere in the new band: for 51.2 kHz to 12.8 kHz the pass band ends
    at 5120 Hz and the stop band begins at 6400 Hz.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    rate : float
        New rate in Hz; the old one must be a whole multiple of it.
    edges : {"trim", "extend"}
        "trim" (default) gives only samples whose filter lies inside the record (2.5 ms are lost at either end
        for 51.2 kHz to 12.8 kHz); "extend" keeps the length by point reflection, approximate over that distance.
    attenuation : float
        Stop-band attenuation in dB.

    Returns
    -------
    xarray.DataArray

    Raises
    ------
    SignalError
        If the ratio of the rates is not a whole number or the record is too short.
    """
    old = rate_of(signal)
    new = check_rate(rate)
    ratio = round(old / new)
    if ratio < 1 or abs(old / new - ratio) > 1e-9 * ratio:
        raise SignalError(
            f"rate: {old:g} Hz is not a whole multiple of {new:g} Hz; use resample(signal, rate={new:g}) instead"
        )
    if ratio == 1:
        return signal.copy(deep=False)
    taps = decimation_taps(ratio, old, attenuation)
    values, first = apply_zero_phase(signal.values, taps, edges, step=ratio)
    return like(signal, values, t0=float(signal["time"].values[first]), rate=new)


def resample(signal: xr.DataArray, rate: float, *, attenuation: float = ATTENUATION_DB) -> xr.DataArray:
    """Change the sampling rate by a ratio of whole numbers, with a zero-phase polyphase FIR filter.

    The filter is flat to 0.4 and down from 0.5 of the lower of the two rates. The record is continued by a
    straight line at its ends, so the first and last filter lengths are approximate.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    rate : float
        New rate in Hz.
    attenuation : float
        Stop-band attenuation in dB.

    Raises
    ------
    SignalError
        If no ratio with terms up to 1000 matches the two rates.
    """
    old = rate_of(signal)
    new = check_rate(rate)
    ratio = Fraction(new / old).limit_denominator(1000)
    if ratio.numerator == 0 or ratio.numerator > 1000 or abs(float(ratio) - new / old) > 1e-9 * new / old:
        raise SignalError(
            f"rate: {old:g} Hz to {new:g} Hz is not a ratio of whole numbers up to 1000; pick a nearby rate"
        )
    up, down = ratio.numerator, ratio.denominator
    if up == down:
        return signal.copy(deep=False)
    fine = old * up
    lower = min(old, new)
    taps = kaiser_taps(
        0.5 * (DECIMATE_PASS + DECIMATE_STOP) * lower,
        (DECIMATE_STOP - DECIMATE_PASS) * lower,
        fine,
        "lowpass",
        attenuation,
    )
    from scipy.signal import resample_poly

    columns = [resample_poly(column, up, down, window=taps, padtype="line") for column in signal.values.T]
    count = math.ceil(signal.sizes["time"] * up / down)
    return like(signal, np.stack(columns, axis=1)[:count], rate=new)
