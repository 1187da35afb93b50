"""Convolution by pieces of the Fourier transform against the sum itself."""

import numpy as np
import pytest

from gearmbs.signals.filters import convolve_valid
from gearmbs.signals.resampling import products


@pytest.mark.parametrize(
    ("n", "m", "every"),
    [(1000, 33, 1), (1000, 33, 8), (33, 33, 8), (40, 33, 4), (5000, 129, 3), (4097, 257, 16), (34, 33, 64)],
)
def test_every_so_many_th_sample_of_a_convolution(n, m, every):
    rng = np.random.default_rng(n + every)
    values, taps = rng.standard_normal(n), rng.standard_normal(m)
    found = convolve_valid(values, taps, every)
    np.testing.assert_allclose(found, np.convolve(values, taps, "valid")[::every], atol=1e-11)
    compiled = np.empty(found.size)
    products(values, np.ascontiguousarray(taps[::-1]), every, compiled)
    np.testing.assert_allclose(compiled, found, atol=1e-11)
