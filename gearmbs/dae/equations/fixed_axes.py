"""Bodies that turn about fixed axes, each with its angle as the only coordinate: motion and residual.

Where a body's only joint is a revolute joint on the ground, every permitted motion is a turn phi about the joint's axis
n through a point C. With rho = R - C, eq. (5) projected on that turn is

    J omega' - n . [ sum_k (N_k + (P_k - C) x F_k) + rho x m g ] = 0,      J = n . (A J_b A^T n) + m |n x rho|^2
    omega - phi' = 0

in the unknowns y = [omega, phi, z]. Constraint forces do no work in the turn and drop out; so do R, theta and the
multipliers, and Phi = 0 holds exactly. F and N are not unknowns but evaluated in place. A body whose turn a motion
prescribes has no unknowns at all: phi = f(t) - f(t0).

An element between two such bodies may have a leaner kernel, which takes phi and omega instead of frames, see
`gearmbs.dae.equations.loads.forces`; bodies that nothing else looks at are not placed then.

The tables are those of the model with all six coordinates, in which places of z are those in this y. Behind them
stand, in ``idata``, a row ``LEAN_*`` of each force element, the table of the axes (columns ``AXIS_*``, body b in row
b - 1), the markers that anything looks at, the slots of the Jacobian and the counts; in ``rdata`` the tables of
lean kernels and the columns ``TURN_*`` of each axis.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraints.terms import cross3, dot3
from gearmbs.dae.equations.kinematics import (
    counts_angles,
    predict_angles,
    track,
    update_functions,
    update_ground,
    update_marker,
    update_markers,
)
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.loads.forces import (
    DERIVATIVES,
    LEAN_ADDRESS,
    LEAN_COLUMNS,
    LEAN_FIRST,
    evaluate_element,
    evaluate_lean,
)
from gearmbs.dae.equations.residual import S_VECTOR, S_WRENCH, add_own_states
from gearmbs.dae.equations.rotation import KIN_A, KIN_FORCE, KIN_R, KIN_V, KIN_W
from gearmbs.dae.equations.unknowns import COUNT, NUMBERS, PLACES, compressed, put
from gearmbs.dae.problem import HOOK_SIG, JACOBIAN_SIG, KEPT, RESIDUAL_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

AXIS_OMEGA = 0
"""Index in y of the angular velocity, -1 where a motion prescribes the turn."""
AXIS_PHI = 1
"""Index in y of the angle, likewise."""
AXIS_FUNCTION = 2
"""Function of time that prescribes the turn, or -1."""
AXIS_SEEN = 3
"""1 if the residual needs the place of the body, else 0."""
AXIS_COLUMNS = 4

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

S_TURNS = S_VECTOR + 30
"""Scratch of `evaluate_lean`: two angles and their rates."""
COUNTS = 4
"""Integers at the end of ``idata``: number of markers looked at, of slots, of axes; where in the work array stand the
unknowns of the last evaluation and, behind them, the slopes of the wrenches, see `keep_slopes`, -1 for nowhere."""


@njit(cache=True, error_model="numpy", forceinline=True)
def axes_in(idata, rdata):
    """Return the views of the lean elements, axes, markers looked at, slots, and of the axes' reals."""
    end = idata.size - COUNTS
    markers, slots, axes, forces = idata[end], idata[end + 1], idata[end + 2], idata[T.H_FORCES]
    first = end - slots - markers - AXIS_COLUMNS * axes
    return (
        matrix_at(idata, first - LEAN_COLUMNS * forces, forces, LEAN_COLUMNS),
        matrix_at(idata, first, axes, AXIS_COLUMNS),
        vector_at(idata, end - slots - markers, markers),
        vector_at(idata, end - slots, slots),
        matrix_at(rdata, rdata.size - TURN_COLUMNS * axes, axes, TURN_COLUMNS),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def turn_of(k, y, axes, turns, fval):
    """Return phi and omega of body k + 1 at the unknowns y, or where its motion has it."""
    if axes[k, AXIS_PHI] >= 0:
        return y[axes[k, AXIS_PHI]], y[axes[k, AXIS_OMEGA]]
    turn, function = turns[k], axes[k, AXIS_FUNCTION]
    return turn[TURN_SENSE] * (fval[function, 0] - turn[TURN_START]), turn[TURN_SENSE] * fval[function, 1]


@njit(cache=True, error_model="numpy", forceinline=True)
def turn_body(k, y, axes, turns, fval, kin):
    """Fill the kinematics of body k + 1 at the unknowns y, or where its motion has it."""
    turn, row = turns[k], kin[k + 1]
    phi, omega = turn_of(k, y, axes, turns, fval)
    # A(phi) = a + b cos(phi) + c sin(phi), by Rodrigues' formula; v = omega x rho, before C is added to rho
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
def keep_unknowns(y, idata, work):
    """Keep the unknowns of an evaluation for whoever reads what it leaves in the work array."""
    kept = idata[idata.size - 1]
    if kept >= 0:
        for i in range(y.size):
            work[kept + i] = y[i]


@njit(cache=True, error_model="numpy", forceinline=True)
def update_axes(t, y, axes, markers, turns, tab, every):
    """Bring functions of time, bodies, the markers looked at and expected angles up to date with t and y.

    ``every`` places bodies and markers, too, that the residual does not look at.
    """
    update_functions(t, tab)
    update_ground(tab.kin)
    for k in range(axes.shape[0]):
        if every or axes[k, AXIS_SEEN] != 0:
            turn_body(k, y, axes, turns, tab.fval, tab.kin)
    if every:
        update_markers(tab.marker_body, tab.marker, tab.kin, tab.frame)
    else:
        for q in range(markers.size):
            update_marker(markers[q], tab.marker_body, tab.marker, tab.kin, tab.frame)
    predict_angles(t, tab)


@njit(cache=True, error_model="numpy", forceinline=True)
def lever(k, marker, turns, tab, s):
    """Write n x (P - C) for the origin P of a marker and the axis of body k + 1 to ``s[3:6]``; ``s[0:3]`` is used."""
    body = tab.kin[tab.marker_body[marker]]
    for c in range(3):
        s[c] = body[KIN_R + c] + tab.frame[marker, T.MK_ARM + c] - turns[k, TURN_POINT + c]
    cross3(turns[k], TURN_AXIS, s, 0, s, 3)  # n . (r x F) = (n x r) . F: the lever of a force about the axis


@njit(cache=True, error_model="numpy", forceinline=True)
def weight_moment(k, axes, turns, tab, s):
    """Return the moment of the weight of body k + 1 about its axis, and its derivative by the angle."""
    turn, body = turns[k], tab.kin[k + 1]
    if axes[k, AXIS_SEEN] == 0:
        # its centre of mass is on the axis
        return 0.0, 0.0
    # n . (rho x m g) = m (n x rho) . g, which changes with phi by m (n x (n x rho)) . g
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


@njit(cache=True, error_model="numpy", forceinline=True)
def put_turns(row, y, axes, turns, tab):
    """Leave the angles of the two bodies of an element and their rates where `evaluate_lean` looks for them."""
    for side in range(2):
        k = tab.marker_body[row[T.FORCE_I + side]] - 1
        phi, omega = turn_of(k, y, axes, turns, tab.fval)
        tab.scratch[S_TURNS + side], tab.scratch[S_TURNS + 2 + side] = phi, omega


@njit(cache=True, error_model="numpy", forceinline=True)
def add_lean_moments(row, lean, rdata, axes, turns, tab):
    """Add the moments of an element with a lean kernel about its two axes; as `add_moments`."""
    wrench = vector_at(tab.scratch, row[T.FORCE_WORK], 6)
    for side in range(2):
        k = tab.marker_body[row[T.FORCE_I + side]] - 1
        if axes[k, AXIS_OMEGA] >= 0:
            moment = dot3(rdata, lean[LEAN_FIRST] + 3 * side, wrench, 0) + dot3(turns[k], TURN_AXIS, wrench, 3)
            tab.kin[k + 1, KIN_FORCE] += moment if side == 0 else -moment


@njit(RESIDUAL_SIG, cache=True, error_model="numpy")
def axes_residual(t, y, yp, out, idata, rdata, work):
    """Evaluate the residual of bodies that turn about fixed axes into ``out``."""
    y, yp, out, idata, rdata = uncounted(y), uncounted(yp), uncounted(out), uncounted(idata), uncounted(rdata)
    tab = T.unpack(idata, rdata, work)
    leans, axes, markers, _, turns = axes_in(idata, rdata)
    update_axes(t, y, axes, markers, turns, tab, False)
    keep_unknowns(y, idata, work)
    for k in range(axes.shape[0]):
        tab.kin[k + 1, KIN_FORCE] = 0.0
    for f in range(idata[T.H_FORCES]):
        row = tab.force[f]
        if leans[f, LEAN_ADDRESS] != 0:
            put_turns(row, y, axes, turns, tab)
            evaluate_lean(row, leans[f], S_TURNS, rdata, tab, row[T.FORCE_WANT])
            add_lean_moments(row, leans[f], rdata, axes, turns, tab)
            continue
        if row[T.FORCE_KIND] == T.COMPILED:
            if row[T.FORCE_PART] == 0:
                evaluate_element(row, t, y, tab, row[T.FORCE_WANT])
                add_own_states(row, y, yp, idata, tab.state, tab.scratch, out)
            wrench = vector_at(tab.scratch, row[T.FORCE_WORK] + 6 * row[T.FORCE_PART], 6)
        else:
            wrench = vector_at(tab.scratch, S_WRENCH, 6)
            jac = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, row[T.FORCE_WIDTH])
            expressions.load(row, t, y, tab, wrench, jac, np.int64(0))
        add_moments(row, wrench, axes, turns, tab)
    s = vector_at(tab.scratch, S_VECTOR, 9)
    for k in range(axes.shape[0]):
        omega, phi = axes[k, AXIS_OMEGA], axes[k, AXIS_PHI]
        if omega >= 0:
            weight, _ = weight_moment(k, axes, turns, tab, s)
            # J omega' - sum of moments - that of the weight, and omega - phi'
            out[omega] = turns[k, TURN_INERTIA] * yp[omega] - tab.kin[k + 1, KIN_FORCE] - weight
            out[phi] = y[omega] - yp[phi]
    for k in range(idata[T.H_STATES]):
        z = idata[T.H_Z] + k
        if tab.state[k, T.STATE_TAPE] < 0:
            continue
        left = yp[z] if tab.state[k, T.STATE_KIND] == T.STATE_DIFFERENTIAL else y[z]
        out[z] = left - expressions.value(tab.state[k, T.STATE_TAPE], t, y, tab)


@njit(HOOK_SIG, cache=True, error_model="numpy")
def axes_hook(t, hist, npast, idata, rdata, work):
    """Update the reference of each counted angle; coordinates never change."""
    tab = T.unpack(idata, rdata, work)
    _, axes, markers, _, turns = axes_in(idata, rdata)
    if counts_angles(tab):
        update_axes(t, hist[0], axes, markers, turns, tab, True)
        track(t, hist[0], tab, True)
    return KEPT


# The exact sparse Jacobian of bodies that turn about fixed axes, see `gearmbs.dae.equations.fixed_axes`.
#
# The kernels' derivatives are by the spatial variations [dR, dpi, dv, dw] of each body. Its angle and angular velocity
# move all of them:
#
#     d/d phi:   dR = n x rho,  dpi = n,  dv = omega n x (n x rho),  dw = 0
#     d/d omega:                          dv = n x rho,              dw = n


S_LEVER = S_VECTOR
"""Scratch of `lever` and `weight_moment`: nine places, of which n x (P - C) stays; see there."""
S_CHAIN = S_LEVER + 9
"""rho, n x rho and n x (n x rho) of the body whose columns are formed."""
S_FORCE = S_CHAIN + 9
"""(n x (P - C)) x F, by which the moment of a force changes as its point moves with its body; from 6 on six weights."""


@njit(cache=True, error_model="numpy", forceinline=True)
def prepare_chain(k, turns, tab, s):
    """Write rho, n x rho and n x (n x rho) of body k + 1 to ``s``."""
    for c in range(3):
        s[c] = tab.kin[k + 1, KIN_R + c] - turns[k, TURN_POINT + c]
    cross3(turns[k], TURN_AXIS, s, 0, s, 3)
    cross3(turns[k], TURN_AXIS, s, 3, s, 6)


@njit(cache=True, error_model="numpy", forceinline=True)
def chain(k, omega, d, at, turns, s):
    """Return the derivatives by phi and omega of body k + 1 from the spatial ones in ``d[at:]``."""
    n = turns[k]
    # dR = n x rho, dpi = n, dv = omega n x (n x rho) by phi; dv = n x rho, dw = n by omega
    by_phi = dot3(d, at, s, 3) + dot3(d, at + 3, n, TURN_AXIS) + omega * dot3(d, at + 6, s, 6)
    return by_phi, dot3(d, at + 6, s, 3) + dot3(d, at + 9, n, TURN_AXIS)


@njit(cache=True, error_model="numpy")
def weighted_entries(mode, base, rows, weights, bodies, first, unknowns, after, y, axes, turns, tab, slot, vals, k):
    """Entries of one equation from minus a weighted sum of rows of spatial derivatives.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    base : int
        Row of the entries.
    rows : ndarray, shape (m, width)
        Derivatives by the variations of bodies, 12 each, then by unknowns.
    weights : ndarray, shape (m,)
    bodies, first : int
        Number of bodies, and where among the extra integers they are.
    unknowns, after : int
        Number of unknowns, and where they are.
    y : ndarray
    axes, turns : ndarray
        Of `gearmbs.dae.equations.fixed_axes`.
    tab : Tables
        Up to date with y.
    """
    s = vector_at(tab.scratch, S_CHAIN, 9)
    for q in range(bodies):
        a = tab.extra_i[first + q] - 1
        if a < 0 or axes[a, AXIS_OMEGA] < 0:
            continue
        prepare_chain(a, turns, tab, s)
        by_phi = by_omega = 0.0
        for r in range(weights.size):
            phi, omega = chain(a, y[axes[a, AXIS_OMEGA]], rows[r], 12 * q, turns, s)
            by_phi += weights[r] * phi
            by_omega += weights[r] * omega
        k = put(mode, slot, vals, k, base, axes[a, AXIS_PHI], -by_phi)
        k = put(mode, slot, vals, k, base, axes[a, AXIS_OMEGA], -by_omega)
    for q in range(unknowns):
        total = 0.0
        for r in range(weights.size):
            total += weights[r] * rows[r, 12 * bodies + q]
        k = put(mode, slot, vals, k, base, tab.extra_i[after + q], -total)
    return k


@njit(cache=True, error_model="numpy")
def moment_entries(mode, row, wrench, rows, y, axes, turns, tab, slot, vals, k):
    """Entries of the moments of one force element about the axes of its bodies.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    row : ndarray of int
        Row of the force element.
    wrench, rows : ndarray, shapes (6,) and (6, width)
        F and N, and their spatial derivatives.
    y : ndarray
    axes, turns : ndarray
        Of `gearmbs.dae.equations.fixed_axes`.
    tab : Tables
        Up to date with y.
    """
    s, moment_rate = vector_at(tab.scratch, S_LEVER, 9), vector_at(tab.scratch, S_FORCE, 3)
    weights, point = vector_at(tab.scratch, S_FORCE + 6, 6), row[T.FORCE_I]
    depends = row[T.FORCE_DEPENDS]
    bodies = tab.extra_i[depends]
    after = depends + 2 + bodies
    has_force, has_torque = row[T.FORCE_F] >= 0, row[T.FORCE_N] >= 0
    for side in range(2):
        b = tab.marker_body[row[T.FORCE_I + side]] - 1
        if b < 0 or axes[b, AXIS_OMEGA] < 0:
            continue
        sign = 1.0 - 2.0 * side
        lever(b, point, turns, tab, s)
        for c in range(3):
            weights[c] = sign * s[3 + c] if has_force else 0.0  # (n x r) . F + n . N is a weighted sum of the six rows
            weights[3 + c] = sign * turns[b, TURN_AXIS + c] if has_torque else 0.0
        k = weighted_entries(
            mode, axes[b, AXIS_OMEGA], rows, weights, bodies, depends + 1, tab.extra_i[after - 1], after, y, axes,
            turns, tab, slot, vals, k,
        )  # fmt: skip
        owner = tab.marker_body[point] - 1
        if has_force and owner >= 0 and axes[owner, AXIS_OMEGA] >= 0:
            # the point moves with the body that it is on
            lever(owner, point, turns, tab, s)
            cross3(s, 3, wrench, 0, moment_rate, 0)
            # its lever changes by n_b . ((n_o x (P - C_o)) x F) as the owner turns
            moved = sign * dot3(turns[b], TURN_AXIS, moment_rate, 0)
            k = put(mode, slot, vals, k, axes[b, AXIS_OMEGA], axes[owner, AXIS_PHI], -moved)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def element_axis_entries(mode, t, row, y, cj, idata, axes, turns, tab, slot, vals, k):
    """Entries of one force element: of its own states, and of its moments about the axes.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    t, y, cj, idata
        As of `axes_jacobian`.
    row, axes, turns, tab
        As of `moment_entries`.
    """
    width, depends = row[T.FORCE_WIDTH], row[T.FORCE_DEPENDS]
    bodies = tab.extra_i[depends]
    after = depends + 2 + bodies
    if row[T.FORCE_KIND] != T.COMPILED:
        wrench = vector_at(tab.scratch, S_WRENCH, 6)
        rows = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, width)
        expressions.load(row, t, y, tab, wrench, rows, np.int64(1))
        return moment_entries(mode, row, wrench, rows, y, axes, turns, tab, slot, vals, k)
    if row[T.FORCE_PART] == 0:
        evaluate_element(row, t, y, tab, DERIVATIVES | row[T.FORCE_WANT])
        one = vector_at(tab.scratch, S_FORCE, 1)
        one[0] = 1.0
        for q in range(row[T.FORCE_STATES]):
            z = row[T.FORCE_Z] + q
            kind = tab.state[z - idata[T.H_Z], T.STATE_KIND]
            own = matrix_at(tab.scratch, T.SCRATCH_FIXED + (6 * row[T.FORCE_WRENCHES] + q) * width, 1, width)
            k = put(mode, slot, vals, k, z, z, cj if kind == T.STATE_DIFFERENTIAL else 1.0)
            k = weighted_entries(
                mode, z, own, one, bodies, depends + 1, tab.extra_i[after - 1], after, y, axes, turns, tab, slot,
                vals, k,
            )  # fmt: skip
    wrench = vector_at(tab.scratch, row[T.FORCE_WORK] + 6 * row[T.FORCE_PART], 6)
    rows = matrix_at(tab.scratch, T.SCRATCH_FIXED + 6 * row[T.FORCE_PART] * width, 6, width)
    return moment_entries(mode, row, wrench, rows, y, axes, turns, tab, slot, vals, k)


@njit(cache=True, error_model="numpy")
def keep_slopes(f, y, idata, axes, turns, tab, work):
    """Keep the derivatives of a compiled element's wrench by the unknowns, six rows of them behind the unknowns kept.

    Parameters
    ----------
    f : int
        The force element, whose spatial derivatives have just been evaluated.
    y : ndarray, shape (n,)
    idata : ndarray of int
    axes, turns : ndarray
        Of `gearmbs.dae.equations.fixed_axes`.
    tab : Tables
        Up to date with y.
    work : ndarray
        The work array, written.
    """
    row, n, kept = tab.force[f], y.size, idata[idata.size - 1]
    if kept < 0 or row[T.FORCE_KIND] != T.COMPILED:
        return
    slopes = matrix_at(work, kept + n + 6 * n * f, 6, n)
    rows = matrix_at(tab.scratch, T.SCRATCH_FIXED + 6 * row[T.FORCE_PART] * row[T.FORCE_WIDTH], 6, row[T.FORCE_WIDTH])
    slopes[:] = 0.0
    s = vector_at(tab.scratch, S_CHAIN, 9)
    depends = row[T.FORCE_DEPENDS]
    bodies = tab.extra_i[depends]
    for q in range(bodies):
        a = tab.extra_i[depends + 1 + q] - 1
        if a < 0 or axes[a, AXIS_OMEGA] < 0:
            continue
        prepare_chain(a, turns, tab, s)
        for r in range(6):
            phi, omega = chain(a, y[axes[a, AXIS_OMEGA]], rows[r], 12 * q, turns, s)
            slopes[r, axes[a, AXIS_PHI]] += phi
            slopes[r, axes[a, AXIS_OMEGA]] += omega
    after = depends + 2 + bodies
    for q in range(tab.extra_i[after - 1]):
        for r in range(6):
            slopes[r, tab.extra_i[after + q]] += rows[r, 12 * bodies + q]


@njit(cache=True, error_model="numpy", forceinline=True)
def lean_entries(mode, f, lean, y, idata, rdata, axes, turns, tab, slot, vals, k, work):
    """Entries of the moments of an element with a lean kernel; keeps the slopes of its wrench as `keep_slopes` does.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    f, lean
        The element, and its row ``LEAN_*``.
    y, idata, rdata, axes, turns, tab, work
        As of `keep_slopes`.
    """
    row, n, kept = tab.force[f], y.size, idata[idata.size - 1]
    put_turns(row, y, axes, turns, tab)
    evaluate_lean(row, lean, S_TURNS, rdata, tab, DERIVATIVES | row[T.FORCE_WANT])
    by = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, 4)
    slopes = matrix_at(work, kept + n + 6 * n * f, 6, n)
    if kept >= 0:
        slopes[:] = 0.0
    for side in range(2):
        b = tab.marker_body[row[T.FORCE_I + side]] - 1
        omega, phi = axes[b, AXIS_OMEGA], axes[b, AXIS_PHI]
        if omega < 0:
            continue
        if kept >= 0:
            for r in range(6):
                slopes[r, phi], slopes[r, omega] = by[r, side], by[r, 2 + side]
        for q in range(2):
            a = tab.marker_body[row[T.FORCE_I + q]] - 1
            if axes[a, AXIS_OMEGA] < 0:
                continue
            by_phi = by_omega = 0.0
            for c in range(3):
                arm, along = rdata[lean[LEAN_FIRST] + 3 * side + c], turns[b, TURN_AXIS + c]
                by_phi += arm * by[c, q] + along * by[3 + c, q]
                by_omega += arm * by[c, 2 + q] + along * by[3 + c, 2 + q]
            sign = 1.0 - 2.0 * side
            k = put(mode, slot, vals, k, omega, axes[a, AXIS_PHI], -sign * by_phi)
            k = put(mode, slot, vals, k, omega, axes[a, AXIS_OMEGA], -sign * by_omega)
    return k


@njit(cache=True, error_model="numpy")
def axis_state_entries(mode, t, state, y, cj, idata, axes, turns, tab, slot, vals, k):
    """Entries of the equation of one user-defined state that an expression gives.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    state : int
        Number of the state.
    t, y, cj, idata
        As of `axes_jacobian`.
    axes, turns, tab
        As of `moment_entries`.
    """
    z, tape = idata[T.H_Z] + state, tab.state[state, T.STATE_TAPE]
    row = tab.tape[tape]
    size = expressions.gradient_size(row)
    grad = expressions.tail(tab, size)
    expressions.gradient(tape, t, y, tab, grad)
    one = vector_at(tab.scratch, S_FORCE, 1)
    one[0] = 1.0
    bodies, first = row[T.TAPE_N_BODIES], row[T.TAPE_BODIES]
    k = put(mode, slot, vals, k, z, z, cj if tab.state[state, T.STATE_KIND] == T.STATE_DIFFERENTIAL else 1.0)
    return weighted_entries(
        mode, z, matrix_at(grad, 0, 1, size), one, bodies, first, row[T.TAPE_N_UNKNOWNS], first + bodies, y, axes,
        turns, tab, slot, vals, k,
    )  # fmt: skip


@njit(JACOBIAN_SIG, cache=True, error_model="numpy")
def axes_jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Evaluate dG/dy + cj dG/dy' into ``vals``, or count the entries or note their places; see `unknowns.put`."""
    y, vals, idata, rdata = uncounted(y), uncounted(vals), uncounted(idata), uncounted(rdata)
    tab = T.unpack(idata, rdata, work)
    leans, axes, markers, slot, turns = axes_in(idata, rdata)
    mode = idata[T.H_MODE]
    update_axes(t, y, axes, markers, turns, tab, False)
    if mode == NUMBERS:
        for p in range(vals.size):
            vals[p] = 0.0
    # a literal 0 would make numba compile every callee once more
    k = np.int64(0)
    s = vector_at(tab.scratch, S_LEVER, 9)
    for a in range(axes.shape[0]):
        omega, phi = axes[a, AXIS_OMEGA], axes[a, AXIS_PHI]
        if omega < 0:
            continue
        _, turned = weight_moment(a, axes, turns, tab, s)
        k = put(mode, slot, vals, k, omega, omega, cj * turns[a, TURN_INERTIA])
        k = put(mode, slot, vals, k, omega, phi, -turned)
        k = put(mode, slot, vals, k, phi, omega, 1.0)
        k = put(mode, slot, vals, k, phi, phi, -cj)
    keep_unknowns(y, idata, work)
    for f in range(idata[T.H_FORCES]):
        if leans[f, LEAN_ADDRESS] != 0:
            k = lean_entries(mode, f, leans[f], y, idata, rdata, axes, turns, tab, slot, vals, k, work)
            continue
        k = element_axis_entries(mode, t, tab.force[f], y, cj, idata, axes, turns, tab, slot, vals, k)
        keep_slopes(f, y, idata, axes, turns, tab, work)
    for state in range(idata[T.H_STATES]):
        if tab.state[state, T.STATE_TAPE] >= 0:
            k = axis_state_entries(mode, t, state, y, cj, idata, axes, turns, tab, slot, vals, k)
    if mode == COUNT:
        vals[0] = k


def axes_pattern(
    idata: np.ndarray, rdata: np.ndarray, work_size: int, t: float, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots); see `gearmbs.dae.equations.jacobian.pattern`."""
    n = y.size
    ask, yp, places = idata.copy(), np.zeros(n), np.zeros(1)
    for mode in (COUNT, PLACES):
        ask[T.H_MODE] = mode
        places = np.zeros(1 if mode == COUNT else 2 * int(places[0]))
        axes_jacobian(t, y, yp, 1.0, places, ask, rdata.copy(), np.zeros(work_size))
    return compressed(places.reshape(-1, 2).astype(np.int64), n)
