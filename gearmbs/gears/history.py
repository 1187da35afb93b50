"""What the mesh did during a motion: forces, pairs in contact, separations and hits of the coast flanks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import types

from gearmbs._jit import njit
from gearmbs.contact import gear_contact, layout
from gearmbs.gears.mesh import Mesh
from gearmbs.gears.tables import pack

VEC = types.float64[::1]
MAT = types.float64[:, ::1]
BOX = types.float64[:, :, ::1]


@njit(
    types.void(types.int64[::1], VEC, MAT, BOX, MAT, MAT, MAT, BOX, MAT, MAT, MAT, MAT, VEC),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _run(gi, gr, R1, A1, v1, w1, R2, A2, v2, w2, wrench, diag, work):
    """Evaluate the contact of a pair at each instant of a motion.

    Parameters
    ----------
    gi, gr : ndarray
        Tables of the pair.
    R1, A1, v1, w1, R2, A2, v2, w2 : ndarray, first axis of length n
        Position, orientation, velocity and angular velocity of driver and driven wheel.
    wrench : ndarray, shape (n, 6)
        Receives force and torque on the driver.
    diag : ndarray, shape (n, 8)
        Receives the diagnostics.
    work : ndarray
        Scratch of the contact.
    """
    jac = np.zeros((6, 24))
    for k in range(R1.shape[0]):
        gear_contact(
            gi, gr, R1[k], A1[k], v1[k], w1[k], R2[k], A2[k], v2[k], w2[k], wrench[k], jac, diag[k], 0, work
        )  # fmt: skip


@dataclass(frozen=True)
class ContactHistory:
    """Contact quantities at each instant of a motion, n instants.

    Attributes
    ----------
    wrench : ndarray, shape (n, 6)
        Force and torque (about its origin) on the driver, global components.
    elastic_energy, damping_power, friction_power : ndarray
        J, W, W.
    drive_penetration, coast_penetration : ndarray
        Largest, m.
    drive_pairs, coast_pairs : ndarray of int
        Tooth pairs touching.
    normal_force : ndarray
        Sum of all normal forces, N.
    """

    wrench: np.ndarray
    elastic_energy: np.ndarray
    damping_power: np.ndarray
    friction_power: np.ndarray
    drive_penetration: np.ndarray
    coast_penetration: np.ndarray
    drive_pairs: np.ndarray
    coast_pairs: np.ndarray
    normal_force: np.ndarray

    @property
    def separations(self) -> int:
        """How many times the teeth lost all contact."""
        free = (self.drive_pairs + self.coast_pairs) == 0
        return int(np.count_nonzero(free[1:] & ~free[:-1]))

    @property
    def coast_hits(self) -> int:
        """How many times the coast flanks came into contact."""
        touching = self.coast_pairs > 0
        return int(np.count_nonzero(touching[1:] & ~touching[:-1]))


def contact_history(
    pair: Mesh,
    driver: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    driven: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> ContactHistory:
    """Evaluate the contact along a motion of the two wheels.

    Parameters
    ----------
    pair : GearPair or Mesh
    driver, driven : tuple of ndarray
        Per wheel: origins (n, 3), axes (n, 3, 3), velocities of the origins (n, 3), angular velocities (n, 3); global
        components.

    Returns
    -------
    ContactHistory
    """
    shapes = ((-1, 3), (-1, 3, 3), (-1, 3), (-1, 3))
    args = [
        np.ascontiguousarray(a, dtype=float).reshape(s) for wheel in (driver, driven) for a, s in zip(wheel, shapes)
    ]
    n = len(args[0])
    if any(len(a) != n for a in args):
        raise ValueError(f"driver and driven have {[len(a) for a in args]} instants; give as many of each")
    gi, gr, size = pack(pair)
    wrench = np.zeros((n, 6))
    diag = np.zeros((n, layout.DIAGNOSTICS))
    run: Any = _run
    run(gi, gr, *args, wrench, diag, np.zeros(size))
    told = dict(zip(layout.TOTALS.names or (), diag.T))
    return ContactHistory(
        wrench,
        told["energy"],
        told["damping_power"],
        told["friction_power"],
        told["depth_drive"],
        told["depth_coast"],
        told["pairs_drive"].astype(int),
        told["pairs_coast"].astype(int),
        told["normal_force"],
    )
