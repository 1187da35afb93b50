"""Give an object of a model another name: all that refers to it by its old one goes on to do so."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Database, Item
from gearmbs.adams.view.values import Stored

_NAME = re.compile(r"\.?[A-Za-z_$][\w$]*(?:\.[\w$]+)*")
SETTINGS = frozenset(
    "units x_units y_units z_units characteristic component type_of_freedom time_derivative axis".split()
)
"""Arguments whose words are never names, though objects may be called like them."""
_WHOLE = re.compile(r"[A-Za-z_$][\w$]*")


def rename(db: Database, item: Item, name: str, line: int) -> None:
    """Rename an object where it is, with what belongs to it.

    Words and names in expressions are kept as full names from then on, so that an object that is made under the old
    name later is another one.

    Raises
    ------
    ViewError
        If the new name is none, belongs elsewhere, or is taken.
    """
    path = name if name.startswith(".") else f"{item.parent}.{name}"
    parent, _, last = path.rpartition(".")
    if parent.lower() != item.parent.lower() or not _WHOLE.fullmatch(last):
        raise ViewError(f"{item.path} cannot become {path[:80]}: a new name stays where the object is", line)
    other = db.items.get(path.lower())
    if other is not None and other is not item:
        raise ViewError(f"{item.path} cannot become {path[:80]}, which is made in line {other.line}", line)
    old = item.path

    def renamed(word: str) -> str:
        found, head = db.find(word), word
        if found is None:
            head = word.rpartition(".")[0]
            found = db.find(head) if head else None
        if found is None or not f"{found.path}.".lower().startswith(f"{old}.".lower()):
            return word
        return path + found.path[len(old) :] + word[len(head) :]

    changed = {
        id(one): {key: held if key in SETTINGS else _changed(held, renamed) for key, held in one.fields.items()}
        for one in db
    }
    for one in db:
        one.fields = changed[id(one)]
    db.rename(item, path)


def _changed(held: Stored, renamed: Callable[[str], str]) -> Stored:
    """Return what an argument holds with other names."""
    values = tuple((kind, _value(kind, value, renamed)) for kind, value in held.values)
    return held if values == held.values else replace(held, values=values)


def _value(kind: str, value: Any, renamed: Callable[[str], str]) -> Any:
    if kind == "tree":
        return _tree(value, renamed)
    if not isinstance(value, str):
        return value
    return _NAME.sub(lambda match: renamed(match.group()), value)


def _tree(tree: Any, renamed: Callable[[str], str]) -> Any:
    if not isinstance(tree, tuple):
        return tree
    if len(tree) == 2 and tree[0] == "name":
        return ("name", renamed(tree[1]))
    if len(tree) == 2 and tree[0] in ("text", "value"):
        return tree if tree[0] == "value" and not isinstance(tree[1], str) else (tree[0], _value("", tree[1], renamed))
    return tuple(_tree(one, renamed) for one in tree)
