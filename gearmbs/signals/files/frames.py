"""Tables of pandas as records, and Parquet and Feather files through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.own_clocks import on_one_clock, own_clocks
from gearmbs.signals.files.table import Content, Format, begins_with
from gearmbs.signals.signal.labels import key_of, name_and_unit, tells_time, unique_names
from gearmbs.signals.signal.record import (
    STEP_NAMES,
    RateCandidate,
    Record,
    chosen_rate,
    rate_by_times,
    rate_candidates,
    speed_of,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth
from gearmbs.signals.signal.times import in_seconds, seconds_of

SPEED_WRITTEN = "speed [rad/s]"
"""What a Parquet file calls the shaft's speed."""


def record_of_frame(
    frame: pd.DataFrame,
    path: Path,
    rate: float | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
) -> Record:
    """Make a record of a table: numeric columns are channels, a column or index of times gives the rate.

    Parameters
    ----------
    frame : DataFrame
        A column called time (t, timestamp ...; in s or as its unit says) or of time stamps, or an index of time stamps,
        time differences or evenly rising numbers that are not just 0, 1, 2 ..., gives the rate. Units stand in
        brackets behind the names, or in ``frame.attrs["units"]`` by name. ``frame.attrs`` may name the rate. Of several
        columns of times each is that of those behind it (`gearmbs.signals.files.own_clocks`).
    path : Path
        Named in errors.
    rate : float, optional
        Known sampling rate in Hz.
    channels : sequence of str, optional
        Those asked for, where columns have times of their own.
    gaps : str, optional
        What to do with gaps in these; see `read_signal`.

    Raises
    ------
    SignalFileError
        If no column is numeric, the times are not even, or vibration has several.
    """
    notes: list[str] = []
    labels = [name_and_unit(_text(label)) for label in frame.columns]
    of, in_units = [name for name, _ in labels], [unit for _, unit in labels]
    groups = own_clocks(of, in_units) if all(column.kind in "fiu" for column in frame.dtypes) else ()
    times: np.ndarray | None
    if groups:
        values = frame.to_numpy(dtype=float, na_value=np.nan)
        one = on_one_clock(path, values, groups, of, in_units, channels, gaps)
        kept = [i for i in range(len(labels)) if i != one.clock and i not in one.left_out]
        frame, attrs = frame.iloc[: one.times.size, kept], frame.attrs
        frame = pd.DataFrame(one.values[:, kept], columns=frame.columns)
        frame.attrs, times, clock = attrs, one.times, None
        notes += one.said
    else:
        times, clock = _clock(frame, notes)
    names, units, columns, left_out = [], [], [], []
    for label, column in frame.items():
        if clock is not None and label == clock:
            continue
        if column.dtype.kind not in "fiub":
            left_out.append(str(label))
            continue
        name, unit = name_and_unit(_text(label))
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
    candidates = rate_candidates(frame.attrs)
    t0 = 0.0
    if times is not None and times.size > 1:
        t0 = float(times[0])
        by_times = rate_by_times(times, path, rate, others=bool(candidates))
        candidates += [] if by_times is None else [RateCandidate("the column of times", by_times)]
    found, said = chosen_rate(path, candidates, rate)
    notes += said
    speed, said = speed_of(frame.attrs)
    return Record(np.stack(columns, axis=1), unique_names(names), units, found, t0, speed, notes=notes + said)


def read_parquet(
    path: Path, kind: str, rate: float | None = None, channels: Sequence[str] | None = None, gaps: str | None = None
) -> Record:
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
    record = record_of_frame(frame, path, rate, channels, gaps)
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


def _text(label: Any) -> str:
    return " ".join(map(str, label)) if isinstance(label, tuple) else str(label)


def _clock(frame: pd.DataFrame, notes: list[str]) -> tuple[np.ndarray | None, Any]:
    """Times in s of a table, or None; and the label of the column they stand in."""
    for label, column in frame.items():
        name, unit = name_and_unit(str(label))
        if column.dtype.kind in "mM":
            return _seconds(pd.Index(column)), label
        if tells_time(name, unit) and column.dtype.kind in "fiu" and len(frame.columns) > 1:
            return in_seconds(column.to_numpy(), unit, name), label
    index = frame.index
    if isinstance(index, (pd.DatetimeIndex, pd.TimedeltaIndex)):
        return _seconds(index), None
    counted = isinstance(index, pd.RangeIndex) or index.dtype.kind not in "fiu" or len(index) < 2
    if counted or key_of(str(index.name))[0] in STEP_NAMES:
        return None, None
    name, unit = name_and_unit(str(index.name))
    told = tells_time(name, unit) or (unit != UNKNOWN_UNITS and seconds_of(unit) is not None)
    values = index.to_numpy(dtype=float)
    if np.allclose(np.diff(values), 1.0) and not told:
        return None, None
    if np.all(np.diff(values) > 0.0):
        values = in_seconds(index.to_numpy(), unit if told else "", name if told else "")
        if not told:
            notes.append("The table's index rises evenly and is taken for the time in s.")
        return values, None
    return None, None


def _seconds(index: pd.Index) -> np.ndarray:
    if isinstance(index, pd.TimedeltaIndex):
        return np.asarray(index.total_seconds(), dtype=float)
    return np.asarray((pd.DatetimeIndex(index) - index[0]).total_seconds(), dtype=float)


FORMATS = {
    "parquet": Format(
        read=lambda path, asked: read_parquet(path, "parquet", asked.rate, asked.channels, asked.gaps),
        write=lambda record, path, progress: write_parquet(record, path),
        contents={"parquet": Content("Parquet", begins_with(b"PAR1"))},
        through="pandas, pyarrow (extra `parquet`)",
        keeps_attributes=False,
    ),
    "feather": Format(
        read=lambda path, asked: read_parquet(path, "feather", asked.rate, asked.channels, asked.gaps),
        contents={"feather": Content("Feather", begins_with(b"ARROW1", b"FEA1"))},
        through="pandas, pyarrow (extra `parquet`)",
    ),
}
