"""What a run has put into its buffers, collected in Python and made a `DAEResult`."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from gearmbs.dae.integrators.algebraic.between import UNRESOLVED, follow, settle_on_steps
from gearmbs.dae.integrators.algebraic.outputs import AlgebraicOutputs
from gearmbs.dae.integrators.messages import unresolved
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.run_state import RunState
from gearmbs.dae.linalg.lu_plan import SingularMatrixError, analyse
from gearmbs.dae.linalg.sparse_lu import factor, new_factors, solve
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult, DenseOutput, SolverStats, Status
from gearmbs.kernels.bound import trying
from gearmbs.kernels.pointers import direct
from gearmbs.wording import warn

START_STEPS = 20
"""Steps, the longest of which is taken for the size of steps at the start: after some ten they have grown to it."""


def warn_of_unresolved(
    algebraic: AlgebraicOutputs, t: np.ndarray, y: np.ndarray, yp: np.ndarray, table_of: Callable[[int], np.ndarray]
) -> str:
    """Warn of outputs that show what no step has seen, as a pulse between two of them; return what is said.

    Algebraic unknowns solved for at an output may be far off the polynomial of the step and right: a read-out of a
    differential unknown may do anything between two steps. The corrector of a step that ended at the output tells
    whether it concerns the differential ones, by how far it would move them.

    Parameters
    ----------
    algebraic : AlgebraicOutputs
        Which remembers the outputs that are the furthest off, and forgets them.
    t : ndarray, shape (m,)
        Output times, increasing or not.
    y, yp : ndarray, shape (m, n)
        Outputs, with the rates of the polynomials.
    table_of : callable
        The integer table that is valid at output i.
    """
    part, problem = algebraic.part, algebraic.problem
    worst, told = UNRESOLVED, ""
    for k in np.flatnonzero(part.moved):
        at = np.flatnonzero(t == part.moved_at[k])
        if not at.size:
            # an event has cut the step before this output
            continue
        i = int(at[0])
        h, unknown = float(part.moved_step[k]), int(part.cols[part.moved_of[k]])
        off = _corrections(problem, float(t[i]), y[i], yp[i], h, (table_of(i), part.moved_rdata[k]))
        off *= problem.error_mask & problem.differential
        off /= part.atol + part.rtol * np.abs(y[i])
        j = int(np.argmax(off))
        if off[j] > worst:
            worst = off[j]
            told = unresolved(problem, t[i], h, unknown, y[i, unknown], j, worst)
    part.moved[:] = 0.0
    if told:
        warn(told)
    return told


def remark_on_unresolved(algebraic: AlgebraicOutputs, result: DAEResult) -> None:
    """Warn of outputs of a run that show what no step has seen, and add it to the message."""
    told = warn_of_unresolved(algebraic, result.t, result.y, result.yp, result.epoch_of)
    if told:
        result.message = f"{result.message} {told}"


def _corrections(
    problem: DAEProblem, t: float, y: np.ndarray, yp: np.ndarray, h: float, valid: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return by how much a Newton iteration of a step of size ``h`` to ``t`` moves each unknown, zero if it cannot."""
    res, vals = np.zeros(problem.n), np.zeros(len(problem.indices))
    tables = *(table.copy() for table in valid), np.zeros(problem.work_size)
    problem.residual(t, y, yp, res, *tables)
    problem.jacobian(t, y, yp, 1.0 / h, vals, *tables)
    none = np.zeros(problem.n)
    if not (np.isfinite(res).all() and np.isfinite(vals).all()):
        return none
    indptr, indices = (np.asarray(a, dtype=np.int64) for a in (problem.indptr, problem.indices))
    try:
        plan = analyse(indptr, indices, vals, np.asarray(problem.scale, dtype=float))
    except SingularMatrixError:
        return none
    factors, delta = new_factors(plan), np.zeros(problem.n)
    direct(factor)(plan, factors, vals)
    direct(solve)(plan, factors, res, delta)
    return np.abs(delta) if np.isfinite(delta).all() else none


class Records:
    """Steps and crossings of one run, from its start on.

    Parameters
    ----------
    problem : DAEProblem
    st : RunState
        With the start as its first record.
    options : Options
    every_step : bool
        Whether outputs are wanted at every step.
    algebraic : AlgebraicOutputs
        What is solved for at outputs.
    """

    def __init__(
        self, problem: DAEProblem, st: RunState, options: Options, every_step: bool, algebraic: AlgebraicOutputs
    ) -> None:
        self.algebraic = algebraic
        self.problem = problem
        self.state = st
        self.options = options
        self.every_step = every_step
        self.consumed_time = 0.0
        self.processor_time = 0.0
        """Processor time of the consumer, s."""
        self.steps: list[tuple[np.ndarray, ...]] = []
        self.row_blocks: list[np.ndarray] = []
        self.crossings: list[tuple[float, int, np.ndarray]] = []
        self.epochs: list[tuple[int, np.ndarray]] = [(0, st.idata.copy())]
        self.tables: list[tuple[float, np.ndarray]] = [(st.t, self.epochs[0][1])]

    def drain(self) -> None:
        """Take records and crossings out of the buffers of the compiled loop."""
        st = self.state
        m = st.n_records
        if m:
            if self.options.consumer is not None:
                self._hand_over(m)
            else:
                self.steps.append((st.record_t[:m].copy(), st.record_h[:m].copy(), st.record_order[:m].copy()))
                if st.keep_rows:
                    self.row_blocks.append(st.record_y[:m].copy())
            st.n_records = 0
        for e in range(st.n_crossings):
            self.crossings.append((float(st.crossing_t[e]), int(st.crossing_event[e]), st.crossing_y[e].copy()))
        st.n_crossings = 0

    def _hand_over(self, m: int) -> None:
        """Give the steps among the first m records to the consumer; keep the last of them for the result."""
        assert self.options.consumer is not None
        st = self.state
        is_step = st.record_order[:m] > 0
        # the start is an output, too
        is_step[0] |= not self.steps
        if not is_step.any():
            return
        whole = bool(is_step.all())
        t, y = (st.record_t[:m], st.record_y[:m]) if whole else (st.record_t[:m][is_step], st.record_y[:m][is_step])
        begin, busy = time.perf_counter(), time.thread_time()
        self.options.consumer(t, y, self.epochs[-1][1])
        self.processor_time += time.thread_time() - busy
        self.consumed_time += time.perf_counter() - begin
        last = np.flatnonzero(is_step)[-1:]
        self.steps = [(st.record_t[last], st.record_h[last], st.record_order[last])]
        self.row_blocks = [y[-1:].copy()]

    def change_table(self) -> None:
        """Note that another integer table is valid from here on."""
        st = self.state
        if self.options.consumer is not None:
            # what was stored so far belongs to the old table
            self.drain()
        self.epochs.append((1 + st.steps if self.every_step else st.next_output, st.idata.copy()))
        self.tables.append((st.t, self.epochs[-1][1]))

    def result(self, status: Status, message: str, stats: SolverStats) -> DAEResult:
        """Return everything computed so far; histories of steps are put into ``stats``."""
        st, n = self.state, self.problem.n
        t, h, order = (np.concatenate(parts) for parts in zip(*self.steps, strict=True))
        is_step = order > 0
        # the start comes first, and mostly nothing but steps after it
        taken = slice(1, None) if is_step[1:].all() and not is_step[0] else is_step
        consumed = self.options.consumer is not None
        if not consumed:
            stats.t_steps, stats.h_steps, stats.orders = t[taken], h[taken], order[taken]
        rows = np.concatenate(self.row_blocks) if self.row_blocks else None
        sol = None
        if rows is not None and not consumed:
            between = Between(self.algebraic, self.tables, st, self.options) if self.algebraic.is_needed else None
            sol = DenseOutput(t, rows, order, between)
        outputs: tuple[np.ndarray, np.ndarray, np.ndarray]
        if consumed and rows is not None:
            outputs = t, rows, np.empty((0, n))
        elif self.every_step:
            assert rows is not None
            assert sol is not None
            outputs = self._at_steps(t, is_step, rows, sol)
        else:
            m = st.next_output
            self._settle_start()
            outputs = st.outputs[:m], st.y_out[:m], st.yp_out[:m]
            if status is not Status.SUCCESS:
                # the run may go on, or the arrays are mostly empty; those of a finished run are handed over as they are
                outputs = outputs[0].copy(), outputs[1].copy(), outputs[2].copy()
        t_out, y_out, yp_out = outputs
        by_event = [[hit for hit in self.crossings if hit[1] == e] for e in range(st.n_events)]
        remark = "" if self.every_step and not self.options.dense_output else self.algebraic.remark()
        result = DAEResult(
            t=t_out,
            y=y_out,
            yp=yp_out,
            status=status,
            message=f"{message} {remark}" if remark else message,
            stats=stats,
            sol=sol if self.options.dense_output else None,
            t_events=[np.array([hit[0] for hit in hits]) for hits in by_event],
            y_events=[np.array([hit[2] for hit in hits]).reshape(-1, n) for hits in by_event],
            epochs=[(0 if consumed else first, table.copy()) for first, table in self.epochs[-1 if consumed else 0 :]],
            counted=st.kept_out[: len(t_out)].copy() if len(st.kept) and not (consumed or self.every_step) else None,
            t_last=st.t,
        )
        remark_on_unresolved(self.algebraic, result)
        return result

    def _settle_start(self) -> None:
        """Settle the output at the start, whose algebraic unknowns the caller may have guessed."""
        st = self.state
        if self.algebraic.is_needed and st.next_output and st.outputs[0] == self.problem.t0 and st.steps:
            # the first steps are far shorter than what changes
            first = float(self.steps[0][1][:START_STEPS].max()) or st.step
            self.algebraic.settle_start(st.outputs[0], st.y_out[0], st.yp_out[0], first, self.tables[0][1], st.stops)

    def _at_steps(
        self, t: np.ndarray, is_step: np.ndarray, rows: np.ndarray, sol: DenseOutput
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return time, unknowns and rates at the start and at the end of every step."""
        ends = np.concatenate(([0], np.flatnonzero(is_step)))
        t_out = t[ends]
        # the rows themselves where nothing but steps was stored
        y_out = rows if ends.size == len(rows) else rows[ends]
        if not self.options.slopes:
            return t_out, y_out, np.empty((0, self.problem.n))
        # where a run has failed the user's functions may not be defined beside its last step
        with trying():
            yp_out = sol.derivative(t_out)
        yp_out[0] = self.problem.yp0
        return t_out, y_out, yp_out


class Between:
    """Solves for algebraic unknowns at any time of a run, for its dense output.

    Parameters
    ----------
    algebraic : AlgebraicOutputs
    tables : list of (float, ndarray)
        Times, and the integer tables that are valid from there on.
    st : RunState
        At the end of the run, with its breakpoints.
    options : Options
        With tolerances, and what tells that a function of the user has failed.
    """

    def __init__(
        self,
        algebraic: AlgebraicOutputs,
        tables: list[tuple[float, np.ndarray]],
        st: RunState,
        options: Options,
    ) -> None:
        self.algebraic = algebraic
        self.stops = st.stops.copy()
        self.tables = list(tables)
        self.starts = np.array([t for t, _ in tables])
        problem = algebraic.problem
        self.keeps = problem.hook is not None and not np.array_equal(problem.rdata, st.rdata)
        """Whether the hook keeps something in the table of numbers, which has to be followed from step to step."""
        self.rdata = problem.rdata.copy()
        self.seen = 0
        self.errors = options.errors
        part = algebraic.part
        self.unknowns = np.unique(part.cols[part.rates == 0])
        self.atol, self.rtol = part.atol[self.unknowns], part.rtol

    def __call__(self, times, ends, orders, nodes, rows, y, yp) -> None:
        """Write y and y' at times between steps; arguments are those of `evaluate_many`.

        Raises
        ------
        Exception
            What a function of the user has raised.
        """
        order = np.argsort(times, kind="stable")
        valid = np.maximum(np.searchsorted(self.starts, times, side="left") - 1, 0)
        pieces = np.searchsorted(self.stops, times, side="left")
        among, problem = self.algebraic.part, self.algebraic.problem
        functions, work = self.algebraic.functions, np.zeros(problem.work_size)
        for k, piece in sorted({*zip(valid.tolist(), pieces.tolist())}):
            mine = order[(valid[order] == k) & (pieces[order] == piece)]
            among.t_first = self.stops[piece - 1] if piece > 0 else among.t_start
            among.t_last = self.stops[piece] if piece < len(self.stops) else among.t_end
            self._follow(functions, int(ends[mine[0]]) - 1, orders, nodes, rows)
            part, slopes = y[mine], yp[mine]
            seen = direct(settle_on_steps)(
                functions, among, times[mine], ends[mine], orders, nodes, rows, part, slopes,
                self.seen if self.keeps else len(rows), self.tables[k][1], self.rdata, work,
            )  # fmt: skip
            self.seen = seen if self.keeps else 0
            y[mine], yp[mine] = part, slopes
        if self.errors:
            raise self.errors.pop()
        warn_of_unresolved(self.algebraic, times, y, yp, lambda i: self.tables[valid[i]][1])

    def _follow(self, functions, last: int, orders: np.ndarray, nodes: np.ndarray, rows: np.ndarray) -> None:
        """Bring the table of numbers to where it was behind row ``last``."""
        if not self.keeps:
            return
        problem = self.algebraic.problem
        if last < self.seen:
            self.rdata[:] = problem.rdata
            self.seen = 0
        work = np.zeros(problem.work_size)
        steps = self.seen + 1 + np.flatnonzero(orders[self.seen + 1 : last + 1] > 0)
        valid = np.maximum(np.searchsorted(self.starts, nodes[steps], side="left") - 1, 0)
        for k in np.unique(valid):
            until = int(steps[valid == k][-1])
            idata = self.tables[k][1]
            self.seen = direct(follow)(functions, orders, nodes, rows, self.seen, until, idata, self.rdata, work)
