"""A solution as a table for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearmbs._shown import html_table

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution


def solution_html(solution: Solution) -> str:
    """Return how a run ended, what it cost and what it is about."""
    system, stats = solution.system, solution.stats
    mechanism = getattr(system, "mechanism", None)
    name = mechanism.name if mechanism is not None else "mechanism"
    span = (
        f"{solution.t[0]:.6g} to {solution.t[-1]:.6g} s, {solution.t.size} outputs" if solution.t.size else "no outputs"
    )
    joints = list(dict.fromkeys(row.rsplit(": ", 1)[0] for row in system.row_names))
    rows = [
        ("status", solution.status.name.replace("_", " ").lower()),
        ("time", span),
        ("steps", f"{stats.steps}, {stats.residuals} residuals, {stats.jacobians} Jacobians"),
        ("solver time", f"{stats.wall_time:.3g} s"),
        ("bodies", ", ".join(system.body_names)),
        ("joints", ", ".join(joints) or "none"),
        ("forces", ", ".join(system.force_names) or "none"),
    ]
    return html_table(f"Solution of {name}", ("", ""), rows, solution.message)
