"""Constraint terms: the scalar functions of two marker frames that constraint rows are sums of.

A constraint row is Phi = sum_c coef_c phi_c(I_c, J_c) - f(t).  Each term gives its value, its spatial
gradient [dR_I, dpi_I, dR_J, dpi_J] (the bodies', not the markers', variations), the partial time
derivative, and the quadratic velocity part of its second time derivative; `constraint_hessians` has its exact
Hessian, from which the derivatives of Phi_q^T lambda and Phi_q q' follow.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.motions import point_motion, product_motion, vector
from gearmbs.dae.equations.rotation import KIN_R, KIN_V, KIN_W

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


@njit(cache=True, error_model="numpy", forceinline=True)
def product_rates(a, ka, kin_i, kin_j, s):
    """Return first and second rate (without accelerations) of a . b, b in ``s[0:3]`` fixed in body J."""
    _, first, second, _ = product_motion(vector(a, ka), vector(s, 0), vector(kin_i, KIN_W), vector(kin_j, KIN_W))
    return first, second


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
    rate_i, bent_i = point_motion(vector(kin[bi], KIN_V), vector(kin[bi], KIN_W), vector(frame[i], T.MK_ARM))
    rate_j, bent_j = point_motion(vector(kin[bj], KIN_V), vector(kin[bj], KIN_W), vector(frame[j], T.MK_ARM))
    for c in range(3):
        s[c], s[3 + c] = rate_i[c] - rate_j[c], bent_i[c] - bent_j[c]
    if kind == POINT:
        return s[3 + term[k, T.TERM_AXES]]
    separation(kin, frame, bi, bj, i, j, s, 6)
    if kind == DOT2:
        b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
        cross3(kin[bj], KIN_W, frame[j], b, s, 9)
        cross3(kin[bj], KIN_W, s, 9, s, 12)
        return dot3(frame[j], b, s, 3) + 2.0 * dot3(s, 9, s, 0) + dot3(s, 12, s, 6)
    length = np.sqrt(dot3(s, 6, s, 6))
    rate = dot3(s, 6, s, 0) / length
    return (dot3(s, 0, s, 0) - rate * rate + dot3(s, 6, s, 3)) / length
