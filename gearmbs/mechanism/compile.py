"""From a Mechanism to the flat tables of its equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.equations.expressions.opcodes import LEVEL_ACCELERATION, LEVEL_TIME
from gearmbs.dae.equations.kinematics import AXES as COUNTED
from gearmbs.dae.equations.loads import time_functions
from gearmbs.dae.equations.unknowns import I3, Counts, offsets
from gearmbs.dae.model.builder import TableBuilder
from gearmbs.dae.model.model import STATE_IMPLICIT, Configuration, Names
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import INPUT, PARAMETER, ModelError, Number, Place
from gearmbs.mechanism.checks import row_order
from gearmbs.mechanism.language.syntax import NamedNumber, Scope
from gearmbs.mechanism.parts import elements as el
from gearmbs.mechanism.parts import joints as jt
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.constraint_laws import GeneralConstraint
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Load, State
from gearmbs.mechanism.parts.functions import TimeFunction
from gearmbs.mechanism.parts.inputs import COEFFICIENTS, Input, Parameter, is_multiple, unit_factor
from gearmbs.mechanism.parts.modal import ModalBody

if TYPE_CHECKING:
    from gearmbs.dae.equations.expressions import Tape
    from gearmbs.mechanism.mechanism import Mechanism

REACTION_KINDS = {
    "rotation": ("motion",),
    "translation": ("motion",),
    "coupler": ("coupler", "gear"),
    "distance": ("gcon", "joint"),
}
"""Functions under which the reactions of joints, of the kind given, can be asked for; others are JOINT and JPRIM."""
REACTION_KEYS = ("joint", "jprim", "motion", "coupler", "gear", "gcon")
SETTLED = {time_functions.CONSTANT: 0, time_functions.STEP: 3, time_functions.STEP5: 3}
"""Which parameter of a function of time is the value that it has, or ends at."""
MODAL_BLOCKS = {"mode": "q_f", "mode1": "v_f"}
"""Blocks of y that hold modal coordinates and their rates."""


def compile_mechanism(mechanism: Mechanism, t0: float) -> System:
    """Return the System of a mechanism; see :meth:`gearmbs.mechanism.Mechanism.compile`."""
    if not mechanism.bodies:
        raise ModelError(f"mechanism '{mechanism.name}': it has no bodies; add one with .body(...)")
    measured: list[str] = []
    while True:
        compiler = _Compiler(mechanism, measured)
        system = compiler.run(t0)
        if not compiler.missing:
            return system
        # an expression asks for a joint's reaction: it becomes an unknown, and all places in y move
        measured = [*measured, *compiler.missing]


def scope_of(mechanism: Mechanism) -> tuple[Scope, TableBuilder, Callable[[int], str]]:
    """Return what expressions about a mechanism may name, its present markers' tables, and the names of markers."""
    compiler = _Compiler(mechanism, [])
    compiler.add_bodies()
    compiler.index_all_markers()
    compiler.measures = True
    return compiler.scope(), compiler.builder, compiler.marker_named


class _Compiler:
    def __init__(self, mechanism: Mechanism, measured: list[str]) -> None:
        self.mechanism = mechanism
        self.measured = measured
        self.missing: dict[str, None] = {}
        self.builder = TableBuilder()
        self.builder.gravity = mechanism.gravity
        self.body_index: dict[int, int] = {id(mechanism.ground): 0}
        self.marker_index: dict[int, int] = {}
        self.marker_names: list[str] = []
        self.row_names: list[str] = []
        self.force_names: list[str] = []
        self._scope: Scope | None = None
        self._spelt: dict[str, str] = {}
        """Names of inputs and parameters by what they are in capitals."""
        self.measures = False
        """Whether expressions are about a solution, which knows all inputs, and not part of the equations."""

    def run(self, t0: float) -> System:
        m = self.mechanism
        self.add_bodies()
        pose = np.array([body.pose_record() for body in m.bodies.values()])
        bent = [body for body in m.bodies.values() if isinstance(body, ModalBody)]
        q_f = np.concatenate([np.zeros(0), *(body.start for body in bent)])
        v_f = np.concatenate([np.zeros(0), *(body.rate for body in bent)])
        self.index_all_markers()
        self.add_numbers()
        labels = [f"{joint.name}: {row.label}" for joint in m.joints.values() for row in joint.rows]
        rows = [row for joint in m.joints.values() for row in joint.rows]
        self.builder.add_rows([self.packed_row(row, label) for row, label in zip(rows, labels)])
        self.row_names += labels
        for name, constraint in m.constraints.items():
            self.add_constraint(name, constraint)
        # the states given by expressions come first among the unknowns; their tapes are added with all else known
        self.builder.states = [(_state_kind(state), -1) for state in m.states.values()]
        for element in m.elements.values():
            self.add_element(element)
        for name in self.measured:
            self.add_reaction(m.joints[name])
        kinds: list[tuple[int, int]] = []
        for state in m.states.values():
            tape = self.tape(state.expression, f"state '{state.name}'", "number")
            kinds.append((_state_kind(state), self.add_tape(tape)))
        self.builder.states[: len(kinds)] = kinds
        elements = [*self.force_names, *(f"reaction of {name}" for name in self.measured)]
        every_state = m.every_state
        names = Names(tuple(m.bodies), tuple(self.row_names), tuple(elements), tuple(m.names_of(every_state)))
        start = [s.start for s in every_state]
        system = System(self.builder.build(names), Configuration(pose, q_f, v_f), start, t0, m, self.marker_index)
        system.row_order = row_order(m)
        return system

    # --- bodies and markers -------------------------------------------------------------------------

    def add_bodies(self) -> None:
        bodies = [(body, body.numbers) for body in self.mechanism.bodies.values()]
        for body, numbers in bodies:
            modal = body.modal if isinstance(body, ModalBody) else None
            self.body_index[id(body)] = self.builder.add_body(
                body.mass, body.inertia, modal, kind=body.kind, numbers=numbers
            )

    def index_all_markers(self) -> None:
        owners = (self.mechanism.ground, *self.mechanism.bodies.values())
        places = [(body, marker, body.shape_at(marker)) for body in owners for marker in body.markers]
        for body, marker, shape in places:
            self.marker_index[id(marker)] = self.builder.add_marker(
                self.body_index[id(body)], marker.position - body.com, marker.orientation, shape
            )
            self.marker_names.append(marker.name)

    def index(self, marker: Marker) -> int:
        return self.marker_index[id(marker)]

    def marker_named(self, index: int) -> str:
        """Return the name of a marker of the table, "" for the global frame."""
        return self.marker_names[index] if index >= 0 else ""

    # --- inputs and parameters ----------------------------------------------------------------------

    def add_numbers(self) -> None:
        """Add inputs and parameters; refuse those whose names mean something else."""
        m = self.mechanism
        for what, taken in (("marker", self.marker_names), ("variable", m.variables), ("state", m.states)):
            names = {_upper(name) for name in taken}
            every: list[Input | Parameter] = [*m.inputs.values(), *m.parameters.values()]
            for made in every:
                if made.name.upper() in names:
                    kind = INPUT if isinstance(made, Input) else PARAMETER
                    raise ModelError(f"{kind} {made.name!r}: a {what} has the name, too; choose another")
        for given in m.inputs.values():
            self.know(given)
        for constant in m.parameters.values():
            self._spelt[constant.name.upper()] = constant.name
            self.builder.add_number(constant.name, constant.unit, PARAMETER, constant.start)
        self.builder.aliases |= m.aliases

    def know(self, made: Input) -> None:
        """Add an input, which may be one that was not made by the mechanism, to the named numbers."""
        known = self.builder.numbers.get(self._spelt.setdefault(made.name.upper(), made.name))
        if known is None:
            self.builder.add_number(made.name, made.unit, INPUT, made.start)
        elif known.kind != INPUT or known.unit != made.unit or known.name != made.name:
            raise ModelError(
                f"input {made.name!r}: another {known.kind} in {known.unit} is called {known.name!r}; choose another"
            )
        elif (start := float(self.builder.extra_r[known.places[0].at + 1])) != made.start:
            raise ModelError(
                f"input {made.name!r}: it starts at {made.start:g} {made.unit}, another one of this name at {start:g}; "
                "use one and the same, or choose another name"
            )

    # --- constraints --------------------------------------------------------------------------------

    def packed_row(self, row: jt.Row, label: str) -> tuple[list[tuple], int]:
        """Return the terms and the function of a constraint row as `TableBuilder.add_rows` takes them."""
        function = -1 if row.function is None else self.function(row.function, label, label)
        rotation = -1 if row.rotation is None else self.function(row.rotation, label, label)
        index = self.marker_index
        packed = []
        for t in row.terms:
            start = jt.initial_angle(row, t) if t.kind == terms.ANGLE else 0.0
            packed.append((t.kind, index[id(t.i)], index[id(t.j)], t.axes, rotation, t.coefficient, start))
        return packed, function

    def add_constraint(self, name: str, constraint: GeneralConstraint) -> None:
        """Add the rows of a constraint by expressions."""
        about = None if constraint.about is None else self.index(constraint.about)
        for label, text in constraint.rows.items():
            tape = self.tape(text, f"general constraint '{name}'", "number")
            if not tape.second_order:
                raise ModelError(
                    f"general constraint '{name}': {text!r} must depend on positions and TIME only; "
                    "velocities and forces cannot enter a constraint"
                )
            row = f"{name}: {label}"
            self.builder.add_tape_row(self.add_tape(tape, row, about))
            self.row_names.append(row)

    def function(self, function: TimeFunction, label: str, row: str | None = None) -> int:
        """Add a function of time; ``row`` is the constraint that it is prescribed for, if it is one."""
        if not function.is_expression:
            number = self.builder.add_function(function.kind, list(function.parameters))
            if isinstance(function, Input):
                self.know(function)
                # behind the number of its pieces
                at = self.builder.functions[number][1] + 1
                self.builder.add_place(
                    function.name, Place(at, COEFFICIENTS, function.order, table=T.H_R_FUNCTION), row
                )
            return number
        tape = self.tape(function.text, label, "number")
        if tape.level > LEVEL_TIME:
            raise ModelError(f"{label}: {function.text!r} must be a function of TIME alone")
        number = self.add_tape(tape, row)
        self.builder.functions.append((time_functions.TAPE, number))
        return len(self.builder.functions) - 1

    # --- expressions --------------------------------------------------------------------------------

    def add_tape(self, tape: Tape, row: str | None = None, about: int | None = None) -> int:
        """Add a tape; its counted angles start where the mechanism says.

        ``row`` is the constraint it is part of, ``about`` the marker about which its reaction is told.
        """
        number = self.builder.add_tape(tape, about)
        for name, place, size in tape.numbers:
            at = self.builder.tape_rows[-1][T.TAPE_R] + place
            bent = not is_multiple(tape.text, name)
            self.builder.add_place(name, Place(at, size, table=T.H_R_EXTRA, bent=bent), row)
        at, n = self.builder.tape_rows[-1][T.TAPE_REFERENCE], tape.n_angles
        for k, start in enumerate(starting_angles(tape, self.mechanism.turns, self.marker_named)):
            # the reference, and the value of the last point that was tracked
            self.builder.extra_r[at + k] = self.builder.extra_r[at + n + k] = start
        return number

    def scope(self) -> Scope:
        """Names an expression may use; markers by name, elements by kind and name."""
        if self._scope is None:
            m = self.mechanism
            markers: dict[int | str, int] = {}
            several: set[str] = set()
            for body in (m.ground, *m.bodies.values()):
                for marker in body.markers:
                    index = self.index(marker)
                    if marker.name.upper() in markers:
                        several.add(marker.name.upper())
                    # elements know their markers, whatever these are called
                    markers[marker.name.upper()] = markers[_own(index)] = index
                    if marker.number is not None:
                        markers[marker.number] = index
            forces: dict[tuple[str, int | str], tuple[int | str, int | str | None]] = {}
            aliases: set[tuple[str, int | str]] = set()
            for joint in m.joints.values():
                keys = [(kind, _upper(joint.name)) for kind in REACTION_KINDS.get(joint.kind, ("joint", "jprim"))]
                forces.update(dict.fromkeys(keys, (_own(self.index(joint.i)), _own(self.index(joint.j)))))
                aliases.update(keys[1:])
            absent: set[tuple[str, int | str, int]] = set()
            for load in m.elements.values():
                if len(load.markers) == 2:
                    pair = _own(self.index(load.i)), _own(self.index(load.j))
                    forces[(load.kind, _upper(load.name))] = pair
                    for base, there in ((0, load.has_force), (3, load.has_torque)):
                        if not there:
                            absent.add((load.kind, _upper(load.name), base))
            self._scope = Scope(
                markers=markers,
                several=frozenset(several),
                marker_body=tuple(self.builder.marker_body),
                variables={_upper(k): v for k, v in m.variables.items()},
                states=frozenset(_upper(k) for k, s in m.states.items() if s.algebraic),
                diffs={
                    **{_upper(k): s.expression for k, s in m.states.items() if not s.algebraic},
                    **{_upper(s.name): None for s in m.every_state[len(m.states) :] if not s.algebraic},
                },
                modes={_upper(name): b.modal.modes for name, b in m.bodies.items() if isinstance(b, ModalBody)},
                splines={_upper(k): v for k, v in m.splines.items()},
                arrays={_upper(k): v for k, v in m.arrays.items()},
                numbers=named_numbers(m, self.measures),
                functions=m.functions,
                plants={(kind, _upper(k)): v for (kind, k), v in m.plants.items()},
                forces=forces,
                absent=frozenset(absent),
                aliases=frozenset(aliases),
                units=m.units,
                one_sided=True,
            )
        return self._scope

    def tape(self, text: str, label: str, dimension: str) -> Tape:
        """Return an expression bound to the unknowns; the compiler of expressions is loaded with the first."""
        from gearmbs.mechanism.language.library import compile_expression

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
        if key[0] in MODAL_BLOCKS:
            before = [_upper(name) for name in m.bodies].index(key[1])
            return at[MODAL_BLOCKS[key[0]]] + sum(self.builder.modes[1 : 1 + before]) + key[2]
        if key[0] in ("diff", "variable"):
            names = [name.upper() for name in m.state_names]
            if str(key[1]).upper() in names:
                return at["z"] + names.index(str(key[1]).upper())
        n_f, n_n = at["F"], at["N"]
        for element in m.elements.values():
            force, torque = element.has_force, element.has_torque
            if (element.kind, _upper(element.name)) == (key[0], _upper(key[1])):
                component = key[2]
                if component < 3 and force:
                    return n_f + component
                if 3 <= component < 6 and torque:
                    return n_n + component - 3
            n_f += 3 * force * element.wrenches
            n_n += 3 * torque * element.wrenches
        if key[0] in REACTION_KEYS:
            name = next((n for n in m.joints if _upper(n) == _upper(key[1])), None)
            if name in self.measured:
                k = self.measured.index(name)
                return (n_f + 3 * k + key[2]) if key[2] < 3 else (n_n + 3 * k + key[2] - 3)
            if name is not None:
                self.missing[name] = None
                # any place in y serves until the next attempt, which knows of the reaction
                return at["F"]
        raise ModelError(
            f"{label}: the value {key} is not an unknown of the equations; a load may depend on what joints, motions "
            "and loads exert and on states, not on the reaction of a constraint given by an expression"
        )

    def offsets(self) -> dict[str, int]:
        """Offsets of the blocks of y; the numbers of rows, elements and states are known before they are added."""
        m = self.mechanism
        counts = Counts(
            angles=tuple(kind.angles for kind in self.builder.kinds[1:]),
            modes=tuple(self.builder.modes[1:]),
            rows=sum(len(j.rows) for j in m.joints.values()) + sum(len(c.rows) for c in m.constraints.values()),
            forces=sum(e.wrenches * e.has_force for e in m.elements.values()) + len(self.measured),
            torques=sum(e.wrenches * e.has_torque for e in m.elements.values()) + len(self.measured),
            states=len(m.every_state),
        )
        return offsets(counts, I3)

    # --- force elements -----------------------------------------------------------------------------

    def add_element(self, element: ForceElement | Load) -> None:
        """Add a force element by its own tables, or a load by its expressions."""
        self.force_names.append(element.name)
        if isinstance(element, Load):
            self.add_load(element)
            return
        if not isinstance(element, ForceElement):
            raise ModelError(f"force element {element!r}: its type is unknown to the mechanism")
        label, step = f"{element.kind} '{element.name}'", "compiled()"
        try:
            wrenches, acting, states, made = element.wrenches, element.markers, element.states, element.compiled()
            _check_numbers(element, made, label)
            if not type(element).__module__.startswith("gearmbs.") or getattr(element, "derivatives", None) is not None:
                # those of the package's own elements are compared in its tests
                from gearmbs.mechanism.forces.functions import check_derivatives

                step = "kernel"
                check_derivatives(element, made)
        except ModelError:
            raise
        except Exception as error:
            reason = f"{type(error).__name__}: {error}"
            raise ModelError(f"{label}: its {step} fails with {reason}") from error
        self.force_names += [f"{element.name}[{k}]" for k in range(1, wrenches)]
        turns = self.mechanism.turns
        self.builder.add_element(
            made.kernel,
            [self.index(m) for m in acting],
            sees=None if made.sees is None else [self.index(m) for m in made.sees],
            force=element.has_force,
            torque=element.has_torque,
            integers=made.integers,
            reals=made.reals,
            functions=made.functions,
            states=[_state_kind(state) for state in states],
            unknowns=[self.unknown(("joint", name, c), label) for name in made.reactions for c in range(6)],
            times=[self.function(function, label) for function in made.times],
            angles=[
                self.builder.add_angle(
                    axis, self.index(i), self.index(j), turns.get((COUNTED[axis], i.name, j.name), 0.0)
                )
                for axis, i, j in made.angles
            ],
            scratch=made.scratch,
            diagnostics=element.diagnostics,
            lean=made.lean,
        )
        self.add_settings(element.name, made)

    def add_settings(self, name: str, made: Compiled) -> None:
        """Add what of an element can be changed by its name; its tables have just been added."""
        row, functions = self.builder.forces[-1], self.builder.functions
        for what, setting in made.settings.items():
            first = row[T.FORCE_REXTRA]
            every = ((setting.at, setting.factor, setting.offset), *setting.others)
            places = tuple(Place(first + at, factor=f, offset=c, table=T.H_R_EXTRA) for at, f, c in every)
            label = self.free(f"{name}.{what}", name)
            self.builder.numbers[label] = Number(label, setting.unit, PARAMETER, places, allowed=setting.allowed)
        for what, number in made.given.items():
            kind, at = functions[len(functions) - len(made.times) + number]
            if kind in SETTLED:
                place = Place(at + SETTLED[kind], table=T.H_R_FUNCTION)
                label = self.free(f"{name}.{what}", name)
                self.builder.numbers[label] = Number(label, "N*m", PARAMETER, (place,), loads=True)

    def free(self, number: str, element: str) -> str:
        """Return the name of a number of an element; raise a ModelError if an input or a parameter has it, too."""
        spelt = self._spelt.get(number.upper())
        if spelt is not None:
            kind = self.builder.numbers[spelt].kind
            raise ModelError(
                f"{kind} {spelt!r}: '{element}' has a number of this name; choose another, or let the {kind} be it"
            )
        return number

    def add_reaction(self, joint: jt.Joint) -> None:
        """Make the force and moment of a joint on its I marker's body unknowns."""
        names = list(self.mechanism.joints)
        before = sum(len(self.mechanism.joints[n].rows) for n in names[: names.index(joint.name)])
        first = self.offsets()["lambda"] + before
        own = self.builder.marker_body
        bodies = {own[self.index(m)] for row in joint.rows for t in row.terms for m in (t.i, t.j)} - {0}
        self.builder.add_force(
            T.REACTION,
            self.index(joint.i),
            self.index(joint.j),
            force=True,
            torque=True,
            bodies=sorted(bodies),
            unknowns=list(range(first, first + len(joint.rows))),
        )

    def add_load(self, load: Load) -> None:
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
            numbers.append(self.add_tape(tape))
            bodies.extend(tape.bodies)
            at, n_bodies, n_unknowns = self.builder.tape_rows[-1][T.TAPE_BODIES : T.TAPE_ADDRESS]
            unknowns.extend(self.builder.extra_i[at + n_bodies : at + n_bodies + n_unknowns])
        directions = [load.i, load.j] if load.mode == el.LINE else [load.rm]
        bodies.extend(self.builder.marker_body[self.index(marker)] for marker in directions)
        self.builder.add_force(
            T.EXPRESSION,
            self.index(load.i),
            self.index(load.j),
            force=load.has_force,
            torque=load.has_torque,
            extra=self.builder.add_extra([load.mode, *numbers], []),
            rm=self.index(load.rm),
            bodies=sorted(set(bodies) - {0}),
            unknowns=sorted(set(unknowns)),
        )


def named_numbers(mechanism: Mechanism, known: bool = False) -> dict[str, NamedNumber]:
    """Return the inputs and parameters of a mechanism as expressions take them, by upper-case name."""
    found = {}
    every: list[Input | Parameter] = [*mechanism.inputs.values(), *mechanism.parameters.values()]
    for made in every:
        factor = unit_factor(mechanism.units, made.unit)
        found[made.name.upper()] = NamedNumber(made.name, made.start, factor, isinstance(made, Input), known)
    return found


def starting_angles(
    tape: Tape, turns: Mapping[tuple[str, str, str], float], marker_named: Callable[[int], str]
) -> list[float]:
    """Return where the counted angles of a tape start, given by function and names of the markers I and J; 0 else."""
    found = []
    for function, i, j in tape.angles:
        found.append(float(turns.get((function, marker_named(i), marker_named(j)), 0.0)))
    return found


def _check_numbers(element: ForceElement, made: Compiled, label: str) -> None:
    """Refuse tables of a force element that hold something else than numbers, by the field that it comes from.

    Raises
    ------
    ModelError
    """
    for table in ("integers", "reals"):
        given = getattr(made, table)
        for place, value in enumerate(() if isinstance(given, np.ndarray) else given):
            try:
                float(value)
            except (TypeError, ValueError):
                field = next((name for name, own in vars(element).items() if own is value), f"{table}[{place}]")
                raise ModelError(
                    f"{label}: {field} = {value!r} is no number among the {table} of its compiled(); give one, or "
                    f"say in the class how a text is read: reads = {{'{field}': reader('N/m')}} with its unit, from "
                    "gearmbs.mechanism.parts.quantities"
                ) from None


def _state_kind(state: State) -> int:
    if state.implicit:
        return STATE_IMPLICIT
    return T.STATE_ALGEBRAIC if state.algebraic else T.STATE_DIFFERENTIAL


def _upper(name: Any) -> Any:
    return name.upper() if isinstance(name, str) else name


def _own(index: int) -> int:
    """Return by what elements refer to a marker of the table: below zero, where nothing in an expression is."""
    return -1 - index
