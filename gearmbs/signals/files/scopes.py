"""Tables of oscilloscopes that hold more than columns of numbers: their rate in the headings, or a header beside them.

Rigol numbers the samples and says their start and increment where headings and units of two more columns would stand,
or as ``t0 =`` and ``tInc =`` behind the headings. Older ones of Tektronix have names and values of a header in the
first columns of the rows whose last ones hold times and volts.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from gearmbs.signals.files.cells import is_number, split_cells
from gearmbs.signals.files.text_tables import CsvLayout
from gearmbs.signals.signal.labels import name_and_unit, unique_names
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

START = re.compile(r"\bt0\s*=\s*([-+.\deE]+)")
INCREMENT = re.compile(r"\btInc\s*=\s*([-+.\deE]+)", re.IGNORECASE)
HEADER = ("record length", "sample interval")
"""What the first two rows of Tektronix's begin with."""
BEYOND = 24
"""Row whose first columns are empty: the header has fewer."""


def scope_layout(head: Sequence[str]) -> CsvLayout | None:
    """Return the layout of a table of an oscilloscope by its first lines; None of any other table."""
    lines = [(number, line) for number, line in enumerate(head) if line.strip()]
    if len(lines) < 3:
        return None
    rows = [split_cells(line, ",") for _, line in lines]
    below = lines[1][0], lines[2][0]
    return _sequence(rows, below[1]) or _increment(lines[0][1], rows, below[0]) or _beside(rows, lines[0][0])


def _sequence(rows: list[list[str]], first: int) -> CsvLayout | None:
    names = [cell.lower() for cell in rows[0]]
    if names[:1] != ["x"] or "start" not in names or rows[1][:1] != ["Sequence"]:
        return None
    k = names.index("start")
    if names[k + 1 : k + 2] != ["increment"] or len(rows[1]) < k + 2 or not _numbers(rows[1][k : k + 2]):
        return None
    told = {"t0": float(rows[1][k]), "sample interval": f"{rows[1][k + 1]} s"}
    units = ["V" if cell.lower() in ("volt", "volts") else cell for cell in rows[1][1:k]]
    # logic channels have no unit and are written as 0x00
    words = tuple(
        i for i, unit in enumerate(units, 1) if not unit and rows[2][i : i + 1] and not _numbers([rows[2][i]])
    )
    layout = _layout(first, ["index", *rows[0][1:k]], [UNKNOWN_UNITS, *units], len(rows[2]), told, index=0)
    return replace(layout, beside=words)


def _increment(line: str, rows: list[list[str]], first: int) -> CsvLayout | None:
    start, step = START.search(line), INCREMENT.search(line)
    if start is None or step is None:
        return None
    labels = [name_and_unit(cell) for cell in rows[0] if cell and "=" not in cell]
    filled = [cell for cell in rows[1] if cell]
    if not labels or not _numbers(filled):
        return None
    # times may stand before the volts, or be left out with or without their heading
    labels = labels[-len(filled) :] if rows[1][0] else labels
    told = {"t0": float(start.group(1)), "sample interval": f"{step.group(1)} s"}
    clock = 0 if labels[0][0].lower() == "time" and rows[1][0] else None
    names, units = zip(*labels, strict=True)
    return _layout(first, list(names), list(units), len(rows[1]), {} if clock == 0 else told, clock=clock)


def _beside(rows: list[list[str]], first: int) -> CsvLayout | None:
    if [row[0].lower() if row else "" for row in rows[:2]] != list(HEADER):
        return None
    later = rows[min(len(rows) - 1, BEYOND)]
    places = [i for i, cell in enumerate(later) if cell]
    if len(places) < 2 or places[0] < 2 or any(not _numbers([row[i] for i in places]) for row in rows[:3]):
        return None
    told = {row[0]: " ".join(row[1 : places[0]]).strip() for row in rows if row[0]}
    source, unit = told.get("Source") or "CH1", told.get("Vertical Units") or UNKNOWN_UNITS
    width = max(map(len, rows))
    names, units = [""] * width, [UNKNOWN_UNITS] * width
    names[places[0]], units[places[0]] = "time", "s"
    for i in places[1:]:
        names[i], units[i] = source, unit
    beside = tuple(range(places[0]))
    empty = tuple(i for i in range(places[0], width) if i not in places)
    told = {"sample interval": f"{told['Sample Interval'].split()[0]} s"}
    return CsvLayout(first, ",", ".", unique_names(names), units, told, places[0], empty=empty, beside=beside)


def _layout(
    first: int, names: list[str], units: list[str], width: int, told: dict[str, object], clock: int | None = None,
    index: int | None = None,
) -> CsvLayout:  # fmt: skip
    more = range(len(names), max(width, len(names)))
    names, units = [*names, *("" for _ in more)], [*units, *(UNKNOWN_UNITS for _ in more)]
    return CsvLayout(first, ",", ".", unique_names(names), units, told, clock, index=index, empty=tuple(more))


def _numbers(cells: Sequence[str]) -> bool:
    return bool(cells) and all(is_number(cell, ".") for cell in cells)
