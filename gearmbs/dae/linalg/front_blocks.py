"""Lists of a dense tail: where it begins, the blocks of eight rows before it, and what is done with them, and when.

The entries of a column of L in the tail's rows lie close together, as the modes of a body do. Kept in whole lanes,
with zeros where there are none, one operation does for as many of them as a lane has, whether they are eliminated
with from other columns or from a right-hand side. So are the entries of U before the tail, in the tail's columns.

The blocks stand one after the other, by lanes of rows and then by columns, and behind them the tail's own block. As
the operations on single numbers, see `gearmbs.dae.linalg.schedule`, those on blocks are listed step by step, and
within a step by how many there are before on the same block.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.linalg.schedule import bounds_of, earliest_times, sorted_by, taken_in_order
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types, uint32
from gearmbs.kernels.lanes import LANES

SHARE = 0.6
"""Share of entries among the last pivots from which on they are taken as a block: an entry of a list takes several
times as long as one of a block."""
SMALLEST = 24
"""Pivots that are worth a block."""

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]


@njit(int64(int64, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def tail_of_plan(rank, l_ptr, u_ptr):
    """Return the first pivot of the dense tail, or the number of pivots if there is none.

    Parameters
    ----------
    rank : int
        Proper pivots; where some are missing there is no tail.
    l_ptr, u_ptr : ndarray
        Where the entries below and right of each pivot begin.
    """
    n = l_ptr.shape[0] - 1
    if rank < n:
        return n
    for k in range(n - SMALLEST + 1):
        size = n - k
        if l_ptr[n] - l_ptr[k] + u_ptr[n] - u_ptr[k] >= SHARE * size * (size - 1):
            return k
    return n


@njit(types.Tuple((_IVEC, _IVEC))(int64, _IVEC, _IVEC), cache=True, nogil=True, error_model="numpy")
def without_tail(tail, ptr, items):
    """Return the entries below or right of each pivot without those of the tail's pivots."""
    end = ptr[tail]
    return np.minimum(ptr, end), items[:end].copy()


@njit(
    types.Tuple((_IVEC, _UVEC, _UVEC, _UVEC, _IVEC, _IVEC, _IVEC, _IVEC))(int64, _IVEC, _UVEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def front_blocks(tail, l_ptr, l_pos):
    """Part the rows below each pivot into those before the tail and blocks of the tail's rows.

    Parameters
    ----------
    tail : int
        First pivot of the tail.
    l_ptr, l_pos : ndarray
        For each column the rows below the pivot, ascending.

    Returns
    -------
    l_ptr, l_pos, l_col, block_col, lane_ptr : ndarray
        Fields of a `gearmbs.dae.linalg.lu_plan.LUPlan`.
    ptr, at, lane : ndarray of int64
        For each column its blocks: their places, and which eight rows of the tail they are.
    """
    n = l_ptr.shape[0] - 1
    before, ptr = np.zeros(n + 1, dtype=np.int64), np.zeros(n + 1, dtype=np.int64)
    lane_ptr = np.zeros((n - tail + LANES - 1) // LANES + 1, dtype=np.int64)
    for k in range(n):
        before[k + 1], ptr[k + 1], last = before[k], ptr[k], -1
        for q in range(l_ptr[k], l_ptr[k + 1]):
            row = np.int64(l_pos[q])
            if row < tail:
                before[k + 1] += 1
            elif (row - tail) // LANES != last:
                last = (row - tail) // LANES
                ptr[k + 1] += 1
                lane_ptr[last + 1] += 1
    for b in range(lane_ptr.shape[0] - 1):
        lane_ptr[b + 1] += lane_ptr[b]
    rows, columns = np.empty(before[n], dtype=np.uint32), np.empty(before[n], dtype=np.uint32)
    block_col = np.empty(ptr[n], dtype=np.uint32)
    at, lane = np.empty(ptr[n], dtype=np.int64), np.empty(ptr[n], dtype=np.int64)
    following, e, p = lane_ptr.copy(), 0, 0
    for k in range(n):
        last = -1
        for q in range(l_ptr[k], l_ptr[k + 1]):
            row = np.int64(l_pos[q])
            if row < tail:
                rows[e], columns[e] = row, k
                e += 1
            elif (row - tail) // LANES != last:
                last = (row - tail) // LANES
                at[p], lane[p] = following[last], last
                block_col[at[p]] = k
                following[last] += 1
                p += 1
    return before, rows, columns, block_col, lane_ptr, ptr, at, lane


@njit(
    types.Tuple((_IVEC, _UVEC, _UVEC, _VEC, _UVEC, _UVEC, _VEC))(int64, _IVEC, _IVEC, _IVEC, _IVEC, _UVEC, _UVEC, _VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def entries_in_blocks(tail, ptr, at, lane, a_ptr, a_pos, a_src, a_scale):
    """Part the entries of the matrix into those in the tail's rows and all others.

    Parameters
    ----------
    ptr, at, lane : ndarray
        Of `front_blocks`.
    tail, a_ptr, a_pos, a_src, a_scale
        Of `gearmbs.dae.linalg.lu_plan.LUPlan`, with all entries.

    Returns
    -------
    a_ptr, a_pos, a_src, a_scale, tail_at, tail_src, tail_scale : ndarray
        Fields of a plan.
    """
    n, entries = a_ptr.shape[0] - 1, a_pos.shape[0]
    inside = 0
    for e in range(entries):
        inside += a_pos[e] >= tail
    ends = np.zeros(n + 1, dtype=np.int64)
    pos, src = np.empty(entries - inside, dtype=np.uint32), np.empty(entries - inside, dtype=np.uint32)
    scale, tail_scale = np.empty(entries - inside), np.empty(inside)
    tail_at, tail_src = np.empty(inside, dtype=np.uint32), np.empty(inside, dtype=np.uint32)
    lanes = (n - tail + LANES - 1) // LANES
    block, blocks = np.zeros(lanes, dtype=np.int64), at.shape[0]
    q = 0
    for k in range(n):
        ends[k + 1] = ends[k]
        for b in range(lanes):
            block[b] = blocks + lanes * (k - tail) + b
        for p in range(ptr[k], ptr[k + 1]):
            block[lane[p]] = at[p]
        for e in range(a_ptr[k], a_ptr[k + 1]):
            row = np.int64(a_pos[e]) - tail
            if row < 0:
                p = ends[k + 1]
                pos[p], src[p], scale[p] = a_pos[e], a_src[e], a_scale[e]
                ends[k + 1] += 1
            else:
                tail_at[q] = LANES * block[row // LANES] + row % LANES
                tail_src[q], tail_scale[q] = a_src[e], a_scale[e]
                q += 1
    return ends, pos, src, scale, tail_at, tail_src, tail_scale


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
    tail, step, u_ptr, u_pos, u_at, block_ptr, block_at, block_lane
        As of `operations_on_blocks`.
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


@njit(
    types.Tuple((_IVEC, _UVEC, _UVEC, _UVEC, _IVEC, _UVEC, _IVEC, _UVEC, _UVEC))(
        int64, _IVEC, _IVEC, _UVEC, _IVEC, _IVEC, _IVEC, _IVEC
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def operations_on_blocks(tail, step, u_ptr, u_pos, u_at, block_ptr, block_at, block_lane):
    """Return the fields of a `gearmbs.dae.linalg.lu_plan.LUPlan` that say what is done with blocks, and when.

    Parameters
    ----------
    tail, u_ptr, u_pos
        See there.
    step : ndarray of int64, shape (n,)
        Step in which each column is eliminated; those of the tail are in one, the last.
    u_at : ndarray of int64
        Where the entries of U stand among the numbers of the factors.
    block_ptr, block_at, block_lane : ndarray of int64
        ``ptr``, ``at`` and ``lane`` of `front_blocks`.

    Returns
    -------
    act_ptr, act_to, act_by, act_u, last_ptr, last_to, part_ptr, part_at, part_col : ndarray
    """
    n = step.shape[0]
    act_ptr, act_to, act_by, act_u = _actions(tail, step, u_ptr, u_pos, u_at, block_ptr, block_at, block_lane)
    # the last step's wait for nothing: those on a block stand together
    steps = act_ptr.shape[0] - 1
    first, end = act_ptr[steps - 1], act_ptr[steps]
    together = first + sorted_by(act_to[first:end].astype(np.int64))
    act_to[first:end] = taken_in_order(act_to, together)
    act_by[first:end] = taken_in_order(act_by, together)
    act_u[first:end] = taken_in_order(act_u, together)
    count = 0
    for e in range(first, end):
        count += e == first or act_to[e] != act_to[e - 1]
    last_ptr, last_to = np.empty(count + 1, dtype=np.int64), np.empty(count, dtype=np.uint32)
    count = 0
    for e in range(first, end):
        if e == first or act_to[e] != act_to[e - 1]:
            last_ptr[count], last_to[count] = e, act_to[e]
            count += 1
    last_ptr[count] = end
    columns, levels = np.empty(block_at.shape[0], dtype=np.int64), np.empty(block_at.shape[0], dtype=np.int64)
    for k in range(n):
        for q in range(block_ptr[k], block_ptr[k + 1]):
            columns[q], levels[q] = k, step[k]
    order = sorted_by(levels)
    part_at, part_col = np.empty(order.shape[0], dtype=np.uint32), np.empty(order.shape[0], dtype=np.uint32)
    for e in range(order.shape[0]):
        part_at[e], part_col[e] = block_at[order[e]], columns[order[e]]
    part_ptr = bounds_of(levels, levels.shape[0], steps)
    return act_ptr, act_to, act_by, act_u, last_ptr, last_to, part_ptr, part_at, part_col


@njit(types.Tuple((_IVEC, _UVEC, _UVEC))(int64, int64, _UVEC, _UVEC), cache=True, nogil=True, error_model="numpy")
def blocks_above(tail, n, u_to, u_by):
    """Return the fields ``above_ptr``, ``above_col`` and ``above_at`` of a `gearmbs.dae.linalg.lu_plan.LUPlan`.

    Parameters
    ----------
    tail, n : int
        First pivot of the tail; pivots.
    u_to, u_by : ndarray
        Rows and columns of the entries of U, see there.
    """
    size = 0
    for p in range(u_by.shape[0]):
        size += u_by[p] >= tail
    row, column = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    size = 0
    for p in range(u_by.shape[0]):
        if u_by[p] >= tail:
            row[size], column[size] = u_to[p], u_by[p]
            size += 1
    order = sorted_by(column)
    order = order[sorted_by((row // LANES)[order])]
    above_ptr = np.zeros((tail + LANES - 1) // LANES + 1, dtype=np.int64)
    above_col, above_at = np.empty(size, dtype=np.uint32), np.empty(size, dtype=np.uint32)
    block = -1
    for e in range(size):
        p = order[e]
        before = order[e - 1] if e > 0 else p
        if e == 0 or row[p] // LANES != row[before] // LANES or column[p] != column[before]:
            block += 1
            above_col[block] = column[p]
            above_ptr[row[p] // LANES + 1] += 1
        above_at[p] = LANES * block + row[p] % LANES
    for b in range(above_ptr.shape[0] - 1):
        above_ptr[b + 1] += above_ptr[b]
    return above_ptr, above_col[: block + 1].copy(), above_at
