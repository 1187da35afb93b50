"""Whether a step has stayed on the solution it began with: its branch, and the index of the equations."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.newton_matrix import carry_over, renew_matrix
from gearmbs.dae.integrators.run_state import copy, rows_from
from gearmbs.dae.linalg.sparse_lu import solve
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit

UNFORESEEN = 100.0
"""Tolerances by which an algebraic unknown has to miss its prediction to be looked at."""
UNFORESEEN_PART = 0.1
"""And that as part of its change in the step: where a fold is near, the prediction knows half of it."""
SAME_BRANCH = 0.2
"""Least secant, in tangents, of a step that is not cut for it: that of a fifth power, or of exp over five units."""
SAME_EQUATION = 1e-3
"""The same of steps that have been cut: a jump of the equation has 1/p, a fold the length of the step."""
CUTS_TO_TELL = 4
LARGER_GAMMA = 10.0
"""Ratio of the gamma at which the pencil is looked at to the largest leading coefficient of the run. Its first steps
resolve the fastest modes, whose entries, wrong in differences by 1e-8, would drown the derivatives at a smaller one."""


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
    functions.residual(st.t_new, between, st.yp, st.res, st.idata, st.rdata, st.work)
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
    least = SAME_BRANCH if st.newton_fails < CUTS_TO_TELL and st.n_past > 1 else SAME_EQUATION
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
    functions.jacobian(st.t_new, st.y, st.yp, gamma, st.matrix, st.idata, st.rdata, st.work)
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
