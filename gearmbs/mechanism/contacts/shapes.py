"""Solids that touch: their sizes, and where they sit in a marker's frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.quantities import quantities, quantity

SEGMENTS = 48
"""Around a solid of revolution that is cut into triangles."""
LEVELS = 24
NOTHING = 1e-12
"""Part of the cube of its length that a solid's volume exceeds: that of a sheet is rounding."""
TINY = 1e-300
"""In place of zero in a divisor, near the smallest normal double: the size of a mesh of a single point."""
PLACED = {"axes": "dimensionless", "offset": "length"}
"""Fields of a shape's place, and what they are."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Shape:
    """A solid in the frame of a marker.

    Attributes
    ----------
    offset : array_like, shape (3,)
        Its origin in the marker's frame, m.
    axes : array_like, shape (3, 3)
        Its axes there, as columns.
    """

    kind: ClassVar[str] = ""
    lengths: ClassVar[tuple[str, ...]] = ()
    """Fields that are lengths: numbers in m or texts with a unit."""
    may_vanish: ClassVar[tuple[str, ...]] = ()
    offset: Any = (0.0, 0.0, 0.0)
    axes: Any = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        for name in self.lengths:
            value = quantity(getattr(self, name), "length", f"{self.kind}: {name}")
            if not 0.0 < value < np.inf and not (value == 0.0 and name in self.may_vanish):
                raise ModelError(f"{self.kind}: {name} = {value} m; it must be positive and finite")
            object.__setattr__(self, name, value)
        axes, offset = (quantities(getattr(self, n), unit, f"{self.kind}: {n}") for n, unit in PLACED.items())
        if offset.shape != (3,) or not np.isfinite(offset).all():
            raise ModelError(f"{self.kind}: offset = {self.offset!r}; give three finite lengths, along x, y and z")
        if axes.shape != (3, 3) or not np.allclose(axes.T @ axes, np.eye(3), atol=1e-9) or np.linalg.det(axes) < 0.0:
            raise ModelError(f"{self.kind}: axes must be a rotation matrix")
        object.__setattr__(self, "axes", axes)
        object.__setattr__(self, "offset", offset)

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        """Return vertices, shape (n, 3), m, and triangles, shape (m, 3), anticlockwise seen from outside."""
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    """A ball about the origin; a point if the radius is 0."""

    kind: ClassVar[str] = "sphere"
    lengths: ClassVar[tuple[str, ...]] = ("radius",)
    may_vanish: ClassVar[tuple[str, ...]] = ("radius",)
    radius: Any

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        if self.radius == 0.0:
            return np.zeros((1, 3)), np.zeros((0, 3), dtype=np.int64)
        angles = np.linspace(-np.pi / 2, np.pi / 2, LEVELS + 1)
        return revolved(self.radius * np.cos(angles), self.radius * np.sin(angles))


@dataclass(frozen=True, eq=False)
class Ellipsoid(Shape):
    """An ellipsoid about the origin with semi-axes along x, y and z, m."""

    kind: ClassVar[str] = "ellipsoid"
    semi_axes: Any

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "semi_axes", positive_lengths("ellipsoid: semi_axes", self.semi_axes))

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        vertices, triangles = Sphere(1.0).facets()
        return vertices * self.semi_axes, triangles


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A box about the origin with edges along x, y and z, m."""

    kind: ClassVar[str] = "box"
    edges: Any

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "edges", positive_lengths("box: edges", self.edges))

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        signs = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)
        quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        return 0.5 * signs * self.edges, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


@dataclass(frozen=True, eq=False)
class Frustum(Shape):
    """A cone cut off, about z: radius ``bottom`` at z = -length/2, ``top`` at z = length/2, m; one may be 0."""

    kind: ClassVar[str] = "frustum"
    lengths: ClassVar[tuple[str, ...]] = ("bottom", "top", "length")
    may_vanish: ClassVar[tuple[str, ...]] = ("bottom", "top")
    bottom: Any
    top: Any
    length: Any

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bottom == 0.0 and self.top == 0.0:
            raise ModelError(f"{self.kind}: both radii are zero; one must be positive")

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        z = np.linspace(-0.5, 0.5, LEVELS + 1)
        r = self.bottom + (self.top - self.bottom) * (z + 0.5)
        return revolved(np.r_[0.0, r, 0.0], self.length * np.r_[-0.5, z, 0.5])


@dataclass(frozen=True, eq=False)
class Cylinder(Shape):
    """A cylinder about z, from z = -length/2 to length/2, m."""

    kind: ClassVar[str] = "cylinder"
    lengths: ClassVar[tuple[str, ...]] = ("radius", "length")
    radius: Any
    length: Any

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        return Frustum(self.radius, self.radius, self.length).facets()


@dataclass(frozen=True, eq=False)
class Torus(Shape):
    """A torus about z: a tube of radius ``tube`` around a circle of ``radius``, m."""

    kind: ClassVar[str] = "torus"
    lengths: ClassVar[tuple[str, ...]] = ("radius", "tube")
    radius: Any
    tube: Any

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tube >= self.radius:
            raise ModelError(f"torus: tube = {self.tube} m; it must be thinner than the radius, {self.radius} m")

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        angles = np.linspace(-np.pi, np.pi, LEVELS, endpoint=False)
        return revolved(self.radius + self.tube * np.cos(angles), self.tube * np.sin(angles), closed=True)


@dataclass(frozen=True, eq=False)
class HalfSpace(Shape):
    """All below z = 0."""

    kind: ClassVar[str] = "plane"


@dataclass(frozen=True, eq=False)
class Mesh(Shape):
    """A closed surface of triangles, whose vertices are seen anticlockwise from outside.

    Triangles that are seen the other way than most of those they hang together with are turned round, and vertices of
    no triangle left out.

    Attributes
    ----------
    vertices : array_like, shape (n, 3)
        m.
    triangles : array_like of int, shape (m, 3)
    """

    kind: ClassVar[str] = "mesh"
    vertices: Any
    triangles: Any

    def __post_init__(self) -> None:
        super().__post_init__()
        vertices, triangles = (
            threes("mesh: vertices", self.vertices, float),
            threes("mesh: triangles", self.triangles, int),
        )
        if len(triangles) < 4:
            raise ModelError(f"mesh: {len(triangles)} triangles; a solid has at least four")
        if not np.isfinite(vertices).all() or not ((triangles >= 0) & (triangles < len(vertices))).all():
            raise ModelError("mesh: triangles must name vertices by their number, from 0 on, and vertices be finite")
        vertices, triangles = merged(vertices, triangles)
        if len(triangles) < 4:
            raise ModelError(f"mesh: {len(triangles)} triangles whose corners are apart; a solid has at least four")
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        _, uses = np.unique(edges, axis=0, return_counts=True)
        if np.any(uses % 2):
            raise ModelError(f"mesh: {np.sum(uses % 2)} edges belong to one triangle only; a solid's surface is closed")
        there = len(np.unique(np.sort(triangles, axis=1), axis=0))
        # of what is flat both sides coincide
        flat = np.linalg.matrix_rank(vertices - vertices.mean(axis=0)) < 3
        if there < len(triangles) and not flat:
            raise ModelError(f"mesh: {len(triangles) - there} triangles are there twice; save the solid once")
        triangles = turned_alike(triangles)
        inside = volume(vertices, triangles)
        if abs(inside) <= NOTHING * float(np.ptp(vertices, axis=0).max()) ** 3:
            raise ModelError(f"mesh: its surface encloses {abs(inside)} m^3; a solid has a volume")
        if inside < 0.0:
            triangles = triangles[:, ::-1].copy()
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    def facets(self) -> tuple[np.ndarray, np.ndarray]:
        return self.vertices, self.triangles

    def shells(self) -> tuple[Mesh, ...]:
        """Return its separate solids; itself if it is one, or has cavities."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        a, b, c = self.triangles.T
        joined = coo_array((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, c])), shape=(len(self.vertices),) * 2)
        shell = connected_components(joined, directed=False)[1][a]
        parts = [self.triangles[shell == k] for k in np.unique(shell)]
        if len(parts) == 1 or any(len(part) < 4 or volume(self.vertices, part) <= 0.0 for part in parts):
            return (self,)
        found = []
        for part in parts:
            kept, back = np.unique(part, return_inverse=True)
            found.append(Mesh(self.vertices[kept], back.reshape(-1, 3), offset=self.offset, axes=self.axes))
        return tuple(found)


def positive_lengths(label: str, values: Any) -> np.ndarray:
    """Return three lengths, m, given as numbers or texts with units.

    Raises
    ------
    ModelError
    """
    if isinstance(values, str) or not isinstance(values, (Sequence, np.ndarray)) or len(values) != 3:
        raise ModelError(f"{label} = {values!r}; give three lengths, along x, y and z")
    found = np.array([quantity(v, "length", label) for v in values])
    if not np.all((found > 0.0) & (found < np.inf)):
        raise ModelError(f"{label} = {tuple(values)}; all must be positive and finite")
    return found


def threes(label: str, values: Any, kind: type) -> np.ndarray:
    """Return rows of three numbers.

    Raises
    ------
    ModelError
    """
    try:
        given = np.asarray(values)
        found: np.ndarray = given.astype(kind, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise ModelError(f"{label} must be rows of three numbers: {error}") from None
    if kind is int and np.any(found != given):
        raise ModelError(f"{label} must name vertices by whole numbers, not {given.dtype}")
    if found.ndim != 2 or found.shape[1] != 3:
        raise ModelError(f"{label} have the shape {found.shape}; give rows of three numbers, shape (n, 3)")
    return found


def turned_alike(triangles: np.ndarray) -> np.ndarray:
    """Return the triangles of a closed surface so that neighbours run along their common edge in opposite directions.

    Of those that hang together by edges of two triangles, the fewer are turned round.

    Raises
    ------
    ModelError
        If there is no such way, as for a surface with one side.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(triangles)
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    order = np.lexsort(np.sort(ends, axis=1).T)
    along = np.sort(ends, axis=1)[order]
    first = np.flatnonzero(np.r_[True, np.any(np.diff(along, axis=0) != 0, axis=1)])
    first = first[np.diff(np.r_[first, 3 * n]) == 2]
    one, other = order[first], order[first + 1]
    alike = ends[one, 0] != ends[other, 0]
    if alike.all():
        return triangles
    # each triangle stands twice, as it is and turned round; those that go together are joined
    a, b = one % n, other % n
    b, c = np.where(alike, b, b + n), np.where(alike, b + n, b)
    joined = coo_array((np.ones(2 * len(a)), (np.r_[a, a + n], np.r_[b, c])), shape=(2 * n, 2 * n))
    count, parts = connected_components(joined, directed=False)
    here, there = parts[:n], parts[n:]
    if np.any(here == there):
        raise ModelError(
            "mesh: its surface has one side only, as a Moebius strip has; a solid's has an inner and an outer one"
        )
    held = np.bincount(here, minlength=count)
    fewer = (held[here] < held[there]) | ((held[here] == held[there]) & (here > there))
    return np.where(fewer[:, None], triangles[:, ::-1], triangles)


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Return the volume a surface encloses, negative if its triangles are seen clockwise."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def merged(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a mesh whose coincident vertices are one and all used, and whose triangles have three corners."""
    size = max(float(np.ptp(vertices, axis=0).max()), TINY)
    _, first, back = np.unique(np.round(vertices / (1e-9 * size)), axis=0, return_index=True, return_inverse=True)
    triangles = back.reshape(-1)[triangles]
    a, b, c = triangles.T
    used, back = np.unique(triangles[(a != b) & (b != c) & (c != a)], return_inverse=True)
    return vertices[first[used]], back.reshape(-1, 3)


def revolved(radii: Any, z: Any, closed: bool = False, segments: int = SEGMENTS) -> tuple[np.ndarray, np.ndarray]:
    """Return the facets of a profile, from below to above, turned about z.

    Parameters
    ----------
    radii, z : array_like, shape (n,)
        m.
    closed : bool
        Whether its end joins its start.
    segments : int
        Around the axis, at least 3: the facets leave the round by radius (1 - cos(pi / segments)).

    Raises
    ------
    ModelError
    """
    if segments != int(segments) or segments < 3:
        raise ModelError(f"revolution: segments = {segments}; give a whole number, at least 3")
    phi = 2.0 * np.pi * np.arange(segments) / segments
    n = len(radii)
    vertices = np.stack([np.outer(radii, np.cos(phi)), np.outer(radii, np.sin(phi)), np.outer(z, np.ones(segments))])
    triangles = []
    for k in range(n if closed else n - 1):
        for m in range(segments):
            a, b = k * segments + m, k * segments + (m + 1) % segments
            c, d = (k + 1) % n * segments + m, (k + 1) % n * segments + (m + 1) % segments
            triangles += [(a, b, d), (a, d, c)]
    return merged(vertices.transpose(1, 2, 0).reshape(-1, 3), np.array(triangles))


def extruded(profile: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the facets of a closed profile in the xy plane, shape (n, 2), drawn out along z.

    Raises
    ------
    ModelError
        If the profile crosses itself, or is none.
    """
    profile = np.asarray(profile, dtype=float)
    if profile.ndim != 2 or profile.shape[1] != 2 or len(profile) < 3:
        raise ModelError(f"extrusion: its profile has the shape {profile.shape}; give at least three rows x, y")
    if np.allclose(profile[0], profile[-1]):
        profile = profile[:-1]
    x, y = profile.T
    if np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) < 0.0:
        profile = profile[::-1]
    n = len(profile)
    low = np.column_stack([profile, np.zeros(n)])
    vertices = np.concatenate([low, low + (0.0, 0.0, length)])
    caps = ears(profile)
    triangles = [(c, b, a) for a, b, c in caps] + [(a + n, b + n, c + n) for a, b, c in caps]
    for k in range(n):
        m = (k + 1) % n
        triangles += [(k, m, m + n), (k, m + n, k + n)]
    return vertices, np.array(triangles)


def ears(profile: np.ndarray) -> list[tuple[int, int, int]]:
    """Cut a simple polygon, anticlockwise, into triangles, one ear after the other.

    Raises
    ------
    ModelError
        If no ear is left, as where the polygon crosses itself.
    """
    left, found = list(range(len(profile))), []

    def area(a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = profile[a], profile[b], profile[c]
        return float((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))

    def is_ear(a: int, b: int, c: int) -> bool:
        if area(a, b, c) <= 0.0:
            return False
        others = (p for p in left if p not in (a, b, c))
        return not any(area(a, b, p) >= 0.0 and area(b, c, p) >= 0.0 and area(c, a, p) >= 0.0 for p in others)

    while len(left) > 2:
        for k in range(len(left)):
            corner = (left[k - 1], left[k], left[(k + 1) % len(left)])
            if is_ear(*corner):
                found.append(corner)
                del left[k]
                break
        else:
            raise ModelError("extrusion: its profile crosses itself or holds points twice")
    return found
