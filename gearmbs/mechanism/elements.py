"""Force elements of a mechanism."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gearmbs.dae.errors import ModelError
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


def check_wheels(contact: GearContact) -> None:
    """Look at where two wheels stand at the start.

    Raises
    ------
    ModelError
        If they stand in each other: closer than the sum of their base radii.

    Warns
    -----
    UserWarning
        If they are out of each other's reach.
    """
    wheels = getattr(contact.pair, "wheels", None)
    if wheels is None:
        return
    axis = contact.i.global_orientation()[:, 2]
    apart = contact.j.global_position() - contact.i.global_position()
    distance = float(np.linalg.norm(apart - axis * (axis @ apart)))
    label = f"gear contact '{contact.name}': the axes are {1e3 * distance:.4g} mm apart"
    least = sum(wheel.base_radius for wheel in wheels)
    most = sum(wheel.tip_radius for wheel in wheels)
    if distance <= least:
        raise ModelError(
            f"{label}, less than the sum of the base radii, {1e3 * least:.4g} mm; place the wheels as the pair's "
            "placement() says"
        )
    if distance > most:
        warnings.warn(
            f"{label}, more than the tip radii together, {1e3 * most:.4g} mm: the teeth cannot touch", stacklevel=3
        )


LINE, AXIS_FORCE, AXIS_TORQUE, COMPONENTS = 0, 1, 2, 3


@dataclass(eq=False)
class Load:
    """Force and torque given by expressions in the ADAMS function language.

    Attributes
    ----------
    name, kind : str
        The kind is the element's name in the language ("sforce", "gforce", "bushing", ...), for functions that
        ask for its force.
    i, j, rm : Marker
        I feels the load at its origin, J the reaction at the same point; RM gives the directions.
    mode : int
        LINE (along the line from J to I), AXIS_FORCE or AXIS_TORQUE (along z of RM), COMPONENTS (in RM's frame).
    expressions : tuple of str or None
        One expression, or for COMPONENTS six: fx, fy, fz, tx, ty, tz.
    parameters : mapping, optional
        What the expressions were made from, by the names of the method that adds the element and in the mechanism's
        units; for writing the element as what it is.
    """

    name: str
    kind: str
    i: Marker
    j: Marker
    rm: Marker
    mode: int
    expressions: tuple[str | None, ...]
    parameters: Mapping[str, Any] | None = None

    @property
    def has_force(self) -> bool:
        """Whether F is an unknown."""
        return self.mode in (LINE, AXIS_FORCE) or (self.mode == COMPONENTS and any(self.expressions[:3]))

    @property
    def has_torque(self) -> bool:
        """Whether N is an unknown."""
        return self.mode == AXIS_TORQUE or (self.mode == COMPONENTS and any(self.expressions[3:]))

    def __repr__(self) -> str:
        shown = ", ".join(e for e in self.expressions if e)
        return f"Load({self.name!r}, {self.kind}, I={self.i.name!r}, J={self.j.name!r}, {shown})"


@dataclass(eq=False)
class State:
    """A user-defined state: z' = expression from ``start``, or z = expression when it is algebraic."""

    name: str
    expression: str
    start: float = 0.0
    algebraic: bool = False
