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
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import block_diag, csc_array, diags_array
from scipy.sparse.linalg import splu

from gearmbs._deprecation import former_name
from gearmbs.dae.analyses.eigenvalues import free_motions
from gearmbs.dae.analyses.equilibrium_solution import EquilibriumSolution, Snapshot
from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.analyses.linearised import reduce
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import POSE_A, POSE_R, POSE_V
from gearmbs.dae.errors import AssemblyError, ModelError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Model
    from gearmbs.dae.model.system import System

LARGEST_TURN = 0.5
ROUNDING_STEP = 1e-13
FARTHEST = 1e6
"""Lengths of the mechanism after which a body is taken to be moving away for ever."""
DENSE_LIMIT = 600


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
    iterations, size = Relaxation(instant, tol).run(max_iterations)
    system.start = instant.configuration()
    system.state_start = instant.y[instant.block("z", "mu")].copy()
    return _result(instant, iterations, size)


class Relaxation:
    """The iteration, with its step control."""

    def __init__(self, instant: Instant, tol: float) -> None:
        self.instant, self.tol = instant, tol
        system = instant.system
        self.coordinates = system.model.counts.coordinates
        self.angles = instant.at["theta"] - instant.at["R"]
        self.modes = instant.at["q_f"] - instant.at["R"]
        inner = instant.block("lambda", "mu")
        self.rows = np.concatenate([instant.block("u", "eps"), inner])
        self.columns = np.concatenate([instant.block("R", "lambda"), inner])
        self.length = system.length
        self.held = self._held()
        scale = instant.problem.scale
        force = float(scale[instant.at["lambda"]]) if inner.size else 0.0
        weight = float(system.model.bodies[1:, T.BODY_MASS].max(initial=0.0))
        force = max(force, weight * 9.81, 1e-3)
        arm = min(self.length, 1.0)
        typical = system.model.modal_sizes()
        sizes = np.concatenate([self._by_kind(force, force * arm), force * arm / typical[:, 0]])
        kinds = {"lambda": self.length, "F": force, "N": force * arm, "z": 1.0}
        ends = ("F", "N", "z", "mu")
        for (name, value), end in zip(kinds.items(), ends):
            sizes = np.concatenate([sizes, np.full(instant.block(name, end).size, value)])
        self.sizes = sizes
        heaviest = weight if weight > 0.0 else 1.0
        light = self._by_kind(heaviest, heaviest * arm**2)
        self.floor = 1e-3 * np.concatenate([light, typical[:, 1]])
        self.reach = np.concatenate([self._by_kind(self.length, 1.0), typical[:, 0]])

    def _by_kind(self, displacement: float, rotation: float) -> np.ndarray:
        """Return one number for each displacement and another for each rotation of the bodies."""
        return np.repeat([displacement, rotation], [self.angles, self.modes - self.angles])

    def _inertia(self, matrix: csc_array) -> csc_array:
        mass = self.instant.mass_matrix(matrix)
        light = np.maximum(self.floor - mass.diagonal(), 0.0)
        return csc_array(mass + diags_array(light))

    def _parts(self, y: np.ndarray) -> tuple[np.ndarray, csc_array, csc_array]:
        matrix = self.instant.matrix(y)
        stiffness = csc_array(matrix[self.rows][:, self.columns] + diags_array(self.held.astype(float)))
        return self._rest(y), stiffness, self._inertia(matrix)

    def _rest(self, y: np.ndarray) -> np.ndarray:
        return np.where(self.held, 0.0, self.instant.residual(y)[self.rows])

    def _held(self) -> np.ndarray:
        """Mark the states whose rate depends on time alone, as of motions given by velocity: they keep their value."""
        matrix = self.instant.matrix(self.instant.y)[self.rows][:, self.columns]
        held = np.abs(matrix).sum(axis=1) == 0.0
        states = np.zeros(self.rows.size, dtype=bool)
        states[self.rows.size - self.instant.differential.size :] = self.instant.differential
        return np.asarray(held).ravel() & states

    def _solve(self, stiffness: csc_array, mass: csc_array, sigma: float, rest: np.ndarray) -> np.ndarray | None:
        extra = rest.size - self.coordinates
        shifted = stiffness + block_diag([sigma * mass, csc_array((extra, extra))], format="csc")
        try:
            step = splu(csc_array(shifted)).solve(-rest)
        except RuntimeError:
            return None
        return step if np.all(np.isfinite(step)) else None

    def _first_sigma(self, rest: np.ndarray, stiffness: csc_array, mass: csc_array) -> tuple[float, float]:
        """Return a first shift, whose step is about a tenth of the mechanism, and the smallest one used."""
        n, high = self.coordinates, 1e-300
        ratio = np.abs(stiffness.diagonal()[:n]).max(initial=0.0) / mass.diagonal().max(initial=1.0)
        arm = min(self.length, 1.0)
        net = np.abs(rest[:n]) / mass.diagonal() / self.reach
        high = max(float(net.max(initial=0.0)) / 0.1, 1e-6 * 9.81 / arm)
        return high, 1e-12 * max(high, ratio)

    def run(self, max_iterations: int) -> tuple[int, float]:
        """Iterate; return the number of iterations and the residual."""
        instant, n = self.instant, self.coordinates
        start = instant.y[instant.block("R", "theta")].copy()
        rest, stiffness, mass = self._parts(instant.y)
        sigma, lowest = self._first_sigma(rest, stiffness, mass)
        limit, polished = self.length, False
        for iteration in range(1, max_iterations + 1):
            size = float(np.abs(rest / self.sizes).max(initial=0.0))
            if not np.isfinite(size):
                raise ModelError("the forces are not finite at this position: check the expressions of the loads")
            step = self._solve(stiffness, mass, sigma, rest)
            if step is None or self._too_far(step, limit) or self._uphill(step, rest, stiffness, size):
                if polished:
                    return iteration, size
                sigma = 4.0 * max(sigma, lowest)
                continue
            y = instant.y.copy()
            y[self.columns] += step
            y = instant.settle(y)
            new = self._rest(y)
            new_size = float(np.abs(new / self.sizes).max(initial=0.0))
            if polished:
                if new_size <= size:
                    instant.y, size = y, new_size
                    instant.hook()
                return iteration, size
            missed = (new[:n] + sigma * (mass @ step[:n])) / self.sizes[:n]
            wrong = float(np.abs(missed).max() / max(np.abs(rest[:n] / self.sizes[:n]).max(), 1e-3 * self.tol))
            if not (wrong <= 0.5 or new_size <= self.tol):
                if float(np.abs(step[:n]).max()) <= ROUNDING_STEP * max(self.length, 1.0) and size <= 1e-6:
                    return iteration, size
                sigma = 4.0 * max(sigma, lowest)
                continue
            instant.y = y
            instant.hook()
            rest, stiffness, mass = self._parts(instant.y)
            sigma = max(lowest, sigma * (0.05 if wrong <= 0.05 else 0.3 if wrong <= 0.2 else 1.0))
            limit *= 2.0
            if np.abs(instant.y[instant.block("R", "theta")] - start).max() > FARTHEST * self.length:
                break
            if new_size <= self.tol:
                polished, sigma = True, lowest
        raise self._failure(rest)

    def newton(self, max_iterations: int = 20) -> int | None:
        """Iterate by Newton's method from a position nearby; return the number of iterations, None when it fails."""
        instant = self.instant
        polished = False
        for iteration in range(1, max_iterations + 1):
            rest, stiffness, mass = self._parts(instant.y)
            size = float(np.abs(rest / self.sizes).max(initial=0.0))
            if polished or not np.isfinite(size):
                return iteration if np.isfinite(size) and size <= self.tol else None
            polished = size <= self.tol
            step = self._solve(stiffness, mass, self._first_sigma(rest, stiffness, mass)[1], rest)
            if step is None or self._too_far(step, self.length):
                return None
            instant.y = instant.y.copy()
            instant.y[self.columns] += step
            instant.y = instant.settle(instant.y)
            instant.hook()
        return None

    def _too_far(self, step: np.ndarray, limit: float) -> bool:
        moved = np.abs(step[: self.angles]).max(initial=0.0)
        turned = np.abs(step[self.angles : self.modes]).max(initial=0.0)
        return moved > limit or turned > LARGEST_TURN

    def _uphill(self, step: np.ndarray, rest: np.ndarray, stiffness: csc_array, size: float) -> bool:
        """True when a step goes against the forces, towards an unstable position."""
        n = self.coordinates
        rows = self.instant.at["F"] - self.instant.at["lambda"]
        pull = stiffness[:n, n : n + rows] @ step[n : n + rows]
        return size > 1e-6 and float(step[:n] @ (rest[:n] + pull)) > 0.0

    def _failure(self, rest: np.ndarray) -> ModelError:
        """Say which body is free to move, or where forces do not balance."""
        names, n = self.instant.system.body_names, self.coordinates
        if n <= DENSE_LIMIT:
            _, motion = free_motions(reduce(self.instant))
            driven = motion @ (motion.T @ rest[:n])
            if np.abs(driven).max(initial=0.0) > 0.0:
                shape = self.instant.spatial(driven[:, None])[0]
                name, how = describe(shape, names, self.length)
                return SingularModelError(
                    f"body '{name}' is free to move ({how}) and its loads do not balance: there is no equilibrium; "
                    "hold it by a joint, a motion or a spring, or set the initial position nearer to the equilibrium"
                )
        worst = int(np.argmax(np.abs(rest[:n] / self.sizes[:n])))
        name = unbalanced_body(self.instant.system.model, worst)
        return AssemblyError(
            f"no equilibrium was found: body '{name}' is left with an unbalanced load of "
            f"{abs(rest[worst]):.3g} {'N' if worst < self.angles else 'N m'}; "
            "start nearer to the equilibrium, or add damping and simulate until the mechanism rests"
        )


def unbalanced_body(model: Model, row: int) -> str:
    """Return the name of the body that row ``row`` of the balance of forces belongs to."""
    names, three = model.names.bodies, 3 * len(model.names.bodies)
    if row < 2 * three:
        return names[(row % three) // 3]
    return names[int(np.repeat(np.arange(len(names)), model.modes[1:])[row - 2 * three])]


def describe(shape: np.ndarray, names: list[str], length: float) -> tuple[str, str]:
    """Return the body that moves most in a motion of shape (bodies, 6), and how: along or about which direction."""
    size = np.abs(shape) * np.repeat([1.0, length], 3)
    body = int(np.argmax(size.max(axis=1)))
    turning = size[body, 3:].max() > size[body, :3].max()
    part = shape[body, 3:] if turning else shape[body, :3]
    direction = np.real(part / part[np.argmax(np.abs(part))])
    text = ", ".join(f"{x:.3g}" for x in direction / np.linalg.norm(direction) + 0.0)
    return names[body], f"{'rotation about' if turning else 'translation along'} ({text})"


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
