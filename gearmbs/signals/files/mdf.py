"""Files of loggers in the MDF format of ASAM (.mf4, .mdf) through asammdf, which is imported when one is read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.files.own_clocks import checked_same, interpolated, leading
from gearmbs.signals.files.table import Content, Format, begins_with
from gearmbs.signals.signal.record import Record, rate_from_times
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

UNEVEN = 0.01
"""Share by which a given rate may be off the mean of uneven times."""
TIME = 1
"""Kind of a master channel of times; others are angles and distances."""


class _Channel(NamedTuple):
    name: str
    group: int
    unit: str
    times: np.ndarray
    values: np.ndarray


def read_mdf(path: Path, channels: Sequence[str] | None, rate: float | None = None) -> Record:
    """Read the channels of an MDF file that share a time base; slower speeds and temperatures are interpolated to it.

    Parameters
    ----------
    path : Path
    channels : sequence of str, optional
        Only these; channels of equal names in several groups are called name/group.
    rate : float, optional
        Hz; stands in for times that a logger did not take evenly.

    Raises
    ------
    SignalFileError
        If asammdf is not installed, no channel holds numbers over time, or those that do have several rates.
    """
    found = _numeric(path)
    kept = [c for c in found if channels is None or c.name in channels]
    if not kept:
        raise SignalFileError(
            path, f"holds no samples over time; it holds {', '.join(c.name for c in found) or 'none'}"
        )
    names, in_units = [c.name for c in kept], [c.unit for c in kept]
    fast = [kept[i] for i in leading(names, in_units, [c.times.size for c in kept])]
    base = max(fast, key=lambda c: c.times.size).times
    if any(not np.array_equal(c.times, base) for c in fast):
        checked_same(path, {c.name: c.times for c in fast})
        listed = ", ".join(f"{c.name} ({c.times.size} samples)" for c in fast)
        raise SignalFileError(
            path, f"holds records at different times: {listed}; choose with channels=[...] (--channel)"
        )
    rate, said = _rate(path, base, rate)
    columns = []
    for c in kept:
        if np.array_equal(c.times, base):
            columns.append(c.values)
            continue
        there = np.isfinite(c.values)
        column, words = interpolated(path, c.name, base, c.times[there], c.values[there])
        columns.append(column)
        said = [*said, words]
    return Record(
        np.stack(columns, axis=1),
        names,
        in_units,
        rate,
        float(base[0]),
        notes=said,
    )


def _rate(path: Path, times: np.ndarray, given: float | None) -> tuple[float, list[str]]:
    """Return the rate of even times; of uneven ones that which is given, if it is their mean rate, with a remark."""
    try:
        return rate_from_times(times, path), []
    except SignalFileError:
        mean = (times.size - 1) / float(times[-1] - times[0])
        if given is None:
            raise
        if abs(given / mean - 1.0) > UNEVEN:
            raise SignalFileError(
                path, f"its times, which are not even, have a mean rate of {mean:g} Hz, the call says rate={given:g}"
            ) from None
        steps = np.diff(times)
        return given, [
            f"CHECK THE RATE: the times are not even, steps of {steps.min():.4g} to {steps.max():.4g} s; samples are "
            f"taken as even at the given {given:g} Hz. Steps of twice the usual one are lost samples: resample then."
        ]


def _numeric(path: Path) -> list[_Channel]:
    """Return all channels with numbers over time; what a logger marked as invalid is NaN."""
    found = []
    with _library(path).MDF(path) as file:
        for group, entry in enumerate(file.groups):
            master = file.masters_db.get(group)
            if master is not None and getattr(entry.channels[master], "sync_type", TIME) not in (0, TIME):
                continue
            for index in range(len(entry.channels)):
                if index == master:
                    continue
                got = file.get(group=group, index=index)
                if got.samples.ndim != 1 or got.samples.dtype.kind not in "fiub" or got.samples.size < 2:
                    continue
                values = got.samples.astype(float)
                if got.invalidation_bits is not None:
                    values[np.asarray(got.invalidation_bits, dtype=bool)] = np.nan
                found.append(_Channel(got.name, group, str(got.unit or UNKNOWN_UNITS), got.timestamps, values))
    names = [c.name for c in found]
    return [c if names.count(c.name) == 1 else c._replace(name=f"{c.name}/{c.group}") for c in found]


def _library(path: Path) -> Any:
    try:
        import asammdf
    except ImportError as exc:
        raise SignalFileError(path, "MDF files need asammdf; install it with: pip install 'gearmbs[mdf]'") from exc
    return asammdf


FORMATS = {
    "mdf": Format(
        read=lambda path, asked: read_mdf(path, asked.channels, asked.rate),
        contents={"mdf": Content("an MDF file", begins_with(b"MDF     ", b"UnFinMF "))},
        through="asammdf (extra `mdf`)",
    )
}
