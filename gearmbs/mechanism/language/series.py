"""Values of an expression at many times."""

from __future__ import annotations

from gearmbs.dae.equations.expressions.evaluate import angle_rates, eval_request, update_angles
from gearmbs.kernels.jit import njit


@njit(
    "void(int64[::1], float64[::1], float64[::1], float64[:, :, ::1], float64[:, :, ::1], int64[::1],"
    " float64[:, ::1], float64[:, ::1], float64[:, ::1], float64[::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
)
def evaluate_series(ints, floats, t, kin, acc, marker_body, marker_frame, y, angles, grad, work, out):
    """Evaluate a tape at every time.

    Counted angles go on by the mean of their rates at both ends of an output step, to the nearest turn.
    ``angles`` is scratch: references, present and last rates, a row each.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : ndarray
        Times, s.
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
    angles : ndarray
        References of the counted angles, moved along.
    grad : ndarray
        Scratch of the size of the gradient.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    out : ndarray
        Receives the values.
    """
    ref, rates, last = angles[0], angles[1], angles[2]
    for k in range(t.size):
        angle_rates(ints, floats, t[k], kin[k], marker_body, marker_frame, y[k], ref, rates, grad, work)
        if k > 0:
            for a in range(ref.size):
                ref[a] += 0.5 * (rates[a] + last[a]) * (t[k] - t[k - 1])
        update_angles(ints, floats, t[k], kin[k], marker_body, marker_frame, y[k], ref, work)
        last[:] = rates
        out[k] = eval_request(ints, floats, t[k], kin[k], acc[k], marker_body, marker_frame, y[k], ref, work)
