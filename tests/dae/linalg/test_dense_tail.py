"""The dense tail of a sparse LU against the same matrix without one, and its limits."""

import numpy as np
import pytest
import scipy.sparse as sp

from gearmbs.dae.linalg.front_blocks import SMALLEST
from gearmbs.dae.linalg.lu_plan import analyse
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, factor, new_factors, solve, solve_pair


def bordered(front: int, tail: int, seed: int) -> sp.csc_array:
    """Return a matrix of a sparse front and a full block that every unknown of the front touches in two places."""
    rng = np.random.default_rng(seed)
    n = front + tail
    a = np.zeros((n, n))
    a[:front, :front] = np.diag(rng.uniform(2.0, 3.0, front))
    for k in range(front):
        near = front + rng.choice(tail, 2, replace=False)
        a[k, near], a[near, k] = rng.standard_normal((2, 2))
    a[front:, front:] = rng.standard_normal((tail, tail)) + tail * np.eye(tail)
    return sp.csc_array(a)


def pattern(a: sp.csc_array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    a.sort_indices()
    return a.indptr.astype(np.int64), a.indices.astype(np.int64), a.data


@pytest.mark.slow
@pytest.mark.parametrize("front", [0, 1, 70])
@pytest.mark.parametrize("tail", [24, 25, 26, 27, 32, 41, 64])
def test_solutions_are_those_of_the_matrix(front, tail):
    a, rng = bordered(front, tail, 100 * front + tail), np.random.default_rng(tail)
    n = a.shape[0]
    plan = analyse(*pattern(a), np.ones(n), with_tail=True)
    assert plan.tail <= front
    factors, x = new_factors(plan), np.empty(n)
    for _ in range(3):
        # the lower and upper triangles of one factorisation must not be left over in the next
        assert 0.0 < factor(plan, factors, a.data) < GROWTH_LIMIT
        b, pair = rng.standard_normal((2, n)), np.zeros((4, n))
        solve(plan, factors, b[0], x)
        expected = np.linalg.solve(a.toarray(), b.T).T
        np.testing.assert_allclose(x, expected[0], rtol=0.0, atol=1e-13 * np.abs(expected).max())
        pair[:2] = b
        solve_pair(plan, factors, pair)
        np.testing.assert_allclose(pair[:2], expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())
        a.data = a.data * rng.uniform(0.9, 1.1, a.nnz)


def test_multipliers_are_those_without_a_tail():
    a = bordered(40, 50, 1)
    grown = []
    for with_tail in (True, False):
        plan = analyse(*pattern(a), np.ones(90), with_tail=with_tail)
        assert (plan.tail < 90) == with_tail
        grown.append(factor(plan, new_factors(plan), a.data))
    assert grown[0] == pytest.approx(grown[1], rel=1e-12)


def test_small_and_sparse_matrices_have_no_tail():
    full = sp.csc_array(np.ones((SMALLEST - 1, SMALLEST - 1)) + 9.0 * np.eye(SMALLEST - 1))
    assert analyse(*pattern(full), np.ones(SMALLEST - 1), with_tail=True).tail == SMALLEST - 1
    n = 80
    band = sp.csc_array(sp.diags_array([1.0, 4.0, 1.0], offsets=[-1, 0, 1], shape=(n, n)))
    assert analyse(*pattern(band), np.ones(n), with_tail=True).tail == n


def test_a_pivot_that_vanishes_or_is_no_number_is_told():
    a = bordered(10, 30, 3)
    plan = analyse(*pattern(a), np.ones(40), with_tail=True)
    for pivot, value in ((plan.tail, np.nan), (plan.tail, 0.0), (39, 0.0)):
        changed = a.copy()
        column = int(plan.col_to[pivot])
        changed.data[changed.indptr[column] : changed.indptr[column + 1]] = value
        assert not factor(plan, new_factors(plan), changed.data) < GROWTH_LIMIT


def test_unknowns_set_aside_leave_no_tail():
    a = bordered(0, 40, 5).toarray()
    a[7], a[:, 3] = a[5], a[:, 11]
    plan = analyse(*pattern(sp.csc_array(a)), np.ones(40), drop=1e-8, with_tail=True)
    assert plan.kept.sum() < 40
    assert plan.tail == 40
