"""Point masses: bodies that move and do not turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.bodies import POINT_MASS
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.elements import AXIS_TORQUE, COMPONENTS, Load
from gearmbs.mechanism.parts.quantities import Vector, quantity, rotation_matrix, vector
from gearmbs.units import QuantityLike, shown

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.elements import ForceElement
    from gearmbs.mechanism.parts.joints import Joint

TURNING = (terms.DOT1, terms.ANGLE, terms.ROTATION)
"""Terms of constraint rows that turn a body alone."""


@dataclass(eq=False)
class PointMass(Body):
    """A body with a mass and three coordinates. Made by :meth:`gearmbs.mechanism.Mechanism.point_mass`.

    It keeps the orientation it starts with, and so do its markers; moments do nothing to it.
    """

    kind = POINT_MASS

    @property
    def numbers(self) -> list[float]:
        """Its constant orientation, row-major."""
        if np.any(self.angular_velocity != 0.0):
            raise ModelError(
                f"point mass '{self.name}': angular_velocity = {self.angular_velocity} rad/s; it does not turn: leave "
                "it 0, or give it an inertia by m.body(...)"
            )
        return self.orientation.ravel().tolist()

    def shape_at(self, marker: Marker) -> tuple[np.ndarray, np.ndarray]:
        """Return the shapes of no modes."""
        return np.zeros((0, 3)), np.zeros((0, 3))

    def check(self, part: Joint | ForceElement | Load) -> None:
        """Raise a ModelError for a joint that holds its orientation, or a load with a torque.

        A function of the user's own may write a torque, which has no effect; a run warns of it at its end.
        """
        label = f"{part.kind.replace('_', ' ')} '{part.name}'"
        inertia = f"or give it an inertia: m.body('{self.name}', mass=..., inertia=...)"
        rows = getattr(part, "rows", ())
        turned = [t for row in rows for t in row.terms if t.kind in TURNING and self in (t.i.body, t.j.body)]
        if turned:
            raise ModelError(
                f"{label}: it holds the orientation of '{self.name}', a {self.kind.name}, which does not turn; take "
                f"spherical, at_point, inline, inplane or distance, {inertia}"
            )
        if not rows and _has_torque(part):
            raise ModelError(
                f"{label}: it has a torque, and '{self.name}' is a {self.kind.name}, which does not turn; leave the "
                f"torque out, take a spring-damper, line force or VFORCE, {inertia}"
            )

    def __repr__(self) -> str:
        return f"PointMass({self.name!r}, mass={shown(self.mass, 'kg', 'g')}, {len(self.markers)} markers)"


def _has_torque(load: Any) -> bool:
    """Return whether a load has a torque that is not just the number 0."""
    if isinstance(load, Load):
        torques = {COMPONENTS: load.expressions[3:], AXIS_TORQUE: load.expressions}.get(load.mode, ())
        return any(not _is_zero(text) for text in torques if text)
    return bool(load.has_torque) and load.kind != "force"


def _is_zero(text: str) -> bool:
    try:
        return float(text) == 0.0
    except ValueError:
        return False


def make_point_mass(
    name: str, mass: QuantityLike, at: Vector, velocity: Vector, com: Vector, orientation: npt.ArrayLike | None
) -> PointMass:
    """Return a checked point mass; see :meth:`gearmbs.mechanism.Mechanism.point_mass`."""
    label = f"point mass '{name}'"
    mass = quantity(mass, "mass", f"{label}: mass")
    if not (np.isfinite(mass) and mass > 0.0):
        raise ModelError(f"{label}: mass = {mass} kg; it must be a positive number")
    return PointMass(
        name=name,
        mass=mass,
        com=vector(com, f"{label}: com", "length"),
        position=vector(at, f"{label}: at", "length"),
        orientation=rotation_matrix(orientation, f"{label}: orientation"),
        velocity=vector(velocity, f"{label}: velocity", "speed"),
    )
