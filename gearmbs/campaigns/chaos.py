"""A result as a sum of orthonormal polynomials of the factors, from any sample: a surrogate whose coefficients are the
Sobol' indices.

References
----------
.. [1] B. Sudret, Global sensitivity analysis using polynomial chaos expansions, Reliab. Eng. Syst. Saf. 93 (2008) 964.
.. [2] G. Blatman, B. Sudret, Adaptive sparse polynomial chaos expansion based on least angle regression, J. Comput.
   Phys. 230 (2011) 2345.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.errors import CampaignError

if TYPE_CHECKING:
    import pandas as pd


HIGHEST = 6
POINTS_A_TERM = 2.0
"""Points for each coefficient at least: with fewer the errors at points left out say little."""

RESAMPLES = 100


@dataclass(frozen=True)
class PolynomialChaos:
    """A sum of products of orthonormal polynomials, at most some factors in each.

    Attributes
    ----------
    names : list of str
        The d factors' coordinates.
    levels : tuple of int
        Number of values of each that has but a few, 0 for a range.
    degrees : ndarray of int, shape (t, d)
        Degree of each factor in each term; the first term is the constant.
    coefficients : ndarray, shape (t,)
    r_squared, q_squared : float
        Part of the variance it explains, of its points and of each point by the sum fitted to all others.
    confidence : ndarray, shape (2, d)
        Half widths of the 95 % intervals of first and total indices, by resampling of the points.
    count : int
        Points.
    """

    names: list[str]
    levels: tuple[int, ...]
    degrees: np.ndarray
    coefficients: np.ndarray
    r_squared: float
    q_squared: float
    confidence: np.ndarray
    count: int

    def predict(self, u: np.ndarray) -> np.ndarray:
        """Return the sum at points of the unit cube, shape (n, d)."""
        return chaos_columns(np.atleast_2d(u), self.degrees, self.levels) @ self.coefficients

    @property
    def indices(self) -> np.ndarray:
        """First and total Sobol' indices, shape (2, d)."""
        return chaos_indices(self.degrees, self.coefficients)

    def interaction(self, one: str, other: str) -> float:
        """Return the part of the variance that two factors explain together beyond each alone."""
        pair = [self.names.index(one), self.names.index(other)]
        active = self.degrees > 0
        both = active[:, pair].all(axis=1) & (active.sum(axis=1) == 2)
        return float((self.coefficients[both] ** 2).sum() / (self.coefficients[1:] ** 2).sum())

    def table(self) -> pd.DataFrame:
        """Return first and total indices with their confidence by factor, the most important first."""
        import pandas as pd

        first, total = self.indices
        data = {"first": first, "first_confidence": self.confidence[0]}
        data |= {"total": total, "total_confidence": self.confidence[1]}
        return pd.DataFrame(data, index=pd.Index(self.names, name="factor")).sort_values("total", ascending=False)


def fit_chaos(
    u: np.ndarray,
    values: Sequence[float] | np.ndarray,
    names: list[str],
    *,
    levels: Sequence[int] | None = None,
    degree: int | None = None,
    together: int = 2,
    seed: int = 0,
) -> PolynomialChaos:
    """Fit a polynomial chaos by least squares.

    Parameters
    ----------
    u : ndarray, shape (n, d)
        Points in the unit cube, evenly spread.
    values : array_like, shape (n,)
        NaN are left out.
    names : list of str
    levels : sequence of int, optional
        Number of values of each coordinate that has but a few, 0 for a range.
    degree : int, optional
        Highest sum of degrees in a term; default the one of the least errors at points left out.
    together : int
        Most factors in a term.
    seed : int
        Of the resampling.

    Raises
    ------
    CampaignError
        If there are too few points, or the result is the same everywhere.

    Examples
    --------
    >>> u = np.random.default_rng(0).random((200, 2))
    >>> found = fit_chaos(u, u[:, 0] + 0.5 * u[:, 1], ["a", "b"])
    >>> found.indices.round(3).tolist()
    [[0.8, 0.2], [0.8, 0.2]]
    """
    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    u, y = np.asarray(u, dtype=float)[good], y[good]
    few = tuple(levels or [0] * len(names))
    if y.size < 2 or np.ptp(y) == 0.0:
        raise CampaignError("polynomial chaos: the result is the same everywhere; it depends on none of the factors")
    best = best_chaos(u, y, few, degree=degree, together=together)
    x = chaos_columns(u, best.degrees, few)
    generator, drawn = np.random.default_rng(seed), []
    for _ in range(RESAMPLES):
        # weights of a Bayesian bootstrap, under which no coefficient is left undetermined
        weight = np.sqrt(generator.exponential(size=y.size))
        drawn.append(chaos_indices(best.degrees, np.linalg.lstsq(x * weight[:, None], y * weight, rcond=None)[0]))
    confidence = 1.96 * np.std(drawn, axis=0, ddof=1)
    return PolynomialChaos(
        list(names), few, best.degrees, best.coefficients, best.r_squared, best.q_squared, confidence, y.size
    )


@dataclass(frozen=True)
class Fitted:
    """Terms and coefficients of a sum, and what it explains; see `PolynomialChaos`."""

    degrees: np.ndarray
    coefficients: np.ndarray
    r_squared: float
    q_squared: float


def best_chaos(
    u: np.ndarray,
    y: np.ndarray,
    levels: Sequence[int],
    *,
    degree: int | None = None,
    together: int = 2,
    most: float = np.inf,
) -> Fitted:
    """Return the sum of the least errors at points left out; see `fit_chaos`, without confidence.

    Of degrees that are not given only those with at most ``most`` terms are tried, the lowest in any case.
    """
    best: Fitted | None = None
    for highest in range(1, HIGHEST + 1) if degree is None else (degree,):
        degrees = _terms(levels, highest, together)
        if best is not None and (POINTS_A_TERM * len(degrees) > y.size or len(degrees) > most):
            break
        if len(degrees) >= y.size:
            raise CampaignError(f"polynomial chaos: {y.size} points for {len(degrees)} coefficients; draw more points")
        found = Fitted(degrees, *_least_squares(chaos_columns(u, degrees, levels), y))
        if best is None or found.q_squared > best.q_squared:
            best = found
    assert best is not None
    return best


def _least_squares(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return coefficients, R^2 and the same of points left out."""
    q, r = np.linalg.qr(x)
    coefficients = np.linalg.solve(r, q.T @ y)
    rest = y - x @ coefficients
    leverage = np.minimum((q**2).sum(axis=1), 1.0 - 1e-12)
    spread = float(((y - y.mean()) ** 2).sum())
    out = rest / (1.0 - leverage)
    return coefficients, 1.0 - float(rest @ rest) / spread, 1.0 - float(out @ out) / spread


def chaos_indices(degrees: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Return first and total indices of a sum, shape (2, d)."""
    active = degrees > 0
    part = coefficients**2
    whole = part[1:].sum()
    alone = active & (active.sum(axis=1) == 1)[:, None]
    return np.array([part @ alone, part @ active]) / whole


def _terms(levels: Sequence[int], degree: int, together: int) -> np.ndarray:
    """Return the degrees of all terms, shape (t, d), the constant first."""
    d = len(levels)
    most = [min(degree, count - 1) if count else degree for count in levels]
    rows = [np.zeros(d, dtype=int)]
    for size in range(1, together + 1):
        for chosen in itertools.combinations(range(d), size):
            for powers in itertools.product(*(range(1, most[k] + 1) for k in chosen)):
                if sum(powers) <= degree:
                    row = np.zeros(d, dtype=int)
                    row[list(chosen)] = powers
                    rows.append(row)
    return np.array(rows)


def chaos_columns(u: np.ndarray, degrees: np.ndarray, levels: Sequence[int]) -> np.ndarray:
    """Return the products of the polynomials at points, shape (n, t)."""
    found = np.ones((len(u), len(degrees)))
    for k, count in enumerate(levels):
        basis = _discrete(u[:, k], count) if count else _legendre(u[:, k], int(degrees[:, k].max()))
        found *= basis[:, degrees[:, k]]
    return found


def _legendre(u: np.ndarray, degree: int) -> np.ndarray:
    """Return Legendre's polynomials on [0, 1], orthonormal, shape (n, degree + 1)."""
    basis = np.polynomial.legendre.legvander(2.0 * u - 1.0, degree)
    return basis * np.sqrt(2.0 * np.arange(degree + 1) + 1.0)


def _discrete(u: np.ndarray, count: int) -> np.ndarray:
    """Return polynomials over so many equally likely values, orthonormal, shape (n, count)."""
    places = np.arange(count) - 0.5 * (count - 1)
    q, r = np.linalg.qr(np.vander(places, count, increasing=True))
    basis = q * np.sign(np.diag(r)) * np.sqrt(count)
    return basis[np.minimum((u * count).astype(int), count - 1)]
