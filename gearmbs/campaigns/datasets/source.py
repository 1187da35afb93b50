"""Where a campaign has what a data set takes: individuals, states, sensors, and how the driver's shaft turns."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.plans.factors import Choice, Factor
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.subjects.pair import PairSubject
from gearmbs.campaigns.subjects.tables import DrivetrainSubject

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gearmbs.campaigns.campaign import Campaign
    from gearmbs.campaigns.plans.plan import Plan
    from gearmbs.drivetrain import Drivetrain

NEEDED = (
    "a data set needs Specimens, a choice named state, choose(..., crossed=True, name='state'), and signals of "
    "accelerations to keep"
)


@dataclass(frozen=True)
class Source:
    """Where a campaign has what a data set takes.

    Attributes
    ----------
    name : str
        Of the gearbox.
    group : str
        Column of the individuals.
    places : list of (str, int)
        Array and channel of each accelerometer.
    speed : str or None
        Array of the speed sensor.
    rate : float
        Sampling rate of the accelerometers, Hz.
    mesh : str
        With the faults; "" for a pair.
    """

    name: str
    group: str
    places: list[tuple[str, int]]
    speed: str | None
    rate: float
    mesh: str


@dataclass(frozen=True)
class Rotation:
    """How the shaft of the driver turns at an operating point.

    Attributes
    ----------
    speed, torque : float
        Asked of the drive and of the load, rad/s and N m; NaN where they are no numbers.
    nominal : float
        Speed of the driver's shaft about its own axis, rad/s, with its sign.
    teeth : tuple of int
        Driver and driven.
    ratio : float
        Speed of the driver's shaft over that of the shaft that the speed sensor is at.
    begin : float
        Time of the simulation at which the record begins, s.
    angle : callable or None
        Angle that the driver's shaft has turned since the start, rad, at a time of the simulation, s; None where it is
        not known and the shaft turns at its nominal speed from the start.
    """

    speed: float
    torque: float
    nominal: float
    teeth: tuple[int, int]
    ratio: float
    begin: float
    angle: Callable[[float], float] | None

    def turned(self, times: np.ndarray) -> np.ndarray:
        """Return the angle since the start at times of the record, rad, shape of ``times`` (s)."""
        at = self.begin + times
        if self.angle is None:
            return self.nominal * at
        return np.array([self.angle(float(t)) for t in at])


def states(plan: Plan) -> Choice | None:
    """Return the choice of the states."""
    return next((f for f in plan.factors if isinstance(f, Choice) and f.name == "state"), None)


def check_states(plan: Plan, what: str) -> Choice:
    """Return the choice of the states of a plan that has all that a data set needs.

    Raises
    ------
    CampaignError
        If it has no specimens or states, or not every state at each point: the level of the noise is that of all
        states of a point, and would tell them.
    """
    choice = states(plan)
    if plan.group is None or choice is None:
        raise CampaignError(f"{what}: {NEEDED}")
    if not choice.crossed:
        raise CampaignError(
            f"{what}: the choice named state is not crossed, so that noise by the level of a point would tell the "
            "state; make it Choice(..., crossed=True, name='state')"
        )
    return choice


def source_of(campaign: Campaign) -> Source:
    """Return where a campaign has what a data set takes.

    Raises
    ------
    CampaignError
        If it is not done, or lacks something of it.
    """
    plan, specs = campaign.plan, campaign.folder.specs
    choice = check_states(plan, str(campaign.path))
    places = [(spec.name, c) for spec in specs if spec.units == "m/s^2" for c in range(len(spec.channels))]
    if not places:
        raise CampaignError(f"{campaign.path}: {NEEDED}")
    rates = {name: next(spec.rate for spec in specs if spec.name == name) for name, _ in places}
    if not campaign.status().complete:
        raise CampaignError(f"data set: {campaign.status()}; run the campaign to its end first")
    kind, _, mesh = choice.path.removesuffix(".faults").partition(".")
    mesh = mesh if kind == "meshes" and isinstance(plan.subject, DrivetrainSubject) else ""
    speeds = [spec.name for spec in specs if spec.units == "rad/s"]
    speed = speeds[0] if speeds else None
    name = "pair"
    if mesh:
        name, train = str(plan.subject.base().get("name", campaign.path.stem)), campaign.case(0).train
        speed = _best_sensor(train, mesh, speeds)
        rotation_of(plan, campaign.case(0), mesh, speed, name)
    assert plan.group is not None
    return Source(name, plan.group, places, speed, rates[places[0][0]], mesh)


def rotation_of(plan: Plan, thing: Any, mesh: str, sensor: str | None, name: str) -> Rotation:
    """Return how the shaft of the driver of a case turns.

    Parameters
    ----------
    plan : Plan
    thing : object
        The case, as its subject makes it.
    mesh : str
        With the faults; "" for a pair.
    sensor : str or None
        The speed sensor.
    name : str
        Of the gearbox, for messages.

    Raises
    ------
    CampaignError
        If a sensor's shaft has no fixed ratio to the driver's, or nothing says how the shaft has turned until the
        record begins.
    """
    if mesh:
        return _of_train(plan, thing, mesh, sensor, name)
    if isinstance(plan.subject, PairSubject):
        operation = thing.operation
        begin = operation.run_up + operation.settling
        speed, torque = (x if isinstance(x, float) else np.nan for x in (operation.speed, operation.torque))
        return Rotation(speed, torque, operation.top_speed, tuple(thing.gears.teeth), 1.0, begin, thing.driver_angle)
    # somebody's own subject: its records begin where it turns at full speed
    try:
        given, teeth = thing["operation"], thing["gears"]["teeth"]
        speed, torque, pair = float(given["speed"]), float(given["torque"]), (int(teeth[0]), int(teeth[1]))
    except (KeyError, TypeError, ValueError, IndexError):
        raise CampaignError(
            f"data set: cases of the kind {plan.subject.kind} do not say how a gear turns; take the gear pair or a "
            "drivetrain whose state is a mesh's faults, or give them operation.speed (rad/s), operation.torque and "
            "gears.teeth"
        ) from None
    return Rotation(speed, torque, speed, pair, 1.0, 0.0, None)


def _of_train(plan: Plan, thing: Any, mesh: str, sensor: str | None, name: str) -> Rotation:
    from gearmbs.drivetrain.drives import SpeedDrive
    from gearmbs.drivetrain.part import fixed_value

    train = thing.train
    wheels = train.wheels_of(mesh)
    shaft = wheels[0].shaft
    ratio = 1.0
    if sensor is not None:
        found = sensor_ratio(train, shaft, train.part(sensor).shaft)
        if found is None:
            raise CampaignError(
                f"gearbox {name}: speed sensor {sensor!r} is at shaft {train.part(sensor).shaft!r}, whose speed has no "
                f"fixed ratio to that of {shaft!r}, the driver's of mesh {mesh!r}; put the sensor there"
            )
        ratio = found
    angle: Callable[[float], float] | None = None
    for drive in train.drives:
        share = sensor_ratio(train, shaft, drive.shaft)
        if isinstance(drive, SpeedDrive) and share is not None:
            prescribed = drive.turned(train.speeds[drive.shaft], train.run_up, train.running)
            # one that is compiled with the mechanism cannot be asked
            angle = None if prescribed.is_expression else _since_start(prescribed, share)
            break
    if angle is None and not train.running:
        raise CampaignError(
            f"gearbox {name}: it starts from rest by drives of torque, so that nothing tells the angle at which its "
            "records begin, nor the place of the tacho's mark; give the file running = true, or a drive of the "
            "kind 'speed'"
        )
    asked = _varied(plan, "drives", "speed")
    drive = next((part for part in train.drives if asked in (None, part.name)), None)
    load = next((part for part in train.loads if part.name == _varied(plan, "loads", "torque")), None)
    loads = train.loads if load is None else (load,)
    torques = [fixed_value(part.torque, "torque") for part in loads if hasattr(part, "torque")]
    torque = next((float(value) for value in torques if value is not None), np.nan)
    return Rotation(
        float(train.speeds[shaft] if drive is None else drive.speed),
        torque,
        float(train.speeds[shaft]),
        (int(wheels[0].gear.teeth), int(wheels[1].gear.teeth)),
        ratio,
        float(train.run_up + thing.run.settling),
        angle,
    )


def _since_start(prescribed: Callable[[float], float], share: float) -> Callable[[float], float]:
    first = prescribed(0.0)
    return lambda t: share * (prescribed(t) - first)


def _varied(plan: Plan, table: str, entry: str) -> str | None:
    """Return the name of the drive or load of which a factor varies an entry."""
    paths = [factor.path for factor in plan.factors if isinstance(factor, Factor)]
    found = (re.fullmatch(rf"{table}\.(.+)\.{entry}", path) for path in paths)
    return next((match[1] for match in found if match), None)


def sensor_ratio(train: Drivetrain, shaft: str, other: str) -> float | None:
    """Return the speed of one shaft over that of another that meshes and couplings tie to it; None without such."""
    from gearmbs.drivetrain.kinematics import walk

    speeds = {other: 1.0}
    for link, new in walk(train, other):
        if new:
            speeds[link.second] = speeds[link.first] * link.ratio
    return speeds.get(shaft)


def _best_sensor(train: Drivetrain, mesh: str, sensors: Sequence[str]) -> str | None:
    """Return the speed sensor at the driver's shaft, else the first of those with a fixed ratio to it, else one."""
    shaft = train.wheels_of(mesh)[0].shaft
    ratios = {name: sensor_ratio(train, shaft, train.part(name).shaft) for name in sensors}
    at_driver = (name for name in sensors if train.part(name).shaft == shaft)
    fixed = (name for name, ratio in ratios.items() if ratio is not None)
    return next(at_driver, None) or next(fixed, None) or next(iter(sensors), None)
