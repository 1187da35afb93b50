"""Blocks of eight rows: what the pivots before a dense tail give to its rows, C U_F^-1 of a sparse LU.

The entries of a column of L in the tail's rows lie close together, as the modes of a body do. Kept in whole lanes, with
zeros where there are none, one operation does for as many of them as a lane has, whether they are eliminated with
from other columns or from a right-hand side.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, larger, magnitude, put_lanes
from gearmbs.dae.compiled.views import vector_at

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


def front_blocks(tail: int, l_ptr: np.ndarray, l_pos: np.ndarray) -> dict[str, np.ndarray]:
    """Part the rows below each pivot into those before the tail and blocks of the tail's rows.

    Parameters
    ----------
    tail : int
        First pivot of the dense tail.
    l_ptr, l_pos : ndarray
        For each column the rows below the pivot.

    Returns
    -------
    dict
        The fields ``l_ptr``, ``l_pos``, ``l_col``, ``block_ptr``, ``block_at``, ``block_lane``, ``block_col`` and
        ``lane_ptr`` of `gearmbs.dae.linalg.lu_plan.LUPlan`.
    """
    n = len(l_ptr) - 1
    columns, inside = np.repeat(np.arange(n), np.diff(l_ptr)), l_pos >= tail
    lane = (l_pos[inside].astype(np.int64) - tail) // LANES
    lane, column = np.divmod(np.unique(lane * n + columns[inside]), n)
    by_column = np.argsort(column, kind="stable")
    return {
        "l_ptr": np.searchsorted(columns[~inside], np.arange(n + 1)),
        "l_pos": l_pos[~inside],
        "l_col": columns[~inside].astype(np.uint32),
        "block_ptr": np.searchsorted(column[by_column], np.arange(n + 1)),
        "block_at": by_column.astype(np.uint32),
        "block_lane": lane[by_column].astype(np.uint32),
        "block_col": column.astype(np.uint32),
        "lane_ptr": np.searchsorted(lane, np.arange(-(-(n - tail) // LANES) + 1)),
    }


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def act_by_blocks(plan, below, upper, k, x):
    """Eliminate the tail's rows of column k with the earlier pivots that act on it.

    Parameters
    ----------
    plan : LUPlan
    below : ndarray
        The blocks' numbers, by lanes of rows and then by columns.
    upper : ndarray
        Entries of U.
    k : int
    x : ndarray
        The column, spread out from the tail's first row on; changed.
    """
    block_ptr, block_at, block_lane, u_pos = plan.block_ptr, plan.block_at, plan.block_lane, plan.u_pos
    for p in range(np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])):
        j, u = np.uint64(u_pos[p]), upper[p]
        for q in range(np.uint64(block_ptr[j]), np.uint64(block_ptr[j + np.uint64(1)])):
            b = np.int64(block_lane[q])
            put_lanes(x, b, lanes_at(x, b) - lanes_at(below, np.int64(block_at[q])) * u)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def into_blocks(plan, below, k, inverse, x, growth):
    """Put the tail's rows of column k, spread out in ``x``, divided by its pivot into blocks, and clear ``x``.

    Parameters
    ----------
    plan, below, k, x
        As of `act_by_blocks`.
    inverse : float
        Of the pivot.
    growth : lanes
        Largest multipliers so far.

    Returns
    -------
    growth : lanes
    """
    for q in range(np.uint64(plan.block_ptr[k]), np.uint64(plan.block_ptr[k + 1])):
        b = np.int64(plan.block_lane[q])
        l = lanes_at(x, b) * inverse
        put_lanes(x, b, all_lanes(0.0))
        put_lanes(below, np.int64(plan.block_at[q]), l)
        growth = larger(growth, magnitude(l))
    return growth


@njit(
    types.void(int64, _IVEC, _UVEC, _VEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def open_tail(tail, lane_ptr, block_col, below, x, rest):
    """Write the tail's part of a right-hand side, less what the pivots before give to it.

    Parameters
    ----------
    tail : int
    lane_ptr, block_col : ndarray
        Of `LUPlan`.
    below : ndarray
        As of `act_by_blocks`.
    x : ndarray
        Right-hand side of the whole matrix, solved with L up to the tail.
    rest : ndarray
        Written: as many rows as the block of the tail has.
    """
    right = vector_at(x, tail, x.shape[0] - tail)
    for i in range(right.shape[0]):
        rest[i] = right[i]
    for b in range(lane_ptr.shape[0] - 1):
        q, last = np.uint64(lane_ptr[b]), np.uint64(lane_ptr[b + 1])
        # two sums, or each addition would wait for the one before
        even, odd = lanes_at(rest, b), all_lanes(0.0)
        while q + np.uint64(2) <= last:
            even = even - lanes_at(below, np.int64(q)) * x[block_col[q]]
            odd = odd + lanes_at(below, np.int64(q) + 1) * x[block_col[q + np.uint64(1)]]
            q += np.uint64(2)
        if q < last:
            even = even - lanes_at(below, np.int64(q)) * x[block_col[q]]
        put_lanes(rest, b, even - odd)
