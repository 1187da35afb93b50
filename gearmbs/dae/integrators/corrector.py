"""The corrector: modified Newton on G(t, y, y'_pred + gamma (y - y_pred)) = 0 with a frozen matrix."""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, njit, types

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.run_state import (
    ATOL,
    DELTA,
    FRESH,
    GAMMA_J,
    IS_CONTROLLED,
    IS_DIFFERENTIAL,
    IS_TESTED,
    MAX_ITERATIONS,
    NEWTON_TOL,
    NOISE,
    NOISY,
    NOISY_RUN,
    NPAST,
    ORDER,
    RATE,
    RES,
    RESIDUALS,
    RTOL,
    SOLVES,
    W_ERROR,
    W_NEWTON,
    Y_INT,
    Y_PRED,
    YP,
    YP_PRED,
    Y,
)
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, PLAN_TYPE, solve
from gearmbs.dae.problem import RESIDUAL_SIG

CONVERGED = 0
SLOW = 1
NOT_FINITE = 2

RATE_LIMIT = 0.9
RATE_FLOOR = 0.02
ROUNDING_LEVEL = 0.1
ROUNDING_LEVEL_FRESH = 0.5
LOOSEST = 0.1
NOISE_SAMPLES = 2
NOISE_MARGIN = 4.0
NOISY_ALLOWED = 60
PREDICTION_ERROR = 2.0
EPS = 2.220446049250313e-16

_VEC = float64[::1]
_IVEC = int64[::1]
_MAT = float64[:, ::1]


@njit(float64(_VEC, _VEC), cache=True, nogil=True, fastmath=True, error_model="numpy")
def weighted_max(v, weight):
    """Return max_i |v[i]| weight[i] of finite vectors."""
    top = 0.0
    for i in range(v.shape[0]):
        a = abs(v[i]) * weight[i]
        top = max(top, a)
    return top


@njit(int64(_VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def weighted_argmax(v, weight):
    """Return the index of the largest |v[i]| weight[i]."""
    top = -1.0
    where = 0
    for i in range(v.shape[0]):
        a = abs(v[i]) * weight[i]
        if a > top:
            top = a
            where = i
    return where


@njit(boolean(_VEC), cache=True, nogil=True, error_model="numpy")
def all_finite(v):
    """Return whether every entry is finite."""
    # 0 * x is 0 for finite x and NaN otherwise
    s0 = 0.0
    s1 = 0.0
    s2 = 0.0
    s3 = 0.0
    n = v.shape[0]
    m = n - n % 4
    for i in range(0, m, 4):
        s0 += 0.0 * v[i]
        s1 += 0.0 * v[i + 1]
        s2 += 0.0 * v[i + 2]
        s3 += 0.0 * v[i + 3]
    for i in range(m, n):
        s0 += 0.0 * v[i]
    return s0 + s1 + s2 + s3 == 0.0


@njit(int64(_VEC), cache=True, nogil=True, error_model="numpy")
def first_not_finite(v):
    """Return the index of the first entry that is not finite, or -1."""
    for i in range(v.shape[0]):
        if not np.isfinite(v[i]):
            return i
    return -1


@njit(types.void(_VEC, _VEC, float64, _MAT), cache=True, nogil=True, error_model="numpy")
def set_weights(real, y, h, vec):
    """Set the weights of the error test and of the corrector test from tolerances at ``y``.

    Algebraic unknowns outside error control (multipliers, forces) reach the others only through a step of size h, and
    h times their error is what the corrector test sees; taken at face value their rounding noise, which grows
    like 1/h, would never let a small step converge.
    """
    rtol = real[RTOL]
    atol = vec[ATOL]
    w_error = vec[W_ERROR]
    w_newton = vec[W_NEWTON]
    controlled = vec[IS_CONTROLLED]
    tested = vec[IS_TESTED]
    differential = vec[IS_DIFFERENTIAL]
    reach = min(h, 1.0)
    for i in range(y.shape[0]):
        w = 1.0 / (atol[i] + rtol * abs(y[i]))
        w_error[i] = controlled[i] * w
        w_newton[i] = tested[i] * w * max(max(controlled[i], differential[i]), reach)


@njit(int64(_VEC, _VEC, float64, boolean), cache=True, nogil=True, error_model="numpy")
def _verdict(delta, w_error, rate, fresh):
    """Return CONVERGED where a corrector that gets no further is harmless to the unknowns under error control.

    Then it is rounding, or multipliers that nothing determines near a singular position. What a contracting iteration
    leaves is judged by its rate; a stagnating one leaves about its last correction. A stale matrix is suspected first.
    """
    left = weighted_max(delta, w_error)
    if rate > RATE_LIMIT:
        return CONVERGED if left <= (ROUNDING_LEVEL_FRESH if fresh else ROUNDING_LEVEL) else SLOW
    return CONVERGED if fresh and left * rate <= ROUNDING_LEVEL_FRESH * (1.0 - rate) else SLOW


@njit(
    int64(
        types.FunctionType(RESIDUAL_SIG),
        float64,
        float64,
        _MAT,
        _VEC,
        _IVEC,
        PLAN_TYPE,
        FACTORS_TYPE,
        _IVEC,
        _VEC,
        _VEC,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def correct(residual, t, gamma, vec, real, count, plan, factors, idata, rdata, work):
    """Iterate from the prediction in rows Y and YP of ``vec`` until the corrector test is passed.

    Differential unknowns are corrected by 2/(1 + gamma/gamma_J) of the Newton step when the matrix was made for
    another leading coefficient gamma_J; algebraic ones do not depend on gamma and take the whole step.

    Returns
    -------
    code : int
        CONVERGED, SLOW or NOT_FINITE.
    """
    y = vec[Y]
    yp = vec[YP]
    res = vec[RES]
    delta = vec[DELTA]
    weight = vec[W_NEWTON]
    differential = vec[IS_DIFFERENTIAL]
    n = y.shape[0]
    damp = 2.0 / (1.0 + gamma / real[GAMMA_J]) - 1.0
    # differences of order k + 1 amplify what the corrector leaves by 2^k, and steer order and step
    limit = real[NEWTON_TOL] * min(LOOSEST, 0.5 ** count[ORDER])
    previous = 0.0
    iterations = count[MAX_ITERATIONS]
    for m in range(iterations):
        residual(t, y, yp, res, idata, rdata, work)
        solve(plan, factors, res, delta)
        count[RESIDUALS] += 1
        count[SOLVES] += 1
        if not all_finite(delta):
            return NOT_FINITE
        if damp != 0.0:
            for i in range(n):
                d = delta[i] * (1.0 + damp * differential[i])
                delta[i] = d
                y[i] -= d
                yp[i] -= gamma * d
        else:
            for i in range(n):
                d = delta[i]
                y[i] -= d
                yp[i] -= gamma * d
        norm = weighted_max(delta, weight)
        if m > 0:
            rate = norm / previous if previous > 0.0 else 0.0
            if rate > RATE_LIMIT:
                real[RATE] = 1.0
                return _verdict(delta, vec[W_ERROR], rate, count[FRESH] != 0)
            real[RATE] = max(rate, 0.3 * real[RATE])
        trust = max(real[RATE], RATE_FLOOR)
        if trust < 1.0 and norm * trust <= limit * (1.0 - trust):
            return CONVERGED
        if m > 0:
            # would the iterations left suffice at this rate?
            rest = norm * trust / (1.0 - trust) if trust < 1.0 else norm
            if rest * trust ** (iterations - 1 - m) > limit:
                return _verdict(delta, vec[W_ERROR], trust, count[FRESH] != 0)
        previous = norm
    return _verdict(delta, vec[W_ERROR], real[RATE], count[FRESH] != 0) if iterations > 1 else SLOW


@njit(float64(_MAT, _VEC, PLAN_TYPE, FACTORS_TYPE), cache=True, nogil=True, error_model="numpy")
def rounding_level(vec, matrix, plan, factors):
    """Return how far rounding alone moves the corrector, in units of the tolerance.

    The terms of the equations are about |J| |y| in size, and their sums wrong by the last digit of that. Near a
    singular position of a mechanism the equations turn such errors into many times as much of some unknowns, whatever
    the step.

    Parameters
    ----------
    vec : ndarray
        Unknowns in row Y; rows RES and Y_INT are overwritten.
    matrix : ndarray
        Values of the factored matrix in CSC order.
    plan, factors : LUPlan, LUFactors
    """
    y = vec[Y]
    size = vec[RES]
    moved = vec[Y_INT]
    n = y.shape[0]
    size[:] = 0.0
    for k in range(n):
        a = abs(y[plan.col_to[k]])
        for p in range(plan.a_ptr[k], plan.a_ptr[k + 1]):
            size[plan.row_from[plan.a_pos[p]]] += abs(matrix[plan.a_src[p]]) * a
    level = 0.0
    phase = 0.0
    for _ in range(NOISE_SAMPLES):
        for i in range(n):
            # signs without a pattern: the fractional parts of multiples of the golden ratio
            phase += 0.6180339887498949
            phase -= np.floor(phase)
            moved[i] = EPS * size[i] if phase < 0.5 else -EPS * size[i]
        solve(plan, factors, moved, moved)
        level = max(level, weighted_max(moved, vec[W_ERROR]))
    return level


@njit(boolean(boolean, _VEC, _IVEC, _MAT, _VEC, PLAN_TYPE, FACTORS_TYPE), cache=True, nogil=True, error_model="numpy")
def settle_for_noise(from_prediction, real, count, vec, matrix, plan, factors):
    """Return whether rounding explains row DELTA of ``vec``; if so, leave the better of corrector and prediction.

    DELTA is a result too far from its prediction, which is noisy itself, or else a correction that will not get
    smaller. No step would mend it near a singular position, so the run has to go through as it is. The noise passed on
    to the past, ``real[NOISE]`` in units of the tolerance, comes back amplified by 2^k in predictions of order k. Where
    that is less than the noise of the corrector, the prediction stands for the solution.
    """
    if count[FRESH] == 0 or count[NOISY_RUN] >= NOISY_ALLOWED or count[NPAST] < 3:
        return False
    noise = rounding_level(vec, matrix, plan, factors)
    predicted = 2.0 ** count[ORDER] * max(real[NOISE], ROUNDING_LEVEL) + PREDICTION_ERROR
    leeway = 2.0 * predicted if from_prediction else 0.0
    if not weighted_max(vec[DELTA], vec[W_ERROR]) <= NOISE_MARGIN * noise + leeway:
        return False
    if noise < ROUNDING_LEVEL:
        return False
    count[NOISY] = HISTORY
    if noise <= predicted:
        real[NOISE] = max(real[NOISE], noise)
        return True
    real[NOISE] = max(real[NOISE], predicted)
    for i in range(vec.shape[1]):
        vec[Y, i] = vec[Y_PRED, i]
        vec[YP, i] = vec[YP_PRED, i]
    return True
