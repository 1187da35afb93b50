"""The hook that keeps Euler angles away from their singularity and counts full turns.

When sin(theta) of a body falls below the limit, the other body reference is taken, and every stored
point of the integrator's history is rewritten in it.  Orientation, angular velocity and angular
momentum are the same before and after, so this is a change of coordinates and not a perturbation.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import vector_at
from gearmbs.dae.equations import expression_loads
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import ANGLE, dot3, gradient
from gearmbs.dae.equations.counted_angles import track_element_angles
from gearmbs.dae.equations.forces import marker_pose
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
    rotation_matrix,
)
from gearmbs.dae.equations.update import predict_angles, update_bodies, update_markers
from gearmbs.dae.problem import HISTORY_CHANGED, HOOK_SIG, KEPT, MATRIX_OUTDATED


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
    expression_loads.update_references(t, y, tab, moving)
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
        if abs(np.sin(hist[0, th + 1])) >= SWITCH_SINE:
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
