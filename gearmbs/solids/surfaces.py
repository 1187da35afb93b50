"""Surfaces of Parasolid bodies: points by their parameters u, v, and the parameters of points.

Source: Siemens, Parasolid XT Format Reference, section 5.2.2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.solids.transmit import Node, Nodes

# Curves of Parasolid bodies: points by a parameter, and edges as chains of points.
#
# Source: Siemens, Parasolid XT Format Reference, section 5.2.1.


TURN = np.pi / 9
"""Largest angle between two chords of a chain, rad, whatever the tolerance."""
MOST = 20_000
"""Chords of an arc."""
DEEPEST = 12
"""Halvings of a piece of a curve."""


class Curve(ABC):
    """A curve by its parameter t.

    Attributes
    ----------
    period : float or None
    low, high : float
        Range of t.
    """

    period: float | None = None
    low = -np.inf
    high = np.inf

    @abstractmethod
    def points(self, t: np.ndarray) -> np.ndarray:
        """Return points, shape (n, 3), m, or (n, 2) of a curve in a surface's parameters."""

    def parameter(self, x: np.ndarray) -> float:
        """Return t of the point of the curve that is nearest to x, found from many."""
        t = np.linspace(self.low, self.high, 201)
        for _ in range(12):
            far = np.linalg.norm(self.points(t) - x, axis=1)
            k = int(np.argmin(far))
            t = np.linspace(t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)], 11)
        return float(t[5])


@dataclass
class Line(Curve):
    """P + t D."""

    origin: np.ndarray
    direction: np.ndarray

    def points(self, t: np.ndarray) -> np.ndarray:
        return self.origin + np.outer(t, self.direction)

    def parameter(self, x: np.ndarray) -> float:
        return float((x - self.origin) @ self.direction)


@dataclass
class Ellipse(Curve):
    """C + a X cos t + b Y sin t."""

    centre: np.ndarray
    x: np.ndarray
    y: np.ndarray
    a: float
    b: float
    period = 2.0 * np.pi

    def points(self, t: np.ndarray) -> np.ndarray:
        return self.centre + np.outer(self.a * np.cos(t), self.x) + np.outer(self.b * np.sin(t), self.y)

    def parameter(self, x: np.ndarray) -> float:
        d = x - self.centre
        return float(np.arctan2(d @ self.y / self.b, d @ self.x / self.a))


class BSpline(Curve):
    """A B-spline, rational or not, in space or in a surface's parameters."""

    def __init__(self, nodes: Nodes, node: Node) -> None:
        from scipy.interpolate import BSpline as Spline

        nurbs = nodes[node.nurbs]
        poles = np.array(nodes[nurbs.bspline_vertices].vertices, dtype=float).reshape(-1, nurbs.vertex_dim)
        knots = np.repeat(nodes[nurbs.knots].knots, nodes[nurbs.knot_mult].mult)
        if len(knots) != len(poles) + nurbs.degree + 1:
            raise ModelError(f"its B-spline {node.index} has {len(knots)} knots for {len(poles)} vertices")
        self._spline = Spline(knots, poles, nurbs.degree)
        self._rational = nurbs.rational == "T"
        self.low, self.high = float(knots[nurbs.degree]), float(knots[-1 - nurbs.degree])
        self.period = self.high - self.low if nurbs.periodic == "T" or nurbs.closed == "T" else None

    def points(self, t: np.ndarray) -> np.ndarray:
        values = self._spline(np.clip(_wrapped(t, self.low, self.period), self.low, self.high))
        return values[:, :-1] / values[:, -1:] if self._rational else values


@dataclass
class Chain(Curve):
    """Points one after the other, as an intersection of surfaces is given by; t is their number."""

    places: np.ndarray
    closed: bool

    def __post_init__(self) -> None:
        self.low, self.high = 0.0, len(self.places) - 1.0
        self.period = self.high if self.closed else None

    def points(self, t: np.ndarray) -> np.ndarray:
        t = np.clip(_wrapped(t, 0.0, self.period), self.low, self.high)
        k = np.minimum(t.astype(int), len(self.places) - 2)
        part = (t - k)[:, None]
        return (1.0 - part) * self.places[k] + part * self.places[k + 1]

    def parameter(self, x: np.ndarray) -> float:
        a, b = self.places[:-1], self.places[1:]
        along = b - a
        part = np.clip(np.sum((x - a) * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
        far = np.linalg.norm(a + part[:, None] * along - x, axis=1)
        k = int(np.argmin(far))
        return k + float(part[k])


@dataclass
class InSurface(Curve):
    """A curve in the parameters of a surface."""

    surface: Any
    curve: BSpline

    def __post_init__(self) -> None:
        self.low, self.high, self.period = self.curve.low, self.curve.high, self.curve.period
        first, last = self.points(np.array([self.low, self.high]))
        if self.period is None and np.linalg.norm(last - first) < 1e-9:
            # around the surface: open in its parameters
            self.period = self.high - self.low

    def points(self, t: np.ndarray) -> np.ndarray:
        return self.surface.points(self.curve.points(_wrapped(t, self.low, self.period)))


def _wrapped(t: np.ndarray, low: float, period: float | None) -> np.ndarray:
    t = np.asarray(t, dtype=float)
    if period is None:
        return t
    turns = np.floor((t - low) / period)
    back = t - turns * period
    return np.where((t > low) & (np.abs(back - low) < 1e-12 * period), low + period, back)


def curve_of(nodes: Nodes, number: int, surface: Callable[[int], Any]) -> Curve:
    """Return the curve of a node.

    Parameters
    ----------
    nodes : Nodes
    number : int
    surface : callable
        Returns the surface of a node by its number.

    Raises
    ------
    ModelError
        If it is of a kind that is not read.
    """
    node = nodes[number]
    if node.kind == "LINE":
        return Line(np.array(node.pvec), np.array(node.direction))
    if node.kind in ("CIRCLE", "ELLIPSE"):
        a = node.radius if node.kind == "CIRCLE" else node.major_radius
        b = node.radius if node.kind == "CIRCLE" else node.minor_radius
        x = np.array(node.x_axis)
        return Ellipse(np.array(node.centre), x, np.cross(node.normal, x), a, b)
    if node.kind == "B_CURVE":
        return BSpline(nodes, node)
    if node.kind == "SP_CURVE":
        return InSurface(surface(node.surface), BSpline(nodes, nodes[node.b_curve]))
    if node.kind == "TRIMMED_CURVE":
        return curve_of(nodes, node.basis_curve, surface)
    if node.kind == "INTERSECTION":
        return _intersection(nodes, node, surface)
    if node.kind == "POLYLINE":
        data = nodes[node.data]
        return Chain(np.array(nodes[data.pvec].values), data.closed == "T")
    raise ModelError(f"its edges have curves of the kind {node.kind}, which are not read; save the solid as .stl")


FINER = 8
"""Pieces into which the chart of an intersection is divided for its points to be brought onto both surfaces."""


def _intersection(nodes: Nodes, node: Node, surface: Callable[[int], Any]) -> Chain:
    """Return an intersection as points: those of its chart, and points between them on both surfaces."""
    chart = [np.array(p) for p in nodes[node.chart].hvec]
    ends = []
    for number in (node.start, node.end):
        limit = nodes[number] if number in nodes else None
        ends.append(np.array(limit.hvec[0]) if limit is not None and limit.type == "T" else None)
    places = np.array(([] if ends[0] is None else [ends[0]]) + chart + ([] if ends[1] is None else [ends[1]]))
    closed = node.start in nodes and nodes[node.start].type == "H"
    if closed and np.linalg.norm(places[0] - places[-1]) > 1e-9:
        places = np.vstack([places, places[:1]])
    rough = Chain(places, closed)
    fine = rough.points(np.linspace(0.0, rough.high, FINER * (len(places) - 1) + 1))
    chords = np.linalg.norm(np.diff(places, axis=0), axis=1)
    try:
        both = [surface(number) for number in node.surface]
    except ModelError:
        return rough
    out = fine.copy()
    for _ in range(20):
        before = out
        for s in both:
            out = s.points(s.project(out))
        if np.abs(out - before).max() < 1e-12:
            break
    # where it does not come back, as at places where the surfaces touch, the chord stays
    far = np.linalg.norm(out - fine, axis=1)
    bad = ~(far < 0.3 * np.repeat(np.r_[chords, chords[-1:]], FINER)[: len(fine)])
    out[bad] = fine[bad]
    out[::FINER] = places
    return Chain(out, closed)


def chain(curve: Curve, t0: float, t1: float, tolerance: float) -> np.ndarray:
    """Return points of a curve from t0 to t1, both included, whose chords stay within a tolerance, m, of it.

    Of an intersection the given points are kept as they are where they lie far enough apart.
    """
    if isinstance(curve, Line):
        return curve.points(np.array([t0, t1]))
    if isinstance(curve, Ellipse):
        step = min(TURN, 2.0 * np.arccos(max(1.0 - tolerance / max(curve.a, curve.b), 0.0)))
        pieces = max(1, int(np.ceil(abs(t1 - t0) / step - 1e-9)))
        if pieces > MOST:
            raise ModelError(f"an arc of radius {curve.a:.6g} m needs {pieces} chords; give a larger tolerance")
        return curve.points(np.linspace(t0, t1, pieces + 1))
    t = np.linspace(t0, t1, 5)
    for _ in range(DEEPEST):
        middle = 0.5 * (t[:-1] + t[1:])
        ends, between = curve.points(t), curve.points(middle)
        first, second = between - ends[:-1], ends[1:] - between
        sizes = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
        turn = np.arccos(np.clip(np.sum(first * second, axis=1) / np.maximum(sizes, 1e-300), -1.0, 1.0))
        sag = np.linalg.norm(between - 0.5 * (ends[:-1] + ends[1:]), axis=1)
        split = ((sag > tolerance) | (turn > TURN)) & (sag > 1e-3 * tolerance)
        if not split.any():
            break
        t = np.sort(np.r_[t, middle[split]]) if t1 > t0 else -np.sort(-np.r_[t, middle[split]])
    return _thinned(curve.points(t), tolerance)


def _thinned(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return a chain without the inner points that lie on the chord of their neighbours."""
    kept = [0]
    for k in range(1, len(points) - 1):
        a, b = points[kept[-1]], points[k + 1]
        along = b - a
        size = np.linalg.norm(along)
        passed = points[kept[-1] + 1 : k + 1] - a
        off = passed - np.outer(passed @ along / max(size**2, 1e-300), along)
        turned = np.linalg.norm(np.cross(along, points[k] - a)) > np.sin(TURN) * size * np.linalg.norm(points[k] - a)
        if np.linalg.norm(off, axis=1).max() > tolerance or turned or size == 0.0:
            kept.append(k)
    return points[[*kept, len(points) - 1]]


ROUND = 2.0 * np.pi
GRID = 41
"""Points along each parameter from which the nearest one to a point is sought."""
ITERATIONS = 40


class Surface(ABC):
    """A surface by u and v.

    Attributes
    ----------
    kind : str
    periods : tuple of float or None
    poles : tuple of float
        Values of v at which the surface is one point for all u.
    sense : float
        -1 if its normal is against dS/du x dS/dv.
    """

    kind = ""
    periods: tuple[float | None, float | None] = (None, None)
    poles: tuple[float, ...] = ()
    sense = 1.0

    @abstractmethod
    def points(self, uv: np.ndarray) -> np.ndarray:
        """Return points, shape (n, 3), m."""

    @abstractmethod
    def project(self, x: np.ndarray) -> np.ndarray:
        """Return the parameters, shape (n, 2), of the points of the surface nearest to x, shape (n, 3)."""

    def normal(self, uv: np.ndarray, spans: np.ndarray) -> np.ndarray:
        """Return the normal at one place, not of unit length, from differences over a small part of a face's spans."""
        step = 1e-4 * spans
        du, dv = np.array([step[0], 0.0]), np.array([0.0, step[1]])
        p = self.points(np.array([uv + du, uv - du, uv + dv, uv - dv]))
        return self.sense * np.cross(p[0] - p[1], p[2] - p[3])


class Turned(Surface):
    """A surface in a frame with an axis: a plane, a cylinder, a cone, a sphere or a torus."""

    radius = 0.0
    tube = 0.0
    slope = 0.0

    def __init__(self, node: Node) -> None:
        kind = self.kind = node.kind
        self.origin = np.array(node.centre if kind in ("SPHERE", "TORUS") else node.pvec, dtype=float)
        self.axis = np.array(node.normal if kind == "PLANE" else node.axis, dtype=float)
        self.x = np.array(node.x_axis, dtype=float)
        self.y = np.cross(self.axis, self.x)
        if kind in ("CYLINDER", "CONE", "SPHERE"):
            self.radius = float(node.radius)
        if kind == "CONE":
            # in the files the cone widens along its axis
            self.slope = node.sin_half_angle / node.cos_half_angle
            self.poles = (-self.radius / self.slope,)
        if kind == "TORUS":
            self.radius, self.tube = float(node.major_radius), float(node.minor_radius)
        if kind == "SPHERE":
            self.poles = (-np.pi / 2, np.pi / 2)
        self.periods = {
            "PLANE": (None, None), "CYLINDER": (ROUND, None), "CONE": (ROUND, None),
            "SPHERE": (ROUND, None), "TORUS": (ROUND, ROUND),
        }[kind]  # fmt: skip
        self.sense = -1.0 if node.sense == "-" else 1.0

    def points(self, uv: np.ndarray) -> np.ndarray:
        u, v = uv[:, 0], uv[:, 1]
        if self.kind == "PLANE":
            return self.origin + np.outer(u, self.x) + np.outer(v, self.y)
        if self.kind == "CYLINDER":
            r, z = np.full_like(u, self.radius), v
        elif self.kind == "CONE":
            r, z = self.radius + v * self.slope, v
        elif self.kind == "SPHERE":
            r, z = self.radius * np.cos(v), self.radius * np.sin(v)
        else:
            r, z = self.radius + self.tube * np.cos(v), self.tube * np.sin(v)
        return self.origin + np.outer(r * np.cos(u), self.x) + np.outer(r * np.sin(u), self.y) + np.outer(z, self.axis)

    def project(self, x: np.ndarray) -> np.ndarray:
        d = x - self.origin
        a, b, z = d @ self.x, d @ self.y, d @ self.axis
        if self.kind == "PLANE":
            return np.column_stack([a, b])
        r, u = np.hypot(a, b), np.arctan2(b, a)
        if self.kind == "CONE":
            z = (z + self.slope * (r - self.radius)) / (1.0 + self.slope**2)
        elif self.kind == "SPHERE":
            z = np.arctan2(z, r)
        elif self.kind == "TORUS":
            z = np.arctan2(z, r - self.radius)
        return np.column_stack([u, z])


class Searched(Surface):
    """A surface on which the nearest point is sought: from a grid, then by Newton's method."""

    low: np.ndarray
    high: np.ndarray
    _grid: tuple[np.ndarray, np.ndarray] | None = None

    def _inside(self, uv: np.ndarray) -> np.ndarray:
        out = uv.copy()
        for k, period in enumerate(self.periods):
            if period is None:
                out[:, k] = np.clip(out[:, k], self.low[k], self.high[k])
            else:
                out[:, k] = self.low[k] + np.mod(out[:, k] - self.low[k], period)
        return out

    def project(self, x: np.ndarray) -> np.ndarray:
        if self._grid is None:
            u, v = (np.linspace(self.low[k], self.high[k], GRID) for k in range(2))
            places = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
            self._grid = places, self.points(places)
        places, known = self._grid
        uv = np.array([places[np.argmin(np.sum((known - p) ** 2, axis=1))] for p in x])
        step = 1e-6 * (self.high - self.low)
        du, dv = np.array([step[0], 0.0]), np.array([0.0, step[1]])
        best, found = np.full(len(x), np.inf), uv.copy()
        for _ in range(ITERATIONS):
            here = self.points(uv)
            r = x - here
            far = np.sum(r**2, axis=1)
            better = far < best
            found[better], best[better] = uv[better], far[better]
            up, down = self._inside(uv + du), self._inside(uv - du)
            su = (self.points(up) - self.points(down)) / _step(up[:, 0] - down[:, 0], 2 * step[0])
            up, down = self._inside(uv + dv), self._inside(uv - dv)
            sv = (self.points(up) - self.points(down)) / _step(up[:, 1] - down[:, 1], 2 * step[1])
            a, b, c = (np.sum(p * q, axis=1) for p, q in ((su, su), (su, sv), (sv, sv)))
            f, g = np.sum(su * r, axis=1), np.sum(sv * r, axis=1)
            det = np.maximum(a * c - b * b, np.maximum(1e-30 * a * c, 1e-300))
            move = np.column_stack([(c * f - b * g) / det, (a * g - b * f) / det])
            limit = 0.1 * (self.high - self.low)
            uv = self._inside(uv + np.clip(move, -limit, limit))
            if np.all(np.abs(move) < 1e-13 * (self.high - self.low)):
                break
        return found


def _step(moved: np.ndarray, full: float) -> np.ndarray:
    """Return by how much a parameter moved; where it went around, the whole step."""
    return np.where((moved > 0.0) & (moved <= 1.01 * full), moved, full)[:, None]


class BSplineSurface(Searched):
    """A B-spline surface, rational or not."""

    kind = "B_SURFACE"

    def __init__(self, nodes: Nodes, node: Node) -> None:
        from scipy.interpolate import NdBSpline

        n = nodes[node.nurbs]
        shape = (n.n_u_vertices, n.n_v_vertices, n.vertex_dim)
        poles = np.array(nodes[n.bspline_vertices].vertices, dtype=float)
        if poles.size != np.prod(shape):
            raise ModelError(f"its B-spline surface {node.index} has {poles.size} numbers for {shape[:2]} vertices")
        knots, degrees = [], (n.u_degree, n.v_degree)
        for k, (values, mult) in enumerate(((n.u_knots, n.u_knot_mult), (n.v_knots, n.v_knot_mult))):
            knots.append(np.repeat(nodes[values].knots, nodes[mult].mult))
            if len(knots[k]) != shape[k] + degrees[k] + 1:
                raise ModelError(f"its B-spline surface {node.index} has {len(knots[k])} knots for {shape[k]} vertices")
        self._spline = NdBSpline(tuple(knots), poles.reshape(shape), degrees)
        self._rational = n.rational == "T"
        self.low = np.array([knots[k][degrees[k]] for k in range(2)])
        self.high = np.array([knots[k][-1 - degrees[k]] for k in range(2)])
        spans = self.high - self.low
        around = (n.u_periodic == "T" or n.u_closed == "T", n.v_periodic == "T" or n.v_closed == "T")
        self.periods = (float(spans[0]) if around[0] else None, float(spans[1]) if around[1] else None)
        self.sense = -1.0 if node.sense == "-" else 1.0

    def points(self, uv: np.ndarray) -> np.ndarray:
        values = self._spline(self._inside(uv))
        return values[:, :-1] / values[:, -1:] if self._rational else values


# Parameters of a surface as a plane: unrolled, or of a sphere stereographic.


class Flat:
    """The parameters of a surface as the plane of the triangulation, periods unrolled."""

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.periods = surface.periods

    def to_plane(self, x: np.ndarray) -> np.ndarray:
        """Return places in the plane, shape (n, 2)."""
        return self.surface.project(x)

    def to_space(self, uv: np.ndarray) -> np.ndarray:
        """Return points, shape (n, 3)."""
        return self.surface.points(uv)


class FromPoint(Flat):
    """A sphere seen from one of its points, stereographically; scale 1 at the opposite side."""

    def __init__(self, sphere: Turned, away: np.ndarray) -> None:
        super().__init__(sphere)
        self.periods = (None, None)
        self.centre, self.radius, self.away = sphere.origin, sphere.radius, away
        k = int(np.argmin(np.abs(away)))
        first = np.cross(away, np.eye(3)[k])
        self.e1 = first / np.linalg.norm(first)
        # seen against `away` from outside, (e1, e2) turns with the outward normal
        self.e2 = np.cross(-away, self.e1)

    def to_plane(self, x: np.ndarray) -> np.ndarray:
        d = (x - self.centre) / np.linalg.norm(x - self.centre, axis=1)[:, None]
        w = 2.0 / np.maximum(1.0 - d @ self.away, 1e-12)
        return np.column_stack([w * (d @ self.e1), w * (d @ self.e2)])

    def to_space(self, uv: np.ndarray) -> np.ndarray:
        square = np.sum(uv**2, axis=1)[:, None]
        d = (4.0 * (uv[:, :1] * self.e1 + uv[:, 1:] * self.e2) + (square - 4.0) * self.away) / (square + 4.0)
        return self.centre + self.radius * d


def free_point(sphere: Turned, left: float, loops: list[np.ndarray], places: np.ndarray) -> np.ndarray:
    """Return a direction from a sphere's centre that a face does not hold, far from its loops."""
    k = np.arange(400)
    z = 1.0 - (2.0 * k + 1.0) / 400
    phi = k * np.pi * (3.0 - np.sqrt(5.0))
    directions = np.column_stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z])
    on = np.vstack([places[loop] for loop in loops]) - sphere.origin
    on /= np.linalg.norm(on, axis=1)[:, None]
    for c in np.argsort((directions @ on.T).max(axis=1)):
        flat = FromPoint(sphere, directions[c])
        shapes = [flat.to_plane(places[loop]) for loop in loops]
        # the widest loop is the outer one; the face is inside it if it turns to the left
        areas = [area(s) for s in shapes]
        widest = int(np.argmax(np.abs(areas)))
        if areas[widest] * left > 0.0:
            return directions[c]
    raise ModelError("a face covers its whole sphere and has edges; save the solid as .stl")


def area(polygon: np.ndarray) -> float:
    """Return the signed area of a polygon, positive if it turns to the left."""
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
