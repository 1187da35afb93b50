"""Kernels of springs with dampers: along the line between two markers, and about an axis.

With d = P_I - P_J, l = |d|, e = d/l and u = v_I - v_J the force is F = f e,

    f = f_0 - k (l - l_0) - c u . e,    dF = e df + (f/l) (1 - e e^T) dd,
    df = -k e . dd - c (e . du + (u - (u . e) e) . dd / l),

and the torque about the z axis of J is N = f z, with the counted angle a of I about it and w = w_I - w_J

    f = f_0 - k (a - a_0) - c w . z,    dN = z df + dpi_J x N.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.kinematics.update import angle_gradient, counted_angle
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.jit import njit

STIFFNESS = 0
DAMPING = 1
FREE = 2
"""Length or angle at which the load is the preload."""
PRELOAD = 3


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def line_spring(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the force along the line from J to I; nothing where the markers coincide.

    Arguments as in `gearmbs.dae.equations.loads.forces`; there are no inputs.
    """
    k, c, preload = reals[STIFFNESS], reals[DAMPING], reals[PRELOAD]
    dx, dy, dz = (
        frames[0, FRAME_P] - frames[1, FRAME_P],
        frames[0, FRAME_P + 1] - frames[1, FRAME_P + 1],
        frames[0, FRAME_P + 2] - frames[1, FRAME_P + 2],
    )
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    if length == 0.0:
        return
    e = work[0:3]
    e[0], e[1], e[2] = dx / length, dy / length, dz / length
    u = work[3:6]
    along = 0.0
    for q in range(3):
        u[q] = frames[0, FRAME_V + q] - frames[1, FRAME_V + q]
        along += u[q] * e[q]
    f = preload - k * (length - reals[FREE]) - c * along
    for q in range(3):
        wrench[0, q] = f * e[q]
    if not want & DERIVATIVES:
        return
    for q in range(3):
        slope = -k * e[q] - c * (u[q] - along * e[q]) / length
        for r in range(3):
            across = ((1.0 if r == q else 0.0) - e[r] * e[q]) * f / length
            jac[r, q] = e[r] * slope + across
            jac[r, 6 + q] = -c * e[r] * e[q]
            jac[r, 12 + q] = -jac[r, q]
            jac[r, 18 + q] = -jac[r, 6 + q]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def axis_spring(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the torque about the z axis of J.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the only input is
    the reference of the counted angle AZ.
    """
    k, c, preload = reals[STIFFNESS], reals[DAMPING], reals[PRELOAD]
    z, w = work[0:3], work[3:6]
    speed = 0.0
    for q in range(3):
        z[q] = frames[1, FRAME_A + 3 * q + 2]
        w[q] = frames[0, FRAME_W + q] - frames[1, FRAME_W + q]
        speed += w[q] * z[q]
    f = preload - k * (counted_angle(2, frames[0], frames[1], inputs[0]) - reals[FREE]) - c * speed
    for q in range(3):
        wrench[0, 3 + q] = f * z[q]
    if not want & DERIVATIVES:
        return
    angle_gradient(2, frames[0], frames[1], work, 6)
    for q in range(3):
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        turn = -k * work[6 + q]
        # w . (dpi_J x z) = dpi_J . (z x w)
        axis = -c * (z[q1] * w[q2] - z[q2] * w[q1])
        for r in range(3):
            jac[3 + r, 3 + q] = z[r] * turn
            jac[3 + r, 9 + q] = -c * z[r] * z[q]
            jac[3 + r, 15 + q] = z[r] * (axis - turn)
            jac[3 + r, 21 + q] = c * z[r] * z[q]
    for q in range(3):
        # dpi_J x N
        q1, q2 = (q + 1) % 3, (q + 2) % 3
        jac[3 + q1, 15 + q2] += wrench[0, 3 + q]
        jac[3 + q2, 15 + q1] -= wrench[0, 3 + q]
