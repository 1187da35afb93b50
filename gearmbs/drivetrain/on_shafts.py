"""What stands on shafts, told with the shaft: wheels and bearings become parts of the drivetrain like others.

And how bearings hold a shaft along its axis. Tapered roller and angular contact bearings carry axial loads one way, so
that two of a shaft are a pair. Unless their senses are given they stand face to face (X): each presses its outer ring
outwards, away from the other one. So the bearings of a gear shaft that is held at both ends usually stand: the inner
rings against shoulders of the shaft, the outer rings set through the covers of the housing. Back to back (O), as for
overhung pinions and hubs, the lines of contact meet the axis further apart; it is told by `FACE_TO_FACE` turned round.

References
----------
.. [1] J. Brändlein, P. Eschmann, L. Hasbargen, K. Weigand, Ball and Roller Bearings, 3rd ed., Wiley, 1999: adjusted
   bearing arrangements.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from gearmbs.drivetrain.connections import BEARINGS, Bearing
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


FACE_TO_FACE = (-1, 1)
"""Senses of the bearings at the lower and the higher station of a shaft whose pair stands face to face; see above."""


def senses(train: Drivetrain) -> dict[str, int]:
    """Return the sense of each one-sided bearing, by name: the given one, else that of the pair of its shaft.

    Bearings whose sense nothing tells, as of three on a shaft, are left out.
    """
    out: dict[str, int] = {}
    for shaft in train.shafts:
        mine = sorted((b for b in train.bearings if b.shaft == shaft.name and b.is_one_sided), key=train.station)
        told = {b.name: b.told_sense for b in mine}
        if len(mine) == 2:
            given = {k: sense for k, sense in enumerate(told.values()) if sense is not None}
            pair = FACE_TO_FACE if not given else tuple(given.get(k, -given.get(1 - k, 0)) for k in (0, 1))
            told = dict(zip(told, pair))
        out |= {name: sense for name, sense in told.items() if sense is not None}
    return out


def arrangement(train: Drivetrain, shaft: str) -> str:
    """Return how the pair of one-sided bearings of a shaft stands, in words; empty where there is none."""
    mine = sorted((b for b in train.bearings if b.shaft == shaft and b.is_one_sided), key=train.station)
    if len(mine) != 2 or any(b.name not in train.senses for b in mine):
        return ""
    pair = tuple(train.senses[b.name] for b in mine)
    if pair[0] == pair[1]:
        return "in tandem"
    why = "" if any(b.told_sense for b in mine) else ", as none of them has a sense"
    return f"{'face to face (X)' if pair == FACE_TO_FACE else 'back to back (O)'}{why}"


def check_thrust(train: Drivetrain, shafts: Collection[str]) -> None:
    """Check that rolling bearings of shafts, which rigid couplings join to one, hold it both ways along its axis.

    Raises
    ------
    DrivetrainError
    """
    mine = [b for b in train.bearings if b.shaft in shafts]
    for bearing in mine:
        require(
            bearing.kind != "rolling" or not bearing.is_one_sided or bearing.name in train.senses,
            f"{bearing.label}: its sense is missing: a {_rolls(bearing)} carries axial loads one way, and only of two "
            f"on a shaft it follows how they stand; give sense=1 if it holds shaft '{bearing.shaft}' against "
            "moving towards higher stations, else sense=-1",
        )
    # what is no rolling bearing, or one of both ways, holds the axis both ways or, as told by its stiffness, not at all
    both = [b for b in mine if not (b.kind == "rolling" and b.thrust != "both ways") and b.holds(len(mine))[:, 2].any()]
    ways = {train.senses[b.name] for b in mine if b.kind == "rolling" and b.is_one_sided}
    if both or len(ways) == 2 or not any(b.kind == "rolling" for b in mine):
        return
    names = ", ".join(f"'{b.name}' ({_rolls(b)})" for b in mine)
    at = f"shaft {' and '.join(map(repr, sorted(shafts)))}: its bearings {names}"
    if not ways:
        raise DrivetrainError(
            f"{at} do not hold it along its axis: rollers without a contact angle press across it alone, and flanges "
            "of NJ and NUP are not modelled; give it one that locates, as a deep groove bearing, or two tapered "
            "roller bearings"
        )
    way = "higher" if 1 in ways else "lower"
    one = next(b.name for b in mine if b.name in train.senses)
    raise DrivetrainError(
        f"{at} hold it against moving towards {way} stations alone, with all senses {ways.pop():+d}; turn the sense "
        f"of one of them, as of '{one}', or leave senses out, which puts two face to face"
    )


def _rolls(bearing: Bearing) -> str:
    """Return what rolls in a bearing, with its designation."""
    if bearing.rolling is None:
        return bearing.kind
    return f"{bearing.rolling.kind} bearing {bearing.rolling.designation}".rstrip()
