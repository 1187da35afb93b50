"""Curves through points: cubic splines over the length of the chords, open or closed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.dae.errors import ModelError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

WRAPPED = 20
"""Points by which a closed curve is continued beyond its ends: what a natural end does to a cubic spline falls by a
factor of 3.7 from each point to the next."""
SAMPLES = 40
"""Between two points, where what is nearest is looked for first."""
FLAT = 1e-9
"""Extent in z, of all, below which a curve is plane."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A cubic spline through points.

    Attributes
    ----------
    points : array_like, shape (n, 3)
        In the mechanism's unit of length; at least four. Those of a closed curve begin and end in one place, or do not
        hold the first one again.
    closed : bool
    """

    points: Any
    closed: bool = False

    def __post_init__(self) -> None:
        points = np.asarray(self.points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise ModelError(f"curve: points have the shape {points.shape}; give rows of x, y and z")
        if self.closed and not np.allclose(points[0], points[-1], atol=1e-6 * np.ptp(points, axis=0).max()):
            points = np.vstack([points, points[:1]])
        elif self.closed:
            points = np.vstack([points[:-1], points[:1]])
        if len(points) < 4:
            raise ModelError(f"curve: {len(points)} points; give at least four")
        if not np.linalg.norm(np.diff(points, axis=0), axis=1).min() > 0.0:
            raise ModelError("curve: two points in succession are the same")
        object.__setattr__(self, "points", points)

    @property
    def knots(self) -> np.ndarray:
        """Parameter of each point: length along the chords from the first, shape (n,)."""
        return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))]

    @property
    def length(self) -> float:
        """Largest parameter."""
        return float(self.knots[-1])

    @property
    def plane(self) -> bool:
        """Whether z is the same everywhere."""
        return bool(np.ptp(self.points[:, 2]) <= FLAT * np.ptp(self.points, axis=0).max())

    def tables(self) -> tuple[np.ndarray, np.ndarray]:
        """Return parameters and points of the splines: a closed curve goes on beyond its ends."""
        s, c = self.knots, self.points
        if not self.closed:
            return s, c
        n = len(s) - 1
        number = np.arange(-WRAPPED, n + WRAPPED + 1)
        return s[number % n] + self.length * (number // n), c[number % n]

    def spline(self) -> CubicSpline:
        """Return the curve as a function of its parameter."""
        from scipy.interpolate import CubicSpline

        s, c = self.tables()
        return CubicSpline(s, c, bc_type="natural")

    def nearest(self, place: np.ndarray) -> float:
        """Return the parameter of the point next to a place."""
        curve = self.spline()
        s = np.concatenate([np.linspace(a, b, SAMPLES, endpoint=False) for a, b in zip(self.knots, self.knots[1:])])
        s = np.append(s, self.length)
        best = float(s[np.argmin(np.sum((curve(s) - place) ** 2, axis=1))])
        first, second = curve.derivative(1), curve.derivative(2)
        for _ in range(10):
            apart, tangent = curve(best) - place, first(best)
            slope = tangent @ tangent + apart @ second(best)
            if slope <= 0.0:
                break
            best -= float(apart @ tangent / slope)
        return best % self.length if self.closed else min(max(best, 0.0), self.length)
