"""Whether a step has stayed on the solution it began with: its branch, the index of the equations, poles of rates.

With y' = -k/y, y > 0, the solution sqrt(2k (T - t)) ends at T in y = 0, of infinite slope. On either side of such a
pole the rates point at it, so that no solution leaves it, and a step that comes down beyond has found none.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.corrector import CONVERGED, HELD, ROUNDED_TERMS, correct, equations_hold
from gearmbs.dae.integrators.newton_matrix import carry_over, renew_matrix
from gearmbs.dae.integrators.run_state import STATE_TYPE, copy, rows_from
from gearmbs.dae.linalg.sparse_lu import solve
from gearmbs.dae.problem import EPS
from gearmbs.kernels.bound import FUNCTIONS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64
from gearmbs.kernels.placed import unbound

UNFORESEEN = 100.0
"""Tolerances by which an algebraic unknown has to miss its prediction to be looked at."""
UNFORESEEN_PART = 0.1
"""And that as part of its change in the step: where a fold is near, the prediction knows half of it."""
SAME_BRANCH = 0.2
"""Least secant, in tangents, of a step that is not cut for it: that of a fifth power, or of exp over five units."""
SAME_EQUATION = 1e-3
"""The same of steps that have been cut: a jump of the equation has 1/p, a fold the length of the step."""
CUT_TO_TELL = 0.01
"""Part of the step tried first from which on it counts as cut: four failures of the corrector take it to 1/256. They
are not counted, for a step that drops pivots is tried at its first length again."""
VIOLATED = 1e4
"""Violation of an equation, in the units of `equations_hold`, from which on the corrector is asked again: its unknowns
may be off by VIOLATED HELD = 500 tolerances, where convergence leaves half a tolerance."""
LOST = 100.0
"""Tolerances by which the corrector then has to move an unknown."""
LARGER_GAMMA = 10.0
"""Ratio of the gamma at which the pencil is looked at to the largest leading coefficient of the run. Its first steps
resolve the fastest modes, whose entries, wrong in differences by 1e-8, would drown the derivatives at a smaller one."""
NEAR, FAR = 0.49, 0.51
"""Parts of an interval at which it is divided, by turns: at its middle a pole that lies alike from both ends would be
met, and divided by."""
DIVISIONS = 40
"""Divisions of the way: they take it to a part 1e-12, which is to be less than the width of any rate that is steep but
finite."""
MISSED = 0.03
"""Tolerances by which an unknown has to miss its prediction to be looked at."""
MISSED_PART = 0.05
"""And that as part of its way in the step: a solution that its steps resolve misses it by far less."""
RATES_HELD = 0.1
"""Part of a rate by which the rates next to a pole may be off."""
FEWEST = 6
"""Divisions that tell, where rounding of the unknowns allows no more: the rates have grown by 64, or by 8."""
PROLONGED = 10
"""Times by which a way is doubled to find the pole it was going to."""
GROWTH = 1.1
"""Least growth of a rate from one division to the next. Near a pole of order p it is 2^p, at a jump 1."""
STEPS_BACK = 64.0
"""Steps, of the length of the last one, within which a jump is looked for: a matrix that crossed it has served
`MATRIX_MAX_AGE` steps, each at most twice as long as the one before."""
JUMPS = 0.5
"""Part of the change over a way that is left between neighbouring numbers where the equations jump: all but what they
change by on the rest of the way."""


@njit(cache=True, nogil=True, error_model="numpy")
def stays_on_branch(functions, st, plan, factors):
    """Return whether the unknowns of index one have come to their new values along the branch they were on.

    Their equations g(z, t) = 0 may have several solutions. Where theirs ends, at a fold, Newton's method finds another
    one, and where a prediction is far off, any. With d = z_old - z_new, the secant of g between the two against its
    tangent at the new point, e = J^-1 g(z_old), is e/d = 1 for a straight g, about 1/p for a power p, and of the other
    sign, or next to zero, where the derivative has changed sign in between once, or twice. What is next to zero in a
    step that has been cut is that in the shortest step too: then g is the same as before and z is not. A g that itself
    jumps leaves a residual as large as the jump.

    Only unknowns whose change was not foreseen are looked at: for those it costs a matrix and a residual.
    """
    y, old, pred, weight, own = st.y, rows_from(st, 1)[0], st.y_pred, st.weight, st.index_one
    if st.steps == 0:
        # wrong starting values of algebraic unknowns are replaced
        return True
    seen = -1
    for i in range(y.shape[0]):
        off = abs(y[i] - pred[i])
        if own[i] != 0.0 and off * weight[i] > UNFORESEEN and off > UNFORESEEN_PART * abs(y[i] - old[i]):
            if seen < 0 or abs(y[i] - old[i]) * weight[i] > abs(y[seen] - old[seen]) * weight[seen]:
                seen = i
    if seen < 0:
        return True
    if not renew_matrix(functions, st, plan, factors):
        return st.drop_level > 0
    between, secant = st.y_between, st.delta
    copy(y, between)
    for i in range(y.shape[0]):
        if own[i] != 0.0:
            between[i] = old[i]
    functions.residual(st.t_seen, between, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1
    solve(plan, factors, st.res, secant)
    along = 0.0
    square = 0.0
    for i in range(y.shape[0]):
        if own[i] != 0.0:
            size = 1.0 / (abs(y[i]) + abs(old[i]) + 1.0 / weight[i])
            d = (old[i] - y[i]) * size
            along += secant[i] * size * d
            square += d * d
    cut = st.h < CUT_TO_TELL * st.h_first or st.n_past <= 1
    least = SAME_EQUATION if cut else SAME_BRANCH
    if not along < least * square:
        return True
    st.jumped = seen
    st.jump_from = old[seen]
    st.jump_to = y[seen]
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _determinant_sign(st, plan, factors):
    """Return the sign of the determinant of the factored matrix, 0 if it is not known."""
    inverse, kept = factors.pivot_inv, plan.kept
    sign = st.plan_sign
    for k in range(inverse.shape[0]):
        if kept[k] == 0.0 or not np.isfinite(inverse[k]) or inverse[k] == 0.0:
            return 0.0
        if inverse[k] < 0.0:
            sign = -sign
    return sign


@njit(cache=True, nogil=True, error_model="numpy")
def _pencil_sign(functions, st):
    """Return the sign of det(dG/dy + gamma dG/dy') at the iterate for large gamma; 0 if it cannot be told.

    Gaussian elimination with rows of unit size and pivots by columns: those of the step need not fit.
    """
    n, gamma = st.y.shape[0], st.gamma_large
    functions.jacobian(st.t_seen, st.y, st.yp, gamma, st.matrix, st.idata, st.rdata, st.work)
    st.jacobians += 1
    a = np.zeros((n, n))
    for p in range(st.matrix.shape[0]):
        a[st.entry_row[p], st.entry_col[p]] = st.matrix[p]
    copy(st.jac, st.matrix)
    carry_over(st)
    for i in range(n):
        size = np.abs(a[i]).max()
        if not (size > 0.0 and np.isfinite(size)):
            return 0.0
        a[i] /= size
    sign = 1.0
    for k in range(n):
        m = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[m, k]):
                m = i
        if not abs(a[m, k]) > n * EPS * EPS:
            return 0.0
        if m != k:
            sign = -sign
            for j in range(k, n):
                a[k, j], a[m, j] = a[m, j], a[k, j]
        if a[k, k] < 0.0:
            sign = -sign
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
    return sign


@njit(cache=True, nogil=True, error_model="numpy")
def is_lost(functions, st, plan, factors):
    """Return whether the step has left the solution, as the derivatives at the iterate itself tell.

    A matrix that has grown old says of any correction that it is small where its entries are too large: those of a
    place next to a pole, or a difference quotient across one. So one that has to be made anew for its age, not for
    slow convergence, is judged first. Where an equation is violated by far, the corrector goes on from where it was
    with a new matrix, and it is lost if that takes it far away. At a contact that opens or closes it does not.
    ``st.worst_row`` and ``st.violation`` are left as by `equations_hold`.
    """
    functions.jacobian(st.t_seen, st.y, st.yp, st.gamma, st.matrix, st.idata, st.rdata, st.work)
    st.jacobians += 1
    held = equations_hold(functions, st)
    copy(st.jac, st.matrix)
    carry_over(st)
    if held or st.violation <= VIOLATED:
        return False
    y, yp = st.y.copy(), st.yp.copy()
    lost = renew_matrix(functions, st, plan, factors) and correct(functions, st, plan, factors) == CONVERGED
    away = 0.0
    for i in range(y.shape[0]):
        moved = abs(st.y[i] - y[i]) * st.weight[i]
        if moved > away:
            away = moved
            st.worst = i
    copy(y, st.y)
    copy(yp, st.yp)
    st.matrix_wanted = True
    return lost and away > LOST


@njit(cache=True, nogil=True, error_model="numpy")
def keeps_its_index(functions, st, plan, factors):
    """Return whether no singular pencil lies between the last accepted step and this one.

    The determinant of dG/dy + gamma dG/dy' is a polynomial in gamma whose leading coefficient vanishes where the index
    changes or a branch ends, and nowhere else on a solution. A corrector converges with a matrix only if its sign is
    that of the matrix at the solution, so that the factors know of a change; a mode that grows faster than the step
    changes it too, and at a large gamma alone tells the two apart.
    """
    st.gamma_large = max(st.gamma_large, LARGER_GAMMA * st.gamma)
    sign = _determinant_sign(st, plan, factors)
    if sign == 0.0 or (sign == st.sign_last and st.sign_pencil != 0.0):
        return True
    pencil = _pencil_sign(functions, st)
    if st.sign_pencil != 0.0 and pencil != 0.0 and pencil != st.sign_pencil:
        st.index_changes = True
        return False
    if pencil != 0.0:
        st.sign_pencil = pencil
        st.sign_last = sign
        st.t_pencil = st.t_new
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def kept_its_index(functions, st):
    """Return the same of the end of a run: a matrix that nothing asks to be renewed knows of no change."""
    pencil = _pencil_sign(functions, st)
    return st.sign_pencil == 0.0 or pencil == 0.0 or pencil == st.sign_pencil


# Poles of rates.


@njit(cache=True, nogil=True, error_model="numpy")
def _unforeseen(st, i, old):
    """Return whether unknown i has missed its prediction by a good part of its way, and of its tolerance, and turned.

    Beyond a pole that is told by another sign of its equation without the rate the rate has another sign, too, than in
    the step before. Unknowns that oscillate miss their predictions by part of their way where they turn, and their
    rates pass through zero there.
    """
    off = abs(st.y[i] - st.y_pred[i])
    far = (off > MISSED_PART * abs(st.y[i] - old[i])) & (off * st.w_error[i] > MISSED)
    # with one point alone the rate of the start stands for that before
    turned = st.yp[i] * (old[i] - rows_from(st, 2)[0, i] if st.n_past > 1 else st.yp_start[i]) <= 0.0
    return far & turned & (st.differential[i] != 0.0)


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
    if not st.watches_poles:
        return False
    old = rows_from(st, 1)[0]
    suspected = st.pole >= 0 or st.leapt >= 0
    for i in range(st.y.shape[0]):
        suspected |= _unforeseen(st, i, old)
    for m in range(st.n_carried):
        suspected |= _outruns_step(st, m)
    if not suspected:
        return False
    if _pole_between(functions, st, old):
        return True
    if _rates_hold(functions, st):
        return False
    if st.pole >= 0:
        return True
    # rates that do not hold tell of a pole if one lies behind; where they jump they need not hold
    for k in range(2, st.n_past + 1):
        copy(st.y, st.y_pred)
        if _pole_between(functions, st, rows_from(st, k)[0]):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _rates_hold(functions, st):
    """Return whether the rates satisfy the equations of unknowns that have met a pole before.

        |G_i| <= sum_j |dG_i/dy'_j| (RATES_HELD |y'_j| + gamma HELD tolerance_j) + ROUNDED_TERMS eps sum_j |J_ij y_j|

    The derivatives by the unknowns, which next to a pole are so large that they make any residual look small, are left
    out of what is allowed but for rounding.
    """
    n = st.y.shape[0]
    # predictions have served
    looked_at, allowed = st.y_pred, st.yp_pred
    looked_at[:] = 0.0
    allowed[:] = 0.0
    for m in range(st.n_carried):
        p = st.carried[m]
        i, j = st.entry_row[p], st.entry_col[p]
        allowed[i] += abs(st.jac_slope[p]) * (RATES_HELD * abs(st.yp[j]) + st.gamma * HELD / st.weight[j])
        if j == st.pole or _outruns_step(st, m):
            looked_at[i] = 1.0
    for p in range(st.matrix.shape[0]):
        j = st.entry_col[p]
        allowed[st.entry_row[p]] += ROUNDED_TERMS * EPS * abs(st.matrix[p] * st.y[j])
    functions.residual(st.t_seen, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1
    for i in range(n):
        if looked_at[i] != 0.0 and not abs(st.res[i]) <= allowed[i]:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _terms(functions, st, old, suspect, part, out):
    """Write the residual with y' = 0 into ``out``, at a part of the way of the suspected unknowns."""
    y, rates = st.y_between, st.yp_between
    for i in range(y.shape[0]):
        y[i] = old[i] + part * (st.y[i] - old[i]) if suspect[i] != 0.0 else st.y[i]
        rates[i] = 0.0
    functions.residual(st.t_seen, y, rates, out, st.idata, st.rdata, st.work)
    st.residuals += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _pole_between(functions, st, old):
    """Return whether there is a pole on the way of the suspected unknowns; note in ``st`` of which and where.

    There is one if the terms without a rate of some equation have another sign at the two ends of the way (else
    nothing is divided) and grow by `GROWTH` with each of `FEWEST` divisions or more of the part in which they turn.
    ``st.delta`` marks the suspects afterwards; the prediction is overwritten.
    """
    n = st.y.shape[0]
    suspect = st.delta
    for i in range(n):
        suspect[i] = 1.0 if _unforeseen(st, i, old) else 0.0
    for k in range(st.n_carried):
        if _outruns_step(st, k):
            suspect[st.entry_col[st.carried[k]]] = 1.0
    for i in (st.pole, st.leapt):
        if i >= 0:
            suspect[i] = 1.0
    # there is one: of `passes_pole` it is a condition, and `_rates_hold` fails by entries that outrun the step alone
    first = 0
    while suspect[first] == 0.0:
        first += 1
    at_a, at_b, at_m = st.res, st.y_pred, st.yp_pred
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
    # all suspects have gone the same part of their ways: the first tells where, whichever row has grown
    st.pole = first
    st.pole_met = True
    st.pole_at = _place(st, old, first, m)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _place(st, old, i, part):
    """Return the value of unknown i at a part of its way."""
    return old[i] + part * (st.y[i] - old[i])


@njit(boolean(FUNCTIONS_TYPE, STATE_TYPE, int64), cache=True, nogil=True, error_model="numpy")
def has_pole_ahead(bound, st, i):
    """Return whether unknown i was on its way to a pole of the rates when the open step was given up; note where.

    Next to it each step goes part of the way that is left, so that the way of the last one is prolonged until it has
    got over.
    """
    functions, kept, known = unbound(bound), st.y.copy(), st.pole
    old, way = rows_from(st, 1)[0], rows_from(st, 1)[0][i] - rows_from(st, 2)[0][i]
    st.pole = i
    for _ in range(PROLONGED):
        way *= 2.0
        copy(old, st.y)
        st.y[i] = old[i] + way
        if way != 0.0 and _pole_between(functions, st, old):
            return True
    copy(kept, st.y)
    st.pole = known
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _rate(functions, st, i, value, row, slope):
    """Return what equation ``row`` makes of the rate of unknown i at a value of it."""
    st.y[i] = value
    _terms(functions, st, st.y, st.delta, 1.0, st.res)
    return -st.res[row] / slope


@njit(boolean(FUNCTIONS_TYPE, STATE_TYPE, int64, float64[::1]), cache=True, nogil=True, error_model="numpy")
def stays_on_jump(bound, st, i, found):
    """Return whether the rate of unknown i jumps near the last steps, and points at the jump from both sides.

    ``found`` becomes the value of the unknown at the jump, and the rates below and above. As with poles the rate is
    what the terms without rates make of it, with all other unknowns as they are.
    """
    functions, kept = unbound(bound), st.y.copy()
    old = rows_from(st, 1)[0]
    way = STEPS_BACK * abs(old[i] - rows_from(st, 2)[0][i])
    slope, row = 0.0, -1
    for k in range(st.n_carried):
        p = st.carried[k]
        if st.entry_col[p] == i and abs(st.jac_slope[p]) > abs(slope):
            slope, row = st.jac_slope[p], st.entry_row[p]
    if row < 0 or not way > 0.0:
        return False
    below, above = old[i] - way, old[i] + way
    copy(old, st.y)
    low, high = _rate(functions, st, i, below, row, slope), _rate(functions, st, i, above, row, slope)
    whole = low - high
    place = below + 0.5 * (above - below)
    nearest = ROUNDED_TERMS * EPS * max(abs(below), abs(above))
    while above - below > nearest and below < place < above and low > 0.0 > high:
        rate = _rate(functions, st, i, place, row, slope)
        if rate > 0.0:
            below, low = place, rate
        else:
            above, high = place, rate
        place = below + 0.5 * (above - below)
    # at the jump itself, as sign(0) is, a rate may be another one
    low = _rate(functions, st, i, below - nearest, row, slope)
    high = _rate(functions, st, i, above + nearest, row, slope)
    copy(kept, st.y)
    found[0], found[1], found[2] = place, high, low
    # at a pole it would have grown
    return low > 0.0 > high and JUMPS * whole < low - high < whole / JUMPS
