"""Nodes of a sparse LU: columns in a row whose rows below are the same, so that they are eliminated together."""

from __future__ import annotations

import numpy as np
from numba import float64, int64, types, uint32

from gearmbs._jit import njit

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
