"""Derivatives of the vector leaves with respect to the spatial variations of the bodies."""

from __future__ import annotations

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.measures import (
    ARM_I,
    ARM_J,
    AXIS,
    OTHER,
    VECTOR,
    euler_parameter,
    marker_axis,
    radial_velocity,
    relative_vector,
    resolve,
)
from gearmbs.dae.equations.expressions.opcodes import KIN_W
from gearmbs.kernels.jit import njit


@njit("void(int64, float64, float64, float64, float64[::1], int64, float64[::1])", cache=True, nogil=True)
def _point_weight(slot, gx, gy, gz, w, arm, grad):
    """Add the gradient of g . r for a point at arm s: g on dR, s x g on dpi."""
    if slot < 0:
        return
    k = 12 * slot
    sx, sy, sz = w[arm], w[arm + 1], w[arm + 2]
    grad[k] += gx
    grad[k + 1] += gy
    grad[k + 2] += gz
    grad[k + 3] += sy * gz - sz * gy
    grad[k + 4] += sz * gx - sx * gz
    grad[k + 5] += sx * gy - sy * gx


@njit(
    "void(int64, int64, float64, float64, float64, float64[:, ::1], float64[::1], int64, float64[::1])",
    cache=True,
    nogil=True,
)
def _velocity_weight(slot, body, gx, gy, gz, kin, w, arm, grad):
    """Add the gradient of g . v for a point at arm s: g on dv, s x g on dw, s x (g x w) on dpi.

    Parameters
    ----------
    slot : int
        Number of the body in the list of the tape.
    body : int
        Number of the body.
    gx, gy, gz : float
        Vector g.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    arm : int
        Offset of the arm s in ``w``.
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    if slot < 0:
        return
    k = 12 * slot
    sx, sy, sz = w[arm], w[arm + 1], w[arm + 2]
    grad[k + 6] += gx
    grad[k + 7] += gy
    grad[k + 8] += gz
    grad[k + 9] += sy * gz - sz * gy
    grad[k + 10] += sz * gx - sx * gz
    grad[k + 11] += sx * gy - sy * gx
    wx, wy, wz = kin[body, KIN_W], kin[body, KIN_W + 1], kin[body, KIN_W + 2]
    hx, hy, hz = gy * wz - gz * wy, gz * wx - gx * wz, gx * wy - gy * wx
    grad[k + 3] += sy * hz - sz * hy
    grad[k + 4] += sz * hx - sx * hz
    grad[k + 5] += sx * hy - sy * hx


@njit("void(int64, float64, float64[::1], int64, int64, float64[::1])", cache=True, nogil=True)
def _axis_weight(slot, weight, w, axis, vector, grad):
    """Add the gradient of X . e for a turning axis e: dpi . (e x X)."""
    if slot < 0:
        return
    k = 12 * slot + 3
    grad[k] += weight * (w[axis + 1] * w[vector + 2] - w[axis + 2] * w[vector + 1])
    grad[k + 1] += weight * (w[axis + 2] * w[vector] - w[axis] * w[vector + 2])
    grad[k + 2] += weight * (w[axis] * w[vector + 1] - w[axis + 1] * w[vector])


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def vector_gradient(ints, at, weight, kin, marker_body, marker_frame, w, grad):
    """Add ``weight`` times the gradient of the vector leaf at instruction offset ``at`` to ``grad``.

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
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    code, i, j, l, k, axis = ints[at], ints[at + 1], ints[at + 2], ints[at + 3], ints[at + 4], ints[at + 5]
    slot_i, slot_j, slot_l, slot_k = ints[at + 6], ints[at + 7], ints[at + 8], ints[at + 9]
    relative_vector(code, i, j, l, kin, kin, marker_body, marker_frame, w)
    resolve(k, axis, kin, marker_body, marker_frame, w)
    gx, gy, gz = weight * w[AXIS], weight * w[AXIS + 1], weight * w[AXIS + 2]
    if axis != op.MAGNITUDE:
        _axis_weight(slot_k, weight, w, AXIS, VECTOR, grad)
    if code == op.ANGULAR_VELOCITY:
        if slot_i >= 0:
            grad[12 * slot_i + 9] += gx
            grad[12 * slot_i + 10] += gy
            grad[12 * slot_i + 11] += gz
        if slot_j >= 0:
            grad[12 * slot_j + 9] -= gx
            grad[12 * slot_j + 10] -= gy
            grad[12 * slot_j + 11] -= gz
        return
    if code == op.DISPLACEMENT:
        _point_weight(slot_i, gx, gy, gz, w, ARM_I, grad)
        _point_weight(slot_j, -gx, -gy, -gz, w, ARM_J, grad)
        return
    body_i = marker_body[i] if i >= 0 else 0
    body_j = marker_body[j] if j >= 0 else 0
    _velocity_weight(slot_i, body_i, gx, gy, gz, kin, w, ARM_I, grad)
    _velocity_weight(slot_j, body_j, -gx, -gy, -gz, kin, w, ARM_J, grad)
    if l >= 0:
        # the term -e . (w_l x r): weight w_l x e ... on r, r turned by e on dw_l; r stands at OTHER
        b = marker_body[l]
        wx, wy, wz = kin[b, KIN_W], kin[b, KIN_W + 1], kin[b, KIN_W + 2]
        hx, hy, hz = wy * gz - wz * gy, wz * gx - wx * gz, wx * gy - wy * gx
        _point_weight(slot_i, hx, hy, hz, w, ARM_I, grad)
        _point_weight(slot_j, -hx, -hy, -hz, w, ARM_J, grad)
        if slot_l >= 0:
            m = 12 * slot_l + 9
            grad[m] -= w[OTHER + 1] * gz - w[OTHER + 2] * gy
            grad[m + 1] -= w[OTHER + 2] * gx - w[OTHER] * gz
            grad[m + 2] -= w[OTHER] * gy - w[OTHER + 1] * gx


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def radial_gradient(ints, at, weight, kin, marker_body, marker_frame, w, grad):
    """Add the gradient of VR: n on the relative velocity, (u - n VR)/|r| on the relative position.

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
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    i, j, slot_i, slot_j = ints[at + 1], ints[at + 2], ints[at + 6], ints[at + 7]
    f = radial_velocity(i, j, kin, marker_body, marker_frame, w)
    r = w[OTHER]
    if r <= 0.0:
        return
    nx, ny, nz = weight * w[AXIS], weight * w[AXIS + 1], weight * w[AXIS + 2]
    hx = weight * (w[VECTOR] - f * w[AXIS]) / r
    hy = weight * (w[VECTOR + 1] - f * w[AXIS + 1]) / r
    hz = weight * (w[VECTOR + 2] - f * w[AXIS + 2]) / r
    _velocity_weight(slot_i, marker_body[i] if i >= 0 else 0, nx, ny, nz, kin, w, ARM_I, grad)
    _velocity_weight(slot_j, marker_body[j] if j >= 0 else 0, -nx, -ny, -nz, kin, w, ARM_J, grad)
    _point_weight(slot_i, hx, hy, hz, w, ARM_I, grad)
    _point_weight(slot_j, -hx, -hy, -hz, w, ARM_J, grad)


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
)
def cosine_gradient(ints, at, weight, kin, marker_body, marker_frame, w, grad):
    """Add the gradient of the cosine of axis a of marker i with axis b of marker j.

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
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    i, a, j, b = ints[at + 1], ints[at + 2], ints[at + 3], ints[at + 4]
    marker_axis(i, a, kin, marker_body, marker_frame, w, AXIS)
    marker_axis(j, b, kin, marker_body, marker_frame, w, VECTOR)
    _axis_weight(ints[at + 6], weight, w, AXIS, VECTOR, grad)
    _axis_weight(ints[at + 7], weight, w, VECTOR, AXIS, grad)


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1])",
    cache=True,
    nogil=True,
)
def euler_parameter_gradient(ints, at, weight, kin, marker_body, marker_frame, w, grad):
    """Add the gradient of an Euler parameter: de0 = -d.e/2, de = (e0 d + d x e)/2, d the turn in frame j.

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
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    i, j, component = ints[at + 1], ints[at + 2], ints[at + 3]
    euler_parameter(i, j, component, kin, marker_body, marker_frame, w)
    e0, ex, ey, ez = w[0], w[1], w[2], w[3]
    half = 0.5 * weight
    if component == 0:
        dx, dy, dz = -half * ex, -half * ey, -half * ez
    elif component == 1:
        dx, dy, dz = half * e0, half * ez, -half * ey
    elif component == 2:
        dx, dy, dz = -half * ez, half * e0, half * ex
    else:
        dx, dy, dz = half * ey, -half * ex, half * e0
    for axis in range(3):
        d = dx if axis == 0 else (dy if axis == 1 else dz)
        marker_axis(j, axis, kin, marker_body, marker_frame, w, 4)
        for c in range(3):
            if ints[at + 6] >= 0:
                grad[12 * ints[at + 6] + 3 + c] += d * w[4 + c]
            if ints[at + 7] >= 0:
                grad[12 * ints[at + 7] + 3 + c] -= d * w[4 + c]


@njit(
    "void(int64[::1], int64, float64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], float64[::1], int64)",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def force_gradient(ints, at, weight, kin, marker_body, marker_frame, w, grad, first):
    """Add the gradient of a force component: e on the three unknowns (X stands in the scratch), e x X on dpi_k.

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
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    first : int
        Column of the first of the three unknowns.
    """
    slot, k, axis = ints[at + 1], ints[at + 4], ints[at + 5]
    resolve(k, axis, kin, marker_body, marker_frame, w)
    if axis != op.MAGNITUDE:
        _axis_weight(ints[at + 9], weight, w, AXIS, VECTOR, grad)
    for c in range(3):
        grad[first + slot + c] += weight * w[AXIS + c]
