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

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from gearmbs.gears import ContactLaw, Friction, GearPair, GearSpec
from gearmbs.studies.tooth_faults import fault_tables, tooth_fault
from gearmbs.units import to_si


def _quantity(unit: str) -> BeforeValidator:
    return BeforeValidator(lambda value: to_si(value, unit, "value"))


Length = Annotated[float, _quantity("length")]
Angle = Annotated[float, _quantity("angle")]
AngularSpeed = Annotated[float, _quantity("angular speed")]
TorqueValue = Annotated[float, _quantity("torque")]
Time = Annotated[float, _quantity("time")]
Frequency = Annotated[float, _quantity("frequency")]
Speed = Annotated[float, _quantity("speed")]


class CaseError(ValueError):
    """A case that cannot be simulated; the message names the field, the value and the remedy."""


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Gears(_Section):
    """The wheels: the paper's table, or numbers of one's own.

    Attributes are those of :class:`gearmbs.gears.GearSpec`; ``teeth`` holds driver and driven.
    """

    teeth: tuple[int, int] = (29, 29)
    module: Length = 95e-3 / 31
    pressure_angle: Angle = Field(default=0.3490658503988659)
    face_width: Length = 0.020
    addendum: Length | None = None
    dedendum: Length | None = None
    fillet_radius: Length | None = None
    profile_shift: tuple[float, float] = (0.0, 0.0)
    bore_radius: Length = 0.0
    tip_rounding: Length = 0.0


class Shafts(_Section):
    """Both shafts: solid steel cylinders centred on their wheels."""

    radius: Length = Field(default=0.015, gt=0)
    length: Length = Field(default=0.200, gt=0)
    density: float = Field(default=7850.0, gt=0)


class Operation(_Section):
    """Speed of the driver, load torque on the driven wheel, run-up and recording."""

    speed: AngularSpeed = Field(default=104.71975511965977, gt=0)
    torque: TorqueValue = Field(default=100.0, gt=0)
    run_up: Time = Field(default=0.05, gt=0)
    settling: Time = Field(default=0.05, ge=0)
    duration: Time = Field(default=1.0, gt=0)


ToothFaults = Annotated[tuple[dict[str, Any], ...], BeforeValidator(fault_tables)]


class Fault(_Section):
    """Deviations of the pair: axes, distance, backlash; and ``teeth``, faults of teeth by name or as tables.

    In a case file a fault of a tooth is a table ``[[fault.teeth]]`` with ``kind = "broken tooth"`` and the parameters
    of that class of :mod:`gearmbs.gears.faults`.
    """

    misalignment: Angle = 0.0
    plane: Literal["skew", "inclination"] = "skew"
    pivot: Length = 0.0
    centre_distance_error: Length = 0.0
    axial_shift: Length = 0.0
    backlash: Length = 0.0001
    teeth: ToothFaults = ()


class Contact(_Section):
    """IMPACT law of the paper's eq. (10)-(11): stiffness in N/m^e by text, e.g. "2.9852e5 N/mm^1.3"."""

    stiffness: float | str = "2.9852e5 N/mm^1.3"
    exponent: float = Field(default=1.3, ge=1.0)
    damping: float | str = "298.52 N s/mm"
    depth: Length = Field(default=0.0001, gt=0)
    slices: int | None = Field(default=None, ge=1)


class FrictionSettings(_Section):
    """ADAMS's velocity friction law between the flanks."""

    enabled: bool = True
    static: float = Field(default=0.1, ge=0)
    dynamic: float = Field(default=0.05, ge=0)
    static_speed: Speed = Field(default=0.1, gt=0)
    dynamic_speed: Speed = Field(default=1.0, gt=0)


class Solver(_Section):
    """Integrator, formulation, accuracy and output."""

    integrator: Literal["WSTIFF", "GSTIFF", "IDA"] = "WSTIFF"
    formulation: Literal["SI2", "SI1", "I3"] = "SI2"
    tolerance: float | None = Field(default=None, gt=0, le=1e-2)
    output_rate: Frequency = Field(default=51200.0, gt=0)
    signal_rate: Frequency = Field(default=12800.0, gt=0)

    @property
    def used_tolerance(self) -> float:
        """The tolerance, or its default: 1e-7, and 1e-8 with IDA, which makes ten times the error at the same value."""
        return self.tolerance or (1e-8 if self.integrator == "IDA" else 1e-7)

    @model_validator(mode="after")
    def _rates(self) -> Solver:
        if self.signal_rate > self.output_rate:
            raise ValueError(
                f"signal_rate {self.signal_rate:g} Hz is above output_rate {self.output_rate:g} Hz; raise output_rate"
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
    fault: Fault = Field(default_factory=Fault)
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
        g, f, c, r = self.gears, self.fault, self.contact, self.friction
        common: dict[str, Any] = {
            "pressure_angle": g.pressure_angle,
            "face_width": g.face_width,
            "addendum": g.addendum,
            "dedendum": g.dedendum,
            "fillet_radius": g.fillet_radius,
            "bore_radius": g.bore_radius,
            "tip_rounding": g.tip_rounding,
        }
        wheels = [
            GearSpec(teeth, g.module, profile_shift=shift, name=name, **common)
            for teeth, shift, name in zip(g.teeth, g.profile_shift, ("driver", "driven"))
        ]
        law = ContactLaw.impact(stiffness=c.stiffness, exponent=c.exponent, damping=c.damping, depth=c.depth)
        friction = Friction(r.static, r.dynamic, r.static_speed, r.dynamic_speed) if r.enabled else Friction.none()
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
        else:
            lines.append(f"{source}: {field} = {item['input']!r}: {message}")
    return "\n".join(lines)
