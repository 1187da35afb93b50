"""Which statements of a deck others read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from gearmbs.adams.errors import UNSUPPORTED, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of
from gearmbs.mechanism.expression_syntax import Call, Number, parse, walk


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
    for kind in (st.Lse, st.Tfsiso, st.Gse):
        for system in deck.of(kind).values():
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


def without_readers(deck: Deck, gone: Sequence[st.Statement]) -> list[Diagnostic]:
    """Take out of a deck what reads statements that were left out, and return a remark on each.

    Lists of a control program merely lose those members.
    """
    remarks = []
    absent = {(type(s), s.id): s.label() for s in gone}
    for s in gone:
        if isinstance(s, st.Gse):
            absent |= {(st.Array, ref): f"ARRAY/{ref}" for ref in (s.x, s.y, s.xd) if ref is not None}
    reads = {(type(statement), statement.id): _reads(statement) for statement in deck}
    found = True
    while found:
        found = False
        for statement in list(deck):
            need = next((label for key, label in absent.items() if key in reads[type(statement), statement.id]), None)
            if need is None:
                continue
            found = True
            del deck.items[type(statement)][statement.id]
            absent[type(statement), statement.id] = statement.label()
            message = f"{statement.label()}: it needs {need}, which is left out"
            remarks.append(Diagnostic(UNSUPPORTED, message, deck.file, statement.line))
    lists: tuple[type[st.Plant], ...] = (st.PlantInput, st.PlantOutput)
    for kind in lists:
        group = deck.items.get(kind, {})
        for number, plant in group.items():
            kept = tuple(v for v in plant.variables if (st.Variable, v) not in absent)
            group[number] = replace(plant, variables=kept)
    return remarks


READ_BY: dict[str, type] = {
    "VARVAL": st.Variable, "DIF": st.Diff, "DIF1": st.Diff, "ARYVAL": st.Array, "CURVE": st.CurveStatement,
    "SENVAL": st.Sensor,
}  # fmt: skip
"""Statements that functions read by id; of CURVE it is the last argument."""


def _reads(statement: st.Statement) -> set[tuple[type, int]]:
    """Return what a statement reads by its id, and in its expressions."""
    found: set[tuple[type, int]] = set()
    if isinstance(statement, st.Array):
        found |= {(st.Variable, ref) for ref in statement.variables}
    if isinstance(statement, (st.Lse, st.Tfsiso, st.Gse)) and statement.u is not None:
        found.add((st.Array, statement.u))
    for name in ("curve", "icurve", "jcurve"):
        ref = getattr(statement, name, None)
        if ref is not None:
            found.add((st.CurveStatement, ref))
    for name, spec in specs_of(type(statement)).items():
        text = getattr(statement, name)
        if spec.kind != EXPRESSION or text is None:
            continue
        for node in walk(parse(text)):
            if isinstance(node, Call) and node.name in READ_BY and node.args:
                which = node.args[-1 if node.name == "CURVE" else 0]
                if isinstance(which, Number) and which.integer is not None:
                    found.add((READ_BY[node.name], which.integer))
    return found
