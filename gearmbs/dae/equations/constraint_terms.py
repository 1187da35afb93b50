"""Constraint terms: the scalar functions of two marker frames that constraint rows are sums of.

A constraint row is Phi = sum_c coef_c phi_c(I_c, J_c) - f(t).  Each term gives its value, its spatial
gradient [dR_I, dpi_I, dR_J, dpi_J] (the bodies', not the markers', variations), the partial time
derivative, the quadratic velocity part of its second time derivative, and its exact Hessian with
respect to the bodies' [R, theta], from which the derivatives of Phi_q^T lambda and Phi_q q' follow.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import KIN_AXES, KIN_R, KIN_V, KIN_W

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


S_FIRST_I = 0
S_FIRST_J = S_FIRST_I + 9
"""In the scratch of `hessian`: first derivatives of the arms, or of two factors, three 3-vectors each."""
S_VECTOR = S_FIRST_J + 9
"""A global direction, the separation, or an axis turned by a motion."""
S_AXIS = S_VECTOR + 3
S_SINE = S_AXIS + 3
S_COSINE = S_SINE + 3
"""Gradients of sine and cosine of an angle by the rotations of I."""
S_FIRST_AXIS = S_COSINE + 3
"""First derivatives of the axis of J."""
S_COLUMNS = S_FIRST_AXIS + 9
"""Derivatives of P_I - P_J by the twelve coordinates, a 3-vector each."""


@njit("float64(float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def dot3(a, i, b, j):
    return a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2]


@njit("void(float64[::1], int64, float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def cross3(a, i, b, j, out, k):
    x = a[i + 1] * b[j + 2] - a[i + 2] * b[j + 1]
    y = a[i + 2] * b[j] - a[i] * b[j + 2]
    z = a[i] * b[j + 1] - a[i + 1] * b[j]
    out[k], out[k + 1], out[k + 2] = x, y, z


@njit("void(float64[::1], int64, float64[::1], int64, float64)", cache=True, error_model="numpy")
def copy3(a, i, out, k, factor):
    out[k], out[k + 1], out[k + 2] = factor * a[i], factor * a[i + 1], factor * a[i + 2]


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


@njit("void(float64[:, ::1], int64, float64, float64[::1], int64, int64)", cache=True, error_model="numpy")
def turned_axes(frame, j, f, out, k, k2):
    """Write n = y_J cos f - x_J sin f to ``out[k:k+3]`` and its derivative dn/df to ``out[k2:k2+3]``."""
    c, s = np.cos(f), np.sin(f)
    for m in range(3):
        x, y = frame[j, T.MK_AXES + m], frame[j, T.MK_AXES + 3 + m]
        out[k + m] = c * y - s * x
        out[k2 + m] = -s * y - c * x


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
        a = T.MK_AXES + 3 * (term[k, T.TERM_AXES] // 3)
        b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
        cross3(frame[i], a, frame[j], b, g, 3)
        copy3(g, 3, g, 9, -1.0)
        return dot3(frame[i], a, frame[j], b), 0.0
    if kind == ROTATION:
        fun = term[k, T.TERM_FUNCTION]
        f, f1 = fval[fun, 0], fval[fun, 1]
        turned_axes(frame, j, f, scratch, 0, 3)
        copy3(scratch, 3, scratch, 3, f1)
        a = T.MK_AXES
        cross3(frame[i], a, scratch, 0, g, 3)
        copy3(g, 3, g, 9, -1.0)
        cross3(frame[i], a, scratch, 3, gt, 3)
        copy3(gt, 3, gt, 9, -1.0)
        return dot3(frame[i], a, scratch, 0), dot3(frame[i], a, scratch, 3)
    if kind == ANGLE:
        a = T.MK_AXES
        s = dot3(frame[i], a, frame[j], a + 3)
        c = dot3(frame[i], a, frame[j], a)
        rho = c * c + s * s
        cross3(frame[i], a, frame[j], a + 3, scratch, 0)
        cross3(frame[i], a, frame[j], a, scratch, 3)
        for m in range(3):
            g[3 + m] = (c * scratch[m] - s * scratch[3 + m]) / rho
            g[9 + m] = -g[3 + m]
        turn = np.arctan2(s, c) - reference[k]
        return reference[k] + turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi)), 0.0
    separation(kin, frame, bi, bj, i, j, scratch, 0)
    if kind == DOT2:
        b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
        copy3(frame[j], b, g, 0, 1.0)
        copy3(frame[j], b, g, 6, -1.0)
        cross3(frame[i], 0, frame[j], b, g, 3)
        for c in range(3):
            scratch[3 + c] = scratch[c] + frame[j, c]
        cross3(frame[j], b, scratch, 3, g, 9)
        return dot3(frame[j], b, scratch, 0), 0.0
    length = np.sqrt(dot3(scratch, 0, scratch, 0))
    copy3(scratch, 0, scratch, 0, 1.0 / length)
    copy3(scratch, 0, g, 0, 1.0)
    copy3(scratch, 0, g, 6, -1.0)
    cross3(frame[i], 0, scratch, 0, g, 3)
    cross3(scratch, 0, frame[j], 0, g, 9)
    return length, 0.0


@njit(cache=True, error_model="numpy")
def product_rates(a, ka, kin_i, kin_j, s):
    """Return first and second rate (without accelerations) of a . b, b in ``s[0:3]`` fixed in body J."""
    cross3(kin_i, KIN_W, a, ka, s, 3)
    cross3(kin_j, KIN_W, s, 0, s, 6)
    first = dot3(s, 3, s, 0) + dot3(a, ka, s, 6)
    second = 2.0 * dot3(s, 3, s, 6)
    cross3(kin_i, KIN_W, s, 3, s, 3)
    cross3(kin_j, KIN_W, s, 6, s, 6)
    return first, second + dot3(s, 3, s, 0) + dot3(a, ka, s, 6)


@njit(cache=True, error_model="numpy")
def quadratic_part(k, term, fval, marker_body, kin, frame, s):
    """Return d2(phi)/dt2 without the terms in accelerations; ``s`` is scratch."""
    kind = term[k, T.TERM_TYPE]
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    if kind == DOT1 or kind == ROTATION or kind == ANGLE:
        a = T.MK_AXES
        if kind == DOT1:
            a += 3 * (term[k, T.TERM_AXES] // 3)
            copy3(frame[j], T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3), s, 0, 1.0)
        f1, f2 = 0.0, 0.0
        if kind == ROTATION:
            fun = term[k, T.TERM_FUNCTION]
            f, f1, f2 = fval[fun, 0], fval[fun, 1], fval[fun, 2]
            turned_axes(frame, j, f, s, 0, 12)
        if kind == ANGLE:
            # the angle's rate is a ratio, so its second derivative follows from those of sine and cosine
            sn = dot3(frame[i], a, frame[j], a + 3)
            cn = dot3(frame[i], a, frame[j], a)
            copy3(frame[j], a + 3, s, 0, 1.0)
            sn1, sn2 = product_rates(frame[i], a, kin[bi], kin[bj], s)
            copy3(frame[j], a, s, 0, 1.0)
            cn1, cn2 = product_rates(frame[i], a, kin[bi], kin[bj], s)
            rho = cn * cn + sn * sn
            rate = (cn * sn1 - sn * cn1) / rho
            return (cn * sn2 - sn * cn2) / rho - rate * 2.0 * (cn * cn1 + sn * sn1) / rho
        _, second = product_rates(frame[i], a, kin[bi], kin[bj], s)
        if kind == ROTATION:
            # b = n(t) on J: b'' has f'' n~ - f'^2 n besides the rigid part, and 2 f' w_J x n~
            cross3(kin[bi], KIN_W, frame[i], a, s, 3)
            cross3(kin[bj], KIN_W, s, 12, s, 6)
            second += (
                f2 * dot3(frame[i], a, s, 12)
                - f1 * f1 * dot3(frame[i], a, s, 0)
                + 2.0 * f1 * (dot3(s, 3, s, 12) + dot3(frame[i], a, s, 6))
            )
        return second
    # centripetal accelerations of the two points
    cross3(kin[bi], KIN_W, frame[i], 0, s, 0)
    cross3(kin[bi], KIN_W, s, 0, s, 3)
    cross3(kin[bj], KIN_W, frame[j], 0, s, 6)
    cross3(kin[bj], KIN_W, s, 6, s, 9)
    if kind == POINT:
        c = term[k, T.TERM_AXES]
        return s[3 + c] - s[9 + c]
    for c in range(3):
        s[c] = kin[bi, KIN_V + c] + s[c] - kin[bj, KIN_V + c] - s[6 + c]
        s[3 + c] -= s[9 + c]
    separation(kin, frame, bi, bj, i, j, s, 6)
    if kind == DOT2:
        b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
        cross3(kin[bj], KIN_W, frame[j], b, s, 9)
        cross3(kin[bj], KIN_W, s, 9, s, 12)
        return dot3(frame[j], b, s, 3) + 2.0 * dot3(s, 9, s, 0) + dot3(s, 12, s, 6)
    length = np.sqrt(dot3(s, 6, s, 6))
    rate = dot3(s, 6, s, 0) / length
    return (dot3(s, 0, s, 0) - rate * rate + dot3(s, 6, s, 3)) / length


@njit("void(float64[::1], float64[::1], int64, float64[::1])", cache=True, error_model="numpy")
def first_derivatives(axes, v, k, d):
    """Write d(v)/d(theta_m) = a_m x v of the body-fixed vector ``v[k:k+3]`` to ``d[3 m:]``."""
    for m in range(3):
        cross3(axes, KIN_AXES + 3 * m, v, k, d, 3 * m)


@njit("float64(float64[::1], float64[::1], float64[::1], int64, int64, int64)", cache=True, error_model="numpy")
def second_derivative_dot(axes, d, b, k, m, n):
    """Return d2(v)/d(theta_m)d(theta_n) . b from the first derivatives ``d`` of v."""
    lo, hi = min(m, n), max(m, n)
    a = KIN_AXES + 3 * lo
    h = 3 * hi
    x = axes[a + 1] * d[h + 2] - axes[a + 2] * d[h + 1]
    y = axes[a + 2] * d[h] - axes[a] * d[h + 2]
    z = axes[a] * d[h + 1] - axes[a + 1] * d[h]
    return x * b[k] + y * b[k + 1] + z * b[k + 2]


@njit(
    "void(float64[::1], float64[::1], float64[::1], int64, float64[::1], int64, float64, float64[:, ::1], "
    "float64[::1])",
    cache=True,
    error_model="numpy",
)
def product_hessian(axes_i, axes_j, a, ka, b, kb, factor, hess, s):
    """Add ``factor`` times the Hessian of a . b over the angle blocks.

    Parameters
    ----------
    axes_i, axes_j : ndarray
        Kinematics of the bodies of I and J.
    a, b : ndarray
        Vectors fixed in I and in J, from their entries ``ka`` and ``kb`` on.
    ka, kb : int
    factor : float
    hess : ndarray, shape (12, 12)
        Is added to.
    s : ndarray
        Scratch.
    """
    first_i, first_j = s[S_FIRST_I:S_FIRST_J], s[S_FIRST_J:S_VECTOR]
    first_derivatives(axes_i, a, ka, first_i)
    first_derivatives(axes_j, b, kb, first_j)
    for m in range(3):
        for n in range(3):
            hess[3 + m, 3 + n] += factor * second_derivative_dot(axes_i, first_i, b, kb, m, n)
            hess[9 + m, 9 + n] += factor * second_derivative_dot(axes_j, first_j, a, ka, m, n)
            cross_term = factor * dot3(first_i, 3 * m, first_j, 3 * n)
            hess[3 + m, 9 + n] += cross_term
            hess[9 + n, 3 + m] += cross_term


@njit(cache=True, error_model="numpy")
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
        Scratch, the places ``S_*``.
    """
    kind = term[k, T.TERM_TYPE]
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    ki, kj = kin[bi], kin[bj]
    for r in range(12):
        for c in range(12):
            hess[r, c] = 0.0
    if kind == DOT1:
        a = T.MK_AXES + 3 * (term[k, T.TERM_AXES] // 3)
        b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
        product_hessian(ki, kj, frame[i], a, frame[j], b, 1.0, hess, s)
    elif kind == ROTATION:
        turned_axis(frame, j, fval[term[k, T.TERM_FUNCTION], 0], s, S_VECTOR)
        product_hessian(ki, kj, frame[i], T.MK_AXES, s[S_VECTOR:S_AXIS], 0, 1.0, hess, s)
    elif kind == ANGLE:
        angle_hessian(ki, kj, frame[i], frame[j], hess, s)
    else:
        first_derivatives(ki, frame[i], T.MK_ARM, s[S_FIRST_I:S_FIRST_J])
        first_derivatives(kj, frame[j], T.MK_ARM, s[S_FIRST_J:S_VECTOR])
        if kind == POINT:
            s[S_VECTOR] = s[S_VECTOR + 1] = s[S_VECTOR + 2] = 0.0
            s[S_VECTOR + term[k, T.TERM_AXES]] = 1.0
            add_arm_hessians(ki, kj, 1.0, hess, s)
            return
        separation(kin, frame, bi, bj, i, j, s, S_VECTOR)
        if kind == DOT2:
            offset_hessian(ki, kj, frame[j], T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3), hess, s)
        else:
            distance_hessian(ki, kj, hess, s)


@njit(cache=True, error_model="numpy")
def angle_hessian(ki, kj, frame_i, frame_j, hess, s):
    """Write the Hessian of the angle of x_I about z_J from x_J, atan2(sine, cosine)."""
    a = T.MK_AXES
    sn = dot3(frame_i, a, frame_j, a + 3)
    cn = dot3(frame_i, a, frame_j, a)
    rho = cn * cn + sn * sn
    product_hessian(ki, kj, frame_i, a, frame_j, a + 3, cn / rho, hess, s)
    product_hessian(ki, kj, frame_i, a, frame_j, a, -sn / rho, hess, s)
    cross3(frame_i, a, frame_j, a + 3, s, S_SINE)
    cross3(frame_i, a, frame_j, a, s, S_COSINE)
    by_sine, by_cosine = s[S_FIRST_I : S_FIRST_I + 6], s[S_FIRST_I + 6 : S_FIRST_I + 12]
    for m in range(3):
        by_sine[m] = dot3(ki, KIN_AXES + 3 * m, s, S_SINE)
        by_cosine[m] = dot3(ki, KIN_AXES + 3 * m, s, S_COSINE)
        by_sine[3 + m] = -dot3(kj, KIN_AXES + 3 * m, s, S_SINE)
        by_cosine[3 + m] = -dot3(kj, KIN_AXES + 3 * m, s, S_COSINE)
    ss, cc, sc = -2.0 * sn * cn / rho**2, 2.0 * sn * cn / rho**2, (sn * sn - cn * cn) / rho**2
    for m in range(6):
        row = 3 + m if m < 3 else 6 + m
        for n in range(6):
            col = 3 + n if n < 3 else 6 + n
            mixed = by_sine[m] * by_cosine[n] + by_cosine[m] * by_sine[n]
            hess[row, col] += ss * by_sine[m] * by_sine[n] + cc * by_cosine[m] * by_cosine[n] + sc * mixed


@njit(cache=True, error_model="numpy")
def add_arm_hessians(ki, kj, factor, hess, s):
    """Add the second derivatives of the two arms along the vector at ``S_VECTOR`` to the angle blocks."""
    for m in range(3):
        for n in range(3):
            at_i = second_derivative_dot(ki, s[S_FIRST_I:S_FIRST_J], s, S_VECTOR, m, n)
            at_j = second_derivative_dot(kj, s[S_FIRST_J:S_VECTOR], s, S_VECTOR, m, n)
            hess[3 + m, 3 + n] += factor * at_i
            hess[9 + m, 9 + n] -= factor * at_j


@njit(cache=True, error_model="numpy")
def offset_hessian(ki, kj, frame_j, axis, hess, s):
    """Write the Hessian of an axis of J times (P_I - P_J)."""
    copy3(frame_j, axis, s, S_AXIS, 1.0)
    first_derivatives(kj, s, S_AXIS, s[S_FIRST_AXIS:S_COLUMNS])
    turned = S_FIRST_AXIS
    for m in range(3):
        for n in range(3):
            hess[m, 9 + n] = hess[9 + n, m] = s[turned + 3 * n + m]
            hess[6 + m, 9 + n] = hess[9 + n, 6 + m] = -s[turned + 3 * n + m]
            hess[3 + m, 3 + n] = second_derivative_dot(ki, s[S_FIRST_I:S_FIRST_J], s, S_AXIS, m, n)
            hess[3 + m, 9 + n] = dot3(s, S_FIRST_I + 3 * m, s, turned + 3 * n)
            hess[9 + n, 3 + m] = hess[3 + m, 9 + n]
            hess[9 + m, 9 + n] = (
                second_derivative_dot(kj, s[S_FIRST_AXIS:S_COLUMNS], s, S_VECTOR, m, n)
                - second_derivative_dot(kj, s[S_FIRST_J:S_VECTOR], s, S_AXIS, m, n)
                - dot3(s, turned + 3 * m, s, S_FIRST_J + 3 * n)
                - dot3(s, turned + 3 * n, s, S_FIRST_J + 3 * m)
            )


@njit(cache=True, error_model="numpy")
def distance_hessian(ki, kj, hess, s):
    """Write the Hessian of |P_I - P_J|, the vector itself at ``S_VECTOR``."""
    length = np.sqrt(dot3(s, S_VECTOR, s, S_VECTOR))
    copy3(s, S_VECTOR, s, S_VECTOR, 1.0 / length)
    for m in range(3):
        for c in range(3):
            column = S_COLUMNS + 3 * m + c
            s[column] = 1.0 if m == c else 0.0
            s[column + 18] = -s[column]
            s[column + 9] = s[S_FIRST_I + 3 * m + c]
            s[column + 27] = -s[S_FIRST_J + 3 * m + c]
    for m in range(12):
        along = dot3(s, S_VECTOR, s, S_COLUMNS + 3 * m)
        for n in range(12):
            across = along * dot3(s, S_VECTOR, s, S_COLUMNS + 3 * n)
            hess[m, n] = (dot3(s, S_COLUMNS + 3 * m, s, S_COLUMNS + 3 * n) - across) / length
    add_arm_hessians(ki, kj, 1.0, hess, s)
