"""The state of a simulation that is held between calls, taken from it and put back."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.problem import DAEProblem, ModelError
from gearmbs.dae.state import State, check_state, equations_of
from gearmbs.mechanism.solve.controllers import Control
from gearmbs.mechanism.solve.told import Point, Told


class Restored(Told):
    """The part of a `gearmbs.Simulator` that gives its state and takes one."""

    t_end: float
    take_effect: Callable[[], None]
    _base: DAEProblem
    _t_start: float
    _equations: str
    _integers: tuple[Any, Any]
    _before: dict[bytes, bytes]
    _controls: list[Control]
    _unmet: list[str]
    _begin: Callable[..., None]
    _stand_at: Callable[[Point, bool], None]
    _tell_clock: Callable[[], None]
    _check_outside: Callable[[str], None]

    def state(self) -> State:
        """Return the present state with the integrator's history: what follows from it is the same, bit for bit."""
        if self._failed is not None:
            raise ModelError(f"the simulation has failed: {self._failed} Go back with restore(state)")
        self.take_effect()
        point, run = self._point, self._run
        y, yp = point.y, point.yp
        if not (run.options.check_start or run.state.steps):
            # behind a jump of what motions prescribe: what has been told up to it is no start of what follows
            y, yp = self._landed()
        if not self._equations:
            self._equations = equations_of(self._base)
        history = run.history(self._equations) if run.started else None
        tables = self._own_tables(point.idata, run.state.rdata)
        # tables of integers change seldom, and are others then; to look through one takes a tenth of the rest
        known = self._integers if self._integers[0] is point.idata else None
        given = self._places_given()
        state = State.of(self._base, point.t, y, yp, tables, history, integers=known and known[1], given=given)
        if known is None:
            # past the look at names that are assigned
            self.__dict__["_integers"] = point.idata, state.integers
        held = {control.name: control.memory() for control in self._controls if control.remembers}
        return replace(state, controllers=held) if held else state

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
            If the state is one of another model, or lies outside the span of this simulator; from within a controller.

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
        self._take_given(state)
        if self._controls or state.controllers:
            given = [control.name for control in self._controls]
            self._unmet = [name for name in state.controllers if name not in given]
            for control in self._controls:
                control.go_back(self.t, state.controllers.get(control.name))
        elif self._unmet:
            self._unmet = []

    def _take_given(self, state: State) -> None:
        """Let what belongs to a state be what has been set."""
        self.__dict__["_given"] = state.reals[0]
        self._settings.given.clear()

    def _own_point(self, state: State) -> int | None:
        """Return which of the points a state is, or None."""
        at = bisect_left(self._points, state.t, key=itemgetter(0))
        y = state.y.tobytes()
        told = self._before.get(y, y)
        while at < len(self._points) and self._points[at][0] == state.t:
            if self._points[at].y.tobytes() == told:
                return at
            at += 1
        return None

    def _go_back(self, state: State) -> bool:
        """Go to a state of the present run in place, as a new run from it would; return whether it is one of it."""
        history = state.history
        if history is None or not state.is_own or history.equations != self._equations:
            return False
        if not self._run.go_back(history):
            return False
        self._tell_clock()
        look = state.t if self._system.has_dropped_rows else np.inf
        # past the look at names, as in `_stand_at`
        self.__dict__.update(_failed=None, _passed=None, _counted={}, _since=state.t, _next_look=look)
        self._settings.begin(self._run.state.rdata, state.t)
        table = self._run.table
        place = self._run.place(state.y, state.yp, keep=False)
        self._stand_at(Point(state.t, *place, table, self._settings.held), False)
        return True

    def __copy__(self) -> Any:
        raise ModelError(
            "a simulator is not copied: both would go on with one run; make another one with initial=sim.state()"
        )

    def __deepcopy__(self, _: Any) -> Any:
        return self.__copy__()

    def __reduce__(self) -> tuple:
        raise ModelError("a simulator is not pickled; save its state() and make another one with initial=")
