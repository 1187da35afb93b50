"""Cost against size: time per step of chains of four-bar linkages, and their singular positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.machine import version_of
from benchmarks.markdown import number, table
from benchmarks.methods.base import RunFailed
from benchmarks.methods.exudyn_peer import model_of, simulate
from benchmarks.problems.reference import chain_problem
from benchmarks.timing import measure
from gearmbs.dae.integrators.ida import solve_ida
from gearmbs.dae.integrators.wstiff import solve_wstiff

TITLE = "Cost against size: chains of N four-bar linkages"
SIZES = (5, 10, 20, 40, 80, 160)
QUICK_SIZES = (5, 10, 20)
SPAN = 5.0
"""Simulated seconds: the links pass the singular positions seven times."""
TOLERANCE = 1e-5
EXUDYN_STEPS = 1000
GRID_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)
GRID_SPAN = 2.0
REPEATS = 5


def _ours(loops: int, method: str) -> dict:
    reference = chain_problem(loops, SPAN)
    problem = reference.make("SI2")
    solve = solve_ida if method == "IDA" else solve_wstiff

    def run():
        return solve(problem, reference.times, tol=TOLERANCE)

    run()
    timing, result = measure(run, REPEATS, 4.0)
    row = {"method": method, "loops": loops, "links": 2 * loops + 1, "unknowns": problem.n}
    if not result.success:
        return {**row, "failed": result.message}
    per_step = timing.cpu / result.stats.steps
    return {
        **row,
        "steps": result.stats.steps,
        "seconds": timing.cpu,
        "us_per_step": 1e6 * per_step,
        "us_per_link_and_step": 1e6 * per_step / row["links"],
        "error": reference.error(result.t, result.y),
    }


def _exudyn(loops: int) -> dict:
    row = {"method": "Exudyn", "loops": loops, "links": 2 * loops + 1}
    if version_of("exudyn") is None:
        return {**row, "skipped": "exudyn is not installed"}
    reference = chain_problem(loops, SPAN)
    model = model_of(reference)
    model.grid = SPAN / 4
    best = None
    for sparse in (False, True):
        if not sparse and loops > 20:
            continue
        try:
            timing, _ = measure(
                lambda sparse=sparse: simulate(model, SPAN, EXUDYN_STEPS, "generalized alpha", sparse), 2, 4.0
            )
        except RunFailed as why:
            row["failed"] = str(why)
            continue
        if best is None or timing.fastest < best:
            best = timing.fastest
    if best is None:
        return row
    row.pop("failed", None)
    exact = reference.reference
    values = model.values(reference.times)
    return {
        **row,
        "steps": EXUDYN_STEPS,
        "seconds": best,
        "us_per_step": 1e6 * best / EXUDYN_STEPS,
        "us_per_link_and_step": 1e6 * best / EXUDYN_STEPS / row["links"],
        "error": float(np.max(np.abs(values - exact) / np.maximum(1.0, np.abs(exact)))),
    }


def _singular_positions(loops: int) -> dict:
    """Run every formulation and corrector at every tolerance through the positions where all links lie in line."""
    failed, runs, worst = [], 0, 0.0
    reference = chain_problem(loops, GRID_SPAN)
    for formulation in ("SI2", "SI1", "I3"):
        problem = reference.make(formulation)
        for corrector in ("original", "modified"):
            for tol in GRID_TOLERANCES:
                result = solve_wstiff(problem, reference.times, tol=tol, corrector=corrector, max_steps=50_000)
                runs += 1
                if not result.success:
                    failed.append(f"{formulation}, {corrector}, {tol:g}: {result.status.name}")
                elif formulation != "I3" and corrector == "original":
                    worst = max(worst, reference.error(result.t, result.y) / tol)
    return {"singular": True, "loops": loops, "runs": runs, "failed": failed, "worst_error_over_tolerance": worst}


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each part."""
    parts: list[tuple[str, Callable[[], dict]]] = []
    for loops in QUICK_SIZES if quick else SIZES:
        parts.append((f"chain N={loops} - WSTIFF", lambda loops=loops: _ours(loops, "WSTIFF")))
        parts.append((f"chain N={loops} - IDA", lambda loops=loops: _ours(loops, "IDA")))
        parts.append((f"chain N={loops} - Exudyn", lambda loops=loops: _exudyn(loops)))
        parts.append((f"chain N={loops} - singular positions", lambda loops=loops: _singular_positions(loops)))
    return parts


def exponent(rows: list[dict]) -> float | None:
    """Return the slope of time per step over the number of links on logarithmic scales."""
    if len(rows) < 2:
        return None
    links = np.log([r["links"] for r in rows])
    return float(np.polyfit(links, np.log([r["us_per_step"] for r in rows]), 1)[0])


def finish(results: list[dict]) -> dict:
    """Return the fitted exponents and the count of failures at singular positions."""
    methods = dict.fromkeys(r["method"] for r in results if "us_per_step" in r)
    grid = [r for r in results if r.get("singular")]
    return {
        "exponents": {
            m: exponent([r for r in results if r.get("method") == m and "us_per_step" in r]) for m in methods
        },
        "singular_runs": sum(r["runs"] for r in grid),
        "singular_failures": [f"N={r['loops']}: {text}" for r in grid for text in r["failed"]],
    }


def render(extra: dict) -> str:
    """Return the tables in Markdown."""
    results = extra["results"]
    header = ["method", "N", "links", "unknowns", "steps", "us per step", "us per link and step", "error at the end"]
    rows, notes = [], []
    for method in dict.fromkeys(r["method"] for r in results if "method" in r):
        for r in results:
            if r.get("method") != method:
                continue
            if "us_per_step" not in r:
                notes.append(f"* {method}, N = {r['loops']}: {r.get('failed') or r.get('skipped')}")
                continue
            rows.append(
                [
                    method,
                    str(r["loops"]),
                    str(r["links"]),
                    str(r.get("unknowns", "-")),
                    str(r["steps"]),
                    number(r["us_per_step"]),
                    number(r["us_per_link_and_step"]),
                    number(r["error"], 2),
                ]
            )
    lines = [
        f"SI2 at a tolerance of {TOLERANCE:g} over {SPAN:g} s; Exudyn with {EXUDYN_STEPS} steps of generalised alpha, "
        "index 3, the faster of its dense and sparse solvers.\n",
        table(header, rows),
        "Exponent of time per step over the number of links: "
        + ", ".join(f"{m} {number(e)}" for m, e in extra["exponents"].items())
        + ".\n",
        f"Singular positions: {extra['singular_runs']} runs of WSTIFF in three formulations, both correctors and "
        f"tolerances {GRID_TOLERANCES[0]:g} to {GRID_TOLERANCES[-1]:g}; "
        + (f"{len(extra['singular_failures'])} failed." if extra["singular_failures"] else "none failed.")
        + "\n",
    ]
    lines += [f"* {text}" for text in extra["singular_failures"]]
    return "\n".join(lines + notes) + "\n"
