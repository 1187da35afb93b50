"""Surfaces of Parasolid bodies: points by their parameters u, v, and the parameters of points.

Source: Siemens, Parasolid XT Format Reference, section 5.2.2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.solids.curves import Curve, curve_of
from gearmbs.solids.transmit import Node, Nodes

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
            det = np.maximum(a * c - b * b, 1e-30 * np.maximum(a * c, 1e-300))
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


class Swept(Searched):
    """C(u) + v D."""

    kind = "SWEPT_SURF"

    def __init__(self, section: Curve, direction: np.ndarray, sense: float) -> None:
        self.section, self.direction, self.sense = section, direction, sense
        low, high, period = _range(section)
        self.low, self.high = np.array([low, -1.0]), np.array([high, 1.0])
        self.periods = (period, None)

    def points(self, uv: np.ndarray) -> np.ndarray:
        return self.section.points(uv[:, 0]) + np.outer(uv[:, 1], self.direction)

    def project(self, x: np.ndarray) -> np.ndarray:
        along = (x - self.section.points(np.array([self.low[0]]))) @ self.direction
        room = np.ptp(along) + 1e-3
        self.low[1], self.high[1], self._grid = along.min() - room, along.max() + room, None
        return super().project(x)


class Spun(Searched):
    """C(u) turned about an axis by v."""

    kind = "SPUN_SURF"

    def __init__(self, profile: Curve, node: Node) -> None:
        self.profile, self.base, self.axis = profile, np.array(node.base), np.array(node.axis)
        self.sense = -1.0 if node.sense == "-" else 1.0
        low, high, period = _range(profile)
        self.low, self.high = np.array([low, 0.0]), np.array([high, ROUND])
        self.periods = (period, ROUND)

    def points(self, uv: np.ndarray) -> np.ndarray:
        c = self.profile.points(uv[:, 0]) - self.base
        z = np.outer(c @ self.axis, self.axis)
        arm, cos, sin = c - z, np.cos(uv[:, 1:]), np.sin(uv[:, 1:])
        return self.base + z + arm * cos + np.cross(self.axis, arm) * sin


class Offset(Searched):
    """Another surface, moved along its normal."""

    kind = "OFFSET_SURF"

    def __init__(self, base: Surface, distance: float) -> None:
        self.base, self.distance, self.sense = base, distance, base.sense
        self.periods, self.poles = base.periods, base.poles
        if isinstance(base, Searched):
            self.low, self.high = base.low, base.high

    def points(self, uv: np.ndarray) -> np.ndarray:
        normals = np.array([self.base.normal(p, np.ones(2)) for p in uv])
        normals *= self.base.sense / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        return self.base.points(uv) + self.base.sense * self.distance * normals

    def project(self, x: np.ndarray) -> np.ndarray:
        # along the normal, the nearest point of both is the same
        return self.base.project(x)


def _range(curve: Curve) -> tuple[float, float, float | None]:
    if curve.period is not None and not np.isfinite(curve.low):
        return 0.0, curve.period, curve.period
    if not np.isfinite(curve.low):
        return -10.0, 10.0, None
    return curve.low, curve.high, curve.period


def surface_of(nodes: Nodes, number: int) -> Surface:
    """Return the surface of a node.

    Raises
    ------
    ModelError
        If it is of a kind that is not read.
    """
    node = nodes[number]
    if node.kind in ("PLANE", "CYLINDER", "CONE", "SPHERE", "TORUS"):
        return Turned(node)
    if node.kind == "B_SURFACE":
        return BSplineSurface(nodes, node)
    if node.kind == "SWEPT_SURF":
        section = curve_of(nodes, node.section, lambda n: surface_of(nodes, n))
        return Swept(section, np.array(node.sweep), -1.0 if node.sense == "-" else 1.0)
    if node.kind == "SPUN_SURF":
        return Spun(curve_of(nodes, node.profile, lambda n: surface_of(nodes, n)), node)
    if node.kind == "OFFSET_SURF":
        return Offset(surface_of(nodes, node.surface), node.offset)
    raise ModelError(f"its faces have surfaces of the kind {node.kind}, which are not read; save the solid as .stl")
