"""One integration: the Python side of the compiled loop.

The loop in `gearmbs.dae.integrators.step` does the work; here a run is set up, driven in chunks so that Ctrl-C and
progress work, helped out when new pivots are needed, and turned into a `DAEResult`.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.bound_functions import bind
from gearmbs.dae.integrators import messages, start
from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.arguments import check_choices, event_rules, output_times
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.history import newest_point
from gearmbs.dae.integrators.newton_matrix import SLOPE_MAX_AGE
from gearmbs.dae.integrators.rounding import rounding_level
from gearmbs.dae.integrators.step import advance
from gearmbs.dae.integrators.weights import set_weights
from gearmbs.dae.linalg.sparse_lu import (
    GROWTH_LIMIT,
    LUFactors,
    LUPlan,
    SingularMatrixError,
    analyse,
    factor,
    new_factors,
)
from gearmbs.dae.problem import EVENTS_SIG, HOOK_SIG, DAEProblem
from gearmbs.dae.result import DAEResult, DenseOutput, SolverStats, Status

NEWTON_TOLERANCE = 1.0
FIRST_CHUNK = 256
CHUNK_SECONDS = 0.05
RECORD_BYTES = 8_000_000
CONSUMED_BYTES = 500_000
"""Of steps handed to a consumer at a time: what stays in the processor's cache."""

Consumer = Callable[[np.ndarray, np.ndarray, np.ndarray], None]
"""Takes t, y of some accepted steps and the integer table valid there; the arrays are valid during the call only."""
EVENT_BUFFER = 64
SINGULAR_RETRIES = 8
DROP_ROUNDS_ALLOWED = 3
UNSATISFIED = 1e-3
"""Part of its terms by which an equation set aside may be off at the end of a run."""
DROP_TOLERANCES = (0.0, 1e-9, 1e-7, 1e-5)


@njit(HOOK_SIG, cache=True, nogil=True, error_model="numpy")
def no_hook(t, hist, npast, idata, rdata, work):
    """Stand in for a problem without a hook."""
    return 0


@njit(EVENTS_SIG, cache=True, nogil=True, error_model="numpy")
def no_events(t, y, yp, out, idata, rdata, work):
    """Stand in for a problem without events."""


class Run:
    """One integration that can be driven, interrupted and resumed.

    Parameters are those of `solve_wstiff`.
    """

    def __init__(
        self,
        problem: DAEProblem,
        t_eval: np.ndarray | None,
        *,
        t_end: float | None,
        tol: float,
        rtol: float,
        method: str,
        corrector: str,
        max_order: int,
        max_step: float,
        first_step: float | None,
        min_step: float | None,
        max_iterations: int,
        interpolate: bool,
        breakpoints: Sequence[float],
        event_direction: Sequence[int] | None,
        event_action: Sequence[int] | None,
        event_count: Sequence[int] | None,
        dense_output: bool,
        slopes: bool,
        max_steps: int | None,
        progress: Callable[[float], None] | None,
        check_start: bool,
        error_probe: Callable[[], BaseException | None] | None,
        consumer: Consumer | None,
    ):
        self.problem = problem
        self.progress = progress
        self.consumer = consumer
        self.consumed_time = 0.0
        self.error_probe = error_probe
        self.check_start = check_start
        self.dense_output = dense_output
        self.slopes = slopes
        self.wall_time = 0.0
        self.repivots = 0
        self.first_pivots = 0
        self.started = False
        self.start_note = ""
        self.steps_given = (False, False)
        t0 = float(problem.t0)
        outputs, t_end = output_times(t_eval, t0, t_end)
        self.every_step = t_eval is None
        check_choices(tol, rtol, method, corrector, max_order, max_step, first_step, min_step, max_iterations)
        n = problem.n
        keep = self.every_step or dense_output
        size = RECORD_BYTES if consumer is None else CONSUMED_BYTES
        rows = int(np.clip(size // (8 * n), 8 * HISTORY, 8192)) if keep else 8192
        n_events = int(problem.n_events) if problem.events is not None else 0

        y0 = np.array(problem.y0, dtype=float)
        yp0 = np.array(problem.yp0, dtype=float)
        atol = tol * np.asarray(problem.atol_scale, dtype=float)
        if not (atol > 0).all():
            raise ValueError(f"atol_scale must be positive, is {problem.atol_scale[int(np.argmin(atol))]:g} somewhere")
        controlled = np.array(problem.error_mask, dtype=float)
        differential = np.array(problem.differential, dtype=float)
        tested = controlled.copy() if corrector == "modified" else np.ones(n)
        coupled = np.maximum(controlled, differential)
        directions, actions, left = event_rules(n_events, event_direction, event_action, event_count)
        crossings = EVENT_BUFFER + n_events
        st = s.new_state(
            n,
            len(problem.indices),
            y=y0.copy(),
            yp=yp0.copy(),
            yp_start=yp0.copy(),
            atol=atol,
            controlled=controlled,
            tested=tested,
            differential=differential,
            coupled=coupled,
            idata=np.array(problem.idata, dtype=np.int64),
            rdata=np.array(problem.rdata, dtype=float),
            work=np.zeros(max(1, problem.work_size)),
            stops=np.array(sorted(b for b in breakpoints if t0 < b < t_end), dtype=float),
            outputs=outputs,
            y_out=np.empty((len(outputs), n)),
            yp_out=np.empty((len(outputs), n)),
            record_t=np.zeros(rows),
            record_h=np.zeros(rows),
            record_order=np.zeros(rows, dtype=np.int64),
            record_y=np.zeros((rows if keep else 1, n)),
            g_old=np.zeros(max(1, n_events)),
            g_new=np.zeros(max(1, n_events)),
            event_direction=directions,
            event_action=actions,
            event_left=left,
            crossing_t=np.zeros(crossings),
            crossing_event=np.zeros(crossings, dtype=np.int64),
            crossing_y=np.zeros((crossings if n_events else 1, n)),
        )
        self.state = st
        newest_point(st)[:] = y0
        st.window_t[st.newest] = t0
        st.t_end = t_end
        st.h_max = max_step
        st.rtol = rtol
        st.newton_tolerance = NEWTON_TOLERANCE
        st.max_order = max_order
        st.max_iterations = max_iterations
        st.max_steps = max_steps or 0
        st.n_events = n_events
        st.fixed_leading = method == "GSTIFF"
        st.interpolate = interpolate
        st.has_hook = problem.hook is not None
        st.keep_rows = keep
        st.step_in_weights = bool((tested > coupled).any())
        st.t = t0
        st.order = 1
        st.n_past = 1
        st.gamma_factored = 1.0
        st.matrix_wanted = True
        st.slope_age = SLOPE_MAX_AGE
        set_weights(st, newest_point(st), 1.0)
        start.choose_steps(self, first_step, min_step)
        self.indptr = np.asarray(problem.indptr, dtype=np.int64)
        self.indices = np.asarray(problem.indices, dtype=np.int64)
        self.scale = np.asarray(problem.scale, dtype=float)
        self.functions = bind(
            problem.residual,
            problem.jacobian,
            problem.hook if problem.hook is not None else no_hook,
            problem.events if n_events else no_events,
        )
        self.plan: LUPlan | None = None
        self.factors: LUFactors | None = None

        self.records: list[tuple[np.ndarray, ...]] = []
        self.row_blocks: list[np.ndarray] = []
        self.hits: list[tuple[float, int, np.ndarray]] = []
        self.epochs: list[tuple[int, np.ndarray]] = [(0, st.idata.copy())]
        self.accepted_rows = 1
        st.n_records = 1
        st.record_t[0] = t0
        st.record_y[0] = y0
        if len(outputs) and outputs[0] == t0:
            st.y_out[0] = y0
            st.yp_out[0] = yp0
            st.next_output = 1

    def repivot(self) -> tuple[Status, str] | None:
        """Choose new pivots for the current Newton matrix; return a failure or None."""
        st, problem = self.state, self.problem
        t = float(st.t)
        self.repivots += 1
        bad = np.flatnonzero(~np.isfinite(st.matrix))
        retry = st.steps > 0 and st.singular_fails < SINGULAR_RETRIES
        if len(bad):
            if retry:
                self._retry_smaller()
                return None
            return Status.NOT_FINITE, messages.not_finite(
                problem, t, int(self.indices[bad[0]]), "the Jacobian of equation"
            )
        try:
            drop = DROP_TOLERANCES[st.drop_level]
            self.plan = analyse(self.indptr, self.indices, st.matrix, self.scale, drop)
        except SingularMatrixError as error:
            if st.steps > 0 and st.drop_rounds < DROP_ROUNDS_ALLOWED:
                st.drop_rounds += 1
                st.drop_level = 1
                st.drop_age = 0
                return self.repivot()
            return Status.SINGULAR_JACOBIAN, messages.singular(problem, t, error.rows, error.cols)
        if st.drop_level == 0:
            st.drop_rounds = 0
        self.factors = new_factors(self.plan)
        growth = factor(self.plan, self.factors, st.matrix)
        st.factorizations += 1
        st.growth_limit = max(GROWTH_LIMIT, 100.0 * growth)
        return None

    def _unsatisfied(self) -> tuple[Status, str] | None:
        """Return a failure if equations that were set aside at a singular position do not hold at the end."""
        st, problem = self.state, self.problem
        assert self.plan is not None
        problem.residual(st.t, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
        terms = np.zeros(problem.n)
        np.add.at(terms, self.indices, np.abs(st.matrix * np.repeat(st.y, np.diff(self.indptr))))
        left = self.plan.kept == 0.0
        rows, cols = self.plan.row_from[left], self.plan.col_to[left]
        if (np.abs(st.res[rows]) <= UNSATISFIED * terms[rows]).all():
            return None
        return Status.SINGULAR_JACOBIAN, messages.singular(problem, float(st.t), rows, cols)

    def _retry_smaller(self) -> None:
        """Move the end of the step off a singular position."""
        self.state.singular_fails += 1
        self.state.h *= 0.6

    def user_exception(self) -> BaseException | None:
        return self.error_probe() if self.error_probe is not None else None

    def user_failure(self) -> tuple[Status, str]:
        error = self.user_exception() or RuntimeError("unknown")
        if isinstance(error, KeyboardInterrupt):
            return Status.INTERRUPTED, self._interrupted_message()
        return Status.USER_ERROR, messages.user_error(float(self.state.t), error)

    def _interrupted_message(self) -> str:
        return f"{Status.INTERRUPTED.sentence} Reached t = {self.state.t:.9g}."

    def _drain(self) -> None:
        """Take the records and crossings out of the buffers of the compiled loop."""
        st = self.state
        m = int(st.n_records)
        if m:
            self.records.append((st.record_t[:m].copy(), st.record_h[:m].copy(), st.record_order[:m].copy()))
            if self.consumer is not None:
                self._hand_over(m)
            elif st.keep_rows:
                self.row_blocks.append(st.record_y[:m].copy())
            st.n_records = 0
        for e in range(int(st.n_crossings)):
            self.hits.append((float(st.crossing_t[e]), int(st.crossing_event[e]), st.crossing_y[e].copy()))
        st.n_crossings = 0

    def _hand_over(self, m: int) -> None:
        """Give the steps among the first m records to the consumer; keep the last of them for the result."""
        assert self.consumer is not None
        st = self.state
        is_step = st.record_order[:m] > 0
        # the start is an output, too
        is_step[0] |= len(self.records) == 1
        if not is_step.any():
            return
        whole = bool(is_step.all())
        t, y = (st.record_t[:m], st.record_y[:m]) if whole else (st.record_t[:m][is_step], st.record_y[:m][is_step])
        begin = time.perf_counter()
        self.consumer(t, y, self.epochs[-1][1])
        self.consumed_time += time.perf_counter() - begin
        self.row_blocks = [y[-1:].copy()]

    def drive(self) -> DAEResult:
        """Run to the end, a failure or an interruption, and return everything computed so far."""
        begin = time.perf_counter()
        with InterruptFlag() as interrupt:
            status, message = self._loop(interrupt)
        self.wall_time += time.perf_counter() - begin - self.consumed_time
        self._drain()
        self.consumed_time = 0.0
        return self._result(status, message)

    def _loop(self, interrupt: InterruptFlag) -> tuple[Status, str]:
        st = self.state
        if not self.started:
            failure = start.begin(self)
            if self.user_exception() is not None:
                return self.user_failure()
            if failure is not None:
                return failure
            self.started = True
        chunk = FIRST_CHUNK
        while True:
            tic = time.perf_counter()
            code = advance(self.functions, st, self.plan, self.factors, chunk)
            if self.user_exception() is not None:
                return self.user_failure()
            if code == s.DONE:
                self._report()
                failure = self._unsatisfied() if st.drop_level else None
                if failure is not None:
                    return failure
                return Status.SUCCESS, f"{Status.SUCCESS.sentence}{self.start_note}"
            if code == s.TERMINAL:
                return (
                    Status.TERMINAL_EVENT,
                    f"{Status.TERMINAL_EVENT.sentence} t = {st.t:.9g}.{self.start_note}",
                )
            if code == s.PAUSED:
                if self.consumer is not None:
                    # what was stored so far belongs to the old table
                    self._drain()
                first = self._accepted_so_far() if self.every_step else int(st.next_output)
                self.epochs.append((first, st.idata.copy()))
            elif code == s.REPIVOT:
                failure = self.repivot()
                if self.user_exception() is not None:
                    return self.user_failure()
                if failure is not None:
                    return failure
            elif code == s.BUFFER_FULL:
                self._drain()
                if self.consumer is not None:
                    # its buffer is smaller than a chunk of steps
                    self._report()
            elif code < 0:
                return self._failure(code)
            if interrupt.raised:
                return Status.INTERRUPTED, self._interrupted_message()
            if code == s.RUNNING:
                self._report()
                elapsed = time.perf_counter() - tic
                if elapsed < 0.5 * CHUNK_SECONDS:
                    chunk *= 2
                elif elapsed > 2.0 * CHUNK_SECONDS and chunk > 1:
                    chunk //= 2

    def _accepted_so_far(self) -> int:
        return 1 + int(self.state.steps)

    def _report(self) -> None:
        if self.progress is not None:
            self.progress(float(self.state.t))

    def _failure(self, code: int) -> tuple[Status, str]:
        st, problem = self.state, self.problem
        t = float(st.t)
        h = float(st.h)
        worst = int(st.worst)
        status = Status(code)  # type: ignore[call-arg]
        if status is Status.NOT_FINITE and worst < 0:
            return status, messages.event_not_finite(problem, t, -1 - worst)
        if status is Status.NOT_FINITE:
            return status, messages.not_finite(problem, t, worst)
        if status is Status.STEP_TOO_SMALL:
            worst = int(st.worst_error)
            told = messages.step_too_small(problem, t, h, worst, float(st.error), self._noise())
            return status, told
        if status is Status.NEWTON_FAILURE:
            return status, messages.newton(problem, t, h, worst, self._noise())
        if status is Status.TOO_MANY_STEPS:
            return status, messages.too_many_steps(problem, t, int(st.steps))
        return status, messages.too_many_rejections(problem, t, h, worst, self._noise())

    def _noise(self) -> float:
        """Return how far rounding alone moves the solution where the run stopped, in units of the tolerance."""
        st = self.state
        if self.plan is None or self.factors is None or not np.isfinite(st.y).all():
            return 0.0
        level = float(rounding_level(st, self.plan, self.factors))
        return level if np.isfinite(level) else 0.0

    def _stats(self, wall_time: float) -> SolverStats:
        return SolverStats(
            steps=int(self.state.steps),
            error_rejections=int(self.state.error_rejections),
            newton_rejections=int(self.state.newton_rejections),
            residuals=int(self.state.residuals),
            jacobians=int(self.state.jacobians),
            factorizations=int(self.state.factorizations),
            solves=int(self.state.solves),
            repivots=max(0, self.repivots - self.first_pivots),
            noise_limited=int(self.state.noise_limited),
            wall_time=wall_time,
        )

    def _result(self, status: Status, message: str) -> DAEResult:
        st, problem = self.state, self.problem
        t, h, order = (np.concatenate(parts) for parts in zip(*self.records, strict=True))
        is_step = order > 0
        stats = self._stats(self.wall_time)
        stats.t_steps, stats.h_steps, stats.orders = t[is_step], h[is_step], order[is_step]
        consumed = self.consumer is not None
        rows = np.concatenate(self.row_blocks) if self.row_blocks else None
        sol = DenseOutput(t, rows, order) if rows is not None and not consumed else None
        if consumed and rows is not None:
            t_out, y_out, yp_out = t[np.append(0, np.flatnonzero(is_step))[-1:]], rows, np.empty((0, problem.n))
        elif self.every_step:
            t_out = np.concatenate((t[:1], t[is_step]))
            if sol is None or rows is None:
                raise AssertionError("every step was to be kept")
            ends = np.concatenate(([0], np.flatnonzero(is_step)))
            # the rows themselves where nothing but steps was stored
            y_out, yp_out = rows if ends.size == len(rows) else rows[ends], np.empty((0, problem.n))
            if self.slopes:
                yp_out = sol.derivative(t_out)
                yp_out[0] = problem.yp0
        else:
            m = int(st.next_output)
            t_out, y_out, yp_out = st.outputs[:m], st.y_out[:m], st.yp_out[:m]
            if status is not Status.SUCCESS:
                # the run may go on, or the arrays are mostly empty; those of a finished run are handed over as they are
                t_out, y_out, yp_out = t_out.copy(), y_out.copy(), yp_out.copy()
        n_events = int(st.n_events)
        return DAEResult(
            t=t_out,
            y=y_out,
            yp=yp_out,
            status=status,
            message=message,
            stats=stats,
            sol=sol if self.dense_output else None,
            t_events=[np.array([hit[0] for hit in self.hits if hit[1] == e]) for e in range(n_events)],
            y_events=[
                np.array([hit[2] for hit in self.hits if hit[1] == e]).reshape(-1, problem.n) for e in range(n_events)
            ],
            epochs=[(0 if consumed else first, table.copy()) for first, table in self.epochs[-1 if consumed else 0 :]],
            t_last=float(st.t),
            checkpoint=self if status in (Status.INTERRUPTED, Status.TOO_MANY_STEPS) else None,
        )


class InterruptFlag:
    """Turn Ctrl-C into a flag while a run is under way, in the main thread only."""

    raised = False

    def __enter__(self) -> InterruptFlag:
        self._previous = None
        if threading.current_thread() is threading.main_thread():
            self._previous = signal.signal(signal.SIGINT, self._raise)
        return self

    def _raise(self, *_args) -> None:
        self.raised = True

    def __exit__(self, *_args) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)
