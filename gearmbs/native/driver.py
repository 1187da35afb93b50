"""What drives a run where there is no Python: from one communication point to the next.

`gearmbs.dae.integrators.stepping.held_run` states the same in Python; what compiled code of the integrators does is
called by both. What remains is to heed what the loop of steps returns for, to tell values within the last step, and to
cut that step back where a number of the equations is set.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.algebraic.between import settle_output
from gearmbs.dae.integrators.driver import HOPELESS, HOPELESS_DIGITS, UNSATISFIED
from gearmbs.dae.integrators.messages import WINDOW
from gearmbs.dae.integrators.run_state import copy, rows_from, times_from
from gearmbs.dae.integrators.stepping.held_run import LOOK
from gearmbs.dae.integrators.stepping.memory import value_between
from gearmbs.dae.integrators.stepping.reach import NOT_BEGUN, REACHED, drain, reach
from gearmbs.dae.problem import EPS
from gearmbs.dae.result import Status
from gearmbs.kernels.jit import njit
from gearmbs.kernels.placed import unbound
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import IntVector, Matrix, Struct, Vector

reach_at = caller(reach.declared)
value_between_at = caller(value_between.declared)
settle_output_at = caller(settle_output.declared)

SINGULAR = int(Status.SINGULAR_JACOBIAN)
STALLED = int(Status.STALLED)
BELOW_ROUNDING = int(Status.BELOW_ROUNDING)


class Driver(Struct):
    """Where a run stands, beside the state of its integration, and which numbers of its equations can be set.

    Attributes
    ----------
    last_t, last_rows, last_y, last_yp : ndarray, shapes (MAX_ORDER + 2,), (MAX_ORDER + 2, n), (n,) and (n,)
        The last step as values within it are told: its points, newest first, and its end.
    last_table : ndarray of int
        Table of integers valid within it.
    jump_y, jump_yp : ndarray, shape (n,)
        Values at the time at which numbers have changed last.
    table, table_before : ndarray of int
        Table of integers valid now, and before the last change of coordinates.
    cells, held, values : ndarray, shape (c,)
        Places in ``rdata`` of what can be set, what stood there at the present point, and scratch.
    is_input, loads : ndarray of int64, shape (numbers,)
        Of each number whether it is an input, and whether nothing but loads depends on it.
    first : ndarray of int64, shape (numbers + 1,)
        Where its places begin among the following.
    place, coefficients : ndarray of int64
        Place among the cells, and how many coefficients stand behind a time there, 0 for the number alone.
    per_unit, offset : ndarray
        What stands there for a unit of the number, and for none of it.
    plain : ndarray of int64, shape (places, 3)
        ``place`` and ``coefficients`` once more, and whether it is bent, as
        `gearmbs.dae.integrators.stepping.jumps.steer` takes them.
    waiting, wanted : ndarray of int64 and of float64, shape (numbers,)
        Whether a number has been set that has not taken effect, and to what.
    scratch : ndarray, shape (TERMS + 3, n)
    """

    # addresses of kernels: compiled apart they do the same as where Python calls them, to the last bit
    advance: int
    reach: int
    value_between: int
    settle_output: int
    steer: int
    pass_jump: int
    scale_and_choose: int
    lists_of_plan: int
    factor: int
    solve: int
    converges_without: int
    # where the run stands
    t: float  # the present point
    present: int  # its row among the outputs
    whole: bool  # whether pivots are chosen for all entries
    before: bool  # whether the table before the last change of coordinates is the one valid for it
    changed_at: int  # steps at whose end coordinates have changed, -1 for none
    given_at: int  # steps for which the last step has been written, -1 for none
    jumped_at: int  # steps behind which numbers have changed, -1 for none
    t_jumped: float
    last_count: int
    look_at: int  # steps from which on it is looked at how the run gets on
    watch_steps: int
    watch_t: float
    watch_progress: float
    repivots: int
    last_t: Vector
    last_rows: Matrix
    last_y: Vector
    last_yp: Vector
    last_table: IntVector
    jump_y: Vector
    jump_yp: Vector
    table: IntVector
    table_before: IntVector
    cells: IntVector
    held: Vector
    values: Vector
    is_input: IntVector
    loads: IntVector
    first: IntVector
    place: IntVector
    coefficients: IntVector
    plain: IntVector
    per_unit: Vector
    offset: Vector
    waiting: IntVector
    wanted: Vector
    scratch: Matrix


DRIVER_TYPE = Driver.struct_kind


@njit(cache=True, nogil=True, error_model="numpy")
def write_last_step(st, d):
    """Write the last step to ``d``, unless it stands there: from the window, or from before coordinates changed."""
    if d.given_at == st.steps:
        return
    n = st.y.shape[0]
    d.given_at = st.steps
    if d.jumped_at == st.steps:
        d.last_count, d.last_t[0] = 1, d.t_jumped
        copy(d.jump_y, d.last_rows[0])
        copy(d.jump_y, d.last_y)
        copy(d.jump_yp, d.last_yp)
        copy(d.table, d.last_table)
    elif st.steps == 0:
        d.last_count, d.last_t[0] = 1, st.t
        copy(st.y, d.last_rows[0])
        copy(st.y, d.last_y)
        copy(st.yp, d.last_yp)
        copy(st.idata, d.last_table)
    elif d.changed_at != st.steps:
        d.last_count = st.record_order[st.n_records - 1] + 1
        times, rows = times_from(st, 0), rows_from(st, 0)
        for j in range(d.last_count):
            d.last_t[j] = times[j]
            for i in range(n):
                d.last_rows[j, i] = rows[j, i]
        copy(st.y, d.last_y)
        copy(st.yp, d.last_yp)
        copy(d.table, d.last_table)
    else:
        p = st.n_records - 1
        while st.record_order[p] == 0:
            p -= 1
        d.last_count = st.record_order[p] + 1
        for j in range(d.last_count):
            d.last_t[j] = st.record_t[p - j]
            for i in range(n):
                d.last_rows[j, i] = st.record_y[p - j, i]
        for i in range(n):
            d.last_y[i] = d.last_rows[0, i]
        copy(st.yp, d.last_yp)
        copy(d.table_before, d.last_table)


@njit(cache=True, nogil=True, error_model="numpy")
def write_within(bound, st, part, d, t, row):
    """Write values at a time within the last step, as an output there."""
    write_last_step(st, d)
    y, yp = st.y_out[row], st.yp_out[row]
    rdata = st.rdata.copy() if part.count > 0 else st.rdata
    work = st.work.copy() if part.count > 0 else st.work
    if d.last_count < 2 or t == d.last_t[0]:
        copy(d.last_y, y)
        copy(d.last_yp, yp)
        if part.count > 0 and d.last_count > 1:
            h = d.last_t[0] - d.last_t[1]
            settle_output_at(d.settle_output)(bound, part, t, y, yp, h, t, d.last_y, d.last_table, rdata, work)
    else:
        h = d.last_t[0] - d.last_t[1]
        value_between_at(d.value_between)(
            bound, part, t, d.last_t[1], d.last_rows[1], h, d.last_t, d.last_rows, d.last_count, y, yp, d.last_table,
            rdata, work,
        )  # fmt: skip
    for c in range(st.kept.shape[0]):
        st.kept_out[row, c] = st.rdata[st.kept[c]]


@njit(cache=True, nogil=True, error_model="numpy")
def change_table(st, d):
    """Note that coordinates have changed at the end of the last step."""
    copy(d.table, d.table_before)
    copy(st.idata, d.table)
    d.changed_at = st.steps


@njit(cache=True, nogil=True, error_model="numpy")
def forget_changes(st, d):
    """Take the present table of integers for that of the last step."""
    copy(st.idata, d.table)
    copy(st.idata, d.table_before)
    d.changed_at = -1


@njit(cache=True, nogil=True, error_model="numpy")
def look(st, d):
    """Return 0 for a run that gets on, or the failure of one that never ends."""
    d.look_at = st.steps + LOOK
    if not st.open:
        worst = 0.0
        for i in range(st.y.shape[0]):
            worst = max(worst, EPS * abs(st.y[i]) * st.w_error[i])
        if HOPELESS_DIGITS * worst > 1.0:
            return BELOW_ROUNDING
    done = st.steps - d.watch_steps
    if done >= WINDOW:
        progress = st.t - d.watch_t
        needed = (st.t_end - st.t) * done / progress if progress > 0.0 else np.inf
        stalled = 0.0 < d.watch_progress and progress <= 2.0 * d.watch_progress and needed > HOPELESS
        d.watch_steps, d.watch_t, d.watch_progress = st.steps, st.t, progress
        if stalled:
            return STALLED
    return 0


@njit(cache=True, nogil=True, error_model="numpy")
def is_sound(functions, st, plan):
    """Return whether equations that were set aside at a singular position hold at the end of a run."""
    if st.drop_level == 0:
        return not st.index_changes
    n = st.y.shape[0]
    terms = np.zeros(n)
    functions.residual(st.t, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    for p in range(st.entry_row.shape[0]):
        terms[st.entry_row[p]] += abs(st.matrix[p] * st.y[st.entry_col[p]])
    sound = True
    for k in range(n):
        if plan.kept[k] == 0.0:
            row = plan.row_from[k]
            sound &= abs(st.res[row]) <= UNSATISFIED * terms[row]
    return sound


@njit(cache=True, nogil=True, error_model="numpy")
def go_to(bound, st, part, plan, factors, d, t):
    """Take steps until one ends at ``t`` or later, and let the values there be the present point.

    Parameters
    ----------
    bound, st, part, plan, factors
        Of a run, see `gearmbs.dae.integrators.step.advance`.
    d : Driver
    t : float
        Not before the present point, nor behind the end of the run.

    Returns
    -------
    code : int
        REACHED; REPIVOT where pivots have to be chosen first, after which it is called again; a failure.
    """
    row = 1 - d.present
    while True:
        code = reach_at(d.reach)(bound, st, part, plan, factors, d.advance, t, row, d.look_at)
        if code == REACHED:
            d.before = False
            break
        if code == NOT_BEGUN and t <= st.t:
            write_within(bound, st, part, d, t, row)
            d.before = d.changed_at == st.steps
            break
        code, st.code = st.code, s.RUNNING
        if code < 0 or code == s.REPIVOT:
            return code
        if code == s.DONE and not is_sound(unbound(bound), st, plan):
            return SINGULAR
        if code == s.PAUSED:
            change_table(st, d)
        elif code == s.BUFFER_FULL:
            drain(st)
        code = look(st, d)
        if code < 0:
            return code
        if st.t >= t:
            d.before = d.changed_at == st.steps
            break
    st.outputs[row] = np.inf
    d.t, d.present = t, row
    for c in range(d.cells.shape[0]):
        d.held[c] = st.rdata[d.cells[c]]
    return REACHED
