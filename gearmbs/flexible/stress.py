"""Stresses of bodies that deform: linear in the modal coordinates, by stress modes.

A shape u_k of a body has the stresses S_k; the body that is deformed by sum_k q_k u_k has sum_k q_k S_k. Six numbers
describe a stress: xx, yy, zz, xy, yz, zx, in the frame of the nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from gearmbs.flexible.beam import DOFS, BeamSection, element_stiffness
from gearmbs.flexible.material import ElasticMaterial, FlexibleError

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")


class StressRecovery(Protocol):
    """How stresses follow from displacements and rotations of the nodes, each (n, N, 3)."""

    def __call__(self, moved: np.ndarray, turned: np.ndarray | None) -> StressModes:
        """Return the stresses of n shapes."""


class Peak(NamedTuple):
    """The largest equivalent stress of a body over time.

    Attributes
    ----------
    stress : float
        Pa.
    instant, place : int
        When, as a row of the coordinates, and where, as a row of the positions.
    position : ndarray, shape (3,)
        m.
    """

    stress: float
    instant: int
    place: int
    position: np.ndarray


@dataclass(frozen=True, eq=False)
class StressModes:
    """Stresses by one unit of each modal coordinate.

    Parameters
    ----------
    positions : ndarray, shape (P, 3)
        m, in the frame of the nodes.
    values : ndarray, shape (n, P, 6)
        xx, yy, zz, xy, yz, zx, Pa.

    Raises
    ------
    FlexibleError
        If sizes do not fit each other or a number is not finite.
    """

    positions: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", np.asarray(self.positions, dtype=float))
        object.__setattr__(self, "values", np.asarray(self.values, dtype=float))
        if self.values.ndim != 3 or self.values.shape[1:] != (len(self.positions), len(COMPONENTS)):
            raise FlexibleError(
                f"StressModes: values have shape {self.values.shape} for {len(self.positions)} places; give (modes, "
                f"places, {len(COMPONENTS)}): {', '.join(COMPONENTS)}"
            )
        if not np.all(np.isfinite(self.values)):
            raise FlexibleError("StressModes: values have entries that are not finite")

    def __repr__(self) -> str:
        return f"StressModes({len(self.values)} modes, {len(self.positions)} places)"

    def at(self, coordinates: npt.ArrayLike) -> np.ndarray:
        """Return the stresses for modal coordinates of shape (..., n), shape (..., P, 6), Pa.

        Raises
        ------
        FlexibleError
            For another number of coordinates.
        """
        q = np.asarray(coordinates, dtype=float)
        if q.ndim == 0 or q.shape[-1] != len(self.values):
            raise FlexibleError(f"coordinates have shape {q.shape}; there are stresses of {len(self.values)} modes")
        return np.tensordot(q, self.values, axes=1)

    def von_mises(self, coordinates: npt.ArrayLike) -> np.ndarray:
        """Return the equivalent stress by von Mises, shape (..., P), Pa; arguments as of `at`."""
        xx, yy, zz, xy, yz, zx = np.moveaxis(self.at(coordinates), -1, 0)
        normal = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
        return np.sqrt(normal + 3.0 * (xy**2 + yz**2 + zx**2))

    def principal(self, coordinates: npt.ArrayLike) -> np.ndarray:
        """Return the principal stresses, the largest first, shape (..., P, 3), Pa; arguments as of `at`."""
        xx, yy, zz, xy, yz, zx = np.moveaxis(self.at(coordinates), -1, 0)
        rows = (np.stack(row, axis=-1) for row in ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)))
        return np.linalg.eigvalsh(np.stack(list(rows), axis=-2))[..., ::-1]

    def peak(self, coordinates: npt.ArrayLike) -> Peak:
        """Return the largest equivalent stress over instants, coordinates of shape (m, n), and where it is."""
        rows = np.atleast_2d(np.asarray(coordinates, dtype=float))
        if not rows.size:
            raise FlexibleError("peak: the coordinates have no instants")
        best, when = np.array([-1.0]), 0
        for k, q in enumerate(rows):  # one by one: a long run of a large mesh would not fit into memory
            here = self.von_mises(q)
            if here.max() > best.max():
                best, when = here, k
        place = int(np.argmax(best))
        return Peak(float(best[place]), when, place, self.positions[place])


# How stresses follow from the displacements of shafts and of solid elements; see `gearmbs.flexible.stress`.


AROUND = 16
"""Places round about a shaft where its stress is known."""
SAME = 1e-6
"""Largest deviation of a shape from a combination of others, as a share of it."""


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
