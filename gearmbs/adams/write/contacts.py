"""Contacts of solids as GRAPHICS and CONTACT; meshes as files beside the deck."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.adams.write.text import WriterContext, number
from gearmbs.dae.problem import ModelError
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
