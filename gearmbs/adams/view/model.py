"""The objects of a model by their names in a tree, what is stored in them, and the units they are in."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from gearmbs.adams.parse.deck import FORCE, LENGTH, MASS, TIME
from gearmbs.adams.view.lexer import ViewError, plain_name

DEGREE = math.pi / 180.0
ANGLE = {"DEGREES": DEGREE, "RADIANS": 1.0}
TABLES = {"force": FORCE, "mass": MASS, "length": LENGTH, "time": TIME, "angle": ANGLE}
SHORT = {
    "n": "NEWTON", "kn": "KNEWTON", "lbf": "POUND_FORCE", "kg_force": "KILOGRAM_FORCE", "kgf": "KILOGRAM_FORCE",
    "mn": "MILLINEWTON", "kg": "KILOGRAM", "g": "GRAM", "lbm": "POUND_MASS", "lb": "POUND_MASS", "mm": "MILLIMETER",
    "cm": "CENTIMETER", "m": "METER", "km": "KILOMETER", "in": "INCH", "ft": "FOOT", "sec": "SECOND", "s": "SECOND",
    "ms": "MILLISECONDS", "millisec": "MILLISECONDS", "min": "MINUTE", "hr": "HOUR", "d": "DEGREES", "deg": "DEGREES",
    "r": "RADIANS", "rad": "RADIANS", "um": "MICROMETER", "meters": "METER", "newtons": "NEWTON",
}  # fmt: skip
"""How units are abbreviated where their names are not merely cut."""


def unit_named(word: str, quantity: str | None = None) -> tuple[str, str, float] | None:
    """Return quantity, full name and SI value of a unit, None of what is no unit."""
    upper = SHORT.get(word.lower(), word.upper())
    tables = TABLES if quantity is None else {quantity: TABLES[quantity]}
    for name, table in tables.items():
        if upper in table:
            return name, upper, table[upper]
    found = [(q, n, table[n]) for q, table in tables.items() for n in table if len(upper) > 2 and n.startswith(upper)]
    return found[0] if len(found) == 1 else None


@dataclass
class Units:
    """The units of numbers: names and SI values by quantity.

    Attributes
    ----------
    names : dict of str to str
    converted : set of str
        Quantities in whose units numbers with units behind them have been brought.
    """

    names: dict[str, str] = field(
        default_factory=lambda: {
            "force": "NEWTON",
            "mass": "KILOGRAM",
            "length": "MILLIMETER",
            "time": "SECOND",
            "angle": "DEGREES",
        }
    )
    converted: set[str] = field(default_factory=set)

    def si(self, quantity: str) -> float:
        """Return the SI value of the unit of a quantity."""
        return TABLES[quantity][self.names[quantity]]

    @property
    def radian(self) -> float:
        """Radians in the unit of angle."""
        return self.si("angle")

    def choose(self, quantity: str, word: str, line: int) -> None:
        """Set a unit by its name.

        Raises
        ------
        ViewError
        """
        found = unit_named(word, quantity)
        if found is None:
            raise ViewError(f"{quantity} = {word[:40]}: no such unit; one of {', '.join(TABLES[quantity])}", line)
        self.names[quantity] = found[1]


@dataclass(eq=False)
class Item:
    """An object of the database.

    Attributes
    ----------
    kind : str
    path : str
        Its full name, such as .model.PART_2.MARKER_1.
    line : int
        Where it was made.
    fields : dict
        What was stored, by argument: `gearmbs.adams.view.values.Stored`.
    active : bool
        Whether it is switched on itself: see `gearmbs.adams.view.simulations.activity`.
    told : int
        The database's version when a command switched it on or off last; 0 if none has.
    used : set of str
        Arguments that its statement has asked for.
    """

    kind: str
    path: str
    line: int = 0
    fields: dict[str, Any] = field(default_factory=dict)
    active: bool = True
    told: int = 0
    used: set[str] = field(default_factory=set)
    frame: Any = None
    children: dict[str, Item] = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """The last part of its full name."""
        return self.path.rsplit(".", 1)[-1]

    @property
    def parent(self) -> str:
        """The full name of what it belongs to."""
        return self.path.rsplit(".", 1)[0]


PARTS = ("part", "point_mass", "flexible_body")
UNREAD = "geometry_of_file"
"""What parts have of files that are not read."""
JOINTS = frozenset(
    "revolute translational cylindrical spherical fixed universal hooke convel planar screw rackpin".split()
)
"""Commands that make joints."""
BLOCKS = {
    "acontrols.controls_input": ("_input", ""), "acontrols.controls_sum": ("_input1", "_input2", ""),
    "acontrols.controls_gain": ("_input", ""), "acontrols.controls_pid": ("_input", "_input_d", ""),
}  # fmt: skip
"""State variables that blocks of Controls have, by the last two parts of their definition's name: endings of names."""
GENERAL_MOTION = "constraints.general_motion"
DIRECTIONS = {"t1": "X", "t2": "Y", "t3": "Z", "r1": "B1", "r2": "B2", "r3": "B3"}
"""Components of a general motion by the endings of their names."""
PLACED = (*PARTS, "marker", "floating_marker", "point", "model")
"""Kinds that have a place, and may be what others are placed relative to."""


class Database:
    """All objects, found by their full names or by the ends of these; capital letters make no difference.

    Attributes
    ----------
    units : Units
    model : Item or None
        The model that names without a leading dot belong to.
    part : Item or None
        The part that markers without another one belong to.
    frame : Item or None
        The coordinate system in which places are given; None is the global one.
    sequence : str
        How orientations are written, such as body313.
    coordinates : str
        How places are written, a key of `gearmbs.adams.view.frames.COORDINATES`.
    axis : str
        Which axis an orientation along a line turns, and which plane.
    version : int
        Counts changes: what was computed from earlier ones is out of date.
    """

    LARGEST = 200_000
    """Objects; a loop that makes more has gone astray."""

    def __init__(self) -> None:
        self.items: dict[str, Item] = {}
        self.by_name: dict[str, list[Item]] = {}
        self.units = Units()
        self.model: Item | None = None
        self.part: Item | None = None
        self.frame: Item | None = None
        self.sequence = "body313"
        self.coordinates = "car"
        self.axis = "z_axis_xz_plane"
        self.version = 0

    def __iter__(self) -> Iterator[Item]:
        return iter(list(self.items.values()))

    def of(self, *kinds: str) -> list[Item]:
        """Return the objects of some kinds in the order in which they were made."""
        return [item for item in self.items.values() if item.kind in kinds]

    def add(self, kind: str, path: str, line: int) -> Item:
        """Make an object under a full name.

        Raises
        ------
        ViewError
            If there is one of this name, or far too many.
        """
        key = path.lower()
        old = self.items.get(key)
        if old is not None:
            raise ViewError(f"there is an object {old.path} already, made in line {old.line}", line)
        if len(self.items) >= self.LARGEST:
            raise ViewError(f"more than {self.LARGEST} objects", line)
        item = Item(kind, path, line)
        self.items[key] = item
        self.by_name.setdefault(item.name.lower(), []).append(item)
        owner = self.items.get(item.parent.lower())
        if owner is not None:
            owner.children[key] = item
        self.version += 1
        return item

    def remove(self, item: Item) -> None:
        """Take an object and all that belongs to it out."""
        waiting = [item]
        while waiting:
            one = waiting.pop()
            waiting.extend(one.children.values())
            self.items.pop(one.path.lower(), None)
            siblings = self.by_name.get(one.name.lower(), [])
            if one in siblings:
                siblings.remove(one)
        owner = self.items.get(item.parent.lower())
        if owner is not None:
            owner.children.pop(item.path.lower(), None)
        for name in ("model", "part", "frame"):
            held = getattr(self, name)
            if held is not None and self.items.get(held.path.lower()) is not held:
                setattr(self, name, None)
        self.version += 1

    def move(self, item: Item, path: str, line: int) -> None:
        """Give an object without any of its own another full name.

        Raises
        ------
        ViewError
            If something belongs to it, or the name is taken.
        """
        if item.path.lower() == path.lower():
            return
        if (item.children and item.kind != "csg") or path.lower() in self.items:
            raise ViewError(f"{item.path} cannot become {path}", line)
        before = self.items.get(item.parent.lower())
        if before is not None:
            before.children.pop(item.path.lower(), None)
        inner = list(item.children.values())
        del self.items[item.path.lower()]
        item.path = path
        self.items[path.lower()] = item
        after = self.items.get(item.parent.lower())
        if after is not None:
            after.children[path.lower()] = item
        for child in inner:
            self.move(child, f"{path}.{child.name}", line)
        self.version += 1

    def rename(self, item: Item, path: str) -> None:
        """Give an object, and with it what belongs to it, another full name at the same place."""
        old = item.path
        for one in self.items.values():
            if one is item or one.path.lower().startswith(f"{old}.".lower()):
                siblings = self.by_name.get(one.name.lower(), [])
                if one in siblings:
                    siblings.remove(one)
                one.path = path + one.path[len(old) :]
                self.by_name.setdefault(one.name.lower(), []).append(one)
        items = list(self.items.values())
        self.items.clear()
        self.items.update((one.path.lower(), one) for one in items)
        for one in items:
            one.children = {child.path.lower(): child for child in one.children.values()}
        self.version += 1

    def find(self, name: str, kinds: tuple[str, ...] = ()) -> Item | None:
        """Return the object of a full or partial name, None if there is none or not just one.

        A partial name is the end of a full one; objects of the current part come first, then those of the current
        model.
        """
        key = (plain_name(name) if " " in name else name).lower()
        if key.startswith("."):
            return self.items.get(key) or self._of_set(key)
        for owner in (self.part, self.model):
            if owner is not None and (found := self.items.get(f"{owner.path.lower()}.{key}")) is not None:
                if not kinds or found.kind in kinds:
                    return found
        if key in self.items:
            return self.items[key]
        last = key.rsplit(".", 1)[-1]
        found_all = [
            item
            for item in self.by_name.get(last, [])
            if item.path.lower().endswith("." + key) and (not kinds or item.kind in kinds)
        ]
        if self.model is not None and len(found_all) > 1:
            inside = self.model.path.lower() + "."
            found_all = [item for item in found_all if item.path.lower().startswith(inside)]
        return found_all[0] if len(found_all) == 1 else None

    def _of_set(self, key: str) -> Item | None:
        """Return what belongs to an instance by a name through a set that it is listed in, as View writes of gears."""
        parts = key.split(".")
        for k in range(2, len(parts) - 1):
            through = self.items.get(".".join(parts[: k + 1]))
            if through is not None and through.kind == "ude":
                return self.items.get(".".join(parts[:k] + parts[k + 1 :]))
        return None

    def full_name(self, name: str, kind: str, line: int) -> str:
        """Return the full name of an object that is to be made.

        Raises
        ------
        ViewError
            If nothing says to which model or part it belongs.
        """
        name = plain_name(name) if " " in name else name
        if name.startswith("."):
            return name
        if kind == "model":
            return "." + name
        if kind in ("variable", "macro") and self.model is None:
            return name
        if self.model is None:
            raise ViewError(f"{name[:60]} belongs to no model; write its full name, or create a model before", line)
        if kind in ("marker", "point", "floating_marker") and "." not in name and self.part is not None:
            return f"{self.part.path}.{name}"
        return f"{self.model.path}.{name}"

    def owner(self, item: Item) -> Item | None:
        """Return the part, or body, that an object belongs to."""
        above = self.items.get(item.parent.lower())
        while above is not None and above.kind not in PARTS:
            above = self.items.get(above.parent.lower())
        return above

    def model_of(self, item: Item) -> Item | None:
        """Return the model that an object belongs to."""
        one: Item | None = item
        while one is not None and one.kind != "model":
            one = self.items.get(one.parent.lower())
        return one
