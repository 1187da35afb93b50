"""Sparse LU for a fixed pattern: pivots and fill found once, numeric factorisations replayed without search.

`analyse` chooses pivots on values and lays down a plan. `factor` replays the plan column by column (left-looking),
`solve` applies it. Pivots stay frozen until a multiplier grows beyond `GROWTH_LIMIT` or a pivot vanishes; then the
caller analyses again with the current values.

Mechanisms that move in a plane, or wheels on axes that hardly tilt, leave many entries of a pattern made for motions in
space at zero but for rounding. Entries that have been negligible so far can be left out of the plan; `factor` looks at
them, and as soon as one counts the caller analyses again.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.compiled.structs import IndexVector, IntVector, Struct, Vector
from gearmbs.dae.linalg.pivoting import (
    CANCELLED,
    GROWTH_ALLOWED,
    LINES_TYPE,
    THRESHOLDS,
    choose_pivots,
    equilibrate,
    new_lines,
)

GROWTH_LIMIT = 1e5
SMALLEST_NODE = 4
"""Columns that are worth to be taken together: as many as `_through_node` takes at once."""

ROUNDING = 1e-15
"""Size of an entry of the equilibrated matrix up to which it is rounding when a plan is made."""
NEGLIGIBLE = 1e-13
"""Size up to which it may stay left out of the plan."""
WORTH_LEAVING = 0.8
"""Largest share of entries that count with which the others are left out: fewer would not pay for looking at them."""
FEWEST_ENTRIES = 200
"""Of a matrix from which some are left out: a smaller one is factored as fast as they are looked at."""
LEAVING_PLANS = 12
"""Plans of a run that may leave entries out; after so many it is taken to need them all."""

_VEC = float64[::1]
_MAT = float64[:, ::1]
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
    node_end: IntVector
    row_from: IndexVector
    col_to: IndexVector
    row_scale: Vector
    col_scale: Vector
    kept: Vector
    left_src: IndexVector
    left_limit: Vector


class LUFactors(Struct):
    """Numbers of one factorisation: L below its unit diagonal, U above its diagonal, inverse pivots, scratch."""

    l_vals: Vector
    u_vals: Vector
    pivot_inv: Vector
    x: Vector
    w: Vector


PLAN_TYPE = LUPlan.numba_type
FACTORS_TYPE = LUFactors.numba_type


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


@njit(_IVEC(_IVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def _nodes(l_ptr, l_pos):
    """Return the end of each column's node, see `LUPlan`."""
    n = l_ptr.shape[0] - 1
    ends = np.arange(1, n + 1)
    first = 0
    while first < n:
        end = first + 1
        while end < n and _follows(l_ptr, l_pos, end):
            end += 1
        if end - first >= SMALLEST_NODE:
            ends[first:end] = end
        first = end
    return ends


@njit(types.boolean(_IVEC, _UVEC, int64), cache=True, nogil=True, error_model="numpy")
def _follows(l_ptr, l_pos, k):
    """Return whether the rows below the pivot of column k are those of the column before it, less its own."""
    before, first, end = l_ptr[k - 1], l_ptr[k], l_ptr[k + 1]
    if end - first != first - before - 1 or l_pos[before] != k:
        return False
    for p in range(end - first):
        if l_pos[first + p] != l_pos[before + 1 + p]:
            return False
    return True


@njit(types.Tuple((_VEC, _VEC, _VEC))(_IVEC, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def _scaled(indptr, indices, vals, scale):
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


@njit(types.Tuple((_UVEC, _UVEC))(_VEC, _MASK), cache=True, nogil=True, error_model="numpy")
def _parted(scaled, counted):
    """Mark the entries that count in ``counted``; return the indices of those to plan for, and of those left out."""
    total = 0
    for p in range(scaled.shape[0]):
        if not abs(scaled[p]) <= ROUNDING:
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
def _taken_pattern(indptr, indices, scaled, taken):
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


@njit(_VEC(_IVEC, _IVEC, _UVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def _limits(indptr, indices, left, row_scale, col_scale):
    """Return the absolute values up to which the entries ``left`` are negligible."""
    limits = np.empty(left.shape[0])
    e = 0
    for j in range(indptr.shape[0] - 1):
        while e < left.shape[0] and left[e] < indptr[j + 1]:
            limits[e] = NEGLIGIBLE / (row_scale[indices[left[e]]] * col_scale[j])
            e += 1
    return limits


@njit(
    types.Tuple(
        (
            int64,
            _IVEC,
            _UVEC,
            _UVEC,
            _VEC,
            _IVEC,
            _UVEC,
            _IVEC,
            _UVEC,
            _IVEC,
            _UVEC,
            _UVEC,
            _VEC,
            _VEC,
            _VEC,
            _UVEC,
            _VEC,
        )
    )(_IVEC, _IVEC, _VEC, _VEC, float64, _MASK, LINES_TYPE, LINES_TYPE),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _plan(all_ptr, all_indices, vals, scale, drop, counted, columns, rows_left):
    """Return the rank and the fields of an `LUPlan`, in their order.

    Parameters
    ----------
    all_ptr, all_indices, vals, scale, drop, counted
        As the pattern and the others of `analyse`.
    columns, rows_left
        As in `choose_pivots`.
    """
    n = all_ptr.shape[0] - 1
    row_scale, col_scale, all_scaled = _scaled(all_ptr, all_indices, vals, scale)
    taken, left = _parted(all_scaled, counted)
    indptr, indices, scaled = _taken_pattern(all_ptr, all_indices, all_scaled, taken)
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
        _nodes(l_ptr, l_pos),
        row_from,
        col_to,
        row_scale[rows],
        col_scale[cols],
        kept,
        left,
        _limits(all_ptr, all_indices, left, row_scale, col_scale),
    )


def analyse(
    indptr: np.ndarray,
    indices: np.ndarray,
    vals: np.ndarray,
    scale: np.ndarray,
    drop: float = 0.0,
    counted: np.ndarray | None = None,
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
            indptr, indices, vals, np.asarray(scale, dtype=float), max(drop, CANCELLED), counted, *lines
        )
        size *= 2
    if rank < n and not counted.all():
        return analyse(indptr, indices, vals, scale, drop)
    if rank < len(indptr) - 1 and drop == 0.0:
        rows, cols = (np.asarray(plan[i], dtype=np.int64)[rank:] for i in (9, 10))
        raise SingularMatrixError(rows, cols)
    return LUPlan(**dict(zip(LUPlan.array_members, plan, strict=True)))


def new_factors(plan: LUPlan) -> LUFactors:
    """Return empty factors for a plan."""
    n = len(plan.row_from)
    return LUFactors(
        l_vals=np.zeros(len(plan.l_pos)),
        u_vals=np.zeros(len(plan.u_pos)),
        pivot_inv=np.zeros(n),
        x=np.zeros(n),
        w=np.zeros(n),
    )


@njit(types.void(int64, int64, int64, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def _through_node(first, stop, size, l_ptr, l_vals, w):
    """Eliminate with columns ``first`` to ``stop`` of one node, four at once: w = L^-1 w.

    Parameters
    ----------
    first, stop, size : int
        The columns, and the number of rows from the first on: the node's, then those below it.
    l_ptr, l_vals : ndarray
        Of `LUPlan` and `LUFactors`.
    w : ndarray
        These rows, one after the other; changed.
    """
    at = np.uint64(0)
    rows, columns = np.uint64(size), np.uint64(stop - first)
    while at + np.uint64(4) <= columns:
        j = np.uint64(first) + at
        # where column j has the row after it
        a, b = np.uint64(l_ptr[j]), np.uint64(l_ptr[j + np.uint64(1)])
        c, d = np.uint64(l_ptr[j + np.uint64(2)]), np.uint64(l_ptr[j + np.uint64(3)])
        one, two, three, four = np.uint64(1), np.uint64(2), np.uint64(3), np.uint64(4)
        u = w[at]
        v = w[at + one] - l_vals[a] * u
        x = w[at + two] - l_vals[a + one] * u - l_vals[b] * v
        y = w[at + three] - l_vals[a + two] * u - l_vals[b + one] * v - l_vals[c] * x
        w[at + one], w[at + two], w[at + three] = v, x, y
        a, b, c = a + three, b + two, c + one
        at += four
        for i in range(rows - at):
            w[at + i] -= l_vals[a + i] * u + l_vals[b + i] * v + l_vals[c + i] * x + l_vals[d + i] * y
    while at < columns:
        a = np.uint64(l_ptr[np.uint64(first) + at])
        u = w[at]
        at += np.uint64(1)
        for i in range(rows - at):
            w[at + i] -= l_vals[a + i] * u


@njit(float64(PLAN_TYPE, FACTORS_TYPE, _VEC), cache=True, nogil=True, error_model="numpy")
def factor(plan, factors, vals):
    """Factor the matrix with values ``vals`` along the plan.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        Overwritten.
    vals : ndarray
        Values in CSC order.

    Returns
    -------
    growth : float
        Largest multiplier in L. Above `GROWTH_LIMIT`, infinite or NaN the pivots no longer fit, or an entry that was
        left out counts: analyse again.
    """
    left_src, left_limit = plan.left_src, plan.left_limit
    for p in range(left_src.shape[0]):
        if not abs(vals[left_src[p]]) <= left_limit[p]:
            return np.inf
    x, w = factors.x, factors.w
    l_vals = factors.l_vals
    u_vals = factors.u_vals
    l_pos = plan.l_pos
    l_ptr, node_end = plan.l_ptr, plan.node_end
    u_pos = plan.u_pos
    growth = 0.0
    n = x.shape[0]
    for k in range(n):
        for p in range(np.uint64(plan.a_ptr[k]), np.uint64(plan.a_ptr[k + 1])):
            x[plan.a_pos[p]] = vals[plan.a_src[p]] * plan.a_scale[p]
        p, last = np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])
        while p < last:
            j = np.uint64(u_pos[p])
            end = node_end[j]
            if end - np.int64(j) == 1:
                u = x[j]
                x[j] = 0.0
                u_vals[p] = u
                p += np.uint64(1)
                if u != 0.0:
                    for q in range(np.uint64(l_ptr[j]), np.uint64(l_ptr[j + np.uint64(1)])):
                        x[l_pos[q]] -= l_vals[q] * u
                continue
            # the column has all rows of the node from this one on
            stop, rows = np.uint64(min(end, k)), np.uint64(end) - j
            below = np.uint64(l_ptr[end - 1])
            size = rows + np.uint64(l_ptr[end]) - below
            for i in range(rows):
                w[i] = x[j + i]
                x[j + i] = 0.0
            for i in range(rows, size):
                w[i] = 0.0
            _through_node(np.int64(j), np.int64(stop), np.int64(size), l_ptr, l_vals, w)
            for i in range(stop - j):
                u_vals[p + i] = w[i]
            for i in range(stop - j, rows):
                x[j + i] = w[i]
            for i in range(size - rows):
                x[l_pos[below + i]] += w[rows + i]
            p += stop - j
        pivot = x[k]
        x[k] = 0.0
        if plan.kept[k] == 0.0:
            factors.pivot_inv[k] = 0.0
            x[:] = 0.0
            continue
        if pivot == 0.0:
            return np.inf
        inv = 1.0 / pivot
        factors.pivot_inv[k] = inv
        for q in range(np.uint64(l_ptr[k]), np.uint64(l_ptr[k + 1])):
            i = l_pos[q]
            l = x[i] * inv
            x[i] = 0.0
            l_vals[q] = l
            if not abs(l) <= growth:
                growth = abs(l)
    return growth


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def solve(plan, factors, b, out):
    """Write the solution of A out = b; ``out`` may be ``b`` itself.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        From `factor`.
    b, out : ndarray, shape (n,)
    """
    x, w = factors.x, factors.w
    l_vals = factors.l_vals
    u_vals = factors.u_vals
    l_pos, l_ptr, node_end = plan.l_pos, plan.l_ptr, plan.node_end
    u_pos = plan.u_pos
    n = x.shape[0]
    for k in range(n):
        x[k] = b[plan.row_from[k]] * plan.row_scale[k]
    k = 0
    while k < n:
        end = node_end[k]
        if end - k == 1:
            v = x[k]
            if v != 0.0:
                for q in range(np.uint64(l_ptr[k]), np.uint64(l_ptr[k + 1])):
                    x[l_pos[q]] -= l_vals[q] * v
        else:
            first, rows, below = np.uint64(k), np.uint64(end - k), np.uint64(l_ptr[end - 1])
            size = rows + np.uint64(l_ptr[end]) - below
            for i in range(rows):
                w[i] = x[first + i]
            for i in range(rows, size):
                w[i] = 0.0
            _through_node(k, end, np.int64(size), l_ptr, l_vals, w)
            for i in range(rows):
                x[first + i] = w[i]
            for i in range(size - rows):
                x[l_pos[below + i]] += w[rows + i]
        k = end
    for m in range(n):
        k = n - 1 - m
        v = x[k] * factors.pivot_inv[k]
        out[plan.col_to[k]] = v * plan.col_scale[k]
        x[k] = 0.0
        if v != 0.0:
            for p in range(np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])):
                x[u_pos[p]] -= u_vals[p] * v


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _MAT), cache=True, nogil=True, error_model="numpy")
def solve_pair(plan, factors, pair):
    """Solve for two right-hand sides at once.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        From `factor`.
    pair : ndarray, shape (4, n)
        Right-hand sides in the first two rows, overwritten by the solutions; the others are scratch.
    """
    l_vals, u_vals = factors.l_vals, factors.u_vals
    l_pos, u_pos = plan.l_pos, plan.u_pos
    n = factors.x.shape[0]
    for k in range(n):
        row, size = plan.row_from[k], plan.row_scale[k]
        pair[2, k] = pair[0, row] * size
        pair[3, k] = pair[1, row] * size
    for k in range(n):
        v, w = pair[2, k], pair[3, k]
        for q in range(np.uint64(plan.l_ptr[k]), np.uint64(plan.l_ptr[k + 1])):
            pair[2, l_pos[q]] -= l_vals[q] * v
            pair[3, l_pos[q]] -= l_vals[q] * w
    for m in range(n):
        k = n - 1 - m
        inv, size, to = factors.pivot_inv[k], plan.col_scale[k], plan.col_to[k]
        v, w = pair[2, k] * inv, pair[3, k] * inv
        pair[0, to] = v * size
        pair[1, to] = w * size
        for p in range(np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])):
            pair[2, u_pos[p]] -= u_vals[p] * v
            pair[3, u_pos[p]] -= u_vals[p] * w
