"""Curves through points, and constraints that keep points or other curves on them.

A point of contact is found by its parameter s, the length along the chords: the travel of a massless runner on the
ground that a slot guides. Of a curve c(s) on the body of marker RM, a point of another body is kept on it by
P - P_RM - A_RM c(s) = 0. That the runner is in equilibrium says that nothing acts along the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.bodies import Marker

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

    from gearmbs.mechanism.language.syntax import Units
    from gearmbs.mechanism.mechanism import Mechanism
    from gearmbs.mechanism.parts.joints import Joint

# Curves through points: cubic splines over the length of the chords, open or closed.


WRAPPED = 20
"""Points by which a closed curve is continued beyond its ends: what a natural end does to a cubic spline falls by a
factor of 3.7 from each point to the next."""
SAMPLES = 40
"""Between two points, where what is nearest is looked for first."""
FLAT = 1e-9
"""Extent in z, of all, below which a curve is plane."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A cubic spline through points.

    Attributes
    ----------
    points : array_like, shape (n, 3)
        In the mechanism's unit of length; at least four. Those of a closed curve begin and end in one place, or do not
        hold the first one again.
    closed : bool
    """

    points: Any
    closed: bool = False

    def __post_init__(self) -> None:
        points = np.asarray(self.points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise ModelError(f"curve: points have the shape {points.shape}; give rows of x, y and z")
        if self.closed and not np.allclose(points[0], points[-1], atol=1e-6 * np.ptp(points, axis=0).max()):
            points = np.vstack([points, points[:1]])
        elif self.closed:
            points = np.vstack([points[:-1], points[:1]])
        if len(points) < 4:
            raise ModelError(f"curve: {len(points)} points; give at least four")
        if not np.linalg.norm(np.diff(points, axis=0), axis=1).min() > 0.0:
            raise ModelError("curve: two points in succession are the same")
        object.__setattr__(self, "points", points)

    @property
    def knots(self) -> np.ndarray:
        """Parameter of each point: length along the chords from the first, shape (n,)."""
        return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))]

    @property
    def length(self) -> float:
        """Largest parameter."""
        return float(self.knots[-1])

    @property
    def plane(self) -> bool:
        """Whether z is the same everywhere."""
        return bool(np.ptp(self.points[:, 2]) <= FLAT * np.ptp(self.points, axis=0).max())

    def tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Return parameters and points of the splines: a closed curve goes on beyond its ends."""
        s, c = self.knots, self.points
        if not self.closed:
            return s, c
        n = len(s) - 1
        number = np.arange(-WRAPPED, n + WRAPPED + 1)
        return s[number % n] + self.length * (number // n), c[number % n]

    def spline(self) -> CubicSpline:
        """Return the curve as a function of its parameter."""
        from scipy.interpolate import CubicSpline

        s, c = self.tables()
        return CubicSpline(s, c, bc_type="natural")

    def nearest(self, place: np.ndarray) -> float:
        """Return the parameter of the point next to a place."""
        curve = self.spline()
        s = np.concatenate([np.linspace(a, b, SAMPLES, endpoint=False) for a, b in zip(self.knots, self.knots[1:])])
        s = np.append(s, self.length)
        best = float(s[np.argmin(np.sum((curve(s) - place) ** 2, axis=1))])
        first, second = curve.derivative(1), curve.derivative(2)
        for _ in range(10):
            apart, tangent = curve(best) - place, first(best)
            slope = tangent @ tangent + apart @ second(best)
            if slope <= 0.0:
                break
            best -= float(apart @ tangent / slope)
        return best % self.length if self.closed else min(max(best, 0.0), self.length)


# Where points and curves touch curves at the start, and how fast the places of contact travel there.
#
# The speeds are those that belong to the velocities of the bodies: a runner that started otherwise would take part of
# these along with it when velocities are made consistent.


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


AXES = "XYZ"


def add_curve(mechanism: Mechanism, name: str, curve: Curve) -> None:
    """Make a curve known to expressions: ``x_of`` and its like write its components."""
    s, points = curve.tables()
    for k, axis in enumerate(AXES):
        mechanism.spline(f"{name}.{axis}", s, points[:, k])


def component(name: str, curve: Curve, axis: int, parameter: str, order: int = 0) -> str:
    """Return a component of a curve, or its derivative by the parameter, as an expression."""
    if curve.closed:
        # MOD has the sign of its first argument
        length = repr(curve.length)
        parameter = f"MOD(MOD({parameter}, {length}) + {length}, {length})"
    return f'CUBSPL({parameter}, 0, "{name}.{AXES[axis]}"' + (f", {order})" if order else ")")


def add_runner(mechanism: Mechanism, name: str, start: float, speed: float) -> tuple[Joint, str]:
    """Add a runner that travels along the ground's z; return its slot, and its travel as an expression.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
    start, speed : float
        Of the parameter, in the mechanism's units.
    """
    units = mechanism.units
    body = mechanism.body(
        name, 0.0, np.zeros(3), position=(0.0, 0.0, start * units.length),
        velocity=(0.0, 0.0, speed * units.length / units.time),
    )  # fmt: skip
    own, base = body.marker(name=f"{name}.I"), mechanism.ground.marker(name=f"{name}.J")
    slot = mechanism.joint("translational", f"{name}.slot", own, base)
    return slot, f'DZ("{own.name}", "{base.name}", "{base.name}")'


def point_on_curve(
    mechanism: Mechanism, name: str, point: Marker, rm: Marker, curve: Curve, start: float | None = None,
    speed: float | None = None,
) -> Joint:  # fmt: skip
    """Keep a marker's origin on a curve given in the frame of another; ADAMS's PTCV.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
    point, rm : Marker
        The point, and the marker in whose frame the curve is given.
    curve : Curve
    start : float, optional
        Parameter at the start; default: that of the nearest point.
    speed : float, optional
        Its rate at the start; default: that of the velocities of both bodies.

    Returns
    -------
    Joint
        In which the runner travels: its translation is the parameter.

    Raises
    ------
    ModelError
        If both markers are on one body.
    """
    if point.body is rm.body:
        raise ModelError(f"curve '{name}': both markers are on body '{rm.body.name}'")
    apart = rm.global_orientation().T @ (point.global_position() - rm.global_position())
    start = curve.nearest(apart / mechanism.units.length) if start is None else start
    speed = point_speed(point, rm, curve, start, mechanism.units) if speed is None else speed
    add_curve(mechanism, name, curve)
    slot, travel = add_runner(mechanism, f"{name}.runner", start, speed)
    for k, axis in enumerate(AXES):
        place = f'D{axis}("{point.name}", "{rm.name}", "{rm.name}")'
        mechanism.general_constraint(f"{name}.{axis}", f"{place} - {component(name, curve, k, travel)}")
    return slot


def curve_on_curve(
    mechanism: Mechanism, name: str, rm_i: Marker, curve_i: Curve, rm_j: Marker, curve_j: Curve,
    starts: tuple[float, float] | None = None, speeds: tuple[float, float] | None = None,
) -> None:  # fmt: skip
    """Keep two plane curves in touch; ADAMS's CVCV. Something else keeps both planes parallel.

    With both parameters and the angle a of I's frame in J's, the points agree and the tangents are parallel.

    Parameters
    ----------
    mechanism : Mechanism
    name : str
    rm_i, rm_j : Marker
        In whose xy planes the curves lie.
    curve_i, curve_j : Curve
    starts : tuple of float, optional
        Parameters at the start; default: where the curves touch.
    speeds : tuple of float, optional
        Their rates at the start; default: those of the velocities of both bodies.

    Raises
    ------
    ModelError
        If a curve is not plane, or both are on one body.
    """
    if rm_i.body is rm_j.body:
        raise ModelError(f"curves '{name}': both are on body '{rm_i.body.name}'")
    for curve in (curve_i, curve_j):
        if not curve.plane:
            raise ModelError(f"curves '{name}': a curve leaves the xy plane of its marker; both must be plane")
    units = mechanism.units
    starts = touching_parameters(rm_i, curve_i, rm_j, curve_j, units) if starts is None else starts
    speeds = touching_speeds(rm_i, curve_i, rm_j, curve_j, starts, units) if speeds is None else speeds
    add_curve(mechanism, f"{name}.I", curve_i)
    add_curve(mechanism, f"{name}.J", curve_j)
    _, first = add_runner(mechanism, f"{name}.runner I", starts[0], speeds[0])
    _, second = add_runner(mechanism, f"{name}.runner J", starts[1], speeds[1])
    angle = f'AZ("{rm_i.name}", "{rm_j.name}")'
    c, s = f"COS({angle})", f"SIN({angle})"

    def of_i(axis: int, order: int = 0) -> str:
        x, y = (component(f"{name}.I", curve_i, k, first, order) for k in (0, 1))
        return f"({c}*{x} - {s}*{y})" if axis == 0 else f"({s}*{x} + {c}*{y})"

    def of_j(axis: int, order: int = 0) -> str:
        return component(f"{name}.J", curve_j, axis, second, order)

    for k in (0, 1):
        apart = f'D{AXES[k]}("{rm_i.name}", "{rm_j.name}", "{rm_j.name}")'
        mechanism.general_constraint(f"{name}.{AXES[k]}", f"{apart} + {of_i(k)} - {of_j(k)}")
    scale = repr(curve_j.length)
    parallel = f"{scale}*({of_i(0, 1)}*{of_j(1, 1)} - {of_i(1, 1)}*{of_j(0, 1)})"
    mechanism.general_constraint(f"{name}.tangent", parallel)


__all__ = [
    "Curve",
    "curve_on_curve",
    "point_on_curve",
]
