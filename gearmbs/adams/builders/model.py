"""A mechanism built from a deck, with the way back from its names to the deck's ids."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from gearmbs.adams.builders.control import state_systems
from gearmbs.adams.builders.data_calls import IN_DYNAMICS, Present, translated
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import spline_data
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.expression_syntax import Scope
from gearmbs.mechanism.joints import Joint
from gearmbs.mechanism.parts import Marker

KINDS: dict[type, str] = {
    st.Joint: "joint", st.Jprim: "jprim", st.Motion: "motion", st.Sforce: "sforce", st.Vforce: "vforce",
    st.Vtorque: "vtorque", st.Gforce: "gforce", st.Bushing: "bushing", st.Field: "field",
    st.SpringDamper: "springdamper", st.Gcon: "gcon", st.Coupler: "coupler", st.Gear: "gear",
    st.Beam: "beam", st.Friction: "friction", st.Contact: "contact",
    st.Ptcv: "ptcv", st.Cvcv: "cvcv",
}  # fmt: skip
"""Kinds under which functions such as JOINT and SFORCE ask for an element's force."""


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
    beams: dict[int, dict[int, str]] = field(default_factory=dict)

    def scope(self, marker_index: dict[int, int], marker_body: list[int]) -> Scope:
        """Return what the deck's expressions may name, for requests."""
        deck = self.deck
        markers: dict[Any, int] = {}
        for m in markers_of(self.mechanism):
            markers[m.name.upper()] = marker_index[id(m)]
            if m.number is not None:
                markers[m.number] = marker_index[id(m)]
        variables = {v.id: translated(deck, self.present, v.function or "") for v in deck.of(st.Variable).values()}
        return Scope(
            markers=markers,
            marker_body=marker_body,
            variables=variables,  # type: ignore[arg-type]
            diffs={
                d.id: None if d.implicit else translated(deck, self.present, d.function or "0")
                for d in deck.of(st.Diff).values()
            }
            | {name: text for _, system in state_systems(deck) for name, text in zip(system.names, system.rates())},
            splines={s.id: spline_data(s) for s in deck.of(st.Spline).values() if s.data_file is None}
            | _curves(self.mechanism),
            states=frozenset(str(k).upper() for k, state in self.mechanism.states.items() if state.algebraic),
            arrays=self.mechanism.arrays,
            functions=self.mechanism.functions,
            plants=self.mechanism.plants,
            forces=dict(self.pairs),  # type: ignore[arg-type]
            absent=frozenset((*key, base) for key in self.pairs if key not in self.names for base in (0, 3)),
            units=deck.units,
        )


def _curves(mechanism: Mechanism) -> dict[Any, Any]:
    """Return the splines that have names, those of curves."""
    return {name.upper(): data for name, data in mechanism.splines.items() if isinstance(name, str)}


def markers_of(mechanism: Mechanism) -> list[Marker]:
    """Return all markers of a mechanism."""
    return [m for body in (mechanism.ground, *mechanism.bodies.values()) for m in body.markers]
