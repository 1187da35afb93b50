"""Kernels of springs with dampers between two markers: along their line, about an axis, and by full matrices.

The laws are those of `gearmbs.mechanism.forces.definitions`. With d = P_I - P_J, l = |d| and u = v_I - v_J the force
of a spring is F = f d/l, f = f_0 - k (l - l_0) - c u . d/l; the torque about the z axis of J, with the counted angle a
of I about it, N = f z, f = f_0 - k (a - a_0) - c (w_I - w_J) . z.

Bushings, fields and beams have full matrices. In the axes a_k of J, with s = v_I - v_J - w_J x d, the velocity seen
from J,

    [F, N]_J = preload - K (q - free) - C q',    q = [d . a_k, AX, AY, AZ],    q' = [s . a_k, w . a_k],

the angles counted; rotations are meant to be small, so q' is not the derivative of all of q.
"""

from __future__ import annotations

from gearmbs.dae.equations.kinematics import angle_gradient, counted_angle
from gearmbs.dae.equations.loads.forces import CHANGED_SIG, DERIVATIVES, FORCE_SIG, FRAME_A
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at
from gearmbs.mechanism.forces import derived as D

MATRIX_STIFFNESS = 0
"""K, row-major, in the reals; then C, free and preload."""
MATRIX_DAMPING = 36
MATRIX_FREE = 72
MATRIX_PRELOAD = 78
REALS = 84

SEEN = 0
"""In the scratch: displacements, velocities and angular velocities of I in the axes of J, each of three."""
SHIFT = 9
"""q - free, then q', each of six."""
RATE = 15
LOCAL = 21
"""F and N in the axes of J."""
SLOPES = 27
"""Derivatives of what is seen, (9, 24), then of the angles, (3, 24), each row a frame's and the other's variations."""
WORK = SLOPES + 12 * 24


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def line_spring(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the force along the line from J to I; nothing where the markers coincide.

    Arguments as in `gearmbs.dae.equations.loads.forces`; there are no inputs.
    """
    one, two = frames[0], frames[1]
    if one[0] == two[0] and one[1] == two[1] and one[2] == two[2]:
        return
    D.line_load(one, two, reals, wrench)
    if want & DERIVATIVES:
        D.line_slopes(one, two, reals, jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def line_spring_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write the derivative of the force along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    one, two = frames[0], frames[1]
    if one[0] == two[0] and one[1] == two[1] and one[2] == two[2]:
        return
    D.line_changed(one, two, reals, changed, out)


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def axis_spring(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write the torque about the z axis of J.

    Arguments as in `gearmbs.dae.equations.loads.forces`; the only input is the reference of the counted angle AZ.
    """
    one, two = frames[0], frames[1]
    angle = counted_angle(2, one, two, inputs[0])
    D.axis_load(one, two, reals, angle, wrench)
    if want & DERIVATIVES:
        angle_gradient(2, one, two, work, 0)
        D.axis_slopes(one, two, reals, angle, work[0], work[1], work[2], jac)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def axis_spring_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write the derivative of the torque along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    one, two = frames[0], frames[1]
    D.axis_changed(one, two, reals, counted_angle(2, one, two, inputs[0]), changed, out)


@njit(CHANGED_SIG, cache=True, nogil=True, error_model="numpy")
def matrix_force_changed(ints, reals, changed, frames, states, inputs, work, out):
    """Write the derivatives of F and N along a change of the reals.

    Arguments as of `CHANGED_SIG` in `gearmbs.dae.equations.loads.forces`.
    """
    see(ints, reals, frames, inputs, work)
    for r in range(6):
        load = changed[MATRIX_PRELOAD + r]
        for k in range(6):
            load -= changed[MATRIX_STIFFNESS + 6 * r + k] * work[SHIFT + k]
            load += reals[MATRIX_STIFFNESS + 6 * r + k] * changed[MATRIX_FREE + k]
            load -= changed[MATRIX_DAMPING + 6 * r + k] * work[RATE + k]
        work[LOCAL + r] = load
    for b in range(0, 6, 3):
        for c in range(3):
            for k in range(3):
                out[b + c] += frames[1, FRAME_A + 3 * c + k] * work[LOCAL + b + k]


@njit(cache=True, error_model="numpy", forceinline=True)
def see(ints, reals, frames, inputs, work):
    """Write what a bushing, field or beam sees of I: q - free at `SHIFT`, q' at `RATE`."""
    one, two = frames[0], frames[1]
    D.shifts(one, two, work)
    for k in range(3):
        work[SHIFT + k] = work[SEEN + k] - reals[MATRIX_FREE + k]
        work[SHIFT + 3 + k] = 0.0
        if ints[k] >= 0:
            work[SHIFT + 3 + k] = counted_angle(k, one, two, inputs[ints[k]]) - reals[MATRIX_FREE + 3 + k]
    for k in range(6):
        work[RATE + k] = work[SEEN + 3 + k]


@njit(FORCE_SIG, cache=True, nogil=True, error_model="numpy")
def matrix_force(ints, reals, t, frames, states, inputs, want, work, wrench, rates, jac, diagnostics):
    """Write F and N of a bushing, field or beam.

    Arguments as in `gearmbs.dae.equations.loads.forces`; ``ints`` holds the places of the references
    of AX, AY and AZ among the inputs, or -1.
    """
    one, two = frames[0], frames[1]
    see(ints, reals, frames, inputs, work)
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
    slopes = matrix_at(work, SLOPES, 12, 24)
    slopes[:] = 0.0
    D.shift_slopes(one, two, slopes)
    for k in range(3):
        if ints[k] >= 0:
            row = SLOPES + 24 * (9 + k)
            angle_gradient(k, one, two, work, row + 3)
            for c in range(3):
                work[row + 15 + c] = -work[row + 3 + c]
    for b in range(0, 6, 3):
        for k in range(3):
            r = b + k
            for m in range(6):
                stiffness, damping = reals[MATRIX_STIFFNESS + 6 * r + m], reals[MATRIX_DAMPING + 6 * r + m]
                if stiffness == 0.0 and damping == 0.0:
                    continue
                turned = m if m < 3 else m + 6
                for q in range(24):
                    slope = stiffness * slopes[turned, q] + damping * slopes[3 + m, q]
                    for c in range(3):
                        jac[b + c, q] -= frames[1, FRAME_A + 3 * c + k] * slope
        for c in range(3):
            # dpi_J x F, dpi_J x N
            jac[b + (c + 1) % 3, 15 + (c + 2) % 3] += wrench[0, b + c]
            jac[b + (c + 2) % 3, 15 + (c + 1) % 3] -= wrench[0, b + c]
