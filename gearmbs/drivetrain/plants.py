"""A drivetrain under load: where its modes and linear plants are taken, and their inputs and outputs by its names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.drivetrain.drives import Drive, SpeedDrive, TorqueDrive
from gearmbs.drivetrain.loads import Load, TorqueLoad
from gearmbs.drivetrain.part import DrivetrainError
from gearmbs.drivetrain.parts import Accelerometer, Laser, Sensor, SpeedSensor, TorqueSensor
from gearmbs.drivetrain.planetary import standing
from gearmbs.drivetrain.shaft import Shaft
from gearmbs.gears.mesh import FlankFriction
from gearmbs.mechanism.parts.functions import as_function, constant
from gearmbs.mechanism.parts.inputs import Input
from gearmbs.mechanism.solve.analyses import static_equilibrium
from gearmbs.mechanism.solve.carriers import count_from_here, own_marker
from gearmbs.mechanism.solve.plant_names import Given, Told
from gearmbs.mechanism.solve.plants import linearize as linear_plant
from gearmbs.mechanism.solve.points import point_of
from gearmbs.wording import did_you_mean

if TYPE_CHECKING:
    from gearmbs.drivetrain.drivetrain import Drivetrain
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.bodies import Body, Marker
    from gearmbs.mechanism.solve.plants import LinearPlant


ITERATIONS = 600
"""Most iterations on the way to a position of rest: bodies that are light beside the heaviest, as a turbine's generator
beside its rotor with their weight, come to rest after up to 240."""


def resting(train: Drivetrain) -> Drivetrain:
    """Return a drivetrain at rest under the loads of its operating point, without friction, its drives holding it."""
    drives = [
        SpeedDrive(name=drive.name, shaft=drive.shaft, speed=drive.speed, station=drive.station, on=drive.on,
                   function=constant(0.0))
        for drive in train.drives
    ]  # fmt: skip
    loads = [
        TorqueLoad(name=load.name, shaft=load.shaft, station=load.station, on=load.on,
                   torque=_own_input(load) or load.nominal(abs(train.speeds[load.shaft])))
        for load in train.loads
    ]  # fmt: skip
    # flanks that rest on each other would stick
    meshes = [replace(mesh, settings={**mesh.settings, "friction": False}) for mesh in train.meshes]
    stages = [
        replace(stage, gears=replace(stage.gears, friction=FlankFriction.none())) for stage in train.planetary_stages
    ]
    return train.of_same_bodies(drives=drives, loads=loads, meshes=meshes, planetary_stages=stages, running=False)


def _own_input(part: Drive | Load) -> Input | None:
    """Return the input that is the torque of a drive or load, None of others."""
    torque = part.torque if isinstance(part, TorqueDrive | TorqueLoad) else None
    return torque if isinstance(torque, Input) else None


def loaded(train: Drivetrain, speed: float = 0.0) -> tuple[Mechanism, float]:
    """Return the mechanism of a drivetrain at rest under the torques of its operating point, and a time at which.

    Shafts of prescribed speed are held; other drives hold the train while it comes to rest, and then give way to the
    torque they held it with. Torques that are inputs stay inputs, at the values they have until they are set.

    Parameters
    ----------
    train : Drivetrain
    speed : float
        Of the first drive, rad/s, its sense left out: all bodies turn as they do then, in the same position.

    Raises
    ------
    ModelError
        If no position of rest is found.
    """
    still = resting(train)
    m = still.build()
    count_from_here(m)
    after = 2.0 * still.run_up
    rest = static_equilibrium(m, t=after, move=True, max_iterations=ITERATIONS)
    for drive in train.drives:
        if not isinstance(drive, SpeedDrive):
            held = m.joints.pop(drive.name)
            torque = float(rest.solution.reaction(drive.name)[1][-1] @ held.j.global_orientation()[:, 2])
            if (own := _own_input(drive)) is None:
                m.axis_torque(drive.name, held.i, held.j, torque)
            else:
                # the torque held is that at the input's value; it acts about the sense of rotation
                m.inputs.setdefault(own.name, own)
                sense = math.copysign(1.0, drive.speed)
                text = f'({torque!r}) + ({sense!r})*("{own.name}" - ({own.start!r}))'
                m.axis_torque(drive.name, held.i, held.j, text)
    if speed:
        _turn(still, m, abs(speed / train.drives[0].speed), after)
    return m, after


def _turn(train: Drivetrain, m: Mechanism, share: float, time: float) -> None:
    """Let the bodies of a mechanism turn at a part of their operating speeds, from where they are at a time, s."""
    for name, speed in train.speeds.items():
        _spin(m.bodies[name], share * speed)
        # what stands on it as a body of its own
        for one in standing(train, name):
            if one.name in m.bodies:
                _spin(m.bodies[one.name], share * speed)
    for stage in train.planetary_stages:
        speeds = stage.speeds(train)
        member, shaft = next(iter(stage.turning(train).items()))
        seat = train.layout.seats[shaft]
        middle, around = seat.at(stage.station(train, member)), share * speeds["carrier"] * seat.axes[:, 2]
        if stage.carrier_name in m.bodies:
            _spin(m.bodies[stage.carrier_name], share * speeds["carrier"])
        for number in range(1, stage.gears.planets + 1):
            planet = m.bodies[stage.planet(number)]
            _spin(planet, share * speeds["planet"])
            planet.velocity = np.cross(around, planet.position - middle)
    for drive in train.drives:
        joint = m.joints.get(drive.name)
        if joint is not None:
            turned = as_function(f"{share * drive.speed!r}*(TIME - {time!r})", "rad", drive.label)
            joint.rows[:] = [replace(row, rotation=turned) for row in joint.rows]


def _spin(body: Body, speed: float) -> None:
    """Let a body turn about its own z axis, rad/s."""
    body.angular_velocity = speed * body.orientation[:, 2]


def linearize(
    train: Drivetrain, inputs: Sequence[Any], outputs: Sequence[Any], at: Any = "loaded", t: float | None = None
) -> LinearPlant:
    """Return the linear plant of a drivetrain; see :meth:`gearmbs.drivetrain.Drivetrain.linearize`."""
    if isinstance(at, str) and at == "loaded":
        _check_references(train, inputs)
        m, after = loaded(train)
        at, t = "initial", after if t is None else t
    else:
        m = train.build()
    # before inputs and outputs add markers to the mechanism that a state is one of
    point = point_of(m, at, t)
    named = [_input(train, m, item) for item in inputs]
    return linear_plant(m, named, [_output(train, m, item) for item in outputs], at=point)


def _check_references(train: Drivetrain, inputs: Sequence[Any]) -> None:
    """Raise a DrivetrainError for the speed that a drive is asked for: at rest under load drives hold their torques."""
    for drive in train.drives:
        name = getattr(getattr(drive, "reference", None), "name", None)
        if name is not None and any(getattr(item, "name", item) == name for item in inputs):
            raise DrivetrainError(
                f"input {name!r}: at='loaded' {drive.label} holds its torque or rests, whatever speed it is asked for; "
                "take at='initial', a state or a solution"
            )


def _input(train: Drivetrain, m: Mechanism, item: Any) -> Any:
    """Return an input in the names of the mechanism: the torque on a shaft is one about its own axis."""
    if not (isinstance(item, tuple | list) and len(item) == 2 and item[0] == "torque"):
        return item
    shaft = train.parts.get(item[1])
    if not isinstance(shaft, Shaft):
        return item
    seat = train.layout.seats[shaft.name]
    where = seat.origin, seat.axes
    i = _marker(m.bodies[shaft.name], f"{shaft.name} plant shaft", *where)
    j = _marker(m.ground, f"{shaft.name} plant axis", *where)
    return Given("torque", f"torque {shaft.name}", "N m", base="N m", i=i, j=j)


def _output(train: Drivetrain, m: Mechanism, item: Any) -> Any:
    """Return an output in the names of the mechanism: that of a sensor, or the speed or angle of a shaft."""
    if isinstance(item, str):
        sensor = train.parts.get(item)
        return sensed(train, m, sensor) if isinstance(sensor, Sensor) else item
    if isinstance(item, tuple | list) and len(item) == 2 and item[0] in ("speed", "angle"):
        shaft = train.part(item[1], Shaft, f"output {tuple(item)!r}")
        function, unit = ("WZ", "rad/s") if item[0] == "speed" else ("AZ", "rad")
        return Told(f"{item[0]} {shaft.name}", unit, _about_axis(train, m, shaft.name, function))
    return item


def _about_axis(train: Drivetrain, m: Mechanism, shaft: str, function: str) -> str:
    """Return the speed or the angle of a shaft about its own axis."""
    seat = train.layout.seats[shaft]
    i = _marker(m.bodies[shaft], f"{shaft} plant shaft", seat.origin, seat.axes).name
    j = _marker(m.ground, f"{shaft} plant axis", seat.origin, seat.axes).name
    return f'WZ("{i}", "{j}", "{j}")' if function == "WZ" else f'AZ("{i}", "{j}")'


def _marker(body: Body, name: str, place: np.ndarray, axes: np.ndarray) -> Marker:
    """Return a marker of a body at a global place, made once."""
    return own_marker(body, name, body.marker_at, place, axes)


def sensed(train: Drivetrain, m: Mechanism, sensor: Sensor) -> Told:
    """Return what a sensor measures, along directions at rest."""
    if isinstance(sensor, SpeedSensor):
        text = _about_axis(train, m, sensor.shaft, "WZ")
    elif isinstance(sensor, TorqueSensor):
        element = m.elements.get(sensor.of)
        joint = m.joints.get(sensor.of)
        between = element if element is not None else joint
        if between is None:
            there = [*m.joints, *m.elements]
            raise DrivetrainError(f"{sensor.label}: nothing is called {sensor.of!r}; {did_you_mean(sensor.of, there)}")
        text = f'TZ("{between.i.name}", "{between.j.name}", "{between.j.name}")'
    elif isinstance(sensor, Laser):
        seat, body = train.layout.seats[sensor.shaft], m.bodies[sensor.shaft]
        d = np.asarray(sensor.direction, dtype=float) / np.linalg.norm(sensor.direction)
        place = seat.at(train.station(sensor))
        at = _marker(body, f"{sensor.name} plant spot", place, np.eye(3))
        # the spot is fixed in space: (v + omega x arm) . d = v . d + omega . (arm x d)
        turned = np.cross(sensor.offset * np.cross(seat.axes[:, 2], d), d)
        text = " + ".join(
            f'({float(v)!r})*V{c}("{at.name}") + ({float(w)!r})*W{c}("{at.name}")'
            for c, v, w in zip("XYZ", d, turned, strict=True)
        )
    else:
        assert isinstance(sensor, Accelerometer)
        bearing = next(one for one in train.bearings if one.name == sensor.bearing)
        place = train.layout.seats[bearing.shaft].at(train.station(bearing))
        d = np.asarray(sensor.direction, dtype=float) / np.linalg.norm(sensor.direction)
        at = _marker(m.bodies[train.carrier(bearing)], f"{sensor.name} plant seat", place, np.eye(3))
        text = " + ".join(f'({float(v)!r})*ACC{c}("{at.name}", 0, "{at.name}")' for c, v in zip("XYZ", d, strict=True))
    return Told(sensor.name, sensor.unit, text)
