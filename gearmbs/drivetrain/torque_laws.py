"""Compiled laws of torques about a shaft's axis; `gearmbs.drivetrain.torque_element` calls them.

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

import numpy as np
from numba import types

from gearmbs.dae.equations.loads.forces import impact
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import F8, VEC

LAW_SIG = types.void(VEC, F8, F8, F8, VEC, VEC, VEC)
"""law(parameters, t, angle, speed, times, states, out); angle in rad, speed in rad/s."""

TORQUE, BY_ANGLE, BY_SPEED, BY_STATE = 0, 1, 2, 3
"""Places in ``out``: the torque on I (N m) and its derivatives."""
STORED_TORQUE, LOST, TOLD = 4, 5, 6
"""Energy stored (J), power dissipated (W), and one quantity of the law's own."""
RATE, RATE_BY_ANGLE, RATE_BY_SPEED, RATE_BY_STATE = 7, 8, 9, 10
"""The state's rate and its derivatives."""
OUT_SIZE = 11

LINEAR_SHARE = 0.8
"""Part of the largest torque up to which a controller's torque is what it asks for."""

SENSE, SYNCHRONOUS, LAG = 0, 1, 2
"""Parameters of induction motors: sense of rotation, synchronous speed (rad/s), lag (s); then those of the law."""


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
    out[TOLD] = s


@njit(LAW_SIG, cache=True, nogil=True, error_model="numpy")
def circuit(p, t, angle, speed, times, states, out):
    """Equivalent circuit; ``p[3:7]``: A (V^2 s/rad), R_1, R_2, X = X_1 + X_2 (ohm)."""
    s = 1.0 - p[SENSE] * speed / p[SYNCHRONOUS]
    stator = p[4] * s + p[5]
    size = stator * stator + p[6] * p[6] * s * s
    value = p[3] * p[5] * s / size
    slope = p[3] * p[5] * (p[5] * p[5] - (p[4] * p[4] + p[6] * p[6]) * s * s) / (size * size)
    _induction(p, value, slope, times[0], states, out)
    out[TOLD] = s


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
    out[TOLD] = error


PUMP_SENSE, PER_PRESSURE, IDLE, VISCOUS, PUMP_SMOOTH, PUMP_TEETH, PUMP_START, PUMP_LAG, EFFICIENCY = range(9)
"""Parameters of a pump: sense, V_g/2pi (m^3/rad), T_0, c, w_0, Z, a_0, lag, eta; then a_1, a_2, ..."""

STATE_UNIT = 1e6
"""Pa in a unit of the state z, which is in MPa: errors of states are controlled absolutely."""


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
    out[TOLD] = sense * speed * p[PER_PRESSURE] * ripple


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
    out[TOLD] = twist
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
