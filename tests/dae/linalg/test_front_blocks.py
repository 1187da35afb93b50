"""Blocks of eight rows of a sparse LU against the rows that they are made of, and the multipliers in them."""

import numpy as np
import pytest
import scipy.sparse as sp

from gearmbs.dae.linalg.front_blocks import front_blocks
from gearmbs.dae.linalg.lu_plan import analyse
from gearmbs.dae.linalg.schedule import has_nodes
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, factor, new_factors, solve
from gearmbs.kernels.lanes import LANES


@pytest.mark.parametrize("tail", [0, 5, 11, 40])
def test_rows_below_pivots_are_in_lists_or_blocks(tail):
    rng = np.random.default_rng(tail)
    n = 40
    below = [np.sort(rng.choice(np.arange(k + 1, n), min(k % 7, n - 1 - k), replace=False)) for k in range(n)]
    below = [rows if k < tail else rows[:0] for k, rows in enumerate(below)]
    l_ptr = np.concatenate(([0], np.cumsum([len(rows) for rows in below])))
    ptr, l_pos, _, block_col, lane_ptr, first, at_of, lane_of = front_blocks(
        tail, l_ptr, np.concatenate(below).astype(np.uint32)
    )
    places = np.arange(len(block_col))
    for k, rows in enumerate(below):
        np.testing.assert_array_equal(l_pos[ptr[k] : ptr[k + 1]], rows[rows < tail])
        own = slice(first[k], first[k + 1])
        at, lane = at_of[own], lane_of[own]
        np.testing.assert_array_equal(lane, np.unique((rows[rows >= tail] - tail) // LANES))
        np.testing.assert_array_equal(block_col[at], k)
        np.testing.assert_array_equal(np.searchsorted(lane_ptr, at, side="right") - 1, lane)
    np.testing.assert_array_equal(np.sort(at_of), places)


def blocks_and_border(count: int, size: int, border: int) -> sp.csc_array:
    """Return a matrix of full blocks on the diagonal, each of which touches two rows and columns of a full border."""
    rng = np.random.default_rng(size)
    n = count * size + border
    a = np.zeros((n, n))
    for k in range(count):
        own = slice(k * size, (k + 1) * size)
        a[own, own] = rng.standard_normal((size, size)) + size * np.eye(size)
        near = n - border + rng.choice(border, 2, replace=False)
        a[own, near] = rng.standard_normal((size, 2))
        a[near, own] = rng.standard_normal((2, size))
    a[-border:, -border:] = rng.standard_normal((border, border)) + border * np.eye(border)
    return sp.csc_array(a)


@pytest.mark.parametrize(("size", "in_nodes"), [(2, False), (5, False), (16, True)])
def test_blocks_are_eliminated_by_levels_and_by_nodes(size, in_nodes):
    a = blocks_and_border(96 // size, size, 45)
    n = a.shape[0]
    plan = analyse(a.indptr.astype(np.int64), a.indices.astype(np.int64), a.data, np.ones(n), with_tail=True)
    assert 0 < plan.tail < n
    assert has_nodes(plan.node_end) == in_nodes
    factors, x, rng = new_factors(plan), np.empty(n), np.random.default_rng(7)
    for _ in range(3):
        assert factor(plan, factors, a.data) < GROWTH_LIMIT
        b = rng.standard_normal(n)
        solve(plan, factors, b, x)
        expected = np.linalg.solve(a.toarray(), b)
        np.testing.assert_allclose(x, expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())
        a.data = a.data * rng.uniform(0.9, 1.1, a.nnz)


def test_what_is_no_number_does_not_outlive_its_right_hand_side():
    a = blocks_and_border(20, 2, 45)
    n = a.shape[0]
    plan = analyse(a.indptr.astype(np.int64), a.indices.astype(np.int64), a.data, np.ones(n), with_tail=True)
    factors, x = new_factors(plan), np.empty(n)
    factor(plan, factors, a.data)
    solve(plan, factors, np.full(n, np.nan), x)
    solve(plan, factors, np.ones(n), x)
    np.testing.assert_allclose(a @ x, np.ones(n), rtol=1e-12)
    assert np.isfinite(factors.rest).all()


def test_a_multiplier_that_grows_in_a_block_is_told():
    n, front = 60, 30
    rng = np.random.default_rng(1)
    a = np.diag(np.full(n, 3.0))
    a[front:, front:] += rng.standard_normal((n - front, n - front)) + n * np.eye(n - front)
    a[front:, :front] = 0.1
    whole = sp.csc_array(a)
    pattern = whole.indptr.astype(np.int64), whole.indices.astype(np.int64)
    plan = analyse(*pattern, whole.data, np.ones(n), with_tail=True)
    assert 0 < plan.tail <= front
    assert len(plan.block_col) > 0
    assert factor(plan, new_factors(plan), whole.data) < GROWTH_LIMIT
    first = int(plan.row_from[0]), int(plan.col_to[0])
    for pivot in (1e-9, np.nan):
        a[first] = pivot
        assert not factor(plan, new_factors(plan), sp.csc_array(a).data) <= GROWTH_LIMIT
