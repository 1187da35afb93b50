"""Files of LabVIEW: texts with a header and one more for every segment (.lvm), and TDMS through npTDMS."""

from __future__ import annotations

import json
import logging
import math
import struct
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.files import json_value
from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.encodings import decoded
from gearmbs.signals.files.own_clocks import checked_same
from gearmbs.signals.files.table import Content, Format, begins_with
from gearmbs.signals.signal.labels import SLOW_ROLES, SLOW_SAID, role_of, tells_time
from gearmbs.signals.signal.record import (
    RateCandidate,
    Record,
    chosen_rate,
    rate_by_times,
    rate_candidates,
    same_rate,
    same_start,
    speed_of,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth
from gearmbs.signals.signal.times import in_seconds

END = "***End_of_Header***"
SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
GROUP = "signal"
BLOCK = 1 << 17
LEAD_IN = 28
INCOMPLETE = 0xFFFFFFFFFFFFFFFF
OF_FREQUENCY = ("hz", "khz", "rpm")
"""Units of the abscissa of what is no record over time."""


def read_lvm(path: Path, rate: float | None = None, channels: Sequence[str] | None = None) -> Record:
    """Read all segments of a LabVIEW measurement file, or their `channels`, one behind the other.

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
    parts = [
        _segment(path, lines, starts, i, ends[0], separator, decimal, head, rate, channels) for i in range(len(starts))
    ]
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
    channels: Sequence[str] | None,
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
            times.append([float(cells[i].replace(decimal, ".")) if cells[i].strip() else math.nan for i in x_columns])
        except (ValueError, IndexError):
            raise SignalFileError(
                path, f"line {number} does not hold {len(kept)} numbers: {line.strip()[:60]!r}"
            ) from None
        rows.append(values)
    if not rows or not kept:
        raise SignalFileError(path, f"its segment {index + 1} holds no samples")
    names = [labels[i] for i in kept]
    chosen = [k for k, name in enumerate(names) if channels is None or name in channels] or list(range(len(names)))
    # where each channel has a column of times, empty cells stand for these
    steps, offsets = (
        dict(zip(names, [_number(text, decimal) for text in head.get(key, []) if text])) for key in ("Delta_X", "X0")
    )
    rates = {names[k]: 1.0 / step if (step := steps.get(names[k])) else None for k in chosen}
    rate = same_rate(path, rates)
    begins = {names[k]: start for k in chosen if (start := offsets.get(names[k])) is not None}
    same_start(path, begins, rate)
    t0 = next(iter(begins.values()), 0.0)
    clocks = np.asarray(times)
    if rate is None and x_columns and len(rows) > 1 and np.isfinite(clocks).all():
        own = {names[k]: clocks[:, max(0, bisect_right(x_columns, kept[k]) - 1)] for k in chosen}
        checked_same(path, own)
        first = next(iter(own.values()))
        rate = rate_by_times(first, path, given)
        t0 = t0 if begins else float(first[0])
    labelled = head.get("Y_Unit_Label", [])
    filled = [unit for unit in labelled if unit]
    units = filled if len(filled) == len(names) else [unit or UNKNOWN_UNITS for unit in labelled]
    units = [units[k] if k < len(units) else UNKNOWN_UNITS for k in chosen]
    return Record(np.asarray(rows)[:, chosen], [names[k] for k in chosen], units, rate, t0)


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


# TDMS.


def read_tdms(path: Path, channels: Sequence[str] | None, rate: float | None = None) -> Record:
    """Read the channels of a TDMS file; waveform properties give rate, start and units.

    Raises
    ------
    SignalFileError
        If npTDMS is not installed, a segment is cut short, or the channels' lengths or rates differ.
    """
    return next(_read(path, channels, None, rate))[0]


def tdms_pieces(
    path: Path, channels: Sequence[str] | None, rate: float | None = None
) -> Iterator[tuple[Record, float]]:
    """Read the channels of a TDMS file block by block; see `read_tdms`."""
    return _read(path, channels, BLOCK, rate)


def _read(
    path: Path, channels: Sequence[str] | None, block: int | None, rate: float | None
) -> Iterator[tuple[Record, float]]:
    nptdms = _library(path)
    _check_segments(path)
    try:
        with open(path, "rb") as raw, nptdms.TdmsFile.open(raw) as file:
            kept, names = _chosen(path, file, channels)
            own = "attrs" in file.properties and "sampling_rate" in file.properties
            found = {} if own else {name: _own_times(file, c) for name, c in zip(names, kept, strict=True)}
            clocks = {name: times for name, times in found.items() if times is not None}
            count = max(len(c) for c in kept)
            for start in range(0, count, block or count):
                stop = min(start + (block or count), count)
                values = np.stack([_stretch(c, start, stop, count) for c in kept], axis=1)
                yield _record(path, values, kept, names, file, rate, clocks), stop / count
    except SignalFileError:
        raise
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as TDMS ({exc})") from exc


def _chosen(path: Path, file: Any, channels: Sequence[str] | None) -> tuple[list[Any], list[str]]:
    """The channels that become the record's and their names; SignalFileError if they do not make one.

    Channels of equal names in different groups are called group/channel.
    """
    found = [
        (group.name, c)
        for group in file.groups()
        for c in group.channels()
        if len(c) and np.issubdtype(c.dtype, np.number) and not np.issubdtype(c.dtype, np.complexfloating)
        if str(c.properties.get("wf_xunit_string", "")).strip().lower() not in OF_FREQUENCY
    ]
    plain_names = [c.name for _, c in found]
    names = [c.name if plain_names.count(c.name) == 1 else f"{group}/{c.name}" for group, c in found]
    kept = [
        (name, c)
        for name, (group, c) in zip(names, found)
        if channels is None or name in channels or f"{group}/{c.name}" in channels
    ]
    if not kept:
        listed = f"; it holds {', '.join(names) or 'none'}"
        raise SignalFileError(
            path, f"holds no samples over time{'' if channels is None else f' in {list(channels)}'}{listed}"
        )
    kept = [(name, c) for name, c in kept if name in (channels or ()) or not _holds_times(c)] or kept
    longest = max(len(c) for _, c in kept)
    if any(len(c) < longest and not _is_slow(c) for _, c in kept):
        listed = ", ".join(f"{name} ({len(c)})" for name, c in kept)
        raise SignalFileError(
            path, f"holds records of different lengths: {listed}; choose with channels=[...] (--channel)"
        )
    wanted = {f"{group}/{c.name}" for group, c in found} & set(channels or ())
    return [c for _, c in kept], [
        f"{c.group_name}/{c.name}" if f"{c.group_name}/{c.name}" in wanted else name for name, c in kept
    ]


def _unit_of(channel: Any) -> str:
    """Return the unit of a channel, under either name that LabVIEW writes."""
    told = (str(channel.properties.get(name) or "").strip() for name in ("unit_string", "NI_UnitDescription"))
    return next(filter(None, told), UNKNOWN_UNITS)


def _holds_times(channel: Any) -> bool:
    """Return whether a channel holds the times of the others of its group."""
    return channel.dtype.kind == "M" or tells_time(channel.name, _unit_of(channel))


def _own_times(file: Any, channel: Any) -> np.ndarray | None:
    """Return the times (s) that a channel of the same group and length holds, or None."""
    group = file[channel.group_name].channels()
    clock = next((c for c in group if len(c) == len(channel) > 1 and c is not channel and _holds_times(c)), None)
    if clock is None or clock.dtype.kind not in "Mfiu" or _holds_times(channel):
        return None
    return in_seconds(np.asarray(clock[:]), _unit_of(clock), clock.name)


def _is_slow(channel: Any) -> bool:
    """Return whether a channel may have fewer samples than those it stands beside."""
    return role_of(channel.name, _unit_of(channel)) in SLOW_ROLES


def _start_of(channel: Any) -> float:
    """Return when a channel begins, s: its own time and what it is offset by."""
    stamp = channel.properties.get("wf_start_time")
    begin = 0.0 if stamp is None else float(np.datetime64(stamp, "us").astype("int64")) * 1e-6
    return begin + float(channel.properties.get("wf_start_offset", 0.0))


def _stretch(channel: Any, start: int, stop: int, count: int) -> np.ndarray:
    """Return samples of a channel, those of a slow one interpolated."""
    if len(channel) == count:
        return np.asarray(channel[start:stop], dtype=float)
    own = np.asarray(channel[:], dtype=float)
    return np.interp(np.arange(start, stop) / (count - 1), np.linspace(0.0, 1.0, own.size), own)


def _record(
    path: Path,
    values: np.ndarray,
    kept: Sequence[Any],
    names: list[str],
    file: Any,
    given: float | None,
    clocks: dict[str, np.ndarray],
) -> Record:
    root = dict(file.properties)
    notes: list[str] = []
    rates: dict[str, float | None] = {}
    speed = float(root["speed"]) if isinstance(root.get("speed"), (int, float)) else None
    longest = max(len(c) for c in kept)
    slow = [name for name, c in zip(names, kept, strict=True) if len(c) < longest]
    starts = {
        name: _start_of(channel)
        for name, channel in zip(names, kept, strict=True)
        if name not in slow and "wf_increment" in channel.properties
    }
    notes += [SLOW_SAID.format(name=name, size=longest) for name in slow]
    for name, channel in zip(names, kept):
        if name in slow:
            continue
        rates[name], said = _rate(path, file, channel, root, given)
        if name in clocks:
            known = rates[name]
            by_times = rate_by_times(clocks[name], path, given, others=known is not None)
            own = [] if known is None else [RateCandidate(f"the rate of {name}", known)]
            own += [] if by_times is None else [RateCandidate("its channel of times", by_times)]
            rates[name], more = chosen_rate(path, own, given)
            said = [*said, *more]
        notes += [note for note in said if note not in notes]
    rate = same_rate(path, rates)
    begins = {name: float(clocks[name][0]) for name in names if name in clocks and name not in slow}
    for begin in (starts, begins):
        same_start(path, begin, rate)
    if speed is None:
        speed, said = speed_of({**root, **dict(file[kept[0].group_name].properties)})
        notes += said
    teeth = root.get("teeth")
    return Record(
        values,
        list(names),
        [_unit_of(c) for c in kept],
        rate,
        float(kept[0].properties.get("wf_start_offset", begins.get(names[0], 0.0))),
        speed,
        None if teeth is None else check_teeth(json.loads(str(teeth))),
        json.loads(root.get("attrs", "{}")),
        notes,
    )


def _rate(path: Path, file: Any, channel: Any, root: dict, given: float | None) -> tuple[float | None, list[str]]:
    """Rate of a channel: this package's own, the waveform's, or what the properties of channel, group or file name."""
    if "attrs" in root and "sampling_rate" in root:
        return float(root["sampling_rate"]), []
    for properties in (channel.properties, file[channel.group_name].properties, root):
        found, notes = chosen_rate(path, rate_candidates(dict(properties)), given)
        if found is not None:
            return found, notes
    return None, []


def write_tdms(record: Record, path: Path) -> None:
    """Write one group with one channel per signal channel."""
    nptdms = _library(path)
    root: dict[str, Any] = {"sampling_rate": record.rate, "attrs": json.dumps(json_value(record.attrs))}
    if record.speed is not None:
        root["speed"] = record.speed
    if record.teeth is not None:
        root["teeth"] = json.dumps(record.teeth)
    objects: list[Any] = [nptdms.RootObject(properties=root)]
    for name, unit, column in zip(record.names, record.units, record.values.T):
        properties = {
            "unit_string": unit,
            "wf_increment": 1.0 / float(record.rate or 1.0),
            "wf_start_offset": record.t0,
            "wf_samples": column.size,
        }
        objects.append(nptdms.ChannelObject(GROUP, name, np.ascontiguousarray(column), properties=properties))
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(objects)


def _check_segments(path: Path) -> None:
    total = path.stat().st_size
    at = 0
    with open(path, "rb") as file:
        while at < total:
            file.seek(at)
            lead = file.read(LEAD_IN)
            if len(lead) < LEAD_IN or lead[:4] != b"TDSm":
                raise SignalFileError(path, f"is damaged: no segment begins at byte {at}")
            big = bool(struct.unpack("<I", lead[4:8])[0] & 0x40)
            length = struct.unpack(">Q" if big else "<Q", lead[12:20])[0]
            if length == INCOMPLETE or at + LEAD_IN + length > total:
                raise SignalFileError(path, f"is cut short: its segment at byte {at} was not written to the end")
            at += LEAD_IN + length


def _library(path: Path) -> Any:
    try:
        import nptdms
    except ImportError as exc:
        raise SignalFileError(path, "TDMS files need npTDMS; install it with: pip install 'gearmbs[formats]'") from exc
    # it prints the bytes of damaged texts, pages of them; what is wrong is said by the errors here
    for name in list(logging.root.manager.loggerDict):
        if name.partition(".")[0] == "nptdms":
            logging.getLogger(name).setLevel(logging.CRITICAL)
    return nptdms


FORMATS = {
    "lvm": Format(
        read=lambda path, asked: read_lvm(path, asked.rate, asked.channels),
        contents={
            "lvm": Content(
                "a LabVIEW measurement",
                lambda head: head.removeprefix(b"\xef\xbb\xbf").startswith(b"LabVIEW Measurement"),
            )
        },
        also=("text", "utf16"),
        through="numpy",
    ),
    "tdms": Format(
        read=lambda path, asked: read_tdms(path, asked.channels, asked.rate),
        write=lambda record, path, progress: write_tdms(record, path),
        pieces=lambda path, asked: tdms_pieces(path, asked.channels, asked.rate),
        contents={"tdms": Content("a TDMS file", begins_with(b"TDSm"))},
        through="npTDMS (extra `formats`)",
    ),
}
