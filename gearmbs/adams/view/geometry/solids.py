"""Moments of the solids of View.

Every solid is the sum of integrals of 1, r and r r^T over it, which add up and move with frames; that of a part is
the sum over its solids, whatever they share, as in View.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.deckmaker import Deckmaker
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item

FLAT = frozenset("circle arc polyline plane graphic".split())
"""Geometry without volume."""


@dataclass(frozen=True)
class Moments:
    """Integrals over a solid: volume, first moments, second moments."""

    volume: float
    first: np.ndarray
    second: np.ndarray

    def moved(self, a: np.ndarray, r: np.ndarray) -> Moments:
        """Return those of the solid turned by a and then moved by r."""
        first = a @ self.first
        cross = np.outer(r, first)
        second = a @ self.second @ a.T + cross + cross.T + self.volume * np.outer(r, r)
        return Moments(self.volume, first + self.volume * r, second)

    def times(self, factor: float) -> Moments:
        """Return those of the solid counted so many times."""
        return Moments(factor * self.volume, factor * self.first, factor * self.second)

    def __add__(self, other: Moments) -> Moments:
        return Moments(self.volume + other.volume, self.first + other.first, self.second + other.second)


def prism(area: float, sx: float, sy: float, sxx: float, syy: float, sxy: float, low: float, high: float) -> Moments:
    """Return the moments of a plane figure, by its own integrals, between two heights."""
    z1, z2, z3 = high - low, (high**2 - low**2) / 2.0, (high**3 - low**3) / 3.0
    if z1 < 0.0:
        z1, z2, z3 = -z1, -z2, -z3
    second = np.array([[sxx * z1, sxy * z1, sx * z2], [sxy * z1, syy * z1, sy * z2], [sx * z2, sy * z2, area * z3]])
    return Moments(area * z1, np.array([sx * z1, sy * z1, area * z2]), second)


def box(x: float, y: float, z: float) -> Moments:
    """Return the moments of a box between the origin and a corner."""
    a = np.array([x, y, z])
    volume = abs(x * y * z)
    second = volume * np.outer(a, a) / 4.0
    second[np.diag_indices(3)] = volume * a**2 / 3.0
    return Moments(volume, volume * a / 2.0, second)


def ellipsoid(x: float, y: float, z: float) -> Moments:
    """Return the moments of an ellipsoid with three semi-axes about the origin."""
    volume = 4.0 / 3.0 * math.pi * abs(x * y * z)
    return Moments(volume, np.zeros(3), volume * np.diag([x**2, y**2, z**2]) / 5.0)


def chords(angle: float, sides: int) -> np.ndarray:
    """Return the corners of a sector of the unit circle from x, with so many chords, or of the whole circle."""
    whole = abs(angle - 2.0 * math.pi) < 1e-12
    at = angle * np.arange(sides if whole else sides + 1) / sides
    arc = np.column_stack([np.cos(at), np.sin(at)])
    return arc if whole else np.vstack([np.zeros(2), arc])


def frustum(length: float, bottom: float, top: float, angle: float, sides: int = 0) -> Moments:
    """Return the moments of a frustum, or of a sector of one, along z from the origin; with so many flat sides, if any.

    Radii go linearly with z, so that the integrands are polynomials of fourth order: three points of Gauss are exact.
    """
    area, sx, sy, sxx, syy, sxy = polygon(chords(angle, sides)) if sides else sector(angle)
    total = Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    for point, weight in zip(*np.polynomial.legendre.leggauss(3)):
        share = (point + 1.0) / 2.0
        z, r, w = share * length, bottom + share * (top - bottom), abs(length) * weight / 2.0
        first = np.array([sx * r**3, sy * r**3, area * r**2 * z])
        second = np.array(
            [
                [sxx * r**4, sxy * r**4, sx * r**3 * z],
                [sxy * r**4, syy * r**4, sy * r**3 * z],
                [sx * r**3 * z, sy * r**3 * z, area * r**2 * z**2],
            ]
        )
        total += Moments(w * area * r**2, w * first, w * second)
    return total


def torus(major: float, minor: float, angle: float) -> Moments:
    """Return the moments of a torus about z, or of a part of its turn from x."""
    section = math.pi * minor**2
    # integrals over the section of rho, rho^2, rho^3 and rho z^2
    rho1, rho2 = section * major, section * (major**2 + minor**2 / 4.0)
    rho3, z2 = section * (major**3 + 0.75 * major * minor**2), section * major * minor**2 / 4.0
    return _turned(rho1, rho2, rho3, 0.0, 0.0, z2, angle)


def _turned(rho1: float, rho2: float, rho3: float, rho1z: float, rho2z: float, rho1zz: float, angle: float) -> Moments:
    """Return the moments of a section that turns about z by an angle from x, by its integrals of rho^a z^b."""
    s, c = math.sin(angle), math.cos(angle)
    if abs(angle - 2.0 * math.pi) < 1e-12:
        s, c = 0.0, 1.0
    cc, ss, cs = angle / 2.0 + s * c / 2.0, angle / 2.0 - s * c / 2.0, s * s / 2.0
    first = np.array([rho2 * s, rho2 * (1.0 - c), rho1z * angle])
    second = np.array(
        [
            [rho3 * cc, rho3 * cs, rho2z * s],
            [rho3 * cs, rho3 * ss, rho2z * (1.0 - c)],
            [rho2z * s, rho2z * (1.0 - c), rho1zz * angle],
        ]
    )
    return Moments(rho1 * angle, first, second)


def _triangles(points: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the signed areas of the triangles between the origin and the edges of a polygon, with their corners."""
    for p, q in zip(points, np.roll(points, -1, axis=0)):
        yield 0.5 * (p[0] * q[1] - p[1] * q[0]), np.array([np.zeros(2), p, q])


def polygon(points: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """Return area, first and second moments of a polygon, counted positive."""
    total = np.zeros(6)
    for area, corners in _triangles(points):
        mean = corners.mean(axis=0)
        # the mid-points of a triangle's edges integrate squares exactly
        mids = 0.5 * (corners + np.roll(corners, -1, axis=0))
        xx, yy, xy = (mids[:, 0] ** 2).mean(), (mids[:, 1] ** 2).mean(), (mids[:, 0] * mids[:, 1]).mean()
        total += area * np.array([1.0, mean[0], mean[1], xx, yy, xy])
    area, sx, sy, sxx, syy, sxy = total if total[0] >= 0.0 else -total
    return area, sx, sy, sxx, syy, sxy


def revolution(points: np.ndarray, angle: float) -> Moments:
    """Return the moments of a polygon in (rho, z), rho not negative, that turns about z."""
    # a triangle's integrals of polynomials of third order, with seven points (Radon's rule)
    a, b = (6.0 - math.sqrt(15.0)) / 21.0, (6.0 + math.sqrt(15.0)) / 21.0
    wa, wb = (155.0 - math.sqrt(15.0)) / 1200.0, (155.0 + math.sqrt(15.0)) / 1200.0
    rule = [((1 / 3, 1 / 3, 1 / 3), 0.225)]
    for at, weight in ((a, wa), (b, wb)):
        rule += [(tuple(np.roll((1.0 - 2.0 * at, at, at), k)), weight) for k in range(3)]
    total = np.zeros(6)
    for area, corners in _triangles(points):
        for shares, weight in rule:
            rho, z = np.array(shares) @ corners
            total += area * weight * np.array([rho, rho**2, rho**3, rho * z, rho**2 * z, rho * z**2])
    if total[0] < 0.0:
        total = -total
    rho1, rho2, rho3, rho1z, rho2z, rho1zz = (float(x) for x in total)
    return _turned(rho1, rho2, rho3, rho1z, rho2z, rho1zz, angle)


# The shapes of View.


Shape = Callable[["Deckmaker", Item], tuple[Item, Moments]]


def need(m: Deckmaker, item: Item, key: str) -> float:
    """Return an argument as a number.

    Raises
    ------
    ViewError
        If it is not given.
    """
    value = m.values.number(item, key)
    if value is None:
        raise ViewError(f"{item.path} has no {key}", item.line)
    return value


def _marker(m: Deckmaker, item: Item, key: str) -> Item:
    found = m.values.ref(item, key, ("marker", "floating_marker"))
    if found is None:
        raise ViewError(f"{item.path} has no {key}", item.line)
    return found


def _angle(m: Deckmaker, item: Item) -> float:
    given = m.values.number(item, "angle_extent")
    return 2.0 * math.pi if given is None else given * m.radian


def block_corner(m: Deckmaker, item: Item) -> tuple[Item, list[float]]:
    """Return the corner marker of a block and its sizes."""
    size = m.values.numbers(item, "diag_corner_coords", 3)
    if size is None:
        raise ViewError(f"{item.path} has no diag_corner_coords", item.line)
    return _marker(m, item, "corner_marker"), size


def _block(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    marker, size = block_corner(m, item)
    return marker, box(*size)


def _radius(m: Deckmaker, item: Item) -> float:
    other = m.values.ref(item, "ref_radius_by_marker", ("marker",))
    if other is None:
        return need(m, item, "radius")
    a, r = m.values.pose(_marker(m, item, "center_marker"))
    seen = a.T @ (m.values.point(other) - r)
    return math.hypot(seen[0], seen[1])


SIDES = 20
"""Chords of a circle at the ends of links: View computes masses from these, as decks that it exported show."""
FLAT_SIDES = 4
"""Up to so many sides View takes a cylinder or a frustum for a prism, with more it is round: by its masses in exported
decks (3 and 4 sides) and its centres of mass (16 and more)."""


def _sides(m: Deckmaker, item: Item) -> int:
    """Return the number of flat sides of a solid, 0 of a round one."""
    given = m.values.number(item, "side_count_for_body")
    return int(given) if given is not None and 3 <= given <= FLAT_SIDES else 0


def _cylinder(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    r = _radius(m, item)
    length = need(m, item, "length")
    return _marker(m, item, "center_marker"), frustum(length, r, r, _angle(m, item), _sides(m, item))


def _frustum(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    bottom, top = need(m, item, "bottom_radius"), need(m, item, "top_radius")
    length = need(m, item, "length")
    return _marker(m, item, "center_marker"), frustum(length, bottom, top, _angle(m, item), _sides(m, item))


def _ellipsoid(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    # the scales are whole axes
    axes = (need(m, item, f"{c}_scale_factor") / 2.0 for c in "xyz")
    return _marker(m, item, "center_marker"), ellipsoid(*axes)


def _sphere(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    r = need(m, item, "radius")
    return _marker(m, item, "center_marker"), ellipsoid(r, r, r)


def _torus(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    radii = need(m, item, "major_radius"), need(m, item, "minor_radius")
    return _marker(m, item, "center_marker"), torus(*radii, _angle(m, item))


Outline = tuple[Item, np.ndarray, float, float]
"""A marker, points in its xy plane, and where along its z axis the solid begins and ends."""


def _spine(m: Deckmaker, item: Item) -> tuple[Outline, float]:
    """Return the middle line of a link, and how far it is widened."""
    i, j = _marker(m, item, "i_marker"), _marker(m, item, "j_marker")
    width, depth = need(m, item, "width"), need(m, item, "depth")
    a, r = m.values.pose(i)
    across = a.T @ (m.values.point(j) - r)
    if math.hypot(across[0], across[1]) < frames.SMALL or abs(across[2]) > 1e-6 * math.hypot(*across):
        raise ViewError(f"{item.path}: a link whose markers are not in one plane of the first", item.line)
    return (i, np.array([[0.0, 0.0], across[:2]]), -depth / 2.0, depth / 2.0), width / 2.0


def _corners(m: Deckmaker, item: Item) -> tuple[Outline, float]:
    """Return the corners of a plate, and how far they are widened."""
    markers = m.values.refs(item, "marker_name", ("marker", "floating_marker"))
    if len(markers) < 3:
        raise ViewError(f"{item.path}: a plate has three corners or more", item.line)
    a, r = m.values.pose(markers[0])
    corners = np.array([a.T @ (m.values.point(one) - r) for one in markers])
    if np.abs(corners[:, 2]).max() > 1e-6 * np.abs(corners).max():
        raise ViewError(f"{item.path}: its corners are not in the plane of the first marker", item.line)
    width = need(m, item, "width")
    return (markers[0], corners[:, :2], -width / 2.0, width / 2.0), m.values.number(item, "radius", 0.0) or 0.0


Turn = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]


def _turns(points: np.ndarray) -> Iterator[Turn]:
    """Yield the corners of a polygon that goes round to the left: corner, edge after it, the directions of the edges
    before and after it, and the angle between these, negative where the corner goes inwards.

    Raises
    ------
    ViewError
        If two corners are one.
    """
    thin = 1e-12 * float(np.ptp(points))
    for k in range(len(points)):
        edge, last = points[(k + 1) % len(points)] - points[k], points[k] - points[k - 1]
        length, before = float(np.hypot(*edge)), float(np.hypot(*last))
        if not min(length, before) > thin:
            raise ViewError("two corners of a plate or link are one")
        w, x = last / before, edge / length
        turn = math.pi if len(points) == 2 else math.atan2(w[0] * x[1] - w[1] * x[0], float(w @ x))
        yield points[k], edge, w, x, turn


def _leftwards(points: np.ndarray) -> np.ndarray:
    return points[::-1] if sum(area for area, _ in _triangles(points)) < 0.0 else points


def _widened(points: np.ndarray, radius: float) -> np.ndarray:
    """Return the outline of a polygon, or a line, widened by a radius: arcs as chords, fillets at inner corners."""
    if radius == 0.0:
        return points
    found = []
    for p, _, w, x, turn in _turns(_leftwards(points)):
        n, o = np.array([w[1], -w[0]]), np.array([x[1], -x[0]])
        centre = p if turn >= 0.0 else p + 2.0 * radius * (n + o) / (1.0 + math.cos(turn))
        start = math.atan2(*(n if turn >= 0.0 else -n)[::-1])
        count = max(1, round(SIDES * abs(turn) / (2.0 * math.pi)))
        at = start + turn * np.arange(count + 1) / count
        found.append(centre + radius * np.column_stack([np.cos(at), np.sin(at)]))
    return np.concatenate(found)


def rounded(points: np.ndarray, radius: float, low: float, high: float) -> Moments:
    """Return the moments of a plate: a polygon widened by a radius, with arcs at corners and fillets at inner ones."""
    total = prism(*polygon(points), low, high)
    if radius == 0.0:
        return total

    def cap(angle: float, start: np.ndarray, centre: np.ndarray, sign: float) -> Moments:
        a = np.eye(3)
        a[:2, 0], a[:2, 1] = start, (-start[1], start[0])
        area, sx, sy, sxx, syy, sxy = sector(angle)
        r = radius
        solid = prism(area * r**2, sx * r**3, sy * r**3, sxx * r**4, syy * r**4, sxy * r**4, low, high)
        return solid.moved(a, np.array([*centre, 0.0])).times(sign)

    for p, edge, w, x, turn in _turns(_leftwards(points)):
        n, o = np.array([w[1], -w[0]]), np.array([x[1], -x[0]])
        strip = np.array([p, p + radius * o, p + edge + radius * o, p + edge])
        total += prism(*polygon(strip), low, high)
        if turn >= 0.0:
            total += cap(turn, n, p, 1.0)
            continue
        # two strips have a kite in common; the fillet fills the kite beyond it but for a sector
        out = radius * (n + o) / (1.0 + math.cos(turn))
        total += prism(*polygon(np.array([p, p + radius * n, p + out, p + radius * o])), low, high).times(-1.0)
        centre = p + 2.0 * out
        beyond = np.array([p + out, centre - radius * n, centre, centre - radius * o])
        total += prism(*polygon(beyond), low, high) + cap(-turn, -o, centre, -1.0)
    return total


def sector(angle: float) -> tuple[float, float, float, float, float, float]:
    """Return area, first and second moments of a sector of the unit circle that begins at x."""
    s, c = math.sin(angle), math.cos(angle)
    if abs(angle - 2.0 * math.pi) < 1e-12:
        s, c = 0.0, 1.0
    half, squares = angle / 2.0, s * c / 2.0
    return half, s / 3.0, (1.0 - c) / 3.0, (half + squares) / 4.0, (half - squares) / 4.0, s * s / 8.0


def block_outline(m: Deckmaker, item: Item) -> Outline:
    """Return the outline of a block, whose sizes may be negative."""
    marker, (x, y, z) = block_corner(m, item)
    return marker, np.array([[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]]), min(z, 0.0), max(z, 0.0)


CHORDS = 512
"""Sides of the polygon, of the circle's area, that a cylinder cut by planes is taken for: 2e-5 radii off the circle."""


def cylinder_outline(m: Deckmaker, item: Item) -> Outline:
    """Return the outline of a whole cylinder.

    Raises
    ------
    ViewError
        If it is a sector, or has sides.
    """
    if abs(abs(_angle(m, item)) - 2.0 * math.pi) > 1e-9 or _sides(m, item):
        raise ViewError(f"{item.path} is part of a cylinder in a csg, whose mass is not computed; {REMEDY}", item.line)
    at = 2.0 * math.pi / CHORDS * np.arange(CHORDS)
    radius = _radius(m, item) * math.sqrt(at[1] / math.sin(at[1]))
    points = radius * np.column_stack([np.cos(at), np.sin(at)])
    length = need(m, item, "length")
    return _marker(m, item, "center_marker"), points, min(length, 0.0), max(length, 0.0)


def link_outline(m: Deckmaker, item: Item) -> Outline:
    """Return the outline of a link."""
    (marker, points, low, high), radius = _spine(m, item)
    return marker, _widened(points, radius), low, high


def plate_outline(m: Deckmaker, item: Item) -> Outline:
    """Return the outline of a plate."""
    (marker, points, low, high), radius = _corners(m, item)
    return marker, _widened(points, radius), low, high


def _profile(m: Deckmaker, item: Item) -> np.ndarray:
    points = m.values.numbers(item, "points_for_profile")
    if points is None or len(points) % 3 or len(points) < 9:
        raise ViewError(f"{item.path}: its profile is not given by points", item.line)
    found = np.array(points).reshape(-1, 3)
    relative = m.values.ref(item, "relative_to")
    home = _marker(m, item, "reference_marker")
    if relative is not None and relative is not home:
        a, r = m.values.pose(relative)
        b, s = m.values.pose(home)
        found = (found @ a.T + r - s) @ b
    return found[:-1] if np.allclose(found[0], found[-1]) else found


def extrusion_outline(m: Deckmaker, item: Item) -> Outline:
    """Return the profile of an extrusion along z."""
    points = _profile(m, item)
    length = m.values.number(item, "length_along_z_axis")
    if length is None or np.ptp(points[:, 2]) > 1e-9 * np.abs(points).max():
        raise ViewError(f"{item.path}: an extrusion along a path", item.line)
    z = float(points[0, 2])
    return _marker(m, item, "reference_marker"), points[:, :2], min(z, z + length), max(z, z + length)


def _revolution(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    points = _profile(m, item)
    rho = np.hypot(points[:, 0], points[:, 1])
    return _marker(m, item, "reference_marker"), revolution(np.column_stack([rho, points[:, 2]]), _angle(m, item))


def _drawn_out(outline: Callable[[Deckmaker, Item], Outline]) -> Shape:
    """Return the shape of an outline that is drawn out along z."""

    def shape(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
        marker, points, low, high = outline(m, item)
        return marker, prism(*polygon(points), low, high)

    return shape


def _plate(m: Deckmaker, item: Item) -> tuple[Item, Moments]:
    (marker, points, low, high), radius = _corners(m, item)
    return marker, rounded(points, radius, low, high)


SHAPES: dict[str, Shape] = {
    "block": _block, "cylinder": _cylinder, "frustum": _frustum, "ellipsoid": _ellipsoid, "sphere": _sphere,
    "torus": _torus, "link": _drawn_out(link_outline), "plate": _plate,
    "extrusion": _drawn_out(extrusion_outline), "revolution": _revolution,
}  # fmt: skip
"""Shapes whose moments are known exactly."""
REMEDY = "give the part mass, center_of_mass_marker, ixx, iyy and izz"


def polyhedron(vertices: np.ndarray, triangles: np.ndarray) -> Moments:
    """Return the moments of a closed surface of triangles: those of the tetrahedra over the origin."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    whole = a + b + c
    second = np.einsum("i,ij,ik->jk", volume, whole, whole)
    for corner in (a, b, c):
        second += np.einsum("i,ij,ik->jk", volume, corner, corner)
    return Moments(float(volume.sum()), (volume[:, None] * whole).sum(axis=0) / 4.0, second / 20.0)
