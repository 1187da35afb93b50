"""Curves through points, and constraints that keep points or other curves on them.

A point of contact is found by its parameter s, the length along the chords: the travel of a massless runner on the
ground that a slot guides. Of a curve c(s) on the body of marker RM, a point of another body is kept on it by
P - P_RM - A_RM c(s) = 0. That the runner is in equilibrium says that nothing acts along the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.parts import Marker

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

    from gearmbs.mechanism.mechanism import Mechanism

WRAPPED = 20
"""Points by which a closed curve is continued beyond its ends: what a natural end does to a cubic spline falls by a
factor of 3.7 from each point to the next."""
SAMPLES = 40
"""Between two points, where the nearest point is looked for first."""
FLAT = 1e-9
"""Extent in z, of all, below which a curve is plane."""
AXES = "XYZ"


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


def add_runner(mechanism: Mechanism, name: str, start: float, speed: float = 0.0) -> str:
    """Add a runner that travels along the ground's z; return its travel as an expression.

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
    mechanism.joint("translational", f"{name}.slot", own, base)
    return f'DZ("{own.name}", "{base.name}", "{base.name}")'


def point_on_curve(
    mechanism: Mechanism, name: str, point: Marker, rm: Marker, curve: Curve, start: float | None = None,
    speed: float = 0.0,
) -> None:  # fmt: skip
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
    speed : float
        Its rate at the start.

    Raises
    ------
    ModelError
        If both markers are on one body.
    """
    if point.body is rm.body:
        raise ModelError(f"curve '{name}': both markers are on body '{rm.body.name}'")
    apart = rm.global_orientation().T @ (point.global_position() - rm.global_position())
    start = curve.nearest(apart / mechanism.units.length) if start is None else start
    add_curve(mechanism, name, curve)
    travel = add_runner(mechanism, f"{name}.runner", start, speed)
    for k, axis in enumerate(AXES):
        place = f'D{axis}("{point.name}", "{rm.name}", "{rm.name}")'
        mechanism.general_constraint(f"{name}.{axis}", f"{place} - {component(name, curve, k, travel)}")


def curve_on_curve(
    mechanism: Mechanism, name: str, rm_i: Marker, curve_i: Curve, rm_j: Marker, curve_j: Curve,
    starts: tuple[float, float] | None = None,
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
        Parameters at the start; default: where the curves come nearest.

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
    starts = _nearest_parameters(mechanism, rm_i, curve_i, rm_j, curve_j) if starts is None else starts
    add_curve(mechanism, f"{name}.I", curve_i)
    add_curve(mechanism, f"{name}.J", curve_j)
    first = add_runner(mechanism, f"{name}.runner I", starts[0])
    second = add_runner(mechanism, f"{name}.runner J", starts[1])
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


def _nearest_parameters(
    mechanism: Mechanism, rm_i: Marker, curve_i: Curve, rm_j: Marker, curve_j: Curve
) -> tuple[float, float]:
    """Return where two curves come nearest, by turns from the point of I that is nearest to any of J."""
    turn = rm_j.global_orientation().T @ rm_i.global_orientation()
    shift = rm_j.global_orientation().T @ (rm_i.global_position() - rm_j.global_position()) / mechanism.units.length
    one, other = curve_i.spline(), curve_j.spline()
    s = np.linspace(0.0, curve_i.length, SAMPLES * len(curve_i.points))
    t = np.linspace(0.0, curve_j.length, SAMPLES * len(curve_j.points))
    points, others = one(s) @ turn.T + shift, other(t)
    from scipy.spatial import cKDTree

    distances, near = cKDTree(others).query(points)
    best = int(np.argmin(distances))
    p, q = float(s[best]), float(t[near[best]])
    for _ in range(20):
        q = curve_j.nearest(turn @ one(p) + shift)
        p = curve_i.nearest(turn.T @ (other(q) - shift))
    return p, q
