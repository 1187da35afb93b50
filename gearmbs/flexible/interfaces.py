"""Interfaces of a reduction: single nodes, faces made rigid (RBE2), faces followed on average (RBE3)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.material import FlexibleError
from gearmbs.units import Quantity, to_si

# The surface of a body that deforms: what is drawn of it, and how each of its points moves by the modes.


SIDES = 32
"""Number of sides of the prism that is drawn for a round shaft."""


@dataclass(frozen=True, eq=False)
class BodySurface:
    """Triangles of the surface, anticlockwise seen from outside, and the shapes there.

    Attributes
    ----------
    vertices : ndarray, shape (V, 3)
        m, in the frame of the nodes.
    triangles : ndarray of int, shape (k, 3)
    moved : ndarray, shape (n, V, 3)
        Displacement by one unit of each mode.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    moved: np.ndarray


def revolved_surface(
    outline: np.ndarray, stations: np.ndarray, section_motion: Callable[[float], tuple[np.ndarray, np.ndarray]]
) -> BodySurface:
    """Return a body of revolution about z; each of its sections moves and turns as a rigid disc.

    Parameters
    ----------
    outline : ndarray, shape (k, 2)
        Rows of z and radius, m.
    stations : ndarray
        Where the nodes are, m.
    section_motion : callable
        From z to displacements and rotations there by one unit of each mode, each (n, 3).
    """
    ends = stations[[0, -1]]
    rings = _with_stations(outline, stations)
    angle = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(SIDES)])
    vertices, moved = [], []
    for z, radius in [(rings[0, 0], 0.0), *rings, (rings[-1, 0], 0.0)]:
        at = float(np.clip(z, *ends))
        shift, turn = section_motion(at)
        arms = radius * (around if radius > 0.0 else around[:1]) + [0.0, 0.0, z - at]
        vertices.append(arms + [0.0, 0.0, at])
        moved.append(shift[:, None] + np.cross(turn[:, None], arms[None]))
    starts = np.cumsum([0, *(len(v) for v in vertices)])
    k = np.arange(SIDES)
    n = (k + 1) % SIDES
    triangles = [np.column_stack([np.zeros(SIDES, dtype=int), 1 + n, 1 + k])]
    for a, b in pairwise(starts[1:-2]):
        triangles += [np.column_stack([a + k, a + n, b + n]), np.column_stack([a + k, b + n, b + k])]
    last, tip = starts[-3], starts[-2]
    triangles.append(np.column_stack([np.full(SIDES, tip), last + k, last + n]))
    return BodySurface(np.concatenate(vertices), np.concatenate(triangles), np.concatenate(moved, axis=1))


def _with_stations(outline: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Return the outline, rows of z and radius, with rings at the nodes between its points."""
    rows = [outline[0]]
    for (z0, r0), (z1, r1) in pairwise(outline):
        inside = stations[(stations > z0 + 1e-9) & (stations < z1 - 1e-9)]
        rows += [np.array([z, r0 + (r1 - r0) * (z - z0) / (z1 - z0)]) for z in inside]
        rows.append(np.array([z1, r1]))
    return np.array(rows)


def outline_of(pieces: Sequence[tuple[float, float, float, float]]) -> np.ndarray:
    """Return the outline of cylinders and cones on one axis, rows of z and radius, m; steps have two rows at one place.

    Parameters
    ----------
    pieces : sequence of (float, float, float, float)
        Beginning and end, and the radii there, m; where they overlap the wider counts.
    """
    places = np.unique([p[:2] for p in pieces])
    rows: list[tuple[float, float]] = []
    for a, b in pairwise(places):
        if b - a < 1e-9 * np.ptp(places):
            continue
        here = [p for p in pieces if p[0] <= 0.5 * (a + b) <= p[1]]
        for z in (a, b):
            row = (z, max(p[2] + (p[3] - p[2]) * (z - p[0]) / (p[1] - p[0]) for p in here))
            if not rows or rows[-1] != row:
                rows.append(row)
    return np.array(rows)


def faceted_surface(positions: np.ndarray, faces: np.ndarray, moved: np.ndarray) -> BodySurface:
    """Return the surface of facets with three or four corners, rows of nodes."""
    triangles = outward(positions, triangulated(faces))
    used, numbers = np.unique(triangles, return_inverse=True)
    return BodySurface(positions[used], numbers.reshape(-1, 3), moved[:, used])


def triangulated(faces: np.ndarray) -> np.ndarray:
    """Return triangles of facets with three or four corners, shape (k, 3)."""
    faces = np.asarray(faces)
    if faces.shape[1] == 3:
        return faces
    three = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    return three[(three[:, 0] != three[:, 1]) & (three[:, 1] != three[:, 2]) & (three[:, 2] != three[:, 0])]


def outward(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return triangles turned so that neighbours agree, and that each closed part encloses a positive volume."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    t = np.array(triangles)
    ways = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    owner = np.tile(np.arange(len(t)), 3)
    forward = ways[:, 0] < ways[:, 1]
    edges = np.sort(ways, axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    same = np.flatnonzero((edges[order[1:]] == edges[order[:-1]]).all(axis=1))
    one, two = order[same], order[same + 1]
    # 2: the two run their edge alike, so that one of them has to be turned; 1: they agree
    link = np.where(forward[one] == forward[two], 2, 1)
    graph = sp.coo_array((link, (owner[one], owner[two])), shape=(len(t), len(t))).tocsr()
    graph = graph.maximum(graph.T).tocsr()
    count, part = connected_components(graph, directed=False)
    turned = np.zeros(len(t), dtype=bool)
    for k in range(count):
        members = np.flatnonzero(part == k)
        visited, before = breadth_first_order(graph, members[0], directed=False)
        for i in visited[1:]:
            turned[i] = turned[before[i]] ^ (graph[before[i], i] == 2)
    t[turned] = t[turned][:, ::-1]
    a, b, c = np.moveaxis(vertices[t] - vertices.mean(axis=0), 1, 0)
    volume = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c)), minlength=count)
    inside_out = volume[part] < 0.0
    t[inside_out] = t[inside_out][:, ::-1]
    return t


def hull_surface(positions: np.ndarray, moved: np.ndarray) -> BodySurface | None:
    """Return the convex hull of the nodes, None if they span no volume."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        found = ConvexHull(positions)
    except (QhullError, ValueError):
        return None
    return faceted_surface(positions, found.simplices, moved)


KINDS = ("rigid", "average")
FAR = 10.0
"""Distance of a reference point from its nodes, in diagonals of the body, above which it is given in another unit."""


@dataclass(frozen=True, eq=False)
class Interface:
    """A place where a body is joined or loaded, made of several nodes.

    Parameters
    ----------
    name : str
    nodes : sequence of int
        Numbers of the nodes.
    kind : {"rigid", "average"}
        ``"rigid"`` (RBE2): the nodes move as a rigid body with the reference point, which stiffens the body.
        ``"average"`` (RBE3): the reference point follows the nodes by weighted least squares, which adds no stiffness;
        a load at it is shared by the nodes.
    at : array_like of 3 floats, optional
        Reference point, m, or texts with units; default: the mean of the nodes.
    weights : sequence of float, optional
        Of the nodes of an average, none negative; default: equal.
    """

    name: str
    nodes: Sequence[int]
    kind: str = "rigid"
    at: Sequence[Quantity] | None = None
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise FlexibleError(f"interface '{self.name}': kind {self.kind!r}; choose one of {', '.join(KINDS)}")
        if len(self.nodes) == 0:
            raise FlexibleError(f"interface '{self.name}': it has no nodes")
        if len(set(self.nodes)) < len(self.nodes):
            raise FlexibleError(f"interface '{self.name}': it has nodes twice; give each once (numpy.unique)")
        if self.weights is not None and len(self.weights) != len(self.nodes):
            raise FlexibleError(f"interface '{self.name}': {len(self.weights)} weights for {len(self.nodes)} nodes")
        if self.weights is not None and not all(0.0 <= w < np.inf for w in self.weights):
            raise FlexibleError(f"interface '{self.name}': weights must be 0 or more, and finite; give others")
        if self.at is not None:
            try:
                object.__setattr__(self, "at", [float(to_si(x, "length", "at")) for x in self.at])
            except (TypeError, ValueError) as error:
                raise FlexibleError(f"interface '{self.name}': {error}") from None
            if len(self.at) != 3 or not np.all(np.isfinite(self.at)):
                raise FlexibleError(f"interface '{self.name}': at = {self.at}; give three finite lengths, m")


@dataclass(frozen=True, eq=False)
class Resolved:
    """Interfaces of a model as matrices.

    Attributes
    ----------
    expand : sparse matrix, shape (d, r)
        From the degrees of freedom that are left (rigid faces have six) to those of the model.
    constraints : sparse matrix, shape (b, r)
        The interfaces' own coordinates from those left: what a Craig-Bampton reduction holds.
    places : dict
        By name: position, and the rows in ``constraints`` of its coordinates in the six directions, -1 where none.
    """

    expand: sp.csc_array
    constraints: sp.csr_array
    places: dict[str, tuple[np.ndarray, np.ndarray]]


def resolve(model: FiniteElementModel, interfaces: Iterable[str | Interface]) -> Resolved:
    """Return the matrices of the interfaces of a model.

    Parameters
    ----------
    model : FiniteElementModel
    interfaces : iterable of str or Interface
        Names of the model's seats, or interfaces.

    Raises
    ------
    FlexibleError
        For unknown seats and nodes, names in use twice, rigid faces that share nodes, and faces that do not determine a
        rotation.
    """
    chosen = list(interfaces)
    names = [i if isinstance(i, str) else i.name for i in chosen]
    for name in names:
        if names.count(name) > 1:
            raise FlexibleError(f"{model.name}: interface '{name}' is there twice")
    d = len(model.dofs)
    rigid = [i for i in chosen if isinstance(i, Interface) and i.kind == "rigid"]
    dependent: dict[int, str] = {}
    blocks = []
    for face in rigid:
        rows, values = _rigid_rows(model, face)
        for row in rows:
            if int(row) in dependent:
                node = model.ids[model.dofs[row, 0]]
                raise FlexibleError(
                    f"{model.name}: node {node} is in the rigid faces '{dependent[int(row)]}' and '{face.name}'"
                )
            dependent[int(row)] = face.name
        blocks.append(
            sp.coo_array((values.ravel(), (np.repeat(rows, 6), np.tile(np.arange(6), rows.size))), shape=(d, 6))
        )
    free = np.setdiff1d(np.arange(d), np.fromiter(dependent, dtype=int, count=len(dependent)))
    kept = sp.coo_array((np.ones(free.size), (free, np.arange(free.size))), shape=(d, free.size))
    expand = sp.csc_array(sp.hstack([kept, *blocks]))
    column = np.full(d, -1)
    column[free] = np.arange(free.size)
    places: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    rows_out: list[sp.coo_array] = []
    count = 0
    for item in chosen:
        if isinstance(item, str):
            position, part, directions = _node_rows(model, item, column, expand.shape[1], dependent)
        elif item.kind == "rigid":
            start = free.size + 6 * rigid.index(item)
            part = sp.coo_array((np.ones(6), (np.arange(6), start + np.arange(6))), shape=(6, expand.shape[1]))
            position, directions = reference(model, item), np.arange(6)
        else:
            position, part, directions = reference(model, item), _average_rows(model, item) @ expand, np.arange(6)
        placed = np.full(6, -1)
        placed[directions] = count + np.arange(len(directions))
        places[names[len(places)]] = (position, placed)
        rows_out.append(sp.coo_array(part))
        count += len(directions)
    constraints = sp.csr_array(sp.vstack(rows_out)) if rows_out else sp.csr_array((0, expand.shape[1]))
    return Resolved(expand, constraints, places)


def reference(model: FiniteElementModel, face: Interface) -> np.ndarray:
    """Return the reference point of an interface."""
    mean = model.positions[[model.row_of(k) for k in face.nodes]].mean(axis=0)
    if face.at is None:
        return mean
    size = float(np.linalg.norm(np.ptp(model.positions, axis=0)))
    if np.linalg.norm(face.at - mean) > FAR * size:
        raise FlexibleError(
            f"interface '{face.name}': at = {list(face.at)} m is more than {FAR:g} the body's {size:.4g} m from its "
            "nodes; give metres, or texts as '300 mm'"
        )
    return np.asarray(face.at, dtype=float)


def _node_rows(model, name, column, width, dependent):
    """Return position, constraint rows and directions of a seat, which is one node."""
    if name not in model.seats:
        known = ", ".join(model.seats) or "none"
        raise FlexibleError(
            f"{model.name}: there is no seat '{name}'; seats: {known}. Give an Interface for other nodes"
        )
    node = model.seats[name]
    rows = model.dof_rows(node)
    directions = np.flatnonzero(rows >= 0)
    for row in rows[directions]:
        if int(row) in dependent:
            raise FlexibleError(f"{model.name}: seat '{name}' is a node of the rigid face '{dependent[int(row)]}'")
    columns = column[rows[directions]]
    part = sp.coo_array((np.ones(columns.size), (np.arange(columns.size), columns)), shape=(columns.size, width))
    return model.positions[node], part, directions


def _rigid_rows(model: FiniteElementModel, face: Interface) -> tuple[np.ndarray, np.ndarray]:
    """Return the degrees of freedom of a face and their motion by the six of the reference point."""
    motion = model.rigid_motion(reference(model, face))
    nodes = [model.row_of(k) for k in face.nodes]
    rows = np.flatnonzero(np.isin(model.dofs[:, 0], nodes))
    _check_spread(model, face, nodes)
    return rows, motion[rows]


def _average_rows(model: FiniteElementModel, face: Interface) -> sp.csr_array:
    """Return the rows that give the reference point's motion: weighted least squares over the displacements."""
    nodes = [model.row_of(k) for k in face.nodes]
    weights = np.ones(len(nodes)) if face.weights is None else np.asarray(face.weights, dtype=float)
    _check_spread(model, face, [k for k, w in zip(nodes, weights) if w > 0.0])
    motion = model.rigid_motion(reference(model, face))
    rows = np.flatnonzero(np.isin(model.dofs[:, 0], nodes) & (model.dofs[:, 1] < 3))
    weight = np.array([weights[nodes.index(n)] for n in model.dofs[rows, 0]])
    r = motion[rows]
    normal = r.T @ (weight[:, None] * r)
    solved = np.linalg.solve(normal, (weight[:, None] * r).T)
    out = sp.lil_array((6, len(model.dofs)))
    out[:, rows] = solved
    return sp.csr_array(out)


def _check_spread(model: FiniteElementModel, face: Interface, nodes: list[int]) -> None:
    """Refuse nodes on one line: they do not determine a rotation."""
    for k in nodes:
        if not np.any(model.dofs[:, 0] == k):
            raise FlexibleError(f"interface '{face.name}': node {model.ids[k]} has no degrees of freedom")
    if model.has_rotations and face.kind == "rigid":
        return
    arm = model.positions[nodes] - model.positions[nodes].sum(axis=0) / max(1, len(nodes))
    sizes = np.linalg.svd(arm, compute_uv=False)
    if len(nodes) < 3 or sizes[1] < 1e-6 * max(sizes[0], 1e-300):
        raise FlexibleError(
            f"interface '{face.name}': its {len(nodes)} nodes lie on one line and determine no rotation; add nodes"
        )
