"""Static equilibrium: the pose at which the I3 residual vanishes with all velocities and rates zero.

With u = p = eps = 0 and y' = 0 what is left of eq. (5)-(8) are the balances of forces, the constraints and the
definitions of the loads, in the unknowns R, theta, lambda, F, N (and states). Each iteration solves

    [K + sigma M   Phi_q^T] [dq     ]     [force residual]
    [Phi_q               0] [dlambda] = - [Phi           ]

with the exact Jacobian: for large sigma a step of a motion without inertia down the forces, which finds stable
positions from afar, for sigma = 0 Newton's method. sigma follows how well the linear model predicted the last step.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs._deprecation import former_name
from gearmbs.dae.analyses.eigenvalues import free_motions
from gearmbs.dae.analyses.equilibrium_solution import EquilibriumSolution, Snapshot
from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.analyses.linearised import reduce
from gearmbs.dae.analyses.load_steps import equilibrium
from gearmbs.dae.analyses.relaxation import DENSE_LIMIT, Relaxation, describe
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V
from gearmbs.dae.errors import ModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System


@dataclass(repr=False)
class StaticResult:
    """A position of equilibrium.

    Attributes
    ----------
    t : float
        Time at which functions of time were frozen, s.
    body_names : list of str
    pose : ndarray, shape (bodies, 18)
        R (m), A (row-major), and zero velocities.
    multipliers : ndarray, shape (rows,)
    reactions : dict of str to (ndarray, ndarray)
        Force (N) and moment about marker I (N m) of each joint on I's body, global components.
    loads : dict of str to (ndarray, ndarray)
        Force (N) and torque (N m) of each force element on I's body.
    iterations : int
    residual : float
        Largest unbalanced force or torque relative to the typical one, or constraint violation.
    neutral : list of str
        Bodies free to move away from the equilibrium without any resistance.
    stable : bool or None
        Whether all small displacements are resisted or neutral; None when the system is too large to tell cheaply.
    solution : Solution
        The equilibrium as a solution with one output time.
    """

    t: float
    body_names: list[str]
    pose: np.ndarray
    multipliers: np.ndarray
    reactions: dict[str, tuple[np.ndarray, np.ndarray]]
    loads: dict[str, tuple[np.ndarray, np.ndarray]]
    iterations: int
    residual: float
    neutral: list[str] = field(default_factory=list)
    stable: bool | None = None
    solution: EquilibriumSolution = field(repr=False, default=None)  # type: ignore[assignment]

    def com_position(self, body: str) -> np.ndarray:
        """Return the position of the centre of mass of a body, shape (3,), m, global."""
        return self.pose[self._index(body), POSE_R:POSE_A]

    position = former_name("position", com_position, "it is the centre of mass; write com_position")

    def marker_position(self, marker: Any) -> np.ndarray:
        """Return the origin of a marker, shape (3,), m, global; by marker or name, or of a body's own frame."""
        return self.solution.marker_position(marker)[0]

    def orientation(self, body: str) -> np.ndarray:
        """Return the rotation matrix of a body, shape (3, 3)."""
        return self.pose[self._index(body), POSE_A:POSE_V].reshape(3, 3)

    def table(self) -> str:
        """Return the equilibrium as text: how good and stable it is, where the bodies are, what joints carry."""

        def shown(value: float) -> float:
            return 0.0 if abs(value) < 1e-12 else value

        lines = [repr(self), f"{'body':<24} {'x/m':>12} {'y/m':>12} {'z/m':>12}"]
        for name, row in zip(self.body_names, self.pose):
            lines.append(f"{name:<24} " + " ".join(f"{shown(value):>12.6g}" for value in row[0:3]))
        for title, table in (("joint", self.reactions), ("load", self.loads)):
            if table:
                lines.append(f"{title:<24} {'force/N':>12} {'moment/N m':>12}")
            for name, (force, moment) in table.items():
                sizes = (shown(float(np.linalg.norm(part))) for part in (force, moment))
                lines.append(f"{name:<24} " + " ".join(f"{size:>12.6g}" for size in sizes))
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        count = f"{len(self.body_names)} {'body' if len(self.body_names) == 1 else 'bodies'}"
        known = {True: "stable", False: "unstable", None: "stability not examined"}[self.stable]
        neutral = f", free to move: {', '.join(self.neutral)}" if self.neutral else ""
        return (
            f"StaticResult({count} at t = {self.t:g} s, {known}{neutral}; "
            f"{self.iterations} iterations, residual {self.residual:.1e})"
        )

    def _index(self, body: str) -> int:
        if body not in self.body_names:
            raise KeyError(f"body {body!r}; the bodies are {', '.join(self.body_names)}")
        return self.body_names.index(body)


def static_equilibrium(system: System, *, tol: float = 1e-10, max_iterations: int = 200) -> StaticResult:
    """Find the equilibrium reached from a system's initial pose, functions of time frozen at ``system.t0``.

    Parameters
    ----------
    system : System
        Its pose is made consistent, and left at the equilibrium with zero velocities.
    tol : float
        Largest unbalanced force relative to the weight of the heaviest body or the largest load.
    max_iterations : int

    Raises
    ------
    SingularModelError
        If a body is free to move and its loads do not balance: it is named.
    ModelError
        If the iteration does not converge; the body with the largest unbalanced force is named.
    """
    if not tol > 0.0 or max_iterations < 1:
        raise ModelError(f"tol = {tol}, max_iterations = {max_iterations}; both must be positive")
    if system.report is None:
        system.initialise()
    system.start = system.start.at_rest()
    instant = Instant(system, "I3")
    instant.y = instant.settle(instant.stop(instant.y))
    iterations, size = equilibrium(Relaxation(instant, tol), max_iterations)
    system.start = instant.configuration()
    system.state_start = instant.y[instant.block("z", "mu")].copy()
    return _result(instant, iterations, size)


def _result(instant: Instant, iterations: int, size: float) -> StaticResult:
    system = instant.system
    solution = EquilibriumSolution.of(
        [Snapshot.of(instant)], f"static equilibrium found in {iterations} iterations", iterations
    )
    joints = system.model.rows_of_joint
    reactions = {joint: (solution.reaction(joint)[0][0], solution.reaction(joint)[1][0]) for joint in joints}
    loads = {name: (solution.load(name)[0][0], solution.load(name)[1][0]) for name in system.force_names}
    neutral: list[str] = []
    stable = None
    if system.model.counts.coordinates <= DENSE_LIMIT:
        stable, motion = free_motions(reduce(instant))
        shapes = instant.spatial(motion)
        neutral = list(dict.fromkeys(describe(s, system.body_names, system.length)[0] for s in shapes))
    return StaticResult(
        instant.t,
        system.body_names,
        instant.pose(),
        solution.multipliers[0].copy(),
        reactions,
        loads,
        iterations,
        size,
        neutral,
        stable,
        solution,
    )
