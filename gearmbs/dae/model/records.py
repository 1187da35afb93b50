"""Records, one row per output time, and how positions and velocities are moved back onto their constraints for them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.accelerations import ROW_PHI, ROW_RATE, ROW_RECORD
from gearmbs.dae.equations.bodies.body import displace_body
from gearmbs.dae.equations.rotation import POSE_COLUMNS
from gearmbs.dae.problem import EPS
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, types

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
def displace(y, d, w, idata, tab):
    """Move the bodies of y by the spatial displacements ``d`` and change their spatial velocities by ``w``.

    The kinematics table must be up to date; conjugate momenta are left alone.
    """
    for b in range(1, idata[T.H_BODIES]):
        displace_body(b, y, d, w, tab.at[b], tab.kin, tab.scratch)
