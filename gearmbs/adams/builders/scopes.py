"""What the names and ids in a deck's expressions stand for, known before a mechanism is built: ``deck_scope``."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from gearmbs.adams.builders.control import diff_name, implicit_states, rate_name, state_systems
from gearmbs.adams.builders.curve_data import curve_points
from gearmbs.adams.builders.functions import IN_DYNAMICS, Present, translated
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.check import measured_markers
from gearmbs.adams.parse.data import spline_data
from gearmbs.adams.parse.deck import Deck
from gearmbs.dae.equations.expressions import SplineData
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.language.syntax import Scope
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.curves import AXES
from gearmbs.mechanism.parts.joints import Joint

# Between which markers the elements of a deck act, and what they need to act.


def joints_of(s: st.Statement) -> tuple[int, ...]:
    """Return the joints without which an element cannot act."""
    one: int | None = getattr(s, "joint", None)
    several: tuple[int, ...] = getattr(s, "joints", ())
    return several if one is None else (one,)


def resting_joint(s: st.Statement, inactive: frozenset[tuple[str, int]]) -> int | None:
    """Return an inactive joint without which an element cannot act, None when there is none."""
    return next((ref for ref in joints_of(s) if ("JOINT", ref) in inactive), None)


def acts(s: st.Statement, inactive: frozenset[tuple[str, int]]) -> bool:
    """Whether an element is active, and the joints it needs are."""
    return (s.keyword, s.id) not in inactive and resting_joint(s, inactive) is None


def marker_pair(deck: Deck, s: Any) -> tuple[int, int | None]:
    """Return the ids of the markers I and J of what transmits a force, None for a J that there is not."""
    if joints_of(s):
        joint = deck.of(st.Joint)[joints_of(s)[0]]
        return joint.i or 0, joint.j
    if isinstance(s, st.Gcon):
        return _gcon_pair(s)
    if isinstance(s, st.Ptcv):
        return s.i or 0, s.rm
    if isinstance(s, st.Cvcv):
        return s.irm or 0, s.jrm
    if isinstance(s, st.Contact):
        i, j = (deck.of(st.Graphics)[refs[0]].marker for refs in (s.igeom, s.jgeom))
        return i or 0, j
    if isinstance(s, st.Acting):
        return s.i or 0, s.jfloat
    if isinstance(s, st.Sforce) and s.action_only:
        return s.i or 0, None
    return s.i or 0, s.j


def _gcon_pair(s: st.Gcon) -> tuple[int, int | None]:
    """Return a general constraint's I marker and, when its expression names just one other, that one."""
    used = measured_markers(s.function or "")
    first = s.i if s.i is not None else (used[0] if used else 0)
    others = [m for m in used if m != first]
    return first, others[0] if len(others) == 1 else None


FORCE_AND_TORQUE = (0, 3)
"""First components of both, see `Scope.absent`."""


def sensor_state(number: int) -> str:
    """Return the name of the state that follows a SENSOR's function."""
    return f"SENSOR_{number}"


def data_scope(deck: Deck, present: Present) -> Scope:
    """Return what expressions may name of a deck's data: all but markers, elements, curves and algebraic states."""
    return Scope(
        variables={v.id: _text(deck, present, v.function) for v in deck.of(st.Variable).values()},
        diffs={d.id: None if d.implicit else _text(deck, present, d.function) for d in deck.of(st.Diff).values()}
        | {name: text for _, system in state_systems(deck) for name, text in zip(system.names, system.rates())},
        splines={s.id: spline_data(s) for s in deck.of(st.Spline).values() if s.data_file is None},
        arrays={a.id: a.numbers for a in deck.of(st.Array).values()},
        functions=deck.functions,
        plants={(plant.keyword.lower(), plant.id): plant.variables for plant in deck.each(st.Plant)},
        units=deck.units,
    )


def deck_scope(deck: Deck, present: Present, inactive: frozenset[tuple[str, int]] = frozenset()) -> Scope:
    """Return what expressions of a deck may name, all of it, without anything being computed.

    Bodies are numbered as the deck's markers name them; the tapes do to check expressions, not to evaluate them.
    """
    markers: dict[Any, int] = {}
    rows: list[int] = []
    grounds = {("PART", p.id) for p in deck.of(st.Part).values() if p.ground}
    bodies: dict[tuple[str, int | None], int] = {}
    for k, marker in enumerate(deck.of(st.Marker).values()):
        markers[marker.id] = markers[(marker.name or f"MARKER_{marker.id}").replace('"', "'").upper()] = k
        owner = marker.owner()
        rows.append(0 if owner in grounds else bodies.setdefault(owner, 1 + len(bodies)))
    of_kind: dict[str, dict[int, Any]] = {kind: deck.of(cls) for cls, kind in st.KINDS.items()}
    elements = [(kind, s) for kind, group in of_kind.items() for s in group.values()]
    data = data_scope(deck, present)
    return replace(
        data,
        markers=markers,
        marker_body=rows,
        splines={**data.splines, **_curves(deck)},
        states=_algebraic_states(deck),
        forces={(kind, s.id): marker_pair(deck, s) for kind, s in elements},
        absent=frozenset(
            (kind, s.id, base) for kind, s in elements if not acts(s, inactive) for base in FORCE_AND_TORQUE
        ),
    )


def _text(deck: Deck, present: Present, function: str | None) -> str:
    """Return an expression that others read; what is wrong with it is said of its own statement."""
    try:
        return translated(deck, present, function or "0")
    except ValueError:
        return "0"


def _algebraic_states(deck: Deck) -> frozenset[str]:
    """Return the names of unknowns of their own: of implicit equations, and of sensors."""
    states = [s for d in deck.of(st.Diff).values() if d.implicit for s in implicit_states(d, "0", 1.0).values()]
    states += [s for _, system in state_systems(deck) for s in system.algebraic]
    names = {str(s.name).upper() for s in states if s.algebraic}
    return frozenset(names | {sensor_state(number) for number in deck.of(st.Sensor)})


def _curves(deck: Deck) -> dict[Any, SplineData]:
    """Return the components of curves; what is wrong with one is said of its own statement."""
    found: dict[Any, SplineData] = {}
    for curve in deck.of(st.CurveStatement).values():
        try:
            s, points = curve_points(deck, curve.id).tables()
            for k, axis in enumerate(AXES):
                found[f"CURVE_{curve.id}.{axis}"] = SplineData(tuple(s), (tuple(points[:, k]),))
        except ValueError:
            continue
        if curve.sampled:
            alpha, *rows = zip(*curve.sampled)
            found |= {f"CURVE_{curve.id}.BY.{axis}": SplineData(alpha, (row,)) for axis, row in zip(AXES, rows)}
    return found


# A mechanism built from a deck, with the way back from its names to the deck's ids.


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


@dataclass(frozen=True, eq=False)
class Beam:
    """An FE_PART as it was built.

    Attributes
    ----------
    bodies : list of Body
        At all nodes along the beam, those in between, too.
    labels : dict of int to int
        Number of a node in the deck -> place in ``bodies``.
    share, reach : ndarray
        Share of the length at each body, and the length that it stands for, m.
    axes : ndarray, shape (3, 3)
        Of the part's frame.
    places : ndarray, shape (bodies, 3)
        In the part's frame, m.
    """

    bodies: list[Body]
    labels: dict[int, int]
    share: np.ndarray
    reach: np.ndarray
    axes: np.ndarray
    places: np.ndarray


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
            splines={**data.splines, **_curves_of_model(self.mechanism)},
            states=frozenset(str(k).upper() for k, state in self.mechanism.states.items() if state.algebraic),
            # an element at a marker that is left out is left out, too
            forces={key: pair for key, pair in self.pairs.items() if all(not m or m in markers for m in pair)},
            absent=frozenset((*key, base) for key in self.pairs if key not in self.names for base in FORCE_AND_TORQUE),
        )


def _curves_of_model(mechanism: Mechanism) -> dict[Any, Any]:
    """Return the splines that have names, those of curves."""
    return {name.upper(): data for name, data in mechanism.splines.items() if isinstance(name, str)}


def markers_of(mechanism: Mechanism) -> list[Marker]:
    """Return all markers of a mechanism."""
    return [m for body in (mechanism.ground, *mechanism.bodies.values()) for m in body.markers]


def hold_states(model: AdamsModel) -> None:
    """Make the states of statements with STATIC_HOLD keep their values, as in static analyses."""
    deck, states = model.deck, model.mechanism.states
    held: list[int | str] = []
    for diff in deck.of(st.Diff).values():
        if diff.static_hold:
            held += [diff.id, diff_name(diff), rate_name(diff_name(diff))]
    for s, system in state_systems(deck):
        if getattr(s, "static_hold", False):
            held += [*system.names, *(state.name for state in system.algebraic)]
    for name in held:
        if name in states:
            states[name].expression = repr(states[name].start) if states[name].algebraic else "0"
