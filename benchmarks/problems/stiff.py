"""Stiff standard problems from chemistry and electronics, as residuals for `solve_dae`, with published end values.

References
----------
.. [1] F. Mazzia, C. Magherini, "Test Set for Initial Value Problem Solvers", release 2.4, University of Bari (2008).
.. [2] E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", Springer (1996).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True)
class StiffProblem:
    """A problem with its span, start, natural tolerances and reference.

    Attributes
    ----------
    name : str
    fun : callable
        ``fun(t, y, yp, out)``, compiled by numba.
    t_end : float
        The start is at zero.
    y0 : ndarray
    atol : ndarray
        Absolute tolerances for a relative one of one: they scale with it.
    reference : ndarray
        y at ``t_end``; NaN where none is published.
    """

    name: str
    fun: Callable
    t_end: float
    y0: np.ndarray
    atol: np.ndarray
    reference: np.ndarray

    def error(self, y: np.ndarray) -> float:
        """Return the largest relative error at the end."""
        return float(np.nanmax(np.abs(y / self.reference - 1.0)))


@njit(cache=True)
def _robertson(t, y, yp, out):
    """Autocatalytic reaction of three species, the third from the balance of mass: index one.

    The two fast reactions balance each other: what they leave, at the end some 1e-10 of each, is formed once for both.
    """
    net = 0.04 * y[0] - 1e4 * y[1] * y[2]
    out[0] = yp[0] + net
    out[1] = yp[1] - net + 3e7 * y[1] ** 2
    out[2] = y[0] + y[1] + y[2] - 1.0


@njit(cache=True)
def _hires(t, y, yp, out):
    """High irradiance responses of photomorphogenesis: eight species, an ODE written implicitly."""
    bind = 280.0 * y[5] * y[7]
    out[0] = yp[0] + 1.71 * y[0] - 0.43 * y[1] - 8.32 * y[2] - 0.0007
    out[1] = yp[1] - 1.71 * y[0] + 8.75 * y[1]
    out[2] = yp[2] + 10.03 * y[2] - 0.43 * y[3] - 0.035 * y[4]
    out[3] = yp[3] - 8.32 * y[1] - 1.71 * y[2] + 1.12 * y[3]
    out[4] = yp[4] + 1.745 * y[4] - 0.43 * y[5] - 0.43 * y[6]
    out[5] = yp[5] + bind - 0.69 * y[3] - 1.71 * y[4] + 0.43 * y[5] - 0.69 * y[6]
    out[6] = yp[6] - bind + 1.81 * y[6]
    out[7] = yp[7] + bind - 1.81 * y[6]


@njit(cache=True)
def _chemical_akzo_nobel(t, y, yp, out):
    """Five reactions of six species, carbon dioxide let in, the sixth species in equilibrium: index one."""
    r1 = 18.7 * y[0] ** 4 * np.sqrt(y[1])
    r2 = 0.58 * y[2] * y[3]
    r3 = 0.58 / 34.4 * y[0] * y[4]
    r4 = 0.09 * y[0] * y[3] ** 2
    r5 = 0.42 * y[5] ** 2 * np.sqrt(y[1])
    inflow = 3.3 * (0.9 / 737.0 - y[1])
    out[0] = yp[0] + 2.0 * r1 - r2 + r3 + r4
    out[1] = yp[1] + 0.5 * r1 + r4 + 0.5 * r5 - inflow
    out[2] = yp[2] - r1 + r2 - r3
    out[3] = yp[3] + r2 - r3 + 2.0 * r4
    out[4] = yp[4] - r2 + r3 - r5
    out[5] = 115.83 * y[0] * y[3] - y[5]


@njit(cache=True)
def _van_der_pol(t, y, yp, out):
    """Relaxation oscillation with a parameter of 1e6: slow arcs and jumps within 1e-6 of the time."""
    out[0] = yp[0] - y[1]
    out[1] = 1e-6 * yp[1] - (1.0 - y[0] * y[0]) * y[1] + y[0]


@njit(cache=True)
def _transistor_amplifier(t, y, yp, out):
    """Two stages, eight node voltages; capacitors between nodes leave a mass matrix of rank five: index one."""
    ub, r = 6.0, 9000.0
    first = 1e-6 * (np.exp((y[1] - y[2]) / 0.026) - 1.0)
    second = 1e-6 * (np.exp((y[4] - y[5]) / 0.026) - 1.0)
    c1 = 1e-6 * (yp[1] - yp[0])
    c3 = 3e-6 * (yp[4] - yp[3])
    c5 = 5e-6 * (yp[7] - yp[6])
    out[0] = c1 - (y[0] - 0.1 * np.sin(200.0 * np.pi * t)) / 1000.0
    out[1] = -c1 - y[1] / r - (y[1] - ub) / r - 0.01 * first
    out[2] = -2e-6 * yp[2] - y[2] / r + first
    out[3] = c3 - (y[3] - ub) / r - 0.99 * first
    out[4] = -c3 - y[4] / r - (y[4] - ub) / r - 0.01 * second
    out[5] = -4e-6 * yp[5] - y[5] / r + second
    out[6] = c5 - (y[6] - ub) / r - 0.99 * second
    out[7] = -c5 - y[7] / r


def robertson() -> StiffProblem:
    """Return Robertson's reaction over eleven decades of time [1]_."""
    return StiffProblem(
        "Robertson",
        _robertson,
        1e11,
        np.array([1.0, 0.0, 0.0]),
        np.array([1e-8, 1e-12, 1e-4]),
        np.array([0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050]),
    )


def hires() -> StiffProblem:
    """Return HIRES [1]_."""
    return StiffProblem(
        "HIRES",
        _hires,
        321.8122,
        np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057]),
        np.full(8, 1e-4),
        np.array(
            [
                0.7371312573325668e-3,
                0.1442485726316185e-3,
                0.5888729740967575e-4,
                0.1175651343283149e-2,
                0.2386356198831331e-2,
                0.6238968252742796e-2,
                0.2849998395185769e-2,
                0.2850001604814231e-2,
            ]
        ),
    )


def chemical_akzo_nobel() -> StiffProblem:
    """Return the chemical Akzo Nobel problem [1]_."""
    start = np.array([0.444, 0.00123, 0.0, 0.007, 0.0, 115.83 * 0.444 * 0.007])
    end = [
        0.1150794920661702,
        0.1203831471567715e-2,
        0.1611562887407974,
        0.3656156421249283e-3,
        0.1708010885264404e-1,
        0.4873531310307455e-2,
    ]
    return StiffProblem("chemical Akzo Nobel", _chemical_akzo_nobel, 180.0, start, np.full(6, 1e-3), np.array(end))


def van_der_pol() -> StiffProblem:
    """Return van der Pol's oscillator over one period of 1.6 and a little more [1]_."""
    end = np.array([0.1706167732170483e1, -0.8928097010247975])
    return StiffProblem("van der Pol", _van_der_pol, 2.0, np.array([2.0, 0.0]), np.ones(2), end)


def transistor_amplifier() -> StiffProblem:
    """Return the transistor amplifier [1]_, whose fifth voltage is 3 and its start consistent."""
    end = [
        -0.5562145012262709e-2,
        0.3006522471903042e1,
        0.2849958788608128e1,
        0.2926422536206241e1,
        0.2704617865010554e1,
        0.2761837778393145e1,
        0.4770927631616772e1,
        0.1236995868091548e1,
    ]
    start = np.array([0.0, 3.0, 3.0, 6.0, 3.0, 3.0, 6.0, 0.0])
    return StiffProblem("transistor amplifier", _transistor_amplifier, 0.2, start, np.ones(8), np.array(end))


def stiff_problems() -> list[StiffProblem]:
    """Return all problems of this module."""
    return [robertson(), hires(), chemical_akzo_nobel(), van_der_pol(), transistor_amplifier()]
