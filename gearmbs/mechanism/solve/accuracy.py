"""How accurate a simulation is where nobody says so: by the fastest mesh of wheels among the force elements.

Velocities are allowed an error `rate_scale` times that of positions. At ADAMS's practice of 1 the velocity of a wheel
whose teeth pass at w = 3000 rad/s is followed 3000 times more closely than its angle: a pair takes three times the
steps, for nothing. With w both weigh equally in a motion of that frequency, and the tolerance is what positions need:
1e-7 for harmonics of teeth in mesh, see the defaults in the documentation.
"""

from __future__ import annotations

from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.elements import ForceElement
from gearmbs.mechanism.parts.joints import Joint
from gearmbs.mechanism.parts.modal import ModalBody

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism

TOLERANCE, MESHING, JOINED = 1e-6, 1e-7, 3e-8
"""Tolerances without wheels in mesh; with one mesh, whose forces follow from penetrations of some micrometres; and with
several, which share their load, or wheels on bodies that deform. Mesh harmonics are within 0.05 % and 0.2 % then, at
1e-6 off by 0.6 % and 7 %; the level at the ring of a planetary set without play is within 0.6 %, at 1e-7 off by 9 %."""

LOOKS = 65
"""Times at which the speed of a motion is looked at."""


def chosen_accuracy(
    mechanism: Mechanism, span: tuple[float, float], tol: float | None, rate_scale: float | None
) -> tuple[float, float]:
    """Return the tolerance and the rate scale of a run, those that are not given by the fastest mesh.

    Parameters
    ----------
    mechanism : Mechanism
        With a ``rate_scale`` of its own, or wheels whose speeds follow from motions and initial velocities.
    span : tuple of float
        Start and end of the run, s.
    tol, rate_scale : float, optional
        As of `gearmbs.mechanism.simulate`; None where they are not given.
    """
    if rate_scale is not None and not (isinstance(rate_scale, Real) and 0.0 < rate_scale < np.inf):
        raise ModelError(f"rate_scale = {rate_scale!r}; it must be a positive number, 1/s")
    scale = rate_scale
    if scale is None:
        scale = mechanism.rate_scale or max(1.0, meshing_rate(mechanism, *span))
    if tol is None:
        deforms = any(isinstance(body, ModalBody) for body in mechanism.bodies.values())
        usual = JOINED if deforms or len(_meshes(mechanism)) > 1 else MESHING
        tol = usual if rate_scale is None and scale > 1.0 else TOLERANCE
    return tol, scale


def meshing_rate(mechanism: Mechanism, start: float, end: float) -> float:
    """Return the highest angular frequency at which teeth pass as far as motions and initial speeds tell it, rad/s."""
    meshes = _meshes(mechanism)
    if not meshes:
        return 0.0
    speeds = {name: float(np.linalg.norm(body.angular_velocity)) for name, body in mechanism.bodies.items()}
    for joint in mechanism.joints.values():
        if joint.kind == "rotation":
            fastest = _fastest(joint, start, end)
            for marker in (joint.i, joint.j):
                name = marker.body.name
                speeds[name] = max(speeds.get(name, 0.0), fastest)
    fixed = [joint for joint in mechanism.joints.values() if joint.kind == "fixed" and not _on_ground(joint)]
    for _ in fixed:
        # each round reaches one body further
        for joint in fixed:
            one, two = joint.i.body.name, joint.j.body.name
            speeds[one] = speeds[two] = max(speeds[one], speeds[two])
    ends = [(marker, count) for one in meshes for marker, count in zip((one.i, one.j), one.periods, strict=True)]
    return max((count * speeds[marker.body.name] for marker, count in ends if not marker.body.is_ground), default=0.0)


def _meshes(mechanism: Mechanism) -> list[ForceElement]:
    return [one for one in mechanism.elements.values() if isinstance(one, ForceElement) and any(one.periods)]


def _on_ground(joint: Joint) -> bool:
    return joint.i.body.is_ground or joint.j.body.is_ground


def _fastest(joint: Joint, start: float, end: float) -> float:
    """Return the highest speed that a motion prescribes, rad/s; 0 of what only a compiled mechanism can evaluate."""
    given = joint.prescribed
    function = joint.rows[0].rotation if given is None else given.function
    if function is None or function.is_expression or (given is not None and given.level != "velocity"):
        return 0.0
    order = 1 if given is None else 0
    return max(abs(function.derivatives(float(t))[order]) for t in np.linspace(start, end, LOOKS))
