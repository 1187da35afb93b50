"""How near a curve over a mesh cycle is: noise of lines anywhere in it, and what harmonics beyond would add."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.signals.encoders.cycle import fall, missing_beyond, noise_within


@pytest.mark.parametrize("count", [1, 16, 64])
def test_noise_stays_below_what_is_told_in_as_many_cycles(count):
    """400 draws: 380 of 95 % +- 2 standard deviations of a binomial; Rice counts crossings, which is a bound."""
    rng, numbers = np.random.default_rng(1), np.arange(1, count + 1)
    variances = rng.uniform(0.5, 2.0, count)
    bound = noise_within(numbers, variances, 0.95)
    points = 16 * count
    lines = np.zeros((400, points // 2 + 1), dtype=complex)
    lines[:, 1 : count + 1] = np.sqrt(variances) * (
        rng.standard_normal((400, count)) + 1j * rng.standard_normal((400, count))
    )
    largest = np.abs(np.fft.irfft(0.5 * points * lines, points, axis=1)).max(axis=1)
    assert 380 - 9 <= np.count_nonzero(largest < bound) <= 398


@pytest.mark.parametrize("corners", [1, 2, 3])
def test_what_corners_lack_is_below_what_is_told(corners):
    """Polygons: lines are b/h^2 with b the jump of the slope by 2 pi^2, and a is of all corners together."""
    rng = np.random.default_rng(corners)
    jumps = rng.uniform(0.5, 1.5, corners) * (-1.0) ** np.arange(corners)
    places = np.sort(rng.uniform(0.0, 1.0, corners))
    numbers = np.arange(1, 2000)
    lines = (jumps @ np.exp(-2j * np.pi * np.outer(places, numbers))) / (2.0 * np.pi**2 * numbers**2)
    a = fall(numbers[:64], lines[:64], np.full(64, 1e-12))
    assert a == pytest.approx(np.abs(jumps).max() / (2.0 * np.pi**2), rel=0.3)
    for highest in (16, 32, 64):
        phase = np.arange(4000) / 4000
        rest = np.real(np.exp(2j * np.pi * np.outer(phase, numbers[highest:])) @ lines[highest:])
        assert np.abs(rest).max() < 1.2 * missing_beyond(a, highest, np.zeros(0, dtype=int))


def test_octaves_of_noise_alone_do_not_count():
    """Of one corner beside noise as large as its harmonic 30: as of that corner without noise."""
    rng, numbers = np.random.default_rng(0), np.arange(1, 201)
    noise = rng.standard_normal((2, 200)) / 900.0
    lines = 1.0 / numbers**2 + noise[0] + 1j * noise[1]
    assert fall(numbers, lines, np.full(200, 1.0 / 900.0**2)) == pytest.approx(1.0, rel=0.3)
    assert missing_beyond(4.0, 8, np.array([2, 20])) == pytest.approx(4.0 / 8 + 1.0)
