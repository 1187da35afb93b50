"""Settings of a rolling bearing in a mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from gearmbs.bearings.defects import LooseFit, as_defects
from gearmbs.bearings.errors import BearingError, require
from gearmbs.bearings.geometry import Bearing
from gearmbs.schema.described import Described, make
from gearmbs.schema.quantities import Measure, OneOf
from gearmbs.units import Quantity

SHARE = "give a share such as 0.01"
Share = Annotated[Quantity, Measure(low=0)]


@dataclass(eq=False, repr=False, kw_only=True)
class BearingSettings(Described):
    """Settings of a rolling bearing in a mechanism; see `gearmbs.bearings.RollingBearing`."""

    error: ClassVar[type[ValueError]] = BearingError
    section: ClassVar[str] = "RollingBearing"

    bearing: Bearing
    damping: Annotated[Quantity, Measure("time", 0)] = 1e-5
    cage_slip: Annotated[Quantity, Measure(above=-0.5, below=0.5, remedy=SHARE)] = 0.0
    slip_scatter: Annotated[Quantity, Measure(low=0, below=0.2, remedy=SHARE)] = 0.0
    slip_memory: Annotated[Quantity, Measure(low=0.01, high=100, remedy="give turns of the cage, 0.01 to 100")] = 0.25
    slip_seed: Annotated[int, Measure(low=0, whole=True)] = 0
    cage_angle: Annotated[Quantity, Measure("angle")] = 0.0
    preload: Annotated[Quantity, Measure("force", 0)] = 0.0
    sense: Annotated[int, OneOf((1, -1))] = 1
    centrifugal: bool = False
    smooth: Annotated[Quantity, Measure("length", 0)] = 0.0
    rolling_friction: Share = 0.0
    viscous_friction: Share = 0.0
    slow_speed: Annotated[Quantity, Measure("angular speed", above=0)] = 1.0
    slices: Annotated[int, Measure(low=1, high=99, whole=True)] = 15
    stiffness: Annotated[Quantity, Measure(above=0)] = None
    defects: Any = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.centrifugal:
            require(self.smooth == 0.0, "RollingBearing.smooth: not together with the centrifugal load; leave it 0")
            require(self.stiffness is None, "RollingBearing.stiffness: with centrifugal load each contact has its own")
        self.defects = as_defects(self.defects)
        for defect in self.defects:
            require(
                not isinstance(defect, LooseFit),
                "RollingBearing.defects holds a LooseFit: such a ring is a body; use gearmbs.bearings.add_bearing",
            )
            defect.check(self.bearing)


def bearing_settings(bearing: Bearing, given: Mapping[str, Any], label: str) -> BearingSettings:
    """Return the settings of a bearing; ``label`` is what messages about their names begin with."""
    return make(BearingSettings, given, label, BearingError, "{!r} is unknown", bearing=bearing)
