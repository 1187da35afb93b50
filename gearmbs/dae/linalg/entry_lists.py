"""Lists of the entries of a sparse LU in pivot order: those of the matrix, of L and of U, column by column."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, types, uint32

from gearmbs._jit import njit

FIELDS_BY_COLUMNS = (
    "a_ptr", "a_pos", "a_src", "a_scale", "u_ptr", "u_pos", "u_col", "l_pos", "l_col", "row_from", "col_to",
    "row_scale", "col_scale", "kept",
)  # fmt: skip
"""Fields of a plan in the order in which `entry_lists` returns them."""
L_POS = FIELDS_BY_COLUMNS.index("l_pos")

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


@njit(_IVEC(_IVEC), cache=True, nogil=True, error_model="numpy")
def places_of(items):
    """Return the inverse of a permutation."""
    place = np.empty(items.shape[0], dtype=np.int64)
    for k in range(items.shape[0]):
        place[items[k]] = k
    return place


@njit(types.void(_UVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def sort_lines(places, ptr):
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
def entries_in_order(indptr, indices, row_scale, col_scale, cols, row_place):
    """Return the entries of the matrix column by column in pivot order, rows ascending: fields ``a_*`` of a plan."""
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
    sort_lines(a_pos, a_ptr)
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
def upper_by_columns(u_ptr, u_cols, col_place):
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


@njit(_UVEC(_IVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def lower_by_columns(l_ptr, l_rows, row_place):
    """Return the places of the rows below each pivot, ascending: the field ``l_pos`` of a plan."""
    l_pos = np.empty(l_rows.shape[0], dtype=np.uint32)
    for e in range(l_rows.shape[0]):
        l_pos[e] = row_place[l_rows[e]]
    sort_lines(l_pos, l_ptr)
    return l_pos


@njit(_UVEC(_IVEC), cache=True, nogil=True, error_model="numpy")
def columns_of(ptr):
    """Return the column of each entry of a pattern by columns."""
    columns = np.empty(ptr[ptr.shape[0] - 1], dtype=np.uint32)
    for k in range(ptr.shape[0] - 1):
        for p in range(ptr[k], ptr[k + 1]):
            columns[p] = k
    return columns


@njit(
    types.Tuple((_IVEC, _UVEC, _UVEC, _VEC, _IVEC, _UVEC, _UVEC, _UVEC, _UVEC, _UVEC, _UVEC, _VEC, _VEC, _VEC))(
        int64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _VEC, _VEC, _UVEC, _IVEC, _IVEC
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def entry_lists(rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices):
    """Return the fields of a plan that say column by column what is done, and where its pivots come from.

    Parameters
    ----------
    rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols
        Of `gearmbs.dae.linalg.pivoting.choose_pivots`.
    row_scale, col_scale, taken, indptr, indices
        Scales, and the entries that the plan is made for.

    Returns
    -------
    fields : tuple of ndarray
        `FIELDS_BY_COLUMNS`, see `gearmbs.dae.linalg.lu_plan.LUPlan`.
    """
    n = rows.shape[0]
    row_place, col_place = places_of(rows), places_of(cols)
    a_ptr, a_pos, a_src, a_scale = entries_in_order(indptr, indices, row_scale, col_scale, cols, row_place)
    for e in range(a_src.shape[0]):
        a_src[e] = taken[a_src[e]]
    u_by_col, u_pos = upper_by_columns(u_ptr, u_cols, col_place)
    l_pos = lower_by_columns(l_ptr, l_rows, row_place)
    kept = np.zeros(n)
    kept[:rank] = 1.0
    return (
        a_ptr, a_pos, a_src, a_scale, u_by_col, u_pos, columns_of(u_by_col), l_pos, columns_of(l_ptr),
        rows.astype(np.uint32), cols.astype(np.uint32), row_scale[rows], col_scale[cols], kept,
    )  # fmt: skip
