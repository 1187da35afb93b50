"""What an analysis asks of a pair of wheels in mesh."""

from __future__ import annotations

import math
from dataclasses import InitVar, dataclass
from typing import Literal, Protocol

from gearmbs._shown import Written
from gearmbs.gears.contact_model import ContactModel
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.modifications import Fault
from gearmbs.units import Quantity, to_si

# How a pair of wheels is driven and loaded.


@dataclass(frozen=True)
class OperatingPoint(Written):
    """Load and sense of rotation of a pair.

    Parameters
    ----------
    torque : float or str
        Load torque on the driven wheel, N m.
    rotation : {1, -1}
        Sense in which the driver turns about +z; it decides which flanks drive.
    owner : str
        What messages call the fields' owner.

    Raises
    ------
    ValueError
        For a torque that is not finite or negative, or another sense of rotation.

    Examples
    --------
    >>> OperatingPoint("60 N m", rotation=-1).torque
    60.0
    """

    torque: Quantity = 100.0
    rotation: Literal[1, -1] = 1
    owner: InitVar[str] = "OperatingPoint"

    # mypy may lose InitVar among modules that import each other for types
    def __post_init__(self, owner: str) -> None:  # type: ignore[override]
        object.__setattr__(self, "torque", to_si(self.torque, "torque", f"{owner}.torque"))
        if not math.isfinite(self.torque):
            raise ValueError(f"{owner}.torque is {self.torque}; give a finite number")
        if not self.torque >= 0.0:
            raise ValueError(
                f"{owner}.torque is {self.torque:g} N m; give its size (0 up): it acts against the motion, whose sense "
                "is that of rotation, 1 or -1"
            )
        if self.rotation not in (1, -1):
            raise ValueError(f"{owner}.rotation is {self.rotation!r}; give 1 or -1")

    def normal_force(self, geometry: PairGeometry) -> float:
        """Sum of normal forces that carries the load torque, N: F_n = T / (r_b2 cos beta_b)."""
        return self.torque / (geometry.driven.base_radius * math.cos(geometry.driven.base_helix_angle))


class Mesh(Protocol):
    """Wheels in mesh: where they are, how they touch, how they are driven and what is wrong with them.

    `gearmbs.gears.GearPair` is one. The analyses take anything that has these four.

    Attributes
    ----------
    geometry : PairGeometry
    contact_model : ContactModel
    operating_point : OperatingPoint
    faults : tuple of Fault
    """

    @property
    def geometry(self) -> PairGeometry:
        """Wheels and their places."""

    @property
    def contact_model(self) -> ContactModel:
        """Law, friction and discretisation."""

    @property
    def operating_point(self) -> OperatingPoint:
        """Load and sense of rotation."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Faults and deviations of teeth."""
