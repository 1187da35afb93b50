"""Missing and extra pulses of a wheel with uneven marks: its pitches recur with each turn and tell which is which.

An interval is compared with that a turn before it: where both turns are whole their ratio is that of the speeds. A
pulse more or less shifts all marks behind it by one, so that the comparison fails for a turn and holds again. The turns
that hold give the wheel's own pitches. How these stand on both sides of such a place says, modulo a turn, how many
marks passed, and the time the rest; within it each pulse is that of the mark that is nearest.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

UNEVEN = 0.02
"""Standard deviation of the logarithms of pitches from which a wheel is uneven: below it neighbours tell."""
BROKEN, CLEAR = 0.1, 6.0
"""Logarithm of the ratio of intervals a turn apart, and robust standard deviations of it, from which they differ."""
FEWEST_TURNS = 4
"""Turns of a record in which pitches can recur."""
MOST = 8
"""Marks missing in a row, or extra pulses, that are looked for; `phase.MOST_MISSING`."""
AT_MARK = 0.3
"""Part of the pitches beside it by which a pulse may be off its mark."""


class Place(NamedTuple):
    """Where pulses are missing or too many: between two edges (indices) lie so many pitches; None if nobody knows."""

    first: int
    last: int
    spaces: int | None
    length: float


class _Stretch(NamedTuple):
    """Edges `first` to `last` between which turns are whole, and the mark that `first` is of."""

    first: int
    last: int
    mark: int


def uneven_faults(edges: np.ndarray, marks: int) -> list[Place] | None:
    """Return the places, or None of a wheel that is even, or whose pitches do not recur.

    Parameters
    ----------
    edges : ndarray of shape (n,)
        Times of the pulses, s, increasing.
    marks : int
        Of a turn, 2 or more.
    """
    intervals = np.diff(edges)
    if marks < 2 or intervals.size < FEWEST_TURNS * marks:
        return None
    logs = np.log(np.maximum(intervals, 1e-300))
    ratio = logs[marks:] - logs[:-marks]
    ratio = ratio - _running_median(ratio, marks)
    bound = max(BROKEN, CLEAR * 1.4826 * float(np.median(np.abs(ratio))))
    broken = np.flatnonzero(np.abs(ratio) > bound) + marks
    whole = _whole_stretches(broken, marks, intervals.size)
    if not whole:
        return None
    longest = max(range(len(whole)), key=lambda k: whole[k][1] - whole[k][0])
    pitches = _pitches(intervals, whole[longest], marks)
    if _spread(np.log(pitches)) < UNEVEN:
        return None
    at = np.concatenate(([0.0], np.cumsum(pitches)))[:-1]
    placed = _placed(intervals, whole, pitches, marks, longest)
    found: list[Place] = []
    for before, after in zip([None, *placed], [*placed, None]):
        found += _between(edges, before, after, at, marks)
    return found


def _spread(logs: np.ndarray) -> float:
    """Return by how much pitches differ, of many without a few that do alone, as at a joint."""
    few = logs.size <= 2 * MOST
    return float(np.std(logs)) if few else 1.4826 * float(np.median(np.abs(logs - np.median(logs))))


def _running_median(values: np.ndarray, marks: int) -> np.ndarray:
    """Return medians over a turn to either side of parts of half a turn, in straight lines between."""
    step = max(1, marks // 2)
    middles = np.arange(0, values.size, step)
    medians = [float(np.median(values[max(0, m - marks) : m + marks + 1])) for m in middles]
    return np.interp(np.arange(values.size), middles, medians)


def _whole_stretches(broken: np.ndarray, marks: int, count: int) -> list[tuple[int, int]]:
    """Return first and last (exclusive) interval of stretches in which each is as that a turn before it."""
    ends = np.concatenate(([marks - 1], broken, [count]))
    # one that begins the record has its first turn from the comparison with the second
    spans = [(0 if a == marks - 1 else int(a) + 1, int(b)) for a, b in itertools.pairwise(ends) if b - a > marks + 1]
    return [span for span in spans if span[1] - span[0] >= marks + 1]


def _pitches(intervals: np.ndarray, span: tuple[int, int], marks: int) -> np.ndarray:
    """Return the wheel's pitches by their mean, from the intervals of a stretch; the first belongs to its first."""
    part = intervals[span[0] : span[1]]
    turn = _turn_means(part, marks)
    relative = part / turn
    pitches = np.array([float(np.median(relative[k::marks])) for k in range(marks)])
    return np.roll(pitches / pitches.mean(), span[0] % marks)


def _turn_means(part: np.ndarray, marks: int) -> np.ndarray:
    """Return the mean interval of the turn about each interval, of the first or last whole turn at the ends."""
    sums = np.concatenate(([0.0], np.cumsum(part)))
    begin = np.clip(np.arange(part.size) - marks // 2, 0, part.size - marks)
    return (sums[begin + marks] - sums[begin]) / marks


def _placed(
    intervals: np.ndarray, whole: list[tuple[int, int]], pitches: np.ndarray, marks: int, known: int
) -> list[_Stretch]:
    """Return the stretches with the marks that they begin with, one after the other from one that is known."""
    one = whole[known]
    found = {known: _Stretch(*one, one[0] % marks)}
    own = np.log(pitches)
    for k, beside in [
        *((k, k - 1) for k in range(known + 1, len(whole))),
        *((k, k + 1) for k in range(known - 1, -1, -1)),
    ]:
        first, last = whole[k]
        part = intervals[first:last]
        relative = np.log(part / _turn_means(part, marks))
        seen = np.array([float(np.median(relative[j::marks])) for j in range(min(marks, relative.size))])
        ahead = found[beside].mark + first - found[beside].first
        shifts = np.arange(-MOST, MOST + 1) if marks > 2 * MOST else np.arange(marks)
        cost = [float(np.abs(seen - own[(ahead + s + np.arange(seen.size)) % marks]).sum()) for s in shifts]
        found[k] = _Stretch(first, last, int(ahead + shifts[int(np.argmin(cost))]) % marks)
    return [found[k] for k in range(len(whole))]


def _between(
    edges: np.ndarray, before: _Stretch | None, after: _Stretch | None, at: np.ndarray, marks: int
) -> list[Place]:
    """Return the places between two stretches, or before the first, or behind the last."""
    if before is None and after is not None:
        # backwards in time the same
        if after.first == 0:
            return []
        size = edges.size
        mirrored = _Stretch(
            size - 1 - after.last, size - 1 - after.first, (-(after.mark + after.last - after.first)) % marks
        )
        back = _between(-edges[::-1], mirrored, None, _reversed(at), marks)
        return [Place(size - 1 - p.last, size - 1 - p.first, p.spaces, p.length) for p in reversed(back)]
    assert before is not None
    begin = before.last
    end = edges.size - 1 if after is None else after.first
    if begin >= end:
        return []
    mark = before.mark + before.last - before.first
    place = _angle(at, mark, marks)
    time = edges[begin : end + 1] - edges[begin]
    speed, rise = _speed(edges[max(before.first, begin - 2 * marks) : begin + 1], marks)
    if after is None:
        turned = place + speed * time + 0.5 * rise * time**2
    else:
        # how many marks passed: as the pitches on both sides say, and nearest to what the time says
        speed_2, _ = _speed(-edges[end : min(after.last, end + 2 * marks) + 1][::-1], marks)
        told = _angle(at, after.mark, marks)
        passed = round((place + 0.5 * (speed + speed_2) * time[-1] - told) / marks)
        told += passed * marks
        turned = _hermite(time, place, told, speed, speed_2)
    return _assigned(turned, mark, at, marks, begin)


def _assigned(turned: np.ndarray, mark: int, at: np.ndarray, marks: int, begin: int) -> list[Place]:
    """Return the places among edges that stand at some angles (pitches), of which the first is of a mark."""
    near = np.arange(mark - 1, mark + math.ceil(turned[-1] - turned[0]) + marks + 2)
    places = np.array([_angle(at, int(n), marks) for n in near])
    middle = 0.5 * (places[1:] + places[:-1])
    index = np.searchsorted(middle, turned)
    room = np.diff(places)
    index = np.clip(index, 1, near.size - 2)
    off = np.abs(turned - places[index]) / np.minimum(room[index - 1], room[index])
    numbers = near[index]
    best: dict[int, int] = {}
    for k, n in enumerate(numbers):
        if off[k] <= AT_MARK and (int(n) not in best or off[k] < off[best[int(n)]]):
            best[int(n)] = k
    kept = sorted(best.values())
    if not kept or kept[0] != 0:
        return [Place(begin, begin + turned.size - 1, None, float(turned[-1] - turned[0]))]
    found = []
    for a, b in itertools.pairwise(kept):
        spaces = int(numbers[b] - numbers[a])
        if spaces != b - a:
            lost = spaces - (b - a)
            known = spaces if -MOST <= lost <= MOST else None
            found.append(Place(begin + a, begin + b, known, float(turned[b] - turned[a])))
    return found


def _angle(at: np.ndarray, mark: int, marks: int) -> float:
    """Return where a mark is, in mean pitches, counted through turns."""
    return float(at[mark % marks]) + marks * (mark // marks)


def _reversed(at: np.ndarray) -> np.ndarray:
    """Return the places of a wheel's marks as it turns backwards: mark n is the former mark -n."""
    marks = at.size
    return np.array([-(_angle(at, -n, marks)) for n in range(marks)])


def _speed(edges: np.ndarray, marks: int) -> tuple[float, float]:
    """Return the speed at the last of some edges, or their only turn's, in pitches a second, and its rise."""
    whole = (edges.size - 1) // marks
    last = marks / float(edges[-1] - edges[-1 - marks])
    if whole < 2:
        return last, 0.0
    first = marks / float(edges[-1 - marks] - edges[-1 - 2 * marks])
    rise = (last - first) / (0.5 * float(edges[-1] - edges[-1 - 2 * marks]))
    return last + 0.5 * rise * float(edges[-1] - edges[-1 - marks]), rise


def _hermite(time: np.ndarray, a: float, b: float, slope_a: float, slope_b: float) -> np.ndarray:
    """Return the cubic with these values and slopes at the first and the last time."""
    length = float(time[-1])
    u = time / length
    h = u * u * (3.0 - 2.0 * u)
    return a + (b - a) * h + length * (slope_a * u * (1.0 - u) ** 2 + slope_b * u * u * (u - 1.0))
