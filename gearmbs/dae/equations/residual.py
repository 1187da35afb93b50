"""The residual G(t, y, y') of eq. (5)-(9), for the formulations I3, SI2 and SI1.

They are Lagrange's equations with multipliers, eq. (4) of the paper, in first-order form with momenta.

With y = [u, p, eps, R, theta, lambda, F, N, z, mu] the rows are, in the same order as the unknowns,

    M u' - m g + Phi_R^T lambda - H_F^T F                     (5), first
    p' - L_theta^T + Phi_theta^T lambda - H_N^T N             (5), second
    p - L_eps^T                                               (5), third
    u - R' - Phi_R^T mu                                       (6), first, stabilised
    eps - theta' - Phi_theta^T mu                             (6), second, stabilised
    Phi(q, t)                                                 (7)
    F - F(q, q', t),  N - N(q, q', t)                         definitions of the applied loads (and, where a load
                                                              depends on them, of joints' reactions by lambda)
    z' - f  or  z - f                                         user-defined states, if any
    Phi_q q' + Phi_t   (with q' = [u, eps])                   the derivative of (7)

I3 drops the last block and mu; SI1 puts the derivatives of the unknowns Lambda and Gamma in place of
lambda and mu.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import add_wrench, body_residual
from gearmbs.dae.equations.bodies.frames import is_elastic, own_rate
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.terms import add_dot_term, add_point_term
from gearmbs.dae.equations.kinematics import update_tables
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.loads.elastic import bring_to_body
from gearmbs.dae.equations.loads.forces import evaluate_element
from gearmbs.dae.equations.loads.reactions import reaction_wrench
from gearmbs.dae.equations.rotation import (
    KIN_COLUMNS,
    KIN_FORCE,
    KIN_MOMENT,
    KIN_R,
    KIN_SHIFT,
    KIN_TURN,
    KIN_V,
    KIN_W,
)
from gearmbs.dae.equations.unknowns import has_rate_rows, multipliers_are_rates, multipliers_of_row
from gearmbs.dae.problem import RESIDUAL_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, I8, VEC
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at

S_GRADIENT = 0
S_GRADIENT_T = 12
S_TERM = 24
S_HESSIAN = 128
S_WRENCH = 280
S_VECTOR = 320


@njit(
    "void(float64, float64[::1], float64[::1], int64[::1], float64[::1], float64[::1])", cache=True, error_model="numpy"
)
def update(t, y, yp, idata, rdata, work):
    """Bring the kinematics and marker tables up to date with y."""
    tab = T.unpack(idata, rdata, work)
    update_tables(t, y, tab, True)


@njit(cache=True, error_model="numpy", forceinline=True)
def arm_to(b, point_marker, marker_body, kin, frame, out, k):
    """Write the vector from body b's centre of mass to the origin of a marker, global components."""
    owner = marker_body[point_marker]
    for c in range(3):
        out[k + c] = kin[owner, KIN_R + c] + frame[point_marker, c] - kin[b, KIN_R + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def add_load(b, sign, row, y, marker_body, kin, frame, scratch):
    """Add the loads of one force element to what is collected for frame b (eq. (5), H_F^T F and H_N^T N).

    Parameters
    ----------
    b, sign : int, float
        The frame that feels the load, 1 for that of I and -1 for that of J.
    row : ndarray of int
        Row of the force element.
    y
        Unknowns.
    marker_body, kin, frame
        Tables of the markers' frames, of kinematics and of markers.
    scratch : ndarray
        The work array's scratch.
    """
    if b == 0:
        return
    s, body = vector_at(scratch, S_VECTOR, 9), kin[b]
    if row[T.FORCE_F] >= 0:
        # a force at I's origin has the moment arm x F about the centre of mass; minus since rows of eq. (5) hold -H^T F
        arm_to(b, row[T.FORCE_I], marker_body, kin, frame, s, 0)
        for c in range(3):
            s[3 + c] = sign * y[row[T.FORCE_F] + c]
            body[KIN_FORCE + c] -= s[3 + c]
        terms.cross3(s, 0, s, 3, s, 6)
        for c in range(3):
            body[KIN_MOMENT + c] -= s[6 + c]
    if row[T.FORCE_N] >= 0:
        for c in range(3):
            body[KIN_MOMENT + c] -= sign * y[row[T.FORCE_N] + c]


@njit(cache=True, error_model="numpy", forceinline=True)
def begin_wrenches(kin):
    """Clear the columns in which the forces on frames are added up."""
    for b in range(kin.shape[0]):
        for c in range(KIN_FORCE, KIN_COLUMNS):
            kin[b, c] = 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def add_wrenches(bodies, at, modal, kin, partial, scratch, out):
    """Bring the forces added up for each frame to the coordinates: eq. (5), and mu in eq. (6)."""
    for f in range(bodies, at.shape[0]):
        bring_to_body(f, at, modal, kin, partial, scratch, out)
    for b in range(1, bodies):
        add_wrench(at[b], kin[b], out)


@njit(types.UniTuple(F8, 2)(I8, F8, F8, F8, VEC, T.TABLES, VEC), cache=True, late=True, error_model="numpy")
def add_tape_row(k, t, lam, mu, y, tab, out):
    """Add the constraint forces of a row given by tape k; return its value and rate."""
    row = tab.tape[k]
    n = 6 * row[T.TAPE_N_BODIES] + 1
    room = expressions.tail(tab, n * (n + 1))
    grad, hess = room[0:n], room[n:]
    value = expressions.second(k, t, y, tab, grad, hess)
    rate = grad[n - 1]
    for p in range(row[T.TAPE_N_BODIES]):
        b = tab.extra_i[row[T.TAPE_BODIES] + p]
        at, kin = tab.at[b], tab.kin[b]
        for c in range(3):
            along, about = grad[6 * p + c], grad[6 * p + 3 + c]
            # Phi' = Phi_R u + Phi_theta eps + Phi_t, and the rows of lambda and mu in (5) and (6)
            rate += along * own_rate(b, c, y, tab.at, tab.kin) + about * own_rate(b, 3 + c, y, tab.at, tab.kin)
            kin[KIN_FORCE + c] += lam * along
            kin[KIN_SHIFT + c] += mu * along
            if is_elastic(b, tab.at):
                kin[KIN_MOMENT + c] += lam * about
                kin[KIN_TURN + c] += mu * about
            else:
                out[at[T.AT_P] + c] += lam * about
                out[at[T.AT_THETA] + c] -= mu * about
    return value, rate


@njit(cache=True, error_model="numpy", forceinline=True)
def add_constraints(t, y, yp, idata, tab, out):
    """Constraint rows, their derivatives, and the constraint forces of lambda and mu."""
    rate_rows = has_rate_rows(idata[T.H_FORMULATION])
    lam0, mu0 = idata[T.H_LAMBDA], idata[T.H_MU]
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    s = vector_at(tab.scratch, S_TERM, 100)
    for r in range(idata[T.H_ROWS]):
        value, rate = 0.0, 0.0
        if tab.row[r, T.ROW_FUNCTION] >= 0:
            fun = tab.row[r, T.ROW_FUNCTION]
            f, f1 = tab.fval[fun, 0], tab.fval[fun, 1]
            # Phi = sum of k phi - f(t)
            value, rate = -f, -f1
        lam, mu = multipliers_of_row(r, y, yp, idata)
        for k in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            coef = tab.coef[k]
            kind = tab.term[k, T.TERM_TYPE]
            if kind == terms.POINT:
                v, d = add_point_term(k, coef, lam, mu, tab.term, tab.marker_body, tab.kin, tab.frame)
                value += v
                rate += d
                continue
            if kind == terms.DOT1:
                v, d = add_dot_term(k, coef, lam, mu, tab.term, tab.marker_body, tab.kin, tab.frame, s)
                value += v
                rate += d
                continue
            phi, phi_t = terms.gradient(
                k,
                tab.term,
                tab.fval,
                tab.reference,
                tab.marker_body,
                tab.kin,
                tab.frame,
                s,
                g,
                gt,
            )
            value += coef * phi
            rate += coef * phi_t
            # the gradient by both frames' [dR, dpi]: rate by velocities, lambda to (5), mu to (6)
            for side in range(2):
                b = tab.marker_body[tab.term[k, T.TERM_I + side]]
                if b == 0:
                    continue
                kin, h = tab.kin[b], 6 * side
                rate += coef * (terms.dot3(g, h, kin, KIN_V) + terms.dot3(g, h + 3, kin, KIN_W))
                for c in range(3):
                    kin[KIN_FORCE + c] += coef * lam * g[h + c]
                    kin[KIN_MOMENT + c] += coef * lam * g[h + 3 + c]
                    kin[KIN_SHIFT + c] += coef * mu * g[h + c]
                    kin[KIN_TURN + c] += coef * mu * g[h + 3 + c]
        if tab.row[r, T.ROW_TAPE] >= 0:
            v, d = add_tape_row(tab.row[r, T.ROW_TAPE], t, lam, mu, y, tab, out)
            value += v
            rate += d
        out[lam0 + r] = value
        if rate_rows:
            out[mu0 + r] = rate


@njit(cache=True, error_model="numpy", forceinline=True)
def add_own_states(row, y, yp, idata, state, scratch, out):
    """Write the equations z' - f or z - f of the states of a compiled element that has just been evaluated."""
    rates = row[T.FORCE_WORK] + 6 * row[T.FORCE_WRENCHES]
    for k in range(row[T.FORCE_STATES]):
        z = row[T.FORCE_Z] + k
        left = yp[z] if state[z - idata[T.H_Z], T.STATE_KIND] == T.STATE_DIFFERENTIAL else y[z]
        out[z] = left - scratch[rates + k]


@njit(RESIDUAL_SIG, cache=True, error_model="numpy")
def residual(t, y, yp, out, idata, rdata, work):
    """Evaluate G(t, y, y') of eq. (8) into ``out``."""
    y, yp, out, idata = uncounted(y), uncounted(yp), uncounted(out), uncounted(idata)
    tab = T.unpack(idata, rdata, work)
    update_tables(t, y, tab, False)
    begin_wrenches(tab.kin)
    for b in range(1, idata[T.H_BODIES]):
        body_residual(y, yp, tab.at[b], tab.body[b], tab.gravity, tab.modal, tab.partial, tab.kin[b], out)
    add_constraints(t, y, yp, idata, tab, out)
    room = vector_at(tab.scratch, 0, 64)
    lam0 = idata[T.H_LAMBDA]
    source = yp if multipliers_are_rates(idata[T.H_FORMULATION]) else y
    multipliers = vector_at(source, lam0, idata[T.H_ROWS])
    for f in range(idata[T.H_FORCES]):
        row = tab.force[f]
        wrench = vector_at(tab.scratch, S_WRENCH, 6)
        if row[T.FORCE_KIND] == T.COMPILED:
            if row[T.FORCE_PART] == 0:
                evaluate_element(row, t, y, tab, row[T.FORCE_WANT])
                add_own_states(row, y, yp, idata, tab.state, tab.scratch, out)
            wrench = vector_at(tab.scratch, row[T.FORCE_WORK] + 6 * row[T.FORCE_PART], 6)
        else:
            jac = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, row[T.FORCE_WIDTH])
            if row[T.FORCE_KIND] == T.REACTION:
                reaction_wrench(row, multipliers, lam0, tab, room, wrench, jac, np.int64(0))
            else:
                expressions.load(row, t, y, tab, wrench, jac, np.int64(0))
        for c in range(3):
            if row[T.FORCE_F] >= 0:
                out[row[T.FORCE_F] + c] = y[row[T.FORCE_F] + c] - wrench[c]
            if row[T.FORCE_N] >= 0:
                out[row[T.FORCE_N] + c] = y[row[T.FORCE_N] + c] - wrench[3 + c]
        if row[T.FORCE_KIND] != T.REACTION:
            for side in range(2):
                b = tab.marker_body[row[T.FORCE_I + side]]
                add_load(b, 1.0 - 2.0 * side, row, y, tab.marker_body, tab.kin, tab.frame, tab.scratch)
    add_wrenches(idata[T.H_BODIES], tab.at, tab.modal, tab.kin, tab.partial, tab.scratch, out)
    for k in range(idata[T.H_STATES]):
        z = idata[T.H_Z] + k
        if tab.state[k, T.STATE_TAPE] < 0:
            continue
        left = yp[z] if tab.state[k, T.STATE_KIND] == T.STATE_DIFFERENTIAL else y[z]
        out[z] = left - expressions.value(tab.state[k, T.STATE_TAPE], t, y, tab)
