"""Integrals of shapes over a finite-element body, as the floating frame needs them.

From slices (beams) they are exact sums, rotary inertia included. From the mass matrix of elements whose nodes have
displacements only they are exact too: such a matrix is a matrix of nodes times the unit matrix, so that the velocity
field w x (s + phi q), given at the nodes, has its kinetic energy (nodal floating frame of reference formulation, A.
Zwoelfer, J. Gerstmayr, Acta Mech. 232 (2021) 835). With nodal rotations in a matrix that is not of slices, first-order
integrals are exact, and those of second order are of the masses and inertias lumped at the nodes.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.beam import Slices
from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
from gearmbs.mechanism.modal import ShapeIntegrals

ROUNDING = 1e-12
"""Share of its largest by which a least moment of inertia may be negative."""


def shape_integrals(model: FiniteElementModel, shapes: np.ndarray, properties: MassProperties) -> ShapeIntegrals:
    """Return the integrals of shapes about the centre of mass.

    Parameters
    ----------
    model : FiniteElementModel
    shapes : ndarray, shape (d, n)
        Vectors of the degrees of freedom.
    properties : MassProperties
    """
    if model.slices is not None:
        return of_slices(model.slices, shapes, properties.com)
    if not model.has_rotations and model.dofs[:, 0].min() >= 0:
        return of_mass_matrix(model, shapes, properties.com)
    lumped = of_lumps(model, shapes, properties)
    rigid = model.rigid_motion(properties.com)
    moved = model.mass @ shapes
    first = rigid.T @ moved
    return ShapeIntegrals(
        shapes.T @ moved, first[:3].T.copy(), first[3:].T.copy(), lumped.cross, lumped.first, lumped.second
    )


def of_slices(slices: Slices, shapes: np.ndarray, com: np.ndarray) -> ShapeIntegrals:
    """Return the integrals of a body made of slices."""
    moved = np.einsum("pid,dk->kpi", slices.moved, shapes, optimize=True)
    turned = np.einsum("pid,dk->kpi", slices.turned, shapes, optimize=True)
    return ShapeIntegrals.of_points(
        slices.mass, slices.position - com, moved, inertias=slices.inertia, rotations=turned
    )


def of_mass_matrix(model: FiniteElementModel, shapes: np.ndarray, com: np.ndarray) -> ShapeIntegrals:
    """Return the integrals of a body whose nodes have displacements only, from its mass matrix."""
    n = shapes.shape[1]
    node, direction = model.dofs[:, 0], model.dofs[:, 1]
    moved, _ = model.field(shapes)
    arm = model.positions - com
    one = np.eye(3)
    # e_c x s and e_c x phi_k as vectors of the degrees of freedom
    turns = np.column_stack([np.cross(one[c], arm)[node, direction] for c in range(3)])
    shifts = np.column_stack([one[c][direction] for c in range(3)])
    crossed = np.stack([np.cross(one[c], moved)[:, node, direction] for c in range(3)])
    m_shapes, m_turns = model.mass @ shapes, model.mass @ turns
    mixed = np.einsum("dc,ekd->kce", m_turns, crossed, optimize=True)
    flat = crossed.reshape(3 * n, -1)
    products = (flat @ (model.mass @ flat.T)).reshape(3, n, 3, n)
    second = np.einsum("ckel->klce", products)
    return ShapeIntegrals(
        shapes.T @ m_shapes,
        m_shapes.T @ shifts,
        m_shapes.T @ turns,
        np.einsum("cld,dk->lkc", crossed, m_shapes, optimize=True),
        mixed + np.swapaxes(mixed, 1, 2),
        second + np.swapaxes(second, 2, 3),
    )


def lumps(model: FiniteElementModel) -> tuple[np.ndarray, np.ndarray]:
    """Return masses and inertias at the nodes: row sums of the mass matrix, and those of its rotational blocks.

    So the shares of a shaft's polar moment that couple neighbours are not lost.

    Returns
    -------
    masses : ndarray, shape (N,)
    inertias : ndarray, shape (N, 3, 3)
    """
    return nodal_lumps(len(model.ids), model.dofs, model.mass)


def nodal_lumps(count: int, dofs: np.ndarray, mass: sp.csc_array) -> tuple[np.ndarray, np.ndarray]:
    """Return masses and inertias at nodes from a mass matrix: see `lumps`.

    Parameters
    ----------
    count : int
        Number of nodes.
    dofs : ndarray of int, shape (d, 2)
        Row of the node and direction 0 to 5 of each degree of freedom; row -1 for generalised coordinates.
    mass : sparse matrix, shape (d, d)
    """
    node, direction = dofs[:, 0], dofs[:, 1]
    masses, inertias = np.zeros((3, count)), np.zeros((count, 3, 3))
    for c in range(3):
        chosen = (direction == c) & (node >= 0)
        row = (mass @ (chosen * 1.0)[:, None])[:, 0]
        np.add.at(masses[c], node[chosen], row[chosen])
    entries = mass.tocoo()
    turning = (node >= 0) & (direction > 2)
    both = turning[entries.row] & turning[entries.col]
    row, column, value = entries.row[both], entries.col[both], entries.data[both]
    np.add.at(inertias, (node[row], direction[row] - 3, direction[column] - 3), value)
    inertias = 0.5 * (inertias + np.swapaxes(inertias, 1, 2))
    # a node's own block is the fallback where its row sum is no inertia
    principal = np.linalg.eigvalsh(inertias)
    odd = principal[:, 0] < -ROUNDING * np.abs(principal).max(axis=1)
    own = (node[row] == node[column]) & odd[node[row]]
    inertias[odd] = 0.0
    inertias[node[row[own]], direction[row[own]] - 3, direction[column[own]] - 3] = value[own]
    return masses.mean(axis=0), inertias


def of_lumps(model: FiniteElementModel, shapes: np.ndarray, properties: MassProperties) -> ShapeIntegrals:
    """Return the integrals of the masses and inertias lumped at the nodes."""
    masses, inertias = lumps(model)
    moved, turned = model.field(shapes)
    return ShapeIntegrals.of_points(
        masses, model.positions - properties.com, moved, inertias=inertias, rotations=turned
    )
