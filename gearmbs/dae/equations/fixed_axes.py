"""Bodies that turn about fixed axes, each with its angle as the only coordinate: motion and residual.

Where a body's only joint is a revolute joint on the ground, every permitted motion is a turn phi about the joint's axis
n through a point C. With rho = R - C, eq. (5) projected on that turn is

    J omega' - n . [ sum_k (N_k + (P_k - C) x F_k) + rho x m g ] = 0,      J = n . (A J_b A^T n) + m |n x rho|^2
    omega - phi' = 0

in the unknowns y = [omega, phi, z]. Constraint forces do no work in the turn and drop out; so do R, theta and the
multipliers, and Phi = 0 holds exactly. F and N are not unknowns but evaluated in place. A body whose turn a motion
prescribes has no unknowns at all: phi = f(t) - f(t0).

The tables are those of the model with all six coordinates, in which places of z are those in this y. Behind them
stand, in ``idata``, the table of the axes (columns ``AXIS_*``, body b in row b - 1), the markers that anything looks
at, the slots of the Jacobian and the three counts; in ``rdata`` the columns ``TURN_*`` of each axis.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import matrix_at, uncounted, vector_at
from gearmbs.dae.equations import expression_loads
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import cross3, dot3
from gearmbs.dae.equations.euler_switch import counts_angles, track
from gearmbs.dae.equations.forces import evaluate_element
from gearmbs.dae.equations.residual import S_VECTOR, S_WRENCH, add_own_states
from gearmbs.dae.equations.rotation import KIN_A, KIN_FORCE, KIN_R, KIN_V, KIN_W
from gearmbs.dae.equations.update import predict_angles, update_functions, update_ground, update_marker
from gearmbs.dae.problem import HOOK_SIG, KEPT, RESIDUAL_SIG

AXIS_OMEGA = 0
"""Index in y of the angular velocity, -1 where a motion prescribes the turn."""
AXIS_PHI = 1
"""Index in y of the angle, likewise."""
AXIS_FUNCTION = 2
"""Function of time that prescribes the turn, or -1."""
AXIS_COLUMNS = 3

TURN_AXIS = 0
"""Direction n, global."""
TURN_POINT = 3
"""Point C of the axis, global, m."""
TURN_INERTIA = 6
"""J about the axis, kg m^2."""
TURN_MASS = 7
TURN_SENSE = 8
"""Turn of the body by a unit of its function of time: 1 or -1."""
TURN_START = 9
"""Value of the function where phi is zero."""
TURN_ARM = 10
"""rho = a + b cos(phi) + c sin(phi): three vectors."""
TURN_MATRIX = 19
"""A = a + b cos(phi) + c sin(phi): three matrices, row-major."""
TURN_COLUMNS = 46

COUNTS = 3
"""Integers at the end of ``idata``: number of markers looked at, of slots, of axes."""


@njit(cache=True, error_model="numpy", forceinline=True)
def axes_in(idata, rdata):
    """Return the views of the axes, of the markers looked at, of the slots and of the axes' reals."""
    end = idata.size - COUNTS
    markers, slots, axes = idata[end], idata[end + 1], idata[end + 2]
    first = end - slots - markers - AXIS_COLUMNS * axes
    return (
        matrix_at(idata, first, axes, AXIS_COLUMNS),
        vector_at(idata, end - slots - markers, markers),
        vector_at(idata, end - slots, slots),
        matrix_at(rdata, rdata.size - TURN_COLUMNS * axes, axes, TURN_COLUMNS),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def turn_body(k, y, axes, turns, fval, kin):
    """Fill the kinematics of body k + 1 at the unknowns y, or where its motion has it."""
    turn, row = turns[k], kin[k + 1]
    if axes[k, AXIS_PHI] >= 0:
        phi, omega = y[axes[k, AXIS_PHI]], y[axes[k, AXIS_OMEGA]]
    else:
        function = axes[k, AXIS_FUNCTION]
        phi = turn[TURN_SENSE] * (fval[function, 0] - turn[TURN_START])
        omega = turn[TURN_SENSE] * fval[function, 1]
    c, s = np.cos(phi), np.sin(phi)
    for q in range(9):
        at = TURN_MATRIX + q
        row[KIN_A + q] = turn[at] + c * turn[at + 9] + s * turn[at + 18]
    for q in range(3):
        at = TURN_ARM + q
        row[KIN_R + q] = turn[at] + c * turn[at + 3] + s * turn[at + 6]
        row[KIN_W + q] = omega * turn[TURN_AXIS + q]
    cross3(row, KIN_W, row, KIN_R, row, KIN_V)
    for q in range(3):
        row[KIN_R + q] += turn[TURN_POINT + q]


@njit(cache=True, error_model="numpy", forceinline=True)
def update_axes(t, y, axes, markers, turns, tab):
    """Bring functions of time, bodies, the markers looked at and expected angles up to date with t and y."""
    update_functions(t, tab)
    update_ground(tab.kin)
    for k in range(axes.shape[0]):
        turn_body(k, y, axes, turns, tab.fval, tab.kin)
    for q in range(markers.size):
        update_marker(markers[q], tab.marker_body, tab.marker, tab.kin, tab.frame)
    predict_angles(t, tab)


@njit(cache=True, error_model="numpy", forceinline=True)
def lever(k, marker, turns, tab, s):
    """Write n x (P - C) for the origin P of a marker and the axis of body k + 1 to ``s[3:6]``; ``s[0:3]`` is used."""
    body = tab.kin[tab.marker_body[marker]]
    for c in range(3):
        s[c] = body[KIN_R + c] + tab.frame[marker, T.MK_ARM + c] - turns[k, TURN_POINT + c]
    cross3(turns[k], TURN_AXIS, s, 0, s, 3)


@njit(cache=True, error_model="numpy", forceinline=True)
def weight_moment(k, turns, tab, s):
    """Return the moment of the weight of body k + 1 about its axis, and its derivative by the angle."""
    turn, body = turns[k], tab.kin[k + 1]
    for c in range(3):
        s[c] = body[KIN_R + c] - turn[TURN_POINT + c]
    cross3(turn, TURN_AXIS, s, 0, s, 3)
    cross3(turn, TURN_AXIS, s, 3, s, 6)
    return turn[TURN_MASS] * dot3(s, 3, tab.gravity, 0), turn[TURN_MASS] * dot3(s, 6, tab.gravity, 0)


@njit(cache=True, error_model="numpy", forceinline=True)
def add_moments(row, wrench, axes, turns, tab):
    """Add the moments of a force element about the axes to what is collected; J's body feels the opposite."""
    s = vector_at(tab.scratch, S_VECTOR, 9)
    for side in range(2):
        k = tab.marker_body[row[T.FORCE_I + side]] - 1
        if k < 0 or axes[k, AXIS_OMEGA] < 0:
            continue
        moment = 0.0
        if row[T.FORCE_F] >= 0:
            lever(k, row[T.FORCE_I], turns, tab, s)
            moment = dot3(s, 3, wrench, 0)
        if row[T.FORCE_N] >= 0:
            moment += dot3(turns[k], TURN_AXIS, wrench, 3)
        tab.kin[k + 1, KIN_FORCE] += moment if side == 0 else -moment


@njit(RESIDUAL_SIG, cache=True, error_model="numpy")
def axes_residual(t, y, yp, out, idata, rdata, work):
    """Evaluate the residual of bodies that turn about fixed axes into ``out``."""
    y, yp, out, idata, rdata = uncounted(y), uncounted(yp), uncounted(out), uncounted(idata), uncounted(rdata)
    tab = T.unpack(idata, rdata, work)
    axes, markers, _, turns = axes_in(idata, rdata)
    update_axes(t, y, axes, markers, turns, tab)
    for k in range(axes.shape[0]):
        tab.kin[k + 1, KIN_FORCE] = 0.0
    for f in range(idata[T.H_FORCES]):
        row = tab.force[f]
        if row[T.FORCE_KIND] == T.COMPILED:
            if row[T.FORCE_PART] == 0:
                evaluate_element(row, t, y, tab, np.int64(0))
                add_own_states(row, y, yp, idata, tab.state, tab.scratch, out)
            wrench = vector_at(tab.scratch, row[T.FORCE_WORK] + 6 * row[T.FORCE_PART], 6)
        else:
            wrench = vector_at(tab.scratch, S_WRENCH, 6)
            jac = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, row[T.FORCE_WIDTH])
            expression_loads.load(row, t, y, tab, wrench, jac, np.int64(0))
        add_moments(row, wrench, axes, turns, tab)
    s = vector_at(tab.scratch, S_VECTOR, 9)
    for k in range(axes.shape[0]):
        omega, phi = axes[k, AXIS_OMEGA], axes[k, AXIS_PHI]
        if omega >= 0:
            weight, _ = weight_moment(k, turns, tab, s)
            out[omega] = turns[k, TURN_INERTIA] * yp[omega] - tab.kin[k + 1, KIN_FORCE] - weight
            out[phi] = y[omega] - yp[phi]
    for k in range(idata[T.H_STATES]):
        z = idata[T.H_Z] + k
        if tab.state[k, T.STATE_TAPE] < 0:
            continue
        left = yp[z] if tab.state[k, T.STATE_KIND] == T.STATE_DIFFERENTIAL else y[z]
        out[z] = left - expression_loads.value(tab.state[k, T.STATE_TAPE], t, y, tab)


@njit(HOOK_SIG, cache=True, error_model="numpy")
def axes_hook(t, hist, npast, idata, rdata, work):
    """Update the reference of each counted angle; coordinates never change."""
    tab = T.unpack(idata, rdata, work)
    axes, markers, _, turns = axes_in(idata, rdata)
    if counts_angles(tab):
        update_axes(t, hist[0], axes, markers, turns, tab)
        track(t, hist[0], tab, True)
    return KEPT
