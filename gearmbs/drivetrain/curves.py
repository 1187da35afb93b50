"""Piecewise cubic curves through points, as the kernels of tables read them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearmbs.drivetrain.errors import require


def slopes(
    label: str, x: Sequence[float], y: Sequence[float], period: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points and slopes of the monotone cubic through them, of a periodic curve of the periodic spline.

    Parameters
    ----------
    label : str
        What messages call the owner of the points.
    x, y : sequence of float
        Two points or more, x increasing.
    period : float
        Period in x; the first and last points lie one period apart then, with the same value.

    Raises
    ------
    DrivetrainError
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    a, b = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    require(a.shape == b.shape and a.ndim == 1 and a.size >= 2, f"{label}: give as many torques as places, two or more")
    require(bool(np.all(np.diff(a) > 0.0)), f"{label}: the places of its table must increase")
    if period > 0.0:
        require(abs(a[-1] - a[0] - period) < 1e-9 * period, f"{label}: the table must cover one period, {period:g} rad")
        require(abs(b[-1] - b[0]) <= 1e-9 * np.abs(b).max(), f"{label}: the table's last torque must be its first")
        b[-1] = b[0]
        return a, b, CubicSpline(a, b, bc_type="periodic")(a, 1)
    return a, b, PchipInterpolator(a, b)(a, 1) if a.size > 2 else np.full(2, (b[1] - b[0]) / (a[1] - a[0]))
