"""The transverse profile as exact curves (arcs, lines, involutes), for drawings and solids of other programs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from gearmbs.gears.spec import GearSpec, involute

SPLINE_POINTS = 25
DEGREE = 5
"""An involute through 25 points by a spline of degree 5 is off by less than 1e-11 of the base radius."""


@dataclass(frozen=True)
class Line:
    """A straight edge; points in m."""

    start: np.ndarray
    stop: np.ndarray

    def turned(self, angle: float) -> Line:
        """Return the edge turned about the origin."""
        return Line(turn(self.start, angle), turn(self.stop, angle))


@dataclass(frozen=True)
class Arc:
    """A circular edge from ``start`` to ``stop`` about ``centre``, anticlockwise if ``sense`` is 1, else -1."""

    start: np.ndarray
    stop: np.ndarray
    centre: np.ndarray
    sense: int

    @property
    def radius(self) -> float:
        """Radius, m."""
        return float(np.hypot(*(self.start - self.centre)))

    @property
    def opening(self) -> float:
        """Angle run through, positive, rad."""
        a, b = self.start - self.centre, self.stop - self.centre
        return float(math.atan2(self.sense * (a[0] * b[1] - a[1] * b[0]), a @ b) % (2.0 * math.pi))

    def turned(self, angle: float) -> Arc:
        """Return the edge turned about the origin."""
        return Arc(turn(self.start, angle), turn(self.stop, angle), turn(self.centre, angle), self.sense)


@dataclass(frozen=True)
class Spline:
    """A B-spline edge of degree 5: control points (n, 2), m, and knots with repetitions."""

    control: np.ndarray
    knots: np.ndarray

    @property
    def start(self) -> np.ndarray:
        """First point, m."""
        return self.control[0]

    @property
    def stop(self) -> np.ndarray:
        """Last point, m."""
        return self.control[-1]

    def turned(self, angle: float) -> Spline:
        """Return the edge turned about the origin."""
        return Spline(turn(self.control, angle), self.knots)

    def points(self, count: int) -> np.ndarray:
        """Return points along the edge, both ends included, shape (count, 2)."""
        from scipy.interpolate import BSpline

        return BSpline(self.knots, self.control, DEGREE)(np.linspace(self.knots[0], self.knots[-1], count))


Edge = Line | Arc | Spline


def turn(points: np.ndarray, angle: float) -> np.ndarray:
    """Return points (..., 2) turned anticlockwise about the origin."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def polar(radius: float, angle: float) -> np.ndarray:
    """Return the point at a radius and an angle, m."""
    return radius * np.array([math.cos(angle), math.sin(angle)])


def profile_edges(gear: GearSpec) -> list[Edge]:
    """Return the closed profile of a perfect wheel, anticlockwise, tooth 0 along +x, from the foot of tooth 0 on."""
    flank = _flank_edges(gear)
    mirrored = [_mirrored(e) for e in reversed(flank)]
    corner = flank[-1].stop
    tip = Arc(corner, corner * [1.0, -1.0], np.zeros(2), 1)
    foot = mirrored[-1].stop
    pitch = 2.0 * math.pi / gear.teeth
    land = Arc(foot, turn(flank[0].start, pitch), np.zeros(2), 1)
    tooth: list[Edge] = [*flank, tip, *mirrored, land]
    return [e.turned(k * pitch) for k in range(gear.teeth) for e in tooth]


def bore_edges(gear: GearSpec) -> list[Edge]:
    """Return the bore (of an internal wheel the rim) as two half circles run clockwise; empty without one."""
    radius = gear.outer_radius if gear.internal else gear.bore_radius
    if radius == 0.0:
        return []
    east, west = polar(radius, 0.0), polar(-radius, 0.0)
    return [Arc(east, west, np.zeros(2), -1), Arc(west, east, np.zeros(2), -1)]


def backwards(edges: list[Edge]) -> list[Edge]:
    """Return a chain of edges run the other way."""
    return [_backwards(edge) for edge in reversed(edges)]


def _backwards(edge: Edge) -> Edge:
    if isinstance(edge, Line):
        return Line(edge.stop, edge.start)
    if isinstance(edge, Arc):
        return Arc(edge.stop, edge.start, edge.centre, -edge.sense)
    return Spline(edge.control[::-1], edge.knots[0] + edge.knots[-1] - edge.knots[::-1])


def _flank_edges(gear: GearSpec) -> list[Edge]:
    """Edges of the clockwise flank of tooth 0 from the root circle outward."""
    begin = max(gear.form_radius, gear.base_radius)
    centre = polar(gear.fillet_centre_radius, -gear.fillet_half_angle)
    foot = polar(gear.root_radius, -gear.fillet_half_angle)
    form = polar(gear.form_radius, -gear.half_angle(begin))
    edges: list[Edge] = [Arc(foot, form, centre, -gear.sign)]
    if gear.form_radius < gear.base_radius * (1.0 - 1e-12):
        edges.append(Line(form, polar(gear.base_radius, -gear.base_half_angle)))
    roll_length = np.linspace(gear.form_roll_length, gear.tip_roll_length, SPLINE_POINTS)
    radius = np.hypot(gear.base_radius, roll_length)
    angle = (
        np.array([gear.sign * involute(math.atan2(s, gear.base_radius)) for s in roll_length]) - gear.base_half_angle
    )
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    points[0] = edges[-1].stop
    places = np.linspace(0.0, 1.0, SPLINE_POINTS) if gear.internal else roll_length / roll_length[-1]
    spline = make_interp_spline(places, points, k=DEGREE)
    control = spline.c.copy()
    control[0], control[-1] = points[0], points[-1]
    edges.append(Spline(control, spline.t))
    if gear.tip_rounding > 0.0:
        corner = polar(gear.corner_radius, -gear.corner_half_angle)
        edges.append(Arc(points[-1], polar(gear.tip_radius, -gear.corner_half_angle), corner, gear.sign))
    return edges


def _mirrored(edge: Edge) -> Edge:
    """Return an edge reflected in the x axis and run backwards."""
    flip = np.array([1.0, -1.0])
    if isinstance(edge, Line):
        return Line(edge.stop * flip, edge.start * flip)
    if isinstance(edge, Arc):
        return Arc(edge.stop * flip, edge.start * flip, edge.centre * flip, edge.sense)
    knots = edge.knots[0] + edge.knots[-1] - edge.knots[::-1]
    return Spline(edge.control[::-1] * flip, knots)
