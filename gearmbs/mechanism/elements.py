"""Force elements of a mechanism."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gearmbs.mechanism.functions import TimeFunction
from gearmbs.mechanism.parts import Marker


class ContactTables(Protocol):
    """What a gear contact needs to know of a gear pair; `gearmbs.gears.GearPair` provides it."""

    def contact_tables(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Return the packed integers, reals and the scratch size of `gearmbs.contact.gear_contact`."""
        ...


@dataclass(eq=False)
class Torque:
    """Torque f(t) about the z axis of marker ``axis`` on I's body, its reaction on J's body."""

    name: str
    i: Marker
    j: Marker
    axis: Marker
    function: TimeFunction

    def __repr__(self) -> str:
        return f"Torque({self.name!r}, {self.function} N m on {self.i.body.name!r} about z of {self.axis.name!r})"


@dataclass(eq=False)
class GearContact:
    """Tooth contact of the wheels whose frames are the markers I and J."""

    name: str
    i: Marker
    j: Marker
    pair: ContactTables

    def __repr__(self) -> str:
        return f"GearContact({self.name!r}, {self.i.body.name!r} with {self.j.body.name!r})"
