"""How near a curve over a mesh cycle is to the true one: noise of its lines, and what harmonics beyond would add.

The sum of harmonics 1 to n, of which each has noise of the variance v_h in each part, has noise of the variance
sum(v_h) everywhere. How often it rises above u of its standard deviations in a cycle follows from its bandwidth
(Rice), f = sqrt(sum(h^2 v_h)/sum(v_h)): f exp(-u^2/2) times, and as often it falls below -u.

A curve with corners, as of pairs of teeth that come and go, has lines that fall as a/h^2. At a corner all beyond n add
up, to a/n at most; so do those that no encoder of its lines shows.
"""

from __future__ import annotations

import math

import numpy as np

POINTS = 16
"""Half the points of a cycle for the lowest harmonic of an octave: its highest has 16 of its own."""
CLEAR, SURE = 2.0, 0.95
"""Heights of noise from which an octave stands clear of it: then noise is no more than half of what is seen."""


def noise_within(numbers: np.ndarray, variances: np.ndarray, probability: float) -> float:
    """Return below what the noise of a sum of harmonics stays all over a cycle, in their unit.

    Parameters
    ----------
    numbers, variances : ndarray of shape (n,)
        Of the harmonics; the variances of each part.
    probability : float

    Examples
    --------
    >>> numbers = np.arange(1, 65)
    >>> round(noise_within(numbers, np.full(64, 1.0), 0.95), 1)
    30.6
    """
    total = float(variances.sum())
    if total <= 0.0:
        return 0.0
    often = 2.0 * math.sqrt(float(numbers.astype(float) ** 2 @ variances) / total)
    return math.sqrt(2.0 * math.log(often / (1.0 - probability)) * total)


def fall(numbers: np.ndarray, values: np.ndarray, variances: np.ndarray) -> float:
    """Return a of lines that fall as a/h^2 and add up at a corner: by the highest octave that stands clear of noise.

    Its harmonics n + 1 to 2 n come to a/(2 n) there. It is an estimate: lines of a ramp vanish where it is as long as
    they are, and if that is in this octave a is up to five times too small (trapezoids of 0.1 and 0.2 of a cycle); the
    largest of three octaves would hold there, and be twice too large for rounded corners, as the paper's pair has.

    Parameters
    ----------
    numbers, values, variances : ndarray of shape (n,)
        Of the harmonics, their complex amplitudes, and the variances of each part.
    """
    found, n = 0.0, 1
    while n < numbers[-1]:
        octave = (numbers > n) & (numbers <= 2 * n)
        if octave.any():
            lines = np.zeros(POINTS * n + 1, dtype=complex)
            lines[numbers[octave]] = POINTS * n * values[octave]
            height = float(np.abs(np.fft.irfft(lines)).max())
            if found and height < CLEAR * noise_within(numbers[octave], variances[octave], SURE):
                break
            found = 2.0 * n * height
        n *= 2
    return found


def missing_beyond(a: float, highest: int, unseen: np.ndarray) -> float:
    """Return what harmonics above the highest, and unseen ones below it, add up to at most where all fall as a/h^2."""
    below = unseen[unseen <= highest].astype(float)
    return a * (1.0 / max(highest, 1) + float(np.sum(below**-2.0)))
