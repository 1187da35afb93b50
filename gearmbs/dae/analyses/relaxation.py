"""Relaxation: Newton's method on the balance of forces, held back by the inertia while it is far from equilibrium."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import block_diag, csc_array, diags_array
from scipy.sparse.linalg import splu

from gearmbs.dae.analyses.eigenvalues import free_motions
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.linearisation import reduce
from gearmbs.dae.equations import layout as T
from gearmbs.dae.problem import AssemblyError, ModelError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Model

LARGEST_TURN = 0.5
"""Angle, rad, by which a body may turn in an iteration: beyond it what is linear in small rotations says nothing."""
ROUNDING_STEP = 1e-13
"""Correction, as part of the mechanism's length or of 1 m, below which positions are at their rounding, and no shorter
step lowers the forces further."""
FARTHEST = 1e6
"""Lengths of the mechanism after which a body is taken to be moving away for ever."""
DENSE_LIMIT = 600


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
        typical = system.model.modal_sizes
        sizes = np.concatenate([self._by_kind(force, force * arm), force * arm / typical[:, 0]])
        kinds = {"lambda": self.length, "F": force, "N": force * arm, "z": 1.0}
        ends = ("F", "N", "z", "mu")
        for (name, value), end in zip(kinds.items(), ends):
            sizes = np.concatenate([sizes, np.full(instant.block(name, end).size, value)])
        self.sizes = sizes
        self._size_states()
        heaviest = weight if weight > 0.0 else 1.0
        light = self._by_kind(heaviest, heaviest * arm**2)
        self.floor = 1e-3 * np.concatenate([light, typical[:, 1]])
        self.reach = np.concatenate([self._by_kind(self.length, 1.0), typical[:, 0]])

    def _size_states(self) -> None:
        """Let states balance to what they are known to: rates of stiff ones, as of a rim, are large numbers' rest."""
        count = self.instant.differential.size
        if not count:
            return
        matrix = abs(self.instant.matrix(self.instant.y)[self.rows][:, self.columns]).tocsr()
        stiff = matrix[-count:, -count:].max(axis=1).toarray().ravel()
        self.sizes[-count:] = np.maximum(self.sizes[-count:], np.where(self.instant.differential, stiff, 0.0))

    def _by_kind(self, displacement: float, rotation: float) -> np.ndarray:
        """Return one number for each displacement and another for each rotation of the bodies."""
        return np.repeat([displacement, rotation], [self.angles, self.modes - self.angles])

    def _inertia(self, matrix: csc_array) -> csc_array:
        mass = self.instant.mass_matrix(matrix)
        light = np.maximum(self.floor - mass.diagonal(), 0.0)
        return csc_array(mass + diags_array(light))

    def parts(self, y: np.ndarray) -> tuple[np.ndarray, csc_array, csc_array]:
        """Return what is left of the balances at y, the stiffness and the mass."""
        matrix = self.instant.matrix(y)
        stiffness = csc_array(matrix[self.rows][:, self.columns] + diags_array(self.held.astype(float)))
        return self.rest(y), stiffness, self._inertia(matrix)

    def rest(self, y: np.ndarray) -> np.ndarray:
        """Return what is left of the balances of forces, constraints and states at y."""
        return np.where(self.held, 0.0, self.instant.residual(y)[self.rows])

    def _held(self) -> np.ndarray:
        """Mark the states whose rate depends on time alone, as of motions given by velocity: they keep their value."""
        matrix = self.instant.matrix(self.instant.y)[self.rows][:, self.columns]
        held = np.abs(matrix).sum(axis=1) == 0.0
        states = np.zeros(self.rows.size, dtype=bool)
        states[self.rows.size - self.instant.differential.size :] = self.instant.differential
        return np.asarray(held).ravel() & states

    def solve(self, stiffness: csc_array, mass: csc_array, sigma: float, rest: np.ndarray) -> np.ndarray | None:
        """Return a step, None where the shifted matrix is singular."""
        extra = rest.size - self.coordinates
        shifted = stiffness + block_diag([sigma * mass, csc_array((extra, extra))], format="csc")
        try:
            step = splu(csc_array(shifted)).solve(-rest)
        except RuntimeError:
            return None
        return step if np.all(np.isfinite(step)) else None

    def first_sigma(self, rest: np.ndarray, stiffness: csc_array, mass: csc_array) -> tuple[float, float]:
        """Return a first shift, whose step is about a tenth of the mechanism, and the smallest one used."""
        n, high = self.coordinates, 1e-300
        ratio = np.abs(stiffness.diagonal()[:n]).max(initial=0.0) / mass.diagonal().max(initial=1.0)
        arm = min(self.length, 1.0)
        net = np.abs(rest[:n]) / mass.diagonal() / self.reach
        high = max(float(net.max(initial=0.0)) / 0.1, 1e-6 * 9.81 / arm)
        return high, 1e-12 * max(high, ratio)

    def run(self, max_iterations: int, first: float = 1.0) -> tuple[int, float]:
        """Iterate; return the number of iterations and the residual.

        Parameters
        ----------
        max_iterations : int
        first : float
            The longest first step, in lengths of the mechanism; each that is taken doubles what the next may be.

        Raises
        ------
        SingularModelError, ModelError
            If it comes to no end.
        """
        instant, n = self.instant, self.coordinates
        start = instant.y[instant.block("R", "theta")].copy()
        rest, stiffness, mass = self.parts(instant.y)
        sigma, lowest = self.first_sigma(rest, stiffness, mass)
        limit, polished = first * self.length, False
        for iteration in range(1, max_iterations + 1):
            size = float(np.abs(rest / self.sizes).max(initial=0.0))
            if not np.isfinite(size):
                raise ModelError("the forces are not finite at this position: check the expressions of the loads")
            step = self.solve(stiffness, mass, sigma, rest)
            if step is None or self._too_far(step, limit) or self._uphill(step, rest, stiffness, size):
                if polished:
                    return iteration, size
                sigma = 4.0 * max(sigma, lowest)
                continue
            y = instant.y.copy()
            y[self.columns] += step
            y = instant.settle(y)
            new = self.rest(y)
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
            rest, stiffness, mass = self.parts(instant.y)
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
            rest, stiffness, mass = self.parts(instant.y)
            size = float(np.abs(rest / self.sizes).max(initial=0.0))
            if polished or not np.isfinite(size):
                return iteration if np.isfinite(size) and size <= self.tol else None
            polished = size <= self.tol
            step = self.solve(stiffness, mass, self.first_sigma(rest, stiffness, mass)[1], rest)
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
    return model.names.bodies[model.counts.owners[row]]


def describe(shape: np.ndarray, names: list[str], length: float) -> tuple[str, str]:
    """Return the body that moves most in a motion of shape (bodies, 6), and how: along or about which direction."""
    size = np.abs(shape) * np.repeat([1.0, length], 3)
    body = int(np.argmax(size.max(axis=1)))
    turning = size[body, 3:].max() > size[body, :3].max()
    part = shape[body, 3:] if turning else shape[body, :3]
    direction = np.real(part / part[np.argmax(np.abs(part))])
    text = ", ".join(f"{x:.3g}" for x in direction / np.linalg.norm(direction) + 0.0)
    return names[body], f"{'rotation about' if turning else 'translation along'} ({text})"
