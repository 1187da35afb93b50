"""Parameters of a joint's friction."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from gearmbs.dae.errors import ModelError

INPUTS = ("preload", "reaction_force", "bending_moment", "torsional_moment")
EFFECTS = ("all", "stiction", "sliding")
OVERLAPS = {"constant": 0.0, "increasing": 1.0, "decreasing": -1.0}
KINDS = ("revolute", "translational", "cylindrical", "spherical", "universal")
TINY = 1e-6
"""Forces, in the unit of force, and slips, in transition velocities, below which lengths of vectors are rounded off."""


@dataclass(frozen=True)
class JointFriction:
    """Parameters of a joint's friction, in the mechanism's units (SI unless read from a deck).

    Attributes
    ----------
    mu_static, mu_dynamic : float
        Coefficients of friction.
    stiction_transition_velocity : float
        Slip speed below which the joint sticks.
    max_stiction_deformation : float
        Deformation in the joint at which sticking gives way; 0: friction is a function of the slip speed alone.
    effect : {"all", "stiction", "sliding"}
        Both, no friction beyond the transition, or no increase of the coefficient at rest (without deformation).
    inputs : sequence of str
        What presses the surfaces together: preload, reaction_force, bending_moment, torsional_moment.
    preload_force, preload_torque : float
        Friction of the unloaded joint.
    pin_radius, friction_arm, bending_arm : float
        Revolute and universal: radius of the pin, arm of the axial force, arm that turns the bending moment into a
        force. Cylindrical: the radius.
    reaction_arm, overlap : float
        Translational: arm that turns the torsional moment into a force. Translational and cylindrical: length that
        turns the bending moment into a force.
    overlap_change : {"constant", "increasing", "decreasing"}
        How the overlap changes with the displacement.
    ball_radius : float
        Spherical.
    yoke : {"i", "j"}
        Universal: the arm with friction.
    max_force, max_torque : float, optional
        The most the friction can be: force of translational, torque of the other joints, both of cylindrical ones.
    """

    mu_static: float
    mu_dynamic: float
    stiction_transition_velocity: float = 1e-3
    max_stiction_deformation: float = 1e-5
    effect: str = "all"
    inputs: tuple[str, ...] = INPUTS
    preload_force: float = 0.0
    preload_torque: float = 0.0
    pin_radius: float = 0.0
    friction_arm: float = 0.0
    bending_arm: float = 0.0
    reaction_arm: float = 0.0
    overlap: float = 0.0
    overlap_change: str = "constant"
    ball_radius: float = 0.0
    yoke: str = "i"
    max_force: float | None = None
    max_torque: float | None = None

    def check(self, name: str) -> None:
        """Raise a ModelError that names a wrong parameter."""
        label = f"friction '{name}'"
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, (int, float)) and not (np.isfinite(value) and value >= 0.0):
                raise ModelError(f"{label}: {f.name} = {value}; it must not be negative")
        for field, known in (("effect", EFFECTS), ("overlap_change", tuple(OVERLAPS)), ("yoke", ("i", "j"))):
            if getattr(self, field) not in known:
                raise ModelError(f"{label}: {field} = {getattr(self, field)!r}; choose one of {', '.join(known)}")
        for item in self.inputs:
            if item not in INPUTS:
                raise ModelError(f"{label}: inputs has {item!r}; choose from {', '.join(INPUTS)}")
        if not self.stiction_transition_velocity > 0.0:
            raise ModelError(f"{label}: stiction_transition_velocity must be positive")
        for field in ("max_force", "max_torque"):
            if getattr(self, field) == 0.0:
                raise ModelError(f"{label}: {field} must be positive; leave it out for no limit")
        if not self.mu_dynamic > 0.0:
            raise ModelError(f"{label}: mu_dynamic = {self.mu_dynamic}; it must be positive")
        if self.mu_static < self.mu_dynamic and self.effect != "sliding":
            raise ModelError(f"{label}: mu_static = {self.mu_static} is less than mu_dynamic = {self.mu_dynamic}")
