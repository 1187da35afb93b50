"""Between which values total Sobol' indices must lie, from points at hand and any surrogate, however bad it is.

With V the variance of y, the total index of factor i is T_i = E[Var(y | all but i)] / V. Two inequalities hold for
every function of the factors, so that a surrogate fitted to other points gives bounds and not estimates:

* no function m of all factors but i explains more than 1 - T_i, so T_i <= 1 - corr(y, m)^2;
* of a function h whose mean over factor i is zero wherever the others are, y has a part of at most T_i in its direction
  (Cauchy and Schwarz), so T_i >= corr(y, h)^2.

Since m and h are uncorrelated, both are parts of one sum, V = a^2 var(m) + b^2 var(h) + rest, and they are estimated as
such beside the correlations: so low <= high at any number of points.

Taken are m_i, the surrogate's mean over factor i, and h_i = g - m_i, of a Gaussian process g of Matern's kernel [1]_.
What the surrogate does not explain widens the gap between both and makes neither of them wrong.

References
----------
.. [1] C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press, 2006.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.settings import CampaignError, CampaignWarning

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

FOLDS = 10
NODES = 10
"""Of the Gauss-Legendre quadrature over a factor."""

MOST_FOR_LENGTHS = 1200
"""Points that the lengths of the kernel are found from; the cost grows by their third power."""

FEWEST = 40
RESAMPLES = 1000
CONFIDENCE = 0.99
"""Of the resampled shares between the ends: of a hundred points, percentiles make an interval that is too narrow, and
these hold the truth in 95 %."""
FITTED = 3
"""Numbers that are fitted to the points: the mean and the sizes of the two parts."""


@dataclass(frozen=True)
class TotalBounds:
    """Bounds of total indices.

    Attributes
    ----------
    names : list of str
    low, high : ndarray, shape (d,)
        From the correlations found and from the shares of one sum, whichever is wider; low <= high. Without sampling
        error, which may exceed the distance of the two where the surrogate is good.
    sure_low, sure_high : ndarray, shape (d,)
        With the sampling error, by resampling: the truth lies between them with a probability of 95 %, of independent
        random points; of points spread more evenly with a higher one.
    q_squared : float
        Part of the variance that the surrogate explains of points it was not fitted to.
    """

    names: list[str]
    low: np.ndarray
    high: np.ndarray
    sure_low: np.ndarray
    sure_high: np.ndarray
    q_squared: float

    def table(self) -> pd.DataFrame:
        """Return the bounds by factor, the highest lower one first."""
        import pandas as pd

        data = {"low": self.low, "high": self.high, "sure_low": self.sure_low, "sure_high": self.sure_high}
        table = pd.DataFrame(data, index=pd.Index(self.names, name="factor"))
        return table.sort_values("low", ascending=False)


def total_bounds(
    u: np.ndarray,
    values: Sequence[float] | np.ndarray,
    names: list[str],
    *,
    levels: Sequence[int] | None = None,
    seed: int = 0,
) -> TotalBounds:
    """Return bounds of the total Sobol' indices; needs scikit-learn, of the extra ``datasets``.

    Parameters
    ----------
    u : ndarray, shape (n, d)
        Points in the unit cube, evenly spread.
    values : array_like, shape (n,)
        NaN are left out.
    names : list of str
        The d factors' coordinates.
    levels : sequence of int, optional
        Number of values of each coordinate that has but a few, 0 for a range.
    seed : int
        Of the folds and of the resampling.

    Warns
    -----
    UserWarning
        Where the surrogate explains nothing of points it was not fitted to: all bounds are then 0 and 1.

    Raises
    ------
    CampaignError
        For too few points, a result that is the same everywhere, or without scikit-learn.
    """
    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    x, y = _places(in_unit_cube(u, names, "bounds")[good], levels or [0] * len(names)), y[good]
    if y.size < FEWEST or np.ptp(y) == 0.0:
        raise CampaignError(f"bounds: {y.size} points, or a result that is the same everywhere; draw more points")
    y, _ = in_scale(y)
    y = (y - y.mean()) / y.std()
    order = np.random.default_rng(seed).permutation(y.size)
    kernel = _lengths(x[order[:MOST_FOR_LENGTHS]], y[order[:MOST_FOR_LENGTHS]])
    whole, means = np.empty(y.size), np.zeros((len(names), y.size))
    for k in range(FOLDS):
        mine = order[k::FOLDS]
        others = np.setdiff1d(order, mine)
        process = _process(kernel, fixed=True).fit(x[others], y[others])
        whole[mine] = process.predict(x[mine])
        for i, count in enumerate(levels or [0] * len(names)):
            nodes, weights = _quadrature(count)
            for node, weight in zip(nodes, weights):
                moved = x[mine].copy()
                moved[:, i] = node
                means[i, mine] += weight * process.predict(moved)
    q_squared = 1.0 - float(np.mean((y - whole) ** 2))
    if q_squared <= 0.0:
        warnings.warn(
            f"bounds: the surrogate explains nothing of {y.size} points that it was not fitted to (Q^2 = "
            f"{q_squared:.2g}); the total indices may be anything from 0 to 1. Draw more points",
            UserWarning,
            stacklevel=2,
        )
        none, all_of_it = np.zeros(len(names)), np.ones(len(names))
        return TotalBounds(list(names), none, all_of_it, none.copy(), all_of_it.copy(), q_squared)
    return TotalBounds(list(names), *_bounds(y, whole - means, means, seed), q_squared)


def _places(u: np.ndarray, levels: Sequence[int]) -> np.ndarray:
    """Return points with those of a few values at the values' places."""
    x = u.copy()
    for k, count in enumerate(levels):
        if count:
            x[:, k] = (np.minimum(np.floor(u[:, k] * count), count - 1) + 0.5) / count
    return x


def _quadrature(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights of the mean over a coordinate."""
    if count:
        return (np.arange(count) + 0.5) / count, np.full(count, 1.0 / count)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _process(kernel: Any, fixed: bool) -> Any:
    try:
        from sklearn.gaussian_process import GaussianProcessRegressor
    except ImportError:
        raise CampaignError("bounds need scikit-learn; install the extra: pip install 'gearmbs[datasets]'") from None
    return GaussianProcessRegressor(kernel, optimizer=None) if fixed else GaussianProcessRegressor(kernel)


def _lengths(x: np.ndarray, y: np.ndarray) -> Any:
    """Return the kernel of greatest likelihood: a length for each coordinate, and what is taken for noise."""
    process = _process(None, fixed=False)
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    process.kernel = ConstantKernel(1.0) * Matern(np.ones(x.shape[1]), (0.05, 50.0), nu=1.5) + WhiteKernel(0.1)
    with warnings.catch_warnings():
        # a length at its bound is that of a coordinate without influence
        warnings.simplefilter("ignore")
        return process.fit(x, y).kernel_


def _bounds(
    y: np.ndarray, own: np.ndarray, others: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return lower and upper bounds, and the ends of their intervals, from functions of shape (d, n).

    `own` are the parts of the surrogate whose mean over the factor is zero, `others` its means over it.
    """
    generator = np.random.default_rng(seed)
    low, high = _shares(y, own, others)
    away, without = _squares(y, own), _squares(y, others)
    # of the same truth, and as good where the points are many; between the two is what the points leave open
    low, high = np.minimum(low, away), np.maximum(high, 1.0 - without)
    drawn = (generator.integers(y.size, size=y.size) for _ in range(RESAMPLES))
    found = np.array([_shares(y[r], own[:, r], others[:, r]) for r in drawn])
    sure_low = np.minimum(low, np.quantile(found[:, 0], 0.5 * (1.0 - CONFIDENCE), axis=0))
    sure_high = np.maximum(high, np.quantile(found[:, 1], 0.5 * (1.0 + CONFIDENCE), axis=0))
    return low, high, sure_low, sure_high


def _squares(y: np.ndarray, functions: np.ndarray) -> np.ndarray:
    """Return the squares of the correlations with functions of shape (d, n), of those that go the same way."""
    a, b = y - y.mean(), functions - functions.mean(axis=1, keepdims=True)
    size = np.sqrt((a**2).sum() * (b**2).sum(axis=1))
    return np.maximum(np.divide(b @ a, size, out=np.zeros(len(b)), where=size > 0.0), 0.0) ** 2


def _shares(y: np.ndarray, own: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares of the variance in the direction of `own`, and all but those in the direction of `others`.

    Both are parts of one sum, the variances of the two parts and of what they leave of `y` by least squares. That the
    two parts are uncorrelated over the whole cube is known, so that their product at the points is left out of the sum,
    where correlations taken one by one would have it, and could overlap.
    """
    size = y.size
    a = y - y.mean()
    b, c = (f - f.mean(axis=1, keepdims=True) for f in (own, others))
    bb, cc, bc = (b * b).mean(axis=1), (c * c).mean(axis=1), (b * c).mean(axis=1)
    ab, ac = (b * a).mean(axis=1), (c * a).mean(axis=1)
    determinant = bb * cc - bc**2
    sure = determinant > 1e-12 * bb * cc
    safe = np.where(sure, determinant, 1.0)
    of_own = np.where(sure, (ab * cc - ac * bc) / safe, 0.0)
    of_others = np.where(sure, (ac * bb - ab * bc) / safe, np.divide(ac, cc, out=np.zeros_like(cc), where=cc > 0.0))
    # a function that goes the other way explains nothing of points it was not fitted to
    of_own, of_others = np.maximum(of_own, 0.0), np.maximum(of_others, 0.0)
    rest = ((a - of_own[:, None] * b - of_others[:, None] * c) ** 2).mean(axis=1) * size / (size - FITTED)
    parts = np.array([of_own**2 * bb, of_others**2 * cc, rest])
    total = np.maximum(parts.sum(axis=0), 1e-300)
    return parts[0] / total, 1.0 - parts[1] / total


# What decides a result, from any sample of points: no design of its own is asked for.


SHUFFLES = 200


def first_indices(
    columns: Mapping[str, np.ndarray], values: np.ndarray, *, bins: int | None = None, seed: int = 0
) -> pd.DataFrame:
    """Return first Sobol' indices estimated from the points at hand, against those of shuffled results.

    The index of a column is the variance of the result's means over bins, over its variance, less the part that chance
    gives (Kelley's epsilon squared, Proc. Natl. Acad. Sci. 21 (1935) 554: unbiased but for a ratio of means, of
    independent points). Bins hold equal numbers of points; of a column with no more values than bins each value is one,
    else equal values are in one bin, so that nothing hangs on the order of the points. Values that are no numbers are
    a bin.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        Factors: numbers or texts.
    values : ndarray, shape (n,)
        Result, or 1 and 0 for a condition that holds or not; NaN are left out.
    bins : int, optional
        Default the square root of the number of points.

    Returns
    -------
    DataFrame
        ``index`` and ``chance``, the 95 % point of the index of shuffled results: below it a factor cannot be told from
        one without influence. Best first; NaN where no value is there twice. Of points that are spread more evenly than
        independent ones chance gives less, and an index S comes out too small by up to (1 - S) ``bins`` over their
        number.
    """
    import pandas as pd

    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    y, _ = in_scale(y[good])
    count = bins or max(2, round(y.size**0.5))
    generator = np.random.default_rng(seed)
    rows = {}
    for name, column in columns.items():
        place = _bins(np.asarray(column)[good], count)
        shuffled = [_index(place, generator.permutation(y)) for _ in range(SHUFFLES)]
        rows[name] = {"index": _index(place, y), "chance": np.quantile(shuffled, 0.95)}
    table = pd.DataFrame.from_dict(rows, orient="index").sort_values("index", ascending=False)
    table.index.name = "factor"
    return table


def _bins(x: np.ndarray, count: int) -> np.ndarray:
    """Return the bin of each value of a column, 0 to the number of bins less one."""
    numbers = x.dtype.kind in "fiu"
    _, inverse, sizes = np.unique(x if numbers else x.astype(str), return_inverse=True, return_counts=True)
    if not numbers or sizes.size <= count:
        return inverse
    middle = np.cumsum(sizes) - 0.5 * (sizes + 1)
    return np.unique((middle * count // x.size)[inverse], return_inverse=True)[1]


def _index(place: np.ndarray, y: np.ndarray) -> float:
    """Return the part of the variance that means over bins explain, less that of chance, (bins - 1) / (points - 1)."""
    counts = np.bincount(place)
    means = np.bincount(place, y) / counts
    spread = float(np.var(y))
    if counts.size == y.size:
        return np.nan
    share = float(np.sum(counts * (means - y.mean()) ** 2) / y.size / spread) if spread > 0.0 else 0.0
    chance = (counts.size - 1) / (y.size - 1)
    return (share - chance) / (1.0 - chance) if spread > 0.0 else 0.0


def probability(held: np.ndarray, level: float = 0.95) -> tuple[float, float, float]:
    """Return in which part of the points a condition holds, and its confidence interval (Wilson).

    Parameters
    ----------
    held : ndarray of 1 and 0, shape (n,)
        NaN are left out.

    Raises
    ------
    CampaignError
        If none is left, or one is another number.
    """
    from scipy.stats import norm

    y = np.asarray(held, dtype=float)
    y = y[np.isfinite(y)]
    if not y.size or not np.isin(y, (0.0, 1.0)).all():
        raise CampaignError(f"probability: {y.size} values, which are not all 1 or 0; give whether a condition holds")
    n, p, q = y.size, float(y.mean()), float(norm.ppf(0.5 + 0.5 * level))
    middle = (p + q * q / (2 * n)) / (1 + q * q / n)
    half = q / (1 + q * q / n) * float(np.sqrt(p * (1 - p) / n + q * q / (4 * n * n)))
    return p, max(0.0, middle - half), min(1.0, middle + half)


# Points that are asked for.


OUTSIDE = 1e-9
"""Of the unit cube, what rounding may have put there."""


def in_unit_cube(u: np.ndarray, names: Sequence[str], what: str) -> np.ndarray:
    """Return points if they are of the unit cube, with a coordinate a name.

    Raises
    ------
    CampaignError
        Naming the coordinate that has other values, as the columns of a table in SI have.
    """
    points = np.asarray(u, dtype=float)
    if points.ndim != 2 or points.shape[1] != len(names):
        raise CampaignError(f"{what}: points of shape {points.shape} for {len(names)} names; give a column a name")
    inside = ((points >= -OUTSIDE) & (points <= 1.0 + OUTSIDE)).all(axis=0)
    for k in np.flatnonzero(~inside)[:1]:
        low, high = points[:, k].min(), points[:, k].max()
        raise CampaignError(
            f"{what}: {names[k]} goes from {low:.4g} to {high:.4g}, and points of the unit cube are asked for; give "
            "(x - low) / (high - low) with the ends of its range, or plan.points()[table['point']]"
        )
    return points


# Results of any size.


def in_scale(values: np.ndarray) -> tuple[np.ndarray, int]:
    """Return values over a power of two, so that the largest is between 0.5 and 1, and that power.

    Squares of results near 1e300 are no numbers any more, and those near 1e-300 are zero. A power of two changes no
    digit.
    """
    sizes = np.abs(values[np.isfinite(values)])
    power = int(np.frexp(sizes.max())[1]) if sizes.size else 0
    return np.ldexp(values, -power), power


def out_of_scale(values: np.ndarray | float, power: int, what: str) -> np.ndarray:
    """Return values times a power of two.

    Warns
    -----
    CampaignWarning
        If one is beyond the largest number, and infinite.
    """
    with np.errstate(over="ignore"):
        found = np.ldexp(values, power)
    if (np.isinf(found) & np.isfinite(values)).any():
        told = f"{what}: beyond {np.finfo(float).max:.2g}, the largest number, and told as infinite; take other units"
        warnings.warn(told, CampaignWarning, stacklevel=4)
    return found
