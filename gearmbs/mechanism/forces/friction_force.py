"""The friction of a joint as a force element."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.mechanism.elements import Compiled, ForceElement, State
from gearmbs.mechanism.expression_syntax import Units
from gearmbs.mechanism.friction_parameters import OVERLAPS, TINY, JointFriction
from gearmbs.mechanism.friction_text import FrictionText
from gearmbs.mechanism.joints import Joint


@dataclass(eq=False, repr=False)
class FrictionForce(ForceElement):
    """Friction of a joint, from its reaction and its slip; the law is that of `gearmbs.mechanism.friction`.

    Attributes
    ----------
    joint : Joint
    friction : JointFriction
        In ``units``.
    units : Units
    own_states : tuple of State
        Deformations of the surfaces, m.
    text : FrictionText
        The same in the function language.
    """

    joint: Joint
    friction: JointFriction
    units: Units
    own_states: tuple[State, ...]
    text: FrictionText

    kind = "friction"

    @property
    def states(self) -> tuple[State, ...]:
        """Deformations of the surfaces."""
        return self.own_states

    @property
    def has_force(self) -> bool:  # type: ignore[override]
        """Whether F is an unknown."""
        return self.joint.kind in ("translational", "cylindrical")

    @property
    def has_torque(self) -> bool:  # type: ignore[override]
        """Whether N is an unknown."""
        return self.joint.kind != "translational"

    @property
    def parameters(self) -> Mapping[str, Any]:
        """What it was made from, for writing decks."""
        return {"joint": self.joint, "friction": self.friction, "keys": (*self.text.variables, *self.text.states)}

    def compiled(self) -> Compiled:
        from gearmbs.mechanism.forces import friction_kernel as fk

        f, kind = self.friction, self.joint.kind
        kinds = {"translational": fk.SLIDE, "cylindrical": fk.CYLINDER, "spherical": fk.BALL}
        integers = np.zeros(fk.INTEGERS, dtype=np.int64)
        integers[fk.KIND] = kinds.get(kind, fk.PIN)
        integers[fk.FRAME] = 0 if kind == "universal" and f.yoke == "i" else 1
        reals = np.zeros(fk.REALS)
        self._pressing(integers, reals)
        length, force, torque = (self.units.factor(d) for d in ("length", "force", "torque"))
        kept = 1.0 / f.mu_dynamic if "preload" in f.inputs else 0.0
        reals[fk.LEVER] = length * (f.ball_radius if kind == "spherical" else f.pin_radius)
        reals[fk.LIMIT_STATIC] = f.mu_dynamic if f.effect == "sliding" else f.mu_static
        reals[fk.LIMIT_DYNAMIC] = 1e-6 * f.mu_static if f.effect == "stiction" else f.mu_dynamic
        reals[fk.TRANSITION] = self.units.factor("velocity") * f.stiction_transition_velocity
        if self.own_states:
            reals[fk.DEFORMATION] = length * f.max_stiction_deformation
            reals[fk.PER_DEFORMATION] = f.mu_static / reals[fk.DEFORMATION]
        reals[fk.KEPT_FORCE], reals[fk.KEPT_TORQUE] = force * kept * f.preload_force, torque * kept * f.preload_torque
        reals[fk.MAX_FORCE] = np.inf if f.max_force is None else force * f.max_force
        reals[fk.MAX_TORQUE] = np.inf if f.max_torque is None else torque * f.max_torque
        return Compiled(
            fk.joint_friction, integers, reals, reactions=(self.joint.name,) if integers[fk.LOADED] else (),
            scratch=fk.ROWS * (1 + 24 + len(self.own_states) + 6),
        )  # fmt: skip

    def _pressing(self, integers: np.ndarray, reals: np.ndarray) -> None:
        """Fill in what presses the surfaces together."""
        from gearmbs.mechanism.forces import friction_kernel as fk

        f, kind = self.friction, self.joint.kind
        length, force, torque = (self.units.factor(d) for d in ("length", "force", "torque"))
        by_force = "reaction_force" in f.inputs
        bending, twist = "bending_moment" in f.inputs, "torsional_moment" in f.inputs
        reals[fk.TINY_FORCE] = TINY * force
        if kind == "spherical":
            reals[fk.PER_FORCE] = float(by_force)
        elif kind in ("revolute", "universal"):
            reals[fk.PER_RADIAL] = length * f.pin_radius * by_force
            reals[fk.PER_AXIAL] = length * f.friction_arm * by_force
            if bending and f.bending_arm:
                reals[fk.PER_BENDING], reals[fk.TINY_BENDING] = (
                    f.pin_radius / f.bending_arm,
                    TINY * f.pin_radius * torque,
                )
        else:
            reals[fk.PER_RADIAL] = float(by_force)
            if bending and f.overlap:
                reals[fk.TINY_BENDING] = TINY * f.overlap * torque
                reals[fk.OVERLAP], reals[fk.OVERLAP_SLOPE] = length * f.overlap, OVERLAPS[f.overlap_change]
                integers[fk.CHANGES] = reals[fk.OVERLAP_SLOPE] != 0.0
                reals[fk.PER_BENDING] = 1.0 if integers[fk.CHANGES] else 1.0 / reals[fk.OVERLAP]
                reals[fk.START] = self.text.start
            if kind == "translational" and twist and f.reaction_arm:
                reals[fk.PER_TWIST] = 1.0 / (length * f.reaction_arm)
                reals[fk.TINY_TWIST] = TINY * f.reaction_arm * torque
        used = (fk.PER_RADIAL, fk.PER_AXIAL, fk.PER_FORCE, fk.PER_BENDING, fk.PER_TWIST)
        integers[fk.LOADED] = any(reals[k] != 0.0 for k in used)

    def __repr__(self) -> str:
        return f"FrictionForce({self.name!r} in joint {self.joint.name!r})"
