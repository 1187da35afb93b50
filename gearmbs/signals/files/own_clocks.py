"""Channels with times of their own, in tables and among arrays: a speed each tenth of a second beside vibration.

Speeds, temperatures and percents are interpolated to the times of the others. Vibration at other times, whether of
another rate or from another start, is refused by name; chosen alone it is read with its own.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gearmbs.signals.errors import SignalFileError
from gearmbs.signals.signal.labels import SPEED_COLUMN, key_of, may_be_slow, may_be_times
from gearmbs.signals.signal.record import REMEDY, checked_gaps, mean_rate, same_rate, same_start
from gearmbs.signals.signal.times import in_seconds
from gearmbs.signals.signal.words import words_of

FEWEST = 2
"""Times that a column has at least."""
SLOW_SAID = "{name} has fewer samples than the {size} of the others ({how}); between them it is interpolated."
COVERED = 0.5
"""Share of the record over which a slow channel must be known."""
CONSTANT = 2e-3
"""Range of a speed, by its mean, within which it is constant where it is known, as far as displays tell."""
COARSE = 6e-3
"""s: second difference of a speed by its mean, times the step, from which straight lines between samples are told. The
angle goes wrong by a twelfth of it times the speed: at 1500 rpm by 0.0125 turns, 0.3 rad of a mesh of 23 teeth."""
NUMBERS_ROWS = frozenset(("", "index", "idx", "nr", "no", "row", "sample", "unnamed"))


class Group(NamedTuple):
    """A column of times, and those that it is of."""

    clock: int
    columns: tuple[int, ...]


def own_clocks(names: Sequence[str], units: Sequence[str]) -> tuple[Group, ...]:
    """Return the groups of columns with times of their own; empty where there are not several.

    Each column of times is that of the columns behind it up to the next one; where the last column is one and the first
    is none, of those before it.

    Parameters
    ----------
    names, units : sequence of str
        Of all columns.
    """
    at = [i for i, (name, unit) in enumerate(zip(names, units, strict=True)) if may_be_times(name, unit)]
    first = next((i for i, name in enumerate(names) if "".join(words_of(name)) not in NUMBERS_ROWS), 0)
    if len(at) < 2 or (at[0] != first and at[-1] != len(names) - 1):
        return ()
    if at[0] == first:
        groups = [Group(a, tuple(range(a + 1, b))) for a, b in zip(at, [*at[1:], len(names)], strict=True)]
    else:
        groups = [Group(b, tuple(range(a + 1, b))) for a, b in zip([first - 1, *at[:-1]], at, strict=True)]
    # columns of times alone are those of pulses
    return tuple(groups) if all(group.columns for group in groups) else ()


class OneClock(NamedTuple):
    """The rows of a table at the times of one of its columns.

    Attributes
    ----------
    values : ndarray of shape (n, columns)
    times : ndarray of shape (n,)
        s.
    clock : int
        Column of these times.
    left_out : tuple of int
        Columns that are of no use here.
    said : list of str
    """

    values: np.ndarray
    times: np.ndarray
    clock: int
    left_out: tuple[int, ...]
    said: list[str]


def on_one_clock(
    path: Path,
    values: np.ndarray,
    groups: Sequence[Group],
    names: Sequence[str],
    units: Sequence[str],
    channels: Collection[str] | None = None,
    gaps: str | None = None,
) -> OneClock:
    """Bring the columns of a table, or those of the channels asked for, to the times of one of its columns.

    Parameters
    ----------
    path : Path
        For messages.
    values : ndarray of shape (n, columns)
        Rows that a shorter group does not fill are nan.
    groups : sequence of Group
    names, units : sequence of str
    channels : collection of str, optional
    gaps : str, optional
        What to do with gaps; see `read_signal`.

    Raises
    ------
    SignalFileError
        If times do not rise, or vibration has several rates, starts or lengths.
    """
    asked = [Group(g.clock, tuple(i for i in g.columns if channels is None or names[i] in channels)) for g in groups]
    kept = [group for group in asked if group.columns] or list(groups)
    vibration = {g: [i for i in g.columns if not may_be_slow(names[i], units[i])] for g in kept}
    fast = [group for group in kept if vibration[group]] or kept[:1]
    base = fast[0]
    times: dict[Group, np.ndarray] = {}
    for group in [base, *kept]:
        same = units[group.clock] == units[base.clock]
        times[group] = _times(path, values, group, names, units, values[0, base.clock] if same else None)
    checked_same(path, {names[i]: times[group] for group in fast for i in vibration[group] or group.columns})
    count = times[base].size
    out, said = values[:count].copy(), []
    for group in kept:
        own = times[group]
        whole = own.size == count and np.array_equal(own, times[base])
        for i in group.columns:
            column = values[: own.size, i]
            there = np.isfinite(column)
            if whole or (group in fast and i in vibration[group]):
                if checked_gaps(gaps) == "refuse" and not there.all() and i in vibration[group]:
                    row = int(np.argmin(there)) + 1
                    raise SignalFileError(path, f"row {row} holds nothing in column {names[i]!r}; {REMEDY}")
                continue
            out[:, i], words = interpolated(path, names[i], times[base], own[there], column[there])
            said.append(words)
    used = {i for group in kept for i in group.columns} | {base.clock}
    grouped = {i for group in groups for i in (group.clock, *group.columns)}
    return OneClock(out, times[base], base.clock, tuple(sorted(grouped - used)), said)


def _times(
    path: Path, values: np.ndarray, group: Group, names: Sequence[str], units: Sequence[str], origin: float | None
) -> np.ndarray:
    """Return the times of a group in s, as far as its rows go."""
    column = values[:, group.clock]
    there = np.flatnonzero(np.isfinite(column))
    name = names[group.clock]
    if there.size < FEWEST or there[-1] != there.size - 1 or np.any(np.diff(column[: there.size]) < 0.0):
        raise SignalFileError(path, f"{name!r} holds no times that rise; mend it, or leave its columns out of the file")
    return in_seconds(column[: there.size], units[group.clock], name, origin)


def checked_same(path: Path, times: Mapping[str, np.ndarray]) -> None:
    """Refuse channels whose own times (s, by channel) differ in rate, start or number."""
    rates: dict[str, float | None] = {name: mean_rate(own) for name, own in times.items()}
    rate = same_rate(path, rates)
    same_start(path, {name: float(own[0]) for name, own in times.items()}, rate)
    same_length(path, {name: own.size for name, own in times.items()})


def same_length(path: Path, sizes: Mapping[str, int], rates: Mapping[str, float | None] | None = None) -> None:
    """Refuse channels of different lengths, by their rates (Hz) where these differ."""
    if len(set(sizes.values())) > 1:
        same_rate(path, rates or {})
        listed = ", ".join(f"{name} ({size})" for name, size in sizes.items())
        raise SignalFileError(
            path, f"holds records of different lengths: {listed}; choose with channels=[...] (--channel)"
        )


def leading(names: Sequence[str], units: Sequence[str], sizes: Sequence[int]) -> list[int]:
    """Return the places of the channels to whose times the others are brought: vibration, or else the longest ones."""
    slow = [may_be_slow(name, unit) for name, unit in zip(names, units, strict=True)]
    return [i for i, size in enumerate(sizes) if not slow[i] or (all(slow) and size == max(sizes))]


def times_by_count(size: int, count: int) -> tuple[np.ndarray, str]:
    """Return where the samples of a slower channel stand among those of the others, and in words how it is known.

    Each is the first of as many of the others as go into one; where none fit, the first and the last are taken to be
    those of the others.
    """
    if count % size == 0:
        return np.arange(size) * float(count // size), f"its samples are those of each {count // size} of the others"
    return np.linspace(0.0, count - 1.0, size), "its first and last sample are taken to be those of the others"


def interpolated(
    path: Path, name: str, base: np.ndarray, times: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, str]:
    """Return a slow channel at the times of the others, or at the ends of these, and what is said of it; its ends hold.

    Parameters
    ----------
    path : Path
    name : str
    base, times : ndarray
        Times of the others and its own, s.
    values : ndarray
        Its own.

    Raises
    ------
    SignalFileError
        If less than half of the record is covered by its own times.
    """
    if times.size < FEWEST:
        raise SignalFileError(path, f"{name!r} holds less than {FEWEST} values beside its times; leave it out")
    span = f"{times[0]:.6g} to {times[-1]:.6g} s"
    step = float(np.median(np.diff(times)))
    held = max(times[0] - base[0], base[-1] - times[-1])
    if min(times[-1] + step, base[-1]) - max(times[0] - step, base[0]) < COVERED * (base[-1] - base[0]):
        raise SignalFileError(
            path,
            f"{name!r} is known from {span}, the others go from {base[0]:.6g} to {base[-1]:.6g} s; cut the record, or "
            "choose with channels=[...] (--channel) without it",
        )
    ends = f"; it is known from {span} only, its ends hold" if held > 2.0 * step else ""
    words = f"{name} has times of its own, {times.size} of them; between them it is interpolated{ends}."
    if SPEED_COLUMN.search(key_of(name)[0]):
        words += _of_a_speed(name, times, values, span if ends else None)
    return np.interp(base, times, values), words


def _of_a_speed(name: str, times: np.ndarray, values: np.ndarray, span: str | None) -> str:
    """Return what a speed's own times do to lines that are followed by it; nothing where they do nothing."""
    mean = float(np.mean(np.abs(values)))
    if not mean > 0.0:
        return ""
    said = []
    if span is not None and float(np.ptp(values)) > CONSTANT * mean:
        said.append(f"what is held beyond {span} was not measured")
    bend = np.abs(np.diff(values, 2)) / mean * (0.5 * (times[2:] - times[:-2]))
    if bend.max(initial=0.0) > COARSE:
        said.append(f"samples are up to {np.diff(times).max():.3g} s apart, between which it bends")
    if not said:
        return ""
    return (
        f" CHECK THE SPEED: of {name!r} {' and '.join(said)}; lines, orders and averages that are followed by it lose "
        "a part. Cut the record to what is known, or use a tacho."
    )
