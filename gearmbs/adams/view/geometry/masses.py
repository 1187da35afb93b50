"""Mass, centre and inertia of a part from its solids and its density, where the file gives no mass."""

from __future__ import annotations

import math

import numpy as np

from gearmbs.adams.view import frames
from gearmbs.adams.view.deckmaker import Deckmaker
from gearmbs.adams.view.geometry.combined import combined, taken_off
from gearmbs.adams.view.geometry.solids import REMEDY, SHAPES, Moments, need, polyhedron
from gearmbs.adams.view.lexer import ViewError
from gearmbs.adams.view.model import UNREAD, Item
from gearmbs.adams.write.text import listed, number
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.contacts.meshes import read_triangles
from gearmbs.solids.bodies import PART_NUMBER, Body, faceted, read_bodies

STANDARD = {
    "steel": 7801.0, "stainless": 7750.0, "aluminum": 2740.0, "brass": 8545.0, "cast_iron": 7080.0, "copper": 8906.0,
    "glass": 2595.0, "lead": 11370.0, "magnesium": 1795.0, "nickel": 7750.0, "titanium": 4850.0, "tungsten": 19222.0,
    "wood": 438.0,
}  # fmt: skip
"""Densities in kg/m^3 of the materials that View's models begin with (table of standard materials of its manual)."""
UNKNOWN = frozenset("solid feature".split())
"""Solids whose moments are not computed."""
EXACT = 1e-6
"""A centre of mass that View wrote is that of exact moments within so much of the radius of gyration, by its digits."""
FACETED = 1e-4
"""The same of moments with a shell, whose facets are not the surface that View had: three buckets agree to 1.4e-5."""
MOST_FACETS = 5000
"""Of a shell; the work goes with their square."""
RAYS = np.array(
    [[0.31, 0.52, 0.79], [-0.67, 0.27, 0.69], [0.73, -0.61, 0.31], [0.17, 0.93, -0.33], [-0.47, -0.39, 0.79]]
)
"""Directions in which facets are looked along, off all planes in which solids are built."""


def density_of(m: Deckmaker, item: Item) -> float:
    """Return the density of a part: its own, or that of its material.

    Raises
    ------
    ViewError
    """
    density = m.values.number(item, "density")
    if density is not None:
        return density
    name = str(m.values.text(item, "material_type"))
    found = m.db.find(name, ("material",))
    if found is not None:
        return need(m, found, "density")
    standard = STANDARD.get(name.rsplit(".", 1)[-1].lower())
    if standard is None:
        raise ViewError(f"{item.path}: there is no material {name[:60]}", item.line)
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


def facing_outward(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return triangles with their corners anticlockwise from outside, of a surface that may have gaps between facets.

    A ray from a facet leaves the solid by an odd number of others if it starts inwards; of rays along several
    directions, both ways, the majority decides.
    """
    corners = vertices[triangles]
    edges = np.roll(corners, -1, axis=1) - corners
    normal, middles = np.cross(edges[:, 0], edges[:, 1]), corners.mean(axis=1)
    size = float(np.ptp(vertices, axis=0).max())
    inwards = np.zeros(len(triangles))
    for ray in RAYS:
        along = normal @ ray
        facing = np.abs(along) > 1e-12 * size**2
        planes = np.cross(edges, ray)
        reach = np.sum(planes * corners, axis=2)
        for k, middle in enumerate(middles):
            # a ray that hits a facet is on the same side of the planes of its three edges along the ray
            sides = planes @ middle - reach
            hit = facing & (np.all(sides >= 0.0, axis=1) | np.all(sides <= 0.0, axis=1))
            away = np.sum(normal[hit] * (corners[hit, 0] - middle), axis=1) / along[hit]
            for sign in (1.0, -1.0):
                odd = np.count_nonzero(sign * away > 1e-9 * size) % 2
                inwards[k] += np.sign(sign * along[k]) * (1.0 if odd else -1.0)
    return np.where(inwards[:, None] > 0.0, triangles[:, ::-1], triangles)


def _shell(m: Deckmaker, item: Item, line: int) -> Moments:
    """Return the moments of a shell as a solid, in the frame of its reference marker.

    Raises
    ------
    ViewError
        If its file is not beside the command file, or cannot be read.
    """
    name = m.values.text(item, "file_name") or ""
    path = m.beside(name)
    if path is None:
        raise ViewError(f"{name[:80]} of {item.path} is not beside the command file; {REMEDY}", line)
    try:
        vertices, triangles = read_triangles(path)
    except ModelError as error:
        raise ViewError(f"{error}; {REMEDY}", line) from error
    if not (len(triangles) <= MOST_FACETS and triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise ViewError(f"{item.path} has {len(triangles)} facets, of at most {MOST_FACETS} vertices in the file")
    # about the middle, gaps between facets weigh least
    middle = vertices.mean(axis=0)
    return polyhedron(vertices - middle, facing_outward(vertices, triangles)).moved(frames.IDENTITY, middle)


def moments_of(m: Deckmaker, item: Item, marker: Item | None) -> Moments | None:
    """Return the moments of all solids of a part in its frame, None if it has none.

    Raises
    ------
    ViewError
        If those of one are not known.
    """
    total = Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    a, r = m.values.pose(item)
    shells = []
    for one in item.children.values():
        if not m.active(one):
            continue
        if one.kind == "csg":
            total += combined(m, one, item.line).moved(a.T, -a.T @ r)
        if one.kind == UNREAD:
            what = f"{(m.values.text(one, 'file_name') or '')[:80]} with geometry of {item.path} is not read"
            raise ViewError(f"file geometry read: {what}; {REMEDY}", one.line)
        if one.kind in UNKNOWN:
            raise ViewError(f"{one.path} is a {one.kind}, whose mass is not computed; {REMEDY}", item.line)
        if one.kind == "shell":
            shells.append(one)
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
    # View counts surfaces in some parts and not in others; the centre that it wrote tells which
    if shells and _apart(m, total, marker) > EXACT:
        for one in shells:
            b, s = m.values.pose(m.values.ref(one, "reference_marker", ("marker",)) or item)
            total += _shell(m, one, item.line).moved(a.T @ b, a.T @ (s - r))
        if not (apart := _apart(m, total, marker)) < FACETED:
            raise ViewError(f"{item.path} has a shell, whose mass is not known; {REMEDY}", item.line)
        m.remark(
            item,
            f"a solid of {shells[0].path}: its centre of mass is the given one to {apart:.0e} radii of gyration",
        )
    return total if total.volume > 0.0 else None


def _apart(m: Deckmaker, found: Moments, marker: Item | None) -> float:
    """Return how far the centre that a file gives is from that of the moments, by the radius of gyration."""
    if marker is None or not found.volume > 0.0:
        return math.inf
    centre = found.first / found.volume
    spread = found.second / found.volume - np.outer(centre, centre)
    radius = math.sqrt(max(float(np.trace(spread)), 0.0))
    return float(np.abs(m.values.location(marker) - centre).max()) / radius if radius > 0.0 else math.inf


def mass_of_geometry(m: Deckmaker, item: Item, marker: Item | None) -> list[str | None]:
    """Return mass, centre and inertia of a part as arguments, from its solids; none of a part without any.

    View computes them only where a density or a material is given: of a solid that was read from a file and given
    neither, it exported a part without mass.
    """
    unread = any(one.kind == UNREAD and m.active(one) for one in item.children.values())
    if not unread and not item.fields.keys() & {"density", "material_type"}:
        if m.parasolids or any(one.kind in (*SHAPES, *UNKNOWN, "csg", "shell") for one in item.children.values()):
            m.remark(item, "no mass, density or material_type is given: it has none; give one for that of its solids")
        return [] if marker is None else [f"CM = {m.id(marker)}"]
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
