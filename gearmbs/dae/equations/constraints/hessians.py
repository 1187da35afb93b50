"""Exact Hessians of the constraint terms with respect to [R_I, theta_I, R_J, theta_J], and their blocks of zeros."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.terms import (
    ANGLE,
    DISTANCE,
    DOT1,
    DOT2,
    POINT,
    ROTATION,
    copy3,
    cross3,
    dot3,
    separation,
    turned_axis,
)
from gearmbs.dae.equations.rotation import KIN_AXES
from gearmbs.kernels.jit import njit

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
