"""The paper's claims on rigid bodies, and on shafts that bend in rolling bearings: the pair alone, and on the bench.

``python docs/scripts/claims_on_shafts.py`` simulates 24 runs, the paper's three states at two loads in four
surroundings, and writes ``docs/data/claims_on_shafts.json``. The page on claims reads it and simulates nothing.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

import gearmbs as gm
from gearmbs.drivetrain import (
    Drivetrain,
    GearMesh,
    IdealBearing,
    RollingContactBearing,
    RunSettings,
    Shaft,
    SpeedDrive,
    SpeedSensor,
    TorqueLoad,
    Wheel,
)
from gearmbs.files import write_whole
from gearmbs.gears import ContactLaw
from gearmbs.signals.analysis.bands import harmonic_amplitudes
from gearmbs.signals.files.simulated import holds_speed
from gearmbs.studies import bench_train, run_train
from gearmbs.studies.presets.bench import PRESSURES, SEATS, STATES
from gearmbs.studies.presets.paper_cases import judge

STORED = Path(__file__).parent.parent / "data" / "claims_on_shafts.json"
TORQUES = {"low": 100.0, "high": 200.0}
"""N m on the driven wheel, as the paper's model has them."""
BEARING = "6206"
"""For a shaft of 30 mm, deep groove."""
MODES = 4
"""Shapes of each shaft beside those of its seats: up to some 4 kHz, five times the highest harmonic that is judged."""
RUN = RunSettings(settling=0.2, duration=0.6, tolerance=1e-6)
QUANTITIES = ("force", "acceleration", "transmission error")
PLACES = ("pair, rigid", "pair, on shafts", "bench, rigid", "bench, on shafts")


def seated(train: Drivetrain, names: tuple[str, ...]) -> Drivetrain:
    """Return a train some of whose shafts bend and stand in rolling bearings.

    Parameters
    ----------
    train : Drivetrain
    names : tuple of str
        Shafts of 200 mm by 30 mm.
    """
    shafts = [replace(s, modes=MODES) if s.name in names else s for s in train.shafts]
    others = [b for b in train.bearings if b.shaft not in names]
    rolling = [
        RollingContactBearing(name=f"{name} {side}", shaft=name, station=z, rolling=BEARING)
        for name in names
        for side, z in (("a", 0.02), ("b", 0.18))
    ]
    return replace(train, shafts=shafts, bearings=[*others, *rolling])


def pair(load: str, state: str, *, on_shafts: bool) -> Drivetrain:
    """Return the paper's pair as a drivetrain."""
    gear = bench_train().part("z1").gear
    law = {"backlash": "0.1 mm", "contact": ContactLaw.impact(), **STATES[state]}
    train = Drivetrain(
        "pair",
        shafts=[Shaft(name=name, length=0.2, radius=0.015) for name in ("one", "two")],
        wheels=[Wheel(name=f"z {name}", shaft=name, station=0.1, gear=gear) for name in ("one", "two")],
        meshes=[GearMesh(name="pair 1", driver="z one", driven="z two", settings=law)],
        bearings=[IdealBearing(name=f"{name} seat", shaft=name) for name in ("one", "two")],
        drives=[SpeedDrive(name="drive", shaft="one", speed="1000 rpm")],
        loads=[TorqueLoad(name="brake", shaft="two", torque=TORQUES[load])],
        sensors=[SpeedSensor(name="speed", shaft="two")],
        running=True,
        run_up=0.02,
    )
    return seated(train, ("one", "two")) if on_shafts else train


def bench(load: str, state: str, *, on_shafts: bool) -> Drivetrain:
    """Return the bench of Fig. 2; its own shafts twist and stand on springs."""
    train = bench_train(PRESSURES[load], state)
    return seated(train, SEATS) if on_shafts else train


def levels(record: xr.Dataset) -> dict[str, list[float]]:
    """Return the RMS of the first three mesh harmonics of what the claims are judged by, in SI."""
    rate, mesh = float(record.attrs["run_rate"]), record.sel(mesh="pair 1")
    frequency = float(record.mesh_rms.mesh_frequency.sel(mesh="pair 1"))
    radius = float(bench_train().part("z1").gear.base_radius)
    spinning = record.measured.sel(sensor="speed").values
    found = {
        "force": mesh.normal_force.values,
        "acceleration": radius * np.gradient(spinning, 1.0 / rate),
        "transmission error": mesh.transmission_error.values,
    }
    orders = np.arange(1, 4)
    steady = holds_speed(record)
    return {
        name: (np.abs(harmonic_amplitudes(signal[:, None], rate, frequency, orders))[:, 0] / math.sqrt(2.0)).tolist()
        if steady
        else [math.nan] * 3
        for name, signal in found.items()
    }


def computed() -> dict:
    """Simulate all runs and return their levels: by place, load and state."""
    out: dict = {}
    for name in PLACES:
        make = pair if name.startswith("pair") else bench
        for load, state in product(TORQUES, STATES):
            with warnings.catch_warnings():
                # the paper's law over-damps the meshes
                warnings.simplefilter("ignore")
                record = run_train(make(load, state, on_shafts=name.endswith("shafts")), RUN)
            out.setdefault(name, {}).setdefault(load, {})[state] = levels(record)
            print(name, load, state, flush=True)
    return {"gearmbs": gm.__version__, "levels": out}


def store() -> None:
    """Write what was computed."""
    write_whole(STORED, json.dumps(computed(), indent=1) + "\n")


def table(place: str, quantity: str) -> xr.DataArray:
    """Return the stored levels of a quantity in a place: load, state, harmonic."""
    told = json.loads(STORED.read_text(encoding="utf-8"))["levels"][place]
    rows = [[told[load][state][quantity] for state in STATES] for load in TORQUES]
    coords = {"load": list(TORQUES), "state": list(STATES), "harmonic": [1, 2, 3]}
    return xr.DataArray(np.array(rows), dims=("load", "state", "harmonic"), coords=coords)


def verdicts() -> pd.DataFrame:
    """Return whether each claim holds, with the ratio that decides it: claims and quantities by place."""
    names = ("misalignment raises 2 x", "+3 mm raises 1 to 3 x", "low load much smaller")
    rows: dict[tuple[str, str], dict[str, str]] = {(name, quantity): {} for name in names for quantity in QUANTITIES}
    for quantity in QUANTITIES:
        for place in PLACES:
            values = table(place, quantity)
            least = {
                "misaligned": (values.sel(state="misaligned") / values.sel(state="healthy")).sel(harmonic=2),
                "distance": values.sel(state="distance") / values.sel(state="healthy"),
                "load": values.sel(load="high") / values.sel(load="low"),
            }
            for name, claim, ratios in zip(names, judge(values, quantity), least.values(), strict=True):
                word = "held" if claim.held else "not held"
                rows[name, quantity][place] = f"{word} ({float(ratios.min()):.3g})"
    found = pd.DataFrame.from_dict(rows, orient="index")
    found.index.names = ["claim", "judged in"]
    return found


if __name__ == "__main__":
    store()
