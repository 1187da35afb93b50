"""Contacts in decks: solids as GRAPHICS and CONTACT, meshes as files beside the deck.

Gear pairs stand in comments before the CONTACT of their wheels, from which the very pair is built again (`pair_of`);
other programs pass over them.
"""

from __future__ import annotations

import dataclasses
import json
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
    if not law.is_impact:
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
