"""Entries of the exact Jacobian from force elements and user-defined states: their equations, their loads."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.frames import is_elastic
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.kinematics import euler_component
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.loads.elastic import load_at, put_arm, put_chain, put_load
from gearmbs.dae.equations.loads.forces import DERIVATIVES, evaluate_element
from gearmbs.dae.equations.loads.reactions import reaction_wrench
from gearmbs.dae.equations.residual import S_VECTOR, S_WRENCH, arm_to
from gearmbs.dae.equations.rotation import KIN_AXES, KIN_DW
from gearmbs.dae.equations.unknowns import multipliers_are_rates, put
from gearmbs.kernels.jit import njit
from gearmbs.kernels.pointers import F8, I8, IVEC, VEC
from gearmbs.kernels.structs import matrix_at, uncounted, vector_at


@njit(cache=True, error_model="numpy", forceinline=True)
def chain_entries(mode, base, d, sign, bodies, first, unknowns, after, tab, slot, vals, k):
    """Entries of one row from the spatial gradient ``d`` over a list of bodies, then of unknowns.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
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
    slot, vals, d = uncounted(slot), uncounted(vals), uncounted(d)
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


@njit(I8(I8, F8, I8, VEC, F8, IVEC, T.TABLES, IVEC, VEC, I8), cache=True, late=True, error_model="numpy")
def state_entries(mode, t, s, y, cj, idata, tab, slot, vals, k):
    """Entries of the equation of one user-defined state.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    t
        Time, s.
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
    grad = expressions.tail(tab, expressions.gradient_size(row))
    expressions.gradient(tape, t, y, tab, grad)
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
def far_arm_entries(mode, base, b, point, a, s, tab, slot, vals, k):
    """Entries of a force on body b at a marker of another body, as the arm changes with both.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    base : int
        Row of the entries, that of an Euler angle of b.
    b, point : int
        The body, and the marker.
    a : int
        Columns of b's row of the kinematics table with the angle's axis.
    s : ndarray
        The force in the places 3 to 5; those from 9 on are overwritten.
    tab
        Named views of the tables, up to date with y.
    """
    kin, at, owner = tab.kin[b], tab.at[b], tab.marker_body[point]
    # a . (ds x F) = ds . (F x a)
    terms.cross3(s, 3, kin, a, s, 9)
    for l in range(3):
        k = put(mode, slot, vals, k, base, at[T.AT_R] + l, s[9 + l])
    if is_elastic(owner, tab.at):
        k = put_arm(
            mode, slot, vals, k, base, owner, point, s, -1.0, tab.at, tab.marker_body, tab.kin, tab.frame,
            tab.partial, False,
        )  # fmt: skip
    elif owner > 0:
        owners = tab.at[owner]
        for l in range(3):
            terms.cross3(tab.kin[owner], KIN_AXES + 3 * l, tab.frame[point], 0, s, 12)
            k = put(mode, slot, vals, k, base, owners[T.AT_R] + l, -s[9 + l])
            k = put(mode, slot, vals, k, base, owners[T.AT_THETA] + l, -terms.dot3(s, 9, s, 12))
    return k


@njit(cache=True, error_model="numpy")
def load_entries(mode, b, sign, row, y, tab, slot, vals, k):
    """Entries of one force element's loads on body b in the rows of eq. (5).

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
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
    slot, vals, y = uncounted(slot), uncounted(vals), uncounted(y)
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
            k = far_arm_entries(mode, p + m, b, point, a, s, tab, slot, vals, k)
    return k


@njit(cache=True, error_model="numpy", forceinline=True)
def element_entries(mode, t, row, y, yp, cj, idata, tab, slot, vals, k):
    """Entries of the rows F - F(q, q', t) and N - N(q, q', t) of one force element, and of its own states.

    Parameters
    ----------
    mode, slot, vals, k
        As of `gearmbs.dae.equations.unknowns.put`; returned is the number of the next entry.
    t
        Time, s.
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
            si1 = multipliers_are_rates(idata[T.H_FORMULATION])
            source = yp if si1 else y
            lam = idata[T.H_LAMBDA]
            room = vector_at(tab.scratch, 0, 64)
            reaction_wrench(row, source[lam : lam + idata[T.H_ROWS]], lam, tab, room, wrench, rows, np.int64(1))
            if si1:
                for c in range(12 * bodies, width):
                    for r in range(6):
                        rows[r, c] *= cj
        else:
            expressions.load(row, t, y, tab, wrench, rows, np.int64(1))
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
