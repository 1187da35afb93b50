"""From a deck to a mechanism, as the deck gives its initial conditions or from a given state."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from gearmbs.adams.builders.builder import Builder, Maker
from gearmbs.adams.builders.constraints import CONSTRAINTS, CURVES
from gearmbs.adams.builders.contacts import CONTACTS
from gearmbs.adams.builders.flexible import DEFORMING, LINE_LOADS, ON_NODES
from gearmbs.adams.builders.forces import FORCES
from gearmbs.adams.builders.plants import name_plants
from gearmbs.adams.builders.routines import bound
from gearmbs.adams.builders.scopes import IN_DYNAMICS, AdamsModel, BodyState, Present
from gearmbs.adams.doors import read_model
from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, DeckError, Diagnostic
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.view.reader import ViewModel
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts.functions import polynomial
from gearmbs.mechanism.parts.joints import Joint
from gearmbs.mechanism.parts.modal import ModalBody

# Where the parts of a deck are and how they move when an analysis starts.


def with_initial_motions(model: AdamsModel) -> dict[tuple[str, int], BodyState]:
    """Return the state in which every joint with initial conditions has them.

    Speeds along curves, and conditions of joints that a MOTION drives, are left out, with a remark in the deck, if they
    contradict the others: where something else drives the joint, there is no choice.

    Raises
    ------
    DeckError
        If those of joints cannot be met.
    """
    deck, sources = model.deck, model.sources
    driven = [sources[m[0].name] for m in model.initial_motions if _is_driven(deck, sources[m[0].name])]
    free = [m for m in model.initial_motions if sources[m[0].name] not in driven]
    if driven:
        try:
            return _started(model, model.initial_motions)
        except ModelError:
            for s in driven:
                key = next(key for key in ("vel", "ic", "icrot", "ictran") if key in s.given)
                message = f"{s.label()}: {key.upper()} is left out: it contradicts constraints, motions or other speeds"
                deck.diagnostics.append(Diagnostic(WARNING, message, deck.file, s.given[key]))
    try:
        return _started(model, free)
    except ModelError as error:
        joint = sources[free[0][0].name] if free else driven[0]
        message = f"{joint.label()}: its initial conditions cannot be met: {error}"
        raise DeckError([Diagnostic(ERROR, message, deck.file, joint.line)]) from error


def _is_driven(deck: Deck, s: st.Statement) -> bool:
    """Return whether a point on a curve, or a joint that a MOTION drives."""
    if not isinstance(s, st.Joint):
        return True
    ends = {s.i, s.j}
    return any(m.joint == s.id or (m.joint is None and {m.i, m.j} == ends) for m in deck.of(st.Motion).values())


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


MAKERS: dict[type, Maker] = CONSTRAINTS | CURVES | FORCES | LINE_LOADS | CONTACTS
"""What adds a statement to the mechanism, in the order in which that is done; a row stands beside its function."""


def build_mechanism(
    deck: Deck | ViewModel | str | Path,
    allow_unsupported: bool = False,
    routines: Mapping[str, Callable] | None = None,
) -> Mechanism:
    """Return the mechanism a deck describes, its joints with the initial conditions given.

    Parameters
    ----------
    deck : Deck, ViewModel or path
        Gets the remarks on what is left out. A path is that of a deck or of a command file of View.
    allow_unsupported : bool
        Build it without what is not supported instead of refusing.
    routines : mapping, optional
        Functions of the user, as in :func:`gearmbs.adams.run_deck`.

    Raises
    ------
    DeckError
        Naming the line of what is not supported or cannot be built.
    """
    read = read_model(Path(deck)) if isinstance(deck, (str, Path)) else deck
    deck = read.deck if isinstance(read, ViewModel) else read
    made = bound(deck, routines, allow_unsupported)
    model = build_model(made, allow_unsupported)
    if model.initial_motions:
        model = build_model(made, allow_unsupported, state=with_initial_motions(model))
    name_plants(model)
    deck.diagnostics.extend(d for d in made.diagnostics if d not in deck.diagnostics)
    return model.mechanism


def build_model(
    deck: Deck,
    allow_unsupported: bool = False,
    inactive: frozenset[tuple[str, int]] = frozenset(),
    state: Mapping[tuple[str, int], BodyState] | None = None,
    span: tuple[float, float] = (0.0, 1.0),
    present: Present = IN_DYNAMICS,
) -> AdamsModel:
    """Build the mechanism of a deck.

    Parameters
    ----------
    deck : Deck
    allow_unsupported : bool
        Build it without what is not supported instead of refusing.
    inactive : set of (statement name, id)
        Elements a script has deactivated.
    state : mapping to BodyState, optional
        Where the parts are and how they move, by the statement's name and id, instead of the deck's initial conditions.
    span : tuple of float
        Start of the analysis and about its end, in the deck's unit; motions given by their velocity or acceleration
        start from it.
    present : Present
        What is constant during the analysis: its MODE, and what sensors have evaluated.

    Returns
    -------
    AdamsModel

    Raises
    ------
    DeckError
        Naming the line of what is not supported or cannot be built.
    """
    if deck.unsupported and not allow_unsupported:
        raise DeckError(deck.unsupported)
    builder = Builder(deck, inactive, state or {}, span, present)
    if builder.add_bodies(DEFORMING, ON_NODES):
        builder.name_elements()
        builder.add_data()
        for kind, make in MAKERS.items():
            for statement in builder.active(kind):
                builder.attempt(statement, partial(make, builder))
    model = builder.model
    left_out = [d for d in builder.problems if d.severity == UNSUPPORTED]
    errors = [d for d in builder.problems if d.severity == ERROR]
    remarks = [d for d in builder.problems if d.severity == WARNING]
    if errors or (left_out and not allow_unsupported):
        raise DeckError(errors + left_out)
    deck.diagnostics.extend(d for d in left_out + remarks if d not in deck.diagnostics)
    return model
