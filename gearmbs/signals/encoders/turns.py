"""Pulses between index pulses: so many marks pass from one to the next, whatever came of them.

Turns between index pulses that hold as many pulses as the disc has marks, alike from turn to turn, give the places of
the marks. In any other turn pulses are laid to marks so that the path costs least: each step from pulse to pulse is
compared with that from mark to mark, and each mark without a pulse and each pulse without a mark has its price. The
count is sure, for a turn begins and ends at index pulses. What two paths of nearly the same cost disagree on is left
out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.interpolate

EVEN_TURNS = math.log(1.5)
"""Logarithm of the ratio of successive times between index pulses below which no index pulse is missing: that is log 2
or more."""
NEAR_WHOLE = 0.2
"""Turns by which a count of pulses may be off a whole number to tell how many index pulses are missing."""
FEWEST_SOUND = 2
"""Turns that must be alike to give the places of the marks."""
AT_A_MARK = 0.15
"""Part of an interval within which index pulses come with a mark, now before it, now behind."""
ALIKE, CLEAR = 0.15, 6.0
"""Relative difference of a step from that of the marks, and robust deviations of it, that a sound turn keeps within."""
FLOOR = 0.25
"""Part of the mean pitch that is added to a step to which a difference is related: short ones are known less well."""
LOOSER = 2.0
"""Times as much of both beyond the first and the last index pulse, where no other one says how the speed goes on."""
LEAST_SCATTER = 0.02
"""Of steps, related to those of the marks: the speed varies by as much though whole turns are alike."""
PRICE = 8.0
"""Of a mark without a pulse or a pulse without a mark: a step may be off by four deviations instead."""
MOST_LOST, MOST_EXTRA = 8, 3
"""Marks without pulses, and pulses without marks, in a row."""
MARGIN = 4.0
"""By how much another path must cost more for a pulse to be surely of its mark: e^4 times less likely."""
LEAST_OF_STEPS = 0.8
"""Part of the marks of a turn that must have pulses for steps to be counted by those around them."""
STEPS_AROUND = 8
"""Steps on each side whose median is the pitch there."""
SURE_STEP = 0.45
"""How far from a whole number of pitches a step may be to be counted: marks off by a fifth of one make 0.4."""
BAND = 16
"""Marks by which a path may stray from the straight one beyond what the counts of a turn differ by."""
OPEN = 2
"""Pulses in which one may be missing throughout where no index pulse ends a part, beyond the band."""
OVERLAP = 3
"""Pulses that fit, beside those that do not, that are laid anew with them."""
NOWHERE = -(2**40)
"""Number of a pulse of no sure mark."""
NOWHERE_BACK = -1 - NOWHERE
"""The same, counted backwards."""


class Counted(NamedTuple):
    """Pulses (indices) that are of marks, their numbers counted from an index pulse, and turns that nobody can read."""

    kept: np.ndarray
    numbers: np.ndarray
    unread: list[tuple[float, float]]


def turns_between(index: np.ndarray, counts: np.ndarray, lines: int) -> np.ndarray | None:
    """Return the turns from each index pulse to the next, by times or pulses between; None where neither tells."""
    lengths = np.diff(index)
    if lengths.size < 2 or np.abs(np.diff(np.log(lengths))).max() < EVEN_TURNS:
        return np.ones(lengths.size, dtype=int)
    turns = np.round(counts / lines).astype(int)
    sure = np.all((turns >= 1) & (np.abs(counts / lines - turns) <= NEAR_WHOLE))
    return turns if sure else None


def counted_turns(edges: np.ndarray, lines: int, index: np.ndarray) -> Counted | None:
    """Count pulses from index pulse to index pulse; None where too few turns are sound, or turns are not known.

    Parameters
    ----------
    edges : ndarray of shape (n,)
        Times of the pulses, s, increasing.
    lines : int
        Marks of a turn.
    index : ndarray
        Times of a pulse once a turn, s.
    """
    once = np.sort(index[(index > edges[0]) & (index < edges[-1])])
    if once.size < FEWEST_SOUND + 1 or np.any(np.diff(once) <= 0.0):
        return None
    once = _clear_of_marks(edges, once)
    at = np.searchsorted(edges, once)
    turns = turns_between(once, np.diff(at), lines)
    if turns is None:
        return None
    # 1. course: turns over time, through the index pulses
    course = scipy.interpolate.CubicSpline(once, np.concatenate(([0], np.cumsum(turns))))
    place = course(edges)
    # a cubic that runs on beyond its points bends as it likes: the speed is that of the turn beside
    early, late = edges < once[0], edges > once[-1]
    place[early] = (edges[early] - once[0]) * turns[0] / (once[1] - once[0])
    place[late] = turns.sum() + (edges[late] - once[-1]) * turns[-1] / (once[-1] - once[-2])
    if np.any(np.diff(place) <= 0.0):
        return None
    # 2. marks: their places in a turn, from the turns in which every mark has its pulse
    first = np.concatenate(([0], np.cumsum(turns)))
    one = np.flatnonzero(turns == 1)
    seen = [place[at[k] : at[k + 1]] - first[k] for k in one if at[k + 1] - at[k] == lines]
    if len(seen) < FEWEST_SOUND:
        # hardly a turn of many marks is whole where one in a hundred is lost
        seen = [
            at_marks for k in one if (at_marks := _by_steps(place[at[k] : at[k + 1]] - first[k], lines)) is not None
        ]
    known = _places_of_marks(np.array(seen).reshape(-1, lines), lines)
    if known is None:
        return None
    # 3. laying: the pulses of each part between index pulses, and before and behind them, to these marks
    marks, scatter, bound = known
    laid = _Laid(lines, marks, max(LEAST_SCATTER, scatter), bound)
    at_end = _Laid(lines, marks, LOOSER * laid.scatter, LOOSER * bound)
    numbers = np.full(edges.size, -1, dtype=np.int64)
    taken = np.zeros(edges.size, dtype=bool)
    unread = []
    for k in range(-1, turns.size + 1):
        begin = 0 if k < 0 else int(at[k])
        end = edges.size if k >= turns.size else int(at[k + 1])
        if begin == end:
            continue
        part = place[begin:end]
        if 0 <= k < turns.size:
            found = laid.between(part - first[k], int(turns[k]))
            start = int(first[k]) * lines
        elif k < 0:
            # the part before the first index pulse is read backwards
            found = -1 - at_end.mirrored().behind(-part[::-1])[::-1]
            found = np.where(found == NOWHERE_BACK, NOWHERE, found)
            start = 0
        else:
            found, start = at_end.behind(part - first[-1]), int(first[-1]) * lines
        good = found != NOWHERE
        if not good.any():
            unread.append((float(edges[begin]), float(edges[end - 1])))
        numbers[begin:end] = found + start
        taken[begin:end] = good
    return Counted(np.flatnonzero(taken), numbers[taken], unread)


def _places_of_marks(seen: np.ndarray, lines: int) -> tuple[np.ndarray, float, float] | None:
    """Return where marks stand in a turn, the scatter of steps, and what sound ones keep within; None if unknown.

    Parameters
    ----------
    seen : ndarray of shape (turns, lines)
        Places of the pulses of each turn; nan of those that are missing.
    """
    if seen.shape[0] < FEWEST_SOUND or np.isnan(seen).all(axis=0).any():
        return None
    marks = np.nanmedian(seen, axis=0)
    steps = np.diff(marks, prepend=0.0, append=1.0)
    if steps.min() <= 0.0:
        return None
    # the last mark of the turn before closes the steps of a turn
    off = _off(np.diff(seen, axis=1, prepend=0.0, append=1.0), steps, lines)
    there = np.isfinite(off)
    scatter = 1.4826 * float(np.median(np.abs(off[there])))
    bound = max(ALIKE, CLEAR * scatter)
    sound = np.where(there, np.abs(off), 0.0).max(axis=1) <= bound
    if sound.sum() < FEWEST_SOUND or np.isnan(seen[sound]).all(axis=0).any():
        return None
    return np.nanmedian(seen[sound], axis=0), scatter, bound


def _by_steps(place: np.ndarray, lines: int) -> np.ndarray | None:
    """Return where the marks of a turn passed, nan where a pulse is missing, or None if steps do not count them."""
    numbers = _numbers_by_steps(place, lines)
    if numbers is None or place.size < LEAST_OF_STEPS * lines or numbers[-1] >= lines:
        return None
    out = np.full(lines, np.nan)
    out[numbers] = place
    return out


def _numbers_by_steps(place: np.ndarray, lines: int) -> np.ndarray | None:
    """Return numbers of pulses behind an index pulse by steps that are whole numbers of those around; None if not."""
    if place.size < 2:
        return None
    steps = np.diff(place)
    parts = np.arange(0, steps.size, STEPS_AROUND)
    medians = [float(np.median(steps[max(0, k - STEPS_AROUND) : k + STEPS_AROUND + 1])) for k in parts]
    spaces = steps / np.interp(np.arange(steps.size), parts, medians)
    whole = np.round(spaces)
    if np.any(whole < 1.0) or np.abs(spaces - whole).max() > SURE_STEP:
        return None
    # an index pulse stands between marks, half a pitch or so before the first one
    return max(0, round(place[0] * lines - 0.5)) + np.concatenate(([0], np.cumsum(whole.astype(int))))


def _clear_of_marks(edges: np.ndarray, once: np.ndarray) -> np.ndarray:
    """Return times once a turn that lie between two marks: those of the index pulses, or half an interval before."""
    next_one = np.searchsorted(edges, once)
    gaps = edges[next_one] - edges[next_one - 1]
    part = (once - edges[next_one - 1]) / gaps
    middle = float(np.angle(np.mean(np.exp(2j * np.pi * part)))) / (2.0 * np.pi)
    if abs(middle) > AT_A_MARK:
        return once
    near = np.where(part > 0.5, next_one, next_one - 1)
    before = edges[near] - edges[np.maximum(near - 1, 0)]
    turn = np.gradient(once)
    shifted = once - 0.5 * float(np.median(before / turn)) * turn
    return shifted[(shifted > edges[0]) & (shifted < edges[-1])]


def _off(steps: np.ndarray, of_marks: np.ndarray, lines: int) -> np.ndarray:
    """Return differences of steps between pulses from those between marks, related to these."""
    return (steps - of_marks) / (of_marks + FLOOR / lines)


class _Laid:
    """Lays pulses to marks: places in turns, behind an index pulse at zero."""

    def __init__(self, lines: int, marks: np.ndarray, scatter: float, bound: float) -> None:
        self.lines, self.marks, self.scatter, self.bound = lines, marks, scatter, bound

    def mirrored(self) -> _Laid:
        """Return the same of the disc turned the other way."""
        return _Laid(self.lines, 1.0 - self.marks[::-1], self.scatter, self.bound)

    def between(self, place: np.ndarray, turns: int) -> np.ndarray:
        """Return numbers of pulses between two index pulses so many turns apart; NOWHERE for those of no sure mark."""
        marks = np.concatenate([self.marks + k for k in range(turns)])
        events, targets = np.concatenate(([0.0], place, [turns])), np.concatenate(([0.0], marks, [turns]))
        same = min(events.size, targets.size)
        ahead = self._alike(np.diff(events[:same]), np.diff(targets[:same]))
        if ahead == events.size - 1 and events.size == targets.size:
            return np.arange(place.size)
        if (counted := self._counted(place, marks, [float(turns)])) is not None:
            return counted
        behind = self._alike(np.diff(events[-same:])[::-1], np.diff(targets[-same:])[::-1])
        head = max(0, min(ahead, same - 2) - OVERLAP)
        tail = max(0, min(behind, same - 2 - head) - OVERLAP)
        core = self._core(events[head : events.size - tail], targets[head : targets.size - tail], False)
        numbers = np.concatenate(
            (
                np.arange(head),
                np.where(core == NOWHERE, NOWHERE, core + head),
                targets.size - tail + np.arange(tail),
            )
        )
        return np.where(numbers == NOWHERE, NOWHERE, numbers - 1)[1:-1]

    def _counted(self, place: np.ndarray, marks: np.ndarray, end: list[float]) -> np.ndarray | None:
        """Return numbers of pulses whose steps count them, if all of these are then as those of the marks."""
        numbers = _numbers_by_steps(place, self.lines)
        if numbers is None or numbers[-1] >= marks.size:
            return None
        events, targets = np.concatenate(([0.0], place, end)), np.concatenate(([0.0], marks[numbers], end))
        off = _off(np.diff(events), np.diff(targets), self.lines)
        return numbers if np.abs(off).max() <= self.bound else None

    def behind(self, place: np.ndarray) -> np.ndarray:
        """Return numbers of pulses behind the last index pulse."""
        turns = max(1, math.ceil(float(place[-1])) + 1)
        marks = np.concatenate([self.marks + k for k in range(turns)])
        events, targets = np.concatenate(([0.0], place)), np.concatenate(([0.0], marks))
        same = min(events.size, targets.size)
        ahead = self._alike(np.diff(events[:same]), np.diff(targets[:same]))
        if ahead == events.size - 1:
            return np.arange(place.size)
        if (counted := self._counted(place, marks, [])) is not None:
            return counted
        head = max(0, ahead - OVERLAP)
        core = self._core(events[head:], targets[head : head + 2 * (events.size - head) + MOST_LOST], True)
        numbers = np.concatenate((np.arange(head), np.where(core == NOWHERE, NOWHERE, core + head)))
        return np.where(numbers == NOWHERE, NOWHERE, numbers - 1)[1:]

    def _alike(self, steps: np.ndarray, of_marks: np.ndarray) -> int:
        """Return how many steps from the first on are those of the marks."""
        broken = np.flatnonzero(np.abs(_off(steps, of_marks, self.lines)) > self.bound)
        return int(broken[0]) if broken.size else steps.size

    def _core(self, events: np.ndarray, targets: np.ndarray, open_end: bool) -> np.ndarray:
        """Return the mark of each event, the first being that of the first mark, the last of the last unless open."""
        begin = np.where(np.arange(targets.size) == 0, 0.0, np.inf)
        end = np.zeros(targets.size) if open_end else begin
        # the way back is the way there of the mirrored train
        size, count = events.size, targets.size
        straight, net = np.arange(size), count - size
        low = straight - BAND if open_end else straight + min(0, net) - BAND
        high = straight + straight // OPEN + BAND if open_end else straight + max(0, net) + BAND
        low, high = np.clip(low, 0, count), np.clip(high + 1, 0, count)
        total = self._costs(events, targets, begin, low, high)
        total += self._costs(-events[::-1], -targets[::-1], end, count - high[::-1], count - low[::-1])[::-1, ::-1]
        best = float(total[0, 0])
        result = np.full(events.size, NOWHERE, dtype=np.int64)
        if not math.isfinite(best):
            return result
        of_event = np.argmin(total, axis=1)
        for i, j in enumerate(of_event):
            others = np.concatenate((total[i, :j], total[i, j + 1 :], total[:i, j], total[i + 1 :, j]))
            if total[i, j] <= best + 1e-9 and others.min(initial=np.inf) > best + MARGIN:
                result[i] = j
        # both ends are index pulses, or pulses that fit, of known marks
        result[0] = 0
        if not open_end:
            result[-1] = targets.size - 1
        return result

    def _costs(
        self, events: np.ndarray, targets: np.ndarray, begin: np.ndarray, lows: np.ndarray, highs: np.ndarray
    ) -> np.ndarray:
        """Return the least cost of a path to each pair of event and mark, from the first event at a cost of its own.

        Marks of an event are looked at from `lows` to `highs` (exclusive).
        """
        reach, count = MOST_LOST + 1, targets.size
        cost = np.full((events.size, reach + count), np.inf)
        cost[0, reach:] = begin
        ahead = np.concatenate((targets[0] - np.arange(reach, 0, -1), targets))
        steps = targets[:, None] - np.lib.stride_tricks.sliding_window_view(ahead, reach)[:count]
        known = (steps + FLOOR / self.lines) * self.scatter
        passed = PRICE * np.arange(reach - 1, -1, -1)
        for i in range(1, events.size):
            low, high = int(lows[i]), int(highs[i])
            back = np.arange(1, min(i, MOST_EXTRA + 1) + 1)
            before = np.lib.stride_tricks.sliding_window_view(cost[i - back, low : high + reach - 1], reach, axis=1)
            off = ((events[i] - events[i - back])[:, None, None] - steps[low:high]) / known[low:high]
            price = PRICE * (back - 1.0)[:, None, None] + passed
            cost[i, reach + low : reach + high] = (before + 0.5 * off**2 + price).min(axis=(0, 2))
        return cost[:, reach:]
