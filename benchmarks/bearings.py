"""What rolling bearings cost: the paper's case on joints, on four springs, and on four bearings of nine balls.

    python -m benchmarks.bearings --repeats 9

All kinds run in turn in one process, from the mechanism to the table of mesh harmonics, so that a busy machine slows
all of them alike; what counts are processor times and the medians of ratios within a turn. A second table counts steps
alone, at other tolerances, beside the balls that take up load or lose it: there the force is only once differentiable.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.gear_pair import call_costs
from benchmarks.markdown import number, table

ROUGH, TIGHT = 1e-6, 1e-7
KINDS = {
    "joints": None,
    "6206/CN": ("6206/CN", {}),
    "6206, no clearance": ("6206", {}),
    "6206/CN, smooth over 2 um": ("6206/CN", {"smooth": "2 um"}),
}
SPRINGS = {"6206/CN": "springs as stiff as 6206/CN", "6206, no clearance": "springs as stiff as 6206"}
ENDS = tuple(f"bearing {shaft} {end}" for shaft in (1, 2) for end in "ab")


def mechanism(case: Any, kind: str) -> Any:
    """Return the mechanism of a case on bearings of a kind."""
    from gearmbs.studies import case_mechanism

    chosen = KINDS[kind]
    return case_mechanism(case) if chosen is None else case_mechanism(case, chosen[0], **chosen[1])


def on_springs(case: Any, kind: str, solution: Any) -> Any:
    """Return the mechanism of a case on linear springs as stiff as its bearings under their mean loads.

    Parameters
    ----------
    case : Case
    kind : str
    solution : Solution
        Of the case on those bearings.
    """
    from gearmbs.bearings import BearingStatics

    on_bearings, joints = mechanism(case, kind), mechanism(case, "joints")
    settled = solution.t > case.operation.run_up + case.operation.settling
    for name in ENDS:
        element = on_bearings.elements[name]
        shaft = joints.bodies[element.i.body.name]
        axes = element.j.global_orientation()
        load = -solution.load(name)[0][settled].mean(axis=0) @ axes
        k = np.zeros((6, 6))
        k[:5, :5] = BearingStatics(element.bearing).under(load).stiffness
        at = element.j.global_position()
        markers = [b.marker_at(at, axes, name=f"{name}.{s}") for b, s in ((shaft, "I"), (joints.ground, "J"))]
        joints.field(name, *markers, stiffness=k, damping=element.settings.damping * k)
    for name in ("bearing 1", "bearing 2"):
        joints.joints.pop(name)
    return joints


def changes_of_load(solution: Any) -> int:
    """Return how often balls have taken up load or lost it."""
    return int(sum(np.abs(np.diff(solution.diagnostics(name)["loaded_elements"])).sum() for name in ENDS))


def measure_whole(repeats: int, seconds: float, report: Callable[[str], None] = print) -> list[dict[str, Any]]:
    """Return a row a kind: steps, processor time of the whole case and its ratio to that with joints, a residual's."""
    from gearmbs.studies import Case, run_case, simulate_case

    case = Case(operation={"duration": seconds})
    spent: dict[str, list[float]] = {kind: [] for kind in KINDS}
    records = {}
    for turn in range(repeats + 1):
        for kind in KINDS:
            begin = time.process_time()
            records[kind] = run_case(case, mechanism=mechanism(case, kind))
            # the first turn compiles
            if turn:
                spent[kind].append(time.process_time() - begin)
        report(f"turn {turn} of {repeats}")
    rows = []
    for kind in KINDS:
        steps, few = records[kind].attrs["solver_steps"], Case(operation={"duration": 0.02})
        costs = call_costs(simulate_case(few, mechanism=mechanism(few, kind)))
        rows.append({
            "kind": kind, "steps": steps, "more": steps / records["joints"].attrs["solver_steps"] - 1.0,
            "residual": 1e6 * costs["residual"], "seconds": float(np.median(spent[kind])),
            "ratio": float(np.median(np.array(spent[kind]) / np.array(spent["joints"]))),
        })  # fmt: skip
    return rows


def measure_steps(seconds: float) -> list[dict[str, Any]]:
    """Return steps of every kind and of springs at several tolerances, and the changes of load."""
    from gearmbs.studies import Case

    case = Case(operation={"duration": seconds})
    mesh = case.operation.top_speed * case.gears.teeth[0]
    end = case.operation.run_up + case.operation.settling + seconds
    rows = []
    for tol, scale in ((TIGHT, mesh), (ROUGH, mesh), (ROUGH, 1.0)):

        def run(m: Any, tol: float = tol, scale: float = scale) -> Any:
            return m.simulate(end, every_step=True, tol=tol, rate_scale=scale)

        joints = run(mechanism(case, "joints")).stats.steps
        for kind in KINDS:
            if kind == "joints":
                continue
            solution = run(mechanism(case, kind))
            row = {"tol": tol, "scale": scale, "kind": kind, "joints": joints, "steps": solution.stats.steps,
                   "changes": changes_of_load(solution), "springs": math.nan}  # fmt: skip
            if kind in SPRINGS:
                row["springs"] = run(on_springs(case, kind, solution)).stats.steps
            rows.append(row)
    return rows


def render(whole: list[dict[str, Any]], steps: list[dict[str, Any]]) -> str:
    """Return both tables in Markdown."""
    cells = [
        [row["kind"], str(row["steps"]), f"{100 * row['more']:+.1f}", number(row["residual"]),
         number(row["residual"] - whole[0]["residual"]), number(row["seconds"]), number(row["ratio"])]
        for row in whole
    ]  # fmt: skip
    header = ["bearings", "steps", "more %", "us a residual", "more us", "processor s", "of that with joints"]
    out = table(header, cells)
    cells = []
    for row in steps:
        more, springs = 100.0 * (row["steps"] / row["joints"] - 1.0), 100.0 * (row["springs"] / row["joints"] - 1.0)
        each = (row["steps"] - row["springs"]) / row["changes"]
        cells.append([
            f"{row['tol']:g}, {row['scale']:.0f}", row["kind"], str(row["joints"]), str(row["steps"]), f"{more:+.1f}",
            f"{springs:+.1f}" if springs == springs else "-", str(row["changes"]), number(each, 2),
        ])  # fmt: skip
    header = ["tol, rate_scale", "bearings", "steps on joints", "steps", "more %", "on springs, more %",
              "changes of load", "steps beyond springs for each"]  # fmt: skip
    return out + "\n" + table(header, cells)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--seconds", type=float, default=0.5, help="length of the record, s")
    given = parser.parse_args()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    print(render(measure_whole(given.repeats, given.seconds), measure_steps(0.4 * given.seconds)))


if __name__ == "__main__":
    main()
