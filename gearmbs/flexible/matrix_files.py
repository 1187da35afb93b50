"""Stiffness and mass matrices of other programs: Abaqus, CalculiX, Ansys, and what is in memory already."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.material import FlexibleError
from gearmbs.system import survives
from gearmbs.units import Quantity, to_si

# Matrices and nodes in text files: tables of numbers, read whole or not at all.


Path_ = str | Path
MOVING = ("SYSTEM", "INSTANCE")
"""Keywords of Abaqus with a line that shifts or turns the nodes of others."""
GIVE = "give a table of number, x, y, z in the axes of the matrices"


def read_nodes(path: Path_) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers and positions of the nodes of an Abaqus or CalculiX input file (``*NODE``), or of a plain table.

    Raises
    ------
    FlexibleError
        For rows that are no nodes, and nodes in coordinates of their own, with their line.
    """
    numbers: list[int] = []
    rows: list[list[float]] = []
    inside, moving, keyword = True, False, ""
    lines = text_lines(Path(path))
    last = 0
    for count, line in enumerate(lines, 1):
        text = line.strip()
        if not text or text.startswith(("**", "#", "$")):
            continue
        if text.startswith("*"):
            keyword, *options = (part.strip().upper().replace(" ", "") for part in text[1:].split(","))
            inside, moving = keyword == "NODE", keyword in MOVING
            skew = next((o for o in options if inside and o in ("SYSTEM=C", "SYSTEM=S")), "")
            if skew:
                raise FlexibleError(f"{Path(path).name}: line {count}: {skew}: its nodes are not rectangular; {GIVE}")
            continue
        if moving:
            raise FlexibleError(f"{Path(path).name}: line {count}: *{keyword} moves the nodes; {GIVE}")
        if not inside:
            continue
        parts = text.replace(",", " ").split()
        try:
            numbers.append(int(float(parts[0])))
            rows.append([float(x) for x in parts[1:4]] if len(parts) > 3 else [])
        except ValueError:
            raise FlexibleError(f"{Path(path).name}: line {count}: {text!r} is no node; number, x, y, z") from None
        if len(rows[-1]) != 3:
            raise FlexibleError(f"{Path(path).name}: line {count}: {text!r} is no node; number, x, y, z")
        last = count
    check_last_line(Path(path), lines, last)
    if not numbers:
        raise FlexibleError(f"{Path(path).name}: it has no nodes (*NODE)")
    return np.array(numbers), np.array(rows)


def read_triplets(path: Path_, size: int | None = None) -> tuple[np.ndarray | None, sp.csc_array]:
    """Return degrees of freedom, where the rows name them, and the matrix, mirrored where it is one triangle."""
    file = Path(path)
    lines = text_lines(file)
    kept = [
        (n, line.replace("D", "E").replace(",", " ").split())
        for n, line in enumerate(lines, 1)
        if line.strip() and line[0] not in "*%#"
    ]
    if not kept:
        raise FlexibleError(f"{file.name}: it has no entries")
    check_last_line(file, lines, kept[-1][0])
    width = len(kept[0][1])
    if width not in (3, 5):
        raise FlexibleError(
            f"{file.name}: line {kept[0][0]}: {width} columns; 3 (row, column, value) or 5 are understood"
        )
    for number, parts in kept:
        if len(parts) != width:
            raise FlexibleError(
                f"{file.name}: line {number}: {len(parts)} columns instead of {width}; the file is cut off"
            )
    try:
        table = np.array([parts for _, parts in kept], dtype=float)
    except ValueError:
        number = next(n for n, parts in kept if not all(_is_number(x) for x in parts))
        raise FlexibleError(f"{file.name}: line {number}: an entry is no number") from None
    if not np.all(np.isfinite(table)):
        raise FlexibleError(f"{file.name}: line {kept[int(np.argmin(np.isfinite(table).all(axis=1)))][0]}: not finite")
    dofs = None
    if width == 5:
        both = np.vstack([table[:, :2], table[:, 2:4]]).astype(int)
        dofs, place = np.unique(both, axis=0, return_inverse=True)
        i, j = place.reshape(2, -1)
        n = len(dofs)
    else:
        i, j = table[:, 0].astype(int) - 1, table[:, 1].astype(int) - 1
        n = max(i.max(), j.max()) + 1
        if i.min() < 0 or j.min() < 0:
            raise FlexibleError(f"{file.name}: rows and columns count from 1")
        if size is not None and n > size:
            raise FlexibleError(f"{file.name}: row {n} of {size}; matrix and list of degrees of freedom do not fit")
        n = size or n
    matrix = sp.csc_array((table[:, -1], (i, j)), shape=(n, n))
    # a program's triangle is that of its own order of the nodes, so that their numbers may lie on either side
    apart = i != j
    if not np.intersect1d(i[apart] * n + j[apart], j[apart] * n + i[apart]).size:
        matrix = sp.csc_array(matrix + matrix.T - sp.diags_array(matrix.diagonal()))
    return dofs, matrix


def text_lines(file: Path) -> list[str]:
    """Return the lines of a text, with their ends; comments may be in any encoding."""
    if not file.is_file():
        raise FlexibleError(f"{file.name}: there is no such file")
    return file.read_text(encoding="latin-1").splitlines(keepends=True)


def check_last_line(file: Path, lines: list[str], last: int) -> None:
    """Refuse a last row of numbers that has no end: a number cut off looks whole."""
    if last and not lines[last - 1].endswith(("\n", "\r")):
        raise FlexibleError(
            f"{file.name}: line {last}: the file ends within it, and may be cut off; write it anew, or end the line"
        )


def check_whole(file: Path, matrix: sp.csc_array, dofs: Any, lacking: str) -> None:
    """Refuse a matrix that lacks the last displacement: a file cut off at the end of a line looks whole."""
    rows = np.arange(matrix.shape[0])
    table = np.asarray(dofs) if np.ndim(dofs) else np.column_stack([rows // int(dofs) + 1, rows % int(dofs) + 1])
    moving = np.flatnonzero(table[:, 1] <= 3)
    empty = moving[matrix.diagonal()[moving] == 0.0]
    if empty.size and empty[-1] == moving[-1]:
        what = f"node {table[empty[0], 0]}" if np.ndim(dofs) else f"row {empty[0] + 1}"
        raise FlexibleError(
            f"{file.name}: {empty.size} displacements, from {what} on, have {lacking}: the file is cut off; write it "
            "anew, and nodes that carry nothing before the others"
        )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def from_matrices(
    stiffness: Any,
    mass: Any,
    positions: npt.ArrayLike,
    *,
    ids: npt.ArrayLike | None = None,
    dofs: int | npt.ArrayLike = 3,
    name: str = "body",
    seats: dict[str, int] | None = None,
    faces: npt.ArrayLike | None = None,
) -> FiniteElementModel:
    """Return the model of matrices made by any program.

    Parameters
    ----------
    stiffness, mass : sparse or dense matrix, shape (d, d)
        SI.
    positions : array_like, shape (N, 3)
        Of the nodes, m.
    ids : array_like of int, optional
        Numbers of the nodes; default: from 1 on.
    dofs : int or array_like of int, shape (d, 2)
        3 or 6 for each node, node by node; or number of the node and direction 1 to 6 of each row. Rows of node 0 are
        generalised coordinates of a superelement.
    name : str
    seats : dict of str to int, optional
        Numbers of nodes with a name.
    faces : array_like of int, optional
        Rows of the corners of surface facets.

    Raises
    ------
    FlexibleError
        If sizes do not fit, a node is unknown, or a matrix is not symmetric.
    """
    place = np.atleast_2d(np.asarray(positions, dtype=float))
    numbers = np.arange(1, len(place) + 1) if ids is None else np.asarray(ids, dtype=int)
    if len(numbers) != len(place) or np.unique(numbers).size != len(numbers):
        raise FlexibleError(f"{name}: {len(numbers)} numbers of nodes for {len(place)} nodes, or one is there twice")
    if not np.all(np.isfinite(place)):
        raise FlexibleError(f"{name}: node {numbers[~np.isfinite(place).all(axis=1)][0]} has no finite position")
    k, m = sp.csc_array(stiffness), sp.csc_array(mass)
    if np.ndim(dofs) == 0:
        each = int(dofs)  # type: ignore[call-overload, arg-type]
        if each not in (3, 6) or each * len(place) != k.shape[0]:
            raise FlexibleError(
                f"{name}: the stiffness has {k.shape[0]} rows, {len(place)} nodes of {each} degrees of freedom make "
                f"{each * len(place)}; the node table belongs to another model, or give dofs row by row"
            )
        table = np.column_stack([np.repeat(np.arange(len(place)), each), np.tile(np.arange(each), len(place))])
    else:
        given = np.asarray(dofs, dtype=int)
        rows = {int(number): row for row, number in enumerate(numbers)}
        unknown = [int(n) for n in given[:, 0] if n != 0 and int(n) not in rows]
        if unknown:
            raise FlexibleError(f"{name}: the matrices name node {unknown[0]}, which is not in the node table")
        placed = given[given[:, 0] != 0]
        rows_of, times = np.unique(placed, axis=0, return_counts=True)
        if np.any(times > 1):
            number, direction = rows_of[np.argmax(times > 1)]
            raise FlexibleError(f"{name}: direction {direction} of node {number} is there twice among the rows")
        if np.any((given[:, 1] < 1) | (given[:, 1] > 6)):
            raise FlexibleError(f"{name}: directions go from 1 to 6, not to {given[:, 1].max()}")
        table = np.column_stack([[rows.get(int(n), -1) for n in given[:, 0]], given[:, 1] - 1])
    found = FiniteElementModel(numbers, place, table, k, m, name, faces=None if faces is None else np.asarray(faces))
    for seat, node in (seats or {}).items():
        found.seats[seat] = found.row_of(node)
    return found


def read_abaqus(
    stiffness: Path_,
    mass: Path_,
    nodes: Path_,
    *,
    name: str | None = None,
    length: Quantity = 1.0,
    force: Quantity = 1.0,
    mass_unit: Quantity = 1.0,
) -> FiniteElementModel:
    """Return a model from the matrices that Abaqus writes (``*MATRIX OUTPUT``, formats COORDINATE and MATRIX INPUT).

    Parameters
    ----------
    stiffness, mass : str or Path
        ``..._STIF1.mtx`` and ``..._MASS1.mtx``: rows of i, j, value, or of node, direction, node, direction, value. One
        triangle or both.
    nodes : str or Path
        Input file with the nodes.
    name : str, optional
    length, force, mass_unit : float or str
        Units of length, force and mass, SI values or names: 1e-3, 1.0, 1e3 or ``"mm"``, ``"N"``, ``"t"``.

    Raises
    ------
    FlexibleError
        For rows that cannot be, a file cut off, matrices that do not fit each other or the nodes; with file and line.
    """
    label = name or Path(stiffness).name
    k_dofs, k = read_triplets(stiffness)
    m_dofs, m = read_triplets(mass)
    ids, positions = read_nodes(nodes)
    if (k_dofs is None) != (m_dofs is None):
        raise FlexibleError(f"{label}: one matrix is in COORDINATE format, the other in MATRIX INPUT; write both alike")
    if k_dofs is None or m_dofs is None:
        size = max(k.shape[0], m.shape[0])
        if k.shape != m.shape:
            raise FlexibleError(f"{label}: stiffness has {k.shape[0]} rows, mass {m.shape[0]}; one file is cut off")
        dofs: Any = 6 if size == 6 * len(ids) else 3
    else:
        known = {tuple(row) for row in k_dofs.tolist()}
        alone = next((row for row in m_dofs.tolist() if tuple(row) not in known), None)
        if alone is not None:
            raise FlexibleError(
                f"{Path(stiffness).name}: it lacks direction {alone[1]} of node {alone[0]}, which has mass; the file "
                "is cut off, or belongs to another model"
            )
        dofs, k, m = _common(k_dofs, k, m_dofs, m)
    check_whole(Path(stiffness), k, dofs, "mass and no stiffness")
    check_whole(Path(mass), m, dofs, "stiffness and no mass")
    return FileUnits.of(length, force, mass_unit).model(k, m, positions, dofs, ids, label)


def read_calculix(
    path: Path_,
    nodes: Path_,
    *,
    name: str | None = None,
    length: Quantity = 1.0,
    force: Quantity = 1.0,
    mass_unit: Quantity = 1.0,
) -> FiniteElementModel:
    """Return a model from the files that CalculiX writes with ``SOLVER=MATRIXSTORAGE``.

    Parameters
    ----------
    path : str or Path
        Any of the three files, or their name without an ending: ``.sti``, ``.mas`` (one triangle, row, column, value)
        and ``.dof`` (node.direction).
    nodes : str or Path
        Input file with the nodes.
    name : str, optional
    length, force, mass_unit : float or str
        The file's units: SI values, or names as ``"mm"``.

    Raises
    ------
    FlexibleError
        For missing files, rows that cannot be, and sizes that do not fit; with file and line.
    """
    base = Path(path)
    base = base.with_suffix("") if base.suffix in (".sti", ".mas", ".dof") else base
    files = [base.with_name(base.name + end) for end in (".sti", ".mas", ".dof")]
    for file in files:
        if not file.exists():
            raise FlexibleError(
                f"{file.name}: there is no such file beside the others; CalculiX writes .sti, .mas, .dof"
            )
    rows = []
    lines = text_lines(files[2])
    check_last_line(files[2], lines, len(lines))
    for count, token in ((n, token) for n, line in enumerate(lines, 1) for token in line.split()):
        node, dot, direction = token.partition(".")
        if not (dot and node.isdecimal() and direction.isdecimal() and 1 <= int(direction) <= 6):
            raise FlexibleError(f"{files[2].name}: line {count}: {token!r} is no node.direction")
        rows.append((int(node), int(direction)))
    ids, positions = read_nodes(nodes)
    stiffness, mass = (read_triplets(file, len(rows))[1] for file in files[:2])
    check_whole(files[0], stiffness, np.array(rows), "mass and no stiffness")
    check_whole(files[1], mass, np.array(rows), "stiffness and no mass")
    units = FileUnits.of(length, force, mass_unit)
    return units.model(stiffness, mass, positions, np.array(rows), ids, name or base.name)


class FileUnits(NamedTuple):
    """SI values of the units of length, force and mass that a file is written in: 1e-3, 1.0, 1e3 for mm, N, t."""

    length: float = 1.0
    force: float = 1.0
    mass: float = 1.0

    @classmethod
    def of(cls, length: Quantity = 1.0, force: Quantity = 1.0, mass: Quantity = 1.0) -> FileUnits:
        """Return the units that were given: SI values, or texts as ``"mm"`` and ``"0.1 mm"``.

        Raises
        ------
        FlexibleError
            If one is not positive and finite, or of another dimension.
        """
        found = []
        given = (("length", "length", length), ("force", "force", force), ("mass_unit", "mass", mass))
        for field, dimension, value in given:
            bare = isinstance(value, str) and value.strip()[:1].isalpha()
            try:
                number = float(to_si(f"1 {value.strip()}" if bare else value, dimension, field))
            except (TypeError, ValueError) as error:
                raise FlexibleError(str(error)) from None
            if not 0.0 < number < np.inf:
                raise FlexibleError(f"{field} = {value!r}; give the file's unit, above zero: 1e-3, or by name as 'mm'")
            found.append(number)
        return cls(*found)

    def model(
        self, stiffness: Any, mass: Any, positions: npt.ArrayLike, dofs: Any, ids: npt.ArrayLike | None, name: str
    ) -> FiniteElementModel:
        """Return the model of matrices in these units, arguments as of :func:`from_matrices`."""
        k, m = sp.csc_array(stiffness), sp.csc_array(mass)
        scale = np.ones(k.shape[0])
        if np.ndim(dofs) == 0:
            scale[np.arange(k.shape[0]) % int(dofs) > 2] = self.length
        else:
            # rows of node 0, generalised coordinates, have no unit
            table = np.asarray(dofs, dtype=int)[: k.shape[0]]
            scale[: len(table)][(table[:, 1] > 3) & (table[:, 0] != 0)] = self.length
        turn = sp.diags_array(scale)
        k, m = turn @ k @ turn * (self.force / self.length), turn @ m @ turn * self.mass
        place = np.asarray(positions, dtype=float) * self.length
        return from_matrices(k, m, place, ids=ids, dofs=dofs, name=name)


def _common(k_dofs, k, m_dofs, m):
    """Return the degrees of freedom of both matrices together, and the matrices by them."""
    dofs = np.unique(np.vstack([k_dofs, m_dofs]), axis=0)
    out = []
    for own, matrix in ((k_dofs, k), (m_dofs, m)):
        place = np.array([int(np.flatnonzero((dofs == row).all(axis=1))[0]) for row in own])
        coo = matrix.tocoo()
        out.append(sp.csc_array((coo.data, (place[coo.row], place[coo.col])), shape=(len(dofs), len(dofs))))
    return dofs, *out


LEAST = 4 * 512
"""Bytes of the headers of a binary file."""
SMALL = 1e-9
"""Mass and stiffness of a held degree of freedom against the largest: its row is empty."""


def read_ansys(
    full: Path_,
    nodes: Path_ | tuple[npt.ArrayLike, npt.ArrayLike],
    *,
    name: str | None = None,
    length: Quantity = 1.0,
    force: Quantity = 1.0,
    mass_unit: Quantity = 1.0,
) -> FiniteElementModel:
    """Return a model from the assembled matrices of Ansys, read by ansys-mapdl-reader (``pip install gearmbs[ansys]``).

    Parameters
    ----------
    full : str or Path
        ``file.full`` of a modal analysis without supports, with stiffness and mass (``WRFULL,1`` is enough). The mass
        is taken as it is: consistent, or lumped after ``LUMPM,ON``. Coarse meshes differ by several percent in it.
    nodes : str or Path, or (ids, positions)
        Result file (``.rst``) or archive (``.cdb``) of the same mesh, a table of number, x, y, z, or both arrays.
    name : str, optional
    length, force, mass_unit : float or str
        The file's units: SI values, or names as ``"mm"``, ``"N"``, ``"t"``.

    Raises
    ------
    FlexibleError
        If the reader is not installed, a file cannot be read, supports were applied, or nodes and matrices do not fit.
    """
    reader = _reader()
    file = Path(full)
    found = _opened(reader, file, ("load_km",), "file with matrices (.full)")
    _check_end(found, file)
    dofs, k, m = _guarded(file, "its matrices cannot be read", lambda: found.load_km(sort=True))
    if k is None or m is None:
        raise FlexibleError(
            f"{file.name}: it has no {'stiffness' if k is None else 'mass'}; write it in a modal analysis"
        )
    _check_terms(found, file, k, m)
    if dofs[:, 1].max() > 5:
        raise FlexibleError(
            f"{file.name}: degree of freedom {dofs[:, 1].max()} of node {dofs[np.argmax(dofs[:, 1]), 0]} is neither "
            "displacement nor rotation; export a structural analysis"
        )
    k, m = _mirrored(k), _mirrored(m)
    held = np.abs(k.diagonal()) <= SMALL * np.abs(k.diagonal()).max()
    if held.any():
        numbers = np.unique(dofs[held, 0])
        raise FlexibleError(
            f"{file.name}: {int(held.sum())} degrees of freedom of {len(numbers)} nodes ({numbers[0]} and so on) are "
            "held; write the file without supports (DDELE,ALL,ALL)"
        )
    ids, positions = _nodes(reader, nodes)
    rows = np.column_stack([dofs[:, 0], dofs[:, 1] + 1])
    if len(ids) != len(positions):
        raise FlexibleError(f"{file.name}: {len(ids)} numbers of nodes for {len(positions)} positions")
    used = np.isin(ids, dofs[:, 0])
    units = FileUnits.of(length, force, mass_unit)
    return units.model(k, m, positions[used], rows, ids[used], name or file.stem)


def _check_end(found: Any, file: Path) -> None:
    """Refuse a file that is shorter than its header says: the reader would end the process on it."""
    words = int(getattr(found, "_header", {}).get("ptrEND", 0))
    size = file.stat().st_size
    if 4 * words > size:
        raise FlexibleError(f"{file.name}: byte {size}: it is cut off; its header says that it has {4 * words} bytes")


def _check_terms(found: Any, file: Path, k: Any, m: Any) -> None:
    """Refuse matrices with another number of terms than the header says; those of held rows are left out of them."""
    header = getattr(found, "_header", {})
    for matrix, name, what in ((k, "ntermKl", "stiffness"), (m, "ntermMl", "mass")):
        told = int(header.get(name, matrix.nnz))
        if matrix.nnz > told or (matrix.nnz < told and np.all(matrix.diagonal())):
            raise FlexibleError(
                f"{file.name}: its header says that the {what} has {told} terms, it has {matrix.nnz}; write it anew"
            )


def _mirrored(matrix: Any) -> sp.csc_array:
    """Return a matrix of which the upper triangle is there."""
    upper = sp.triu(sp.csc_array(matrix))
    return sp.csc_array(upper + sp.triu(upper, 1).T)


def _nodes(reader: Any, given: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers and positions of nodes."""
    if isinstance(given, tuple):
        return np.asarray(given[0], dtype=int), np.atleast_2d(np.asarray(given[1], dtype=float))
    path = Path(given)
    if path.suffix.lower() in (".rst", ".rth"):
        mesh = _opened(reader, path, ("mesh",), "result file (.rst)").mesh
        return np.asarray(mesh.nnum, dtype=int), np.asarray(mesh.nodes, dtype=float)[:, :3]
    if path.suffix.lower() in (".cdb", ".dat"):
        archive = _guarded(path, "it is no archive", lambda: reader.Archive(str(path), parse_vtk=False))
        return np.asarray(archive.nnum, dtype=int), np.asarray(archive.nodes, dtype=float)[:, :3]
    return read_nodes(path)


def _opened(reader: Any, path: Path, needed: tuple[str, ...], what: str) -> Any:
    """Return a binary file of Ansys."""
    if not path.is_file():
        raise FlexibleError(f"{path.name}: there is no such file")
    if path.stat().st_size < LEAST:
        raise FlexibleError(f"{path.name}: {path.stat().st_size} bytes are no {what} of Ansys")
    found = _guarded(path, f"it is no {what} of Ansys", lambda: reader.read_binary(str(path)))
    if not all(hasattr(found, part) for part in needed):
        raise FlexibleError(f"{path.name}: it is a {type(found).__name__}, no {what}")
    return found


def _guarded(path: Path, wrong: str, load: Callable[[], Any]) -> Any:
    """Return what is read, first in a process of its own where there is one: the reader ends it on broken indices."""
    # what else is wrong is told by this process
    if not survives(load):
        raise FlexibleError(f"{path.name}: {wrong}: its indices lead out of it; write it anew")
    try:
        return load()
    except Exception as error:
        raise FlexibleError(f"{path.name}: {wrong} ({type(error).__name__}: {error})") from None


def _reader() -> Any:
    try:
        from ansys.mapdl import reader
    except ImportError:
        raise FlexibleError(
            "files of Ansys are read by ansys-mapdl-reader; install it with 'pip install gearmbs[ansys]'"
        ) from None
    return reader
