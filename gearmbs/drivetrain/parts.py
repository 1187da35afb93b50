"""Shafts, wheels, meshes, housings with their mounts, and sensors, by name."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

from gearmbs.drivetrain.part import DrivetrainError, Part, errors_named, require
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.gears.mesh import ContactLaw, FlankFriction
from gearmbs.gears.pair import GearPair
from gearmbs.gears.spec import GearSpec
from gearmbs.schema.described import chosen
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, doubt_of_density, truth

LONG = 30.0
"""Lengths of a shaft from here on, m, look like millimetres: no gearbox has such; a ship has several."""

DIAMETER = 0.030
"""Diameter of a shaft that gives none, m: the usual one of a gearbox of this size, as in the bench of Fig. 2."""


Length = Annotated[Quantity, Measure("length", above=0)]
Mass = Annotated[Quantity, Measure("mass", above=0)]
Three = tuple[Quantity, Quantity, Quantity]


@dataclass(frozen=True, kw_only=True)
class Shaft(Part):
    """A rigid shaft: a cylinder, sections one after the other, or a rotor given by its numbers.

    Stations are measured from its left end, along its axis.

    Parameters
    ----------
    length : float or str
        m.
    diameter : float or str, optional
        Of a solid cylinder, m; default 30 mm.
    radius : float or str, optional
        Instead of ``diameter``, m.
    sections : sequence, optional
        Instead: cylinders from left to right, as tables ``{"length": ..., "diameter": ...}`` (or ``radius``), as
        `gearmbs.flexible.ShaftSection` without bore, or as pairs (length, radius), m.
    density : float or str
        kg/m^3.
    mass, inertia : float or str, optional
        kg, and moment of inertia about the axis, kg m^2: take the place of the cylinder's.
    position : sequence of 3 floats, optional
        Left end in global components, m. Only one shaft of each connected group needs a place; those of the others
        follow from meshes, couplings and bearings, and where given they are checked.
    angle : float or str
        At the start, about its axis, rad; of a shaft that others follow.

    Raises
    ------
    DrivetrainError
    """

    title: ClassVar[str] = "shaft"

    length: Length = None
    radius: Length = None
    sections: Any = None
    density: Annotated[Quantity, Measure("density", above=0)] = 7850.0
    mass: Mass = None
    inertia: Annotated[Quantity, Measure("inertia", above=0)] = None
    position: Annotated[Three | None, Measure("length", several=3)] = None
    angle: Annotated[Quantity, Measure("angle")] = 0.0
    diameter: Length = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.radius is None or self.diameter is None,
            f"{self.label}: radius is {self.radius} m and diameter {self.diameter} m; give one of them",
        )
        if self.sections is not None:
            for name in ("length", "radius", "diameter"):
                require(getattr(self, name) is None, f"{self.label}: give {name} or sections, not both")
            require(len(self.sections) > 0, f"{self.label}: sections is empty; give lengths and diameters")
            cut = tuple(self._section(one) for one in self.sections)
            object.__setattr__(self, "sections", cut)
            object.__setattr__(self, "length", math.fsum(pair[0] for pair in cut))
        elif self.length is None:
            object.__setattr__(self, "length", 0.2)
        doubt = doubt_of_density(self.density)
        largest = max(max(pair) for pair in self.cylinders)
        if largest >= LONG:
            doubt = f"a length or radius of {largest:g} m; are millimetres meant ('{largest:g} mm')?"
        if doubt:
            warnings.warn(f"{self.label}: {doubt}", stacklevel=3)

    def _section(self, given: Any) -> tuple[float, float]:
        """Return length and radius of a section, m."""
        if hasattr(given, "outer"):
            is_solid = given.outer == given.outer_end and given.inner == given.inner_end == 0.0
            require(
                is_solid,
                f"{self.label}: sections has {given!r}; a rigid shaft has solid cylinders without bore or cone",
            )
            given = {"length": given.length, "diameter": given.outer}
        if isinstance(given, Mapping):
            known = set(given) in ({"length", "diameter"}, {"length", "radius"})
            require(known, f"{self.label}: sections has {dict(given)}; give length and diameter, or length and radius")
            measured = {key: self.read(f"sections.{key}", value, Measure("length")) for key, value in given.items()}
            found = measured["length"], measured.get("radius", 0.5 * measured.get("diameter", 0.0))
        else:
            found = self.read("sections", given, Measure("length", several=2))
        require(
            min(found) > 0.0,
            f"{self.label}: sections has {found}; give pairs of a positive length and radius, or tables of length and "
            "diameter",
        )
        return found

    @property
    def cylinders(self) -> tuple[tuple[float, float], ...]:
        """Lengths and radii from left to right, m."""
        if self.sections is not None:
            return tuple(self.sections)
        radius = self.radius
        if radius is None:
            radius = DIAMETER / 2 if self.diameter is None else 0.5 * self.diameter
        return ((self.length, radius),)

    def body(self) -> tuple[float, float, float, float]:
        """Return mass (kg), place of the centre of mass along the axis (m), moments along and across the axis."""
        z, m, moment, polar, across = 0.0, 0.0, 0.0, 0.0, 0.0
        for length, radius in self.cylinders:
            part = self.density * math.pi * radius**2 * length
            middle = z + 0.5 * length
            m += part
            moment += part * middle
            polar += 0.5 * part * radius**2
            across += part * ((3.0 * radius**2 + length**2) / 12.0 + middle**2)
            z += length
        centre = moment / m
        across -= m * centre**2
        if self.mass is not None:
            polar, across, m = polar * self.mass / m, across * self.mass / m, self.mass
        if self.inertia is not None:
            # no body has less across than half of what it has along, and a rod adds to it
            across = max(across, 0.5 * self.inertia)
            polar = self.inertia
        return m, centre, polar, across


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
    """

    title: ClassVar[str] = "wheel"

    shaft: str
    gear: GearSpec
    station: Annotated[Quantity, Measure("length")] = None
    angle: Annotated[Quantity, Measure("angle")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.gear.name == GearSpec.name:
            # messages about the pair then tell its wheels apart
            object.__setattr__(self, "gear", replace(self.gear, name=self.name))


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
        c_gamma), ``error`` and ``stiffness_curve`` its own, and ``ideal_backlash`` whether teeth can part.

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
            pair = kind(driver, driven, **operation, **given)
            if "contact" in given:
                return pair
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
    pair = GearPair(driver, driven, **given)
    stiffness, ratio = own.get("stiffness", "iso"), own.get("damping_ratio")
    if stiffness not in ("iso", "iso single", "potential-energy"):
        return kind.with_damping_ratio(pair, stiffness, ratio, backlash=parting, **curves)
    if pair.misalignment:
        warnings.warn(
            f"{label}: misalignment is {math.degrees(pair.misalignment):.4g} deg, and the stiffness '{stiffness}' of "
            "its ideal mesh is that of parallel wheels, whose whole face carries; leave pair out for the contact of "
            "the teeth, or give stiffness in N/m",
            stacklevel=3,
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


@dataclass(frozen=True, kw_only=True)
class Mount(Part):
    """An elastic mount between a housing and the ground.

    Parameters
    ----------
    at : sequence of 3 floats
        Place in global components, m.
    stiffness, damping : sequence of 3 floats
        Along the global axes, N/m and N s/m.
    """

    title: ClassVar[str] = "mount"

    at: Annotated[Three, Measure("length", several=3)]
    stiffness: Annotated[Three, Measure("stiffness", 0, several=3)]
    damping: Annotated[Three, Measure("damping", 0, several=3)] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class HousingMode(Part):
    """A structural mode of a housing by its modal mass and stiffness, and how the bearing seats move in it.

    Parameters
    ----------
    mass, stiffness : float or str
        Modal mass (kg) and stiffness (N/m) for a displacement of one metre at shape 1.
    damping_ratio : float
        Of critical damping.
    shape : mapping of str to 3 floats
        Displacement of bearing seats and sensors, by name, in global components at the start; others stay.
    """

    title: ClassVar[str] = "mode"

    mass: Mass
    stiffness: Annotated[Quantity, Measure("stiffness", above=0)]
    shape: Mapping[str, Any]
    damping_ratio: float = 0.02

    @property
    def frequency(self) -> float:
        """Natural frequency with the housing held, Hz."""
        return math.sqrt(self.stiffness / self.mass) / (2.0 * math.pi)


@dataclass(frozen=True, kw_only=True)
class Housing(Part):
    """A housing on mounts, rigid or with structural modes.

    Parameters
    ----------
    mass : float or str
        kg.
    inertia : sequence of 3 floats
        About the centre of mass in global axes, kg m^2.
    at : sequence of 3 floats
        Centre of mass in global components, m.
    mounts : sequence of Mount
        None: fixed to the ground.
    modes : sequence of HousingMode
    """

    title: ClassVar[str] = "housing"

    mass: Mass
    inertia: Annotated[Three, Measure("inertia", above=0, several=3)]
    at: Annotated[Three, Measure("length", several=3)] = (0.0, 0.0, 0.0)
    mounts: tuple[Mount, ...] = ()
    modes: tuple[HousingMode, ...] = ()


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
