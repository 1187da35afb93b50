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
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.entries import put, put_pair
from gearmbs.dae.equations.modal_inertia import to_body, to_global
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_ADOT,
    KIN_AXES,
    KIN_DW,
    KIN_FORCE,
    KIN_MOMENT,
    KIN_R,
    KIN_SHIFT,
    KIN_TURN,
    KIN_V,
    KIN_W,
)

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

POSITION, VELOCITY, FORCE = 0, 1, 2

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


# --- coordinates of frames ----------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def coordinates(b, at):
    """Return the number of coordinates that a frame's position depends on: none of the ground."""
    if b == 0:
        return 0
    return 6 + at[b, T.AT_MODES] if is_elastic(b, at) else 6


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
    cross3(d[lo], DX, d[hi], DX, s, 0)
    x, y = d[lo], d[hi]
    s[0] -= x[DX + 1] * y[DX + 2] + x[DX + 2] * y[DX + 1]
    s[1] += x[DX] * y[DX + 2] + x[DX + 2] * y[DX]
    s[2] -= x[DX] * y[DX + 1] + x[DX + 1] * y[DX]
    return total + 0.5 * dot3(g, k + 3, s, 0)


# --- constraint rows ----------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy", forceinline=True)
def turns(d):
    """Return whether a mode turns a frame, given its row of the partial derivatives."""
    return d[DX] != 0.0 or d[DX + 1] != 0.0 or d[DX + 2] != 0.0


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


@njit(cache=True, error_model="numpy", forceinline=True)
def has_second(i, j, same, linear, side):
    """Return whether a row may have a second derivative by coordinates i, j of its sides; see `put_row`.

    Of a side that is linear in the displacement only angles, with angles or modes, have some. A row whose sides are all
    linear is their sum.
    """
    if same and (linear >> side) & 1:
        return i >= 3 and j >= 3 and (i < 6 or j < 6)
    return same or linear != 3


@njit(cache=True, error_model="numpy")
def put_row(
    mode,
    slot,
    vals,
    k,
    frames,
    n_frames,
    linear,
    g,
    g_t,
    hess,
    width,
    coef,
    row,
    lam,
    mu,
    factor,
    rate_rows,
    y,
    at,
    partial,
):
    """Hand over the entries of a constraint row, its rate and its multipliers' forces; return the next entry's number.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`.
    frames, n_frames : ndarray of int, int
        The frames the row depends on.
    linear : int
        Sum of 1 << frame of those whose displacement alone, to first order, enters: modes have no second derivatives.
    g, g_t : ndarray
        Gradients of the row and of its partial time derivative by the frames' own coordinates, six each.
    hess, width : ndarray, int
        Hessian, and the length of its rows.
    coef : float
        Factor of ``g``, ``g_t`` and ``hess``.
    row : ndarray of int, shape (2,)
        Places of lambda and mu in y.
    lam, mu, factor : float
        Multipliers, and their derivative by the unknowns they are made from.
    rate_rows : bool
        Whether the formulation has mu and the rates of the constraints.
    y, at, partial : ndarray
        Unknowns, their places, the frames' partial derivatives.
    """
    t, s = np.empty(12), np.empty(3)
    left = np.empty(6 * n_frames)
    for a in range(n_frames):
        b = frames[a]
        blind = (linear >> a) & 1 == 1
        for i in range(coordinates(b, at)):
            # the gradient of a sum of linear sides is a unit vector for good
            if is_idle(b, i, blind, at, partial) or (linear == 3 and i < 3 and g[6 * a + i] == 0.0):
                continue
            direction(b, i, at, partial, t, 0)
            slope, rate = 0.0, 0.0
            for c in range(6):
                slope += coef * g[6 * a + c] * t[c]
                rate += coef * g_t[6 * a + c] * t[c]
            # a side that is linear has no Hessian by the coordinates of its frame, a sum of such sides none at all
            curved = linear != 3 or not is_elastic(b, at)
            for c in range(6 * n_frames if curved else 0):
                left[c] = 0.0
                for m in range(6):
                    left[c] += t[m] * hess[width * (6 * a + m) + c]
            force, position = place(b, i, FORCE, at), place(b, i, POSITION, at)
            k = put(mode, slot, vals, k, row[0], position, slope)
            k = put(mode, slot, vals, k, force, row[0], factor * slope)
            for a2 in range(n_frames):
                b2 = frames[a2]
                for j in range(coordinates(b2, at)):
                    if not has_second(i, j, a == a2, linear, a) or is_idle(b2, j, (linear >> a2) & 1 == 1, at, partial):
                        continue
                    value = 0.0
                    if curved:
                        direction(b2, j, at, partial, t, 6)
                        for c in range(6):
                            value += left[6 * a2 + c] * t[6 + c]
                    if a == a2 and is_elastic(b, at):
                        value += curvature(b, i, j, g, 6 * a, at, partial, s)
                    value *= coef
                    rate += value * y[place(b2, j, VELOCITY, at)]
                    other = place(b2, j, POSITION, at)
                    k = put(mode, slot, vals, k, force, other, lam * value)
                    if rate_rows:
                        k = put(mode, slot, vals, k, position, other, -mu * value)
            if rate_rows:
                k = put(mode, slot, vals, k, position, row[1], -factor * slope)
                k = put(mode, slot, vals, k, row[1], place(b, i, VELOCITY, at), slope)
                k = put(mode, slot, vals, k, row[1], position, rate)
    return k


@njit(cache=True, error_model="numpy")
def put_spatial(mode, slot, vals, k, row, f, g, h, coef, at, kin, partial):
    """Hand over Phi_q of one elastic frame in the acceleration system, and its mirror image.

    Parameters
    ----------
    row : int
        Row of the constraint.
    g, h : ndarray, int
        ``g[h:h+6]`` is the gradient by displacement and rotation of the frame, ``coef`` its factor.
    """
    s = np.empty(9)
    body = at[f, T.AT_BODY]
    for c in range(3):
        s[c] = kin[f, KIN_R + c] - kin[body, KIN_R + c]
    cross3(s, 0, g, h, s, 3)
    v = at[f, T.AT_V]
    for c in range(3):
        k = put_pair(mode, slot, vals, k, row, v + c, coef * g[h + c])
        k = put_pair(mode, slot, vals, k, row, v + 3 + c, coef * (s[3 + c] + g[h + 3 + c]))
    d = partials(f, at, partial)
    for m in range(at[f, T.AT_MODES]):
        slope = dot3(d[3 + m], DP, g, h) + dot3(d[3 + m], DX, g, h + 3)
        k = put_pair(mode, slot, vals, k, row, at[f, T.AT_V_MODES] + m, coef * slope)
    return k


@njit(cache=True, error_model="numpy")
def bias_rate(f, g, h, at, partial):
    """Return what a frame's acceleration without those of the coordinates adds to the second rate of a constraint."""
    first = at[f, T.AT_PARTIAL] + PARTIALS * (3 + at[f, T.AT_MODES])
    return dot3(g, h, partial, first) + dot3(g, h + 3, partial, first + 3)


# --- loads --------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def bring_to_body(f, at, modal, kin, partial, scratch, out):
    """Bring the forces added up for elastic frame f to its body and to the modes: eq. (5), and mu in eq. (6)."""
    row, body, n = kin[f], kin[at[f, T.AT_BODY]], at[f, T.AT_MODES]
    x, y, z = row[KIN_R] - body[KIN_R], row[KIN_R + 1] - body[KIN_R + 1], row[KIN_R + 2] - body[KIN_R + 2]
    shape, axes = at[f, T.AT_SHAPE] + 3, at[f, T.AT_PARTIAL] + 3 * PARTIALS + DB
    s = vector_at(scratch, 0, 6)
    for pair in range(2):
        # forces with moments, then mu's displacements with its rotations
        along, about = (KIN_FORCE, KIN_MOMENT) if pair == 0 else (KIN_SHIFT, KIN_TURN)
        first, sign = (at[f, T.AT_PF], 1.0) if pair == 0 else (at[f, T.AT_QF], -1.0)
        for c in range(3):
            body[along + c] += row[along + c]
            body[about + c] += row[about + c]
        body[about] += y * row[along + 2] - z * row[along + 1]
        body[about + 1] += z * row[along] - x * row[along + 2]
        body[about + 2] += x * row[along + 1] - y * row[along]
        to_body(body, row, along, s, 0)
        to_body(body, row, about, s, 3)
        fx, fy, fz, tx, ty, tz = sign * s[0], sign * s[1], sign * s[2], sign * s[3], sign * s[4], sign * s[5]
        for k in range(n):
            p, b = shape + 3 * k, axes + PARTIALS * k
            push = modal[p] * fx + modal[p + 1] * fy + modal[p + 2] * fz
            out[first + k] += push + partial[b] * tx + partial[b + 1] * ty + partial[b + 2] * tz


@njit(cache=True, error_model="numpy")
def apply_frame_load(f, s, at, kin, partial, rhs):
    """Add the spatial and modal forces of force ``s[3:6]`` and moment ``s[6:9]`` at elastic frame f."""
    t = np.empty(6)
    body, v = at[f, T.AT_BODY], at[f, T.AT_V]
    for c in range(3):
        t[c] = kin[f, KIN_R + c] - kin[body, KIN_R + c]
    cross3(t, 0, s, 3, t, 3)
    for c in range(3):
        rhs[v + c] += s[3 + c]
        rhs[v + 3 + c] += t[3 + c] + s[6 + c]
    d = partials(f, at, partial)
    for m in range(at[f, T.AT_MODES]):
        rhs[at[f, T.AT_V_MODES] + m] += dot3(d[3 + m], DP, s, 3) + dot3(d[3 + m], DX, s, 6)


@njit(cache=True, error_model="numpy")
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
    d = partials(f, at, partial)
    owner = marker_body[point]
    for i in range(coordinates(f, at)):
        row = place(f, i, FORCE, at)
        if is_idle(f, i, False, at, partial):
            continue
        if i < 3:
            if force >= 0:
                k = put(mode, slot, vals, k, row, force + i, -sign)
            continue
        c = i - 3
        # P_c . F + X_c . (r x F + N): by F it is P_c + X_c x r, by the arm r it is F x X_c
        cross3(d[c], DX, s, 0, s, 9)
        for m in range(3):
            if force >= 0:
                k = put(mode, slot, vals, k, row, force + m, -sign * (d[c, DP + m] + s[9 + m]))
            if torque >= 0:
                k = put(mode, slot, vals, k, row, torque + m, -sign * d[c, DX + m])
        for j in range(3, coordinates(f, at)):
            e = j - 3
            if e >= c >= 3 or is_idle(f, j, False, at, partial):
                # two modes turn one after the other; displacements are linear
                continue
            if c > e >= 3 and not (turns(d[c]) and turns(d[e])):
                continue
            value = 0.0
            if min(c, e) < 3:
                cross3(d[min(c, e)], DX, d[max(c, e)], DP, s, 12)
                value += dot3(s, 12, s, 3)
            if e < c:
                cross3(d[e], DX, d[c], DX, s, 12)
                value += dot3(s, 12, s, 6)
            k = put(mode, slot, vals, k, row, place(f, j, POSITION, at), -value)
        if force >= 0 and owner != f:
            cross3(s, 3, d[c], DX, s, 9)
            k = put_arm(mode, slot, vals, k, row, f, point, s, 1.0, at, marker_body, kin, frame, partial, True)
            k = put_arm(mode, slot, vals, k, row, owner, point, s, -1.0, at, marker_body, kin, frame, partial, False)
    return k


@njit(cache=True, error_model="numpy")
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
    for i in range(coordinates(b, at)):
        if i < 3:
            value = s[9 + i]
        elif is_idle(b, i, True, at, partial):
            continue
        elif is_elastic(b, at):
            # markers of a modal body are at the origins of their frames
            value = dot3(s, 9, partials(b, at, partial)[i - 3], DP)
        elif to_origin:
            continue
        else:
            cross3(kin[b], KIN_AXES + 3 * (i - 3), frame[point], T.MK_ARM, s, 12)
            value = dot3(s, 9, s, 12)
        k = put(mode, slot, vals, k, row, place(b, i, POSITION, at), sign * value)
    return k


@njit(cache=True, error_model="numpy")
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
