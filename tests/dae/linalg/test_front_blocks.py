"""Blocks of eight rows of a sparse LU against the rows that they are made of, and the multipliers in them."""

import numpy as np
import pytest
import scipy.sparse as sp

from gearmbs.dae.compiled.lanes import LANES
from gearmbs.dae.linalg.analyse import analyse
from gearmbs.dae.linalg.front_blocks import front_blocks
from gearmbs.dae.linalg.sparse_lu import GROWTH_LIMIT, factor, new_factors


@pytest.mark.parametrize("tail", [0, 5, 11, 40])
def test_rows_below_pivots_are_in_lists_or_blocks(tail):
    rng = np.random.default_rng(tail)
    n = 40
    below = [np.sort(rng.choice(np.arange(k + 1, n), min(k % 7, n - 1 - k), replace=False)) for k in range(n)]
    below = [rows if k < tail else rows[:0] for k, rows in enumerate(below)]
    l_ptr = np.concatenate(([0], np.cumsum([len(rows) for rows in below])))
    parts = front_blocks(tail, l_ptr, np.concatenate(below).astype(np.uint32))
    ptr, blocks = parts["l_ptr"], parts["block_ptr"]
    places = np.arange(len(parts["block_col"]))
    for k, rows in enumerate(below):
        np.testing.assert_array_equal(parts["l_pos"][ptr[k] : ptr[k + 1]], rows[rows < tail])
        own = slice(blocks[k], blocks[k + 1])
        at, lane = parts["block_at"][own], parts["block_lane"][own]
        np.testing.assert_array_equal(lane, np.unique((rows[rows >= tail] - tail) // LANES))
        np.testing.assert_array_equal(parts["block_col"][at], k)
        np.testing.assert_array_equal(np.searchsorted(parts["lane_ptr"], at, side="right") - 1, lane)
    np.testing.assert_array_equal(np.sort(parts["block_at"]), places)


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
    assert len(plan.block_at) > 0
    assert factor(plan, new_factors(plan), whole.data) < GROWTH_LIMIT
    first = int(plan.row_from[0]), int(plan.col_to[0])
    for pivot in (1e-9, np.nan):
        a[first] = pivot
        assert not factor(plan, new_factors(plan), sp.csc_array(a).data) <= GROWTH_LIMIT
