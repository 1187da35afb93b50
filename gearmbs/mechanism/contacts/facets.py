"""Where faceted solids touch: vertices of one below the surface of the other, grouped into patches.

Vertices in contact that a triangle of their own mesh joins belong to one patch. Vertices of the other solid join the
patch of the vertex next to them.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.mechanism.contacts import points as pt
from gearmbs.mechanism.contacts.fields import MESH, distance
from gearmbs.mechanism.contacts.points import dot, local_point, to_global
from gearmbs.mechanism.contacts.smooth_pairs import by_distance

FACE, EDGE, CORNER = 0, 1, 2
TINY = 1e-300
BLOCK = 16
"""Triangles that share a box; those next to each other in the table are next to each other in space."""
APART = -1.0
"""Pool of a vertex that is not in contact."""


@njit(cache=True, error_model="numpy")
def nearest_of_triangle(x, a, b, c, out):
    """Write the nearest point of a triangle; return on which feature it lies."""
    d1 = d2 = d3 = d4 = d5 = d6 = 0.0
    for q in range(3):
        ab, ac = b[q] - a[q], c[q] - a[q]
        d1 += ab * (x[q] - a[q])
        d2 += ac * (x[q] - a[q])
        d3 += ab * (x[q] - b[q])
        d4 += ac * (x[q] - b[q])
        d5 += ab * (x[q] - c[q])
        d6 += ac * (x[q] - c[q])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    feature = FACE
    if d1 <= 0.0 and d2 <= 0.0:
        v, w, feature = 0.0, 0.0, CORNER
    elif d3 >= 0.0 and d4 <= d3:
        v, w, feature = 1.0, 0.0, CORNER
    elif d6 >= 0.0 and d5 <= d6:
        v, w, feature = 0.0, 1.0, CORNER
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w, feature = d1 / max(d1 - d3, TINY), 0.0, EDGE
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w, feature = 0.0, d2 / max(d2 - d6, TINY), EDGE
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / max(d4 - d3 + d5 - d6, TINY)
        v, feature = 1.0 - w, EDGE
    else:
        total = max(va + vb + vc, TINY)
        v, w = vb / total, vc / total
    for q in range(3):
        out[q] = a[q] + v * (b[q] - a[q]) + w * (c[q] - a[q])
    return feature


@njit(cache=True, error_model="numpy", forceinline=True)
def square_to_box(x, boxes, block):
    """Return the square of the distance of a point from the box of a block; 0 within."""
    total = 0.0
    for q in range(3):
        low, high = boxes[6 * block + q], boxes[6 * block + 3 + q]
        off = max(low - x[q], x[q] - high, 0.0)
        total += off * off
    return total


@njit(cache=True, error_model="numpy")
def mesh_distance(x, places, triangles, boxes, grad, hess, work):
    """Return the signed distance from a closed mesh; write gradient and Hessian.

    Of several triangles that are equally near, the one that x is most nearly in front of or behind tells the side.

    Parameters
    ----------
    x : ndarray, shape (3,)
    places : ndarray, shape (3 vertices,)
    triangles : ndarray of int, shape (3 triangles,)
        Corners, anticlockwise seen from outside.
    boxes : ndarray, shape (6 blocks,)
        Lowest and highest coordinates of each `BLOCK` triangles.
    grad, hess : ndarray, shape (3,), (9,)
        Out.
    work : ndarray, shape (9,)
    """
    near, normal, best_point = work[0:3], work[3:6], work[6:9]
    best, straight, feature, side = np.inf, -1.0, FACE, 1.0
    for q in range(9):
        hess[q] = 0.0
    start, least = 0, np.inf
    for block in range(boxes.size // 6):
        square = square_to_box(x, boxes, block)
        if square < least:
            start, least = block, square
    # the nearest box first, so that most others are too far
    for turn in range(-1, boxes.size // 6):
        block = start if turn < 0 else turn
        if turn == start or square_to_box(x, boxes, block) > best * (1.0 + 1e-12):
            continue
        for k in range(3 * BLOCK * block, min(3 * BLOCK * (block + 1), triangles.size), 3):
            a = places[3 * triangles[k] : 3 * triangles[k] + 3]
            b = places[3 * triangles[k + 1] : 3 * triangles[k + 1] + 3]
            c = places[3 * triangles[k + 2] : 3 * triangles[k + 2] + 3]
            kind = nearest_of_triangle(x, a, b, c, near)
            square = (x[0] - near[0]) ** 2 + (x[1] - near[1]) ** 2 + (x[2] - near[2]) ** 2
            if square > best * (1.0 + 1e-12):
                continue
            for q in range(3):
                q1, q2 = (q + 1) % 3, (q + 2) % 3
                normal[q] = (b[q1] - a[q1]) * (c[q2] - a[q2]) - (b[q2] - a[q2]) * (c[q1] - a[q1])
            size = max(np.sqrt(dot(normal, normal)), TINY)
            height = 0.0
            for q in range(3):
                height += normal[q] / size * (x[q] - near[q])
            if square < best * (1.0 - 1e-12) or abs(height) > straight:
                best, straight, feature = min(square, best), abs(height), kind
                for q in range(3):
                    best_point[q] = near[q]
                    grad[q] = normal[q] / size
                side = 1.0 if height >= 0.0 else -1.0
    phi = np.sqrt(best)
    if feature == FACE or phi < 1e-12:
        return side * phi
    for q in range(3):
        grad[q] = side * (x[q] - best_point[q]) / phi
    if feature == CORNER:
        for q in range(3):
            for p in range(3):
                hess[3 * q + p] = ((1.0 if q == p else 0.0) - grad[q] * grad[p]) * side / phi
    return side * phi


@njit(cache=True, error_model="numpy")
def label_patches(rows, first, count, triangles):
    """Number the vertices in contact so that those joined by triangles have one number."""
    changed = True
    for _ in range(count):
        if not changed:
            return
        changed = False
        for k in range(0, triangles.size, 3):
            least = np.inf
            for q in range(3):
                pool = rows[first + triangles[k + q], pt.POOL]
                if pool >= 0.0:
                    least = min(least, pool)
            for q in range(3):
                row = rows[first + triangles[k + q]]
                if row[pt.POOL] > least:
                    row[pt.POOL] = least
                    changed = True


@njit(cache=True, error_model="numpy")
def vertices_below(rows, first, swapped, solid_a, solid_b, origin_a, origin_b, derivatives, work):
    """Write the vertices of solid a that lie below the surface of solid b.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
        Out, from row ``first`` on: one for each vertex of a.
    first, swapped : int
    solid_a, solid_b : tuple
        Kind, sizes, pose, vertices, weights, triangles and their boxes of each.
    origin_a, origin_b : ndarray
        Origins of the markers.
    derivatives : bool
    work : ndarray, shape (48,)
    """
    pose_a, places, weights, triangles = solid_a[2], solid_a[3], solid_a[4], solid_a[5]
    kind, sizes, pose_b = solid_b[0], solid_b[1], solid_b[2]
    x, local, grad, normal, hess = work[12:15], work[15:18], work[18:21], work[21:24], work[24:33]
    touching = False
    for v in range(weights.size):
        row = rows[first + v]
        row[pt.POOL] = APART
        to_global(pose_a, places[3 * v : 3 * v + 3], x)
        for q in range(3):
            x[q] += pose_a[9 + q]
        local_point(pose_b, x, local)
        if kind == MESH:
            if abs(local[0]) > sizes[0] or abs(local[1]) > sizes[1] or abs(local[2]) > sizes[2]:
                continue
            phi = mesh_distance(local, solid_b[3], solid_b[5], solid_b[6], grad, hess, work[33:42])
        else:
            phi = distance(kind, sizes, local, grad, hess)
        if phi >= 0.0:
            continue
        to_global(pose_b, grad, normal)
        by_distance(row, x, 0.0, phi, hess, normal, pose_b, origin_a, origin_b, derivatives, work)
        row[pt.POOL], row[pt.WEIGHT], row[pt.SWAPPED] = first + v, weights[v], swapped
        touching = True
    if touching:
        label_patches(rows, first, weights.size, triangles)


@njit(cache=True, error_model="numpy")
def join_patches(rows, count, total):
    """Give the vertices of the second solid, rows from ``count`` on, the patch of the nearest of the first."""
    for v in range(count, total):
        if rows[v, pt.POOL] < 0.0:
            continue
        best = np.inf
        for u in range(count):
            if rows[u, pt.POOL] < 0.0:
                continue
            square = 0.0
            for q in range(3):
                square += (rows[u, pt.PLACE + q] - rows[v, pt.PLACE + q]) ** 2
            if square < best:
                best, rows[v, pt.POOL] = square, rows[u, pt.POOL]
