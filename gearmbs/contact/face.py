"""Where the common face of a tooth pair ends: limits along the mean axis, with their derivatives by the pose."""

from __future__ import annotations

import numpy as np
from numba import njit

from gearmbs.contact import layout as L

RB, PSI, FACE, WHEEL, EDGE_BLEND = L.RB, L.PSI, L.FACE, L.WHEEL, L.EDGE_BLEND
LIMIT = 43  # value, gradient (6), Hessian (36)


@njit(cache=True)
def _end_of_wheel(wheel, end, gr, x, w, f1, f2, out, o, want):
    """Limit set by one wheel's end face (``end`` is +1 or -1) at the transverse contact point of the pair."""
    a, h, p, q = x[0], x[1], x[2], x[3]
    rb1 = gr[RB]
    rb2 = gr[WHEEL + RB]
    Rb = rb1 + rb2
    length = np.sqrt(a * a - Rb * Rb)
    ca = Rb / a
    sa = length / a
    alpha = np.arctan2(length, Rb)
    sig = 0.5 * (rb1 * (f1 + gr[PSI]) - rb2 * (f2 + gr[WHEEL + PSI]) + (rb1 - rb2) * alpha + length)
    X = rb1 * ca + sig * sa
    Y = -rb1 * sa + sig * ca
    sign = 1.0 if wheel == 0 else -1.0
    half = end * 0.5 * gr[wheel * WHEEL + FACE]
    T = half - sign * (p * X + q * Y)
    if wheel == 1:
        T -= p * a
    iw = 1.0 / w
    out[o] = -sign * 0.5 * h + T * iw
    k1 = Rb / (a * length)
    s_a = 0.5 * ((rb1 - rb2) * k1 + a / length)
    X_a = Y * k1 + s_a * sa
    Y_a = -X * k1 + s_a * ca
    s_f = (0.5 * rb1, -0.5 * rb2)
    extra = 1.0 if wheel == 1 else 0.0
    T_a = -sign * (p * X_a + q * Y_a) - extra * p
    T_p = -sign * X - extra * a
    T_q = -sign * Y
    iw3 = iw**3
    iw5 = iw3 * iw * iw
    out[o + 1] = T_a * iw
    out[o + 2] = -sign * 0.5
    out[o + 3] = T_p * iw + T * p * iw3
    out[o + 4] = T_q * iw + T * q * iw3
    across = p * sa + q * ca
    for k in range(2):
        out[o + 5 + k] = -sign * across * s_f[k] * iw
    if want == 0:
        return
    k2 = -Rb * (1.0 / (a * a * length) + 1.0 / length**3)
    s_aa = 0.5 * ((rb1 - rb2) * k2 - Rb * Rb / length**3)
    X_aa = Y_a * k1 + Y * k2 + s_aa * sa + s_a * ca * k1
    Y_aa = -X_a * k1 - X * k2 + s_aa * ca - s_a * sa * k1
    D = o + 7
    for i in range(36):
        out[D + i] = 0.0
    T_ap = -sign * X_a - extra
    T_aq = -sign * Y_a
    out[D] = -sign * (p * X_aa + q * Y_aa) * iw
    out[D + 2] = T_ap * iw + T_a * p * iw3
    out[D + 3] = T_aq * iw + T_a * q * iw3
    out[D + 14] = 2.0 * T_p * p * iw3 + T * (iw3 + 3.0 * p * p * iw5)
    out[D + 15] = T_p * q * iw3 + T_q * p * iw3 + 3.0 * T * p * q * iw5
    out[D + 21] = 2.0 * T_q * q * iw3 + T * (iw3 + 3.0 * q * q * iw5)
    for k in range(2):
        T_f = -sign * across * s_f[k]
        out[D + 4 + k] = -sign * (p * ca - q * sa) * s_f[k] * k1 * iw
        out[D + 16 + k] = -sign * sa * s_f[k] * iw + T_f * p * iw3
        out[D + 22 + k] = -sign * ca * s_f[k] * iw + T_f * q * iw3
    for i in range(6):
        for j in range(i):
            out[D + 6 * i + j] = out[D + 6 * j + i]


@njit(cache=True)
def face_limit(end, gr, x, w, f1, f2, out, o, want):
    """Limit of the common face towards ``end``: the nearer end face of the two wheels, blended where they tie.

    Fills value, gradient (6) and, if wanted, Hessian (36) at ``out[o:]``, using two more records as scratch.
    """
    u = o + 2 * LIMIT if o == 0 else o + LIMIT
    v = u + LIMIT
    _end_of_wheel(0, end, gr, x, w, f1, f2, out, u, want)
    _end_of_wheel(1, end, gr, x, w, f1, f2, out, v, want)
    blend = gr[EDGE_BLEND]
    d = out[u] - out[v]
    r = np.sqrt(d * d + blend * blend)
    out[o] = 0.5 * (out[u] + out[v] - end * r)
    wu = 0.5 * (1.0 - end * d / r)
    wv = 1.0 - wu
    for i in range(6):
        out[o + 1 + i] = wu * out[u + 1 + i] + wv * out[v + 1 + i]
    if want == 0:
        return
    curve = -0.5 * end * blend * blend / r**3
    for i in range(6):
        di = out[u + 1 + i] - out[v + 1 + i]
        for j in range(6):
            k = 7 + 6 * i + j
            out[o + k] = wu * out[u + k] + wv * out[v + k] + curve * di * (out[u + 1 + j] - out[v + 1 + j])
