"""Quantities of a case: texts with units or plain numbers in SI, within a range that gears can have.

The ranges are wide. They are there because a plain number is in SI: ``module = 3`` is three metres, and a pair of
wheels of that size would be simulated without complaint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from gearmbs.units import DIMENSIONS, to_si

SHOWN = {"mm": 1e-3, "deg": math.pi / 180.0, "rpm": math.pi / 30.0, "GPa": 1e9}
"""Units of messages that are not SI, and what they are in SI."""


@dataclass(frozen=True)
class Measure:
    """What a field of a case measures, between which limits.

    Attributes
    ----------
    dimension : str
        One of `gearmbs.units.DIMENSIONS`.
    low, high : float, optional
        Limits, included, in ``shown``.
    shown : str
        Unit of the limits and of messages; default the SI unit.
    each : bool
        Whether driver and driven may have values of their own, as a list of two.
    curve : bool
        Whether the value may be a curve, as a list of points (time, value); zero is possible there.
    """

    dimension: str
    low: float | None = None
    high: float | None = None
    shown: str = ""
    each: bool = False
    curve: bool = False

    @property
    def unit(self) -> str:
        """The SI unit the field holds."""
        return "1" if self.dimension == "dimensionless" else DIMENSIONS[self.dimension].replace("*", " ")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def read(self, value: Any) -> Any:
        """Return the value in SI, or for a list of two both.

        Raises
        ------
        ValueError
            For a wrong unit or a value outside the limits.
        """
        if value is None:
            return None
        if self.each and isinstance(value, Sequence) and not isinstance(value, str):
            if len(value) != 2:
                raise ValueError(f"{len(value)} values; give one for both wheels, or those of driver and driven")
            return tuple(self._one(item) for item in value)
        if self.curve and isinstance(value, Sequence) and not isinstance(value, str):
            return self._points(value)
        return self._one(value)

    def _points(self, value: Sequence) -> tuple[tuple[float, float], ...]:
        """Return the points of a curve in s and SI."""
        points: list[tuple[float, float]] = []
        for place, point in enumerate(value, 1):
            if isinstance(point, str) or not isinstance(point, Sequence) or len(point) != 2:
                raise ValueError(
                    f"a curve is a list of points [time, value] such as [['0 s', '0 {self.shown or self.unit}'], "
                    f"['2 s', ...]]; point {place} is {point!r}"
                )
            try:
                time = to_si(point[0], "time", "value")
                zero = to_si(point[1], self.dimension, "value") == 0.0
            except (TypeError, ValueError) as error:
                raise ValueError(f"point {place}: {str(error).removeprefix('value: ')}") from None
            if (
                not math.isfinite(time)
                or time < (points[-1][0] if points else 0.0)
                or (points and time == points[-1][0])
            ):
                raise ValueError(f"point {place} is at {time:g} s; give times from 0 on that increase")
            try:
                points.append((time, 0.0 if zero else self._one(point[1])))
            except ValueError as error:
                raise ValueError(f"point {place}: {error}") from None
        if len(points) < 2 or not any(number for _, number in points):
            raise ValueError("a curve needs two points at least, and one that is not zero")
        return tuple(points)

    def _one(self, value: Any) -> float:
        try:
            number = to_si(value, self.dimension, "value")
        except (TypeError, ValueError) as error:
            raise ValueError(str(error).removeprefix("value: ")) from None
        shown = self.shown or self.unit
        factor = SHOWN.get(shown, 1.0)
        low, high = (None if limit is None else limit * factor for limit in (self.low, self.high))
        if (low is None or number >= low * (1.0 - 1e-12)) and (high is None or number <= high * (1.0 + 1e-12)):
            return float(number)
        span = f"{_plain(self.low)} to {_plain(self.high)}" if self.high is not None else f"{_plain(self.low)} or more"
        if self.low is None:
            span = f"up to {_plain(self.high)}"
        if shown == "1":
            raise ValueError(f"give {span}")
        text = f"this is {number / factor:.6g} {shown}; give {span} {shown}"
        if isinstance(value, str):
            raise ValueError(text)
        meant = float(value) * factor
        if shown == self.unit or (low is not None and meant < low) or (high is not None and meant > high):
            raise ValueError(f"{text} (a plain number is in {self.unit})")
        raise ValueError(f"{text} (a plain number is in {self.unit}; write '{value} {shown}' if that is meant)")


def _plain(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


Module = Annotated[float, Measure("length", 0.05, 100, "mm")]
FaceWidth = Annotated[float | tuple[float, float], Measure("length", 0.01, 2000, "mm", each=True)]
ToothLength = Annotated[float | tuple[float, float] | None, Measure("length", None, 300, "mm", each=True)]
WheelRadius = Annotated[float | tuple[float, float] | None, Measure("length", 0.1, 5000, "mm", each=True)]
BoreRadius = Annotated[float | tuple[float, float], Measure("length", 0, 5000, "mm", each=True)]
TipRounding = Annotated[float | tuple[float, float], Measure("length", 0, 100, "mm", each=True)]
ShaftRadius = Annotated[float, Measure("length", 0.1, 5000, "mm")]
ShaftLength = Annotated[float, Measure("length", 0.1, 50000, "mm")]
Shift = Annotated[float, Measure("length", -2000, 2000, "mm")]
DistanceError = Annotated[float, Measure("length", -100, 100, "mm")]
Backlash = Annotated[float, Measure("length", None, 20, "mm")]
Depth = Annotated[float, Measure("length", 1e-6, 10, "mm")]
PressureAngle = Annotated[float, Measure("angle", 5, 40, "deg")]
Misalignment = Annotated[float, Measure("angle", -10, 10, "deg")]
Density = Annotated[float, Measure("density", 10, 30000)]
WheelDensity = Annotated[float | tuple[float, float], Measure("density", 10, 30000, each=True)]
Modulus = Annotated[float | tuple[float, float], Measure("pressure", 0.001, 2000, "GPa", each=True)]
PoissonRatio = Annotated[float | tuple[float, float], Measure("dimensionless", 0, 0.499, each=True)]
Points = tuple[tuple[float, float], ...]
AngularSpeed = Annotated[float | Points, Measure("angular speed", 0.01, 1e6, "rpm", curve=True)]
TorqueValue = Annotated[float | Points, Measure("torque", 1e-6, 1e8, curve=True)]
RunUp = Annotated[float, Measure("time", 1e-5, 1000)]
Settling = Annotated[float, Measure("time", 0, 1000)]
Duration = Annotated[float, Measure("time", 1e-5, 10000)]
SamplingRate = Annotated[float | None, Measure("frequency", 1, 1e7)]
SlidingSpeed = Annotated[float, Measure("speed", 1e-6, 1000)]
