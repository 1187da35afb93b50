"""Pivots chosen without Python: the analysis of a sparse matrix, its plan written into room that was made for it.

The pivots, and what is left out of the matrix, are those of `gearmbs.dae.linalg.lu_plan.analyse`, bit for bit.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.integrators.driver import DROP_ROUNDS_ALLOWED, DROP_TOLERANCES, SINGULAR_RETRIES
from gearmbs.dae.linalg.condensed_lists import numbers_of
from gearmbs.dae.linalg.entry_lists import (
    COUPLING_LIMIT,
    COUPLING_WHEN_PLANNED,
    FEWEST_ENTRIES,
    LEAVING_PLANS,
    NEGLIGIBLE,
    NEGLIGIBLE_IN_NEWTON,
    STEPS_A_PLAN,
)
from gearmbs.dae.linalg.left_out import converges_without
from gearmbs.dae.linalg.lu_plan import LUPlan, parity, scale_and_choose
from gearmbs.dae.linalg.pivoting import CANCELLED
from gearmbs.dae.linalg.plan_lists import LISTS, lists_of_plan
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, LUFactors, factor
from gearmbs.dae.result import Status
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import IndexVector, IntVector, Struct, Vector

scale_and_choose_at = caller(scale_and_choose.declared)
lists_of_plan_at = caller(lists_of_plan.declared)
converges_without_at = caller(converges_without.declared)
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
    NODE_END, ROW_FROM, COL_TO, ROW_SCALE, COL_SCALE, KEPT, GROUPS, MODE_AT, ROW_AT, COLUMN_AT, FILL_AT, FILL_SRC,
    REST_SRC, REST_SCALE, SCHUR_AT, SCHUR_SCALE, LEFT_SRC, LEFT_LIMIT, LIMIT,
) = range(len(LUPlan.array_members))  # fmt: skip
"""Arrays of a plan in their order; each has two words, address and length."""
assert LUPlan.array_members.keys() == {*LISTS, "left_src", "left_limit", "limit"}
LU, _, X, _, BLOCKS, ABOVE, LOWER, REST, EVERY, LEFT, REDUCED, MOVING = range(len(LUFactors.array_members))
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
    factor_room : ndarray of int64, shape (arrays of factors,)
        How long each array of the factors may become.
    ints, places, numbers : ndarray
        Memory of the arrays by their type.
    lu, x, w, blocks, above, lower, rest, every, left, reduced, moving : ndarray
        Memory of factors.
    indptr, indices, scale : ndarray
        As of `gearmbs.dae.linalg.lu_plan.analyse`.
    counted : ndarray of int64
        Entries that have counted in any matrix before.
    couplings : ndarray of int64
        As of `gearmbs.dae.linalg.lu_plan.analyse`; empty for none.
    modes : ndarray of int64
        As of `gearmbs.dae.linalg.lu_plan.analyse`.
    signs : ndarray
        Of `gearmbs.dae.linalg.left_out.signs_of_error`.
    with_tail : bool
        Whether the last pivots may be taken as a full block.
    """

    with_tail: bool

    words: IntVector
    factor_words: IntVector
    head: IntVector
    at: IntVector
    room: IntVector
    factor_room: IntVector
    ints: IntVector
    places: IndexVector
    numbers: Vector
    lu: Vector
    x: Vector
    w: Vector
    blocks: Vector
    above: Vector
    lower: Vector
    rest: Vector
    every: Vector
    left: Vector
    reduced: Vector
    moving: Vector
    indptr: IntVector
    indices: IntVector
    scale: Vector
    counted: IntVector
    couplings: IntVector
    modes: IntVector
    signs: Vector


ROOM_TYPE = PlanRoom.struct_kind


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
def _put_lists(
    d, room, with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, by_row, by_col, taken, indptr, indices, apart
):
    """Write all that follows from pivots into the room of a plan; return whether it fits.

    Parameters
    ----------
    d, room
        As of `write_plan`.
    with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, by_row, by_col, taken, indptr, indices, apart
        As of `gearmbs.dae.linalg.plan_lists.lists_of_plan`.
    """
    (
        tail, u_tail, a_ptr, a_pos, a_src, a_scale, tail_at, tail_src, tail_scale, u_by_col, u_pos, l_by_col, l_pos,
        u_col, l_col, block_col, lane_ptr, act_ptr, act_to, act_by, act_u, last_ptr, last_to, part_ptr, part_at,
        part_col, above_ptr, above_col, above_at, l_to, l_by, u_to, u_by, a_to, pivot_ptr, pivot_order, op_ptr, op_to,
        op_l, op_u, div_ptr, div_to, div_by, node_end, row_from, col_to, row_scale, col_scale, kept,
        groups, mode_at, row_at, column_at, fill_at, fill_src, rest_src, rest_scale, schur_at, schur_scale,
    ) = lists_of_plan_at(d.lists_of_plan)(
        with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, by_row, by_col, taken, indptr, indices, apart
    )  # fmt: skip
    n = rows.shape[0]
    padded = (n - tail + LANES - 1) // LANES * LANES
    sizes = np.zeros(room.factor_room.shape[0], dtype=np.int64)
    sizes[LU], sizes[X] = l_pos.shape[0] + u_pos.shape[0] + n + 1, tail + padded
    sizes[BLOCKS], sizes[ABOVE] = LANES * block_col.shape[0] + padded * (n - tail), LANES * above_col.shape[0]
    sizes[LOWER], sizes[REST] = padded * (n - tail) + LANES, padded
    if apart.shape[0] > 0:
        sizes[EVERY], sizes[LEFT] = numbers_of(groups), rest_src.shape[0]
        sizes[MOVING] = fill_src.shape[0] + rest_src.shape[0] + 2
        # the last of the values that are left is the one of the modes' diagonal
        for e in range(a_src.shape[0]):
            sizes[REDUCED] = max(sizes[REDUCED], np.int64(a_src[e]) + 1)
        for e in range(tail_src.shape[0]):
            sizes[REDUCED] = max(sizes[REDUCED], np.int64(tail_src[e]) + 1)
    fits = True
    for k in range(sizes.shape[0]):
        fits &= sizes[k] <= room.factor_room[k]
    fits = fits and _put(room, A_PTR, room.ints, a_ptr) and _put(room, A_POS, room.places, a_pos)
    fits = fits and _put(room, A_SRC, room.places, a_src) and _put(room, A_SCALE, room.numbers, a_scale)
    fits = fits and _put(room, TAIL_AT, room.places, tail_at) and _put(room, TAIL_SRC, room.places, tail_src)
    fits = fits and _put(room, TAIL_SCALE, room.numbers, tail_scale) and _put(room, U_PTR, room.ints, u_by_col)
    fits = fits and _put(room, U_POS, room.places, u_pos) and _put(room, L_PTR, room.ints, l_by_col)
    fits = fits and _put(room, L_POS, room.places, l_pos) and _put(room, U_COL, room.places, u_col)
    fits = fits and _put(room, L_COL, room.places, l_col) and _put(room, BLOCK_COL, room.places, block_col)
    fits = fits and _put(room, LANE_PTR, room.ints, lane_ptr) and _put(room, ACT_PTR, room.ints, act_ptr)
    fits = fits and _put(room, ACT_TO, room.places, act_to) and _put(room, ACT_BY, room.places, act_by)
    fits = fits and _put(room, ACT_U, room.places, act_u) and _put(room, LAST_PTR, room.ints, last_ptr)
    fits = fits and _put(room, LAST_TO, room.places, last_to) and _put(room, PART_PTR, room.ints, part_ptr)
    fits = fits and _put(room, PART_AT, room.places, part_at) and _put(room, PART_COL, room.places, part_col)
    fits = fits and _put(room, ABOVE_PTR, room.ints, above_ptr) and _put(room, ABOVE_COL, room.places, above_col)
    fits = fits and _put(room, ABOVE_AT, room.places, above_at) and _put(room, L_TO, room.places, l_to)
    fits = fits and _put(room, L_BY, room.places, l_by) and _put(room, U_TO, room.places, u_to)
    fits = fits and _put(room, U_BY, room.places, u_by) and _put(room, A_TO, room.places, a_to)
    fits = fits and _put(room, PIVOT_PTR, room.ints, pivot_ptr) and _put(room, PIVOT_ORDER, room.places, pivot_order)
    fits = fits and _put(room, OP_PTR, room.ints, op_ptr) and _put(room, OP_TO, room.places, op_to)
    fits = fits and _put(room, OP_L, room.places, op_l) and _put(room, OP_U, room.places, op_u)
    fits = fits and _put(room, DIV_PTR, room.ints, div_ptr) and _put(room, DIV_TO, room.places, div_to)
    fits = fits and _put(room, DIV_BY, room.places, div_by) and _put(room, NODE_END, room.ints, node_end)
    fits = fits and _put(room, ROW_FROM, room.places, row_from) and _put(room, COL_TO, room.places, col_to)
    fits = fits and _put(room, ROW_SCALE, room.numbers, row_scale) and _put(room, COL_SCALE, room.numbers, col_scale)
    fits = fits and _put(room, KEPT, room.numbers, kept) and _put(room, GROUPS, room.ints, groups)
    fits = fits and _put(room, MODE_AT, room.places, mode_at) and _put(room, ROW_AT, room.places, row_at)
    fits = fits and _put(room, COLUMN_AT, room.places, column_at) and _put(room, FILL_AT, room.places, fill_at)
    fits = fits and _put(room, FILL_SRC, room.places, fill_src) and _put(room, REST_SRC, room.places, rest_src)
    fits = fits and _put(room, REST_SCALE, room.numbers, rest_scale) and _put(room, SCHUR_AT, room.places, schur_at)
    fits = fits and _put(room, SCHUR_SCALE, room.numbers, schur_scale)
    if fits:
        room.head[0], room.head[1] = tail, u_tail
        for k in (LU, X, BLOCKS, ABOVE, LOWER, REST, EVERY, LEFT, REDUCED, MOVING):
            room.factor_words[2 * k + 1] = sizes[k]
        room.lu[:] = 0.0
        room.x[:] = 0.0
        room.w[:] = 0.0
        room.blocks[:] = 0.0
        room.above[:] = 0.0
        room.lower[:] = 0.0
        room.rest[:] = 0.0
        room.every[:] = 0.0
        if sizes[REDUCED] > 0:
            room.reduced[sizes[REDUCED] - 1], room.moving[0] = 1.0, -1.0
    return fits


@njit(cache=True, nogil=True, error_model="numpy")
def write_plan(d, room, columns, rows_left, whole, drop, leaves, keeps, negligible):
    """Choose pivots for a matrix and write their plan, if it is regular or small pivots may be dropped.

    A tail for which there is no room is taken entry by entry.

    Parameters
    ----------
    d : Driver
        For the addresses of kernels.
    room : PlanRoom
    columns, rows_left : Lines
        Scratch, see `gearmbs.dae.linalg.pivoting.choose_pivots`.
    whole : ndarray
        Values of the matrix.
    drop, negligible
        As of `gearmbs.dae.linalg.lu_plan.analyse`.
    leaves, keeps : bool
        Whether entries that have not counted yet may be left out; whether those that count here are to be known from
        then on.

    Returns
    -------
    code : int
        Proper pivots, or NO_ROOM.
    """
    n, entries = room.indptr.shape[0] - 1, room.indices.shape[0]
    counted, spared = np.ones(entries, dtype=np.bool_), np.zeros(entries, dtype=np.bool_)
    if leaves:
        for p in range(entries):
            counted[p] = room.counted[p] != 0
    spares = room.couplings.shape[0] > 0 and negligible >= NEGLIGIBLE_IN_NEWTON[0]
    vals, modes = whole.copy(), room.modes if drop == 0.0 else room.modes[:0]
    while True:
        if spares:
            for p in range(entries):
                spared[p] = room.couplings[p] != 0 and not counted[p]
                vals[p] = 0.0 if spared[p] else whole[p]
        (
            rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, apart,
            left, limits,
        ) = scale_and_choose_at(d.scale_and_choose)(
            room.indptr, room.indices, vals, room.scale, max(drop, CANCELLED), counted, negligible, modes, columns,
            rows_left,
        )  # fmt: skip
        if leaves and keeps:
            for p in range(entries):
                room.counted[p] = int(counted[p])
        if rank < 0:
            return NO_ROOM
        if rank < n and left.shape[0] > 0:
            # what was left out may be what was missing
            counted[:] = True
            leaves, negligible, modes = False, NEGLIGIBLE, modes[:0]
            continue
        limit = np.full(entries if left.shape[0] > 0 else 0, np.inf)
        for e in range(left.shape[0]):
            limit[left[e]] = limits[e]
        more = False
        if spares and left.shape[0] > 0:
            for p in range(entries):
                if spared[p]:
                    limit[p] *= COUPLING_LIMIT / negligible
                    if abs(whole[p]) > COUPLING_WHEN_PLANNED * limit[p]:
                        counted[p] = True
                        more = True
        if not more:
            break
    if leaves and keeps:
        for p in range(entries):
            room.counted[p] = int(counted[p])
    if rank < n and drop == 0.0:
        return rank
    fits, with_tail = False, room.with_tail
    while not fits:
        fits = _put_lists(
            d, room, with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr,
            indices, apart,
        )  # fmt: skip
        if not (fits or with_tail):
            return NO_ROOM
        with_tail = False
    _put(room, LEFT_SRC, room.places, left)
    _put(room, LEFT_LIMIT, room.numbers, limits)
    _put(room, LIMIT, room.numbers, limit)
    return rank


@njit(cache=True, nogil=True, error_model="numpy")
def choose_for_run(st, d, room, columns, rows_left, plan, factors):
    """Choose new pivots for the Newton matrix of a run, as `gearmbs.dae.integrators.driver.Run.repivot` does.

    Parameters
    ----------
    st : RunState
        Whose loop has returned REPIVOT.
    d : Driver
    room, columns, rows_left
        As of `write_plan`.
    plan, factors : LUPlan, LUFactors
        What stands in the room.

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
    stricter = 0
    while True:
        negligible = NEGLIGIBLE
        if st.left_out and stricter < len(NEGLIGIBLE_IN_NEWTON):
            negligible = NEGLIGIBLE_IN_NEWTON[stricter]
        d.repivots += 1
        drop = DROP_TOLERANCES[st.drop_level]
        fewest = d.whole or st.drop_level > 0 or st.matrix.shape[0] < FEWEST_ENTRIES
        leaves = not (fewest or d.repivots > LEAVING_PLANS + st.steps // STEPS_A_PLAN)
        # what counts in one matrix does not in all that follow
        rank = write_plan(d, room, columns, rows_left, st.matrix, drop, leaves, stricter == 0, negligible)
        if rank < 0:
            return rank
        if rank < n and drop == 0.0:
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
            stricter = 0
            continue
        rows, cols = np.empty(n, dtype=np.uint32), np.empty(n, dtype=np.uint32)
        for k in range(n):
            rows[k], cols[k] = room.places[room.at[ROW_FROM] + k], room.places[room.at[COL_TO] + k]
        st.gamma_planned = st.gamma
        st.plan_sign = parity(rows) * parity(cols)
        if st.drop_level == 0:
            st.drop_rounds = 0
        growth = factor_at(d.factor)(plan, factors, st.matrix)
        st.factorizations += 1
        st.growth_limit = max(GROWTH_LIMIT, 100.0 * growth)
        if negligible <= NEGLIGIBLE or converges_without_at(d.converges_without)(
            d.solve, plan, factors, room.indptr, room.indices, st.matrix, room.signs
        ):
            return CHOSEN
        stricter += 1
