"""Support functions of tooth profiles in a section across two tilted wheels, with all second derivatives.

A section plane stands across the mean axis. In it the contact normal is ``n = (sin alpha, cos alpha)`` from wheel
1 to wheel 2. The gap of two convex profiles is the largest separation over all directions,

    gap = max over alpha of  a sin(alpha) - 2 (A / w) zeta - h1 - h2,      A = p sin(alpha) + q cos(alpha),

where ``h_i`` is the support function of wheel i, closed form for a tilted involute and for a tilted corner line.
Derivation in ``docs/theory/contact.md``.

Derivatives are by alpha, by the tilt in the frame of the normal (A along it, B across it) and by the spin angle F of
the wheel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.contact.jit import inlined

GENTLE = 0.02
"""Turns of the normal below this are taken from a series."""


class Tilt(NamedTuple):
    """How the axes lean, and what follows from it alone."""

    p: float
    q: float
    w: float
    i_w: float
    i_w3: float
    i_w5: float
    i_1w: float
    m: float
    m_w: float
    m_ww: float
    gentle: float


class Slopes(NamedTuple):
    """First derivatives of a support function, and itself."""

    h: float
    alpha: float
    A: float
    B: float
    F: float


class Curvatures(NamedTuple):
    """Second derivatives of a support function."""

    alpha_alpha: float
    alpha_A: float
    alpha_B: float
    alpha_F: float
    AA: float
    AB: float
    BB: float
    AF: float
    BF: float
    FF: float


@inlined
def tilt_of(side):
    """Copy the tilt out of a side's record, so that loops need not load it again."""
    return Tilt(
        side.x[2], side.x[3], side.w, side.i_w, side.i_w3, side.i_w5, side.i_1w, side.m, side.m_w, side.m_ww,
        side.gentle,
    )  # fmt: skip


@inlined
def normal_turn(A, B, tilt):
    """Turn of the normal seen from the wheel's own plane: the angle E added to alpha."""
    arg = A * B / (tilt.w * (1.0 + tilt.w) + A * A)
    if tilt.gentle != 0.0:
        s = arg * arg
        return arg * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s / 9.0))))
    return np.arctan(arg)


@inlined
def involute_slopes(A, B, kap, s, rb, tilt):
    """Support of an involute, ``h = (kap / w) s`` with ``s = rb (phi + psi + alpha + E)``, and its slopes.

    For two meshing involutes together ``s`` and ``rb`` are sums over the wheels.
    """
    w, i_w, i_w3 = tilt.w, tilt.i_w, tilt.i_w3
    i_k = 1.0 / kap
    k = kap * i_w
    k_A = kap * A * i_w3
    k_B = A * A * B * i_k * i_w3
    E_A = B * i_w * tilt.i_1w
    E_B = A * (w + B * B) * i_w * tilt.i_1w * i_k * i_k
    return Slopes(
        k * s,
        A * B * s * i_w * i_k + rb * i_k,
        k_A * s + k * rb * E_A,
        k_B * s + k * rb * E_B,
        k * rb,
    )


@inlined
def involute_curvatures(A, B, kap, s, rb, tilt):
    """Second derivatives of the support of an involute; arguments as in `involute_slopes`."""
    w, i_w, i_w3, i_w5, one = tilt.w, tilt.i_w, tilt.i_w3, tilt.i_w5, tilt.i_1w
    i_k = 1.0 / kap
    i_k3 = i_k * i_k * i_k
    k = kap * i_w
    k_A = kap * A * i_w3
    k_B = A * A * B * i_k * i_w3
    E_A = B * i_w * one
    top = w + B * B
    i_bottom = i_w * one * i_k * i_k
    E_B = A * top * i_bottom
    ab = A * B * i_w * i_k
    ab_B = A * (w * w * kap * kap + B * B * kap * kap + B * B * w * w) * i_w3 * i_k3
    w2 = (1.0 + 2.0 * w) * i_w3 * one * one
    E_AA = A * B * w2
    E_AB = i_w * one + B * B * w2
    bottom_B = -(1.0 + 2.0 * w) * B * i_w * kap * kap - 2.0 * w * (1.0 + w) * B
    E_BB = A * (2.0 * B - B * i_w - top * bottom_B * i_bottom) * i_bottom
    k_AA = kap * (w * w + 3.0 * A * A) * i_w5
    k_AB = A * (3.0 * kap * B * i_w5 - B * i_k * i_w3)
    k_BB = A * A * (i_k * i_w3 + B * B * i_k3 * i_w3 + 3.0 * B * B * i_k * i_w5)
    return Curvatures(
        s * (B * B * w * w - A * A * kap * kap) * i_w * i_k3,
        s * B * kap * i_w3 + ab * rb * E_A,
        s * ab_B + ab * rb * E_B + rb * B * i_k3,
        ab * rb,
        s * k_AA + rb * (2.0 * k_A * E_A + k * E_AA),
        s * k_AB + rb * (k_A * E_B + k_B * E_A + k * E_AB),
        s * k_BB + rb * (2.0 * k_B * E_B + k * E_BB),
        k_A * rb,
        k_B * rb,
        0.0,
    )


@inlined
def corner_slopes(A, B, kap, sn, cs, r, rt, tilt):
    """Support of a tip corner and its slopes.

    Parameters
    ----------
    A, B, kap : float
        Tilt along and across the normal; ``sqrt(1 - B^2)``.
    sn, cs : float
        Sine and cosine of the sum of alpha and the corner's polar angle.
    r, rt : float
        Radius of the corner's line and of its rounding.
    tilt : Tilt
    """
    i_w, i_w3, m = tilt.i_w, tilt.i_w3, tilt.m
    i_k = 1.0 / kap
    m_A = -tilt.m_w * A * i_w
    m_B = -tilt.m_w * B * i_w
    V = A * sn + B * cs
    return Slopes(
        r * (sn + m * A * V) + rt * kap * i_w,
        r * (cs + m * B * V) + rt * A * B * i_w * i_k,
        r * (m * (A * sn + V) + m_A * A * V) + rt * kap * A * i_w3,
        r * (m * A * cs + m_B * A * V) + rt * A * A * B * i_k * i_w3,
        r * (cs + m * A * (A * cs - B * sn)),
    )


@inlined
def corner_curvatures(A, B, kap, sn, cs, r, rt, tilt):
    """Second derivatives of the support of a tip corner.

    Parameters
    ----------
    A, B, kap, sn, cs, r, rt, tilt
        As in `corner_slopes`.
    """
    w, i_w, i_w3, i_w5, m, m_w, m_ww = tilt.w, tilt.i_w, tilt.i_w3, tilt.i_w5, tilt.m, tilt.m_w, tilt.m_ww
    i_k = 1.0 / kap
    i_k3 = i_k * i_k * i_k
    m_A = -m_w * A * i_w
    m_B = -m_w * B * i_w
    m_AA = m_ww * A * A * i_w * i_w - m_w * (i_w + A * A * i_w3)
    m_AB = m_ww * A * B * i_w * i_w - m_w * A * B * i_w3
    m_BB = m_ww * B * B * i_w * i_w - m_w * (i_w + B * B * i_w3)
    V = A * sn + B * cs
    Ve = A * cs - B * sn
    X = A * sn + V
    ab_B = A * (w * w * kap * kap + B * B * kap * kap + B * B * w * w) * i_w3 * i_k3
    k_AB = A * (3.0 * kap * B * i_w5 - B * i_k * i_w3)
    k_BB = A * A * (i_k * i_w3 + B * B * i_k3 * i_w3 + 3.0 * B * B * i_k * i_w5)
    return Curvatures(
        -r * (sn + m * A * V) + rt * (B * B * w * w - A * A * kap * kap) * i_w * i_k3,
        r * B * (m_A * V + m * sn) + rt * B * kap * i_w3,
        r * (m_B * B * V + m * V + m * B * cs) + rt * ab_B,
        r * (m * B * Ve - sn),
        r * (2.0 * m * sn + 2.0 * m_A * X + m_AA * A * V) + rt * kap * (w * w + 3.0 * A * A) * i_w5,
        r * (m_B * X + m * cs + m_AB * A * V + m_A * A * cs) + rt * k_AB,
        r * (2.0 * m_B * A * cs + m_BB * A * V) + rt * k_BB,
        r * (m * (A * cs + Ve) + m_A * A * Ve),
        r * (m_B * A * Ve - m * A * sn),
        -r * (sn + m * A * V),
    )
