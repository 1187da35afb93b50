"""Dense tail of a sparse LU: the last pivots, among which most entries have filled in, are taken as a full block.

Among the last pivots of bodies with many modes, which share all loads and joints, most entries are there or fill in.
Lists of places cost more there than the zeros they spare: a full block is worked on eight rows at a time.

The block has a column a pivot, padded with zeros to whole lanes of rows. L and U stand apart, both with zeros where the
other has its entries, so that lanes in which a diagonal lies are treated like all others.
"""

from __future__ import annotations

import numpy as np
from numba import float64, int64, types

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, larger, magnitude, put_lanes
from gearmbs.dae.compiled.ordered_bits import bits_of, double_of

SHARE = 0.6
"""Share of entries among the last pivots from which on they are taken as a block: an entry of a list takes several
times as long as one of a block."""
SMALLEST = 24
"""Pivots that are worth a block."""

_VEC = float64[::1]
_IVEC = int64[::1]


def padded(size: int) -> int:
    """Return a number of rows filled up to whole lanes."""
    return -(-size // LANES) * LANES


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


def without_tail(tail: int, ptr: np.ndarray, items: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the entries below or right of each pivot without those of the tail's pivots."""
    return np.minimum(ptr, ptr[tail]), items[: ptr[tail]]


def tail_entries(
    tail: int, a_ptr: np.ndarray, a_pos: np.ndarray, a_src: np.ndarray, a_scale: np.ndarray
) -> dict[str, np.ndarray]:
    """Part the entries of the matrix into those inside the tail and all others.

    Parameters
    ----------
    tail, a_ptr, a_pos, a_src, a_scale
        Of `gearmbs.dae.linalg.lu_plan.LUPlan`, with all entries.

    Returns
    -------
    dict
        The fields ``a_ptr``, ``a_pos``, ``a_src``, ``a_scale``, ``tail_at``, ``tail_src`` and ``tail_scale``.
    """
    n = len(a_ptr) - 1
    columns = np.repeat(np.arange(n), np.diff(a_ptr))
    inside = (columns >= tail) & (a_pos >= tail)
    at = (columns[inside] - tail) * padded(n - tail) + a_pos[inside] - tail
    return {
        "a_ptr": np.searchsorted(columns[~inside], np.arange(n + 1)), "a_pos": a_pos[~inside],
        "a_src": a_src[~inside], "a_scale": a_scale[~inside], "tail_at": at.astype(np.uint32),
        "tail_src": a_src[inside], "tail_scale": a_scale[inside],
    }  # fmt: skip


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
def fill_tail(plan, upper, vals):
    """Write the entries of the matrix with values ``vals`` to the block, long before lanes of them are read."""
    at, src, scale = plan.tail_at, plan.tail_src, plan.tail_scale
    for b in range(upper.shape[0] // LANES):
        put_lanes(upper, b, all_lanes(0.0))
    for e in range(at.shape[0]):
        upper[at[e]] = vals[src[e]] * scale[e]


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
        Largest multiplier, infinite where a pivot vanishes.
    """
    size = pivot_inv.shape[0] - tail
    lanes = (size + LANES - 1) // LANES
    rows = LANES * lanes
    grown = all_lanes(0.0)
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
            own = k // LANES
            for b in range(own, lanes):
                put_lanes(lower, lanes * k + b, lanes_at(upper, lanes * k + b) * inverse)
            for i in range(LANES * own, k + 1):
                lower[rows * k + i] = 0.0
            for i in range(k, LANES * (own + 1)):
                upper[rows * k + i] = 0.0
            for b in range(own, lanes):
                grown = larger(grown, magnitude(lanes_at(lower, lanes * k + b)))
        if last == size:
            break
        k = last
        while k + 2 <= size:
            _less_four(lower, upper, first, k, lanes, True)
            k += 2
        if k < size:
            _less_four(lower, upper, first, k, lanes, False)
    put_lanes(lower, lanes * size, grown)
    top = int64(0)
    for i in range(rows * size, rows * size + LANES):
        top = max(top, bits_of(lower[i]))
    return double_of(top)


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
