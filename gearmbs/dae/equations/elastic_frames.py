"""Elastic frames: where the markers of a body with modal coordinates are, and the chain rule to its coordinates.

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

from numba import types

from gearmbs._jit import njit
from gearmbs.dae.compiled.pointers import I8, IMAT, MAT, VEC
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3
from gearmbs.dae.equations.elastic_shapes import deform, shapes_of
from gearmbs.dae.equations.modal_inertia import to_global
from gearmbs.dae.equations.rotation import KIN_A, KIN_ADOT, KIN_AXES, KIN_DW, KIN_R, KIN_V, KIN_W

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
