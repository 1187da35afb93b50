"""What a FLEX_BODY is made of: its modal neutral file, and what of its MATRICES has a meaning that can be checked.

ADAMS/View writes the matrices from the neutral file. Those that choose modes (SELMOD) and hold load cases (MODLOAD) are
read. The modes chosen are believed when their frequencies are those of the file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearmbs.adams.builders.curve_data import matrix_values
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.deck import Deck

if TYPE_CHECKING:
    from gearmbs.flexible import ModalModel, ModalNeutralFile

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
