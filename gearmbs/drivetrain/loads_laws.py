"""Torque of loads: displacement pumps, brakes, fans, drag, and tables over speed or angle.

Pump, with the pressure difference p(t) itself or behind a lag, tau z' = p(t) - z:

    T = -sigma [V_g p / (2 pi eta) (1 + sum_k a_k cos(k Z (a - a_0))) + T_0 tanh(sigma w / w_0) + c sigma w],

resistance of brakes, fans and drag:

    T = -[T_0 f(t) tanh(w/w_0) + c w + k w |w|].


"""

from __future__ import annotations

import numpy as np

from gearmbs.drivetrain.torque_element import (
    BY_ANGLE,
    BY_SPEED,
    BY_STATE,
    LAW_SIG,
    LOST,
    RATE,
    RATE_BY_STATE,
    TOLD,
    TORQUE,
)
from gearmbs.kernels.jit import njit

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
