"""The state of a simulation that is held between calls, taken from it and put back."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.integrators.stepping.held_run import HeldRun
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.state import State, changed_places, check_state, equations_of
from gearmbs.mechanism.language.user_functions import raised_errors
from gearmbs.mechanism.solve.controllers import Control
from gearmbs.mechanism.solve.told import Point, Told

new_mark = tuple.__new__
"""Makes one of its parts in half the time that its class takes."""


class Mark(NamedTuple):
    """What a simulator notes in a state of its own.

    Attributes
    ----------
    points : int
        Points so far.
    point : tuple
        The present one, see `gearmbs.mechanism.solve.told.Point`.
    led : tuple of str
        Inputs whose lines end there.
    given : ndarray
        Places of numbers that have been set.
    counted : dict
        Turns counted up to what has been asked for, see `gearmbs.mechanism.solve.told`.
    """

    points: int
    point: tuple
    led: tuple[str, ...]
    given: np.ndarray
    counted: dict[Any, tuple[tuple, Any]]


class Restored(Told):
    """The part of a `gearmbs.Simulator` that gives its state and takes one."""

    t_end: float
    take_effect: Callable[[], None]
    _base: DAEProblem
    _t_start: float
    _equations: str
    _integers: tuple[Any, Any]
    _before: dict[bytes, bytes]
    _of_model: dict[str, Any]
    _controls: list[Control]
    _functions: list[Any]
    _unmet: list[str]
    _begin: Callable[..., None]
    _stand_at: Callable[[Point, bool], None]
    _tell_clock: Callable[[], None]
    _check_outside: Callable[[str], None]
    _when_ready: Callable[[], Any]

    def state(self) -> State:
        """Return the present state with the integrator's history: what follows from it is the same, bit for bit."""
        own = self.__dict__
        if own["_failed"] is not None:
            raise ModelError(f"the simulation has failed: {self._failed} Go back with restore(state)")
        settings, point, run = own["_settings"], own["_at"], own["_run"]
        if settings.waiting or settings.led:
            self.take_effect()
            point, run = own["_at"], own["_run"]
        if not own["_equations"]:
            own["_equations"] = equations_of(self._base)
        if run.started and run.state.steps:
            state = self._with_history(run, point)
        else:
            state = self._at_start(run, Point(*point))
        if own["_controls"]:
            return replace(state, controllers={control.name: control.memory() for control in self._controls})
        return state

    def _with_history(self, run: HeldRun, point: tuple) -> State:
        """Return the state at a point of a run that is under way."""
        own, history = self.__dict__, run.history(self._equations, point)
        held: Any = history.numbers
        settings, given = own["_settings"], self._places_given()
        held.mark = new_mark(Mark, (len(own["_points"]), point, tuple(settings.led), given, dict(own["_counted"])))
        integers, before = self._changed_integers(point[3]), own["_base"].rdata
        return State.held(self._of_model, point[0], held, history, integers, before, given)

    def _at_start(self, run: HeldRun, point: Point) -> State:
        """Return the state where no step has been taken."""
        y, yp = point.y, point.yp
        if not run.options.check_start:
            # behind a jump of what motions prescribe: what has been told up to it is no start of what follows
            y, yp = self._landed()
        history = run.history(self._equations, point) if run.started else None
        tables = self._own_tables(point.idata, run.state.rdata)
        known, given = self._changed_integers(point.idata), self._places_given()
        return State.of(self._base, point.t, y, yp, tables, history, integers=known, given=given)

    def _changed_integers(self, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places and values of what differs from the model's integers; they change seldom, in another table."""
        known = self.__dict__["_integers"]
        if known[0] is not table:
            # past the look at names that are assigned
            known = table, changed_places(table[: len(self._base.idata)], self._base.idata)
            self.__dict__["_integers"] = known
        return known[1]

    def _landed(self) -> tuple[np.ndarray, np.ndarray]:
        """Return unknowns and rates with which the run goes on where velocities have jumped."""
        run = self._run
        if not run.started and (failure := run.begin()) is not None:
            self._failed = failure[1]
            raise ModelError(failure[1])
        idata, first = run.state.idata, run.problem
        y = run.state.y.copy()
        # multipliers and loads there are impulses over a vanishing step
        for block in (slice(idata[T.H_LAMBDA], idata[T.H_Z]), slice(idata[T.H_MU], None)):
            y[block] = first.y0[block]
        if self._records:
            self._before[y.tobytes()] = self._point.y.tobytes()
        return y, first.yp0

    def _own_tables(self, idata: np.ndarray, rdata: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return tables without what stops have added to them."""
        return idata[: len(self._base.idata)], rdata[: len(self._base.rdata)]

    def restore(self, state: State) -> None:
        """Go back, or on, to a state of the same mechanism.

        Of the points those before it are kept if it is one of them, as a state of this simulator is, else none.

        Raises
        ------
        ModelError
            If the state is one of another model, its values contradict each other, as where joints are open, or it lies
            outside the span of this simulator; from within a controller. The simulator then stays where it stands.

        Warns
        -----
        UserWarning
            If the state has the memory of a controller that is not here, or samples otherwise.
        """
        self._check_outside("restore")
        check_state("restore", state)
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
        if not self._goes_back(state):
            first, origin = self._own_point(state), (self._problem, self._origin)
            kept = self._points[: first + 1] if first is not None else []
            self._begin_in(state)
            self._take_counts(state)
            if kept:
                # what stood there up to the state, which a jump may follow
                self._problem, self._origin = origin
                self._points[:] = kept
            self._take_given(state)
        if self._controls or state.controllers:
            given = [control.name for control in self._controls]
            self._unmet = [name for name in state.controllers if name not in given]
            for control in self._controls:
                control.go_back(self.t, state.controllers.get(control.name))
        elif self._unmet:
            self._unmet = []
        self.__dict__["_ready"] = self._when_ready()
        if self._jumped:
            self._jumped = [t for t in self._jumped if t <= self.t]

    def _begin_in(self, state: State) -> None:
        """Make a run that starts in a state; raise a ModelError, and stay where it was, if it cannot."""
        own, before, set_before = self.__dict__, dict(self.__dict__), self._settings.snapshot()
        self._begin(state)
        if self._run.started or any(number.prescribes for number in self._base.numbers.values()):
            # what is set next may let motions ask for the velocities that the state has
            return
        with raised_errors(self._functions):
            failure = self._run.begin()
        if failure is not None:
            own.update(before)
            self._settings.put_back(set_before)
            raise ModelError(f"restore: {failure[1]}")

    def _take_counts(self, state: State) -> None:
        """Take the turns that a simulator of the same equations has counted, of which no point here knows."""
        mark: Mark | None = None if state.history is None else getattr(state.history.numbers, "mark", None)
        if mark is None or not state.is_own or state.history is None:
            return
        self._equations = self._equations or equations_of(self._base)
        if state.history.equations == self._equations:
            self._counted = dict(mark.counted)

    def _take_given(self, state: State) -> None:
        """Let what belongs to a state be what has been set."""
        settings = self._settings
        if settings.cells.size:
            self.__dict__["_given"] = state.reals[0]
            settings.given.clear()

    def _own_point(self, state: State) -> int | None:
        """Return which of the points a state is, or None."""
        at = bisect_left(self._points, state.t, key=itemgetter(0))
        y = state.y.tobytes()
        told = self._before.get(y, y)
        while at < len(self._points) and self._points[at][0] == state.t:
            if Point(*self._points[at]).y.tobytes() == told:
                return at
            at += 1
        return None

    def _goes_back(self, state: State) -> bool:
        """Go to a state of the present run in place, as a new run from it would, if it is one; return that."""
        history, own = state.history, self.__dict__
        if history is None or not state.is_own or history.equations != own["_equations"]:
            return False
        points, run, held = own["_points"], own["_run"], history.numbers
        mark: Mark | None = getattr(held, "mark", None)
        if mark is None:
            return False
        first, count = None, mark[0]
        if own["_records"]:
            # the very point, which is among the last ones mostly
            known = 0 < count <= len(points) and points[count - 1] is mark[1]
            first = count - 1 if known else self._own_point(state)
            if first is None:
                return False
        place = run.go_back(history)
        if place is None:
            return False
        if first is not None:
            del points[first + 1 :]
        self._tell_clock()
        settings, t = own["_settings"], mark[1][0]
        settings.go_back(mark[2], t)
        own["_given"] = mark[3]
        own["_failed"] = own["_passed"] = own["_present"] = None
        own["_counted"] = dict(mark.counted)
        own["_next_look"] = t if own["_system"].has_dropped_rows else np.inf
        own["_since"] = own["t"] = t
        own["_at"] = t, place[0], place[1], run.table
        return True

    def __copy__(self) -> Any:
        raise ModelError(
            "a simulator is not copied: both would go on with one run; make another one with initial=sim.state()"
        )

    def __deepcopy__(self, _: Any) -> Any:
        return self.__copy__()

    def __reduce__(self) -> tuple:
        raise ModelError("a simulator is not pickled; save its state() and make another one with initial=")
