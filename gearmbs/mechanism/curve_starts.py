"""Where points and curves touch curves at the start, and how fast the places of contact travel there.

The speeds are those that belong to the velocities of the bodies: a runner that started otherwise would take part of
these along with it when velocities are made consistent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.mechanism.spline_curve import SAMPLES, Curve

if TYPE_CHECKING:
    from gearmbs.mechanism.expression_syntax import Units
    from gearmbs.mechanism.parts import Marker

DIRECTION = 0.2
"""Distance, of a curve's extent, that counts as much as tangents at right angles in this first search."""
ITERATIONS = 50
CLOSE = 1e-14
"""Change of the parameters, of a curve's length, below which they are found."""


def point_speed(point: Marker, rm: Marker, curve: Curve, start: float, units: Units) -> float:
    """Return the rate of the parameter with which a point moves along a curve on the body of another marker."""
    tangent = rm.global_orientation() @ curve.spline()(start, 1)
    place = rm.global_position() + units.length * rm.global_orientation() @ curve.spline()(start)
    apart = point.velocity_at(point.global_position()) - rm.velocity_at(place)
    return float(apart @ tangent / (tangent @ tangent)) / units.factor("velocity")


def touching_parameters(
    rm_i: Marker, curve_i: Curve, rm_j: Marker, curve_j: Curve, units: Units
) -> tuple[float, float]:
    """Return where two plane curves touch, or where they would if they were moved along their common normal.

    The tangents are parallel there, and nothing separates the points along them.
    """
    turn = rm_j.global_orientation().T @ rm_i.global_orientation()
    shift = rm_j.global_orientation().T @ (rm_i.global_position() - rm_j.global_position()) / units.length
    one, other = curve_i.spline(), curve_j.spline()

    def at(s: float, u: float) -> tuple[np.ndarray, ...]:
        of_i = [turn @ one(s, order) for order in range(3)]
        return of_i[0] + shift, of_i[1], of_i[2], other(u), other(u, 1), other(u, 2)

    first = _nearest_alike(curve_i, curve_j, turn, shift)
    s, u = first
    scale = max(curve_i.length, curve_j.length)
    for _ in range(ITERATIONS):
        p, p1, p2, q, q1, q2 = at(s, u)
        apart = p - q
        off = np.array([apart @ p1, _cross(p1, q1)])
        slopes = np.array([[p1 @ p1 + apart @ p2, -q1 @ p1], [_cross(p2, q1), _cross(p1, q2)]])
        try:
            change = -np.linalg.solve(slopes, off)
        except np.linalg.LinAlgError:
            break
        size = float(np.abs(change).max())
        # not further than to the next place at a time: it is the contact next to the first one that is sought
        change *= min(1.0, 0.02 * scale / max(size, 1e-300))
        s, u = _within(curve_i, s + change[0]), _within(curve_j, u + change[1])
        if size <= CLOSE * scale:
            return s, u
    # without an end, as where both curves are equally bent, what is nearer
    return min(first, (s, u), key=lambda pair: float(np.linalg.norm(at(*pair)[0] - at(*pair)[3])))


def touching_speeds(
    rm_i: Marker, curve_i: Curve, rm_j: Marker, curve_j: Curve, starts: tuple[float, float], units: Units
) -> tuple[float, float]:
    """Return the rates of both parameters, with which nothing slips along the tangents and these stay parallel."""
    a_i, a_j = rm_i.global_orientation(), rm_j.global_orientation()
    one, other = curve_i.spline(), curve_j.spline()
    p1, p2 = a_i @ one(starts[0], 1), a_i @ one(starts[0], 2)
    q1, q2 = a_j @ other(starts[1], 1), a_j @ other(starts[1], 2)
    place_i = rm_i.global_position() + units.length * a_i @ one(starts[0])
    place_j = rm_j.global_position() + units.length * a_j @ other(starts[1])
    apart = (rm_i.velocity_at(place_i) - rm_j.velocity_at(place_j)) / units.factor("velocity")
    spin = (rm_i.body.angular_velocity - rm_j.body.angular_velocity) / units.factor("angular_velocity")
    z = a_j[:, 2]
    along = p1 / np.linalg.norm(p1)
    rows = np.array([[p1 @ along, -q1 @ along], [np.cross(p2, q1) @ z, np.cross(p1, q2) @ z]])
    off = np.array([apart @ along, np.cross(np.cross(spin, p1), q1) @ z])
    # where both curves are equally bent the place of contact is not determined
    speeds = np.linalg.lstsq(rows, -off, rcond=1e-10)[0]
    return float(speeds[0]), float(speeds[1])


def _nearest_alike(curve_i: Curve, curve_j: Curve, turn: np.ndarray, shift: np.ndarray) -> tuple[float, float]:
    """Return parameters of two curves' points that come nearest with tangents that are nearly parallel."""
    from scipy.spatial import cKDTree

    features, parameters = [], []
    size = min(float(np.ptp(c.points, axis=0).max()) for c in (curve_i, curve_j))
    for curve, matrix, by in ((curve_i, turn, shift), (curve_j, np.eye(3), np.zeros(3))):
        s = np.linspace(0.0, curve.length, SAMPLES * len(curve.points))
        spline = curve.spline()
        tangent = spline(s, 1) @ matrix.T
        twice = 2.0 * np.arctan2(tangent[:, 1], tangent[:, 0])
        unit = 0.5 * DIRECTION * size
        places = spline(s) @ matrix.T + by
        features.append(np.column_stack([places, unit * np.cos(twice), unit * np.sin(twice)]))
        parameters.append(s)
    distances, near = cKDTree(features[1]).query(features[0])
    best = int(np.argmin(distances))
    return float(parameters[0][best]), float(parameters[1][near[best]])


def _within(curve: Curve, s: float) -> float:
    return s % curve.length if curve.closed else min(max(s, 0.0), curve.length)


def _cross(a: np.ndarray, b: np.ndarray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
