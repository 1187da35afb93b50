"""Records, one row per output time, and how positions and velocities are moved back onto their constraints for them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import float64, types

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import ROW_PHI, ROW_RATE, ROW_RECORD, tape_row_rates
from gearmbs.dae.equations.bodies.body import displace_body
from gearmbs.dae.equations.constraints import terms
from gearmbs.dae.equations.constraints.terms import OFFSET, RATE, RELATIVE, dot_motion, relative_motion
from gearmbs.dae.equations.loads import expressions
from gearmbs.dae.equations.residual import S_GRADIENT, S_GRADIENT_T, S_TERM, S_VECTOR
from gearmbs.dae.equations.rotation import KIN_V, KIN_W, POSE_COLUMNS
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.structs import vector_at

_VEC = float64[::1]
_MAT = float64[:, ::1]
_CUBE = float64[:, :, ::1]

FARTHEST = 1e-3
"""A constraint farther off than this belongs to an angle whose full turns were not counted; it is left alone."""

ROUNDED = 1e-13
"""Change of an entry of the equilibrated matrix that is rounding, of all the products that it is made of.

Of wheels that spin about fixed axes the mass matrix and the constraints' gradients stay what they are in global
components, and so do the factors."""


class Records(NamedTuple):
    """What is evaluated, one row per output time.

    Attributes
    ----------
    pose : ndarray, shape (m, 18 bodies)
        R, A (row-major), v, omega of each moving body.
    solution : ndarray, shape (m, 6 bodies + rows)
        Accelerations a, alpha of each body, then the multipliers.
    loads : ndarray, shape (m, elements, 6 + diagnostics)
        F, N and what each element tells beside them.
    phi : ndarray, shape (m, 3 rows)
        Phi, its rate and its partial time derivative, row by row.
    force, moment : ndarray, shape (m, rows, 3)
        Reaction on I's body at marker I.
    strayed : ndarray, shape (m,)
        Largest |Phi| of the integrator's solution, before it is projected onto the constraints.
    """

    pose: np.ndarray
    solution: np.ndarray
    loads: np.ndarray
    phi: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    strayed: np.ndarray

    @property
    def by_body(self) -> np.ndarray:
        """`pose` as (m, bodies, 18)."""
        bodies = self.bodies
        return self.pose[:, : POSE_COLUMNS * bodies].reshape(len(self.pose), bodies, POSE_COLUMNS)

    @property
    def bodies(self) -> int:
        """Number of moving bodies."""
        coordinates = self.solution.shape[1] - self.force.shape[1]
        # 18 places a body and two a mode in one, 6 and one in the other
        return (self.pose.shape[1] - 2 * coordinates) // 6

    @property
    def modal(self) -> np.ndarray:
        """q_f, v_f and their accelerations, shape (3, m, modal coordinates)."""
        first, bodies = POSE_COLUMNS * self.bodies, self.bodies
        half = (self.pose.shape[1] - first) // 2
        accelerations = self.solution[:, 6 * bodies : 6 * bodies + half]
        return np.stack([self.pose[:, first : first + half], self.pose[:, first + half :], accelerations])

    @property
    def accelerations(self) -> np.ndarray:
        """a and alpha, shape (m, bodies, 6)."""
        m, bodies = len(self.pose), self.bodies
        return self.solution[:, : 6 * bodies].reshape(m, bodies, 6)

    @property
    def multipliers(self) -> np.ndarray:
        """Lambda, shape (m, rows)."""
        return self.solution[:, self.solution.shape[1] - self.force.shape[1] :]

    @property
    def by_row(self) -> np.ndarray:
        """`phi` as (m, rows, 3)."""
        return self.phi.reshape(len(self.phi), self.phi.shape[1] // 3, 3)

    def first(self, m: int) -> Records:
        """Return views of the first m rows."""
        return Records(*(part[:m] for part in self))


RECORDS_TYPE = types.NamedTuple((_MAT, _MAT, _CUBE, _MAT, _CUBE, _CUBE, _VEC), Records)


@njit(cache=True, error_model="numpy", forceinline=True)
def allow_rounding(plan, allowed):
    """Write by how much each entry of the matrix may change and still count as unchanged."""
    for p in range(plan.a_src.size):
        allowed[plan.a_src[p]] = ROUNDED / plan.a_scale[p]
    for p in range(plan.left_src.size):
        allowed[plan.left_src[p]] = plan.left_limit[p]


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
