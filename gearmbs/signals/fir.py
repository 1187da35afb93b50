"""Symmetric FIR filters by Kaiser's window, and their convolution with long records.

As in `scipy.signal`, whose import takes longer than many a simulation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np


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
    lap = taps.size - 1
    count = values.size - lap
    if every > 1:
        return _each_of_several(values, taps, every)
    # about where the transforms cost least a sample
    size = 1 << (min(8 * taps.size, values.size) - 1).bit_length()
    step = size - lap
    pieces = -(-count // step)
    padded = np.zeros((pieces - 1) * step + size)
    padded[: values.size] = values
    rows = np.lib.stride_tricks.sliding_window_view(padded, size)[::step]
    # the first supported sample comes first
    shifted = np.roll(np.pad(taps, (0, size - taps.size)), -lap)
    spectrum = np.fft.rfft(rows, axis=1) * np.fft.rfft(shifted)
    return np.fft.irfft(spectrum, size, axis=1)[:, :step].ravel()[:count]


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
