"""Constraint terms: the scalar functions of two marker frames that constraint rows are sums of.

A constraint row is Phi = sum_c coef_c phi_c(I_c, J_c) - f(t).  Each term gives its value, its spatial
gradient [dR_I, dpi_I, dR_J, dpi_J] (the bodies', not the markers', variations), the partial time
derivative, the quadratic velocity part of its second time derivative, and its exact Hessian, from which the
derivatives of Phi_q^T lambda and Phi_q q' follow. All of them are of `gearmbs.dae.equations.constraints.definitions`.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import derived as D
from gearmbs.dae.equations.rotation import KIN_FORCE, KIN_MOMENT, KIN_R, KIN_SHIFT, KIN_TURN, KIN_V, KIN_W
from gearmbs.dae.equations.unknowns import NUMBERS, add_pair, put_pair
from gearmbs.kernels.jit import njit


@njit(cache=True, error_model="numpy", forceinline=True)
def vector(a, k):
    """Return ``a[k : k + 3]`` as a triple."""
    return a[k], a[k + 1], a[k + 2]


POINT = 0
"""Component c of P_I - P_J, global."""
DOT1 = 1
"""Axis of I times axis of J."""
DOT2 = 2
"""Axis of J times (P_I - P_J)."""
DISTANCE = 3
"""|P_I - P_J|."""
ANGLE = 4
"""Angle of x_I about z_J from x_J, counted through full turns."""
ROTATION = 5
"""x_I times y_J turned by f(t): zero when I is turned by f(t) about z_J."""

HESSIAN_BLOCKS = np.zeros((6, 4, 4), dtype=np.bool_)
"""Which 3x3 blocks of a term's Hessian over [R_I, theta_I, R_J, theta_J] can differ from zero."""
for _kind, _blocks in {
    POINT: [(1, 1), (3, 3)],
    DOT1: [(1, 1), (1, 3), (3, 1), (3, 3)],
    DOT2: [(0, 3), (3, 0), (2, 3), (3, 2), (1, 1), (1, 3), (3, 1), (3, 3)],
    DISTANCE: [(a, b) for a in range(4) for b in range(4)],
    ANGLE: [(1, 1), (1, 3), (3, 1), (3, 3)],
    ROTATION: [(1, 1), (1, 3), (3, 1), (3, 3)],
}.items():
    for _block in _blocks:
        HESSIAN_BLOCKS[(_kind, *_block)] = True


@njit("float64(float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def dot3(a, i, b, j):
    return a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2]


@njit("void(float64[::1], int64, float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def cross3(a, i, b, j, out, k):
    x = a[i + 1] * b[j + 2] - a[i + 2] * b[j + 1]
    y = a[i + 2] * b[j] - a[i] * b[j + 2]
    z = a[i] * b[j + 1] - a[i + 1] * b[j]
    out[k], out[k + 1], out[k + 2] = x, y, z


@njit(cache=True, error_model="numpy", forceinline=True)
def axes_of(term, k):
    """Return where the axes of I and of J stand in the rows of their markers' frames."""
    return T.MK_AXES + 3 * (term[k, T.TERM_AXES] // 3), T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)


@njit(
    "void(float64[:, ::1], float64[:, ::1], int64, int64, int64, int64, float64[::1], int64)",
    cache=True,
    error_model="numpy",
)
def separation(kin, frame, bi, bj, i, j, out, k):
    """Write P_I - P_J (global) to ``out[k:k+3]``.

    Parameters
    ----------
    kin, frame : ndarray
        Kinematics of the bodies and frames of the markers, up to date.
    bi, bj : int
        Bodies of the markers.
    i, j : int
        Markers.
    out : ndarray
    k : int
    """
    for c in range(3):
        out[k + c] = kin[bi, KIN_R + c] + frame[i, c] - kin[bj, KIN_R + c] - frame[j, c]


@njit("void(float64[:, ::1], int64, float64, float64[::1], int64)", cache=True, error_model="numpy")
def turned_axis(frame, j, f, out, k):
    """Write y_J cos f - x_J sin f to ``out[k:k+3]``."""
    c, s = np.cos(f), np.sin(f)
    for m in range(3):
        out[k + m] = c * frame[j, T.MK_AXES + 3 + m] - s * frame[j, T.MK_AXES + m]


@njit(cache=True, error_model="numpy")
def gradient(k, term, fval, reference, marker_body, kin, frame, scratch, g, gt):
    """Return (phi, phi_t); write the spatial gradient of each.

    Parameters
    ----------
    k : int
        Number of the term.
    term : ndarray of int, shape (terms, TERM_COLUMNS)
    fval : ndarray, shape (functions, 3)
        Functions of time with two derivatives.
    reference : ndarray
        Expected values of the counted angles.
    marker_body : ndarray of int
        Body of each marker.
    kin, frame : ndarray
        Kinematics of the bodies and frames of the markers, up to date.
    scratch : ndarray
    g, gt : ndarray, 12 entries
        Receive the gradients of phi and of its partial time derivative: dR, dpi of I's body, then of J's.
    """
    kind = term[k, T.TERM_TYPE]
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    for c in range(12):
        g[c] = 0.0
        gt[c] = 0.0
    if kind == POINT:
        c = term[k, T.TERM_AXES]
        g[c], g[6 + c] = 1.0, -1.0
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        # the c component of dpi x s is dpi_c1 s_c2 - dpi_c2 s_c1
        g[3 + c1], g[3 + c2] = frame[i, c2], -frame[i, c1]
        g[9 + c1], g[9 + c2] = -frame[j, c2], frame[j, c1]
        return kin[bi, KIN_R + c] + frame[i, c] - kin[bj, KIN_R + c] - frame[j, c], 0.0
    if kind == DOT1:
        a, b = axes_of(term, k)
        return D.dot_slopes(frame[i], a, frame[j], b, g), 0.0
    if kind == ROTATION:
        fun = term[k, T.TERM_FUNCTION]
        return D.rotation_slopes(frame[i], frame[j], fval[fun, 0], fval[fun, 1], g, gt)
    if kind == ANGLE:
        sine, cosine = D.angle_slopes(frame[i], frame[j], g)
        turn = np.arctan2(sine, cosine) - reference[k]
        return reference[k] + turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi)), 0.0
    separation(kin, frame, bi, bj, i, j, scratch, 0)
    if kind == DOT2:
        return D.offset_slopes(frame[i], frame[j], axes_of(term, k)[1], scratch, g), 0.0
    return D.distance_slopes(frame[i], frame[j], scratch, g), 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def quadratic_part(k, term, fval, marker_body, kin, frame, s):
    """Return d2(phi)/dt2 without the terms in accelerations; ``s`` is scratch."""
    kind = term[k, T.TERM_TYPE]
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    if kind == POINT:
        relative_motion(i, j, marker_body, kin, frame, s)
        return s[QUADRATIC + term[k, T.TERM_AXES]]
    if kind == DOT1:
        return dot_motion(k, term, marker_body, kin, frame, s)[2]
    if kind == ROTATION:
        f = fval[term[k, T.TERM_FUNCTION]]
        return D.rotation_bent(frame[i], frame[j], f[0], f[1], f[2], kin[bi], kin[bj])
    if kind == ANGLE:
        return D.angle_bent(frame[i], frame[j], kin[bi], kin[bj])
    separation(kin, frame, bi, bj, i, j, s, 0)
    if kind == DOT2:
        return D.offset_bent(frame[i], frame[j], axes_of(term, k)[1], s, kin[bi], kin[bj])
    return D.distance_bent(frame[i], frame[j], s, kin[bi], kin[bj])


@njit(cache=True, error_model="numpy", forceinline=True)
def hessian(k, term, fval, marker_body, kin, frame, hess, s):
    """Write the Hessian of term k over [R_I, theta_I, R_J, theta_J] to ``hess``.

    Parameters
    ----------
    k : int
        Number of the term.
    term : ndarray of int, shape (terms, TERM_COLUMNS)
    fval : ndarray, shape (functions, 3)
        Functions of time with two derivatives.
    marker_body : ndarray of int
        Body of each marker.
    kin, frame : ndarray
        Kinematics of the bodies and frames of the markers, up to date.
    hess : ndarray, shape (12, 12)
        Receives the result.
    s : ndarray
        Scratch.
    """
    kind = term[k, T.TERM_TYPE]
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    ki, kj = kin[bi], kin[bj]
    for r in range(12):
        for c in range(12):
            hess[r, c] = 0.0
    if kind == POINT:
        c = term[k, T.TERM_AXES]
        D.point_curves(c, (c + 1) % 3, (c + 2) % 3, frame[i], frame[j], ki, kj, hess)
        return
    if kind == DOT1 or kind == ROTATION:
        a, b = axes_of(term, k)
        second = frame[j]
        if kind == ROTATION:
            a, b, second = T.MK_AXES, 0, s
            turned_axis(frame, j, fval[term[k, T.TERM_FUNCTION], 0], s, 0)
        D.dot_curves(frame[i], a, second, b, ki, kj, hess)
        return
    if kind == ANGLE:
        D.angle_curves(frame[i], frame[j], ki, kj, hess)
    else:
        separation(kin, frame, bi, bj, i, j, s, 0)
        if kind == DOT2:
            D.offset_curves(frame[i], frame[j], axes_of(term, k)[1], s, ki, kj, hess)
        else:
            D.distance_curves(frame[i], frame[j], s, ki, kj, hess)
    for r in range(12):
        for c in range(r):
            hess[r, c] = hess[c, r]


# The two commonest constraint terms, POINT and DOT1, without the general path above: their motion,
# the forces of their multipliers, and their gradients in the acceleration system.
#
# A POINT term has a unit vector for its translational gradient, a DOT1 term none.


OFFSET, RATE, QUADRATIC = 0, 3, 6
RELATIVE = 9
"""Places of what `relative_motion` writes, three components each, and how many there are."""


@njit(cache=True, error_model="numpy", forceinline=True)
def relative_motion(i, j, marker_body, kin, frame, out):
    """Write the offset of marker i from marker j, its rate, and its second rate without the terms in accelerations.

    These are phi, phi' and the quadratic part of the three POINT terms of the markers.
    """
    for c in range(RELATIVE):
        out[c] = 0.0
    for side in range(2):
        marker = i if side == 0 else j
        body = marker_body[marker]
        sign = 1.0 - 2.0 * side
        arm = frame[marker]
        if body == 0:
            for c in range(3):
                out[OFFSET + c] += sign * arm[c]
            continue
        row = kin[body]
        v0, v1, v2, b0, b1, b2 = D.point_motion(vector(row, KIN_V), vector(row, KIN_W), vector(arm, T.MK_ARM))
        for c in range(3):
            out[OFFSET + c] += sign * (row[KIN_R + c] + arm[c])
        out[RATE] += sign * v0
        out[RATE + 1] += sign * v1
        out[RATE + 2] += sign * v2
        out[QUADRATIC] += sign * b0
        out[QUADRATIC + 1] += sign * b1
        out[QUADRATIC + 2] += sign * b2


@njit(cache=True, error_model="numpy", forceinline=True)
def dot_motion(k, term, marker_body, kin, frame, s):
    """Return phi of DOT1 term k, its rate, and its second rate without the terms in accelerations.

    Writes the gradient with respect to the rotation of I's body to ``s[0:3]``; that of J's body is its negative.
    """
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    at_a, at_b = axes_of(term, k)
    a, b, w = vector(frame[i], at_a), vector(frame[j], at_b), vector(kin[bi], KIN_W)
    if bj == 0:
        phi, rate, bent, s[0], s[1], s[2] = D.dot_with_fixed(a, b, w)
    else:
        phi, rate, bent, s[0], s[1], s[2] = D.dot_motion(a, b, w, vector(kin[bj], KIN_W))
    return phi, rate, bent


@njit(cache=True, error_model="numpy", forceinline=True)
def add_point_term(k, coef, lam, mu, term, marker_body, kin, frame):
    """As the general path of `add_constraints` for a POINT term, whose gradient is a unit vector; return Phi and Phi'.

    Parameters
    ----------
    k, coef : int, float
        The term and its coefficient.
    lam, mu : float
        Multipliers of its row.
    term : ndarray of int
        Table of terms.
    marker_body, kin, frame
        Tables of the markers' frames, of kinematics and of markers.
    """
    c = term[k, T.TERM_AXES]
    c1 = c + 1 if c < 2 else 0
    c2 = c - 1 if c > 0 else 2
    value, rate = 0.0, 0.0
    for side in range(2):
        marker = term[k, T.TERM_I + side]
        b = marker_body[marker]
        sign = coef if side == 0 else -coef
        row = kin[b]
        x1, x2 = frame[marker, T.MK_ARM + c1], frame[marker, T.MK_ARM + c2]
        value += sign * (row[KIN_R + c] + frame[marker, T.MK_ARM + c])
        if b == 0:
            continue
        rate += sign * (row[KIN_V + c] + row[KIN_W + c1] * x2 - row[KIN_W + c2] * x1)
        force, shift = sign * lam, sign * mu
        row[KIN_FORCE + c] += force
        row[KIN_MOMENT + c1] += force * x2
        row[KIN_MOMENT + c2] -= force * x1
        row[KIN_SHIFT + c] += shift
        row[KIN_TURN + c1] += shift * x2
        row[KIN_TURN + c2] -= shift * x1
    return value, rate


@njit(cache=True, error_model="numpy", forceinline=True)
def add_dot_term(k, coef, lam, mu, term, marker_body, kin, frame, s):
    """As the general path of `add_constraints` for a DOT1 term, which has no translations; return Phi and Phi'.

    Parameters
    ----------
    k, coef : int, float
        The term and its coefficient.
    lam, mu : float
        Multipliers of its row.
    term : ndarray of int
        Table of terms.
    marker_body, kin, frame
        Tables of the markers' frames, of kinematics and of markers.
    s : ndarray
        Scratch of 3 places.
    """
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    a, b = axes_of(term, k)
    cross3(frame[i], a, frame[j], b, s, 0)
    rate = 0.0
    for side in range(2):
        body = marker_body[i if side == 0 else j]
        if body == 0:
            continue
        sign = coef if side == 0 else -coef
        row = kin[body]
        rate += sign * dot3(s, 0, row, KIN_W)
        for c in range(3):
            row[KIN_MOMENT + c] += sign * lam * s[c]
            row[KIN_TURN + c] += sign * mu * s[c]
    return coef * dot3(frame[i], a, frame[j], b), rate


@njit(cache=True, error_model="numpy", forceinline=True)
def put_point(mode, slot, vals, k, row, coef, term, at, marker_body, frame):
    """Hand over the gradient of a POINT term; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As in `gearmbs.dae.equations.unknowns.put`.
    row : int
        Row of the matrix: number of coordinates + number of the constraint row.
    coef : float
        Coefficient of the term.
    term : ndarray of int, shape (TERM_COLUMNS,)
        The term's row of the table of terms.
    at, marker_body, frame
        Tables of places, of the markers' bodies and of markers.
    """
    c = term[T.TERM_AXES]
    c1 = c + 1 if c < 2 else 0
    c2 = c - 1 if c > 0 else 2
    for side in range(2):
        marker = term[T.TERM_I + side]
        if marker_body[marker] == 0:
            continue
        sign = coef if side == 0 else -coef
        if mode == NUMBERS:
            k = add_pair(slot, vals, k, sign)
            k = add_pair(slot, vals, k, sign * frame[marker, T.MK_ARM + c2])
            k = add_pair(slot, vals, k, -sign * frame[marker, T.MK_ARM + c1])
            continue
        q = at[marker_body[marker], T.AT_V]
        k = put_pair(mode, slot, vals, k, row, q + c, sign)
        k = put_pair(mode, slot, vals, k, row, q + 3 + c1, sign * frame[marker, T.MK_ARM + c2])
        k = put_pair(mode, slot, vals, k, row, q + 3 + c2, -sign * frame[marker, T.MK_ARM + c1])
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def put_dot(mode, slot, vals, k, row, coef, term, at, marker_body, cross):
    """Hand over the gradient of a DOT1 term, given that of its first side; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As in `gearmbs.dae.equations.unknowns.put`.
    row : int
        Row of the matrix: number of coordinates + number of the constraint row.
    coef : float
        Coefficient of the term.
    term : ndarray of int, shape (TERM_COLUMNS,)
        The term's row of the table of terms.
    at, marker_body
        Tables of places and of the markers' bodies.
    cross : ndarray
        Gradient of phi with respect to the rotation of I's body, in the first three places, as `dot_motion` writes it.
    """
    for side in range(2):
        body = marker_body[term[T.TERM_I + side]]
        if body == 0:
            continue
        sign = coef if side == 0 else -coef
        if mode == NUMBERS:
            for c in range(3):
                k = add_pair(slot, vals, k, sign * cross[c])
            continue
        for c in range(3):
            k = put_pair(mode, slot, vals, k, row, at[body, T.AT_V] + 3 + c, sign * cross[c])
    return k
