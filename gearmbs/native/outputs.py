"""Outputs of an exported model: names for numbers among the unknowns and records of an instant, or sums of them."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import FORCE_RECORD
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.equations.expressions import opcodes as op
from gearmbs.dae.equations.expressions.tape import Tape, TapeBuilder
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V, POSE_W
from gearmbs.dae.problem import ModelError
from gearmbs.kernels.bound import NAMES
from gearmbs.mechanism.compile import scope_of, starting_angles
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.parts.bodies import Body, Marker
from gearmbs.mechanism.parts.inputs import Output
from gearmbs.mechanism.parts.joints import kinds_with_angle, kinds_with_displacement
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.carriers import error_tape, own_marker, pair_of, unturned
from gearmbs.mechanism.solve.simulator import Simulator
from gearmbs.mechanism.solve.told import PAIRED, VECTORIAL, Begun
from gearmbs.native.asked import Counted, Told
from gearmbs.native.series import ENERGY, FORCE, LOADS, MOMENT, NUMBER, POSE, SOLUTION, STRAYED, UNKNOWN
from gearmbs.wording import did_you_mean

AXES = ("x", "y", "z")
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
OF_BODY = {
    "com_position": (POSE, POSE_R, "m"),
    "com_velocity": (POSE, POSE_V, "m/s"),
    "angular_velocity": (POSE, POSE_W, "rad/s"),
    "com_acceleration": (SOLUTION, 0, "m/s^2"),
    "angular_acceleration": (SOLUTION, 3, "rad/s^2"),
}
"""Quantities of bodies with three components: the record, the first place in that of a body, and the unit."""
MODAL = {"modal_coordinates": (0, "1"), "modal_velocities": (1, "1/s")}
"""Quantities of bodies that deform, by the number of a mode."""
OF_JOINT = ("joint_angle", "joint_displacement", "joint_rate")
"""Quantities of joints that are told as expressions."""
OF_MARKER = {
    "marker_position": (op.DISPLACEMENT, "m"),
    "marker_velocity": (op.VELOCITY, "m/s"),
    "marker_acceleration": (op.ACCELERATION, "m/s^2"),
}
"""Quantities of markers with three components: the measure, and the unit."""
ERROR = "transmission_error"
DEFLECTION = "deflection"
EVALUATE = "evaluate"
OTHERS = ("orientation", "reaction", "reaction_force", "load", "diagnostics", "contact", DEFLECTION, ERROR, "state",
          "unknown", "multipliers", "constraint_violation", "kinetic_energy")  # fmt: skip
ALL = "all"
"""Stands for every output: those of the mechanism, and what is told of one that has none."""


class Finder:
    """Finds where quantities of a solution stand in the records of an instant.

    Parameters
    ----------
    simulator : Simulator
        What is exported.
    begun : Begun
        What stands behind it.
    numbers : sequence of str
        What can be set.
    """

    def __init__(self, simulator: Simulator, begun: Begun, numbers: Sequence[str]) -> None:
        system, self.problem = begun.system, begun.problem
        self.simulator, self.t = simulator, begun.point.t
        self.model, self.states = system.model, list(system.state_names)
        self.mechanism, self.numbers = system.mechanism, list(numbers)
        self.most = max((len(d) for d in self.model.diagnostics), default=0)

    @property
    def columns(self) -> int:
        """Length of the record of an element's load."""
        return FORCE_RECORD + self.most

    def find(self, name: str, asked: Sequence[Any]) -> Told:
        """Return an output by what `Mechanism.output` takes: a quantity of a solution, what it is of, its component.

        Raises
        ------
        ModelError
            For one that is not among the numbers of an instant.
        """
        what, *rest = asked
        try:
            if what == EVALUATE:
                (text,) = rest
                return self.evaluate(name, str(text))
            if what in OF_BODY:
                record, first, unit = OF_BODY[what]
                body, component = rest
                width = POSE_COLUMNS if record == POSE else 6
                place = self._index(self.model.names.bodies, body, "body") * width + first
                return Told(name, unit, ((record, place + _component(AXES, component)),))
            if what == "orientation":
                body, row, column = rest
                if not (str(row) in "012" and str(column) in "012"):
                    raise ValueError(f"there is no element {row}, {column}; rows and columns are 0, 1 and 2")
                place = self._index(self.model.names.bodies, body, "body") * POSE_COLUMNS + POSE_A
                return Told(name, "1", ((POSE, place + 3 * int(row) + int(column)),))
            if what == "reaction":
                joint, component = rest
                return self._reaction(name, joint, _component(WRENCH, component))
            if what == "reaction_force":
                joint, component = rest
                return self._reaction(name, joint, _component(AXES, component))
            if what == "load":
                element, component = rest
                k, c = self._index(self.model.names.forces, element, "force element"), _component(WRENCH, component)
                return Told(name, "N" if c < 3 else "N m", ((LOADS, k * self.columns + c),))
            if what in ("diagnostics", "contact"):
                element, quantity = rest
                k = self._index(self.model.names.forces, element, "force element")
                told = self.model.diagnostics[k]
                c = self._index([d.name for d in told], quantity, f"diagnostic of {element}")
                return Told(name, told[c].unit, ((LOADS, k * self.columns + FORCE_RECORD + c),))
            if what in MODAL:
                body, mode = rest
                return Told(name, MODAL[what][1], ((POSE, self._modal_place(body, int(mode), MODAL[what][0])),))
            if what in OF_JOINT:
                (joint,) = rest
                return self._of_joint(name, what, joint)
            if what in OF_MARKER:
                marker, component = rest
                return self._of_marker(name, what, marker, _component(AXES, component))
            if what == DEFLECTION:
                marker, component = rest
                return self._deflection(name, marker, _component(WRENCH, component))
            if what == ERROR:
                (mesh,) = rest
                return self._error(name, mesh)
            if what == "state":
                (state,) = rest
                return Told(name, "1", ((UNKNOWN, int(self.problem.idata[T.H_Z]) + self.states.index(state)),))
            if what == "unknown":
                (unknown,) = rest
                return Told(name, "1", ((UNKNOWN, self._index(self.problem.names, unknown, "unknown")),))
            if what == "multipliers":
                (row,) = rest
                rows = self.model.names.rows
                place = 6 * len(self.model.names.bodies) + sum(self.model.modes) + self._index(rows, row, "row")
                return Told(name, "1", ((SOLUTION, place),))
            if what == "constraint_violation" and not rest:
                return Told(name, "1", ((STRAYED, 0),))
            if what == "kinetic_energy" and not rest:
                return Told(name, "J", ((ENERGY, 0),))
        except (ValueError, TypeError) as error:
            raise ModelError(f"output {name!r}: {tuple(asked)!r} cannot be told: {error}") from None
        known = ", ".join([*OF_BODY, *MODAL, *OF_JOINT, *OF_MARKER, *OTHERS])
        raise ModelError(f"output {name!r}: a library does not tell {what!r}; it tells {known}")

    def evaluate(self, name: str, text: str) -> Told:
        """Return an output that is an expression; refused as `find` does."""
        scope, _, marker_named = scope_of(self.mechanism)
        try:
            tape = compile_expression(text, scope, accelerations=True)
            entries = tuple(self._unknown(name, key) for key in tape.algebraic)
            counted = self._counted(text, tape, marker_named) if tape.n_angles else Counted()
        except (ExpressionError, ValueError) as error:
            raise ModelError(f"output {name!r}: {text!r} cannot be told: {error}") from None
        if np.isin(tape.ints, np.fromiter(NAMES, dtype=np.int64)).any():
            raise ModelError(f"output {name!r}: a library does not tell {text!r}: it depends on functions of Python")
        return Told(name, "", (), tape.bind(tape.algebraic.index), entries, counted)

    def _counted(self, text: str, tape: Tape, marker_named: Callable[[int], str]) -> Counted:
        """Return the counted angles of an expression, as `gearmbs.mechanism.solve.measures` counts them."""
        turns, problem = self.mechanism.turns, self.problem
        starts = starting_angles(tape, turns, marker_named)
        if self.t != problem.t0:
            starts = self.mechanism.measures(self.simulator.solution()).counted_expression(text, None)[1].tolist()
        places: list[int] = []
        further: list[float] = []
        known = problem.counted
        for function, i, j in tape.angles:
            named = function, marker_named(i), marker_named(j)
            if known is None or named not in known.angles:
                places += (-1, -1, -1)
                further.append(0.0)
                continue
            a, k = len(known.angles), known.angles.index(named)
            places += (0, 1 + k, 1 + a + k)
            first = known.values(np.array([problem.t0]), problem.rdata[known.places][None, :])[0, k]
            further.append(2.0 * np.pi * np.round((turns[named] - first) / (2.0 * np.pi)) if named in turns else 0.0)
        return Counted(tuple(starts), tuple(places), tuple(further))

    def _of_joint(self, name: str, what: str, joint: str) -> Told:
        """Return the angle, displacement or rate of a joint, which are those of its markers."""
        if joint not in self.mechanism.joints:
            raise ValueError(f"there is no joint {joint!r}; there are {', '.join(self.mechanism.joints) or 'none'}")
        found = self.mechanism.joints[joint]
        turns = found.kind in kinds_with_angle()
        if not (turns if what == "joint_angle" else found.kind in kinds_with_displacement() or what == "joint_rate"):
            raise ValueError(f"joint {joint!r} is {found.kind}")
        i, j = found.i.name, found.j.name
        along = f'VZ("{i}", "{j}", "{j}", "{j}")'
        text, unit = {
            "joint_angle": (f'AZ("{i}", "{j}")', "rad"),
            "joint_displacement": (f'DZ("{i}", "{j}", "{j}")', "m"),
            "joint_rate": (f'WZ("{i}", "{j}", "{j}")', "rad/s") if turns else (along, "m/s"),
        }[what]
        return self.evaluate(name, text)._replace(unit=unit)

    @cached_property
    def _marker_rows(self) -> list[int]:
        """Rows of the kinematics table of all markers, those that outputs have needed among them."""
        return list(scope_of(self.mechanism)[1].marker_body)

    def _place_of(self, marker: Marker) -> int:
        """Return the number of a marker in the tables of expressions."""
        m = self.mechanism
        every = [one for body in (m.ground, *m.bodies.values()) for one in body.markers]
        return next(k for k, one in enumerate(every) if one is marker)

    def _marker(self, marker: Any) -> Marker:
        """Return a marker, by its name or of a body's own frame."""
        m = self.mechanism
        if isinstance(marker, Marker):
            return marker
        if isinstance(marker, Body):
            # see `needed_markers`
            return own_marker(marker, _frame_name(marker), marker.marker)
        every = [one for body in (m.ground, *m.bodies.values()) for one in body.markers]
        found = [one for one in every if one.name == marker]
        if len(found) > 1:
            raise ValueError(
                f"marker {marker!r} is on {' and '.join(one.body.name for one in found)}; give the marker itself"
            )
        return every[self._index([one.name for one in every], marker, "marker")]

    def _of_marker(self, name: str, what: str, marker: Any, axis: int) -> Told:
        code, unit = OF_MARKER[what]
        b = TapeBuilder(self._marker_rows)
        found = b.vector(code, self._place_of(self._marker(marker)), op.GLOBAL, op.GLOBAL, op.GLOBAL, axis)
        return Told(name, unit, (), b.finish(found))

    def _deflection(self, name: str, marker: Any, component: int) -> Told:
        """Return how far a marker of a modal body is displaced or turned: its shapes times the modal coordinates."""
        found = self._marker(marker)
        if not isinstance(found.body, ModalBody):
            raise ValueError(f"marker {found.name!r} is on '{found.body.name}', which does not deform")
        shapes, c = found.body.shape_at(found)[component // 3], component % 3
        terms = [f'{float(one)!r}*MODAL("{found.body.name}", {k})' for k, one in enumerate(shapes[:, c], start=1)]
        return self.evaluate(name, " + ".join(terms))._replace(unit="m" if component < 3 else "rad")

    def _error(self, name: str, mesh: str) -> Told:
        """Return the transmission error of a mesh, as `gearmbs.Solution.transmission_error` tells it."""
        element = _meshes(self.mechanism)[self._mesh(mesh)]
        turning = [element.i, element.j]
        still = [unturned(self.mechanism, marker, element) for marker in turning]
        own, others = ([self._place_of(marker) for marker in markers] for markers in (turning, still))
        return Told(name, "m", (), error_tape(self._marker_rows, own, others, element))

    def _mesh(self, mesh: str) -> str:
        known = list(_meshes(self.mechanism))
        return known[self._index(known, mesh, "gear contact")]

    def _modal_place(self, body: str, mode: int, derivative: int) -> int:
        """Return where a modal coordinate or its rate stands behind the poses of all bodies."""
        names, modes = self.model.names.bodies, self.model.modes
        known = {one.upper(): one for one in names}
        number = self._index(names, known.get(body.upper(), body), "body") + 1
        if not 0 <= mode < modes[number]:
            raise ValueError(f"body {body!r} has {modes[number]} modes, counted from 0; there is no {mode}")
        return POSE_COLUMNS * len(names) + derivative * sum(modes) + sum(modes[:number]) + mode

    def _unknown(self, name: str, key: tuple) -> tuple[tuple[int, int], ...]:
        """Return the numbers that add up to an unknown of an expression, see `gearmbs.mechanism.solve.measures`."""
        kind, ref, *rest = key
        if kind in ("diff", "variable"):
            known = {state.upper(): state for state in self.states}
            return self.find(name, ("state", known[str(ref).upper()])).places
        if kind == "number":
            return ((NUMBER, self.numbers.index(str(ref))),)
        if kind in ("mode", "mode1"):
            return ((POSE, self._modal_place(str(ref), int(rest[0]), int(kind == "mode1"))),)
        of_joint = kind in ("joint", "jprim", "motion", "coupler", "gear", "gcon")
        owners = self.model.rows_of_joint if of_joint else self.model.names.forces
        known = {owner.upper(): owner for owner in owners}
        if str(ref).upper() not in known:
            raise ValueError(f"it depends on {kind} {ref}")
        what = "reaction" if of_joint else "load"
        return self.find(name, (what, known[str(ref).upper()], WRENCH[int(rest[0])])).places

    def _reaction(self, name: str, joint: str, c: int) -> Told:
        rows = self.model.rows_of_joint.get(joint)
        if rows is None:
            raise ModelError(f"output {name!r}: joint {joint!r}; the joints are {', '.join(self.model.rows_of_joint)}")
        record, unit = (FORCE, "N") if c < 3 else (MOMENT, "N m")
        return Told(name, unit, tuple((record, 3 * row + c % 3) for row in rows))

    @staticmethod
    def _index(names: Sequence[str], name: str, what: str) -> int:
        if name not in names:
            raise ValueError(f"there is no {what} {name!r}; there are {', '.join(names) or 'none'}")
        return list(names).index(name)

    def names(self) -> dict[str, tuple[Any, ...]]:
        """Return names of motions and modes of all bodies, loads, diagnostics, transmission errors, reactions, states.

        With each stands what `find` takes.
        """
        names = self.model.names
        asked: list[tuple[str, ...]] = []
        for k, body in enumerate(names.bodies, start=1):
            asked += [(what, body, axis) for what in OF_BODY for axis in AXES]
            asked += [(what, body, str(mode)) for what in MODAL for mode in range(self.model.modes[k])]
        meshes = _meshes(self.mechanism)
        for k, element in enumerate(names.forces):
            asked += [("load", element, component) for component in WRENCH]
            asked += [("diagnostics", element, d.name) for d in self.model.diagnostics[k]]
            asked += [(ERROR, element)] if element in meshes else []
        for joint in self.model.rows_of_joint:
            asked += [("reaction", joint, component) for component in WRENCH]
        asked += [("state", state) for state in self.states]
        found: dict[str, tuple[Any, ...]] = {
            f"{of}.{'.'.join((what, *rest))}": (what, of, *rest) for what, of, *rest in asked
        }
        return found | {"kinetic_energy": ("kinetic_energy",)}

    def further_names(self) -> dict[str, tuple[Any, ...]]:
        """Return the names of what is told where it is asked for, with what `find` takes, as `names` does."""
        m = self.mechanism
        asked: list[tuple[str, ...]] = []
        for body in self.model.names.bodies:
            asked += [("orientation", body, row, column) for row in "012" for column in "012"]
        for name, joint in m.joints.items():
            if joint.kind in kinds_with_angle():
                asked.append(("joint_angle", name))
            if joint.kind in kinds_with_displacement():
                asked.append(("joint_displacement", name))
            if joint.kind in (*kinds_with_angle(), *kinds_with_displacement()):
                asked.append(("joint_rate", name))
            asked += [("reaction_force", name, axis) for axis in AXES if name in self.model.rows_of_joint]
        for one in (one for body in (m.ground, *m.bodies.values()) for one in body.markers):
            asked += [(what, one.name, axis) for what in OF_MARKER for axis in AXES]
            if isinstance(one.body, ModalBody):
                asked += [(DEFLECTION, one.name, component) for component in WRENCH]
        asked += [("unknown", unknown) for unknown in self.problem.names]
        asked += [("multipliers", row) for row in self.model.names.rows]
        found: dict[str, tuple[Any, ...]] = {
            f"{of}.{'.'.join((what, *rest))}": (what, of, *rest) for what, of, *rest in asked
        }
        return found | {"constraint_violation": ("constraint_violation",)}

    def parts(self, output: Output) -> list[tuple[str, tuple[Any, ...]]]:
        """Return the names of the numbers that an output of the mechanism is, and what `find` takes for each."""
        assert isinstance(output.what, tuple)
        what, *rest = output.what
        components: Sequence[Any] = ()
        if output.component is None and len(rest) == 1:
            if what in (*PAIRED, DEFLECTION):
                components = WRENCH
            elif what in VECTORIAL:
                components = AXES
            elif what == "orientation":
                elements = [(row, column) for row in range(3) for column in range(3)]
                return [(f"{output.name}.{row}.{column}", (what, *rest, row, column)) for row, column in elements]
            elif what in MODAL and rest[0] in self.model.names.bodies:
                components = range(self.model.modes[self.model.names.bodies.index(rest[0]) + 1])
            elif what in ("diagnostics", "contact") and rest[0] in self.model.names.forces:
                components = [d.name for d in self.model.diagnostics[self.model.names.forces.index(rest[0])]]
        elif what == "multipliers" and not rest:
            components = self.model.names.rows
        if not components:
            return [(output.name, output.what)]
        return [(f"{output.name}.{one}", (what, *rest, one)) for one in components]


def _meshes(mechanism: Any) -> dict[str, Any]:
    """Return the gear contacts and ideal meshes of a mechanism by name."""
    return {name: element for name, element in mechanism.elements.items() if pair_of(element) is not None}


def _frame_name(body: Body) -> str:
    return f"{body.name} frame of outputs"


def needed_markers(mechanism: Any, asked: Sequence[Any]) -> None:
    """Make the markers that an output is told by, which expressions count along with all others."""
    what, *rest = asked
    if what in OF_MARKER and isinstance(rest[0], Body):
        own_marker(rest[0], _frame_name(rest[0]), rest[0].marker)
    elif what == ERROR and (element := _meshes(mechanism).get(rest[0])) is not None:
        with contextlib.suppress(ModelError):
            # of a wheel that is carried around nothing is told
            for marker in (element.i, element.j):
                unturned(mechanism, marker, element)


def _component(names: Sequence[str], component: Any) -> int:
    if component not in names:
        raise ValueError(f"there is no component {component!r}; there are {', '.join(names)}")
    return list(names).index(component)


def chosen_outputs(
    simulator: Simulator, begun: Begun, numbers: Sequence[str], outputs: Sequence[Any] | str | None
) -> tuple[list[Told], dict[str, str]]:
    """Return the outputs of an export, and why some of those that nobody has asked for by name are left out.

    Parameters
    ----------
    simulator, begun, numbers
        As of `Finder`.
    outputs : sequence or str, optional
        Names of outputs of the mechanism or of `Finder.names`, expressions, and quantities as `Mechanism.output` takes
        them; or `ALL`. Default: all outputs of the mechanism that can be told, or everything if it has none.

    Raises
    ------
    ModelError
        For one that is asked for and cannot be told.
    """
    finder, named = Finder(simulator, begun, numbers), begun.system.mechanism.outputs
    names = finder.names()
    given = outputs is not None and outputs != ALL
    items: list[Any]
    if not given:
        items = [*named, *(names if outputs == ALL or not named else ())]
    else:
        items = [outputs] if isinstance(outputs, str) else list(outputs or ())
    asked = [_asked(finder, named, names, item) for item in items]
    for parts in asked:
        for _, what in parts:
            needed_markers(finder.mechanism, what)
    found: list[Told] = []
    left: dict[str, str] = {}
    for item, parts in zip(items, asked, strict=True):
        try:
            found += [finder.find(name, what) for name, what in parts]
        except ModelError as error:
            if given:
                raise
            left[item] = str(error).removeprefix(f"output {parts[0][0]!r}: ")
    return found, left


def _asked(finder: Finder, named: Any, names: Any, item: Any) -> list[tuple[str, tuple[Any, ...]]]:
    """Return the names of the numbers that an item stands for, and what `Finder.find` takes for each."""
    if not isinstance(item, str):
        name = str(item[1]) if item[0] == EVALUATE else ".".join(str(getattr(one, "name", one)) for one in item)
        return [(name, tuple(item))]
    if item in named:
        # sensors make their markers, which all expressions count along with theirs
        made = named[item]
        return [(item, (EVALUATE, made.text))] if made.text is not None else finder.parts(made)
    if item in names:
        return [(item, names[item])]
    if "(" in item:
        return [(item, (EVALUATE, item))]
    further = finder.further_names()
    if item in further:
        return [(item, further[item])]
    known = [*named, *names, *further]
    meant = did_you_mean(item, known, shown=repr, otherwise=f"the outputs are {', '.join(named) or ', '.join(names)}")
    raise ModelError(f"output {item!r}: there is none of this name; {meant}")
