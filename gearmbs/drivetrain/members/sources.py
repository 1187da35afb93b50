"""Bodies of other programs in a drivetrain: finite-element models and bodies with modes, from their files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.drivetrain.part import DrivetrainError, require
from gearmbs.schema.described import chosen

if TYPE_CHECKING:
    from gearmbs.flexible import ModalModel

MODES = 20
"""Vibration shapes of a finite-element body where nothing is said, as of `gearmbs.flexible.reduce_model`."""

ALL = "all"
"""Number of modes with which nothing of the finite elements is lost."""

ROUND = 1.02
"""Radius within which nodes are in a seat, over that of the bore: what a mesh rounds of the circle they are on."""

TURNED = 1e-6
"""Largest entry of A A^T - 1 of axes: what six digits of a direction leave."""


def _neutral_file(path: Any, **options: Any) -> ModalModel:
    from gearmbs.flexible import read_mnf

    return read_mnf(path).modal_model(**options)


def _modes_of_op2(path: Any, **options: Any) -> ModalModel:
    from gearmbs.flexible import read_op2_modes

    return read_op2_modes(path, **options).modal_model()


def _reader(name: str) -> Callable[..., Any]:
    def read(*files: Any, **options: Any) -> Any:
        from gearmbs import flexible

        return getattr(flexible, name)(*files, **options)

    return read


PROGRAMS: dict[str, Callable[..., Any]] = {
    "abaqus": _reader("read_abaqus"),
    "ansys": _reader("read_ansys"),
    "box": _reader("box_model"),
    "calculix": _reader("read_calculix"),
    "mnf": _neutral_file,
    "op2": _reader("read_op2"),
    "op2 modes": _modes_of_op2,
    "op4": _reader("read_op4"),
}
"""Readers of ``model`` by ``program``; "box" is a box by its walls, see `gearmbs.flexible.box_model`."""


def body_source(given: Any) -> Any:
    """Return the finite-element model or the body with modes that was given, or that a table says how to read.

    Raises
    ------
    DrivetrainError
        For other objects, and unknown programs.
    """
    from gearmbs.flexible import FiniteElementModel, ModalModel

    if isinstance(given, FiniteElementModel | ModalModel):
        return given
    require(
        isinstance(given, Mapping),
        f"{given!r} is no finite-element model; give one of gearmbs.flexible, or a table with program and files",
    )
    table = dict(given)
    read = chosen(PROGRAMS, str(table.pop("program", "missing")), "", DrivetrainError, "program")
    files = table.pop("files", ())
    return read(*((files,) if isinstance(files, str | Path) else files), **table)


def axes_of(given: Any, label: str) -> tuple[tuple[float, ...], ...] | None:
    """Return three axes as rows of their rotation matrix, None if there are none.

    Raises
    ------
    DrivetrainError
        For what is no rotation.
    """
    if given is None:
        return None
    rows = np.asarray(given, dtype=float)
    right = rows.shape == (3, 3) and np.abs(rows @ rows.T - np.eye(3)).max() < TURNED and np.linalg.det(rows) > 0
    require(bool(right), f"{label}: axes is {given!r}; give 3 rows of a rotation matrix")
    return tuple(map(tuple, rows.tolist()))
