"""Sparse LU for a fixed pattern: numeric factorisations replayed along a plan without search.

`factor` replays the plan of `gearmbs.dae.linalg.lu_plan` level by level, see `gearmbs.dae.linalg.schedule`, or, where
columns are taken together as nodes, column by column, see `gearmbs.dae.linalg.sparse_lu`; `solve` applies it. Pivots
stay frozen until a multiplier grows beyond `GROWTH_LIMIT`, a pivot vanishes, or an entry that was left out of the plan
counts; then the caller analyses again with the current values.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gearmbs.dae.linalg.condensed import (
    condense,
    fill,
    fill_moving,
    modes_after,
    note_moving,
    put_pivots,
    without_modes,
)
from gearmbs.dae.linalg.condensed_lists import numbers_of
from gearmbs.dae.linalg.dense_tail import (
    act_on_blocks,
    divide_blocks,
    factor_behind,
    fill_above,
    fill_blocks,
    open_tail,
    padded,
    solve_tail,
    tail_in,
    take_above,
)
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, LUPlan
from gearmbs.dae.linalg.schedule import has_nodes, through_node
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import float64, int64, types
from gearmbs.kernels.lanes import LANES, all_lanes, bits_of, double_of
from gearmbs.kernels.pointers import direct
from gearmbs.kernels.structs import KEPT_LAYOUTS, BlockLayout, Struct, Vector, vector_at

# Factors and substitutions column by column (left-looking), where columns are taken together as nodes.


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _act_by_nodes(plan, factors, k):
    """Eliminate from column k, spread out in ``factors.x``, what the earlier pivots act on it, and store U's part.

    The columns of a node act together.
    """
    x, w, lu = factors.x, factors.w, factors.lu
    l_ptr, l_pos, u_pos, node_end = plan.l_ptr, plan.l_pos, plan.u_pos, plan.node_end
    upper = np.uint64(l_pos.shape[0])
    p, last = np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])
    while p < last:
        j = np.uint64(u_pos[p])
        end = node_end[j]
        if end - np.int64(j) == 1:
            u = x[j]
            x[j] = 0.0
            lu[upper + p] = u
            p += np.uint64(1)
            if u != 0.0:
                for q in range(np.uint64(l_ptr[j]), np.uint64(l_ptr[j + np.uint64(1)])):
                    x[l_pos[q]] -= lu[q] * u
            continue
        # the column has all rows of the node from this one on
        stop, rows = np.uint64(min(end, k)), np.uint64(end) - j
        below = np.uint64(l_ptr[end - 1])
        size = rows + np.uint64(l_ptr[end]) - below
        for i in range(rows):
            w[i] = x[j + i]
            x[j + i] = 0.0
        for i in range(rows, size):
            w[i] = 0.0
        through_node(np.int64(j), np.int64(stop), np.int64(size), l_ptr, lu, w)
        for i in range(stop - j):
            lu[upper + p + i] = w[i]
        for i in range(stop - j, rows):
            x[j + i] = w[i]
        for i in range(size - rows):
            x[l_pos[below + i]] += w[rows + i]
        p += stop - j


@njit(cache=True, nogil=True, error_model="numpy")
def factor_by_columns(plan, factors, vals):
    """Factor a matrix column by column; return what `gearmbs.dae.linalg.sparse_lu.factor` does."""
    x, lu, pivot_inv, blocks = factors.x, factors.lu, factors.pivot_inv, factors.blocks
    a_pos, a_src, a_scale, l_pos = plan.a_pos, plan.a_src, plan.a_scale, plan.l_pos
    top, grown = int64(0), (all_lanes(0.0), all_lanes(0.0))
    n, tail = pivot_inv.shape[0], plan.tail
    if tail < n:
        fill_blocks(plan, blocks, vals)
    for k in range(n):
        for p in range(np.uint64(plan.a_ptr[k]), np.uint64(plan.a_ptr[k + 1])):
            x[a_pos[p]] = vals[a_src[p]] * a_scale[p]
        _act_by_nodes(plan, factors, k)
        if k >= tail:
            continue
        pivot = x[k]
        x[k] = 0.0
        if plan.kept[k] == 0.0:
            pivot_inv[k] = 0.0
            x[:] = 0.0
            continue
        if pivot == 0.0:
            x[:] = 0.0
            return np.inf
        inv = 1.0 / pivot
        pivot_inv[k] = inv
        for q in range(np.uint64(plan.l_ptr[k]), np.uint64(plan.l_ptr[k + 1])):
            i = l_pos[q]
            l = x[i] * inv
            x[i] = 0.0
            lu[q] = l
            top = max(top, bits_of(abs(l)))
        if tail < n:
            act_on_blocks(plan, blocks, lu, k)
            grown = divide_blocks(plan, blocks, pivot_inv, k, grown)
    if tail < n:
        top = max(top, bits_of(factor_behind(plan, factors, grown)))
    return double_of(top)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def forward_by_nodes(plan, factors):
    """Solve L x = x in ``factors.x``, the columns of a node together."""
    x, w, lu = factors.x, factors.w, factors.lu
    l_pos, l_ptr, node_end = plan.l_pos, plan.l_ptr, plan.node_end
    n = factors.pivot_inv.shape[0]
    k = 0
    while k < n:
        end = node_end[k]
        if end - k == 1:
            v = x[k]
            if v != 0.0:
                for q in range(np.uint64(l_ptr[k]), np.uint64(l_ptr[k + 1])):
                    x[l_pos[q]] -= lu[q] * v
        else:
            first, rows, below = np.uint64(k), np.uint64(end - k), np.uint64(l_ptr[end - 1])
            size = rows + np.uint64(l_ptr[end]) - below
            for i in range(rows):
                w[i] = x[first + i]
            for i in range(rows, size):
                w[i] = 0.0
            through_node(k, end, np.int64(size), l_ptr, lu, w)
            for i in range(rows):
                x[first + i] = w[i]
            for i in range(size - rows):
                x[l_pos[below + i]] += w[rows + i]
        k = end


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def backward_by_columns(plan, factors):
    """Take from ``factors.x`` what the unknowns above the diagonal of U give, column by column."""
    x, lu, pivot_inv, u_pos, u_ptr = factors.x, factors.lu, factors.pivot_inv, plan.u_pos, plan.u_ptr
    upper = np.uint64(plan.l_pos.shape[0])
    n = pivot_inv.shape[0]
    for m in range(n):
        k = np.uint64(n - 1 - m)
        v = x[k] * pivot_inv[k]
        for p in range(np.uint64(u_ptr[k]), np.uint64(u_ptr[k + np.uint64(1)])):
            x[u_pos[p]] -= lu[upper + p] * v


GROWTH_LIMIT = 1e5
"""Multipliers of chosen pivots are a hundred at most, or a thousand in rows of one entry; a hundred times that leaves
eleven digits."""

_VEC = float64[::1]
_MAT = float64[:, ::1]


class LUFactors(Struct):
    """Numbers of one factorisation.

    Attributes
    ----------
    lu : ndarray
        L below its unit diagonal, U above its diagonal, inverse pivots, each in the plan's order, and one that nothing
        uses.
    pivot_inv : ndarray, shape (n,)
        Inverse pivots by their places.
    x, w : ndarray
        Scratch, a number each row; ``x`` is filled up to whole lanes of the tail's rows.
    blocks : ndarray
        L of the pivots before the dense tail in its rows, block by block; then U of the tail.
    above : ndarray
        U of the pivots before the dense tail in its columns, block by block.
    lower, rest : ndarray
        L of the dense tail, and its part of a right-hand side.
    every, left, reduced : ndarray
        Numbers of the bodies whose modes are condensed, the scaled entries that are left, and these less what the modes
        take off; see `gearmbs.dae.linalg.condensed`.
    moving : ndarray
        Of `gearmbs.dae.linalg.condensed.note_moving`, its first number -1 where nothing is noted.
    """

    lu: Vector
    pivot_inv: Vector
    x: Vector
    w: Vector
    blocks: Vector
    above: Vector
    lower: Vector
    rest: Vector
    every: Vector
    left: Vector
    reduced: Vector
    moving: Vector


FACTORS_TYPE = LUFactors.struct_kind


@lru_cache(maxsize=KEPT_LAYOUTS)
def _layout(
    n: int, tail: int, entries: int, blocks: int, above: int, every: int, left: int, reduced: int, moving: int
) -> BlockLayout[LUFactors]:
    """Return where the numbers stand: arrays, and of ``x`` the rows of the tail, where the processor reads lanes."""
    rows = padded(n - tail)
    sizes = {
        "lu": entries + n + 1,
        "pivot_inv": n,
        "x": tail + rows,
        "w": n,
        "blocks": LANES * blocks + rows * (n - tail),
        "above": LANES * above,
        "lower": rows * (n - tail) + LANES,
        "rest": rows,
        "every": every,
        "left": left,
        "reduced": reduced,
        "moving": moving,
    }
    return BlockLayout(LUFactors, sizes, on_line={"x": tail})


def new_factors(plan: LUPlan) -> LUFactors:
    """Return empty factors for a plan."""
    entries = len(plan.l_pos) + len(plan.u_pos)
    every, reduced = direct(numbers_of)(plan.groups), direct(values_left)(plan)
    blocks, left = (len(plan.block_col), len(plan.above_col)), len(plan.rest_src)
    moving = len(plan.fill_src) + left + 2 if reduced else 0
    factors = _layout(len(plan.row_from), plan.tail, entries, *blocks, every, left, reduced, moving).new()
    if reduced:
        factors.reduced[-1] = 1.0
        factors.moving[0] = -1.0
    return factors


@njit(int64(PLAN_TYPE), cache=True, nogil=True, error_model="numpy")
def values_left(plan):
    """Return how many values a condensation leaves, the one on the diagonal of the modes included; 0 without one."""
    if plan.groups.shape[0] == 0:
        return 0
    largest = np.uint32(0)
    for e in range(plan.a_src.shape[0]):
        largest = max(largest, plan.a_src[e])
    for e in range(plan.tail_src.shape[0]):
        largest = max(largest, plan.tail_src[e])
    return np.int64(largest) + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _factor_by_levels(plan, factors, vals):
    """Factor the matrix with values ``vals`` level by level; return what `factor` does."""
    lu, pivot_inv, blocks = factors.lu, factors.pivot_inv, factors.blocks
    a_to, a_src, a_scale, pivot_order = plan.a_to, plan.a_src, plan.a_scale, plan.pivot_order
    op_to, op_l, op_u, div_to, div_by = plan.op_to, plan.op_l, plan.op_u, plan.div_to, plan.div_by
    n, steps, tail = pivot_inv.shape[0], plan.op_ptr.shape[0] - 1, plan.tail
    pivots = np.uint64(plan.l_to.shape[0] + plan.u_to.shape[0])
    for e in range(lu.shape[0]):
        lu[e] = 0.0
    if tail < n:
        fill_blocks(plan, blocks, vals)
    for e in range(a_to.shape[0]):
        lu[a_to[e]] = vals[a_src[e]] * a_scale[e]
    regular, top, grown = True, int64(0), (all_lanes(0.0), all_lanes(0.0))
    for m in range(steps):
        for e in range(np.uint64(plan.op_ptr[m]), np.uint64(plan.op_ptr[m + 1])):
            lu[op_to[e]] -= lu[op_l[e]] * lu[op_u[e]]
        for k in range(np.uint64(plan.pivot_ptr[m]), np.uint64(plan.pivot_ptr[m + 1])):
            pivot = lu[pivots + k]
            regular &= pivot != 0.0
            inverse = 1.0 / pivot
            lu[pivots + k] = inverse
            pivot_inv[pivot_order[k]] = inverse
        for e in range(np.uint64(plan.div_ptr[m]), np.uint64(plan.div_ptr[m + 1])):
            l = lu[div_to[e]] * lu[div_by[e]]
            lu[div_to[e]] = l
            top = max(top, bits_of(abs(l)))
        if tail < n and m < steps - 1:
            act_on_blocks(plan, blocks, lu, m)
            grown = divide_blocks(plan, blocks, pivot_inv, m, grown)
    if not regular:
        return np.inf
    for k in range(np.uint64(plan.pivot_ptr[steps]), np.uint64(n)):
        pivot_inv[pivot_order[k]] = 0.0
    if tail < n:
        fill_above(plan, factors)
        top = max(top, bits_of(factor_behind(plan, factors, grown)))
    return double_of(top)


@njit(float64(PLAN_TYPE, FACTORS_TYPE, _VEC), cache=True, nogil=True, error_model="numpy")
def factor(plan, factors, vals):
    """Factor the matrix with values ``vals`` along the plan.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        Overwritten.
    vals : ndarray
        Values in CSC order.

    Returns
    -------
    growth : float
        Largest multiplier in L. Above `GROWTH_LIMIT`, infinite or NaN the pivots no longer fit, or an entry that was
        left out counts: analyse again.
    """
    return refactor(plan, factors, vals) if fits(plan, vals) else np.inf


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def fits(plan, vals):
    """Return whether the entries that a plan leaves out are negligible in the matrix with values ``vals``."""
    limit, small = plan.limit, True
    for p in range(limit.shape[0]):
        small &= abs(vals[p]) <= limit[p]
    return small


@njit(float64(PLAN_TYPE, FACTORS_TYPE, _VEC), cache=True, nogil=True, error_model="numpy")
def refactor(plan, factors, vals):
    """Factor as `factor` does, without a look at the entries that the plan leaves out."""
    if plan.groups.shape[0] == 0:
        return factor_rest(plan, factors, vals)
    fill(plan.fill_at, plan.fill_src, plan.rest_src, plan.rest_scale, vals, factors.every, factors.left)
    factors.moving[0] = -1.0
    return factor_condensed(plan, factors)


@njit(float64(PLAN_TYPE, FACTORS_TYPE, _VEC, _VEC, types.boolean), cache=True, nogil=True, error_model="numpy")
def refactor_carried(plan, factors, vals, slope, carried):
    """Factor as `refactor` does a matrix that is carried over along its slope.

    Parameters
    ----------
    plan, factors, vals
        As of `factor`.
    slope : ndarray
        Changes of the values with what the matrix is carried over to.
    carried : bool
        Whether only entries with a slope are others than in the last matrix.
    """
    if plan.groups.shape[0] == 0:
        return factor_rest(plan, factors, vals)
    if carried and factors.moving[0] >= 0.0:
        fill_moving(
            plan.fill_at, plan.fill_src, plan.rest_src, plan.rest_scale, vals, factors.every, factors.left,
            factors.moving,
        )  # fmt: skip
    else:
        fill(plan.fill_at, plan.fill_src, plan.rest_src, plan.rest_scale, vals, factors.every, factors.left)
        note_moving(plan.fill_src, plan.rest_src, slope, factors.moving)
    return factor_condensed(plan, factors)


@njit(cache=True, nogil=True, error_model="numpy")
def factor_condensed(plan, factors):
    """Condense the modes whose numbers are filled, and factor what is left; return what `factor` does."""
    reduced = factors.reduced
    cancelled = condense(plan.groups, plan.schur_at, plan.schur_scale, factors.every, factors.left, reduced)
    growth = factor_rest(plan, factors, reduced)
    put_pivots(plan.groups, factors.every, factors.pivot_inv)
    return cancelled if not cancelled <= growth else growth


@njit(cache=True, nogil=True, error_model="numpy")
def factor_rest(plan, factors, vals):
    """Factor what a condensation leaves, or the whole matrix where nothing is condensed; return what `factor` does."""
    if has_nodes(plan.node_end):
        return factor_by_columns(plan, factors, vals)
    return _factor_by_levels(plan, factors, vals)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)
def _solve_tail(plan, factors, x):
    """Solve for the unknowns of the dense tail in ``x``, which is solved with L up to there."""
    blocks = factors.blocks
    open_tail(plan.tail, plan.lane_ptr, plan.block_col, blocks, x, factors.rest)
    solve_tail(plan.tail, factors.lower, tail_in(plan, blocks), factors.pivot_inv, factors.rest, x)


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def solve(plan, factors, b, out):
    """Write the solution of A out = b; ``out`` may be ``b`` itself.

    One loop over all entries does without those over columns, if most of these have one or two.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        From `factor`.
    b, out : ndarray, shape (n,)
    """
    x, lu, pivot_inv = factors.x, factors.lu, factors.pivot_inv
    l_to, l_by, u_to, u_by = plan.l_to, plan.l_by, plan.u_to, plan.u_by
    row_from, row_scale, col_to, col_scale = plan.row_from, plan.row_scale, plan.col_to, plan.col_scale
    n = pivot_inv.shape[0]
    ahead = plan.mode_at.shape[0]
    for k in range(ahead, n):
        x[k] = b[row_from[k]] * row_scale[k]
    if ahead > 0:
        without_modes(plan.groups, plan.mode_at, plan.row_at, row_scale, b, factors.every, x)
    by_nodes = has_nodes(plan.node_end)
    if by_nodes:
        forward_by_nodes(plan, factors)
    else:
        for q in range(l_to.shape[0]):
            x[l_to[q]] -= lu[q] * x[l_by[q]]
    if plan.tail < n:
        _solve_tail(plan, factors, vector_at(x, 0, n))
    upper, known = np.uint64(l_to.shape[0]), np.uint64(n)
    if by_nodes:
        backward_by_columns(plan, factors)
    else:
        first, known = np.uint64(plan.u_tail), np.uint64(plan.tail)
        for k in range(known, np.uint64(n)):
            x[k] *= pivot_inv[k]
        if plan.tail < n:
            take_above(plan, factors)
        for p in range(first, np.uint64(u_to.shape[0])):
            k = u_by[p]
            x[u_to[p]] -= lu[upper + p] * (x[k] * pivot_inv[k])
    for k in range(ahead):
        x[k] = 0.0
    for k in range(np.uint64(ahead), known):
        out[col_to[k]] = x[k] * pivot_inv[k] * col_scale[k]
        x[k] = 0.0
    for k in range(known, np.uint64(n)):
        out[col_to[k]] = x[k] * col_scale[k]
        x[k] = 0.0
    if ahead > 0:
        modes_after(plan.groups, plan.mode_at, plan.column_at, factors.every, out)


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _MAT), cache=True, nogil=True, error_model="numpy")
def solve_pair(plan, factors, pair):
    """Solve for two right-hand sides at once.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        From `factor`.
    pair : ndarray, shape (4, n)
        Right-hand sides in the first two rows, overwritten by the solutions; the others are scratch.
    """
    lu, pivot_inv = factors.lu, factors.pivot_inv
    l_to, l_by, u_to, u_by = plan.l_to, plan.l_by, plan.u_to, plan.u_by
    n = pivot_inv.shape[0]
    for k in range(n):
        row, size = plan.row_from[k], plan.row_scale[k]
        pair[2, k] = pair[0, row] * size
        pair[3, k] = pair[1, row] * size
    for q in range(l_to.shape[0]):
        i, k, l = l_to[q], l_by[q], lu[q]
        pair[2, i] -= l * pair[2, k]
        pair[3, i] -= l * pair[3, k]
    if plan.tail < n:
        for m in range(2, 4):
            _solve_tail(plan, factors, pair[m])
    upper, last, by_nodes = np.uint64(l_to.shape[0]), u_to.shape[0] - 1, has_nodes(plan.node_end)
    for m in range(u_to.shape[0]):
        p = np.uint64(last - m if by_nodes else m)
        i, k, u = u_to[p], u_by[p], lu[upper + p]
        pair[2, i] -= u * (pair[2, k] * pivot_inv[k])
        pair[3, i] -= u * (pair[3, k] * pivot_inv[k])
    for k in range(n):
        size, to = plan.col_scale[k], plan.col_to[k]
        pair[0, to] = pair[2, k] * pivot_inv[k] * size
        pair[1, to] = pair[3, k] * pivot_inv[k] * size
