"""LU of eight matrices side by side against one at a time."""

import numpy as np
import pytest
import scipy.sparse as sp

from gearmbs.dae.linalg.lu_plan import analyse
from gearmbs.dae.linalg.sparse_lu import factor, factor_lanes, new_factors, new_lane_factors, solve, solve_lanes
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES


@njit(error_model="numpy")
def both(plan, factors, vals, growth, b, out):
    factor_lanes(plan, factors, vals, growth)
    solve_lanes(plan, factors, b, out)


@pytest.mark.parametrize(("n", "density"), [(1, 1.0), (7, 0.4), (40, 0.1), (60, 0.5)])
def test_each_lane_is_a_matrix_of_its_own(n, density):
    """The largest has nodes: there columns are eliminated together one at a time."""
    rng = np.random.default_rng(n)
    pattern = sp.random_array((n, n), density=density, rng=rng) + sp.eye_array(n)
    matrix = sp.csc_array(pattern)
    matrix.sort_indices()
    indptr, indices = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64)
    one = rng.uniform(0.5, 1.5, indices.size) + 3.0 * (indices == np.repeat(np.arange(n), np.diff(indptr)))
    vals = one[:, None] * rng.uniform(0.9, 1.1, (indices.size, LANES))
    plan = analyse(indptr, indices, one, np.ones(n))
    b = rng.standard_normal((n, LANES))
    growth, out = np.zeros(LANES), np.zeros((n, LANES))
    both(plan, new_lane_factors(plan), vals.ravel(), growth, b.ravel(), out.ravel())
    for lane in range(LANES):
        factors, x = new_factors(plan), np.zeros(n)
        assert factor(plan, factors, vals[:, lane].copy()) == pytest.approx(growth[lane], rel=1e-12)
        solve(plan, factors, b[:, lane].copy(), x)
        np.testing.assert_allclose(out[:, lane], x, rtol=1e-11, atol=1e-13)


def test_a_vanishing_pivot_is_told_of_its_lane_only():
    plan = analyse(np.array([0, 1, 2]), np.array([0, 1]), np.ones(2), np.ones(2))
    vals = np.ones((2, LANES))
    vals[1, 5] = 0.0
    growth, b = np.zeros(LANES), np.ones(2 * LANES)
    both(plan, new_lane_factors(plan), vals.ravel(), growth, b, np.zeros(2 * LANES))
    assert [not g <= 1e5 for g in growth] == [lane == 5 for lane in range(LANES)]


def test_a_dense_tail_is_refused():
    n = 40
    indptr, indices = np.arange(n + 1, dtype=np.int64) * n, np.tile(np.arange(n, dtype=np.int64), n)
    vals = (np.ones((n, n)) + n * np.eye(n)).ravel()
    with pytest.raises(ValueError, match="make it without"):
        new_lane_factors(analyse(indptr, indices, vals, np.ones(n), with_tail=True))
