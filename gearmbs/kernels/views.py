"""Memory as compiled code sees it, at the price of an address: parts of tables, records.

What is seen is neither counted nor owned: whoever looks answers for the memory to be there. Members of structs are seen
in the same way; how is in `gearmbs.kernels.own.views`, which numba is asked to import when something is compiled.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import deferred

# Views into flat arrays for compiled code, without the price of a slice.

vector_at = deferred("own.views", "vector_at")
"""``vector_at(array, first, size)``: ``array.ravel()[first : first + size]``."""
matrix_at = deferred("own.views", "matrix_at")
"""``matrix_at(array, first, rows, columns)``: as many numbers from there on, as a matrix."""
before = deferred("own.views", "before")
"""``before(array)``: an array of the same size that begins one number earlier."""


@njit(cache=True, error_model="numpy", forceinline=True)
def uncounted(array):
    """Return a view of a whole vector without its reference count.

    Every inlined call that is handed a counted array counts up and down, some 12 ns each: a third of a residual. The
    view must not outlive the array.
    """
    return vector_at(array, 0, array.size)


@njit(cache=True, error_model="numpy", forceinline=True)
def uncounted_rows(table):
    """Return a view of a whole matrix without its reference count, as `uncounted` of a vector."""
    return matrix_at(table, 0, table.shape[0], table.shape[1])


# Flat arrays seen as records: named fields at fixed places.


def header(dtype: np.dtype, alignment: int = 1) -> Any:
    """Return an intrinsic that sees the beginning of an array as a record, from the next multiple of some bytes on."""
    return deferred("own.views", "header", dtype, alignment)


def numbers(scalar: Any) -> Any:
    """Return an intrinsic that sees all numbers of a table from its header on; they are not counted."""
    return deferred("own.views", "numbers", scalar)


def behind(dtype: np.dtype, first: np.dtype) -> Any:
    """Return an intrinsic that finds record ``k`` of those that follow a first record."""
    return deferred("own.views", "behind", dtype, first)


def rows(dtype: np.dtype, lanes: int) -> Any:
    """Return an intrinsic that sees a record of numbers as an array, (rows, lanes)."""
    return deferred("own.views", "rows", dtype, lanes)
