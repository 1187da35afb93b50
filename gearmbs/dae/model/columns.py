"""Matrices of a model by columns, without what takes long to import: a run of few constraints needs no more."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from scipy.sparse import csc_array

DENSE_SYSTEM = 250
"""Rows and columns up to which a dense elimination takes less time than to put a sparse matrix together."""


class Columns(NamedTuple):
    """A sparse matrix in CSC form, each entry once.

    `scipy.sparse` takes longer to import than a mechanism of four bodies to assemble: it is imported where a matrix is
    large enough to be worth it.
    """

    data: np.ndarray
    indices: np.ndarray
    indptr: np.ndarray
    shape: tuple[int, int]

    @property
    def is_small(self) -> bool:
        """Whether it is to be handled as a full matrix."""
        return max(self.shape) <= DENSE_SYSTEM

    def toarray(self) -> np.ndarray:
        """Return the full matrix."""
        out = np.zeros(self.shape)
        out[self.indices, np.repeat(np.arange(self.shape[1]), np.diff(self.indptr))] = self.data
        return out

    def sparse(self) -> csc_array:
        """Return the matrix as one of `scipy.sparse`."""
        from scipy.sparse import csc_array

        return csc_array((self.data, self.indices, self.indptr), shape=self.shape)

    def below(self, first: int, columns: int) -> Columns:
        """Return the rows from ``first`` on of the first ``columns`` columns."""
        end = int(self.indptr[columns])
        inside = self.indices[:end] >= first
        ends = np.concatenate([[0], np.cumsum(inside)])[self.indptr[: columns + 1]]
        return Columns(
            self.data[:end][inside], self.indices[:end][inside] - first, ends, (self.shape[0] - first, columns)
        )

    def chosen(self, rows: np.ndarray) -> Columns:
        """Return some rows, in ascending order."""
        places = np.full(self.shape[0], -1)
        places[rows] = np.arange(rows.size)
        inside = places[self.indices] >= 0
        ends = np.concatenate([[0], np.cumsum(inside)])[self.indptr]
        return Columns(self.data[inside], places[self.indices[inside]], ends, (rows.size, self.shape[1]))

    def entries(self, row: int, columns: np.ndarray) -> np.ndarray:
        """Return the entries of a row in some columns."""
        ends = zip(self.indptr[columns], self.indptr[columns + 1], strict=True)
        return np.array([self.data[a:b][self.indices[a:b] == row].sum() for a, b in ends])

    def solved(self, rhs: np.ndarray) -> np.ndarray:
        """Return the solution of a square system; not finite where the matrix is singular.

        Elimination with row pivots, after rows and columns have been brought to one size: masses, moments of inertia
        and constraints are in units of their own.
        """
        if not self.is_small:
            from scipy.sparse.linalg import splu

            try:
                return splu(self.sparse()).solve(rhs)
            except RuntimeError:
                return np.full(rhs.size, np.nan)
        full = self.toarray()
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            rows = 1.0 / np.abs(full).max(axis=1)
            columns = 1.0 / np.abs(rows[:, None] * full).max(axis=0)
            try:
                return columns * np.linalg.solve(rows[:, None] * full * columns, rows * rhs)
            except np.linalg.LinAlgError:
                return np.full(rhs.size, np.nan)
