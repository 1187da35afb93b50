"""One tooth pair after the other: how it touches in the sections of the face, and what forces that gives."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.corners import copy_corner, corner_gaps, set_corner, set_edges
from gearmbs.contact.deviations import add_deviations, pair_stiffness_factor, tip_roll, tooth_flank
from gearmbs.contact.loads import (
    add_friction,
    add_normal,
    add_stiffness_gradient,
    finish_stiffness_gradient,
    mirror,
    strip_forces,
    total_force,
)
from gearmbs.contact.places import contact_points, end_roll, helical_points, limit_slopes, limit_value, roll_difference
from gearmbs.contact.records import inlined, kernel, rows_of, strip_at
from gearmbs.contact.search import (
    face_pair,
    facing_teeth,
    flank_strips,
    middle_section,
    pair_reach,
    path_excess,
    reach_of_face,
    strip_in_reach,
    strips_between,
    teeth_in_reach,
)
from gearmbs.contact.sections import (
    gap_rates,
    helical_flanks,
    helical_normals,
    set_sections,
)
from gearmbs.contact.slices import centroid_force, law_of, plane_force

# What bears in the sections of one tooth pair: flanks, or the corner of either tooth; and its deviations.


PARTS = 4
"""Parts into which a slice is divided where a helical tip edge bears."""


@kernel
def strip_count(slices):
    """Return how many strips the scratch holds of either sort; `layout.strip_count`."""
    return max(1, -(-slices // (L.LANES - 1)))


@kernel
def copy_rows(source, target, n, want):
    """Copy sections, without derivatives of second order unless wanted."""
    a, b = rows_of(source), rows_of(target)
    for r in range(a.shape[0] if want != 0 else L.VALUE_ROWS):
        for j in range(n):
            b[r, j] = a[r, j]


@kernel
def pair_sections(options, wheels, scratch, flanks, own, n, low, high, want):
    """Choose and fill the sections of the tooth pair at work.

    Parameters
    ----------
    options, wheels, scratch : record
        Tables of the pair of wheels, and scratch.
    flanks : record
        Strip of flank-on-flank sections.
    own : record
        Strip that is filled if the pair differs from it.
    n : int
        Sections.
    low, high : int
        First and last section that counts.
    want : int
        Nonzero to fill derivatives.

    Returns
    -------
    bool
        Whether the pair's sections are in ``own``; else they are those in ``flanks``.
    """
    pair = scratch.pair
    teeth = options.flanks != 0
    corners_1, corners_2 = pair_kinds(options, wheels, scratch, flanks, n, low, high)
    pair.corner_bears = 1.0 if corners_1 > 0 else 0.0
    if corners_1 + corners_2 == 0 and not teeth:
        return False
    counting = high - low + 1
    whole = corners_1 == counting or corners_2 == counting
    if not whole:
        copy_rows(flanks, own, n, want)
    if corners_1 > 0:
        pair_corners(wheels, scratch, flanks, own, n, 1, corners_1 == counting, want)
    if corners_2 > 0:
        pair_corners(wheels, scratch, flanks, own, n, 2, corners_2 == counting, want)
    if teeth:
        for j in range(low, high + 1):
            add_deviations(options, wheels, scratch, own, j, want)
    gap_rates(scratch.side, own, n, want)
    return True


@kernel
def pair_kinds(options, wheels, scratch, flanks, n, low, high):
    """Find what bears in each section: ``loads.kind``, and the lengths of roll at the tips in the corners' records.

    Parameters
    ----------
    options, wheels, scratch, flanks, n, low, high
        As in `pair_sections`.

    Returns
    -------
    corners_1, corners_2 : int
        Sections in which a corner of wheel 1 or 2 bears.
    """
    pair, loads = scratch.pair, scratch.loads
    teeth = options.flanks != 0
    tip_1, tip_2, shift = wheels.wheel_1.tip_roll, wheels.wheel_2.tip_roll, pair.shift
    corners_1 = 0
    corners_2 = 0
    for j in range(n):
        loads.kind[j] = 0.0
    for j in range(low, high + 1):
        if teeth:
            zeta = flanks.zeta[j]
            tip_1 = tip_roll(options, wheels, wheels.wheel_1, 0, int(pair.flank_1), zeta)
            tip_2 = tip_roll(options, wheels, wheels.wheel_2, 1, int(pair.flank_2), zeta)
        over_1 = flanks.roll_1[j] + shift - tip_1
        over_2 = flanks.roll_2[j] - shift - tip_2
        if over_1 > over_2:
            if over_1 > 0.0:
                loads.kind[j] = 1.0
                scratch.corner_1.roll[j] = tip_1
                scratch.corner_1.mate_tip[j] = tip_2
                corners_1 += 1
        elif over_2 > 0.0:
            loads.kind[j] = 2.0
            scratch.corner_2.roll[j] = tip_2
            scratch.corner_2.mate_tip[j] = tip_1
            corners_2 += 1
    return corners_1, corners_2


@kernel
def pair_corners(wheels, scratch, flanks, own, n, kind, whole, want):
    """Fill the sections of the pair at work in which a corner of one wheel bears.

    Parameters
    ----------
    wheels, scratch, flanks : record
    own : record
        Out.
    n : int
        Sections.
    kind : int
        The wheel whose corner bears, 1 or 2.
    whole : bool
        Whether it bears in all sections that count; the others become repetitions of one that does.
    want : int
        Nonzero to fill derivatives.
    """
    pair, loads = scratch.pair, scratch.loads
    first, helical = kind == 1, scratch.side.twist_1 != 0.0
    corner = scratch.corner_1 if first else scratch.corner_2
    wheel = wheels.wheel_1 if first else wheels.wheel_2
    f, f_mate = (pair.f_1, pair.f_2) if first else (pair.f_2, pair.f_1)
    strip = own if whole else scratch.corners
    reference = -1
    for j in range(n):
        if loads.kind[j] != kind:
            continue
        roll = corner.roll[j]
        if reference >= 0 and roll == corner.roll[reference]:
            own_mate = corner.mate_tip[j]
            copy_corner(corner, reference, j)
            corner.mate_tip[j] = own_mate
        else:
            set_corner(wheel, corner, j, f, roll)
            reference = j
    for j in range(n):
        source = j if loads.kind[j] == kind else reference
        if source != j:
            copy_corner(corner, source, j)
        strip.zeta[j] = flanks.zeta[source]
    if helical:
        set_edges(scratch.side, corner, strip, n, first)
    corner_gaps(scratch.side, wheels, corner, strip, n, kind, f_mate, scratch.middle, scratch.lookup_1, want)
    if whole:
        return
    a, b = rows_of(strip), rows_of(own)
    mark = float(kind)
    for r in range(a.shape[0] if want != 0 else L.VALUE_ROWS):
        for j in range(n):
            b[r, j] = a[r, j] if loads.kind[j] == mark else b[r, j]


@inlined
def between(row, j):
    """Value of a row of the undivided slices at node ``j`` of the divided ones, on the straight line between nodes."""
    i = min(j // PARTS, L.LANES - 2)
    u = j / PARTS - i
    return (1.0 - u) * row[i] + u * row[i + 1]


@kernel
def bending(coarse, fine, n, start):
    """Return how much the straight lines between the nodes of undivided slices run below the gaps of divided ones.

    ``start`` is the number of the first node of ``fine``, counted from the first one of ``coarse``.
    """
    most = 0.0
    for j in range(n):
        most = max(most, fine.gap[j] - between(coarse.gap, min(start + j, PARTS * (L.LANES - 1))))
    return most


@kernel
def straighten(coarse, fine, strip, n, start, want):
    """Take from a strip of divided slices by how much their flanks' gap is bent between the undivided nodes.

    With this, dividing changes nothing where flanks bear on flanks, so that forces do not jump when it begins.

    Parameters
    ----------
    coarse, fine : record
        Flanks' gaps at the nodes of the undivided and of the divided slices.
    strip : record
        In, out; may be ``fine``.
    n : int
        Sections.
    start : int
        Number of the first node of ``fine``, counted from the first one of ``coarse``.
    want : int
        Nonzero to correct second derivatives, too.
    """
    for j in range(n):
        at = min(start + j, PARTS * (L.LANES - 1))
        strip.gap[j] += between(coarse.gap, at) - fine.gap[j]
        for k in range(6):
            strip.grad[k, j] += between(coarse.grad[k], at) - fine.grad[k, j]
            if want != 0:
                for i in range(k, 6):
                    strip.hess[k, i, j] += between(coarse.hess[k, i], at) - fine.hess[k, i, j]


# The contact of one tooth pair over its slices; those in which a helical tip edge bears are divided.


@kernel
def slice_contact(options, wheels, scratch, law, totals, want):
    """Integrate the pressure of the pair at work over its slices, strip by strip; returns its largest penetration."""
    depth = 0.0
    for k in range(strips_between(scratch.side.first, scratch.side.last)):
        node, low, high = pair_part(scratch, k)
        if high <= low:
            continue
        flanks, own = strip_at(scratch, k), strip_at(scratch, strip_count(options.slices) + k)
        if divides(options, wheels, scratch, flanks, int(low), int(high)):
            deepest = divided_contact(options, wheels, scratch, law, flanks, own, node, low, high, totals, want)
        else:
            chosen = pair_sections(options, wheels, scratch, flanks, own, L.LANES, int(low), int(high), want)
            strip = own if chosen else flanks
            deepest = strip_contact(options, wheels, scratch, law, strip, node, low, high, totals, want)
        depth = max(depth, deepest)
    return depth


@kernel
def strip_contact(options, wheels, scratch, law, strip, node, low, high, totals, want):
    """Add the contact of the pair at work over one strip; returns its largest penetration.

    Parameters
    ----------
    options, wheels, scratch : record
    law : Law
    strip : record
        The pair's sections.
    node, low, high : float
        The strip's first node, and the first and last of its nodes that count.
    totals : record
    want : int
        Nonzero to add derivatives.
    """
    depth = strip_forces(wheels, scratch, law, strip, node, low, high, 1.0, totals, want)
    if depth > 0.0:
        if options.compliances != 0:
            add_stiffness_gradient(scratch.sums, scratch.pair, strip, scratch.loads, L.LANES, want)
        add_loads(options, wheels, scratch, strip, L.LANES, totals, want)
    return depth


@kernel
def divides(options, wheels, scratch, flanks, low, high):
    """Whether the slices of a strip are divided: those of perfect helical teeth where a tip edge bears.

    Along a contact line that runs off the tip the gap grows as a parabola, through which the end of the line moves from
    slice to slice.
    """
    if scratch.side.twist_1 == 0.0 or options.flanks != 0:
        return False
    corners_1, corners_2 = pair_kinds(options, wheels, scratch, flanks, L.LANES, low, high)
    return corners_1 + corners_2 > 0


@kernel
def divided_contact(options, wheels, scratch, law, flanks, own, node, low, high, totals, want):
    """Add the contact of the pair at work over one strip, each of its slices divided.

    Parameters
    ----------
    options, wheels, scratch : record
    law : Law
    flanks, own : record
        As in `pair_sections`.
    node, low, high : float
        The strip's first node, and the first and last of its nodes that count.
    totals : record
    want : int
        Nonzero to add derivatives.

    Returns
    -------
    float
        Largest penetration.
    """
    side, pair, fine = scratch.side, scratch.pair, scratch.divided
    n, parts = L.LANES, float(PARTS)
    side.step /= parts
    side.slices *= parts
    pair.low *= parts
    pair.high *= parts
    depth = 0.0
    first, last = parts * (node + low), parts * (node + high)
    for k in range(strips_between(first, last)):
        start = first + k * (n - 1)
        count = min(last - start + 1.0, float(n))
        set_sections(fine, n, side, start, count, scratch.middle)
        helical_normals(side, fine, n)
        helical_flanks(side, fine, n, want)
        bent = 0.0
        if side.pitch_mismatch_bound != 0.0:
            bent = bending(flanks, fine, n, int(start - parts * node))
        if not strip_in_reach(wheels, side, pair, fine, start, int(count), bent):
            continue
        chosen = pair_sections(options, wheels, scratch, fine, own, n, 0, int(count) - 1, want)
        strip = own if chosen else fine
        if side.pitch_mismatch_bound != 0.0:
            straighten(flanks, fine, strip, n, int(start - parts * node), want)
        gap_rates(side, strip, n, want)
        depth = max(depth, strip_contact(options, wheels, scratch, law, strip, start, 0.0, count - 1.0, totals, want))
    side.step *= parts
    side.slices /= parts
    pair.low /= parts
    pair.high /= parts
    return depth


@kernel
def pair_part(scratch, k):
    """Return the first node of strip ``k`` and which of its nodes the pair at work may touch, from the first on."""
    side, pair = scratch.side, scratch.pair
    node = side.first + k * (L.LANES - 1)
    nodes = min(side.last - node + 1.0, float(L.LANES))
    return node, max(pair.first - node, 0.0), min(pair.last - node, nodes - 1.0)


@kernel
def add_loads(options, wheels, scratch, strip, n, totals, want):
    """Add the nodal forces of the pair at work in a strip, and their friction, to the sums."""
    side, pair, sums, loads = scratch.side, scratch.pair, scratch.sums, scratch.loads
    totals.normal_force += wheels.secant * total_force(loads, n)
    add_normal(sums, strip, loads, n, want)
    if options.friction == L.FRICTION_NONE:
        return
    f = pair.f_1 + wheels.wheel_1.half_angle
    if side.twist_1 != 0.0:
        helical_points(side, scratch.corner_1, strip, loads, n, f, pair.corner_bears != 0.0, want)
    else:
        contact_points(side, scratch.corner_1, strip, loads, n, f, pair.corner_bears != 0.0, want)
    add_friction(wheels, options.friction, side, sums, strip, loads, n, totals, want)


@kernel
def side_contacts(options, wheels, scratch, sign, totals, want):
    """Add every contact of one side of the teeth, seen so that wheel 1's counter-clockwise flanks press.

    Parameters
    ----------
    options, wheels, scratch : record
        Tables of the pair of wheels, and scratch.
    sign : int
        +1 or -1, for the tables that name teeth and flanks; ``scratch.side`` is open, its pose mirrored for -1.
    totals : record
        Diagnostics.
    want : int
        Nonzero to add derivatives.

    Returns
    -------
    bool
        Whether the sums were mirrored to match, which is done for -1 once something may touch.
    """
    side, middle = scratch.side, scratch.middle
    facing_teeth(options, wheels, side)
    single = options.slices == 1
    middle_section(options, wheels, side, middle, want if single else 0)
    wander = 0.0
    if single:
        depth = wheels.added_material - middle.gap[0] + side.pitch_mismatch_bound
        if depth <= 0.0:
            return False
        gap_rates(side, middle, 1, want)
    else:
        if not reach_of_face(options, wheels, side, middle):
            return False
        depth = wheels.added_material - flank_strips(scratch, options.slices, want) + side.pitch_mismatch_bound
        if depth <= 0.0:
            return False
        # the gap's slope along the face is 2 (p sin + q cos)/w and its second derivative by alpha the line of action's
        # length, so that the alpha of the least gap, and with it the contact on the profile, moves along the face
        turn = 2.0 * (side.x[L.Q] * middle.sin[0] - side.x[L.P] * middle.cos[0]) / (side.w * side.length)
        wander = max(side.base_1, abs(side.base_2)) * abs(turn) * (wheels.face_high - wheels.face_low)
    if sign < 0:
        mirror(scratch.sums, want)
    first, last = teeth_in_reach(wheels, side, depth, wander)
    # there are no more, whatever reach follows from a pose without meaning, as of a wheel that has flown away
    last = min(last, first + options.teeth[0] + options.teeth[1])
    for i in range(first, last + 1):
        set_pair(options, scratch, sign, i)
        if side.pitch_mismatch_bound != 0.0:
            own_flanks(options, wheels, scratch, want)
        if single:
            depth = plane_contact(options, wheels, scratch, totals, want)
        else:
            depth = face_contact(options, wheels, scratch, totals, want)
        if depth > 0.0:
            count_pair(options, sign, depth, totals)
    return sign < 0


@kernel
def own_flanks(options, wheels, scratch, want):
    """Fill the sections of flank on flank anew for the pair at work: tilted helical wheels differ in their pitches."""
    face_pair(wheels, scratch.side, scratch.pair)
    if options.slices == 1:
        middle_section(options, wheels, scratch.side, scratch.middle, want)
        gap_rates(scratch.side, scratch.middle, 1, want)
    else:
        flank_strips(scratch, options.slices, want)


@kernel
def count_pair(options, sign, depth, totals):
    """Note a touching tooth pair among the diagnostics."""
    if sign == options.drive:
        totals.depth_drive = max(totals.depth_drive, depth)
        totals.pairs_drive += 1.0
    else:
        totals.depth_coast = max(totals.depth_coast, depth)
        totals.pairs_coast += 1.0


@kernel
def set_pair(options, scratch, sign, i):
    """Make tooth ``i`` of wheel 1 and the one facing it the pair at work."""
    side, pair = scratch.side, scratch.pair
    mate = int(side.facing) - i
    pair.f_1 = side.x[L.F1] + i * (2.0 * np.pi / options.teeth[0])
    pair.f_2 = side.x[L.F2] + mate * side.turn_2
    pair.shift = side.base_1 * (pair.f_1 - side.x[L.F1])
    if options.flanks != 0:
        pair.flank_1 = tooth_flank(options, 0, sign, i)
        pair.flank_2 = tooth_flank(options, 1, sign, mate if side.base_2 > 0.0 else -mate)
    pair.stiffness_factor = 1.0
    for k in range(6):
        pair.stiffness_factor_x[k] = 0.0
        pair.moved[k] = 0.0


@kernel
def plane_contact(options, wheels, scratch, totals, want):
    """Add the contact of the pair at work, described by its section at mid-face; returns its penetration."""
    side, pair = scratch.side, scratch.pair
    middle, own, loads = scratch.middle, strip_at(scratch, 1), scratch.loads
    if middle.gap[0] + path_excess(wheels, side, middle, 0, pair.shift) >= wheels.added_material:
        return 0.0
    strip = own if pair_sections(options, wheels, scratch, middle, own, 1, 0, 0, want) else middle
    if strip.gap[0] >= 0.0:
        return 0.0
    varying = options.compliances != 0
    if varying:
        pair_stiffness_factor(options, wheels, side, pair, scratch.lookup_1)
    energy = totals.energy
    depth = plane_force(law_of(options, wheels, pair.stiffness_factor), wheels.width, strip, loads, totals, want)
    if varying:
        add_stiffness_gradient(scratch.sums, pair, strip, loads, 1, want)
        finish_stiffness_gradient(scratch.sums, pair, totals.energy - energy, want)
    add_loads(options, wheels, scratch, strip, 1, totals, want)
    return depth


@kernel
def face_contact(options, wheels, scratch, totals, want):
    """Add the contact of the pair at work over the face; returns its largest penetration."""
    side, pair = scratch.side, scratch.pair
    if not pair_reach(wheels, scratch, options.slices):
        return 0.0
    varying = options.compliances != 0
    if varying:
        pair_stiffness_factor(options, wheels, side, pair, scratch.lookup_1)
    set_limits(wheels, side, pair)
    law = law_of(options, wheels, pair.stiffness_factor)
    energy = totals.energy
    if options.load == L.LOAD_ADAMS:
        depth = centroid_contact(options, wheels, scratch, law, totals, want)
    else:
        depth = slice_contact(options, wheels, scratch, law, totals, want)
    if varying and depth > 0.0:
        finish_stiffness_gradient(scratch.sums, pair, totals.energy - energy, want)
    return depth


@kernel
def set_limits(wheels, side, pair):
    """Fill where the common face of the pair at work ends."""
    pair.roll = roll_difference(side, wheels, pair.f_1, pair.f_2)
    low, high = end_roll(side, wheels, -1.0, pair.roll), end_roll(side, wheels, 1.0, pair.roll)
    pair.low = (limit_value(side, wheels, -1.0, low) - wheels.face_low) / side.step
    pair.high = (limit_value(side, wheels, 1.0, high) - wheels.face_low) / side.step


@kernel
def centroid_contact(options, wheels, scratch, law, totals, want):
    """Add the force of the pair at work as ADAMS applies it; returns its largest penetration."""
    side, pair = scratch.side, scratch.pair
    own_strips = strip_count(options.slices)
    for k in range(strips_between(side.first, side.last)):
        _, low, high = pair_part(scratch, k)
        if high <= low:
            continue
        flanks, own = strip_at(scratch, k), strip_at(scratch, own_strips + k)
        if not pair_sections(options, wheels, scratch, flanks, own, L.LANES, int(low), int(high), want):
            copy_rows(flanks, own, L.LANES, want)
    if want != 0:
        low, high = end_roll(side, wheels, -1.0, pair.roll), end_roll(side, wheels, 1.0, pair.roll)
        limit_slopes(side, wheels, -1.0, low, scratch.low, 0)
        limit_slopes(side, wheels, 1.0, high, scratch.high, 0)
    k, depth = centroid_force(options, wheels, scratch, law, own_strips, totals, want)
    if depth > 0.0:
        # the corners at work are those of the last strip: find those of the strip that bears the force again
        _, low, high = pair_part(scratch, k)
        own = strip_at(scratch, own_strips + k)
        pair_sections(options, wheels, scratch, strip_at(scratch, k), own, L.LANES, int(low), int(high), want)
        if options.compliances != 0:
            add_stiffness_gradient(scratch.sums, pair, own, scratch.loads, L.LANES, want)
        add_loads(options, wheels, scratch, own, L.LANES, totals, want)
    return depth
