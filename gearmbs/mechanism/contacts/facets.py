"""Where faceted solids touch: vertices of one below the surface of the other.

Points that bear no load need not be found: those less deep than `BEARING` of the deepest so far. Most vertices are
known to be outside, or less deep, without their distance. They are passed over in blocks whose box is beside that of
the other solid, and where a point nearby is farther from it than from them: a distance changes by no more than its
point moves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts import meshes as pt
from gearmbs.mechanism.contacts.fields import BALL, BOX, ELLIPSOID, FRUSTUM, MESH, TORUS, distance
from gearmbs.mechanism.contacts.meshes import BLOCK, TINY, mesh_distance, to_global

BEARING = 0.8
"""Part of the largest depth below which a vertex bears less than 1e-17 of the load, by the norm in `loads`, whatever
the weights."""
LESS = 1.0 - 1e-9
"""Part of a distance that is certainly clear of a surface."""


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
            # the box about b's box in a's frame: its middle, and the sum of its half edges' shares along each axis
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
    # all vertices are within the ball about the block's box
    radius = np.sqrt(square)
    brought(move, middle, local)
    if within(local, anchor, radius - floor):
        return True
    phi = from_solid(solid, local, work[6:9], work[9:18], work[18:32])
    if phi > 0.0:
        for q in range(3):
            anchor[q] = local[q]
        anchor[3] = phi
    # a distance changes by no more than its point moves, at most the radius
    return (phi + floor) * LESS > radius


@njit(cache=True, error_model="numpy", forceinline=True)
def within(x, anchor, radius):
    """Return whether a ball about x is within the ball about the anchor that holds nothing of the solid."""
    # the ball about the anchor with its distance holds nothing of the solid
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
    # the origin of a is farther from b than a reaches
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
            # less deep than what bears, of the deepest so far
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
                # half-way between the vertex and the surface
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


# Tables of faceted solids: vertices with weights and triangles, sorted into blocks with boxes about them.


FLAT = 1e-6
"""Angle, rad, below which two triangles lie in one plane."""
SHARP = 0.05
"""Angle, rad, between the normals of two triangles from which on their edge is one: 48 segments around meet at 0.13."""
ROUND = 0.6
"""Angle, rad, between the normals of two triangles up to which they stand for a round surface: ten or more around."""
LEAST = 1e-12
"""Least weight of a vertex over the largest: one at the end of slivers alone would divide nothing by nothing."""


def normals_of(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the outward unit normals of triangles, shape (m, 3); zero of those without an area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.maximum(np.linalg.norm(normals, axis=1), TINY)[:, None]


def neighbours(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return edges, shape (n, 2), and of each the two triangles that it joins."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    order = np.lexsort(edges.T)
    one, other = order[:-1], order[1:]
    shared = np.all(edges[one] == edges[other], axis=1)
    return edges[one[shared]], one[shared] % len(triangles), other[shared] % len(triangles)


def plane_faces(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the number of the plane face to which each triangle belongs."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    normals = normals_of(vertices, triangles)
    _, one, other = neighbours(triangles)
    bent = np.linalg.norm(np.cross(normals[one], normals[other]), axis=1)
    flat = (bent < FLAT) & (np.sum(normals[one] * normals[other], axis=1) > 0.0)
    joined = coo_array((np.ones(flat.sum()), (one[flat], other[flat])), shape=(len(triangles),) * 2)
    return connected_components(joined, directed=False)[1]


def sagitta(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Return by how much triangles leave the round surface they stand for, m; 0 of a solid of plane faces.

    Between two of the width w that meet at the angle a, w/2 tan(a/4): r (1 - cos(pi/n)) of n around the radius r.
    """
    edges, one, other = neighbours(triangles)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    normals = normals_of(vertices, triangles)
    sine = np.linalg.norm(np.cross(normals[one], normals[other]), axis=1)
    bent = np.arctan2(sine, np.sum(normals[one] * normals[other], axis=1))
    length = np.maximum(np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1), TINY)
    width = np.minimum(doubled[one], doubled[other]) / length
    met = (bent > FLAT) & (bent < ROUND)
    return float(np.max(0.5 * width * np.tan(0.25 * bent), initial=0.0, where=met))


def vertex_weights(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the weight of each vertex: of the triangles around it, the area times the angle there.

    The corners of a rectangle so have the same weight whichever way its diagonal runs. Those of the plane face in which
    they are largest sum to 1. A point without triangles has the weight 1.
    """
    if not len(triangles):
        return np.ones(len(vertices))
    weights = np.zeros(len(vertices))
    for k in range(3):
        here, ahead, behind = (vertices[triangles[:, (k + q) % 3]] for q in range(3))
        one, other = ahead - here, behind - here
        area = np.linalg.norm(np.cross(one, other), axis=1)
        np.add.at(weights, triangles[:, k], area * np.arctan2(area, np.sum(one * other, axis=1)))
    weights = np.maximum(weights, LEAST * weights.max())
    corners = np.unique(plane_faces(vertices, triangles)[:, None] * len(vertices) + triangles)
    return weights / np.bincount(corners // len(vertices), weights[corners % len(vertices)]).max()


def in_blocks(points: np.ndarray) -> np.ndarray:
    """Return an order of points in which neighbours are neighbours in space.

    Each half is halved again across its longest side, down to the size of a block.
    """
    groups, order = [np.arange(len(points))], [np.arange(0)]
    while groups:
        group = groups.pop()
        if len(group) <= BLOCK:
            order.append(group)
            continue
        axis = int(np.argmax(np.ptp(points[group], axis=0)))
        group = group[np.argsort(points[group, axis], kind="stable")]
        half = BLOCK * max(1, round(len(group) / 2 / BLOCK))
        groups += [group[half:], group[:half]]
    return np.concatenate(order)


def boxes_of(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the lowest and the highest coordinates of each block, shape (blocks, 6)."""
    starts = np.arange(0, len(low), BLOCK)
    if not len(starts):
        return np.zeros((0, 6))
    return np.hstack([np.minimum.reduceat(low, starts), np.maximum.reduceat(high, starts)])


def outer_edges(vertices: np.ndarray, triangles: np.ndarray, longer: float) -> np.ndarray:
    """Return vertices and plane faces of edges, longer than a length, m, that stand out of a solid, shape (n, 4)."""
    if not len(triangles):
        return np.zeros((0, 4), dtype=np.int64)
    normals, faces = normals_of(vertices, triangles), plane_faces(vertices, triangles)
    edges, one, other = neighbours(triangles)
    bent = np.arctan2(
        np.linalg.norm(np.cross(normals[one], normals[other]), axis=1), np.sum(normals[one] * normals[other], axis=1)
    )
    tip = vertices[triangles[other].sum(axis=1) - edges.sum(axis=1)]
    outer = np.sum((tip - vertices[edges[:, 0]]) * normals[one], axis=1) < 0.0
    kept = outer & (bent > SHARP) & (np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1) > longer)
    return np.column_stack([edges, faces[one], faces[other]])[kept]


@dataclass(frozen=True)
class Facets:
    """A solid's vertices and triangles, in the order of their blocks, with the boxes of these.

    Attributes
    ----------
    vertices, weights : ndarray, shape (n, 3), (n,)
    triangles : ndarray of int, shape (m, 3)
    boxes : tuple of ndarray, each of shape (blocks, 6)
        Of vertices, of triangles, and of the latter's boxes.
    edges : ndarray of int, shape (edges, 4)
        Both vertices and both plane faces of each edge that stands out.
    """

    vertices: np.ndarray
    weights: np.ndarray
    triangles: np.ndarray
    boxes: tuple[np.ndarray, ...]
    edges: np.ndarray

    @classmethod
    def of(cls, vertices: np.ndarray, triangles: np.ndarray, longer: float) -> Facets:
        """Sort a solid's vertices and triangles; edges are those longer than a length, m."""
        order = in_blocks(vertices)
        number = np.zeros(len(vertices), dtype=np.int64)
        number[order] = np.arange(len(vertices))
        vertices, triangles = vertices[order], number[triangles]
        triangles = triangles[in_blocks(vertices[triangles].mean(axis=1))]
        corners = vertices[triangles]
        of_triangles = boxes_of(corners.min(axis=1), corners.max(axis=1))
        boxes = boxes_of(vertices, vertices), of_triangles, boxes_of(of_triangles[:, :3], of_triangles[:, 3:])
        edges = outer_edges(vertices, triangles, longer)
        return cls(vertices, vertex_weights(vertices, triangles), triangles, boxes, edges)

    def reals(self) -> np.ndarray:
        """Return their part of the table."""
        return np.concatenate([self.vertices.ravel(), self.weights, *(boxes.ravel() for boxes in self.boxes)])


# Patches of faceted solids: vertices in contact that a triangle of their own mesh joins.
#
# Points of the second solid join the patch of the point of the first that is next to them.


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
