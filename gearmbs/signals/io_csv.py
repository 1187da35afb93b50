"""CSV and gzip CSV: columns of numbers, with names, units and metadata in the lines above them.

Written files begin with `# key: value` lines (JSON values) and a row of names with units in brackets. Read are these
and most others: comma, semicolon, tab or blank as separator, decimal commas, names with or without units, a time
column, or nothing but numbers.
"""

from __future__ import annotations

import gzip
import io
import json
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
import pandas as pd

from .errors import SignalError, SignalFileError
from .record import RATE_KEYS, TIME_KEYS, Progress, Record, plain, rate_from_times
from .signal import UNKNOWN_UNITS, check_teeth

CHUNK_ROWS = 1 << 17
HEAD_LINES = 60
# Times are written with few digits; beyond this many samples a gap is a gap.
MAX_JUMP = 2.0
ROUNDED_TIMES = 0.01
COMMENT = re.compile(r"^\s*[#%]")
KEY_VALUE = re.compile(r"^\s*[#%]*\s*([A-Za-z_][\w .]*?)\s*[:=]\s*(.+?)\s*$")
NAME_UNIT = re.compile(r"^(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*$")
# pandas before 3.1 rounds the last bit unless told otherwise; later versions are exact and warn at the option.
EXACT: dict[str, Any] = (
    {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}
)


@contextmanager
def _open_text(path: Path, packed: bool):
    with open(path, "rb") as raw:
        stream: IO[bytes] = gzip.GzipFile(fileobj=raw) if packed else raw  # type: ignore[assignment]
        with io.TextIOWrapper(stream, encoding="utf-8-sig", errors="replace", newline=None) as text:
            yield text, raw


@dataclass(frozen=True)
class _Layout:
    """How the table of a file is written: line of the first numbers, separators, and what stands above them."""

    first: int
    separator: str | None
    decimal: str
    names: list[str]
    units: list[str]
    meta: dict[str, Any]

    @property
    def clock(self) -> int | None:
        """Index of the column that holds times."""
        found = next((i for i, name in enumerate(self.names) if name.lower() in TIME_KEYS), None)
        return found if len(self.names) > 1 else None


def read_csv(path: Path, packed: bool, progress: Progress | None = None, rate: float | None = None) -> Record:
    """Read a text table; `packed` for gzip. A known `rate` (Hz) stands in for times that are only rounded.

    Raises
    ------
    SignalFileError
        If the file is damaged, binary, has no numbers, or a row is short or not numeric (with its line number).
    """
    with _damage_named(path):
        layout = _layout(path, packed)
        blocks = []
        for values, fraction in _blocks(path, packed, layout):
            blocks.append(values)
            if progress is not None:
                progress(fraction, "reading")
    return _record(path, np.concatenate(blocks), layout, rate)


def csv_pieces(path: Path, packed: bool, rate: float | None = None) -> Iterator[tuple[Record, float]]:
    """Read a text table block by block: records in their order, each with the fraction read by then.

    Raises
    ------
    SignalFileError
        As `read_csv`, and if the times of a block do not go on where the last one ended.
    """
    with _damage_named(path):
        layout = _layout(path, packed)
        clock, first, count = layout.clock, None, 0
        for values, fraction in _blocks(path, packed, layout):
            if first is None:
                first = record = _record(path, values, layout, rate)
            elif clock is not None and first.rate is not None:
                time = float(values[0, clock]) * _time_factor(layout, clock)
                strayed = abs(time - first.t0 - count / first.rate) * first.rate
                # the mean rate of rounded times is as good as the given one, and drifts from it as much
                if strayed > (MAX_JUMP if rate is None else max(MAX_JUMP, ROUNDED_TIMES * count)):
                    raise SignalFileError(path, f"its times jump by {strayed:.3g} samples after row {count}")
                record = replace(first, values=np.delete(values, clock, axis=1))
            else:
                record = replace(first, values=values)
            count += len(values)
            yield record, fraction


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except (EOFError, gzip.BadGzipFile, zlib.error) as exc:
        raise SignalFileError(path, f"its gzip data is damaged or cut short ({exc})") from exc


def _layout(path: Path, packed: bool) -> _Layout:
    with _open_text(path, packed) as (text, _):
        head = [line for line, _ in zip(text, range(HEAD_LINES))]
    if any("\x00" in line for line in head):
        raise SignalFileError(path, "holds binary data, not text; is it in another format or in UTF-16?")
    first, separator, decimal = _find_numbers(head, path)
    names, units = _names(head[:first], separator, len(_split(head[first], separator)))
    return _Layout(first, separator, decimal, names, units, _metadata(head[:first]))


def _blocks(path: Path, packed: bool, layout: _Layout) -> Iterator[tuple[np.ndarray, float]]:
    """Tables of numbers, all columns, each with the fraction of the file that is read by then."""
    width, first, separator = len(layout.names), layout.first, layout.separator
    size = path.stat().st_size
    try:
        with _open_text(path, packed) as (text, raw):
            for _ in range(first):
                text.readline()
            table = pd.read_csv(
                text,
                sep=r"\s+" if separator is None else separator,
                decimal=layout.decimal,
                header=None,
                names=list(range(width)),
                index_col=False,
                dtype=float,
                comment="#",
                skip_blank_lines=True,
                chunksize=CHUNK_ROWS,
                **EXACT,
            )
            for block in table:
                values = block.to_numpy()
                if np.isnan(values).any():
                    raise ValueError("missing values")
                yield values, min(1.0, raw.tell() / size)
    except (ValueError, pd.errors.ParserError) as exc:
        if isinstance(exc, SignalError):
            raise
        fault = _first_bad_line(path, packed, first, separator, layout.decimal, width, exc)
        raise SignalFileError(path, fault) from exc


def _only_rounded(times: np.ndarray, rate: float) -> bool:
    """True for times that never go back and whose mean rate is the given one, whatever their steps."""
    span = float(times[-1] - times[0])
    mean = (times.size - 1) / span if span > 0.0 else 0.0
    return bool(np.all(np.diff(times) >= 0.0)) and abs(mean - rate) <= ROUNDED_TIMES * rate


def _time_factor(layout: _Layout, clock: int) -> float:
    return {"ms": 1e-3, "us": 1e-6}.get(layout.units[clock], 1.0)


def _record(path: Path, values: np.ndarray, layout: _Layout, given: float | None = None) -> Record:
    names, units, meta, clock = layout.names, layout.units, layout.meta, layout.clock
    rate = next((float(v) for k, v in meta.items() if k.lower().replace(" ", "_") in RATE_KEYS), None)
    t0 = float(meta.get("t0", 0.0))
    if clock is not None and len(values) > 1:
        times = values[:, clock] * _time_factor(layout, clock)
        t0 = float(times[0])
        if rate is None and given is not None and _only_rounded(times, given):
            rate = given
        rate = rate_from_times(times, path) if rate is None else rate
        values = np.delete(values, clock, axis=1)
        names = [n for i, n in enumerate(names) if i != clock]
        units = [u for i, u in enumerate(units) if i != clock]
    speed, teeth = meta.get("speed"), meta.get("teeth")
    try:
        teeth = None if teeth is None else check_teeth(teeth)
        speed = None if speed is None else float(speed)
    except (SignalError, ValueError, TypeError) as exc:
        raise SignalFileError(path, f"its header is not understood: {exc}") from exc
    attrs = meta.get("attrs", {})
    return Record(values, names, units, rate, t0, speed, teeth, attrs if isinstance(attrs, dict) else {})


def write_csv(record: Record, path: Path, packed: bool, progress: Progress | None = None) -> None:
    """Write a text table whose numbers read back to the same bits; `packed` for gzip."""
    with open(path, "wb") as raw:
        stream: IO[bytes] = gzip.GzipFile(fileobj=raw, mode="wb", filename="", mtime=0) if packed else raw  # type: ignore
        with io.TextIOWrapper(stream, encoding="utf-8", newline="\n") as text:
            meta = {"sampling_rate": record.rate, "t0": record.t0, "speed": record.speed, "teeth": record.teeth}
            for key, value in meta.items():
                if value is not None:
                    text.write(f"# {key}: {json.dumps(value)}\n")
            if record.attrs:
                text.write(f"# attrs: {json.dumps(plain(record.attrs))}\n")
            cells = [f"{name} [{unit}]" for name, unit in zip(record.names, record.units)]
            text.write(",".join(_quoted(cell) for cell in cells) + "\n")
            count = record.values.shape[0]
            for start in range(0, count, CHUNK_ROWS):
                block = pd.DataFrame(record.values[start : start + CHUNK_ROWS])
                block.to_csv(text, header=False, index=False, lineterminator="\n")
                if progress is not None:
                    progress(min(1.0, (start + CHUNK_ROWS) / count), "writing")


def _find_numbers(head: list[str], path: Path) -> tuple[int, str | None, str]:
    for index, line in enumerate(head):
        if not line.strip() or COMMENT.match(line):
            continue
        for separator, decimal in (
            (";", "."),
            (";", ","),
            ("\t", "."),
            ("\t", ","),
            (",", "."),
            (None, "."),
            (None, ","),
        ):
            if separator is not None and separator not in line:
                continue
            cells = _split(line, separator)
            if cells and all(_number(cell, decimal) for cell in cells):
                return index, separator, decimal
    sample = next((line.strip() for line in head if line.strip()), "")
    raise SignalFileError(
        path, f"holds no row of numbers in its first {len(head)} lines; it begins with {sample[:60]!r}"
    )


def _split(line: str, separator: str | None) -> list[str]:
    line = line.strip("\r\n") if separator == "\t" else line.strip()
    if separator == ",":
        return [cell.strip() for cell in next(_csv_rows([line]))]
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    return cells[:-1] if separator is not None and cells and cells[-1] == "" else cells


def _csv_rows(lines: list[str]):
    import csv

    return csv.reader(lines)


def _number(cell: str, decimal: str) -> bool:
    try:
        float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return False
    return True


def _names(above: list[str], separator: str | None, width: int) -> tuple[list[str], list[str]]:
    rows = [line for line in above if line.strip() and not COMMENT.match(line)]
    if rows and width == 1:
        rows = [f'"{row.strip().strip(chr(34))}"' for row in rows[-1:]]
        separator = ","
    cells = _split(rows[-1], separator) if rows else []
    if len(cells) != width:
        return [f"ch{i + 1}" for i in range(width)], [UNKNOWN_UNITS] * width
    bare = [NAME_UNIT.match(cell) for cell in cells]
    if len(rows) > 1 and all(m and not m.group(1) for m in bare):
        upper = _split(rows[-2], separator)
        if len(upper) == width:
            return _unique(upper), [m.group(2) or UNKNOWN_UNITS for m in bare if m]
    names = [m.group(1) if m and m.group(1) else cell for m, cell in zip(bare, cells)]
    units = [m.group(2) if m and m.group(1) and m.group(2) else UNKNOWN_UNITS for m in bare]
    return _unique(names), units


def _unique(names: list[str]) -> list[str]:
    named = [name or f"ch{i + 1}" for i, name in enumerate(names)]
    return [n if named.count(n) == 1 else f"{n}_{named[:i].count(n) + 1}" for i, n in enumerate(named)]


def _metadata(above: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for line in above:
        match = KEY_VALUE.match(line)
        if not match:
            continue
        key, text = match.group(1).strip(), match.group(2)
        try:
            found[key] = json.loads(text)
        except ValueError:
            number = re.match(r"^[-+]?\d+(\.\d*)?([eE][-+]?\d+)?", text)
            found[key] = float(number.group()) if number else text
    return found


def _first_bad_line(
    path: Path, packed: bool, first: int, separator: str | None, decimal: str, width: int, exc: Exception
) -> str:
    with _open_text(path, packed) as (text, _):
        for number, line in enumerate(text, 1):
            if number <= first or not line.strip() or COMMENT.match(line):
                continue
            cells = _split(line.split("#")[0], separator)
            if len(cells) != width:
                return f"line {number} has {len(cells)} values where {width} are expected: {line.strip()[:60]!r}"
            for cell in cells:
                if not _number(cell, decimal):
                    return f"line {number} holds {cell[:40]!r}, which is not a number"
                if not np.isfinite(float(cell.replace(",", ".") if decimal == "," else cell)):
                    return f"line {number} holds {cell[:40]!r}; cut or repair the record first"
    return f"cannot be read as a table ({exc})"


def _quoted(cell: str) -> str:
    return '"' + cell.replace('"', '""') + '"' if any(c in cell for c in ',"\n') else cell
