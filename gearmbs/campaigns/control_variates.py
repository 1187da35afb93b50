"""Sobol' indices of a Saltelli design, their noise lowered by a surrogate that is exact where it need not be right.

The result is f = g + r, g a polynomial chaos. The indices of g are known from its coefficients; only how f's estimator
differs from g's on the same points is left to chance. Each base point is judged by a polynomial fitted to the others,
so that the estimate stays unbiased however bad the polynomial is: a bad one saves nothing.

References
----------
.. [1] E. Qian et al., Multifidelity Monte Carlo estimation of variance and sensitivity indices, SIAM/ASA J. Uncertain.
   Quantif. 6 (2018) 683.
.. [2] B. L. Nelson, Control variate remedies, Oper. Res. 38 (1990) 974.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.campaigns.chaos import best_chaos, chaos_columns, chaos_indices

FOLDS = 5
TOGETHER = 3
"""Most factors in a term of the polynomial."""

MOST_TERMS, MOST_POINTS = 500, 20_000
"""Of a fit, so that it stays below some hundred megabytes however large the design is."""


@dataclass(frozen=True)
class ControlledBlocks:
    """What each base point says of the indices, and what its control variates say, whose mean is zero.

    Attributes
    ----------
    plain, control : ndarray, shape (n, 2 d + 1)
        Of the d first indices' numerators, of the d total ones' and of the variance.
    explained : float
        Part of the variance that the polynomials explain at base points they were not fitted to.
    """

    plain: np.ndarray
    control: np.ndarray
    explained: float

    def indices(self, rows: np.ndarray | slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Return first and total indices, shape (d,) each, from these base points."""
        plain, control = self.plain[rows], self.control[rows]
        away = control - control.mean(axis=0)
        spread = (away**2).mean(axis=0)
        slope = np.divide((away * plain).mean(axis=0), spread, out=np.zeros_like(spread), where=spread > 0.0)
        found = plain.mean(axis=0) - slope * control.mean(axis=0)
        d = (found.size - 1) // 2
        return found[:d] / found[-1], found[d:-1] / found[-1]


def control_variates(
    blocks: np.ndarray, points: np.ndarray, levels: Sequence[int], *, seed: int = 0
) -> ControlledBlocks | None:
    """Return the base points' parts of the indices with their control variates.

    Parameters
    ----------
    blocks : ndarray, shape (n, d + 2)
        Results at A, AB_1 ... AB_d, B of each base point, standardised.
    points : ndarray, shape (n, d + 2, d)
        Where in the unit cube.
    levels : sequence of int, shape (d,)
        Number of values of each coordinate that has but a few, 0 for a range.
    seed : int
        Of the folds.

    Returns
    -------
    ControlledBlocks or None
        None if there are too few base points to fit a polynomial to a part of them.
    """
    n, d = points.shape[0], points.shape[2]
    fold = np.random.default_rng(seed).permutation(n) % FOLDS
    surrogate = np.empty_like(blocks)
    known = np.empty((n, 2 * d + 1))
    centre = np.empty(n)
    for k in range(FOLDS):
        mine, others = fold == k, fold != k
        if not mine.any() or (d + 2) * int(others.sum()) < 4 * (d + 1):
            return None
        some = np.flatnonzero(others)[: max(1, MOST_POINTS // (d + 2))]
        u, y = points[some].reshape(-1, d), blocks[some].ravel()
        fitted = best_chaos(u, y, levels, together=min(d, TOGETHER), most=MOST_TERMS)
        degrees, weights = fitted.degrees, fitted.coefficients
        values = chaos_columns(points[mine].reshape(-1, d), degrees, levels) @ weights
        surrogate[mine] = values.reshape(-1, d + 2)
        variance = float((weights[1:] ** 2).sum())
        known[mine] = np.r_[(chaos_indices(degrees, weights) * variance).ravel(), variance] if variance else 0.0
        centre[mine] = weights[0]
    ends = [0, -1]
    rest = blocks[:, ends] - surrogate[:, ends]
    explained = 1.0 - float((rest**2).mean() / blocks[:, ends].var())
    plain = _parts(blocks, np.full(n, blocks[:, ends].mean()))
    return ControlledBlocks(plain, _parts(surrogate, centre) - known, explained)


def _parts(blocks: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return of each base point its numerators of the indices and its variance, shape (n, 2 d + 1)."""
    away = blocks - centre[:, None]
    a, b, mixed = away[:, :1], away[:, -1:], away[:, 1:-1]
    return np.hstack([b * (mixed - a), 0.5 * (a - mixed) ** 2, 0.5 * (a**2 + b**2)])
