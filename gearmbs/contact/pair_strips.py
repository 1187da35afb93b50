"""What bears in the sections of one tooth pair: flanks, or the corner of either tooth; and its deviations."""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.corners import copy_corner, corner_gaps, set_corner
from gearmbs.contact.deviations import add_deviations, tip_roll
from gearmbs.contact.helical_sections import set_edge
from gearmbs.contact.jit import kernel
from gearmbs.contact.records import rows_of
from gearmbs.contact.sections import gap_rates


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
                corners_1 += 1
        elif over_2 > 0.0:
            loads.kind[j] = 2.0
            scratch.corner_2.roll[j] = tip_2
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
        if reference >= 0 and roll == corner.roll[reference] and not helical:
            copy_corner(corner, reference, j)
        else:
            eta = set_corner(wheel, corner, j, f, roll)
            if helical:
                set_edge(scratch.side, corner, j, first, eta, flanks.zeta[j])
            reference = j
    for j in range(n):
        source = j if loads.kind[j] == kind else reference
        if source != j:
            copy_corner(corner, source, j)
        strip.zeta[j] = flanks.zeta[source]
    corner_gaps(scratch.side, wheels, corner, strip, n, kind, f_mate, scratch.middle, want)
    if whole:
        return
    a, b = rows_of(strip), rows_of(own)
    mark = float(kind)
    for r in range(a.shape[0] if want != 0 else L.VALUE_ROWS):
        for j in range(n):
            b[r, j] = a[r, j] if loads.kind[j] == mark else b[r, j]
