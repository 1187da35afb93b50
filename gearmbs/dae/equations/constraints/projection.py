"""How far a position and velocity are off the constraints, and moving the bodies back onto them."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.bodies.body import displace_body
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.terms import OFFSET, RATE, RELATIVE, dot_motion, relative_motion
from gearmbs.dae.equations.kinematics.rotation import KIN_V, KIN_W
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.outputs.accelerations import ROW_PHI, ROW_RATE, ROW_RECORD, tape_row_rates
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_TERM, S_VECTOR
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import vector_at

ROUNDED_POSITION, ROUNDED_RATE = 1e-14, 1e-12
"""Violation of a constraint, m or rad, and its rate, m/s or rad/s, up to which no output is projected."""


@njit(cache=True, error_model="numpy", forceinline=True)
def largest_violation(phi):
    """Return the largest |Phi| of the rows of ``phi``, laid out as `saddle` writes them."""
    largest = 0.0
    for r in range(phi.size // ROW_RECORD):
        largest = max(largest, abs(phi[ROW_RECORD * r + ROW_PHI]))
    return largest


@njit(cache=True, error_model="numpy", forceinline=True)
def are_satisfied(phi, tab):
    """Whether Phi and its rate are zero up to rounding, so that a projection would move nothing but rounding."""
    satisfied = True
    for r in range(phi.size // ROW_RECORD):
        row = ROW_RECORD * r
        rounded, function = ROUNDED_POSITION, tab.row[r, T.ROW_FUNCTION]
        if function >= 0:
            # a prescribed motion is rounded: an angle grows with the turns
            rounded += EPS * abs(tab.fval[function, 0])
        satisfied &= abs(phi[row + ROW_PHI]) <= rounded
        satisfied &= abs(phi[row + ROW_RATE]) <= ROUNDED_RATE
    return satisfied


@njit(cache=True, error_model="numpy", forceinline=True)
def violations(t, y, phi, idata, tab):
    """Write Phi and Phi_q v + Phi_t of each row to ``phi``, as `saddle` does; return the fastest body's |omega|.

    The kinematics, marker and function tables must be up to date.
    """
    g = vector_at(tab.scratch, S_GRADIENT, 12)
    gt = vector_at(tab.scratch, S_GRADIENT_T, 12)
    s = vector_at(tab.scratch, S_TERM, 100)
    apart = vector_at(tab.scratch, S_VECTOR, RELATIVE)
    last_i = last_j = np.int64(-1)
    for r in range(idata[T.H_ROWS]):
        value, rate = 0.0, 0.0
        if tab.row[r, T.ROW_FUNCTION] >= 0:
            fun = tab.row[r, T.ROW_FUNCTION]
            value, rate = -tab.fval[fun, 0], -tab.fval[fun, 1]
        for j in range(tab.row[r, T.ROW_FIRST], tab.row[r + 1, T.ROW_FIRST]):
            coef = tab.coef[j]
            kind = tab.term[j, T.TERM_TYPE]
            if kind == terms.POINT or kind == terms.DOT1:
                if kind == terms.POINT:
                    if tab.term[j, T.TERM_I] != last_i or tab.term[j, T.TERM_J] != last_j:
                        last_i, last_j = tab.term[j, T.TERM_I], tab.term[j, T.TERM_J]
                        relative_motion(last_i, last_j, tab.marker_body, tab.kin, tab.frame, apart)
                    c = tab.term[j, T.TERM_AXES]
                    p, d = apart[OFFSET + c], apart[RATE + c]
                else:
                    p, d, _ = dot_motion(j, tab.term, tab.marker_body, tab.kin, tab.frame, s)
                value += coef * p
                rate += coef * d
                continue
            p, p_t = terms.gradient(j, tab.term, tab.fval, tab.reference, tab.marker_body, tab.kin, tab.frame, s, g, gt)
            value += coef * p
            rate += coef * p_t
            for side in range(2):
                kin = tab.kin[tab.marker_body[tab.term[j, T.TERM_I + side]]]
                rate += coef * (terms.dot3(g, 6 * side, kin, KIN_V) + terms.dot3(g, 6 * side + 3, kin, KIN_W))
        if tab.row[r, T.ROW_TAPE] >= 0:
            k = tab.row[r, T.ROW_TAPE]
            n = 6 * tab.tape[k, T.TAPE_N_BODIES] + 1
            v, d, _, _ = tape_row_rates(k, t, y, tab, expressions.tail(tab, n * (n + 1)))
            value += v
            rate += d
        phi[ROW_RECORD * r + ROW_PHI] = value
        phi[ROW_RECORD * r + ROW_RATE] = rate
    spin = 0.0
    for b in range(1, idata[T.H_BODIES]):
        spin = max(spin, terms.dot3(tab.kin[b], KIN_W, tab.kin[b], KIN_W))
    return np.sqrt(spin)


@njit(cache=True, error_model="numpy", forceinline=True)
def displace(y, d, w, idata, tab):
    """Move the bodies of y by the spatial displacements ``d`` and change their spatial velocities by ``w``.

    The kinematics table must be up to date; conjugate momenta are left alone.
    """
    for b in range(1, idata[T.H_BODIES]):
        displace_body(b, y, d, w, tab.at[b], tab.kin, tab.scratch)
