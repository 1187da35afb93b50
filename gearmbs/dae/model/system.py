"""A mechanism as a DAE: its model, names, a start that is made consistent, and the problem an integrator solves."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.unknowns import FORMULATIONS, Unknown
from gearmbs.dae.model import diagnosis, initial, start
from gearmbs.dae.model.base_system import BaseSystem
from gearmbs.dae.model.configuration import Configuration
from gearmbs.dae.model.diagnosis import conflict
from gearmbs.dae.problem import AssemblyError, DAEProblem, ModelError


class System(BaseSystem):
    """A mechanism as a DAE.

    Built by :meth:`gearmbs.mechanism.Mechanism.compile`; users rarely make one themselves. For its parameters see
    `gearmbs.dae.model.base_system.BaseSystem`; the configuration is a guess that :meth:`initialise` makes consistent.

    Attributes
    ----------
    report : InitialReport or None
        What :meth:`initialise` found; None before.
    """

    report: initial.InitialReport | None = None

    # --- names --------------------------------------------------------------------------------------

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

    def accelerations(self, configuration: Configuration | np.ndarray, t: float):
        """Return (a, alpha) a row per body, lambda, and the load records at a configuration; see `model.start`."""
        configuration = self._configuration(configuration)
        acc, multipliers, found = start.accelerations(self, configuration, t)
        return configuration.parts(acc)[0], multipliers, found.loads

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
        configuration, kept, self.report = initial.assemble_position(self, self.configuration, self.t0)
        self.keep_rows(kept)
        self.configuration = initial.consistent_velocity(self, configuration, self.t0)
        found = self.conflict(self.configuration, self.t0)
        if found is not None:
            raise AssemblyError(found)
        return self.report

    # --- redundant rows, locking --------------------------------------------------------------------

    def conflict(self, configuration: Configuration | np.ndarray, t: float) -> str | None:
        """Return which row dropped as redundant contradicts the motion at a configuration, or None."""
        return conflict(self, self._configuration(configuration), t) if self.has_dropped_rows else None

    def locking(self, configuration: Configuration | np.ndarray, t: float) -> str | None:
        """Return which constraint rows are about to depend on each other, None when they are not."""
        return diagnosis.locking(self, self._configuration(configuration), t)

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
