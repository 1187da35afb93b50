"""Edges of a tacho that are not what they seem: at the ends of a record, and scattered by noise.

At an end of the record the intervals of one side alone tell how long the others should be: what does not fit is left
out with the pulses beyond it, for nobody knows whether it is a pulse more, one less, or the speed.

Edges of a slow slope (a sine, a magnet's bump) or of a reflector that flutters come now before, now behind their marks.
That is white from edge to edge, where the speed of a shaft that has inertia is smooth. So third differences of the
times of one mark, turn by turn, tell how much edges scatter, and the smoothest course is taken that the scatter allows.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg
import scipy.stats

STEADY = math.log(1.2)
"""Spread of the logarithms of the intervals beside an end up to which they tell of it: beside a start from rest they do
not."""
UNLIKE = math.log(1.4)
"""An interval at an end that differs more than this from the course of those beside it is left out; half of a doubled
one is log 2."""
REACH = 3
"""Intervals at an end that are looked at: a pulse too many makes two of one."""
FEWEST_BESIDE, MOST_BESIDE = 4, 6
"""Intervals behind these from which the course is taken."""
REST, CLEAR = 0.02, 5.0
"""Logarithm, and times the residual of the course, by which the next interval is also left out, of which a pulse too
many has taken a part."""
FEWEST_TURNS = 16
"""Turns from which scatter is told from the speed."""
ORDER = 3
"""Of the differences that are to be small: of a speed that changes evenly these vanish."""
SMOOTHEST, ROUGHEST, TRIED = 0.02, 2.5, 40
"""Angular frequencies per pulse between which the cut of the smoothed course lies, and how many are tried: waves of 300
pulses, and of hardly more than two."""


def sure_ends(edges: np.ndarray, numbers: np.ndarray) -> tuple[int, int]:
    """Return how many edges to leave out at the beginning and at the end of a train.

    Parameters
    ----------
    edges : ndarray of shape (n,)
        Times of the pulses, s, increasing.
    numbers : ndarray of shape (n,)
        Which they are, in pitches.
    """
    logs = np.log(np.maximum(np.diff(edges), 1e-300) / np.diff(numbers))
    return _unsure(logs), _unsure(logs[::-1])


def _unsure(logs: np.ndarray) -> int:
    """Return how many intervals at the beginning do not go on as those behind them go."""
    behind = logs[REACH : REACH + MOST_BESIDE]
    if behind.size < FEWEST_BESIDE or np.ptp(behind) > STEADY:
        return 0
    place = np.arange(REACH, REACH + behind.size)
    line = np.polynomial.Polynomial.fit(place, behind, 1)
    own = float(np.abs(behind - line(place)).max())
    off = np.abs(logs[:REACH] - line(np.arange(REACH)))
    unlike = np.flatnonzero(off > max(UNLIKE, CLEAR * own))
    if not unlike.size:
        return 0
    count = int(unlike[-1]) + 1
    # what is left of an interval of which a pulse too many has taken a part
    return count + int(count < REACH and off[count] > max(REST, CLEAR * own))


def edge_scatter(edges: np.ndarray, numbers: np.ndarray, pulses_per_rev: float) -> float:
    """Return by how much edges scatter, robust standard deviation in rad of the shaft; 0 of too few turns.

    Edges of a mark are compared with those of the same mark in other turns, so that uneven marks do not count.
    """
    each = round(pulses_per_rev) if pulses_per_rev >= 1.0 else 1
    every = np.arange(numbers[0], numbers[-1] + 1)
    when = np.full(every.size, np.nan)
    when[np.rint(numbers - numbers[0]).astype(int)] = edges
    turns = np.stack([when[k * each : when.size - (ORDER - k) * each] for k in range(ORDER + 1)])
    if when.size < (FEWEST_TURNS + ORDER) * each:
        return 0.0
    third = turns[3] - 3.0 * turns[2] + 3.0 * turns[1] - turns[0]
    # each of its own speed, rad/s
    third *= math.tau * each / pulses_per_rev / (turns[2] - turns[1])
    third = third[np.isfinite(third)]
    if third.size < FEWEST_TURNS:
        return 0.0
    return float(scipy.stats.median_abs_deviation(third, scale="normal")) / math.sqrt(math.comb(2 * ORDER, ORDER))


def smoothed_edges(
    edges: np.ndarray, numbers: np.ndarray, pulses_per_rev: float, scatter: float
) -> tuple[np.ndarray, float]:
    """Return times of all pulses on the smoothest course that their scatter allows, and the scatter left, rad.

    The squares of third differences are weighed against those of what is taken off; of the weights that with the least
    expected error is taken (Mallows' Cp), the scatter being known.

    Parameters
    ----------
    edges, numbers : ndarray of shape (n,)
        Times, s, and which they are.
    pulses_per_rev : float
    scatter : float
        rad, as `edge_scatter` finds it.

    Returns
    -------
    times : ndarray of shape (numbers[-1] - numbers[0] + 1,)
        Also of the pulses that are missing.
    left : float

    References
    ----------
    .. [1] P. H. C. Eilers, A perfect smoother, Analytical Chemistry 75 (2003) 3631-3636.
    """
    place = np.rint(numbers - numbers[0]).astype(int)
    count = int(place[-1]) + 1
    # about the mean speed, so that little is lost to rounding
    pitch = float(edges[-1] - edges[0]) / (count - 1)
    off = np.zeros(count)
    off[place] = edges - edges[0] - pitch * place
    seen = np.zeros(count)
    seen[place] = 1.0
    noise = scatter / math.tau * pulses_per_rev * pitch
    wave = np.linspace(0.0, math.pi, 2048)
    stiff = (2.0 * np.sin(0.5 * wave)) ** (2 * ORDER)
    best: tuple[float, np.ndarray, float] | None = None
    for cut in np.geomspace(SMOOTHEST, ROUGHEST, TRIED):
        weight = (2.0 * math.sin(0.5 * cut)) ** (-2 * ORDER)
        course = _whittaker(off, seen, weight)
        passed = 1.0 / (1.0 + weight * stiff)
        error = float(np.sum(seen * (course - off) ** 2)) + 2.0 * noise**2 * seen.sum() * float(passed.mean())
        if best is None or error < best[0]:
            best = error, course, scatter * math.sqrt(float(np.mean(passed**2)))
    assert best is not None
    return edges[0] + pitch * np.arange(count) + best[1], best[2]


def _whittaker(values: np.ndarray, seen: np.ndarray, weight: float) -> np.ndarray:
    """Return the course that is least in its weighted squared third differences and its distance from what is seen."""
    steps = np.array([-1.0, 3.0, -3.0, 1.0])
    band = np.zeros((ORDER + 1, values.size))
    for a in range(ORDER + 1):
        for b in range(a, ORDER + 1):
            # row b - a below the diagonal, at the column of a
            band[b - a, a : values.size - ORDER + a] += steps[a] * steps[b]
    band *= weight
    band[0] += seen
    return scipy.linalg.solveh_banded(band, seen * values, lower=True)
