"""Schedule of a sparse LU: operations that do not wait for each other stand side by side, in few and long loops.

Columns that do not act on each other form a level, and are eliminated in one loop over operations, whatever their
number. The pivots, the operations and, for each number that they change, their order are those of the column by column
form: the factors and solutions are the same to the last bit. Within a level, as within a substitution, operations are
sorted by the earliest time at which what they need is there.

Columns of a dense tail form one level, the last: they act on each other in its block.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types, uint32

# Nodes of a sparse LU: columns in a row whose rows below are the same, so that they are eliminated together.


SMALLEST_NODE = 12
"""Columns that are worth to be taken together; fewer are faster one operation after the other."""
SMALLEST_BESIDE = 6
"""The same where there are larger nodes, so that columns are gone through one by one anyway."""

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


@njit(_IVEC(_IVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def nodes(l_ptr, l_pos):
    """Return the end of each column's node, see `LUPlan`."""
    n = l_ptr.shape[0] - 1
    ends = np.arange(1, n + 1)
    largest, first = 0, 0
    while first < n:
        end = first + 1
        while end < n and _follows(l_ptr, l_pos, end):
            end += 1
        if end - first >= SMALLEST_BESIDE:
            ends[first:end] = end
        largest = max(largest, end - first)
        first = end
    return ends if largest >= SMALLEST_NODE else np.arange(1, n + 1)


@njit(types.boolean(_IVEC), cache=True, nogil=True, error_model="numpy")
def has_nodes(ends):
    """Return whether any columns are taken together."""
    found = False
    for k in range(ends.shape[0]):
        found |= ends[k] > k + 1
    return found


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


@njit(types.void(int64, int64, int64, _IVEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def through_node(first, stop, size, l_ptr, l_vals, w):
    """Eliminate with columns ``first`` to ``stop`` of one node, four at once: w = L^-1 w.

    Parameters
    ----------
    first, stop, size : int
        The columns, and the number of rows from the first on: the node's, then those below it.
    l_ptr, l_vals : ndarray
        Of `LUPlan`, and L column by column, as `LUFactors` begins with it.
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


@njit(_IVEC(_IVEC), cache=True, nogil=True, error_model="numpy")
def sorted_by(keys):
    """Return the order that sorts small keys, equal ones as they stand: a counting sort, which is stable."""
    largest = 0
    for key in keys:
        largest = max(largest, key)
    at = np.zeros(largest + 2, dtype=np.int64)
    for key in keys:
        at[key + 1] += 1
    for key in range(largest + 1):
        at[key + 1] += at[key]
    order = np.empty(keys.shape[0], dtype=np.int64)
    for e in range(keys.shape[0]):
        order[at[keys[e]]] = e
        at[keys[e]] += 1
    return order


@njit(_IVEC(_UVEC, _UVEC, int64), cache=True, nogil=True, error_model="numpy")
def earliest_times(to, by, count):
    """Return the earliest time of each operation on ``count`` numbers, changing ``to`` by means of ``by`` in turn."""
    ready, times = np.zeros(count, dtype=np.int64), np.empty(to.shape[0], dtype=np.int64)
    for e in range(to.shape[0]):
        times[e] = max(ready[to[e]], ready[by[e]])
        ready[to[e]] = times[e] + 1
    return times


@njit(_IVEC(_IVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def _levels(u_ptr, u_pos):
    """Return the level of each column: one behind the highest of those that act on it."""
    level = np.zeros(u_ptr.shape[0] - 1, dtype=np.int64)
    for k in range(level.shape[0]):
        for p in range(u_ptr[k], u_ptr[k + 1]):
            level[k] = max(level[k], level[u_pos[p]] + 1)
    return level


@njit(
    types.Tuple((_UVEC, _IVEC, _UVEC, _UVEC, _UVEC))(
        int64, _IVEC, _UVEC, _IVEC, _UVEC, _IVEC, _UVEC, _IVEC, _IVEC, _IVEC, _IVEC
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _operations(rank, a_ptr, a_pos, u_ptr, u_pos, l_ptr, l_pos, level, l_at, u_at, pivot_at):
    """Return ``a_to``, and for each operation on the factors, column by column, its level and ``op_to, op_l, op_u``.

    Of the numbers f of the factors an operation changes one, f[op_to] -= f[op_l] f[op_u]; before them entry e of the
    matrix is put to f[a_to[e]].

    Columns that are set aside need none: what stands above their pivots is never used.

    Parameters
    ----------
    rank : int
        Proper pivots.
    a_ptr, a_pos, u_ptr, u_pos, l_ptr, l_pos : ndarray
        Fields of a plan.
    level : ndarray of int, shape (n,)
    l_at, u_at, pivot_at : ndarray of int
        Where L, U and the pivots stand among the numbers of the factors; one more takes what is of no use: entries that
        equations and unknowns set aside have in common.
    """
    n = level.shape[0]
    nowhere = l_at.shape[0] + u_at.shape[0] + n
    count = 0
    for p in range(u_ptr[rank]):
        count += l_ptr[u_pos[p] + 1] - l_ptr[u_pos[p]]
    a_to, levels = np.empty(a_pos.shape[0], dtype=np.uint32), np.empty(count, dtype=np.int64)
    op_to, op_l = np.empty(count, dtype=np.uint32), np.empty(count, dtype=np.uint32)
    op_u = np.empty(count, dtype=np.uint32)
    # where each row of the column at work stands among the numbers of the factors: filled, used, and emptied again
    at = np.full(n, nowhere)
    e = 0
    for k in range(n):
        for p in range(u_ptr[k], u_ptr[k + 1]):
            at[u_pos[p]] = u_at[p]
        at[k] = pivot_at[k]
        for q in range(l_ptr[k], l_ptr[k + 1]):
            at[l_pos[q]] = l_at[q]
        for p in range(a_ptr[k], a_ptr[k + 1]):
            a_to[p] = at[a_pos[p]]
        for p in range(u_ptr[k], u_ptr[k + 1] if k < rank else u_ptr[k]):
            j = u_pos[p]
            for q in range(l_ptr[j], l_ptr[j + 1]):
                levels[e], op_to[e], op_l[e], op_u[e] = level[k], at[l_pos[q]], l_at[q], u_at[p]
                e += 1
        for p in range(u_ptr[k], u_ptr[k + 1]):
            at[u_pos[p]] = nowhere
        at[k] = nowhere
        for q in range(l_ptr[k], l_ptr[k + 1]):
            at[l_pos[q]] = nowhere
    return a_to, levels, op_to, op_l, op_u


@njit(_IVEC(_IVEC, int64, int64), cache=True, nogil=True, error_model="numpy")
def bounds_of(levels, size, count):
    """Return where each of ``count`` levels begins and ends in a list of the first ``size`` sorted by them."""
    bounds = np.zeros(count + 1, dtype=np.int64)
    for e in range(size):
        bounds[levels[e] + 1] += 1
    for level in range(count):
        bounds[level + 1] += bounds[level]
    return bounds


@njit(_UVEC(_UVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def taken_in_order(items, order):
    """Return items in an order."""
    out = np.empty(order.shape[0], dtype=np.uint32)
    for e in range(order.shape[0]):
        out[e] = items[order[e]]
    return out


@njit(_IVEC(_IVEC, int64), cache=True, nogil=True, error_model="numpy")
def _numbered(order, first):
    """Return the number of each item if they are numbered from ``first`` on in an order."""
    at = np.empty(order.shape[0], dtype=np.int64)
    for e in range(order.shape[0]):
        at[order[e]] = first + e
    return at


@njit(types.UniTuple(_IVEC, 2)(int64, int64, _IVEC, _UVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def _orders_of_substitution(n, tail, order, u_pos, u_col):
    """Return the order in which U is gone through, the tail's columns first; and pivots by level, those set aside last.

    ``order`` sorts proper pivots by their levels.
    """
    size = u_pos.shape[0]
    times = earliest_times(u_pos[::-1].copy(), u_col[::-1].copy(), n)
    behind = 0
    for e in range(size):
        behind = max(behind, times[e] + 1)
    for e in range(size):
        if u_col[size - 1 - e] < tail:
            times[e] += behind
    u_order = size - 1 - sorted_by(times)
    by_level = np.empty(n, dtype=np.int64)
    for k in range(n):
        by_level[k] = order[k] if k < order.shape[0] else k
    return u_order, by_level


@njit(
    types.Tuple(
        (
            _UVEC,
            _UVEC,
            _UVEC,
            _UVEC,
            _UVEC,
            _IVEC,
            _UVEC,
            _IVEC,
            _UVEC,
            _UVEC,
            _UVEC,
            _IVEC,
            _UVEC,
            _UVEC,
            _IVEC,
            _IVEC,
        )
    )(int64, int64, _IVEC, _UVEC, _IVEC, _UVEC, _UVEC, _IVEC, _UVEC, _UVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def operations_in_order(rank, tail, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col):
    """Return in which order a matrix without nodes is factored, from what is done column by column.

    Parameters
    ----------
    rank : int
        Proper pivots.
    tail, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col
        See `gearmbs.dae.linalg.lu_plan.LUPlan`; without what is in the rows of a tail.

    Returns
    -------
    l_to, l_by, u_to, u_by, a_to, pivot_ptr, pivot_order, op_ptr, op_to, op_l, op_u, div_ptr, div_to, div_by : ndarray
        Fields of a plan.
    step : ndarray of int64, shape (n,)
        Level of each column.
    u_at : ndarray of int64
        Where the entries of U stand among the numbers of the factors.
    """
    n = l_ptr.shape[0] - 1
    below, above = l_pos.shape[0], u_pos.shape[0]
    level = _levels(u_ptr, u_pos)
    pivots, count = min(rank, tail), 0
    for k in range(pivots):
        count = max(count, level[k] + 1)
    if tail < n:
        level[tail:] = count
        count += 1
    l_order = sorted_by(earliest_times(l_pos, l_col, n))
    u_order, by_level = _orders_of_substitution(n, tail, sorted_by(level[:pivots].copy()), u_pos, u_col)
    l_at, u_at = _numbered(l_order, 0), _numbered(u_order, below)
    pivot_at = _numbered(by_level, below + above)
    a_to, levels, op_to, op_l, op_u = _operations(
        rank, a_ptr, a_pos, u_ptr, u_pos, l_ptr, l_pos, level, l_at, u_at, pivot_at
    )
    # op_l needs no time of its own: a column that acts is of a lower level, and its L is divided when that one ends
    order = sorted_by(earliest_times(op_to, op_u, below + above + n))
    order = order[sorted_by(levels[order])]
    l_level = np.empty(below, dtype=np.int64)
    for q in range(below):
        l_level[q] = level[l_col[q]]
    divided = sorted_by(l_level)
    div_to, div_by = np.empty(below, dtype=np.uint32), np.empty(below, dtype=np.uint32)
    for e in range(below):
        div_to[e] = l_at[divided[e]]
        div_by[e] = pivot_at[l_col[divided[e]]]
    return (
        taken_in_order(l_pos, l_order),
        taken_in_order(l_col, l_order),
        taken_in_order(u_pos, u_order),
        taken_in_order(u_col, u_order),
        a_to,
        bounds_of(level, pivots, count),
        by_level.astype(np.uint32),
        bounds_of(levels, levels.shape[0], count),
        taken_in_order(op_to, order),
        taken_in_order(op_l, order),
        taken_in_order(op_u, order),
        bounds_of(l_level, below, count),
        div_to,
        div_by,
        level,
        u_at,
    )
