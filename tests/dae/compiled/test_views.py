"""Views are the slices they stand for, and see and make changes in the array."""

import numpy as np
from numba import njit

from gearmbs.kernels.structs import matrix_at, vector_at


@njit
def row_sums(a, first, rows, columns, out):
    table = matrix_at(a, first, rows, columns)
    for r in range(rows):
        out[r] = table[r].sum()
    table[rows - 1, columns - 1] = -1.0
    vector_at(a, first, 2)[1] = -2.0
    return table.shape, vector_at(a, first, columns).size


def test_views_are_slices():
    a, out = np.arange(30.0), np.zeros(3)
    assert row_sums(a, 5, 3, 4, out) == ((3, 4), 4)
    expected = np.arange(30.0)[5:17].reshape(3, 4)
    np.testing.assert_array_equal(out, expected.sum(axis=1))
    assert a[16] == -1.0
    assert a[6] == -2.0


def test_integers_and_nothing():
    @njit
    def last(a, n):
        return matrix_at(a, 2, n, 2).shape[0], vector_at(a, 4, 1)[0]

    assert last(np.arange(6), 0) == (0, 4)


def test_views_of_tables_count_along_the_rows():
    @njit
    def part(a):
        return vector_at(a, 3, 2)[1], matrix_at(a, 4, 2, 2)[1, 0]

    assert part(np.arange(12.0).reshape(4, 3)) == (4.0, 6.0)
