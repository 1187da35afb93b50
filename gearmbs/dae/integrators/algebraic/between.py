"""Algebraic unknowns between the steps of a run: on a step's polynomial, or along its branch from the step's start."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.algebraic.instant import settle, take
from gearmbs.dae.integrators.algebraic.part import PART_TYPE
from gearmbs.dae.integrators.options import BESIDE
from gearmbs.dae.result import combine, lagrange_weights
from gearmbs.kernels.bound import FUNCTIONS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.placed import unbound

FOLLOWED = 200
"""Parts of a step in which a branch is followed, at most."""
SHORTEST = 1e-6
"""Smallest of these parts: a branch that turns within it ends or jumps."""
UNRESOLVED = 100.0
"""Tolerances by which an output may be off what the steps say of it, and by which a step that ended there would have
to move an unknown under error control, before the output counts as news to the steps: a step is refused at one."""

_VEC = float64[::1]
_MAT = float64[:, ::1]
_IVEC = int64[::1]


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
    take(part, y, yp, part.told)
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
def follow(bound, orders, nodes, rows, seen, last, idata, rdata, work):
    """Let the hook look at the ends of steps among the rows behind ``seen`` up to ``last``; return which was the last.

    What it keeps in ``rdata``, as turns that are counted, is then as it was in the run. The other parameters are those
    of `settle_on_steps`, the integer table that of these steps.

    Parameters
    ----------
    bound : Functions
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
            unbound(bound).hook(nodes[r], point, 1, table, rdata, work)
    return max(seen, last)


@njit(
    int64(FUNCTIONS_TYPE, PART_TYPE, _VEC, _IVEC, _IVEC, _VEC, _MAT, _MAT, _MAT, int64, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def settle_on_steps(bound, part, times, ends, orders, nodes, rows, y, yp, seen, idata, rdata, work):
    """Write y and y' at ``times``, each on the polynomial of the step that ends in row ``ends[i]``, and settle them.

    Parameters
    ----------
    bound : Functions
    part
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
    functions = unbound(bound)
    for i in range(times.shape[0]):
        e = ends[i]
        seen = follow(bound, orders, nodes, rows, seen, e - 1, idata, rdata, work)
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
def settle_output(bound, part, t, y, yp, h, t_old, y_old, idata, rdata, work):
    """Settle an output of an integrator that tells nothing between outputs.

    Where the iteration does not converge, the branch is followed on the chord from the output before, ``y_old`` at
    ``t_old``. The other parameters are those of `settle`.
    """
    functions = unbound(bound)
    take(part, y, yp, part.told)
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
