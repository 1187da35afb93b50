"""Elastic frames: where the markers of a body with modal coordinates are, and the chain rule to its coordinates.

Of a point mass they are the same without modes and angles: a constant arm and a constant orientation.

All that joins bodies (constraint terms, force elements, expressions) sees frames: rows of the kinematics table with a
position, an orientation and their velocities, and gives derivatives by the frames' own six displacements. The frame of
a rigid body is the body. Each marker of a modal body has an elastic frame of its own, with displacement shapes phi_k
and rotation shapes psi_k in body components:

    P   = R + A (s0 + sum_k phi_k q_k)
    A_P = A R_x(alpha_x) R_y(alpha_y) R_z(alpha_z),     alpha = sum_k psi_k q_k

The three rotations are successive about the axes Y_c = A e_x, A R_x e_y, A R_x R_y e_z, so that Euler angles and modal
coordinates follow one rule: with X_c the axis of coordinate c (a_c for an angle, sum_m psi_k,m Y_m for mode k), a
vector fixed in the frame has the derivatives X_c x v and, if one of two coordinates is an angle, X_min x (X_max x v),
min the coordinate that comes first; of modes k and l it has sum_mn psi_k,m psi_l,n Y_min x (Y_max x v). The points have
P_c = a_c x s or A phi_k, and the second derivatives X_min x P_max where min is an angle, else 0.

As its own coordinates a frame has P and three successive rotations about the global axes, from its present orientation
on: then X_c = e_c. From Hessians in these those in the body's coordinates follow, with g the spatial gradient:

    H_cd = T_c H T_d + g_P . P_cd + g_a . 1/2 (X_min x X_max - sum_mn X_c,m X_d,n e_min x e_max),   T_c = (P_c, X_c)

with sum_mn psi_k,m psi_l,n Y_min x Y_max in place of X_min x X_max for two modes.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.inertia import to_global
from gearmbs.dae.equations.constraints.terms import cross3, dot3
from gearmbs.dae.equations.rotation import KIN_A, KIN_ADOT, KIN_AXES, KIN_DW, KIN_R, KIN_V, KIN_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.lanes import LANES, all_lanes, lanes_at, put_lanes
from gearmbs.kernels.pointers import I8, IMAT, MAT, VEC
from gearmbs.kernels.structs import matrix_at, vector_at

# Shapes of the modes at a marker: their table, and where they move and turn it in its body.


SMALL_TURN = 1e-3
"""Angle below which the series of cosine and sine, three terms each, are exact to rounding."""


def shape_table(position: np.ndarray, phi: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """Return the numbers of an elastic frame as the kernels read them.

    They are s0, then x, y and z of phi_k and psi_k, an entry for each mode, and once more by modes in lanes: s0, then
    phi_k and psi_k.

    Parameters
    ----------
    position : ndarray, shape (3,)
        s0.
    phi, psi : ndarray, shape (n, 3)
        Displacement and rotation shapes.
    """
    both = np.hstack([phi, psi])
    lanes = np.zeros((1 + len(both), LANES))
    lanes[0, :3], lanes[1:, :6] = position, both
    return np.concatenate([position, both.T.ravel(), lanes.ravel()])


@njit(cache=True, error_model="numpy", forceinline=True)
def shapes_of(f, at, modal):
    """Return phi_k and psi_k of elastic frame f: x, y and z of both, six rows with an entry for each mode."""
    return matrix_at(modal, at[f, T.AT_SHAPE] + 3, 6, at[f, T.AT_MODES])


@njit(cache=True, error_model="numpy", forceinline=True)
def sine_and_cosine(angle):
    """Return sine and cosine, of small angles by their series."""
    if abs(angle) >= SMALL_TURN:
        return np.sin(angle), np.cos(angle)
    square = angle * angle
    return angle * (1.0 - square * (1.0 / 6.0 - square / 120.0)), 1.0 - square * (0.5 - square / 24.0)


@njit(cache=True, error_model="numpy")
def deform(f, y, at, modal, axes, partial, s):
    """Write where a marker has moved and turned in its body, and the axes of its rotation.

    Parameters
    ----------
    f : int
        Row of the frame.
    y
        Unknowns.
    at, modal : ndarray
        Places, and the table with the marker's shapes.
    axes, partial : int, ndarray
        Place of the axes Y_c, and the table of partial derivatives.
    s : ndarray
        Written: arm in ``s[0:3]``, its rate in ``s[3:6]``, the rates of the angles in ``s[6:9]``, R_x R_y R_z by
        rows in ``s[9:18]``; body components. Then scratch of two lanes.
    """
    n = at[f, T.AT_MODES]
    shape = vector_at(modal, at[f, T.AT_SHAPE] + 3 + 6 * n, LANES * (1 + n))
    amounts, rates = vector_at(y, at[f, T.AT_QF], n), vector_at(y, at[f, T.AT_VF], n)
    moved, moving = lanes_at(shape, 0), all_lanes(0.0)
    for k in range(n):
        of_mode = lanes_at(shape, 1 + k)
        moved = moved + of_mode * amounts[k]
        moving = moving + of_mode * rates[k]
    both = vector_at(s, 18, 2 * LANES)
    put_lanes(both, 0, moved)
    put_lanes(both, 1, moving)
    for c in range(3):
        s[c], s[3 + c], s[6 + c] = both[c], both[LANES + c], both[LANES + 3 + c]
    sx, cx = sine_and_cosine(both[3])
    sy, cy = sine_and_cosine(both[4])
    sz, cz = sine_and_cosine(both[5])
    partial[axes], partial[axes + 1], partial[axes + 2] = 1.0, 0.0, 0.0
    partial[axes + 3], partial[axes + 4], partial[axes + 5] = 0.0, cx, sx
    partial[axes + 6], partial[axes + 7], partial[axes + 8] = sy, -sx * cy, cx * cy
    s[9], s[10], s[11] = cy * cz, -cy * sz, sy
    s[12], s[13], s[14] = cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy
    s[15], s[16], s[17] = sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy


DP = 0
"""Columns of the table of partial derivatives, a row for each angle and mode: P_c, X_c, then those of V and W."""
DX = 3
DV = 6
DW = 9
PSI = 12
"""Rotation shape psi_k of a mode, body components."""
PARTIALS = 15

BIAS, AXES, PAIRS = 0, 6, 15
"""After the rows: the accelerations of P and of the rotation without those of the coordinates; the axes Y_c in body
components; Y_x x Y_y, Y_x x Y_z and Y_y x Y_z."""
TAIL = 24


def partials_size(modes: int) -> int:
    """Return how many numbers the partial derivatives of an elastic frame take."""
    return PARTIALS * (3 + modes) + TAIL


@njit(cache=True, error_model="numpy", forceinline=True)
def is_elastic(b, at):
    """Return whether a row of the kinematics table is an elastic frame."""
    return at[b, T.AT_SHAPE] >= 0


@njit(cache=True, error_model="numpy", forceinline=True)
def touches_elastic(term, marker_body, bodies):
    """Return whether one of a constraint term's markers is on a modal body."""
    return marker_body[term[T.TERM_I]] >= bodies or marker_body[term[T.TERM_J]] >= bodies


@njit(cache=True, error_model="numpy", forceinline=True)
def own_rate(b, i, y, at, kin):
    """Return the rate of a frame's own coordinate i, six of them."""
    if is_elastic(b, at):
        return kin[b, KIN_V + i] if i < 3 else kin[b, KIN_W + i - 3]
    return y[at[b, T.AT_U] + i] if i < 3 else y[at[b, T.AT_EPS] + i - 3]


@njit(cache=True, error_model="numpy", forceinline=True)
def partials(f, at, partial):
    """Return the partial derivatives of elastic frame f, a row for each angle and mode."""
    return matrix_at(partial, at[f, T.AT_PARTIAL], 3 + at[f, T.AT_MODES], PARTIALS)


@njit(cache=True, error_model="numpy", forceinline=True)
def tail_of(f, at):
    """Return where in the table of partial derivatives that begins which follows the rows of elastic frame f."""
    return at[f, T.AT_PARTIAL] + PARTIALS * (3 + at[f, T.AT_MODES])


@njit(types.void(I8, VEC, IMAT, VEC, MAT, VEC, VEC, types.boolean), cache=True, late=True, error_model="numpy")
def update_frame(f, y, at, modal, kin, partial, scratch, derivatives):
    """Fill the row of elastic frame f in the kinematics table and its partial derivatives.

    Parameters
    ----------
    f : int
        Row of the frame.
    at, modal : ndarray
        Places of the unknowns; shapes: s0, then those of `shapes_of`.
    kin, partial : ndarray
        Kinematics table, in which the body's row is up to date; table of partial derivatives.
    scratch : ndarray
        52 places.
    derivatives : bool
        Whether the partial derivatives are wanted: the residual needs none but ``AXES``.
    """
    body, row, s, own = kin[at[f, T.AT_BODY]], kin[f], vector_at(scratch, 0, 18), vector_at(scratch, 18, 18)
    axes = tail_of(f, at) + AXES
    deform(f, y, at, modal, axes, partial, vector_at(scratch, 18, 34))
    for c in range(3):
        s[15 + c] = own[6] * partial[axes + c] + own[7] * partial[axes + 3 + c] + own[8] * partial[axes + 6 + c]
    for c in range(3):
        a = KIN_A + 3 * c
        x, y_, z = body[a], body[a + 1], body[a + 2]
        for j in range(3):
            row[a + j] = x * own[9 + j] + y_ * own[12 + j] + z * own[15 + j]
        for j in range(2):
            s[3 * j + c] = x * own[3 * j] + y_ * own[3 * j + 1] + z * own[3 * j + 2]
        s[6 + c] = x * s[15] + y_ * s[16] + z * s[17]
    # s[0:3] arm, s[3:6] its elastic rate, s[6:9] the modes' angular velocity
    cross3(body, KIN_W, s, 0, s, 9)
    for c in range(3):
        row[KIN_R + c] = body[KIN_R + c] + s[c]
        row[KIN_V + c] = body[KIN_V + c] + s[9 + c] + s[3 + c]
        row[KIN_W + c] = body[KIN_W + c] + s[6 + c]
    own_axes(row)
    if derivatives:
        turned_axes(f, at, body, partial, own)
        update_positions(f, at, modal, body, partial, s, own)
        update_rates(f, at, body, partial, s, own)
        bias(f, at, body, partial, s, own)


@njit(cache=True, error_model="numpy")
def turned_axes(f, at, body, partial, own):
    """Write the axes Y_c in global components to ``own[9:18]``, and their products after the partial derivatives."""
    axes, pairs = tail_of(f, at) + AXES, tail_of(f, at) + PAIRS
    for c in range(3):
        to_global(body, partial, axes + 3 * c, own, 9 + 3 * c)
    cross3(own, 9, own, 12, partial, pairs)
    cross3(own, 9, own, 15, partial, pairs + 3)
    cross3(own, 12, own, 15, partial, pairs + 6)


@njit(cache=True, error_model="numpy")
def update_positions(f, at, modal, body, partial, s, own):
    """Fill P_c and X_c of elastic frame f; the arm is in ``s[0:3]``, the axes Y_c are in ``own[9:18]``."""
    shape, d = shapes_of(f, at, modal), partials(f, at, partial)
    for c in range(3):
        a = KIN_AXES + 3 * c
        cross3(body, a, s, 0, d[c], DP)
        for m in range(3):
            d[c, DX + m] = body[a + m]
    for k in range(at[f, T.AT_MODES]):
        row = d[3 + k]
        for m in range(3):
            row[PSI + m] = shape[m, k]
        to_global(body, row, PSI, row, DP)
        for m in range(3):
            row[PSI + m] = shape[3 + m, k]
        for m in range(3):
            row[DX + m] = row[PSI] * own[9 + m] + row[PSI + 1] * own[12 + m] + row[PSI + 2] * own[15 + m]


@njit(cache=True, error_model="numpy")
def update_rates(f, at, body, partial, s, own):
    """Fill the derivatives of a frame's velocities.

    Parameters
    ----------
    f : int
        The frame, whose positions' derivatives are up to date.
    at, partial : ndarray
        Places, and the table of partial derivatives.
    body : ndarray
        The body's row of the kinematics table.
    s : ndarray
        Arm, its elastic rate, angular velocity of the modes; then nine places of scratch.
    own : ndarray
        Rates of the angles in ``own[6:9]``.
    """
    d, pairs = partials(f, at, partial), tail_of(f, at) + PAIRS
    for c in range(3):
        a = KIN_AXES + 3 * c
        # d(w x s + s')/dtheta_c = dw x s + w x (a x s) + a x s',  d(w + sum X v)/dtheta_c = dw + a x sum X v
        cross3(body, KIN_DW + 3 * c, s, 0, s, 9)
        cross3(body, KIN_W, d[c], DP, s, 12)
        cross3(body, a, s, 3, s, 15)
        for m in range(3):
            d[c, DV + m] = s[9 + m] + s[12 + m] + s[15 + m]
        cross3(body, a, s, 6, s, 9)
        for m in range(3):
            d[c, DW + m] = body[KIN_DW + 3 * c + m] + s[9 + m]
    for m in range(3):
        s[9 + m] = own[7] * partial[pairs + m] + own[8] * partial[pairs + 3 + m]
        s[12 + m] = own[8] * partial[pairs + 6 + m]
    for k in range(3, 3 + at[f, T.AT_MODES]):
        row = d[k]
        cross3(body, KIN_W, row, DP, row, DV)
        for m in range(3):
            row[DW + m] = row[PSI] * s[9 + m] + row[PSI + 1] * s[12 + m]


@njit(cache=True, error_model="numpy")
def own_axes(row):
    """Give a frame the axes of its own coordinates: the global ones, with the rates that its turning gives them."""
    for c in range(KIN_AXES, row.size):
        row[c] = 0.0
    wx, wy = row[KIN_W], row[KIN_W + 1]
    for c in range(3):
        row[KIN_AXES + 4 * c] = 1.0
    # the rate of axis k is that of the axes before it: w_x e_x x e_y, then (w_x e_x + w_y e_y) x e_z
    row[KIN_ADOT + 5] = wx
    row[KIN_ADOT + 6], row[KIN_ADOT + 7] = wy, -wx


@njit(cache=True, error_model="numpy")
def bias(f, at, body, partial, s, own):
    """Write the accelerations of a frame without those of the coordinates after its partial derivatives.

    They are w x (w x s) + 2 w x s' of the point and sum_c alpha_c' Y_c' of the rotation, each axis Y_c turning with the
    body and the rotations before it.

    Parameters
    ----------
    f : int
        The frame.
    at, partial : ndarray
        Places, and the table of partial derivatives.
    body : ndarray
        The body's row of the kinematics table.
    s : ndarray
        Arm and elastic rate in the first six places, then scratch.
    own : ndarray
        Rates of the angles in ``own[6:9]``, axes Y_c in ``own[9:18]``.
    """
    first = tail_of(f, at) + BIAS
    cross3(body, KIN_W, s, 0, s, 9)
    for c in range(3):
        s[9 + c] += 2.0 * s[3 + c]
    cross3(body, KIN_W, s, 9, s, 12)
    for c in range(3):
        partial[first + c] = s[12 + c]
        partial[first + 3 + c] = 0.0
        s[9 + c] = body[KIN_W + c]
    for axis in range(3):
        cross3(s, 9, own, 9 + 3 * axis, s, 12)
        for c in range(3):
            partial[first + 3 + c] += own[6 + axis] * s[12 + c]
            s[9 + c] += own[6 + axis] * own[9 + 3 * axis + c]


# Chain rule from an elastic frame's own six coordinates to those of its body: angles, displacement and modes.
#
# The derivatives are T_c and what the Hessian has beyond T_c H T_d, both of `gearmbs.dae.equations.bodies.frames`.


POSITION, VELOCITY, FORCE = 0, 1, 2


@njit(cache=True, error_model="numpy")
def coordinates(b, at):
    """Return the number of coordinates that a frame's position depends on: none of the ground."""
    if b == 0:
        return 0
    return 3 + at[b, T.AT_ANGLES] + at[b, T.AT_MODES]


@njit(cache=True, error_model="numpy")
def place(b, i, which, at):
    """Return where the position, the velocity or the force row of coordinate i of a frame is in y."""
    if i < 3:
        return (at[b, T.AT_R] if which == POSITION else at[b, T.AT_U]) + i
    if i < 6:
        column = T.AT_THETA if which == POSITION else T.AT_EPS if which == VELOCITY else T.AT_P
        return at[b, column] + i - 3
    column = T.AT_QF if which == POSITION else T.AT_VF if which == VELOCITY else T.AT_PF
    return at[b, column] + i - 6


@njit(cache=True, error_model="numpy")
def direction(b, i, at, partial, out, k):
    """Write T_i, the derivative of a frame's own coordinates by coordinate i of its body, to ``out[k:k+6]``.

    A rigid body's own coordinates are R and theta, so T_i is a unit vector.
    """
    for c in range(6):
        out[k + c] = 0.0
    if i < 3 or not is_elastic(b, at):
        out[k + i] = 1.0
        return
    row = partials(b, at, partial)[i - 3]
    for c in range(6):
        out[k + c] = row[DP + c]


@njit(cache=True, error_model="numpy")
def curvature(b, i, j, g, k, at, partial, s):
    """Return what the Hessian by coordinates i, j of an elastic frame's body has beyond T_i H T_j.

    Parameters
    ----------
    b : int
        The frame.
    i, j : int
        Coordinates, 3 or more: a displacement has none.
    g : ndarray
        ``g[k:k+6]`` is the gradient by the frame's own coordinates.
    s : ndarray
        Scratch, 3 places.
    """
    if i < 3 or j < 3:
        return 0.0
    d = partials(b, at, partial)
    lo, hi = min(i, j) - 3, max(i, j) - 3
    total = 0.0
    if lo < 3:
        cross3(d[lo], DX, d[hi], DP, s, 0)
        total += dot3(g, k, s, 0)
    x, y = d[lo], d[hi]
    if lo < 3:
        cross3(x, DX, y, DX, s, 0)
    else:
        turned_twice(b, x, y, at, partial, s)
    s[0] -= x[DX + 1] * y[DX + 2] + x[DX + 2] * y[DX + 1]
    s[1] += x[DX] * y[DX + 2] + x[DX + 2] * y[DX]
    s[2] -= x[DX] * y[DX + 1] + x[DX + 1] * y[DX]
    return total + 0.5 * dot3(g, k + 3, s, 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def turned_twice(b, x, y, at, partial, s):
    """Write sum_mn psi_k,m psi_l,n Y_min x Y_max to ``s[0:3]``, given the rows of modes k and l."""
    pairs = tail_of(b, at) + PAIRS
    xy = x[PSI] * y[PSI + 1] + x[PSI + 1] * y[PSI]
    xz = x[PSI] * y[PSI + 2] + x[PSI + 2] * y[PSI]
    yz = x[PSI + 1] * y[PSI + 2] + x[PSI + 2] * y[PSI + 1]
    for c in range(3):
        s[c] = xy * partial[pairs + c] + xz * partial[pairs + 3 + c] + yz * partial[pairs + 6 + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def turns(d):
    """Return whether a mode turns a frame, given its row of the partial derivatives."""
    return d[PSI] != 0.0 or d[PSI + 1] != 0.0 or d[PSI + 2] != 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def is_idle(b, i, blind, at, partial):
    """Return whether coordinate i of a frame's body is a mode that does not move the frame, and if not blind turns it.

    Shapes that are zero stay so in all positions.
    """
    if i < 6:
        return False
    d = partials(b, at, partial)[i - 3]
    if d[DP] != 0.0 or d[DP + 1] != 0.0 or d[DP + 2] != 0.0:
        return False
    return blind or not turns(d)
