"""Points of a run through jumps and narrow changes of the equations, between the ends of its steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearmbs.dae.integrators.bdf import MAX_ORDER
from gearmbs.dae.problem import EPS
from gearmbs.dae.tangent_jumps import BESIDE
from gearmbs.dae.tangent_points import AFRESH, END_OF_STEP, GROWING_ORDER, GROWTH, JUMP

PIECES = 64
"""Steps through a change that is narrow beside those of the run: of the slope of a STEP, a parabola, the formulas that
grow to order three leave some 1e-4."""
AS_A_JUMP = 1e-2
"""Part of a step of the run up to which a change is crossed as a jump: what it does within itself is lost."""
ALONE = 1e-2
"""Part of it that other terms may change by within a change that is crossed as a jump: they move its time by some tenth
of that."""
BEFORE = 1e-4
"""Part of a step of the run of those right before and behind a jump: the matrix is that of the rates to as much."""
AWAY = 2e-2
"""Part of a step of the run within which the ends of its steps are left out about a jump. A run comes to it in steps
that are ever shorter, and slopes between their ends are roundings of its corrector."""
HALTS = 0.125
"""Part of the longest of the steps before below which a run is in steps that are far shorter."""
BESIDE_STEP = 2.0
"""Steps on both sides of the shortest one between which a change is looked for first."""
STEPS_BEFORE = 64
"""Steps before a change of which the longest is that step."""
THROUGH = 4
"""Ends of steps by which the run is carried on to a jump."""
WITHIN = 1
"""Points of a run within a change up to which they say nothing of it: with more the local error of the derivatives
tells how far they do."""
WIDER = 4
"""Times that the interval is widened threefold in which a change is looked for, until all of it is in it."""
MOST_OF_IT, WHOLE = 0.9, 1.25
"""Part of a change that is found about its middle, and times the interval so found that hold all of it: 0.9 of a STEP
come within 0.8 of its width."""
ROUNDINGS = 16.0
"""Roundings of a time that two are apart at least."""


def halts(start: float, times: np.ndarray) -> np.ndarray:
    """Return between which times a run is in the shortest of steps that are far shorter than those before, (m, 2).

    There a narrow change may have points of the run in it, but not enough.

    Parameters
    ----------
    start : float
        Where the run starts.
    times : ndarray, shape (n,)
        Ends of its steps.
    """
    sizes = np.diff(times, prepend=start)
    if sizes.size <= STEPS_BEFORE:
        return np.zeros((0, 2))
    before = np.lib.stride_tricks.sliding_window_view(sizes, STEPS_BEFORE).max(axis=1)
    before = np.concatenate([np.maximum.accumulate(sizes[: STEPS_BEFORE - 1]), before])
    short = np.concatenate([[False], sizes < HALTS * before, [False]])
    edges = np.flatnonzero(short[1:] != short[:-1]).reshape(-1, 2)
    shortest = np.array([begin + int(sizes[begin:end].argmin()) for begin, end in edges], dtype=np.int64)
    beside = BESIDE_STEP * sizes[shortest]
    return np.column_stack([times[shortest] - sizes[shortest] - beside, times[shortest] + beside])


def narrowed(residual: Callable[[float], np.ndarray], low: float, high: float) -> tuple[float, float, float] | None:
    """Return when a change begins and ends that lies between two times, or is about there; None where rates go on.

    The third number is what else changes in as long a time, as part of it.

    Parameters
    ----------
    residual : callable
        Equations along the run, with rates that stay; shape (n,).
    low, high : float
    """
    for _ in range(WIDER):
        before, after, span = residual(low), residual(high), high - low
        whole = after - before
        beside = max(abs((residual(low - span) - before) @ whole), abs((residual(high + span) - after) @ whole))
        if beside < BESIDE * (whole @ whole):
            break
        low, high = low - span, high + span
    else:
        return None
    size = float(whole @ whole)

    def part(t: float) -> float:
        return float((residual(t) - before) @ whole) / size

    apart = ROUNDINGS * EPS * max(abs(low), abs(high))
    begin, end = low, high
    while end - begin > apart:
        middle = 0.5 * (begin + end)
        begin, end = (begin, middle) if part(middle) > 0.5 else (middle, end)
    middle, width = 0.5 * (begin + end), apart
    while 2.0 * width < high - low and part(middle + width) - part(middle - width) < MOST_OF_IT:
        width *= 2.0
    width *= WHOLE
    else_before = part(middle - 2.0 * width) - part(middle - 4.0 * width)
    else_behind = part(middle + 4.0 * width) - part(middle + 2.0 * width)
    return middle - width, middle + width, max(abs(else_before), abs(else_behind))


def unresolved(changes: np.ndarray, start: float, times: np.ndarray) -> np.ndarray:
    """Return those of some changes that a run's points say nothing of: `WITHIN` of them at most, or far shorter steps.

    Parameters
    ----------
    changes : ndarray, shape (m, 3)
    start : float
        Where the run starts.
    times : ndarray, shape (n,)
        Its points.
    """
    within = np.searchsorted(times, changes[:, 1]) - np.searchsorted(times, changes[:, 0])
    steps = np.array([longest_before(start, times, low) for low in changes[:, 0]])
    return changes[(within <= WITHIN) | (changes[:, 1] - changes[:, 0] <= AS_A_JUMP * steps)]


def longest_before(start: float, times: np.ndarray, t: float) -> float:
    """Return the longest of the steps of a run before a time, near it."""
    at = int(np.searchsorted(times, t))
    return float(np.diff(times[max(0, at - STEPS_BEFORE) : at + 1], prepend=start if at <= STEPS_BEFORE else []).max())


def together(changes: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Return changes of two tables, shapes (m, 3), in the order of time, those that overlap as one."""
    every = np.concatenate([changes, more])
    found: list[np.ndarray] = []
    for one in every[np.argsort(every[:, 0])]:
        if found and one[0] <= found[-1][1]:
            found[-1][1:] = np.maximum(found[-1][1:], one[1:])
        else:
            found.append(one.copy())
    return np.array(found).reshape(-1, 3)


class _Points:
    """Points that are added to those of a run, with steps and orders that grow from a restart on."""

    def __init__(self, start: float) -> None:
        self.last, self.size, self.grown, self.flag = start, np.inf, MAX_ORDER, 0
        self.found: list[tuple[float, int, int]] = []

    def towards(self, end: float, order: int, flag: int = 0) -> None:
        """Go to a point in steps that grow."""
        flag |= self.flag
        h, inner = end - self.last, np.array([end])
        if h > GROWTH * self.size:
            number = int(np.ceil(np.log1p((GROWTH - 1.0) * h / (GROWTH * self.size)) / np.log(GROWTH)))
            pieces = GROWTH ** np.arange(number, dtype=float)
            inner = np.append((self.last + h * np.cumsum(pieces) / pieces.sum())[:-1], end)
        growing = self.size < np.inf
        for k, t in enumerate(inner):
            self.grown = 1 if flag & AFRESH and k == 0 else min(self.grown + 1, MAX_ORDER)
            if inner.size > 1:
                self.grown = min(self.grown, GROWING_ORDER)
            one = flag & (AFRESH if k == 0 else 0) | flag & (END_OF_STEP if k == inner.size - 1 else 0)
            self.found.append((float(t), min(self.grown, max(order, GROWING_ORDER) if growing else order), one))
        self.size = float(inner[-1] - (inner[-2] if inner.size > 1 else self.last))
        if self.grown == MAX_ORDER:
            self.size = np.inf
        self.last, self.flag = end, 0

    def restart(self, end: float, size: float) -> None:
        """Start afresh at a point that has been added, with a step of about a size."""
        self.last, self.size, self.flag = end, size, AFRESH


def through_changes(
    start: float, times: np.ndarray, orders: np.ndarray, flags: np.ndarray, changes: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points of `points_of` with more of them through jumps and narrow changes.

    Parameters
    ----------
    start : float
        Where the run starts.
    times, orders, flags : ndarray, shape (m,)
    changes : ndarray, shape (c, 3)
        Begin and end of each in the order of time, and what else changes in it.
    """
    ends, ahead = times, []
    middles = changes[:, :2].mean(axis=1)
    gaps = np.diff(middles, prepend=-np.inf, append=np.inf)
    for k, (low, high, beside) in enumerate(changes):
        step = min(longest_before(start, ends, low), *gaps[k : k + 2])
        if high - low > AS_A_JUMP * step or beside > ALONE:
            ahead.append((float(low), float(high), 0.0))
            continue
        middle, short = 0.5 * (low + high), max(BEFORE * step, high - low)
        ahead.append((float(middle - short), float(middle + short), short))
        away = np.abs(times - middle) > max(AWAY * step, 3.0 * short)
        times, orders, flags = times[away], orders[away], flags[away]
    points = _Points(start)
    for t, order, flag in zip(map(float, times), map(int, orders), map(int, flags), strict=True):
        while ahead and ahead[0][0] < t:
            low, high, short = ahead.pop(0)
            if short > 0.0:
                for before in (low - short, low):
                    if before > points.last:
                        points.towards(before, order)
                points.found.append((high, MAX_ORDER, JUMP | AFRESH))
                points.restart(high, short)
                continue
            if low > points.last:
                points.towards(low, order)
            for k, one in enumerate(np.linspace(max(low, points.last), high, PIECES + 1)[1:]):
                points.found.append((float(one), min(k + 1, GROWING_ORDER), AFRESH if k == 0 else 0))
            points.restart(high, (high - low) / PIECES)
        if t > points.last:
            points.towards(t, order, flag)
        elif flag & END_OF_STEP:
            # within the change, one point more
            points.found.append((t, GROWING_ORDER, END_OF_STEP))
    points.found.sort(key=lambda one: one[0])
    columns = list(zip(*points.found, strict=True))
    return np.array(columns[0]), np.array(columns[1], dtype=np.int64), np.array(columns[2], dtype=np.int64)


def carried_on(
    evaluate: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], times: np.ndarray, flags: np.ndarray, at: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the numbers of the points about a jump, and the run there, carried on from the ends of steps before.

    Parameters
    ----------
    evaluate : callable
        The run, as `DenseOutput.evaluate`.
    times, flags : ndarray, shape (m,)
        Points of `through_changes`.
    at : int
        That of the jump.
    """
    last = max(0, at - 3)
    first = last
    while first > 0 and last - first < THROUGH - 1 and not flags[first] & AFRESH:
        first -= 1
    known = times[first : last + 1]
    places = np.arange(last + 1, at + 1)
    if known.size < 2:
        return places, *evaluate(times[places])
    y, yp = evaluate(known)
    weights = np.array(
        [
            [np.prod([(t - b) / (a - b) for b in known if b != a]) for a in known]
            for t in times[places]
        ]
    )  # fmt: skip
    return places, weights @ y, weights @ yp
