"""What cells of text tables hold: numbers, gaps, stamps, printed minus signs, groups of thousands, AM and PM, words."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import pandas as pd

from gearmbs.signals.signal.labels import RPM_UNITS, name_and_unit

COMMENT = re.compile(r"^\s*[#%]")
GAP_CELLS = frozenset(
    {"", "nan", "-nan", "null", "none", "na", "n/a", "#n/a", "-", "--", "<na>", "#num!", "inf", "-inf", "∞", "-∞", "+∞"}
)
DATE = r"(?:\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.](?:\d{1,2}|[A-Za-z]{3})[-/.]\d{4})"
CLOCK = r"(?:\d+ days? )?\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?: ?[AaPp]\.?[Mm]\.?)?(?:Z|[+-]\d{2}:?\d{2})?"
DURATION = re.compile(r"^([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?) ?(ms|sec|s|min|hr|days|day)$")
"""As MATLAB writes times of a timetable."""
STAMPS: tuple[tuple[str, re.Pattern[str]], ...] = (
    ("stamp", re.compile(rf"^{DATE}[T ]{CLOCK}$")),
    ("date", re.compile(rf"^{DATE}$")),
    ("clock", re.compile(rf"^{CLOCK}$")),
    ("clock", DURATION),
)
SEPARATIONS: tuple[tuple[str | None, str], ...] = (
    (";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", "."), (",", ","), (None, "."), (None, ","),
)  # fmt: skip
"""Commas between numbers with decimal commas are those of quoted cells."""
Kind = Literal["number", "gap", "stamp", "date", "clock", "text"]

MINUS = "\u2212\u2013\u2012\ufe63\uff0d"
"""Signs that typesetters and spreadsheets write for a minus."""
PRINTED_MINUS = re.compile(rf"(?:(?<![\w.])|(?<=\d[eE]))[{MINUS}](?=[\d.,])")
SPACES = "\u00a0\u202f\u2009 "
GROUPED = re.compile(rf"[-+]?\d{{1,3}}(?P<sign>[.,'\u2019{SPACES}])\d{{3}}(?:(?P=sign)\d{{3}})*(?:[.,]\d+)?")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")
BELOW = re.compile(r"[-+]?\d{1,3}")
FEWEST = 3
"""Cells of either kind by which digits in threes are told from decimals."""
HALF_DAY = re.compile(r"^(.*?)(\d{1,2})(:\d{2}.*?)\s?([AaPp])\.?[Mm]\.?$")
WITHOUT = "write numbers without separators of thousands (in spreadsheets a format of the cells)"


def with_minus(line: str) -> str:
    """Return a line with a plain minus for each printed one before a number.

    Examples
    --------
    >>> with_minus("0.1;\u22120.5;1e\u22123")
    '0.1;-0.5;1e-3'
    """
    return PRINTED_MINUS.sub("-", line)


def between_thousands(cell: str) -> str | None:
    """Return the sign between the thousands of a cell, or None.

    Examples
    --------
    >>> [between_thousands(cell) for cell in ("-1.165,44", "1 000", "1,000,000", "1.5")]
    ['.', ' ', ',', None]
    """
    text = cell.strip().strip('"').strip()
    found = GROUPED.fullmatch(text)
    return None if found is None else found["sign"]


def in_thousands(cells: Iterable[str], decimal: str) -> str | None:
    """Return a cell of a column whose decimal sign separates thousands, or None.

    All numbers with the sign have three digits behind it, of which some end with a zero, and one to three before, which
    begin with none; all others have at most three. Decimals of a fixed format stand in all numbers, and others end with
    no zero.
    """
    present = [cell.strip().strip('"') for cell in cells if cell.strip().strip('"')]
    signed = [cell for cell in present if decimal in cell]
    plain = [cell for cell in present if decimal not in cell]
    if min(len(signed), len(plain)) < FEWEST:
        return None
    told = all(map(THOUSANDS.fullmatch, signed)) and all(map(BELOW.fullmatch, plain))
    return next((cell for cell in signed if cell.endswith("0")), None) if told else None


HEAD_THOUSANDS = re.compile(r"^([1-9]\d{0,2}(?:\.\d{3})+)\s*(\S*)$")
HEAD_DECIMAL = re.compile(r"^[+-]?(\d+\.\d+)(?:\s*[^\s\d.]\S*)?$")
VERSION = re.compile(r"version|software|firmware|release|revision|serial", re.IGNORECASE)
LARGEST = {"hz": 1e7, "rpm": 2e5}
"""Of sampling rates and of speeds: what would be more has decimals."""


def without_thousands(meta: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return a header without the points between thousands, of a file whose decimals have commas; and what is said.

    Rates in Hz and speeds in rpm are written with them, as whole numbers. A number of the header with another point
    says that its points are decimal ones.

    Examples
    --------
    >>> without_thousands({"Abtastrate": "25.600 Hz", "Faktor": "1.234", "fs": "51.200 kHz"})[0]
    {'Abtastrate': '25600 Hz', 'Faktor': '1.234', 'fs': '51.200 kHz'}
    >>> without_thousands({"Abtastrate": "25.600 Hz", "dt": "0.039 s"})[0]
    {'Abtastrate': '25.600 Hz', 'dt': '0.039 s'}
    """
    texts = {name: value.strip() for name, value in meta.items() if isinstance(value, str)}
    decimal = [
        match[1] for name, text in texts.items() if not VERSION.search(name) and (match := HEAD_DECIMAL.match(text))
    ]
    if any(not HEAD_THOUSANDS.match(number) for number in decimal):
        return dict(meta), []
    found, said = dict(meta), []
    for name, text in texts.items():
        match = HEAD_THOUSANDS.match(text)
        if match is None:
            continue
        unit = (match[2] or name_and_unit(name)[1]).lower()
        plain = match[1].replace(".", "")
        if float(plain) > LARGEST.get("rpm" if unit in RPM_UNITS else unit, 0.0):
            continue
        found[name] = f"{plain} {match[2]}".rstrip()
        said.append(
            f"{name} = {match[1]!r} is read as {plain}: decimals of the file have commas, its thousands points."
        )
    return found, said


def thousands_column(rows: Sequence[Sequence[str]], names: Sequence[str], decimal: str) -> tuple[str, str] | None:
    """Return name and a cell of the first column with separators of thousands that look like decimals, or None."""
    for i, name in enumerate(names):
        cell = in_thousands((row[i] for row in rows if i < len(row)), decimal)
        if cell is not None:
            return name, cell
    return None


def of_24_hours(texts: pd.Series) -> tuple[pd.Series, bool]:
    """Return times of day without AM and PM, and whether there were some: then dates have the month first."""
    parts = texts.str.extract(HALF_DAY)
    found = parts[0].notna()
    if not found.any():
        return texts, False
    hours = pd.to_numeric(parts[1]) % 12 + 12 * parts[3].str.lower().eq("p")
    written = parts[0] + hours.fillna(0).astype(int).astype(str).str.zfill(2) + parts[2]
    return texts.where(~found, written), True


def cell_kind(cell: str, decimal: str) -> Kind:
    """What a cell holds: a number, a gap, a time stamp, a date, a time of day, or text."""
    text = cell.strip().strip('"').strip()
    if text.lower() in GAP_CELLS:
        return "gap"
    if is_number(text, decimal):
        return "number"
    for kind, pattern in STAMPS:
        if pattern.match(text):
            return kind  # type: ignore[return-value]
    return "text"


def is_number(cell: str, decimal: str) -> bool:
    """True for a number with this decimal sign."""
    try:
        float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return "_" not in cell


def split_cells(line: str, separator: str | None) -> list[str]:
    """The cells of a line."""
    line = line.strip("\r\n") if separator == "\t" else line.strip()
    if separator == ",":
        try:
            return [cell.strip() for cell in next(csv.reader([line]))]
        except (StopIteration, csv.Error):
            return []
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    return cells[:-1] if separator is not None and cells and cells[-1] == "" else cells
