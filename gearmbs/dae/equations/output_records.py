"""What is recorded of an output beside accelerations: the reactions of constraint rows, and the poses of bodies."""

from __future__ import annotations

from gearmbs._jit import njit
from gearmbs.dae.compiled.views import vector_at
from gearmbs.dae.equations import constraint_terms as terms
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_TERM
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_R,
    KIN_V,
    KIN_W,
    POSE_A,
    POSE_COLUMNS,
    POSE_R,
    POSE_V,
    POSE_W,
)
from gearmbs.dae.equations.update import update_bodies


@njit(cache=True, error_model="numpy", forceinline=True)
def loads_of_rows(multipliers, idata, tab, force, moment):
    """Write the reaction of each constraint row on I's body: force, and moment about the origin of marker I, global.

    The kinematics tables must be up to date. Of a row that couples several joints, the part that acts through the
    first one's marker I.
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


@njit(
    "void(float64[::1], int64[::1], float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], float64[:, ::1])",
    cache=True,
    error_model="numpy",
)
def joint_loads(y, idata, rdata, work, multipliers, force, moment):
    """Write the loads of `loads_of_rows`; ``multipliers[0]`` holds lambda."""
    loads_of_rows(multipliers[0], idata, T.unpack(idata, rdata, work), force, moment)


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
