"""Linear modes: eigenvalues and shapes of the DAE linearised about an operating point.

The exact Jacobians of the I3 residual are projected on the motions the constraints allow, which leaves

    M x'' + C x' + K x + H z = 0,    z' = P x + Q x' + S z

with as many x as degrees of freedom; its eigenvalues are the finite ones of the pencil (dG/dy, dG/dy').
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eig

from gearmbs.dae.linearised import Instant, Reduced, free_directions, noise, normalised, reduce

if TYPE_CHECKING:
    from gearmbs.dae.system import System

RIGID, OSCILLATING, REAL = "rigid", "oscillating", "real"
REAL_TOLERANCE = 1e-9


@dataclass
class Modes:
    """Eigenvalues and mode shapes; one entry for each conjugate pair, real eigenvalue or rigid motion.

    Attributes
    ----------
    eigenvalues : ndarray of complex, shape (k,)
        rad/s, imaginary part not negative, sorted by magnitude.
    frequencies : ndarray, shape (k,)
        Undamped natural frequencies |s| / 2 pi, Hz.
    damping_ratios : ndarray, shape (k,)
        -Re s / |s|; zero for rigid motions.
    kinds : list of str
        ``rigid`` (no stiffness: frequency zero), ``oscillating`` (a conjugate pair) or ``real``.
    shapes : ndarray of complex, shape (k, bodies, 6)
        Displacement of the centre of mass and rotation of each body, global components; the largest entry is 1.
    body_names : list of str
    """

    eigenvalues: np.ndarray
    frequencies: np.ndarray
    damping_ratios: np.ndarray
    kinds: list[str]
    shapes: np.ndarray
    body_names: list[str]

    @property
    def stable(self) -> bool:
        """True when no mode grows; rigid motions count as stable."""
        size = np.abs(self.eigenvalues).max(initial=0.0)
        return bool(np.all(self.eigenvalues.real <= REAL_TOLERANCE * max(size, 1e-300)))

    def table(self) -> str:
        """Return the modes as text: number, kind, frequency, damping ratio, eigenvalue, body that moves most."""
        lines = [f"{'mode':>4}  {'kind':<11} {'frequency/Hz':>14} {'damping':>11}  {'eigenvalue/(rad/s)':<30} largest"]
        for k, s in enumerate(self.eigenvalues):
            body = self.body_names[int(np.argmax(np.abs(self.shapes[k]).max(axis=1)))]
            value = f"{s.real:.6g} {'+-' if s.imag else '+'} {s.imag:.6g}i"
            lines.append(
                f"{k + 1:>4}  {self.kinds[k]:<11} {self.frequencies[k]:>14.8g} {self.damping_ratios[k]:>11.4g}  "
                f"{value:<30} {body}"
            )
        if not self.eigenvalues.size:
            lines.append("   none: all motion is prescribed")
        return "\n".join(lines)

    def __len__(self) -> int:
        return self.eigenvalues.size


def linear_modes(system: System) -> Modes:
    """Return the linear modes of a system at its present pose and velocity, time functions frozen at ``system.t0``.

    At a position of equilibrium they are the small vibrations. Elsewhere they are the instantaneous eigenvalues
    with the loads' own changes; of a moving point the coefficients are frozen.

    Raises
    ------
    SingularModelError
        If a motion left free by the constraints has no inertia.
    ModelError
        If the model cannot be made consistent.
    """
    instant = Instant(system, "I3")
    instant.y = instant.settle(instant.y)
    reduced = reduce(instant)
    scale, stiffness = normalised(reduced)
    n, states = stiffness.shape[0], reduced.state_state.shape[0]
    damping = scale.T @ reduced.damping @ scale
    free = free_directions(stiffness, noise(reduced, scale))
    values, vectors = _eigen(reduced, scale, stiffness, damping)
    damped = np.linalg.norm(damping @ free, axis=0) > 1e-10 * max(np.abs(damping).max(initial=0.0), 1e-300)
    zeros = 2 * free.shape[1] - int(damped.sum())
    if states and free.shape[1]:
        zeros = min(zeros, int(np.sum(np.abs(values) <= 1e-6 * np.abs(values).max(initial=0.0))))
    order = np.argsort(np.abs(values), kind="stable")[zeros:]
    values, vectors = values[order], vectors[:, order]
    kept = values.imag >= -REAL_TOLERANCE * np.abs(values)
    values, vectors = values[kept], vectors[:, kept]
    real = np.abs(values.imag) <= REAL_TOLERANCE * np.abs(values)
    values = np.where(real, values.real + 0j, values)
    eigenvalues = np.concatenate([np.zeros(free.shape[1], dtype=complex), values])
    motions = np.hstack([free.astype(complex), vectors[:n]])
    kinds = [RIGID] * free.shape[1] + [REAL if r else OSCILLATING for r in real]
    size = np.abs(eigenvalues)
    ratios = np.divide(-eigenvalues.real, size, out=np.zeros(size.size), where=size > 0.0)
    return Modes(
        eigenvalues,
        size / (2.0 * np.pi),
        ratios,
        kinds,
        _unit(instant.spatial(reduced.basis @ scale @ motions)),
        system.body_names,
    )


def _eigen(reduced: Reduced, scale: np.ndarray, stiffness: np.ndarray, damping: np.ndarray):
    """Solve the first-order eigenproblem with time scaled so that stiffness and rates are of one size."""
    n, states = stiffness.shape[0], reduced.state_state.shape[0]
    rate = np.sqrt(np.abs(stiffness).max(initial=0.0)) or 1.0
    first = np.zeros((2 * n + states, 2 * n + states))
    first[:n, n : 2 * n] = np.eye(n)
    first[n : 2 * n, :n] = -stiffness / rate**2
    first[n : 2 * n, n : 2 * n] = -damping / rate
    first[n : 2 * n, 2 * n :] = -scale.T @ reduced.state_force / rate**2
    first[2 * n :, :n] = reduced.state_position @ scale / rate
    first[2 * n :, n : 2 * n] = reduced.state_velocity @ scale
    first[2 * n :, 2 * n :] = reduced.state_state / rate
    if not first.size:
        return np.zeros(0, dtype=complex), np.zeros((0, 0), dtype=complex)
    values, vectors = eig(first)
    return values * rate, vectors


def _unit(shapes: np.ndarray) -> np.ndarray:
    """Scale each shape so that its largest entry is 1."""
    if not shapes.size:
        return shapes
    flat = shapes.reshape(shapes.shape[0], -1)
    largest = flat[np.arange(flat.shape[0]), np.argmax(np.abs(flat), axis=1)]
    largest = np.where(largest == 0.0, 1.0, largest)
    return shapes / largest[:, None, None]
