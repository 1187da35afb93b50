"""Checks of finite-element models, as tables people can read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
from gearmbs.flexible.reduction import GROUNDED, free_modes

MOTIONS = ("x", "y", "z", "rot x", "rot y", "rot z")


@dataclass(frozen=True, eq=False)
class ModelReport:
    """What a finite-element model is like.

    Attributes
    ----------
    name : str
    properties : MassProperties
    directional_mass : ndarray, shape (3,)
        Mass against translation in x, y and z, kg; equal unless degrees of freedom are missing.
    rigid_energy : ndarray, shape (6,)
        Stiffness that unit rigid motions meet, against that of the same displacements one by one; zero of a free body.
    frequencies : ndarray
        The first of the free body, Hz, rigid motions included.
    massless : int
        Degrees of freedom without mass.
    remarks : list of str
        What is wrong or unusual; empty if nothing is.
    """

    name: str
    properties: MassProperties
    directional_mass: np.ndarray
    rigid_energy: np.ndarray
    frequencies: np.ndarray
    massless: int
    remarks: list[str]

    @property
    def slow(self) -> int:
        """How many of the frequencies are those of rigid motions."""
        return int(np.sum(self.frequencies < 1e-2 * self.frequencies.max(initial=0.0)))

    @property
    def good(self) -> bool:
        """Whether there is nothing to remark."""
        return not self.remarks

    def __repr__(self) -> str:
        p = self.properties
        energy = ", ".join(f"{m} {e:.1e}" for m, e in zip(MOTIONS, self.rigid_energy))
        lines = [
            f"{self.name}: mass {p.mass:.6g} kg, centre {np.array2string(p.com, precision=6)} m",
            f"inertia about the centre, kg m^2: {np.array2string(np.diag(p.inertia), precision=6)}",
            f"rigid-body energy: {energy}",
            f"first frequencies, Hz: {self.slow} rigid motions, "
            f"{', '.join(f'{f:.6g}' for f in self.frequencies[self.slow :]) or 'none'}",
            *(f"! {remark}" for remark in self.remarks),
        ]
        return "\n".join(lines)


def check_model(model: FiniteElementModel, count: int = 6) -> ModelReport:
    """Return the report of a model: mass properties, grounding, rigid modes.

    Parameters
    ----------
    model : FiniteElementModel
    count : int
        How many elastic frequencies are computed.

    Raises
    ------
    FlexibleError
        If it has no mass, or another one in each direction.
    """
    properties = model.mass_properties()
    rigid = model.rigid_motion(properties.com)
    masses = np.diag(rigid.T @ (model.mass @ rigid))[:3]
    diagonal = np.abs(model.stiffness.diagonal())
    energy = np.abs(np.einsum("dc,dc->c", rigid, model.stiffness @ rigid))
    energy = energy / np.maximum((rigid**2 * diagonal[:, None]).sum(axis=0), 1e-300)
    massless = int(np.sum(model.mass.diagonal() <= 0.0))
    frequencies = np.zeros(0)
    remarks = []
    if massless == 0:
        squared, _ = free_modes(model.stiffness, model.mass, rigid[:, :0], min(count + 6, len(model.dofs)))
        frequencies = np.sqrt(squared) / (2 * np.pi)
        slow = int(np.sum(frequencies < 1e-2 * frequencies[-1]))
        if slow != 6:
            remarks.append(f"{slow} modes are rigid motions instead of 6: the body is held, or is in several parts")
    else:
        still = int(np.sum(model.mass.diagonal()[model.dofs[:, 1] < 3] <= 0.0))
        if massless > still:
            remarks.append(f"{massless - still} rotations have no mass: lumped matrices leave them without")
        if still:
            remarks.append(f"{still} displacements have no mass: the mass matrix is not whole, or nodes carry nothing")
    worst = int(np.argmax(energy))
    if energy[worst] > GROUNDED:
        remarks.append(
            f"rigid motion {MOTIONS[worst]} meets stiffness: supports are in the matrices, or nodes are wrong"
        )
    values = np.linalg.eigvalsh(properties.inertia)
    if values[0] < 0.0 or values[2] > (1 + 1e-6) * (values[0] + values[1]):
        remarks.append(f"principal moments of inertia {values} kg m^2 are those of no body: nodes and mass do not fit")
    remarks += model.unit_doubts(properties)
    return ModelReport(model.name, properties, masses, energy, frequencies, massless, remarks)
