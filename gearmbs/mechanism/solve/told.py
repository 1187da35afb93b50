"""What a simulation that is held between calls tells: of the present instant by name, and of all its points."""

from __future__ import annotations

import re
from bisect import bisect_right
from inspect import Signature, signature
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

import numpy as np

from gearmbs.dae.integrators.stepping.held_run import HeldRun, Rows
from gearmbs.dae.problem import DAEProblem, ModelError, cells_of
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results.solution import Solution
from gearmbs.dae.state import State
from gearmbs.mechanism.parts.bodies import OwnAttributes, markers_kept
from gearmbs.mechanism.parts.inputs import AXES as VECTORS
from gearmbs.mechanism.parts.inputs import WRENCHES, Output
from gearmbs.mechanism.solve.settings import Settings
from gearmbs.wording import any_of, did_you_mean

if TYPE_CHECKING:
    from gearmbs.dae.model.members import Members

AT_AN_INSTANT = (
    "com_position", "orientation", "com_velocity", "angular_velocity", "com_acceleration", "angular_acceleration",
    "reaction", "reaction_force", "load", "diagnostics", "contact", "modal_coordinates", "modal_velocities",
    "joint_displacement", "joint_rate", "marker_position", "marker_velocity", "deflection", "state", "multipliers",
    "kinetic_energy", "constraint_violation", "transmission_error", "unknown",
)  # fmt: skip
"""What `Solution` tells of one instant alone."""
COUNTED = ("joint_angle", "evaluate")
"""What it tells with full turns counted from the first point on."""
OF_PLANTS = ("marker_acceleration",)
"""What a plant alone tells of an output."""
PAIRED = ("reaction", "load")
"""What is a force and a torque,"""
VECTORIAL = (
    "com_position", "com_velocity", "com_acceleration", "angular_velocity", "angular_acceleration", "reaction_force",
    "marker_position", "marker_velocity", "marker_acceleration",
)  # fmt: skip
"""or one vector, of which an output may be a component."""
COUNTED_FUNCTION = re.compile(r"\bA[XYZ]\s*\(", re.IGNORECASE)
"""AX, AY and AZ of the function language."""


class Point(NamedTuple):
    """Where a simulation has stood: time, the row of what rows, and the table of integers."""

    t: float
    rows: Rows
    row: int
    idata: np.ndarray

    @property
    def y(self) -> np.ndarray:
        """Unknowns."""
        return self.rows.y[self.row]

    @property
    def yp(self) -> np.ndarray:
        """Their rates."""
        return self.rows.yp[self.row]


class Begun(NamedTuple):
    """What stands behind a simulation: its run, the present point, the model, its equations, what is set in them.

    Of bodies that are integrated as one ``members`` tells how those of the model follow.
    """

    run: HeldRun
    point: Point
    system: Any
    problem: DAEProblem
    cells: np.ndarray
    members: Members | None

    @property
    def by_axes(self) -> bool:
        """Whether angles about fixed axes alone are integrated."""
        return self.members is not None and len(self.members.turn) > 0


Number = Literal[
    "joint_displacement", "joint_rate", "state", "kinetic_energy", "constraint_violation", "transmission_error",
    "unknown", "joint_angle", "evaluate", "input",
]  # fmt: skip
"""Quantities that are one number at an instant,"""
Array = Literal[
    "com_position", "orientation", "com_velocity", "angular_velocity", "com_acceleration", "angular_acceleration",
    "reaction_force", "modal_coordinates", "modal_velocities", "marker_position", "marker_velocity", "multipliers",
]  # fmt: skip
"""an array,"""
Pair = Literal["reaction", "load", "deflection"]
"""two arrays,"""
Table = Literal["diagnostics", "contact"]
"""or numbers by name; for type checkers."""


class Told(OwnAttributes):
    """The part of a `gearmbs.Simulator` that looks at it."""

    t: float
    _mechanism: Any
    _system: Any
    _members: Any
    _problem: Any
    _remark: str
    _run: HeldRun
    _settings: Settings
    _row: Solution
    _at: tuple
    """The parts of the present point, of which `Point` would take as long as all the rest between two of them."""
    _present: Solution | None
    _points: list[tuple]
    _counted: dict[Any, tuple[tuple, Any]]
    _looked_at: set[str]
    """Meshes, see `gearmbs.mechanism.solve.measures.Measures`."""
    _jumped: list[float]
    _records: bool
    _failed: str | None
    _simulated: float
    _took: float
    _since: float
    _origin: State | None
    _given: np.ndarray

    @property
    def _point(self) -> Point:
        """Where the simulation stands."""
        return Point(*self._at)

    @overload
    def get(self, what: Number, *names: Any) -> float: ...
    @overload
    def get(self, what: Array, *names: Any) -> np.ndarray: ...
    @overload
    def get(self, what: Pair, *names: Any) -> tuple[np.ndarray, np.ndarray]: ...
    @overload
    def get(self, what: Table, *names: Any) -> dict[str, float]: ...
    # an output is what its mechanism says
    @overload
    def get(self, what: str, *names: Any) -> Any: ...

    def get(self, what: str, *names: Any) -> Any:
        """Return a quantity at the present time.

        Parameters
        ----------
        what : str
            A method or property of `Solution`: "com_position", "angular_velocity", "com_acceleration", "reaction",
            "load", "diagnostics", "marker_position", "joint_angle", "state", "evaluate" and others.
        *names
            What the method takes: the name of a body, joint, element, marker or state, or an expression. "joint_angle"
            and expressions with AX, AY or AZ count full turns from the first point on, which needs ``records``; what a
            state has counted goes on.

        Returns
        -------
        float, ndarray, tuple or dict
            What `Solution` returns, without the axis of time; a copy.

        Raises
        ------
        ModelError
            For a quantity that is not there, and for more names than it takes, or fewer.
        KeyError
            For a name that is not there; the message lists those that are.
        """
        try:
            return self._got(what, *names)
        except TypeError:
            measured = what == "transmission_error"
            _check_names(what, getattr(self._mechanism.measures(self._now()) if measured else self._now(), what), names)
            raise

    def _got(self, what: str, *names: Any) -> Any:
        if what == "input":
            return self._settings.value(self.t, *names)
        if what == "output":
            m = self._mechanism
            made = m.measures(self._now()).named_output(*names)
            with markers_kept((m.ground, *m.bodies.values())):
                try:
                    told = made.of(self._got(*made.asked))
                    return float(told) if isinstance(told, np.ndarray) and told.ndim == 0 else told
                except ModelError as error:
                    raise ModelError(f"output {made.name!r}: {error}") from None
                except KeyError as error:
                    raise KeyError(f"output {made.name!r}: {error.args[0]}") from None
        if what not in AT_AN_INSTANT + COUNTED:
            known = [*AT_AN_INSTANT, *COUNTED, "input", "output"]
            hint = did_you_mean(what, known)
            raise ModelError(f"get: there is no {what!r}{': ' + hint if hint else ''}; there are {', '.join(known)}")
        if what == "joint_angle":
            return self._joint_angle(*names)
        if what == "evaluate" and COUNTED_FUNCTION.search(str(names[:1])):
            return self._evaluated(*names)
        if what == "transmission_error":
            measures = self._mechanism.measures(self._now())
            measures.looked_at = self._looked_at
            return _last(measures.transmission_error(*names))
        found = getattr(self._now(), what)
        if names and not callable(found):
            _check_names(what, found, names)
        return _last(found(*names) if callable(found) else found)

    def _now(self) -> Solution:
        """Return the solution at the present time alone, valid until the next."""
        if self._present is None:
            point = self._point
            self._present = self._row.over(
                np.array([point.t]), point.y[None, :], [(0, point.idata)], self._held(point)[None, :]
            )
            # turns as the run counts them at every step
            shared = self._row._shared
            assert shared is not None
            shared.evaluator.rdata[:] = self._run.state.rdata
        return self._present

    def _joint_angle(self, joint: Any) -> float:
        """Return the angle of a joint, counted from the point on at which it was last asked for."""
        self._check_records("joint_angle")
        after, value = self._counted.get(joint, (None, None))
        path = self._path(after)
        angle = self._over(path).joint_angle(joint)
        last = float(angle[-1] if value is None else value + (angle[-1] - angle[0]))
        self._counted[joint] = path[-1], last
        return last

    def _evaluated(self, text: str) -> float:
        """Return an expression whose angles are counted from the point on at which it was last asked for."""
        self._check_records("evaluate")
        after, starts = self._counted.get(("evaluate", text), (None, None))
        path = self._path(after)
        values, ends = self._mechanism.measures(self._over(path)).counted_expression(text, starts)
        self._counted["evaluate", text] = path[-1], ends
        return float(values[-1])

    def _held(self, point: Point) -> np.ndarray:
        """Return what named numbers were up to a point."""
        return point.rows.kept[point.row, self._run.turns :]

    def _path(self, after: tuple | None) -> list[tuple]:
        """Return the points kept behind an earlier one, and the present one, which need not be among them.

        Sample times of controllers are none, nor are points that are not to be recorded: their values are copied, since
        the next one is written over them.
        """
        points, point = self._points, self._point
        path = points[:] if after is None else [after, *points[bisect_right(points, after[0], key=itemgetter(0)) :]]
        if not path or path[-1][0] != point.t:
            rows, row = point.rows, point.row
            own = Rows(*(column[row : row + 1].copy() for column in rows))
            path.append((point.t, own, 0, point.idata))
        return path

    @property
    def unknowns(self) -> list[str]:
        """Names of the unknowns of the equations, for ``get("unknown", name)``."""
        return list(self._problem.names)

    @property
    def failed(self) -> bool:
        """Whether the integration has failed."""
        return self._failed is not None

    @property
    def real_time_factor(self) -> float:
        """Seconds simulated in a second of the clock, in all calls of :meth:`advance`; 0 before the first."""
        self._tell_clock()
        return self._simulated / self._took if self._took > 0.0 else 0.0

    def _tell_clock(self) -> None:
        """Count the time simulated since it was last told, or the run began."""
        own = self.__dict__
        own["_simulated"] += self.t - self._since
        own["_since"] = own["t"]

    def solution(self, first: int = 0) -> Solution:
        """Return the motion and forces over all points so far, from the start on or from the one with a number.

        Raises
        ------
        ModelError
            If no records are kept.
        """
        self._check_records("solution")
        return self._over(self._points[first:])

    def _places_given(self) -> np.ndarray:
        """Return the places of numbers that have been set, here or in the state that it goes on from."""
        own, numbers, new = self.__dict__, self._settings.numbers, self._settings.given
        if new:
            places = [cells_of({name: numbers[name]}) for name in new]
            own["_given"] = np.unique(np.concatenate([self._given, *places]))
            new.clear()
        return own["_given"]

    def _check_records(self, what: str) -> None:
        if not self._records:
            raise ModelError(f"{what}: it needs the points so far; make the simulator with records=True")

    def _over(self, points: list[tuple]) -> Solution:
        """Return the solution over some points."""
        t, rows, places, tables = zip(*points, strict=True)
        y, yp, kept = (
            np.array([getattr(r, name)[k] for r, k in zip(rows, places, strict=True)]) for name in ("y", "yp", "kept")
        )
        turns = self._run.turns
        epochs: list[tuple[int, np.ndarray]] = []
        for row, table in enumerate(tables):
            if not epochs or not (table is epochs[-1][1] or np.array_equal(table, epochs[-1][1])):
                epochs.append((row, table))
        stats, cells = self._run._stats(), self._settings.cells
        told = Status.SUCCESS if self._failed is None else Status.SOLVER_FAILURE
        result = DAEResult(
            np.array(t), y, yp, told, self._failed or f"Advanced to t = {self.t:.9g} s.", stats,
            epochs=epochs, t_last=self.t, held=(cells, kept[:, turns:]) if cells.size else None,
            counted=kept[:, :turns],
        )  # fmt: skip
        solution = Solution(self._system, self._problem, result, self._members, self._remark)
        solution.initial, solution.given = self._origin, self._places_given()
        solution.inside, solution.jumped = self._row.inside, frozenset(self._jumped)
        return solution


def check_told(output: Output) -> None:
    """Raise a ModelError if an output is something that nobody tells."""
    what, known = output.asked[0], [*AT_AN_INSTANT, *COUNTED, *OF_PLANTS]
    if what.startswith("_") or not (what in known or hasattr(Solution, what)):
        hint = did_you_mean(what, known, shown=repr, otherwise=f"there are {', '.join(known)}")
        raise ModelError(f"output {output.name!r}: nothing is called {what!r}; {hint}")
    method = getattr(Solution, what, None)
    names = list(signature(method).parameters)[1:] if callable(method) else ["marker"] if what in OF_PLANTS else []
    given, component = list(output.asked[1:]), output.component
    if len(given) < len(names):
        raise ModelError(f"output {output.name!r}: {what!r} is of one {names[0]}; name it")
    parts: tuple[str, ...] = ()
    if names:
        parts = WRENCHES if what in PAIRED else VECTORS if what in VECTORIAL else ()
    wrong = given[-1] if len(given) > len(names) else component if component not in (None, *parts) else None
    if wrong is not None:
        remedy = f"choose {any_of(map(repr, parts))}" if parts else "leave it out"
        raise ModelError(f"output {output.name!r}: {what!r} has no component {wrong!r}; {remedy}")


def _check_names(what: str, found: Any, names: tuple[Any, ...]) -> None:
    """Raise a ModelError if what a quantity was found to be takes more or fewer names."""
    takes = signature(found) if callable(found) else Signature()
    try:
        takes.bind(*names)
    except TypeError:
        known, given = ", ".join(takes.parameters), ", ".join(map(repr, names))
        raise ModelError(f"get: {what!r} takes {known or 'no name'}; got {given or 'none'}") from None


def _last(value: Any) -> Any:
    """Return the last row of what a solution tells over time, as a copy."""
    if isinstance(value, tuple):
        return tuple(_last(part) for part in value)
    if isinstance(value, dict):
        return {name: _last(part) for name, part in value.items()}
    row = np.array(value[-1])
    return float(row) if row.ndim == 0 else row
