"""Whether stated numerical errors hold: ``python -m benchmarks.error_bars LEDGER``.

Random pairs, tilted and helical ones, planetary sets (spur and helical) and drivetrains with shafts that bend or that
stand in rolling bearings are simulated to an accuracy, and again at a tolerance of 1e-11 with four times the slices of
the faces. A level is held if it is off that by no more than its error; what is told is compared with the worst of a
record. The cost is in runs of the precision that was found good enough, without a word on accuracy.

Each case is a line of the ledger (JSON), by kind and number, from which the random case follows: what stands there is
not run again. ``--report`` prints the table of what there is.
"""

from __future__ import annotations

import argparse
import json
import re
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.markdown import number, table

SEED = 34
EXACT, FINER = 1e-11, 4
"""Tolerance and times the slices of what errors are held against."""
ACCURACIES = {"case": ("1 %", "0.3 %", "0.1 %"), "train": ("2 %", "1 %", "0.5 %")}
"""That are asked for in turn; of trains and sets 0.1 % is the least there is."""


class Draw:
    """Random numbers of a case."""

    def __init__(self, kind: str, count: int) -> None:
        self._draw = np.random.default_rng([SEED, list(KINDS).index(kind), count])

    def between(self, low: float, high: float) -> float:
        """Return a number whose logarithm is even."""
        return float(np.exp(self._draw.uniform(np.log(low), np.log(high))))

    def one_of(self, *choices: Any) -> Any:
        return choices[self._draw.integers(len(choices))]


def of_case(draw: Draw, count: int, **gears: Any) -> Any:
    """Return a random case without a fault; every other one has a duration of its own."""
    from gearmbs.studies import Case

    return Case(
        gears={"teeth": draw.one_of((29, 29), (21, 34), (20, 31), (24, 24)), **gears},
        operation={
            "speed": draw.between(31.4, 314.0),
            "torque": draw.between(20.0, 300.0),
            "duration": "auto" if count % 2 else 0.25,
        },
        contact={"damping": draw.between(1e4, 6e5), "depth": draw.between(2e-5, 3e-4)},
        fault={"backlash": draw.between(2e-5, 4e-4)},
    )


def a_pair(draw: Draw, count: int) -> Any:
    """Return a spur pair whose flanks are alike along the face."""
    fault = draw.one_of({}, {"teeth": {"kind": "wear", "wheel": "driven"}}, {"centre_distance_error": 1e-3})
    return of_case(draw, count).changed(fault=fault)


def a_tilted_pair(draw: Draw, count: int) -> Any:
    """Return a spur pair with axes that are inclined to each other."""
    return of_case(draw, count).changed(fault={"misalignment": draw.between(2e-3, 2e-2)})


def a_helical_pair(draw: Draw, count: int) -> Any:
    """Return a helical pair."""
    angle, face = np.radians(draw.between(5.0, 25.0)), draw.between(0.015, 0.04)
    return of_case(draw, count, helix_angle=angle, face_width=face)


def a_set(draw: Draw, count: int, **settings: Any) -> Any:
    """Return a planetary set with one member held."""
    from gearmbs.gears import planetary
    from gearmbs.studies.planetary import PlanetaryRun

    teeth, planets = draw.one_of(((24, 30, 84), 3), ((24, 36, 96), 4), ((19, 17, 53), 3), ((24, 36, 96), 3))
    play = draw.one_of(0.0, draw.between(2e-5, 2e-4))
    gears = planetary(teeth, "1.5 mm", planets=planets, backlash_sun=play, backlash_ring=play, **settings)
    held = draw.one_of("ring", "ring", "carrier")
    load = "carrier" if held == "ring" else "ring"
    # the sense of the load's torque is that in which it holds back the sun, whose speed is given
    torque = draw.between(15.0, 300.0) * (-1.0 if held == "ring" else 1.0)
    rpm = draw.between(400.0, 3000.0)
    cycle = 60.0 / rpm / teeth[0] * (1.0 + teeth[0] / teeth[2])
    return PlanetaryRun(
        gears,
        speeds={"sun": f"{rpm} rpm"},
        torques={load: torque},
        held=held,
        run_up=0.005,
        settling=0.03,
        duration=max(0.06, 30.0 * cycle),
        rate=25600.0,
    )


def a_helical_set(draw: Draw, count: int) -> Any:
    """Return a planetary set of helical wheels."""
    return a_set(draw, count, helix_angle=np.radians(draw.between(5.0, 20.0)), face_width=0.015)


def a_stage(draw: Draw, bearing: Callable[[str, str, float], Any], **shaft: Any) -> Any:
    """Return a stage whose second shaft turns a flywheel by a clutch, and how it is run."""
    from gearmbs.drivetrain import (
        Drivetrain,
        ElasticClutch,
        GearMesh,
        IdealBearing,
        RunSettings,
        Shaft,
        SpeedDrive,
        TorqueLoad,
        Wheel,
    )
    from gearmbs.gears import GearSpec

    teeth = draw.one_of((20, 30), (25, 36), (29, 29))
    rpm, torque = draw.between(600.0, 3000.0), draw.between(20.0, 120.0)
    settings = {"backlash": draw.between(2e-5, 2e-4), "damping_ratio": draw.between(0.03, 0.2)}
    train = Drivetrain(
        "stage",
        shafts=[
            *(Shaft(name=name, length="100 mm", radius="15 mm", **shaft) for name in ("in", "out")),
            Shaft(name="flywheel", length="100 mm", inertia=0.02),
        ],
        wheels=[
            Wheel(name=f"z{k + 1}", shaft=name, station="45 mm", gear=GearSpec(z, "3 mm", face_width="20 mm"))
            for k, (name, z) in enumerate(zip(("in", "out"), teeth, strict=True))
        ],
        meshes=[GearMesh(name="mesh", driver="z1", driven="z2", settings=settings)],
        couplings=[
            ElasticClutch(
                name="clutch",
                first="out",
                second="flywheel",
                stiffness=draw.between(5e3, 5e4),
                relative_damping=0.5,
                damping_frequency=100.0,
            )
        ],
        bearings=[
            IdealBearing(name="b flywheel", shaft="flywheel"),
            *(bearing(f"{s} {end}", s, z) for s in ("in", "out") for end, z in (("a", 0.01), ("b", 0.09))),
        ],
        drives=[SpeedDrive(name="drive", shaft="in", speed=f"{rpm} rpm")],
        loads=[TorqueLoad(name="load", shaft="flywheel", torque=torque)],
        running=True,
        run_up=0.01,
    )
    return train, RunSettings(settling=0.1, duration=0.1)


def a_flexible_train(draw: Draw, count: int) -> Any:
    """Return a stage whose shafts bend, in elastic bearings."""
    from gearmbs.drivetrain import ElasticBearing

    k = draw.between(5e7, 5e8)

    def bearing(name: str, shaft: str, station: float) -> Any:
        along = 0.4 * k if name.endswith("a") else 0.0
        settings = {"stiffness": (k, k, along), "damping": (2e-5 * k, 2e-5 * k, 2e-5 * along)}
        return ElasticBearing(name=name, shaft=shaft, station=station, **settings)

    return a_stage(draw, bearing, modes=draw.one_of(2, 4), elements=6)


def a_train_in_ball_bearings(draw: Draw, count: int) -> Any:
    """Return a stage in deep groove ball bearings."""
    from gearmbs.drivetrain import RollingContactBearing

    rolling = draw.one_of("6206", "6306", "6006")

    def bearing(name: str, shaft: str, station: float) -> Any:
        return RollingContactBearing(name=name, shaft=shaft, station=station, rolling=rolling)

    return a_stage(draw, bearing)


KINDS: dict[str, Callable[[Draw, int], Any]] = {
    "pairs": a_pair,
    "tilted": a_tilted_pair,
    "helical": a_helical_pair,
    "planetary": a_set,
    "flexible": a_flexible_train,
    "bearings": a_train_in_ball_bearings,
    "helical sets": a_helical_set,
}


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a call returns, and its processor time, s."""
    begin = time.process_time()
    return call(), time.process_time() - begin


def ways(made: Any) -> tuple[str, Callable[..., Any], Callable[[float, int], Any]]:
    """Return the name of the levels, how to run to an accuracy, and how at a tolerance with times the slices."""
    from gearmbs.studies import Case, run_case, run_train
    from gearmbs.studies.planetary import PlanetaryRun, run_planetary

    if isinstance(made, Case):
        slices = made.pair().face_slices

        def case(tolerance: float, times: float) -> Any:
            finer = {} if slices == 1 else {"slices": round(times * (slices - 1)) + 1}
            return run_case(
                made.changed(solver={"tolerance": tolerance, "lump": made.lump}, contact=finer), variables=["gmf_rms"]
            )

        return "gmf_rms", lambda accuracy: run_case(made, accuracy=accuracy, variables=["gmf_rms"]), case
    if isinstance(made, PlanetaryRun):
        gears = made.gears
        slices = gears.pairs_sun[0].face_slices

        def planets(tolerance: float, times: float) -> Any:
            finer = gears if slices == 1 else replace(gears, slices=round(times * (slices - 1)) + 1)
            return run_planetary(replace(made, gears=finer, tolerance=tolerance))

        return "mesh_rms", lambda accuracy: run_planetary(made, accuracy=accuracy), planets
    train, run = made

    def stage(tolerance: float, times: float) -> Any:
        return run_train(train, replace(run, tolerance=tolerance))

    return "mesh_rms", lambda accuracy: run_train(train, run, accuracy=accuracy), stage


def exact_set(made: Any, times: float) -> Any:
    """Return the record of a set at the tolerance `EXACT` with its levels, as the run of an accuracy has them."""
    from gearmbs.studies import planetary

    usual, planetary.accurate_lines = planetary.accurate_lines, _first_run
    try:
        gears, slices = made.gears, made.gears.pairs_sun[0].face_slices
        finer = gears if slices == 1 else replace(gears, slices=round(times * (slices - 1)) + 1)
        return planetary.run_planetary(replace(made, gears=finer), accuracy="1 %")
    finally:
        planetary.accurate_lines = usual


def _first_run(lines: Callable[[Any], Any], first: Any, *_: Any) -> Any:
    return lines(replace(first, tolerance=EXACT)).record


def slices_of(made: Any) -> int:
    """Return the slices of the faces of a case, a set or a train with its settings."""
    if isinstance(made, tuple):
        return max(pair.face_slices for pair in made[0].pairs.values())
    return made.pair().face_slices if hasattr(made, "pair") else made.gears.pairs_sun[0].face_slices


_WARM: set[str] = set()
"""Kinds of which a run has been made."""


def found_of(kind: str, count: int) -> dict[str, Any]:
    """Return what a random case of a kind shows."""
    made = KINDS[kind](Draw(kind, count), count)
    name, accurate, plain = ways(made)
    is_set = kind in ("planetary", "helical sets")
    accuracy = ACCURACIES["case" if name == "gmf_rms" else "train"][count % 3]
    told: dict[str, Any] = {"kind": kind, "number": count, "asked": accuracy}
    if kind not in _WARM:
        # what a first run loads is no part of its cost
        _WARM.add(kind)
        accurate(accuracy)
    record, spent = timed(lambda: accurate(accuracy))
    by = record.attrs["accuracy_by"]
    tolerance = float(re.findall(r"\d\S*e-\d+", by.partition("tolerances of")[2])[0])
    counts, used = re.findall(r"(\d+) slices", by), slices_of(made)
    _, alone = timed(lambda: plain(tolerance, (int(counts[0]) - 1) / (used - 1) if counts else 1.0))
    exact, long = timed(lambda: exact_set(made, FINER) if is_set else plain(EXACT, FINER))
    levels, errors = record[name], record[f"{name}_error"]
    wanted = exact[name]
    if name == "gmf_rms":
        # components as signals
        levels, errors, wanted = (
            one.sel(way="orders").transpose("component", "harmonic") for one in (levels, errors, wanted)
        )
    levels, errors, wanted = (np.asarray(one, dtype=float) for one in (levels, errors, wanted))
    rows = levels.reshape(levels.shape[0], -1)
    known = np.isfinite(rows) & np.isfinite(wanted.reshape(rows.shape))
    off = np.abs(levels - wanted).reshape(rows.shape)
    errors = errors.reshape(rows.shape)
    largest = np.where(known, rows, 0.0).max(axis=1, keepdims=True)
    of = np.maximum(largest, 0.01 * largest.max())
    true = float(np.where(known, off / of, 0.0).max())
    stated = float(np.where(known, errors / of, 0.0).max())
    return told | {
        "levels": int(known.sum()),
        "held": int((known & (off <= errors)).sum()),
        "worst": float(np.where(known, off / np.where(known, errors, 1.0), 0.0).max()),
        "true": true,
        "stated": stated,
        "reached": bool(record.attrs["accuracy_found"] <= record.attrs["accuracy_asked"]),
        "status": record.attrs.get("record_status", ""),
        "status_exact": exact.attrs.get("record_status", ""),
        "apart": float(record.attrs.get("record_apart", 0.0)),
        "apart_exact": float(exact.attrs.get("record_apart", 0.0)),
        "cost": spent / alone,
        "exact_cost": long / alone,
        "seconds": spent + alone + long,
        "by": by,
    }


def report(lines: list[dict[str, Any]]) -> str:
    """Return the table of a ledger by kind."""
    rows = []
    for kind in [*KINDS, "all"]:
        of = [one for one in lines if "worst" in one and kind in (one["kind"], "all")]
        if not of:
            continue
        told = [one for one in of if one["apart"] == 0.0]
        rows.append(
            [
                kind,
                str(len(of)),
                f"{np.mean([one['true'] <= one['stated'] for one in of]):.1%}",
                f"{np.mean([one['worst'] <= 1.0 for one in of]):.1%}",
                f"{sum(one['held'] for one in of) / sum(one['levels'] for one in of):.1%}",
                f"{np.mean([one['true'] <= one['stated'] for one in told]):.1%} of {len(told)}" if told else "-",
                number(float(np.median([one["stated"] / max(one["true"], 1e-12) for one in of]))),
                number(float(np.median([one["cost"] for one in of]))),
                f"{np.mean([one['reached'] for one in of]):.0%}",
            ]
        )
    header = [
        "kind", "cases", "true error within", "every level", "levels within", "flanks together", "told / true",
        "runs", "reached",
    ]  # fmt: skip
    return table(header, rows)


def main() -> None:
    """Run what the ledger lacks, kinds in turn, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.error_bars", description=(__doc__ or "").split(":")[0])
    parser.add_argument("ledger", type=Path)
    parser.add_argument("--cases", type=int, default=50, help="of each kind (%(default)s)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (%(default)s)")
    parser.add_argument("--kinds", nargs="*", choices=list(KINDS), default=list(KINDS)[:6])
    parser.add_argument("--report", action="store_true")
    asked = parser.parse_args()
    text = asked.ledger.read_text() if asked.ledger.exists() else ""
    lines = [json.loads(line) for line in text.splitlines()]
    there = {(one["kind"], one["number"]) for one in lines}
    if not asked.report:
        for count in range(asked.first, asked.first + asked.cases):
            for kind in asked.kinds:
                if (kind, count) in there:
                    continue
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    try:
                        one = found_of(kind, count)
                    except (ValueError, RuntimeError) as error:
                        one = {"kind": kind, "number": count, "failed": str(error)}
                lines.append(one)
                with asked.ledger.open("a") as file:
                    file.write(json.dumps(one) + "\n")
    print(report(lines))


if __name__ == "__main__":
    main()
