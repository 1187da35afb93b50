"""What a column is by the shape of its values, whatever it is called: steps between two levels, angles, counts.

Vibration passes through all values between its ends, to and fro. The pulses of a tacho or of an encoder stand at one of
two levels; the angle of a shaft and the count of an encoder rise throughout, or from their least to their largest value
again and again.
"""

from __future__ import annotations

import numpy as np

FEWEST = 16
"""Samples that show a shape."""
LEVEL = 0.1
"""Part of the range to either side of a level within which samples are at it: converters and cables ring by less."""
AT_LEVELS = 0.7
"""Share of the samples of either half of the range that are at its level: of half waves of a sine 0.43 are."""
APART = 0.7
"""Part of the range by which the levels are apart, at least: a vibration that decays is mostly near its middle."""
PER_EDGE = 3.0
"""Samples between the levels for each edge, at most: pulses of a slope of more are bumps."""
FEWEST_PULSES = 3
FEWEST_WIDE = 2
"""Samples of a pulse, where there are more than two values: single ones are blows."""
FALLS = 0.2
"""Share of the steps of a sawtooth that may fall: five samples a turn."""
WHOLE_FALL = 0.5
"""Part of the range by which each fall of a sawtooth goes down, at least: with few samples a turn it ends beside its
top."""
STILL = 0.999
"""Share of the steps that may be none: a counter of turns stands still meanwhile."""

FAR, NEAR = 300.0, 30.0
"""Standard deviations, robust, from which a sample is far off, and within which those beside it must be."""
MOST_FAR, LONGEST_FAR = 1e-3, 3
"""Share of a record that may be far off, and samples in a row: more are something that happened."""


NOT_A_NUMBER = (9.91e37, 9.9e37)
"""What instruments write for not a number and for infinite (IEEE 488.2)."""


def is_missing(values: np.ndarray) -> np.ndarray:
    """Return which samples are none: not finite, or what instruments write for that."""
    size = np.abs(values)
    return ~(size < 9.8e37) & (~np.isfinite(size) | np.isclose(size[..., None], NOT_A_NUMBER, 1e-6).any(axis=-1))


def steps_between_two_levels(values: np.ndarray) -> bool:
    """Return whether a column stands at one of two levels, as pulses do."""
    if values.size < FEWEST or not np.isfinite(values).all():
        return False
    low, high = float(values.min()), float(values.max())
    span = high - low
    if not span > 0.0:
        return False
    upper = values > low + 0.5 * span
    edges = np.flatnonzero(np.diff(upper.astype(np.int8)))
    rising = int(np.count_nonzero(upper[1:] & ~upper[:-1]))
    if rising < FEWEST_PULSES:
        return False
    off = 0
    if float(np.median(values[upper]) - np.median(values[~upper])) < APART * span:
        return False
    for half in (upper, ~upper):
        own = values[half]
        away = np.abs(own - np.median(own)) > LEVEL * span
        if away.mean() > 1.0 - AT_LEVELS:
            return False
        off += int(away.sum())
    if off > PER_EDGE * edges.size:
        return False
    whole = bool(np.all((values == low) | (values == high)))
    widths = np.diff(edges)
    return whole or min(float(np.median(widths[k::2])) for k in (0, 1)) >= FEWEST_WIDE


def goes_on(values: np.ndarray) -> bool:
    """Return whether a column rises throughout, or falls, or does so from end to end again and again."""
    if values.size < FEWEST or not np.isfinite(values).all() or values[0] == values[-1] == values.max():
        return False
    return _rises(values) or _rises(-values)


def _rises(values: np.ndarray) -> bool:
    steps = np.diff(values)
    span = float(np.ptp(values))
    down = steps < 0.0
    up = int(np.count_nonzero(steps > 0.0))
    if not span > 0.0:
        return False
    if not down.any() and np.array_equal(values, np.rint(values)):
        return True
    if up < max(2, (1.0 - STILL) * steps.size):
        return False
    falls = int(down.sum())
    return falls <= FALLS * up and bool(np.all(steps[down] <= -WHOLE_FALL * span)) and up > 2 * falls


def alone_far_off(values: np.ndarray) -> tuple[int, int, float] | None:
    """Return where the first sample stands that is none, as -9999 of a logger, how many do, and how far off; or None.

    What is hundreds of standard deviations off, with others beside it that are not, is no vibration: a shock rings.
    """
    middle = float(np.median(values))
    off = np.abs(values - middle)
    scatter = 1.4826 * float(np.median(off))
    far = off > FAR * scatter
    count = int(far.sum())
    if not scatter > 0.0 or not 0 < count <= max(1.0, MOST_FAR * values.size):
        return None
    at = np.flatnonzero(far)
    beside = np.concatenate((at - 1, at + 1))
    beside = beside[(beside >= 0) & (beside < values.size)]
    beside = beside[~far[beside]]
    if not beside.size or off[beside].max() > NEAR * scatter or _longest(far) > LONGEST_FAR:
        return None
    return int(at[0]), count, float(off[at[0]] / scatter)


def _longest(flags: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return int((edges[1::2] - edges[::2]).max(initial=0))
