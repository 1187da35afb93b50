"""A mechanism as a DAE: its model, names, a start that is made consistent, and the problem an integrator solves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from gearmbs.dae.equations.rotation import POSE_COLUMNS
from gearmbs.dae.equations.unknowns import FORMULATIONS, Unknown
from gearmbs.dae.errors import AssemblyError, ModelError
from gearmbs.dae.model import diagnosis, initial, start
from gearmbs.dae.model.configuration import Configuration
from gearmbs.dae.model.conflicts import conflict
from gearmbs.dae.model.model import Model
from gearmbs.dae.problem import DAEProblem

STIFFENED = 1e4
"""Weight of modal coordinates over that of displacements."""
SHORTEST = 1e-3
"""Least length of a mechanism, m."""


class System:
    """A model with a start, and what is computed from them before an integration.

    Built by :meth:`gearmbs.mechanism.Mechanism.compile`; users rarely make one themselves.

    Parameters
    ----------
    model : Model
        Tables and names.
    configuration : Configuration
        Positions and velocities; a guess that :meth:`initialise` makes consistent.
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
    report : InitialReport or None
        What :meth:`initialise` found; None before.
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
        self.report: initial.InitialReport | None = None
        self.assembler = start.StartingSystem(model)
        self._of_whole = self.assembler
        self._dropped = np.zeros(0, dtype=np.int64)
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

    def unknowns(self, formulation: str = "SI2") -> list[Unknown]:
        """Return the table of the unknowns of eq. (9) in their order."""
        return self.model.unknowns(formulation)

    def unknowns_table(self, formulation: str = "SI2") -> str:
        """Return the table of the unknowns as text: index, name, meaning, equation, unit."""
        lines = [f"{'#':>4}  {'unknown':<48} {'eq.':<16} {'unit':<10} meaning"]
        for u in self.unknowns(formulation):
            lines.append(f"{u.index:>4}  {u.name:<48} {u.equation:<16} {u.unit:<10} {u.meaning}")
        return "\n".join(lines)

    # --- the start ----------------------------------------------------------------------------------

    @property
    def pose(self) -> np.ndarray:
        """R, A (row-major), v and omega of each moving body at the start, shape (bodies, 18)."""
        return self.start.pose

    @property
    def length(self) -> float:
        """A typical length in m: the largest marker arm or distance between bodies, at least 1 mm."""
        if self.typical_length is not None:
            return self.typical_length
        arms = np.abs(self.model.marker_frame[:, :3])
        spread = np.ptp(self.pose[:, :3], axis=0).max(initial=0.0)
        return float(max(arms.max(initial=0.0), spread, SHORTEST))

    def coordinate_weights(self) -> np.ndarray:
        """Weights of the coordinates: 1 for metres, L^2 for radians, more for bending by the same way."""
        length = min(self.length, 1.0)
        one = np.concatenate([np.ones(3), np.full(3, length**2)])
        sizes = self.model.modal_sizes()[:, 0]
        # assembly moves bodies rather than bending them
        return np.concatenate([np.tile(one, self.pose.shape[0]), STIFFENED * (length / sizes) ** 2])

    def constraint_jacobian(self, place: Configuration | np.ndarray, t: float):
        """Return Phi_q in spatial displacements, Phi, and Phi_q v + Phi_t at a configuration."""
        return self.assembler.constraints(self._configuration(place), t, self.state_start)

    def accelerations(self, place: Configuration | np.ndarray, t: float):
        """Return (a, alpha) a row per body, lambda, and the load records at a configuration; see `model.start`."""
        place = self._configuration(place)
        acc, multipliers, found = start.accelerations(self, place, t)
        return place.parts(acc)[0], multipliers, found.loads

    def initialise(self) -> initial.InitialReport:
        """Make positions and velocities consistent; drop redundant constraint rows.

        Raises
        ------
        AssemblyError
            If the joints contradict each other or cannot be satisfied.
        SingularModelError
            If a body can move without inertia.
        """
        if not np.all(np.isfinite(self.pose)):
            bad = self.body_names[int(np.argwhere(~np.isfinite(self.pose))[0, 0])]
            raise ModelError(f"body '{bad}': initial position, orientation or velocity is not finite")
        initial.check_inertia(self)
        place, kept, self.report = initial.assemble_position(self, self.start, self.t0)
        self._keep_rows(kept)
        self.start = initial.consistent_velocity(self, place, self.t0)
        found = self.conflict(self.start, self.t0)
        if found is not None:
            raise AssemblyError(found)
        return self.report

    def _keep_rows(self, kept: np.ndarray) -> None:
        """Go on with a model of the constraint rows ``kept`` alone."""
        if kept.size == len(self.model.rows):
            return
        self._dropped = np.setdiff1d(np.arange(len(self.model.rows)), kept)
        self.model = self.model.with_rows(kept)
        self.assembler = start.StartingSystem(self.model)

    # --- redundant rows, locking --------------------------------------------------------------------

    @property
    def has_dropped_rows(self) -> bool:
        """Whether constraint rows were dropped as redundant."""
        return self._dropped.size > 0

    def dropped_rates(self, place: Configuration, t: float) -> tuple[csc_array, np.ndarray, list[str]]:
        """Return Phi_q, Phi_q v + Phi_t and the names of the rows dropped as redundant, at a configuration."""
        phi_q, _, rate = self._of_whole.constraints(place, t, self.state_start)
        return csc_array(phi_q[self._dropped]), rate[self._dropped], [self.whole.names.rows[i] for i in self._dropped]

    def conflict(self, place: Configuration | np.ndarray, t: float) -> str | None:
        """Return which row dropped as redundant contradicts the motion at a configuration, or None."""
        return conflict(self, self._configuration(place), t) if self.has_dropped_rows else None

    def locking(self, place: Configuration | np.ndarray, t: float) -> str | None:
        """Return which constraint rows are about to depend on each other, None when they are not."""
        return diagnosis.locking(self, self._configuration(place), t)

    def _configuration(self, place: Configuration | np.ndarray) -> Configuration:
        """Return a configuration; of a pose alone, with the modal coordinates of the start."""
        if isinstance(place, Configuration):
            return place
        return Configuration(np.asarray(place, dtype=float).reshape(-1, POSE_COLUMNS), self.start.q_f, self.start.v_f)

    # --- the problem --------------------------------------------------------------------------------

    def problem(self, formulation: str = "SI2", rate_scale: float = 1.0) -> DAEProblem:
        """Return the DAE in one of the formulations ``I3``, ``SI2``, ``SI1`` with consistent initial values.

        ``rate_scale`` (1/s) is the ratio of the error allowed in velocities to that in positions.
        """
        if formulation not in FORMULATIONS:
            raise ModelError(f"formulation: {formulation!r} is unknown; choose one of {', '.join(FORMULATIONS)}")
        if self.report is None:
            self.initialise()
        return start.make_problem(self, formulation, rate_scale)
