"""What all parts of a drivetrain share: a name, quantities in SI or as texts with units, checked numbers, an error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

from gearmbs._display import html_table, readable, settings_of
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.functions import TimeFunction, as_function, constant, step
from gearmbs.mechanism.parts.inputs import Input
from gearmbs.schema.described import Described
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism


class DrivetrainError(ValueError):
    """A drivetrain that cannot be built or simulated; the message names the part, the value and the remedy."""


@contextmanager
def errors_named(part: str) -> Iterator[None]:
    """Turn errors of what a part is made of into a `DrivetrainError` that names the part."""
    try:
        yield
    except DrivetrainError:
        raise
    except (TypeError, ValueError) as error:
        text = str(error).replace("\n", " ")
        raise DrivetrainError(text if text.startswith(part) else f"{part}: {text}") from None


def require(condition: bool, message: str) -> None:
    """Raise a DrivetrainError with the message unless the condition holds."""
    if not condition:
        raise DrivetrainError(message)


@dataclass(frozen=True, kw_only=True)
class Part(Described):
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
    error: ClassVar[type[ValueError]] = DrivetrainError

    name: str

    def __post_init__(self) -> None:
        super().__post_init__()
        require(bool(self.name), f"{self.title}: name is empty; give a text")

    @property
    def place(self) -> str:
        """What messages put in front of a field's name."""
        return f"{self.label}: "

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


# Where a drive, load or coupling is attached, and what it needs to know of its shaft.


@dataclass(frozen=True)
class Attached:
    """Markers and kinematics of one place on a shaft.

    Attributes
    ----------
    mechanism : Mechanism
    i : Marker
        On the shaft, z along its axis.
    j : Marker
        Coinciding with it, on what takes the reaction; of a coupling on the first shaft.
    speed : float
        Operating speed of the shaft about z, rad/s, with its sign.
    run_up : float
        Duration of the STEP of speeds and loads, s.
    running : bool
        Whether the shafts turn at their operating speeds from the start.
    """

    mechanism: Mechanism
    i: Marker
    j: Marker
    speed: float
    run_up: float
    running: bool

    @property
    def sense(self) -> int:
        """Sense of rotation about z, 1 or -1."""
        return -1 if self.speed < 0.0 else 1


def fixed_value(value: Any, unit: str) -> float | None:
    """Return the number that a number or a text with a unit stands for; None for functions and expressions of time."""
    if isinstance(value, TimeFunction):
        return None
    try:
        return to_si(value, unit, "value")
    except (TypeError, ValueError):
        return None


def over_time(value: Any, unit: str, label: str, at: Attached) -> TimeFunction:
    """Return a function of time: a number is reached by a STEP over the run-up, an input becomes one of the mechanism.

    Raises
    ------
    DrivetrainError
        If it is no number, quantity or expression.
    """
    number = fixed_value(value, unit)
    if number is None:
        try:
            if isinstance(value, Input):
                at.mechanism.inputs.setdefault(value.name, value)
            return as_function(value, unit, label)
        except ValueError as error:
            raise DrivetrainError(str(error)) from None
    return step(0.0, 0.0, at.run_up, number)


def share_of(at: Attached) -> TimeFunction:
    """Return what switches a motor or load on over the run-up; 1 in a train that runs already."""
    return constant(1.0) if at.running else step(0.0, 0.0, at.run_up, 1.0)


# The parts of a drivetrain as a table for notebooks, as they were given.


def parts_html(name: str, parts: Iterable[Part], laws: Mapping[str, str]) -> str:
    """Return the parts of a drivetrain with their settings that are not at their defaults, meshes with their laws."""
    rows = []
    for part in parts:
        settings = [f"{key.replace('_', ' ')} {readable(value)}" for key, value in settings_of(part)[1:]]
        if part.name in laws:
            settings.append(f"law {laws[part.name]}")
        rows.append((part.title, part.name, "; ".join(settings)))
    return html_table(f"Drivetrain {name}", ("", "part", "settings"), rows)
