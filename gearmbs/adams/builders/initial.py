"""Where the parts of a deck are and how they move when an analysis starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearmbs.adams.builders.model import AdamsModel, BodyState
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.mechanism.functions import polynomial
from gearmbs.mechanism.modal import ModalBody


def with_initial_motions(model: AdamsModel) -> dict[tuple[str, int], BodyState]:
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


def part_states(
    model: AdamsModel, pose: np.ndarray, modal: Mapping[str, Sequence[np.ndarray]] | None = None
) -> dict[tuple[str, int], BodyState]:
    """Return the parts' states, by statement name and id.

    Parameters
    ----------
    model : AdamsModel
    pose : ndarray
        R, A, v and omega of the centre of mass of each body, in the order of the mechanism.
    modal : mapping, optional
        Modal coordinates and their rates of flexible bodies by name; default: zero.
    """
    found = {}
    for row, (name, body) in zip(pose, model.mechanism.bodies.items()):
        axes = row[POSE_A:POSE_V].reshape(3, 3)
        if name not in model.sources:
            # a runner on a curve is a body without a statement
            found[name, 0] = BodyState(row[POSE_R:POSE_A].copy(), axes, row[POSE_V:POSE_W].copy(), np.zeros(3))
            continue
        source = model.sources[name]
        q_f, v_f = (modal or {}).get(name, (np.zeros(0), np.zeros(0)))
        com, push = body.com, np.zeros(3)
        if isinstance(body, ModalBody) and q_f.size:
            com, push = com + q_f @ body.mean, v_f @ body.mean
        arm = axes @ com
        spin = row[POSE_W:POSE_COLUMNS].copy()
        velocity = row[POSE_V:POSE_W] - np.cross(spin, arm) - axes @ push
        found[source.keyword, source.id] = BodyState(row[POSE_R:POSE_A] - arm, axes.copy(), velocity, spin, q_f, v_f)
    return found
