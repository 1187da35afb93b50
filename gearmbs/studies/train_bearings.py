"""Bearings of a drivetrain over a record of it: their lives, and whether they carry what they should."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.bearings import Bearing, mean_load, rating_life
from gearmbs.bearings.kinds import TILTED, BearingError
from gearmbs.bearings.rating import life_exponent, paired_thrust
from gearmbs.drivetrain import Drivetrain

LIFE_LOAD_ERROR = "life_load_error"
"""Name of the numerical errors of equivalent loads in a record that was made with an accuracy, N."""

UNLOADED = 1e-3
"""Share of the force by its torque below which a mesh carries nothing: what is left is damping and rounding."""


class BearingLife(NamedTuple):
    """Life of a bearing under the loads of a record, by ISO 281.

    Attributes
    ----------
    name, designation : str
    rating, load : float
        C and the equivalent load, N; NaN of a bearing that has none, see ``note``.
    turns, hours : float
        L10 in revolutions and in hours.
    source : str
        Whose C it is: a maker, the formula of the standard, or the description of the drivetrain.
    note : str
        Why there is no life, or what else is to be known of it.
    error : float
        Numerical error of turns and hours, as a part of them; NaN if the record was made without an accuracy.
    """

    name: str
    designation: str
    rating: float
    load: float
    turns: float
    hours: float
    source: str
    note: str
    error: float = np.nan


class _Loaded(NamedTuple):
    """A bearing in which something rolls: force of the seat across and along the axis (m, 3), speed of rings (m,)."""

    name: str
    rolling: Bearing
    force: np.ndarray
    speed: np.ndarray


def bearing_lives(train: Drivetrain, record: xr.Dataset) -> list[BearingLife]:
    """Return the lives of all bearings of a drivetrain that say what rolls in them, from the forces of a record.

    A bearing without a life, as one of cylindrical rollers with an axial load, has NaN and a note that says why.
    """
    errors = record[LIFE_LOAD_ERROR] if LIFE_LOAD_ERROR in record else None
    out = []
    for name, rolling, load, mean, note in _equivalent(train, record):
        turns = hours = error = np.nan
        if np.isfinite(load):
            turns = rating_life(rolling, load) if load > 0.0 else np.inf
            hours = turns * 2.0 * np.pi / mean / 3600.0 if mean > 0.0 else np.inf
        if errors is not None and load > 0.0:
            error = life_exponent(rolling) * float(errors.sel(bearing=name)) / load
        source = _source(rolling)
        out.append(
            BearingLife(name, rolling.designation or "-", rolling.rating, load, turns, hours, source, note, error)
        )
    return out


def equivalent_loads(train: Drivetrain, record: xr.Dataset, first: int = 0, stop: int | None = None) -> np.ndarray:
    """Return the equivalent loads of all bearings of a record, N, NaN where none is known, from some of its samples."""
    part = record.isel(time=slice(first, stop))
    found = {name: load for name, _, load, _, _ in _equivalent(train, part)}
    return np.array([found.get(str(name), np.nan) for name in record["bearing"].values])


def _equivalent(train: Drivetrain, record: xr.Dataset) -> Iterator[tuple[str, Bearing, float, float, str]]:
    """Yield name, bearing, equivalent load (N), mean speed of the rings (rad/s) and a note of what rolls."""
    paired = _paired(train, record)
    for name, rolling, force, speed in _loaded(train, record):
        note, load = _note(train, name, force, name in paired), np.nan
        try:
            axial = paired.get(name, force[:, 2])
            load = mean_load(rolling, np.hypot(force[:, 0], force[:, 1]), axial, speed) if speed.any() else 0.0
        except BearingError as error:
            note = f"no life: {error}"
        yield name, rolling, load, float(speed.mean()), note


def _source(rolling: Bearing) -> str:
    if rolling.dynamic_rating is None:
        return "formula of ISO 281"
    return rolling.rating_source or "as given"


def _loaded(train: Drivetrain, record: xr.Dataset) -> Iterator[_Loaded]:
    forces = record["bearing_force"]
    turning, rest = set(map(str, record.shaft.values)), np.zeros(record.sizes["time"])

    def speed(one: str, two: str) -> np.ndarray:
        found = [record["speed"].sel(shaft=b).values if b in turning else rest for b in (one, two)]
        return np.abs(found[0] - found[1])

    for bearing in train.bearings:
        if bearing.rolling is not None:
            force = _along(train, record, bearing)
            yield _Loaded(bearing.name, bearing.rolling, force, speed(bearing.shaft, train.carrier(bearing)))
    for pin, (stage, _) in train.pins.items():
        rolling = getattr(stage.on_pins, "rolling", None)
        if rolling is not None:
            force = forces.sel(bearing=pin).values
            yield _Loaded(pin, rolling, force, speed(pin.removesuffix(" pin"), stage.carrier))


def _along(train: Drivetrain, record: xr.Dataset, bearing: Any) -> np.ndarray:
    """Return the force of a bearing's seat on its shaft in the shaft's axes, shape (m, 3)."""
    return record["bearing_force"].sel(bearing=bearing.name).values @ train.layout.seats[bearing.shaft].axes


def _paired(train: Drivetrain, record: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the axial loads of pairs of one-sided bearings that are springs or joints, which act both ways, N."""
    out: dict[str, np.ndarray] = {}
    for shaft in train.shafts:
        mine = [b for b in train.bearings if b.shaft == shaft.name and b.is_one_sided and b.kind != "rolling"]
        mine = sorted((b for b in mine if b.name in train.senses), key=lambda b: -train.senses[b.name])
        if [train.senses[b.name] for b in mine] != [1, -1]:
            continue
        # the first carries what pushes the shaft towards +z, against which all seats of the shaft stand
        forces = [_along(train, record, b) for b in mine]
        outer = -np.sum([_along(train, record, b)[:, 2] for b in train.bearings if b.shaft == shaft.name], axis=0)
        radial = [np.hypot(f[:, 0], f[:, 1]) for f in forces]
        loads = [paired_thrust(mine[0].rolling, mine[1].rolling, (a, b), k) for a, b, k in zip(*radial, outer)]
        out |= dict(zip((b.name for b in mine), np.array(loads).T))
    return out


def _note(train: Drivetrain, name: str, force: np.ndarray, is_paired: bool) -> str:
    bearing = next((b for b in train.bearings if b.name == name), None)
    if bearing is None or not bearing.is_one_sided:
        return ""
    if is_paired:
        return "axial load with the thrust that radial loads induce in the pair"
    if bearing.kind != "rolling":
        return "its axial stiffness acts both ways: the thrust that radial loads induce in a pair is missing"
    return _against(train, bearing, force)


def _against(train: Drivetrain, bearing: Any, force: np.ndarray) -> str:
    """Return what is said of a one-sided bearing that carries against its sense in the mean; empty if it does not."""
    sense = train.senses[bearing.name]
    along = sense * float(force[:, 2].mean())
    if along <= TILTED * float(np.linalg.norm(force, axis=1).mean()):
        return ""
    return (
        f"{along:.4g} N along the axis press against its sense ({sense:+d}) and are carried across the groove, on a "
        "shoulder that most such bearings do not have; turn the senses of the shaft, or preload the pair"
    )


def bearing_remarks(train: Drivetrain, record: xr.Dataset) -> list[str]:
    """Return what a record says of shafts that have left their bearings, and of bearings loaded on the wrong side."""
    out = []
    for mesh in train.meshes:
        torque = abs(train.power.on_driven(mesh.name))
        nominal = torque / train.pairs[mesh.name].geometry.driven.base_radius
        mean = float(record["normal_force"].sel(mesh=mesh.name).mean())
        if mean < UNLOADED * nominal:
            shafts = [wheel.shaft for wheel in train.wheels_of(mesh)]
            names = ", ".join(f"'{b.name}'" for b in train.bearings if b.shaft in shafts)
            out.append(
                f"mesh '{mesh.name}': its teeth carry {mean:.3g} N in the mean, where the torque of {torque:.4g} N m "
                f"on its driven wheel asks for {nominal:.4g} N: shaft '{shafts[0]}' or '{shafts[1]}' has left its "
                f"place; look at the senses, clearances and axial stiffness of {names}"
            )
    for bearing in train.bearings:
        if bearing.kind == "rolling" and bearing.is_one_sided:
            told = _against(train, bearing, _along(train, record, bearing))
            out += [f"{bearing.label}: {told}"] if told else []
    return out
