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

R_BLOCK_I, T_BLOCK_I, R_BLOCK_J, T_BLOCK_J = 0, 1, 2, 3

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


@njit("void(float64[::1], int64, float64[::1], int64, float64)", cache=True, error_model="numpy")
def copy3(a, i, out, k, factor):
    out[k], out[k + 1], out[k + 2] = factor * a[i], factor * a[i + 1], factor * a[i + 2]


@njit(
    "void(float64[:, ::1], float64[:, ::1], int64, int64, int64, int64, float64[::1], int64)",
    cache=True,
    error_model="numpy",
)
def separation(kin, frame, bi, bj, i, j, out, k):
    """Write P_I - P_J (global) to ``out[k:k+3]``."""
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
    """Return (phi, phi_t); write the spatial gradient to ``g[0:12]`` and that of phi_t to ``gt[0:12]``."""
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
    """Add ``factor`` times the Hessian of a . b (a fixed in I, b in J) over the angle blocks."""
    first_derivatives(axes_i, a, ka, s[0:9])
    first_derivatives(axes_j, b, kb, s[9:18])
    for m in range(3):
        for n in range(3):
            hess[3 + m, 3 + n] += factor * second_derivative_dot(axes_i, s[0:9], b, kb, m, n)
            hess[9 + m, 9 + n] += factor * second_derivative_dot(axes_j, s[9:18], a, ka, m, n)
            cross_term = factor * dot3(s, 3 * m, s, 9 + 3 * n)
            hess[3 + m, 9 + n] += cross_term
            hess[9 + n, 3 + m] += cross_term


@njit(cache=True, error_model="numpy")
def hessian(k, term, fval, marker_body, kin, frame, hess, s):
    """Write the Hessian of term k over [R_I, theta_I, R_J, theta_J] to ``hess[12, 12]``; ``s`` is scratch."""
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
        return
    if kind == ROTATION:
        fun = term[k, T.TERM_FUNCTION]
        f = fval[fun, 0]
        turned_axis(frame, j, f, s, 20)
        product_hessian(ki, kj, frame[i], T.MK_AXES, s[20:23], 0, 1.0, hess, s)
        return
    if kind == ANGLE:
        a = T.MK_AXES
        sn = dot3(frame[i], a, frame[j], a + 3)
        cn = dot3(frame[i], a, frame[j], a)
        rho = cn * cn + sn * sn
        product_hessian(ki, kj, frame[i], a, frame[j], a + 3, cn / rho, hess, s)
        product_hessian(ki, kj, frame[i], a, frame[j], a, -sn / rho, hess, s)
        cross3(frame[i], a, frame[j], a + 3, s, 30)
        cross3(frame[i], a, frame[j], a, s, 33)
        for m in range(3):
            s[m] = dot3(ki, KIN_AXES + 3 * m, s, 30)
            s[6 + m] = dot3(ki, KIN_AXES + 3 * m, s, 33)
            s[3 + m] = -dot3(kj, KIN_AXES + 3 * m, s, 30)
            s[9 + m] = -dot3(kj, KIN_AXES + 3 * m, s, 33)
        ss, cc, sc = -2.0 * sn * cn / rho**2, 2.0 * sn * cn / rho**2, (sn * sn - cn * cn) / rho**2
        for m in range(6):
            row = 3 + m if m < 3 else 6 + m
            for n in range(6):
                col = 3 + n if n < 3 else 6 + n
                hess[row, col] += ss * s[m] * s[n] + cc * s[6 + m] * s[6 + n] + sc * (s[m] * s[6 + n] + s[6 + m] * s[n])
        return
    first_derivatives(ki, frame[i], 0, s[0:9])
    first_derivatives(kj, frame[j], 0, s[9:18])
    if kind == POINT:
        s[20] = s[21] = s[22] = 0.0
        s[20 + term[k, T.TERM_AXES]] = 1.0
        for m in range(3):
            for n in range(3):
                hess[3 + m, 3 + n] = second_derivative_dot(ki, s[0:9], s, 20, m, n)
                hess[9 + m, 9 + n] = -second_derivative_dot(kj, s[9:18], s, 20, m, n)
        return
    separation(kin, frame, bi, bj, i, j, s, 20)
    if kind == DOT2:
        b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
        copy3(frame[j], b, s, 24, 1.0)
        first_derivatives(kj, s, 24, s[30:39])
        for m in range(3):
            for n in range(3):
                hess[m, 9 + n] = hess[9 + n, m] = s[30 + 3 * n + m]
                hess[6 + m, 9 + n] = hess[9 + n, 6 + m] = -s[30 + 3 * n + m]
                hess[3 + m, 3 + n] = second_derivative_dot(ki, s[0:9], s, 24, m, n)
                hess[3 + m, 9 + n] = dot3(s, 3 * m, s, 30 + 3 * n)
                hess[9 + n, 3 + m] = hess[3 + m, 9 + n]
                hess[9 + m, 9 + n] = (
                    second_derivative_dot(kj, s[30:39], s, 20, m, n)
                    - second_derivative_dot(kj, s[9:18], s, 24, m, n)
                    - dot3(s, 30 + 3 * m, s, 9 + 3 * n)
                    - dot3(s, 30 + 3 * n, s, 9 + 3 * m)
                )
        return
    length = np.sqrt(dot3(s, 20, s, 20))
    copy3(s, 20, s, 20, 1.0 / length)
    # columns of d(P_I - P_J)/dq, one 3-vector each, in s[30:66]
    for m in range(3):
        for c in range(3):
            s[30 + 3 * m + c] = 1.0 if m == c else 0.0
            s[48 + 3 * m + c] = -1.0 if m == c else 0.0
            s[39 + 3 * m + c] = s[3 * m + c]
            s[57 + 3 * m + c] = -s[9 + 3 * m + c]
    for m in range(12):
        along = dot3(s, 20, s, 30 + 3 * m)
        for n in range(12):
            hess[m, n] = (dot3(s, 30 + 3 * m, s, 30 + 3 * n) - along * dot3(s, 20, s, 30 + 3 * n)) / length
    for m in range(3):
        for n in range(3):
            hess[3 + m, 3 + n] += second_derivative_dot(ki, s[0:9], s, 20, m, n)
            hess[9 + m, 9 + n] -= second_derivative_dot(kj, s[9:18], s, 20, m, n)
