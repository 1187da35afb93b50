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
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from pydantic import Field, model_validator

from gearmbs._display import Shown
from gearmbs.schema.described import read_toml
from gearmbs.studies.case.section import CaseError, CaseWarning, Section
from gearmbs.studies.case.sections import (
    AUTO,
    LEAST_TOLERANCE,
    Contact,
    FaultSettings,
    FrictionSettings,
    Gears,
    Operation,
    Shafts,
    Solver,
)
from gearmbs.studies.case.texts import case_toml

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gearmbs.gears import GearPair
    from gearmbs.mechanism import TimeFunction
    from gearmbs.studies.case.keywords import (
        ContactKeywords,
        FaultKeywords,
        FrictionKeywords,
        GearsKeywords,
        OperationKeywords,
        ShaftsKeywords,
        SolverKeywords,
    )

SIGNAL_RATE, OUTPUT_RATE = 12800.0, 51200.0
"""Least sampling rates, Hz, where a case gives none: natural frequencies do not fall with the speed."""

KEPT_HARMONICS, ANALYSER = 5, 2.56
"""Mesh harmonics that a default rate holds, and the ratio of rate to highest frequency that analysers use."""

EDGE = 0.01
"""Simulated beyond both ends of the record at least, s, for the filters to settle."""

FINER = 0.1
"""Tolerance of a record at `AUTO` over that of others: a mesh period of the paper's states then repeats itself to 0.2 %
of its harmonics, at the usual tolerance to 2 %, which long records average out."""

PRESSED_IN = 20e-6
"""Static penetration of a tooth pair, m, below which that tolerance falls in proportion: at a fifth of the load of the
paper's pair, whose teeth are pressed in by 24 um, harmonics were 0.9 % off without."""


class CaseKeywords(TypedDict, total=False):
    """Fields of a `gearmbs.studies.Case`."""

    name: str
    gears: Gears | GearsKeywords
    shafts: Shafts | ShaftsKeywords
    operation: Operation | OperationKeywords
    fault: FaultSettings | FaultKeywords
    contact: Contact | ContactKeywords
    friction: FrictionSettings | FrictionKeywords
    solver: Solver | SolverKeywords


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

    if TYPE_CHECKING:  # pydantic makes it of the fields, which take more than they hold

        def __init__(self, **sections: Unpack[CaseKeywords]) -> None: ...

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
        if self.shafts.are_parts:
            from gearmbs.studies.case.train import parts_of

            try:
                parts_of(self)
            except CaseError as error:
                raise ValueError(str(error).partition(": ")[2]) from None
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

    @cached_property
    def driver_angle(self) -> TimeFunction:
        """Angle of the driver over time from rest, rad."""
        from gearmbs.studies.case.drive import drive_angle

        operation = self.operation
        return drive_angle(operation.speed, operation.run_up, operation.run_up + operation.settling)

    @property
    def angle_turned(self) -> float:
        """Angle that the driver turns during the record, rad."""
        operation = self.operation
        if operation.speed_curve is None:
            return operation.top_speed * operation.longest
        start, angle = operation.run_up + operation.settling, self.driver_angle
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

    @cached_property
    def edge(self) -> float:
        """What is simulated beyond both ends of the record, s: half the length of the anti-alias filter."""
        return _edge(self.output_rate, self.signal_rate)

    def changed(self, **sections: Unpack[CaseKeywords]) -> Case:
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


@lru_cache(maxsize=64)
def _edge(rate: float, signal_rate: float) -> float:
    """Return `Case.edge` by the rates of the forces and of the signal made of them."""
    from gearmbs.signals.filters import decimation_taps

    ratio = round(rate / signal_rate)
    if ratio == 1:
        return EDGE
    taps = decimation_taps(ratio, rate).size
    return max(EDGE, math.ceil(0.5 * taps + 1) / rate)


def make_case(data: Mapping[str, object], source: str = "case") -> Case:
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


__all__ = [
    "Case",
    "CaseError",
    "CaseWarning",
    "load_case",
    "make_case",
]
