"""Columns of words beside those of numbers in text tables, as of a state or a remark: found, left out, and said."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import pandas as pd

from gearmbs.signals.files.cells import COMMENT, SEPARATIONS, Kind, cell_kind, split_cells

LIKE_A_NUMBER = re.compile(r"[-+]?[.,]?\d")
"""Begin of what is a number, a date or a time in a way that is not known, and no word."""
MOST_WORDS, LONGEST_WORD = 3, 40
"""Words of a column that a report lists, and letters of one."""
MOST_CHANNELS = 64
"""Words that may be the names of channels, one in each row; of more they are remarks or numbers of another kind."""
FEWEST_ROWS = 3
"""Rows with numbers beside words that make a table: a line of a header may have both."""


def find_beside_words(
    rows: Sequence[tuple[int, str]], separators: Sequence[str | None] = (";", "\t", ",")
) -> tuple[int, str | None, str, list[Kind]] | None:
    """Return where rows begin that hold numbers in some columns and words in others, down to the last; None of none."""
    found = None
    for separator, decimal in SEPARATIONS:
        if separator not in separators or separator == decimal or len(rows) < FEWEST_ROWS:
            continue
        kinds = [_kinds(line, separator, decimal) for _, line in rows]
        # the end of what is looked at may be one of a file that is cut off
        kinds = kinds if len(kinds[-1]) == len(kinds[-2]) else kinds[:-1]
        last = kinds[-1]
        numbers = [i for i, kind in enumerate(last) if kind == "number"]
        first = len(kinds)
        while first and len(kinds[first - 1]) == len(last) and any(kinds[first - 1][i] == "number" for i in numbers):
            first -= 1
        better = found is None or len(numbers) > found[0]
        if numbers and better and len(last) > 1 and len(kinds) - first >= FEWEST_ROWS:
            cells = split_cells(rows[len(kinds) - 1][1].split("#")[0], separator)
            found = len(numbers), (rows[first][0], separator, decimal, list(map(_told, range(len(last)), cells, last)))
    return None if found is None else found[1]


def _told(place: int, cell: str, kind: Kind) -> Kind:
    """Return the kind of a cell: of stamps beside others a word, and of what begins as a number one that is wrong."""
    if kind == "text":
        return "number" if LIKE_A_NUMBER.match(cell) else kind
    return "text" if place > 1 and kind not in ("number", "gap") else kind


def _kinds(line: str, separator: str | None, decimal: str) -> list[Kind]:
    return [cell_kind(cell, decimal) for cell in split_cells(line.split("#")[0], separator)]


def columns_of_words(
    lines: Sequence[str], separator: str | None, decimal: str, kinds: Sequence[Kind]
) -> tuple[int, ...]:
    """Return the columns that hold words in some rows, and numbers in none."""
    seen: list[set[Kind]] = [{kind} for kind in kinds]
    for line in lines:
        cells = [] if COMMENT.match(line) else split_cells(line.split("#")[0], separator)
        for i, (column, cell) in enumerate(zip(seen, cells, strict=False)):
            column.add(_told(i, cell, cell_kind(cell, decimal)))
    apart = ("number", "stamp", "date", "clock")
    return tuple(i for i, column in enumerate(seen) if "text" in column and column.isdisjoint(apart))


class Words:
    """What words stand in columns, in the order of their coming."""

    def __init__(self, names: Mapping[int, str]) -> None:
        self.names = names
        self.found: dict[int, list[str]] = {i: [] for i in names}
        self.changes = dict.fromkeys(names, 0)
        self.rows = 0

    def add(self, block: pd.DataFrame) -> None:
        """Take in a block of a table, of which columns are called by their places."""
        for i in self.names:
            column = block[i].fillna("").str.strip()
            self.found[i] += [word for word in column.unique() if word and word not in self.found[i]]
            self.changes[i] += int((column != column.shift()).sum()) - 1
        self.rows += len(block)

    def said(self) -> list[str]:
        """Return what is to be said of the columns."""
        return [f"{name!r} holds words, {self._listed(i)}, and is left out." for i, name in self.names.items()]

    def mixed(self) -> str | None:
        """Return what is wrong if rows are of one channel and another in turn, as their words say; None if not."""
        for i, name in self.names.items():
            if len(self.found[i]) <= MOST_CHANNELS and self.changes[i] > 0.5 * self.rows:
                return (
                    f"{name!r} holds words that change from row to row, {self._listed(i)}; if each row is of one "
                    "channel, write a column for each, with a column of times"
                )
        return None

    def _listed(self, column: int) -> str:
        words = [repr(word[:LONGEST_WORD]) for word in self.found[column]]
        more = f" and {len(words) - MOST_WORDS} more" if len(words) > MOST_WORDS else ""
        return ", ".join(words[:MOST_WORDS]) + more
