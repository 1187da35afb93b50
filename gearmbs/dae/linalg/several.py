"""Solutions of one factorisation for several right-hand sides at once, which stand side by side in vector registers."""

from __future__ import annotations

import numpy as np
from numba import types

from gearmbs.dae.linalg.lu_plan import PLAN_TYPE
from gearmbs.dae.linalg.schedule import has_nodes
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE, solve
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, lanes_at, put_lanes

SIDES = LANES
"""Right-hand sides at a time. Of a pair's 115 unknowns eight take as long as two would one after the other."""


@njit(
    types.void(PLAN_TYPE, FACTORS_TYPE, types.Array(types.float64, 2, "C"), types.float64[::1]),
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def solve_sides(plan, factors, sides, x):
    """Solve for `SIDES` right-hand sides at once, which are overwritten by the solutions.

    Parameters
    ----------
    plan : LUPlan
        Those with nodes or a dense tail are solved one after the other.
    factors : LUFactors
        From `factor`.
    sides : ndarray, shape (SIDES, n)
    x : ndarray, shape (n SIDES,)
        Scratch.
    """
    lu, pivot_inv = factors.lu, factors.pivot_inv
    n = pivot_inv.shape[0]
    if has_nodes(plan.node_end) or plan.tail < n:
        for m in range(SIDES):
            solve(plan, factors, sides[m], sides[m])
        return
    l_to, l_by, u_to, u_by = plan.l_to, plan.l_by, plan.u_to, plan.u_by
    for k in range(n):
        row, size, to = plan.row_from[k], plan.row_scale[k], SIDES * k
        for m in range(SIDES):
            x[to + m] = sides[m, row] * size
    for q in range(l_to.shape[0]):
        to = l_to[q]
        put_lanes(x, to, lanes_at(x, to) - lu[q] * lanes_at(x, l_by[q]))
    upper = np.uint64(l_to.shape[0])
    for p in range(np.uint64(u_to.shape[0])):
        to, k = u_to[p], u_by[p]
        put_lanes(x, to, lanes_at(x, to) - (lu[upper + p] * pivot_inv[k]) * lanes_at(x, k))
    for k in range(n):
        size, to, at = pivot_inv[k] * plan.col_scale[k], plan.col_to[k], SIDES * k
        for m in range(SIDES):
            sides[m, to] = x[at + m] * size
