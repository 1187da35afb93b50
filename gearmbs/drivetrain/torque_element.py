"""Torques about a shaft's axis as force elements, by compiled laws.

Induction motors by Kloss [1]_ or by their equivalent circuit, with s = 1 - w/w_s:

    Kloss:    T = 2 T_b / (s/s_b + s_b/s),
    circuit:  T = A R_2 s / ((R_1 s + R_2)^2 + (X s)^2),    A = n p U^2 / w_e.

With an electrical lag tau the air-gap torque z is a state, tau z' = T - z. A speed controller gives

    u = k_p e + k_i z,  e = w_ref(t) - w,  T = sat(u),  z' = e + (T - u)/k_p,

where sat is the identity up to `LINEAR_SHARE` of the largest torque and rises smoothly to it beyond.

Displacement pump, with the pressure difference p(t) itself or behind a lag, tau z' = p(t) - z:

    T = -sigma [V_g p / (2 pi eta) (1 + sum_k a_k cos(k Z (a - a_0))) + T_0 tanh(sigma w / w_0) + c sigma w];

resistance of brakes, fans and drag:

    T = -[T_0 f(t) tanh(w/w_0) + c w + k w |w|].

Elastic couplings and clutches, with the twist p = a - a_0, the compression d = |p| - b/2 beyond a dead band b and the
side sigma = sign p:

    e(d) = k_1 d + k_3 d^3 + (k_2 - k_1) B(d - d_2),    T = -sigma max(0, e + c S(d) d'),    d' = sigma w,

where B rises from 0 to the line d - d_2 over a width (stages join with a continuous tangent) and S is the STEP of the
damping over a depth behind the dead band. Without a dead band T = -sigma e - c w, which may also damp against the
spring; with one a side that has let go never pulls.

References
----------
.. [1] M. Kloss, Drehmoment und Schlüpfung des Drehstrommotors, Archiv für Elektrotechnik 5 (1916) 59-87.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gearmbs.dae.equations.kinematics import angle_gradient, counted_angle
from gearmbs.dae.equations.loads.forces import (
    DERIVATIVES,
    DISSIPATED,
    FORCE_SIG,
    FRAME_A,
    FRAME_W,
    STORED,
    Diagnostic,
    impact,
)
from gearmbs.drivetrain.part import require
from gearmbs.drivetrain.torque_text import LINEAR_SHARE, STATE_UNIT, torque_text
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, VEC, caller
from gearmbs.kernels.structs import vector_at
from gearmbs.mechanism.language.syntax import Units
from gearmbs.mechanism.parts.elements import Compiled, ForceElement, Load, State
from gearmbs.mechanism.parts.functions import TimeFunction

LAW_SIG = types.void(VEC, F8, F8, F8, VEC, VEC, VEC)
"""law(parameters, t, angle, speed, times, states, out); angle in rad, speed in rad/s."""

TORQUE, BY_ANGLE, BY_SPEED, BY_STATE = 0, 1, 2, 3
"""Places in ``out``: the torque on I (N m) and its derivatives."""
STORED_TORQUE, LOST, OWN = 4, 5, 6
"""Energy stored (J), power dissipated (W), and one quantity of the law's own."""
RATE, RATE_BY_ANGLE, RATE_BY_SPEED, RATE_BY_STATE = 7, 8, 9, 10
"""The state's rate and its derivatives."""
OUT_SIZE = 11

SENSE, SYNCHRONOUS, LAG = 0, 1, 2
"""Parameters of induction motors: sense of rotation, synchronous speed (rad/s), lag (s); then those of the law."""

TIMES = 1
"""Place among the integers: how many functions of time are inputs."""
COUNTS_ANGLE = 2
"""Whether the law looks at the angle."""
FIRST_DIAGNOSTIC = 3
"""Place in ``out`` of the first diagnostic; the others follow."""
WORK = OUT_SIZE + 9

law_at = caller(LAW_SIG)


ACCOUNTS = (Diagnostic("elastic_energy", "J", STORED), Diagnostic("damping_power", "W", DISSIPATED))
"""What a passive element stores and dissipates."""


@njit(cache=True, error_model="numpy")
def _induction(p, value, slope, factor, states, out):
    """Write the torque ``value`` over slip with its ``slope``, direct or through the lag."""
    by_speed = -slope / p[SYNCHRONOUS]
    if states.size:
        out[TORQUE] = p[SENSE] * states[0]
        out[BY_STATE] = p[SENSE]
        out[RATE] = (factor * value - states[0]) / p[LAG]
        out[RATE_BY_SPEED] = p[SENSE] * factor * by_speed / p[LAG]
        out[RATE_BY_STATE] = -1.0 / p[LAG]
    else:
        out[TORQUE] = p[SENSE] * factor * value
        out[BY_SPEED] = factor * by_speed


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def kloss(p, t, angle, speed, times, states, out):
    """Kloss's formula; ``p[3:5]``: breakdown torque (N m) and slip; ``times[0]``: share of the torque switched on."""
    s = 1.0 - p[SENSE] * speed / p[SYNCHRONOUS]
    size = s * s + p[4] * p[4]
    value = 2.0 * p[3] * p[4] * s / size
    slope = 2.0 * p[3] * p[4] * (p[4] * p[4] - s * s) / (size * size)
    _induction(p, value, slope, times[0], states, out)
    out[OWN] = s


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def circuit(p, t, angle, speed, times, states, out):
    """Equivalent circuit; ``p[3:7]``: A (V^2 s/rad), R_1, R_2, X = X_1 + X_2 (ohm)."""
    s = 1.0 - p[SENSE] * speed / p[SYNCHRONOUS]
    stator = p[4] * s + p[5]
    size = stator * stator + p[6] * p[6] * s * s
    value = p[3] * p[5] * s / size
    slope = p[3] * p[5] * (p[5] * p[5] - (p[4] * p[4] + p[6] * p[6]) * s * s) / (size * size)
    _induction(p, value, slope, times[0], states, out)
    out[OWN] = s


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def controller(p, t, angle, speed, times, states, out):
    """Speed control; ``p``: sense, k_p (N m s/rad), k_i (N m/rad), largest torque (N m); ``times[0]``: w_ref."""
    error = times[0] - p[0] * speed
    wanted = p[1] * error + p[2] * states[0]
    free = LINEAR_SHARE * p[3]
    over = abs(wanted) - free
    torque, gain = wanted, 1.0
    if over > 0.0:
        rest = p[3] - free
        bend = np.tanh(over / rest)
        torque = np.sign(wanted) * (free + rest * bend)
        gain = 1.0 - bend * bend
    out[TORQUE] = p[0] * torque
    out[BY_SPEED] = -gain * p[1]
    out[BY_STATE] = p[0] * gain * p[2]
    out[RATE] = error + (torque - wanted) / p[1]
    out[RATE_BY_SPEED] = -p[0] * gain
    out[RATE_BY_STATE] = (gain - 1.0) * p[2] / p[1]
    out[OWN] = error


PUMP_SENSE, PER_PRESSURE, IDLE, VISCOUS, PUMP_SMOOTH, PUMP_TEETH, PUMP_START, PUMP_LAG, EFFICIENCY = range(9)
"""Parameters of a pump: sense, V_g/2pi (m^3/rad), T_0, c, w_0, Z, a_0, lag, eta; then a_1, a_2, ..."""


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def pump(p, t, angle, speed, times, states, out):
    """Write a pump's torque; ``times[0]``: pressure difference, Pa. It tells the flow, m^3/s."""
    sense = p[PUMP_SENSE]
    ripple, slope = 1.0, 0.0
    for k in range(p.size - EFFICIENCY - 1):
        order = (k + 1) * p[PUMP_TEETH]
        phase = order * (angle - p[PUMP_START])
        ripple += p[EFFICIENCY + 1 + k] * np.cos(phase)
        slope -= p[EFFICIENCY + 1 + k] * order * np.sin(phase)
    pressure = STATE_UNIT * states[0] if states.size else times[0]
    gain = p[PER_PRESSURE] / p[EFFICIENCY]
    bend = np.tanh(sense * speed / p[PUMP_SMOOTH])
    out[TORQUE] = -sense * (gain * pressure * ripple + p[IDLE] * bend) - p[VISCOUS] * speed
    out[BY_ANGLE] = -sense * gain * pressure * slope
    out[BY_SPEED] = -p[IDLE] * (1.0 - bend * bend) / p[PUMP_SMOOTH] - p[VISCOUS]
    if states.size:
        out[BY_STATE] = -sense * gain * ripple * STATE_UNIT
        out[RATE] = (times[0] / STATE_UNIT - states[0]) / p[PUMP_LAG]
        out[RATE_BY_STATE] = -1.0 / p[PUMP_LAG]
    out[OWN] = sense * speed * p[PER_PRESSURE] * ripple


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def resistance(p, t, angle, speed, times, states, out):
    """Write a resistance; ``p``: T_0, c, k, w_0; ``times[0]``: f(t)."""
    bend = np.tanh(speed / p[3])
    dry = p[0] * times[0]
    out[TORQUE] = -(dry * bend + p[1] * speed + p[2] * speed * abs(speed))
    out[BY_SPEED] = -(dry * (1.0 - bend * bend) / p[3] + p[1] + 2.0 * p[2] * abs(speed))
    out[LOST] = -out[TORQUE] * speed


@njit("UniTuple(float64, 2)(float64[::1], int64, int64, float64)", cache=True, nogil=True, error_model="numpy")
def hermite(p, at, n, x):
    """Return value and slope at x of a piecewise cubic: abscissae, values and slopes from ``p[at]`` on, n each.

    Beyond its ends it goes on along its tangents.
    """
    if x <= p[at]:
        return p[at + n] + p[at + 2 * n] * (x - p[at]), p[at + 2 * n]
    last = at + n - 1
    if x >= p[last]:
        return p[last + n] + p[last + 2 * n] * (x - p[last]), p[last + 2 * n]
    low, high = at, last
    while high - low > 1:
        middle = (low + high) // 2
        if p[middle] <= x:
            low = middle
        else:
            high = middle
    h = p[high] - p[low]
    u = (x - p[low]) / h
    rise = p[high + n] - p[low + n]
    d0, d1 = h * p[low + 2 * n], h * p[high + 2 * n]
    b, c = 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
    return p[low + n] + u * (d0 + u * (b + u * c)), (d0 + u * (2.0 * b + 3.0 * u * c)) / h


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def table(p, t, angle, speed, times, states, out):
    """Write a torque by a table; ``p``: sense, period in angle (0: over speed), n, then the points.

    ``times[0]`` multiplies it. The torque is that about the sense of rotation: positive values drive.
    """
    n = np.int64(p[2])
    if p[1] > 0.0:
        x = p[0] * angle
        x -= p[1] * np.floor((x - p[3]) / p[1])
        value, slope = hermite(p, 3, n, x)
        out[BY_ANGLE] = times[0] * slope
    else:
        value, slope = hermite(p, 3, n, p[0] * speed)
        out[BY_SPEED] = times[0] * slope
    out[TORQUE] = p[0] * times[0] * value


FREE, LINEAR, CUBIC, DAMPING, BAND, DEPTH, MORE, SECOND, WIDTH = range(9)
"""Parameters: a_0, k_1, k_3, c, b/2, depth of the damping, k_2 - k_1, d_2, width of the transition."""


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def clutch(p, t, angle, speed, times, states, out):
    """Write an elastic clutch's torque."""
    twist = angle - p[FREE]
    out[OWN] = twist
    side = 1.0 if twist >= 0.0 else -1.0
    d = side * twist - p[BAND]
    if d <= 0.0 and p[BAND] > 0.0:
        return
    elastic = p[LINEAR] * d + p[CUBIC] * d**3
    tangent = p[LINEAR] + 3.0 * p[CUBIC] * d * d
    energy = 0.5 * p[LINEAR] * d * d + 0.25 * p[CUBIC] * d**4
    beyond = d - p[SECOND]
    if p[MORE] != 0.0 and beyond > 0.0:
        if beyond < p[WIDTH]:
            part, slope, area = beyond**2 / (2.0 * p[WIDTH]), beyond / p[WIDTH], beyond**3 / (6.0 * p[WIDTH])
        else:
            part, slope = beyond - 0.5 * p[WIDTH], 1.0
            area = p[WIDTH] ** 2 / 6.0 + 0.5 * (beyond - p[WIDTH]) * beyond
        elastic += p[MORE] * part
        tangent += p[MORE] * slope
        energy += p[MORE] * area
    out[STORED_TORQUE] = energy
    if p[BAND] == 0.0:
        out[TORQUE] = -side * elastic - p[DAMPING] * speed
        out[BY_ANGLE] = -tangent
        out[BY_SPEED] = -p[DAMPING]
        out[LOST] = p[DAMPING] * speed * speed
        return
    closing = side * speed
    torque, by_depth, by_rate = impact(elastic, tangent, p[DAMPING], p[DEPTH], d, closing)
    out[TORQUE] = -side * torque
    out[BY_ANGLE] = -by_depth
    out[BY_SPEED] = -by_rate
    out[LOST] = (torque - elastic) * closing


LAWS = {law.__name__: law for law in (kloss, circuit, controller, pump, resistance, table, clutch)}
"""Compiled laws by their names."""


# The kernel of all torques about a shaft's axis: geometry here, the law of the torque through an address.
#
# With the counted angle a of marker I about z_J, the relative speed w = (w_I - w_J) . z_J and one state z at most, a
# law gives T(t, a, w, z) and z' = R(t, a, w, z) with their partial derivatives. The torque on I's body is N = T z_J,
# and
#
#     dN = z_J dT + dpi_J x N,    dT = T_a da + T_w dw + T_z dz,
#     dw = z_J . (dw_I - dw_J) + dpi_J . (z_J x (w_I - w_J)).


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
    for q in range(min(RATE - ints[FIRST_DIAGNOSTIC], diagnostics.size)):
        diagnostics[q] = out[ints[FIRST_DIAGNOSTIC] + q]
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


@dataclass(eq=False, repr=False)
class ShaftTorque(ForceElement):
    """Torque T(t, angle, speed, state) on I's body about z of J, its reaction on J's body.

    Attributes
    ----------
    law : str
        One of `LAWS`, as "kloss".
    parameters : sequence of float
    times : tuple of TimeFunction
        Functions of time that the law is given.
    counts_angle : bool
        Whether the law looks at the angle of I about J.
    own_states : tuple of State
        At most one.
    own_diagnostics : tuple of Diagnostic
        Some that follow one another of: energy stored, power dissipated, one quantity of the law's own.
    first_diagnostic : int
        Place of the first of them in what the law writes: STORED_TORQUE, LOST or OWN.
    what : str
        What messages call it.
    """

    law: str
    parameters: Sequence[float] | np.ndarray
    times: tuple[TimeFunction, ...] = ()
    counts_angle: bool = False
    own_states: tuple[State, ...] = ()
    own_diagnostics: tuple[Diagnostic, ...] = field(default=())
    first_diagnostic: int = STORED_TORQUE
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
        return self.own_diagnostics

    def compiled(self) -> Compiled:
        return Compiled(
            shaft_torque,
            (len(self.times), int(self.counts_angle), self.first_diagnostic),
            self.parameters,
            ((LAWS[self.law], LAW_SIG),),
            times=self.times,
            angles=((2, self.i, self.j),) if self.counts_angle else (),
            scratch=WORK,
            given={"torque": 0} if self.law == "table" and len(self.times) == 1 else {},
        )

    def by_expressions(self, units: Units) -> tuple[Load, dict[str, tuple[str, float]]]:
        """Return the torque and its state in the function language; see `gearmbs.drivetrain.torque_text`."""
        return torque_text(self, units)

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


def on_curve(points: tuple[np.ndarray, np.ndarray, np.ndarray], x: float) -> float:
    """Return the value at x of the curve of `slopes`, as the table's kernel has it: beyond its ends on its tangents."""
    return float(hermite(np.concatenate(points), 0, points[0].size, x)[0])


def mean_of_curve(points: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    """Return the mean of a piecewise cubic by points and slopes from its first point to its last."""
    x, y, m = points
    h = np.diff(x)
    return float(np.sum(h * (y[1:] + y[:-1]) / 2.0 - h**2 * np.diff(m) / 12.0) / (x[-1] - x[0]))
