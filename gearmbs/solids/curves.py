"""Curves of Parasolid bodies: points by a parameter, and edges as chains of points.

Source: Siemens, Parasolid XT Format Reference, section 5.2.1.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.solids.transmit import Node, Nodes

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

    def points(self, t: np.ndarray) -> np.ndarray:
        return self.surface.points(self.curve.points(t))


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
        for s in both:
            out = s.points(s.project(out))
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
