"""A finite-element model of a body: nodes, degrees of freedom, stiffness and mass."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.beam import Slices
from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.stress import StressRecovery

LARGE = 100.0
"""Diagonal of a body, m, above which its unit of length is doubted."""
DENSE = 1e5
"""Mass over the cube of the diagonal, kg/m^3, above which units are doubted: no solid has a quarter of it."""

FAST = 4e4
"""Wave speed of a body, m/s, above which units are doubted: diamond has 34 000, steel 14 000 and its bars 5200."""
SLOW = 500.0
"""Wave speed, m/s, below which the units of a body are doubted that is heavier than any metal."""
SYMMETRIC = 1e-6
"""Difference of mirrored entries against the root of those of the diagonal: files with 4 bytes or 6 digits round so."""
ROUNDED = 1e-12
"""Entries below this share of the largest are rounding of what was turned or reduced."""
HEAVY = 3e4
"""Density, kg/m^3, above which a body is heavier than any metal: osmium has 22 600."""


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass, and inertia about it.

    Attributes
    ----------
    mass : float
        kg.
    com : ndarray, shape (3,)
        m, in the frame of the nodes.
    inertia : ndarray, shape (3, 3)
        kg m^2.
    """

    mass: float
    com: np.ndarray
    inertia: np.ndarray

    @property
    def least_density(self) -> float:
        """Mass over the volume of the solid ellipsoid of the same inertia, kg/m^3; infinite where that is flat.

        Of all bodies of one mass that are nowhere denser than a limit this one has the least inertia, so that no body
        is less dense everywhere.
        """
        spread = np.linalg.eigvalsh(0.5 * np.trace(self.inertia) * np.eye(3) - self.inertia) / self.mass
        volume = 4.0 / 3.0 * np.pi * np.sqrt(np.prod(5.0 * np.maximum(spread, 0.0)))
        return float(self.mass / volume) if volume > 0.0 else float("inf")

    def doubts(self, size: float) -> list[str]:
        """Return what speaks against the units of a body whose diagonal is ``size``, m; empty if nothing does."""
        out = []
        if size > LARGE:
            out.append(f"the body is {size:.4g} m large; if the file is in millimetres, give its unit of length")
        if self.mass / max(size, 1e-300) ** 3 > DENSE:
            out.append(f"{self.mass:.4g} kg in {size:.4g} m: the units of mass and length do not fit")
        return out


@dataclass(frozen=True, eq=False)
class FiniteElementModel:
    """Stiffness and mass of a body with its nodes.

    Parameters
    ----------
    ids : ndarray of int, shape (N,)
        Numbers of the nodes in their source.
    positions : ndarray, shape (N, 3)
        m.
    dofs : ndarray of int, shape (d, 2)
        Row of the node, and direction 0 to 5 (ux, uy, uz, rx, ry, rz), of each degree of freedom; row -1 is a
        generalised coordinate that no rigid motion moves, as modes of a superelement are.
    stiffness, mass : sparse matrix, shape (d, d)
        N/m and kg, with their rotational counterparts; symmetric.
    name : str
    seats : dict of str to int
        Nodes with a name, by their row.
    slices : Slices, optional
        What the mass matrix was made from, of beams.
    faces : ndarray of int, shape (f, 3 or 4), optional
        Rows of the corners of surface facets, for views.
    outline : ndarray, shape (k, 2), optional
        Of a body of revolution about z: rows of z and radius, m, for views.
    recovery : StressRecovery, optional
        How stresses follow from displacements of the nodes.

    Raises
    ------
    FlexibleError
        If sizes do not fit each other, or a matrix is not symmetric or not finite.
    """

    ids: np.ndarray
    positions: np.ndarray
    dofs: np.ndarray
    stiffness: sp.csc_array
    mass: sp.csc_array
    name: str = "body"
    seats: dict[str, int] = field(default_factory=dict)
    slices: Slices | None = None
    faces: np.ndarray | None = None
    outline: np.ndarray | None = None
    recovery: StressRecovery | None = None

    def __post_init__(self) -> None:
        d = len(self.dofs)
        for label in ("stiffness", "mass"):
            matrix = sp.csc_array(getattr(self, label))
            if matrix.shape != (d, d):
                raise FlexibleError(f"{self.name}: {label} has shape {matrix.shape}; there are {d} degrees of freedom")
            if not np.all(np.isfinite(matrix.data)):
                raise FlexibleError(f"{self.name}: {label} has entries that are not finite")
            self._check_entries(label, matrix)
            object.__setattr__(self, label, sp.csc_array(0.5 * (matrix + matrix.T)))
        if self.positions.shape != (len(self.ids), 3):
            raise FlexibleError(f"{self.name}: positions have shape {self.positions.shape} for {len(self.ids)} nodes")
        if d and (self.dofs[:, 0].max() >= len(self.ids) or self.dofs[:, 1].max() > 5 or self.dofs.min() < -1):
            raise FlexibleError(f"{self.name}: degrees of freedom name nodes or directions that do not exist")

    def _check_entries(self, label: str, matrix: sp.csc_array) -> None:
        """Refuse a matrix that is not symmetric, or has an entry without room between those of the diagonal.

        Of a positive semidefinite matrix a_ij^2 <= a_ii a_jj. Masses are; a stiffness may have lost it under a preload,
        and then keeps that a row whose diagonal is zero is empty.
        """
        size = np.abs(matrix.data).max(initial=0.0)
        root = np.sqrt(np.maximum(matrix.diagonal(), 0.0))
        coo = matrix.tocoo()
        room = root[coo.row] * root[coo.col]
        skew = (matrix - matrix.T).tocoo()
        far = np.abs(skew.data) - SYMMETRIC * root[skew.row] * root[skew.col] > ROUNDED * size
        if far.any():
            k = int(np.argmax(far))
            raise FlexibleError(
                f"{self.name}: {label} is not symmetric ({self._dof(skew.row[k])} with {self._dof(skew.col[k])}); if "
                "the file holds one triangle, read it with symmetry, else it is damaged"
            )
        over = np.abs(coo.data) - (1.0 + SYMMETRIC) * room > ROUNDED * size
        if label == "stiffness":
            over &= room == 0.0
        if over.any():
            k = int(np.argmax(over))
            raise FlexibleError(
                f"{self.name}: {label} of {self._dof(coo.row[k])} with {self._dof(coo.col[k])} is {coo.data[k]:.6g}, "
                f"between diagonal entries of {matrix.diagonal()[coo.row[k]]:.6g} and "
                f"{matrix.diagonal()[coo.col[k]]:.6g}: no body has such; the file is damaged, or "
                "a row is no displacement"
            )

    def _dof(self, row: int) -> str:
        """Return the name of a degree of freedom for messages."""
        node, direction = self.dofs[row]
        return f"direction {direction + 1} of node {self.ids[node]}" if 0 <= node < len(self.ids) else f"row {row + 1}"

    @property
    def has_rotations(self) -> bool:
        """Whether nodes have rotations."""
        return bool(np.any(self.dofs[:, 1] > 2))

    def dof_rows(self, node: int) -> np.ndarray:
        """Return the degree of freedom in each of the six directions of a node, -1 where there is none."""
        found = np.full(6, -1)
        for row in np.flatnonzero(self.dofs[:, 0] == node):
            found[self.dofs[row, 1]] = row
        return found

    def row_of(self, node_id: int) -> int:
        """Return the row of a node by its number.

        Raises
        ------
        FlexibleError
            If there is no such node.
        """
        found = np.flatnonzero(self.ids == node_id)
        if found.size == 0:
            near = self.ids[np.argsort(np.abs(self.ids - node_id))[:3]]
            raise FlexibleError(f"{self.name}: there is no node {node_id}; the nearest numbers are {near.tolist()}")
        return int(found[0])

    def nearest(self, point: np.ndarray) -> int:
        """Return the row of the node nearest to a point."""
        return int(np.argmin(np.linalg.norm(self.positions - np.asarray(point, dtype=float), axis=1)))

    def rigid_motion(self, about: np.ndarray | None = None) -> np.ndarray:
        """Return displacements of the degrees of freedom by unit translations and rotations, shape (d, 6)."""
        arm = self.positions - (np.zeros(3) if about is None else about)
        out = np.zeros((len(self.dofs), 6))
        node, direction = self.dofs[:, 0], self.dofs[:, 1]
        shift, turn = (direction < 3) & (node >= 0), (direction > 2) & (node >= 0)
        for c in range(3):
            turned = np.cross(np.eye(3)[c], arm)
            out[shift, c] = direction[shift] == c
            out[shift, 3 + c] = turned[node[shift], direction[shift]]
            out[turn, 3 + c] = direction[turn] == 3 + c
        return out

    def mass_properties(self) -> MassProperties:
        """Return mass, centre of mass and inertia from the mass matrix and rigid motions.

        Raises
        ------
        FlexibleError
            If the mass differs by direction, as where degrees of freedom were removed, or is not positive.
        """
        rigid = self.rigid_motion()
        m = rigid.T @ (self.mass @ rigid)
        masses = np.diag(m)[:3]
        mass = float(masses.mean())
        if not mass > 0.0:
            raise FlexibleError(f"{self.name}: its mass is {mass} kg; check the mass matrix and its density")
        if np.ptp(masses) > 1e-6 * mass:
            raise FlexibleError(
                f"{self.name}: its mass is {masses} kg in x, y and z; degrees of freedom are missing, "
                "export the matrices without supports"
            )
        # m s x: the block between translations and rotations
        first = m[:3, 3:]
        com = np.array([first[1, 2] - first[2, 1], first[2, 0] - first[0, 2], first[0, 1] - first[1, 0]]) / (2 * mass)
        inertia = m[3:, 3:] - mass * (com @ com * np.eye(3) - np.outer(com, com))
        return MassProperties(mass, com, 0.5 * (inertia + inertia.T))

    def wave_speed(self, properties: MassProperties) -> float:
        """Return the wave speed of the body, m/s: of its stiffness against unit strain in all directions, by its mass.

        All lines grow alike, so that nothing bends or twists whatever the elements are: of bars it is sqrt(E / rho), of
        solids sqrt(9 K / rho) with the bulk modulus K. Masses that are no solid's, and soft joints, make it smaller.
        """
        grown = np.zeros(len(self.dofs))
        node, direction = self.dofs[:, 0], self.dofs[:, 1]
        shift = (direction < 3) & (node >= 0)
        grown[shift] = (self.positions - properties.com)[node[shift], direction[shift]]
        return float(np.sqrt(max(grown @ (self.stiffness @ grown), 0.0) / properties.mass))

    def unit_doubts(self, properties: MassProperties) -> list[str]:
        """Return what speaks against the units that the model was read with; empty if nothing does."""
        out = properties.doubts(float(np.linalg.norm(np.ptp(self.positions, axis=0))))
        speed, density = self.wave_speed(properties), properties.least_density
        remedy = "give the units of length, force and mass of the file (mm, N, t of many)"
        if speed > FAST:
            out.append(f"waves run at {speed:.3g} m/s in it, faster than in any material: {remedy}")
        elif speed < SLOW and density > HEAVY:
            out.append(f"it has {density:.3g} kg/m^3 or more, and waves run at {speed:.3g} m/s in it: {remedy}")
        return out

    def placed(self, axes: np.ndarray, at: np.ndarray) -> FiniteElementModel:
        """Return the model in another frame; what is known of it as of a beam, and of its stresses, is not kept.

        Parameters
        ----------
        axes : ndarray, shape (3, 3)
            Columns: the axes of its own frame in the other one.
        at : ndarray, shape (3,)
            Its own origin there, m.

        Raises
        ------
        FlexibleError
            If a node lacks a direction, with which the others would have to be mixed, and the axes are others.
        """
        moved = replace(
            self, positions=self.positions @ np.transpose(axes) + at, slices=None, outline=None, recovery=None
        )
        if np.array_equal(axes, np.eye(3)):
            return moved
        nodes = np.flatnonzero(self.dofs[:, 0] >= 0)
        row_of = np.full((len(self.ids), 2, 3), -1)
        row_of[self.dofs[nodes, 0], self.dofs[nodes, 1] // 3, self.dofs[nodes, 1] % 3] = nodes
        whole, there = (row_of >= 0).all(axis=2), (row_of >= 0).any(axis=2)
        if (whole != there).any():
            node = self.ids[np.argmax((whole != there).any(axis=1))]
            raise FlexibleError(
                f"{self.name}: node {node} lacks a direction, so that the model cannot be turned; export all three "
                "displacements of each node, or leave axes out"
            )
        three = row_of[whole]
        others = np.flatnonzero(self.dofs[:, 0] < 0)
        rows = np.concatenate([np.repeat(three, 3, axis=1).ravel(), others])
        columns = np.concatenate([np.tile(three, 3).ravel(), others])
        values = np.concatenate([np.tile(np.ravel(axes), len(three)), np.ones(others.size)])
        turn = sp.csc_array((values, (rows, columns)), shape=self.stiffness.shape)
        return replace(moved, stiffness=turn @ self.stiffness @ turn.T, mass=turn @ self.mass @ turn.T)

    def field(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements and rotations of the nodes for vectors of the degrees of freedom.

        Parameters
        ----------
        vectors : ndarray, shape (d, n)

        Returns
        -------
        moved, turned : ndarray, shape (n, N, 3)
        """
        n = vectors.shape[1]
        both = np.zeros((len(self.ids), 6, n))
        placed = self.dofs[:, 0] >= 0
        both[self.dofs[placed, 0], self.dofs[placed, 1]] = vectors[placed]
        both = np.moveaxis(both, 2, 0)
        return both[:, :, :3].copy(), both[:, :, 3:].copy()

    def __repr__(self) -> str:
        return (
            f"FiniteElementModel({self.name!r}, {len(self.ids)} nodes, {len(self.dofs)} degrees of freedom, "
            f"{len(self.seats)} seats)"
        )
