"""Tip corners at work: those of one tooth pair in the sections of a strip, and their gaps to the mate's flank.

What a gap is stands in `gearmbs.contact.gaps.definitions`; loops as in `sections`.
"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.deviations import roll_under_corner
from gearmbs.contact.gaps import derived as D
from gearmbs.contact.places import level, level_corner
from gearmbs.contact.records import inlined, kernel
from gearmbs.contact.sections import (
    LARGEST_TURN,
    NEAR_BASE,
    NEWTON_END,
    NEWTON_STEPS,
    helical_turn,
    helix_square,
    normal_turn,
    normal_turns,
    steps_over,
    steps_squared,
    tilt_of,
    turn_normal,
    turned,
    unmark_unsettled,
)

EDGE_STEPS = 6  # of Newton's method for the place of a tip edge in a section
EDGE_END = 1e-9  # rad; a further step would turn the edge by about the square of it

# Distance of two lines, each parallel to one wheel's axis: tip corners against arcs and planes of the mate.


PLANE = 1.0  # radius, m, of the cylinder that stands for a plane


@kernel
def line_offset(side, vx, vy, zeta):
    """Offset in the section of two lines whose places in their wheels' own planes differ by ``v``; see below."""
    p, q = side.x[L.P], side.x[L.Q]
    # a plane across one wheel's axis leans against the section by (p, q): places in it are stretched along the tilt,
    # and both axes part by 2 zeta (p, q) / w
    along = (p * vx + q * vy) * side.m - 2.0 * zeta * side.i_w
    return side.x[L.A] + vx + p * along, vy + q * along


@kernel
def line_gap(side, strip, k, tip, v, t, c, sign, offset, want):
    """Fill section ``k`` with ``sign (distance - offset)`` of a tip line and a root line, measured in space.

    Parameters
    ----------
    side, strip : record
    k : int
        Section.
    tip : int
        1 where the tip line is wheel 1's, else 0.
    v, t, c : tuple of float
        Difference of the two lines' places in their wheels' own planes; its derivatives by the angle of the tip's wheel
        and by that of the root's.
    sign, offset : float
    want : int
        Nonzero to fill second derivatives.
    """
    a, p, q, i_w, m, m_w, m_ww = side.x[L.A], side.x[L.P], side.x[L.Q], side.i_w, side.m, side.m_w, side.m_ww
    zeta, own = strip.zeta[k], 2.0 * tip - 1.0
    (vx, vy), (tx, ty), (cx, cy) = v, t, c
    strip.gap[k] = D.line_gap(
        a, p, q, zeta, vx, vy, tx, ty, cx, cy, i_w, m, m_w, m_ww, sign, offset, own, strip.grad, k
    )
    if want != 0:
        D.line_bend(a, p, q, zeta, vx, vy, tx, ty, cx, cy, i_w, m, m_w, m_ww, sign, offset, own, strip.hess, k)


@kernel
def clear_slopes(strip, k):
    """Set the gap's derivatives in section ``k`` to nothing."""
    for i in range(6):
        strip.grad[i, k] = 0.0
        for j in range(i, 6):
            strip.hess[i, j, k] = 0.0


@kernel
def corner_on_plane(side, corner, strip, k, first, eta, at, away, want):
    """Gap of the corner at work to a plane along the axis of its mate, in section ``k``.

    Parameters
    ----------
    side, corner, strip : record
    k : int
        Section.
    first : bool
        Whether the corner is wheel 1's.
    eta : float
        Angle of the plane from the line of centres.
    at, away : float
        The plane stands ``away`` from the axis, towards the free side; a wide cylinder that touches it at the radius
        ``at`` takes its place.
    want : int
        Nonzero to fill second derivatives.
    """
    r, se, ce = corner.radius[k], corner.sin[k], corner.cos[k]
    sb, cb = np.sin(eta), np.cos(eta)
    # the axis of the cylinder that touches the plane at the radius ``at``
    x = at * cb + (PLANE - away) * sb
    y = at * sb - (PLANE - away) * cb
    v, t, c = (-r * ce - x, -r * se - y), (r * se, -r * ce), (y, -x)
    line_gap(side, strip, k, 1 if first else 0, v, t, c, 1.0, PLANE + corner.rounding[k], want)


# Gaps of tip corners on the mate's involute in the sections of a strip; loops as in `sections`.


@kernel
def corner_starts(side, corner, strip, n, rb, normal):
    """Start the normals where tip corners stand over the mate's involute, axes taken as parallel.

    Marks in ``strip.good`` the corners outside the mate's base circle (radius ``rb``) and off it.
    """
    a, p, q, m, i_w = side.x[0], side.x[2], side.x[3], side.m, side.i_w
    alpha, s0, c0 = normal.alpha[0], normal.sin[0], normal.cos[0]
    # the involute of a base circle begins with no radius of curvature: corners close to it are on its tangent plane
    near = NEAR_BASE * NEAR_BASE * rb * rb
    for j in range(n):
        r = corner.radius[j]
        vx, vy = -r * corner.cos[j], -r * corner.sin[j]
        along = (p * vx + q * vy) * m - 2.0 * strip.zeta[j] * i_w
        X = a + vx + p * along
        Y = vy + q * along
        lean = p * X + q * Y
        # from the mate's axis the tangent to the base circle is sqrt(R^2 - r_b^2) long, the length of roll; its normal
        # is the foot's
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
def corner_normals(side, corner, strip, n, start, rb):
    """Turn the normals onto those where the corners at work bear on the mate's involute, by Newton's method.

    ``start`` is the mate's ``phi + psi``. Unmarks sections whose iteration does not settle.
    """
    tilt, gentle, a = tilt_of(side), side.gentle, side.x[L.A]
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca = strip.sin[j], strip.cos[j]
            s = rb * (start + strip.alpha[j] + normal_turn(sa, ca, tilt, gentle))
            g1, g2, _ = D.corner_normal(a, strip.zeta[j], sa, ca, s, rb, *corner_of(corner, j), 1.0, *tilt)
            turn_normal(strip, j, min(max(-g1 / g2, -LARGEST_TURN), LARGEST_TURN))
        if steps_squared(strip, n) < NEWTON_END * NEWTON_END:
            return
    unmark_unsettled(strip, n)


@inlined
def corner_of(corner, j):
    """Return the corner at work in a section: sine and cosine of its polar angle, radius, rounding."""
    return corner.sin[j], corner.cos[j], corner.radius[j], corner.rounding[j]


@inlined
def put_rolls(corner, strip, j, kind, foot):
    """Fill what bears in a section, and the lengths of roll of the corner and of its foot on the mate."""
    strip.roll_1[j] = corner.roll[j] if kind == 1 else foot
    strip.roll_2[j] = foot if kind == 1 else corner.roll[j]
    strip.kind[j] = float(kind)


@kernel
def corner_sections(side, corner, strip, n, kind, start, want):
    """Fill gaps of tip corners on the mate's flank, with derivatives by the pose.

    Parameters
    ----------
    side, corner, strip : record
    n : int
        Sections.
    kind : int
        The wheel whose corner bears, 1 or 2.
    start : float
        Angle of the mate's tooth from the line of centres, and its half angle at the base circle.
    want : int
        Nonzero to fill second derivatives.
    """
    tilt, a = tilt_of(side), side.x[L.A]
    rb, own = (side.base_2, 1.0) if kind == 1 else (side.base_1, -1.0)
    normal_turns(side, strip, n)
    for j in range(n):
        s = rb * (start + strip.alpha[j] + strip.turn[j])
        se, ce, r, rt = corner_of(corner, j)
        put_rolls(corner, strip, j, kind, s)
        strip.gap[j] = D.corner_gap(
            a, strip.zeta[j], strip.sin[j], strip.cos[j], s, rb, se, ce, r, rt, own, strip.grad, j, *tilt
        )
    if want == 0:
        return
    for j in range(n):
        s = rb * (start + strip.alpha[j] + strip.turn[j])
        se, ce, r, rt = corner_of(corner, j)
        D.corner_bend(
            a, strip.zeta[j], strip.sin[j], strip.cos[j], s, rb, se, ce, r, rt, own, strip.alpha_x, strip.hess, j, *tilt
        )


# Tip edges of helical wheels.


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
    p, q, w, i_w = side.x[L.P], side.x[L.Q], side.w, side.i_w
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
def edge_normals(side, corner, strip, n, kind, start, rb):
    """Turn the normals onto those where the tip edges at work bear on the mate's helicoid; as `corner_normals`.

    They start from those of parallel axes.
    """
    if side.pitch_mismatch_bound == 0.0:
        return
    tilt, a, h, c = tilt_of(side), side.x[L.A], side.x[L.H], helix_square(side)
    t, k, own = edge_numbers(side, kind)
    for _ in range(NEWTON_STEPS):
        for j in range(n):
            sa, ca = strip.sin[j], strip.cos[j]
            s = rb * (start + strip.alpha[j] + helical_turn(sa, ca, t, tilt))
            g1, g2, _ = D.edge_normal(
                a, strip.zeta[j], h, sa, ca, t, c, s, rb, *corner_of(corner, j), k, own, *tilt
            )  # fmt: skip
            turn_normal(strip, j, min(max(-g1 / g2, -LARGEST_TURN), LARGEST_TURN))
        if steps_squared(strip, n) < NEWTON_END * NEWTON_END:
            return
    unmark_unsettled(strip, n)


@inlined
def edge_numbers(side, kind):
    """Return the helix of the mate, by how much the edge turns per length of its wheel, and 1 or -1 for the wheel."""
    if kind == 1:
        return side.twist_2, side.twist_1 / side.base_1, 1.0
    return side.twist_1, side.twist_2 / side.base_2, -1.0


@kernel
def edge_sections(side, corner, strip, n, kind, start, want):
    """Fill gaps of helical tip edges on the mate's flank, with derivatives by the pose; as `corner_sections`."""
    tilt, a, h, c = tilt_of(side), side.x[L.A], side.x[L.H], helix_square(side)
    rb = side.base_2 if kind == 1 else side.base_1
    t, k, own = edge_numbers(side, kind)
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        s = rb * (start + strip.alpha[j] + helical_turn(sa, ca, t, tilt))
        se, ce, r, rt = corner_of(corner, j)
        strip.gap[j], foot = D.edge_gap(
            a, strip.zeta[j], h, sa, ca, t, c, s, rb, se, ce, r, rt, k, own, strip.grad, j, *tilt
        )
        put_rolls(corner, strip, j, kind, foot)
    if want == 0:
        return
    for j in range(n):
        sa, ca = strip.sin[j], strip.cos[j]
        s = rb * (start + strip.alpha[j] + helical_turn(sa, ca, t, tilt))
        se, ce, r, rt = corner_of(corner, j)
        D.edge_bend(
            a, strip.zeta[j], h, sa, ca, t, c, s, rb, se, ce, r, rt, k, own, strip.alpha_x, strip.hess, j, *tilt
        )


@kernel
def set_corner(wheel, corner, j, f, roll):
    """Make a tip corner the one at work in section ``j``: at the wheel's own tip, or sharp at a shorter ``roll``."""
    if roll >= wheel.tip_roll:
        psi = wheel.corner_angle
        corner.radius[j] = wheel.corner_radius
        corner.rounding[j] = wheel.tip_rounding
        corner.roll[j] = wheel.tip_roll
    else:
        rb = wheel.base_radius
        tan = roll / rb
        # half the tooth's angle at the radius whose pressure angle has this tangent: psi_b - inv(alpha)
        psi = wheel.half_angle - tan + np.arctan(tan)
        corner.radius[j] = np.copysign(np.sqrt(rb * rb + roll * roll), rb)
        corner.rounding[j] = 0.0
        corner.roll[j] = roll
    corner.sin[j] = np.sin(f + psi)
    corner.cos[j] = np.cos(f + psi)


@kernel
def copy_corner(corner, source, target):
    """Repeat the corner at work in one section in another."""
    corner.radius[target] = corner.radius[source]
    corner.rounding[target] = corner.rounding[source]
    corner.roll[target] = corner.roll[source]
    corner.sin[target] = corner.sin[source]
    corner.cos[target] = corner.cos[source]
    corner.mate_tip[target] = corner.mate_tip[source]


@kernel
def corner_gaps(side, wheels, corner, strip, n, kind, f_mate, normal, lookup, want):
    """Fill the gaps of the corners at work on the mate's flank.

    Close to its base circle and inside it the mate's flank goes on as its tangent plane. Behind its tip it falls away.

    Parameters
    ----------
    side, wheels, corner : record
        ``wheels`` is the pair's table.
    strip : record
        Out; its sections are placed.
    n : int
        Sections.
    kind : int
        The wheel whose corner bears, 1 or 2.
    f_mate : float
        Angle of the mate's tooth from the line of centres.
    normal : record
        Strip whose first section has a solved normal.
    lookup : record
        Scratch for a place on the mate's profile.
    want : int
        Nonzero to fill second derivatives.
    """
    rb = side.base_2 if kind == 1 else side.base_1
    start = f_mate + (wheels.wheel_2.half_angle if kind == 1 else wheels.wheel_1.half_angle)
    if level(side, strip, n, want) and level_corner(side, corner, strip, kind, start):
        fall_behind_tip(side, wheels, corner, strip, n, kind, lookup, want)
        return
    corner_starts(side, corner, strip, n, rb, normal)
    if side.twist_1 != 0.0:
        edge_normals(side, corner, strip, n, kind, start, rb)
        edge_sections(side, corner, strip, n, kind, start, want)
    else:
        corner_normals(side, corner, strip, n, start, rb)
        corner_sections(side, corner, strip, n, kind, start, want)
    mended = False
    for j in range(n):
        if strip.good[j] == 0.0:
            mended = True
            corner_near_base(side, corner, strip, j, kind, start, rb, want)
    if mended:
        normal_turns(side, strip, n)
    fall_behind_tip(side, wheels, corner, strip, n, kind, lookup, want)


@kernel
def fall_behind_tip(side, wheels, corner, strip, n, kind, lookup, want):
    """Add to the gaps of the corners at work what the mate's flank falls away behind its tip.

    A corner whose foot is at the length of roll s on the mate, beyond its tip at s_t, has no involute beneath it: the
    flank goes on as a rounded edge of radius R, ``(s - s_t)^2 / (2 R)`` below the endless involute. Gap and slope are
    continuous, and so is the force of a corner that leaves under load.

    Parameters
    ----------
    side, wheels, corner, strip, n, kind, lookup, want
        As in `corner_gaps`.
    """
    mate = wheels.wheel_2 if kind == 1 else wheels.wheel_1
    for j in range(n):
        foot = strip.roll_2[j] if kind == 1 else strip.roll_1[j]
        if foot + 0.5 * strip.gap[j] <= corner.mate_tip[j]:
            continue
        roll_under_corner(side, corner, strip, j, lookup, kind % 2, want)
        over = max(lookup.roll - corner.mate_tip[j], 0.0)
        inverse = 1.0 / (wheels.edge + corner.rounding[j] + mate.tip_rounding)
        strip.gap[j] += 0.5 * over * over * inverse
        for i in range(6):
            strip.grad[i, j] += over * inverse * lookup.grad[i]
            if want != 0 and over > 0.0:
                for k in range(i, 6):
                    bend = lookup.grad[i] * lookup.grad[k] + over * lookup.hess[i, k]
                    strip.hess[i, k, j] += bend * inverse


@kernel
def corner_near_base(side, corner, strip, j, kind, start, rb, want):
    """Gap of a corner on the plane that continues the mate's involute towards its base circle, in section ``j``.

    Parameters
    ----------
    side, corner, strip : record
    j : int
        Section.
    kind : int
        The wheel whose corner bears, 1 or 2.
    start, rb : float
        Angle of the mate's involute where it begins, from the line of centres, and its base radius.
    want : int
        Nonzero to fill second derivatives.
    """
    half = (0.5 if kind == 1 else -0.5) * side.x[L.H]
    twist = side.twist_2 if kind == 1 else side.twist_1
    turned = start - NEAR_BASE - twist * (strip.zeta[j] - half) / rb
    corner_on_plane(side, corner, strip, j, kind == 1, turned, rb, NEAR_BASE * rb, want)
    strip.kind[j] = float(kind)
    strip.alpha[j] = -turned
    strip.sin[j] = -np.sin(turned)
    strip.cos[j] = np.cos(turned)
    strip.roll_1[j] = corner.roll[j] if kind == 1 else 0.0
    strip.roll_2[j] = corner.roll[j] if kind == 2 else 0.0
    for i in range(6):
        strip.alpha_x[i, j] = 0.0
    strip.alpha_x[L.F2 if kind == 1 else L.F1, j] = -1.0
