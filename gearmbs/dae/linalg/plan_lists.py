"""All index lists of a plan, made from its pivots by one compiled function, in Python and without it."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.linalg.condensed import COLUMN_AT, COLUMNS, GROUP, ROW_AT, ROWS, SCHUR_AT
from gearmbs.dae.linalg.condensed_lists import filled, groups_of, reduced_pattern
from gearmbs.dae.linalg.entry_lists import entry_lists, places_of
from gearmbs.dae.linalg.front_blocks import (
    blocks_above,
    entries_in_blocks,
    front_blocks,
    operations_on_blocks,
    tail_of_plan,
    without_tail,
)
from gearmbs.dae.linalg.schedule import has_nodes, nodes, operations_in_order
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64, types, uint32

MOSTLY_NODES = 0.5
"""Share of L in nodes from which on a matrix with a tail is factored column by column. Of two shafts with 112
modes each a tenth is, and 67 us by levels compare with 240; of ten blocks of 40 all is, and 73 with 556."""

LISTS = (
    "a_ptr", "a_pos", "a_src", "a_scale", "tail_at", "tail_src", "tail_scale", "u_ptr", "u_pos", "l_ptr", "l_pos",
    "u_col", "l_col", "block_col", "lane_ptr", "act_ptr", "act_to", "act_by", "act_u", "last_ptr", "last_to",
    "part_ptr", "part_at", "part_col", "above_ptr", "above_col", "above_at", "l_to", "l_by", "u_to", "u_by", "a_to",
    "pivot_ptr", "pivot_order", "op_ptr", "op_to", "op_l", "op_u", "div_ptr", "div_to", "div_by", "node_end",
    "row_from", "col_to", "row_scale", "col_scale", "kept", "groups", "mode_at", "row_at", "column_at", "fill_at",
    "fill_src", "rest_src", "rest_scale", "schur_at", "schur_scale",
)  # fmt: skip
"""Fields of a `gearmbs.dae.linalg.lu_plan.LUPlan` in the order in which `lists_of_plan` returns them."""

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]
_OF_POINTERS = {"u_ptr", "a_ptr", "l_ptr", "lane_ptr", "act_ptr", "last_ptr", "part_ptr", "above_ptr", "pivot_ptr",
                "op_ptr", "div_ptr", "node_end", "groups"}  # fmt: skip
_OF_NUMBERS = {"a_scale", "tail_scale", "row_scale", "col_scale", "kept", "rest_scale", "schur_scale"}
_TYPES = [_VEC if name in _OF_NUMBERS else _IVEC if name in _OF_POINTERS else _UVEC for name in LISTS]


@njit(
    types.Tuple((_VEC, _VEC))(_IVEC, _IVEC, _UVEC, _VEC, _VEC, _IVEC, _UVEC, _UVEC, int64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def scales_of_rest(indptr, indices, slots, row_scale, col_scale, groups, rows, columns, rest):
    """Return the scales of the entries that a condensation leaves, and of those of its blocks.

    Parameters
    ----------
    indptr, indices, slots, groups, rows, columns
        Of `gearmbs.dae.linalg.condensed_lists.reduced_pattern`.
    row_scale, col_scale : ndarray, shape (n,)
    rest : int
        Entries of the whole matrix that are left.
    """
    rest_scale, size = np.empty(rest), 0
    for j in range(indptr.shape[0] - 1):
        for p in range(indptr[j], indptr[j + 1]):
            if slots[p] < rest:
                rest_scale[slots[p]] = row_scale[indices[p]] * col_scale[j]
    for group in range(groups.shape[0] // GROUP):
        size += groups[GROUP * group + ROWS] * groups[GROUP * group + COLUMNS]
    schur_scale = np.empty(size)
    for group in range(groups.shape[0] // GROUP):
        one = groups[GROUP * group : GROUP * (group + 1)]
        e = one[SCHUR_AT]
        for j in range(one[COLUMNS]):
            for i in range(one[ROWS]):
                schur_scale[e] = row_scale[rows[one[ROW_AT] + i]] * col_scale[columns[one[COLUMN_AT] + j]]
                e += 1
    return rest_scale, schur_scale


@njit(
    types.Tuple((_UVEC, _IVEC, _IVEC, _IVEC, _UVEC, _UVEC, _UVEC, _UVEC, _UVEC, _UVEC, _VEC, _UVEC, _VEC))(
        _IVEC, _VEC, _VEC, _UVEC, _IVEC, _IVEC, _IVEC
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def lists_of_modes(rows, row_scale, col_scale, taken, indptr, indices, apart):
    """Return the entries of the matrix that a condensation leaves, and the fields of a plan that say how it is done.

    Parameters
    ----------
    rows, row_scale, col_scale, taken, indptr, indices, apart
        As of `lists_of_plan`.

    Returns
    -------
    taken, indptr, indices : ndarray
        As they are given where nothing is condensed; else places among the values that are left, and their pattern.
    groups, mode_at, row_at, column_at, fill_at, fill_src, rest_src, rest_scale, schur_at, schur_scale : ndarray
        See `gearmbs.dae.linalg.lu_plan.LUPlan`.
    """
    none, nothing = np.empty(0, dtype=np.uint32), np.empty(0)
    if apart.shape[0] == 0:
        empty = np.empty(0, dtype=np.int64)
        return taken, indptr, indices, empty, none, none, none, none, none, none, nothing, none, nothing
    groups, mode_at, met, column_at = groups_of(indptr, indices, apart)
    fill_at, fill_src = filled(indptr, indices, apart, groups, met, column_at)
    part_ptr, part, slots, rest_src, schur_at = reduced_pattern(indptr, indices, apart, groups, met, column_at)
    rest_scale, schur_scale = scales_of_rest(
        part_ptr, part, slots, row_scale, col_scale, groups, met, column_at, rest_src.shape[0]
    )
    row_at = places_of(rows)[met].astype(np.uint32)
    fill_src, rest_src = taken[fill_src], taken[rest_src]
    return (
        slots, part_ptr, part, groups, mode_at, row_at, column_at, fill_at, fill_src, rest_src, rest_scale, schur_at,
        schur_scale,
    )  # fmt: skip


@njit(_IVEC(int64, _IVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def nodes_beside(tail, l_ptr, l_pos):
    """Return `gearmbs.dae.linalg.schedule.nodes`, or each column as its own node if too few of L stand in nodes.

    Where there is a tail all columns would act on it one after the other, those outside of nodes, too.
    """
    n, node_end = l_ptr.shape[0] - 1, nodes(l_ptr, l_pos)
    if tail == n:
        return node_end
    in_nodes = 0
    for k in range(n):
        if node_end[k] > k + 1:
            in_nodes += l_ptr[k + 1] - l_ptr[k]
    return node_end if in_nodes >= MOSTLY_NODES * l_pos.shape[0] else np.arange(1, n + 1)


@njit(
    types.Tuple((int64, int64, *_TYPES))(
        boolean, int64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _VEC, _VEC, _UVEC, _IVEC, _IVEC, _IVEC
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def lists_of_plan(
    with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, apart
):
    """Return all fields of a plan that follow from its pivots.

    Parameters
    ----------
    with_tail : bool
        Whether the last pivots may be taken as a full block.
    rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols
        Of `gearmbs.dae.linalg.pivoting.choose_pivots`.
    row_scale, col_scale, taken, indptr, indices
        Scales, and the entries that the plan is made for.
    apart : ndarray of int64
        Modes that are condensed, of `gearmbs.dae.linalg.condensed_lists.modes_apart`.

    Returns
    -------
    tail, u_tail : int
        See `gearmbs.dae.linalg.lu_plan.LUPlan`.
    fields : tuple of ndarray
        `LISTS`.
    """
    n = rows.shape[0]
    no_places, no_numbers, no_bounds = np.empty(0, dtype=np.uint32), np.empty(0), np.empty(0, dtype=np.int64)
    tail_at, tail_src, tail_scale, block_col, lane_ptr = no_places, no_places, no_numbers, no_places, no_bounds
    block_ptr, block_at, block_lane = no_bounds, no_bounds, no_bounds
    act_ptr, act_to, act_by, act_u, last_ptr, last_to = no_bounds, no_places, no_places, no_places, no_bounds, no_places
    part_ptr, part_at, part_col = no_bounds, no_places, no_places
    above_ptr, above_col, above_at = no_bounds, no_places, no_places
    (
        taken, indptr, indices, groups, mode_at, row_at, column_at, fill_at, fill_src, rest_src, rest_scale, schur_at,
        schur_scale,
    ) = lists_of_modes(rows, row_scale, col_scale, taken, indptr, indices, apart)  # fmt: skip
    tail = tail_of_plan(rank, l_ptr, u_ptr) if with_tail else n
    if tail < n:
        l_ptr, l_rows = without_tail(tail, l_ptr, l_rows)
        u_ptr, u_cols = without_tail(tail, u_ptr, u_cols)
    (
        a_ptr, a_pos, a_src, a_scale, u_by_col, u_pos, u_col, l_pos, l_col, row_from, col_to, by_row, by_col, kept,
    ) = entry_lists(
        rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices
    )  # fmt: skip
    if apart.shape[0] > 0:
        # their values are scaled
        a_scale[:] = 1.0
    if tail < n:
        l_ptr, l_pos, l_col, block_col, lane_ptr, block_ptr, block_at, block_lane = front_blocks(tail, l_ptr, l_pos)
        a_ptr, a_pos, a_src, a_scale, tail_at, tail_src, tail_scale = entries_in_blocks(
            tail, block_ptr, block_at, block_lane, a_ptr, a_pos, a_src, a_scale
        )
    node_end = nodes_beside(tail, l_ptr, l_pos)
    if has_nodes(node_end):
        # factors stand as the columns do, each a level of its own
        l_to, l_by, u_to, u_by, a_to = l_pos, l_col, u_pos, u_col, no_places
        pivot_ptr, pivot_order, op_ptr, div_ptr = no_bounds, no_places, no_bounds, no_bounds
        op_to, op_l, op_u, div_to, div_by = no_places, no_places, no_places, no_places, no_places
        step, u_at = np.minimum(np.arange(n), tail), l_pos.shape[0] + np.arange(u_pos.shape[0])
    else:
        (
            l_to, l_by, u_to, u_by, a_to, pivot_ptr, pivot_order, op_ptr, op_to, op_l, op_u, div_ptr, div_to, div_by,
            step, u_at,
        ) = operations_in_order(
            rank, tail, a_ptr, a_pos, u_by_col, u_pos, u_col, l_ptr, l_pos, l_col
        )  # fmt: skip
    u_tail = 0
    if tail < n:
        for p in range(u_col.shape[0]):
            u_tail += u_col[p] >= tail
        act_ptr, act_to, act_by, act_u, last_ptr, last_to, part_ptr, part_at, part_col = operations_on_blocks(
            tail, step, u_by_col, u_pos, u_at, block_ptr, block_at, block_lane
        )
        above_ptr, above_col, above_at = blocks_above(tail, n, u_to, u_by)
    return (
        tail, u_tail, a_ptr, a_pos, a_src, a_scale, tail_at, tail_src, tail_scale, u_by_col, u_pos, l_ptr, l_pos, u_col,
        l_col, block_col, lane_ptr, act_ptr, act_to, act_by, act_u, last_ptr, last_to, part_ptr, part_at, part_col,
        above_ptr, above_col, above_at, l_to, l_by, u_to, u_by, a_to, pivot_ptr, pivot_order, op_ptr, op_to, op_l, op_u,
        div_ptr, div_to, div_by, node_end, row_from, col_to, by_row, by_col, kept, groups, mode_at, row_at, column_at,
        fill_at, fill_src, rest_src, rest_scale, schur_at, schur_scale,
    )  # fmt: skip
