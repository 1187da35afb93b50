"""Bodies that are one solid of exact geometry: a ball, a block, a cylinder, a frustum or a torus."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.solids.bodies import Body, Face
from gearmbs.solids.surfaces import Surface, Turned

CLOSE = 1e-8
"""Lengths, m, and cosines that count as zero; the resolution of Parasolid's lengths."""


class Primitive(NamedTuple):
    """A solid about its origin: kind, sizes in m, origin and axes (columns) in the frame of the body.

    Sizes are the radius of a ``sphere``; the edges of a ``box``; radius and length along z of a ``cylinder``; radii at
    -length/2 and length/2 and the length of a ``frustum``; radius and that of the tube of a ``torus``.
    """

    kind: str
    sizes: tuple[float, ...]
    origin: np.ndarray
    axes: np.ndarray


def primitive(body: Body) -> Primitive | None:
    """Return the exact solid that a body is; None if it is another."""
    faces = body.faces
    kinds = sorted(f.surface.kind for f in faces)
    if len(faces) == 1:
        return _round(faces[0])
    if kinds == ["PLANE"] * 6:
        return _box(body)
    if kinds in (["CYLINDER", "PLANE", "PLANE"], ["CONE", "PLANE", "PLANE"], ["CONE", "PLANE"]):
        return _of_revolution(body)
    return None


def _outward(face: Face) -> bool:
    return face.outward * face.surface.sense > 0.0


def _frame(s: Turned) -> np.ndarray:
    return np.column_stack([s.x, s.y, s.axis])


def _round(face: Face) -> Primitive | None:
    s = face.surface
    if face.loops or not isinstance(s, Turned) or not _outward(face):
        return None
    if s.kind == "SPHERE":
        return Primitive("sphere", (s.radius,), s.origin, _frame(s))
    if s.kind == "TORUS" and s.radius > s.tube:
        return Primitive("torus", (s.radius, s.tube), s.origin, _frame(s))
    return None


def _normals(faces: list[Face]) -> np.ndarray:
    planes: list[Surface] = [f.surface for f in faces]
    return np.array([f.outward * p.sense * p.axis for f, p in zip(faces, planes, strict=True)])  # type: ignore[attr-defined]


def _box(body: Body) -> Primitive | None:
    """Six planes in three opposite pairs at right angles, each with one loop of four straight edges."""
    for face in body.faces:
        if len(face.loops) != 1 or len(face.loops[0]) != 4:
            return None
    normals = _normals(body.faces)
    first = normals[0]
    second = next((n for n in normals if abs(n @ first) < CLOSE), None)
    if second is None:
        return None
    axes = np.column_stack([first, second, np.cross(first, second)])
    along = np.sort(np.abs(normals @ axes), axis=1)
    if np.any(along[:, :2] > CLOSE) or np.linalg.matrix_rank(normals, tol=0.5) < 3:
        return None
    if np.any(np.sum(np.round(normals @ axes), axis=0)):
        return None
    corners = body.corners @ axes
    low, high = corners.min(axis=0), corners.max(axis=0)
    if np.any(np.minimum(np.abs(corners - low), np.abs(corners - high)) > CLOSE):
        return None
    return Primitive("box", tuple(high - low), axes @ (0.5 * (low + high)), axes)


def _of_revolution(body: Body) -> Primitive | None:
    """A cylinder or a cone between planes at right angles to its axis, whose edges are rings."""
    side = next(f for f in body.faces if f.surface.kind != "PLANE")
    caps = [f for f in body.faces if f.surface.kind == "PLANE"]
    s = side.surface
    if not isinstance(s, Turned) or not _outward(side) or len(side.loops) != len(caps):
        return None
    if any(len(loop) != 1 for f in body.faces for loop in f.loops) or any(len(f.loops) != 1 for f in caps):
        return None
    if np.any(np.abs(np.abs(_normals(caps) @ s.axis) - 1.0) > CLOSE):
        return None
    heights = sorted(float((c.surface.origin - s.origin) @ s.axis) for c in caps)  # type: ignore[attr-defined]
    if len(caps) == 1:
        heights = sorted([*heights, s.poles[0]])
    low, high = heights
    origin = s.origin + 0.5 * (low + high) * s.axis
    if s.kind == "CYLINDER":
        return Primitive("cylinder", (s.radius, high - low), origin, _frame(s))
    radii = [s.radius + h * s.slope for h in (low, high)]
    if min(radii) < -CLOSE:
        return None
    return Primitive("frustum", (max(radii[0], 0.0), max(radii[1], 0.0), high - low), origin, _frame(s))
