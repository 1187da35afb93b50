"""Figures of a campaign: main effects, tornado, scatter matrix, parallel coordinates, and where a condition holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearmbs.campaigns.plans.conditions import satisfied
from gearmbs.campaigns.plans.plan import ABOUT
from gearmbs.campaigns.results import factor_names, numeric_results, only_numbers, result_names, say_left_out
from gearmbs.campaigns.settings import CampaignError, texts, whole
from gearmbs.campaigns.sobol_bounds import in_scale
from gearmbs.schema.described import chosen

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from gearmbs.campaigns.campaign import Campaign
    from gearmbs.view.figures.style import Picture

FEW = 6
"""Up to so many different values a factor has levels, beyond them bins of equal numbers of cases."""

BINS = 6
TAIL = 0.2
"""Part of the cases at either end of a factor whose means a tornado compares."""

MOST_COLUMNS = 7
"""Of a scatter matrix: with more its panels cannot be read."""

NORMAL = 1.96
"""Standard errors to either side of a mean, for 95 %."""

WRITTEN_ON = {"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
"""Behind texts among lines."""

ALIKE = 0.95
"""Correlation from which on two results tell the same."""


def varied_results(campaign: Campaign, most: int = 4) -> list[str]:
    """Return the results that vary most, each for what those before it do not tell.

    They are ordered by their standard deviation over their RMS, which compares results of different units; those whose
    correlation with one that varies more is above 0.95 are left out.
    """
    table = only_numbers(campaign.folder, campaign.table)
    names = numeric_results(campaign.folder, table)
    values = table[names].to_numpy(dtype=float)
    if names:
        values = np.stack([in_scale(column)[0] for column in values.T], axis=1)
    with np.errstate(all="ignore"):
        share = np.nanstd(values, axis=0) / np.sqrt(np.nanmean(values**2, axis=0))
    # rounding is no variation
    varying = [k for k in np.argsort(-share, kind="stable") if share[k] > 1e-9]
    found: list[int] = []
    for k in varying:
        if len(found) == most:
            break
        if all(abs(_correlation(values[:, k], values[:, other])) < ALIKE for other in found):
            found.append(int(k))
    return [names[k] for k in found]


def figure(
    campaign: Campaign,
    kind: str = "main effects",
    results: str | Sequence[str] | None = None,
    factors: str | Sequence[str] | None = None,
) -> Picture:
    """Draw results of a campaign over its factors; see `gearmbs.campaigns.Campaign.figure`."""
    draw = chosen(KINDS, kind, "", CampaignError, "figure")
    table = only_numbers(campaign.folder, campaign.table)
    done = table[table["status"] == "done"]
    known = result_names(campaign.folder, done)
    wanted = texts(results, "figure: results") if results else varied_results(campaign, 3)
    chosen_factors = texts(factors, "figure: factors") if factors else main_factors(campaign, done)
    for name in wanted:
        chosen(known, name, "", CampaignError, "result")
    for name in chosen_factors:
        chosen([name for name in done.columns if name not in known], name, "", CampaignError, "factor")
    # a case is in the picture of those of the results that it has
    unknown = int(done[list(wanted)].isna().all(axis=1).sum()) if wanted else 0
    left = say_left_out(campaign.folder, table, "figure", unknown=unknown, stacklevel=4)
    if not wanted:
        raise CampaignError("figure: none of the results varies")
    if not chosen_factors:
        raise CampaignError(f"figure: none of the factors varies over {len(done)} cases; name them, or run more")
    from gearmbs.view.figures.style import look

    with look():
        picture = draw(done, list(wanted), list(chosen_factors), campaign.units)
        # a title of the whole is a text of the figure
        title = picture.texts[0] if picture.texts else picture.axes[0].title
        title.set_text("\n".join(filter(None, (title.get_text(), left))))
    return picture


def main_factors(campaign: Campaign, table: pd.DataFrame) -> list[str]:
    """Return the factors that have more than one value and one in every case."""
    names = [name for name in factor_names(campaign.folder) if name not in ABOUT]
    return [name for name in names if table[name].nunique() > 1 and table[name].notna().all()]


def _main_effects(table: pd.DataFrame, results: list[str], factors: list[str], units: dict[str, str]) -> Picture:
    """Means of each result over the values of each factor, with their 95 % intervals, beside the mean of all."""
    from gearmbs.view.figures.style import COLOURS, GREY, label, new_figure

    picture = new_figure(2.0 + 2.1 * len(factors), 0.6 + 2.2 * len(results))
    panels: Any = picture.subplots(len(results), len(factors), sharey="row", sharex="col", squeeze=False)
    for (i, result), (j, factor) in ((a, b) for a in enumerate(results) for b in enumerate(factors)):
        ax, y = panels[i, j], table[result].to_numpy(dtype=float)
        place, names, group = _levels(table[factor])
        means = np.array([mean(y[group == k]) for k in range(len(place))])
        counts = np.array([np.isfinite(y[group == k]).sum() for k in range(len(place))])
        spread = np.array([deviation(y[group == k]) for k in range(len(place))])
        ax.axhline(np.nanmean(y), color=GREY, lw=0.8, ls="--")
        ax.errorbar(place, means, NORMAL * spread / np.sqrt(counts), fmt="o-", ms=4, capsize=2, color=COLOURS[i])
        if names is not None:
            ax.set_xticks(place, names)
            ax.set_xlim(-0.5, len(place) - 0.5)
        ax.tick_params(labelsize=8)
        if i == len(results) - 1:
            ax.set_xlabel(label(factor, units.get(factor)), fontsize=8)
        if j == 0:
            ax.set_ylabel(label(result, units.get(result)), fontsize=8)
    picture.suptitle("Main effects: means and their 95 % intervals", fontsize=10, x=0.01, ha="left")
    return picture


def _tornado(table: pd.DataFrame, results: list[str], factors: list[str], units: dict[str, str]) -> Picture:
    """Mean of each result at either end of each factor with its 95 % interval, what moves it most on top."""
    from gearmbs.view.figures.style import BLACK, BLUE, ORANGE, label, new_figure

    picture = new_figure(7.5, (0.9 + 0.42 * len(factors)) * len(results))
    panels: Any = picture.subplots(len(results), 1, squeeze=False)[:, 0]
    for ax, result in zip(panels, results, strict=True):
        y = table[result].to_numpy(dtype=float)
        middle = float(np.nanmean(y))
        ends = {factor: _ends(table[factor], y) for factor in factors}
        order = sorted(factors, key=lambda factor: np.nan_to_num(abs(ends[factor][1].mean - ends[factor][0].mean)))
        for k, factor in enumerate(order):
            for end, colour, place in zip(ends[factor], (BLUE, ORANGE), (k + 0.19, k - 0.19), strict=True):
                ax.barh(place, end.mean - middle, left=middle, color=colour, height=0.38)
                if end.reach > 0.0:
                    ax.errorbar(end.mean, place, xerr=end.reach, fmt="none", ecolor=BLACK, elinewidth=0.8, capsize=2)
                right = end.mean >= middle
                ax.annotate(
                    end.where, (end.mean + (1 if right else -1) * np.nan_to_num(end.reach), place),
                    (3 if right else -3, 0), textcoords="offset points", fontsize=7,
                    ha="left" if right else "right", va="center",
                )  # fmt: skip
        ax.axvline(middle, color=BLACK, lw=0.8)
        ax.set_yticks(range(len(order)), [label(factor, units.get(factor)) for factor in order], fontsize=8)
        ax.set_xlabel(label(f"mean of {result}", units.get(result)), fontsize=8)
        ax.tick_params(axis="x", labelsize=8)
        ax.margins(x=0.15)
        ax.grid(axis="y", visible=False)
    title = f"Means over the lowest (blue) and the highest {TAIL:.0%} (orange) of each factor, or over its levels,\n"
    title += "with 95 % intervals: bars within them may be scatter of the other factors"
    picture.suptitle(title, fontsize=9, x=0.01, ha="left")
    return picture


def _scatter_matrix(table: pd.DataFrame, results: list[str], factors: list[str], units: dict[str, str]) -> Picture:
    """Every column over every other, their histograms, and their rank correlations."""
    from gearmbs.view.figures.style import BLUE, ORANGE, label, new_figure

    names = [*factors[: max(2, MOST_COLUMNS - len(results))], *results][:MOST_COLUMNS]
    picture = new_figure(1.55 * len(names) + 0.6, 1.55 * len(names) + 0.4)
    panels: Any = picture.subplots(len(names), len(names), squeeze=False)
    columns = {name: _as_numbers(table[name]) for name in names}
    for i, j in np.ndindex(len(names), len(names)):
        ax, (x, x_names), (y, y_names) = panels[i, j], columns[names[j]], columns[names[i]]
        ax.tick_params(labelsize=6)
        if i == j:
            ax.hist(x[np.isfinite(x)], bins=12, color=ORANGE if names[i] in results else BLUE)
            ax.set_yticks([])
        elif j > i:
            value = _rank_correlation(x, y)
            text = f"{value:.2f}" if math.isfinite(value) else ""
            size = 8.0 + 6.0 * abs(np.nan_to_num(value))
            ax.text(0.5, 0.5, text, ha="center", va="center", fontsize=size, transform=ax.transAxes)
            ax.grid(visible=False)
            ax.set_xticks([])
            ax.set_yticks([])
        else:
            ax.plot(x, y, ".", ms=3, alpha=0.5, color=ORANGE if names[i] in results else BLUE)
        _named(ax, x_names if i >= j else None, y_names if j < i else None)
        if i < len(names) - 1:
            ax.set_xticklabels([])
        else:
            ax.set_xlabel(label(names[j], units.get(names[j])), fontsize=7)
        if j > 0:
            ax.set_yticklabels([])
        elif i > 0:
            ax.set_ylabel(label(names[i], units.get(names[i])), fontsize=7)
    picture.align_labels()
    picture.suptitle("Scatter matrix, above the diagonal rank correlations", fontsize=10, x=0.01, ha="left")
    return picture


def _parallel(table: pd.DataFrame, results: list[str], factors: list[str], units: dict[str, str]) -> Picture:
    """Each case as a line through its factors and results, coloured by the first result."""
    import matplotlib
    from matplotlib.collections import LineCollection

    from gearmbs.view.figures.style import BLACK, label, new_figure

    names = [*factors, *results]
    picture = new_figure(1.6 * len(names) + 1.0, 4.2)
    ax = picture.subplots()
    heights = []
    for k, name in enumerate(names):
        values, texts = _as_numbers(table[name])
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        heights.append((values - low) / (high - low) if high > low else np.full(values.size, 0.5))
        ends = [(0.0, f"{low:.4g}"), (1.0, f"{high:.4g}")]
        if texts is not None:
            ends = [(i / max(1, len(texts) - 1), text) for i, text in enumerate(texts)]
        ax.axvline(k, color=BLACK, lw=0.8)
        for height, text in ends:
            ax.annotate(text, (k, height), (3, 3), textcoords="offset points", fontsize=7, bbox=WRITTEN_ON)
    lines = np.stack([np.broadcast_to(np.arange(len(names)), (len(table), len(names))), np.array(heights).T], axis=-1)
    coloured = table[results[0]].to_numpy(dtype=float)
    good = np.isfinite(lines).all(axis=(1, 2))
    bundle = LineCollection(list(lines[good]), linewidths=0.8, alpha=0.7, cmap=matplotlib.colormaps["viridis"])
    bundle.set_array(coloured[good])
    ax.add_collection(bundle)
    picture.colorbar(bundle, ax=ax, label=label(results[0], units.get(results[0])), pad=0.08)
    ax.set_xticks(range(len(names)), [label(name, units.get(name)).replace(", ", ",\n") for name in names], fontsize=8)
    ax.set_xlim(-0.1, len(names) - 0.6)
    ax.set_ylim(-0.05, 1.1)
    ax.set_yticks([])
    ax.grid(visible=False)
    ax.spines[["left", "bottom"]].set_visible(False)
    ax.set_title("Parallel coordinates: a line is a case")
    return picture


def mean(y: np.ndarray) -> float:
    """Return the mean of values, NaN left out; NaN of none."""
    good = y[np.isfinite(y)]
    return float(good.mean()) if good.size else math.nan


def deviation(y: np.ndarray) -> float:
    """Return the standard deviation of values, NaN left out; NaN of fewer than two."""
    scaled, power = in_scale(y[np.isfinite(y)])
    return float(np.ldexp(scaled.std(ddof=1), power)) if scaled.size > 1 else math.nan


KINDS = {
    "main effects": _main_effects,
    "tornado": _tornado,
    "scatter matrix": _scatter_matrix,
    "parallel coordinates": _parallel,
}
"""Figures by their name; each takes the table, names of results and of factors, and units by name."""


def _levels(column: pd.Series) -> tuple[np.ndarray, list[str] | None, np.ndarray]:
    """Return the places of a factor's levels, their names where they are texts, and the level of each case."""
    if column.dtype.kind not in "biuf":
        names, group = np.unique(column.astype(str), return_inverse=True)
        return np.arange(len(names), dtype=float), [str(name) for name in names], group
    x = column.to_numpy(dtype=float)
    values = np.unique(x)
    if values.size <= FEW:
        return values, None, np.searchsorted(values, x)
    edges = np.quantile(x, np.linspace(0.0, 1.0, BINS + 1))
    group = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    used, group = np.unique(group, return_inverse=True)
    return np.array([x[group == k].mean() for k in range(used.size)]), None, group


class _End(NamedTuple):
    """Mean of a result at an end of a factor, half of its 95 % interval, and what the factor is there."""

    mean: float
    reach: float
    where: str


def _ends(column: pd.Series, y: np.ndarray) -> tuple[_End, _End]:
    """Return a result at both ends of a factor."""

    def end(inside: np.ndarray, where: str) -> _End:
        count = np.isfinite(y[inside]).sum()
        return _End(mean(y[inside]), NORMAL * deviation(y[inside]) / math.sqrt(count) if count > 1 else 0.0, where)

    if column.dtype.kind not in "biuf" or column.nunique() <= FEW:
        place, names, group = _levels(column)
        first, last = 0, len(place) - 1
        if names is not None:
            means = np.array([mean(y[group == k]) for k in range(len(place))])
            first, last = int(np.nanargmin(means)), int(np.nanargmax(means))
        texts = names if names is not None else [f"{value:.4g}" for value in place]
        return end(group == first, texts[first]), end(group == last, texts[last])
    x = column.to_numpy(dtype=float)
    low, high = np.quantile(x, [TAIL, 1.0 - TAIL])
    return end(x <= low, f"≤ {low:.4g}"), end(x >= high, f"≥ {high:.4g}")


def _as_numbers(column: pd.Series) -> tuple[np.ndarray, list[str] | None]:
    """Return a column as numbers: texts by their place among the different ones, which are returned too."""
    if column.dtype.kind in "biuf":
        return column.to_numpy(dtype=float), None
    names, place = np.unique(column.astype(str), return_inverse=True)
    return place.astype(float), [str(name) for name in names]


def _named(ax: Axes, x: list[str] | None, y: list[str] | None) -> None:
    if x is not None:
        ax.set_xticks(range(len(x)), x, rotation=60)
    if y is not None:
        ax.set_yticks(range(len(y)), y)


def _rank_correlation(x: np.ndarray, y: np.ndarray) -> float:
    from scipy.stats import rankdata

    good = np.isfinite(x) & np.isfinite(y)
    return _correlation(rankdata(x[good]), rankdata(y[good]))


def _correlation(x: np.ndarray, y: np.ndarray) -> float:
    good = np.isfinite(x) & np.isfinite(y)
    x, y = in_scale(x[good])[0], in_scale(y[good])[0]
    if x.size < 3 or x.std() == 0.0 or y.std() == 0.0:
        return float("nan")
    return float(np.corrcoef(x, y)[0, 1])


# Where a condition holds.


def condition_map(
    campaign: Campaign, condition: str, across: str, along: str, bins: int = 8
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return over two factors in which part of the cases a condition holds; of cases without results, and of results
    that are no numbers, it is not asked.

    Parameters
    ----------
    condition : str
        A comparison of columns of the table by their names, as ``orders.line_of_action.2 > 10``, and as a constraint is
        written.
    across, along : str
        Columns of the horizontal and the vertical axis.
    bins : int
        Of equal numbers of cases along each.

    Returns
    -------
    share, counts : ndarray, shape (bins, bins)
        Part of the cases and how many there are, rows along the vertical axis.
    edges_across, edges_along : ndarray, shape (bins + 1,)
    """
    share, counts, edges_x, edges_y, _ = _condition_map(campaign, condition, across, along, bins)
    return share, counts, edges_x, edges_y


def _condition_map(
    campaign: Campaign, condition: str, across: str, along: str, bins: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, str]:
    """Return the map, and in words which cases are left out of it."""
    table = campaign.table
    done = table[table["status"] == "done"]
    columns = {str(name): done[name].to_numpy() for name in done.columns}
    results = result_names(campaign.folder, done)
    asked = partial(
        satisfied, given=columns, unit_of=campaign.plan.unit_of, results=results, empty=campaign.plan.empty(columns)
    )
    held = asked(condition)
    # of what is compared with no number neither the condition holds nor its opposite
    known = held | asked(f"not ({condition})")
    left = say_left_out(campaign.folder, table, "map", unknown=int((~known).sum()), stacklevel=4)
    table, held = done[known], held[known]
    bins = whole(bins, "bins", 1)
    for name in (across, along):
        if name not in table.columns or table[name].dtype.kind not in "biuf":
            told = ", ".join(str(n) for n in factor_names(campaign.folder) if table[n].dtype.kind in "biuf")
            raise CampaignError(f"map: {name!r} is no column of numbers; factors that are one: {told}")
    if table.empty:
        raise CampaignError(f"map: {condition!r} can be asked of none of the cases; {left}")
    x, y = (table[name].to_numpy(dtype=float) for name in (across, along))
    edges_x, edges_y = (np.quantile(v, np.linspace(0.0, 1.0, bins + 1)) for v in (x, y))
    i = np.clip(np.searchsorted(edges_y, y, side="right") - 1, 0, bins - 1)
    j = np.clip(np.searchsorted(edges_x, x, side="right") - 1, 0, bins - 1)
    counts, hits = np.zeros((bins, bins)), np.zeros((bins, bins))
    np.add.at(counts, (i, j), 1.0)
    np.add.at(hits, (i, j), held.astype(float))
    with np.errstate(all="ignore"):
        return hits / counts, counts, edges_x, edges_y, left


def condition_figure(campaign: Campaign, condition: str, across: str, along: str, bins: int = 8) -> Picture:
    """Draw a `condition_map`: in which part of the cases a condition holds, over two factors."""
    from gearmbs.view.figures.style import label, new_figure

    share, counts, edges_x, edges_y, left = _condition_map(campaign, condition, across, along, bins)
    picture = new_figure(5.6, 4.2)
    ax = picture.subplots()
    mesh = ax.pcolormesh(edges_x, edges_y, share, vmin=0.0, vmax=1.0)
    picture.colorbar(mesh, ax=ax, label="part of the cases")
    ax.set_xlabel(label(across, campaign.units.get(across)))
    ax.set_ylabel(label(along, campaign.units.get(along)))
    held = f"{condition}: {np.nansum(share * counts) / counts.sum():.0%} of {counts.sum():.0f} cases"
    ax.set_title("\n".join(filter(None, (held, left))), fontsize=10)
    logarithmic = {f.name for f in campaign.plan.factors if getattr(f, "scale", "") == "log"}
    if across in logarithmic:
        ax.set_xscale("log")
    if along in logarithmic:
        ax.set_yscale("log")
    return picture
