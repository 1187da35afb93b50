"""Whether a step has jumped over a pole of a rate, where a solution ends though the corrector finds another beyond.

With y' = -k/y, y > 0, the solution sqrt(2k (T - t)) ends at T in y = 0, of infinite slope. On either side of such a
pole the rates point at it, so that no solution leaves it, and a step that comes down beyond has found none.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.corrector import HELD, ROUNDED_TERMS
from gearmbs.dae.integrators.run_state import rows_from
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit

NEAR, FAR = 0.49, 0.51
"""Parts of an interval at which it is divided, by turns: at its middle a pole that lies alike from both ends would be
met, and divided by."""
DIVISIONS = 40
"""Divisions of the way: they take it to a part 1e-12, which is to be less than the width of any rate that is steep but
finite."""
UNFORESEEN = 0.03
"""Tolerances by which an unknown has to miss its prediction to be looked at."""
UNFORESEEN_PART = 0.05
"""And that as part of its way in the step: a solution that its steps resolve misses it by far less."""
RATES_HELD = 0.1
"""Part of a rate by which the rates next to a pole may be off."""
FEWEST = 6
"""Divisions that tell, where rounding of the unknowns allows no more: the rates have grown by 64, or by 8."""
GROWTH = 1.1
"""Least growth of a rate from one division to the next. Near a pole of order p it is 2^p, at a jump 1."""


@njit(cache=True, nogil=True, error_model="numpy")
def _unforeseen(st, i, old):
    """Return whether unknown i has missed its prediction by a good part of its way, and of its tolerance."""
    off = abs(st.y[i] - st.y_pred[i])
    far = (off > UNFORESEEN_PART * abs(st.y[i] - old[i])) & (off * st.w_error[i] > UNFORESEEN)
    return far & (st.differential[i] != 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _outruns_step(st, m):
    """Return whether entry m of those with a rate has a derivative by its unknown against that by the rate, and larger.

    The unknown then leaves where it is faster than the step resolves, as it does next to a pole.
    """
    p = st.carried[m]
    return st.matrix[p] * st.jac_slope[p] < 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def passes_pole(functions, st):
    """Return whether a pole of their rates lies between the old and the new values of some unknowns.

    A step gets over a pole where the corrector moves an unknown over it, which its prediction did not foresee, or where
    the prediction lies beyond and the matrix is that of a place so near to the pole that corrections are tiny, and the
    equations do not hold: it has another sign than that of a shorter step, or has leapt at its last evaluation.
    Unknowns of which one or the other is true are looked at together, from their old to their new values, beside the
    new ones of all others. What an equation is with y' = 0, its terms without a rate, has another sign at the two ends
    where it tells of a pole, and the way is divided as for a root. Towards a root the terms fall, at a jump they stay
    as they are, near a steep place they grow until it is resolved; towards a pole they grow with every division.

    Where neither is true it costs a few comparisons, elsewhere two or three residuals. Once a pole has been met, the
    rates of its unknown have to satisfy their equations too. Equations that are not linear in y' need not be defined
    for y' = 0, and are not looked at.
    """
    if st.nonlinear_rates:
        return False
    old = rows_from(st, 1)[0]
    suspected = st.pole >= 0 or st.leapt >= 0
    for i in range(st.y.shape[0]):
        suspected |= _unforeseen(st, i, old)
    for m in range(st.n_carried):
        suspected |= _outruns_step(st, m)
    return suspected and (_pole_between(functions, st, old) or (st.pole >= 0 and not _rates_hold(functions, st)))


@njit(cache=True, nogil=True, error_model="numpy")
def _rates_hold(functions, st):
    """Return whether the rates satisfy the equations of unknowns that have met a pole before.

        |G_i| <= sum_j |dG_i/dy'_j| (RATES_HELD |y'_j| + gamma HELD tolerance_j) + ROUNDED_TERMS eps sum_j |J_ij y_j|

    The derivatives by the unknowns, which next to a pole are so large that they make any residual look small, are left
    out of what is allowed but for rounding.
    """
    n = st.y.shape[0]
    looked_at = np.zeros(n, dtype=np.bool_)
    allowed = np.zeros(n)
    for m in range(st.n_carried):
        p = st.carried[m]
        i, j = st.entry_row[p], st.entry_col[p]
        allowed[i] += abs(st.jac_slope[p]) * (RATES_HELD * abs(st.yp[j]) + st.gamma * HELD / st.weight[j])
        if j == st.pole or _outruns_step(st, m):
            looked_at[i] = True
    for p in range(st.matrix.shape[0]):
        j = st.entry_col[p]
        allowed[st.entry_row[p]] += ROUNDED_TERMS * EPS * abs(st.matrix[p] * st.y[j])
    functions.residual(st.t_new, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1
    for i in range(n):
        if looked_at[i] and not abs(st.res[i]) <= allowed[i]:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _terms(functions, st, old, suspect, part, out):
    """Write the residual with y' = 0 into ``out``, at a part of the way of the suspected unknowns."""
    y, rates = st.y_between, st.yp_between
    for i in range(y.shape[0]):
        y[i] = old[i] + part * (st.y[i] - old[i]) if suspect[i] else st.y[i]
        rates[i] = 0.0
    functions.residual(st.t_new, y, rates, out, st.idata, st.rdata, st.work)
    st.residuals += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _pole_between(functions, st, old):
    """Return whether there is a pole on the way of the suspected unknowns; note in ``st`` of which and where."""
    n = st.y.shape[0]
    suspect = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        suspect[i] = _unforeseen(st, i, old)
    for k in range(st.n_carried):
        if _outruns_step(st, k):
            suspect[st.entry_col[st.carried[k]]] = True
    for i in (st.pole, st.leapt):
        if i >= 0:
            suspect[i] = True
    first = 0
    while not suspect[first]:
        first += 1
    at_a, at_b, at_m = np.empty(n), np.empty(n), np.empty(n)
    _terms(functions, st, old, suspect, 0.0, at_a)
    _terms(functions, st, old, suspect, 1.0, at_b)
    turned = False
    for i in range(n):
        turned |= at_a[i] * at_b[i] < 0.0
    if not turned:
        return False
    a, b, m = 0.0, 1.0, NEAR
    _terms(functions, st, old, suspect, m, at_m)
    row = -1
    most = GROWTH
    for i in range(n):
        if at_a[i] * at_b[i] < 0.0:
            grown = at_m[i] / (at_a[i] if at_m[i] * at_a[i] > 0.0 else at_b[i])
            if grown > most:
                most = grown
                row = i
    if row < 0:
        return False
    fa, fb, fm = at_a[row], at_b[row], at_m[row]
    divisions = 0
    while divisions < DIVISIONS:
        if (fm > 0.0) == (fa > 0.0):
            if not abs(fm) > GROWTH * abs(fa):
                return False
            a, fa = m, fm
        else:
            if not abs(fm) > GROWTH * abs(fb):
                return False
            b, fb = m, fm
        divisions += 1
        if not np.isfinite(fm):
            break
        m = a + (NEAR if divisions % 2 == 0 else FAR) * (b - a)
        y_a, y_b = _place(st, old, first, a), _place(st, old, first, b)
        if abs(y_b - y_a) <= ROUNDED_TERMS * EPS * max(abs(y_a), abs(y_b)):
            # what the equation makes of the unknown is rounded too
            break
        _terms(functions, st, old, suspect, m, at_m)
        fm = at_m[row]
    if divisions < FEWEST:
        return False
    st.pole = first
    st.pole_met = True
    st.pole_at = _place(st, old, first, m)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _place(st, old, i, part):
    """Return the value of unknown i at a part of its way."""
    return old[i] + part * (st.y[i] - old[i])
