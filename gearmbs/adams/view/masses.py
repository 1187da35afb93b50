"""Mass, centre and inertia of a part from its solids and its density, where the file gives no mass."""

from __future__ import annotations

import math

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.combined import combined, taken_off
from gearmbs.adams.view.deckmaker import Deckmaker
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import Item
from gearmbs.adams.view.solids import REMEDY, SHAPES, Moments, need, polyhedron
from gearmbs.adams.write.text import listed, number
from gearmbs.dae.problem import ModelError
from gearmbs.solids.bodies import PART_NUMBER, Body, faceted, read_bodies

STANDARD = {
    "steel": 7801.0, "stainless": 7750.0, "aluminum": 2740.0, "brass": 8545.0, "cast_iron": 7080.0, "copper": 8906.0,
    "glass": 2595.0, "lead": 11370.0, "magnesium": 1795.0, "nickel": 7750.0, "titanium": 4850.0, "tungsten": 19222.0,
    "wood": 438.0,
}  # fmt: skip
"""Densities in kg/m^3 of the materials that View's models begin with (table of standard materials of its manual)."""
UNKNOWN = frozenset("solid feature".split())
"""Solids whose moments are not computed."""


def density_of(m: Deckmaker, item: Item) -> float:
    """Return the density of a part: its own, or that of its material.

    Raises
    ------
    ViewError
    """
    density = m.values.number(item, "density")
    if density is not None:
        return density
    if "material_type" in item.fields:
        name = str(m.values.text(item, "material_type"))
        found = m.db.find(name, ("material",))
        if found is not None:
            return need(m, found, "density")
        standard = STANDARD.get(name.rsplit(".", 1)[-1].lower())
        if standard is None:
            raise ViewError(f"{item.path}: there is no material {name[:60]}", item.line)
    else:
        standard = STANDARD["steel"]
    units = m.db.units
    return standard * units.si("length") ** 3 / units.si("mass")


def _facets(m: Deckmaker, body: Body) -> Moments:
    """Return the moments of a body of a Parasolid file in the model's units, extrapolated from two tolerances.

    The difference of a surface from its chords goes with the square of their length, that is with the tolerance.
    """
    scale = 1.0 / m.db.units.si("length")
    tolerance = 1e-3 * float(np.linalg.norm(np.ptp(body.corners, axis=0)))
    coarse, fine = (polyhedron(scale * v, t) for v, t in (faceted(body, tolerance * f) for f in (0.5, 0.25)))
    return Moments(
        2.0 * fine.volume - coarse.volume, 2.0 * fine.first - coarse.first, 2.0 * fine.second - coarse.second
    )


def bodies_of(m: Deckmaker, item: Item) -> list[Body]:
    """Return the bodies that a part has in the model's Parasolid files.

    Raises
    ------
    ViewError
        If a file is missing or cannot be read: nobody knows then whether the part has one.
    """
    found = []
    for name, line in m.parasolids:
        path = m.beside(name)
        if path is None:
            raise ViewError(
                f"{name[:80]} is not beside the command file, and may hold the geometry of {item.path}", line
            )
        if path not in m.bodies:
            try:
                m.bodies[path] = read_bodies(path)
            except ModelError as error:
                raise ViewError(f"{name[:80]}: {error}", line) from error
        found += [body for body in m.bodies[path] if body.attributes.get(PART_NUMBER) == m.ids[id(item)]]
    return found


def moments_of(m: Deckmaker, item: Item, marker: Item | None) -> Moments | None:
    """Return the moments of all solids of a part in its frame, None if it has none.

    Raises
    ------
    ViewError
        If those of one are not known.
    """
    total = Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    a, r = m.values.pose(item)
    shells = False
    for one in item.children.values():
        if not one.active:
            continue
        if one.kind == "csg":
            total += combined(m, one, item.line).moved(a.T, -a.T @ r)
        if one.kind in UNKNOWN:
            raise ViewError(f"{one.path} is a {one.kind}, whose mass is not computed; {REMEDY}", item.line)
        shells |= one.kind == "shell"
        if one.kind in SHAPES:
            at, solid = SHAPES[one.kind](m, one)
            if one.children:
                solid += taken_off(m, one, item.line).times(-1.0)
            b, s = m.values.pose(at)
            total += solid.moved(a.T @ b, a.T @ (s - r))
    try:
        for body in bodies_of(m, item):
            total += _facets(m, body)
    except ModelError as error:
        raise ViewError(f"{error}; {REMEDY}", item.line) from error
    if shells and not _agrees(m, total, marker):
        # View counts surfaces in some parts and not in others; the centre that it wrote tells which
        raise ViewError(f"{item.path} has a shell, whose mass is not computed; {REMEDY}", item.line)
    return total if total.volume > 0.0 else None


def _agrees(m: Deckmaker, found: Moments, marker: Item | None) -> bool:
    """Return whether a centre of mass that the file gives is that of the moments."""
    if marker is None or not found.volume > 0.0:
        return False
    centre = found.first / found.volume
    spread = found.second / found.volume - np.outer(centre, centre)
    given = m.values.location(marker)
    return float(np.abs(given - centre).max()) < 1e-6 * math.sqrt(float(np.trace(spread)))


def mass_of_geometry(m: Deckmaker, item: Item, marker: Item | None) -> list[str | None]:
    """Return mass, centre and inertia of a part as arguments, from its solids; none of a part without any."""
    found = moments_of(m, item, marker)
    if found is None:
        return [] if marker is None else [f"CM = {m.id(marker)}"]
    mass = density_of(m, item) * found.volume
    centre = found.first / found.volume
    spread = found.second / found.volume - np.outer(centre, centre)
    inertia = mass * (np.trace(spread) * np.eye(3) - spread)
    if marker is None:
        a, r = m.values.pose(item)
        at, axes = m.new_marker(item, item, a, a @ centre + r), frames.IDENTITY
    else:
        at, axes = m.id(marker), m.values.orientation(marker)
        m.centres[id(marker)] = centre
    turned = axes.T @ inertia @ axes
    values = [turned[0, 0], turned[1, 1], turned[2, 2], -turned[0, 1], -turned[0, 2], -turned[1, 2]]
    # products that are rounding alone are none
    values = [0.0 if abs(x) < 1e-13 * max(values[:3]) else float(x) for x in values]
    if item.kind == "point_mass":
        return [f"MASS = {number(mass)}", f"CM = {at}"]
    return [f"MASS = {number(mass)}", f"CM = {at}", f"IP = {listed(values if any(values[3:]) else values[:3])}"]
