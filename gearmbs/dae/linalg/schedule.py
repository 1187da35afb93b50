"""Schedule of a sparse LU: operations that do not wait for each other stand side by side, in few and long loops.

Columns that do not act on each other form a level, and are eliminated in one loop over operations, whatever their
number. The pivots, the operations and, for each number that they change, their order are those of the column by column
form: the factors and solutions are the same to the last bit. Within a level, as within a substitution, operations are
sorted by the earliest time at which what they need is there.
"""

from __future__ import annotations

import numpy as np
from numba import int64, types, uint32

from gearmbs._jit import njit

_IVEC = int64[::1]
_UVEC = uint32[::1]


@njit(_IVEC(_IVEC), cache=True, nogil=True, error_model="numpy")
def _sorted_by(keys):
    """Return the order that sorts small keys, equal ones as they stand."""
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
def _times(to, by, count):
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
def _bounds(levels, size, count):
    """Return where each of ``count`` levels begins and ends in a list of the first ``size`` sorted by them."""
    bounds = np.zeros(count + 1, dtype=np.int64)
    for e in range(size):
        bounds[levels[e] + 1] += 1
    for level in range(count):
        bounds[level + 1] += bounds[level]
    return bounds


@njit(_UVEC(_UVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def _taken(items, order):
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


@njit(types.UniTuple(_IVEC, 2)(int64, _IVEC, _UVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def _orders_of_substitution(n, order, u_pos, u_col):
    """Return the order in which U is gone through, from its end; and pivots by level, those set aside last.

    ``order`` sorts proper pivots by their levels.
    """
    size = u_pos.shape[0]
    back = _sorted_by(_times(u_pos[::-1].copy(), u_col[::-1].copy(), n))
    u_order = np.empty(size, dtype=np.int64)
    for e in range(size):
        u_order[size - 1 - e] = size - 1 - back[e]
    by_level = np.empty(n, dtype=np.int64)
    for k in range(n):
        by_level[k] = order[k] if k < order.shape[0] else k
    return u_order, by_level


@njit(
    types.Tuple((_UVEC, _UVEC, _UVEC, _UVEC, _UVEC, _IVEC, _UVEC, _IVEC, _UVEC, _UVEC, _UVEC, _IVEC, _UVEC, _UVEC))(
        int64, _IVEC, _UVEC, _IVEC, _UVEC, _UVEC, _IVEC, _UVEC, _UVEC
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _schedule(rank, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col):
    """Return what `schedule` returns, in its order.

    Parameters
    ----------
    rank, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col
        See there.
    """
    n = l_ptr.shape[0] - 1
    below, above = l_pos.shape[0], u_pos.shape[0]
    level = _levels(u_ptr, u_pos)
    count = 0
    for k in range(rank):
        count = max(count, level[k] + 1)
    l_order = _sorted_by(_times(l_pos, l_col, n))
    u_order, by_level = _orders_of_substitution(n, _sorted_by(level[:rank].copy()), u_pos, u_col)
    l_at, u_at = _numbered(l_order, 0), _numbered(u_order, below)
    pivot_at = _numbered(by_level, below + above)
    a_to, levels, op_to, op_l, op_u = _operations(
        rank, a_ptr, a_pos, u_ptr, u_pos, l_ptr, l_pos, level, l_at, u_at, pivot_at
    )
    order = _sorted_by(_times(op_to, op_u, below + above + n))
    order = order[_sorted_by(levels[order])]
    l_level = np.empty(below, dtype=np.int64)
    for q in range(below):
        l_level[q] = level[l_col[q]]
    divided = _sorted_by(l_level)
    div_to, div_by = np.empty(below, dtype=np.uint32), np.empty(below, dtype=np.uint32)
    for e in range(below):
        div_to[e] = l_at[divided[e]]
        div_by[e] = pivot_at[l_col[divided[e]]]
    return (
        _taken(l_pos, l_order),
        _taken(l_col, l_order),
        _taken(u_pos, u_order),
        _taken(u_col, u_order),
        a_to,
        _bounds(level, rank, count),
        by_level.astype(np.uint32),
        _bounds(levels, levels.shape[0], count),
        _taken(op_to, order),
        _taken(op_l, order),
        _taken(op_u, order),
        _bounds(l_level, below, count),
        div_to,
        div_by,
    )


FIELDS = (
    "l_to", "l_by", "u_to", "u_by", "a_to", "pivot_ptr", "pivot_order", "op_ptr", "op_to", "op_l", "op_u", "div_ptr",
    "div_to", "div_by",
)  # fmt: skip


def schedule(
    rank: int,
    a_ptr: np.ndarray,
    a_pos: np.ndarray,
    u_ptr: np.ndarray,
    u_pos: np.ndarray,
    u_col: np.ndarray,
    l_ptr: np.ndarray,
    l_pos: np.ndarray,
    l_col: np.ndarray,
) -> dict[str, np.ndarray]:
    """Return the fields of a `gearmbs.dae.linalg.lu_plan.LUPlan` that say in which order a matrix without nodes is
    factored, from those that say column by column what is done.

    Parameters
    ----------
    rank : int
        Proper pivots.
    a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col : ndarray
        See `LUPlan`.
    """
    fields = _schedule(rank, a_ptr, a_pos, u_ptr, u_pos, u_col, l_ptr, l_pos, l_col)
    return dict(zip(FIELDS, fields, strict=True))


def column_by_column(
    u_pos: np.ndarray, u_col: np.ndarray, l_pos: np.ndarray, l_col: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the same fields for a matrix with nodes, whose factors stand as its columns do."""
    none, no_bounds = np.empty(0, dtype=np.uint32), np.empty(0, dtype=np.int64)
    empty = dict.fromkeys(("a_to", "pivot_order", "op_to", "op_l", "op_u", "div_to", "div_by"), none)
    return {
        "l_to": l_pos, "l_by": l_col, "u_to": u_pos, "u_by": u_col, **empty,
        **dict.fromkeys(("pivot_ptr", "op_ptr", "div_ptr"), no_bounds),
    }  # fmt: skip
