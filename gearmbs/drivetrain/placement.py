"""Where shafts are, and how they are turned at the start.

A shaft has a left end O, a frame A_0 that does not turn (z along the axis) and an angle phi about it. With D = A_0
turned about z by a mesh's direction, the mate's wheel is at D r and tilted by D T, where r and T are those of the pair
in its own frame (x from the driver's to the driven wheel's centre). Coaxial shafts share A_0 and phi; a coupling with
an angle or an offset tilts A_0 and moves the point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearmbs.drivetrain.couplings.aligned import Coupling
from gearmbs.drivetrain.couplings.misaligned import Misaligned, roles
from gearmbs.drivetrain.kinematics import links
from gearmbs.drivetrain.part import DrivetrainError, require
from gearmbs.drivetrain.parts import GearMesh, Wheel
from gearmbs.drivetrain.planetary import PlanetaryStage, assemble_stage, speed_rows
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.gears.geometry import MM, turn_z

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

CLOSED = 1e-6
"""Largest distance between what two ways round a closed chain give, m, and angle, rad."""
ROUNDED = 1e-9
"""Overlap of teeth, m, that is rounding: a thousandth of the smallest deflection of teeth under load."""
LARGE_BACKLASH = 0.1
"""Largest backlash that a message proposes, by the base pitch: half of that is a tooth."""
ANGLE_STEPS = 30


class Seat(NamedTuple):
    """Place of a shaft: left end, and the frame that does not turn."""

    origin: np.ndarray
    axes: np.ndarray

    def at(self, station: float) -> np.ndarray:
        """Return the point of the axis at a station."""
        return self.origin + station * self.axes[:, 2]


@dataclass(frozen=True)
class Layout:
    """Places and starting angles of shafts and wheels.

    Attributes
    ----------
    seats : dict of str to Seat
    angles : dict of str to float
        Of shafts and planets about their axes, rad.
    wheels : dict of str to float
        Assembly angle of each wheel against its shaft, rad; of the ring of a planetary stage, too, and of the second
        wheel of each planet.
    directions : dict of str to float
        Of each mesh, from the driver's A_0, rad.
    paces : dict of str to float
        Speed of each shaft at the start over that of its operating point: behind a universal joint it varies.
    """

    seats: dict[str, Seat]
    angles: dict[str, float]
    wheels: dict[str, float]
    directions: dict[str, float]
    paces: dict[str, float]


class Tie(NamedTuple):
    """Something that places one shaft by another: a mesh, a coupling, or what makes them coaxial."""

    name: str
    first: str
    second: str
    mesh: GearMesh | None
    stations: tuple[float, float]
    coupling: Coupling | None = None


def ties(train: Drivetrain) -> list[Tie]:
    """Return what places shafts by each other: couplings, bearings on shafts, planetary stages, then meshes."""
    out = []
    for coupling in train.couplings:
        one, two = (train.part(name, Shaft, coupling.label) for name in (coupling.first, coupling.second))
        stations = coupling.stations or (one.length, 0.0)
        out.append(Tie(coupling.name, one.name, two.name, None, (stations[0], stations[1]), coupling))
    for bearing in train.bearings:
        if bearing.on is not None and isinstance(train.parts.get(bearing.on), Shaft):
            station = train.station(bearing)
            carrier = train.part(bearing.on, Shaft)
            place = 0.5 * carrier.length if bearing.on_station is None else bearing.on_station
            out.append(Tie(bearing.name, carrier.name, bearing.shaft, None, (place, station)))
    for stage in train.planetary_stages:
        at = [(on, stage.station(train, member)) for member, on in stage.turning(train).items()]
        out += [Tie(stage.name, one, two, None, (a, b)) for (one, a), (two, b) in pairwise(at)]
    for mesh in train.meshes:
        driver, driven = train.wheels_of(mesh)
        out.append(Tie(mesh.name, driver.shaft, driven.shaft, mesh, (train.station(driver), train.station(driven))))
    return out


def order(train: Drivetrain, last: frozenset[str] = frozenset()) -> Iterator[tuple[Tie, bool, bool]]:
    """Yield ties from placed shafts outwards: the tie, whether it leads from its first shaft, and to a new one.

    Those of the names in ``last`` come behind all others that can be reached.
    """
    waiting = sorted(ties(train), key=lambda tie: tie.name in last)
    placed: set[str] = set()
    drives = [drive.shaft for drive in train.drives]
    positioned = [shaft.name for shaft in train.shafts if shaft.position is not None]
    # a shaft with a place is a beginning, and where none has one that of the drive
    for root in [*positioned[:1], *drives, *(shaft.name for shaft in train.shafts)]:
        if root in placed:
            continue
        placed.add(root)
        while True:
            tie = next((t for t in waiting if t.first in placed or t.second in placed), None)
            if tie is None:
                break
            waiting.remove(tie)
            forward = tie.first in placed
            second = tie.second if forward else tie.first
            new = second not in placed
            placed.add(second)
            yield tie, forward, new


def seats(train: Drivetrain, pairs: dict[str, Any]) -> tuple[dict[str, Seat], dict[str, float]]:
    """Return the places of all shafts and the directions of all meshes.

    Raises
    ------
    DrivetrainError
        If a closed chain or two given places do not agree with a mesh or coupling.
    """
    out: dict[str, Seat] = {}
    directions: dict[str, float] = {}
    for shaft in train.shafts:
        if shaft.position is not None:
            out[shaft.name] = Seat(np.array(shaft.position, dtype=float), np.eye(3))
    steps = list(order(train))
    followers = {(tie.second if forward else tie.first) for tie, forward, new in steps if new}
    for shaft in train.shafts:
        if shaft.name not in followers and shaft.name not in out:
            out[shaft.name] = Seat(np.zeros(3), np.eye(3))
    for tie, forward, _ in steps:
        here, there = (tie.first, tie.second) if forward else (tie.second, tie.first)
        if tie.mesh is None:
            _place_in_line(train, tie, forward, here, there, out)
            continue
        geometry = pairs[tie.name].geometry
        direction = tie.mesh.direction
        if there in out:
            direction = _direction_between(train, tie, out)
        directions[tie.name] = direction
        found = _by_mesh(tie, forward, out[here], direction, geometry)
        known = out.get(there)
        if known is None:
            out[there] = found
        else:
            _check_closed(train, tie, known, found, geometry, forward)
    return out, directions


def _place_in_line(train: Drivetrain, tie: Tie, forward: bool, here: str, there: str, out: dict[str, Seat]) -> None:
    """Place a shaft in line with another one, or as its coupling says."""
    mine, theirs = tie.stations if forward else tie.stations[::-1]
    point, axes = out[here].at(mine), out[here].axes
    if tie.coupling is not None:
        tilt, shift = tie.coupling.tilt, tie.coupling.shift
        axes = axes @ tilt if forward else axes @ tilt.T
        point = point + out[here].axes @ shift if forward else point - axes @ shift
    known = out.get(there)
    if known is None:
        out[there] = Seat(point - theirs * axes[:, 2], axes)
        return
    gap = known.at(theirs) - point
    along = float(gap @ axes[:, 2])
    across = float(np.linalg.norm(gap - along * axes[:, 2]))
    parallel = float(np.linalg.norm(known.axes[:, 2] - axes[:, 2])) <= CLOSED
    if isinstance(tie.coupling, Misaligned):
        off = MM * (known.at(theirs) - out[here].at(mine))
        turned = math.degrees(math.acos(min(1.0, float(known.axes[:, 2] @ out[here].axes[:, 2]))))
        require(
            across <= CLOSED and parallel,
            f"{tie.coupling.label}: shafts '{tie.first}' and '{tie.second}' are elsewhere by what they are joined with "
            f"otherwise: their places are ({off[0]:.4g}, {off[1]:.4g}, {off[2]:.4g}) mm apart and their axes at "
            f"{turned:.4g} deg; give its angle, direction and offset so, or leave out what places them",
        )
    if tie.coupling is not None and abs(along) > CLOSED:
        role = roles(train.couplings, {bearing.shaft for bearing in train.bearings}).get(tie.name, "")
        require(
            not tie.coupling.holds(role)[:, 2].any(),
            f"{tie.coupling.label}: its places on '{tie.first}' and '{tie.second}' are {MM * abs(along):.4g} mm apart "
            "along the axis, which it holds; change its stations or the place of a shaft",
        )
    require(
        across <= CLOSED and parallel,
        f"{train.parts[tie.name].label}: shafts '{tie.first}' and '{tie.second}' are not coaxial: their axes are "
        f"{MM * across:.4g} mm apart; change their places or the meshes between them",
    )
    require(
        abs(along) <= CLOSED or not isinstance(train.parts[tie.name], PlanetaryStage),
        f"{train.parts[tie.name].label}: its members on '{tie.first}' and '{tie.second}' are {MM * abs(along):.4g} mm "
        "apart along the axis; change their stations or the places of the shafts",
    )


def _direction_between(train: Drivetrain, tie: Tie, out: dict[str, Seat]) -> float:
    """Return the direction of a mesh between two shafts that have their places."""
    one, two = out[tie.first], out[tie.second]
    apart = one.axes.T @ (two.at(tie.stations[1]) - one.at(tie.stations[0]))
    return math.atan2(apart[1], apart[0])


def _by_mesh(tie: Tie, forward: bool, here: Seat, direction: float, geometry: Any) -> Seat:
    """Return the place a mesh gives the other shaft."""
    place = geometry.frames(0.0, 0.0)
    turned, back = turn_z(direction), turn_z(-direction)
    if forward:
        axes = here.axes @ turned @ geometry.tilt @ back
        wheel = here.at(tie.stations[0]) + here.axes @ turned @ place.origin_2
        return Seat(wheel - tie.stations[1] * axes[:, 2], axes)
    axes = here.axes @ turned @ geometry.tilt.T @ back
    wheel = here.at(tie.stations[1]) - axes @ turned @ place.origin_2
    return Seat(wheel - tie.stations[0] * axes[:, 2], axes)


def _check_closed(train: Drivetrain, tie: Tie, known: Seat, found: Seat, geometry: Any, forward: bool) -> None:
    gap = known.origin - found.origin
    along = abs(float(gap @ found.axes[:, 2]))
    across = float(np.linalg.norm(gap - (gap @ found.axes[:, 2]) * found.axes[:, 2]))
    label = train.parts[tie.name].label
    if across > CLOSED:
        wanted = MM * geometry.centre_distance
        raise DrivetrainError(
            f"{label}: the chain does not close: the axes are {MM * across:.4g} mm away from the centre distance of "
            f"{wanted:.6g} mm that its wheels need; move a shaft or give centre_distance_error"
        )
    require(
        along <= CLOSED,
        f"{label}: the wheels' faces are {MM * along:.4g} mm apart along the axis; change a station, or give "
        "axial_shift",
    )
    require(
        float(np.linalg.norm(known.axes[:, 2] - found.axes[:, 2])) <= CLOSED,
        f"{label}: the axes of '{tie.first}' and '{tie.second}' are not as inclined as its misalignment says",
    )


class Misfit(DrivetrainError):
    """Teeth that overlap where a chain closes."""


def assembled(train: Drivetrain) -> Layout:
    """Return the places and the starting angles at which all drive flanks just touch.

    Raises
    ------
    DrivetrainError
        If wheels whose angles are given overlap, or a phase cannot be reached.
    """
    try:
        return _assembled(train, frozenset())
    except Misfit:
        last = frozenset(mesh.name for mesh in train.meshes if any(_turnable(train, w) for w in train.wheels_of(mesh)))
        return _assembled(train, last)


def _turnable(train: Drivetrain, wheel: Wheel) -> bool:
    """Return whether turning a wheel on its shaft moves that against its mate, and nothing else."""
    meshes = sum(wheel.name in (mesh.driver, mesh.driven) for mesh in train.meshes)
    joined = sum(wheel.shaft in (tie.first, tie.second) for tie in ties(train))
    return wheel.angle is None and meshes == 1 and joined > 1


def _assembled(train: Drivetrain, last: frozenset[str]) -> Layout:
    """Return the layout with the meshes of some names assembled behind all others."""
    pairs = train.pairs
    places, directions = seats(train, pairs)
    wheels = {wheel.name: wheel.angle for wheel in train.wheels}
    angles: dict[str, float] = {}
    steps = list(order(train, last))
    followers = {(tie.second if forward else tie.first) for tie, forward, new in steps if new}
    for shaft in train.shafts:
        if shaft.name not in followers:
            angles[shaft.name] = shaft.angle or 0.0
    for tie, forward, new in steps:
        here, there = (tie.first, tie.second) if forward else (tie.second, tie.first)
        if tie.mesh is None:
            stands = angles[here]
            if tie.coupling is not None:
                stands, _ = tie.coupling.follows(stands, forward=forward)
            given = train.part(there, Shaft).angle
            angles.setdefault(there, stands if given is None else given)
            continue
        _turn(train, tie, forward, new, pairs[tie.name], directions[tie.name], angles, wheels)
    for stage in train.planetary_stages:
        assemble_stage(train, stage, angles, wheels)
    assembled_wheels = {n: 0.0 if a is None else a for n, a in wheels.items()}
    return Layout(places, angles, assembled_wheels, directions, _paces(train, angles))


def _paces(train: Drivetrain, angles: dict[str, float]) -> dict[str, float]:
    """Return the speeds of shafts at the start over those of the operating point, behind universal joints others.

    Drives have theirs, as far as the links between them leave it to them, the first one before the others.
    """
    names = list(train.speeds)
    if not any(isinstance(one, Misaligned) and one.angle for one in train.couplings):
        return dict.fromkeys(names, 1.0)
    place = {name: k for k, name in enumerate(names)}
    shares = {one.name: one.follows(angles[one.first])[1] for one in train.couplings}
    rows = [(row, 0.0) for row in speed_rows(train, links(train), place, shares)]
    for drive in train.drives:
        row = np.zeros(len(names))
        row[place[drive.shaft]] = 1.0
        known = np.array([r for r, _ in rows])
        if np.linalg.matrix_rank(np.vstack([known, row])) > np.linalg.matrix_rank(known):
            rows.append((row, drive.speed))
    matrix, wanted = np.array([r for r, _ in rows]), np.array([v for _, v in rows])
    found = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    return {n: float(found[k] / train.speeds[n]) if train.speeds[n] else 1.0 for n, k in place.items()}


def _turn(
    train: Drivetrain, tie: Tie, forward: bool, new: bool, pair: Any, direction: float,
    angles: dict[str, float], wheels: dict[str, float | None],
) -> None:  # fmt: skip
    """Turn the other shaft of a mesh, or a wheel on it, so that the drive flanks touch."""
    mesh = tie.mesh
    assert mesh is not None
    driver, driven = train.wheels_of(mesh)
    here, there = (driver, driven) if forward else (driven, driver)
    pitch = 2.0 * math.pi / driver.gear.teeth
    if mesh.phase is not None:
        require(
            forward and wheels[driver.name] is None,
            f"{mesh.label}: phase turns wheel '{driver.name}' on its shaft, whose angle is given already; leave out "
            "one of them",
        )
        wheels[driver.name] = _near_zero(direction + mesh.phase * pitch - angles[driver.shaft], pitch)
    mine, was_open = wheels[here.name], wheels[here.name] is None
    if mine is None:
        mine = wheels[here.name] = 0.0
    known = angles[here.shaft] + mine - direction
    wanted = direction + (pair.driven_angle(known) if forward else _driver_angle(pair, known))
    mate_pitch = 2.0 * math.pi / there.gear.teeth
    stands = train.part(there.shaft, Shaft).angle
    if new and stands is not None:
        # its wheel is turned on it, as where a chain closes
        angles[there.shaft], new = stands, False
    if new:
        own = wheels[there.name]
        if own is None:
            own = wheels[there.name] = 0.0
        angles[there.shaft] = wanted - own
        return
    if wheels[there.name] is None:
        wheels[there.name] = _near_zero(wanted - angles[there.shaft], mate_pitch)
        return
    own = wheels[there.name]
    assert own is not None
    if was_open:
        # the wheel at this end is in no other mesh yet
        known = angles[there.shaft] + own - direction
        turned = direction + (_driver_angle(pair, known) if forward else pair.driven_angle(known))
        wheels[here.name] = _near_zero(turned - angles[here.shaft], 2.0 * math.pi / here.gear.teeth)
        return
    off = _near_zero(angles[there.shaft] + own - wanted, mate_pitch)
    excess = (abs(off) - pair.geometry.normal_backlash / there.gear.base_radius) * there.gear.base_radius
    if excess > ROUNDED:
        overlap = f"{mesh.label}: at the start its teeth overlap by {MM * excess:.4g} mm: the chain is closed and "
        given = [w.name for w in (there, here) if train.part(w.name, Wheel).angle is not None]
        if given:
            also = " and of its shaft" if stands is not None else ""
            raise Misfit(
                f"{overlap}the angles of its wheels{also} are given; leave out the angle of wheel '{given[0]}'"
            )
        needed = excess + pair.geometry.normal_backlash
        more = needed <= LARGE_BACKLASH * abs(pair.geometry.driver.base_pitch)
        raise Misfit(
            f"{overlap}none of its wheels can be turned on its shaft, because each is the only one there, meshes with "
            "two others, or has its angle or phase given; change a number of teeth or the direction of a mesh"
            + (f", or give a normal backlash of {MM * needed:.4g} mm or more" if more else "")
        )


def _near_zero(angle: float, pitch: float) -> float:
    return angle - pitch * round(angle / pitch)


def _driver_angle(pair: Any, driven_angle: float) -> float:
    """Return the driver's angle at which the driven wheel, at its angle, just touches."""
    geometry = pair.geometry
    angle = 0.0
    for _ in range(ANGLE_STEPS):
        off = driven_angle - pair.driven_angle(angle)
        angle -= off * geometry.sign * geometry.driven.teeth / geometry.driver.teeth
        if abs(off) < 1e-14 * max(1.0, abs(driven_angle)):
            break
    return angle
