"""What a file says about a signal, before it becomes one: the meeting point of all readers and writers."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .errors import MissingMetadataError, SignalError, SignalFileError
from .gaps import without_gaps
from .labels import is_clock
from .metadata import chosen_rate, number_of, own_header, rate_candidates, same_rate, speed_of
from .signal import UNKNOWN_UNITS, check_teeth, make_signal, rate_of, uniform_rate, units_of

Progress = Callable[[float, str], None]
RESERVED_ATTRS = ("sampling_rate", "speed", "teeth", "units")


@dataclass
class Record:
    """Samples and metadata read from a file.

    Attributes
    ----------
    values : ndarray of shape (n, channels)
    names : list of str
    units : list of str
        One per channel, "unknown" where the file is silent.
    rate : float or None
        Sampling rate in Hz.
    t0 : float
        Time of the first sample in s.
    speed : float or None
        rad/s.
    teeth : tuple of int or None
    attrs : dict
        Anything else, JSON-like.
    notes : list of str
        What a reader should know: choices made, things left out.
    """

    values: np.ndarray
    names: list[str]
    units: list[str]
    rate: float | None = None
    t0: float = 0.0
    speed: float | None = None
    teeth: tuple[int, ...] | None = None
    attrs: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def record_of(signal: xr.DataArray) -> Record:
    """The record that a writer puts into a file."""
    teeth = signal.attrs.get("teeth")
    return Record(
        values=np.asarray(signal.values, dtype=float),
        names=[str(c) for c in signal["channel"].values],
        units=units_of(signal),
        rate=rate_of(signal),
        t0=float(signal["time"].values[0]),
        speed=None if signal.attrs.get("speed") is None else float(signal.attrs["speed"]),
        teeth=None if teeth is None else check_teeth(teeth),
        attrs={k: v for k, v in signal.attrs.items() if k not in RESERVED_ATTRS},
    )


def signal_from(
    record: Record,
    path: Path,
    *,
    rate: float | None,
    units: str | Sequence[str] | Mapping[str, str] | None,
    speed: float | None,
    teeth: int | Sequence[int] | None,
    channels: Sequence[str] | None,
    gaps: str | None = None,
) -> xr.DataArray:
    """Join what the file and the caller say into a signal; errors name the file."""
    if channels is not None:
        missing = [c for c in channels if c not in record.names]
        if missing:
            raise SignalFileError(path, f"has no channel {missing}; it holds {record.names}")
        pick = [record.names.index(c) for c in channels]
        record.values = record.values[:, pick]
        record.names = [record.names[i] for i in pick]
        record.units = [record.units[i] for i in pick]
    if rate is not None and record.rate is not None and abs(rate - record.rate) > 1e-3 * record.rate:
        raise SignalFileError(
            path,
            f"says its sampling rate is {record.rate:g} Hz, the call says rate={rate:g}; leave rate out, or relabel "
            "the samples with make_signal(signal.values, rate) if the file is wrong",
        )
    found = record.rate if record.rate is not None else rate
    if found is None:
        raise MissingMetadataError("rate", str(path), "the file does not hold it; pass rate=... in Hz")
    if record.speed is not None and speed is not None:
        record.notes = [note for note in record.notes if not note.startswith("The speed, ")]
    try:
        values, first, said = without_gaps(record.values, gaps, found)
        notes = [*record.notes, *said]
        return make_signal(
            values,
            found,
            units=_units_said(units, record),
            channels=record.names,
            t0=record.t0 + first / found,
            speed=record.speed if speed is None else speed,
            teeth=record.teeth if teeth is None else teeth,
            attrs={**record.attrs, "source": path.name, **({"notes": notes} if notes else {})},
        )
    except MissingMetadataError:
        raise
    except SignalError as exc:
        raise SignalFileError(path, str(exc)) from exc


def _units_said(units: str | Sequence[str] | Mapping[str, str] | None, record: Record) -> Any:
    """Return the units of the channels: of a mapping its own, of the other channels the file's."""
    known = dict(zip(record.names, record.units))
    return known | dict(units) if isinstance(units, Mapping) else record.units if units is None else units


def metadata_json(record: Record) -> str:
    """Everything but the samples, as one line of JSON."""
    return json.dumps(
        {
            "sampling_rate": record.rate,
            "t0": record.t0,
            "channels": record.names,
            "units": record.units,
            "speed": record.speed,
            "teeth": record.teeth,
            "attrs": plain(record.attrs),
        }
    )


def record_from_json(values: np.ndarray, text: str, path: Path) -> Record:
    """Inverse of `metadata_json`; SignalFileError if the text does not fit the samples."""
    try:
        meta = json.loads(text)
        names, units = [str(c) for c in meta["channels"]], [str(u) for u in meta["units"]]
        record = Record(
            values,
            names,
            units,
            float(meta["sampling_rate"]),
            float(meta["t0"]),
            meta["speed"],
            None if meta["teeth"] is None else check_teeth(meta["teeth"]),
            dict(meta["attrs"]),
        )
    except (ValueError, KeyError, TypeError) as exc:
        raise SignalFileError(path, f"its metadata cannot be read ({exc})") from exc
    if len(names) != values.shape[1] or len(units) != len(names):
        raise SignalFileError(path, f"its metadata names {len(names)} channels, its samples have {values.shape[1]}")
    return record


def plain(value: Any) -> Any:
    """Attributes as JSON knows them; what it does not know becomes text."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, (str, int, float, bool)):
        return value
    return str(value)


def assemble(
    path: Path,
    arrays: Mapping[str, np.ndarray],
    scalars: Mapping[str, Any],
    units: Mapping[str, str],
    channels: Sequence[str] | None,
    given: float | None = None,
) -> Record:
    """Make a record of the named arrays of a file that is not laid out by this package.

    The arrays of the common length become channels, matrices one channel per column; an array called time gives the
    rate, as does a scalar with a name such as fs, sr or XInc (`gearmbs.signals.metadata`), beside the channel, above it
    or, if there is none, anywhere. With `channels`, only the arrays they name (or whose columns they name) count. A
    rate that the caller has `given` (Hz) decides where the file names two.
    """
    clocks = [k for k, v in arrays.items() if is_clock(k.rsplit(".", 1)[-1]) and v.size > 1]
    columns: dict[str, np.ndarray] = {}
    column_units: dict[str, str] = {}
    owner: dict[str, str] = {}
    for key, array in arrays.items():
        if key in clocks or array.size < 2:
            continue
        flat = np.squeeze(array)
        if flat.ndim > 2:
            continue
        table = flat[:, None] if flat.ndim == 1 else (flat if flat.shape[0] >= flat.shape[1] else flat.T)
        names = [key] if table.shape[1] == 1 else [f"{key}_{i + 1}" for i in range(table.shape[1])]
        for i, name in enumerate(names):
            if channels is None or name in channels:
                columns[name] = table[:, i]
                column_units[name] = units.get(key, UNKNOWN_UNITS)
                owner[name] = key
    lengths = {name: column.size for name, column in columns.items()}
    if not columns:
        raise SignalFileError(path, f"holds no numeric record{_among(arrays, channels)}")
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} ({size})" for name, size in lengths.items())
        raise SignalFileError(
            path, f"holds records of different lengths: {listed}; choose with channels=[...] (--channel)"
        )
    notes: list[str] = []
    rates: dict[str, float | None] = {}
    for name, key in owner.items():
        rates[name], said = chosen_rate(path, rate_candidates(own_header(scalars, key)), given)
        notes += [note for note in said if note not in notes]
    rate = same_rate(path, rates)
    count = next(iter(lengths.values()))
    t0 = 0.0
    times = next((arrays[k].ravel() for k in clocks if arrays[k].size == count), None)
    if times is not None and np.asarray(times).dtype.kind in "fiu":
        t0 = float(times[0])
        if rate is None:
            rate = rate_from_times(times, path)
    known = {k: v for k, v in scalars.items() if not isinstance(v, (list, dict))}
    speed, said = speed_of(known)
    own = number_of(scalars.get("speed"))
    if speed is None and own is not None and not own[1]:
        speed = own[0]
    counts = scalars.get("teeth")
    if isinstance(counts, str):
        counts = None if number_of(counts) is None else number_of(counts)[0]  # type: ignore[index]
    try:
        checked = None if counts is None else check_teeth(counts)
    except (SignalError, TypeError, ValueError):
        checked = None
        notes.append(f"teeth = {counts!r} in the file is no tooth count and left out.")
    return Record(
        np.stack([np.asarray(c, dtype=float) for c in columns.values()], axis=1),
        list(columns),
        [column_units[name] for name in columns],
        rate,
        t0,
        speed,
        checked,
        notes=notes + said,
    )


def rate_from_times(times: np.ndarray, path: Path) -> float:
    """Sampling rate in Hz of the times in a file; the error names the file."""
    try:
        return uniform_rate(np.asarray(times, dtype=float))
    except SignalError as exc:
        raise SignalFileError(path, str(exc)) from exc


def _among(arrays: Mapping[str, np.ndarray], channels: Sequence[str] | None) -> str:
    listed = ", ".join(f"{k} {np.shape(v)}" for k, v in arrays.items()) or "nothing numeric"
    return f" named {list(channels)}; it holds {listed}" if channels is not None else f"; it holds {listed}"
