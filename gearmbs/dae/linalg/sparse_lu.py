"""Sparse LU for a fixed pattern: numeric factorisations replayed along a plan without search.

`factor` replays the plan of `gearmbs.dae.linalg.lu_plan` column by column (left-looking), `solve` applies it. Pivots
stay frozen until a multiplier grows beyond `GROWTH_LIMIT`, a pivot vanishes, or an entry that was left out of the plan
counts; then the caller analyses again with the current values.
"""

from __future__ import annotations

import numpy as np
from numba import float64, types

from gearmbs._jit import njit
from gearmbs.dae.compiled.structs import Struct, Vector
from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, LUPlan
from gearmbs.dae.linalg.nodes import through_node

GROWTH_LIMIT = 1e5

_VEC = float64[::1]
_MAT = float64[:, ::1]


class LUFactors(Struct):
    """Numbers of one factorisation: L below its unit diagonal, U above its diagonal, inverse pivots, scratch."""

    l_vals: Vector
    u_vals: Vector
    pivot_inv: Vector
    x: Vector
    w: Vector


FACTORS_TYPE = LUFactors.numba_type


def new_factors(plan: LUPlan) -> LUFactors:
    """Return empty factors for a plan."""
    n = len(plan.row_from)
    return LUFactors(
        l_vals=np.zeros(len(plan.l_pos)),
        u_vals=np.zeros(len(plan.u_pos)),
        pivot_inv=np.zeros(n),
        x=np.zeros(n),
        w=np.zeros(n),
    )


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
    left_src, left_limit = plan.left_src, plan.left_limit
    for p in range(left_src.shape[0]):
        if not abs(vals[left_src[p]]) <= left_limit[p]:
            return np.inf
    x, w = factors.x, factors.w
    l_vals = factors.l_vals
    u_vals = factors.u_vals
    l_pos = plan.l_pos
    l_ptr, node_end = plan.l_ptr, plan.node_end
    u_pos = plan.u_pos
    growth = 0.0
    n = x.shape[0]
    for k in range(n):
        for p in range(np.uint64(plan.a_ptr[k]), np.uint64(plan.a_ptr[k + 1])):
            x[plan.a_pos[p]] = vals[plan.a_src[p]] * plan.a_scale[p]
        p, last = np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])
        while p < last:
            j = np.uint64(u_pos[p])
            end = node_end[j]
            if end - np.int64(j) == 1:
                u = x[j]
                x[j] = 0.0
                u_vals[p] = u
                p += np.uint64(1)
                if u != 0.0:
                    for q in range(np.uint64(l_ptr[j]), np.uint64(l_ptr[j + np.uint64(1)])):
                        x[l_pos[q]] -= l_vals[q] * u
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
            through_node(np.int64(j), np.int64(stop), np.int64(size), l_ptr, l_vals, w)
            for i in range(stop - j):
                u_vals[p + i] = w[i]
            for i in range(stop - j, rows):
                x[j + i] = w[i]
            for i in range(size - rows):
                x[l_pos[below + i]] += w[rows + i]
            p += stop - j
        pivot = x[k]
        x[k] = 0.0
        if plan.kept[k] == 0.0:
            factors.pivot_inv[k] = 0.0
            x[:] = 0.0
            continue
        if pivot == 0.0:
            return np.inf
        inv = 1.0 / pivot
        factors.pivot_inv[k] = inv
        for q in range(np.uint64(l_ptr[k]), np.uint64(l_ptr[k + 1])):
            i = l_pos[q]
            l = x[i] * inv
            x[i] = 0.0
            l_vals[q] = l
            if not abs(l) <= growth:
                growth = abs(l)
    return growth


@njit(types.void(PLAN_TYPE, FACTORS_TYPE, _VEC, _VEC), cache=True, nogil=True, error_model="numpy")
def solve(plan, factors, b, out):
    """Write the solution of A out = b; ``out`` may be ``b`` itself.

    Parameters
    ----------
    plan : LUPlan
    factors : LUFactors
        From `factor`.
    b, out : ndarray, shape (n,)
    """
    x, w = factors.x, factors.w
    l_vals = factors.l_vals
    u_vals = factors.u_vals
    l_pos, l_ptr, node_end = plan.l_pos, plan.l_ptr, plan.node_end
    u_pos = plan.u_pos
    n = x.shape[0]
    for k in range(n):
        x[k] = b[plan.row_from[k]] * plan.row_scale[k]
    k = 0
    while k < n:
        end = node_end[k]
        if end - k == 1:
            v = x[k]
            if v != 0.0:
                for q in range(np.uint64(l_ptr[k]), np.uint64(l_ptr[k + 1])):
                    x[l_pos[q]] -= l_vals[q] * v
        else:
            first, rows, below = np.uint64(k), np.uint64(end - k), np.uint64(l_ptr[end - 1])
            size = rows + np.uint64(l_ptr[end]) - below
            for i in range(rows):
                w[i] = x[first + i]
            for i in range(rows, size):
                w[i] = 0.0
            through_node(k, end, np.int64(size), l_ptr, l_vals, w)
            for i in range(rows):
                x[first + i] = w[i]
            for i in range(size - rows):
                x[l_pos[below + i]] += w[rows + i]
        k = end
    for m in range(n):
        k = n - 1 - m
        v = x[k] * factors.pivot_inv[k]
        out[plan.col_to[k]] = v * plan.col_scale[k]
        x[k] = 0.0
        if v != 0.0:
            for p in range(np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])):
                x[u_pos[p]] -= u_vals[p] * v


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
    l_vals, u_vals = factors.l_vals, factors.u_vals
    l_pos, u_pos = plan.l_pos, plan.u_pos
    n = factors.x.shape[0]
    for k in range(n):
        row, size = plan.row_from[k], plan.row_scale[k]
        pair[2, k] = pair[0, row] * size
        pair[3, k] = pair[1, row] * size
    for k in range(n):
        v, w = pair[2, k], pair[3, k]
        for q in range(np.uint64(plan.l_ptr[k]), np.uint64(plan.l_ptr[k + 1])):
            pair[2, l_pos[q]] -= l_vals[q] * v
            pair[3, l_pos[q]] -= l_vals[q] * w
    for m in range(n):
        k = n - 1 - m
        inv, size, to = factors.pivot_inv[k], plan.col_scale[k], plan.col_to[k]
        v, w = pair[2, k] * inv, pair[3, k] * inv
        pair[0, to] = v * size
        pair[1, to] = w * size
        for p in range(np.uint64(plan.u_ptr[k]), np.uint64(plan.u_ptr[k + 1])):
            pair[2, u_pos[p]] -= u_vals[p] * v
            pair[3, u_pos[p]] -= u_vals[p] * w
