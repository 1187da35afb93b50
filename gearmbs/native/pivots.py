"""Pivots chosen without Python: the analysis of a sparse matrix, its plan written into room that was made for it.

The pivots are those of `gearmbs.dae.linalg.lu_plan.analyse`, bit for bit, but of mechanisms whose bodies deform: there
Python also leaves out what the corrector does without, and takes the last pivots as a full block. Here all entries are
taken, so that what follows agrees within the tolerance alone.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators import run_state as s
from gearmbs.dae.integrators.driver import DROP_ROUNDS_ALLOWED, DROP_TOLERANCES, SINGULAR_RETRIES
from gearmbs.dae.linalg.entry_lists import FEWEST_ENTRIES, LEAVING_PLANS, NEGLIGIBLE, STEPS_A_PLAN, entry_lists
from gearmbs.dae.linalg.lu_plan import LUPlan, parity, scale_and_choose
from gearmbs.dae.linalg.pivoting import CANCELLED
from gearmbs.dae.linalg.schedule import has_nodes, nodes, operations_in_order
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, LUFactors, factor
from gearmbs.dae.result import Status
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import IndexVector, IntVector, Struct, Vector

scale_and_choose_at = caller(scale_and_choose.declared)
factor_at = caller(factor.declared)

SINGULAR = int(Status.SINGULAR_JACOBIAN)
NOT_FINITE = int(Status.NOT_FINITE)
NO_ROOM = -21
"""The factors of a matrix have more entries than there is room for."""
CHOSEN = 0
"""Pivots have been chosen, and are to be factored with."""
RETRY = 1
"""None have; the run goes on with another step."""

(
    A_PTR, A_POS, A_SRC, A_SCALE, TAIL_AT, TAIL_SRC, TAIL_SCALE, U_PTR, U_POS, L_PTR, L_POS, U_COL, L_COL, BLOCK_COL,
    LANE_PTR, ACT_PTR, ACT_TO, ACT_BY, ACT_U, LAST_PTR, LAST_TO, PART_PTR, PART_AT, PART_COL, ABOVE_PTR, ABOVE_COL,
    ABOVE_AT, L_TO, L_BY, U_TO, U_BY, A_TO, PIVOT_PTR, PIVOT_ORDER, OP_PTR, OP_TO, OP_L, OP_U, DIV_PTR, DIV_TO, DIV_BY,
    NODE_END, ROW_FROM, COL_TO, ROW_SCALE, COL_SCALE, KEPT, LEFT_SRC, LEFT_LIMIT, LIMIT,
) = range(len(LUPlan.array_members))  # fmt: skip
"""Arrays of a plan in their order; each has two words, address and length."""
LU, _, X, W, BLOCKS, ABOVE, LOWER, REST = range(len(LUFactors.array_members))
"""The same of factors."""


class PlanRoom(Struct):
    """Room for the arrays of a plan and of its factors, and the matrix that they are for.

    Attributes
    ----------
    words, factor_words : ndarray of int64
        Address and length of each array of the plan and of its factors, which are written; the plan's own memory.
    head : ndarray of int64, shape (2,)
        Scalars of the plan.
    at, room : ndarray of int64, shape (arrays,)
        Where each array begins in the one of the following that has its type, and how long it may become.
    ints, places, numbers : ndarray
        Memory of the arrays by their type.
    lu, x, w : ndarray
        Memory of factors; the other arrays have their lengths already.
    indptr, indices, scale : ndarray
        As of `gearmbs.dae.linalg.lu_plan.analyse`.
    counted : ndarray of int64
        Entries that have counted in any matrix before.
    """

    words: IntVector
    factor_words: IntVector
    head: IntVector
    at: IntVector
    room: IntVector
    ints: IntVector
    places: IndexVector
    numbers: Vector
    lu: Vector
    x: Vector
    w: Vector
    indptr: IntVector
    indices: IntVector
    scale: Vector
    counted: IntVector


ROOM_TYPE = PlanRoom.numba_type


@njit(cache=True, nogil=True, error_model="numpy")
def _put(room, k, into, items):
    """Write array ``k`` of the plan into the room of its type; return whether there is room."""
    if items.shape[0] > room.room[k]:
        return False
    room.words[2 * k + 1] = items.shape[0]
    for e in range(items.shape[0]):
        into[room.at[k] + e] = items[e]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _put_order(room, rank, n, ends, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col):
    """Write in which order the matrix is factored, as `gearmbs.dae.linalg.schedule` has it; return whether it fits.

    Parameters
    ----------
    room : PlanRoom
    rank, n : int
        Proper pivots, and their number with those set aside.
    ends, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col : ndarray
        ``node_end`` and others of `gearmbs.dae.linalg.lu_plan.LUPlan`.
    """
    none, nothing = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.uint32)
    if has_nodes(ends):
        fits = _put(room, L_TO, room.places, l_pos) and _put(room, L_BY, room.places, l_col)
        fits = fits and _put(room, U_TO, room.places, u_pos) and _put(room, U_BY, room.places, u_col)
        for k in (A_TO, PIVOT_ORDER, OP_TO, OP_L, OP_U, DIV_TO, DIV_BY):
            _put(room, k, room.places, nothing)
        for k in (PIVOT_PTR, OP_PTR, DIV_PTR):
            _put(room, k, room.ints, none)
        return fits
    (
        l_to, l_by, u_to, u_by, a_to, pivot_ptr, pivot_order, op_ptr, op_to, op_l, op_u, div_ptr, div_to, div_by, _, _,
    ) = operations_in_order(rank, n, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col)  # fmt: skip
    fits = _put(room, L_TO, room.places, l_to) and _put(room, L_BY, room.places, l_by)
    fits = (
        fits
        and _put(room, U_TO, room.places, u_to)
        and _put(room, U_BY, room.places, u_by)
        and _put(room, A_TO, room.places, a_to)
    )
    fits = fits and _put(room, PIVOT_PTR, room.ints, pivot_ptr) and _put(room, PIVOT_ORDER, room.places, pivot_order)
    fits = fits and _put(room, OP_PTR, room.ints, op_ptr) and _put(room, OP_TO, room.places, op_to)
    fits = fits and _put(room, OP_L, room.places, op_l) and _put(room, OP_U, room.places, op_u)
    fits = fits and _put(room, DIV_PTR, room.ints, div_ptr) and _put(room, DIV_TO, room.places, div_to)
    return fits and _put(room, DIV_BY, room.places, div_by)


@njit(cache=True, nogil=True, error_model="numpy")
def write_plan(d, room, columns, rows_left, vals, drop, leaves, negligible):
    """Choose pivots for a matrix and write their plan, if it is regular or small pivots may be dropped.

    Parameters
    ----------
    d : Driver
        For the addresses of kernels.
    room : PlanRoom
    columns, rows_left : Lines
        Scratch, see `gearmbs.dae.linalg.pivoting.choose_pivots`.
    vals, drop, negligible
        As of `gearmbs.dae.linalg.lu_plan.analyse`.
    leaves : bool
        Whether entries that have not counted yet may be left out.

    Returns
    -------
    code : int
        Proper pivots, or NO_ROOM.
    """
    n, entries = room.indptr.shape[0] - 1, room.indices.shape[0]
    counted = np.ones(entries, dtype=np.bool_)
    if leaves:
        for p in range(entries):
            counted[p] = room.counted[p] != 0
    while True:
        (
            rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, left, limits,
        ) = scale_and_choose_at(d.scale_and_choose)(
            room.indptr, room.indices, vals, room.scale, max(drop, CANCELLED), counted, negligible, columns, rows_left
        )  # fmt: skip
        if leaves:
            for p in range(entries):
                room.counted[p] = int(counted[p])
        if rank < 0:
            return NO_ROOM
        if rank == n or left.shape[0] == 0:
            break
        # what was left out may be what was missing
        counted[:] = True
        leaves = False
    if rank < n and drop == 0.0:
        return rank
    (
        a_ptr, a_pos, a_src, a_scale, u_by_col, u_pos, u_col, l_pos, l_col, row_from, col_to, by_row, by_col, kept,
    ) = entry_lists(
        rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices
    )  # fmt: skip
    ends = nodes(l_ptr, l_pos)
    size = l_pos.shape[0] + u_pos.shape[0] + n + 1
    if size > room.lu.shape[0]:
        return NO_ROOM
    fits = _put_order(room, rank, n, ends, a_ptr, a_pos, u_by_col, u_pos, u_col, l_ptr, l_pos, l_col)
    fits = fits and _put(room, A_PTR, room.ints, a_ptr) and _put(room, A_POS, room.places, a_pos)
    fits = fits and _put(room, A_SRC, room.places, a_src) and _put(room, A_SCALE, room.numbers, a_scale)
    fits = fits and _put(room, U_PTR, room.ints, u_by_col) and _put(room, U_POS, room.places, u_pos)
    fits = fits and _put(room, U_COL, room.places, u_col) and _put(room, L_PTR, room.ints, l_ptr)
    fits = fits and _put(room, L_POS, room.places, l_pos) and _put(room, L_COL, room.places, l_col)
    fits = fits and _put(room, NODE_END, room.ints, ends)
    if not fits:
        return NO_ROOM
    _put(room, ROW_FROM, room.places, row_from)
    _put(room, COL_TO, room.places, col_to)
    _put(room, ROW_SCALE, room.numbers, by_row)
    _put(room, COL_SCALE, room.numbers, by_col)
    _put(room, KEPT, room.numbers, kept)
    _put(room, LEFT_SRC, room.places, left)
    _put(room, LEFT_LIMIT, room.numbers, limits)
    limit = np.full(entries if left.shape[0] > 0 else 0, np.inf)
    for e in range(left.shape[0]):
        limit[left[e]] = limits[e]
    _put(room, LIMIT, room.numbers, limit)
    # no pivots as a full block
    for k in (TAIL_AT, TAIL_SRC, TAIL_SCALE, BLOCK_COL, LANE_PTR, ACT_PTR, ACT_TO, ACT_BY, ACT_U):
        room.words[2 * k + 1] = 0
    for k in (LAST_PTR, LAST_TO, PART_PTR, PART_AT, PART_COL, ABOVE_PTR, ABOVE_COL, ABOVE_AT):
        room.words[2 * k + 1] = 0
    room.head[0], room.head[1] = n, 0
    room.factor_words[2 * LU + 1], room.factor_words[2 * X + 1] = size, n
    for member in (BLOCKS, ABOVE, REST):
        room.factor_words[2 * member + 1] = 0
    room.factor_words[2 * LOWER + 1] = LANES
    room.lu[:] = 0.0
    room.x[:] = 0.0
    room.w[:] = 0.0
    return rank


@njit(cache=True, nogil=True, error_model="numpy")
def choose_for_run(st, d, room, columns, rows_left):
    """Choose new pivots for the Newton matrix of a run, as `gearmbs.dae.integrators.driver.Run.repivot` does.

    Parameters
    ----------
    st : RunState
        Whose loop has returned REPIVOT.
    d : Driver
    room, columns, rows_left
        As of `write_plan`.

    Returns
    -------
    code : int
        CHOSEN, RETRY or a failure.
    """
    n = st.y.shape[0]
    finite = True
    for p in range(st.matrix.shape[0]):
        finite &= np.isfinite(st.matrix[p])
    if not finite:
        d.repivots += 1
        if st.steps > 0 and st.singular_fails < SINGULAR_RETRIES:
            st.singular_fails += 1
            st.h *= 0.6
            return RETRY
        return NOT_FINITE
    while True:
        d.repivots += 1
        drop = DROP_TOLERANCES[st.drop_level]
        fewest = st.drop_level > 0 or st.matrix.shape[0] < FEWEST_ENTRIES
        leaves = not (d.deforms or fewest or d.repivots > LEAVING_PLANS + st.steps // STEPS_A_PLAN)
        rank = write_plan(d, room, columns, rows_left, st.matrix, drop, leaves, NEGLIGIBLE)
        if rank < 0:
            return rank
        if rank == n or drop > 0.0:
            break
        if st.drop_failed and st.singular_fails < SINGULAR_RETRIES:
            st.singular_fails += 1
            st.h *= 0.6
            st.matrix_wanted = True
            # whatever pivots there are belong to another attempt
            st.growth_limit = -1.0
            return RETRY
        if not (st.steps > 0 and st.drop_rounds < DROP_ROUNDS_ALLOWED):
            return SINGULAR
        st.drop_rounds += 1
        st.drop_level, st.drop_age = 1, 0
    if d.deforms:
        # nothing is left out of it
        st.left_out = False
    rows, cols = np.empty(n, dtype=np.uint32), np.empty(n, dtype=np.uint32)
    for k in range(n):
        rows[k], cols[k] = room.places[room.at[ROW_FROM] + k], room.places[room.at[COL_TO] + k]
    st.gamma_planned = st.gamma
    st.plan_sign = parity(rows) * parity(cols)
    if st.drop_level == 0:
        st.drop_rounds = 0
    return CHOSEN


@njit(cache=True, nogil=True, error_model="numpy")
def factor_anew(st, d, plan, factors):
    """Factor the matrix of a run with pivots that have just been chosen, and allow their factors to grow."""
    growth = factor_at(d.factor)(plan, factors, st.matrix)
    st.factorizations += 1
    st.growth_limit = max(GROWTH_LIMIT, 100.0 * growth)
    return s.RUNNING
