"""A model with the configuration, states and time it starts from: what assembly, diagnosis and start are made from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_R
from gearmbs.dae.model.columns import Columns
from gearmbs.dae.model.evaluator import Assembler
from gearmbs.dae.model.model import Configuration, Model

STIFFENED = 1e4
"""Weight of modal coordinates over that of displacements."""
SHORTEST = 1e-3
"""Least length of a mechanism, m."""


class BaseSystem:
    """A model with the configuration, states and time that it starts from; `System` adds what is made of them.

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
    configuration : Configuration
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
        self.configuration = configuration
        self.state_start = np.array(states, dtype=float)
        self.t0 = t0
        self.mechanism = mechanism
        self.marker_index = marker_index or {}
        self.assembler = Assembler(model)
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
        return self.configuration.pose

    @property
    def length(self) -> float:
        """A typical length in m: the largest marker arm or distance between bodies, at least 1 mm."""
        if self.typical_length is not None:
            return self.typical_length
        spread = np.ptp(self.configuration.pose[:, POSE_R:POSE_A], axis=0).max(initial=0.0)
        return float(max(self.model.longest_arm, spread, SHORTEST))

    def coordinate_weights(self) -> np.ndarray:
        """Weights of the coordinates: 1 for metres, L^2 for radians, more for bending by the same way."""
        length = min(self.length, 1.0)
        one = np.concatenate([np.ones(3), np.full(3, length**2)])
        sizes = self.model.modal_sizes[:, 0]
        # assembly moves bodies rather than bending them
        return np.concatenate([np.tile(one, len(self.configuration.pose)), STIFFENED * (length / sizes) ** 2])

    def constraint_jacobian(self, configuration: Configuration | np.ndarray, t: float):
        """Return Phi_q in spatial displacements, Phi, and Phi_q v + Phi_t at a configuration."""
        return self.assembler.constraints(self._configuration(configuration), t, self.state_start)

    def constraint_jacobians(self, poses: np.ndarray, times: np.ndarray) -> list[Columns]:
        """Return Phi_q in spatial displacements at each of some poses, (times, bodies, 18), of rigid bodies."""
        places = [Configuration(pose) for pose in poses]
        return self.assembler.constraint_jacobians(places, times, self.state_start)

    def _configuration(self, configuration: Configuration | np.ndarray) -> Configuration:
        """Return a configuration; of a pose alone, with the modal coordinates of the start."""
        if isinstance(configuration, Configuration):
            return configuration
        return Configuration(
            np.asarray(configuration, dtype=float).reshape(-1, POSE_COLUMNS),
            self.configuration.q_f,
            self.configuration.v_f,
        )

    # --- redundant rows -----------------------------------------------------------------------------

    def keep_rows(self, kept: np.ndarray) -> None:
        """Go on with a model of the constraint rows ``kept`` alone."""
        if kept.size == len(self.model.rows):
            return
        self._dropped = np.setdiff1d(np.arange(len(self.model.rows)), kept)
        self.has_dropped_rows = True
        self.model = self.model.with_rows(kept)
        self.assembler = Assembler(self.model)

    def dropped_rates(self, configuration: Configuration, t: float) -> tuple[Columns, np.ndarray, list[str]]:
        """Return Phi_q, Phi_q v + Phi_t and the names of the rows dropped as redundant, at a configuration."""
        phi_q, _, rate = self._of_whole.constraints(configuration, t, self.state_start)
        return (
            phi_q.chosen(self._dropped),
            rate[self._dropped],
            [self.whole.names.rows[i] for i in self._dropped],
        )
