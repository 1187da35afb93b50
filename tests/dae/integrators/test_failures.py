"""Every way a run can fail: status, a sentence that names time, unknown and remedy, and what was computed so far."""

import sys
import threading

import numpy as np
import pytest
from numba import njit

from gearmbs.dae.integrators.ida import _listening, solve_ida
from gearmbs.dae.integrators.wstiff import solve_wstiff
from gearmbs.dae.result import Status
from gearmbs.dae.solve import solve_dae
from tests.dae.integrators.problems import pendulum
from tests.says import says


@pytest.mark.slow
def test_singular_jacobian_names_the_unknown():
    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] + y[0]
        out[1] = y[1] + y[2] - y[0]
        out[2] = 2.0 * y[1] + 2.0 * y[2] - 2.0 * y[0]

    result = solve_dae(residual, (0.0, 1.0), [1.0, 0.5, 0.5], [-1.0, 0.0, 0.0], names=["a", "left", "right"])
    assert result.status is Status.SINGULAR_JACOBIAN
    assert "left" in result.message or "right" in result.message
    assert "redundant" in result.message
    assert result.t.tolist() == [0.0]


@pytest.mark.slow
def test_jacobian_that_becomes_singular_for_good():
    """Nothing determines z from t = 1 on, and its equation cannot be satisfied."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = max(1.0 - t, 0.0) ** 4 * (y[1] ** 3 + y[1] - np.cos(t)) if t < 1.0 else 0.0 * y[1] + 1.0

    result = solve_dae(residual, (0.0, 2.0), [0.0, 0.6823278], names=["q", "z"], rtol=1e-7)
    assert not result.success
    assert result.status is Status.SINGULAR_JACOBIAN
    assert "z" in result.message
    assert 0.9 < result.t_last
    assert result.t[-1] > 0.5
    assert "t = " in result.message


def test_inconsistent_start_names_the_unknown():
    problem = pendulum()
    problem.y0[:2] = (1.001, 0.0)
    result = solve_wstiff(problem, t_end=1.0, tol=1e-7)
    assert result.status is Status.INCONSISTENT_START
    assert " x " in result.message
    assert "equation 4" in result.message
    assert result.stats.steps == 0
    assert result.t.tolist() == [0.0]


def test_velocity_off_the_constraint_is_inconsistent_too():
    problem = pendulum()
    problem.y0[2] = 0.01
    result = solve_wstiff(problem, t_end=1.0, tol=1e-7)
    assert result.status is Status.INCONSISTENT_START
    assert " u " in result.message


def driven(t, y, yp, out):
    """Index two: y[0] follows sin t, y[1] is its rate."""
    out[0] = yp[0] - y[1]
    out[1] = y[0] - np.sin(t)


@pytest.mark.slow
def test_inconsistent_start_without_rates():
    """The rates that are worked out must not swallow the jump, here from 0.5 to sin 0 = 0."""
    result = solve_dae(driven, (0.0, 1.0), [0.5, 1.0], names=["place", "speed"])
    assert result.status is Status.INCONSISTENT_START
    assert "place" in result.message
    assert "0.5" in result.message


def test_pendulum_off_its_circle_without_rates():
    """Stabilised index 2, 10 % too long."""

    def residual(t, y, yp, out):
        out[0] = yp[0] - y[2] + y[0] * y[5]
        out[1] = yp[1] - y[3] + y[1] * y[5]
        out[2] = yp[2] + y[0] * y[4]
        out[3] = yp[3] + y[1] * y[4] + 9.81
        out[4] = 0.5 * (y[0] ** 2 + y[1] ** 2 - 1.0)
        out[5] = y[0] * y[2] + y[1] * y[3]

    result = solve_dae(residual, (0.0, 1.0), [1.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert result.status is Status.INCONSISTENT_START
    assert "y[0]" in result.message


def test_fast_rates_are_not_taken_for_a_jump():
    """A decay at 1e8 / s moves by 1e-4 in the step that settles the rates, far beyond its tolerance."""

    def residual(t, y, yp, out):
        out[0] = yp[0] + 1e8 * (y[0] - 2.0)

    result = solve_dae(residual, (0.0, 1.0), [1.0])
    assert result.success
    assert result.yp[0, 0] == pytest.approx(1e8, rel=1e-3)
    assert result.y[-1, 0] == pytest.approx(2.0, abs=1e-6)


def test_inconsistent_start_may_be_let_through():
    problem = pendulum()
    problem.y0[0] = 1.0001
    result = solve_wstiff(problem, np.array([0.0, 0.5]), tol=1e-6, check_start=False)
    assert result.success
    assert abs(result.y[-1, 0] ** 2 + result.y[-1, 1] ** 2 - 1) < 1e-5


@pytest.mark.parametrize(("start", "told"), [(0.3, True), (1.0, False)])
def test_replaced_algebraic_unknowns_are_told(start, told):
    """0 = fast - slow: from slow = 1 only fast = 1 is consistent; it is no state, so the run goes on all the same."""

    def residual(t, y, yp, out):
        out[0] = yp[0] + y[1]
        out[1] = y[0] - y[1]

    result = solve_dae(residual, (0.0, 1.0), [1.0, start], names=["slow", "fast"])
    assert result.success
    assert result.y[0, 1] == start
    assert result.y[-1] == pytest.approx([np.exp(-1.0)] * 2, rel=1e-5)
    assert ("did not satisfy the equations: fast." in result.message) is told


def test_wrong_rates_and_multipliers_are_not_inconsistent():
    problem = pendulum()
    problem.yp0[:] = 0.0
    problem.y0[4] = 5.0
    assert solve_wstiff(problem, np.array([0.0, 0.5]), tol=1e-6).success


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.slow
def test_nan_from_a_user_function(compiled):
    def residual(t, y, yp, out):
        out[0] = yp[0] + 1.0 + np.sqrt(y[0])

    fun = njit(residual) if compiled else residual
    with np.errstate(invalid="ignore"):
        result = solve_dae(fun, (0.0, 5.0), [1.0], names=["level"])
    assert result.status is Status.NOT_FINITE
    # y' = -1 - sqrt(y) from 1: with s = sqrt(y), t = 2 (1 - s) - 2 ln(2/(1 + s)), empty at t = 2 - 2 ln 2
    assert result.t_last == pytest.approx(2 - 2 * np.log(2), abs=1e-2)
    assert len(result.t) > 10
    assert "equation 0" in result.message
    assert "division by zero" in result.message


@pytest.mark.slow
@pytest.mark.parametrize("last", [1e-6, 0.01, 1.0])
def test_nan_from_a_time_on_is_named_whatever_the_time(last):
    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - 1.0 / last + (0.0 if t <= last else np.nan)

    result = solve_dae(residual, (0.0, 3.0 * last), [1.0], names=["level"])
    assert result.status is Status.NOT_FINITE
    assert result.t_last == pytest.approx(last, rel=1e-3)
    assert "equation 0" in result.message


def test_nan_at_the_start():
    def residual(t, y, yp, out):
        out[:] = np.nan

    result = solve_dae(residual, (0.0, 1.0), [1.0], [0.0])
    assert result.status is Status.NOT_FINITE
    assert result.stats.steps == 0


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False])
def test_an_event_function_that_is_not_finite_is_named(compiled):
    """The root of a negative number from t = 1 on: its crossings would never be seen."""
    wrap = njit if compiled else (lambda f: f)

    def residual(t, y, yp, out):
        out[0] = yp[0] - 1.0

    def fine(t, y, yp):
        return y[0] - 5.0

    def root(t, y, yp):
        return (1.0 - t) ** 0.5 - 2.0 if t <= 1.0 else np.nan

    result = solve_dae(wrap(residual), (0.0, 3.0), [0.0], [1.0], events=[wrap(fine), wrap(root)])
    assert result.status is Status.NOT_FINITE
    assert "event function 1 is NaN" in result.message
    assert 1.0 <= result.t_last < 3.0
    assert result.t[-1] > 0.0


def test_an_event_function_that_is_not_finite_at_the_start():
    def residual(t, y, yp, out):
        out[0] = yp[0] - 1.0

    result = solve_dae(residual, (0.0, 3.0), [0.0], [1.0], events=lambda t, y, yp: float("nan"))
    assert result.status is Status.NOT_FINITE
    assert "event function 0 is NaN" in result.message
    assert result.t.tolist() == [0.0]


def test_what_sundials_has_to_say_is_in_the_message(capsys):
    """y' = y^2 has a pole at t = 1; the steps run out before it, and nothing is printed."""

    def residual(t, y, yp, out):
        out[0] = yp[0] - y[0] ** 2

    result = solve_dae(residual, (0.0, 2.0), [1.0], [1.0], method="IDA", max_steps=300)
    assert result.status is Status.SOLVER_FAILURE
    assert "mxstep steps taken" in result.message
    assert capsys.readouterr().out == ""


def test_runs_side_by_side_keep_their_messages_apart_and_give_standard_output_back(capsys):
    """The first run to begin is the first to end, as nested redirections could not be."""
    begun, told = threading.Event(), threading.Event()
    texts = []

    def other():
        with _listening() as messages:
            begun.set()
            told.wait(10.0)
            print("[IDA, Error: -4] of the other")
            print("progress")
            texts.append(messages.text)

    before = sys.stdout
    thread = threading.Thread(target=other)
    with _listening() as messages:
        thread.start()
        assert begun.wait(10.0)
        print("[IDA, Error: -1] of this one")
        texts.append(messages.text)
    told.set()
    thread.join()
    assert sys.stdout is before
    assert texts == ["of this one", "of the other"]
    assert capsys.readouterr().out == "progress\n"


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"max_order": 6}, says("max_order", "KMAX", "1", "5", "IDA")),
        ({"rtol": -1.0}, says("rtol", "negative")),
        ({"rtol": float("nan")}, says("rtol", "negative")),
        ({"tol": 0.0}, "tol .ERROR. must be positive"),
        ({"max_step": -1.0}, says("max_step", "HMAX")),
        ({"max_iterations": 0}, says("max_iterations", "MAXIT", "1")),
    ],
)
def test_ida_called_directly_checks_its_arguments(change, names):
    with pytest.raises(ValueError, match=names):
        solve_ida(pendulum(), [0.0, 1.0], **change)


@pytest.mark.slow
def test_the_error_told_is_of_the_step_that_failed():
    """The rates jump without end: the error test fails down to HMIN, and the sentence gives an error above one."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - (np.sin(1e9 * t) if t > 0.5 else 0.0)

    result = solve_dae(residual, (0.0, 1.0), [0.0], [0.0], min_step=1e-3, rtol=0.0, atol=1e-9)
    assert result.status is Status.STEP_TOO_SMALL
    told = float(result.message.split("(")[1].split(" times")[0])
    assert told > 1.0


def test_ida_gives_up_where_the_equations_are_not_finite():
    """The root ends at t = 1, which IDA would approach in ever smaller steps: y = 1 + 2/3 there."""

    def residual(t, y, yp, out):
        out[0] = yp[0] - np.sqrt(1.0 - t if t <= 1.0 else np.nan)

    result = solve_dae(residual, (0.0, 2.0), [1.0], [1.0], method="IDA", names=["level"])
    assert result.status is Status.NOT_FINITE
    assert "t = 1 s: the equation of level is not a finite number" in result.message
    assert result.y[-1, 0] == pytest.approx(5.0 / 3.0, abs=2e-3)
    assert result.stats.residuals < 1000


def test_ida_reports_an_exception_of_the_residual():
    def residual(t, y, yp, out):
        if t > 0.5:
            raise KeyError("stiffness")
        out[0] = yp[0] + y[0]

    result = solve_dae(residual, (0.0, 1.0), [1.0], [-1.0], method="IDA")
    assert result.status is Status.USER_ERROR
    assert "KeyError: 'stiffness'" in result.message


@pytest.mark.slow
def test_step_at_hmin_names_the_dominating_unknown():
    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - 1.0
        out[1] = yp[1] - 1e4 * np.cos(1e4 * t)

    result = solve_dae(residual, (0.0, 1.0), [0.0, 0.0], names=["slow", "fast"], atol=1e-8, min_step=1e-4)
    assert result.status is Status.STEP_TOO_SMALL
    assert "fast" in result.message
    assert "HMIN" in result.message


@pytest.mark.slow
def test_blow_up_stops_close_to_the_pole():
    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - y[0] ** 2

    result = solve_dae(residual, (0.0, 2.0), [1.0], rtol=1e-6)
    assert result.status in (Status.STEP_TOO_SMALL, Status.NEWTON_FAILURE, Status.TOO_MANY_REJECTIONS)
    assert result.t_last == pytest.approx(1.0, abs=1e-3)
    assert result.y[-1, 0] > 1e3


@pytest.mark.slow
def test_a_jump_of_an_algebraic_unknown_is_passed():
    """z jumps from 0 to 1 at t = 0.5, so q ends at 0.5."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = y[1] - (1.0 if t > 0.5 else 0.0)

    for extra in ({}, {"breakpoints": [0.5]}):
        result = solve_dae(residual, (0.0, 1.0), [0.0, 0.0], error_mask=np.ones(2, bool), rtol=1e-6, **extra)
        assert result.success
        assert result.y[-1, 0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.slow
def test_corrector_that_cannot_converge():
    """A Jacobian of the wrong sign and size."""

    @njit
    def residual(t, y, yp, out):
        out[0] = yp[0] + y[0]

    @njit
    def wrong(t, y, yp, cj, out):
        out[0, 0] = -0.1 * cj

    result = solve_dae(residual, (0.0, 1.0), [1.0], [-1.0], jac=wrong, names=["q"], first_step=1e-2)
    assert result.status is Status.TOO_MANY_REJECTIONS
    assert " q" in result.message
    assert "breakpoint" in result.message
    small = solve_dae(residual, (0.0, 1.0), [1.0], [-1.0], jac=wrong, names=["q"], first_step=1e-2, min_step=1e-4)
    assert small.status is Status.NEWTON_FAILURE
    assert "Jacobian" in small.message


@pytest.mark.parametrize(
    ("factor", "start"), [(lambda t, y: 2.0 * y, 0.0), (lambda t, y: t, 0.0), (lambda t, y: np.sin(y) ** 2, 0.0)]
)
def test_a_derivative_that_vanishes_at_the_start_is_named(factor, start):
    def residual(t, y, yp, out):
        out[0] = yp[0] - 1.0
        out[1] = factor(t, y[1]) * yp[1] - 1.0

    with pytest.raises(ValueError, match=says("dG/dy", "start", "slow", "Start")):
        solve_dae(residual, (0.0, 1.0), [0.0, start], names=["clock", "slow"])
    assert solve_dae(residual, (0.01, 0.02), [0.0, 0.1], names=["clock", "slow"]).success


def test_equations_without_derivatives_are_named():
    def residual(t, y, yp, out):
        out[0] = y[0] - np.sin(t)

    with pytest.raises(ValueError, match=says("G", "derivative appears")):
        solve_dae(residual, (0.0, 1.0), [0.0])
    assert solve_dae(residual, (0.0, 1.0), [0.0], error_mask=np.ones(1, bool)).success


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("start", [[1.0, 0.0], [0.0, 1e6]])
def test_a_tolerance_below_rounding_is_refused(start, method):
    @njit
    def oscillator(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = yp[1] + y[0]

    size = max(start)
    result = solve_dae(oscillator, (0.0, 10.0), start, rtol=1e-15, atol=1e-15 * size, method=method)
    assert result.status is Status.BELOW_ROUNDING
    assert "rtol = 4e-15" in result.message
    assert solve_dae(oscillator, (0.0, 1.0), start, rtol=1e-15, atol=1e-12 * size, method=method).success


def test_step_limit():
    result = solve_wstiff(pendulum(), t_end=10.0, tol=1e-8, max_steps=100)
    assert result.status is Status.TOO_MANY_STEPS
    assert "max_steps" in result.message
    assert result.stats.steps == 100
    assert len(result.t) == 101


def test_exception_in_a_python_function():
    def residual(t, y, yp, out):
        if t > 0.5:
            raise RuntimeError("valve stuck")
        out[0] = yp[0] - 1.0

    result = solve_dae(residual, (0.0, 1.0), [0.0])
    assert result.status is Status.USER_ERROR
    assert "valve stuck" in result.message
    assert 0.0 < result.t_last <= 0.5


@pytest.mark.parametrize("method", ["WSTIFF", "IDA"])
def test_a_residual_that_returns_its_values_is_told_where_to_write_them(method):
    def residual(t, y, yp, out):
        return yp + y

    result = solve_dae(residual, (0.0, 1.0), [1.0], [-1.0], method=method)
    assert result.status is Status.USER_ERROR
    assert "the residual returned ndarray; it must write G into its argument out" in result.message


@pytest.mark.parametrize("place", ["event", "jacobian"])
def test_exception_at_the_start_outside_the_residual(place):
    def residual(t, y, yp, out):
        out[0] = yp[0] + y[0]

    def broken(*arguments):
        raise KeyError("stiffness")

    def jacobian(t, y, yp, cj, out):
        broken()

    def event(t, y, yp):
        return broken()

    own = {"events": event} if place == "event" else {"jac": jacobian}
    result = solve_dae(residual, (0.0, 1.0), [1.0], [-1.0], **own)
    assert result.status is Status.USER_ERROR
    assert "KeyError: 'stiffness'" in result.message


def test_every_status_has_a_sentence():
    for status in Status:
        assert status.sentence.endswith(".")
        assert Status(int(status)) is status
