"""First and second derivatives of position-level leaves in coordinates (R, theta) of each body.

They follow from `gearmbs.dae.equations.expressions.definitions` in the coordinates of body i (6), j (6) and k (3),
which may be one body, or the ground. The cosine of two axes is X . e for an X that is an axis of i and does not move.
"""

from __future__ import annotations

from gearmbs.dae.equations.expressions import derived as D
from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.measures import (
    ARM_I,
    ARM_J,
    AXIS,
    LEAF_WORK,
    VECTOR,
    marker_axis,
    relative_vector,
    resolve,
)
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, vector_at

OWN = 15
"""Coordinates of a leaf: R and theta of i, of j, theta of k."""
COLUMNS = LEAF_WORK
"""In the scratch: their columns among those of the tape, -1 for none."""
SLOPES = COLUMNS + OWN
"""Gradient by them, or (15, 15) second derivatives."""
SECOND_WORK = SLOPES + OWN * OWN


@njit(cache=True, error_model="numpy", forceinline=True)
def prepare_leaf(ints, at, kin, marker_body, marker_frame, w):
    """Write the vectors of a leaf and the columns of its coordinates; return the vectors and the rows of i, j and k.

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
    """
    i, slot_i, slot_j, slot_k, moves = ints[at + 1], ints[at + 6], ints[at + 7], ints[at + 9], True
    if ints[at] == op.COSINE:
        j, k, slot_k, slot_j, moves = -1, ints[at + 3], ints[at + 7], -1, False
        marker_axis(i, ints[at + 2], kin, marker_body, marker_frame, w, VECTOR)
        marker_axis(k, ints[at + 4], kin, marker_body, marker_frame, w, AXIS)
        for c in range(3):
            w[ARM_I + c], w[ARM_J + c] = w[VECTOR + c], 0.0
    else:
        j, k = ints[at + 2], ints[at + 4]
        relative_vector(op.DISPLACEMENT, i, j, op.GLOBAL, kin, kin, marker_body, marker_frame, w)
        resolve(k, ints[at + 5], kin, marker_body, marker_frame, w)
        slot_k = -1 if ints[at + 5] == op.MAGNITUDE else slot_k
    moved = slot_i if moves else -1
    for own, slot, first in ((0, moved, 0), (3, slot_i, 3), (6, slot_j, 0), (9, slot_j, 3), (12, slot_k, 3)):
        for c in range(3):
            w[COLUMNS + own + c] = 6.0 * slot + first + c if slot >= 0 else -1.0
    return (
        vector_at(w, ARM_I, 3),
        vector_at(w, ARM_J, 3),
        vector_at(w, VECTOR, 3),
        vector_at(w, AXIS, 3),
        kin[marker_body[i] if i >= 0 else 0],
        kin[marker_body[j] if j >= 0 else 0],
        kin[marker_body[k] if k >= 0 else 0],
    )


@njit(
    "void(int64[::1], int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[:, ::1], int64)",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def leaf_gradient(ints, at, kin, marker_body, marker_frame, w, rows, row):
    """Write the gradient of a leaf in (R, theta) to a row.

    Parameters
    ----------
    ints, at, kin, marker_body, marker_frame, w
        As of `prepare_leaf`.
    rows, row : ndarray, int
        Gradients of the leaves, and the row to write.
    """
    own = vector_at(w, SLOPES, OWN)
    arm_i, arm_j, x, e, one, two, three = prepare_leaf(ints, at, kin, marker_body, marker_frame, w)
    count = OWN
    if ints[at] != op.COSINE and ints[at + 5] == op.MAGNITUDE:
        count = OWN - 3
        D.length_slopes(arm_i, arm_j, x, one, two, own)
    else:
        D.along_slopes(arm_i, arm_j, x, e, one, two, three, own)
    for q in range(rows.shape[1]):
        rows[row, q] = 0.0
    if count < OWN and x[0] == x[1] == x[2] == 0.0:
        return
    for p in range(count):
        column = int(w[COLUMNS + p])
        if column >= 0:
            rows[row, column] += own[p]


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[:, ::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def leaf_hessian(ints, at, weight, kin, marker_body, marker_frame, w, hess):
    """Add a multiple of the Hessian of a leaf over R and theta.

    Parameters
    ----------
    ints, at, kin, marker_body, marker_frame, w
        As of `prepare_leaf`.
    weight : float
    hess : ndarray
        Hessian over R and theta of the bodies of the tape, and time.
    """
    own = matrix_at(w, SLOPES, OWN, OWN)
    own[:] = 0.0
    arm_i, arm_j, x, e, one, two, three = prepare_leaf(ints, at, kin, marker_body, marker_frame, w)
    if ints[at] != op.COSINE and ints[at + 5] == op.MAGNITUDE:
        if x[0] == x[1] == x[2] == 0.0:
            return
        D.length_curves(arm_i, arm_j, x, one, two, own)
    else:
        D.along_curves(arm_i, arm_j, x, e, one, two, three, own)
    for p in range(OWN):
        row = int(w[COLUMNS + p])
        if row < 0:
            continue
        hess[row, row] += weight * own[p, p]
        for q in range(p + 1, OWN):
            column = int(w[COLUMNS + q])
            if column >= 0 and own[p, q] != 0.0:
                hess[row, column] += weight * own[p, q]
                hess[column, row] += weight * own[p, q]
