"""Lists of the entries of a sparse LU in pivot order: those of the matrix, of L and of U, column by column."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.linalg.pivoting import equilibrate
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64, types, uint32

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
    a_ptr, a_pos, a_src, a_scale, u_ptr, u_pos, u_col, l_pos, l_col, row_from, col_to, row_scale, col_scale, kept
        Fields of a `gearmbs.dae.linalg.lu_plan.LUPlan`.
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


# Entries of a matrix that count: the others, negligible in all matrices so far, stay out of a plan.
#
# Mechanisms that move in a plane, or wheels on axes that hardly tilt, leave many entries of a pattern made for motions
# in space at zero but for rounding. Second derivatives of constraints and loads by modal coordinates are far below the
# stiffness of the modes; the iteration of a corrector, which only needs to converge, may do without them.


NEGLIGIBLE = 1e-13
"""Size up to which an entry of the equilibrated matrix may stay left out of a plan: it is rounding."""
NEGLIGIBLE_IN_NEWTON = (1e-4, 1e-5, 1e-6)
"""The same of a Newton matrix with many small entries: the first with which the corrector converges without them, see
`RATE_ALLOWED`."""
COUPLING_LIMIT = 0.3
"""Size up to which an entry between modes stays left out where the others do up to the first of these. At 1000 1/min
those of a shaft, gyroscopic most of them, reach 1e-3."""
WHEN_PLANNED = 0.01
"""Share of that size from which on an entry counts when a plan is made."""
COUPLING_WHEN_PLANNED = 0.2
"""The same of an entry between modes, which are condensed one by one where none of theirs counts."""
RATE_ALLOWED = 0.02
"""Largest part of an error that one of the first two corrections may leave for lack of these entries: the corrector
expects no less."""
WORTH_LEAVING = 0.8
"""Largest share of entries that count with which the others are left out: fewer would not pay for looking at them."""
FEWEST_ENTRIES = 200
"""Of a matrix from which some are left out: a smaller one is factored as fast as they are looked at."""
LEAVING_PLANS = 12
"""Plans that may leave entries out; a run that needs more of them, and often, is taken to need all entries."""
STEPS_A_PLAN = 1000
"""Steps of a run for each further such plan: making one takes as long as some fifty steps."""

_MASK = boolean[::1]


@njit(types.Tuple((_VEC, _VEC, _VEC))(_IVEC, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def scaled_entries(indptr, indices, vals, scale):
    """Return the scales of rows and columns, and the values with them."""
    n = indptr.shape[0] - 1
    row_scale = np.ones(n)
    col_scale = scale.copy()
    equilibrate(indptr, indices, vals, row_scale, col_scale)
    scaled = np.empty(indices.shape[0])
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            scaled[p] = vals[p] * row_scale[indices[p]] * col_scale[j]
    return row_scale, col_scale, scaled


@njit(types.Tuple((_UVEC, _UVEC))(_VEC, _MASK, float64), cache=True, nogil=True, error_model="numpy")
def part_entries(scaled, counted, small):
    """Mark entries larger than ``small`` as counted; return the indices of those to plan for, and of those left out."""
    total = 0
    for p in range(scaled.shape[0]):
        if not abs(scaled[p]) <= small:
            counted[p] = True
        if counted[p]:
            total += 1
    if total > WORTH_LEAVING * scaled.shape[0]:
        counted[:] = True
        total = scaled.shape[0]
    taken, left = np.empty(total, dtype=np.uint32), np.empty(scaled.shape[0] - total, dtype=np.uint32)
    k = 0
    for p in range(scaled.shape[0]):
        if counted[p]:
            taken[k] = p
            k += 1
        else:
            left[p - k] = p
    return taken, left


@njit(types.Tuple((_IVEC, _IVEC, _VEC))(_IVEC, _IVEC, _VEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def taken_pattern(indptr, indices, scaled, taken):
    """Return the CSC form of the entries ``taken`` of a matrix."""
    part_ptr = np.zeros_like(indptr)
    part, values = np.empty(taken.shape[0], dtype=np.int64), np.empty(taken.shape[0])
    e = 0
    for j in range(indptr.shape[0] - 1):
        while e < taken.shape[0] and taken[e] < indptr[j + 1]:
            part[e], values[e] = indices[taken[e]], scaled[taken[e]]
            e += 1
        part_ptr[j + 1] = e
    return part_ptr, part, values


@njit(_VEC(_IVEC, _IVEC, _UVEC, _VEC, _VEC, float64), cache=True, nogil=True, error_model="numpy")
def limits(indptr, indices, left, row_scale, col_scale, negligible):
    """Return the absolute values up to which the entries ``left`` are negligible in the equilibrated matrix."""
    limits = np.empty(left.shape[0])
    e = 0
    for j in range(indptr.shape[0] - 1):
        while e < left.shape[0] and left[e] < indptr[j + 1]:
            limits[e] = negligible / (row_scale[indices[left[e]]] * col_scale[j])
            e += 1
    return limits
