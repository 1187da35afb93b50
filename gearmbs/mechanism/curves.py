"""Curves through points, and constraints that keep points or other curves on them.

A point of contact is found by its parameter s, the length along the chords: the travel of a massless runner on the
ground that a slot guides. Of a curve c(s) on the body of marker RM, a point of another body is kept on it by
P - P_RM - A_RM c(s) = 0. That the runner is in equilibrium says that nothing acts along the tangent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.curve_starts import point_speed, touching_parameters, touching_speeds
from gearmbs.mechanism.parts import Marker
from gearmbs.mechanism.spline_curve import Curve

if TYPE_CHECKING:
    from gearmbs.mechanism.joints import Joint
    from gearmbs.mechanism.mechanism import Mechanism

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


__all__ = ["Curve", "curve_on_curve", "point_on_curve"]
