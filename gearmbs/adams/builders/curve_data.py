"""The points of CURVE statements and the numbers of MATRIX statements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.matrix_files import read_matrices
from gearmbs.mechanism.curves import Curve


def curve_points(deck: Deck, number: int | None) -> Curve:
    """Return a CURVE in the deck's unit of length.

    Raises
    ------
    ValueError
        If it has no points, or its matrix does not hold them.
    """
    statement = deck.of(st.CurveStatement)[number or 0]
    closed = statement.ends == "CLOSED"
    if statement.sampled:
        return Curve(np.array(statement.sampled)[:, 1:], closed)
    if statement.matrix not in deck.of(st.Matrix):
        raise ValueError("it has no points")
    points = matrix_values(deck.of(st.Matrix)[statement.matrix])
    if points.shape[1] != 3 or len(points) < 4:
        raise ValueError(
            f"MATRIX/{statement.matrix} is {points.shape[0]} by {points.shape[1]}; a curve has rows x, y, z"
        )
    if statement.points == "CONTROL_POINTS":
        points = from_control_points(points, statement.order)
    return Curve(points, closed)


def from_control_points(points: np.ndarray, order: int) -> np.ndarray:
    """Return points of the B-spline of an order that control points clamp at both ends."""
    from scipy.interpolate import BSpline

    degree = order - 1
    if not 1 <= degree < len(points):
        raise ValueError(f"ORDER = {order}; for {len(points)} control points it is from 2 to {len(points)}")
    inner = np.linspace(0.0, 1.0, len(points) - degree + 1)
    knots = np.r_[np.zeros(degree), inner, np.ones(degree)]
    return BSpline(knots, points, degree)(np.linspace(0.0, 1.0, 10 * len(points) + 1))


def matrix_values(matrix: st.Matrix) -> np.ndarray:
    """Return a MATRIX, shape (rows, columns).

    Raises
    ------
    ValueError
        If the numbers do not fill it, or it is not in its file.
    """
    if matrix.data_file:
        return _from_file(matrix)
    rows, columns = matrix.rows or 0, matrix.columns or 0
    if matrix.sparse:
        entries = np.array(matrix.values)
        if entries.size % 3:
            raise ValueError(f"{matrix.label()}: VALUES of a sparse matrix are row, column, value")
        out = np.zeros((rows, columns))
        for row, column, value in entries.reshape(-1, 3):
            if not (1 <= row <= rows and 1 <= column <= columns):
                raise ValueError(f"{matrix.label()}: there is no row {row:g}, column {column:g}")
            out[int(row) - 1, int(column) - 1] = value
        return out
    if rows * columns != len(matrix.values):
        raise ValueError(f"{matrix.label()}: {rows} rows and {columns} columns need {rows * columns} values, "
                         f"got {len(matrix.values)}")  # fmt: skip
    if matrix.full == "CORDER":
        return np.reshape(matrix.values, (columns, rows)).T
    return np.reshape(matrix.values, (rows, columns))


def _from_file(matrix: st.Matrix) -> np.ndarray:
    """Return a MATRIX of a file beside the deck: by its name there, or the only one."""
    path = Path((matrix.data_file or "").replace("\\", "/"))
    found = read_matrices(path if path.is_absolute() else Path(matrix.file).parent / path)
    wanted = (matrix.matrix_name or "").upper()
    if wanted in found or (not wanted and len(found) == 1):
        return found[wanted] if wanted else next(iter(found.values()))
    raise ValueError(f"{matrix.label()}: FILE = {path.name} has no matrix {wanted!r}; it has {', '.join(found)}")
