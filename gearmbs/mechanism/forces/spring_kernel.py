"""Kernels of springs with dampers between two markers: along their line, about an axis, and by full matrices.

With d = P_I - P_J, l = |d|, e = d/l and u = v_I - v_J the force is F = f e,

    f = f_0 - k (l - l_0) - c u . e,    dF = e df + (f/l) (1 - e e^T) dd,
    df = -k e . dd - c (e . du + (u - (u . e) e) . dd / l),

and the torque about the z axis of J is N = f z, with the counted angle a of I about it and w = w_I - w_J

    f = f_0 - k (a - a_0) - c w . z,    dN = z df + dpi_J x N.

Bushings, fields and beams have full matrices. In the axes a_k of J, with s = v_I - v_J - w_J x d, the velocity seen
from J,

    [F, N]_J = preload - K (q - free) - C q',    q = [d . a_k, AX, AY, AZ],    q' = [s . a_k, w . a_k],

the angles counted; rotations are meant to be small, so q' is not the derivative of all of q.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations.kinematics import angle_gradient, counted_angle
from gearmbs.dae.equations.loads.forces import DERIVATIVES, FORCE_SIG, FRAME_A, FRAME_P, FRAME_V, FRAME_W
from gearmbs.kernels.jit import njit

STIFFNESS = 0
DAMPING = 1
FREE = 2
"""Length or angle at which the load is the preload."""
PRELOAD = 3

MATRIX_STIFFNESS = 0
"""K, row-major, in the reals; then C, free and preload."""
MATRIX_DAMPING = 36
MATRIX_FREE = 72
MATRIX_PRELOAD = 78
REALS = 84

SHIFT = 0
"""In the scratch: q, then q', each of six."""
RATE = 6
LOCAL = 12
"""F and N in the axes of J."""
DISTANCE = 18
"""d, s, w and w_J, each of three."""
SEEN = 21
SPIN = 24
BASE = 27
SLOPES = 30
"""Derivatives of q, then of q', (6, 24) each."""
WORK = SLOPES + 2 * 144


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


@njit(cache=True, error_model="numpy")
def measure(ints, frames, inputs, reals, work):
    """Write q - free, q' and the vectors they are made of; angles without a place among the inputs stay zero."""
    for c in range(3):
        work[DISTANCE + c] = frames[0, FRAME_P + c] - frames[1, FRAME_P + c]
        work[SPIN + c] = frames[0, FRAME_W + c] - frames[1, FRAME_W + c]
        work[BASE + c] = frames[1, FRAME_W + c]
    for c in range(3):
        c1, c2 = (c + 1) % 3, (c + 2) % 3
        work[SEEN + c] = frames[0, FRAME_V + c] - frames[1, FRAME_V + c]
        work[SEEN + c] -= work[BASE + c1] * work[DISTANCE + c2] - work[BASE + c2] * work[DISTANCE + c1]
    for k in range(3):
        shift, rate, spin = 0.0, 0.0, 0.0
        for c in range(3):
            axis = frames[1, FRAME_A + 3 * c + k]
            shift += axis * work[DISTANCE + c]
            rate += axis * work[SEEN + c]
            spin += axis * work[SPIN + c]
        work[SHIFT + k] = shift - reals[MATRIX_FREE + k]
        work[RATE + k], work[RATE + 3 + k] = rate, spin
        work[SHIFT + 3 + k] = 0.0
        if ints[k] >= 0:
            work[SHIFT + 3 + k] = counted_angle(k, frames[0], frames[1], inputs[ints[k]]) - reals[MATRIX_FREE + 3 + k]


@njit(cache=True, error_model="numpy")
def measure_slopes(ints, frames, work):
    """Write the derivatives of q and q' by the variations of both frames."""
    for k in range(SLOPES, WORK):
        work[k] = 0.0
    for k in range(3):
        shift, turn = SLOPES + 24 * k, SLOPES + 24 * (3 + k)
        rate, spin = SLOPES + 144 + 24 * k, SLOPES + 144 + 24 * (3 + k)
        for c in range(3):
            c1, c2 = (c + 1) % 3, (c + 2) % 3
            a = frames[1, FRAME_A + 3 * c + k]
            a1, a2 = frames[1, FRAME_A + 3 * c1 + k], frames[1, FRAME_A + 3 * c2 + k]
            # d . (dpi x a) = dpi . (a x d), and so on
            work[shift + c], work[shift + 12 + c] = a, -a
            work[shift + 15 + c] = a1 * work[DISTANCE + c2] - a2 * work[DISTANCE + c1]
            away = a1 * work[BASE + c2] - a2 * work[BASE + c1]
            work[rate + c], work[rate + 12 + c] = -away, away
            work[rate + 6 + c], work[rate + 18 + c] = a, -a
            work[rate + 15 + c] = a1 * work[SEEN + c2] - a2 * work[SEEN + c1]
            work[rate + 21 + c] = work[shift + 15 + c]
            work[spin + 9 + c], work[spin + 21 + c] = a, -a
            work[spin + 15 + c] = a1 * work[SPIN + c2] - a2 * work[SPIN + c1]
        if ints[k] >= 0:
            angle_gradient(k, frames[0], frames[1], work, turn + 3)
            for c in range(3):
                work[turn + 15 + c] = -work[turn + 3 + c]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def matrix_force(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write F and N of a bushing, field or beam.

    Arguments as in `gearmbs.dae.equations.loads.forces`; ``ints`` holds the places of the references
    of AX, AY and AZ among the inputs, or -1.
    """
    measure(ints, frames, inputs, reals, work)
    for r in range(6):
        load = reals[MATRIX_PRELOAD + r]
        for k in range(6):
            load -= reals[MATRIX_STIFFNESS + 6 * r + k] * work[SHIFT + k]
            load -= reals[MATRIX_DAMPING + 6 * r + k] * work[RATE + k]
        work[LOCAL + r] = load
    for b in range(0, 6, 3):
        for c in range(3):
            for k in range(3):
                wrench[0, b + c] += frames[1, FRAME_A + 3 * c + k] * work[LOCAL + b + k]
    if not want & DERIVATIVES:
        return
    measure_slopes(ints, frames, work)
    for b in range(0, 6, 3):
        for k in range(3):
            r = b + k
            for m in range(6):
                stiffness, damping = reals[MATRIX_STIFFNESS + 6 * r + m], reals[MATRIX_DAMPING + 6 * r + m]
                if stiffness == 0.0 and damping == 0.0:
                    continue
                for q in range(24):
                    slope = stiffness * work[SLOPES + 24 * m + q] + damping * work[SLOPES + 144 + 24 * m + q]
                    for c in range(3):
                        jac[b + c, q] -= frames[1, FRAME_A + 3 * c + k] * slope
        for c in range(3):
            # dpi_J x F, dpi_J x N
            jac[b + (c + 1) % 3, 15 + (c + 2) % 3] += wrench[0, b + c]
            jac[b + (c + 2) % 3, 15 + (c + 1) % 3] -= wrench[0, b + c]
