"""From a Mechanism to the flat tables of its equations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae import forces as force_kinds
from gearmbs.dae import tables as T
from gearmbs.dae import terms, timefunctions
from gearmbs.dae.errors import ModelError
from gearmbs.dae.expressions import ExpressionError, Tape
from gearmbs.dae.expressions.tape import LEVEL_ACCELERATION, LEVEL_TIME
from gearmbs.dae.system import System
from gearmbs.dae.tables import TableBuilder
from gearmbs.mechanism import elements as el
from gearmbs.mechanism import joints as jt
from gearmbs.mechanism.elements import GearContact, Load, Torque
from gearmbs.mechanism.expression import Scope, compile_expression
from gearmbs.mechanism.functions import TimeFunction
from gearmbs.mechanism.parts import Body, Marker

if TYPE_CHECKING:
    from gearmbs.mechanism.mechanism import Mechanism


def compile_mechanism(mechanism: Mechanism, t0: float) -> System:
    """Return the System of a mechanism; see :meth:`gearmbs.mechanism.Mechanism.compile`."""
    if not mechanism.bodies:
        raise ModelError(f"mechanism '{mechanism.name}': it has no bodies; add one with .body(...)")
    return _Compiler(mechanism).run(t0)


class _Compiler:
    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.builder = TableBuilder()
        self.builder.gravity = mechanism.gravity
        self.body_index: dict[int, int] = {id(mechanism.ground): 0}
        self.marker_index: dict[int, int] = {}
        self.row_names: list[str] = []
        self._scope: Scope | None = None

    def run(self, t0: float) -> System:
        m = self.mechanism
        pose = np.array([self.add_body(body) for body in m.bodies.values()])
        self.index_all_markers()
        for joint in m.joints.values():
            for row in joint.rows:
                self.add_row(row)
                self.row_names.append(f"{joint.name}: {row.label}")
        for name, text in m.constraints.items():
            tape = self.tape(text, f"general constraint '{name}'", "number")
            if not tape.second_order:
                raise ModelError(
                    f"general constraint '{name}': {text!r} must depend on positions and TIME only; "
                    "velocities and forces cannot enter a constraint"
                )
            self.builder.add_tape_row(self.builder.add_tape(tape))
            self.row_names.append(f"{name}: expression")
        for element in m.elements.values():
            self.add_element(element)
        for state in m.states.values():
            tape = self.tape(state.expression, f"state '{state.name}'", "number")
            self.builder.add_state(
                T.STATE_ALGEBRAIC if state.algebraic else T.STATE_DIFFERENTIAL, self.builder.add_tape(tape)
            )
        system = System(self.builder, pose, list(m.bodies), self.row_names, list(m.elements), t0)
        system.mechanism = m
        system.marker_index = self.marker_index
        system.state_names = [str(s) for s in m.states]
        system.state_start = np.array([s.start for s in m.states.values()])
        return system

    # --- bodies and markers -------------------------------------------------------------------------

    def add_body(self, body: Body) -> np.ndarray:
        self.body_index[id(body)] = self.builder.add_body(body.mass, body.inertia)
        arm = body.orientation @ body.com
        return np.concatenate(
            [
                body.position + arm,
                body.orientation.ravel(),
                body.velocity + np.cross(body.angular_velocity, arm),
                body.angular_velocity,
            ]
        )

    def index_all_markers(self) -> None:
        for body in (self.mechanism.ground, *self.mechanism.bodies.values()):
            for marker in body.markers:
                self.marker_index[id(marker)] = self.builder.add_marker(
                    self.body_index[id(body)], marker.position - body.com, marker.orientation
                )

    def index(self, marker: Marker) -> int:
        return self.marker_index[id(marker)]

    # --- constraints --------------------------------------------------------------------------------

    def add_row(self, row: jt.Row) -> None:
        function = -1 if row.function is None else self.function(row.function, row.label)
        rotation = -1 if row.rotation is None else self.function(row.rotation, row.label)
        packed = [(t.kind, self.index(t.i), self.index(t.j), t.axes, rotation, t.coefficient) for t in row.terms]
        self.builder.add_row(packed, function)
        for k, term in enumerate(row.terms):
            if term.kind == terms.ANGLE:
                self.builder.reference[len(self.builder.terms) - len(row.terms) + k] = jt.initial_coordinate(term)

    def function(self, function: TimeFunction, label: str) -> int:
        if not function.is_expression:
            return self.builder.add_function(function.kind, list(function.parameters))
        tape = self.tape(function.text, label, "number")
        if tape.level > LEVEL_TIME:
            raise ModelError(f"{label}: {function.text!r} must be a function of TIME alone")
        number = self.builder.add_tape(tape)
        self.builder.functions.append((timefunctions.TAPE, number))
        return len(self.builder.functions) - 1

    # --- expressions --------------------------------------------------------------------------------

    def scope(self) -> Scope:
        """Names an expression may use; markers by name, elements by kind and name."""
        if self._scope is None:
            m = self.mechanism
            markers: dict[int | str, int] = {}
            for body in (m.ground, *m.bodies.values()):
                for marker in body.markers:
                    markers[marker.name.upper()] = self.index(marker)
                    if marker.number is not None:
                        markers[marker.number] = self.index(marker)
            forces: dict[tuple[str, int | str], tuple[int | str, int | str | None]] = {}
            for load in m.elements.values():
                if isinstance(load, Load):
                    forces[(load.kind, _upper(load.name))] = (load.i.name.upper(), load.j.name.upper())
            self._scope = Scope(
                markers=markers,
                marker_body=tuple(self.builder.marker_body),
                variables={_upper(k): v for k, v in m.variables.items()},
                states=frozenset(_upper(k) for k, s in m.states.items() if s.algebraic),
                diffs={_upper(k): s.expression for k, s in m.states.items() if not s.algebraic},
                splines={_upper(k): v for k, v in m.splines.items()},
                forces=forces,
                units=m.units,
            )
        return self._scope

    def tape(self, text: str, label: str, dimension: str) -> Tape:
        try:
            tape = compile_expression(text, self.scope(), dimension)
        except ExpressionError as error:
            raise ModelError(f"{label}: {error}") from error
        if tape.level >= LEVEL_ACCELERATION:
            raise ModelError(f"{label}: {text!r} asks for accelerations, which only requests can")
        return tape.bind(lambda key: self.unknown(key, label)) if tape.algebraic else tape

    def unknown(self, key: tuple, label: str) -> int:
        """Return the index in y of an unknown an expression asks for."""
        m = self.mechanism
        at = self.offsets()
        if key[0] in ("diff", "variable"):
            names = [_upper(k) for k in m.states]
            if _upper(key[1]) in names:
                return at["z"] + names.index(_upper(key[1]))
        n_f, n_n = at["F"], at["N"]
        for element in m.elements.values():
            force, torque = _blocks(element)
            if isinstance(element, Load) and (element.kind, _upper(element.name)) == (key[0], _upper(key[1])):
                component = key[2]
                if component < 3 and force:
                    return n_f + component
                if 3 <= component < 6 and torque:
                    return n_n + component - 3
            n_f += 3 * force
            n_n += 3 * torque
        raise ModelError(
            f"{label}: the value {key} is not an unknown of the equations; a force may depend on the force or torque "
            "an element exerts at its I marker and on states, not on joint reactions"
        )

    def offsets(self) -> dict[str, int]:
        """Block offsets of y; the elements' and states' numbers are known before they are added."""
        m = self.mechanism
        n3, rows = 3 * len(m.bodies), sum(len(j.rows) for j in m.joints.values()) + len(m.constraints)
        n_f = 3 * sum(_blocks(e)[0] for e in m.elements.values())
        n_n = 3 * sum(_blocks(e)[1] for e in m.elements.values())
        at = {"F": 5 * n3 + rows}
        at["N"] = at["F"] + n_f
        at["z"] = at["N"] + n_n
        return at

    # --- force elements -----------------------------------------------------------------------------

    def add_element(self, element) -> None:
        i, j = self.index(element.i), self.index(element.j)
        bi, bj = self.body_index[id(element.i.body)], self.body_index[id(element.j.body)]
        if isinstance(element, Torque):
            function = self.function(element.function, f"torque '{element.name}'")
            body = self.body_index[id(element.axis.body)]
            self.builder.add_force(
                force_kinds.TORQUE,
                i,
                j,
                force=False,
                torque=True,
                rm=self.index(element.axis),
                function=function,
                bodies=[body],
            )
        elif isinstance(element, GearContact):
            integers, reals, work = element.pair.contact_tables()
            self.builder.add_force(
                force_kinds.GEAR_CONTACT,
                i,
                j,
                force=True,
                torque=True,
                extra=self.builder.add_extra(integers, reals),
                work=36 + work,
                bodies=[bi, bj],
            )
        elif isinstance(element, Load):
            self.add_load(element, i, j)
        else:
            raise ModelError(f"force element {element!r}: its type is unknown to the mechanism")

    def add_load(self, load: Load, i: int, j: int) -> None:
        label = f"{load.kind} '{load.name}'"
        numbers: list[int] = []
        bodies: list[int] = []
        unknowns: list[int] = []
        for c in range(6):
            text = load.expressions[c] if c < len(load.expressions) else None
            if text is None:
                numbers.append(-1)
                continue
            torque = load.mode == el.AXIS_TORQUE or (load.mode == el.COMPONENTS and c >= 3)
            tape = self.tape(text, label, "torque" if torque else "force")
            numbers.append(self.builder.add_tape(tape))
            bodies.extend(tape.bodies)
            *_, at, n_bodies, n_unknowns = self.builder.tape_rows[-1]
            unknowns.extend(self.builder.extra_i[at + n_bodies : at + n_bodies + n_unknowns])
        directions = [load.i, load.j] if load.mode == el.LINE else [load.rm]
        bodies.extend(self.body_index[id(marker.body)] for marker in directions)
        self.builder.add_force(
            force_kinds.EXPRESSION,
            i,
            j,
            force=load.has_force,
            torque=load.has_torque,
            extra=self.builder.add_extra([load.mode, *numbers], []),
            rm=self.index(load.rm),
            bodies=sorted(set(bodies) - {0}),
            unknowns=sorted(set(unknowns)),
        )


def _blocks(element) -> tuple[bool, bool]:
    """Whether the element's force and torque are unknowns."""
    if isinstance(element, Load):
        return element.has_force, element.has_torque
    return isinstance(element, GearContact), True


def _upper(name: Any) -> Any:
    return name.upper() if isinstance(name, str) else name
