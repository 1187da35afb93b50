"""ADAMS's way of loading a tooth pair: one force per overlap, at its centroid, with the depth found there."""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.cells import POINTS, WEIGHTS
from gearmbs.contact.jit import kernel
from gearmbs.contact.laws import normal_law

N_GAP, N_GRAD, N_RATE, N_DRATE, N_FORCE, N_FX, N_FV = (
    L.N_GAP,
    L.N_GRAD,
    L.N_RATE,
    L.N_DRATE,
    L.N_FORCE,
    L.N_FX,
    L.N_FV,
)
LO, HI = L.W_LIMIT, L.W_LIMIT + 43


@kernel
def cell_bounds(gi, gr, wk, j, step, o0, o1):
    """Touching part of slice ``j`` as fractions, and what bounds it: 0 a node, 1 the face, 2 the end of the touch."""
    slices = gi[L.N_SLICES]
    ua = (wk[LO] - gr[L.ZETA_LO]) / step - j
    ub = (wk[HI] - gr[L.ZETA_LO]) / step - j
    ka = 1
    kb = 1
    if not (ua > 0.0 or j == 0):
        ua = 0.0
        ka = 0
    if not (ub < 1.0 or j == slices - 1):
        ub = 1.0
        kb = 0
    d0 = -wk[o0 + N_GAP]
    slope = -wk[o1 + N_GAP] - d0
    da = d0 + slope * ua
    db = d0 + slope * ub
    if ub <= ua or (da <= 0.0 and db <= 0.0):
        return 0.0, 0.0, 0, 0
    if da < 0.0:
        ua = -d0 / slope
        ka = 2
    if db < 0.0:
        ub = -d0 / slope
        kb = 2
    return ua, ub, ka, kb


@kernel
def overlap_moments(gi, gr, wk, sel, ja, jb, step):
    """Volume of the overlap up to a factor, its first moment about node ``ja`` in slices, and its largest depth."""
    m0 = 0.0
    m1 = 0.0
    depth = 0.0
    for j in range(ja, jb):
        o0 = int(wk[sel + j])
        o1 = int(wk[sel + j + 1])
        ua, ub, _, _ = cell_bounds(gi, gr, wk, j, step, o0, o1)
        if ub <= ua:
            continue
        d0 = -wk[o0 + N_GAP]
        slope = -wk[o1 + N_GAP] - d0
        depth = max(depth, d0 + slope * ua, d0 + slope * ub)
        for g in range(3):
            u = ua + (ub - ua) * POINTS[g]
            v = (ub - ua) * WEIGHTS[g] * max(d0 + slope * u, 0.0) ** 1.5
            m0 += v
            m1 += v * (j - ja + u)
    return m0, m1, depth


@kernel
def centroid_slopes(gi, gr, wk, sel, ja, jb, step, centre, m0, k):
    """Derivative of the centroid by the pose number ``k``, in slices."""
    total = 0.0
    for j in range(ja, jb):
        o0 = int(wk[sel + j])
        o1 = int(wk[sel + j + 1])
        ua, ub, ka, kb = cell_bounds(gi, gr, wk, j, step, o0, o1)
        if ub <= ua:
            continue
        d0 = -wk[o0 + N_GAP]
        slope = -wk[o1 + N_GAP] - d0
        x0 = -wk[o0 + N_GRAD + k]
        x1 = -wk[o1 + N_GRAD + k]
        # motion of the two bounds
        ma = 0.0
        mb = 0.0
        if ka == 1:
            ma = wk[LO + 1 + k] / step
        elif ka == 2:
            ma = -(x0 + (x1 - x0) * ua) / slope
        if kb == 1:
            mb = wk[HI + 1 + k] / step
        elif kb == 2:
            mb = -(x0 + (x1 - x0) * ub) / slope
        for g in range(3):
            t = POINTS[g]
            u = ua + (ub - ua) * t
            mu = ma + (mb - ma) * t
            d = max(d0 + slope * u, 0.0)
            dd = x0 + (x1 - x0) * u + slope * mu
            root = d**0.5
            v = (ub - ua) * WEIGHTS[g] * d * root
            dv = WEIGHTS[g] * d * root * (mb - ma) + (ub - ua) * WEIGHTS[g] * 1.5 * root * dd
            total += dv * (j - ja + u - centre) + v * mu
    return total / m0


@kernel
def centroid_force(gi, gr, wk, sel, ja, jb, step, soft, diag, want):
    """Force of a pair as ADAMS computes it, shared by the two nodes next to the centroid; returns the largest depth.

    The overlap of two convex flanks has a cross-section as delta^(3/2); a wedge's centroid sees 5/7 of its largest
    depth, whatever the face width. The force is the law for the whole face at the centroid's depth and rate.
    """
    m0, m1, depth = overlap_moments(gi, gr, wk, sel, ja, jb, step)
    if not m0 > 1e-300:
        return 0.0
    centre = m1 / m0
    j = min(max(int(centre), 0), jb - ja - 1)
    u = centre - j
    o0 = int(wk[sel + ja + j])
    o1 = int(wk[sel + ja + j + 1])
    d0 = -wk[o0 + N_GAP]
    slope = -wk[o1 + N_GAP] - d0
    r0 = -wk[o0 + N_RATE]
    rs = -wk[o1 + N_RATE] - r0
    width = gr[L.WIDTH]
    delta = d0 + slope * u
    rate = r0 + rs * u
    c = soft * gr[L.LAW_C] if gi[L.LAW] == 0 else gr[L.LAW_C]
    p, p_d, p_r, energy, elastic = normal_law(gi[L.LAW], soft * gr[L.LAW_K], gr[L.LAW_E], c, gr[L.LAW_D], delta, rate)
    force = width * p
    wk[o0 + N_FORCE] += (1.0 - u) * force
    wk[o1 + N_FORCE] += u * force
    wk[o0 + L.N_ELASTIC] += (1.0 - u) * width * elastic
    wk[o1 + L.N_ELASTIC] += u * width * elastic
    diag[0] += width * energy
    diag[1] += width * (p - elastic) * rate
    if want != 0:
        for k in range(6):
            uk = centroid_slopes(gi, gr, wk, sel, ja, jb, step, centre, m0, k)
            g0 = wk[o0 + N_GRAD + k]
            g1 = wk[o1 + N_GRAD + k]
            wk[L.P_MOVED + k] = width * elastic * slope * uk
            dd = slope * uk - (1.0 - u) * g0 - u * g1
            dr = rs * uk - (1.0 - u) * wk[o0 + N_DRATE + k] - u * wk[o1 + N_DRATE + k]
            df = width * (p_d * dd + p_r * dr)
            wk[o0 + N_FX + k] += (1.0 - u) * df - uk * force
            wk[o1 + N_FX + k] += u * df + uk * force
            dv = -width * p_r * ((1.0 - u) * g0 + u * g1)
            wk[o0 + N_FV + k] += (1.0 - u) * dv
            wk[o1 + N_FV + k] += u * dv
    return depth
