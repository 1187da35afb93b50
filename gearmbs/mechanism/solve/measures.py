"""What can be asked of a finished solution by joint, marker, state or expression."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs._display import html_table, readable
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.expressions import ExpressionError
from gearmbs.dae.equations.expressions.opcodes import KIN_A, KIN_AXES, KIN_R, KIN_V, KIN_W
from gearmbs.dae.equations.loads.time_functions import evaluate
from gearmbs.dae.model.model import Names
from gearmbs.dae.problem import ModelError
from gearmbs.dae.results.frames import (
    KIN_PLACES,
    body_motion,
    elastic_motion,
    frame_motion,
    known_turns,
    mean_speeds,
    rows_of_jumps,
    warn_of_doubtful_turns,
)
from gearmbs.mechanism.parts.bodies import Body, Marker, cross, markers_kept
from gearmbs.mechanism.parts.elements import State
from gearmbs.mechanism.parts.inputs import Output
from gearmbs.mechanism.parts.joints import Joint, kinds_with_angle, kinds_with_displacement
from gearmbs.mechanism.parts.modal import ModalBody
from gearmbs.mechanism.solve.carriers import CARRIED, carrier_of, error_tape, how_to_name, pair_of, unturned
from gearmbs.units import shown

if TYPE_CHECKING:
    from gearmbs.dae.results.solution import Solution
    from gearmbs.mechanism.mechanism import Mechanism


class Measures:
    """Measurements on a solution of a mechanism; :class:`gearmbs.dae.results.solution.Solution` has them as methods.

    Markers may have been added to the bodies after the run.
    """

    def __init__(self, mechanism: Mechanism, solution: Solution) -> None:
        if list(mechanism.bodies) != solution.system.body_names:
            raise ModelError(f"mechanism '{mechanism.name}': its bodies are no longer those of the solution")
        self.mechanism, self.solution = mechanism, solution
        self.looked_at: set[str] = set()
        """Meshes whose wheels stay where they are, by what they stand on."""

    # --- joints -------------------------------------------------------------------------------------

    def angle(self, joint: Joint | str) -> np.ndarray:
        """Return the rotation of I about z_J, full turns counted, shape (m,), rad."""
        found = self._joint(joint, kinds_with_angle(), "angle")
        t = self.solution.t
        ai, aj = self._axes(found.i), self._axes(found.j)
        wanted = np.arctan2(_dot(ai[:, :, 0], aj[:, :, 1]), _dot(ai[:, :, 0], aj[:, :, 0]))
        speed = _dot(self._spin(found.i) - self._spin(found.j), aj[:, :, 2])
        jumps = rows_of_jumps(t, self.solution.jumped)
        steps = mean_speeds(speed, jumps) * np.diff(t)
        known = self._known_turns("AZ", found.i.name, found.j.name)
        if not np.isnan(known).any():
            return wanted + 2 * np.pi * np.round((known - wanted) / (2 * np.pi))
        # each step is the one nearest to what the speeds make of it
        rest = np.diff(wanted) - steps
        turns = np.round(rest / (2 * np.pi))
        start = wanted[0] + 2 * np.pi * np.round((np.nan_to_num(known[0], nan=wanted[0]) - wanted[0]) / (2 * np.pi))
        angle = start + np.concatenate([[0.0], np.cumsum(steps + rest - 2 * np.pi * turns)])
        warn_of_doubtful_turns(t, angle, speed, jumps, f"joint '{found.name}'")
        return angle

    def displacement(self, joint: Joint | str) -> np.ndarray:
        """Return the way of I from J along z_J, shape (m,), m."""
        found = self._joint(joint, kinds_with_displacement(), "displacement")
        return _dot(self.place(found.i) - self.place(found.j), self._axes(found.j)[:, :, 2])

    def rate(self, joint: Joint | str) -> np.ndarray:
        """Return how fast I turns from J about z_J, rad/s, or where it does not, moves along it, m/s, shape (m,)."""
        turning = kinds_with_angle()
        found = self._joint(joint, list(dict.fromkeys([*turning, *kinds_with_displacement()])), "rate")
        i, j = found.i, found.j
        if found.kind in turning:
            fast = self._spin(i) - self._spin(j)
        else:
            fast = self.velocity(i) - self.velocity(j) - np.cross(self._spin(j), self.place(i) - self.place(j))
        return _dot(fast, self._axes(j)[:, :, 2])

    def _joint(self, joint: Joint | str, kinds: list[str], what: str) -> Joint:
        name = joint.name if isinstance(joint, Joint) else joint
        found = self.mechanism.joints.get(name)
        if found is None:
            raise KeyError(f"joint {name!r}; the joints are {', '.join(self.mechanism.joints) or 'none'}")
        if found.kind not in kinds:
            raise ModelError(f"joint '{name}' is {found.kind}; {what} is for {', '.join(kinds)} joints")
        return found

    def _known_turns(self, function: str, i: str, j: str) -> np.ndarray:
        """Return an angle as the run counts it, see there, or where the run starts as a motion prescribes it."""
        known = known_turns(self.solution, function, i, j, self.mechanism.turns.get((function, i, j)))
        if function != "AZ" or not known.size or known[0] == known[0] or known.size < self.solution.t.size:
            return known
        solution, system = self.solution, self.solution.system
        if solution.t[0] != solution.problem.t0:
            return known
        for joint in self.mechanism.joints.values():
            # a name that two markers have says nothing
            if (
                joint.kind == "rotation"
                and (joint.i.name, joint.j.name) == (i, j)
                and self._alone(i)
                and self._alone(j)
            ):
                label = f"{joint.name}: {joint.rows[0].label}"
                if label in system.row_names:
                    angle = self._prescribed(joint, system.row_names.index(label))
                    ai, aj = self._axes(joint.i)[0], self._axes(joint.j)[0]
                    turned = aj[:, :2] @ np.array([np.cos(angle), np.sin(angle)])
                    # it may hold the axes x opposite, as they were drawn
                    known[0] = angle if turned @ ai[:, 0] > 0.0 else angle - np.pi
        return known

    def _alone(self, name: str) -> bool:
        bodies = (self.mechanism.ground, *self.mechanism.bodies.values())
        return sum(marker.name == name for body in bodies for marker in body.markers) == 1

    def _prescribed(self, motion: Joint, row: int) -> float:
        """Return the angle that a motion prescribes where the run starts, rad, with what is set in it."""
        function, problem, model = motion.rows[0].rotation, self.solution.problem, self.solution.system.model
        assert function is not None
        if function.is_expression:
            first = next(iter(self.solution.parts(np.array([0]))))
            return float(self.mechanism.measures(first).expression(function.text)[0])
        kind, at = model.functions[model.terms[model.spans[row].start, T.TERM_FUNCTION]]
        table = problem.rdata.copy()
        if self.solution.result.held is not None:
            cells, held = self.solution.result.held
            table[cells] = held[0]
        return float(evaluate(kind, table, int(problem.idata[T.H_R_FUNCTION]) + int(at), float(problem.t0))[0])

    # --- markers ------------------------------------------------------------------------------------

    def place(self, marker: Marker | Body | str) -> np.ndarray:
        """Return the origin of a marker, or of a body's frame, global components, shape (m, 3), m."""
        return self._motion(marker)[:, KIN_R : KIN_R + 3]

    def velocity(self, marker: Marker | Body | str) -> np.ndarray:
        """Return the velocity of a marker's, or of a body's frame's, origin, global components, shape (m, 3), m/s."""
        return self._motion(marker)[:, KIN_V : KIN_V + 3]

    def deflection(self, at: Marker | str) -> tuple[np.ndarray, np.ndarray]:
        """Return how far a marker of a modal body is displaced (m) and turned (rad) in the body's axes, each (m, 3)."""
        marker = self._find(at) if isinstance(at, str) else at
        body = getattr(marker, "body", None)
        if not isinstance(body, ModalBody):
            raise ModelError(f"{marker!r} is not a marker of a modal body; rigid bodies do not deflect")
        found = self.solution.evaluated
        q = found.modal(found.model.names.bodies.index(body.name) + 1)[0]
        moved, turned = body.shape_at(marker)
        return q @ moved, q @ turned

    def _axes(self, marker: Marker) -> np.ndarray:
        return self._motion(marker)[:, KIN_A : KIN_A + 9].reshape(-1, 3, 3)

    def _spin(self, marker: Marker) -> np.ndarray:
        return self._motion(marker)[:, KIN_W : KIN_W + 3]

    def _motion(self, marker: Marker | Body | str) -> np.ndarray:
        """Return the motion of a marker's frame, or of a body's, columns ``KIN_*``, shape (m, 18)."""
        if isinstance(marker, str):
            marker = self._find(marker)
        if isinstance(marker, Body):
            marker = Marker(f"{marker.name}.frame", marker, np.zeros(3), np.eye(3))
        if not isinstance(marker, Marker):
            raise ModelError(f"{marker!r} is not a marker, a body or the name of a marker")
        host, local = self._frame(marker)
        axes = host[:, KIN_A : KIN_A + 9].reshape(-1, 3, 3)
        out, arm = host[:, :KIN_AXES].copy(), axes @ local
        out[:, KIN_R : KIN_R + 3] += arm
        out[:, KIN_V : KIN_V + 3] += np.cross(host[:, KIN_W : KIN_W + 3], arm)
        out[:, KIN_A : KIN_A + 9] = (axes @ marker.orientation).reshape(-1, 9)
        return out

    def _frame(self, marker: Marker) -> tuple[np.ndarray, np.ndarray]:
        """Return the motion of what a marker is fixed to, columns ``KIN_*``, shape (m, 27), and its place there, m."""
        body, local = marker.body, marker.position - marker.body.com
        if body.is_ground:
            still = np.zeros((self.solution.t.size, KIN_PLACES))
            still[:, KIN_A : KIN_A + 9] = np.eye(3).ravel()
            return still, local
        found = self.solution.evaluated
        number = found.model.names.bodies.index(body.name) + 1
        host = body_motion(found, number)
        if isinstance(body, ModalBody):
            host, _ = elastic_motion(host, None, found.modal(number), local, *body.shape_at(marker))
            local = np.zeros(3)
        return host, local

    def _find(self, name: str) -> Marker:
        bodies = (self.mechanism.ground, *self.mechanism.bodies.values())
        found = [m for body in bodies for m in body.markers if m.name == name]
        if len(found) == 1:
            return found[0]
        if found:
            raise ModelError(
                f"marker {name!r} is on {' and '.join(m.body.name for m in found)}; give the marker itself"
            )
        known = [m.name for body in bodies for m in body.markers]
        raise KeyError(f"marker {name!r}; the markers are {', '.join(known) or 'none'}")

    # --- meshes and outputs -------------------------------------------------------------------------

    def transmission_error(self, mesh: Any) -> np.ndarray:
        """Return r_b1 phi_1 + s r_b2 phi_2, s = 1 for external and -1 for internal pairs, shape (m,), m.

        The angles of the wheels about their axes count from the mechanism's initial position, of wheels that a body
        carries from that body (`Mechanism.gear_contact`). They are known up to full turns, so up to base pitches: what
        is told is nearest to zero.
        """
        name = getattr(mesh, "name", mesh)
        meshes = {n: e for n, e in self.mechanism.elements.items() if pair_of(e) is not None}
        if name not in meshes:
            raise KeyError(f"mesh {name!r}; the gear contacts are {', '.join(meshes) or 'none'}")
        from gearmbs.mechanism.language.series import evaluate_series

        element, m, t = meshes[name], self.mechanism, self.solution.t
        carrier = m.ground
        if name in m.carriers or name not in self.looked_at:
            carrier = carrier_of(m, element)
        if carrier.is_ground:
            self.looked_at.add(name)
            self._check_axes(element)
        turning = [element.i, element.j]
        with markers_kept((m.ground, *m.bodies.values())):
            markers = [*turning, *(unturned(m, marker, element, carrier) for marker in turning)]
            kin = np.stack([self._frame(marker)[0] for marker in markers], axis=1)
        rows = np.arange(len(markers))
        tape = error_tape(rows.tolist(), (0, 1), (2, 3), element)
        frames = np.array([[*marker.position, *marker.orientation.ravel()] for marker in markers])
        # neither accelerations, jumps, unknowns nor counted angles are in it
        none, out = np.zeros(0), np.zeros(t.size)
        evaluate_series(
            tape.ints, tape.floats, t, np.zeros(t.size, dtype=bool), kin, np.zeros((t.size, len(markers), 6)), rows,
            frames, np.zeros((t.size, 0)), np.zeros((2, t.size, 0)), np.zeros((0, t.size)), none,
            np.zeros(tape.work_size), out,
        )  # fmt: skip
        return out

    def _check_axes(self, element: Any) -> None:
        """Refuse wheels whose line of centres has turned: of carried axes absolute angles are no transmission error."""
        axis = element.i.global_orientation()[:, 2]
        first = element.j.global_position() - element.i.global_position()
        now = self._motion(element.j)[:, KIN_R : KIN_R + 3] - self._motion(element.i)[:, KIN_R : KIN_R + 3]
        along = first - (first @ axis) * axis
        turned = np.abs(np.arctan2(now @ cross(axis, along), now @ along))
        if (largest := float(turned.max(initial=0.0))) > CARRIED:
            raise ModelError(
                f"gear contact '{element.name}': the line of centres of its wheels has turned by {largest:.3g} rad, "
                f"something carries it; {how_to_name(element.name)}"
            )

    def output(self, name: str) -> Any:
        """Return an output of the mechanism by its name over time."""
        made = self.named_output(name)
        with markers_kept((self.mechanism.ground, *self.mechanism.bodies.values())):
            what, *names = made.asked
            found = getattr(self.solution, what, None)
            if found is None:
                raise ModelError(f"output {name!r}: a solution tells of no {what!r}; see the methods of Solution")
            return made.of(found(*names) if callable(found) else found)

    def named_output(self, name: str) -> Output:
        """Return what an output of the mechanism is by its name."""
        outputs = self.mechanism.outputs
        if not isinstance(name, str) or name not in outputs:
            raise KeyError(f"output {name!r}; the outputs are {', '.join(outputs) or 'none'}")
        return outputs[name]

    # --- states and expressions ---------------------------------------------------------------------

    def state(self, state: State | str) -> np.ndarray:
        """Return a user-defined state, shape (m,)."""
        name = str(state.name if isinstance(state, State) else state)
        names = [n.upper() for n in self.solution.system.state_names]
        if name.upper() not in names:
            raise KeyError(f"state {name!r}; the states are {', '.join(self.solution.system.state_names) or 'none'}")
        at = int(self.solution.problem.idata[T.H_Z]) + names.index(name.upper())
        return self.solution.result.y[:, at].copy()

    def expression(self, text: str) -> np.ndarray:
        """Return the values of an expression, in the mechanism's units, shape (m,)."""
        return self.counted_expression(text, None)[0]

    def counted_expression(self, text: str, starts: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the same and the angles counted in it at the end, which may start near some others (rad)."""
        from gearmbs.mechanism.compile import scope_of, starting_angles
        from gearmbs.mechanism.language.library import compile_expression
        from gearmbs.mechanism.language.series import expression_values

        scope, builder, marker_named = scope_of(self.mechanism)
        try:
            tape = compile_expression(text, scope, accelerations=True)
        except ExpressionError as error:
            raise ModelError(str(error)) from error
        t = self.solution.t
        y = np.zeros((t.size, max(1, len(tape.algebraic))))
        for q, key in enumerate(tape.algebraic):
            y[:, q] = self._unknown(key)
        tape = tape.bind(tape.algebraic.index)
        bodies = np.array(builder.marker_body, dtype=np.int64)
        frames = np.array([np.ravel(m) for m in builder.marker_frame], dtype=float).reshape(-1, 12)
        kin, acc = frame_motion(self.solution.evaluated, builder.build(Names()))
        if starts is None:
            starts = np.array(starting_angles(tape, self.mechanism.turns, marker_named))
        named = [(f, marker_named(i), marker_named(j)) for f, i, j in tape.angles]
        known = [self._known_turns(*names) for names in named]
        jumps = rows_of_jumps(t, self.solution.jumped)
        return expression_values(tape, starts, known, t, jumps, kin, acc, bodies, frames, y, marker_named)

    def _unknown(self, key: tuple) -> np.ndarray:
        if key[0] in ("diff", "variable"):
            return self.state(str(key[1]))
        if key[0] == "number":
            return self.solution.input(str(key[1]))
        kind, ref, component = key
        if kind in ("mode", "mode1"):
            body = next(name for name in self.mechanism.bodies if name.upper() == ref)
            return self.solution.modal_motion(body)[int(kind == "mode1")][:, component]
        for name in self.solution.system.force_names:
            if name.upper() == str(ref).upper() and kind not in ("joint", "jprim", "motion", "coupler", "gear", "gcon"):
                return np.hstack(self.solution.load(name))[:, component]
        for name in self.mechanism.joints:
            if name.upper() == str(ref).upper():
                return np.hstack(self.solution.reaction(name))[:, component]
        raise ModelError(f"the force of {kind} {ref} is not part of the solution")


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ti,ti->t", a, b)


# A mechanism as tables for notebooks.


def mechanism_html(mechanism: Mechanism) -> str:
    """Return the bodies, joints and forces of a mechanism as tables."""
    rows = sum(len(joint.rows) for joint in mechanism.joints.values())
    gravity = np.array2string(np.asarray(mechanism.gravity), precision=5, separator=", ")
    coordinates = sum(body.coordinates for body in mechanism.bodies.values())
    head = f"Mechanism {mechanism.name}: {coordinates} coordinates, {rows} constraint rows"
    given = mechanism.given
    bodies = [
        (
            name,
            _body_setting(given, name, "mass", shown(body.mass, "kg")),
            _body_setting(given, name, "inertia", ", ".join(f"{v:.4g}" for v in np.diag(body.inertia)) + " kg m^2"),
            _body_setting(given, name, "position", ", ".join(f"{v:.4g}" for v in body.position) + " m"),
        )
        for name, body in mechanism.bodies.items()
    ]
    joints = [
        (
            name,
            joint.kind.replace("_", " "),
            joint.i.body.name,
            joint.j.body.name,
            len(joint.rows),
            _settings(given, name),
        )
        for name, joint in mechanism.joints.items()
    ]
    forces = [
        (name, str(getattr(e, "kind", "force")).replace("_", " "), e.i.body.name, e.j.body.name, _settings(given, name))
        for name, e in mechanism.elements.items()
        if hasattr(e, "i") and hasattr(e, "j")
    ]
    tables = [html_table(head, ("body", "mass", "inertia", "position"), bodies, f"gravity {gravity} m/s^2")]
    if joints:
        tables.append(html_table("Joints and motions", ("name", "kind", "I on", "J on", "rows", "given"), joints))
    if forces:
        tables.append(html_table("Forces", ("name", "kind", "I on", "J on", "given"), forces))
    return "".join(tables)


def _body_setting(given: dict[str, dict[str, Any]], name: str, key: str, otherwise: str) -> str:
    """Return a setting of a body as it was given, or in SI."""
    return readable(given[name][key]) if key in given.get(name, {}) else otherwise


def _settings(given: dict[str, dict[str, Any]], name: str) -> str:
    """Return the settings of a joint or force that were given with units."""
    return "; ".join(f"{key.replace('_', ' ')} {readable(value)}" for key, value in given.get(name, {}).items())
