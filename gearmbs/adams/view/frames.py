"""Places and orientations: Euler angles of any sequence, and the coordinate systems of a model's objects."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np

from gearmbs.adams.view.lexer import ViewError

Vector = np.ndarray
_SEQUENCE = re.compile(r"(body|space)([123])([123])([123])\Z")
IDENTITY = np.eye(3)
IDENTITY.setflags(write=False)
ORIGIN = np.zeros(3)
ORIGIN.setflags(write=False)
SMALL = 1e-12
"""Of a length or an axis: below it there is no direction; coordinates have sixteen digits."""


def about(axis: int, angle: float) -> np.ndarray:
    """Return the rotation about axis 0, 1 or 2 by an angle in radians; multiples of a right angle are exact."""
    c, s = math.cos(angle), math.sin(angle)
    quarters = angle / (math.pi / 2.0)
    if abs(quarters - round(quarters)) < 1e-15 * max(1.0, abs(quarters)):
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    j, k = (axis + 1) % 3, (axis + 2) % 3
    a = np.eye(3)
    a[j, j] = a[k, k] = c
    a[j, k], a[k, j] = -s, s
    return a


def rotation(angles: list[float], sequence: str = "body313", line: int = 0) -> np.ndarray:
    """Return the matrix of three angles in radians in a sequence such as body313 or space123.

    Raises
    ------
    ViewError
        If there is no such sequence.
    """
    match = _SEQUENCE.match(sequence.lower())
    if match is None:
        raise ViewError(f"orientation_type = {sequence[:40]}: give body313, body123, space123 or the like", line)
    if len(angles) != 3:
        raise ViewError(f"an orientation of {len(angles)} angles; give three", line)
    first, second, third = (about(int(match.group(k + 2)) - 1, angle) for k, angle in enumerate(angles))
    return first @ second @ third if match.group(1) == "body" else third @ second @ first


def angles_313(a: np.ndarray) -> list[float]:
    """Return the body-fixed 313 angles of a matrix, in radians; the third is 0 where the z axes are parallel."""
    theta = math.atan2(math.hypot(a[0, 2], a[1, 2]), a[2, 2])
    if math.hypot(a[0, 2], a[1, 2]) < SMALL:
        return [math.atan2(a[1, 0], a[0, 0]), theta, 0.0]
    return [math.atan2(a[0, 2], -a[1, 2]), theta, math.atan2(a[2, 0], a[2, 1])]


def unit(v: np.ndarray, what: str) -> np.ndarray:
    """Return a vector of length 1.

    Raises
    ------
    ViewError
        If it has no direction.
    """
    length = float(np.linalg.norm(v))
    if not length > SMALL:
        raise ViewError(f"{what} has no direction: its points are one")
    return v / length


def along(axis: str, direction: np.ndarray) -> np.ndarray:
    """Return a frame one of whose axes has a direction, turned about it as in View.

    Along x or z the y axis is as near to the global one as can be, along y the z axis. This, and what is done where
    that axis and the direction are parallel, was found from some 3000 markers of exported models that hold both the
    expression and its value.
    """
    d = unit(direction, "the axis")
    k = "xyz".index(axis)
    upright = 2 if axis == "y" else 1
    other = 3 - k - upright
    side = np.cross(IDENTITY[upright], d) if (k - upright) % 3 == 1 else np.cross(d, IDENTITY[upright])
    length = float(np.linalg.norm(side))
    a = np.empty((3, 3))
    a[:, k] = d
    a[:, other] = side / length if length > SMALL else IDENTITY[other]
    a[:, upright] = np.cross(a[:, (upright + 1) % 3], a[:, (upright + 2) % 3])
    return a


def aligned(a: np.ndarray, axis: str, sign: float, onto: str) -> np.ndarray:
    """Return a frame with an axis along one of another frame, or against it.

    Along it the axes are exchanged in a circle; against it the other two are exchanged with each other, too.
    """
    i, j = "xyz".index(axis), "xyz".index(onto)
    columns = np.column_stack([a[:, (k + j - i) % 3] for k in range(3)])
    if sign < 0:
        first, second = (k for k in range(3) if k != i)
        columns[:, [first, second]] = columns[:, [second, first]]
        columns[:, i] *= -1.0
    return columns


def in_plane(first: str, second: str, direction: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Return a frame with its first axis along a direction, and its second in the plane with another one.

    Raises
    ------
    ViewError
        If the two are parallel.
    """
    i, j = "xyz".index(first), "xyz".index(second)
    e = unit(direction, "the first axis")
    f = unit(towards - (towards @ e) * e, "the plane")
    a = np.empty((3, 3))
    a[:, i], a[:, j] = e, f
    k = 3 - i - j
    a[:, k] = np.cross(e, f) if (j - i) % 3 == 1 else np.cross(f, e)
    return a


def directed(key: str, points: list[np.ndarray], axis: str) -> np.ndarray:
    """Return the axes that points in the global frame give: along_axis_orientation two, in_plane_orientation three.

    Parameters
    ----------
    axis : str
        Which axis is along the first two, and which plane the third is in, such as z_axis_xz_plane.
    """
    first, plane = axis[0], axis.split("_")[-2]
    if key == "along_axis_orientation":
        return along(first, points[1] - points[0])
    return in_plane(first, plane.replace(first, "", 1)[:1] or "x", points[1] - points[0], points[2] - points[0])


def _cylindrical(c: list[float], radian: float) -> np.ndarray:
    return np.array([c[0] * math.cos(c[1] * radian), c[0] * math.sin(c[1] * radian), c[2]])


def _spherical(c: list[float], radian: float) -> np.ndarray:
    theta, phi = c[1] * radian, c[2] * radian
    return c[0] * np.array([math.cos(theta) * math.sin(phi), math.sin(theta) * math.sin(phi), math.cos(phi)])


COORDINATES: dict[str, Callable[[list[float], float], np.ndarray]] = {
    "car": lambda c, radian: np.array(c),
    "cyl": _cylindrical,
    "sph": _spherical,
}
"""Three coordinates and the radians in their unit of angle, to x, y and z."""
