"""Plan of a sparse LU: index lists along which matrices of a pattern are factored, made once for the same pivots."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from gearmbs.dae.linalg.condensed import COLUMN_AT, COLUMNS, GROUP, ROW_AT, ROWS
from gearmbs.dae.linalg.condensed_lists import condensed_matrix, modes_apart, modes_first
from gearmbs.dae.linalg.entry_lists import (
    COUPLING_LIMIT,
    COUPLING_WHEN_PLANNED,
    NEGLIGIBLE,
    NEGLIGIBLE_IN_NEWTON,
    WHEN_PLANNED,
    limits,
    part_entries,
    scaled_entries,
    taken_pattern,
)
from gearmbs.dae.linalg.pivoting import CANCELLED, GROWTH_ALLOWED, LINES_TYPE, THRESHOLDS, Lines, choose_pivots
from gearmbs.dae.linalg.plan_lists import LISTS, lists_of_plan
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import boolean, float64, int64, types, uint32
from gearmbs.kernels.pointers import direct
from gearmbs.kernels.structs import KEPT_LAYOUTS, BlockLayout, IndexVector, IntVector, Struct, Vector

KNOWN = 16
"""Choices of pivots whose plans are kept; those of the largest models take some megabytes each."""


class LUPlan(Struct):
    """Frozen pivots and index lists of one pattern, in pivot order.

    Attributes
    ----------
    a_ptr, a_pos, a_src : ndarray
        For each pivot column the entries of the matrix: their place among the rows in pivot order and their
        index in the CSC values.
    a_scale : ndarray
        Scale of each of these entries (row times column scale).
    tail_at, tail_src, tail_scale : ndarray
        The same of the entries in the rows of the tail, which are not among these: their places in its blocks.
    u_ptr, u_pos : ndarray
        For each column the earlier pivots that act on it, ascending.
    l_ptr, l_pos : ndarray
        For each column the rows below the pivot.
    u_col, l_col : ndarray
        Column of each of these entries.
    block_col, lane_ptr : ndarray
        Columns of the blocks of eight rows of the tail below the pivots before it, in the order in which they stand,
        see `gearmbs.dae.linalg.dense_tail`, and where those of each eight rows begin.
    act_ptr, act_to, act_by, act_u : ndarray
        For each step, a level of columns or one, its operations on blocks: the block that is changed, and the block
        and the entry of U, among the numbers of the factors, whose product is taken off.
    last_to, last_ptr : ndarray
        The blocks that the last step changes, and where the operations on each begin and end; they stand together.
    part_ptr, part_at, part_col : ndarray
        For each step the blocks that become part of L, and their columns.
    above_ptr, above_col, above_at : ndarray
        Where the blocks of each eight rows of U before the tail begin, in the tail's columns; the columns of the
        blocks; and where the ``u_tail`` entries of U in these columns stand in them.
    l_to, l_by, u_to, u_by : ndarray
        Places that the entries of L and U change in a substitution, and by which, in the order in which the entries
        stand among the numbers of the factors: L, then U, then the pivots. It is that of a substitution, with the
        ``u_tail`` entries of U in the tail's columns first; where there are nodes, U is gone through from its end.
    a_to : ndarray
        Where the entries of the matrix stand among these numbers.
    pivot_ptr, pivot_order : ndarray
        Where the pivots of each level of columns begin and end, see `gearmbs.dae.linalg.schedule`, and which these are,
        in the order in which they stand; those set aside are the last.
    op_ptr, op_to, op_l, op_u : ndarray
        For each level its operations: the number that is changed and the factors of the product that is taken off.
    div_ptr, div_to, div_by : ndarray
        For each level the numbers that become entries of L, and the pivots that they are divided by. All from ``a_to``
        on are empty if there are nodes.
    node_end : ndarray
        For each column the end of its node: columns in a row whose rows below the node are the same.
    row_from, col_to : ndarray
        Original row and column of each pivot.
    row_scale, col_scale : ndarray
        Scales, in pivot order.
    kept : ndarray
        One for a proper pivot; zero for an equation and an unknown set aside because the matrix is nearly singular.
    groups : ndarray
        For each body whose modes are condensed ahead of all this what `gearmbs.dae.linalg.condensed` knows of it; empty
        if none are. All lists are then those of the matrix that is left, with ones on the diagonal for the modes, whose
        pivots come first, and ``a_src`` and ``tail_src`` are places among its scaled values.
    mode_at : ndarray
        Places of p, v and q of each mode in the whole matrix.
    row_at, column_at : ndarray
        For each body the equations that its modes enter, by their places among the pivots, and the unknowns that enter
        its modes' equations, by their places in the whole matrix.
    fill_at, fill_src : ndarray
        Where the entries in equations or by unknowns of modes stand among the numbers of the bodies, and these entries.
    rest_src, rest_scale : ndarray
        All other entries, in the order of the values that are left, and their scales.
    schur_at, schur_scale : ndarray
        Where the products that are taken off stand among the values that are left, and their scales.
    left_src, left_limit : ndarray
        Entries left out, by their index in the CSC values, and the largest absolute values with which they may be.
    limit : ndarray
        The same by CSC values, infinite for entries that are planned for; empty if no entry is left out.
    tail : int
        First pivot of the dense tail, see `gearmbs.dae.linalg.dense_tail`; their number if there is none. Entries of L
        in its rows and of U inside it are in none of the lists.
    """

    tail: int
    u_tail: int
    a_ptr: IntVector
    a_pos: IndexVector
    a_src: IndexVector
    a_scale: Vector
    tail_at: IndexVector
    tail_src: IndexVector
    tail_scale: Vector
    u_ptr: IntVector
    u_pos: IndexVector
    l_ptr: IntVector
    l_pos: IndexVector
    u_col: IndexVector
    l_col: IndexVector
    block_col: IndexVector
    lane_ptr: IntVector
    act_ptr: IntVector
    act_to: IndexVector
    act_by: IndexVector
    act_u: IndexVector
    last_ptr: IntVector
    last_to: IndexVector
    part_ptr: IntVector
    part_at: IndexVector
    part_col: IndexVector
    above_ptr: IntVector
    above_col: IndexVector
    above_at: IndexVector
    l_to: IndexVector
    l_by: IndexVector
    u_to: IndexVector
    u_by: IndexVector
    a_to: IndexVector
    pivot_ptr: IntVector
    pivot_order: IndexVector
    op_ptr: IntVector
    op_to: IndexVector
    op_l: IndexVector
    op_u: IndexVector
    div_ptr: IntVector
    div_to: IndexVector
    div_by: IndexVector
    node_end: IntVector
    row_from: IndexVector
    col_to: IndexVector
    row_scale: Vector
    col_scale: Vector
    kept: Vector
    groups: IntVector
    mode_at: IndexVector
    row_at: IndexVector
    column_at: IndexVector
    fill_at: IndexVector
    fill_src: IndexVector
    rest_src: IndexVector
    rest_scale: Vector
    schur_at: IndexVector
    schur_scale: Vector
    left_src: IndexVector
    left_limit: Vector
    limit: Vector


PLAN_TYPE = LUPlan.struct_kind


NO_MODES = np.zeros(0, dtype=np.int64)


class _Pivots:
    """Pivots, and the entries that they are chosen for: all that a plan follows from but its scales.

    Parameters
    ----------
    with_tail, rank, lists
        As of `plan_from_pivots`; the lists from ``rows`` to ``u_cols``, from ``taken`` to ``apart``, then ``left``.
    """

    def __init__(self, with_tail: bool, rank: int, *lists: np.ndarray) -> None:
        self.with_tail, self.rank, self.lists = with_tail, rank, lists
        self._content = with_tail, rank, *(items.tobytes() for items in lists)

    def __hash__(self) -> int:
        return hash(self._content)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Pivots) and self._content == other._content


class _Unscaled(NamedTuple):
    """A plan with scales of one, and in which rows and columns of the matrix its scaled entries and pivots stand."""

    plan: LUPlan
    entries: tuple[np.ndarray, np.ndarray]
    of_tail: tuple[np.ndarray, np.ndarray]
    pivots: tuple[np.ndarray, np.ndarray]


def _rows_and_columns(
    entries: np.ndarray, taken: np.ndarray, indptr: np.ndarray, indices: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return where entries of the matrix stand, which are among those taken."""
    k = np.searchsorted(taken, entries)
    return indices[k], np.searchsorted(indptr, k, side="right") - 1


def _rows_and_columns_of_blocks(f: dict[str, np.ndarray], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the equations and unknowns of the blocks that a condensation takes off, column by column."""
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for one in f["groups"].reshape(-1, GROUP):
        i = rows[f["row_at"][one[ROW_AT] : one[ROW_AT] + one[ROWS]]]
        j = f["column_at"][one[COLUMN_AT] : one[COLUMN_AT] + one[COLUMNS]]
        found.append((np.tile(i, len(j)), np.repeat(j, len(i))))
    i, j = (np.concatenate(part) for part in zip(*found, strict=True))
    return i, j


@lru_cache(maxsize=KNOWN)
def _unscaled_plan(pivots: _Pivots) -> _Unscaled:
    """Return the plan that follows from pivots, the same object for the same ones."""
    with_tail, rank = pivots.with_tail, pivots.rank
    rows, cols, l_ptr, l_rows, u_ptr, u_cols, taken, indptr, indices, apart, left = pivots.lists
    ones, none = np.ones(len(rows)), np.empty(0)
    tail, u_tail, *lists = direct(lists_of_plan)(
        with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, ones, ones, taken, indptr, indices, apart
    )
    f = dict(zip(LISTS, lists, strict=True))
    if len(apart):
        of_a = _rows_and_columns(f["rest_src"], taken, indptr, indices)
        of_tail = _rows_and_columns_of_blocks(f, rows)
    else:
        of_a = _rows_and_columns(f["a_src"], taken, indptr, indices)
        of_tail = _rows_and_columns(f["tail_src"], taken, indptr, indices)
    plan = LUPlan(left_src=left, left_limit=none, limit=none, tail=tail, u_tail=u_tail, **f)
    return _Unscaled(plan, of_a, of_tail, (rows, cols))


def plan_from_pivots(
    with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, apart,
    left, left_limit,
) -> LUPlan:  # fmt: skip
    """Return the plan that follows from pivots.

    Thousands of runs of alike mechanisms choose the same pivots; the lists that follow from them are made once.

    Parameters
    ----------
    with_tail : bool
        Whether the last pivots may be taken as a full block.
    rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols
        Of `gearmbs.dae.linalg.pivoting.choose_pivots`.
    row_scale, col_scale : ndarray, shape (n,)
        Scales of equations and unknowns.
    taken, indptr, indices : ndarray
        Entries of the matrix that the plan is made for, and their pattern.
    apart : ndarray of int64
        As of `lists_of_plan`.
    left, left_limit : ndarray
        Entries left out, and the largest absolute values with which they may be.
    """
    known = _unscaled_plan(
        _Pivots(with_tail, rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, taken, indptr, indices, apart, left)
    )
    (i, j), (p, q) = known.entries, known.pivots
    of_entries, of_others = ("rest_scale", "schur_scale") if len(apart) else ("a_scale", "tail_scale")
    scaled = {of_entries: row_scale[i] * col_scale[j], "row_scale": row_scale[p], "col_scale": col_scale[q]}
    if len(apart) or known.plan.tail < len(rows):
        i, j = known.of_tail
        scaled[of_others] = row_scale[i] * col_scale[j]
    if len(left):
        limit = np.full(len(taken) + len(left), np.inf)
        limit[left] = left_limit
        scaled |= {"left_limit": left_limit, "limit": limit}
    return known.plan.with_members(**scaled)


# Analysis of a sparse matrix: pivots chosen on its values, and the plan to factor every matrix of its pattern.
#
# Entries that have been negligible so far can be left out of the plan; the numeric phase,
# `gearmbs.dae.linalg.sparse_lu`, looks at them, and as soon as one counts the caller analyses again.


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
    types.Tuple((int64, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _IVEC, _VEC, _VEC, _UVEC, _IVEC, _IVEC, _IVEC, _UVEC, _VEC))(
        _IVEC, _IVEC, _VEC, _VEC, float64, _MASK, float64, _IVEC, LINES_TYPE, LINES_TYPE
    ),
    cache=True,
    nogil=True,
    error_model="numpy",
)
def scale_and_choose(all_ptr, all_indices, vals, scale, drop, counted, negligible, modes, columns, rows_left):
    """Scale the matrix, leave out what is negligible and choose pivots.

    Parameters
    ----------
    all_ptr, all_indices, vals, scale, drop, counted, negligible, modes
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
    apart
        Modes that are condensed.
    left, left_limit
        See `LUPlan`.
    """
    row_scale, col_scale, all_scaled = scaled_entries(all_ptr, all_indices, vals, scale)
    taken, left = part_entries(all_scaled, counted, WHEN_PLANNED * negligible)
    indptr, indices, scaled = taken_pattern(all_ptr, all_indices, all_scaled, taken)
    growth, apart = np.inf, modes_apart(indptr, indices, scaled, modes)
    part_ptr, part, scaled = condensed_matrix(indptr, indices, scaled, apart)
    for threshold in THRESHOLDS:
        if growth > GROWTH_ALLOWED:
            rank, growth, rows, cols, l_ptr, l_rows, u_ptr, u_cols = choose_pivots(
                part_ptr, part, scaled, drop, threshold, columns, rows_left
            )
    rows, cols, l_ptr, u_ptr = modes_first(row_scale.shape[0], apart, rows, cols, l_ptr, u_ptr)
    left_limit = limits(all_ptr, all_indices, left, row_scale, col_scale, negligible)
    return (
        rank, rows, cols, l_ptr, l_rows, u_ptr, u_cols, row_scale, col_scale, taken, indptr, indices, apart, left,
        left_limit,
    )  # fmt: skip


@lru_cache(maxsize=KEPT_LAYOUTS)
def _layout(n: int, size: int, with_values: bool) -> BlockLayout[Lines]:
    whole = dict.fromkeys(("start", "length", "after", "before"), n)
    counts = dict.fromkeys(("room", "head"), n + 1)
    return BlockLayout(Lines, {**whole, **counts, "pool": size, "vals": size if with_values else 1})


def new_lines(n: int, size: int) -> tuple[Lines, Lines]:
    """Return ``n`` empty columns with values and ``n`` empty rows without, each with a pool of ``size`` places."""
    return _layout(n, size, True).new(), _layout(n, size, False).new()


def lines_for(indptr: np.ndarray, indices: np.ndarray) -> tuple[Lines, Lines]:
    """Return `new_lines` with room for what mostly fills in when a matrix of a pattern is eliminated."""
    n = len(indptr) - 1
    return new_lines(n, 3 * len(indices) + 4 * n)


def analyse(
    indptr: np.ndarray,
    indices: np.ndarray,
    vals: np.ndarray,
    scale: np.ndarray,
    drop: float = 0.0,
    counted: np.ndarray | None = None,
    negligible: float = NEGLIGIBLE,
    with_tail: bool = False,
    couplings: np.ndarray | None = None,
    modes: np.ndarray | None = None,
    lines: tuple[Lines, Lines] | None = None,
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
        Whether the last pivots may be taken as a full block, as is worth it with modes.
    couplings : ndarray of bool, optional
        Entries that are left out up to `COUPLING_LIMIT`, unless they have counted before, if ``negligible`` is the
        first of `NEGLIGIBLE_IN_NEWTON`.
    modes : ndarray of int64, optional
        Places of p, v and q, and the body, of each mode; those that stand apart are condensed, see
        `gearmbs.dae.linalg.condensed`.
    lines : pair of Lines, optional
        Scratch of `lines_for` the pattern, for who analyses many matrices of it; default new ones.

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
    scale = np.asarray(scale, dtype=float)
    lines = lines_for(indptr, indices) if lines is None else lines
    counted = np.ones(len(indices), dtype=bool) if counted is None else counted
    modes = NO_MODES if modes is None or drop > 0.0 else modes
    spared = None if couplings is None or negligible < NEGLIGIBLE_IN_NEWTON[0] else couplings & ~counted
    whole, vals = vals, vals if spared is None else np.where(spared, 0.0, vals)
    rank, *chosen = _chosen(lines, indptr, indices, vals, scale, max(drop, CANCELLED), counted, negligible, modes)
    if rank < len(indptr) - 1 and not counted.all():
        # what was left out may be what was missing
        return analyse(indptr, indices, whole, scale, drop, with_tail=with_tail)
    if rank < len(indptr) - 1 and drop == 0.0:
        rows, cols = chosen[:2]
        raise SingularMatrixError(rows[rank:], cols[rank:])
    plan = plan_from_pivots(with_tail, rank, *chosen)
    if spared is None or not len(plan.limit):
        return plan
    plan.limit[spared] *= COUPLING_LIMIT / negligible
    large = spared & (np.abs(whole) > COUPLING_WHEN_PLANNED * plan.limit)
    if not large.any():
        return plan
    counted |= large
    return analyse(indptr, indices, whole, scale, drop, counted, negligible, with_tail, couplings, modes)


def _chosen(lines: tuple[Lines, Lines], *matrix: Any) -> tuple[Any, ...]:
    """Return what `scale_and_choose` finds for a matrix, with as much scratch as it takes."""
    columns, rows = lines
    while (found := direct(scale_and_choose)(*matrix, columns, rows))[0] < 0:
        columns, rows = new_lines(len(matrix[0]) - 1, 2 * len(columns.pool))
    return found


@njit(float64(_UVEC), cache=True, nogil=True, error_model="numpy")
def parity(order):
    """Return 1 for an even permutation and -1 for an odd one."""
    seen, sign = np.zeros(order.shape[0], dtype=np.bool_), 1.0
    for first in range(order.shape[0]):
        at, length = np.int64(first), 0
        while not seen[at]:
            seen[at] = True
            at, length = np.int64(order[at]), length + 1
        if length > 0 and length % 2 == 0:
            sign = -sign
    return sign
