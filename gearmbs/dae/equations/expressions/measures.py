"""Leaves of the tape: vectors between markers, seen along an axis or by their length.

Every vector leaf is X . e with X a displacement, velocity, acceleration or force vector in global
components and e either an axis of a marker or X/|X|.  Its derivatives with respect to the spatial
variations [dR, dpi, dv, dw] of the bodies follow from three rules for a point r = R + s, s = A s':

    dr = dR + dpi x s,   dv_point = dv + dw x s + w x (dpi x s),   de = dpi x e.
"""

from __future__ import annotations

import math

from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.opcodes import ACC_A, ACC_ALPHA, KIN_A, KIN_R, KIN_V, KIN_W
from gearmbs.kernels.jit import njit

# scratch of one leaf: vectors of three
ARM_I = 0
ARM_J = 3
AXIS = 6
VECTOR = 9
OTHER = 12
LEAF_WORK = 18


@njit("void(int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], int64)", cache=True, nogil=True)
def marker_arm(m, kin, marker_body, marker_frame, w, at):
    """Write s = A s', the marker's origin seen from its body's origin, in global components."""
    if m < 0:
        w[at] = w[at + 1] = w[at + 2] = 0.0
        return
    b = marker_body[m]
    x, y, z = marker_frame[m, 0], marker_frame[m, 1], marker_frame[m, 2]
    for c in range(3):
        k = KIN_A + 3 * c
        w[at + c] = kin[b, k] * x + kin[b, k + 1] * y + kin[b, k + 2] * z


@njit("void(int64, int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1], int64)", cache=True, nogil=True)
def marker_axis(m, axis, kin, marker_body, marker_frame, w, at):
    """Write an axis of a marker (of the global frame for m < 0) in global components."""
    if m < 0:
        w[at] = w[at + 1] = w[at + 2] = 0.0
        w[at + axis] = 1.0
        return
    b = marker_body[m]
    x, y, z = marker_frame[m, 3 + axis], marker_frame[m, 6 + axis], marker_frame[m, 9 + axis]
    for c in range(3):
        k = KIN_A + 3 * c
        w[at + c] = kin[b, k] * x + kin[b, k + 1] * y + kin[b, k + 2] * z


@njit("void(int64, float64, float64[:, ::1], int64[::1], float64[::1], int64, int64)", cache=True, nogil=True)
def _add_position(m, sign, kin, marker_body, w, arm, out):
    """Add sign * r of a marker to ``w[out:out+3]``; its arm stands at ``arm``."""
    if m < 0:
        return
    b = marker_body[m]
    for c in range(3):
        w[out + c] += sign * (kin[b, KIN_R + c] + w[arm + c])


@njit("void(int64, float64, float64[:, ::1], int64[::1], float64[::1], int64, int64)", cache=True, nogil=True)
def _add_velocity(m, sign, kin, marker_body, w, arm, out):
    """Add sign * v of a marker to ``w[out:out+3]``."""
    if m < 0:
        return
    b = marker_body[m]
    wx, wy, wz = kin[b, KIN_W], kin[b, KIN_W + 1], kin[b, KIN_W + 2]
    sx, sy, sz = w[arm], w[arm + 1], w[arm + 2]
    w[out] += sign * (kin[b, KIN_V] + wy * sz - wz * sy)
    w[out + 1] += sign * (kin[b, KIN_V + 1] + wz * sx - wx * sz)
    w[out + 2] += sign * (kin[b, KIN_V + 2] + wx * sy - wy * sx)


@njit("void(int64, float64, float64[:, ::1], int64[::1], float64[::1], int64)", cache=True, nogil=True)
def _add_omega(m, sign, kin, marker_body, w, out):
    if m < 0:
        return
    b = marker_body[m]
    for c in range(3):
        w[out + c] += sign * kin[b, KIN_W + c]


@njit(
    "void(int64, float64, float64[:, ::1], float64[:, ::1], int64[::1], float64[::1], int64, int64)",
    cache=True,
    nogil=True,
)
def _add_acceleration(m, sign, kin, acc, marker_body, w, arm, out):
    """Add sign * (a + alpha x s + w x (w x s)) of a marker.

    Parameters
    ----------
    m : int
        Marker, or -1 for the global frame.
    sign : float
        Factor.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    acc : ndarray, shape (bodies, 6)
        Accelerations a and alpha of the bodies; not used where none are asked for.
    marker_body : ndarray of int
        Body of each marker.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    arm : int
        Offset of its arm s in ``w``.
    out : int
        Offset in ``w`` of the vector that is added to.
    """
    if m < 0:
        return
    b = marker_body[m]
    wx, wy, wz = kin[b, KIN_W], kin[b, KIN_W + 1], kin[b, KIN_W + 2]
    ex, ey, ez = acc[b, ACC_ALPHA], acc[b, ACC_ALPHA + 1], acc[b, ACC_ALPHA + 2]
    sx, sy, sz = w[arm], w[arm + 1], w[arm + 2]
    ux, uy, uz = wy * sz - wz * sy, wz * sx - wx * sz, wx * sy - wy * sx
    w[out] += sign * (acc[b, ACC_A] + ey * sz - ez * sy + wy * uz - wz * uy)
    w[out + 1] += sign * (acc[b, ACC_A + 1] + ez * sx - ex * sz + wz * ux - wx * uz)
    w[out + 2] += sign * (acc[b, ACC_A + 2] + ex * sy - ey * sx + wx * uy - wy * ux)


@njit("void(float64[::1], int64, int64, int64, float64)", cache=True, nogil=True)
def _add_cross(w, a, b, out, sign):
    """Add sign * (w[a] x w[b]) to ``w[out]``."""
    w[out] += sign * (w[a + 1] * w[b + 2] - w[a + 2] * w[b + 1])
    w[out + 1] += sign * (w[a + 2] * w[b] - w[a] * w[b + 2])
    w[out + 2] += sign * (w[a] * w[b + 1] - w[a + 1] * w[b])


@njit(
    "void(int64, int64, int64, float64[:, ::1], float64[:, ::1], int64[::1], float64[::1])",
    cache=True,
    nogil=True,
)
def _relative_acceleration(i, j, l, kin, acc, marker_body, w):
    """Write a_i - a_j, differentiated in frame l: minus alpha_l x r + 2 w_l x v_rel + w_l x (w_l x r)."""
    _add_acceleration(i, 1.0, kin, acc, marker_body, w, ARM_I, VECTOR)
    _add_acceleration(j, -1.0, kin, acc, marker_body, w, ARM_J, VECTOR)
    if l < 0:
        return
    b = marker_body[l]
    for c in range(3):
        w[OTHER + c] = 0.0
        w[OTHER + 3 + c] = 0.0
    _add_velocity(i, 1.0, kin, marker_body, w, ARM_I, OTHER)
    _add_velocity(j, -1.0, kin, marker_body, w, ARM_J, OTHER)
    _add_position(i, 1.0, kin, marker_body, w, ARM_I, OTHER + 3)
    _add_position(j, -1.0, kin, marker_body, w, ARM_J, OTHER + 3)
    for c in range(3):
        w[AXIS + c] = kin[b, KIN_W + c]
    # v_rel = v - w_l x r, so 2 w_l x v_rel + w_l x (w_l x r) = w_l x (2 v - w_l x r)
    for c in range(3):
        w[OTHER + c] *= 2.0
    _add_cross(w, AXIS, OTHER + 3, OTHER, -1.0)
    _add_cross(w, AXIS, OTHER, VECTOR, -1.0)
    for c in range(3):
        w[AXIS + c] = acc[b, ACC_ALPHA + c]
    _add_cross(w, AXIS, OTHER + 3, VECTOR, -1.0)


@njit(
    "void(int64, int64, int64, int64, float64[:, ::1], float64[:, ::1], int64[::1], float64[:, ::1], float64[::1])",
    cache=True,
    nogil=True,
)
def relative_vector(code, i, j, l, kin, acc, marker_body, marker_frame, w):
    """Write the vector X of a leaf between markers i and j, seen in frame l, to the scratch.

    Parameters
    ----------
    code : int
        Kind of the leaf, `opcodes`.
    i, j : int
        Markers between which the vector is taken, -1 for the global frame.
    l : int
        Marker in whose frame rates are seen, or -1.
    kin : ndarray, shape (bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    acc : ndarray, shape (bodies, 6)
        Accelerations a and alpha of the bodies; not used where none are asked for.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    w : ndarray
        Scratch of a leaf, its vectors of three at the offsets of `measures`.
    """
    for c in range(3):
        w[VECTOR + c] = 0.0
    if code == op.ANGULAR_VELOCITY:
        _add_omega(i, 1.0, kin, marker_body, w, VECTOR)
        _add_omega(j, -1.0, kin, marker_body, w, VECTOR)
        return
    if code == op.ANGULAR_ACCELERATION:
        for c in range(3):
            if i >= 0:
                w[VECTOR + c] += acc[marker_body[i], ACC_ALPHA + c]
            if j >= 0:
                w[VECTOR + c] -= acc[marker_body[j], ACC_ALPHA + c]
        if l >= 0:
            # d/dt in frame l of w_i - w_j
            w[ARM_I] = w[ARM_I + 1] = w[ARM_I + 2] = 0.0
            _add_omega(i, 1.0, kin, marker_body, w, ARM_I)
            _add_omega(j, -1.0, kin, marker_body, w, ARM_I)
            for c in range(3):
                w[ARM_J + c] = kin[marker_body[l], KIN_W + c]
            _add_cross(w, ARM_J, ARM_I, VECTOR, -1.0)
        return
    marker_arm(i, kin, marker_body, marker_frame, w, ARM_I)
    marker_arm(j, kin, marker_body, marker_frame, w, ARM_J)
    if code == op.DISPLACEMENT:
        _add_position(i, 1.0, kin, marker_body, w, ARM_I, VECTOR)
        _add_position(j, -1.0, kin, marker_body, w, ARM_J, VECTOR)
        return
    if code == op.VELOCITY or code == op.RADIAL_VELOCITY:
        _add_velocity(i, 1.0, kin, marker_body, w, ARM_I, VECTOR)
        _add_velocity(j, -1.0, kin, marker_body, w, ARM_J, VECTOR)
        if l >= 0 and code == op.VELOCITY:
            w[OTHER] = w[OTHER + 1] = w[OTHER + 2] = 0.0
            _add_position(i, 1.0, kin, marker_body, w, ARM_I, OTHER)
            _add_position(j, -1.0, kin, marker_body, w, ARM_J, OTHER)
            for c in range(3):
                w[AXIS + c] = kin[marker_body[l], KIN_W + c]
            _add_cross(w, AXIS, OTHER, VECTOR, -1.0)
        return
    _relative_acceleration(i, j, l, kin, acc, marker_body, w)


@njit(
    "float64(int64, int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def resolve(k, axis, kin, marker_body, marker_frame, w):
    """Write the direction e and return X . e: along an axis of marker k, or the length of X."""
    if axis == op.MAGNITUDE:
        f = math.sqrt(w[VECTOR] ** 2 + w[VECTOR + 1] ** 2 + w[VECTOR + 2] ** 2)
        for c in range(3):
            w[AXIS + c] = w[VECTOR + c] / f if f > 0.0 else 0.0
        return f
    marker_axis(k, axis, kin, marker_body, marker_frame, w, AXIS)
    return w[VECTOR] * w[AXIS] + w[VECTOR + 1] * w[AXIS + 1] + w[VECTOR + 2] * w[AXIS + 2]


@njit(
    "float64(int64, int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def radial_velocity(i, j, kin, marker_body, marker_frame, w):
    """Return VR = (v_i - v_j) . r/|r|; the unit vector is left at AXIS, |r| at OTHER."""
    relative_vector(op.RADIAL_VELOCITY, i, j, op.GLOBAL, kin, kin, marker_body, marker_frame, w)
    w[AXIS] = w[AXIS + 1] = w[AXIS + 2] = 0.0
    _add_position(i, 1.0, kin, marker_body, w, ARM_I, AXIS)
    _add_position(j, -1.0, kin, marker_body, w, ARM_J, AXIS)
    r = math.sqrt(w[AXIS] ** 2 + w[AXIS + 1] ** 2 + w[AXIS + 2] ** 2)
    w[OTHER] = r
    f = 0.0
    for c in range(3):
        w[AXIS + c] = w[AXIS + c] / r if r > 0.0 else 0.0
        f += w[AXIS + c] * w[VECTOR + c]
    return f


@njit(
    "float64(int64, int64, int64, float64[:, ::1], int64[::1], float64[:, ::1], float64[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def euler_parameter(i, j, component, kin, marker_body, marker_frame, w):
    """Return Euler parameter 0..3 of marker i in marker j, e0 >= 0; all four are left at w[0:4]."""
    m = 4
    for axis in range(3):
        marker_axis(j, axis, kin, marker_body, marker_frame, w, m + 9)
        for c in range(3):
            marker_axis(i, c, kin, marker_body, marker_frame, w, 0)
            w[m + 3 * axis + c] = w[0] * w[m + 9] + w[1] * w[m + 10] + w[2] * w[m + 11]
    xx, yy, zz = w[m], w[m + 4], w[m + 8]
    trace = xx + yy + zz
    w[0] = 0.5 * math.sqrt(max(0.0, 1.0 + trace))
    if w[0] > 0.1:
        q = 0.25 / w[0]
        w[1] = q * (w[m + 7] - w[m + 5])
        w[2] = q * (w[m + 2] - w[m + 6])
        w[3] = q * (w[m + 3] - w[m + 1])
        return w[component]
    x = 0.5 * math.sqrt(max(0.0, 1.0 + xx - yy - zz))
    y = 0.5 * math.sqrt(max(0.0, 1.0 - xx + yy - zz))
    z = 0.5 * math.sqrt(max(0.0, 1.0 - xx - yy + zz))
    if x >= y and x >= z:
        y, z = (w[m + 1] + w[m + 3]) / (4.0 * x), (w[m + 2] + w[m + 6]) / (4.0 * x)
        e0 = (w[m + 7] - w[m + 5]) / (4.0 * x)
    elif y >= z:
        x, z = (w[m + 1] + w[m + 3]) / (4.0 * y), (w[m + 5] + w[m + 7]) / (4.0 * y)
        e0 = (w[m + 2] - w[m + 6]) / (4.0 * y)
    else:
        x, y = (w[m + 2] + w[m + 6]) / (4.0 * z), (w[m + 5] + w[m + 7]) / (4.0 * z)
        e0 = (w[m + 3] - w[m + 1]) / (4.0 * z)
    sign = 1.0 if e0 >= 0.0 else -1.0
    w[0], w[1], w[2], w[3] = sign * e0, sign * x, sign * y, sign * z
    return w[component]
