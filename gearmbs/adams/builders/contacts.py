"""CONTACT: the solids of GRAPHICS in the frames of their markers, and the laws in SI."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from gearmbs.adams.builders.builder import Builder, Maker
from gearmbs.adams.errors import WARNING
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import curve_points
from gearmbs.adams.parse.files import named_file
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.contacts.element import Coulomb, Impact, Poisson
from gearmbs.mechanism.contacts.meshes import READERS, SUFFIXES, body_of, read_mesh, shape_of
from gearmbs.mechanism.contacts.shapes import (
    Box,
    Cylinder,
    Ellipsoid,
    Frustum,
    HalfSpace,
    Mesh,
    Shape,
    Sphere,
    Torus,
    extruded,
    revolved,
)
from gearmbs.mechanism.parts.bodies import Marker
from gearmbs.solids import read_bodies

ROUND = 1e-9
"""Relative difference of scales up to which an ellipsoid is a sphere."""


def add_contact(b: Builder, s: st.Contact) -> None:
    """CONTACT between the solids of two parts; of wheels that were written here, that of their pair."""
    if s.pair:
        _add_gears(b, s)
        return
    sides: list[tuple[Marker, list[Shape]]] = []
    for refs in (s.igeom, s.jgeom):
        graphics = [b.deck.of(st.Graphics)[ref] for ref in refs]
        first = b.markers[graphics[0].marker or 0]
        solids = []
        for g in graphics:
            why = _unread(b, g) if g.type == "EXTERNAL" else ""
            if why:
                b.unsupported(s, f"{g.label()} in {g.data_file}: {why}")
                return
            marker = b.markers[g.marker or 0]
            if marker.body is not first.body:
                raise ValueError(f"{g.label()} is on another part than {graphics[0].label()}; give each a CONTACT")
            solids.append(_placed(solid_of(b, g), first, marker))
        sides.append((first, solids))
    (i, solids_i), (j, solids_j) = sides
    b.mechanism.contact(b.model.names["contact", s.id], i, solids_i, j, solids_j, law_of(b, s), friction_of(b, s))


def _add_gears(b: Builder, s: st.Contact) -> None:
    """Build the contact of a gear pair again, with the laws that the statement has now."""
    from gearmbs.adams.write.contacts import pair_of, with_laws

    pair = pair_of(s.pair)
    law, friction = law_of(b, s), friction_of(b, s)
    if not isinstance(law, Impact):
        raise ValueError("POISSON between gears is not computed; give IMPACT")
    changed = with_laws(pair, law, friction)
    if changed is not pair:
        b.remark(WARNING, s, "its laws are no longer those of the pair in the comments before it; its own are taken")
    i, j = (b.markers[b.deck.of(st.Graphics)[refs[0]].marker or 0] for refs in (s.igeom, s.jgeom))
    b.mechanism.gear_contact(b.model.names["contact", s.id], i, j, changed)


def law_of(b: Builder, s: st.Contact) -> Impact | Poisson:
    """Return the normal law, in SI: a stiffness is a force over a length to the power of the exponent."""
    units = b.units
    if s.law == "POISSON":
        return Poisson((s.penalty or 0.0) * units.factor("stiffness"), s.restitution or 0.0)
    stiffness = (s.stiffness or 0.0) * units.force / units.length**s.exponent
    return Impact(stiffness, s.exponent, s.damping * units.factor("damping"), (s.dmax or 0.0) * units.length)


def friction_of(b: Builder, s: st.Contact) -> Coulomb | None:
    """Return the friction; without static friction that of slip rises from rest."""
    if s.coulomb == "OFF" or s.no_friction:
        return None
    speed = b.units.factor("velocity")
    stick, slip = (s.stiction or 0.0) * speed, (s.transition or 0.0) * speed
    if s.coulomb == "ON":
        return Coulomb(s.mu_static, s.mu_dynamic, stick, slip)
    return Coulomb(s.mu_dynamic, s.mu_dynamic, slip, slip)


def _placed(shape: Shape, first: Marker, marker: Marker) -> Shape:
    """Return a shape given in one marker's frame in that of another of the same body."""
    if marker is first:
        return shape
    turn = first.orientation.T @ marker.orientation
    offset = first.orientation.T @ (marker.position - first.position) + turn @ shape.offset
    return replace(shape, axes=turn @ shape.axes, offset=offset)


def solid_of(b: Builder, g: st.Graphics) -> Shape:
    """Return the solid of a GRAPHICS in its marker's frame, SI.

    Raises
    ------
    ValueError
        For what is missing, or a part of a full turn.
    """
    if g.rangle is not None and abs(g.rangle - 2.0 * np.pi) > 1e-6:
        raise ValueError(
            f"{g.label()}: RANGLE = {np.degrees(g.rangle):.6g}D; only whole solids of revolution can touch"
        )
    return MAKERS[g.type or ""](b, g)


def _size(b: Builder, g: st.Graphics, name: str) -> float:
    value = getattr(g, name)
    if value is None:
        raise ValueError(f"{g.label()}: {name.upper()} is missing for its {g.type}")
    return float(value) * b.units.length


def _box(b: Builder, g: st.Graphics) -> Shape:
    """From its corner along the axes, forwards or backwards."""
    edges = np.array([_size(b, g, name) for name in ("x", "y", "z")])
    return Box(np.abs(edges), offset=0.5 * edges)


def _cylinder(b: Builder, g: st.Graphics) -> Shape:
    length = _size(b, g, "length")
    return Cylinder(_size(b, g, "radius"), abs(length), offset=(0.0, 0.0, 0.5 * length))


def _frustum(b: Builder, g: st.Graphics) -> Shape:
    """From the bottom in its marker's origin along z."""
    length, bottom, top = (_size(b, g, name) for name in ("length", "bottom", "top"))
    if length < 0.0:
        bottom, top = top, bottom
    return Frustum(bottom, top, abs(length), offset=(0.0, 0.0, 0.5 * length))


def _ellipsoid(b: Builder, g: st.Graphics) -> Shape:
    """The scales are diameters."""
    axes = 0.5 * np.array([_size(b, g, name) for name in ("xscale", "yscale", "zscale")])
    return Sphere(float(axes[0])) if np.ptp(axes) <= ROUND * axes.max() else Ellipsoid(axes)


def _torus(b: Builder, g: st.Graphics) -> Shape:
    return Torus(_size(b, g, "radius" if g.major is None else "major"), _size(b, g, "minor"))


def _plane(b: Builder, g: st.Graphics) -> Shape:
    return HalfSpace()


def _point(b: Builder, g: st.Graphics) -> Shape:
    return Sphere(0.0)


def _file(b: Builder, g: st.Graphics) -> Path:
    return named_file("FILE", g.data_file or "", b.deck.file)


def _unread(b: Builder, g: st.Graphics) -> str:
    """Return why the solid of a file cannot be read at all; empty if it can."""
    try:
        path = _file(b, g)
    except ValueError as error:
        return f"{error}; a CONTACT without it"
    if path.suffix.lower() not in (*READERS, *SUFFIXES):
        return f"save the solid as {', '.join((*SUFFIXES, *READERS))}; other files"
    if path.suffix.lower() in SUFFIXES and not path.is_file():
        return "put the file beside the deck; a CONTACT without it"
    return ""


def _external(b: Builder, g: st.Graphics) -> Shape:
    """A mesh in the deck's units, or a body of a Parasolid file, which is in metres."""
    path = _file(b, g)
    if path.suffix.lower() in READERS:
        return read_mesh(path, b.units.length)
    if path not in b.solid_files:
        b.solid_files[path] = read_bodies(path)
    body = body_of(path, b.solid_files[path], g.element, b.deck.of(st.Marker)[g.marker or 0].part)
    if (path, body.node.index) not in b.solids:
        try:
            b.solids[path, body.node.index] = shape_of(body)
        except ModelError as error:
            raise ModelError(f"{path}: {error}") from None
    return b.solids[path, body.node.index]


def _extrusion(b: Builder, g: st.Graphics) -> Shape:
    """The closed curve in the xy plane, drawn out along z."""
    profile = curve_points(b.deck, g.curve).points[:, :2]
    return Mesh(*extruded(b.units.length * profile, _size(b, g, "length")))


def _revolution(b: Builder, g: st.Graphics) -> Shape:
    """The curve's distance from z, turned about z."""
    points = b.units.length * curve_points(b.deck, g.curve).points
    radii, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    closed = bool(np.allclose(points[0], points[-1]))
    if closed:
        radii, z = radii[:-1], z[:-1]
    else:
        radii, z = np.r_[0.0, radii, 0.0], np.r_[z[0], z, z[-1]]
    return Mesh(*revolved(radii, z, closed))


MAKERS: dict[str, Callable[[Builder, st.Graphics], Shape]] = {
    "BOX": _box,
    "CYLINDER": _cylinder,
    "ELLIPSOID": _ellipsoid,
    "EXTERNAL": _external,
    "EXTRUSION": _extrusion,
    "FRUSTUM": _frustum,
    "PLANE": _plane,
    "POINT": _point,
    "REVOLUTION": _revolution,
    "TORUS": _torus,
}
CONTACTS: dict[type, Maker] = {st.Contact: add_contact}
