"""Accelerations and multipliers from the index-1 linear system at given (t, q, v).

    [ M  Phi_q^T ] [ a      ]   [ Q                     ]
    [ Phi_q  0   ] [ lambda ] = [ -(Phi_q v)_q v - ...  ]

in the spatial velocities (v, omega) of the bodies, in which no orientation is singular.  Solved once
per output time, it gives reaction forces that are free of the integrator's noise.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.frames import is_elastic, own_rate, touches_elastic
from gearmbs.dae.equations.bodies.inertia import modal_acceleration_terms
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.elastic import bias_rate, put_spatial
from gearmbs.dae.equations.constraints.terms import (
    OFFSET,
    QUADRATIC,
    RATE,
    RELATIVE,
    dot_motion,
    put_dot,
    put_point,
    relative_motion,
)
from gearmbs.dae.equations.kinematics import update_bodies
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.loads.elastic import apply_frame_load, wrench_at
from gearmbs.dae.equations.loads.forces import DIAGNOSTICS, evaluate_element
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_TERM, S_VECTOR, S_WRENCH, arm_to
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_ADOT,
    KIN_H,
    KIN_R,
    KIN_V,
    KIN_W,
    POSE_A,
    POSE_COLUMNS,
    POSE_R,
    POSE_V,
    POSE_W,
    momentum_from_conjugate,
)
from gearmbs.dae.equations.unknowns import NUMBERS, add_number, put, put_pair
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, I8, IVEC, VEC
from gearmbs.kernels.structs import matrix_at, vector_at

FORCE_RECORD = 6
"""Per force element: F, N, then its diagnostics."""

ROW_PHI, ROW_RATE, ROW_PARTIAL = range(3)
ROW_RECORD = 3
"""Per constraint row: Phi, Phi_q v + Phi_t, Phi_t."""


@njit(cache=True, error_model="numpy", forceinline=True)
def apply_load(b, sign, row, wrench, at, marker_body, kin, frame, partial, scratch, rhs):
    """Add one side of a force element's load to the right-hand side; nothing on the ground.

    Parameters
    ----------
    b : int
        Body or elastic frame that the load acts on.
    sign : float
        1 for I's body, -1 for J's.
    row : ndarray of int, shape (FORCE_COLUMNS,)
        The element's row of the force table; both sides act at the origin of its marker I.
    wrench : ndarray, shape (6,)
        F, N and N, N m; global components.
    at, marker_body, kin, frame, partial
        Tables of places, of the markers' bodies, of kinematics, of markers, and of elastic frames' derivatives.
    scratch : ndarray
        The shared scratch, of which the places from ``S_VECTOR`` on are used.
    rhs : ndarray
        Generalised forces of the acceleration system, added to.
    """
    if b == 0:
        return
    if is_elastic(b, at):
        room = scratch[S_VECTOR : S_VECTOR + 9]
        wrench_at(b, row[T.FORCE_I], wrench, wrench[3:6], sign, marker_body, kin, frame, room)
        apply_frame_load(b, room, at, kin, partial, rhs)
        return
    s = scratch[S_VECTOR : S_VECTOR + 12]
    arm_to(b, row[T.FORCE_I], marker_body, kin, frame, s, 0)
    terms.cross3(s, 0, wrench, 0, s, 3)
    k = at[b, T.AT_V]
    for c in range(3):
        rhs[k + c] += sign * wrench[c]
        rhs[k + 3 + c] += sign * (s[3 + c] + wrench[3 + c])


@njit(types.UniTuple(F8, 4)(I8, F8, VEC, T.TABLES, VEC), cache=True, late=True, error_model="numpy")
def tape_row_rates(k, t, y, tab, room):
    """Return value, rate, partial time derivative and quadratic part of a row given by tape k.

    ``room`` receives the spatial gradient, six entries a body.
    """
    row = tab.tape[k]
    bodies = row[T.TAPE_N_BODIES]
    n = 6 * bodies + 1
    grad, hess = room[0:n], room[n:]
    value = expressions.second(k, t, y, tab, grad, hess)
    partial = grad[n - 1]
    # Phi'' = Phi_q q'' + q'.Phi_qq q' + 2 Phi_qt.q' + Phi_tt; gamma is all but the first
    rate, gamma = partial, hess[n * n - 1]
    for i in range(n - 1):
        b = tab.extra_i[row[T.TAPE_BODIES] + i // 6]
        speed = own_rate(b, i % 6, y, tab.at, tab.kin)
        rate += grad[i] * speed
        gamma += 2.0 * hess[i * n + n - 1] * speed
        for j in range(n - 1):
            b2 = tab.extra_i[row[T.TAPE_BODIES] + j // 6]
            gamma += speed * hess[i * n + j] * own_rate(b2, j % 6, y, tab.at, tab.kin)
    for p in range(bodies):
        b = tab.extra_i[row[T.TAPE_BODIES] + p]
        kin = tab.kin[b]
        # Phi_pi from Phi_theta_k = a_k . Phi_pi; omega' = sum a_k eps_k' + adot_k eps_k
        if is_elastic(b, tab.at):
            gamma += bias_rate(b, grad, 6 * p, tab.at, tab.partial)
        else:
            momentum_from_conjugate(tab.kin, b, grad, 6 * p + 3, grad, 6 * p + 3)
        for m in range(3):
            eps = own_rate(b, 3 + m, y, tab.at, tab.kin)
            gamma -= eps * terms.dot3(kin, KIN_ADOT + 3 * m, grad, 6 * p + 3)
    return value, rate, partial, gamma


@njit(cache=True, error_model="numpy", forceinline=True)
def packed(c, d):
    """Return the place of element (c, d) of a symmetric matrix stored as xx, yy, zz, xy, xz, yz."""
    return c if c == d else c + d + 2


@njit(cache=True, error_model="numpy", forceinline=True)
def world_inertia(kin_row, body_row, out):
    """Write the inertia about the centre of mass, global components, to six places, `packed`; nine more are scratch."""
    half = 6
    for c in range(3):
        for d in range(3):
            total = 0.0
            for e in range(3):
                # A J_b
                total += kin_row[KIN_A + 3 * c + e] * body_row[T.BODY_INERTIA + 3 * e + d]
            out[half + 3 * c + d] = total
    for c in range(3):
        for d in range(c, 3):
            total = 0.0
            for e in range(3):
                # (A J_b) A^T, whose upper half is enough
                total += out[half + 3 * c + e] * kin_row[KIN_A + 3 * d + e]
            out[packed(c, d)] = total


@njit(cache=True, error_model="numpy", forceinline=True)
def put_inertia(mode, slot, vals, k, i, mass, j):
    """Hand over the mass matrix of a body whose coordinates begin at i; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
    i : int
        Place of the body's first coordinate.
    mass : float
        kg.
    j : ndarray
        Inertia of `world_inertia`, kg m^2.
    """
    for c in range(3):
        if mode == NUMBERS:
            k = add_number(slot, vals, k, mass)
            for d in range(3):
                k = add_number(slot, vals, k, j[packed(min(c, d), max(c, d))])
            continue
        k = put(mode, slot, vals, k, i + c, i + c, mass)
        for d in range(3):
            k = put(mode, slot, vals, k, i + 3 + d, i + 3 + c, mass)
    return k


@njit(I8(I8, IVEC, VEC, I8, VEC, IVEC, VEC, VEC, VEC, VEC), cache=True, late=True, error_model="numpy")
def put_modal_body(mode, slot, vals, k, y, at, modal, partial, kin_row, rhs):
    """Hand over the modal inertia of a body and add its forces to ``rhs``; return the number of the next entry.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`.
    at, modal, partial, kin_row
        The body's places, the table of all integrals, its present state, its row of the kinematics table.
    """
    n, first, turn = at[T.AT_MODES], at[T.AT_V_MODES], at[T.AT_V] + 3
    mass, h, force, moment = np.empty((n, n)), np.empty((n, 3)), np.empty(n), np.empty(3)
    modal_acceleration_terms(y, at, modal, partial, kin_row, mass, h, force, moment)
    for c in range(3):
        rhs[turn + c] += moment[c]
    for i in range(n):
        rhs[first + i] = force[i]
        for c in range(3):
            k = put_pair(mode, slot, vals, k, first + i, turn + c, h[i, c])
        for l in range(n):
            k = put(mode, slot, vals, k, first + i, first + l, mass[i, l])
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def put_bodies(slot, vals, y, rhs, idata, tab):
    """Hand over the mass matrices, and write weights and gyroscopic moments to ``rhs``; return the next entry's number.

    Parameters are those of `saddle`.
    """
    s = vector_at(tab.scratch, S_TERM, 100)
    k = np.int64(0)
    for b in range(1, idata[T.H_BODIES]):
        kin = tab.kin[b]
        i = tab.at[b, T.AT_V]
        mass = tab.body[b, T.BODY_MASS]
        for c in range(3):
            # m v' = m g + F; J w' = h x w + N, with h = J w (Euler)
            rhs[i + c] = mass * tab.gravity[c]
        world_inertia(kin, tab.body[b], s)
        k = put_inertia(idata[T.H_MODE], slot, vals, k, i, mass, s)
        terms.cross3(kin, KIN_H, kin, KIN_W, rhs, i + 3)
        if tab.at[b, T.AT_MODES] > 0:
            k = put_modal_body(idata[T.H_MODE], slot, vals, k, y, tab.at[b], tab.modal, tab.partial, kin, rhs)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def put_term(slot, vals, k, row, j, idata, tab):
    """Hand over the gradient of a term of any type.

    Parameters
    ----------
    slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`, with the mode from the header.
    row : int
        Row of the matrix.
    j : int
        The term.
    idata, tab : ndarray of int, Tables

    Returns
    -------
    k : int
        Number of the next entry.
    value, rate, partial, gamma : float
        Phi, its rate, its partial time derivative and its second rate without the terms in accelerations, times the
        term's coefficient.
    """
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    s = vector_at(tab.scratch, S_TERM, 100)
    mode, coef = idata[T.H_MODE], tab.coef[j]
    phi, partial = terms.gradient(j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt)
    rate = partial
    gamma = terms.quadratic_part(j, tab.term, tab.fval, tab.marker_body, tab.kin, tab.frame, s)
    for side in range(2):
        b = tab.marker_body[tab.term[j, T.TERM_I + side]]
        if b == 0:
            continue
        h, q = 6 * side, tab.at[b, T.AT_V]
        kin = tab.kin[b]
        # Phi' = Phi_R v + Phi_pi w + Phi_t
        rate += terms.dot3(g, h, kin, KIN_V) + terms.dot3(g, h + 3, kin, KIN_W)
        if is_elastic(b, tab.at):
            gamma += bias_rate(b, g, h, tab.at, tab.partial)
            k = put_spatial(mode, slot, vals, k, row, b, g, h, coef, tab.at, tab.kin, tab.partial)
            continue
        for c in range(6):
            k = put_pair(mode, slot, vals, k, row, q + c, coef * g[h + c])
    return k, coef * phi, coef * rate, coef * partial, coef * gamma


@njit(cache=True, error_model="numpy", forceinline=True)
def put_tape_row(slot, vals, k, row, number, t, y, idata, tab):
    """Hand over the gradient of the expression of a constraint row; parameters and results as of `put_term`.

    Parameters
    ----------
    slot, vals, k, row
        As of `put_term`.
    number : int
        Number of the expression's tape.
    t, y : float, ndarray
        Time, s, and the unknowns.
    idata, tab : ndarray of int, Tables
    """
    tape = tab.tape[number]
    n = 6 * tape[T.TAPE_N_BODIES] + 1
    room = expressions.tail(tab, n * (n + 1))
    value, rate, partial, gamma = tape_row_rates(number, t, y, tab, room)
    mode = idata[T.H_MODE]
    for b in range(tape[T.TAPE_N_BODIES]):
        f = tab.extra_i[tape[T.TAPE_BODIES] + b]
        if is_elastic(f, tab.at):
            k = put_spatial(mode, slot, vals, k, row, f, room, 6 * b, 1.0, tab.at, tab.kin, tab.partial)
            continue
        q = tab.at[f, T.AT_V]
        for c in range(6):
            k = put_pair(mode, slot, vals, k, row, q + c, room[6 * b + c])
    return k, value, rate, partial, gamma


@njit(cache=True, error_model="numpy", forceinline=True)
def put_rows(slot, vals, k, t, y, rhs, phi, idata, tab):
    """Hand over the gradients of the constraint rows, fill ``phi``, and write -gamma to ``rhs``.

    Returns the number of the next entry.

    Parameters
    ----------
    slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`, with the mode from the header.
    t, y, rhs, phi, idata, tab
        As of `saddle`.
    """
    mode, base, bodies = idata[T.H_MODE], idata[T.H_COORDINATES], idata[T.H_BODIES]
    frames_are_elastic = idata[T.H_FRAMES] > bodies
    s = vector_at(tab.scratch, S_TERM, 100)
    apart = vector_at(tab.scratch, S_VECTOR, RELATIVE)
    last_i = last_j = np.int64(-1)
    for r in range(idata[T.H_ROWS]):
        value, rate, partial, gamma = 0.0, 0.0, 0.0, 0.0
        if tab.row[r, T.ROW_FUNCTION] >= 0:
            fun = tab.row[r, T.ROW_FUNCTION]
            f, f1, f2 = tab.fval[fun, 0], tab.fval[fun, 1], tab.fval[fun, 2]
            value, rate, partial, gamma = -f, -f1, -f1, -f2
        for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            coef = tab.coef[j]
            kind = tab.term[j, T.TERM_TYPE]
            elastic = frames_are_elastic and touches_elastic(tab.term[j], tab.marker_body, bodies)
            if elastic or (kind != terms.POINT and kind != terms.DOT1):
                k, p, d, p_t, q2 = put_term(slot, vals, k, base + r, j, idata, tab)
                value, rate, partial, gamma = value + p, rate + d, partial + p_t, gamma + q2
                continue
            if kind == terms.POINT:
                # the rows of a joint share their markers
                if tab.term[j, T.TERM_I] != last_i or tab.term[j, T.TERM_J] != last_j:
                    last_i, last_j = tab.term[j, T.TERM_I], tab.term[j, T.TERM_J]
                    relative_motion(last_i, last_j, tab.marker_body, tab.kin, tab.frame, apart)
                c = tab.term[j, T.TERM_AXES]
                p, d, q2 = apart[OFFSET + c], apart[RATE + c], apart[QUADRATIC + c]
                k = put_point(mode, slot, vals, k, base + r, coef, tab.term[j], tab.at, tab.marker_body, tab.frame)
            else:
                p, d, q2 = dot_motion(j, tab.term, tab.marker_body, tab.kin, tab.frame, s)
                k = put_dot(mode, slot, vals, k, base + r, coef, tab.term[j], tab.at, tab.marker_body, s)
            value += coef * p
            rate += coef * d
            gamma += coef * q2
        if tab.row[r, T.ROW_TAPE] >= 0:
            k, p, d, p_t, q2 = put_tape_row(slot, vals, k, base + r, tab.row[r, T.ROW_TAPE], t, y, idata, tab)
            value, rate, partial, gamma = value + p, rate + d, partial + p_t, gamma + q2
        rhs[base + r] = -gamma
        phi[ROW_RECORD * r + ROW_PHI] = value
        phi[ROW_RECORD * r + ROW_RATE] = rate
        phi[ROW_RECORD * r + ROW_PARTIAL] = partial
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def apply_wrench(f, wrench, rhs, loads, tab):
    """Record the wrench of force element f in ``loads`` and add it to ``rhs``; J's body feels the opposite."""
    row = tab.force[f]
    for c in range(6):
        loads[f, c] = wrench[c]
    for side in range(2):
        b = tab.marker_body[row[T.FORCE_I + side]]
        apply_load(
            b, 1.0 - 2.0 * side, row, wrench, tab.at, tab.marker_body, tab.kin, tab.frame, tab.partial, tab.scratch, rhs
        )


@njit(cache=True, error_model="numpy", forceinline=True)
def apply_evaluated(f, rhs, loads, tab):
    """Record a compiled element with the diagnostics that its kernel has left, and add its wrench to ``rhs``."""
    row = tab.force[f]
    if row[T.FORCE_PART] == 0:
        first = row[T.FORCE_WORK] + 6 * row[T.FORCE_WRENCHES] + row[T.FORCE_STATES]
        for c in range(row[T.FORCE_DIAGNOSTICS]):
            loads[f, FORCE_RECORD + c] = tab.scratch[first + c]
    wrench = vector_at(tab.scratch, row[T.FORCE_WORK] + 6 * row[T.FORCE_PART], 6)
    for c in range(3):
        # what the kernel wrote for unknowns that it does not have
        wrench[c] = wrench[c] if row[T.FORCE_F] >= 0 else 0.0
        wrench[3 + c] = wrench[3 + c] if row[T.FORCE_N] >= 0 else 0.0
    apply_wrench(f, wrench, rhs, loads, tab)


@njit(cache=True, error_model="numpy", forceinline=True)
def apply_element(f, t, y, rhs, loads, tab):
    """Evaluate force element f, record it in ``loads`` and add it to ``rhs``; parameters as of `saddle`."""
    row = tab.force[f]
    if row[T.FORCE_KIND] == T.REACTION:
        # it follows from the multipliers that this system is solved for; the integrator's is at hand
        for c in range(3):
            loads[f, c], loads[f, 3 + c] = y[row[T.FORCE_F] + c], y[row[T.FORCE_N] + c]
    elif row[T.FORCE_KIND] == T.COMPILED:
        if row[T.FORCE_PART] == 0:
            evaluate_element(row, t, y, tab, np.int64(DIAGNOSTICS))
        apply_evaluated(f, rhs, loads, tab)
    else:
        wrench = vector_at(tab.scratch, S_WRENCH, 6)
        jac = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, row[T.FORCE_WIDTH])
        expressions.load(row, t, y, tab, wrench, jac, np.int64(0))
        apply_wrench(f, wrench, rhs, loads, tab)


@njit(cache=True, error_model="numpy", forceinline=True)
def apply_loads(t, y, rhs, loads, idata, tab):
    """Evaluate all force elements, record them in ``loads`` and add them to ``rhs``; parameters as of `saddle`."""
    for f in range(idata[T.H_FORCES]):
        apply_element(f, t, y, rhs, loads, tab)


@njit(cache=True, error_model="numpy", forceinline=True)
def saddle(t, y, slot, vals, rhs, phi, loads, idata, tab, with_loads):
    """Assemble the saddle-point matrix (by slots) and right-hand side; return the number of entries.

    The kinematics, marker and function tables must be up to date.

    Parameters
    ----------
    t : float
        Time, s.
    y : ndarray, shape (unknowns,)
    slot, vals
        As in `gearmbs.dae.equations.unknowns.put`, with the mode from the header of ``idata``; numbers are added up.
    rhs : ndarray, shape (coordinates + rows,)
        Written: generalised forces, then -gamma of each row.
    phi : ndarray, shape (ROW_RECORD rows,)
        Written: Phi, Phi_q v + Phi_t and Phi_t of each row in turn.
    loads : ndarray, shape (elements, FORCE_RECORD + diagnostics)
        Written if the loads are wanted: F, N and diagnostics of each force element; need not be cleared.
    idata : ndarray of int
        Integer tables, for their header.
    tab : Tables
    with_loads : bool
        Whether the right-hand side includes the applied forces, which a projection does not need.
    """
    for c in range(rhs.size):
        rhs[c] = 0.0
    k = put_bodies(slot, vals, y, rhs, idata, tab)
    k = put_rows(slot, vals, k, t, y, rhs, phi, idata, tab)
    if idata[T.H_MODE] == NUMBERS and with_loads:
        apply_loads(t, y, rhs, loads, idata, tab)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def has_reactions(tab):
    """Whether some load is the reaction of a joint, which follows from the multipliers that are solved for."""
    found = False
    for f in range(tab.force.shape[0]):
        found |= tab.force[f, T.FORCE_KIND] == T.REACTION
    return found


# What is recorded of an output beside accelerations: the reactions of constraint rows, and the poses of bodies.


@njit(types.void(I8, F8, F8, VEC, T.TABLES, VEC, VEC), cache=True, late=True, error_model="numpy")
def load_of_tape(k, lam, t, y, tab, force, moment):
    """Add what a row given by tape k exerts on the body of the first marker that it names.

    Of the ground, what all others feel with the opposite sign: the expression stays what it is where all move together.

    Parameters
    ----------
    k : int
        Tape Phi.
    lam : float
        The row's multiplier.
    t, y, tab : float, ndarray, Tables
        Time, s, the unknowns, and the tables that are up to date with them.
    force, moment : ndarray, shape (3,)
        -lambda Phi_R, N, and -lambda (Phi_pi + (R - P_I) x Phi_R), N m, about the marker's origin P_I, added; global.
    """
    row = tab.tape[k]
    first, bodies = row[T.TAPE_BODIES], row[T.TAPE_N_BODIES]
    i = tab.extra_i[first + bodies + row[T.TAPE_N_UNKNOWNS]]
    if i < 0:
        return
    grad = expressions.tail(tab, expressions.gradient_size(row))
    expressions.gradient(k, t, y, tab, grad)
    s = vector_at(tab.scratch, S_VECTOR, 6)
    of_i = tab.marker_body[i]
    factor = -lam if of_i > 0 else lam
    for p in range(bodies):
        b = tab.extra_i[first + p]
        # frames of one body that deforms have its place among the unknowns
        if of_i > 0 and tab.at[b, T.AT_U] != tab.at[of_i, T.AT_U]:
            continue
        for c in range(3):
            s[c] = tab.kin[b, KIN_R + c] - tab.kin[of_i, KIN_R + c] - tab.frame[i, T.MK_ARM + c]
        terms.cross3(s, 0, grad, 12 * p, s, 3)
        for c in range(3):
            force[c] += factor * grad[12 * p + c]
            moment[c] += factor * (grad[12 * p + 3 + c] + s[3 + c])


@njit(cache=True, error_model="numpy", forceinline=True)
def loads_of_rows(multipliers, t, y, idata, tab, force, moment):
    """Write the reaction of each constraint row on I's body: force, and moment about the origin of marker I, global.

    The kinematics tables must be up to date. Of a row that couples several joints, the part that acts through the
    first one's marker I; of one given by an expression, that of `load_of_tape`.
    """
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    s = vector_at(tab.scratch, S_TERM, 100)
    for r in range(idata[T.H_ROWS]):
        for c in range(3):
            force[r, c] = 0.0
            moment[r, c] = 0.0
        lam = multipliers[r]
        first, last = tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]
        for j in range(first, last):
            if tab.term[j, T.TERM_I] != tab.term[first, T.TERM_I]:
                continue
            factor = -lam * tab.coef[j]
            kind = tab.term[j, T.TERM_TYPE]
            if kind == terms.POINT:
                force[r, tab.term[j, T.TERM_AXES]] += factor
                continue
            if kind == terms.DOT1:
                a, b = tab.term[j, T.TERM_AXES] // 3, tab.term[j, T.TERM_AXES] % 3
                i_row, j_row = tab.frame[tab.term[j, T.TERM_I]], tab.frame[tab.term[j, T.TERM_J]]
                terms.cross3(i_row, T.MK_AXES + 3 * a, j_row, T.MK_AXES + 3 * b, s, 0)
                for c in range(3):
                    moment[r, c] += factor * s[c]
                continue
            terms.gradient(j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt)
            for c in range(3):
                s[c] = factor * g[c]
                force[r, c] += s[c]
            terms.cross3(tab.frame[tab.term[j, T.TERM_I]], T.MK_ARM, s, 0, s, 3)
            for c in range(3):
                moment[r, c] += factor * g[3 + c] - s[3 + c]
        if tab.row[r, T.ROW_TAPE] >= 0:
            load_of_tape(tab.row[r, T.ROW_TAPE], lam, t, y, tab, force[r], moment[r])


@njit(
    "void(float64[::1], int64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1])",
    cache=True,
    error_model="numpy",
)
def joint_loads(y, idata, rdata, work, multipliers, force, moment):
    """Write the loads of `loads_of_rows`; ``multipliers[0]`` holds lambda, ``multipliers[1, 0]`` the time, s."""
    loads_of_rows(multipliers[0], multipliers[1, 0], y, idata, T.unpack(idata, rdata, work), force, moment)


@njit(cache=True, error_model="numpy", forceinline=True)
def poses(y, at, code, kin, out):
    """Write R, A (row-major), v, omega of each body (18 values, the ground left out) from an up-to-date table.

    The modal coordinates and their velocities come last.
    """
    bodies = code.size
    for b in range(1, bodies):
        modes, first = at[b, T.AT_MODES], at[b, T.AT_V_MODES] - 6 * (bodies - 1)
        half = (out.size - POSE_COLUMNS * (bodies - 1)) // 2
        for m in range(modes):
            place = POSE_COLUMNS * (bodies - 1) + first + m
            out[place] = y[at[b, T.AT_QF] + m]
            out[place + half] = y[at[b, T.AT_VF] + m]
        k = POSE_COLUMNS * (b - 1)
        for c in range(3):
            out[k + POSE_R + c] = kin[b, KIN_R + c]
            out[k + POSE_V + c] = kin[b, KIN_V + c]
            out[k + POSE_W + c] = kin[b, KIN_W + c]
        for c in range(9):
            out[k + POSE_A + c] = kin[b, KIN_A + c]


@njit("void(float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])", cache=True, error_model="numpy")
def pose_record(y, idata, rdata, work, out):
    """Write the record of `poses` for y."""
    tab = T.unpack(idata, rdata, work)
    update_bodies(y, tab.at, tab.code, tab.body, tab.modal, tab.kin, tab.partial, tab.scratch, False)
    poses(y, tab.at, tab.code, tab.kin, out)
