"""From a drivetrain to an ordinary mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearmbs.drivetrain.bodies import ring_seats, shaft_model
from gearmbs.drivetrain.connections import Bearing
from gearmbs.drivetrain.couplings.aligned import Coupling
from gearmbs.drivetrain.couplings.misaligned import roles
from gearmbs.drivetrain.drives import Drive
from gearmbs.drivetrain.housing import Housing
from gearmbs.drivetrain.kinematics import joined
from gearmbs.drivetrain.loads import Load
from gearmbs.drivetrain.members.wheel import BORE, IN_SHAFT, RIM, seat_of_wheel
from gearmbs.drivetrain.part import Attached, DrivetrainError, Part, errors_named, require
from gearmbs.drivetrain.parts import Accelerometer, Laser, Sensor, SpeedSensor, TorqueSensor, Wheel
from gearmbs.drivetrain.placement import Layout, Seat, order, seats
from gearmbs.drivetrain.planetary import PlanetaryStage, add_stage, carried, check_stage
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.drivetrain.static.doubts import size_hint
from gearmbs.drivetrain.static.holding import check_held, check_stands
from gearmbs.gears.geometry import MM, turn_z
from gearmbs.gears.spec import COUNTED_TWICE, GearSpec
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.inputs import Output
from gearmbs.mechanism.parts.modal import Mode
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

# What cannot be, found before anything is compiled.


COAXIAL = 1e-6
"""Distance, m, up to which axes are one and faces touch without overlap: far below any gap of a drawing."""


def check(train: Drivetrain) -> None:
    """Check a drivetrain; see :class:`gearmbs.drivetrain.Drivetrain` for what is refused.

    Raises
    ------
    DrivetrainError
        One line that names the part, the value and the remedy.
    """
    if not train.shafts:
        raise DrivetrainError(f"{train.name}: there are no shafts; give at least one")
    for stage in train.planetary_stages:
        check_stage(train, stage)
    _names(train)
    _stations(train)
    _ = train.speeds
    _driven(train)
    pairs = train.pairs
    places, _ = seats(train, pairs)
    _groups(train)
    check_held(train, places)
    for housing in train.housings:
        check_stands(housing)
    _collisions(train, places)


def _names(train: Drivetrain) -> None:
    """Every name a part gives must be that of a part of the right kind."""
    attached: tuple[Any, ...] = (*train.wheels, *train.bearings, *train.drives, *train.loads)
    for part in attached:
        train.part(part.shaft, Shaft, part.label)
        on = getattr(part, "on", None)
        if on is not None and on != "ground":
            found: Part = train.part(on, None, part.label)
            require(
                isinstance(found, Housing | Shaft),
                f"{part.label}: on is '{on}', a {found.title}; give a housing, a shaft or 'ground'",
            )
            require(on != part.shaft, f"{part.label}: on is its own shaft '{on}'; give another part or 'ground'")
    for mesh in train.meshes:
        driver, driven = train.wheels_of(mesh)
        require(driver.shaft != driven.shaft, f"{mesh.label}: both wheels are on shaft '{driver.shaft}'")
    for coupling in train.couplings:
        require(
            coupling.first != coupling.second, f"{coupling.label}: first and second are one shaft, '{coupling.first}'"
        )
    for sensor in train.sensors:
        if isinstance(sensor, Laser | SpeedSensor):
            train.part(sensor.shaft, Shaft, sensor.label)
        elif isinstance(sensor, TorqueSensor):
            source: Part = train.part(sensor.of, None, sensor.label)
            require(
                isinstance(source, Coupling | Load | Drive),
                f"{sensor.label}: of is '{sensor.of}', a {source.title}; give a coupling, load or drive",
            )
        elif isinstance(sensor, Accelerometer):
            bearing = train.part(sensor.bearing, Bearing, sensor.label)
            require(
                isinstance(train.parts.get(train.carrier(bearing)), Housing),
                f"{sensor.label}: the seat of '{bearing.name}' is on {train.carrier(bearing)!r}, which "
                "an accelerometer cannot be on; give a housing",
            )
    for housing in train.housings:
        known = {mount.name for mount in housing.mounts} | set(ring_seats(train, housing.name))
        for name in housing.seats.keys() - known:
            train.part(name, Bearing, f"{housing.label}: seats")
        for mode in housing.modes if housing.model is None else ():
            for place in mode.shape:
                train.part(place, Bearing, mode.label)


def _stations(train: Drivetrain) -> None:
    parts: tuple[Any, ...] = (*train.wheels, *train.bearings, *train.drives, *train.loads)
    for part in (*parts, *(s for s in train.sensors if isinstance(s, Laser))):
        length = train.part(part.shaft, Shaft).length
        if part.station is not None:
            require(
                -1e-12 <= part.station <= length * (1.0 + 1e-12),
                f"{part.label}: station {MM * part.station:.6g} mm is not on shaft '{part.shaft}', which is "
                f"{MM * length:.6g} mm long",
            )


def _driven(train: Drivetrain) -> None:
    """Every load must be on a train with a drive, and every mesh."""
    reached = joined(train, [drive.shaft for drive in train.drives])
    for load in train.loads:
        carried = load.shaft in reached or (load.nominal(0.0) == 0.0 and load.on in reached)
        require(
            carried,
            f"{load.label}: nothing carries its torque: shaft '{load.shaft}' is joined to no drive; "
            "give a drive, a mesh or a coupling",
        )
    for mesh in train.meshes:
        driver, _ = train.wheels_of(mesh)
        require(
            driver.shaft in reached,
            f"{mesh.label}: nothing turns it: shaft '{driver.shaft}' is joined to no drive; give one",
        )
    for stage in train.planetary_stages:
        require(
            reached.issuperset(stage.turning(train).values()),
            f"{stage.label}: nothing turns it: its shafts are joined to no drive; give one",
        )


def _groups(train: Drivetrain) -> None:
    """Parts of a drivetrain that are not placed by each other need places of their own."""
    placed = {(tie.second if forward else tie.first) for tie, forward, new in order(train) if new}
    free = [s.name for s in train.shafts if s.name not in placed and s.position is None]
    if len(free) > 1 or (free and any(s.position is not None for s in train.shafts if s.name not in placed)):
        raise DrivetrainError(
            f"{train.name}: shafts {', '.join(map(repr, free))} are not joined: the chain is open; join them by meshes "
            "or couplings, or give all but one of them a position"
        )


def _collisions(train: Drivetrain, places: dict[str, Seat]) -> None:
    """No wheel may run through a shaft or a wheel it does not mesh with."""
    for wheel in train.wheels:
        for shaft in train.shafts:
            if shaft.name != wheel.shaft:
                _wheel_and_shaft(train, wheel, shaft, places)
    meshing = {frozenset((m.driver, m.driven)) for m in train.meshes}
    for one, two in combinations(train.wheels, 2):
        if one.shaft != two.shaft and frozenset((one.name, two.name)) not in meshing:
            _wheel_and_wheel(train, one, two, places)
    for shaft in train.shafts:
        _wheels_of_one_shaft(train, shaft)
    for stage in train.planetary_stages:
        _stage_and_others(train, stage, places)


def _between(a: Seat, b: Seat, point: np.ndarray) -> tuple[float, float]:
    """Return the distance of a point of axis a from axis b, and the place along b."""
    way = b.axes[:, 2]
    apart = point - b.origin
    along = float(apart @ way)
    return float(np.linalg.norm(apart - along * way)), along


def _wheel_and_shaft(train: Drivetrain, wheel: Wheel, shaft: Shaft, places: dict[str, Seat]) -> None:
    mine, other = places[wheel.shaft], places[shaft.name]
    distance, along = _between(mine, other, mine.at(train.station(wheel)))
    if distance < COAXIAL or wheel.gear.sign < 0:
        return
    half = 0.5 * wheel.gear.face_width
    start = 0.0
    for length, radius in shaft.cylinders:
        overlap = min(along + half, start + length) - max(along - half, start)
        if overlap > COAXIAL and distance < wheel.gear.tip_radius + radius:
            raise DrivetrainError(
                f"{wheel.label}: it runs through shaft '{shaft.name}': the axes are {MM * distance:.6g} mm apart, its "
                f"tip radius {MM * wheel.gear.tip_radius:.6g} mm and the shaft's radius {MM * radius:.6g} mm; make the "
                f"shaft shorter or thinner, or turn the direction of a mesh{size_hint(train, shaft.name)}"
            )
        start += length


def _wheel_and_wheel(train: Drivetrain, one: Wheel, two: Wheel, places: dict[str, Seat]) -> None:
    a, b = places[one.shaft], places[two.shaft]
    distance, along = _between(a, b, a.at(train.station(one)))
    apart = abs(along - train.station(two))
    if min(one.gear.sign, two.gear.sign) < 0 or apart >= 0.5 * (one.gear.face_width + two.gear.face_width):
        return
    if distance < one.gear.tip_radius + two.gear.tip_radius:
        raise DrivetrainError(
            f"{one.label}: it runs through wheel '{two.name}' without a mesh: the axes are {MM * distance:.6g} mm "
            "apart; give a mesh, move a station, or turn the direction of a mesh"
        )


def _wheels_of_one_shaft(train: Drivetrain, shaft: Shaft) -> None:
    mine = sorted((w for w in train.wheels if w.shaft == shaft.name), key=train.station)
    for one, two in pairwise(mine):
        free = train.station(two) - train.station(one) - 0.5 * (one.gear.face_width + two.gear.face_width)
        require(
            free > -COAXIAL,
            f"{two.label}: its face overlaps wheel '{one.name}' on shaft '{shaft.name}' by {-MM * free:.4g} mm; "
            "move its station",
        )


class Swept(NamedTuple):
    """The room that planets and ring of a stage take: between two radii about its axis, over its face width, m."""

    inner: float
    outer: float
    half: float
    seat: Seat
    centre: np.ndarray

    @classmethod
    def of(cls, train: Drivetrain, stage: PlanetaryStage, places: dict[str, Seat]) -> Swept:
        """Return the room of a stage."""
        gears, (member, shaft) = stage.gears, next(iter(stage.turning(train).items()))
        widths = [gear.face_width for gear in (gears.planet, gears.planet_at_ring or gears.planet)]
        seat = places[shaft]
        inner = float(gears.carrier_radius) - gears.planet.tip_radius
        return cls(inner, gears.ring.root_radius, 0.5 * max(widths), seat, seat.at(stage.station(train, member)))

    def hits(self, inner: float, outer: float, distance: float, gap: float) -> bool:
        """Return whether another ring, or with ``inner`` 0 cylinder, is in it: ``gap`` m beyond its face."""
        if gap >= -COAXIAL:
            return False
        if distance < COAXIAL:
            return outer > self.inner and inner < self.outer
        return distance - outer < self.outer and distance + outer > self.inner


def _stage_and_others(train: Drivetrain, stage: PlanetaryStage, places: dict[str, Seat]) -> None:
    """No shaft, wheel or other stage may be where the planets of a stage pass and its ring is."""
    room = Swept.of(train, stage, places)
    at = f"{stage.label}: its planets, from {MM * room.inner:.5g} mm about the axis to its ring, run through"
    remedy = "move a station or the shaft, or make one of them smaller"
    for shaft in train.shafts:
        distance, along = _between(room.seat, places[shaft.name], room.centre)
        start = 0.0
        for length, radius in shaft.cylinders:
            gap = max(along - room.half - start - length, start - along - room.half)
            start += length
            # the carrier is around its planets, and so is what turns the ring
            if shaft.name in (stage.carrier, stage.ring) or not room.hits(0.0, radius, distance, gap):
                continue
            raise DrivetrainError(f"{at} shaft '{shaft.name}' of radius {MM * radius:.5g} mm; {remedy}")
    for wheel in train.wheels:
        distance, along = _between(room.seat, places[wheel.shaft], room.centre)
        gap = abs(along - train.station(wheel)) - room.half - 0.5 * wheel.gear.face_width
        inside = wheel.gear.sign < 0 or wheel.shaft == stage.ring
        if not inside and room.hits(0.0, wheel.gear.tip_radius, distance, gap):
            raise DrivetrainError(
                f"{at} wheel '{wheel.name}' of tip radius {MM * wheel.gear.tip_radius:.5g} mm; {remedy}"
            )
    for other in train.planetary_stages[train.planetary_stages.index(stage) + 1 :]:
        second = Swept.of(train, other, places)
        distance, along = _between(room.seat, second.seat, room.centre)
        gap = (
            abs(along - float((second.centre - second.seat.origin) @ second.seat.axes[:, 2])) - room.half - second.half
        )
        if room.hits(second.inner, second.outer, distance, gap):
            raise DrivetrainError(
                f"{at} stage '{other.name}'; give stations that are {MM * (room.half + second.half):.5g} mm apart"
            )


SAME_POINT = 1e-9
"""Distance, m, up to which a point is a bearing's seat: rounding of places computed in two ways."""


def build(train: Drivetrain, apart: Mapping[str, str] | None = None) -> Mechanism:
    """Return the mechanism of a drivetrain; see :meth:`gearmbs.drivetrain.Drivetrain.build`.

    Parameters
    ----------
    train : Drivetrain
    apart : mapping of str to str, optional
        Wheels that are to be bodies of their own, by name, and how the joints are called that fix them to their shafts:
        the reaction there is the force between wheel and shaft. None of a planetary stage.
    """
    layout = train.layout
    m = Mechanism(train.name, gravity=train.gravity)
    m.rate_scale = train.rate_scale
    builder = _Builder(train, layout, m, apart or {})
    for shaft in train.shafts:
        builder.shaft(shaft)
    for housing in train.housings:
        builder.housing(housing)
    for bearing in train.bearings:
        with errors_named(bearing.label):
            builder.bearing(bearing)
    centres = roles(train.couplings, {bearing.shaft for bearing in train.bearings})
    for coupling in train.couplings:
        one, two = (train.part(n, Shaft) for n in (coupling.first, coupling.second))
        stations = coupling.stations or (one.length, 0.0)
        ends = [(shaft, layout.seats[shaft.name], z) for shaft, z in zip((two, one), stations[::-1])]
        i, j = (
            m.bodies[shaft.name].marker_at(seat.at(z), seat.axes, name=f"{coupling.name}.{end}")
            for (shaft, seat, z), end in zip(ends, "IJ")
        )
        at = Attached(m, i, j, train.speeds[two.name], train.run_up, train.running)
        with errors_named(coupling.label):
            coupling.add(at, centres.get(coupling.name, ""))
    for mesh in train.meshes:
        m.gear_contact(mesh.name, builder.wheels[mesh.driver], builder.wheels[mesh.driven], train.pairs[mesh.name])
    for stage in train.planetary_stages:
        add_stage(m, train, layout, stage)
    outer: tuple[Any, ...] = (*train.drives, *train.loads)
    for part in outer:
        with errors_named(part.label):
            part.add(builder.attached(part, "left" if part in train.drives else "right"))
    for sensor in train.sensors:
        m.outputs[sensor.name] = Output(sensor.name, partial(_text_of, train, m, sensor))
    return m


def _text_of(train: Drivetrain, m: Mechanism, sensor: Sensor) -> str:
    """Return what a sensor measures, in the mechanism's names; its markers are made where it is first asked for."""
    from gearmbs.drivetrain.plants import sensed

    return sensed(train, m, sensor).expression


class _Builder:
    """Adds parts to a mechanism, one at a time."""

    def __init__(self, train: Drivetrain, layout: Layout, m: Mechanism, apart: Mapping[str, str]) -> None:
        self.train, self.layout, self.m, self.apart = train, layout, m, apart
        self.wheels: dict[str, Marker] = {}

    def body(self, name: str) -> Body:
        """Return the body of a shaft, a housing or the ground."""
        return self.m.ground if name == "ground" else self.m.bodies[name]

    def shaft(self, shaft: Shaft) -> None:
        """Add the body of a shaft with its wheels, a marker at each wheel."""
        train, layout = self.train, self.layout
        seat = layout.seats[shaft.name]
        wheels = [wheel for wheel in train.wheels if wheel.shaft == shaft.name]
        # of a finite-element shaft they stand on it as bodies of their own
        bare = shaft.model is not None or any(wheel.name in self.apart for wheel in wheels)
        if not bare:
            self._warn_of_solid_wheels(shaft)
        spin = train.start_share * train.speeds[shaft.name] * layout.paces[shaft.name]
        where = {
            "position": seat.origin,
            "orientation": seat.axes @ turn_z(layout.angles[shaft.name]),
            "angular_velocity": spin * seat.axes[:, 2],
        }
        if not shaft.bends:
            body = self._rigid_shaft(shaft, where, bare=bare)
        else:
            known = not bare or shaft.model is not None
            model = train.modal_models[shaft.name] if known else shaft_model(train, shaft, bare=True)
            body = model.add_to(self.m, shaft.name, damping=shaft.damping, **where)
        for wheel in wheels:
            own = wheel.flexible is not None or (bare and wheel.body != IN_SHAFT)
            turned = turn_z(layout.wheels[wheel.name])
            place = body.marker((0.0, 0.0, train.station(wheel)), turned, name=f"{wheel.name}.I" if own else wheel.name)
            self.wheels[wheel.name] = self._apart(wheel, place, where["angular_velocity"]) if own else place
        if shaft.model is not None:
            self._members_apart(shaft, body, where["angular_velocity"])

    def _apart(self, wheel: Wheel, place: Marker, angular_velocity: np.ndarray) -> Marker:
        """Return the marker of a wheel that is a body of its own, fixed to its place on its shaft."""
        where: dict[str, Any] = {
            "position": place.global_position(),
            "orientation": place.global_orientation(),
            "angular_velocity": angular_velocity,
        }
        if wheel.flexible is None:
            mass, moments = wheel.weight
            marker = held = self.m.body(wheel.name, mass, moments, **where).marker(name=wheel.name)
        else:
            model = self.train.modal_models[wheel.name]
            body = model.add_to(self.m, wheel.name, damping=wheel.flexible.damping, **where)
            held = model.seat_marker(body, BORE, name=f"{wheel.name}.{BORE}")
            marker = model.seat_marker(body, RIM, name=wheel.name)
        self.m.joint("fixed", self.apart.get(wheel.name, seat_of_wheel(wheel.name)), held, place)
        return marker

    def _members_apart(self, shaft: Shaft, body: Body, angular_velocity: np.ndarray) -> None:
        """Add suns, carriers and rings on a finite-element shaft, whose masses are not in its model, fixed to it."""
        wheels = {wheel.name for wheel in self.train.wheels}
        for one in carried(self.train, shaft.name):
            if one.name not in wheels and one.mass > 0.0:
                place = body.marker((0.0, 0.0, one.station), name=f"{one.name}.I")
                held = self.m.body(
                    one.name, one.mass, one.inertia, position=place.global_position(),
                    orientation=place.global_orientation(), angular_velocity=angular_velocity,
                ).marker(name=f"{one.name}.J")  # fmt: skip
                self.m.joint("fixed", seat_of_wheel(one.name), held, place)

    def _rigid_shaft(self, shaft: Shaft, where: dict[str, Any], *, bare: bool) -> Body:
        """Return the body of a rigid shaft with its wheels, or without."""
        train = self.train
        mass, centre, polar, across = shaft.body()
        pieces = [(mass, centre, np.diag([across, across, polar]))]
        others = [] if bare else carried(train, shaft.name)
        pieces += [(one.mass, one.station, np.diag(one.inertia)) for one in others]
        total = sum(p[0] for p in pieces)
        middle = sum(p[0] * p[1] for p in pieces) / total
        inertia = sum(p[2] + p[0] * (p[1] - middle) ** 2 * np.diag([1.0, 1.0, 0.0]) for p in pieces)
        return self.m.body(shaft.name, total, inertia, com=(0.0, 0.0, middle), **where)

    def _warn_of_solid_wheels(self, shaft: Shaft) -> None:
        """Warn where wheels and the shaft through them hold much of the same material."""
        if shaft.mass is not None:
            # a mass from a drawing or a scale leaves open what is in it
            return
        train = self.train
        wheels = {w.name: (w.gear, train.station(w)) for w in train.wheels if w.shaft == shaft.name and w.body is None}
        for stage in train.planetary_stages:
            # a mass that was given leaves open what is in it
            if stage.sun == shaft.name and "sun" not in stage.masses:
                wheels[f"{stage.name} sun"] = (stage.gears.sun, stage.station(train, "sun"))
        twice = {name: self._counted_twice(shaft, *wheel) for name, wheel in wheels.items()}
        total, doubled = shaft.body()[0] + sum(gear.mass for gear, _ in wheels.values()), sum(twice.values())
        if doubled <= COUNTED_TWICE * total:
            return
        names = ", ".join(f"'{name}'" for name, mass in twice.items() if mass > 0.0)
        warn(
            f"{shaft.label}: {doubled:.4g} kg of {total:.4g} kg with its wheels ({100.0 * doubled / total:.3g} %) are "
            f"counted twice, as shaft and as wheel {names} without a bore for it; give the wheels bore_radius, the "
            "shaft's radius there, or give the shaft's own mass"
        )

    def _counted_twice(self, shaft: Shaft, gear: GearSpec, place: float) -> float:
        """Return the mass of a wheel's body at a station where its shaft is, kg."""
        half = 0.5 * gear.face_width
        found, z = 0.0, 0.0
        for length, radius in shaft.cylinders:
            width = min(z + length, place + half) - max(z, place - half)
            found += gear.mass_within(radius, max(0.0, width))
            z += length
        return found

    def housing(self, housing: Housing) -> None:
        """Add a housing on its mounts, with its modes."""
        if housing.model is not None:
            model = self.train.modal_models[housing.name]
            body: Body = model.add_to(
                self.m, housing.name, damping=housing.damping, position=housing.at, orientation=housing.turned
            )
        elif housing.modes:
            body = self._modal_housing(housing)
        else:
            assert housing.mass is not None
            assert housing.inertia is not None
            body = self.m.body(housing.name, housing.mass, housing.inertia, position=housing.at)
        if not housing.mounts:
            self.m.fixed(f"{housing.name} fixed", body, self.m.ground, at=housing.at)
        for mount in housing.mounts:
            axes = np.eye(3)
            i = body.marker_at(mount.at, axes, name=f"{mount.name}.I")
            j = self.m.ground.marker_at(mount.at, axes, name=f"{mount.name}.J")
            self.m.bushing(mount.name, i, j, stiffness=mount.stiffness, damping=mount.damping)

    def _modal_housing(self, housing: Housing) -> Body:
        places = {
            b.name: self.layout.seats[b.shaft].at(self.train.station(b)) - np.asarray(housing.at)
            for b in self.train.bearings
            if self.train.carrier(b) == housing.name
        }
        modes = [Mode(stiffness=o.stiffness, mass=o.mass, damping_ratio=o.damping_ratio) for o in housing.modes]

        def shapes(point: Any) -> tuple[np.ndarray, np.ndarray]:
            moved = np.zeros((len(modes), 3))
            for name, place in places.items():
                if np.linalg.norm(np.asarray(point) - place) < SAME_POINT:
                    for k, mode in enumerate(housing.modes):
                        moved[k] = mode.shape.get(name, (0.0, 0.0, 0.0))
            return moved, np.zeros((len(modes), 3))

        assert housing.mass is not None
        assert housing.inertia is not None
        return self.m.modal_body(housing.name, housing.mass, housing.inertia, modes, shapes, position=housing.at)

    def bearing(self, bearing: Bearing) -> None:
        """Add a bearing between a shaft and what carries it."""
        train = self.train
        seat = self.layout.seats[bearing.shaft]
        where = seat.at(train.station(bearing))
        i = self.m.bodies[bearing.shaft].marker_at(where, seat.axes, name=f"{bearing.name}.I")
        j = self.body(train.carrier(bearing)).marker_at(where, seat.axes, name=f"{bearing.name}.J")
        ideal = [b.name for b in train.bearings if b.shaft == bearing.shaft and b.kind == "ideal"]
        role = "revolute"
        if len(ideal) == 2 and bearing.name in ideal:
            role = ("spherical", "inline")[ideal.index(bearing.name)]
        sense = train.senses.get(bearing.name)
        if sense != bearing.told_sense:
            # that of its pair
            bearing = replace(bearing, sense=sense)
        bearing.add(self.m, i, j, role)

    def attached(self, part: Any, end: Any) -> Attached:
        """Return the markers of a drive or load."""
        train = self.train
        seat = self.layout.seats[part.shaft]
        where = seat.at(train.station(part, end))
        i = self.m.bodies[part.shaft].marker_at(where, seat.axes, name=f"{part.name}.I")
        j = self.body(train.carrier(part, "ground")).marker_at(where, seat.axes, name=f"{part.name}.J")
        return Attached(self.m, i, j, train.speeds[part.shaft], train.run_up, train.running)
