"""Pressure along the face: from gaps at the nodes of the slices to nodal forces, with their derivatives.

Between two nodes gap and gap rate are linear. The part of a slice that touches, and that lies on both faces, is
integrated by Gauss's three-point rule, so that the ends of a wedge move through the slices without a jump. A wedge that
ends inside its only slice is then good to 0.05 % (two points: 0.3 %).
"""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel
from gearmbs.contact.laws import normal_law

N_GAP, N_GRAD, N_HESS, N_RATE, N_DRATE = L.N_GAP, L.N_GRAD, L.N_HESS, L.N_RATE, L.N_DRATE
N_FORCE, N_FX, N_FV = L.N_FORCE, L.N_FX, L.N_FV
LAW, K_, E_, C_, D_ = L.LAW, L.LAW_K, L.LAW_E, L.LAW_C, L.LAW_D
WIDTH = L.WIDTH
LO = L.W_LIMIT
HI = L.W_LIMIT + 43
N_ELASTIC = L.N_ELASTIC
Q_, H_ = L.Q_, L.H_
POINTS = (0.1127016653792583, 0.5, 0.8872983346207417)
WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


@kernel
def plane_force(gi, gr, wk, o, soft, diag, want):
    """Force of a pair described by a single section: the pressure there times the common face width."""
    width = gr[WIDTH]
    delta = -wk[o + N_GAP]
    rate = -wk[o + N_RATE]
    p, p_d, p_r, energy, elastic = normal_law(
        gi[LAW], soft * gr[K_], gr[E_], soft * gr[C_] if gi[LAW] == 0 else gr[C_], gr[D_], delta, rate
    )
    wk[o + N_FORCE] = width * p
    wk[o + N_ELASTIC] = width * elastic
    diag[0] += width * energy
    diag[1] += width * (p - elastic) * rate
    if want != 0:
        for i in range(6):
            g = wk[o + N_GRAD + i]
            wk[o + N_FX + i] = -width * (p_d * g + p_r * wk[o + N_DRATE + i])
            wk[o + N_FV + i] = -width * p_r * g
    return delta


@kernel
def cell_force(gi, gr, wk, o0, o1, step, ua, ub, lo_moves, hi_moves, soft, diag, want):
    """Add the nodal forces of one slice between the records ``o0`` and ``o1``; returns the largest penetration.

    Parameters
    ----------
    step : float
        Width of the slice, m.
    ua, ub : float
        The part of the slice on both faces, as fractions (outside 0..1 in the end slices if the face goes on).
    lo_moves, hi_moves : bool
        Whether that part ends at the lower or upper limit of the face rather than at a node.
    """
    d0 = -wk[o0 + N_GAP]
    d1 = -wk[o1 + N_GAP]
    slope = d1 - d0
    da = d0 + slope * ua
    db = d0 + slope * ub
    if da <= 0.0 and db <= 0.0:
        return 0.0
    clip_a = da < 0.0
    clip_b = db < 0.0
    if clip_a:
        ua = -d0 / slope
    if clip_b:
        ub = -d0 / slope
    r0 = -wk[o0 + N_RATE]
    rs = -wk[o1 + N_RATE] - r0
    k = soft * gr[K_]
    c = soft * gr[C_] if gi[LAW] == 0 else gr[C_]
    span = ub - ua
    f0 = 0.0
    f1 = 0.0
    e0 = 0.0
    e1 = 0.0
    K00 = 0.0
    K01 = 0.0
    K11 = 0.0
    R00 = 0.0
    R01 = 0.0
    R11 = 0.0
    f0a = 0.0
    f0b = 0.0
    f1a = 0.0
    f1b = 0.0
    for g in range(3):
        t = POINTS[g]
        u = ua + span * t
        rate = r0 + rs * u
        p, p_d, p_r, energy, elastic = normal_law(gi[LAW], k, gr[E_], c, gr[D_], d0 + slope * u, rate)
        share = WEIGHTS[g] * step
        m = share * span
        v = 1.0 - u
        f0 += m * v * p
        f1 += m * u * p
        e0 += m * v * elastic
        e1 += m * u * elastic
        diag[0] += m * energy
        diag[1] += m * (p - elastic) * rate
        if want != 0:
            K00 += m * v * v * p_d
            K01 += m * u * v * p_d
            K11 += m * u * u * p_d
            R00 += m * v * v * p_r
            R01 += m * u * v * p_r
            R11 += m * u * u * p_r
            p_u = p_d * slope + p_r * rs
            m0 = span * (v * p_u - p) * share
            m1 = span * (u * p_u + p) * share
            f0a += (1.0 - t) * m0 - share * v * p
            f0b += t * m0 + share * v * p
            f1a += (1.0 - t) * m1 - share * u * p
            f1b += t * m1 + share * u * p
    wk[o0 + N_FORCE] += f0
    wk[o1 + N_FORCE] += f1
    wk[o0 + N_ELASTIC] += e0
    wk[o1 + N_ELASTIC] += e1
    if want != 0:
        k10 = K01
        if clip_a or clip_b:
            c0 = -d1 / (slope * slope)
            c1 = d0 / (slope * slope)
            f0c = f0a if clip_a else f0b
            f1c = f1a if clip_a else f1b
            K00 += f0c * c0
            K01 += f0c * c1
            k10 += f1c * c0
            K11 += f1c * c1
        for i in range(6):
            g0 = wk[o0 + N_GRAD + i]
            g1 = wk[o1 + N_GRAD + i]
            h0 = wk[o0 + N_DRATE + i]
            h1 = wk[o1 + N_DRATE + i]
            x0 = -(K00 * g0 + K01 * g1 + R00 * h0 + R01 * h1)
            x1 = -(k10 * g0 + K11 * g1 + R01 * h0 + R11 * h1)
            if lo_moves and not clip_a:
                x0 += f0a * wk[LO + 1 + i] / step
                x1 += f1a * wk[LO + 1 + i] / step
            if hi_moves and not clip_b:
                x0 += f0b * wk[HI + 1 + i] / step
                x1 += f1b * wk[HI + 1 + i] / step
            wk[o0 + N_FX + i] += x0
            wk[o1 + N_FX + i] += x1
            wk[o0 + N_FV + i] -= R00 * g0 + R01 * g1
            wk[o1 + N_FV + i] -= R01 * g0 + R11 * g1
    return max(da, db)


@kernel
def end_force(gi, gr, wk, o0, o1, step, u, sign, l, soft, want):
    """Force from cutting the elastic layer at an end of the face: its energy density times the limit's motion."""
    d0 = -wk[o0 + N_GAP]
    slope = -wk[o1 + N_GAP] - d0
    delta = d0 + slope * u
    if delta <= 0.0:
        return
    _, _, _, energy, elastic = normal_law(0, soft * gr[K_], gr[E_], 0.0, 1.0, delta, 0.0)
    varying = gi[L.O_COMPLIANCE] != 0
    for i in range(6):
        wk[Q_ + i] -= sign * energy * wk[l + 1 + i]
    if want == 0:
        return
    for j in range(6):
        dd = -(1.0 - u) * wk[o0 + N_GRAD + j] - u * wk[o1 + N_GRAD + j] + slope / step * wk[l + 1 + j]
        for i in range(6):
            moved = elastic * dd * wk[l + 1 + i] + energy * wk[l + 7 + 6 * i + j]
            if varying:
                turned = wk[l + 1 + i] * wk[L.P_SOFT_X + j] + wk[l + 1 + j] * wk[L.P_SOFT_X + i]
                moved += energy / soft * turned
            wk[H_ + 6 * i + j] -= sign * moved
