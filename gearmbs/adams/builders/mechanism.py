"""From a deck to a mechanism, as the deck gives its initial conditions or from a given state."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from gearmbs.adams.builders.builder import Builder, Maker
from gearmbs.adams.builders.constraints import CONSTRAINTS
from gearmbs.adams.builders.contacts import CONTACTS
from gearmbs.adams.builders.curves import CURVES
from gearmbs.adams.builders.data_calls import IN_DYNAMICS, Present
from gearmbs.adams.builders.fe_parts import add_fe_load, add_fe_part, add_node_marker
from gearmbs.adams.builders.flexible import add_flex_body, add_flexible_marker
from gearmbs.adams.builders.forces import FORCES
from gearmbs.adams.builders.initial import with_initial_motions
from gearmbs.adams.builders.modal_forces import add_mforce
from gearmbs.adams.builders.model import AdamsModel, BodyState
from gearmbs.adams.errors import ERROR, UNSUPPORTED, WARNING, DeckError
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism import Mechanism

DEFORMING: dict[type, Maker] = {st.FlexBody: add_flex_body, st.FePart: add_fe_part}
"""What adds bodies that deform."""
ON_NODES: dict[str, Maker] = {"FLEX_BODY": add_flexible_marker, "FE_PART": add_node_marker}
"""What adds their markers."""


def build_mechanism(
    deck: Deck, allow_unsupported: bool = False, inactive: frozenset[tuple[str, int]] = frozenset()
) -> Mechanism:
    """Return the mechanism a deck describes, its joints with the initial conditions given; see :func:`build_model`."""
    model = build_model(deck, allow_unsupported, inactive)
    if model.initial_motions:
        model = build_model(deck, allow_unsupported, inactive, with_initial_motions(model))
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
        for kind, make in (
            CONSTRAINTS | CURVES | FORCES | {st.Mforce: add_mforce, st.FeLoad: add_fe_load} | CONTACTS
        ).items():
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
