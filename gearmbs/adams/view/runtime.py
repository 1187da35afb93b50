"""Function expressions of the solver: names of objects become ids, those of design variables their values."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item
from gearmbs.adams.write.text import number

if TYPE_CHECKING:
    from gearmbs.adams.view.statements import Deckmaker

_NAME = re.compile(
    r"""(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?[A-Za-z_]*)
    |(?P<name>\.?[A-Za-z_$][\w$]*(?:\.[A-Za-z0-9_$|]+)*)(?P<called>\s*\()?""",
    re.VERBOSE,
)
PLAIN = frozenset("time pi dtor rtod mode".split())
MOST = 200_000
"""Characters of an expression: measures may name measures, each twice the one before."""


def translated(maker: Deckmaker, text: str, line: int, depth: int = 0) -> str:
    """Return an expression as a deck has it.

    Raises
    ------
    ViewError
        If a name has no meaning in it.
    """
    if depth > 20:
        raise ViewError("measures name each other, more than 20 deep", line)
    out, at, length = [], 0, 0
    for match in _NAME.finditer(text):
        word = match.group("name")
        if word is None or match.group("called") or word.lower() in PLAIN:
            continue
        out.append(text[at : match.start()] + _named(maker, word, line, depth))
        at = match.end()
        length += len(out[-1])
        if length > MOST:
            raise ViewError(f"an expression of more than {MOST} characters", line)
    return ("".join(out) + text[at:]).replace("\n", " ").strip()


def _named(maker: Deckmaker, word: str, line: int, depth: int) -> str:
    item = maker.db.find(word)
    if item is None:
        head, dot, attribute = word.rpartition(".")
        owner = maker.db.find(head) if dot and head else None
        if owner is None:
            raise ViewError(f"in the expression: there is no object {word[:80]}", line)
        value = maker.values.attribute(owner, attribute)
        if isinstance(value, Item):
            return str(maker.id(value))
        if isinstance(value, (int, float)):
            return f"({number(value)})"
        raise ViewError(f"in the expression: {word[:80]} is no number", line)
    if item.kind == "variable":
        return _valued(maker, item, line)
    if item.kind.endswith("_measure"):
        found = maker.measure(item, depth + 1)
        if found is None:
            raise ViewError(f"in the expression: the measure {item.path} has no expression here", line)
        return f"VARVAL({found})"
    return str(maker.id(item))


def _valued(maker: Deckmaker, item: Item, line: int) -> str:
    value = maker.values.variable(item)
    while isinstance(value, list) and len(value) == 1:
        value = value[0]
    if isinstance(value, Item):
        return str(maker.id(value))
    if not isinstance(value, (int, float)):
        raise ViewError(f"in the expression: the variable {item.path} is no number", line)
    return f"({number(value)})"
