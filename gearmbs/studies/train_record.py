"""What the record of a drivetrain is made from, taken from the solution while it is being computed.

Harmonics of a mesh are told at the mean speed of the record. Where a motor slips, that is not the nominal speed, and
the record says so. Where the speed changes by up to `STRAY` over the record, levels that it would lower follow the
angle of the driver; where it changes more there are none.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from gearmbs.dae.results.solution import Solution
from gearmbs.drivetrain import Accelerometer, Drivetrain, Housing, Laser, Shaft, SpeedSensor, TorqueSensor, Wheel
from gearmbs.drivetrain.kinematics import RPM, KinematicTable, table_at
from gearmbs.drivetrain.members.rim import rim_meshes, told_of_mesh
from gearmbs.drivetrain.members.wheel import BORE
from gearmbs.drivetrain.planetary import Meshing, PlanetaryStage, differentials
from gearmbs.mechanism import Mechanism
from gearmbs.signals.files.simulated import held_speed
from gearmbs.wording import warn

CONTACT = {
    "normal_force": "N", "penetration_drive": "m", "penetration_back": "m", "pairs_drive": "1", "pairs_back": "1",
}  # fmt: skip
"""Quantities of a mesh that its contact tells, with units."""
TURN = 2.0 * math.pi
STRAY = 0.02
"""Difference from the nominal speed that a record remarks on, and change over a record beyond which lines move."""
FAR = 0.1
"""The same that is warned of: motors slip less than that between no load and their rated torque."""
SMEAR = 1.0
"""Largest phase, rad, by which a harmonic may stray from one frequency: it then loses 1 % of its level."""


WHOLE = 0.999
"""Turns that count as one: a record of one nominal turn differs from it by what speeds do in the run-up."""


class TrainColumns(NamedTuple):
    """What is recorded of a drivetrain at some times.

    Attributes
    ----------
    t : ndarray, shape (m,)
    contact : ndarray, shape (m, meshes, 5)
        The quantities of `CONTACT`.
    bearing_force : ndarray, shape (m, bearings + pins, 3)
        Force of the seat on the shaft, global components, N; of pins that on the planet, outwards, in the sense of
        rotation (`gearmbs.gears.PlanetarySet.sense`), and along the axis.
    sensors : ndarray, shape (m, sensors)
    turned : ndarray, shape (m, shafts + planets + stages)
        Angles about the shafts' axes, rad; within one turn until they are joined. Behind them those of what holds a
        member of each planetary stage, from its start: a housing rocks on its mounts.
    speed : ndarray, shape (m, shafts + planets + stages)
        rad/s.
    twisted : ndarray, shape (m, wheels)
        Angles of wheels, and of members of planetary stages, `on_shafts`, against their shafts that bend and twist,
        which turn on the mean; zero on rigid ones, rad.
    """

    t: np.ndarray
    contact: np.ndarray
    bearing_force: np.ndarray
    sensors: np.ndarray
    turned: np.ndarray
    speed: np.ndarray
    twisted: np.ndarray


def on_shafts(train: Drivetrain) -> dict[str, str]:
    """Return the shaft of each wheel and of each member of a planetary stage that is on one, by name."""
    out = {wheel.name: wheel.shaft for wheel in train.wheels}
    for stage in train.planetary_stages:
        out |= {f"{stage.name} {member}": shaft for member, shaft in stage.turning(train).items()}
    return out


def column_of(train: Drivetrain, mesh: Meshing, body: str, columns: np.ndarray) -> np.ndarray:
    """Return the column of `TrainColumns.turned` or ``speed`` of what carries a wheel or planets of a mesh, (m,)."""
    names = list(train.turning)
    if body in names:
        return columns[:, names.index(body)]
    if not mesh.stage:
        return np.zeros(columns.shape[0])
    return columns[:, len(names) + [stage.name for stage in train.planetary_stages].index(mesh.stage)]


def driver_angle(train: Drivetrain, known: TrainColumns, mesh: Meshing, of_speed: bool = False) -> np.ndarray:
    """Return the angle (rad) or speed (rad/s) of the driver of a mesh against what carries the axes, shape (m,)."""
    columns = known.speed if of_speed else known.turned
    one, carrier = (column_of(train, mesh, body, columns) for body in (mesh.bodies[0], mesh.carrier))
    return one - carrier


def counted_turns(t: np.ndarray, turned: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Return angles counted through full turns, shape (m, shafts), rad.

    Where teeth are apart a step of the integrator can take more than a turn: the speeds at its ends say how many.
    """
    step = np.diff(turned, axis=0)
    expected = 0.5 * (speed[1:] + speed[:-1]) * np.diff(t)[:, None]
    step += 2.0 * np.pi * np.round((expected - step) / (2.0 * np.pi))
    return np.concatenate([turned[:1], turned[:1] + np.cumsum(step, axis=0)])


def _of_an_ideal_mesh(told: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the quantities of `CONTACT` of one spring: it is a single pair, on the flank that is pressed."""
    pressed = told["normal_force"] > 0.0
    drive, back = pressed & (told["deflection"] > 0.0), pressed & (told["deflection"] < 0.0)
    size = np.abs(told["deflection"])
    return {"normal_force": told["normal_force"], "penetration_drive": np.where(drive, size, 0.0),
            "penetration_back": np.where(back, size, 0.0), "pairs_drive": drive.astype(float),
            "pairs_back": back.astype(float)}  # fmt: skip


class TrainRecorder:
    """Collects the columns of a drivetrain's record from the parts of a solution, as a consumer of `simulate`.

    Parameters
    ----------
    train : Drivetrain
    mechanism : Mechanism
        What is simulated: the train's own, or with more added.
    begin : float
        Of what is done before this time only angles are kept, s.
    """

    def __init__(self, train: Drivetrain, mechanism: Mechanism, begin: float = 0.0) -> None:
        self.train, self.mechanism, self.begin = train, mechanism, begin
        self._parts: list[TrainColumns] = []
        self._axes = {name: seat.axes for name, seat in train.layout.seats.items()}
        for planet, stage in train.planets.items():
            self._axes[planet] = self._axes[next(iter(stage.turning(train).values()))]

    def take(self, part: Solution) -> None:
        """Take the next steps of a run; before the record's beginning only the last ones."""
        if part.t[-1] >= self.begin:
            self._parts.append(self.columns(part))

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been taken yet."""
        return not self._parts

    def joined(self) -> TrainColumns:
        """Return all columns, angles counted through full turns."""
        whole = TrainColumns(*(np.concatenate(c) for c in zip(*self._parts, strict=True)))
        return whole._replace(turned=counted_turns(whole.t, whole.turned, whole.speed))

    def columns(self, part: Solution) -> TrainColumns:
        """Return what is recorded of one part of a solution."""
        train, m = self.train, part.t.size
        contact = np.empty((m, len(train.meshings), len(CONTACT)))
        on_rims = rim_meshes(train)
        for k, mesh in enumerate(train.meshings):
            told = told_of_mesh(part, *on_rims[mesh.name]) if mesh.name in on_rims else part.contact(mesh.name)
            if "deflection" in told:
                told = _of_an_ideal_mesh(told)
            contact[:, k] = np.stack([told[name] for name in CONTACT], axis=1)
        force = np.empty((m, len(train.bearings) + len(train.pins), 3))
        for k, bearing in enumerate(train.bearings):
            is_joint = bearing.name in self.mechanism.joints
            force[:, k] = (part.reaction(bearing.name) if is_joint else part.load(bearing.name))[0]
        count = len(train.turning)
        turned, speed = (
            np.zeros((m, count + len(train.planetary_stages))),
            np.zeros((m, count + len(train.planetary_stages))),
        )
        for k, body in enumerate(train.turning):
            axes = self._axes[body]
            x = part.orientation(body)[:, :, 0] @ axes[:, :2]
            turned[:, k] = np.arctan2(x[:, 1], x[:, 0])
            speed[:, k] = part.angular_velocity(body) @ axes[:, 2]
        for k, stage in enumerate(train.planetary_stages, start=count):
            turned[:, k], speed[:, k] = self._rocks(part, stage)
        twisted = np.zeros((m, len(on_shafts(train))))
        carriers = {stage.carrier_name for stage in train.planetary_stages}
        for k, (wheel, shaft) in enumerate(on_shafts(train).items()):
            if wheel in self.mechanism.bodies and wheel not in carriers:
                twisted[:, k] = self._of_a_wheel(part, wheel, bends=train.part(shaft, Shaft).bends)
            elif train.part(shaft, Shaft).bends:
                twisted[:, k] = part.deflection(wheel)[1][:, 2]
        bodies = list(train.turning)
        for k, (pin, (stage, angle)) in enumerate(train.pins.items(), start=len(train.bearings)):
            place = (
                bodies.index(stage.carrier) if stage.carrier in bodies else count + train.planetary_stages.index(stage)
            )
            at = angle + turned[:, place]
            force[:, k] = self._on_planet(part, pin, self._axes[stage.planet(1)], at)
            force[:, k, 1] *= stage.sense(train)
        sensors = np.empty((m, len(train.sensors)))
        for k, sensor in enumerate(train.sensors):
            sensors[:, k] = self._sensed(sensor, part, speed)
        return TrainColumns(part.t.copy(), contact, force, sensors, turned, speed, twisted)

    def _of_a_wheel(self, part: Solution, wheel: str, *, bends: bool) -> np.ndarray:
        """Return the angle of the teeth of a wheel that is a body of its own against its shaft, rad.

        The bore is on the shaft, and turns as its seat there does.
        """
        turned = part.deflection(f"{wheel}.I")[1][:, 2] if bends else np.zeros(part.t.size)
        on = self.train.parts.get(wheel)
        if isinstance(on, Wheel) and on.flexible is not None:
            turned = turned + (part.deflection(wheel)[1] - part.deflection(f"{wheel}.{BORE}")[1])[:, 2]
        return turned

    def _rocks(self, part: Solution, stage: PlanetaryStage) -> tuple[np.ndarray, np.ndarray]:
        """Return angle (rad) and speed (rad/s) about the axis of what holds a member of a stage, its seat included."""
        holder = next((on for on in stage.holders.values() if isinstance(self.train.parts.get(on), Housing)), None)
        if holder is None:
            return np.zeros(part.t.size), np.zeros(part.t.size)
        axes = self._axes[stage.planet(1)]
        first = self.mechanism.bodies[holder].orientation
        moved = part.orientation(holder) @ first.T @ axes[:, 0] @ axes
        angle = np.arctan2(moved[:, 1], moved[:, 0])
        if self.train.part(holder, Housing).model is not None:
            # the seat of a ring in finite elements turns against the housing's mean axes
            angle += part.deflection(f"{stage.name} ring")[1] @ (first.T @ axes[:, 2])
        return angle, part.angular_velocity(holder) @ axes[:, 2]

    def _on_planet(self, part: Solution, pin: str, axes: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Return the force of a pin on its planet: outwards, about the axis, along it."""
        held, element = self.mechanism.joints.get(pin), self.mechanism.elements.get(pin)
        if held is None and element is None:
            # springs without stiffness
            return np.zeros((part.t.size, 3))
        force = (part.load(pin) if held is None else part.reaction(pin))[0] @ axes
        between = held or element
        assert between is not None
        # a rolling bearing's first ring is on the pin
        force *= 1.0 if between.i.body.name == pin.removesuffix(" pin") else -1.0
        c, s = np.cos(angle), np.sin(angle)
        return np.column_stack([c * force[:, 0] + s * force[:, 1], c * force[:, 1] - s * force[:, 0], force[:, 2]])

    def _sensed(self, sensor: object, part: Solution, speed: np.ndarray) -> np.ndarray:
        train = self.train
        if isinstance(sensor, SpeedSensor):
            return speed[:, list(train.turning).index(sensor.shaft)]
        if self._deforms(sensor):
            return part.output(sensor.name)  # type: ignore[attr-defined]
        if isinstance(sensor, Laser):
            return self._laser(sensor, part)
        if isinstance(sensor, Accelerometer):
            return self._accelerometer(sensor, part)
        assert isinstance(sensor, TorqueSensor)
        of = sensor.of
        moment = (part.reaction(of) if of in self.mechanism.joints else part.load(of))[1]
        source = train.parts[of]
        shaft = getattr(source, "shaft", None) or source.second  # type: ignore[attr-defined]
        return moment @ self._axes[shaft][:, 2]

    def _deforms(self, sensor: object) -> bool:
        """Return whether what a sensor looks at bends by shapes that its body knows."""
        if isinstance(sensor, Laser):
            return self.train.part(sensor.shaft, Shaft).bends
        if isinstance(sensor, Accelerometer):
            bearing = next(b for b in self.train.bearings if b.name == sensor.bearing)
            return self.train.part(self.train.carrier(bearing), Housing).model is not None
        return False

    def _laser(self, sensor: Laser, part: Solution) -> np.ndarray:
        """Return (v + w x r) . d at a spot fixed in space: at rest on the axis or beside it."""
        seat = self.train.layout.seats[sensor.shaft]
        d = np.asarray(sensor.direction, dtype=float)
        d = d / np.linalg.norm(d)
        across = np.cross(seat.axes[:, 2], d)
        spot = seat.at(self.train.station(sensor)) + sensor.offset * across
        arm = spot - part.com_position(sensor.shaft)
        return (part.com_velocity(sensor.shaft) + np.cross(part.angular_velocity(sensor.shaft), arm)) @ d

    def _accelerometer(self, sensor: Accelerometer, part: Solution) -> np.ndarray:
        """Return the acceleration of a bearing's seat on its housing along a direction that moves with the housing."""
        train = self.train
        bearing = next(b for b in train.bearings if b.name == sensor.bearing)
        housing = train.carrier(bearing)
        body = self.mechanism.bodies[housing]
        place = train.layout.seats[bearing.shaft].at(train.station(bearing))
        turned = part.orientation(housing)
        d = np.asarray(sensor.direction, dtype=float)
        d = d / np.linalg.norm(d)
        d = turned @ (body.orientation.T @ d)
        start = body.position + body.orientation @ body.com
        arm = turned @ (body.orientation.T @ (place - start))
        w, alpha = part.angular_velocity(housing), part.angular_acceleration(housing)
        a = part.com_acceleration(housing) + np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))
        shape = self._modal_shape(housing, bearing.name)
        if shape is not None:
            # in the floating frame: a_f + 2 w x v_f
            _, v, qa = part.evaluated.modal(part.system.body_names.index(housing) + 1)
            moved = turned @ body.orientation.T
            rate, second = (np.einsum("tij,tj->ti", moved, x @ shape) for x in (v, qa))
            a = a + second + 2.0 * np.cross(w, rate)
        return np.sum(a * d, axis=1)

    def _modal_shape(self, housing: str, bearing: str) -> np.ndarray | None:
        part = self.train.parts[housing]
        modes = getattr(part, "modes", ())
        if not modes:
            return None
        return np.array([mode.shape.get(bearing, (0.0, 0.0, 0.0)) for mode in modes], dtype=float)


# Whether the meshes turn at steady speeds, near the nominal ones.


class HeldSpeed(NamedTuple):
    """How the driver of a mesh turns over a record.

    Attributes
    ----------
    driver : str
        What messages call it.
    nominal, mean : float
        Speeds about its axis, of a planetary stage against the carrier, rad/s.
    change : float
        Of the speed from the beginning to the end of the record, rad/s: twice the difference of the means of both
        halves, weighted by a Hann window so that oscillations hardly count.
    """

    driver: str
    nominal: float
    mean: float
    change: float

    @property
    def is_steady(self) -> bool:
        """Whether there is one mesh frequency: the speed keeps its value, in the sense of the nominal one."""
        return self.nominal == 0.0 or (self.mean * self.nominal > 0.0 and abs(self.change) <= STRAY * abs(self.mean))

    @property
    def stray(self) -> float:
        """Difference from the nominal speed over that."""
        return self.mean / self.nominal - 1.0 if self.nominal else 0.0

    def smears(self, cycles: float) -> bool:
        """Return whether the change of speed lowers a line of so many cycles in the record.

        With f = f_0 (1 + c (t/T - 1/2)) the phase strays by up to pi/4 c f_0 T from that of f_0.
        """
        return 0.25 * math.pi * abs(self.change / self.mean) * cycles > SMEAR


def _turns_as(mesh: Meshing) -> str:
    """Return what messages call the driver of a mesh."""
    return f"shaft '{mesh.bodies[0]}'" if not mesh.stage else f"'{mesh.bodies[0]}' against carrier '{mesh.carrier}'"


def held_speeds(train: Drivetrain, record: xr.Dataset) -> dict[str, HeldSpeed]:
    """Return how the driver of each mesh turns over a record, by mesh."""
    out = {}
    for mesh in train.meshings:
        speed = np.zeros(record.sizes["time"])
        for body, sign in ((mesh.bodies[0], 1.0), (mesh.carrier, -1.0)):
            if body in train.turning:
                speed = speed + sign * record["speed"].sel(shaft=body).values
        weight = np.hanning(speed.size // 2 + 2)[1:-1]
        first = float(weight @ speed[: weight.size] / weight.sum())
        last = float(weight @ speed[-weight.size :] / weight.sum())
        mean = float(speed.mean())
        nominal = train.against_carrier(mesh)
        out[mesh.name] = HeldSpeed(_turns_as(mesh), nominal, mean, 2.0 * (last - first))
    return out


def by_angle(signals: np.ndarray, cycles: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return signals at even steps of the angle of a mesh.

    Parameters
    ----------
    signals : ndarray, shape (m, signals)
    cycles : ndarray, shape (m,)
        Mesh cycles at the same samples, from 0.

    Returns
    -------
    even : ndarray, shape (m, signals)
    rate : float
        Samples a cycle.
    fundamental : float
        1: the mesh frequency in cycles a cycle.
    """
    from scipy.interpolate import make_interp_spline

    # where teeth hammer the wheel may turn back within a cycle; of that a mesh harmonic knows nothing
    places = np.maximum.accumulate(cycles)
    even = np.linspace(0.0, places[-1], places.size)
    samples = np.arange(places.size, dtype=float)
    at = np.interp(even, places, samples)
    return make_interp_spline(samples, signals, k=3)(at), (places.size - 1) / places[-1], 1.0


def remarks(held: dict[str, HeldSpeed]) -> list[str]:
    """Return what a record says of its speeds: of each mesh whose speed is not steady or not the nominal one."""
    out = []
    for mesh, one in held.items():
        mean, nominal = one.mean * RPM, one.nominal * RPM
        both = f"{one.driver} turns at {mean:.5g} rpm in the mean, nominal are {nominal:.5g} rpm"
        if not one.is_steady:
            change = abs(one.change) * RPM
            out.append(
                f"mesh '{mesh}': {both}, and its speed is not steady (it changes by about {change:.3g} rpm over the "
                "record): there are no levels of mesh harmonics"
            )
        elif abs(one.stray) > STRAY:
            out.append(f"mesh '{mesh}': {both}: levels are at the mesh frequency of the mean speed")
    return out


def speed_attributes(held: dict[str, HeldSpeed], others: list[str]) -> dict[str, Any]:
    """Return what a record says of its speeds, and other remarks, as attributes."""
    return {
        "speed_is_steady": int(all(one.is_steady for one in held.values())),
        "remarks": "; ".join([*remarks(held), *others]) or "none",
    }


def recorded_table(train: Drivetrain, record: xr.Dataset) -> tuple[KinematicTable, float]:
    """Return a kinematic table and the factor that puts its lines where the speeds of a record do.

    All shafts slip alike, but for those of a planetary stage without a held member: each has its own.
    """
    if differentials(train):
        shafts = [shaft.name for shaft in train.shafts]
        means = record["speed"].sel(shaft=shafts).mean("time").values
        return table_at(train, dict(zip(shafts, means.tolist()))), 1.0
    return train.kinematics, held_speed(record)


def sidebands(planets: int) -> np.ndarray:
    """Return the turns of the carrier beside a mesh harmonic at which planets shake what does not turn with them.

    A force that is f_m in the carrier's frame is f_m +- f_c across the axis in one that stands, where planets in other
    phases leave little at f_m itself; as they pass a place, up to f_m +- N f_c.
    """
    return np.arange(-planets, planets + 1)


def carrier_turns(train: Drivetrain, known: TrainColumns, mesh: Meshing, start: float, stop: float) -> float | None:
    """Return the turns of the carrier of planets between two times; None of other meshes, and where it is held."""
    if train.turning.get(mesh.carrier, 0.0) == 0.0:
        return None
    angle = np.interp([start, stop], known.t, column_of(train, mesh, mesh.carrier, known.turned))
    return float(abs(angle[1] - angle[0])) / TURN


def unresolved(train: Drivetrain, known: TrainColumns, start: float, stop: float) -> list[str]:
    """Return what a record says of stages whose carriers do not make a whole turn in it."""
    out = []
    for stage in train.planetary_stages:
        mesh = next(one for one in train.meshings if one.stage == stage.name)
        turns = carrier_turns(train, known, mesh, start, stop)
        if turns is not None and turns < WHOLE:
            out.append(
                f"stage '{stage.name}': its carrier makes {turns:.3g} turns in the record, which does not resolve mesh "
                "harmonics of shafts and housings, that lie beside those of the meshes by turns of the carrier; one "
                f"turn takes {TURN / abs(train.speeds[stage.carrier]):.4g} s"
            )
    return out


def warn_of_speeds(train: Drivetrain, held: dict[str, HeldSpeed]) -> None:
    """Warn of speeds that are not steady, or far from the nominal ones.

    Warns
    -----
    UserWarning
        With the mesh, both speeds and the remedy.
    """
    doubtful = {mesh: one for mesh, one in held.items() if not one.is_steady or abs(one.stray) > FAR}
    for remark in remarks(doubtful):
        warn(
            f"drivetrain '{train.name}': {remark}; give a drive that carries the load at its speed, longer "
            "run.settling, or a SpeedDrive with curve for a run-up",
        )
