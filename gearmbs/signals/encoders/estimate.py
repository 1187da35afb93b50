"""What lines of several runs say of transmission error and marks, with what they leave open.

At one order all is linear and Gaussian. Run r of load s measures

    y_r = a_r T_s - E_1 + i E_2 b_r + noise,

with T_s the transmission error of the load, E_1 and E_2 the lines of the marks, a_r and b_r the phases by which discs
and wheels stand to each other, and i the ratio; a shaft that runs free measures -E alone. Marks are known beforehand
to within their level, transmission errors not at all. So one run gives T with the marks' level as its uncertainty, and
each run that differs takes from it what it can.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy import optimize, stats

NOISELESS = 1e-18
"""Least variance of a line, rad^2: a nanoradian, below which no encoder measures. Runs of a simulation have none."""
CLEAR = 30.0
"""Amplitudes of so many standard deviations have intervals like those of a real number, to one part in 2000."""


class Row(NamedTuple):
    """One measured line: its value, its variance (of each part), and the factors of what it consists of, by name."""

    value: complex
    variance: float
    factors: Mapping[str, complex]


class Found(NamedTuple):
    """Estimates by name, and the covariance of their real parts, which is that of the imaginary ones."""

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray

    def of(self, factors: Mapping[str, complex]) -> tuple[complex, float]:
        """Return a combination of the estimates and its variance."""
        c = np.array([factors.get(name, 0.0) for name in self.names], dtype=complex)
        return complex(c @ self.values), float(np.real(c @ self.covariance @ c.conj()))


def estimate(rows: Sequence[Row], levels: Mapping[str, float]) -> Found:
    """Solve for what the rows consist of, by least squares with what is known beforehand.

    Parameters
    ----------
    rows : sequence of Row
    levels : mapping of str to float
        Variances known beforehand of those that have one, the marks; all others are open.
    """
    names = tuple(dict.fromkeys(name for row in rows for name in row.factors))
    a = np.array([[row.factors.get(name, 0.0) for name in names] for row in rows], dtype=complex)
    weight = np.array([1.0 / (row.variance + NOISELESS) for row in rows])
    known = np.array([1.0 / (levels[name] + NOISELESS) if name in levels else 0.0 for name in names])
    normal = (a.conj().T * weight) @ a + np.diag(known)
    covariance = np.linalg.inv(normal)
    values = covariance @ ((a.conj().T * weight) @ np.array([row.value for row in rows]))
    return Found(names, values, covariance)


def amplitude_interval(size: float, variance: float, freedom: float, probability: float) -> tuple[float, float]:
    """Return the interval of an amplitude whose line was measured with a variance (of each part) of some freedom.

    The square of the line over twice the variance is of the noncentral F distribution with 2 and `freedom` degrees,
    whose noncentrality is the true one: the ends are those that make the measured one as rare as half of what is left.
    At amplitudes of nothing this covers zero, where an interval of the measured amplitude plus and minus would not.
    """
    sd = math.sqrt(variance)
    if sd == 0.0:
        return size, size
    tail = 0.5 * (1.0 - probability)
    reach = float(stats.t.ppf(1.0 - tail, freedom))
    x = size / sd
    if x > CLEAR:
        return size - reach * sd, size + reach * sd

    def beyond(true: float, target: float) -> float:
        square = true * true
        if math.isinf(freedom):
            return float(stats.ncx2.cdf(x * x, 2, square) if true else stats.chi2.cdf(x * x, 2)) - target
        half = 0.5 * x * x
        return float(stats.ncf.cdf(half, 2, freedom, square) if true else stats.f.cdf(half, 2, freedom)) - target

    ends = []
    for target in (1.0 - tail, tail):
        far = x + 4.0 * reach
        low_enough = beyond(0.0, target) <= 0.0
        ends.append(0.0 if low_enough else sd * optimize.brentq(beyond, 0.0, far, args=(target,), xtol=1e-6))
    # of a line weaker than noise would be in all but few records the upper end is zero: it holds the measured one still
    return ends[0], max(ends[1], size)
