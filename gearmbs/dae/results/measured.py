"""What a solution tells of joints, markers, states and expressions of the mechanism that it is of, by their names."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.dae.model.system import System
from gearmbs.dae.problem import DAEProblem
from gearmbs.dae.result import DAEResult


class Measured:
    """The part of a `gearmbs.dae.results.solution.Solution` that asks the mechanism what its names stand for."""

    system: System
    problem: DAEProblem
    result: DAEResult

    def _measures(self):
        mechanism = self.system.mechanism
        if mechanism is None:
            raise ValueError("the solution does not know its mechanism, so nothing can be asked of it by name")
        return mechanism.measures(self)

    def unknown(self, name: str) -> np.ndarray:
        """Return an unknown of the equations by its name, as ``eps_psi(rod)`` or ``lambda(pin: coincident x)``, (m,).

        Raises
        ------
        KeyError
            For a name that is not there.
        """
        names = self.problem.names
        if name not in names:
            raise KeyError(f"unknown {name!r}; there are {', '.join(names)}")
        return self.result.y[:, names.index(name)].copy()

    def joint_angle(self, joint: object) -> np.ndarray:
        """Return the rotation of a joint's I about z_J with full turns counted, shape (m,), rad; by joint or name."""
        return self._measures().angle(joint)

    def joint_displacement(self, joint: object) -> np.ndarray:
        """Return the way of a joint's I from J along z_J, shape (m,), m; by joint or name."""
        return self._measures().displacement(joint)

    def joint_rate(self, joint: object) -> np.ndarray:
        """Return the speed of a joint's I from J about z_J, rad/s, or along it of one that does not turn, m/s."""
        return self._measures().rate(joint)

    def marker_position(self, marker: object) -> np.ndarray:
        """Return the origin of a marker, shape (m, 3), m, global; by marker or name, or of a body's own frame."""
        return self._measures().place(marker)

    def marker_velocity(self, marker: object) -> np.ndarray:
        """Return the velocity of a marker's origin, shape (m, 3), m/s, global; arguments as of `marker_position`."""
        return self._measures().velocity(marker)

    def deflection(self, marker: object) -> tuple[np.ndarray, np.ndarray]:
        """Return displacement (m) and rotation (rad) by deformation at a marker of a modal body, each (m, 3).

        In the body's axes, against the undeformed body about the same centre of mass; by marker or name. Markers may
        have been added after the run, so that any node can be asked for: ``body.marker(model.place(17))``.
        """
        return self._measures().deflection(marker)

    def transmission_error(self, mesh: object) -> np.ndarray:
        """Return r_b1 phi_1 + s r_b2 phi_2 of a mesh, shape (m,), m; by element or name.

        s is 1 for external and -1 for internal pairs; angles about the wheels' own axes, up to a base pitch. Where
        wheel 1 drives and turns positively about its axis it is positive if the other lags, else negative.
        """
        return self._measures().transmission_error(mesh)

    def state(self, state: object) -> np.ndarray:
        """Return a user-defined state of the mechanism, shape (m,); by state or name."""
        return self._measures().state(state)

    def evaluate(self, expression: str) -> np.ndarray:
        """Return an expression in the ADAMS function language over time, shape (m,), SI.

        As ``"DM(tip, anchor)"`` or ``"AZ(i, j)*RTOD"``; accelerations (ACCX, WDTZ ..) can be asked for, too. Markers
        may have been added to the bodies after the run.
        """
        return self._measures().expression(expression)

    # a number, a vector or several over time, as the mechanism says of the name
    def output(self, name: str) -> Any:
        """Return an output of the mechanism by its name over time, see `gearmbs.mechanism.Mechanism.output`.

        Raises
        ------
        KeyError
            For a name that is not there.
        """
        return self._measures().output(name)
