"""Error against time on the standard problems, for our integrators and the peers that are installed."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable

import numpy as np

from benchmarks.markdown import milliseconds, number, table
from benchmarks.methods import assimulo_peer, exudyn_peer, ours, solve_dae_peer
from benchmarks.methods.base import Method, NotPossible, RunFailed
from benchmarks.problems.reference import ReferenceProblem, chain_problem, reference_problems
from benchmarks.timing import measure

TITLE = "Error against time on standard problems"
TARGETS = (1e-4, 1e-6)
BASE = "WSTIFF"
OWN = ("WSTIFF", "GSTIFF")
AIM = 3.0
"""How many times slower every other method should be."""
FINEST = 2e-8
"""Error at which a sweep ends."""
SLOWEST = 1.0
"""Seconds of a single run after which a sweep ends."""
REPEATS = 7
BUDGET = 0.3
CHAINS = (2, 40, 160)
CHAIN_SPAN = 2.0
QUICK_PROBLEMS = ("pendulum", "slider crank")
QUICK_KNOBS = 4


def all_methods() -> list[Method]:
    """Return every method, installed or not."""
    return [*ours.methods(), *solve_dae_peer.methods(), *assimulo_peer.methods(), *exudyn_peer.methods()]


def problems(quick: bool) -> list[ReferenceProblem]:
    """Return the problems, the chain in several lengths."""
    known = reference_problems()
    if quick:
        return [known[name] for name in QUICK_PROBLEMS]
    return [*known.values(), *(chain_problem(n, CHAIN_SPAN) for n in CHAINS)]


def error_of(reference: ReferenceProblem, values: np.ndarray) -> float:
    """Return the largest error of positions and velocities, relative to the larger of one and the reference."""
    exact = reference.reference
    return float(np.max(np.abs(values - exact) / np.maximum(1.0, np.abs(exact))))


def sweep(reference: ReferenceProblem, method: Method, knobs: tuple[float, ...] | None = None) -> dict:
    """Run a method from coarse to fine until it is accurate or slow enough; one row for each setting."""
    if method.missing:
        return {"skipped": method.missing}
    try:
        run = method.prepare(reference)
    except NotPossible as why:
        return {"skipped": str(why)}
    rows: list[dict] = []
    chosen = method.knobs if knobs is None else knobs
    with contextlib.suppress(RunFailed):
        # compiles, imports and fills caches
        run(chosen[0])
    for knob in chosen:
        try:
            timing, result = measure(lambda knob=knob: run(knob), REPEATS, BUDGET)
        except RunFailed as why:
            rows.append({method.knob: knob, "failed": str(why)})
            if any("error" in row for row in rows) and "failed" in rows[-2]:
                break
            continue
        error = error_of(reference, result.values)
        rows.append({method.knob: knob, "error": error, **timing.as_dict(), **result.counts})
        if error < FINEST or timing.cpu > SLOWEST:
            break
    return {"rows": rows}


def front(rows: list[dict]) -> list[tuple[float, float]]:
    """Return (time, error) of the settings no other one beats in both, slowest last."""
    best: list[tuple[float, float]] = []
    for time, error in sorted((r["cpu"], r["error"]) for r in rows if "error" in r and math.isfinite(r["error"])):
        if not best or error < best[-1][1]:
            best.append((time, error))
    return best


def time_at(rows: list[dict], target: float) -> float | None:
    """Return the time at an error, between the two nearest settings on logarithmic scales; None if never reached."""
    points = front(rows)
    for i, (time, error) in enumerate(points):
        if error <= target:
            if i == 0:
                return time
            t0, e0 = points[i - 1]
            part = math.log(e0 / target) / math.log(e0 / error)
            return t0 * (time / t0) ** part
    return None


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each part: one problem with one method."""
    parts = []
    for reference in problems(quick):
        for method in all_methods():
            if quick and method.name.startswith("GSTIFF"):
                continue
            knobs = method.knobs[2::3][:QUICK_KNOBS] if quick else None
            parts.append(
                (
                    f"{reference.name} - {method.name}",
                    lambda reference=reference, method=method, knobs=knobs: {
                        "problem": reference.name,
                        "source": reference.source,
                        "method": method.name,
                        "family": method.family,
                        **sweep(reference, method, knobs),
                    },
                )
            )
    return parts


def summary(results: list[dict]) -> list[dict]:
    """Return for each problem and family the best times at the targets and the ratios to WSTIFF."""
    out = []
    for problem in dict.fromkeys(r["problem"] for r in results):
        mine = [r for r in results if r["problem"] == problem and "rows" in r]
        best: dict[str, dict[float, tuple[float, str]]] = {}
        for r in mine:
            family = best.setdefault(r["family"], {})
            for target in TARGETS:
                t = time_at(r["rows"], target)
                if t is not None and (target not in family or t < family[target][0]):
                    family[target] = (t, r["method"])
        for family, times in best.items():
            row: dict = {"problem": problem, "family": family}
            for target in TARGETS:
                t, which = times.get(target, (None, None))
                base = best.get(BASE, {}).get(target, (None,))[0]
                row[f"{target:g}"] = {
                    "seconds": t,
                    "method": which,
                    "ratio": None if t is None or base is None else t / base,
                }
            out.append(row)
    return out


def skipped(results: list[dict]) -> dict[str, list[str]]:
    """Return what was left out: method and reason with the problems."""
    reasons: dict[str, list[str]] = {}
    for r in results:
        if "skipped" in r:
            reasons.setdefault(f"{r['method']}: {r['skipped']}", []).append(r["problem"])
    return reasons


def failures(results: list[dict]) -> list[dict]:
    """Return the runs that ended early."""
    return [
        {"problem": r["problem"], "method": r["method"], "setting": next(iter(row.items())), "why": row["failed"]}
        for r in results
        for row in r.get("rows", ())
        if "failed" in row
    ]


def points(results: list[dict]) -> dict[str, dict[str, list[tuple[float, float]]]]:
    """Return for each problem and family the pairs of time and error that no other setting beats in both."""
    rows: dict[str, dict[str, list[dict]]] = {}
    for r in results:
        if r.get("rows"):
            rows.setdefault(r["problem"], {}).setdefault(r["family"], []).extend(r["rows"])
    fronts = {problem: {family: front(mine) for family, mine in by.items()} for problem, by in rows.items()}
    return {problem: {family: best for family, best in by.items() if best} for problem, by in fronts.items()}


def finish(results: list[dict]) -> dict:
    """Return all that the tables and the figure show."""
    return {
        "summary": summary(results),
        "sources": {r["problem"]: r["source"] for r in results},
        "points": points(results),
        "failures": failures(results),
        "skipped": skipped(results),
    }


def short_of(extra: dict, aim: float) -> list[str]:
    """Return a line for each other package and target whose time is less than ``aim`` times that of WSTIFF."""
    lines = []
    for row in extra["summary"]:
        for target in TARGETS:
            ratio = row[f"{target:g}"]["ratio"]
            if row["family"] not in OWN and ratio is not None and ratio < aim:
                lines.append(f"{row['problem']} at {target:g}: {row['family']} {number(ratio, 2)}")
    return lines


def _cell(entry: dict) -> list[str]:
    if entry["seconds"] is None:
        return ["not reached", "-", "-"]
    return [milliseconds(entry["seconds"]), number(entry["ratio"], 2), entry["method"]]


def render(extra: dict) -> str:
    """Return the tables in Markdown."""
    lines = [
        "Milliseconds of processor time, medians of repeated warm runs; the best formulation of each family. "
        "The ratio is to WSTIFF: above one the method is slower. A sweep ends where a run takes more than "
        f"{SLOWEST:g} s.\n"
    ]
    header = ["method"]
    for target in TARGETS:
        header += [f"ms at {target:g}", "ratio", "as"]
    for problem, source in extra["sources"].items():
        rows = [
            [row["family"], *(c for target in TARGETS for c in _cell(row[f"{target:g}"]))]
            for row in extra["summary"]
            if row["problem"] == problem
        ]
        lines.append(f"### {problem}\n\nReference: {source}.\n\n{table(header, rows)}")
    for aim, text in ((1.0, "Faster than WSTIFF"), (AIM, f"Less than {AIM:g} times slower than WSTIFF")):
        near = short_of(extra, aim)
        lines.append(f"{text}: {'; '.join(near) if near else 'none'}.\n")
    if extra["failures"]:
        lines.append("Runs that failed:\n")
        grouped: dict[tuple[str, str], list[dict]] = {}
        for f in extra["failures"]:
            grouped.setdefault((f["problem"], f["method"]), []).append(f)
        for (problem, method), mine in grouped.items():
            values = ", ".join(f"{f['setting'][1]:g}" for f in mine)
            lines.append(f"* {problem}, {method}, {mine[0]['setting'][0]} {values}: {_first_sentence(mine[0]['why'])}")
        lines.append("")
    if extra["skipped"]:
        lines.append("Left out:\n")
        lines += [f"* {reason} ({', '.join(names)})" for reason, names in extra["skipped"].items()]
        lines.append("")
    return "\n".join(lines)


def _first_sentence(text: str) -> str:
    return " ".join(text.split()).partition(". ")[0].rstrip(".") + "."
