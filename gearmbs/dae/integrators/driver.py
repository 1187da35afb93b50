"""One integration: the Python side of the compiled loop.

The loop in `gearmbs.dae.integrators.step` does the work; here a run is set up, driven in chunks so that Ctrl-C and
progress work, helped out when new pivots are needed, and turned into a `DAEResult`.
"""

from __future__ import annotations

import signal
import threading
import time
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from gearmbs.dae.integrators import messages
from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.algebraic.outputs import AlgebraicOutputs
from gearmbs.dae.integrators.branches import has_pole_ahead, stays_on_jump
from gearmbs.dae.integrators.corrector import rounding_level
from gearmbs.dae.integrators.initial_state import begin, choose_steps, initial_state
from gearmbs.dae.integrators.messages import WINDOW, Chatter
from gearmbs.dae.integrators.options import Options, output_times
from gearmbs.dae.integrators.records import Records
from gearmbs.dae.integrators.step import advance
from gearmbs.dae.integrators.stepping.memory import Pivots, continue_run
from gearmbs.dae.linalg.entry_lists import (
    FEWEST_ENTRIES,
    LEAVING_PLANS,
    NEGLIGIBLE,
    NEGLIGIBLE_IN_NEWTON,
    STEPS_A_PLAN,
)
from gearmbs.dae.linalg.left_out import converges_without, signs_of_error
from gearmbs.dae.linalg.lu_plan import LUPlan, SingularMatrixError, analyse, lines_for, parity
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, LUFactors, factor, new_factors, solve
from gearmbs.dae.problem import EPS, DAEProblem
from gearmbs.dae.result import DAEResult, Kept, SolverStats, Status
from gearmbs.kernels.bound import trying
from gearmbs.kernels.placed import bind
from gearmbs.kernels.pointers import address, direct, no_events, no_hook

FIRST_CHUNK = 16
"""Accepted steps, so that the first Ctrl-C is heeded within a second where a step takes 60 ms."""
CHUNK_SECONDS = 0.05
"""Seconds between two looks at Ctrl-C and reports of progress; results do not depend on it."""
SINGULAR_RETRIES = 8
DROP_ROUNDS_ALLOWED = 3
LEAST_DIGITS = 16.0
"""Units of the last digit that a tolerance has to be: differences of order k + 1, by which errors are told, amplify
rounding by 2^k. At 27 oscillators take ten times the steps of a hundredfold tolerance, at 9 some do not end."""
HOPELESS_DIGITS = 4.0
"""The same in the course of a run, where an unknown may have grown."""
UNSATISFIED = 1e-3
"""Part of its terms by which an equation set aside may be off at the end of a run."""
REACHED = Status.SUCCESS, Status.SUCCESS.sentence
"""How a run ends that has come to where it is to pause, or to its end."""
DROP_TOLERANCES = (0.0, 1e-9, 1e-7, 1e-5)


class Run:
    """One integration that can be driven, interrupted and resumed.

    Parameters
    ----------
    problem : DAEProblem
    t_eval : ndarray or None
        Output times; None for outputs at every step.
    t_end : float or None
        End of the run; None for the last of ``t_eval``.
    options : Options
    """

    def __init__(self, problem: DAEProblem, t_eval: np.ndarray | None, t_end: float | None, options: Options) -> None:
        self.problem = problem
        self.options = options
        self.wall_time = 0.0
        self.processor_times = {"steps": 0.0, "pivots": 0.0}
        self.repivots = 0
        self.first_pivots = 0
        self.planned_step = 0.0
        """First step that the present pivots were chosen for, zero for none."""
        self.counted = np.zeros(len(problem.indices), dtype=bool)
        self.started = False
        self.kept: Kept | None = None
        self.next_pause = np.inf if options.pause is None else -np.inf
        self.start_note = problem.start_note
        self.steps_given = options.first_step is not None, options.min_step is not None
        outputs, end = output_times(t_eval, float(problem.t0), t_end)
        every_step = t_eval is None
        self.algebraic = AlgebraicOutputs(problem, problem.atol_scale * options.tol, options.rtol, (problem.t0, end))
        self.state = initial_state(problem, options, outputs, end, every_step or options.dense_output)
        self.state.constrained = self.algebraic.is_constrained
        self.state.left_out &= not options.fixed_pivots
        self.records = Records(problem, self.state, options, every_step, self.algebraic)
        choose_steps(self)
        self.stall = StallWatch(self.state.steps, self.state.t)
        self.indptr = np.asarray(problem.indptr, dtype=np.int64)
        self.indices = np.asarray(problem.indices, dtype=np.int64)
        self.scale = np.asarray(problem.scale, dtype=float)
        self.lines = lines_for(self.indptr, self.indices)
        """Scratch of the search for pivots."""
        self.functions = bind(
            problem.residual,
            problem.jacobian,
            problem.hook if problem.hook is not None else no_hook,
            problem.events if self.state.n_events else no_events,
        )
        self.plan: LUPlan | None = None
        self.factors: LUFactors | None = None
        self.pivots: Pivots | None = None
        if options.history is not None:
            continue_run(self, options.history)

    def repivot(self, stricter: int = 0) -> tuple[Status, str] | None:
        """Choose new pivots for the current Newton matrix; return a failure or None.

        Entries without which the corrector converges are left out, ``stricter`` by as many sizes of them.
        """
        st, problem = self.state, self.problem
        sizes = (*(NEGLIGIBLE_IN_NEWTON if st.left_out else ()), NEGLIGIBLE)
        negligible = sizes[stricter]
        t = st.t
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
            drop, counted = DROP_TOLERANCES[st.drop_level], self._entries_to_leave()
            if stricter and counted is not None:
                # what counts in one matrix does not in all that follow
                counted = counted.copy()
            self.pivots = Pivots(st.matrix.copy(), drop, negligible, None if counted is None else counted.copy())
            self.plan = analyse(
                self.indptr, self.indices, st.matrix, self.scale, drop, counted, negligible,
                with_tail=problem.small_entries, couplings=problem.couplings, modes=problem.modes, lines=self.lines,
            )  # fmt: skip
            st.gamma_planned = st.gamma
            st.plan_sign = direct(parity)(self.plan.row_from) * direct(parity)(self.plan.col_to)
        except SingularMatrixError as error:
            if st.drop_failed and st.singular_fails < SINGULAR_RETRIES:
                self._retry_smaller()
                st.matrix_wanted = True
                # whatever pivots there are belong to another attempt
                st.growth_limit = -1.0
                return None
            if st.steps > 0 and st.drop_rounds < DROP_ROUNDS_ALLOWED:
                st.drop_rounds += 1
                st.drop_level = 1
                st.drop_age = 0
                return self.repivot()
            return Status.SINGULAR_JACOBIAN, messages.singular(problem, t, error.rows, error.cols)
        if st.drop_level == 0:
            st.drop_rounds = 0
        self.factors = new_factors(self.plan)
        growth = direct(factor)(self.plan, self.factors, st.matrix)
        st.factorizations += 1
        st.growth_limit = max(GROWTH_LIMIT, 100.0 * growth)
        if negligible > NEGLIGIBLE:
            solving = address(solve, solve.declared)
            matrix, signs = (self.indptr, self.indices, st.matrix), signs_of_error(problem.n)
            if not direct(converges_without)(solving, self.plan, self.factors, *matrix, signs):
                return self.repivot(stricter + 1)
        return None

    def _entries_to_leave(self) -> np.ndarray | None:
        """Return which entries of the matrix have counted so far, if the others may be left out of a plan."""
        st = self.state
        plans = LEAVING_PLANS + st.steps // STEPS_A_PLAN
        few = len(self.counted) < FEWEST_ENTRIES
        if self.options.fixed_pivots or st.drop_level > 0 or few or self.repivots > plans:
            return None
        return self.counted

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
        return Status.SINGULAR_JACOBIAN, messages.singular(problem, st.t, rows, cols)

    def _retry_smaller(self) -> None:
        """Move the end of the step off a singular position."""
        self.state.singular_fails += 1
        self.state.h *= 0.6

    def user_exception(self) -> BaseException | None:
        return self.options.errors[0] if self.options.errors else None

    def user_failure(self) -> tuple[Status, str]:
        """Return how the run has ended, and let the user's functions be called again, for what it has reached."""
        error = self.user_exception() or RuntimeError("unknown")
        if self.options.errors:
            self.options.errors.clear()
        if isinstance(error, KeyboardInterrupt):
            return Status.INTERRUPTED, self._interrupted_message()
        return Status.USER_ERROR, messages.user_error(self.state.t, error)

    def _interrupted_message(self) -> str:
        return f"{Status.INTERRUPTED.sentence} Reached t = {self.state.t:.9g}."

    def drive(self) -> DAEResult:
        """Run to the end, a failure or an interruption, and return everything computed so far."""
        started = time.perf_counter()
        with InterruptFlag() as interrupt:
            status, message = self._loop(interrupt)
        self.wall_time += time.perf_counter() - started - self.records.consumed_time
        self.records.drain()
        self.records.consumed_time = 0.0
        result = self.records.result(status, message, self._stats())
        result.kept = self.kept
        if status in (Status.INTERRUPTED, Status.TOO_MANY_STEPS):
            result.checkpoint = self
        return result

    def _loop(self, interrupt: InterruptFlag) -> tuple[Status, str]:
        """Call the compiled loop until the run has ended; return how."""
        if not self.started and (failure := self.begin()) is not None:
            return failure
        chunk, st = FIRST_CHUNK, self.state
        while True:
            tic = time.perf_counter()
            few = 1 if self.stall.looking else chunk
            if st.code == s.RUNNING:
                begin_steps = time.thread_time()
                direct(advance)(self.functions, st, self.algebraic.part, self.plan, self.factors, few)
                self.processor_times["steps"] += time.thread_time() - begin_steps
            code, st.code = st.code, s.RUNNING
            ending = self.user_failure() if self.user_exception() is not None else self._heed(code)
            if ending is not None:
                return ending
            if interrupt.raised:
                return Status.INTERRUPTED, self._interrupted_message()
            ending = self._stalled()
            if ending is not None:
                return ending
            if code == s.RUNNING:
                self._report()
                if st.t >= st.t_pause and not self._goes_on():
                    return REACHED
                if few < chunk:
                    continue
                elapsed = time.perf_counter() - tic
                if elapsed < 0.5 * CHUNK_SECONDS:
                    chunk *= 8 if elapsed < CHUNK_SECONDS / 16 else 2
                elif elapsed > 2.0 * CHUNK_SECONDS and chunk > 1:
                    chunk //= 2

    def begin(self) -> tuple[Status, str] | None:
        """Evaluate the equations at the start and choose the first pivots; return a failure or None."""
        failure = begin(self)
        if self.user_exception() is not None:
            return self.user_failure()
        failure = failure or self._below_rounding(LEAST_DIGITS)
        if failure is None:
            self.started = True
            self._goes_on()
        return failure

    def _goes_on(self) -> bool:
        """Return whether the run is to go on beyond a pause; keep the state where that was asked for."""
        st, options = self.state, self.options
        if options.pause is None and options.keep_at == np.inf:
            return False
        if self.kept is None and st.t >= options.keep_at:
            self.kept = Kept(st.t, st.y.copy(), st.yp.copy(), st.idata.copy(), st.rdata.copy())
        if options.pause is not None and st.t >= self.next_pause:
            self.records.drain()
            next_pause = options.pause(st.t)
            if next_pause is None:
                return False
            self.next_pause = next_pause
        st.t_pause = self.next_pause if self.kept is not None else min(self.next_pause, options.keep_at)
        return True

    def _stalled(self) -> tuple[Status, str] | None:
        """Return how the run has ended if it gets nowhere."""
        st, watch = self.state, self.stall
        hopeless = self._below_rounding(HOPELESS_DIGITS)
        if hopeless is not None:
            return hopeless
        needed = watch.steps_needed(st.steps, st.t, st.t_end)
        if needed:
            told = messages.stalled(self.problem, st.t, watch.progress, needed, st.worst_error, self._noise())
            return Status.STALLED, told
        if watch.looking:
            chatter = watch.look(st.t, st.y, st.yp, st.w_error)
            if chatter is not None:
                return Status.STALLED, messages.chatters(self.problem, st.t, chatter)
        checked = st.error_rejections + st.newton_rejections + st.restarts
        watch.watch_refused(st.steps, checked, st.t, st.t_end)
        return None

    def _below_rounding(self, digits: float) -> tuple[Status, str] | None:
        """Return a failure if some tolerance is less than so many units of the last digit of its unknown."""
        st = self.state
        if st.open:
            # what stands in y is no result
            return None
        level = EPS * np.abs(st.y) * st.w_error
        worst = int(np.argmax(level))
        if not digits * level[worst] > 1.0:
            return None
        value, weight = float(st.y[worst]), float(st.w_error[worst])
        least = LEAST_DIGITS * EPS * abs(value)
        told = messages.below_rounding(self.problem, st.t, worst, value, 1.0 / weight, least)
        return Status.BELOW_ROUNDING, told

    def _heed(self, code: int) -> tuple[Status, str] | None:
        """Do what the compiled loop has returned for; return how the run has ended, or None if it goes on."""
        st = self.state
        if code < 0:
            return self._failure(code)
        if code == s.DONE:
            self._report()
            failure = self._unsatisfied() if st.drop_level else self._another_index()
            return failure or (Status.SUCCESS, f"{Status.SUCCESS.sentence}{self.start_note}")
        if code == s.TERMINAL:
            return Status.TERMINAL_EVENT, f"{Status.TERMINAL_EVENT.sentence} t = {st.t:.9g}.{self.start_note}"
        if code == s.PAUSED:
            self.records.change_table()
        elif code == s.REPIVOT:
            begin_pivots = time.thread_time()
            failure = self.repivot()
            self.processor_times["pivots"] += time.thread_time() - begin_pivots
            return self.user_failure() if self.user_exception() is not None else failure
        elif code == s.BUFFER_FULL:
            self.records.drain()
            # a chunk of small steps may be more than the buffer holds, and never end otherwise
            self._report()
        return None

    def _report(self) -> None:
        if self.options.progress is not None:
            self.options.progress(self.state.t)

    def _failure(self, code: int) -> tuple[Status, str]:
        st, problem = self.state, self.problem
        t = st.t
        h = st.h
        worst = st.worst
        status = Status(code)  # type: ignore[call-arg]
        if status is Status.NOT_FINITE and worst < 0:
            return status, messages.event_not_finite(problem, t, -1 - worst)
        if status is Status.NOT_FINITE:
            return status, messages.not_finite(problem, t, worst)
        if status is Status.STEP_TOO_SMALL:
            worst = st.worst_error
            ends = self._end() if self._meets_pole() else ""
            told = messages.step_too_small(problem, t, h, worst, st.error, self._noise(), ends)
            return status, told
        gave_up = status in (Status.NEWTON_FAILURE, Status.TOO_MANY_REJECTIONS)
        if gave_up and not self._meets_pole():
            if st.newton_fails > 0:
                if st.index_changes:
                    return Status.SINGULAR_JACOBIAN, messages.index_changes(t, t)
                undetermined = self._undetermined()
                if undetermined is not None:
                    return undetermined
            chatter = self._jump()
            if chatter is not None:
                return Status.STALLED, messages.chatters(problem, t, chatter)
        if status is Status.NEWTON_FAILURE:
            return status, messages.newton(problem, t, h, worst, self._noise(), self._end())
        if status is Status.TOO_MANY_STEPS:
            return status, messages.too_many_steps(problem, t, st.steps)
        return status, messages.too_many_rejections(problem, t, h, worst, self._noise(), self._end())

    def _another_index(self) -> tuple[Status, str] | None:
        """Return a failure if the run has passed a singular pencil that no step had to take notice of."""
        st = self.state
        if not st.index_changes:
            return None
        return Status.SINGULAR_JACOBIAN, messages.index_changes(st.t_pencil, st.t)

    def _end(self) -> str:
        """Say how the solution ends where the last attempts found none on its branch."""
        st = self.state
        if self._meets_pole():
            return messages.passes_pole(self.problem, st.pole, st.pole_at)
        if st.jumped >= 0:
            return messages.branch_ends(self.problem, st.jumped, st.jump_from, st.jump_to)
        return messages.solution_ends(self.problem, st.worst_row, st.violation)

    def _meets_pole(self) -> bool:
        """Whether the last attempts met a pole of the rates, or were on their way to one."""
        st = self.state
        if not st.pole_met:
            with trying():
                any(has_pole_ahead(self.functions, st, unknown) for unknown in self._suspects())
        return st.pole_met

    def _jump(self) -> Chatter | None:
        """Return where the solution stays on a jump of a rate, None if it does not."""
        found = np.empty(3)
        with trying():
            for unknown in self._suspects():
                if stays_on_jump(self.functions, self.state, unknown, found):
                    return Chatter(unknown, *found.tolist())
        return None

    def _suspects(self) -> list[int]:
        """Return the unknowns with a rate that the last attempts failed for, if their equations may be looked at."""
        st = self.state
        if st.nonlinear_rates or st.n_past < 2 or self.user_exception() is not None:
            return []
        suspects = dict.fromkeys((st.pole, st.worst, st.worst_error))
        return [unknown for unknown in suspects if unknown >= 0 and st.differential[unknown]]

    def _undetermined(self) -> tuple[Status, str] | None:
        """Return the failure if the matrix of the last attempt, beyond the time reached, is singular."""
        st = self.state
        if not np.isfinite(st.matrix).all():
            return None
        try:
            analyse(self.indptr, self.indices, st.matrix, self.scale)
        except SingularMatrixError as error:
            return Status.SINGULAR_JACOBIAN, messages.singular(self.problem, st.t, error.rows, error.cols)
        return None

    def _noise(self) -> float:
        """Return how far rounding alone moves the solution where the run stopped, in units of the tolerance."""
        st = self.state
        if self.plan is None or self.factors is None or not np.isfinite(st.y).all():
            return 0.0
        level = float(rounding_level(st, self.plan, self.factors))
        return level if np.isfinite(level) else 0.0

    def _stats(self) -> SolverStats:
        st = self.state
        return SolverStats(
            steps=st.steps,
            error_rejections=st.error_rejections,
            newton_rejections=st.newton_rejections,
            residuals=st.residuals,
            jacobians=st.jacobians,
            factorizations=st.factorizations,
            solves=st.solves,
            repivots=max(0, self.repivots - self.first_pivots),
            noise_limited=st.noise_limited,
            wall_time=self.wall_time,
            processor_times={**self.processor_times, "consumer": self.records.processor_time},
        )


# Find runs that go on without getting anywhere.


HOPELESS = 1e10
"""Steps to the end of the span, at the rate of the last window, from which on a run that does not speed up is ended.

The smallest models take a day for so many, and what is kept of each, 24 bytes, comes to 240 GB.
"""
REFUSED_WINDOW = 2_000
"""Steps looked at together where many are refused: some ten periods of a vibration, some hundred contacts."""
REFUSED = 0.04
"""Refused steps, as part of those accepted, from which on they count as many. A solution with continuous derivatives
has one in a thousand, a mechanism with contacts 6 %, a sliding motion on a jump 13 to 16 %."""
WINDOWS = 6
"""Such windows in a row, of which the second half has to go no more than twice as far as the first: 12 000 steps, 0.1 s
of a small compiled problem and 2 s of one in plain Python."""
LONG = 1e6
"""Steps to the end, at their rate, from which on the steps themselves are looked at."""
LOOK = 64
"""Steps that are looked at one by one."""
TOLERANCES_A_STEP = 10.0
"""Tolerances that an unknown on a jump of its rate may move by in a step. Implicit Euler across a jump J has the error
h J/2, less than a tolerance, so that it moves by about two; a solution that is resolved moves by hundreds."""
TURNS = LOOK // 8
"""Changes of sign of its rate, less the mean one, among these steps: a smooth solution in steps that follow it has a
dozen steps between two."""


@dataclass
class StallWatch:
    """Progress over windows of steps.

    A start, a jump or an impact may take many small steps, but they grow again. Where the equations have no solution
    beyond some time, as where friction jams a joint, they do not: the integrator creeps towards that time for ever.
    Where a rate jumps and the solution stays on the jump, steps cross it by turns, refused and small, for ever.

    Attributes
    ----------
    steps : int
        Accepted steps at the start of the present window.
    t : float
        Time at the start of the present window.
    progress : float
        What the last whole window went; 0 before there is one.
    """

    steps: int
    t: float
    progress: float = 0.0
    _marks: deque[tuple[int, int, float]] = field(default_factory=lambda: deque(maxlen=WINDOWS + 1))
    _seen: list[tuple[float, np.ndarray, np.ndarray]] = field(default_factory=list)
    looking: bool = False

    def steps_needed(self, steps: int, t: float, t_end: float) -> float:
        """Return the steps from ``t`` to the end if the run is stalled, else 0.

        Stalled means that two whole windows have passed, that the second went no more than twice as far as the first,
        and that at this rate the end is more than `HOPELESS` steps away.
        """
        if steps - self.steps < WINDOW:
            return 0.0
        progress = t - self.t
        needed = (t_end - t) * (steps - self.steps) / progress if progress > 0.0 else float("inf")
        stalled = 0.0 < self.progress and progress <= 2.0 * self.progress and needed > HOPELESS
        self.steps, self.t, self.progress = steps, t, progress
        return needed if stalled else 0.0

    def watch_refused(self, steps: int, refused: int, t: float, t_end: float) -> None:
        """Decide whether the next steps are worth a look, from those accepted and those refused or begun afresh."""
        marks = self._marks
        if not marks:
            marks.append((steps, refused, t))
        last_steps, last_refused, _ = marks[-1]
        if self.looking or steps - last_steps < REFUSED_WINDOW:
            return
        if refused - last_refused < REFUSED * (steps - last_steps):
            marks.clear()
        marks.append((steps, refused, t))
        if len(marks) <= WINDOWS:
            return
        (s0, _, t0), (s1, _, t1), (s2, _, t2) = marks[0], marks[WINDOWS // 2], marks[-1]
        slow = t2 - t1 <= 2.0 * (t1 - t0) * (s2 - s1) / (s1 - s0)
        self.looking = slow and (t_end - t2) * (s2 - s0) > LONG * (t2 - t0)

    def look(self, t: float, y: np.ndarray, yp: np.ndarray, weight: np.ndarray) -> Chatter | None:
        """Look at one more step; after `LOOK` return the unknown that stays on a jump of its rate, None without one.

        Parameters
        ----------
        t : float
            End of a step.
        y, yp : ndarray, shape (n,)
            Unknowns and rates there.
        weight : ndarray, shape (n,)
            Reciprocal tolerances of the unknowns under error control, 0 of others.
        """
        self._seen.append((t, y.copy(), yp.copy()))
        if len(self._seen) <= LOOK:
            return None
        times, places, rates = (np.array(rows) for rows in zip(*self._seen, strict=True))
        self._seen.clear()
        self._marks.clear()
        self.looking = False
        mean = (places[-1] - places[0]) / (times[-1] - times[0])
        way = np.abs(np.diff(places, axis=0) - np.diff(times)[:, None] * mean).sum(axis=0) * weight
        turns = np.count_nonzero(np.diff(np.sign(rates - mean), axis=0), axis=0)
        # less than a tolerance in all the steps is rest, not chatter
        moved = np.where((way >= 1.0) & (way <= TOLERANCES_A_STEP * LOOK) & (turns >= TURNS), way, 0.0)
        worst = int(np.argmax(moved))
        if moved[worst] == 0.0:
            return None
        low, high = float(rates[:, worst].min()), float(rates[:, worst].max())
        return Chatter(worst, float(places[:, worst].mean()), low, high)


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
