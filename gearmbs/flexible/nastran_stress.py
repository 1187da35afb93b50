"""Stresses of the modes of Nastran's op2 files, at the grid points of solid elements."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.matrices import FileUnits
from gearmbs.flexible.matrix_text import Path_
from gearmbs.flexible.nastran_files import GridTable, pyyeti_module
from gearmbs.flexible.nastran_grids import op2_tables
from gearmbs.flexible.stress import COMPONENTS, StressModes
from gearmbs.units import Quantity

BLOCKS = ("OES1X1", "OES1X", "OES1")
"""Data blocks of stresses, in which each mode and kind of element has an identification and a record."""
SOLIDS = {39: ("CTETRA", 4), 67: ("CHEXA", 8), 68: ("CPENTA", 6), 255: ("CPYRAM", 5)}
"""Names and corners of elements by their number in a data block."""
IDENTIFICATION = 146
"""Words of an identification."""
ELEMENT, PLACE = 4, 21
"""Words of an element (number, coordinate system, kind, corners) and of each of its places: the centre, the corners."""
NUMBERS = [1, 9, 15, 2, 10, 16]
"""Words of a place that hold the stresses xx, yy, zz, xy, yz, zx; the first word is the grid point."""


def read_op2_stresses(path: Path_, *, length: Quantity = 1.0, force: Quantity = 1.0) -> StressModes:
    """Return the stresses of the modes of a Nastran op2 file, as ``STRESS(PLOT)=ALL`` writes them in SOL 103.

    They are those at the corners of solid elements (CHEXA, CPENTA, CPYRAM, CTETRA) in the basic coordinate system. A
    grid point has the mean of its elements. :func:`read_op2_modes` puts them on the body (``stresses=True``).

    Parameters
    ----------
    path : str or Path
        With grid points, as for :func:`read_op2_modes`, and stresses (OES1X1 or OES1).
    length, force : float or str
        The file's units: SI values, or names as ``"mm"``.

    Returns
    -------
    StressModes
        By one unit of each mode of the file, at the grid points that solid elements have at their corners.

    Warns
    -----
    UserWarning
        If there are stresses of other elements, which are left out.

    Raises
    ------
    FlexibleError
        If pyyeti is not installed, the file is cut off, has no such stresses, or they are in other coordinate systems.
    """
    file = Path(path)
    length, force, _ = FileUnits.of(length, force)
    return grid_stresses(file, op2_tables(file, [])["grids"], length, force)


def grid_stresses(file: Path, table: GridTable, length: float, force: float) -> StressModes:
    """Return the stresses of a file whose grid points are known, SI."""
    modes: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}
    others: dict[int, int] = {}
    for kind, mode, words in _records(file):
        if kind in SOLIDS:
            modes.setdefault(mode, []).append(_places(file, kind, mode, words))
        else:
            others[kind] = mode
    if not modes:
        raise FlexibleError(
            f"{file.name}: it has no stresses of solid elements ({', '.join(BLOCKS)}); ask for STRESS(PLOT)=ALL"
        )
    for kind, mode in others.items():
        if mode not in modes:
            raise FlexibleError(f"{file.name}: mode {mode} has stresses of elements of type {kind} and none of solids")
    if others:
        kinds = ", ".join(str(kind) for kind in sorted(others))
        warnings.warn(
            f"{file.name}: stresses of elements that are no solids (types {kinds} of Nastran) are left out",
            stacklevel=3,
        )
    grids = [np.concatenate([g for g, _ in parts]) for parts in modes.values()]
    for mode, own in zip(modes, grids):
        if not np.array_equal(own, grids[0]):
            raise FlexibleError(
                f"{file.name}: mode {mode} has stresses of other elements than mode {next(iter(modes))}; ask for all"
            )
    ids, place, shared = np.unique(grids[0], return_inverse=True, return_counts=True)
    rows = {int(number): k for k, number in enumerate(table.ids)}
    unknown = [int(k) for k in ids if int(k) not in rows]
    if unknown:
        raise FlexibleError(f"{file.name}: stresses are at grid point {unknown[0]}, which GEOM1 does not have")
    values = np.zeros((len(modes), len(ids), len(COMPONENTS)))
    for k, parts in enumerate(modes.values()):
        np.add.at(values[k], place, np.concatenate([stress for _, stress in parts]))
    values *= (force / length**2) / shared[:, None]
    if not np.all(np.isfinite(values)):
        raise FlexibleError(f"{file.name}: stresses at {ids[~np.isfinite(values).all(axis=(0, 2))][0]} are not finite")
    return StressModes(table.positions[[rows[int(k)] for k in ids]] * length, values)


def _records(file: Path) -> list[tuple[int, int, np.ndarray]]:
    """Return kind of element, mode and words, as whole numbers by elements, of each record of stresses."""
    out: list[tuple[int, int, np.ndarray]] = []
    op2 = pyyeti_module("op2", "op2")
    with op2.OP2(str(file)) as opened:
        for name in (name for name in BLOCKS if name in opened.dbnames):
            if len(opened.dbnames[name]) > 1:
                raise FlexibleError(f"{file.name}: {name} is there more than once; write one subcase")
            opened.set_position(name)
            opened.rdop2nt()
            while (head := opened.rdop2record("bytes")) is not None:
                data = opened.rdop2record("bytes")
                out.append(_record(file, name, head, data))
    seen = [record[:2] for record in out]
    for record in seen:
        if seen.count(record) > 1:
            raise FlexibleError(f"{file.name}: mode {record[1]} has its stresses twice; write one subcase")
    return out


def _record(file: Path, name: str, head: bytes, data: bytes | None) -> tuple[int, int, np.ndarray]:
    """Return kind of element, mode and words of one record, checked against its identification."""
    word = len(head) // IDENTIFICATION
    if len(head) != IDENTIFICATION * word or word not in (4, 8) or data is None:
        raise FlexibleError(f"{file.name}: {name} has an identification of {len(head)} bytes, or no stresses after it")
    # the table's code is small in the right order only
    order = min("<>", key=lambda o: abs(int(np.frombuffer(head, f"{o}i{word}", 2)[1])))
    words = np.frombuffer(head, f"{order}i{word}")
    code, kind, mode, real, wide = (int(words[k]) for k in (1, 2, 4, 8, 9))
    if code != 5 or real != 1 or kind < 1:
        raise FlexibleError(
            f"{file.name}: {name} has a table of code {code}, format {real}, where 5 and 1 are stresses of real modes, "
            "mode by mode; ask for STRESS(PLOT,SORT1,REAL)=ALL in SOL 103"
        )
    if wide < 1 or len(data) % (wide * word):
        raise FlexibleError(f"{file.name}: {name}: {len(data)} bytes are no elements of {wide} words")
    return kind, mode, np.frombuffer(data, f"{order}i{word}").reshape(-1, wide)


def _places(file: Path, kind: int, mode: int, words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return grid points and stresses at the corners of elements of one kind."""
    name, corners = SOLIDS[kind]
    if words.shape[1] != ELEMENT + PLACE * (corners + 1):
        raise FlexibleError(
            f"{file.name}: mode {mode}: {name} has {words.shape[1]} words, {ELEMENT + PLACE * (corners + 1)} hold the "
            "stresses at centre and corners"
        )
    skew = np.flatnonzero(words[:, 1] != 0)
    if skew.size:
        raise FlexibleError(
            f"{file.name}: stresses of {name} {words[skew[0], 0] // 10} are in coordinate system {words[skew[0], 1]}; "
            "leave CORDM of its PSOLID blank, or 0, for the basic one"
        )
    places = words[:, ELEMENT:].reshape(len(words), corners + 1, PLACE)[:, 1:]
    stress = places.view(places.dtype.str.replace("i", "f"))[..., NUMBERS]
    return places[..., 0].ravel(), stress.reshape(-1, len(COMPONENTS)).astype(float)
