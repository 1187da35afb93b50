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
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, larger_number, magnitude, put_lanes
from gearmbs.dae.compiled.ordered_bits import bits_of, double_of

SHARE = 0.6
"""Share of entries among the last pivots from which on they are taken as a block: an entry of a list takes several
times as long as one of a block."""
SMALLEST = 24
"""Pivots that are worth a block."""

BELOW = np.tril(np.ones((LANES, LANES)), -1).T.ravel()
"""For each row of a lane ones in the rows below it; the same above."""
ABOVE = np.triu(np.ones((LANES, LANES)), 1).T.ravel()

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
