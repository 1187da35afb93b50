"""The kinds of bodies: how many coordinates each has.

A body of any kind has the displacement of its centre of mass, then Euler angles, then modal coordinates, as many as its
row of the table says. Records and the acceleration system have six places a body, spatial displacements: in the
directions that a kind does not have it stands still, held by an inertia without a load.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class BodyKind:
    """What there is to know of a kind of body ahead of its numbers.

    Attributes
    ----------
    name : str
        For messages.
    directions : tuple of int
        In which of the six spatial displacements, rotations last, it can move; without rotations it keeps the
        orientation it starts with.
    lumps : bool
        Whether it may be integrated as one with what it is fixed to, or by an angle about a fixed axis alone.
    """

    name: str
    directions: tuple[int, ...] = tuple(range(6))
    lumps: bool = False

    @cached_property
    def angles(self) -> int:
        """Number of Euler angles among its coordinates."""
        return sum(direction >= 3 for direction in self.directions)


RIGID = BodyKind("rigid body", lumps=True)
MODAL = BodyKind("body with modes")
POINT_MASS = BodyKind("point mass", directions=(0, 1, 2))
