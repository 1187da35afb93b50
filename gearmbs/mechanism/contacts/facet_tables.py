"""Tables of faceted solids: vertices with weights and triangles, sorted into blocks with boxes about them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.mechanism.contacts.meshes import BLOCK, TINY

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
