"""Dense tail of a sparse LU: the last pivots, among which most entries have filled in, are taken as a full block.

Among the last pivots of bodies with many modes, which share all loads and joints, most entries are there or fill in.
Lists of places cost more there than the zeros they spare: a full block is worked on eight rows at a time.

The block has a column a pivot, padded with zeros to whole lanes of rows. L and U stand apart, both with zeros where the
other has its entries, so that lanes in which a diagonal lies are treated like all others.
"""

from __future__ import annotations

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types, uint32
from gearmbs.kernels.lanes import LANES, all_lanes, bits_of, double_of, lanes_at, larger_number, magnitude, put_lanes
from gearmbs.kernels.structs import vector_at

BELOW = np.tril(np.ones((LANES, LANES)), -1).T.ravel()
"""For each row of a lane ones in the rows below it; the same above."""
ABOVE = np.triu(np.ones((LANES, LANES)), 1).T.ravel()

_VEC = float64[::1]
_IVEC = int64[::1]


def padded(size: int) -> int:
    """Return a number of rows filled up to whole lanes."""
    return -(-size // LANES) * LANES


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def _through_four(lower, first, column, rows, upper):
    """Return the entries of a column of U in rows ``first`` to ``first + 3``: L^-1 times what stands there."""
    a, at = rows * column + first, rows * first + first
    b, c = at + rows, at + 2 * rows
    u = upper[a]
    v = upper[a + 1] - lower[at + 1] * u
    y = upper[a + 2] - lower[at + 2] * u - lower[b + 2] * v
    return u, v, y, upper[a + 3] - lower[at + 3] * u - lower[b + 3] * v - lower[c + 3] * y


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def _less_four(lower, upper, first, k, lanes, pair):
    """Eliminate from column k, and the one behind it if ``pair``, with the four columns from ``first`` on."""
    rows = LANES * lanes
    u, v, y, z = _through_four(lower, first, k, rows, upper)
    p, q = lanes * k, lanes * first
    if not pair:
        for b in range(first // LANES, lanes):
            less = lanes_at(lower, q + b) * u + lanes_at(lower, q + lanes + b) * v
            less = less + lanes_at(lower, q + 2 * lanes + b) * y + lanes_at(lower, q + 3 * lanes + b) * z
            put_lanes(upper, p + b, lanes_at(upper, p + b) - less)
        return
    u_2, v_2, y_2, z_2 = _through_four(lower, first, k + 1, rows, upper)
    for b in range(first // LANES, lanes):
        one, two = lanes_at(lower, q + b), lanes_at(lower, q + lanes + b)
        three, four = lanes_at(lower, q + 2 * lanes + b), lanes_at(lower, q + 3 * lanes + b)
        put_lanes(upper, p + b, lanes_at(upper, p + b) - (one * u + two * v + three * y + four * z))
        left = lanes_at(upper, p + lanes + b) - (one * u_2 + two * v_2 + three * y_2 + four * z_2)
        put_lanes(upper, p + lanes + b, left)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def largest_in(room, place, grown):
    """Return the largest of lanes without a sign, NaN if one is; a place of ``room`` is overwritten by them."""
    put_lanes(room, place, grown)
    top = int64(0)
    for i in range(LANES * place, LANES * place + LANES):
        top = max(top, bits_of(room[i]))
    return double_of(top)


@njit(float64(int64, _VEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def factor_tail(tail, lower, upper, pivot_inv):
    """Factor the block without a choice of pivots, four columns at a time.

    Parameters
    ----------
    tail : int
        First pivot of the tail.
    lower : ndarray
        Written: L below its unit diagonal.
    upper : ndarray
        The block, changed to U above its diagonal.
    pivot_inv : ndarray
        Inverse pivots of the whole matrix; written from ``tail`` on.

    Returns
    -------
    growth : float
        Largest multiplier, infinite where a pivot vanishes, NaN if one is not finite.
    """
    size = pivot_inv.shape[0] - tail
    lanes = (size + LANES - 1) // LANES
    rows = LANES * lanes
    grown, spoiled = all_lanes(0.0), all_lanes(0.0)
    for first in range(0, size, 4):
        last = min(first + 4, size)
        for k in range(first, last):
            for j in range(first, k):
                u = upper[rows * k + j]
                for b in range(j // LANES, lanes):
                    put_lanes(upper, lanes * k + b, lanes_at(upper, lanes * k + b) - lanes_at(lower, lanes * j + b) * u)
            pivot = upper[rows * k + k]
            if pivot == 0.0:
                return np.inf
            inverse = 1.0 / pivot
            pivot_inv[tail + k] = inverse
            own, place = lanes * k + k // LANES, k % LANES
            for b in range(own, lanes * (k + 1)):
                l = lanes_at(upper, b) * inverse
                if b == own:
                    # numbers written one by one could not be read as lanes at once
                    l = l * lanes_at(BELOW, place)
                put_lanes(lower, b, l)
                grown = larger_number(magnitude(l), grown)
                spoiled = spoiled + l * 0.0
            put_lanes(upper, own, lanes_at(upper, own) * lanes_at(ABOVE, place))
        if last == size:
            break
        k = last
        while k + 2 <= size:
            _less_four(lower, upper, first, k, lanes, True)
            k += 2
        if k < size:
            _less_four(lower, upper, first, k, lanes, False)
    return largest_in(lower, lanes * size, grown + spoiled)


@njit(
    types.void(int64, _VEC, _VEC, _VEC, _VEC, _VEC), cache=True, nogil=True, error_model="numpy", fastmath={"contract"}
)
def solve_tail(tail, lower, upper, pivot_inv, rest, x):
    """Solve with L and then with U in the tail, four columns at a time; the last division by pivots is left out.

    Parameters
    ----------
    tail, lower, upper, pivot_inv
        As of `factor_tail`.
    rest : ndarray
        Right-hand side, as many rows as the block has; changed.
    x : ndarray
        Unknowns of the whole matrix, written from ``tail`` on.
    """
    size = pivot_inv.shape[0] - tail
    lanes = (size + LANES - 1) // LANES
    rows = LANES * lanes
    whole = size // 4 * 4
    for k in range(0, whole, 4):
        at = rows * k + k
        u = rest[k]
        v = rest[k + 1] - lower[at + 1] * u
        y = rest[k + 2] - lower[at + 2] * u - lower[at + rows + 2] * v
        z = rest[k + 3] - lower[at + 3] * u - lower[at + rows + 3] * v - lower[at + 2 * rows + 3] * y
        for b in range(k // LANES, lanes):
            q = lanes * k + b
            less = lanes_at(lower, q) * u + lanes_at(lower, q + lanes) * v
            less = less + lanes_at(lower, q + 2 * lanes) * y + lanes_at(lower, q + 3 * lanes) * z
            put_lanes(rest, b, lanes_at(rest, b) - less)
    for k in range(whole, size):
        u = rest[k]
        for b in range(k // LANES, lanes):
            put_lanes(rest, b, lanes_at(rest, b) - lanes_at(lower, lanes * k + b) * u)
    for k in range(size - 1, whole - 1, -1):
        u = rest[k] * pivot_inv[tail + k]
        for b in range(k // LANES + 1):
            put_lanes(rest, b, lanes_at(rest, b) - lanes_at(upper, lanes * k + b) * u)
    for k in range(whole - 4, -1, -4):
        at = rows * k + k
        z = rest[k + 3] * pivot_inv[tail + k + 3]
        y = (rest[k + 2] - upper[at + 3 * rows + 2] * z) * pivot_inv[tail + k + 2]
        v = (rest[k + 1] - upper[at + 3 * rows + 1] * z - upper[at + 2 * rows + 1] * y) * pivot_inv[tail + k + 1]
        u = rest[k] - upper[at + 3 * rows] * z - upper[at + 2 * rows] * y - upper[at + rows] * v
        u *= pivot_inv[tail + k]
        for b in range(k // LANES + 1):
            q = lanes * k + b
            less = lanes_at(upper, q) * u + lanes_at(upper, q + lanes) * v
            less = less + lanes_at(upper, q + 2 * lanes) * y + lanes_at(upper, q + 3 * lanes) * z
            put_lanes(rest, b, lanes_at(rest, b) - less)
    for i in range(size):
        x[tail + i] = rest[i]


# Blocks of eight rows: what the pivots before a dense tail give to its rows, C U_F^-1 of a sparse LU. Where they stand,
# and what is done with them, is listed by `gearmbs.dae.linalg.front_blocks`.


_UVEC = uint32[::1]


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


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def less_blocks(kept, q, last, blocks, by, numbers, of):
    """Return lanes less the products of blocks and numbers, in two sums, or each would wait for the one before.

    Parameters
    ----------
    kept : lanes
    q, last : int
        The first product and the one behind the last.
    blocks, by : ndarray
        Blocks, and for each product which of them.
    numbers, of : ndarray
        Numbers, and for each product which of them.
    """
    odd = all_lanes(0.0)
    while q + np.uint64(2) <= last:
        kept = kept - lanes_at(blocks, np.int64(by[q])) * numbers[of[q]]
        odd = odd + lanes_at(blocks, np.int64(by[q + np.uint64(1)])) * numbers[of[q + np.uint64(1)]]
        q += np.uint64(2)
    if q < last:
        kept = kept - lanes_at(blocks, np.int64(by[q])) * numbers[of[q]]
    return kept - odd


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def act_at_last(plan, blocks, lu):
    """Do what `act_on_blocks` does in the last step, one changed block after the other."""
    to, ptr = plan.last_to, plan.last_ptr
    for g in range(to.shape[0]):
        b, q, last = np.int64(to[g]), np.uint64(ptr[g]), np.uint64(ptr[g + 1])
        put_lanes(blocks, b, less_blocks(lanes_at(blocks, b), q, last, blocks, plan.act_by, lu, plan.act_u))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def tail_in(plan, blocks):
    """Return the tail's own block."""
    first = LANES * plan.block_col.shape[0]
    return vector_at(blocks, first, blocks.shape[0] - first)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def factor_behind(plan, factors, growth):
    """Factor the tail after all pivots before it, in the last step; return the largest multiplier of all blocks."""
    blocks, rest = factors.blocks, factors.rest
    act_at_last(plan, blocks, factors.lu)
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


# Blocks of eight rows of U before the tail, in the tail's columns: what the tail's unknowns give to those before them.


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def fill_above(plan, factors):
    """Write the entries of U in the tail's columns, as the levels have left them, to their blocks."""
    above, at, lu = factors.above, plan.above_at, factors.lu
    first = np.uint64(plan.l_to.shape[0])
    for b in range(above.shape[0] // LANES):
        put_lanes(above, b, all_lanes(0.0))
    for p in range(np.uint64(at.shape[0])):
        above[at[p]] = lu[first + p]


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True, fastmath={"contract"})
def take_above(plan, factors):
    """Take from ``factors.x`` before the tail what the tail's unknowns, which stand there, give."""
    x, above, column, ptr = factors.x, factors.above, plan.above_col, plan.above_ptr
    for g in range(ptr.shape[0] - 1):
        q, last = np.uint64(ptr[g]), np.uint64(ptr[g + 1])
        even, odd = lanes_at(x, g), all_lanes(0.0)
        while q + np.uint64(2) <= last:
            even = even - lanes_at(above, np.int64(q)) * x[column[q]]
            odd = odd + lanes_at(above, np.int64(q) + 1) * x[column[q + np.uint64(1)]]
            q += np.uint64(2)
        if q < last:
            even = even - lanes_at(above, np.int64(q)) * x[column[q]]
        put_lanes(x, g, even - odd)
