"""The exact sparse Jacobian dG/dy + cj dG/dy' of the residual, and its pattern.

One routine walks through the entries in a fixed order.  Asked for the pattern it records their places;
asked for numbers it adds each entry to its slot of the CSC values, so both can never disagree.
"""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.inertia import modal_body_entries
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.jacobian import row_entries, tape_row_entries
from gearmbs.dae.equations.kinematics.rotation import KIN_ADOT, KIN_AXES, KIN_H
from gearmbs.dae.equations.kinematics.update import inertia_times, update_tables
from gearmbs.dae.equations.loads.jacobian import element_entries, load_entries, state_entries
from gearmbs.dae.equations.residual import S_PRODUCT, S_TERM
from gearmbs.dae.equations.unknowns import COUNT, NUMBERS, PLACES, compressed, put
from gearmbs.dae.problem import JACOBIAN_SIG
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import uncounted, vector_at

J_AXES, J_AXIS_RATES, TURNED_MOMENTUM, CROSS = 0, 9, 18, 30
"""Places in the scratch of `body_entries`: J a_m, J adot_m, and dh/dtheta_m = a_m x h + J adot_m, three vectors each;
then two vectors that come and go."""
CROSS_2 = CROSS + 3


@njit(cache=True, error_model="numpy", forceinline=True)
def body_entries(mode, b, cj, tab, slot, vals, k):
    """Entries of one body's inertia terms in eq. (5) and (6)."""
    at = tab.at[b]
    u, p, e, r, th = at[T.AT_U], at[T.AT_P], at[T.AT_EPS], at[T.AT_R], at[T.AT_THETA]
    kin = tab.kin[b]
    s = vector_at(tab.scratch, S_TERM, 100)
    mass = tab.body[b, T.BODY_MASS]
    for m in range(3):
        axis, axis_rate, turned = KIN_AXES + 3 * m, KIN_ADOT + 3 * m, TURNED_MOMENTUM + 3 * m
        inertia_times(kin, tab.body[b], kin, axis, s, J_AXES + 3 * m, s[CROSS:CROSS_2])
        inertia_times(kin, tab.body[b], kin, axis_rate, s, J_AXIS_RATES + 3 * m, s[CROSS:CROSS_2])
        terms.cross3(kin, axis, kin, KIN_H, s, turned)
        for c in range(3):
            s[turned + c] += s[J_AXIS_RATES + 3 * m + c]
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
            k = put(mode, slot, vals, k, e + m, e + n, -terms.dot3(kin, KIN_AXES + 3 * m, s, J_AXES + 3 * n))
            mixed_mn = terms.dot3(kin, KIN_ADOT + 3 * n, s, J_AXES + 3 * m)
            if m < n:
                terms.cross3(kin, KIN_AXES + 3 * m, kin, KIN_AXES + 3 * n, s, CROSS)
                mixed_mn += terms.dot3(s, CROSS, kin, KIN_H)
            # d2T/d(eps_m)d(theta_n) serves p - L_eps and p' - L_theta
            k = put(mode, slot, vals, k, e + m, th + n, -mixed_mn)
            k = put(mode, slot, vals, k, p + n, e + m, -mixed_mn)
    for m in range(3):
        for n in range(3):
            value = terms.dot3(kin, KIN_ADOT + 3 * m, s, TURNED_MOMENTUM + 3 * n)
            if n < m:
                # d(adot_m)/d(theta_n) . h, with adot_m = sum_{l<m} eps_l a_l x a_m
                for l in range(m):
                    lo, hi = min(n, l), max(n, l)
                    terms.cross3(kin, KIN_AXES + 3 * hi, kin, KIN_AXES + 3 * m, s, CROSS)
                    terms.cross3(kin, KIN_AXES + 3 * lo, s, CROSS, s, CROSS_2)
                    value += tab.scratch[S_PRODUCT + l] * terms.dot3(s, CROSS_2, kin, KIN_H)
            k = put(mode, slot, vals, k, p + m, th + n, -value)
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
        for j in range(vals.size):
            vals[j] = 0.0
        for j in range(idata[T.H_QF] - idata[T.H_THETA]):
            tab.seen[j] = y[idata[T.H_THETA] + j]
    # a literal 0 would make numba compile every callee once more
    k = np.int64(0)
    for b in range(1, idata[T.H_BODIES]):
        for l in range(3):
            tab.scratch[S_PRODUCT + l] = y[tab.at[b, T.AT_EPS] + l]
        k = body_entries(mode, b, cj, tab, slot, vals, k)
        if tab.at[b, T.AT_MODES] > 0:
            s = vector_at(tab.scratch, S_TERM, 30)
            k = modal_body_entries(mode, cj, y, tab.at[b], tab.modal, tab.partial, tab.kin[b], s, slot, vals, k)
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
    for z in range(idata[T.H_STATES]):
        if tab.state[z, T.STATE_TAPE] >= 0:
            k = state_entries(mode, t, z, y, cj, idata, tab, slot, vals, k)
    if mode == COUNT:
        vals[0] = k


def pattern(
    idata: np.ndarray, rdata: np.ndarray, work_size: int, t: float, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots): the CSC pattern and, for each entry in walking order, its place in it.

    It is that of any t and y; functions of the user may be defined at some only.
    """
    n = y.size
    yp, work, count = np.zeros(n), np.zeros(work_size), np.zeros(1)
    ask = idata.copy()
    ask[T.H_MODE] = COUNT
    jacobian(t, y, yp, 1.0, count, ask, rdata.copy(), work)
    places = np.zeros(2 * int(count[0]))
    ask[T.H_MODE] = PLACES
    jacobian(t, y, yp, 1.0, places, ask, rdata.copy(), work)
    return compressed(places.reshape(-1, 2).astype(np.int64), n)
