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
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.plans.factors import AnyFactor, Choice, Factor
from gearmbs.campaigns.sensitivity import coordinates, results_in_order
from gearmbs.campaigns.settings import CampaignError, CampaignWarning
from gearmbs.campaigns.sobol_bounds import in_scale, in_unit_cube, out_of_scale

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.campaigns.campaign import Campaign
    from gearmbs.campaigns.plans.plan import Plan

HIGHEST = 6
WELL = 0.9
"""Part of the variance of points left out below which a sum is said to be a poor one: what is left, which is no one's,
is then as large as the intervals of a hundred points."""

POINTS_A_TERM = 2.0
"""Points for each coefficient at least: with fewer the errors at points left out say little."""

DETERMINED = 1e-10
"""Of the largest of the diagonal of a triangular factor, below which columns are those of others but for rounding."""

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
        Half widths of the 95 % intervals of the sum's first and total indices, by resampling of the points. Those of
        the result are q_squared times its indices at least, and 1 - q_squared more at most.
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
        part, _ = in_scale(self.coefficients[1:])
        return float((part[both[1:]] ** 2).sum() / (part**2).sum())

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
        If points are not of the unit cube or determine no sum, or the result is the same everywhere.

    Warns
    -----
    CampaignWarning
        If it explains little of the variance: the intervals are those of the sum alone.

    Examples
    --------
    >>> u = np.random.default_rng(0).random((200, 2))
    >>> found = fit_chaos(u, u[:, 0] + 0.5 * u[:, 1], ["a", "b"])
    >>> found.indices.round(3).tolist()
    [[0.8, 0.2], [0.8, 0.2]]
    """
    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    u, y = in_unit_cube(u, names, "polynomial chaos")[good], y[good]
    few = tuple(levels or [0] * len(names))
    if y.size < 2 or np.ptp(y) == 0.0:
        raise CampaignError("polynomial chaos: the result is the same everywhere; it depends on none of the factors")
    y, power = in_scale(y)
    best = best_chaos(u, y, few, degree=degree, together=together)
    if best.q_squared < WELL:
        warnings.warn(
            f"polynomial chaos: the sum explains {max(best.q_squared, 0.0):.0%} of the variance of points that it was "
            "not fitted to; its intervals tell nothing of the rest. Draw more points, or take a saltelli design",
            CampaignWarning,
            stacklevel=2,
        )
    x = chaos_columns(u, best.degrees, few)
    generator, drawn = np.random.default_rng(seed), []
    for _ in range(RESAMPLES):
        # weights of a Bayesian bootstrap, under which no coefficient is left undetermined
        weight = np.sqrt(generator.exponential(size=y.size))
        drawn.append(chaos_indices(best.degrees, np.linalg.lstsq(x * weight[:, None], y * weight, rcond=None)[0]))
    confidence = 1.96 * np.std(drawn, axis=0, ddof=1)
    coefficients = out_of_scale(best.coefficients, power, "coefficients")
    return PolynomialChaos(
        list(names), few, best.degrees, coefficients, best.r_squared, best.q_squared, confidence, y.size
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
        q, r = np.linalg.qr(chaos_columns(u, degrees, levels))
        sizes = np.abs(np.diag(r))
        if len(degrees) >= y.size or sizes.min() < DETERMINED * sizes.max():
            if best is not None:
                break
            raise CampaignError(
                f"polynomial chaos: {y.size} points do not determine {len(degrees)} coefficients; draw more points, or "
                "leave out what does not vary"
            )
        found = Fitted(degrees, *_least_squares(q, r, y))
        if best is None or found.q_squared > best.q_squared:
            best = found
    assert best is not None
    return best


def _least_squares(q: np.ndarray, r: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return coefficients, R^2 and the same of points left out, for columns that are q r."""
    part = q.T @ y
    coefficients = np.linalg.solve(r, part)
    rest = y - q @ part
    leverage = np.minimum((q**2).sum(axis=1), 1.0 - 1e-12)
    spread = float(((y - y.mean()) ** 2).sum())
    out = rest / (1.0 - leverage)
    return coefficients, 1.0 - float(rest @ rest) / spread, 1.0 - float(out @ out) / spread


def chaos_indices(degrees: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Return first and total indices of a sum, shape (2, d)."""
    active = degrees[1:] > 0
    part = in_scale(coefficients[1:])[0] ** 2
    alone = active & (active.sum(axis=1) == 1)[:, None]
    return np.array([part @ alone, part @ active]) / part.sum()


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


# Sobol' indices of a Saltelli design, their noise lowered by a surrogate that is exact where it need not be right.
#
# The result is f = g + r, g a polynomial chaos. The indices of g are known from its coefficients; only how f's
# estimator differs from g's on the same points is left to chance. Each base point is judged by a polynomial fitted to
# the others, so that the estimate stays unbiased however bad the polynomial is: a bad one saves nothing.
#
# References
# ----------
# .. [1] E. Qian et al., Multifidelity Monte Carlo estimation of variance and sensitivity indices, SIAM/ASA J.
# Uncertain.    Quantif. 6 (2018) 683.
# .. [2] B. L. Nelson, Control variate remedies, Oper. Res. 38 (1990) 974.


CONTROL_FOLDS = 5
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
    fold = np.random.default_rng(seed).permutation(n) % CONTROL_FOLDS
    surrogate = np.empty_like(blocks)
    known = np.empty((n, 2 * d + 1))
    centre = np.empty(n)
    for k in range(CONTROL_FOLDS):
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


# Response surfaces: a quadratic of the factors, with its error where it was not fitted.


@dataclass(frozen=True)
class ResponseSurface:
    """A polynomial of degree one or two in the coded factors x = 2 u - 1, from -1 to 1.

    Attributes
    ----------
    names : list of str
    degree : int
    coefficients : ndarray
    standard_errors : ndarray
    r_squared : float
        Part of the variance it explains of the points it was fitted to.
    q_squared : float
        The same for each point by the surface fitted to all others: what it is worth elsewhere. NaN where a point
        alone decides a coefficient, so that the others tell nothing of it (``alone``).
    error : float
        RMS of those left-out errors, in the unit of the result; NaN as above.
    count : int
        Points.
    alone : int
        Points without which the others do not determine the coefficients: their leverage is 1.
    plan : Plan, optional
        Whose coordinates `predict` takes; terms are of the places of values in their ranges, see `response_surface`.
    """

    names: list[str]
    degree: int
    coefficients: np.ndarray
    standard_errors: np.ndarray
    r_squared: float
    q_squared: float
    error: float
    count: int
    alone: int = 0
    plan: Plan | None = field(default=None, repr=False, compare=False)

    def terms(self) -> list[str]:
        """Return the names of the terms."""
        pairs = np.triu_indices(len(self.names)) if self.degree == 2 else ((), ())
        squares = [
            f"{self.names[i]}^2" if i == j else f"{self.names[i]} x {self.names[j]}" for i, j in zip(pairs[0], pairs[1])
        ]
        return ["1", *self.names, *squares]

    def table(self) -> pd.DataFrame:
        """Return coefficients and standard errors by term."""
        import pandas as pd

        data = {"coefficient": self.coefficients, "standard_error": self.standard_errors}
        return pd.DataFrame(data, index=pd.Index(self.terms(), name="term"))

    def predict(self, u: np.ndarray) -> np.ndarray:
        """Return the surface at points of the unit cube, shape (n, d), as ``plan.points()`` gives them."""
        points = np.atleast_2d(u)
        if points.shape[1] != len(self.names):
            raise CampaignError(f"response surface: points have {points.shape[1]} coordinates; give {self.names}")
        places = points if self.plan is None else _places(self.plan, points)
        return design_matrix(2.0 * places - 1.0, self.degree) @ self.coefficients


def design_matrix(x: np.ndarray, degree: int) -> np.ndarray:
    """Return the columns of the terms 1, x_i and, of degree two, x_i x_j."""
    columns = [np.ones(len(x)), *x.T]
    if degree == 2:
        rows, others = np.triu_indices(x.shape[1])
        columns += list((x[:, rows] * x[:, others]).T)
    return np.array(columns).T


def fit_surface(
    u: np.ndarray, values: Sequence[float] | np.ndarray, names: list[str], degree: int = 2
) -> ResponseSurface:
    """Fit a response surface by least squares.

    Parameters
    ----------
    u : ndarray, shape (n, d)
        Points in the unit cube.
    values : array_like, shape (n,)
        NaN are left out.
    names : list of str
    degree : {1, 2}

    Raises
    ------
    CampaignError
        If points are not of the unit cube, or do not determine the coefficients.
    """
    u = in_unit_cube(u, names, "response surface")
    if degree not in (1, 2):
        raise CampaignError(f"response surface: degree = {degree!r}; give 1 or 2, or fit_chaos for more")
    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    x, y = design_matrix(2.0 * u[good] - 1.0, degree), y[good]
    n, t = x.shape
    if n < t or np.linalg.matrix_rank(x) < t:
        raise CampaignError(
            f"response surface: {n} points do not determine {t} coefficients; take a central composite, "
            f"more points of a "
            "sequence, or degree=1"
        )
    y, power = in_scale(y)
    inverse = np.linalg.inv(x.T @ x)
    coefficients = inverse @ (x.T @ y)
    rest = y - x @ coefficients
    leverage = np.einsum("ij,jk,ik->i", x, inverse, x)
    single = leverage >= 1.0 - 1e-9
    with np.errstate(all="ignore"):
        out = np.where(single, np.nan, rest / (1.0 - leverage))
    spread = float(np.sum((y - y.mean()) ** 2))
    noise = float(rest @ rest) / (n - t) if n > t else np.nan
    return ResponseSurface(
        names,
        degree,
        out_of_scale(coefficients, power, "coefficients"),
        out_of_scale(np.sqrt(np.diag(inverse) * noise), power, "standard errors"),
        1.0 - float(rest @ rest) / spread if spread else 1.0,
        1.0 - float(np.sum(out**2)) / spread if spread else 1.0,
        float(out_of_scale(np.sqrt(np.mean(out**2)), power, "error")),
        n,
        int(single.sum()),
    )


def _alternatives(factor: AnyFactor) -> Sequence[Any]:
    """Return what a factor is one of."""
    if isinstance(factor, Factor):
        return factor.values
    return list(factor.options) if isinstance(factor, Choice) else range(factor.draws)


def _places(plan: Plan, points: np.ndarray) -> np.ndarray:
    """Return where points of a plan lie in the ranges of its factors, 0 to 1, of two alternatives at one or the other.

    Raises
    ------
    CampaignError
        If a factor has more than two alternatives without order.
    """
    at, found = 0, plan.places(points)
    for factor in plan.factors:
        mine = points[:, at : at + factor.width]
        if factor.width and np.isnan(found[:, at]).any():
            alternatives = _alternatives(factor)
            if len(alternatives) > 2:
                raise CampaignError(
                    f"response surface: {factor.name} has {len(alternatives)} alternatives, which have no order; ask "
                    "sensitivity, or fit the cases of each by fit_surface"
                )
            found[:, at] = [value == alternatives[-1] for value in factor.columns(mine)[factor.name]]
        at += factor.width
    return found


def response_surface(campaign: Campaign, result: str, degree: int = 2) -> ResponseSurface:
    """Return the response surface of a campaign's result, which predicts at points of its plan.

    Its terms are of the places of numbers in their range, and not of the coordinates that chose them, where they are
    whole or a few; of two alternatives the first is 0 and the other 1.

    Raises
    ------
    CampaignError
        If a factor has more than two alternatives without order.

    Warns
    -----
    CampaignWarning
        If results are missing, of cases that failed or are not done, or nothing is known of points left out.
    """
    if campaign.plan.variants > 1:
        raise CampaignError("response surface: not of crossed choices; fit each option's cases by fit_surface")
    names, points = coordinates(campaign)
    values = results_in_order(campaign, result)
    if len(values) != len(points):
        raise CampaignError(
            "response surface: constraints have left points out; fit plan.points()[table['point']] by fit_surface"
        )
    if missing := int((~np.isfinite(values)).sum()):
        warnings.warn(
            f"{result}: {missing} of {values.size} cases have no result; the surface is of the others alone",
            CampaignWarning,
            stacklevel=3,
        )
    surface = replace(fit_surface(_places(campaign.plan, points), values, names, degree), plan=campaign.plan)
    if surface.alone:
        warnings.warn(f"{result}: {untold(surface)}", CampaignWarning, stacklevel=3)
    return surface


def untold(surface: ResponseSurface) -> str:
    """Return why nothing is known of points left out."""
    return (
        f"{surface.alone} of {surface.count} points decide a coefficient alone, as the one run at the centre of a box "
        "behnken design does (leverage 1): the others tell nothing of them, and there is no error at points left out; "
        "give options={'centre': 3}, more points, or degree=1"
    )
