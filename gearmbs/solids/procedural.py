"""Surfaces of Parasolid bodies that are made of curves and other surfaces: swept, spun, moved along the normal, rolled.

Source: Siemens, Parasolid XT Format Reference, section 5.2.2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.solids.surfaces import ITERATIONS, ROUND, BSplineSurface, Chain, Curve, Searched, Surface, Turned, curve_of
from gearmbs.solids.transmit import Node, Nodes


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


class Smooth(Curve):
    """A smooth curve through the points of a chain, by the length of its chords: of a chain the tangent jumps."""

    def __init__(self, chain: Chain) -> None:
        from scipy.interpolate import CubicSpline

        apart = np.linalg.norm(np.diff(chain.places, axis=0), axis=1)
        kept = np.r_[True, apart > 1e-12 * apart.max()]
        self.chain, self._t = chain, np.r_[0.0, np.cumsum(apart)]
        places = chain.places[kept].copy()
        if chain.closed:
            places[-1] = places[0]
        self._spline = CubicSpline(self._t[kept], places, bc_type="periodic" if chain.closed else "not-a-knot")
        self.low, self.high = 0.0, float(self._t[-1])
        self.period = self.high if chain.closed else None

    def points(self, t: np.ndarray) -> np.ndarray:
        return self._spline(t)

    def parameter(self, x: np.ndarray) -> float:
        return float(np.interp(self.chain.parameter(x), np.arange(len(self._t)), self._t))


class Blend(Searched):
    """What a ball leaves that rolls along two surfaces: a circle about each point of its spine, square to it.

    u is the spine's parameter, v the angle from the place where the ball touches the first surface, towards the second.
    """

    kind = "BLENDED_EDGE"

    def __init__(self, spine: Curve, beside: tuple[Surface, Surface], radius: float, sense: float) -> None:
        spine = Smooth(spine) if isinstance(spine, Chain) else spine
        self.spine, self.beside, self.radius = spine, beside, radius
        low, high, period = _range(spine)
        self.low, self.high = np.array([low, -np.pi]), np.array([high, np.pi])
        self.periods = (period, ROUND)
        middle = np.array([0.5 * (low + high)])
        along, first = self._frame(middle)
        across = np.cross(along, first)
        second = beside[1].project(self.spine.points(middle))
        self.hand = 1.0 if float(across[0] @ (beside[1].points(second) - self.spine.points(middle))[0]) > 0.0 else -1.0
        self.sense = -self.hand * sense

    def _frame(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the directions of the spine, and from it to the first surface."""
        step = 1e-5 * (self.high[0] - self.low[0])
        before, after = self.spine.points(u - step), self.spine.points(u + step)
        along = _unit(after - before)
        centre = self.spine.points(u)
        to = self.beside[0].points(self.beside[0].project(centre)) - centre
        return along, _unit(to - np.sum(to * along, axis=1)[:, None] * along)

    def points(self, uv: np.ndarray) -> np.ndarray:
        along, first = self._frame(uv[:, 0])
        across = self.hand * np.cross(along, first)
        cos, sin = np.cos(uv[:, 1:]), np.sin(uv[:, 1:])
        return self.spine.points(uv[:, 0]) + self.radius * (cos * first + sin * across)

    def project(self, x: np.ndarray) -> np.ndarray:
        u = np.array([self.spine.parameter(p) for p in x])
        step = 1e-4 * (self.high[0] - self.low[0])
        for _ in range(ITERATIONS):
            # square to the spine: half the derivatives of the squared distance from it
            far = [0.5 * np.sum((x - self.spine.points(u + k * step)) ** 2, axis=1) for k in (-1, 0, 1)]
            slope, curved = (far[2] - far[0]) / (2.0 * step), (far[2] - 2.0 * far[1] + far[0]) / step**2
            move = np.where(curved > 0.0, -slope / np.where(curved > 0.0, curved, 1.0), 0.0)
            u = u + np.clip(move, -100.0 * step, 100.0 * step)
            if np.abs(move).max() < 1e-3 * step:
                break
        along, first = self._frame(u)
        arm = x - self.spine.points(u)
        across = self.hand * np.cross(along, first)
        return np.column_stack([u, np.arctan2(np.sum(arm * across, axis=1), np.sum(arm * first, axis=1))])


class Bound(Surface):
    """Where a rolling ball touches its surfaces: u is the parameter of its spine, v the number of the nearer one."""

    kind = "BLEND_BOUND"

    def __init__(self, blend: Blend) -> None:
        self.blend = blend

    def points(self, uv: np.ndarray) -> np.ndarray:
        return np.where(uv[:, 1:] > 0.5, *self._touched(uv[:, 0])[::-1])

    def project(self, x: np.ndarray) -> np.ndarray:
        u = self.blend.project(x)[:, 0]
        first, second = (np.sum((x - place) ** 2, axis=1) for place in self._touched(u))
        return np.column_stack([u, second < first])

    def _touched(self, u: np.ndarray) -> tuple[np.ndarray, ...]:
        centre = self.blend.spine.points(u)
        return tuple(one.points(one.project(centre)) for one in self.blend.beside)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]


def _range(curve: Curve) -> tuple[float, float, float | None]:
    if curve.period is not None and not np.isfinite(curve.low):
        return 0.0, curve.period, curve.period
    if not np.isfinite(curve.low):
        return -10.0, 10.0, None
    return curve.low, curve.high, curve.period


def surface_of(nodes: Nodes, number: int, surface: Callable[[int], Surface]) -> Surface:
    """Return the surface of a node.

    Parameters
    ----------
    nodes : Nodes
    number : int
    surface : callable
        Returns the surface of another node by its number.

    Raises
    ------
    ModelError
        If it is of a kind that is not read.
    """
    node = nodes[number]
    sense = -1.0 if node.sense == "-" else 1.0
    if node.kind in ("PLANE", "CYLINDER", "CONE", "SPHERE", "TORUS"):
        return Turned(node)
    if node.kind == "B_SURFACE":
        return BSplineSurface(nodes, node)
    if node.kind == "SWEPT_SURF":
        return Swept(curve_of(nodes, node.section, surface), np.array(node.sweep), sense)
    if node.kind == "SPUN_SURF":
        return Spun(curve_of(nodes, node.profile, surface), node)
    if node.kind == "OFFSET_SURF":
        return Offset(surface(node.surface), node.offset)
    if node.kind == "BLEND_BOUND" and isinstance(blend := surface(node.blend), Blend):
        return Bound(blend)
    if node.kind == "BLENDED_EDGE" and node.blend_type == "R" and len({abs(r) for r in node.range}) == 1:
        first, second = (surface(one) for one in node.surface)
        return Blend(curve_of(nodes, node.spine, surface), (first, second), abs(node.range[0]), sense)
    raise ModelError(f"its faces have surfaces of the kind {node.kind}, which are not read; save the solid as .stl")
