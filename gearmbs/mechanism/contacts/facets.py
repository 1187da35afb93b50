"""Where faceted solids touch: vertices of one below the surface of the other.

Points that bear no load need not be found: those less deep than `BEARING` of the deepest so far. Most vertices are
known to be outside, or less deep, without their distance. They are passed over in blocks whose box is beside that of
the other solid, and where a point nearby is farther from it than from them: a distance changes by no more than its
point moves.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.mechanism.contacts import points as pt
from gearmbs.mechanism.contacts.fields import BALL, BOX, ELLIPSOID, FRUSTUM, MESH, TORUS, distance
from gearmbs.mechanism.contacts.meshes import BLOCK, mesh_distance
from gearmbs.mechanism.contacts.points import to_global

BEARING = 0.8
"""Part of the largest depth below which a vertex bears less than 1e-17 of the load, by the norm in `loads`, whatever
the weights."""
LESS = 1.0 - 1e-9
"""Of a distance, what certainly is clear of a surface."""


@njit(cache=True, error_model="numpy")
def half_lengths(kind, sizes, out):
    """Write half the edges of the box about a solid, in its frame."""
    for q in range(3):
        if kind == MESH or kind == BOX or kind == ELLIPSOID:
            out[q] = sizes[q]
        elif kind == BALL:
            out[q] = sizes[0]
        elif kind == FRUSTUM:
            out[q] = sizes[2] if q == 2 else max(sizes[0], sizes[1])
        elif kind == TORUS:
            out[q] = sizes[1] if q == 2 else sizes[0] + sizes[1]
        else:
            out[q] = 1e150


@njit(cache=True, error_model="numpy")
def seen_from(pose_a, pose_b, half, out):
    """Write how a point of a's frame is turned and moved into b's, and in a's frame the box about b.

    Parameters
    ----------
    pose_a, pose_b : ndarray, shape (12,)
        Axes and origins.
    half : ndarray, shape (3,)
        Half the edges of the box of b in its own frame.
    out : ndarray, shape (18,)
        Turn (9), shift (3), lowest and highest coordinates (6).
    """
    for r in range(3):
        out[9 + r] = 0.0
        for q in range(3):
            out[9 + r] += pose_b[3 * q + r] * (pose_a[9 + q] - pose_b[9 + q])
        for c in range(3):
            out[3 * r + c] = 0.0
            for q in range(3):
                out[3 * r + c] += pose_b[3 * q + r] * pose_a[3 * q + c]
    for c in range(3):
        middle = reach = 0.0
        for r in range(3):
            middle -= out[3 * r + c] * out[9 + r]
            reach += abs(out[3 * r + c]) * half[r]
        reach *= 1.0 + 1e-9
        out[12 + c], out[15 + c] = middle - reach, middle + reach


@njit(cache=True, error_model="numpy", forceinline=True)
def brought(move, x, out):
    """Write a point of a's frame in b's."""
    for r in range(3):
        out[r] = move[3 * r] * x[0] + move[3 * r + 1] * x[1] + move[3 * r + 2] * x[2] + move[9 + r]


@njit(cache=True, error_model="numpy")
def from_solid(solid, x, grad, hess, work):
    """Return the signed distance of a point of a solid's frame from it; write gradient and Hessian."""
    if solid[0] == MESH:
        return mesh_distance(x, solid[3], solid[5], solid[7], solid[8], grad, hess, work)
    return distance(solid[0], solid[1], x, grad, hess)


@njit(cache=True, error_model="numpy")
def block_clear(solid, block, move, anchor, floor, work):
    """Return whether all of a block of vertices is less than ``floor`` below the solid whose place ``move`` is.

    Parameters
    ----------
    solid : tuple
        The other solid, as in `vertices_below`.
    block : ndarray, shape (6,)
        Box of the vertices.
    move : ndarray, shape (18,)
    anchor : ndarray, shape (4,)
        In and out: a point and how far it is outside.
    floor : float
        Depth, m, below which a point bears nothing; 0 if all below the surface are asked for.
    work : ndarray, shape (35,)
    """
    for q in range(3):
        if block[q] > move[15 + q] or block[3 + q] < move[12 + q]:
            return True
    middle, local = work[0:3], work[3:6]
    square = 0.0
    for q in range(3):
        middle[q] = 0.5 * (block[q] + block[3 + q])
        square += (block[3 + q] - middle[q]) ** 2
    radius = np.sqrt(square)
    brought(move, middle, local)
    if within(local, anchor, radius - floor):
        return True
    phi = from_solid(solid, local, work[6:9], work[9:18], work[18:32])
    if phi > 0.0:
        for q in range(3):
            anchor[q] = local[q]
        anchor[3] = phi
    return (phi + floor) * LESS > radius


@njit(cache=True, error_model="numpy", forceinline=True)
def within(x, anchor, radius):
    """Return whether a ball about x is within the ball about the anchor that holds nothing of the solid."""
    left = anchor[3] * LESS - radius
    if left <= 0.0:
        return False
    return (x[0] - anchor[0]) ** 2 + (x[1] - anchor[1]) ** 2 + (x[2] - anchor[2]) ** 2 < left * left


@njit(cache=True, error_model="numpy")
def vertices_below(rows, count, first, swapped, solid_a, solid_b, bearing, work):
    """Write the vertices of solid a that lie below the surface of solid b; return how many rows there are then.

    Parameters
    ----------
    rows : ndarray, shape (points, COLUMNS)
        Out, from row ``count`` on, in the order of the vertices.
    count, first, swapped : int
        Rows that are there, what to add to numbers of vertices.
    solid_a, solid_b : tuple
        Kind, sizes, pose, vertices, weights, triangles, boxes of vertices, of triangles, and of these of each.
    bearing : float
        Part of the largest depth of all rows below which points may be left out; 0 for none.
    work : ndarray, shape (75,)
    """
    pose_a, places, weights, boxes = solid_a[2], solid_a[3], solid_a[4], solid_a[6]
    pose_b = solid_b[2]
    local, grad, hess, anchor = work[35:38], work[38:41], work[41:50], work[50:54]
    half, move = work[54:57], work[57:75]
    half_lengths(solid_b[0], solid_b[1], half)
    seen_from(pose_a, pose_b, half, move)
    anchor[3] = from_solid(solid_b, move[9:12], grad, hess, work[0:14])
    if anchor[3] * LESS > solid_a[1][3]:
        return count
    for q in range(3):
        anchor[q] = move[9 + q]
    floor = bearing * largest_depth(rows, count)
    for block in range(boxes.size // 6):
        if block_clear(solid_b, boxes[6 * block : 6 * block + 6], move, anchor, floor, work[0:35]):
            continue
        for v in range(BLOCK * block, min(BLOCK * (block + 1), weights.size)):
            brought(move, places[3 * v : 3 * v + 3], local)
            if abs(local[0]) > half[0] or abs(local[1]) > half[1] or abs(local[2]) > half[2]:
                continue
            if within(local, anchor, -floor):
                continue
            phi = from_solid(solid_b, local, grad, hess, work[0:14])
            if phi >= 0.0:
                for q in range(3):
                    anchor[q] = local[q]
                anchor[3] = phi
                continue
            if -phi < floor:
                continue
            floor = max(floor, -bearing * phi)
            row = rows[count]
            count += 1
            to_global(pose_a, places[3 * v : 3 * v + 3], row[pt.VERTEX_PLACE : pt.VERTEX_PLACE + 3])
            for q in range(3):
                row[pt.VERTEX_PLACE + q] += pose_a[9 + q]
            to_global(pose_b, grad, row[pt.NORMAL : pt.NORMAL + 3])
            for q in range(9):
                row[pt.HESSIAN + q] = hess[q]
            row[pt.DEPTH] = -phi
            for q in range(3):
                row[pt.PLACE + q] = row[pt.VERTEX_PLACE + q] - 0.5 * phi * row[pt.NORMAL + q]
            row[pt.VERTEX] = row[pt.POOL] = first + v
            row[pt.WEIGHT], row[pt.SWAPPED], row[pt.GAIN] = weights[v], swapped, 1.0
            row[pt.ALONG], row[pt.ALONG + 1], row[pt.ALONG + 2] = 0.0, 0.0, 0.0
    return count


@njit(cache=True, error_model="numpy", forceinline=True)
def largest_depth(rows, count):
    """Return the largest depth of points."""
    deepest = 0.0
    for k in range(count):
        deepest = max(deepest, rows[k, pt.DEPTH])
    return deepest


@njit(cache=True, error_model="numpy")
def without_idle(rows, count):
    """Move the points that bear a load to the first rows; return how many there are."""
    deepest, kept = largest_depth(rows, count), 0
    for k in range(count):
        if rows[k, pt.DEPTH] < BEARING * deepest:
            continue
        if kept < k:
            for q in range(pt.COLUMNS):
                rows[kept, q] = rows[k, q]
        kept += 1
    return kept
