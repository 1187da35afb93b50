"""What a mesh, a body and a mesh cycle of a drivetrain cost: the bench beside its first pair, and stages in line.

    python -m benchmarks.trains --repeats 5
    python -m benchmarks.trains --equally-accurate

All models run in turn in one process, so that a busy machine slows all of them alike; what counts are processor times
and the medians of ratios within a turn.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.markdown import number, table

SPAN = 0.2
"""Simulated time of each run, s."""
STAGES = (1, 2, 5, 10)
TURNING = (1, 10, 20, 30)
"""Stages whose shafts are integrated by their angles alone."""
ALONE = ", angles alone"
TOLERANCES = (5e-8, 1e-7, 2e-7, 4e-7, 8e-7)
"""Tolerances between which the one is found at which lines of stages are as accurate as one stage at `USUAL`."""
USUAL, EXACT = 1e-7, 1e-10
CYCLES, SAMPLES = 40, 60
"""Mesh cycles at the end of a run whose harmonics are compared, and samples of each."""


def stages_in_line(count: int) -> Any:
    """Return so many equal stages one after the other, with joints as bearings, as a drivetrain."""
    from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel
    from gearmbs.gears import ContactLaw, GearSpec

    wheels, meshes = [], []
    for k in range(count):
        for shaft, side in ((k, "a"), (k + 1, "b")):
            gear = GearSpec(29, 95e-3 / 31, face_width=0.02, name=f"{side}{k}")
            wheels.append(Wheel(name=f"{side}{k}", shaft=f"s{shaft}", station=0.05 + 0.1 * k, gear=gear))
        # the law of the paper's pair, beside which they are timed
        settings = {"backlash": "0.1 mm", "contact": ContactLaw.impact()}
        meshes.append(GearMesh(name=f"m{k}", driver=f"a{k}", driven=f"b{k}", settings=settings))
    return Drivetrain(
        f"{count} stages",
        shafts=[Shaft(name=f"s{k}", length=0.1 * (count + 1)) for k in range(count + 1)],
        wheels=wheels,
        meshes=meshes,
        bearings=[IdealBearing(name=f"of {k}", shaft=f"s{k}", station=0.02) for k in range(count + 1)],
        drives=[SpeedDrive(name="drive", shaft="s0", speed="1000 rpm")],
        loads=[TorqueLoad(name="load", shaft=f"s{count}", torque=100.0)],
        running=True,
        run_up=0.02,
    )


def models() -> dict[str, tuple[Any, float, int, int]]:
    """Return mechanism, fastest mesh (rad/s), meshes and bodies of every model, by name."""
    from gearmbs.studies import BenchSettings, bench_train, gear_rig

    joints = bench_train("5 MPa", settings=BenchSettings(bearings="ideal", motor="speed", pump_teeth=0))
    trains = {"bench, joints": joints, "bench, elastic bearings": bench_train("5 MPa")}
    trains |= {f"{n} stage{'s' if n > 1 else ''} in line": stages_in_line(n) for n in STAGES}
    pair = gear_rig(joints.pairs["pair 1"], speed="1000 rpm", torque="200 N m", run_up=0.02)
    out = {"healthy pair": (pair, joints.rate_scale, 1, len(pair.bodies))}
    for name, train in trains.items():
        m = train.build()
        out[name] = (m, train.rate_scale, len(train.meshes), len(m.bodies))
    for n in TURNING:
        train = stages_in_line(n)
        m = train.build()
        m.lump = True
        out[f"{n} stage{'s' if n > 1 else ''} in line{ALONE}"] = (m, train.rate_scale, n, len(m.bodies))
    return out


def measure(repeats: int, span: float = SPAN, report: Callable[[str], None] = print) -> list[dict[str, Any]]:
    """Return a row a model: meshes, bodies, steps, processor time, and its ratio to the pair's."""
    found = models()
    spent: dict[str, list[float]] = {name: [] for name in found}
    steps = {}
    for turn in range(repeats + 1):
        for name, (m, scale, _, _) in found.items():
            start = time.process_time()
            solution = m.simulate(span, rate=12800, tol=1e-7, rate_scale=scale)
            if not solution.success:
                raise RuntimeError(f"{name}: {solution.message}")
            # the first turn compiles
            if turn:
                spent[name].append(time.process_time() - start)
            steps[name] = solution.stats.steps
        report(f"turn {turn} of {repeats}")
    pair = np.array(spent["healthy pair"])
    return [
        {
            "model": name, "meshes": meshes, "bodies": bodies, "steps": steps[name],
            "seconds": float(np.median(spent[name])), "ratio": float(np.median(np.array(spent[name]) / pair)),
            "cycles": meshes * scale / (2.0 * math.pi) * span,
        }
        for name, (_, scale, meshes, bodies) in found.items()
    ]  # fmt: skip


def exponent(rows: list[dict[str, Any]], ending: str) -> float:
    """Return the exponent with which processor time grows with the number of stages in line."""
    line = [row for row in rows if row["model"].endswith(ending)]
    return float(np.polyfit(np.log([row["meshes"] for row in line]), np.log([row["seconds"] for row in line]), 1)[0])


def render(rows: list[dict[str, Any]], span: float = SPAN) -> str:
    """Return the table in Markdown: times of one simulated second, and a step's cost shared out."""
    cells = []
    for row in rows:
        step = 1e6 * row["seconds"] / row["steps"]
        cells.append([
            row["model"], str(row["meshes"]), str(row["bodies"]), number(row["seconds"] / span), number(row["ratio"]),
            number(row["steps"] / span), number(step), number(step / row["meshes"]), number(step / row["bodies"]),
            number(1e3 * row["seconds"] / row["cycles"]),
        ])  # fmt: skip
    header = [
        "model", "meshes", "bodies", "s a simulated s", "of the pair's", "steps a s", "us a step", "us a step and mesh",
        "us a step and body", "ms a mesh cycle",
    ]  # fmt: skip
    return (
        table(header, cells)
        + f"\nStages in line: processor time grows with the power {exponent(rows, 'in line'):.2f} of them, with angles "
        + f"alone {exponent(rows, ALONE):.2f}.\n"
    )


def harmonics_of(m: Any, count: int, scale: float, tol: float, span: float) -> tuple[np.ndarray, float]:
    """Return the first three mesh harmonics of each mesh's normal force, N, (count, 3), and the processor time, s."""
    start = time.process_time()
    solution = m.simulate(span, rate=SAMPLES * scale / (2.0 * math.pi), tol=tol, rate_scale=scale)
    spent = time.process_time() - start
    told = np.array([solution.contact(f"m{k}")["normal_force"] for k in range(count)])
    lines = np.fft.rfft(told[:, -CYCLES * SAMPLES - 1 : -1], axis=1)[:, CYCLES * np.arange(1, 4)]
    return 2.0 * np.abs(lines) / (CYCLES * SAMPLES), spent


def equally_accurate(
    repeats: int, span: float = SPAN, report: Callable[[str], None] = print, counts: Sequence[int] = TURNING
) -> list[dict[str, float]]:
    """Return a row a line of stages whose angles alone are integrated: cost at one tolerance, and at one error.

    The error is that of the first three harmonics of the worst mesh, as a part of its largest, against `EXACT`. The
    tolerance of one error is found between those tried, on logarithmic scales, and the time at it as well.
    """
    rows, wanted = [], None
    for count in counts:
        train = stages_in_line(count)
        m = train.build()
        m.lump = True
        exact, _ = harmonics_of(m, count, train.rate_scale, EXACT, span)
        errors, spent = [], []
        for tol in TOLERANCES:
            runs = [harmonics_of(m, count, train.rate_scale, tol, span) for _ in range(repeats)]
            errors.append(float((np.abs(runs[0][0] - exact).max(axis=1) / exact.max(axis=1)).max()))
            spent.append(float(np.median([seconds for _, seconds in runs])))
        usual = TOLERANCES.index(USUAL)
        wanted = errors[usual] if wanted is None else wanted
        # errors rise with the tolerance, but not by every step of it
        rising = np.maximum.accumulate(errors)
        tol = float(np.exp(np.interp(np.log(wanted), np.log(rising), np.log(TOLERANCES))))
        equal = float(np.exp(np.interp(np.log(tol), np.log(TOLERANCES), np.log(spent))))
        rows.append({"meshes": count, "error": errors[usual], "seconds": spent[usual], "tol": tol, "equal": equal})
        report(f"{count} stages: {rows[-1]}")
    return rows


def render_equally(rows: list[dict[str, float]]) -> str:
    """Return the table in Markdown, and the exponents from ten stages on."""
    header = ["stages", f"error at {USUAL:g}", "s", "tolerance of the first one's error", "s at it"]
    cells = [[number(row[key]) for key in ("meshes", "error", "seconds", "tol", "equal")] for row in rows]
    many = [row for row in rows if row["meshes"] >= 10]
    one, other = (
        float(np.polyfit(np.log([row["meshes"] for row in many]), np.log([row[key] for row in many]), 1)[0])
        for key in ("seconds", "equal")
    )
    return table(header, cells) + f"\nFrom ten on: power {one:.2f} at one tolerance, {other:.2f} at one error.\n"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--span", type=float, default=SPAN, help="simulated time of each run, s")
    parser.add_argument("--equally-accurate", action="store_true", help="lines of stages at one error")
    given = parser.parse_args()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    if given.equally_accurate:
        print(render_equally(equally_accurate(given.repeats, given.span)))
        return
    print(render(measure(given.repeats, given.span), given.span))


if __name__ == "__main__":
    main()
