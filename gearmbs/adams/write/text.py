"""Numbers, lists and long arguments as they are written in a deck."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

WIDTH = 78
"""Characters in a line."""


def number(value: float) -> str:
    """Return a number with all the digits it needs to be read back."""
    return repr(float(value)).removesuffix(".0")


def listed(values: Iterable[float]) -> str:
    """Return numbers separated by commas."""
    return ", ".join(number(v) for v in values)


def wrapped(argument: str) -> list[str]:
    """Break an argument into continuation lines: lists at commas, expressions after operators."""
    lines, rest, lead = [], argument, ", "
    is_list = "(" not in argument
    while len(rest) > WIDTH - len(lead):
        cut = _break(rest, WIDTH - len(lead), is_list)
        if cut <= 0:
            break
        piece = rest[:cut].rstrip()
        # the comma that leads the next line separates the items of a list
        lines.append(lead + (piece.rstrip(",") if is_list else piece))
        rest, lead = rest[cut:].lstrip(), ",   "
    lines.append(lead + rest)
    return lines


def _break(text: str, limit: int, is_list: bool) -> int:
    """Return where to break, at most ``limit``: after a comma of a list, else after an operator between blanks.

    An expression without an operator in reach is broken after a comma between arguments.
    """
    operator = comma = 0
    for k in range(2, min(limit, len(text) - 1)):
        if text[k] != " ":
            continue
        if text[k - 1] == ",":
            comma = k
        elif text[k - 1] in "+-*/" and text[k - 2] == " ":
            operator = k
    return comma if is_list else operator or comma


def upper(key: Any) -> Any:
    """Return the name of a part as expressions have it, in capital letters; a number as it is."""
    return key.upper() if isinstance(key, str) else key
