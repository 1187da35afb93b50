"""Files of LabVIEW: texts with a header and one more for every segment (.lvm), and TDMS through npTDMS."""

from __future__ import annotations

import json
import logging
import math
import struct
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gearmbs.files import json_value
from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.encodings import decoded
from gearmbs.signals.files.own_clocks import SLOW_SAID, checked_same, interpolated, leading, same_length, times_by_count
from gearmbs.signals.files.table import Content, Format, begins_with
from gearmbs.signals.signal.labels import name_and_unit, tells_time
from gearmbs.signals.signal.record import (
    SAME_START,
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
            chosen = _chosen(path, file, channels)
            record, slower = _without_samples(path, file, chosen, rate)
            fast = next(i for i in range(len(chosen)) if i not in slower)
            count = len(chosen[fast].channel)
            for start in range(0, count, block or count):
                at = np.arange(start, min(start + (block or count), count))
                columns = [
                    np.interp(at, *slower[i]) if i in slower else np.asarray(c.channel[at[0] : at[-1] + 1], dtype=float)
                    for i, c in enumerate(chosen)
                ]
                yield replace(record, values=np.stack(columns, axis=1)), (at[-1] + 1) / count
    except SignalFileError:
        raise
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as TDMS ({exc})") from exc


class _Channel(NamedTuple):
    """A channel of a TDMS file, with the name and unit that it has here."""

    channel: Any
    name: str
    unit: str


def _chosen(path: Path, file: Any, channels: Sequence[str] | None) -> list[_Channel]:
    """Return the channels that become the record's; SignalFileError if there are none.

    Channels of equal names in different groups are called group/channel. A unit at the end of a name, as in "a [g]", is
    that of the channel if no property names one; asked for by its whole name, a channel keeps that.
    """
    groups = [
        (group.name, c)
        for group in file.groups()
        for c in group.channels()
        if len(c) and np.issubdtype(c.dtype, np.number) and not np.issubdtype(c.dtype, np.complexfloating)
        if str(c.properties.get("wf_xunit_string", "")).strip().lower() not in OF_FREQUENCY
    ]
    told = [_name_and_unit(c)[0] for _, c in groups]
    bare = [name if told.count(name) == 1 else c.name for name, (_, c) in zip(told, groups, strict=True)]
    found = []
    for name, (group, c) in zip(bare, groups, strict=True):
        whole = f"{group}/{c.name}"
        named = name if bare.count(name) == 1 else whole
        asked = next((n for n in (named, c.name, whole) if n in (channels or ())), None)
        if asked == c.name and sum(c.name == other.name for _, other in groups) > 1:
            asked = None
        found.append((asked, _Channel(c, asked or named, _name_and_unit(c)[1])))
    kept = [c for asked, c in found if channels is None or asked is not None]
    if not kept:
        listed = f"; it holds {', '.join(c.name for _, c in found) or 'none'}"
        raise SignalFileError(
            path, f"holds no samples over time{'' if channels is None else f' in {list(channels)}'}{listed}"
        )
    return [c for c in kept if c.name in (channels or ()) or not _holds_times(c.channel)] or kept


def _name_and_unit(channel: Any) -> tuple[str, str]:
    """Return the name of a channel and its unit, under either name that LabVIEW writes, or at the end of its name."""
    told = (str(channel.properties.get(name) or "").strip() for name in ("unit_string", "NI_UnitDescription"))
    unit = next(filter(None, told), None)
    return name_and_unit(channel.name) if unit is None else (channel.name, unit)


def _holds_times(channel: Any) -> bool:
    """Return whether a channel holds the times of the others of its group."""
    return channel.dtype.kind == "M" or tells_time(*_name_and_unit(channel))


def _clock_of(file: Any, channel: Any) -> Any:
    """Return the channel of the same group and length that holds the times of one, or None."""
    group = file[channel.group_name].channels()
    clock = next((c for c in group if len(c) == len(channel) > 1 and c is not channel and _holds_times(c)), None)
    return None if clock is None or clock.dtype.kind not in "Mfiu" or _holds_times(channel) else clock


def _times_of(clock: Any, first: Any = None) -> np.ndarray:
    """Return the times (s) that a channel holds: stamps from the first of another such channel on, if there is one."""
    name, unit = _name_and_unit(clock)
    values = np.asarray(clock[:])
    if values.dtype.kind != "M":
        return in_seconds(values, unit, name)
    begin = values[0] if first is None or first.dtype.kind != "M" else np.asarray(first[:1])[0]
    return in_seconds(values - begin)


def _begin(channel: Any, other: Any) -> float:
    """Return when a channel begins, s: what it is offset by, and its time from that of another if both have one."""
    stamps = [each.properties.get("wf_start_time") for each in (channel, other)]
    first, second = (None if stamp is None else np.datetime64(stamp, "us").astype("int64") for stamp in stamps)
    apart = 0.0 if first is None or second is None else float(first - second)
    return 1e-6 * apart + float(channel.properties.get("wf_start_offset", 0.0))


Slower = dict[int, tuple[np.ndarray, np.ndarray]]
"""By the place of a slower channel where its samples stand among those of the others, and the samples."""


def _without_samples(path: Path, file: Any, chosen: Sequence[_Channel], given: float | None) -> tuple[Record, Slower]:
    """Return what a file says of its channels, and the samples of those of other times than the vibration's.

    Raises
    ------
    SignalFileError
        If vibration has several rates, starts or lengths.
    """
    root = dict(file.properties)
    own = "attrs" in root and "sampling_rate" in root
    names, sizes = [c.name for c in chosen], [len(c.channel) for c in chosen]
    fast = leading(names, [c.unit for c in chosen], sizes)
    clocks = {} if own else {c.name: clock for c in chosen if (clock := _clock_of(file, c.channel)) is not None}
    notes: list[str] = []
    rates: dict[str, float | None] = {}
    times: dict[str, np.ndarray] = {}
    for channel, name, _ in (chosen[i] for i in fast):
        rates[name], said = _rate(path, file, channel, root, given)
        if name in clocks:
            times[name] = _times_of(clocks[name])
            known = rates[name]
            by_times = rate_by_times(times[name], path, given, others=known is not None)
            both = [] if known is None else [RateCandidate(f"the rate of {name}", known)]
            both += [] if by_times is None else [RateCandidate("its channel of times", by_times)]
            rates[name], more = chosen_rate(path, both, given)
            said = [*said, *more]
        notes += [note for note in said if note not in notes]
    same_length(path, {names[i]: sizes[i] for i in fast}, rates)
    rate, base = same_rate(path, rates), chosen[fast[0]]
    stepped = [chosen[i] for i in fast if "wf_increment" in chosen[i].channel.properties]
    for begins in (
        {c.name: _begin(c.channel, base.channel) for c in stepped},
        {name: float(own[0]) for name, own in times.items()},
    ):
        same_start(path, begins, rate)
    offset = float(base.channel.properties.get("wf_start_offset", 0.0))
    start = float(times[base.name][0]) if base.name in times else offset
    slower: Slower = {}
    for i in (i for i in range(len(chosen)) if i not in fast):
        found = _slower(path, file, chosen[i], base, clocks, given if rate is None else rate, start, sizes[fast[0]])
        if found is not None:
            slower[i], words = found
            notes.append(words)
    speed = float(root["speed"]) if isinstance(root.get("speed"), (int, float)) else None
    if speed is None:
        speed, said = speed_of({**root, **dict(file[chosen[0].channel.group_name].properties)})
        notes += said
    teeth = root.get("teeth")
    return Record(
        np.empty((0, len(chosen))),
        names,
        [c.unit for c in chosen],
        rate,
        offset if "wf_start_offset" in base.channel.properties else start,
        speed,
        None if teeth is None else check_teeth(json.loads(str(teeth))),
        json.loads(root.get("attrs", "{}")),
        notes,
    ), slower


def _slower(
    path: Path,
    file: Any,
    chosen: _Channel,
    base: _Channel,
    clocks: Mapping[str, Any],
    rate: float | None,
    start: float,
    count: int,
) -> tuple[tuple[np.ndarray, np.ndarray], str] | None:
    """Return where the samples of a channel of other times stand among those of the others, and what to say of it.

    None of one that has the times of the others (`count` of them, at a `rate` in Hz from `start`, s).
    """
    channel, name, _ = chosen
    size, times = len(channel), None
    if rate is not None and name in clocks:
        times = _times_of(clocks[name], clocks.get(base.name))
    elif rate is not None and (own := _own_rate(path, file, channel, base.channel)) is not None:
        times = _begin(channel, base.channel) + np.arange(size) / own
    if times is None or rate is None:
        if size == count:
            return None
        at, how = times_by_count(size, count)
        return (at, np.asarray(channel[:], dtype=float)), SLOW_SAID.format(name=name, size=count, how=how)
    at = (times - start) * rate
    if size == count and np.abs(at[[0, -1]] - [0.0, count - 1.0]).max() < SAME_START:
        return None
    values = np.asarray(channel[:], dtype=float)
    # the ends of the others say whether it is known there
    _, words = interpolated(path, name, start + np.array([0.0, count - 1.0]) / rate, times, values)
    return (at, values), words


def _own_rate(path: Path, file: Any, channel: Any, base: Any) -> float | None:
    """Return the rate that a channel itself names, or its group, if this is not that of the others."""
    named = [channel.properties]
    if channel.group_name != base.group_name:
        named.append(file[channel.group_name].properties)
    found = (chosen_rate(path, rate_candidates(dict(properties)))[0] for properties in named)
    return next((rate for rate in found if rate is not None), None)


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
