"""Solids from Parasolid text files: exact where the whole body is one simple solid, else a mesh."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.contacts.shapes import Box, Cylinder, Frustum, Mesh, Shape, Sphere, Torus
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.solids.bodies import PART_NUMBER, Body, faceted, primitive, read_bodies

# Meshes from files: STL (text and binary), OBJ and the SHELL files of ADAMS.


STL_HEADER = 84
STL_FACET = 50
"""Bytes of a binary STL before the facets and of each."""


def read_mesh(path: str | Path, scale: float = 1.0) -> Mesh:
    """Read a closed surface.

    Parameters
    ----------
    path : path
        A .stl, .obj, .shl or .slp file.
    scale : float
        SI value of the file's unit of length, m.

    Raises
    ------
    ModelError
        If the file cannot be read, holds no triangles, or its surface is not closed.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise ModelError(f"{path}: a mesh is read from {', '.join(READERS)} files; save it as one")
    try:
        vertices, triangles = reader(path.read_bytes())
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (ValueError, IndexError, struct.error) as error:
        raise ModelError(f"{path}: it is not a whole {path.suffix} file: {error}") from None
    if len(triangles) == 0:
        raise ModelError(f"{path}: it holds no triangles")
    try:
        return Mesh(scale * vertices, triangles)
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None


def _stl(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    binary = len(data) >= STL_HEADER
    if binary:
        count = struct.unpack("<I", data[80:84])[0]
        binary = len(data) == STL_HEADER + STL_FACET * count
    if binary:
        facets = np.frombuffer(data, np.uint8, offset=STL_HEADER).reshape(count, STL_FACET)
        points = facets[:, 12:48].copy().view("<f4").astype(float).reshape(-1, 3)
    else:
        words = data.decode("latin-1").split()
        at = [k for k, word in enumerate(words) if word.lower() == "vertex"]
        points = np.array([[float(w) for w in words[k + 1 : k + 4]] for k in at], dtype=float).reshape(-1, 3)
    return points, np.arange(3 * (len(points) // 3)).reshape(-1, 3)


def _obj(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    points: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for line in data.decode("latin-1").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            numbers = [int(w.split("/")[0]) for w in words[1:]]
            _fan([n - 1 if n > 0 else len(points) + n for n in numbers], triangles)
    return np.array(points, dtype=float).reshape(-1, 3), np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _shell(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of vertices, faces, edges and a scale; then the vertices, then each face: its size and its vertices."""
    lines = [line.split() for line in data.decode("latin-1").splitlines()]
    rows = [words for words in lines if words and words[0][0] in "+-.0123456789"]
    n_vertices, n_faces = int(rows[0][0]), int(rows[0][1])
    scale = float(rows[0][3]) if len(rows[0]) > 3 else 1.0
    points = scale * np.array([[float(w) for w in row[:3]] for row in rows[1 : 1 + n_vertices]])
    triangles: list[tuple[int, int, int]] = []
    for row in rows[1 + n_vertices : 1 + n_vertices + n_faces]:
        numbers = [int(w) for w in row]
        _fan([n - 1 for n in numbers[1 : 1 + numbers[0]]], triangles)
    return points, np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _fan(corners: list[int], out: list[tuple[int, int, int]]) -> None:
    out.extend((corners[0], corners[k], corners[k + 1]) for k in range(1, len(corners) - 1))


READERS: dict[str, Callable[[bytes], tuple[np.ndarray, np.ndarray]]] = {
    ".stl": _stl, ".obj": _obj, ".shl": _shell, ".slp": _stl,
}  # fmt: skip

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
