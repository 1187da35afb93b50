"""The NREL 5 MW reference gearbox: what its page computes itself, and what takes longer and is stored.

``python docs/scripts/nrel_5mw.py`` simulates the gearbox at rated power, sound and with a broken tooth of the
high-speed pinion, and running up, finds its modes and its positions of rest, and writes ``docs/data/nrel_5mw.nc``: six
minutes of processor time. The page reads it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.linalg
import xarray as xr

import gearmbs as gm
from gearmbs.drivetrain import Drivetrain, RunSettings, SpeedDrive
from gearmbs.gears import faults
from gearmbs.studies import load_train, named_modes, ranked_crossings, run_train, train_campbell

STORED = Path(__file__).parents[1] / "data" / "nrel_5mw.nc"
RUN = RunSettings(settling=0.2, duration=0.8, tolerance=1e-6)
BROKEN = faults.BrokenTooth(wheel="driven", tooth=5, lost=0.9)
ERRORS = np.array([50e-6, 100e-6])
STAGES = ("first", "second")
MODES = 40
KEPT = ("housing at HS-A", "generator speed")
SPEEDS = ("6.9 rpm", "12.1 rpm")
"""Of the rotor, from the wind at which the turbine starts to rated (NREL/TP-500-38060)."""
UP = RunSettings(settling=0.2, duration=4.0, tolerance=1e-6)
HEARD = ("housing at HS-A", "force of third")
FOLLOWED = ("third", "second sun-planet 1", "first sun-planet 1")
CROSSINGS = 60
"""Those ranked first by the response of the housing, of those that the run-up passes."""

# The torsional model of planetary trains of A. Kahraman, J. Sound Vib. 173 (1994) 125: rigid carriers and bearings.


def torsional(train: Drivetrain, mesh: Callable[[str], float], shafts: dict[str, float]) -> tuple[np.ndarray, ...]:
    """Return inertias (kg m^2) and stiffness (N m/rad) of the gearbox as a chain that only turns.

    Parameters
    ----------
    train : Drivetrain
        Wheels and inertias.
    mesh : callable
        Stiffness along the line of action by name, N/m.
    shafts : dict of str to float
        Torsional stiffness of the four shafts, N m/rad.
    """
    names = ["rotor"]
    for stage in STAGES:
        names += [f"{stage} carrier", *(f"{stage} planet {k}" for k in (1, 2, 3)), f"{stage} sun"]
    names += ["gear", "pinion", "generator"]
    at = {name: k for k, name in enumerate(names)}
    inertia, stiffness = np.zeros(len(names)), np.zeros((len(names), len(names)))

    def spring(k: float, levers: dict[str, float]) -> None:
        row = np.zeros(len(names))
        for name, lever in levers.items():
            row[at[name]] = lever
        stiffness[:] += k * np.outer(row, row)

    inertia[at["rotor"]], inertia[at["generator"]] = (train.part(name).inertia for name in ("rotor", "generator"))
    for stage in STAGES:
        gears, weight = train.part(stage).gears, train.part(stage).weights
        sun, planet, ring = (w.base_radius for w in (gears.sun, gears.planet, gears.ring))
        mass, moments = weight["planet"]
        inertia[at[f"{stage} carrier"]] = weight["carrier"][1][2] + gears.planets * mass * gears.carrier_radius**2
        inertia[at[f"{stage} sun"]] = weight["sun"][1][2]
        for k in range(1, gears.planets + 1):
            this = f"{stage} planet {k}"
            inertia[at[this]] = moments[2]
            spring(
                mesh(f"{stage} sun-planet {k}"), {f"{stage} sun": sun, this: planet, f"{stage} carrier": -sun - planet}
            )
            spring(mesh(f"{this}-ring"), {this: planet, f"{stage} carrier": ring - planet})
    gear, pinion = (train.part(name).gear for name in ("gear", "pinion"))
    inertia[at["gear"]], inertia[at["pinion"]] = gear.inertia[2], pinion.inertia[2]
    spring(mesh("third"), {"gear": gear.base_radius, "pinion": pinion.base_radius})
    ends = ("rotor", "first carrier"), ("first sun", "second carrier"), ("second sun", "gear"), ("pinion", "generator")
    for (one, two), k in zip(ends, shafts.values(), strict=True):
        spring(k, {one: 1.0, two: -1.0})
    return inertia, stiffness


def frequencies(inertia: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the natural frequencies, Hz, without that of rigid rotation."""
    squares = scipy.linalg.eigh(stiffness, np.diag(inertia), eigvals_only=True)
    return np.sqrt(squares[1:]) / (2.0 * math.pi)


def circle(diameter: float, length: float, modulus: float = 7.92e10) -> float:
    """Return the torsional stiffness of a round bar, N m/rad."""
    return modulus * math.pi * diameter**4 / (32.0 * length)


# What takes longer.


def shares(train: Drivetrain) -> np.ndarray:
    """Return the shares of planets at rest under load, 1 where equal: stages by planets."""
    rest = train.at_rest
    if rest.trouble:
        raise RuntimeError(rest.trouble)
    force = np.array([[rest.forces[f"{stage} sun-planet {k}"] for k in (1, 2, 3)] for stage in STAGES])
    return 3.0 * force / force.sum(axis=1, keepdims=True)


def weighed(train: Drivetrain) -> Drivetrain:
    """Return the gearbox with its weight."""
    return replace(train, gravity=(0.0, -9.81, 0.0))


def off(train: Drivetrain, stage: str, error: float) -> Drivetrain:
    """Return the gearbox with the first pin of a stage off along its circle."""
    part = train.part(stage)
    return train.with_parts(replace(part, gears=replace(part.gears, pin_errors={0: (0.0, error)})))


def ideal(train: Drivetrain) -> Drivetrain:
    """Return the gearbox with a spring of the same mean stiffness in place of each tooth contact."""
    stages = []
    for stage in STAGES:
        part = train.part(stage)
        k = tuple(train.mesh_springs[name].stiffness for name in (f"{stage} sun-planet 1", f"{stage} planet 1-ring"))
        stages.append(replace(part, gears=replace(part.gears, ideal=k)))
    return train.with_parts(*stages).changed("third", pair=gm.IdealMesh)


def led(train: Drivetrain) -> Drivetrain:
    """Return the gearbox as its rotor is led through a run-up at rated torque.

    The rotor's speed is prescribed: at this pace its inertia would take twice the torque of the wind. Times of a curve
    count from the end of the second in which loads come on, so that the record ends a second before the curve.
    """
    slow, fast = SPEEDS
    curve = [["1.2 s", slow], ["5.2 s", fast]]
    drive = SpeedDrive(name="wind", shaft="rotor", speed=fast, curve=curve)
    return replace(train, drives=[drive], loads=[train.part("power")])


def run_up(train: Drivetrain) -> xr.Dataset:
    """Return the tracks of the mesh harmonics of the run-up."""
    track = run_train(led(train), UP).mesh_track.sel(signal=list(HEARD), mesh=list(FOLLOWED))
    out = track.to_dataset(name="track").rename({"moment": "up", "signal": "heard"}).reset_coords()
    out = out.rename({"track_time": "up_time", "track_speed": "up_speed", "track_frequency": "up_frequency"})
    return out.drop_vars([name for name in ("mesh_frequency",) if name in out])


def crossings(train: Drivetrain) -> xr.Dataset:
    """Return the crossings of the run-up with the modes, of teeth as they stand at rest under load.

    They are no springs here: one at the middle of the face of the third stage does not hold its shafts against
    tilting, as teeth along 360 mm do.
    """
    diagram = train_campbell(led(train), ["0 rpm", SPEEDS[1]], harmonics=3, maximum=1600.0)
    ranked = ranked_crossings(diagram, by="response")
    ranked = ranked[ranked.speed_rpm > float(SPEEDS[0].split()[0])].head(CROSSINGS)
    out = xr.Dataset()
    for name in ("frequency_hz", "speed_rpm", "gain", "response"):
        out[f"crossing_{name}"] = "crossing", ranked[name].to_numpy()
    for name in ("order", "name"):
        out[f"crossing_{name}"] = "crossing", ranked[name].to_numpy(dtype=str)
    return out


def computed() -> xr.Dataset:
    """Return all that the page reads."""
    train = load_train("nrel_5mw").train
    out = xr.Dataset(coords={"stage": list(STAGES), "planet": [1, 2, 3], "error": ERRORS})
    for name, one in (("plain", train), ("weight", weighed(train))):
        out[name] = ("stage", "planet"), shares(one)
    found = np.array([[shares(off(train, stage, e))[k] for e in ERRORS] for k, stage in enumerate(STAGES)])
    out["off"] = ("stage", "error", "planet"), found
    named = named_modes(ideal(train))
    named = named.isel(mode=named.frequency.values > 0.1).isel(mode=slice(MODES))
    out["frequency"], out["damping_ratio"], out["mode_name"] = (
        ("mode", named[key].values) for key in ("frequency", "damping_ratio", "name")
    )
    for state, one in (("sound", train), ("broken", train.changed("third", settings={"faults": (BROKEN,)}))):
        record = run_train(one, RUN)
        for key in KEPT:
            label = f"{state}, {key}"
            out[label] = "time", record.measured.sel(sensor=key).values.astype(np.float32)
        out = out.assign_coords(time=record.time.values)
    return out.merge(run_up(train)).merge(crossings(train))


def store() -> None:
    """Write what was computed."""
    data = computed()
    data.to_netcdf(STORED, encoding={name: {"zlib": True} for name in data.data_vars if data[name].dtype.kind == "f"})


if __name__ == "__main__":
    store()
