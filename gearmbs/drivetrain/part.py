"""What all parts of a drivetrain share: a name, quantities in SI or as texts with units, checked numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Real
from typing import Any, ClassVar

from gearmbs._shown import Written
from gearmbs.drivetrain.errors import DrivetrainError, require
from gearmbs.units import to_si


@dataclass(frozen=True, kw_only=True)
class Part(Written):
    """A named part.

    Parameters
    ----------
    name : str
        Unique among all parts of the drivetrain.

    Raises
    ------
    DrivetrainError
        For a value that is no quantity of its kind, is not finite, or is outside its range.
    """

    title: ClassVar[str] = "part"
    """What messages call it."""
    units: ClassVar[Mapping[str, str]] = {}
    """Dimension or unit of each quantity."""
    positive: ClassVar[tuple[str, ...]] = ()
    """Fields that must be above zero."""
    not_negative: ClassVar[tuple[str, ...]] = ()

    functions: ClassVar[tuple[str, ...]] = ()
    """Fields that may be functions of time."""

    name: str

    def __post_init__(self) -> None:
        require(isinstance(self.name, str) and bool(self.name), f"{self.title}: name {self.name!r}; give a text")
        for field, unit in self.units.items():
            value = getattr(self, field)
            if value is not None:
                object.__setattr__(self, field, self._in_si(field, value, unit))
        for field in self.functions:
            value = getattr(self, field)
            require(
                not isinstance(value, Real) or math.isfinite(value),
                f"{self.label}: {field} is {value}; give a finite number, a quantity or an expression of time",
            )
        for field in (*self.positive, *self.not_negative):
            value = getattr(self, field)
            if value is None:
                continue
            low = "positive" if field in self.positive else "not negative"
            for number in value if isinstance(value, tuple) else (value,):
                fine = number > 0.0 if field in self.positive else number >= 0.0
                require(fine, f"{self.label}: {field} is {number:g} {self.units[field]}; it must be {low}")

    def _in_si(self, field: str, value: Any, unit: str) -> Any:
        if isinstance(value, list | tuple):
            require(len(value) > 0, f"{self.label}: {field} is empty; give a number in SI, or a text with a unit")
            return tuple(self._in_si(field, item, unit) for item in value)
        try:
            number = to_si(value, unit, f"{self.label}: {field}")
        except (TypeError, ValueError) as error:
            raise DrivetrainError(str(error)) from None
        require(math.isfinite(number), f"{self.label}: {field} is {number}; give a finite number")
        return number

    @property
    def label(self) -> str:
        """What messages call this part, with its name."""
        return f"{self.title} '{self.name}'"

    def settings(self) -> dict[str, Any]:
        """Return the fields that differ from their defaults, by name, in SI."""
        return {
            f.name: getattr(self, f.name)
            for f in fields(self)
            if f.name != "name" and getattr(self, f.name) != f.default
        }
