"""The gap of one pair of profiles in one section: solve for the normal, then value, gradient and Hessian.

A wheel's profile is either its involute or its tip corner. The pose is the one at ``S_X`` in the scratch array, the
normal the one at ``S_ALPHA``; the corner at work stands at ``C_SIN`` and on.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact import support as S
from gearmbs.contact.jit import kernel
from gearmbs.contact.support import corner_support, involute_support, tilt_turn

H, HA_, HAA_, H_A, H_B, H_F = S.H, S.HA_, S.HAA_, S.H_A, S.H_B, S.H_F
HA_A, HA_B, HA_F = S.HA_A, S.HA_B, S.HA_F
H_AA, H_AB, H_BB, H_AF, H_BF, H_FF = S.H_AA, S.H_AB, S.H_BB, S.H_AF, S.H_BF, S.H_FF
N_ALPHA, N_SIN, N_COS, N_GAP, N_GRAD, N_HESS = L.N_ALPHA, L.N_SIN, L.N_COS, L.N_GAP, L.N_GRAD, L.N_HESS
N_DALPHA, N_PN, N_PT, N_DPN, N_DPT = L.N_DALPHA, L.N_PN, L.N_PT, L.N_DPN, L.N_DPT
N_S1, N_KIND = L.N_S1, L.N_KIND
RB, PSI, WHEEL = L.RB, L.PSI, L.WHEEL
S_A, S_H, S_P, S_Q, S_W = L.S_X, L.S_X + 1, L.S_X + 2, L.S_X + 3, L.S_W
S_ALPHA, S_SIN, S_COS, S_SLOPE = L.S_ALPHA, L.S_SIN, L.S_COS, L.S_SLOPE
C_SIN, C_COS, C_R, C_ROUND, C_STRING = L.C_SIN, L.C_COS, L.C_R, L.C_ROUND, L.C_STRING
SUP1 = L.W_SUP
SUP2 = L.W_SUP + 15
NEWTON_STEPS = 20
NEWTON_END = 1e-6  # a further step would change alpha by about the square of it


@kernel
def turn_normal(wk, step):
    """Advance the running normal by a small angle."""
    wk[S_ALPHA] += step
    if abs(step) > 0.1:
        wk[S_SIN] = np.sin(wk[S_ALPHA])
        wk[S_COS] = np.cos(wk[S_ALPHA])
        return
    d2 = step * step
    c = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0 - d2 / 40320.0)))
    s = step * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0 - d2 * (1.0 / 5040.0 - d2 / 362880.0))))
    sa = wk[S_SIN]
    ca = wk[S_COS]
    wk[S_SIN] = sa * c + ca * s
    wk[S_COS] = ca * c - sa * s


@kernel
def flank_normal(wk, s0, rb, zeta):
    """Turn the running normal onto the common normal of two involutes, by Newton's method.

    ``s0`` is the sum of ``rb (phi + psi)`` over the wheels and ``rb`` the sum of the base radii.
    """
    a, p, q, w, iw = wk[S_A], wk[S_P], wk[S_Q], wk[S_W], wk[L.S_IW]
    for _ in range(NEWTON_STEPS):
        sa = wk[S_SIN]
        ca = wk[S_COS]
        A = p * sa + q * ca
        B = p * ca - q * sa
        ik2 = 1.0 / (1.0 - B * B)
        ik = np.sqrt(ik2)
        s = s0 + rb * (wk[S_ALPHA] + tilt_turn(A, B, w))
        g1 = a * ca - A * B * s * iw * ik - rb * ik - 2.0 * B * zeta * iw
        g2 = 1.0 / (s * (A * A * iw - B * B * w * ik2) * ik - a * sa + 2.0 * A * zeta * iw)
        step = -g1 * g2
        turn_normal(wk, step)
        if abs(step) < NEWTON_END:
            wk[S_SLOPE] = 2.0 * B * iw * g2
            break


@kernel
def corner_start(wk, X, Y, rb):
    """Turn the running normal onto the mate's involute under a corner that stands ``(X, Y)`` from the mate's axis.

    Axes are taken as parallel; the corner is outside the base circle.
    """
    R2 = X * X + Y * Y
    string = np.sqrt(R2 - rb * rb)
    sa = (string * X - rb * Y) / R2
    ca = (rb * X + string * Y) / R2
    wk[S_ALPHA] += np.arctan2(sa * wk[S_COS] - ca * wk[S_SIN], ca * wk[S_COS] + sa * wk[S_SIN])
    wk[S_SIN] = sa
    wk[S_COS] = ca


@kernel
def corner_normal(wk, s0, rb, zeta):
    """Turn the running normal onto that where the corner at work bears on the mate's involute, by Newton's method.

    ``s0`` is the mate's ``rb (phi + psi)``. Returns False when the iteration does not settle.
    """
    a, p, q, w, iw = wk[S_A], wk[S_P], wk[S_Q], wk[S_W], wk[L.S_IW]
    se, ce, r, rt = wk[C_SIN], wk[C_COS], wk[C_R], wk[C_ROUND]
    m = wk[L.S_M]
    for _ in range(NEWTON_STEPS):
        sa = wk[S_SIN]
        ca = wk[S_COS]
        A = p * sa + q * ca
        B = p * ca - q * sa
        ik2 = 1.0 / (1.0 - B * B)
        ik = np.sqrt(ik2)
        s = s0 + rb * (wk[S_ALPHA] + tilt_turn(A, B, w)) + rt
        sn = sa * ce + ca * se
        cs = ca * ce - sa * se
        V = A * sn + B * cs
        g1 = a * ca - A * B * s * iw * ik - rb * ik - r * (cs + m * B * V) - 2.0 * B * zeta * iw
        g2 = s * (A * A * iw - B * B * w * ik2) * ik - a * sa + r * (sn + m * A * V) + 2.0 * A * zeta * iw
        step = -g1 / g2
        if abs(step) > 0.1:
            step = 0.1 if step > 0.0 else -0.1
        turn_normal(wk, step)
        if abs(step) < NEWTON_END:
            wk[S_SLOPE] = 2.0 * B * iw / g2
            return True
    return False


@kernel
def share_spin(wk, share, want):
    """Split the derivatives by the spin of two involutes taken together: wheel 1 has this share of the base radii."""
    wk[SUP1 + H_F] *= share
    if want != 0:
        for k in (HA_F, H_AF, H_BF, H_FF):
            wk[SUP2 + k] = (1.0 - share) * wk[SUP1 + k]
            wk[SUP1 + k] *= share


@kernel
def add_supports(wk, want):
    """Add the second support record to the first, except for the derivatives by the spins."""
    for k in (H, H_A, H_B):
        wk[SUP1 + k] += wk[SUP2 + k]
    if want != 0:
        for k in (HAA_, HA_A, HA_B, H_AA, H_AB, H_BB):
            wk[SUP1 + k] += wk[SUP2 + k]


@kernel
def section_gap(gr, wk, kind, f1, f2, zeta, o, want):
    """Fill the node record at ``wk[o:]`` with the gap at the running normal and its derivatives by the pose.

    Parameters
    ----------
    kind : int
        0: flank on flank; 1: corner of wheel 1 on flank of wheel 2; 2: corner of wheel 2 on flank of wheel 1.
    f1, f2 : float
        Angles of the two teeth from the line of centres.
    zeta : float
        Station along the mean axis.
    want : int
        Nonzero to fill second derivatives.
    """
    a, p, q, w = wk[S_A], wk[S_P], wk[S_Q], wk[S_W]
    sa = wk[S_SIN]
    ca = wk[S_COS]
    A = p * sa + q * ca
    B = p * ca - q * sa
    kap = np.sqrt(1.0 - B * B)
    turned = wk[S_ALPHA] + tilt_turn(A, B, w)
    rb1 = gr[RB]
    rb2 = gr[WHEEL + RB]
    s1 = rb1 * (f1 + gr[PSI] + turned)
    s2 = rb2 * (f2 + gr[WHEEL + PSI] + turned)
    if kind == 0:
        involute_support(A, B, w, kap, s1 + s2, rb1 + rb2, wk, SUP1, want)
        second = wk[SUP1 + H_F] * rb2 / (rb1 + rb2)
        share_spin(wk, rb1 / (rb1 + rb2), want)
    elif kind == 1:
        s1 = wk[C_STRING]
        corner_support(A, B, w, kap, wk, SUP1, want)
        involute_support(A, B, w, kap, s2, rb2, wk, SUP2, want)
        second = wk[SUP2 + H_F]
        add_supports(wk, want)
    else:
        s2 = wk[C_STRING]
        involute_support(A, B, w, kap, s1, rb1, wk, SUP1, want)
        corner_support(A, B, w, kap, wk, SUP2, want)
        second = wk[SUP2 + H_F]
        add_supports(wk, want)
    wk[o + N_S1] = s1
    wk[o + N_S1 + 1] = s2
    iw, iw3 = wk[L.S_IW], wk[L.S_IW3]
    AW_A = kap * kap * iw3
    AW_B = A * B * iw3
    gA = -wk[SUP1 + H_A] - 2.0 * zeta * AW_A
    gB = -wk[SUP1 + H_B] - 2.0 * zeta * AW_B
    wk[o + N_ALPHA] = wk[S_ALPHA]
    wk[o + N_SIN] = sa
    wk[o + N_COS] = ca
    wk[o + N_GAP] = a * sa - 2.0 * A * iw * zeta - wk[SUP1 + H]
    wk[o + N_KIND] = kind
    G = o + N_GRAD
    wk[G] = sa
    wk[G + 1] = 0.0
    wk[G + 2] = gA * sa + gB * ca
    wk[G + 3] = gA * ca - gB * sa
    wk[G + 4] = -wk[SUP1 + H_F]
    wk[G + 5] = -second
    if want == 0:
        return
    # mixed derivatives of the gap by alpha and by the pose, then the Hessian with alpha eliminated
    gaa = -a * sa - wk[SUP1 + HAA_] + 2.0 * A * iw * zeta
    gaA = -wk[SUP1 + HA_A] - 2.0 * zeta * AW_B
    gaB = -wk[SUP1 + HA_B] - 2.0 * zeta * (iw + B * B * iw3)
    D = o + N_DALPHA
    wk[D] = ca
    wk[D + 1] = 0.0
    wk[D + 2] = gaA * sa + gaB * ca
    wk[D + 3] = gaA * ca - gaB * sa
    wk[D + 4] = -wk[SUP1 + HA_F]
    wk[D + 5] = -wk[SUP2 + HA_F]
    iw5 = wk[L.S_IW5]
    gAA = -wk[SUP1 + H_AA] - 6.0 * zeta * kap * kap * A * iw5
    gAB = -wk[SUP1 + H_AB] - 2.0 * zeta * (3.0 * kap * kap * B * iw5 - 2.0 * B * iw3)
    gBB = -wk[SUP1 + H_BB] - 2.0 * zeta * A * (iw3 + 3.0 * B * B * iw5)
    T = o + N_HESS
    for i in range(36):
        wk[T + i] = 0.0
    wk[T + 14] = gAA * sa * sa + 2.0 * gAB * sa * ca + gBB * ca * ca
    wk[T + 15] = (gAA - gBB) * sa * ca + gAB * (ca * ca - sa * sa)
    wk[T + 21] = gAA * ca * ca - 2.0 * gAB * sa * ca + gBB * sa * sa
    wk[T + 16] = -(wk[SUP1 + H_AF] * sa + wk[SUP1 + H_BF] * ca)
    wk[T + 22] = -(wk[SUP1 + H_AF] * ca - wk[SUP1 + H_BF] * sa)
    wk[T + 17] = -(wk[SUP2 + H_AF] * sa + wk[SUP2 + H_BF] * ca)
    wk[T + 23] = -(wk[SUP2 + H_AF] * ca - wk[SUP2 + H_BF] * sa)
    wk[T + 28] = -wk[SUP1 + H_FF]
    wk[T + 35] = -wk[SUP2 + H_FF]
    inv = -1.0 / gaa
    for i in range(6):
        d = wk[D + i] * inv
        for j in range(i, 6):
            value = wk[T + 6 * i + j] + d * wk[D + j]
            wk[T + 6 * i + j] = value
            wk[T + 6 * j + i] = value
    for i in range(6):
        wk[D + i] *= inv


@kernel
def contact_point(gr, wk, kind, f1, zeta, o, want):
    """Fill where the contact stands in the section, half-way between the surfaces, and its derivatives.

    The record at ``wk[o:]`` must hold the section's gap. Coordinates are along the normal and the tangent
    ``(cos alpha, -sin alpha)``, from the centre of wheel 1.
    """
    p, q, w = wk[S_P], wk[S_Q], wk[S_W]
    sa, ca = wk[o + N_SIN], wk[o + N_COS]
    A = p * sa + q * ca
    B = p * ca - q * sa
    kap = np.sqrt(1.0 - B * B)
    iw, iw3 = wk[L.S_IW], wk[L.S_IW3]
    if kind == 1:
        wk[S_SIN] = sa
        wk[S_COS] = ca
        corner_support(A, B, w, kap, wk, SUP1, want)
    else:
        s = gr[RB] * (f1 + gr[PSI] + wk[o + N_ALPHA] + tilt_turn(A, B, w))
        involute_support(A, B, w, kap, s, gr[RB], wk, SUP1, want)
    zp = zeta + 0.5 * wk[S_H]
    pt = wk[SUP1 + HA_] + B * iw * zp
    wk[o + N_PN] = wk[SUP1 + H] + A * iw * zp + 0.5 * wk[o + N_GAP]
    wk[o + N_PT] = pt
    if want == 0:
        return
    AW_B = A * B * iw3
    dn = wk[SUP1 + HAA_] - A * iw * zp
    n_A = wk[SUP1 + H_A] + kap * kap * iw3 * zp
    n_B = wk[SUP1 + H_B] + AW_B * zp
    t_A = wk[SUP1 + HA_A] + AW_B * zp
    t_B = wk[SUP1 + HA_B] + (iw + B * B * iw3) * zp
    N = o + N_DPN
    P = o + N_DPT
    for i in range(6):
        wk[N + i] = 0.5 * wk[o + N_GRAD + i] + pt * wk[o + N_DALPHA + i]
        wk[P + i] = dn * wk[o + N_DALPHA + i]
    wk[N + 1] += 0.5 * A * iw
    wk[P + 1] += 0.5 * B * iw
    wk[N + 2] += n_A * sa + n_B * ca
    wk[N + 3] += n_A * ca - n_B * sa
    wk[P + 2] += t_A * sa + t_B * ca
    wk[P + 3] += t_A * ca - t_B * sa
    wk[N + 4] += wk[SUP1 + H_F]
    wk[P + 4] += wk[SUP1 + HA_F]
