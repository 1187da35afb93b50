"""The compiled step loop of WSTIFF and GSTIFF.

`advance` takes accepted steps until a limit, without Python and without the GIL. All it knows lies in `RunState`, so it
can return at any time and be called again. It returns early when only Python can help: for new pivots, when a buffer is
full, and after a change of coordinates.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64, njit, types

from gearmbs.dae.compiled.bound_functions import FUNCTIONS_TYPE
from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.bdf import HISTORY, error_constant, predict, step_coefficients
from gearmbs.dae.integrators.controller import after_error_failure, after_success
from gearmbs.dae.integrators.corrector import (
    CONVERGED,
    NOT_FINITE,
    SLOW,
    correct,
    first_not_finite,
    set_weights,
    settle_for_noise,
    weighted_argmax,
    weighted_max,
)
from gearmbs.dae.integrators.events import RECORD, STOP, interpolate, locate_events, write_outputs
from gearmbs.dae.integrators.run_state import STATE_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, PLAN_TYPE, factor
from gearmbs.dae.problem import HISTORY_CHANGED, JACOBIAN_SIG

EPS = 2.220446049250313e-16
ROUNDED_STEP = 16.0 * EPS
"""Smallest step in units of the time, whose last digit is as much as is left of smaller ones."""
GAMMA_DRIFT = 0.2
JAC_MAX_AGE = 50
SLOPE_MAX_AGE = 20
RATE_WORTH_RENEWING = 0.12
RATE_OF_FRESH = 0.1
MAX_FAILS = 16
NEWTON_SHRINK = 0.25
RESTART_SHRINK = 0.1
RESTART_AFTER = 6
DROP_AFTER = 3
DROP_LEVELS = 3
DROPPED_STEPS = 5
RENEWALS = 3

_VEC = float64[::1]
_IVEC = int64[::1]
_MAT = float64[:, ::1]


@njit(types.void(_VEC, _MAT, int64), cache=True, nogil=True, error_model="numpy")
def _shift(times, hist, rows):
    """Make room for a new point in front of the ``rows`` stored ones."""
    n = hist.shape[1]
    for j in range(min(rows, HISTORY - 1), 0, -1):
        times[j] = times[j - 1]
        for i in range(n):
            hist[j, i] = hist[j - 1, i]


@njit(types.void(_VEC, _IVEC, _VEC, _MAT, _MAT, int64), cache=True, nogil=True, error_model="numpy")
def _respace(real, count, times, hist, small, first):
    """Re-interpolate the history to the current step size: fixed leading coefficients (GSTIFF).

    Points from ``first`` on are moved to ``times[first] - j h`` on the polynomial of the order to be used.
    """
    h = real[s.H]
    k = min(count[s.ORDER], count[s.NPAST] - 1)
    count[s.ORDER] = max(k, 1)
    if k < 1:
        return
    t = times[first]
    if abs((t - times[first + 1]) - h) <= 1e-10 * h + 4.0 * EPS * abs(t):
        return
    nodes = times[first:]
    weights = small[s.WEIGHTS :]
    for j in range(1, k + 1):
        # value weights of the polynomial through the k + 1 old points at the new place
        for m in range(k + 1):
            w = 1.0
            for l in range(k + 1):
                if l != m:
                    w *= (t - j * h - nodes[l]) / (nodes[m] - nodes[l])
            weights[j, m] = w
    old = small[s.NODES]
    for i in range(hist.shape[1]):
        for m in range(k + 1):
            old[m] = hist[first + m, i]
        for j in range(1, k + 1):
            v = 0.0
            for m in range(k + 1):
                v += weights[j, m] * old[m]
            hist[first + j, i] = v
    for j in range(1, k + 1):
        times[first + j] = t - j * h
    count[s.NPAST] = k + 1
    count[s.SINCE_CHANGE] = 0


@njit(types.void(_IVEC, _VEC, _MAT, int64, _VEC, _VEC, _MAT, _IVEC), cache=True, nogil=True, error_model="numpy")
def _record_history(count, times, hist, first, rec_t, rec_h, rec_y, rec_order):
    """Append the rewritten history, oldest point first, as points of order 0."""
    n = hist.shape[1]
    rows = min(count[s.NPAST], HISTORY - 1)
    for j in range(rows - 1, -1, -1):
        p = count[s.N_RECORDS]
        rec_t[p] = times[first + j]
        rec_h[p] = 0.0
        rec_order[p] = 0
        if count[s.KEEP_ROWS]:
            for i in range(n):
                rec_y[p, i] = hist[first + j, i]
        count[s.N_RECORDS] = p + 1


@njit(
    types.void(types.FunctionType(JACOBIAN_SIG), float64, float64, _MAT, _VEC, _IVEC, _VEC, _VEC, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _evaluate_jacobian(jacobian, t, gamma, vec, real, count, jac, jac_slope, idata, rdata, work):
    """Evaluate the Newton matrix at the prediction, and now and then its slope dG/dy' by a second evaluation."""
    jacobian(t, vec[s.Y], vec[s.YP], gamma, jac, idata, rdata, work)
    count[s.JACOBIANS] += 1
    count[s.SLOPE_AGE] += 1
    if count[s.SLOPE_AGE] >= SLOPE_MAX_AGE:
        jacobian(t, vec[s.Y], vec[s.YP], 2.0 * gamma, jac_slope, idata, rdata, work)
        count[s.JACOBIANS] += 1
        count[s.SLOPE_AGE] = 0
        for p in range(jac.shape[0]):
            jac_slope[p] = (jac_slope[p] - jac[p]) / gamma
    real[s.GAMMA_BASE] = gamma


@njit(types.void(float64, _VEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def _carry_over(change, jac, jac_slope, matrix):
    """Write the Newton matrix for a leading coefficient that has changed since its evaluation."""
    for p in range(jac.shape[0]):
        matrix[p] = jac[p] + change * jac_slope[p]


@njit(types.void(_VEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _restart(real, count):
    """Forget the history but its newest point and go on at order one."""
    count[s.NPAST] = 1
    count[s.ORDER] = 1
    count[s.SINCE_CHANGE] = 0
    count[s.CAUTION] = 0
    count[s.JAC_WANTED] = 1
    count[s.NOISY] = 0
    count[s.NOISY_RUN] = 0
    real[s.NOISE] = 0.0


@njit(float64(_VEC, _IVEC, float64, float64), cache=True, nogil=True, error_model="numpy")
def _fit_step(real, count, t, stop):
    """Return the end of the next step: not beyond ``stop``, and without a sliver left before it."""
    h = real[s.H]
    if t + 1.0001 * h >= stop:
        return stop
    if t + 2.0 * h > stop:
        return t + 0.5 * (stop - t)
    return t + h


@njit(
    int64(
        FUNCTIONS_TYPE,
        STATE_TYPE,
        PLAN_TYPE,
        FACTORS_TYPE,
        int64,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def advance(functions, st, plan, factors, max_accepted):
    """Take at most ``max_accepted`` accepted steps.

    Parameters
    ----------
    functions : Functions
        Residual, Jacobian, hook and events.
    st : RunState
        State, read and written.
    plan, factors : LUPlan, LUFactors
        Plan and numbers of the sparse factorisation.
    max_accepted : int

    Returns
    -------
    code : int
        RUNNING, DONE, TERMINAL, PAUSED, REPIVOT, BUFFER_FULL or a failure of `gearmbs.dae.integrators.run_state`.
    """
    residual = functions.residual
    jacobian = functions.jacobian
    hook = functions.hook
    events = functions.events
    real = st.real
    count = st.count
    times = st.times
    hist = st.hist
    vec = st.vec
    small = st.small
    idata = st.idata
    rdata = st.rdata
    work = st.work
    y = vec[s.Y]
    yp = vec[s.YP]
    y_pred = vec[s.Y_PRED]
    yp_pred = vec[s.YP_PRED]
    delta = vec[s.DELTA]
    value = small[s.VALUE]
    slope = small[s.SLOPE]
    n = y.shape[0]
    accepted = 0
    while accepted < max_accepted:
        if count[s.SHIFTED] == 0:
            if count[s.MAX_STEPS] > 0 and count[s.STEPS] >= count[s.MAX_STEPS]:
                return s.FAIL_TOO_MANY_STEPS
            if (
                count[s.N_RECORDS] + 2 * HISTORY > st.rec_t.shape[0]
                or count[s.N_CROSSINGS] + count[s.HAS_EVENTS] > st.hit_t.shape[0]
            ):
                return s.BUFFER_FULL
            _shift(times, hist, count[s.NPAST])
            count[s.SHIFTED] = 1
            count[s.ERROR_FAILS] = 0
            count[s.NEWTON_FAILS] = 0
            count[s.NAN_FAILS] = 0
            count[s.SINGULAR_FAILS] = 0
            real[s.H] = max(real[s.H], real[s.H_MIN], ROUNDED_STEP * abs(times[1]))
            real[s.H_TRY] = real[s.H]
            real[s.H_REFUSED] = np.inf
            real[s.ERROR] = 0.0
        past = times[1:]
        t_old = past[0]
        h_min = max(real[s.H_MIN], ROUNDED_STEP * abs(t_old))
        if count[s.ERROR_FAILS] + count[s.NEWTON_FAILS] + count[s.NAN_FAILS] > MAX_FAILS:
            return s.FAIL_TOO_MANY_REJECTIONS

        # step end, order and coefficients
        if real[s.H] > real[s.H_MAX]:
            real[s.H] = real[s.H_MAX]
        stop = real[s.T_END]
        if count[s.NEXT_STOP] < st.stops.shape[0]:
            stop = min(stop, st.stops[count[s.NEXT_STOP]])
        if count[s.INTERPOLATE] == 0 and count[s.NEXT_OUTPUT] < st.outputs.shape[0]:
            stop = min(stop, st.outputs[count[s.NEXT_OUTPUT]])
        t = _fit_step(real, count, t_old, stop)
        h = t - t_old
        if h < h_min and t < stop and real[s.H_REFUSED] > (1.0 + 1e-9) * h_min:
            real[s.H] = h_min
            t = _fit_step(real, count, t_old, stop)
            h = t - t_old
        if t <= t_old or (h < (1.0 - 1e-9) * h_min and t < stop):
            if count[s.NAN_FAILS] > 0:
                return s.FAIL_NOT_FINITE
            if count[s.NEWTON_FAILS] > count[s.ERROR_FAILS]:
                return s.FAIL_NEWTON
            return s.FAIL_STEP_TOO_SMALL
        set_weights(real, hist[1], h, vec)
        h_wish = real[s.H]
        real[s.H] = h
        real[s.H_REFUSED] = h
        if count[s.FIXED_LEADING] and count[s.NPAST] > 1:
            before = times[2]
            _respace(real, count, times, hist, small, 1)
            if times[2] != before:
                _record_history(count, times, hist, 1, st.rec_t, st.rec_h, st.rec_y, st.rec_order)
        k = min(count[s.ORDER], max(1, count[s.NPAST] - 1))
        count[s.ORDER] = k
        if count[s.NPAST] == 1:
            gamma = 1.0 / h
            constant = 0.5
            for i in range(n):
                yp[i] = vec[s.YP_START, i]
                y[i] = hist[1, i] + h * yp[i]
        else:
            gamma = step_coefficients(t, past, k, value, slope)
            constant = error_constant(t, past, k)
            predict(value, slope, k + 1, hist[1:], y, yp)
        for i in range(n):
            y_pred[i] = y[i]
            yp_pred[i] = yp[i]

        # Newton matrix
        drift = gamma / real[s.GAMMA_J]
        whole_again = count[s.DROP_LEVEL] > 0 and count[s.DROP_AGE] >= DROPPED_STEPS
        wanted = count[s.JAC_WANTED] != 0 or count[s.JAC_AGE] >= JAC_MAX_AGE or whole_again
        if wanted or drift > 1.0 + GAMMA_DRIFT or drift < 1.0 / (1.0 + GAMMA_DRIFT):
            if wanted:
                count[s.JAC_WANTED] = 1
                _evaluate_jacobian(jacobian, t, gamma, vec, real, count, st.jac, st.jac_slope, idata, rdata, work)
            _carry_over(gamma - real[s.GAMMA_BASE], st.jac, st.jac_slope, st.matrix)
            growth = factor(plan, factors, st.matrix)
            count[s.FACTORIZATIONS] += 1
            if whole_again:
                count[s.DROP_LEVEL] = 0
                count[s.DROP_AGE] = 0
                real[s.H] = h_wish
                return s.REPIVOT
            if not (growth <= real[s.GROWTH_MAX]):
                real[s.H] = h_wish
                return s.REPIVOT
            real[s.GAMMA_J] = gamma
            if wanted:
                count[s.JAC_WANTED] = 0
                count[s.JAC_AGE] = 0
                count[s.FRESH] = 1
                real[s.RATE] = RATE_OF_FRESH

        # corrector
        code = correct(residual, t, gamma, vec, real, count, plan, factors, idata, rdata, work)
        renewals = 0
        sound = True
        while code == SLOW and count[s.FRESH] != 0 and sound and renewals < RENEWALS:
            # contacts or multipliers are not as predicted: the matrix at the iterate knows them
            renewals += 1
            _evaluate_jacobian(jacobian, t, gamma, vec, real, count, st.jac, st.jac_slope, idata, rdata, work)
            _carry_over(0.0, st.jac, st.jac_slope, st.matrix)
            growth = factor(plan, factors, st.matrix)
            count[s.FACTORIZATIONS] += 1
            sound = growth <= real[s.GROWTH_MAX]
            if sound:
                real[s.GAMMA_J] = gamma
                real[s.RATE] = RATE_OF_FRESH
                code = correct(residual, t, gamma, vec, real, count, plan, factors, idata, rdata, work)
        known_noise, known_noisy = real[s.NOISE], count[s.NOISY]
        if code == SLOW and sound and settle_for_noise(False, real, count, vec, st.matrix, plan, factors):
            code = CONVERGED
        if code != CONVERGED:
            if code == NOT_FINITE:
                bad = first_not_finite(vec[s.RES])
                count[s.WORST] = bad if bad >= 0 else first_not_finite(delta)
                count[s.NAN_FAILS] += 1
                count[s.NEWTON_REJECTIONS] += 1
                real[s.H] = NEWTON_SHRINK * h
            elif count[s.FRESH] == 0:
                count[s.STALE] += 1
                real[s.H] = h_wish
            else:
                count[s.WORST] = weighted_argmax(delta, vec[s.W_NEWTON])
                count[s.NEWTON_FAILS] += 1
                count[s.NEWTON_REJECTIONS] += 1
                real[s.H] = NEWTON_SHRINK * h
                count[s.SINCE_CHANGE] = 0
                count[s.CAUTION] = 2
                if count[s.NEWTON_FAILS] > DROP_AFTER:
                    count[s.ORDER] = 1
                    if count[s.DROP_LEVEL] < DROP_LEVELS:
                        # perhaps a singular position: go through it with the step it began with, some pivots dropped
                        count[s.DROP_LEVEL] += 1
                        count[s.DROP_AGE] = 0
                        real[s.H] = real[s.H_TRY]
                        count[s.JAC_WANTED] = 1
                        return s.REPIVOT
            count[s.JAC_WANTED] = 1
            continue

        # error test
        for i in range(n):
            delta[i] = y[i] - y_pred[i]
            hist[0, i] = y[i]
        if count[s.NPAST] == 1:
            # algebraic unknowns may jump where a run starts afresh
            for i in range(n):
                delta[i] *= vec[s.IS_DIFFERENTIAL, i]
        times[0] = t
        error = constant * weighted_max(delta, vec[s.W_ERROR])
        passed = error <= 1.0 + constant * 2.0 ** (k + 1) * real[s.NOISE]
        if not passed and settle_for_noise(True, real, count, vec, st.matrix, plan, factors):
            passed = True
            for i in range(n):
                hist[0, i] = y[i]
        if not passed:
            # what was settled for in the corrector has not come into the past
            real[s.NOISE], count[s.NOISY] = known_noise, known_noisy
            count[s.ERROR_REJECTIONS] += 1
            count[s.ERROR_FAILS] += 1
            count[s.WORST] = weighted_argmax(delta, vec[s.W_ERROR])
            count[s.WORST_ERROR] = count[s.WORST]
            real[s.ERROR] = error
            after_error_failure(real, count, times, hist, vec, small, error, count[s.ERROR_FAILS])
            if count[s.ERROR_FAILS] == RESTART_AFTER and count[s.NPAST] > 1:
                # a jump, most likely: the past says nothing about what comes
                for i in range(n):
                    vec[s.YP_START, i] = (hist[1, i] - hist[2, i]) / (times[1] - times[2])
                _restart(real, count)
            continue

        # accepted
        if count[s.NPAST] == 1:
            for i in range(n):
                if vec[s.IS_DIFFERENTIAL, i] == 0.0:
                    hist[1, i] = y[i]
        accepted += 1
        count[s.STEPS] += 1
        count[s.SHIFTED] = 0
        count[s.FRESH] = 0
        count[s.JAC_AGE] += 1
        count[s.DROP_AGE] += 1
        noisy = count[s.NOISY] > 0
        if noisy:
            count[s.NOISY] -= 1
            count[s.NOISY_RUN] += 1
            count[s.SETTLED] += 1
            count[s.JAC_WANTED] = 1
            if count[s.NOISY] == 0:
                count[s.NOISY_RUN] = 0
                real[s.NOISE] = 0.0
        count[s.NPAST] = min(count[s.NPAST] + 1, HISTORY)
        real[s.T] = t
        real[s.H_USED] = h
        if real[s.RATE] > RATE_WORTH_RENEWING:
            count[s.JAC_WANTED] = 1
        cut = t
        action = float(RECORD)
        if count[s.HAS_EVENTS]:
            cut, action = locate_events(
                events,
                t,
                k,
                count,
                times,
                hist,
                vec,
                small,
                st.g_old,
                st.g_new,
                st.event_rules,
                st.hit_t,
                st.hit_which,
                st.hit_y,
                idata,
                rdata,
                work,
            )
            for e in range(count[s.HAS_EVENTS]):
                if not np.isfinite(st.g_new[e]):
                    count[s.WORST] = -1 - e
                    return s.FAIL_NOT_FINITE
                st.g_old[e] = st.g_new[e]
        write_outputs(cut, k, count, times, hist, vec, small, st.outputs, st.y_out, st.yp_out)
        p = count[s.N_RECORDS]
        rec_at = t
        rewritten = False
        if action != RECORD and cut < t:
            # the step ends at the crossing: replace its end by the polynomial's value there
            interpolate(cut, k, times, hist, small, vec[s.Y_INT], vec[s.YP_INT])
            for i in range(n):
                y[i] = vec[s.Y_INT, i]
                yp[i] = vec[s.YP_INT, i]
                hist[0, i] = y[i]
            times[0] = cut
            real[s.T] = cut
            rec_at = cut
            events(cut, y, yp, st.g_old, idata, rdata, work)
        st.rec_t[p] = rec_at
        st.rec_h[p] = rec_at - t_old
        st.rec_order[p] = k
        if count[s.KEEP_ROWS]:
            for i in range(n):
                st.rec_y[p, i] = y[i]
        count[s.N_RECORDS] = p + 1
        if action == STOP:
            return s.TERMINAL
        at_stop = count[s.NEXT_STOP] < st.stops.shape[0] and times[0] >= st.stops[count[s.NEXT_STOP]]
        if at_stop or action != RECORD:
            if at_stop:
                count[s.NEXT_STOP] += 1
            for i in range(n):
                vec[s.YP_START, i] = yp[i]
            real[s.H] = RESTART_SHRINK * h
            _restart(real, count)
            rewritten = True
        elif not noisy:
            after_success(real, count, times, hist, vec, small)
            if h < 0.999 * h_wish and real[s.H] >= h:
                # shortened only to land: go on with the size the error test had asked for
                real[s.H] = min(h_wish, 2.0 * real[s.H]) if count[s.INTERPOLATE] else h_wish
        elif h < 0.999 * h_wish:
            real[s.H] = h_wish
        if real[s.T] >= real[s.T_END]:
            return s.DONE
        told = 0
        if count[s.HAS_HOOK]:
            told = hook(times[0], hist, min(count[s.NPAST], HISTORY), idata, rdata, work)
        if told != 0:
            count[s.JAC_WANTED] = 1
        if told == HISTORY_CHANGED:
            count[s.SLOPE_AGE] = SLOPE_MAX_AGE
            for i in range(n):
                y[i] = hist[0, i]
            _record_history(count, times, hist, 0, st.rec_t, st.rec_h, st.rec_y, st.rec_order)
            return s.PAUSED
        if rewritten:
            _record_history(count, times, hist, 0, st.rec_t, st.rec_h, st.rec_y, st.rec_order)
    return s.RUNNING
