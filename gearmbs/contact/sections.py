"""The gap of two flanks in the sections of a strip: solve for the normal, then value, gradient and Hessian.

What a gap is stands in `gearmbs.contact.gaps.definitions`. Each function here runs over the sections of a strip side
by side. Its loops have no branches that depend on the section, so that the compiler turns them into vector
instructions: what differs between sections is chosen, not jumped over. Numbers that all sections share are copied out
of their records before a loop.

Of helical wheels, wheel 1's middle stands half the axial offset before the origin of zeta, wheel 2's half behind it.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.gaps import derived as D
from gearmbs.contact.records import inlined, kernel, summing

NEWTON_STEPS = 20
NEWTON_END = 1e-6  # a further step would change alpha by about the square of it
LARGEST_TURN = 0.1  # rad, for the series of sine and cosine
NEAR_BASE = 0.003
"""Length of roll over base radius below which an involute is too curved to bear on, and goes on as a plane: the two are
a sixth of its cube of the base radius apart, 5e-10 m at 0.1 m."""
GENTLE = 0.02
"""Turns of the normal below this are taken from a series."""


@inlined
def tilt_of(side):
    """Return the tilt, and what follows from it alone, so that loops need not load it again."""
    return side.x[L.P], side.x[L.Q], side.w, side.i_w, side.i_1w, side.m, side.m_w, side.m_ww


@inlined
def normal_turn(sa, ca, tilt, gentle):
    """Turn of the normal seen from the wheel's own plane: the angle E added to alpha."""
    p, q, w = tilt[0], tilt[1], tilt[2]
    A = p * sa + q * ca
    arg = A * (p * ca - q * sa) / (w * (1.0 + w) + A * A)
    if gentle != 0.0:
        s = arg * arg
        return arg * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s / 9.0))))
    return np.arctan(arg)


@inlined
def helical_turns(sa, ca, t, tilt):
    """Turns of the normal seen from the planes of a helical wheel and its mate, E -+ arcsin(t B / kappa).

    By series that are exact to rounding for axes up to `search.STEEPEST_HELICAL`.
    """
    B = tilt[0] * ca - tilt[1] * sa
    turn = normal_turn(sa, ca, tilt, 1.0)
    x = t * B / np.sqrt(1.0 - B * B)
    v = x * x
    high = 35.0 / 1152.0 + v * (63.0 / 2816.0 + v * (231.0 / 13312.0 + v * (143.0 / 10240.0 + v * 6435.0 / 557056.0)))
    lean = x * (1.0 + v * (1.0 / 6.0 + v * (3.0 / 40.0 + v * (5.0 / 112.0 + v * high))))
    return turn - lean, turn + lean


@inlined
def helical_turn(sa, ca, t, tilt):
    """Turn of the normal seen from the helical wheel's own plane."""
    turn, _ = helical_turns(sa, ca, t, tilt)
    return turn


@inlined
def turned(sa, ca, step):
    """Sine and cosine of an angle turned by a small step."""
    # Taylor's series of cosine and sine, to rounding up to `LARGEST_TURN`
    d2 = step * step
    c = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0 - d2 / 40320.0)))
    s = step * (1.0 - d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0 - d2 * (1.0 / 5040.0 - d2 / 362880.0))))
    return sa * c + ca * s, ca * c - sa * s


@inlined
def turn_normal(strip, j, step):
    """Turn the normal of a section by a step of Newton's method."""
    strip.alpha[j] += step
    strip.sin[j], strip.cos[j] = turned(strip.sin[j], strip.cos[j], step)
    strip.step[j] = step


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
    tilt, gentle, a, s0 = tilt_of(side), side.gentle, side.x[L.A], side.roll_sum
    rb1, rb2 = side.base_1, side.base_2
    for j in range(n):
        strip.good[j] = 1.0
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca = strip.sin[j], strip.cos[j]
            # both flanks have one sum of lengths of roll, so that their support functions add to one of the base radius
            # r_b1 + r_b2
            s = s0 + (rb1 + rb2) * (strip.alpha[j] + normal_turn(sa, ca, tilt, gentle))
            g1, g2, across = D.flanks_normal(a, strip.zeta[j], sa, ca, s, rb1, rb2, *tilt)
            turn_normal(strip, j, -g1 / g2)
            # d alpha / d zeta = -g_alphazeta / g_alphaalpha
            strip.rate[j] = -across / g2
        if settled(strip, n):
            break
    strip.step[0] = strip.rate[0]


@kernel
def settled(strip, n):
    """Whether a step of Newton's method was the last one; takes sines and cosines anew where it was large."""
    if steps_squared(strip, n) < NEWTON_END * NEWTON_END:
        return True
    if steps_over(strip, n, LARGEST_TURN) > 0.0:
        exact_turns(strip, n)
    return False


@kernel
def normal_turns(side, strip, n):
    """Fill by how much the normals seen from the wheels' own planes differ from alpha."""
    tilt, gentle = tilt_of(side), side.gentle
    for j in range(n):
        strip.turn[j] = normal_turn(strip.sin[j], strip.cos[j], tilt, gentle)


@kernel
def flank_sections(side, strip, n, want):
    """Fill gaps of flank on flank, with derivatives by the pose, of tooth 0 of wheel 1 and the tooth facing it."""
    tilt, a, rb1, rb2 = tilt_of(side), side.x[L.A], side.base_1, side.base_2
    start_1, start_2 = side.start_1, side.start_2
    normal_turns(side, strip, n)
    for j in range(n):
        turn = strip.alpha[j] + strip.turn[j]
        strip.roll_1[j] = s1 = rb1 * (start_1 + turn)
        strip.roll_2[j] = s2 = rb2 * (start_2 + turn)
        strip.kind[j] = 0.0
        strip.gap[j] = D.flanks_gap(
            a, strip.zeta[j], strip.sin[j], strip.cos[j], s1 + s2, rb1, rb2, strip.grad, j, *tilt
        )
    if want == 0:
        return
    for j in range(n):
        s = strip.roll_1[j] + strip.roll_2[j]
        D.flanks_bend(a, strip.zeta[j], strip.sin[j], strip.cos[j], s, rb1, rb2, strip.alpha_x, strip.hess, j, *tilt)


@kernel
def helical_normals(side, strip, n):
    """Turn the normals of a strip onto the common normals of two helicoids; as `flank_normals`.

    Those of parallel axes are known.
    """
    tilt, a, h, t, c = tilt_of(side), side.x[L.A], side.x[L.H], side.twist_1, helix_square(side)
    rb1, rb2, start_1, start_2 = side.base_1, side.base_2, side.start_1, side.start_2
    for j in range(n):
        strip.good[j] = 1.0
    if side.pitch_mismatch_bound == 0.0:
        strip.step[0] = 0.0
        return
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca = strip.sin[j], strip.cos[j]
            turn_1, turn_2 = helical_turns(sa, ca, t, tilt)
            s1, s2 = rb1 * (start_1 + strip.alpha[j] + turn_1), rb2 * (start_2 + strip.alpha[j] + turn_2)
            g1, g2, across = D.helicoids_normal(a, strip.zeta[j], h, sa, ca, t, c, s1, s2, rb1, rb2, *tilt)
            turn_normal(strip, j, -g1 / g2)
            strip.rate[j] = -across / g2
        if settled(strip, n):
            break
    strip.step[0] = strip.rate[0]


@inlined
def helix_square(side):
    """Return 1 + t^2 of the base helix."""
    return 1.0 + side.twist_1 * side.twist_1


@kernel
def helical_flanks(side, strip, n, want):
    """Fill gaps of helicoid on helicoid, with derivatives by the pose; as `flank_sections`."""
    tilt, a, h, t, c = tilt_of(side), side.x[L.A], side.x[L.H], side.twist_1, helix_square(side)
    rb1, rb2, start_1, start_2 = side.base_1, side.base_2, side.start_1, side.start_2
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        turn_1, turn_2 = helical_turns(sa, ca, t, tilt)
        s1, s2 = rb1 * (start_1 + strip.alpha[j] + turn_1), rb2 * (start_2 + strip.alpha[j] + turn_2)
        strip.kind[j] = 0.0
        strip.gap[j], strip.roll_1[j], strip.roll_2[j] = D.helicoids_gap(
            a, strip.zeta[j], h, sa, ca, t, c, s1, s2, rb1, rb2, strip.grad, j, *tilt
        )
    if want == 0:
        return
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        turn_1, turn_2 = helical_turns(sa, ca, t, tilt)
        s1, s2 = rb1 * (start_1 + strip.alpha[j] + turn_1), rb2 * (start_2 + strip.alpha[j] + turn_2)
        D.helicoids_bend(
            a, strip.zeta[j], h, sa, ca, t, c, s1, s2, rb1, rb2, strip.alpha_x, strip.hess, j, *tilt
        )  # fmt: skip


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
