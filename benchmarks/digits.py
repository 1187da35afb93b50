"""Digits against the published and exact solutions, unknown by unknown."""

from __future__ import annotations

import math
from collections.abc import Callable

from benchmarks.markdown import number, table
from benchmarks.problems.reference import reference_problems
from gearmbs.dae.integrators.ida import solve_ida
from gearmbs.dae.integrators.wstiff import solve_wstiff

TITLE = "Digits against the reference solutions"
PUBLISHED = ("car axis", "Andrews")
TOLERANCES = (1e-6, 1e-8, 1e-10)
RUNS = {"WSTIFF": ("SI2", "SI1", "I3"), "IDA": ("SI2", "SI1")}


def digits(value: float, exact: float) -> float:
    """Return minus log10 of a value's error relative to the larger of one and the reference."""
    error = abs(value - exact) / max(1.0, abs(exact))
    return -math.log10(error) if error > 0.0 else 16.0


def _run(name: str, integrator: str, formulation: str, tol: float) -> dict:
    reference = reference_problems()[name]
    problem = reference.make(formulation)
    solve = solve_ida if integrator == "IDA" else solve_wstiff
    result = solve(problem, reference.times, tol=tol)
    row = {"problem": name, "integrator": integrator, "formulation": formulation, "tolerance": tol}
    if not result.success:
        return {**row, "failed": result.message}
    values = result.y[:, reference.columns]
    every = [digits(v, e) for v, e in zip(values.ravel(), reference.reference.ravel(), strict=True)]
    return {
        **row,
        "source": reference.source,
        "digits": min(every),
        "steps": result.stats.steps,
        "unknowns": [problem.names[c] for c in reference.columns],
        "values": values[-1].tolist(),
        "reference": reference.reference[-1].tolist(),
    }


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each part."""
    parts: list[tuple[str, Callable[[], dict]]] = []
    for name in PUBLISHED if quick else reference_problems():
        for integrator, formulations in RUNS.items():
            for formulation in formulations:
                for tol in TOLERANCES:
                    parts.append(
                        (
                            f"{name} - {integrator} {formulation} {tol:g}",
                            lambda a=(name, integrator, formulation, tol): _run(*a),
                        )
                    )
    return parts


def finish(results: list[dict]) -> dict:
    """Return nothing: the parts say it all."""
    return {}


def render(extra: dict) -> str:
    """Return the tables in Markdown."""
    results = extra["results"]
    names = list(dict.fromkeys(r["problem"] for r in results))
    rows = []
    for name in names:
        for integrator, formulations in RUNS.items():
            for formulation in formulations:
                mine = {
                    r["tolerance"]: r
                    for r in results
                    if (r["problem"], r["integrator"], r["formulation"]) == (name, integrator, formulation)
                }
                if mine:
                    found = [mine.get(tol, {}) for tol in TOLERANCES]
                    rows.append(
                        [f"{name}, {integrator} {formulation}"]
                        + [number(r["digits"], 2) if "digits" in r else "failed" for r in found]
                    )
    lines = [
        "Fewest correct digits of all positions and velocities at all reference times (index 3 controls errors of "
        "positions only), by tolerance.\n",
        table(["problem, method", *(f"{tol:g}" for tol in TOLERANCES)], rows),
    ]
    for name in names:
        best = next(
            (
                r
                for r in results
                if (r["problem"], r["integrator"], r["formulation"], r["tolerance"])
                == (name, "WSTIFF", "SI2", TOLERANCES[-1])
                and "values" in r
            ),
            None,
        )
        if name not in PUBLISHED or best is None:
            continue
        rows = [
            [unknown, f"{exact:.12g}", f"{value:.12g}", number(digits(value, exact), 2)]
            for unknown, exact, value in zip(best["unknowns"], best["reference"], best["values"], strict=True)
        ]
        lines.append(f"### {name}: end values, WSTIFF SI2 at {TOLERANCES[-1]:g}, {best['steps']} steps\n")
        lines.append(table(["unknown", "published", "WSTIFF", "digits"], rows))
    return "\n".join(lines)
