"""Entries of the exact Jacobian from constraint rows, eq. (7), their rates, and the forces of their multipliers."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.frames import is_elastic, touches_elastic
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.elastic import put_linear_side, put_row
from gearmbs.dae.equations.kinematics import euler_component
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_HESSIAN, S_TERM, S_VECTOR
from gearmbs.dae.equations.unknowns import has_rate_rows, multiplier_factor, multipliers_of_row, put
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.pointers import F8, I8, IVEC, VEC
from gearmbs.kernels.structs import matrix_at, vector_at


@njit(cache=True, error_model="numpy", forceinline=True)
def linear_sides(kind):
    """Return on which sides (1: I, 2: J) a term is linear in the displacement and blind to the rotation of a frame."""
    return 3 if kind == terms.POINT else 1 if kind == terms.DOT2 else 0


@njit(cache=True, error_model="numpy", forceinline=True)
def is_linear(term, marker_body, bodies):
    """Return whether a term is a sum of elastic frames' displacements times constants: axes on the ground stay."""
    i, j = marker_body[term[T.TERM_I]], marker_body[term[T.TERM_J]]
    if term[T.TERM_TYPE] == terms.DOT2:
        return j == 0
    return term[T.TERM_TYPE] == terms.POINT and (i == 0 or i >= bodies) and (j == 0 or j >= bodies)


@njit(
    I8(I8, I8, F8, F8, F8, F8, types.boolean, I8, I8, VEC, VEC, VEC, T.TABLES, IVEC, VEC, I8),
    cache=True,
    late=True,
    error_model="numpy",
)
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
def gradient_entries(mode, j, r, cj, idata, tab, slot, vals, k):
    """Entries of the gradient of term j, which has just been evaluated, in row r and in the forces of its multipliers.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    j, r : int
        The term, and its constraint row.
    cj : float
        Factor of dG/dy'.
    idata
        Header and tables of integers.
    tab
        Named views of the tables, up to date with y.
    """
    rate_rows = has_rate_rows(idata[T.H_FORMULATION])
    lam, mu = idata[T.H_LAMBDA] + r, idata[T.H_MU] + r
    factor = multiplier_factor(cj, idata)
    coef, kind = tab.coef[j], tab.term[j, T.TERM_TYPE]
    g = vector_at(tab.scratch, S_GRADIENT, 12)
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
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def hessian_entries(mode, j, r, lam, mu, y, idata, tab, slot, vals, k):
    """Entries of the Hessian of term j, which has just been evaluated: its multipliers' forces, and the rate of row r.

    Parameters
    ----------
    mode, j, r, idata, tab, slot, vals, k
        As of `gradient_entries`.
    lam, mu : float
        Multipliers of the row.
    y : ndarray
        Unknowns.
    """
    rate_rows, rate_row = has_rate_rows(idata[T.H_FORMULATION]), idata[T.H_MU] + r
    coef, kind = tab.coef[j], tab.term[j, T.TERM_TYPE]
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    hess = matrix_at(tab.scratch, S_HESSIAN, 12, 12)
    w = vector_at(tab.scratch, S_VECTOR, 12)
    for side in range(2):
        b = tab.marker_body[tab.term[j, T.TERM_I + side]]
        h, at = 6 * side, tab.at[b]
        for c in range(3):
            w[h + c] = y[at[T.AT_U] + c] if b > 0 else 0.0
            w[h + 3 + c] = y[at[T.AT_EPS] + c] if b > 0 else 0.0
    for bm in range(4):
        b = tab.marker_body[tab.term[j, T.TERM_I + bm // 2]]
        if b == 0:
            continue
        force_row = tab.at[b, T.AT_P] if bm % 2 == 1 else tab.at[b, T.AT_U]
        position = tab.at[b, T.AT_THETA] if bm % 2 == 1 else tab.at[b, T.AT_R]
        any_block = False
        for bn in range(4):
            b2 = tab.marker_body[tab.term[j, T.TERM_I + bn // 2]]
            if b2 == 0 or not terms.HESSIAN_BLOCKS[kind, bm, bn]:
                continue
            any_block = True
            other = tab.at[b2, T.AT_THETA] if bn % 2 == 1 else tab.at[b2, T.AT_R]
            for m in range(3):
                for n in range(3):
                    value = coef * hess[3 * bm + m, 3 * bn + n]
                    k = put(mode, slot, vals, k, force_row + m, other + n, lam * value)
                    if rate_rows:
                        k = put(mode, slot, vals, k, position + m, other + n, -mu * value)
        if rate_rows and any_block:
            # the derivative of Phi_q q' + Phi_t with respect to q
            for m in range(3):
                value = 0.0
                for n in range(12):
                    value += hess[3 * bm + m, n] * w[n]
                if bm % 2 == 1:
                    value += euler_component(tab.kin[b], m, gt, 6 * (bm // 2) + 3)
                k = put(mode, slot, vals, k, rate_row, position + m, coef * value)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def row_entries(mode, r, y, yp, cj, idata, tab, slot, vals, k):
    """Entries of one constraint row, its derivative, and the forces of its multipliers.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
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
    frames_are_elastic = idata[T.H_FRAMES] > idata[T.H_BODIES]
    for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
        coef = tab.coef[j]
        terms.gradient(j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt)
        elastic = frames_are_elastic and touches_elastic(tab.term[j], tab.marker_body, tab.code.size)
        if elastic and is_linear(tab.term[j], tab.marker_body, tab.code.size):
            for side in range(2):
                b = tab.marker_body[tab.term[j, T.TERM_I + side]]
                if b > 0:
                    k = put_linear_side(
                        mode, slot, vals, k, b, g, gt, 6 * side, coef, lam, mu, lam_value, mu_value, factor,
                        rate_rows, tab.at, tab.partial,
                    )  # fmt: skip
            continue
        terms.hessian(j, tab.term, tab.fval, tab.marker_body, tab.kin, tab.frame, hess, s)
        if elastic:
            k = elastic_term_entries(
                mode, j, coef, lam_value, mu_value, factor, rate_rows, lam, mu, y, g, gt, tab, slot, vals, k
            )
            continue
        k = gradient_entries(mode, j, r, cj, idata, tab, slot, vals, k)
        k = hessian_entries(mode, j, r, lam_value, mu_value, y, idata, tab, slot, vals, k)
    return k


@njit(I8(I8, F8, I8, VEC, VEC, F8, IVEC, T.TABLES, IVEC, VEC, I8), cache=True, late=True, error_model="numpy")
def tape_row_entries(mode, t, r, y, yp, cj, idata, tab, slot, vals, k):
    """Entries of a constraint row given by an expression.

    Parameters
    ----------
    mode, r, y, yp, cj, idata, tab, slot, vals, k
        As of `row_entries`.
    t : float
        Time, s.
    """
    rate_rows = has_rate_rows(idata[T.H_FORMULATION])
    lam, mu = idata[T.H_LAMBDA] + r, idata[T.H_MU] + r
    lam_value, mu_value = multipliers_of_row(r, y, yp, idata)
    factor = multiplier_factor(cj, idata)
    tape = tab.row[r, T.ROW_TAPE]
    bodies = tab.tape[tape, T.TAPE_N_BODIES]
    first = tab.tape[tape, T.TAPE_BODIES]
    n = 6 * bodies + 1
    room = expressions.tail(tab, n * (n + 1))
    grad, hess = room[0:n], room[n:]
    expressions.second(tape, t, y, tab, grad, hess)
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
