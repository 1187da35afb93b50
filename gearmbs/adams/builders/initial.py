"""Where the parts of a deck are and how they move when an analysis starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearmbs.adams.builders.model import AdamsModel, BodyState
from gearmbs.adams.errors import ERROR, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.functions import polynomial
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.modal import ModalBody


def with_initial_motions(model: AdamsModel) -> dict[tuple[str, int], BodyState]:
    """Return the state in which every joint with initial conditions has them.

    Speeds along curves that contradict the others are left out, with a remark in the deck: where something else
    drives the point, there is no choice.

    Raises
    ------
    DeckError
        If those of joints cannot be met.
    """
    deck, sources = model.deck, model.sources
    of_joints = [m for m in model.initial_motions if not isinstance(sources[m[0].name], st.Ptcv)]
    along = [sources[m[0].name] for m in model.initial_motions if m not in of_joints]
    if along:
        try:
            return _started(model, model.initial_motions)
        except ModelError:
            for s in along:
                message = f"{s.label()}: VEL is left out: it contradicts other constraints, motions or initial speeds"
                deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, s.given["vel"]))
    try:
        return _started(model, of_joints)
    except ModelError as error:
        joint = sources[of_joints[0][0].name] if of_joints else along[0]
        message = f"{joint.label()}: its initial conditions cannot be met: {error}"
        raise DeckError([Diagnostic(ERROR, message, deck.file, joint.line)]) from error


Motions = Sequence[tuple[Joint, str, tuple[float, ...]]]


def _started(model: AdamsModel, motions: Motions) -> dict[tuple[str, int], BodyState]:
    """Return the state with some initial motions, which the mechanism then has; without them if they do not go.

    Raises
    ------
    ModelError
        If they cannot be met.
    """
    units = model.deck.units
    mechanism = model.mechanism
    made = []
    for k, (joint, kind, value) in enumerate(motions):
        rate = value[1] if len(value) > 1 else 0.0
        name = f"initial condition {k + 1} of {joint.name}"
        if kind == "rotation":
            made.append(mechanism.rotation(name, joint, polynomial([value[0], rate / units.time])))
        else:
            start, speed = value[0] * units.length, rate * units.factor("velocity")
            made.append(mechanism.translation(name, joint, polynomial([start, speed])))
    try:
        system = mechanism.compile(0.0)
        system.initialise()
    except ModelError:
        for motion in made:
            del mechanism.joints[motion.name]
        raise
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
