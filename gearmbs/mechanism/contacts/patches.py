"""Patches of faceted solids: vertices in contact that a triangle of their own mesh joins.

Points of the second solid join the patch of the point of the first that is next to them.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.mechanism.contacts import points as pt


@njit(cache=True, error_model="numpy")
def row_of(rows, first, end, vertex):
    """Return the row of a vertex, -1 if it is not in contact; rows are in the order of vertices."""
    low, high = first, end
    while low < high:
        middle = (low + high) // 2
        if rows[middle, pt.VERTEX] < vertex:
            low = middle + 1
        else:
            high = middle
    return low if low < end and rows[low, pt.VERTEX] == vertex else -1


@njit(cache=True, error_model="numpy")
def label_patches(rows, first, end, offset, triangles):
    """Number the vertices in contact so that those joined by triangles have one number.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
    first, end : int
        Rows of one solid.
    offset : int
        What its numbers of vertices begin with there.
    triangles : ndarray of int, shape (3 triangles,)
    """
    changed = True
    for _ in range(end - first):
        if not changed:
            return
        changed = False
        for k in range(0, triangles.size, 3):
            least = np.inf
            for q in range(3):
                at = row_of(rows, first, end, offset + triangles[k + q])
                if at >= 0:
                    least = min(least, rows[at, pt.POOL])
            for q in range(3):
                at = row_of(rows, first, end, offset + triangles[k + q])
                if at >= 0 and rows[at, pt.POOL] > least:
                    rows[at, pt.POOL] = least
                    changed = True


@njit(cache=True, error_model="numpy")
def join_patches(rows, count):
    """Give the points of the second solid the patch of the nearest of the first."""
    for v in range(count):
        best = np.inf
        for u in range(count):
            if rows[v, pt.SWAPPED] == 0.0 or rows[u, pt.SWAPPED] != 0.0:
                continue
            square = 0.0
            for q in range(3):
                square += (rows[u, pt.PLACE + q] - rows[v, pt.PLACE + q]) ** 2
            if square < best:
                best, rows[v, pt.POOL] = square, rows[u, pt.POOL]


@njit(cache=True, error_model="numpy")
def patches_in(rows, count):
    """Return how many patches the points belong to."""
    patches = 0
    for k in range(count):
        first = rows[k, pt.POOL] >= 0.0
        for m in range(k):
            first = first and rows[m, pt.POOL] != rows[k, pt.POOL]
        patches += first
    return patches
