"""What bears in the sections of one tooth pair: flanks, or the corner of either tooth; and its deviations."""

from __future__ import annotations

from gearmbs.contact import layout as L
from gearmbs.contact.corners import copy_corner, corner_gaps, set_corner
from gearmbs.contact.deviations import add_deviations, tip_roll
from gearmbs.contact.helical_sections import set_edges
from gearmbs.contact.jit import inlined, kernel
from gearmbs.contact.records import rows_of
from gearmbs.contact.sections import gap_rates

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
