"""The gap of two involutes in the sections of a strip: solve for the normal, then value, gradient and Hessian.

Each function runs over the sections of a strip side by side. Its loops have no calls and no branches that depend on
the section, so that the compiler turns them into vector instructions: what differs between sections is chosen, not
jumped over. Numbers that all sections share are copied out of their records before a loop.

"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.contact.records import inlined, kernel, summing
from gearmbs.contact.support.profiles import involute_curvatures, involute_slopes, normal_turn, tilt_of

NEWTON_STEPS = 20
NEWTON_END = 1e-6  # a further step would change alpha by about the square of it
LARGEST_TURN = 0.1  # rad, for the series of sine and cosine
NEAR_BASE = 0.003
"""Length of roll over base radius below which an involute is too curved to bear on, and goes on as a plane: the two are
a sixth of its cube of the base radius apart, 5e-10 m at 0.1 m."""


class GapCurvatures(NamedTuple):
    """Second derivatives of the separation at fixed normal, by alpha, the tilt along and across it, and the spins."""

    alpha_alpha: float
    alpha_A: float
    alpha_B: float
    alpha_F1: float
    alpha_F2: float
    AA: float
    AB: float
    BB: float
    AF1: float
    BF1: float
    AF2: float
    BF2: float
    FF1: float
    FF2: float


@inlined
def turned(sa, ca, step):
    """Sine and cosine of an angle turned by a small step."""
    # Taylor's series of cosine and sine, to rounding up to `LARGEST_TURN`
    d2 = step * step
    c = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0 - d2 / 40320.0)))
    s = step * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0 - d2 * (1.0 / 5040.0 - d2 / 362880.0))))
    return sa * c + ca * s, ca * c - sa * s


@kernel
def set_sections(strip, n, side, first, count, normal):
    """Place the sections of a strip and start their normals.

    Parameters
    ----------
    strip : record
        Out.
    n : int
        Sections to fill, 1 or `layout.LANES`; those beyond ``count`` repeat the last one.
    side : record
    first, count : float
        Number of the strip's first node, and how many nodes the strip has.
    normal : record
        Strip whose first section has a solved normal nearby.
    """
    alpha, sa, ca = normal.alpha[0], normal.sin[0], normal.cos[0]
    slope, middle = normal.step[0], normal.zeta[0]
    low, width = side.low, side.step
    for j in range(n):
        zeta = low + (first + min(float(j), count - 1.0)) * width
        # normals turn evenly along the face but for what Newton's method adds: d alpha / d zeta of the section in the
        # middle
        step = slope * (zeta - middle)
        strip.zeta[j] = zeta
        strip.alpha[j] = alpha + step
        strip.sin[j], strip.cos[j] = turned(sa, ca, step)
    largest = abs(slope) * (abs(low + first * width - middle) + count * width)
    if largest > LARGEST_TURN:
        exact_turns(strip, n)


@kernel
def exact_turns(strip, n):
    """Take sines and cosines of the normals anew, after large steps."""
    for j in range(n):
        strip.sin[j] = np.sin(strip.alpha[j])
        strip.cos[j] = np.cos(strip.alpha[j])


@summing
def steps_squared(strip, n):
    """Sum of the squared steps of Newton's method over the sections that still count."""
    total = 0.0
    for j in range(n):
        step = strip.step[j] if strip.good[j] != 0.0 else 0.0
        total += step * step
    return total


@summing
def steps_over(strip, n, limit):
    """Number of sections whose step is larger than a limit, or no number."""
    count = 0.0
    for j in range(n):
        count += 0.0 if abs(strip.step[j]) <= limit else 1.0
    return count


@kernel
def unmark_unsettled(strip, n):
    """Unmark the sections in which Newton's method has not settled."""
    for j in range(n):
        if not abs(strip.step[j]) < NEWTON_END:
            strip.good[j] = 0.0


@kernel
def flank_normals(side, strip, n):
    """Turn the normals of a strip onto the common normals of two involutes, by Newton's method.

    Leaves ``d alpha / d zeta`` of the first section in ``strip.step[0]``.
    """
    tilt = tilt_of(side)
    p, q, w, i_w = tilt.p, tilt.q, tilt.w, tilt.i_w
    a, s0, rb = side.x[0], side.roll_sum, side.base_sum
    for j in range(n):
        strip.good[j] = 1.0
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca = strip.sin[j], strip.cos[j]
            A = p * sa + q * ca
            B = p * ca - q * sa
            i_k2 = 1.0 / (1.0 - B * B)
            i_k = np.sqrt(i_k2)
            zeta = strip.zeta[j]
            # both flanks have one sum of lengths of roll, so that their support functions add to one of the base radius
            # r_b1 + r_b2
            s = s0 + rb * (strip.alpha[j] + normal_turn(A, B, tilt))
            # g = a sin - 2 A zeta / w - h: its first and second derivative by alpha, with dA/dalpha = B and dB/dalpha =
            # -A
            g1 = a * ca - A * B * s * i_w * i_k - rb * i_k - 2.0 * B * zeta * i_w
            g2 = s * (A * A * i_w - B * B * w * i_k2) * i_k - a * sa + 2.0 * A * zeta * i_w
            step = -g1 / g2
            strip.alpha[j] += step
            strip.sin[j], strip.cos[j] = turned(sa, ca, step)
            strip.step[j] = step
            # d alpha / d zeta = -g_alphazeta / g_alphaalpha, g_alphazeta = -2 B / w
            strip.rate[j] = 2.0 * B * i_w / g2
        squared = steps_squared(strip, n)
        if squared < NEWTON_END * NEWTON_END:
            break
        if steps_over(strip, n, LARGEST_TURN) > 0.0:
            exact_turns(strip, n)
    strip.step[0] = strip.rate[0]


@kernel
def normal_turns(side, strip, n):
    """Fill by how much the normals seen from the wheels' own planes differ from alpha."""
    tilt = tilt_of(side)
    p, q = tilt.p, tilt.q
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        strip.turn[j] = normal_turn(p * sa + q * ca, p * ca - q * sa, tilt)


@kernel
def flank_sections(side, strip, n, want):
    """Fill gaps of flank on flank, with derivatives by the pose, of tooth 0 of wheel 1 and the tooth facing it."""
    tilt = tilt_of(side)
    p, q, i_w, i_w3 = tilt.p, tilt.q, tilt.i_w, tilt.i_w3
    a, rb1, rb2, rb = side.x[0], side.base_1, side.base_2, side.base_sum
    start_1, start_2 = side.start_1, side.start_2
    normal_turns(side, strip, n)
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap = np.sqrt(1.0 - B * B)
        turn = strip.alpha[j] + strip.turn[j]
        s1 = rb1 * (start_1 + turn)
        s2 = rb2 * (start_2 + turn)
        h = involute_slopes(A, B, kap, s1 + s2, rb, tilt)
        # A / w by A and B at w^2 = 1 - A^2 - B^2: kappa^2 / w^3 and A B / w^3
        gA = -h.A - 2.0 * zeta * kap * kap * i_w3
        gB = -h.B - 2.0 * zeta * A * B * i_w3
        strip.roll_1[j] = s1
        strip.roll_2[j] = s2
        strip.kind[j] = 0.0
        strip.gap[j] = a * sa - 2.0 * A * i_w * zeta - h.h
        strip.grad[0, j] = sa
        strip.grad[1, j] = 0.0
        strip.grad[2, j] = gA * sa + gB * ca
        strip.grad[3, j] = gA * ca - gB * sa
        # h = kappa s / w, and s turns with each wheel by its base radius
        strip.grad[4, j] = -kap * i_w * rb1
        strip.grad[5, j] = -kap * i_w * rb2
    if want == 0:
        return
    i_w5 = tilt.i_w5
    # of what a turn by r_b does each wheel does its share
    share_1, share_2 = rb1 / rb, rb2 / rb
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        A = p * sa + q * ca
        B = p * ca - q * sa
        kap = np.sqrt(1.0 - B * B)
        c = involute_curvatures(A, B, kap, strip.roll_1[j] + strip.roll_2[j], rb, tilt)
        put_curvatures(
            strip, j, sa, ca,
            GapCurvatures(
                2.0 * A * i_w * zeta - a * sa - c.alpha_alpha,
                -c.alpha_A - 2.0 * zeta * A * B * i_w3,
                -c.alpha_B - 2.0 * zeta * (i_w + B * B * i_w3),
                -c.alpha_F * share_1,
                -c.alpha_F * share_2,
                -c.AA - 6.0 * zeta * kap * kap * A * i_w5,
                -c.AB - 2.0 * zeta * (3.0 * kap * kap * B * i_w5 - 2.0 * B * i_w3),
                -c.BB - 2.0 * zeta * A * (i_w3 + 3.0 * B * B * i_w5),
                -c.AF * share_1,
                -c.BF * share_1,
                -c.AF * share_2,
                -c.BF * share_2,
                0.0,
                0.0,
            ),
        )  # fmt: skip


@inlined
def put_curvatures(strip, j, sa, ca, c):
    """Fill the gap's Hessian and d alpha / dx of section ``j`` by eliminating alpha from second derivatives."""
    # along stationary alpha g_xx - g_xalpha g_alphax / g_alphaalpha; e = d alpha / dx
    inverse = -1.0 / c.alpha_alpha
    d2 = c.alpha_A * sa + c.alpha_B * ca
    d3 = c.alpha_A * ca - c.alpha_B * sa
    d4, d5 = c.alpha_F1, c.alpha_F2
    e0, e2, e3, e4, e5 = ca * inverse, d2 * inverse, d3 * inverse, d4 * inverse, d5 * inverse
    strip.alpha_x[0, j] = e0
    strip.alpha_x[1, j] = 0.0
    strip.alpha_x[2, j] = e2
    strip.alpha_x[3, j] = e3
    strip.alpha_x[4, j] = e4
    strip.alpha_x[5, j] = e5
    hess = strip.hess
    hess[0, 0, j] = ca * e0
    hess[0, 2, j] = d2 * e0
    hess[0, 3, j] = d3 * e0
    hess[0, 4, j] = d4 * e0
    hess[0, 5, j] = d5 * e0
    # A and B turn with alpha: p and q are A sin + B cos and A cos - B sin
    hess[2, 2, j] = d2 * e2 + c.AA * sa * sa + 2.0 * c.AB * sa * ca + c.BB * ca * ca
    hess[2, 3, j] = d3 * e2 + (c.AA - c.BB) * sa * ca + c.AB * (ca * ca - sa * sa)
    hess[2, 4, j] = d4 * e2 + c.AF1 * sa + c.BF1 * ca
    hess[2, 5, j] = d5 * e2 + c.AF2 * sa + c.BF2 * ca
    hess[3, 3, j] = d3 * e3 + c.AA * ca * ca - 2.0 * c.AB * sa * ca + c.BB * sa * sa
    hess[3, 4, j] = d4 * e3 + c.AF1 * ca - c.BF1 * sa
    hess[3, 5, j] = d5 * e3 + c.AF2 * ca - c.BF2 * sa
    hess[4, 4, j] = d4 * e4 + c.FF1
    hess[4, 5, j] = d5 * e4
    hess[5, 5, j] = d5 * e5 + c.FF2
    hess[0, 1, j] = 0.0
    hess[1, 1, j] = 0.0
    hess[1, 2, j] = 0.0
    hess[1, 3, j] = 0.0
    hess[1, 4, j] = 0.0
    hess[1, 5, j] = 0.0


@kernel
def gap_rates(side, strip, n, want):
    """Fill rates of the gaps under the pose rates, and their derivatives by the pose."""
    xd = side.xd
    x0, x1, x2, x3, x4, x5 = xd[0], xd[1], xd[2], xd[3], xd[4], xd[5]
    grad = strip.grad
    for j in range(n):
        # g' = g_x . x', whose derivatives by x are g_xx x'
        strip.rate[j] = (
            grad[0, j] * x0 + grad[1, j] * x1 + grad[2, j] * x2 + grad[3, j] * x3 + grad[4, j] * x4 + grad[5, j] * x5
        )
    if want == 0:
        return
    h = strip.hess
    for j in range(n):
        h01, h02, h03, h04, h05 = h[0, 1, j], h[0, 2, j], h[0, 3, j], h[0, 4, j], h[0, 5, j]
        h12, h13, h14, h15 = h[1, 2, j], h[1, 3, j], h[1, 4, j], h[1, 5, j]
        h23, h24, h25, h34, h35, h45 = h[2, 3, j], h[2, 4, j], h[2, 5, j], h[3, 4, j], h[3, 5, j], h[4, 5, j]
        out = strip.rate_x
        out[0, j] = h[0, 0, j] * x0 + h01 * x1 + h02 * x2 + h03 * x3 + h04 * x4 + h05 * x5
        out[1, j] = h01 * x0 + h[1, 1, j] * x1 + h12 * x2 + h13 * x3 + h14 * x4 + h15 * x5
        out[2, j] = h02 * x0 + h12 * x1 + h[2, 2, j] * x2 + h23 * x3 + h24 * x4 + h25 * x5
        out[3, j] = h03 * x0 + h13 * x1 + h23 * x2 + h[3, 3, j] * x3 + h34 * x4 + h35 * x5
        out[4, j] = h04 * x0 + h14 * x1 + h24 * x2 + h34 * x3 + h[4, 4, j] * x4 + h45 * x5
        out[5, j] = h05 * x0 + h15 * x1 + h25 * x2 + h35 * x3 + h45 * x4 + h[5, 5, j] * x5
