"""Where a tooth pair touches along and across the face: the ends of the common face, and where contacts stand.

The ends are limits along the mean axis; contacts stand half-way between the two surfaces. All come with their
derivatives by the pose.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.formulas import derived as D
from gearmbs.contact.gaps import derived as S
from gearmbs.contact.records import inlined, kernel
from gearmbs.contact.sections import LARGEST_TURN, NEAR_BASE, helical_turn, helix_square, tilt_of


@kernel
def roll_difference(side, wheels, f1, f2):
    """Length of roll on wheel 1 where the two flanks meet half-way between them, axes taken as parallel."""
    base_1 = side.base_1 * (f1 + wheels.wheel_1.half_angle)
    base_2 = side.base_2 * (f2 + wheels.wheel_2.half_angle)
    return 0.5 * (base_1 - base_2 + side.base_difference * side.alpha_0 + side.length)


@kernel
def end_roll(side, wheels, end, roll):
    """Length of roll on wheel 1 at an end of the face, from that at mid-face; ``end`` is +1 or -1."""
    zeta = wheels.face_low if end < 0.0 else wheels.face_high
    return roll - side.twist_1 * (zeta + 0.5 * wheels.axial_shift)


@inlined
def end_numbers(side, wheels, end, sig):
    """Return what an end of the face follows from, +1 or -1, at the length of roll of the transverse contact point."""
    half_1, half_2 = end * 0.5 * wheels.wheel_1.face_width, end * 0.5 * wheels.wheel_2.face_width
    return (
        side.x[L.A], side.x[L.H], side.x[L.P], side.x[L.Q], side.base_1, side.sin_0, side.cos_0, sig, side.i_w,
        half_1, half_2, end, wheels.end_blend,
    )  # fmt: skip


@kernel
def limit_value(side, wheels, end, sig):
    """Limit of the common face towards ``end``: the nearer end face of the two wheels, blended where they tie."""
    return D.end_value(*end_numbers(side, wheels, end, sig))


@kernel
def limit_slopes(side, wheels, end, sig, limit, want):
    """Fill the gradient of the limit of `limit_value` and, if wanted, its Hessian."""
    more = side.base_2, side.base_sum, side.base_difference, side.length, side.i_w3
    D.end_slopes(*end_numbers(side, wheels, end, sig), *more, limit.grad)
    if want != 0:
        D.end_curves(*end_numbers(side, wheels, end, sig), *more, side.i_w5, limit.hess)


# The one section at mid-face of spur wheels whose axes are parallel but for rounding: values in closed form.
#
# Joints hold wheels parallel to rounding errors, and most evaluations ask for values only. What the tilt does to gaps
# and normals is of second order there and lost in rounding; gradients keep their first order.


LEVEL = 1e-17  # square of the tilt whose effects of second order are lost in rounding


@inlined
def level(side, strip, n, want):
    """Whether the closed forms of this module hold for the sections of a strip."""
    p, q = side.x[L.P], side.x[L.Q]
    return n == 1 and want == 0 and side.twist_1 == 0.0 and strip.zeta[0] == 0.0 and p * p + q * q < LEVEL


@inlined
def put_gradient(side, strip, by_A, by_B, by_1, by_2):
    """Fill the gap's gradient by the pose from slopes by the tilt along and across the normal, and by the spins."""
    p, q, sa, ca = side.x[L.P], side.x[L.Q], strip.sin[0], strip.cos[0]
    # tilt along and across the normal: dA/dp = sin, dA/dq = cos, dB/dp = cos, dB/dq = -sin
    A, B = p * sa + q * ca, p * ca - q * sa
    gA, gB = by_A[0] * A + by_A[1] * B, by_B * A
    strip.grad[0, 0] = sa
    strip.grad[1, 0] = 0.0
    strip.grad[2, 0] = gA * sa + gB * ca
    strip.grad[3, 0] = gA * ca - gB * sa
    strip.grad[4, 0] = by_1
    strip.grad[5, 0] = by_2


@kernel
def level_flanks(side, strip):
    """Fill flank on flank; as `sections.flank_sections` after `sections.flank_normals`."""
    rb1, rb2 = side.base_1, side.base_2
    s1, s2 = rb1 * (side.start_1 + side.alpha_0), rb2 * (side.start_2 + side.alpha_0)
    half = 0.5 * side.base_sum
    strip.turn[0] = 0.0
    strip.roll_1[0] = s1
    strip.roll_2[0] = s2
    strip.kind[0] = 0.0
    # endless flanks on parallel axes: the line of action less both lengths of roll
    strip.gap[0] = side.length - (s1 + s2)
    put_gradient(side, strip, (-(s1 + s2), -half), -half, -rb1, -rb2)


@inlined
def level_normal(X, Y, rb, s0, c0):
    """Find the normal of an involute through a corner at (X, Y) from the centre of its base circle, axes parallel.

    Returns
    -------
    bears : bool
        Whether the corner is where the involute is not too curved to bear on.
    turn, sin, cos : float
        Angle of the normal from that of flank on flank, whose sine and cosine are ``s0`` and ``c0``; its own ones.
    """
    # the normal through the corner is tangent to the base circle: sqrt(R^2 - r_b^2) long, which is the length of roll
    # there
    R2 = X * X + Y * Y
    square = R2 - rb * rb
    bears = square > NEAR_BASE * NEAR_BASE * rb * rb
    roll = np.copysign(np.sqrt(max(square, 0.0)), rb)
    inverse = 1.0 / R2
    sa, ca = (roll * X - rb * Y) * inverse, (rb * X + roll * Y) * inverse
    # sine of the turn, and one more than its cosine
    over, beside = sa * c0 - ca * s0, 1.0 + (ca * c0 + sa * s0)
    if abs(over) > LARGEST_TURN * beside:
        turn = np.arctan2(over, beside - 1.0)
    else:
        # twice the arctangent of the tangent of half the turn
        t = over / beside
        u = t * t
        series = 1.0 / 7.0 - u * (1.0 / 9.0 - u * (1.0 / 11.0 - u * (1.0 / 13.0 - u * (1.0 / 15.0 - u / 17.0))))
        turn = 2.0 * t * (1.0 - u * (1.0 / 3.0 - u * (0.2 - u * series)))
    return bears, turn, sa, ca


@kernel
def level_corner(side, corner, strip, kind, start):
    """Fill a tip corner on the mate's involute; False where the involute is too curved to bear on.

    As `gearmbs.contact.corners.corner_starts` and the functions that follow it; the normal needs no iteration.

    Parameters
    ----------
    side, corner : record
    strip : record
        Out.
    kind : int
        The wheel whose corner bears, 1 or 2.
    start : float
        Angle of the mate's tooth from the line of centres, and its half angle at the base circle.
    """
    first = kind == 1
    rb = side.base_2 if first else side.base_1
    r, rounding, se, ce = corner.radius[0], corner.rounding[0], corner.sin[0], corner.cos[0]
    bears, turn, sa, ca = level_normal(side.x[L.A] - r * ce, -r * se, rb, side.sin_0, side.cos_0)
    if not bears:
        return False
    # g = a sin(alpha) - r sin(alpha + eta) - rho - r_b (phi + psi + alpha), stationary in alpha
    alpha = side.alpha_0 + turn
    s = rb * (start + alpha)
    sn, cs = sa * ce + ca * se, ca * ce - sa * se
    strip.alpha[0], strip.sin[0], strip.cos[0] = alpha, sa, ca
    strip.turn[0] = 0.0
    strip.good[0] = 1.0
    strip.roll_1[0] = corner.roll[0] if first else s
    strip.roll_2[0] = s if first else corner.roll[0]
    strip.kind[0] = float(kind)
    strip.gap[0] = side.x[L.A] * sa - (r * sn + rounding + s)
    # to first order in the tilt, which acts half-way between the wheels
    half = 0.5 * (r * cs + rb)
    by_own, by_mate = -r * cs, -rb
    by_1, by_2 = (by_own, by_mate) if first else (by_mate, by_own)
    put_gradient(side, strip, (-(r * sn + rounding + s), -half), -half, by_1, by_2)
    return True


@kernel
def level_point(side, corner, strip, loads, f):
    """Fill the place of the contact; as `points.contact_points`.

    Parameters
    ----------
    side, corner, strip, loads : record
    f : float
        Angle of wheel 1's tooth from the line of centres, and its half angle at the base circle.
    """
    sa, ca = strip.sin[0], strip.cos[0]
    p, q, zp = side.x[L.P], side.x[L.Q], 0.5 * side.x[L.H]
    normal, tangent = side.base_1 * (f + strip.alpha[0]), side.base_1
    if strip.kind[0] == 1.0:
        r, se, ce = corner.radius[0], corner.sin[0], corner.cos[0]
        normal = r * (sa * ce + ca * se) + corner.rounding[0]
        tangent = r * (ca * ce - sa * se)
    loads.normal[0] = normal + (p * sa + q * ca) * zp + 0.5 * strip.gap[0]
    loads.tangent[0] = tangent + (p * ca - q * sa) * zp


@kernel
def contact_points(side, corner, strip, loads, n, f, corners, want):
    """Fill where the contacts stand in the sections, half-way between the surfaces, and their derivatives.

    Coordinates are along the normal and the tangent ``(cos alpha, -sin alpha)``, from the centre of wheel 1.

    Parameters
    ----------
    side : record
    corner : record
        Tip corner of wheel 1, for sections in which it bears.
    strip, loads : record
        Sections with gaps; out: places in ``loads``.
    n : int
        Sections.
    f : float
        Angle of wheel 1's tooth from the line of centres, and its half angle at the base circle.
    corners : bool
        Whether the corner bears in any of the sections.
    want : int
        Nonzero to fill derivatives.
    """
    if level(side, strip, n, want):
        level_point(side, corner, strip, loads, f)
        return
    tilt, rb, h = tilt_of(side), side.base_1, side.x[L.H]
    for j in range(n):
        gap, zeta, sa, ca = strip.gap[j], strip.zeta[j], strip.sin[j], strip.cos[j]
        s = rb * (f + strip.alpha[j] + strip.turn[j])
        normal, tangent = S.involute_point(gap, zeta, h, sa, ca, s, rb, *tilt)
        if corners:
            se, ce, r, rt = corner.sin[j], corner.cos[j], corner.radius[j], corner.rounding[j]
            bears = strip.kind[j] == 1.0
            corner_normal, corner_tangent = S.corner_point(gap, zeta, h, sa, ca, se, ce, r, rt, *tilt)
            normal, tangent = corner_normal if bears else normal, corner_tangent if bears else tangent
        loads.normal[j], loads.tangent[j] = normal, tangent
    if want == 0:
        return
    turns, grad, normal_x, tangent_x = strip.alpha_x, strip.grad, loads.normal_x, loads.tangent_x
    for j in range(n):
        zeta, sa, ca = strip.zeta[j], strip.sin[j], strip.cos[j]
        s = rb * (f + strip.alpha[j] + strip.turn[j])
        S.involute_point_slopes(zeta, h, sa, ca, s, rb, turns, grad, normal_x, tangent_x, j, *tilt)
    for j in range(n if corners else 0):
        if strip.kind[j] == 1.0:
            zeta, sa, ca = strip.zeta[j], strip.sin[j], strip.cos[j]
            se, ce, r, rt = corner.sin[j], corner.cos[j], corner.radius[j], corner.rounding[j]
            S.corner_point_slopes(zeta, h, sa, ca, se, ce, r, rt, turns, grad, normal_x, tangent_x, j, *tilt)


# Where the contacts of helical wheels stand; loops as in `sections`.


@kernel
def helical_points(side, corner, strip, loads, n, f, corners, want):
    """Fill where the contacts of helical wheels stand, and their derivatives; as `contact_points`.

    Parameters
    ----------
    side, corner, strip, loads : record
    n : int
        Sections.
    f : float
        Angle of wheel 1's tooth from the line of centres, and its half angle at the base circle.
    corners : bool
        Whether wheel 1's edge bears in any of the sections.
    want : int
        Nonzero to fill derivatives.
    """
    tilt, rb, h, t, c = tilt_of(side), side.base_1, side.x[L.H], side.twist_1, helix_square(side)
    k, bears = t / rb, strip.kind
    for j in range(n):
        zeta, sa, ca = strip.zeta[j], strip.sin[j], strip.cos[j]
        s = rb * (f + strip.alpha[j] + helical_turn(sa, ca, t, tilt))
        loads.normal[j], loads.tangent[j] = S.helicoid_point(strip.gap[j], zeta, h, sa, ca, t, c, s, rb, *tilt)
    for j in range(n if corners else 0):
        zeta, sa, ca = strip.zeta[j], strip.sin[j], strip.cos[j]
        se, ce, r, rt = corner.sin[j], corner.cos[j], corner.radius[j], corner.rounding[j]
        normal, tangent = S.edge_point(strip.gap[j], zeta, h, sa, ca, se, ce, r, rt, k, *tilt)
        loads.normal[j] = normal if bears[j] == 1.0 else loads.normal[j]
        loads.tangent[j] = tangent if bears[j] == 1.0 else loads.tangent[j]
    if want == 0:
        return
    turns, grad, normal_x, tangent_x = strip.alpha_x, strip.grad, loads.normal_x, loads.tangent_x
    for j in range(n):
        zeta, sa, ca = strip.zeta[j], strip.sin[j], strip.cos[j]
        s = rb * (f + strip.alpha[j] + helical_turn(sa, ca, t, tilt))
        S.helicoid_point_slopes(zeta, h, sa, ca, t, c, s, rb, turns, grad, normal_x, tangent_x, j, *tilt)
    for j in range(n if corners else 0):
        if bears[j] == 1.0:
            zeta, sa, ca = strip.zeta[j], strip.sin[j], strip.cos[j]
            se, ce, r, rt = corner.sin[j], corner.cos[j], corner.radius[j], corner.rounding[j]
            S.edge_point_slopes(zeta, h, sa, ca, se, ce, r, rt, k, turns, grad, normal_x, tangent_x, j, *tilt)
