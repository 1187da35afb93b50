"""The consistent Timoshenko beam element along z: stiffness, and slices of mass that carry its inertia.

A node has six degrees of freedom (ux, uy, uz, rx, ry, rz). A section at x = z/l of an element of length l moves by
cubic functions that bend and shear exactly under loads at the ends (Przemieniecki, *Theory of Matrix Structural
Analysis*, section 11.6; Friswell et al., *Dynamics of Rotating Machines*, section 5.4), with Phi = 12 E I / (kappa G A
l^2). Mass and rotary inertia are sums over the sections at four Gauss points, where each section is a rigid slice:
that is exact for the consistent mass matrix, whose integrands have degree six, and the same slices give all integrals
of the floating frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from gearmbs.flexible.material import ElasticMaterial

DOFS = 6
"""Degrees of freedom of a node."""

GAUSS_X, GAUSS_W = (0.5 * (part + shift) for part, shift in zip(np.polynomial.legendre.leggauss(4), (1.0, 0.0)))
"""Points and weights of Gauss's rule on [0, 1]."""


def shear_coefficient(poisson_ratio: float, ratio: float = 0.0) -> float:
    """Return Cowper's shear coefficient of a round section.

    Parameters
    ----------
    poisson_ratio : float
    ratio : float
        Inner by outer diameter.

    References
    ----------
    G. R. Cowper, J. Appl. Mech. 33 (1966) 335.
    """
    nu, m2 = poisson_ratio, ratio**2
    return 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)


@dataclass(frozen=True)
class BeamSection:
    """Stiffness and inertia of a section whose principal axes are x and y.

    Attributes
    ----------
    axial, torsion : float
        E A, N, and G J, N m^2.
    bending, shear : tuple of 2 floats
        E I_y (bending in the xz plane) and E I_x (in the yz plane), N m^2; kappa G A in x and in y, N.
    mass : float
        A length, kg/m.
    inertia : tuple of 3 floats
        Rotary inertia a length about x, y and z, kg m.
    """

    axial: float
    torsion: float
    bending: tuple[float, float]
    shear: tuple[float, float]
    mass: float
    inertia: tuple[float, float, float]

    @classmethod
    def ring(
        cls, material: ElasticMaterial, outer: float, inner: float = 0.0, shear: float | None = None
    ) -> BeamSection:
        """Return the section of a round bar or tube; ``shear`` replaces Cowper's coefficient."""
        area = np.pi / 4 * (outer**2 - inner**2)
        second = np.pi / 64 * (outer**4 - inner**4)
        kappa = shear_coefficient(material.poisson_ratio, inner / outer) if shear is None else shear
        e, g, rho = material.youngs_modulus, material.shear_modulus, material.density
        return cls(
            e * area, 2 * g * second, (e * second,) * 2, (kappa * g * area,) * 2, rho * area,
            (rho * second, rho * second, 2 * rho * second),
        )  # fmt: skip

    @classmethod
    def rectangle(
        cls, material: ElasticMaterial, width: float, height: float, shear: float | None = None
    ) -> BeamSection:
        """Return the section of a bar, ``width`` along x and ``height`` along y, m.

        The torsion constant is Saint-Venant's series; ``shear`` replaces Cowper's coefficient
        10 (1 + nu) / (12 + 11 nu).
        """
        nu = material.poisson_ratio
        kappa = 10 * (1 + nu) / (12 + 11 * nu) if shear is None else shear
        area = width * height
        about_y, about_x = height * width**3 / 12, width * height**3 / 12
        e, g, rho = material.youngs_modulus, material.shear_modulus, material.density
        return cls(
            e * area, g * torsion_constant(width, height), (e * about_y, e * about_x), (kappa * g * area,) * 2,
            rho * area, (rho * about_x, rho * about_y, rho * (about_x + about_y)),
        )  # fmt: skip


def torsion_constant(width: float, height: float) -> float:
    """Return the torsion constant of a rectangle by Saint-Venant's series, m^4 (Timoshenko and Goodier, art. 109)."""
    thin, wide = sorted((width, height))
    n = np.arange(1, 30, 2)
    series = np.sum(np.tanh(n * np.pi * wide / (2 * thin)) / n**5)
    return wide * thin**3 * (1 / 3 - 64 / np.pi**5 * thin / wide * float(series))


def bending_shapes(x: np.ndarray, length: float, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Return deflections and rotations at x = z/l by (w1, w1', w2, w2') of the ends, each (points, 4)."""
    d = 1.0 / (1.0 + phi)
    w = d * np.column_stack(
        [
            1 - 3 * x**2 + 2 * x**3 + phi * (1 - x),
            length * (x - 2 * x**2 + x**3 + 0.5 * phi * (x - x**2)),
            3 * x**2 - 2 * x**3 + phi * x,
            length * (x**3 - x**2 + 0.5 * phi * (x**2 - x)),
        ]
    )
    turn = d * np.column_stack(
        [
            6 / length * (x**2 - x),
            1 - 4 * x + 3 * x**2 + phi * (1 - x),
            6 / length * (x - x**2),
            3 * x**2 - 2 * x + phi * x,
        ]
    )
    return w, turn


def bending_slopes(x: np.ndarray, length: float, phi: float) -> np.ndarray:
    """Return the slopes of the deflections of `bending_shapes` along z, (points, 4)."""
    d = 1.0 / (1.0 + phi)
    columns = [
        (6 * (x**2 - x) - phi) / length,
        1 - 4 * x + 3 * x**2 + 0.5 * phi * (1 - 2 * x),
        (6 * (x - x**2) + phi) / length,
        3 * x**2 - 2 * x + 0.5 * phi * (2 * x - 1),
    ]
    return d * np.column_stack(columns)


# the plane xz: (ux, ry); the plane yz: (uy, -rx), of the first node and of the second
_XZ, _YZ = np.array([0, 4, 6, 10]), np.array([1, 3, 7, 9])
_SIGN = np.array([1.0, -1.0, 1.0, -1.0])


def section_shapes(x: np.ndarray, length: float, section: BeamSection) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and rotations of the sections at x = z/l by the twelve degrees of freedom.

    Returns
    -------
    moved, turned : ndarray, shape (points, 3, 12)
    """
    x = np.atleast_1d(np.asarray(x, dtype=float))
    moved, turned = np.zeros((x.size, 3, 12)), np.zeros((x.size, 3, 12))
    for plane, (places, sign) in enumerate(((_XZ, np.ones(4)), (_YZ, _SIGN))):
        phi = 12 * section.bending[plane] / (section.shear[plane] * length**2)
        w, turn = bending_shapes(x, length, phi)
        moved[:, plane, places] = w * sign
        # about y the slope of ux, about x the negative slope of uy
        turned[:, 1 - plane, places] = turn * sign * (1.0 if plane == 0 else -1.0)
    for at, target in ((2, moved), (5, turned)):
        target[:, 2, at], target[:, 2, 6 + at] = 1 - x, x
    return moved, turned


def element_stiffness(length: float, section: BeamSection) -> np.ndarray:
    """Return the stiffness matrix of an element, shape (12, 12)."""
    k = np.zeros((12, 12))
    for plane, (places, sign) in enumerate(((_XZ, np.ones(4)), (_YZ, _SIGN))):
        ei = section.bending[plane]
        phi = 12 * ei / (section.shear[plane] * length**2)
        part = (
            ei
            / (length**3 * (1 + phi))
            * np.array(
                [
                    [12, 6 * length, -12, 6 * length],
                    [6 * length, (4 + phi) * length**2, -6 * length, (2 - phi) * length**2],
                    [-12, -6 * length, 12, -6 * length],
                    [6 * length, (2 - phi) * length**2, -6 * length, (4 + phi) * length**2],
                ]
            )
        )
        k[np.ix_(places, places)] += sign[:, None] * part * sign
    for at, value in ((2, section.axial / length), (5, section.torsion / length)):
        k[np.ix_([at, 6 + at], [at, 6 + at])] += value * np.array([[1, -1], [-1, 1]])
    return k


def geometric_stiffness(length: float, section: BeamSection, x: np.ndarray, tensions: np.ndarray) -> np.ndarray:
    """Return the matrix of 1/2 integral of N (ux'^2 + uy'^2) dz for tensions N, times weight, at points x, (12, 12)."""
    out = np.zeros((12, 12))
    for plane, (places, sign) in enumerate(((_XZ, np.ones(4)), (_YZ, _SIGN))):
        phi = 12 * section.bending[plane] / (section.shear[plane] * length**2)
        slope = bending_slopes(x, length, phi) * sign
        out[np.ix_(places, places)] += length * slope.T @ (tensions[:, None] * slope)
    return out


@dataclass(frozen=True, eq=False)
class Slices:
    """Rigid slices of a body that move and turn linearly with its degrees of freedom.

    Attributes
    ----------
    mass : ndarray, shape (p,)
        kg.
    position : ndarray, shape (p, 3)
        m, undeformed.
    inertia : ndarray, shape (p, 3, 3)
        About the slice's own centre, kg m^2.
    moved, turned : ndarray, shape (p, 3, dofs)
        Displacement and rotation by one unit of each degree of freedom.
    """

    mass: np.ndarray
    position: np.ndarray
    inertia: np.ndarray
    moved: np.ndarray
    turned: np.ndarray

    def mass_matrix(self) -> np.ndarray:
        """Return the mass matrix of the degrees of freedom, shape (dofs, dofs)."""
        moved, turned = self.moved, self.turned
        spun = np.einsum("pij,pjd->pid", self.inertia, turned)
        weighted = self.mass[:, None, None] * moved
        n = moved.shape[2]
        return moved.reshape(-1, n).T @ weighted.reshape(-1, n) + turned.reshape(-1, n).T @ spun.reshape(-1, n)

    def gyroscopic_matrix(self, axis: int = 2) -> np.ndarray:
        """Return G of slices that spin about an axis in a frame at rest: the equations of motion have + spin G q'.

        The spin's own part of the rotary inertia must be the same about the other two axes of a slice.
        """
        a, b = (axis + 1) % 3, (axis + 2) % 3
        polar = self.inertia[:, axis, axis]
        ta, tb = self.turned[:, a, :], self.turned[:, b, :]
        return ta.T @ (polar[:, None] * tb) - tb.T @ (polar[:, None] * ta)
