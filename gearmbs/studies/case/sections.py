"""The sections of a case (wheels, shafts, operation, fault, contact, friction, solver), with their units and limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, Field, model_validator

from gearmbs.dae.methods import DEFAULT, FORMULATIONS, INTEGRATORS
from gearmbs.schema.quantities import flag, two
from gearmbs.studies.case import section as q
from gearmbs.studies.case.section import CaseWarning, Section, measures_of
from gearmbs.units import to_si
from gearmbs.wording import warn

if TYPE_CHECKING:
    from typing import Unpack

    from gearmbs.gears import ContactLaw, FlankFriction, GearSpec
    from gearmbs.studies.case import keywords as told

    IntegratorName = str
    FormulationName = str
else:
    IntegratorName = Literal[tuple(INTEGRATORS)]
    FormulationName = Literal[tuple(FORMULATIONS)]

LEAST_TOLERANCE = 1e-12
"""Lower limit of ``solver.tolerance``; upper ones and defaults are in the table of integrators, see `Solver`."""

WHEELS = ("driver", "driven")

AUTO = "auto"
"""Duration of a record that is as long as its question needs."""

LONGEST = 1.0
"""Seconds of a record whose length nobody gave: always of a single case, at most of one with the duration `AUTO`."""


def _both(value: Any) -> Any:
    """Return one value for both wheels as two."""
    return two(value) if isinstance(value, Sequence) and not isinstance(value, str) else (value, value)


def _designations(value: Any) -> Any:
    """Return one designation for both shafts as two."""
    return value if value is None else (value, value) if isinstance(value, str) else two(value)


def _modes(value: Any) -> Any:
    counted = isinstance(value, int) and not isinstance(value, bool) and value >= 1
    if value is None or value == "all" or counted:
        return value
    raise ValueError("give a whole number from 1 up, or 'all'; leave it out for rigid shafts")


def _upper(value: Any) -> Any:
    return value.upper() if isinstance(value, str) else value


class Gears(Section):
    """The wheels: the paper's table, or numbers of one's own.

    Attributes are those of :class:`gearmbs.gears.GearSpec` and its material; all but module, pressure angle and those
    of the helix may be given once for both wheels or as a list of two, driver and driven. ``tip_radius`` and
    ``root_radius`` take the place of ``addendum`` and ``dedendum``. ``hand`` is the driver's, to which the driven
    wheel's follows; with ``internal`` this one is a ring.
    """

    section: ClassVar[str] = "gears"

    teeth: Annotated[tuple[int, int], BeforeValidator(_both), q.NO_TRUTH] = (29, 29)
    module: q.Module = 95e-3 / 31
    pressure_angle: q.PressureAngle = Field(default=0.3490658503988659)
    face_width: q.FaceWidth = 0.020
    addendum: q.ToothLength = None
    dedendum: q.ToothLength = None
    tip_radius: q.WheelRadius = None
    root_radius: q.WheelRadius = None
    fillet_radius: q.ToothLength = None
    profile_shift: Annotated[tuple[float, float], BeforeValidator(_both), q.NO_TRUTH] = (0.0, 0.0)
    bore_radius: q.BoreRadius = 0.0
    tip_rounding: q.TipRounding = 0.0
    density: q.WheelDensity = 7850.0
    youngs_modulus: q.Modulus = 2.07e11
    poisson_ratio: q.PoissonRatio = 0.29
    helix_angle: q.HelixAngle = 0.0
    hand: Literal["right", "left"] = "right"
    internal: Annotated[bool, BeforeValidator(flag)] = False

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.GearsKeywords]) -> None: ...

    @model_validator(mode="after")
    def _radii(self) -> Gears:
        for radius, height, outwards in (("tip_radius", "addendum", 1.0), ("root_radius", "dedendum", -1.0)):
            if getattr(self, radius) is None:
                continue
            if getattr(self, height) is not None:
                raise ValueError(f"{radius} and {height} say the same; give one of them")
            for wheel, name in enumerate(WHEELS):
                value, pitch = self.of_wheel(radius, wheel), self._pitch_radius(wheel)
                beyond = -outwards if self._is_ring(wheel) else outwards
                if beyond * (value - pitch) <= 0.0:
                    raise ValueError(
                        f"{radius} of the {name} wheel is {value * 1e3:.4f} mm, "
                        f"{'inside' if beyond > 0 else 'outside'} its pitch circle of {pitch * 1e3:.4f} mm; "
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
        return abs(radius - self._pitch_radius(wheel))

    def _pitch_radius(self, wheel: int) -> float:
        return 0.5 * self.module * self.teeth[wheel] / math.cos(self.helix_angle)

    def _is_ring(self, wheel: int) -> bool:
        return self.internal and wheel == 1

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
        own = ("face_width", "fillet_radius", "tip_rounding")
        is_ring = self._is_ring(wheel)
        # a ring has the hand of its mate, and no bore
        other: Literal["right", "left"] = "left" if self.hand == "right" else "right"
        return GearSpec(
            self.teeth[wheel],
            self.module,
            self.pressure_angle,
            addendum=self.height(wheel, above=True),
            dedendum=self.height(wheel, above=False),
            profile_shift=self.profile_shift[wheel],
            material=material,
            name=WHEELS[wheel],
            helix_angle=self.helix_angle,
            hand=self.hand if wheel == 0 or is_ring else other,
            internal=is_ring,
            bore_radius=0.0 if is_ring else self.of_wheel("bore_radius", wheel),
            **{key: self.of_wheel(key, wheel) for key in own},
        )


class Shafts(Section):
    """Both shafts: cylinders of steel centred on their wheels.

    They are rigid and turn in revolute joints, unless it is said otherwise; see `gearmbs.studies.case.train`.

    Attributes
    ----------
    modes : int or "all", optional
        The shafts bend, twist and stretch, by so many of their shapes beside those of what they carry, as of
        `gearmbs.drivetrain.Shaft`.
    bearings : str or sequence of 2 str, optional
        Rolling bearings by their designation, two on each shaft: of all, or of the driver's and of the driven shaft.
    bearing_distance : float or str, optional
        Between the bearings of a shaft, which stand as far from the wheel on either side; default: its length.
    """

    section: ClassVar[str] = "shafts"

    radius: q.ShaftRadius = 0.015
    length: q.ShaftLength = 0.200
    density: q.Density = 7850.0
    modes: Annotated[int | Literal["all"] | None, BeforeValidator(_modes), q.NO_TRUTH] = None
    bearings: Annotated[tuple[str, str] | None, BeforeValidator(_designations)] = None
    bearing_distance: q.BearingDistance = None

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.ShaftsKeywords]) -> None: ...

    @property
    def are_parts(self) -> bool:
        """Whether they bend or stand in rolling bearings, so that the case is simulated as a drivetrain's parts."""
        return self.modes is not None or self.bearings is not None

    @model_validator(mode="after")
    def _seated(self) -> Shafts:
        distance = self.bearing_distance
        if distance is None:
            return self
        if not self.are_parts:
            raise ValueError(
                f"bearing_distance is {distance * 1e3:g} mm, but the shafts are rigid and turn in joints; give "
                "bearings or modes, too"
            )
        if distance > self.length:
            raise ValueError(
                f"bearing_distance is {distance * 1e3:g} mm, and the shafts are {self.length * 1e3:g} mm long; give "
                "less, or a greater length"
            )
        return self


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

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.OperationKeywords]) -> None: ...

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

    def with_settings(self, changes: Mapping[str, Any]) -> dict[str, Any]:
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
                warn(
                    f"operation.duration = {asked!r}, given before, goes: the record lasts as long as the new curve; "
                    f"give 'duration': {asked!r} beside the curve to keep it",
                    CaseWarning,
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

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.FaultKeywords]) -> None: ...


class Contact(Section):
    """IMPACT law of the paper's eq. (10)-(11): stiffness in N/m^e by text, e.g. "2.9852e5 N/mm^1.3"."""

    section: ClassVar[str] = "contact"

    stiffness: Annotated[float | str, q.NO_TRUTH] = "2.9852e5 N/mm^1.3"
    exponent: Annotated[float, q.NO_TRUTH] = Field(default=1.3, ge=1.0)
    damping: Annotated[float | str, q.NO_TRUTH] = "298.52 N s/mm"
    depth: q.Depth = 0.0001
    slices: Annotated[int | None, q.NO_TRUTH] = Field(default=None, ge=1)

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.ContactKeywords]) -> None: ...

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
    static: Annotated[float, q.NO_TRUTH] = Field(default=0.1, ge=0)
    dynamic: Annotated[float, q.NO_TRUTH] = Field(default=0.05, ge=0)
    static_speed: q.SlidingSpeed = 0.1
    dynamic_speed: q.SlidingSpeed = 1.0

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.FrictionKeywords]) -> None: ...

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
    tolerance: Annotated[float | None, q.NO_TRUTH] = None
    output_rate: q.SamplingRate = None
    signal_rate: q.SamplingRate = None
    lump: Annotated[bool | None, BeforeValidator(_flag_or_none)] = None

    if TYPE_CHECKING:

        def __init__(self, **fields: Unpack[told.SolverKeywords]) -> None: ...

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


def units_of_fields(section: BaseModel) -> dict[str, str]:
    """Return the SI units of those fields of a section of a case that are quantities."""
    units = {name: measure.unit for name, measure in measures_of(type(section)).items()}
    if isinstance(section, Contact):
        units |= {"stiffness": section.stiffness_unit, "damping": "N s/m"}
    return units
