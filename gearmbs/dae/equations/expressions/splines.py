"""Splines of expressions: points of ADAMS's SPLINE, and the tables of cubics made from them.

A table is a block of floats: number of x values, number of curves, extrapolation flag, the x
values, the z values, then for every curve and interval the four coefficients of the cubic in
(x - x_k), lowest power first.

Between curves the value is linear in z, beyond the first and last curve constant. Outside the x range the end
cubic's parabola continues, or its tangent when linear extrapolation is asked for.

References
----------
.. [1] G. Forsythe, M. Malcolm, C. Moler, Computer Methods for Mathematical Computations, 1977,
   ch. 4: end conditions of the cubic spline.
.. [2] H. Akima, J. ACM 17 (1970) 589-602.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class SplineData:
    """Points of a SPLINE: one curve y(x) or a family y(x, z).

    Parameters
    ----------
    x : array_like of float
        At least four increasing values.
    y : array_like of float
        One row a curve, each as long as ``x``; a single curve may be given without its row.
    z : array_like of float
        Increasing values of the second variable; empty for a single curve.
    linear_extrapolate : bool
        Continue with the end tangents instead of the end parabolas.
    """

    x: tuple[float, ...]
    y: tuple[tuple[float, ...], ...]
    z: tuple[float, ...] = ()
    linear_extrapolate: bool = False

    def __post_init__(self) -> None:
        rows: Any = self.y if len(self.y) and np.ndim(self.y[0]) else (self.y,)
        for name, values in (("x", self.x), ("z", self.z)):
            object.__setattr__(self, name, tuple(float(v) for v in values))
        object.__setattr__(self, "y", tuple(tuple(float(v) for v in row) for row in rows))
        if len(self.x) < 4:
            raise ValueError(f"a spline needs at least four x values, got {len(self.x)}")
        if not all(math.isfinite(v) for row in (self.x, self.z, *self.y) for v in row):
            raise ValueError("a spline's x, y and z values must be finite")
        if any(b <= a for a, b in zip(self.x, self.x[1:])):
            raise ValueError("a spline's x values must increase")
        if not self.y or any(len(row) != len(self.x) for row in self.y):
            raise ValueError(f"a spline needs one y for each of its {len(self.x)} x values, in every curve")
        if len(self.y) > 1 and len(self.z) != len(self.y):
            raise ValueError(f"a spline of {len(self.y)} curves needs as many z values, got {len(self.z)}")
        if any(b <= a for a, b in zip(self.z, self.z[1:])):
            raise ValueError("a spline's z values must increase")


def _end_third_derivative(x: np.ndarray, y: np.ndarray) -> float:
    """Return the third divided difference of four points: a sixth of the cubic's third derivative."""
    d1 = np.diff(y) / np.diff(x)
    d2 = np.diff(d1) / (x[2:] - x[:-2])
    return float((d2[1] - d2[0]) / (x[3] - x[0]))


def cubic_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the slopes at the knots of the C2 cubic whose end third derivatives match end cubics [1]_."""
    from scipy.linalg import solve_banded

    n = len(x)
    h = np.diff(x)
    delta = np.diff(y) / h
    band = np.zeros((3, n))
    rhs = np.zeros(n)
    band[1, 1:-1] = 2.0 * (h[:-1] + h[1:])
    band[0, 2:] = h[:-1]
    band[2, :-2] = h[1:]
    rhs[1:-1] = 3.0 * (h[1:] * delta[:-1] + h[:-1] * delta[1:])
    # a Hermite cubic's third derivative is 6 (s0 + s1 - 2 delta)/h^2
    band[1, 0] = band[0, 1] = 1.0
    rhs[0] = 2.0 * delta[0] + h[0] ** 2 * _end_third_derivative(x[:4], y[:4])
    band[1, -1] = band[2, -2] = 1.0
    rhs[-1] = 2.0 * delta[-1] + h[-1] ** 2 * _end_third_derivative(x[-4:], y[-4:])
    return solve_banded((1, 1), band, rhs)


def akima_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return Akima's slopes at the knots [2]_, with two parabolic extra intervals at each end."""
    m = np.empty(len(x) + 3)
    m[2:-2] = np.diff(y) / np.diff(x)
    m[1] = 2.0 * m[2] - m[3]
    m[0] = 2.0 * m[1] - m[2]
    m[-2] = 2.0 * m[-3] - m[-4]
    m[-1] = 2.0 * m[-2] - m[-3]
    w_right = np.abs(m[3:] - m[2:-1])
    w_left = np.abs(m[1:-2] - m[:-3])
    total = w_left + w_right
    flat = total <= 1e-300
    safe = np.where(flat, 1.0, total)
    return np.where(flat, 0.5 * (m[1:-2] + m[2:-1]), (w_right * m[1:-2] + w_left * m[2:-1]) / safe)


def spline_table(data: SplineData, method: str) -> np.ndarray:
    """Return the flat table of a spline.

    Parameters
    ----------
    data : SplineData
    method : {"cubic", "akima"}

    Returns
    -------
    ndarray of float64
    """
    x = np.array(data.x)
    slopes_of = cubic_slopes if method == "cubic" else akima_slopes
    z = np.array(data.z if data.z else (0.0,))
    parts = [np.array([len(x), len(data.y), float(data.linear_extrapolate)]), x, z[: len(data.y)]]
    h = np.diff(x)
    for row in data.y:
        y = np.array(row)
        s = slopes_of(x, y)
        delta = np.diff(y) / h
        c2 = (3.0 * delta - 2.0 * s[:-1] - s[1:]) / h
        c3 = (s[:-1] + s[1:] - 2.0 * delta) / h**2
        parts.append(np.stack([y[:-1], s[:-1], c2, c3], axis=1).ravel())
    return np.concatenate(parts)


TABLE_HEAD = 3
