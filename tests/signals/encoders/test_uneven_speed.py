"""Which records turn evenly enough for hidden mesh harmonics to be taken out of those below."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs import signals
from gearmbs.signals.encoders.visible import EVEN, unevenness


def train(lines: int, swing: float, order: float, turns: int = 60, marks: float = 0.01):
    """Return pulses of a disc with uneven marks whose speed swings: time over angle to the first order."""
    numbers = np.arange(lines * turns)
    errors = marks / lines * np.random.default_rng(lines).standard_normal(lines)
    angle = 2.0 * np.pi * (numbers / lines + errors[numbers % lines])
    times = (angle + swing / order * np.cos(order * angle)) / 30.0
    return signals.pulse_train(times, lines)


@pytest.mark.parametrize("lines", [60, 100, 256, 1024])
@pytest.mark.parametrize("order", [0.31, 1.0])
def test_the_swing_of_the_speed_is_found_beside_uneven_marks(lines, order):
    assert unevenness(train(lines, 0.0, order)) < 0.8 * EVEN
    assert unevenness(train(lines, 0.01, order)) == pytest.approx(0.01 / np.sqrt(2.0), rel=0.2)
