"""Several right-hand sides at once: solutions are those of the matrix."""

import numpy as np
import pytest

from gearmbs.dae.linalg.lu_plan import analyse
from gearmbs.dae.linalg.several import has_lanes, solve_lanes
from gearmbs.dae.linalg.sparse_lu import factor, new_factors
from gearmbs.kernels.lanes import LANES
from tests.dae.linalg.test_dense_tail import bordered, pattern
from tests.dae.linalg.test_schedule import sparse_matrix


@pytest.mark.parametrize("first", [0, 60])
def test_solutions_are_those_of_the_matrix(first):
    rng = np.random.default_rng(1)
    a = sparse_matrix(60, 0.02, 3)
    n = a.shape[0]
    plan = analyse(*pattern(a), np.ones(n))
    factors, scratch = new_factors(plan), np.zeros(n * LANES)
    for _ in range(2):
        factor(plan, factors, a.data)
        sides = rng.standard_normal((first + n, LANES))
        beside = sides[:first].copy()
        expected = np.linalg.solve(a.toarray(), sides[first:])
        solve_lanes(plan, factors, sides.ravel(), first, scratch)
        np.testing.assert_allclose(sides[first:], expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
        np.testing.assert_array_equal(sides[:first], beside)
        a.data = a.data * rng.uniform(0.9, 1.1, a.nnz)


@pytest.mark.parametrize("kind", ["levels", "tail", "nodes"])
def test_only_plans_by_levels_have_lanes(kind):
    a = {"levels": sparse_matrix(60, 0.02, 3), "tail": bordered(40, 32, 2), "nodes": sparse_matrix(30, 0.9, 4)}[kind]
    plan = analyse(*pattern(a), np.ones(a.shape[0]), with_tail=kind == "tail")
    assert has_lanes(plan) == (kind == "levels")
