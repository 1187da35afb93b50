"""How stresses follow from the displacements of shafts and of solid elements; see `gearmbs.flexible.stress`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gearmbs.flexible.beam import DOFS, BeamSection, element_stiffness
from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.material import ElasticMaterial
from gearmbs.flexible.stress import COMPONENTS, StressModes

AROUND = 16
"""Places round about a shaft where its stress is known."""
SAME = 1e-6
"""How far a shape may be from a combination of others, as a share of it."""


@dataclass(frozen=True, eq=False)
class ShaftStresses:
    """Nominal stresses on the outside of a shaft, from the forces at the ends of its elements.

    Both ends of each element have places round about. Tension and bending make sigma_zz = N/A + (M_x y - M_y x) / I,
    torsion and shear make the tangential tau = T r / J + 4/3 k V / A, with k = (R^2 + R r + r^2) / (R^2 + r^2) of a
    tube, 1 of a solid bar (S. Timoshenko, *Strength of Materials I*, art. 26). Notches are not in it.

    Attributes
    ----------
    stations : ndarray, shape (m + 1,)
        Where the nodes are, m.
    sections : sequence of BeamSection
        Of the m elements.
    diameters : sequence of ((float, float), (float, float))
        Outer and inner diameter at both ends of each element, m.
    """

    stations: np.ndarray
    sections: Sequence[BeamSection]
    diameters: Sequence[tuple[tuple[float, float], tuple[float, float]]]

    def __call__(self, moved: np.ndarray, turned: np.ndarray | None) -> StressModes:
        """Return the stresses of n shapes."""
        assert turned is not None
        both = np.concatenate([moved, turned], axis=2)
        angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
        c, s = np.cos(angle), np.sin(angle)
        positions, values = [], []
        for k, (a, b) in enumerate(pairwise(self.stations)):
            ends = both[:, k : k + 2].reshape(-1, 2 * DOFS)
            forces = ends @ element_stiffness(b - a, self.sections[k])
            for at, load, sizes in zip((a, b), (-forces[:, :DOFS], forces[:, DOFS:]), self.diameters[k]):
                outer, inner = (d / 2 for d in sizes)
                area, second = np.pi * (outer**2 - inner**2), np.pi / 4 * (outer**4 - inner**4)
                fx, fy, fz, mx, my, mz = (load[:, i, None] for i in range(DOFS))
                share = (outer**2 + outer * inner + inner**2) / (outer**2 + inner**2)
                along = fz / area + outer * (mx * s - my * c) / second
                tangential = 0.5 * outer * mz / second + 4 / 3 * share / area * (fy * c - fx * s)
                stress = np.zeros((len(load), AROUND, len(COMPONENTS)))
                stress[..., 2], stress[..., 4], stress[..., 5] = along, tangential * c, -tangential * s
                positions.append(np.column_stack([outer * c, outer * s, np.full(AROUND, at)]))
                values.append(stress)
        return StressModes(np.concatenate(positions), np.concatenate(values, axis=1))


@dataclass(frozen=True, eq=False)
class SolidStresses:
    """Stresses at the nodes of solid elements: Hooke's law of the strains, projected by least squares (L2).

    Attributes
    ----------
    basis : skfem.Basis
        Of displacements.
    element : skfem.Element
        Of the projected stresses: scalar, with the same nodes.
    material : ElasticMaterial
    """

    basis: object
    element: object
    material: ElasticMaterial

    def __call__(self, moved: np.ndarray, turned: np.ndarray | None = None) -> StressModes:
        """Return the stresses of n shapes."""
        import scipy.sparse.linalg as spl
        from skfem import BilinearForm

        scalar = self.basis.with_element(self.element)  # type: ignore[attr-defined]
        solve = spl.factorized(BilinearForm(lambda u, v, _: u * v).assemble(scalar).tocsc())
        shear, nu = self.material.shear_modulus, self.material.poisson_ratio
        lame = 2.0 * shear * nu / (1.0 - 2.0 * nu)
        values = np.zeros((len(moved), moved.shape[1], len(COMPONENTS)))
        tests = [np.asarray(scalar.basis[i][0]) * scalar.dx for i in range(scalar.Nbfun)]
        for k, shape in enumerate(moved):
            grad = self.basis.interpolate(shape.reshape(-1)).grad  # type: ignore[attr-defined]
            strain = 0.5 * (grad + np.swapaxes(grad, 0, 1))
            trace = strain[0, 0] + strain[1, 1] + strain[2, 2]
            for c, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))):
                stress = 2.0 * shear * strain[i, j] + (lame * trace if i == j else 0.0)
                right = np.zeros(scalar.N)
                for row, test in zip(scalar.element_dofs, tests):
                    np.add.at(right, row, (stress * test).sum(axis=1))
                values[k, :, c] = solve(right)
        return StressModes(scalar.doflocs.T, values)


@dataclass(frozen=True, eq=False)
class KnownStresses:
    """Stresses of combinations of shapes whose own stresses are known, as a finite-element program gives them.

    Attributes
    ----------
    shapes : ndarray, shape (n, N, 3)
        Displacements.
    stresses : StressModes
        Of the n shapes.
    """

    shapes: np.ndarray
    stresses: StressModes

    def __post_init__(self) -> None:
        if len(self.stresses.values) != len(self.shapes):
            raise FlexibleError(
                f"there are stresses of {len(self.stresses.values)} modes for {len(self.shapes)} modes; give those of "
                "each, in the same order"
            )

    def __call__(self, moved: np.ndarray, turned: np.ndarray | None = None) -> StressModes:
        """Return the stresses of n shapes."""
        known, wanted = (shapes.reshape(len(shapes), -1) for shapes in (self.shapes, moved))
        shares = np.linalg.lstsq(known.T, wanted.T, rcond=None)[0].T
        away = np.linalg.norm(wanted - shares @ known, axis=1) > SAME * np.linalg.norm(wanted, axis=1)
        if away.any():
            raise FlexibleError(
                f"mode {1 + int(np.argmax(away))} is no combination of the {len(known)} shapes whose stresses are known"
            )
        return StressModes(self.stresses.positions, np.tensordot(shares, self.stresses.values, axes=1))
