"""TDMS of National Instruments, through npTDMS."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .errors import SignalFileError
from .record import Record, plain
from .signal import UNKNOWN_UNITS, check_teeth

GROUP = "signal"
LEAD_IN = 28
INCOMPLETE = 0xFFFFFFFFFFFFFFFF


def read_tdms(path: Path, channels: Sequence[str] | None) -> Record:
    """Read the channels of a TDMS file; waveform properties give rate, start and units.

    Raises
    ------
    SignalFileError
        If npTDMS is not installed, a segment is cut short, or the channels' lengths or rates differ.
    """
    nptdms = _library(path)
    _check_segments(path)
    try:
        file = nptdms.TdmsFile.read(path)
        found = [c for group in file.groups() for c in group.channels() if len(c) and np.issubdtype(c.dtype, np.number)]
        columns = {c.name: np.asarray(c[:], dtype=float) for c in found if channels is None or c.name in channels}
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as TDMS ({exc})") from exc
    if not columns:
        raise SignalFileError(path, f"holds no samples{'' if channels is None else f' in {list(channels)}'}")
    kept = [c for c in found if c.name in columns]
    if len(kept) != len(columns):
        raise SignalFileError(path, "has channels of the same name in different groups; rename them")
    if len({len(c) for c in kept}) > 1:
        listed = ", ".join(f"{c.name} ({len(c)})" for c in kept)
        raise SignalFileError(path, f"holds records of different lengths: {listed}; choose with channels=[...]")
    root = dict(file.properties)
    rates = {_rate(c.properties, root) for c in kept}
    if len(rates) > 1:
        raise SignalFileError(path, f"its channels have different sampling rates {rates}; choose with channels=[...]")
    teeth = root.get("teeth")
    return Record(
        np.stack(list(columns.values()), axis=1),
        list(columns),
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
    return nptdms
