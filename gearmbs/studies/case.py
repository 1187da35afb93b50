"""A case: everything that defines one simulated measurement, validated and serialisable.

A case is written in Python with floats in SI or texts with units, or in TOML::

    name = "misaligned"

    [operation]
    speed = "1000 rpm"
    torque = "100 N m"

    [fault]
    misalignment = "1 deg"

    [contact]
    depth = "0.1 mm"
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from gearmbs.studies import quantities as q
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.gears import GearPair

LEAST_TOLERANCE = 1e-12
LARGEST_TOLERANCE = {"WSTIFF": 5e-6, "GSTIFF": 5e-6, "IDA": 1e-6}
"""Limits of ``solver.tolerance``; see `Solver`."""


WHEELS = ("driver", "driven")


class CaseError(ValueError):
    """A case that cannot be simulated; the message names the field, the value and the remedy."""


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Gears(_Section):
    """The wheels: the paper's table, or numbers of one's own.

    Attributes are those of :class:`gearmbs.gears.GearSpec` and its material; ``teeth`` holds driver and driven. All
    but module and pressure angle may be given once for both wheels or as a list of two. ``tip_radius`` and
    ``root_radius`` take the place of ``addendum`` and ``dedendum``.
    """

    teeth: tuple[int, int] = (29, 29)
    module: q.Module = 95e-3 / 31
    pressure_angle: q.PressureAngle = Field(default=0.3490658503988659)
    face_width: q.FaceWidth = 0.020
    addendum: q.ToothLength = None
    dedendum: q.ToothLength = None
    tip_radius: q.WheelRadius = None
    root_radius: q.WheelRadius = None
    fillet_radius: q.ToothLength = None
    profile_shift: tuple[float, float] = (0.0, 0.0)
    bore_radius: q.BoreRadius = 0.0
    tip_rounding: q.TipRounding = 0.0
    density: q.WheelDensity = 7850.0
    youngs_modulus: q.Modulus = 2.07e11
    poisson_ratio: q.PoissonRatio = 0.29

    @model_validator(mode="after")
    def _radii(self) -> Gears:
        for radius, height, outwards in (("tip_radius", "addendum", 1.0), ("root_radius", "dedendum", -1.0)):
            if getattr(self, radius) is None:
                continue
            if getattr(self, height) is not None:
                raise ValueError(f"{radius} and {height} say the same; give one of them")
            for wheel, name in enumerate(WHEELS):
                value, pitch = self.of_wheel(radius, wheel), 0.5 * self.module * self.teeth[wheel]
                if outwards * (value - pitch) <= 0.0:
                    raise ValueError(
                        f"{radius} of the {name} wheel is {value * 1e3:.4f} mm, "
                        f"{'inside' if outwards > 0 else 'outside'} its pitch circle of {pitch * 1e3:.4f} mm; "
                        "change it or give both wheels their own, [driver, driven]"
                    )
        return self

    def of_wheel(self, name: str, wheel: int) -> Any:
        """Return a value of the driver (0) or the driven wheel (1)."""
        value = getattr(self, name)
        return value[wheel] if isinstance(value, tuple) else value

    def height(self, wheel: int, above: bool) -> float | None:
        """Return the addendum (``above``) or dedendum of a wheel, m, from its radius if that is given."""
        radius = self.of_wheel("tip_radius" if above else "root_radius", wheel)
        if radius is None:
            return self.of_wheel("addendum" if above else "dedendum", wheel)
        return abs(radius - 0.5 * self.module * self.teeth[wheel])


class Shafts(_Section):
    """Both shafts: solid steel cylinders centred on their wheels."""

    radius: q.ShaftRadius = 0.015
    length: q.ShaftLength = 0.200
    density: q.Density = 7850.0


class Operation(_Section):
    """Speed of the driver, load torque on the driven wheel, run-up and recording."""

    speed: q.AngularSpeed = 104.71975511965977
    torque: q.TorqueValue = 100.0
    run_up: q.RunUp = 0.05
    settling: q.Settling = 0.05
    duration: q.Duration = 1.0


def _fault_tables(value: Any) -> tuple[dict[str, Any], ...]:
    from gearmbs.studies.tooth_faults import fault_tables

    return fault_tables(value) if value else ()


ToothFaults = Annotated[tuple[dict[str, Any], ...], BeforeValidator(_fault_tables)]


class FaultSettings(_Section):
    """Deviations of the pair: axes, distance, backlash; and ``teeth``, faults of teeth by name or as tables.

    In a case file a fault of a tooth is a table ``[[fault.teeth]]`` with ``kind = "broken tooth"`` and the parameters
    of that class of :mod:`gearmbs.gears.faults`.
    """

    misalignment: q.Misalignment = 0.0
    plane: Literal["skew", "inclination"] = "skew"
    pivot: q.Shift = 0.0
    centre_distance_error: q.DistanceError = 0.0
    axial_shift: q.Shift = 0.0
    backlash: q.Backlash = 0.0001
    teeth: ToothFaults = ()


class Contact(_Section):
    """IMPACT law of the paper's eq. (10)-(11): stiffness in N/m^e by text, e.g. "2.9852e5 N/mm^1.3"."""

    stiffness: float | str = "2.9852e5 N/mm^1.3"
    exponent: float = Field(default=1.3, ge=1.0)
    damping: float | str = "298.52 N s/mm"
    depth: q.Depth = 0.0001
    slices: int | None = Field(default=None, ge=1)

    @model_validator(mode="after")
    def _law(self) -> Contact:
        to_si(self.stiffness, self.stiffness_unit, "stiffness")
        to_si(self.damping, "damping", "damping")
        return self

    @property
    def stiffness_unit(self) -> str:
        """SI unit of the stiffness."""
        return f"N/m^{self.exponent!r}"


class FrictionSettings(_Section):
    """ADAMS's velocity friction law between the flanks."""

    enabled: bool = True
    static: float = Field(default=0.1, ge=0)
    dynamic: float = Field(default=0.05, ge=0)
    static_speed: q.SlidingSpeed = 0.1
    dynamic_speed: q.SlidingSpeed = 1.0


class Solver(_Section):
    """Integrator, formulation, accuracy and output.

    ``tolerance`` is the local error allowed a step, for lengths of the order of the mechanism. Measured on the paper's
    three states at low load against 1e-9: with WSTIFF mesh harmonics are off by 0.2 % at 1e-7, 2 % at 1e-6, 7 % at
    5e-6, but 16 % at 1e-5 and by a factor of 3 at 3e-5, since steps then skip contacts of tens of micrometres; with IDA
    by 1 % at 1e-7 and 12 % at 1e-6. Below 1e-12 runs only become longer: 1e-11 and 1e-13 differ by two millionths.

    ``lump`` integrates each gear and its shaft, which are fixed to each other, as one body; the record is about all
    bodies as without it.
    """

    integrator: Literal["WSTIFF", "GSTIFF", "IDA"] = "WSTIFF"
    formulation: Literal["SI2", "SI1", "I3"] = "SI2"
    tolerance: float | None = None
    output_rate: q.Frequency = 51200.0
    signal_rate: q.Frequency = 12800.0
    lump: bool = False

    @property
    def used_tolerance(self) -> float:
        """The tolerance, or its default: 1e-7, and 1e-8 with IDA, which makes ten times the error at the same value."""
        return self.tolerance or (1e-8 if self.integrator == "IDA" else 1e-7)

    @model_validator(mode="after")
    def _resolvable(self) -> Solver:
        if self.tolerance is None:
            return self
        low, high = LEAST_TOLERANCE, LARGEST_TOLERANCE[self.integrator]
        if not low <= self.tolerance <= high:
            why = "steps would skip contacts" if self.tolerance > high else "rounding errors would be larger"
            raise ValueError(
                f"tolerance = {self.tolerance:g}: {why}; give {low:g} to {high:g} with {self.integrator}, or leave it "
                "out"
            )
        return self

    @model_validator(mode="after")
    def _rates(self) -> Solver:
        if self.signal_rate > self.output_rate:
            raise ValueError(
                f"signal_rate {self.signal_rate:g} Hz is above output_rate {self.output_rate:g} Hz; raise output_rate"
            )
        ratio = self.output_rate / self.signal_rate
        if abs(ratio - round(ratio)) > 1e-9 * ratio:
            raise ValueError(
                f"output_rate {self.output_rate:g} Hz is not a whole multiple of signal_rate {self.signal_rate:g} Hz; "
                f"give for instance output_rate = {math.ceil(ratio) * self.signal_rate:g}"
            )
        return self


class Case(_Section):
    """One simulated measurement of a gear pair on two shafts.

    Attributes
    ----------
    name : str
        Label in results and figures.
    gears, shafts, operation, fault, contact, friction, solver
        The sections of a case file; see their classes.

    Examples
    --------
    >>> case = Case(name="high load", operation={"torque": "200 N m"})
    >>> case.operation.torque
    200.0
    """

    name: str = "case"
    gears: Gears = Field(default_factory=Gears)
    shafts: Shafts = Field(default_factory=Shafts)
    operation: Operation = Field(default_factory=Operation)
    fault: FaultSettings = Field(default_factory=FaultSettings)
    contact: Contact = Field(default_factory=Contact)
    friction: FrictionSettings = Field(default_factory=FrictionSettings)
    solver: Solver = Field(default_factory=Solver)

    def pair(self) -> GearPair:
        """Return the gear pair of the case.

        Raises
        ------
        ValueError
            If the wheels are impossible or do not mesh.
        """
        from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec, Material
        from gearmbs.studies.tooth_faults import tooth_fault

        g, f, c, r = self.gears, self.fault, self.contact, self.friction
        if f.backlash > g.module:
            raise ValueError(
                f"fault.backlash is {f.backlash * 1e3:.6g} mm, more than the module of {g.module * 1e3:.6g} mm; give "
                "less (a plain number is in m)"
            )
        wheels = []
        for k, name in enumerate(WHEELS):
            material = Material(*(g.of_wheel(key, k) for key in ("youngs_modulus", "poisson_ratio", "density")))
            own = ("face_width", "fillet_radius", "bore_radius", "tip_rounding")
            wheel = GearSpec(
                g.teeth[k],
                g.module,
                g.pressure_angle,
                addendum=g.height(k, above=True),
                dedendum=g.height(k, above=False),
                profile_shift=g.profile_shift[k],
                material=material,
                name=name,
                **{key: g.of_wheel(key, k) for key in own},
            )
            wheels.append(wheel)
        law = ContactLaw.impact(stiffness=c.stiffness, exponent=c.exponent, damping=c.damping, depth=c.depth)
        friction = (
            FlankFriction(r.static, r.dynamic, r.static_speed, r.dynamic_speed) if r.enabled else FlankFriction.none()
        )
        return GearPair(
            wheels[0],
            wheels[1],
            centre_distance_error=f.centre_distance_error,
            misalignment=f.misalignment,
            plane=f.plane,
            pivot=f.pivot,
            axial_shift=f.axial_shift,
            backlash=f.backlash,
            contact=law,
            friction=friction,
            torque=self.operation.torque,
            slices=c.slices,
            faults=tuple(tooth_fault(table) for table in f.teeth),
        )

    @property
    def mesh_frequency(self) -> float:
        """Gear mesh frequency at the operating speed, Hz."""
        return self.gears.teeth[0] * self.operation.speed / 6.283185307179586

    def changed(self, **sections: Any) -> Case:
        """Return a copy with fields of its sections changed.

        Examples
        --------
        >>> Case().changed(fault={"misalignment": "1 deg"}).fault.plane
        'skew'
        """
        data = self.model_dump()
        for key, value in sections.items():
            data[key] = {**data[key], **value} if isinstance(value, dict) and key in data else value
        return make_case(data)


def units_of_fields(section: BaseModel) -> dict[str, str]:
    """Return the SI units of those fields of a section of a case that are quantities."""
    units = {
        name: item.unit
        for name, field in type(section).model_fields.items()
        for item in field.metadata
        if isinstance(item, q.Measure)
    }
    if isinstance(section, Contact):
        units |= {"stiffness": section.stiffness_unit, "damping": "N s/m"}
    return units


def make_case(data: dict[str, Any], source: str = "case") -> Case:
    """Return a validated case from nested dictionaries.

    Raises
    ------
    CaseError
        Naming every wrong field with its value.
    """
    try:
        case = Case.model_validate(data)
        pair = case.pair()
    except ValidationError as error:
        raise CaseError(_explain(error, source)) from error
    except ValueError as error:
        raise CaseError(f"{source}: {error}") from error
    if pair.faults:
        from gearmbs.studies.tooth_faults import check_each_fault

        try:
            check_each_fault(pair)
        except ValueError as error:
            raise CaseError(f"{source}: fault.teeth{error}") from error
    if pair.misalignment == 0.0 and pair.jams:
        fault, overlap = case.fault, -pair.normal_backlash
        raise CaseError(
            f"{source}: fault.centre_distance_error = {1e3 * fault.centre_distance_error:g} mm with fault.backlash = "
            f"{1e3 * fault.backlash:g} mm: negative backlash, the teeth overlap by {1e3 * overlap:.4g} mm on both "
            f"flanks; give at least {1e3 * (fault.backlash + overlap):.4g} mm of backlash"
        )
    return case


def load_case(path: str | Path) -> Case:
    """Read a case file in TOML.

    Raises
    ------
    CaseError
        If the file cannot be read, is not TOML, or has unknown keys, wrong units or impossible values.
    """
    path = Path(path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CaseError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CaseError(f"{path}: not a valid TOML file ({error})") from error
    data.setdefault("name", path.stem)
    return make_case(data, str(path))


def _explain(error: ValidationError, source: str) -> str:
    lines = []
    for item in error.errors():
        field = ".".join(str(part) for part in item["loc"])
        message = item["msg"].removeprefix("Value error, ")
        if item["type"] == "extra_forbidden":
            section = item["loc"][0] if len(item["loc"]) > 1 else None
            model: Any = Case.model_fields[section].annotation if section in Case.model_fields else Case
            message = f"unknown key; known ones are {', '.join(model.model_fields)}"
            lines.append(f"{source}: {field}: {message}")
        elif message.startswith("["):
            # one of several, named by its place
            lines.append(f"{source}: {field}{message}")
        else:
            # what is wrong with a section as a whole begins with the name of the field
            whole = isinstance(item["input"], (dict, BaseModel))
            lines.append(
                f"{source}: {field}.{message}" if whole else f"{source}: {field} = {item['input']!r}: {message}"
            )
    return "\n".join(lines)
