"""Hertz constants of balls on grooves and of rollers on rings.

For a ball of diameter d on a groove of radius f d the sum of curvatures and their difference are, with
g = d cos(a)/D and the upper sign for the inner ring,

    sum rho = (4 - 1/f + 2 s)/d,    F(rho) = (1/f + 2 s)/(4 - 1/f + 2 s),    s = g/(1 - g) or -g/(1 + g).

The ellipticity k = a/b solves F(rho) = ((k^2 + 1) E - 2 K)/((k^2 - 1) E) with the complete elliptic integrals K and E
of m = 1 - 1/k^2; then delta* = (2 K/pi) (pi/(2 k^2 E))^(1/3) and

    Q = K_c delta^(3/2),    K_c = E_y 2^(3/2)/(3 (1 - nu^2)) (sum rho)^(-1/2) delta*^(-3/2).

References
----------
.. [1] T. A. Harris, M. N. Kotzalas, Essential Concepts of Bearing Technology, 5th ed. (2007), chapter 6.
.. [2] A. Palmgren, Ball and Roller Bearing Engineering, 3rd ed. (1959): line contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

BALL_EXPONENT = 1.5
ROLLER_EXPONENT = 10.0 / 9.0
PALMGREN = 3.84e-5
"""mm of approach per contact for Q = 1 N on a line of 1 mm: delta = 3.84e-5 Q^0.9/L^0.8, mm and N, steel."""


@dataclass(frozen=True)
class PointContact:
    """A ball on a groove.

    Attributes
    ----------
    stiffness : float
        K_c of Q = K_c delta^1.5, N/m^1.5.
    ellipticity : float
        a/b, major by minor half axis.
    approach : float
        delta*, dimensionless.
    curvature_sum, curvature_difference : float
        sum rho (1/m) and F(rho).
    semi_axes : tuple of float
        a and b at Q = 1 N, m; they grow with Q^(1/3).
    """

    stiffness: float
    ellipticity: float
    approach: float
    curvature_sum: float
    curvature_difference: float
    semi_axes: tuple[float, float]

    def pressure(self, force: float) -> float:
        """Return the largest pressure at a normal force in N, Pa."""
        a, b = self.semi_axes
        return 1.5 * force ** (1.0 / 3.0) / (math.pi * a * b)

    def force_at(self, pressure: float) -> float:
        """Return the normal force at which the largest pressure is this, N."""
        a, b = self.semi_axes
        return (pressure * math.pi * a * b / 1.5) ** 3


def groove_contact(
    diameter: float, curvature: float, slope: float, youngs_modulus: float = 2.07e11, poisson_ratio: float = 0.3
) -> PointContact:
    """Return the contact of a ball with a groove.

    Parameters
    ----------
    diameter : float
        Of the ball, m.
    curvature : float
        Groove radius by ball diameter, f.
    slope : float
        s: ``g/(1 - g)`` for the inner, ``-g/(1 + g)`` for the outer ring, with g = d cos(a)/D.
    youngs_modulus, poisson_ratio : float
        Of ball and ring, Pa.
    """
    from scipy.optimize import brentq

    total = (4.0 - 1.0 / curvature + 2.0 * slope) / diameter
    difference = (1.0 / curvature + 2.0 * slope) / (4.0 - 1.0 / curvature + 2.0 * slope)

    def mismatch(log_ratio: float) -> float:
        return _difference(math.exp(log_ratio)) - difference

    ratio = math.exp(brentq(mismatch, 1e-6, math.log(1e4), xtol=1e-14, rtol=1e-14))
    first, second = _integrals(ratio)
    approach = 2.0 * first / math.pi * (math.pi / (2.0 * ratio**2 * second)) ** (1.0 / 3.0)
    modulus = youngs_modulus / (1.0 - poisson_ratio**2)
    stiffness = modulus * 2.0**1.5 / 3.0 / math.sqrt(total) / approach**1.5
    size = (3.0 / (total * modulus)) ** (1.0 / 3.0)
    major = (2.0 * ratio**2 * second / math.pi) ** (1.0 / 3.0) * size
    return PointContact(stiffness, ratio, approach, total, difference, (major, major / ratio))


def _integrals(ratio: float) -> tuple[float, float]:
    from scipy.special import ellipe, ellipk

    m = 1.0 - 1.0 / ratio**2
    return float(ellipk(m)), float(ellipe(m))


def _difference(ratio: float) -> float:
    first, second = _integrals(ratio)
    square = ratio**2
    return ((square + 1.0) * second - 2.0 * first) / ((square - 1.0) * second)


def in_series(first: float, second: float, exponent: float) -> float:
    """Return K of two contacts one behind the other, (K_1^(-1/n) + K_2^(-1/n))^(-n)."""
    power = -1.0 / exponent
    return float((first**power + second**power) ** -exponent)


def line_contact(length: float) -> float:
    """Return K of Q = K delta^(10/9) for one contact of a steel roller by Palmgren, N/m^(10/9).

    Parameters
    ----------
    length : float
        Effective length, m.
    """
    # delta [m] = 1e-3 * 3.84e-5 Q^0.9 / (1e3 L)^0.8
    return float((1e3 * (1e3 * length) ** 0.8 / PALMGREN) ** ROLLER_EXPONENT)
