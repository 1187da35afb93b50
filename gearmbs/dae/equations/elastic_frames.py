"""Elastic frames: where the markers of a body with modal coordinates are, and the chain rule to its coordinates.

All that joins bodies (constraint terms, force elements, expressions) sees frames: rows of the kinematics table with a
position, an orientation and their velocities, and gives derivatives by the frames' own six displacements. The frame of
a rigid body is the body. Each marker of a modal body has an elastic frame of its own, with displacement shapes phi_k
and rotation shapes psi_k in body components:

    P   = R + A (s0 + sum_k phi_k q_k)
    A_P = A E_1 E_2 .. E_n,     E_k = rotation by psi_k q_k

The rotations are successive, so that Euler angles and modal coordinates follow one rule: with X_c the axis of
coordinate c (a_c for an angle, A E_1 .. E_(k-1) psi_k for mode k), a vector fixed in the frame has the derivatives
X_c x v and X_min x (X_max x v), min the coordinate that comes first. The points have P_c = a_c x s or A phi_k, and the
second derivatives X_min x P_max where min is an angle, else 0.

As its own coordinates a frame has P and three successive rotations about the global axes, from its present orientation
on: then X_c = e_c. From Hessians in these those in the body's coordinates follow, with g the spatial gradient:

    H_cd = T_c H T_d + g_P . P_cd + g_a . 1/2 (X_min x X_max - sum_mn X_c,m X_d,n e_min x e_max),   T_c = (P_c, X_c)
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import matrix_at, vector_at
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3
from gearmbs.dae.equations.modal_inertia import to_global
from gearmbs.dae.equations.rotation import KIN_A, KIN_ADOT, KIN_AXES, KIN_DW, KIN_R, KIN_V, KIN_W

DP = 0
"""Columns of the table of partial derivatives, a row for each angle and mode: P_c, X_c, then those of V and W."""
DX = 3
DV = 6
DW = 9
DB = 12
"""X_c of a mode in body components."""
PARTIALS = 15
BIAS = 6
"""After the rows: the accelerations of P and of the rotation without those of the coordinates."""

SMALL_TURN = 1e-3
"""Angle below which the series of cosine and sine, three terms each, are exact to rounding."""


def partials_size(modes: int) -> int:
    """Return how many numbers the partial derivatives of an elastic frame take."""
    return PARTIALS * (3 + modes) + BIAS


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


@njit(cache=True, error_model="numpy")
def deform(n, q, v, y, shape, modal, axes, partial, s):
    """Write where a marker has moved in its body, and the modes' axes of rotation X_k in body components.

    The turns E_1 E_2 .. E_n are composed as Euler parameters.

    Parameters
    ----------
    n, q, v : int
        Number of modes, and where the coordinates and their rates are in y.
    y
        Unknowns.
    shape, modal : int, ndarray
        Place of the marker's shapes, and the table they are in.
    axes, partial : int, ndarray
        Place of the first mode's ``DB``, and the table of partial derivatives.
    s : ndarray
        Written: arm in ``s[0:3]``, its rate in ``s[3:6]``, the modes' angular velocity in ``s[6:9]``, E_1 E_2 .. E_n by
        rows in ``s[9:18]``; body components.
    """
    x, y_, z = modal[shape], modal[shape + 1], modal[shape + 2]
    vx = vy = vz = wx = wy = wz = 0.0
    e0, e1, e2, e3 = 1.0, 0.0, 0.0, 0.0
    for k in range(n):
        amount, rate, p, b = y[q + k], y[v + k], shape + 3 + 3 * k, axes + PARTIALS * k
        x += modal[p] * amount
        y_ += modal[p + 1] * amount
        z += modal[p + 2] * amount
        vx += modal[p] * rate
        vy += modal[p + 1] * rate
        vz += modal[p + 2] * rate
        p += 3 * n
        px, py, pz = modal[p], modal[p + 1], modal[p + 2]
        if px == 0.0 and py == 0.0 and pz == 0.0:
            partial[b] = partial[b + 1] = partial[b + 2] = 0.0
            continue
        cx, cy, cz = 2.0 * (e2 * pz - e3 * py), 2.0 * (e3 * px - e1 * pz), 2.0 * (e1 * py - e2 * px)
        bx = px + e0 * cx + e2 * cz - e3 * cy
        by = py + e0 * cy + e3 * cx - e1 * cz
        bz = pz + e0 * cz + e1 * cy - e2 * cx
        partial[b], partial[b + 1], partial[b + 2] = bx, by, bz
        wx += bx * rate
        wy += by * rate
        wz += bz * rate
        half = 0.5 * amount
        square = half * half * (px * px + py * py + pz * pz)
        if square < SMALL_TURN**2:
            sine, cosine = 1.0 - square * (1.0 / 6.0 - square / 120.0), 1.0 - square * (0.5 - square / 24.0)
        else:
            turn = np.sqrt(square)
            sine, cosine = np.sin(turn) / turn, np.cos(turn)
        half *= sine
        px, py, pz = half * px, half * py, half * pz
        e0, e1, e2, e3 = (
            e0 * cosine - e1 * px - e2 * py - e3 * pz,
            e0 * px + e1 * cosine + e2 * pz - e3 * py,
            e0 * py - e1 * pz + e2 * cosine + e3 * px,
            e0 * pz + e1 * py - e2 * px + e3 * cosine,
        )
    s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8] = x, y_, z, vx, vy, vz, wx, wy, wz
    s[9], s[13], s[17] = (
        1.0 - 2.0 * (e2 * e2 + e3 * e3),
        1.0 - 2.0 * (e1 * e1 + e3 * e3),
        1.0 - 2.0 * (e1 * e1 + e2 * e2),
    )
    s[10], s[12] = 2.0 * (e1 * e2 - e0 * e3), 2.0 * (e1 * e2 + e0 * e3)
    s[11], s[15] = 2.0 * (e1 * e3 + e0 * e2), 2.0 * (e1 * e3 - e0 * e2)
    s[14], s[16] = 2.0 * (e2 * e3 - e0 * e1), 2.0 * (e2 * e3 + e0 * e1)


@njit(cache=True, error_model="numpy")
def update_frame(f, y, at, modal, kin, partial, scratch, derivatives):
    """Fill the row of elastic frame f in the kinematics table and its partial derivatives.

    Parameters
    ----------
    f : int
        Row of the frame.
    at, modal : ndarray
        Places of the unknowns; shapes: s0, then phi_k, then psi_k.
    kin, partial : ndarray
        Kinematics table, in which the body's row is up to date; table of partial derivatives.
    scratch : ndarray
        36 places.
    derivatives : bool
        Whether the partial derivatives are wanted: the residual needs none but ``DB``.
    """
    n, q, v = at[f, T.AT_MODES], at[f, T.AT_QF], at[f, T.AT_VF]
    body, row, s, own = kin[at[f, T.AT_BODY]], kin[f], vector_at(scratch, 0, 18), vector_at(scratch, 18, 18)
    deform(n, q, v, y, at[f, T.AT_SHAPE], modal, at[f, T.AT_PARTIAL] + 3 * PARTIALS + DB, partial, own)
    for c in range(3):
        a = KIN_A + 3 * c
        x, y_, z = body[a], body[a + 1], body[a + 2]
        for j in range(3):
            row[a + j] = x * own[9 + j] + y_ * own[12 + j] + z * own[15 + j]
            s[3 * j + c] = x * own[3 * j] + y_ * own[3 * j + 1] + z * own[3 * j + 2]
    # s[0:3] arm, s[3:6] its elastic rate, s[6:9] the modes' angular velocity
    cross3(body, KIN_W, s, 0, s, 9)
    for c in range(3):
        row[KIN_R + c] = body[KIN_R + c] + s[c]
        row[KIN_V + c] = body[KIN_V + c] + s[9 + c] + s[3 + c]
        row[KIN_W + c] = body[KIN_W + c] + s[6 + c]
    own_axes(row)
    if derivatives:
        d = partials(f, at, partial)
        for k in range(n):
            to_global(body, modal, at[f, T.AT_SHAPE] + 3 + 3 * k, d[3 + k], DP)
            to_global(body, d[3 + k], DB, d[3 + k], DX)
        for c in range(3):
            a = KIN_AXES + 3 * c
            cross3(body, a, s, 0, d[c], DP)
            for m in range(3):
                d[c, DX + m] = body[a + m]
        update_rates(n, v, y, body, d, s)
        bias(f, n, v, y, at, body, partial, d, s)


@njit(cache=True, error_model="numpy")
def update_rates(n, v, y, body, d, s):
    """Fill the derivatives of a frame's velocities; ``s[0:9]``: arm, its elastic rate, angular velocity of the modes.

    Parameters
    ----------
    n, v : int
        Number of modes, and where their rates are in y.
    y
        Unknowns.
    body, d : ndarray
        The body's row of the kinematics table; the frame's partial derivatives.
    s : ndarray
        18 places, the last nine of them scratch.
    """
    for c in range(3):
        a = KIN_AXES + 3 * c
        # d(w x s + s')/dtheta_c = dw x s + w x (a x s) + a x s',  d(w + sum b v)/dtheta_c = dw + a x sum b v
        cross3(body, KIN_DW + 3 * c, s, 0, s, 9)
        cross3(body, KIN_W, d[c], DP, s, 12)
        cross3(body, a, s, 3, s, 15)
        for m in range(3):
            d[c, DV + m] = s[9 + m] + s[12 + m] + s[15 + m]
        cross3(body, a, s, 6, s, 9)
        for m in range(3):
            d[c, DW + m] = body[KIN_DW + 3 * c + m] + s[9 + m]
    for c in range(3):
        s[9 + c] = 0.0
    for k in range(n - 1, -1, -1):
        # s[9:12] is the angular velocity of the modes after k
        cross3(body, KIN_W, d[3 + k], DP, d[3 + k], DV)
        cross3(d[3 + k], DX, s, 9, d[3 + k], DW)
        for c in range(3):
            s[9 + c] += y[v + k] * d[3 + k, DX + c]


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
def bias(f, n, v, y, at, body, partial, d, s):
    """Write the accelerations of a frame without those of the coordinates after its partial derivatives.

    They are w x (w x s) + 2 w x s' of the point and sum_k v_k b_k' of the rotation, the axis b_k of mode k turning with
    the body and the modes before it. ``s[0:6]`` holds the arm and its elastic rate.

    Parameters
    ----------
    f, n, v : int
        The frame, its number of modes, and where their rates are in y.
    y
        Unknowns.
    at, partial : ndarray
        Places, and the table of partial derivatives.
    body : ndarray
        The body's row of the kinematics table.
    d : ndarray
        The frame's partial derivatives.
    s : ndarray
        Arm and elastic rate in the first six places, then scratch.
    """
    first = at[f, T.AT_PARTIAL] + PARTIALS * (3 + n)
    cross3(body, KIN_W, s, 0, s, 9)
    for c in range(3):
        s[9 + c] += 2.0 * s[3 + c]
    cross3(body, KIN_W, s, 9, s, 12)
    for c in range(3):
        partial[first + c] = s[12 + c]
        partial[first + 3 + c] = 0.0
        s[9 + c] = body[KIN_W + c]
    for k in range(n):
        cross3(s, 9, d[3 + k], DX, s, 12)
        for c in range(3):
            partial[first + 3 + c] += y[v + k] * s[12 + c]
            s[9 + c] += y[v + k] * d[3 + k, DX + c]
