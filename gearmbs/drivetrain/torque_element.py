"""Torques about a shaft's axis as force elements, and the curves through points that their laws read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gearmbs.dae.equations.kinematics.update import angle_gradient, counted_angle
from gearmbs.dae.equations.loads.forces import DERIVATIVES, DISSIPATED, FORCE_SIG, FRAME_A, FRAME_W, STORED, Diagnostic
from gearmbs.drivetrain import torque_laws
from gearmbs.drivetrain.part import require
from gearmbs.drivetrain.torque_laws import (
    BY_ANGLE,
    BY_SPEED,
    BY_STATE,
    LAW_SIG,
    OUT_SIZE,
    RATE,
    RATE_BY_ANGLE,
    RATE_BY_SPEED,
    RATE_BY_STATE,
    STORED_TORQUE,
    TORQUE,
)
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import caller
from gearmbs.kernels.structs import vector_at
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, State
from gearmbs.mechanism.parts.functions import TimeFunction

# The kernel of all torques about a shaft's axis: geometry here, the law of the torque through an address.
#
# With the counted angle a of marker I about z_J, the relative speed w = (w_I - w_J) . z_J and one state z at most, a
# law gives T(t, a, w, z) and z' = R(t, a, w, z) with their partial derivatives. The torque on I's body is N = T z_J,
# and
#
#     dN = z_J dT + dpi_J x N,    dT = T_a da + T_w dw + T_z dz,
#     dw = z_J . (dw_I - dw_J) + dpi_J . (z_J x (w_I - w_J)).


TIMES = 1
"""Place among the integers: how many functions of time are inputs."""
COUNTS_ANGLE = 2
"""Whether the law looks at the angle."""
FIRST_TOLD = 3
"""Place in ``out`` of the first diagnostic; the others follow."""
WORK = OUT_SIZE + 9

law_at = caller(LAW_SIG)


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def shaft_torque(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write a torque about z_J by the law whose address is ``ints[0]``.

    Arguments as in `gearmbs.dae.equations.loads.forces`; inputs are functions of time, then, if the law looks at the
    angle, the reference of AZ.
    """
    out, z, w = work[0:OUT_SIZE], work[OUT_SIZE : OUT_SIZE + 3], work[OUT_SIZE + 3 : OUT_SIZE + 6]
    speed = 0.0
    for q in range(3):
        z[q] = frames[1, FRAME_A + 3 * q + 2]
        w[q] = frames[0, FRAME_W + q] - frames[1, FRAME_W + q]
        speed += w[q] * z[q]
    times = vector_at(inputs, 0, ints[TIMES])
    angle = 0.0
    if ints[COUNTS_ANGLE]:
        angle = counted_angle(2, frames[0], frames[1], inputs[ints[TIMES]])
    for q in range(OUT_SIZE):
        out[q] = 0.0
    law_at(ints[0])(reals, t, angle, speed, times, states, out)
    for q in range(3):
        wrench[0, 3 + q] = out[TORQUE] * z[q]
    if states.size:
        rates[0] = out[RATE]
    for q in range(min(RATE - ints[FIRST_TOLD], diagnostics.size)):
        diagnostics[q] = out[ints[FIRST_TOLD] + q]
    if not want & DERIVATIVES:
        return
    if ints[COUNTS_ANGLE]:
        angle_gradient(2, frames[0], frames[1], work, OUT_SIZE + 6)
    else:
        for q in range(3):
            work[OUT_SIZE + 6 + q] = 0.0
    for q in range(3):
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        turn, tilt = work[OUT_SIZE + 6 + q], z[q1] * w[q2] - z[q2] * w[q1]
        for r in range(3):
            jac[3 + r, 3 + q] = z[r] * out[BY_ANGLE] * turn
            jac[3 + r, 9 + q] = z[r] * out[BY_SPEED] * z[q]
            jac[3 + r, 15 + q] = z[r] * (out[BY_SPEED] * tilt - out[BY_ANGLE] * turn)
            jac[3 + r, 21 + q] = -z[r] * out[BY_SPEED] * z[q]
        if states.size:
            jac[3 + q, 24] = z[q] * out[BY_STATE]
            jac[6, 3 + q] = out[RATE_BY_ANGLE] * turn
            jac[6, 9 + q] = out[RATE_BY_SPEED] * z[q]
            jac[6, 15 + q] = out[RATE_BY_SPEED] * tilt - out[RATE_BY_ANGLE] * turn
            jac[6, 21 + q] = -out[RATE_BY_SPEED] * z[q]
    if states.size:
        jac[6, 24] = out[RATE_BY_STATE]
    for q in range(3):
        # dpi_J x N
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        jac[3 + q1, 15 + q2] += wrench[0, 3 + q]
        jac[3 + q2, 15 + q1] -= wrench[0, 3 + q]


ACCOUNTS = (Diagnostic("elastic_energy", "J", STORED), Diagnostic("damping_power", "W", DISSIPATED))
"""What a passive element stores and dissipates."""


@dataclass(eq=False, repr=False)
class ShaftTorque(ForceElement):
    """Torque T(t, angle, speed, state) on I's body about z of J, its reaction on J's body.

    Attributes
    ----------
    law : str
        Name of the compiled law in `gearmbs.drivetrain.torque_laws`, as "kloss".
    parameters : sequence of float
    times : tuple of TimeFunction
        Functions of time that the law is given.
    counts_angle : bool
        Whether the law looks at the angle of I about J.
    own_states : tuple of State
        At most one.
    told : tuple of Diagnostic
        Some that follow one another of: energy stored, power dissipated, one quantity of the law's own.
    first_told : int
        Place of the first of them in what the law writes: STORED_TORQUE, LOST or TOLD.
    what : str
        What messages call it.
    """

    law: str
    parameters: Sequence[float] | np.ndarray
    times: tuple[TimeFunction, ...] = ()
    counts_angle: bool = False
    own_states: tuple[State, ...] = ()
    told: tuple[Diagnostic, ...] = field(default=())
    first_told: int = STORED_TORQUE
    what: str = "shaft torque"

    has_force = False

    @property
    def kind(self) -> str:  # type: ignore[override]
        """What messages call it."""
        return self.what

    @property
    def states(self) -> tuple[State, ...]:
        """Its state, if it has one."""
        return self.own_states

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:  # type: ignore[override]
        """What it tells beside its torque."""
        return self.told

    def compiled(self) -> Compiled:
        return Compiled(
            shaft_torque,
            (len(self.times), int(self.counts_angle), self.first_told),
            self.parameters,
            ((getattr(torque_laws, self.law), LAW_SIG),),
            times=self.times,
            angles=((2, self.i, self.j),) if self.counts_angle else (),
            scratch=WORK,
        )

    def __repr__(self) -> str:
        return f"ShaftTorque({self.name!r}, {self.kind} on {self.i.body.name!r} about z of {self.j.name!r})"


def slopes(
    label: str, x: Sequence[float], y: Sequence[float], period: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points and slopes of the monotone cubic through them, of a periodic curve of the periodic spline.

    Parameters
    ----------
    label : str
        What messages call the owner of the points.
    x, y : sequence of float
        Two points or more, x increasing.
    period : float
        Period in x; the first and last points lie one period apart then, with the same value.

    Raises
    ------
    DrivetrainError
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    a, b = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    require(a.shape == b.shape and a.ndim == 1 and a.size >= 2, f"{label}: give as many torques as places, two or more")
    require(bool(np.all(np.diff(a) > 0.0)), f"{label}: the places of its table must increase")
    if period > 0.0:
        require(abs(a[-1] - a[0] - period) < 1e-9 * period, f"{label}: the table must cover one period, {period:g} rad")
        require(abs(b[-1] - b[0]) <= 1e-9 * np.abs(b).max(), f"{label}: the table's last torque must be its first")
        b[-1] = b[0]
        return a, b, CubicSpline(a, b, bc_type="periodic")(a, 1)
    return a, b, PchipInterpolator(a, b)(a, 1) if a.size > 2 else np.full(2, (b[1] - b[0]) / (a[1] - a[0]))
