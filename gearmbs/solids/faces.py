"""Faces cut into triangles in the parameters of their surfaces.

The loops of a face, as chains of points shared with its neighbours, are the sides of polygons in the plane of u and v;
a constrained Delaunay triangulation fills them, and points are added on its inner edges until these stay within the
tolerance of the surface.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.solids.curves import TURN
from gearmbs.solids.loops import polygons_of
from gearmbs.solids.planes import Flat, FromPoint, free_point
from gearmbs.solids.surfaces import Surface, Turned

ROUNDS = 14
"""Times that points are added."""
KEY = 1_000_000
"""More than the points of a face: makes one number of a pair of them."""
CHUNK = 500
"""Points that are compared with all sides at a time."""
MOST = 200_000
"""Points of a face."""


class Crossed(ModelError):
    """The chains of points of a face's edges cross, as where arcs are closer to each other than to their chords."""


def cut(
    surface: Surface, outward: float, loops: list[np.ndarray], places: np.ndarray, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cut a face into triangles.

    Parameters
    ----------
    surface : Surface
    outward : float
        1 if the normal of the surface points out of the body, else -1.
    loops : list of ndarray of int
        Numbers of the points around each loop, the face on the left seen from outside.
    places : ndarray, shape (n, 3)
        Points of the body's edges, m.
    tolerance : float
        Largest distance of a triangle's edges from the surface, m.

    Returns
    -------
    added : ndarray, shape (k, 3)
        Points inside the face; their numbers go on from n.
    triangles : ndarray of int, shape (m, 3)
        Anticlockwise seen from outside.

    Raises
    ------
    ModelError
        If the loops cross.
    """
    left = outward * surface.sense
    if loops:
        edge = places[np.unique(np.concatenate(loops))]
        off = np.linalg.norm(surface.points(surface.project(edge)) - edge, axis=1).max()
        if off > max(tolerance, 1e-6):
            raise ModelError(f"its edges are {off:.3g} m off its {surface.kind}; the file contradicts itself")
    if surface.kind == "SPHERE" and loops:
        assert isinstance(surface, Turned)
        flat: Flat = FromPoint(surface, free_point(surface, left, loops, places))
    else:
        flat = Flat(surface)
    polygons, numbers = polygons_of(flat, left, loops, places, tolerance)
    new_places = _Places(places)
    uv: list[np.ndarray] = []
    index: list[int] = []
    sides: list[np.ndarray] = []
    for polygon, number in zip(polygons, numbers, strict=True):
        start = sum(len(p) for p in uv)
        count = len(polygon)
        uv.append(polygon)
        index += [new_places.number(n, flat, p) for n, p in zip(number, polygon, strict=True)]
        sides.append(np.column_stack([start + np.arange(count), start + (np.arange(count) + 1) % count]))
    return _filled(
        flat, surface, left, *_joined(np.vstack(uv), np.array(index), np.vstack(sides)), new_places, tolerance
    )


def _joined(uv: np.ndarray, index: np.ndarray, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return polygons whose common corners, where loops touch, are one."""
    size = max(float(np.ptp(uv, axis=0).max()), 1e-300)
    keys = np.column_stack([np.round(uv / (1e-9 * size)), index])
    _, first, back = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return uv[first], index[first], back.reshape(-1)[sides]


class _Places:
    """Points of a face: those of its edges, and those added inside."""

    def __init__(self, places: np.ndarray) -> None:
        self.first = len(places)
        self.known = places
        self.added: list[np.ndarray] = []
        self._of_key: dict[int, int] = {}

    def number(self, number: int, flat: Flat, uv: np.ndarray) -> int:
        """Return the number of a point of a polygon; a negative one is a key of a point that is still to be made."""
        if number >= 0:
            return int(number)
        if number not in self._of_key:
            self._of_key[number] = self.add(flat.to_space(uv[None])[0])
        return self._of_key[number]

    def add(self, place: np.ndarray) -> int:
        self.added.append(place)
        return self.first + len(self.added) - 1

    def all(self) -> np.ndarray:
        return np.vstack([self.known, *[p[None] for p in self.added]]) if self.added else self.known


def _scales(flat: Flat, uv: np.ndarray, tolerance: float) -> np.ndarray:
    """Return by what u and v are multiplied, so that lengths count chords whose sag is the tolerance."""
    low, high = uv.min(axis=0), uv.max(axis=0)
    spans = np.maximum(high - low, 1e-12)
    t = np.linspace(0.05, 0.95, 7)
    out = np.empty(2)
    for k in range(2):
        step = 0.02 * spans[k]
        grid = np.stack(np.meshgrid(low[0] + t * spans[0], low[1] + t * spans[1]), axis=-1).reshape(-1, 2)
        d = step * np.eye(2)[k]
        bend = (
            np.linalg.norm(flat.to_space(grid + d) - 2.0 * flat.to_space(grid) + flat.to_space(grid - d), axis=1).max()
            / step**2
        )
        chord = np.sqrt(8.0 * tolerance / max(bend, 1e-300))
        # no direction counts as less than one chord in all
        out[k] = 1.0 / min(chord, spans[k])
    return out


def _seeds(flat: Flat, uv: np.ndarray, sides: np.ndarray, scale: np.ndarray, tolerance: float) -> np.ndarray:
    """Return points inside polygons, about as far apart as chords whose sag is the tolerance."""
    low, high = uv.min(axis=0), uv.max(axis=0)
    if isinstance(flat, FromPoint):
        chord = min(TURN, np.sqrt(8.0 * tolerance / flat.radius)) / np.sqrt(2.0)
        k = np.arange(min(int(4.0 * np.pi / chord**2), MOST))
        z = 1.0 - (2.0 * k + 1.0) / max(len(k), 1)
        phi = k * np.pi * (3.0 - np.sqrt(5.0))
        ring = np.sqrt(1.0 - z**2)
        directions = np.column_stack([ring * np.cos(phi), ring * np.sin(phi), z])
        directions = directions[directions @ flat.away < 0.999]
        seeds = flat.to_plane(flat.centre + flat.radius * directions)
        # lengths in the plane are larger than on the ball of radius 1 by this
        size = chord * (1.0 + 0.25 * np.sum(seeds**2, axis=1))
    else:
        count = np.ceil((high - low) * scale - 1e-9)
        if count.min() > 1.0:
            # a cell's diagonal bends in both directions
            count = np.ceil(np.sqrt(2.0) * count)
        if np.prod(np.maximum(count - 1.0, 1.0)) > MOST:
            raise ModelError(f"a face on a {flat.surface.kind} needs more than {MOST} points; give a larger tolerance")
        u, v = (low[k] + (high[k] - low[k]) * np.arange(1, int(count[k])) / count[k] for k in range(2))
        seeds = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2) * scale
        uv = uv * scale
        size = np.full(len(seeds), 1.0)
    a, b = uv[sides[:, 0]], uv[sides[:, 1]]
    kept = [np.zeros((0, 2))]
    for part in range(0, len(seeds), CHUNK):
        p, reach = seeds[part : part + CHUNK, None], size[part : part + CHUNK]
        along = b - a
        t = np.clip(np.sum((p - a) * along, axis=2) / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
        apart = np.linalg.norm(a + t[..., None] * along - p, axis=2).min(axis=1)
        cross = (a[:, 1] > p[..., 1]) != (b[:, 1] > p[..., 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            at = a[:, 0] + (p[..., 1] - a[:, 1]) * along[:, 0] / along[:, 1]
        inside = np.sum(cross & (p[..., 0] < at), axis=1) % 2 == 1
        kept.append(seeds[part : part + CHUNK][inside & (apart > 0.4 * reach)])
    return np.vstack(kept) / (1.0 if isinstance(flat, FromPoint) else scale)


def _filled(
    flat: Flat,
    surface: Surface,
    left: float,
    uv: np.ndarray,
    index: np.ndarray,
    sides: np.ndarray,
    new_places: _Places,
    tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Fill polygons with triangles whose inner edges are within the tolerance of the surface."""
    plane = surface.kind == "PLANE"
    scale = np.ones(2) / max(float(np.ptp(uv, axis=0).max()), 1e-12)
    if isinstance(flat, FromPoint):
        scale = np.ones(2)
    elif not plane:
        scale = _scales(flat, uv, tolerance)
    if not plane:
        within = _seeds(flat, uv, sides, scale, tolerance)
        index = np.concatenate([index, [new_places.add(p) for p in flat.to_space(within)]]).astype(np.int64)
        uv = np.vstack([uv, within])
    ends = np.sort(sides, axis=1)
    fixed = ends[:, 0] * KEY + ends[:, 1]
    for _ in range(ROUNDS):
        triangles = triangulated(uv * scale, sides)
        if plane:
            break
        inner = np.unique(
            np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])), axis=0
        )
        inner = inner[~np.isin(inner[:, 0] * KEY + inner[:, 1], fixed)]
        if not len(inner):
            break
        middle = 0.5 * (uv[inner[:, 0]] + uv[inner[:, 1]])
        x = new_places.all()
        there = flat.to_space(middle)
        sag = np.linalg.norm(there - 0.5 * (x[index[inner[:, 0]]] + x[index[inner[:, 1]]]), axis=1)
        deep = sag > 1.05 * tolerance
        if not deep.any():
            break
        if len(uv) + deep.sum() > MOST:
            raise ModelError(f"a face on a {surface.kind} needs more than {MOST} points; give a larger tolerance")
        index = np.r_[index, [new_places.add(p) for p in there[deep]]]
        uv = np.vstack([uv, middle[deep]])
    triangles = triangles if left > 0.0 else triangles[:, ::-1]
    added = np.array(new_places.added).reshape(-1, 3)
    out = index[triangles]
    a, b, c = out.T
    return added, out[(a != b) & (b != c) & (c != a)]


def triangulated(points: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return triangles, anticlockwise, of what lies within polygons: in one, out of a second inside it, and so on.

    Raises
    ------
    ModelError
        If the library is not there, sides cross or points coincide.
    """
    try:
        import pythoncdt as cdt
    except ImportError:
        raise ModelError(
            "solids with curved or notched faces are cut by pythoncdt: pip install 'gearmbs[solids]'"
        ) from None
    t = cdt.Triangulation(cdt.VertexInsertionOrder.AUTO, cdt.IntersectingConstraintEdges.NOT_ALLOWED, 0.0)
    try:
        t.insert_vertices(np.ascontiguousarray(points, dtype=np.float64))  # type: ignore[call-overload]
        t.insert_edges(np.ascontiguousarray(sides, dtype=np.uint32))  # type: ignore[call-overload]
        t.erase_outer_triangles_and_holes()
    except (RuntimeError, ValueError) as error:
        raise Crossed(f"its edges cross or meet: {str(error).splitlines()[0]}") from None
    found = t.triangles_array()
    return np.array(found["vertices"], dtype=np.int64).reshape(-1, 3)
