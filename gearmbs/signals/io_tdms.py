"""TDMS of National Instruments, through npTDMS."""

from __future__ import annotations

import json
import logging
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .errors import SignalFileError
from .record import Record, plain
from .signal import UNKNOWN_UNITS, check_teeth

GROUP = "signal"
BLOCK = 1 << 17
LEAD_IN = 28
INCOMPLETE = 0xFFFFFFFFFFFFFFFF


def read_tdms(path: Path, channels: Sequence[str] | None) -> Record:
    """Read the channels of a TDMS file; waveform properties give rate, start and units.

    Raises
    ------
    SignalFileError
        If npTDMS is not installed, a segment is cut short, or the channels' lengths or rates differ.
    """
    return next(_read(path, channels, None))[0]


def tdms_pieces(path: Path, channels: Sequence[str] | None) -> Iterator[tuple[Record, float]]:
    """Read the channels of a TDMS file block by block; see `read_tdms`."""
    return _read(path, channels, BLOCK)


def _read(path: Path, channels: Sequence[str] | None, block: int | None) -> Iterator[tuple[Record, float]]:
    nptdms = _library(path)
    _check_segments(path)
    try:
        with nptdms.TdmsFile.open(path) as file:
            kept = _chosen(path, file, channels)
            count = len(kept[0])
            for start in range(0, count, block or count):
                stop = min(start + (block or count), count)
                values = np.stack([np.asarray(c[start:stop], dtype=float) for c in kept], axis=1)
                yield _record(path, values, kept, dict(file.properties)), stop / count
    except SignalFileError:
        raise
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as TDMS ({exc})") from exc


def _chosen(path: Path, file: Any, channels: Sequence[str] | None) -> list[Any]:
    """The channels that become the record's; SignalFileError if they do not make one."""
    found = [c for group in file.groups() for c in group.channels() if len(c) and np.issubdtype(c.dtype, np.number)]
    kept = [c for c in found if channels is None or c.name in channels]
    if not kept:
        raise SignalFileError(path, f"holds no samples{'' if channels is None else f' in {list(channels)}'}")
    if len({c.name for c in kept}) != len(kept):
        raise SignalFileError(path, "has channels of the same name in different groups; rename them")
    if len({len(c) for c in kept}) > 1:
        listed = ", ".join(f"{c.name} ({len(c)})" for c in kept)
        raise SignalFileError(path, f"holds records of different lengths: {listed}; choose with channels=[...]")
    return kept


def _record(path: Path, values: np.ndarray, kept: Sequence[Any], root: dict) -> Record:
    rates = {_rate(c.properties, root) for c in kept}
    if len(rates) > 1:
        raise SignalFileError(path, f"its channels have different sampling rates {rates}; choose with channels=[...]")
    teeth = root.get("teeth")
    return Record(
        values,
        [c.name for c in kept],
        [str(c.properties.get("unit_string") or UNKNOWN_UNITS) for c in kept],
        rates.pop(),
        float(kept[0].properties.get("wf_start_offset", 0.0)),
        float(root["speed"]) if "speed" in root else None,
        None if teeth is None else check_teeth(json.loads(teeth)),
        json.loads(root.get("attrs", "{}")),
    )


def write_tdms(record: Record, path: Path) -> None:
    """Write one group with one channel per signal channel."""
    nptdms = _library(path)
    root: dict[str, Any] = {"sampling_rate": record.rate, "attrs": json.dumps(plain(record.attrs))}
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


def _rate(properties: dict, root: dict) -> float | None:
    if "sampling_rate" in root:
        return float(root["sampling_rate"])
    step = properties.get("wf_increment")
    return 1.0 / float(step) if step else None


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
    logging.getLogger("nptdms").setLevel(logging.ERROR)
    return nptdms
