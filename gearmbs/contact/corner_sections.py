"""Gaps of tip corners on the mate's involute in the sections of a strip; loops as in `sections`."""

from __future__ import annotations

import numpy as np

from gearmbs.contact.jit import kernel
from gearmbs.contact.sections import (
    LARGEST_TURN,
    NEAR_BASE,
    NEWTON_END,
    NEWTON_STEPS,
    GapCurvatures,
    normal_turns,
    put_curvatures,
    steps_over,
    steps_squared,
    turned,
    unmark_unsettled,
)
from gearmbs.contact.support import (
    corner_curvatures,
    corner_slopes,
    involute_curvatures,
    involute_slopes,
    normal_turn,
    tilt_of,
)


@kernel
def corner_starts(side, corner, strip, n, rb, normal):
    """Start the normals where tip corners stand over the mate's involute, axes taken as parallel.

    Marks in ``strip.good`` the corners outside the mate's base circle (radius ``rb``) and off it.
    """
    a, p, q, m, i_w = side.x[0], side.x[2], side.x[3], side.m, side.i_w
    alpha, s0, c0 = normal.alpha[0], normal.sin[0], normal.cos[0]
    near = NEAR_BASE * NEAR_BASE * rb * rb
    for j in range(n):
        r = corner.radius[j]
        vx, vy = -r * corner.cos[j], -r * corner.sin[j]
        along = (p * vx + q * vy) * m - 2.0 * strip.zeta[j] * i_w
        X = a + vx + p * along
        Y = vy + q * along
        lean = p * X + q * Y
        R2 = X * X + Y * Y
        strip.good[j] = 1.0 if R2 - lean * lean - rb * rb > near else 0.0
        roll = np.copysign(np.sqrt(max(R2 - rb * rb, near)), rb)
        sa = (roll * X - rb * Y) / R2
        ca = (rb * X + roll * Y) / R2
        # the angle from the normal nearby, by the series of the arctangent of its half
        t = (sa * c0 - ca * s0) / (1.0 + (ca * c0 + sa * s0))
        u = t * t
        series = 1.0 / 7.0 - u * (1.0 / 9.0 - u * (1.0 / 11.0 - u * (1.0 / 13.0 - u * (1.0 / 15.0 - u / 17.0))))
        strip.alpha[j] = alpha + 2.0 * t * (1.0 - u * (1.0 / 3.0 - u * (0.2 - u * series)))
        strip.sin[j] = sa
        strip.cos[j] = ca
        strip.step[j] = t
    if steps_over(strip, n, LARGEST_TURN) > 0.0:
        for j in range(n):
            sa, ca = strip.sin[j], strip.cos[j]
            strip.alpha[j] = alpha + np.arctan2(sa * c0 - ca * s0, ca * c0 + sa * s0)


@kernel
def corner_normals(side, corner, strip, n, s0, rb):
    """Turn the normals onto those where the corners at work bear on the mate's involute, by Newton's method.

    ``s0`` is the mate's ``rb (phi + psi)``. Unmarks sections whose iteration does not settle.
    """
    tilt = tilt_of(side)
    p, q, w, i_w, m = tilt.p, tilt.q, tilt.w, tilt.i_w, tilt.m
    a = side.x[0]
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
            se, ce, r = corner.sin[j], corner.cos[j], corner.radius[j]
            A = p * sa + q * ca
            B = p * ca - q * sa
            i_k2 = 1.0 / (1.0 - B * B)
            i_k = np.sqrt(i_k2)
            s = s0 + rb * (strip.alpha[j] + normal_turn(A, B, tilt)) + corner.rounding[j]
            sn = sa * ce + ca * se
            cs = ca * ce - sa * se
            V = A * sn + B * cs
            g1 = a * ca - A * B * s * i_w * i_k - rb * i_k - r * (cs + m * B * V) - 2.0 * B * zeta * i_w
            g2 = s * (A * A * i_w - B * B * w * i_k2) * i_k - a * sa + r * (sn + m * A * V) + 2.0 * A * zeta * i_w
            step = min(max(-g1 / g2, -LARGEST_TURN), LARGEST_TURN)
            strip.alpha[j] += step
            strip.sin[j], strip.cos[j] = turned(sa, ca, step)
            strip.step[j] = step
        if steps_squared(strip, n) < NEWTON_END * NEWTON_END:
            return
    unmark_unsettled(strip, n)


@kernel
def corner_sections(side, corner, strip, n, kind, f, want):
    """Fill gaps of tip corners on the mate's flank, with derivatives by the pose.

    Parameters
    ----------
    side, corner, strip : record
    n : int
        Sections.
    kind : int
        The wheel whose corner bears, 1 or 2.
    f : float
        Angle of the mate's tooth from the line of centres, and its half angle at the base circle.
    want : int
        Nonzero to fill second derivatives.
    """
    tilt = tilt_of(side)
    p, q, i_w, i_w3 = tilt.p, tilt.q, tilt.i_w, tilt.i_w3
    a = side.x[0]
    first = kind == 1
    rb = side.base_2 if first else side.base_1
    normal_turns(side, strip, n)
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap = np.sqrt(1.0 - B * B)
        s = rb * (f + strip.alpha[j] + strip.turn[j])
        sn = sa * corner.cos[j] + ca * corner.sin[j]
        cs = ca * corner.cos[j] - sa * corner.sin[j]
        h = corner_slopes(A, B, kap, sn, cs, corner.radius[j], corner.rounding[j], tilt)
        g = involute_slopes(A, B, kap, s, rb, tilt)
        gA = -h.A - g.A - 2.0 * zeta * kap * kap * i_w3
        gB = -h.B - g.B - 2.0 * zeta * A * B * i_w3
        strip.roll_1[j] = corner.roll[j] if first else s
        strip.roll_2[j] = s if first else corner.roll[j]
        strip.kind[j] = float(kind)
        strip.gap[j] = a * sa - 2.0 * A * i_w * zeta - (h.h + g.h)
        strip.grad[0, j] = sa
        strip.grad[1, j] = 0.0
        strip.grad[2, j] = gA * sa + gB * ca
        strip.grad[3, j] = gA * ca - gB * sa
        strip.grad[4, j] = -h.F if first else -g.F
        strip.grad[5, j] = -g.F if first else -h.F
    if want == 0:
        return
    i_w5 = tilt.i_w5
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap = np.sqrt(1.0 - B * B)
        sn = sa * corner.cos[j] + ca * corner.sin[j]
        cs = ca * corner.cos[j] - sa * corner.sin[j]
        c = corner_curvatures(A, B, kap, sn, cs, corner.radius[j], corner.rounding[j], tilt)
        d = involute_curvatures(A, B, kap, strip.roll_2[j] if first else strip.roll_1[j], rb, tilt)
        put_curvatures(
            strip, j, sa, ca,
            GapCurvatures(
                2.0 * A * i_w * zeta - a * sa - (c.alpha_alpha + d.alpha_alpha),
                -(c.alpha_A + d.alpha_A) - 2.0 * zeta * A * B * i_w3,
                -(c.alpha_B + d.alpha_B) - 2.0 * zeta * (i_w + B * B * i_w3),
                -c.alpha_F if first else -d.alpha_F,
                -d.alpha_F if first else -c.alpha_F,
                -(c.AA + d.AA) - 6.0 * zeta * kap * kap * A * i_w5,
                -(c.AB + d.AB) - 2.0 * zeta * (3.0 * kap * kap * B * i_w5 - 2.0 * B * i_w3),
                -(c.BB + d.BB) - 2.0 * zeta * A * (i_w3 + 3.0 * B * B * i_w5),
                -c.AF if first else -d.AF,
                -c.BF if first else -d.BF,
                -d.AF if first else -c.AF,
                -d.BF if first else -c.BF,
                -c.FF if first else 0.0,
                0.0 if first else -c.FF,
            ),
        )  # fmt: skip
