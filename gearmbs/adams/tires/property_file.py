"""Property files of tires (.tir) and roads (.rdf): sections of names with numbers or texts, in their own units."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gearmbs.adams.parse.reader import read_file

LENGTH = {
    "meter": 1.0,
    "m": 1.0,
    "mm": 1e-3,
    "cm": 1e-2,
    "km": 1e3,
    "inch": 0.0254,
    "in": 0.0254,
    "foot": 0.3048,
    "ft": 0.3048,
}
FORCE = {
    "newton": 1.0,
    "n": 1.0,
    "kn": 1e3,
    "knewton": 1e3,
    "pound_force": 4.4482216152605,
    "lbf": 4.4482216152605,
    "kg_force": 9.80665,
}
ANGLE = {
    "radian": 1.0,
    "radians": 1.0,
    "rad": 1.0,
    "degree": math.pi / 180,
    "degrees": math.pi / 180,
    "deg": math.pi / 180,
}
TIME = {"sec": 1.0, "second": 1.0, "seconds": 1.0, "s": 1.0, "millisecond": 1e-3, "ms": 1e-3}
MASS = {
    "kg": 1.0,
    "kilogram": 1.0,
    "gram": 1e-3,
    "g": 1e-3,
    "pound_mass": 0.45359237,
    "lbm": 0.45359237,
    "slug": 14.59390294,
    "megagram": 1e3,
    "tonne": 1e3,
}
UNITS = {"LENGTH": LENGTH, "FORCE": FORCE, "ANGLE": ANGLE, "TIME": TIME, "MASS": MASS}
DIMENSIONS = {
    **dict.fromkeys(("UNLOADED_RADIUS", "WIDTH", "RIM_RADIUS", "RIM_WIDTH"), (0, 1, 0, 0, 0)),
    **dict.fromkeys(("VERTICAL_STIFFNESS", "LATERAL_STIFFNESS"), (1, -1, 0, 0, 0)),
    "VERTICAL_DAMPING": (1, -1, 1, 0, 0),
    "MBELT": (0, 0, 0, 0, 1),
    **dict.fromkeys(("FNOMIN", "FZMIN", "FZMAX"), (1, 0, 0, 0, 0)),
    **dict.fromkeys(("VXLOW", "LONGVL"), (0, 1, -1, 0, 0)),
    **dict.fromkeys(("ALPMIN", "ALPMAX", "CAMMIN", "CAMMAX"), (0, 0, 0, 1, 0)),
}
"""Powers of force, length, time, angle and mass of what has a unit; all else has none, or those of its formula."""
WITHOUT_EFFECT = ("MDI_HEADER", "UNITS", "EXTERNAL_GRAPHICS", "GRAPHICS", "SHAPE")
"""Sections that say nothing of forces on a flat road."""
_SECTION = re.compile(r"\[(\w+)\]")
_ENTRY = re.compile(r"\s*([A-Za-z_]\w*)\s*=\s*(.*)")


class TireError(ValueError):
    """A property file says what is not modelled, or cannot be read."""


@dataclass(frozen=True)
class PropertyFile:
    """What a property file holds.

    Attributes
    ----------
    name : str
    numbers : dict of str to float
        In SI, by names in capitals.
    texts : dict of str to str
        In capitals.
    sections : dict of str to list of str
        Names in each section; ``{...}`` for a table.
    """

    name: str
    numbers: dict[str, float] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    sections: dict[str, list[str]] = field(default_factory=dict)

    def number(self, name: str, default: float | None = None) -> float:
        """Return a number.

        Raises
        ------
        TireError
            If there is none, and no default.
        """
        found = self.numbers.get(name, default)
        if found is None:
            raise TireError(f"{self.name}: {name} is missing")
        return found

    def refuse_unknown(self, known: Mapping[str, object] | set[str], sections: set[str]) -> None:
        """Refuse what is given, and neither zero nor known.

        Raises
        ------
        TireError
        """
        for section, names in self.sections.items():
            if section in WITHOUT_EFFECT:
                continue
            if section not in sections and names:
                raise TireError(f"{self.name}: the section [{section}] is not modelled; take it out")
            for name in names:
                if name not in known and (name not in self.numbers or self.numbers[name] != 0.0):
                    raise TireError(f"{self.name}: {name} in [{section}] is not modelled; give 0 or take it out")


def read_property_file(path: Path) -> PropertyFile:
    """Read a property file.

    Raises
    ------
    TireError
    """
    found = PropertyFile(path.name)
    section = ""
    raw: dict[str, str] = {}
    for line in read_file(path).splitlines():
        text = re.split(r"[$!]", line, maxsplit=1)[0].strip()
        if not text:
            continue
        head = _SECTION.match(text)
        if head:
            section = head[1].upper()
            found.sections.setdefault(section, [])
            continue
        entry = _ENTRY.match(text)
        if entry is None:
            if text[0] in "{(":
                found.sections.setdefault(section, []).append("{...}")
            continue
        name, value = entry[1].upper(), entry[2].strip().strip("'\"").strip()
        if section in WITHOUT_EFFECT and section != "UNITS":
            continue
        if name in raw:
            raise TireError(f"{path.name}: {name} is given twice")
        raw[name] = value
        found.sections.setdefault(section, []).append(name)
    units = [_unit(path.name, quantity, raw.get(quantity)) for quantity in ("FORCE", "LENGTH", "TIME", "ANGLE")]
    # of the belt alone: files without one need no unit
    units.append(_unit(path.name, "MASS", raw.get("MASS")) if raw.get("MBELT") else 1.0)
    for name, value in raw.items():
        try:
            number = float(value.lower().replace("d", "e"))
        except ValueError:
            found.texts[name] = value.upper()
            continue
        if not math.isfinite(number):
            raise TireError(f"{path.name}: {name} = {value[:30]} is no finite number")
        powers = DIMENSIONS.get(name, (0, 0, 0, 0, 0))
        found.numbers[name] = number * math.prod(unit**power for unit, power in zip(units, powers))
    return found


def _unit(file: str, quantity: str, word: str | None) -> float:
    found = UNITS[quantity].get((word or "").lower())
    if found is None:
        raise TireError(
            f"{file}: {quantity} = {(word or 'nothing')[:30]} in [UNITS]; one of {', '.join(UNITS[quantity])}"
        )
    return found
