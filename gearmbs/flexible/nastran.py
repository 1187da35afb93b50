"""Matrices of Nastran: OP4 files with the assembly file of their superelement, and op2 files with their grid points.

The files are read by pyyeti (``pip install gearmbs[fem]``). What is added here: records are followed to the end of the
file before anything is believed, displacement coordinate systems are turned into the basic one, and units become SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from gearmbs.flexible.errors import FlexibleError
from gearmbs.flexible.fe_model import FiniteElementModel
from gearmbs.flexible.matrices import FileUnits
from gearmbs.flexible.matrix_text import Path_
from gearmbs.flexible.nastran_files import GridTable, assembly_table, check_end, pyyeti_module
from gearmbs.flexible.nastran_grids import op2_tables
from gearmbs.units import Quantity


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
    return units.model(k, m, table.positions, table.dofs, table.ids, name)


def _named(found: dict[str, Any], wanted: str, file: Path) -> Any:
    """Return a matrix by its name in lower case."""
    matrix = found.get(wanted.lower())
    if matrix is None:
        known = ", ".join(key for key, value in found.items() if np.ndim(value) == 2 or sp.issparse(value)) or "none"
        raise FlexibleError(f"{file.name}: it has no matrix '{wanted.lower()}'; matrices: {known}")
    return matrix
