"""IDA from SUNDIALS through scikit-sundae, set up for constrained mechanical systems.

The binding cannot take unknowns out of the error test, so those without error control get an absolute
tolerance of `UNCONTROLLED`.  ``rtol`` acts on |y| of all unknowns, and angles wind up, so it is kept
at the smallest sensible value and the vector of absolute tolerances does the work.
"""

from __future__ import annotations

import bisect
import contextlib
import io
import re
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from gearmbs.dae.integrators.algebraic.outputs import AlgebraicOutputs
from gearmbs.dae.integrators.ida_branch import IdaBranch
from gearmbs.dae.integrators.messages import (
    advice,
    index_changes,
    unknown_name,
)
from gearmbs.dae.integrators.options import ROUNDED_STEP, Options, beside
from gearmbs.dae.integrators.records import remark_on_unresolved
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult, SolverStats, Status
from gearmbs.logs import logger

if TYPE_CHECKING:
    from sksundae.ida import IDA

UNCONTROLLED = 1e10
"""Absolute tolerance of unknowns outside error control: so large, for multipliers in N and N m, that IDA's norms do not
see them."""
SMALLEST_RTOL = 1e-14
"""Least relative tolerance, 45 units of the last digit of an unknown."""
OF_NONLINEAR_RATES = 0.01
"""Part of the tolerances IDA is given where G is not linear in y'. It judges its first correction by the convergence of
earlier steps, which says nothing of this one, and cannot be told otherwise: over y' + eps y'^3 = f it is 250 tolerances
off at rtol = 1e-6 and 2700 at 1e-8, over y' = f 14 and 47."""
LEAST_OF_NONLINEAR_RATES = 1e-12
"""Relative tolerance that this does not go below: rounding."""
DENSE_LIMIT = 150
"""Unknowns up to which the dense factorisation is used: SuperLU_MT waits busily and stalls on a loaded machine."""
MAX_ITERATIONS = 4
MAX_STEPS = 100_000
"""Steps allowed between two outputs: 15 s of a vibration of 500 Hz at a dozen steps a period."""

OF_PORTIONS = "mxstep steps taken"
OF_STANDING = "its steps do not move the time any more"
OF_JUMPS = ("error test failed", "convergence failed", "nonlinear solver failed", "linear solver", OF_STANDING)
"""What SUNDIALS says where it stops at a jump of an algebraic unknown, or where a solution ends."""
STEPS_AT_ONCE = 1000
"""Steps after which IDA is asked how far it has come."""

NOT_FINITE_LIMIT = 100
"""Evaluations without a finite result, at times it never gets past, after which a run is given up."""


class _NotFiniteError(ArithmeticError):
    """The residual is not finite beyond some time, whatever the step."""


class _Messages(io.TextIOBase):
    """Standard output, but what SUNDIALS has to say about a failure is kept for the thread it failed in."""

    PATTERN = re.compile(r"\s*\[(?:IDA|SUN)\w*, Error: -?\d+\]\s*(.*)", re.DOTALL)
    LOCK = threading.Lock()

    def __init__(self) -> None:
        self.through = sys.stdout
        self.runs = 0
        self._own = threading.local()

    @property
    def text(self) -> str:
        """The last message of the calling thread."""
        return getattr(self._own, "text", "")

    @text.setter
    def text(self, text: str) -> None:
        self._own.text = text

    def write(self, text: str) -> int:
        """Keep a message and the end of its line; pass anything else on."""
        found = self.PATTERN.match(text)
        if found is not None:
            self.text = " ".join(found[1].split())
            logger("dae").debug("SUNDIALS: %s", self.text)
        elif not (getattr(self._own, "ending", False) and text == "\n"):
            self.through.write(text)
        self._own.ending = found is not None
        return len(text)

    def flush(self) -> None:
        """Flush standard output."""
        self.through.flush()


@contextlib.contextmanager
def _listening() -> Iterator[_Messages]:
    """Listen on standard output; runs side by side share one listener, which goes with the last of them."""
    with _Messages.LOCK:
        messages = sys.stdout if isinstance(sys.stdout, _Messages) else _Messages()
        messages.runs += 1
        sys.stdout = messages
    before, messages.text = messages.text, ""
    try:
        yield messages
    finally:
        messages.text = before
        with _Messages.LOCK:
            messages.runs -= 1
            if messages.runs == 0 and sys.stdout is messages:
                sys.stdout = messages.through


class _Callbacks:
    """The residual and Jacobian as scikit-sundae calls them: read-only arrays in, values written in place."""

    def __init__(self, problem: DAEProblem, idata: np.ndarray, rdata: np.ndarray) -> None:
        self.problem = problem
        self.idata, self.rdata = idata, rdata
        self.work = np.zeros(problem.work_size)
        self.y, self.yp = np.zeros(problem.n), np.zeros(problem.n)
        self.dense = problem.n <= DENSE_LIMIT
        self.columns = np.repeat(np.arange(problem.n), np.diff(problem.indptr))
        self.vals = np.zeros(problem.indices.size)
        self.last_t = np.nan
        self.last_step = 0.0
        self.steps = self.residuals = self.jacobians = 0
        self.first, self.last = -np.inf, np.inf
        """Between which the equations are evaluated: on this side of the breakpoints at both ends of a piece."""
        self.bad_count, self.bad_t, self.bad_row = 0, -np.inf, 0

    def residual(self, t, y, yp, out):
        self.y[:] = y
        self.yp[:] = yp
        seen = min(max(t, self.first), self.last)
        self.problem.residual(seen, self.y, self.yp, out, self.idata, self.rdata, self.work)
        if t != self.last_t:
            self.steps += 1
            self.last_step = abs(t - self.last_t)
            self.last_t = t
        self.residuals += 1
        finite = np.isfinite(out)
        if not finite.all():
            # IDA tries a smaller step; where that never helps it creeps on in ever smaller ones
            self.bad_count += 1
            self.bad_t, self.bad_row = max(self.bad_t, t), int(np.argmin(finite))
            if self.bad_count >= NOT_FINITE_LIMIT:
                raise _NotFiniteError
        elif t > self.bad_t:
            self.bad_count, self.bad_t = 0, -np.inf

    def jacobian(self, t, y, yp, res, cj, out):
        self.y[:] = y
        self.yp[:] = yp
        seen = min(max(t, self.first), self.last)
        self.problem.jacobian(seen, self.y, self.yp, cj, self.vals, self.idata, self.rdata, self.work)
        if self.dense:
            out[self.problem.indices, self.columns] = self.vals
        else:
            out[:] = self.vals
        self.jacobians += 1


def _solver(problem: DAEProblem, calls: _Callbacks, atol: np.ndarray, rtol: float, options: dict) -> IDA:
    from sksundae.ida import IDA

    # the binding insists on 32-bit indices
    places = problem.indices.astype(np.int32), problem.indptr.astype(np.int32)
    pattern = scipy.sparse.csc_array((np.ones(problem.indices.size), *places), shape=(problem.n,) * 2)
    linear = {"linsolver": "dense"} if calls.dense else {"linsolver": "sparse", "sparsity": pattern}
    with warnings.catch_warnings():
        # it says that our Jacobian is used instead of differences on the pattern, which is what we want
        warnings.filterwarnings("ignore", message="Custom sparse Jacobian", category=UserWarning)
        return IDA(
            calls.residual,
            jacfn=calls.jacobian,
            rtol=max(rtol, SMALLEST_RTOL),
            atol=atol,
            algebraic_idx=np.flatnonzero(~problem.differential),
            **linear,
            **options,
        )


def solve_ida(
    problem: DAEProblem,
    t_eval: np.ndarray | None = None,
    options: Options | None = None,
    *,
    t_end: float | None = None,
    **settings: Any,
) -> DAEResult:
    """Integrate a DAE with IDA and return it at the times ``t_eval``, or at every step IDA takes.

    What SUNDIALS prints about a failure goes into the message instead.

    Parameters
    ----------
    problem : DAEProblem
        With consistent initial values at ``t_eval[0]``.
    t_eval : array_like, shape (m,), optional
        Increasing output times, s; the first is the start. Default: the end of every step.
    options : Options, optional
        With the method "IDA". Steps of size 0 are left to IDA.
    t_end : float, optional
        End of the run when ``t_eval`` is not given, s.
    **settings
        Single options by name, before those of ``options``: see `gearmbs.dae.Options`.

    Returns
    -------
    DAEResult
        With ``status`` `SOLVER_FAILURE`, `NOT_FINITE` or `INTERRUPTED`, and what was computed so far, if the run did
        not finish.

    Raises
    ------
    ValueError
        For arguments that make no sense.
    """
    gathered = Options.gather("IDA", options, settings)
    if t_eval is None and t_end is None:
        raise ValueError("t_end: give it when t_eval is left out")
    times = np.asarray([problem.t0, t_end] if t_eval is None else t_eval, dtype=float)
    if times.ndim != 1 or times.size < 2 or np.any(np.diff(times) <= 0.0):
        raise ValueError("t_eval: give at least two strictly increasing times")
    return _Run(problem, times, t_eval is None, gathered).drive()


class _Run:
    """One integration with IDA, restarted where the hook rewrites the unknowns."""

    def __init__(self, problem: DAEProblem, times: np.ndarray, every_step: bool, options: Options) -> None:
        self.problem = problem
        self.every_step = every_step
        self.options = options
        self.idata, self.rdata = problem.idata.copy(), problem.rdata.copy()
        self.calls = _Callbacks(problem, self.idata, self.rdata)
        own = np.zeros(problem.n, dtype=bool) if problem.index_one is None else problem.index_one
        self.atol = np.where(problem.error_mask | own, options.tol * problem.atol_scale, UNCONTROLLED)
        tables, rtol = (self.idata, self.rdata, self.calls.work), max(options.rtol, SMALLEST_RTOL)
        self.branch = IdaBranch(problem, *tables, self.atol, rtol, float(times[0]))
        self.rows = _Rows(times, problem, every_step, self.rdata)
        self.t, self.end = ends = float(times[0]), float(times[-1])
        rtol = max(options.rtol, SMALLEST_RTOL)
        self.algebraic = AlgebraicOutputs(problem, problem.atol_scale * options.tol, rtol, ends)
        """What is solved for at outputs, which IDA interpolates."""
        self.epochs = [(0, self.idata.copy())]
        self.stops = options.stops(self.t, self.end)

    @property
    def stop(self) -> float:
        """Next time beyond which no step may go: a breakpoint, or the end."""
        k = bisect.bisect_right(self.stops, self.t)
        return self.stops[k] if k < len(self.stops) else self.end

    def drive(self) -> DAEResult:
        """Run to the end, a failure or an interruption, and return everything computed so far."""
        start = time.perf_counter()
        with _listening() as messages:
            try:
                status, message = self._loop(messages)
            except KeyboardInterrupt:
                status, message = Status.INTERRUPTED, f"{Status.INTERRUPTED.sentence} Reached t = {self.t:.6g} s."
            except (_NotFiniteError, RuntimeError, KeyError) as error:
                status, message = self._failure(max(self.t, self.calls.last_t), messages.text or str(error))
        stats = SolverStats(
            steps=self.calls.steps,
            residuals=self.calls.residuals,
            jacobians=self.calls.jacobians,
            factorizations=self.calls.jacobians,
            wall_time=time.perf_counter() - start,
        )
        rows, remark = self.rows, "" if self.every_step else self.algebraic.remark()
        result = DAEResult(
            t=rows.t[: rows.done],
            y=rows.y[: rows.done],
            yp=rows.yp[: rows.done],
            status=status,
            message=f"{message} {remark}" if remark else message,
            stats=stats,
            epochs=self.epochs,
            counted=None if self.every_step or rows.kept is None else rows.kept[: rows.done],
            t_last=self.t,
        )
        if not self.every_step:
            remark_on_unresolved(self.algebraic, result)
        return result

    def _loop(self, messages: _Messages) -> tuple[Status, str]:
        """Take steps until the end or a failure; return how the run has ended."""
        problem, rows = self.problem, self.rows
        y, yp = problem.y0, problem.yp0
        solver = self._start(y, yp)
        self.branch.know(self.t, y, yp, self.end)
        while self.t < self.end:
            stop = self.stop
            target = min(rows.next_time, stop)
            if problem.hook_interval is not None and not self.every_step:
                target = min(target, self.t + problem.hook_interval(self.t, y, yp))
            if target - self.t <= ROUNDED_STEP * abs(target):
                # nearer than the shortest step: an output just behind a stop, or the end just behind a jump
                self.t = target
                rows.take(self.t, y, yp)
                self._settle()
                if self.t == stop < self.end:
                    solver, y, yp = self._start_beyond(y, yp)
                continue
            answer, why = self._advance(solver, target, messages)
            if not answer.success:
                beyond = self._beyond(answer, why)
                if isinstance(beyond, str):
                    self.t = max(self.t, float(answer.t))
                    return self._failure(float(answer.t), why, beyond)
                while rows.next_time <= beyond[0] < self.end and not self.every_step:
                    # outputs within the shortest step belong to the near side of the jump
                    rows.take(rows.next_time, np.array(answer.y), np.array(answer.yp))
                self.t, y, yp = beyond
                messages.text = ""
                solver = self._start(y, yp)
                continue
            self.t, y, yp = min(float(answer.t), stop) if self.every_step else target, answer.y, answer.yp
            taken = rows.take(self.t, y, yp)
            self._settle()
            if taken and self.options.progress is not None:
                self.options.progress(self.t)
            changed = self._call_hook(y, yp)
            if changed is not None:
                y, yp = changed
            if self.t == stop < self.end:
                solver, y, yp = self._start_beyond(y, yp)
            elif changed is not None:
                solver = self._start(y, yp)
        if self.branch.index_changed(self.t, y, yp):
            told = index_changes(self.branch.t_known, self.t)
            return Status.SINGULAR_JACOBIAN, told
        return Status.SUCCESS, f"{Status.SUCCESS.sentence}{problem.start_note}"

    def _settle(self) -> None:
        """Solve for algebraic unknowns at the output just taken, and after the first step at the start."""
        rows, settler = self.rows, self.algebraic
        if self.every_step or not settler.is_needed or rows.t[rows.done - 1] != self.t:
            return
        h = self.calls.last_step
        for k in (0, 1) if rows.done == 2 else (rows.done - 1,):
            last = max(k, 1)
            step = h if np.isfinite(h) and h > 0.0 else float(rows.t[last] - rows.t[last - 1])
            output = float(rows.t[k]), rows.y[k], rows.yp[k], step
            if k == 0:
                settler.settle_start(*output, self.idata, self.stops)
            else:
                settler.settle_after(*output, float(rows.t[k - 1]), rows.y[k - 1], self.idata, self.rdata)

    def _advance(self, solver: IDA, target: float, messages: _Messages) -> tuple[Any, str]:
        """Go to ``target``, in portions of steps; return IDA's answer and what it has to say of a failure."""
        limit = MAX_STEPS if self.options.max_steps is None else self.options.max_steps
        done, before = 0, self.t
        while True:
            answer = solver.step(target, method="onestep" if self.every_step else "normal", tstop=self.stop)
            why = messages.text or answer.message
            if answer.success or OF_PORTIONS not in why:
                return answer, why
            done += min(STEPS_AT_ONCE, limit)
            t = float(answer.t)
            if t - before <= STEPS_AT_ONCE * ROUNDED_STEP * abs(t):
                return answer, f"{why}: {OF_STANDING}"
            if done >= limit:
                return answer, why
            before = t

    def _beyond(self, answer, why: str) -> tuple[float, np.ndarray, np.ndarray] | str:
        """Return where to go on behind a jump of algebraic unknowns that stopped IDA, or why all ends there."""
        if not any(text in why for text in OF_JUMPS) or self.branch.own is None:
            return ""
        t = float(answer.t)
        if not (self.t <= t < self.end):
            return ""
        if self.rows.next_time < t:
            # IDA is a step ahead of its outputs, which belong to this side
            return ""
        return self.branch.pass_jump(t, np.array(answer.y), np.array(answer.yp), self.end)

    def _start_beyond(self, y: np.ndarray, yp: np.ndarray) -> tuple[IDA, np.ndarray, np.ndarray]:
        """Return IDA, unknowns and rates behind a breakpoint: what was before it says nothing about what comes."""
        y, yp, h = self.branch.start_afresh(self.t, np.array(y), np.array(yp), self.stop, self.end)
        return self._start(y, yp, h), y, yp

    def _start(self, y: np.ndarray, yp: np.ndarray, h: float = 0.0) -> IDA:
        """Return IDA, set up at the time reached, with a first step of ``h`` where none is asked for."""
        o = self.options
        first, last = beside(self.t, self.end - self.t), beside(self.stop, self.stop - self.t)
        settled = self.algebraic.part
        settled.t_first = self.t if self.t in self.stops else settled.t_start
        settled.t_last = self.stop
        self.calls.first = self.t + first if self.t in self.stops else -np.inf
        self.calls.last = self.stop - last if self.stop in self.stops else np.inf
        settings = {
            "max_order": o.highest_order if o.max_order is None else o.max_order,
            "max_step": 0.0 if o.max_step is None or np.isinf(o.max_step) else o.max_step,
            # at its ends alone an interval between two breakpoints may be as the ones beside it
            "first_step": max(0.0, min(o.first_step or h, 0.5 * (self.stop - self.t))),
            "min_step": o.min_step or 0.0,
            "max_nonlin_iters": MAX_ITERATIONS if o.max_iterations is None else o.max_iterations,
            "max_num_steps": min(STEPS_AT_ONCE, MAX_STEPS if o.max_steps is None else o.max_steps),
        }
        part = OF_NONLINEAR_RATES if self.problem.nonlinear_rates else 1.0
        rtol = max(part * o.rtol, min(o.rtol, LEAST_OF_NONLINEAR_RATES))
        solver = _solver(self.problem, self.calls, part * self.atol, rtol, settings)
        solver.init_step(self.t, y, yp)
        return solver

    def _call_hook(self, y: np.ndarray, yp: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Let the hook look at the unknowns; return them and their rates if it has rewritten them."""
        problem = self.problem
        hist = y[None, :].copy()
        if problem.hook is None or not problem.hook(self.t, hist, 1, self.idata, self.rdata, self.calls.work):
            return None
        self.epochs.append((self.rows.done, self.idata.copy()))
        y, yp = hist[0], np.array(yp)
        if problem.restart_rates is not None:
            yp = problem.restart_rates(self.t, y, yp, self.idata, self.rdata)
        return y, yp

    def _failure(self, t: float, why: str, ends: str = "") -> tuple[Status, str]:
        """Say when the run failed, which unknown is the least satisfied, and what to try."""
        problem, calls = self.problem, self.calls
        if calls.bad_count:
            return Status.NOT_FINITE, (
                f"{Status.NOT_FINITE.sentence} IDA stopped at t = {t:.6g} s: the equation of "
                f"{unknown_name(problem, calls.bad_row)} is not a finite number. {advice(problem, Status.NOT_FINITE)}"
            )
        moving = np.where(problem.error_mask, np.abs(calls.yp) / np.maximum(self.atol, 1e-300), 0.0)
        worst = int(np.argmax(moving))
        return Status.SOLVER_FAILURE, (
            f"IDA stopped at t = {t:.6g} s ({why.rstrip('.')}). The unknown that changes fastest for its tolerance is "
            f"{unknown_name(problem, worst)}. {ends or advice(problem, Status.SOLVER_FAILURE)}"
        )


class _Rows:
    """Output rows, at given times or at every step."""

    def __init__(self, times: np.ndarray, problem: DAEProblem, every_step: bool, rdata: np.ndarray) -> None:
        self.every_step = every_step
        self.end = float(times[-1])
        self.t = np.zeros(4096) if every_step else times
        self.y, self.yp = np.zeros((self.t.size, problem.n)), np.zeros((self.t.size, problem.n))
        self.t[0], self.y[0], self.yp[0] = times[0], problem.y0, problem.yp0
        self.counted, self.rdata, self.kept = problem.counted, rdata, None
        if problem.counted is not None:
            self.kept = np.tile(rdata[problem.counted.places], (self.t.size, 1))
        self.done = 1
        self.told = float(times[0])
        self.span = (self.end - self.told) / 200.0

    @property
    def next_time(self) -> float:
        """Time to integrate to next."""
        return self.end if self.every_step else float(self.t[self.done])

    def take(self, t: float, y: np.ndarray, yp: np.ndarray) -> bool:
        """Store a row if ``t`` is an output; return whether it is time for a word on progress."""
        if not self.every_step and t != self.t[self.done]:
            return False
        if self.done == self.t.size:
            more = self.t.size // 2
            self.t = np.concatenate([self.t, np.zeros(more)])
            self.y, self.yp = (np.concatenate([a, np.zeros((more, a.shape[1]))]) for a in (self.y, self.yp))
        self.t[self.done], self.y[self.done], self.yp[self.done] = t, y, yp
        if self.kept is not None and self.counted is not None and not self.every_step:
            self.kept[self.done] = self.rdata[self.counted.places]
        self.done += 1
        if t < self.told + self.span:
            return False
        self.told = t
        return True
