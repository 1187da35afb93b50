"""Newton's method for the algebraic unknowns at an instant, and their slopes there.

References
----------
.. [1] M. Abramowitz, I. A. Stegun (eds.), "Handbook of Mathematical Functions", NBS (1964), 25.3.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.algebraic.part import factor, solve
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit

SETTLED = 1e-6
"""Part of its tolerance by which an unknown may be off after the iteration: so little that an output does not depend on
which others are asked for. A matrix that fits takes two iterations to it, as to any other part."""
ROUNDED = 64.0 * EPS
"""Part of an unknown below which a correction is rounding of the few terms of its equation."""
STAGNANT = 1.0
"""Tolerances within which an iteration that gets no further counts as at its end: rounding of ill-conditioned rows."""
ITERATIONS = 10
CONTRACTION = 0.25
"""Ratio of successive corrections with a matrix evaluated at the guess up to which the root is that of the guess's
neighbourhood: the simplified Newton method has a unique root there (Kantorovich: 2 h <= 1 with h = 1/4)."""
SPAN_OF_CONSTRAINTS = 1e-2
"""Spacing s of the differences along the solution in units of the step, for constraints. Over four of them the error is
s^4/30 of the fifth derivative in units of the step, 3e-10 of what a step can tell apart; rounding is divided by s h."""
WIDER, WIDENINGS = 30.0, 5
"""Times 30 the span is tried where rounding of the differences exceeds the tolerance, up to four times: steps at starts
shrink with the tolerance and are far shorter than what changes in the constraints."""
SPAN_OF_SLOPES = 2e-3
"""The same for the slopes of algebraic unknowns, which may vary much faster than the step tells: by radians over it."""
RATE_OF_MATRIX = 1e8
"""Leading coefficient in units of the reciprocal step from which dG/dy' is read off: the rest is 1e-8 of it."""


@njit(cache=True, nogil=True, error_model="numpy")
def _evaluate_matrix(functions, part, t, y, yp, h, idata, rdata, work):
    """Evaluate and factor the matrix at an instant; return whether it is regular.

    The parameters are those of `settle`.
    """
    functions.jacobian(t, y, yp, 0.0, part.vals, idata, rdata, work)
    cj = RATE_OF_MATRIX / h
    if part.any_rates:
        functions.jacobian(t, y, yp, cj, part.vals_of_rates, idata, rdata, work)
    part.lu[:] = 0.0
    for q in range(part.entry_at.shape[0]):
        p = part.entry_at[q]
        v = part.vals_of_rates[p] / cj if part.entry_kind[q] == 1 else part.vals[p]
        part.lu[part.entry_row[q], part.entry_col[q]] = v
    part.factored = factor(part)
    return part.factored


@njit(cache=True, nogil=True, error_model="numpy")
def _is_beyond(functions, part, t, y, yp, idata, rdata, work):
    """Return whether the equations at a breakpoint are those behind it, where other rows than constraints jump.

    The parameters are those of `settle`.
    """
    res, f = part.res, part.here
    before, behind = 0.0, 0.0
    functions.residual(t, y, yp, res, idata, rdata, work)
    for k in range(part.count):
        f[k] = res[part.rows[k]]
    for j in range(2):
        functions.residual(np.nextafter(t, (-np.inf, np.inf)[j]), y, yp, res, idata, rdata, work)
        for k in range(part.count):
            off = abs(res[part.rows[k]] - f[k]) if part.lifted[k] == 0 else 0.0
            before, behind = (max(before, off), behind) if j == 0 else (before, max(behind, off))
    return before > behind


@njit(cache=True, nogil=True, error_model="numpy")
def _slopes(functions, part, t, y, yp, s, f, idata, rdata, work):
    """Write the derivatives by time of all rows along y', where y' itself is kept: (8 (1) - (2))/(12 s) [1]_.

    (1) and (2) are the differences between the rows s and 2 s later and earlier; next to a breakpoint all rows are of
    this side of it, and next to an end of the run of the inside. The slopes are written to ``f``; the other parameters
    are those of `settle`.
    """
    moved, res = part.y_moved, part.res
    f[: part.count] = 0.0
    side = 0.0
    if part.t_first <= t <= part.t_last:
        s = min(s, (part.t_last - part.t_first) / 8.0)
        side = 1.0 if t - 2.0 * s < part.t_first else -1.0 if t + 2.0 * s > part.t_last else 0.0
        if t == part.t_last < part.t_end and _is_beyond(functions, part, t, y, yp, idata, rdata, work):
            side = 1.0
    for j in range(4 if side == 0.0 else 5):
        d = (1.0, -1.0, 2.0, -2.0)[j] * s if side == 0.0 else side * j * s
        weight = (8.0, -8.0, -1.0, 1.0)[j] if side == 0.0 else side * (-25.0, 48.0, -36.0, 16.0, -3.0)[j]
        weight /= 12.0 * s
        for i in range(y.shape[0]):
            moved[i] = y[i] + d * yp[i]
        functions.residual(t + d, moved, yp, res, idata, rdata, work)
        for k in range(part.count):
            f[k] += weight * res[part.rows[k]]


@njit(cache=True, nogil=True, error_model="numpy")
def _rows_at(functions, part, t, y, yp, wide, idata, rdata, work):
    """Write what the equations are off by at an instant to ``part.f``.

    Constraints are differenced over a part of ``wide``; the other parameters are those of `settle`.
    """
    f = part.f
    if part.any_lifted:
        _slopes(functions, part, t, y, yp, SPAN_OF_CONSTRAINTS * wide, f, idata, rdata, work)
    functions.residual(t, y, yp, part.res, idata, rdata, work)
    for k in range(part.count):
        if part.lifted[k] == 0:
            f[k] = part.res[part.rows[k]]


@njit(cache=True, nogil=True, error_model="numpy")
def put(part, x, y, yp):
    for k in range(part.count):
        if part.rates[k] == 1:
            yp[part.cols[k]] = x[k]
        else:
            y[part.cols[k]] = x[k]


@njit(cache=True, nogil=True, error_model="numpy")
def take(part, y, yp, x):
    for k in range(part.count):
        x[k] = yp[part.cols[k]] if part.rates[k] == 1 else y[part.cols[k]]


@njit(cache=True, nogil=True, error_model="numpy")
def _iterate(functions, part, t, y, yp, h, wide, fresh, idata, rdata, work):
    """Correct the unknowns with the present matrix; return whether they converge as from a guess near their root.

    Constraints are differenced over a part of ``wide``. With a ``fresh`` matrix an iteration that gets no further
    within the tolerance is at the level of rounding. The other parameters are those of `settle`.
    """
    f, cols = part.f, part.cols
    previous = np.inf
    for _ in range(ITERATIONS):
        _rows_at(functions, part, t, y, yp, wide, idata, rdata, work)
        solve(part, f)
        norm = 0.0
        for k in range(part.count):
            j = cols[k]
            unit = h if part.rates[k] == 1 else 1.0
            size = abs(yp[j] * h) if part.rates[k] == 1 else abs(y[j])
            allowed = max(SETTLED * (part.atol[j] + part.rtol * abs(y[j])), ROUNDED * size)
            move = abs(f[k]) * unit / allowed
            if not move <= norm:
                norm = move
            if part.rates[k] == 1:
                yp[j] -= f[k]
            else:
                y[j] -= f[k]
        if not np.isfinite(norm):
            return False
        rate = norm / previous
        # a first correction tells nothing of what a frozen matrix leaves
        known = previous < np.inf
        if norm == 0.0 or (known and (norm <= 1.0 or norm * rate <= 1.0 - rate)):
            return True
        if rate > CONTRACTION:
            return fresh and norm <= STAGNANT / SETTLED
        previous = norm
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _slopes_of_unknowns(functions, part, t, y, yp, h, idata, rdata, work):
    """Replace the rates of algebraic unknowns by those that keep their equations satisfied along the solution.

    The parameters are those of `settle`.
    """
    f, last = part.f, part.last
    for k in range(part.count):
        last[k] = yp[part.cols[k]]
    previous = np.inf
    for _ in range(ITERATIONS):
        _slopes(functions, part, t, y, yp, SPAN_OF_SLOPES * h, f, idata, rdata, work)
        solve(part, f)
        norm = 0.0
        for k in range(part.count):
            j = part.cols[k]
            move = h * abs(f[k]) / (part.atol[j] + part.rtol * abs(y[j]))
            if not move <= norm:
                norm = move
        if not norm < previous:
            break
        for k in range(part.count):
            yp[part.cols[k]] -= f[k]
        if norm <= 1.0:
            return
        previous = norm
    if not previous < np.inf:
        for k in range(part.count):
            yp[part.cols[k]] = last[k]


@njit(cache=True, nogil=True, error_model="numpy")
def settle(functions, part, t, y, yp, h, idata, rdata, work):
    """Solve for the algebraic unknowns at an instant, from a guess near them.

    Parameters
    ----------
    functions : Functions
    part : AlgebraicPart
    t : float
    y, yp : ndarray, shape (n,)
        Unknowns and rates there; of the unknowns solved for the guess, replaced by the solution. Rates of differential
        unknowns are left as they are. Without success all are.
    h : float
        Size of the step around ``t``.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.

    Returns
    -------
    found : bool
    """
    kept = part.yp_kept
    for i in range(yp.shape[0]):
        kept[i] = yp[i]
    take(part, y, yp, part.guess)
    found = part.factored and _iterate(functions, part, t, y, yp, h, h, False, idata, rdata, work)
    wide = h
    for _ in range(WIDENINGS if part.any_lifted else 1):
        if found:
            break
        put(part, part.guess, y, yp)
        found = _evaluate_matrix(functions, part, t, y, yp, h, idata, rdata, work)
        found = found and _iterate(functions, part, t, y, yp, h, wide, True, idata, rdata, work)
        wide *= WIDER
    if not found:
        part.factored = False
        put(part, part.guess, y, yp)
    for i in range(yp.shape[0]):
        yp[i] = kept[i]
    if found and not part.any_rates:
        _slopes_of_unknowns(functions, part, t, y, yp, h, idata, rdata, work)
    return found
