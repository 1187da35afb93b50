"""Linear modes: eigenvalues and shapes of the DAE linearised about an operating point.

The exact Jacobians of the I3 residual are projected on the motions the constraints allow, which leaves

    M x'' + C x' + K x + H z = 0,    z' = P x + Q x' + S z

with as many x as degrees of freedom; its eigenvalues are the finite ones of the pencil (dG/dy, dG/dy').
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.dae.analyses.coordinates import JointCoordinate
from gearmbs.dae.analyses.kinematics import Instant
from gearmbs.dae.analyses.turning import angular_velocities, spinning_modes
from gearmbs.wording import warn

if TYPE_CHECKING:
    from gearmbs.dae.model.system import System


from gearmbs.dae.analyses.eigenvalues import spectrum
from gearmbs.dae.analyses.energies import ModeParts, mode_parts
from gearmbs.dae.analyses.linearisation import Reduced, reduce, warn_of_varying

RIGID, OSCILLATING, REAL, SLIDING = "rigid", "oscillating", "real", "damped rigid"

CRITICAL = 1e-6
"""Imaginary part by magnitude up to which a pair does not oscillate.

A double eigenvalue, that of critical damping, is known to the square root of rounding, 1.5e-8; the ratio 1e-6 stands
for a damping ratio of 1 - 5e-13.
"""
UNRESISTED = 1e-6
"""Elastic by kinetic energy of a decaying motion below which it is rigid."""
WITH_THE_BODY = 1e-6
"""Part of its angular velocity by which axes may differ from it that turn with a body."""
GROWTH_TOLERANCE = 1e-8
"""Rounding of a real part, of the eigenvalue's own magnitude, that does not count as growth."""


@dataclass(repr=False)
class Modes:
    """Eigenvalues and their shapes; one entry for each conjugate pair, real eigenvalue or rigid motion.

    Only conjugate pairs are modes with a natural frequency, those of `oscillating`. A real eigenvalue decays or grows
    without oscillation, as a motion that is damped beyond the critical does, or a state of a controller.

    Attributes
    ----------
    eigenvalues : ndarray of complex, shape (k,)
        rad/s, imaginary part not negative, sorted by magnitude.
    frequencies : ndarray, shape (k,)
        Undamped natural frequencies |s| / 2 pi of what oscillates, Hz; zero for rigid motions, NaN where the
        eigenvalue is real: there is none.
    damping_ratios : ndarray, shape (k,)
        -Re s / |s|; zero for rigid motions, 1 or -1 where the eigenvalue is real.
    kinds : list of str
        ``rigid`` (no stiffness: eigenvalue zero), ``oscillating`` (a conjugate pair), ``damped rigid`` (the decay of a
        motion that dampers resist and no stiffness) or ``real``.
    shapes : ndarray of complex, shape (k, bodies, 6)
        Displacement of the centre of mass and rotation of each body, global components; the largest entry is 1.
    body_names : list of str
    parts : ModeParts, optional
        Where the energy of each is, and what damps it.
    errors : ndarray, shape (k,), optional
        Numerical errors of the frequencies, Hz, where an accuracy was asked for, as of `gearmbs.studies.train_modes`;
        NaN of those that were not judged.
    """

    eigenvalues: np.ndarray
    frequencies: np.ndarray
    damping_ratios: np.ndarray
    kinds: list[str]
    shapes: np.ndarray
    body_names: list[str]
    parts: ModeParts | None = None
    errors: np.ndarray | None = None

    @property
    def stable(self) -> bool:
        """True when no mode grows; rigid motions count as stable."""
        return bool(np.all(self.eigenvalues.real <= GROWTH_TOLERANCE * np.abs(self.eigenvalues)))

    @property
    def oscillating(self) -> np.ndarray:
        """Places of the modes that have a natural frequency, shape (n,)."""
        return np.flatnonzero([kind == OSCILLATING for kind in self.kinds])

    def table(self) -> str:
        """Return the modes as text: number, kind, frequency, damping ratio, eigenvalue, body that moves most.

        Rigid motions come first; what does not oscillate is listed apart, below, and has no frequency.
        """
        if not len(self):
            return "no modes: there are no degrees of freedom and no states"
        lines = [f"{'mode':>4}  {'kind':<12} {'frequency/Hz':>14} {'damping':>11}  {'eigenvalue/(rad/s)':<30} largest"]
        apart = [k for k, kind in enumerate(self.kinds) if kind in (REAL, SLIDING)]
        for k in [*(k for k in range(len(self)) if k not in apart), *apart]:
            if apart and k == apart[0]:
                lines.append("without oscillation, no modes: real eigenvalues, of over-damped motions and of states")
            s = self.eigenvalues[k]
            body = self.body_names[int(np.argmax(np.abs(self.shapes[k]).max(axis=1)))]
            value = f"{s.real:.6g} {'+-' if s.imag else '+'} {s.imag:.6g}i"
            frequency = "-" if k in apart else f"{self.frequencies[k]:.8g}"
            lines.append(
                f"{k + 1:>4}  {self.kinds[k]:<12} {frequency:>14} {self.damping_ratios[k]:>11.4g}  {value:<30} {body}"
            )
        return "\n".join(lines)

    def __len__(self) -> int:
        return self.eigenvalues.size

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        named = {RIGID: "rigid", OSCILLATING: "oscillating", SLIDING: "damped rigid", REAL: "without oscillation"}
        counts = {name: self.kinds.count(kind) for kind, name in named.items()}
        parts = ", ".join(f"{n} {name}" for name, n in counts.items() if n) or "none"
        moving = self.frequencies[self.frequencies > 0.0]
        span = f", {moving.min():.6g} to {moving.max():.6g} Hz" if moving.size else ""
        return f"Modes({parts}{span}, {'stable' if self.stable else 'unstable'})"


def linear_modes(place: System | Instant, joints: Sequence[JointCoordinate] = ()) -> Modes:
    """Return the linear modes of a system at its present pose and velocity, time functions frozen at ``system.t0``.

    Angles count from where they start; those of an instant, as of an equilibrium, keep the turns counted so far.

    At a position of equilibrium they are the small vibrations. Elsewhere they are the instantaneous eigenvalues
    with the loads' own changes, in coordinates of ``joints`` as far as these go. What spins is described in axes that
    do not turn with it (see `gearmbs.dae.analyses.turning`): of rotors alike about their axis the modes are those of
    the whirl, with gyroscopic couples. Where joints turn with bodies, as hinges of a pendulum on a turning frame, so do
    the axes (see `gearmbs.dae.analyses.steady`). Without degrees of freedom and states there are none.

    Raises
    ------
    SingularModelError
        If a motion left free by the constraints has no inertia.
    ModelError
        If the model cannot be made consistent.

    Warns
    -----
    UserWarning
        If bodies move so that the coefficients vary with time in all axes: they are those of this instant. If a body
        with modal coordinates spins that is not alike about this axis, while other axes serve the rest: they turn
        with it, so that its own modes are not those of its whirl.
    """
    if isinstance(place, Instant):
        instant = place
    else:
        instant = Instant(place, "I3")
        instant.released = True
    instant.y = instant.settle(instant.y)
    reduced = reduce(instant, joints=joints)
    warn_of_varying(reduced)
    _warn_of_turning_modes(instant, reduced)
    found = spectrum(reduced)
    values, vectors = found.values, found.vectors
    real = np.abs(values.imag) <= CRITICAL * np.abs(values)
    kept = real | (values.imag > 0.0)
    values, vectors, real = values[kept], vectors[:, kept], real[kept]
    values = np.where(real, values.real + 0j, values)
    sliding = real & _unresisted(reduced, values, vectors)
    rigid, held = found.rigid.shape[1], found.held.shape[1]
    eigenvalues = np.concatenate([np.zeros(rigid + held, dtype=complex), values])
    motions = np.hstack([found.rigid.astype(complex), found.held.astype(complex), vectors])
    size = np.abs(eigenvalues)
    ratios = np.divide(-eigenvalues.real, size, out=np.zeros(size.size), where=size > 0.0) + 0.0
    kinds = [RIGID] * rigid + [REAL] * held
    kinds += [SLIDING if free else REAL if r else OSCILLATING for r, free in zip(real, sliding)]
    none = np.array([kind in (REAL, SLIDING) for kind in kinds], dtype=bool)
    return Modes(
        eigenvalues,
        np.where(none, np.nan, size / (2.0 * np.pi)),
        ratios,
        kinds,
        _unit(instant.spatial(reduced.basis @ motions)),
        instant.system.body_names,
        mode_parts(instant, reduced.basis @ motions, eigenvalues),
    )


def _unresisted(reduced: Reduced, values: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Mark motions x of real eigenvalues that no elastic force K x + H z resists: |x.f| and |f| beside x.M x s^2."""
    out = np.zeros(values.size, dtype=bool)
    for k in np.flatnonzero(values.imag == 0.0):
        s, x = values[k].real, vectors[:, k].real if np.abs(vectors[:, k].real).any() else vectors[:, k].imag
        force, inertia = reduced.stiffness @ x, s * s * (reduced.mass @ x)
        if reduced.state_state.size:
            driven = (reduced.state_position + s * reduced.state_velocity) @ x
            rates = s * np.eye(driven.size) - reduced.state_state
            force = force + reduced.state_force @ np.linalg.lstsq(rates, driven, rcond=None)[0]
        kinetic = float(x @ inertia)
        # forces at right angles to the motion have no energy; rounding of stiff parts is larger in them
        beside = float(np.abs(force).max(initial=0.0)) <= np.sqrt(UNRESISTED) * float(np.abs(inertia).max(initial=0.0))
        out[k] = kinetic > 0.0 and abs(float(x @ force)) <= UNRESISTED * kinetic and beside
    return out


def _warn_of_turning_modes(instant: Instant, reduced: Reduced) -> None:
    names, velocities = instant.system.body_names, angular_velocities(instant)
    varying = {name for chain in reduced.varying for name in chain}
    for k, speed, found in spinning_modes(instant, velocities):
        if names[k] not in varying and np.linalg.norm(reduced.axes[k] - velocities[k]) <= WITH_THE_BODY * speed:
            continue
        if found is None:
            reason = "is not alike about the axis it spins about"
        elif not found.gyroscopic:
            reason = "has a coupling without gyroscopic terms (take coupling='full')"
        elif not found.known:
            reason = "has modes of several waves round about"
        else:
            continue
        warn(
            f"{names[k]} spins and {reason}: modal coordinates that turn with it have their frequencies as seen from "
            "the body; whirl and critical speeds of a shaft by its sections are found by gearmbs.flexible.Rotor"
        )


def _unit(shapes: np.ndarray) -> np.ndarray:
    """Scale each shape so that its largest entry is 1."""
    if not shapes.size:
        return shapes
    flat = shapes.reshape(shapes.shape[0], -1)
    largest = flat[np.arange(flat.shape[0]), np.argmax(np.abs(flat), axis=1)]
    largest = np.where(largest == 0.0, 1.0, largest)
    return shapes / largest[:, None, None]
