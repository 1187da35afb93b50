"""``gearmbs identify``: parameters from recordings on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearmbs._command import guarded


def identify(
    file: Annotated[Path, typer.Argument(help="Fit in TOML: recordings, cases, what is free.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write the report here instead of printing it.")
    ] = None,
    only_check: Annotated[
        bool, typer.Option("--only-check", help="Only tell what the recordings can tell of the parameters.")
    ] = False,
    experiments: Annotated[
        bool,
        typer.Option(help="Rank further measurements, the file's [experiment.NAME] or usual ones, by what they add."),
    ] = False,
    profiles: Annotated[bool, typer.Option(help="Intervals from profiles, too: more simulations.")] = False,
) -> None:
    """Find parameters of cases from recordings, with their errors; tell what cannot be found."""
    with guarded():
        from gearmbs.files import write_whole
        from gearmbs.identify.measured import load_problem

        problem, settings = load_problem(file)
        found = problem.identifiability()
        text = ["# What the measurement can tell", "", *_rows(found.table()), ""]
        text += [f"* {line}" for line in found.remarks()] or ["* every parameter is determined"]
        if experiments:
            from gearmbs.identify.experiments import rank_experiments

            ranked = rank_experiments(problem, settings["experiments"])
            text += ["", "# What further measurements would add", "", *_rows(ranked), ""]
        if not only_check:
            result = problem.fit(starts=settings["starts"])
            text += ["", "# Fit", "", result.report(), f"{problem.simulations} simulations."]
            if profiles:
                text += ["", "# Intervals from profiles", ""]
                for name in result.names:
                    low, high = result.profile_interval(name, points=7)
                    text.append(f"* {name}: {low:.5g} to {high:.5g}")
        report = "\n".join(text) + "\n"
        if out is None:
            typer.echo(report)
        else:
            write_whole(out, report)
            typer.echo(f"wrote {out}")


def _rows(table) -> list[str]:
    """Return a table as Markdown."""
    lines = [f"| {table.index.name} | " + " | ".join(table.columns) + " |", "|---" * (len(table.columns) + 1) + "|"]
    for name, row in table.iterrows():
        cells = [f"{v:.3g}" if isinstance(v, float) else str(v) for v in row]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return lines
