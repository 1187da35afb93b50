"""How a text table is written: where its numbers begin, separators, names, units, times, and what its header says."""

from __future__ import annotations

import gzip
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.beside_words import columns_of_words, find_beside_words
from gearmbs.signals.files.cells import (
    COMMENT,
    DURATION,
    SEPARATIONS,
    Kind,
    cell_kind,
    is_number,
    of_24_hours,
    split_cells,
)
from gearmbs.signals.files.own_clocks import Group
from gearmbs.signals.signal.labels import (
    is_clock,
    is_unit_of_column,
    may_be_slow,
    name_and_unit,
    rises_evenly,
    role_of,
    tells_time,
    unique_names,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS
from gearmbs.signals.signal.times import EPOCHS, LARGEST, SECONDS, seconds_of
from gearmbs.signals.signal.units import is_unit
from gearmbs.wording import of_adams

HEAD_LINES = 400
KEY_VALUE = re.compile(r"^\s*[#%]*\s*[\"']?([^\W\d][^:=;,\t\"]*?)[\"']?\s*(?:[:=][\s,;]*|[,;\t]\s*)(.*?)[\s,;\"']*$")
TIME_UNITS = frozenset(("s", "sec", "ms", "us", "µs", "ns"))
INDEX_NAMES = frozenset(
    {"", "unnamed: 0", "index", "idx", "sample", "samples", "nr", "no", "no.", "#", "row", "level_0"}
)
NO_UNIT = frozenset(("-", "--", "\u2013", "[-]", "(-)"))


@dataclass(frozen=True)
class CsvLayout:
    """How the table of a file is written.

    Attributes
    ----------
    first : int
        Line of the first numbers, from 0.
    separator : str or None
        None for blanks.
    decimal : str
    names, units : list of str
        Of all columns.
    meta : dict
        What stands above, by name.
    clock : int or None
        Column that holds times.
    stamps : tuple of int
        Columns that hold dates or times of day as text; `clock` is the first of them.
    index : int or None
        Column that may only number the rows, or hold times.
    halves : bool
        Whether each second comma is that of a number (`pointed`).
    printed : bool
        Whether other signs than - may stand for a minus.
    beside : tuple of int
        Columns of words beside the table, of no use.
    groups : tuple of Group
        Where columns have times of their own: each column of times with its others.
    """

    first: int
    separator: str | None
    decimal: str
    names: list[str]
    units: list[str]
    meta: dict[str, Any]
    clock: int | None = None
    stamps: tuple[int, ...] = ()
    index: int | None = None
    empty: tuple[int, ...] = ()
    notes: list[str] = field(default_factory=list)
    halves: bool = False
    printed: bool = False
    beside: tuple[int, ...] = ()
    groups: tuple[Group, ...] = ()

    @property
    def own(self) -> tuple[int, ...]:
        """Columns with times of their own, and these, which may end before others."""
        return tuple(i for clock, columns in self.groups for i in (clock, *columns))

    @property
    def slow(self) -> tuple[int, ...]:
        """Columns of speeds, pulses, temperatures and loads, which may be written in some rows only; and `own`."""
        named = zip(self.names, self.units, strict=True)
        apart = {self.clock, *self.beside}
        told = [
            i
            for i, (name, unit) in enumerate(named)
            if i not in apart and (role_of(name, unit) is not None or may_be_slow(name, unit))
        ]
        return tuple(dict.fromkeys([*told, *self.own]))


def find_layout(head: list[str], path: Path) -> CsvLayout:
    """Read the layout of a table from its first lines.

    Raises
    ------
    SignalFileError
        If none of them is a row of numbers.
    """
    first, separator, decimal, kinds = _find_numbers(head, path)
    headings = _headings_by_halves(head, first, path) if (separator, decimal) == (",", ".") else 0
    notes = []
    if headings == 1:
        separator, decimal, kinds = None, ",", kinds[:1]
    elif headings:
        seen = f"{headings} headings stand above {len(kinds)} fields in a row, such as {head[first].strip()[:60]!r}"
        if not _has_fractions(head[first:]):
            raise SignalFileError(
                path,
                f"{seen}: commas both between columns and in numbers, or columns without a name; write it again with "
                "semicolons between columns, with decimal points, or with a heading for each column",
            )
        kinds = kinds[::2]
        notes.append(f"{seen}: each second comma is read as that of a number, {pointed(head[first]).strip()[:60]!r}.")
    width = len(kinds)
    below, head = head[first:], _without_types(head[:first], separator)
    labels, header_line = _labels(head, separator, width)
    units_row = None
    bare = [name_and_unit(label) for label in labels] if labels else []
    if labels and header_line is not None:
        units_row = _units_row(head, separator, width, labels, header_line)
    if units_row is not None:
        names, units = units_row
    else:
        names = [name for name, _ in bare] or [f"ch{i + 1}" for i in range(width)]
        units = [unit for _, unit in bare] or [UNKNOWN_UNITS] * width
    beside = () if notes else columns_of_words(below, separator, decimal, kinds)
    stamps = tuple(i for i, kind in enumerate(kinds) if kind in ("stamp", "date", "clock") and i not in beside)
    empty = tuple(
        i
        for i, kind in enumerate(kinds)
        if kind == "gap" and i == width - 1 and i not in beside and not (labels and names[i].strip())
    )
    if units[0].lower() in ("", UNKNOWN_UNITS) and names[0].strip().lower() in TIME_UNITS:
        names, units = ["time", *names[1:]], [names[0].strip(), *units[1:]]
    clock = stamps[0] if stamps else next((i for i, (n, u) in enumerate(zip(names, units)) if tells_time(n, u)), None)
    times = [unit.lower() in TIME_UNITS for unit in units]
    if clock is None and width > 1 and times[0] and sum(times) == 1 and role_of(names[0], units[0]) is None:
        # an abscissa, whatever it is called; several columns of times are those of pulses
        clock = 0
    numbers = bool(labels) and names[0].strip().lower() in INDEX_NAMES
    unnamed = units[0].lower() in ("", UNKNOWN_UNITS) and sum(times) < 2
    index = 0 if width > 1 and not stamps and (numbers or (clock is None and unnamed)) else None
    clock = clock if width - len(stamps) > (0 if stamps else 1) else None
    return CsvLayout(
        first,
        separator,
        decimal,
        unique_names(names) if labels else names,
        units,
        _metadata(head, separator, header_line),
        clock,
        stamps,
        index if index != clock and index not in beside else None,
        empty,
        notes,
        headings > 1,
        beside=beside,
    )


TYPES = re.compile(
    r"(dt_)?(unsigned |long )?(double|float|single|real|numeric|number|decimal|u?int(eger)?|long|short|bool(ean)?|"
    r"string|char|text|utf)(_?(8|16|32|64))?(_t)?|r[48]|"
    r"[<>=|]?[bcfiou]\d{1,2}|[<>=|]?[asu]\d+|[<>=|]?m8(\[\w+\])?|(datetime|timedelta)64(\[[\w, /]+\])?|object|category|"
    r"dbl|sgl|ext|i(8|16|32|64)|u(8|16|32|64)|num|chr|lgl|fct|dttm|posix[cl]t|character|factor|logical|cell|cellstr|"
    r"l?real|[us]?l?int|u?[sd]int|[dl]?word|byte|l?time|l?date|dt|datetime|duration|timestamp|(big|small)int|"
    r"(decimal|numeric|varchar|char)\(\d+(,\s*\d+)?\)"
)
"""How columns are stored, in the words of C, numpy, pandas, MATLAB, R, LabVIEW, controllers and data bases."""


def _without_types(head: Sequence[str], separator: str | None) -> list[str]:
    """Return lines with empty ones for those that say how numbers are stored, where others may be the headings."""
    rows = [split_cells(line, separator) for line in head]
    words = [len(row) if row and not any(is_number(cell, ".") for cell in row) else 0 for row in rows]
    return [
        ""
        if len(row) > 1 and words.count(len(row)) > 1 and all(TYPES.fullmatch(cell.lower()) for cell in row)
        else line
        for line, row in zip(head, rows, strict=True)
    ]


def _find_numbers(head: list[str], path: Path) -> tuple[int, str | None, str, list[Kind]]:
    rows = [(i, line) for i, line in enumerate(head) if line.strip() and not COMMENT.match(line)]
    fallback = None
    for place, (index, line) in enumerate(rows):
        following = rows[place + 1][1] if place + 1 < len(rows) else None
        for separator, decimal in SEPARATIONS:
            if separator is not None and separator not in line:
                continue
            kinds = _row(line, separator, decimal)
            if kinds is None or (fallback is not None and fallback[0] == index and len(fallback[3]) > len(kinds)):
                continue
            after = None if following is None else _row(following, separator, decimal)
            alone = following is None and fallback is None
            if alone or (after is not None and len(after) == len(kinds)):
                return index, separator, decimal, kinds
            if fallback is None and "gap" not in kinds:
                fallback = (index, separator, decimal, kinds)
    # a table whose second row is damaged is still a table: the row that is wrong is named when it is read
    if fallback is not None and (len(fallback[3]) > 1 or fallback[0] == (rows[0][0] if rows else 0)):
        return fallback
    if (beside := find_beside_words(rows)) is not None:
        return beside
    sample = next((line.strip() for line in head if line.strip()), "")
    if not sample:
        raise SignalFileError(path, "holds nothing but empty lines")
    apart = find_beside_words(rows, (None,)) is not None
    words = "; rows hold numbers beside words, which need commas, semicolons or tabs between columns" if apart else ""
    raise SignalFileError(
        path,
        f"holds no row of numbers in its first {len(head)} lines{words}; it begins with {sample[:60]!r}"
        f"{of_adams(path)}",
    )


def _headings_by_halves(head: list[str], first: int, path: Path) -> int:
    """Return how many headings stand above twice as many fields, of which each second is digits alone; 0 if not so.

    Decimal commas have been taken for separators there. One heading above two whole numbers may also leave out the
    column that counts the rows.
    """
    rows = [split_cells(line, ",") for line in head[first:] if line.strip() and not COMMENT.match(line)]
    above = [line for line in head[:first] if line.strip() and not COMMENT.match(line)]
    names = split_cells(above[-1], ",") if above else []
    digits = all(cell.isdigit() for row in rows for cell in row[1::2])
    if not names or not digits or any(len(row) != 2 * len(names) for row in rows):
        return 0
    if any(cell_kind(name, ".") != "text" for name in names) or not all(is_whole(c) for r in rows for c in r[::2]):
        return 0
    steps = {int(row[0]) - int(before[0]) for before, row in pairwise(rows)}
    counts = len(names) == 1 and len(steps) == 1 and steps != {0}
    return 0 if counts else len(names)


def _has_fractions(lines: list[str]) -> bool:
    """Return whether some pairs of fields are no two whole numbers: these begin with no zero, and are not -0."""
    rows = [split_cells(line, ",") for line in lines if line.strip() and not COMMENT.match(line)]
    return any(re.match(r"0\d", cell) for row in rows for cell in row[1::2]) or any(
        re.fullmatch(r"-0+", cell) for row in rows for cell in row[::2]
    )


def pointed(line: str) -> str:
    """Return a row of numbers with decimal commas, and commas between them, with decimal points."""
    return re.sub(r"(\d+)\s*,\s*(\d+)", r"\1.\2", line)


def is_whole(cell: str) -> bool:
    """Return whether a cell holds digits, with a sign or none."""
    return re.fullmatch(r"[-+]?\d+", cell) is not None


def _row(line: str, separator: str | None, decimal: str) -> list[Kind] | None:
    """Kinds of the cells of a row of data, or None if it is none."""
    cells = split_cells(line.split("#")[0], separator)
    kinds = [cell_kind(cell, decimal) for cell in cells]
    if separator == decimal and any("." in cell for cell in cells):
        return None
    if "number" not in kinds or "text" in kinds:
        return None
    if any(kind in ("stamp", "date", "clock") for kind in kinds[2:]):
        return None
    return kinds


def _labels(above: list[str], separator: str | None, width: int) -> tuple[list[str], int | None]:
    """The row of names above the numbers, and its line; ([], None) if there is none."""
    rows = [(i, line) for i, line in enumerate(above) if line.strip() and not COMMENT.match(line)]
    if not rows:
        return [], None
    at, line = rows[-1]
    if width == 1:
        return ([], None) if KEY_VALUE.match(line) and re.search(r"[:=]", line) else ([line.strip().strip('"')], at)
    cells = split_cells(line, separator)
    if separator not in (None, ",") and len(cells) == width - 1 and line.rstrip("\r\n").endswith(separator or " "):
        cells.append("")
    if len(cells) == width - 1 and all(not is_number(cell, ".") for cell in cells):
        # names of the columns but not of the one that numbers the rows
        return ["", *cells], at
    return (cells, at) if len(cells) == width else ([], None)


def _units_row(
    above: list[str], separator: str | None, width: int, labels: list[str], line: int
) -> tuple[list[str], list[str]] | None:
    """Names and units where the units stand in a row of their own, else None.

    Units are in brackets, or plain where the names above begin with the time's; or all of them above the names.
    """
    rows = [text for text in above[:line] if text.strip() and not COMMENT.match(text)]
    upper = split_cells(rows[-1], separator) if rows else []
    in_brackets = [re.match(r"^\s*[\[(]([^\[\]()]*)[\])]\s*$", label) for label in labels]
    if (
        len(upper) == width
        and all(m or not label.strip() for m, label in zip(in_brackets, labels))
        and any(in_brackets)
    ):
        return upper, [(m.group(1).strip() if m else "") or UNKNOWN_UNITS for m in in_brackets]
    plain = ["" if label.strip() in NO_UNIT else label.strip() for label in labels]
    if len(upper) == width and all(map(is_unit_of_column, upper)) and not any(map(is_unit_of_column, plain)):
        # units above the names
        return plain, upper
    if len(upper) == width > 1 and plain[0].lower() in SECONDS and not any(is_number(cell, ".") for cell in upper):
        # below the time its unit: so are the others those of their columns, also units of no vibration
        others = [unit for unit in plain[1:] if unit]
        known = sum(is_unit_of_column(unit) or is_unit(unit) for unit in others)
        if 2 * known >= max(1, len(others)) if is_clock(upper[0]) else all(map(is_unit_of_column, others)):
            return upper, [unit or UNKNOWN_UNITS for unit in plain]
    counted = bool(upper) and upper[0].strip().lower() in INDEX_NAMES and any(plain)
    stated = (plain[0] or counted) and all(not unit or is_unit_of_column(unit) for unit in plain)
    # of a row of units alone the names above need not begin with the time's
    if (
        len(upper) == width
        and stated
        and (counted or is_clock(upper[0]) or (all(plain) and not any(map(is_unit_of_column, upper))))
    ):
        return upper, [unit or UNKNOWN_UNITS for unit in plain]
    return None


def _metadata(above: list[str], separator: str | None, header_line: int | None) -> dict[str, Any]:
    """What the lines above the table say, by name."""
    found: dict[str, Any] = {}
    for number, line in enumerate(above):
        match = KEY_VALUE.match(line)
        if not match or (number == header_line and not COMMENT.match(line)):
            continue
        key, text = match.group(1).strip(), match.group(2).strip()
        if COMMENT.match(line):
            try:
                found[key] = json.loads(text)
                continue
            except ValueError:
                pass
        for name, value in _values(key, text, separator):
            found.setdefault(name, value)
    return found


def _values(key: str, text: str, separator: str | None) -> Sequence[tuple[str, str]]:
    """One value, or one for each column where they differ."""
    cells = [text]
    for sign in (separator, ";", "\t"):
        if sign and sign in text:
            cells = [cell.strip() for cell in text.split(sign) if cell.strip()]
            break
    if len(cells) < 2 or (separator == "," and re.fullmatch(r"\d{1,3}(,\d{3})+", text)):
        return [(key, text)]
    if len(set(cells)) == 1:
        return [(key, cells[0])]
    return [(f"{key} {i + 1}" if i else key, cell) for i, cell in enumerate(cells)]


# The end of a text, where it may be cut off.


TAIL, TAIL_READ = 1 << 14, 1 << 20
"""Bytes at the end of a text that are looked at, and that are read at once to come there."""


def last_lines(path: Path, packed: bool) -> tuple[bool, list[str]]:
    """Return whether the last line of a text has an end, and its last lines with numbers."""
    tail = b""
    with path.open("rb") as raw:
        if packed:
            with gzip.GzipFile(fileobj=raw) as stream:
                while piece := stream.read(TAIL_READ):
                    tail = (tail + piece)[-TAIL:]
        else:
            raw.seek(0, 2)
            raw.seek(max(0, raw.tell() - TAIL))
            tail = raw.read()
    # the second byte of a character of two, or the last three of four
    ended = tail.rstrip(b"\0").endswith((b"\n", b"\r"))
    text = tail.replace(b"\0", b"").decode("utf-8", errors="replace")
    lines = [line for line in text.splitlines()[1:] if line.strip() and not COMMENT.match(line)]
    return ended, lines


def digits_of(cell: str) -> tuple[int, int] | None:
    """Return how many decimals and characters of an exponent a number has; None for what is no number."""
    found = re.fullmatch(r"[-+]?\d*(?:[.,](\d*))?([eE][-+]?\d*)?", cell.strip())
    return None if found is None else (len(found.group(1) or ""), len(found.group(2) or ""))


# Columns of times in text tables: seconds, time stamps, dates and times of day; and columns that number the rows.


MONTHS = {name: f"{k:02d}" for k, name in enumerate("jan feb mar apr may jun jul aug sep oct nov dec".split(), 1)}
DAY = 86400.0
"""Seconds."""
LONGEST_SECONDS = 1.0
"""Largest step of an unnamed column of times that is taken for seconds: more are parts of one."""


class Times:
    """Seconds of the rows of a table, block by block, from the first row on for time stamps."""

    def __init__(self, layout: CsvLayout, path: Path) -> None:
        self.layout, self.path = layout, path
        self.origin: float | None = None
        self.first_tick: int | None = None
        self.last = -np.inf
        self.days = 0.0

    def seconds(self, values: np.ndarray, stamped: pd.DataFrame | None) -> np.ndarray | None:
        """Times in s of a block, or None if the table has none.

        Raises
        ------
        SignalFileError
            If a stamp cannot be read.
        """
        layout = self.layout
        if layout.clock is None:
            return None
        if stamped is None:
            return self._of_numbers(values[:, layout.clock])
        texts = stamped.iloc[:, 0].astype(str).str.strip().str.strip('"')
        for column in stamped.columns[1:]:
            texts = texts + " " + stamped[column].astype(str).str.strip().str.strip('"')
        texts, halves = of_24_hours(texts.str.replace(",", ".", regex=False))
        if DURATION.match(texts.iloc[0]):
            seconds = self._of_durations(texts)
        elif re.match(r"^(\d+ days? )?\d{1,2}:", texts.iloc[0]):
            seconds = self._of_clocks(texts)
        else:
            seconds = self._of_dates(texts, halves)
        if self.origin is None:
            self.origin = float(seconds[0])
        return seconds - self.origin

    def _of_numbers(self, column: np.ndarray) -> np.ndarray:
        clock = self.layout.clock
        assert clock is not None
        factor = seconds_of(self.layout.units[clock], self.layout.names[clock]) or 1.0
        largest = float(np.nanmax(np.abs(column), initial=0.0))
        if factor == 1.0:
            factor = next((f for limit, f in EPOCHS if largest > limit), 1.0)
        if largest * factor > LARGEST:
            # seconds since 1970 leave too few digits for the fraction
            self.origin = float(column[0]) if self.origin is None else self.origin
            return (column - self.origin) * factor
        return column * factor

    def _of_dates(self, texts: pd.Series, american: bool) -> np.ndarray:
        try:
            found = pd.to_datetime(_iso(texts, american), format="ISO8601", utc=True)
        except (ValueError, OverflowError) as exc:
            raise SignalFileError(self.path, f"its time stamps cannot be read ({str(exc).splitlines()[0]})") from exc
        if found.isna().any():
            row = int(np.argmax(found.isna().to_numpy()))
            raise SignalFileError(
                self.path, f"its time stamp in row {row + 1} of the table is missing or cannot be read"
            )
        ticks = found.dt.as_unit("ns").astype("int64").to_numpy()
        self.first_tick = int(ticks[0]) if self.first_tick is None else self.first_tick
        return (ticks - self.first_tick) * 1e-9

    def _of_durations(self, texts: pd.Series) -> np.ndarray:
        found = texts.str.extract(DURATION.pattern)
        if found[0].isna().any():
            row = int(np.argmax(found[0].isna().to_numpy()))
            raise SignalFileError(self.path, f"its time in row {row + 1} of the table is {texts.iloc[row]!r}")
        return (found[0].astype(float) * found[1].map(SECONDS)).to_numpy(dtype=float)

    def _of_clocks(self, texts: pd.Series) -> np.ndarray:
        padded = texts.where(texts.str.count(":") == 2, texts + ":00")
        try:
            seconds = pd.to_timedelta(padded).dt.total_seconds().to_numpy(dtype=float)
        except ValueError as exc:
            raise SignalFileError(self.path, f"its times of day cannot be read ({str(exc).splitlines()[0]})") from exc
        before = np.concatenate(([self.last if np.isfinite(self.last) else seconds[0]], seconds[:-1]))
        midnights = np.cumsum(seconds - before < -0.5 * DAY)
        self.last = float(seconds[-1])
        out = seconds + DAY * (self.days / DAY + midnights)
        self.days += DAY * float(midnights[-1])
        return out


def _iso(texts: pd.Series, american: bool) -> pd.Series:
    """Stamps with their dates as year-month-day; of 3/4/2024 the day is first unless it is American, or cannot be."""
    if re.match(r"^\d{1,2}-[A-Za-z]{3}-", texts.iloc[0]):
        named = texts.str.extract(r"^(\d{1,2})-([A-Za-z]{3})-(\d{4})(.*)$")
        number = named[1].str.lower().map(MONTHS)
        return texts if number.isna().any() else named[2] + "-" + number + "-" + named[0].str.zfill(2) + named[3]
    year_first = texts.str.extract(r"^(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})(.*)$")
    if year_first[0].notna().all():
        parts = [year_first[k] for k in (0, 1, 2, 3)]
    else:
        found = texts.str.extract(r"^(\d{1,2})[-/.](\d{1,2})[-/.](\d{4})(.*)$")
        if found[0].isna().any():
            return texts
        american = bool((found[1].astype(int) > 12).any()) or (american and bool((found[0].astype(int) < 13).all()))
        parts = [found[k] for k in ((2, 0, 1, 3) if american else (2, 1, 0, 3))]
    year, month, day, rest = parts
    return year + "-" + month.str.zfill(2) + "-" + day.str.zfill(2) + rest


def index_meaning(
    column: np.ndarray, clock: np.ndarray | None, fewest: int = 2
) -> tuple[str | None, np.ndarray | None]:
    """What a first column that is not called time is: words for the reader, and seconds if it holds times.

    Both are None if it is neither, or has too few rows to tell. 0, 1, 2 ... number the rows; other numbers that rise
    evenly are times in s, where there is no other column of times.
    """
    if len(column) < fewest or not np.isfinite(column).all():
        return None, None
    steps = np.diff(column)
    if np.all(steps == 1.0) and column[0] == np.rint(column[0]):
        return "The first column only numbers the rows and is left out.", None
    even = np.all(steps > 0.0) and np.allclose(steps, steps.mean(), rtol=0.05)
    if (even or rises_evenly(column)) and clock is None:
        if (step := float(steps.mean())) > LONGEST_SECONDS:
            return (
                f"The first column rises evenly, by {step:.6g} a row, too much for seconds; its unit is nowhere said, "
                "and it is left out."
            ), None
        return "The first column rises evenly; it is taken for the time in s.", column
    return None, None
