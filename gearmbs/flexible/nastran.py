"""Matrices of Nastran: OP4 files with the assembly file of their superelement, and op2 files with their grid points.

The files are read by pyyeti (``pip install gearmbs[fem]``). What is added here: records are followed to the end of the
file before anything is believed, displacement coordinate systems are turned into the basic one, and units become SI.

"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.matrix_files import FileUnits, Path_
from gearmbs.units import Quantity

# Files of Nastran as pyyeti reads them: whole records, tables of grid points, displacement coordinate systems.


ORDERS: tuple[Literal["little", "big"], ...] = ("little", "big")
FIRST_RECORDS = {"OP4": (24, 48), "op2": (4, 8)}
"""Sizes in bytes that the first record of a binary file may have, by words of 4 and 8 bytes."""
ON_AXIS = 1e-6
"""Distance from a cylinder's or sphere's axis, against that from the origin, of points on it: words of 4 bytes."""
PRINTED = bytes(range(32, 127)) + b"\t\r\n"
"""Bytes that a text file consists of."""


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
    rounded = ON_AXIS * max(np.abs(rows[0]).max(), np.abs(origin).max())
    around = float(np.arctan2(local[1], local[0])) if np.hypot(local[0], local[1]) > rounded else 0.0
    c, s = np.cos(around), np.sin(around)
    cylinder = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    if kind == 2:
        return axes @ cylinder
    down = float(np.arctan2(np.hypot(local[0], local[1]), local[2])) if np.linalg.norm(local) > rounded else 0.0
    c, s = np.cos(down), np.sin(down)
    # r, theta, phi from the cylinder's r, phi, z
    sphere = np.array([[s, c, 0.0], [0.0, 0.0, 1.0], [c, -s, 0.0]])
    return axes @ cylinder @ sphere


def block_records(opened: Any, block: str, which: int = -1) -> list[bytes]:
    """Return the records of one of the blocks of a name, by default of the last, without its head."""
    opened.set_position(opened.dbnames[block][which][0][0])
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


# Grid points from the bulk data of an op2 file: GEOM1 with its coordinate systems, scalar points from GEOM2.
#
# Where EQEXIN is missing, or does not fit the other tables, GEOM1 is enough: its records hold grid points and
# coordinate systems as they stand in the input. A record begins with three words that name its entry. Numbers with a
# point have 4 bytes, or 8 in GEOM1N and in records of the third word above a million.


GRID_BLOCKS = ("GEOM1", "BGPDT", "EQEXIN")
SAME_PLACE = 1e-4
"""Distance of a point's places in two blocks against the size of the model: words of 4 bytes, angles in degrees."""
BLOCKS = ("GEOM1S", "GEOM1", "GEOM1N")
GRID, SEQUENCE, SCALAR = (4501, 45), (5301, 53), (5551, 49)
BY_POINTS = {(2101, 21): 1, (2001, 20): 2, (2201, 22): 3}
"""CORD2R, CORD2C, CORD2S and their kinds: 1 rectangular, 2 cylindrical, 3 spherical."""
BY_GRIDS = {(1801, 18): 1, (1701, 17): 2, (1901, 19): 3}
"""CORD1R, CORD1C, CORD1S."""
BASIC = (1, np.zeros(3), np.eye(3))

System = tuple[int, np.ndarray, np.ndarray]
"""Kind, origin and axes (columns) of a coordinate system in the basic one."""


def op2_tables(file: Path, matrices: list[str], grids: GridTable | None = None) -> dict[str, Any]:
    """Return matrices, eigenvalues (``lama``), weights (``ogpwg``), grid points and names of blocks of an op2 file.

    Grid points are those given, or of EQEXIN, BGPDT and GEOM1; where one of these is missing or they do not fit each
    other, those of GEOM1 alone (:func:`bulk_grids`).

    Raises
    ------
    FlexibleError
        If the records are not whole, or there are no grid points.
    """
    op2 = pyyeti_module("op2", "op2")
    check_end(file, "op2")
    try:
        with op2.OP2(str(file)) as opened:
            names = [str(name) for name in opened.dbnames]
            lacking = [block for block in GRID_BLOCKS if not any(name.startswith(block) for name in names)]
            found = None
            if not lacking and grids is None:
                try:
                    found = opened.rdparampost(get_mats=matrices or False, get_dr_tables=False)
                    found["grids"] = GridTable.of(found["uset"])
                except (ValueError, KeyError, IndexError):
                    # EQEXINS beside BGPDTS of another superelement, tables of other lengths
                    found = None
            if found is not None:
                _check_places(file, found["grids"])
                return found | {"names": names}
            grids = bulk_grids(file) if grids is None else grids
            if grids is None:
                missing = f"{', '.join(lacking)} {'is' if len(lacking) == 1 else 'are'} missing"
                raise FlexibleError(
                    f"{file.name}: it has no grid points ({missing if lacking else 'GEOM1 is without'}; GEOM1 alone "
                    "would do); write it with PARAM,POST,-1 and without PARAM,OGEOM,NO, or give modes their bulk data. "
                    f"Data blocks: {', '.join(names) or 'none'}"
                )
            out = {"names": names, "grids": grids, "lama": _eigenvalues(opened, names), "ogpwg": opened.rdop2gpwg()}
            return out | opened.rdop2mats(names=matrices, lower=True) if matrices else out
    except FlexibleError:
        raise
    except Exception as error:
        text = str(error).splitlines()[0] if str(error) else ""
        raise FlexibleError(f"{file.name}: it cannot be read as op2 ({type(error).__name__}: {text})") from None


def bulk_grids(file: Path) -> GridTable | None:
    """Return the grid points of the last GEOM1 of an op2 file, six degrees of freedom each, or None if it has none.

    Scalar points have one. Rows are in the order of their numbers, as Nastran's without resequencing.

    Raises
    ------
    FlexibleError
        If records are none of grid points, coordinate systems lean on such that are missing, or points are resequenced.
    """
    op2 = pyyeti_module("op2", "op2")
    with op2.OP2(str(file)) as opened:
        block = next((name for name in BLOCKS if name in opened.dbnames), None)
        if block is None:
            return None
        integer, _ = word_kinds(opened)
        records = keyed_records(opened, block)
        scalar = next((r for name in ("GEOM2S", "GEOM2", "GEOM2N") if name in opened.dbnames
                       for key, r in keyed_records(opened, name) if key[:2] == SCALAR), b"")  # fmt: skip
    whole = {key[:2]: data for key, data in records}
    if GRID not in whole:
        return None
    if SEQUENCE in whole:
        raise FlexibleError(f"{file.name}: {block} resequences its points (SEQGP); write it without, or with EQEXIN")
    wide = {key[:2]: key[2] > 1_000_000 for key, _ in records}
    grids = _rows(file, whole[GRID], integer, 5, 3, wide[GRID], lambda g: (g["i"][:, 0] > 0) & (g["i"][:, 1] >= 0))
    number, place, after = grids["i"][:, 0], grids["x"].astype(float), grids["after"]
    ids, first = np.unique(number, return_index=True)
    if ids.size != number.size:
        raise FlexibleError(f"{file.name}: {block} has grid points twice; write one superelement a file")
    place, given, shown = place[first], grids["i"][first, 1], after[first, 0]
    if np.any(shown < 0):
        raise FlexibleError(
            f"{file.name}: grid point {ids[np.argmin(shown)]} is one of a fluid (CD = -1); write the structure alone"
        )
    systems = _systems(file, whole, wide, integer, (ids, place, given))
    used = np.unique(np.concatenate([given, shown]))
    lacking = [int(k) for k in used if int(k) not in systems]
    if lacking:
        raise FlexibleError(f"{file.name}: coordinate system {lacking[0]} of its grid points is not in {block}")
    points = np.array([_in_basic(systems[int(c)], x) for c, x in zip(given, place)]).reshape(-1, 3)
    axes = np.array([_axes(systems[int(c)], x) for c, x in zip(shown, points)]).reshape(-1, 3, 3)
    if not np.all(np.isfinite(points)):
        raise FlexibleError(f"{file.name}: grid point {ids[~np.isfinite(points).all(axis=1)][0]} is nowhere")
    scalars = np.frombuffer(scalar, integer)
    rows = [(int(k), d) for k in ids for d in range(1, 7)]
    dofs = [(0, 1, int(k)) for k in scalars] + [(n, d, n) for n, d in rows]
    dofs.sort(key=lambda row: (row[2], row[1]))
    return GridTable(ids.astype(int), points, axes, np.array([row[:2] for row in dofs], dtype=int))


def keyed_records(opened: Any, block: str) -> list[tuple[tuple[int, ...], bytes]]:
    """Return key and content of each record of a block's last occurrence."""
    integer, _ = word_kinds(opened)
    head = 3 * int(integer[-1])
    return [
        (tuple(int(k) for k in np.frombuffer(data[:head], integer)), data[head:])
        for data in block_records(opened, block)
    ]


def _rows(file: Path, data: bytes, integer: str, before: int, numbers: int, wide: bool, fits: Any) -> np.ndarray:
    """Return rows of whole numbers, numbers and whole numbers of a record; numbers as wide as its length allows."""
    word = int(integer[-1])
    counts = {5: (2, 3), 13: (4, 0)}[before]
    for size in dict.fromkeys((8, word) if wide else (word, 8)):
        kind = np.dtype([("i", integer, (counts[0],)), ("x", f"{integer[0]}f{size}", (numbers,)),
                         ("after", integer, (counts[1],))])  # fmt: skip
        if data and len(data) % kind.itemsize == 0:
            rows = np.frombuffer(data, kind)
            if np.all(fits(rows)) and np.all(np.isfinite(rows["x"])):
                return rows
    raise FlexibleError(f"{file.name}: a record of {len(data)} bytes holds no grid points or coordinate systems")


def _systems(
    file: Path,
    whole: dict[tuple[int, ...], bytes],
    wide: dict[tuple[int, ...], bool],
    integer: str,
    grids: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> dict[int, System]:
    """Return the coordinate systems by number; each waits for the one that it is given in."""
    ids, place, given = grids
    waiting: list[tuple[int, int, list[int], np.ndarray]] = []
    for key, kind in BY_POINTS.items():
        if whole.get(key):
            rows = _rows(
                file, whole[key], integer, 13, 9, wide[key],
                lambda g, kind=kind: (g["i"][:, 1] == kind) & (g["i"][:, 2] == 2),
            )  # fmt: skip
            waiting += [(int(i[0]), kind, [int(i[3])] * 3, x.astype(float).reshape(3, 3)) for i, x in
                        zip(rows["i"], rows["x"])]  # fmt: skip
    row = {int(k): i for i, k in enumerate(ids)}
    for key, kind in BY_GRIDS.items():
        for number, _, _, *three in np.frombuffer(whole.get(key, b""), integer).reshape(-1, 6):
            if any(int(k) not in row for k in three):
                raise FlexibleError(f"{file.name}: coordinate system {number} leans on a grid point that is not there")
            at = [row[int(k)] for k in three]
            waiting.append((int(number), kind, [int(given[k]) for k in at], place[at]))
    out: dict[int, System] = {0: BASIC}
    while waiting:
        ready = [one for one in waiting if all(k in out for k in one[2])]
        if not ready:
            raise FlexibleError(
                f"{file.name}: coordinate system {waiting[0][0]} leans on {waiting[0][2][0]}, which is not there"
            )
        for number, kind, within, points in ready:
            origin, up, side = (_in_basic(out[k], x) for k, x in zip(within, points))
            # z through the second point, x in the half plane of the third
            z = (up - origin) / np.linalg.norm(up - origin)
            y = np.cross(z, side - origin)
            y /= np.linalg.norm(y)
            out[number] = (kind, origin, np.column_stack([np.cross(y, z), y, z]))
        waiting = [one for one in waiting if one[0] not in out]
    return out


def _in_basic(system: System, x: np.ndarray) -> np.ndarray:
    """Return a place given by coordinates of a system (angles in degrees) in the basic one."""
    kind, origin, axes = system
    if kind == 2:
        turn = np.deg2rad(x[1])
        x = np.array([x[0] * np.cos(turn), x[0] * np.sin(turn), x[2]])
    elif kind == 3:
        down, turn = np.deg2rad(x[1]), np.deg2rad(x[2])
        x = x[0] * np.array([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)])
    return origin + axes @ x


def _axes(system: System, place: np.ndarray) -> np.ndarray:
    """Return the axes of displacements in a system at a place, as columns."""
    kind, origin, axes = system
    return axes_at(np.vstack([place, [0.0, kind, 0.0], origin, axes]))


def _check_places(file: Path, grids: GridTable) -> None:
    """Refuse grid points whose places in BGPDT are not those of GEOM1, where both hold the same ones."""
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


def read_op4(
    path: Path_,
    positions: npt.ArrayLike | None = None,
    dofs: Sequence[tuple[int, int]] | np.ndarray | int | None = None,
    *,
    assembly: Path_ | None = None,
    ids: npt.ArrayLike | None = None,
    stiffness: str = "kxx",
    mass: str = "mxx",
    name: str | None = None,
    length: Quantity = 1.0,
    force: Quantity = 1.0,
    mass_unit: Quantity = 1.0,
) -> FiniteElementModel:
    """Return a model from matrices in a Nastran OP4 file, read by pyyeti (``pip install gearmbs[fem]``).

    Parameters
    ----------
    path : str or Path
        Text or binary, of either byte order.
    positions, ids : array_like, optional
        Positions (in the file's unit of length) and numbers of the nodes.
    dofs : array_like or int, optional
        As of :func:`from_matrices`: node and direction of each row, in the order of the superelement; node 0 for its
        modal coordinates.
    assembly : str or Path, optional
        In place of these: the ``.asm`` file that Nastran writes beside the matrices of an external superelement
        (EXTSEOUT), with boundary points, modal points and coordinate systems.
    stiffness, mass : str
        Names of the matrices.
    length, force, mass_unit : float or str
        The file's units: SI values, or names as ``"mm"``.

    Raises
    ------
    FlexibleError
        If pyyeti is not installed, a file cannot be read or is cut off, or has no such matrices.
    """
    op4 = pyyeti_module("op4", "OP4")
    file = Path(path)
    check_end(file, "OP4")
    try:
        found = op4.read(str(file), into="dct")
    except Exception as error:
        raise FlexibleError(f"{file.name}: it cannot be read as OP4 ({type(error).__name__}: {error})") from None
    matrices = [_named(found, wanted, file) for wanted in (stiffness, mass)]
    units = FileUnits.of(length, force, mass_unit)
    if assembly is not None:
        table = assembly_table(Path(assembly))
        return _model_of(table, matrices, name or file.stem, file, units)
    if positions is None or dofs is None:
        raise FlexibleError(f"{file.name}: an OP4 file holds no grid points; give positions and dofs, or assembly")
    return units.model(matrices[0], matrices[1], positions, dofs, ids, name or file.stem)


def read_op2(
    path: Path_,
    *,
    stiffness: str = "kgg",
    mass: str = "mgg",
    dofs: Sequence[tuple[int, int]] | np.ndarray | None = None,
    name: str | None = None,
    length: Quantity = 1.0,
    force: Quantity = 1.0,
    mass_unit: Quantity = 1.0,
) -> FiniteElementModel:
    """Return a model from matrices in a Nastran op2 file with its grid points (``PARAM,POST,-1`` and OUTPUT2).

    Parameters
    ----------
    path : str or Path
        Of either byte order, with words of 4 or 8 bytes.
    stiffness, mass : str
        Names of the data blocks.
    dofs : array_like of int, shape (d, 2), optional
        Grid point and direction of each row, point 0 for modal coordinates; default: the g-set, six a grid point and
        one a scalar point, in the order of their numbers.
    name : str, optional
    length, force, mass_unit : float or str
        The file's units: SI values, or names as ``"mm"``.

    Raises
    ------
    FlexibleError
        If pyyeti is not installed, the file is cut off, or it has no grid points or no such matrices.
    """
    file = Path(path)
    found = op2_tables(file, [stiffness.upper(), mass.upper()])
    table = found["grids"]
    matrices = [_named(found, wanted, file) for wanted in (stiffness, mass)]
    if dofs is not None:
        table = GridTable(table.ids, table.positions, table.axes, np.asarray(dofs, dtype=int))
    return _model_of(table, matrices, name or file.stem, file, FileUnits.of(length, force, mass_unit))


def _model_of(table: GridTable, matrices: list[Any], name: str, file: Path, units: FileUnits) -> FiniteElementModel:
    """Return the model of matrices of a table's degrees of freedom."""
    for matrix, what in zip(matrices, ("stiffness", "mass")):
        if matrix.shape != (len(table.dofs),) * 2:
            raise FlexibleError(
                f"{file.name}: the {what} has {matrix.shape[0]} rows and {matrix.shape[1]} columns, the grid points "
                f"have {len(table.dofs)} degrees of freedom; name the matrices of all of them, or give dofs"
            )
    k, m = (table.in_basic(matrix) for matrix in matrices)
    # the g-set has six degrees of freedom a point; solid elements leave those of rotation empty
    there = (abs(k).sum(axis=0) + abs(m).sum(axis=0) > 0.0) | (table.dofs[:, 1] <= 3)
    k, m = (matrix[there][:, there] for matrix in (k, m))
    return units.model(k, m, table.positions, table.dofs[there], table.ids, name)


def _named(found: dict[str, Any], wanted: str, file: Path) -> Any:
    """Return a matrix by its name in lower case."""
    matrix = found.get(wanted.lower())
    if matrix is None:
        known = ", ".join(key for key, value in found.items() if np.ndim(value) == 2 or sp.issparse(value)) or "none"
        raise FlexibleError(f"{file.name}: it has no matrix '{wanted.lower()}'; matrices: {known}")
    return matrix
