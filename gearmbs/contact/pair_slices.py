"""The contact of one tooth pair over its slices; those in which a helical tip edge bears are divided."""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.helical_friction import helical_points
from gearmbs.contact.helical_sections import helical_flanks, helical_normals
from gearmbs.contact.jit import kernel
from gearmbs.contact.loads import add_softness, strip_forces
from gearmbs.contact.pair_strips import PARTS, bending, pair_kinds, pair_sections, straighten, strip_count
from gearmbs.contact.points import contact_points
from gearmbs.contact.records import strip_at
from gearmbs.contact.search import strip_in_reach, strips_between
from gearmbs.contact.sections import gap_rates, set_sections
from gearmbs.contact.sums import add_friction, add_normal, total_force


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
            add_softness(scratch.sums, scratch.pair, strip, scratch.loads, L.LANES, want)
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
        As in `pair_strips.pair_sections`.
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
        if side.spread != 0.0:
            bent = bending(flanks, fine, n, int(start - parts * node))
        if not strip_in_reach(wheels, side, pair, fine, start, int(count), bent):
            continue
        chosen = pair_sections(options, wheels, scratch, fine, own, n, 0, int(count) - 1, want)
        strip = own if chosen else fine
        if side.spread != 0.0:
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
