"""The corrector: modified Newton on G(t, y, y'_pred + gamma (y - y_pred)) = 0 with a frozen matrix."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.controller import meets_kinks
from gearmbs.dae.integrators.run_state import STATE_TYPE
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, solve
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, void
from gearmbs.kernels.lanes import bits_of, double_of

# Weights of the error test and of the corrector test, and norms with them.


_VEC = float64[::1]


@njit(cache=True, nogil=True, error_model="numpy")
def weighted_max(v, weight):
    """Return max_i |v[i]| weight[i]; infinity or NaN if an entry is not finite."""
    top = int64(0)
    for i in range(v.shape[0]):
        top = max(top, bits_of(abs(v[i] * weight[i])))
    return double_of(top)


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


@njit(void(STATE_TYPE, _VEC, float64), cache=True, nogil=True, error_model="numpy")
def set_weights(st, y, h):
    """Set the weights of the error test and of the corrector test from the tolerances at ``y``.

    Algebraic unknowns outside error control (multipliers, forces) reach the others only through a step of size h, and
    h times their error is what the corrector test sees; taken at face value their rounding noise, which grows
    like 1/h, would never let a small step converge. Beyond a second they are held to their own tolerance.

    Parameters
    ----------
    st : RunState
    y : ndarray, shape (n,)
    h : float
        Size of the step.
    """
    rtol = st.rtol
    weight, atol = st.weight, st.atol
    w_error, controlled = st.w_error, st.controlled
    w_newton, tested, coupled = st.w_newton, st.tested, st.coupled
    reach = min(h, 1.0)
    # one result a loop: the compiler vectorises no loop over more arrays than it can check for overlap
    for i in range(y.shape[0]):
        weight[i] = 1.0 / (atol[i] + rtol * abs(y[i]))
    for i in range(y.shape[0]):
        w_error[i] = controlled[i] * weight[i]
    for i in range(y.shape[0]):
        w_newton[i] = tested[i] * weight[i] * max(coupled[i], reach)


@njit(cache=True, nogil=True, error_model="numpy")
def renew_weights(st, y, h):
    """Set the weights for a step of size h from ``y`` where they have changed since the last one."""
    if st.rtol > 0.0 or st.step_in_weights:
        set_weights(st, y, h)


CONVERGED = 0
SLOW = 1
NOT_FINITE = 2

RATE_LIMIT = 0.9
"""Ratio of successive corrections from which on an iteration counts as one that does not converge: as in DASSL and
IDA."""
RATE_FLOOR = 0.02
"""Least rate that is believed. With it a first correction of fifty times what may be left is accepted without a second
one. Tuned, see the table of constants."""
RATE_MEMORY = 0.3
"""Part of the rate known so far that stays where a new one is smaller, as in CVODE (CRDOWN): a single ratio may be
small by chance."""
RATE_AGEING = 1.5
"""Growth of the rate with every step that its first correction ends, since nothing has confirmed it there. Tuned, see
the table of constants."""
RATE_UNKNOWN = 0.1
"""Rate at which this growth ends: iterations with a matrix of some steps ago, as they are, hardly converge more slowly.
Tuned, see the table of constants."""
ROUNDING_LEVEL = 0.1
"""Part of a tolerance that a corrector which gets no further may have for its last correction, and below which rounding
is no obstacle. Tuned, see the table of constants."""
ROUNDING_LEVEL_FRESH = 0.5
"""The same with a matrix of this step, whose age cannot be to blame. Half a tolerance is no more than the error test
allows a step. Tuned, see the table of constants."""
LOOSEST = 0.03
"""Part of a tolerance that a corrector may leave of a smooth solution; at orders above 5 it is 2^-order. See "Order and
step size" in the theory of the equations. Tuned, see the table of constants."""
LOOSEST_AT_KINKS = 0.1
"""The same where derivatives jump: the noise of the corrector is far below the differences there. Tuned, see the table
of constants."""
HELD = 0.05
"""Part of the tolerance of an unknown within which an equation has to be satisfied: about what a corrector that
converges leaves. Over a whole tolerance the matrix may change."""
ROUNDED_TERMS = 16.0
"""Roundings of the terms of an equation: each is a product of a few factors, summed in some order."""
SETTLED_RATE = 0.01
"""Part of a rate by which its last correction may move it where G is not linear in y'. In a short step the tolerance of
y allows any rate; a correction of that size leaves about its square."""


@njit(cache=True, nogil=True, error_model="numpy")
def first_not_finite(v):
    """Return the index of the first entry that is not finite, or -1."""
    for i in range(v.shape[0]):
        if not np.isfinite(v[i]):
            return i
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def apply_correction(delta, gamma, weight, y, yp):
    """Take ``delta`` off ``y`` and ``gamma delta`` off ``yp``; return its weighted norm, not finite if an entry is not.

    Parameters
    ----------
    delta : ndarray, shape (n,)
    gamma : float
        Leading coefficient.
    weight : ndarray, shape (n,)
    y, yp : ndarray, shape (n,)
        Changed.
    """
    for i in range(delta.shape[0]):
        y[i] -= delta[i]
        yp[i] -= gamma * delta[i]
    return weighted_max(delta, weight)


@njit(cache=True, nogil=True, error_model="numpy")
def equations_hold(functions, st):
    """Return whether the residual at the iterate is no more than tolerances and rounding explain, equation by equation.

    An equation holds where small changes of its unknowns satisfy it, each within part of its tolerance or within what
    rounding moves the terms of the equation by:

        |G_i| <= sum_j |J_ij| (HELD (atol_j + rtol |y_j|) + ROUNDED_TERMS eps |y_j|),   J = dG/dy + gamma dG/dy'

    Neither the scale of an equation nor that of an unknown matters. ``st.worst_row`` and ``st.violation`` say which
    equation is the furthest from that, and by which factor. ``st.res`` and ``st.y_between`` are overwritten.
    """
    functions.residual(st.t_seen, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1
    y, res, weight, matrix, allowed = st.y, st.res, st.weight, st.matrix, st.y_between
    row, col = st.entry_row, st.entry_col
    allowed[:] = 0.0
    for p in range(matrix.shape[0]):
        j = col[p]
        allowed[row[p]] += abs(matrix[p]) * (HELD / weight[j] + ROUNDED_TERMS * EPS * abs(y[j]))
    st.violation = 0.0
    for i in range(res.shape[0]):
        ratio = abs(res[i]) / allowed[i] if res[i] != 0.0 else 0.0
        if not ratio <= st.violation:
            st.violation = ratio
            st.worst_row = i
    return st.violation <= 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def rates_settle(st):
    """Return whether the last correction has left the rates as they were, up to a part of them and rounding.

        gamma |delta_j| <= SETTLED_RATE (|y'_j| + |y'_pred,j|) + gamma ROUNDED_TERMS eps |y_j|

    Only where G is not linear in y': elsewhere wrong rates are no obstacle to the convergence of y.
    """
    if not st.nonlinear_rates:
        return True
    y, yp, guess, gamma, delta = st.y, st.yp, st.yp_pred, st.gamma, st.delta
    for j in range(y.shape[0]):
        allowed = SETTLED_RATE * (abs(yp[j]) + abs(guess[j])) + gamma * ROUNDED_TERMS * EPS * abs(y[j])
        if st.differential[j] != 0.0 and not gamma * abs(delta[j]) <= allowed:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _verdict(functions, st, rate):
    """Return CONVERGED where a corrector that gets no further is harmless: all equations hold, and it is at its end.

    Then it is rounding, or multipliers that nothing determines near a singular position. What a contracting iteration
    leaves is judged by its rate; a stagnating one leaves about its last correction. A stale matrix is suspected first.
    Unknowns under error control may rest while an equation of the others has no solution: the residual tells.
    """
    fresh = st.matrix_fresh
    left = weighted_max(st.delta, st.w_error)
    if rate > RATE_LIMIT:
        harmless = left <= (ROUNDING_LEVEL_FRESH if fresh else ROUNDING_LEVEL)
    else:
        harmless = fresh and left * rate <= ROUNDING_LEVEL_FRESH * (1.0 - rate)
    return CONVERGED if harmless and rates_settle(st) and equations_hold(functions, st) else SLOW


@njit(cache=True, nogil=True, error_model="numpy")
def amount_left(st):
    """Return what the corrector may leave, in tolerances.

    Differences of order k + 1, which steer order and step, amplify it by 2^k. Where derivatives jump, the differences
    are larger anyway, and a stricter corrector buys nothing.
    """
    return min(LOOSEST_AT_KINKS if meets_kinks(st) else LOOSEST, 0.5**st.order)


@njit(cache=True, nogil=True, error_model="numpy")
def correct(functions, st, plan, factors):
    """Iterate from the prediction in ``st.y`` and ``st.yp`` until the corrector test is passed.

    Differential unknowns are corrected by 2/(1 + gamma/gamma_J) of the Newton step when the matrix was made for
    another leading coefficient gamma_J; algebraic ones do not depend on gamma and take the whole step.

    Returns
    -------
    code : int
        CONVERGED, SLOW or NOT_FINITE.
    """
    residual = functions.residual
    y, yp, res, delta = st.y, st.yp, st.res, st.delta
    t, gamma = st.t_seen, st.gamma
    damp = 2.0 / (1.0 + gamma / st.gamma_factored) - 1.0
    limit = amount_left(st)
    previous = 0.0
    iterations = st.max_iterations
    for m in range(iterations):
        residual(t, y, yp, res, st.idata, st.rdata, st.work)
        solve(plan, factors, res, delta)
        st.residuals += 1
        st.solves += 1
        if damp != 0.0:
            for i in range(delta.shape[0]):
                delta[i] *= 1.0 + damp * st.differential[i]
        norm = apply_correction(delta, gamma, st.w_newton, y, yp)
        if not np.isfinite(norm) and first_not_finite(delta) >= 0:
            return NOT_FINITE
        if m > 0:
            rate = norm / previous if previous > 0.0 else 0.0
            if rate > RATE_LIMIT:
                st.rate = 1.0
                return _verdict(functions, st, rate)
            st.rate = max(rate, RATE_MEMORY * st.rate)
        # corrections that fall by this rate leave norm (trust + trust^2 + ...) = norm trust / (1 - trust) undone;
        # a second correction, or none at all, confirms the rate:
        trust = max(st.rate, RATE_FLOOR)
        # where G is not linear in y', what other steps have seen of the convergence holds nothing
        seen = m > 0 or norm == 0.0 or iterations == 1 or not st.nonlinear_rates
        if seen and trust < 1.0 and norm * trust <= limit * (1.0 - trust) and rates_settle(st):
            if m == 0:
                # a rate that nothing has confirmed is worth less each time
                st.rate = max(st.rate, min(RATE_AGEING * trust, RATE_UNKNOWN))
            return CONVERGED
        if m > 0:
            # would the iterations left suffice at this rate?
            rest = norm * trust / (1.0 - trust) if trust < 1.0 else norm
            if rest * trust ** (iterations - 1 - m) > limit:
                return _verdict(functions, st, trust)
        previous = norm
    return _verdict(functions, st, st.rate) if iterations > 1 else SLOW


# Steps limited by rounding: how far rounding moves the corrector, and when a step is taken in spite of it.


NOISE_SAMPLES = 2
NOISE_MARGIN = 4.0
"""Ratio to the estimated rounding up to which it explains a correction: a few samples of signs miss the largest effect
of rounding by some small factor. Tuned, see the table of constants."""
NOISY_ALLOWED = 60
PREDICTION_ERROR = 2.0
"""Tolerances by which a prediction is off without noise. Steps whose error is a fifth of a tolerance have their
corrector 0.2 (1 + 1/r) from their prediction, 0.6 at order 1 and 3.6 at order 6; r as in
`gearmbs.dae.integrators.bdf`."""
GOLDEN_FRACTION = 0.6180339887498949
"""(sqrt(5) - 1)/2, the golden ratio less one."""


@njit(float64(STATE_TYPE, PLAN_TYPE, FACTORS_TYPE), cache=True, nogil=True, error_model="numpy")
def rounding_level(st, plan, factors):
    """Return how far rounding alone moves the corrector, in units of the tolerance.

    The terms of the equations are about |J| |y| in size, and their sums wrong by the last digit of that. Near a
    singular position of a mechanism the equations turn such errors into many times as much of some unknowns, whatever
    the step.

    Parameters
    ----------
    st : RunState
        With the unknowns in ``y`` and the factored matrix in ``matrix``; ``res`` and ``y_between`` are overwritten.
    plan, factors : LUPlan, LUFactors
    """
    y, matrix, size, moved = st.y, st.matrix, st.res, st.y_between
    n = y.shape[0]
    size[:] = 0.0
    for p in range(matrix.shape[0]):
        size[st.entry_row[p]] += abs(matrix[p]) * abs(y[st.entry_col[p]])
    level = 0.0
    phase = 0.0
    for _ in range(NOISE_SAMPLES):
        for i in range(n):
            # signs without a pattern: the fractional parts of multiples of the golden ratio
            phase += GOLDEN_FRACTION
            phase -= np.floor(phase)
            moved[i] = EPS * size[i] if phase < 0.5 else -EPS * size[i]
        solve(plan, factors, moved, moved)
        level = max(level, weighted_max(moved, st.w_error))
    return level


@njit(cache=True, nogil=True, error_model="numpy")
def accept_noise(st, plan, factors, from_prediction):
    """Return whether rounding explains ``st.delta``; if so, leave the better of corrector and prediction in ``st.y``.

    That is a result too far from its prediction, which is noisy itself, or else a correction that will not get
    smaller. No step would mend it near a singular position, so the run has to go through as it is. The noise passed on
    to the past, ``st.noise`` in units of the tolerance, comes back about 2^k times in predictions of order k, the root
    of the sum of the squares of their coefficients C(k + 1, j), and at most twice that, the sum. Where it is less
    than the noise of the corrector, the prediction stands for the solution.

    Parameters
    ----------
    st : RunState
    plan, factors : LUPlan, LUFactors
    from_prediction : bool
        Whether ``st.delta`` is the distance from the prediction.
    """
    if not st.matrix_fresh or st.noise_run >= NOISY_ALLOWED or st.n_past < 3:
        return False
    noise = rounding_level(st, plan, factors)
    predicted = 2.0**st.order * max(st.noise, ROUNDING_LEVEL) + PREDICTION_ERROR
    leeway = 2.0 * predicted if from_prediction else 0.0
    if not weighted_max(st.delta, st.w_error) <= NOISE_MARGIN * noise + leeway:
        return False
    if noise < ROUNDING_LEVEL:
        return False
    st.noise_left = HISTORY
    if noise <= predicted:
        st.noise = max(st.noise, noise)
        return True
    st.noise = max(st.noise, predicted)
    for i in range(st.y.shape[0]):
        st.y[i] = st.y_pred[i]
        st.yp[i] = st.yp_pred[i]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def remember_noise(st):
    """Note the noise in the history, in case this step is refused after all."""
    st.noise_before = st.noise
    st.noise_left_before = st.noise_left


@njit(cache=True, nogil=True, error_model="numpy")
def forget_noise(st):
    """Take back what `accept_noise` noted in a step that was refused: it has not come into the past."""
    st.noise = st.noise_before
    st.noise_left = st.noise_left_before


@njit(cache=True, nogil=True, error_model="numpy")
def count_noise(st):
    """Count an accepted step while there is noise in the history, and note in ``st.noisy`` whether there is."""
    st.noisy = st.noise_left > 0
    if not st.noisy:
        return
    st.noise_left -= 1
    st.noise_run += 1
    st.noise_limited += 1
    st.matrix_wanted = True
    if st.noise_left == 0:
        st.noise_run = 0
        st.noise = 0.0
