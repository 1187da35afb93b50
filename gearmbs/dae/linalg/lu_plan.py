"""Plan of a sparse LU: pivots chosen on values, fill found once, and index lists along which matrices are factored.

Entries that have been negligible so far can be left out of the plan; the numeric phase, `gearmbs.dae.linalg.sparse_lu`,
looks at them, and as soon as one counts the caller analyses again.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.compiled.structs import IndexVector, IntVector, Struct, Vector
from gearmbs.dae.linalg.counted_entries import (
    NEGLIGIBLE,
    WHEN_PLANNED,
    limits,
    part_entries,
    scaled_entries,
    taken_pattern,
)
from gearmbs.dae.linalg.dense_tail import tail_entries, tail_of_plan, without_tail
from gearmbs.dae.linalg.entry_lists import FIELDS_BY_COLUMNS, L_POS, entry_lists
from gearmbs.dae.linalg.front_blocks import front_blocks
from gearmbs.dae.linalg.nodes import has_nodes, nodes
from gearmbs.dae.linalg.pivoting import (
    CANCELLED,
    GROWTH_ALLOWED,
    LINES_TYPE,
    THRESHOLDS,
    choose_pivots,
    new_lines,
)
from gearmbs.dae.linalg.schedule import column_by_column, schedule

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]
_MASK = boolean[::1]

NO_TAIL = {
    **dict.fromkeys(("tail_at", "tail_src", "block_at", "block_lane", "block_col"), np.zeros(0, dtype=np.uint32)),
    **dict.fromkeys(("block_ptr", "lane_ptr"), np.zeros(0, dtype=np.int64)),
    "tail_scale": np.zeros(0),
}
"""Fields of a plan without a dense tail."""


class LUPlan(Struct):
    """Frozen pivots and index lists of one pattern, in pivot order.

    Attributes
    ----------
    a_ptr, a_pos, a_src : ndarray
        For each pivot column the entries of the matrix: their place among the rows in pivot order and their
        index in the CSC values.
    a_scale : ndarray
        Scale of each of these entries (row times column scale).
    tail_at, tail_src, tail_scale : ndarray
        The same of the entries inside the tail, which are not among these: their places in its block.
    u_ptr, u_pos : ndarray
        For each column the earlier pivots that act on it, ascending.
    l_ptr, l_pos : ndarray
        For each column the rows below the pivot.
    u_col, l_col : ndarray
        Column of each of these entries.
    block_ptr, block_at, block_lane : ndarray
        For each column the blocks of its entries below in the rows of the tail: where their numbers stand, and which
        eight rows of the tail they are, see `gearmbs.dae.linalg.front_blocks`.
    block_col, lane_ptr : ndarray
        Column of each block in the order in which their numbers stand, and where those of each eight rows begin.
    l_to, l_by, u_to, u_by : ndarray
        Places that the entries of L and U change in a substitution, and by which, in the order in which the entries
        stand among the numbers of the factors: L, then U, which is gone through from its end, then the pivots.
    a_to : ndarray
        Where the entries of the matrix stand among these numbers.
    pivot_ptr, pivot_order : ndarray
        Where the pivots of each level of columns begin and end, see `gearmbs.dae.linalg.schedule`, and which these are,
        in the order in which they stand; those set aside are the last.
    op_ptr, op_to, op_l, op_u : ndarray
        For each level its operations: the number that is changed and the factors of the product that is taken off.
    div_ptr, div_to, div_by : ndarray
        For each level the numbers that become entries of L, and the pivots that they are divided by. All from ``a_to``
        on are empty if there are nodes or a tail.
    node_end : ndarray
        For each column the end of its node: columns in a row whose rows below the node are the same.
    row_from, col_to : ndarray
        Original row and column of each pivot.
    row_scale, col_scale : ndarray
        Scales, in pivot order.
    kept : ndarray
        One for a proper pivot; zero for an equation and an unknown set aside because the matrix is nearly singular.
    left_src, left_limit : ndarray
        Entries left out, by their index in the CSC values, and the largest absolute values with which they may be.
    limit : ndarray
        The same by CSC values, infinite for entries that are planned for; empty if no entry is left out.
    tail : int
        First pivot of the dense tail, see `gearmbs.dae.linalg.dense_tail`; their number if there is none. Entries of L
        in its rows and of U inside it are in none of the lists.
    """

    tail: int
    a_ptr: IntVector
    a_pos: IndexVector
    a_src: IndexVector
    a_scale: Vector
    tail_at: IndexVector
    tail_src: IndexVector
    tail_scale: Vector
    u_ptr: IntVector
    u_pos: IndexVector
    l_ptr: IntVector
    l_pos: IndexVector
    u_col: IndexVector
    l_col: IndexVector
    block_ptr: IntVector
    block_at: IndexVector
    block_lane: IndexVector
    block_col: IndexVector
    lane_ptr: IntVector
    l_to: IndexVector
    l_by: IndexVector
    u_to: IndexVector
    u_by: IndexVector
    a_to: IndexVector
    pivot_ptr: IntVector
    pivot_order: IndexVector
    op_ptr: IntVector
    op_to: IndexVector
    op_l: IndexVector
    op_u: IndexVector
    div_ptr: IntVector
    div_to: IndexVector
    div_by: IndexVector
    node_end: IntVector
    row_from: IndexVector
    col_to: IndexVector
    row_scale: Vector
    col_scale: Vector
    kept: Vector
    left_src: IndexVector
    left_limit: Vector
    limit: Vector


PLAN_TYPE = LUPlan.numba_type


class SingularMatrixError(ValueError):
    """No pivot is left.

    Attributes
    ----------
    rows, cols : ndarray of int
        Equations and unknowns that could not be paired.
    """

    def __init__(self, rows: np.ndarray, cols: np.ndarray):
        super().__init__(f"the matrix is singular: no pivot left for columns {cols.tolist()}, rows {rows.tolist()}")
        self.rows = rows
        self.cols = cols


@njit(
    types.Tuple((int64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _VEC, _VEC, _UVEC, _IVEC, _IVEC, _UVEC, _VEC))(
        _IVEC, _IVEC, _VEC, _VEC, float64, _MASK, float64, LINES_TYPE, LINES_TYPE
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _choose(all_ptr, all_indices, vals, scale, drop, counted, negligible, columns, rows_left):
    """Scale the matrix, leave out what is negligible and choose pivots.

    Parameters
    ----------
    all_ptr, all_indices, vals, scale, drop, counted, negligible
        As the pattern and the others of `analyse`.
    columns, rows_left
        As in `choose_pivots`.

    Returns
    -------
    rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols
        See `choose_pivots`; no rank where a pool was too small.
    row_scale, col_scale, taken
        Scales; entries of the matrix that the plan is made for.
    indptr, indices
        Their pattern.
    left, left_limit
        See `LUPlan`.
    """
    row_scale, col_scale, all_scaled = scaled_entries(all_ptr, all_indices, vals, scale)
    taken, left = part_entries(all_scaled, counted, WHEN_PLANNED * negligible)
    indptr, indices, scaled = taken_pattern(all_ptr, all_indices, all_scaled, taken)
    growth = np.inf
    for threshold in THRESHOLDS:
        if growth > GROWTH_ALLOWED:
            rank, growth, rows, cols, l_ptr, l_rows, u_ptr, u_cols = choose_pivots(
                indptr, indices, scaled, drop, threshold, columns, rows_left
            )
    left_limit = limits(all_ptr, all_indices, left, row_scale, col_scale, negligible)
    return (
        rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, left, left_limit
    )  # fmt: skip


def analyse(
    indptr: np.ndarray,
    indices: np.ndarray,
    vals: np.ndarray,
    scale: np.ndarray,
    drop: float = 0.0,
    counted: np.ndarray | None = None,
    negligible: float = NEGLIGIBLE,
    with_tail: bool = False,
) -> LUPlan:
    """Choose pivots for a matrix and lay down the plan to factor every matrix of its pattern.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        CSC pattern, n columns.
    vals : ndarray
        Values on which pivots are chosen.
    scale : ndarray, shape (n,)
        Typical magnitude of each unknown.
    drop : float
        When positive, unknowns without a pivot larger than this fraction of their entries are set aside, each with an
        equation: they come out of `solve` as zero.
    counted : ndarray of bool, optional
        Entries of the pattern that have counted in any matrix before; those that count in this one are marked. The
        others are left out of the plan, if they are many. Default: no entry is left out.
    negligible : float
        Size of an entry of the equilibrated matrix up to which it may stay left out.
    with_tail : bool
        Whether the last pivots may be taken as a full block, as is worth it with modes; eight matrices side by side
        cannot have one.

    Returns
    -------
    LUPlan

    Raises
    ------
    SingularMatrixError
        If nothing may be dropped and the matrix is singular to working precision, with the rows and columns left over.
    ValueError
        If a value is not finite.
    """
    if not np.isfinite(vals).all():
        raise ValueError("the matrix has entries that are not finite")
    n = len(indptr) - 1
    size = 3 * len(indices) + 4 * n
    counted = np.ones(len(indices), dtype=bool) if counted is None else counted
    while True:
        lines = new_lines(n, size, True), new_lines(n, size, False)
        rank, *chosen = _choose(
            indptr, indices, vals, np.asarray(scale, dtype=float), max(drop, CANCELLED), counted, negligible, *lines
        )
        if rank >= 0:
            break
        size *= 2
    if rank < n and not counted.all():
        return analyse(indptr, indices, vals, scale, drop, with_tail=with_tail)
    if rank < n and drop == 0.0:
        rows, cols = chosen[:2]
        raise SingularMatrixError(rows[rank:], cols[rank:])
    return _plan(with_tail, rank, *chosen)


def _plan(
    with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, left,
    left_limit,
) -> LUPlan:  # fmt: skip
    """Return the plan that follows from what `_choose` returns.

    Parameters
    ----------
    with_tail
        See `analyse`.
    rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, left, left_limit
        See there.
    """
    tail = tail_of_plan(rank, l_ptr, u_ptr) if with_tail else len(rows)
    l_ptr, l_rows = without_tail(tail, l_ptr, l_rows)
    u_ptr, u_cols = without_tail(tail, u_ptr, u_cols)
    lists = entry_lists(rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices)
    f = dict(zip(FIELDS_BY_COLUMNS, lists, strict=True), l_ptr=l_ptr, node_end=nodes(l_ptr, lists[L_POS]))
    if tail < len(rows):
        f |= tail_entries(tail, f["a_ptr"], f["a_pos"], f["a_src"], f["a_scale"])
        f |= front_blocks(tail, l_ptr, f["l_pos"])
        f["node_end"] = nodes(f["l_ptr"], f["l_pos"])
    else:
        f |= NO_TAIL
    if has_nodes(f["node_end"]) or tail < len(rows):
        order = column_by_column(f["u_pos"], f["u_col"], f["l_pos"], f["l_col"])
    else:
        order = schedule(
            rank, f["a_ptr"], f["a_pos"], f["u_ptr"], f["u_pos"], f["u_col"], l_ptr, f["l_pos"], f["l_col"]
        )
    limit = np.full(len(taken) + len(left) if len(left) else 0, np.inf)
    limit[left] = left_limit
    return LUPlan(left_src=left, left_limit=left_limit, limit=limit, tail=tail, **f, **order)
