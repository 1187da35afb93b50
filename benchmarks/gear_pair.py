"""The gear cases with WSTIFF and IDA: speed, counts a mesh cycle, where a step's time goes, memory, agreement."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba import njit

from benchmarks.markdown import number, table
from benchmarks.timing import seconds_per_call
from gearmbs.dae.linalg.entry_lists import NEGLIGIBLE, NEGLIGIBLE_IN_NEWTON
from gearmbs.dae.linalg.lu_plan import analyse
from gearmbs.dae.linalg.sparse_lu import factor, new_factors
from gearmbs.dae.linalg.sparse_lu import solve as substitute
from gearmbs.studies import Case, simulate_case
from gearmbs.studies.run.simulation import record

TITLE = "Gear cases: WSTIFF and IDA"
STATES = {
    "healthy": {},
    "misaligned": {"misalignment": "1 deg"},
    "+3 mm": {"centre_distance_error": "3 mm"},
}
LOADS = ("100 N m", "200 N m")
TOLERANCES = {"WSTIFF": (1e-6, 3e-7, 1e-7, 3e-8), "IDA": (1e-6, 1e-7, 3e-8, 1e-8)}
REFERENCE = ("WSTIFF", 1e-9)
QUICK_TOLERANCES = {"WSTIFF": (3e-7, 1e-7), "IDA": (1e-7,)}
DURATION = 1.0
QUICK_DURATION = 0.08
DEFAULTS = {"WSTIFF": 1e-7, "IDA": 1e-8}
"""Tolerances of the study, at which all its cases are converged."""
LIMIT = 0.005
"""Accuracy asked of the RMS of the mesh harmonics."""
COMPONENTS = ["line_of_action", "line_of_centres", "tangential"]


class PeakMemory:
    """Growth of the process's resident memory inside a ``with`` block, in MB; None where the system does not tell."""

    STATUS = Path("/proc/self/status")

    def __enter__(self) -> PeakMemory:
        self.grown: float | None = None
        with contextlib.suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
        self._before = self._read("VmRSS")
        return self

    def __exit__(self, *exc) -> None:
        peak = self._read("VmHWM")
        if peak is not None and self._before is not None:
            self.grown = peak - self._before

    def _read(self, name: str) -> float | None:
        try:
            for line in self.STATUS.read_text().splitlines():
                if line.startswith(name + ":"):
                    return float(line.split()[1]) / 1024
        except OSError:
            pass
        return None


PLACES = 9
"""Outputs of a run whose matrices tell which entries count."""


@njit
def _residuals(n, residual, t, y, yp, out, idata, rdata, work):
    for _ in range(n):
        residual(t, y, yp, out, idata, rdata, work)


@njit
def _jacobians(n, jacobian, t, y, yp, vals, idata, rdata, work):
    for _ in range(n):
        jacobian(t, y, yp, 1e5, vals, idata, rdata, work)


@njit
def _factorisations(n, plan, factors, vals):
    for _ in range(n):
        factor(plan, factors, vals)


@njit
def _substitutions(n, plan, factors, b, out):
    for _ in range(n):
        substitute(plan, factors, b, out)


def call_costs(solution) -> dict[str, float]:
    """Return the seconds of one residual, Jacobian, factorisation and substitution at the end of a run."""
    p = solution.problem
    y, yp, t = solution.result.y[-1].copy(), np.zeros(p.n), float(solution.t[-1])
    out, work, vals = np.zeros(p.n), np.zeros(p.work_size), np.zeros(p.indices.size)
    # as in a run, entries are left out that are negligible all the way
    counted = np.zeros(vals.size, dtype=bool)
    for row in np.linspace(0, len(solution.t) - 1, PLACES).astype(int):
        y[:] = solution.result.y[row]
        p.jacobian(float(solution.t[row]), y, yp, 1e5, vals, p.idata, p.rdata, work)
        # a run may end where the matrix is nearly singular; the cost is the same with a row set aside
        negligible = NEGLIGIBLE_IN_NEWTON[0] if p.small_entries else NEGLIGIBLE
        plan = analyse(
            p.indptr, p.indices, vals, p.scale, 1e-9, counted, negligible, p.small_entries, p.couplings
        )  # fmt: skip
    factors = new_factors(plan)
    factor(plan, factors, vals)
    p.residual(t, y, yp, out, p.idata, p.rdata, work)
    b = out.copy()
    tables = (p.idata, p.rdata, work)
    return {
        "residual": seconds_per_call(lambda n: _residuals(n, p.residual, t, y, yp, out, *tables)),
        "jacobian": seconds_per_call(lambda n: _jacobians(n, p.jacobian, t, y, yp, vals, *tables), 200),
        "factorisation": seconds_per_call(lambda n: _factorisations(n, plan, factors, vals)),
        "substitution": seconds_per_call(lambda n: _substitutions(n, plan, factors, b, out)),
    }


def _case(state: str, load: str, integrator: str, tolerance: float, duration: float) -> Case:
    return Case(
        name=state,
        operation={"duration": duration, "torque": load},
        fault=STATES[state],
        solver={"integrator": integrator, "tolerance": tolerance},
    )


def measure_case(state: str, load: str, integrator: str, tolerance: float, duration: float) -> dict:
    """Run one case warm and return its numbers."""
    simulate_case(_case(state, load, integrator, tolerance, 0.002), every_step=True)
    case = _case(state, load, integrator, tolerance, duration)
    with PeakMemory() as memory:
        cpu, wall = time.process_time(), time.perf_counter()
        solution = simulate_case(case, every_step=True)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    row = {"state": state, "load": load, "integrator": integrator, "tolerance": tolerance}
    if not solution.success:
        return {**row, "failed": solution.message}
    start = time.process_time()
    levels = record(case, solution)["gmf_rms"].sel(way="orders", component=COMPONENTS).values
    outputs = time.process_time() - start
    stats, span = solution.stats, float(solution.t[-1])
    cycles = span * case.mesh_frequency
    # on a busy machine the clock on the wall runs ahead of the processor's by the same factor everywhere
    inside = stats.wall_time * cpu / wall
    costs = call_costs(solution)
    split = {"residual": stats.residuals * costs["residual"], "Jacobian": stats.jacobians * costs["jacobian"]}
    if integrator != "IDA":
        split["factorisation"] = stats.factorizations * costs["factorisation"]
        split["substitution"] = stats.solves * costs["substitution"]
    split["rest"] = inside - sum(split.values())
    return {
        **row,
        "simulated": span,
        "integrator_seconds": inside,
        "setup_seconds": cpu - inside,
        "output_seconds": outputs,
        "speed": span / inside,
        "speed_with_outputs": span / (cpu + outputs),
        "steps": stats.steps,
        "rejections": [stats.error_rejections, stats.newton_rejections],
        "per_cycle": {
            "steps": stats.steps / cycles,
            "residuals": stats.residuals / cycles,
            "jacobians": stats.jacobians / cycles,
            "factorisations": stats.factorizations / cycles,
        },
        "us_per_step": {name: 1e6 * seconds / stats.steps for name, seconds in split.items()},
        "memory_mb": memory.grown,
        "unknowns": solution.problem.n,
        "gmf": levels.tolist(),
    }


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each part: one case with one integrator and tolerance."""
    parts: list[tuple[str, Callable[[], dict]]] = []
    duration = QUICK_DURATION if quick else DURATION
    ladder = QUICK_TOLERANCES if quick else TOLERANCES
    runs = [REFERENCE, *((name, tol) for name, tols in ladder.items() for tol in tols)]
    for load in LOADS[:1] if quick else LOADS:
        for state in STATES:
            for name, tol in runs:
                parts.append(
                    (
                        f"{state} {load} - {name} {tol:g}",
                        lambda a=(state, load, name, tol): measure_case(*a, duration),
                    )
                )
    return parts


def _cases(results: list[dict]) -> list[tuple[str, str]]:
    return list(dict.fromkeys((r["state"], r["load"]) for r in results))


def _reference(results: list[dict], state: str, load: str) -> dict | None:
    for r in results:
        if (r["state"], r["load"], r["integrator"], r["tolerance"]) == (state, load, *REFERENCE) and "gmf" in r:
            return r
    return None


def _off(row: dict, other: dict) -> float:
    return float(np.max(np.abs(np.array(row["gmf"]) / np.array(other["gmf"]) - 1.0)))


def finish(results: list[dict]) -> dict:
    """Return errors of the mesh harmonics, the loosest tolerance that is accurate enough, and speed ratios."""
    out = []
    for state, load in _cases(results):
        reference = _reference(results, state, load)
        entry: dict = {"state": state, "load": load}
        for name in TOLERANCES:
            rows = [
                r for r in results if (r["state"], r["load"], r["integrator"]) == (state, load, name) and "gmf" in r
            ]
            rows.sort(key=lambda r: -r["tolerance"])
            errors = [{"tolerance": r["tolerance"], "off": _off(r, reference) if reference else None} for r in rows]
            # the loosest from which on every tighter one is good
            good = None
            for row, error in zip(reversed(rows), reversed(errors), strict=True):
                if reference is None or error["off"] > LIMIT:
                    break
                good = row
            entry[name] = {"errors": errors, "tolerance": good and good["tolerance"]}
            if good:
                entry[name] |= {key: good[key] for key in ("integrator_seconds", "speed", "speed_with_outputs", "gmf")}
        if "integrator_seconds" in entry["WSTIFF"] and "integrator_seconds" in entry["IDA"]:
            entry["ratio"] = entry["IDA"]["integrator_seconds"] / entry["WSTIFF"]["integrator_seconds"]
            entry["difference"] = _off(entry["WSTIFF"], entry["IDA"])
        usual = {
            r["integrator"]: r
            for r in results
            if (r["state"], r["load"]) == (state, load) and DEFAULTS[r["integrator"]] == r["tolerance"] and "gmf" in r
        }
        if len(usual) == 2:
            entry["ratio_at_defaults"] = usual["IDA"]["integrator_seconds"] / usual["WSTIFF"]["integrator_seconds"]
            entry["difference_at_defaults"] = _off(usual["WSTIFF"], usual["IDA"])
        out.append(entry)
    return {"cases": out}


def render(extra: dict) -> str:
    """Return the tables in Markdown."""
    results = extra["results"]
    header = ["state, load", "integrator", "tolerance", "GMF off by %", "simulated s / s", "with outputs"]
    header += ["steps", "residuals", "Jacobians", "factorisations", "MB"]
    split_header = ["state, load", "integrator", "tolerance", "residual", "Jacobian", "factorisation", "substitution"]
    rows, split_rows, failed = [], [], []
    for r in results:
        label = f"{r['state']}, {r['load']}"
        if "failed" in r:
            failed.append(f"* {label}, {r['integrator']} {r['tolerance']:g}: {r['failed']}")
            continue
        reference = _reference(results, r["state"], r["load"])
        off = 100.0 * _off(r, reference) if reference else None
        per = r["per_cycle"]
        rows.append(
            [
                label,
                r["integrator"],
                f"{r['tolerance']:g}",
                number(off, 2),
                number(r["speed"]),
                number(r["speed_with_outputs"]),
                *(number(per[k]) for k in ("steps", "residuals", "jacobians", "factorisations")),
                number(r["memory_mb"], 2),
            ]
        )
        split = r["us_per_step"]
        names = ("residual", "Jacobian", "factorisation", "substitution", "rest")
        split_rows.append(
            [label, r["integrator"], f"{r['tolerance']:g}", *(number(split.get(k), 2) for k in names)]
            + [number(sum(split.values()))]
        )
    best_header = ["state, load", "WSTIFF at", "IDA at", "time of IDA / WSTIFF", "they differ by %"]
    best_header += ["time at the defaults", "differ by %"]
    best = []
    for entry in extra["cases"]:
        tolerances = [entry[n]["tolerance"] for n in ("WSTIFF", "IDA")]
        difference, usual = entry.get("difference"), entry.get("difference_at_defaults")
        best.append(
            [
                f"{entry['state']}, {entry['load']}",
                *(f"{t:g}" if t else "not reached" for t in tolerances),
                number(entry.get("ratio"), 2),
                number(None if difference is None else 100 * difference, 2),
                number(entry.get("ratio_at_defaults"), 2),
                number(None if usual is None else 100 * usual, 2),
            ]
        )
    lines = [
        "Simulated seconds per second of processor time in the integrator, and with setting up, reaction forces and "
        "signals from every step, as the study does. Counts are per mesh cycle. GMF: the RMS of the first three mesh "
        "harmonics along the line of action, the line of centres and across it, largest difference to "
        f"{REFERENCE[0]} at {REFERENCE[1]:g}.\n",
        table(header, rows),
        f"The loosest tolerance from which on the mesh harmonics are within {100 * LIMIT:g} %, and how many times "
        f"longer IDA takes there; the same at the study's defaults, WSTIFF {DEFAULTS['WSTIFF']:g} and IDA "
        f"{DEFAULTS['IDA']:g}:\n",
        table(best_header, best),
        "Microseconds of a step by part (the cost of one call times the calls; for IDA the rest holds its own "
        "factorisation and the calls through Python):\n",
        table([*split_header, "rest", "sum"], split_rows),
        *failed,
    ]
    return "\n".join(lines) + "\n"
