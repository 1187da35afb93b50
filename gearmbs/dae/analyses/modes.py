"""Linear modes: eigenvalues and shapes of the DAE linearised about an operating point.

The exact Jacobians of the I3 residual are projected on the motions the constraints allow, which leaves

    M x'' + C x' + K x + H z = 0,    z' = P x + Q x' + S z

with as many x as degrees of freedom; its eigenvalues are the finite ones of the pencil (dG/dy, dG/dy').
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.analyses.eigenvalues import spectrum
from gearmbs.dae.analyses.instant import Instant
from gearmbs.dae.analyses.linearised import reduce
from gearmbs.dae.analyses.turning import angular_velocities, spinning_modes

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System

RIGID, OSCILLATING, REAL = "rigid", "oscillating", "real"
REAL_TOLERANCE = 1e-9
GROWTH_TOLERANCE = 1e-8
"""Rounding of a real part, of the eigenvalue's own magnitude, that does not count as growth."""


@dataclass(repr=False)
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
        return bool(np.all(self.eigenvalues.real <= GROWTH_TOLERANCE * np.abs(self.eigenvalues)))

    def table(self) -> str:
        """Return the modes as text: number, kind, frequency, damping ratio, eigenvalue, body that moves most."""
        if not len(self):
            return "no modes: there are no degrees of freedom and no states"
        lines = [f"{'mode':>4}  {'kind':<11} {'frequency/Hz':>14} {'damping':>11}  {'eigenvalue/(rad/s)':<30} largest"]
        for k, s in enumerate(self.eigenvalues):
            body = self.body_names[int(np.argmax(np.abs(self.shapes[k]).max(axis=1)))]
            value = f"{s.real:.6g} {'+-' if s.imag else '+'} {s.imag:.6g}i"
            lines.append(
                f"{k + 1:>4}  {self.kinds[k]:<11} {self.frequencies[k]:>14.8g} {self.damping_ratios[k]:>11.4g}  "
                f"{value:<30} {body}"
            )
        return "\n".join(lines)

    def __len__(self) -> int:
        return self.eigenvalues.size

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        counts = {kind: self.kinds.count(kind) for kind in (RIGID, OSCILLATING, REAL)}
        parts = ", ".join(f"{n} {kind}" for kind, n in counts.items() if n) or "none"
        moving = self.frequencies[self.frequencies > 0.0]
        span = f", {moving.min():.6g} to {moving.max():.6g} Hz" if moving.size else ""
        return f"Modes({parts}{span}, {'stable' if self.stable else 'unstable'})"


def linear_modes(system: System) -> Modes:
    """Return the linear modes of a system at its present pose and velocity, time functions frozen at ``system.t0``.

    At a position of equilibrium they are the small vibrations. Elsewhere they are the instantaneous eigenvalues
    with the loads' own changes. What spins is described in axes that do not turn with it (see
    `gearmbs.dae.analyses.turning`): of rotors alike about their axis the modes are those of the whirl, with gyroscopic
    couples; of other moving points the coefficients are frozen. Without degrees of freedom and states there are none.

    Raises
    ------
    SingularModelError
        If a motion left free by the constraints has no inertia.
    ModelError
        If the model cannot be made consistent.

    Warns
    -----
    UserWarning
        If a body with modal coordinates spins that is not alike about this axis: they turn with it, so that its own
        modes are not those of its whirl.
    """
    instant = Instant(system, "I3")
    instant.y = instant.settle(instant.y)
    _warn_of_turning_modes(instant)
    reduced = reduce(instant)
    found = spectrum(reduced)
    values, vectors = found.values, found.vectors
    kept = values.imag >= -REAL_TOLERANCE * np.abs(values)
    values, vectors = values[kept], vectors[:, kept]
    real = np.abs(values.imag) <= REAL_TOLERANCE * np.abs(values)
    values = np.where(real, values.real + 0j, values)
    rigid, held = found.rigid.shape[1], found.held.shape[1]
    eigenvalues = np.concatenate([np.zeros(rigid + held, dtype=complex), values])
    motions = np.hstack([found.rigid.astype(complex), found.held.astype(complex), vectors])
    size = np.abs(eigenvalues)
    ratios = np.divide(-eigenvalues.real, size, out=np.zeros(size.size), where=size > 0.0) + 0.0
    return Modes(
        eigenvalues,
        size / (2.0 * np.pi),
        ratios,
        [RIGID] * rigid + [REAL] * held + [REAL if r else OSCILLATING for r in real],
        _unit(instant.spatial(reduced.basis @ motions)),
        system.body_names,
    )


def _warn_of_turning_modes(instant: Instant) -> None:
    names = instant.system.body_names
    for k, _, found in spinning_modes(instant, angular_velocities(instant)):
        if found is None:
            reason = "is not alike about the axis it spins about"
        elif not found.gyroscopic:
            reason = "has a coupling without gyroscopic terms (take coupling='full')"
        elif not found.known:
            reason = "has modes of several waves round about"
        else:
            continue
        warnings.warn(
            f"{names[k]} spins and {reason}: modal coordinates that turn with it have their frequencies as seen from "
            "the body; whirl and critical speeds of a shaft by its sections are found by gearmbs.flexible.Rotor",
            stacklevel=3,
        )


def _unit(shapes: np.ndarray) -> np.ndarray:
    """Scale each shape so that its largest entry is 1."""
    if not shapes.size:
        return shapes
    flat = shapes.reshape(shapes.shape[0], -1)
    largest = flat[np.arange(flat.shape[0]), np.argmax(np.abs(flat), axis=1)]
    largest = np.where(largest == 0.0, 1.0, largest)
    return shapes / largest[:, None, None]
