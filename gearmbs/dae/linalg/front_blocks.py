"""Blocks of eight rows: what the pivots before a dense tail give to its rows, C U_F^-1 of a sparse LU.

The entries of a column of L in the tail's rows lie close together, as the modes of a body do. Kept in whole lanes, with
zeros where there are none, one operation does for as many of them as a lane has, whether they are eliminated with
from other columns or from a right-hand side.

The blocks stand one after the other, by lanes of rows and then by columns, and behind them the tail's own block. As the
operations on single numbers, see `gearmbs.dae.linalg.schedule`, those on blocks are listed step by step, and within
a step by how many there are before on the same block.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, larger_number, magnitude, put_lanes
from gearmbs.dae.compiled.ordered_bits import bits_of, double_of
from gearmbs.dae.compiled.views import vector_at
from gearmbs.dae.linalg.dense_tail import factor_tail, largest_in, padded
from gearmbs.dae.linalg.schedule import bounds_of, earliest_times, sorted_by, taken_in_order

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


class FrontBlocks(NamedTuple):
    """Where the blocks of a plan are.

    Attributes
    ----------
    keys : ndarray of int
        Lane of rows times the number of columns, and the column, of each block in the order in which they stand.
    ptr, at, lane : ndarray
        For each column its blocks: their places, and which eight rows of the tail they are.
    """

    keys: np.ndarray
    ptr: np.ndarray
    at: np.ndarray
    lane: np.ndarray


def front_blocks(tail: int, l_ptr: np.ndarray, l_pos: np.ndarray) -> tuple[dict[str, np.ndarray], FrontBlocks]:
    """Part the rows below each pivot into those before the tail and blocks of the tail's rows.

    Parameters
    ----------
    tail : int
        First pivot of the tail.
    l_ptr, l_pos : ndarray
        For each column the rows below the pivot.

    Returns
    -------
    fields : dict
        ``l_ptr``, ``l_pos``, ``l_col``, ``block_col`` and ``lane_ptr`` of `gearmbs.dae.linalg.lu_plan.LUPlan`.
    blocks : FrontBlocks
    """
    n = len(l_ptr) - 1
    columns, inside = np.repeat(np.arange(n), np.diff(l_ptr)), l_pos >= tail
    keys = np.unique((l_pos[inside].astype(np.int64) - tail) // LANES * n + columns[inside])
    lane, column = np.divmod(keys, n)
    by_column = np.argsort(column, kind="stable")
    fields = {
        "l_ptr": np.searchsorted(columns[~inside], np.arange(n + 1)),
        "l_pos": l_pos[~inside],
        "l_col": columns[~inside].astype(np.uint32),
        "block_col": column.astype(np.uint32),
        "lane_ptr": np.searchsorted(lane, np.arange(-(-(n - tail) // LANES) + 1)),
    }
    ptr = np.searchsorted(column[by_column], np.arange(n + 1))
    return fields, FrontBlocks(keys, ptr, by_column, lane[by_column])


def entries_in_blocks(
    tail: int, keys: np.ndarray, a_ptr: np.ndarray, a_pos: np.ndarray, a_src: np.ndarray, a_scale: np.ndarray
) -> dict[str, np.ndarray]:
    """Part the entries of the matrix into those in the tail's rows and all others.

    Parameters
    ----------
    keys : ndarray
        Of `FrontBlocks`.
    tail, a_ptr, a_pos, a_src, a_scale
        Of `gearmbs.dae.linalg.lu_plan.LUPlan`, with all entries.

    Returns
    -------
    dict
        The fields ``a_ptr``, ``a_pos``, ``a_src``, ``a_scale``, ``tail_at``, ``tail_src`` and ``tail_scale``.
    """
    n = len(a_ptr) - 1
    columns = np.repeat(np.arange(n), np.diff(a_ptr))
    inside = a_pos >= tail
    column, row = columns[inside], a_pos[inside].astype(np.int64) - tail
    block = np.searchsorted(keys, row // LANES * n + column)
    of_tail = LANES * len(keys) + (column - tail) * padded(n - tail) + row
    at = np.where(column < tail, LANES * block + row % LANES, of_tail)
    return {
        "a_ptr": np.searchsorted(columns[~inside], np.arange(n + 1)), "a_pos": a_pos[~inside],
        "a_src": a_src[~inside], "a_scale": a_scale[~inside], "tail_at": at.astype(np.uint32),
        "tail_src": a_src[inside], "tail_scale": a_scale[inside],
    }  # fmt: skip


@njit(
    types.Tuple((_IVEC, _UVEC, _UVEC, _UVEC))(int64, _IVEC, _IVEC, _UVEC, _IVEC, _IVEC, _IVEC, _IVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _actions(tail, step, u_ptr, u_pos, u_at, block_ptr, block_at, block_lane):
    """Return where the operations of each step begin, and the blocks ``to`` and ``by`` and the entry of U of each.

    Parameters
    ----------
    tail, step, u_ptr, u_pos, u_at
        As of `operations_on_blocks`.
    block_ptr, block_at, block_lane : ndarray of int
        Of `FrontBlocks`.
    """
    n = step.shape[0]
    lanes = (n - tail + LANES - 1) // LANES
    blocks = block_at.shape[0]
    count = 0
    for p in range(u_pos.shape[0]):
        count += block_ptr[u_pos[p] + 1] - block_ptr[u_pos[p]]
    steps, at = np.empty(count, dtype=np.int64), np.empty(lanes, dtype=np.int64)
    to, by, u = np.empty(count, dtype=np.uint32), np.empty(count, dtype=np.uint32), np.empty(count, dtype=np.uint32)
    e = 0
    for k in range(n):
        for b in range(lanes):
            at[b] = blocks + lanes * (k - tail) + b
        for q in range(block_ptr[k], block_ptr[k + 1]):
            at[block_lane[q]] = block_at[q]
        for p in range(u_ptr[k], u_ptr[k + 1]):
            j = u_pos[p]
            for q in range(block_ptr[j], block_ptr[j + 1]):
                steps[e], to[e], by[e], u[e] = step[k], at[block_lane[q]], block_at[q], u_at[p]
                e += 1
    order = sorted_by(earliest_times(to, to, blocks + lanes * (n - tail)))
    order = order[sorted_by(steps[order])]
    bounds = bounds_of(steps, count, step[n - 1] + 1)
    return bounds, taken_in_order(to, order), taken_in_order(by, order), taken_in_order(u, order)


def operations_on_blocks(
    tail: int, step: np.ndarray, u_ptr: np.ndarray, u_pos: np.ndarray, u_at: np.ndarray, blocks: FrontBlocks
) -> dict[str, np.ndarray]:
    """Return the fields of a `gearmbs.dae.linalg.lu_plan.LUPlan` that say what is done with blocks, and when.

    Parameters
    ----------
    tail, u_ptr, u_pos
        See there.
    step : ndarray of int, shape (n,)
        Step in which each column is eliminated; those of the tail are in one, the last.
    u_at : ndarray of int
        Where the entries of U stand among the numbers of the factors.
    blocks : FrontBlocks
    """
    act_ptr, act_to, act_by, act_u = _actions(tail, step, u_ptr, u_pos, u_at, blocks.ptr, blocks.at, blocks.lane)
    columns = np.repeat(np.arange(len(step)), np.diff(blocks.ptr))
    order = np.argsort(step[columns], kind="stable")
    return {
        "act_ptr": act_ptr, "act_to": act_to, "act_by": act_by, "act_u": act_u,
        "part_ptr": np.searchsorted(step[columns][order], np.arange(len(act_ptr))),
        "part_at": blocks.at[order].astype(np.uint32), "part_col": columns[order].astype(np.uint32),
    }  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def fill_blocks(plan, blocks, vals):
    """Write the entries of the matrix with values ``vals`` to the blocks, long before lanes of them are read."""
    at, src, scale = plan.tail_at, plan.tail_src, plan.tail_scale
    for b in range(blocks.shape[0] // LANES):
        put_lanes(blocks, b, all_lanes(0.0))
    for e in range(at.shape[0]):
        blocks[at[e]] = vals[src[e]] * scale[e]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def act_on_blocks(plan, blocks, lu, step):
    """Eliminate the tail's rows of the columns of a step with the earlier pivots that act on them.

    Parameters
    ----------
    plan : LUPlan
    blocks : ndarray
        Numbers of all blocks; changed.
    lu : ndarray
        Numbers of the factors, those of U complete in these columns.
    step : int
    """
    to, by, u = plan.act_to, plan.act_by, plan.act_u
    for e in range(np.uint64(plan.act_ptr[step]), np.uint64(plan.act_ptr[step + 1])):
        b = np.int64(to[e])
        put_lanes(blocks, b, lanes_at(blocks, b) - lanes_at(blocks, np.int64(by[e])) * lu[u[e]])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def divide_blocks(plan, blocks, pivot_inv, step, growth):
    """Divide the blocks of a step's columns by their pivots.

    Parameters
    ----------
    plan, blocks, step
        As of `act_on_blocks`.
    pivot_inv : ndarray
        Inverse pivots.
    growth : (lanes, lanes)
        Largest multipliers so far, and zeros, or NaN after one that is not finite.

    Returns
    -------
    growth : (lanes, lanes)
    """
    grown, spoiled = growth
    at, column = plan.part_at, plan.part_col
    for e in range(np.uint64(plan.part_ptr[step]), np.uint64(plan.part_ptr[step + 1])):
        b = np.int64(at[e])
        l = lanes_at(blocks, b) * pivot_inv[column[e]]
        put_lanes(blocks, b, l)
        grown = larger_number(magnitude(l), grown)
        spoiled = spoiled + l * 0.0
    return grown, spoiled


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def tail_in(plan, blocks):
    """Return the tail's own block."""
    first = LANES * plan.block_col.shape[0]
    return vector_at(blocks, first, blocks.shape[0] - first)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def factor_behind(plan, factors, step, growth):
    """Factor the tail after all pivots before it, in the last step; return the largest multiplier of all blocks."""
    blocks, rest = factors.blocks, factors.rest
    act_on_blocks(plan, blocks, factors.lu, step)
    top = bits_of(largest_in(rest, 0, growth[0] + growth[1]))
    grown = factor_tail(plan.tail, factors.lower, tail_in(plan, blocks), factors.pivot_inv)
    return double_of(max(top, bits_of(grown)))


@njit(
    types.void(int64, _IVEC, _UVEC, _VEC, _VEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
    fastmath={"contract"},
)
def open_tail(tail, lane_ptr, block_col, blocks, x, rest):
    """Write the tail's part of a right-hand side, less what the pivots before give to it.

    Parameters
    ----------
    tail : int
    lane_ptr, block_col : ndarray
        Of `LUPlan`.
    blocks : ndarray
        As of `act_on_blocks`.
    x : ndarray
        Right-hand side of the whole matrix, solved with L up to the tail.
    rest : ndarray
        Written: as many rows as the block of the tail has.
    """
    size = x.shape[0] - tail
    for i in range(size):
        rest[i] = x[tail + i]
    for i in range(size, rest.shape[0]):
        rest[i] = 0.0
    for b in range(lane_ptr.shape[0] - 1):
        q, last = np.uint64(lane_ptr[b]), np.uint64(lane_ptr[b + 1])
        # two sums, or each addition would wait for the one before
        even, odd = lanes_at(rest, b), all_lanes(0.0)
        while q + np.uint64(2) <= last:
            even = even - lanes_at(blocks, np.int64(q)) * x[block_col[q]]
            odd = odd + lanes_at(blocks, np.int64(q) + 1) * x[block_col[q + np.uint64(1)]]
            q += np.uint64(2)
        if q < last:
            even = even - lanes_at(blocks, np.int64(q)) * x[block_col[q]]
        put_lanes(rest, b, even - odd)
