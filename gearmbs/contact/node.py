"""The gap of one pair of profiles in one section: solve for the normal, then value, gradient and Hessian.

A wheel's profile is either its involute (kind 0) or its tip corner (kind 1).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gearmbs.contact import layout as L
from gearmbs.contact import support as S
from gearmbs.contact.support import corner_support, involute_support, tilt_turn

H, HA_, HAA_, H_A, H_B, H_F = S.H, S.HA_, S.HAA_, S.H_A, S.H_B, S.H_F
HA_A, HA_B, HA_F = S.HA_A, S.HA_B, S.HA_F
H_AA, H_AB, H_BB, H_AF, H_BF, H_FF = S.H_AA, S.H_AB, S.H_BB, S.H_AF, S.H_BF, S.H_FF
N_ALPHA, N_SIN, N_COS, N_GAP, N_GRAD, N_HESS = L.N_ALPHA, L.N_SIN, L.N_COS, L.N_GAP, L.N_GRAD, L.N_HESS
N_DALPHA, N_PN, N_PT, N_DPN, N_DPT = L.N_DALPHA, L.N_PN, L.N_PT, L.N_DPN, L.N_DPT
N_S1, N_S2 = L.N_S1, L.N_S2
RB, PSI, S_TIP, WHEEL = L.RB, L.PSI, L.S_TIP, L.WHEEL
R_CORNER, PSI_CORNER, R_ROUND = L.R_CORNER, L.PSI_CORNER, L.R_ROUND
N_KIND = L.N_KIND
SUP_LENGTH = 15
NEWTON_STEPS = 20


@njit(cache=True)
def flank_normal(a, p, q, w, S0, rb, zeta, alpha):
    """Operating angle of the common normal of two involutes, by Newton's method from ``alpha``.

    ``S0`` is the sum of ``rb (phi + psi)`` over the wheels and ``rb`` the sum of the base radii.
    """
    for _ in range(NEWTON_STEPS):
        sa = np.sin(alpha)
        ca = np.cos(alpha)
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap2 = 1.0 - B * B
        kap = np.sqrt(kap2)
        s = S0 + rb * (alpha + tilt_turn(A, B, w))
        g1 = a * ca - A * B * s / (w * kap) - rb / kap - 2.0 * B * zeta / w
        g2 = -a * sa - s * (B * B * w * w - A * A * kap2) / (w * kap * kap2) + 2.0 * A * zeta / w
        step = -g1 / g2
        alpha += step
        if abs(step) < 1e-9:
            break
    return alpha


@njit(cache=True)
def corner_normal(a, p, q, w, s0, rb, se, ce, r, rt, zeta, alpha):
    """Operating angle of the normal where a corner line bears on an involute; ``s0 = rb (phi + psi)``."""
    m = 1.0 / (w * (1.0 + w))
    for _ in range(NEWTON_STEPS):
        sa = np.sin(alpha)
        ca = np.cos(alpha)
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap2 = 1.0 - B * B
        kap = np.sqrt(kap2)
        s = s0 + rb * (alpha + tilt_turn(A, B, w)) + rt
        sn = sa * ce + ca * se
        cs = ca * ce - sa * se
        V = A * sn + B * cs
        g1 = a * ca - A * B * s / (w * kap) - rb / kap - r * (cs + m * B * V) - 2.0 * B * zeta / w
        g2 = -a * sa - s * (B * B * w * w - A * A * kap2) / (w * kap * kap2) + r * (sn + m * A * V)
        g2 += 2.0 * A * zeta / w
        step = -g1 / g2
        if abs(step) > 0.1:
            step = 0.1 if step > 0.0 else -0.1
        alpha += step
        if abs(step) < 1e-9:
            break
    return alpha


@njit(cache=True)
def corner_start(a, rb, se, ce, r):
    """Operating angle at which a corner bears on an involute when the axes are parallel; NaN inside the base circle."""
    X = a - r * ce
    Y = -r * se
    R2 = X * X + Y * Y
    if not R2 > rb * rb * 1.0001:
        return np.nan
    return np.arccos(rb / np.sqrt(R2)) - np.arctan2(Y, X)


@njit(cache=True)
def section_gap(gr, kind, x, w, f1, f2, zeta, alpha, rec, o, sup, want):
    """Fill the node record at ``rec[o:]`` with the gap at the normal ``alpha`` and its derivatives by the pose.

    Parameters
    ----------
    kind : int
        0: flank on flank; 1: corner of wheel 1 on flank of wheel 2; 2: corner of wheel 2 on flank of wheel 1.
    x : ndarray, shape (6,)
        Pose numbers; the spin angles in it are not used.
    f1, f2 : float
        Angles of the two teeth from the line of centres.
    want : int
        Nonzero to fill second derivatives.
    """
    a, p, q = x[0], x[2], x[3]
    sa = np.sin(alpha)
    ca = np.cos(alpha)
    A = p * sa + q * ca
    B = p * ca - q * sa
    kap = np.sqrt(1.0 - B * B)
    turned = alpha + tilt_turn(A, B, w)
    for k in range(2):
        base = k * WHEEL
        f = f1 if k == 0 else f2
        if kind == k + 1:
            eta = f + gr[base + PSI_CORNER]
            se = np.sin(eta)
            ce = np.cos(eta)
            r = gr[base + R_CORNER]
            corner_support(A, B, w, kap, sa, ca, se, ce, r, gr[base + R_ROUND], sup, k * SUP_LENGTH, want)
            rec[o + N_S1 + k] = gr[base + S_TIP]
        else:
            rb = gr[base + RB]
            s = rb * (f + gr[base + PSI] + turned)
            involute_support(A, B, w, kap, s, rb, sup, k * SUP_LENGTH, want)
            rec[o + N_S1 + k] = s
    b = SUP_LENGTH
    iw = 1.0 / w
    iw3 = iw * iw * iw
    AW_A = kap * kap * iw3
    AW_B = A * B * iw3
    gA = -(sup[H_A] + sup[b + H_A]) - 2.0 * zeta * AW_A
    gB = -(sup[H_B] + sup[b + H_B]) - 2.0 * zeta * AW_B
    gap = a * sa - 2.0 * A * iw * zeta - sup[H] - sup[b + H]
    rec[o + N_ALPHA] = alpha
    rec[o + N_SIN] = sa
    rec[o + N_COS] = ca
    rec[o + N_GAP] = gap
    rec[o + N_KIND] = kind
    G = o + N_GRAD
    rec[G] = sa
    rec[G + 1] = 0.0
    rec[G + 2] = gA * sa + gB * ca
    rec[G + 3] = gA * ca - gB * sa
    rec[G + 4] = -sup[H_F]
    rec[G + 5] = -sup[b + H_F]
    if want == 0:
        return
    # mixed derivatives of the gap by alpha and by the pose, then the Hessian with alpha eliminated
    gaa = -a * sa - sup[HAA_] - sup[b + HAA_] + 2.0 * A * iw * zeta
    gaA = -(sup[HA_A] + sup[b + HA_A]) - 2.0 * zeta * AW_B
    gaB = -(sup[HA_B] + sup[b + HA_B]) - 2.0 * zeta * (iw + B * B * iw3)
    D = o + N_DALPHA
    rec[D] = ca
    rec[D + 1] = 0.0
    rec[D + 2] = gaA * sa + gaB * ca
    rec[D + 3] = gaA * ca - gaB * sa
    rec[D + 4] = -sup[HA_F]
    rec[D + 5] = -sup[b + HA_F]
    iw5 = iw3 * iw * iw
    gAA = -(sup[H_AA] + sup[b + H_AA]) - 6.0 * zeta * kap * kap * A * iw5
    gAB = -(sup[H_AB] + sup[b + H_AB]) - 2.0 * zeta * (3.0 * kap * kap * B * iw5 - 2.0 * B * iw3)
    gBB = -(sup[H_BB] + sup[b + H_BB]) - 2.0 * zeta * A * (iw3 + 3.0 * B * B * iw5)
    T = o + N_HESS
    for i in range(36):
        rec[T + i] = 0.0
    rec[T + 14] = gAA * sa * sa + 2.0 * gAB * sa * ca + gBB * ca * ca
    rec[T + 15] = (gAA - gBB) * sa * ca + gAB * (ca * ca - sa * sa)
    rec[T + 21] = gAA * ca * ca - 2.0 * gAB * sa * ca + gBB * sa * sa
    rec[T + 16] = -(sup[H_AF] * sa + sup[H_BF] * ca)
    rec[T + 22] = -(sup[H_AF] * ca - sup[H_BF] * sa)
    rec[T + 17] = -(sup[b + H_AF] * sa + sup[b + H_BF] * ca)
    rec[T + 23] = -(sup[b + H_AF] * ca - sup[b + H_BF] * sa)
    rec[T + 28] = -sup[H_FF]
    rec[T + 35] = -sup[b + H_FF]
    inv = -1.0 / gaa
    for i in range(6):
        d = rec[D + i] * inv
        for j in range(i, 6):
            value = rec[T + 6 * i + j] + d * rec[D + j]
            rec[T + 6 * i + j] = value
            rec[T + 6 * j + i] = value
    for i in range(6):
        rec[D + i] *= inv


@njit(cache=True)
def contact_point(gr, kind, x, w, f1, zeta, rec, o, sup, want):
    """Fill where the contact stands in the section, half-way between the surfaces, and its derivatives.

    The record at ``rec[o:]`` must hold the section's gap. Coordinates are along the normal and the tangent
    ``(cos alpha, -sin alpha)``, from the centre of wheel 1.
    """
    p, q = x[2], x[3]
    sa, ca = rec[o + N_SIN], rec[o + N_COS]
    A = p * sa + q * ca
    B = p * ca - q * sa
    kap = np.sqrt(1.0 - B * B)
    iw = 1.0 / w
    if kind == 1:
        eta = f1 + gr[PSI_CORNER]
        se, ce = np.sin(eta), np.cos(eta)
        corner_support(A, B, w, kap, sa, ca, se, ce, gr[R_CORNER], gr[R_ROUND], sup, 0, want)
    else:
        rb = gr[RB]
        involute_support(A, B, w, kap, rb * (f1 + gr[PSI] + rec[o + N_ALPHA] + tilt_turn(A, B, w)), rb, sup, 0, want)
    zp = zeta + 0.5 * x[1]
    pt = sup[HA_] + B * iw * zp
    rec[o + N_PN] = sup[H] + A * iw * zp + 0.5 * rec[o + N_GAP]
    rec[o + N_PT] = pt
    if want == 0:
        return
    iw3 = iw * iw * iw
    AW_B = A * B * iw3
    dn = sup[HAA_] - A * iw * zp
    n_A = sup[H_A] + kap * kap * iw3 * zp
    n_B = sup[H_B] + AW_B * zp
    t_A = sup[HA_A] + AW_B * zp
    t_B = sup[HA_B] + (iw + B * B * iw3) * zp
    N = o + N_DPN
    P = o + N_DPT
    for i in range(6):
        rec[N + i] = 0.5 * rec[o + N_GRAD + i] + pt * rec[o + N_DALPHA + i]
        rec[P + i] = dn * rec[o + N_DALPHA + i]
    rec[N + 1] += 0.5 * A * iw
    rec[P + 1] += 0.5 * B * iw
    rec[N + 2] += n_A * sa + n_B * ca
    rec[N + 3] += n_A * ca - n_B * sa
    rec[P + 2] += t_A * sa + t_B * ca
    rec[P + 3] += t_A * ca - t_B * sa
    rec[N + 4] += sup[H_F]
    rec[P + 4] += sup[HA_F]
