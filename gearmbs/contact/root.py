"""Tips in the mate's root: tip corners on the root arcs and the root circle, tip land on the root circle.

Only used when the tip clearance is small. These contacts push, and damp, but carry no friction.

Of the parts only the circle is damped, as flanks are: what replaces it or is taken away depends on the pose alone, so
that no rates make the sum pull.

A tip meets the root circle with its land while that crosses the line of centres, else with its nearer corner. Where a
corner stands over a root arc, the arc's force replaces that of the circle beneath it and that of the flank's extension
behind it: both are taken away again. Arc and circle agree at one end of the arc, arc and flank at the other, so forces
do not jump.

Radii and angles of an internal wheel are negative, see `layout.WHEEL`: its root circle is hollow, its root arcs are
where its flanks go out to it, and the same sums hold.

"""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.corners import (
    clear_slopes,
    copy_corner,
    corner_on_plane,
    line_gap,
    line_offset,
    set_corner,
)
from gearmbs.contact.loads import add_normal, strip_forces, total_force
from gearmbs.contact.pair import count_pair, set_limits, strip_count
from gearmbs.contact.records import kernel, strip_at
from gearmbs.contact.search import facing_teeth
from gearmbs.contact.sections import gap_rates
from gearmbs.contact.slices import elastic_law, law_of, plane_force

FAR = 1.0  # a gap, m, for parts that do not face each other
ON_CIRCLE, ON_ARC, ON_FLANK, UNDER_ARC = range(4)
NEIGHBOURS = 2  # tips on either side of the line of centres that are looked at


@kernel
def over_arc(side, corner, mate, f_root, zeta):
    """Whether the corner at work stands over the root arc of its mate's tooth in a section."""
    r = corner.radius[0]
    psi = mate.fillet_angle
    sc, cc = np.sin(f_root + psi), np.cos(f_root + psi)
    rc = mate.fillet_centre_radius
    # from the centre of the arc to the corner: on which side of the arc's two ends it is
    dx, dy = line_offset(side, -r * corner.cos[0] - rc * cc, -r * corner.sin[0] - rc * sc, zeta)
    if dx * sc - dy * cc < 0.0:
        return False
    # where the arc begins at the flank, tangent to it
    end = f_root + psi - np.arcsin(mate.fillet_radius / rc)
    return dx * np.cos(end) + dy * np.sin(end) < 0.0


@kernel
def root_gap(side, own, mate, corner, part, tip, f_tip, f_root, strip, j, want):
    """Gap of one part of a tip's contact with the mate's root in section ``j``; far where the part is not in play.

    Parameters
    ----------
    side : record
    own, mate : record
        Tables of the wheel whose tip it is, and of the other.
    corner : record
        The tip's corner, in its first lane.
    part : int
        `ON_CIRCLE` or one of those after it.
    tip : int
        1 for a tip of wheel 1, 0 for one of wheel 2.
    f_tip, f_root : float
        Angles of the tip's tooth and of the mate's tooth beside the root, from the line of centres.
    strip : record
    j : int
        Section.
    want : int
        Nonzero to fill second derivatives.
    """
    zeta, r = strip.zeta[j], corner.radius[0]
    se, ce = corner.sin[0], corner.cos[0]
    strip.gap[j] = FAR
    clear_slopes(strip, j)
    if part == ON_CIRCLE:
        inside = np.copysign(1.0, side.x[L.A])  # -1: one wheel is within the other
        dx, dy = line_offset(side, 0.0, 0.0, zeta)
        # the line of centres within the tip land: the land bears, else its nearer edge
        off = f_tip - np.arctan2(inside * dy, inside * dx)
        psi = abs(own.corner_angle)
        if abs(off) <= psi:
            still = (0.0, 0.0)
            offset = inside * (own.tip_radius + mate.root_radius)
            line_gap(side, strip, j, tip, still, still, still, inside, offset, want)
            return
        nearer = f_tip - psi if off > 0.0 else f_tip + psi
        se, ce = np.sin(nearer), np.cos(nearer)
    elif not over_arc(side, corner, mate, f_root, zeta):
        return
    if part == ON_ARC:
        eta = f_root + mate.fillet_angle
        # hollow: the gap grows as the distance from the arc's centre falls
        rs, rc = mate.fillet_centre_radius * np.sin(eta), mate.fillet_centre_radius * np.cos(eta)
        v, t, c = (-r * ce - rc, -r * se - rs), (r * se, -r * ce), (rs, -rc)
        line_gap(side, strip, j, tip, v, t, c, -1.0, mate.fillet_radius - corner.rounding[0], want)
    elif part == ON_FLANK:
        rf, rc = mate.fillet_radius, mate.fillet_centre_radius
        end = f_root + mate.fillet_angle - np.arcsin(rf / rc)
        at = np.copysign(np.sqrt(rc * rc - rf * rf), rc)
        corner_on_plane(side, corner, strip, j, tip == 1, end, at, 0.0, want)
    else:
        hollow = np.copysign(1.0, mate.root_radius)
        v, t, offset = (-r * ce, -r * se), (r * se, -r * ce), hollow * (mate.root_radius + corner.rounding[0])
        line_gap(side, strip, j, tip, v, t, (0.0, 0.0), hollow, offset, want)


@kernel
def root_sections(options, wheels, scratch, part, tip, f_tip, f_root, want):
    """Fill the sections of one part of a tip's contact with the mate's root; returns whether any gap is negative.

    Parameters
    ----------
    options, wheels, scratch : record
        Tables of the pair of wheels, and scratch.
    part, tip : int
    f_tip, f_root : float
        As in `root_gap`.
    want : int
        Nonzero to fill derivatives.
    """
    side = scratch.side
    own = wheels.wheel_1 if tip == 1 else wheels.wheel_2
    mate = wheels.wheel_2 if tip == 1 else wheels.wheel_1
    corner = scratch.corner_1 if tip == 1 else scratch.corner_2
    slices = options.slices
    count = strip_count(slices)
    touching = False
    for k in range(count):
        strip = strip_at(scratch, count + k)
        node = k * (L.LANES - 1)
        n = 1 if slices == 1 else L.LANES
        for j in range(n):
            strip.zeta[j] = 0.0 if slices == 1 else wheels.face_low + min(node + j, slices) * side.step
            strip.kind[j] = 0.0
            root_gap(side, own, mate, corner, part, tip, f_tip, f_root, strip, j, want)
            touching = touching or strip.gap[j] < 0.0
            for i in range(6):
                strip.alpha_x[i, j] = 0.0
        gap_rates(side, strip, n, want)
    return touching


@kernel
def root_part(options, wheels, scratch, part, tip, f_tip, f_root, totals, want):
    """Add one part of a tip's contact with the mate's root, or take it away; returns its largest penetration.

    Parameters
    ----------
    options, wheels, scratch, part, tip, f_tip, f_root
        As in `root_sections`.
    totals : record
        Diagnostics.
    want : int
        Nonzero to add derivatives.
    """
    side = scratch.side
    if not root_sections(options, wheels, scratch, part, tip, f_tip, f_root, want):
        return 0.0
    slices, loads, sums, pair = options.slices, scratch.loads, scratch.sums, scratch.pair
    # over an arc its force stands for those of the circle below and of the flank's extension, which are subtracted
    share = -1.0 if part == ON_FLANK or part == UNDER_ARC else 1.0
    law = law_of(options, wheels, 1.0)
    if part != ON_CIRCLE:
        law = elastic_law(law)
    depth = 0.0
    if slices == 1:
        strip = strip_at(scratch, 1)
        depth = plane_force(law, share * wheels.width, strip, loads, totals, want)
        totals.normal_force += loads.force[0]
        add_normal(sums, strip, loads, 1, want)
        return depth if share > 0.0 else 0.0
    pair.f_1 = f_tip if tip == 1 else f_root
    pair.f_2 = f_root if tip == 1 else f_tip
    pair.stiffness_factor = 1.0
    for i in range(6):
        pair.stiffness_factor_x[i] = 0.0
    set_limits(wheels, side, pair)
    count = strip_count(slices)
    for k in range(count):
        strip = strip_at(scratch, count + k)
        node = k * (L.LANES - 1)
        high = float(min(slices - node, L.LANES - 1))
        deepest = strip_forces(wheels, scratch, law, strip, float(node), 0.0, high, share, totals, want)
        if deepest > 0.0:
            depth = max(depth, deepest)
            totals.normal_force += total_force(loads, L.LANES)
            add_normal(sums, strip, loads, L.LANES, want)
    return depth if share > 0.0 else 0.0


@kernel
def root_contacts(options, wheels, scratch, sign, totals, want):
    """Add the contacts of all tips near the line of centres with the mate's root, on one side of the teeth."""
    side = scratch.side
    facing_teeth(options, wheels, side)
    side.step = (wheels.face_high - wheels.face_low) / options.slices
    side.slices = float(options.slices)
    for tip in range(2):
        own = wheels.wheel_1 if tip == 1 else wheels.wheel_2
        corner = scratch.corner_1 if tip == 1 else scratch.corner_2
        place_tip, place_root = (L.F1, L.F2) if tip == 1 else (L.F2, L.F1)
        turn_1 = 2.0 * np.pi / options.teeth[0]
        pitch_tip, pitch_root = (turn_1, side.turn_2) if tip == 1 else (side.turn_2, turn_1)
        # the tip next to the line of centres
        middle = -np.floor(side.x[place_tip] / pitch_tip + 0.5)
        for k in range(-NEIGHBOURS, NEIGHBOURS + 1):
            f_tip = side.x[place_tip] + (middle + k) * pitch_tip
            f_root = side.x[place_root] + (side.facing - middle - k) * pitch_root
            set_corner(own, corner, 0, f_tip, own.tip_roll)
            for j in range(1, L.LANES):
                copy_corner(corner, 0, j)
            depth = 0.0
            # the circle knows no sides and counts on that of the drive
            for part in range(ON_CIRCLE if sign == options.drive else ON_ARC, UNDER_ARC + 1):
                depth = max(depth, root_part(options, wheels, scratch, part, tip, f_tip, f_root, totals, want))
            if depth > 0.0:
                count_pair(options, sign, depth, totals)
