"""Support functions of tooth profiles in a section across two tilted wheels, with all second derivatives.

A section plane stands across the mean axis. In it the contact normal is ``n = (sin alpha, cos alpha)`` from wheel
1 to wheel 2. The gap of two convex profiles is the largest separation over all directions,

    gap = max over alpha of  a sin(alpha) - 2 (A / w) zeta - h1 - h2,      A = p sin(alpha) + q cos(alpha),

where ``h_i`` is the support function of wheel i, closed form for a tilted involute and for a tilted corner line.
Derivation in ``docs/theory/contact.md``.

A support record holds h and its derivatives by alpha, by the tilt in the frame of the normal (A along it, B
across it) and by the spin angle of the wheel.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel

H, HA_, HAA_, H_A, H_B, H_F, HA_A, HA_B, HA_F, H_AA, H_AB, H_BB, H_AF, H_BF, H_FF = range(15)


@kernel
def tilt_turn(A, B, w):
    """Turn of the normal seen from the wheel's own plane: the angle E added to alpha."""
    arg = A * B / (w * (1.0 + w) + A * A)
    if abs(arg) < 0.02:
        s = arg * arg
        return arg * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s / 9.0))))
    return np.arctan(arg)


@kernel
def involute_support(A, B, w, kap, s, rb, wk, o, want):
    """Support of an involute, ``h = (kap / w) s`` with ``s = rb (phi + psi + alpha + E)``; record at ``wk[o:]``.

    For two meshing involutes together ``s`` and ``rb`` are sums over the wheels.
    """
    iw, iw3, one = wk[L.S_IW], wk[L.S_IW3], wk[L.S_ONE]
    ik = 1.0 / kap
    k = kap * iw
    wk[o + H] = k * s
    wk[o + HA_] = A * B * s * iw * ik + rb * ik
    k_A = kap * A * iw3
    k_B = A * A * B * ik * iw3
    E_A = B * iw * one
    top = w + B * B
    i_bottom = iw * one * ik * ik
    E_B = A * top * i_bottom
    wk[o + H_A] = k_A * s + k * rb * E_A
    wk[o + H_B] = k_B * s + k * rb * E_B
    wk[o + H_F] = k * rb
    if want == 0:
        return
    wk[o + HAA_] = s * (B * B * w * w - A * A * kap * kap) * iw * ik**3
    ab = A * B * iw * ik
    wk[o + HA_F] = ab * rb
    wk[o + H_AF] = k_A * rb
    wk[o + H_BF] = k_B * rb
    wk[o + H_FF] = 0.0
    wk[o + HA_A] = s * B * kap * iw3 + ab * rb * E_A
    ab_B = A * (w * w * kap * kap + B * B * kap * kap + B * B * w * w) * iw3 * ik**3
    wk[o + HA_B] = s * ab_B + ab * rb * E_B + rb * B * ik**3
    w2 = (1.0 + 2.0 * w) * iw3 * one * one
    E_AA = A * B * w2
    E_AB = iw * one + B * B * w2
    top_B = 2.0 * B - B * iw
    bottom_B = -(1.0 + 2.0 * w) * B * iw * kap * kap - 2.0 * w * (1.0 + w) * B
    E_BB = A * (top_B - top * bottom_B * i_bottom) * i_bottom
    iw5 = wk[L.S_IW5]
    k_AA = kap * (w * w + 3.0 * A * A) * iw5
    k_AB = A * (3.0 * kap * B * iw5 - B * ik * iw3)
    k_BB = A * A * (ik * iw3 + B * B * ik**3 * iw3 + 3.0 * B * B * ik * iw5)
    wk[o + H_AA] = s * k_AA + rb * (2.0 * k_A * E_A + k * E_AA)
    wk[o + H_AB] = s * k_AB + rb * (k_A * E_B + k_B * E_A + k * E_AB)
    wk[o + H_BB] = s * k_BB + rb * (2.0 * k_B * E_B + k * E_BB)


@kernel
def corner_support(A, B, w, kap, wk, o, want):
    """Support of the corner line at work, rounded by its radius; record at ``wk[o:]``."""
    sa, ca = wk[L.S_SIN], wk[L.S_COS]
    se, ce, r, rt = wk[L.C_SIN], wk[L.C_COS], wk[L.C_R], wk[L.C_ROUND]
    sn = sa * ce + ca * se
    cs = ca * ce - sa * se
    iw, iw3 = wk[L.S_IW], wk[L.S_IW3]
    ik = 1.0 / kap
    m, m_w = wk[L.S_M], wk[L.S_MW]
    m_A = -m_w * A * iw
    m_B = -m_w * B * iw
    V = A * sn + B * cs
    Ve = A * cs - B * sn
    X = A * sn + V
    wk[o + H] = r * (sn + m * A * V) + rt * kap * iw
    wk[o + HA_] = r * (cs + m * B * V) + rt * A * B * iw * ik
    wk[o + H_A] = r * (m * X + m_A * A * V) + rt * kap * A * iw3
    wk[o + H_B] = r * (m * A * cs + m_B * A * V) + rt * A * A * B * ik * iw3
    wk[o + H_F] = r * (cs + m * A * Ve)
    if want == 0:
        return
    m_ww = wk[L.S_MWW]
    m_AA = m_ww * A * A * iw * iw - m_w * (iw + A * A * iw3)
    m_AB = m_ww * A * B * iw * iw - m_w * A * B * iw3
    m_BB = m_ww * B * B * iw * iw - m_w * (iw + B * B * iw3)
    ik3 = ik**3
    iw5 = wk[L.S_IW5]
    wk[o + HAA_] = -r * (sn + m * A * V) + rt * (B * B * w * w - A * A * kap * kap) * iw * ik3
    wk[o + H_FF] = -r * (sn + m * A * V)
    wk[o + HA_F] = r * (m * B * Ve - sn)
    wk[o + HA_A] = r * B * (m_A * V + m * sn) + rt * B * kap * iw3
    ab_B = A * (w * w * kap * kap + B * B * kap * kap + B * B * w * w) * iw3 * ik3
    wk[o + HA_B] = r * (m_B * B * V + m * V + m * B * cs) + rt * ab_B
    wk[o + H_AF] = r * (m * (A * cs + Ve) + m_A * A * Ve)
    wk[o + H_BF] = r * (m_B * A * Ve - m * A * sn)
    wk[o + H_AA] = r * (2.0 * m * sn + 2.0 * m_A * X + m_AA * A * V) + rt * kap * (w * w + 3.0 * A * A) * iw5
    k_AB = A * (3.0 * kap * B * iw5 - B * ik * iw3)
    wk[o + H_AB] = r * (m_B * X + m * cs + m_AB * A * V + m_A * A * cs) + rt * k_AB
    k_BB = A * A * (ik * iw3 + B * B * ik3 * iw3 + 3.0 * B * B * ik * iw5)
    wk[o + H_BB] = r * (2.0 * m_B * A * cs + m_BB * A * V) + rt * k_BB
