"""Tip corners at work: those of one tooth pair in the sections of a strip, and their gaps to the mate's flank."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.deviations import roll_under_corner
from gearmbs.contact.helical_sections import edge_normals, edge_sections
from gearmbs.contact.places import level, level_corner
from gearmbs.contact.records import kernel
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
from gearmbs.contact.support.profiles import (
    corner_curvatures,
    corner_slopes,
    involute_curvatures,
    involute_slopes,
    normal_turn,
    tilt_of,
)

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
def line_distance(side, vx, vy, tx, ty, cx, cy, zeta):
    """Fill the offset in the section of a tip line from a root line, with derivatives by (a, p, q, tip, root angle).

    Second derivatives by the angles are ``-v_t`` and ``-v_c`` where ``v = v_t - v_c``; they follow from ``t`` and
    ``c`` turned by a right angle.

    Parameters
    ----------
    side : record
        Out: its ``lines``.
    vx, vy : float
        Difference of the two lines' places in their wheels' own planes.
    tx, ty, cx, cy : float
        Its derivatives by the tip wheel's and the root wheel's angle.
    zeta : float
        Place of the section along the mean axis.
    """
    a, p, q = side.x[L.A], side.x[L.P], side.x[L.Q]
    iw, iw3, iw5 = side.i_w, side.i_w3, side.i_w5
    m, mw, mww = side.m, side.m_w, side.m_ww
    d, d_x, d_xx = side.lines.d, side.lines.d_x, side.lines.d_xx
    # d = (a, 0) + v + (p, q) s, s = (p v_x + q v_y) m - 2 zeta / w
    kap = p * vx + q * vy
    for axis in range(2):
        u = p if axis == 0 else q
        v = vx if axis == 0 else vy
        d[axis] = (a if axis == 0 else 0.0) + v + u * (kap * m - 2.0 * zeta * iw)
    for i in range(5):
        # w = sqrt(1 - p^2 - q^2): w_p = -p / w, so that m_p = -m_w p / w and (1 / w)_p = p / w^3
        mi = -mw * iw * (p if i == 1 else (q if i == 2 else 0.0))
        wi = iw3 * (p if i == 1 else (q if i == 2 else 0.0))
        vix = tx if i == 3 else (cx if i == 4 else 0.0)
        viy = ty if i == 3 else (cy if i == 4 else 0.0)
        ki = p * vix + q * viy + (vx if i == 1 else (vy if i == 2 else 0.0))
        si = mi * kap + m * ki - 2.0 * zeta * wi
        for axis in range(2):
            u = p if axis == 0 else q
            ei = 1.0 if i == axis + 1 else 0.0
            first = (1.0 if i == 0 and axis == 0 else 0.0) + (vix if axis == 0 else viy)
            d_x[i, axis] = first + u * si + ei * (kap * m - 2.0 * zeta * iw)
        for j in range(5):
            mj = -mw * iw * (p if j == 1 else (q if j == 2 else 0.0))
            wj = iw3 * (p if j == 1 else (q if j == 2 else 0.0))
            vjx = tx if j == 3 else (cx if j == 4 else 0.0)
            vjy = ty if j == 3 else (cy if j == 4 else 0.0)
            kj = p * vjx + q * vjy + (vx if j == 1 else (vy if j == 2 else 0.0))
            sj = mj * kap + m * kj - 2.0 * zeta * wj
            # second derivatives of m and 1 / w: both only by p and q
            pij = (p if i == 1 else q) * (p if j == 1 else q) if 1 <= i <= 2 and 1 <= j <= 2 else 0.0
            same = 1.0 if i == j and 1 <= i <= 2 else 0.0
            mij = mww * pij * iw * iw - mw * (same * iw + pij * iw3)
            wij = same * iw3 + 3.0 * pij * iw5
            # a place on a circle turned by its angle: the second derivative is the first, turned by a right angle
            vijx = -viy if i == j and i >= 3 else 0.0
            vijy = vix if i == j and i >= 3 else 0.0
            kij = p * vijx + q * vijy
            if i == 1:
                kij += vjx
            elif i == 2:
                kij += vjy
            if j == 1:
                kij += vix
            elif j == 2:
                kij += viy
            sij = mij * kap + mi * kj + mj * ki + m * kij - 2.0 * zeta * wij
            for axis in range(2):
                u = p if axis == 0 else q
                ei = 1.0 if i == axis + 1 else 0.0
                ej = 1.0 if j == axis + 1 else 0.0
                d_xx[i, j, axis] = u * sij + ei * sj + ej * si + (vijx if axis == 0 else vijy)


@kernel
def distance_gap(side, strip, k, tip, sign, offset, want):
    """Fill section ``k`` with ``sign (distance - offset)`` of the two lines of `line_distance`, measured in space."""
    p, q = side.x[L.P], side.x[L.Q]
    d, d_x, d_xx = side.lines.d, side.lines.d_x, side.lines.d_xx
    dx, dy = d[0], d[1]
    # of an offset d in the section the part along the axes, p d_x + q d_y, is no distance of parallel lines
    lean = p * dx + q * dy
    dist = np.sqrt(dx * dx + dy * dy - lean * lean)
    strip.gap[k] = sign * (dist - offset)
    clear_slopes(strip, k)
    for i in range(5):
        xi = pose_place(i, tip)
        dix, diy = d_x[i, 0], d_x[i, 1]
        li = p * dix + q * diy + (dx if i == 1 else (dy if i == 2 else 0.0))
        gi_ = (dx * dix + dy * diy - lean * li) / dist
        strip.grad[xi, k] = sign * gi_
        if want == 0:
            continue
        for j in range(5):
            xj = pose_place(j, tip)
            if xj < xi:
                continue
            djx, djy = d_x[j, 0], d_x[j, 1]
            lj = p * djx + q * djy + (dx if j == 1 else (dy if j == 2 else 0.0))
            gj = (dx * djx + dy * djy - lean * lj) / dist
            dijx, dijy = d_xx[i, j, 0], d_xx[i, j, 1]
            lij = p * dijx + q * dijy
            if i == 1:
                lij += djx
            elif i == 2:
                lij += djy
            if j == 1:
                lij += dix
            elif j == 2:
                lij += diy
            # D^2 = d.d - l^2: D_ij = (d_i.d_j + d.d_ij - l_i l_j - l l_ij - D_i D_j) / D
            value = dix * djx + diy * djy + dx * dijx + dy * dijy - li * lj - lean * lij - gi_ * gj
            strip.hess[xi, xj, k] = sign * value / dist


@kernel
def clear_slopes(strip, k):
    """Set the gap's derivatives in section ``k`` to nothing."""
    for i in range(6):
        strip.grad[i, k] = 0.0
        for j in range(i, 6):
            strip.hess[i, j, k] = 0.0


@kernel
def pose_place(i, tip):
    """Place in the pose numbers of derivative ``i``: a, p, q, angle of the tip wheel, angle of the root wheel."""
    if i == 0:
        return 0
    if i < 3:
        return i + 1
    return 5 - tip if i == 3 else 4 + tip


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
    line_distance(side, -r * ce - x, -r * se - y, r * se, -r * ce, y, -x, strip.zeta[k])
    distance_gap(side, strip, k, 1 if first else 0, 1.0, PLANE + corner.rounding[k], want)


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
            # V: the corner's place along the tilt, in its wheel's own plane; see the table of support functions
            V = A * sn + B * cs
            # first and second derivative of g = a sin - 2 A zeta / w - h_corner - h_flank by alpha, whose zero is the
            # normal
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
        # by the envelope theorem the gradient is that at a fixed alpha
        gA = -h.A - g.A - 2.0 * zeta * kap * kap * i_w3
        gB = -h.B - g.B - 2.0 * zeta * A * B * i_w3
        strip.roll_1[j] = corner.roll[j] if first else s
        strip.roll_2[j] = s if first else corner.roll[j]
        strip.kind[j] = float(kind)
        strip.gap[j] = a * sa - 2.0 * A * i_w * zeta - (h.h + g.h)
        strip.grad[0, j] = sa
        strip.grad[1, j] = 0.0
        # A = p sin + q cos, B = p cos - q sin
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
                # g by alpha twice, by alpha and A, B and the two spins, and then without alpha; alpha goes by g_xx -
                # g_xalpha g_alphax / g_alphaalpha
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
        edge_normals(side, corner, strip, n, kind == 1, rb * start, rb)
        edge_sections(side, corner, strip, n, kind, start, want)
    else:
        corner_normals(side, corner, strip, n, rb * start, rb)
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
