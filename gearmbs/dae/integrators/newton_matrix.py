"""The Newton matrix of a run: when it is evaluated, how it is carried over to another leading coefficient."""

from __future__ import annotations

from gearmbs.dae.integrators.controller import meets_kinks
from gearmbs.dae.integrators.run_state import REPIVOT, RUNNING, copy
from gearmbs.dae.linalg.sparse_lu import fits, refactor_carried
from gearmbs.kernels.jit import njit

GAMMA_DRIFT = 0.2
"""Change of the leading coefficient up to which factors serve, since 2/(1 + gamma/gamma_J) makes up for it: the rate it
leaves is at most |1 - gamma/gamma_J|/(1 + gamma/gamma_J), a tenth. CVODE allows 0.3 (DGMAX), IDA 2/3. Tuned, see the
table of constants."""
GAMMA_DRIFT_AT_KINKS = 0.3
"""Larger where steps change so often that factors serve but a few of them."""
MATRIX_MAX_AGE = 50
GAMMA_DRIFT_IF_DEAR, GAMMA_DRIFT_AT_KINKS_IF_DEAR, MATRIX_MAX_AGE_IF_DEAR = 0.3, 0.5, 200
"""The same with bodies that deform, whose matrix takes 17 to 50 residuals to evaluate and two or three to factor. Of a
pair on shafts with 16 modes each the first 0.1 s take 39 % fewer factorisations and 40 % fewer matrices then, and 10 %
more residuals; with 100 modes as many."""
SLOPE_MAX_AGE = 20
RATE_OF_FRESH = 0.1
"""Rate that is expected of a new matrix until its own is known. Tuned, see the table of constants."""
PLANNED_RANGE = 1e4
"""Ratio of leading coefficients within which a plan that leaves negligible entries out is trusted."""
DROPPED_STEPS = 5
LEAP = 100.0
"""Ratio of a derivative to that by the rate, and to itself before: the square of that of two distances from a pole."""


@njit(cache=True, nogil=True, error_model="numpy")
def _watch_leaps(st):
    """Note in ``st.leapt`` an unknown whose own derivative, without that of its rate, has leapt since the last matrix.

    So it does next to a pole, see `branches.passes_pole`. The note stands as long as the derivative is large.
    """
    jac, slope, matrix, before = st.jac, st.jac_slope, st.matrix, st.leapt
    st.leapt = -1
    for m in range(st.n_carried):
        p = st.carried[m]
        rate = st.gamma * abs(slope[p])
        own = abs(jac[p] - st.gamma * slope[p])
        last = abs(matrix[p] - st.gamma_factored * slope[p])
        if own > LEAP * rate and (own > LEAP * last or st.entry_col[p] == before):
            st.leapt = st.entry_col[p]


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_matrix(functions, st):
    """Evaluate the Newton matrix at ``st.y``, and now and then its slope dG/dy' by a second evaluation."""
    jacobian = functions.jacobian
    t, gamma = st.t_seen, st.gamma
    jac, slope = st.jac, st.jac_slope
    jacobian(t, st.y, st.yp, gamma, jac, st.idata, st.rdata, st.work)
    st.jacobians += 1
    st.slope_age += 1
    if st.slope_age >= SLOPE_MAX_AGE or st.nonlinear_rates:
        jacobian(t, st.y, st.yp, 2.0 * gamma, slope, st.idata, st.rdata, st.work)
        st.jacobians += 1
        st.slope_age = 0
        st.n_carried = 0
        for p in range(jac.shape[0]):
            slope[p] = (slope[p] - jac[p]) / gamma
            if slope[p] != 0.0:
                st.carried[st.n_carried] = p
                st.n_carried += 1
    st.gamma_evaluated = gamma
    if st.steps > 0:
        _watch_leaps(st)
    copy(jac, st.matrix)
    st.matrix_judged = False


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def carry_over(st):
    """Bring the matrix to the step's leading coefficient: only entries with a slope depend on it."""
    change = st.gamma - st.gamma_evaluated
    jac, slope, matrix, carried = st.jac, st.jac_slope, st.matrix, st.carried
    for m in range(st.n_carried):
        p = carried[m]
        matrix[p] = jac[p] + change * slope[p]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def leaves_little_out(st, plan):
    """Return whether what a plan leaves out is negligible: all after an evaluation, then what has been carried over."""
    limit, matrix, carried, small = plan.limit, st.matrix, st.carried, True
    if limit.shape[0] == 0:
        return True
    if not st.matrix_judged:
        st.matrix_judged = fits(plan, matrix)
        return st.matrix_judged
    for m in range(st.n_carried):
        p = carried[m]
        small &= abs(matrix[p]) <= limit[p]
    return small


@njit(cache=True, nogil=True, error_model="numpy")
def factor_matrix(st, plan, factors):
    """Factor the matrix carried over to the step's leading coefficient; return whether its plan still fits."""
    carry_over(st)
    if plan.left_src.shape[0] > 0:
        # what is negligible at one step size need not be at another
        ratio = st.gamma / st.gamma_planned
        if ratio > PLANNED_RANGE or ratio * PLANNED_RANGE < 1.0:
            return False
    st.factorizations += 1
    carried = st.matrix_judged
    if not leaves_little_out(st, plan):
        return False
    return refactor_carried(plan, factors, st.matrix, st.jac_slope, carried) <= st.growth_limit


@njit(cache=True, nogil=True, error_model="numpy")
def form_matrix(functions, st, plan, factors):
    """Bring the factored matrix up to date for the open step, if it has to be.

    Returns
    -------
    code : int
        RUNNING, or REPIVOT where pivots have to be chosen anew.
    """
    if st.left_out and st.noise_run > 0:
        # at the level of rounding every entry counts
        st.left_out = False
        st.h = st.h_wanted
        return REPIVOT
    drift = st.gamma / st.gamma_factored
    if st.matrix_dear:
        allowed = 1.0 + (GAMMA_DRIFT_AT_KINKS_IF_DEAR if meets_kinks(st) else GAMMA_DRIFT_IF_DEAR)
    else:
        allowed = 1.0 + (GAMMA_DRIFT_AT_KINKS if meets_kinks(st) else GAMMA_DRIFT)
    whole_again = st.drop_level > 0 and st.drop_age >= DROPPED_STEPS
    old = st.matrix_age >= (MATRIX_MAX_AGE_IF_DEAR if st.matrix_dear else MATRIX_MAX_AGE)
    wanted = st.matrix_wanted or old or whole_again
    if not (wanted or drift > allowed or drift < 1.0 / allowed):
        return RUNNING
    if wanted:
        st.matrix_wanted = True
        evaluate_matrix(functions, st)
    fits = factor_matrix(st, plan, factors)
    if whole_again:
        st.drop_level = 0
        st.drop_age = 0
    if whole_again or not fits:
        st.h = st.h_wanted
        return REPIVOT
    st.gamma_factored = st.gamma
    if wanted:
        st.matrix_wanted = False
        st.matrix_age = 0
        st.matrix_fresh = True
        st.rate = RATE_OF_FRESH
    return RUNNING


@njit(cache=True, nogil=True, error_model="numpy")
def renew_matrix(functions, st, plan, factors):
    """Evaluate and factor the matrix at the iterate in ``st.y``; return whether its pivots fit."""
    evaluate_matrix(functions, st)
    if not factor_matrix(st, plan, factors):
        return False
    st.gamma_factored = st.gamma
    st.rate = RATE_OF_FRESH
    return True
