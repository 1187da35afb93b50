"""Data elements of a deck as the expressions need them."""

from __future__ import annotations

from gearmbs.adams.parse import statements as st
from gearmbs.dae.equations.expressions import SplineData


def spline_data(spline: st.Spline) -> SplineData:
    """Return the points of a SPLINE: one curve, or a family whose rows begin with their z value.

    Raises
    ------
    ValueError
        When x or y is missing, or lengths or orders are wrong.
    """
    if spline.x is None or not spline.y:
        raise ValueError("X and Y are needed")
    n = len(spline.x)
    if len(spline.y) == 1 and len(spline.y[0]) == n:
        return SplineData(spline.x, spline.y, (), spline.linear_extrapolate)
    for row in spline.y:
        if len(row) != n + 1:
            raise ValueError(f"a curve of a family has its z value and {n} y values, got {len(row)} numbers")
    rows = tuple(row[1:] for row in spline.y)
    return SplineData(spline.x, rows, tuple(row[0] for row in spline.y), spline.linear_extrapolate)
