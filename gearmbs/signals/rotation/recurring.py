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


class Doubts(NamedTuple):
    """Turns that look like the others if numbered otherwise, unlike intervals within and at the ends, turns judged."""

    shifted: int
    unlike: int
    at_ends: int
    turns: int


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
