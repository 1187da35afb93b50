"""Wheels, meshes and sensors, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

from gearmbs.drivetrain.members.wheel import IN_SHAFT, FlexibleWheel
from gearmbs.drivetrain.part import DrivetrainError, Part, errors_named, require
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.gears.mesh import ContactLaw, FlankFriction
from gearmbs.gears.pair import GearPair, before_own_law
from gearmbs.gears.spec import GearSpec
from gearmbs.schema.described import chosen
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, truth
from gearmbs.wording import warn

OWN_LAWS = ("iso", "iso single", "potential-energy")
"""Stiffnesses of a mesh that follow from its wheels."""


@dataclass(frozen=True, kw_only=True)
class Wheel(Part):
    """A toothed wheel on a shaft.

    Masses of shaft and wheel add: a wheel without a bore counts the shaft through it again.

    Parameters
    ----------
    shaft : str
    gear : GearSpec
        With the shaft's radius as ``bore_radius`` where that mass matters.
    station : float or str, optional
        Mid-face along the shaft, m; default: the shaft's middle.
    angle : float or str, optional
        Assembly angle of tooth 0 against the shaft's x axis, rad; default 0, or what a mesh's ``phase`` or a closed
        chain asks for.
    body : FlexibleWheel, mapping or "shaft", optional
        How it deforms between its teeth and its shaft: by a thin web and rim or a model, as a table of the fields of
        `gearmbs.drivetrain.FlexibleWheel`. "shaft": it is cut from its shaft, whose mass has that of the wheel.
        Default: it is a rigid disc.

    Raises
    ------
    DrivetrainError
    """

    title: ClassVar[str] = "wheel"

    shaft: str
    gear: GearSpec
    station: Annotated[Quantity, Measure("length")] = None
    angle: Annotated[Quantity, Measure("angle")] = None
    body: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.gear.name == GearSpec.name:
            # messages about the pair then tell its wheels apart
            object.__setattr__(self, "gear", replace(self.gear, name=self.name))
        with errors_named(self.label):
            if self.flexible is not None:
                self.flexible.check(self.gear)

    @cached_property
    def flexible(self) -> FlexibleWheel | None:
        """How its body deforms; None if it is rigid."""
        return None if self.body in (None, IN_SHAFT) else FlexibleWheel.of(self.body)

    @cached_property
    def weight(self) -> tuple[float, tuple[float, float, float]]:
        """Mass (kg) and moments of inertia about x, y and z through mid-face (kg m^2); zero if it is of its shaft."""
        if self.flexible is not None:
            return self.flexible.weight(self.gear)
        return (0.0, (0.0, 0.0, 0.0)) if self.body == IN_SHAFT else (self.gear.mass, self.gear.inertia)


@dataclass(frozen=True, kw_only=True)
class GearMesh(Part):
    """Two wheels in mesh.

    Parameters
    ----------
    driver, driven : str
        The wheels. Names only: which one pushes follows from the drives and loads.
    direction : float or str
        Of the line from the driver's to the driven wheel's centre, in the transverse plane of the driver's shaft from
        its x direction at angle zero, rad.
    phase : float, optional
        Where the driver's tooth 0 is at the start, in pitches past the line of centres; sets the driver's assembly
        angle. Two meshes whose phases differ by a half have their first mesh harmonics in opposition.
    settings : mapping
        Keywords of `gearmbs.gears.GearPair`: backlash, contact, friction, misalignment, centre_distance_error, faults,
        slices, ...; ``contact`` may be a table with ``kind``. Without ``contact`` the teeth have the stiffness of their
        own wheels and a damping ratio: ``stiffness`` ("iso", "iso single", "potential-energy" or N/m of a tooth pair)
        and ``damping_ratio``, see `gearmbs.gears.GearPair.with_own_stiffness`. The torque is that of the drivetrain.
    pair : type, optional
        What is made of the two wheels, ``pair(driver, driven, **settings)``; default `GearPair`.
        `gearmbs.gears.IdealMesh`: one spring along the line of action, ``stiffness`` then of the whole mesh (default
        c_gamma), ``damping`` (N s/m, in place of ``damping_ratio``), ``error`` and ``stiffness_curve`` its own, and
        ``ideal_backlash`` whether teeth can part.

    Raises
    ------
    DrivetrainError
        For ``contact`` beside ``stiffness`` or ``damping_ratio``, and for ``torque``, which follows from the loads.
    """

    title: ClassVar[str] = "mesh"

    driver: str
    driven: str
    direction: Annotated[Quantity, Measure("angle")] = 0.0
    phase: Annotated[Quantity, Measure(remedy="give a number of pitches, such as 0.5")] = None
    settings: Mapping[str, Any] = field(default_factory=dict)  # type: ignore[assignment]
    pair: Any = None

    # a pair, an ideal mesh, or what a user's own function makes of the wheels
    def make(self, driver: GearSpec, driven: GearSpec, rotation: Any, torque: float) -> Any:
        """Return the pair of the two wheels for a sense of the driver and a torque on the driven wheel (N m)."""
        with errors_named(self.label):
            # None takes a setting back, as in `Drivetrain.changed`, where settings are merged
            given = {key: value for key, value in self.settings.items() if value is not None}
            for name in ("torque", "input_torque", "rotation"):
                require(name not in given, f"{self.label}: {name} follows from the drives and loads; leave it out")
            if "contact" in given:
                given["contact"] = contact_law(given["contact"])
            if "friction" in given:
                given["friction"] = flank_friction(given["friction"])
            own: dict[str, Any] = {key: given.pop(key) for key in ("stiffness", "damping_ratio") if key in given}
            for key in own:
                require(
                    "contact" not in given,
                    f"{self.label}: {key} is {own[key]!r} beside contact, which has its own; leave one of them out",
                )
            operation = {"rotation": rotation, "torque": abs(torque)}
            kind = self.pair or GearPair
            if isinstance(kind, type) and issubclass(kind, IdealMesh):
                return _ideal(self.label, kind, driver, driven, {**given, **operation}, own)
            if not (isinstance(kind, type) and issubclass(kind, GearPair)):
                return kind(driver, driven, **operation, **given, **own)
            require("damping" not in given,
                    f"{self.label}: settings has damping, N s/m, which is an ideal mesh's (pair=gm.IdealMesh); give "
                    "damping_ratio, or a contact law with its own")  # fmt: skip
            if "contact" in given:
                return kind(driver, driven, **operation, **given)
            with before_own_law():
                pair = kind(driver, driven, **operation, **given)
            varies = given.get("stiffness_curve") == "potential-energy"
            return pair.with_own_stiffness(
                own.get("stiffness", "potential-energy" if varies else "iso"), own.get("damping_ratio")
            )


def _ideal(
    label: str, kind: Any, driver: GearSpec, driven: GearSpec, given: dict[str, Any], own: dict[str, Any]
) -> IdealMesh:
    """Return the ideal mesh of two wheels: its stiffness and damping are those of the whole mesh, along the normal.

    Warns
    -----
    UserWarning
        Of misaligned wheels whose own stiffness is asked for: it is that of parallel ones.
    """
    parting = truth(given.pop("ideal_backlash", False), "ideal_backlash")
    curves = {key: given.pop(key) for key in ("stiffness_curve", "error") if key in given}
    damping = given.pop("damping", None)
    require(
        damping is None or "damping_ratio" not in own,
        f"{label}: damping is {damping!r} beside damping_ratio, of which it follows; leave one of them out",
    )
    with before_own_law():
        pair = GearPair(driver, driven, **given)
    stiffness, ratio = own.get("stiffness", "iso"), own.get("damping_ratio")
    if damping is not None:
        if stiffness in OWN_LAWS:
            stiffness = pair.with_own_stiffness(stiffness).mean_mesh_stiffness
        return kind(pair, stiffness, damping, backlash=parting, **curves)
    if stiffness not in OWN_LAWS:
        return kind.with_damping_ratio(pair, stiffness, ratio, backlash=parting, **curves)
    if pair.misalignment:
        warn(
            f"{label}: misalignment is {math.degrees(pair.misalignment):.4g} deg, and the stiffness '{stiffness}' of "
            "its ideal mesh is that of parallel wheels, whose whole face carries; leave pair out for the contact of "
            "the teeth, or give stiffness in N/m"
        )
    law = pair.with_own_stiffness(stiffness)
    return kind.with_damping_ratio(pair, law.mean_mesh_stiffness, ratio, backlash=parting, **curves)


def contact_law(value: Any, key: str = "kind") -> ContactLaw:
    """Return the law that a table such as ``{"kind": "linear", "stiffness": "3e8 N/m"}`` stands for, or a law itself.

    Parameters
    ----------
    value : ContactLaw or mapping
    key : str
        What names the law in the table.

    Raises
    ------
    ValueError
        For an unknown law.
    """
    if isinstance(value, ContactLaw):
        return value
    table = dict(value)
    name = str(table.pop(key, "impact")).replace("_", "-")
    return chosen(ContactLaw.makers(), name, "contact: ", DrivetrainError, key)(**table)


def flank_friction(value: Any) -> FlankFriction:
    """Return the friction that a table, False (none), or a friction itself stands for."""
    if isinstance(value, FlankFriction):
        return value
    return FlankFriction.none() if value is False else FlankFriction(**dict(value))


Direction = Annotated[tuple[float, float, float], Measure(several=3)]


@dataclass(frozen=True, kw_only=True)
class Sensor(Part):
    """What all sensors share: a name."""

    title: ClassVar[str] = "sensor"
    kind: ClassVar[str] = "sensor"
    unit: ClassVar[str] = "1"


def _check_direction(sensor: Laser | Accelerometer) -> None:
    require(any(sensor.direction), f"{sensor.label}: direction is {sensor.direction}; give one that is not all zero")


@dataclass(frozen=True, kw_only=True)
class Laser(Sensor):
    """A laser vibrometer on a shaft: the velocity (v + w x r) . d of the surface under a spot fixed in space.

    Parameters
    ----------
    shaft : str
    station : float or str, optional
        Of the spot along the shaft, m; default: its middle.
    direction : sequence of 3 floats
        d, from the shaft towards the laser, global components.
    offset : float or str
        Of the line of sight from the axis, m; 0: aimed at the axis, where the spin itself does not show.
    """

    kind: ClassVar[str] = "laser"
    unit: ClassVar[str] = "m/s"

    shaft: str
    station: Annotated[Quantity, Measure("length")] = None
    direction: Direction = (1.0, 0.0, 0.0)
    offset: Annotated[Quantity, Measure("length")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_direction(self)


@dataclass(frozen=True, kw_only=True)
class Accelerometer(Sensor):
    """Acceleration of the housing at the seat of a bearing, along a direction.

    Parameters
    ----------
    bearing : str
        At its seat, which must be on a housing.
    direction : sequence of 3 floats
        Global components at the start.
    """

    kind: ClassVar[str] = "accelerometer"
    unit: ClassVar[str] = "m/s^2"

    bearing: str
    direction: Direction = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_direction(self)


@dataclass(frozen=True, kw_only=True)
class SpeedSensor(Sensor):
    """Speed of a shaft about its own axis, rad/s.

    Parameters
    ----------
    shaft : str
    """

    kind: ClassVar[str] = "speed"
    unit: ClassVar[str] = "rad/s"

    shaft: str


@dataclass(frozen=True, kw_only=True)
class TorqueSensor(Sensor):
    """Torque about the axis in a coupling, a load or a drive, N m.

    Parameters
    ----------
    of : str
        Name of the coupling, load or drive.
    """

    kind: ClassVar[str] = "torque"
    unit: ClassVar[str] = "N m"

    of: str


SENSORS: dict[str, type[Sensor]] = {kind.kind: kind for kind in (Laser, Accelerometer, SpeedSensor, TorqueSensor)}
"""Sensors by their ``kind``."""
