"""The start of a run of WSTIFF or GSTIFF: its state, its first and smallest step, its first pivots.

And whether the initial values can be used. All scales come from the problem itself: how fast the unknowns leave their
tolerances, and what short steps of implicit Euler do to them. The span only bounds the first step from above, and
offers a longer one to try.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gearmbs.dae.integrators import messages
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.corrector import set_weights
from gearmbs.dae.integrators.events import SAMPLES
from gearmbs.dae.integrators.newton_matrix import SLOPE_MAX_AGE
from gearmbs.dae.integrators.options import Options, event_rules
from gearmbs.dae.integrators.run_state import KINK_MEMORY, RunState, Sizes, newest_point, state_layout
from gearmbs.dae.integrators.step import JUMP_LIMIT
from gearmbs.dae.linalg.entry_lists import FEWEST_ENTRIES
from gearmbs.dae.linalg.lu_plan import LUPlan
from gearmbs.dae.linalg.sparse_lu import LUFactors, factor, solve
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import Status
from gearmbs.kernels.pointers import direct

Failure = tuple[Status, str]


class Run(Protocol):
    """What the start of a run asks of it, see `gearmbs.dae.integrators.driver.Run`."""

    problem: DAEProblem
    options: Options
    state: RunState
    plan: LUPlan | None
    factors: LUFactors | None
    counted: np.ndarray
    steps_given: tuple[bool, bool]
    planned_step: float
    first_pivots: int
    start_note: str

    def repivot(self) -> Failure | None: ...

    def user_exception(self) -> BaseException | None: ...

    def user_failure(self) -> Failure: ...


MAX_ITERATIONS = 10
RECORD_BYTES = 8_000_000
"""Of steps that are collected before Python takes them, which it does in a thousandth of the time that they take. A
quarter of it, which stays in the processor's cache, is no faster."""

MOST_RECORDS = 8192
MOST_TIMES = 2048
"""Records where times, sizes and orders alone are kept."""

EVENT_BUFFER = 64
LARGEST_PENCIL = 100
"""Unknowns up to which the sign of the determinant is watched: a dense elimination takes 0.3 ms."""
LARGE_GAMMA = 1e6
"""Times the reciprocal span: faster growth than that would leave no solution, and differences of 1e-8 of the unknowns
change their rates by a hundredth of the unknowns a span."""
RATE_ALLOWED = 0.12
"""Rate of a corrector from which on the next step gets a new matrix: another iteration would cost more. Tuned, see the
table of constants."""
RATE_ALLOWED_IF_DEAR = 0.2
"""The same where a matrix is dear. Tuned, see the table of constants."""
DEAR = 12
"""Residuals from which on a matrix is dear, and worth its price only at slower rates of the corrector."""

FIRST_MOVE = 0.5
"""Tolerances by which the fastest unknown may move in the first step."""
FIRST_OF_SPAN = 1e-3
"""Largest first step, as part of the span: that of DASSL and IDA."""
FIRST_TRIED = 1e-7
"""Part of the span that is tried as the first step where the fastest unknown would want a shorter one."""
FIRST_ERROR = 0.25
"""Error of a step of implicit Euler, in tolerances, up to which its size is taken for the first one: about the fifth
that later steps aim at. Tuned, see the table of constants."""
TRIALS = 4
SMALLEST_OF_SPAN = 1e-14
"""Smallest step, as part of the span: 45 units of its last digit, below which times differ by rounding."""
SMALLEST_OF_FIRST = 1e-6
"""The same, as part of the first step that rates and span allow: so that a short start of a long span may be resolved.
Tuned, see the table of constants."""
CHECK_STEP = 1e-10
"""Part of the span over which starting values are checked first: too short for rates to move an unknown by its
tolerance, while values off a constraint still jump by all that they are off. Tuned, see the table of constants."""
CHECK_ROUNDS = 12
CHECK_RATIO = 0.01
"""The step of the check shrinks by this in each round: from 1e-10 to 1e-34 of the span."""
REPAIR_FROM = 1.0
"""Tolerances by which starting values may be off before they are moved onto the constraints, where they are not
refused."""
REPAIR_SWEEPS = 4
ROUNDED_RESIDUAL = 1e-10
"""Largest residual that may be rounding, for unknowns of the size of one: a million times the last digit leaves room
for large terms that cancel."""


def initial_state(problem: DAEProblem, options: Options, outputs: np.ndarray, t_end: float, keep: bool) -> RunState:
    """Return the state at the start of a run, with all but the sizes of its steps.

    Parameters
    ----------
    problem : DAEProblem
    options : Options
    outputs : ndarray, shape (m,)
        Output times.
    t_end : float
        End of the run.
    keep : bool
        Whether the unknowns of every step are recorded.

    Raises
    ------
    ValueError
        For tolerances that are not positive, and rules that do not fit the event functions.
    """
    t0 = float(problem.t0)
    n_events = int(problem.n_events) if problem.events is not None else 0
    stops = options.stops(t0, t_end)
    st = _empty_state(problem, options, outputs, stops, n_events, _rows_of_records(problem.n, keep), keep)
    st.stops[:] = stops
    _set_tables(st, problem)
    _set_tolerances(st, problem, options, t_end - t0)
    _set_event_rules(st, n_events, options)
    st.t_end = t_end
    st.t_pause = np.inf
    st.h_max = np.inf if options.max_step is None else options.max_step
    st.rtol = options.rtol
    st.matrix_dear = problem.small_entries
    st.rate_allowed = RATE_ALLOWED_IF_DEAR if problem.jacobian_residuals >= DEAR else RATE_ALLOWED
    st.max_order = options.highest_order if options.max_order is None else int(options.max_order)
    st.max_iterations = MAX_ITERATIONS if options.max_iterations is None else int(options.max_iterations)
    st.max_steps = int(options.max_steps or 0)
    st.n_events = n_events
    st.most_crossings = SAMPLES * n_events
    st.fixed_leading = options.method == "GSTIFF"
    st.interpolate = options.interpolates(outputs, stops)
    st.has_hook = problem.hook is not None
    st.keep_rows = keep
    st.step_in_weights = bool((st.tested > st.coupled).any())
    st.t = t0
    st.order = 1
    st.worst_row = st.jumped = st.pole = st.leapt = st.turned = st.answered = -1
    st.since_kink = KINK_MEMORY
    st.n_past = 1
    st.gamma_factored = 1.0
    st.left_out = problem.small_entries
    st.matrix_wanted = True
    st.slope_age = SLOPE_MAX_AGE
    st.window_t[st.newest] = t0
    newest_point(st)[:] = st.y
    set_weights(st, st.y, 1.0)
    _record_start(st)
    return st


def _rows_of_records(n: int, keep: bool) -> int:
    """Return for how many accepted steps there is room between two calls of the compiled loop."""
    if not keep:
        return MOST_TIMES
    return min(max(RECORD_BYTES // (8 * n), 8 * HISTORY), MOST_RECORDS)


def _empty_state(
    problem: DAEProblem,
    options: Options,
    outputs: np.ndarray,
    stops: list[float],
    n_events: int,
    records: int,
    keep: bool,
) -> RunState:
    n = problem.n
    watched = problem.watched if options.consumer is not None else problem.watched[:0]
    kept = np.empty(0, dtype=np.int64) if problem.counted is None else problem.counted.places
    sizes = Sizes(
        n=n,
        nnz=len(problem.indices),
        idata=len(problem.idata),
        rdata=len(problem.rdata),
        work=problem.work_size,
        stops=len(stops),
        events=n_events,
        samples=SAMPLES + 1 if n_events else 1,
        crossings=EVENT_BUFFER + SAMPLES * n_events,
        records=records,
    )
    return state_layout(sizes).new(
        outputs=outputs,
        y_out=np.empty((len(outputs), n)),
        yp_out=np.empty((len(outputs), n)),
        kept=kept,
        kept_out=np.tile(problem.rdata[kept], (len(outputs), 1)),
        watched=watched,
        record_y=np.empty((records if keep else 1, n + len(watched))),
    )


def _set_tables(st: RunState, problem: DAEProblem) -> None:
    """Copy the tables, which hooks and events may change, and the initial values."""
    st.idata[:] = problem.idata
    st.rdata[:] = problem.rdata
    st.entry_row[:] = problem.indices
    st.entry_col[:] = np.repeat(np.arange(problem.n), np.diff(problem.indptr))
    st.y[:] = problem.y0
    st.yp[:] = st.yp_start[:] = problem.yp0


def _set_tolerances(st: RunState, problem: DAEProblem, options: Options, span: float) -> None:
    """Set tolerances, and masks of the unknowns as numbers."""
    np.multiply(problem.atol_scale, options.tol, out=st.atol)
    if not st.atol.min(initial=np.inf) > 0.0:
        raise ValueError(f"atol_scale must be positive, is {problem.atol_scale[int(np.argmin(st.atol))]:g} somewhere")
    st.controlled[:] = problem.error_mask
    st.index_one[:] = 0.0 if problem.index_one is None else problem.index_one
    st.watches_pencil = problem.index_one is not None and problem.n <= LARGEST_PENCIL
    st.gamma_large = LARGE_GAMMA / span
    st.has_index_one = bool(st.index_one.any())
    st.nonlinear_rates = problem.nonlinear_rates
    # equations that are not linear in y' need not be defined for y' = 0, at which poles are looked for
    st.watches_poles = not (problem.finite_rates or problem.nonlinear_rates)
    st.tested[:] = np.maximum(st.controlled, st.index_one) if options.corrector == "modified" else 1.0
    st.differential[:] = problem.goes_on
    st.coupled[:] = np.maximum(np.maximum(st.controlled, st.differential), st.index_one)


def _set_event_rules(st: RunState, n_events: int, options: Options) -> None:
    """Set which crossings count, what they do, and how many are left; default all, nothing, and one until a stop."""
    st.event_left[:] = 1
    for name, values in event_rules(n_events, options).items():
        getattr(st, name)[:n_events] = values


def _record_start(st: RunState) -> None:
    """Make the start the first record, and the first output if one is wanted there."""
    st.n_records = 1
    st.record_t[0] = st.t
    st.record_y[0, : len(st.y)] = st.y
    if len(st.outputs) and st.outputs[0] == st.t:
        st.y_out[0] = st.y
        st.yp_out[0] = st.yp
        st.next_output = 1


def choose_steps(run: Run) -> None:
    """Set the smallest step, and a first one that can do no harm, where the caller has not.

    Parameters
    ----------
    run : Run
        With weights set at the start.
    """
    st = run.state
    span = st.t_end - st.t
    natural = FIRST_OF_SPAN * span
    speed = float((np.abs(st.yp_start) * st.w_error).max())
    if speed > 0.0:
        natural = min(natural, FIRST_MOVE / speed)
    smallest = min(SMALLEST_OF_SPAN * span, SMALLEST_OF_FIRST * natural)
    first_step, min_step = run.options.first_step, run.options.min_step
    st.h_min = smallest if min_step is None else min_step
    st.h = max(min(natural, st.h_max), st.h_min) if first_step is None else first_step


def begin(run: Run) -> Failure | None:
    """Evaluate the equations at the start, choose the first pivots and check consistency.

    Returns
    -------
    failure : (Status, str) or None
    """
    st, problem = run.state, run.problem
    t0 = float(st.t)
    _residual(run)
    st.record_y[0, problem.n :] = st.work[st.watched]
    if run.user_exception() is not None:
        return run.user_failure()
    bad = np.flatnonzero(~np.isfinite(st.res))
    if len(bad):
        return Status.NOT_FINITE, messages.not_finite(problem, t0, int(bad[0]))
    if st.n_events and problem.events is not None:
        problem.events(t0, st.y, st.yp, st.g_old, st.idata, st.rdata, st.work)
        bad = np.flatnonzero(~np.isfinite(st.g_old))
        if len(bad) and run.user_exception() is None:
            return Status.NOT_FINITE, messages.event_not_finite(problem, t0, int(bad[0]))
    # over a vanishing step wrong rates are harmless, but values off the constraints still have to jump
    span = st.t_end - t0
    tried = [min(st.h, CHECK_STEP * span), st.h]
    if not run.steps_given[0]:
        tried.append(min(FIRST_TRIED * span, st.h_max))
    _plan_first_step(run, max(tried))
    failure = None
    for h in tried:
        # an index-3 matrix is singular to working precision at a very short step: check over a longer one
        failure = None if _factors_with_plan(run, h) else choose_first_pivots(run, h)
        if failure is None:
            break
    if failure is not None:
        return failure
    st.h = max(st.h, h)
    failure = _check(run, h) if run.options.check_start else _repair(run, h)
    if run.options.check_start and run.options.repairs > 0.0:
        # what passes the check may still be off by more than a step allows, which would shrink without end
        failure = _repair_within(run, h, run.options.repairs / run.options.tol, failure)
    return failure if failure is not None else _settle_first_step(run)


def choose_first_pivots(run: Run, h: float) -> Failure | None:
    """Factor the Newton matrix of a first step of size ``h``; return a failure or None."""
    if run.planned_step == h and _factors_with_plan(run, h):
        return None
    _evaluate_matrix(run, h)
    run.first_pivots += 1
    run.planned_step = h
    return run.repivot()


def _evaluate_matrix(run: Run, h: float) -> None:
    st = run.state
    st.gamma = 1.0 / h
    run.problem.jacobian(st.t, st.y, st.yp, st.gamma, st.matrix, st.idata, st.rdata, st.work)
    st.jacobians += 1


def _plan_first_step(run: Run, h: float) -> None:
    """Choose the pivots of the first step that will be tried, if the check before it may do with them.

    A check asks for the size of a correction only. Of a matrix that leaves entries out each step size has its own.
    """
    if run.options.check_start and len(run.counted) < FEWEST_ENTRIES and choose_first_pivots(run, h) is not None:
        run.planned_step = 0.0


def _factors_with_plan(run: Run, h: float) -> bool:
    """Factor the Newton matrix of a step ``h`` with the pivots of the first one; return whether they fit."""
    st = run.state
    if not run.planned_step > 0.0 or run.plan is None or run.factors is None:
        return False
    _evaluate_matrix(run, h)
    st.factorizations += 1
    return bool(direct(factor)(run.plan, run.factors, st.matrix) <= st.growth_limit)


def _residual(run: Run) -> None:
    st = run.state
    run.problem.residual(st.t, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1


def _correction(run: Run) -> float:
    """Solve for the Newton correction of the start; return its size in units of the tolerance."""
    st = run.state
    direct(solve)(run.plan, run.factors, st.res, st.delta)
    return float((np.abs(st.delta) * st.w_error).max())


def _shrink_while_moving(run: Run, h: float, move: float, limit: float) -> tuple[float, float]:
    """Take smaller steps from the start as long as it moves by more than ``limit``; return the last one and its move.

    What rates do within a step shrinks with the step, sooner or later: fast modes reach their equilibrium within a
    step that is long for them, and move by the same in a shorter one. A jump onto the constraints never shrinks.
    """
    for _ in range(CHECK_ROUNDS):
        if not move > limit or choose_first_pivots(run, CHECK_RATIO * h) is not None:
            break
        smaller = _correction(run)
        if not smaller < 2.0 * move:
            break
        h, move = CHECK_RATIO * h, smaller
    return h, move


def _check(run: Run, h: float) -> Failure | None:
    """Refuse initial values that do not satisfy the equations; bound the first step where their rates are wrong."""
    st, problem = run.state, run.problem
    move = _correction(run)
    if not move <= JUMP_LIMIT:
        delta = st.delta
        assert run.plan is not None
        worst = int(np.argmax(np.abs(delta) * st.w_error))
        row = int(np.argmax(np.abs(st.res[run.plan.row_from]) * run.plan.row_scale))
        message = messages.inconsistent(
            problem, float(st.t), worst, int(run.plan.row_from[row]), float(abs(delta[worst]))
        )
        h, move = _shrink_while_moving(run, h, move, JUMP_LIMIT)
        if not move <= JUMP_LIMIT:
            return Status.INCONSISTENT_START, message
        first_given, smallest_given = run.steps_given
        if not smallest_given:
            st.h_min = min(st.h_min, SMALLEST_OF_FIRST * h)
        if not first_given:
            st.h = max(min(st.h, h * min(1.0, FIRST_MOVE / move)), st.h_min)
    if run.options.errors is not None and h < st.h:
        run.start_note += _algebraic_note(run)
    return None


def _settle_first_step(run: Run) -> Failure | None:
    """Choose the pivots of the first step, and a longer one, if implicit Euler stays close to its prediction over that.

    Very short steps are no safer: rounding is divided by them, twice in equations of index three.
    """
    st = run.state
    least = st.h
    h = 0.0 if run.steps_given[0] else min(FIRST_TRIED * (st.t_end - st.t), st.h_max)
    for _ in range(TRIALS):
        if h <= least:
            break
        error = _euler_error(run, h) if choose_first_pivots(run, h) is None else np.inf
        if error <= FIRST_ERROR:
            st.h = h
            return None
        h *= max(0.5 * np.sqrt(FIRST_ERROR / error), least / h) if np.isfinite(error) else 1e-4
    return choose_first_pivots(run, least)


def _euler_error(run: Run, h: float) -> float:
    """Return the error of a step of implicit Euler from the start, in units of the tolerance."""
    st = run.state
    rates = st.yp
    y = st.y + h * rates
    run.problem.residual(st.t + h, y, rates, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1
    if not np.isfinite(st.res).all():
        return np.inf
    direct(solve)(run.plan, run.factors, st.res, st.delta)
    return 0.5 * float((np.abs(st.delta) * st.w_error * st.differential).max())


def _algebraic_note(run: Run) -> str:
    """Name the algebraic unknowns whose starting values the first step has to replace."""
    st = run.state
    y, res, delta = st.y, st.res, st.delta
    allowed = JUMP_LIMIT * (st.atol + st.rtol * np.abs(y))
    replaced = (np.abs(delta) > allowed) & (st.differential == 0.0)
    # over a vanishing step an equation that is satisfied up to rounding can move an unknown of a high index too
    if not np.max(np.abs(res)) > ROUNDED_RESIDUAL * (1.0 + np.max(np.abs(y))):
        replaced[:] = False
    return messages.replaced_start(run.problem, np.flatnonzero(replaced))


def _repair_within(run: Run, h: float, limit: float, refusal: Failure | None) -> Failure | None:
    """Move the initial values onto the equations if none moves by more than a number of tolerances, else refuse.

    Without a refusal they are left as they were.
    """
    st = run.state
    start, note = st.y.copy(), run.start_note
    places = (st.y, newest_point(st), st.record_y[0, : len(start)], *st.y_out[: st.next_output])
    if choose_first_pivots(run, h) is not None or not _correction(run) <= limit:
        return refusal
    failure = _repair(run, h)
    back = st.differential == 0.0
    # multipliers over a vanishing step are impulses; those of the state are near, and the first step finds them
    if failure is not None or np.max(np.abs(st.y - start) * st.w_error) > limit:
        if refusal is not None:
            return failure or refusal
        back[:], run.start_note = True, note
    for row in places:
        row[back] = start[back]
    return None


def _repair(run: Run, h: float) -> Failure | None:
    """Move the initial values onto the constraints by Newton's method over a vanishing step, where they are off."""
    st = run.state
    h, move = _shrink_while_moving(run, h, _correction(run), REPAIR_FROM)
    if move <= REPAIR_FROM:
        return None
    gamma = 1.0 / h
    y, rates, start = st.y, st.yp.copy(), newest_point(st).copy()
    for sweep in range(REPAIR_SWEEPS + 1):
        if sweep == REPAIR_SWEEPS:
            # multipliers have taken the jump for a rate: solve for them once more from where it has led
            newest_point(st)[:] = y
        st.yp[:] = rates + gamma * (y - newest_point(st))
        _residual(run)
        if not np.isfinite(_correction(run)):
            break
        y -= st.delta if sweep < REPAIR_SWEEPS else np.where(st.differential != 0.0, 0.0, st.delta)
    st.yp[:] = rates
    newest_point(st)[:] = y
    st.record_y[0, : len(y)] = y
    if st.next_output:
        st.y_out[0] = y
    _residual(run)
    off = float(np.max(np.abs(y - start) * st.w_error)) if np.isfinite(y).all() else np.inf
    if np.isfinite(off) and _correction(run) <= max(REPAIR_FROM, CHECK_RATIO * off):
        moved = np.flatnonzero(np.abs(y - start) * st.w_error > REPAIR_FROM)
        run.start_note += messages.repaired_start(run.problem, moved, y - start)
        return None
    worst = int(np.argmax(np.abs(np.where(np.isfinite(y), st.delta, np.inf)) * st.w_error))
    return Status.INCONSISTENT_START, messages.not_repaired(run.problem, float(st.t), worst)
