"""ADAMS's way of loading a tooth pair: one force per overlap, at its centroid, with the depth found there."""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.jit import kernel
from gearmbs.contact.laws import normal_law
from gearmbs.contact.records import strip_at
from gearmbs.contact.slices import POINTS, WEIGHTS

LEAST_VOLUME = 1e-300


@kernel
def place_of_slice(scratch, j):
    """Return the number of the strip that holds slice ``j``, and the slice's lane."""
    from_first = j - int(scratch.side.first)
    k = from_first // (L.LANES - 1)
    return k, from_first - k * (L.LANES - 1)


@kernel
def slice_bounds(slices, pair, strip, i, j):
    """Touching part of slice ``j``, in lane ``i``, as fractions, and what bounds it: `layout.AT_NODE` and on."""
    ua, ub = pair.low - j, pair.high - j
    ka = kb = L.AT_FACE_END
    if not (ua > 0.0 or j == 0):
        ua, ka = 0.0, L.AT_NODE
    if not (ub < 1.0 or j == slices - 1):
        ub, kb = 1.0, L.AT_NODE
    d0 = -strip.gap[i]
    slope = -strip.gap[i + 1] - d0
    da = d0 + slope * ua
    db = d0 + slope * ub
    if ub <= ua or (da <= 0.0 and db <= 0.0):
        return 0.0, 0.0, L.AT_NODE, L.AT_NODE
    if da < 0.0:
        ua, ka = -d0 / slope, L.AT_TOUCH_END
    if db < 0.0:
        ub, kb = -d0 / slope, L.AT_TOUCH_END
    return ua, ub, ka, kb


@kernel
def overlap_moments(slices, scratch, own_strips):
    """Volume of the overlap up to a factor, its first moment about the first node in slices, and its largest depth."""
    pair = scratch.pair
    first, last = int(pair.first), int(pair.last)
    m0 = 0.0
    m1 = 0.0
    depth = 0.0
    for j in range(first, last):
        k, i = place_of_slice(scratch, j)
        strip = strip_at(scratch, own_strips + k)
        ua, ub, _, _ = slice_bounds(slices, pair, strip, i, j)
        if ub <= ua:
            continue
        d0 = -strip.gap[i]
        slope = -strip.gap[i + 1] - d0
        depth = max(depth, d0 + slope * ua, d0 + slope * ub)
        for g in range(3):
            u = ua + (ub - ua) * POINTS[g]
            v = (ub - ua) * WEIGHTS[g] * max(d0 + slope * u, 0.0) ** 1.5
            m0 += v
            m1 += v * (j - first + u)
    return m0, m1, depth


@kernel
def centroid_slopes(slices, scratch, own_strips, centre, m0, x):
    """Derivative of the centroid by the pose number ``x``, in slices."""
    pair, width = scratch.pair, scratch.side.step
    first, last = int(pair.first), int(pair.last)
    total = 0.0
    for j in range(first, last):
        k, i = place_of_slice(scratch, j)
        strip = strip_at(scratch, own_strips + k)
        ua, ub, ka, kb = slice_bounds(slices, pair, strip, i, j)
        if ub <= ua:
            continue
        d0 = -strip.gap[i]
        slope = -strip.gap[i + 1] - d0
        x0 = -strip.grad[x, i]
        x1 = -strip.grad[x, i + 1]
        # motion of the two bounds
        ma = 0.0
        mb = 0.0
        if ka == L.AT_FACE_END:
            ma = scratch.low.grad[x] / width
        elif ka == L.AT_TOUCH_END:
            ma = -(x0 + (x1 - x0) * ua) / slope
        if kb == L.AT_FACE_END:
            mb = scratch.high.grad[x] / width
        elif kb == L.AT_TOUCH_END:
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
            total += dv * (j - first + u - centre) + v * mu
    return total / m0


@kernel
def centroid_force(options, wheels, scratch, law, own_strips, totals, want):
    """Force of the pair at work as ADAMS computes it, shared by the two nodes next to the centroid.

    The overlap of two convex flanks has a cross-section as delta^(3/2); a wedge's centroid sees 5/7 of its largest
    depth, whatever the face width. The force is the law for the whole face at the centroid's depth and rate.

    Returns
    -------
    strip, depth : int, float
        Strip that bears the force, and the largest depth; 0 if nothing touches.
    """
    pair, loads = scratch.pair, scratch.loads
    m0, m1, depth = overlap_moments(options.slices, scratch, own_strips)
    if not m0 > LEAST_VOLUME:
        return 0, 0.0
    first = int(pair.first)
    centre = m1 / m0
    j = min(max(int(centre), 0), int(pair.last) - first - 1)
    u = centre - j
    k, i = place_of_slice(scratch, first + j)
    strip = strip_at(scratch, own_strips + k)
    d0 = -strip.gap[i]
    slope = -strip.gap[i + 1] - d0
    r0 = -strip.rate[i]
    rs = -strip.rate[i + 1] - r0
    width = wheels.width
    delta = d0 + slope * u
    rate = r0 + rs * u
    p, p_d, p_r, energy, elastic = normal_law(law.kind, law.k, law.e, law.c, law.d, delta, rate)
    force = width * p
    for lane in range(L.LANES):
        loads.force[lane] = 0.0
        loads.elastic[lane] = 0.0
    loads.force[i], loads.force[i + 1] = (1.0 - u) * force, u * force
    loads.elastic[i], loads.elastic[i + 1] = (1.0 - u) * width * elastic, u * width * elastic
    totals.energy += width * energy
    totals.damping_power += width * (p - elastic) * rate
    if want == 0:
        return k, depth
    for x in range(6):
        for lane in range(L.LANES):
            loads.force_x[x, lane] = 0.0
            loads.force_xd[x, lane] = 0.0
        ux = centroid_slopes(options.slices, scratch, own_strips, centre, m0, x)
        g0, g1 = strip.grad[x, i], strip.grad[x, i + 1]
        pair.moved[x] = width * elastic * slope * ux
        dd = slope * ux - (1.0 - u) * g0 - u * g1
        dr = rs * ux - (1.0 - u) * strip.rate_x[x, i] - u * strip.rate_x[x, i + 1]
        df = width * (p_d * dd + p_r * dr)
        loads.force_x[x, i] = (1.0 - u) * df - ux * force
        loads.force_x[x, i + 1] = u * df + ux * force
        dv = -width * p_r * ((1.0 - u) * g0 + u * g1)
        loads.force_xd[x, i] = (1.0 - u) * dv
        loads.force_xd[x, i + 1] = u * dv
    return k, depth
