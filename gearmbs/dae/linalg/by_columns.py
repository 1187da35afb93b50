"""Factors and substitutions column by column (left-looking), where columns are taken together as nodes."""

from __future__ import annotations

import numpy as np
from numba import int64

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import all_lanes
from gearmbs.dae.compiled.ordered_bits import bits_of, double_of
from gearmbs.dae.linalg.front_blocks import act_on_blocks, divide_blocks, factor_behind, fill_blocks
from gearmbs.dae.linalg.nodes import through_node


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
        top = max(top, bits_of(factor_behind(plan, factors, tail, grown)))
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
