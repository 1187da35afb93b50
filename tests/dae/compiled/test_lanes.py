"""Eight numbers at a time: the arithmetic of numpy's on rows of eight."""

import numpy as np

from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES, all_lanes, bits_of, double_of, lanes_at, larger_number, magnitude, put_lanes


@njit(error_model="numpy")
def combine(a, out):
    x, y, z = lanes_at(a, 0), lanes_at(a, 1), lanes_at(a, 2)
    put_lanes(out, 0, x + y * z - x / y)
    put_lanes(out, 1, 2.0 * x - z * 0.5 + (1.0 - y) + 3.0 / x)
    put_lanes(out, 2, -magnitude(y))
    put_lanes(out, 3, all_lanes(a[0, 1]))
    total = all_lanes(0.0)
    for k in range(3):
        total += lanes_at(a, k)
    put_lanes(out, 4, total)


def test_arithmetic_is_that_of_each_number():
    a = np.random.default_rng(1).uniform(-2.0, 2.0, (3, LANES))
    out = np.zeros((5, LANES))
    combine(a, out)
    x, y, z = a
    np.testing.assert_array_equal(out[0], x + y * z - x / y)
    np.testing.assert_allclose(out[1], 2.0 * x - z * 0.5 + (1.0 - y) + 3.0 / x, rtol=1e-15)
    np.testing.assert_array_equal(out[2], -np.abs(y))
    assert (out[3] == a[0, 1]).all()
    np.testing.assert_array_equal(out[4], (x + y) + z)


@njit(error_model="numpy")
def compare(a, out):
    put_lanes(out, 0, larger_number(lanes_at(a, 0), lanes_at(a, 1)))


def test_the_larger_number_is_the_second_beside_nan():
    first, second = np.random.default_rng(2).uniform(-2.0, 2.0, (2, LANES))
    first[1] = second[4] = first[6] = second[6] = np.nan
    out = np.zeros((1, LANES))
    compare(np.array([first, second]), out)
    numbers = ~np.isnan(first) & ~np.isnan(second)
    np.testing.assert_array_equal(out[0], np.where(numbers, np.maximum(first, second), second))


@njit(error_model="numpy")
def largest(values):
    top = 0
    for value in values:
        top = max(top, bits_of(abs(value)))
    return double_of(top)


def test_bits_of_magnitudes_order_as_they_do():
    """With infinity above all numbers, and NaN above infinity."""
    numbers = np.array([0.5, -2.0, 0.0, 5e-324])
    assert largest(numbers) == 2.0
    assert largest(np.append(numbers, -np.inf)) == np.inf
    assert np.isnan(largest(np.append(numbers, [np.nan, np.inf])))
