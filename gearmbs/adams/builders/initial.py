"""Where the parts of a deck are and how they move when an analysis starts."""

from __future__ import annotations

import numpy as np

from gearmbs.adams.builders.model import AdamsModel, BodyState
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.mechanism.functions import polynomial


def with_initial_motions(model: AdamsModel) -> dict[int, BodyState]:
    """Return the state in which every joint with initial conditions has them."""
    units = model.deck.units
    mechanism = model.mechanism
    for k, (joint, kind, value) in enumerate(model.initial_motions):
        rate = value[1] if len(value) > 1 else 0.0
        name = f"initial condition {k + 1} of {joint.name}"
        if kind == "rotation":
            mechanism.rotation(name, joint, polynomial([value[0], rate / units.time]))
        else:
            start, speed = value[0] * units.length, rate * units.factor("velocity")
            mechanism.translation(name, joint, polynomial([start, speed]))
    system = mechanism.compile(0.0)
    system.initialise()
    return part_states(model, system.pose)


def part_states(model: AdamsModel, pose: np.ndarray) -> dict[int, BodyState]:
    """Return the parts' states from R, A, v, omega of their centres of mass."""
    found = {}
    for row, (name, body) in zip(pose, model.mechanism.bodies.items()):
        if name not in model.sources:
            # a runner on a curve, which starts where its point is
            continue
        axes = row[POSE_A:POSE_V].reshape(3, 3)
        arm = axes @ body.com
        spin = row[POSE_W:POSE_COLUMNS].copy()
        number = model.sources[name].id
        found[number] = BodyState(row[POSE_R:POSE_A] - arm, axes.copy(), row[POSE_V:POSE_W] - np.cross(spin, arm), spin)
    return found
