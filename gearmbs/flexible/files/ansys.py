"""Matrices of Ansys: .full files with the nodes of a result file, read by ansys-mapdl-reader."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.files.matrices import FileUnits, Path_, read_nodes
from gearmbs.flexible.material import FlexibleError
from gearmbs.units import Quantity

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
    if hasattr(os, "fork"):
        child = os.fork()
        if child == 0:
            try:
                load()
            finally:
                # what is wrong is told by the parent
                os._exit(0)
        if os.WIFSIGNALED(os.waitpid(child, 0)[1]):
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
