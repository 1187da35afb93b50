"""Where the common face of a tooth pair ends: limits along the mean axis, with their derivatives by the pose."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel

RB, PSI, FACE, WHEEL, EDGE_BLEND, S_X = L.RB, L.PSI, L.FACE, L.WHEEL, L.EDGE_BLEND, L.S_X
LIMIT = 43  # value, gradient (6), Hessian (36)


@kernel
def _end_of_wheel(wheel, end, gr, wk, f1, f2, o, want):
    """Limit set by one wheel's end face (``end`` is +1 or -1) at the transverse contact point of the pair."""
    a, h, p, q, w = wk[S_X], wk[S_X + 1], wk[S_X + 2], wk[S_X + 3], wk[L.S_W]
    rb1 = gr[RB]
    rb2 = gr[WHEEL + RB]
    Rb = rb1 + rb2
    length, alpha, sa, ca = wk[L.S_LENGTH], wk[L.S_A0], wk[L.S_A0 + 1], wk[L.S_A0 + 2]
    sig = 0.5 * (rb1 * (f1 + gr[PSI]) - rb2 * (f2 + gr[WHEEL + PSI]) + (rb1 - rb2) * alpha + length)
    X = rb1 * ca + sig * sa
    Y = -rb1 * sa + sig * ca
    sign = 1.0 if wheel == 0 else -1.0
    half = end * 0.5 * gr[wheel * WHEEL + FACE]
    T = half - sign * (p * X + q * Y)
    if wheel == 1:
        T -= p * a
    iw = 1.0 / w
    wk[o] = -sign * 0.5 * h + T * iw
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
    wk[o + 1] = T_a * iw
    wk[o + 2] = -sign * 0.5
    wk[o + 3] = T_p * iw + T * p * iw3
    wk[o + 4] = T_q * iw + T * q * iw3
    across = p * sa + q * ca
    for k in range(2):
        wk[o + 5 + k] = -sign * across * s_f[k] * iw
    if want == 0:
        return
    k2 = -Rb * (1.0 / (a * a * length) + 1.0 / length**3)
    s_aa = 0.5 * ((rb1 - rb2) * k2 - Rb * Rb / length**3)
    X_aa = Y_a * k1 + Y * k2 + s_aa * sa + s_a * ca * k1
    Y_aa = -X_a * k1 - X * k2 + s_aa * ca - s_a * sa * k1
    D = o + 7
    for i in range(36):
        wk[D + i] = 0.0
    T_ap = -sign * X_a - extra
    T_aq = -sign * Y_a
    wk[D] = -sign * (p * X_aa + q * Y_aa) * iw
    wk[D + 2] = T_ap * iw + T_a * p * iw3
    wk[D + 3] = T_aq * iw + T_a * q * iw3
    wk[D + 14] = 2.0 * T_p * p * iw3 + T * (iw3 + 3.0 * p * p * iw5)
    wk[D + 15] = T_p * q * iw3 + T_q * p * iw3 + 3.0 * T * p * q * iw5
    wk[D + 21] = 2.0 * T_q * q * iw3 + T * (iw3 + 3.0 * q * q * iw5)
    for k in range(2):
        T_f = -sign * across * s_f[k]
        wk[D + 4 + k] = -sign * (p * ca - q * sa) * s_f[k] * k1 * iw
        wk[D + 16 + k] = -sign * sa * s_f[k] * iw + T_f * p * iw3
        wk[D + 22 + k] = -sign * ca * s_f[k] * iw + T_f * q * iw3
    for i in range(6):
        for j in range(i):
            wk[D + 6 * i + j] = wk[D + 6 * j + i]


@kernel
def face_limit(end, gr, wk, f1, f2, o, want):
    """Limit of the common face towards ``end``: the nearer end face of the two wheels, blended where they tie.

    Fills value, gradient (6) and, if wanted, Hessian (36) at ``wk[o:]``; two more records serve as scratch.
    """
    u = L.W_LIMIT + 2 * LIMIT
    v = u + LIMIT
    _end_of_wheel(0, end, gr, wk, f1, f2, u, want)
    _end_of_wheel(1, end, gr, wk, f1, f2, v, want)
    blend = gr[EDGE_BLEND]
    d = wk[u] - wk[v]
    r = np.sqrt(d * d + blend * blend)
    wk[o] = 0.5 * (wk[u] + wk[v] - end * r)
    wu = 0.5 * (1.0 - end * d / r)
    wv = 1.0 - wu
    for i in range(6):
        wk[o + 1 + i] = wu * wk[u + 1 + i] + wv * wk[v + 1 + i]
    if want == 0:
        return
    curve = -0.5 * end * blend * blend / r**3
    for i in range(6):
        di = wk[u + 1 + i] - wk[v + 1 + i]
        for j in range(6):
            k = 7 + 6 * i + j
            wk[o + k] = wu * wk[u + k] + wv * wk[v + k] + curve * di * (wk[u + 1 + j] - wk[v + 1 + j])
