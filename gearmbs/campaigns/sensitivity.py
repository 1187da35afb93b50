"""What decides a result: effects, elementary effects, Sobol' indices.

References
----------
.. [1] A. Saltelli et al., Variance based sensitivity analysis of model output, Comput. Phys. Commun. 181 (2010) 259.
.. [2] M. J. W. Jansen, Analysis of variance designs for model output, Comput. Phys. Commun. 117 (1999) 35.
.. [3] F. Campolongo, J. Cariboni, A. Saltelli, An effective screening design for sensitivity analysis of large models,
   Environ. Model. Softw. 22 (2007) 1509.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.campaigns.plans.designs import SEQUENCES, TWO_LEVELS
from gearmbs.campaigns.plans.factors import Choice
from gearmbs.campaigns.settings import CampaignError, CampaignWarning
from gearmbs.campaigns.sobol_bounds import in_scale, out_of_scale
from gearmbs.schema.described import chosen

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.campaigns.campaign import Campaign
    from gearmbs.campaigns.plans.plan import Plan
    from gearmbs.campaigns.surrogates import PolynomialChaos

RESAMPLES = 200
CONFIDENCE = 0.95
"""Probability of the intervals of indices, the customary one."""

LEAST_HELD, MOST_HELD = 1e-9, 20
"""Share of a term that an effect of a fraction holds, below which it is rounding; and terms that are named."""


@dataclass(frozen=True)
class SobolIndices:
    """Sobol' indices of a result.

    Attributes
    ----------
    names : list of str
    first, total : ndarray, shape (d,)
        Parts of the variance: of each factor alone, and of each with all its interactions.
    first_confidence, total_confidence : ndarray, shape (d,)
        Half widths of their 95 % intervals, by resampling of the base points.
    base_points, left_out : int
        Base points used, and those left out since one of their cases has no result.
    mean, variance : float
        Of the result.
    explained : float
        Part of the variance that the polynomials explain at points left out, whose indices are known and not sampled;
        0 without.
    """

    names: list[str]
    first: np.ndarray
    total: np.ndarray
    first_confidence: np.ndarray
    total_confidence: np.ndarray
    base_points: int
    left_out: int
    mean: float
    variance: float
    explained: float = 0.0

    def table(self) -> pd.DataFrame:
        """Return the indices by factor, the most important first."""
        import pandas as pd

        table = pd.DataFrame(
            {
                "first": self.first,
                "first_confidence": self.first_confidence,
                "total": self.total,
                "total_confidence": self.total_confidence,
            },
            index=pd.Index(self.names, name="factor"),
        )
        return table.sort_values("total", ascending=False)


def sobol_indices(
    values: np.ndarray,
    names: list[str],
    *,
    points: np.ndarray | None = None,
    levels: Sequence[int] | None = None,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> SobolIndices:
    """Return first and total Sobol' indices of results on a Saltelli design.

    With A, B and AB_i, A with coordinate i of B, standardised together: first index the mean of f_B (f_AB - f_A)
    (Saltelli 2010), total index half the mean of (f_A - f_AB)^2 (Jansen 1999), over the variance of f_A and f_B. With
    the points, polynomials serve as control variates, which narrows the intervals and leaves the expectation; see
    `gearmbs.campaigns.surrogates`.

    Parameters
    ----------
    values : ndarray, shape (n (d + 2),)
        In the order of `gearmbs.campaigns.plans.designs.saltelli`; NaN where there is none.
    names : list of str
        The d factors' coordinates.
    points : ndarray, shape (n (d + 2), d), optional
        The design.
    levels : sequence of int, optional
        Number of values of each coordinate that has but a few, 0 for a range.

    Returns
    -------
    SobolIndices
    """
    d = len(names)
    y = np.asarray(values, dtype=float)
    if not d or y.size % (d + 2):
        raise CampaignError(f"sobol: {y.size} values for {d} names; give n ({d} + 2), in the order of the design")
    blocks = y.reshape(-1, d + 2)
    if points is not None and not _is_saltelli(np.reshape(points, (-1, d + 2, d))):
        raise CampaignError(
            "sobol: the points are no Saltelli design, of each base point A, A with one coordinate of B each, B; take "
            "fit_chaos for others"
        )
    good = np.isfinite(blocks).all(axis=1)
    left_out = int((~good).sum())
    blocks = blocks[good]
    if len(blocks) < 4:
        raise CampaignError(f"sobol: {len(blocks)} base points have all their results; at least four are needed")
    blocks, power = in_scale(blocks)
    mean, variance = float(blocks[:, [0, -1]].mean()), float(blocks[:, [0, -1]].var())
    if variance == 0.0:
        raise CampaignError("sobol: the result is the same everywhere; it depends on none of the factors")
    mean, variance = float(out_of_scale(mean, power, "mean")), float(out_of_scale(variance, 2 * power, "variance"))
    blocks = (blocks - blocks.mean()) / blocks.std()
    controlled = None
    if points is not None:
        from gearmbs.campaigns.surrogates import control_variates

        controlled = control_variates(blocks, np.reshape(points, (-1, d + 2, d))[good], levels or [0] * d, seed=seed)
    estimate = (lambda rows: _indices(blocks[rows])) if controlled is None else controlled.indices
    first, total = estimate(np.arange(len(blocks)))
    generator = np.random.default_rng(seed)
    drawn = [estimate(generator.integers(len(blocks), size=len(blocks))) for _ in range(resamples)]
    # a resample of n is as if drawn from what is spread by (n - 1) / n of the variance
    spread = np.std(np.array(drawn), axis=0, ddof=1) * np.sqrt(len(blocks) / (len(blocks) - 1.0))
    q = _student(len(blocks))
    return SobolIndices(
        names,
        first,
        total,
        q * spread[0],
        q * spread[1],
        len(blocks),
        left_out,
        mean,
        variance,
        0.0 if controlled is None else controlled.explained,
    )


def _is_saltelli(points: np.ndarray) -> bool:
    """Whether points of shape (n, d + 2, d) are A, A with one coordinate of B each, B."""
    own = np.eye(points.shape[2], dtype=bool)
    wanted = np.where(own, points[:, -1:], points[:, :1])
    return bool(np.array_equal(points[:, 1:-1], wanted))


def _student(count: int) -> float:
    """Return half the width of the interval of a mean of so many values over its standard error."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1))


def _indices(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, mixed = blocks[:, :1], blocks[:, -1:], blocks[:, 1:-1]
    variance = np.var(np.r_[a, b])
    return (b * (mixed - a)).mean(axis=0) / variance, 0.5 * ((a - mixed) ** 2).mean(axis=0) / variance


def morris_effects(
    values: np.ndarray, points: np.ndarray, names: list[str], *, places: np.ndarray | None = None
) -> pd.DataFrame:
    """Return the elementary effects on a Morris design: mean, mean of the absolute value, spread, and its confidence.

    Parameters
    ----------
    values : ndarray, shape (n (d + 1),)
        In the order of `gearmbs.campaigns.plans.designs.morris`; trajectories with a NaN are left out.
    points : ndarray, shape (n (d + 1), d)
        The design.
    places : ndarray, shape (n (d + 1), d), optional
        Where the values lie in their ranges, which a step of the design moves: of two values by 1 where it moves the
        coordinate by 2/3. NaN for what has no order; default the points.

    Returns
    -------
    DataFrame
        ``mu``, ``mu_star`` (Campolongo 2007), ``sigma`` and ``confidence`` (half width of the 95 % interval of mu_star,
        by Student's t) by factor. An effect is the change of the result over the whole range of the factor; from one
        alternative to another of what has no order. Of one trajectory neither sigma nor confidence is known. Of a few
        the interval is that of the effects they have met: where these are equal, by chance or since the result is
        linear, it is zero.
    """
    import pandas as pd

    d = len(names)
    if np.shape(points) != (np.size(values), d) or np.size(values) % (d + 1):
        raise CampaignError(f"morris: {np.size(values)} values and points of shape {np.shape(points)} for {d} names")
    y, x = np.asarray(values, dtype=float).reshape(-1, d + 1), np.asarray(points).reshape(-1, d + 1, d)
    good = np.isfinite(y).all(axis=1)
    at = x if places is None else np.asarray(places).reshape(x.shape)
    (y, power), x, at = in_scale(y[good]), x[good], at[good]
    if not len(y):
        raise CampaignError("morris: no trajectory has all its results")
    moves = np.diff(x, axis=1)
    axis = np.abs(moves).argmax(axis=2)
    if (np.count_nonzero(moves, axis=2) != 1).any() or (np.sort(axis, axis=1) != np.arange(d)).any():
        raise CampaignError("morris: the points are no Morris design, whose trajectories change each coordinate once")
    effect = np.empty((len(y), d))
    rows = np.arange(len(y))[:, None]
    move, step = (np.take_along_axis(m, axis[..., None], axis=2)[..., 0] for m in (moves, np.diff(at, axis=1)))
    step = np.where(np.isnan(step), np.sign(move), step)
    # a value that did not move, as one of a range of one whole number, has no effect
    effect[rows, axis] = np.divide(np.diff(y, axis=1), step, out=np.zeros_like(step), where=step != 0.0)
    size = np.abs(effect)
    several = len(y) > 1
    found = {
        "mu": effect.mean(axis=0),
        "mu_star": size.mean(axis=0),
        "sigma": effect.std(axis=0, ddof=1) if several else np.full(d, np.nan),
        "confidence": _student(len(y)) * size.std(axis=0, ddof=1) / len(y) ** 0.5 if several else np.full(d, np.nan),
    }
    columns = {name: out_of_scale(values, power, name) for name, values in found.items()}
    table = pd.DataFrame(columns, index=pd.Index(names, name="factor"))
    return table.sort_values("mu_star", ascending=False)


def main_effects(coded: np.ndarray, values: np.ndarray, names: list[str], *, interactions: bool = True) -> pd.DataFrame:
    """Return main effects and two-factor interactions of a two-level design: mean at high less mean at low.

    Of a fraction ``aliases`` names the terms that an effect holds besides, with the part of each that is not the whole:
    it is the sum of all. Where they are many, the largest are named.

    Parameters
    ----------
    coded : ndarray, shape (n, d)
        -1 and 1.
    values : ndarray, shape (n,)

    Raises
    ------
    CampaignError
        If a result is missing: in what is left effects are no longer told from each other.
    """
    import pandas as pd

    values = np.asarray(values, dtype=float)
    if np.shape(coded) != (values.size, len(names)) or not np.isin(coded, (-1.0, 1.0)).all():
        raise CampaignError(
            f"effects: coded has the shape {np.shape(coded)} for {values.size} values of {len(names)} names, or other "
            "numbers than -1 and 1; give these, the low and the high end"
        )
    missing = int((~np.isfinite(values)).sum())
    if missing:
        raise CampaignError(f"effects: {missing} of {values.size} cases have no result; a factorial needs them all")
    values, power = in_scale(values)
    terms = {name: coded[:, k] for k, name in enumerate(names)}
    for i, j in itertools.combinations(range(len(names)), 2):
        terms[f"{names[i]} x {names[j]}"] = coded[:, i] * coded[:, j]
    rows, aliases = {}, {}
    for name in terms if interactions else names:
        column = terms[name]
        up, down = column > 0, column < 0
        if up.any() and down.any():
            effect = values[up].mean() - values[down].mean()
            rows[name] = float(out_of_scale(effect, power, f"effect of {name}"))
            both = {other: float(column @ terms[other]) / len(column) for other in terms if other != name}
            aliases[name] = _held(both)
    table = pd.DataFrame({"effect": rows} | ({"aliases": aliases} if any(aliases.values()) else {}))
    table.index.name = "term"
    return table.reindex(table.effect.abs().sort_values(ascending=False).index)


def _held(shares: dict[str, float]) -> str:
    """Return in words which terms an effect holds, of which it has these shares."""
    held = sorted((item for item in shares.items() if abs(item[1]) > LEAST_HELD), key=lambda item: -abs(item[1]))
    told = []
    for name, share in held[:MOST_HELD]:
        size = "" if abs(share) > 1.0 - LEAST_HELD else f"{abs(share):.2g} "
        told.append(f"{'-' if share < 0 else ''}{size}{name}")
    more = [f"and {len(held) - MOST_HELD} more"] if len(held) > MOST_HELD else []
    return ", ".join([*told, *more])


def one_factor_studies(campaign: Campaign, result: str) -> pd.DataFrame:
    """Return a result over the values of each factor alone, the others at the base, of a one-at-a-time design.

    Returns
    -------
    DataFrame
        By factor and value: ``result``; ``change``, its difference from the base; and ``sensitivity``, the mean of the
        slopes to the neighbouring values, in the result's unit over the factor's in SI, NaN for factors without order.
    """
    import pandas as pd

    plan = campaign.plan
    points = plan.points()
    y, columns = results_in_order(campaign, result), plan.columns(points)
    rows, first = [], 1
    for factor in plan.factors:
        stop = first + plan.count(factor)
        values, found = columns[factor.name][first:stop], y[first:stop]
        slope = np.full(found.size, np.nan)
        if values.dtype.kind in "fiu" and found.size > 1:
            slopes = np.diff(found) / np.diff(values.astype(float))
            slope = 0.5 * (np.r_[slopes[:1], slopes] + np.r_[slopes, slopes[-1:]])
        rows += [(factor.name, v, r, r - y[0], k) for v, r, k in zip(values, found, slope)]
        first = stop
    table = pd.DataFrame(rows, columns=["factor", "value", "result", "change", "sensitivity"])
    return table.set_index(["factor", "value"])


def grid_indices(values: np.ndarray, counts: Sequence[int], names: list[str]) -> SobolIndices:
    """Return first and total Sobol' indices of results on a full grid, each value of a factor as likely as the others.

    These are the parts of the grid's own variance (analysis of variance of a complete layout), free of any sampling
    error: the mean over all factors but one varies by its first index, the mean over that one leaves what is not in its
    total.

    Parameters
    ----------
    values : ndarray, shape (product of counts,)
        The last factor running fastest, as `gearmbs.campaigns.plans.designs.grid` does.
    counts : sequence of int
        Values of each factor.

    Raises
    ------
    CampaignError
        If a result is missing, or all are equal.
    """
    y = np.asarray(values, dtype=float).reshape(tuple(counts))
    missing = int((~np.isfinite(y)).sum())
    if missing:
        raise CampaignError(f"grid: {missing} of {y.size} cases have no result; the parts of a grid need them all")
    y, power = in_scale(y)
    variance = float(y.var())
    if variance == 0.0:
        raise CampaignError("grid: the result is the same everywhere; it depends on none of the factors")
    d = len(names)
    others = [tuple(a for a in range(d) if a != k) for k in range(d)]
    first = np.array([y.mean(axis=axes).var() for axes in others]) / variance
    total = np.array([y.var(axis=k).mean() for k in range(d)]) / variance
    zero = np.zeros(d)
    mean, spread = out_of_scale(y.mean(), power, "mean"), out_of_scale(variance, 2 * power, "variance")
    return SobolIndices(names, first, total, zero, zero, y.size, 0, float(mean), float(spread))


def coordinates(campaign: Campaign) -> tuple[list[str], np.ndarray]:
    """Return the names of the coordinates of a campaign's plan and its points in the unit cube.

    They are those of the table's columns. A coordinate of a choice that is a range of several options, as the lost part
    of a tooth and the depth of wear, is ``NAME.severity`` if it is the first of each, else ``NAME.ONE/OTHER``.
    """
    plan = campaign.plan
    names = []
    for factor in plan.factors:
        names += _of_choice(factor) if isinstance(factor, Choice) else [factor.name]
    return names, plan.points()


def _of_choice(choice: Choice) -> list[str]:
    """Return the names of a choice's coordinates."""
    names = [] if choice.crossed else [choice.name]
    ranges = list(choice.ranges.values())
    for k in range(choice.width - len(names)):
        keys = list(dict.fromkeys(found[k] for found in ranges if len(found) > k))
        names.append(choice.severity if len(keys) > 1 and k == 0 else f"{choice.name}.{'/'.join(keys)}")
    return names


def results_in_order(campaign: Campaign, result: str) -> np.ndarray:
    """Return a result by case, NaN for cases that failed or are not done."""
    from gearmbs.campaigns.results import result_names

    table = campaign.table
    names = result_names(campaign.folder, table)
    if not names:
        raise CampaignError(f"result {result!r}: none of {len(table)} cases has any; see failed()")
    if result not in table.columns:
        chosen(names, result, "", CampaignError, "result")
    if table[result].dtype.kind not in "biuf":
        raise CampaignError(f"result {result!r} is a column of texts, not of numbers")
    if result not in names:
        raise CampaignError(f"result {result!r} is what the plan gives each case; results are {', '.join(names)}")
    values = np.full(campaign.folder.case_count, np.nan)
    values[table["index"].to_numpy()] = table[result].to_numpy(dtype=float)
    return values


def campaign_chaos(campaign: Campaign, result: str, degree: int | None = None) -> PolynomialChaos:
    """Return the polynomial chaos of a campaign's result over the coordinates of its plan."""
    from gearmbs.campaigns.surrogates import fit_chaos

    plan = campaign.plan
    if plan.variants > 1 or plan.constraints:
        raise CampaignError(
            "polynomial chaos: not of crossed choices or constraints; fit plan.points()[table['point']] by fit_chaos"
        )
    names, points = coordinates(campaign)
    return fit_chaos(points, results_in_order(campaign, result), names, levels=_levels(plan), degree=degree)


def _levels(plan: Plan) -> list[int]:
    """Return the number of values of each coordinate that has but a few, 0 for a range."""
    from gearmbs.campaigns.plans.factors import Factor

    levels: list[int] = []
    for factor in plan.factors:
        few = len(factor.values) if isinstance(factor, Factor) else factor.count if isinstance(factor, Choice) else 0
        levels += [few] + [0] * (factor.width - 1)
    return levels


def sensitivity(campaign: Campaign, result: str) -> SobolIndices | PolynomialChaos | pd.DataFrame:
    """Return what decides a result, by the campaign's design.

    `SobolIndices` of a Saltelli design or a full grid, a table of effects of a Morris or factorial one, and a
    `PolynomialChaos`, whose coefficients are Sobol' indices, of points that fill the space; `one_factor_studies` of a
    one-at-a-time design.

    Raises
    ------
    CampaignError
        For a design that is made for something else, constraints, and results that are missing of a grid or factorial.

    Warns
    -----
    CampaignWarning
        If results are missing, of cases that failed or are not done.
    """
    plan = campaign.plan
    names, points = coordinates(campaign)
    values = results_in_order(campaign, result)
    if plan.variants > 1:
        raise CampaignError(
            "sensitivity: not of crossed choices; make the choice a factor, or ask for one option's cases"
        )
    if plan.constraints:
        raise CampaignError(
            f"sensitivity: constraints have left points of the {plan.design} design out; fit "
            "plan.points()[table['point']] by fit_surface or fit_chaos"
        )
    missing = int((~np.isfinite(values)).sum())
    if missing:
        warnings.warn(
            f"{result}: {missing} of {values.size} cases have no result; what decides it is told of the others alone, "
            "which are no longer spread over the whole ranges",
            CampaignWarning,
            stacklevel=3,
        )
    if plan.design == "saltelli":
        return sobol_indices(values, names, points=points, levels=_levels(plan))
    if plan.design == "morris":
        return morris_effects(values, points, names, places=plan.places(points))
    if plan.design in TWO_LEVELS:
        # the high end of numbers is that of their values, wherever it stands among them
        at = np.rint(plan.places(points))
        at = np.where(np.isnan(at) | (np.ptp(at, axis=0) == 0.0), points, at)
        return main_effects(2.0 * at - 1.0, values, names, interactions=plan.design == "factorial")
    if plan.design == "grid":
        # crossed choices, which take no coordinate, were refused above
        varied = [k for k, count in enumerate(plan.counts()) if count > 1]
        return grid_indices(values, [plan.counts()[k] for k in varied], [names[k] for k in varied])
    if plan.design == "one at a time":
        return one_factor_studies(campaign, result)
    if plan.design in (*SEQUENCES, "latin hypercube"):
        return campaign_chaos(campaign, result)
    raise CampaignError(
        f"sensitivity: a {plan.design} design has none of its own; take saltelli, morris, sobol or factorial, or "
        f"response_surface"
    )
