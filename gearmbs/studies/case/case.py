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

import json
import math
import warnings
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, Field, model_validator

from gearmbs._display import Shown
from gearmbs.dae.methods import DEFAULT, FORMULATIONS, INTEGRATORS
from gearmbs.schema.described import read_toml, toml_table
from gearmbs.schema.quantities import SHOWN, Measure, flag, two
from gearmbs.studies.case import section as q
from gearmbs.studies.case.section import CaseError, CaseWarning, Section, measures_of
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec

    IntegratorName = str
    FormulationName = str
else:
    IntegratorName = Literal[tuple(INTEGRATORS)]
    FormulationName = Literal[tuple(FORMULATIONS)]

LEAST_TOLERANCE = 1e-12
"""Lower limit of ``solver.tolerance``; upper ones and defaults are in the table of integrators, see `Solver`."""

SIGNAL_RATE, OUTPUT_RATE = 12800.0, 51200.0
"""Least sampling rates, Hz, where a case gives none: natural frequencies do not fall with the speed."""

KEPT_HARMONICS, ANALYSER = 5, 2.56
"""Mesh harmonics that a default rate holds, and the ratio of rate to highest frequency that analysers use."""

WHEELS = ("driver", "driven")

AUTO = "auto"
"""Duration of a record that is as long as its question needs."""

LONGEST = 1.0
"""Seconds of a record whose length nobody gave: always of a single case, at most of one with the duration `AUTO`."""

FINER = 0.1
"""Tolerance of a record at `AUTO` over that of others: a mesh period of the paper's states then repeats itself to 0.2 %
of its harmonics, at the usual tolerance to 2 %, which long records average out."""

PRESSED_IN = 20e-6
"""Static penetration of a tooth pair, m, below which that tolerance falls in proportion: at a fifth of the load of the
paper's pair, whose teeth are pressed in by 24 um, harmonics were 0.9 % off without."""


def _both(value: Any) -> Any:
    """Return one value for both wheels as two."""
    return two(value) if isinstance(value, Sequence) and not isinstance(value, str) else (value, value)


def _upper(value: Any) -> Any:
    return value.upper() if isinstance(value, str) else value


OTHER_WHEELS = (
    "a case is an external spur pair; internal and helical wheels are those of a drivetrain ([wheels.a]) or gm.GearSpec"
)
"""Where keys of other wheels belong."""


class Gears(Section):
    """The wheels: the paper's table, or numbers of one's own.

    Attributes are those of :class:`gearmbs.gears.GearSpec` and its material; all but module and pressure angle may be
    given once for both wheels or as a list of two, driver and driven. ``tip_radius`` and ``root_radius`` take the place
    of ``addendum`` and ``dedendum``.
    """

    section: ClassVar[str] = "gears"
    elsewhere: ClassVar[dict[str, str]] = dict.fromkeys(("internal", "helix_angle", "hand"), OTHER_WHEELS)

    teeth: Annotated[tuple[int, int], BeforeValidator(_both)] = (29, 29)
    module: q.Module = 95e-3 / 31
    pressure_angle: q.PressureAngle = Field(default=0.3490658503988659)
    face_width: q.FaceWidth = 0.020
    addendum: q.ToothLength = None
    dedendum: q.ToothLength = None
    tip_radius: q.WheelRadius = None
    root_radius: q.WheelRadius = None
    fillet_radius: q.ToothLength = None
    profile_shift: Annotated[tuple[float, float], BeforeValidator(_both)] = (0.0, 0.0)
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

    @cached_property
    def wheels(self) -> tuple[GearSpec, GearSpec]:
        """The driver and the driven wheel.

        Raises
        ------
        ValueError
            If they are impossible.
        """
        return self._wheel(0), self._wheel(1)

    def _wheel(self, wheel: int) -> GearSpec:
        from gearmbs.gears import GearSpec, Material

        material = Material(*(self.of_wheel(key, wheel) for key in ("youngs_modulus", "poisson_ratio", "density")))
        own = ("face_width", "fillet_radius", "bore_radius", "tip_rounding")
        return GearSpec(
            self.teeth[wheel],
            self.module,
            self.pressure_angle,
            addendum=self.height(wheel, above=True),
            dedendum=self.height(wheel, above=False),
            profile_shift=self.profile_shift[wheel],
            material=material,
            name=WHEELS[wheel],
            **{key: self.of_wheel(key, wheel) for key in own},
        )


class Shafts(Section):
    """Both shafts: solid steel cylinders centred on their wheels."""

    section: ClassVar[str] = "shafts"

    radius: q.ShaftRadius = 0.015
    length: q.ShaftLength = 0.200
    density: q.Density = 7850.0


INPUT_TORQUE = "torque is that of the driven wheel: give the driver's times z_2 / z_1 there"
"""What is said to somebody who has the other torque."""


class Operation(Section):
    """Speed of the driver, load torque on the driven wheel, run-up and recording.

    ``torque`` is that of the **driven** wheel, z_2/z_1 times the driver's.

    ``speed`` and ``torque`` are numbers, or curves for run-ups and coast-downs: lists of points (time, value), the time
    from the beginning of the record, ``[["0 s", "0 rpm"], ["2 s", "3000 rpm"]]``. Between the points run straight
    lines whose corners are rounded, see `gearmbs.mechanism.polyline`; before the first the first value is held, which
    ``run_up`` leads to from rest, and after the last the last. ``duration`` is up to the end of the curves unless it is
    given. ``"auto"`` is as long as the motion takes to repeat itself, with the settling that this needs, see
    `gearmbs.studies.run.periodic`; with a curve it is that curve.
    """

    section: ClassVar[str] = "operation"
    elsewhere: ClassVar[dict[str, str]] = dict.fromkeys(("input_torque", "driver_torque", "torque_in"), INPUT_TORQUE)

    speed: q.AngularSpeed = 104.71975511965977
    torque: q.TorqueValue = 100.0
    run_up: q.RunUp = 0.05
    settling: q.Settling = 0.05
    duration: q.Duration = LONGEST

    @model_validator(mode="after")
    def _span(self) -> Operation:
        ends = [points[-1][0] for points in (self.speed_curve, self.torque_curve) if points]
        if ends and ("duration" not in self.model_fields_set or self.duration == AUTO):
            self.__dict__["duration"] = max(ends)
        return self

    @cached_property
    def longest(self) -> float:
        """Length of the record, s; at "auto" that which it has if the motion does not repeat itself before."""
        return LONGEST if isinstance(self.duration, str) else self.duration

    def settings(self) -> dict[str, Any]:
        """Return all settings; a duration that follows from a curve goes with it."""
        data = super().settings()
        if "duration" not in self.model_fields_set:
            del data["duration"]
        return data

    def with_settings(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Return all settings with some changed; the length of the old record says nothing of a new curve's.

        Warns
        -----
        CaseWarning
            If a duration that was given goes.
        """
        data = super().with_settings(changes)
        curves = [changes[key] for key in ("speed", "torque") if key in changes]
        if any(not isinstance(value, str) and isinstance(value, Sequence) for value in curves):
            if self.duration != AUTO and "duration" in data and "duration" not in changes:
                asked = data.pop("duration")
                warnings.warn(
                    f"operation.duration = {asked!r}, given before, goes: the record lasts as long as the new curve; "
                    f"give 'duration': {asked!r} beside the curve to keep it",
                    CaseWarning,
                    stacklevel=3,
                )
        return data

    @cached_property
    def speed_curve(self) -> q.Points | None:
        """Points (s, rad/s) of a speed that changes, s from the beginning of the record."""
        return self.speed if isinstance(self.speed, tuple) else None

    @cached_property
    def torque_curve(self) -> q.Points | None:
        """Points (s, N m) of a torque that changes."""
        return self.torque if isinstance(self.torque, tuple) else None

    @cached_property
    def top_speed(self) -> float:
        """Highest speed, rad/s."""
        return self.speed if isinstance(self.speed, float) else max(value for _, value in self.speed)

    @cached_property
    def top_torque(self) -> float:
        """Largest torque, N m."""
        return self.torque if isinstance(self.torque, float) else max(value for _, value in self.torque)


def _fault_tables(value: Any) -> tuple[dict[str, Any], ...]:
    from gearmbs.studies.case.tooth_faults import fault_tables

    return fault_tables(value) if value else ()


ToothFaults = Annotated[tuple[dict[str, Any], ...], BeforeValidator(_fault_tables)]


class FaultSettings(Section):
    """Deviations of the pair: axes, distance, backlash; and ``teeth``, faults of teeth by name or as tables.

    In a case file a fault of a tooth is a table ``[[fault.teeth]]`` with ``kind = "broken tooth"`` and the parameters
    of that class of :mod:`gearmbs.gears.faults`.
    """

    section: ClassVar[str] = "fault"

    misalignment: q.Misalignment = 0.0
    plane: Literal["skew", "inclination"] = "skew"
    pivot: q.Shift = 0.0
    centre_distance_error: q.DistanceError = 0.0
    axial_shift: q.Shift = 0.0
    backlash: q.Backlash = 0.0001
    teeth: ToothFaults = ()


class Contact(Section):
    """IMPACT law of the paper's eq. (10)-(11): stiffness in N/m^e by text, e.g. "2.9852e5 N/mm^1.3"."""

    section: ClassVar[str] = "contact"

    stiffness: float | str = "2.9852e5 N/mm^1.3"
    exponent: float = Field(default=1.3, ge=1.0)
    damping: float | str = "298.52 N s/mm"
    depth: q.Depth = 0.0001
    slices: int | None = Field(default=None, ge=1)

    @model_validator(mode="after")
    def _readable(self) -> Contact:
        to_si(self.stiffness, self.stiffness_unit, "stiffness")
        to_si(self.damping, "damping", "damping")
        return self

    @cached_property
    def law(self) -> ContactLaw:
        """The law between two flanks."""
        from gearmbs.gears import ContactLaw

        return ContactLaw.impact(
            stiffness=self.stiffness, exponent=self.exponent, damping=self.damping, depth=self.depth
        )

    @property
    def stiffness_unit(self) -> str:
        """SI unit of the stiffness."""
        return f"N/m^{self.exponent!r}"


class FrictionSettings(Section):
    """ADAMS's velocity friction law between the flanks."""

    section: ClassVar[str] = "friction"

    enabled: Annotated[bool, BeforeValidator(flag)] = True
    static: float = Field(default=0.1, ge=0)
    dynamic: float = Field(default=0.05, ge=0)
    static_speed: q.SlidingSpeed = 0.1
    dynamic_speed: q.SlidingSpeed = 1.0

    @cached_property
    def law(self) -> FlankFriction:
        """The law along two flanks."""
        from gearmbs.gears import FlankFriction

        if not self.enabled:
            return FlankFriction.none()
        return FlankFriction(self.static, self.dynamic, self.static_speed, self.dynamic_speed)


def _flag_or_none(value: Any) -> Any:
    return None if value is None else flag(value)


class Solver(Section):
    """Integrator, formulation, accuracy and output.

    ``tolerance`` is the local error allowed a step, for lengths of the order of the mechanism. Measured on the paper's
    three states at low load against 1e-9: with WSTIFF mesh harmonics are off by 0.2 % at 1e-7, 2 % at 1e-6, 7 % at
    5e-6, but 16 % at 1e-5 and by a factor of 3 at 3e-5, since steps then skip contacts of tens of micrometres; with IDA
    by 1 % at 1e-7 and 12 % at 1e-6. Below 1e-12 runs only become longer: 1e-11 and 1e-13 differ by two millionths.

    ``signal_rate`` is the sampling rate of the acceleration and its evaluation, ``output_rate`` that of forces and
    contact, a multiple of it. Where they are not given they follow the mesh frequency; see `Case.signal_rate`.

    ``lump`` integrates each gear and its shaft, which are fixed to each other, as one body, and of bodies that turn
    about fixed axes the angles alone; the record is about all bodies as without it. Where it is not given, a case whose
    duration is "auto" is lumped, and so are those of sweeps, campaigns and identifications; others are integrated with
    all bodies, as in the paper. At "auto" the tolerance, where it is not given, is a tenth of the integrator's default.
    """

    section: ClassVar[str] = "solver"

    integrator: Annotated[IntegratorName, BeforeValidator(_upper)] = DEFAULT
    formulation: Annotated[FormulationName, BeforeValidator(_upper)] = "SI2"
    tolerance: float | None = None
    output_rate: q.SamplingRate = None
    signal_rate: q.SamplingRate = None
    lump: Annotated[bool | None, BeforeValidator(_flag_or_none)] = None

    @cached_property
    def used_tolerance(self) -> float:
        """The tolerance, or the integrator's default."""
        return self.tolerance or INTEGRATORS[self.integrator].tolerance

    @model_validator(mode="after")
    def _resolvable(self) -> Solver:
        if self.tolerance is None:
            return self
        low, high = LEAST_TOLERANCE, INTEGRATORS[self.integrator].largest_tolerance
        if not low <= self.tolerance <= high:
            why = "steps would skip contacts" if self.tolerance > high else "rounding errors would be larger"
            raise ValueError(
                f"tolerance = {self.tolerance:g}: {why}; give {low:g} to {high:g} with {self.integrator}, or leave it "
                "out"
            )
        return self

    @model_validator(mode="after")
    def _rates(self) -> Solver:
        if self.signal_rate is None or self.output_rate is None:
            return self
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


class Case(Section, Shown):
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

    @classmethod
    def label(cls, data: Any) -> str:
        """Return how messages name the case made of ``data``."""
        name = data.get("name") if isinstance(data, dict) else None
        return f"case '{name}'" if isinstance(name, str) else "case"

    @model_validator(mode="after")
    def _possible(self) -> Case:
        """Refuse wheels that do not mesh and faults that do not fit, before anything is run."""
        g, f, c = self.gears, self.fault, self.contact
        for name, length in (("fault.backlash", f.backlash), ("contact.depth", c.depth)):
            if length > g.module:
                raise ValueError(
                    f"{name} is {length * 1e3:.6g} mm, more than the module of {g.module * 1e3:.6g} mm; give less (a "
                    "plain number is in m)"
                )
        sound = self._pair(())
        if f.teeth:
            from gearmbs.studies.case.tooth_faults import check_each_fault

            try:
                check_each_fault(sound, f.teeth)
            except ValueError as error:
                raise ValueError(f"fault.teeth{error}") from None
        if sound.misalignment == 0.0 and sound.jams:
            overlap = -sound.normal_backlash
            raise ValueError(
                f"fault.centre_distance_error = {1e3 * f.centre_distance_error:g} mm with fault.backlash = "
                f"{1e3 * f.backlash:g} mm: negative backlash, the teeth overlap by {1e3 * overlap:.4g} mm on both "
                f"flanks; give at least {1e3 * (f.backlash + overlap):.4g} mm of backlash"
            )
        if not f.teeth:
            self.__dict__["_built"] = sound
        return self

    def pair(self) -> GearPair:
        """Return the gear pair of the case."""
        return self._built

    @cached_property
    def _built(self) -> GearPair:
        from gearmbs.studies.case.tooth_faults import tooth_fault

        return self._pair(tuple(tooth_fault(table) for table in self.fault.teeth))

    def _pair(self, faults: tuple) -> GearPair:
        """Return the gear pair of the case with these faults of teeth.

        Raises
        ------
        ValueError
            If the wheels are impossible or do not mesh.
        """
        from gearmbs.gears import GearPair

        f = self.fault
        return GearPair(
            *self.gears.wheels,
            centre_distance_error=f.centre_distance_error,
            misalignment=f.misalignment,
            plane=f.plane,
            pivot=f.pivot,
            axial_shift=f.axial_shift,
            backlash=f.backlash,
            contact=self.contact.law,
            friction=self.friction.law,
            torque=self.operation.top_torque,
            slices=self.contact.slices,
            faults=faults,
        )

    @cached_property
    def mesh_frequency(self) -> float:
        """Gear mesh frequency at the operating speed, the highest if it changes, Hz."""
        return self.gears.teeth[0] * self.operation.top_speed / 6.283185307179586

    @property
    def is_auto(self) -> bool:
        """Whether the record is as long as its question needs."""
        return self.operation.duration == AUTO

    @property
    def lump(self) -> bool:
        """Whether bodies fixed to each other are integrated as one."""
        return self.is_auto if self.solver.lump is None else self.solver.lump

    @property
    def tolerance(self) -> float:
        """The integrator's tolerance."""
        usual = self.solver.used_tolerance
        if not self.is_auto or self.solver.tolerance is not None:
            return usual
        return max(LEAST_TOLERANCE, FINER * usual * min(1.0, self.pair().penetration() / PRESSED_IN))

    def as_one_of_many(self) -> Case:
        """Return the case as sweeps, campaigns and identifications run it where nothing else is said of it.

        The duration is "auto" unless it is given or a curve's, and gear and shaft are one body.
        """
        operation = self.operation
        changes: dict[str, Any] = {}
        curves = operation.speed_curve is not None or operation.torque_curve is not None
        if "duration" not in operation.model_fields_set and not curves:
            changes["operation"] = {"duration": AUTO}
        if self.solver.lump is None:
            changes["solver"] = {"lump": True}
        return self.changed(**changes) if changes else self

    @property
    def angle_turned(self) -> float:
        """Angle that the driver turns during the record, rad."""
        operation = self.operation
        if operation.speed_curve is None:
            return operation.top_speed * operation.longest
        from gearmbs.studies.case.drive import drive_angle

        start = operation.run_up + operation.settling
        angle = drive_angle(operation.speed, operation.run_up, start)
        return angle(start + operation.longest) - angle(start)

    @cached_property
    def signal_rate(self) -> float:
        """Sampling rate of the acceleration, Hz.

        Where it is not given: 12.8 kHz, doubled until five mesh harmonics lie below rate / 2.56, the usable band of
        an analyser. With ``output_rate`` given, the least whole part of that which is as high.
        """
        if self.solver.signal_rate is not None:
            return self.solver.signal_rate
        rate = SIGNAL_RATE
        while KEPT_HARMONICS * self.mesh_frequency > rate / ANALYSER:
            rate *= 2.0
        asked = self.solver.output_rate
        return rate if asked is None else asked / max(1, int(asked // rate))

    @cached_property
    def output_rate(self) -> float:
        """Sampling rate of forces and contact, Hz: given, or the signal's rate doubled until it is 51.2 kHz or more."""
        if self.solver.output_rate is not None:
            return self.solver.output_rate
        rate = 2.0 * self.signal_rate
        while rate < OUTPUT_RATE:
            rate *= 2.0
        return rate

    def changed(self, **sections: Any) -> Case:
        """Return a copy with fields of its sections changed.

        With a new curve of speed or torque the record lasts as long as the curve unless ``duration`` is given, too; of
        a duration that the case was given before a `CaseWarning` says so.

        Examples
        --------
        >>> Case().changed(fault={"misalignment": "1 deg"}).fault.plane
        'skew'
        """
        # sections that stay are taken over as they are: they do not change and have been checked
        data = {name: getattr(self, name) for name in type(self).model_fields}
        for key, value in sections.items():
            own = data.get(key)
            data[key] = own.with_settings(value) if isinstance(own, Section) and isinstance(value, dict) else value
        return make_case(data)

    def __str__(self) -> str:
        """The case file, and what follows from it."""

        rest = f"mesh frequency {self.mesh_frequency:.6g} Hz; settings that are not named are at their defaults"
        return f"{case_toml(self)}# {rest}"

    def settings(self) -> dict[str, Any]:
        """Return all settings as nested dictionaries, quantities as the user wrote them, else in SI."""
        parts = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: part.settings() if isinstance(part, Section) else part for name, part in parts.items()}


def units_of_fields(section: BaseModel) -> dict[str, str]:
    """Return the SI units of those fields of a section of a case that are quantities."""
    units = {name: measure.unit for name, measure in measures_of(type(section)).items()}
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
    return Case.checked(data, source)


def load_case(path: str | Path) -> Case:
    """Read a case file in TOML.

    Raises
    ------
    CaseError
        If the file cannot be read, is not TOML, or has unknown keys, wrong units or impossible values.
    """
    data = read_toml(path, CaseError)
    data.setdefault("name", Path(path).stem)
    return make_case(data, str(path))


# A case as the text of a case file, with quantities in the units they were given in.


def case_toml(case: Section) -> str:
    """Return the case file of a case, from which `gearmbs.load_case` makes it again.

    Settings that were left at their defaults are left out; quantities stand as they were written, or in SI.
    """
    lines = [f"name = {json.dumps(vars(case)['name'])}"]
    tables: list[str] = []
    for key in type(case).model_fields:
        section = getattr(case, key)
        if not isinstance(section, Section) or not section.model_fields_set:
            continue
        values = section.model_dump(exclude_unset=True)
        faults = values.pop("teeth", ()) if key == "fault" else ()
        lines += toml_table(f"[{key}]", values | {k: v for k, v in section.written.items() if k in values})
        for fault in faults:
            tables += toml_table("[[fault.teeth]]", fault)
    return "\n".join([*lines, *tables]) + "\n"


def write_case(case: Section, path: str | Path) -> Path:
    """Write a case as a case file."""
    from gearmbs.files import write_whole

    return write_whole(path, case_toml(case))


def readable(section: Section, key: str) -> str:
    """Return a setting as a user reads it: as written, else in the unit that people use."""
    value, measure = getattr(section, key), measures_of(type(section)).get(key)
    if key in section.written:
        value, measure = section.written[key], None
    if value is None:
        return "default"
    if isinstance(value, tuple | list) and value and isinstance(value[0], tuple | list):
        inner = [(point[0], point[1]) for point in value]
        return ", ".join(f"{_text_of(t, Measure('time'))}: {_text_of(v, measure)}" for t, v in inner)
    if isinstance(value, tuple | list):
        return ", ".join(_text_of(item, measure) for item in value)
    return _text_of(value, measure)


def _text_of(value: Any, measure: Measure | None) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str) or measure is None:
        return f"{value:.6g}" if isinstance(value, float) else str(value)
    unit = measure.shown or measure.unit
    number = value / SHOWN.get(unit, 1.0)
    text = f"{number:.6g}" if math.isfinite(number) else str(number)
    return text if unit == "1" else f"{text} {unit}"


__all__ = [
    "Case",
    "CaseError",
    "CaseWarning",
    "load_case",
    "make_case",
]
