"""Joint friction in the manner of ADAMS, from a joint's reaction.

The friction on I's body opposes the slip s (m/s, components s_k in the marker J) of the joint's surfaces,

    F_k = -(mu_k N + P mu_k / mu_d),

with N the force that presses the surfaces together and P the preload. The coefficient depends on the slip speed
V = |s| as in ADAMS's joint friction: mu_s up to the stiction transition velocity v_s, mu_d from 1.5 v_s, a STEP
between, called g(V) below. How mu_k gets there depends on the largest stiction deformation D:

* D > 0: an elastic deformation z holds the joint and slides at the limit,

      z_k' = s_k - mu_s V z_k / (D g(V)),    mu_k = mu_s (z_k + tau z_k') / D,

  which is mu_k = g(V) s_k / V in steady sliding, and in the joint at rest holds any force up to mu_s N without
  creep. tau = D / v_s damps the deformation and lets the slip speed, too, hold the joint until the deformation has
  grown, as below; it fades between v_s and 1.5 v_s. This is the model known as LuGre's, which ADAMS offers next to
  its own of stick and slip.
* D = 0: mu_k = g(V) s_k / V, inside v_s the cubic mu_s V (3 - V^2/v_s^2) / (2 v_s): the joint creeps.

References
----------
C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky: A new model for control of systems with friction. IEEE
Transactions on Automatic Control 40 (1995) 419-425. The inputs of each joint follow the FRICTION statement of the
ADAMS Solver manual.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.elements import State
from gearmbs.mechanism.expression_syntax import Units
from gearmbs.mechanism.forces.friction_force import FrictionForce
from gearmbs.mechanism.friction_parameters import INPUTS, KINDS, JointFriction
from gearmbs.mechanism.friction_text import friction_text
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.quantities import quantity

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism

NEEDED = {
    "revolute": ("pin_radius",), "universal": ("pin_radius",), "cylindrical": ("pin_radius",),
    "spherical": ("ball_radius",),
}  # fmt: skip
"""Lengths without which there is no friction, by the kind of joint."""

DIMENSIONS = {
    "stiction_transition_velocity": ("speed", "velocity"),
    "preload_force": ("force", "force"),
    "preload_torque": ("torque", "torque"),
    "max_force": ("force", "force"),
    "max_torque": ("torque", "torque"),
    **dict.fromkeys(
        ("max_stiction_deformation", "pin_radius", "friction_arm", "bending_arm", "reaction_arm", "overlap",
         "ball_radius"),
        ("length", "length"),
    ),
}  # fmt: skip
"""Dimension of each parameter with a unit, for texts and in the function language."""


def friction_of(name: str, mu_static: float, mu_dynamic: float, parameters: dict, units: Units) -> JointFriction:
    """Return the parameters of a friction given as keywords; texts with a unit become numbers in ``units``.

    Raises
    ------
    ModelError
        For a keyword that does not exist, or a value that is not what it should be.
    """
    label = f"friction '{name}'"
    mu_static, mu_dynamic = (
        quantity(value, "dimensionless", f"{label}: {field}")
        for field, value in (("mu_static", mu_static), ("mu_dynamic", mu_dynamic))
    )
    known = [f.name for f in fields(JointFriction)]
    for key in parameters:
        if key not in known:
            raise ModelError(f"friction '{name}': {key!r} is no parameter; there are {', '.join(known)}")
    given = dict(parameters)
    for key, (unit, dimension) in DIMENSIONS.items():
        if given.get(key) is not None:
            given[key] = quantity(given[key], unit, f"{label}: {key}", units.factor(dimension))
    return JointFriction(mu_static, mu_dynamic, **given)


def add_friction(mechanism: Mechanism, name: str, joint: Joint, friction: JointFriction) -> list[FrictionForce]:
    """Add a joint's friction to a mechanism, and variables with what it is made of; return the force element.

    Raises
    ------
    ModelError
        For a joint without friction of this kind, or a parameter that is wrong or missing.
    """
    friction.check(name)
    if joint.kind not in KINDS:
        raise ModelError(f"friction '{name}': joint '{joint.name}' is {joint.kind}; it must be {', '.join(KINDS)}")
    for field in NEEDED.get(joint.kind, ()):
        if not getattr(friction, field) > 0.0:
            raise ModelError(f"friction '{name}': {field} is needed for a {joint.kind} joint")
    text = friction_text(name, joint, friction, mechanism.units)
    for key, expression in text.variables.items():
        mechanism.variable(key, expression)
    states = tuple(State(key) for key in text.states)
    return [mechanism.add(FrictionForce(name, joint.i, joint.j, joint, friction, mechanism.units, states, text))]


__all__ = ["INPUTS", "KINDS", "JointFriction", "add_friction", "friction_of"]
