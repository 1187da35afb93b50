"""What decides a result, from any sample of points: no design of its own is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

SHUFFLES = 200


def first_indices(
    columns: Mapping[str, np.ndarray], values: np.ndarray, *, bins: int | None = None, seed: int = 0
) -> pd.DataFrame:
    """Return first Sobol' indices estimated from the points at hand, against those of shuffled results.

    The index of a column is the variance of the result's means over bins of equal numbers of points, over its variance.

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
        ``index``, less what chance gives, and ``chance``, the 95 % point of the index of shuffled results: below it a
        factor
        cannot be told from one without influence. Best first.
    """
    import pandas as pd

    y = np.asarray(values, dtype=float)
    good = np.isfinite(y)
    y = y[good]
    count = bins or max(2, round(y.size**0.5))
    generator = np.random.default_rng(seed)
    rows = {}
    for name, column in columns.items():
        x = np.asarray(column)[good]
        if x.dtype.kind in "fiu":
            place = np.argsort(np.argsort(x, kind="stable")) * count // x.size
        else:
            place = np.unique(x.astype(str), return_inverse=True)[1]
        real = _index(place, y)
        shuffled = np.array([_index(place, generator.permutation(y)) for _ in range(SHUFFLES)])
        rows[name] = {"index": real - shuffled.mean(), "chance": np.quantile(shuffled, 0.95) - shuffled.mean()}
    table = pd.DataFrame.from_dict(rows, orient="index").sort_values("index", ascending=False)
    table.index.name = "factor"
    return table


def _index(place: np.ndarray, y: np.ndarray) -> float:
    counts = np.bincount(place)
    means = np.bincount(place, y) / np.maximum(counts, 1)
    spread = float(np.var(y))
    return float(np.sum(counts * (means - y.mean()) ** 2) / y.size / spread) if spread > 0.0 else 0.0


def probability(held: np.ndarray, level: float = 0.95) -> tuple[float, float, float]:
    """Return in which part of the points a condition holds, and its confidence interval (Wilson).

    Parameters
    ----------
    held : ndarray of 1 and 0, shape (n,)
        NaN are left out.
    """
    from scipy.stats import norm

    y = np.asarray(held, dtype=float)
    y = y[np.isfinite(y)]
    n, p, q = y.size, float(y.mean()), float(norm.ppf(0.5 + 0.5 * level))
    middle = (p + q * q / (2 * n)) / (1 + q * q / n)
    half = q / (1 + q * q / n) * float(np.sqrt(p * (1 - p) / n + q * q / (4 * n * n)))
    return p, max(0.0, middle - half), min(1.0, middle + half)
