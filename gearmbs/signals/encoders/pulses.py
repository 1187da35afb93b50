"""Trains of pulses, one for each mark that passes a reading head: numbered, mended, and as angle of the shaft.

Pulse n of an encoder with L lines tells when its shaft stands at 2 pi n/L + e[n mod L], e being the errors of the
marks. `docs/theory/angle_measurement.md` derives what can be known of the shaft from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from gearmbs.signals.encoders.turns import counted_turns, turns_between
from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.phase import PulseFault, described, mended_count, pulse_edges, pulse_faults
from gearmbs.signals.rotation.recurring import doubtful_turns, sudden_jump
from gearmbs.signals.signal.arguments import DataKeywords, takes_data

TURN = 2.0 * math.pi
FEWEST_TURNS = 2
"""Turns of a shaft that a train of pulses must cover: less, and nothing of it recurs."""
SAME_MARK = 0.5
"""Share of the turns in which a mark must be missing to be one that the disc lacks, which numbers the others."""
OVERFLOW = 0.5
"""Share of the span of times by which each fall is more than disorder: a counter falls by nearly all of it."""
FEWEST_GAPS, ALIKE = 3, 0.8
"""Distances of missing pulses, and the share of them that is the same, from which these are no chance."""
FEWEST_EVEN = 8
"""Marks of a disc from which an interval of a whole number of the others is a gap: few marks are set as one likes."""
GAP, OTHERS = 0.15, 0.25
"""Pitches by which a gap may be off a whole number of the others, and each of these off their median."""
INDEX_REACH = 1.0
"""Pitches within which a pulse must follow an index pulse to be that of mark 0."""


MANY_MENDED, MENDED_SHARE = 4, 0.003
"""Pulses, and their share, that are mended by intervals alone from which the count is doubted: of 60 marks off by a
fifth of the pitch, 0.5 % of the pulses lost, 8 of 20 records were miscounted."""
ENOUGH = 0.5
"""Share of the pulses that must be at marks where index pulses count them."""


@dataclass(frozen=True, eq=False)
class PulseTrain:
    """Pulses of an encoder or a tacho, numbered.

    Attributes
    ----------
    times : ndarray of shape (n,)
        When they came, s, increasing.
    numbers : ndarray of int, shape (n,)
        Which they are: the mark is the number modulo `lines`. Missing pulses have numbers, but no times.
    lines : int
        Marks of a turn, those that the disc lacks included.
    referenced : bool
        Whether mark 0 is the same in each record: known from index pulses, or the one that the disc lacks.
    name : str
    tooth_at_zero : tuple of float, optional
        Tooth of the shaft's wheel that is in mesh as mark 0 passes, and the step of the numbers, 1 or -1.
    notes : list of str
        What was mended.
    """

    times: np.ndarray
    numbers: np.ndarray
    lines: int
    referenced: bool = False
    name: str = "encoder"
    tooth_at_zero: tuple[float, float] | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def turns(self) -> float:
        """Turns of the shaft from the first pulse to the last."""
        return float(self.numbers[-1] - self.numbers[0]) / self.lines

    @property
    def mean_speed(self) -> float:
        """Mean speed, rad/s."""
        return TURN * self.turns / float(self.times[-1] - self.times[0])

    def every(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return numbers without holes, the times, and whether each was measured.

        A missing pulse lies between its neighbours on a straight line.
        """
        numbers = np.arange(self.numbers[0], self.numbers[-1] + 1)
        return numbers, np.interp(numbers, self.numbers, self.times), np.isin(numbers, self.numbers)


FEWEST_SAMPLES, ENOUGH_SAMPLES = 4.0, 10.0
"""Samples a pulse below which pulses are refused, and remarked on: of 1000 a second at 2500 Hz lines are 60 % off, at
5000 Hz 20 %."""
SQUARE = 0.3
"""Share of the swing to either side of the threshold in which edges have a sample each, unless they are steep."""
ALONE = 1.5
"""Times an interval a turn away from which one at an end is a gap."""


class TrainKeywords(TypedDict, total=False):
    """Keywords of `pulse_train` but for its index pulses, for type checkers."""

    name: str
    faults: Literal["mend", "refuse", "keep"]
    tooth_at_zero: Sequence[float] | None


class OfChannelKeywords(TrainKeywords, DataKeywords, total=False):
    """The same of pulses in data of any shape."""


def pulse_train(
    times: ArrayLike,
    lines: int,
    *,
    index: ArrayLike | None = None,
    name: str = "encoder",
    faults: Literal["mend", "refuse", "keep"] = "mend",
    tooth_at_zero: Sequence[float] | None = None,
) -> PulseTrain:
    """Number the pulses of an encoder, a tacho or reflecting marks.

    Missing and extra pulses are told from the intervals beside them and mended (`gearmbs.signals.rotation.phase`), with
    index pulses turn by turn against the turns that are whole (`gearmbs.signals.encoders.turns`). Without them a count
    that intervals leave unsure has a remark, CHECK THE COUNT. A mark that is missing in every turn is one that the disc
    lacks: it is mark 0 unless index pulses say which is.

    Parameters
    ----------
    times : array_like of shape (n,)
        Times of the rising edges, s.
    lines : int
        Marks of a turn.
    index : array_like, optional
        Times of a pulse once a turn: the next pulse of the train is that of mark 0.
    name : str
        Of the encoder, for messages.
    faults : {"mend", "refuse", "keep"}
        What to do about missing and extra pulses.
    tooth_at_zero : (number, step), optional
        Tooth in mesh as mark 0 passes, and 1 or -1 where the next one has the next lower number.

    Raises
    ------
    SignalError
        If times do not increase, pulses are too few, or something is out of range.
    """
    try:
        at = np.asarray(times, dtype=float)
    except (TypeError, ValueError):
        raise SignalError(f"times: those of {name!r} must be numbers, s, got {str(times)[:60]}") from None
    if isinstance(lines, bool) or int(lines) != lines or lines < 1:
        raise SignalError(f"lines: must be a whole number of marks a turn, got {lines!r} for {name!r}")
    if faults not in ("mend", "refuse", "keep"):
        raise SignalError(f"faults: must be 'mend', 'refuse' or 'keep', got {faults!r}")
    if not np.isfinite(at).all():
        raise SignalError(
            f"times: that of pulse {int(np.argmax(~np.isfinite(at)))} of {name!r} is no finite number; leave out what "
            "is none, pulses that are missing are found by the intervals beside them"
        )
    if at.ndim != 1 or np.any(np.diff(at) <= 0.0):
        steps = np.diff(at) if at.ndim == 1 and at.size > 1 else np.zeros(1)
        back = int(np.argmax(steps <= 0.0))
        falls = -steps[steps < 0.0]
        hint = (
            f" (they fall by {falls.max():.6g} s, {falls.size} times: a counter that overflows? Add its period from "
            "there on, as np.unwrap(counts, period=2**16) does, or let read_pulses(..., clock=...) do so)"
            if falls.size and falls.min() > OVERFLOW * (at.max() - at.min())
            else ""
        )
        raise SignalError(
            f"times: those of {name!r} must increase, but do not behind pulse {back}{hint}; give the times of rising "
            "edges in s, in the order they came, of a shaft that turns one way"
        )
    if at.size < FEWEST_TURNS * lines:
        raise SignalError(
            f"times: {name!r} has {at.size} pulses, less than {FEWEST_TURNS} turns of {lines} lines; record longer, or "
            "check the lines"
        )
    at, lost = (at, []) if faults == "keep" else _ends_with_others(at, int(lines), name)
    if lost and faults == "refuse":
        raise SignalError(f"faults: {' '.join(lost)} Mend them with faults='mend', or take them with faults='keep'")
    once = None if index is None else np.asarray(index, dtype=float)
    found: list[PulseFault] = []
    by_turns = None if once is None or faults == "keep" else counted_turns(at, int(lines), once)
    if by_turns is not None:
        kept, counted = by_turns.kept, by_turns.numbers
        words = _said_of_turns(at, kept, counted, by_turns.unread, name)
    else:
        found = [] if faults == "keep" else pulse_faults(at, float(lines))
        words = [f"{name}: {text}" for text in described(at, found)]
        kept, counted = mended_count(at.size, found)
    if words and faults == "refuse":
        raise SignalError(f"faults: {' '.join(words)} Mend them with faults='mend', or take them with faults='keep'")
    train = PulseTrain(at[kept], counted.astype(np.int64), int(lines), name=name)
    if faults != "keep":
        _check_gaps(train)
    train, words = _referenced(train, once, lost + words, by_turns is not None)
    if by_turns is None and faults != "keep":
        words = [*words, *_doubts(train, found)]
    if tooth_at_zero is not None:
        number, step = tooth_at_zero
        train = replace(train, tooth_at_zero=(float(number), math.copysign(1.0, step)))
    return replace(train, notes=words)


def _ends_with_others(at: np.ndarray, lines: int, name: str) -> tuple[np.ndarray, list[str]]:
    """Return times without a first and a last pulse that stand far from the others, and what is to be said of it.

    An interval at an end has one neighbour. It is compared with those a turn from it, as of uneven marks.
    """
    said = []
    for end, way in (("first", 1), ("last", -1)):
        intervals = np.diff(at)[::way]
        turn = float(intervals[max(1, lines - 1) : lines + 2].max(initial=0.0)) or math.inf
        if intervals.size and intervals[0] > ALONE * turn:
            said.append(
                f"{name}: the {end} pulse is {intervals[0]:.6g} s from the next one, where intervals are {turn:.3g} s; "
                "what is beyond is not known, and it is left out."
            )
            at = at[1:] if way > 0 else at[:-1]
    return at, said


def _said_of_turns(
    at: np.ndarray, kept: np.ndarray, numbers: np.ndarray, unread: list[tuple[float, float]], name: str
) -> list[str]:
    """Return what is to be said of pulses that index pulses count."""
    if kept.size < ENOUGH * at.size:
        raise SignalError(
            f"index: {at.size - kept.size} of {at.size} pulses of {name!r} fit no mark of a disc whose marks recur "
            "with each turn; check the lines and the threshold, or take the pulses as they are with faults='keep'"
        )
    spaces, apart = np.diff(numbers), np.diff(kept)
    places = [
        PulseFault(int(kept[k]), int(kept[k + 1]), int(spaces[k]), float(spaces[k]))
        for k in np.flatnonzero((spaces != apart) | (apart > 1))
    ]
    words = [f"{name}: {text}" for text in described(at, places)]
    beside = sum(place.missing == 0 for place in places)
    beside += int(kept[0] > 0) + int(kept[-1] < at.size - 1)
    if beside:
        spots = [place for place in places if place.missing == 0]
        where = ", ".join(f"{at[p.first]:.6g} to {at[p.last]:.6g} s" for p in spots[:3]) or "the ends of the record"
        words.append(
            f"{name}: pulses are at no sure mark at {beside} place{'s' * (beside > 1)} ({where}), as where one is "
            "missing and another too many; index pulses give the count, and these pulses are left out."
        )
    if unread:
        words.append(
            f"{name}: CHECK THE PULSES: no pulse fits a mark in {len(unread)} turns between index pulses, the first "
            f"{unread[0][0]:.6g} to {unread[0][1]:.6g} s; they are left out."
        )
    return words


def _doubts(train: PulseTrain, found: list[PulseFault]) -> list[str]:
    """Return a remark where turns do not recur as they are numbered, or too much was mended by intervals alone."""
    shifted, unlike, at_ends, turns = doubtful_turns(train.numbers, train.times, train.lines)
    own = np.bincount(np.setdiff1d(np.arange(train.numbers[0], train.numbers[-1]), train.numbers) % train.lines)
    lacking = own > max(1.0, SAME_MARK * (train.turns - 1.0))
    mended = sum(abs(place.missing) for place in found) - int(own[lacking].sum())
    tangled = sum(place.spaces is not None and place.spaces > 1 and place.last - place.first > 1 for place in found)
    many = mended >= MANY_MENDED and mended > MENDED_SHARE * train.numbers.size
    what = [f"{shifted} of {turns} turns fit the others only with other numbers"] * bool(shifted)
    what += [f"{unlike} intervals are unlike those of the same mark in other turns"] * bool(unlike)
    what += ["an interval near an end is unlike those of its mark"] * bool(at_ends)
    what += [f"{mended} pulses of {train.numbers.size} were mended by the intervals beside them alone"] * many
    what += [f"pulses between others at {tangled} places fit no mark"] * (tangled > 0 and not lacking.any())
    jump = sudden_jump(train.numbers, train.times, train.lines)
    what += [] if jump is None else [str(jump)]
    if not what:
        return []
    return [
        f"{train.name}: CHECK THE COUNT: {' and '.join(what)}, so that turns, speed and the numbers of marks may be "
        "wrong; record index pulses and give them with index=..., or raise the level of the weak marks."
    ]


def _referenced(
    train: PulseTrain, index: np.ndarray | None, words: list[str], sure: bool = False
) -> tuple[PulseTrain, list[str]]:
    """Number the marks from the index pulses, by which they may be surely counted, or from one that the disc lacks."""
    if index is not None:
        after = np.searchsorted(train.times, index)
        after = after[(after > 0) & (after < train.times.size)]
        marks = train.numbers[after] % train.lines
        if not marks.size:
            raise SignalError(f"index: no index pulse of {train.name!r} lies within the record; leave index out")
        # an index pulse at the same instant as a mark may come a tick before or behind it
        zero = int(marks[0])
        apart = (marks - zero + train.lines // 2) % train.lines - train.lines // 2
        if sure:
            zero += round(float(np.median(apart)))
            return replace(train, numbers=train.numbers - zero, referenced=True), words
        gaps = np.diff(train.numbers[after])
        turns = max(1, round(float(gaps.sum() / max(gaps.min(), 1)))) if gaps.size else 1
        every = round(float(gaps.sum() / turns)) if gaps.size else train.lines
        inside = np.sort(index[(index > train.times[0]) & (index <= train.times[-1])])
        between = turns_between(inside, gaps, train.lines) if inside.size == after.size else None
        drift = 0.0
        if between is not None and gaps.size:
            drift = float(np.ptp(np.concatenate(([0], np.cumsum(gaps - train.lines * between)))))
        if drift > INDEX_REACH or np.abs(apart).max() > INDEX_REACH or abs(every - train.lines) > INDEX_REACH:
            raise SignalError(
                f"index: pulses of {train.name!r} come once in about {every} marks, not once in {train.lines}; check "
                "the lines and, where turns lack pulses, the threshold and the marks, or leave index out"
            )
        zero += round(float(np.median(apart)))
        return replace(train, numbers=train.numbers - zero, referenced=True), words
    missing = np.setdiff1d(np.arange(train.numbers[0], train.numbers[-1]), train.numbers)
    _check_recurrence(missing, train)
    missing %= train.lines
    marks, counts = np.unique(missing, return_counts=True)
    lacking = marks[counts > max(1.0, SAME_MARK * (train.turns - 1.0))]
    if not lacking.size:
        return train, words
    zero = int(lacking[0])
    told = f"{train.name}: the disc lacks {lacking.size} of {train.lines} marks, mark 0 is one that is missing."
    return replace(train, numbers=train.numbers - zero, referenced=lacking.size == 1), [told]


def _check_recurrence(missing: np.ndarray, train: PulseTrain) -> None:
    """Refuse a count of lines that is none after which missing pulses recur: those of a mark that the disc lacks do."""
    first = missing[np.diff(missing, prepend=missing[:1] - 2) > 1]
    gaps = np.diff(first)
    if gaps.size < FEWEST_GAPS:
        return
    every = int(np.median(gaps))
    if np.mean(gaps == every) >= ALIKE and train.lines % every:
        raise SignalError(
            f"lines: a pulse of {train.name!r} is missing every {every}, as of a disc of {every} lines that lacks one, "
            f"not of {train.lines}; give lines={every}, or take the pulses as they are with faults='keep'"
        )


def _check_gaps(train: PulseTrain) -> None:
    """Refuse the count of the marks that a disc with gaps has, told as that of its pitches.

    Whoever counts the teeth of a trigger wheel with gaps counts those that are there.
    """
    lines, numbers, apart = train.lines, train.numbers, np.diff(train.numbers)
    if lines < FEWEST_EVEN or train.turns < FEWEST_GAPS:
        return
    mark, steps = numbers[:-1] % lines, np.diff(train.times)
    # each by the turn about it, so that the speed drops out
    turn = np.interp(numbers + 0.5 * lines, numbers, train.times) - np.interp(
        numbers - 0.5 * lines, numbers, train.times
    )
    inside = (apart == 1) & (numbers[:-1] - numbers[0] >= lines) & (numbers[-1] - numbers[:-1] >= lines)
    relative = steps[inside] / turn[:-1][inside]
    pitches = np.array([np.median(relative[mark[inside] == m]) for m in np.unique(mark[inside])])
    if not pitches.size:
        return
    pitches = pitches / np.median(pitches)
    wide = pitches > 1.5
    whole = np.rint(pitches[wide])
    if (
        wide.any()
        and wide.mean() < 0.25
        and np.abs(pitches[wide] - whole).max() <= GAP
        and np.abs(pitches[~wide] - 1.0).max() <= OTHERS
    ):
        lacks = int(np.sum(whole - 1.0))
        raise SignalError(
            f"lines: in each turn of {train.name!r} {int(wide.sum())} of {lines} intervals "
            f"{'is' if wide.sum() == 1 else 'are'} {', '.join(f'{n:.3g}' for n in pitches[wide])} times as long as the "
            f"others, as of a disc of {lines + lacks} lines that lacks {lacks}; give lines={lines + lacks}, those that "
            "are missing included, or take the pulses as they are with faults='keep'"
        )


@takes_data()
def pulses_of_channel(
    signal: Any,
    lines: int,
    channel: str | None = None,
    *,
    threshold: float | None = None,
    index: str | None = None,
    **known: Unpack[OfChannelKeywords],
) -> PulseTrain:
    """Take the pulses from a channel that was sampled, as the voltage of an encoder or a tacho.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    lines : int
        Pulses of a turn.
    channel, index : str, optional
        Channel of the pulses, and that of a pulse once a turn.
    threshold : float, optional
        Level of the edges; default the middle of the swing.
    **known
        Further arguments of `pulse_train`.
    """
    edges, name, level = pulse_edges(signal, channel, threshold)
    coarse = _coarse(signal.sel(channel=name).values, name, level, lines)
    once = None if index is None else pulse_edges(signal, index, threshold)[0]
    settings: dict[str, Any] = {"name": name, **known}
    train = pulse_train(edges, lines, index=once, **settings)
    return replace(train, notes=[*train.notes, *coarse])


def _coarse(values: np.ndarray, name: str, level: float, lines: int) -> list[str]:
    """Return what is to be said of pulses that few samples show.

    Raises
    ------
    SignalError
        If they are so few that pulses may come more often than is seen.
    """
    crossed = np.flatnonzero(np.diff(values >= level))
    each = 2.0 * float(np.mean(np.diff(crossed))) if crossed.size > 2 else math.inf
    if each < FEWEST_SAMPLES:
        raise SignalError(
            f"channel: {name!r} has {each:.3g} samples a pulse, so that more pulses may have come than are seen; give "
            "ten samples to each by a faster rate, or let a counter note the times"
        )
    swing = float(np.percentile(values, 99.0) - np.percentile(values, 1.0))
    slope = np.abs(values - level) < SQUARE * swing
    if slope.mean() * each < 1.0:
        return [
            f"{name}: edges fall between two samples, of {each:.3g} a pulse: each is known to half a sample, "
            f"{math.pi / (each * lines):.2g} rad of the shaft; a counter of times knows more."
        ]
    if each < ENOUGH_SAMPLES:
        return [f"{name}: {each:.3g} samples a pulse put its edges wrong by up to a hundredth of the pitch; take 10."]
    return []


def angle_of_pulses(train: PulseTrain, marks: Any = None) -> xr.DataArray:
    """Angle of the shaft at its pulses.

    Parameters
    ----------
    train : PulseTrain
    marks : EncoderMarks or array_like of shape (lines,), optional
        Errors of the marks, rad (`encoder_marks`); default none.

    Returns
    -------
    xarray.DataArray
        rad, dimension (time,); zero at mark 0. Times are those of the pulses, as uneven as the shaft turns.
    """
    angle = TURN / train.lines * train.numbers
    if marks is not None:
        angle = angle + errors_of(marks, train)[train.numbers % train.lines]
    return xr.DataArray(
        angle,
        dims=("time",),
        coords={"time": ("time", train.times, {"units": "s"})},
        name="angle",
        attrs={"units": "rad", "origin": "tacho"},
    )


def errors_of(marks: Any, train: PulseTrain) -> np.ndarray:
    """Return the errors of a train's marks, rad; SignalError if they are of another disc, or nothing numbers them."""
    errors = np.asarray(getattr(marks, "errors", marks), dtype=float)
    if errors.shape != (train.lines,):
        raise SignalError(f"marks: {train.name!r} has {train.lines} lines, the marks are {errors.size}; give its own")
    if not train.referenced:
        raise SignalError(
            f"marks: nothing says which pulse of {train.name!r} is that of mark 0; give index pulses with index=..."
        )
    return errors
