"""Reactions of joints as unknowns, for loads that depend on them: joint friction, JOINT() in expressions.

A REACTION element acts on nothing. Its F and N are the force and moment that chosen constraint rows
exert on the body of their marker I, about that marker's origin, global components:

    F = -sum_r lambda_r Phi_r,R    N = -sum_r lambda_r (Phi_r,pi - s x Phi_r,R)

with s the arm of marker I. Its dependency list names the bodies of the rows' markers, then the
multipliers' places in y.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.loads import expressions
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import I8, IVEC, MAT, VEC
from gearmbs.kernels.structs import matrix_at, vector_at


@njit("void(float64[:, ::1], int64, int64, float64, float64[:, ::1], int64, int64, float64[::1], int64)",
      cache=True, error_model="numpy")  # fmt: skip
def add_cross_columns(jac, qi, qj, factor, frame, i, a, b, bk):
    """Add ``factor`` d(a x b) to the moment rows: a is an axis of marker i on I's body, b is fixed in J's body.

    Parameters
    ----------
    jac : ndarray, shape (6, FORCE_WIDTH)
        Derivatives of F and N, 12 columns a body of the dependency list.
    qi, qj : int
        Places of I's and J's body in that list, -1 of a body without one.
    factor : float
        Moment, N m.
    frame : ndarray, shape (markers, MK_COLUMNS)
        Table of markers, up to date.
    i, a : int
        Marker I, and the place of the axis in its row of ``frame``.
    b, bk : ndarray, int
        Global components of b, from ``b[bk]`` on.
    """
    ax, ay, az = frame[i, a], frame[i, a + 1], frame[i, a + 2]
    bx, by, bz = b[bk], b[bk + 1], b[bk + 2]
    dot = ax * bx + ay * by + az * bz
    for r in range(3):
        ar, br = frame[i, a + r], b[bk + r]
        for c in range(3):
            on = factor * dot if r == c else 0.0
            if qi >= 0:
                # (dpi x a) x b = a (b . dpi) - dpi (a . b)
                jac[3 + r, 12 * qi + 3 + c] += factor * ar * b[bk + c] - on
            if qj >= 0:
                # a x (dpi x b) = dpi (a . b) - b (a . dpi)
                jac[3 + r, 12 * qj + 3 + c] += on - factor * br * frame[i, a + c]


@njit(cache=True, error_model="numpy")
def add_direction_columns(jac, q, factor, e, k):
    """Add ``factor`` dpi x e to the force rows, e fixed in the body of block q."""
    if q >= 0:
        expressions.turn_columns(jac, 0, q, factor * e[k], factor * e[k + 1], factor * e[k + 2])


@njit(cache=True, error_model="numpy")
def add_distance_columns(jac, qi, qj, factor, i, j, tab, s):
    """Add ``factor`` d(e) to the force rows, e the direction from J to I.

    Parameters
    ----------
    jac : ndarray, shape (6, FORCE_WIDTH)
        Derivatives of F and N, 12 columns a body of the dependency list.
    qi, qj : int
        Places of I's and J's body in that list, -1 of a body without one.
    factor : float
        Minus the row's multiplier times the term's coefficient, N.
    i, j : int
        Markers.
    tab : Tables
    s : ndarray
        Scratch, 3 places.
    """
    terms.separation(tab.kin, tab.frame, tab.marker_body[i], tab.marker_body[j], i, j, s, 0)
    length = terms.dot3(s, 0, s, 0) ** 0.5
    for side in range(2):
        q, marker = (qi, i) if side == 0 else (qj, j)
        if q >= 0:
            sign = (factor if side == 0 else -factor) / length
            expressions.add_projector_columns(
                jac, q, sign, s[0] / length, s[1] / length, s[2] / length, tab.frame, marker
            )


@njit(cache=True, error_model="numpy")
def add_angle_columns(jac, qi, qj, factor, i, j, frame, s):
    """Add ``factor`` d(m), m = (c x_I x y_J - s x_I x x_J)/(c^2 + s^2) the moment of a counted angle.

    Parameters
    ----------
    jac : ndarray, shape (6, FORCE_WIDTH)
        Derivatives of F and N, 12 columns a body of the dependency list.
    qi, qj : int
        Places of I's and J's body in that list, -1 of a body without one.
    factor : float
        Minus the row's multiplier times the term's coefficient, N m.
    i, j : int
        Markers.
    frame : ndarray, shape (markers, MK_COLUMNS)
        Table of markers, up to date.
    s : ndarray
        Scratch, 9 places.
    """
    x, y = T.MK_AXES, T.MK_AXES + 3
    sine = terms.dot3(frame[i], x, frame[j], y)
    cosine = terms.dot3(frame[i], x, frame[j], x)
    rho = cosine * cosine + sine * sine
    terms.cross3(frame[i], x, frame[j], y, s, 0)
    terms.cross3(frame[i], x, frame[j], x, s, 3)
    for c in range(3):
        s[6 + c] = (cosine * s[c] - sine * s[3 + c]) / rho
    add_cross_columns(jac, qi, qj, factor * cosine / rho, frame, i, x, frame[j], y)
    add_cross_columns(jac, qi, qj, -factor * sine / rho, frame, i, x, frame[j], x)
    for r in range(3):
        for c in range(3):
            # d(sine) = s[0:3] . (dpi_I - dpi_J), d(cosine) = s[3:6] . (dpi_I - dpi_J)
            turn = (s[3 + c] * s[r] - s[c] * s[3 + r]) / rho
            turn -= s[6 + r] * 2.0 * (cosine * s[3 + c] + sine * s[c]) / rho
            if qi >= 0:
                jac[3 + r, 12 * qi + 3 + c] += factor * turn
            if qj >= 0:
                jac[3 + r, 12 * qj + 3 + c] -= factor * turn


@njit(cache=True, error_model="numpy")
def add_term_columns(k, factor, depends, tab, jac, s):
    """Add the derivatives of ``factor`` times the unit force and moment of one constraint term."""
    kind = tab.term[k, T.TERM_TYPE]
    i, j = tab.term[k, T.TERM_I], tab.term[k, T.TERM_J]
    qi = expressions.slot_of(tab, depends, tab.marker_body[i])
    qj = expressions.slot_of(tab, depends, tab.marker_body[j])
    axes = tab.term[k, T.TERM_AXES]
    if kind == terms.DOT1:
        a, b = T.MK_AXES + 3 * (axes // 3), T.MK_AXES + 3 * (axes % 3)
        add_cross_columns(jac, qi, qj, factor, tab.frame, i, a, tab.frame[j], b)
    elif kind == terms.ROTATION:
        terms.turned_axis(tab.frame, j, tab.fval[tab.term[k, T.TERM_FUNCTION], 0], s, 0)
        add_cross_columns(jac, qi, qj, factor, tab.frame, i, T.MK_AXES, s, 0)
    elif kind == terms.ANGLE:
        add_angle_columns(jac, qi, qj, factor, i, j, tab.frame, s)
    elif kind == terms.DOT2:
        add_direction_columns(jac, qj, factor, tab.frame[j], T.MK_AXES + 3 * (axes % 3))
    elif kind == terms.DISTANCE:
        add_distance_columns(jac, qi, qj, factor, i, j, tab, s)


@njit(types.void(IVEC, VEC, I8, T.TABLES, VEC, VEC, MAT, I8), cache=True, late=True, error_model="numpy")
def reaction_wrench(row, multipliers, first_multiplier, tab, room, wrench, jac, want_jac):
    """Fill F and N of a REACTION element and, if wanted, their derivatives.

    Parameters
    ----------
    multipliers : ndarray
        lambda of all rows; ``first_multiplier`` is the place of the first in y.
    room : ndarray
        Scratch, 64 places.
    jac : ndarray
        Columns: 12 variations of each body of the dependency list, then one a multiplier.
    """
    depends = row[T.FORCE_DEPENDS]
    bodies = tab.extra_i[depends]
    count = tab.extra_i[depends + 1 + bodies]
    g, gt, s = room[0:12], room[12:24], room[24:64]
    for c in range(6):
        wrench[c] = 0.0
    if want_jac != 0:
        for r in range(6):
            for c in range(jac.shape[1]):
                jac[r, c] = 0.0
    for q in range(count):
        r = tab.extra_i[depends + 2 + bodies + q] - first_multiplier
        first = tab.row[r, T.ROW_FIRST]
        for k in range(first, tab.row[r + 1, T.ROW_FIRST]):
            if tab.term[k, T.TERM_I] != tab.term[first, T.TERM_I]:
                continue
            terms.gradient(k, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt)
            terms.cross3(tab.frame[tab.term[k, T.TERM_I]], T.MK_ARM, g, 0, s, 0)
            for c in range(3):
                g[3 + c] -= s[c]
            lam, coef = multipliers[r], tab.coef[k]
            for c in range(6):
                wrench[c] -= lam * coef * g[c]
                if want_jac != 0:
                    jac[c, 12 * bodies + q] -= coef * g[c]
            if want_jac != 0:
                add_term_columns(k, -lam * coef, depends, tab, jac, s)


@njit(cache=True, error_model="numpy")
def renew_reactions(y, multipliers, idata, tab):
    """Put the reactions that belong to ``multipliers`` into y; return the largest relative change."""
    change, size = 0.0, 1e-9
    room, wrench = vector_at(tab.scratch, 0, 64), vector_at(tab.scratch, 64, 6)
    for f in range(idata[T.H_FORCES]):
        row = tab.force[f]
        if row[T.FORCE_KIND] != T.REACTION:
            continue
        width = row[T.FORCE_WIDTH]
        jac = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, width)
        reaction_wrench(row, multipliers, idata[T.H_LAMBDA], tab, room, wrench, jac, np.int64(0))
        for c in range(6):
            at = row[T.FORCE_F] + c if c < 3 else row[T.FORCE_N] + c - 3
            change = max(change, abs(y[at] - wrench[c]))
            size = max(size, abs(wrench[c]))
            y[at] = wrench[c]
    return change / size


@njit("float64(float64[::1], float64[::1], int64[::1], float64[::1], float64[::1])", cache=True, error_model="numpy")
def reactions_from(multipliers, y, idata, rdata, work):
    """As `renew_reactions`, for tables packed in arrays; those in ``work`` must be up to date."""
    return renew_reactions(y, multipliers, idata, T.unpack(idata, rdata, work))
