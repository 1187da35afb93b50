"""Couplings between shafts whose axes are at an angle or apart.

The second axis is the first one, tilted by beta towards a direction, an angle about z in the first shaft's axes that do
not turn. A universal joint turns by tan p = tan q cos beta, with p the angle of the first fork from the direction and q
the second shaft's in the same sense, so that

    w_2 / w_1 = cos beta / (1 - sin^2 beta cos^2 p):

between cos beta and 1 / cos beta, twice a turn. What a flexible coupling does against tilts and offsets stands in
space while its shafts turn.
"""

from __future__ import annotations

import math
from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from gearmbs.drivetrain.couplings.aligned import (
    Coupling,
    Damping,
    ElasticClutch,
    RigidCoupling,
    Stiffness,
    TorsionalShaft,
)
from gearmbs.drivetrain.couplings.even_twist import EvenTwist
from gearmbs.drivetrain.part import Attached
from gearmbs.gears.geometry import turn_z
from gearmbs.schema.quantities import Measure, OneOf
from gearmbs.units import Quantity

SHARPEST = math.radians(60.0)
"""Largest angle, rad: a joint of forks hits itself at some 45 degrees, and one of 90 degrees passes no rotation."""

CARRIES = ("nothing", "across", "all")
"""What the centre of a universal joint holds of one shaft on the other beside the rotation."""

Inclined = Annotated[Quantity, Measure("angle", 0, SHARPEST)]


@dataclass(frozen=True, kw_only=True)
class Misaligned(Coupling, ABC):
    """What couplings with an angle share.

    Parameters
    ----------
    angle : float or str
        Between the axes of the shafts, rad.
    direction : float or str
        Towards which the second axis is tilted, about the first shaft's z axis from x as that does not turn, rad.
    """

    kind: ClassVar[str] = "misaligned"

    angle: Inclined = 0.0
    direction: Annotated[Quantity, Measure("angle")] = 0.0

    @property
    def tilt(self) -> np.ndarray:
        c, s = math.cos(self.angle), math.sin(self.angle)
        about_y = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        return turn_z(self.direction) @ about_y @ turn_z(-self.direction)


@dataclass(frozen=True, kw_only=True)
class UniversalJoint(Misaligned):
    """A universal (Cardan, Hooke's) joint, rigid and without play.

    Parameters
    ----------
    phase : float or str
        Of the fork of the first shaft, about its axis from the shaft's x, rad. That of the second is a quarter of a
        turn on from there, about the second shaft's: with ``phase = "90 deg"`` the next joint's fork stands on it as
        the first one's does, and of equal angles in one plane passes the rotation evenly.
    carries : {"nothing", "across", "all"}, optional
        What its centre holds of one shaft on the other: nothing but the rotation, for shafts with bearings of their
        own; both ways across, a splined shaft; or the whole point. Default: of a shaft without bearings of its own the
        first joint all, a second one across, else nothing.
    """

    kind: ClassVar[str] = "universal"

    phase: Annotated[Quantity, Measure("angle")] = 0.0
    carries: Annotated[str, OneOf(CARRIES)] | None = None

    def follows(self, angle: float, *, forward: bool = True) -> tuple[float, float]:
        away, cosine = self.phase - self.direction, math.cos(self.angle)
        p = angle + away
        if forward:
            q = math.atan2(math.sin(p), math.cos(p) * cosine)
            pace = cosine / (1.0 - (math.sin(self.angle) * math.cos(p)) ** 2)
        else:
            q = math.atan2(math.sin(p) * cosine, math.cos(p))
            pace = (1.0 - (math.sin(self.angle) * math.cos(q)) ** 2) / cosine
        turns = round((p - q) / (2.0 * math.pi))
        return q + 2.0 * math.pi * turns - away, pace

    def holds(self, role: str) -> np.ndarray:
        return np.eye(5)[: {"nothing": 0, "across": 2, "all": 3}[role]]

    def add(self, at: Attached, role: str = "nothing") -> None:
        m, axes, second = at.mechanism, at.j.global_orientation(), at.i.global_orientation()[:, 2]
        fork = (at.j.body.orientation @ turn_z(self.phase))[:, 0]
        arm = np.cross(second, fork)
        arm /= np.linalg.norm(arm)
        where = at.j.global_position()
        # the z axes stay along the shafts, for torques are told about them
        i = at.i.body.placed_marker(where, np.column_stack([arm, np.cross(second, arm), second]), f"{self.name} fork.I")
        j = at.j.body.placed_marker(
            where, np.column_stack([np.cross(fork, axes[:, 2]), fork, axes[:, 2]]), f"{self.name} fork.J"
        )
        m.joint("forks", self.name, i, j)
        if role != "nothing":
            m.joint({"across": "inline", "all": "spherical"}[role], f"{self.name} centre", at.i, at.j)


@dataclass(frozen=True, kw_only=True)
class FlexibleCoupling(Misaligned):
    """A coupling that gives in all directions and passes the rotation evenly, as those of discs or of rubber.

    Its places on the shafts are ``offset`` apart and their axes at an ``angle``, both towards ``direction``. What it
    exerts against that stands in space: a force of radial stiffness times offset, and a moment of angular stiffness
    times angle, on each shaft and so on its bearings.

    Parameters
    ----------
    stiffness : float or str
        Torsional, N m/rad.
    radial, axial : float or str
        N/m, the same in all directions across the axis, and along it; 0: none.
    angular : float or str
        Against tilting, N m/rad.
    offset : float or str
        Between its places on the shafts, across the first axis, m.
    damping_time : float or str
        Damping over stiffness, of all of them, s. As it turns with the shafts, tilts and offsets work against it.
    """

    kind: ClassVar[str] = "flexible"

    stiffness: Stiffness
    radial: Annotated[Quantity, Measure("stiffness", 0)] = 0.0
    axial: Annotated[Quantity, Measure("stiffness", 0)] = 0.0
    angular: Annotated[Quantity, Measure("N*m/rad", 0)] = 0.0
    offset: Annotated[Quantity, Measure("length")] = 0.0
    damping_time: Damping = 0.0

    @property
    def tangent(self) -> float:
        return self.stiffness

    @property
    def tangent_damping(self) -> float:
        return self.damping_time * self.stiffness

    @property
    def shift(self) -> np.ndarray:
        return self.offset * turn_z(self.direction)[:, 0]

    def holds(self, role: str) -> np.ndarray:
        k = np.diag([self.radial, self.radial, self.axial, self.angular, self.angular])
        return k[k.any(axis=1)]

    def add(self, at: Attached, role: str = "") -> None:
        # turned as its shaft, so that the twist begins at nothing
        markers = []
        for marker, end in ((at.i, "I"), (at.j, "J")):
            turned = at.j.body.orientation if end == "J" else self.tilt_of(at) @ at.j.body.orientation
            markers.append(marker.body.placed_marker(marker.global_position(), turned, f"{self.name} turning.{end}"))
        i, j = markers
        time = self.damping_time
        torques = (self.stiffness, time * self.stiffness, self.angular, time * self.angular)
        at.mechanism.add(EvenTwist(self.name, i, j, torques))
        if self.radial or self.axial:
            k = np.diag([self.radial, self.radial, self.axial, 0.0, 0.0, 0.0])
            at.mechanism.field(seat_of(self), i, j, stiffness=k, damping=time * k)

    def tilt_of(self, at: Attached) -> np.ndarray:
        """Return the rotation that takes the first shaft's axes to the second's, global, shape (3, 3)."""
        axes = at.j.global_orientation()
        return axes @ self.tilt @ axes.T


def seat_of(coupling: Coupling) -> str:
    """Return the name of what holds the shafts of a coupling across and along their axes."""
    return f"{coupling.name} seat"


COUPLINGS: dict[str, type[Coupling]] = {
    kind.kind: kind for kind in (RigidCoupling, ElasticClutch, TorsionalShaft, UniversalJoint, FlexibleCoupling)
}
"""Couplings by their ``kind``."""


def roles(couplings: Sequence[Coupling], held: set[str]) -> dict[str, str]:
    """Return what the centres of universal joints hold, by name.

    Parameters
    ----------
    couplings : sequence of Coupling
        In their order.
    held : set of str
        Shafts with bearings of their own.
    """
    out: dict[str, str] = {}
    located: set[str] = set()
    for coupling in couplings:
        if not isinstance(coupling, UniversalJoint):
            continue
        loose = {coupling.first, coupling.second} - held
        own = "all" if loose - located else "across" if loose else "nothing"
        out[coupling.name] = own if coupling.carries is None else coupling.carries
        located |= loose if out[coupling.name] == "all" else set()
    return out
