"""Functions of texts. Nothing here reads a file, starts a program or asks the system."""

from __future__ import annotations

import math
import re
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
    return [one.strip() for one in text_of(args[0]).split(text_of(args[1])[:1] or None)]


def _stripped(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    return text_of(args[0]).strip()


def _short(ev: Evaluator, text: str) -> str:
    if len(text) > LARGEST_TEXT:
        raise ev.error(f"a text of more than {LARGEST_TEXT} characters")
    return text


def _inserted(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    text, at = text_of(args[0]), max(int(ev.number(args[2])), 1) - 1
    return _short(ev, text[:at] + text_of(args[1]) + text[at:])


def _deleted(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    text, start = text_of(args[0]), max(int(ev.number(args[1])), 1) - 1
    return text[:start] + text[start + max(int(ev.number(args[2])), 0) :]


def _merged(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    members = args[1] if isinstance(args[1], list) else [args[1]]
    return _short(ev, text_of(args[0]).join(text_of(one) for one in members))


def _translated(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    before, after = text_of(args[1]), text_of(args[2])
    if len(before) != len(after):
        raise ev.error(f"STR_XLATE: {len(before)} characters for {len(after)}; give as many")
    return text_of(args[0]).translate(dict(zip(map(ord, before), after)))


def _replaced(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    text, old, new = (text_of(one) for one in args)
    if not old:
        raise ev.error("STR_REPLACE_ALL: an empty text is everywhere; give what is replaced")
    if len(text) // len(old) * len(new) > LARGEST_TEXT:
        raise ev.error(f"a text of more than {LARGEST_TEXT} characters")
    return text.replace(old, new)


def _found_n(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    text, wanted, at = text_of(args[0]), text_of(args[1]), 0
    for _ in range(min(int(ev.number(args[2])), len(text) + 1)):
        found = text.find(wanted, at) if wanted else -1
        if found < 0:
            return 0
        at = found + len(wanted)
    return at - len(wanted) + 1 if at else 0


def _found_count(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    wanted = text_of(args[1])
    return text_of(args[0]).count(wanted) if wanted else 0


def _matches(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> int:
    """Return whether a text is of a pattern of ``*`` and ``?``.

    Raises
    ------
    ViewError
        Of other signs of patterns, whose meaning within each other is not documented.
    """
    pattern, text = text_of(args[0]), text_of(args[1])
    if set(pattern) & set("[]{}"):
        raise ev.error(f"STR_MATCH: {pattern[:40]!r}: brackets in patterns are not read; give * and ?")
    # greedily, with one place to come back to: no pattern takes longer than both lengths multiplied
    i = k = 0
    star, kept = -1, 0
    while k < len(text):
        if i < len(pattern) and pattern[i] == "*":
            star, kept, i = i, k, i + 1
        elif i < len(pattern) and pattern[i] in ("?", text[k]):
            i, k = i + 1, k + 1
        elif star >= 0:
            kept += 1
            i, k = star + 1, kept
        else:
            return 0
    return int(not pattern[i:].strip("*"))


_CONVERSION = re.compile(r"%([-+ 0#]*)(\d{0,3})(?:\.(\d{1,3}))?([A-Za-z%])")
"""One element of a format of C: flags, width, digits, kind."""


def _formatted(values: Values, ev: Evaluator, args: list[Any], frame: Item | None) -> str:
    waiting = list(args[1]) if isinstance(args[1], list) else [args[1]]
    form = text_of(args[0])

    def one(match: re.Match[str]) -> str:
        kind = match.group(4)
        if kind == "%":
            return "%"
        if kind not in "sdiuoxXeEfgG":
            raise ev.error(f"STR_SPRINTF: {match.group()!r} is not known; give %s, %d, %e, %f or %g")
        if not waiting:
            raise ev.error(f"STR_SPRINTF: {form[:40]!r} wants more values")
        value = waiting.pop(0)
        if kind == "s":
            return match.group() % text_of(value)
        number = ev.number(value)
        return match.group() % (number if kind in "eEfgG" else int(number))

    if form.replace("%%", "").count("%") != sum(m.group(4) != "%" for m in _CONVERSION.finditer(form)):
        raise ev.error(f"STR_SPRINTF: {form[:40]!r} has a % that begins no element")
    found = _CONVERSION.sub(one, form)
    if waiting:
        raise ev.error(f"STR_SPRINTF: {form[:40]!r} has no place for {len(waiting)} of the values")
    return _short(ev, found)


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
    "STR_INSERT": Function(3, 3, _inserted),
    "STR_DELETE": Function(3, 3, _deleted),
    "STR_MERGE_STRINGS": Function(2, 2, _merged),
    "STR_XLATE": Function(3, 3, _translated),
    "STR_REPLACE_ALL": Function(3, 3, _replaced),
    "STR_FIND_N": Function(3, 3, _found_n),
    "STR_FIND_COUNT": Function(2, 2, _found_count),
    "STR_MATCH": Function(2, 2, _matches),
    "STR_SPRINTF": Function(2, 2, _formatted),
    "STR_PRINT": Function(1, 1, _printed),
    "STATUS_PRINT": Function(1, 1, _printed),
    "GETENV": Function(1, 1, _unset),
}
