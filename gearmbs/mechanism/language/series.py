"""Values of an expression at many times."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gearmbs.dae.equations.expressions.evaluate import angle_rates, eval_request, update_angles
from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.dae.results.frames import warn_of_doubtful_turns
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64, void

_VEC, _MAT, _CUBE = float64[::1], float64[:, ::1], float64[:, :, ::1]
_INTS, _MASK = int64[::1], boolean[::1]


@njit(
    void(_INTS, _VEC, _VEC, _MASK, _CUBE, _CUBE, _INTS, _MAT, _MAT, _CUBE, _MAT, _VEC, _VEC, _VEC),
    cache=True,
    nogil=True,
)
def evaluate_series(ints, floats, t, jumps, kin, acc, marker_body, marker_frame, y, angles, known, grad, work, out):
    """Evaluate a tape at every time.

    Counted angles are those nearest to what is known of them; others go on by the mean of their rates at both ends of
    an output step, to the nearest turn.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : ndarray
        Times, s.
    jumps : ndarray of bool
        Where velocities jump: those at hand are the ones before.
    kin : ndarray, shape (times, bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    acc : ndarray, shape (times, bodies, 6)
        Accelerations a and alpha of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray, shape (times, unknowns)
        Unknowns.
    angles : ndarray, shape (2, times, counted angles)
        Receives the counted angles and their rates; in its first row, the first angle comes near the given one.
    known : ndarray, shape (counted angles, times)
        Counted angles less than half a turn off, as the run has counted them; NaN where it has not.
    grad : ndarray
        Scratch of the size of the gradient.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    out : ndarray
        Receives the values.
    """
    for k in range(t.size):
        ref, rates = angles[0, k], angles[1, k]
        if k > 0:
            ref[:] = angles[0, k - 1]
        angle_rates(ints, floats, t[k], kin[k], marker_body, marker_frame, y[k], ref, rates, grad, work)
        if k > 0:
            for a in range(ref.size):
                before = rates[a] if jumps[k - 1] else angles[1, k - 1, a]
                ref[a] += 0.5 * (rates[a] + before) * (t[k] - t[k - 1])
        for a in range(known.shape[0]):
            if not np.isnan(known[a, k]):
                ref[a] = known[a, k]
        update_angles(ints, floats, t[k], kin[k], marker_body, marker_frame, y[k], ref, work)
        out[k] = eval_request(ints, floats, t[k], kin[k], acc[k], marker_body, marker_frame, y[k], ref, work)


def expression_values(
    tape: Tape,
    starts: Sequence[float] | np.ndarray,
    known: Sequence[np.ndarray],
    t: np.ndarray,
    jumps: np.ndarray,
    kin: np.ndarray,
    acc: np.ndarray,
    marker_body: np.ndarray,
    marker_frame: np.ndarray,
    y: np.ndarray,
    marker_named: Callable[[int], str],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the values of a tape at every time, and its angles at the last; warn where they may be full turns off.

    Parameters
    ----------
    tape : Tape
    starts : sequence of float
        Near which its counted angles start, rad.
    known : sequence of ndarray, shape (times,)
        What the run has counted of each, see `gearmbs.dae.results.frames.known_turns`.
    t, jumps, kin, acc, marker_body, marker_frame, y : ndarray
        As of `evaluate_series`.
    marker_named : callable
        Name of a marker by its index.

    Returns
    -------
    values : ndarray, shape (times,)
    ends : ndarray, shape (counted angles,)
        rad.
    """
    angles = np.zeros((2, t.size, max(1, tape.n_angles)))
    angles[0, :1, : tape.n_angles] = starts
    known_angles, out = np.array(known).reshape(len(known), t.size), np.zeros(t.size)
    evaluate_series(
        tape.ints, tape.floats, t, jumps, kin, acc, marker_body, marker_frame, y, angles, known_angles,
        np.zeros(max(1, tape.gradient_size)),
        np.zeros(tape.work_size), out,
    )  # fmt: skip
    for k, (function, i, j) in enumerate(tape.angles):
        if not np.isnan(known_angles[k]).any():
            continue
        label = f"{function}({marker_named(i)}, {marker_named(j)})"
        warn_of_doubtful_turns(t, angles[0, :, k], angles[1, :, k], jumps, label)
    return out, angles[0, -1, : tape.n_angles].copy()
