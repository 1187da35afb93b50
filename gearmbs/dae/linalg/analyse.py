"""Analysis of a sparse matrix: pivots chosen on its values, and the plan to factor every matrix of its pattern.

Entries that have been negligible so far can be left out of the plan; the numeric phase, `gearmbs.dae.linalg.sparse_lu`,
looks at them, and as soon as one counts the caller analyses again.
"""

from __future__ import annotations

import numpy as np
from numba import boolean, float64, int64, types, uint32

from gearmbs._jit import njit
from gearmbs.dae.compiled.direct_calls import direct
from gearmbs.dae.linalg.counted_entries import (
    NEGLIGIBLE,
    WHEN_PLANNED,
    limits,
    part_entries,
    scaled_entries,
    taken_pattern,
)
from gearmbs.dae.linalg.lu_plan import LUPlan, plan_from_pivots
from gearmbs.dae.linalg.pivoting import (
    CANCELLED,
    GROWTH_ALLOWED,
    LINES_TYPE,
    THRESHOLDS,
    choose_pivots,
    new_lines,
)

_VEC = float64[::1]
_IVEC = int64[::1]
_UVEC = uint32[::1]
_MASK = boolean[::1]


class SingularMatrixError(ValueError):
    """No pivot is left.

    Attributes
    ----------
    rows, cols : ndarray of int
        Equations and unknowns that could not be paired.
    """

    def __init__(self, rows: np.ndarray, cols: np.ndarray):
        super().__init__(f"the matrix is singular: no pivot left for columns {cols.tolist()}, rows {rows.tolist()}")
        self.rows = rows
        self.cols = cols


@njit(
    types.Tuple((int64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _VEC, _VEC, _UVEC, _IVEC, _IVEC, _UVEC, _VEC))(
        _IVEC, _IVEC, _VEC, _VEC, float64, _MASK, float64, LINES_TYPE, LINES_TYPE
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _choose(all_ptr, all_indices, vals, scale, drop, counted, negligible, columns, rows_left):
    """Scale the matrix, leave out what is negligible and choose pivots.

    Parameters
    ----------
    all_ptr, all_indices, vals, scale, drop, counted, negligible
        As the pattern and the others of `analyse`.
    columns, rows_left
        As in `choose_pivots`.

    Returns
    -------
    rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols
        See `choose_pivots`; no rank where a pool was too small.
    row_scale, col_scale, taken
        Scales; entries of the matrix that the plan is made for.
    indptr, indices
        Their pattern.
    left, left_limit
        See `LUPlan`.
    """
    row_scale, col_scale, all_scaled = scaled_entries(all_ptr, all_indices, vals, scale)
    taken, left = part_entries(all_scaled, counted, WHEN_PLANNED * negligible)
    indptr, indices, scaled = taken_pattern(all_ptr, all_indices, all_scaled, taken)
    growth = np.inf
    for threshold in THRESHOLDS:
        if growth > GROWTH_ALLOWED:
            rank, growth, rows, cols, l_ptr, l_rows, u_ptr, u_cols = choose_pivots(
                indptr, indices, scaled, drop, threshold, columns, rows_left
            )
    left_limit = limits(all_ptr, all_indices, left, row_scale, col_scale, negligible)
    return (
        rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, left, left_limit
    )  # fmt: skip


def analyse(
    indptr: np.ndarray,
    indices: np.ndarray,
    vals: np.ndarray,
    scale: np.ndarray,
    drop: float = 0.0,
    counted: np.ndarray | None = None,
    negligible: float = NEGLIGIBLE,
    with_tail: bool = False,
) -> LUPlan:
    """Choose pivots for a matrix and lay down the plan to factor every matrix of its pattern.

    Parameters
    ----------
    indptr, indices : ndarray of int64
        CSC pattern, n columns.
    vals : ndarray
        Values on which pivots are chosen.
    scale : ndarray, shape (n,)
        Typical magnitude of each unknown.
    drop : float
        When positive, unknowns without a pivot larger than this fraction of their entries are set aside, each with an
        equation: they come out of `solve` as zero.
    counted : ndarray of bool, optional
        Entries of the pattern that have counted in any matrix before; those that count in this one are marked. The
        others are left out of the plan, if they are many. Default: no entry is left out.
    negligible : float
        Size of an entry of the equilibrated matrix up to which it may stay left out.
    with_tail : bool
        Whether the last pivots may be taken as a full block, as is worth it with modes; eight matrices side by side
        cannot have one.

    Returns
    -------
    LUPlan

    Raises
    ------
    SingularMatrixError
        If nothing may be dropped and the matrix is singular to working precision, with the rows and columns left over.
    ValueError
        If a value is not finite.
    """
    if not np.isfinite(vals).all():
        raise ValueError("the matrix has entries that are not finite")
    scale, choose = np.asarray(scale, dtype=float), direct(_choose)
    n = len(indptr) - 1
    size = 3 * len(indices) + 4 * n
    counted = np.ones(len(indices), dtype=bool) if counted is None else counted
    while True:
        lines = new_lines(n, size, True), new_lines(n, size, False)
        rank, *chosen = choose(indptr, indices, vals, scale, max(drop, CANCELLED), counted, negligible, *lines)
        if rank >= 0:
            break
        size *= 2
    if rank < n and not counted.all():
        return analyse(indptr, indices, vals, scale, drop, with_tail=with_tail)
    if rank < n and drop == 0.0:
        rows, cols = chosen[:2]
        raise SingularMatrixError(rows[rank:], cols[rank:])
    return plan_from_pivots(with_tail, rank, *chosen)
