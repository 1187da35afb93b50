"""The surface of a body that deforms: what is drawn of it, and how each of its points moves by the modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

SIDES = 32
"""Of the prism that is drawn for a round shaft."""


@dataclass(frozen=True, eq=False)
class BodySurface:
    """Triangles of the surface, anticlockwise seen from outside, and the shapes there.

    Attributes
    ----------
    vertices : ndarray, shape (V, 3)
        m, in the frame of the nodes.
    triangles : ndarray of int, shape (k, 3)
    moved : ndarray, shape (n, V, 3)
        Displacement by one unit of each mode.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    moved: np.ndarray


def revolved_surface(
    outline: np.ndarray, stations: np.ndarray, section_motion: Callable[[float], tuple[np.ndarray, np.ndarray]]
) -> BodySurface:
    """Return a body of revolution about z; each of its sections moves and turns as a rigid disc.

    Parameters
    ----------
    outline : ndarray, shape (k, 2)
        Rows of z and radius, m.
    stations : ndarray
        Where the nodes are, m.
    section_motion : callable
        From z to displacements and rotations there by one unit of each mode, each (n, 3).
    """
    ends = stations[[0, -1]]
    rings = _with_stations(outline, stations)
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(SIDES)])
    vertices, moved = [], []
    for z, radius in [(rings[0, 0], 0.0), *rings, (rings[-1, 0], 0.0)]:
        at = float(np.clip(z, *ends))
        shift, turn = section_motion(at)
        arms = radius * (around if radius > 0.0 else around[:1]) + [0.0, 0.0, z - at]
        vertices.append(arms + [0.0, 0.0, at])
        moved.append(shift[:, None] + np.cross(turn[:, None], arms[None]))
    starts = np.cumsum([0, *(len(v) for v in vertices)])
    k = np.arange(SIDES)
    n = (k + 1) % SIDES
    triangles = [np.column_stack([np.zeros(SIDES, dtype=int), 1 + n, 1 + k])]
    for a, b in pairwise(starts[1:-2]):
        triangles += [np.column_stack([a + k, a + n, b + n]), np.column_stack([a + k, b + n, b + k])]
    last, tip = starts[-3], starts[-2]
    triangles.append(np.column_stack([np.full(SIDES, tip), last + k, last + n]))
    return BodySurface(np.concatenate(vertices), np.concatenate(triangles), np.concatenate(moved, axis=1))


def _with_stations(outline: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Return the outline, rows of z and radius, with rings at the nodes between its points."""
    rows = [outline[0]]
    for (z0, r0), (z1, r1) in pairwise(outline):
        inside = stations[(stations > z0 + 1e-9) & (stations < z1 - 1e-9)]
        rows += [np.array([z, r0 + (r1 - r0) * (z - z0) / (z1 - z0)]) for z in inside]
        rows.append(np.array([z1, r1]))
    return np.array(rows)


def outline_of(pieces: Sequence[tuple[float, float, float, float]]) -> np.ndarray:
    """Return the outline of cylinders and cones on one axis, rows of z and radius, m; steps have two rows at one place.

    Parameters
    ----------
    pieces : sequence of (float, float, float, float)
        Beginning and end, and the radii there, m; where they overlap the wider counts.
    """
    places = np.unique([p[:2] for p in pieces])
    rows: list[tuple[float, float]] = []
    for a, b in pairwise(places):
        if b - a < 1e-9 * np.ptp(places):
            continue
        here = [p for p in pieces if p[0] <= 0.5 * (a + b) <= p[1]]
        for z in (a, b):
            row = (z, max(p[2] + (p[3] - p[2]) * (z - p[0]) / (p[1] - p[0]) for p in here))
            if not rows or rows[-1] != row:
                rows.append(row)
    return np.array(rows)


def faceted_surface(positions: np.ndarray, faces: np.ndarray, moved: np.ndarray) -> BodySurface:
    """Return the surface of facets with three or four corners, rows of nodes."""
    triangles = outward(positions, triangulated(faces))
    used, numbers = np.unique(triangles, return_inverse=True)
    return BodySurface(positions[used], numbers.reshape(-1, 3), moved[:, used])


def triangulated(faces: np.ndarray) -> np.ndarray:
    """Return triangles of facets with three or four corners, shape (k, 3)."""
    faces = np.asarray(faces)
    if faces.shape[1] == 3:
        return faces
    three = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return three[(three[:, 0] != three[:, 1]) & (three[:, 1] != three[:, 2]) & (three[:, 2] != three[:, 0])]


def outward(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return triangles turned so that neighbours agree, and that each closed part encloses a positive volume."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    t = np.array(triangles)
    ways = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    owner = np.tile(np.arange(len(t)), 3)
    forward = ways[:, 0] < ways[:, 1]
    edges = np.sort(ways, axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    same = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    one, two = order[same], order[same + 1]
    # 2: the two run their edge alike, so that one of them has to be turned; 1: they agree
    link = np.where(forward[one] == forward[two], 2, 1)
    graph = sp.coo_array((link, (owner[one], owner[two])), shape=(len(t), len(t))).tocsr()
    graph = graph.maximum(graph.T).tocsr()
    count, part = connected_components(graph, directed=False)
    turned = np.zeros(len(t), dtype=bool)
    for k in range(count):
        members = np.flatnonzero(part == k)
        visited, before = breadth_first_order(graph, members[0], directed=False)
        for i in visited[1:]:
            turned[i] = turned[before[i]] ^ (graph[before[i], i] == 2)
    t[turned] = t[turned][:, ::-1]
    a, b, c = np.moveaxis(vertices[t] - vertices.mean(axis=0), 1, 0)
    volume = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c)), minlength=count)
    inside_out = volume[part] < 0.0
    t[inside_out] = t[inside_out][:, ::-1]
    return t


def hull_surface(positions: np.ndarray, moved: np.ndarray) -> BodySurface | None:
    """Return the convex hull of the nodes, None if they span no volume."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        found = ConvexHull(positions)
    except (QhullError, ValueError):
        return None
    return faceted_surface(positions, found.simplices, moved)
