"""Tacho pulses that are missing or too many, told from the intervals beside them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

SIDE = 3
"""Intervals on each side that say how long those between them should be."""
FEWEST_BESIDE = 4
"""Of both sides together, each with at least one: two would follow any course of the speed."""
UNLIKE = math.log(1.4)
"""An interval that differs more than this from the median around it is looked at; half of a doubled one is log 2."""
MEDIAN_REACH, SCATTER_REACH = 4, 12
CLEAR_OF_SIDES, CLEAR_OF_SCATTER = 3.0, 5.0
"""How often an interval's excess must be the largest of the neighbours' residuals, and the scatter around: a speed that
fluctuates so much from pulse to pulse explains the interval itself."""
WHOLE = 0.2
"""How far from a whole number of the neighbours' intervals the length may be, in intervals."""
UNCLEAR = math.log(1.45)
"""An interval of no whole number is named from here on; the first turn after a sudden load may take less."""
MOST_MISSING = 8
"""Pulses that may be missing in one gap; a longer one may as well be a standstill."""
SAME_WHEEL = math.log(1.25)
"""Intervals one revolution apart that differ less are the wheel's own pitch error, not a fault of the pulses."""
LISTED = 5


class PulseFault(NamedTuple):
    """A place where pulses are missing or too many, from edge `first` to edge `last` (indices)."""

    first: int
    last: int
    spaces: int | None
    """Pitches between the two edges; None where their number cannot be told."""
    length: float
    """The same, as measured by the intervals on both sides."""

    @property
    def missing(self) -> int:
        """Pulses that are missing; negative for those too many."""
        return 0 if self.spaces is None else self.spaces - (self.last - self.first)


def pulse_faults(edges: np.ndarray, pulses_per_rev: float) -> list[PulseFault]:
    """Find where a train of pulses lacks some or has some too many.

    Intervals that differ from the median around them are compared with the straight line through the logarithms of up
    to three intervals on each side, which follows a run-up. Together they should take as many of those as there are of
    them; if it is another whole number, clearly beyond how the neighbours themselves scatter, pulses are missing or too
    many. What recurs with the wheel's revolution is its own pitch.

    Parameters
    ----------
    edges : ndarray, shape (n,)
        Times of the pulses, s.
    pulses_per_rev : float

    Returns
    -------
    list of PulseFault
        In order of time.
    """
    intervals = np.diff(edges)
    if intervals.size < FEWEST_BESIDE + 1:
        return []
    logs = np.log(np.maximum(intervals, 1e-300))
    deviation = logs - _median(logs, MEDIAN_REACH)
    odd = np.abs(deviation) > UNLIKE
    if pulses_per_rev == round(pulses_per_rev) and pulses_per_rev > 1:
        odd &= ~_own_pitch(deviation, int(pulses_per_rev))
    if not odd.any():
        return []
    bent = np.zeros_like(logs)
    bent[1:-1] = np.abs(logs[1:-1] - 0.5 * (logs[:-2] + logs[2:])) / math.sqrt(1.5)
    bent[0], bent[-1] = bent[1], bent[-2]
    found: list[PulseFault] = []
    for first, last in _runs(odd):
        # an extra pulse close to a right one leaves one short interval and one of nearly the full length
        options = [(first, last)]
        if intervals[first:last].sum() < math.exp(float(np.mean(logs[first:last] - deviation[first:last]))) * 0.7:
            options = [(first - 1, last), (first, last + 1)]
        judged = [j for a, b in options if (j := _judged(intervals, logs, bent, odd, a, b)) is not None]
        best = min(judged, key=lambda j: abs(j.length - round(j.length)), default=None)
        if best is not None and best.spaces != best.last - best.first and not (found and best.first < found[-1].last):
            found.append(best)
    return found


def mended_count(count: int, faults: list[PulseFault]) -> tuple[np.ndarray, np.ndarray]:
    """Return which of `count` pulses to keep, and their numbers in units of the pitch."""
    keep = np.ones(count, dtype=bool)
    step = np.ones(count - 1)
    for fault in faults:
        if fault.spaces is not None:
            keep[fault.first + 1 : fault.last] = False
            step[fault.first : fault.last] = 0.0
            step[fault.last - 1] = fault.spaces
    at = np.flatnonzero(keep)
    return at, np.r_[0.0, np.cumsum(step)][at]


def described(edges: np.ndarray, faults: list[PulseFault]) -> list[str]:
    """Say in words how many pulses are missing or too many and when, one sentence for each kind."""
    sentences = []
    missing, extra = [f for f in faults if f.missing > 0], [f for f in faults if f.missing < 0]
    for what, some in (("missing", missing), ("too many", extra)):
        if some:
            places = [f"{abs(f.missing)} between {edges[f.first]:.6g} and {edges[f.last]:.6g} s" for f in some]
            total = sum(abs(f.missing) for f in some)
            sentences.append(f"{total} pulse{'s are' if total > 1 else ' is'} {what}: {_listed(places)}. Mended.")
    unclear = [f for f in faults if f.spaces is None]
    if unclear:
        places = [f"from {edges[f.first]:.6g} to {edges[f.last]:.6g} s, {f.length:.3g} pitches" for f in unclear]
        sentences.append(
            f"{len(unclear)} interval{'s' * (len(unclear) > 1)} between pulses fit neither the pulses beside nor a "
            f"sure number of missing or extra ones: {_listed(places)}. Left as found; the angle may be whole pitches "
            "off from there on."
        )
    return sentences


def _listed(places: list[str]) -> str:
    more = f" and at {len(places) - LISTED} more places" if len(places) > LISTED else ""
    return ", ".join(places[:LISTED]) + more


def _judged(
    intervals: np.ndarray, logs: np.ndarray, bent: np.ndarray, odd: np.ndarray, first: int, last: int
) -> PulseFault | None:
    """Compare intervals `first` to `last` (exclusive) with those beside them; None if these cannot tell."""
    if first < 0 or last > intervals.size:
        return None
    left = [i for i in range(max(0, first - SIDE), first) if not odd[i]]
    right = [i for i in range(last, min(intervals.size, last + SIDE)) if not odd[i]]
    if not left or not right or len(left) + len(right) < FEWEST_BESIDE:
        return None
    beside = np.array(left + right)
    line = np.polynomial.Polynomial.fit(beside, logs[beside], 1)
    residual = float(np.abs(logs[beside] - line(beside)).max())
    inside = np.arange(first, last)
    # a course with a turning point between both sides needs the parabola, whose residuals say less of six points
    course = np.polynomial.Polynomial.fit(beside, logs[beside], 2) if min(len(left), len(right)) == SIDE else line
    pitch = float(np.exp(course(inside)).mean())
    length = float(intervals[first:last].sum()) / pitch
    near = slice(max(0, first - SCATTER_REACH), last + SCATTER_REACH)
    scatter = 1.4826 * float(np.median(bent[near]))
    excess = abs(math.log(length / inside.size))
    if excess < CLEAR_OF_SIDES * residual or excess < CLEAR_OF_SCATTER * scatter:
        return None
    spaces: int | None = round(length)
    whole = abs(length - round(length)) <= WHOLE and spaces
    missing = round(length) - inside.size
    # what the neighbours leave open of one pitch adds up over those of a gap
    if not whole or (missing + 1) * residual > 2.0 * WHOLE or missing > MOST_MISSING:
        if excess < UNCLEAR:
            return None
        spaces = None
    return PulseFault(first, last, spaces, length)


def _own_pitch(deviation: np.ndarray, teeth: int) -> np.ndarray:
    """Return which intervals recur one revolution before or after, as those of an uneven wheel do."""
    same = np.zeros(deviation.size, dtype=bool)
    if deviation.size > teeth:
        alike = np.abs(deviation[teeth:] - deviation[:-teeth]) < SAME_WHEEL
        same[teeth:] |= alike
        same[:-teeth] |= alike
    return same


def _median(values: np.ndarray, reach: int) -> np.ndarray:
    """Return the median over `reach` values on each side, of fewer where the record ends, as many on both sides."""
    n = values.size
    wide = min(reach, (n - 1) // 2)
    out = values.copy()
    if wide:
        windows = np.lib.stride_tricks.sliding_window_view(values, 2 * wide + 1)
        out[wide : n - wide] = np.median(windows, axis=1)
    for k in range(wide):
        # towards an end the last full window has to do; beside it a fault cannot be told from a change of speed
        out[k], out[n - 1 - k] = np.median(values[: k + wide + 1]), np.median(values[n - 1 - k - wide :])
    return out


def _runs(odd: np.ndarray) -> list[tuple[int, int]]:
    """Return the stretches of odd values, those with one value between them as one, ends exclusive."""
    at = np.flatnonzero(odd)
    breaks = np.flatnonzero(np.diff(at) > 2)
    return [(int(a), int(b) + 1) for a, b in zip(at[np.r_[0, breaks + 1]], at[np.r_[breaks, at.size - 1]])]
