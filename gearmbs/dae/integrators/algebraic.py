"""Algebraic unknowns at an instant: solved for from the differential ones, where outputs lie between the steps.

The polynomial of a step interpolates differential unknowns within the tolerance, for the error test looks at them. It
says nothing of an algebraic unknown outside error control, which may do anything between two steps. Such unknowns z
are solved for where they are asked for. With t and the differential unknowns x given, the unknowns are z and, as far
as their equations hold them, the rates x'. In the graph of equations and these unknowns

* an equation that holds some of them stands for itself, G_i(t, x, x', z) = 0;
* one that holds none, g(t, x) = 0, is a constraint. Its derivative g_t + g_x x' = 0 takes its place: it determines
  the multipliers of a system of index two;
* a largest matching tells what the equations determine: all that no path alternating between matched and other edges
  connects with an unmatched unknown (Dulmage and Mendelsohn).

Of these the equations that the wanted unknowns need are solved by Newton's method with a frozen matrix. Then z', the
slope along x', solves G_x x' + G_z z' + G_t = 0 with the same matrix.

References
----------
.. [1] A. L. Dulmage, N. S. Mendelsohn, "Coverings of bipartite graphs", Canad. J. Math. 10 (1958) 517-534.
.. [2] C. C. Pantelides, "The consistent initialization of differential-algebraic systems", SIAM J. Sci. Stat. Comput.
       9 (1988) 213-231.
.. [3] M. Abramowitz, I. A. Stegun (eds.), "Handbook of Mathematical Functions", NBS (1964), 25.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numba import float64, int64, types

from gearmbs.dae.integrators.algebraic_structure import (
    MOST_RANKED,
    MOST_TOGETHER,
    Graph,
    Structure,
    chosen,
    dependences,
    has_hidden_constraints,
    structure,
)
from gearmbs.dae.integrators.messages import list_names
from gearmbs.dae.integrators.options import BESIDE
from gearmbs.dae.problem import EPS, DAEProblem
from gearmbs.dae.result import combine, lagrange_weights
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import FUNCTIONS_TYPE, bind, direct, no_events, no_hook
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector

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
SINGULAR = 1e-13
"""Ratio of pivots of the scaled matrix below which it counts as singular."""
FOLLOWED = 200
"""Parts of a step in which a branch is followed, at most."""
SHORTEST = 1e-6
"""Smallest of these parts: a branch that turns within it ends or jumps."""
SPAN_OF_CONSTRAINTS = 1e-2
"""Spacing s of the differences along the solution in units of the step, for constraints. Over four of them the error is
s^4/30 of the fifth derivative in units of the step, 3e-10 of what a step can tell apart; rounding is divided by s h."""
WIDER, WIDENINGS = 30.0, 5
"""Times 30 the span is tried where rounding of the differences exceeds the tolerance, up to four times: steps at starts
shrink with the tolerance and are far shorter than what changes in the constraints."""
SPAN_OF_SLOPES = 2e-3
"""The same for the slopes of algebraic unknowns, which may vary much faster than the step tells: by radians over it."""
CLOSER, NEARER = 0.25, 0.75
"""Part of the step over which an output at the start is solved for once more, and part of the distance to a value given
there that is left where it is the limit: 1/2 of t^1.5, while smooth constraints lead to one value over both."""
RATE_OF_MATRIX = 1e8
"""Leading coefficient in units of the reciprocal step from which dG/dy' is read off: the rest is 1e-8 of it."""
UNRESOLVED = 100.0
"""Tolerances by which an output may be off what the steps say of it, and by which a step that ended there would have
to move an unknown under error control, before the output counts as news to the steps: a step is refused at one."""
LOOKED_AT = 10
"""Outputs that are looked at, those the furthest off: one for each algebraic unknown."""
MAX_POINTS = 8
"""Points of a polynomial of the highest order, and one to spare."""


class AlgebraicPart(Struct):
    """Equations and unknowns that are solved at an instant, and scratch for it.

    Attributes
    ----------
    rows : ndarray of int64, shape (m,)
        Equation of the problem.
    lifted : ndarray of int64, shape (m,)
        1 where its derivative by time takes its place.
    cols : ndarray of int64, shape (m,)
        Unknown of the problem.
    rates : ndarray of int64, shape (m,)
        1 where its rate is solved for.
    entry_row, entry_col, entry_at, entry_kind : ndarray of int64
        Entries of the matrix: place in it, place among the CSC values, and 1 for a derivative by a rate.
    atol : ndarray, shape (n,)
        Absolute tolerances.
    lu, scale, pivots : ndarray, shapes (m, m), (m,) and (m,)
        Factors of the matrix, scales of its rows, interchanges.
    f, guess, last, known, here : ndarray, shape (m,)
        What the equations are off by, or corrections; values to return to: of a guess, of slopes, along a branch; what
        they are off by at a breakpoint.
    told : ndarray, shape (m,)
        What an integrator says of them between its steps.
    moved, moved_at, moved_step : ndarray, shape (s,)
        By how many tolerances outputs are off that, the furthest of each of at most `LOOKED_AT` unknowns; when; and the
        size of the step around. Zero for a place that is free.
    moved_of : ndarray of int64, shape (s,)
        Which of the unknowns.
    moved_rdata : ndarray, shape (s, p)
        The table of numbers that was valid then: angles count their turns in it.
    """

    count: int
    any_lifted: bool
    any_rates: bool
    noting: bool  # whether outputs far off are to be kept
    factored: bool
    rtol: float
    t_start: float  # ends of the run: a table may end with it
    t_end: float
    t_first: float  # breakpoints or ends on either side: beyond them constraints may have other derivatives
    t_last: float
    failures: int  # instants at which the iteration did not converge
    first_failure: float
    rows: IntVector
    lifted: IntVector
    cols: IntVector
    rates: IntVector
    entry_row: IntVector
    entry_col: IntVector
    entry_at: IntVector
    entry_kind: IntVector
    atol: Vector
    vals: Vector
    vals_of_rates: Vector
    lu: Matrix
    scale: Vector
    pivots: IntVector
    f: Vector
    guess: Vector
    last: Vector
    known: Vector
    here: Vector
    told: Vector
    moved: Vector
    moved_at: Vector
    moved_step: Vector
    moved_of: IntVector
    moved_rdata: Matrix
    res: Vector
    y_moved: Vector
    yp_kept: Vector
    value: Vector
    slope: Vector


PART_TYPE = AlgebraicPart.numba_type
_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


# --- the iteration ---------------------------------------------------------------------------------------


@njit(cache=True, nogil=True, error_model="numpy")
def _factor(part):
    """Factor ``part.lu`` with rows scaled to one, by Gauss's elimination with row interchanges; False if singular."""
    a, scale, pivots = part.lu, part.scale, part.pivots
    m = part.count
    for i in range(m):
        top = 0.0
        for j in range(m):
            top = max(top, abs(a[i, j]))
        if not (top > 0.0 and top < np.inf):
            return False
        scale[i] = 1.0 / top
        for j in range(m):
            a[i, j] *= scale[i]
    largest = 0.0
    for k in range(m):
        p = k
        for i in range(k + 1, m):
            if abs(a[i, k]) > abs(a[p, k]):
                p = i
        pivots[k] = p
        column = 0.0
        for i in range(m):
            column = max(column, abs(a[i, k]))
        if not abs(a[p, k]) > SINGULAR * column:
            return False
        largest = max(largest, column)
        if p != k:
            for j in range(m):
                a[k, j], a[p, j] = a[p, j], a[k, j]
        for i in range(k + 1, m):
            q = a[i, k] / a[k, k]
            a[i, k] = q
            if q != 0.0:
                for j in range(k + 1, m):
                    a[i, j] -= q * a[k, j]
    return np.isfinite(largest)


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(part, x):
    """Solve with the factors of `_factor`; ``x`` is right-hand side and solution."""
    a, m = part.lu, part.count
    for k in range(m):
        x[k] *= part.scale[k]
    for k in range(m):
        p = part.pivots[k]
        x[k], x[p] = x[p], x[k]
    for k in range(m):
        for i in range(k + 1, m):
            x[i] -= a[i, k] * x[k]
    for k in range(m - 1, -1, -1):
        x[k] /= a[k, k]
        for i in range(k):
            x[i] -= a[i, k] * x[k]


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
    part.factored = _factor(part)
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
    """Write the derivatives by time of all rows along y', where y' itself is kept: (8 (1) - (2))/(12 s) [3]_.

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
def _put(part, x, y, yp):
    for k in range(part.count):
        if part.rates[k] == 1:
            yp[part.cols[k]] = x[k]
        else:
            y[part.cols[k]] = x[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _take(part, y, yp, x):
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
        _solve(part, f)
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
        _solve(part, f)
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
    _take(part, y, yp, part.guess)
    found = part.factored and _iterate(functions, part, t, y, yp, h, h, False, idata, rdata, work)
    wide = h
    for _ in range(WIDENINGS if part.any_lifted else 1):
        if found:
            break
        _put(part, part.guess, y, yp)
        found = _evaluate_matrix(functions, part, t, y, yp, h, idata, rdata, work)
        found = found and _iterate(functions, part, t, y, yp, h, wide, True, idata, rdata, work)
        wide *= WIDER
    if not found:
        part.factored = False
        _put(part, part.guess, y, yp)
    for i in range(yp.shape[0]):
        yp[i] = kept[i]
    if found and not part.any_rates:
        _slopes_of_unknowns(functions, part, t, y, yp, h, idata, rdata, work)
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def settle_between(functions, part, t, t_old, y_old, h, nodes, rows, first, count, y, yp, idata, rdata, work):
    """Write y and y' at ``t`` from the polynomial of a step, and solve for the algebraic unknowns there.

    Where the iteration does not converge from the polynomial's values, or not to a root near them, the branch is
    followed from the old end of the step in parts, each from the solution before. What cannot be solved for keeps the
    polynomial's value, and is counted.

    Parameters
    ----------
    functions : Functions
    part : AlgebraicPart
    t, t_old : float
        Instant, and old end of the step.
    y_old : ndarray, shape (n,)
        Unknowns at the old end.
    h : float
        Size of the step.
    nodes, rows, first, count : ndarray, ndarray, int, int
        Times of the points of the polynomial; their values from row ``first`` on; their number.
    y, yp : ndarray, shape (n,)
        Written.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.
    """
    value, slope = part.value, part.slope
    lagrange_weights(t, nodes, count, value, slope)
    combine(value, slope, count, rows, first, y, yp)
    _take(part, y, yp, part.told)
    if part.count == 0 or settle(functions, part, t, y, yp, h, idata, rdata, work):
        return
    at = t_old
    step = 0.5 * (t - t_old)
    z = part.known
    for k in range(part.count):
        z[k] = y_old[part.cols[k]]
    for _ in range(FOLLOWED):
        s = min(at + step, t)
        if t - s < SHORTEST * h:
            s = t
        lagrange_weights(s, nodes, count, value, slope)
        combine(value, slope, count, rows, first, y, yp)
        for k in range(part.count):
            if part.rates[k] == 0:
                y[part.cols[k]] = z[k]
        if settle(functions, part, s, y, yp, h, idata, rdata, work):
            if s == t:
                return
            for k in range(part.count):
                z[k] = y[part.cols[k]]
            at = s
            step *= 2.0
        else:
            step *= 0.25
            if step < SHORTEST * h:
                break
    lagrange_weights(t, nodes, count, value, slope)
    combine(value, slope, count, rows, first, y, yp)
    note_failure(part, t)


@njit(cache=True, nogil=True, error_model="numpy")
def note_moves(part, t, y, h, rdata):
    """Keep by how far the output ``y`` is off what the step of size ``h`` around it says, where that is the most yet.

    A step begins at the breakpoint before it, at the earliest; at one the equations are of either side.
    """
    h = min(h, t - part.t_first)
    if not part.noting or h <= 0.0 or part.t_last - BESIDE * abs(t) <= t < part.t_end:
        return
    for k in range(part.count):
        if part.rates[k] == 0:
            now, told = y[part.cols[k]], part.told[k]
            off = abs(now - told) / (part.atol[part.cols[k]] + part.rtol * max(abs(now), abs(told)))
            if off > UNRESOLVED:
                _keep_move(part, k, off, t, h, rdata)


@njit(cache=True, nogil=True, error_model="numpy")
def _keep_move(part, k, off, t, h, rdata):
    """Keep an output in the place of its unknown, or in that of the unknown the least off, if it is further off."""
    place = 0
    for q in range(part.moved.shape[0]):
        if part.moved[q] > 0.0 and part.moved_of[q] == k:
            place = q
            break
        if part.moved[q] < part.moved[place]:
            place = q
    if off > part.moved[place]:
        part.moved[place], part.moved_at[place], part.moved_step[place], part.moved_of[place] = off, t, h, k
        for i in range(rdata.shape[0]):
            part.moved_rdata[place, i] = rdata[i]


@njit(cache=True, nogil=True, error_model="numpy")
def note_failure(part, t):
    """Count an instant at which the algebraic unknowns could not be solved for."""
    if part.failures == 0:
        part.first_failure = t
    part.failures += 1


@njit(
    int64(FUNCTIONS_TYPE, _IVEC, _VEC, _MAT, int64, int64, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def follow(functions, orders, nodes, rows, seen, last, idata, rdata, work):
    """Let the hook look at the ends of steps among the rows behind ``seen`` up to ``last``; return which was the last.

    What it keeps in ``rdata``, as turns that are counted, is then as it was in the run. The other parameters are those
    of `settle_on_steps`, the integer table that of these steps.

    Parameters
    ----------
    orders, nodes, rows
        Order, time and unknowns of each stored step, shapes (m,), (m,) and (m, n).
    seen, last : int
        Rows the hook has looked at, and is to look at.
    """
    point, table = np.empty((1, rows.shape[1])), np.empty_like(idata)
    for r in range(seen + 1, last + 1):
        if orders[r] > 0:
            # where it changes the coordinates rows that are stored behind are in those already
            point[0, :] = rows[r]
            table[:] = idata
            functions.hook(nodes[r], point, 1, table, rdata, work)
    return max(seen, last)


@njit(
    int64(FUNCTIONS_TYPE, PART_TYPE, _VEC, _IVEC, _IVEC, _VEC, _MAT, _MAT, _MAT, int64, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def settle_on_steps(functions, part, times, ends, orders, nodes, rows, y, yp, seen, idata, rdata, work):
    """Write y and y' at ``times``, each on the polynomial of the step that ends in row ``ends[i]``, and settle them.

    Parameters
    ----------
    functions, part
        As of `settle`.
    times, ends, orders, nodes, rows, y, yp
        As of `gearmbs.dae.result.evaluate_many`, the times increasing.
    seen : int
        Row up to which the hook has looked at the steps for ``rdata``; the number of rows if it need not.
    idata, rdata, work : ndarray
        Tables and scratch of the problem.

    Returns
    -------
    seen : int
    """
    for i in range(times.shape[0]):
        e = ends[i]
        seen = follow(functions, orders, nodes, rows, seen, e - 1, idata, rdata, work)
        k = orders[e]
        h = nodes[e] - nodes[e - 1]
        settle_between(
            functions, part, times[i], nodes[e - 1], rows[e - 1], h, nodes[e - k : e + 1], rows, e - k, k + 1,
            y[i], yp[i], idata, rdata, work,
        )  # fmt: skip
        note_moves(part, times[i], y[i], h, rdata)
    return seen


@njit(
    types.void(FUNCTIONS_TYPE, PART_TYPE, float64, _VEC, _VEC, float64, float64, _VEC, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def settle_output(functions, part, t, y, yp, h, t_old, y_old, idata, rdata, work):
    """Settle an output of an integrator that tells nothing between outputs.

    Where the iteration does not converge, the branch is followed on the chord from the output before, ``y_old`` at
    ``t_old``. The other parameters are those of `settle`.
    """
    _take(part, y, yp, part.told)
    if settle(functions, part, t, y, yp, h, idata, rdata, work):
        note_moves(part, t, y, h, rdata)
        return
    n = y.shape[0]
    if t > t_old:
        chord, nodes, z, zp = np.empty((2, n)), np.empty(2), np.empty(n), np.empty(n)
        nodes[0], nodes[1] = t_old, t
        for i in range(n):
            chord[0, i] = y_old[i]
            chord[1, i] = y[i]
        failures = part.failures
        settle_between(functions, part, t, t_old, y_old, t - t_old, nodes, chord, 0, 2, z, zp, idata, rdata, work)
        if part.failures == failures:
            for k in range(part.count):
                if part.rates[k] == 0:
                    y[part.cols[k]] = z[part.cols[k]]
            if settle(functions, part, t, y, yp, h, idata, rdata, work):
                note_moves(part, t, y, h, rdata)
                return
        part.failures = failures
    note_failure(part, t)


def _new_part(m: int, n: int, nnz: int, entries: int, numbers: int) -> AlgebraicPart:
    """Return room for m equations among those of n unknowns, with ``nnz`` entries, ``entries`` of them in these."""
    places = min(m, LOOKED_AT)
    return AlgebraicPart(
        count=m,
        t_start=-np.inf,
        t_end=np.inf,
        t_first=-np.inf,
        t_last=np.inf,
        **{name: np.zeros(m, dtype=np.int64) for name in ("rows", "lifted", "cols", "rates", "pivots")},
        **{name: np.zeros(entries, dtype=np.int64) for name in ("entry_row", "entry_col", "entry_at", "entry_kind")},
        **{name: np.zeros(m) for name in ("scale", "f", "guess", "last", "known", "here")},
        told=np.zeros(m),
        noting=True,
        **{name: np.zeros(places) for name in ("moved", "moved_at", "moved_step")},
        moved_of=np.zeros(places, dtype=np.int64),
        moved_rdata=np.empty((places, numbers)),
        **{name: np.zeros(n) for name in ("atol", "res", "y_moved", "yp_kept")},
        **{name: np.zeros(nnz) for name in ("vals", "vals_of_rates")},
        **{name: np.zeros(MAX_POINTS) for name in ("value", "slope")},
        lu=np.zeros((m, m)),
    )


@cache
def _nothing() -> AlgebraicPart:
    """Return the part of problems without anything to solve for: compiled code but looks at its count."""
    return _new_part(0, 0, 0, 0, 0)


class AlgebraicOutputs:
    """What is solved for at outputs of a problem in a run between two ``ends``, and what is not.

    Attributes
    ----------
    part : AlgebraicPart
    left : ndarray of int
        Algebraic unknowns outside error control that the equations do not determine at an instant.
    coupled : ndarray of int
        Those that depend on too many others.
    """

    def __init__(self, problem: DAEProblem, atol: np.ndarray, rtol: float, ends: tuple[float, float]) -> None:
        self.problem = problem
        wanted, solved, taken = chosen(problem)
        self.left = np.empty(0, dtype=np.int64)
        self.coupled = self.left
        # scratch of polynomials is not shared between threads
        self.part = _nothing().with_members(value=np.zeros(MAX_POINTS), slope=np.zeros(MAX_POINTS))
        if not wanted.any():
            return
        by_y, by_rate = dependences(problem)
        differential = np.asarray(problem.differential, dtype=bool)
        pattern = np.asarray(problem.indptr), np.asarray(problem.indices)
        found = structure(Graph(by_y, by_rate, wanted, solved, differential, taken, *pattern))
        self.left, self.coupled = found.left, found.coupled
        if len(found.rows):
            self.part = self._made(found, atol, rtol)
            self.part.t_start, self.part.t_end = ends

    def _made(self, found: Structure, atol: np.ndarray, rtol: float) -> AlgebraicPart:
        """Return the compiled loop's part of it."""
        problem = self.problem
        sizes = len(found.rows), problem.n, len(problem.indices), len(found.entries), len(problem.rdata)
        part = _new_part(*sizes)
        part.rtol = rtol
        part.any_lifted, part.any_rates = bool(found.lifted.any()), bool(found.rates.any())
        part.rows[:], part.cols[:], part.lifted[:], part.rates[:] = found.rows, found.cols, found.lifted, found.rates
        part.atol[:] = atol
        part.entry_row[:], part.entry_col[:], part.entry_at[:], part.entry_kind[:] = found.entries.T
        return part

    @property
    def is_needed(self) -> bool:
        """Whether there is anything to solve for."""
        return self.part.count > 0

    @property
    def is_constrained(self) -> bool:
        """Whether there are unknowns of index two or more, or what stands for them without error control."""
        problem = self.problem
        of_mechanism = problem.solved_at_outputs is not None
        integrated = bool((problem.differential & ~np.asarray(problem.error_mask, dtype=bool)).any())
        if of_mechanism or integrated or bool(self.part.any_lifted) or len(self.left) or len(self.coupled):
            return True
        return problem.n > MOST_RANKED or has_hidden_constraints(problem)

    @property
    def functions(self) -> Any:
        """The functions of the problem, bound together for compiled code."""
        problem = self.problem
        return bind(problem.residual, problem.jacobian, problem.hook or no_hook, no_events)

    def settle_start(
        self,
        t: float,
        y: np.ndarray,
        yp: np.ndarray,
        h: float,
        idata: np.ndarray,
        stops: Sequence[float] | np.ndarray,
    ) -> None:
        """Settle the output at the start in place, in a step of about ``h``; what cannot be stays as it was given.

        The run may have passed some of the breakpoints ``stops`` by then. A value given that differences over shorter
        steps approach stays: a constraint has no smooth rate there, as t^1.5 at 0.
        """
        part = self.part
        kept, part.noting = (part.failures, part.t_first, part.t_last), False
        rdata = self.problem.rdata
        part.t_first, part.t_last = t, stops[0] if len(stops) else part.t_end
        given, closer = (y.copy(), yp.copy()), (y.copy(), yp.copy())
        self.settle_after(t, y, yp, h, t, y, idata, rdata)
        if part.any_lifted:
            failures = part.failures
            self.settle_after(t, *closer, CLOSER * h, t, closer[0], idata, rdata)
            if part.failures == failures:
                limit = np.abs(closer[0] - given[0]) < NEARER * np.abs(y - given[0])
                y[limit], yp[limit] = given[0][limit], given[1][limit]
        part.failures, part.t_first, part.t_last = kept
        part.noting = True

    def settle_after(
        self,
        t: float,
        y: np.ndarray,
        yp: np.ndarray,
        h: float,
        t_old: float,
        y_old: np.ndarray,
        idata: np.ndarray,
        rdata: np.ndarray,
    ) -> None:
        """Settle one output in place, with the tables valid there; see `settle_output`."""
        tables = idata, rdata.copy(), np.zeros(self.problem.work_size)
        direct(settle_output)(self.functions, self.part, t, y, yp, h, t_old, y_old, *tables)

    def remark(self) -> str:
        """Say which unknowns are known at the steps alone, and where they could not be solved for."""
        problem, part = self.problem, self.part
        parts = []
        of_mechanism = problem.solved_at_outputs is not None
        remedy = "" if of_mechanism else " State a problem of index one or two, or put it under error_mask."
        for unknowns, why in (
            (self.left, f"no equation and no derivative of one determines it at an instant.{remedy}"),
            (self.coupled, f"it depends on more than {MOST_TOGETHER} others. Put it under error_mask."),
        ):
            if len(unknowns):
                names = list_names(problem, unknowns)
                parts.append(f"Between the steps {names} is interpolated without control of the error: {why}")
        if part.failures:
            algebraic = np.unique(part.cols[part.rates == 0])
            parts.append(
                f"At {part.failures} instants, the first t = {part.first_failure:.9g}, "
                f"{list_names(problem, algebraic)} could not be solved for, and the interpolated values stand there."
            )
        return " ".join(parts)
