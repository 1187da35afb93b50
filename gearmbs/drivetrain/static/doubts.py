"""What speaks against the numbers of a drivetrain: sizes that do not fit each other, and units that were hardly meant.

A model can have all of it, so that it is warned of and not refused. Most is a radius where a diameter was meant, or a
plain number, which is in SI. Limits are wide of what is usual: they are no rules of design, and from no standard.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.gears.geometry import MM
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain
    from gearmbs.drivetrain.placement import Seat

SHOULDER = 1.4
"""Largest diameter of a shaft in a bearing by the bearing's bore: shoulders of inner rings reach 1.35 of it."""
SLEEVE = 1.25
"""Largest bore of a bearing by the diameter of its shaft: adapter sleeves of small bearings take up a fifth."""
HALF = (0.45, 0.55)
"""Ratio of sizes that looks like a radius and a diameter."""
LOOSE = 1.5
"""Bore of a wheel by the diameter of its shaft, and the inverse, from which on the one does not sit on the other: hubs
that the sections of a shaft leave out are a quarter of it thick."""
OVERHANG = 0.25
"""Part of a wheel's face that may be over the end of its shaft: half of it is where its middle is at the end."""
PITCH_SPEED = 2.5e6
"""Largest speed times mean diameter of a rolling bearing, mm/min: engines of aircraft reach 2.4e6."""
HEAVY = 20.0
"""Largest weight of a mass, m/s^2: twice that on the ground."""
SLOWEST = 1.0
"""Lowest frequency of a housing on its mounts, Hz: at 1 Hz it would have sunk by 25 cm under its weight."""
UNEVEN = 1e-3
"""Least stiffness of a mount by the stiffest, in one direction, unless it has none."""
WIDE = 3.0
"""Largest ratio of the face widths of two wheels in mesh, and of a face width to the pitch diameter of its pinion,
of which 1 is much."""
THIN = 1.0
"""Least face width by the module: below a tooth is higher than wide."""
PLAY = 0.5
"""Largest normal backlash by the module: drawings have 0.03 to 0.1."""
TURNS = 2.0 * math.pi * (1.0 + 1e-9)
"""Largest angle of a direction, rad: more is degrees."""
TOUCH = 1e-6
"""Overlap of sizes, m, that is none: far below a drawing's."""


def warn_of_doubts(train: Drivetrain) -> None:
    """Warn of sizes that do not fit each other, and of numbers whose units were hardly meant.

    Warns
    -----
    UserWarning
        With the part, the values and what may be meant.
    """
    for found in (_bores, _wheels, _meshes, _neighbours, _mounts, _angles, _speeds, _weight):
        for message in found(train):
            warn(message)


def _diameter(shaft: Shaft, station: float) -> float:
    """Return the diameter of a shaft at a station; at a shoulder the larger one, m."""
    start, found = 0.0, 0.0
    for length, radius in shaft.cylinders:
        if start - TOUCH <= station <= start + length + TOUCH:
            found = max(found, 2.0 * radius)
        start += length
    return found


def _is_told(shaft: Shaft) -> bool:
    """Return whether a shaft says how thick it is: not by the usual diameter, nor a rotor by its numbers."""
    given = (shaft.radius, shaft.diameter, shaft.sections, shaft.model)
    return any(one is not None for one in given) and shaft.mass is None and shaft.inertia is None


def _twice(one: float, other: float) -> str:
    """Return what may be meant by two sizes that should be about one."""
    share = min(one, other) / max(one, other)
    return "; is one of them a radius, the other a diameter?" if HALF[0] <= share <= HALF[1] else "."


def size_hint(train: Drivetrain, shaft: str) -> str:
    """Return the end of a message about a shaft that is too thick somewhere: what its bearings say of that."""
    found = next((one for one in _bores(train, shaft) if "a radius" in one), "")
    return f" ({found})" if found else ""


def _bores(train: Drivetrain, of: str = "") -> Iterator[str]:
    """Yield what is said of bearings that do not fit their shafts, or one shaft."""
    for bearing in train.bearings:
        if of not in ("", bearing.shaft):
            continue
        shaft = train.part(bearing.shaft, Shaft)
        bore = None if bearing.rolling is None else bearing.rolling.bore
        # on a shaft it may be the outer ring that turns
        if bore is None or not _is_told(shaft) or isinstance(train.parts.get(train.carrier(bearing)), Shaft):
            continue
        thick = _diameter(shaft, train.station(bearing))
        if thick > SHOULDER * bore or bore > SLEEVE * thick:
            yield (
                f"{bearing.label}: its bore is {MM * bore:.4g} mm, and shaft '{shaft.name}' is {MM * thick:.4g} mm in "
                f"diameter there{_twice(bore, thick)} Check diameter (or radius) and station, or give sections"
            )


def _wheels(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of wheels that do not fit their shafts, or reach over their ends."""
    for wheel in train.wheels:
        gear, shaft, station = wheel.gear, train.part(wheel.shaft, Shaft), train.station(wheel)
        if gear.face_width < THIN * gear.module:
            yield (
                f"{wheel.label}: its face width is {MM * gear.face_width:.4g} mm at a module of "
                f"{MM * gear.module:.4g} mm; is another unit meant?"
            )
        thick, bore = _diameter(shaft, station), 2.0 * gear.bore_radius
        if gear.internal or not bore or not _is_told(shaft):
            continue
        if not thick / LOOSE <= bore <= LOOSE * thick:
            yield (
                f"{wheel.label}: its bore is {MM * bore:.4g} mm in diameter (bore_radius {0.5 * MM * bore:.4g} mm) "
                f"and shaft '{shaft.name}' {MM * thick:.4g} mm there{_twice(bore, thick)} Give the shaft's radius as "
                "bore_radius"
            )
        over = max(0.5 * gear.face_width - station, station + 0.5 * gear.face_width - shaft.length)
        if over > OVERHANG * gear.face_width:
            yield (
                f"{wheel.label}: its face reaches {MM * over:.4g} mm over the end of shaft '{shaft.name}'; check "
                "station, which is mid-face, and face_width"
            )


def _meshes(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of pairs of wheels that are hardly meant."""
    for mesh in train.meshes:
        one, two = (wheel.gear for wheel in train.wheels_of(mesh))
        narrow, wide = sorted((one.face_width, two.face_width))
        pinion = min(one, two, key=lambda gear: gear.teeth)
        if wide > WIDE * narrow or narrow > WIDE * 2.0 * pinion.pitch_radius:
            yield (
                f"{mesh.label}: its face widths are {MM * one.face_width:.4g} and {MM * two.face_width:.4g} mm, with "
                f"{MM * 2.0 * pinion.pitch_radius:.4g} mm of pitch diameter; is another unit meant?"
            )
        backlash = getattr(train.pairs[mesh.name].geometry, "normal_backlash", 0.0)
        if backlash > PLAY * one.module:
            yield (
                f"{mesh.label}: its normal backlash is {MM * backlash:.4g} mm at a module of {MM * one.module:.4g} mm; "
                "usual are 0.03 to 0.1 of the module: is another unit meant?"
            )


class Ring(NamedTuple):
    """A cylinder about an axis: the outer ring of a bearing, or a wheel; m."""

    label: str
    shaft: str
    station: float
    radius: float
    width: float


def _rings(train: Drivetrain) -> list[Ring]:
    """Return the outer rings of bearings that stand still, of known sizes."""
    out = []
    for bearing in train.bearings:
        rolling = bearing.rolling
        still = not isinstance(train.parts.get(train.carrier(bearing)), Shaft)
        if still and rolling is not None and None not in (rolling.outside_diameter, rolling.width):
            half = 0.5 * rolling.outside_diameter
            out.append(Ring(bearing.label, bearing.shaft, train.station(bearing), half, rolling.width))
    return out


def _overlap(one: Ring, two: Ring, seats: dict[str, Seat]) -> tuple[float, float]:
    """Return by how much two cylinders on parallel axes overlap along and across them, m; negative: apart."""
    a, b = seats[one.shaft], seats[two.shaft]
    if abs(float(a.axes[:, 2] @ b.axes[:, 2])) < 1.0 - TOUCH:
        return -np.inf, -np.inf
    apart = b.at(two.station) - a.at(one.station)
    along = float(apart @ a.axes[:, 2])
    across = float(np.linalg.norm(apart - along * a.axes[:, 2]))
    return 0.5 * (one.width + two.width) - abs(along), one.radius + two.radius - across


def _neighbours(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of outer rings where wheels or other rings are."""
    rings, seats = _rings(train), train.layout.seats
    wheels = [
        Ring(w.label, w.shaft, train.station(w), w.gear.tip_radius, w.gear.face_width)
        for w in train.wheels
        if not w.gear.internal
    ]
    pairs = [*combinations(rings, 2), *((ring, wheel) for ring in rings for wheel in wheels)]
    for one, two in pairs:
        along, across = _overlap(one, two, seats)
        # two of a shaft may stand at one place for one bearing of both ways
        if min(along, across) <= TOUCH or (one.shaft == two.shaft and two in rings):
            continue
        where = "on the shaft" if one.shaft == two.shaft else f"{MM * across:.4g} mm across"
        yield (
            f"{one.label}: its outer ring of {2.0 * MM * one.radius:.4g} mm and {two.label}, "
            f"{2.0 * MM * two.radius:.4g} mm in diameter, overlap, by {MM * along:.4g} mm along the axis and {where}; "
            "check stations, the designation and the centre distance"
        )


def _mounts(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of mounts that are softer than any housing stands on, or than the others."""
    for housing in train.housings:
        if not housing.mounts:
            continue
        stiffness = np.array([mount.stiffness for mount in housing.mounts], dtype=float)
        total = stiffness.sum(axis=0)
        mass = _mass(train, housing)
        slow = np.sqrt(total / mass) / (2.0 * math.pi)
        if (total > 0.0).all() and slow.min() < SLOWEST:
            axis = int(np.argmin(slow))
            yield (
                f"{housing.label}: with {total[axis]:.4g} N/m of its mounts along {'xyz'[axis]} its {mass:.4g} kg "
                f"swing at {slow[axis]:.3g} Hz; are N/mm meant? A plain number is in N/m"
            )
            continue
        soft = (stiffness > 0.0) & (stiffness < UNEVEN * stiffness.max(axis=0))
        if soft.any():
            k, axis = (int(i) for i in np.argwhere(soft)[0])
            yield (
                f"{housing.mounts[k].label}: its stiffness along {'xyz'[axis]} is {stiffness[k, axis]:.4g} N/m, of "
                f"another mount {stiffness[:, axis].max():.4g} N/m; is another unit meant?"
            )


def _mass(train: Drivetrain, housing: Housing) -> float:
    """Return the mass of a housing, kg."""
    if housing.model is None:
        assert housing.mass is not None
        return float(housing.mass)
    found = housing.model
    return float(found.properties.mass if hasattr(found, "properties") else found.mass_properties().mass)


def _angles(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of directions and angles of more than a turn."""
    given = [(mesh.label, "direction", mesh.direction) for mesh in train.meshes]
    given += [(shaft.label, "angle", shaft.angle) for shaft in train.shafts]
    given += [(wheel.label, "angle", wheel.angle) for wheel in train.wheels]
    for label, name, angle in given:
        if angle is not None and abs(float(angle)) > TURNS:
            yield (
                f"{label}: {name} is {float(angle):.6g} rad, {math.degrees(float(angle)):.6g} deg; is "
                f"'{float(angle):g} deg' meant?"
            )


def _speeds(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of bearings that turn faster than any does."""
    for bearing in train.bearings:
        rolling = bearing.rolling
        if rolling is None or None in (rolling.bore, rolling.outside_diameter):
            continue
        speed = abs(train.speeds[bearing.shaft] - train.speeds.get(train.carrier(bearing), 0.0)) * 30.0 / math.pi
        product = speed * 0.5 * MM * (rolling.bore + rolling.outside_diameter)
        if product > PITCH_SPEED:
            yield (
                f"{bearing.label}: at {speed:.5g} rpm its speed times mean diameter is {product:.3g} mm/min, more than "
                f"rolling bearings run at ({PITCH_SPEED:.2g}); check the speed of the drive: a plain number is in rad/s"
            )


def _weight(train: Drivetrain) -> Iterator[str]:
    """Yield what is said of gravity."""
    size = math.hypot(*train.gravity)
    if size > HEAVY:
        yield f"drivetrain '{train.name}': gravity is {size:.5g} m/s^2; is mm/s^2 meant? A plain number is in m/s^2"
