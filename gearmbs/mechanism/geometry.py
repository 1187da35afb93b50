"""Frames: rotation matrices from axes, Euler angles or matrices, checked on the way in."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gearmbs.dae.equations.rotation import matrix_from_euler
from gearmbs.dae.errors import ModelError
from gearmbs.mechanism.quantities import quantities

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
