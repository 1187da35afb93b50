"""Gear contacts in decks as IMPACT expressions: both flanks along their lines of action, pair by pair.

Wheels of parallel axes at a fixed distance a touch along the common tangents of their base circles. With psi_1, psi_2
the angles of the middles of teeth 0 from the direction of the mesh, which of an external wheel is that of the mate's
centre, h the half angle of a tooth on the base circle, alpha' the working pressure angle and sigma_i = 1, of an
internal wheel -1, the strings of the drive flanks are s_i = r_bi (sigma_i (psi_i + alpha') + h_i). The penetration of
every pair is s_1 + s_2 - g, g the signed line of action, up to a whole number of base pitches; the back flanks have
psi and the sense of turning reversed. A pair bears while its string s_1 lies on the path of contact; a sum over the
pairs within reach counts them. All is seen from a body in which both axes are at rest: the ground, or a carrier.

What an ADAMS owner can cross-check with it: load sharing, the fluctuation of the mesh force, reactions. `HELD`,
`LEFT_OUT` and `REFUSED` say of each field of a pair what becomes of it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from gearmbs.adams.write.text import WriterContext
from gearmbs.dae.problem import ModelError
from gearmbs.gears import GearPair
from gearmbs.gears.contact_element import GearContact
from gearmbs.gears.tables import fillet_clearance
from gearmbs.mechanism import Mechanism
from gearmbs.mechanism.parts.bodies import Body, Marker

PARALLEL = 1e-9
"""Sine of the angle between two axes up to which they are parallel but for rounding of a model's orientations."""
PLACED = 1e-9
"""Distance, m, up to which a wheel is where its pair says, and a point on an axis: rounding of places."""
LEAP = 3.0
"""Angle, rad, from which on a wheel starts so near half a turn that rounding may put it on the other side."""
EDGE = 0.01
"""Width over which a pair takes and leaves the load, in base pitches."""

Frames = list[tuple[np.ndarray, np.ndarray]]

HELD: dict[str, str] = {
    "GearPair.driver": "by its fields",
    "GearPair.driven": "by its fields",
    "GearPair.centre_distance_error": "in the working pressure angle",
    "GearPair.misalignment": "as the wheels stand, whose axes must be parallel",
    "GearPair.plane": "goes with misalignment",
    "GearPair.pivot": "goes with misalignment",
    "GearPair.backlash": "in the thickness of the teeth",
    "GearPair.contact": "by its fields",
    "GearPair.rotation": "both flanks bear, whichever drives",
    "GearPair.torque": "of analyses; that of a mechanism is a load of its own",
    "GearPair.slices": "flanks without faults are alike in each",
    "GearPair.load": "uniform pressure has its resultant where ADAMS puts the force",
    "GearSpec.teeth": "base radius",
    "GearSpec.module": "base radius",
    "GearSpec.pressure_angle": "base radius",
    "GearSpec.face_width": "the law is that of the whole face",
    "GearSpec.addendum": "path of contact",
    "GearSpec.dedendum": "goes with root_contact",
    "GearSpec.fillet_radius": "goes with root_contact",
    "GearSpec.profile_shift": "thickness of the teeth",
    "GearSpec.thinning": "thickness of the teeth",
    "GearSpec.tip_rounding": "path of contact",
    "GearSpec.bore_radius": "mass",
    "GearSpec.material": "mass",
    "GearSpec.name": "a name",
    "GearSpec.hand": "goes with helix_angle",
    "GearSpec.internal": "signs of radii",
    "GearSpec.rim_thickness": "mass",
    "ContactLaw.stiffness": "of IMPACT",
    "ContactLaw.exponent": "of IMPACT",
    "ContactLaw.damping": "of IMPACT",
    "ContactLaw.depth": "of IMPACT",
}
"""What the expressions hold, or what has no part in them, and how; by class and field."""

LEFT_OUT = {"GearPair.friction": "a comment of the deck says so"}
"""What is left out of them, as the deck says."""

SOLIDS = 'give gears="solids", which holds the whole pair'


def _roots(pair: Any) -> bool:
    """Whether tips reach the mate's root under the load."""
    depth = pair.penetration()
    clearances = (pair.tip_clearance - depth, *(fillet_clearance(pair, k, depth) for k in (0, 1)))
    return bool(pair.tips_may_bottom and min(clearances) < 0.0)


REFUSED: dict[str, tuple[Callable[[Any], bool], str]] = {
    "GearPair.axial_shift": (lambda pair: pair.axial_shift != 0.0, SOLIDS),
    "GearPair.root_contact": (_roots, SOLIDS),
    "GearPair.stiffness_curve": (
        lambda pair: pair.stiffness_curve != "constant",
        "its stiffness varies along the path, which IMPACT does not; take a constant one",
    ),
    "GearPair.faults": (lambda pair: bool(pair.faults), SOLIDS),
    "GearSpec.helix_angle": (lambda pair: pair.driver.helix_angle != 0.0, f"spur wheels only; {SOLIDS}"),
    "ContactLaw.kind": (
        lambda pair: not pair.contact.is_impact,
        "it has no form in ADAMS; use ContactLaw.impact",
    ),
}
"""What they cannot hold: whether a pair has it, and the remedy; by class and field."""


def is_gear_contact(element: Any) -> bool:
    """Whether an element is a gear contact."""
    return isinstance(element, GearContact)


def gear_statements(writer: WriterContext, name: str, element: GearContact) -> None:
    """Write a gear contact as one GFORCE between the wheels.

    Raises
    ------
    ModelError
        For what `REFUSED` names, wheels whose axes are tilted or not where the pair has them, and axes that move.
    """
    label = f"gear contact '{name}'"
    pair: Any = element.pair
    if not isinstance(pair, GearPair):
        raise ModelError(f"{label}: only a GearPair is written as expressions, not a {type(pair).__name__}")
    _refuse(label, pair)
    frames = [(m.global_position(), m.global_orientation()) for m in (element.i, element.j)]
    axis = frames[0][1][:, 2]
    if np.linalg.norm(np.cross(axis, frames[1][1][:, 2])) > PARALLEL or frames[1][1][:, 2] @ axis < 0.0:
        raise ModelError(f"{label}: tilted axes cannot be written as an expression; align the wheels, or {SOLIDS}")
    apart = frames[1][0] - frames[0][0]
    along = float(axis @ apart)
    apart = apart - axis * along
    distance = float(np.linalg.norm(apart))
    if abs(along) > PLACED:
        raise ModelError(
            f"{label}: the driven wheel stands {1e3 * along:.6g} mm along the axis, as by axial_shift, which cannot be "
            f"written as an expression; {SOLIDS}"
        )
    if abs(distance - pair.centre_distance) > PLACED:
        raise ModelError(
            f"{label}: the axes are {1e3 * distance:.6f} mm apart and those of its pair "
            f"{1e3 * pair.centre_distance:.6f} mm; give the pair that as centre_distance_error, or {SOLIDS}"
        )
    seen_from, moving = _seen_from(writer.mechanism, label, element)
    # external wheels see the mesh toward each other's centre, those of an internal pair both away from the ring's
    toward = apart / distance
    start = _angles(frames, pair.sign)
    # AZ leaps at half a turn: a wheel that starts there is seen from behind
    behind = [math.copysign(math.pi, angle) if abs(angle) > LEAP else 0.0 for angle in start]
    sights = []
    for (origin, _), x, half in zip(frames, (pair.sign * toward, -toward), behind):
        x = -x if half else x
        axes = np.column_stack([x, np.cross(axis, x), axis])
        if not seen_from.is_ground:
            turned = seen_from.orientation.T
            origin, axes = turned @ (origin - seen_from.position), turned @ axes
        sights.append(writer.new_marker(seen_from, origin, axes))
    wheels = [writer.markers[id(m)] for m in (element.i, element.j)]
    floating = writer.new_marker(element.j.body, np.zeros(3), np.eye(3), floating=True)
    writer.comment(f"{name}: IMPACT of each pair of flanks along the lines of action; without friction and corners")
    drive, back = (_flank(writer, pair, wheels, sights, start, behind, sign, moving) for sign in (1.0, -1.0))
    alpha, seen = pair.working_pressure_angle, -1.0 if behind[0] else 1.0
    lever = pair.wheels[0].base_radius / writer.units.length
    given = {
        "FX": f"-({seen * math.sin(alpha)!r})*(({drive}) + ({back}))",
        "FY": f"-({seen * math.cos(alpha)!r})*(({drive}) - ({back}))",
        "TZ": f"-({lever!r})*(({drive}) - ({back}))",
    }
    writer.gforce(name, wheels[0], floating, sights[0], {k: writer.expression(t) for k, t in given.items()})


def _refuse(label: str, pair: Any) -> None:
    """Refuse what expressions cannot hold, with the field, its value and a remedy."""
    owners = {"GearPair": pair, "GearSpec": pair.driver, "ContactLaw": pair.contact}
    known = {*HELD, *LEFT_OUT, *REFUSED}
    for owner, thing in owners.items():
        unknown = [f.name for f in fields(thing) if f"{owner}.{f.name}" not in known]
        if unknown:
            raise ModelError(
                f"{label}: {unknown[0]} of {type(thing).__name__} is a field of your own, which an expression cannot "
                f"hold; use a {owner}"
            )
    for field, (has, remedy) in REFUSED.items():
        if has(pair):
            owner, name = field.split(".")
            value = getattr(owners[owner], name)
            if name == "faults":
                value = ", ".join(type(fault).__name__ for fault in value)
            raise ModelError(f"{label}: {field} is {value!r}, which cannot be written as an expression; {remedy}")


# Whether the axes are at rest, and where.


def _on_axis(marker: Marker, origin: np.ndarray, axis: np.ndarray) -> bool:
    apart = marker.global_position() - origin
    return bool(np.linalg.norm(apart - axis * (axis @ apart)) <= PLACED)


def _resting(mechanism: Mechanism, body: Body, origin: np.ndarray, axis: np.ndarray) -> dict[int, Body]:
    """Return the bodies in which an axis of a body is at rest by joints, itself among them, by ``id``.

    A joint about the axis holds it, or two that hold a point of it each.
    """
    found, reached = {id(body): body}, [body]
    while reached:
        present = reached.pop()
        points: dict[int, int] = {}
        for joint in mechanism.joints.values():
            if present not in (joint.i.body, joint.j.body):
                continue
            other = joint.j.body if joint.i.body is present else joint.i.body
            on = all(_on_axis(m, origin, axis) for m in (joint.i, joint.j))
            along = np.linalg.norm(np.cross(joint.j.global_orientation()[:, 2], axis)) <= PARALLEL
            if joint.kind in ("spherical", "self_aligning", "at_point") or (joint.kind == "inline" and along):
                points[id(other)] = points.get(id(other), 0) + on
            whole = joint.kind == "fixed" or (joint.kind in ("revolute", "cylindrical") and on and along)
            if (whole or points.get(id(other), 0) > 1) and id(other) not in found:
                found[id(other)] = other
                reached.append(other)
    return found


def _seen_from(mechanism: Mechanism, label: str, element: GearContact) -> tuple[Body, bool]:
    """Return a body in which both axes are at rest, and whether they move in it a little, as in elastic bearings.

    Raises
    ------
    ModelError
        If one is carried about by what the other is not on.
    """
    ground = mechanism.ground
    lines = [(m.body, m.global_position(), m.global_orientation()[:, 2]) for m in (element.i, element.j)]
    resting = [_resting(mechanism, *line) for line in lines]
    common = {key: body for key, body in resting[0].items() if key in resting[1]}
    if common:
        return common.get(id(ground)) or next(iter(common.values())), False
    connections = [*(j for j in mechanism.joints.values() if j.kind not in ("rotation", "translation", "coupler"))]
    connections += [e for e in mechanism.elements.values() if e.kind in ("field", "bushing", "beam")]
    for (wheel, origin, axis), bodies in zip(lines, resting):
        if id(ground) in bodies:
            continue
        for connection in connections:
            ends = (connection.i, connection.j)
            mine = [m for m in ends if id(m.body) in bodies]
            if len(mine) != 1:
                continue
            other = next(m.body for m in ends if m is not mine[0])
            steady = id(ground) in _resting(mechanism, other, origin, axis)
            if not (steady and _on_axis(mine[0], origin, axis)):
                raise ModelError(
                    f"{label}: the axis of '{wheel.name}' is carried about ('{connection.name}'), and no body "
                    f"holds both it and its mate's by joints, which an expression needs; {SOLIDS}"
                )
    return ground, True


# The expressions.


def _flank(
    writer: WriterContext,
    pair: Any,
    wheels: list[int],
    sights: list[int],
    start: list[float],
    behind: list[float],
    sign: float,
    moving: bool,
) -> str:
    """Return the sum of the normal forces of all pairs on the drive (sign 1) or back flanks (-1), as text."""
    units = writer.units
    one, two = pair.wheels
    alpha, line = pair.working_pressure_angle, pair.line_of_action
    pitch = one.base_pitch
    rb = (one.base_radius, two.base_radius)
    turns = [sign * w.sign * r for r, w in zip(rb, pair.wheels)]
    offsets = [r * (w.base_half_angle + w.sign * alpha) for r, w in zip(rb, pair.wheels)]
    present = sum(o + turn * a for o, turn, a in zip(offsets, turns, start)) - line
    whole = round(present / pitch)
    offsets = [o + turn * half for o, turn, half in zip(offsets, turns, behind)]
    length = units.length

    def string(k: int) -> str:
        return f"({offsets[k] / length!r} + ({turns[k] / length!r})*AZ({wheels[k]}, {sights[k]}))"

    depth = f"{string(0)} + {string(1)} - ({(line + whole * pitch) / length!r})"
    rates = [f"({turn / length!r})*WZ({w}, {s}, {s})" for turn, w, s in zip(turns, wheels, sights)]
    if moving:
        # the displacement of the driver from the driven wheel, along the normal of the flank
        seen = -1.0 if behind[0] else 1.0
        across, up = seen * math.sin(alpha), seen * sign * math.cos(alpha)
        i, j, frame = wheels[0], wheels[1], sights[0]
        rest = seen * pair.sign * pair.centre_distance / length
        depth += f" + ({across!r})*(DX({i}, {j}, {frame}) + ({rest!r})) + ({up!r})*DY({i}, {j}, {frame})"
        rates += [f"({n!r})*V{c}({i}, {j}, {frame}, {frame})" for n, c in ((across, "X"), (up, "Y"))]
    law = pair.contact
    k = law.stiffness * length**law.exponent / units.force
    c = law.damping / units.factor("damping")
    force = f"IMPACT(-({depth}), -({' + '.join(rates)}), 0, {k!r}, {law.exponent!r}, {c!r}, {law.depth / length!r})"
    low, high = pair.first_roll_lengths[0], one.tip_roll_length
    edge = EDGE * pitch
    first = math.floor(low / pitch) - 1
    last = math.ceil(high / pitch) + 1
    place = f"MOD({string(0)} + {1e6 * pitch / length!r}, {pitch / length!r})"
    shares = []
    for n in range(first, last + 1):
        u = f"({place} + ({n * pitch / length!r}))"
        enter = f"STEP({u}, {(low - edge) / length!r}, 0, {(low + edge) / length!r}, 1)"
        leave = f"STEP({u}, {(high - edge) / length!r}, 1, {(high + edge) / length!r}, 0)"
        if n * pitch + pitch >= low - edge and n * pitch <= high + edge:
            shares.append(f"{enter}*{leave}")
    return f"({' + '.join(shares)})*{force}"


def _angles(frames: Frames, pair_sign: int) -> list[float]:
    """Return the angles of both wheels' x axes from the direction of the mesh, about their axes."""
    (first, _), (second, _) = frames
    angles = []
    for toward, (_, axes) in zip((pair_sign * (second - first), first - second), frames):
        axis, x = axes[:, 2], axes[:, 0]
        toward = toward - axis * (axis @ toward)
        angles.append(float(np.arctan2(axis @ np.cross(toward, x), toward @ x)))
    return angles
