"""What is measured on a drivetrain: shaft velocity by laser, acceleration at a seat, speed, torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gearmbs.drivetrain.errors import require
from gearmbs.drivetrain.part import Part
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity

Direction = Annotated[tuple[float, float, float], Measure(several=3)]


@dataclass(frozen=True, kw_only=True)
class Sensor(Part):
    """What all sensors share: a name."""

    title: ClassVar[str] = "sensor"
    kind: ClassVar[str] = "sensor"
    unit: ClassVar[str] = "1"


def _check_direction(sensor: Laser | Accelerometer) -> None:
    require(any(sensor.direction), f"{sensor.label}: direction is {sensor.direction}; give one that is not all zero")


@dataclass(frozen=True, kw_only=True)
class Laser(Sensor):
    """A laser vibrometer on a shaft: the velocity (v + w x r) . d of the surface under a spot fixed in space.

    Parameters
    ----------
    shaft : str
    station : float or str, optional
        Of the spot along the shaft, m; default: its middle.
    direction : sequence of 3 floats
        d, from the shaft towards the laser, global components.
    offset : float or str
        Of the line of sight from the axis, m; 0: aimed at the axis, where the spin itself does not show.
    """

    kind: ClassVar[str] = "laser"
    unit: ClassVar[str] = "m/s"

    shaft: str
    station: Annotated[Quantity, Measure("length")] = None
    direction: Direction = (1.0, 0.0, 0.0)
    offset: Annotated[Quantity, Measure("length")] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_direction(self)


@dataclass(frozen=True, kw_only=True)
class Accelerometer(Sensor):
    """Acceleration of the housing at the seat of a bearing, along a direction.

    Parameters
    ----------
    bearing : str
        At its seat, which must be on a housing.
    direction : sequence of 3 floats
        Global components at the start.
    """

    kind: ClassVar[str] = "accelerometer"
    unit: ClassVar[str] = "m/s^2"

    bearing: str
    direction: Direction = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_direction(self)


@dataclass(frozen=True, kw_only=True)
class SpeedSensor(Sensor):
    """Speed of a shaft about its own axis, rad/s.

    Parameters
    ----------
    shaft : str
    """

    kind: ClassVar[str] = "speed"
    unit: ClassVar[str] = "rad/s"

    shaft: str


@dataclass(frozen=True, kw_only=True)
class TorqueSensor(Sensor):
    """Torque about the axis in a coupling, a load or a drive, N m.

    Parameters
    ----------
    of : str
        Name of the coupling, load or drive.
    """

    kind: ClassVar[str] = "torque"
    unit: ClassVar[str] = "N m"

    of: str


SENSORS: dict[str, type[Sensor]] = {kind.kind: kind for kind in (Laser, Accelerometer, SpeedSensor, TorqueSensor)}
"""Sensors by their ``kind``."""
