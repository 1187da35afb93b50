"""Wheels and pairs: geometry, mass, placement in space, faults, and analyses that need no dynamics."""

import gearmbs._announce  # noqa: F401
from gearmbs.gears import faults
from gearmbs.gears.laws import ContactLaw, Friction
from gearmbs.gears.pair import GearPair, Placement
from gearmbs.gears.spec import GearSpec, Material, involute
from gearmbs.gears.transmission import (
    TransmissionError,
    kinematic_transmission_error,
    loaded_transmission_error,
)

__all__ = [
    "ContactLaw",
    "Friction",
    "GearPair",
    "GearSpec",
    "Material",
    "Placement",
    "TransmissionError",
    "faults",
    "involute",
    "kinematic_transmission_error",
    "loaded_transmission_error",
]
