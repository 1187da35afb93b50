"""First and second derivatives of position-level leaves in coordinates (R, theta) of each body.

The Euler axes a_k, in global components, carry everything (see the rotation module): a vector s fixed in the body has
ds/dtheta_k = a_k x s and d2s/dtheta_k dtheta_l = a_min x (a_max x s). A leaf is a product X . e of two such vectors (or
the length of one), so its Hessian is e_ab . X + e_a . X_b + e_b . X_a + e . X_ab.
"""

from __future__ import annotations

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.measures import (
    ARM_I,
    ARM_J,
    AXIS,
    VECTOR,
    marker_axis,
    relative_vector,
    resolve,
)
from gearmbs.dae.equations.expressions.opcodes import KIN_AXES
from gearmbs.kernels.jit import njit


@njit("void(float64[:, ::1], int64, int64, float64[::1], int64, int64)", cache=True, nogil=True)
def _turn(kin, body, k, w, at, out):
    """Write a_k x w[at] to w[out]."""
    n = KIN_AXES + 3 * k
    ax, ay, az = kin[body, n], kin[body, n + 1], kin[body, n + 2]
    x, y, z = w[at], w[at + 1], w[at + 2]
    w[out] = ay * z - az * y
    w[out + 1] = az * x - ax * z
    w[out + 2] = ax * y - ay * x


@njit(
    "void(int64, int64, float64, float64[:, ::1], float64[::1], int64, int64, int64, int64)",
    cache=True,
    nogil=True,
)
def _add_columns(slot, body, sign, kin, w, arm, translate, jac, n):
    """Add d(vector)/dq to the 3 x n block at ``w[jac]``: the identity on R (a point) and turns on theta.

    Parameters
    ----------
    slot : int
        Number of the body in the list of the tape.
    body : int
        Number of the body.
    sign : float
        Factor.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    arm : int
        Offset of the arm in ``w``.
    translate : bool
        Whether the vector ends at a point that moves with R; axes only turn.
    jac : int
        Offset of the block in ``w``.
    n : int
        Its columns.
    """
    if slot < 0:
        return
    first = 6 * slot
    if translate != 0:
        for c in range(3):
            w[jac + n * c + first + c] += sign
    for k in range(3):
        _turn(kin, body, k, w, arm, jac - 6)
        for c in range(3):
            w[jac + n * c + first + 3 + k] += sign * w[jac - 6 + c]


@njit(
    "void(int64, int64, float64, float64[:, ::1], float64[::1], int64, int64, int64, float64[:, ::1])",
    cache=True,
    nogil=True,
)
def _add_second(slot, body, weight, kin, w, arm, along, tmp, hess):
    """Add weight * w[along] . d2 w[arm]/dtheta2 to the Hessian.

    Parameters
    ----------
    slot : int
        Number of the body in the list of the tape.
    body : int
        Number of the body.
    weight : float
        Factor.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    arm : int
        Offset of the arm in ``w``.
    along : int
        Offset of the vector it is multiplied with.
    tmp : int
        Offset of free scratch.
    hess : ndarray
        Receives the Hessian over R and theta of the bodies of the tape, and time, row by row.
    """
    if slot < 0:
        return
    first = 6 * slot + 3
    for l in range(3):
        _turn(kin, body, l, w, arm, tmp)
        for k in range(l + 1):
            _turn(kin, body, k, w, tmp, tmp + 3)
            v = weight * (w[along] * w[tmp + 3] + w[along + 1] * w[tmp + 4] + w[along + 2] * w[tmp + 5])
            hess[first + k, first + l] += v
            if k != l:
                hess[first + l, first + k] += v


@njit(
    "void(int64, int64, float64[:, ::1], float64[::1], int64, int64, int64, int64)",
    cache=True,
    nogil=True,
)
def _shifted_columns(slot, body, kin, w, arm, jac, block, n):
    """Add the turns of an axis to the block at ``block``; ``jac - 6`` is free scratch.

    Parameters
    ----------
    slot : int
        Number of the body in the list of the tape.
    body : int
        Number of the body.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    arm : int
        Offset of the axis in ``w``.
    jac : int
        Offset of the Jacobian blocks in ``w``.
    block : int
        Offset of the block that is added to.
    n : int
        Its columns.
    """
    if slot < 0:
        return
    first = 6 * slot + 3
    for k in range(3):
        _turn(kin, body, k, w, arm, jac - 6)
        for c in range(3):
            w[block + n * c + first + k] += w[jac - 6 + c]


@njit(
    "float64(int64[::1], int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], int64, int64)",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def leaf_jacobians(ints, at, kin, marker_body, marker_frame, w, jac, n):
    """Fill the blocks dX/dq and de/dq (3 x n each, at ``jac``) of a leaf and return its value.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    at : int
        Offset of the leaf in ``ints``.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    jac : int
        Offset of the blocks in ``w``.
    n : int
        Their columns.
    """
    for c in range(6 * n):
        w[jac + c] = 0.0
    second = jac + 3 * n
    if ints[at] == op.COSINE:
        i, a, j, b = ints[at + 1], ints[at + 2], ints[at + 3], ints[at + 4]
        marker_axis(i, a, kin, marker_body, marker_frame, w, AXIS)
        marker_axis(j, b, kin, marker_body, marker_frame, w, VECTOR)
        _add_columns(ints[at + 7], marker_body[j] if j >= 0 else 0, 1.0, kin, w, VECTOR, 0, jac, n)
        if i >= 0:
            _shifted_columns(ints[at + 6], marker_body[i], kin, w, AXIS, jac, second, n)
        return w[AXIS] * w[VECTOR] + w[AXIS + 1] * w[VECTOR + 1] + w[AXIS + 2] * w[VECTOR + 2]
    i, j, k, axis = ints[at + 1], ints[at + 2], ints[at + 4], ints[at + 5]
    relative_vector(op.DISPLACEMENT, i, j, op.GLOBAL, kin, kin, marker_body, marker_frame, w)
    f = resolve(k, axis, kin, marker_body, marker_frame, w)
    _add_columns(ints[at + 6], marker_body[i] if i >= 0 else 0, 1.0, kin, w, ARM_I, 1, jac, n)
    _add_columns(ints[at + 7], marker_body[j] if j >= 0 else 0, -1.0, kin, w, ARM_J, 1, jac, n)
    if axis != op.MAGNITUDE and k >= 0:
        _shifted_columns(ints[at + 9], marker_body[k], kin, w, AXIS, jac, second, n)
    return f


@njit(
    "void(int64[::1], int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], int64, int64,"
    " float64[:, ::1], int64)",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def leaf_gradient(ints, at, kin, marker_body, marker_frame, w, jac, n, rows, row):
    """Write the gradient of a leaf in (R, theta) to ``rows[row]``; its Jacobian blocks stand at ``jac``.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    at : int
        Offset of the leaf in ``ints``.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    jac : int
        Offset of the blocks in ``w``.
    n : int
        Their columns.
    rows : ndarray
        Gradients of the leaves, one a row.
    row : int
        The row to write.
    """
    for q in range(n):
        g = 0.0
        for c in range(3):
            g += w[AXIS + c] * w[jac + n * c + q] + w[VECTOR + c] * w[jac + n * (3 + c) + q]
        rows[row, q] = g


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], int64, int64,"
    " float64[:, ::1], int64, float64[:, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def leaf_hessian(ints, at, weight, kin, marker_body, marker_frame, w, jac, n, rows, row, hess):
    """Add ``weight`` times the Hessian of a position-level leaf to ``hess``.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    at : int
        Offset of the leaf in ``ints``.
    weight : float
        Factor.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    jac : int
        Offset of the blocks in ``w``.
    n : int
        Their columns.
    rows : ndarray
        Gradients of the leaves, one a row.
    row : int
        That of this leaf.
    hess : ndarray
        Receives the Hessian over R and theta of the bodies of the tape, and time, row by row.
    """
    f = leaf_jacobians(ints, at, kin, marker_body, marker_frame, w, jac, n)
    tmp = jac - 6
    if ints[at] == op.COSINE:
        i, j = ints[at + 1], ints[at + 3]
        _add_second(ints[at + 6], marker_body[i] if i >= 0 else 0, weight, kin, w, AXIS, VECTOR, tmp, hess)
        _add_second(ints[at + 7], marker_body[j] if j >= 0 else 0, weight, kin, w, VECTOR, AXIS, tmp, hess)
    else:
        i, j, k, axis = ints[at + 1], ints[at + 2], ints[at + 4], ints[at + 5]
        _add_second(ints[at + 6], marker_body[i] if i >= 0 else 0, weight, kin, w, ARM_I, AXIS, tmp, hess)
        _add_second(ints[at + 7], marker_body[j] if j >= 0 else 0, -weight, kin, w, ARM_J, AXIS, tmp, hess)
        if axis == op.MAGNITUDE:
            if f <= 0.0:
                return
            for p in range(n):
                for q in range(n):
                    s = -rows[row, p] * rows[row, q]
                    for c in range(3):
                        s += w[jac + n * c + p] * w[jac + n * c + q]
                    hess[p, q] += weight * s / f
            return
        _add_second(ints[at + 9], marker_body[k] if k >= 0 else 0, weight, kin, w, AXIS, VECTOR, tmp, hess)
    for p in range(n):
        for q in range(n):
            s = 0.0
            for c in range(3):
                s += w[jac + n * c + p] * w[jac + n * (3 + c) + q] + w[jac + n * c + q] * w[jac + n * (3 + c) + p]
            hess[p, q] += weight * s
