"""The report of a campaign as one HTML page: plan, what varies, what decides it, failures."""

from __future__ import annotations

import base64
import html
import io
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.figures import deviation, varied_results
from gearmbs.campaigns.results import factor_names, numeric_results, only_numbers, result_names, say_left_out
from gearmbs.campaigns.sensitivity import SobolIndices, sensitivity
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, texts
from gearmbs.campaigns.sobol_bounds import first_indices, in_scale, probability
from gearmbs.campaigns.stored.exports import place
from gearmbs.campaigns.surrogates import PolynomialChaos
from gearmbs.files import write_whole
from gearmbs.schema.described import chosen
from gearmbs.view.figures.style import label, unit_text

if TYPE_CHECKING:
    import pandas as pd

    from gearmbs.campaigns.campaign import Campaign

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:1em 0;font-size:14px}td,th{border-bottom:1px solid #ddd;padding:3px
10px;text-align:right}
td:first-child,th:first-child{text-align:left}img{max-width:100%}h2{margin-top:2em}small{color:#666}"""
MOST_RESULTS = 4
SHOWN_FAILURES = 50


SHOWN_RESULTS = 40
"""Rows of the table of all results."""


def write_report(campaign: Campaign, path: str | Path, results: str | Sequence[str] | None = None) -> Path:
    """Write the report of a campaign.

    Parameters
    ----------
    path : path-like
    results : str or sequence of str, optional
        Columns to look at; default those that vary most, each for what the others do not tell.

    Raises
    ------
    CampaignError
        If the path is a folder, or for an unknown column.

    Warns
    -----
    CampaignWarning
        If cases are not done or failed; the page says it, too.
    """
    path = place(path, ".html", campaign.path.stem)
    table = only_numbers(campaign.folder, campaign.table)
    known = result_names(campaign.folder, table)
    results = varied_results(campaign, MOST_RESULTS) if results is None else list(texts(results, "report: results"))
    for name in results:
        chosen(known, name, "report: ", CampaignError, "result")
    left = say_left_out(campaign.folder, table, "report", stacklevel=4)
    parts = [f"<h1>{html.escape(campaign.path.name)}</h1>", f"<p><b>{left}</b></p>" if left else "", _plan(campaign)]
    with warnings.catch_warnings():
        # what the page says itself
        warnings.filterwarnings("ignore", "figure of|polynomial chaos", CampaignWarning)
        parts += _asked(campaign, table, results)
    parts.append(_failures(campaign))
    head = f"<meta charset='utf-8'><title>{html.escape(campaign.path.name)}</title><style>{STYLE}</style>"
    return write_whole(path, f"<!doctype html><html><head>{head}</head><body>{''.join(parts)}</body></html>\n")


def _asked(campaign: Campaign, table: pd.DataFrame, results: list[str]) -> list[str]:
    """Return what there is to see of some results."""
    parts = []
    if results:
        parts += ["<h2>What varies</h2>", _all_results(campaign, table, results)]
        parts += [_picture(campaign.figure(kind, results), kind) for kind in ("scatter matrix", "parallel coordinates")]
    for name in results:
        title = label(name, campaign.units.get(name))
        parts += [f"<h2>{html.escape(title)}</h2>", _numbers(table[name])]
        parts += [_picture(campaign.figure(kind, name), f"{kind} of {name}") for kind in ("main effects", "tornado")]
        parts.append(_decides(campaign, name))
    return parts


def _all_results(campaign: Campaign, table: pd.DataFrame, shown: list[str]) -> str:
    """Return the results that vary with their spread, the most varied first."""
    names = numeric_results(campaign.folder, table)
    values = table[names].astype(float)
    scaled = values.apply(lambda column: in_scale(column.to_numpy())[0])
    with np.errstate(all="ignore"):
        share = (scaled.std() / np.sqrt((scaled**2).mean())).fillna(0.0)
    order = share[share > 0.0].sort_values(ascending=False).index
    rows = ""
    for name in order[:SHOWN_RESULTS]:
        told = f"<b>{html.escape(str(name))}</b>" if name in shown else html.escape(str(name))
        cells = (values[name].mean(), deviation(values[name].to_numpy()), values[name].min(), values[name].max())
        numbers = "".join(f"<td>{v:.4g}</td>" for v in cells)
        rows += (
            f"<tr><td>{told}</td><td>{unit_text(campaign.units.get(name))}</td>{numbers}<td>{share[name]:.1%}</td></tr>"
        )
    heads = "".join(f"<th>{n}</th>" for n in ("result", "unit", "mean", "deviation", "least", "largest", "of its RMS"))
    more = f" of {len(order)}" if len(order) > SHOWN_RESULTS else ""
    note = (
        f"<p>{min(len(order), SHOWN_RESULTS)}{more} results by their standard deviation over their RMS; bold are those "
    )
    note += "looked at below, each of which tells what those before it do not (correlations below 0.95).</p>"
    return f"{note}<table><tr>{heads}</tr>{rows}</table>"


def _plan(campaign: Campaign) -> str:
    plan, status = campaign.plan, campaign.status()
    spans = ((f.name, f"{_span(f)} {unit_text(campaign.units.get(f.name))}".strip()) for f in plan.factors)
    rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{html.escape(span)}</td></tr>" for name, span in spans)
    about = (
        f"<p>{html.escape(plan.subject.kind)}, {html.escape(plan.design)} design, seed {plan.seed}. "
        f"{html.escape(str(status))}. "
        f"{status.processor_seconds:.4g} s of processor time.</p>"
    )
    return f"{about}<table><tr><th>factor</th><th>range</th></tr>{rows}</table>"


def _span(factor: Any) -> str:
    if getattr(factor, "values", ()):
        return ", ".join(str(v) for v in factor.values)
    if hasattr(factor, "low"):
        return f"{factor.low:.5g} to {factor.high:.5g}" + (", logarithmic" if factor.scale == "log" else "")
    return ", ".join(factor.options) if hasattr(factor, "options") else f"{factor.draws} specimens"


def _numbers(values: pd.Series) -> str:
    q = values.quantile([0.0, 0.05, 0.5, 0.95, 1.0])
    cells = "".join(f"<td>{v:.5g}</td>" for v in (values.mean(), deviation(values.to_numpy(dtype=float)), *q))
    heads = "".join(f"<th>{n}</th>" for n in ("mean", "deviation", "least", "5 %", "median", "95 %", "largest"))
    missing = int(values.isna().sum())
    note = f"<p>{missing} of {values.size} cases have no such number.</p>" if missing else ""
    return f"{note}<table><tr>{heads}</tr><tr>{cells}</tr></table>"


def _decides(campaign: Campaign, result: str) -> str:
    """Return what decides the result, where the design tells, else a response surface."""
    try:
        found = sensitivity(campaign, result)
    except CampaignError:
        return _at_hand(campaign, result) + _surface(campaign, result)
    if isinstance(found, PolynomialChaos):
        note = (
            f"<p><small>A sum of polynomials of degree {found.degrees.sum(axis=1).max()}; of points left out it "
            f"explains {found.q_squared:.1%} of the variance.</small></p>"
        )
        heading = "<h3>Sobol' indices from a polynomial chaos</h3>"
        return _at_hand(campaign, result) + heading + _table(found.table()) + note + _surface(campaign, result)
    if isinstance(found, SobolIndices):
        if campaign.plan.design == "grid":
            return "<h3>Parts of the grid's variance</h3>" + _table(found.table()[["first", "total"]])
        note = f"<p><small>{found.base_points} base points, {found.left_out} left out for want of results; "
        note += f"control variates explain {found.explained:.1%} of the variance of points left out.</small></p>"
        return "<h3>Sobol' indices</h3>" + _table(found.table()) + note
    if campaign.plan.design == "one at a time":
        return "<h3>One factor after the other</h3>" + _table(found)
    return "<h3>Effects</h3>" + _table(found.head(20))


def _at_hand(campaign: Campaign, result: str) -> str:
    """Return first indices from the points at hand, and for a condition how probable it is."""
    table = campaign.table
    values = table[result].to_numpy(dtype=float)
    text = ""
    if set(np.unique(values[np.isfinite(values)])) <= {0.0, 1.0}:
        p, low, high = probability(values)
        text = f"<p>Holds in {p:.1%} of the points (95 % interval {low:.1%} to {high:.1%}).</p>"
    found = first_indices({name: table[name].to_numpy() for name in factor_names(campaign.folder)}, values)
    return f"{text}<h3>First Sobol' indices from the points at hand</h3>" + _table(found)


def _surface(campaign: Campaign, result: str) -> str:
    from gearmbs.campaigns.surrogates import response_surface, untold

    for degree in (2, 1):
        try:
            surface = response_surface(campaign, result, degree)
        except CampaignError:
            continue
        table = surface.table()
        table = table.reindex(table["coefficient"].abs().sort_values(ascending=False).index).head(12)
        left_out = f"of points left out {surface.q_squared:.3f}, RMS error there {surface.error:.3g}"
        if surface.alone:
            left_out = html.escape(untold(surface))
        note = f"<p>R<sup>2</sup> = {surface.r_squared:.3f}, {left_out}.</p>"
        return f"<h3>Response surface of degree {degree}, factors from -1 to 1</h3>{note}" + _table(table)
    return ""


def _failures(campaign: Campaign) -> str:
    failed = campaign.failed()
    if failed.empty:
        return "<h2>Failures</h2><p>none</p>"
    shown = failed[["index", "status", "message", "advice"]].head(SHOWN_FAILURES)
    rows = "".join("<tr>" + "".join(f"<td>{html.escape(str(v))}</td>" for v in row) + "</tr>" for row in shown.values)
    return f"<h2>Failures</h2><p>{len(failed)} cases</p><table>{rows}</table>"


def _table(table: pd.DataFrame) -> str:
    index = ", ".join(str(name) for name in table.index.names)
    heads = "".join(f"<th>{html.escape(str(c))}</th>" for c in (index, *table.columns))
    rows = "".join(
        f"<tr><td>{html.escape(_label(name))}</td>" + "".join(f"<td>{_cell(v)}</td>" for v in row) + "</tr>"
        for name, row in zip(table.index, table.to_numpy(dtype=object))
    )
    return f"<table><tr>{heads}</tr>{rows}</table>"


def _cell(value: Any) -> str:
    return html.escape(value) if isinstance(value, str) else f"{float(value):.4g}"


def _label(name: Any) -> str:
    parts = name if isinstance(name, tuple) else (name,)
    return ", ".join(f"{part:.5g}" if isinstance(part, float) else str(part) for part in parts)


def _picture(figure: Any, text: str) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f"<img alt='{html.escape(text)}' src='data:image/png;base64,{data}'>"
