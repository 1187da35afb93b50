"""The exact sparse Jacobian dG/dy + cj dG/dy' of the residual, and its pattern.

One routine walks through the entries in a fixed order.  Asked for the pattern it records their places;
asked for numbers it adds each entry to its slot of the CSC values, so both can never disagree.
"""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import matrix_at, uncounted, vector_at
from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.dae.equations import expression_loads
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.elastic import is_elastic, load_at, put_arm, put_chain, put_load, put_row, touches_elastic
from gearmbs.dae.equations.entries import COUNT, NUMBERS, PLACES, compressed, put
from gearmbs.dae.equations.force_elements import DERIVATIVES
from gearmbs.dae.equations.forces import evaluate_element
from gearmbs.dae.equations.modal_inertia import modal_body_entries
from gearmbs.dae.equations.reactions import reaction_wrench
from gearmbs.dae.equations.residual import (
    S_GRADIENT,
    S_GRADIENT_T,
    S_HESSIAN,
    S_PRODUCT,
    S_TERM,
    S_VECTOR,
    S_WRENCH,
    arm_to,
)
from gearmbs.dae.equations.rotation import KIN_ADOT, KIN_AXES, KIN_DW, KIN_H
from gearmbs.dae.equations.unknowns import SI1, has_rate_rows, multiplier_factor, multipliers_of_row
from gearmbs.dae.equations.update import euler_component, inertia_times, update_tables
from gearmbs.dae.problem import JACOBIAN_SIG

HESSIAN_BLOCKS = terms.HESSIAN_BLOCKS


@njit(cache=True, error_model="numpy", forceinline=True)
def body_entries(mode, b, cj, tab, slot, vals, k):
    """Entries of one body's inertia terms in eq. (5) and (6)."""
    at = tab.at[b]
    u, p, e, r, th = at[T.AT_U], at[T.AT_P], at[T.AT_EPS], at[T.AT_R], at[T.AT_THETA]
    kin = tab.kin[b]
    s = vector_at(tab.scratch, S_TERM, 100)
    mass = tab.body[b, T.BODY_MASS]
    # J a_k in s[0:9], J adot_k in s[9:18], dh/dtheta_m = a_m x h + J adot_m in s[18:27]
    for m in range(3):
        inertia_times(kin, tab.body[b], kin, KIN_AXES + 3 * m, s, 3 * m, s[30:33])
        inertia_times(kin, tab.body[b], kin, KIN_ADOT + 3 * m, s, 9 + 3 * m, s[30:33])
        terms.cross3(kin, KIN_AXES + 3 * m, kin, KIN_H, s, 18 + 3 * m)
        for c in range(3):
            s[18 + 3 * m + c] += s[9 + 3 * m + c]
    for m in range(3):
        k = put(mode, slot, vals, k, u + m, u + m, mass * cj)
        k = put(mode, slot, vals, k, p + m, p + m, cj)
        k = put(mode, slot, vals, k, e + m, p + m, 1.0)
        k = put(mode, slot, vals, k, r + m, u + m, 1.0)
        k = put(mode, slot, vals, k, r + m, r + m, -cj)
        k = put(mode, slot, vals, k, th + m, e + m, 1.0)
        k = put(mode, slot, vals, k, th + m, th + m, -cj)
        for n in range(3):
            # L_eps_m = a_m . h
            k = put(mode, slot, vals, k, e + m, e + n, -terms.dot3(kin, KIN_AXES + 3 * m, s, 3 * n))
            mixed_mn = terms.dot3(kin, KIN_ADOT + 3 * n, s, 3 * m)
            if m < n:
                terms.cross3(kin, KIN_AXES + 3 * m, kin, KIN_AXES + 3 * n, s, 30)
                mixed_mn += terms.dot3(s, 30, kin, KIN_H)
            # d2T/d(eps_m)d(theta_n) serves p - L_eps and p' - L_theta
            k = put(mode, slot, vals, k, e + m, th + n, -mixed_mn)
            k = put(mode, slot, vals, k, p + n, e + m, -mixed_mn)
    for m in range(3):
        for n in range(3):
            value = terms.dot3(kin, KIN_ADOT + 3 * m, s, 18 + 3 * n)
            if n < m:
                # d(adot_m)/d(theta_n) . h, with adot_m = sum_{l<m} eps_l a_l x a_m
                for l in range(m):
                    lo, hi = min(n, l), max(n, l)
                    terms.cross3(kin, KIN_AXES + 3 * hi, kin, KIN_AXES + 3 * m, s, 30)
                    terms.cross3(kin, KIN_AXES + 3 * lo, s, 30, s, 33)
                    value += tab.scratch[S_PRODUCT + l] * terms.dot3(s, 33, kin, KIN_H)
            k = put(mode, slot, vals, k, p + m, th + n, -value)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def linear_sides(kind):
    """Return on which sides (1: I, 2: J) a term is linear in the displacement and blind to the rotation of a frame."""
    return 3 if kind == terms.POINT else 1 if kind == terms.DOT2 else 0


@njit(cache=True, error_model="numpy")
def elastic_term_entries(mode, j, coef, lam, mu, factor, rate_rows, row_lam, row_mu, y, g, gt, tab, slot, vals, k):
    """Entries of a constraint term between frames of which one at least is elastic; see `row_entries`.

    Parameters
    ----------
    j : int
        The term; its Hessian has just been evaluated.
    coef : float
        Its coefficient in the row.
    lam, mu, factor : float
        Multipliers, and their derivative by the unknowns they are made from.
    row_lam, row_mu : int
        Places of the multipliers in y.
    g, gt : ndarray
        Spatial gradients of the term and of its partial time derivative; made those by the frames' own coordinates.
    """
    frames = np.empty(2, dtype=np.int64)
    turn, turn_t = np.empty(3), np.empty(3)
    for side in range(2):
        b = tab.marker_body[tab.term[j, T.TERM_I + side]]
        frames[side] = b
        if b > 0 and not is_elastic(b, tab.at):
            for c in range(3):
                turn[c] = euler_component(tab.kin[b], c, g, 6 * side + 3)
                turn_t[c] = euler_component(tab.kin[b], c, gt, 6 * side + 3)
            for c in range(3):
                g[6 * side + 3 + c], gt[6 * side + 3 + c] = turn[c], turn_t[c]
    return put_row(
        mode, slot, vals, k, frames, 2, linear_sides(tab.term[j, T.TERM_TYPE]), g, gt,
        vector_at(tab.scratch, S_HESSIAN, 144), 12, coef, np.array([row_lam, row_mu]), lam, mu, factor, rate_rows, y,
        tab.at, tab.partial,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", forceinline=True)
def row_entries(mode, r, y, yp, cj, idata, tab, slot, vals, k):
    """Entries of one constraint row, its derivative, and the forces of its multipliers.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`; returned is the number of the next entry.
    r : int
        Constraint row.
    y, yp
        Unknowns and their derivatives.
    cj
        Factor of dG/dy'.
    idata
        Header and tables of integers.
    tab
        Named views of the tables, up to date with y.
    """
    rate_rows = has_rate_rows(idata[T.H_FORMULATION])
    lam, mu = idata[T.H_LAMBDA] + r, idata[T.H_MU] + r
    lam_value, mu_value = multipliers_of_row(r, y, yp, idata)
    factor = multiplier_factor(cj, idata)
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    s = vector_at(tab.scratch, S_TERM, 100)
    hess = matrix_at(tab.scratch, S_HESSIAN, 12, 12)
    w = vector_at(tab.scratch, S_VECTOR, 12)
    frames_are_elastic = idata[T.H_FRAMES] > idata[T.H_BODIES]
    for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
        coef = tab.coef[j]
        terms.gradient(j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt)
        terms.hessian(j, tab.term, tab.fval, tab.marker_body, tab.kin, tab.frame, hess, s)
        kind = tab.term[j, T.TERM_TYPE]
        if frames_are_elastic and touches_elastic(tab.term[j], tab.marker_body, tab.code.size):
            k = elastic_term_entries(
                mode, j, coef, lam_value, mu_value, factor, rate_rows, lam, mu, y, g, gt, tab, slot, vals, k
            )
            continue
        for side in range(2):
            b = tab.marker_body[tab.term[j, T.TERM_I + side]]
            h, at = 6 * side, tab.at[b]
            for c in range(3):
                w[h + c] = y[at[T.AT_U] + c] if b > 0 else 0.0
                w[h + 3 + c] = y[at[T.AT_EPS] + c] if b > 0 else 0.0
        for side in range(2):
            b = tab.marker_body[tab.term[j, T.TERM_I + side]]
            if b == 0:
                continue
            h, at = 6 * side, tab.at[b]
            for c in range(3):
                along = coef * g[h + c]
                about = coef * euler_component(tab.kin[b], c, g, h + 3)
                if kind == terms.POINT and c != tab.term[j, T.TERM_AXES]:
                    pass
                elif kind != terms.DOT1 and kind != terms.ANGLE and kind != terms.ROTATION:
                    k = put(mode, slot, vals, k, at[T.AT_U] + c, lam, factor * along)
                    k = put(mode, slot, vals, k, lam, at[T.AT_R] + c, along)
                    if rate_rows:
                        k = put(mode, slot, vals, k, at[T.AT_R] + c, mu, -factor * along)
                        k = put(mode, slot, vals, k, mu, at[T.AT_U] + c, along)
                k = put(mode, slot, vals, k, at[T.AT_P] + c, lam, factor * about)
                k = put(mode, slot, vals, k, lam, at[T.AT_THETA] + c, about)
                if rate_rows:
                    k = put(mode, slot, vals, k, at[T.AT_THETA] + c, mu, -factor * about)
                    k = put(mode, slot, vals, k, mu, at[T.AT_EPS] + c, about)
        for bm in range(4):
            b = tab.marker_body[tab.term[j, T.TERM_I + bm // 2]]
            if b == 0:
                continue
            force_row = tab.at[b, T.AT_P] if bm % 2 == 1 else tab.at[b, T.AT_U]
            position = tab.at[b, T.AT_THETA] if bm % 2 == 1 else tab.at[b, T.AT_R]
            any_block = False
            for bn in range(4):
                b2 = tab.marker_body[tab.term[j, T.TERM_I + bn // 2]]
                if b2 == 0 or not HESSIAN_BLOCKS[kind, bm, bn]:
                    continue
                any_block = True
                other = tab.at[b2, T.AT_THETA] if bn % 2 == 1 else tab.at[b2, T.AT_R]
                for m in range(3):
                    for n in range(3):
                        value = coef * hess[3 * bm + m, 3 * bn + n]
                        k = put(mode, slot, vals, k, force_row + m, other + n, lam_value * value)
                        if rate_rows:
                            k = put(mode, slot, vals, k, position + m, other + n, -mu_value * value)
            if rate_rows and any_block:
                # the derivative of Phi_q q' + Phi_t with respect to q
                for m in range(3):
                    value = 0.0
                    for n in range(12):
                        value += hess[3 * bm + m, n] * w[n]
                    if bm % 2 == 1:
                        value += euler_component(tab.kin[b], m, gt, 6 * (bm // 2) + 3)
                    k = put(mode, slot, vals, k, mu, position + m, coef * value)
    return k


@njit(cache=True, error_model="numpy")
def tape_row_entries(mode, t, r, y, yp, cj, idata, tab, slot, vals, k):
    """Entries of a constraint row given by an expression.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`; returned is the number of the next entry.
    t
        S.
    r : int
        Constraint row.
    y, yp
        Unknowns and their derivatives.
    cj
        Factor of dG/dy'.
    idata
        Header and tables of integers.
    tab
        Named views of the tables, up to date with y.
    """
    rate_rows = has_rate_rows(idata[T.H_FORMULATION])
    lam, mu = idata[T.H_LAMBDA] + r, idata[T.H_MU] + r
    lam_value, mu_value = multipliers_of_row(r, y, yp, idata)
    factor = multiplier_factor(cj, idata)
    tape = tab.row[r, T.ROW_TAPE]
    bodies = tab.tape[tape, T.TAPE_N_BODIES]
    first = tab.tape[tape, T.TAPE_BODIES]
    n = 6 * bodies + 1
    room = expression_loads.tail(tab, n * (n + 1))
    grad, hess = room[0:n], room[n:]
    expression_loads.second(tape, t, y, tab, grad, hess)
    if idata[T.H_FRAMES] > idata[T.H_BODIES]:
        frames = vector_at(tab.extra_i, first, bodies)
        in_time = np.empty(n)
        for i in range(n):
            in_time[i] = hess[i * n + n - 1]
        return put_row(
            mode, slot, vals, k, frames, bodies, 0, grad, in_time, hess, n, 1.0, np.array([lam, mu]),
            lam_value, mu_value, factor, rate_rows, y, tab.at, tab.partial,
        )  # fmt: skip
    for i in range(n - 1):
        at = tab.at[tab.extra_i[first + i // 6]]
        turn = i % 6 >= 3
        position = (at[T.AT_THETA] if turn else at[T.AT_R]) + i % 3
        speed = (at[T.AT_EPS] if turn else at[T.AT_U]) + i % 3
        force = (at[T.AT_P] if turn else at[T.AT_U]) + i % 3
        k = put(mode, slot, vals, k, lam, position, grad[i])
        k = put(mode, slot, vals, k, force, lam, factor * grad[i])
        rate = hess[i * n + n - 1]
        for j in range(n - 1):
            at2 = tab.at[tab.extra_i[first + j // 6]]
            turn2 = j % 6 >= 3
            other = (at2[T.AT_THETA] if turn2 else at2[T.AT_R]) + j % 3
            rate += hess[i * n + j] * y[(at2[T.AT_EPS] if turn2 else at2[T.AT_U]) + j % 3]
            k = put(mode, slot, vals, k, force, other, lam_value * hess[i * n + j])
            if rate_rows:
                k = put(mode, slot, vals, k, position, other, -mu_value * hess[i * n + j])
        if rate_rows:
            k = put(mode, slot, vals, k, position, mu, -factor * grad[i])
            k = put(mode, slot, vals, k, mu, speed, grad[i])
            k = put(mode, slot, vals, k, mu, position, rate)
    return k


@njit(cache=True, error_model="numpy")
def chain_entries(mode, base, d, sign, bodies, first, unknowns, after, tab, slot, vals, k):
    """Entries of one row from the spatial gradient ``d`` over a list of bodies, then of unknowns.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`; returned is the number of the next entry.
    base : int
        Row of the entries.
    d, sign : ndarray, float
        Derivatives by the variations of the frames, 12 each, then by unknowns, and their factor.
    bodies, first : int
        Number of frames, and where among the extra integers they are.
    unknowns, after : int
        Number of unknowns, and where they are.
    tab
        Named views of the tables, up to date with y.
    """
    for q in range(bodies):
        b = tab.extra_i[first + q]
        if b == 0:
            continue
        col = 12 * q
        if is_elastic(b, tab.at):
            k = put_chain(mode, slot, vals, k, base, b, d, col, sign, tab.at, tab.kin, tab.partial)
            continue
        kin, at = tab.kin[b], tab.at[b]
        for m in range(3):
            turn = euler_component(kin, m, d, col + 3) + terms.dot3(kin, KIN_DW + 3 * m, d, col + 9)
            spin = euler_component(kin, m, d, col + 9)
            k = put(mode, slot, vals, k, base, at[T.AT_R] + m, sign * d[col + m])
            k = put(mode, slot, vals, k, base, at[T.AT_THETA] + m, sign * turn)
            k = put(mode, slot, vals, k, base, at[T.AT_U] + m, sign * d[col + 6 + m])
            k = put(mode, slot, vals, k, base, at[T.AT_EPS] + m, sign * spin)
    for q in range(unknowns):
        k = put(mode, slot, vals, k, base, tab.extra_i[after + q], sign * d[12 * bodies + q])
    return k


@njit(cache=True, error_model="numpy")
def state_entries(mode, t, s, y, cj, idata, tab, slot, vals, k):
    """Entries of the equation of one user-defined state.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`; returned is the number of the next entry.
    t
        S.
    s : int
        Number of the state.
    y
        Unknowns.
    cj
        Factor of dG/dy'.
    idata
        Header and tables of integers.
    tab
        Named views of the tables, up to date with y.
    """
    z = idata[T.H_Z] + s
    k = put(mode, slot, vals, k, z, z, cj if tab.state[s, T.STATE_KIND] == T.STATE_DIFFERENTIAL else 1.0)
    tape = tab.state[s, T.STATE_TAPE]
    row = tab.tape[tape]
    grad = expression_loads.tail(tab, expression_loads.gradient_size(row))
    expression_loads.gradient(tape, t, y, tab, grad)
    bodies, first = row[T.TAPE_N_BODIES], row[T.TAPE_BODIES]
    return chain_entries(
        mode,
        z,
        grad,
        -1.0,
        bodies,
        first,
        row[T.TAPE_N_UNKNOWNS],
        first + bodies,
        tab,
        slot,
        vals,
        k,
    )


@njit(cache=True, error_model="numpy")
def load_entries(mode, b, sign, row, y, tab, slot, vals, k):
    """Entries of one force element's loads on body b in the rows of eq. (5).

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`; returned is the number of the next entry.
    b, sign : int, float
        The frame that feels the load, 1 for that of I and -1 for that of J.
    row : ndarray of int
        Row of the force element.
    y
        Unknowns.
    tab
        Named views of the tables, up to date with y.
    """
    if b == 0:
        return k
    at = tab.at[b]
    u, p, th = at[T.AT_U], at[T.AT_P], at[T.AT_THETA]
    f, n = row[T.FORCE_F], row[T.FORCE_N]
    if is_elastic(b, tab.at):
        arm = vector_at(tab.scratch, S_VECTOR, 18)
        load_at(b, sign, row, y, tab.marker_body, tab.kin, tab.frame, arm)
        return put_load(
            mode, slot, vals, k, b, sign, f, n, row[T.FORCE_I], arm, tab.at, tab.marker_body, tab.kin, tab.frame,
            tab.partial,
        )  # fmt: skip
    kin = tab.kin[b]
    point = row[T.FORCE_I]
    owner = tab.marker_body[point]
    s = vector_at(tab.scratch, S_VECTOR, 30)
    for c in range(3):
        s[3 + c] = 0.0
        s[6 + c] = 0.0
    if f >= 0:
        arm_to(b, point, tab.marker_body, tab.kin, tab.frame, s, 0)
        for c in range(3):
            s[3 + c] = sign * y[f + c]
        terms.cross3(s, 0, s, 3, s, 6)
    if n >= 0:
        for c in range(3):
            s[6 + c] += sign * y[n + c]
    for m in range(3):
        a = KIN_AXES + 3 * m
        for c in range(3):
            if f >= 0:
                if m == 0:
                    k = put(mode, slot, vals, k, u + c, f + c, -sign)
                # a . (s x e_c) = (a x s)_c
                terms.cross3(kin, a, s, 0, s, 9)
                k = put(mode, slot, vals, k, p + m, f + c, -sign * s[9 + c])
            if n >= 0:
                k = put(mode, slot, vals, k, p + m, n + c, -sign * kin[a + c])
        for l in range(3):
            value = 0.0
            if l < m:
                terms.cross3(kin, KIN_AXES + 3 * l, kin, a, s, 9)
                value = terms.dot3(s, 9, s, 6)
            if f >= 0 and owner == b:
                # the arm turns with the body
                terms.cross3(kin, KIN_AXES + 3 * l, s, 0, s, 9)
                terms.cross3(s, 9, s, 3, s, 12)
                value += terms.dot3(kin, a, s, 12)
            k = put(mode, slot, vals, k, p + m, th + l, -value)
        if f >= 0 and owner != b:
            # a . (ds x F) = ds . (F x a)
            terms.cross3(s, 3, kin, a, s, 9)
            for l in range(3):
                k = put(mode, slot, vals, k, p + m, at[T.AT_R] + l, s[9 + l])
            if is_elastic(owner, tab.at):
                k = put_arm(
                    mode, slot, vals, k, p + m, owner, point, s, -1.0, tab.at, tab.marker_body, tab.kin, tab.frame,
                    tab.partial, False,
                )  # fmt: skip
            elif owner > 0:
                owners = tab.at[owner]
                for l in range(3):
                    terms.cross3(tab.kin[owner], KIN_AXES + 3 * l, tab.frame[point], 0, s, 12)
                    k = put(mode, slot, vals, k, p + m, owners[T.AT_R] + l, -s[9 + l])
                    k = put(mode, slot, vals, k, p + m, owners[T.AT_THETA] + l, -terms.dot3(s, 9, s, 12))
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def element_entries(mode, t, row, y, yp, cj, idata, tab, slot, vals, k):
    """Entries of the rows F - F(q, q', t) and N - N(q, q', t) of one force element, and of its own states.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.entries.put`; returned is the number of the next entry.
    t
        S.
    row : ndarray of int
        Row of the force element.
    y, yp
        Unknowns and their derivatives.
    cj
        Factor of dG/dy'.
    idata
        Header and tables of integers.
    tab
        Named views of the tables, up to date with y.
    """
    width = row[T.FORCE_WIDTH]
    depends = row[T.FORCE_DEPENDS]
    bodies = tab.extra_i[depends]
    after = depends + 2 + bodies
    unknowns = tab.extra_i[after - 1]
    rows = matrix_at(tab.scratch, T.SCRATCH_FIXED, 6, width)
    if row[T.FORCE_KIND] == T.COMPILED:
        if row[T.FORCE_PART] == 0:
            evaluate_element(row, t, y, tab, np.int64(DERIVATIVES))
            rates = 6 * row[T.FORCE_WRENCHES]
            own = matrix_at(tab.scratch, T.SCRATCH_FIXED + rates * width, row[T.FORCE_STATES], width)
            for q in range(row[T.FORCE_STATES]):
                z = row[T.FORCE_Z] + q
                kind = tab.state[z - idata[T.H_Z], T.STATE_KIND]
                k = put(mode, slot, vals, k, z, z, cj if kind == T.STATE_DIFFERENTIAL else 1.0)
                k = chain_entries(
                    mode, z, own[q], -1.0, bodies, depends + 1, unknowns, after, tab, slot, vals, k
                )  # fmt: skip
        rows = matrix_at(tab.scratch, T.SCRATCH_FIXED + 6 * row[T.FORCE_PART] * width, 6, width)
    else:
        wrench = vector_at(tab.scratch, S_WRENCH, 6)
        if row[T.FORCE_KIND] == T.REACTION:
            si1 = idata[T.H_FORMULATION] == SI1
            source = yp if si1 else y
            lam = idata[T.H_LAMBDA]
            room = vector_at(tab.scratch, 0, 64)
            reaction_wrench(row, source[lam : lam + idata[T.H_ROWS]], lam, tab, room, wrench, rows, np.int64(1))
            if si1:
                for c in range(12 * bodies, width):
                    for r in range(6):
                        rows[r, c] *= cj
        else:
            expression_loads.load(row, t, y, tab, wrench, rows, np.int64(1))
    for block in range(2):
        base = row[T.FORCE_F + block]
        if base < 0:
            continue
        for c in range(3):
            k = put(mode, slot, vals, k, base + c, base + c, 1.0)
            k = chain_entries(
                mode, base + c, rows[3 * block + c], -1.0, bodies, depends + 1, unknowns, after, tab, slot, vals,
                k,
            )  # fmt: skip
    return k


@njit(JACOBIAN_SIG, cache=True, error_model="numpy")
def jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """Evaluate dG/dy + cj dG/dy' into ``vals``, CSC order.

    Asked for it in the header, count the entries or write their rows and columns instead.

    Parameters
    ----------
    t
        S.
    y, yp
        Unknowns and their derivatives.
    cj
        Factor of dG/dy'.
    vals : ndarray
        Values in CSC order, or what the header asks for.
    idata, rdata, work : ndarray
        The packed tables and the work array.
    """
    y, yp, vals, idata = uncounted(y), uncounted(yp), uncounted(vals), uncounted(idata)
    tab = T.unpack(idata, rdata, work)
    mode = idata[T.H_MODE]
    update_tables(t, y, tab, True)
    slot = tab.slot
    if mode == NUMBERS:
        for k in range(vals.size):
            vals[k] = 0.0
        for k in range(idata[T.H_QF] - idata[T.H_THETA]):
            tab.seen[k] = y[idata[T.H_THETA] + k]
    # a literal 0 would make numba compile every callee once more
    k = np.int64(0)
    for b in range(1, idata[T.H_BODIES]):
        for l in range(3):
            tab.scratch[S_PRODUCT + l] = y[tab.at[b, T.AT_EPS] + l]
        k = body_entries(mode, b, cj, tab, slot, vals, k)
        if tab.at[b, T.AT_MODES] > 0:
            k = modal_body_entries(mode, cj, y, tab.at[b], tab.modal, tab.partial, tab.kin[b], slot, vals, k)
    for r in range(idata[T.H_ROWS]):
        k = row_entries(mode, r, y, yp, cj, idata, tab, slot, vals, k)
        if tab.row[r, T.ROW_TAPE] >= 0:
            k = tape_row_entries(mode, t, r, y, yp, cj, idata, tab, slot, vals, k)
    for f in range(idata[T.H_FORCES]):
        row = tab.force[f]
        if row[T.FORCE_KIND] != T.REACTION:
            k = load_entries(mode, tab.marker_body[row[T.FORCE_I]], 1.0, row, y, tab, slot, vals, k)
            k = load_entries(mode, tab.marker_body[row[T.FORCE_J]], -1.0, row, y, tab, slot, vals, k)
        k = element_entries(mode, t, row, y, yp, cj, idata, tab, slot, vals, k)
    for s in range(idata[T.H_STATES]):
        if tab.state[s, T.STATE_TAPE] >= 0:
            k = state_entries(mode, t, s, y, cj, idata, tab, slot, vals, k)
    if mode == COUNT:
        vals[0] = k


def pattern(idata: np.ndarray, rdata: np.ndarray, work_size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots): the CSC pattern and, for each entry in walking order, its place in it."""
    n = int(idata[T.H_UNKNOWNS])
    y, work, count = np.zeros(n), np.zeros(work_size), np.zeros(1)
    ask = idata.copy()
    ask[T.H_MODE] = COUNT
    jacobian(0.0, y, y, 1.0, count, ask, rdata.copy(), work)
    places = np.zeros(2 * int(count[0]))
    ask[T.H_MODE] = PLACES
    jacobian(0.0, y, y, 1.0, places, ask, rdata.copy(), work)
    return compressed(places.reshape(-1, 2).astype(np.int64), n)
