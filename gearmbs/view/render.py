"""Pictures of solids without a graphics card: a small z-buffer renderer."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gearmbs.kernels.jit import njit

OVERSAMPLING = 2
EDGE = 0.35
"""Brightness of outlines."""


class Camera:
    """A parallel projection towards a point from a direction.

    Parameters
    ----------
    azimuth, elevation : float
        Direction towards the viewer, degrees: azimuth about ``up`` (from z when y points up, from x when z does) and
        elevation above the plane across it.
    up : sequence of 3 floats
        Global direction that points up in the picture.
    """

    def __init__(self, azimuth: float, elevation: float, up: Sequence[float] = (0.0, 0.0, 1.0)) -> None:
        top = np.asarray(up, dtype=float)
        if not np.linalg.norm(top) > 0.0:
            raise ValueError(f"up is {tuple(up)}; give a direction")
        top = top / np.linalg.norm(top)
        ahead = np.eye(3)[(int(np.argmax(np.abs(top))) + 1) % 3]
        ahead = ahead - (ahead @ top) * top
        ahead /= np.linalg.norm(ahead)
        aside = np.cross(top, ahead)
        az, el = math.radians(azimuth), math.radians(elevation)
        level = math.cos(az) * ahead + math.sin(az) * aside
        right = -math.sin(az) * ahead + math.cos(az) * aside
        back = math.cos(el) * level + math.sin(el) * top
        self.axes = np.stack([right, np.cross(back, right), back])
        self.centre = np.zeros(3)
        self.span = 1.0

    def frame(self, points: np.ndarray, width: int, height: int, margin: float = 1.06) -> None:
        """Aim at points (n, 3) so that they fill a picture of that size."""
        seen = points @ self.axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        self.centre = 0.5 * (low + high) @ self.axes
        extent = np.maximum(high - low, 1e-9)
        self.span = margin * max(extent[0] * height / width, extent[1])

    def project(self, points: np.ndarray, width: int, height: int) -> np.ndarray:
        """Return column, row and depth (towards the viewer, m) of points (..., 3)."""
        seen = (points - self.centre) @ self.axes.T
        scale = height / self.span
        column, row = 0.5 * width + seen[..., 0] * scale, 0.5 * height - seen[..., 1] * scale
        return np.stack([column, row, seen[..., 2]], axis=-1)

    def aspect(self, points: np.ndarray) -> float:
        """Return height over width of what points (n, 3) fill in the picture."""
        seen = points @ self.axes.T
        extent = np.maximum(np.ptp(seen, axis=0), 1e-9)
        return float(extent[1] / extent[0])


def render(
    triangles: list[np.ndarray],
    normals: list[np.ndarray],
    colours: list[tuple[float, float, float]],
    camera: Camera,
    width: int,
    height: int,
) -> np.ndarray:
    """Draw shaded solids.

    Parameters
    ----------
    triangles, normals : list of ndarray, shape (k, 3, 3)
        Corners (global, m) and normals there, a solid each.
    colours : list of (red, green, blue)
        Between 0 and 1.
    camera : Camera
    width, height : int
        Pixels.

    Returns
    -------
    ndarray, shape (height, width, 4)
        Red, green, blue, opacity between 0 and 1; nothing is drawn where there is no solid.
    """
    w, h = width * OVERSAMPLING, height * OVERSAMPLING
    depth = np.full((h, w), -np.inf)
    facing = np.zeros((h, w, 3), dtype=np.float32)
    owner = np.full((h, w), -1, dtype=np.int16)
    for k, (corners, directions) in enumerate(zip(triangles, normals)):
        _fill(camera.project(corners, w, h), directions @ camera.axes.T, k, depth, facing, owner)
    image = np.zeros((height, width, 4))
    _shade(depth, facing, owner, np.array(colours, dtype=float).reshape(-1, 3), 12.0 * camera.span / h, image)
    return image


@njit(cache=True)
def _light(x, y, z):
    """Brightness of a surface that faces (x, y, z): light from all around, from upper left, and a little from right."""
    bright = 0.5 + 0.5 * max(-0.45 * x + 0.65 * y + 0.61 * z, 0.0) + 0.2 * max(0.7 * x + 0.1 * y + 0.7 * z, 0.0)
    return bright + 0.18 * max(-0.25 * x + 0.36 * y + 0.9 * z, 0.0) ** 24


@njit(cache=True)
def _is_edge(depth, facing, owner, j, i, step):
    """Whether solid, direction or, by a step, depth change to one of the four neighbours."""
    h, w = depth.shape
    for dj, di in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        m, n = j + dj, i + di
        if m < 0 or n < 0 or m >= h or n >= w:
            continue
        if owner[m, n] < 0:
            return True
        turn = 0.0
        for c in range(3):
            turn += facing[m, n, c] * facing[j, i, c]
        steep = max(min(facing[m, n, 2], facing[j, i, 2]), 0.08)
        # two solids that touch flush have no edge between them
        other = owner[m, n] != owner[j, i]
        if turn < (0.98 if other else 0.86) or abs(depth[m, n] - depth[j, i]) > (0.3 if other else 1.0) * step / steep:
            return True
    return False


@njit(cache=True)
def _shade(depth, facing, owner, colours, step, image):
    """Colour the picture from the buffers, a block of samples for each pixel."""
    share = 1.0 / OVERSAMPLING**2
    for row in range(image.shape[0]):
        for column in range(image.shape[1]):
            count = 0
            for j in range(row * OVERSAMPLING, (row + 1) * OVERSAMPLING):
                for i in range(column * OVERSAMPLING, (column + 1) * OVERSAMPLING):
                    number = owner[j, i]
                    if number < 0:
                        continue
                    count += 1
                    bright = _light(facing[j, i, 0], facing[j, i, 1], facing[j, i, 2])
                    if _is_edge(depth, facing, owner, j, i, step):
                        bright *= EDGE
                    for c in range(3):
                        image[row, column, c] += min(1.0, colours[number, c] * bright)
            if count > 0:
                for c in range(3):
                    image[row, column, c] /= count
            image[row, column, 3] = count * share


@njit(cache=True)
def _fill(screen, normals, number, depth, facing, owner):
    """Draw triangles into the buffers; a pixel keeps what is nearest to the viewer."""
    h, w = depth.shape
    for k in range(screen.shape[0]):
        x0, y0, z0 = screen[k, 0, 0], screen[k, 0, 1], screen[k, 0, 2]
        x1, y1, z1 = screen[k, 1, 0], screen[k, 1, 1], screen[k, 1, 2]
        x2, y2, z2 = screen[k, 2, 0], screen[k, 2, 1], screen[k, 2, 2]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area >= 0.0:  # rows count downwards, so what faces the viewer runs clockwise
            continue
        left = max(0, int(np.ceil(min(x0, x1, x2) - 0.5)))
        right = min(w - 1, int(np.floor(max(x0, x1, x2) - 0.5)))
        top = max(0, int(np.ceil(min(y0, y1, y2) - 0.5)))
        bottom = min(h - 1, int(np.floor(max(y0, y1, y2) - 0.5)))
        for j in range(top, bottom + 1):
            y = j + 0.5
            for i in range(left, right + 1):
                x = i + 0.5
                a = ((x1 - x) * (y2 - y) - (x2 - x) * (y1 - y)) / area
                b = ((x2 - x) * (y0 - y) - (x0 - x) * (y2 - y)) / area
                c = 1.0 - a - b
                if a < 0.0 or b < 0.0 or c < 0.0:
                    continue
                z = a * z0 + b * z1 + c * z2
                if z > depth[j, i]:
                    depth[j, i] = z
                    owner[j, i] = number
                    for m in range(3):
                        facing[j, i, m] = a * normals[k, 0, m] + b * normals[k, 1, m] + c * normals[k, 2, m]
