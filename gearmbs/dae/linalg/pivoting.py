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
from numba import float64, int64, types

from gearmbs._jit import njit

THRESHOLDS = (0.01, 0.1, 0.5)
"""Fraction of its column's largest entry a pivot must reach; the next is taken where entries grow too much."""

GROWTH_ALLOWED = 1e4
ROW_SINGLETON_THRESHOLD = 1e-3
CANCELLED = 1e-14
SEARCH_LIMIT = 12
EQUILIBRATION_SWEEPS = 8

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
        row_scale[i] = 2.0 ** np.round(np.log2(row_scale[i]))
        col_scale[i] = 2.0 ** np.round(np.log2(col_scale[i]))


@njit(types.void(int64, int64, _IVEC, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _unlink(item, count, head, after, before):
    """Take ``item`` out of the list of items with ``count`` entries."""
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
    """Put ``item`` at the front of the list of items with ``count`` entries."""
    a = head[count]
    after[item] = a
    before[item] = -1
    if a >= 0:
        before[a] = item
    head[count] = item


@njit(
    types.Tuple((_IVEC, _VEC))(_IVEC, _VEC, _IVEC, _IVEC, _IVEC, int64, int64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _make_room(pool, pool_vals, start, length, room, line, want):
    """Move ``line`` to the end of the pool with room for ``want`` entries; compact or grow the pool when full.

    ``room[-1]`` is the first free place of the pool.
    """
    lines = start.shape[0]
    if room[lines] + want > pool.shape[0]:
        live = 0
        for m in range(lines):
            live += length[m]
        size = max(pool.shape[0], 2 * (live + want) + 4 * lines)
        fresh = np.empty(size, dtype=np.int64)
        fresh_vals = np.empty(size if pool_vals.shape[0] > 1 else 1)
        end = 0
        for m in range(lines):
            for p in range(length[m]):
                fresh[end + p] = pool[start[m] + p]
                if pool_vals.shape[0] > 1:
                    fresh_vals[end + p] = pool_vals[start[m] + p]
            start[m] = end
            room[m] = length[m]
            end += length[m]
        room[lines] = end
        pool = fresh
        pool_vals = fresh_vals
    end = room[lines]
    for p in range(length[line]):
        pool[end + p] = pool[start[line] + p]
        if pool_vals.shape[0] > 1:
            pool_vals[end + p] = pool_vals[start[line] + p]
    start[line] = end
    room[line] = want
    room[lines] = end + want
    return pool, pool_vals


@njit(
    types.UniTuple(int64, 2)(
        int64,
        float64,
        float64,
        _IVEC,
        _IVEC,
        _VEC,
        _VEC,
        _IVEC,
        _IVEC,
        _IVEC,
        _IVEC,
        _IVEC,
        _VEC,
        _IVEC,
        _IVEC,
        _IVEC,
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _best_pivot(
    n, drop, threshold, cstart, clen, top, peak, rstart, rlen, chead, cafter, cpool, cvals, rpool, rhead, rafter
):
    """Return the row and column of the acceptable entry with the lowest Markowitz cost, or (-1, -1)."""
    best_row = -1
    best_col = -1
    best_cost = n * n + 1
    best_ratio = 0.0
    looked = 0
    for count in range(1, n + 1):
        if best_cost <= (count - 1) * (count - 1):
            break
        j = chead[count]
        while j >= 0:
            if top[j] > drop * peak[j]:
                for p in range(cstart[j], cstart[j] + count):
                    ratio = abs(cvals[p]) / top[j]
                    if ratio < threshold:
                        continue
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
        while i >= 0:
            for p in range(rstart[i], rstart[i] + count):
                j = rpool[p]
                cost = (clen[j] - 1) * (count - 1)
                if cost > best_cost or top[j] <= drop * peak[j]:
                    continue
                for q in range(cstart[j], cstart[j] + clen[j]):
                    if cpool[q] == i:
                        ratio = abs(cvals[q]) / top[j]
                        limit = min(ROW_SINGLETON_THRESHOLD, threshold) if count == 1 else threshold
                        if ratio >= limit and (cost < best_cost or ratio > best_ratio):
                            best_cost = cost
                            best_ratio = ratio
                            best_row = i
                            best_col = j
                        break
            looked += 1
            if best_cost <= count * (count - 1) or (looked >= SEARCH_LIMIT and best_row >= 0):
                return best_row, best_col
            i = rafter[i]
    return best_row, best_col


@njit(
    types.Tuple((int64, float64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC))(_IVEC, _IVEC, _VEC, float64, float64),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def choose_pivots(indptr, indices, scaled, drop, threshold):
    """Eliminate the matrix once with Markowitz's rule and record pivots and fill.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        CSC pattern; entries that happen to be zero stay in the pattern.
    scaled : ndarray
        Values after `equilibrate`.
    drop : float
        Columns whose entries have all fallen below this fraction of their largest value are left without a pivot.
    threshold : float
        Fraction of the largest entry left in its column that a pivot must reach.

    Returns
    -------
    rank : int
        Number of pivots found, less than n when the matrix is singular.
    growth : float
        Largest entry met on the way, beside the largest of the matrix.
    pivot_rows, pivot_cols : ndarray, shape (n,)
        Original row and column of each pivot; in a singular case the places from ``rank`` on hold what was left over.
    l_ptr, l_rows : ndarray
        Original rows below each pivot in its column.
    u_ptr, u_cols : ndarray
        Original columns right of each pivot in its row.
    """
    n = indptr.shape[0] - 1
    nnz = indices.shape[0]
    # columns carry values, rows only the pattern
    cstart = np.empty(n, dtype=np.int64)
    clen = np.empty(n, dtype=np.int64)
    croom = np.empty(n + 1, dtype=np.int64)
    cpool = np.empty(3 * nnz + 4 * n, dtype=np.int64)
    cvals = np.empty(3 * nnz + 4 * n)
    rstart = np.empty(n, dtype=np.int64)
    rlen = np.zeros(n, dtype=np.int64)
    rroom = np.empty(n + 1, dtype=np.int64)
    rpool = np.empty(3 * nnz + 4 * n, dtype=np.int64)
    none = np.empty(1)
    top = np.zeros(n)
    peak = np.zeros(n)
    for j in range(n):
        cstart[j] = indptr[j]
        clen[j] = indptr[j + 1] - indptr[j]
        croom[j] = clen[j]
        for p in range(indptr[j], indptr[j + 1]):
            cpool[p] = indices[p]
            cvals[p] = scaled[p]
            rlen[indices[p]] += 1
            top[j] = max(top[j], abs(scaled[p]))
        peak[j] = top[j]
    largest = max(np.max(peak), 1e-300)
    croom[n] = nnz
    end = 0
    for i in range(n):
        rstart[i] = end
        rroom[i] = rlen[i]
        end += rlen[i]
        rlen[i] = 0
    rroom[n] = nnz
    for j in range(n):
        for p in range(indptr[j], indptr[j + 1]):
            i = indices[p]
            rpool[rstart[i] + rlen[i]] = j
            rlen[i] += 1
    chead = np.full(n + 1, -1, dtype=np.int64)
    cafter = np.empty(n, dtype=np.int64)
    cbefore = np.empty(n, dtype=np.int64)
    rhead = np.full(n + 1, -1, dtype=np.int64)
    rafter = np.empty(n, dtype=np.int64)
    rbefore = np.empty(n, dtype=np.int64)
    for m in range(n - 1, -1, -1):
        _link(m, clen[m], chead, cafter, cbefore)
        _link(m, rlen[m], rhead, rafter, rbefore)

    pivot_rows = np.empty(n, dtype=np.int64)
    pivot_cols = np.empty(n, dtype=np.int64)
    row_done = np.zeros(n, dtype=np.bool_)
    col_done = np.zeros(n, dtype=np.bool_)
    l_ptr = np.zeros(n + 1, dtype=np.int64)
    u_ptr = np.zeros(n + 1, dtype=np.int64)
    l_rows = np.empty(4 * nnz + n, dtype=np.int64)
    u_cols = np.empty(4 * nnz + n, dtype=np.int64)
    place = np.full(n, -1, dtype=np.int64)
    factor = np.empty(n)
    rank = 0
    for k in range(n):
        pi, pj = _best_pivot(
            n, drop, threshold, cstart, clen, top, peak, rstart, rlen, chead, cafter, cpool, cvals, rpool, rhead, rafter
        )
        if pi < 0:
            break
        rank += 1
        pivot_rows[k] = pi
        pivot_cols[k] = pj
        row_done[pi] = True
        col_done[pj] = True
        nl = clen[pj] - 1
        nu = rlen[pi] - 1
        if l_ptr[k] + nl > l_rows.shape[0]:
            l_rows = np.concatenate((l_rows, np.empty(l_rows.shape[0] + n, dtype=np.int64)))
        if u_ptr[k] + nu > u_cols.shape[0]:
            u_cols = np.concatenate((u_cols, np.empty(u_cols.shape[0] + n, dtype=np.int64)))
        # take the pivot column out of the row patterns, and remember its multipliers
        pivot = 0.0
        for p in range(cstart[pj], cstart[pj] + clen[pj]):
            if cpool[p] == pi:
                pivot = cvals[p]
        e = l_ptr[k]
        for p in range(cstart[pj], cstart[pj] + clen[pj]):
            i = cpool[p]
            if i == pi:
                continue
            l_rows[e] = i
            factor[e - l_ptr[k]] = cvals[p] / pivot
            e += 1
            _unlink(i, rlen[i], rhead, rafter, rbefore)
            for q in range(rstart[i], rstart[i] + rlen[i]):
                if rpool[q] == pj:
                    rpool[q] = rpool[rstart[i] + rlen[i] - 1]
                    break
            rlen[i] -= 1
        l_ptr[k + 1] = e
        _unlink(pj, clen[pj], chead, cafter, cbefore)
        _unlink(pi, rlen[pi], rhead, rafter, rbefore)
        e = u_ptr[k]
        for q in range(rstart[pi], rstart[pi] + rlen[pi]):
            j = rpool[q]
            if j == pj:
                continue
            u_cols[e] = j
            e += 1
        u_ptr[k + 1] = e
        clen[pj] = 0
        rlen[pi] = 0
        for e in range(u_ptr[k], u_ptr[k + 1]):
            j = u_cols[e]
            _unlink(j, clen[j], chead, cafter, cbefore)
            u = 0.0
            for p in range(cstart[j], cstart[j] + clen[j]):
                if cpool[p] == pi:
                    u = cvals[p]
                    last = cstart[j] + clen[j] - 1
                    cpool[p] = cpool[last]
                    cvals[p] = cvals[last]
                    break
            clen[j] -= 1
            for p in range(cstart[j], cstart[j] + clen[j]):
                place[cpool[p]] = p
            fill = 0
            for m in range(nl):
                i = l_rows[l_ptr[k] + m]
                if place[i] >= 0:
                    cvals[place[i]] -= factor[m] * u
                else:
                    fill += 1
            for p in range(cstart[j], cstart[j] + clen[j]):
                place[cpool[p]] = -2 if place[cpool[p]] >= 0 else -1
            if fill > 0:
                if clen[j] + fill > croom[j]:
                    cpool, cvals = _make_room(cpool, cvals, cstart, clen, croom, j, 2 * (clen[j] + fill))
                for m in range(nl):
                    i = l_rows[l_ptr[k] + m]
                    if place[i] == -1:
                        cpool[cstart[j] + clen[j]] = i
                        cvals[cstart[j] + clen[j]] = -factor[m] * u
                        clen[j] += 1
                        if rlen[i] + 1 > rroom[i]:
                            rpool, none = _make_room(rpool, none, rstart, rlen, rroom, i, 2 * (rlen[i] + 1))
                        rpool[rstart[i] + rlen[i]] = j
                        rlen[i] += 1
            top[j] = 0.0
            for p in range(cstart[j], cstart[j] + clen[j]):
                place[cpool[p]] = -1
                top[j] = max(top[j], abs(cvals[p]))
            peak[j] = max(peak[j], max(top[j], abs(u)))
            _link(j, clen[j], chead, cafter, cbefore)
        for m in range(nl):
            i = l_rows[l_ptr[k] + m]
            _link(i, rlen[i], rhead, rafter, rbefore)
    for k in range(rank, n):
        l_ptr[k + 1] = l_ptr[rank]
        u_ptr[k + 1] = u_ptr[rank]
    left_r = rank
    left_c = rank
    for m in range(n):
        if not row_done[m]:
            pivot_rows[left_r] = m
            left_r += 1
        if not col_done[m]:
            pivot_cols[left_c] = m
            left_c += 1
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
