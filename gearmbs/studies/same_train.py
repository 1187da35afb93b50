"""Whether a record is one of a drivetrain."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from gearmbs.drivetrain import Drivetrain, DrivetrainError
from gearmbs.studies.trains import described
from gearmbs.units import si_unit, to_si

ADDRESS = " at 0x"
"""What a text holds that names an object by its place in memory, which is another in each process."""
ROUNDED = 1e-12
"""Relative difference of one quantity in two units: rounding of the conversion is far below."""
SAME = 1e-6
"""Relative difference of mesh frequencies up to which they are one: rounding of speeds and ratios is far below."""


def check_record_of(train: Drivetrain, record: xr.Dataset) -> None:
    """Refuse the record of another drivetrain.

    A record describes the parts it is of, which are compared field by field; of what one of them does not know, as
    after a change of version, nothing is said. Names, mesh frequencies and teeth are compared of each record.

    Raises
    ------
    DrivetrainError
        With the first part and field that differ, and both values.
    """
    text = record.attrs.get("train_json")
    found = next(_by_names(train, record), None)
    if found is None and text is not None:
        parts = json.loads(json.dumps(described({name: part for name, part in train.parts.items()})))
        there = json.loads(str(text))
        for drive in train.drives:
            # a drive's curve is how a drivetrain ran, not what it is; its nominal speed is compared
            for one in (parts, there):
                one.get(drive.name, {}).pop("curve", None)
        found = next(_by_parts(parts, there), None)
    if found is None:
        found = next(_by_frequencies(train, record), None)
    if found is not None:
        raise DrivetrainError(
            f"{train.name}: the record is of another drivetrain: {found}; give the record of this drivetrain"
        )


def _by_names(train: Drivetrain, record: xr.Dataset) -> Iterator[str]:
    """Yield names of shafts, meshes and sensors that differ."""
    own = {
        "shaft": list(train.turning),
        "mesh": [mesh.name for mesh in train.meshings],
        "bearing": [*(bearing.name for bearing in train.bearings), *train.pins],
        "sensor": [sensor.name for sensor in train.sensors],
    }
    for kind, names in own.items():
        there = [str(name) for name in record[kind].values] if kind in record.coords else names
        if there != names:
            yield (
                f"its {kind} names are {', '.join(there) or 'none'}, those of the drivetrain "
                f"{', '.join(names) or 'none'}"
            )


def _by_parts(own: dict[str, Any], there: dict[str, Any]) -> Iterator[str]:
    """Yield parts that differ, with the first field and both values."""
    for name in dict.fromkeys([*own, *there]):
        if name not in own or name not in there:
            yield f"'{name}' is a part of {'the drivetrain' if name in own else 'the record'} alone"
            continue
        for where, one, two in _differences(own[name], there[name], ""):
            yield f"{where or 'the whole'} of '{name}' is {_short(two)} in the record, {_short(one)} in the drivetrain"


def _differences(own: Any, there: Any, where: str) -> Iterator[tuple[str, Any, Any]]:
    """Yield place and both values of what differs in two descriptions, of tables only the keys that both have."""
    if isinstance(own, dict) and isinstance(there, dict):
        keys = dict.fromkeys([*own, *there])
        for key in [k for k in keys if k in own and k in there] if "kind" in own else keys:
            yield from _differences(own.get(key), there.get(key), f"{where}.{key}" if where else key)
    elif isinstance(own, list) and isinstance(there, list) and len(own) == len(there):
        for k, (one, two) in enumerate(zip(own, there)):
            yield from _differences(one, two, f"{where}[{k}]")
    elif not _same(own, there):
        yield where, own, there


def _same(own: Any, there: Any) -> bool:
    """Return whether two values are one: numbers that are none, quantities in other units, places in memory."""
    if own == there or json.dumps(own) == json.dumps(there) or any(ADDRESS in str(value) for value in (own, there)):
        return True
    try:
        unit = next(unit for unit in map(si_unit, (own, there)) if unit is not None)
        one, two = (to_si(value, unit) for value in (own, there))
    except (StopIteration, TypeError, ValueError):
        return False
    return math.isclose(one, two, rel_tol=ROUNDED)


def _by_frequencies(train: Drivetrain, record: xr.Dataset) -> Iterator[str]:
    """Yield nominal mesh frequencies that differ, and teeth."""
    if "nominal_frequency" in record.coords:
        for mesh in train.meshings:
            own = train.kinematics.mesh_frequency(mesh.name)
            there = float(record.nominal_frequency.sel(mesh=mesh.name))
            if abs(own - there) > SAME * max(abs(own), abs(there)):
                yield f"mesh '{mesh.name}' has {there:.6g} Hz in the record, {own:.6g} Hz in the drivetrain"
    if train.meshings and "mesh_teeth" in record.attrs:
        there_teeth = [int(z) for z in np.atleast_1d(record.attrs["mesh_teeth"])]
        own_teeth = [gear.teeth for gear in train.meshings[0].gears]
        if own_teeth != there_teeth:
            first = train.meshings[0].name
            yield f"mesh '{first}' has teeth {there_teeth} in the record, {own_teeth} in the drivetrain"


def _short(value: Any) -> str:
    """Return a value as one reads it, shortened."""
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
