"""Functions of texts. Nothing here reads a file, starts a program or asks the system."""

from __future__ import annotations

import math
from typing import Any

from gearmbs.adams.view.expressions import LARGEST_TEXT, Evaluator, text_of
from gearmbs.adams.view.functions.table import FUNCTIONS, Function, Values
from gearmbs.adams.view.model import Item


def _stoi(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(_read(ev, args[0]))


def _stor(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> float:
    return _read(ev, args[0])


def _read(ev: Evaluator, text: Any) -> float:
    try:
        value = float(text_of(text)[:100])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ev.error(f"{text_of(text)[:40]!r} is no number")
    return value


def _stoo(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> Any:
    found = values.db.find(text_of(args[0]))
    if found is None:
        raise ev.error(f"there is no object {text_of(args[0])[:60]}")
    return found


def _length(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return len(text_of(args[0]))


def _blank(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return int(not text_of(args[0]).strip())


def _case(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    text, how = text_of(args[0]), int(ev.number(args[1]))
    return {1: text.upper(), 2: text.lower(), 3: text.title(), 4: text.capitalize()}.get(how, text)


def _compare(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    one, other = text_of(args[0]), text_of(args[1])
    return (one > other) - (one < other)


def _find(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    return text_of(args[0]).find(text_of(args[1])) + 1


def _substr(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    start = max(int(ev.number(args[1])), 1) - 1
    count = max(int(ev.number(args[2])), 0) if len(args) > 2 else LARGEST_TEXT
    return text_of(args[0])[start : start + count]


def _split(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> list[str]:
    return text_of(args[0]).split(text_of(args[1])[:1] or None)


def _stripped(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return "".join(text_of(args[0]).split())


def _printed(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return text_of(args[0])


def _unset(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    """Return what an environment variable holds that is not set: the system is not asked."""
    return ""


FUNCTIONS |= {
    "STOI": Function(1, 1, _stoi),
    "STOR": Function(1, 1, _stor),
    "VAL": Function(1, 1, _stor),
    "STOO": Function(1, 1, _stoo),
    "STR_LENGTH": Function(1, 1, _length),
    "STR_IS_SPACE": Function(1, 1, _blank),
    "STR_CASE": Function(2, 2, _case),
    "STR_COMPARE": Function(2, 2, _compare),
    "STR_FIND": Function(2, 2, _find),
    "STR_SUBSTR": Function(2, 3, _substr),
    "STR_SPLIT": Function(2, 2, _split),
    "STR_REMOVE_WHITESPACE": Function(1, 1, _stripped),
    "STR_PRINT": Function(1, 1, _printed),
    "STATUS_PRINT": Function(1, 1, _printed),
    "GETENV": Function(1, 1, _unset),
}
