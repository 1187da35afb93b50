"""Whether clear peaks of simulated run-ups stand at ranked crossings: ``python -m benchmarks.run_ups LEDGER``.

Random boxes, a spur pair, two helical stages and a helical pair in a finite-element housing in turn, whose teeth,
shafts, bearings and loads are drawn, run up through the crossing that is ranked first. The mesh lines of the force of
each mesh, of all bearing forces together and of the acceleration of all seats are followed. Which peaks are clear is
stated beforehand, by `clear_peaks`; each is held against the crossings with a gain above 1 or a tenth of the largest
response of the housing. How much of the run-up lies within 1 % of one of them, where a peak would be by chance, is told
beside it.

Each box is a line of the ledger (JSON), by its number, from which it follows: what stands there is not run again.
``--report`` prints the table of what there is.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.signal import find_peaks

from benchmarks.markdown import number, table

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.drivetrain import Drivetrain

SEED = 35
KINDS = ("spur pair", "two helical stages", "helical pair in a housing")
HARMONICS = 2
WITHIN = 0.01
"""Of its speed a crossing may be from a peak."""
PROMINENCE = 6.0
"""dB: twice the level of what is on either side, as a gain of sqrt(3) makes of a line that was 1."""
SMALLEST = 0.1
"""Of the largest line of the channels; the rest is not what a listener calls a resonance."""
ABOVE_NOISE = 10.0
"""A level falls by 1 / (1 + (d / zeta)^2)^(1/2) at d from a resonance, so that noise of 0.1 of it moves a peak by at
most 0.6 of the damping ratio, 1 % of the speed for 1.6 %."""
LAG = 0.005
"""Of the speed by which a resonance comes too late: up to twice its time constant 1 / (2 pi zeta f) times the relative
rate of the speed, which is chosen for it; and within a window the speed changes by no more than `WITHIN`."""
LONGEST = 8.0
"""Of a run-up, s: boxes whose modes are damped so little that they take longer are passed over for their price."""
FLAT = 0.99
"""Of a peak, over which its place is the mean: it is flat there, and which sample is highest hangs on steps."""
RANGE = (0.75, 1.35)
"""Of the speed of the crossing ranked first, through which the box runs up."""
WORTH = 2.0
"""Gain of the crossing ranked first, without which a box has nothing to run up through and is passed over."""
TURNS = 2.0
"""Of the first shaft in a window."""


class Draw:
    """Random numbers of a box."""

    def __init__(self, count: int) -> None:
        self._draw = np.random.default_rng([SEED, count])

    def between(self, low: float, high: float) -> float:
        """Return a number whose logarithm is even."""
        return float(np.exp(self._draw.uniform(np.log(low), np.log(high))))

    def one_of(self, *choices: Any) -> Any:
        return choices[self._draw.integers(len(choices))]


def box(count: int) -> Drivetrain:
    """Return the random box of a number."""
    from gearmbs.drivetrain import Accelerometer, Drivetrain, GearMesh, Housing, Mount, Shaft, SpeedDrive, TorqueLoad
    from gearmbs.flexible import box_model
    from gearmbs.gears import GearSpec

    draw, kind = Draw(count), KINDS[count % len(KINDS)]
    helix = 0.0 if kind == "spur pair" else draw.between(8.0, 18.0)
    stages = 2 if kind == "two helical stages" else 1
    teeth = [(draw.one_of(19, 21, 23, 25), draw.one_of(41, 47, 52, 58)) for _ in range(stages)]
    length = draw.between(0.24, 0.34)
    wall = draw.between(0.008, 0.016)
    overhang = 0.02 + 0.5 * wall
    planes = (0.3 * length, 0.65 * length)
    damping_time = draw.between(1e-5, 4e-5)
    shafts = []
    for k in range(stages + 1):
        diameter = draw.between(0.025, 0.04)
        wheels = {}
        for stage, role in ((k - 1, 1), (k, 0)):
            if 0 <= stage < stages:
                spec = GearSpec(
                    teeth[stage][role],
                    (0.003, 0.0035)[stage],
                    face_width=0.025,
                    helix_angle=np.radians(helix),
                    hand=("right", "left")[(role + stage) % 2],
                    bore_radius=diameter / 2.0,
                )
                wheels[f"z{2 * stage + role + 1}"] = (planes[stage], spec)
        k_radial = draw.between(1e8, 4e8)
        spring = {"kind": "elastic", "stiffness": (k_radial, k_radial, 0.5 * k_radial), "damping_time": damping_time}
        ends = {f"{'abc'[k]}{end}": {"station": at, **spring} for end, at in ((1, overhang), (2, length - overhang))}
        place = {"position": (0.08, 0.11, -0.02)} if kind == KINDS[2] and k == 0 else {}
        shafts.append(
            Shaft(
                name=f"shaft {k + 1}", length=length, diameter=diameter, modes=4, elements=6, wheels=wheels,
                bearings=ends, **place,
            )
        )  # fmt: skip
    inside: dict[str, Any] = {}
    if kind == KINDS[2]:
        walls = (0.4, 0.22, length - 0.04)
        feet = [
            Mount(name=f"foot {x} {z}", at=(x, 0, z), radius="20 mm", stiffness=(5e7,) * 3, damping=(5e3,) * 3)
            for x in (0.006, 0.394)
            for z in (0.006, walls[2] - 0.006)
        ]
        model = box_model(walls, wall, divisions=(8, 4, 4))
        seats = dict.fromkeys(("a1", "a2", "b1", "b2"), (0.07, wall))
        inside["housings"] = [Housing(name="case", model=model, mounts=feet, modes=8, seats=seats)]
        axes = (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0)))
        inside["sensors"] = [
            Accelerometer(name=f"{name} {axis} moves", bearing=name, direction=along)
            for name in ("a1", "a2", "b1", "b2")
            for axis, along in axes
        ]
    damped = draw.between(0.03, 0.06)
    return Drivetrain(
        f"box {count}, {kind}",
        shafts=shafts,
        meshes=[
            GearMesh(
                name=f"stage {k + 1}", driver=f"z{2 * k + 1}", driven=f"z{2 * k + 2}",
                settings={"stiffness": "iso", "damping_ratio": damped},
            )
            for k in range(stages)
        ],
        drives=[SpeedDrive(name="motor", shaft="shaft 1", speed="3000 rpm")],
        loads=[TorqueLoad(name="brake", shaft=shafts[-1].name, torque=draw.between(80.0, 300.0))],
        running=True,
        run_up=0.02,
        **inside,
    )  # fmt: skip


def ranked(train: Drivetrain) -> pd.DataFrame:
    """Return the crossings that count: a gain above 1, or a tenth of the largest response of the housing."""
    from gearmbs.studies import ranked_crossings, train_campbell

    maximum = HARMONICS * max(abs(train.kinematics.mesh_frequency(mesh.name)) for mesh in train.meshes)
    found = ranked_crossings(train_campbell(train, ["0 rpm", "3000 rpm"], harmonics=HARMONICS, maximum=maximum))
    counts = found.gain > 1.0
    if "response" in found:
        counts |= found.response > SMALLEST * found.response.max()
    return found[counts].reset_index(drop=True)


def reached(crossings: pd.DataFrame) -> pd.DataFrame:
    """Return the crossings through which a drive of 3000 rpm can run up, that mean something: of a gain above 2."""
    fast = 3000.0 / RANGE[1]
    return crossings[(crossings.speed_rpm > 500.0) & (crossings.speed_rpm < fast) & (crossings.gain > WORTH)]


def planned(crossings: pd.DataFrame, damping: dict[int, float]) -> tuple[float, float, float, float]:
    """Return speeds (rpm) of a run-up through the crossing of the largest gain, its relative rate (1/s), time (s)."""
    within = reached(crossings)
    if within.empty:
        return 0.0, 0.0, 0.0, np.inf
    first = within.loc[within.gain.idxmax()]
    slow, fast = (float(first.speed_rpm) * part for part in RANGE)
    met = crossings[(crossings.speed_rpm > slow) & (crossings.speed_rpm < fast)]
    follows = LAG * np.pi * min(damping[int(m)] * f for m, f in zip(met["mode"], met.frequency_hz))
    rate = min(follows, WITHIN * slow / 60.0 / TURNS)
    return slow, fast, rate, float(np.log(fast / slow) / rate)


def run_up(train: Drivetrain, slow: float, fast: float, rate: float, whole: float, highest: float) -> xr.Dataset:
    """Return the record of a run-up whose speed grows at a relative rate; the highest frequency it is to have in it."""
    from gearmbs.drivetrain import RunSettings, SpeedDrive
    from gearmbs.studies import run_train

    times = np.linspace(0.0, whole, 41)
    curve = [[0.1 + t, f"{slow * np.exp(rate * t)} rpm"] for t in times[:-1]] + [[0.1 + whole, f"{fast} rpm"]]
    drive = SpeedDrive(name="motor", shaft="shaft 1", speed=f"{fast} rpm", curve=curve)
    settings = RunSettings(settling=0.1, duration=whole, tolerance=1e-6, rate=max(12800.0, 4.0 * highest))
    return run_train(replace(train, drives=[drive]), settings)


def tracks(
    train: Drivetrain, record: xr.Dataset, channels: Sequence[str]
) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Return speed (rpm), levels of the mesh lines and of the noise: roots of the sums of squares of some channels.

    The noise is the median of what is at orders where nothing meshes, a window's resolution and more from any line.
    """
    from gearmbs.signals import order_track
    from gearmbs.studies import train_signal
    from gearmbs.studies.train_views import mesh_orders

    lines = mesh_orders(train, HARMONICS)
    known = np.array(list(mesh_orders(train, 6).values()))
    between = np.arange(4.0, 1.1 * max(lines.values()), 1.37)
    between = between[np.abs(between[:, None] - known).min(axis=1) > 4.0 / TURNS]
    orders = [*lines.values(), *between]
    found = [order_track(train_signal(record, c), orders=orders, revolutions=TURNS, overlap=0.9) for c in channels]
    level = np.sqrt(sum(np.abs(one.values[..., 0]) ** 2 for one in found))
    speed = np.abs(found[0].speed.values) * 30.0 / np.pi
    return speed, dict(zip(lines, level.T)), np.median(level[:, len(lines) :], axis=1)


def clear_peaks(level: np.ndarray, noise: np.ndarray, largest: float) -> np.ndarray:
    """Return which moments of a level are clear peaks: prominent, large and above noise."""
    peaks, _ = find_peaks(20.0 * np.log10(np.maximum(level, 1e-12 * largest)), prominence=PROMINENCE)
    return peaks[(level[peaks] > SMALLEST * largest) & (level[peaks] > ABOVE_NOISE * noise[peaks])]


def place(speed: np.ndarray, level: np.ndarray, peak: int) -> float:
    """Return where a peak stands: the mean speed over which the level is above `FLAT` of it."""
    low = level < FLAT * level[peak]
    first = peak - int(np.argmax(low[peak::-1])) + 1
    last = peak + int(np.argmax(low[peak:]))
    return float(speed[first:last].mean())


def found_of(count: int) -> dict[str, Any]:
    """Return what a random box shows."""
    from gearmbs.studies import named_modes

    begin = time.process_time()
    train = box(count)
    crossings = ranked(train)
    named = named_modes(train)
    damping = dict(zip((int(m) for m in named.mode.values), named.damping_ratio.values.tolist()))
    slow, fast, rate, whole = planned(crossings, damping)
    if whole > LONGEST:
        return {"number": count, "passed_over": whole}
    record = run_up(train, slow, fast, rate, whole, float(crossings.frequency_hz.max()))
    bearings = [f"{b.name} {axis}" for b in train.bearings for axis in "xyz"]
    groups = {f"force of {mesh.name}": [f"force of {mesh.name}"] for mesh in train.meshes} | {"bearings": bearings}
    if train.sensors:
        groups["housing"] = [sensor.name for sensor in train.sensors]
    rows = []
    for group, channels in groups.items():
        speed, lines, noise = tracks(train, record, channels)
        largest = max(float(level.max()) for level in lines.values())
        for line, level in lines.items():
            for peak in clear_peaks(level, noise, largest):
                stands = place(speed, level, int(peak))
                away = {}
                for key, some in (("any", crossings), ("own", crossings[crossings.order == line])):
                    off = (stands / some.speed_rpm - 1.0).to_numpy()
                    k = int(np.argmin(np.abs(off))) if off.size else -1
                    away[key] = (float(off[k]), str(some.name.iloc[k]), str(some.order.iloc[k])) if off.size else None
                rows.append(
                    {
                        "group": group,
                        "line": line,
                        "rpm": stands,
                        "level": float(level[peak]) / largest,
                        "above_noise": float(level[peak] / noise[peak]),
                        **away,
                    }
                )
    grid = np.linspace(slow, fast, 20001)
    inside = crossings[(crossings.speed_rpm > 0.99 * slow) & (crossings.speed_rpm < 1.01 * fast)]
    near = np.abs(grid[:, None] / inside.speed_rpm.to_numpy() - 1.0).min(axis=1) < WITHIN
    own = {line: inside[inside.order == line].speed_rpm.to_numpy() for line in {row["line"] for row in rows}}
    chance = {
        line: float((np.abs(grid[:, None] / at - 1.0).min(axis=1) < WITHIN).mean()) if at.size else 0.0
        for line, at in own.items()
    }
    return {
        "number": count,
        "kind": KINDS[count % len(KINDS)],
        "rpm": [slow, fast],
        "duration": float(record.time[-1] - record.time[0]),
        "crossings": inside[["order", "name", "speed_rpm", "frequency_hz", "gain"]].to_dict("records"),
        "covered": float(near.mean()),
        "covered_by_own": chance,
        "peaks": rows,
        "seconds": time.process_time() - begin,
    }


def report(ledger: list[dict[str, Any]]) -> str:
    """Return the table of a ledger and the peaks that are missed."""
    rows, missed = [], []
    for one in ledger:
        if "passed_over" in one:
            continue
        hit = {key: [row for row in one["peaks"] if row[key] and abs(row[key][0]) < WITHIN] for key in ("any", "own")}
        off = [abs(row["any"][0]) for row in hit["any"]]
        by_chance = [one["covered_by_own"][row["line"]] for row in one["peaks"]]
        rows.append(
            [
                f"{one['number']}, {one['kind']}",
                f"{one['rpm'][0]:.0f} to {one['rpm'][1]:.0f}",
                number(one["duration"]),
                str(len(one["crossings"])),
                f"{one['covered']:.0%}",
                str(len(one["peaks"])),
                str(len(hit["any"])),
                str(len(hit["own"])),
                f"{np.mean(by_chance):.0%}" if by_chance else "-",
                f"{np.median(off):.2%}, {max(off):.2%}" if off else "-",
            ]
        )
        missed += [(one["number"], row) for row in one["peaks"] if row not in hit["any"]]
    header = [
        "box", "rpm", "s", "crossings", "range within 1 %", "clear peaks", "within 1 %", "of their own line",
        "by chance", "median, largest",
    ]  # fmt: skip
    lines = [table(header, rows)]
    for count, row in missed:
        near = row["own"] or row["any"]
        lines.append(
            f"box {count}: {row['group']}, {row['line']} at {row['rpm']:.1f} rpm, level {row['level']:.2f}: "
            f"{row['any'][0]:+.2%} from '{row['any'][1]}' of {row['any'][2]}; of its own line {near[0]:+.2%} from "
            f"'{near[1]}'"
        )
    return "\n".join(lines)


def main() -> None:
    """Run what the ledger lacks and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.run_ups", description=(__doc__ or "").split(":")[0])
    parser.add_argument("ledger", type=Path)
    parser.add_argument("--boxes", type=int, default=3, help="with a crossing to run up through (%(default)s)")
    parser.add_argument("--report", action="store_true")
    asked = parser.parse_args()
    text = asked.ledger.read_text() if asked.ledger.exists() else ""
    lines = [json.loads(line) for line in text.splitlines()]
    while not asked.report and sum("peaks" in one for one in lines) < asked.boxes:
        lines.append(found_of(len(lines)))
        with asked.ledger.open("a") as file:
            file.write(json.dumps(lines[-1]) + "\n")
    print(report(lines))


if __name__ == "__main__":
    main()
