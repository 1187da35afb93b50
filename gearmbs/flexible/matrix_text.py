"""Matrices and nodes in text files: tables of numbers, read whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from gearmbs.flexible.errors import FlexibleError

Path_ = str | Path


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
    lines = text_lines(Path(path))
    last = 0
    for count, line in enumerate(lines, 1):
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
    if not (np.any(i < j) and np.any(i > j)):
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
