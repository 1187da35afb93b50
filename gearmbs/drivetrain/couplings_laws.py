"""Torque of elastic couplings and clutches over their twist.

With the twist p = a - a_0, the compression d = |p| - b/2 beyond a dead band b and the side sigma = sign p,

    e(d) = k_1 d + k_3 d^3 + (k_2 - k_1) B(d - d_2),    T = -sigma max(0, e + c S(d) d'),    d' = sigma w,

where B rises from 0 to the line d - d_2 over a width (stages join with a continuous tangent) and S is the STEP of the
damping over a depth behind the dead band. Without a dead band T = -sigma e - c w, which may also damp against the
spring; with one a side that has let go never pulls.


"""

from __future__ import annotations

from gearmbs.dae.equations.loads.forces import impact
from gearmbs.drivetrain.torque_element import BY_ANGLE, BY_SPEED, LAW_SIG, LOST, STORED_TORQUE, TOLD, TORQUE
from gearmbs.kernels.jit import njit

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
