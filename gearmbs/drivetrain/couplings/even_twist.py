"""Torque of a coupling by the twist between two shafts whose axes are at an angle.

The angle of one marker about the axis z of another is not the twist: of axes at a small angle beta it has in it
beta^2/4 sin 2 phi, though a coupling that bends evenly, as one of discs or rubber, passes the rotation evenly. With
markers I and J, s = x_I . y_J - y_I . x_J and c = x_I . x_J + y_I . y_J the twist of such a one is

    a = atan2(s, c),    a' = n . (w_I - w_J),    n = (z_I + z_J) / (1 + z_I . z_J),

the condition of a joint of constant velocity being s = 0. The torque on I is that of a spring and damper for the twist,
and another one for the tilt, across the mean axis b = (z_I + z_J) / |z_I + z_J|:

    N = -(k a + c a') n + k_t z_I x z_J - c_t (w - (w . b) b),    w = w_I - w_J.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations.loads.forces import CHANGED_SIG, DERIVATIVES, DISSIPATED, FORCE_SIG, STORED, Diagnostic
from gearmbs.dae.problem import ModelError
from gearmbs.drivetrain.couplings import derived as D
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.parts.elements import Compiled, ForceElement

NUMBERS = ("stiffness", "damping", "tilt_stiffness", "tilt_damping")
"""Parameters: k, N m/rad; c, N m s/rad; k_t and c_t."""


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def even_twist(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the torque of a coupling; arguments as in `gearmbs.dae.equations.loads.forces`, without inputs."""
    one, two = frames[0], frames[1]
    twist = D.twist(one, two)
    D.even_load(one, two, reals, twist, wrench)
    if diagnostics.size:
        diagnostics[0], diagnostics[1] = D.even_energies(one, two, reals, twist)
        diagnostics[2] = twist
    if want & DERIVATIVES:
        D.even_slopes(one, two, reals, twist, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def even_twist_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write the derivatives of the torque along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    D.even_changed(frames[0], frames[1], reals, D.twist(frames[0], frames[1]), changed, out)


@dataclass(eq=False, repr=False)
class EvenTwist(ForceElement):
    """A torque by twist and tilt between two shafts, I on the second; see `gearmbs.drivetrain.couplings.even_twist`.

    Attributes
    ----------
    parameters : sequence of 4 floats
        Torsional stiffness (N m/rad) and damping (N m s/rad), and those against tilting.
    """

    parameters: Sequence[float] | np.ndarray

    kind = "flexible coupling"
    has_force = False
    diagnostics = (
        Diagnostic("elastic_energy", "J", STORED),
        Diagnostic("damping_power", "W", DISSIPATED),
        Diagnostic("twist", "rad"),
    )

    def compiled(self) -> Compiled:
        return Compiled(even_twist, reals=self.parameters, changed=even_twist_changed)

    def _reals_by(self, name: str, made: Compiled) -> np.ndarray:
        """Return how the reals change with one of its numbers, which each is one of them."""
        if name not in NUMBERS:
            raise ModelError(f"{self.kind} '{self.name}': it has no number '{name}'; it has {', '.join(NUMBERS)}")
        return np.eye(len(NUMBERS))[NUMBERS.index(name)]

    def __repr__(self) -> str:
        return f"EvenTwist({self.name!r}, {self.i.body.name!r} against {self.j.body.name!r})"
