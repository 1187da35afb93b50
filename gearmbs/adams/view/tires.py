"""Tires and roads of ADAMS/Tire in command files: wheels as parts, their forces as function expressions.

What View makes of an instance is in decks that it exported: the part at the instance's place with its axle along z,
and a force at its centre in the axes of the road's marker, whose reaction is on the road's part.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.tires.property_file import PropertyFile, TireError, read_property_file
from gearmbs.adams.tires.wheel import Hub, hub_forces, read_friction
from gearmbs.adams.view.deckmaker import Deckmaker, Made
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Database, Item
from gearmbs.adams.view.values import Values, fixed

TIRE, ROAD = "forces.vpg_tire", "forces.vpg_road"
"""Definitions, by the last two parts of their names."""
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Of the marker of the force in the wheel's frame, whose z is the axle: ahead, to the left, up."""
UNKNOWN = ("cm_offset", "center_offset", "long_vel", "spin_vel", "vx", "vy", "vz", "wx", "wy", "wz")
"""Numbers of an instance of which no public model shows what they do, unless they are zero."""


def add_wheel(db: Database, item: Item, line: int) -> None:
    """Make the part of a tire, the markers of its centre and of its force, which commands go on to name."""
    part = db.add("part", f"{item.path}.wheel_part", line)
    for name, axes in (("wheel_cm", np.eye(3)), ("gfo_i", AXES)):
        db.add("marker", f"{part.path}.{name}", line).fields["orientation"] = fixed(axes, line=line)
    part.fields["center_of_mass_marker"] = fixed(db.items[f"{part.path}.wheel_cm".lower()], line=line)
    # of tires whose belt moves, which are not modelled
    db.add("part", f"{item.path}.belt_part", line).active = False


def weigh(db: Database, values: Values) -> None:
    """Give the parts of tires their mass, before statements are made."""
    for item in db.of("ude"):
        part = db.items.get(f"{item.path}.wheel_part".lower())
        if values.definition(item) != TIRE or part is None or "mass" in part.fields:
            continue
        for name, keys in (("wheel_tire_mass", ("mass",)), ("Ixx_Iyy", ("ixx", "iyy")), ("Izz", ("izz",))):
            found = db.items.get(f"{item.path}.{name}".lower())
            value = None if found is None else values.variable(found)
            if isinstance(value, (int, float)):
                part.fields |= {key: fixed(float(value), line=item.line) for key in keys}


def _held(m: Deckmaker, item: Item, name: str, default: Any = None) -> Any:
    found = m.db.items.get(f"{item.path}.{name}".lower())
    return default if found is None else m.values.variable(found)


def _file(m: Deckmaker, item: Item, name: str) -> PropertyFile:
    """Return a property file beside the command file.

    Raises
    ------
    ViewError
    """
    given = str(_held(m, item, name, ""))
    path: Path | None = m.beside(given)
    if path is None:
        raise ViewError(f"its {name} {given[-60:] or '(none)'} is not beside the command file")
    try:
        return read_property_file(path)
    except (TireError, OSError) as error:
        raise ViewError(str(error)) from error


def make_tire(m: Deckmaker, item: Item) -> None:
    """GFORCE of a tire, with VARIABLEs and DIFFs that its expressions name.

    Raises
    ------
    ViewError
    """
    part = m.db.items.get(f"{item.path}.wheel_part".lower())
    if part is None or "mass" not in part.fields:
        raise ViewError("its wheel_tire_mass is missing")
    for name in UNKNOWN:
        value = _held(m, item, name, 0.0)
        if value != 0.0:
            raise ViewError(f"{name} = {value}; give 0, and a part modify rigid_body initial_velocity")
    floating, road = _held(m, item, "j_fmarker"), _held(m, item, "ref_marker")
    if not isinstance(floating, Item) or floating.kind != "floating_marker":
        raise ViewError("its j_fmarker is missing")
    if not isinstance(road, Item) or road.kind != "marker":
        raise ViewError("its ref_marker is missing")
    side = str(_held(m, item, "side", "left")).lower()
    if side not in ("left", "right"):
        raise ViewError(f"side = {side[:30]}; give left or right")
    tire = _file(m, item, "property_file")
    centre = m.db.items.get(f"{part.path}.gfo_i".lower())
    if centre is None or centre.kind != "marker":
        raise ViewError(f"the marker {part.path}.gfo_i of its force was taken away")
    a, r = m.values.pose(centre)
    units = m.db.units
    length, force, time = (units.si(quantity) for quantity in ("length", "force", "time"))
    try:
        friction = read_friction(_file(m, item, "road_property_file"))
        arm = tire.number("UNLOADED_RADIUS") / length
        if not arm > 0.0:
            raise TireError(f"{tire.name}: UNLOADED_RADIUS = {arm * length:g} must be positive")
        tip = m.new_marker(item, part, a, r + a[:, 1] * arm)
        states: dict[str, int] = {}

        def add(head: str, name: str, *arguments: str) -> None:
            # lines break at operators between blanks
            spaced = tuple(re.sub(r"(?<!\*)\*(?!\*)", " * ", one) for one in arguments)
            m.statements.append(Made(head, spaced, f"{item.name}_{name}", item.line))

        def variable(name: str, function: str) -> str:
            made = m.fresh("VARIABLE")
            add(f"VARIABLE/{made}", name, f"FUNCTION = {function}")
            return f"VARVAL({made})"

        def state(name: str) -> str:
            states[name] = m.fresh("DIFF")
            return f"DIF({states[name]})"

        def rate(name: str, function: str) -> None:
            add(f"DIFF/{states[name]}", name, "IC = 0", "STATIC_HOLD", f"FUNCTION = {function}")

        hub = Hub(m.id(centre), tip, m.id(road), arm, length, force, time)
        made = hub_forces(tire, friction, hub, side == "right", variable, state, rate)
    except TireError as error:
        raise ViewError(str(error)) from error
    except ArithmeticError as error:
        raise ViewError(f"{tire.name}: numbers too large or too small to compute with ({error})") from error
    names = ("FX", "FY", "FZ", "TX", "TY", "TZ")
    functions = "\\\\".join(f"{name} = {function}" for name, function in zip(names, made))
    m.add(
        item,
        f"GFORCE/{m.fresh('GFORCE')}",
        f"I = {m.id(centre)}",
        f"JFLOAT = {m.id(floating)}",
        f"RM = {m.id(road)}",
        functions,
    )
