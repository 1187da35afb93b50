"""A run of WSTIFF or GSTIFF that is held between calls: it goes to one time after the other.

Steps go beyond the times asked for, and values there lie on the polynomial of the last step, as the outputs of a run
that was told all times ahead: what is asked does not change the steps.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.driver import FIRST_CHUNK, REACHED, InterruptFlag, Run, StallWatch
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.run_state import RUNNING, RunState
from gearmbs.dae.integrators.step import advance
from gearmbs.dae.integrators.stepping.jumps import TERMS, pass_jump
from gearmbs.dae.integrators.stepping.memory import Held, LastStep, put_memory, record_window, value_in
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import Status
from gearmbs.dae.state import History
from gearmbs.kernels.pointers import direct

LOOK = 32 * FIRST_CHUNK
"""Steps between two looks at whether the run gets on: a look takes as long as some steps of a small model, and what it
looks for shows over thousands."""
ROWS = 16 * HISTORY
"""Records between two calls of the compiled loop: enough for it to be called seldom, few enough for the cache."""


class LastRecords:
    """The records of the last few steps, and the integer table that was valid in the last one.

    It stands in for `gearmbs.dae.integrators.records.Records`, which keeps all.
    """

    consumed_time = processor_time = 0.0

    def __init__(self, st: RunState) -> None:
        self.state = st
        for name in ("record_t", "record_h", "record_order", "record_y"):
            setattr(st, name, getattr(st, name)[:ROWS])
        self.forget_changes()

    def forget_changes(self) -> None:
        """Take the present integer table for that of the last step."""
        self.table = self.before = self.state.idata.copy()
        self.changed_at = -1

    def drain(self) -> None:
        """Make room for further records but keep the points of a polynomial."""
        st = self.state
        m = int(st.n_records)
        kept = min(m, HISTORY)
        for array in (st.record_t, st.record_h, st.record_order, st.record_y):
            array[:kept] = array[m - kept : m].copy()
        st.n_records = kept

    def change_table(self) -> None:
        """Note that coordinates have changed at the end of the last step."""
        st = self.state
        self.before, self.table, self.changed_at = self.table, st.idata.copy(), int(st.steps)

    def last_step(self) -> LastStep:
        """Return the last step: its points from the window, or from the records where coordinates have changed."""
        st, n = self.state, len(self.state.y)
        if self.changed_at != st.steps:
            first, count = int(st.newest), int(st.record_order[st.n_records - 1]) + 1
            rows = st.window_y[first * n : (first + count) * n].reshape(count, n).copy()
            return LastStep(st.window_t[first : first + count].copy(), rows, st.y.copy(), st.yp.copy(), self.table)
        p = int(np.flatnonzero(st.record_order[: st.n_records])[-1])
        points = slice(p - int(st.record_order[p]), p + 1)
        nodes, rows = st.record_t[points][::-1].copy(), st.record_y[points, :n][::-1].copy()
        return LastStep(nodes, rows, rows[0].copy(), st.yp.copy(), self.before)


class HeldRun(Run):
    """A run that goes to one time after the other.

    Parameters
    ----------
    problem : DAEProblem
    t_end : float
        Latest time that can be asked for.
    options : Options
        A ``history`` among them is that of the state in which the problem starts.
    """

    def __init__(self, problem: DAEProblem, t_end: float, options: Options) -> None:
        super().__init__(problem, None, t_end, replace(options, history=None))
        self.options = options
        st = self.state
        st.outputs, st.y_out, st.yp_out = np.empty(1), np.empty((1, problem.n)), np.empty((1, problem.n))
        st.kept_out = np.empty((1, len(st.kept)))
        st.next_output = 1
        self._at, self._y, self._yp = st.outputs, st.y_out[0], st.yp_out[0]
        self._looked = 0
        self.last_records = LastRecords(st)
        self.records = self.last_records  # type: ignore[assignment]
        self._given: tuple[int, LastStep] | None = None
        self._scratch: np.ndarray | None = None
        self.layout: dict[str, Any] | None = None
        if options.history is not None:
            self.put_back(options.history)

    def go_to(self, t: float) -> tuple[Status, str]:
        """Take steps until one ends at ``t`` or later; return a success, or how the run has failed.

        Some steps are taken at once, whatever else there is to do, for which Python takes as long as they do. Ctrl-C
        comes in between then, after them: ``st.code`` knows what is left to do.
        """
        st = self.state
        if self.started and t <= st.t:
            return REACHED
        self._at[0] = st.t_pause = t
        st.next_output = 0
        if self.started and st.code == RUNNING and st.steps - self._looked < LOOK and not self.stall.looking:
            direct(advance)(self.functions, st, self.algebraic.part, self.plan, self.factors, FIRST_CHUNK)
            if st.code == RUNNING and st.t >= t and not self.options.errors:
                return REACHED
        self._looked = st.steps
        with InterruptFlag() as interrupt:
            return self._loop(interrupt)

    def values_at(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return y, y' and the integer table valid for them at a time within the last step."""
        st, records = self.state, self.last_records
        if st.next_output == 1 and self._at[0] == t:
            table = records.before if records.changed_at == st.steps else records.table
            return self._y.copy(), self._yp.copy(), table
        last = self._last_step()
        return *value_in(self, last, t), last.idata

    def change(
        self, t: float, y: np.ndarray, yp: np.ndarray, cells: np.ndarray, values: np.ndarray, loads: bool, leads: bool
    ) -> None:
        """Cut the last step back to a time within it, and go on from there with other numbers in the equations.

        Parameters
        ----------
        t : float
        y, yp : ndarray, shape (n,)
            Values there, as of :meth:`values_at`.
        cells, values : ndarray
            Places in the table of numbers, and what is to stand there.
        loads : bool
            Whether they only act as loads do, which leave the matrix as it is.
        leads : bool
            Whether the change grows with the time.
        """
        st, kept = self.state, True
        if self.last_records.changed_at == st.steps or (self._given is not None and self._given[0] == st.steps):
            last = self._last_step()
            kept = np.array_equal(last.idata, st.idata)
            if not kept:
                # the coordinates were changed at an end of the step that is no end any more
                count, n, first = len(last.nodes), len(st.y), int(st.newest)
                st.idata[:] = last.idata
                st.n_past, st.order = count, min(int(st.order), max(1, count - 1))
                st.window_t[first : first + count] = last.nodes
                st.window_y[first * n : (first + count) * n] = last.rows.ravel()
        if not (kept and loads):
            st.matrix_wanted = True
        if self._scratch is None:
            self._scratch = np.empty((TERMS + 3, len(st.y)))
        direct(pass_jump)(
            self.functions, st, self.plan, self.factors, t, y, yp, cells, values, leads, kept, self._scratch
        )
        if not kept:
            self.last_records.forget_changes()
        self._given = int(st.steps), LastStep(np.array([t]), y[None, :], y, yp, self.last_records.table)

    def history(self, equations: str) -> History:
        """Return what the next steps of these equations depend on; a run that has not been started has nothing yet."""
        st = self.state
        given = self._given is not None and self._given[0] == st.steps
        told = given or self.last_records.changed_at == st.steps
        return History(self.options.method, Held(self, self._last_step() if told else None), self.plan, equations)

    def put_back(self, history: History) -> None:
        """Go on with a history; the tables are those of its state."""
        self.pivots, last = put_memory(self, history)
        self._stand_behind(last)

    def go_back(self, history: History) -> bool:
        """Go on with a history of this run, in place and with its tables; return whether it is one that can be."""
        held = history.numbers
        if not (isinstance(held, Held) and held.belongs_to(self)):
            return False
        self._stand_behind(held.put_back(self))
        return True

    def _stand_behind(self, last: LastStep) -> None:
        """Keep the window as records, behind the last step."""
        st = self.state
        st.n_records, st.next_output = 0, 1
        record_window(st)
        self._at[0] = np.nan
        self._looked = st.steps
        self.stall = StallWatch(st.steps, st.t)
        self.last_records.forget_changes()
        self._given = int(st.steps), last

    def _last_step(self) -> LastStep:
        st = self.state
        if self._given is None or self._given[0] != st.steps:
            if st.steps:
                last = self.last_records.last_step()
            else:
                last = LastStep(np.array([st.t]), st.y[None, :].copy(), st.y.copy(), st.yp.copy(), st.idata.copy())
            self._given = int(st.steps), last
        return self._given[1]
