"""What all faults of teeth share: a wheel, a severity, a label, checked settings."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar, Literal

from gearmbs._shown import Written
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.settings import choice, real, switch, tooth_numbers, whole
from gearmbs.gears.spec import convert_fields, require
from gearmbs.gears.tooth_deviations import ToothDeviations

Wheel = Literal["driver", "driven"]
Flank = Literal["drive", "coast", "both"]

CHOICES: dict[str, tuple[Any, ...]] = {
    "wheel": ("driver", "driven"),
    "flank": ("drive", "coast", "both"),
    "end": (1, -1),
}
COAST_ALIASES = {"back": "coast"}
"""The former name of the coast flank, still understood."""


@dataclass(frozen=True, kw_only=True)
class Fault(Written):
    """What all faults share.

    Parameters
    ----------
    wheel : {"driver", "driven"}
        The wheel that has it.

    Raises
    ------
    ValueError
        For a setting of the wrong kind; the message names the field, its value and what would do. What a wheel must
        fit, such as a length along its face, is found when the fault is applied to its wheel.
    """

    label: ClassVar[str] = "fault"
    units: ClassVar[dict[str, str]] = {}
    least: ClassVar[dict[str, int]] = {}
    along_face: ClassVar[bool] = False

    wheel: Wheel = "driver"

    def __post_init__(self) -> None:
        name = type(self).__name__
        for item in fields(self):
            value, place = getattr(self, item.name), f"{name}.{item.name}"
            if item.name in self.units:
                require(value is not None or item.default is None, f"{place} is None; give a number")
            elif item.name in CHOICES:
                value = COAST_ALIASES.get(value, value) if item.name == "flank" and isinstance(value, str) else value
                value = choice(value, place, CHOICES[item.name])
            elif item.name == "teeth":
                value = tooth_numbers(value, place)
            elif isinstance(item.default, bool):
                value = switch(value, place)
            elif isinstance(item.default, int):
                value = whole(value, place, self.least.get(item.name))
            elif isinstance(item.default, float):
                value = real(value, place)
            object.__setattr__(self, item.name, value)
        try:
            convert_fields(self, self.units, name)
        except TypeError as error:
            raise ValueError(str(error)) from None
        for key in self.units:
            value = getattr(self, key)
            require(value is None or math.isfinite(value), f"{name}.{key} is {value}; give a finite number")

    def check_teeth(self, count: int) -> None:
        """Refuse teeth that a wheel of so many teeth does not have; negative numbers count from its last.

        Raises
        ------
        ValueError
            Naming the field, the tooth and those that there are.
        """
        for name in ("tooth", "teeth"):
            numbers = getattr(self, name, ())
            for tooth in (numbers,) if isinstance(numbers, int) else () if isinstance(numbers, str) else numbers:
                require(
                    -count <= tooth < count,
                    f"{type(self).__name__}.{name} is {tooth}; the {self.wheel} wheel has teeth 0 to {count - 1}",
                )

    @property
    def severity(self) -> float:
        """Size of the fault, by its own main parameter."""
        return float(getattr(self, next(iter(self.units))))

    @property
    def description(self) -> dict[str, Any]:
        """Label, severity and all parameters, for storing beside results."""
        return {"label": self.label, "severity": self.severity, **asdict(self)}

    def apply(self, deviations: ToothDeviations, pair: PairGeometry) -> None:
        """Add what the fault does to the deviations of its wheel.

        Parameters
        ----------
        deviations : ToothDeviations
            Of the wheel that has the fault.
        pair : PairGeometry
            The pair it is in.
        """
        raise TypeError(f"{type(self).__name__} does not say what it does to a tooth")
