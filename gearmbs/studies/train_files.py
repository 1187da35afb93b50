"""A drivetrain as a TOML file, from which it is read again.

Every part is a table of the fields that differ from their defaults, quantities with the units they were given in. What
is written is read back before it counts, and compared number by number with what was to be written: what would not come
back as it is has no form in a file, and is refused with the name of its part.
"""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs._display import settings_of
from gearmbs.bearings import Bearing, Defect
from gearmbs.bearings.defects import as_defects
from gearmbs.drivetrain import Drivetrain, DrivetrainError, RollingContactBearing, Shaft
from gearmbs.drivetrain.connections import rolling_bearing
from gearmbs.drivetrain.description import Description, make_description
from gearmbs.drivetrain.drivetrain import KINDS
from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.parts import GearMesh, Wheel, contact_law, flank_friction
from gearmbs.drivetrain.planetary import PlanetaryStage, planetary_set
from gearmbs.files import write_whole
from gearmbs.flexible import ShaftSection
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec, Material, PlanetarySet
from gearmbs.gears.faults import Fault
from gearmbs.mechanism.parts.functions import TimeFunction, expression
from gearmbs.schema.described import toml_tables, toml_value
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
        If a part holds what no file can: a function of Python, a model in memory, a class of one's own; the message
        names the part.
    """
    train, run = (thing.train, thing.run) if isinstance(thing, Description) else (thing, None)
    told = _exact_tables(train, run)
    # texts of quantities are kept where they are read as what they are; else the numbers in SI are written
    numbers: set[tuple[str, str]] = set()
    while True:
        text = _text(train, run, numbers)
        wrong = _differing(told, _exact_tables(*_read(train, text)))
        if not wrong:
            return text
        if wrong <= numbers:
            names = sorted({name for name, _ in wrong})
            changed = ", ".join(sorted({key for name, key in wrong if name == names[0]}))
            label = train.parts[names[0]].label if names[0] else train.name
            raise DrivetrainError(
                f"{label}: {changed} would be read from a file as another; keep this drivetrain in Python"
            )
        numbers |= wrong


def write_train(thing: Drivetrain | Description, path: str | Path) -> Path:
    """Write a drivetrain as a file; see `train_toml`."""
    return write_whole(path, train_toml(thing))


def _text(train: Drivetrain, run: Any, numbers: set[tuple[str, str]]) -> str:
    """Return the text of a file; of some fields, by part and name, with numbers in SI for all quantities."""
    lines = [f"name = {toml_value(train.name)}"]
    for key, value in settings_of(train):
        if key in HEAD:
            lines.append(f"{key} = {_inline(_form(value, key, ('', key) not in numbers))}")
    for group in KINDS:
        for part in getattr(train, group):
            plain = {key for name, key in numbers if name == part.name}
            lines += _lines(f"{group}.{_key(part.name)}", _part(part, plain))
    own = {} if run is None else _fields(run, "run", ("", "run") not in numbers)
    return "\n".join([*lines, *(_lines("run", own) if own else [])]) + "\n"


def _read(train: Drivetrain, text: str) -> tuple[Drivetrain, Any]:
    with warnings.catch_warnings():
        # they were told when the drivetrain was made
        warnings.simplefilter("ignore")
        try:
            read = make_description(toml_tables(text), train.name, tooth_fault)
        except ValueError as error:
            raise DrivetrainError(f"{train.name}: it has no form in a file that can be read: {error}") from None
    return read.train, read.run


# What two drivetrains are compared by: numbers in SI, texts, and objects by their classes and fields.


def _exact_tables(train: Drivetrain, run: Any) -> dict[str, dict[str, Any]]:
    """Return what a drivetrain is, by part and field."""
    found = {name: _exact_part(part) for name, part in train.parts.items()}
    # no part is without a name
    found[""] = {key: _exact(getattr(train, key)) for key in HEAD}
    if run is not None:
        found[""]["run"] = _exact(run)
    return found


def _differing(one: dict[str, dict[str, Any]], two: dict[str, dict[str, Any]]) -> set[tuple[str, str]]:
    """Return parts and fields of ``one`` that ``two`` has otherwise."""
    return {
        (name, key)
        for name, table in one.items()
        for key, value in table.items()
        if two.get(name, {}).get(key) != value
    }


def _exact_part(part: Any) -> dict[str, Any]:
    found = {item.name: _exact(getattr(part, item.name)) for item in fields(part) if item.init}
    found["kind"] = type(part).__qualname__
    if isinstance(part, GearMesh):
        # laws, frictions and faults may be tables or objects
        settings = {key: value for key, value in part.settings.items() if value is not None}
        for key, read in (("contact", contact_law), ("friction", flank_friction)):
            if key in settings:
                settings[key] = read(settings[key])
        if "faults" in settings:
            settings["faults"] = [tooth_fault(one) for one in settings["faults"]]
        found["settings"] = _exact(settings)
        found["pair"] = None if part.pair is GearPair else _exact(part.pair)
    elif isinstance(part, PlanetaryStage):
        # springs, or what puts bearings between pins and planets, of which a function keeps all but their kind
        found["pins"] = _pins(part, True)
        found["on pins"] = _exact(getattr(part.on_pins, "rolling", None))
        found["masses"] = _exact(part.weights)
    elif isinstance(part, Wheel) and part.flexible is not None and part.flexible.model is None:
        found["body"] = _exact(part.flexible)
    elif isinstance(part, Housing | Shaft) and part.told is not None:
        found["model"] = _exact(part.told)
    elif isinstance(part, RollingContactBearing) and "defects" in part.settings:
        found["settings"] = _exact({**part.settings, "defects": as_defects(part.settings["defects"])})
    return found


def _exact(value: Any) -> Any:
    """Return a value for comparison."""
    if isinstance(value, (bool, str)) or value is None:
        return value
    if isinstance(value, Real):
        return float(value)
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _exact(item) for key, item in value.items() if item is not None}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_exact(item) for item in value]
    if isinstance(value, TimeFunction):
        return value.text
    if _is_pint(value):
        return _told(value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    own = {item.name: _exact(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, (GearSpec, Material, PlanetarySet)):
        # a file has the name of the table only
        own.pop("name", None)
    if isinstance(value, GearSpec) and value.helix_angle == 0.0:
        own.pop("hand")
    return {"": type(value).__qualname__, **own}


# What a file holds, as nested tables of texts, numbers, truths and lists.


def _part(part: Any, numbers: set[str]) -> dict[str, Any]:
    """Return the table of a part, of which some fields have numbers in SI for their quantities."""
    table = {"kind": part.kind} if isinstance(getattr(part, "kind", None), str) else {}
    for name, value in settings_of(part):
        where, texts = f"{part.label}: {name}", name not in numbers
        if name == "name" or value is None or (isinstance(value, Mapping) and not value):
            continue
        if isinstance(part, Wheel) and name == "gear":
            table |= _gear(value, where, texts)
        elif isinstance(part, GearMesh) and name == "pair":
            if value is not GearPair:
                raise DrivetrainError(f"{where} is {value!r}, which no file can hold; keep this drivetrain in Python")
        elif isinstance(part, GearMesh) and name == "settings":
            for key, item in value.items():
                if item is not None:
                    table[key] = _form(item, f"{part.label}: {key}", texts)
        elif isinstance(part, PlanetaryStage) and name == "gears":
            table |= _planetary(value, where, texts)
        elif isinstance(part, PlanetaryStage) and name == "pins":
            table[name] = _pins(part, texts)
        elif name in ("body", "carrier_body") and _in_memory(value):
            raise DrivetrainError(f"{where}: {IN_MEMORY}")
        elif isinstance(part, Housing | Shaft) and name == "model":
            if part.told is None:
                raise DrivetrainError(f"{where}: {IN_MEMORY}")
            table[name] = _form(part.told, where, texts)
        elif isinstance(part, Housing) and name in ("mounts", "modes") and isinstance(value, (list, tuple)):
            table[name] = _within(part, value, texts)
        elif not (isinstance(part, Shaft) and name == "length" and (part.sections or part.model) is not None):
            # of sections the length is their sum, of a model its own
            table[name] = _form(value, where, texts)
    return table


IN_MEMORY = "a model in memory has no form in a file; give the table of its program and files"


def _in_memory(body: Any) -> bool:
    """Return whether the body of a wheel or a carrier has a model that is in no file."""
    model = body.get("model") if isinstance(body, Mapping) else getattr(body, "model", None)
    return model is not None and not isinstance(model, Mapping)


def _pins(stage: PlanetaryStage, texts: bool) -> Any:
    """Return what is between the planets of a stage and their pins."""
    if stage.pins is None:
        return None
    told = _form(stage.pins, f"{stage.label}: pins", texts)
    return {"rolling": told} if isinstance(stage.pins, Bearing) and isinstance(told, dict) else told


def _within(housing: Housing, parts: Any, texts: bool) -> dict[str, Any]:
    """Return the tables of mounts or modes; names that begin with the housing's are told without it."""
    found: dict[str, Any] = {}
    names = {part.name for part in parts}
    for part in parts:
        table = _part(part, set() if texts else {item.name for item in fields(part)})
        short = part.name.removeprefix(f"{housing.name} ")
        if short in names:
            # as where nothing was taken away
            short, table = part.name, {"name": part.name, **table}
        found[short] = table
    return found


def _form(value: Any, where: str, texts: bool = True) -> Any:
    """Return a value as a file can hold it; ``texts`` is whether quantities stand as they were given."""
    if isinstance(value, Given):
        return value.text if texts else float(value)
    if isinstance(value, (bool, str, int, float)) and not isinstance(value, np.generic):
        return value
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, Real):
        return int(value) if isinstance(value, np.integer) else float(value)
    if isinstance(value, Path):
        return str(value)
    if _is_pint(value):
        return _told(value)
    if isinstance(value, Mapping):
        return {str(key): _form(item, f"{where}.{key}", texts) for key, item in value.items() if item is not None}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_form(item, f"{where}[{place}]", texts) for place, item in enumerate(value)]
    for kind, (form, read) in FORMS.items():
        if isinstance(value, kind):
            for given in dict.fromkeys((texts, False)):
                table = form(value, where, given)
                if _reads_as(value, table, read):
                    return table
            raise DrivetrainError(f"{where}: {value!r} has no form in a file; keep this drivetrain in Python")
    if is_dataclass(value) and not isinstance(value, type):
        return _fields(value, where, texts)
    raise DrivetrainError(
        f"{where} is {value!r}, which no file can hold; give a number, a text or a table, or leave it"
    )


def _fields(value: Any, where: str, texts: bool = True) -> dict[str, Any]:
    return {key: _form(item, f"{where}.{key}", texts) for key, item in settings_of(value) if item is not None}


def _is_pint(value: Any) -> bool:
    return hasattr(value, "magnitude") and hasattr(value, "units")


def _told(quantity: Any) -> str:
    """Return a quantity of pint as a text."""
    return f"{float(quantity.magnitude)!r} {quantity.units:~C}"


def _reads_as(value: Any, table: Any, read: Callable[[Any], Any]) -> bool:
    """Return whether an object is made again from a table; what was told when it was made is not told again."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return bool(_exact(read(table)) == _exact(value))
        except (TypeError, ValueError):
            return False


def _law(law: ContactLaw, where: str, texts: bool) -> dict[str, Any]:
    """Return the table of a contact law: the settings of what makes its kind."""
    # one maker calls the damping a factor
    values = {**vars(law), "factor": law.damping}
    taken = [name for name in inspect.signature(ContactLaw.makers()[law.kind]).parameters if name in values]
    return {"kind": law.kind} | {name: _form(values[name], where, texts) for name in taken if name != "kind"}


def _bearing(bearing: Bearing, where: str, texts: bool) -> Any:
    """Return the shortest of what a bearing is read from: its designation, with fields beside it, its fields."""
    table = _fields(bearing, where, texts)
    designation = table.pop("designation", None)
    if designation is None:
        return table
    every = {item.name: getattr(bearing, item.name) for item in fields(bearing) if item.init}
    every = {key: _form(value, where, texts) for key, value in every.items() if value is not None and value != ()}
    forms: list[Any] = [designation]
    for other in ({}, table, every):
        for estimate in ({}, {"estimate": False}):
            forms.append({**other, **estimate, "designation": designation})
    return next((form for form in forms if _reads_as(bearing, form, rolling_bearing)), table)


def _section(section: ShaftSection, where: str, texts: bool) -> dict[str, Any]:
    """Return a piece of a shaft; of the shaft's own material, for another one has no form in a section."""
    if section.material is not None:
        raise DrivetrainError(f"{where}: a section of another material than its shaft has no form in a file")
    told = ("length", "diameter", "bore", "end_diameter", "end_bore")
    values = (section.length, section.outer, section.inner, section.outer_end, section.inner_end)
    return {name: _form(value, where, texts) for name, value in zip(told, values, strict=True)}


def _read_section(table: Any) -> ShaftSection:
    return ShaftSection(table["length"], table["diameter"], table["bore"], table["end_diameter"], table["end_bore"])


def _fault(fault: Fault, where: str, texts: bool) -> dict[str, Any]:
    return {key: _form(item, f"{where}.{key}", texts) for key, item in fault_table(fault).items() if item is not None}


def _defect(defect: Defect, where: str, texts: bool) -> dict[str, Any]:
    return {"kind": defect.label, **_fields(defect, where, texts)}


def _function(function: TimeFunction, where: str, texts: bool) -> str:
    return function.text


FORMS: dict[type, tuple[Callable[[Any, str, bool], Any], Callable[[Any], Any]]] = {
    ContactLaw: (_law, contact_law),
    FlankFriction: (_fields, flank_friction),
    Bearing: (_bearing, rolling_bearing),
    Defect: (_defect, lambda table: as_defects([table])[0]),
    Fault: (_fault, tooth_fault),
    TimeFunction: (_function, expression),
    ShaftSection: (_section, _read_section),
}
"""How objects are told in a file, and what makes them again."""


def _gear(gear: GearSpec, where: str, texts: bool) -> dict[str, Any]:
    """Return the fields of a wheel's teeth and body but those that follow from others; the table has the name."""
    table = _fields(gear, where, texts)
    for key in ("name", "material"):
        table.pop(key, None)
    for key in FOLLOW:
        rest = {name: value for name, value in table.items() if name != key}
        if key in table and _reads_as(gear, rest, lambda t: GearSpec(**t, material=gear.material)):
            table = rest
    material = _fields(gear.material, where, texts)
    material.pop("name", None)
    return table | material


def _planetary(gears: PlanetarySet, where: str, texts: bool) -> dict[str, Any]:
    """Return a planetary set by the teeth of its wheels, what these have in common, and what each has of its own.

    Raises
    ------
    DrivetrainError
        For a set whose wheels differ in material.
    """
    wheels = {member: _gear(getattr(gears, member), where, texts) for member in ("sun", "planet", "ring")}
    sun = wheels["sun"]
    table = {"teeth": [wheel["teeth"] for wheel in wheels.values()], "module": sun["module"], "planets": gears.planets}
    shifts = [wheel.get("profile_shift", 0.0) for wheel in wheels.values()]
    table |= {"profile_shifts": shifts} if any(shifts) else {}
    of_set = ("helix_angle", "pressure_angle", *(("hand",) if gears.sun.helix_angle else ()))
    table |= {key: sun[key] for key in of_set if key in sun}
    table["face_width"] = _form(gears.sun.face_width, where, texts)
    apart = ("teeth", "module", "profile_shift", "internal", "hand", *of_set)
    every = {m: {k: v for k, v in wheel.items() if k not in apart} for m, wheel in wheels.items()}
    common = {k: v for k, v in every["sun"].items() if all(one.get(k) == v for one in every.values())}
    own = {m: {k: v for k, v in one.items() if k not in common} for m, one in every.items()}
    common.pop("face_width", None)
    others = common | {m: one for m, one in own.items() if one}
    table |= {"wheels": others} if others else {}
    for key, value in settings_of(gears):
        if key in ("sun", "planet", "ring", "planets", "name") or value is None:
            continue
        if key == "planet_at_ring":
            table[key] = _gear(value, where, texts)
        elif key == "pin_errors":
            table[key] = {str(int(k) + 1): _form(pair, f"{where}.{key}", texts) for k, pair in value.items()}
        elif key == "faults":
            table[key] = [{"at": at, **_fault(fault, f"{where}.{key}", texts)} for at, fault in value]
        else:
            table[key] = _form(value, f"{where}.{key}", texts)

    def read(table: Any) -> PlanetarySet:
        return planetary_set(table, tooth_fault)

    _check_set(gears, table, read, where)
    for key in PLACED:
        rest = {name: value for name, value in table.items() if name != key}
        if key in table and _reads_as(gears, rest, read):
            table = rest
    return table


def _check_set(gears: PlanetarySet, table: Any, read: Callable[[Any], PlanetarySet], where: str) -> None:
    """Raise DrivetrainError, with the fields that no file can hold, unless a set is read from its table as it is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = _exact(read(table))
        except (TypeError, ValueError) as error:
            raise DrivetrainError(f"{where} has no form in a file: {error}") from None
    told = _exact(gears)
    wrong = sorted(key for key in told if told[key] != found[key])
    if wrong:
        raise DrivetrainError(
            f"{where}: {', '.join(wrong)} has no form in a file, where sun, planets and ring have all in common but "
            "teeth and profile shifts; keep this drivetrain in Python"
        )


# Its text.


def _lines(header: str, table: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table: its own values, then the tables in it."""
    inner = {
        key: value
        for key, value in table.items()
        if isinstance(value, dict) and value and all(isinstance(item, dict) for item in value.values())
    }
    listed = {
        key: value
        for key, value in table.items()
        if isinstance(value, list) and value and all(isinstance(item, dict) for item in value)
    }
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
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else toml_value(name)
