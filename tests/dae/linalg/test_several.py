"""Several right-hand sides at once: solutions are those of the matrix, whatever the plan eliminates by."""

import numpy as np
import pytest

from gearmbs.dae.linalg.lu_plan import analyse
from gearmbs.dae.linalg.several import SIDES, solve_sides
from gearmbs.dae.linalg.sparse_lu import factor, new_factors
from tests.dae.linalg.test_dense_tail import bordered, pattern
from tests.dae.linalg.test_schedule import sparse_matrix


@pytest.mark.parametrize("kind", ["levels", "tail", "nodes"])
def test_solutions_are_those_of_the_matrix(kind):
    rng = np.random.default_rng(1)
    a = {"levels": sparse_matrix(60, 0.02, 3), "tail": bordered(40, 32, 2), "nodes": sparse_matrix(30, 0.9, 4)}[kind]
    n = a.shape[0]
    plan = analyse(*pattern(a), np.ones(n), with_tail=kind == "tail")
    assert (plan.tail < n) == (kind == "tail")
    factors, scratch = new_factors(plan), np.zeros(n * SIDES)
    for _ in range(2):
        factor(plan, factors, a.data)
        sides = rng.standard_normal((SIDES, n))
        expected = np.linalg.solve(a.toarray(), sides.T).T
        solve_sides(plan, factors, sides, scratch)
        np.testing.assert_allclose(sides, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
        a.data = a.data * rng.uniform(0.9, 1.1, a.nnz)
