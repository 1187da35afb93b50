"""What the names, ids and functions in a deck's expressions stand for.

Checks need no mechanism for it (``deck_scope``); `AdamsModel` is the mechanism with the way back from its names to the
deck's ids. Functions that mechanisms do not have become others: SENVAL, CURVE, ARYVAL of variables, MODE, and
accelerations.

An acceleration is an unknown of the equations by a probe: from a body a ball with the mass m and the moments of inertia
j about its middle, the origin of a marker, is split off and fixed to the rest, whose mass, centre and inertia are what
is left, so that nothing moves differently. With the force F and the torque N of the joint on the ball,

    a = F / m + g,    alpha = N / j.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearmbs.adams.builders.control import diff_name, has_rate, implicit_states, rate_name, state_systems
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import curve_points, spline_data
from gearmbs.adams.parse.deck import Deck, measured_markers
from gearmbs.dae.equations.expressions import SplineData
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.language.lowering import ELEMENT_FORCES
from gearmbs.mechanism.language.syntax import Call, Chain, Name, Node, Number, Power, Scope, parse, unparse
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.curves import AXES
from gearmbs.mechanism.parts.joints import Joint

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism

MODES = {
    "KINEMATICS": 1, "INITIAL_CONDITIONS": 3, "DYNAMICS": 4, "TRANSIENT": 4, "STATICS": 5, "QUASI_STATICS": 6,
    "LINEAR": 7,
}  # fmt: skip
"""What MODE is in each analysis."""

FORCE_AND_TORQUE = (0, 3)
"""First components of both, see `Scope.absent`."""


class Present(NamedTuple):
    """What functions of the deck ask for that is constant during an analysis.

    Attributes
    ----------
    mode : int
        Which analysis it is: MODE.
    sensed : mapping of int to float
        What sensors have evaluated, by id: SENVAL.
    """

    mode: int = MODES["DYNAMICS"]
    sensed: Mapping[int, float] = MappingProxyType({})


IN_DYNAMICS = Present()


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


def acting(deck: Deck, inactive: frozenset[tuple[str, int]]) -> dict[type[st.Statement], list[Any]]:
    """Return the active statements of a deck by their class."""
    return {kind: [s for s in group.values() if acts(s, inactive)] for kind, group in deck.items.items()}


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


# Functions of a deck in terms of those that mechanisms know.


CONCERNED = re.compile(r"\b(SENVAL|CURVE|ARYVAL|DIF|DIF1)\s*\(", re.IGNORECASE)
MODE = re.compile(r"\bMODE\b(?!\s*\()", re.IGNORECASE)


def data_call(deck: Deck, present: Present, call: Call) -> Node:
    """Return what a call stands for; others as they are.

    SENVAL(s) is the number that sensor s evaluated last, 0 before; ARYVAL(a, k) of an array of variables is VARVAL of
    the k-th, of one of states or outputs what its system makes it; DIF and DIF1 of an implicit DIFF are algebraic
    states; CURVE(u, order, component, c), with u from -1 to 1, a spline of the curve's parameter.
    """
    numbers = [a.integer if isinstance(a, Number) else None for a in call.args]
    if call.name == "SENVAL" and len(numbers) == 1 and numbers[0] in deck.of(st.Sensor):
        return Number(present.sensed.get(numbers[0] or 0, 0.0), call.at)
    if call.name == "ARYVAL" and len(numbers) == 2 and numbers[0] is not None and numbers[1] is not None:
        array = deck.of(st.Array).get(numbers[0])
        if array is not None and 1 <= numbers[1] <= len(array.variables):
            ref = array.variables[numbers[1] - 1]
            return Call("VARVAL", (Number(float(ref), call.at, ref),), call.at)
        return _of_system(deck, call, numbers[0], numbers[1])
    if call.name in ("DIF", "DIF1") and numbers[:1] and numbers[0] in deck.of(st.Diff):
        return _of_diff(deck.of(st.Diff)[numbers[0] or 0], call)
    if call.name == "CURVE" and len(numbers) == 4 and numbers[3] in deck.of(st.CurveStatement):
        return _curve(deck, call, numbers)
    return call


def _of_system(deck: Deck, call: Call, array: int, place: int) -> Node:
    """Return a state or an output of the system that an array belongs to."""
    for statement, system in state_systems(deck):
        if isinstance(statement, st.Gse) and array == statement.xd and 1 <= place <= statement.nd:
            return Number(statement.held[place - 1], call.at)
        if array == system.x and 1 <= place <= len(system.names):
            name = "DIF" if system.rates()[place - 1] is not None else "VARVAL"
            return Call(name, (Name(system.names[place - 1], call.at),), call.at)
        if array == system.y and 1 <= place <= len(system.outputs()):
            return parse(system.outputs()[place - 1])
    return call


def _of_diff(diff: st.Diff, call: Call) -> Node:
    """Return the value or the rate of an implicit DIFF; of others the call as it is."""
    if not diff.implicit or (call.name == "DIF") == has_rate(diff):
        return call
    name = diff_name(diff) if call.name == "DIF" else rate_name(diff_name(diff))
    return Call("VARVAL", (Name(name, call.at),), call.at)


def _curve(deck: Deck, call: Call, numbers: list[int | None]) -> Node:
    order, component, number = numbers[1], numbers[2], numbers[3]
    if order not in (0, 1, 2) or component not in (1, 2, 3):
        return call
    if deck.of(st.CurveStatement)[number or 0].sampled:
        # by its own parameter, not by its length
        own = Name(f"CURVE_{number}.BY.{'XYZ'[component - 1]}", call.at)
        return Call(
            "CUBSPL", (call.args[0], Number(0.0, call.at, 0), own, Number(float(order), call.at, order)), call.at
        )
    half = 0.5 * curve_points(deck, number).length
    at = call.at
    travel = Chain(Chain(call.args[0], (("+", Number(1.0, at, 1)),), at), (("*", Number(half, at)),), at)
    name = Name(f"CURVE_{number}.{'XYZ'[component - 1]}", at)
    value = Call("CUBSPL", (travel, Number(0.0, at, 0), name, Number(float(order), at, order)), at)
    scale = Power(Number(half, at), Number(float(order), at, order), at)
    return Chain(scale, (("*", value),), at)


def with_name(model: AdamsModel, call: Call) -> Node:
    """Return a call that asks for the force of an element by its id with the mechanism's name for it; others as is."""
    kind = ELEMENT_FORCES.get(call.name)
    first = call.args[0] if call.args else None
    if kind is None or not isinstance(first, Number) or first.integer is None:
        return call
    name = model.names.get((kind, first.integer))
    if name is None:
        # an inactive element exerts nothing
        return Number(0.0, call.at) if (kind, first.integer) in model.pairs else call
    return replace(call, args=(Name(name, first.at), *call.args[1:]))


def translated(deck: Deck, present: Present, text: str, rename: Callable[[Call], Node] | None = None) -> str:
    """Return an expression with MODE and calls of data elements replaced, and then those that ``rename`` knows."""
    text = MODE.sub(str(present.mode), text)
    if rename is None and CONCERNED.search(text) is None:
        return text

    def both(call: Call) -> Node:
        found = data_call(deck, present, call)
        return rename(found) if rename is not None and found is call else found

    return unparse(parse(text), both)


# ACCX, WDTX and their kin in the equations: the reactions of probes, see `gearmbs.adams.builders.scopes`.


LINEAR = ("ACCX", "ACCY", "ACCZ", "ACCM")
ANGULAR = ("WDTX", "WDTY", "WDTZ", "WDTM")
FUNCTIONS = (*LINEAR, *ANGULAR)


class Accelerations:
    """The probes of a deck, one for each marker whose acceleration is asked for."""

    def __init__(self, mechanism: Mechanism, markers: Mapping[int, Marker]) -> None:
        self.mechanism, self.markers, self.units = mechanism, markers, mechanism.units
        self.probes: dict[int, tuple[str, float, float]] = {}
        self.gravity: tuple[str, str] | None = None

    def call(self, call: Call) -> Node:
        """Return what a function of accelerations stands for; other calls as they are.

        Raises
        ------
        ValueError
            If it is seen from a frame that moves, or the body has no mass.
        """
        if call.name not in FUNCTIONS:
            return call
        refs = [a.integer or 0 if isinstance(a, Number) else 0 for a in call.args] + [0] * 4
        magnitude = call.name.endswith("M")
        i, j = refs[0], refs[1]
        along, seen = (0, refs[2]) if magnitude else (refs[2], refs[3])
        if self._moves(seen):
            raise ValueError(f"{call.name} in a frame that moves, MARKER/{seen}, can only be asked for in a REQUEST")
        torque = call.name in ANGULAR
        axes = (0, 1, 2) if magnitude else ("XYZ".index(call.name[-1]),)
        parts = [f"({self._of(i, along, k, torque)} - {self._of(j, along, k, torque)})" for k in axes]
        text = parts[0] if len(parts) == 1 else f"SQRT({' + '.join(f'{p}**2' for p in parts)})"
        return parse(text)

    def _moves(self, ref: int) -> bool:
        marker = self.markers.get(ref)
        return marker is not None and not marker.body.is_ground

    def _of(self, ref: int, along: int, axis: int, torque: bool) -> str:
        """Return a component of a marker's acceleration along an axis of another, in the deck's units."""
        if not self._moves(ref):
            return "0"
        if ref not in self.probes:
            joint, mass, inertia = split_off(self.mechanism, f"PROBE_{ref}", self.markers[ref])
            self.probes[ref] = joint.name, mass, inertia
        name, mass, inertia = self.probes[ref]
        units = self.units
        if torque:
            factor = units.factor("torque") / (inertia * units.factor("angular_acceleration"))
            return f'{factor!r}*JOINT("{name}", 0, {6 + axis}, {along})'
        factor = units.factor("force") / (mass * units.factor("acceleration"))
        return f'({factor!r}*JOINT("{name}", 0, {2 + axis}, {along}) + {self._weight(along, axis)})'

    def _weight(self, along: int, axis: int) -> str:
        """Return a component of gravity, shown by two markers on the ground."""
        mechanism, units = self.mechanism, self.units
        if not np.any(mechanism.gravity):
            return "0"
        if self.gravity is None:
            shown = np.asarray(mechanism.gravity) * units.length / units.factor("acceleration")
            tip = mechanism.ground.marker(shown, name="gravity.tip")
            origin = mechanism.ground.marker(name="gravity.origin")
            self.gravity = tip.name, origin.name
        tip_name, origin_name = self.gravity
        return f'D{"XYZ"[axis]}("{tip_name}", "{origin_name}", {along})'


SHARE = 0.01
"""Of a body's mass and its least moment of inertia that a probe takes at most."""


def split_off(mechanism: Mechanism, name: str, marker: Marker) -> tuple[Joint, float, float]:
    """Split a probe off the body of a marker; return the joint that holds it, its mass and moment of inertia.

    Raises
    ------
    ModelError
        If the body has no mass or no inertia.
    """
    body = marker.body
    least = float(np.linalg.eigvalsh(body.inertia)[0])
    if not (body.mass > 0.0 and least > 0.0):
        raise ModelError(
            f"the acceleration of marker '{marker.name}' is no unknown: body '{body.name}' has no mass or no inertia; "
            "give it both, or measure at a marker of another body"
        )
    arm = marker.position - body.com
    mass = min(SHARE * body.mass, SHARE * least / max(float(arm @ arm), 1e-300))
    inertia = SHARE * least
    rest = body.mass - mass
    shift = -mass / rest * arm
    with warnings.catch_warnings():
        # of a thin plate the rest may be thinner still; the body as it was has been looked at
        warnings.simplefilter("ignore")
        body.inertia = body.inertia - inertia * np.eye(3) - steiner(mass, arm) - steiner(rest, shift)
    body.mass = rest
    body.com = body.com + shift
    origin = marker.global_position()
    velocity = body.velocity + np.cross(body.angular_velocity, origin - body.position)
    probe = mechanism.body(
        name, mass, inertia * np.eye(3), position=origin, orientation=marker.global_orientation(), velocity=velocity,
        angular_velocity=body.angular_velocity,
    )  # fmt: skip
    joint = mechanism.joint("fixed", f"{name}.hold", probe.marker(name=f"{name}.I"), marker)
    return joint, mass, inertia


def steiner(mass: float, arm: np.ndarray) -> np.ndarray:
    """Return the inertia of a point mass about another point."""
    return mass * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
