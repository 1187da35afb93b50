"""Where the common face of a tooth pair ends: limits along the mean axis, with their derivatives by the pose."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel


@kernel
def roll_difference(side, wheels, f1, f2):
    """Length of roll on wheel 1 where the two flanks meet half-way between them, axes taken as parallel."""
    base_1 = side.base_1 * (f1 + wheels.wheel_1.half_angle)
    base_2 = side.base_2 * (f2 + wheels.wheel_2.half_angle)
    return 0.5 * (base_1 - base_2 + side.base_difference * side.alpha_0 + side.length)


@kernel
def end_roll(side, wheels, end, roll):
    """Length of roll on wheel 1 at an end of the face, from that at mid-face; ``end`` is +1 or -1."""
    zeta = wheels.face_low if end < 0.0 else wheels.face_high
    return roll - side.twist_1 * (zeta + 0.5 * wheels.axial_shift)


@kernel
def end_value(side, wheel, k, end, sig):
    """Limit set by one wheel's end face, from the transverse contact point at the length of roll ``sig``.

    ``k`` is 0 for wheel 1 and 1 for wheel 2, ``end`` is +1 or -1.
    """
    x = side.x
    X = side.base_1 * side.cos_0 + sig * side.sin_0
    Y = -side.base_1 * side.sin_0 + sig * side.cos_0
    sign = 1.0 if k == 0 else -1.0
    T = end * 0.5 * wheel.face_width - sign * (x[L.P] * X + x[L.Q] * Y)
    if k == 1:
        T -= x[L.P] * x[L.A]
    return -sign * 0.5 * x[L.H] + T * side.i_w


@kernel
def end_slopes(side, wheel, k, end, sig, limit, want):
    """Fill the limit of `end_value` with its gradient and, if wanted, its Hessian by the pose."""
    limit.value = end_value(side, wheel, k, end, sig)
    a, p, q = side.x[L.A], side.x[L.P], side.x[L.Q]
    rb1, rb2, length = side.base_1, side.base_2, side.length
    Rb, difference = side.base_sum, side.base_difference
    sa, ca = side.sin_0, side.cos_0
    X = rb1 * ca + sig * sa
    Y = -rb1 * sa + sig * ca
    sign = 1.0 if k == 0 else -1.0
    extra = 1.0 if k == 1 else 0.0
    T = end * 0.5 * wheel.face_width - sign * (p * X + q * Y) - extra * p * a
    i_w, i_w3, i_w5 = side.i_w, side.i_w3, side.i_w5
    k1 = Rb / (a * length)
    s_a = 0.5 * (difference * k1 + a / length)
    X_a = Y * k1 + s_a * sa
    Y_a = -X * k1 + s_a * ca
    T_a = -sign * (p * X_a + q * Y_a) - extra * p
    T_p = -sign * X - extra * a
    T_q = -sign * Y
    across = p * sa + q * ca
    grad, hess = limit.grad, limit.hess
    grad[L.A] = T_a * i_w
    grad[L.H] = -sign * 0.5
    grad[L.P] = T_p * i_w + T * p * i_w3
    grad[L.Q] = T_q * i_w + T * q * i_w3
    for m in range(2):
        grad[L.F1 + m] = -sign * across * (0.5 * rb1 if m == 0 else -0.5 * rb2) * i_w
    if want == 0:
        return
    k2 = -Rb * (1.0 / (a * a * length) + 1.0 / (length * length * length))
    s_aa = 0.5 * (difference * k2 - Rb * Rb / (length * length * length))
    X_aa = Y_a * k1 + Y * k2 + s_aa * sa + s_a * ca * k1
    Y_aa = -X_a * k1 - X * k2 + s_aa * ca - s_a * sa * k1
    for i in range(6):
        for j in range(6):
            hess[i, j] = 0.0
    T_ap = -sign * X_a - extra
    T_aq = -sign * Y_a
    hess[L.A, L.A] = -sign * (p * X_aa + q * Y_aa) * i_w
    hess[L.A, L.P] = T_ap * i_w + T_a * p * i_w3
    hess[L.A, L.Q] = T_aq * i_w + T_a * q * i_w3
    hess[L.P, L.P] = 2.0 * T_p * p * i_w3 + T * (i_w3 + 3.0 * p * p * i_w5)
    hess[L.P, L.Q] = T_p * q * i_w3 + T_q * p * i_w3 + 3.0 * T * p * q * i_w5
    hess[L.Q, L.Q] = 2.0 * T_q * q * i_w3 + T * (i_w3 + 3.0 * q * q * i_w5)
    for m in range(2):
        s_f = 0.5 * rb1 if m == 0 else -0.5 * rb2
        f = L.F1 + m
        T_f = -sign * across * s_f
        hess[L.A, f] = -sign * (p * ca - q * sa) * s_f * k1 * i_w
        hess[L.P, f] = -sign * sa * s_f * i_w + T_f * p * i_w3
        hess[L.Q, f] = -sign * ca * s_f * i_w + T_f * q * i_w3


@kernel
def limit_value(side, wheels, end, sig):
    """Limit of the common face towards ``end``: the nearer end face of the two wheels, blended where they tie."""
    u = end_value(side, wheels.wheel_1, 0, end, sig)
    v = end_value(side, wheels.wheel_2, 1, end, sig)
    blend = wheels.end_blend
    return 0.5 * (u + v - end * np.sqrt((u - v) * (u - v) + blend * blend))


@kernel
def limit_slopes(side, wheels, end, sig, limit, one, two, want):
    """Fill the limit of `limit_value` with its gradient and, if wanted, its Hessian.

    Parameters
    ----------
    side, wheels : record
    end : float
        -1 at the lower end, +1 at the higher.
    sig : float
        Length of roll on wheel 1 at the transverse contact point.
    limit : record
        Out.
    one, two : record
        Scratch.
    want : int
        Nonzero to fill the Hessian.
    """
    end_slopes(side, wheels.wheel_1, 0, end, sig, one, want)
    end_slopes(side, wheels.wheel_2, 1, end, sig, two, want)
    blend = wheels.end_blend
    u, v = one.value, two.value
    d = u - v
    r = np.sqrt(d * d + blend * blend)
    limit.value = 0.5 * (u + v - end * r)
    wu = 0.5 * (1.0 - end * d / r)
    wv = 1.0 - wu
    for i in range(6):
        limit.grad[i] = wu * one.grad[i] + wv * two.grad[i]
    if want == 0:
        return
    curve = -0.5 * end * blend * blend / (r * r * r)
    for i in range(6):
        di = one.grad[i] - two.grad[i]
        for j in range(i, 6):
            dj = one.grad[j] - two.grad[j]
            value = wu * one.hess[i, j] + wv * two.hess[i, j] + curve * di * dj
            limit.hess[i, j] = value
            limit.hess[j, i] = value
