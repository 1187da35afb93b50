"""The two commonest constraint terms, POINT and DOT1, without the general path of `constraint_terms`.

A POINT term has a unit vector for its translational gradient, a DOT1 term none; centripetal parts follow from
w x (w x r) = (w . r) w - (w . w) r.
"""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.rotation import KIN_R, KIN_V, KIN_W

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
        x, y, z = arm[0], arm[1], arm[2]
        wx, wy, wz = row[KIN_W], row[KIN_W + 1], row[KIN_W + 2]
        out[OFFSET] += sign * (row[KIN_R] + x)
        out[OFFSET + 1] += sign * (row[KIN_R + 1] + y)
        out[OFFSET + 2] += sign * (row[KIN_R + 2] + z)
        out[RATE] += sign * (row[KIN_V] + wy * z - wz * y)
        out[RATE + 1] += sign * (row[KIN_V + 1] + wz * x - wx * z)
        out[RATE + 2] += sign * (row[KIN_V + 2] + wx * y - wy * x)
        along, square = wx * x + wy * y + wz * z, wx * wx + wy * wy + wz * wz
        out[QUADRATIC] += sign * (wx * along - square * x)
        out[QUADRATIC + 1] += sign * (wy * along - square * y)
        out[QUADRATIC + 2] += sign * (wz * along - square * z)


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
    phi = dot3(a, ka, b, kb)
    if marker_body[j] == 0:
        ia, ib, ii = dot3(wi, KIN_W, a, ka), dot3(wi, KIN_W, b, kb), dot3(wi, KIN_W, wi, KIN_W)
        return phi, dot3(s, 0, wi, KIN_W), ia * ib - ii * phi
    rate = dot3(s, 0, wi, KIN_W) - dot3(s, 0, wj, KIN_W)
    ia, ib = dot3(wi, KIN_W, a, ka), dot3(wi, KIN_W, b, kb)
    ja, jb = dot3(wj, KIN_W, a, ka), dot3(wj, KIN_W, b, kb)
    ii, ij, jj = dot3(wi, KIN_W, wi, KIN_W), dot3(wi, KIN_W, wj, KIN_W), dot3(wj, KIN_W, wj, KIN_W)
    return phi, rate, ia * ib + ja * jb + 2.0 * (ij * phi - ib * ja) - (ii + jj) * phi
