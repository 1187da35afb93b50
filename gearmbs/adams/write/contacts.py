"""Contacts in decks: solids as GRAPHICS and CONTACT, meshes as files beside the deck, gear contacts as expressions.

Gear pairs stand in comments before the CONTACT of their wheels, from which the very pair is built again (`pair_of`);
other programs pass over them.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.write.text import WriterContext, number
from gearmbs.dae.problem import ModelError
from gearmbs.gears import FlankFriction, GearPair
from gearmbs.gears.contact_element import GearContact
from gearmbs.mechanism.contacts import (
    Box,
    Coulomb,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Impact,
    Mesh,
    Poisson,
    Shape,
    SolidContact,
    Sphere,
    Torus,
)
from gearmbs.mechanism.parts.bodies import Marker

PLANE_SIZE = 1000.0
"""Edge of the part of a plane that is drawn, in the deck's unit of length; it touches everywhere."""

MARK = "gearmbs pair:"
"""What such a comment begins with."""
WIDTH = 100
KIND = "kind of object"


def contact_statements(writer: WriterContext, name: str, element: SolidContact) -> None:
    """Write the solids of both bodies, each with a marker of its own, and what acts between them.

    Raises
    ------
    ModelError
        If a solid needs a file and the deck is none.
    """
    sides = []
    for side, (marker, solids) in (("I", (element.i, element.solids_i)), ("J", (element.j, element.solids_j))):
        many = len(solids) > 1
        names = [f"{name}.{side}{k}" if many else f"{name}.{side}" for k in range(1, len(solids) + 1)]
        sides.append([_solid(writer, label, marker, shape) for label, shape in zip(names, solids)])
    touch(writer, name, sides, [*normal_law(writer, element.law), *friction_law(writer, element.friction)])


def touch(writer: WriterContext, name: str, sides: list[list[int]], laws: list[str]) -> None:
    """Write a CONTACT between GRAPHICS."""
    solids = [f"{key} = {', '.join(map(str, side))}" for key, side in zip(("IGEOM", "JGEOM"), sides)]
    writer.statement(f"CONTACT/{writer.elements['contact', name]}", [*solids, *laws], name)


def normal_law(writer: WriterContext, law: Impact | Poisson) -> list[str]:
    """Return the arguments of a normal law."""
    units = writer.units
    _, stiffness, exponent, damping, depth, penalty, restitution, _ = law.reals()
    if isinstance(law, Poisson):
        own = penalty / units.factor("stiffness")
        return ["POISSON", f"PENALTY = {number(own)}", f"RESTITUTION_COEFFICIENT = {number(restitution)}"]
    return [
        "IMPACT",
        f"STIFFNESS = {number(stiffness * units.length**exponent / units.force)}",
        f"EXPONENT = {number(exponent)}",
        f"DAMPING = {number(damping / units.factor('damping'))}",
        f"DMAX = {number(depth / units.length)}",
    ]


def friction_law(writer: WriterContext, friction: Coulomb | None) -> list[str]:
    """Return the arguments of friction."""
    if friction is None:
        return ["NO_FRICTION"]
    static, dynamic, stick, slip = friction.reals()
    speed = writer.units.factor("velocity")
    return [
        "COULOMB_FRICTION = ON",
        f"MU_STATIC = {number(static)}",
        f"MU_DYNAMIC = {number(dynamic)}",
        f"STICTION_TRANSITION_VELOCITY = {number(stick / speed)}",
        f"FRICTION_TRANSITION_VELOCITY = {number(slip / speed)}",
    ]


def _solid(writer: WriterContext, label: str, marker: Marker, shape: Shape) -> int:
    """Write a solid and return the id of its GRAPHICS."""
    corner = np.zeros(3)
    if isinstance(shape, Box):
        corner = -0.5 * shape.edges
    elif isinstance(shape, (Cylinder, Frustum)):
        corner = np.array([0.0, 0.0, -0.5 * shape.length])
    axes = marker.orientation @ shape.axes
    origin = marker.position + marker.orientation @ (shape.offset + shape.axes @ corner)
    there = np.array_equal(origin, marker.position) and np.array_equal(axes, marker.orientation)
    at = writer.markers[id(marker)] if there else writer.new_marker(marker.body, origin, axes)
    return writer.graphics(_arguments(writer, label, shape, at), label)


def _arguments(writer: WriterContext, label: str, shape: Shape, at: int) -> list[str]:
    def lengths(**values: Any) -> list[str]:
        return [f"{key} = {number(value / writer.units.length)}" for key, value in values.items()]

    if isinstance(shape, Sphere):
        if shape.radius == 0.0:
            return ["POINT", f"RM = {at}"]
        return ["ELLIPSOID", f"CM = {at}", *lengths(**dict.fromkeys(("XSCALE", "YSCALE", "ZSCALE"), 2 * shape.radius))]
    if isinstance(shape, Ellipsoid):
        return ["ELLIPSOID", f"CM = {at}", *lengths(**dict(zip(("XSCALE", "YSCALE", "ZSCALE"), 2 * shape.semi_axes)))]
    if isinstance(shape, Box):
        return ["BOX", f"CORNER = {at}", *lengths(**dict(zip("XYZ", shape.edges)))]
    if isinstance(shape, Cylinder):
        return ["CYLINDER", f"CM = {at}", *lengths(LENGTH=shape.length, RADIUS=shape.radius)]
    if isinstance(shape, Frustum):
        return ["FRUSTUM", f"CM = {at}", *lengths(LENGTH=shape.length, TOP=shape.top, BOTTOM=shape.bottom)]
    if isinstance(shape, Torus):
        return ["TORUS", f"CM = {at}", *lengths(MAJOR_RADIUS=shape.radius, MINOR_RADIUS=shape.tube)]
    if isinstance(shape, HalfSpace):
        half = 0.5 * PLANE_SIZE
        return ["PLANE", f"RM = {at}", *(f"{k} = {number(v)}" for k, v in zip(
            ("XMIN", "XMAX", "YMIN", "YMAX"), (-half, half, -half, half)
        ))]  # fmt: skip
    if isinstance(shape, Mesh):
        return external(writer, label, shape.vertices, shape.triangles, at)
    raise ModelError(f"{label}: a {type(shape).__name__} has no form in an ADAMS deck")


def external(writer: WriterContext, label: str, vertices: np.ndarray, triangles: np.ndarray, at: int) -> list[str]:
    """Write a mesh beside the deck, as .obj, in the deck's unit of length, and return the arguments of its GRAPHICS.

    Raises
    ------
    ModelError
        If the deck is not written to a file.
    """
    if writer.path is None:
        raise ModelError(f"{label}: its mesh needs a file beside the deck; give the deck's path")
    path = Path(writer.path)
    mesh = path.with_name(f"{path.stem}_{re.sub(r'[^A-Za-z0-9]+', '_', label).strip('_')}.obj")
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in (np.asarray(vertices) / writer.units.length).tolist()]
    rows += [f"f {a} {b} {c}" for a, b, c in (np.asarray(triangles) + 1).tolist()]
    mesh.write_text("\n".join(rows) + "\n", encoding="ascii")
    return ["EXTERNAL", f"RM = {at}", f"FILE = {mesh.name}"]


# A gear contact as IMPACT expressions: both flanks along their lines of action, pair by pair.
#
# Wheels of parallel axes at a fixed distance a touch along the common tangents of their base circles.
# With psi_1, psi_2 the angles of the middles of teeth 0 from the line of centres, h the half angle of a
# tooth on the base circle and alpha' the working pressure angle, the strings of the drive flanks are
# s_i = r_bi (psi_i + h_i + alpha') and the penetration of every pair is s_1 + s_2 - a sin(alpha'), up to
# a whole number of base pitches; the back flanks have psi and the sense of turning reversed.  A pair bears
# while its string s_1 lies on the path of contact; a sum over the pairs within reach counts them.
#
# What an ADAMS owner can cross-check with it: load sharing, the fluctuation of the mesh force, reactions.
# Left out: friction, tooth corners beyond the path of contact, tilted axes, faults.


PARALLEL = 1e-9
"""Sine of the angle between two axes up to which they are parallel but for rounding of a model's orientations."""
EDGE = 0.01
"""Width over which a pair takes and leaves the load, in base pitches."""


def is_gear_contact(element: Any) -> bool:
    """Whether an element is a gear contact."""
    return isinstance(element, GearContact)


def gear_statements(writer: WriterContext, name: str, element: GearContact) -> None:
    """Write a gear contact as one GFORCE between the wheels.

    Raises
    ------
    ModelError
        For tilted axes, internal gears or a contact law that is no IMPACT: a linear law is one with the exponent 1.
    """
    pair: Any = element.pair
    if not all(hasattr(pair, a) for a in ("wheels", "contact", "line_of_action", "working_pressure_angle")):
        raise ModelError(f"gear contact '{name}': its pair does not tell its geometry; it cannot be written")
    law = pair.contact
    if law.kind == "hunt-crossley":
        raise ModelError(f"gear contact '{name}': the law {law.kind!r} has no form in ADAMS; use ContactLaw.impact")
    if getattr(pair, "stiffness_curve", "constant") != "constant":
        raise ModelError(
            f"gear contact '{name}': its stiffness varies along the path, which IMPACT does not; take a constant one"
        )
    frames = [(m.global_position(), m.global_orientation()) for m in (element.i, element.j)]
    axis = frames[0][1][:, 2]
    apart = frames[1][0] - frames[0][0]
    apart = apart - axis * (axis @ apart)
    if np.linalg.norm(np.cross(axis, frames[1][1][:, 2])) > PARALLEL or frames[1][1][:, 2] @ axis < 0.0:
        raise ModelError(f"gear contact '{name}': tilted axes cannot be written as an expression; align the wheels")
    toward = apart / np.linalg.norm(apart)
    sights = []
    for (origin, _), x in zip(frames, (toward, -toward)):
        axes = np.column_stack([x, np.cross(axis, x), axis])
        sights.append(writer.new_marker(writer.mechanism.ground, origin, axes))
    wheels = [writer.markers[id(m)] for m in (element.i, element.j)]
    floating = writer.new_marker(element.j.body, np.zeros(3), np.eye(3), floating=True)
    writer.comment(f"{name}: IMPACT of each pair of flanks along the lines of action; without friction and corners")
    drive, back = (_flank(writer, pair, wheels, sights, frames, sign) for sign in (1.0, -1.0))
    alpha = pair.working_pressure_angle
    lever = pair.wheels[0].base_radius / writer.units.length
    given = {
        "FX": f"-({math.sin(alpha)!r})*(({drive}) + ({back}))",
        "FY": f"-({math.cos(alpha)!r})*(({drive}) - ({back}))",
        "TZ": f"-({lever!r})*(({drive}) - ({back}))",
    }
    writer.gforce(name, wheels[0], floating, sights[0], {k: writer.expression(t) for k, t in given.items()})


def _flank(
    writer: WriterContext,
    pair: Any,
    wheels: list[int],
    sights: list[int],
    frames: list[tuple[np.ndarray, np.ndarray]],
    sign: float,
) -> str:
    """Return the sum of the normal forces of all pairs on the drive (sign 1) or back flanks (-1), as text."""
    units = writer.units
    one, two = pair.wheels
    alpha, line = pair.working_pressure_angle, pair.line_of_action
    pitch = one.base_pitch
    rb = (one.base_radius, two.base_radius)
    offsets = [r * (w.base_half_angle + alpha) for r, w in zip(rb, pair.wheels)]
    start = [_angle(frame, other) for frame, other in ((frames[0], frames[1]), (frames[1], frames[0]))]
    present = sum(o + sign * r * a for o, r, a in zip(offsets, rb, start)) - line
    whole = round(present / pitch)
    length = units.length

    def string(k: int) -> str:
        return f"({offsets[k] / length!r} + ({sign * rb[k] / length!r})*AZ({wheels[k]}, {sights[k]}))"

    depth = f"({string(0)} + {string(1)} - ({(line + whole * pitch) / length!r}))"
    rates = [f"({sign * r / length!r})*WZ({w}, {s}, {s})" for r, w, s in zip(rb, wheels, sights)]
    law = pair.contact
    k = law.stiffness * length**law.exponent / units.force
    c = law.damping / units.factor("damping")
    force = f"IMPACT(-{depth}, -({' + '.join(rates)}), 0, {k!r}, {law.exponent!r}, {c!r}, {law.depth / length!r})"
    low, high = line - two.tip_roll_length, one.tip_roll_length
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


def _angle(frame: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> float:
    """Return the angle of a wheel's x axis from the direction of the other wheel's centre, about its axis."""
    axis, x = frame[1][:, 2], frame[1][:, 0]
    toward = other[0] - frame[0]
    toward = toward - axis * (axis @ toward)
    return float(np.arctan2(axis @ np.cross(toward, x), toward @ x))


# A gear contact as the contact of two solids: meshes for other programs, the very pair in comments for this one.


def gear_solid_statements(writer: WriterContext, name: str, element: GearContact) -> None:
    """Write both wheels as meshes beside the deck, and a CONTACT between them with the pair in comments before it.

    Raises
    ------
    ModelError
        For what is no `GearPair`, a law without a form in ADAMS, or a deck that is no file.
    """
    from gearmbs.view import pair_solids

    pair: Any = element.pair
    if not isinstance(pair, GearPair):
        raise ModelError(f"gear contact '{name}': only a GearPair is written as solids, not a {type(pair).__name__}")
    try:
        comments = pair_comments(pair)
    except ValueError as error:
        raise ModelError(f"gear contact '{name}': {error}") from error
    laws = [*normal_law(writer, normal_law_of(name, pair)), *friction_law(writer, friction_of(pair.friction))]
    sides = []
    for marker, solid, wheel in zip((element.i, element.j), pair_solids(pair), ("driver", "driven")):
        label = f"{name}.{wheel}"
        arguments = external(writer, label, solid.vertices, solid.triangles, writer.markers[id(marker)])
        sides.append([writer.graphics(arguments, label)])
    writer.comment(f"{name}: read by gearmbs, this is the exact contact of the pair in the next comments;")
    writer.comment("other programs let the meshes touch")
    for comment in comments:
        writer.comment(comment)
    touch(writer, name, sides, laws)


# Gear pairs as comments, and as the laws of a CONTACT.


@cache
def known() -> dict[str, type]:
    """Return the classes that a pair is made of, by name."""
    import gearmbs.gears as gears
    from gearmbs.gears import faults, modifications

    found: dict[str, type] = {}
    for module in (gears, faults, modifications):
        names = getattr(module, "__all__", None) or dir(module)
        things = (getattr(module, name) for name in names)
        found |= {t.__name__: t for t in things if isinstance(t, type) and is_dataclass(t)}
    return found


def pair_comments(pair: GearPair) -> list[str]:
    """Return a pair as the texts of comments.

    Raises
    ------
    ValueError
        If it holds an object of a class that is not the package's own.
    """
    # blanks at the end of a line would not survive every editor
    text = json.dumps(_held(pair), separators=(",", ":")).replace(" ", "\\u0020")
    return [f"{MARK}{text[k : k + WIDTH]}" for k in range(0, len(text), WIDTH)]


def pair_of(text: str) -> GearPair:
    """Return the pair that comments describe; ``text`` is what they hold behind their marks.

    Raises
    ------
    ValueError
        If they are not whole.
    """
    try:
        pair = _built(json.loads(text))
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"the gear pair in the comments before it is not whole: {error}") from error
    if not isinstance(pair, GearPair):
        raise ValueError(f"the comments before it describe a {type(pair).__name__}, not a gear pair")
    return pair


def _held(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        name = type(value).__name__
        if known().get(name) is not type(value):
            raise ValueError(f"{name} is a class of your own, which a deck cannot hold")
        return {KIND: name} | {f.name: _held(getattr(value, f.name)) for f in fields(value) if f.init}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (tuple, list)):
        return [_held(one) for one in value]
    if isinstance(value, (bool, int, str)) or value is None:
        return value
    return float(value)


def _built(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_built(one) for one in value)
    if not isinstance(value, dict):
        return value
    name = value.pop(KIND)
    if name not in known():
        raise ValueError(f"{name} is not known")
    return known()[name](**{key: _built(one) for key, one in value.items()})


def normal_law_of(name: str, pair: GearPair) -> Impact:
    """Return the normal law of a pair of teeth as that of solids.

    Raises
    ------
    ModelError
    """
    law = pair.contact
    if law.kind == "hunt-crossley":
        raise ModelError(f"gear contact '{name}': the law {law.kind!r} has no form in ADAMS; use ContactLaw.impact")
    return Impact(float(law.stiffness), law.exponent, float(law.damping), float(law.depth))


def friction_of(friction: FlankFriction) -> Coulomb | None:
    """Return the friction of flanks as that of solids; the smooth law by its coefficient and speed."""
    if friction.kind == "none":
        return None
    if friction.kind == "smooth":
        return Coulomb(friction.dynamic, friction.dynamic, friction.static_speed, friction.static_speed)
    return Coulomb(friction.static, friction.dynamic, friction.static_speed, friction.dynamic_speed)


def with_laws(pair: GearPair, normal: Impact, friction: Coulomb | None) -> GearPair:
    """Return a pair with the laws of a CONTACT where they are no longer those that were written."""
    written = normal_law_of("", pair)
    if not _alike(dataclasses.astuple(written), dataclasses.astuple(normal)):
        law = dataclasses.replace(
            pair.contact, kind="impact", stiffness=normal.stiffness, exponent=normal.exponent, damping=normal.damping,
            depth=normal.full_depth,
        )  # fmt: skip
        pair = pair.with_changes(contact=law)
    old = friction_of(pair.friction)
    same = (old is None) == (friction is None)
    if same and old is not None and friction is not None:
        same = _alike(tuple(old.reals()), tuple(friction.reals()))
    if not same:
        changed = FlankFriction.none()
        if friction is not None:
            static, dynamic, stick, slip = friction.reals()
            changed = FlankFriction(static, dynamic, stick, slip)
        pair = pair.with_changes(friction=changed)
    return pair


def _alike(a: tuple[float, ...], b: tuple[float, ...]) -> bool:
    """Whether numbers differ by no more than their way through the deck's units makes them."""
    return all(abs(x - y) <= 1e-12 * max(abs(x), abs(y)) for x, y in zip(a, b))
