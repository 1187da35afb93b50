"""Settings of a rolling bearing in a mechanism."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gearmbs.bearings.defects import Defect, LooseFit, as_defects
from gearmbs.bearings.errors import BearingError, require
from gearmbs.bearings.geometry import Bearing
from gearmbs.units import Quantity, to_si


@dataclass(eq=False, repr=False, kw_only=True)
class BearingSettings:
    """Settings of a rolling bearing in a mechanism; see `gearmbs.bearings.RollingBearing`."""

    bearing: Bearing
    damping: Quantity = 1e-5
    cage_slip: float = 0.0
    slip_scatter: float = 0.0
    slip_memory: float = 0.25
    slip_seed: int = 0
    cage_angle: Quantity = 0.0
    preload: Quantity = 0.0
    sense: int = 1
    centrifugal: bool = False
    smooth: Quantity = 0.0
    rolling_friction: float = 0.0
    viscous_friction: float = 0.0
    slow_speed: Quantity = 1.0
    slices: int = 15
    stiffness: float | None = None
    defects: Sequence[Defect] = ()

    def __post_init__(self) -> None:
        units = {"damping": "time", "cage_angle": "angle", "preload": "force", "smooth": "length",
                 "slow_speed": "angular speed"}  # fmt: skip
        for name, unit in units.items():
            try:
                setattr(self, name, to_si(getattr(self, name), unit, f"RollingBearing.{name}"))
            except (TypeError, ValueError) as error:
                raise BearingError(str(error)) from None
        require(isinstance(self.bearing, Bearing), f"RollingBearing.bearing is {self.bearing!r}; give a Bearing")
        for name in ("damping", "preload", "smooth", "rolling_friction", "viscous_friction"):
            value = getattr(self, name)
            require(value >= 0.0, f"RollingBearing.{name} is {value!r}; it must not be negative")
        require(self.slow_speed > 0.0, f"RollingBearing.slow_speed is {self.slow_speed}; it must be positive")
        require(-0.5 < self.cage_slip < 0.5, f"RollingBearing.cage_slip is {self.cage_slip}; give a share such as 0.01")
        require(
            0.0 <= self.slip_scatter < 0.2,
            f"RollingBearing.slip_scatter is {self.slip_scatter}; give a share such as 0.01",
        )
        require(
            0.01 <= self.slip_memory <= 100.0,
            f"RollingBearing.slip_memory is {self.slip_memory}; give turns of the cage, 0.01 to 100",
        )
        whole = isinstance(self.slip_seed, int) and not isinstance(self.slip_seed, bool) and self.slip_seed >= 0
        require(whole, f"RollingBearing.slip_seed is {self.slip_seed!r}; give a whole number from 0 up")
        require(self.sense in (1, -1), f"RollingBearing.sense is {self.sense!r}; give 1 or -1")
        require(1 <= self.slices <= 99, f"RollingBearing.slices is {self.slices!r}; give 1 to 99")
        require(self.stiffness is None or self.stiffness > 0.0, f"RollingBearing.stiffness is {self.stiffness}")
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
