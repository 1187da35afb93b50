"""Pressure along the face: from gaps at the nodes of the slices to nodal forces, with their derivatives.

Between two nodes gap and gap rate are linear. The part of a slice that touches, and that lies on both faces, is
integrated by Gauss's three-point rule, so that the ends of a wedge move through the slices without a jump. A wedge that
ends inside its only slice is then good to 0.05 % (two points: 0.3 %).

The slices of a strip are integrated side by side: lane i holds the slice from node i to node i + 1. The last lane has
no slice. It stays empty, which lets the loops read one place on in a row: what they find there is multiplied by zero.
"""

from __future__ import annotations

from typing import NamedTuple

from gearmbs.contact import layout as L
from gearmbs.contact.forces import derived as D
from gearmbs.contact.laws import damping_of_share, elastic_pressure, normal_law, power, pressure
from gearmbs.contact.layout import POINTS, WEIGHTS
from gearmbs.contact.records import inlined, kernel, strip_at, summing
from gearmbs.dae.equations.loads.forces import stored_energy
from gearmbs.kernels.views import before


class Law(NamedTuple):
    """The normal law of a tooth pair, per unit face width."""

    kind: int
    k: float
    e: float
    c: float
    d: float


class Cut(NamedTuple):
    """Which slices of a strip count, and where the face ends, in slices from its first node."""

    low: float
    high: float
    lowest: float  # slices before this one are left out
    highest: float  # from this one on, too
    begin: float  # the face's first slice
    end: float  # and its last


@inlined
def law_of(options, wheels, factor):
    """Normal law of a tooth pair whose stiffness is a multiple of the nominal one."""
    c = damping_of_share(options.law, wheels.damping, factor)
    return Law(options.law, factor * wheels.stiffness, wheels.exponent, c, wheels.damping_depth)


@inlined
def elastic_law(law):
    """Return the law without its damping."""
    return Law(law.kind, law.k, law.e, 0.0, law.d)


@kernel
def plane_force(law, width, strip, loads, totals, want):
    """Force of a pair described by a single section: the pressure there times the common face width.

    Returns the penetration.
    """
    delta, rate = -strip.gap[0], -strip.rate[0]
    p, p_d, p_r, energy, elastic = normal_law(law.kind, law.k, law.e, law.c, law.d, delta, rate)
    loads.force[0] = width * p
    loads.elastic[0] = width * elastic
    totals.energy += width * energy
    totals.damping_power += width * (p - elastic) * rate
    if want != 0:
        for i in range(6):
            # delta = -g: df/dx = -b (p_delta g_x + p_rate g'_x), and df/dx' = -b p_rate g_x, as g' = g_x . x'
            g = strip.grad[i, 0]
            loads.force_x[i, 0] = -width * (p_d * g + p_r * strip.rate_x[i, 0])
            loads.force_xd[i, 0] = -width * p_r * g
    return delta


@kernel
def touching_parts(strip, loads, n, cut):
    """Bounds of the part of each slice that touches and lies on both faces, as fractions, and its largest depth.

    ``depth`` is 0 for slices that do not count.
    """
    low, high, lowest, highest, begin, end = cut
    gap = strip.gap
    for i in range(n):
        j = float(i)
        # where the face begins and ends, in slices from this node on; its first and last slice reach as far as it does
        ua, ub = low - j, high - j
        first, last = j == begin, j == end
        counts = (j >= lowest) and (j < highest) and (ua < 1.0 or last) and (ub > 0.0 or first)
        ua = ua if (ua > 0.0 or first) else 0.0
        ub = ub if (ub < 1.0 or last) else 1.0
        d0, d1 = -gap[i], -gap[i + 1]
        slope = d1 - d0
        da, db = d0 + slope * ua, d0 + slope * ub
        counts = counts and (ub > ua) and (da > 0.0 or db > 0.0)
        # the depth d0 + slope u vanishes at u = -d0 / slope
        loads.low[i] = (-d0 / slope if da < 0.0 else ua) if counts else 0.0
        loads.high[i] = (-d0 / slope if db < 0.0 else ub) if counts else 0.0
        loads.depth[i] = max(da, db) if counts else 0.0
        loads.clip_low[i] = 1.0 if counts and da < 0.0 else 0.0
        loads.clip_high[i] = 1.0 if counts and db < 0.0 else 0.0


@kernel
def slice_forces(law, strip, loads, n, width, want):
    """Integrate the pressure over the parts of the slices that `touching_parts` found.

    Fills the nodal forces of each slice, its energy and its damping power, and, if wanted, the derivatives of the
    forces by the gaps and rates of its nodes and by its bounds. Both passes evaluate the law, which costs less than to
    keep all it says.

    Parameters
    ----------
    law : Law
    strip, loads : record
    n : int
        Sections of the strip.
    width : float
        Width of a slice, m.
    want : int
        Nonzero to fill derivatives.
    """
    kind, k, e, c, d = law
    copy = Law(kind, k, e, c, d)
    m0, m1, m2 = WEIGHTS[0] * width, WEIGHTS[1] * width, WEIGHTS[2] * width
    for i in range(n):
        g, low, high = slice_of(strip, loads, i), loads.low[i], loads.high[i]
        p0, _, _, w0, e0 = at_point(copy, g, low, high, POINTS[0])
        p1, _, _, w1, e1 = at_point(copy, g, low, high, POINTS[1])
        p2, _, _, w2, e2 = at_point(copy, g, low, high, POINTS[2])
        (
            loads.force_left[i], loads.force_right[i], loads.elastic_left[i], loads.elastic_right[i], loads.energy[i],
            loads.power[i],
        ) = D.slice_forces(g.rate, g.next_rate, low, high, m0, m1, m2, p0, p1, p2, e0, e1, e2, w0, w1, w2)  # fmt: skip
    if want == 0:
        return
    for i in range(n):
        g, low, high = slice_of(strip, loads, i), loads.low[i], loads.high[i]
        p0, d0, v0, _, _ = at_point(copy, g, low, high, POINTS[0])
        p1, d1, v1, _, _ = at_point(copy, g, low, high, POINTS[1])
        p2, d2, v2, _, _ = at_point(copy, g, low, high, POINTS[2])
        (
            loads.k_ll[i], loads.k_lr[i], loads.k_rl[i], loads.k_rr[i], loads.r_ll[i], loads.r_lr[i], loads.r_rr[i],
            loads.left_low[i], loads.right_low[i], loads.left_high[i], loads.right_high[i],
        ) = D.slice_slopes(
            g.gap, g.next_gap, g.rate, g.next_rate, low, high, m0, m1, m2, p0, p1, p2, d0, d1, d2, v0, v1, v2,
            loads.clip_low[i], loads.clip_high[i],
        )  # fmt: skip


class Slice(NamedTuple):
    """Gaps and their rates at both nodes of a slice; nothing is read beyond one that does not count."""

    counts: bool
    gap: float
    next_gap: float
    rate: float
    next_rate: float


@inlined
def slice_of(strip, loads, i):
    """Return the gaps of a slice, and whether it touches."""
    counts = loads.depth[i] > 0.0
    gap, rate = strip.gap[i], strip.rate[i]
    return Slice(counts, gap, strip.gap[i + 1] if counts else gap, rate, strip.rate[i + 1] if counts else rate)


@inlined
def at_point(law, g, low, high, t):
    """Pressure at the fraction ``t`` of the touching part of a slice.

    Parameters
    ----------
    law : Law
    g : Slice
    low, high : float
        Where the touching part begins and ends, as fractions of the slice.
    t : float

    Returns
    -------
    p, p_depth, p_rate, energy, elastic : float
        Pressure with its derivatives, density of elastic energy, elastic pressure.
    """
    u = low + (high - low) * t
    depth = -g.gap - (g.next_gap - g.gap) * u
    inside = g.counts and depth > 0.0
    delta = depth if inside else 1.0
    rate = -g.rate - (g.next_rate - g.rate) * u if inside else 0.0
    p, p_d, p_r, w, e = pressure(law.kind, law.k * power(delta, law.e), law.e, law.c, law.d, delta, rate)
    on = 1.0 if inside else 0.0
    return on * p, on * p_d, on * p_r, on * w, on * e


@summing
def node_forces(loads, n, totals):
    """Gather the forces of the slices at the nodes, and energy and damping power; return the largest penetration."""
    energy = power_ = 0.0
    for i in range(n):
        energy += loads.energy[i]
        power_ += loads.power[i]
    totals.energy += energy
    totals.damping_power += power_
    # the place before the first of a row is the last lane of the row above, which is empty
    right, elastic = before(loads.force_right), before(loads.elastic_right)
    for i in range(n):
        loads.force[i] = loads.force_left[i] + right[i]
        loads.elastic[i] = loads.elastic_left[i] + elastic[i]
    depth = 0.0
    for i in range(n):
        depth = max(depth, loads.depth[i])
    return depth


@inlined
def slice_slope(strip, loads, i, k):
    """Fill the derivatives of one slice's forces by one pose number and its rate."""
    # by the pose through depths, and through rates with the gradient's own change; by its rates through rates alone
    g0, g1 = strip.grad[k, i], strip.grad[k, i + 1]
    h0, h1 = strip.rate_x[k, i], strip.rate_x[k, i + 1]
    r_ll, r_lr, r_rr = loads.r_ll[i], loads.r_lr[i], loads.r_rr[i]
    loads.v_left[k, i] = -(r_ll * g0 + r_lr * g1)
    loads.v_right[k, i] = -(r_lr * g0 + r_rr * g1)
    loads.x_left[k, i] = -(loads.k_ll[i] * g0 + loads.k_lr[i] * g1 + r_ll * h0 + r_lr * h1)
    loads.x_right[k, i] = -(loads.k_rl[i] * g0 + loads.k_rr[i] * g1 + r_lr * h0 + r_rr * h1)


@kernel
def slice_slopes(strip, loads, n):
    """Fill the derivatives of each slice's forces by the pose and its rates."""
    for i in range(n):
        slice_slope(strip, loads, i, 0)
        slice_slope(strip, loads, i, 1)
        slice_slope(strip, loads, i, 2)
        slice_slope(strip, loads, i, 3)
        slice_slope(strip, loads, i, 4)
        slice_slope(strip, loads, i, 5)


@inlined
def node_slope(loads, right, v_right, i, k):
    """Gather the derivatives of the slices' forces by one pose number and its rate at one node."""
    loads.force_x[k, i] = loads.x_left[k, i] + right[k, i]
    loads.force_xd[k, i] = loads.v_left[k, i] + v_right[k, i]


@kernel
def node_slopes(loads, n):
    """Gather the derivatives of the slices' forces at the nodes."""
    right, v_right = before(loads.x_right), before(loads.v_right)
    for i in range(n):
        node_slope(loads, right, v_right, i, 0)
        node_slope(loads, right, v_right, i, 1)
        node_slope(loads, right, v_right, i, 2)
        node_slope(loads, right, v_right, i, 3)
        node_slope(loads, right, v_right, i, 4)
        node_slope(loads, right, v_right, i, 5)


@kernel
def moving_end(loads, i, low, limit, width):
    """Add how the forces of slice ``i`` change as the end of the face that bounds it moves."""
    by_left = loads.left_low[i] if low else loads.left_high[i]
    by_right = loads.right_low[i] if low else loads.right_high[i]
    for k in range(6):
        # the limit's motion in slices
        moved = limit.grad[k] / width
        loads.x_left[k, i] += by_left * moved
        loads.x_right[k, i] += by_right * moved


@kernel
def end_force(law, strip, i, width, u, sign, limit, pair, sums, want):
    """Add the force from cutting the elastic layer at an end of the face: its energy density times the limit's motion.

    Parameters
    ----------
    law : Law
    strip : record
    i, width : int, float
        Slice of the strip that the face ends in, and the width of a slice, m.
    u : float
        Where in it, as a fraction.
    sign : float
        -1 at the lower end, +1 at the higher.
    limit, pair, sums : record
    want : int
        Nonzero to add derivatives.
    """
    d0 = -strip.gap[i]
    slope = -strip.gap[i + 1] - d0
    delta = d0 + slope * u
    if delta <= 0.0:
        return
    elastic = elastic_pressure(law.k, law.e, delta)
    energy = stored_energy(elastic, law.e, delta)
    grad, hess = limit.grad, limit.hess
    for m in range(6):
        # U = integral of the energy density up to the limit: dU/dx has the density there times dlimit/dx, and Q =
        # -dU/dx
        sums.q[m] -= sign * energy * grad[m]
    if want == 0:
        return
    softened = energy / pair.stiffness_factor
    for j in range(6):
        # the depth at the limit: changed by its motion along the slice, and by the gaps at both nodes
        dd = slope / width * grad[j] - (1.0 - u) * strip.grad[j, i] - u * strip.grad[j, i + 1]
        for m in range(6):
            # dw/ddelta is the elastic pressure
            moved = elastic * dd * grad[m] + energy * hess[m, j]
            # w is in proportion to the factor of a stiffness that varies along the path
            moved += softened * (grad[m] * pair.stiffness_factor_x[j] + grad[j] * pair.stiffness_factor_x[m])
            sums.q_x[m, j] -= sign * moved


# ADAMS's way of loading a tooth pair: one force per overlap, at its centroid, with the depth found there.


LEAST_VOLUME = 1e-300
"""Least measure of an overlap that its centroid is divided by: below it is nothing, or what is no normal double."""


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
