"""Moments of solids that are put together from blocks, prisms and cylinders, and of edges that are taken off blocks."""

from __future__ import annotations

import numpy as np

from gearmbs.adams.view.deckmaker import Deckmaker
from gearmbs.adams.view.expressions import text_of
from gearmbs.adams.view.geometry.solids import (
    REMEDY,
    Moments,
    block_corner,
    block_outline,
    cylinder_outline,
    extrusion_outline,
    link_outline,
    plate_outline,
    polyhedron,
    prism,
)
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item

PRISMS = {
    "block": block_outline, "link": link_outline, "plate": plate_outline, "extrusion": extrusion_outline,
    "cylinder": cylinder_outline,
}  # fmt: skip
POINTS = 20
"""Of Gauss, to which moments of an arc are exact to rounding."""
MOST = 64
"""Convex solids that one is summed from; a union of six has as many."""
Term = tuple[int, np.ndarray]
"""How often a convex solid counts, and its faces n x <= d in the global frame, rows (n, d)."""


def combined(m: Deckmaker, item: Item, line: int) -> Moments:
    """Return the moments of a solid of a CSG tree in the global frame.

    Raises
    ------
    ViewError
        If one of those that it is made of is not convex, or round.
    """
    total = Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    for count, faces in _terms(m, item, line):
        total += _convex(faces).times(count)
    return total


def _terms(m: Deckmaker, item: Item, line: int) -> list[Term]:
    if item.kind != "csg":
        return [(1, _faces(m, item, line))]
    first, second = (
        [term for one in _operands(m, item, key) for term in _terms(m, one, line)] for key in ("base_object", "object")
    )
    both = [(i * j, np.vstack([a, b])) for i, a in first for j, b in second]
    less = [(-i, faces) for i, faces in both]
    kind = m.values.word(item, "type")
    found = {"union": first + second + less, "difference": first + less, "intersection": both}.get(kind)
    if found is None or len(found) > MOST:
        raise ViewError(f"{item.path} is a csg of type {kind[:20]}, whose mass is not computed; {REMEDY}", line)
    return found


def _operands(m: Deckmaker, item: Item, key: str) -> list[Item]:
    """Return what a solid is made of: it has belonged to that solid since it was made."""
    names = [f"{item.path}.{text_of(one).rsplit('.', 1)[-1]}".lower() for one in m.values.values(item, key)]
    if not names or not all(name in item.children for name in names):
        raise ViewError(f"{key} of {item.path}: there is no such solid", item.line)
    return [item.children[name] for name in names]


def _faces(m: Deckmaker, item: Item, line: int) -> np.ndarray:
    """Return the faces of a prism with a convex outline."""
    round_one = item.kind == "plate" and m.values.number(item, "radius", 0.0) != 0.0
    outline = PRISMS.get(item.kind) if not round_one else None
    if outline is None:
        raise ViewError(f"{item.path} is a round {item.kind} in a csg, whose mass is not computed; {REMEDY}", line)
    marker, points, low, high = outline(m, item)
    edges = np.roll(points, -1, axis=0) - points
    across = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.hypot(*edges.T)[:, None]
    if not _turned_left(points):
        across = -across
    reach = np.sum(across * points, axis=1)
    if (points @ across.T > reach + 1e-9 * np.ptp(points)).any():
        raise ViewError(f"{item.path} is not convex; its mass in a csg is not computed; {REMEDY}", line)
    normals = np.vstack([np.column_stack([across, np.zeros(len(across))]), [[0, 0, 1], [0, 0, -1]]])
    a, r = m.values.pose(marker)
    normals = normals @ a.T
    return np.column_stack([normals, np.r_[reach, high, -low] + normals @ r])


def _turned_left(points: np.ndarray) -> bool:
    x, y = points.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) > 0.0


def _convex(faces: np.ndarray) -> Moments:
    """Return the moments of what lies behind all faces."""
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    nothing = Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    # the centre of the largest ball inside
    ball = linprog(
        [0, 0, 0, -1], np.column_stack([faces[:, :3], np.ones(len(faces))]), faces[:, 3], bounds=(None, None)
    )
    size = float(np.ptp(faces[:, 3])) or 1.0
    if not ball.success or ball.x[3] < 1e-9 * size:
        return nothing
    corners = HalfspaceIntersection(np.column_stack([faces[:, :3], -faces[:, 3]]), ball.x[:3]).intersections
    hull = ConvexHull(corners)
    middle = corners.mean(axis=0)
    a, b, c = (corners[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - middle) < 0.0
    triangles = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    return polyhedron(corners, triangles)


# Edges of blocks that are rounded or cut off.


def taken_off(m: Deckmaker, block: Item, line: int) -> Moments:
    """Return the moments of what rounding and chamfers have taken off a block, in the frame of its corner marker.

    Raises
    ------
    ViewError
        Of a feature of another kind or solid, of unequal radii, and where two of them meet.
    """
    total = Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    features = [one for one in block.children.values() if m.active(one)]
    refused = ViewError(f"{block.path} has features, whose mass is not computed; {REMEDY}", line)
    if features and (block.kind != "block" or not all("radius1" in one.fields for one in features)):
        raise refused
    cut: list[tuple[int, list[int], float]] = []
    for one in features:
        (marker, size), radius = block_corner(m, block), m.values.number(one, "radius1", 0.0) or 0.0
        at = m.values.numbers(one, "locations")
        if at is None or len(at) % 3 or radius <= 0.0 or m.values.number(one, "radius2", radius) != radius:
            raise refused
        a, r = m.values.pose(m.values.ref(one, "reference_marker", ("marker",)) or marker)
        b, s = m.values.pose(marker)
        for place in np.array(at).reshape(-1, 3):
            share = (b.T @ (a @ place + r - s)) / size
            k = int(np.argmin(np.abs(share - 0.5)))
            ends = [round(float(x)) for x in share]
            across = [(k + 1) % 3, (k + 2) % 3]
            if any(abs(share[i] - ends[i]) > 1e-6 or ends[i] not in (0, 1) for i in across):
                raise refused
            for other, there, reach in cut:
                same = [i for i in across if ends[i] == there[i]]
                beside = next((i for i in across if ends[i] != there[i]), across[0])
                if other != k or len(same) == 2 or (same and radius + reach > abs(size[beside]) * (1.0 + 1e-9)):
                    raise refused
            cut.append((k, ends, radius))
            i, j = across
            chamfer = m.values.word(one, "chamfer", "no").startswith("y")
            sides = sorted(abs(size[i]) for i in across)
            if radius > sides[0 if chamfer else 1] * (1.0 + 1e-9):
                raise refused
            solid = prism(*_corner_of(radius, abs(size[i]), abs(size[j]), chamfer), 0.0, abs(size[k]))
            axes = np.zeros((3, 3))
            for column, axis in enumerate((i, j, k)):
                inwards = -1.0 if axis != k and ends[axis] else 1.0
                axes[axis, column] = inwards * np.sign(size[axis])
            total += solid.moved(axes, np.array([ends[n] * size[n] if n != k else 0.0 for n in range(3)]))
    return total


def _corner_of(radius: float, a: float, b: float, chamfer: bool) -> tuple[float, float, float, float, float, float]:
    """Return area and moments of what a chamfer or a ball cuts off the corner of a rectangle.

    A ball that is larger than one side touches the other one, and the far end of this: so do centres of mass that View
    wrote show.
    """
    if a < b:
        area, sy, sx, syy, sxx, sxy = _corner_of(radius, b, a, chamfer)
        return area, sx, sy, sxx, syy, sxy
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    start = np.arcsin(max(1.0 - b / radius, 0.0))
    low, high = (0.0, radius) if chamfer else (start, np.pi / 2.0)
    u, w = low + (points + 1.0) / 2.0 * (high - low), weights * (high - low) / 2.0
    # along an arc by its angle, in which it is smooth
    x, y = (u, radius - u) if chamfer else (radius * (np.cos(start) - np.cos(u)), radius * (1.0 - np.sin(u)))
    w = w if chamfer else w * radius * np.sin(u)
    area, sx, sy, sxx, syy, sxy = (float(w @ f) for f in (y, x * y, y**2 / 2, x**2 * y, y**3 / 3, x * y**2 / 2))
    return area, sx, sy, sxx, syy, sxy
