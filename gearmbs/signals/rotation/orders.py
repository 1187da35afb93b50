"""Amplitudes at multiples of a known frequency: the discrete Fourier transform over whole periods."""

from __future__ import annotations

import math

import numpy as np

from gearmbs.signals.errors import SignalError

MIN_PERIODS = 4
BLOCK = 1 << 16


def harmonic_amplitudes(values: np.ndarray, rate: float, fundamental: float, multiples: np.ndarray) -> np.ndarray:
    """Complex amplitudes of `values` at given multiples of `fundamental`.

    The transform runs over the largest whole number P of fundamental periods, N = P rate / fundamental samples (not
    a whole number in general), with the Hann weight w = 1 - cos(2 pi n / N):

        c_k = (2 / sum w) sum_n w_n (x_n - mean) exp(-2 pi i k n fundamental / rate)

    The weight vanishes with its slope at both ends, so the broken last sample costs only O(P^-3), and every other
    multiple falls on a zero of its spectrum: a periodic signal gives its Fourier coefficients.

    Parameters
    ----------
    values : ndarray of shape (n, channels)
    rate : float
        Sampling rate in Hz.
    fundamental : float
        Frequency in Hz.
    multiples : ndarray of shape (m,)
        Multiples of the fundamental (orders); need not be whole. Those at fractions p/q are exact if P covers q.

    Returns
    -------
    ndarray of shape (m, channels), complex
        x(t) contains Re[c_k exp(2 pi i k f t)], t from the first sample; |c_k| is the peak amplitude.

    Raises
    ------
    SignalError
        If the record is shorter than four periods or a multiple lies at or above half the sampling rate.
    """
    multiples = np.atleast_1d(np.asarray(multiples, dtype=float))
    if not (math.isfinite(fundamental) and fundamental > 0.0):
        raise SignalError(f"fundamental: must be a positive frequency in Hz, got {fundamental!r}")
    top = float(multiples.max(initial=0.0)) * fundamental
    if multiples.size == 0 or multiples.min() <= 0.0:
        raise SignalError(f"multiples: must be positive and at least one, got {multiples.tolist()}")
    if top >= rate / 2:
        raise SignalError(
            f"harmonics: {top:g} Hz is not below half the sampling rate ({rate / 2:g} Hz); "
            "ask for fewer or sample faster"
        )
    periods = math.floor(values.shape[0] * fundamental / rate + 1e-9)
    if periods < MIN_PERIODS:
        raise SignalError(
            f"signal: holds {values.shape[0] * fundamental / rate:.2f} periods of {fundamental:g} Hz, "
            f"at least {MIN_PERIODS} are needed; give a longer record"
        )
    span = periods * rate / fundamental
    count = min(values.shape[0], math.ceil(span - 1e-9))
    weight_sum = 0.0
    mean_sum = np.zeros(values.shape[1])
    raw = np.zeros((multiples.size, values.shape[1]), dtype=complex)
    leak = np.zeros(multiples.size, dtype=complex)
    for start in range(0, count, BLOCK):
        n = np.arange(start, min(start + BLOCK, count))
        weight = 1.0 - np.cos((2.0 * np.pi / span) * n)
        block = values[n[0] : n[-1] + 1]
        weight_sum += weight.sum()
        mean_sum += weight @ block
        for i, k in enumerate(multiples):
            turn = weight * np.exp((-2j * np.pi * k * fundamental / rate) * n)
            raw[i] += turn @ block
            leak[i] += turn.sum()
    return (2.0 / weight_sum) * (raw - np.outer(leak, mean_sum / weight_sum))
