"""Functions that ask for the objects of a model, and for names that are free."""

from __future__ import annotations

from typing import Any

from gearmbs.adams.view.expressions import Evaluator, parse, text_of
from gearmbs.adams.view.functions.table import FUNCTIONS, Function, Values, item_of
from gearmbs.adams.view.model import Item
from gearmbs.adams.view.vocabulary import kinds_of


def _exists(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(isinstance(args[0], Item) or values.db.find(text_of(args[0])) is not None)


def _type(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return item_of(values, ev, args[0]).kind


def _default(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    what = text_of(args[1]).lower()
    found = {"model": values.db.model, "part": values.db.part}.get(what)
    if found is None:
        raise ev.error(f"there is no default {what[:40]}")
    return found


def _children(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[Item]:
    kinds = kinds_of(text_of(args[1]), ev.line)
    return [one for one in item_of(values, ev, args[0]).children.values() if one.kind in kinds]


def _counted(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return len(args[0]) if isinstance(args[0], list) else 1


def _ancestor(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    kinds = kinds_of(text_of(args[1]), ev.line)
    one = values.db.items.get(item_of(values, ev, args[0]).parent.lower())
    while one is not None and one.kind not in kinds:
        one = values.db.items.get(one.parent.lower())
    return "" if one is None else one


def _unique(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    stem, k = text_of(args[0]), 1
    while values.db.find(f"{stem}_{k}") is not None:
        k += 1
    return f"{stem}_{k}"


def _unique_id(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    """Return an id that no object of a type has been given."""
    kinds, taken = kinds_of(text_of(args[0]), ev.line), [0]
    for item in values.db.of(*kinds):
        held = item.fields.get("adams_id")
        taken += [int(one) for _, one in (held.values if held is not None else ()) if isinstance(one, (int, float))]
    return max(taken) + 1


def _conversion(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    return ev(parse(f"1({text_of(args[0])})", values.db.units, ev.line))


FUNCTIONS |= {
    "UNIQUE_ID": Function(1, 1, _unique_id),
    "UNITS_CONVERSION_FACTOR": Function(1, 1, _conversion),
    "DB_EXISTS": Function(1, 1, _exists),
    "DB_TYPE": Function(1, 1, _type),
    "DB_DEFAULT": Function(2, 2, _default),
    "DB_CHILDREN": Function(2, 2, _children),
    "DB_IMMEDIATE_CHILDREN": Function(2, 2, _children),
    "DB_COUNT": Function(1, 2, _counted),
    "DB_OBJECT_COUNT": Function(1, 2, _counted),
    "DB_ANCESTOR": Function(2, 2, _ancestor),
    "DB_OLDEST_ANCESTOR": Function(2, 2, _ancestor),
    "UNIQUE_NAME": Function(1, 1, _unique),
    "UNIQUE_LOCAL_NAME": Function(1, 1, _unique),
}
