"""Normals and edges that make a triangle mesh look like the solid it stands for."""

from __future__ import annotations

import math

import numpy as np

from gearmbs._jit import njit
from gearmbs.view.mesh import Mesh

CREASE = math.cos(math.radians(28.0))
"""Triangles that meet at a flatter angle than this are shaded as one smooth surface."""


def corner_normals(mesh: Mesh) -> np.ndarray:
    """Return a unit normal for each corner of each triangle, shape (k, 3, 3), smooth but for sharp edges."""
    triangles = mesh.triangles.astype(np.int64)
    flat = mesh.normals
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    order = np.argsort(triangles.ravel(), kind="stable")
    starts = np.searchsorted(triangles.ravel()[order], np.arange(len(mesh.vertices) + 1))
    return _corner_normals(triangles, flat, area, order // 3, starts)


def feature_edges(mesh: Mesh) -> np.ndarray:
    """Return the end points of the sharp edges, shape (n, 2, 3), m."""
    return mesh.vertices[feature_ends(mesh)]


def feature_ends(mesh: Mesh) -> np.ndarray:
    """Return the vertex numbers of the sharp edges, shape (n, 2)."""
    t = mesh.triangles.astype(np.int64)
    ends = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(t)), 3)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, owner = ends[order], owner[order]
    same = (ends[1:] == ends[:-1]).all(axis=1)
    first = np.flatnonzero(same)
    normals = mesh.normals
    sharp = np.einsum("ij,ij->i", normals[owner[first]], normals[owner[first + 1]]) < CREASE
    return ends[first[sharp]]


@njit(cache=True)
def _corner_normals(triangles, flat, area, incident, starts):
    out = np.zeros((triangles.shape[0], 3, 3))
    for k in range(triangles.shape[0]):
        for c in range(3):
            v = triangles[k, c]
            x, y, z = 0.0, 0.0, 0.0
            for s in range(starts[v], starts[v + 1]):
                o = incident[s]
                dot = flat[k, 0] * flat[o, 0] + flat[k, 1] * flat[o, 1] + flat[k, 2] * flat[o, 2]
                if dot > CREASE:
                    x += area[o] * flat[o, 0]
                    y += area[o] * flat[o, 1]
                    z += area[o] * flat[o, 2]
            size = np.sqrt(x * x + y * y + z * z)
            if size > 0.0:
                out[k, c, 0] = x / size
                out[k, c, 1] = y / size
                out[k, c, 2] = z / size
            else:
                out[k, c] = flat[k]
    return out
