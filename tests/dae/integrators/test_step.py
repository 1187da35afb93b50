"""The parts of a step, each on its own: the window of the history, the end, the prediction, tests and refusals."""

import numpy as np
import pytest
from numba import njit

from gearmbs.dae.integrators import bdf, newton_matrix, run_state, step
from gearmbs.dae.integrators.controller import UNFORESEEN, after_success, meets_kinks
from gearmbs.dae.integrators.corrector import (
    CONVERGED,
    LOOSEST,
    LOOSEST_AT_KINKS,
    NOT_FINITE,
    SLOW,
    amount_left,
    apply_correction,
    count_noise,
    renew_weights,
    set_weights,
    weighted_argmax,
    weighted_max,
)
from gearmbs.dae.integrators.newton_matrix import GAMMA_DRIFT
from gearmbs.dae.integrators.run_state import (
    KINK_MEMORY,
    REPIVOT,
    RUNNING,
    WINDOW,
    forget,
    newest_point,
    open_row,
    rows_from,
    times_from,
)
from gearmbs.kernels.placed import unbound
from tests.dae.integrators.problems import pendulum
from tests.dae.integrators.stepping import started, take_step

SHRUNK = 0.25


@njit
def form_matrix(bound, st, plan, factors):
    """Form the matrix as the step loop does, which takes functions off their addresses once."""
    return newton_matrix.form_matrix(unbound(bound), st, plan, factors)


@njit
def solve_step(bound, st, plan, factors):
    return step.solve_step(unbound(bound), st, plan, factors)


@njit
def deliver(bound, st, part):
    return step.deliver(unbound(bound), st, part)


def warm(steps=30, **settings):
    """Return the pendulum's run after some steps."""
    run = started(pendulum(), t_end=2.0, **({"tol": 1e-6} | settings))
    for _ in range(steps):
        assert take_step(run) == RUNNING
    return run


def opened(run):
    """Open the next step of a run up to its prediction; return the state."""
    st = run.state
    assert step.open_step(st) == RUNNING
    assert step.choose_end(st) == RUNNING
    step.predict(st)
    return st


@pytest.mark.slow
def test_the_window_slides_and_keeps_the_newest_points():
    st = warm(0).state
    times, values = [st.t], [newest_point(st).copy()]
    for k in range(3 * WINDOW):
        open_row(st)
        times.insert(0, float(k))
        values.insert(0, np.full(len(st.y), 0.1 * k))
        times_from(st, 0)[0] = times[0]
        rows_from(st, 0)[0] = values[0]
        st.n_past = min(st.n_past + 1, bdf.HISTORY)
        m = st.n_past
        np.testing.assert_array_equal(times_from(st, 0)[:m], times[:m])
        np.testing.assert_array_equal(rows_from(st, 0)[:m], values[:m])


@pytest.mark.parametrize(
    ("h", "stop", "end"),
    [(0.1, 9.0, 1.1), (0.1, 1.05, 1.05), (0.1, 1.1, 1.1), (0.1, 1.15, 1.075), (0.1, 1.1000001, 1.1000001)],
)
def test_the_end_of_a_step_leaves_no_sliver(h, stop, end):
    assert step.fitted_end(h, 1.0, stop) == pytest.approx(end, rel=1e-15)


@pytest.mark.parametrize(
    ("h", "end"),
    [(0.3, 1.1), (0.1, 1.1), (0.095, 1.1), (0.085, 1.05), (0.06, 1.05), (0.04, 1.0 + 0.1 / 3.0), (0.02, 1.02)],
)
def test_steps_that_land_are_equal_and_as_few_as_the_error_allows(h, end):
    """On 1.1 from 1, each a tenth longer than wanted at most."""
    assert step.landing_end(h, 1.0, 1.1, 1.1) == pytest.approx(end, rel=1e-12)


def test_a_step_lands_on_the_next_stop():
    run = warm(breakpoints=[0.5])
    st = run.state
    while st.next_stop == 0:
        take_step(run)
    assert st.t == 0.5
    assert st.passing
    past = st.n_past
    take_step(run)
    assert not st.passing
    assert st.n_past >= past


@pytest.mark.slow
def test_a_step_below_its_limit_is_a_failure_named_by_what_failed():
    st = opened(warm())
    st.h_min = 1.0
    st.h = st.h_refused = 0.5
    st.t_end = 100.0
    st.error_fails = 1
    assert step.choose_end(st) == run_state.FAIL_STEP_TOO_SMALL
    st.newton_fails = 2
    assert step.choose_end(st) == run_state.FAIL_NEWTON
    st.nan_fails = 1
    assert step.choose_end(st) == run_state.FAIL_NOT_FINITE
    st.newton_fails = 20
    assert step.choose_end(st) == run_state.FAIL_TOO_MANY_REJECTIONS


@pytest.mark.slow
def test_a_step_refused_too_often_is_named_by_what_failed_most():
    st = opened(warm())
    st.nan_fails = step.MAX_FAILS
    assert step.choose_end(st) == RUNNING
    st.newton_fails = 1
    assert step.choose_end(st) == run_state.FAIL_NOT_FINITE
    st.nan_fails, st.newton_fails = 1, step.MAX_FAILS
    assert step.choose_end(st) == run_state.FAIL_TOO_MANY_REJECTIONS


def test_too_many_steps_and_a_full_buffer_stop_before_a_step_is_opened():
    st = warm().state
    newest = st.newest
    st.max_steps = st.steps
    assert step.open_step(st) == run_state.FAIL_TOO_MANY_STEPS
    st.max_steps = 0
    st.n_records = len(st.record_t)
    assert step.open_step(st) == run_state.BUFFER_FULL
    assert st.newest == newest
    assert not st.open


@pytest.mark.slow
def test_the_prediction_is_the_polynomial_through_the_newest_points():
    st = opened(warm())
    k = st.order
    t, past = times_from(st, 1)[: k + 1], rows_from(st, 1)[: k + 1]
    for i in range(2):
        polynomial = np.polynomial.Polynomial.fit(t - st.t_new, past[:, i], k)
        assert st.y_pred[i] == pytest.approx(polynomial(0.0), abs=1e-12)
        assert st.yp_pred[i] == pytest.approx(polynomial.deriv()(0.0), abs=1e-9)
    np.testing.assert_array_equal(st.y, st.y_pred)
    assert st.gamma == bdf.leading_coefficient(st.t_new, t, k)


@pytest.mark.slow
def test_the_matrix_is_kept_until_the_leading_coefficient_has_drifted():
    run = warm()
    st = opened(run)
    parts = run.functions, st, run.plan, run.factors
    st.matrix_wanted = True
    jacobians = st.jacobians
    assert form_matrix(*parts) == RUNNING
    assert st.jacobians > jacobians
    assert st.matrix_fresh
    jacobians, factorizations = st.jacobians, st.factorizations
    st.gamma *= 1.0 + 0.5 * GAMMA_DRIFT
    assert form_matrix(*parts) == RUNNING
    assert (st.jacobians, st.factorizations) == (jacobians, factorizations)
    st.gamma *= 1.0 + GAMMA_DRIFT
    assert form_matrix(*parts) == RUNNING
    assert (st.jacobians, st.factorizations) == (jacobians, factorizations + 1)
    exact = np.zeros_like(st.matrix)
    run.problem.jacobian(st.t_new, st.y, st.yp, st.gamma, exact, st.idata, st.rdata, st.work)
    np.testing.assert_allclose(st.matrix, exact, atol=1e-7 * st.gamma)


@pytest.mark.slow
def test_pivots_that_no_longer_fit_are_chosen_anew():
    run = warm()
    st = opened(run)
    st.matrix_wanted = True
    st.growth_limit = 0.0
    assert form_matrix(run.functions, st, run.plan, run.factors) == REPIVOT
    assert st.h == st.h_wanted


@pytest.mark.slow
def test_the_corrector_solves_the_equations_of_the_step():
    run = warm()
    st = opened(run)
    parts = run.functions, st, run.plan, run.factors
    form_matrix(*parts)
    assert solve_step(*parts) == CONVERGED
    run.problem.residual(st.t_new, st.y, st.yp, st.res, st.idata, st.rdata, st.work)
    assert np.abs(st.res).max() < 1e-6
    np.testing.assert_allclose(st.yp[:4], (st.yp_pred + st.gamma * (st.y - st.y_pred))[:4], rtol=1e-12, atol=1e-12)


def test_a_correction_that_is_not_finite_is_noticed():
    y, yp, weight = np.zeros(9), np.zeros(9), np.ones(9)
    for wrong in (np.nan, np.inf, -np.inf):
        for place in range(9):
            delta = np.ones(9)
            delta[place] = wrong
            weight[place] = 0.0
            assert not np.isfinite(apply_correction(delta, 2.0, weight, y, yp))
            weight[place] = 1.0


@pytest.mark.slow
def test_a_stale_matrix_is_renewed_before_the_step_is_shortened():
    st = opened(warm())
    st.matrix_fresh = False
    st.h_wanted = 7.0
    assert step.refuse_by_newton(st, SLOW) == RUNNING
    assert st.matrix_wanted
    assert st.h == 7.0
    assert st.newton_rejections == 0
    st.matrix_fresh = True
    assert step.refuse_by_newton(st, SLOW) == RUNNING
    assert st.h == SHRUNK * st.step
    assert st.newton_rejections == 1
    st.delta[:] = 0.0
    st.res[:] = 0.0
    st.res[3] = np.nan
    assert step.refuse_by_newton(st, NOT_FINITE) == RUNNING
    assert st.worst == 3
    st.newton_fails = 3
    assert step.refuse_by_newton(st, SLOW) == REPIVOT
    assert st.drop_level == 1


@pytest.mark.slow
def test_an_error_above_the_tolerance_is_refused_with_its_unknown():
    run = warm()
    st = opened(run)
    parts = run.functions, st, run.plan, run.factors
    form_matrix(*parts)
    solve_step(*parts)
    assert step.passes_error_test(st, run.plan, run.factors)
    np.testing.assert_array_equal(newest_point(st), st.y)
    st.y[1] += 1e-3
    assert not step.passes_error_test(st, run.plan, run.factors)
    h = st.h
    step.refuse_by_error(st)
    assert st.worst_error == 1
    assert st.h < h
    assert st.open


@pytest.mark.slow
def test_an_accepted_step_is_the_newest_point():
    run = warm()
    st = opened(run)
    parts = run.functions, st, run.plan, run.factors
    form_matrix(*parts)
    solve_step(*parts)
    assert step.passes_error_test(st, run.plan, run.factors)
    steps, past = st.steps, st.n_past
    step.accept(st)
    assert st.steps == steps + 1
    assert st.t == st.t_new == times_from(st, 0)[0]
    assert st.n_past == min(past + 1, bdf.HISTORY)
    assert not st.open
    assert deliver(run.functions, st, run.algebraic.part) == RUNNING
    assert st.record_t[st.n_records - 1] == st.t
    forget(st)
    assert (st.n_past, st.order) == (1, 1)


@pytest.mark.slow
def test_the_size_wanted_before_landing_is_taken_up_again():
    st = opened(warm())
    st.n_past, st.order = 1, 1  # no history to choose a size from
    st.h_wanted = 4.0 * st.step
    step.choose_next(st)
    assert st.h == 2.0 * st.step
    st.h, st.interpolate = st.step, False
    step.choose_next(st)
    assert st.h == 4.0 * st.step


@pytest.mark.slow
def test_an_order_is_raised_only_after_order_plus_one_steps():
    st = warm(40).state
    st.order, st.since_change = 2, 0
    after_success(st)
    assert st.order <= 2


def test_noise_is_counted_until_it_has_left_the_history():
    st = warm().state
    st.noise, st.noise_left = 0.3, 2
    for left in (1, 0):
        count_noise(st)
        assert st.noisy
        assert st.noise_left == left
    assert st.noise == 0.0
    count_noise(st)
    assert not st.noisy
    assert st.noise_limited == 2


@pytest.mark.slow
def test_weights_follow_tolerances_and_steps():
    st = warm(rtol=1e-3).state
    y = np.linspace(-2.0, 3.0, len(st.y))
    set_weights(st, y, 1e-2)
    tolerance = st.atol + 1e-3 * np.abs(y)
    np.testing.assert_allclose(st.w_error, st.controlled / tolerance)
    np.testing.assert_allclose(st.w_newton, np.where(st.coupled > 0.0, 1.0, 1e-2) / tolerance)
    renew_weights(st, 2.0 * y, 1e-2)
    np.testing.assert_allclose(st.weight, 1.0 / (st.atol + 2e-3 * np.abs(y)))
    assert weighted_max(y, st.w_error) == pytest.approx(np.max(np.abs(y) * st.w_error))
    assert weighted_argmax(y, st.w_error) == np.argmax(np.abs(y) * st.w_error)


def test_weights_that_depend_on_nothing_are_left_alone():
    st = warm(corrector="modified").state
    assert not st.step_in_weights
    st.w_error[:] = 7.0
    renew_weights(st, st.y, 1e-3)
    assert (st.w_error == 7.0).all()


@pytest.mark.slow
def test_an_error_that_was_not_foretold_counts_as_a_kink_soon_after_another():
    st = opened(warm())
    st.error = 1.1 * UNFORESEEN
    step.accept(st)
    assert not meets_kinks(st)
    st.since_kink = KINK_MEMORY - 1
    step.accept(st)
    assert st.since_kink == 0
    st.error = 0.9 * UNFORESEEN
    step.accept(st)
    assert st.since_kink == 1


@pytest.mark.slow
def test_a_refused_step_counts_as_a_kink_for_some_steps():
    run = warm()
    st = opened(run)
    st.order = 2
    assert not meets_kinks(st)
    assert amount_left(st) == LOOSEST
    step.refuse_by_error(st)
    assert meets_kinks(st)
    st.order = 2
    assert amount_left(st) == LOOSEST_AT_KINKS
    st.order = 5
    assert amount_left(st) == 0.5**5
    for _ in range(KINK_MEMORY):
        assert meets_kinks(st)
        assert take_step(run) == RUNNING
    assert not meets_kinks(st)
