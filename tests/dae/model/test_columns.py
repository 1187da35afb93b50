"""Matrices by columns against full ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array

from gearmbs.dae.model.columns import DENSE_SYSTEM, Columns


def columns_of(full: np.ndarray) -> Columns:
    matrix = csc_array(full)
    return Columns(matrix.data, matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64), matrix.shape)


def random_full(n: int) -> np.ndarray:
    generator = np.random.default_rng(7)
    full = generator.standard_normal((n, n)) * (generator.random((n, n)) < 0.3)
    full[np.arange(n), np.arange(n)] = 4.0
    full[:, 2] = 0.0
    full[[2, 5], 2] = 1.0
    return full


def test_parts_are_those_of_the_full_matrix():
    full = random_full(12)
    full[7] = 0.0
    full[:, 4] = 0.0
    matrix, rows = columns_of(full), np.array([0, 7, 8, 11])
    np.testing.assert_array_equal(matrix.toarray(), full)
    np.testing.assert_array_equal(matrix.sparse().toarray(), full)
    np.testing.assert_array_equal(matrix.below(5, 9).toarray(), full[5:, :9])
    np.testing.assert_array_equal(matrix.below(12, 12).toarray(), full[12:])
    np.testing.assert_array_equal(matrix.chosen(rows).toarray(), full[rows])
    np.testing.assert_array_equal(matrix.entries(8, np.array([1, 2, 9])), full[8, [1, 2, 9]])


@pytest.mark.parametrize("n", [9, DENSE_SYSTEM + 1])
def test_systems_in_units_of_any_size_are_solved(n):
    """Rows and columns from 1e-9 to 1e9: as well as with all of one size."""
    sizes = 10.0 ** np.random.default_rng(3).uniform(-9.0, 9.0, (2, n))
    full, x = random_full(n), np.random.default_rng(4).standard_normal(n)
    rhs = full @ x
    bound = 100.0 * n * np.finfo(float).eps * np.linalg.cond(full)
    found = columns_of(sizes[0][:, None] * full * sizes[1]).solved(sizes[0] * rhs) * sizes[1]
    np.testing.assert_allclose(found, x, rtol=0.0, atol=bound)


@pytest.mark.parametrize("n", [6, DENSE_SYSTEM + 1])
def test_a_singular_system_has_no_finite_solution(n):
    full = random_full(n)
    full[:, 3] = 0.0
    assert not np.isfinite(columns_of(full).solved(np.ones(n))).any()
