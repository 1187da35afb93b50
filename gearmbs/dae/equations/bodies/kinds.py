"""The kinds of bodies: how many coordinates each has.

A body of any kind has the displacement of its centre of mass, then Euler angles, then modal coordinates, as many as its
row of the table says. Records and the acceleration system have six places a body, spatial displacements: in the
directions that a kind does not have it stands still, held by an inertia without a load.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BodyKind:
    """What there is to know of a kind of body ahead of its numbers.

    Attributes
    ----------
    name : str
        For messages.
    angles : int
        Euler angles among its coordinates, 3 or 0; without them it keeps the orientation it starts with.
    lumps : bool
        Whether it may be integrated as one with what it is fixed to, or by an angle about a fixed axis alone.
    """

    name: str
    angles: int = 3
    lumps: bool = False


RIGID = BodyKind("rigid body", lumps=True)
MODAL = BodyKind("body with modes")
POINT_MASS = BodyKind("point mass", angles=0)
