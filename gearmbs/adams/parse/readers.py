"""Which VARIABLEs of a deck matter."""

from __future__ import annotations

from collections.abc import Mapping

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
    plants: dict[str, Mapping[int, st.Plant]] = {"PINVAL": deck.of(st.PlantInput), "POUVAL": deck.of(st.PlantOutput)}
    while waiting:
        for node in walk(parse(waiting.pop())):
            first = node.args[0] if isinstance(node, Call) and node.args else None
            if not isinstance(node, Call) or not isinstance(first, Number) or first.integer is None:
                continue
            members: tuple[int, ...] = ()
            if node.name == "VARVAL":
                members = (first.integer,)
            elif node.name in plants and first.integer in plants[node.name]:
                members = plants[node.name][first.integer].variables
            for member in members:
                variable = deck.of(st.Variable).get(member)
                if variable is not None and member not in read:
                    read.add(member)
                    waiting.append(variable.function or "0")
    return read
