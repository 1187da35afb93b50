"""Bodies that joints leave no motion, as a second hinge about another axis does: a remark for who did not mean it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System
    from gearmbs.mechanism.mechanism import Mechanism

MOST_ROWS = 200
"""Constraint rows up to which it is looked for: the work grows with their third power."""

MOTIONS = ("rotation", "translation")
STILL = 1e-8
"""Motion of a body, as a part of the largest, that is none."""

NAMED = 3
"""Bodies and joints named in the remark at most."""


def locked_bodies(mechanism: Mechanism, system: System) -> list[str]:
    """Return the bodies that joints lock where a mechanism starts, without those fixed to the ground on purpose.

    Prescribed motions are left out: what they move is not locked. The motions that the other rows allow are the null
    space of their Jacobian; a body with no part in any of them cannot move.
    """
    names = list(system.body_names)
    rows = [name.rsplit(": ", 1)[0] for name in system.row_names]
    if not rows or len(rows) > MOST_ROWS:
        return []
    kept = [k for k, name in enumerate(rows) if name in mechanism.joints and mechanism.joints[name].kind not in MOTIONS]
    jacobian = system.constraint_jacobian(system.start, system.t0)[0].toarray()[kept]
    scale = 1.0 / np.sqrt(system.coordinate_weights())
    _, values, right = np.linalg.svd(jacobian * scale)
    rank = int(np.sum(values > 1e-10 * values.max(initial=0.0))) if values.size else 0
    free = right[rank:].T
    if not np.all(np.isfinite(free)):
        return []
    still = [name for k, name in enumerate(names) if not np.any(np.abs(free[6 * k : 6 * k + 6]) > STILL)]
    return [name for name in still if name not in _fixed_to_ground(mechanism)]


def locking_remark(mechanism: Mechanism, system: System) -> str:
    """Return a remark for the message of a run on bodies that joints lock, or nothing."""
    bodies = locked_bodies(mechanism, system)
    if not bodies:
        return ""
    joints = [
        name for name, joint in mechanism.joints.items()
        if joint.kind not in MOTIONS and {joint.i.body.name, joint.j.body.name} & set(bodies)
    ]  # fmt: skip
    one = len(bodies) == 1
    return (
        f"{'Body' if one else 'Bodies'} {_listed(bodies)} cannot move: {_listed(joints)} together leave "
        f"{'it' if one else 'them'} no motion; fix {'it' if one else 'them'} to the ground if that is meant."
    )


def _listed(names: list[str]) -> str:
    shown = [f"'{name}'" for name in names[:NAMED]]
    if len(names) > NAMED:
        shown.append(f"{len(names) - NAMED} more")
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"


def _fixed_to_ground(mechanism: Mechanism) -> set[str]:
    """Return the bodies that fixed joints connect to the ground, also by way of others."""
    fixed = {mechanism.ground.name}
    pairs = [
        (joint.i.body.name, joint.j.body.name) for joint in mechanism.joints.values() if joint.kind == "fixed"
    ]  # fmt: skip
    for _ in pairs:
        for one, other in pairs:
            if one in fixed or other in fixed:
                fixed |= {one, other}
    return fixed
