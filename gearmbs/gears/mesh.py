"""What an analysis asks of a pair of wheels in mesh."""

from __future__ import annotations

from typing import Protocol

from gearmbs.gears.contact_model import ContactModel
from gearmbs.gears.fault import Fault
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.operating_point import OperatingPoint


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
