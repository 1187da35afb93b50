"""One tooth pair after the other: how it touches in the sections of the face, and what forces that gives."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.centroid import centroid_force
from gearmbs.contact.deviations import pair_softness, tooth_flank
from gearmbs.contact.face import end_roll, limit_slopes, limit_value, roll_difference
from gearmbs.contact.jit import kernel
from gearmbs.contact.loads import add_softness, finish_softness
from gearmbs.contact.pair_slices import add_loads, pair_part, slice_contact
from gearmbs.contact.pair_strips import copy_rows, pair_sections, strip_count
from gearmbs.contact.records import strip_at
from gearmbs.contact.search import (
    face_pair,
    facing_teeth,
    flank_strips,
    middle_section,
    pair_reach,
    path_excess,
    reach_of_face,
    strips_between,
    teeth_in_reach,
)
from gearmbs.contact.sections import gap_rates
from gearmbs.contact.slices import law_of, plane_force
from gearmbs.contact.sums import mirror


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
        depth = wheels.added_material - middle.gap[0] + side.spread
        if depth <= 0.0:
            return False
        gap_rates(side, middle, 1, want)
    else:
        if not reach_of_face(options, wheels, side, middle):
            return False
        depth = wheels.added_material - flank_strips(scratch, options.slices, want) + side.spread
        if depth <= 0.0:
            return False
        turn = 2.0 * (side.x[L.Q] * middle.sin[0] - side.x[L.P] * middle.cos[0]) / (side.w * side.length)
        wander = max(side.base_1, abs(side.base_2)) * abs(turn) * (wheels.face_high - wheels.face_low)
    if sign < 0:
        mirror(scratch.sums, want)
    first, last = teeth_in_reach(wheels, side, depth, wander)
    for i in range(first, last + 1):
        set_pair(options, scratch, sign, i)
        if side.spread != 0.0:
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
    pair.soft = 1.0
    for k in range(6):
        pair.soft_x[k] = 0.0
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
        pair_softness(options, wheels, side, pair, scratch.lookup_1)
    energy = totals.energy
    depth = plane_force(law_of(options, wheels, pair.soft), wheels.width, strip, loads, totals, want)
    if varying:
        add_softness(scratch.sums, pair, strip, loads, 1, want)
        finish_softness(scratch.sums, pair, totals.energy - energy, want)
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
        pair_softness(options, wheels, side, pair, scratch.lookup_1)
    set_limits(wheels, side, pair)
    law = law_of(options, wheels, pair.soft)
    energy = totals.energy
    if options.load == L.LOAD_ADAMS:
        depth = centroid_contact(options, wheels, scratch, law, totals, want)
    else:
        depth = slice_contact(options, wheels, scratch, law, totals, want)
    if varying and depth > 0.0:
        finish_softness(scratch.sums, pair, totals.energy - energy, want)
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
        limit_slopes(side, wheels, -1.0, low, scratch.low, scratch.end_1, scratch.end_2, 0)
        limit_slopes(side, wheels, 1.0, high, scratch.high, scratch.end_1, scratch.end_2, 0)
    k, depth = centroid_force(options, wheels, scratch, law, own_strips, totals, want)
    if depth > 0.0:
        # the corners at work are those of the last strip: find those of the strip that bears the force again
        _, low, high = pair_part(scratch, k)
        own = strip_at(scratch, own_strips + k)
        pair_sections(options, wheels, scratch, strip_at(scratch, k), own, L.LANES, int(low), int(high), want)
        if options.compliances != 0:
            add_softness(scratch.sums, pair, own, scratch.loads, L.LANES, want)
        add_loads(options, wheels, scratch, own, L.LANES, totals, want)
    return depth
