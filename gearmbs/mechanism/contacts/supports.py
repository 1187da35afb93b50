"""Support functions: how far solids reach in a direction, the point that does, and how it moves with the direction.

Of a solid with the support function h(w), of degree one, the outermost point is y = dh/dw and moves by h_ww dw, at
right angles to w. Edges and flat faces are rounded by EDGE: |w_k| becomes the square root of w_k^2 + EDGE^2 |w|^2, so
that the point moves smoothly from one end of a face to the other within about EDGE radians. The sizes are those of a
solid that is smaller by as much as this adds to its faces (`reduced`), so that the faces stay where they were.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.mechanism.contacts.fields import BALL, BOX, ELLIPSOID, FRUSTUM

EDGE = 1e-4
"""Radians of tilt within which a face's resultant moves from its middle to its edge: below it, tilts of real faces
under load are of the order of penetration over length."""


def reduced(kind: int, sizes: np.ndarray) -> np.ndarray:
    """Return the sizes of a shape whose rounded solid has the faces of the given one.

    Parameters
    ----------
    kind : int
    sizes : ndarray, shape (4,)
        As in the tables; the last, shift of the centre along z, m, is written for a frustum.
    """
    out = np.array(sizes, dtype=float)
    if kind == BOX:
        matrix = np.full((3, 3), EDGE) + (np.sqrt(1.0 + EDGE**2) - EDGE) * np.eye(3)
        out[:3] = np.linalg.solve(matrix, out[:3])
    elif kind == FRUSTUM:
        bottom, top, half = sizes[:3]
        out[:2] = np.maximum(out[:2] - EDGE * half, 0.0)
        out[2] = half - 0.5 * EDGE * (bottom + top)
        out[3] = 0.5 * EDGE * (bottom - top)
    elif kind not in (BALL, ELLIPSOID):
        out[1] = sizes[1] - EDGE * sizes[0]
        out[0] = sizes[0] * (1.0 + EDGE)
    return out


@njit(cache=True, error_model="numpy")
def add_root(d0, d1, d2, factor, w, point, hess):
    """Add factor sqrt(w D w), D diagonal: its gradient to ``point`` and its Hessian to ``hess``."""
    g = (d0 * w[0], d1 * w[1], d2 * w[2])
    d = (d0, d1, d2)
    root = np.sqrt(max(g[0] * w[0] + g[1] * w[1] + g[2] * w[2], 1e-300))
    for q in range(3):
        point[q] += factor * g[q] / root
        for p in range(3):
            hess[3 * q + p] += factor * ((d[q] if q == p else 0.0) - g[q] * g[p] / root**2) / root


@njit(cache=True, error_model="numpy")
def support(kind, sizes, w, point, hess):
    """Write the outermost point in the direction w, a unit vector of the shape's frame, and dpoint/dw (9)."""
    square = EDGE * EDGE
    for q in range(3):
        point[q] = 0.0
    for q in range(9):
        hess[q] = 0.0
    if kind == BALL:
        add_root(1.0, 1.0, 1.0, sizes[0], w, point, hess)
    elif kind == ELLIPSOID:
        add_root(sizes[0] ** 2, sizes[1] ** 2, sizes[2] ** 2, 1.0, w, point, hess)
    elif kind == BOX:
        add_root(1.0 + square, square, square, sizes[0], w, point, hess)
        add_root(square, 1.0 + square, square, sizes[1], w, point, hess)
        add_root(square, square, 1.0 + square, sizes[2], w, point, hess)
    elif kind == FRUSTUM:
        _frustum(sizes, w, point, hess)
    else:
        add_root(1.0 + square, 1.0 + square, square, sizes[0], w, point, hess)
        add_root(1.0, 1.0, 1.0, sizes[1], w, point, hess)


@njit(cache=True, error_model="numpy")
def _frustum(sizes, w, point, hess):
    """The larger of the reaches of both rims, smoothly: half their sum and half the root of their difference squared.

    With s the rounded radial part of w: difference G = 2 half w_z + (top - bottom) s, c = 2 EDGE half |w|, root
    m = sqrt(G^2 + c^2).
    """
    bottom, top, half = sizes[0], sizes[1], sizes[2]
    square = EDGE * EDGE
    s = np.zeros(3)
    ss = np.zeros(9)
    add_root(1.0 + square, 1.0 + square, square, 1.0, w, s, ss)
    reach = s[0] * w[0] + s[1] * w[1] + s[2] * w[2]
    difference = 2.0 * half * w[2] + (top - bottom) * reach
    c = 4.0 * square * half * half
    root = np.sqrt(difference**2 + c * (w[0] ** 2 + w[1] ** 2 + w[2] ** 2))
    g = np.empty(3)
    m = np.empty(3)
    for q in range(3):
        g[q] = (top - bottom) * s[q] + (2.0 * half if q == 2 else 0.0)
        m[q] = (difference * g[q] + c * w[q]) / root
    for q in range(3):
        point[q] = 0.5 * ((bottom + top) * s[q] + m[q])
        for p in range(3):
            second = g[q] * g[p] + difference * (top - bottom) * ss[3 * q + p] + (c if q == p else 0.0) - m[q] * m[p]
            hess[3 * q + p] = 0.5 * ((bottom + top) * ss[3 * q + p] + second / root)
    point[2] += sizes[3]
