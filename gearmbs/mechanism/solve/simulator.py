"""A mechanism that is simulated in steps of its user: to a time, a look at it, on to the next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from time import perf_counter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from gearmbs._lazy import Guessed, uncollected
from gearmbs.dae.equations import layout as T
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.stepping.held_run import HeldRun
from gearmbs.dae.methods import DEFAULT, INTEGRATORS, those_that
from gearmbs.dae.model.system import settle_states
from gearmbs.dae.problem import ModelError, Number
from gearmbs.dae.result import DAEResult, Status
from gearmbs.dae.results.solution import CONFLICT_SAMPLES, Solution
from gearmbs.dae.state import State
from gearmbs.mechanism.checks import check_mechanism
from gearmbs.mechanism.language.user_functions import raised_errors
from gearmbs.mechanism.mechanism import Mechanism
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.mechanism.solve.accuracy import chosen_accuracy
from gearmbs.mechanism.solve.controllers import RESOLVED, Control, Sampled, warn_of_unmet
from gearmbs.mechanism.solve.restored import Restored
from gearmbs.mechanism.solve.settings import Settings
from gearmbs.mechanism.solve.simulate import (
    ADVICE,
    StopAt,
    check_stops,
    checked,
    just_inside,
    prepared,
    start_time,
    starting_options,
    with_brief_changes,
    with_stops,
)
from gearmbs.mechanism.solve.told import Begun, Point
from gearmbs.units import QuantityLike
from gearmbs.wording import any_of

if TYPE_CHECKING:
    from gearmbs.mechanism.solve.keywords import IntegratorOptions

NOTHING = nullcontext()
"""Null context, used when the mechanism has no functions of Python."""
OWN = {
    "Simulator": ("t_start", "integrator", "formulation", "tol", "rate_scale", "lump", "initial", "records", "stops"),
}
"""Its name, and its settings beside the options of integrators."""
REFUSED = ("dense_output", "consumer", "slopes", "event_direction", "event_action", "event_count", "history")
"""Options of integrators that are about outputs and events of a run that is told its end."""


class Simulator(Sampled, Restored, Guessed):
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
    stops : sequence of StopAt
        :meth:`advance` ends early where a state of the mechanism passes a value, and returns which; steps are those
        without it. Where what is set lets it jump past the value, that is the time at which it is set. Not with
        ``lump``.
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

    settled = ("t", "t_end", "numbers")

    def __init__(
        self,
        mechanism: Mechanism,
        t_end: QuantityLike,
        *,
        t_start: QuantityLike = 0.0,
        integrator: str = DEFAULT,
        formulation: str = "SI2",
        tol: float | None = None,
        rate_scale: float | None = None,
        lump: bool | None = None,
        initial: State | None = None,
        records: bool = True,
        stops: Sequence[StopAt] = (),
        advice: Mapping[Status, str] | None = None,
        **options: Unpack[IntegratorOptions],
    ) -> None:
        settings: dict[str, Any] = {**options}
        check_mechanism(mechanism)
        for what, given in (("lump", lump), ("records", records)):
            if not isinstance(given, bool | np.bool_ | None):
                raise ModelError(f"{what} = {given!r}; give True or False")
        t_start = start_time(quantity(t_start, "time", "t_start"), initial)
        self.t_end = quantity(t_end, "time", "t_end")
        if not (np.isfinite(self.t_end) and self.t_end > t_start):
            raise ModelError(f"t_end = {self.t_end} s; it must be later than the start {t_start} s")
        tol, rate_scale = chosen_accuracy(mechanism, (t_start, self.t_end), tol, rate_scale)
        name = checked(integrator, tol, settings, OWN)
        if not INTEGRATORS[name].compiled:
            raise ModelError(f"integrator: {name} cannot be held between calls; take {any_of(those_that('history'))}")
        for option in REFUSED:
            if option in settings:
                raise ModelError(f"Simulator has no option {option!r}; simulate() and initial= have what it is for")
        INTEGRATORS[name].load()
        check_stops(stops)
        lump = mechanism.lump and not stops if lump is None else lump
        if stops and lump:
            raise ModelError("stops: they need all bodies; give lump=False")
        self._stops = list(stops)
        t_model = t_start if initial is None else initial.t_model
        self._system, self._base, self._members, self._remark = prepared(
            mechanism, t_model, lump, formulation, rate_scale, initial is not None
        )
        self._base = self._base.with_fixed_pivots(settings.get("fixed_pivots", False))
        self._base.advice = {**ADVICE, **(advice or {})}
        settings |= with_brief_changes(self._system, t_model, self.t_end, settings)
        self._functions = list(mechanism.functions.values())
        self._mechanism = mechanism
        self._controls: list[Control] = []
        self._inside = ""
        """Whose controller has been called and has not returned, or that a function in the equations has."""
        self._unmet: list[str] = []
        """Inputs whose controllers are in the state gone on from, and have not been given."""
        if stops:
            first = int(self._base.idata[T.H_Z])
            self._watched = partial(with_stops, names=mechanism.state_names, first=first, stops=stops)
            self._watched(self._base)
            settings["event_direction"] = [stop.direction for stop in stops]
        self._options = Options.gather(name, None, {"corrector": "modified", "tol": tol, **settings})
        self._records = records
        self._integers: tuple[Any, Any] = None, None
        """A table of integers, and what differs in it from that of the model, of the last state."""
        self._before: dict[bytes, bytes] = {}
        """Unknowns before jumps of velocities, by those behind them, of which states have been made."""
        self._equations = ""
        """Digest of the model as assembled, which takes longer than the rest of a state; made with the first."""
        self._of_model = {
            "names": tuple(self._base.names),
            "t_model": float(self._base.t0),
            "sizes": (len(self._base.idata), len(self._base.rdata)),
        }
        """Of its states."""
        numbers, aliases = self._base.numbers, self._base.aliases
        self.numbers = MappingProxyType({**numbers} | {alias: numbers[name] for alias, name in aliases.items()})
        self._settings = Settings(numbers, aliases, {**mechanism.bodies, **mechanism.elements})
        self._simulated, self._took, self._since = 0.0, 0.0, 0.0
        self._jumped: list[float] = []
        """Times at which velocities have jumped with what motions prescribe."""
        self._looked_at: set[str] = set()
        vars(self)["t"] = 0.0
        self._given = np.empty(0, dtype=np.int64)
        self._begin(initial)
        self._t_start = self.t
        if initial is not None:
            self._take_counts(initial)
            self._take_given(initial)
            self._unmet = list(initial.controllers)

    def _begin(self, state: State | None, repair: bool = False) -> None:
        """Make a run that starts in a state, by default in that which the model was assembled in.

        With ``repair`` velocities that a motion prescribes jump to it at once, and others with them, as at an impact
        without rebound.
        """
        self._tell_clock()
        problem, options = self._base, self._options
        if state is not None:
            history = state.history_for(problem, options.method, options.tol)
            problem = state.problem(problem, history)
            options = replace(options, **starting_options(options.method, history))
        if self._stops:
            problem = self._watched(problem)
        self._problem, self._origin = problem, state
        with uncollected():
            self._run = HeldRun(problem, self.t_end, replace(options, check_start=options.check_start and not repair))
        nothing = np.empty((0, problem.n))
        cells = self._settings.cells
        self._run.take_inputs(cells, list(self._settings.places.values()))
        held = (cells, np.empty((0, cells.size)))
        empty = DAEResult(np.empty(0), nothing, nothing, Status.SUCCESS, "", held=held)
        # lines end where a state is
        self._settings.begin(self._run.state.rdata, float(problem.t0))
        self._row = Solution(self._system, problem, empty, self._members)
        self._row.inside = just_inside(np.array([problem.t0, self.t_end]))
        self._row.share(1)
        self._next_look = problem.t0 if self._system.has_dropped_rows else np.inf
        self._points: list[tuple] = []
        self.__dict__["_ready"] = None
        self._counted: dict[Any, tuple[tuple, Any]] = {}
        """Points at which angles have last been counted, and what they were."""
        self._failed: str | None = None
        self._passed: StopAt | None = None
        """The one of ``stops`` that a jump at the present time has passed, not told yet."""
        place = self._run.place(problem.y0, problem.yp0)
        self._stand_at(Point(float(problem.t0), *place, problem.idata), self._records)
        self._since = self.t

    def _stand_at(self, point: Point, record: bool) -> None:
        # past the look at names that are assigned, which takes as long as all the rest
        own = self.__dict__
        own["t"], own["_at"], own["_present"] = point[0], point, None
        if record:
            own["_points"].append(point)

    # --- going on -----------------------------------------------------------------------------------

    def advance(self, t: float, *, record: bool = True) -> StopAt | None:
        """Go on to time ``t``, s; with ``record`` it becomes a point of the :meth:`solution`.

        Returns
        -------
        StopAt or None
            The one of ``stops`` at which the simulation has stopped before.

        Raises
        ------
        ModelError
            For a time that is no number, that lies behind or after the end, and where the integration fails: the
            simulator then stands where it stood, and can only be restored to an earlier state.
        """
        own = self.__dict__
        ready = own["_ready"]
        if ready is not None and type(t) is float and own["t"] < t <= own["t_end"] and own["_failed"] is None:
            # as below, by one call of compiled code
            run, settings, go_next, at, known = ready
            keep, began = record and own["_records"], perf_counter()
            rows, table = run.rows, known.table
            if settings.waiting or settings.led:
                if t - own["t"] < RESOLVED * own["t_end"] or (row := self._steer_to(t, keep)) is None:
                    return self._advance(t, record)
            else:
                row = go_next(at, t, keep)
            if row < 0:
                code, row = -1 - row, run.row
                failure = run.arrive(code, t, keep)
                table = run.table
                if failure is not None:
                    self._fail(failure)
            own["_took"] += perf_counter() - began
            own["t"], own["_present"] = t, None
            own["_at"] = point = t, rows, row, table
            if keep:
                own["_points"].append(point)
            if t >= own["_next_look"]:
                self._look(t)
            return None
        return self._advance(t, record)

    def _advance(self, t: Any, record: bool) -> StopAt | None:
        """Go on to a time with all that may stand in the way."""
        own = self.__dict__
        if not (type(t) is float and self.t <= t <= self.t_end and self._failed is None and not self._inside):
            t = float(self._time(t))
        if self._unmet:
            warn_of_unmet(self._unmet)
            self._unmet = []
        settings = self._settings
        begins = settings.waiting or any(last <= self.t for last in settings.led.values())
        if begins and 0.0 < t - self.t < RESOLVED * self.t_end:
            raise ModelError(
                f"t = {t:.9g} s lies {t - self.t:.2g} s after the present time, at which something was set; up to "
                f"t_end = {self.t_end:.6g} s times are told apart by {RESOLVED * self.t_end:.2g} s: go on by more"
            )
        while self.t < t:
            end = self._sample(t) if self._controls else t
            if settings.waiting or settings.led:
                self._apply(t)
            if self._passed is not None:
                stop, self.__dict__["_passed"] = self._passed, None
                self._stay(record)
                return stop
            if self._stops and (hit := self._crossing(end)) is not None:
                self._go_to(hit[0], record)
                self._run.tell(hit)
                return self._stops[hit[1]]
            self._go_to(end, record and end == t)
        own["_ready"] = self._when_ready()
        return None

    def _when_ready(self) -> tuple[HeldRun, Settings, Any, int, Any] | None:
        """Return what :meth:`advance` takes where nothing of Python has to be asked on the way, else None."""
        run = self._run
        if not run.quick or self._controls or self._stops or self._functions or self._unmet:
            return None
        return run, self._settings, run.go_next, run.at, run.last_records

    def _stay(self, record: bool) -> None:
        """Let the present time be a point of the solution if it is to be one and is none."""
        point = self._point
        if record and self._records and not (self._points and self._points[-1][0] == point.t):
            rows, row = self._run.place(point.y, point.yp)
            rows.kept[row] = point.rows.kept[point.row]
            self._stand_at(Point(point.t, rows, row, point.idata), True)

    def _crossing(self, end: float) -> tuple[float, int] | None:
        """Return time and number of the next stop up to a time that steps have come to, going on as far as needed."""
        run = self._run
        hit = run.crossing(self.t, end)
        if hit is None and end > run.state.t:
            self._run_to(end, False)
            hit = run.crossing(self.t, end)
        return hit

    def _time(self, t: Any) -> float:
        """Return a time to go on to, s; raise a ModelError for any other."""
        self._check_outside("advance")
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
        run, keep = own["_run"], record and own["_records"]
        rows, row = run.rows, run.row
        self._run_to(t, keep)
        own["t"], own["_present"] = t, None
        own["_at"] = point = t, rows, row, run.table
        if keep:
            own["_points"].append(point)
        if t >= self._next_look:
            self._look(t)

    def _look(self, t: float) -> None:
        """Look whether rows that have been left out contradict the others."""
        self._next_look = t + (self.t_end - self._problem.t0) / CONFLICT_SAMPLES
        found = self._now().find_conflict(np.array([0]))
        if found is not None:
            self._failed = found
            raise ModelError(found)

    def _run_to(self, t: float, keep: bool) -> None:
        """Take steps; the simulator itself stays where it stands."""
        own = self.__dict__
        run, began = own["_run"], perf_counter()
        if own["_functions"]:
            own["_inside"] = "a function"
            try:
                with raised_errors(self._functions):
                    failure = run.go_to(t, keep)
            finally:
                own["_inside"] = ""
        else:
            failure = run.go_to(t, keep)
        own["_took"] += perf_counter() - began
        if failure is not None:
            self._fail(failure)

    def _fail(self, failure: tuple[Status, str]) -> None:
        if failure[0] is Status.INTERRUPTED:
            raise KeyboardInterrupt
        self._failed = failure[1]
        raise ModelError(failure[1])

    def _check_outside(self, what: str) -> None:
        if self._inside:
            raise ModelError(
                f"{what}: {self._inside!r} is being asked for its value; let its controller or function return that, "
                "and go on or back after advance has returned"
            )

    def begun(self) -> Begun:
        """Return what stands behind the simulation, with its start evaluated and pivots chosen; or raise `ModelError`.

        It is raised if that fails, or something is in Python: functions, controllers, stops; or an input is on its way.
        """
        held = [
            *(f"the function {one.name!r} of Python" for one in self._functions),
            *(["functions of Python"] if self._options.errors is not None and not self._functions else []),
            *(["controllers"] if self._controls else []),
            *(["stops"] if self._stops else []),
            *(["inputs on their way"] if self._settings.on_the_way(self.t) is not None else []),
        ]
        if held:
            raise ModelError(f"simulator: it cannot go on without Python: it has {', '.join(held)}")
        if self._settings.waiting or self._settings.led:
            self._apply(self.t)  # lines that have ended, too
        if not self._run.started and (failure := self._run.begin()) is not None:
            self._failed = failure[1]
        if self._failed is not None:
            raise ModelError(f"the simulation has failed: {self._failed}")
        return Begun(self._run, self._point, self._system, self._base, self._settings.cells, self._members)

    # --- acting on it ---------------------------------------------------------------------------------

    def set(self, name: str, value: Any, hold: int = 0) -> None:
        """Give an input or a parameter another value, from the present time on.

        Values up to the present time stay as they were returned. The step that has gone past it is cut back to it. It
        acts from the next :meth:`advance` on: ``get("input", name)`` tells what is going to act, and all else what has
        acted up to the present time, as `Solution.input` does. Before the first advance it acts from the start.

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
            For a name that is not there, a value that is no number in its unit, an input that has a controller, and
            one that would let a body jump: the position of a motion with ``hold=0``.
        """
        own = self.__dict__
        settings = own["_settings"]
        if own["_controls"]:
            self._check_free(name)
        if type(name) is str and name in settings.plain and type(value) is float and value - value == 0.0:
            if type(hold) is int and -1 < hold < 2:
                # an input that only loads depend on takes any number
                settings.waiting[name] = value, hold
                settings.given.add(name)
                return
        settings.set(name, value, hold)

    def take_effect(self) -> None:
        """Let values that have been set take effect now, and not with the next :meth:`advance`.

        Raises
        ------
        ModelError
            For a value that an input is led to: its way begins with the next advance.
        """
        settings = self._settings
        if not (settings.waiting or settings.led):
            return
        led = settings.on_the_way(self.t)
        if led is not None:
            raise ModelError(
                f"state: {led!r} is on its way to a value; take the state before set, or after the advance to its end; "
                f"at a stop on the way set({led!r}, sim.get('input', {led!r})) holds it"
            )
        if settings.waiting:
            self._apply(self.t)

    def number(self, name: str) -> Number:
        """Return what :meth:`set` changes under a name; raise a ModelError if there is nothing."""
        return self._settings.number(name)

    def _apply(self, end: float) -> None:
        """Let what has been set take effect at the present time; lines that were set end at ``end``."""
        own = self.__dict__
        settings, run = own["_settings"], own["_run"]
        if not own["_functions"] and self._steer(end):
            return
        change = settings.take(own["t"], end)
        if change is None:
            return
        # where the simulation starts nothing has been before
        before = run.event_values(own["_at"]) if own["_stops"] and own["t"] > own["_t_start"] else None
        if change.prescribes or change.unsure or not run.state.steps:
            self._start_with(change.values)
            if change.leaps:
                self._jumped.append(own["t"])
        else:
            began = perf_counter()
            with raised_errors(self._functions) if self._functions else NOTHING:
                run.change(own["_at"], settings.cells, change)
            own["_took"] += perf_counter() - began
        if before is not None:
            self._note_passed(before)

    def _note_passed(self, before: np.ndarray) -> None:
        """Note which stop is passed by what has just taken effect, from what their states were before."""
        run = self._run
        # velocities that are prescribed jump where a run begins
        if not run.started and (failure := run.begin()) is not None:
            self._failed = failure[1]
            raise ModelError(failure[1])
        if (event := run.passed_in_jump(before)) is not None:
            self.__dict__["_passed"] = self._stops[event]

    def _steer(self, end: float) -> bool:
        """Let what has been set take effect in one compiled call, where it is one input of loads; return that."""
        own = self.__dict__
        settings, point, began = own["_settings"], own["_at"], perf_counter()
        if (one := settings.steered()) is None:
            return False
        name, value, hold, first, count = one
        code = own["_run"].steer(point, first, count, value, end if hold else point[0])
        if code is None:
            return False
        settings.take_steered(name, code, end)
        own["_took"] += perf_counter() - began
        return True

    def _steer_to(self, t: float, keep: bool) -> int | None:
        """Do the same and go on to ``t`` in that call; return what `standing.go_next` does, None where it cannot be."""
        own = self.__dict__
        settings, point = own["_settings"], own["_at"]
        if (one := settings.steered()) is None:
            return None
        name, value, hold, first, count = one
        done = own["_run"].steer_to(point, first, count, value, hold, t, keep)
        if done is None:
            return None
        code, row = done
        settings.take_steered(name, code, t)
        return row

    def _start_with(self, values: np.ndarray) -> None:
        """Start afresh at the present time with other numbers; velocities that they prescribe jump there."""
        point, led, run = self._point, self._settings.led, self._run
        rdata = run.state.rdata.copy()
        rdata[self._settings.cells] = values
        first, points = (self._problem, self._origin), self._points
        begun = self.t > self._t_start or run.state.steps > 0
        tables, y, yp = self._own_tables(point.idata, rdata), point.y, point.yp
        if not begun:
            # the first point is one with what is set before the start, whatever a state has begun
            y = settle_states(self._base.residual, point.t, run.problem.y0, run.problem.yp0, *tables)
            yp = run.problem.yp0
        counted = self._counted
        self._begin(State.of(self._base, point.t, y, yp, tables), repair=True)
        self._settings.led = led
        if begun:
            self._problem, self._origin = first
            self._points = points
            self.__dict__["_at"] = point
            self._run.goes_on_from(run, point.t)
            self._counted = counted

    def __repr__(self) -> str:
        name = self._system.mechanism.name if self._system.mechanism is not None else "mechanism"
        return f"Simulator({name!r}: t = {self.t:.9g} of {self.t_end:.9g} s, {len(self._points)} points)"
