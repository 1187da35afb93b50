"""Loads at elastic frames: force, moment and modal forces on the body, and their entries in the rows of eq. (5)."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.frames import (
    AXES,
    DP,
    DV,
    DW,
    DX,
    FORCE,
    PAIRS,
    POSITION,
    PSI,
    VELOCITY,
    coordinates,
    is_elastic,
    is_idle,
    partials,
    place,
    shapes_of,
    tail_of,
)
from gearmbs.dae.equations.bodies.inertia import to_body
from gearmbs.dae.equations.constraints.terms import cross3, dot3
from gearmbs.dae.equations.rotation import KIN_AXES, KIN_FORCE, KIN_MOMENT, KIN_R, KIN_SHIFT, KIN_TURN
from gearmbs.dae.equations.unknowns import put
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.lanes import LANES, lanes_at, put_lanes
from gearmbs.kernels.pointers import F8, I8, IMAT, IVEC, MAT, VEC
from gearmbs.kernels.structs import uncounted, uncounted_rows, vector_at


@njit(cache=True, error_model="numpy", forceinline=True)
def wrench_at(f, point, force, torque, sign, marker_body, kin, frame, s):
    """Write arm, force and moment about the origin of frame f to ``s[0:9]``.

    Parameters
    ----------
    point : int
        Marker at whose origin the force acts.
    force, torque : ndarray, shape (3,)
    sign : float
        Factor of both.
    """
    owner = marker_body[point]
    for c in range(3):
        s[c] = kin[owner, KIN_R + c] + frame[point, T.MK_ARM + c] - kin[f, KIN_R + c]
        s[3 + c] = sign * force[c]
    cross3(s, 0, s, 3, s, 6)
    for c in range(3):
        s[6 + c] += sign * torque[c]


@njit(types.void(I8, F8, IVEC, VEC, IVEC, MAT, MAT, VEC), cache=True, late=True, error_model="numpy")
def load_at(f, sign, row, y, marker_body, kin, frame, s):
    """As `wrench_at` for the F and N that a force element has in y.

    Parameters
    ----------
    f, sign : int, float
        The frame that feels the load, and the factor of both.
    row : ndarray of int
        Row of the force element.
    y
        Unknowns.
    marker_body, kin, frame : ndarray
        The markers' frames, tables of kinematics and of markers.
    s : ndarray
        Written, 15 places.
    """
    force, torque = s[9:12], s[12:15]
    for c in range(3):
        force[c] = y[row[T.FORCE_F] + c] if row[T.FORCE_F] >= 0 else 0.0
        torque[c] = y[row[T.FORCE_N] + c] if row[T.FORCE_N] >= 0 else 0.0
    wrench_at(f, row[T.FORCE_I], force, torque, sign, marker_body, kin, frame, s)


@njit(types.void(I8, IMAT, VEC, MAT, VEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def bring_to_body(f, at, modal, kin, partial, scratch, out):
    """Bring the forces added up for elastic frame f to its body and to the modes: eq. (5), and mu in eq. (6)."""
    row, body, n = kin[f], kin[at[f, T.AT_BODY]], at[f, T.AT_MODES]
    x, y, z = row[KIN_R] - body[KIN_R], row[KIN_R + 1] - body[KIN_R + 1], row[KIN_R + 2] - body[KIN_R + 2]
    shape, axes = shapes_of(f, at, modal), vector_at(partial, tail_of(f, at) + AXES, 9)
    s = vector_at(scratch, 0, 18)
    for pair in range(2):
        # forces with moments, then mu's displacements with its rotations
        along, about = (KIN_FORCE, KIN_MOMENT) if pair == 0 else (KIN_SHIFT, KIN_TURN)
        at_pair, sign = 9 * pair, 1.0 - 2.0 * pair
        for c in range(3):
            body[along + c] += row[along + c]
            body[about + c] += row[about + c]
        body[about] += y * row[along + 2] - z * row[along + 1]
        body[about + 1] += z * row[along] - x * row[along + 2]
        body[about + 2] += x * row[along + 1] - y * row[along]
        to_body(body, row, along, s, at_pair)
        to_body(body, row, about, s, at_pair + 6)
        for c in range(3):
            s[at_pair + c] *= sign
            s[at_pair + 3 + c] = sign * dot3(axes, 3 * c, s, at_pair + 6)
    forces, shifts = vector_at(out, at[f, T.AT_PF], n), vector_at(out, at[f, T.AT_QF], n)
    add_modal_forces(shape, (s[0], s[1], s[2], s[3], s[4], s[5]), forces)
    add_modal_forces(shape, (s[9], s[10], s[11], s[12], s[13], s[14]), shifts)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_modal_forces(shape, wrench, total):
    """Add the forces on modes of a force and a moment along the axes of the rotation to ``total``.

    Parameters
    ----------
    shape : ndarray, shape (6, n)
        Of `gearmbs.dae.equations.bodies.frames.shapes_of`.
    wrench : tuple of float
        Force and moment, six components.
    total : ndarray, shape (n,)
    """
    x, y, z, a, b, c = wrench
    n = total.size
    rows = (
        vector_at(shape, 0, n), vector_at(shape, n, n), vector_at(shape, 2 * n, n), vector_at(shape, 3 * n, n),
        vector_at(shape, 4 * n, n), vector_at(shape, 5 * n, n),
    )  # fmt: skip
    for g in range(n // LANES):
        push = lanes_at(rows[0], g) * x + lanes_at(rows[1], g) * y + lanes_at(rows[2], g) * z
        push = push + lanes_at(rows[3], g) * a + lanes_at(rows[4], g) * b + lanes_at(rows[5], g) * c
        put_lanes(total, g, lanes_at(total, g) + push)
    for k in range(n // LANES * LANES, n):
        push = shape[0, k] * x + shape[1, k] * y + shape[2, k] * z
        total[k] += push + shape[3, k] * a + shape[4, k] * b + shape[5, k] * c


@njit(types.void(I8, VEC, IMAT, MAT, VEC, VEC), cache=True, late=True, error_model="numpy")
def apply_frame_load(f, s, at, kin, partial, rhs):
    """Add the spatial and modal forces of force ``s[3:6]`` and moment ``s[6:9]`` at elastic frame f."""
    t = np.empty(6)
    body, v = at[f, T.AT_BODY], at[f, T.AT_V]
    for c in range(3):
        t[c] = kin[f, KIN_R + c] - kin[body, KIN_R + c]
    cross3(t, 0, s, 3, t, 3)
    for c in range(3):
        rhs[v + c] += s[3 + c]
    for c in range(at[f, T.AT_ANGLES]):
        rhs[v + 3 + c] += t[3 + c] + s[6 + c]
    d = partials(f, at, partial)
    for m in range(at[f, T.AT_MODES]):
        rhs[at[f, T.AT_V_MODES] + m] += dot3(d[3 + m], DP, s, 3) + dot3(d[3 + m], DX, s, 6)


@njit(
    I8(I8, IVEC, VEC, I8, I8, F8, I8, I8, I8, VEC, IMAT, IVEC, MAT, MAT, VEC),
    cache=True,
    late=True,
    error_model="numpy",
)
def put_load(mode, slot, vals, k, f, sign, force, torque, point, s, at, marker_body, kin, frame, partial):
    """Hand over the entries of a load on elastic frame f in the rows of eq. (5); return the next entry's number.

    Parameters
    ----------
    sign : float
        1 on I's body, -1 on J's.
    force, torque : int
        Places of F and N in y, or -1.
    point : int
        Marker at whose origin the force acts.
    s : ndarray
        Arm, force and moment of `wrench_at`, then scratch: 18 places.
    """
    slot, vals, s, partial = uncounted(slot), uncounted(vals), uncounted(s), uncounted(partial)
    at, kin, frame = uncounted_rows(at), uncounted_rows(kin), uncounted_rows(frame)
    d = partials(f, at, partial)
    owner = marker_body[point]
    for i in range(3):
        if force >= 0:
            k = put(mode, slot, vals, k, place(f, i, FORCE, at), force + i, -sign)
    for c in range(coordinates(f, at) - 3):
        i = c + 3
        row = place(f, i, FORCE, at)
        if is_idle(f, i, False, at, partial):
            continue
        # P_c . F + X_c . (r x F + N): by F it is P_c + X_c x r, by the arm r it is F x X_c
        cross3(d[c], DX, s, 0, s, 9)
        for m in range(3):
            if force >= 0:
                k = put(mode, slot, vals, k, row, force + m, -sign * (d[c, DP + m] + s[9 + m]))
            if torque >= 0:
                k = put(mode, slot, vals, k, row, torque + m, -sign * d[c, DX + m])
        k = put_turned(mode, slot, vals, k, f, c, s, at, partial)
        if force >= 0 and owner != f:
            cross3(s, 3, d[c], DX, s, 9)
            k = put_arm(mode, slot, vals, k, row, f, point, s, 1.0, at, marker_body, kin, frame, partial, True)
            k = put_arm(mode, slot, vals, k, row, owner, point, s, -1.0, at, marker_body, kin, frame, partial, False)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def put_turned(mode, slot, vals, k, f, c, s, at, partial):
    """Hand over the entries by which a load on frame f changes as coordinates turn what it acts along.

    Of two angles all, of an angle and mode c both, of two modes those of mode c, whose axis the others turn. With the
    coordinate that comes first an angle these are (X_lo x P_hi) . F, and by it (X_lo x X_hi) . M besides.

    Parameters
    ----------
    c : int
        Angle or mode: row of the partial derivatives.
    s : ndarray
        Force and moment in ``s[3:9]``, then scratch: 15 places.
    """
    d = partials(f, at, partial)
    row = place(f, c + 3, FORCE, at)
    if c < 3:
        for e in range(3):
            cross3(d[min(c, e)], DX, d[max(c, e)], DP, s, 9)
            value = dot3(s, 9, s, 3)
            if e < c:
                cross3(d[e], DX, d[c], DX, s, 9)
                value += dot3(s, 9, s, 6)
            k = put(mode, slot, vals, k, row, place(f, e + 3, POSITION, at), -value)
        return k
    position = place(f, c + 3, POSITION, at)
    cross3(d[c], DP, s, 3, s, 9)
    cross3(d[c], DX, s, 6, s, 12)
    for e in range(3):
        along, about = dot3(d[e], DX, s, 9), dot3(d[e], DX, s, 12)
        k = put(mode, slot, vals, k, row, place(f, e + 3, POSITION, at), -(along + about))
        k = put(mode, slot, vals, k, place(f, e + 3, FORCE, at), position, -along)
    own = d[c]
    if own[PSI + 1] == 0.0 and own[PSI + 2] == 0.0:
        return k
    # displacements are linear; a rotation about x turns the axes of those about y and z, one about y that of z
    pairs, first = tail_of(f, at) + PAIRS, place(f, 6, POSITION, at)
    by_x = own[PSI + 1] * dot3(s, 6, partial, pairs) + own[PSI + 2] * dot3(s, 6, partial, pairs + 3)
    by_y = own[PSI + 2] * dot3(s, 6, partial, pairs + 6)
    for e in range(at[f, T.AT_MODES]):
        x, y = d[3 + e, PSI], d[3 + e, PSI + 1]
        if x != 0.0 or (y != 0.0 and own[PSI + 2] != 0.0):
            k = put(mode, slot, vals, k, row, first + e, -(x * by_x + y * by_y))
    return k


@njit(
    I8(I8, IVEC, VEC, I8, I8, I8, I8, VEC, F8, IMAT, IVEC, MAT, MAT, VEC, types.boolean),
    cache=True,
    late=True,
    error_model="numpy",
)
def put_arm(mode, slot, vals, k, row, b, point, s, sign, at, marker_body, kin, frame, partial, to_origin):
    """Hand over ``sign`` times the derivatives of ``s[9:12]`` . x by the coordinates of frame b.

    Parameters
    ----------
    row : int
        Row of the entries.
    b : int
        A frame; nothing depends on the ground.
    point : int
        x is the origin of this marker, which is fixed in b, or
    to_origin : bool
        that of the frame itself.
    s : ndarray
        Scratch from the 13th place on.
    """
    if b == 0:
        return k
    slot, vals, s, partial, at = uncounted(slot), uncounted(vals), uncounted(s), uncounted(partial), uncounted_rows(at)
    # copied out, or they would be read anew after each number that is written
    x, y, z = sign * s[9], sign * s[10], sign * s[11]
    position, turn = at[b, T.AT_R], at[b, T.AT_THETA]
    k = put(mode, slot, vals, k, row, position, x)
    k = put(mode, slot, vals, k, row, position + 1, y)
    k = put(mode, slot, vals, k, row, position + 2, z)
    if not is_elastic(b, at):
        for c in range(0 if to_origin else 3):
            cross3(kin[b], KIN_AXES + 3 * c, frame[point], T.MK_ARM, s, 12)
            k = put(mode, slot, vals, k, row, turn + c, x * s[12] + y * s[13] + z * s[14])
        return k
    # markers of a modal body are at the origins of their frames
    d, first = partials(b, at, partial), at[b, T.AT_QF]
    for c in range(coordinates(b, at) - 3):
        p = d[c]
        if c >= 3 and is_idle(b, c + 3, True, at, partial):
            continue
        value = x * p[DP] + y * p[DP + 1] + z * p[DP + 2]
        k = put(mode, slot, vals, k, row, turn + c if c < 3 else first + c - 3, value)
    return k


@njit(I8(I8, IVEC, VEC, I8, I8, I8, VEC, I8, F8, IMAT, MAT, VEC), cache=True, late=True, error_model="numpy")
def put_chain(mode, slot, vals, k, row, f, d, col, sign, at, kin, partial):
    """Hand over the entries of one row that depends on elastic frame f; return the number of the next entry.

    Parameters
    ----------
    row : int
        Row of the entries.
    d, col : ndarray, int
        ``d[col:col+12]`` holds the derivatives by displacement, rotation, velocity and angular velocity of the frame.
    sign : float
        Factor of ``d``.
    """
    slot, vals, d, partial, at = uncounted(slot), uncounted(vals), uncounted(d), uncounted(partial), uncounted_rows(at)
    for c in range(3):
        k = put(mode, slot, vals, k, row, at[f, T.AT_R] + c, sign * d[col + c])
        k = put(mode, slot, vals, k, row, at[f, T.AT_U] + c, sign * d[col + 6 + c])
    rows = partials(f, at, partial)
    for i in range(3, coordinates(f, at)):
        if is_idle(f, i, False, at, partial):
            continue
        p = rows[i - 3]
        moved = dot3(d, col, p, DP) + dot3(d, col + 3, p, DX)
        pushed = dot3(d, col + 6, p, DP) + dot3(d, col + 9, p, DX)
        changed = dot3(d, col + 6, p, DV) + dot3(d, col + 9, p, DW)
        k = put(mode, slot, vals, k, row, place(f, i, POSITION, at), sign * (moved + changed))
        k = put(mode, slot, vals, k, row, place(f, i, VELOCITY, at), sign * pushed)
    return k
