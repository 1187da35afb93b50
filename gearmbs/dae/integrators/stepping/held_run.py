"""A run of WSTIFF or GSTIFF that is held between calls: it goes to one time after the other.

Steps go beyond the times asked for, and values there lie on the polynomial of the last step, as the outputs of a run
that was told all times ahead: what is asked does not change the steps.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple
from weakref import ref

import numpy as np
from scipy.optimize import brentq

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.driver import FIRST_CHUNK, InterruptFlag, Run, StallWatch
from gearmbs.dae.integrators.events import SAMPLES
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.run_state import RunState
from gearmbs.dae.integrators.stepping.jumps import CHANGED, TERMS, pass_jump
from gearmbs.dae.integrators.stepping.memory import (
    Held,
    LastStep,
    factor_words,
    laid_out,
    put_memory,
    value_in,
    words_of,
)
from gearmbs.dae.integrators.stepping.reach import NOT_BEGUN, REACHED, address_of_advance, drain, stand_behind
from gearmbs.dae.integrators.stepping.standing import (
    AHEAD,
    Standing,
    go_next,
    go_on,
    pack,
    steer_next,
    steer_on,
    unpack,
)
from gearmbs.dae.problem import EPS, DAEProblem
from gearmbs.dae.result import Status
from gearmbs.dae.state import History
from gearmbs.kernels.pointers import direct

LOOK = 64 * FIRST_CHUNK
"""Steps between two looks at whether the run gets on: a look takes as long as some steps of a small model, and what it
looks for shows over thousands."""
ROWS = 16 * HISTORY
"""Records between two calls of the compiled loop: enough for it to be called seldom, few enough for the cache."""

BLOCK_BYTES = 1 << 18
"""Of values of points that are allotted at a time: about what fits into the second cache."""
FEWEST_ROWS = 8
ROUNDED = 64.0 * EPS
"""Part of the time within which a crossing is the one that has just been told, or that comes to pass at a point: one is
found to two units of the last digit, and values that are interpolated or computed anew move it by some ten."""


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

    def forget_changes(self, table: np.ndarray | None = None) -> None:
        """Take the present integer table, of which one may be a copy, for that of the last step."""
        self.table = self.before = self.state.idata.copy() if table is None else table
        self.changed_at = -1

    def drain(self) -> None:
        """Make room for further records but keep the points of a polynomial."""
        direct(drain)(self.state)

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


class Rows(NamedTuple):
    """Memory for points, a row each, to which the compiled loop writes."""

    t: np.ndarray
    y: np.ndarray
    yp: np.ndarray
    kept: np.ndarray
    """Counted turns, and behind them what named numbers were."""


def _are_one(at: float, other: float) -> bool:
    """Return whether two times of crossings are one but for rounding."""
    return abs(at - other) <= ROUNDED * abs(at)


Numbers = tuple[np.ndarray, bool, bool, bool, bool, bool, bool, bool]
"""What `HeldRun.change` takes."""


class HeldRun(Run):
    """A run that goes to one time after the other.

    Parameters
    ----------
    problem : DAEProblem
    t_end : float
        Latest time that can be asked for.
    options : Options
        A ``history`` among them is that of the state in which the problem starts.

    Attributes
    ----------
    rows : Rows
        Where points are written to.
    row : int
        Of the next point.
    table : ndarray
        The integer table valid for the present one.
    """

    def __init__(self, problem: DAEProblem, t_end: float, options: Options) -> None:
        super().__init__(problem, None, t_end, replace(options, history=None))
        self.options = options
        self.last_records = LastRecords(self.state)
        self.records = self.last_records  # type: ignore[assignment]
        self.table = self.last_records.table
        self._given: tuple[int, LastStep] | None = None
        self._jumped: tuple[int, float, Rows, int] | None = None
        """Steps, time and point behind which numbers of the equations have changed."""
        self._scratch = np.empty((TERMS + 3, problem.n))
        self._pass_jump, self._go_on, self.go_next = direct(pass_jump), direct(go_on), direct(go_next)
        self._steer_on, self._steer_next = direct(steer_on), direct(steer_next)
        self._pack, self._unpack = direct(pack), direct(unpack)
        self.itself = ref(self)
        self.crossings: list[tuple[float, int]] = []
        """Times and events in the last step."""
        self.told: dict[int, float] = {}
        """Times at which crossings of each event have last been told."""
        self.since = float(problem.t0)
        """Where all has begun: what passes there has done so before."""
        self._errors = options.errors
        self._watched = self.quick = False
        """Whether ``stall`` may have noted something; whether nothing but steps may come on the way to a time."""
        self.layout, numbers = laid_out(self)
        nothing = np.zeros(0, dtype=np.int64)
        st, part = self.state, self.algebraic.part
        self._standing = Standing(
            state=ctypes.addressof(st), part=ctypes.addressof(part), advance=address_of_advance(),
            functions=ctypes.addressof(self.functions), scalars=words_of(st), part_scalars=words_of(part),
            numbers=numbers, factor_numbers=np.zeros(0), cells=nothing, places=nothing, values=np.zeros(0),
            scratch=self._scratch,
        )  # fmt: skip
        self.turns = len(st.kept)
        """How many numbers of a point in ``rows.kept`` count turns."""
        self.at = ctypes.addressof(self._standing)
        """For `go_next`."""
        self._make_rows()
        self._placed: Any = None
        """The factors whose place is known."""
        self.words = self.layout.factors
        """Length of what a state takes, see `Held`."""
        if options.history is not None:
            self.put_back(options.history)

    def take_inputs(self, cells: np.ndarray, places: Sequence[np.ndarray]) -> None:
        """Take the cells of named numbers, and of each input that can be steered its places among them."""
        self._standing.cells, self._standing.values = cells, np.empty(cells.size)
        self.state.kept = np.concatenate([self.state.kept[: self.turns], cells])
        self._make_rows()
        self._standing.places = np.concatenate([np.ravel(own) for own in places]) if places else cells[:0]

    def _find_factors(self) -> None:
        """Find the place of the factors, which pivots that are chosen anew change."""
        plan, factors = self.plan, self.factors
        self.quick = self.started and not self.state.n_events and self._errors is None
        if factors is not self._placed and factors is not None and plan is not None:
            standing, self._placed = self._standing, factors
            standing.plan, standing.factors = ctypes.addressof(plan), ctypes.addressof(factors)
            standing.factor_numbers = numbers = factor_words(factors)
            self.words = self.layout.factors + numbers.size

    # --- points -------------------------------------------------------------------------------------

    def _make_rows(self) -> None:
        """Make room for further points; those that are kept stay where they are."""
        st, n = self.state, self.problem.n
        count = max(FEWEST_ROWS, BLOCK_BYTES // (16 * n))
        # rows whose time has not come are looked at by each step
        rows = Rows(np.full(count, np.inf), np.empty((count, n)), np.empty((count, n)), np.empty((count, len(st.kept))))
        st.outputs, st.y_out, st.yp_out, st.kept_out = rows
        st.next_output = count
        standing, self.rows = self._standing, rows
        standing.row, standing.first, standing.count = 0, 0, count

    @property
    def row(self) -> int:
        """The row of the next point."""
        return self._standing.row

    def _stand(self, keep: bool) -> None:
        """Let the point in ``row`` be the present one; the one before it is written over unless it is to be kept."""
        standing = self._standing
        row, first = standing.row, standing.first
        self.rows.t[row] = np.inf
        if keep:
            standing.first = standing.row = row + 1
            if row + 2 >= standing.count:
                self._make_rows()
        else:
            standing.row = first + 1 if row == first else first

    def place(self, y: np.ndarray, yp: np.ndarray, keep: bool = True) -> tuple[Rows, int]:
        """Keep values at the time where the run stands; return rows and row."""
        rows, row = self.rows, self.row
        rows.y[row], rows.yp[row] = y, yp
        rows.kept[row] = self.state.rdata[self.state.kept]
        self._stand(keep)
        return rows, row

    # --- going on -----------------------------------------------------------------------------------

    def begin(self) -> tuple[Status, str] | None:
        """Begin as any run; from where velocities jump to what motions prescribe, events are behind that."""
        failure = super().begin()
        self._find_factors()
        if failure is None and self.state.n_events and not self.options.check_start:
            self.state.g_old[:] = self.event_values()
        return failure

    def go_to(self, t: float, keep: bool = True) -> tuple[Status, str] | None:
        """Take steps until one ends at ``t`` or later; return how the run has failed, or None.

        The values at ``t`` then stand in what was ``row`` of ``rows``, for good if they are to be kept, else until the
        next but one; ``table`` is valid for them.

        Some steps are taken at once, whatever else there is to do, for which Python takes as long as they do. Ctrl-C
        comes in between then, after them: ``st.code`` knows what is left to do.
        """
        code = NOT_BEGUN
        if self.quick:
            row = self.go_next(self.at, t, keep)
            if row >= 0:
                self.table = self.last_records.table
                return None
            code = -1 - row
        elif self.started:
            if self.crossings and t > self.state.t:
                self.crossings.clear()
            code = self._go_on(self.at, t)
        return self.arrive(code, t, keep)

    def arrive(self, code: int, t: float, keep: bool) -> tuple[Status, str] | None:
        """Do what is left to do after a compiled call on the way to a time, by what it has returned; see `go_to`."""
        st, row = self.state, self.row
        if code == REACHED and not self._errors:
            self.table = self.last_records.table
            self._stand(keep)
            return None
        if code == NOT_BEGUN and self.started and t <= st.t:
            self._write_within(t)
            self._stand_at(keep)
            return None
        if code == NOT_BEGUN:
            self.rows.t[row] = st.t_pause = t
            st.next_output = row
        if st.n_crossings:
            self._note_crossings()
            return None
        if st.n_events:
            # one step at a time, each of which may have an event
            st.t_pause = np.nextafter(st.t, np.inf)
        with InterruptFlag() as interrupt:
            told = self._loop(interrupt)
        self._find_factors()
        self._watched = True
        # before the first step there are no factors
        self._standing.look_at = 0 if self.stall.looking else st.steps + LOOK
        if told[0] < 0:
            return told
        if st.n_crossings:
            self._note_crossings()
        elif st.t < t:
            return self.go_to(t, keep)
        else:
            self._stand_at(keep)
        return None

    def _note_crossings(self) -> None:
        st = self.state
        found = zip(st.crossing_t[: st.n_crossings].tolist(), st.crossing_event[: st.n_crossings].tolist(), strict=True)
        self.crossings += found
        st.n_crossings = 0

    def crossing(self, after: float, until: float) -> tuple[float, int] | None:
        """Return time and event of the first crossing of the last step in a span that is not told yet, None for none.

        Others may have been told at its very time, or a point that lies before it by no more than rounding.
        """
        early = after - ROUNDED * abs(after)
        ahead = [(max(at, after), e) for at, e in self.crossings if early <= at <= until and not self._is_told(at, e)]
        return min(ahead, default=None)

    def tell(self, crossing: tuple[float, int]) -> None:
        """Note that a crossing has been told."""
        self.told[crossing[1]] = crossing[0]

    def _is_told(self, at: float, event: int) -> bool:
        return _are_one(at, self.told.get(event, self.since))

    def _just_passed(self, t: float) -> tuple[list[int], list[int]]:
        """Return which events pass at a time but for rounding and are not told, and these with those that are."""
        found = {e for at, e in self.crossings if _are_one(at, t)}
        untold = [e for e in sorted(found) if not self._is_told(t, e)]
        return untold, sorted(found | {e for e, at in self.told.items() if _are_one(at, t)})

    def goes_on_from(self, run: HeldRun, t: float) -> None:
        """Tell what another run that ends at a time has not told of it."""
        self.told, self.since = run.told, run.since
        self.crossings = [(t, e) for e in run._just_passed(t)[0]]

    def _find_crossings(self, t: float) -> None:
        """Find those behind a time in the last step, of which another run has told nothing."""
        st, problem, last = self.state, self.problem, self.last_step()
        self.crossings, st.n_crossings = [], 0
        if problem.events is None:
            return
        run_events, signs = problem.events, np.empty(st.n_events)

        def events(at: float) -> np.ndarray:
            y, yp = value_in(self, last, at)
            run_events(at, y, yp, signs, last.idata, st.rdata, st.work)
            return signs.copy()

        times = np.linspace(t, st.t, SAMPLES + 1)
        values = [events(float(at)) for at in times] if t < st.t else []
        for (a, fa), (b, fb) in pairwise(zip(times.tolist(), values, strict=False)):
            for e in range(st.n_events):
                if self._passes(e, fa[e], fb[e]):
                    root = brentq(lambda at, e=e: events(at)[e], a, b, xtol=4.0 * EPS * max(abs(b), EPS))
                    self.crossings.append((float(root), e))
        st.g_old[:] = events(float(st.t))

    def _passes(self, event: int, before: float, after: float) -> bool:
        """Return whether an event is one of its direction from one value to another."""
        direction = self.state.event_direction[event]
        return bool((before < 0.0 <= after and direction >= 0) or (before > 0.0 >= after and direction <= 0))

    def event_values(self, point: tuple | None = None) -> np.ndarray:
        """Return the functions of events with the present numbers, where the run stands or at a point of its last step.

        Those that have just been told at this point are 0: what has passed does so once.
        """
        st, run_events, found = self.state, self.problem.events, np.empty(self.state.n_events)
        assert run_events is not None
        t, rows, row, table, *_ = point or (st.t, None, 0, None)
        if rows is None or t == st.t:
            # behind a jump at this time, if there has been one
            run_events(float(st.t), st.y, st.yp, found, st.idata, st.rdata, st.work)
        else:
            run_events(t, rows.y[row], rows.yp[row], found, table, st.rdata, st.work)
        found[self._just_passed(t)[1]] = 0.0
        return found

    def passed_in_jump(self, before: np.ndarray) -> int | None:
        """Return the first event that a jump to where the run stands has passed, from what they were; None for none."""
        after = self.event_values()
        return next((e for e in range(before.size) if self._passes(e, before[e], after[e])), None)

    def _stand_at(self, keep: bool) -> None:
        records = self.last_records
        self.table = records.before if records.changed_at == self.state.steps else records.table
        self._stand(keep)

    def _write_within(self, t: float) -> None:
        """Write values at a time within the last step."""
        rows, row = self.rows, self.row
        rows.y[row], rows.yp[row] = value_in(self, self.last_step(), t)
        rows.kept[row] = self.state.rdata[self.state.kept]

    def change(self, point: tuple, cells: np.ndarray, change: Numbers) -> None:
        """Cut the last step back to a time within it, and go on from there with other numbers in the equations.

        Parameters
        ----------
        point : (float, Rows, int, ...)
            The time, and where the values there stand.
        cells : ndarray
            Places in the table of numbers.
        change : (ndarray, bool, bool, bool, bool, bool, bool, bool)
            What is to stand there; whether that only acts as loads do, which leave the matrix as it is; whether
            equations change at the time, and whether the change grows with the time; whether it prescribes a motion,
            which is nothing here; whether it is not known what it would have done to the past; whether the matrix may
            change; and whether velocities jump, which is nothing here.
        """
        st, kept = self.state, True
        t, rows, row, *_ = point
        values, loads, jumps, leads, _, unsure, bent, _ = change
        y, yp = rows.y[row], rows.yp[row]
        if self.last_records.changed_at == st.steps or (self._given is not None and self._given[0] == st.steps):
            last = self.last_step()
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
        self._pass_jump(
            self.functions,
            st,
            self.plan,
            self.factors,
            t,
            y,
            yp,
            cells,
            values,
            jumps,
            leads,
            kept and not unsure,
            bent,
            -1,
            0.0,
            self._scratch,
        )
        if not kept:
            self.last_records.forget_changes()
        self._given, self._jumped = None, (int(st.steps), t, rows, row)
        if self.problem.events is not None and st.n_events:
            untold, passed = self._just_passed(t)
            self.crossings = [(t, e) for e in untold]
            self.problem.events(t, st.y, st.yp, st.g_old, st.idata, st.rdata, st.work)
            # what has just passed does so once, on whichever side its value is by rounding
            st.g_old[passed] = 0.0

    def steer(self, point: tuple, first: int, count: int, value: float, end: float) -> int | None:
        """Do the same for an input that only loads depend on, by its places; return what `jumps.steer` does.

        None where that has to be done by `change`.
        """
        steps = self._steered_behind()
        if not steps:
            return None
        t, rows, row = point[0], point[1], point[2]
        at = row if rows is self.rows else self._copied(rows, row)
        code = self._steer_on(self.at, t, at, first, count, value, end)
        if code & CHANGED:
            self._given, self._jumped = None, (steps, t, rows, row)
        return code

    def steer_to(
        self, point: tuple, first: int, count: int, value: float, hold: int, t: float, keep: bool
    ) -> tuple[int, int] | None:
        """Steer, at ``t`` with ``hold`` and else at once, and go on to ``t``, in one compiled call.

        Returns
        -------
        (int, int)
            What `steer` returns, and what `standing.go_next` does; None where it cannot be done so.
        """
        t_now, rows, at, _ = point
        # at most points nothing is known of the last step that its coordinates could contradict
        plain = self._given is None and self.last_records.changed_at < 0 and self.quick
        steps = self.state.steps if plain else self._steered_behind()
        if not steps or rows is not self.rows:
            return None
        done = self._steer_next(self.at, t_now, at, first, count, value, hold, t, keep)
        if done & CHANGED:
            self._given, self._jumped = None, (steps, t_now, rows, at)
        return done & 3, (done >> 2) - AHEAD

    def _steered_behind(self) -> int:
        """Return the steps behind which an input can be steered by compiled code, 0 where it cannot."""
        st, given = self.state, self._given
        steps = st.steps
        if not steps or st.n_events:
            return 0
        told = self.last_records.changed_at == steps or (given is not None and given[0] == steps)
        return 0 if told and not np.array_equal(self.last_step().idata, st.idata) else steps

    def _copied(self, rows: Rows, row: int) -> int:
        """Copy a point of earlier rows to where the next one is going to be written; return that row."""
        at = self.row
        self.rows.y[at], self.rows.yp[at] = rows.y[row], rows.yp[row]
        return at

    def history(self, equations: str, point: tuple) -> History:
        """Return what the next steps of these equations depend on, at a point of the last step."""
        steps, given, jumped = self.state.steps, self._given, self._jumped
        told = self.last_records.changed_at == steps or (given and given[0] == steps)
        told = told or (jumped and jumped[0] == steps)
        row = point[2] if point[1] is self.rows else self._copied(point[1], point[2])
        held = Held(self, row, self.last_step() if told else None)
        return History.made(self.options.method, held, self.plan, equations, self.options.tol)

    def pack(self, row: int, block: np.ndarray) -> int:
        """Copy what the next steps depend on, and the point in a row; return the order of the last step."""
        return self._pack(self.at, row, block)

    def unpack(self, row: int, order: int, block: np.ndarray) -> None:
        """Put that back, and stand behind the last step, of an order, or 0 where it is given."""
        self._find_factors()
        self._unpack(self.at, row, order, block)

    def put_back(self, history: History) -> None:
        """Go on with a history; the tables are those of its state."""
        self.pivots, last = put_memory(self, history)
        self._find_factors()
        self.last_records.forget_changes()
        direct(stand_behind)(self.state, 0)
        self._stand_behind(last)
        self._find_crossings(float(self.problem.t0))

    def go_back(self, history: History) -> tuple[Rows, int] | None:
        """Go on with a history of this run, in place and with its tables, if it is one that can be.

        Returns
        -------
        (Rows, int) or None
            Where its point stands until the next but one.
        """
        held = history.numbers
        if not (isinstance(held, Held) and held.belongs_to(self)):
            return None
        rows, row, given = self.rows, self.row, held.given
        held.put_back(self, row)
        self.last_records.forget_changes(held.table)
        self._stand_behind(given)
        self.table = held.table if given is None else given.idata
        if self.crossings or held.crossings:
            self.crossings = list(held.crossings)
        self.told = dict(held.told)
        self._stand(False)
        return rows, row

    def _stand_behind(self, last: LastStep | None) -> None:
        """Stand behind the last step, which may be given."""
        steps = self.state.steps
        self._standing.look_at = steps + LOOK
        if self._watched:
            self.stall, self._watched = StallWatch(steps, self.state.t), False
        else:
            self.stall.steps, self.stall.t = steps, self.state.t
        self._given, self._jumped = None if last is None else (steps, last), None

    def last_step(self) -> LastStep:
        """Return the last step as values within it are told."""
        st = self.state
        if self._given is None or self._given[0] != st.steps:
            if self._jumped is not None and self._jumped[0] == st.steps:
                _, t, rows, row = self._jumped
                y = rows.y[row].copy()
                last = LastStep(np.array([t]), y[None, :], y, rows.yp[row].copy(), self.last_records.table)
            elif st.steps:
                last = self.last_records.last_step()
            else:
                last = LastStep(np.array([st.t]), st.y[None, :].copy(), st.y.copy(), st.yp.copy(), st.idata.copy())
            self._given = int(st.steps), last
        return self._given[1]
