"""Where a drive, load or coupling is attached, and what it needs to know of its shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gearmbs.drivetrain.errors import DrivetrainError
from gearmbs.mechanism.functions import TimeFunction, as_function, constant, step
from gearmbs.mechanism.parts import Marker
from gearmbs.units import to_si

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism


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
    """Return a function of time: a number is reached by a STEP over the run-up.

    Raises
    ------
    DrivetrainError
        If it is no number, quantity or expression.
    """
    number = fixed_value(value, unit)
    if number is None:
        try:
            return as_function(value, unit, label)
        except ValueError as error:
            raise DrivetrainError(str(error)) from None
    return step(0.0, 0.0, at.run_up, number)


def share_of(at: Attached) -> TimeFunction:
    """Return what switches a motor or load on over the run-up; 1 in a train that runs already."""
    return constant(1.0) if at.running else step(0.0, 0.0, at.run_up, 1.0)
