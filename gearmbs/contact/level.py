"""The one section at mid-face of spur wheels whose axes are parallel but for rounding: values in closed form.

Joints hold wheels parallel to rounding errors, and most evaluations ask for values only. What the tilt does to gaps and
normals is of second order there and lost in rounding; gradients keep their first order.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.jit import inlined, kernel
from gearmbs.contact.sections import LARGEST_TURN, NEAR_BASE

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
    strip.gap[0] = side.length - (s1 + s2)
    put_gradient(side, strip, (-(s1 + s2), -half), -half, -rb1, -rb2)


@kernel
def level_corner(side, corner, strip, kind, start):
    """Fill a tip corner on the mate's involute; False where the involute is too curved to bear on.

    As `corner_sections.corner_starts` and the functions that follow it; the normal needs no iteration.

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
    X, Y = side.x[L.A] - r * ce, -r * se
    R2 = X * X + Y * Y
    square = R2 - rb * rb
    if not square > NEAR_BASE * NEAR_BASE * rb * rb:
        return False
    roll = np.copysign(np.sqrt(square), rb)
    inverse = 1.0 / R2
    sa, ca = (roll * X - rb * Y) * inverse, (rb * X + roll * Y) * inverse
    s0, c0 = side.sin_0, side.cos_0
    over, beside = sa * c0 - ca * s0, 1.0 + (ca * c0 + sa * s0)
    if abs(over) > LARGEST_TURN * beside:
        turn = np.arctan2(over, beside - 1.0)
    else:
        # twice the arctangent of the tangent of half the turn
        t = over / beside
        u = t * t
        series = 1.0 / 7.0 - u * (1.0 / 9.0 - u * (1.0 / 11.0 - u * (1.0 / 13.0 - u * (1.0 / 15.0 - u / 17.0))))
        turn = 2.0 * t * (1.0 - u * (1.0 / 3.0 - u * (0.2 - u * series)))
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
