"""A deck: its typed statements, its units in SI, and remarks on what was not understood."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

from gearmbs.adams.errors import UNSUPPORTED, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import RawStatement
from gearmbs.mechanism.language.syntax import Units

if TYPE_CHECKING:
    from gearmbs.flexible import ModalNeutralFile
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.language.user_functions import UserFunction

S = TypeVar("S", bound=st.Statement)

INCH = 0.0254
"""Metres; exact by definition, the international yard and pound agreement of 1959."""
POUND = 0.45359237
"""Kilograms; exact by the same agreement."""
STANDARD_GRAVITY = 9.80665
"""m/s^2; exact by definition (3rd CGPM, 1901)."""
POUND_FORCE = POUND * STANDARD_GRAVITY

FORCE = {
    "CENTINEWTON": 1e-2, "DYNE": 1e-5, "KILOGRAM_FORCE": STANDARD_GRAVITY, "KNEWTON": 1e3,
    "KPOUND_FORCE": 1e3 * POUND_FORCE, "MEGANEWTON": 1e6, "MICRONEWTON": 1e-6, "MILLINEWTON": 1e-3,
    "NANONEWTON": 1e-9, "NEWTON": 1.0, "OUNCE_FORCE": POUND_FORCE / 16.0, "POUND_FORCE": POUND_FORCE,
    "POUNDAL": POUND * 0.3048,
}  # fmt: skip
LENGTH = {
    "ANGSTROM": 1e-10, "CENTIMETER": 1e-2, "FOOT": 0.3048, "INCH": INCH, "KILOMETER": 1e3, "METER": 1.0,
    "MICROINCH": 1e-6 * INCH, "MICROMETER": 1e-6, "MILE": 1609.344, "MILLIMETER": 1e-3, "MILS": 1e-3 * INCH,
    "NANOMETER": 1e-9, "YARD": 0.9144,
}  # fmt: skip
MASS = {
    "GRAM": 1e-3, "KILOGRAM": 1.0, "KPOUND_MASS": 1e3 * POUND, "MICROGRAM": 1e-9, "MILLIGRAM": 1e-6,
    "NANOGRAM": 1e-12, "OUNCE_MASS": POUND / 16.0, "POUND_MASS": POUND, "SLINCH": POUND_FORCE / INCH,
    "SLUG": POUND_FORCE / 0.3048, "TONNE": 1e3, "US_TON": 2000.0 * POUND,
}  # fmt: skip
TIME = {
    "DAY": 86400.0, "HOUR": 3600.0, "MICROSECOND": 1e-6, "MILLISECONDS": 1e-3, "MINUTE": 60.0, "NANOSECOND": 1e-9,
    "SECOND": 1.0,
}  # fmt: skip
SYSTEMS = {
    "MKS": ("NEWTON", "KILOGRAM", "METER", "SECOND"),
    "CGS": ("DYNE", "GRAM", "CENTIMETER", "SECOND"),
    "FPS": ("POUND_FORCE", "POUND_MASS", "FOOT", "SECOND"),
    "IPS": ("POUND_FORCE", "POUND_MASS", "INCH", "SECOND"),
}
TABLES = {"force": FORCE, "mass": MASS, "length": LENGTH, "time": TIME}

RESULT_NAMES = {
    "NEWTON": "newton", "DYNE": "dyne", "POUND_FORCE": "pound_force", "KILOGRAM_FORCE": "kg_force",
    "KNEWTON": "knewton", "KILOGRAM": "kg", "GRAM": "gram", "POUND_MASS": "pound_mass", "SLUG": "slug",
    "METER": "meter", "MILLIMETER": "mm", "CENTIMETER": "cm", "INCH": "inch", "FOOT": "foot", "SECOND": "sec",
    "MILLISECONDS": "millisec", "MINUTE": "min", "HOUR": "hour",
}  # fmt: skip
"""How result files spell the units."""


@dataclass
class Deck:
    """The content of an .adm file.

    Attributes
    ----------
    title : str
    file : str
    items : dict
        Statement class -> id -> statement, in the order of the deck.
    diagnostics : list of Diagnostic
        Warnings, ignored and unsupported statements; errors raise.
    unread : dict
        (name, id) -> text of statements that are read only as far as others name them.
    functions : dict
        Functions that routines of the user have become, by name.
    modal_files : dict
        Modal neutral files that have been read, by path.
    left_out : set of (statement name, id)
        What was taken out since it is not supported, or reads what is not.
    """

    title: str = ""
    file: str = "<deck>"
    items: dict[type[st.Statement], dict[int, Any]] = field(default_factory=dict)
    diagnostics: list[Diagnostic] = field(default_factory=list)
    unread: dict[tuple[str, int], RawStatement] = field(default_factory=dict)
    functions: dict[str, UserFunction] = field(default_factory=dict)
    modal_files: dict[str, ModalNeutralFile] = field(default_factory=dict)
    left_out: set[tuple[str, int]] = field(default_factory=set)

    def of(self, kind: type[S]) -> dict[int, S]:
        """Return the statements of one class by id."""
        return self.items.get(kind, {})

    def each(self, base: type[S]) -> Iterator[S]:
        """Yield the statements of all classes that have a base in common, class by class in the order of the table."""
        for cls in st.STATEMENTS.values():
            if issubclass(cls, base):
                yield from self.of(cls).values()

    def only(self, kind: type[S]) -> S | None:
        """Return the single statement of a class without id, or None."""
        return next(iter(self.of(kind).values()), None)

    def __iter__(self) -> Iterator[st.Statement]:
        for group in self.items.values():
            yield from group.values()

    @cached_property
    def units(self) -> Units:
        """SI values of the deck's units."""
        return deck_units(self.only(st.Units))

    @property
    def unsupported(self) -> list[Diagnostic]:
        """Statements and arguments that change the physics and are not modelled."""
        return [d for d in self.diagnostics if d.severity == UNSUPPORTED]

    def ground(self) -> st.Part:
        """Return the ground part."""
        return next(p for p in self.of(st.Part).values() if p.ground)

    def summary(self) -> str:
        """Return a table of what the deck holds and what was left out."""
        lines = [f"{self.title or '(no title)'}  [{self.file}]"]
        lines += [f"  {kind.keyword:14s} {len(group)}" for kind, group in self.items.items()]
        lines += [f"  {d}" for d in self.diagnostics]
        return "\n".join(lines)

    def to_mechanism(
        self, allow_unsupported: bool = False, routines: Mapping[str, Callable] | None = None
    ) -> Mechanism:
        """Build the mechanism as `gearmbs.adams.build_mechanism` does: ``read_deck(path).to_mechanism()``."""
        from gearmbs.adams import build_mechanism

        return build_mechanism(self, allow_unsupported, routines)


def unit_names(statement: st.Units | None) -> dict[str, str]:
    """Return the full names of a deck's units of force, mass, length and time ("" where there is none).

    Raises
    ------
    ValueError
        For an unknown, ambiguous or missing unit.
    """
    if statement is None:
        return dict.fromkeys(TABLES, "")
    if statement.system and statement.system != "NONE":
        return dict(zip(TABLES, SYSTEMS[statement.system]))
    names = {}
    for quantity, table in TABLES.items():
        word = getattr(statement, quantity)
        if word is None:
            names[quantity] = ""
            continue
        found = [n for n in table if n == word] or [n for n in table if n.startswith(word)]
        if len(found) != 1:
            problem = "is ambiguous" if found else "is unknown"
            raise ValueError(f"{quantity.upper()} = {word} {problem}; choose one of {', '.join(found or table)}")
        names[quantity] = found[0]
    given = [q for q, n in names.items() if n]
    if given and len(given) < 4:
        missing = [q.upper() for q, n in names.items() if not n]
        raise ValueError(f"{', '.join(missing)} missing; FORCE, MASS, LENGTH and TIME go together")
    return names


def deck_units(statement: st.Units | None) -> Units:
    """Return the SI values of a deck's units.

    Without UNITS, or with SYSTEM = NONE, numbers are taken as a consistent system, that is as SI.
    UCF scales forces: force x UCF = mass x acceleration in the deck's own units.

    Raises
    ------
    ValueError
        For an unknown, ambiguous or missing unit or a UCF that is not positive.
    """
    names = unit_names(statement)
    values = {q: TABLES[q][n] if n else 1.0 for q, n in names.items()}
    if statement is not None and statement.ucf is not None:
        if not statement.ucf > 0.0:
            raise ValueError(f"UCF = {statement.ucf}; it must be positive")
        values["force"] = statement.ucf * values["mass"] * values["length"] / values["time"] ** 2
    return Units(**values)
