"""Files of Nastran as pyyeti reads them: whole records, tables of grid points, displacement coordinate systems."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.errors import FlexibleError

ORDERS: tuple[Literal["little", "big"], ...] = ("little", "big")
FIRST_RECORDS = {"OP4": (24, 48), "op2": (4, 8)}
"""Sizes in bytes that the first record of a binary file may have, by words of 4 and 8 bytes."""
PRINTED = bytes(range(32, 127)) + b"\t\r\n"
"""What a text file consists of."""


@dataclass(frozen=True, eq=False)
class GridTable:
    """Grid points and the degrees of freedom of matrices, of a table of pyyeti.

    Attributes
    ----------
    ids, positions, axes : ndarray, shapes (N,), (N, 3), (N, 3, 3)
        Numbers, places in the basic coordinate system, and axes of the displacements there, as columns.
    dofs : ndarray, shape (d, 2)
        Grid point and direction 1 to 6 of each row; grid point 0 for scalar points.
    """

    ids: np.ndarray
    positions: np.ndarray
    axes: np.ndarray
    dofs: np.ndarray

    @classmethod
    def of(cls, uset: Any) -> GridTable:
        """Return the table of a ``uset`` of pyyeti, whose six rows a grid point hold place and coordinate system."""
        index = np.array([(int(number), int(dof)) for number, dof in uset.index])
        numbers = uset[["x", "y", "z"]].to_numpy(dtype=float)
        first = np.flatnonzero(index[:, 1] == 1)
        axes = np.array([axes_at(numbers[k : k + 6]) for k in first]).reshape(-1, 3, 3)
        dofs = index.copy()
        dofs[index[:, 1] == 0] = (0, 1)
        return cls(index[first, 0], numbers[first], axes, dofs)

    def in_basic(self, matrix: Any) -> sp.csc_array:
        """Return a matrix of these degrees of freedom turned into the basic coordinate system."""
        row = {int(number): k for k, number in enumerate(self.ids)}
        turn = sp.lil_array((len(self.dofs), len(self.dofs)))
        place = {(int(n), int(d)): k for k, (n, d) in enumerate(self.dofs) if n != 0}
        for k, (number, direction) in enumerate(self.dofs):
            if number == 0:
                turn[k, k] = 1.0
                continue
            axis, base = (direction - 1) % 3, 3 * ((direction - 1) // 3)
            for other in range(3):
                share = self.axes[row[int(number)]][axis, other]
                if share != 0.0:
                    if (int(number), base + other + 1) not in place:
                        raise FlexibleError(
                            f"grid point {number}: its displacements are in a coordinate system of their own, and not "
                            "all three are in the matrices; keep all six degrees of freedom of such a point"
                        )
                    turn[k, place[int(number), base + other + 1]] = share
        whole = sp.csc_array(turn)
        return sp.csc_array(whole @ sp.csc_array(matrix) @ whole.T)


def axes_at(rows: np.ndarray) -> np.ndarray:
    """Return the axes of the displacements of a grid point from its six rows: place; kind; origin; axes."""
    kind, origin, axes = int(rows[1, 1]), rows[2], rows[3:6]
    if kind == 1:
        return axes
    local = axes.T @ (rows[0] - origin)
    around = float(np.arctan2(local[1], local[0])) if np.hypot(local[0], local[1]) > 0.0 else 0.0
    c, s = np.cos(around), np.sin(around)
    cylinder = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    if kind == 2:
        return axes @ cylinder
    down = float(np.arctan2(np.hypot(local[0], local[1]), local[2]))
    c, s = np.cos(down), np.sin(down)
    # r, theta, phi from the cylinder's r, phi, z
    sphere = np.array([[s, c, 0.0], [0.0, 0.0, 1.0], [c, -s, 0.0]])
    return axes @ cylinder @ sphere


def block_records(opened: Any, block: str) -> list[bytes]:
    """Return the records of the last block of a name, without its head."""
    opened.set_position(opened.dbnames[block][-1][0][0])
    opened.rdop2nt()
    out = []
    while (data := opened.rdop2record("bytes")) is not None:
        out.append(data)
    return out


def word_kinds(opened: Any) -> tuple[str, str]:
    """Return the kinds of whole numbers and of numbers with a point in a file's words."""
    order, size = opened._endian, opened._ibytes
    return f"{order}i{size}", f"{order}f{size}"


def assembly_table(path: Path) -> GridTable:
    """Return the points of the assembly file of an external superelement."""
    bulk = pyyeti_module("bulk", "assembly")
    if not path.is_file():
        raise FlexibleError(f"{path.name}: there is no such file")
    try:
        # the punch file beside it says which directions of the boundary were kept
        uset = bulk.asm2uset(str(path), try_rdextrn=path.with_suffix(".pch").is_file())[0]
    except Exception as error:
        raise FlexibleError(
            f"{path.name}: it is no assembly file of EXTSEOUT ({type(error).__name__}: {error})"
        ) from None
    if not len(uset):
        raise FlexibleError(f"{path.name}: it is no assembly file of EXTSEOUT: it has no grid points")
    return GridTable.of(uset)


def check_end(file: Path, kind: str) -> None:
    """Follow the records of a file to its end.

    Raises
    ------
    FlexibleError
        If there is no file, a record is cut off or ends otherwise than it began, or the file ends between the records
        of a matrix or a data block, with its byte.

    Notes
    -----
    A matrix of OP4 begins with a record of its size, columns first. Each other record begins with the number of its
    column, and the last one of the matrix says one more than it has.
    """
    if not file.is_file():
        raise FlexibleError(f"{file.name}: there is no such file")
    total = file.stat().st_size
    with file.open("rb") as opened:
        head = opened.read(200)
        if kind == "OP4" and head and not head.translate(None, PRINTED):
            return
        order = next((o for o in ORDERS if int.from_bytes(head[:4], o) in FIRST_RECORDS[kind]), None)
        if order is None:
            raise FlexibleError(f"{file.name}: byte 0: {head[:4].hex()} begins no {kind} file of Nastran")
        at, size, begun, columns = 0, 0, 0, None
        word = 8 if int.from_bytes(head[:4], order) == FIRST_RECORDS[kind][1] else 4
        while at < total:
            opened.seek(at)
            size = int.from_bytes(opened.read(4), order)
            first = int.from_bytes(opened.read(min(word, size)), order)
            if at + 8 + size > total:
                raise FlexibleError(
                    f"{file.name}: byte {at}: a record of {size} bytes is cut off; the file is not whole"
                )
            opened.seek(at + 4 + size)
            if int.from_bytes(opened.read(4), order) != size:
                raise FlexibleError(f"{file.name}: byte {at}: a record of {size} bytes does not end where it says")
            if columns is None:
                begun, columns = at, first
            elif first > columns:
                columns = None
            at += 8 + size
        if kind == "OP4" and columns is not None:
            raise FlexibleError(
                f"{file.name}: byte {begun}: a matrix of {columns} columns is cut off; the file is not whole"
            )
        opened.seek(total - 4 - size)
        if kind == "op2" and any(opened.read(size)):
            raise FlexibleError(f"{file.name}: byte {total - size - 8}: it ends within a data block; it is not whole")


def pyyeti_module(module: str, what: str) -> Any:
    """Return a module of pyyeti's."""
    try:
        # it sets numpy's legacy print mode, in which text files lose digits
        with np.printoptions():
            return importlib.import_module(f"pyyeti.nastran.{module}")
    except ImportError:
        raise FlexibleError(f"{what} files are read by pyyeti; install it with 'pip install gearmbs[fem]'") from None
