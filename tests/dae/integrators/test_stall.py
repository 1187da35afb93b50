"""Runs that creep without getting anywhere are ended; slow ones are not."""

import numpy as np
import pytest
from numba import njit

from gearmbs.dae.integrators.driver import HOPELESS, WINDOW, StallWatch
from gearmbs.dae.result import Status
from gearmbs.dae.solve import solve_dae


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


def sliding(t, y, yp, out):
    out[0] = yp[0] + 2.0 * np.sign(y[0]) - np.sin(t)


def belt(t, y, yp, out):
    """A mass on a spring and on a belt that runs at 1, with dry friction."""
    out[0] = yp[0] - y[1]
    out[1] = yp[1] + y[0] + 10.0 * np.sign(y[1] - 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize(
    ("equations", "start", "named"), [(sliding, [1.0], "y[0] = "), (belt, [0.0, 0.0], "y[1] = 1:")]
)
def test_a_solution_that_stays_on_a_jump_is_noticed(equations, start, named, method):
    """It would take 1e9 steps and more; it has to be seen after some ten thousand."""
    result = solve_dae(njit(equations), (0.0, 10.0), start, rtol=1e-6, method=method)
    assert result.status is Status.STALLED
    assert result.stats.steps < 200_000
    assert f"jump at {named}" in result.message
    assert "tanh(y/width)" in result.message


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("width", [1e-3, 1e-4, 1e-5, 1e-6])
def test_the_same_jump_with_a_width_runs(width, method):
    """From 0.582 s on y = width artanh(sin t / 2)."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] + 2.0 * np.tanh(y[0] / width) - np.sin(t)

    result = solve_dae(residual, (0.0, 10.0), [1.0], rtol=1e-6, method=method)
    assert result.success, result.message
    assert result.y[-1, 0] == pytest.approx(width * np.arctanh(0.5 * np.sin(10.0)), abs=1e-2 * width + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
def test_vibrations_and_impacts_are_not(method):
    """A vibration of 3000 periods, and a ball on a stiff floor."""

    @njit
    def vibration(t, y, yp, out):
        out[0] = yp[0] - 1e4 * y[1]
        out[1] = yp[1] + 1e4 * y[0]

    @njit
    def ball(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = yp[1] + 9.81 - 1e9 * max(-y[0], 0.0) ** 1.5

    assert solve_dae(vibration, (0.0, 2.0), [1.0, 0.0], rtol=1e-6, method=method).success
    assert solve_dae(ball, (0.0, 60.0), [0.05, 0.0], rtol=1e-6, method=method).success


def test_a_long_run_is_not():
    """A tenth of the hopeless number of steps may be what somebody wants."""
    watch = StallWatch(0, 0.0)
    h = 10.0 / HOPELESS
    assert not any(watch.steps_needed(k * WINDOW, k * WINDOW * h, 1.0) for k in range(1, 5))
