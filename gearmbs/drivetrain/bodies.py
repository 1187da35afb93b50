"""Bodies of a drivetrain that deform: where their seats are follows from the parts on them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearmbs.drivetrain.connections import Bearing
from gearmbs.drivetrain.housing import Housing, Mount
from gearmbs.drivetrain.members.carrier import carrier_models
from gearmbs.drivetrain.members.shaft_body import Width, shaft_body
from gearmbs.drivetrain.members.sources import ALL, MODES, ROUND
from gearmbs.drivetrain.part import errors_named, require
from gearmbs.drivetrain.planetary import carried
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.flexible import Disc, FiniteElementModel, Interface, ModalModel, Seat, reduce_model
from gearmbs.flexible import Shaft as SectionedShaft
from gearmbs.flexible.modal_model import REACH, shapes_at
from gearmbs.gears.geometry import MM
from gearmbs.schema.quantities import Measure

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

SAME_SEAT = 0.5 * REACH
"""Distance of two seats, by the length of their shaft, up to which they are one: markers see twice as far."""

_LENGTHS = Measure("length", above=0, several=2)


def modal_models(train: Drivetrain) -> dict[str, ModalModel]:
    """Return the bodies with modes of a drivetrain's shafts, housings, carriers and wheels that have them, by name."""
    found = {shaft.name: shaft_model(train, shaft) for shaft in train.shafts if shaft.bends}
    found |= {h.name: housing_model(train, h) for h in train.housings if h.model is not None}
    return found | carrier_models(train) | wheel_models(train)


def wheel_models(train: Drivetrain) -> dict[str, ModalModel]:
    """Return the bodies with modes of wheels that deform, by name."""
    found = {}
    for wheel in train.wheels:
        if wheel.flexible is not None:
            with errors_named(wheel.label):
                found[wheel.name] = wheel.flexible.body(wheel.name, wheel.gear)
    return found


# --- shafts ---------------------------------------------------------------------------------------


def shaft_seats(train: Drivetrain, shaft: Shaft) -> dict[str, float]:
    """Return the stations (m) at which parts hold or load a shaft, by the names of the parts there."""
    at = [(w.name, train.station(w)) for w in train.wheels if w.shaft == shaft.name]
    for stage in train.planetary_stages:
        members = [member for member, on in stage.holders.items() if on == shaft.name]
        hub = 0.0 if stage.flexible_carrier is None else stage.flexible_carrier.hub_at
        shifts = {"carrier": hub}
        at += [(f"{stage.name} {m}", stage.station(train, m) + shifts.get(m, 0.0)) for m in members]
    at += [(b.name, train.station(b)) for b in train.bearings if b.shaft == shaft.name]
    for bearing in train.bearings:
        if train.carrier(bearing) == shaft.name:
            at.append((bearing.name, 0.5 * shaft.length if bearing.on_station is None else bearing.on_station))
    for coupling in train.couplings:
        ends = coupling.stations or (train.part(coupling.first, Shaft).length, 0.0)
        at += [(coupling.name, z) for name, z in zip((coupling.first, coupling.second), ends) if name == shaft.name]
    at += [(d.name, train.station(d, "left")) for d in train.drives if d.shaft == shaft.name]
    at += [(load.name, train.station(load, "right")) for load in train.loads if load.shaft == shaft.name]
    groups: list[tuple[list[str], float]] = []
    for name, z in sorted(at, key=lambda pair: pair[1]):
        if groups and z - groups[-1][1] <= SAME_SEAT * shaft.length:
            groups[-1][0].append(name)
        else:
            groups.append(([name], z))
    return {", ".join(names): z for names, z in groups}


def seat_sizes(train: Drivetrain, shaft: Shaft) -> dict[str, Width]:
    """Return what is known of how large the seats of parts on a shaft are, by name."""
    out: dict[str, Width] = {}
    for wheel in train.wheels:
        if wheel.shaft == shaft.name:
            out[wheel.name] = Width(2.0 * wheel.gear.bore_radius or None, wheel.gear.face_width)
    for stage in train.planetary_stages:
        if stage.sun == shaft.name:
            out[f"{stage.name} sun"] = Width(2.0 * stage.gears.sun.bore_radius or None, stage.gears.sun.face_width)
    for bearing in train.bearings:
        if bearing.shaft == shaft.name and bearing.rolling is not None:
            out[bearing.name] = Width(bearing.rolling.bore, bearing.rolling.width)
    return out


def _whole_seat(sizes: dict[str, Width], names: str) -> Width:
    """Return the size of the seat of parts at one station: the widest."""
    found = [sizes[name] for name in names.split(", ") if name in sizes]
    return max(found, key=lambda size: size.width or 0.0, default=Width(None, None))


def shaft_model(train: Drivetrain, shaft: Shaft, *, bare: bool = False) -> ModalModel:
    """Return a shaft with its wheels, or ``bare``, as a body with modes."""
    if shaft.model is not None:
        sizes = seat_sizes(train, shaft)
        at = {names: (z, _whole_seat(sizes, names)) for names, z in shaft_seats(train, shaft).items()}
        with errors_named(shaft.label):
            return shaft_body(shaft, at)
    discs = [
        Disc(one.station, mass=one.mass, polar=one.inertia[2], diametral=one.inertia[0], name=one.name)
        for one in ([] if bare else carried(train, shaft.name))
    ]
    with errors_named(shaft.label):
        whole = SectionedShaft(
            shaft.pieces, discs, dict(shaft_seats(train, shaft)), shaft.material, shaft.elements, name=shaft.name
        )
        if shaft.modes == ALL:
            return whole.modal_model(max_frequency=np.inf)
        return whole.modal_model(shaft.modes)


# --- housings -------------------------------------------------------------------------------------


def housing_model(train: Drivetrain, housing: Housing) -> ModalModel:
    """Return a housing as a body with modes, whose seats are its bearings and mounts, by their names.

    Raises
    ------
    DrivetrainError
        Where no nodes are at a bearing or a mount, or a bearing does not say how large its seat is.
    """
    places = seat_places(train, housing)
    if isinstance(housing.model, ModalModel):
        seats = {name: _carried(train, housing, name, place) for name, place in places.items()}
        model = housing.model
        if isinstance(housing.modes, int):
            model = replace(model, seats=seats).slowest(housing.modes)
            return replace(model, name=housing.name)
        return replace(model, seats=seats, name=housing.name)
    faces = [_face(train, housing, name, place) for name, place in places.items()]
    with errors_named(housing.label):
        if housing.modes == ALL:
            return reduce_model(housing.model, faces, max_frequency=np.inf, name=housing.name)
        return reduce_model(housing.model, faces, modes=housing.modes or MODES, name=housing.name)


class RingSeat(NamedTuple):
    """The ring of a planetary stage in a housing: what is known of its seat as of a bearing's."""

    name: str
    shaft: str
    station: float
    outside_diameter: float
    width: float

    @property
    def label(self) -> str:
        """What messages call it."""
        return f"'{self.name}'"

    @property
    def rolling(self) -> RingSeat:
        """What has the size of the seat."""
        return self


def ring_seats(train: Drivetrain, housing: str) -> dict[str, RingSeat]:
    """Return the rings of planetary stages that a housing holds, by the names of their seats."""
    out = {}
    for stage in train.planetary_stages:
        if stage.ring == housing:
            member, shaft = next(iter(stage.turning(train).items()))
            ring, name = stage.gears.ring, f"{stage.name} ring"
            out[name] = RingSeat(name, shaft, stage.station(train, member), 2.0 * ring.outer_radius, ring.face_width)
    return out


def seat_places(train: Drivetrain, housing: Housing) -> dict[str, np.ndarray]:
    """Return where the bearings, rings and mounts of a housing are, m, in the frame of its nodes, by name."""
    origin, axes = np.asarray(housing.at, dtype=float), housing.turned
    out = {}
    for bearing in train.bearings:
        if train.carrier(bearing) == housing.name:
            out[bearing.name] = axes.T @ (train.layout.seats[bearing.shaft].at(train.station(bearing)) - origin)
    for name, ring in ring_seats(train, housing.name).items():
        out[name] = axes.T @ (train.layout.seats[ring.shaft].at(ring.station) - origin)
    for mount in housing.mounts:
        out[mount.name] = axes.T @ (np.asarray(mount.at, dtype=float) - origin)
    return out


def _face(train: Drivetrain, housing: Housing, name: str, place: np.ndarray) -> Interface:
    """Return the nodes that carry a bearing, or a mount, at a place."""
    model: FiniteElementModel = housing.model
    arm = model.positions - place
    mount = next((m for m in housing.mounts if m.name == name), None)
    if mount is not None:
        require(
            mount.radius is not None,
            f"{mount.label}: radius is missing; give that of the foot, within which nodes of {housing.label} carry it",
        )
        inside = np.linalg.norm(arm, axis=1) <= mount.radius
        size = f"radius = {MM * mount.radius:.4g} mm"
        return _interface(housing, mount, place, inside, size)
    bearing = ring_seats(train, housing.name).get(name) or train.part(name, Bearing)
    diameter, width = _size(housing, bearing)
    axis = housing.turned.T @ train.layout.seats[bearing.shaft].axes[:, 2]
    along = arm @ axis
    across = np.linalg.norm(arm - along[:, None] * axis, axis=1)
    inside = (across <= 0.5 * ROUND * diameter) & (np.abs(along) <= 0.5 * ROUND * width)
    return _interface(housing, bearing, place, inside, f"seats = ({MM * diameter:.4g} mm, {MM * width:.4g} mm)")


def _interface(housing: Housing, part: Any, place: np.ndarray, inside: np.ndarray, size: str) -> Interface:
    model: FiniteElementModel = housing.model
    apart = MM * np.sort(np.linalg.norm(model.positions - place, axis=1))[:3]
    require(
        int(inside.sum()) >= 3,
        f"{part.label}: {int(inside.sum())} nodes of {housing.label} are within {size}; the nearest are "
        f"{apart[0]:.4g}, {apart[1]:.4g} and {apart[2]:.4g} mm away: check at and axes of the housing, give a larger "
        "seat or a finer mesh",
    )
    return Interface(part.name, [int(k) for k in model.ids[inside]], housing.faces, at=tuple(place))


def _size(housing: Housing, bearing: Bearing | RingSeat) -> tuple[float, float]:
    """Return the diameter and the width of what a bearing sits in, m."""
    given = housing.seats.get(bearing.name)
    if given is not None:
        return housing.read(f"seats.{bearing.name}", given, _LENGTHS)
    rolling = bearing.rolling
    known = rolling is not None and None not in (rolling.outside_diameter, rolling.width)
    require(
        known,
        f"{bearing.label}: how large its seat in {housing.label} is follows from no rolling bearing; give "
        f"seats = {{'{bearing.name}': (outside diameter, width)}} of the housing",
    )
    return rolling.outside_diameter, rolling.width


def _carried(train: Drivetrain, housing: Housing, name: str, place: np.ndarray) -> Seat:
    """Return the seat of a bearing or mount on a body with modes: the nearest of its own, with a rigid arm."""
    model: ModalModel = housing.model
    mount = next((m for m in housing.mounts if m.name == name), None)
    part = mount or ring_seats(train, housing.name).get(name) or train.part(name, Bearing)
    asked = housing.seats.get(name)
    with errors_named(f"{part.label}, seated in {housing.label}"):
        if asked is not None:
            position = model.place(asked)
        else:
            points = np.vstack([*(seat.position for seat in model.seats.values()), model.positions])
            position = points[int(np.argmin(np.linalg.norm(points - place, axis=1)))]
        moved, turned = shapes_at(model, position)
    arm = place - position
    reach = _reach(model, part)
    require(
        asked is not None or bool(np.linalg.norm(arm) <= reach),
        f"{part.label}: the nearest node of {housing.label} is {MM * np.linalg.norm(arm):.4g} mm away, more than "
        f"{MM * reach:.4g} mm; check at and axes of the housing, or name its node by seats = {{'{name}': ...}}",
    )
    return Seat(place, moved + np.cross(turned, arm), turned)


def _reach(model: ModalModel, part: Any) -> float:
    """Return how far from its node a bearing or mount may be, m: within its own radius, else that of a marker."""
    if isinstance(part, Mount):
        return REACH * model.size if part.radius is None else part.radius
    rolling = part.rolling
    if rolling is None or rolling.outside_diameter is None:
        return REACH * model.size
    return 0.5 * rolling.outside_diameter
