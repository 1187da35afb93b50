"""Bodies and markers."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.kinematics.rotation import matrix_from_euler
from gearmbs.dae.problem import ModelError
from gearmbs.mechanism.parts.quantities import quantities, quantity
from gearmbs.units import shown

# Frames: rotation matrices from axes, Euler angles or matrices, checked on the way in.


Vector = npt.ArrayLike


def vector(value: Vector, field: str, unit: str = "dimensionless", factor: float = 1.0) -> np.ndarray:
    """Return three finite floats, given as such or as texts with a unit (see :func:`.quantities.quantities`).

    Raises
    ------
    ModelError
        If ``value`` is not three finite numbers.
    """
    out = quantities(value, unit, field, factor).reshape(-1)
    if out.size != 3 or not np.all(np.isfinite(out)):
        raise ModelError(f"{field}: {value!r} is not three finite numbers")
    return out


def frame_along(axis: Vector, field: str = "axis", x_hint: Vector | None = None) -> np.ndarray:
    """Return a rotation matrix whose z column lies along ``axis``.

    The x column is the projection of ``x_hint``, or of the global axis least aligned with ``axis``.
    """
    z = vector(axis, field)
    norm = np.linalg.norm(z)
    if norm == 0.0:
        raise ModelError(f"{field}: the zero vector gives no direction")
    z = z / norm
    hint = np.eye(3)[np.argmin(np.abs(z))] if x_hint is None else vector(x_hint, f"{field} (x direction)")
    x = hint - z * (hint @ z)
    if np.linalg.norm(x) < 1e-12:
        raise ModelError(f"{field}: the x direction is parallel to the axis; choose another")
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def orientation(value: npt.ArrayLike | None, field: str) -> np.ndarray:
    """Return a rotation matrix from None (identity), a 3x3 matrix, or three 3-1-3 Euler angles in rad."""
    if value is None:
        return np.eye(3)
    out = quantities(value, "angle", field)
    if out.shape == (3,):
        return matrix_from_euler(*out)
    if out.shape != (3, 3):
        raise ModelError(f"{field}: shape {out.shape}; give a 3x3 rotation matrix or three Euler angles in rad")
    if not np.all(np.isfinite(out)) or np.abs(out @ out.T - np.eye(3)).max() > 1e-6 or np.linalg.det(out) < 0:
        raise ModelError(f"{field}: the matrix is not a rotation (orthonormal, determinant +1)")
    u, _, vt = np.linalg.svd(out)
    return u @ vt


def inertia_matrix(value: float | Sequence[float] | np.ndarray, field: str) -> np.ndarray:
    """Return a symmetric 3x3 inertia matrix from 3 principal moments, 6 entries (xx, yy, zz, xy, xz, yz) or 3x3.

    Off-diagonal entries are those of the matrix, so products of inertia enter with a minus sign.

    Raises
    ------
    ModelError
        If the matrix is not symmetric, not finite or has a negative moment.

    Warns
    -----
    UserWarning
        If a moment exceeds the sum of the other two, which no rigid body can do; the equations can.
    """
    raw = quantities(value, "inertia", field)
    if raw.shape == (3,):
        out = np.diag(raw)
    elif raw.shape == (6,):
        xx, yy, zz, xy, xz, yz = raw
        out = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    elif raw.shape == (3, 3):
        out = raw
    else:
        raise ModelError(f"{field}: shape {raw.shape}; give 3 moments, 6 entries or a 3x3 matrix in kg m^2")
    if not np.all(np.isfinite(out)):
        raise ModelError(f"{field}: {value!r} is not finite")
    if np.abs(out - out.T).max() > 1e-9 * max(np.abs(out).max(), 1e-300):
        raise ModelError(f"{field}: the inertia matrix is not symmetric")
    moments = np.linalg.eigvalsh(out)
    if moments[0] < -1e-9 * max(moments[2], 1e-300):
        raise ModelError(
            f"{field}: principal moments {moments} kg m^2; none may be negative: correct the moments, the signs of "
            "products, or the point they are about"
        )
    if moments[2] > (1.0 + 1e-6) * (moments[0] + moments[1]):
        warnings.warn(
            f"{field}: principal moments {moments} kg m^2; the largest exceeds the sum of the others, as in no body: "
            "correct the moments, the signs of products, or the point they are about",
            stacklevel=4,
        )
    return 0.5 * (out + out.T)


@dataclass(eq=False)
class Marker:
    """A frame fixed in a body.

    Attributes
    ----------
    name : str
    body : Body
    position : ndarray, shape (3,)
        Origin in the body's frame, m.
    orientation : ndarray, shape (3, 3)
        Columns are the marker's axes in the body's frame.
    number : int, optional
        Its id in an ADAMS deck; expressions may use it.
    """

    name: str
    body: Body
    position: np.ndarray
    orientation: np.ndarray
    number: int | None = None

    def global_position(self) -> np.ndarray:
        """Return the origin at the initial position, global components, m."""
        return self.body.position + self.body.orientation @ self.position

    def global_orientation(self) -> np.ndarray:
        """Return the axes (columns) at the initial position, global components."""
        return self.body.orientation @ self.orientation

    def velocity_at(self, place: np.ndarray) -> np.ndarray:
        """Return the velocity at the start of the point of the marker's body that is at a global place, m/s."""
        body = self.body
        return body.velocity + np.cross(body.angular_velocity, place - body.position)

    def __repr__(self) -> str:
        return f"Marker({self.name!r} on {self.body.name!r} at {np.array2string(self.position, precision=6)})"


@dataclass(eq=False)
class Body:
    """A rigid body. Made by :meth:`gearmbs.mechanism.Mechanism.body`.

    Attributes
    ----------
    name : str
    mass : float
        kg.
    inertia : ndarray, shape (3, 3)
        About the centre of mass, in the body's axes, kg m^2.
    com : ndarray, shape (3,)
        Centre of mass in the body's frame, m.
    position, orientation : ndarray
        The body's frame at the start: origin (m) and axes as columns, global components.
    velocity, angular_velocity : ndarray, shape (3,)
        Of the frame's origin (m/s) and of the body (rad/s), global components.
    """

    name: str
    mass: float = 0.0
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    com: np.ndarray = field(default_factory=lambda: np.zeros(3))
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    orientation: np.ndarray = field(default_factory=lambda: np.eye(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angular_velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    is_ground: bool = False
    markers: list[Marker] = field(default_factory=list)

    def marker(
        self,
        position: Vector = (0.0, 0.0, 0.0),
        orientation: npt.ArrayLike | None = None,
        *,
        axis: Vector | None = None,
        name: str | None = None,
    ) -> Marker:
        """Add a marker given in the body's own frame.

        Parameters
        ----------
        position : array_like of 3 floats
            Origin, m.
        orientation : array_like, optional
            3x3 matrix or 3-1-3 Euler angles in rad; or give
        axis : array_like of 3 floats, optional
            Direction of the marker's z axis.
        """
        label = name or f"{self.name}.marker{len(self.markers) + 1}"
        if any(m.name == label for m in self.markers):
            raise ModelError(f"marker '{label}': body '{self.name}' already has a marker of that name")
        matrix = (
            frame_along(axis, f"marker '{label}': axis")
            if axis is not None
            else _orientation(orientation, f"marker '{label}': orientation")
        )
        marker = Marker(label, self, vector(position, f"marker '{label}': position", "length"), matrix)
        self.markers.append(marker)
        return marker

    def centre_of_mass(self) -> tuple[np.ndarray, np.ndarray]:
        """Return position and velocity of the centre of mass at the start, global components, m and m/s."""
        arm = self.orientation @ self.com
        return self.position + arm, self.velocity + np.cross(self.angular_velocity, arm)

    def marker_at(self, point: Vector, matrix: np.ndarray, name: str | None = None) -> Marker:
        """Add a marker given in global components at the initial position of the body."""
        local = self.orientation.T @ (vector(point, f"body '{self.name}': marker position", "length") - self.position)
        return self.marker(local, self.orientation.T @ matrix, name=name)

    def __repr__(self) -> str:
        if self.is_ground:
            return "Body('ground')"
        moments = np.array2string(np.diag(self.inertia), precision=4)
        mass = shown(self.mass, "kg", "g")
        return f"Body({self.name!r}, mass={mass}, inertia={moments} kg m^2, {len(self.markers)} markers)"


def _orientation(value: npt.ArrayLike | None, label: str) -> np.ndarray:
    return orientation(value, label)


def make_body(
    name: str,
    mass: float,
    inertia: Any,
    com: Vector,
    position: Vector,
    matrix: npt.ArrayLike | None,
    velocity: Vector,
    angular_velocity: Vector,
) -> Body:
    """Return a checked body; see :class:`Body` for the fields.

    Raises
    ------
    ModelError
        If mass or inertia is negative or not finite, or a vector is malformed.
    """
    label = f"body '{name}'"
    mass = quantity(mass, "mass", f"{label}: mass")
    if not np.isfinite(mass) or mass < 0.0:
        raise ModelError(f"{label}: mass = {mass} kg; it must be a positive number")
    return Body(
        name=name,
        mass=mass,
        inertia=inertia_matrix(inertia, f"{label}: inertia"),
        com=vector(com, f"{label}: com", "length"),
        position=vector(position, f"{label}: position", "length"),
        orientation=orientation(matrix, f"{label}: orientation"),
        velocity=vector(velocity, f"{label}: velocity", "speed"),
        angular_velocity=vector(angular_velocity, f"{label}: angular_velocity", "angular speed"),
    )
