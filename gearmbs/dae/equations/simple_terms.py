"""The two commonest constraint terms, POINT and DOT1, without the general path of `constraint_terms`: their motion,
the forces of their multipliers, and their gradients in the acceleration system.

A POINT term has a unit vector for its translational gradient, a DOT1 term none.
"""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.entries import NUMBERS, add_pair, put_pair
from gearmbs.dae.equations.motions import point_motion, product_motion, product_with_fixed, vector
from gearmbs.dae.equations.rotation import KIN_FORCE, KIN_MOMENT, KIN_R, KIN_SHIFT, KIN_TURN, KIN_V, KIN_W

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
        As in `gearmbs.dae.equations.entries.put`.
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
        As in `gearmbs.dae.equations.entries.put`.
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
