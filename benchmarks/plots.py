"""Figures of the results."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks import precision
from gearmbs.view.figures.style import COLOURS, GREY, look, new_figure, save_figure

MARKS = "osD^vP*X"


def _styles(families: list[str]) -> dict[str, dict]:
    return {
        f: {"color": COLOURS[i % len(COLOURS)], "marker": MARKS[i % len(MARKS)], "markersize": 3.5}
        for i, f in enumerate(families)
    }


def precision_figure(extra: dict) -> Figure:
    """Error against time, one panel for each problem; each line is the best of a family's formulations."""
    problems = extra["points"]
    families = list(dict.fromkeys(family for by in problems.values() for family in by))
    styles = _styles(families)
    columns = min(3, len(problems))
    lines = -(-len(problems) // columns)
    with look():
        figure = new_figure(3.4 * columns + 0.3, 2.8 * lines + 0.7)
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for ax, (problem, by) in zip(panels, problems.items(), strict=False):
            for family, points in by.items():
                time, error = np.array(points).T
                ax.loglog(1e3 * time, error, label=family, **styles[family])
            for target in precision.TARGETS:
                ax.axhline(target, color=GREY, linewidth=0.8, linestyle=":")
            ax.set_ylim(1e-9, 10.0)
            ax.set_title(problem)
            ax.set_xlabel("time, ms")
            ax.set_ylabel("error")
        for ax in panels[len(problems) :]:
            ax.set_axis_off()
        handles = {h.get_label(): h for ax in panels for h in ax.get_lines() if not h.get_label().startswith("_")}
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4)
    return figure


def size_figure(results: list[dict], extra: dict) -> Figure:
    """Time per step over the number of links."""
    methods = list(dict.fromkeys(r["method"] for r in results if "us_per_step" in r))
    styles = _styles(methods)
    with look():
        figure = new_figure(5.2, 3.6)
        ax = figure.subplots()
        for method in methods:
            rows = [r for r in results if r.get("method") == method and "us_per_step" in r]
            slope = extra["exponents"][method]
            name = method if slope is None else f"{method}, exponent {slope:.2f}"
            ax.loglog([r["links"] for r in rows], [r["us_per_step"] for r in rows], label=name, **styles[method])
        ax.set_xlabel("links")
        ax.set_ylabel("time per step, µs")
        ax.legend()
    return figure


def gear_figure(results: list[dict]) -> Figure:
    """Microseconds of a step by part, stacked."""
    rows = [r for r in results if "us_per_step" in r and r["tolerance"] == 1e-7]
    parts = list(dict.fromkeys(name for r in rows for name in r["us_per_step"]))
    labels = [f"{r['state']}, {r['load']}, {r['integrator']}" for r in rows]
    with look():
        figure = new_figure(6.4, 0.32 * len(rows) + 1.2)
        ax = figure.subplots()
        left = np.zeros(len(rows))
        for i, part in enumerate(parts):
            width = np.array([max(0.0, r["us_per_step"].get(part, 0.0)) for r in rows])
            ax.barh(labels, width, left=left, color=COLOURS[i], label=part)
            left += width
        ax.invert_yaxis()
        ax.set_xlabel("µs per step")
        figure.legend(loc="outside lower center", ncols=len(parts))
    return figure


def figure_of(part: str, outcome: dict) -> Figure | None:
    """Return the figure of a part's outcome, or None if it has none or nothing to show."""
    if part == "precision" and outcome["points"]:
        return precision_figure(outcome)
    if part == "size" and outcome["exponents"]:
        return size_figure(outcome["results"], outcome)
    if part == "gear" and any("us_per_step" in r for r in outcome["results"]):
        return gear_figure(outcome["results"])
    return None


def write(part: str, outcome: dict, folder: Path) -> list[Path]:
    """Write the figure of a part, if it has one, and return its files."""
    figure = figure_of(part, outcome)
    return [] if figure is None else save_figure(figure, folder / part)
