"""The DAE at one instant: its residual, its exact Jacobians and the motions its constraints leave free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.sparse import csc_array

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations import output_records
from gearmbs.dae.equations.rotation import KIN_AXES, POSE_COLUMNS
from gearmbs.dae.errors import ModelError
from gearmbs.dae.model.configuration import Configuration

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

SETTLE_PASSES = 50
DEPENDENT = 1e-10
"""Pivot, of the largest, below which constraints count as dependent."""


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
        """Put applied loads and algebraic states at the values their definitions give; return y."""
        places = self.block("F", "mu")
        explicit = np.ones(places.size, dtype=bool)
        explicit[places.size - self.differential.size :] = ~self.differential
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
        kin = T.unpack(self.idata, self.rdata, self.work).kin
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


def allowed_motions(constraint: np.ndarray) -> np.ndarray:
    """Return a basis of the null space of the constraints: some coordinates move by one each, the others follow.

    Unlike an orthonormal one it keeps parts that have nothing to do with each other apart, exactly.
    """
    rows, n = constraint.shape
    if rows == 0:
        return np.eye(n)
    upper, order = qr(constraint, mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.sum(pivots > DEPENDENT * pivots[0]))
    basis = np.zeros((n, n - rank))
    basis[order[rank:]] = np.eye(n - rank)
    basis[order[:rank]] = -solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    return basis


@dataclass
class Reduced:
    """M x'' + C x' + K x + H z = 0 and z' = P x + Q x' + S z in the motions the constraints allow.

    ``basis`` has a column of changes of (R, theta, q_f) for each entry of x; ``stiffness_terms`` and ``damping_terms``
    are the sums of the absolute values of the terms each coefficient is made of, against which rounding is to be held.
    """

    basis: np.ndarray
    stiffness_terms: np.ndarray
    damping_terms: np.ndarray
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    state_force: np.ndarray
    state_position: np.ndarray
    state_velocity: np.ndarray
    state_state: np.ndarray


def reduce(instant: Instant) -> Reduced:
    """Linearise an I3 problem about an instant and project it on the motions allowed by its constraints.

    Raises
    ------
    ModelError
        If the applied loads depend on each other in a singular way.
    """
    y = instant.y
    matrix = instant.matrix(y)
    mass = instant.mass_matrix(matrix).toarray()
    full = matrix.toarray()
    q, v = instant.block("R", "lambda"), np.concatenate([instant.block("u", "p"), instant.block("eps", "R")])
    force = instant.block("u", "eps")
    half = instant.at["p"] - instant.at["u"]
    rows, eps = instant.block("lambda", "F"), instant.block("eps", "R")
    inner = instant.block("F", "mu")
    kept = np.zeros(inner.size, dtype=bool)
    kept[inner.size - instant.differential.size :] = instant.differential
    loads, z = inner[~kept], inner[kept]

    def eliminate(target: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of the target rows with the loads following their definitions, and the size of its terms."""
        direct = full[np.ix_(target, columns)]
        if not loads.size:
            return direct, np.abs(direct)
        on = full[np.ix_(target, loads)]
        followed = np.linalg.solve(full[np.ix_(loads, loads)], full[np.ix_(loads, columns)])
        return direct - on @ followed, np.abs(direct) + np.abs(on) @ np.abs(followed)

    try:
        (stiffness, stiffness_terms), (damping, damping_terms) = eliminate(force, q), eliminate(force, v)
        state_force = eliminate(force, z)[0]
        state_q, state_v, state_z = (-eliminate(z, columns)[0] for columns in (q, v, z))
    except np.linalg.LinAlgError as error:
        raise ModelError("the applied loads and variables depend on each other in a singular way") from error
    # delta p' = d/dt of -(dG_eps/d theta) delta theta - ...: its velocity part is a damping
    moved = full[np.ix_(eps, instant.block("theta", "lambda"))]
    damping[half:, half:] -= moved
    damping_terms[half:, half:] += np.abs(moved)
    constraint = full[np.ix_(rows, q)]
    arm = max(min(instant.system.length, 1.0), 1e-3)
    sizes = instant.system.model.modal_sizes()[:, 0]
    weight = np.concatenate([np.ones(half), np.full(half, arm), arm / sizes])
    basis = allowed_motions(constraint / weight) / weight[:, None]
    absolute = np.abs(basis)
    return Reduced(
        basis,
        absolute.T @ stiffness_terms @ absolute,
        absolute.T @ damping_terms @ absolute,
        basis.T @ mass @ basis,
        basis.T @ damping @ basis,
        basis.T @ stiffness @ basis,
        basis.T @ state_force,
        state_q @ basis,
        state_v @ basis,
        state_z,
    )
