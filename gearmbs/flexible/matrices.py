"""Stiffness and mass matrices of other programs: Abaqus, CalculiX, and what is in memory already."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.fe_model import FiniteElementModel

Path_ = str | Path


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
        if np.any((given[:, 1] < 1) | (given[:, 1] > 6)):
            raise FlexibleError(f"{name}: directions go from 1 to 6, not to {given[:, 1].max()}")
        table = np.column_stack([[rows.get(int(n), -1) for n in given[:, 0]], given[:, 1] - 1])
    found = FiniteElementModel(numbers, place, table, k, m, name, faces=None if faces is None else np.asarray(faces))
    for seat, node in (seats or {}).items():
        found.seats[seat] = found.row_of(node)
    return found


def read_nodes(path: Path_) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers and positions of the nodes of an Abaqus or CalculiX input file (``*NODE``), or of a plain table.

    Raises
    ------
    FlexibleError
        For rows that are no nodes, with their line.
    """
    numbers: list[int] = []
    rows: list[list[float]] = []
    inside = True
    for count, line in enumerate(Path(path).read_text().splitlines(), 1):
        text = line.strip()
        if not text or text.startswith(("**", "#", "$")):
            continue
        if text.startswith("*"):
            inside = text[1:].split(",")[0].strip().upper() == "NODE"
            continue
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
    if not numbers:
        raise FlexibleError(f"{Path(path).name}: it has no nodes (*NODE)")
    return np.array(numbers), np.array(rows)


def read_abaqus(
    stiffness: Path_,
    mass: Path_,
    nodes: Path_,
    *,
    name: str | None = None,
    length: float = 1.0,
    force: float = 1.0,
    mass_unit: float = 1.0,
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
    length, force, mass_unit : float
        SI values of the units of length, force and mass: 1e-3, 1.0, 1e3 for mm, N, t.

    Raises
    ------
    FlexibleError
        For rows that cannot be, a file cut off, matrices that do not fit each other or the nodes; with file and line.
    """
    label = name or Path(stiffness).name
    k_dofs, k = _read_triplets(stiffness)
    m_dofs, m = _read_triplets(mass)
    ids, positions = read_nodes(nodes)
    if (k_dofs is None) != (m_dofs is None):
        raise FlexibleError(f"{label}: one matrix is in COORDINATE format, the other in MATRIX INPUT; write both alike")
    if k_dofs is None or m_dofs is None:
        size = max(k.shape[0], m.shape[0])
        if k.shape != m.shape:
            raise FlexibleError(f"{label}: stiffness has {k.shape[0]} rows, mass {m.shape[0]}; one file is cut off")
        dofs: Any = 6 if size == 6 * len(ids) else 3
    else:
        dofs, k, m = _common(k_dofs, k, m_dofs, m)
    _check_mass(Path(mass), m, dofs)
    k, m = scaled(k, m, dofs, length, force, mass_unit)
    return from_matrices(k, m, positions * length, ids=ids, dofs=dofs, name=label)


def read_calculix(path: Path_, nodes: Path_, *, name: str | None = None) -> FiniteElementModel:
    """Return a model from the files that CalculiX writes with ``SOLVER=MATRIXSTORAGE``.

    Parameters
    ----------
    path : str or Path
        Any of the three files, or their name without an ending: ``.sti``, ``.mas`` (one triangle, row, column, value)
        and ``.dof`` (node.direction).
    nodes : str or Path
        Input file with the nodes.

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
    for count, line in enumerate(files[2].read_text().split(), 1):
        node, dot, direction = line.partition(".")
        if not (dot and node.isdigit() and direction.isdigit() and 1 <= int(direction) <= 6):
            raise FlexibleError(f"{files[2].name}: line {count}: {line!r} is no node.direction")
        rows.append((int(node), int(direction)))
    ids, positions = read_nodes(nodes)
    stiffness, mass = (_read_triplets(file, len(rows))[1] for file in files[:2])
    _check_mass(files[1], mass, np.array(rows))
    return from_matrices(stiffness, mass, positions, ids=ids, dofs=np.array(rows), name=name or base.name)


def scaled(
    stiffness: Any, mass: Any, dofs: Any, length: float, force: float, mass_unit: float
) -> tuple[sp.csc_array, sp.csc_array]:
    """Return matrices in SI.

    Parameters
    ----------
    stiffness, mass : sparse or dense matrix, shape (d, d)
    dofs : int or array_like of int, shape (d, 2)
        As of :func:`from_matrices`. Rows of node 0 have no unit.
    length, force, mass_unit : float
        SI values of the matrices' units.
    """
    k, m = sp.csc_array(stiffness), sp.csc_array(mass)
    scale = np.ones(k.shape[0])
    if np.ndim(dofs) == 0:
        scale[np.arange(k.shape[0]) % int(dofs) > 2] = length
    else:
        table = np.asarray(dofs, dtype=int)[: k.shape[0]]
        scale[: len(table)][(table[:, 1] > 3) & (table[:, 0] != 0)] = length
    turn = sp.diags_array(scale)
    return sp.csc_array(turn @ k @ turn * (force / length)), sp.csc_array(turn @ m @ turn * mass_unit)


def _read_triplets(path: Path_, size: int | None = None) -> tuple[np.ndarray | None, sp.csc_array]:
    """Return degrees of freedom, where the rows name them, and the matrix, mirrored where it is one triangle."""
    file = Path(path)
    lines = file.read_text().replace("D", "E").splitlines()
    kept = [
        (n, line.replace(",", " ").split()) for n, line in enumerate(lines, 1) if line.strip() and line[0] not in "*%#"
    ]
    if not kept:
        raise FlexibleError(f"{file.name}: it has no entries")
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
    if not (np.any(i < j) and np.any(i > j)):
        matrix = sp.csc_array(matrix + matrix.T - sp.diags_array(matrix.diagonal()))
    return dofs, matrix


def _check_mass(file: Path, mass: sp.csc_array, dofs: Any) -> None:
    """Refuse a mass matrix that lacks the last displacement: a file cut off at the end of a line looks whole."""
    rows = np.arange(mass.shape[0])
    table = np.asarray(dofs) if np.ndim(dofs) else np.column_stack([rows // int(dofs) + 1, rows % int(dofs) + 1])
    moving = np.flatnonzero(table[:, 1] <= 3)
    massless = moving[mass.diagonal()[moving] == 0.0]
    if massless.size and massless[-1] == moving[-1]:
        what = f"node {table[massless[0], 0]}" if np.ndim(dofs) else f"row {massless[0] + 1}"
        raise FlexibleError(
            f"{file.name}: {massless.size} displacements, from {what} on, have stiffness and no mass: the file is cut "
            "off; write it anew, and nodes that carry nothing before the others"
        )


def _common(k_dofs, k, m_dofs, m):
    """Return the degrees of freedom of both matrices together, and the matrices by them."""
    dofs = np.unique(np.vstack([k_dofs, m_dofs]), axis=0)
    out = []
    for own, matrix in ((k_dofs, k), (m_dofs, m)):
        place = np.array([int(np.flatnonzero((dofs == row).all(axis=1))[0]) for row in own])
        coo = matrix.tocoo()
        out.append(sp.csc_array((coo.data, (place[coo.row], place[coo.col])), shape=(len(dofs), len(dofs))))
    return dofs, *out


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
