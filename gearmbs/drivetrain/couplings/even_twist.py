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

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.dae.equations.loads.forces import DERIVATIVES, DISSIPATED, FORCE_SIG, FRAME_A, FRAME_W, STORED, Diagnostic
from gearmbs.kernels.jit import njit
from gearmbs.mechanism.parts.elements import Compiled, ForceElement

STIFFNESS, DAMPING, TILT_STIFFNESS, TILT_DAMPING = range(4)
"""Parameters: k, N m/rad; c, N m s/rad; k_t and c_t."""
WORK = 15


@njit(cache=True, error_model="numpy")
def _cross(a, b, out):
    """Write the cross product of two vectors."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def even_twist(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the torque of a coupling; arguments as in `gearmbs.dae.equations.loads.forces`, without inputs."""
    one, two, way, w, moved = work[0:3], work[3:6], work[6:9], work[9:12], work[12:15]
    sine, cosine, along, size = 0.0, 0.0, 1.0, 0.0
    for q in range(3):
        row = FRAME_A + 3 * q
        one[q], two[q] = frames[0, row + 2], frames[1, row + 2]
        sine += frames[0, row] * frames[1, row + 1] - frames[0, row + 1] * frames[1, row]
        cosine += frames[0, row] * frames[1, row] + frames[0, row + 1] * frames[1, row + 1]
        along += one[q] * two[q]
        way[q] = one[q] + two[q]
        w[q] = frames[0, FRAME_W + q] - frames[1, FRAME_W + q]
        size += way[q] * w[q]
    twist, rate = math.atan2(sine, cosine), size / along
    torque = -reals[STIFFNESS] * twist - reals[DAMPING] * rate
    _cross(one, two, moved)
    tilted = 0.0
    for q in range(3):
        across = w[q] - way[q] * size / (2.0 * along)
        tilted += across * across
        wrench[0, 3 + q] = torque * way[q] / along + reals[TILT_STIFFNESS] * moved[q] - reals[TILT_DAMPING] * across
    if diagnostics.size:
        diagnostics[0] = 0.5 * reals[STIFFNESS] * twist * twist + reals[TILT_STIFFNESS] * (2.0 - along)
        diagnostics[1] = reals[DAMPING] * rate * rate + reals[TILT_DAMPING] * tilted
        diagnostics[2] = twist
    if not want & DERIVATIVES:
        return
    for side in range(2):
        turned, other, sign = (one, two, 1.0) if side == 0 else (two, one, -1.0)
        for b in range(3):
            # the variation of an axis: e_b x z
            b1, b2 = (b + 1) % 3, (b + 2) % 3
            moved[b] = 0.0
            moved[b1], moved[b2] = -turned[b2], turned[b1]
            by_along = moved[b1] * other[b1] + moved[b2] * other[b2]
            by_size = moved[b1] * w[b1] + moved[b2] * w[b2]
            by_rate = by_size / along - size * by_along / (along * along)
            by_torque = -sign * reals[STIFFNESS] * way[b] / along - reals[DAMPING] * by_rate
            for r in range(3):
                r1, r2 = (r + 1) % 3, (r + 2) % 3
                normal = moved[r] / along - way[r] * by_along / (along * along)
                tilt = sign * (moved[r1] * other[r2] - moved[r2] * other[r1])
                share = (moved[r] * size + way[r] * by_size) / (2.0 * along)
                share -= way[r] * size * by_along / (2.0 * along * along)
                jac[3 + r, 3 + 12 * side + b] = (
                    way[r] / along * by_torque + torque * normal + reals[TILT_STIFFNESS] * tilt
                    + reals[TILT_DAMPING] * share
                )  # fmt: skip
                own = 1.0 if r == b else 0.0
                jac[3 + r, 9 + 12 * side + b] = -sign * (
                    reals[DAMPING] * way[r] * way[b] / (along * along)
                    + reals[TILT_DAMPING] * (own - way[r] * way[b] / (2.0 * along))
                )  # fmt: skip


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
        return Compiled(even_twist, reals=self.parameters, scratch=WORK)

    def __repr__(self) -> str:
        return f"EvenTwist({self.name!r}, {self.i.body.name!r} against {self.j.body.name!r})"
