"""Checks of finite-element models, as tables people can read."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.optimize
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
from gearmbs.flexible.interfaces import Interface, Resolved, resolve
from gearmbs.flexible.modal_model import ModalModel
from gearmbs.flexible.reduction import GROUNDED, HeldBody, free_modes, static_flexibility

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


# How near a reduction is to its finite elements, as a table people can read.
#
# A body that is alike in several planes has equal frequencies, whose shapes are any basis of their common space. So
# modes are not compared one by one but with the spaces of equal frequencies: the share of the modal mass of a reduced
# mode that lies in such a space is its modal assurance, and modes are paired one to one so that the sum of these shares
# is largest.


EQUAL = 1e-4
"""Relative distance of neighbouring frequencies that count as equal: meshes of round bodies split their pairs."""

ALIKE = 0.5
"""Least modal assurance of modes that are the same: more than half of one can lie in one other space only."""

SPARE = 12
"""Exact modes beyond as many as the reduction has, among which those that it has left out are found."""


@dataclass(frozen=True, eq=False)
class ReductionReport:
    """How near a reduction is to its finite elements.

    Attributes
    ----------
    frequencies, exact : ndarray, shape (n,)
        Of the free body, Hz: reduced, and of the mode of the finite elements that is the same; NaN where none is.
    similarity : ndarray, shape (n,)
        Modal assurance criterion, weighted by the mass, 0 to 1: the share of each reduced mode that is exact modes of
        the frequency that it is paired with.
    missing : ndarray
        Exact frequencies, Hz, that no mode of the reduction has, below its last that is paired.
    flexibility : dict of str to float
        Of each seat, the share of the flexibility of the free body there, under forces, that the reduction has lost.
    turning : dict of str to float
        The same under torques, of seats that turn: what a joint needs that holds the seat's direction.
    """

    frequencies: np.ndarray
    exact: np.ndarray
    similarity: np.ndarray
    missing: np.ndarray
    flexibility: dict[str, float]
    turning: dict[str, float]

    @property
    def errors(self) -> np.ndarray:
        """Relative errors of the frequencies, shape (n,); NaN where no exact mode is the same."""
        return self.frequencies / self.exact - 1.0

    def converged_up_to(self, tolerance: float = 0.01) -> float:
        """Return the frequency, Hz, up to which no mode is missing and errors stay below a tolerance."""
        good = np.abs(self.errors) <= tolerance
        first = int(np.argmin(good)) if not good.all() else good.size
        known = self.frequencies[:first]
        known = known[known < self.missing.min(initial=np.inf)]
        return float(known[-1]) if known.size else 0.0

    def __repr__(self) -> str:
        head = "mode    reduced, Hz      exact, Hz    error, %   MAC"
        rows = []
        for k, (reduced, exact, share) in enumerate(zip(self.frequencies, self.exact, self.similarity)):
            known = f"{exact:14.4f} {100 * (reduced / exact - 1):11.4f}" if exact > 0.0 else f"{'none':>14} {'':>11}"
            rows.append(f"{k + 1:4d} {reduced:14.4f} {known} {share:5.3f}")
        if self.missing.size:
            rows.append(f"not in the reduction, Hz: {', '.join(f'{f:.6g}' for f in self.missing)}")
        lost = []
        for key, share in self.flexibility.items():
            torques = f", {100 * self.turning[key]:.3g} % under torques" if key in self.turning else ""
            lost.append(f"seat {key}: {100 * share:.3g} % of its static flexibility is lost under forces{torques}")
        return "\n".join([head, *rows, *lost, f"errors below 1 % up to {self.converged_up_to():.6g} Hz"])


def check_reduction(
    model: FiniteElementModel, reduced: ModalModel, interfaces: Iterable[str | Interface] | None = None
) -> ReductionReport:
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
    exact, space, shares = _compared(model, parts, sp.csc_array(k), sp.csc_array(m), rigid, reduced)
    pairs = _paired(shares, space)
    found = pairs >= 0
    own = np.full(reduced.modes, np.nan)
    own[found] = exact[pairs[found]]
    lacking = np.delete(exact, pairs[found])
    return ReductionReport(
        reduced.frequencies,
        own,
        np.minimum(np.where(found, shares[np.arange(reduced.modes), space[pairs]], shares.max(axis=1)), 1.0),
        lacking[lacking < (1 - EQUAL) * own[found].max(initial=0.0)],
        *_lost(sp.csc_array(k), sp.csc_array(m), parts, rigid, reduced),
    )


def _compared(
    model: FiniteElementModel, parts: Resolved, k, m, rigid: np.ndarray, reduced: ModalModel
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return exact frequencies, Hz, the space of each, and the assurance of each reduced mode with each space."""
    squared, vectors = free_modes(k, m, rigid, reduced.modes + SPARE)
    exact = np.sqrt(squared) / (2 * np.pi)
    node, direction = model.dofs.T
    known = (node >= 0) & ((direction < 3) | (reduced.turned is not None))
    motion = reduced.moved if reduced.turned is None else np.concatenate([reduced.moved, reduced.turned], axis=2)
    a, b = motion[:, node[known], direction[known]].T, np.asarray(parts.expand @ vectors)[known]
    # without all degrees of freedom the shapes are compared by displacements alone
    metric = model.mass if known.all() else sp.eye_array(len(a))
    weighted = metric @ a
    size = np.einsum("dn,dn->n", a, weighted)
    space = np.cumsum(np.diff(exact, prepend=exact[:1]) > EQUAL * exact)
    shares = np.zeros((reduced.modes, int(space.max(initial=-1)) + 1))
    for k in range(shares.shape[1]):
        part = b[:, space == k]
        inside = part.T @ weighted
        shares[:, k] = np.einsum("sn,sn->n", inside, np.linalg.solve(part.T @ (metric @ part), inside)) / size
    return exact, space, shares


def _paired(shares: np.ndarray, space: np.ndarray) -> np.ndarray:
    """Return the exact mode of each reduced one, each once, -1 of none; in a common space in their order."""
    pairs = np.full(len(shares), -1)
    rows, columns = scipy.optimize.linear_sum_assignment(shares[:, space], maximize=True)
    alike = shares[rows, space[columns]] > ALIKE
    rows, columns = rows[alike], columns[alike]
    for common in np.unique(space[columns]):
        inside = space[columns] == common
        pairs[np.sort(rows[inside])] = np.sort(columns[inside])
    return pairs


def _lost(k, m, parts: Resolved, rigid: np.ndarray, reduced: ModalModel) -> tuple[dict[str, float], dict[str, float]]:
    """Return how much of the flexibility of the free body at each seat is lacking, under forces and under torques."""
    forces: dict[str, float] = {}
    torques: dict[str, float] = {}
    stiff = (2 * np.pi * reduced.frequencies) ** 2
    for key, exact in static_flexibility(HeldBody(k, parts.constraints), m, rigid, parts).items():
        seat, own = reduced.seats[key], np.diag(exact)
        for out, three, motion in ((forces, own[:3], seat.moved), (torques, own[3:], seat.turned)):
            there = np.isfinite(three)
            whole = three[there].sum()
            if whole > 0.0:
                out[key] = float(1.0 - (motion[:, there] ** 2 / stiff[:, None]).sum() / whole)
    return forces, torques
