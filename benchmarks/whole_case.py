"""A whole case, from the mechanism to the table of mesh harmonics: where its processor time goes.

Several checkouts, with reactions at every step, are compared by

    python -m benchmarks.whole_case before=/path/to/checkout after=. --repeats 7

Each measurement runs in a process of its own, the checkouts in turn, so that a busy machine slows all of them alike.
What counts are processor times and the medians of their ratios to the first checkout.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks import contact
from benchmarks.gear_pair import STATES as PAIRS
from benchmarks.gear_pair import call_costs
from benchmarks.markdown import number, table
from gearmbs.studies import Case, case_mechanism, run_case, simulate_case
from gearmbs.studies.run.recorder import WATCHED, Recorder

TITLE = "A whole case by part"
RUNS = {
    "healthy": ("healthy", False, None),
    "healthy, lumped": ("healthy", True, None),
    "misaligned": ("misaligned", False, None),
    "misaligned, lumped": ("misaligned", True, None),
    "+3 mm": ("+3 mm", False, None),
    "four bearings 6206/CN": ("healthy", False, "6206/CN"),
}
"""State, lumped or not, and bearings of each run."""

DURATION = 0.3
TURNS = 3
CALLED = ("residual", "jacobian", "factorisation", "substitution")

STATES = ("healthy", "misaligned")
PARTS = (
    "residual",
    "Jacobian",
    "factorisation",
    "substitution",
    "rest of the step",
    "reactions or record",
    "set-up and signals",
)

CHILD = """
import json, sys, time
from gearmbs.studies import Case, run_case, simulate_case
from benchmarks.gear_pair import call_costs

state, lump, seconds = sys.argv[1], sys.argv[2] == "lump", float(sys.argv[3])
fault = {"misalignment": "1 deg"} if state == "misaligned" else {}
settings = {"fault": fault, **({"solver": {"lump": True}} if lump else {})}
run_case(Case(name="warm", operation={"duration": 0.08}, **settings))
case = Case(name=state, operation={"duration": seconds}, **settings)
start = time.process_time()
record = run_case(case)
whole = time.process_time() - start

try:
    from gearmbs.studies.run.recorder import WATCHED, Recorder

    taken = {"consumer": Recorder(case).take, "watch": WATCHED}
except ImportError:
    # records of older checkouts are made from reactions at every step
    taken = {}
start, wall = time.process_time(), time.perf_counter()
solution = simulate_case(case, every_step=True, **taken)
share = (time.process_time() - start) / (time.perf_counter() - wall)
stats = solution.stats
if taken:
    inside, reactions = stats.processor_times["steps"], stats.processor_times["consumer"]
else:
    inside = stats.wall_time * min(share, 1.0)
    start = time.process_time()
    for part in solution.parts():
        part.multipliers
    reactions = time.process_time() - start
cost = call_costs(simulate_case(case.changed(operation={"duration": seconds / 10.0}), every_step=True))
parts = {
    "residual": stats.residuals * cost["residual"],
    "Jacobian": stats.jacobians * cost["jacobian"],
    "factorisation": stats.factorizations * cost["factorisation"],
    "substitution": stats.solves * cost["substitution"],
}
parts["rest of the step"] = inside - sum(parts.values())
parts["reactions or record"] = reactions
parts["set-up and signals"] = whole - inside - reactions
levels = record.gmf_rms.sel(way="orders", component=["line_of_action", "line_of_centres", "tangential"]).values
print(json.dumps({"whole": whole, "steps": stats.steps, "unknowns": solution.problem.n, "gmf": levels.tolist(),
                  "parts": {name: 1e6 * value / stats.steps for name, value in parts.items()}}))
"""


def measure(folder: Path, state: str, lump: bool, seconds: float) -> dict:
    """Run one case in a fresh process of a checkout and return its numbers."""
    python = folder / ".venv" / "bin" / "python"
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")}
    interpreter = str(python if python.exists() else sys.executable)
    done = subprocess.run(
        [
            interpreter,
            "-c",
            CHILD,
            state,
            "lump" if lump else "all",
            str(seconds),
        ],
        cwd=folder,
        env={**os.environ, **threads, "PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(f"{folder}: {done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def compare(checkouts: dict[str, Path], repeats: int, seconds: float) -> list[dict]:
    """Measure all checkouts in turn; the first with all bodies is what the others are compared with."""
    rows = []
    last = list(checkouts)[-1]
    for state in STATES:
        runs = [(name, False) for name in checkouts] + [(last, True)]
        found: dict[tuple[str, bool], list[dict]] = {run: [] for run in runs}
        for _ in range(repeats):
            for name, lump in runs:
                found[name, lump].append(measure(checkouts[name], state, lump, seconds))
        first = [one["whole"] for one in found[runs[0]]]
        reference = np.array(found[runs[0]][0]["gmf"])
        for (name, lump), many in found.items():
            ratios = [a / one["whole"] for a, one in zip(first, many, strict=True)]
            rows.append(
                {
                    "state": state,
                    "checkout": name,
                    "lump": lump,
                    "unknowns": many[0]["unknowns"],
                    "steps": many[0]["steps"],
                    "seconds": float(np.median([one["whole"] for one in many])),
                    "times_faster": float(np.median(ratios)),
                    "off": float(np.max(np.abs(np.array(many[0]["gmf"]) / reference - 1.0))),
                    "parts": {part: float(np.median([one["parts"][part] for one in many])) for part in PARTS},
                }
            )
    return rows


def comparison(rows: list[dict]) -> str:
    """Return the tables of `compare` in Markdown."""
    whole, split = [], []
    for row in rows:
        label = [row["state"], row["checkout"] + (", lumped" if row["lump"] else "")]
        whole.append(
            [
                *label,
                str(row["unknowns"]),
                str(row["steps"]),
                number(row["seconds"], 3),
                number(row["times_faster"], 3),
                number(100.0 * row["off"], 2),
            ]
        )
        split.append(
            [*label, *(number(row["parts"][part], 3) for part in PARTS), number(sum(row["parts"].values()), 3)]
        )
    header = ["state", "program", "unknowns", "steps", "processor s", "times faster", "harmonics differ by %"]
    return table(header, whole) + "\n" + table(["state", "program", *PARTS, "sum"], split)


def run_by_part(name: str, duration: float, turns: int) -> dict:
    """Return the processor time of a run by part, in microseconds a step; medians of turns.

    The contact alone, as often as residuals are evaluated, is what no program with these steps can do without.
    """
    state, lump, bearing = RUNS[name]
    case = Case(name=state, operation={"duration": duration}, fault=PAIRS[state], solver={"lump": lump})

    def mechanism():
        return None if bearing is None else case_mechanism(case, bearing)

    run_case(case, mechanism=mechanism())
    found: list[dict[str, float]] = []
    for _ in range(turns):
        begin = time.process_time()
        run_case(case, mechanism=mechanism())
        whole = time.process_time() - begin
        recorder = Recorder(case)
        taken = {"every_step": True, "consumer": recorder.take, "watch": WATCHED}
        stats = simulate_case(case, mechanism=mechanism(), **taken).stats
        found.append({"whole": whole, **stats.processor_times})
    short = case.changed(operation={"duration": duration / 10.0})
    costs = call_costs(simulate_case(short, mechanism=mechanism(), every_step=True))
    calls = dict(zip(CALLED, (stats.residuals, stats.jacobians, stats.factorizations, stats.solves), strict=True))
    parts = {part: costs[part] * calls[part] for part in CALLED}
    spent = {part: statistics.median(one[part] for one in found) for part in found[0]}
    parts["rest of the step"] = spent["steps"] - sum(parts.values())
    parts["pivots"], parts["record of the steps"] = spent["pivots"], spent["consumer"]
    parts["set-up and signals"] = spent["whole"] - spent["steps"] - spent["pivots"] - spent["consumer"]
    end = case.operation.run_up + case.operation.settling + duration
    bound = 1e-6 * contact.measure(case.pair(), None)["value_us"] * stats.residuals
    return {
        "run": name,
        "steps": stats.steps,
        "simulated_s_per_s": end / spent["whole"],
        "bound_s_per_s": end / bound,
        "us_per_step": {part: 1e6 * value / stats.steps for part, value in parts.items()},
    }


def cells(quick: bool) -> list[tuple[str, Callable[[], dict]]]:
    """Return name and measurement of each run."""
    names = list(RUNS)[:2] if quick else list(RUNS)
    duration, turns = (0.08, 1) if quick else (DURATION, TURNS)
    return [(name, lambda name=name: run_by_part(name, duration, turns)) for name in names]


def finish(results: list[dict]) -> dict:
    """Return nothing: the runs say it all."""
    return {}


def render(extra: dict) -> str:
    """Return the table in Markdown."""
    rows = extra["results"]
    parts = list(rows[0]["us_per_step"])
    header = ["run", "steps", "simulated s per s", "contact alone", *parts, "sum"]
    lines = [
        [
            row["run"],
            str(row["steps"]),
            number(row["simulated_s_per_s"]),
            number(row["bound_s_per_s"]),
            *(number(row["us_per_step"][part]) for part in parts),
            number(sum(row["us_per_step"].values())),
        ]
        for row in rows
    ]
    return (
        "Seconds simulated in a second of the processor, beside those if residuals consisted of the contact and "
        "nothing else were done, and microseconds a step by part: residuals to substitutions are calls times the "
        "cost of one on its own, the others are measured in the run.\n\n" + table(header, lines)
    )


def main() -> None:
    """Compare the checkouts named on the command line and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkouts", nargs="+", help="name=folder; the first is what the others are compared with")
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=1.0, help="length of the record")
    parser.add_argument("--json", type=Path, help="write the numbers here, too")
    given = parser.parse_args()
    checkouts = {name: Path(folder).resolve() for name, folder in (text.split("=", 1) for text in given.checkouts)}
    rows = compare(checkouts, given.repeats, given.seconds)
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))
    print(comparison(rows))


if __name__ == "__main__":
    main()
