"""Which peaks of a run-up are clear, and where they stand, on lines whose resonance is known."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.run_ups import LAG, RANGE, TURNS, WITHIN, clear_peaks, place, planned

SPEED = np.linspace(800.0, 1400.0, 2001)


def line(ratio, at=1100.0):
    """One degree of freedom, excited by its base: 1 far below the resonance."""
    r = SPEED / at
    return 1.0 / np.hypot(1.0 - r**2, 2.0 * ratio * r)


@pytest.mark.parametrize("ratio", [0.01, 0.03])
def test_a_resonance_is_clear_and_stands_where_it_is(ratio):
    level = line(ratio)
    (peak,) = clear_peaks(level, np.full(SPEED.size, 1e-3), level.max())
    assert place(SPEED, level, peak) == pytest.approx(1100.0 * np.sqrt(1.0 - 2.0 * ratio**2), rel=ratio**2 + 1e-3)


def test_what_is_low_small_or_noisy_is_not_clear():
    level, quiet = line(0.02), np.full(SPEED.size, 1e-3)
    # with a damping ratio of 0.4 it rises by 3 dB
    assert not clear_peaks(line(0.4), quiet, line(0.4).max()).size
    assert not clear_peaks(level, quiet, 11.0 * level.max()).size
    assert not clear_peaks(level, 0.11 * level, level.max()).size


def test_a_run_up_is_as_slow_as_the_mode_that_rings_longest_and_a_window_need():
    crossings = pd.DataFrame(
        {"speed_rpm": [1000.0, 1100.0], "frequency_hz": [400.0, 300.0], "gain": [3.0, 1.5], "mode": [1, 2]}
    )
    slow, fast, rate, whole = planned(crossings, {1: 0.02, 2: 0.005})
    assert (slow, fast) == (RANGE[0] * 1000.0, RANGE[1] * 1000.0)
    # twice the time constant of the second, at this rate
    assert 2.0 / (2.0 * np.pi * 0.005 * 300.0) * rate == pytest.approx(LAG)
    assert whole * rate == pytest.approx(np.log(fast / slow))
    assert planned(crossings, {1: 0.9, 2: 0.9})[2] == pytest.approx(WITHIN * slow / 60.0 / TURNS)
    assert planned(crossings[crossings.gain > 5.0], {})[3] == np.inf
