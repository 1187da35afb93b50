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
from scipy import optimize, special

NOISELESS = 1e-18
"""Least variance of a line, rad^2: a nanoradian, below which no encoder measures. Runs of a simulation have none."""
CLEAR = 30.0
"""Amplitudes of so many standard deviations have intervals like those of a real number, to one part in 2000."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(40)
VARIANCES, VARIANCE_WEIGHTS = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS
"""Probabilities of variances, and their weights: with 40 the ends of 95 % are good to a thousandth from 4 degrees."""


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


MEDIAN = math.sqrt(2.0 * math.log(2.0))
"""Median amplitude of a line of noise alone, in standard deviations of each part: that of Rayleigh's distribution.
Upper ends that are not let below its own are the power-constrained limits of [1]_.

.. [1] G. Cowan, K. Cranmer, E. Gross, O. Vitells, "Power-Constrained Limits", arXiv:1105.3166, 2011.
"""


def amplitude_interval(size: float, variance: float, freedom: float, probability: float) -> tuple[float, float]:
    """Return the interval of an amplitude whose line was measured with a variance (of each part) of some freedom.

    The true one and the measured variance make the square of the line one of noncentral chi-square; the mean of its
    distributions over all variances that the measured one allows, which are as the freedom over chi-square of it, is
    an F distribution at amplitude zero, and Student's t at large ones. The ends are the amplitudes that make the
    measured line as rare as half of what is left. At amplitudes of nothing this covers zero, where an interval of the
    measured amplitude plus and minus would not.
    """
    sd = math.sqrt(variance)
    if sd == 0.0:
        return size, size
    tail = 0.5 * (1.0 - probability)
    reach = float(special.stdtrit(freedom, 1.0 - tail))
    x = size / sd
    if x > CLEAR:
        return size - reach * sd, size + reach * sd

    # what the variance may be by the measured one, each as likely as its weight
    by = np.ones(1) if math.isinf(freedom) else 0.5 * freedom / special.gammaincinv(0.5 * freedom, VARIANCES)
    weights = np.ones(1) if math.isinf(freedom) else VARIANCE_WEIGHTS

    def beyond(true: float, target: float, measured: float) -> float:
        return float(weights @ special.chndtr(measured**2 / by, 2.0, true * true / by)) - target

    ends = []
    # of a line weaker than noise is in most records the upper end would fall to nothing by luck of the noise: it is
    # that of the median of what noise alone gives at least
    for target, measured in ((1.0 - tail, x), (tail, max(x, MEDIAN))):
        far = measured + 4.0 * reach
        low_enough = beyond(0.0, target, measured) <= 0.0
        end = 0.0 if low_enough else sd * optimize.brentq(beyond, 0.0, far, args=(target, measured), xtol=1e-6)
        ends.append(end)
    return ends[0], max(ends[1], size)
