"""Closed meshes: the signed distance from one, whose triangles stand in blocks with boxes about them; from files."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.contacts.shapes import Box, Cylinder, Frustum, Mesh, Shape, Sphere, Torus
from gearmbs.mechanism.parts.quantities import quantity
from gearmbs.solids.bodies import PART_NUMBER, Body, faceted, primitive, read_bodies

# Points at which two solids touch, as rows of a table, and how such a point moves with its bodies.
#
# Of a point on the surface of body a that lies below the surface of body b there is kept where it is, the normal n from
# b to a, the depth, and the derivatives of the three by [dP_a, dpi_a, dP_b, dpi_b]. A material point x of a body about
# the origin P moves by dP + dpi x (x - P).


PLACE = 0
NORMAL = 3
DEPTH = 6
WEIGHT = 7
"""In the level of the pair: those of a plane face, or around the overlap of two boxes, sum to 1."""
POOL = 8
"""Number of the patch to which the point belongs; negative: not in contact."""
SWAPPED = 9
"""0: body a is that of marker I; 1: that of marker J."""
D_PLACE = 10
"""Derivatives, rows of 12 columns."""
D_NORMAL = D_PLACE + 36
D_DEPTH = D_NORMAL + 36
SHARE = D_DEPTH + 12
LEVEL = SHARE + 1
"""Depth at which the law of the load is taken, m."""
D_SHARE = LEVEL + 1
"""Derivatives of the share, then of the level, by the variations of bodies I and J, whichever is a."""
D_LEVEL = D_SHARE + 12
VERTEX = D_LEVEL + 12
"""Record of a vertex: its number, where it is, and the Hessian (9) of its distance in the frame of the other solid."""
VERTEX_PLACE = VERTEX + 1
HESSIAN = VERTEX_PLACE + 3
GAIN = HESSIAN + 9
"""Length of the gradient of the depth, by which the point bears less than its share where edges cross; else 1."""
D_GAIN = GAIN + 1
ALONG = D_GAIN + 12
"""Record of the deepest point of an edge: the edge, zero of other points, and by what the gradient changes along it,
in the other solid's frame; then the plane faces that meet at the edge."""
BENT = ALONG + 3
FACES = BENT + 3
COLUMNS = FACES + 2


@njit(cache=True, error_model="numpy", forceinline=True)
def moved(column, x, origin, out):
    """Write the derivative of a material point x by variation ``column`` (0 to 5) of its body."""
    out[0] = out[1] = out[2] = 0.0
    if column < 3:
        out[column] = 1.0
        return
    k = column - 3
    k1, k2 = (k + 1) % 3, (k + 2) % 3
    out[k1] = -(x[k2] - origin[k2])
    out[k2] = x[k1] - origin[k1]


@njit(cache=True, error_model="numpy", forceinline=True)
def relative(column, x, origin_a, origin_b, out):
    """Write by how much a point x of body a moves against that of body b, for one of the twelve variations."""
    if column < 6:
        moved(column, x, origin_a, out)
        return
    moved(column - 6, x, origin_b, out)
    for q in range(3):
        out[q] = -out[q]


@njit(cache=True, error_model="numpy", forceinline=True)
def turned(k, v, out):
    """Write e_k x v, the derivative of a body's direction v by dpi_k."""
    k1, k2 = (k + 1) % 3, (k + 2) % 3
    out[k] = 0.0
    out[k1] = -v[k2]
    out[k2] = v[k1]


@njit(cache=True, error_model="numpy", forceinline=True)
def dot(a, b):
    """Return the scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def to_global(pose, v, out):
    """Write the global components of a direction of a shape's frame; ``pose`` is axes (9), origin (3)."""
    for q in range(3):
        out[q] = pose[3 * q] * v[0] + pose[3 * q + 1] * v[1] + pose[3 * q + 2] * v[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def to_local(pose, v, out):
    """Write a global direction's components in a shape's frame."""
    for q in range(3):
        out[q] = pose[q] * v[0] + pose[3 + q] * v[1] + pose[6 + q] * v[2]


@njit(cache=True, error_model="numpy", forceinline=True)
def local_point(pose, x, out):
    """Write a global point's coordinates in a shape's frame."""
    d0, d1, d2 = x[0] - pose[9], x[1] - pose[10], x[2] - pose[11]
    for q in range(3):
        out[q] = pose[q] * d0 + pose[3 + q] * d1 + pose[6 + q] * d2


FACE, EDGE, CORNER = 0, 1, 2
TINY = 1e-300
"""In place of zero in a divisor, near the smallest normal double: of triangles and edges without extent."""
BLOCK = 16
"""Vertices or triangles that share a box, and such boxes that share another; neighbours in the tables are neighbours in
space."""


@njit(cache=True, error_model="numpy", forceinline=True)
def nearest_of_triangle(x, places, a, b, c, out):
    """Write the nearest point of a triangle; return on which feature it lies.

    Parameters
    ----------
    x : ndarray, shape (3,)
    places : ndarray
    a, b, c : int
        Where the coordinates of the corners begin in ``places``.
    out : ndarray, shape (3,)
    """
    ax, ay, az = places[a], places[a + 1], places[a + 2]
    bx, by, bz = places[b] - ax, places[b + 1] - ay, places[b + 2] - az
    cx, cy, cz = places[c] - ax, places[c + 1] - ay, places[c + 2] - az
    px, py, pz = x[0] - ax, x[1] - ay, x[2] - az
    d1, d2 = bx * px + by * py + bz * pz, cx * px + cy * py + cz * pz
    bb, bc, cc = bx * bx + by * by + bz * bz, bx * cx + by * cy + bz * cz, cx * cx + cy * cy + cz * cz
    d3, d4, d5, d6 = d1 - bb, d2 - bc, d1 - bc, d2 - cc
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    feature = FACE
    if d1 <= 0.0 and d2 <= 0.0:
        v, w, feature = 0.0, 0.0, CORNER
    elif d3 >= 0.0 and d4 <= d3:
        v, w, feature = 1.0, 0.0, CORNER
    elif d6 >= 0.0 and d5 <= d6:
        v, w, feature = 0.0, 1.0, CORNER
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w, feature = d1 / max(d1 - d3, TINY), 0.0, EDGE
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w, feature = 0.0, d2 / max(d2 - d6, TINY), EDGE
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / max(d4 - d3 + d5 - d6, TINY)
        v, feature = 1.0 - w, EDGE
    else:
        total = max(va + vb + vc, TINY)
        v, w = vb / total, vc / total
    out[0], out[1], out[2] = ax + v * bx + w * cx, ay + v * by + w * cy, az + v * bz + w * cz
    return feature


@njit(cache=True, error_model="numpy", forceinline=True)
def square_to_box(x, boxes, block):
    """Return the square of the distance of a point from the box of a block; 0 within."""
    total = 0.0
    for q in range(3):
        low, high = boxes[6 * block + q], boxes[6 * block + 3 + q]
        off = max(low - x[q], x[q] - high, 0.0)
        total += off * off
    return total


@njit(cache=True, error_model="numpy")
def nearest_box(x, boxes, first, end):
    """Return which of the boxes from ``first`` to ``end`` is nearest to a point."""
    nearest, least = first, np.inf
    for block in range(first, end):
        square = square_to_box(x, boxes, block)
        if square < least:
            nearest, least = block, square
    return nearest


@njit(cache=True, error_model="numpy")
def nearest_in_block(x, places, triangles, block, best, straight, found):
    """Look for a nearer triangle in a block; return the square of the least distance and how straight x is before it.

    Parameters
    ----------
    x : ndarray, shape (3,)
    places, triangles : ndarray
        As in `mesh_distance`.
    block : int
    best, straight : float
        What was found in other blocks.
    found : ndarray, shape (14,)
        In and out: nearest point (3), normal of its triangle (3), feature, side; then scratch.
    """
    near, normal = found[8:11], found[11:14]
    for k in range(3 * BLOCK * block, min(3 * BLOCK * (block + 1), triangles.size), 3):
        kind = nearest_of_triangle(x, places, 3 * triangles[k], 3 * triangles[k + 1], 3 * triangles[k + 2], near)
        square = (x[0] - near[0]) ** 2 + (x[1] - near[1]) ** 2 + (x[2] - near[2]) ** 2
        if square > best * (1.0 + 1e-12):
            continue
        a = places[3 * triangles[k] : 3 * triangles[k] + 3]
        b = places[3 * triangles[k + 1] : 3 * triangles[k + 1] + 3]
        c = places[3 * triangles[k + 2] : 3 * triangles[k + 2] + 3]
        for q in range(3):
            q1, q2 = (q + 1) % 3, (q + 2) % 3
            normal[q] = (b[q1] - a[q1]) * (c[q2] - a[q2]) - (b[q2] - a[q2]) * (c[q1] - a[q1])
        size = max(np.sqrt(dot(normal, normal)), TINY)
        height = 0.0
        for q in range(3):
            height += normal[q] / size * (x[q] - near[q])
        if square < best * (1.0 - 1e-12) or abs(height) > straight:
            best, straight = min(square, best), abs(height)
            for q in range(3):
                found[q] = near[q]
                found[3 + q] = normal[q] / size
            found[6], found[7] = kind, 1.0 if height >= 0.0 else -1.0
    return best, straight


@njit(cache=True, error_model="numpy")
def mesh_distance(x, places, triangles, boxes, groups, grad, hess, work):
    """Return the signed distance from a closed mesh; write gradient and Hessian.

    Of several triangles that are equally near, the one that x is most nearly in front of or behind tells the side.

    Parameters
    ----------
    x : ndarray, shape (3,)
    places : ndarray, shape (3 vertices,)
    triangles : ndarray of int, shape (3 triangles,)
        Corners, anticlockwise seen from outside.
    boxes, groups : ndarray, shape (6 blocks,), (6 groups,)
        Lowest and highest coordinates of each `BLOCK` triangles, of each `BLOCK` boxes.
    grad, hess : ndarray, shape (3,), (9,)
        Out.
    work : ndarray, shape (14,)
    """
    blocks, found = boxes.size // 6, work
    # the nearest box first, so that most others are too far
    group = nearest_box(x, groups, 0, groups.size // 6)
    start = nearest_box(x, boxes, BLOCK * group, min(BLOCK * (group + 1), blocks))
    best, straight = nearest_in_block(x, places, triangles, start, np.inf, -1.0, found)
    for group in range(groups.size // 6):
        if square_to_box(x, groups, group) > best * (1.0 + 1e-12):
            continue
        for block in range(BLOCK * group, min(BLOCK * (group + 1), blocks)):
            if block != start and square_to_box(x, boxes, block) <= best * (1.0 + 1e-12):
                best, straight = nearest_in_block(x, places, triangles, block, best, straight, found)
    phi, feature, side = np.sqrt(best), int(found[6]), found[7]
    for q in range(9):
        hess[q] = 0.0
    for q in range(3):
        grad[q] = found[3 + q]
    if feature == FACE or phi < 1e-12:
        return side * phi
    for q in range(3):
        grad[q] = side * (x[q] - found[q]) / phi
    if feature == CORNER:
        for q in range(3):
            for p in range(3):
                hess[3 * q + p] = ((1.0 if q == p else 0.0) - grad[q] * grad[p]) * side / phi
    return side * phi


# Meshes from files: STL (text and binary), OBJ and the SHELL files of ADAMS.


STL_HEADER = 84
STL_FACET = 50
"""Bytes of a binary STL before the facets and of each."""


def read_mesh(path: str | Path, scale: Any = 1.0) -> Mesh:
    """Read a closed surface.

    Parameters
    ----------
    path : path
        A .stl, .obj, .shl or .slp file.
    scale : float or str
        The file's unit of length: its SI value, m, or a text as ``"mm"``.

    Raises
    ------
    ModelError
        If the file cannot be read, holds no triangles, or its surface is not closed.
    """
    bare = isinstance(scale, str) and scale.strip()[:1].isalpha()
    scale = quantity(f"1 {scale.strip()}" if bare else scale, "length", "scale")
    if not scale > 0.0:
        raise ModelError(f"scale = {scale}; give the file's unit of length, above zero: 1e-3, or 'mm'")
    vertices, triangles = read_triangles(path)
    try:
        return Mesh(scale * vertices, triangles)
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None


def read_triangles(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Read vertices, in the file's unit of length, and triangles of a surface, which need not close.

    Raises
    ------
    ModelError
        If the file cannot be read or holds no triangles.
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
    return vertices, triangles


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
