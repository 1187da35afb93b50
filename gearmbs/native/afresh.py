"""A run that starts afresh where an input prescribes another speed or acceleration: the start of a run, compiled.

Velocities that a motion prescribes jump to it at once, and others with them, as at an impact without rebound.
`gearmbs.dae.integrators.initial_state` states the same in Python. What it adds to products stands in loops of its own:
numpy rounds in between.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.integrators import initial_state as start
from gearmbs.dae.integrators.corrector import set_weights
from gearmbs.dae.integrators.driver import LEAST_DIGITS
from gearmbs.dae.integrators.run_state import copy, rows_from
from gearmbs.dae.linalg.sparse_lu import solve
from gearmbs.dae.problem import EPS
from gearmbs.dae.result import Status
from gearmbs.kernels.jit import njit
from gearmbs.kernels.placed import unbound
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import IntVector, Struct, Vector
from gearmbs.native.driver import BELOW_ROUNDING
from gearmbs.native.pivots import NOT_FINITE, choose_for_run, factor_at

solve_at = caller(solve.declared)

INCONSISTENT = int(Status.INCONSISTENT_START)


class Afresh(Struct):
    """What a start needs beside the state of a run.

    Attributes
    ----------
    y0, yp0 : ndarray, shape (n,)
        Unknowns and rates where the simulation starts.
    settled : ndarray of int64
        Places of the unknowns that follow from the equations alone, z = f(...).
    """

    first_given: bool
    first_step: float
    smallest_given: bool
    smallest_step: float
    planned_step: float  # that the present pivots were chosen for, zero for none
    planned: bool  # whether there are pivots of this start
    y0: Vector
    yp0: Vector
    settled: IntVector


AFRESH_TYPE = Afresh.struct_kind


@njit(cache=True, nogil=True, error_model="numpy")
def _largest(values, weights):
    """Return the largest |v w|, not a number where one is."""
    largest = 0.0
    for i in range(values.shape[0]):
        size = abs(values[i]) * weights[i]
        if not size <= largest:
            largest = size
        if size != size:
            return size
    return largest


@njit(cache=True, nogil=True, error_model="numpy")
def _are_finite(values):
    """Return whether all values are numbers."""
    finite = True
    for i in range(values.shape[0]):
        finite &= np.isfinite(values[i])
    return finite


@njit(cache=True, nogil=True, error_model="numpy")
def _evaluate_matrix(functions, st, h):
    """Evaluate the Newton matrix of a first step of size ``h``."""
    st.gamma = 1.0 / h
    functions.jacobian(st.t, st.y, st.yp, st.gamma, st.matrix, st.idata, st.rdata, st.work)
    st.jacobians += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _factors_with_plan(functions, st, plan, factors, d, a, h):
    """Factor the matrix of a first step with the pivots at hand; return whether they fit."""
    if not (a.planned_step > 0.0 and a.planned):
        return False
    _evaluate_matrix(functions, st, h)
    st.factorizations += 1
    return factor_at(d.factor)(plan, factors, st.matrix) <= st.growth_limit


@njit(cache=True, nogil=True, error_model="numpy")
def _choose(functions, st, plan, factors, d, room, columns, rows_left, a, h):
    """Factor the matrix of a first step of size ``h``; return 0 or a failure.

    Parameters
    ----------
    functions, st, plan, factors
        As of `gearmbs.dae.integrators.step`'s kernels: the problem's functions, the run, its pivots and their numbers.
    d, a : structures
        The driver of the library and what it holds for runs that start afresh.
    room, columns, rows_left : ndarray
        Scratch of the search for pivots.
    h : float
        Size of the step, s.
    """
    if a.planned_step == h and _factors_with_plan(functions, st, plan, factors, d, a, h):
        return 0
    _evaluate_matrix(functions, st, h)
    a.planned_step = h
    code = choose_for_run(st, d, room, columns, rows_left, plan, factors)
    if code == 0:
        a.planned = True
    return code


@njit(cache=True, nogil=True, error_model="numpy")
def _residual(functions, st):
    """Evaluate the equations where the run stands."""
    functions.residual(st.t, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _correction(st, plan, factors, d):
    """Solve for the Newton correction of the start; return its size in units of the tolerance."""
    solve_at(d.solve)(plan, factors, st.res, st.delta)
    return _largest(st.delta, st.w_error)


@njit(cache=True, nogil=True, error_model="numpy")
def _repair(functions, st, plan, factors, d, room, columns, rows_left, a, h):
    """Move the values onto the constraints over a vanishing step, where they are off; return 0 or a failure.

    Its parameters are those of `_choose`.
    """
    n = st.y.shape[0]
    move = _correction(st, plan, factors, d)
    for _ in range(start.CHECK_ROUNDS):
        if not move > start.REPAIR_FROM:
            break
        if _choose(functions, st, plan, factors, d, room, columns, rows_left, a, start.CHECK_RATIO * h) != 0:
            break
        smaller = _correction(st, plan, factors, d)
        if not smaller < 2.0 * move:
            break
        h, move = start.CHECK_RATIO * h, smaller
    if move <= start.REPAIR_FROM:
        return 0
    gamma = 1.0 / h
    newest = rows_from(st, 0)[0]
    y, rates, first, off = st.y, st.yp.copy(), newest.copy(), np.empty(n)
    for sweep in range(start.REPAIR_SWEEPS + 1):
        last = sweep == start.REPAIR_SWEEPS
        if last:
            copy(y, newest)
        for i in range(n):
            off[i] = gamma * (y[i] - newest[i])
        for i in range(n):
            st.yp[i] = rates[i] + off[i]
        _residual(functions, st)
        if not np.isfinite(_correction(st, plan, factors, d)):
            break
        for i in range(n):
            y[i] -= 0.0 if last and st.differential[i] != 0.0 else st.delta[i]
    copy(rates, st.yp)
    copy(y, newest)
    if st.keep_rows:
        copy(y, st.record_y[0])
    _residual(functions, st)
    for i in range(n):
        off[i] = y[i] - first[i]
    size = _largest(off, st.w_error) if _are_finite(y) else np.inf
    if np.isfinite(size):
        limit = max(start.REPAIR_FROM, start.CHECK_RATIO * size)
        if _correction(st, plan, factors, d) <= limit:
            return 0
    return INCONSISTENT


@njit(cache=True, nogil=True, error_model="numpy")
def _euler_error(functions, st, plan, factors, d, h):
    """Return the error of a step of implicit Euler from the start, in units of the tolerance."""
    n = st.y.shape[0]
    y = np.empty(n)
    for i in range(n):
        y[i] = h * st.yp[i]
    for i in range(n):
        y[i] = st.y[i] + y[i]
    functions.residual(st.t + h, y, st.yp, st.res, st.idata, st.rdata, st.work)
    st.residuals += 1
    if not _are_finite(st.res):
        return np.inf
    solve_at(d.solve)(plan, factors, st.res, st.delta)
    for i in range(n):
        y[i] = abs(st.delta[i]) * st.w_error[i]
    return 0.5 * _largest(y, st.differential)


@njit(cache=True, nogil=True, error_model="numpy")
def _settle_first_step(functions, st, plan, factors, d, room, columns, rows_left, a):
    """Choose the first step and its pivots; return 0 or a failure.

    Its parameters are those of `_choose`.
    """
    least = st.h
    h = 0.0 if a.first_given else min(start.FIRST_TRIED * (st.t_end - st.t), st.h_max)
    for _ in range(start.TRIALS):
        if h <= least:
            break
        error = np.inf
        if _choose(functions, st, plan, factors, d, room, columns, rows_left, a, h) == 0:
            error = _euler_error(functions, st, plan, factors, d, h)
        if error <= start.FIRST_ERROR:
            st.h = h
            return 0
        h *= max(0.5 * np.sqrt(start.FIRST_ERROR / error), least / h) if np.isfinite(error) else 1e-4
    return _choose(functions, st, plan, factors, d, room, columns, rows_left, a, least)


@njit(cache=True, nogil=True, error_model="numpy")
def _stand(functions, st, part, d, room, a, begun):
    """Let a state that is as it was before all steps stand at the present point, with the numbers in ``d.values``."""
    t, row = d.t, d.present
    y, yp = st.y_out[row], st.yp_out[row]
    copy(d.table_before if d.before else d.table, st.idata)
    for c in range(d.cells.shape[0]):
        st.rdata[d.cells[c]] = d.values[c]
    out, work = np.zeros(y.shape[0]), np.zeros(st.work.shape[0])
    if begun == 0:
        # the first point is one with what is set before the start
        copy(a.y0, y)
        copy(a.yp0, yp)
        for _ in range(a.settled.shape[0]):
            functions.residual(t, y, yp, out, st.idata, st.rdata, work)
            for k in range(a.settled.shape[0]):
                y[a.settled[k]] -= out[a.settled[k]]
        out[:] = 0.0
        work[:] = 0.0
    st.t = st.window_t[st.newest] = t
    copy(y, st.y)
    copy(yp, st.yp)
    # momenta follow from velocities, as `gearmbs.dae.model.system.own_start` has it
    p, e = st.idata[T.H_P], st.idata[T.H_EPS]
    functions.residual(t, st.y, st.yp, out, st.idata, st.rdata, work)
    for k in range(e - p):
        st.y[p + k] -= out[e + k]
    functions.residual(t, st.y, st.yp, out, st.idata, st.rdata, work)
    for k in range(e - p):
        st.yp[p + k] -= out[p + k]
    if begun == 0:
        copy(st.y, y)
        copy(st.yp, yp)
        copy(y, a.y0)
        copy(yp, a.yp0)
    copy(st.y, rows_from(st, 0)[0])
    copy(st.yp, st.yp_start)
    st.gamma_large = start.LARGE_GAMMA / (st.t_end - t)
    part.t_start = t
    set_weights(st, st.y, 1.0)
    st.n_records, st.record_t[0] = 1, t
    if st.keep_rows:
        copy(st.y, st.record_y[0])
    st.next_output, st.t_pause = st.outputs.shape[0], np.inf
    d.before, d.changed_at, d.given_at, d.jumped_at, d.last_count = False, -1, -1, -1, 0
    copy(st.idata, d.table)
    copy(st.idata, d.table_before)
    d.look_at, d.repivots, d.watch_steps, d.watch_t, d.watch_progress = 0, 0, 0, t, 0.0
    room.counted[:] = 0
    a.planned_step, a.planned = 0.0, False
    span = st.t_end - t
    natural = start.FIRST_OF_SPAN * span
    speed = _largest(st.yp_start, st.w_error)
    if speed > 0.0:
        natural = min(natural, start.FIRST_MOVE / speed)
    smallest = min(start.SMALLEST_OF_SPAN * span, start.SMALLEST_OF_FIRST * natural)
    st.h_min = a.smallest_step if a.smallest_given else smallest
    st.h = a.first_step if a.first_given else max(min(natural, st.h_max), st.h_min)


@njit(cache=True, nogil=True, error_model="numpy")
def start_afresh(bound, st, part, plan, factors, d, room, columns, rows_left, a, begun):
    """Start at the present point with the numbers in ``d.values``.

    Parameters
    ----------
    bound, st, part, plan, factors
        Of a run, see `gearmbs.dae.integrators.step.advance`; the state but for its tables is as before all steps.
    d : Driver
    room, columns, rows_left
        As of `gearmbs.native.pivots.choose_for_run`.
    a : Afresh
    begun : int
        Whether the simulation has left its start.

    Returns
    -------
    code : int
        0 or a failure.
    """
    functions = unbound(bound)
    _stand(functions, st, part, d, room, a, begun)
    _residual(functions, st)
    if not _are_finite(st.res):
        return NOT_FINITE
    span = st.t_end - st.t
    tried = np.array([min(st.h, start.CHECK_STEP * span), st.h, min(start.FIRST_TRIED * span, st.h_max)])
    code, h = 0, 0.0
    for k in range(2 if a.first_given else 3):
        h = tried[k]
        if _factors_with_plan(functions, st, plan, factors, d, a, h):
            code = 0
        else:
            code = _choose(functions, st, plan, factors, d, room, columns, rows_left, a, h)
        if code == 0:
            break
    if code != 0:
        return code
    st.h = max(st.h, h)
    code = _repair(functions, st, plan, factors, d, room, columns, rows_left, a, h)
    if code == 0:
        code = _settle_first_step(functions, st, plan, factors, d, room, columns, rows_left, a)
    if code == 0 and LEAST_DIGITS * EPS * _largest(st.y, st.w_error) > 1.0:
        return BELOW_ROUNDING
    return code
