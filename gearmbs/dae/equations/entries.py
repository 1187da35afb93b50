"""Entries of sparse matrices: one walk in a fixed order counts them, notes their places or adds up their numbers."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit

NUMBERS, PLACES, COUNT = 0, 1, 2


@njit("int64(int64, int64[::1], float64[::1], int64, int64, int64, float64)", cache=True, error_model="numpy")
def put(mode, slot, vals, k, row, col, value):
    """Hand over entry k; return the number of the next.

    Parameters
    ----------
    mode : int
        ``NUMBERS``: add the value to its place; ``PLACES``: note row and column; ``COUNT``: neither.
    slot : ndarray of int
        Place of each entry among the values in CSC order.
    vals : ndarray
        Values, or rows and columns one after the other.
    """
    if mode == NUMBERS:
        vals[slot[k]] += value
    elif mode == PLACES:
        vals[2 * k] = row
        vals[2 * k + 1] = col
    return k + 1


@njit(cache=True, error_model="numpy")
def put_pair(mode, slot, vals, k, row, col, value):
    """Hand over an entry of Phi_q and its mirror image in Phi_q^T; return the number of the next entry."""
    k = put(mode, slot, vals, k, row, col, value)
    return put(mode, slot, vals, k, col, row, value)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_number(slot, vals, k, value):
    """Add the number of entry k to its place, as `put` in the mode NUMBERS; return the number of the next entry."""
    vals[slot[k]] += value
    return k + 1


@njit(cache=True, error_model="numpy", forceinline=True)
def add_pair(slot, vals, k, value):
    """Add the number of an entry of Phi_q and of its mirror image to their places; return the number of the next."""
    return add_number(slot, vals, add_number(slot, vals, k, value), value)


def compressed(places: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the CSC pattern of a list of (row, column) places and the slot of each place in it."""
    unique, slots = np.unique(places[:, 1] * n + places[:, 0], return_inverse=True)
    columns, rows = np.divmod(unique, n)
    indptr = np.searchsorted(columns, np.arange(n + 1)).astype(np.int64)
    return indptr, rows.astype(np.int64), slots.astype(np.int64)
