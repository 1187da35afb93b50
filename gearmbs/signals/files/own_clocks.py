"""Columns of a table that have times of their own, beside others: a speed each tenth of a second beside vibration.

The first column of times is that of the columns up to the next one, and so on. Speeds, temperatures and the like are
interpolated to the times of the first columns; vibration at other times is refused by name.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.signal.labels import CLOCK_NAMES, PARTS_OF_TIME, SUFFIX, folded, role_of
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

FACTORS = {
    "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "hr": 3600.0,
    "day": 86400.0, "days": 86400.0,
}  # fmt: skip
"""s of units of times."""
FEWEST = 2
"""Times that a column has at least."""


class Group(NamedTuple):
    """A column of times, and those behind it that it is of."""

    clock: int
    columns: tuple[int, ...]


def own_clocks(names: Sequence[str], units: Sequence[str]) -> tuple[Group, ...]:
    """Return the groups of columns with times of their own behind a first one; empty where there are none.

    Parameters
    ----------
    names, units : sequence of str
        Of all columns.
    """
    at = [i for i, (name, unit) in enumerate(zip(names, units, strict=True)) if _is_time(name, unit)]
    if len(at) < 2 or at[0] != 0:
        return ()
    ends = [*at[1:], len(names)]
    groups = [Group(a, tuple(range(a + 1, b))) for a, b in zip(at, ends, strict=True)]
    # columns of times alone are those of pulses
    return tuple(groups) if all(group.columns for group in groups) else ()


def _is_time(name: str, unit: str) -> bool:
    words = re.split(r"[\W_]+", re.sub(r"\d+", " ", folded(name)).strip())
    low = unit.strip().lower()
    return not CLOCK_NAMES.isdisjoint(words) and (low in ("", UNKNOWN_UNITS) or low in PARTS_OF_TIME)


def _seconds(name: str, unit: str) -> float:
    """Return the s of a unit of times, or of that behind a name's underscore."""
    named = SUFFIX.search(name)
    return FACTORS.get(unit.lower(), FACTORS.get(named.group(1).lower(), 1.0) if named else 1.0)


def on_first_clock(
    path: Path, values: np.ndarray, groups: Sequence[Group], names: Sequence[str], units: Sequence[str]
) -> list[str]:
    """Interpolate columns with times of their own to those of the first, in place.

    Parameters
    ----------
    path : Path
        For messages.
    values : ndarray of shape (n, columns)
        Rows that a slow column does not fill are nan.
    groups : sequence of Group
    names, units : sequence of str

    Returns
    -------
    list of str
        What is to be said.

    Raises
    ------
    SignalFileError
        If times do not rise, or vibration has others than the first.
    """
    first = values[:, groups[0].clock]
    said = []
    for clock, columns in groups[1:]:
        there = np.flatnonzero(np.isfinite(values[:, clock]))
        values[:, clock] *= _seconds(names[clock], units[clock]) / _seconds(
            names[groups[0].clock], units[groups[0].clock]
        )
        times = values[there, clock]
        if times.size == first.size and np.array_equal(times, first):
            continue
        if times.size < FEWEST or np.any(np.diff(times) <= 0.0):
            raise SignalFileError(path, f"{names[clock]!r} holds no times that rise; leave it out of the file")
        named = ", ".join(repr(names[i]) for i in columns)
        other = [names[i] for i in columns if role_of(names[i], units[i]) not in ("speed", "temperature", "share")]
        if other:
            raise SignalFileError(
                path,
                f"{other[0]!r} has times of its own in {names[clock]!r}, {times.size} of {first.size} rows; put "
                f"{named} into a file of their own",
            )
        for i in columns:
            good = there[np.isfinite(values[there, i])]
            if good.size < FEWEST:
                raise SignalFileError(path, f"{names[i]!r} holds nothing beside {names[clock]!r}; leave both out")
            values[:, i] = np.interp(first, values[good, clock], values[good, i])
        said.append(
            f"{named}: {times.size} values at times of their own in {names[clock]!r}, up to {times[-1]:.6g}; between "
            f"them interpolated to the {first.size} of {names[groups[0].clock]!r}."
        )
    return said
