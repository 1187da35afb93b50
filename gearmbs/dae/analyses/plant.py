"""A linear plant x' = A x + B u, y = C x + D u from a DAE linearised at one instant.

Inputs u are states of the DAE with the rate zero, outputs y the rates of others: with both among the states z of

    M x'' + C x' + K x + H z = 0,    z' = P x + Q x' + S z

their columns of M^-1 H and S are B and D, their rows of P, Q and S are C and D. All derivatives are those of the exact
Jacobian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve, expm

from gearmbs.dae.analyses.eigenvalues import Reduced, reduce, warn_of_varying
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.problem import ModelError, SingularModelError

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

FORMATS = (".mat", ".npz")


@dataclass(repr=False)
class LinearPlant:
    """x' = A x + B u, y = C x + D u about an operating point, in changes from it.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, inputs)
    c : ndarray, shape (outputs, n)
    d : ndarray, shape (outputs, inputs)
    states, inputs, outputs : list of str
        Displacements are in m and rad, velocities and rates by ``time_unit``.
    time_unit : float
        Unit of time, s.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    time_unit: float = 1.0

    @property
    def poles(self) -> np.ndarray:
        """Eigenvalues of A, shape (n,)."""
        return np.linalg.eigvals(self.a) if self.a.size else np.zeros(0, dtype=complex)

    def transfer(self, s: complex) -> np.ndarray:
        """Return C (s - A)^-1 B + D, shape (outputs, inputs)."""
        n = len(self.a)
        return self.c @ np.linalg.solve(s * np.eye(n) - self.a, self.b) + self.d

    def step(self, times: np.ndarray, which: int = 0) -> np.ndarray:
        """Return the outputs after a unit step of one input from rest.

        Parameters
        ----------
        times : ndarray, shape (m,)
            In the unit of time of the plant.
        which : int
            Index of the input.

        Returns
        -------
        ndarray, shape (m, outputs)
        """
        n = len(self.a)
        held = np.zeros((n + 1, n + 1))
        held[:n, :n], held[:n, n] = self.a, self.b[:, which]
        out = [self.c @ expm(held * float(t))[:n, n] + self.d[:, which] for t in np.asarray(times, dtype=float)]
        return np.array(out).reshape(-1, len(self.outputs))

    def save(self, path: str | Path) -> Path:
        """Write the matrices and names to a .mat file for MATLAB or a .npz file for NumPy.

        Raises
        ------
        ModelError
            If the file name ends otherwise.
        """
        path = check_format(path)
        content: dict[str, Any] = {"A": self.a, "B": self.b, "C": self.c, "D": self.d, "time_unit": self.time_unit}
        labels = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f".{path.stem}.part{path.suffix}")
        if path.suffix == ".mat":
            from scipy.io import savemat

            # cell arrays of names
            savemat(part, content | {key: np.array(names, dtype=object) for key, names in labels.items()})
        else:
            content |= {key: np.array(names, dtype=str) for key, names in labels.items()}
            np.savez(part, **content)
        part.replace(path)
        return path

    def table(self) -> str:
        """Return sizes, names, poles and matrices as text."""
        lines = [repr(self), f"  states   {', '.join(self.states) or 'none'}", f"  inputs   {', '.join(self.inputs)}"]
        lines.append(f"  outputs  {', '.join(self.outputs)}")
        for name in "abcd":
            matrix = getattr(self, name)
            rows = [" ".join(f"{v:13.6g}" for v in row) for row in matrix]
            lines += [f"  {name.upper()} ({matrix.shape[0]} by {matrix.shape[1]})", *(f"    {row}" for row in rows)]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"LinearPlant({len(self.a)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs)"


def check_format(path: str | Path) -> Path:
    """Return a path if a plant can be written to it.

    Raises
    ------
    ModelError
        If its name does not end in .mat or .npz.
    """
    path = Path(path)
    if path.suffix not in FORMATS:
        raise ModelError(f"{path.name}: a plant is written as {' or '.join(FORMATS)}")
    return path


def linear_plant(
    system: System, inputs: Sequence[int], outputs: Sequence[int], names: Sequence[str], time_unit: float = 1.0
) -> LinearPlant:
    """Return the plant between states of a system at its present pose and velocity.

    Parameters
    ----------
    system : System
    inputs : sequence of int
        Differential states, counted from 0, whose rate is zero.
    outputs : sequence of int
        Differential states whose rates are the outputs.
    names : sequence of str
        Of all differential states.
    time_unit : float
        Of the plant, s.

    Raises
    ------
    SingularModelError
        If a motion left free by the constraints has no inertia.
    """
    instant = Instant(system, "I3")
    instant.y = instant.settle(instant.y)
    reduced = reduce(instant)
    warn_of_varying(reduced, stacklevel=3)
    own = np.array([k for k in range(len(names)) if k not in (*inputs, *outputs)], dtype=int)
    u, y = np.array(inputs, dtype=int), np.array(outputs, dtype=int)
    accelerated = _accelerations(reduced)
    n, m, unit = len(reduced.mass), own.size, time_unit
    position, velocity, between = reduced.state_position, reduced.state_velocity, reduced.state_state

    a = np.zeros((2 * n + m, 2 * n + m))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n] = np.hstack([unit**2 * accelerated[0], unit * accelerated[1], unit**2 * accelerated[2][:, own]])
    a[2 * n :] = np.hstack([unit * position[own], velocity[own], unit * between[np.ix_(own, own)]])
    b = np.vstack([np.zeros((n, u.size)), unit**2 * accelerated[2][:, u], unit * between[np.ix_(own, u)]])
    c = np.hstack([unit * position[y], velocity[y], unit * between[np.ix_(y, own)]])
    d = unit * between[np.ix_(y, u)]
    moving = _moving(instant, reduced)
    states = [f"x{k + 1} ({body})" for k, body in enumerate(moving)]
    states += [f"v{k + 1} ({body})" for k, body in enumerate(moving)] + [names[k] for k in own]
    return LinearPlant(a, b, c, d, states, [names[k] for k in u], [names[k] for k in y], unit)


def _accelerations(reduced: Reduced) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return -M^-1 times K, C and H."""
    forces = (reduced.stiffness, reduced.damping, reduced.state_force)
    if not len(reduced.mass):
        return forces
    try:
        factor = cho_factor(0.5 * (reduced.mass + reduced.mass.T))
    except np.linalg.LinAlgError as error:
        raise SingularModelError("a motion that the constraints leave free has no inertia") from error
    return tuple(-cho_solve(factor, force) for force in forces)  # type: ignore[return-value]


def _moving(instant: Instant, reduced: Reduced) -> list[str]:
    """Return the body that each coordinate moves most."""
    if not reduced.basis.shape[1]:
        return []
    moved = np.abs(instant.spatial(reduced.basis)).max(axis=2)
    return [instant.system.body_names[int(k)] for k in moved.argmax(axis=1)]
