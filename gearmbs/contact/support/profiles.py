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

from gearmbs.contact.records import inlined
from gearmbs.contact.support import derived as D

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
def tilt_numbers(tilt):
    """Return what kernels made from definitions take of a tilt."""
    return tilt.w, tilt.i_w, tilt.i_1w, tilt.m, tilt.m_w, tilt.m_ww


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
    h, alpha, by_A, by_B, spin = D.involute_slopes(A, B, kap, s, rb, *tilt_numbers(tilt))
    return Slopes(h, alpha, by_A, by_B, spin)


@inlined
def involute_curvatures(A, B, kap, s, rb, tilt):
    """Second derivatives of the support of an involute; arguments as in `involute_slopes`."""
    aa, aA, aB, aF, AA, AB, AF, BB, BF, FF = D.involute_curvatures(A, B, kap, s, rb, *tilt_numbers(tilt))
    return Curvatures(aa, aA, aB, aF, AA, AB, BB, AF, BF, FF)


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
    V = A * sn + B * cs
    h, alpha, by_A, by_B, spin = D.corner_slopes(A, B, kap, sn, cs, V, r, rt, *tilt_numbers(tilt))
    return Slopes(h, alpha, by_A, by_B, spin)


@inlined
def corner_curvatures(A, B, kap, sn, cs, r, rt, tilt):
    """Second derivatives of the support of a tip corner.

    Parameters
    ----------
    A, B, kap, sn, cs, r, rt, tilt
        As in `corner_slopes`.
    """
    V = A * sn + B * cs
    aa, aA, aB, aF, AA, AB, AF, BB, BF, FF = D.corner_curvatures(
        A, B, kap, sn, cs, V, r, rt, *tilt_numbers(tilt)
    )  # fmt: skip
    return Curvatures(aa, aA, aB, aF, AA, AB, BB, AF, BF, FF)


# Support functions of helical wheels in a section across two tilted wheels, with all second derivatives.
#
# An involute helicoid is the envelope of planes: with the wheel's axis along z, turned by ``phi``, and the tangent of
# its base helix angle ``t``,
#
#     n(theta) . x + t z = r_b (phi + psi + theta),        n(theta) = (sin theta, cos theta).
#
# Cut by a section plane the planes become the lines that bound the section's convex profile. With the tilt ``A`` along
# the normal and ``B`` across it, ``kappa^2 = 1 - B^2``, ``c = 1 + t^2``, ``K^2 = 1 - c B^2``, ``s = r_b (phi + psi +
# alpha + E - arcsin(t B / kappa))`` and the place ``Z`` of the section along the mean axis from the wheel's middle, the
# support function is
#
#     H = (U s + V Z) / Omega,    U = w K - t A,    V = c w A - t K,    Omega = 1 - c (A^2 + B^2).
#
# Derivation in ``docs/theory/contact.md``. Derivatives are by alpha, the tilt (p, q), the spin angle F and Z. Angles
# are taken from series that are exact to rounding for axes up to `search.STEEPEST_HELICAL`.


class Screw(NamedTuple):
    """What the tangent of the base helix angle and the tilt fix in one section."""

    A: float
    B: float
    kap2: float
    c: float
    K: float
    R: float  # B / K
    U: float
    V: float
    inverse: float  # 1 / Omega


class HelicalSlopes(NamedTuple):
    """A support function and its first derivatives."""

    h: float
    alpha: float
    p: float
    q: float
    F: float
    Z: float


class HelicalCurvatures(NamedTuple):
    """Second derivatives of a support function."""

    alpha_alpha: float
    alpha_p: float
    alpha_q: float
    alpha_F: float
    alpha_Z: float
    pp: float
    pq: float
    qq: float
    pF: float
    qF: float
    pZ: float
    qZ: float
    FF: float
    FZ: float
    ZZ: float


@inlined
def helical_turns(A, B, kap2, t, tilt):
    """Turns of the normal seen from the planes of a helical wheel and its mate, E -+ arcsin(t B / kappa), by series."""
    arg = A * B / (tilt.w * (1.0 + tilt.w) + A * A)
    u = arg * arg
    turn = arg * (1.0 - u * (1.0 / 3.0 - u * (0.2 - u * (1.0 / 7.0 - u / 9.0))))
    x = t * B / np.sqrt(kap2)
    v = x * x
    high = 35.0 / 1152.0 + v * (63.0 / 2816.0 + v * (231.0 / 13312.0 + v * (143.0 / 10240.0 + v * 6435.0 / 557056.0)))
    lean = x * (1.0 + v * (1.0 / 6.0 + v * (3.0 / 40.0 + v * (5.0 / 112.0 + v * high))))
    return turn - lean, turn + lean


@inlined
def helical_turn(A, B, kap2, t, tilt):
    """Turn of the normal seen from the helical wheel's own plane."""
    turn, _ = helical_turns(A, B, kap2, t, tilt)
    return turn


@inlined
def screw_of(sa, ca, t, tilt):
    """Return what the helix and the tilt fix at a normal with this sine and cosine."""
    p, q, w = tilt.p, tilt.q, tilt.w
    A = p * sa + q * ca
    B = p * ca - q * sa
    c = 1.0 + t * t
    K = np.sqrt(1.0 - c * B * B)
    return Screw(
        A, B, 1.0 - B * B, c, K, B / K, w * K - t * A, c * w * A - t * K, 1.0 / (1.0 - c * (A * A + B * B))
    )  # fmt: skip


@inlined
def mate_of(screw, t, w):
    """Return the same for the mate, whose helix leans the other way: ``t`` is that of the first wheel."""
    A, B, kap2, c, K, R, _, _, inverse = screw
    return Screw(A, B, kap2, c, K, R, w * K + t * A, c * w * A + t * K, inverse)


@inlined
def helicoid_normal(screw, s, Z, rb):
    """First and second derivative of the support of a helicoid by alpha."""
    A, B, _, c, K, R, U, V, inverse = screw
    i_K = 1.0 / K
    i_K3 = i_K * i_K * i_K
    W = V * s + c * U * Z
    first = W * R * inverse + rb * i_K
    second = (
        c * R * R * (U * s + V * Z) * inverse - A * i_K3 * W * inverse + V * R * rb / (U * K) - c * A * B * rb * i_K3
    )
    return first, second


@inlined
def helicoid_roll(screw, s, Z, rb, t, w):
    """Length of roll where the section's profile has this normal, in the wheel's own transverse plane there."""
    A, B, _, c, K, R, U, V, inverse = screw
    h = (U * s + V * Z) * inverse
    slope = (V * s + c * U * Z) * R * inverse + rb / K
    return s - t * (A * h + B * slope + w * Z)


@inlined
def helicoid_slopes(screw, s, Z, rb, t, sa, ca, tilt):
    """Support of an involute helicoid and its slopes.

    Parameters
    ----------
    screw : Screw
    s, Z, rb, t : float
        As in the module's text.
    sa, ca : float
        Sine and cosine of alpha.
    tilt : Tilt
    """
    A, B, kap2, c, K, R, U, V, inverse = screw
    h, alpha, h_A, h_B, spin, place = D.helicoid_slopes(
        A, B, np.sqrt(kap2), c, K, R, U, V, inverse, s, Z, rb, t, *tilt_numbers(tilt)
    )
    return HelicalSlopes(h, alpha, h_A * sa + h_B * ca, h_A * ca - h_B * sa, spin, place)


@inlined
def helicoid_curvatures(screw, s, Z, rb, t, sa, ca, tilt):
    """Second derivatives of the support of an involute helicoid; arguments as in `helicoid_slopes`."""
    A, B, kap2, c, K, R, U, V, inverse = screw
    aa, aA, aB, aF, aZ, AA, AB, AF, AZ, BB, BF, BZ, _, _, _ = D.helicoid_curvatures(
        A, B, np.sqrt(kap2), c, K, R, U, V, inverse, s, Z, rb, t, *tilt_numbers(tilt)
    )
    return HelicalCurvatures(
        aa,
        aA * sa + aB * ca,
        aA * ca - aB * sa,
        aF,
        aZ,
        AA * sa * sa + 2.0 * AB * sa * ca + BB * ca * ca,
        (AA - BB) * sa * ca + AB * (ca * ca - sa * sa),
        AA * ca * ca - 2.0 * AB * sa * ca + BB * sa * sa,
        AF * sa + BF * ca,
        AF * ca - BF * sa,
        AZ * sa + BZ * ca,
        AZ * ca - BZ * sa,
        0.0,
        0.0,
        0.0,
    )


class Edge(NamedTuple):
    """How the polar angle of a helical tip edge in the section changes with spin, tilt and place."""

    F: float
    Z: float
    p: float
    q: float
    lag: float  # its angle behind that at the wheel's middle
    inverse: float


@inlined
def edge_of(ce, se, r, k, Z, tilt):
    """Return the first derivatives of the polar angle ``eta`` of a tip edge.

    It solves ``w (eta - eta_0) + k (Z + r (p cos eta + q sin eta)) = 0``: the edge turns by ``-k`` per length of the
    wheel's axis.

    Parameters
    ----------
    ce, se, r : float
        Cosine and sine of eta, and the edge's radius.
    k : float
        Tangent of the base helix angle over the base radius, 1/m.
    Z : float
    tilt : Tilt
    """
    p, q, w, i_w = tilt.p, tilt.q, tilt.w, tilt.i_w
    lag = -k * (Z + r * (p * ce + q * se)) * i_w
    inverse = 1.0 / (w + k * r * (q * ce - p * se))
    return Edge(
        w * inverse, -k * inverse, (lag * p * i_w - k * r * ce) * inverse, (lag * q * i_w - k * r * se) * inverse,
        lag, inverse,
    )  # fmt: skip


class EdgeBends(NamedTuple):
    """Second derivatives of the polar angle of a helical tip edge in the section."""

    pp: float
    pq: float
    qq: float
    pF: float
    qF: float
    pZ: float
    qZ: float
    FF: float
    FZ: float
    ZZ: float


@inlined
def edge_bends(edge, ce, se, r, k, tilt):
    """Return the second derivatives of the polar angle, from those of the equation it solves; see `edge_of`."""
    p, q, i_w, i_w3 = tilt.p, tilt.q, tilt.i_w, tilt.i_w3
    kr = k * r
    w_p, w_q = -p * i_w, -q * i_w
    n_n, n_p, n_q = -kr * (p * ce + q * se), w_p - kr * se, w_q + kr * ce
    lag, inv = edge.lag, -edge.inverse
    e_F, e_Z, e_p, e_q = edge.F, edge.Z, edge.p, edge.q
    return EdgeBends(
        inv * (n_n * e_p * e_p + 2.0 * n_p * e_p - lag * (i_w + p * p * i_w3)),
        inv * (n_n * e_p * e_q + n_p * e_q + n_q * e_p - lag * p * q * i_w3),
        inv * (n_n * e_q * e_q + 2.0 * n_q * e_q - lag * (i_w + q * q * i_w3)),
        inv * ((n_n * e_p + n_p) * e_F - w_p),
        inv * ((n_n * e_q + n_q) * e_F - w_q),
        inv * (n_n * e_p + n_p) * e_Z,
        inv * (n_n * e_q + n_q) * e_Z,
        inv * n_n * e_F * e_F,
        inv * n_n * e_F * e_Z,
        inv * n_n * e_Z * e_Z,
    )


@inlined
def edge_slopes(screw, edge, sn, cs, r, rt, Z, sa, ca, tilt):
    """Support of a helical tip edge, rounded in the transverse section, and its slopes.

    Parameters
    ----------
    screw : Screw
    edge : Edge
    sn, cs : float
        Sine and cosine of the sum of alpha and the edge's polar angle.
    r, rt : float
        Radius of the edge and of its rounding.
    Z : float
    sa, ca : float
        Sine and cosine of alpha.
    tilt : Tilt
    """
    A, B, kap2 = screw.A, screw.B, screw.kap2
    i_w, i_w3 = tilt.i_w, tilt.i_w3
    c = corner_slopes(A, B, np.sqrt(kap2), sn, cs, r, rt, tilt)
    c_A = c.A + Z * kap2 * i_w3
    c_B = c.B + Z * A * B * i_w3
    return HelicalSlopes(
        c.h + Z * A * i_w,
        c.alpha + Z * B * i_w,
        c_A * sa + c_B * ca + c.F * edge.p,
        c_A * ca - c_B * sa + c.F * edge.q,
        c.F * edge.F,
        c.F * edge.Z + A * i_w,
    )


@inlined
def edge_curvatures(screw, edge, sn, cs, ce, se, r, rt, k, Z, sa, ca, tilt):
    """Second derivatives of the support of a helical tip edge.

    Parameters
    ----------
    screw, edge, sn, cs, r, rt, Z, sa, ca, tilt
        As in `edge_slopes`.
    ce, se, k
        As in `edge_of`.
    """
    A, B, kap2 = screw.A, screw.B, screw.kap2
    i_w, i_w3, i_w5 = tilt.i_w, tilt.i_w3, tilt.i_w5
    kap = np.sqrt(kap2)
    by_eta = corner_slopes(A, B, kap, sn, cs, r, rt, tilt).F
    c = corner_curvatures(A, B, kap, sn, cs, r, rt, tilt)
    c_AA = c.AA + 3.0 * Z * kap2 * A * i_w5
    c_AB = c.AB + Z * (3.0 * kap2 * B * i_w5 - 2.0 * B * i_w3)
    c_BB = c.BB + Z * A * (i_w3 + 3.0 * B * B * i_w5)
    a_A, a_B = c.alpha_A + Z * A * B * i_w3, c.alpha_B + Z * (i_w + B * B * i_w3)
    pp, pq, qq, pF, qF, pZ, qZ, FF, FZ, ZZ = edge_bends(edge, ce, se, r, k, tilt)
    e_F, e_Z, e_p, e_q = edge.F, edge.Z, edge.p, edge.q
    eta_p, eta_q = c.AF * sa + c.BF * ca, c.AF * ca - c.BF * sa
    to_p, to_q = eta_p + c.FF * e_p, eta_q + c.FF * e_q
    by_Z_A, by_Z_B = kap2 * i_w3, A * B * i_w3
    return HelicalCurvatures(
        c.alpha_alpha - Z * A * i_w,
        a_A * sa + a_B * ca + c.alpha_F * e_p,
        a_A * ca - a_B * sa + c.alpha_F * e_q,
        c.alpha_F * e_F,
        c.alpha_F * e_Z + B * i_w,
        c_AA * sa * sa + 2.0 * c_AB * sa * ca + c_BB * ca * ca + eta_p * e_p + to_p * e_p + by_eta * pp,
        (c_AA - c_BB) * sa * ca + c_AB * (ca * ca - sa * sa) + eta_p * e_q + to_q * e_p + by_eta * pq,
        c_AA * ca * ca - 2.0 * c_AB * sa * ca + c_BB * sa * sa + eta_q * e_q + to_q * e_q + by_eta * qq,
        to_p * e_F + by_eta * pF,
        to_q * e_F + by_eta * qF,
        to_p * e_Z + by_eta * pZ + by_Z_A * sa + by_Z_B * ca,
        to_q * e_Z + by_eta * qZ + by_Z_A * ca - by_Z_B * sa,
        c.FF * e_F * e_F + by_eta * FF,
        c.FF * e_F * e_Z + by_eta * FZ,
        c.FF * e_Z * e_Z + by_eta * ZZ,
    )
