"""Sines and cosines of eight angles at a time: those of the library to an ulp of one."""

import numpy as np
import pytest

from gearmbs.dae.equations.rotation import FARTHEST_ANGLE, put_turns
from gearmbs.kernels.jit import njit
from gearmbs.kernels.lanes import LANES


@njit(error_model="numpy")
def turns(y, first, second, out):
    put_turns(y, first, second, out)


def turned(angles):
    out = np.zeros(2 * LANES)
    turns(np.asarray(angles, dtype=float), 0, 3, out)
    return out[:6], out[LANES : LANES + 6]


def exact(angles):
    """Return sines and cosines in extended precision; in double those of numpy may be off by 4 ulp (AVX-512)."""
    longer = np.asarray(angles, dtype=np.longdouble)
    return np.sin(longer), np.cos(longer)


@pytest.mark.parametrize("largest", [1e-8, 0.8, 1.6, 10.0, 1000.0, FARTHEST_ANGLE / 6.0])
def test_sines_and_cosines_are_right_to_an_ulp_of_one(largest):
    draw = np.random.default_rng(3)
    for _ in range(200):
        angles = draw.uniform(-largest, largest, 6)
        sine, cosine = turned(angles)
        expected = exact(angles)
        assert np.abs(sine - expected[0]).max() <= 2.0**-53 * 1.01
        assert np.abs(cosine - expected[1]).max() <= 2.0**-53 * 1.01


def test_small_angles_keep_all_their_digits():
    angles = np.array([0.0, 1e-300, 1e-20, -3e-9, 1e-3, -0.1])
    sine, cosine = turned(angles)
    expected = exact(angles)
    np.testing.assert_allclose(sine, expected[0], rtol=2.3e-16)
    np.testing.assert_allclose(cosine, expected[1], rtol=2.3e-16)
    assert sine[0] == 0.0
    assert cosine[0] == 1.0


def test_whole_quarter_turns():
    angles = 0.5 * np.pi * np.array([1.0, -1.0, 2.0, -3.0, 4.0, 4001.0])
    sine, cosine = turned(angles)
    expected = exact(angles)
    np.testing.assert_allclose(sine, expected[0], rtol=0.0, atol=1.2e-16)
    np.testing.assert_allclose(cosine, expected[1], rtol=0.0, atol=1.2e-16)


@pytest.mark.parametrize("far", [1e6, -1e300, np.inf, np.nan])
def test_far_angles_are_those_of_the_library(far):
    angles = np.array([0.1, far, 2.0, 3.0, far, -1.0])
    with np.errstate(invalid="ignore"):
        expected = exact(angles)
    sine, cosine = turned(angles)
    np.testing.assert_allclose(sine, expected[0], rtol=1e-15)
    np.testing.assert_allclose(cosine, expected[1], rtol=1e-15)
