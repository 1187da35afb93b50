"""The points of CURVE statements and the numbers of MATRIX statements."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.data import read_matrices
from gearmbs.adams.parse.deck import Deck
from gearmbs.mechanism.parts.curves import Curve

if TYPE_CHECKING:
    from gearmbs.flexible import ModalModel, ModalNeutralFile


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


# What a FLEX_BODY is made of: its modal neutral file, and what of its MATRICES has a meaning that can be checked.
#
# ADAMS/View writes the matrices from the neutral file. Those that choose modes (SELMOD) and hold load cases (MODLOAD)
# are read. The modes chosen are believed when their frequencies are those of the file.


SAME = 1e-3
"""Relative difference of a frequency of SELMOD from that of the file."""
SELECTED, LOADS = "SELMOD", "MODLOAD"


@dataclass(frozen=True, eq=False)
class FlexibleBody:
    """A FLEX_BODY of a deck.

    Attributes
    ----------
    model : ModalModel
        With the modes that are used.
    numbers : ndarray of int
        Of these modes in their file.
    loads : ndarray, shape (6 + n, cases), or None
        Load cases in the deck's units: force and torque about the body's origin, in its axes, and the forces on modes.
    remark : str
        What was not read, or empty.
    """

    model: ModalModel
    numbers: np.ndarray
    loads: np.ndarray | None
    remark: str


def flexible_body(deck: Deck, s: st.FlexBody) -> FlexibleBody:
    """Return what a FLEX_BODY is made of.

    Raises
    ------
    ValueError
        If it has no file, or the file or its matrices cannot be.
    """
    mnf = _neutral_file(deck, s)
    model = mnf.modal_model(s.name or s.label())
    numbers = mnf.mode_ids[mnf.elastic]
    selected = _matrix(deck, s, SELECTED)
    remark = ""
    if selected is not None:
        chosen = _selected(selected, numbers, model.frequencies * deck.units.time)
        if chosen is not None:
            model, numbers = model.selected(chosen), numbers[chosen]
        else:
            remark = (
                f"{SELECTED} does not hold modes of the MNF with their frequencies; all {model.modes} elastic are taken"
            )
    elif s.matrices:
        remark = f"all {model.modes} elastic modes of the MNF are taken; which of them MATRICES select is not read"
    loads = _matrix(deck, s, LOADS)
    if loads is not None and loads.shape[0] != 6 + model.modes:
        raise ValueError(
            f"{LOADS} has {loads.shape[0]} rows; force, torque and {model.modes} modes that are used make "
            f"{6 + model.modes}"
        )
    return FlexibleBody(model, numbers, loads, remark)


def _neutral_file(deck: Deck, s: st.FlexBody) -> ModalNeutralFile:
    """Read the body's MNF, once a deck."""
    from gearmbs.flexible import FlexibleError, read_mnf

    if s.mnf_file is None:
        raise ValueError(
            "MNF_FILE is missing; bodies from MATRICES alone, whose order and layout are not published, MD DB and BDF "
            "files are not read. Write MNF_FILE = the body's modal neutral file; of matrices with a table of nodes one "
            "is made by gearmbs.flexible: write_mnf(path, mnf_of(reduce_model(from_matrices(k, m, positions), faces)))"
        )
    path = Path(s.mnf_file.replace("\\", "/"))
    if "://" in s.mnf_file:
        raise ValueError(f"MNF_FILE = {s.mnf_file}: no database of ADAMS/Car is looked up; give the path of the file")
    if not path.is_absolute():
        path = Path(deck.file).parent / path
    key = str(path)
    if key not in deck.modal_files:
        if not path.exists():
            raise ValueError(f"MNF_FILE = {s.mnf_file}: No such file or directory; looked for {path}")
        try:
            deck.modal_files[key] = read_mnf(path)
        except FlexibleError as error:
            raise ValueError(str(error)) from error
    return deck.modal_files[key]


def _matrix(deck: Deck, s: st.FlexBody, name: str) -> np.ndarray | None:
    """Return one of the body's matrices by its name, None if it has none that can be read."""
    for ref in s.matrices:
        statement = deck.of(st.Matrix).get(ref)
        if statement is None:
            raise ValueError(f"there is no MATRIX/{ref} for MATRICES")
        given = (statement.matrix_name or statement.name or "").upper()
        if given != name and not given.endswith(f"_{name}"):
            continue
        try:
            return matrix_values(statement)
        except ValueError as error:
            if name == LOADS:
                raise ValueError(f"{LOADS}: {error}") from error
    return None


def _selected(matrix: np.ndarray, numbers: np.ndarray, frequencies: np.ndarray) -> np.ndarray | None:
    """Return the places of the modes that a matrix lists with their frequencies, None if it does not."""
    rows = matrix if matrix.shape[1] == 2 else matrix.T
    if rows.ndim != 2 or rows.shape[1] != 2:
        return None
    place = {int(number): k for k, number in enumerate(numbers)}
    chosen = [place.get(int(number), -1) for number in rows[:, 0]]
    if not chosen or min(chosen) < 0 or len(set(chosen)) != len(chosen):
        return None
    known = frequencies[chosen]
    return np.array(chosen) if np.all(np.abs(rows[:, 1] - known) <= SAME * known) else None
