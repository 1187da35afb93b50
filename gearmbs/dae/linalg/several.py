"""Solutions of one factorisation for several right-hand sides at once, which stand side by side in vector registers."""

from __future__ import annotations

import numpy as np

from gearmbs.dae.linalg.lu_plan import PLAN_TYPE, LUPlan
from gearmbs.dae.linalg.schedule import has_nodes
from gearmbs.dae.linalg.sparse_lu import FACTORS_TYPE
from gearmbs.kernels.jit import njit
from gearmbs.kernels.kinds import types
from gearmbs.kernels.lanes import lanes_at, put_lanes
from gearmbs.kernels.pointers import direct


def has_lanes(plan: LUPlan) -> bool:
    """Return whether a plan can be gone through for several sides at once: without nodes, a dense tail and modes."""
    return not (direct(has_nodes)(plan.node_end) or len(plan.groups)) and plan.tail == plan.row_from.shape[0]


@njit(
    types.void(PLAN_TYPE, FACTORS_TYPE, types.float64[::1], types.int64, types.float64[::1]),
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def solve_lanes(plan, factors, sides, first, x):
    """Solve for `LANES` right-hand sides at once, which are overwritten by the solutions.

    Of a pair's 115 unknowns they take as long as two would one after the other.

    Parameters
    ----------
    plan : LUPlan
        One that `has_lanes`.
    factors : LUFactors
        From `factor`.
    sides : ndarray
        Lanes of each equation, from place ``first`` of the table on.
    first : int
    x : ndarray, shape (n LANES,)
        Scratch.
    """
    lu, pivot_inv = factors.lu, factors.pivot_inv
    n = pivot_inv.shape[0]
    l_to, l_by, u_to, u_by = plan.l_to, plan.l_by, plan.u_to, plan.u_by
    for k in range(n):
        put_lanes(x, k, lanes_at(sides, first + plan.row_from[k]) * plan.row_scale[k])
    for q in range(l_to.shape[0]):
        to = l_to[q]
        put_lanes(x, to, lanes_at(x, to) - lu[q] * lanes_at(x, l_by[q]))
    upper = np.uint64(l_to.shape[0])
    for p in range(np.uint64(u_to.shape[0])):
        to, k = u_to[p], u_by[p]
        put_lanes(x, to, lanes_at(x, to) - (lu[upper + p] * pivot_inv[k]) * lanes_at(x, k))
    for k in range(n):
        put_lanes(sides, first + plan.col_to[k], lanes_at(x, k) * (pivot_inv[k] * plan.col_scale[k]))
