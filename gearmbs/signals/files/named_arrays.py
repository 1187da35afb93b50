"""Records of files that hold named arrays, whatever program wrote them: MATLAB, numpy, NetCDF and HDF5."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.signals.errors import SignalError, SignalFileError
from gearmbs.signals.signal.labels import SLOW_ROLES, SLOW_SAID, SUFFIX, rises_evenly, role_of, tells_time
from gearmbs.signals.signal.record import (
    SECONDS,
    RateCandidate,
    Record,
    chosen_rate,
    number_of,
    own_header,
    rate_candidates,
    rate_from_times,
    same_rate,
    speed_of,
)
from gearmbs.signals.signal.signal import UNKNOWN_UNITS, check_teeth


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
    rate, as does a scalar with a name such as fs, sr or XInc (`gearmbs.signals.signal.record`), beside the channel,
    above it or, if there is none, anywhere. With `channels`, only the arrays they name (or whose columns they name)
    count. A rate that the caller has `given` (Hz) decides where the file names two.
    """
    told = {k: units.get(k, UNKNOWN_UNITS) for k in arrays}
    clocks = [k for k, v in arrays.items() if tells_time(k.rsplit(".", 1)[-1], told[k]) and v.size > 1]
    columns: dict[str, np.ndarray] = {}
    column_units: dict[str, str] = {}
    owner: dict[str, str] = {}
    notes: list[str] = []
    abscissa: np.ndarray | None = None
    for key, array in arrays.items():
        if key in clocks or array.size < 2:
            continue
        flat = np.squeeze(array)
        if flat.ndim > 2:
            continue
        table = flat[:, None] if flat.ndim == 1 else (flat if flat.shape[0] >= flat.shape[1] else flat.T)
        names = [key] if table.shape[1] == 1 else [f"{key}_{i + 1}" for i in range(table.shape[1])]
        first = table[:, 0]
        counts_rows = table.shape[1] > 1 and (channels is None or names[0] not in channels) and rises_evenly(first)
        if counts_rows:
            numbered = bool(np.all(np.diff(first) == 1.0))
            abscissa = abscissa if numbered or clocks else first
            said_of = "numbers the rows and is left out" if numbered else "rises evenly; it is taken for the time in s"
            notes.append(f"The first column of {key} {said_of}.")
        for i, name in enumerate(names):
            if (channels is None or name in channels) and not (counts_rows and i == 0):
                columns[name] = table[:, i]
                column_units[name] = units.get(name, units.get(key, UNKNOWN_UNITS))
                owner[name] = key
    if not columns:
        raise SignalFileError(path, f"holds no numeric record{_among(arrays, channels)}")
    slow, said = _slow_ones_stretched(columns, column_units)
    notes += said
    lengths = {name: column.size for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} ({size})" for name, size in lengths.items())
        raise SignalFileError(
            path, f"holds records of different lengths: {listed}; choose with channels=[...] (--channel)"
        )
    rates: dict[str, float | None] = {}
    for name, key in owner.items():
        if name in slow:
            continue
        rates[name], said = chosen_rate(path, rate_candidates(own_header(scalars, key)), given)
        notes += [note for note in said if note not in notes]
    rate = same_rate(path, rates)
    count = next(iter(lengths.values()))
    t0 = 0.0
    times = next((_seconds(k, told[k]) * arrays[k].ravel() for k in clocks if arrays[k].size == count), abscissa)
    times = times if times is None or times.size == count else None
    if times is not None and np.asarray(times).dtype.kind in "fiu":
        t0 = float(times[0])
        rate, said = _rate_beside_times(path, rate, times, given)
        notes += said
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


def _seconds(name: str, unit: str) -> float:
    """Return how many seconds the unit of a column of times is, by its label or at the end of its name."""
    named = SUFFIX.search(name.rsplit(".", 1)[-1])
    low = unit.strip().lower()
    return (
        SECONDS.get(low, 1.0)
        if low not in ("", UNKNOWN_UNITS) or named is None
        else SECONDS.get(named[1].lower(), 60.0)
    )


def _rate_beside_times(
    path: Path, rate: float | None, times: np.ndarray, given: float | None
) -> tuple[float, list[str]]:
    """Return the rate of a file that holds times and perhaps names a rate; where they disagree the given one."""
    try:
        by_times = rate_from_times(times, path)
    except SignalFileError:
        if rate is None:
            raise
        return rate, []
    if rate is None:
        return by_times, []
    both = [RateCandidate("the sampling rate that it names", rate), RateCandidate("its column of times", by_times)]
    chosen, said = chosen_rate(path, both, given)
    return rate if chosen is None else chosen, said


def _slow_ones_stretched(columns: dict[str, np.ndarray], units: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Bring speeds and temperatures of fewer samples to the length of all others in place; which, and what to say."""
    slow = {name for name in columns if role_of(name, units[name]) in SLOW_ROLES}
    sizes = {column.size for name, column in columns.items() if name not in slow}
    if len(sizes) != 1:
        return [], []
    (size,) = sizes
    shorter = [name for name in columns if name in slow and 1 < columns[name].size < size]
    notes = []
    for name in shorter:
        own = np.asarray(columns[name], dtype=float)
        notes.append(SLOW_SAID.format(name=name, size=size))
        columns[name] = np.interp(np.linspace(0.0, 1.0, size), np.linspace(0.0, 1.0, own.size), own)
    return shorter, notes


def _among(arrays: Mapping[str, np.ndarray], channels: Sequence[str] | None) -> str:
    listed = ", ".join(f"{k} {np.shape(v)}" for k, v in arrays.items()) or "nothing numeric"
    return f" named {list(channels)}; it holds {listed}" if channels is not None else f"; it holds {listed}"
