"""Pivot choice for the sparse LU: equilibration, Markowitz search with threshold pivoting, fill pattern.

The Newton matrix of a constrained mechanism has zeros on its diagonal (multipliers) and entries that scale
with powers of the step size, so pivots are chosen on values, once, and then frozen by `sparse_lu`.

References
----------
.. [1] H. M. Markowitz, "The elimination form of the inverse and its application to linear programming",
       Management Science 3 (1957) 255-269.
.. [2] I. S. Duff, A. M. Erisman, J. K. Reid, "Direct Methods for Sparse Matrices", Oxford (1986), ch. 7, 9, 10.
.. [3] D. Ruiz, "A scaling algorithm to equilibrate both rows and columns norms in matrices", report RAL-TR-2001-034,
       Rutherford Appleton Laboratory (2001).
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.structs import IntVector, Struct, Vector

THRESHOLDS = (0.01, 0.1, 0.5)
"""Fraction of its column's largest entry a pivot must reach; the next is taken where entries grow too much."""

GROWTH_ALLOWED = 1e4
"""Growth of entries during elimination that is put up with: it costs four of sixteen digits."""
ROW_SINGLETON_THRESHOLD = 1e-3
"""Such a fraction in a row with one entry: it changes no other column, so that its multipliers may be larger without
any growth, as long as `GROWTH_LIMIT` of the factorisation is far."""
CANCELLED = 1e-14
"""Part of the largest value a column ever had below which what is left of it is rounding: 45 units of the last
digit."""
SEARCH_LIMIT = 12
EQUILIBRATION_SWEEPS = 8
TINY = 1e-300
"""In place of zero, as the divisor for a matrix without entries; near the smallest normal double."""

_VEC = float64[::1]
_IVEC = int64[::1]


@njit(types.void(_IVEC, _IVEC, _VEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def equilibrate(indptr, indices, vals, row_scale, col_scale):
    """Scale rows and columns together until the largest entry of each is near one, by powers of two.

    Dividing row i and column j at once by the roots of their largest entries [3]_ treats equations and unknowns alike
    and finds the powers of the step size that belong to positions, velocities and multipliers. It looks at largest
    entries only: the smallest of a moving mechanism are rounding noise of what is zero by geometry, of any magnitude,
    and a scaling that heeds them makes a harmless matrix singular to working precision.

    Parameters
    ----------
    indptr, indices, vals : ndarray
        Matrix in CSC form.
    row_scale, col_scale : ndarray, shape (n,)
        ``col_scale`` comes in as the typical magnitude of each unknown; both are written. The scaled matrix is
        ``row_scale[i] * a[i, j] * col_scale[j]``.
    """
    n = row_scale.shape[0]
    row_top = np.zeros(n)
    col_top = np.zeros(n)
    row_scale[:] = 1.0
    for _ in range(EQUILIBRATION_SWEEPS):
        # entries come near one as both scales take the root of the largest one, half of the way each
        row_top[:] = 0.0
        for j in range(n):
            col_top[j] = 0.0
            for p in range(indptr[j], indptr[j + 1]):
                i = indices[p]
                a = abs(vals[p]) * row_scale[i] * col_scale[j]
                col_top[j] = max(col_top[j], a)
                row_top[i] = max(row_top[i], a)
        for i in range(n):
            if row_top[i] > 0.0:
                row_scale[i] /= np.sqrt(row_top[i])
            if col_top[i] > 0.0:
                col_scale[i] /= np.sqrt(col_top[i])
    for i in range(n):
        # powers of two: scaling rounds nothing
        row_scale[i] = 2.0 ** np.round(np.log2(row_scale[i]))
        col_scale[i] = 2.0 ** np.round(np.log2(col_scale[i]))


class Lines(Struct):
    """Rows or columns of the matrix left to eliminate, each a stretch of a pool, and lists of those of equal length.

    Attributes
    ----------
    start, length, room : ndarray of int64
        Place in the pool, entries and places taken of each line; ``room[-1]`` is the first free place of the pool.
    head, after, before : ndarray of int64
        Doubly linked lists of lines with the same number of entries.
    pool : ndarray of int64
        Indices of entries across the line.
    vals : ndarray
        Their values, or one place for lines that carry the pattern alone.
    full : bool
        The pool was too small.
    """

    start: IntVector
    length: IntVector
    room: IntVector
    head: IntVector
    after: IntVector
    before: IntVector
    pool: IntVector
    vals: Vector
    full: bool


LINES_TYPE = Lines.struct_kind


@njit(types.void(int64, int64, _IVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _unlink(item, count, head, after, before):
    """Take ``item`` out of the list of lines with ``count`` entries."""
    a = after[item]
    b = before[item]
    if b >= 0:
        after[b] = a
    else:
        head[count] = a
    if a >= 0:
        before[a] = b


@njit(types.void(int64, int64, _IVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _link(item, count, head, after, before):
    """Put ``item`` at the front of the list of lines with ``count`` entries."""
    a = head[count]
    after[item] = a
    before[item] = -1
    if a >= 0:
        before[a] = item
    head[count] = item


@njit(types.void(LINES_TYPE, _IVEC, _IVEC, _VEC), cache=True, nogil=True, error_model="numpy")
def _fill_columns(columns, indptr, indices, scaled):
    """Fill the columns of a CSC matrix with their values, not yet linked."""
    n = indptr.shape[0] - 1
    for j in range(n):
        columns.start[j] = indptr[j]
        columns.length[j] = indptr[j + 1] - indptr[j]
        columns.room[j] = columns.length[j]
    columns.room[n] = indices.shape[0]
    for p in range(indices.shape[0]):
        columns.pool[p] = indices[p]
        columns.vals[p] = scaled[p]
    columns.head[:] = -1
    columns.full = False


@njit(types.void(LINES_TYPE, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _fill_rows(rows, indptr, indices):
    """Fill the pattern of the rows of a CSC matrix, not yet linked."""
    n = indptr.shape[0] - 1
    start, length = rows.start, rows.length
    length[:] = 0
    for p in range(indices.shape[0]):
        length[indices[p]] += 1
    end = 0
    for i in range(n):
        start[i] = end
        rows.room[i] = length[i]
        end += length[i]
        length[i] = 0
    rows.room[n] = indices.shape[0]
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            rows.pool[start[i] + length[i]] = j
            length[i] += 1
    rows.head[:] = -1
    rows.full = False


@njit(types.boolean(LINES_TYPE, int64, int64), cache=True, nogil=True, error_model="numpy")
def _make_room(lines, line, want):
    """Move ``line`` to the end of the pool with room for ``want`` entries; return whether there is room.

    A full pool is compacted first.
    """
    start, length, room = lines.start, lines.length, lines.room
    pool, vals = lines.pool, lines.vals
    with_values = vals.shape[0] > 1
    n = start.shape[0]
    if room[n] + want > pool.shape[0]:
        old = pool.copy()
        old_vals = vals.copy()
        end = 0
        for m in range(n):
            for p in range(length[m]):
                pool[end + p] = old[start[m] + p]
                if with_values:
                    vals[end + p] = old_vals[start[m] + p]
            start[m] = end
            room[m] = length[m]
            end += length[m]
        room[n] = end
    end = room[n]
    if end + want > pool.shape[0]:
        lines.full = True
        return False
    for p in range(length[line]):
        pool[end + p] = pool[start[line] + p]
        if with_values:
            vals[end + p] = vals[start[line] + p]
    start[line] = end
    room[line] = want
    room[n] = end + want
    return True


@njit(float64(int64, int64, int64, _IVEC, _VEC), cache=True, nogil=True, error_model="numpy")
def _entry(index, first, length, pool, vals):
    """Return the magnitude of the entry at ``index`` in a line."""
    for p in range(first, first + length):
        if pool[p] == index:
            return abs(vals[p])
    return 0.0


@njit(
    types.UniTuple(int64, 2)(LINES_TYPE, LINES_TYPE, _VEC, _VEC, float64, float64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _best_pivot(columns, rows, top, peak, drop, threshold):
    """Return the row and column of the acceptable entry with the lowest Markowitz cost, or (-1, -1).

    ``top`` holds the largest entry of each column, ``peak`` the largest it ever had; the rest as in `choose_pivots`.
    """
    n = top.shape[0]
    cstart, clen, cpool, cvals = columns.start, columns.length, columns.pool, columns.vals
    rstart, rlen, rpool = rows.start, rows.length, rows.pool
    chead, cafter, rhead, rafter = columns.head, columns.after, rows.head, rows.after
    best_row = -1
    best_col = -1
    best_cost = n * n + 1
    best_ratio = 0.0
    looked = 0
    for count in range(1, n + 1):
        # what is left has count entries at least in row and column: no pivot costs less than (count - 1)^2 products
        if best_cost <= (count - 1) * (count - 1):
            break
        j = chead[count]
        while j >= 0:
            # a column that has cancelled is rounding, and gives no pivot
            if top[j] > drop * peak[j]:
                for p in range(cstart[j], cstart[j] + count):
                    # threshold pivoting: no multiplier is larger than 1 / threshold
                    ratio = abs(cvals[p]) / top[j]
                    if ratio < threshold:
                        continue
                    # Markowitz's cost, (r - 1)(c - 1), bounds the entries that fill in; of equal costs the larger pivot
                    cost = (rlen[cpool[p]] - 1) * (count - 1)
                    if cost < best_cost or (cost == best_cost and ratio > best_ratio):
                        best_cost = cost
                        best_ratio = ratio
                        best_row = cpool[p]
                        best_col = j
                looked += 1
                if best_cost <= (count - 1) * (count - 1) or (looked >= SEARCH_LIMIT and best_row >= 0):
                    return best_row, best_col
            j = cafter[j]
        i = rhead[count]
        limit = min(ROW_SINGLETON_THRESHOLD, threshold) if count == 1 else threshold
        while i >= 0:
            for p in range(rstart[i], rstart[i] + count):
                j = rpool[p]
                cost = (clen[j] - 1) * (count - 1)
                if cost > best_cost or top[j] <= drop * peak[j]:
                    continue
                ratio = _entry(i, cstart[j], clen[j], cpool, cvals) / top[j]
                if ratio >= limit and (cost < best_cost or ratio > best_ratio):
                    best_cost = cost
                    best_ratio = ratio
                    best_row = i
                    best_col = j
            looked += 1
            # columns of this length have been looked at: what is left in rows costs count (count - 1) at least
            if best_cost <= count * (count - 1) or (looked >= SEARCH_LIMIT and best_row >= 0):
                return best_row, best_col
            i = rafter[i]
    return best_row, best_col


@njit(
    types.void(LINES_TYPE, LINES_TYPE, int64, int64, _IVEC, _IVEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
    forceinline=True,
)
def _take_out(columns, rows, row, col, below, right, multipliers):
    """Take the pivot's row and column out of the lists, and its column out of the patterns of the rows.

    Parameters
    ----------
    columns, rows : Lines
    row, col : int
        The pivot.
    below, right : ndarray
        Written: rows below the pivot, columns right of it.
    multipliers : ndarray
        Written: entries below the pivot divided by it.
    """
    first = columns.start[col]
    pool, vals, row_pool = columns.pool, columns.vals, rows.pool
    start, length, head, after, before = rows.start, rows.length, rows.head, rows.after, rows.before
    last = first + columns.length[col]
    pivot = 0.0
    for p in range(first, last):
        if pool[p] == row:
            pivot = vals[p]
    e = 0
    for p in range(first, last):
        i = pool[p]
        if i == row:
            continue
        # l_i = a_i / pivot
        below[e] = i
        multipliers[e] = vals[p] / pivot
        e += 1
        _unlink(i, length[i], head, after, before)
        end = start[i] + length[i] - 1
        for q in range(start[i], end + 1):
            if row_pool[q] == col:
                # the order in a line says nothing: the last entry takes the place of one that goes
                row_pool[q] = row_pool[end]
                break
        length[i] -= 1
    _unlink(col, columns.length[col], columns.head, columns.after, columns.before)
    _unlink(row, length[row], head, after, before)
    e = 0
    for q in range(start[row], start[row] + length[row]):
        if row_pool[q] != col:
            right[e] = row_pool[q]
            e += 1
    columns.length[col] = 0
    length[row] = 0


@njit(
    types.boolean(LINES_TYPE, LINES_TYPE, int64, _IVEC, _IVEC, _VEC, _IVEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _eliminate(columns, rows, row, below, right, multipliers, place, top, peak):
    """Subtract multiples of the pivot's column from the columns right of it.

    Parameters
    ----------
    columns, rows : Lines
    row : int
        Row of the pivot.
    below, right : ndarray
        Rows below the pivot, columns right of it.
    multipliers : ndarray
        Entries below the pivot divided by it.
    place : ndarray of int64, shape (n,)
        Scratch, -1 everywhere before and after.
    top, peak : ndarray, shape (n,)
        Largest entry of each column, now and ever; changed.

    Returns
    -------
    done : bool
        False where a pool is too small.
    """
    start, length, room = columns.start, columns.length, columns.room
    head, after, before = columns.head, columns.after, columns.before
    pool, vals = columns.pool, columns.vals
    row_start, row_length, row_room, row_pool = rows.start, rows.length, rows.room, rows.pool
    for j in right:
        _unlink(j, length[j], head, after, before)
        first = start[j]
        last = first + length[j] - 1
        # u is the column's entry in the pivot's row, which belongs to U and leaves what is left
        u = 0.0
        for p in range(first, last + 1):
            if pool[p] == row:
                u = vals[p]
                pool[p] = pool[last]
                vals[p] = vals[last]
                break
        for p in range(first, last):
            # where each row of the column stands, to find in one step what a multiple is taken off
            place[pool[p]] = p
        count = last - first
        for m in range(below.shape[0]):
            p = place[below[m]]
            if p >= 0:
                # a_ij -= l_i u_j; where there is no entry it fills in, below
                vals[p] -= multipliers[m] * u
            else:
                count += 1
        length[j] = last - first
        if count > room[j]:
            # twice the room, so that a column that grows is moved seldom
            if not _make_room(columns, j, 2 * count):
                return False
        for m in range(below.shape[0] if count > length[j] else 0):
            i = below[m]
            if place[i] >= 0:
                continue
            pool[start[j] + length[j]] = i
            vals[start[j] + length[j]] = -multipliers[m] * u
            length[j] += 1
            if row_length[i] + 1 > row_room[i]:
                if not _make_room(rows, i, 2 * (row_length[i] + 1)):
                    return False
            row_pool[row_start[i] + row_length[i]] = j
            row_length[i] += 1
        top[j] = 0.0
        for p in range(start[j], start[j] + length[j]):
            place[pool[p]] = -1
            top[j] = max(top[j], abs(vals[p]))
        peak[j] = max(peak[j], max(top[j], abs(u)))
        _link(j, length[j], head, after, before)
    return True


@njit(types.void(_IVEC, LINES_TYPE), cache=True, nogil=True, error_model="numpy")
def _link_all(items, lines):
    """Put ``items`` at the front of the lists they belong to, one after the other."""
    length, head, after, before = lines.length, lines.head, lines.after, lines.before
    for i in items:
        _link(i, length[i], head, after, before)


@njit(_IVEC(_IVEC, int64, int64), cache=True, nogil=True, error_model="numpy")
def _grown(places, want, n):
    """Return ``places``, made longer if they do not reach to ``want``."""
    if want <= places.shape[0]:
        return places
    return np.concatenate((places, np.empty(places.shape[0] + n, dtype=np.int64)))


@njit(types.void(_IVEC, int64), cache=True, nogil=True, error_model="numpy")
def _append_left_over(lines, rank):
    """Write behind the first ``rank`` pivot rows (or columns) those that are not among them."""
    n = lines.shape[0]
    done = np.zeros(n, dtype=np.bool_)
    for k in range(rank):
        done[lines[k]] = True
    end = rank
    for m in range(n):
        if not done[m]:
            lines[end] = m
            end += 1


@njit(
    types.Tuple((int64, float64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC))(
        _IVEC, _IVEC, _VEC, float64, float64, LINES_TYPE, LINES_TYPE
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def choose_pivots(indptr, indices, scaled, drop, threshold, columns, rows):
    """Eliminate the matrix once with Markowitz's rule and record pivots and fill.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        CSC pattern; entries that happen to be zero stay in the pattern.
    scaled : ndarray
        Values after `equilibrate`.
    drop, threshold : float
        Fraction of its largest value below which a column has cancelled and is left without a pivot; fraction of the
        largest entry left in its column that a pivot must reach.
    columns, rows : Lines
        Scratch, of `lu_plan.new_lines`; ``columns`` with values.

    Returns
    -------
    rank : int
        Number of pivots found, less than n when the matrix is singular; -1 where a pool was too small.
    growth : float
        Largest entry met on the way, beside the largest of the matrix.
    pivot_rows, pivot_cols : ndarray, shape (n,)
        Original row and column of each pivot; in a singular case the places from ``rank`` on hold what was left over.
    l_ptr, l_rows, u_ptr, u_cols : ndarray
        Original rows below each pivot in its column, and original columns right of each pivot in its row.
    """
    n = indptr.shape[0] - 1
    nnz = indices.shape[0]
    _fill_columns(columns, indptr, indices, scaled)
    _fill_rows(rows, indptr, indices)
    top = np.zeros(n)
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            top[j] = max(top[j], abs(scaled[p]))
    peak = top.copy()
    largest = max(np.max(peak), TINY)
    for m in range(n - 1, -1, -1):
        _link(m, columns.length[m], columns.head, columns.after, columns.before)
        _link(m, rows.length[m], rows.head, rows.after, rows.before)
    pivot_rows = np.empty(n, dtype=np.int64)
    pivot_cols = np.empty(n, dtype=np.int64)
    l_ptr = np.zeros(n + 1, dtype=np.int64)
    u_ptr = np.zeros(n + 1, dtype=np.int64)
    l_rows = np.empty(4 * nnz + n, dtype=np.int64)
    u_cols = np.empty(4 * nnz + n, dtype=np.int64)
    place = np.full(n, -1, dtype=np.int64)
    multipliers = np.empty(n)
    rank = 0
    for k in range(n):
        row, col = _best_pivot(columns, rows, top, peak, drop, threshold)
        if row < 0:
            break
        rank += 1
        pivot_rows[k] = row
        pivot_cols[k] = col
        l_ptr[k + 1] = l_ptr[k] + columns.length[col] - 1
        u_ptr[k + 1] = u_ptr[k] + rows.length[row] - 1
        l_rows = _grown(l_rows, l_ptr[k + 1], n)
        u_cols = _grown(u_cols, u_ptr[k + 1], n)
        below = l_rows[l_ptr[k] : l_ptr[k + 1]]
        right = u_cols[u_ptr[k] : u_ptr[k + 1]]
        _take_out(columns, rows, row, col, below, right, multipliers)
        if not _eliminate(columns, rows, row, below, right, multipliers, place, top, peak):
            return -1, 0.0, pivot_rows, pivot_cols, l_ptr, l_rows, u_ptr, u_cols
        _link_all(below, rows)
    l_ptr[rank:] = l_ptr[rank]
    u_ptr[rank:] = u_ptr[rank]
    _append_left_over(pivot_rows, rank)
    _append_left_over(pivot_cols, rank)
    growth = np.max(peak) / largest
    return (
        rank,
        growth,
        pivot_rows,
        pivot_cols,
        l_ptr,
        l_rows[: l_ptr[rank]].copy(),
        u_ptr,
        u_cols[: u_ptr[rank]].copy(),
    )
