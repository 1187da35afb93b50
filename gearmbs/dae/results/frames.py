"""Motion of all frames over time: the ground, the bodies, and the elastic frames of modal bodies' markers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearmbs.dae.equations.expressions.opcodes import ACC_A, ACC_ALPHA
from gearmbs.dae.equations.kinematics.rotation import (
    KIN_A,
    KIN_AXES,
    KIN_R,
    KIN_V,
    KIN_W,
    POSE_A,
    POSE_R,
    POSE_V,
    POSE_W,
)
from gearmbs.dae.model.evaluator import Records
from gearmbs.dae.model.model import Model

# Output times with all that was evaluated at them, which energies and motions of frames are computed from.


class Evaluated(NamedTuple):
    """A model over time.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Output times, s.
    model : Model
    records : Records
        Poses, accelerations, multipliers, loads.
    """

    t: np.ndarray
    model: Model
    records: Records

    def modal(self, body: int) -> np.ndarray:
        """Return q_f, v_f and their accelerations of a modal body, shape (3, m, modes); the ground is body 0."""
        first = sum(self.model.modes[:body])
        return self.records.modal[:, :, first : first + self.model.modes[body]]


KIN_PLACES = KIN_AXES + 9
ACC_PLACES = 6


def frame_motion(found: Evaluated, model: Model | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the kinematics (m, frames, 27) and acceleration (m, frames, 6) tables over time, the ground first.

    Frames are numbered as in ``Model.marker_body``; columns are those of the compiled tables. ``model`` may have more
    markers than that of the solution.
    """
    records = found.records
    model = found.model if model is None else model
    poses, accelerations = records.by_body, records.accelerations
    m, bodies = poses.shape[:2]
    frames = 1 + bodies + len(model.frame_body)
    kin, acc = np.zeros((m, frames, KIN_PLACES)), np.zeros((m, frames, ACC_PLACES))
    kin[:, 0, KIN_A : KIN_A + 9] = np.eye(3).ravel()
    moving = slice(1, 1 + bodies)
    kin[:, moving, KIN_R : KIN_R + 3] = poses[:, :, POSE_R : POSE_R + 3]
    kin[:, moving, KIN_V : KIN_V + 3] = poses[:, :, POSE_V : POSE_V + 3]
    kin[:, moving, KIN_A : KIN_A + 9] = poses[:, :, POSE_A : POSE_A + 9]
    kin[:, moving, KIN_W : KIN_W + 3] = poses[:, :, POSE_W : POSE_W + 3]
    acc[:, moving] = accelerations
    for k, body in enumerate(model.frame_body):
        n = model.modes[body]
        shapes = model.modal[model.shape_at[k] : model.shape_at[k] + 3 + 6 * n]
        parts = shapes[:3], shapes[3 : 3 + 3 * n].reshape(3, n).T, shapes[3 + 3 * n :].reshape(3, n).T
        f = 1 + bodies + k
        kin[:, f], acc[:, f] = elastic_motion(kin[:, body], acc[:, body], found.modal(body), *parts)
    return kin, acc


def body_motion(found: Evaluated, body: int) -> np.ndarray:
    """Return the motion of a body's frame at its centre of mass, columns ``KIN_*``, shape (m, 27); the first is 1."""
    pose = found.records.by_body[:, body - 1]
    kin = np.zeros((found.t.size, KIN_PLACES))
    kin[:, KIN_R : KIN_R + 3] = pose[:, POSE_R : POSE_R + 3]
    kin[:, KIN_V : KIN_V + 3] = pose[:, POSE_V : POSE_V + 3]
    kin[:, KIN_A : KIN_A + 9] = pose[:, POSE_A : POSE_A + 9]
    kin[:, KIN_W : KIN_W + 3] = pose[:, POSE_W : POSE_W + 3]
    return kin


def elastic_motion(
    kin: np.ndarray, acc: np.ndarray | None, modal: np.ndarray, s0: np.ndarray, phi: np.ndarray, psi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return motion (m, 27) and accelerations (m, 6) of an elastic frame from those of its body.

    The equations are those of `gearmbs.dae.equations.bodies.frames`.

    Parameters
    ----------
    kin, acc : ndarray, shapes (m, 27), (m, 6)
        Of the body; without accelerations those returned are meaningless.
    modal : ndarray, shape (3, m, n)
        q_f, v_f and their accelerations.
    s0 : ndarray, shape (3,)
        Place of the frame in the undeformed body, from the centre of mass.
    phi, psi : ndarray, shape (n, 3)
        Displacements and rotations of the frame by the modes.
    """
    from scipy.spatial.transform import Rotation

    q, v, a = modal
    acc = np.zeros((len(kin), ACC_PLACES)) if acc is None else acc
    axes = kin[:, KIN_A : KIN_A + 9].reshape(-1, 3, 3)
    w, alpha = kin[:, KIN_W : KIN_W + 3], acc[:, ACC_ALPHA : ACC_ALPHA + 3]

    def to_global(local: np.ndarray) -> np.ndarray:
        return np.einsum("tij,tj->ti", axes, local)

    arm, rate, push = to_global(s0 + q @ phi), to_global(v @ phi), to_global(a @ phi)
    spin = np.cross(w, arm)
    frame, accelerations = np.zeros_like(kin), np.zeros_like(acc)
    frame[:, KIN_R : KIN_R + 3] = kin[:, KIN_R : KIN_R + 3] + arm
    frame[:, KIN_V : KIN_V + 3] = kin[:, KIN_V : KIN_V + 3] + spin + rate
    accelerations[:, ACC_A : ACC_A + 3] = (
        acc[:, ACC_A : ACC_A + 3] + np.cross(alpha, arm) + np.cross(w, spin + 2.0 * rate) + push
    )
    turned, spun, spun_up = Rotation.from_matrix(axes), w.copy(), alpha.copy()
    turns, rates, pushes = q @ psi, v @ psi, a @ psi
    for c in range(3):
        axis = turned.apply(np.eye(3)[c])
        spun_up += axis * pushes[:, c : c + 1] + np.cross(spun, axis) * rates[:, c : c + 1]
        spun += axis * rates[:, c : c + 1]
        turned = turned * Rotation.from_rotvec(np.outer(turns[:, c], np.eye(3)[c]))
    frame[:, KIN_A : KIN_A + 9] = turned.as_matrix().reshape(-1, 9)
    frame[:, KIN_W : KIN_W + 3] = spun
    accelerations[:, ACC_ALPHA : ACC_ALPHA + 3] = spun_up
    return frame, accelerations
