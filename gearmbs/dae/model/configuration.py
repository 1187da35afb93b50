"""Positions and velocities of all bodies at one instant, free of the singularities of angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import scipy

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import body_from_pose
from gearmbs.dae.equations.kinematics.rotation import (
    POSE_A,
    POSE_COLUMNS,
    POSE_R,
    POSE_V,
    best_reference,
)
from gearmbs.dae.equations.unknowns import I3
from gearmbs.dae.model import evaluator
from gearmbs.dae.model.model import Model
from gearmbs.kernels.jit import njit


@dataclass(frozen=True, eq=False)
class Configuration:
    """Where the bodies are and how they move.

    Attributes
    ----------
    pose : ndarray, shape (bodies, 18)
        Position R and orientation A (row-major) of the centre of mass, velocity v and angular velocity omega of each
        moving body, global components.
    q_f, v_f : ndarray, shape (modal coordinates,)
        Modal coordinates of all bodies and their velocities.
    """

    pose: np.ndarray
    q_f: np.ndarray = field(default_factory=lambda: np.zeros(0))
    v_f: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, record: np.ndarray, bodies: int) -> Configuration:
        """Return the configuration of a record: the bodies' poses one after the other, then q_f and v_f."""
        end = POSE_COLUMNS * bodies
        half = (record.size - end) // 2
        return cls(record[:end].reshape(-1, POSE_COLUMNS), record[end : end + half], record[end + half :])

    @property
    def bodies(self) -> int:
        """Number of moving bodies."""
        return self.pose.shape[0]

    @property
    def coordinates(self) -> int:
        """Number of coordinates: six displacements of each body, then the modal coordinates."""
        return 6 * self.bodies + self.q_f.size

    def parts(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a vector over the coordinates as (bodies, 6) and what it has for the modal coordinates."""
        return change[: 6 * self.bodies].reshape(-1, 6), change[6 * self.bodies :]

    def displaced(self, step: np.ndarray) -> Configuration:
        """Return the configuration after displacements dR, rotations dpi (exponential map) and changes of q_f."""
        from scipy.spatial.transform import Rotation

        moved, bent = self.parts(step)
        pose = self.pose.copy()
        pose[:, POSE_R : POSE_R + 3] += moved[:, 0:3]
        axes = pose[:, POSE_A:POSE_V]
        turned = Rotation.from_rotvec(moved[:, 3:6]).as_matrix() @ axes.reshape(-1, 3, 3)
        axes[:] = turned.reshape(-1, 9)
        return Configuration(pose, self.q_f + bent, self.v_f)

    def pushed(self, change: np.ndarray) -> Configuration:
        """Return the configuration with changed velocities v, omega and v_f."""
        moved, bent = self.parts(change)
        pose = self.pose.copy()
        pose[:, POSE_V:POSE_COLUMNS] += moved
        return Configuration(pose, self.q_f, self.v_f + bent)

    def at_rest(self) -> Configuration:
        """Return the configuration with all velocities zero."""
        pose = self.pose.copy()
        pose[:, POSE_V:POSE_COLUMNS] = 0.0
        return Configuration(pose, self.q_f, np.zeros_like(self.v_f))

    @property
    def velocities(self) -> np.ndarray:
        """v and omega of each body, then v_f, shape (coordinates,)."""
        return np.concatenate([self.pose[:, POSE_V:POSE_COLUMNS].ravel(), self.v_f])


# The acceleration system of a model at a configuration: masses, constraints, loads, and the unknowns y behind them.


POSE_PLACES = 6
"""Spatial displacements of a body, after which the modal coordinates come."""


class Assembled(NamedTuple):
    """The acceleration system of a model at a configuration, with the unknowns and tables it was made from."""

    matrix: scipy.sparse.csc_array
    rhs: np.ndarray
    phi: np.ndarray
    loads: np.ndarray
    y: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray
    work: np.ndarray


@njit(
    "void(float64[:, ::1], float64[::1], float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])",
    cache=True,
    error_model="numpy",
)
def unknowns_from_pose(pose, q_f, v_f, idata, rdata, work, y):
    """Fill positions, velocities and momenta of y from a configuration."""
    tab = T.unpack(idata, rdata, work)
    for b in range(1, idata[T.H_BODIES]):
        row, at = pose[b - 1], tab.at[b]
        first = at[T.AT_V_MODES] - POSE_PLACES * pose.shape[0]
        for m in range(at[T.AT_MODES]):
            y[at[T.AT_QF] + m] = q_f[first + m]
            y[at[T.AT_VF] + m] = v_f[first + m]
        body_from_pose(b, row, y, at, tab.code[b], tab.body[b], tab.modal, tab.partial, tab.kin, tab.scratch)


def euler_references(pose: np.ndarray) -> np.ndarray:
    """Return, for the ground and each body, the Euler reference that is farther from its singularity."""
    chosen = [best_reference(np.ascontiguousarray(row[POSE_A:POSE_V]), 0) for row in pose]
    return np.array([0, *chosen], dtype=np.int64)


class AccelerationSystem:
    """Assembles the acceleration system of one model; its pattern is found once."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._pattern: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def at(self, place: Configuration, t: float, inner: np.ndarray | None, states: np.ndarray) -> Assembled:
        """Assemble at a configuration; ``inner`` holds loads and states, F to z of y; default: no loads, ``states``."""
        idata, rdata, size = self.model.pack(I3, codes=euler_references(place.pose))
        work = np.zeros(size)
        y = np.zeros(int(idata[T.H_UNKNOWNS]))
        y[int(idata[T.H_Z]) : int(idata[T.H_Z]) + states.size] = states
        if inner is not None:
            y[int(idata[T.H_F]) :] = inner
        unknowns_from_pose(np.ascontiguousarray(place.pose), place.q_f, place.v_f, idata, rdata, work, y)
        if self._pattern is None:
            self._pattern = evaluator.pattern(idata, rdata, size, t, y)
        indptr, indices, slots = self._pattern
        n = indptr.size - 1
        vals = np.zeros(indices.size)
        records = evaluator.assemble(np.array([t]), y[None, :], slots, idata, rdata, size, vals)
        matrix = scipy.sparse.csc_array((vals, indices, indptr), shape=(n, n))
        return Assembled(matrix, records.solution[0], records.phi[0], records.loads[0], y, idata, rdata, work)

    def constraints(
        self, place: Configuration, t: float, states: np.ndarray
    ) -> tuple[scipy.sparse.csc_array, np.ndarray, np.ndarray]:
        """Return Phi_q in spatial displacements and modal coordinates, Phi, and Phi_q v + Phi_t."""
        found = self.at(place, t, None, states)
        base = place.coordinates
        return scipy.sparse.csc_array(found.matrix[base:, :base]), found.phi[0::3].copy(), found.phi[1::3].copy()


# A model in a configuration at a time: what its assembly, its diagnosis and its start are computed from.


STIFFENED = 1e4
"""Weight of modal coordinates over that of displacements."""
SHORTEST = 1e-3
"""Least length of a mechanism, m."""


class PosedModel:
    """A model with the configuration, states and time that it starts from.

    Parameters
    ----------
    model : Model
        Tables and names.
    configuration : Configuration
        Positions and velocities.
    states : array_like
        Start of the user-defined states.
    t0 : float
        s.
    mechanism : Mechanism, optional
        What the model was made from, for names in messages and measurements.
    marker_index : dict, optional
        Row of the marker table by ``id`` of a marker.

    Attributes
    ----------
    start : Configuration
    state_start : ndarray
    whole : Model
        The model with the rows that have been dropped as redundant.
    """

    def __init__(
        self,
        model: Model,
        configuration: Configuration,
        states: Sequence[float] = (),
        t0: float = 0.0,
        mechanism: Any = None,
        marker_index: dict[int, int] | None = None,
    ) -> None:
        self.model = model
        self.whole = model
        self.start = configuration
        self.state_start = np.array(states, dtype=float)
        self.t0 = t0
        self.mechanism = mechanism
        self.marker_index = marker_index or {}
        self.assembler = AccelerationSystem(model)
        self._of_whole = self.assembler
        self._dropped = np.zeros(0, dtype=np.int64)
        self.has_dropped_rows = False
        """Whether constraint rows were dropped as redundant."""
        self.row_order: np.ndarray | None = None
        """All rows from the one that is to be kept first to the one to be dropped first, if not as they stand."""
        self.typical_length: float | None = None
        """A length that replaces the one found, for tolerances of another model of the same mechanism."""

    # --- names --------------------------------------------------------------------------------------

    @property
    def body_names(self) -> list[str]:
        """Names of the moving bodies."""
        return list(self.model.names.bodies)

    @property
    def row_names(self) -> list[str]:
        """Names of the constraint rows, ``joint: what it enforces``."""
        return list(self.model.names.rows)

    @property
    def force_names(self) -> list[str]:
        """Names of the force elements."""
        return list(self.model.names.forces)

    @property
    def state_names(self) -> list[str]:
        """Names of the user-defined states."""
        return list(self.model.names.states)

    # --- positions and constraints ------------------------------------------------------------------

    @property
    def pose(self) -> np.ndarray:
        """R, A (row-major), v and omega of each moving body at the start, shape (bodies, 18)."""
        return self.start.pose

    @property
    def length(self) -> float:
        """A typical length in m: the largest marker arm or distance between bodies, at least 1 mm."""
        if self.typical_length is not None:
            return self.typical_length
        spread = np.ptp(self.start.pose[:, POSE_R:POSE_A], axis=0).max(initial=0.0)
        return float(max(self.model.longest_arm, spread, SHORTEST))

    def coordinate_weights(self) -> np.ndarray:
        """Weights of the coordinates: 1 for metres, L^2 for radians, more for bending by the same way."""
        length = min(self.length, 1.0)
        one = np.concatenate([np.ones(3), np.full(3, length**2)])
        sizes = self.model.modal_sizes[:, 0]
        # assembly moves bodies rather than bending them
        return np.concatenate([np.tile(one, len(self.start.pose)), STIFFENED * (length / sizes) ** 2])

    def constraint_jacobian(self, place: Configuration | np.ndarray, t: float):
        """Return Phi_q in spatial displacements, Phi, and Phi_q v + Phi_t at a configuration."""
        return self.assembler.constraints(self._configuration(place), t, self.state_start)

    def _configuration(self, place: Configuration | np.ndarray) -> Configuration:
        """Return a configuration; of a pose alone, with the modal coordinates of the start."""
        if isinstance(place, Configuration):
            return place
        return Configuration(np.asarray(place, dtype=float).reshape(-1, POSE_COLUMNS), self.start.q_f, self.start.v_f)

    # --- redundant rows -----------------------------------------------------------------------------

    def keep_rows(self, kept: np.ndarray) -> None:
        """Go on with a model of the constraint rows ``kept`` alone."""
        if kept.size == len(self.model.rows):
            return
        self._dropped = np.setdiff1d(np.arange(len(self.model.rows)), kept)
        self.has_dropped_rows = True
        self.model = self.model.with_rows(kept)
        self.assembler = AccelerationSystem(self.model)

    def dropped_rates(self, place: Configuration, t: float) -> tuple[scipy.sparse.csc_array, np.ndarray, list[str]]:
        """Return Phi_q, Phi_q v + Phi_t and the names of the rows dropped as redundant, at a configuration."""
        phi_q, _, rate = self._of_whole.constraints(place, t, self.state_start)
        return (
            scipy.sparse.csc_array(phi_q[self._dropped]),
            rate[self._dropped],
            [self.whole.names.rows[i] for i in self._dropped],
        )
