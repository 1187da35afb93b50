"""Spans of many decades: first, smallest and checking step come from the problem and not from the end time."""

import numpy as np
import pytest
from numba import njit

from benchmarks.problems.stiff import robertson
from gearmbs.dae.integrators.wstiff import solve_wstiff
from gearmbs.dae.result import Status
from gearmbs.dae.solve import solve_dae
from tests.dae.integrators.problems import pendulum

SPAN = (0.0, 1e11)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("tol", [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10])
def test_robertson_over_eleven_decades(tol, method):
    """A digit a decade, less what more steps of the same local error add up to: 3 tolerances at 1e-4, 31 at 1e-10."""
    problem = robertson()
    result = solve_dae(problem.fun, SPAN, problem.y0, rtol=tol, atol=tol * problem.atol, t_eval=[1e11], method=method)
    assert result.success, result.message
    assert problem.error(result.y[-1]) < min(60.0 * tol, 20.0 * tol + 2e-7)
    ida = solve_dae(
        problem.fun, SPAN, problem.y0, rtol=tol, atol=tol * problem.atol, t_eval=[1e11], method="IDA", max_steps=100_000
    )
    assert ida.success
    assert result.stats.steps <= ida.stats.steps


@njit
def summed_from_the_left(t, y, yp, out):
    """Robertson's reaction with each large term added to a rate by itself."""
    out[0] = yp[0] + 0.04 * y[0] - 1e4 * y[1] * y[2]
    out[1] = yp[1] - 0.04 * y[0] + 1e4 * y[1] * y[2] + 3e7 * y[1] ** 2
    out[2] = y[0] + y[1] + y[2] - 1.0


@pytest.mark.slow
@pytest.mark.parametrize("tol", [1e-9, 1e-10])
def test_terms_that_cancel_late_end_the_digits(tol):
    """At the end 0.04 y[0] and 1e4 y[1] y[2] of 1e-9 cancel to 1e-19.

    What a rate has lost to the last digit of one of them, 1e-25, moves y[0] = 2e-8 by 1e-15 over a step of 1e10, which
    is 5e-8 of it: the median of five near tolerances, since a single run may have that a few times.
    """
    problem = robertson()
    errors = []
    for near in tol * np.linspace(0.9, 1.1, 5):
        result = solve_dae(summed_from_the_left, SPAN, problem.y0, rtol=near, atol=near * problem.atol, t_eval=[1e11])
        assert result.success, result.message
        assert result.stats.noise_limited > 0
        errors.append(problem.error(result.y[-1]))
    assert np.median(errors) < 2e-7


@pytest.mark.parametrize("t_end", [1e-3, 1.0, 4e4, 4e7, 1e9, 1e10])
@pytest.mark.parametrize("atol", [1e-8, 1e-10, (1e-8, 1e-12, 1e-4)])
def test_no_consistent_start_is_refused_for_its_span(t_end, atol):
    problem = robertson()
    result = solve_dae(problem.fun, (0.0, t_end), problem.y0, atol=1e-2 * np.asarray(atol), t_eval=[t_end])
    assert result.success, result.message
    assert result.y[-1].sum() == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("rates", [[0.0, 0.0, 0.0], [-0.04, 0.04, 0.0], [1.0, -2.0, 0.0]])
def test_rates_given_wrong_or_right_do_not_stop_the_run(rates):
    """Rates off by 2 / s would move y[1] by far more than its tolerance in any step that fits the span."""
    problem = robertson()
    result = solve_dae(problem.fun, SPAN, problem.y0, rates, rtol=1e-6, atol=1e-6 * problem.atol, t_eval=[1e11])
    assert result.success, result.message
    assert problem.error(result.y[-1]) < 2e-5


@pytest.mark.parametrize("options", [{"first_step": 1e-3}, {"min_step": 1e-12, "first_step": 1e-8}])
def test_steps_given_are_taken(options):
    problem = robertson()
    result = solve_dae(problem.fun, SPAN, problem.y0, rtol=1e-6, atol=1e-6 * problem.atol, **options)
    assert result.success, result.message
    assert result.stats.h_steps[0] <= options["first_step"]
    assert problem.error(result.y[-1]) < 2e-5


def test_a_start_that_violates_the_balance_is_refused_over_any_span():
    problem = robertson()
    result = solve_dae(problem.fun, SPAN, [1.0, 1e-3, 0.5], error_mask=np.ones(3, bool), names=["A", "B", "C"])
    assert result.status is Status.INCONSISTENT_START
    assert " C " in result.message


def test_a_consistent_start_is_not_repaired():
    """A first step of a millionth of the span would take y[1] from zero to its equilibrium of 3.6e-5 at once."""
    problem = robertson()
    result = solve_dae(problem.fun, SPAN, problem.y0, atol=1e-6 * problem.atol, check_start=False)
    assert result.success, result.message
    assert result.y[0].tolist() == [1.0, 0.0, 0.0]
    assert "moved" not in result.message


def test_a_repair_is_told():
    problem = pendulum()
    problem.y0[0] = 1.0001
    result = solve_wstiff(problem, t_end=0.5, tol=1e-6, check_start=False)
    assert result.success
    # the shortest way back onto the circle
    assert result.y[0, :2] == pytest.approx([1.0, 0.0], abs=1e-8)
    assert "moved onto the equations: x by -0.0001" in result.message


@pytest.mark.slow
def test_a_start_that_cannot_be_repaired_is_refused():
    """No real y has y^2 = -1."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] + y[0]
        out[1] = y[1] ** 2 + 1.0 + 0.0 * y[0]

    result = solve_dae(
        residual, (0.0, 1.0), [1.0, 0.5], error_mask=np.ones(2, bool), names=["q", "z"], check_start=False
    )
    assert result.status is Status.INCONSISTENT_START
    assert "z" in result.message


@pytest.mark.slow
def test_equations_set_aside_for_good_are_no_success():
    """From t = 1 on the second equation reads 1 = 0: whatever the tolerance, the run must not reach its end unsaid."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = max(1.0 - t, 0.0) ** 4 * (y[1] ** 3 + y[1] - np.cos(t)) if t < 1.0 else 0.0 * y[1] + 1.0

    for tol in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        result = solve_dae(residual, (0.0, 2.0), [0.0, 0.6823278], names=["q", "z"], rtol=tol)
        assert result.status is Status.SINGULAR_JACOBIAN
        assert "determines z" in result.message
