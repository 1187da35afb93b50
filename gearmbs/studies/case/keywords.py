"""Fields of the sections of a case as they are given, for type checkers and editors; see `CaseKeywords`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypedDict

if TYPE_CHECKING:
    from typing import TypeAlias

    from gearmbs.gears.faults import Fault
    from gearmbs.units import QuantityLike

    # one for both wheels, or those of driver and driven
    Each = QuantityLike | Sequence[QuantityLike]
    # a number, or points (time, value)
    Curve = QuantityLike | Sequence[Sequence[QuantityLike]]
    OneFault: TypeAlias = str | Fault | Mapping[str, object]


class GearsKeywords(TypedDict, total=False):
    """Fields of the wheels, see `gearmbs.studies.case.sections.Gears`."""

    teeth: int | Sequence[int]
    module: QuantityLike
    pressure_angle: QuantityLike
    face_width: Each
    addendum: Each | None
    dedendum: Each | None
    tip_radius: Each | None
    root_radius: Each | None
    fillet_radius: Each | None
    profile_shift: float | Sequence[float]
    bore_radius: Each
    tip_rounding: Each
    density: Each
    youngs_modulus: Each
    poisson_ratio: float | Sequence[float]
    helix_angle: QuantityLike
    hand: Literal["right", "left"]
    internal: bool


class ShaftsKeywords(TypedDict, total=False):
    """Fields of both shafts."""

    radius: QuantityLike
    length: QuantityLike
    density: QuantityLike
    modes: int | Literal["all"] | None
    bearings: str | Sequence[str] | None
    bearing_distance: QuantityLike | None


class OperationKeywords(TypedDict, total=False):
    """Fields of speed, load and recording."""

    speed: Curve
    torque: Curve
    run_up: QuantityLike
    settling: QuantityLike
    duration: QuantityLike


class FaultKeywords(TypedDict, total=False):
    """Fields of the pair's deviations and faults."""

    misalignment: QuantityLike
    plane: Literal["skew", "inclination"]
    pivot: QuantityLike
    centre_distance_error: QuantityLike
    axial_shift: QuantityLike
    backlash: QuantityLike
    teeth: OneFault | Sequence[OneFault]


class ContactKeywords(TypedDict, total=False):
    """Fields of the law of the flanks."""

    stiffness: float | str
    exponent: float
    damping: float | str
    depth: QuantityLike
    slices: int | None


class FrictionKeywords(TypedDict, total=False):
    """Fields of the friction of the flanks."""

    enabled: bool
    static: float
    dynamic: float
    static_speed: QuantityLike
    dynamic_speed: QuantityLike


class SolverKeywords(TypedDict, total=False):
    """Fields of integrator, accuracy and output."""

    integrator: str
    formulation: str
    tolerance: float | None
    output_rate: QuantityLike | None
    signal_rate: QuantityLike | None
    lump: bool | None
