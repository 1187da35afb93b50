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

FIRST = 4
"""Harmonic from which lines are taken to fall as those of corners: the first ones are of the curve's large shape."""
ROUNDS = 50
"""Of weights from the last result: far more than it takes to stand still to a hundredth."""


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


def fall(numbers: np.ndarray, sizes: np.ndarray, variances: np.ndarray) -> float:
    """Return a of lines that fall as a/h^2: the mean of their powers less noise, each by how well it is known.

    Parameters
    ----------
    numbers, sizes, variances : ndarray of shape (n,)
        Of the harmonics, their amplitudes, and the variances of each part.
    """
    far = numbers >= FIRST
    h, power, v = numbers[far].astype(float), sizes[far] ** 2, np.maximum(variances[far], 1e-40)
    if not h.size:
        return 0.0
    level = h**-4
    square = float(np.max(power / level))
    for _ in range(ROUNDS):
        # the power of a line varies by as much as it is, as corners beat, and by its noise
        weight = level / (square * level + 2.0 * v) ** 2
        square = max(float(weight @ (power - 2.0 * v)) / float(weight @ level), 0.0)
    return math.sqrt(square)


def missing_beyond(a: float, highest: int, unseen: np.ndarray) -> float:
    """Return what harmonics above the highest, and unseen ones below it, add up to at most where all fall as a/h^2."""
    below = unseen[unseen <= highest].astype(float)
    return a * (1.0 / max(highest, 1) + float(np.sum(below**-2.0)))
