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
    """Autocatalytic reaction of three species, the third from the balance of mass: index one."""
    out[0] = yp[0] + 0.04 * y[0] - 1e4 * y[1] * y[2]
    out[1] = yp[1] - 0.04 * y[0] + 1e4 * y[1] * y[2] + 3e7 * y[1] ** 2
    out[2] = y[0] + y[1] + y[2] - 1.0


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
