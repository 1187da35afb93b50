"""The gap of two helical flanks, and of a tip edge on a flank, in the sections of a strip; loops as in `sections`.

Wheel 1's middle stands half the axial offset before the origin of zeta, wheel 2's half behind it.

"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.records import inlined, kernel
from gearmbs.contact.sections import (
    LARGEST_TURN,
    NEWTON_END,
    NEWTON_STEPS,
    exact_turns,
    steps_over,
    steps_squared,
    turned,
    unmark_unsettled,
)
from gearmbs.contact.support.profiles import (
    HelicalCurvatures,
    HelicalSlopes,
    edge_curvatures,
    edge_of,
    edge_slopes,
    helical_turn,
    helical_turns,
    helicoid_curvatures,
    helicoid_normal,
    helicoid_roll,
    helicoid_slopes,
    mate_of,
    screw_of,
    tilt_of,
)

EDGE_STEPS = 6  # of Newton's method for the place of a tip edge in a section
EDGE_END = 1e-9  # rad; a further step would turn the edge by about the square of it


@kernel
def helical_normals(side, strip, n):
    """Turn the normals of a strip onto the common normals of two helicoids; as `sections.flank_normals`.

    Those of parallel axes are known.
    """
    tilt = tilt_of(side)
    a, half = side.x[L.A], 0.5 * side.x[L.H]
    rb1, rb2, t1 = side.base_1, side.base_2, side.twist_1
    s1_0, s2_0 = rb1 * side.start_1, rb2 * side.start_2
    for j in range(n):
        strip.good[j] = 1.0
    if side.pitch_mismatch_bound == 0.0:
        strip.step[0] = 0.0
        return
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
            one = screw_of(sa, ca, t1, tilt)
            two = mate_of(one, t1, tilt.w)
            turn_1, turn_2 = helical_turns(one.A, one.B, one.kap2, t1, tilt)
            s1 = s1_0 + rb1 * (strip.alpha[j] + turn_1)
            s2 = s2_0 + rb2 * (strip.alpha[j] + turn_2)
            first_1, second_1 = helicoid_normal(one, s1, zeta + half, rb1)
            first_2, second_2 = helicoid_normal(two, s2, zeta - half, rb2)
            g1 = a * ca - first_1 - first_2
            g2 = -a * sa - second_1 - second_2
            step = -g1 / g2
            strip.alpha[j] += step
            strip.sin[j], strip.cos[j] = turned(sa, ca, step)
            strip.step[j] = step
            strip.rate[j] = one.c * one.R * one.inverse * (one.U + two.U) / g2
        squared = steps_squared(strip, n)
        if squared < NEWTON_END * NEWTON_END:
            break
        if steps_over(strip, n, LARGEST_TURN) > 0.0:
            exact_turns(strip, n)
    strip.step[0] = strip.rate[0]


@kernel
def helical_flanks(side, strip, n, want):
    """Fill gaps of helicoid on helicoid, with derivatives by the pose; as `sections.flank_sections`."""
    tilt = tilt_of(side)
    a, half = side.x[L.A], 0.5 * side.x[L.H]
    rb1, rb2, t1 = side.base_1, side.base_2, side.twist_1
    start_1, start_2 = side.start_1, side.start_2
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        one = screw_of(sa, ca, t1, tilt)
        two = mate_of(one, t1, tilt.w)
        turn_1, turn_2 = helical_turns(one.A, one.B, one.kap2, t1, tilt)
        s1 = rb1 * (start_1 + strip.alpha[j] + turn_1)
        s2 = rb2 * (start_2 + strip.alpha[j] + turn_2)
        h1 = helicoid_slopes(one, s1, zeta + half, rb1, t1, sa, ca, tilt)
        h2 = helicoid_slopes(two, s2, zeta - half, rb2, -t1, sa, ca, tilt)
        strip.roll_1[j] = helicoid_roll(one, s1, zeta + half, rb1, t1, tilt.w)
        strip.roll_2[j] = helicoid_roll(two, s2, zeta - half, rb2, -t1, tilt.w)
        strip.kind[j] = 0.0
        put_slopes(strip, j, a, sa, h1, h2)
    if want == 0:
        return
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        one = screw_of(sa, ca, t1, tilt)
        two = mate_of(one, t1, tilt.w)
        turn_1, turn_2 = helical_turns(one.A, one.B, one.kap2, t1, tilt)
        s1 = rb1 * (start_1 + strip.alpha[j] + turn_1)
        s2 = rb2 * (start_2 + strip.alpha[j] + turn_2)
        c1 = helicoid_curvatures(one, s1, zeta + half, rb1, t1, sa, ca, tilt)
        c2 = helicoid_curvatures(two, s2, zeta - half, rb2, -t1, sa, ca, tilt)
        put_helical_curvatures(strip, j, a, sa, ca, c1, c2)


@kernel
def set_edges(side, corner, strip, n, first):
    """Turn tip corners at a wheel's middle, in ``corner``, to where their helical edges pass the sections of a strip.

    Parameters
    ----------
    side : record
    corner : record
        In: sine and cosine of the polar angle at the wheel's middle; out: in the sections.
    strip : record
        Its sections are placed; ``strip.step`` and ``strip.turn`` are used on the way.
    n : int
        Sections.
    first : bool
        Whether the edges are wheel 1's.
    """
    tilt = tilt_of(side)
    p, q, w, i_w = tilt.p, tilt.q, tilt.w, tilt.i_w
    half = (0.5 if first else -0.5) * side.x[L.H]
    k = side.twist_1 / side.base_1 if first else side.twist_2 / side.base_2
    turn_edges(corner, strip, n, -k * i_w, half)
    for j in range(n):
        strip.good[j] = 1.0
    for _ in range(EDGE_STEPS):
        for j in range(n):
            se, ce, r = corner.sin[j], corner.cos[j], corner.radius[j]
            behind = w * strip.turn[j] + k * (strip.zeta[j] + half + r * (p * ce + q * se))
            step = -behind / (w + k * r * (q * ce - p * se))
            strip.turn[j] += step
            corner.sin[j], corner.cos[j] = turned(se, ce, step)
            strip.step[j] = step
        if steps_squared(strip, n) < EDGE_END * EDGE_END:
            return


@kernel
def turn_edges(corner, strip, n, per, half):
    """Turn the corners by ``per`` times the place of their section from the wheel's middle; fills ``strip.turn``."""
    start = strip.zeta[0]
    turn = per * (start + half)
    sin, cos = np.sin(turn), np.cos(turn)
    for j in range(n):
        strip.turn[j] = per * (strip.zeta[j] + half)
        strip.step[j] = per * (strip.zeta[j] - start)
    if steps_over(strip, n, LARGEST_TURN) > 0.0:
        for j in range(n):
            st, ct, se, ce = np.sin(strip.turn[j]), np.cos(strip.turn[j]), corner.sin[j], corner.cos[j]
            corner.sin[j], corner.cos[j] = se * ct + ce * st, ce * ct - se * st
        return
    for j in range(n):
        se, ce = corner.sin[j], corner.cos[j]
        corner.sin[j], corner.cos[j] = turned(se * cos + ce * sin, ce * cos - se * sin, strip.step[j])


@kernel
def edge_normals(side, corner, strip, n, first, s0, rb):
    """Turn the normals onto those where the tip edges at work bear on the mate's helicoid; as `corner_normals`.

    They start from those of parallel axes.

    Parameters
    ----------
    side, corner, strip : record
    n : int
        Sections.
    first : bool
        Whether the edges are wheel 1's.
    s0, rb : float
        The mate's ``rb (phi + psi)``, and its base radius.
    """
    if side.pitch_mismatch_bound == 0.0:
        return
    tilt = tilt_of(side)
    i_w, m = tilt.i_w, tilt.m
    a, half = side.x[L.A], (0.5 if first else -0.5) * side.x[L.H]
    t = side.twist_2 if first else side.twist_1
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
            se, ce, r, rt = corner.sin[j], corner.cos[j], corner.radius[j], corner.rounding[j]
            screw = screw_of(sa, ca, t, tilt)
            A, B = screw.A, screw.B
            kap = np.sqrt(screw.kap2)
            i_k = 1.0 / kap
            s = s0 + rb * (strip.alpha[j] + helical_turn(A, B, screw.kap2, t, tilt))
            by, by_2 = helicoid_normal(screw, s, zeta - half, rb)
            sn, cs = sa * ce + ca * se, ca * ce - sa * se
            V, Z = A * sn + B * cs, zeta + half
            g1 = a * ca - by - r * (cs + m * B * V) - rt * A * B * i_w * i_k - B * Z * i_w
            bent = rt * (B * B * tilt.w * tilt.w - A * A * screw.kap2) * i_w * i_k * i_k * i_k
            g2 = -a * sa - by_2 + r * (sn + m * A * V) - bent + A * Z * i_w
            step = min(max(-g1 / g2, -LARGEST_TURN), LARGEST_TURN)
            strip.alpha[j] += step
            strip.sin[j], strip.cos[j] = turned(sa, ca, step)
            strip.step[j] = step
        if steps_squared(strip, n) < NEWTON_END * NEWTON_END:
            return
    unmark_unsettled(strip, n)


@kernel
def edge_sections(side, corner, strip, n, kind, start, want):
    """Fill gaps of helical tip edges on the mate's flank, with derivatives by the pose; as `corner_sections`.

    Parameters
    ----------
    side, corner, strip : record
    n : int
        Sections.
    kind : int
        The wheel whose edge bears, 1 or 2.
    start : float
        Angle of the mate's tooth from the line of centres, and its half angle at the base circle.
    want : int
        Nonzero to fill second derivatives.
    """
    tilt = tilt_of(side)
    first = kind == 1
    a, half = side.x[L.A], (0.5 if first else -0.5) * side.x[L.H]
    rb, t = (side.base_2, side.twist_2) if first else (side.base_1, side.twist_1)
    k = side.twist_1 / side.base_1 if first else side.twist_2 / side.base_2
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        ce, se, r, rt = corner.cos[j], corner.sin[j], corner.radius[j], corner.rounding[j]
        screw = screw_of(sa, ca, t, tilt)
        s = rb * (start + strip.alpha[j] + helical_turn(screw.A, screw.B, screw.kap2, t, tilt))
        sn, cs = sa * ce + ca * se, ca * ce - sa * se
        edge = edge_of(ce, se, r, k, zeta + half, tilt)
        c = edge_slopes(screw, edge, sn, cs, r, rt, zeta + half, sa, ca, tilt)
        h = helicoid_slopes(screw, s, zeta - half, rb, t, sa, ca, tilt)
        roll = helicoid_roll(screw, s, zeta - half, rb, t, tilt.w)
        strip.roll_1[j] = corner.roll[j] if first else roll
        strip.roll_2[j] = roll if first else corner.roll[j]
        strip.kind[j] = float(kind)
        put_slopes(strip, j, a, sa, chosen_slopes(first, c, h), chosen_slopes(first, h, c))
    if want == 0:
        return
    for j in range(n):
        sa, ca, zeta = strip.sin[j], strip.cos[j], strip.zeta[j]
        ce, se, r, rt = corner.cos[j], corner.sin[j], corner.radius[j], corner.rounding[j]
        screw = screw_of(sa, ca, t, tilt)
        s = rb * (start + strip.alpha[j] + helical_turn(screw.A, screw.B, screw.kap2, t, tilt))
        sn, cs = sa * ce + ca * se, ca * ce - sa * se
        edge = edge_of(ce, se, r, k, zeta + half, tilt)
        c = edge_curvatures(screw, edge, sn, cs, ce, se, r, rt, k, zeta + half, sa, ca, tilt)
        h = helicoid_curvatures(screw, s, zeta - half, rb, t, sa, ca, tilt)
        put_helical_curvatures(strip, j, a, sa, ca, chosen_curvatures(first, c, h), chosen_curvatures(first, h, c))


@inlined
def chosen_slopes(first, one, two):
    """Return the slopes of the edge or of the flank, whichever is wheel 1's."""
    return HelicalSlopes(
        one.h if first else two.h,
        one.alpha if first else two.alpha,
        one.p if first else two.p,
        one.q if first else two.q,
        one.F if first else two.F,
        one.Z if first else two.Z,
    )


@inlined
def chosen_curvatures(first, one, two):
    """Return the curvatures of the edge or of the flank, whichever is wheel 1's."""
    return HelicalCurvatures(
        one.alpha_alpha if first else two.alpha_alpha,
        one.alpha_p if first else two.alpha_p,
        one.alpha_q if first else two.alpha_q,
        one.alpha_F if first else two.alpha_F,
        one.alpha_Z if first else two.alpha_Z,
        one.pp if first else two.pp,
        one.pq if first else two.pq,
        one.qq if first else two.qq,
        one.pF if first else two.pF,
        one.qF if first else two.qF,
        one.pZ if first else two.pZ,
        one.qZ if first else two.qZ,
        one.FF if first else two.FF,
        one.FZ if first else two.FZ,
        one.ZZ if first else two.ZZ,
    )


@inlined
def put_slopes(strip, j, a, sa, one, two):
    """Fill the gap and its gradient in section ``j`` from the support functions of both wheels."""
    strip.gap[j] = a * sa - one.h - two.h
    strip.grad[0, j] = sa
    strip.grad[1, j] = 0.5 * (two.Z - one.Z)
    strip.grad[2, j] = -one.p - two.p
    strip.grad[3, j] = -one.q - two.q
    strip.grad[4, j] = -one.F
    strip.grad[5, j] = -two.F


@inlined
def put_helical_curvatures(strip, j, a, sa, ca, one, two):
    """Fill the gap's Hessian and d alpha / dx of section ``j`` by eliminating alpha from second derivatives.

    Parameters
    ----------
    strip : record
    j : int
        Section.
    a, sa, ca : float
        Centre distance, sine and cosine of alpha.
    one, two : HelicalCurvatures
        Of the support functions of the wheels.
    """
    inverse = 1.0 / (a * sa + one.alpha_alpha + two.alpha_alpha)
    d1 = 0.5 * (two.alpha_Z - one.alpha_Z)
    d2 = -one.alpha_p - two.alpha_p
    d3 = -one.alpha_q - two.alpha_q
    d4, d5 = -one.alpha_F, -two.alpha_F
    e0, e1, e2, e3, e4, e5 = ca * inverse, d1 * inverse, d2 * inverse, d3 * inverse, d4 * inverse, d5 * inverse
    x = strip.alpha_x
    x[0, j], x[1, j], x[2, j], x[3, j], x[4, j], x[5, j] = e0, e1, e2, e3, e4, e5
    hess = strip.hess
    hess[0, 0, j] = ca * e0
    hess[0, 1, j] = d1 * e0
    hess[0, 2, j] = d2 * e0
    hess[0, 3, j] = d3 * e0
    hess[0, 4, j] = d4 * e0
    hess[0, 5, j] = d5 * e0
    hess[1, 1, j] = d1 * e1 - 0.25 * (one.ZZ + two.ZZ)
    hess[1, 2, j] = d2 * e1 + 0.5 * (two.pZ - one.pZ)
    hess[1, 3, j] = d3 * e1 + 0.5 * (two.qZ - one.qZ)
    hess[1, 4, j] = d4 * e1 - 0.5 * one.FZ
    hess[1, 5, j] = d5 * e1 + 0.5 * two.FZ
    hess[2, 2, j] = d2 * e2 - one.pp - two.pp
    hess[2, 3, j] = d3 * e2 - one.pq - two.pq
    hess[2, 4, j] = d4 * e2 - one.pF
    hess[2, 5, j] = d5 * e2 - two.pF
    hess[3, 3, j] = d3 * e3 - one.qq - two.qq
    hess[3, 4, j] = d4 * e3 - one.qF
    hess[3, 5, j] = d5 * e3 - two.qF
    hess[4, 4, j] = d4 * e4 - one.FF
    hess[4, 5, j] = d5 * e4
    hess[5, 5, j] = d5 * e5 - two.FF
