"""How far tip corners bear beyond the path of contact, and how close they pass the mate's tip: parallel axes.

Signs as in `gearmbs.contact.layout.WHEEL`: radii, lengths of roll and centre distance of an internal pair are negative.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gearmbs.gears.geometry import PairGeometry

NORMALS = 300
"""Directions of the normal in which a corner is followed: 10 mrad apart, the gap between them is good to 1e-4 of the
module."""

WIDEST_TURN = 3.0
"""rad; a corner that turns its normal by more has left its mate long before."""


class CornerReach(NamedTuple):
    """A tip corner beyond the path of contact.

    Attributes
    ----------
    length : float
        How far beyond it, along the path, the corner still has a foot on the mate's involute, m.
    passing_gap : float
        Gap with which it then leaves the mate's tip, m, while flanks at work just touch; negative if tips foul.
    curve : float
        Curvature with which its gap begins to grow along the path, 1/m: ``curve x^2``.
    bound : float
        Least ratio of its gap, up to the passing gap, to x^2, 1/m.
    """

    length: float
    passing_gap: float
    curve: float
    bound: float


def corner_reach(geometry: PairGeometry, wheel: int, change: float = 0.0) -> CornerReach:
    """Follow the tip corner of a wheel, 0 or 1, from the end of the path of contact to the mate's tip.

    Where the normal stands at alpha, the corner at the radius r bears on the mate's base tangent with the arm
    ``c = a cos(alpha) - r_b2`` about its own wheel, at the length ``t = (r^2 - c^2)^(1/2)`` from the arm's foot. With T
    and alpha' for t and alpha at the end of the path and the length L of the line of action,

        x = r_b1 (atan2(t, c) - atan2(T, r_b1) - alpha + alpha')
        gap = a sin(alpha) - L - (t - T) - r_b2 (alpha - alpha') + x

    and the foot is at ``a sin(alpha) - t - rho`` on the mate, with the tip rounding rho of the corner.

    Parameters
    ----------
    geometry : PairGeometry
    wheel : {0, 1}
    change : float
        Added to the centre distance, m.
    """
    own, mate = geometry.wheels if wheel == 0 else geometry.wheels[::-1]
    rb, mate_rb = own.sign * own.base_radius, mate.sign * mate.base_radius
    radius, end = own.corner_radius, mate.sign * mate.tip_roll_length
    a = geometry.sign * (geometry.centre_distance + change)
    working = math.acos((rb + mate_rb) / a)
    length = a * math.sin(working)
    begin = own.sign * math.sqrt(radius * radius - rb * rb)
    way = math.copysign(1.0, rb * (length - begin) / begin)
    alpha = working + way * np.linspace(0.0, WIDEST_TURN, NORMALS)
    arm = a * np.cos(alpha) - mate_rb
    square = radius * radius - arm * arm
    count = int(np.argmax(square <= 0.0)) or NORMALS
    alpha, arm = alpha[:count], arm[:count]
    t = own.sign * np.sqrt(square[:count])
    turn = np.unwrap(np.arctan2(own.sign * t, own.sign * arm)) - math.atan2(abs(begin), abs(rb))
    x = rb * (turn - alpha + working)
    gap = a * np.sin(alpha) - length - (t - begin) - mate_rb * (alpha - working) + x
    beyond = a * np.sin(alpha) - t - own.tip_rounding - end
    last = int(np.argmax(beyond > 0.0))
    if last == 0:
        # no foot at all where the wheels hardly reach each other; or one until the corner turns back
        last = 1 if beyond[0] > 0.0 else count - 1
    part = float(np.clip(-beyond[last - 1] / (beyond[last] - beyond[last - 1] or 1.0), 0.0, 1.0))
    x_end, passing = ((1.0 - part) * v[last - 1] + part * v[last] for v in (x, gap))
    curve = length * begin / (2.0 * (length - begin) * rb * rb)
    rising = gap[1:last] < max(passing, gap[1])
    count = int(np.argmin(rising)) if not rising.all() else rising.size
    bound = (gap[1 : count + 1] / x[1 : count + 1] ** 2).min(initial=curve)
    return CornerReach(float(x_end), float(passing), curve, float(bound))


TURNS = 80
"""Places of the wheel while its corner goes through the mate's root, and once more around the closest of them: the
distance is good to 1e-5 modules."""


def fillet_clearance(geometry: PairGeometry, wheel: int, depth: float = 0.0) -> float:
    """Least distance of the tip corner of a wheel, 0 or 1, from the mate's root arc while flanks at work touch.

    Infinite if the corner does not come over the arc; negative if it cuts into it. See `gearmbs.contact.root` for
    the arc and where a corner is over it.

    Parameters
    ----------
    geometry : PairGeometry
    wheel : {0, 1}
    depth : float
        How deep the flanks are pressed into each other, m.
    """
    own, mate = geometry.wheels if wheel == 0 else geometry.wheels[::-1]
    rb, mate_rb = own.sign * own.base_radius, mate.sign * mate.base_radius
    a, alpha = geometry.sign * geometry.centre_distance, geometry.working_pressure_angle
    radius, arc = own.sign * own.corner_radius, mate.fillet_radius
    centre, around = mate.sign * mate.fillet_centre_radius, mate.sign * mate.fillet_half_angle
    together = geometry.line_of_action - geometry.base_radius_sum * alpha + depth
    middle, width = 0.0, 4.0 * math.pi / own.teeth
    least = math.inf
    for _ in range(2):
        corner = middle + width * np.linspace(-1.0, 1.0, TURNS)
        f = corner - own.sign * own.corner_half_angle
        at = (
            (together - rb * (f + own.sign * own.base_half_angle)) / mate_rb - mate.sign * mate.base_half_angle + around
        )
        dx = a - radius * np.cos(corner) - centre * np.cos(at)
        dy = -radius * np.sin(corner) - centre * np.sin(at)
        end = at - math.asin(arc / centre)
        over = (dx * np.sin(at) - dy * np.cos(at) >= 0.0) & (dx * np.cos(end) + dy * np.sin(end) < 0.0)
        clearance = np.where(over, arc - own.tip_rounding - np.hypot(dx, dy), math.inf)
        best = int(clearance.argmin())
        least = min(least, float(clearance[best]))
        middle, width = float(corner[best]), 4.0 * width / TURNS
    return least
