"""A solid body as a closed surface of triangles."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.solids.bodies import Body, Face
from gearmbs.solids.faces import Crossed, cut

TOLERANCE = 1e-3
"""Default chord tolerance over the diagonal of the body's box."""
FINER = 8.0
"""By what the tolerance of edges whose chains cross is divided."""
FINEST = 3
"""Times that this is done for a face."""
TRIES = 30
"""Times that a body is cut."""


def faceted(body: Body, tolerance: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Cut a body's surface into triangles.

    Parameters
    ----------
    body : Body
    tolerance : float, optional
        Largest distance between an edge of a triangle and the curve or surface that it stands for, m; else
        `TOLERANCE` of the body's diagonal.

    Returns
    -------
    vertices : ndarray, shape (n, 3)
        m.
    triangles : ndarray of int, shape (m, 3)
        Anticlockwise seen from outside; every edge belongs to two, which run along it in opposite directions.

    Raises
    ------
    ModelError
        If it has geometry that is not read, or its faces do not close.
    """
    if tolerance is None:
        tolerance = TOLERANCE * float(np.linalg.norm(np.ptp(body.corners, axis=0)))
    finer: dict[int, float] = {}
    for _ in range(TRIES):
        try:
            vertices, triangles = _attempt(body, tolerance, finer)
            break
        except _CrossedFace as crossed:
            # arcs that come closer to each other than the tolerance cross as chains: these edges are cut finer
            edges = {e for loop in crossed.face.loops for e, _ in loop}
            finest = min(finer.get(edge, tolerance) for edge in edges) / FINER
            if finest < tolerance / FINER**FINEST:
                raise ModelError(f"{crossed}; save the solid as .stl") from None
            finer |= dict.fromkeys(edges, finest)
            why = str(crossed)
    else:
        raise ModelError(f"{why}; save the solid as .stl")
    check_closed(body.name, triangles)
    return vertices, triangles


class _CrossedFace(Exception):
    def __init__(self, face: Face, message: str) -> None:
        super().__init__(message)
        self.face = face


def _attempt(body: Body, tolerance: float, finer: dict[int, float]) -> tuple[np.ndarray, np.ndarray]:
    points = _Points()
    chains: dict[int, np.ndarray] = {}
    for edge in sorted({edge for face in body.faces for loop in face.loops for edge, _ in loop}):
        chains[edge] = points.chain(body.edge_points(edge, finer.get(edge, tolerance)))
    places = points.array()
    triangles, added, total = [], [places], len(places)
    for face in body.faces:
        loops = [
            np.concatenate([chains[e][:-1] if forward else chains[e][:0:-1] for e, forward in loop])
            for loop in face.loops
        ]
        try:
            more, found = cut(face.surface, face.outward, loops, places, tolerance)
        except Crossed as error:
            raise _CrossedFace(face, f"face {face.number} of body '{body.name}': {error}") from None
        except ModelError as error:
            raise ModelError(f"face {face.number} of body '{body.name}': {error}") from None
        triangles.append(np.where(found >= len(places), found + total - len(places), found))
        added.append(more)
        total += len(more)
    return np.vstack(added), np.vstack(triangles)


class _Points:
    """Points of edges; ends that coincide are one."""

    def __init__(self) -> None:
        self.places: list[np.ndarray] = []
        self._of: dict[tuple[int, ...], int] = {}

    def chain(self, places: np.ndarray) -> np.ndarray:
        inner = [self._new(p) for p in places[1:-1]]
        return np.array([self._end(places[0]), *inner, self._end(places[-1])])

    def _new(self, place: np.ndarray) -> int:
        self.places.append(place)
        return len(self.places) - 1

    def _end(self, place: np.ndarray) -> int:
        key = tuple(np.round(place / 1e-9).astype(np.int64).tolist())
        if key not in self._of:
            self._of[key] = self._new(place)
        return self._of[key]

    def array(self) -> np.ndarray:
        return np.array(self.places).reshape(-1, 3)


def check_closed(name: str, triangles: np.ndarray) -> None:
    """Check that every edge runs once in each direction.

    Raises
    ------
    ModelError
    """
    edges = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    size = int(triangles.max()) + 1
    there, uses = np.unique(edges[:, 0] * size + edges[:, 1], return_counts=True)
    back = np.unique(edges[:, 1] * size + edges[:, 0])
    open_edges = len(np.setxor1d(there, back, assume_unique=True)) + int(np.sum(uses - 1))
    if open_edges:
        raise ModelError(f"body '{name}': {open_edges} edges of its facets do not close; save the solid as .stl")
