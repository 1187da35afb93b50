"""The corrector: modified Newton on G(t, y, y'_pred + gamma (y - y_pred)) = 0 with a frozen matrix."""

from __future__ import annotations

import numpy as np
from numba import int64

from gearmbs._jit import njit
from gearmbs.dae.compiled.ordered_bits import bits_of, double_of
from gearmbs.dae.integrators.controller import meets_kinks
from gearmbs.dae.integrators.weights import weighted_max
from gearmbs.dae.linalg.sparse_lu import solve

CONVERGED = 0
SLOW = 1
NOT_FINITE = 2

RATE_LIMIT = 0.9
RATE_FLOOR = 0.02
RATE_MEMORY = 0.3
RATE_AGEING = 1.5
RATE_UNKNOWN = 0.1
ROUNDING_LEVEL = 0.1
ROUNDING_LEVEL_FRESH = 0.5
LOOSEST = 0.03
LOOSEST_AT_KINKS = 0.1
HELD = 0.05
"""Part of the tolerance of an unknown within which an equation has to be satisfied: about what a corrector that
converges leaves. Over a whole tolerance the matrix may change."""
ROUNDED_TERMS = 16.0
"""Roundings of the terms of an equation: each is a product of a few factors, summed in some order."""
EPS = 2.220446049250313e-16
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
    top = int64(0)
    for i in range(delta.shape[0]):
        d = delta[i]
        y[i] -= d
        yp[i] -= gamma * d
        top = max(top, bits_of(abs(d * weight[i])))
    return double_of(top)


@njit(cache=True, nogil=True, error_model="numpy")
def equations_hold(functions, st):
    """Return whether the residual at the iterate is no more than tolerances and rounding explain, equation by equation.

    An equation holds where small changes of its unknowns satisfy it, each within part of its tolerance or within what
    rounding moves the terms of the equation by:

        |G_i| <= sum_j |J_ij| (HELD (atol_j + rtol |y_j|) + ROUNDED_TERMS eps |y_j|),   J = dG/dy + gamma dG/dy'

    Neither the scale of an equation nor that of an unknown matters. ``st.worst_row`` and ``st.violation`` say which
    equation is the furthest from that, and by which factor. ``st.res`` and ``st.y_between`` are overwritten.
    """
    functions.residual(st.t_new, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
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
    t, gamma = st.t_new, st.gamma
    damp = 2.0 / (1.0 + gamma / st.gamma_factored) - 1.0
    limit = st.newton_tolerance * amount_left(st)
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
