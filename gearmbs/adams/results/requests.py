"""Evaluate a deck's REQUESTs on a solution: eight columns each, in the deck's units."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gearmbs.adams.builders.scopes import AdamsModel, markers_of, translated
from gearmbs.adams.parse import statements as st
from gearmbs.dae.analyses.statics import EquilibriumSolution
from gearmbs.dae.equations import layout as tables
from gearmbs.dae.equations.expressions import eval_gradient
from gearmbs.dae.equations.expressions.opcodes import KIN_A, KIN_R, ExpressionError
from gearmbs.dae.equations.expressions.tape import Tape
from gearmbs.dae.equations.kinematics import AXES as ANGLE_NAMES
from gearmbs.dae.results.frames import frame_motion, known_turns, rows_of_jumps
from gearmbs.dae.results.solution import Solution
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.compile import scope_of, starting_angles
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.language.series import expression_values
from gearmbs.mechanism.language.syntax import Scope
from gearmbs.mechanism.language.user_functions import raised_errors

COUNTED = re.compile(r"\b(A[XYZ])\(\s*(\d+)\s*(?:,\s*(\d+)\s*)?\)", re.IGNORECASE)
"""Angles in the text of a function whose full turns are counted, with the numbers of their markers."""

NAMES = ("F1", "F2", "F3", "F4", "F5", "F6", "F7", "F8")


@dataclass(frozen=True)
class RequestSeries:
    """One evaluated REQUEST.

    Attributes
    ----------
    statement : Request
    names : tuple of str
        Names of the eight columns.
    values : ndarray, shape (m, 8)
        In the deck's units, angles in radians; zero in columns that were not asked for.
    """

    statement: st.Request
    names: tuple[str, ...]
    values: np.ndarray


CARDAN = {"PSI": "YAW", "THETA": "PITCH", "PHI": "ROLL"}
"""Angles of displacements with OUTPUT/YPR."""


def request_texts(request: st.Request, ypr: bool = False) -> tuple[str | None, ...]:
    """Return the expressions of a request's eight columns; ``ypr`` asks for yaw, pitch and roll."""
    if request.type is None:
        return request.functions()
    markers = {"i": request.i or 0, "j": request.j or 0, "k": request.rm or 0}
    texts: list[str | None] = []
    for column in st.REQUEST_TYPES[request.type].columns.split():
        name, _, arguments = column.strip("-)").partition("(")
        asked = ",".join(str(markers[one]) for one in arguments.split(",") if one)
        texts.append(f"{CARDAN.get(name, name) if ypr else name}({asked})" if name else None)
    return tuple(texts)


def column_names(request: st.Request, ypr: bool = False) -> tuple[str, ...]:
    """Return the names of a request's columns: CNAMES, TITLE, or the functions'."""
    standard: tuple[str, ...] = st.REQUEST_TYPES[request.type].functions if request.type else NAMES
    if ypr:
        standard = tuple(CARDAN.get(name, name) for name in standard)
    given = request.cnames or request.title
    return tuple(given[k] if k < len(given) and given[k] else (standard[k] or NAMES[k]) for k in range(8))


class RequestEvaluator:
    """Evaluates expressions of a deck on a solution.

    Parameters
    ----------
    model : AdamsModel
    solution : Solution
    """

    def __init__(self, model: AdamsModel, solution: Solution) -> None:
        self.model = model
        self.solution = solution
        output = model.deck.only(st.Output)
        self._ypr = output is not None and output.ypr
        system = solution.system
        self.marker_body, self.marker_frame = system.model.marker_body.copy(), system.model.marker_frame.copy()
        self.kin, self.acc = frame_motion(solution.evaluated)
        self._jumps = rows_of_jumps(solution.t, solution.jumped)
        index: dict[int, int] = system.marker_index  # type: ignore[attr-defined]
        self.scope: Scope = model.scope(index, list(self.marker_body))
        self._names = {index[id(m)]: m.name for m in markers_of(model.mechanism)}
        self._turns = dict(model.mechanism.turns)
        if isinstance(solution, EquilibriumSolution):
            # the way to an equilibrium may have wound or unwound a spring
            for (function, i, j), angle in solution.counted().items():
                self._turns[function, self._marker_named(i), self._marker_named(j)] = angle
        self._counted: dict[tuple[str, str, str], None] = dict.fromkeys(self._turns)
        for tape in system.model.tapes:
            self._note(tape)
        for axis, i, j, _ in system.model.angles:
            self._counted[ANGLE_NAMES[axis], self._marker_named(i), self._marker_named(j)] = None
        self._wrenches: dict[tuple[str, int], np.ndarray] = {}

    def request(self, request: st.Request) -> RequestSeries:
        """Evaluate all columns of a request.

        Raises
        ------
        ExpressionError
            When a column names something that does not exist.
        ModelError
            When a routine of the user fails.
        """
        values = np.zeros((self.solution.t.size, 8))
        for column, text in enumerate(request_texts(request, self._ypr)):
            if text is None:
                continue
            try:
                values[:, column] = self.expression(text)
            except ExpressionError as error:
                if request.type == "FORCE" and "no force or joint acts" in str(error):
                    continue
                raise ExpressionError(f"{request.label()}: {NAMES[column]}: {error}") from error
        return RequestSeries(request, column_names(request, self._ypr), values)

    def expression(self, text: str) -> np.ndarray:
        """Return the values of an expression over time, in the deck's units, shape (m,).

        Raises
        ------
        ModelError
            When a routine of the user fails.
        """
        text = translated(self.model.deck, self.model.present, text)
        tape = compile_expression(text, self.scope, accelerations=True)
        m = self.solution.t.size
        y = np.zeros((m, max(1, len(tape.algebraic))))
        for q, key in enumerate(tape.algebraic):
            y[:, q] = self._unknown(key)
        tape = tape.bind(tape.algebraic.index)
        self._note(tape)
        starts = starting_angles(tape, self._turns, self._marker_named) if tape.angles else []
        named = [(function, self._marker_named(i), self._marker_named(j)) for function, i, j in tape.angles]
        known = [known_turns(self.solution, *names, self.model.mechanism.turns.get(names)) for names in named]
        functions = self.model.mechanism.functions
        with raised_errors(functions.values()) if functions else contextlib.nullcontext():
            return expression_values(
                tape, starts, known, self.solution.t, self._jumps, self.kin, self.acc, self.marker_body,
                self.marker_frame, y, self._marker_named,
            )[0]  # fmt: skip

    def variables(self) -> dict[int, np.ndarray]:
        """Return the values of the deck's VARIABLEs over time, but for those that ask for what is not there."""
        found = {}
        for number in self.model.deck.of(st.Variable):
            with contextlib.suppress(ExpressionError):
                found[number] = self.expression(f"VARVAL({number})")
        return found

    def turns(self) -> dict[tuple[str, str, str], float]:
        """Return where the angles counted so far between markers of the deck end, rad.

        They are those that anything active asks for, and those that a statement may ask for later: a force about an
        axis that is switched on or gets another function, and whatever a text of the deck names.
        """
        numbered = {m.name for m in markers_of(self.model.mechanism) if m.number is not None}
        found = {}
        for function, i, j in dict.fromkeys([*self._counted, *self._asked_later()]):
            if {i, j} <= numbered | {""}:
                arguments = ", ".join(f'"{name}"' if name else "0" for name in (i, j))
                found[function, i, j] = float(self.expression(f"{function}({arguments})")[-1])
        return found

    def _asked_later(self) -> Iterator[tuple[str, str, str]]:
        """Yield the angles that statements of the deck may ask for, active or not, by function and names of markers."""
        named = {m.number: m.name for m in markers_of(self.model.mechanism) if m.number is not None}
        for statement in self.model.deck:
            if isinstance(statement, st.Sforce | st.SpringDamper) and statement.type == "ROTATIONAL":
                if statement.i in named and statement.j in named:
                    yield "AZ", named[statement.i], named[statement.j]
            for text in vars(statement).values():
                for function, i, j in COUNTED.findall(text) if isinstance(text, str) else ():
                    if int(i) in named and (not j or int(j) in named):
                        yield function.upper(), named[int(i)], named[int(j)] if j else ""

    def _note(self, tape: Tape) -> None:
        """Remember the angles an expression counts."""
        for function, i, j in tape.angles:
            self._counted[function, self._marker_named(i), self._marker_named(j)] = None

    def _marker_named(self, index: int) -> str:
        return self._names.get(index, "")

    def _unknown(self, key: tuple) -> np.ndarray:
        if key[0] in ("diff", "variable"):
            return self.state(key[1])
        kind, ref, component = key
        return self.wrench(kind, ref)[:, component]

    def state(self, ref: int | str) -> np.ndarray:
        """Return the value of DIFF/ref, or of a force element's state, over time, shape (m,)."""
        at = int(self.solution.problem.idata[tables.H_Z]) + self.model.mechanism.state_names.index(str(ref))
        return self.solution.result.y[:, at]

    def wrench(self, kind: str, ref: int) -> np.ndarray:
        """Return force and torque on the I side, then on the J side, global components, shape (m, 12), SI.

        Torques are about the origin of the marker of their side.
        """
        if (kind, ref) in self._wrenches:
            return self._wrenches[kind, ref]
        i, j = self.model.pairs[kind, ref]
        out = np.zeros((self.solution.t.size, 12))
        name = self.model.names.get((kind, ref))
        if name is None or any(ref is not None and ref not in self.scope.markers for ref in (i, j)):
            # inactive, or left out with the part it stands on
            return out
        if kind in ("ptcv", "cvcv"):
            for axis in "XYZ"[: 3 if kind == "ptcv" else 2]:
                out[:, :6] += self._constraint_wrench(f"{name}.{axis}", i)
        elif kind == "gcon" or name in self.model.mechanism.constraints:
            out[:, :6] = self._constraint_wrench(name, i)
        elif kind in ("joint", "jprim", "motion", "coupler", "gear"):
            out[:, :3], out[:, 3:6] = self._reaction(name)
        elif name in self.solution.system.force_names:
            out[:, :3], out[:, 3:6] = self.solution.load(name)
        out[:, 6:9] = -out[:, 0:3]
        out[:, 9:12] = -out[:, 3:6]
        if j is not None and not self.model.deck.of(st.Marker)[j].floating:
            # a floating marker stands where I is
            out[:, 9:12] -= np.cross(self._origin(i) - self._origin(j), out[:, 0:3])
        self._wrenches[kind, ref] = out
        return out

    def _reaction(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return a joint's reaction; zero when all its rows were redundant."""
        try:
            return self.solution.reaction(name)
        except KeyError:
            zero = np.zeros((self.solution.t.size, 3))
            return zero, zero

    def _origin(self, number: int) -> np.ndarray:
        """Return a marker's origin over time, global components."""
        index = self.scope.markers[number]
        body = self.marker_body[index]
        axes = self.kin[:, body, KIN_A : KIN_A + 9].reshape(-1, 3, 3)
        return self.kin[:, body, KIN_R : KIN_R + 3] + axes @ self.marker_frame[index, :3]

    def _constraint_wrench(self, name: str, i: int) -> np.ndarray:
        """Return -lambda dPhi/d(R, pi) of a general constraint on the body of marker I, about that marker.

        The ground takes minus what the others feel, moments about the global origin: the constraint does not
        change when everything moves together.
        """
        m = self.solution.t.size
        rows = [k for k, row in enumerate(self.solution.system.row_names) if row.rsplit(": ", 1)[0] == name]
        if not rows:
            return np.zeros((m, 6))
        lam = self.solution.multipliers[:, rows[0]]
        # the constraint is the mechanism's, in its own names
        (text,) = self.model.mechanism.constraints[name].rows.values()
        tape = compile_expression(text, scope_of(self.model.mechanism)[0])
        grad = np.zeros((m, tape.gradient_size))
        _gradient_series(
            tape.ints, tape.floats, self.solution.t, self.kin, self.marker_body, self.marker_frame, np.zeros(1),
            np.zeros(max(1, tape.n_angles)), np.zeros(tape.work_size), grad,
        )  # fmt: skip
        owner = int(self.marker_body[self.scope.markers[i]])
        origin = self._origin(i)
        out = np.zeros((m, 6))
        for p, other in enumerate(tape.bodies):
            if owner not in (0, other):
                continue
            force = -lam[:, None] * grad[:, 12 * p : 12 * p + 3]
            torque = -lam[:, None] * grad[:, 12 * p + 3 : 12 * p + 6]
            center = self.kin[:, other, KIN_R : KIN_R + 3]
            sign = 1.0 if owner else -1.0
            out[:, :3] += sign * force
            out[:, 3:] += sign * (torque + np.cross(center - origin, force))
        return out


@njit(
    "void(int64[::1], float64[::1], float64[::1], float64[:, :, ::1], int64[::1], float64[:, ::1], float64[::1],"
    " float64[::1], float64[::1], float64[:, ::1])",
    cache=True,
    nogil=True,
)
def _gradient_series(ints, floats, t, kin, marker_body, marker_frame, y, ref, work, grad):
    """Write a tape's spatial gradient at every time.

    Parameters
    ----------
    ints : ndarray of int
        Integer table of the expression (`Tape.ints`).
    floats : ndarray
        Real table of the expression (`Tape.floats`).
    t : ndarray
        Times, s.
    kin : ndarray, shape (times, bodies, KIN_COLUMNS)
        Positions, orientations and velocities of the bodies.
    marker_body : ndarray of int
        Body of each marker.
    marker_frame : ndarray, shape (markers, 12)
        Origin and orientation of each marker in its body.
    y : ndarray, shape (times, unknowns)
        Unknowns.
    ref : ndarray
        References of the counted angles.
    work : ndarray
        Scratch, `Tape.work_size` entries.
    grad : ndarray
        Receives the gradient: 12 spatial variations of each body of the tape, then its unknowns.
    """
    for k in range(t.size):
        eval_gradient(ints, floats, t[k], kin[k], marker_body, marker_frame, y, ref, grad[k], work)
