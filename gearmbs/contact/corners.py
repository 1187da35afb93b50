"""Tip corners at work: those of one tooth pair in the sections of a strip, and their gaps to the mate's flank."""

from __future__ import annotations

import numpy as np

from gearmbs.contact import layout as L
from gearmbs.contact.corner_sections import corner_normals, corner_sections, corner_starts
from gearmbs.contact.deviations import roll_under_corner
from gearmbs.contact.helical_sections import edge_normals, edge_sections
from gearmbs.contact.jit import kernel
from gearmbs.contact.level import level, level_corner
from gearmbs.contact.lines import corner_on_plane
from gearmbs.contact.sections import NEAR_BASE, normal_turns


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
