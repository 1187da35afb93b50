"""Constraint terms: the scalar functions of two marker frames that constraint rows are sums of.

A constraint row is Phi = sum_c coef_c phi_c(I_c, J_c) - f(t).  Each term gives its value, its spatial
gradient [dR_I, dpi_I, dR_J, dpi_J] (the bodies', not the markers', variations), the partial time
derivative, and the quadratic velocity part of its second time derivative; `hessians` has its exact
Hessian, from which the derivatives of Phi_q^T lambda and Phi_q q' follow.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import KIN_FORCE, KIN_MOMENT, KIN_R, KIN_SHIFT, KIN_TURN, KIN_V, KIN_W
from gearmbs.dae.equations.unknowns import NUMBERS, add_pair, put_pair
from gearmbs.kernels.jit import njit

# Rates of what constraint terms measure: points fixed in bodies, and products of axes fixed in two bodies.
#
# Vectors are triples of numbers. Second rates are without the terms in accelerations; those of points follow from
# w x (w x r) = (w . r) w - (w . w) r.


@njit(cache=True, error_model="numpy", forceinline=True)
def vector(a, k):
    """Return ``a[k : k + 3]`` as a triple."""
    return a[k], a[k + 1], a[k + 2]


@njit(cache=True, error_model="numpy", forceinline=True)
def scalar_product(a, b):
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def vector_product(a, b):
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy", forceinline=True)
def point_motion(v, w, r):
    """Return the velocity and the second rate of the point r from the origin of a body that moves with v and w."""
    along, square = scalar_product(w, r), scalar_product(w, w)
    rate = v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]
    return rate, (w[0] * along - square * r[0], w[1] * along - square * r[1], w[2] * along - square * r[2])


@njit(cache=True, error_model="numpy", forceinline=True)
def product_motion(a, b, w_a, w_b):
    """Return a . b, its rate and second rate, and a x b, for vectors fixed in bodies that turn with w_a and w_b.

    a x b is the gradient with respect to the rotation of a's body, and its negative that of b's.
    """
    s = vector_product(a, b)
    phi = scalar_product(a, b)
    rate = scalar_product(s, w_a) - scalar_product(s, w_b)
    aa, ab, bb = scalar_product(w_a, w_a), scalar_product(w_a, w_b), scalar_product(w_b, w_b)
    a_a, a_b, b_a, b_b = (
        scalar_product(w_a, a), scalar_product(w_a, b), scalar_product(w_b, a), scalar_product(w_b, b)
    )  # fmt: skip
    return phi, rate, a_a * a_b + b_a * b_b + 2.0 * (ab * phi - a_b * b_a) - (aa + bb) * phi, s


@njit(cache=True, error_model="numpy", forceinline=True)
def product_with_fixed(a, b, w_a):
    """Return what `product_motion` does for a vector b that does not move."""
    s = vector_product(a, b)
    phi = scalar_product(a, b)
    bent = scalar_product(w_a, a) * scalar_product(w_a, b) - scalar_product(w_a, w_a) * phi
    return phi, scalar_product(s, w_a), bent, s


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
        rate, bent = point_motion(vector(row, KIN_V), vector(row, KIN_W), vector(arm, T.MK_ARM))
        for c in range(3):
            out[OFFSET + c] += sign * (row[KIN_R + c] + arm[c])
        out[RATE] += sign * rate[0]
        out[RATE + 1] += sign * rate[1]
        out[RATE + 2] += sign * rate[2]
        out[QUADRATIC] += sign * bent[0]
        out[QUADRATIC + 1] += sign * bent[1]
        out[QUADRATIC + 2] += sign * bent[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def dot_motion(k, term, marker_body, kin, frame, s):
    """Return phi of DOT1 term k, its rate, and its second rate without the terms in accelerations.

    Writes the gradient with respect to the rotation of I's body to ``s[0:3]``; that of J's body is its negative.
    """
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    bi, bj = marker_body[i], marker_body[j]
    a = vector(frame[i], T.MK_AXES + 3 * (term[k, T.TERM_AXES] // 3))
    b = vector(frame[j], T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3))
    if bj == 0:
        phi, rate, bent, cross = product_with_fixed(a, b, vector(kin[bi], KIN_W))
    else:
        phi, rate, bent, cross = product_motion(a, b, vector(kin[bi], KIN_W), vector(kin[bj], KIN_W))
    s[0], s[1], s[2] = cross
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
    a = T.MK_AXES + 3 * (term[k, T.TERM_AXES] // 3)
    b = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
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
