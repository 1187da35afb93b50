"""A mechanism built from a deck, with the way back from its names to the deck's ids."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from gearmbs.adams.builders.data_calls import IN_DYNAMICS, Present
from gearmbs.adams.builders.scopes import FORCE_AND_TORQUE, data_scope
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.expression_syntax import Scope
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.parts import Marker


class BodyState(NamedTuple):
    """Where a part's frame is and how it moves: SI, global components.

    Attributes
    ----------
    position, velocity, angular_velocity : ndarray, shape (3,)
    orientation : ndarray, shape (3, 3)
    q_f, v_f : ndarray, shape (n,)
        Modal coordinates and their rates; empty of a rigid part, and where they are zero.
    """

    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    q_f: np.ndarray = np.zeros(0)
    v_f: np.ndarray = np.zeros(0)


@dataclass
class AdamsModel:
    """A mechanism built from a deck, with the way back from names to ids.

    Attributes
    ----------
    mechanism : Mechanism
    deck : Deck
    names : dict
        (kind, id) -> name in the mechanism; parts and markers have the kinds "part" and "marker".
    pairs : dict
        (kind, id) -> (I marker id, J marker id or None) of everything that transmits a force.
    sources : dict
        Name in the mechanism -> statement.
    present : Present
        What is constant during the analysis.
    initial_motions : list
        Joints with initial conditions: joint, "rotation" or "translation", displacement and velocity in deck units.
    runners : dict
        Name of a runner on an open curve -> its statement and the curve's length, m.
    beams : dict of int to dict
        Id of an FE_PART that was built -> label of a node -> name of its body.
    """

    mechanism: Mechanism
    deck: Deck
    names: dict[tuple[str, int], str] = field(default_factory=dict)
    pairs: dict[tuple[str, int], tuple[int, int | None]] = field(default_factory=dict)
    sources: dict[str, st.Statement] = field(default_factory=dict)
    present: Present = IN_DYNAMICS
    initial_motions: list[tuple[Joint, str, tuple[float, ...]]] = field(default_factory=list)
    runners: dict[str, tuple[st.Statement, float]] = field(default_factory=dict)
    beams: dict[int, dict[int, str]] = field(default_factory=dict)

    def scope(self, marker_index: dict[int, int], marker_body: list[int]) -> Scope:
        """Return what the deck's expressions may name, for requests."""
        markers: dict[Any, int] = {}
        for m in markers_of(self.mechanism):
            markers[m.name.upper()] = marker_index[id(m)]
            if m.number is not None:
                markers[m.number] = marker_index[id(m)]
        data = data_scope(self.deck, self.present)
        return replace(
            data,
            markers=markers,
            marker_body=marker_body,
            splines={**data.splines, **_curves(self.mechanism)},
            states=frozenset(str(k).upper() for k, state in self.mechanism.states.items() if state.algebraic),
            # an element at a marker that is left out is left out, too
            forces={key: pair for key, pair in self.pairs.items() if all(not m or m in markers for m in pair)},
            absent=frozenset((*key, base) for key in self.pairs if key not in self.names for base in FORCE_AND_TORQUE),
        )


def _curves(mechanism: Mechanism) -> dict[Any, Any]:
    """Return the splines that have names, those of curves."""
    return {name.upper(): data for name, data in mechanism.splines.items() if isinstance(name, str)}


def markers_of(mechanism: Mechanism) -> list[Marker]:
    """Return all markers of a mechanism."""
    return [m for body in (mechanism.ground, *mechanism.bodies.values()) for m in body.markers]
