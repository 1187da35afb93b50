"""What single teeth do differently: material missing from a flank, a shorter tip, a softer tooth.

A deviation is the thickness of material removed along the normal (negative: added), so it adds to the gap. It is
looked up where the contact stands on the profile, with the derivatives of that place by the pose.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.formulas import derived as D
from gearmbs.contact.records import integers_of, kernel, reals_of

SHORTEST = 0.01  # length of roll over base radius where the lookup ends towards the base circle


@kernel
def tooth_flank(options, wheel, sign, tooth):
    """Place of a tooth flank among all of the pair; wheel 0 or 1, side +1 or -1, tooth any integer."""
    z = options.teeth[wheel]
    index = (sign * tooth) % z
    if sign < 0:
        index += z
    if wheel == 1:
        index += 2 * options.teeth[0]
    return index


@kernel
def flank_number(options, flank, which):
    """Number of a tooth flank's shape, tip or compliance (`layout.FLANK_SHAPE` and on), -1 for none."""
    return integers_of(options)[options.flanks + L.FLANK * flank + which]


@kernel
def clear_lookup(lookup):
    """Set derivatives of a place on the profile to nothing."""
    for i in range(6):
        lookup.grad[i] = 0.0
        for j in range(6):
            lookup.hess[i, j] = 0.0


@kernel
def roll_of_flanks(side, wheels, lookup, wheel, f1, f2, zeta):
    """Length of roll where flank bears on flank on one wheel, with gradient and Hessian by the pose.

    The place is half-way between the surfaces: that of parallel axes moved by the tilt to first order.

    Parameters
    ----------
    side, wheels : record
    lookup : record
        Out.
    wheel : int
        0 or 1.
    f1, f2 : float
        Angles of the two teeth from the line of centres.
    zeta : float
        Place of the section along the mean axis.
    """
    clear_lookup(lookup)
    x, wheel_1 = side.x, wheel == 0
    own, twist, sign = (side.base_1, side.twist_1, 1.0) if wheel_1 else (side.base_2, side.twist_2, -1.0)
    F1, F2 = f1 + wheels.wheel_1.half_angle, f2 + wheels.wheel_2.half_angle
    lookup.roll = D.flanks_roll(
        x[L.A], x[L.H], x[L.P], x[L.Q], F1, F2, zeta, own, twist, sign, side.base_1, side.base_2, side.alpha_0,
        side.length, lookup.grad, lookup.hess,
    )  # fmt: skip


@kernel
def roll_under_corner(side, corner, strip, j, lookup, wheel, want):
    """Length of roll on one wheel where a corner bears in section ``j``, with gradient and Hessian by the pose.

    Half-way between the surfaces: where the corner stands, less half the gap of perfect profiles. Agrees with
    `roll_of_flanks` where the one takes over from the other.
    """
    clear_lookup(lookup)
    grad, hess = lookup.grad, lookup.hess
    own_corner = strip.kind[j] == wheel + 1
    half = 0.5 if own_corner else -0.5
    lookup.roll = half * strip.gap[j]
    for i in range(6):
        grad[i] = half * strip.grad[i, j]
        if want != 0:
            for k in range(6):
                hess[i, k] = half * (strip.hess[i, k, j] if i <= k else strip.hess[k, i, j])
    if own_corner:
        lookup.roll += corner.roll[j]
        return
    a, zeta = side.x[L.A], strip.zeta[j]
    mate = side.base_1 if wheel == 0 else side.base_2
    r, se, ce = corner.radius[j], corner.sin[j], corner.cos[j]
    x, own = side.x, 1.0 if wheel == 1 else -1.0
    twist, base = (side.twist_1, side.base_1) if wheel == 1 else (side.twist_2, side.base_2)
    s2 = D.foot_square(a, x[L.P], x[L.Q], zeta, r, se, ce, mate)
    if s2 < SHORTEST * SHORTEST * mate * mate:
        lookup.roll += SHORTEST * mate - corner.rounding[j]
        return
    s = np.copysign(np.sqrt(s2), mate)
    lookup.roll += s - corner.rounding[j]
    numbers = (a, x[L.H], x[L.P], x[L.Q], zeta, r, se, ce, own, s, twist / base, side.w)
    D.foot_slopes(*numbers, grad)
    if want != 0:
        D.foot_bends(*numbers, hess)


@kernel
def cubic(reals, o, n, u):
    """Value and first two derivatives, per place, of the curve ``reals[o:o+n]`` at ``u`` places: Catmull-Rom.

    Beyond its ends the curve keeps its end value.
    """
    if u <= 0.0:
        return reals[o], 0.0, 0.0
    if u >= n - 1.0:
        return reals[o + n - 1], 0.0, 0.0
    k = int(u)
    t = u - k
    y1 = reals[o + k]
    y2 = reals[o + k + 1]
    # slopes at both ends of the piece: half the difference of the neighbours; none at the ends of the curve
    m1 = 0.0 if k == 0 else 0.5 * (y2 - reals[o + k - 1])
    m2 = 0.0 if k == n - 2 else 0.5 * (reals[o + k + 2] - y1)
    d = y2 - y1
    c2 = 3.0 * d - 2.0 * m1 - m2
    c3 = m1 + m2 - 2.0 * d
    return y1 + t * (m1 + t * (c2 + t * c3)), m1 + t * (2.0 * c2 + 3.0 * t * c3), 2.0 * c2 + 6.0 * t * c3


@kernel
def shape_value(options, reals, wheel, shape, s, z):
    """A deviation shape at length of roll ``s`` and face position ``z`` (from -1 to 1): value, slopes, curvatures.

    Returns
    -------
    value, by s, by z, by s twice, by s and z : float
        Linear in z between its places and beyond the ends.
    """
    ns = options.profile_places
    nz = options.face_places
    ds = wheel.shape_spacing
    u = (s - wheel.shape_start) / ds
    v = 0.5 * (z + 1.0) * (nz - 1)
    k = min(max(int(v), 0), nz - 2)
    t = v - k
    o = options.shapes + (shape * nz + k) * ns
    y0, d0, c0 = cubic(reals, o, ns, u)
    y1, d1, c1 = cubic(reals, o + ns, ns, u)
    dz = 0.5 * (nz - 1)
    return (
        y0 + t * (y1 - y0),
        (d0 + t * (d1 - d0)) / ds,
        (y1 - y0) * dz,
        (c0 + t * (c1 - c0)) / (ds * ds),
        (d1 - d0) * dz / ds,
    )


@kernel
def add_deviations(options, wheels, scratch, strip, j, want):
    """Add the deviations of both teeth of the pair at work to the gap in section ``j`` and to its derivatives."""
    side, pair = scratch.side, scratch.pair
    flank_1, flank_2 = int(pair.flank_1), int(pair.flank_2)
    shape_1 = flank_number(options, flank_1, L.FLANK_SHAPE)
    shape_2 = flank_number(options, flank_2, L.FLANK_SHAPE)
    reals = reals_of(wheels)
    kind = int(strip.kind[j])
    # both places on the profiles follow from the gap of perfect ones, so they are found before it changes
    for wheel in range(2):
        lookup = scratch.lookup_1 if wheel == 0 else scratch.lookup_2
        if (shape_1 if wheel == 0 else shape_2) < 0:
            continue
        if kind == L.FLANKS:
            roll_of_flanks(side, wheels, lookup, wheel, pair.f_1, pair.f_2, strip.zeta[j])
        else:
            corner = scratch.corner_1 if kind == L.CORNER_1 else scratch.corner_2
            roll_under_corner(side, corner, strip, j, lookup, wheel, want)
    strip.gap[j] += reals[options.offsets + flank_1] + reals[options.offsets + flank_2]
    if shape_1 >= 0:
        add_shape(options, reals, wheels.wheel_1, shape_1, 1.0, side.x[L.H], scratch.lookup_1, strip, j, want)
    if shape_2 >= 0:
        add_shape(options, reals, wheels.wheel_2, shape_2, -1.0, side.x[L.H], scratch.lookup_2, strip, j, want)


@kernel
def add_shape(options, reals, wheel, shape, sign, h, lookup, strip, j, want):
    """Add a deviation shape at a place on a profile to the gap in section ``j``.

    Parameters
    ----------
    options : record
    reals : ndarray
        All reals of the pair's table.
    wheel : record
    shape : int
        Number of the shape.
    sign : float
        +1 on wheel 1, -1 on wheel 2.
    h : float
        Axial offset.
    lookup, strip : record
    j : int
        Section.
    want : int
        Nonzero to add second derivatives.
    """
    # the shape's own coordinate, -1 to 1 over its wheel's face
    scale = 2.0 / wheel.face_width
    z = (strip.zeta[j] + sign * 0.5 * h) * scale
    value, by_s, by_z, by_ss, by_sz = shape_value(options, reals, wheel, shape, lookup.roll, z)
    z_h = 0.5 * sign * scale
    grad = lookup.grad
    strip.gap[j] += value
    for i in range(6):
        strip.grad[i, j] += by_s * grad[i]
    strip.grad[L.H, j] += by_z * z_h
    if want == 0:
        return
    mixed = by_sz * z_h
    for i in range(6):
        for k in range(i, 6):
            # d(s(x), z(h)): d_ik = d_ss s_i s_k + d_s s_ik, and d_sz s_i z_h beside h
            strip.hess[i, k, j] += by_ss * grad[i] * grad[k] + by_s * lookup.hess[i, k]
        strip.hess[min(i, L.H), max(i, L.H), j] += mixed * grad[i]
    strip.hess[L.H, L.H, j] += mixed * grad[L.H]


@kernel
def tip_roll(options, wheels, wheel, k, flank, zeta):
    """Length of roll where a tooth's flank ends in a section: its own if broken or chipped there, else the wheel's.

    Sections count from the wheels' axial places in the drawing; axial vibration does not move them. ``k`` is 0 for
    wheel 1 and 1 for wheel 2.
    """
    tip = flank_number(options, flank, L.FLANK_TIP)
    if tip < 0:
        return wheel.tip_roll
    nz = options.face_places
    sign = 1.0 if k == 0 else -1.0
    z = (zeta + sign * 0.5 * wheels.axial_shift) * 2.0 / wheel.face_width
    v = min(max(0.5 * (z + 1.0) * (nz - 1), 0.0), nz - 1.0)
    i = min(int(v), nz - 2)
    o = options.tips + tip * nz + i
    reals = reals_of(wheels)
    return reals[o] + (v - i) * (reals[o + 1] - reals[o])


@kernel
def pair_stiffness_factor(options, wheels, side, pair, lookup):
    """Stiffness factor of a tooth pair from relative compliances along its profiles, with derivatives.

    The factor is one over the sum of the pair's own curve and of what each of the two teeth adds to it, looked up
    where parallel flanks would touch.
    """
    n = options.compliance_places
    reals = reals_of(wheels)
    base = options.compliances
    roll_of_flanks(side, wheels, lookup, 0, pair.f_1, pair.f_2, 0.0)
    ds = wheels.compliance_spacing
    u = (lookup.roll - wheels.compliance_start) / ds
    total, slope, curve = cubic(reals, base, n, u)
    if options.flanks != 0:
        for k in range(2):
            flank = int(pair.flank_1 if k == 0 else pair.flank_2)
            number = flank_number(options, flank, L.FLANK_COMPLIANCE)
            if number >= 0:
                value, d1, d2 = cubic(reals, base + (1 + number) * n, n, u)
                total += value
                slope += d1
                curve += d2
    slope /= ds
    curve /= ds * ds
    m = 1.0 / total
    pair.stiffness_factor = m
    m1 = -slope * m * m
    m2 = (2.0 * slope * slope * m - curve) * m * m
    for i in range(6):
        pair.stiffness_factor_x[i] = m1 * lookup.grad[i]
        for j in range(6):
            pair.stiffness_factor_xx[i, j] = m2 * lookup.grad[i] * lookup.grad[j] + m1 * lookup.hess[i, j]
