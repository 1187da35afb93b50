"""LabVIEW measurement files (.lvm): text with a header, and one more for every segment."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.format import Content, Format
from gearmbs.signals.files.text_tables import decoded
from gearmbs.signals.signal.record import Record, rate_from_times, same_rate
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

END = "***End_of_Header***"
SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


def read_lvm(path: Path, rate: float | None = None) -> Record:
    """Read all segments of a LabVIEW measurement file, one behind the other.

    Raises
    ------
    SignalFileError
        If the header has no end, a row is not numeric, segments have different channels, or channels different rates.
    """
    lines = decoded(path.read_bytes()).splitlines()
    ends = [i for i, line in enumerate(lines) if line.startswith(END)]
    if not ends:
        raise SignalFileError(path, f"is named as lvm, but has no line {END}; pass format='csv' if it is a plain table")
    head = _pairs(lines[: ends[0]], "\t") or _pairs(lines[: ends[0]], ",")
    name = (head.get("Separator") or ["Tab"])[0].lower()
    separator = SEPARATORS.get(name, "\t")
    head = _pairs(lines[: ends[0]], separator)
    decimal = (head.get("Decimal_Separator") or ["."])[0] or "."
    starts = ends[1:] or ends[:1]
    parts = [_segment(path, lines, starts, i, ends[0], separator, decimal, head, rate) for i in range(len(starts))]
    first = parts[0]
    notes = []
    for part in parts[1:]:
        if part.names != first.names or part.rate != first.rate:
            raise SignalFileError(
                path, f"its segments differ: {first.names} at {first.rate} Hz, {part.names} at {part.rate} Hz"
            )
    if len(parts) > 1:
        first.values = np.concatenate([part.values for part in parts])
        notes.append(f"{len(parts)} segments are joined end to end; pauses between them are not kept.")
    first.notes = notes
    return first


def _segment(
    path: Path,
    lines: list[str],
    starts: list[int],
    index: int,
    first_end: int,
    separator: str,
    decimal: str,
    file_head: dict[str, list[str]],
    given: float | None,
) -> Record:
    """The segment whose header ends at line ``starts[index]``."""
    begin = starts[index]
    stop = len(lines) if index + 1 == len(starts) else _segment_header(lines, starts[index + 1])
    top = first_end + 1 if index == 0 else _segment_header(lines, begin)
    head = {**file_head, **_pairs(lines[min(top, begin) : begin], separator)}
    at = begin + 1
    while at < stop and not lines[at].strip():
        at += 1
    if at >= stop:
        raise SignalFileError(path, f"its segment {index + 1} holds no rows")
    labels = [cell.strip() for cell in lines[at].split(separator)]
    if labels and labels[-1] == "":
        labels = labels[:-1]
    x_columns = [i for i, label in enumerate(labels) if label.startswith("X_Value")]
    kept = [i for i, label in enumerate(labels) if i not in x_columns and label != "Comment"]
    rows, times = [], []
    for number, line in enumerate(lines[at + 1 : stop], at + 2):
        if not line.strip():
            continue
        cells = line.split(separator)
        try:
            values = [float(cells[i].replace(decimal, ".")) if cells[i].strip() else math.nan for i in kept]
            times.append(
                float(cells[x_columns[0]].replace(decimal, "."))
                if x_columns and cells[x_columns[0]].strip()
                else math.nan
            )
        except (ValueError, IndexError):
            raise SignalFileError(
                path, f"line {number} does not hold {len(kept)} numbers: {line.strip()[:60]!r}"
            ) from None
        rows.append(values)
    if not rows or not kept:
        raise SignalFileError(path, f"its segment {index + 1} holds no samples")
    names = [labels[i] for i in kept]
    steps = [_number(text, decimal) for text in head.get("Delta_X", [])]
    rates = {name: 1.0 / step if step else None for name, step in zip(names, steps)}
    rate = same_rate(path, rates)
    clock = np.asarray(times)
    if rate is None and clock.size > 1 and np.isfinite(clock).all() and given is None:
        rate = rate_from_times(clock, path)
    units = [unit or UNKNOWN_UNITS for unit in head.get("Y_Unit_Label", [])]
    units = [units[i] if i < len(units) else UNKNOWN_UNITS for i in range(len(names))]
    t0 = _number((head.get("X0") or ["0"])[0], decimal) or 0.0
    return Record(np.asarray(rows), names, units, rate, t0)


def _segment_header(lines: list[str], end: int) -> int:
    """First line of the header that ends at `end`: the line Channels."""
    for i in range(end - 1, -1, -1):
        if lines[i].startswith("Channels"):
            return i
        if lines[i].startswith(END):
            return i + 1
    return end


def _pairs(lines: list[str], separator: str) -> dict[str, list[str]]:
    found = {}
    for line in lines:
        cells = [cell.strip() for cell in line.split(separator)]
        if len(cells) > 1 and cells[0]:
            values = cells[1:]
            while values and values[-1] == "":
                values.pop()
            found[cells[0]] = values
    return found


def _number(text: str, decimal: str) -> float | None:
    try:
        return float(text.replace(decimal, "."))
    except ValueError:
        return None


FORMATS = {
    "lvm": Format(
        read=lambda path, asked: read_lvm(path, asked.rate),
        contents={
            "lvm": Content(
                "a LabVIEW measurement",
                lambda head: head.removeprefix(b"\xef\xbb\xbf").startswith(b"LabVIEW Measurement"),
            )
        },
        also=("text", "utf16"),
        through="numpy",
    )
}
