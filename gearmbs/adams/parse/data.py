"""The numbers of a deck's data elements: points of SPLINE and CURVE, and MATRIX, whose files (ADAMSMAT) say themselves
how their numbers are written.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck
from gearmbs.adams.parse.files import named_file
from gearmbs.dae.equations.expressions import SplineData
from gearmbs.mechanism.parts.curves import Curve

if TYPE_CHECKING:
    pass


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
    path = named_file("FILE", matrix.data_file or "", matrix.file)
    found = read_matrices(path)
    wanted = (matrix.matrix_name or "").upper()
    if wanted in found or (not wanted and len(found) == 1):
        return found[wanted] if wanted else next(iter(found.values()))
    raise ValueError(f"{matrix.label()}: FILE = {path.name} has no matrix {wanted!r}; it has {', '.join(found)}")


# Files of MATRIX statements.


FORMAT = re.compile(r"\(\s*(\d*)\s*[FEDG]\s*(\d+)\s*\.\s*\d+\s*\)", re.IGNORECASE)
"""Fields in a line and their width."""
OTHERS = {
    "ADAMSMAT2": "the second form of ADAMS", "MATRIXx": "FSAVE of MATRIXx", "MATSAVE": "MATSAVE of MATRIXx",
}  # fmt: skip


def read_matrices(path: Path) -> dict[str, np.ndarray]:
    """Return the matrices of a file by their names in capitals.

    A file has a line of title that begins with ADAMSMAT, the number of matrices, their names, and for each a line
    ``NAME FULL RORDER rows columns numbers (8F8.5)`` and its numbers in this format, by rows (RORDER) or columns
    (CORDER).

    Raises
    ------
    ValueError
        With file and line, for another format, numbers that cannot be, and a file that is cut off.
    """
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise ValueError(f"FILE = {path.name}: {error.strerror}; looked for {path}") from error

    def wrong(line: int, what: str) -> ValueError:
        return ValueError(f"FILE = {path.name}: line {line + 1}: {what}")

    head = lines[0] if lines else ""
    other = next((text for word, text in OTHERS.items() if head.startswith(word)), None)
    if other is not None or not head.startswith("ADAMSMAT"):
        what = f"it is {other}" if other else f"{head[:20]!r} begins no file of matrices"
        raise wrong(0, f"{what}; the text format ADAMSMAT is read")
    words = " ".join(lines[1:3]).split()
    if not words or not words[0].isdigit() or len(words) != 1 + int(words[0]):
        raise wrong(1, "the number of matrices and their names are expected")
    found: dict[str, np.ndarray] = {}
    at = 3
    for name in words[1:]:
        if at >= len(lines):
            raise wrong(at, f"matrix {name} is missing; the file is cut off")
        parts = lines[at].split("(")[0].split()
        layout = FORMAT.search(lines[at])
        if len(parts) != 6 or parts[0].upper() != name.upper() or layout is None:
            raise wrong(at, f"{name} FULL RORDER rows columns numbers (format) is expected")
        if parts[1].upper() != "FULL" or parts[2].upper() not in ("RORDER", "CORDER"):
            raise wrong(at, f"{parts[1]} {parts[2]} is not read; write the matrix FULL, by rows or columns")
        rows, columns, count = (int(word) if word.isdigit() else -1 for word in parts[3:])
        if min(rows, columns) < 1 or rows * columns != count:
            raise wrong(at, f"{' '.join(parts[3:])}: rows times columns are not the numbers")
        values, at = _numbers(lines, at + 1, count, int(layout[1] or 1), int(layout[2]), wrong)
        by_columns = parts[2].upper() == "CORDER"
        found[name.upper()] = (
            np.reshape(values, (columns, rows)).T if by_columns else np.reshape(values, (rows, columns))
        )
    return found


def _numbers(lines: list[str], at: int, count: int, each: int, width: int, wrong) -> tuple[list[float], int]:
    """Return numbers in fields of a width, so many in a line, and the line after them."""
    values: list[float] = []
    while len(values) < count:
        if at >= len(lines):
            raise wrong(at, f"{len(values)} of {count} numbers are there; the file is cut off")
        for k in range(min(each, count - len(values))):
            text = lines[at][k * width : (k + 1) * width].strip()
            try:
                values.append(float(text.replace("D", "E").replace("d", "e")))
            except ValueError:
                raise wrong(at, f"{text!r} is no number in columns {k * width + 1} to {(k + 1) * width}") from None
        at += 1
    return values, at
