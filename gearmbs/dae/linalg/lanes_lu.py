"""Sparse LU of eight matrices of one plan side by side; see `gearmbs.dae.linalg.sparse_lu` for one at a time."""

from __future__ import annotations

import numpy as np

from gearmbs._jit import njit
from gearmbs.dae.compiled.lanes import LANES, all_lanes, lanes_at, larger, magnitude, put_lanes
from gearmbs.dae.compiled.structs import Struct, Vector
from gearmbs.dae.linalg.lu_plan import LUPlan


class LaneFactors(Struct):
    """Numbers of eight factorisations, as of `gearmbs.dae.linalg.sparse_lu.LUFactors`, in lanes."""

    l_vals: Vector
    u_vals: Vector
    pivot_inv: Vector
    x: Vector


def new_lane_factors(plan: LUPlan) -> LaneFactors:
    """Return empty factors for a plan without a dense tail."""
    n = len(plan.row_from)
    if plan.tail < n:
        raise ValueError("the plan has a dense tail; make it without")
    return LaneFactors(
        l_vals=np.zeros(LANES * len(plan.l_pos)),
        u_vals=np.zeros(LANES * len(plan.u_pos)),
        pivot_inv=np.zeros(LANES * n),
        x=np.zeros(LANES * n),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def factor_lanes(plan, factors, vals, growth):
    """Factor eight matrices along a plan from which no unknown was dropped.

    Parameters
    ----------
    plan : LUPlan
    factors : LaneFactors
        Overwritten.
    vals : ndarray, shape (LANES nnz,)
        Their values in CSC order, in lanes.
    growth : ndarray, shape (LANES,)
        Written: what `gearmbs.dae.linalg.sparse_lu.factor` returns of each.
    """
    x, l_vals, u_vals, pivot_inv = factors.x, factors.l_vals, factors.u_vals, factors.pivot_inv
    l_ptr, l_pos, u_ptr, u_pos = plan.l_ptr, plan.l_pos, plan.u_ptr, plan.u_pos
    a_ptr, a_pos, a_src, a_scale = plan.a_ptr, plan.a_pos, plan.a_src, plan.a_scale
    grown, zero = all_lanes(0.0), all_lanes(0.0)
    for k in range(pivot_inv.size // LANES):
        for p in range(a_ptr[k], a_ptr[k + 1]):
            put_lanes(x, a_pos[p], lanes_at(vals, a_src[p]) * a_scale[p])
        for p in range(u_ptr[k], u_ptr[k + 1]):
            j = u_pos[p]
            u = lanes_at(x, j)
            put_lanes(x, j, zero)
            put_lanes(u_vals, p, u)
            for q in range(l_ptr[j], l_ptr[j + 1]):
                put_lanes(x, l_pos[q], lanes_at(x, l_pos[q]) - lanes_at(l_vals, q) * u)
        inverse = 1.0 / lanes_at(x, k)
        put_lanes(x, k, zero)
        put_lanes(pivot_inv, k, inverse)
        # a pivot of zero must tell even if nothing is below it
        grown = larger(grown, 0.0 * inverse)
        for q in range(l_ptr[k], l_ptr[k + 1]):
            l = lanes_at(x, l_pos[q]) * inverse
            put_lanes(x, l_pos[q], zero)
            put_lanes(l_vals, q, l)
            grown = larger(grown, magnitude(l))
    left_src, left_limit = plan.left_src, plan.left_limit
    over = all_lanes(-np.inf)
    for p in range(left_src.size):
        over = larger(over, magnitude(lanes_at(vals, left_src[p])) - left_limit[p])
    put_lanes(growth, 0, over)
    for lane in range(LANES):
        # what is not a number counts, too
        fits = growth[lane] <= 0.0
        growth[lane] = 0.0 if fits else np.inf
    put_lanes(growth, 0, lanes_at(growth, 0) + grown)


@njit(cache=True, error_model="numpy", forceinline=True)
def solve_lanes(plan, factors, b, out):
    """Write the solutions of eight systems, in lanes; ``out`` may be ``b`` itself."""
    x, l_vals, u_vals, pivot_inv = factors.x, factors.l_vals, factors.u_vals, factors.pivot_inv
    l_pos, l_col, u_pos, u_col = plan.l_pos, plan.l_col, plan.u_pos, plan.u_col
    n = pivot_inv.size // LANES
    for k in range(n):
        put_lanes(x, k, lanes_at(b, plan.row_from[k]) * plan.row_scale[k])
    for q in range(l_pos.size):
        put_lanes(x, l_pos[q], lanes_at(x, l_pos[q]) - lanes_at(l_vals, q) * lanes_at(x, l_col[q]))
    last = u_pos.size - 1
    for m in range(u_pos.size):
        p = last - m
        k = u_col[p]
        scaled = lanes_at(x, k) * lanes_at(pivot_inv, k)
        put_lanes(x, u_pos[p], lanes_at(x, u_pos[p]) - lanes_at(u_vals, p) * scaled)
    for k in range(n):
        put_lanes(out, plan.col_to[k], lanes_at(x, k) * lanes_at(pivot_inv, k) * plan.col_scale[k])
        put_lanes(x, k, all_lanes(0.0))
