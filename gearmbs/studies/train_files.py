"""A drivetrain as a TOML file, from which it is read again.

Every part is a table of the fields that differ from their defaults, quantities with the units they were given in. What
is written is read back before it counts: what would not come back as it is has no form in a file, and is refused with
the name of its part.
"""

from __future__ import annotations

import inspect
import json
import re
import tomllib
import warnings
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs._display import settings_of
from gearmbs.bearings import Bearing, Defect
from gearmbs.bearings.defects import as_defects
from gearmbs.drivetrain import Drivetrain, DrivetrainError, Shaft
from gearmbs.drivetrain.connections import rolling_bearing
from gearmbs.drivetrain.description import Description, make_description
from gearmbs.drivetrain.drivetrain import KINDS
from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.parts import GearMesh, Wheel, contact_law, flank_friction
from gearmbs.drivetrain.planetary import PlanetaryStage, planetary_set
from gearmbs.files import write_whole
from gearmbs.flexible import ShaftSection
from gearmbs.gears import ContactLaw, FlankFriction, GearSpec, PlanetarySet
from gearmbs.gears.faults import Fault
from gearmbs.mechanism.parts.functions import TimeFunction, expression
from gearmbs.schema.described import toml_value
from gearmbs.studies.case.tooth_faults import fault_table, tooth_fault
from gearmbs.units import Given

HEAD = ("running", "gravity", "run_up")
"""Fields of a drivetrain that are no parts."""


PLACED = ("angles", "carrier_radius", "pin_errors")
"""Fields of a planetary set that follow from the others where its planets are evenly spaced and in place."""
FOLLOW = ("rim_thickness", "fillet_radius", "dedendum", "addendum")
"""Fields of a wheel that the standard's proportions give where they are not given, the dependent ones first."""


def train_toml(thing: Drivetrain | Description) -> str:
    """Return the file of a drivetrain, from which `gearmbs.drivetrain.read_description` makes it again.

    Parameters
    ----------
    thing : Drivetrain or Description
        A description also has the settings of its run.

    Raises
    ------
    DrivetrainError
        If a part holds what no file can: a function of Python, a model in memory, a class; the message names the part.
    """
    train = thing.train if isinstance(thing, Description) else thing
    tables = _tables(thing)
    lines = [f"name = {toml_value(train.name)}"]
    lines += [f"{key} = {_inline(tables[key])}" for key in HEAD if key in tables]
    for group in KINDS:
        for name, table in tables.get(group, {}).items():
            lines += _lines(f"{group}.{_key(name)}", table)
    lines += _lines("run", tables["run"]) if "run" in tables else []
    text = "\n".join(lines) + "\n"
    with warnings.catch_warnings():
        # they were told when the drivetrain was made
        warnings.simplefilter("ignore")
        try:
            again = _tables(make_description(tomllib.loads(text), train.name, tooth_fault))
        except ValueError as error:
            raise DrivetrainError(f"{train.name}: it has no form in a file that can be read: {error}") from None
    for group in KINDS:
        for name, table in tables.get(group, {}).items():
            other = again.get(group, {}).get(name, {})
            changed = sorted(key for key in {*table, *other} if table.get(key) != other.get(key))
            if changed:
                raise DrivetrainError(
                    f"{train.parts[name].label}: {', '.join(changed)} would be read from a file as another; keep this "
                    "drivetrain in Python"
                )
    return text


def write_train(thing: Drivetrain | Description, path: str | Path) -> Path:
    """Write a drivetrain as a file; see `train_toml`."""
    return write_whole(path, train_toml(thing))


# What a file holds, as nested tables of texts, numbers, truths and lists.


def _tables(thing: Drivetrain | Description) -> dict[str, Any]:
    """Return the nested tables that describe a drivetrain."""
    train, run = (thing.train, thing.run) if isinstance(thing, Description) else (thing, None)
    tables: dict[str, Any] = {key: _form(value, key) for key, value in settings_of(train) if key in HEAD}
    for group in KINDS:
        parts = {part.name: _part(part) for part in getattr(train, group)}
        tables |= {group: parts} if parts else {}
    own = {} if run is None else _fields(run, "run")
    return tables | ({"run": own} if own else {})


def _part(part: Any) -> dict[str, Any]:
    """Return the table of a part."""
    table = {"kind": part.kind} if isinstance(getattr(part, "kind", None), str) else {}
    for name, value in settings_of(part):
        where = f"{part.label}: {name}"
        if name == "name" or value is None or (isinstance(value, Mapping) and not value):
            continue
        if isinstance(part, Wheel) and name == "gear":
            table |= _gear(value, where)
        elif isinstance(part, GearMesh) and name == "settings":
            table |= {key: _form(item, f"{part.label}: {key}") for key, item in value.items() if item is not None}
        elif isinstance(part, PlanetaryStage) and name == "gears":
            table |= _planetary(value, where)
        elif isinstance(part, Housing) and name in ("mounts", "modes") and isinstance(value, (list, tuple)):
            # their names begin with the housing's where a file has told them
            table[name] = {one.name.removeprefix(f"{part.name} "): _part(one) for one in value}
        elif not (isinstance(part, Shaft) and name == "length" and part.sections is not None):
            # of sections the length is their sum
            table[name] = _form(value, where)
    return table


def _form(value: Any, where: str) -> Any:
    """Return a value as a file can hold it."""
    if isinstance(value, Given):
        return value.text
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _form(item, f"{where}.{key}") for key, item in value.items() if item is not None}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_form(item, f"{where}[{place}]") for place, item in enumerate(value)]
    for kind, (form, read) in FORMS.items():
        if isinstance(value, kind):
            table = form(value, where)
            _check(value, table, read, where)
            return table
    if is_dataclass(value) and not isinstance(value, type):
        return _fields(value, where)
    raise DrivetrainError(
        f"{where} is {value!r}, which no file can hold; give a number, a text or a table, or leave it"
    )


def _fields(value: Any, where: str) -> dict[str, Any]:
    return {key: _form(item, f"{where}.{key}") for key, item in settings_of(value) if item is not None}


def _check(value: Any, table: Any, read: Callable[[Any], Any], where: str) -> None:
    """Raise DrivetrainError unless an object is read from its table as it is."""
    if not _reads_as(value, table, read):
        raise DrivetrainError(f"{where}: {value!r} has no form in a file; keep this drivetrain in Python")


def _reads_as(value: Any, table: Any, read: Callable[[Any], Any]) -> bool:
    """Return whether an object is made again from a table; what was told when it was made is not told again."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return bool(read(table) == value)
        except (TypeError, ValueError):
            return False


def _law(law: ContactLaw, where: str) -> dict[str, Any]:
    """Return the table of a contact law: the settings of what makes its kind."""
    taken = inspect.signature(ContactLaw.makers()[law.kind]).parameters
    return {"kind": law.kind} | {
        name: _form(value, f"{where}.{name}") for name, value in vars(law).items() if name in taken and name != "kind"
    }


def _bearing(bearing: Bearing, where: str) -> Any:
    """Return the designation of a bearing if that says all, with what it leaves open if not, else all its fields."""
    table = _fields(bearing, where)
    designation = table.pop("designation", None)
    if designation is None:
        return table
    whole = {"designation": designation, **table}
    return next((given for given in (designation, whole) if _reads_as(bearing, given, rolling_bearing)), whole)


def _section(section: ShaftSection, where: str) -> dict[str, Any]:
    """Return a piece of a shaft; of the shaft's own material, which has no form in a section."""
    if section.material is not None:
        raise DrivetrainError(f"{where}: a section of another material than its shaft has no form in a file")
    return {
        "length": _form(section.length, where), "diameter": _form(section.outer, where),
        "bore": _form(section.inner, where), "end_diameter": _form(section.outer_end, where),
        "end_bore": _form(section.inner_end, where),
    }  # fmt: skip


def _fault(fault: Fault, where: str) -> dict[str, Any]:
    return {key: _form(item, f"{where}.{key}") for key, item in fault_table(fault).items() if item is not None}


FORMS: dict[type, tuple[Callable[[Any, str], Any], Callable[[Any], Any]]] = {
    ContactLaw: (_law, contact_law),
    Bearing: (_bearing, rolling_bearing),
    Fault: (_fault, tooth_fault),
    FlankFriction: (_fields, flank_friction),
    Defect: (lambda defect, where: {"kind": defect.label, **_fields(defect, where)}, lambda t: as_defects([t])[0]),
    TimeFunction: (lambda function, where: function.text, expression),
    ShaftSection: (
        _section,
        lambda t: ShaftSection(t["length"], t["diameter"], t["bore"], t["end_diameter"], t["end_bore"]),
    ),
}
"""How objects are told in a file, and what makes them again."""


def _gear(gear: GearSpec, where: str) -> dict[str, Any]:
    """Return the fields of a wheel's teeth and body but those that follow from others; the table has the name."""
    table = _fields(gear, where)
    for key in ("name", "material"):
        table.pop(key, None)
    for key in FOLLOW:
        rest = {name: value for name, value in table.items() if name != key}
        if key in table and GearSpec(**rest, material=gear.material, name=gear.name) == gear:
            table = rest
    return table | _fields(gear.material, where)


def _planetary(gears: PlanetarySet, where: str) -> dict[str, Any]:
    """Return a planetary set by the teeth of its wheels, what these have in common, and what each has of its own.

    Raises
    ------
    DrivetrainError
        For a set whose wheels differ in material.
    """
    wheels = {member: _gear(getattr(gears, member), where) for member in ("sun", "planet", "ring")}
    sun = wheels["sun"]
    table = {"teeth": [wheel["teeth"] for wheel in wheels.values()], "module": sun["module"], "planets": gears.planets}
    shifts = [wheel.get("profile_shift", 0.0) for wheel in wheels.values()]
    table |= {"profile_shifts": shifts} if any(shifts) else {}
    of_set = ("helix_angle", "hand", "pressure_angle")
    table |= {key: sun[key] for key in of_set if key in sun}
    table["face_width"] = _form(gears.sun.face_width, where)
    apart = ("teeth", "module", "profile_shift", "internal", "name", *of_set)
    fields = {m: {k: v for k, v in wheel.items() if k not in apart} for m, wheel in wheels.items()}
    common = {k: v for k, v in fields["sun"].items() if all(one.get(k) == v for one in fields.values())}
    own = {m: {k: v for k, v in one.items() if k not in common} for m, one in fields.items()}
    common.pop("face_width", None)
    others = common | {m: one for m, one in own.items() if one}
    table |= {"wheels": others} if others else {}
    for key, value in settings_of(gears):
        if key in ("sun", "planet", "ring", "planets", "name") or value is None:
            continue
        if key == "pin_errors":
            table[key] = {str(int(k) + 1): _form(pair, f"{where}.{key}") for k, pair in value.items()}
        elif key == "faults":
            table[key] = [{"at": at, **_fault(fault, f"{where}.{key}")} for at, fault in value]
        else:
            table[key] = _form(value, f"{where}.{key}")

    def read(table: dict[str, Any]) -> PlanetarySet:
        return planetary_set({**table, "name": gears.name}, tooth_fault)

    _check(gears, table, read, where)
    for key in PLACED:
        rest = {name: value for name, value in table.items() if name != key}
        if key in table and _reads_as(gears, rest, read):
            table = rest
    return table


# Its text.


def _lines(header: str, table: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table: its own values, then the tables in it."""
    inner = {
        k: v for k, v in table.items() if isinstance(v, dict) and v and all(isinstance(i, dict) for i in v.values())
    }
    listed = {k: v for k, v in table.items() if isinstance(v, list) and v and all(isinstance(i, dict) for i in v)}
    lines = ["", f"[{header}]"]
    lines += [f"{_key(k)} = {_inline(v)}" for k, v in table.items() if k not in inner and k not in listed]
    for key, tables in inner.items():
        for name, one in tables.items():
            lines += _lines(f"{header}.{_key(key)}.{_key(name)}", one)
    for key, rows in listed.items():
        for row in rows:
            lines += ["", f"[[{header}.{_key(key)}]]", *(f"{_key(k)} = {_inline(v)}" for k, v in row.items())]
    return lines


def _inline(value: Any) -> str:
    """Return a value in one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_inline(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return toml_value(value)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)
