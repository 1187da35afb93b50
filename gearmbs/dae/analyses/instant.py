"""The unknowns of a system at one instant, with its residual and exact Jacobians there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations import output_records
from gearmbs.dae.equations.rotation import KIN_AXES, POSE_COLUMNS
from gearmbs.dae.model.configuration import Configuration

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

SETTLE_PASSES = 50

ROUNDING = 2e-13
"""Rounding errors of coefficients, of the sum of the terms they are made of; times the root of their number."""


class Instant:
    """Unknowns y of a system at a fixed time, with the tables they belong to.

    Parameters
    ----------
    system : System
        Made consistent if it is not yet.
    formulation : {"I3", "SI2"}
    """

    def __init__(self, system: System, formulation: str = "I3") -> None:
        self.system = system
        self.problem = system.problem(formulation)
        self.t = system.t0
        self.idata = self.problem.idata.copy()
        self.rdata = self.problem.rdata.copy()
        self.work = np.zeros(self.problem.work_size)
        self.at = system.model.layout(int(self.idata[T.H_FORMULATION]))
        self.y = self.problem.y0.copy()
        self.differential = system.model.differential_states

    def block(self, first: str, end: str) -> np.ndarray:
        """Return the indices from the start of one block of y to the start of another."""
        return np.arange(self.at[first], self.at[end])

    def residual(self, y: np.ndarray) -> np.ndarray:
        """Return G(t, y, 0)."""
        out = np.zeros(y.size)
        self.problem.residual(self.t, y, np.zeros(y.size), out, self.idata, self.rdata, self.work)
        return out

    def matrix(self, y: np.ndarray, cj: float = 0.0) -> csc_array:
        """Return dG/dy + cj dG/dy' at y' = 0."""
        vals = np.zeros(self.problem.indices.size)
        self.problem.jacobian(self.t, y, np.zeros(y.size), cj, vals, self.idata, self.rdata, self.work)
        return csc_array((vals, self.problem.indices, self.problem.indptr), shape=(y.size, y.size))

    def settle(self, y: np.ndarray) -> np.ndarray:
        """Put applied loads and algebraic states at the values their definitions give; return y.

        Implicit states, which stand in their own definitions, keep the values that Newton's method gave them.
        """
        places = self.block("F", "mu")
        explicit = np.ones(places.size, dtype=bool)
        explicit[places.size - self.differential.size :] = ~self.system.model.controlled_states
        places = places[explicit]
        for _ in range(SETTLE_PASSES if places.size else 0):
            correction = self.residual(y)[places]
            y[places] -= correction
            if not np.abs(correction).max() > 1e-14 * (1.0 + np.abs(y[places]).max()):
                break
        return y

    def stop(self, y: np.ndarray) -> np.ndarray:
        """Set all velocities and momenta to zero; return y."""
        y[: self.at["R"]] = 0.0
        return y

    def hook(self) -> None:
        """Move to the other Euler reference where due and count full turns, at the present y."""
        history = self.y[None, :].copy()
        if self.problem.hook is None:
            return
        self.problem.hook(self.t, history, 1, self.idata, self.rdata, self.work)
        self.y = history[0]

    def pose(self) -> np.ndarray:
        """Return R, A (row-major), v, omega of each moving body, shape (bodies, 18)."""
        return self.configuration().pose

    def configuration(self) -> Configuration:
        """Return the positions and velocities of y."""
        counts = self.system.model.counts
        out = np.zeros(POSE_COLUMNS * counts.bodies + 2 * sum(counts.modes))
        output_records.pose_record(self.y, self.idata, self.rdata, self.work, out)
        return Configuration.of(out, counts.bodies)

    def axes(self) -> np.ndarray:
        """Return the axes of the Euler angles, shape (bodies, 3, 3): row k turns with angle k."""
        self.pose()
        kin = T.kinematics_in(self.idata, self.work)
        return kin[1 : len(self.system.model.bodies), KIN_AXES : KIN_AXES + 9].reshape(-1, 3, 3).copy()

    def spatial(self, coordinates: np.ndarray) -> np.ndarray:
        """Turn changes of (R, theta, q_f), a column each, into displacements and rotations, shape (k, bodies, 6)."""
        bodies, first = len(self.system.body_names), self.at["R"]
        angle, mode = self.at["theta"] - first, self.at["q_f"] - first
        moved = coordinates[:angle].reshape(bodies, 3, coordinates.shape[1])
        angles = coordinates[angle:mode].reshape(bodies, 3, coordinates.shape[1])
        turned = np.einsum("bmc,bmk->bck", self.axes(), angles)
        return np.moveaxis(np.concatenate([moved, turned], axis=1), 2, 0)

    def mass_matrix(self, matrix: csc_array) -> csc_array:
        """Return the mass matrix of (R, theta, q_f) from the Jacobian of G."""
        from scipy.sparse import block_diag, diags_array

        masses = np.repeat(self.system.model.bodies[1:, T.BODY_MASS], 3)
        eps = self.block("eps", "R")
        return csc_array(block_diag([diags_array(masses), -matrix[eps][:, eps]], format="csc"))
