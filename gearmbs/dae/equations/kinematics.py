"""From y to the kinematics table and the marker frames."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import has_angles, update_body, update_ground
from gearmbs.dae.equations.bodies.frames import update_frame
from gearmbs.dae.equations.constraints.terms import ANGLE, dot3, gradient
from gearmbs.dae.equations.loads import expressions, time_functions
from gearmbs.dae.equations.loads.expressions import TIME, time_at
from gearmbs.dae.equations.loads.forces import FRAME_A, marker_pose
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_AXES,
    KIN_W,
    SWITCH_SINE,
    axes_and_velocity,
    best_reference,
    euler_angles,
    euler_rates,
    momentum_from_conjugate,
    put_turns,
    rotation_matrix,
)
from gearmbs.dae.problem import HISTORY_CHANGED, HOOK_SIG, KEPT, MATRIX_OUTDATED
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES
from gearmbs.kernels.structs import vector_at

# Angles of a marker about an axis of another one, counted through full turns: AX, AY and AZ of the elements.
#
# AZ is the turn of x_I from x_J towards y_J, AX and AY turn z_I likewise. Of the values that differ by full turns the
# one nearest to a reference is meant, which the hook moves along with the motion; see
# `gearmbs.dae.equations.kinematics`.


AXES = ("AX", "AY", "AZ")


@njit("float64(float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def axes_product(first, a, second, b):
    """Return the cosine between axis ``a`` of one frame and axis ``b`` of another (rows of 18)."""
    total = 0.0
    for c in range(FRAME_A, FRAME_A + 9, 3):
        total += first[c + a] * second[c + b]
    return total


@njit("float64(int64, float64[::1], float64[::1], float64)", cache=True, error_model="numpy")
def counted_angle(axis, first, second, reference):
    """Return the turn of frame ``first`` about an axis (0, 1, 2) of ``second``, the value nearest to a reference."""
    if axis == 0:
        angle = np.arctan2(-axes_product(first, 2, second, 1), axes_product(first, 2, second, 2))
    elif axis == 1:
        angle = np.arctan2(axes_product(first, 2, second, 0), axes_product(first, 2, second, 2))
    else:
        angle = np.arctan2(axes_product(first, 0, second, 1), axes_product(first, 0, second, 0))
    return angle + 2.0 * np.pi * np.round((reference - angle) / (2.0 * np.pi))


@njit("void(int64, float64[::1], float64[::1], float64[::1], int64)", cache=True, error_model="numpy")
def angle_gradient(axis, first, second, out, k):
    """Write the derivative of `counted_angle` by the rotation of ``first``; that by ``second``'s is its opposite.

    With u the axis of the first frame that is looked at, s and c the cosines of the angle's tangent s/c,
    d(u . p) = (dpi_I - dpi_J) . (u x p).
    """
    turned = 0 if axis == 2 else 2
    up = 1 if axis != 1 else 0
    sign = -1.0 if axis == 0 else 1.0
    along = turned
    s, c = sign * axes_product(first, turned, second, up), axes_product(first, turned, second, along)
    size = s * s + c * c
    for r in range(3):
        r1, r2 = (r + 1) % 3, (r + 2) % 3
        # c s' - s c' is linear in the axis that u is crossed with
        p1 = sign * c * second[FRAME_A + 3 * r1 + up] - s * second[FRAME_A + 3 * r1 + along]
        p2 = sign * c * second[FRAME_A + 3 * r2 + up] - s * second[FRAME_A + 3 * r2 + along]
        out[k + r] = (first[FRAME_A + 3 * r1 + turned] * p2 - first[FRAME_A + 3 * r2 + turned] * p1) / size


@njit(cache=True, error_model="numpy", forceinline=True)
def predict_element_angles(past, angle, extra_r):
    """Set the references to what the last values and rates let expect after a time ``past``."""
    for k in range(angle.shape[0]):
        at = angle[k, T.ANGLE_AT]
        extra_r[at] = extra_r[at + 1] + past * extra_r[at + 2]


@njit(cache=True, error_model="numpy", forceinline=True)
def track_element_angles(angle, extra_r, first, second, gradient, moving):
    """Keep the value of one angle of two frames, and its rate if ``moving``, as the last ones."""
    at = angle[T.ANGLE_AT]
    extra_r[at] = counted_angle(angle[T.ANGLE_AXIS], first, second, extra_r[at])
    extra_r[at + 1] = extra_r[at]
    extra_r[at + 2] = 0.0
    if moving:
        angle_gradient(angle[T.ANGLE_AXIS], first, second, gradient, 0)
        for c in range(3):
            extra_r[at + 2] += gradient[c] * (first[15 + c] - second[15 + c])


TURNS_OF_TWO = 2 * LANES
"""Places for sines and cosines of the angles of two bodies."""


@njit(cache=True, error_model="numpy", forceinline=True)
def update_bodies(y, at, code, body, modal, kin, partial, scratch, derivatives):
    """Fill the kinematics table from the positions and velocities in y.

    Parameters
    ----------
    y
        Unknowns.
    at, code, body : ndarray
        Places of the unknowns, Euler references, masses and inertias.
    modal, partial : ndarray
        Integrals and shapes of modal bodies, partial derivatives of their frames.
    kin : ndarray
        Kinematics table.
    scratch : ndarray
        52 places.
    derivatives : bool
        Whether the velocities' derivatives and the accelerations of elastic frames are wanted.
    """
    update_ground(kin)
    moment = vector_at(scratch, TURNS_OF_TWO, 3)
    for b in range(1, code.size):
        place = 3 * ((b - 1) % 2)
        if place == 0:
            put_turns(y, at[b, T.AT_THETA], at[min(b + 1, code.size - 1), T.AT_THETA], scratch)
        update_body(y, at[b], code[b], body[b], modal, partial, scratch, place, kin[b], moment)
    for f in range(code.size, at.shape[0]):
        update_frame(f, y, at, modal, kin, partial, scratch, derivatives)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_marker(m, marker_body, marker, kin, frame):
    """Fill one row of the marker table: arm and axes in global components."""
    row, own, out = kin[marker_body[m]], marker[m], frame[m]
    # copied out, or the compiler reads them anew after each number that is written
    xx, xy, xz = row[KIN_A], row[KIN_A + 1], row[KIN_A + 2]
    yx, yy, yz = row[KIN_A + 3], row[KIN_A + 4], row[KIN_A + 5]
    zx, zy, zz = row[KIN_A + 6], row[KIN_A + 7], row[KIN_A + 8]
    for v in range(4):
        # the arm, then the columns of a row-major matrix
        at, step = (0, 1) if v == 0 else (2 + v, 3)
        a, b, c = own[at], own[at + step], own[at + 2 * step]
        k = T.MK_ARM + 3 * v
        out[k] = xx * a + xy * b + xz * c
        out[k + 1] = yx * a + yy * b + yz * c
        out[k + 2] = zx * a + zy * b + zz * c


@njit(cache=True, error_model="numpy", forceinline=True)
def update_markers(marker_body, marker, kin, frame):
    """Fill the marker table."""
    for m in range(marker_body.size):
        update_marker(m, marker_body, marker, kin, frame)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_functions(t, tab):
    """Evaluate every function of time with two derivatives into the function table."""
    for k in range(tab.function.shape[0]):
        kind, at = tab.function[k, T.FUNCTION_KIND], tab.function[k, T.FUNCTION_OFFSET]
        if kind == time_functions.TAPE:
            row = tab.tape[at]
            i, r = row[T.TAPE_I], row[T.TAPE_R]
            time_at(row[TIME])(
                vector_at(tab.extra_i, i, row[T.TAPE_I_SIZE]),
                vector_at(tab.extra_r, r, row[T.TAPE_R_SIZE]),
                t,
                tab.fval[k],
                tab.tape_work,
            )
        else:
            f, f1, f2 = time_functions.evaluate(kind, tab.function_r, at, t)
            tab.fval[k, 0], tab.fval[k, 1], tab.fval[k, 2] = f, f1, f2


@njit(cache=True, error_model="numpy", forceinline=True)
def predict_angles(t, tab):
    """Set the references of all counted angles to what their last values and rates let expect at time t."""
    n = tab.reference.size
    past = t - tab.winding[0]
    for k in range(n):
        tab.reference[k] = tab.winding[1 + k] + past * tab.winding[1 + n + k]
    for k in range(tab.tape.shape[0]):
        m = tab.tape[k, T.TAPE_REFERENCE_SIZE]
        first = tab.tape[k, T.TAPE_REFERENCE]
        for a in range(first, first + m):
            tab.extra_r[a] = tab.extra_r[a + m] + past * tab.extra_r[a + 2 * m]
    predict_element_angles(past, tab.angle, tab.extra_r)


@njit(cache=True, error_model="numpy", forceinline=True)
def update_tables(t, y, tab, derivatives):
    """Bring bodies, markers, functions of time and expected angles up to date with t and y; see `update_bodies`."""
    update_bodies(y, tab.at, tab.code, tab.body, tab.modal, tab.kin, tab.partial, tab.scratch, derivatives)
    update_markers(tab.marker_body, tab.marker, tab.kin, tab.frame)
    update_functions(t, tab)
    predict_angles(t, tab)


@njit("float64(float64[::1], int64, float64[::1], int64)", cache=True, error_model="numpy")
def euler_component(kin_row, m, v, k):
    """Return a_m . v, the component of a spatial rotation gradient along Euler angle m."""
    return dot3(kin_row, KIN_AXES + 3 * m, v, k)


# The hook that keeps Euler angles away from their singularity and counts full turns.
#
# When sin(theta) of a body falls below the limit, the other body reference is taken, and every stored
# point of the integrator's history is rewritten in it.  Orientation, angular velocity and angular
# momentum are the same before and after, so this is a change of coordinates and not a perturbation.


@njit(cache=True, error_model="numpy")
def rewrite_point(y, b, old, new, at, kin, s):
    """Turn angles, rates and conjugate momenta of body b from one reference to the other."""
    e, th, p = at[b, T.AT_EPS], at[b, T.AT_THETA], at[b, T.AT_P]
    row = kin[b]
    rotation_matrix(y[th], y[th + 1], y[th + 2], old, row, KIN_A)
    axes_and_velocity(y[th], y[th + 1], y[e], y[e + 1], y[e + 2], kin, b)
    for c in range(3):
        s[c] = row[KIN_W + c]
    momentum_from_conjugate(kin, b, y, p, s, 3)
    euler_angles(row, KIN_A, new, y, th)
    axes_and_velocity(y[th], y[th + 1], 0.0, 0.0, 0.0, kin, b)
    euler_rates(kin, b, s, 0, y, e)
    for m in range(3):
        y[p + m] = dot3(row, KIN_AXES + 3 * m, s, 3)


TURN_OF_MATRIX = 0.3
"""Turn (rad) after which Newton's method with the old matrix would let deviations from the constraints grow."""


@njit(cache=True, error_model="numpy")
def counts_angles(tab):
    """Return whether any constraint, force element or expression counts an angle."""
    if tab.angle.shape[0] > 0:
        return True
    for k in range(tab.tape.shape[0]):
        if tab.tape[k, T.TAPE_REFERENCE_SIZE] > 0:
            return True
    for k in range(tab.term.shape[0]):
        if tab.term[k, T.TERM_TYPE] == ANGLE:
            return True
    return False


@njit(cache=True, error_model="numpy", forceinline=True)
def turns_are_counted(tab):
    """Whether some angle is counted through full turns, so that `track` has something to do."""
    counted = tab.angle.shape[0] > 0
    for k in range(tab.term.shape[0]):
        counted |= tab.term[k, T.TERM_TYPE] == ANGLE
    for k in range(tab.tape.shape[0]):
        counted |= tab.tape[k, T.TAPE_REFERENCE_SIZE] > 0
    return counted


@njit(cache=True, error_model="numpy")
def track(t, y, tab, moving):
    """Count the turns of all counted angles up to a later point, less than half a turn from where it is expected.

    That is where the last point's rates lead, if it was tracked as ``moving``, else the last point itself. The
    kinematics and marker tables must be those of the new point.
    """
    predict_angles(t, tab)
    expressions.update_references(t, y, tab, moving)
    first, second = vector_at(tab.scratch, 0, 18), vector_at(tab.scratch, 18, 18)
    for k in range(tab.angle.shape[0]):
        marker_pose(tab.angle[k, T.ANGLE_I], tab.marker_body, tab.kin, tab.frame, first, 0)
        marker_pose(tab.angle[k, T.ANGLE_J], tab.marker_body, tab.kin, tab.frame, second, 0)
        track_element_angles(tab.angle[k], tab.extra_r, first, second, vector_at(tab.scratch, 36, 3), moving)
    n = tab.reference.size
    tab.winding[0] = t
    for k in range(n):
        if tab.term[k, T.TERM_TYPE] == ANGLE:
            bi, bj = tab.marker_body[tab.term[k, T.TERM_I]], tab.marker_body[tab.term[k, T.TERM_J]]
            g, gt = vector_at(tab.scratch, 0, 12), vector_at(tab.scratch, 12, 12)
            angle, _ = gradient(
                k,
                tab.term,
                tab.fval,
                tab.reference,
                tab.marker_body,
                tab.kin,
                tab.frame,
                vector_at(tab.scratch, 24, tab.scratch.size - 24),
                g,
                gt,
            )
            rate = 0.0
            for c in range(3):
                rate += g[3 + c] * tab.kin[bi, KIN_W + c] + g[9 + c] * tab.kin[bj, KIN_W + c]
            tab.reference[k] = angle
            tab.winding[1 + k] = angle
            tab.winding[1 + n + k] = rate if moving else 0.0


@njit(HOOK_SIG, cache=True, error_model="numpy")
def hook(t, hist, npast, idata, rdata, work):
    """Switch references where due; update the reference of each counted angle.

    Return ``HISTORY_CHANGED`` after a switch, ``MATRIX_OUTDATED`` if with one more step like the last some body will
    have turned too far for the Newton matrix.
    """
    tab = T.unpack(idata, rdata, work)
    s = vector_at(tab.scratch, 0, 24)
    told = KEPT
    for b in range(1, idata[T.H_BODIES]):
        th = tab.at[b, T.AT_THETA]
        if not has_angles(tab.at[b]) or abs(np.sin(hist[0, th + 1])) >= SWITCH_SINE:
            continue
        old = tab.code[b]
        rotation_matrix(hist[0, th], hist[0, th + 1], hist[0, th + 2], old, tab.kin[b], KIN_A)
        new = best_reference(tab.kin[b], KIN_A)
        if new == old:
            continue
        told = HISTORY_CHANGED
        for row in range(npast):
            rewrite_point(hist[row], b, old, new, tab.at, tab.kin, s)
            if row > 0:
                for c in range(3):
                    turns = np.round((hist[row, th + c] - hist[row - 1, th + c]) / (2.0 * np.pi))
                    hist[row, th + c] -= 2.0 * np.pi * turns
        tab.code[b] = new
    if counts_angles(tab):
        update_bodies(hist[0], tab.at, tab.code, tab.body, tab.modal, tab.kin, tab.partial, tab.scratch, False)
        update_markers(tab.marker_body, tab.marker, tab.kin, tab.frame)
        track(t, hist[0], tab, True)
    if told == KEPT and npast > 1:
        first = idata[T.H_THETA]
        for k in range(idata[T.H_QF] - first):
            now = hist[0, first + k]
            if abs(now - tab.seen[k]) + abs(now - hist[1, first + k]) > TURN_OF_MATRIX:
                return MATRIX_OUTDATED
    return told
