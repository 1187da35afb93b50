"""Kinetic energy of rigid and modal bodies from their records, in a library as in Python.

Of a body with mass m, inertia J in its own axes and the modal coordinates q,

    T = 1/2 m v.v + 1/2 w.J(q) w + w.(c_0 + c_1 q) q' + 1/2 q'.M q',

where v is the velocity of the undeformed body's centre of mass, w its angular velocity in its own axes, and

    J(q) = J_0 + J_1 q + 1/2 q.J_2 q;

see `gearmbs.dae.equations.bodies.inertia.ModalInertia` for the integrals.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearmbs.dae.equations import layout as T
from gearmbs.dae.equations.rotation import POSE_A, POSE_COLUMNS, POSE_V, POSE_W
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, void

if TYPE_CHECKING:
    from gearmbs.dae.model.model import Model

_VEC = float64[::1]
_MAT = float64[:, ::1]

MASS, INERTIA = 0, 1
"""Columns of the table of bodies: the mass, and from the second on the nine moments of inertia."""
MODES, INTEGRALS = 0, 1
MODAL_COLUMNS = 2
"""How many modes a body has, and where its integrals begin in the table of them."""


class Inertias(NamedTuple):
    """Masses, moments of inertia and integrals of all moving bodies of a model.

    Attributes
    ----------
    bodies : ndarray, shape (bodies, 10)
        Mass, kg, and inertia in the body's own axes, kg m^2.
    modal : ndarray of int64, shape (MODAL_COLUMNS bodies,)
    integrals : ndarray
        M, c_0, c_1, J_1 and J_2 of one body with modes after the other.
    """

    bodies: np.ndarray
    modal: np.ndarray
    integrals: np.ndarray


def inertias(model: Model) -> Inertias:
    """Return the tables of a model that its kinetic energy is found with."""
    bodies = np.column_stack([model.bodies[1:, T.BODY_MASS], model.bodies[1:, T.BODY_INERTIA :]])
    modal, parts, size = [], [np.zeros(0)], 0
    for inertia in model.modal_inertia[1:]:
        modal += [0 if inertia is None else inertia.modes, size]
        if inertia is not None:
            parts += [np.ravel(one) for one in (inertia.mass, inertia.c0, inertia.c1, inertia.j1, inertia.j2)]
            size = sum(map(len, parts))
    return Inertias(np.ascontiguousarray(bodies), np.array(modal, dtype=np.int64), np.concatenate(parts))


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _twice(a, w, table, at):
    """Return a.B w of the matrix B that stands in a table, row by row."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += a[i] * table[at + 3 * i + j] * w[j]
    return total


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _of_modes(n, w, pose, q, v, table, at):
    """Return what the modes of a body add to its kinetic energy.

    Parameters
    ----------
    n : int
        Modes.
    w : ndarray, shape (3,)
        Angular velocity in the body's axes, rad/s.
    pose, q, v : ndarray and int
        A row of records, and where the modal coordinates and their rates stand in it.
    table, at : ndarray and int
        Integrals, and where those of the body begin.
    """
    c0 = at + n * n
    c1 = c0 + 3 * n
    j1 = c1 + 3 * n * n
    j2 = j1 + 9 * n
    total = 0.0
    for k in range(n):
        own, rate = pose[q + k], pose[v + k]
        along = 0.0
        for c in range(3):
            along += w[c] * table[c0 + 3 * k + c]
        change, moving = _twice(w, w, table, j1 + 9 * k), 0.0
        for l in range(n):
            other = pose[q + l]
            for c in range(3):
                along += w[c] * other * table[c1 + 3 * (l * n + k) + c]
            change += 0.5 * other * _twice(w, w, table, j2 + 9 * (k * n + l))
            moving += table[at + k * n + l] * pose[v + l]
        total += 0.5 * own * change + along * rate + 0.5 * rate * moving
    return total


@njit(void(_MAT, _MAT, int64[::1], _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def write_kinetic_energy(poses, bodies, modal, integrals, out):
    """Write the kinetic energy of each row of records.

    Parameters
    ----------
    poses : ndarray
        Of `gearmbs.dae.model.records.Records`.
    bodies, modal, integrals : ndarray
        Of `Inertias`.
    out : ndarray, shape (m,)
        Written, J.
    """
    count = bodies.shape[0]
    modes = (poses.shape[1] - POSE_COLUMNS * count) // 2
    w = np.empty(3)
    for row in range(poses.shape[0]):
        pose = poses[row]
        total, first = 0.0, POSE_COLUMNS * count
        for b in range(count):
            at = POSE_COLUMNS * b
            for c in range(3):
                w[c] = 0.0
                for d in range(3):
                    w[c] += pose[at + POSE_A + 3 * d + c] * pose[at + POSE_W + d]
            for c in range(3):
                total += 0.5 * bodies[b, MASS] * pose[at + POSE_V + c] * pose[at + POSE_V + c]
            total += 0.5 * _twice(w, w, bodies[b], INERTIA)
            n = modal[MODAL_COLUMNS * b + MODES]
            if n > 0:
                start = modal[MODAL_COLUMNS * b + INTEGRALS]
                total += _of_modes(n, w, pose, first, first + modes, integrals, start)
            first += n
        out[row] = total


def kinetic_energy(poses: np.ndarray, model: Model) -> np.ndarray:
    """Return the kinetic energy over time, shape (m,), J, from the poses of records."""
    out = np.empty(len(poses))
    write_kinetic_energy(np.ascontiguousarray(poses), *inertias(model), out)
    return out
