"""Checks of finite-element models and of their reductions, as tables people can read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
from gearmbs.flexible.interfaces import resolve
from gearmbs.flexible.modal_model import ModalModel
from gearmbs.flexible.reduction import GROUNDED, attachment_modes, free_modes

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


@dataclass(frozen=True, eq=False)
class ReductionReport:
    """How near a reduction is to its finite elements.

    Attributes
    ----------
    frequencies, exact : ndarray, shape (n,)
        Of the free body, Hz: reduced, and of the finite elements.
    similarity : ndarray, shape (n,)
        Modal assurance criterion of each reduced mode with the best of the exact ones, 0 to 1.
    flexibility : dict of str to float
        Of each seat, the share of the flexibility of the free body there, under forces, that the reduction has lost.
    turning : dict of str to float
        The same under torques, of seats that turn: what a joint needs that holds the seat's direction.
    """

    frequencies: np.ndarray
    exact: np.ndarray
    similarity: np.ndarray
    flexibility: dict[str, float]
    turning: dict[str, float]

    @property
    def errors(self) -> np.ndarray:
        """Relative errors of the frequencies, shape (n,)."""
        return self.frequencies / self.exact - 1.0

    def converged_up_to(self, tolerance: float = 0.01) -> float:
        """Return the frequency, Hz, up to which errors stay below a tolerance."""
        bad = np.flatnonzero(np.abs(self.errors) > tolerance)
        return float(self.frequencies[-1] if bad.size == 0 else self.frequencies[bad[0] - 1] if bad[0] else 0.0)

    def __repr__(self) -> str:
        head = "mode    reduced, Hz      exact, Hz    error, %   MAC"
        rows = [
            f"{k + 1:4d} {a:14.4f} {b:14.4f} {100 * (a / b - 1):11.4f} {s:5.3f}"
            for k, (a, b, s) in enumerate(zip(self.frequencies, self.exact, self.similarity))
        ]
        lost = []
        for key, share in self.flexibility.items():
            torques = f", {100 * self.turning[key]:.3g} % under torques" if key in self.turning else ""
            lost.append(f"seat {key}: {100 * share:.3g} % of its static flexibility is lost under forces{torques}")
        return "\n".join([head, *rows, *lost, f"errors below 1 % up to {self.converged_up_to():.6g} Hz"])


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
    size = float(np.linalg.norm(np.ptp(model.positions, axis=0)))
    remarks += properties.doubts(size)
    return ModelReport(model.name, properties, masses, energy, frequencies, massless, remarks)


def check_reduction(model: FiniteElementModel, reduced: ModalModel, interfaces=None) -> ReductionReport:
    """Compare a reduction with its finite elements: free frequencies, shapes, static flexibility of the seats.

    Slow modes have little of the flexibility under torques; a body clamped at a seat is too stiff by what is lost.

    Parameters
    ----------
    model : FiniteElementModel
    reduced : ModalModel
    interfaces : iterable, optional
        As given to :func:`reduce_model`; default: the model's seats.
    """
    parts = resolve(model, list(model.seats) if interfaces is None else interfaces)
    k, m = parts.expand.T @ model.stiffness @ parts.expand, parts.expand.T @ model.mass @ parts.expand
    gram = parts.expand.T @ parts.expand
    rigid = spl.splu(sp.csc_matrix(gram)).solve(np.asarray(parts.expand.T @ model.rigid_motion()))
    n = reduced.modes
    squared, vectors = free_modes(sp.csc_array(k), sp.csc_array(m), rigid, n)
    exact, _ = model.field(np.asarray(parts.expand @ vectors))
    a, b = reduced.moved.reshape(n, -1), exact.reshape(vectors.shape[1], -1)
    mac = (a @ b.T) ** 2 / np.outer((a**2).sum(axis=1), (b**2).sum(axis=1))
    # a pair of equal modes shares its shapes
    frequencies = np.sqrt(squared) / (2 * np.pi)
    same = np.abs(frequencies[:, None] - frequencies) < 1e-4 * frequencies
    grouped = np.array([(mac[:, same[:, j]]).sum(axis=1) for j in range(frequencies.size)]).T
    return ReductionReport(
        reduced.frequencies,
        frequencies,
        np.minimum(grouped.max(axis=1), 1.0),
        *_lost(sp.csc_array(k), sp.csc_array(m), parts, rigid, reduced),
    )


def _lost(k, m, parts, rigid: np.ndarray, reduced: ModalModel) -> tuple[dict[str, float], dict[str, float]]:
    """Return how much of the flexibility of the free body at each seat is lacking, under forces and under torques."""
    forces: dict[str, float] = {}
    torques: dict[str, float] = {}
    if not parts.places:
        return forces, torques
    shapes = attachment_modes(k, m, rigid, parts.constraints)
    inertial = m @ rigid
    shapes = shapes - rigid @ np.linalg.solve(rigid.T @ inertial, inertial.T @ shapes)
    exact = np.diag(parts.constraints @ shapes)
    stiff = (2 * np.pi * reduced.frequencies) ** 2
    for key, (_, rows) in parts.places.items():
        seat = reduced.seats[key]
        for out, three, motion in ((forces, rows[:3], seat.moved), (torques, rows[3:], seat.turned)):
            there = three >= 0
            whole = exact[three[there]].sum()
            if whole > 0.0:
                out[key] = float(1.0 - (motion[:, there] ** 2 / stiff[:, None]).sum() / whole)
    return forces, torques
