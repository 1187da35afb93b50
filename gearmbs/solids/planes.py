"""Parameters of a surface as a plane: unrolled, or of a sphere stereographic."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.errors import ModelError
from gearmbs.solids.surfaces import Surface, Turned


class Flat:
    """The parameters of a surface as the plane of the triangulation, periods unrolled."""

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.periods = surface.periods

    def to_plane(self, x: np.ndarray) -> np.ndarray:
        """Return places in the plane, shape (n, 2)."""
        return self.surface.project(x)

    def to_space(self, uv: np.ndarray) -> np.ndarray:
        """Return points, shape (n, 3)."""
        return self.surface.points(uv)


class FromPoint(Flat):
    """A sphere seen from one of its points, stereographically; scale 1 at the opposite side."""

    def __init__(self, sphere: Turned, away: np.ndarray) -> None:
        super().__init__(sphere)
        self.periods = (None, None)
        self.centre, self.radius, self.away = sphere.origin, sphere.radius, away
        k = int(np.argmin(np.abs(away)))
        first = np.cross(away, np.eye(3)[k])
        self.e1 = first / np.linalg.norm(first)
        # seen against `away` from outside, (e1, e2) turns with the outward normal
        self.e2 = np.cross(-away, self.e1)

    def to_plane(self, x: np.ndarray) -> np.ndarray:
        d = (x - self.centre) / np.linalg.norm(x - self.centre, axis=1)[:, None]
        w = 2.0 / np.maximum(1.0 - d @ self.away, 1e-12)
        return np.column_stack([w * (d @ self.e1), w * (d @ self.e2)])

    def to_space(self, uv: np.ndarray) -> np.ndarray:
        square = np.sum(uv**2, axis=1)[:, None]
        d = (4.0 * (uv[:, :1] * self.e1 + uv[:, 1:] * self.e2) + (square - 4.0) * self.away) / (square + 4.0)
        return self.centre + self.radius * d


def free_point(sphere: Turned, left: float, loops: list[np.ndarray], places: np.ndarray) -> np.ndarray:
    """Return a direction from a sphere's centre that a face does not hold, far from its loops."""
    k = np.arange(400)
    z = 1.0 - (2.0 * k + 1.0) / 400
    phi = k * np.pi * (3.0 - np.sqrt(5.0))
    directions = np.column_stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z])
    on = np.vstack([places[loop] for loop in loops]) - sphere.origin
    on /= np.linalg.norm(on, axis=1)[:, None]
    for c in np.argsort((directions @ on.T).max(axis=1)):
        flat = FromPoint(sphere, directions[c])
        shapes = [flat.to_plane(places[loop]) for loop in loops]
        # the widest loop is the outer one; the face is inside it if it turns to the left
        areas = [area(s) for s in shapes]
        widest = int(np.argmax(np.abs(areas)))
        if areas[widest] * left > 0.0:
            return directions[c]
    raise ModelError("a face covers its whole sphere and has edges; save the solid as .stl")


def area(polygon: np.ndarray) -> float:
    """Return the signed area of a polygon, positive if it turns to the left."""
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
