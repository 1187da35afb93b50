"""A run handed on part by part, with forces, orientations and diagnostics at the integrator's own steps.

Accelerations and reactions of an output are else found by solving the index-1 system there, with all loads evaluated
once more, which takes longer than the step itself. But multipliers are unknowns in SI2, and the last evaluation of the
residual has left what force elements tell in the scratch array. Where bodies turn about fixed axes the loads are no
unknowns; there the last evaluation, at y_m, and the Jacobian of the corrector give them as a Newton step would,

    F = F(y_m) + dF/dy (y - y_m),

and a fixed joint transmits what moves the bodies beyond it, sum m (a - g), less the loads on them. All of this is off
by what the corrector leaves, a part of the tolerance; diagnostics, those at y_m, by what the last correction was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.loads.forces import DIAGNOSTICS
from gearmbs.dae.equations.rotation import POSE_A, POSE_R
from gearmbs.dae.equations.unknowns import SI2
from gearmbs.dae.model.system import System
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results import readers
from gearmbs.dae.results.solution import CONFLICT_SAMPLES, PART_SIZE, Solution
from gearmbs.kernels.pointers import direct

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members
    from gearmbs.dae.model.system import System

MOST = 128
"""Numbers watched at most, a kilobyte a step: what eight meshes of planets tell with room for as many. Copying it takes
a hundredth of such a step; forces of groups about fixed axes want many times more, which would cost what it saves."""

BALANCED = 1e-12
"""Distance of a centre of mass from its axis, m, that is rounding: at 1000 rad/s it moves a kilogram by 1e-6 N."""

MOMENTS_ONLY = (terms.DOT1, terms.ROTATION, terms.ANGLE)
"""Terms of constraints that exert no force."""


@dataclass(frozen=True)
class Steps:
    """Some accepted steps: unknowns, (m, n), the watched numbers, (m, w), and the integer table valid there."""

    y: np.ndarray
    left: np.ndarray
    idata: np.ndarray


Reader = Callable[[Steps], Any]


def _read(kind: int, steps: Steps, places: np.ndarray, numbers: np.ndarray, components: int) -> np.ndarray:
    """Return what a compiled reader reads, (m, components), each component on end in memory."""
    out = np.empty((components, len(steps.y)))
    direct(readers.read)(kind, steps.y, steps.left, places, numbers, out)
    return out.T


class Watch:
    """What is read of a run's own steps, by method and name.

    Parameters
    ----------
    system : System
    problem : DAEProblem
    members : Members or None
        Of bodies that are integrated as one.
    wanted : iterable of (str, str)
        Methods of a solution, and the names that they are to be called with. What cannot be read is left out.

    Attributes
    ----------
    problem : DAEProblem
        The problem to integrate: with the places that are watched.
    readers : mapping
        Of (method, name) to what returns the method's result from `Steps`.

    Raises
    ------
    ModelError
        For a method that cannot be watched.
    """

    def __init__(
        self, system: System, problem: DAEProblem, members: Members | None, wanted: Iterable[tuple[str, str]]
    ) -> None:
        self.system, self.members = system, members
        self.places: list[int] = []
        self.idata, self.rdata = problem.idata.copy(), problem.rdata
        self.turns = members is not None and len(members.turn) > 0
        size = problem.work_size
        if self.turns:
            self.idata[-1] = size
            size += problem.n * (1 + 6 * int(self.idata[T.H_FORCES]))
        self.n, idata = problem.n, self.idata
        self._places = T.rows_in(idata, int(idata[T.H_I_AT]), int(idata[T.H_BODIES]), T.AT_COLUMNS)
        """Where the unknowns of the integrated bodies are."""
        self._rows = T.rows_in(idata, int(idata[T.H_I_ROW]), int(idata[T.H_ROWS]) + 1, T.ROW_COLUMNS)
        self._terms = T.rows_in(idata, int(idata[T.H_I_TERM]), int(idata[T.H_TERMS]), T.TERM_COLUMNS)
        self.readers: dict[tuple[str, str], Reader] = {}
        kinds = {
            "reaction_force": self._reaction_force,
            "orientation": self._orientation,
            "angular_velocity": self._angular_velocity,
            "diagnostics": self._diagnostics,
        }
        known = problem.index_one is None or not problem.index_one.any()
        for method, name in wanted if known else ():
            if method not in kinds:
                raise ModelError(f"watch: {method!r} cannot be watched; give one of {', '.join(kinds)}")
            reader = kinds[method](name)
            if reader is not None:
                self.readers[method, name] = reader
        if len(self.places) > MOST:
            self.readers, self.places = {}, []
        watched = np.array(self.places, dtype=np.int64)
        self.problem = problem
        if self.places:
            self.problem = replace(problem, idata=self.idata, work_size=size, watched=watched)

    def read(self, steps: Steps) -> Mapping[tuple[str, str], Any]:
        """Return the results of the methods at some steps."""
        return {key: reader(steps) for key, reader in self.readers.items()}

    def _columns(self, places: Iterable[int]) -> slice:
        """Watch some places; return their columns."""
        first = len(self.places)
        self.places += [int(place) for place in places]
        return slice(first, len(self.places))

    # --- diagnostics ----------------------------------------------------------------------------------

    def _diagnostics(self, name: str) -> Reader | None:
        """Return a reader of what a compiled element tells in each evaluation."""
        model = self.system.model
        if name not in model.names.forces:
            return None
        number = model.names.forces.index(name)
        diagnostics, row = model.diagnostics[number], T.forces_in(self.idata)[number]
        if not diagnostics or row[T.FORCE_KIND] != T.COMPILED:
            return None
        row[T.FORCE_WANT] = DIAGNOSTICS
        first = self._work_of(row) + 6 * row[T.FORCE_WRENCHES] + row[T.FORCE_STATES]
        columns = self._columns(range(first, first + len(diagnostics)))
        return lambda steps: dict(zip((d.name for d in diagnostics), steps.left[:, columns].T, strict=True))

    def _work_of(self, row: np.ndarray) -> int:
        """Return where in the work array an element's wrenches begin."""
        return int(self.idata[T.H_W_SCRATCH] + row[T.FORCE_WORK])

    # --- orientations ---------------------------------------------------------------------------------

    def _orientation(self, name: str) -> Reader | None:
        """Return a reader of a body's rotation matrices."""
        if name not in self.system.model.names.bodies:
            return None
        number = self.system.model.names.bodies.index(name)
        body, placed = self._moved_with(number)
        if body == 0:
            return lambda steps: np.tile(placed, (len(steps.y), 1, 1))
        if self.turns:
            return self._orientation_about_axis(number)
        row = self._places[body]
        if row[T.AT_ANGLES] != 3:
            return None
        first, place = int(row[T.AT_THETA]), int(self.idata[T.H_I_CODE]) + body
        alone = np.array_equal(placed, np.eye(3))

        def reader(steps: Steps) -> np.ndarray:
            places = np.array([first, steps.idata[place]], dtype=np.int64)
            found = _read(readers.EULER, steps, places, np.empty(0), 9).reshape(-1, 3, 3)
            return found if alone else found @ placed

        return reader

    def _moved_with(self, number: int) -> tuple[int, np.ndarray]:
        """Return the row of the integrated body that a body moves with, 0 if at rest, and its axes in that one's."""
        if self.members is None:
            return number + 1, np.eye(3)
        # kernels of runs with groups of bodies alone
        from gearmbs.dae.model.members import PLACE_A, PLACE_MASS

        return int(self.members.group[number]), self.members.place[number, PLACE_A:PLACE_MASS].reshape(3, 3)

    def _angular_velocity(self, name: str) -> Reader | None:
        """Return a reader of a body's angular velocity, global components."""
        if name not in self.system.model.names.bodies:
            return None
        number = self.system.model.names.bodies.index(name)
        body, _ = self._moved_with(number)
        if body == 0:
            return lambda steps: np.zeros((len(steps.y), 3))
        if self.turns:
            return self._angular_velocity_about_axis(body)
        row = self._places[body]
        if row[T.AT_ANGLES] != 3:
            return None
        angles, rates = int(row[T.AT_THETA]), int(row[T.AT_EPS])

        def reader(steps: Steps) -> np.ndarray:
            (psi, theta), (e1, e2, e3) = steps.y[:, angles : angles + 2].T, steps.y[:, rates : rates + 3].T
            c1, s1, across = np.cos(psi), np.sin(psi), np.sin(theta) * e3
            return np.stack([c1 * e2 + s1 * across, s1 * e2 - c1 * across, e1 + np.cos(theta) * e3]).T

        return reader

    def _angular_velocity_about_axis(self, group: int) -> Reader:
        """Return the same for a member of a group that turns about a fixed axis."""
        from gearmbs.dae.equations import fixed_axes as fx
        from gearmbs.dae.model.fixed_axes import axes_of

        axis, turn = (table[group - 1] for table in axes_of(self.idata, self.rdata))
        along = turn[fx.TURN_AXIS : fx.TURN_AXIS + 3].copy()
        if axis[fx.AXIS_PHI] >= 0:
            rate = int(axis[fx.AXIS_OMEGA])
            return lambda steps: steps.y[:, rate, None] * along
        value = int(self.idata[T.H_W_FUNCTION]) + T.FUNCTION_VALUES * int(axis[fx.AXIS_FUNCTION])
        driven, sense = self._columns([value + 1]).start, float(turn[fx.TURN_SENSE])
        return lambda steps: steps.left[:, driven, None] * (sense * along)

    def _orientation_about_axis(self, number: int) -> Reader:
        """Return the same for a member of a group that turns about a fixed axis: A = a + b cos(phi) + c sin(phi)."""
        from gearmbs.dae.equations import fixed_axes as fx
        from gearmbs.dae.model.fixed_axes import axes_of
        from gearmbs.dae.model.members import PLACE_A, PLACE_MASS

        members = self.members
        assert members is not None
        group = int(members.group[number])
        axis, turn = (table[group - 1] for table in axes_of(self.idata, self.rdata))
        place = members.place[number, PLACE_A:PLACE_MASS].reshape(3, 3)
        a, b, c = (part.reshape(3, 3) @ place for part in turn[fx.TURN_MATRIX : fx.TURN_MATRIX + 27].reshape(3, 9))
        if axis[fx.AXIS_PHI] >= 0:
            column, shift, sense = int(axis[fx.AXIS_PHI]), 0.0, 1.0
        else:
            value = int(self.idata[T.H_W_FUNCTION]) + T.FUNCTION_VALUES * int(axis[fx.AXIS_FUNCTION])
            column = self.n + self._columns([value]).start
            shift, sense = float(turn[fx.TURN_START]), float(turn[fx.TURN_SENSE])

        places = np.array([column], dtype=np.int64)
        numbers = np.concatenate([[sense, shift], a.ravel(), b.ravel(), c.ravel()])
        return lambda steps: _read(readers.ABOUT_AXIS, steps, places, numbers, 9).reshape(-1, 3, 3)

    # --- forces of joints -----------------------------------------------------------------------------

    def _reaction_force(self, joint: str) -> Reader | None:
        """Return a reader of the force of a joint on I's body."""
        rows = self.system.model.rows_of_joint.get(joint)
        if rows is None or self.turns:
            return None if rows is None else self._force_inside(rows)
        if self.members is not None or self.idata[T.H_FORMULATION] != SI2:
            return None
        table, term = self._rows, self._terms
        coefficients = self.rdata[int(self.idata[T.H_R_COEF]) :]
        parts = []
        for r in rows:
            for k in range(table[r, T.ROW_FIRST], table[r + 1, T.ROW_FIRST]):
                kind, i = term[k, T.TERM_TYPE], term[k, T.TERM_I]
                if kind in MOMENTS_ONLY and i == term[table[r, T.ROW_FIRST], T.TERM_I]:
                    continue
                if kind != terms.POINT or i != term[table[r, T.ROW_FIRST], T.TERM_I]:
                    return None
                parts.append((int(term[k, T.TERM_AXES]), int(self.idata[T.H_LAMBDA]) + r, -float(coefficients[k])))
            if table[r, T.ROW_TAPE] >= 0:
                return None

        places = np.array([part[:2] for part in parts], dtype=np.int64).ravel()
        numbers = np.array([factor for _, _, factor in parts])
        return lambda steps: _read(readers.SUM, steps, places, numbers, 3)

    def _force_inside(self, rows: list[int]) -> Reader | None:
        """Return the same for a fixed joint inside a group that turns about a fixed axis."""
        from gearmbs.dae.model import members as mb

        members = self.members
        assert members is not None
        edge = next((e for e in members.edge if e[mb.EDGE_ROWS] == rows[0]), None)
        if edge is None or len(rows) != 6:
            return None
        beyond = {int(edge[mb.EDGE_CHILD])}
        for other in members.edge[::-1]:
            if other[mb.EDGE_PARENT] in beyond:
                beyond.add(int(other[mb.EDGE_CHILD]))
        side = 1.0 if edge[mb.EDGE_CHILD_HAS_I] == 1 else -1.0
        group = int(members.group[edge[mb.EDGE_CHILD]])
        if group > 0 and {int(members.of_marker[m]) for m in members.turn[group - 1, [mb.TURN_I, mb.TURN_J]]} & beyond:
            # the joint that the group turns in exerts what is not known yet: the same from the other side
            beyond, side = set(np.flatnonzero(members.group == group).tolist()) - beyond, -side
        loads = self._loads_on(beyond)
        if loads is None or not self._are_balanced(beyond):
            return None
        weight = -sum(members.place[m, mb.PLACE_MASS] for m in beyond) * self.system.model.gravity

        places = np.array([columns for _, *columns in loads], dtype=np.int64).ravel()
        numbers = np.array([side, *weight, *(sign for sign, *_ in loads)])
        return lambda steps: _read(readers.INSIDE, steps, places, numbers, 3)

    def _are_balanced(self, beyond: set[int]) -> bool:
        """Whether the centre of mass of some members is on their axis, so that no turn moves it."""
        from gearmbs.dae.equations import fixed_axes as fx
        from gearmbs.dae.model.fixed_axes import axes_of
        from gearmbs.dae.model.members import PLACE_MASS

        members, pose = self.members, self.system.pose
        assert members is not None
        inside = sorted(beyond)
        group = int(members.group[inside[0]])
        if group == 0:
            return True
        turn = axes_of(self.idata, self.rdata)[1][group - 1]
        masses = members.place[inside, PLACE_MASS]
        arm = masses @ (pose[inside, POSE_R:POSE_A] - turn[fx.TURN_POINT : fx.TURN_POINT + 3])
        off = np.linalg.norm(np.cross(turn[fx.TURN_AXIS : fx.TURN_AXIS + 3], arm))
        return bool(off <= BALANCED * masses.sum())

    def _loads_on(self, beyond: set[int]) -> list[tuple[float, int, int, int]] | None:
        """Return the loads on some members: sign; the first columns of force, slopes and unknowns at y_m."""
        members, kept, n = self.members, int(self.idata[-1]), self.n
        assert members is not None
        found = []
        for f, row in enumerate(T.forces_in(self.idata)):
            on = [int(members.of_marker[row[column]]) in beyond for column in (T.FORCE_I, T.FORCE_J)]
            sign = float(on[0]) - float(on[1])
            if sign == 0.0 or row[T.FORCE_F] < 0:
                continue
            if row[T.FORCE_KIND] != T.COMPILED:
                return None
            wrench, slopes = self._work_of(row) + 6 * int(row[T.FORCE_PART]), kept + n + 6 * n * f
            found.append(
                (
                    sign,
                    self._columns(range(wrench, wrench + 3)).start,
                    self._columns(range(slopes, slopes + 3 * n)).start,
                    self._columns(range(kept, kept + n)).start,
                )
            )
        return found


def some_of(part: Solution, rows: np.ndarray) -> Solution:
    """Return some steps of a part that was read, by their numbers; what was read of the others is left out."""
    out = part.over(part.t[rows], part.result.y[rows], part.result.epochs)
    out.at_steps = {key: _rows_of(value, rows) for key, value in part.at_steps.items()}
    return out


def _rows_of(told: Any, rows: np.ndarray) -> Any:
    """Return what a reader has told, an array or arrays by name, of some steps."""
    return {name: values[rows] for name, values in told.items()} if isinstance(told, dict) else told[rows]


WATCHED_PART_SIZE = 8192
"""Steps of a part that is read instead of evaluated."""
AXIS_PART_SIZE = 1024
"""The same where nothing has to be prepared for a part, since all bodies turn about fixed axes."""


class Stream:
    """Consumer of an integrator's steps that hands them on as solutions.

    Parameters
    ----------
    system : System
    problem : DAEProblem
    t_end : float
        End of the run, s.
    consumer : callable
        Called as ``consumer(part)`` with a `Solution` of some accepted steps, in the order of time. It is valid until
        the next call: parts share their memory. Forces and accelerations are evaluated when first asked for.

    members : Members, optional
        Of bodies that are integrated as one.
    watch : Watch, optional
        Of ``problem``: what is read of the steps themselves, the same methods return then.

    Attributes
    ----------
    part_size : int
        About how many steps a part has.
    conflict : str or None
        The first violation found of a constraint row removed as redundant.
    """

    def __init__(
        self,
        system: System,
        problem: DAEProblem,
        t_end: float,
        consumer: Callable[[Solution], None],
        members: Members | None = None,
        watch: Watch | None = None,
    ) -> None:
        nothing = np.empty((0, problem.n))
        result = DAEResult(np.empty(0), nothing, nothing, Status.SUCCESS, "")
        self.whole = Solution(system, problem, result, members)
        self.part_size = PART_SIZE if members is None or not len(members.turn) else AXIS_PART_SIZE
        self.whole.share(2 * self.part_size)
        if watch is not None and watch.readers:
            self.part_size = WATCHED_PART_SIZE
        self.consumer = consumer
        self.watch = watch
        self.conflict: str | None = None
        self.interval = (t_end - problem.t0) / CONFLICT_SAMPLES
        self.next_look = problem.t0

    def __call__(self, t: np.ndarray, y: np.ndarray, idata: np.ndarray) -> None:
        """Hand on accepted steps, whose watched numbers stand behind the unknowns, and the table valid for them."""
        n = self.whole.problem.n
        # in equal parts: a small rest would cost as much beside its evaluation as a full part
        size = -(-t.size // max(1, round(t.size / self.part_size)))
        for k in range(0, t.size, size):
            rows = y[k : k + size]
            steps = Steps(rows[:, :n], rows[:, n:], idata)
            told = None if self.watch is None else self.watch.read(steps)
            part = self.whole.over(t[k : k + size], steps.y, [(0, idata)])
            if self.conflict is None and part.t[-1] >= self.next_look:
                self.next_look = float(part.t[-1]) + self.interval
                self.conflict = part.find_conflict(np.array([part.t.size - 1]))
            if told is not None:
                part.at_steps = told
            self.consumer(part)

    def close(self, solution: Solution) -> Solution:
        """Give what was found on the way to the solution that the run ended with, and return it."""
        solution.note_conflict(self.conflict)
        return solution
