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


def _bounds(levels: np.ndarray, count: int) -> np.ndarray:
    """Return where each of ``count`` levels begins and ends in a list sorted by them, shape (count + 1,)."""
    return np.concatenate(([0], np.cumsum(np.bincount(levels, minlength=count))))


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
    n = len(l_ptr) - 1
    level = _levels(u_ptr, u_pos)
    count = int(level[:rank].max(initial=-1)) + 1
    by_level = np.append(_sorted_by(level[:rank]), np.arange(rank, n))
    # U is gone through from its end
    l_order = _sorted_by(_times(l_pos, l_col, n))
    u_order = (len(u_pos) - 1 - _sorted_by(_times(u_pos[::-1].copy(), u_col[::-1].copy(), n)))[::-1]
    l_at, u_at, pivot_at = (np.empty(size, dtype=np.int64) for size in (len(l_pos), len(u_pos), n))
    l_at[l_order] = np.arange(len(l_pos))
    u_at[u_order] = len(l_pos) + np.arange(len(u_pos))
    pivot_at[by_level] = len(l_pos) + len(u_pos) + np.arange(n)
    a_to, levels, op_to, op_l, op_u = _operations(
        rank, a_ptr, a_pos, u_ptr, u_pos, l_ptr, l_pos, level, l_at, u_at, pivot_at
    )
    order = _sorted_by(_times(op_to, op_u, len(l_pos) + len(u_pos) + n))
    order = order[_sorted_by(levels[order])]
    l_level = level[l_col]
    divided = _sorted_by(l_level)
    return {
        "l_to": l_pos[l_order],
        "l_by": l_col[l_order],
        "u_to": u_pos[u_order],
        "u_by": u_col[u_order],
        "a_to": a_to,
        "pivot_ptr": _bounds(level[:rank], count),
        "pivot_order": by_level.astype(np.uint32),
        "op_ptr": _bounds(levels, count),
        "op_to": op_to[order],
        "op_l": op_l[order],
        "op_u": op_u[order],
        "div_ptr": _bounds(l_level, count),
        "div_to": l_at[divided].astype(np.uint32),
        "div_by": pivot_at[l_col[divided]].astype(np.uint32),
    }


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
