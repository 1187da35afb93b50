"""The compiled step loop of WSTIFF and GSTIFF.

`advance` takes accepted steps until a limit, without Python and without the GIL, by the parts below: open the step,
choose its end, predict, form the matrix, solve, test the error, refuse or accept, deliver events and outputs, close.
All they know lies in `RunState`, so the loop can return at any time and be called again. It returns early when only
Python can help: for new pivots, when a buffer is full, and after a change of coordinates.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators import bdf
from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.algebraic.part import PART_TYPE
from gearmbs.dae.integrators.branches import is_lost, keeps_its_index, kept_its_index, passes_pole, stays_on_branch
from gearmbs.dae.integrators.controller import UNFORESEEN, after_error_failure, after_start, after_success, meets_kinks
from gearmbs.dae.integrators.corrector import (
    CONVERGED,
    NOT_FINITE,
    SLOW,
    accept_noise,
    correct,
    count_noise,
    equations_hold,
    first_not_finite,
    forget_noise,
    remember_noise,
    renew_weights,
    weighted_argmax,
    weighted_max,
)
from gearmbs.dae.integrators.events import RECORD, STOP, cut_step, end_of_step, locate_events, write_outputs
from gearmbs.dae.integrators.newton_matrix import MATRIX_MAX_AGE, SLOPE_MAX_AGE, form_matrix, renew_matrix
from gearmbs.dae.integrators.options import BESIDE, ROUNDED_STEP
from gearmbs.dae.integrators.restart import shorten_first_step, start_afresh, take_block
from gearmbs.dae.integrators.run_state import (
    STATE_TYPE,
    copy,
    forget,
    open_row,
    record_history,
    respace,
    rows_from,
    times_from,
)
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE
from gearmbs.dae.problem import HISTORY_CHANGED
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import int64
from gearmbs.kernels.placed import unbound
from gearmbs.kernels.pointers import FUNCTIONS_TYPE

MAX_FAILS = 16
NEWTON_SHRINK = 0.25
"""Ratio of a step to the one before it whose corrector failed with a fresh matrix: as in DASSL, IDA and CVODE."""
RESTART_AFTER = 6
DROP_AFTER = 3
DROP_LEVELS = 3
DOUBTS = 3
"""Failures of the corrector after which entries left out are looked at; if harmless so often, they are."""
RENEWALS = 3
RENEWALS_AT_JUMPS = 20
"""The same where shorter steps have not helped: an algebraic unknown may jump, and Newton's method has a long way."""
SAME_ERROR = 0.1
"""Relative change of the error up to which it is the same in two attempts, the second shorter at least by a fifth.
Tuned, see the table of constants."""
JUMP_LIMIT = 100.0
"""Tolerances by which a first step may move an unknown that does not move by less in a shorter one: values of the start
that are off by more are refused, and a run passes no larger jump. Its error is half of that, as of any first step."""
FORESEEN = 10.0
"""Tolerances by which the first step beyond a possible discontinuity may miss its prediction: a step that is much
shorter than its past has so small a constant of the error that it would pass any jump. Smooth solutions miss it by up
to 7 where the error is one, at order six."""
LANDED = 0.999
"""Fraction of the size wanted below which a step counts as shortened to land on a stop."""


IN_TURN = 2
"""Communication points in a row with a jump from which on steps land on the next one."""
CLOSE = 0.05
"""Part of the step before below which the point of a jump replaces the one behind it, and no step lands: differences
over a shorter distance would amplify what the polynomial through both is off by."""
STRETCH = 1.1
"""Ratio to the step wanted by which equal steps may be longer so that fewer of them land on a communication point.
With 1.05, 1.1, 1.2 and 1.35 the pair takes 8500, 8638, 8994 and 9531 residuals for a thousand points."""


@njit(cache=True, nogil=True, error_model="numpy")
def open_step(st):
    """Take a row of the history for the next step, unless one is open already.

    Returns
    -------
    code : int
        RUNNING, FAIL_TOO_MANY_STEPS or BUFFER_FULL.
    """
    if st.open:
        return s.RUNNING
    if st.max_steps > 0 and st.steps >= st.max_steps:
        return s.FAIL_TOO_MANY_STEPS
    full = st.n_crossings + st.most_crossings > st.crossing_t.shape[0]
    if full or st.n_records + 2 * bdf.HISTORY > st.record_t.shape[0]:
        return s.BUFFER_FULL
    open_row(st)
    st.open = True
    st.error_fails = 0
    st.newton_fails = 0
    st.nan_fails = 0
    st.singular_fails = 0
    st.drop_failed = False
    st.start_tries = 0
    st.worst_row = -1
    st.jumped = -1
    st.pole_met = False
    st.index_changes = False
    st.violation = 0.0
    st.h = max(st.h, st.h_min, ROUNDED_STEP * abs(st.t))
    st.h_first = st.h
    st.h_refused = np.inf
    st.error = 0.0
    return s.RUNNING


@njit(cache=True, nogil=True, error_model="numpy")
def fitted_end(h, t, stop):
    """Return the end of a step of about ``h``: not beyond ``stop``, and without a sliver left before it."""
    if t + 1.0001 * h >= stop:
        return stop
    if t + 2.0 * h > stop:
        return t + 0.5 * (stop - t)
    return t + h


@njit(cache=True, nogil=True, error_model="numpy")
def lands(st, t, h_min, stop):
    """Return whether steps from ``t`` land on the communication point that is gone to.

    A held run goes past it, and is cut back where an input is set there. Where that was so at the last points it is
    going to be so again, most likely.
    """
    way = st.asked - t
    return st.jumps_in_turn >= IN_TURN and st.asked <= stop and way > CLOSE * st.h and way > h_min


@njit(cache=True, nogil=True, error_model="numpy")
def landing_end(h, t, stop, stretch):
    """Return the end of the first of equal steps that land on ``stop``: as few as are at most ``stretch * h`` long."""
    count = np.ceil((stop - t) / (stretch * h))
    return stop if count <= 1.0 else t + (stop - t) / count


@njit(cache=True, nogil=True, error_model="numpy")
def choose_end(st):
    """Choose end, size and order of the attempt, and set the weights of its tests.

    Returns
    -------
    code : int
        RUNNING, or the failure that has brought the step below its limit.
    """
    times = times_from(st, 1)
    t_old = times[0]
    other_fails = st.error_fails + st.newton_fails
    if other_fails + st.nan_fails > MAX_FAILS:
        # a step down to rounding may take more attempts than are allowed
        return s.FAIL_NOT_FINITE if st.nan_fails > other_fails else s.FAIL_TOO_MANY_REJECTIONS
    st.h = min(st.h, st.h_max)
    h_min = max(st.h_min, ROUNDED_STEP * abs(t_old))
    stop = st.t_end
    wanted = st.h
    if st.next_stop < st.stops.shape[0]:
        stop = min(stop, st.stops[st.next_stop])
        if st.passing:
            # at its ends alone an interval between two stops may be as the ones beside it
            wanted = min(wanted, 0.5 * (stop - t_old))
    if not st.interpolate and st.next_output < st.outputs.shape[0]:
        stop = min(stop, st.outputs[st.next_output])
    if lands(st, t_old, h_min, stop):
        t = landing_end(wanted, t_old, st.asked, STRETCH if other_fails == 0 else 1.0)
        stop = st.asked
    else:
        t = fitted_end(wanted, t_old, stop)
    if t - t_old < h_min and t < stop and st.h_refused > (1.0 + 1e-9) * h_min:
        st.h = h_min
        t = fitted_end(h_min, t_old, stop)
    h = t - t_old
    if t <= t_old or (h < (1.0 - 1e-9) * h_min and t < stop):
        if st.nan_fails > 0:
            return s.FAIL_NOT_FINITE
        if st.newton_fails > st.error_fails:
            return s.FAIL_NEWTON
        return s.FAIL_STEP_TOO_SMALL
    st.t_old = t_old
    st.t_new = t
    # at a stop the equations may have jumped already
    st.landing = st.next_stop < st.stops.shape[0] and t >= st.stops[st.next_stop]
    st.t_seen = np.nextafter(t, t_old) if st.landing else t
    if st.landing and st.jump_before_stop:
        st.t_seen = t - min(BESIDE * abs(t), 0.5 * h)
    st.step = h
    st.h_wanted = st.h
    st.h = h
    st.h_refused = h
    renew_weights(st, rows_from(st, 1)[0], h)
    if st.fixed_leading and st.n_past > 1 and respace(st):
        record_history(st, 1)
    st.order = min(st.order, max(1, st.n_past - 1))
    return s.RUNNING


@njit(cache=True, nogil=True, error_model="numpy")
def predict(st):
    """Set coefficients and prediction of the open step, and start the iterate there."""
    t, h, k = st.t_new, st.step, st.order
    y, yp, y_pred, yp_pred = st.y, st.yp, st.y_pred, st.yp_pred
    rows = rows_from(st, 1)
    if st.n_past == 1:
        st.gamma = 1.0 / h
        st.error_constant = 0.5
        for i in range(y.shape[0]):
            yp_pred[i] = st.yp_start[i]
            y_pred[i] = rows[0, i] + h * yp_pred[i]
    else:
        times = times_from(st, 1)
        st.gamma = bdf.step_coefficients(t, times, k, st.value, st.slope)
        st.error_constant = bdf.error_constant(t, times, k)
        bdf.predict(st.value, st.slope, k + 1, rows, y_pred, yp_pred)
    copy(y_pred, y)
    copy(yp_pred, yp)


@njit(cache=True, nogil=True, error_model="numpy")
def solve_step(functions, st, plan, factors):
    """Run the corrector; renew its matrix at the iterate, or excuse it by rounding, where it converges too slowly.

    Returns
    -------
    code : int
        CONVERGED, SLOW or NOT_FINITE.
    """
    code = correct(functions, st, plan, factors)
    renewals = 0
    sound = True
    most = RENEWALS if st.newton_fails <= DROP_AFTER else RENEWALS_AT_JUMPS
    while code == SLOW and st.matrix_fresh and sound and renewals < most:
        # contacts or multipliers are not as predicted: the matrix at the iterate knows them
        renewals += 1
        sound = renew_matrix(functions, st, plan, factors)
        if sound:
            code = correct(functions, st, plan, factors)
    if code == CONVERGED and st.has_index_one and not stays_on_branch(functions, st, plan, factors):
        code = SLOW
    if code == CONVERGED and st.watches_pencil and not keeps_its_index(functions, st, plan, factors):
        code = SLOW
    told = st.has_index_one or not st.constrained
    if code == CONVERGED and st.drop_level > 0 and told and not equations_hold(functions, st):
        # the corrections say nothing of the equations that were set aside; constraints that a singular position sets
        # aside for a step are met again in the next one
        code = SLOW
    remember_noise(st)
    if code == SLOW and sound and accept_noise(st, plan, factors, False):
        # multipliers may be off by what rounding makes of them, unknowns that equations of their own determine not
        code = SLOW if st.has_index_one and not equations_hold(functions, st) else CONVERGED
    return code


@njit(cache=True, nogil=True, error_model="numpy")
def step_before_jump(st):
    """Try a refused step that lands on a stop once more, with the equations as they are a little before; return so.

    The time at which they jump may be computed in another way than that of the stop, and come before it by rounding.
    """
    if not st.landing or st.jump_before_stop:
        return False
    st.jump_before_stop = True
    st.matrix_wanted = True
    st.h = st.h_wanted
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def refuse_by_newton(st, code):
    """Choose how to go on after the corrector failed: with a new matrix, a smaller step, or other pivots.

    Returns
    -------
    code : int
        RUNNING to try again, REPIVOT to leave small pivots out, or have fewer entries left out, first.
    """
    st.matrix_wanted = True
    if code != NOT_FINITE and not st.matrix_fresh:
        st.h = st.h_wanted
        return s.RUNNING
    st.newton_rejections += 1
    if step_before_jump(st) or start_afresh(st):
        return s.RUNNING
    st.h = NEWTON_SHRINK * st.step
    if code == NOT_FINITE:
        bad = first_not_finite(st.res)
        st.worst = bad if bad >= 0 else first_not_finite(st.delta)
        st.nan_fails += 1
        return s.RUNNING
    st.worst = weighted_argmax(st.delta, st.w_newton)
    st.newton_fails += 1
    st.since_change = 0
    st.caution = 2
    if st.newton_fails > DROP_AFTER:
        st.order = 1
        if st.drop_level < DROP_LEVELS and not st.drop_failed:
            # perhaps a singular position: go through it with the step it began with, some pivots dropped
            st.drop_level += 1
            st.drop_age = 0
            st.h = st.h_first
            return s.REPIVOT
        if not st.drop_failed:
            # it is none, or not to be passed: smaller steps come nearer to where the equations end
            st.drop_failed = True
            st.drop_level = 0
            st.h = NEWTON_SHRINK ** (DROP_AFTER + 1) * st.h_first
            return s.REPIVOT
    if st.left_out and st.doubts < DOUBTS:
        st.doubts += 1
        return s.REPIVOT
    return s.RUNNING


@njit(cache=True, nogil=True, error_model="numpy")
def correction_norm(st, row):
    """Store the corrector's result in ``row`` and its distance from the prediction in ``st.delta``; return its norm."""
    y, y_pred, delta = st.y, st.y_pred, st.delta
    for i in range(y.shape[0]):
        delta[i] = y[i] - y_pred[i]
        row[i] = y[i]
    if st.n_past <= 1:
        # algebraic unknowns may jump where a run starts afresh; eps and v_f, which follow from momenta, may not
        for i in range(y.shape[0]):
            delta[i] *= st.differential[i]
    return weighted_max(delta, st.w_error)


@njit(cache=True, nogil=True, error_model="numpy")
def passes_error_test(st, plan, factors):
    """Store the result as the newest point and return whether its local error is within the tolerance, or rounding."""
    row = rows_from(st, 0)[0]
    constant = st.error_constant
    times_from(st, 0)[0] = st.t_new
    before = st.error
    st.error = constant * correction_norm(st, row)
    # the coefficients of a prediction of order k, C(k + 1, j), add up to 2^(k + 1) - 1
    noise = 2.0 ** (st.order + 1) * st.noise
    allowed = 1.0 + constant * noise
    if st.passing and st.n_past > 1:
        allowed = min(allowed, constant * (FORESEEN + noise))
    if st.error <= allowed:
        return True
    if st.n_past == 1 and st.error_fails > 1 and st.error <= constant * JUMP_LIMIT:
        # what steps of any size show is no error of theirs, but what an earlier corrector has left
        if abs(st.error - before) <= SAME_ERROR * st.error:
            return True
    if not accept_noise(st, plan, factors, True):
        return False
    copy(st.y, row)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def refuse_by_error(st):
    """Choose order and size of the next attempt after the error test failed."""
    forget_noise(st)
    st.error_rejections += 1
    if step_before_jump(st):
        return
    st.since_kink = 0
    st.error_fails += 1
    st.worst = weighted_argmax(st.delta, st.w_error)
    st.worst_error = st.worst
    if start_afresh(st):
        return
    if st.n_past == 1 and st.starting:
        shorten_first_step(st)
        return
    st.starting = False
    after_error_failure(st, st.error, st.error_fails)
    if st.error_fails == RESTART_AFTER and st.n_past > 1:
        # a jump, most likely: the past says nothing about what comes
        times, rows = times_from(st, 1), rows_from(st, 1)
        for i in range(st.y.shape[0]):
            st.yp_start[i] = (rows[0, i] - rows[1, i]) / (times[0] - times[1])
        forget(st)
        st.starting = False


@njit(cache=True, nogil=True, error_model="numpy")
def accept(st):
    """Take the result as the new point of the history."""
    if st.n_past == 1:
        start = rows_from(st, 1)[0]
        for i in range(st.y.shape[0]):
            if st.differential[i] == 0.0:
                start[i] = st.y[i]
    st.steps += 1
    st.since_kink = 0 if st.error > UNFORESEEN and meets_kinks(st) else st.since_kink + 1
    st.passing = False
    st.open = False
    st.matrix_fresh = False
    st.matrix_age += 1
    st.drop_age += 1
    count_noise(st)
    record_watched(st)
    st.n_past = min(st.n_past + 1, bdf.HISTORY)
    st.t = st.t_new
    if st.rate > st.rate_allowed:
        st.matrix_wanted = True


@njit(cache=True, nogil=True, error_model="numpy")
def deliver(functions, st, part):
    """Deliver crossings, outputs and the record of the accepted step, and prepare the next one.

    Returns
    -------
    code : int
        RUNNING, DONE, TERMINAL, PAUSED or FAIL_NOT_FINITE.
    """
    cut = st.t_new
    action = RECORD
    if st.n_events > 0:
        cut, action = locate_events(functions, st, part)
        if not end_of_step(st):
            return s.FAIL_NOT_FINITE
    part.t_first = st.stops[st.next_stop - 1] if st.next_stop > 0 else part.t_start
    part.t_last = st.stops[st.next_stop] if st.next_stop < st.stops.shape[0] else part.t_end
    write_outputs(functions, st, part, cut)
    if action != RECORD and cut < st.t_new:
        cut_step(functions, st, part, cut)
    record_step(st)
    if action == STOP:
        return s.TERMINAL
    at_stop = st.next_stop < st.stops.shape[0] and st.t >= st.stops[st.next_stop]
    if at_stop:
        st.next_stop += 1
        st.jump_before_stop = False
    afresh = at_stop or action != RECORD
    if afresh:
        st.restarts += 1
        st.sign_last = 0.0
        st.sign_pencil = 0.0
        copy(st.yp, st.yp_start)
        st.matrix_wanted = True
        st.passing = True
    choose_next(st)
    return close_step(functions, st)


@njit(cache=True, nogil=True, error_model="numpy")
def record_watched(st):
    """Keep what the corrector's last evaluation has left in the watched places, before another one comes."""
    n, watched, work = st.y.shape[0], st.watched, st.work
    if watched.shape[0] > 0:
        row = st.record_y[st.n_records]
        for k in range(watched.shape[0]):
            row[n + k] = work[watched[k]]


@njit(cache=True, nogil=True, error_model="numpy")
def record_step(st):
    """Append the accepted step to the records."""
    p = st.n_records
    st.record_t[p] = st.t
    st.record_h[p] = st.t - st.t_old
    st.record_order[p] = st.order
    if st.keep_rows:
        copy(st.y, st.record_y[p])
    st.n_records = p + 1


@njit(cache=True, nogil=True, error_model="numpy")
def choose_next(st):
    """Set order and size of the step after an accepted one."""
    h, h_wanted = st.step, st.h_wanted
    landed = h < LANDED * h_wanted
    if st.noisy:
        if landed:
            st.h = h_wanted
        return
    if st.starting:
        after_start(st)
    else:
        after_success(st)
    if landed and st.h >= h:
        # shortened only to land: go on with the size the error test had asked for
        before = min(h_wanted, 2.0 * st.h) if st.interpolate else h_wanted
        # a step is shorter at most points where they are landed on, and has to grow nevertheless
        st.h = max(st.h, before) if st.jumps_in_turn >= IN_TURN else before


@njit(cache=True, nogil=True, error_model="numpy")
def close_step(functions, st):
    """End the run at its end time; let the hook look at the new point, and heed what it says.

    Returns
    -------
    code : int
        RUNNING, DONE, or PAUSED after a change of coordinates.
    """
    if st.t >= st.t_end:
        st.index_changes = st.watches_pencil and not kept_its_index(functions, st)
        return s.DONE
    if st.has_hook:
        rows = rows_from(st, 0)
        answer = functions.hook(st.t, rows, st.n_past, st.idata, st.rdata, st.work)
        if answer != 0:
            st.matrix_wanted = True
        if answer == HISTORY_CHANGED:
            st.slope_age = SLOPE_MAX_AGE
            st.sign_last = 0.0
            st.sign_pencil = 0.0
            copy(rows[0], st.y)
            record_history(st, 0)
            return s.PAUSED
    return s.RUNNING


@njit(cache=True, nogil=True, error_model="numpy")
def _take_steps(functions, st, part, plan, factors, max_accepted):
    """Take steps, see `advance`; return the code."""
    accepted = 0
    while accepted < max_accepted and st.t < st.t_pause:
        code = open_step(st)
        if code == s.RUNNING:
            code = take_block(functions, st, plan, factors)
        if code == s.RUNNING:
            code = choose_end(st)
        if code != s.RUNNING:
            return code
        predict(st)
        code = form_matrix(functions, st, plan, factors)
        if code != s.RUNNING:
            return code
        code = solve_step(functions, st, plan, factors)
        if code != CONVERGED:
            code = refuse_by_newton(st, code)
            if code != s.RUNNING:
                return code
        elif not passes_error_test(st, plan, factors):
            refuse_by_error(st)
        elif passes_pole(functions, st):
            forget_noise(st)
            code = refuse_by_newton(st, SLOW)
            if code != s.RUNNING:
                return code
        elif st.matrix_age >= MATRIX_MAX_AGE - 1 and not st.constrained and is_lost(functions, st, plan, factors):
            return s.FAIL_NEWTON
        else:
            accept(st)
            accepted += 1
            code = deliver(functions, st, part)
            if code != s.RUNNING:
                return code
    return s.RUNNING


@njit(
    int64(FUNCTIONS_TYPE, STATE_TYPE, PART_TYPE, PLAN_TYPE, FACTORS_TYPE, int64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def advance(bound, st, part, plan, factors, max_accepted):
    """Take at most ``max_accepted`` accepted steps, none after one that ends at ``st.t_pause`` or later.

    Parameters
    ----------
    bound : Functions
        Residual, Jacobian, hook and events.
    st : RunState
        State, read and written.
    part : AlgebraicPart
        What is solved for at outputs and crossings.
    plan, factors : LUPlan, LUFactors
        Plan and numbers of the sparse factorisation.
    max_accepted : int

    Returns
    -------
    code : int
        RUNNING, DONE, TERMINAL, PAUSED, REPIVOT, BUFFER_FULL or a failure of `gearmbs.dae.integrators.run_state`; kept
        in ``st.code``, too, where an exception of Python cannot lose it.
    """
    st.code = _take_steps(unbound(bound), st, part, plan, factors, max_accepted)
    return st.code
