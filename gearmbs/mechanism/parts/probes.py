"""Accelerations as unknowns: what a part of a body's mass, held by the rest, weighs.

From a body a ball with the mass m and the moments of inertia j about its middle, the origin of a marker, is split off
and fixed to the rest, whose mass, centre and inertia are what is left, so that nothing moves differently. With the
force F and the torque N of the joint on the ball,

    a = F / m + g,    alpha = N / j,

and these reactions are unknowns of the equations, which expressions may ask for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Marker

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.joints import Joint

SHARE = 0.01
"""Of a body's mass and its least moment of inertia that a probe takes at most."""


def split_off(mechanism: Mechanism, name: str, marker: Marker) -> tuple[Joint, float, float]:
    """Split a probe off the body of a marker; return the joint that holds it, its mass and moment of inertia.

    Raises
    ------
    ModelError
        If the body has no mass or no inertia.
    """
    body = marker.body
    least = float(np.linalg.eigvalsh(body.inertia)[0])
    if not (body.mass > 0.0 and least > 0.0):
        raise ModelError(
            f"the acceleration of marker '{marker.name}' is no unknown: body '{body.name}' has no mass or no inertia; "
            "give it both, or measure at a marker of another body"
        )
    arm = marker.position - body.com
    mass = min(SHARE * body.mass, SHARE * least / max(float(arm @ arm), 1e-300))
    inertia = SHARE * least
    rest = body.mass - mass
    shift = -mass / rest * arm
    body.inertia = body.inertia - inertia * np.eye(3) - steiner(mass, arm) - steiner(rest, shift)
    body.mass = rest
    body.com = body.com + shift
    origin = marker.global_position()
    velocity = body.velocity + np.cross(body.angular_velocity, origin - body.position)
    probe = mechanism.body(
        name, mass, inertia * np.eye(3), position=origin, orientation=marker.global_orientation(), velocity=velocity,
        angular_velocity=body.angular_velocity,
    )  # fmt: skip
    joint = mechanism.joint("fixed", f"{name}.hold", probe.marker(name=f"{name}.I"), marker)
    return joint, mass, inertia


def steiner(mass: float, arm: np.ndarray) -> np.ndarray:
    """Return the inertia of a point mass about another point."""
    return mass * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
