"""Accelerations and multipliers from the index-1 linear system at given (t, q, v).

    [ M  Phi_q^T ] [ a      ]   [ Q                     ]
    [ Phi_q  0   ] [ lambda ] = [ -(Phi_q v)_q v - ...  ]

in the spatial velocities (v, omega) of the bodies, in which no orientation is singular.  Solved once
per output time, it gives reaction forces that are free of the integrator's noise.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from gearmbs.dae import tables as T
from gearmbs.dae import terms, timefunctions
from gearmbs.dae.forces import element_wrench
from gearmbs.dae.kinematics import inertia_times, update_bodies, update_markers
from gearmbs.dae.residual import S_DIAG, S_GRADIENT, S_GRADIENT_T, S_TERM, S_VECTOR, S_WRENCH, arm_to
from gearmbs.dae.rotation import KIN_A, KIN_H, KIN_R, KIN_V, KIN_W

NUMBERS, PLACES, COUNT = 0, 1, 2

SUMMARY = 3
"""Per force element: F, N, then eight diagnostics of a contact."""
FORCE_RECORD = 14


@njit(cache=True, inline="always")
def put(mode, places, slot, vals, k, row, col, value):
    if mode == NUMBERS:
        vals[slot[k]] += value
    elif mode == PLACES:
        places[k, 0] = row
        places[k, 1] = col
    return k + 1


@njit(cache=True)
def apply_load(b, sign, row, wrench, tab, rhs):
    if b == 0:
        return
    s = tab.scratch[S_VECTOR : S_VECTOR + 12]
    arm_to(b, row[T.FORCE_I], tab.marker_body, tab.kin, tab.frame, s, 0)
    terms.cross3(s, 0, wrench, 0, s, 3)
    k = 6 * (b - 1)
    for c in range(3):
        rhs[k + c] += sign * wrench[c]
        rhs[k + 3 + c] += sign * (s[3 + c] + wrench[3 + c])


@njit(
    "int64(int64, float64, float64[::1], int64[:, ::1], int64[::1], float64[::1], float64[::1], float64[::1], "
    "float64[:, ::1], int64[::1], float64[::1], float64[::1])",
    cache=True,
)
def saddle(mode, t, y, places, slot, vals, rhs, phi, loads, idata, rdata, work):
    """Assemble the saddle-point matrix (by slots) and right-hand side; return the number of entries.

    ``phi`` receives 3 values a row one after the other: Phi, Phi_q v + Phi_t, Phi_t.
    ``loads[f]`` receives F, N and the diagnostics of force element f.
    """
    tab = T.unpack(idata, rdata, work)
    update_bodies(idata, y, tab.code, tab.body, tab.kin, tab.scratch)
    update_markers(tab.marker_body, tab.marker, tab.kin, tab.frame)
    bodies, rows = idata[T.H_BODIES], idata[T.H_ROWS]
    base = 6 * (bodies - 1)
    s = tab.scratch[S_TERM : S_TERM + 100]
    for c in range(rhs.size):
        rhs[c] = 0.0
    k = 0
    for b in range(1, bodies):
        kin = tab.kin[b]
        i = 6 * (b - 1)
        mass = tab.body[b, T.BODY_MASS]
        for c in range(3):
            k = put(mode, places, slot, vals, k, i + c, i + c, mass)
            rhs[i + c] = mass * tab.gravity[c]
            s[0] = s[1] = s[2] = 0.0
            s[c] = 1.0
            inertia_times(kin, tab.body[b], s, 0, s, 3, s[6:9])
            for d in range(3):
                k = put(mode, places, slot, vals, k, i + 3 + d, i + 3 + c, s[3 + d])
        terms.cross3(kin, KIN_H, kin, KIN_W, rhs, i + 3)
    g = tab.scratch[S_GRADIENT : S_GRADIENT + 12]
    gt = tab.scratch[S_GRADIENT_T : S_GRADIENT_T + 12]
    for r in range(rows):
        value, rate, partial, gamma = 0.0, 0.0, 0.0, 0.0
        if tab.row[r, T.ROW_FUNCTION] >= 0:
            fun = tab.row[r, T.ROW_FUNCTION]
            f, f1, f2 = timefunctions.evaluate(tab.function[fun, 0], tab.function_r, tab.function[fun, 1], t)
            value, rate, partial, gamma = -f, -f1, -f1, -f2
        for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            coef = tab.coef[j]
            p, p_t = terms.gradient(
                j,
                t,
                tab.term,
                tab.function,
                tab.function_r,
                tab.reference,
                tab.marker_body,
                tab.kin,
                tab.frame,
                s,
                g,
                gt,
            )
            value += coef * p
            rate += coef * p_t
            partial += coef * p_t
            gamma += coef * terms.quadratic_part(
                j, t, tab.term, tab.function, tab.function_r, tab.marker_body, tab.kin, tab.frame, s
            )
            for side in range(2):
                b = tab.marker_body[tab.term[j, T.TERM_I + side]]
                if b == 0:
                    continue
                h, q = 6 * side, 6 * (b - 1)
                kin = tab.kin[b]
                rate += coef * (terms.dot3(g, h, kin, KIN_V) + terms.dot3(g, h + 3, kin, KIN_W))
                for c in range(6):
                    k = put(mode, places, slot, vals, k, base + r, q + c, coef * g[h + c])
                    k = put(mode, places, slot, vals, k, q + c, base + r, coef * g[h + c])
        rhs[base + r] = -gamma
        phi[3 * r], phi[3 * r + 1], phi[3 * r + 2] = value, rate, partial
    if mode == NUMBERS:
        wrench = tab.scratch[S_WRENCH : S_WRENCH + 6]
        diag = tab.scratch[S_DIAG : S_DIAG + 8]
        for f in range(idata[T.H_FORCES]):
            row = tab.force[f]
            width = row[T.FORCE_WIDTH]
            jac = tab.scratch[T.SCRATCH_FIXED : T.SCRATCH_FIXED + 6 * width].reshape(6, width)
            for c in range(8):
                diag[c] = 0.0
            element_wrench(row, t, y, tab, wrench, jac, diag, 0)
            for c in range(6):
                loads[f, c] = wrench[c]
            for c in range(8):
                loads[f, 6 + c] = diag[c]
            apply_load(tab.marker_body[row[T.FORCE_I]], 1.0, row, wrench, tab, rhs)
            apply_load(tab.marker_body[row[T.FORCE_J]], -1.0, row, wrench, tab, rhs)
    return k


@njit(
    "void(float64[::1], int64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1])",
    cache=True,
)
def joint_loads(y, idata, rdata, work, multipliers, force, moment):
    """Reaction of each constraint row on I's body: force, and moment about the origin of marker I, global.

    The kinematics tables must be up to date; ``multipliers[0]`` holds lambda.
    """
    tab = T.unpack(idata, rdata, work)
    g = tab.scratch[S_GRADIENT : S_GRADIENT + 12]
    gt = tab.scratch[S_GRADIENT_T : S_GRADIENT_T + 12]
    s = tab.scratch[S_TERM : S_TERM + 100]
    for r in range(idata[T.H_ROWS]):
        for c in range(3):
            force[r, c] = 0.0
            moment[r, c] = 0.0
        lam = multipliers[0, r]
        j = tab.row[r, T.ROW_FIRST]
        terms.gradient(
            j,
            multipliers[1, 0],
            tab.term,
            tab.function,
            tab.function_r,
            tab.reference,
            tab.marker_body,
            tab.kin,
            tab.frame,
            s,
            g,
            gt,
        )
        coef = tab.coef[j]
        arm = tab.frame[tab.term[j, T.TERM_I]]
        for c in range(3):
            force[r, c] = -lam * coef * g[c]
        terms.cross3(arm, T.MK_ARM, force[r], 0, s, 0)
        for c in range(3):
            moment[r, c] = -lam * coef * g[3 + c] - s[c]


@njit("void(float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])", cache=True)
def pose_record(y, idata, rdata, work, out):
    """Write R, A (row-major), v, omega of each body (18 values, the ground left out)."""
    tab = T.unpack(idata, rdata, work)
    update_bodies(idata, y, tab.code, tab.body, tab.kin, tab.scratch)
    for b in range(1, idata[T.H_BODIES]):
        k = 18 * (b - 1)
        for c in range(3):
            out[k + c] = tab.kin[b, KIN_R + c]
            out[k + 12 + c] = tab.kin[b, KIN_V + c]
            out[k + 15 + c] = tab.kin[b, KIN_W + c]
        for c in range(9):
            out[k + 3 + c] = tab.kin[b, KIN_A + c]


def pattern(idata: np.ndarray, rdata: np.ndarray, work_size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (indptr, indices, slots) of the saddle-point matrix in CSC form."""
    n = int(6 * (idata[T.H_BODIES] - 1) + idata[T.H_ROWS])
    y = np.zeros(int(idata[T.H_UNKNOWNS]))
    work = np.zeros(work_size)
    rhs, phi = np.zeros(n), np.zeros(3 * int(idata[T.H_ROWS]))
    loads = np.zeros((1, FORCE_RECORD))
    none, no_slot, no_vals = np.zeros((1, 2), dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros(1)
    count = saddle(COUNT, 0.0, y, none, no_slot, no_vals, rhs, phi, loads, idata, rdata, work)
    places = np.zeros((count, 2), dtype=np.int64)
    saddle(PLACES, 0.0, y, places, no_slot, no_vals, rhs, phi, loads, idata, rdata, work)
    key = places[:, 1] * n + places[:, 0]
    unique, slots = np.unique(key, return_inverse=True)
    columns, rows = np.divmod(unique, n)
    indptr = np.searchsorted(columns, np.arange(n + 1)).astype(np.int64)
    return indptr, rows.astype(np.int64), slots.astype(np.int64)
