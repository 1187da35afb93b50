"""The two commonest constraint terms, POINT and DOT1, without the general path of `constraint_terms`.

A POINT term has a unit vector for its translational gradient, a DOT1 term none; centripetal parts follow from
w x (w x r) = (w . r) w - (w . w) r.
"""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.rotation import KIN_R, KIN_V, KIN_W


@njit(cache=True, error_model="numpy", forceinline=True)
def point_motion(k, term, marker_body, kin, frame):
    """Return phi of POINT term k, its rate, and its second rate without the terms in accelerations."""
    c = term[k, T.TERM_AXES]
    c1 = c + 1 if c < 2 else 0
    c2 = c - 1 if c > 0 else 2
    phi, rate, quadratic = 0.0, 0.0, 0.0
    for side in range(2):
        marker = term[k, T.TERM_I + side]
        row, arm = kin[marker_body[marker]], frame[marker]
        sign = 1.0 - 2.0 * side
        phi += sign * (row[KIN_R + c] + arm[c])
        rate += sign * (row[KIN_V + c] + row[KIN_W + c1] * arm[c2] - row[KIN_W + c2] * arm[c1])
        along, square = dot3(row, KIN_W, arm, 0), dot3(row, KIN_W, row, KIN_W)
        quadratic += sign * (row[KIN_W + c] * along - square * arm[c])
    return phi, rate, quadratic


@njit(cache=True, error_model="numpy", forceinline=True)
def dot_motion(k, term, marker_body, kin, frame, s):
    """Return phi of DOT1 term k, its rate, and its second rate without the terms in accelerations.

    Writes the gradient with respect to the rotation of I's body to ``s[0:3]``; that of J's body is its negative.
    """
    i, j = term[k, T.TERM_I], term[k, T.TERM_J]
    wi, wj = kin[marker_body[i]], kin[marker_body[j]]
    a, b = frame[i], frame[j]
    ka = T.MK_AXES + 3 * (term[k, T.TERM_AXES] // 3)
    kb = T.MK_AXES + 3 * (term[k, T.TERM_AXES] % 3)
    cross3(a, ka, b, kb, s, 0)
    rate = dot3(s, 0, wi, KIN_W) - dot3(s, 0, wj, KIN_W)
    phi = dot3(a, ka, b, kb)
    ia, ib = dot3(wi, KIN_W, a, ka), dot3(wi, KIN_W, b, kb)
    ja, jb = dot3(wj, KIN_W, a, ka), dot3(wj, KIN_W, b, kb)
    ii, ij, jj = dot3(wi, KIN_W, wi, KIN_W), dot3(wi, KIN_W, wj, KIN_W), dot3(wj, KIN_W, wj, KIN_W)
    return phi, rate, ia * ib + ja * jb + 2.0 * (ij * phi - ib * ja) - (ii + jj) * phi
