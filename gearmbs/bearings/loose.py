"""A rolling bearing in a mechanism, its rings fixed or loose on their seats."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.bearings.clearance import ClearanceForce
from gearmbs.bearings.defect_tables import as_defects
from gearmbs.bearings.defects import INNER, OUTER, LooseFit
from gearmbs.bearings.element import RollingBearing
from gearmbs.bearings.errors import BearingError, require
from gearmbs.bearings.geometry import Bearing

if TYPE_CHECKING:
    from gearmbs.mechanism import Mechanism
    from gearmbs.mechanism.parts import Marker

DEPTH = 1e-6
"""Penetration at which the damping of a seat is fully on, m."""
LANDS = 0.4
"""Where a ring sits on its seat: so many widths to either side of its middle."""
STEEL = 7800.0
GROOVE = 0.35
"""Middle radius of a ring's raceway from the pitch radius, in ball diameters."""


def add_bearing(
    m: Mechanism, name: str, inner: Marker, outer: Marker, bearing: Bearing, **settings: Any
) -> RollingBearing:
    """Add a rolling bearing between two markers; rings with a `LooseFit` become bodies of their own.

    A loose ring touches its seat at two lands with a clearance, is held along the axis by a spring, and creeps in its
    seat against a viscous drag. Its mass follows from the bearing's boundary dimensions.

    Parameters
    ----------
    m : Mechanism
    name : str
        Of the bearing; a loose ring's body is "<name>.outer ring" or "<name>.inner ring", its seats "<name>.outer seat
        1" and so on.
    inner, outer : Marker
        On shaft and housing, coinciding, z along the axis.
    bearing : Bearing
    **settings
        As of `RollingBearing`; among ``defects`` there may be a `LooseFit` for each ring.

    Returns
    -------
    RollingBearing

    Examples
    --------
    >>> from gearmbs.bearings import LooseFit
    >>> from gearmbs.mechanism import Mechanism
    >>> m = Mechanism("one shaft")
    >>> shaft = m.body("shaft", mass=1.0, inertia=(1e-3, 1e-3, 1e-3))
    >>> bearing = Bearing.from_designation("6205")
    >>> found = add_bearing(m, "A", shaft.marker(), m.ground.marker(), bearing, defects=[LooseFit(clearance="20 um")])
    >>> sorted(m.bodies)
    ['A.outer ring', 'shaft']
    """
    defects = as_defects(settings.pop("defects", ()))
    fits = {defect.part: defect for defect in defects if isinstance(defect, LooseFit)}
    rest = [defect for defect in defects if not isinstance(defect, LooseFit)]
    require(
        len(fits) + len(rest) == len(defects), f"bearing '{name}': more than one LooseFit of a ring; give one for each"
    )
    if OUTER in fits:
        outer = _ring(m, name, OUTER, outer, fits[OUTER], bearing)
    if INNER in fits:
        inner = _ring(m, name, INNER, inner, fits[INNER], bearing)
    made = RollingBearing(name, inner, outer, bearing=bearing, defects=rest, **settings)
    m.add(made)
    return made


def _ring(m: Mechanism, name: str, part: str, seat: Marker, fit: LooseFit, bearing: Bearing) -> Marker:
    """Add a loose ring as a body on its seat; return its marker for the bearing."""
    fit.check(bearing)
    body, at, frame = seat.body, seat.global_position(), seat.global_orientation()
    mass, moments = ring_inertia(bearing, part)
    velocity = body.velocity + np.cross(body.angular_velocity, at - body.position)
    label = f"{name}.{part} ring"
    ring = m.body(
        label, mass, moments, position=at, orientation=frame, velocity=velocity,
        angular_velocity=body.angular_velocity,
    )  # fmt: skip
    width = bearing.width
    assert width is not None
    reals = (0.5 * fit.clearance, 0.5 * fit.stiffness, 1.0, 0.5 * fit.stiffness * fit.damping, DEPTH)
    for k, side in enumerate((-LANDS, LANDS)):
        where = at + side * width * frame[:, 2]
        own, other = ring.marker_at(where, frame), body.marker_at(where, frame)
        # the ring is the journal in a housing, and the bore on a shaft
        pair = (own, other) if part == OUTER else (other, own)
        m.add(ClearanceForce(f"{name}.{part} seat {k + 1}", *pair, reals))
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    stiffness[2, 2], damping[2, 2], damping[5, 5] = fit.stiffness, fit.stiffness * fit.damping, fit.creep
    m.field(f"{name}.{part} shoulder", ring.marker_at(at, frame), seat, stiffness=stiffness, damping=damping)
    return ring.marker_at(at, frame, name=f"{name}.{part}")


def ring_inertia(bearing: Bearing, part: str) -> tuple[float, tuple[float, float, float]]:
    """Return mass (kg) and moments of inertia (kg m^2) of a ring, a tube from its seat to the middle of its raceway.

    Raises
    ------
    BearingError
        Without boundary dimensions.
    """
    seat = bearing.outside_diameter if part == OUTER else bearing.bore
    if seat is None or bearing.width is None:
        field = "outside_diameter" if part == OUTER else "bore"
        raise BearingError(f"LooseFit: the ring's mass needs Bearing.{field} and Bearing.width; give them")
    sign = 1.0 if part == OUTER else -1.0
    race, width = 0.5 * bearing.pitch_diameter + sign * GROOVE * bearing.element_diameter, bearing.width
    mass = STEEL * math.pi * abs((0.5 * seat) ** 2 - race**2) * width
    square = (0.5 * seat) ** 2 + race**2
    across = mass * (3.0 * square + width**2) / 12.0
    return mass, (across, across, 0.5 * mass * square)
