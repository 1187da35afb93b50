"""Joints, primitives, couplers, gears, general constraints, motions, and points and curves on curves, of a deck."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.adams.builders.builder import Builder, Maker
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import curve_points
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.mechanism.parts.curves import Curve, curve_on_curve, point_on_curve
from gearmbs.mechanism.parts.functions import expression
from gearmbs.mechanism.parts.joints import JOINTS, Joint, Prescribed

JOINT_KINDS = {k.adams[1]: kind for kind, k in JOINTS.items() if k.adams and k.adams[0] == "JOINT"}
JPRIM_KINDS = {k.adams[1]: kind for kind, k in JOINTS.items() if k.adams and k.adams[0] == "JPRIM"}
X_TO_Z = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).T
"""Columns y, z, x: the old x axis becomes the new z axis."""
Y_TO_Z = X_TO_Z.T
SHORTEST = 1e-3
"""Span over which motions by velocity or acceleration are integrated at least, in units of time."""


def add_joint(b: Builder, s: st.Joint) -> None:
    """JOINT of any type."""
    name = b.model.names["joint", s.id]
    i, j = b.markers[s.i or 0], b.markers[s.j or 0]
    if s.type in JOINT_KINDS:
        b.joints[s.id] = b.mechanism.joint(JOINT_KINDS[s.type], name, i, j)
    elif s.type == "SCREW":
        b.joints[s.id] = b.mechanism.screw(name, i, j, pitch=b.units.length * (s.pitch or 0.0))
    elif s.type == "HOOKE":
        b.joints[s.id] = _hooke(b, name, i, j)
    else:
        _rack_and_pinion(b, s, name, i, j)
    _initial_conditions(b, s)


def _initial_conditions(b: Builder, s: st.Joint) -> None:
    """Remember displacements and velocities a joint starts with."""
    joint = b.joints.get(s.id)
    for keyword, value in (("IC", s.ic), ("ICTRAN", s.ictran), ("ICROT", s.icrot)):
        if value is None:
            continue
        rotational = s.type == "REVOLUTE" or (s.type == "CYLINDRICAL" and keyword == "ICROT")
        if joint is None or s.type not in ("REVOLUTE", "TRANSLATIONAL", "CYLINDRICAL"):
            b.unsupported(s, f"{keyword} of a {s.type} joint")
            continue
        b.model.initial_motions.append((joint, "rotation" if rotational else "translation", value))


def _hooke(b: Builder, name: str, i: Marker, j: Marker) -> Joint:
    """HOOKE: the arms of the cross lie along x of I and y of J; markers turned so that they are z axes."""
    arm_i = i.body.marker(i.position, i.orientation @ X_TO_Z, name=f"{name}.arm I")
    arm_j = j.body.marker(j.position, j.orientation @ Y_TO_Z, name=f"{name}.arm J")
    return b.mechanism.joint("universal", name, arm_i, arm_j)


def _rack_and_pinion(b: Builder, s: st.Joint, name: str, i: Marker, j: Marker) -> None:
    """RACKPIN: the pinion (I, about z_I) rolls on the rack's line (J, along z_J).

    The side on which the rack passes the pinion's axis determines the direction; the travel is PD/2 times the angle
    counted from the start. A line through the axis itself moves along z_J for a positive turn: ADAMS asks for x_I along
    z_J, and the pitch point then lies towards -y_I.
    """
    zi, zj = i.global_orientation()[:, 2], j.global_orientation()[:, 2]
    apart = j.global_position() - i.global_position()
    foot = apart - zj * (zj @ apart)
    lever = np.cross(zi, foot) @ zj
    if abs(zi @ zj) > 1e-6:
        raise ValueError("z_J must be at a right angle to the pinion's axis z_I")
    side = 1.0 if abs(lever) < 1e-9 * max(float(np.linalg.norm(apart)), b.units.length) else float(np.sign(lever))
    axes = np.column_stack([zj, np.cross(zi, zj), zi])
    fixed = j.body.marker_at(j.global_position(), axes, name=f"{name}.angle J")
    turned = i.body.marker_at(i.global_position(), axes, name=f"{name}.angle I")
    travel = float(zj @ apart) / b.units.length
    rate = side * 0.5 * (s.pd or 0.0)
    text = f'-DZ({s.i},{s.j},{s.j}) - ({travel!r}) - ({rate!r})*AZ("{turned.name}","{fixed.name}")'
    b.mechanism.general_constraint(name, text)


def add_jprim(b: Builder, s: st.Jprim) -> None:
    """JPRIM."""
    name = b.model.names["jprim", s.id]
    b.mechanism.joint(JPRIM_KINDS[s.type or ""], name, b.markers[s.i or 0], b.markers[s.j or 0])


def _coupled(b: Builder, s: st.Statement, refs: tuple[int, ...]) -> list[Joint]:
    joints = []
    for ref in refs:
        joint = b.joints.get(ref)
        if joint is None or joint.kind not in ("revolute", "translational", "cylindrical"):
            raise ValueError(f"JOINT/{ref} must be an active revolute, translational or cylindrical joint")
        joints.append(joint)
    return joints


def add_coupler(b: Builder, s: st.Coupler) -> None:
    """COUPLER: the weighted sum of the joints' displacements keeps its initial value."""
    if s.function is not None:
        return
    joints = _coupled(b, s, s.joints)
    if s.expression is not None:
        moved = [_moved_text(joint, kind) for joint, kind in zip(joints, _coupled_types(s, joints))]
        b.mechanism.general_constraint(b.model.names["coupler", s.id], s.expression.format(*moved))
        return
    scales = s.scales if len(s.scales) == len(joints) else (1.0, *s.scales)
    types = _coupled_types(s, joints)
    name = b.model.names["coupler", s.id]
    if any(joint.kind == "cylindrical" and kind == "TRANSLATIONAL" for joint, kind in zip(joints, types)):
        moved = [_since_start(b, name, joint, kind) for joint, kind in zip(joints, types)]
        text = " + ".join(f"({scale!r})*({travel})" for scale, travel in zip(scales, moved))
        b.mechanism.general_constraint(name, text)
        return
    units = [b.units.length if kind == "TRANSLATIONAL" else 1.0 for kind in types]
    b.mechanism.coupler(name, [(joint, scale / unit) for joint, scale, unit in zip(joints, scales, units)])


def _coupled_types(s: st.Coupler, joints: list[Joint]) -> tuple[str, ...]:
    """Return which displacement of each joint is coupled."""
    types = s.type or tuple("TRANSLATIONAL" if j.kind == "translational" else "ROTATIONAL" for j in joints)
    for joint, kind in zip(joints, types):
        if joint.kind != "cylindrical" and (kind == "TRANSLATIONAL") != (joint.kind == "translational"):
            raise ValueError(f"TYPE is {kind}, but {joint.name} is {joint.kind}")
    return types


def _since_start(b: Builder, name: str, joint: Joint, kind: str) -> str:
    """Return how far a joint has moved since the analysis began, as an expression of the deck."""
    i, j = joint.i, joint.j
    axes = j.global_orientation()
    if kind == "TRANSLATIONAL":
        start = float(axes[:, 2] @ (i.global_position() - j.global_position())) / b.units.length
        return f"DZ({i.number},{j.number},{j.number}) - ({start!r})"
    # markers of its own count from zero
    turned = i.body.marker_at(i.global_position(), axes, name=f"{name} {joint.name} I")
    fixed = j.body.marker_at(j.global_position(), axes, name=f"{name} {joint.name} J")
    return f'AZ("{turned.name}","{fixed.name}")'


def _moved_text(joint: Joint, kind: str) -> str:
    """Return the displacement of a joint as an expression of the deck."""
    i, j = joint.i.number, joint.j.number
    return f"DZ({i},{j},{j})" if kind == "TRANSLATIONAL" else f"AZ({i},{j})"


def add_gear(b: Builder, s: st.Gear) -> None:
    """GEAR: both parts have the same velocity along z of the CV marker, seen from the carrier."""
    cv = b.markers[s.cv or 0]
    joints = _coupled(b, s, s.joints)
    for joint in joints:
        if joint.j.body is not cv.body:
            raise ValueError(f"J of {joint.name} and the CV marker must be on one part, the carrier")
    along = cv.global_orientation()[:, 2]
    levers = []
    for joint in joints:
        z = joint.j.global_orientation()[:, 2]
        arm = cv.global_position() - joint.j.global_position()
        levers.append(float(z @ along if joint.kind == "translational" else np.cross(z, arm) @ along))
    if min(abs(v) for v in levers) < 1e-12:
        raise ValueError("the CV marker's z axis must point along the common velocity, off both joints' axes")
    b.mechanism.coupler(b.model.names["gear", s.id], [(joints[0], levers[0]), (joints[1], -levers[1])])


def add_gcon(b: Builder, s: st.Gcon) -> None:
    """GCON."""
    b.mechanism.general_constraint(b.model.names["gcon", s.id], b.text(s.function or ""))


def add_motion(b: Builder, s: st.Motion) -> None:
    """MOTION of a joint or between two markers, at displacement level."""
    name = b.model.names["motion", s.id]
    text = b.text(s.function or "")
    if s.joint is None:
        i, j = b.markers[s.i or 0], b.markers[s.j or 0]
        if s.direction in ("X", "Y", "Z"):
            moved = _displacement(b, s, text, _start(b, i, j, "XYZ".index(s.direction), False))
            apart = f"D{s.direction}({s.i},{s.j},{s.j}) - ({moved})"
        else:
            axis = (s.direction or "B1")[1]
            angle = f"(ORIENT(1,{axis},{s.i},{s.j}) - ({_displacement(b, s, text, _turned(b, i, j, int(axis)))}))"
            # the angle begins anew after a turn
            apart = f"{angle} - 2*PI*ANINT({angle}/(2*PI))"
        b.mechanism.general_constraint(name, apart)
        return
    joint = b.joints.get(s.joint)
    if joint is None:
        raise ValueError(f"JOINT/{s.joint} is not active")
    if joint.kind not in ("revolute", "translational", "cylindrical"):
        raise ValueError(f"JOINT/{s.joint} is {joint.kind}; it must be revolute, translational or cylindrical")
    only = {"revolute": "ROTATIONAL", "translational": "TRANSLATIONAL"}.get(joint.kind)
    if only and s.direction not in (only, None):
        raise ValueError(f"{s.direction} is not what JOINT/{s.joint} allows: it is {joint.kind}; write {only}")
    rotational = joint.kind == "revolute" or (joint.kind == "cylindrical" and s.direction == "ROTATIONAL")
    if joint.kind == "cylindrical" and s.direction is None:
        raise ValueError("give ROTATION or TRANSLATION for a motion of a cylindrical joint")
    start = _start(b, joint.i, joint.j, 2, rotational)
    moved = _displacement(b, s, text, start)
    if rotational:
        motion = b.mechanism.rotation(name, joint, expression(moved))
    else:
        motion = b.mechanism.translation(name, joint, expression(_scaled(moved, b.units.length)))
    if s.level in ("VELOCITY", "ACCELERATION"):
        motion.prescribed = _given(b, s, text, start, rotational)


def _start(b: Builder, i: Marker, j: Marker, axis: int, rotational: bool) -> tuple[float, float]:
    """Return the angle about z of J, or the displacement along an axis of J, and its rate, in the deck's units."""
    ai, aj = i.global_orientation(), j.global_orientation()
    e = aj[:, axis]
    if rotational:
        angle = float(np.arctan2(ai[:, 0] @ aj[:, 1], ai[:, 0] @ aj[:, 0]))
        rate = float(e @ (i.body.angular_velocity - j.body.angular_velocity))
        return angle, rate / b.units.factor("angular_velocity")
    apart = i.global_position() - j.global_position()
    velocities = [m.velocity_at(m.global_position()) for m in (i, j)]
    rate = float(e @ (velocities[0] - velocities[1]) + apart @ np.cross(j.body.angular_velocity, e))
    return float(e @ apart) / b.units.length, rate / b.units.factor("velocity")


def _turned(b: Builder, i: Marker, j: Marker, axis: int) -> tuple[float, float]:
    """Return an angle of I in J by turns about the body's axes 1, 2 and 3, and its rate, in the deck's units."""
    a = j.global_orientation().T @ i.global_orientation()
    first = np.arctan2(-a[1, 2], a[2, 2])
    second = np.arctan2(a[0, 2], np.hypot(a[0, 0], a[0, 1]))
    angles = first, second, np.arctan2(-a[0, 1], a[0, 0])
    axes = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(first), np.sin(first)], a[:, 2]])
    spin = j.global_orientation().T @ (i.body.angular_velocity - j.body.angular_velocity)
    rates = np.linalg.lstsq(axes.T, spin, rcond=None)[0]
    return float(angles[axis - 1]), float(rates[axis - 1]) / b.units.factor("angular_velocity")


def _displacement(b: Builder, s: st.Motion, text: str, start: tuple[float, float]) -> str:
    """Return a motion's displacement; a velocity or acceleration is integrated from the present time."""
    if s.level not in ("VELOCITY", "ACCELERATION"):
        return text
    first, last = b.span
    # an analysis at one time needs no more of the integral than its rate there
    last = max(last, first + SHORTEST * max(1.0, abs(first)))
    where, speed = _at_start(b, s, start)
    once = f"INTEGRAL({text}, {first!r}, {last!r})"
    if s.level == "VELOCITY":
        return f"({where!r}) + {once}"
    # the second integral of f is (t - t0) int f - int (t - t0) f
    since = f"(TIME - ({first!r}))"
    return f"({where!r}) + ({speed!r})*{since} + {since}*{once} - INTEGRAL({since}*({text}), {first!r}, {last!r})"


def _at_start(b: Builder, s: st.Motion, start: tuple[float, float]) -> tuple[float, float]:
    """Return displacement and rate a motion by velocity or acceleration starts with, in the deck's units."""
    where = s.icdisp if s.icdisp is not None and not b.state else start[0]
    speed = s.icvel if s.icvel is not None and not b.state else start[1]
    return where, speed


def _given(b: Builder, s: st.Motion, text: str, start: tuple[float, float], rotational: bool) -> Prescribed:
    """Return what a motion is given by, in SI."""
    level = (s.level or "").lower()
    dimensions = ("angle", "angular_velocity", f"angular_{level}") if rotational else ("length", "velocity", level)
    size, rate, change = (b.units.factor(d) for d in dimensions)
    where, speed = _at_start(b, s, start)
    return Prescribed(level, expression(_scaled(text, change)), where * size, speed * rate)


def _scaled(text: str, factor: float) -> str:
    return text if factor == 1.0 else f"{factor!r}*({text})"


CONSTRAINTS: dict[type, Maker] = {
    st.Joint: add_joint,
    st.Jprim: add_jprim,
    st.Coupler: add_coupler,
    st.Gear: add_gear,
    st.Gcon: add_gcon,
    st.Motion: add_motion,
}


# PTCV and CVCV.


def _parameter(b: Builder, curve: Curve, disp: Any, rm: Marker, icm: int | None) -> float | None:
    """Return the parameter of a point of contact given in the frame of ICM, or of RM."""
    if disp is None:
        return None
    given = np.array(disp)
    if icm is not None:
        other = b.markers[icm]
        place = other.global_position() + b.units.length * other.global_orientation() @ given
        given = rm.global_orientation().T @ (place - rm.global_position()) / b.units.length
    return curve.nearest(given)


def _state_before(b: Builder, runner: str) -> tuple[float | None, float | None]:
    """Return parameter and rate with which the analysis before has left a runner; None where it did not run."""
    state = b.state.get((runner, 0))
    if state is None:
        return None, None
    return float(state.position[2]) / b.units.length, float(state.velocity[2]) / b.units.factor("velocity")


def _note_runner(b: Builder, s: st.Statement, runner: str, curve: Curve) -> None:
    """Remember a runner that can leave its curve."""
    if not curve.closed:
        b.model.runners[runner] = s, curve.length * b.units.length


def add_ptcv(b: Builder, s: st.Ptcv) -> None:
    """PTCV; after the first analysis it goes on from where the point is."""
    curve, rm = curve_points(b.deck, s.curve), b.markers[s.rm or 0]
    name = b.model.names["ptcv", s.id]
    start, speed = _state_before(b, f"{name}.runner")
    if not b.state:
        start = _parameter(b, curve, s.disp, rm, s.icm)
    slot = point_on_curve(b.mechanism, name, b.markers[s.i or 0], rm, curve, start, speed)
    b.model.sources[slot.name] = s
    _note_runner(b, s, f"{name}.runner", curve)
    if s.vel is not None and not b.state:
        at = float(slot.i.global_position()[2]) / b.units.length
        rate = s.vel / float(np.linalg.norm(curve.spline()(at, 1)))
        b.model.initial_motions.append((slot, "translation", (at, rate)))


def add_cvcv(b: Builder, s: st.Cvcv) -> None:
    """CVCV; after the first analysis it goes on from where the curves touch."""
    first, second = curve_points(b.deck, s.icurve), curve_points(b.deck, s.jcurve)
    i, j = b.markers[s.irm or 0], b.markers[s.jrm or 0]
    name = b.model.names["cvcv", s.id]
    at_i, speed_i = _state_before(b, f"{name}.runner I")
    at_j, speed_j = _state_before(b, f"{name}.runner J")
    starts = speeds = None
    if at_i is not None and at_j is not None and speed_i is not None and speed_j is not None:
        starts, speeds = (at_i, at_j), (speed_i, speed_j)
    elif not b.state and s.idisp is not None and s.jdisp is not None:
        starts = _parameter(b, first, s.idisp, i, s.iicm) or 0.0, _parameter(b, second, s.jdisp, j, s.jicm) or 0.0
    curve_on_curve(b.mechanism, name, i, first, j, second, starts, speeds)
    _note_runner(b, s, f"{name}.runner I", first)
    _note_runner(b, s, f"{name}.runner J", second)


CURVES: dict[type, Maker] = {st.Ptcv: add_ptcv, st.Cvcv: add_cvcv}
