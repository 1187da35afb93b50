"""Runs that creep without getting anywhere are ended; slow ones are not."""

import numpy as np
import pytest

from gearmbs.dae.integrators.stall import HOPELESS, WINDOW, StallWatch


def test_a_run_that_creeps_is_stalled_after_two_windows():
    watch = StallWatch(0, 0.0)
    assert watch.steps_needed(WINDOW - 1, 1e-10, 1.0) == 0.0
    assert watch.steps_needed(WINDOW, 1e-10, 1.0) == 0.0
    needed = watch.steps_needed(2 * WINDOW, 2e-10, 1.0)
    assert needed == pytest.approx(WINDOW / 1e-10, rel=1e-6)
    assert watch.progress == pytest.approx(1e-10)


def test_the_bound_is_what_a_machine_can_keep():
    """Of a deck that spins up: 50 000 steps of 8e-13 s each on the way to 0.05 s."""
    watch = StallWatch(150_000, 1.09e-5, progress=1.7e-7)
    assert watch.steps_needed(200_000, 1.09e-5 + 4.0e-8, 0.05) == pytest.approx(6.2e10, rel=0.01)


def test_a_run_without_any_progress_is_stalled():
    watch = StallWatch(0, 0.0, progress=1e-12)
    assert watch.steps_needed(WINDOW, 0.0, 1.0) == np.inf


def test_steps_that_grow_are_not():
    """A start with steps of 1e-20 of the span that grow by a ten-thousandth each is left alone."""
    watch = StallWatch(0, 0.0)
    t, h = 0.0, 1e-20
    for window in range(1, 8):
        t += h * WINDOW
        h *= np.exp(1e-4 * WINDOW)
        assert watch.steps_needed(window * WINDOW, t, 1.0) == 0.0


def test_a_long_run_is_not():
    """A tenth of the hopeless number of steps may be what somebody wants."""
    watch = StallWatch(0, 0.0)
    h = 10.0 / HOPELESS
    assert not any(watch.steps_needed(k * WINDOW, k * WINDOW * h, 1.0) for k in range(1, 5))
