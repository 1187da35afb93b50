"""Bodies of a Parasolid file: names, faces, loops and edges, the exact solids among them, and facets of the others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.solids.faces import Crossed, cut
from gearmbs.solids.procedural import surface_of
from gearmbs.solids.surfaces import Chain, Curve, Surface, Turned, chain, curve_of
from gearmbs.solids.transmit import Node, Nodes, read_transmit

SOLID = 1
NAMES = ("AdamsObjectName", "SDL/TYSA_NAME", "SDL/TYSA_UNAME")
"""Attributes that name a body, the first one as a deck does."""
PART_NUMBER = "UG2/ADAMS_ID"
"""Attribute with the number of the body's PART."""

TOLERANCE = 1e-3
"""Default chord tolerance over the diagonal of the body's box."""
AGAIN = (1 / 8, 1 / 64, 1 / 512, 2.0, 4.0, 8.0)
"""By what the tolerance of the edges of a face is multiplied whose chains cross, one after the other."""
SHORT = 0.1
"""Of the length of all edges of a face: no longer ones are cut coarser."""
TRIES = 30
"""Times that a body is cut."""


@dataclass
class Face:
    """A face: its surface, whether its normal is that of the surface, and its loops.

    Attributes
    ----------
    number : int
    surface : Surface
    outward : float
        1 if the normal of the surface points out of the body, else -1.
    loops : list of list of (int, bool)
        Edges of each loop, and whether it runs along them.
    """

    number: int
    surface: Surface
    outward: float
    loops: list[list[tuple[int, bool]]]


@dataclass
class Body:
    """A solid body of a file."""

    nodes: Nodes
    node: Node

    @cached_property
    def attributes(self) -> dict[str, object]:
        """Attributes of the body by the names of their definitions: the first value of the first field that has one."""
        out: dict[str, object] = {}
        for number in _along(self.nodes, self.node.attributes, "next"):
            a = self.nodes[number]
            if a.kind != "ATTRIBUTE" or a.definition not in self.nodes:
                continue
            definition = self.nodes[self.nodes[a.definition].identifier].string
            values = (vars(self.nodes[f]).get("values") for f in a.fields if f in self.nodes)
            first = next((v for v in values if v), None)
            if first is not None:
                out.setdefault(definition, first if isinstance(first, str) else first[0])
        return out

    @property
    def name(self) -> str:
        """The name by which a deck calls the body, else that of the program that made it; empty if it has none."""
        return next((str(self.attributes[n]) for n in NAMES if n in self.attributes), "")

    def surface(self, number: int) -> Surface:
        """Return the surface of a node."""
        known = self._surfaces.get(number)
        if known is None:
            if number in self._wanted:
                raise ModelError(f"its surface {number} is made of itself")
            self._wanted.add(number)
            try:
                known = self._surfaces[number] = surface_of(self.nodes, number, self.surface)
            finally:
                self._wanted.discard(number)
        return known

    @cached_property
    def _wanted(self) -> set[int]:
        return set()

    @cached_property
    def _surfaces(self) -> dict[int, Surface]:
        return {}

    @cached_property
    def faces(self) -> list[Face]:
        """Faces of the body.

        Raises
        ------
        ModelError
            If it is no solid, or has a surface that is not read.
        """
        if self.node.body_type != SOLID:
            raise ModelError(f"its body '{self.name}' is no solid but wires or sheets; save a solid")
        found: dict[int, Face] = {}
        for region in _along(self.nodes, self.node.region, "next"):
            if self.nodes[region].type != "S":
                continue
            for shell in _along(self.nodes, self.nodes[region].shell, "next"):
                for number in _along(self.nodes, self.nodes[shell].face, "next"):
                    found[number] = self._face(number)
        if not found:
            raise ModelError(f"its body '{self.name}' has no faces")
        return list(found.values())

    def _face(self, number: int) -> Face:
        node = self.nodes[number]
        if node.surface not in self.nodes:
            raise ModelError(f"its face {number} has no surface")
        loops = []
        for number_of_loop in _along(self.nodes, node.loop, "next"):
            first = self.nodes[number_of_loop].halfedge
            edges = []
            for fin in _along(self.nodes, first, "forward"):
                edge = self.nodes[fin].edge
                if edge:
                    edges.append((edge, self.nodes[fin].sense == "+"))
            if edges:
                loops.append(edges)
        return Face(number, self.surface(node.surface), -1.0 if node.sense == "-" else 1.0, loops)

    def edge_points(self, number: int, tolerance: float) -> np.ndarray:
        """Return an edge as points from its start to its end, shape (n, 3), m; of a ring the first is the last."""
        edge = self.nodes[number]
        forward = self.nodes[edge.halfedge]
        other = self.nodes[forward.other]
        if forward.sense == "-":
            forward, other = other, forward
        ends = [self._place(f.vertex) for f in (other, forward)]
        fin = None if edge.curve else next((f for f in (forward, other) if f.curve), None)
        if not edge.curve and fin is None:
            raise ModelError(f"its edge {number} has no curve")
        at = edge.curve or fin.curve  # type: ignore[union-attr]
        curve = curve_of(self.nodes, at, self.surface)
        along = self.nodes[at].sense != "-" if fin is None else fin.sense == "+"
        points = self._between(curve, at, ends, along, tolerance)
        for k, end in ((0, ends[0]), (-1, ends[1])):
            if end is not None:
                points[k] = end
        if ends[0] is None:
            points[-1] = points[0]
        return points

    def _between(
        self, curve: Curve, at: int, ends: list[np.ndarray | None], along: bool, tolerance: float
    ) -> np.ndarray:
        """Return the piece of a curve between the ends of an edge, in the edge's direction."""
        node = self.nodes[at]
        if node.kind == "TRIMMED_CURVE":
            t0, t1 = node.parm_1, node.parm_2
            if isinstance(curve, Chain):
                # its parameter is the number of a point, not that of the file
                forward = t1 > t0
                t0, t1 = (curve.parameter(np.array(p)) for p in (node.point_1, node.point_2))
                if curve.period is not None and (t1 <= t0 if forward else t1 >= t0):
                    t1 += curve.period if forward else -curve.period
            points = chain(curve, t0, t1, tolerance)
            if ends[0] is not None and ends[1] is not None:
                same = np.linalg.norm(points[0] - ends[0]) + np.linalg.norm(points[-1] - ends[1])
                crossed = np.linalg.norm(points[0] - ends[1]) + np.linalg.norm(points[-1] - ends[0])
                along = same <= crossed if abs(same - crossed) > 1e-9 else along
            return points if along else points[::-1].copy()
        if ends[0] is None or ends[1] is None:
            low = curve.low if np.isfinite(curve.low) else 0.0
            if curve.period is None:
                raise ModelError(f"its edge on curve {at} has no ends, but the curve is not closed")
            points = chain(curve, low, low + curve.period, tolerance)
            return points if along else points[::-1].copy()
        t0, t1 = curve.parameter(ends[0]), curve.parameter(ends[1])
        if curve.period is not None:
            ring = np.linalg.norm(ends[0] - ends[1]) < 1e-9
            if along and (t1 <= t0 or ring):
                t1 = t0 + curve.period if ring else t1 + curve.period
            elif not along and (t1 >= t0 or ring):
                t1 = t0 - curve.period if ring else t1 - curve.period
        return chain(curve, t0, t1, tolerance)

    def _place(self, vertex: int) -> np.ndarray | None:
        if not vertex:
            return None
        return np.array(self.nodes[self.nodes[vertex].point].pvec, dtype=float)

    @cached_property
    def corners(self) -> np.ndarray:
        """Vertices and points of edges of the body, taken roughly, for its size, shape (n, 3), m."""
        edges = {edge for face in self.faces for loop in face.loops for edge, _ in loop}
        found = [self.edge_points(edge, 1.0) for edge in edges]
        for face in self.faces:
            s = face.surface
            if isinstance(s, Turned) and s.kind in ("SPHERE", "TORUS") and not face.loops:
                reach = s.radius + s.tube
                found.append(s.origin + reach * np.vstack([np.eye(3), -np.eye(3)]))
        if not found:
            raise ModelError(f"its body '{self.name}' has no edges")
        return np.vstack(found)


def _along(nodes: Nodes, first: int, step: str) -> Iterator[int]:
    """Yield the numbers of a chain, or of a ring once around."""
    seen: set[int] = set()
    number = first
    while number and number in nodes and number not in seen:
        seen.add(number)
        yield number
        number = getattr(nodes[number], step)


def read_bodies(path: str | Path) -> list[Body]:
    """Return the bodies of a Parasolid text transmit file.

    Raises
    ------
    ModelError
        If the file cannot be read, is damaged, or is an assembly.
    """
    path = Path(path)
    nodes = read_transmit(path)
    root = nodes[1]
    if root.kind == "BODY":
        return [Body(nodes, root)]
    if root.kind in ("PART_XMT_BLOCK", "POINTER_LIS_BLOCK"):
        found = [nodes[number] for number in root.entries if number in nodes]
        return [Body(nodes, node) for node in found if node.kind == "BODY"]
    if root.kind == "ASSEMBLY":
        raise ModelError(f"{path}: it is an assembly; save its parts as bodies")
    raise ModelError(f"{path}: its root is a {root.kind}, not a body")


# Bodies that are one solid of exact geometry: a ball, a block, a cylinder, a frustum or a torus.


CLOSE = 1e-8
"""Lengths, m, and cosines that count as zero; the resolution of Parasolid's lengths."""


class Primitive(NamedTuple):
    """A solid about its origin: kind, sizes in m, origin and axes (columns) in the frame of the body.

    Sizes are the radius of a ``sphere``; the edges of a ``box``; radius and length along z of a ``cylinder``; radii at
    -length/2 and length/2 and the length of a ``frustum``; radius and that of the tube of a ``torus``.
    """

    kind: str
    sizes: tuple[float, ...]
    origin: np.ndarray
    axes: np.ndarray


def primitive(body: Body) -> Primitive | None:
    """Return the exact solid that a body is; None if it is another."""
    faces = body.faces
    kinds = sorted(f.surface.kind for f in faces)
    if len(faces) == 1:
        return _round(faces[0])
    if kinds == ["PLANE"] * 6:
        return _box(body)
    if kinds in (["CYLINDER", "PLANE", "PLANE"], ["CONE", "PLANE", "PLANE"], ["CONE", "PLANE"]):
        return _of_revolution(body)
    return None


def _outward(face: Face) -> bool:
    return face.outward * face.surface.sense > 0.0


def _frame(s: Turned) -> np.ndarray:
    return np.column_stack([s.x, s.y, s.axis])


def _round(face: Face) -> Primitive | None:
    s = face.surface
    if face.loops or not isinstance(s, Turned) or not _outward(face):
        return None
    if s.kind == "SPHERE":
        return Primitive("sphere", (s.radius,), s.origin, _frame(s))
    if s.kind == "TORUS" and s.radius > s.tube:
        return Primitive("torus", (s.radius, s.tube), s.origin, _frame(s))
    return None


def _normals(faces: list[Face]) -> np.ndarray:
    planes: list[Surface] = [f.surface for f in faces]
    return np.array([f.outward * p.sense * p.axis for f, p in zip(faces, planes, strict=True)])  # type: ignore[attr-defined]


def _box(body: Body) -> Primitive | None:
    """Six planes in three opposite pairs at right angles, each with one loop of four straight edges."""
    for face in body.faces:
        if len(face.loops) != 1 or len(face.loops[0]) != 4:
            return None
    normals = _normals(body.faces)
    first = normals[0]
    second = next((n for n in normals if abs(n @ first) < CLOSE), None)
    if second is None:
        return None
    axes = np.column_stack([first, second, np.cross(first, second)])
    along = np.sort(np.abs(normals @ axes), axis=1)
    if np.any(along[:, :2] > CLOSE) or np.linalg.matrix_rank(normals, tol=0.5) < 3:
        return None
    if np.any(np.sum(np.round(normals @ axes), axis=0)):
        return None
    corners = body.corners @ axes
    low, high = corners.min(axis=0), corners.max(axis=0)
    if np.any(np.minimum(np.abs(corners - low), np.abs(corners - high)) > CLOSE):
        return None
    return Primitive("box", tuple(high - low), axes @ (0.5 * (low + high)), axes)


def _of_revolution(body: Body) -> Primitive | None:
    """A cylinder or a cone between planes at right angles to its axis, whose edges are rings."""
    side = next(f for f in body.faces if f.surface.kind != "PLANE")
    caps = [f for f in body.faces if f.surface.kind == "PLANE"]
    s = side.surface
    if not isinstance(s, Turned) or not _outward(side) or len(side.loops) != len(caps):
        return None
    if any(len(loop) != 1 for f in body.faces for loop in f.loops) or any(len(f.loops) != 1 for f in caps):
        return None
    if np.any(np.abs(np.abs(_normals(caps) @ s.axis) - 1.0) > CLOSE):
        return None
    heights = sorted(float((c.surface.origin - s.origin) @ s.axis) for c in caps)  # type: ignore[attr-defined]
    if len(caps) == 1:
        heights = sorted([*heights, s.poles[0]])
    low, high = heights
    origin = s.origin + 0.5 * (low + high) * s.axis
    if s.kind == "CYLINDER":
        return Primitive("cylinder", (s.radius, high - low), origin, _frame(s))
    radii = [s.radius + h * s.slope for h in (low, high)]
    if min(radii) < -CLOSE:
        return None
    return Primitive("frustum", (max(radii[0], 0.0), max(radii[1], 0.0), high - low), origin, _frame(s))


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
    cuts: dict[int, float] = {}
    left: dict[int, Iterator[float]] = {}
    vertices, triangles, why = np.zeros((0, 3)), np.zeros((0, 3), int), ""
    for _ in range(TRIES):
        try:
            vertices, triangles = _attempt(body, tolerance, cuts)
            break
        except _CrossedFace as crossed:
            # arcs that come closer to each other than the tolerance cross as chains: these edges are cut finer; at the
            # tip of a sliver the file's own curves cross, within its tolerance: short edges are cut coarser
            factor = next(left.setdefault(crossed.face.number, iter(AGAIN)), None)
            why = str(crossed)
            if factor is None:
                break
            for edge, share in _shares(body, crossed.face, tolerance).items():
                if factor < 1.0:
                    cuts[edge] = min(cuts.get(edge, tolerance), factor * tolerance)
                else:
                    cuts[edge] = (factor if share < SHORT else 1.0) * tolerance
    if not len(triangles):
        raise ModelError(f"{why}; save the solid as .stl")
    check_closed(body.name, triangles)
    return vertices, triangles


def _shares(body: Body, face: Face, tolerance: float) -> dict[int, float]:
    """Return the edges of a face with their shares of the length of all of them."""
    chains = {e: np.diff(body.edge_points(e, tolerance), axis=0) for loop in face.loops for e, _ in loop}
    lengths = {e: float(np.linalg.norm(steps, axis=1).sum()) for e, steps in chains.items()}
    return {e: length / sum(lengths.values()) for e, length in lengths.items()}


class _CrossedFace(Exception):
    def __init__(self, face: Face, message: str) -> None:
        super().__init__(message)
        self.face = face


def _attempt(body: Body, tolerance: float, cuts: dict[int, float]) -> tuple[np.ndarray, np.ndarray]:
    points = _Points()
    chains: dict[int, np.ndarray] = {}
    for edge in sorted({edge for face in body.faces for loop in face.loops for edge, _ in loop}):
        chains[edge] = points.chain(body.edge_points(edge, cuts.get(edge, tolerance)))
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
