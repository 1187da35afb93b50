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
from gearmbs.dae.linalg.nodes import has_nodes, nodes
from gearmbs.dae.linalg.pivoting import (
    CANCELLED,
    GROWTH_ALLOWED,
    LINES_TYPE,
    THRESHOLDS,
    choose_pivots,
    new_lines,
)

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]
_MASK = boolean[::1]


class LUPlan(Struct):
    """Frozen pivots and index lists of one pattern, in pivot order.

    Attributes
    ----------
    a_ptr, a_pos, a_src : ndarray
        For each pivot column the entries of the matrix: their place among the rows in pivot order and their
        index in the CSC values.
    a_scale : ndarray
        Scale of each of these entries (row times column scale).
    u_ptr, u_pos : ndarray
        For each column the earlier pivots that act on it, ascending.
    l_ptr, l_pos : ndarray
        For each column the rows below the pivot.
    u_col, l_col : ndarray
        Column of each of these entries.
    op_ptr, op_l : ndarray
        For each column the entries of L by which the earlier pivots act on it, one after the other; empty if there are
        nodes.
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
    """

    a_ptr: IntVector
    a_pos: IndexVector
    a_src: IndexVector
    a_scale: Vector
    u_ptr: IntVector
    u_pos: IndexVector
    l_ptr: IntVector
    l_pos: IndexVector
    u_col: IndexVector
    l_col: IndexVector
    op_ptr: IntVector
    op_l: IndexVector
    node_end: IntVector
    row_from: IndexVector
    col_to: IndexVector
    row_scale: Vector
    col_scale: Vector
    kept: Vector
    left_src: IndexVector
    left_limit: Vector


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


@njit(types.void(_UVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _sort_lines(places, ptr):
    """Sort each of the short lists ``places[ptr[k] : ptr[k + 1]]``."""
    for k in range(ptr.shape[0] - 1):
        for p in range(ptr[k] + 1, ptr[k + 1]):
            value = places[p]
            q = p - 1
            while q >= ptr[k] and places[q] > value:
                places[q + 1] = places[q]
                q -= 1
            places[q + 1] = value


@njit(
    types.Tuple((_IVEC, _UVEC, _UVEC, _VEC))(_IVEC, _IVEC, _VEC, _VEC, _IVEC, _IVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _entries_in_order(indptr, indices, row_scale, col_scale, cols, row_place):
    """Return the entries of the matrix column by column in pivot order, rows ascending: fields ``a_*`` of `LUPlan`."""
    n = indptr.shape[0] - 1
    nnz = indices.shape[0]
    a_ptr = np.zeros(n + 1, dtype=np.int64)
    a_pos = np.empty(nnz, dtype=np.uint32)
    a_src = np.empty(nnz, dtype=np.uint32)
    a_scale = np.empty(nnz)
    at = np.empty(n, dtype=np.int64)
    for k in range(n):
        j = cols[k]
        end = a_ptr[k]
        for p in range(indptr[j], indptr[j + 1]):
            a_pos[end] = row_place[indices[p]]
            end += 1
        a_ptr[k + 1] = end
    _sort_lines(a_pos, a_ptr)
    for k in range(n):
        j = cols[k]
        for p in range(indptr[j], indptr[j + 1]):
            at[row_place[indices[p]]] = p
        for e in range(a_ptr[k], a_ptr[k + 1]):
            p = at[a_pos[e]]
            a_src[e] = p
            a_scale[e] = row_scale[indices[p]] * col_scale[j]
    return a_ptr, a_pos, a_src, a_scale


@njit(types.Tuple((_IVEC, _UVEC))(_IVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _upper_by_columns(u_ptr, u_cols, col_place):
    """Return U's pattern by columns: it comes out pivot by pivot, so that each column's pivots ascend."""
    n = u_ptr.shape[0] - 1
    by_col = np.zeros(n + 1, dtype=np.int64)
    for e in range(u_cols.shape[0]):
        by_col[col_place[u_cols[e]] + 1] += 1
    at = np.empty(n, dtype=np.int64)
    for k in range(n):
        by_col[k + 1] += by_col[k]
        at[k] = by_col[k]
    places = np.empty(u_cols.shape[0], dtype=np.uint32)
    for k in range(n):
        for e in range(u_ptr[k], u_ptr[k + 1]):
            m = col_place[u_cols[e]]
            places[at[m]] = k
            at[m] += 1
    return by_col, places


@njit(_UVEC(_IVEC), cache=True, nogil=True, error_model="numpy")
def _columns_of(ptr):
    """Return the column of each entry of a pattern by columns."""
    columns = np.empty(ptr[ptr.shape[0] - 1], dtype=np.uint32)
    for k in range(ptr.shape[0] - 1):
        for p in range(ptr[k], ptr[k + 1]):
            columns[p] = k
    return columns


@njit(types.Tuple((_IVEC, _UVEC))(_IVEC, _UVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _operations(u_ptr, u_pos, l_ptr, node_end):
    """Return the fields ``op_*`` of `LUPlan`."""
    n = u_ptr.shape[0] - 1
    op_ptr = np.zeros(n + 1, dtype=np.int64)
    if has_nodes(node_end):
        return op_ptr, np.empty(0, dtype=np.uint32)
    for k in range(n):
        op_ptr[k + 1] = op_ptr[k]
        for p in range(u_ptr[k], u_ptr[k + 1]):
            op_ptr[k + 1] += l_ptr[u_pos[p] + 1] - l_ptr[u_pos[p]]
    op_l = np.empty(op_ptr[n], dtype=np.uint32)
    e = 0
    for p in range(u_pos.shape[0]):
        for q in range(l_ptr[u_pos[p]], l_ptr[u_pos[p] + 1]):
            op_l[e] = q
            e += 1
    return op_ptr, op_l


@njit(
    types.Tuple(
        (int64, _IVEC, _UVEC, _UVEC, _VEC, _IVEC, _UVEC, _IVEC, _UVEC, _UVEC, _UVEC, _IVEC, _UVEC, _IVEC, _UVEC, _UVEC)
        + (_VEC, _VEC, _VEC, _UVEC, _VEC)
    )(_IVEC, _IVEC, _VEC, _VEC, float64, _MASK, float64, LINES_TYPE, LINES_TYPE),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _plan(all_ptr, all_indices, vals, scale, drop, counted, negligible, columns, rows_left):
    """Return the rank and the fields of an `LUPlan`, in their order.

    Parameters
    ----------
    all_ptr, all_indices, vals, scale, drop, counted, negligible
        As the pattern and the others of `analyse`.
    columns, rows_left
        As in `choose_pivots`.
    """
    n = all_ptr.shape[0] - 1
    row_scale, col_scale, all_scaled = scaled_entries(all_ptr, all_indices, vals, scale)
    taken, left = part_entries(all_scaled, counted, WHEN_PLANNED * negligible)
    indptr, indices, scaled = taken_pattern(all_ptr, all_indices, all_scaled, taken)
    growth = np.inf
    for threshold in THRESHOLDS:
        if growth > GROWTH_ALLOWED:
            rank, growth, rows, cols, l_ptr, l_rows, u_ptr, u_cols = choose_pivots(
                indptr, indices, scaled, drop, threshold, columns, rows_left
            )
    if rank < 0:
        rows = np.arange(n)
        cols = rows
        l_ptr[:] = 0
        u_ptr[:] = 0
        l_rows = rows[:0]
        u_cols = l_rows
    row_place = np.empty(n, dtype=np.int64)
    col_place = np.empty(n, dtype=np.int64)
    row_from = np.empty(n, dtype=np.uint32)
    col_to = np.empty(n, dtype=np.uint32)
    kept = np.zeros(n)
    for k in range(n):
        row_place[rows[k]] = k
        col_place[cols[k]] = k
        row_from[k] = rows[k]
        col_to[k] = cols[k]
        if k < rank:
            kept[k] = 1.0
    a_ptr, a_pos, a_src, a_scale = _entries_in_order(indptr, indices, row_scale, col_scale, cols, row_place)
    for e in range(a_src.shape[0]):
        a_src[e] = taken[a_src[e]]
    u_by_col, u_pos = _upper_by_columns(u_ptr, u_cols, col_place)
    l_pos = np.empty(l_rows.shape[0], dtype=np.uint32)
    for e in range(l_rows.shape[0]):
        l_pos[e] = row_place[l_rows[e]]
    _sort_lines(l_pos, l_ptr)
    node_end = nodes(l_ptr, l_pos)
    op_ptr, op_l = _operations(u_by_col, u_pos, l_ptr, node_end)
    return (
        rank,
        a_ptr,
        a_pos,
        a_src,
        a_scale,
        u_by_col,
        u_pos,
        l_ptr,
        l_pos,
        _columns_of(u_by_col),
        _columns_of(l_ptr),
        op_ptr,
        op_l,
        node_end,
        row_from,
        col_to,
        row_scale[rows],
        col_scale[cols],
        kept,
        left,
        limits(all_ptr, all_indices, left, row_scale, col_scale, negligible),
    )


def analyse(
    indptr: np.ndarray,
    indices: np.ndarray,
    vals: np.ndarray,
    scale: np.ndarray,
    drop: float = 0.0,
    counted: np.ndarray | None = None,
    negligible: float = NEGLIGIBLE,
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
    rank = -1
    counted = np.ones(len(indices), dtype=bool) if counted is None else counted
    while rank < 0:
        lines = new_lines(n, size, True), new_lines(n, size, False)
        rank, *plan = _plan(
            indptr, indices, vals, np.asarray(scale, dtype=float), max(drop, CANCELLED), counted, negligible, *lines
        )
        size *= 2
    if rank < n and not counted.all():
        return analyse(indptr, indices, vals, scale, drop)
    if rank < len(indptr) - 1 and drop == 0.0:
        rows, cols = (np.asarray(plan[i], dtype=np.int64)[rank:] for i in (13, 14))
        raise SingularMatrixError(rows, cols)
    return LUPlan(**dict(zip(LUPlan.array_members, plan, strict=True)))
