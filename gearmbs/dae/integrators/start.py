"""The start of a run: its first and smallest step, its first pivots, and whether the initial values can be used.

All scales come from the problem itself: how fast the unknowns leave their tolerances, and what short steps of implicit
Euler do to them. The span only bounds the first step from above, and offers a longer one to try.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.integrators import messages
from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.linalg.sparse_lu import solve
from gearmbs.dae.result import Status

if TYPE_CHECKING:
    from gearmbs.dae.integrators.driver import Run

Failure = tuple[Status, str]

FIRST_MOVE = 0.5
"""Tolerances by which the fastest unknown may move in the first step."""
FIRST_OF_SPAN = 1e-3
FIRST_TRIED = 1e-7
"""Part of the span that is tried as the first step where the fastest unknown would want a shorter one."""
FIRST_ERROR = 0.25
TRIALS = 4
SMALLEST_OF_SPAN = 1e-14
SMALLEST_OF_FIRST = 1e-6
CHECK_STEP = 1e-10
CHECK_ROUNDS = 12
CHECK_RATIO = 0.01
"""The step of the check shrinks by this in each round: from 1e-10 to 1e-34 of the span."""
JUMP_LIMIT = 100.0
REPAIR_FROM = 1.0
REPAIR_SWEEPS = 4
ROUNDED_RESIDUAL = 1e-10


def choose_steps(run: Run, first_step: float | None, min_step: float | None) -> None:
    """Set the smallest step, and a first one that can do no harm, where the caller has not.

    Parameters
    ----------
    run : Run
        With weights set at the start.
    first_step, min_step : float or None
        HINIT and HMIN.
    """
    st = run.state
    span = st.real[s.T_END] - st.real[s.T]
    natural = FIRST_OF_SPAN * span
    speed = float(np.max(np.abs(st.vec[s.YP_START]) * st.vec[s.W_ERROR]))
    if speed > 0.0:
        natural = min(natural, FIRST_MOVE / speed)
    smallest = min(SMALLEST_OF_SPAN * span, SMALLEST_OF_FIRST * natural)
    run.steps_given = first_step is not None, min_step is not None
    st.real[s.H_MIN] = smallest if min_step is None else min_step
    st.real[s.H] = max(min(natural, st.real[s.H_MAX]), st.real[s.H_MIN]) if first_step is None else first_step


def begin(run: Run) -> Failure | None:
    """Evaluate the equations at the start, choose the first pivots and check consistency.

    Returns
    -------
    failure : (Status, str) or None
    """
    st, problem = run.state, run.problem
    t0 = float(st.real[s.T])
    _residual(run)
    if run.user_exception() is not None:
        return run.user_failure()
    bad = np.flatnonzero(~np.isfinite(st.vec[s.RES]))
    if len(bad):
        return Status.NOT_FINITE, messages.not_finite(problem, t0, int(bad[0]))
    if st.count[s.HAS_EVENTS] and problem.events is not None:
        problem.events(t0, st.vec[s.Y], st.vec[s.YP], st.g_old, st.idata, st.rdata, st.work)
        bad = np.flatnonzero(~np.isfinite(st.g_old))
        if len(bad) and run.user_exception() is None:
            return Status.NOT_FINITE, messages.event_not_finite(problem, t0, int(bad[0]))
    # over a vanishing step wrong rates are harmless, but values off the constraints still have to jump
    span = st.real[s.T_END] - t0
    tried = [min(st.real[s.H], CHECK_STEP * span), st.real[s.H]]
    if not run.steps_given[0]:
        tried.append(min(FIRST_TRIED * span, st.real[s.H_MAX]))
    failure = None
    for h in tried:
        # an index-3 matrix is singular to working precision at a very short step: check over a longer one
        failure = choose_first_pivots(run, h)
        if failure is None:
            break
    if failure is not None:
        return failure
    st.real[s.H] = max(st.real[s.H], h)
    failure = _check(run, h) if run.check_start else _repair(run, h)
    if failure is None:
        failure = choose_first_pivots(run, st.real[s.H])
    return failure if failure is not None else _lengthen(run)


def choose_first_pivots(run: Run, h: float) -> Failure | None:
    """Factor the Newton matrix of a first step of size ``h``; return a failure or None."""
    st = run.state
    run.problem.jacobian(st.real[s.T], st.vec[s.Y], st.vec[s.YP], 1.0 / h, st.matrix, st.idata, st.rdata, st.work)
    st.count[s.JACOBIANS] += 1
    run.first_pivots += 1
    return run.repivot()


def _residual(run: Run) -> None:
    st = run.state
    run.problem.residual(st.real[s.T], st.vec[s.Y], st.vec[s.YP], st.vec[s.RES], st.idata, st.rdata, st.work)
    st.count[s.RESIDUALS] += 1


def _correction(run: Run) -> float:
    """Solve for the Newton correction of the start; return its size in units of the tolerance."""
    st = run.state
    solve(run.plan, run.factors, st.vec[s.RES], st.vec[s.DELTA])
    return float(np.max(np.abs(st.vec[s.DELTA]) * st.vec[s.W_ERROR]))


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
        delta = st.vec[s.DELTA]
        assert run.plan is not None
        worst = int(np.argmax(np.abs(delta) * st.vec[s.W_ERROR]))
        row = int(np.argmax(np.abs(st.vec[s.RES][run.plan.row_from]) * run.plan.row_scale))
        message = messages.inconsistent(
            problem, float(st.real[s.T]), worst, int(run.plan.row_from[row]), float(abs(delta[worst]))
        )
        h, move = _shrink_while_moving(run, h, move, JUMP_LIMIT)
        if not move <= JUMP_LIMIT:
            return Status.INCONSISTENT_START, message
        first_given, smallest_given = run.steps_given
        if not smallest_given:
            st.real[s.H_MIN] = min(st.real[s.H_MIN], SMALLEST_OF_FIRST * h)
        if not first_given:
            st.real[s.H] = max(min(st.real[s.H], h * min(1.0, FIRST_MOVE / move)), st.real[s.H_MIN])
    if run.error_probe is not None and h < st.real[s.H]:
        run.start_note = _algebraic_note(run)
    return None


def _lengthen(run: Run) -> Failure | None:
    """Take a longer first step, if one of implicit Euler stays close enough to its prediction.

    Very short steps are no safer: rounding is divided by them, twice in equations of index three.
    """
    st = run.state
    least = st.real[s.H]
    span = st.real[s.T_END] - st.real[s.T]
    h = min(FIRST_TRIED * span, st.real[s.H_MAX])
    if run.steps_given[0]:
        return None
    for _ in range(TRIALS):
        if h <= least:
            break
        if choose_first_pivots(run, h) is None:
            error = _euler_error(run, h)
            if error <= FIRST_ERROR:
                st.real[s.H] = h
                return None
        else:
            error = np.inf
        h *= max(0.5 * np.sqrt(FIRST_ERROR / error), least / h) if np.isfinite(error) else 1e-4
    return choose_first_pivots(run, least)


def _euler_error(run: Run, h: float) -> float:
    """Return the error of a step of implicit Euler from the start, in units of the tolerance."""
    st = run.state
    rates = st.vec[s.YP]
    y = st.vec[s.Y] + h * rates
    run.problem.residual(st.real[s.T] + h, y, rates, st.vec[s.RES], st.idata, st.rdata, st.work)
    st.count[s.RESIDUALS] += 1
    if not np.isfinite(st.vec[s.RES]).all():
        return np.inf
    solve(run.plan, run.factors, st.vec[s.RES], st.vec[s.DELTA])
    return 0.5 * float(np.max(np.abs(st.vec[s.DELTA]) * st.vec[s.W_ERROR] * st.vec[s.IS_DIFFERENTIAL]))


def _algebraic_note(run: Run) -> str:
    """Name the algebraic unknowns whose starting values the first step has to replace."""
    st = run.state
    y, res, delta = st.vec[s.Y], st.vec[s.RES], st.vec[s.DELTA]
    allowed = JUMP_LIMIT * (st.vec[s.ATOL] + st.real[s.RTOL] * np.abs(y))
    replaced = (np.abs(delta) > allowed) & ~run.problem.differential
    # over a vanishing step an equation that is satisfied up to rounding can move an unknown of a high index too
    if not np.max(np.abs(res)) > ROUNDED_RESIDUAL * (1.0 + np.max(np.abs(y))):
        replaced[:] = False
    return messages.replaced_start(run.problem, np.flatnonzero(replaced))


def _repair(run: Run, h: float) -> Failure | None:
    """Move the initial values onto the constraints by Newton's method over a vanishing step, where they are off."""
    st = run.state
    h, move = _shrink_while_moving(run, h, _correction(run), REPAIR_FROM)
    if move <= REPAIR_FROM:
        return None
    gamma = 1.0 / h
    y, rates, start = st.vec[s.Y], st.vec[s.YP].copy(), st.hist[0].copy()
    for sweep in range(REPAIR_SWEEPS + 1):
        if sweep == REPAIR_SWEEPS:
            # multipliers have taken the jump for a rate: solve for them once more from where it has led
            st.hist[0] = y
        st.vec[s.YP] = rates + gamma * (y - st.hist[0])
        _residual(run)
        if not np.isfinite(_correction(run)):
            break
        y -= st.vec[s.DELTA] if sweep < REPAIR_SWEEPS else np.where(run.problem.differential, 0.0, st.vec[s.DELTA])
    st.vec[s.YP] = rates
    st.hist[0] = y
    st.rec_y[0] = y
    if st.count[s.NEXT_OUTPUT]:
        st.y_out[0] = y
    _residual(run)
    off = float(np.max(np.abs(y - start) * st.vec[s.W_ERROR])) if np.isfinite(y).all() else np.inf
    if np.isfinite(off) and _correction(run) <= max(REPAIR_FROM, CHECK_RATIO * off):
        moved = np.flatnonzero(np.abs(y - start) * st.vec[s.W_ERROR] > REPAIR_FROM)
        run.start_note = messages.repaired_start(run.problem, moved, y - start)
        return None
    worst = int(np.argmax(np.abs(np.where(np.isfinite(y), st.vec[s.DELTA], np.inf)) * st.vec[s.W_ERROR]))
    return Status.INCONSISTENT_START, messages.not_repaired(run.problem, float(st.real[s.T]), worst)
