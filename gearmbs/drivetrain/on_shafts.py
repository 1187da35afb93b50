"""What stands on shafts, told with the shaft: wheels and bearings become parts of the drivetrain like others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gearmbs.drivetrain.connections import BEARINGS
from gearmbs.drivetrain.part import DrivetrainError, errors_named, require
from gearmbs.drivetrain.parts import Wheel
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.schema.described import chosen, make

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

USUAL = {True: "rolling", False: "ideal"}
"""Kind of a bearing that names none, by whether something rolls in it."""


def unfolded(train: Drivetrain) -> dict[str, tuple[Any, ...]]:
    """Return shafts, wheels and bearings of a drivetrain, with those that stand in their shafts; empty without any.

    Raises
    ------
    DrivetrainError
    """
    if not any(isinstance(shaft, Shaft) and (shaft.wheels or shaft.bearings) for shaft in train.shafts):
        return {}
    wheels, bearings = list(train.wheels), list(train.bearings)
    for shaft in train.shafts:
        for name, given in (shaft.wheels or {}).items():
            table = _table(shaft.label, "wheels", name, given, "gear")
            wheels.append(_made(Wheel, f"{shaft.label}: wheels.{name}", name, shaft.name, table))
        for name, given in (shaft.bearings or {}).items():
            where = f"{shaft.label}: bearings.{name}"
            table = _table(shaft.label, "bearings", name, given, "rolling")
            kind = str(table.pop("kind", USUAL["rolling" in table]))
            bearings.append(
                _made(chosen(BEARINGS, kind, f"{where}: ", DrivetrainError), where, name, shaft.name, table)
            )
    shafts = tuple(replace(shaft, wheels=None, bearings=None) for shaft in train.shafts)
    return {"shafts": shafts, "wheels": tuple(wheels), "bearings": tuple(bearings)}


def _table(label: str, group: str, name: str, given: Any, what: str) -> dict[str, Any]:
    """Return the table that a pair of station and ``what``, or a table, stands for."""
    if isinstance(given, Mapping):
        return dict(given)
    require(
        isinstance(given, tuple | list) and len(given) == 2,
        f"{label}: {group}.{name} is {given!r}; give a pair of station and {what}, or a table",
    )
    return {"station": given[0], what: given[1]}


def _made(kind: Any, where: str, name: str, shaft: str, table: dict[str, Any]) -> Any:
    with errors_named(where):
        return make(kind, table, where, DrivetrainError, name=name, shaft=shaft)


def with_parts_of_shafts(groups: Mapping[str, Any]) -> dict[str, Any]:
    """Return the groups of tables of a file with the wheels and bearings that stand in tables of shafts."""
    out = {group: dict(tables) if isinstance(tables, Mapping) else tables for group, tables in groups.items()}
    for shaft, given in dict(out["shafts"]).items() if isinstance(out["shafts"], dict) else ():
        if not isinstance(given, Mapping):
            continue
        own = dict(given)
        for group, what in (("wheels", "gear"), ("bearings", "rolling")):
            for name, one in dict(own.pop(group, {})).items():
                table = _table(f"shafts.{shaft}", group, name, one, what)
                require(
                    isinstance(out[group], dict) and name not in out[group],
                    f"shafts.{shaft}: {group}.{name}: the name is in use; choose another",
                )
                if group == "bearings":
                    table.setdefault("kind", USUAL["rolling" in table])
                out[group][name] = {**table, "shaft": shaft}
        out["shafts"][shaft] = own
    return out
