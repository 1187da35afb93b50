"""Whether pulses of marks that recur with each turn are numbered as they do, for counts by intervals alone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

SHIFTED = 0.5
"""Part of the misfit as numbered that a turn has as numbered otherwise, from which it is numbered wrongly."""
CLEARLY = 3.0
"""How often the misfit of most turns a turn's must be to say so."""
UNLIKE = math.log(1.5)
"""Logarithm of the ratio of an interval to that of the same mark in other turns that no course of the speed makes."""
FEWEST_UNLIKE = 3
"""Such intervals, from which it is no single event."""
ENOUGH_TURNS = 4
"""Turns from which a median says what is usual."""
BESIDE = 4
"""Intervals on each side whose median, the marks' own pitches taken off, an interval is compared with."""
FURTHEST = 8
"""Marks by which a turn may be numbered wrongly to be known for that."""
STEADY_TURNS, BETWEEN = 3, 2
"""Turns before and behind a jump of the speed that must be alike, and those between at most, where marks are mended."""
JUMP_OVER_REST = 0.2
"""Part of a jump's logarithm by which the turns on either side may differ among themselves."""
NEAR_RATIO, COURSE = 0.015, 0.3
"""Logarithm by which the ratio of turns may be off that of the counts of marks, and the part of the turns' own
differences by which it may be off besides: speeds go on in no straight line."""
FEW_MARKS = 4
"""Marks up to which any may be lost or added; of more all the second, third or fourth ones."""


class Jump(NamedTuple):
    """Time (s) from which on turns take so many times as long, from one to the next."""

    time: float
    ratio: float

    def __str__(self) -> str:
        """Say it in words."""
        which = "are lost" if self.ratio > 1.0 else "come in addition"
        return (
            f"from {self.time:.6g} s on turns take {self.ratio:.3g} times as long as those before, as where marks "
            f"{which} in each of them"
        )


class Doubts(NamedTuple):
    """Turns that look like the others if numbered otherwise, unlike intervals within and at the ends, turns judged."""

    shifted: int
    unlike: int
    at_ends: int
    turns: int


def sudden_jump(numbers: np.ndarray, times: np.ndarray, lines: int) -> Jump | None:
    """Find where the speed jumps between turns and is steady before and behind, as the count of even marks does.

    Of two even marks of which one is lost from some turn on all intervals are alike again, twice as long: nothing but
    the jump tells.
    """
    every = np.arange(numbers[0], numbers[-1] + 1)
    when = np.interp(every, numbers, times)
    logs = np.log(when[lines:] - when[:-lines])
    found = [jump for between in range(BETWEEN + 1) if (jump := _jump(logs, lines, between)) is not None]
    if not found:
        return None
    _, at, ratio = min(found)
    return Jump(float(when[at]), ratio)


def _jump(logs: np.ndarray, lines: int, between: int) -> tuple[float, int, float] | None:
    """Return how far a jump is off one of marks, where it is and its ratio; logarithms are those of turns' times."""
    middle = np.arange(STEADY_TURNS * lines, logs.size - (STEADY_TURNS + between - 1) * lines)
    if not middle.size:
        return None
    before = np.stack([logs[middle - k * lines] for k in range(1, STEADY_TURNS + 1)])
    behind = np.stack([logs[middle + (between + k) * lines] for k in range(STEADY_TURNS)])
    # both in straight lines to the middle between them
    way, last = 0.5 * (between + 1), STEADY_TURNS - 1
    jump = behind[0] - before[0] - way * (before[0] - before[last] + behind[last] - behind[0]) / last
    rest = np.maximum(np.ptp(before, axis=0), np.ptp(behind, axis=0))
    off = np.abs(jump[:, None] - _ratios(lines)).min(axis=1)
    likely = (rest < JUMP_OVER_REST * np.abs(jump)) & (off < NEAR_RATIO + COURSE * rest)
    cost = np.where(likely, off + rest, np.inf)
    best = int(np.argmin(cost))
    return (float(cost[best]), int(middle[best]), math.exp(float(jump[best]))) if likely[best] else None


def _ratios(lines: int) -> np.ndarray:
    """Return logarithms of the ratios of turns as they are counted where marks are lost or added in each."""
    lost = [lines / k for k in range(1, lines) if lines <= FEW_MARKS or (lines % k == 0 and lines <= FEW_MARKS * k)]
    added = [k / lines for k in range(lines + 1, 2 * lines + 1) if lines <= FEW_MARKS or k == 2 * lines]
    return np.log(np.array([*lost, *(1.0 / ratio for ratio in added)]))


def doubtful_turns(numbers: np.ndarray, times: np.ndarray, lines: int) -> Doubts:
    """Judge whether turns recur as they are numbered.

    Marks recur with each turn: behind a pulse that was not missed the intervals are those of the next marks.
    """
    every = np.arange(numbers[0], numbers[-1] + 1)
    when = np.interp(every, numbers, times)
    steps = np.diff(when)
    count = steps.size // lines
    if lines < 2 or count < ENOUGH_TURNS or steps.size <= 2 * BESIDE:
        return Doubts(0, 0, 0, count)
    seen = np.isin(every, numbers)
    seen = seen[1:] & seen[:-1]
    sums = when[lines:] - when[:-lines]
    middle = np.clip(np.arange(steps.size) - lines // 2, 0, sums.size - 1)
    relative = np.log(steps * lines / sums[middle])
    table = np.where(seen, relative, np.nan)[: count * lines].reshape(count, lines)
    lacking = np.isnan(table).all(axis=0)
    pitches = np.zeros(lines)
    pitches[~lacking] = np.nanmedian(table[:, ~lacking], axis=0)
    off = np.where(np.isnan(table), 0.0, np.abs(table - pitches))
    own = off.mean(axis=1)
    usual = float(np.median(own))
    reach = min(FURTHEST, lines // 2)
    others = [
        np.where(np.isnan(table), 0.0, np.abs(table - np.roll(pitches, -s))).mean(axis=1)
        for s in range(-reach, reach + 1)
        if s % lines
    ]
    best = np.min(others, axis=0)
    wrong = (best < SHIFTED * own) & (own > CLEARLY * max(usual, 1e-3))
    beside = np.log(steps) - pitches[np.arange(steps.size) % lines]
    inside = slice(BESIDE, steps.size - BESIDE)
    level = np.median(np.lib.stride_tricks.sliding_window_view(beside, 2 * BESIDE + 1), axis=1)
    unlike = (np.abs(beside - np.pad(level, BESIDE, mode="edge")) > UNLIKE) & seen
    middle_ones = int(unlike[inside].sum())
    at_ends = int(unlike.sum()) - middle_ones
    return Doubts(int(wrong.sum()), middle_ones if middle_ones >= FEWEST_UNLIKE else 0, at_ends, count)
