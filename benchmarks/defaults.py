"""What defaults that changed do to each preset: the same trains with the former law of their meshes and with today's.

    python -m benchmarks.defaults

The former default is given explicitly, so that both columns are made by the same program. Presets that state the law
of their meshes are moved by no default; they are in the table with what the former law would make of them.
"""

from __future__ import annotations

import argparse
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.markdown import table
from gearmbs.drivetrain import Drivetrain, GearMesh, IdealBearing, Shaft, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import ContactLaw, GearSpec, planetary
from gearmbs.studies import run_train
from gearmbs.studies.planetary import PlanetaryRun, run_planetary
from gearmbs.studies.presets.files import PRESETS, preset_train
from gearmbs.studies.presets.paper_cases import MUCH
from gearmbs.studies.presets.rattle import RattleSettings, rattle
from gearmbs.studies.trains import RunSettings

FORMER = ContactLaw.impact()
"""The law of every mesh before: IMPACT with the paper's numbers, whatever the wheels."""
LEAST = {"misaligned": 1.0, "distance": 1.0, "load": MUCH}
"""Ratios that decide the claims, and above what each holds."""
LAW = ("contact", "stiffness", "damping_ratio")
"""Settings of a mesh that state its law."""
DATA = Path(__file__).parent.parent / "docs" / "data" / "claims.parquet"
"""The study of the paper's claims, as docs/scripts/claims.py made it."""
RUN = RunSettings(settling=0.1, duration=0.1)
"""Long enough for the levels of the mesh harmonics of the slowest train, 31 cycles of its slowest mesh."""


def two_stages() -> Drivetrain:
    """Return two spur stages in joints, with 300 N m behind them at 1500 rpm, which state no law."""
    gears = {"z1": (21, "3 mm"), "z2": (52, "3 mm"), "z3": (19, "4 mm"), "z4": (47, "4 mm")}
    shafts = {"z1": "input", "z2": "lay", "z3": "lay", "z4": "output"}
    stations = {"z1": "60 mm", "z2": "60 mm", "z3": "200 mm", "z4": "100 mm"}
    return Drivetrain(
        "two stages",
        shafts=[Shaft(name="input", length="200 mm", mass=1.1, inertia=1e-3),
                Shaft(name="lay", length="250 mm", mass=2.5, inertia=5e-3),
                Shaft(name="output", length="200 mm", mass=3.1, inertia=1e-2)],
        wheels=[Wheel(name=name, shaft=shafts[name], station=stations[name], gear=GearSpec(*gear, face_width="25 mm"))
                for name, gear in gears.items()],
        meshes=[GearMesh(name="stage 1", driver="z1", driven="z2", settings={"backlash": "0.1 mm"}),
                GearMesh(name="stage 2", driver="z3", driven="z4", direction="60 deg",
                         settings={"backlash": "0.1 mm"})],
        bearings=[IdealBearing(name=f"of {name}", shaft=name, station="20 mm") for name in ("input", "lay", "output")],
        drives=[SpeedDrive(name="motor", shaft="input", speed="1500 rpm")],
        loads=[TorqueLoad(name="load", shaft="output", torque="300 N m")],
        running=True,
    )  # fmt: skip


def with_former_law(train: Drivetrain) -> Drivetrain:
    """Return a train whose meshes have the former default, given explicitly."""
    meshes = []
    for mesh in train.meshes:
        others = {key: value for key, value in mesh.settings.items() if key not in LAW}
        meshes.append(replace(mesh, settings={**others, "contact": FORMER}))
    return train.with_parts(*meshes)


def mesh_rows(name: str, train: Drivetrain) -> list[list[str]]:
    """Return of each mesh its natural frequency and damping ratio, before and now, and whether it states its law."""
    before, now = with_former_law(train).mesh_dynamics, train.mesh_dynamics
    rows = []
    for mesh in train.meshes:
        stated = "stated" if any(key in mesh.settings for key in LAW) else "default"
        cells = [f"{d[mesh.name].frequency:.0f} ({d[mesh.name].damping_ratio:.3g})" for d in (before, now)]
        rows.append([name, mesh.name, stated, *cells])
    return rows


def levels(train: Drivetrain) -> dict[str, np.ndarray]:
    """Return the RMS of the first three mesh harmonics of each mesh's normal force, N."""
    record = run_train(train, RUN)
    return {
        mesh.name: record["mesh_rms"].sel(mesh=mesh.name, signal=f"force of {mesh.name}").values[:3]
        for mesh in train.meshes
    }


def level_rows(name: str, train: Drivetrain) -> list[list[str]]:
    """Return of each mesh its levels before and now."""
    before, now = levels(with_former_law(train)), levels(train)
    return [[name, mesh, shown(before[mesh]), shown(now[mesh])] for mesh in now]


def rattle_row() -> list[str]:
    """Return hits of the driving flank a cycle of a fluctuation below the threshold, before and now."""
    before, now = RattleSettings(damping=1e3, depth=1e-6), RattleSettings()
    hits = [rattle("multibody", settings).drive_hits for settings in (before, now)]
    return ["rattle, level 0.5", "hits of its flank a cycle (no force)", *(f"{v:.3g}" for v in hits)]


def planetary_rows() -> list[list[str]]:
    """Return the levels of the first sun mesh of a set of 24, 30 and 84 teeth that states no law, before and now."""
    rows = []
    for contact in (FORMER, None):
        settings: dict[str, Any] = {} if contact is None else {"contact": contact}
        gears = planetary((24, 30, 84), "1.5 mm", 3, backlash_sun="0.05 mm", backlash_ring="0.05 mm", **settings)
        run = PlanetaryRun(gears=gears, speeds={"sun": "300 rpm"}, torques={"carrier": "-60 N m"})
        record = run_planetary(run)
        force = record["force"].sel(mesh="sun").isel(planet=0).values
        cycles = record.attrs["frequency_mesh"] * run.duration
        whole = int(force.size * np.floor(cycles) / cycles)
        lines = np.abs(np.fft.rfft(force[:whole])) * np.sqrt(2.0) / whole
        rows.append(lines[[int(np.floor(cycles)) * h for h in (1, 2, 3)]])
    return [["planetary 24/30/84", "sun, first planet", *map(shown, rows)]]


def shown(values: np.ndarray) -> str:
    """Return levels as a cell."""
    return " ".join(f"{v:.3g}" for v in values)


def claim_rows(points: int) -> list[list[str]]:
    """Return how probable the three claims are together, and how points of their study agree that are computed again.

    The stored settings have 12 bits, so that ratios move by what 0.02 % of a setting moves them, and a verdict may
    change where its ratio is as near to the limit.
    """
    import pandas as pd

    from gearmbs.campaigns.subjects.pair import ClaimsSubject

    stored = pd.read_parquet(DATA)
    subject = ClaimsSubject()
    rows = np.linspace(0, len(stored) - 1, points).astype(int)
    again = []
    for row in rows:
        settings = {key: stored[key].iloc[row] for key in subject.base() if key in stored}
        point = {key: value if isinstance(value, str) else float(value) for key, value in settings.items()}
        cases = subject.check({**subject.base(), **point}, f"point {row}")
        again.append(subject.reduce(cases, subject.run(cases, lambda _: None, ()), ()).numbers)
    numbers = pd.DataFrame(again)
    out = []
    for component in ("line_of_centres", "tangential", "line_of_action", "resultant"):
        names = [f"{ratio}.{component}" for ratio in LEAST]
        held = np.logical_and.reduce([stored[name] > least for name, least in zip(names, LEAST.values())])
        now = np.logical_and.reduce([numbers[name] > least for name, least in zip(names, LEAST.values())])
        off = np.abs(numbers[names].to_numpy() / stored[names].to_numpy()[rows] - 1.0).max()
        changed = int((now != held[rows]).sum())
        out.append([component.replace("_", " "), f"{100.0 * held.mean():.1f}", f"{off:.1e}", f"{changed} of {points}"])
    return out


def main() -> None:
    """Print the tables in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=24, help="of the study of the claims that are computed again")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    trains = {"two stages": two_stages(), **{name: preset_train(name) for name in PRESETS}}
    rows = [row for name, train in trains.items() for row in mesh_rows(name, train)]
    header = ["train", "mesh", "its law is", "before: Hz (of critical)", "now: Hz (of critical)"]
    print(table(header, rows))
    moved = {n: t for n, t in trains.items() if any(not {*LAW} & {*m.settings} for m in t.meshes)}
    # the slider is no part of the preset's file: a load holds the flanks together
    slider = moved["crank_slider"]
    moved["crank_slider"] = slider.with_parts(replace(slider.part("load"), torque=10.0))
    found = [row for name, train in moved.items() for row in level_rows(name, train)]
    found += [*planetary_rows(), rattle_row()]
    header = ["train", "mesh", "before: RMS at 1, 2, 3 x mesh, N", "now: RMS at 1, 2, 3 x mesh, N"]
    print(table(header, found))
    header = ["component", "all three claims hold, %", "largest change of a ratio", "verdicts that changed"]
    print(table(header, claim_rows(options.points)))


if __name__ == "__main__":
    main()
