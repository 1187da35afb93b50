"""Torque of electric motors over their speed: induction motors, curves, speed control.

An induction motor follows Kloss's formula or its equivalent circuit, with s = 1 - w/w_s:

    Kloss:    T = 2 T_b / (s/s_b + s_b/s),
    circuit:  T = A R_2 s / ((R_1 s + R_2)^2 + (X s)^2),    A = n p U^2 / w_e.

With an electrical lag tau the air-gap torque z is a state, tau z' = T - z. A speed controller gives

    u = k_p e + k_i z,  e = w_ref(t) - w,  T = sat(u),  z' = e + (T - u)/k_p,

where sat is the identity up to `LINEAR_SHARE` of the largest torque and rises smoothly to it beyond.

References
----------
M. Kloss, Drehmoment und Schlüpfung des Drehstrommotors, Archiv für Elektrotechnik 5 (1916) 59-87.


"""

from __future__ import annotations

import numpy as np

from gearmbs.drivetrain.torque_element import (
    BY_SPEED,
    BY_STATE,
    LAW_SIG,
    RATE,
    RATE_BY_SPEED,
    RATE_BY_STATE,
    TOLD,
    TORQUE,
)
from gearmbs.kernels.jit import njit

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
