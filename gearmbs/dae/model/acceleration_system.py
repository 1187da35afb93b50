"""The acceleration system of a model at a configuration: masses, constraints, loads, and the unknowns y behind them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from gearmbs._jit import njit
from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.constraint_terms import dot3
from gearmbs.dae.equations.modal_inertia import add_momentum, set_modal_momenta, update_inertia
from gearmbs.dae.equations.rotation import (
    KIN_A,
    KIN_AXES,
    KIN_H,
    KIN_W,
    POSE_A,
    POSE_R,
    POSE_V,
    POSE_W,
    axes_and_velocity,
    best_reference,
    euler_angles,
    euler_rates,
)
from gearmbs.dae.equations.unknowns import I3
from gearmbs.dae.equations.update import inertia_times
from gearmbs.dae.model import evaluator
from gearmbs.dae.model.configuration import Configuration
from gearmbs.dae.model.model import Model

POSE_PLACES = 6
"""Spatial displacements of a body, after which the modal coordinates come."""


class Assembled(NamedTuple):
    """The acceleration system of a model at a configuration, with the unknowns and tables it was made from."""

    matrix: scipy.sparse.csc_array
    rhs: np.ndarray
    phi: np.ndarray
    loads: np.ndarray
    y: np.ndarray
    idata: np.ndarray
    rdata: np.ndarray
    work: np.ndarray


@njit(
    "void(float64[:, ::1], float64[::1], float64[::1], int64[::1], float64[::1], float64[::1], float64[::1])",
    cache=True,
    error_model="numpy",
)
def unknowns_from_pose(pose, q_f, v_f, idata, rdata, work, y):
    """Fill positions, velocities and momenta of y from a configuration."""
    tab = T.unpack(idata, rdata, work)
    kin = tab.kin
    s = tab.scratch
    for b in range(1, idata[T.H_BODIES]):
        row, at = pose[b - 1], tab.at[b]
        first = at[T.AT_V_MODES] - POSE_PLACES * pose.shape[0]
        for m in range(at[T.AT_MODES]):
            y[at[T.AT_QF] + m] = q_f[first + m]
            y[at[T.AT_VF] + m] = v_f[first + m]
        if at[T.AT_MODES] > 0:
            update_inertia(y, at, tab.modal, tab.partial, tab.body[b])
        th, e, p = at[T.AT_THETA], at[T.AT_EPS], at[T.AT_P]
        for c in range(3):
            y[at[T.AT_R] + c] = row[POSE_R + c]
            y[at[T.AT_U] + c] = row[POSE_V + c]
        for c in range(9):
            kin[b, KIN_A + c] = row[POSE_A + c]
        euler_angles(row, POSE_A, tab.code[b], y, th)
        axes_and_velocity(y[th], y[th + 1], 0.0, 0.0, 0.0, kin, b)
        euler_rates(kin, b, row, POSE_W, y, e)
        inertia_times(kin[b], tab.body[b], row, POSE_W, kin[b], KIN_H, s)
        if at[T.AT_MODES] > 0:
            for c in range(3):
                kin[b, KIN_W + c] = row[POSE_W + c]
            add_momentum(y, at, tab.partial, kin[b])
            set_modal_momenta(y, at, tab.modal, tab.partial, kin[b])
        for m in range(3):
            y[p + m] = dot3(kin[b], KIN_AXES + 3 * m, kin[b], KIN_H)


def euler_references(pose: np.ndarray) -> np.ndarray:
    """Return, for the ground and each body, the Euler reference that is farther from its singularity."""
    chosen = [best_reference(np.ascontiguousarray(row[POSE_A:POSE_V]), 0) for row in pose]
    return np.array([0, *chosen], dtype=np.int64)


class AccelerationSystem:
    """Assembles the acceleration system of one model; its pattern is found once."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self._pattern: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def at(self, place: Configuration, t: float, inner: np.ndarray | None, states: np.ndarray) -> Assembled:
        """Assemble at a configuration; ``inner`` holds loads and states, F to z of y; default: no loads, ``states``."""
        idata, rdata, size = self.model.pack(I3, codes=euler_references(place.pose))
        work = np.zeros(size)
        y = np.zeros(int(idata[T.H_UNKNOWNS]))
        y[int(idata[T.H_Z]) : int(idata[T.H_Z]) + states.size] = states
        if inner is not None:
            y[int(idata[T.H_F]) :] = inner
        unknowns_from_pose(np.ascontiguousarray(place.pose), place.q_f, place.v_f, idata, rdata, work, y)
        if self._pattern is None:
            self._pattern = evaluator.pattern(idata, rdata, size, t, y)
        indptr, indices, slots = self._pattern
        n = indptr.size - 1
        vals = np.zeros(indices.size)
        records = evaluator.assemble(np.array([t]), y[None, :], slots, idata, rdata, size, vals)
        matrix = scipy.sparse.csc_array((vals, indices, indptr), shape=(n, n))
        return Assembled(matrix, records.solution[0], records.phi[0], records.loads[0], y, idata, rdata, work)

    def constraints(
        self, place: Configuration, t: float, states: np.ndarray
    ) -> tuple[scipy.sparse.csc_array, np.ndarray, np.ndarray]:
        """Return Phi_q in spatial displacements and modal coordinates, Phi, and Phi_q v + Phi_t."""
        found = self.at(place, t, None, states)
        base = place.coordinates
        return scipy.sparse.csc_array(found.matrix[base:, :base]), found.phi[0::3].copy(), found.phi[1::3].copy()
