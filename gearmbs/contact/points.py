"""Where the contacts of a strip stand: half-way between the two surfaces, with derivatives by the pose."""

from __future__ import annotations

import numpy as np

from gearmbs.contact.jit import kernel
from gearmbs.contact.level import level, level_point
from gearmbs.contact.support import corner_curvatures, corner_slopes, involute_curvatures, involute_slopes, tilt_of


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
    tilt = tilt_of(side)
    p, q, i_w = tilt.p, tilt.q, tilt.i_w
    rb, half_h = side.base_1, 0.5 * side.x[1]
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap = np.sqrt(1.0 - B * B)
        zp = strip.zeta[j] + half_h
        s = rb * (f + strip.alpha[j] + strip.turn[j])
        h = involute_slopes(A, B, kap, s, rb, tilt)
        c = h
        if corners:
            sn = sa * corner.cos[j] + ca * corner.sin[j]
            cs = ca * corner.cos[j] - sa * corner.sin[j]
            c = corner_slopes(A, B, kap, sn, cs, corner.radius[j], corner.rounding[j], tilt)
        bears = strip.kind[j] == 1.0
        loads.normal[j] = (c.h if bears else h.h) + A * i_w * zp + 0.5 * strip.gap[j]
        loads.tangent[j] = (c.alpha if bears else h.alpha) + B * i_w * zp
        loads.slope_A[j] = c.A if bears else h.A
        loads.slope_B[j] = c.B if bears else h.B
        loads.slope_F[j] = c.F if bears else h.F
    if want != 0:
        point_slopes(side, corner, strip, loads, n, f, corners)


@kernel
def point_slopes(side, corner, strip, loads, n, f, corners):
    """Fill derivatives of the contact points by the pose; arguments as in `contact_points`, which runs before."""
    tilt = tilt_of(side)
    p, q, i_w, i_w3 = tilt.p, tilt.q, tilt.i_w, tilt.i_w3
    rb, half_h = side.base_1, 0.5 * side.x[1]
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap = np.sqrt(1.0 - B * B)
        zp = strip.zeta[j] + half_h
        s = rb * (f + strip.alpha[j] + strip.turn[j])
        h = involute_curvatures(A, B, kap, s, rb, tilt)
        c = h
        if corners:
            sn = sa * corner.cos[j] + ca * corner.sin[j]
            cs = ca * corner.cos[j] - sa * corner.sin[j]
            c = corner_curvatures(A, B, kap, sn, cs, corner.radius[j], corner.rounding[j], tilt)
        bears = strip.kind[j] == 1.0
        cross = A * B * i_w3 * zp
        normal_A = loads.slope_A[j] + kap * kap * i_w3 * zp
        normal_B = loads.slope_B[j] + cross
        tangent_A = (c.alpha_A if bears else h.alpha_A) + cross
        tangent_B = (c.alpha_B if bears else h.alpha_B) + (i_w + B * B * i_w3) * zp
        by_n = loads.tangent[j]
        by_t = (c.alpha_alpha if bears else h.alpha_alpha) - A * i_w * zp
        x = strip.alpha_x
        grad, normal, tangent = strip.grad, loads.normal_x, loads.tangent_x
        normal[0, j] = 0.5 * grad[0, j] + by_n * x[0, j]
        normal[1, j] = 0.5 * grad[1, j] + by_n * x[1, j] + 0.5 * A * i_w
        normal[2, j] = 0.5 * grad[2, j] + by_n * x[2, j] + normal_A * sa + normal_B * ca
        normal[3, j] = 0.5 * grad[3, j] + by_n * x[3, j] + normal_A * ca - normal_B * sa
        normal[4, j] = 0.5 * grad[4, j] + by_n * x[4, j] + loads.slope_F[j]
        normal[5, j] = 0.5 * grad[5, j] + by_n * x[5, j]
        tangent[0, j] = by_t * x[0, j]
        tangent[1, j] = by_t * x[1, j] + 0.5 * B * i_w
        tangent[2, j] = by_t * x[2, j] + tangent_A * sa + tangent_B * ca
        tangent[3, j] = by_t * x[3, j] + tangent_A * ca - tangent_B * sa
        tangent[4, j] = by_t * x[4, j] + (c.alpha_F if bears else h.alpha_F)
        tangent[5, j] = by_t * x[5, j]
