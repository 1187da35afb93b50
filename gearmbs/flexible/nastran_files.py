"""Files of Nastran as pyyeti reads them: whole records, tables of grid points, displacement coordinate systems."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.errors import FlexibleError

GRID_BLOCKS = ("GEOM1", "BGPDT", "EQEXIN")
ORDERS: tuple[Literal["little", "big"], ...] = ("little", "big")
SAME_PLACE = 1e-4
"""Distance of a point's places in two blocks against the size of the model: words of 4 bytes, angles in degrees."""
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


def op2_tables(file: Path, matrices: list[str]) -> dict[str, Any]:
    """Return matrices, eigenvalues (``lama``), weights (``ogpwg``), grid points and names of blocks of an op2 file.

    Grid points are those of EQEXIN, BGPDT and GEOM1; where one of these is missing or they do not fit each other, those
    of GEOM1 alone (:func:`~gearmbs.flexible.nastran_grids.bulk_grids`).

    Raises
    ------
    FlexibleError
        If the records are not whole, or there are no grid points.
    """
    from gearmbs.flexible.nastran_grids import bulk_grids

    op2 = pyyeti_module("op2", "op2")
    check_end(file, "op2")
    try:
        with op2.OP2(str(file)) as opened:
            names = [str(name) for name in opened.dbnames]
            lacking = [block for block in GRID_BLOCKS if not any(name.startswith(block) for name in names)]
            found = None
            if not lacking:
                try:
                    found = opened.rdparampost(get_mats=matrices or False, get_dr_tables=False)
                    found["grids"] = GridTable.of(found["uset"])
                except (ValueError, KeyError, IndexError):
                    # EQEXINS beside BGPDTS of another superelement, tables of other lengths
                    found = None
            if found is not None:
                _check_places(file, found["grids"])
                return found | {"names": names}
            grids = bulk_grids(file)
            if grids is None:
                missing = f"{', '.join(lacking)} {'is' if len(lacking) == 1 else 'are'} missing"
                raise FlexibleError(
                    f"{file.name}: it has no grid points ({missing if lacking else 'GEOM1 is without'}; GEOM1 alone "
                    "would do); write it with PARAM,POST,-1 and without PARAM,OGEOM,NO. Data blocks: "
                    f"{', '.join(names) or 'none'}"
                )
            out = {"names": names, "grids": grids, "lama": _eigenvalues(opened, names), "ogpwg": opened.rdop2gpwg()}
            return out | opened.rdop2mats(names=matrices, lower=True) if matrices else out
    except FlexibleError:
        raise
    except Exception as error:
        text = str(error).splitlines()[0] if str(error) else ""
        raise FlexibleError(f"{file.name}: it cannot be read as op2 ({type(error).__name__}: {text})") from None


def _check_places(file: Path, grids: GridTable) -> None:
    """Refuse grid points whose places in BGPDT are not those of GEOM1, where both hold the same ones."""
    from gearmbs.flexible.nastran_grids import bulk_grids

    try:
        own = bulk_grids(file)
    except FlexibleError:
        # superelements, resequenced points: EQEXIN and BGPDT say what GEOM1 does not
        return
    if own is None or not np.array_equal(np.sort(grids.ids), own.ids):
        return
    order = np.argsort(grids.ids)
    apart = np.abs(grids.positions[order] - own.positions).max(axis=1)
    size = np.abs(own.positions).max(initial=0.0)
    if apart.max(initial=0.0) > SAME_PLACE * size:
        k = int(np.argmax(apart))
        raise FlexibleError(
            f"{file.name}: grid point {own.ids[k]} is at {own.positions[k]} in GEOM1 and at "
            f"{grids.positions[order][k]} in BGPDT; the file is damaged, or its blocks are of different models"
        )


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


def _eigenvalues(opened: Any, names: list[str]) -> np.ndarray | None:
    """Return the rows of LAMA: mode, order, eigenvalue, rad/s, Hz, generalised mass and stiffness."""
    name = next((name for name in names if name.startswith("LAMA")), None)
    if name is None:
        return None
    integer, real = word_kinds(opened)
    data = b"".join(block_records(opened, name)[1:])
    kind = np.dtype([("mode", integer, (2,)), ("value", real, (5,))])
    rows = np.frombuffer(data, kind)
    return np.column_stack([rows["mode"].astype(float), rows["value"].astype(float)])


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
