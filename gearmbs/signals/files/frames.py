"""Tables of pandas as records, and Parquet and Feather files through it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.files.table import Content, Format, begins_with
from gearmbs.signals.signal.labels import is_clock, key_of, name_and_unit, tells_time, unique_names
from gearmbs.signals.signal.record import (
    STEP_NAMES,
    Record,
    chosen_rate,
    rate_candidates,
    rate_from_times,
    speed_of,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth

SPEED_WRITTEN = "speed [rad/s]"
"""What a Parquet file calls the shaft's speed."""
CLOCK_UNITS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}


def record_of_frame(frame: pd.DataFrame, path: Path, rate: float | None = None) -> Record:
    """Make a record of a table: numeric columns are channels, a column or index of times gives the rate.

    Parameters
    ----------
    frame : DataFrame
        A column called time (t, timestamp ...; in s or as its unit says) or of time stamps, or an index of time stamps,
        time differences or evenly rising numbers that are not just 0, 1, 2 ..., gives the rate. Units stand in
        brackets behind the names, or in ``frame.attrs["units"]`` by name. ``frame.attrs`` may name the rate.
    path : Path
        Named in errors.
    rate : float, optional
        Known sampling rate in Hz.

    Raises
    ------
    SignalFileError
        If no column is numeric, or the times are not even.
    """
    notes: list[str] = []
    times, clock = _clock(frame, notes)
    names, units, columns, left_out = [], [], [], []
    for label, column in frame.items():
        if clock is not None and label == clock:
            continue
        if column.dtype.kind not in "fiub":
            left_out.append(str(label))
            continue
        name, unit = name_and_unit(" ".join(map(str, label)) if isinstance(label, tuple) else str(label))
        names.append(name)
        units.append(unit)
        columns.append(column.to_numpy(dtype=float, na_value=np.nan))
    if not columns:
        raise SignalFileError(path, f"holds no column of numbers; its columns are {[str(c) for c in frame.columns]}")
    if left_out:
        notes.append(f"Left out, because they hold no numbers: {', '.join(left_out)}.")
    named = frame.attrs.get("units")
    if isinstance(named, dict):
        units = [str(named.get(name, unit)) for name, unit in zip(names, units)]
    elif isinstance(named, str):
        units = [named if unit == UNKNOWN_UNITS else unit for unit in units]
    found, said = chosen_rate(path, rate_candidates(frame.attrs), rate)
    notes += said
    t0 = 0.0
    if times is not None and times.size > 1:
        t0 = float(times[0])
        if found is None:
            found = _rate(times, path, rate)
    speed, said = speed_of(frame.attrs)
    return Record(np.stack(columns, axis=1), unique_names(names), units, found, t0, speed, notes=notes + said)


def read_parquet(path: Path, kind: str, rate: float | None = None) -> Record:
    """Read a Parquet or Feather file (`kind` "parquet" or "feather").

    Raises
    ------
    SignalFileError
        If pyarrow is not installed, or the file is damaged or holds no column of numbers.
    """
    try:
        import pyarrow  # noqa: F401
    except ImportError as exc:
        raise SignalFileError(
            path, f"{kind} files need pyarrow; install it with: pip install 'gearmbs[parquet]'"
        ) from exc
    try:
        frame = pd.read_parquet(path) if kind == "parquet" else pd.read_feather(path)
    except Exception as exc:
        raise SignalFileError(path, f"cannot be read as {kind}: it is damaged or cut short ({exc})") from exc
    record = record_of_frame(frame, path, rate)
    # as `write_parquet` writes them
    speed, teeth, t0 = (frame.attrs.get(key) for key in (SPEED_WRITTEN, "teeth", "t0"))
    if isinstance(speed, int | float):
        record = replace(record, speed=float(speed))
    if isinstance(t0, int | float):
        record = replace(record, t0=float(t0))
    if teeth is None:
        return record
    try:
        return replace(record, teeth=check_teeth(teeth))
    except (TypeError, ValueError) as exc:
        raise SignalFileError(path, f"teeth: {exc}") from exc


def write_parquet(record: Record, path: Path) -> None:
    """Write a Parquet file: a column a channel, its unit in brackets; metadata in the table's attributes."""
    try:
        import pyarrow  # noqa: F401
    except ImportError as exc:
        raise SignalFileError(
            path, "parquet files need pyarrow; install it with: pip install 'gearmbs[parquet]'"
        ) from exc
    frame = pd.DataFrame(
        {f"{n} [{u}]": record.values[:, i] for i, (n, u) in enumerate(zip(record.names, record.units))}
    )
    known = {SPEED_WRITTEN: record.speed, "teeth": None if record.teeth is None else list(record.teeth)}
    frame.attrs = {"sampling_rate": record.rate, "t0": record.t0}
    frame.attrs |= {key: value for key, value in known.items() if value is not None}
    frame.to_parquet(path)


def _clock(frame: pd.DataFrame, notes: list[str]) -> tuple[np.ndarray | None, Any]:
    """Times in s of a table, or None; and the label of the column they stand in."""
    for label, column in frame.items():
        name, unit = name_and_unit(str(label))
        if column.dtype.kind in "mM":
            return _seconds(pd.Index(column)), label
        if tells_time(name, unit) and column.dtype.kind in "fiu" and len(frame.columns) > 1:
            return CLOCK_UNITS.get(unit, 1.0) * column.to_numpy(dtype=float), label
    index = frame.index
    if isinstance(index, (pd.DatetimeIndex, pd.TimedeltaIndex)):
        return _seconds(index), None
    counted = isinstance(index, pd.RangeIndex) or index.dtype.kind not in "fiu" or len(index) < 2
    if counted or key_of(str(index.name))[0] in STEP_NAMES:
        return None, None
    values = index.to_numpy(dtype=float)
    if np.allclose(np.diff(values), 1.0) and not is_clock(str(index.name)):
        return None, None
    if np.all(np.diff(values) > 0.0):
        if not is_clock(str(index.name)):
            notes.append("The table's index rises evenly and is taken for the time in s.")
        return values, None
    return None, None


def _seconds(index: pd.Index) -> np.ndarray:
    if isinstance(index, pd.TimedeltaIndex):
        return np.asarray(index.total_seconds(), dtype=float)
    return np.asarray((pd.DatetimeIndex(index) - index[0]).total_seconds(), dtype=float)


def _rate(times: np.ndarray, path: Path, given: float | None) -> float:
    try:
        return rate_from_times(times, path)
    except SignalFileError:
        span = float(times[-1] - times[0])
        if given is not None and span > 0.0 and np.all(np.diff(times) >= 0.0):
            if abs((times.size - 1) / span / given - 1.0) <= 0.01:
                return given
        raise
    except SignalError as exc:  # pragma: no cover - rate_from_times names the file itself
        raise SignalFileError(path, str(exc)) from exc


FORMATS = {
    "parquet": Format(
        read=lambda path, asked: read_parquet(path, "parquet", asked.rate),
        write=lambda record, path, progress: write_parquet(record, path),
        contents={"parquet": Content("Parquet", begins_with(b"PAR1"))},
        through="pandas, pyarrow (extra `parquet`)",
        keeps_attributes=False,
    ),
    "feather": Format(
        read=lambda path, asked: read_parquet(path, "feather", asked.rate),
        contents={"feather": Content("Feather", begins_with(b"ARROW1", b"FEA1"))},
        through="pandas, pyarrow (extra `parquet`)",
    ),
}
