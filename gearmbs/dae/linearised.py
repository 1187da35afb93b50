"""The DAE at one instant: its residual, its exact Jacobians and the motions its constraints leave free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import null_space
from scipy.sparse import csc_array

from gearmbs.dae import index1
from gearmbs.dae import tables as T
from gearmbs.dae.errors import ModelError, SingularModelError
from gearmbs.dae.rotation import KIN_AXES

if TYPE_CHECKING:
    from gearmbs.dae.system import System

SETTLE_PASSES = 50
NULL_TOLERANCE = 1e-10
SLOWEST = 1e-6
"""Angular frequency, rad/s, below which a motion counts as free of stiffness."""


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
        self.at = system.builder.layout(int(self.idata[T.H_FORMULATION]))
        self.y = self.problem.y0.copy()
        kinds = np.array([kind for kind, _ in system.builder.states], dtype=np.int64)
        self.differential = kinds == T.STATE_DIFFERENTIAL

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
        out = np.zeros(18 * len(self.system.body_names))
        index1.pose_record(self.y, self.idata, self.rdata, self.work, out)
        return out.reshape(-1, 18)

    def axes(self) -> np.ndarray:
        """Return the axes of the Euler angles, shape (bodies, 3, 3): row k turns with angle k."""
        self.pose()
        kin = T.unpack(self.idata, self.rdata, self.work).kin
        return kin[1:, KIN_AXES : KIN_AXES + 9].reshape(-1, 3, 3).copy()

    def spatial(self, coordinates: np.ndarray) -> np.ndarray:
        """Turn changes of (R, theta), shape (6 bodies, k), into displacements and rotations, (k, bodies, 6)."""
        bodies = len(self.system.body_names)
        moved = coordinates[: 3 * bodies].reshape(bodies, 3, -1)
        angles = coordinates[3 * bodies :].reshape(bodies, 3, -1)
        turned = np.einsum("bmc,bmk->bck", self.axes(), angles)
        return np.moveaxis(np.concatenate([moved, turned], axis=1), 2, 0)

    def mass_matrix(self, matrix: csc_array) -> csc_array:
        """Return the mass matrix of (R, theta) from the Jacobian of G."""
        from scipy.sparse import block_diag, diags_array

        masses = np.repeat([row[0] for row in self.system.builder.bodies[1:]], 3)
        eps = self.block("eps", "R")
        return csc_array(block_diag([diags_array(masses), -matrix[eps][:, eps]], format="csc"))


@dataclass
class Reduced:
    """M x'' + C x' + K x + H z = 0 and z' = P x + Q x' + S z in the motions the constraints allow.

    ``basis`` has a column of changes of (R, theta) for each entry of x; ``stiffness_size`` is the largest entry of the
    stiffness before the projection.
    """

    basis: np.ndarray
    stiffness_size: float
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
    at = instant.at
    q, v = instant.block("R", "lambda"), np.concatenate([instant.block("u", "p"), instant.block("eps", "R")])
    force = instant.block("u", "eps")
    half = force.size // 2
    rows, eps = instant.block("lambda", "F"), instant.block("eps", "R")
    inner = instant.block("F", "mu")
    kept = np.zeros(inner.size, dtype=bool)
    kept[inner.size - instant.differential.size :] = instant.differential
    loads, z = inner[~kept], inner[kept]

    def eliminate(target: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Derivative of the target rows with the loads following their definitions."""
        direct = full[np.ix_(target, columns)]
        if not loads.size:
            return direct
        return direct - full[np.ix_(target, loads)] @ np.linalg.solve(
            full[np.ix_(loads, loads)], full[np.ix_(loads, columns)]
        )

    try:
        stiffness, damping = eliminate(force, q), eliminate(force, v)
        state_force = eliminate(force, z)
        state_q, state_v, state_z = -eliminate(z, q), -eliminate(z, v), -eliminate(z, z)
    except np.linalg.LinAlgError as error:
        raise ModelError("the applied loads and variables depend on each other in a singular way") from error
    # delta p' = d/dt of -(dG_eps/d theta) delta theta - ...: its velocity part is a damping
    damping[half:, half:] -= full[np.ix_(eps, instant.block("theta", "lambda"))]
    constraint = full[np.ix_(rows, q)]
    weight = np.concatenate([np.ones(half), np.full(half, max(min(instant.system.length, 1.0), 1e-3))])
    basis = null_space(constraint / weight) if at["F"] > at["lambda"] else np.eye(q.size)
    basis = basis / weight[:, None]
    return Reduced(
        basis,
        float(np.abs(stiffness).max(initial=0.0)),
        basis.T @ mass @ basis,
        basis.T @ damping @ basis,
        basis.T @ stiffness @ basis,
        basis.T @ state_force,
        state_q @ basis,
        state_v @ basis,
        state_z,
    )


def normalised(reduced: Reduced) -> tuple[np.ndarray, np.ndarray]:
    """Return (L, K') with K' = L^T K L the stiffness in coordinates of unit mass.

    Raises
    ------
    SingularModelError
        If a free motion has no inertia.
    """
    values, vectors = np.linalg.eigh(0.5 * (reduced.mass + reduced.mass.T))
    if values.size and values[0] <= 1e-14 * max(values[-1], 1e-300):
        raise SingularModelError("a motion left free by the constraints has no inertia")
    scale = vectors / np.sqrt(values)
    return scale, scale.T @ reduced.stiffness @ scale


def noise(reduced: Reduced, scale: np.ndarray) -> float:
    """Return the rounding error of a normalised stiffness, 1/s^2."""
    return 1e-14 * reduced.stiffness_size * float(np.abs(scale).max(initial=0.0)) ** 2


def free_directions(stiffness: np.ndarray, rounding: float = 0.0) -> np.ndarray:
    """Return an orthonormal basis of the directions a normalised stiffness matrix does not resist."""
    if not stiffness.size:
        return np.zeros((0, 0))
    _, values, right = np.linalg.svd(stiffness)
    return right[values <= max(NULL_TOLERANCE * values[0], rounding, SLOWEST**2)].T
