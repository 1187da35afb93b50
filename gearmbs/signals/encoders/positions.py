"""Positions of shafts sampled over time, as counters and converters of encoders give them, as trains of pulses.

A position sampled at even times says when each mark passed as well as pulses do, between two samples: of a count to
half of it, of an angle by a spline. So many marks are taken as the samples of a turn can tell.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.interpolate

from gearmbs.signals.encoders.pulses import PulseTrain, pulse_train
from gearmbs.signals.errors import MissingMetadataError, SignalError, SignalFileError

TURN_IN: dict[str, float] = {
    **dict.fromkeys(("deg", "°", "degree", "degrees", "grad"), 360.0),
    **dict.fromkeys(("rad", "radian", "radians"), 2.0 * math.pi),
    **dict.fromkeys(("rev", "revs", "revolution", "revolutions", "turn", "turns", "u", "umdr"), 1.0),
}
"""A turn in units of angles."""
COUNTS = frozenset({"ticks", "tick", "counts", "count"})
FALL = 0.5
"""Part of its period by which a position falls where it begins anew; less is noise of the last digit."""
MOST_LINES = 4096
"""Marks taken of an angle, of which nothing tells how many it has."""
FEWEST_SAMPLES = 8.0
"""Samples of a turn below which nothing can be told of it."""


class Positions(NamedTuple):
    """Positions of a shaft, in turns or counts, over even times (s)."""

    times: np.ndarray
    values: np.ndarray
    turn: float | None
    """A turn in their unit; None of counts."""


def positions_of(
    path: Path, name: str, column: np.ndarray, unit: str, rate: float | None, begin: float, clocked: bool
) -> Positions | None:
    """Return the positions that a column of a file holds, or None if it holds something else.

    Parameters
    ----------
    path, name, column, unit
        File, column, its values and unit.
    rate : float or None
        Hz, where the file has even times or the caller says it.
    begin : float
        Time of the first sample, s.
    clocked : bool
        Whether columns of counts are told to count a clock.

    Raises
    ------
    MissingMetadataError
        If angles have no times.
    """
    key = unit.strip().lower()
    turn = TURN_IN.get(key)
    whole = column.size > 1 and bool(np.array_equal(column, np.rint(column)))
    counts = not clocked and rate is not None and (key in COUNTS or (key in ("", "unknown", "1") and whole))
    if turn is None and not counts:
        return None
    if rate is None:
        raise MissingMetadataError(
            "rate",
            f"the angle {name!r} [{unit}] in {path.name}",
            "add a column of times, or pass rate='20 kHz' (--rate) of its samples; columns of pulses hold times, s",
        )
    if turn is None and np.mean(np.diff(column) != 0.0) == 0.0:
        raise SignalFileError(path, f"{name!r} holds one position throughout; the shaft stands still")
    return Positions(begin + np.arange(column.size) / rate, column, turn)


def train_of_positions(found: Positions, lines: int | None, name: str, known: dict[str, Any]) -> PulseTrain:
    """Return when marks passed, as a train of pulses.

    Parameters
    ----------
    found : Positions
    lines : int or None
        Counts of a turn; of angles the marks wanted, by default as many as the samples tell.
    name : str
    known : dict
        Further arguments of `pulse_train`.

    Raises
    ------
    SignalError
        If the shaft turns back, or there are too few samples a turn.
    MissingMetadataError
        If it is not known how many counts a turn has.
    """
    if found.turn is None and lines is None:
        raise MissingMetadataError("lines", f"the counts of {name!r}", f"pass lines={{{name!r}: ...}}, those of a turn")
    period = found.turn if found.turn is not None else float(lines or 1)
    if found.turn is None:
        top = float(np.ptp(found.values)) + 1.0
        period = period if top <= period else next((2.0**b for b in (16, 24, 32) if top <= 2.0**b), top)
    steps = np.diff(found.values)
    wraps = bool(np.any(np.abs(steps) > FALL * period))
    values = np.unwrap(found.values, period=period) if wraps else found.values
    values = values if values[-1] > values[0] else -values
    turns = values / (found.turn if found.turn is not None else float(lines or 1))
    total = float(turns[-1] - turns[0])
    each = (turns.size - 1) / total if total > 0.0 else 0.0
    if each < FEWEST_SAMPLES:
        raise SignalError(
            f"{name!r} has {each:.3g} samples a turn, of which at least {FEWEST_SAMPLES:g} are needed; sample faster, "
            "or check its unit and its lines"
        )
    marks = _marks(lines, each, found.turn is None)
    place = marks * turns
    # a count stands for what lies between it and the next one
    place = place + (0.5 * marks / float(lines or 1) if found.turn is None else 0.0)
    back = float(np.max(np.maximum.accumulate(place) - place))
    if back > max(1.0, 2.0 * marks / float(lines or marks)):
        raise SignalError(
            f"{name!r} turns back by {back / marks * 360.0:.3g} deg; cut the record where the shaft turns one way"
        )
    numbers = np.arange(math.floor(place[0]) + 1, math.ceil(place[-1]))
    times = _crossed(found.times, place, numbers)
    settings = {"faults": "keep", **known, "name": name}
    index = times[numbers % marks == 0] if wraps and period == found.turn else None
    if index is not None and index.size:
        index = index - 0.25 * float(np.median(np.diff(times)))
    train = pulse_train(times, marks, index=index if index is not None and index.size else None, **settings)
    kind = "counts" if found.turn is None else "angles"
    return replace(
        train,
        notes=[
            *train.notes,
            f"{name}: {kind} over time, {each:.4g} samples a turn: taken as the times at which {marks} marks pass"
            + (
                f", each known to {0.29 / float(lines or 1) * 360.0:.2g} deg (RMS of a count)."
                if lines and found.turn is None
                else "."
            ),
        ],
    )


def _marks(lines: int | None, each: float, counts: bool) -> int:
    """Return how many marks to take: all that are told, or a part of them that the samples of a turn tell."""
    if lines is None:
        return int(min(MOST_LINES, 2 ** math.floor(math.log2(each))))
    parts = [lines // d for d in range(1, lines + 1) if lines % d == 0 and lines // d <= each]
    if not parts or parts[0] < 0.25 * min(each, lines):
        # of a count that hardly has parts
        return lines if counts else int(2 ** math.floor(math.log2(min(each, lines))))
    return parts[0]


def _crossed(times: np.ndarray, place: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return when a position, in marks, passes whole numbers: between samples by a spline, of steps by lines."""
    if np.all(np.diff(place) > 0.0) and not np.all(np.isclose(np.diff(place) % 0.5, 0.0)):
        found = scipy.interpolate.CubicSpline(place, times)(numbers)
        if np.all(np.diff(found) > 0.0):
            return found
    rising = np.maximum.accumulate(place)
    after = np.clip(np.searchsorted(rising, numbers, side="left"), 1, rising.size - 1)
    before = after - 1
    part = (numbers - rising[before]) / (rising[after] - rising[before])
    return times[before] + part * (times[after] - times[before])
