"""From a drivetrain to an ordinary mechanism."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.drivetrain.attached import Attached
from gearmbs.drivetrain.bearings import Bearing
from gearmbs.drivetrain.errors import told_of
from gearmbs.drivetrain.parts import Housing, Shaft, Wheel, turn_z
from gearmbs.drivetrain.placement import Layout
from gearmbs.gears.spec import COUNTED_TWICE
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.modal import Mode
from gearmbs.mechanism.parts import Body, Marker

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain

SAME_POINT = 1e-9


def build(train: Drivetrain) -> Mechanism:
    """Return the mechanism of a drivetrain; see :meth:`gearmbs.drivetrain.Drivetrain.build`."""
    layout = train.layout
    m = Mechanism(train.name, gravity=train.gravity)
    builder = _Builder(train, layout, m)
    for shaft in train.shafts:
        builder.shaft(shaft)
    for housing in train.housings:
        builder.housing(housing)
    for bearing in train.bearings:
        with told_of(bearing.label):
            builder.bearing(bearing)
    for coupling in train.couplings:
        one, two = (train.part(n, Shaft) for n in (coupling.first, coupling.second))
        stations = coupling.stations or (one.length, 0.0)
        frame = layout.seats[one.name]
        where, axes = frame.at(stations[0]), frame.axes
        i = m.bodies[two.name].marker_at(where, axes, name=f"{coupling.name}.I")
        j = m.bodies[one.name].marker_at(where, axes, name=f"{coupling.name}.J")
        with told_of(coupling.label):
            coupling.add(Attached(m, i, j, train.speeds[two.name], train.run_up, train.running))
    for mesh in train.meshes:
        m.gear_contact(mesh.name, builder.wheels[mesh.driver], builder.wheels[mesh.driven], train.pairs[mesh.name])
    ends: tuple[Any, ...] = (*train.drives, *train.loads)
    for part in ends:
        with told_of(part.label):
            part.add(builder.attached(part, "left" if part in train.drives else "right"))
    return m


class _Builder:
    """Adds parts to a mechanism, one at a time."""

    def __init__(self, train: Drivetrain, layout: Layout, m: Mechanism) -> None:
        self.train, self.layout, self.m = train, layout, m
        self.wheels: dict[str, Marker] = {}

    def body(self, name: str) -> Body:
        """Return the body of a shaft, a housing or the ground."""
        return self.m.ground if name == "ground" else self.m.bodies[name]

    def shaft(self, shaft: Shaft) -> None:
        """Add the body of a shaft with its wheels, a marker at each wheel."""
        train, layout = self.train, self.layout
        seat = layout.seats[shaft.name]
        self._warn_of_solid_wheels(shaft)
        mass, centre, polar, across = shaft.body()
        pieces = [(mass, centre, np.diag([across, across, polar]))]
        for wheel in train.wheels:
            if wheel.shaft == shaft.name:
                pieces.append((wheel.gear.mass, train.station(wheel), np.diag(wheel.gear.inertia)))
        total = sum(p[0] for p in pieces)
        middle = sum(p[0] * p[1] for p in pieces) / total
        inertia = sum(p[2] + p[0] * (p[1] - middle) ** 2 * np.diag([1.0, 1.0, 0.0]) for p in pieces)
        spin = train.start_share * train.speeds[shaft.name]
        body = self.m.body(
            shaft.name, total, inertia, com=(0.0, 0.0, middle), position=seat.origin,
            orientation=seat.axes @ turn_z(layout.angles[shaft.name]), angular_velocity=spin * seat.axes[:, 2],
        )  # fmt: skip
        for wheel in train.wheels:
            if wheel.shaft == shaft.name:
                turned = turn_z(layout.wheels[wheel.name])
                self.wheels[wheel.name] = body.marker((0.0, 0.0, train.station(wheel)), turned, name=wheel.name)

    def _warn_of_solid_wheels(self, shaft: Shaft, stacklevel: int = 5) -> None:
        """Warn where wheels and the shaft through them hold much of the same material."""
        if shaft.mass is not None:
            # a mass from a drawing or a scale leaves open what is in it
            return
        wheels = [wheel for wheel in self.train.wheels if wheel.shaft == shaft.name]
        twice = {wheel.name: self._counted_twice(shaft, wheel) for wheel in wheels}
        total, doubled = shaft.body()[0] + sum(wheel.gear.mass for wheel in wheels), sum(twice.values())
        if doubled <= COUNTED_TWICE * total:
            return
        names = ", ".join(f"'{name}'" for name, mass in twice.items() if mass > 0.0)
        warnings.warn(
            f"{shaft.label}: {doubled:.4g} kg of {total:.4g} kg with its wheels ({100.0 * doubled / total:.3g} %) are "
            f"counted twice, as shaft and as wheel {names} without a bore for it; give the wheels bore_radius, the "
            "shaft's radius there, or give the shaft's own mass",
            stacklevel=stacklevel,
        )

    def _counted_twice(self, shaft: Shaft, wheel: Wheel) -> float:
        """Return the mass of a wheel's body where its shaft is, kg."""
        half, place = 0.5 * wheel.gear.face_width, self.train.station(wheel)
        found, z = 0.0, 0.0
        for length, radius in shaft.cylinders:
            width = min(z + length, place + half) - max(z, place - half)
            found += wheel.gear.mass_within(radius, max(0.0, width))
            z += length
        return found

    def housing(self, housing: Housing) -> None:
        """Add a housing on its mounts, with its modes."""
        if housing.modes:
            body = self._modal_housing(housing)
        else:
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
        bearing.add(self.m, i, j, role)

    def attached(self, part: Any, end: Any) -> Attached:
        """Return the markers of a drive or load."""
        train = self.train
        seat = self.layout.seats[part.shaft]
        where = seat.at(train.station(part, end))
        i = self.m.bodies[part.shaft].marker_at(where, seat.axes, name=f"{part.name}.I")
        j = self.body(train.carrier(part, "ground")).marker_at(where, seat.axes, name=f"{part.name}.J")
        return Attached(self.m, i, j, train.speeds[part.shaft], train.run_up, train.running)
