"""A deck: its typed statements, their units in SI, what each reads of others, and what goes when one is left out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

from gearmbs.adams.errors import UNSUPPORTED, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import EXPRESSION, RawStatement, specs_of
from gearmbs.mechanism.language.lowering import UNSUPPORTED as REFUSED_FUNCTIONS
from gearmbs.mechanism.language.syntax import Call, Number, Units, parse, walk

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

Key = tuple[str, int]
"""Name and id of a statement."""
WITH_ANOTHER = "which is left out"
_LABEL = re.compile(r"([A-Z_]+)/(\d+)")


ASKED = st.READ_BY.keys() | st.UNSUPPORTED


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
        return iter([statement for group in self.items.values() for statement in group.values()])

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


# What statements read of others.


MEASURES = frozenset(
    """DX DY DZ DM AX AY AZ INCANG PSI THETA PHI YAW PITCH ROLL ORIENT VX VY VZ VM VR WX WY WZ WM ACCX ACCY ACCZ ACCM
    WDTX WDTY WDTZ WDTM""".split()
)
"""Functions of the places and motions of markers."""


def measured_markers(text: str) -> list[int]:
    """Return the markers whose place or motion an expression asks for, in order of appearance."""
    found: list[int] = []
    for node in walk(parse(text)):
        if isinstance(node, Call) and node.name in MEASURES:
            refs = node.args[2:] if node.name == "ORIENT" else node.args
            for a in refs:
                if isinstance(a, Number) and a.integer and a.integer not in found:
                    found.append(a.integer)
    return found


def read_variables(deck: Deck, requests: bool = True) -> set[int]:
    """Return the VARIABLEs that anything but a list for a control program reads, directly or through others.

    Parameters
    ----------
    deck : Deck
    requests : bool
        Whether requests count.
    """
    read: set[int] = set()
    waiting = [
        text
        for statement in deck
        if not isinstance(statement, st.Variable if requests else (st.Variable, st.Request))
        for name, spec in specs_of(type(statement)).items()
        if spec.kind == EXPRESSION and (text := getattr(statement, name)) is not None
    ]
    for system in deck.each(st.System):
        waiting += _inputs(deck, system)
    lists: dict[str, Mapping[int, st.Plant | st.Array]] = {
        "PINVAL": deck.of(st.PlantInput), "POUVAL": deck.of(st.PlantOutput), "ARYVAL": deck.of(st.Array),
    }  # fmt: skip
    while waiting:
        for node in walk(parse(waiting.pop())):
            first = node.args[0] if isinstance(node, Call) and node.args else None
            if not isinstance(node, Call) or not isinstance(first, Number) or first.integer is None:
                continue
            members: tuple[int, ...] = ()
            if node.name == "VARVAL":
                members = (first.integer,)
            elif node.name in lists and first.integer in lists[node.name]:
                members = lists[node.name][first.integer].variables
            for member in members:
                variable = deck.of(st.Variable).get(member)
                if variable is not None and member not in read:
                    read.add(member)
                    waiting.append(variable.function or "0")
    return read


def _inputs(deck: Deck, system: Any) -> list[str]:
    """Return what a system of states reads, as expressions: its inputs, and what its routines ask for."""
    inputs = deck.of(st.Array).get(system.u or 0)
    callers = (system.callers or {}).values() if isinstance(system, st.Gse) else ()
    return [
        *(f"VARVAL({ref})" for ref in (inputs.variables if inputs is not None else ())),
        *(text for caller in callers for text in caller.asked),
    ]


def absent_statements(deck: Deck) -> dict[Key, str]:
    """Return the labels of what is not supported and not in a deck any more, by name and id, also of their markers."""
    keys, absent = set(), {}
    for diagnostic in deck.unsupported:
        found = _LABEL.match(diagnostic.message)
        if found is None:
            continue
        keyword, number = found.group(1), int(found.group(2))
        keys.add((keyword, number))
        there = keyword in st.STATEMENTS and number in deck.of(st.STATEMENTS[keyword])
        if not there or WITH_ANOTHER in diagnostic.message:
            absent[keyword, number] = found.group()
    absent |= {("MARKER", m.id): m.label() for m in deck.of(st.Marker).values() if m.owner() in keys}
    return absent


def without_readers(deck: Deck, gone: Sequence[st.Statement] = ()) -> list[Diagnostic]:
    """Take out of a deck what reads statements that were left out, and return a remark on each.

    Lists of a control program merely lose those members.
    """
    remarks = []
    absent = absent_statements(deck)

    def leave_out(s: st.Statement) -> None:
        absent[s.keyword, s.id] = s.label()
        deck.left_out.add((s.keyword, s.id))
        for name in ("x", "y", "xd") if isinstance(s, st.System) else ():
            ref = getattr(s, name, None)
            if ref is not None:
                absent["ARRAY", ref] = f"ARRAY/{ref}"

    for s in gone:
        leave_out(s)
    if not absent:
        return []
    reads = {(type(statement), statement.id): needed_by(statement) for statement in deck}
    found = True
    while found:
        found = False
        for statement in list(deck):
            need = next((label for key, label in absent.items() if key in reads[type(statement), statement.id]), None)
            if need is None:
                continue
            found = True
            del deck.items[type(statement)][statement.id]
            leave_out(statement)
            message = f"{statement.label()}: it needs {need}, which is left out"
            remarks.append(Diagnostic(UNSUPPORTED, message, deck.file, statement.line))
    for plant in list(deck.each(st.Plant)):
        kept = tuple(v for v in plant.variables if ("VARIABLE", v) not in absent)
        deck.items[type(plant)][plant.id] = replace(plant, variables=kept)
    return remarks


def needed_by(statement: st.Statement) -> set[Key]:
    """Return what a statement reads by its id, and in its expressions, by name and id."""
    found: set[Key] = set()
    if isinstance(statement, st.Array):
        found |= {("VARIABLE", ref) for ref in statement.variables}
    if isinstance(statement, st.System) and statement.u is not None:
        found.add(("ARRAY", statement.u))
    if isinstance(statement, st.Contact):
        found |= {("GRAPHICS", ref) for ref in (*statement.igeom, *statement.jgeom)}
    for name in ("curve", "icurve", "jcurve"):
        ref = getattr(statement, name, None)
        if ref is not None:
            found.add(("CURVE", ref))
    if isinstance(statement, st.Request):
        found |= {("MARKER", ref) for ref in (statement.i, statement.j, statement.rm) if ref}
    for name, spec in specs_of(type(statement)).items():
        text = getattr(statement, name)
        if spec.kind != EXPRESSION or text is None:
            continue
        found |= {("MARKER", ref) for ref in measured_markers(text)}
        for node in walk(parse(text)):
            if isinstance(node, Call) and node.args and node.name in ASKED:
                which = node.args[-1 if node.name == "CURVE" else 0]
                if isinstance(which, Number) and which.integer is not None:
                    found.add((st.READ_BY.get(node.name, node.name), which.integer))
    return found


# Statements that use functions that are not evaluated here.


READ_IN_DECKS = REFUSED_FUNCTIONS & st.READ_BY.keys()
"""Functions that a mechanism refuses and a deck has, where there is a statement with their id."""


def refused_functions(statement: st.Statement, names: tuple[str, ...] | None = None) -> list[tuple[str, str]]:
    """Return name of the argument and message for each function of a statement that is not supported, each once.

    Parameters
    ----------
    statement : Statement
    names : tuple of str, optional
        Arguments to look at; all without.
    """
    if isinstance(statement, st.FlexBody):
        # a body is not left out for its damping, whose function is checked with the others
        return []
    found: dict[str, tuple[str, str]] = {}
    for name, spec in specs_of(type(statement)).items():
        text = getattr(statement, name)
        if spec.kind != EXPRESSION or text is None or (names is not None and name not in names):
            continue
        try:
            calls = [node for node in walk(parse(text)) if isinstance(node, Call)]
        except ValueError:
            # said where expressions are checked
            continue
        for call in calls:
            if call.name in REFUSED_FUNCTIONS - READ_IN_DECKS and call.name not in found:
                message = f"{statement.label()}: {spec.keyword}: the function {call.name} is not supported"
                found[call.name] = name, message + st.instead_of_function(call.name)
    return list(found.values())


def without_refused(deck: Deck, gone: Sequence[st.Statement], readers: bool) -> list[Diagnostic]:
    """Take out of a deck what uses functions that are not supported and what reads it; return remarks on them.

    A VARIABLE that nothing reads stays: it is remarked where expressions are checked.

    Parameters
    ----------
    deck : Deck
        Changed in place.
    gone : sequence of Statement
        What has been taken out before, for other reasons.
    readers : bool
        Whether to remark on those that merely read what is taken out.
    """
    others = without_readers(deck, gone)
    read = read_variables(deck)
    refused = []
    remarks = []
    for statement in list(deck):
        if isinstance(statement, st.Variable) and statement.id not in read:
            continue
        told = refused_functions(statement)
        for name, message in told:
            line = statement.given.get(name, statement.line)
            remarks.append(Diagnostic(UNSUPPORTED, message, deck.file, line))
        if told:
            del deck.items[type(statement)][statement.id]
            refused.append(statement)
    others += without_readers(deck, refused) if refused else []
    return remarks + (others if readers else [])
