"""Solids from Parasolid text files: exact where the whole body is one simple solid, else a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.contacts.shapes import Box, Cylinder, Frustum, Mesh, Shape, Sphere, Torus
from gearmbs.mechanism.quantities import quantity
from gearmbs.solids.bodies import PART_NUMBER, Body, read_bodies
from gearmbs.solids.facets import faceted
from gearmbs.solids.primitives import primitive

SUFFIXES = (".x_t", ".xmt_txt")
CONTRADICTIONS = (ArithmeticError, AssertionError, IndexError, RecursionError, TypeError, ValueError)
"""What geometry raises that a damaged file gives."""
NAMED = 12
"""Names of bodies that a message lists."""


def read_solid(path: str | Path, name: str | None = None, tolerance: Any = None) -> Shape:
    """Read a solid body from a Parasolid text transmit file.

    Parameters
    ----------
    path : path
        A .x_t or .xmt_txt file, in metres as all of them are.
    name : str, optional
        Which body, if the file holds several.
    tolerance : float or text with a unit, optional
        Largest distance of the facets' edges from curves and surfaces, m; else 0.001 of the body's diagonal.

    Returns
    -------
    Shape
        A sphere, box, cylinder, frustum or torus if the whole body is one; else a mesh.

    Raises
    ------
    ModelError
        If the file cannot be read, the body is not in it, or has geometry that is not read.
    """
    path = Path(path)
    found = body_of(path, read_bodies(path), name)
    try:
        return shape_of(found, None if tolerance is None else quantity(tolerance, "length", "tolerance"))
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None


def body_of(path: Path, all_of_it: list[Body], name: str | None = None, part: int | None = None) -> Body:
    """Return the body of a name, and of several the one that says it belongs to a part.

    Raises
    ------
    ModelError
        If there is none, or more than one.
    """
    found = all_of_it if name is None else [b for b in all_of_it if b.name.lower() == name.lower()]
    if len(found) > 1 and part is not None:
        found = [b for b in found if b.attributes.get(PART_NUMBER) == part]
    if len(found) == 1:
        return found[0]
    names = sorted({b.name or "without a name" for b in all_of_it})
    listed = ", ".join(names[:NAMED]) + (", ..." if len(names) > NAMED else "")
    which = f"a body named '{name}'" if name else "one body"
    if part is not None and name:
        which += f" of part {part}"
    raise ModelError(f"{path}: it does not hold {which}, but {len(found)} of {len(all_of_it)}: {listed}")


def shape_of(body: Body, tolerance: float | None = None) -> Shape:
    """Return a body as a shape: exact if it is one simple solid, else a mesh of the tolerance, m.

    Raises
    ------
    ModelError
        If it has geometry that is not read, or its nodes contradict each other.
    """
    try:
        p = primitive(body)
        if p is None:
            return Mesh(*faceted(body, tolerance))
    except ModelError:
        raise
    except CONTRADICTIONS as error:
        raise ModelError(f"body '{body.name}': its nodes contradict each other: {error}") from None
    where = {"offset": p.origin, "axes": p.axes}
    if p.kind == "sphere":
        return Sphere(p.sizes[0], **where)
    if p.kind == "box":
        return Box(p.sizes, **where)
    if p.kind == "cylinder":
        return Cylinder(*p.sizes, **where)
    if p.kind == "frustum":
        return Frustum(*p.sizes, **where)
    return Torus(*p.sizes, **where)
