"""Triangle meshes of solids: what is drawn in three dimensions and written to files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.kernels.jit import njit

if TYPE_CHECKING:
    from gearmbs.mechanism.parts.bodies import Body


@dataclass(frozen=True)
class Mesh:
    """A closed surface of triangles, anticlockwise seen from outside.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        m.
    triangles : ndarray of int, shape (k, 3)
        Vertex numbers.
    """

    vertices: np.ndarray
    triangles: np.ndarray

    @property
    def corners(self) -> np.ndarray:
        """Corner points of every triangle, shape (k, 3, 3), m."""
        return self.vertices[self.triangles]

    @property
    def normals(self) -> np.ndarray:
        """Outward unit normals, shape (k, 3); zero for a triangle without area."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        cross = np.cross(b - a, c - a)
        size = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.divide(cross, size, out=np.zeros_like(cross), where=size > 0.0)

    @property
    def volume(self) -> float:
        """Enclosed volume, m^3, by the divergence theorem."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    @property
    def watertight(self) -> bool:
        """Whether every edge belongs to exactly two triangles that run it in opposite directions."""
        t = self.triangles.astype(np.int64)
        if (t[:, [0, 1, 2]] == t[:, [1, 2, 0]]).any():
            return False
        size = len(self.vertices)
        ways = np.concatenate([t[:, i] * size + t[:, (i + 1) % 3] for i in range(3)])
        back = np.concatenate([t[:, (i + 1) % 3] * size + t[:, i] for i in range(3)])
        return np.unique(ways).size == ways.size and np.array_equal(np.sort(ways), np.sort(back))

    def placed(self, origin: np.ndarray, axes: np.ndarray) -> Mesh:
        """Return the mesh moved into a frame (origin, m; axes as columns)."""
        return Mesh(self.vertices @ np.asarray(axes).T + origin, self.triangles)


def joined(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + s for m, s in zip(meshes, starts)]),
    )


def cylinder(radius: float, length: float, sides: int = 48) -> Mesh:
    """Return a cylinder about z, centred on the origin, m."""
    angle = 2.0 * math.pi * np.arange(sides) / sides
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, -0.5 * length)])
    top = ring + [0.0, 0.0, length]
    k = np.arange(sides)
    n = (k + 1) % sides
    bottom_centre, top_centre = 2 * sides, 2 * sides + 1
    triangles = np.concatenate(
        [
            np.column_stack([k, n, n + sides]),
            np.column_stack([k, n + sides, k + sides]),
            np.column_stack([n, k, np.full(sides, bottom_centre)]),
            np.column_stack([k + sides, n + sides, np.full(sides, top_centre)]),
        ]
    )
    centres = [[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]]
    return Mesh(np.vstack([ring, top, centres]), triangles)


def box(x: float, y: float, z: float) -> Mesh:
    """Return a box of these edge lengths about the origin, m."""
    signs = np.array([[i, j, k] for k in (-1, 1) for j in (-1, 1) for i in (-1, 1)], dtype=float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Mesh(0.5 * signs * [x, y, z], np.array(triangles))


def ball(radius: float, rings: int = 10) -> Mesh:
    """Return a sphere about the origin, m."""
    sides = 2 * rings
    polar = math.pi * np.arange(1, rings) / rings
    angle = 2.0 * math.pi * np.arange(sides) / sides
    sp, cp = np.sin(polar)[:, None], np.cos(polar)[:, None]
    grid = np.stack([sp * np.cos(angle), sp * np.sin(angle), cp * np.ones(sides)], axis=-1).reshape(-1, 3)
    top, bottom = len(grid), len(grid) + 1
    k = np.arange(sides)
    n = (k + 1) % sides
    last = (rings - 2) * sides
    triangles = [
        np.column_stack([np.full(sides, top), k, n]),
        np.column_stack([k + last, np.full(sides, bottom), n + last]),
    ]
    for row in range(rings - 2):
        a, b = row * sides, (row + 1) * sides
        triangles += [np.column_stack([a + k, b + k, b + n]), np.column_stack([a + k, b + n, a + n])]
    poles = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
    return Mesh(radius * np.vstack([grid, poles]), np.concatenate(triangles))


def rod(start: np.ndarray, stop: np.ndarray, radius: float, sides: int = 16) -> Mesh:
    """Return a round rod between two points, m."""
    start, stop = np.asarray(start, dtype=float), np.asarray(stop, dtype=float)
    axis = stop - start
    length = float(np.linalg.norm(axis))
    if not length > 0.0:
        raise ValueError(f"rod: both ends are at {start}; give two different points")
    z = axis / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return cylinder(radius, length, sides).placed(0.5 * (start + stop), np.column_stack([x, np.cross(z, x), z]))


# The simplest solid that has a rigid body's mass and moments of inertia.


SAME = 1e-6
"""Relative difference of two moments of a body that is taken for round."""
THIN = 0.12
"""Root of the least size drawn of a body, as a share of its largest."""


def body_mesh(body: Body, reach: float = 0.0) -> Mesh | None:
    """Return the cylinder (or ball, or box) that has a body's mass and moments, in the body's frame.

    A body with two equal principal moments becomes a cylinder along the third, any other a box; None without mass or
    moments. Rods of a part ``reach`` of the size of the mechanism lead to its markers.
    """
    pieces: list[Mesh] = []
    moments, axes = np.linalg.eigh(body.inertia)
    if body.mass > 0.0 and moments[-1] > 0.0:
        pieces.append(_equivalent(body.mass, moments, axes).placed(body.com, np.eye(3)))
    hub = body.com if body.mass > 0.0 or not body.markers else body.markers[0].position
    if reach > 0.0:
        for marker in body.markers:
            if np.linalg.norm(marker.position - hub) > 4.0 * reach:
                pieces.append(rod(hub, marker.position, reach))
        if not pieces:
            pieces.append(ball(2.0 * reach).placed(hub, np.eye(3)))
    return joined(pieces) if pieces else None


def _equivalent(mass: float, moments: np.ndarray, axes: np.ndarray) -> Mesh:
    for k in range(3):
        one, two = moments[(k + 1) % 3], moments[(k + 2) % 3]
        if abs(one - two) > SAME * moments[-1]:
            continue
        # a solid cylinder: I_z = m r^2 / 2, I_x = m (3 r^2 + l^2) / 12
        square = 2.0 * moments[k] / mass
        length = 12.0 * 0.5 * (one + two) / mass - 3.0 * square
        if length <= 0.0:
            continue
        length = math.sqrt(length)
        radius = max(math.sqrt(square), 0.5 * THIN * THIN * length)
        frame = np.column_stack([axes[:, (k + 1) % 3], axes[:, (k + 2) % 3], axes[:, k]])
        frame[:, 0] *= np.linalg.det(frame)
        return cylinder(radius, length, 72).placed(np.zeros(3), frame)
    total = moments.sum()
    edges = np.sqrt(np.maximum(6.0 * (total - 2.0 * moments) / mass, 0.0))
    edges = np.maximum(edges, THIN * THIN * edges.max())
    frame = axes * np.array([1.0, 1.0, np.linalg.det(axes)])
    return box(*edges).placed(np.zeros(3), frame)


# Normals and edges that make a triangle mesh look like the solid it stands for.


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
