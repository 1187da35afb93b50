"""Interfaces of a reduction: single nodes, faces made rigid (RBE2), faces followed on average (RBE3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.fe_model import FiniteElementModel

KINDS = ("rigid", "average")


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
        Reference point, m; default: the mean of the nodes.
    weights : sequence of float, optional
        Of the nodes of an average; default: equal.
    """

    name: str
    nodes: Sequence[int]
    kind: str = "rigid"
    at: Sequence[float] | None = None
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise FlexibleError(f"interface '{self.name}': kind {self.kind!r}; choose one of {', '.join(KINDS)}")
        if len(self.nodes) == 0:
            raise FlexibleError(f"interface '{self.name}': it has no nodes")
        if self.weights is not None and len(self.weights) != len(self.nodes):
            raise FlexibleError(f"interface '{self.name}': {len(self.weights)} weights for {len(self.nodes)} nodes")


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
    if face.at is not None:
        return np.asarray(face.at, dtype=float)
    return model.positions[[model.row_of(k) for k in face.nodes]].mean(axis=0)


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
    _check_spread(model, face, nodes)
    weights = np.ones(len(nodes)) if face.weights is None else np.asarray(face.weights, dtype=float)
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
    arm = model.positions[nodes] - model.positions[nodes].mean(axis=0)
    sizes = np.linalg.svd(arm, compute_uv=False)
    if len(nodes) < 3 or sizes[1] < 1e-6 * max(sizes[0], 1e-300):
        raise FlexibleError(
            f"interface '{face.name}': its {len(nodes)} nodes lie on one line and determine no rotation; add nodes"
        )
