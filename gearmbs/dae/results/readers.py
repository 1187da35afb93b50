"""What a record reads of a run's own steps, compiled: sums of unknowns, forces inside groups, matrices of rotation.

Each kind of reader has whole numbers, `places`, and others, `numbers`. Results are stored each component on end, so
that who takes them by components, as filters do, finds them in one piece.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.rotation import matrix_of, put_turns
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, void
from gearmbs.kernels.lanes import LANES

SUM, INSIDE, ABOUT_AXIS, EULER = range(4)
"""Kinds of readers: multiples of unknowns, see `_sum`; `_inside`; `_about_axis`; `_euler`."""


@njit(cache=True, error_model="numpy")
def _sum(y, places, numbers, out):
    """Add numbers times unknowns: places are the component and the unknown of each term.

    Step by step: what is read of one stands together in memory, and the steps far apart.
    """
    out[:] = 0.0
    for k in range(y.shape[0]):
        for term in range(numbers.size):
            out[places[2 * term], k] += numbers[term] * y[k, places[2 * term + 1]]


@njit(cache=True, error_model="numpy")
def _inside(y, left, places, numbers, out):
    """Write the force that keeps the members beyond a joint: what moves them, less the loads on them, at y.

    Places are the columns of a load's force at y_m, of its derivatives by the unknowns, a row of the matrix after the
    other, and of y_m; numbers the sense of the result, the members' weight and the sense of each load.
    """
    side, n = numbers[0], y.shape[1]
    for k in range(y.shape[0]):
        for c in range(3):
            force = numbers[1 + c]
            for load in range(numbers.size - 4):
                wrench, slopes, seen = places[3 * load], places[3 * load + 1], places[3 * load + 2]
                told = left[k, wrench + c]
                for i in range(n):
                    told += left[k, slopes + n * c + i] * (y[k, i] - left[k, seen + i])
                force -= numbers[4 + load] * told
            out[c, k] = side * force


@njit(cache=True, error_model="numpy")
def _about_axis(y, left, places, numbers, out):
    """Write a + b cos(phi) + c sin(phi), phi = sense (x - shift); x is an unknown, or behind them a watched number."""
    n = y.shape[1]
    sense, shift = numbers[0], numbers[1]
    for k in range(y.shape[0]):
        phi = sense * ((y[k, places[0]] if places[0] < n else left[k, places[0] - n]) - shift)
        cosine, sine = np.cos(phi), np.sin(phi)
        for e in range(9):
            out[e, k] = numbers[2 + e] + numbers[11 + e] * cosine + numbers[20 + e] * sine


@njit(cache=True, error_model="numpy")
def _euler(y, places, out):
    """Write the matrix of the three angles from unknown ``places[0]`` on, whose reference code is ``places[1]``.

    Sines and cosines of two steps are found at a time.
    """
    first, code, last = places[0], places[1], y.shape[0] - 1
    angles, turned, matrix = np.empty(6), np.empty(2 * LANES), np.empty(9)
    for k in range(0, y.shape[0], 2):
        for c in range(3):
            angles[c], angles[3 + c] = y[k, first + c], y[min(k + 1, last), first + c]
        put_turns(angles, 0, 3, turned)
        for step in range(k, min(k + 2, y.shape[0])):
            at = 3 * (step - k)
            psi, theta = (turned[LANES + at], turned[at]), (turned[LANES + at + 1], turned[at + 1])
            matrix_of(psi, theta, (turned[LANES + at + 2], turned[at + 2]), code, matrix, 0)
            for e in range(9):
                out[e, step] = matrix[e]


@njit(
    void(int64, float64[:, :], float64[:, :], int64[::1], float64[::1], float64[:, ::1]),
    cache=True,
    error_model="numpy",
    nogil=True,
)
def read(kind, y, left, places, numbers, out):
    """Write what a reader of some kind reads at each of some steps.

    Parameters
    ----------
    kind : int
        One of `SUM`, `INSIDE`, `ABOUT_AXIS` and `EULER`.
    y : ndarray, shape (m, n)
        Unknowns.
    left : ndarray, shape (m, w)
        Watched numbers.
    places, numbers : ndarray
        Of the reader.
    out : ndarray, shape (components, m)
    """
    if kind == SUM:
        _sum(y, places, numbers, out)
    elif kind == INSIDE:
        _inside(y, left, places, numbers, out)
    elif kind == ABOUT_AXIS:
        _about_axis(y, left, places, numbers, out)
    else:
        _euler(y, places, out)
