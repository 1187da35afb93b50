"""A mechanism that is simulated in steps of its user: to a time, a look at it, on to the next."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from operator import itemgetter
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from gearmbs._lazy import uncollected
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.stepping.held_run import HeldRun, Rows
from gearmbs.dae.methods import DEFAULT, INTEGRATORS, those_that
from gearmbs.dae.problem import ModelError, Number
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results.solution import CONFLICT_SAMPLES, Solution
from gearmbs.dae.state import State, equations_of
from gearmbs.mechanism.language.user_functions import raised_errors
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.bodies import OwnAttributes
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.controllers import Control
from gearmbs.mechanism.solve.settings import Settings
from gearmbs.mechanism.solve.simulate import (
    ADVICE,
    checked,
    just_inside,
    prepared,
    start_time,
    starting_options,
    with_brief_changes,
)
from gearmbs.wording import any_of, did_you_mean

AT_AN_INSTANT = (
    "com_position", "orientation", "com_velocity", "angular_velocity", "com_acceleration", "angular_acceleration",
    "reaction", "reaction_force", "load", "diagnostics", "contact", "modal_coordinates", "modal_velocities",
    "joint_displacement", "marker_position", "marker_velocity", "deflection", "state", "multipliers", "kinetic_energy",
    "constraint_violation", "transmission_error",
)  # fmt: skip
"""What `Solution` tells of one instant alone."""
COUNTED = ("joint_angle", "evaluate")
"""What it tells with full turns counted from the first point on."""
COUNTED_FUNCTION = re.compile(r"\bA[XYZ]\s*\(", re.IGNORECASE)
"""AX, AY and AZ of the function language."""
NOTHING = nullcontext()
"""What errors of functions are looked for in where there are none."""
new_point = tuple.__new__
"""Makes a point of its parts in half the time that its class takes."""
REFUSED = ("dense_output", "consumer", "slopes", "event_direction", "event_action", "event_count", "history")
"""Options of integrators that are about outputs and events of a run that is told its end."""


class Point(NamedTuple):
    """Where a simulation has stood: time, the row of what rows, the table of integers, and what named numbers were."""

    t: float
    rows: Rows
    row: int
    idata: np.ndarray
    held: np.ndarray

    @property
    def y(self) -> np.ndarray:
        """Unknowns."""
        return self.rows.y[self.row]

    @property
    def yp(self) -> np.ndarray:
        """Their rates."""
        return self.rows.yp[self.row]


class Simulator(OwnAttributes):
    """A simulation that goes from one communication point to the next.

    The run behind it is that of `gearmbs.mechanism.simulate` with the same arguments: its steps pass the points, where
    values are interpolated, so that they are those of one run with these points as ``t_eval``, bit for bit.

    Parameters
    ----------
    mechanism : Mechanism
        The model; it is not changed.
    t_end : float
        Latest time that can be asked for, s. First and smallest steps depend on it as in `simulate`.
    t_start : float
        Start, s.
    integrator : str
        One that can be held between calls: "WSTIFF" or "GSTIFF".
    formulation, tol, rate_scale, lump
        As of `simulate`.
    initial : State, optional
        Start from this state, at its time.
    advice : mapping, optional
        As of `simulate`.
    records : bool
        Whether all points are kept for :meth:`solution`.
    **options
        Handed to the integrator.

    Attributes
    ----------
    t : float
        Present time, s.
    t_end : float
    numbers : mapping of str to Number
        Inputs and parameters that :meth:`set` changes: unit, places in the tables, what they prescribe.

    Raises
    ------
    ModelError
        As `simulate` does.

    Examples
    --------
    >>> import gearmbs as gm
    >>> m = gm.Mechanism("pendulum", gravity=(0, 0, -9.81))
    >>> rod = m.body("rod", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(0.5, 0, 0))
    >>> pin = m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    >>> sim = gm.Simulator(m, t_end=1.0)
    >>> sim.advance(0.1)
    >>> round(float(sim.get("com_position", "rod")[2]), 4)
    -0.0471
    """

    t: float
    _point: Point
    _present: Solution | None

    def __init__(
        self,
        mechanism: Mechanism,
        t_end: float,
        *,
        t_start: float = 0.0,
        integrator: str = DEFAULT,
        formulation: str = "SI2",
        tol: float | None = None,
        rate_scale: float | None = None,
        lump: bool | None = None,
        initial: State | None = None,
        records: bool = True,
        advice: Mapping[Status, str] | None = None,
        **options: Any,
    ) -> None:
        t_start = start_time(quantity(t_start, "time", "t_start"), initial)
        self.t_end = quantity(t_end, "time", "t_end")
        if not (np.isfinite(self.t_end) and self.t_end > t_start):
            raise ModelError(f"t_end = {self.t_end} s; it must be later than the start {t_start} s")
        tol, rate_scale = chosen_accuracy(mechanism, (t_start, self.t_end), tol, rate_scale)
        name = checked(integrator, tol, options)
        if not INTEGRATORS[name].compiled:
            raise ModelError(f"integrator: {name} cannot be held between calls; take {any_of(those_that('history'))}")
        for option in REFUSED:
            if option in options:
                raise ModelError(f"Simulator has no option {option!r}; simulate() and initial= have what it is for")
        INTEGRATORS[name].load()
        lump = mechanism.lump if lump is None else lump
        t_model = t_start if initial is None else initial.t_model
        self._system, self._base, self._members, self._remark = prepared(
            mechanism, t_model, lump, formulation, rate_scale, initial is not None
        )
        self._base.advice = {**ADVICE, **(advice or {})}
        options |= with_brief_changes(self._system, t_model, self.t_end, options)
        self._functions = list(mechanism.functions.values())
        self._mechanism = mechanism
        self._controls: list[Control] = []
        self._options = Options.gather(name, None, {"corrector": "modified", "tol": tol, **options})
        self._records = records
        self._equations = ""
        """Digest of the model as assembled, which takes longer than the rest of a state; made with the first."""
        self.numbers = self._base.numbers
        parts = {**mechanism.bodies, **mechanism.elements}
        self._settings = Settings(self.numbers, mechanism.aliases, parts)
        self._simulated, self._took, self._since = 0.0, 0.0, 0.0
        vars(self)["t"] = 0.0
        self._begin(initial)
        self._t_start = self.t

    def _begin(self, state: State | None, repair: bool = False) -> None:
        """Make a run that starts in a state, by default in that which the model was assembled in.

        With ``repair`` velocities that a motion prescribes jump to it at once, and others with them, as at an impact
        without rebound.
        """
        self._tell_clock()
        problem, options = self._base, self._options
        if state is not None:
            given = starting_options(options.method, state.history_for(problem, options.method))
            problem, options = state.problem(problem), replace(options, **given)
        self._problem, self._origin = problem, state
        with uncollected():
            self._run = HeldRun(problem, self.t_end, replace(options, check_start=not repair))
        nothing = np.empty((0, problem.n))
        cells = self._settings.cells
        held = (cells, np.empty((0, cells.size)))
        empty = DAEResult(np.empty(0), nothing, nothing, Status.SUCCESS, "", held=held)
        # lines end where a state is
        self._settings.begin(problem.rdata, float(problem.t0))
        self._row = Solution(self._system, problem, empty, self._members)
        self._row.inside = just_inside(np.array([problem.t0, self.t_end]))
        self._row.share(1)
        self._next_look = problem.t0 if self._system.has_dropped_rows else np.inf
        self._points: list[Point] = []
        self._counted: dict[tuple, tuple[int, float]] = {}
        self._failed: str | None = None
        place = self._run.place(problem.y0, problem.yp0)
        self._stand_at(Point(float(problem.t0), *place, problem.idata, self._settings.held), self._records)
        self._since = self.t

    def _stand_at(self, point: Point, record: bool) -> None:
        # past the look at names that are assigned, which takes as long as all the rest
        own = self.__dict__
        own["t"], own["_point"], own["_present"] = point[0], point, None
        if record:
            own["_points"].append(point)

    # --- going on -----------------------------------------------------------------------------------

    def advance(self, t: float, *, record: bool = True) -> None:
        """Go on to time ``t``, s; with ``record`` it becomes a point of the :meth:`solution`.

        Raises
        ------
        ModelError
            For a time that is no number, that lies behind or after the end, and where the integration fails: the
            simulator then stands where it stood, and can only be restored to an earlier state.
        """
        if not (type(t) is float and self.t <= t <= self.t_end and self._failed is None):
            t = float(self._time(t))
        settings = self._settings
        while self.t < t:
            end = self._sample(t) if self._controls else t
            if settings.waiting or settings.led:
                self._apply(t)
            self._go_to(end, record and end == t)

    def _time(self, t: Any) -> float:
        """Return a time to go on to, s; raise a ModelError for any other."""
        t = quantity(t, "time", "t")
        if self._failed is not None:
            raise ModelError(f"the simulation has failed: {self._failed} Go back with restore(state)")
        if not np.isfinite(t):
            raise ModelError(f"t = {t} s; advance takes a finite time")
        if t < self.t:
            raise ModelError(f"t = {t:.9g} s lies before the present time {self.t:.9g} s; go back with restore(state)")
        if t > self.t_end:
            raise ModelError(
                f"t = {t:.9g} s lies after t_end = {self.t_end:.9g} s; make the simulator with a later t_end"
            )
        return t

    def _go_to(self, t: float, record: bool) -> None:
        """Go on to a time with what is set, and keep it as a point of the solution."""
        own = self.__dict__
        run, keep, began = own["_run"], record and own["_records"], perf_counter()
        rows, row = run.rows, run.row
        if own["_functions"]:
            with raised_errors(self._functions):
                failure = run.go_to(t, keep)
        else:
            failure = run.go_to(t, keep)
        own["_took"] += perf_counter() - began
        if failure is not None:
            if failure[0] is Status.INTERRUPTED:
                raise KeyboardInterrupt
            self._failed = failure[1]
            raise ModelError(failure[1])
        self._stand_at(new_point(Point, (t, rows, row, run.table, own["_settings"].held)), keep)
        if t >= self._next_look:
            self._next_look = t + (self.t_end - self._problem.t0) / CONFLICT_SAMPLES
            found = self._now().find_conflict(np.array([0]))
            if found is not None:
                self._failed = found
                raise ModelError(found)

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
        self._simulated += self.t - self._since
        self._since = self.t

    # --- acting on it ---------------------------------------------------------------------------------

    def set(self, name: str, value: Any, hold: int = 0) -> None:
        """Give an input or a parameter another value, from the present time on.

        Values up to the present time stay as they were returned. The step that has gone past it is cut back to it.

        Parameters
        ----------
        name : str
            See ``numbers`` of the simulator.
        value : float or str
            SI or text with a unit.
        hold : {0, 1}
            0: it jumps to the value and stays there. 1: it goes there from its present value, evenly until the time of
            the :meth:`advance` that follows, and stays there.

        Raises
        ------
        ModelError
            For a name that is not there, a value that is no number in its unit, and an input that would let a body
            jump: the position of a motion with ``hold=0``.
        """
        self._settings.set(name, value, hold)

    def take_effect(self) -> None:
        """Let values that have been set take effect now, and not with the next :meth:`advance`.

        Raises
        ------
        ModelError
            For a value that an input is led to: its way begins with the next advance.
        """
        led = self._settings.on_the_way(self.t)
        if led is not None:
            raise ModelError(f"state: {led!r} is on its way to a value; take the state before set, or after advance")
        if self._settings.waiting:
            self._apply(self.t)

    def number(self, name: str) -> Number:
        """Return what :meth:`set` changes under a name; raise a ModelError if there is nothing."""
        return self._settings.number(name)

    def control(self, name: str, function: Callable[[float, Simulator], Any], sample_time: float) -> None:
        """Let a function give an input its value at sample times, which is held in between.

        Parameters
        ----------
        name : str
            An input or a parameter.
        function : callable
            ``function(t, simulator)`` returns the value. It is called at the present time and a sample time after the
            other, where the simulation then stands: :meth:`get` tells of that instant. With methods ``state()``, which
            returns numbers, and ``restore(numbers)``, which takes them as an array, what it remembers is in states of
            the simulator; else it is its own.
        sample_time : float
            s.

        Raises
        ------
        ModelError
            For a name that is not there or has a controller, and a sample time that is not positive.
        """
        self.number(name)
        if not callable(function):
            raise ModelError(f"control: {function!r} for {name!r} cannot be called; give a function of t and simulator")
        if name in (control.name for control in self._controls):
            raise ModelError(f"control: {name!r} has a controller already; let one function do what both are to")
        period = quantity(sample_time, "time", "control: sample_time")
        if not (np.isfinite(period) and period > 0.0):
            raise ModelError(f"control: sample_time = {period} s for {name!r}; it must be positive")
        made = Control(name, function, self.t, period)
        if self._origin is not None and self._origin.t == self.t and name in self._origin.controllers:
            made.go_back(self.t, self._origin.controllers[name])
        self._controls.append(made)

    def _sample(self, t: float) -> float:
        """Call the controllers whose sample time has come; return the next one of any, or ``t`` if that is earlier."""
        for control in self._controls:
            if control.next <= self.t:
                self.set(control.name, control.function(self.t, self))
                control.count += 1
        return min([t, *(control.next for control in self._controls)])

    def _apply(self, end: float) -> None:
        """Let what has been set take effect at the present time; lines that were set end at ``end``."""
        change = self._settings.take(self.t, end)
        if change is None:
            return
        if change.prescribes or not self._run.state.steps:
            self._start_with(change.values)
            return
        began = perf_counter()
        with raised_errors(self._functions) if self._functions else NOTHING:
            self._run.change(self._point[:3], self._settings.cells, *change[:4])
        self._took += perf_counter() - began

    def _start_with(self, values: np.ndarray) -> None:
        """Start afresh at the present time with other numbers; velocities that they prescribe jump there."""
        point, led = self._point, self._settings.led
        rdata = self._run.state.rdata.copy()
        rdata[self._settings.cells] = values
        first, points, started = (self._problem, self._origin), self._points, self._run.started
        self._begin(State.of(self._base, point.t, point.y, point.yp, (point.idata, rdata)), repair=True)
        self._settings.led = led
        if started:
            self._problem, self._origin = first
            self._points = points
            self._point = point

    # --- looking at it ------------------------------------------------------------------------------

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
            For a quantity that is not there.
        KeyError
            For a name that is not there; the message lists those that are.
        """
        if what == "input":
            return self._settings.value(self.t, *names)
        if what == "output":
            made = self._mechanism.measures(self._now()).named_output(*names)
            return made.of(self.get(*made.asked))
        if what not in AT_AN_INSTANT + COUNTED:
            known = [*AT_AN_INSTANT, *COUNTED, "input", "output"]
            hint = did_you_mean(what, known)
            raise ModelError(f"get: there is no {what!r}{': ' + hint if hint else ''}; there are {', '.join(known)}")
        if what == "joint_angle":
            return self._joint_angle(*names)
        if what == "evaluate" and COUNTED_FUNCTION.search(str(names[:1])):
            return float(self.solution().evaluate(*names)[-1])
        if what == "transmission_error":
            return _last(self._mechanism.measures(self._now()).transmission_error(*names))
        found = getattr(self._now(), what)
        return _last(found(*names) if callable(found) else found)

    def _now(self) -> Solution:
        """Return the solution at the present time alone, valid until the next."""
        if self._present is None:
            point = self._point
            self._present = self._row.over(
                np.array([point.t]), point.y[None, :], [(0, point.idata)], point.held[None, :]
            )
            # turns as the run counts them at every step
            evaluator: Any = self._row._shared
            evaluator[0].rdata[:] = self._run.state.rdata
        return self._present

    def _joint_angle(self, joint: Any) -> float:
        """Return the angle of a joint, counted from the point on at which it was last asked for."""
        self._check_records("joint_angle")
        first, value = self._counted.get(joint, (0, None))
        angle = self._over(first).joint_angle(joint)
        last = float(angle[-1] if value is None else value + (angle[-1] - angle[0]))
        self._counted[joint] = len(self._points) - 1, last
        return last

    def solution(self) -> Solution:
        """Return the motion and forces over all points so far, from the start on.

        Raises
        ------
        ModelError
            If no records are kept.
        """
        self._check_records("solution")
        return self._over(0)

    def _check_records(self, what: str) -> None:
        if not self._records:
            raise ModelError(f"{what}: it needs the points so far; make the simulator with records=True")

    def _over(self, first: int) -> Solution:
        """Return the solution over the points from one on."""
        points = self._points[first:]
        t, rows, places, tables, held = zip(*points, strict=True)
        y, yp, counted = (
            np.array([getattr(r, name)[k] for r, k in zip(rows, places, strict=True)]) for name in ("y", "yp", "kept")
        )
        epochs: list[tuple[int, np.ndarray]] = []
        for row, table in enumerate(tables):
            if not epochs or not (table is epochs[-1][1] or np.array_equal(table, epochs[-1][1])):
                epochs.append((row, table))
        stats, cells = self._run._stats(), self._settings.cells
        told = Status.SUCCESS if self._failed is None else Status.SOLVER_FAILURE
        result = DAEResult(
            np.array(t), y, yp, told, self._failed or f"Advanced to t = {self.t:.9g} s.", stats,
            epochs=epochs, t_last=self.t, held=(cells, np.array(held)) if cells.size else None,
            counted=counted,
        )  # fmt: skip
        solution = Solution(self._system, self._problem, result, self._members, self._remark)
        solution.initial = self._origin
        solution.inside = just_inside(np.array([self._problem.t0, self.t_end]))
        return solution

    # --- state --------------------------------------------------------------------------------------

    def state(self) -> State:
        """Return the present state with the integrator's history: what follows from it is the same, bit for bit."""
        if self._failed is not None:
            raise ModelError(f"the simulation has failed: {self._failed} Go back with restore(state)")
        self.take_effect()
        point, run = self._point, self._run
        if not self._equations:
            self._equations = equations_of(self._base)
        history = run.history(self._equations) if run.started else None
        state = State.of(self._base, point.t, point.y, point.yp, (point.idata, run.state.rdata), history)
        held = {control.name: control.memory() for control in self._controls if control.remembers}
        return replace(state, controllers=held) if held else state

    def restore(self, state: State) -> None:
        """Go back, or on, to a state of the same mechanism.

        Of the points those before it are kept if it is one of them, as a state of this simulator is, else none.

        Raises
        ------
        ModelError
            If the state is one of another model, or lies outside the span of this simulator.
        """
        if not self._t_start <= state.t < self.t_end:
            remedy = "pass it as initial=" if state.t < self._t_start else "make it with a later t_end"
            raise ModelError(
                f"state: it is at t = {state.t:.9g} s, the simulator goes from {self._t_start:.9g} to "
                f"{self.t_end:.9g} s; {remedy}"
            )
        if state.t_model != self._base.t0:
            raise ModelError(
                f"state: its model was assembled for t = {state.t_model:g} s, this one for {self._base.t0:g} s; "
                "start both simulators at the same time"
            )
        first, origin = self._own_point(state), (self._problem, self._origin)
        if (first is not None or not self._records) and self._go_back(state):
            if first is not None:
                del self._points[first + 1 :]
        else:
            kept = self._points[: first + 1] if first is not None else []
            self._begin(state)
            if kept:
                # what stood there up to the state, which a jump may follow
                self._problem, self._origin = origin
                self._points[:] = kept
        for control in self._controls:
            control.go_back(self.t, state.controllers.get(control.name))

    def _own_point(self, state: State) -> int | None:
        """Return which of the points a state is, or None."""
        at = bisect_left(self._points, state.t, key=itemgetter(0))
        while at < len(self._points) and self._points[at][0] == state.t:
            if np.array_equal(self._points[at].y, state.y):
                return at
            at += 1
        return None

    def _go_back(self, state: State) -> bool:
        """Go to a state of the present run in place, as a new run from it would; return whether it is one of it."""
        history = state.history
        if history is None or history.equations != self._equations or not self._run.go_back(history):
            return False
        self._tell_clock()
        self._failed, self._counted, self._since = None, {}, state.t
        self._next_look = state.t if self._system.has_dropped_rows else np.inf
        self._settings.begin(self._run.state.rdata, state.t)
        place = self._run.place(state.y, state.yp, keep=False)
        self._stand_at(Point(state.t, *place, state.tables(self._base)[0], self._settings.held), False)
        return True

    def __repr__(self) -> str:
        name = self._system.mechanism.name if self._system.mechanism is not None else "mechanism"
        return f"Simulator({name!r}: t = {self.t:.9g} of {self.t_end:.9g} s, {len(self._points)} points)"


def _last(value: Any) -> Any:
    """Return the last row of what a solution tells over time, as a copy."""
    if isinstance(value, tuple):
        return tuple(_last(part) for part in value)
    if isinstance(value, dict):
        return {name: _last(part) for name, part in value.items()}
    row = np.array(value[-1])
    return float(row) if row.ndim == 0 else row
