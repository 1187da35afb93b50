"""Runs as a whole: outputs, restart, interruption, coordinate changes, repeatability."""

import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from gearmbs.dae.integrators import driver as run
from gearmbs.dae.integrators import initial_state
from gearmbs.dae.integrators.options import Options
from gearmbs.dae.integrators.wstiff import resume, solve_wstiff
from gearmbs.dae.linalg.lu_plan import _unscaled_plan
from gearmbs.dae.problem import JACOBIAN_SIG, RESIDUAL_SIG, DAEProblem
from gearmbs.dae.result import Status
from gearmbs.dae.solve import solve_dae
from tests.dae.integrators.problems import pendulum, rotor
from tests.says import says

TIMES = np.linspace(0.0, 3.0, 61)


def assert_same(a, b):
    np.testing.assert_array_equal(a.t, b.t)
    np.testing.assert_array_equal(a.y, b.y)
    np.testing.assert_array_equal(a.yp, b.yp)
    np.testing.assert_array_equal(a.stats.t_steps, b.stats.t_steps)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
def test_same_run_twice_is_bit_identical(method):
    assert_same(*(solve_wstiff(pendulum(), TIMES, tol=1e-7, method=method) for _ in range(2)))


def test_runs_before_do_not_show():
    released, thrown = pendulum(), pendulum()
    thrown.y0[3], thrown.yp0[:2] = 1.5, (0.0, 1.5)
    _unscaled_plan.cache_clear()
    first = solve_wstiff(released, TIMES, tol=1e-7)
    other = solve_wstiff(thrown, TIMES, tol=1e-7)
    assert_same(first, solve_wstiff(released, TIMES, tol=1e-7))
    _unscaled_plan.cache_clear()
    assert_same(other, solve_wstiff(thrown, TIMES, tol=1e-7))


def test_chunking_does_not_show(monkeypatch):
    whole = solve_wstiff(pendulum(), TIMES, tol=1e-7)
    monkeypatch.setattr(run, "FIRST_CHUNK", 1)
    monkeypatch.setattr(run, "CHUNK_SECONDS", 0.0)
    monkeypatch.setattr(initial_state, "RECORD_BYTES", 0)
    assert_same(whole, solve_wstiff(pendulum(), TIMES, tol=1e-7))


def test_threads_give_the_same_result():
    expected = solve_wstiff(pendulum(), TIMES, tol=1e-8)
    results = [None] * 3

    def work(i):
        results[i] = solve_wstiff(pendulum(), TIMES, tol=1e-8)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for result in results:
        assert_same(expected, result)


@pytest.mark.slow
def test_the_loop_releases_the_gil():
    """While a run is inside the compiled loop another thread goes on counting."""
    long_chunk = 2_000_000
    ticks = []
    stop = threading.Event()

    def count():
        while not stop.wait(0.002):
            ticks.append(1)

    thread = threading.Thread(target=count)
    saved = run.FIRST_CHUNK
    run.FIRST_CHUNK = long_chunk
    try:
        thread.start()
        result = solve_wstiff(pendulum(), np.array([0.0, 4000.0]), tol=1e-9)
    finally:
        stop.set()
        thread.join()
        run.FIRST_CHUNK = saved
    assert result.success
    assert result.stats.wall_time > 0.05
    assert len(ticks) > 5


def test_ctrl_c_keeps_what_was_computed_and_resumes_bit_identically(monkeypatch):
    before = signal.getsignal(signal.SIGINT)
    whole = solve_wstiff(pendulum(), TIMES, tol=1e-9, dense_output=True)
    monkeypatch.setattr(run, "FIRST_CHUNK", 8)
    monkeypatch.setattr(run, "CHUNK_SECONDS", 0.0)

    def interrupt_at_one(t):
        if 1.0 < t < 1.2:
            os.kill(os.getpid(), signal.SIGINT)

    stopped = solve_wstiff(pendulum(), TIMES, tol=1e-9, dense_output=True, progress=interrupt_at_one)
    assert stopped.status is Status.INTERRUPTED
    assert not stopped.success
    assert 1.0 < stopped.t_last < 1.5
    assert "t = 1." in stopped.message
    np.testing.assert_array_equal(stopped.y, whole.y[: len(stopped.t)])
    stopped.checkpoint.options = replace(stopped.checkpoint.options, progress=None)
    rest = resume(stopped)
    assert rest.success
    assert_same(whole, rest)
    np.testing.assert_array_equal(whole.sol(TIMES), rest.sol(TIMES))
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.slow
def test_ctrl_c_is_heeded_in_the_first_steps():
    """Where each step takes long, the first of them must not be hundreds."""
    calls = []

    def decay(t, y, yp, out):
        if t > 0.0:
            calls.append(t)
            if len(calls) == 20:
                os.kill(os.getpid(), signal.SIGINT)
        out[0] = yp[0] + y[0]

    result = solve_dae(decay, (0.0, 100.0), [1.0], rtol=1e-10, atol=1e-12)
    assert result.status is Status.INTERRUPTED
    assert result.stats.steps <= 16


def test_progress_is_told_where_a_chunk_is_more_than_the_buffer_holds(monkeypatch):
    monkeypatch.setattr(run, "FIRST_CHUNK", 10**9)
    seen = []
    result = solve_wstiff(pendulum(), TIMES, tol=1e-9, max_step=2e-4, progress=seen.append)
    assert result.stats.steps > 10_000
    assert len(seen) > 1
    assert seen == sorted(seen)


def test_resume_after_the_step_limit_and_refusal_after_success():
    whole = solve_wstiff(pendulum(), TIMES, tol=1e-6)
    part = solve_wstiff(pendulum(), TIMES, tol=1e-6, max_steps=40)
    assert part.status is Status.TOO_MANY_STEPS
    assert part.stats.steps == 40
    assert_same(whole, resume(part))
    with pytest.raises(ValueError, match="SUCCESS"):
        resume(whole)


def test_whole_numbers_of_options_may_be_floats():
    part = solve_wstiff(pendulum(), TIMES, tol=1e-6, max_steps=4e1, max_order=4.0, max_iterations=8.0)
    assert part.stats.steps == 40


def test_progress_rises_to_the_end():
    seen = []
    solve_wstiff(pendulum(), TIMES, tol=1e-8, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == TIMES[-1]


def test_outputs_at_every_step_and_dense_output_agree():
    every = solve_wstiff(pendulum(), t_end=2.0, tol=1e-7, dense_output=True)
    assert len(every.t) == every.stats.steps + 1
    assert every.t[-1] == 2.0
    at = np.linspace(0.0, 2.0, 33)
    sampled = solve_wstiff(pendulum(), at, tol=1e-7)
    # the polynomials are the same; multipliers are solved for, to far below their tolerances of 30 and 4 times 1e-7
    np.testing.assert_allclose(every.sol(at[:-1])[:, :4], sampled.y[:-1, :4], atol=1e-12)
    np.testing.assert_allclose(every.sol(at[:-1])[:, 4:], sampled.y[:-1, 4:], atol=1e-10)
    np.testing.assert_allclose(every.sol.derivative(every.t)[1:], every.yp[1:], atol=1e-8)


def test_dense_output_derivative_is_the_slope():
    result = solve_wstiff(pendulum(), t_end=1.0, tol=1e-9, dense_output=True)
    t = np.linspace(0.1, 0.9, 17)
    d = 1e-6
    slope = (result.sol(t + d) - result.sol(t - d)) / (2 * d)
    np.testing.assert_allclose(result.sol.derivative(t)[:, :4], slope[:, :4], rtol=1e-4, atol=1e-5)
    with pytest.raises(ValueError, match=says("leaves the integrated")):
        result.sol(1.5)


def test_without_interpolation_steps_land_on_the_outputs():
    result = solve_wstiff(pendulum(), TIMES, tol=1e-6, interpolate=False)
    assert set(TIMES[1:]) <= set(result.stats.t_steps)
    exact = solve_wstiff(pendulum(), TIMES, tol=1e-10)
    assert np.abs(result.y - exact.y)[:, :4].max() < 1e-3


def test_breakpoints_are_landed_on_and_cost_nothing_where_nothing_jumps():
    result = solve_wstiff(pendulum(), TIMES, tol=1e-6, breakpoints=[0.7, 1.9, 99.0])
    t, orders = result.stats.t_steps, result.stats.orders
    for mark in (0.7, 1.9):
        at = int(np.flatnonzero(t == mark)[0])
        assert orders[at + 1] > 1
    assert result.stats.steps <= solve_wstiff(pendulum(), TIMES, tol=1e-6).stats.steps + 20


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
def test_a_jump_at_a_breakpoint_restarts_at_order_one(method):
    """A unit mass on a unit spring, pushed by turns: ten jumps of its acceleration."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = yp[1] + y[0] - (1.0 if int(np.ceil(2.0 * t)) % 2 == 1 else -1.0)

    marks = np.arange(1, 11) * 0.5
    result = solve_dae(residual, (0.0, 5.2), [0.0, 0.0], rtol=1e-8, atol=1e-8, breakpoints=marks, method=method)
    t, orders = result.stats.t_steps, result.stats.orders
    for mark in marks:
        at = int(np.flatnonzero(t == mark)[0])
        # beyond a jump the step that was tried first is refused, and leaves no trace but this
        assert orders[at + 1] == 1
    place, speed, push = 0.0, 0.0, 1.0
    for length in np.diff(np.concatenate(([0.0], marks, [5.2]))):
        c, s = np.cos(length), np.sin(length)
        place, speed = push + (place - push) * c + speed * s, -(place - push) * s + speed * c
        push = -push
    assert result.y[-1] == pytest.approx([place, speed], abs=2e-6)


@njit
def pushed_by_turns(t, y, yp, out, p):
    """A unit mass on a unit spring; if p[0] is one, the push changes its sign after each period, if p[1] is, at it."""
    periods = t / (2.0 * np.pi)
    away = p[0] == 1.0 and int(np.floor(periods) + 1.0 if p[1] == 1.0 else np.ceil(periods)) % 2 == 0
    out[0] = yp[0] - y[1]
    out[1] = yp[1] + y[0] - (-1.0 if away else 1.0)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("tol", [1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("beyond", [False, True])
def test_a_restart_at_a_jump_costs_ten_steps_at_most_and_no_digits(beyond, tol, method):
    """Whether the instant of the jump belongs to what is before it or to what is beyond."""
    periods = 2.0 * np.pi * np.arange(1, 12)
    steady, jumping = (
        solve_dae(pushed_by_turns, (0.0, periods[-1]), [0.0, 1.0], rtol=tol, atol=tol, method=method,
                  p=[float(jumps), float(beyond)], breakpoints=periods if jumps else ())
        for jumps in (False, True)
    )  # fmt: skip
    assert jumping.success, jumping.message
    assert jumping.stats.steps - steady.stats.steps <= 10 * (len(periods) - 1)
    # each period ends where it began, about either place of rest
    off, off_steady = (np.abs(result.y[-1] - [0.0, 1.0]).max() for result in (jumping, steady))
    assert off < 1.5 * off_steady + 10.0 * tol


@njit
def pushed(t, y, yp, out, p):
    """A unit mass on a unit spring; the push changes its sign at each time of ``p``."""
    push = 1.0
    for jump in p:
        if t >= jump:
            push = -push
    out[0] = yp[0] - y[1]
    out[1] = yp[1] + y[0] - push


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("tol", [1e-4, 1e-6, 1e-8])
def test_a_jump_some_digits_beside_its_breakpoint_costs_what_one_at_it_does(tol, method):
    """As where the equations compute the time of the jump in another way than whoever gives the breakpoints."""

    marks = 1.3 * np.arange(1, 6)
    place, speed, push = 0.0, 0.0, 1.0
    for _ in range(6):
        c, s = np.cos(1.3), np.sin(1.3)
        place, speed = push + (place - push) * c + speed * s, -(place - push) * s + speed * c
        push = -push
    steps, errors = [], []
    for beside in (0, -1, 1, -7, 7, -40, 40):
        found = solve_dae(
            pushed, (0.0, 7.8), [0.0, 0.0], rtol=tol, atol=tol, method=method, breakpoints=marks, t_eval=[0.0, 7.8],
            p=marks + beside * np.spacing(marks),
        )  # fmt: skip
        assert found.success, found.message
        steps.append(found.stats.steps)
        errors.append(np.abs(found.y[-1] - [place, speed]).max())
    assert max(steps) - min(steps) <= 2 * len(marks)
    assert max(errors) < 1.5 * errors[0] + 10.0 * tol


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("beside", [-1, 0, 1])
def test_a_pulse_up_to_the_end_of_the_run_is_seen(beside, method):
    """Its end is a breakpoint at the end of the run, or a digit beside it as one that is computed in another way."""

    def residual(t, y, yp, out):
        out[0] = yp[0] - (1.0 if 1.0 <= t < 1.0001 else 0.0)

    marks = [1.0, 1.0001 + beside * np.spacing(1.0001)]
    found = solve_dae(residual, (0.0, 1.0001), [0.0], breakpoints=marks, rtol=1e-8, atol=1e-12, method=method)
    assert found.success, found.message
    assert found.t[-1] == 1.0001
    assert found.y[-1, 0] == pytest.approx(1e-4, rel=1e-6)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("beyond", [False, True])
def test_an_algebraic_unknown_jumps_at_a_breakpoint_with_outputs_next_to_it(beyond, method):
    """z = 1 + t, from t = 0.7 on 2 + t; x' = z."""
    jump = 0.7
    near = [jump + k * np.spacing(jump) for k in (-40, -3, -1, 0, 1, 3, 20, 40)]
    outputs = np.array([0.0, 0.3, *near, 0.7 + 1e-9, 1.4, 2.0])
    after = outputs >= jump if beyond else outputs > jump

    def residual(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = y[1] - t - (2.0 if (t >= jump if beyond else t > jump) else 1.0)

    for controlled in (False, True):
        mask = np.array([True, controlled])
        found = solve_dae(
            residual, (0.0, 2.0), [0.0, 1.0], method=method, breakpoints=[jump], t_eval=outputs, rtol=1e-7, atol=1e-7,
            error_mask=mask,
        )  # fmt: skip
        assert found.success, found.message
        x = outputs + 0.5 * outputs**2 + np.maximum(outputs - jump, 0.0)
        np.testing.assert_allclose(found.y[:, 0], x, atol=1e-6)
        # at the jump itself either side may stand
        apart = outputs != jump
        np.testing.assert_allclose(found.y[apart, 1], (1.0 + outputs + after)[apart], atol=2e-5)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("rate", [1.0, 1e3])
def test_jumps_a_fraction_of_a_step_apart_are_seen(rate, method):
    """So near to each other, or so low an order asked for, that a restart has no room for points of order five."""
    marks = [1.0, 1.0 + 1e-6 / rate, 2.0, 2.0 + 1e-3 / rate]

    def relaxed(t, y, yp, out):
        pulse = marks[0] < t <= marks[1] or marks[2] < t <= marks[3]
        out[0] = yp[0] + rate * (y[0] - (1e3 if pulse else 1.0))

    exact, at = 0.0, 0.0
    for end, target in zip((*marks, 2.5), (1.0, 1e3, 1.0, 1e3, 1.0)):
        exact, at = target + (exact - target) * np.exp(-rate * (end - at)), end
    for order in (5, 3):
        result = solve_dae(
            relaxed, (0.0, 2.5), [0.0], rtol=1e-7, atol=1e-7, breakpoints=marks, max_order=order, method=method
        )
        assert result.success, result.message
        assert result.y[-1, 0] == pytest.approx(exact, abs=1e-5)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("width", [1e-4, 1e-2])
def test_a_pulse_between_two_breakpoints_is_seen_whichever_side_they_belong_to(width, method):
    first, last = 0.5, 0.5 + width
    for with_first in (False, True):
        for with_last in (False, True):

            def residual(t, y, yp, out, p):
                pushed = (p[0] < t < p[1]) or (p[2] > 0.0 and t == p[0]) or (p[3] > 0.0 and t == p[1])
                out[0] = yp[0] - (1.0 / (p[1] - p[0]) if pushed else 0.0)

            p = [first, last, float(with_first), float(with_last)]
            for tol in (1e-4, 1e-8):
                result = solve_dae(
                    residual, (0.0, 1.0), [0.0], rtol=tol, atol=tol, method=method, breakpoints=[first, last], p=p
                )
                assert result.success, result.message
                off = abs(result.y[-1, 0] - 1.0)
                assert off < 20.0 * tol, f"{with_first}, {with_last}, tol = {tol:g}: off by {off / tol:.3g} tolerances"


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("tol", [1e-4, 1e-6, 1e-8, 1e-10])
def test_breakpoints_where_nothing_jumps_leave_steps_and_error_alone(tol, method):
    def parabola(t, y, yp, out):
        out[0] = yp[0] - 2.0 * t

    marks = np.linspace(0.0, 2.0, 22)[1:-1]
    plain, marked = (
        solve_dae(parabola, (0.0, 2.0), [0.0], rtol=tol, atol=tol, method=method, **more)
        for more in ({}, {"breakpoints": marks})
    )
    assert marked.stats.steps - plain.stats.steps <= 10 * len(marks)
    assert abs(marked.y[-1, 0] - 4.0) <= 2.0 * abs(plain.y[-1, 0] - 4.0) + tol


def test_limits_on_order_and_step():
    result = solve_wstiff(pendulum(), TIMES, tol=1e-5, max_order=2, max_step=0.01)
    assert result.stats.orders.max() <= 2
    assert result.stats.h_steps.max() <= 0.01 * (1 + 1e-12)
    first = solve_wstiff(pendulum(), TIMES, tol=1e-5, first_step=1e-5)
    assert first.stats.h_steps[0] == pytest.approx(1e-5)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
def test_a_change_of_coordinates_leaves_the_motion_alone(method):
    """The angle is taken back by whole turns in the stored history: same steps, same motion, one epoch per turn."""
    times = np.linspace(0.0, 20.0, 101)
    free = solve_wstiff(rotor(False), times, tol=1e-8, method=method)
    turned = solve_wstiff(rotor(True), times, tol=1e-8, method=method)
    assert turned.success
    assert len(turned.epochs) > 10
    assert np.all(turned.y[:, 0] < 2 * np.pi + 2.0)
    unwound = turned.y[:, 0] + 2 * np.pi * np.array([turned.epoch_of(i)[0] for i in range(len(times))])
    np.testing.assert_allclose(unwound, free.y[:, 0], atol=2e-5)
    if method == "WSTIFF":
        assert abs(turned.stats.steps - free.stats.steps) <= 0.1 * free.stats.steps


def test_dense_output_across_coordinate_changes():
    turned = solve_wstiff(rotor(True), np.linspace(0.0, 20.0, 101), tol=1e-8, dense_output=True)
    np.testing.assert_allclose(turned.sol(turned.t)[:-1], turned.y[:-1], atol=1e-10)


def test_epochs_when_every_step_is_an_output():
    turned = solve_wstiff(rotor(True), t_end=20.0, tol=1e-8)
    rows = [first for first, _ in turned.epochs]
    assert rows == sorted(rows)
    angle = turned.y[:, 0] + 2 * np.pi * np.array([turned.epoch_of(i)[0] for i in range(len(turned.t))])
    assert np.abs(np.diff(angle)).max() < 1.5


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        ({"tol": 0.0}, says("tol", "ERROR", "0.0", "positive")),
        ({"rtol": -1.0}, "rtol"),
        ({"method": "LSODE"}, says("method", "'LSODE'", "choose", "WSTIFF")),
        ({"corrector": "none"}, "corrector"),
        ({"max_order": 7}, "max_order"),
        ({"max_step": 0.0}, says("max_step", "HMAX", "0.0", "positive")),
        ({"first_step": 0.0}, "first_step"),
        ({"min_step": -1.0}, "min_step"),
        ({"max_iterations": 0}, "max_iterations"),
        ({"event_action": [1]}, "event_action"),
        ({"t_end": 1.0}, "t_eval ends"),
    ],
)
def test_wrong_arguments_are_named(arguments, names):
    with pytest.raises(ValueError, match=names):
        solve_wstiff(pendulum(), TIMES, **arguments)


@pytest.mark.parametrize("t_eval", [[], [1.0, 0.5], [0.0, np.nan], [-1.0, 1.0]])
def test_wrong_output_times(t_eval):
    with pytest.raises(ValueError, match=r"^t_eval (must|starts)"):
        solve_wstiff(pendulum(), t_eval)


def test_no_end_is_an_error():
    with pytest.raises(ValueError, match=says("give t_eval", "t_end", "every step")):
        solve_wstiff(pendulum())


@njit(RESIDUAL_SIG, error_model="numpy")
def driven_residual(t, y, yp, out, idata, rdata, work):
    """y_0' = cos t, and B z = y_0 for the others; B by columns in ``rdata``."""
    n = out.size
    out[0] = yp[0] - np.cos(t)
    for i in range(n - 1):
        out[1 + i] = -y[0]
        for j in range(n - 1):
            out[1 + i] += rdata[(n - 1) * j + i] * y[1 + j]


@njit(JACOBIAN_SIG, error_model="numpy")
def driven_jacobian(t, y, yp, cj, vals, idata, rdata, work):
    """The first column is full, the others have all rows but the first."""
    n = y.size
    vals[0] = cj
    for i in range(1, n):
        vals[i] = -1.0
    for k in range(rdata.size):
        vals[n + k] = rdata[k]


@pytest.mark.parametrize("stiff", [True, False])
def test_small_entries_stay_out_of_the_newton_matrix_only_where_the_corrector_converges_without(stiff):
    """Pairs of equations that are nearly the same make entries of 1e-7 count."""
    n = 24
    b = np.eye(n) if stiff else np.kron(np.eye(n // 2), [[1.0, 1.0], [1.0, 1.0 + 1e-7]])
    small = 1e-7 * np.cos(np.arange(n * n)).reshape(n, n)
    b = np.where(b == 0.0, small, b)
    differential = np.arange(n + 1) == 0
    problem = DAEProblem(
        n=n + 1, residual=driven_residual, jacobian=driven_jacobian,
        indptr=np.concatenate([[0], n + 1 + n * np.arange(n + 1)]),
        indices=np.concatenate([np.arange(n + 1), np.tile(np.arange(1, n + 1), n)]),
        idata=np.zeros(1, dtype=np.int64), rdata=np.ravel(b, "F"), work_size=1,
        y0=np.zeros(n + 1), yp0=np.concatenate([[1.0], np.linalg.solve(b, np.ones(n))]), error_mask=differential,
        atol_scale=np.ones(n + 1), scale=np.ones(n + 1), differential=differential,
        small_entries=True,
    )  # fmt: skip
    driven = run.Run(problem, np.array([0.0, 2.0]), 2.0, Options(tol=1e-8))
    result = driven.drive()
    assert result.success
    assert (driven.plan.left_src.size > 0) == stiff
    np.testing.assert_allclose(result.y[-1, 1:], np.linalg.solve(b, np.full(n, result.y[-1, 0])), rtol=1e-5)
    np.testing.assert_allclose(result.y[-1, 0], np.sin(2.0), atol=1e-6)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("breakpoints", [
    [0.7], [0.7, 0.7], [0.7, np.nextafter(0.7, 1.0)], [np.nextafter(2.0, 1.0)], [k / 30 for k in range(1, 60)],
])  # fmt: skip
def test_stops_and_outputs_nearer_than_the_shortest_step(method, breakpoints):
    """Outputs a unit of the last place beside a breakpoint, and breakpoints as near to each other and to the end."""
    outputs = [0.0, np.nextafter(0.7, 0.0), 0.7, np.nextafter(0.7, 1.0), 2.0]

    def decay(t, y, yp, out):
        out[0] = yp[0] + y[0]

    for t_eval in (outputs, None):
        found = solve_dae(
            decay, (0.0, 2.0), [1.0], method=method, breakpoints=breakpoints, t_eval=t_eval, rtol=1e-7, atol=1e-9
        )
        assert found.success, found.message
        np.testing.assert_allclose(found.y[:, 0], np.exp(-found.t), rtol=2e-5)


def test_breakpoints_are_a_list_of_times():
    for wrong in (0.5, "abc", [np.nan], ["0.5"]):
        with pytest.raises(ValueError, match=r"^breakpoints .*; (give|leave)"):
            Options(breakpoints=wrong)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("behind", [1e-16, 1e-9, 1e-6])
def test_outputs_close_together_are_not_landed_on(method, behind):
    """Steps of 0.1 s and 1e-9 s beside each other: what differences tell of the past is rounding."""

    def turning(t, y, yp, out):
        out[0] = yp[0] - (1.0 if t < 0.5 else -1.5) * np.cos(t)

    outputs = np.unique([0.1, 0.3, 0.5 + behind, 0.7, 0.9, 1.0])
    found = solve_dae(
        turning, (0.0, 1.0), [0.0], t_eval=outputs, method=method, interpolate=False, breakpoints=[0.5], rtol=1e-8,
        atol=1e-8,
    )  # fmt: skip
    assert found.success, found.message
    exact = np.where(outputs < 0.5, np.sin(outputs), 2.5 * np.sin(0.5) - 1.5 * np.sin(outputs))
    np.testing.assert_allclose(found.y[:, 0], exact, atol=1e-6)
