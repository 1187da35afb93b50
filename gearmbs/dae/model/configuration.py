"""Positions and velocities of all bodies at one instant, free of the singularities of angles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearmbs.dae.equations.kinematics.rotation import POSE_A, POSE_COLUMNS, POSE_R, POSE_V


@dataclass(frozen=True, eq=False)
class Configuration:
    """Where the bodies are and how they move.

    Attributes
    ----------
    pose : ndarray, shape (bodies, 18)
        Position R and orientation A (row-major) of the centre of mass, velocity v and angular velocity omega of each
        moving body, global components.
    q_f, v_f : ndarray, shape (modal coordinates,)
        Modal coordinates of all bodies and their velocities.
    """

    pose: np.ndarray
    q_f: np.ndarray = field(default_factory=lambda: np.zeros(0))
    v_f: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, record: np.ndarray, bodies: int) -> Configuration:
        """Return the configuration of a record: the bodies' poses one after the other, then q_f and v_f."""
        end = POSE_COLUMNS * bodies
        half = (record.size - end) // 2
        return cls(record[:end].reshape(-1, POSE_COLUMNS), record[end : end + half], record[end + half :])

    @property
    def bodies(self) -> int:
        """Number of moving bodies."""
        return self.pose.shape[0]

    @property
    def coordinates(self) -> int:
        """Number of coordinates: six displacements of each body, then the modal coordinates."""
        return 6 * self.bodies + self.q_f.size

    def parts(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a vector over the coordinates as (bodies, 6) and what it has for the modal coordinates."""
        return change[: 6 * self.bodies].reshape(-1, 6), change[6 * self.bodies :]

    def displaced(self, step: np.ndarray) -> Configuration:
        """Return the configuration after displacements dR, rotations dpi (exponential map) and changes of q_f."""
        from scipy.spatial.transform import Rotation

        moved, bent = self.parts(step)
        pose = self.pose.copy()
        pose[:, POSE_R : POSE_R + 3] += moved[:, 0:3]
        axes = pose[:, POSE_A:POSE_V]
        turned = Rotation.from_rotvec(moved[:, 3:6]).as_matrix() @ axes.reshape(-1, 3, 3)
        axes[:] = turned.reshape(-1, 9)
        return Configuration(pose, self.q_f + bent, self.v_f)

    def pushed(self, change: np.ndarray) -> Configuration:
        """Return the configuration with changed velocities v, omega and v_f."""
        moved, bent = self.parts(change)
        pose = self.pose.copy()
        pose[:, POSE_V:POSE_COLUMNS] += moved
        return Configuration(pose, self.q_f, self.v_f + bent)

    def at_rest(self) -> Configuration:
        """Return the configuration with all velocities zero."""
        pose = self.pose.copy()
        pose[:, POSE_V:POSE_COLUMNS] = 0.0
        return Configuration(pose, self.q_f, np.zeros_like(self.v_f))

    @property
    def velocities(self) -> np.ndarray:
        """v and omega of each body, then v_f, shape (coordinates,)."""
        return np.concatenate([self.pose[:, POSE_V:POSE_COLUMNS].ravel(), self.v_f])
