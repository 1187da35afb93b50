"""What statements of a deck read of others, which use functions that are not evaluated here, and what goes then."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from gearmbs.adams.errors import UNSUPPORTED, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import measured_markers
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of
from gearmbs.mechanism.language.library import UNSUPPORTED as REFUSED_FUNCTIONS
from gearmbs.mechanism.language.syntax import Call, Number, parse, walk

Key = tuple[str, int]
"""Name and id of a statement."""
WITH_ANOTHER = "which is left out"
_LABEL = re.compile(r"([A-Z_]+)/(\d+)")


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


def left_out(deck: Deck) -> dict[Key, str]:
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
    absent = left_out(deck)

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


ASKED = st.READ_BY.keys() | st.UNSUPPORTED


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
