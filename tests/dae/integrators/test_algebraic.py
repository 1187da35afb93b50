"""Algebraic unknowns between the steps: at outputs, at crossings, anywhere in the dense output."""

import pickle
import warnings

import numpy as np
import pytest
from numba import njit

from gearmbs.dae import DAEResult, Status, solve_dae
from gearmbs.mechanism import Mechanism
from tests.dae.integrators.algebraic_families import FAMILIES, Case, case
from tests.generators import cases, seed
from tests.says import says

METHODS = ("WSTIFF", "GSTIFF", "IDA")
BDF = METHODS[:2]
LOST = 1e-6
"""Part of a tolerance that another path to the same root may leave."""


def solved(problem: Case, method: str, rtol: float, times: np.ndarray) -> DAEResult:
    start = np.zeros(1)
    return solve_dae(
        problem.residual, (0.0, problem.t_end), problem.solution(start)[0], problem.slope(start)[0],
        rtol=rtol, atol=rtol * problem.size, t_eval=times, method=method,
    )  # fmt: skip


@pytest.mark.slow
def test_every_output_of_random_problems_is_within_a_hundred_tolerances():
    """The tolerance of an algebraic unknown is its own, and what those of the differential ones make of it."""
    count, messages = cases(35), []
    for k in range(count):
        rng = np.random.default_rng([seed(), k])
        problem = case(rng, FAMILIES[k % len(FAMILIES)])
        method, rtol = METHODS[k // len(FAMILIES) % len(METHODS)], 10.0 ** rng.uniform(-9, -4)
        times = np.append(np.sort(rng.uniform(0.0, problem.t_end, 100)), problem.t_end)
        result = solved(problem, method, rtol, times)
        where = f"case {k}: {problem.name}, {method}, rtol {rtol:.0e}"
        if not result.success:
            messages.append(f"{where}: {result.message}")
            continue
        exact = problem.solution(times)
        allowed = rtol * (problem.size + np.abs(exact) + problem.reach(times) * problem.algebraic)
        assert (np.abs(result.y - exact) < 100.0 * allowed).all(), where
        assert "could not be solved" not in result.message, where
        assert "max_step" not in result.message, where
    assert len(messages) <= 0.05 * count, "\n".join(messages)


@njit
def read_out(t, y, yp, out):
    """y2 = sin 20 y1: the steps of y1 = t are long, for it is a polynomial."""
    out[0] = yp[0] - 1.0
    out[1] = y[1] - np.sin(20.0 * y[0])


@njit
def pressed(t, y, yp, out):
    """Read out of an oscillator: the force of a contact that is touched twice a period."""
    out[0] = yp[0] - y[1]
    out[1] = yp[1] + y[0]
    out[2] = y[2] - 1000.0 * max(0.0, y[0] - 0.5) ** 1.5


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.slow
def test_a_fast_read_out_of_a_slow_unknown(method):
    times = np.linspace(0.0, 3.0, 301)
    result = solve_dae(read_out, (0.0, 3.0), [0.0, 0.0], rtol=1e-8, t_eval=times, method=method)
    # IDA has unknowns of index one under error control, and follows them
    assert result.stats.steps < (60 if method in BDF else 2000)
    np.testing.assert_allclose(result.y[:, 1], np.sin(20.0 * times), atol=1e-10)
    # slopes: by differences over the step, whatever the guess of the start was
    np.testing.assert_allclose(result.yp[:, 1], 20.0 * np.cos(20.0 * times), atol=1e-4)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.slow
def test_a_contact_never_pulls(method):
    times = np.linspace(0.0, 20.0, 1001)
    result = solve_dae(pressed, (0.0, 20.0), [1.0, 0.0, 1000.0 * 0.5**1.5], rtol=1e-8, t_eval=times, method=method)
    assert result.y[:, 2].min() == 0.0
    # dF/dx is 1060 N/m at most, and x within 200 tolerances of 1e-8 after three periods
    np.testing.assert_allclose(result.y[:, 2], 1000.0 * np.maximum(0.0, np.cos(times) - 0.5) ** 1.5, atol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", BDF)
def test_dense_output_and_outputs_are_one_and_travel(method):
    options = {"rtol": 1e-7, "atol": 1e-7, "method": method}
    start = [1.0, 0.0, 1000.0 * 0.5**1.5]
    result = solve_dae(pressed, (0.0, 10.0), start, dense_output=True, **options)
    times = np.linspace(0.0, 10.0, 400)
    sampled = solve_dae(pressed, (0.0, 10.0), start, t_eval=times, **options)
    allowed = LOST * (1e-7 + 1e-7 * np.abs(sampled.y))
    # and the rounding of x times dF/dx
    assert (np.abs(result.sol(times) - sampled.y) <= allowed + 1e-11).all()
    travelled = pickle.loads(pickle.dumps(result)).sol
    assert (np.abs(travelled(times) - sampled.y)[:, :2] <= 1e-13).all()
    # the table is as fine as the tolerance asks for, but where the force sets in, its slope as a root of the distance
    assert (np.abs(travelled(times) - sampled.y)[:, 2] < 1e-7 + 1e-7 * np.abs(sampled.y[:, 2])).all()
    # and again, without the equations
    again = pickle.loads(pickle.dumps(travelled))
    np.testing.assert_array_equal(again(times), travelled(times))


@pytest.mark.slow
def test_an_output_does_not_depend_on_the_others():
    @njit
    def loop(t, y, yp, out):
        out[0] = yp[0] + y[0] - y[1]
        out[1] = y[1] + 0.4 * np.tanh(y[2]) - np.sin(9.0 * t) * y[0]
        out[2] = y[2] - 0.5 * np.tanh(y[1]) - 1.0

    options = {"rtol": 1e-6, "atol": 1e-6}
    many = solve_dae(loop, (0.0, 4.0), [1.0, 0.0, 1.0], t_eval=np.linspace(0.0, 4.0, 101), **options)
    few = solve_dae(loop, (0.0, 4.0), [1.0, 0.0, 1.0], t_eval=np.linspace(0.0, 4.0, 5), **options)
    assert np.abs(many.y[25::25] - few.y[1:]).max() < 10.0 * LOST * 1e-6


@njit
def height(t, y, yp):
    return y[1] - 0.3


@pytest.mark.parametrize("method", BDF)
@pytest.mark.slow
def test_every_crossing_of_an_algebraic_unknown_is_found_and_located(method):
    """Several lie in one step."""
    result = solve_dae(read_out, (0.0, 3.0), [0.0, 0.0], rtol=1e-8, events=height, method=method)
    base, k = np.arcsin(0.3), np.arange(10)
    exact = np.sort(np.concatenate((base + 2.0 * np.pi * k, np.pi - base + 2.0 * np.pi * k))) / 20.0
    exact = exact[exact < 3.0]
    assert result.stats.steps < 60
    np.testing.assert_allclose(result.t_events[0], exact, atol=1e-10)
    np.testing.assert_allclose(result.y_events[0][:, 1], 0.3, atol=1e-10)


@pytest.mark.parametrize("method", BDF)
@pytest.mark.parametrize("occurrence", [1, 3, 4])
def test_the_run_ends_at_the_occurrence_asked_for_within_a_step(method, occurrence):
    def event(t, y, yp):
        return y[1] - 0.3

    event.terminal = occurrence
    result = solve_dae(read_out, (0.0, 3.0), [0.0, 0.0], rtol=1e-8, events=event, method=method)
    base, turns = np.arcsin(0.3), (occurrence - 1) // 2
    exact = ((base if occurrence % 2 else np.pi - base) + 2.0 * np.pi * turns) / 20.0
    assert result.status is Status.TERMINAL_EVENT
    assert len(result.t_events[0]) == occurrence
    assert result.t[-1] == pytest.approx(exact, abs=1e-10)


@pytest.mark.slow
def test_a_branch_is_followed():
    """z^2 = 1 + 0.8 sin 30 t has two roots; a straight guess over a radian is near either of them."""

    @njit
    def branches(t, y, yp, out):
        out[0] = yp[0] - 1.0
        out[1] = y[1] ** 2 - 1.0 - 0.8 * np.sin(30.0 * y[0])

    times = np.linspace(0.0, 3.0, 200)
    result = solve_dae(branches, (0.0, 3.0), [0.0, 1.0], rtol=1e-6, t_eval=times, method="IDA", max_step=0.03)
    np.testing.assert_allclose(result.y[:, 1], np.sqrt(1.0 + 0.8 * np.sin(30.0 * times)), atol=1e-6)
    assert "could not be solved" not in result.message


def test_what_no_equation_determines_at_an_instant_is_told():
    """The pendulum of index three: the multiplier hangs on the second derivative of the constraint."""

    def pendulum(t, y, yp, out):
        out[0] = yp[0] - y[2]
        out[1] = yp[1] - y[3]
        out[2] = yp[2] + y[0] * y[4]
        out[3] = yp[3] + y[1] * y[4] + 1.0
        out[4] = 0.5 * (y[0] ** 2 + y[1] ** 2 - 1.0)

    def of_index_two(t, y, yp, out):
        pendulum(t, y, yp, out)
        out[4] = y[0] * y[2] + y[1] * y[3]

    start, times = [1.0, 0.0, 0.0, 0.0, 0.0], np.linspace(0.0, 1.0, 41)
    mask = np.array([True, True, False, False, False])
    names = ["x", "y", "u", "v", "tension"]
    third = solve_dae(pendulum, (0.0, 1.0), start, rtol=1e-6, t_eval=times, error_mask=mask, names=names)
    assert third.success
    assert "tension is interpolated" in third.message
    second = solve_dae(of_index_two, (0.0, 1.0), start, rtol=1e-8, t_eval=times, names=names)
    assert "interpolated" not in second.message
    # energy and acceleration towards the centre: lambda = u^2 + v^2 - y = -3 y
    np.testing.assert_allclose(second.y[:, 4], -3.0 * second.y[:, 1], atol=1e-6)


@pytest.mark.parametrize("formulation", ["SI2", "SI1", "I3"])
@pytest.mark.parametrize("integrator", METHODS)
def test_a_recorded_state_of_a_force(integrator, formulation):
    def pull(t, frames, states, parameters, wrench, rates, diagnostics):
        x = frames[0, 0] - frames[1, 0]
        wrench[0, 0] = -parameters[0] * x
        rates[0] = 1000.0 * max(0.0, x - 0.5) ** 1.5

    m = Mechanism("contact read out")
    body = m.body("ball", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(1.0, 0.0, 0.0))
    m.gravity = (0.0, 0.0, 0.0)
    m.force("spring", pull, body.marker(), m.ground.marker(), parameters={"k": 1.0}, algebraic={"F": 1000.0 * 0.5**1.5})
    solution = m.simulate(10.0, rate=40.0, tol=1e-7, integrator=integrator, formulation=formulation)
    assert solution.success
    x = solution.com_position("ball")[:, 0]
    np.testing.assert_allclose(solution.state("spring.F"), 1000.0 * np.maximum(0.0, x - 0.5) ** 1.5, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("weight", [9.81, -1e3])
def test_a_multiplier_beside_what_is_zero_at_the_start(weight, method):
    """A pendulum from rest at right angles to its weight: its force along y is y times the tension, both zero."""

    def pendulum(t, y, yp, out):
        out[0], out[1] = yp[0] - y[2], yp[1] - y[3]
        out[2], out[3] = yp[2] + y[0] * y[4], yp[3] + y[1] * y[4] + weight
        out[4] = y[0] * y[2] + y[1] * y[3]

    end = 2.0 / np.sqrt(abs(weight))
    found = solve_dae(
        pendulum, (0.0, end), [1.0, 0.0, 0.0, 0.0, 0.0], method=method, t_eval=np.linspace(0.0, end, 30), rtol=1e-7,
        atol=1e-9,
    )  # fmt: skip
    assert found.success, found.message
    assert "could not" not in found.message
    _, y, u, v, tension = found.y.T
    np.testing.assert_allclose(tension, u**2 + v**2 - weight * y, rtol=1e-5, atol=1e-5 * abs(weight))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("loads", ["none", "before", "behind"])
def test_a_multiplier_at_a_breakpoint_is_that_of_one_side(loads, method):
    """Of x = sin t + 2 max(0, t - b), and of loads on it that jump at b, which belongs to either side."""
    b = 0.7

    def kinked(t, y, yp, out):
        pushed = 0.0 if loads == "none" or t < b or (t == b and loads == "before") else 5.0
        out[0] = yp[0] - y[1] - y[2] - pushed
        out[1] = yp[1] + y[0]
        out[2] = y[0] - np.sin(t) - 2.0 * max(0.0, t - b)

    times = np.array([0.0, 0.3, b - 1e-4, np.nextafter(b, 0.0), b, np.nextafter(b, 1.0), b + 1e-9, b + 1e-5, 1.4, 2.0])
    behind = np.maximum(times - b, 0.0)
    speed = np.cos(times) - 1.0 - behind**2
    moved = (times > b) | ((times == b) & (loads == "behind"))
    multiplier = np.cos(times) + 2.0 * moved - speed - 5.0 * moved * (loads != "none")
    more = {"dense_output": True} if method in BDF else {}
    found = solve_dae(
        kinked, (0.0, 2.0), [0.0, 0.0, 1.0], method=method, breakpoints=[b], t_eval=times, rtol=1e-8, atol=1e-8, **more
    )
    assert found.success, found.message
    np.testing.assert_allclose(found.y[:, 2], multiplier, atol=2e-6)
    if more:
        np.testing.assert_allclose(found.sol(times[1:])[:, 2], multiplier[1:], atol=2e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("held", [True, False])
@pytest.mark.slow
def test_a_multiplier_at_the_ends_of_a_run_is_that_of_the_inside(held, method):
    """Of x = 3 t + t^2, tabulated with the span and held outside it, or going on."""

    def tabulated(t, y, yp, out):
        seen = min(max(t, 0.5), 1.5) if held else t
        out[0] = yp[0] - y[1]
        out[1] = y[0] - 3.0 * seen - seen**2

    times = np.array([0.5, 0.5 + 1e-9, 0.7, 1.0, 1.4, 1.5 - 1e-5, 1.5])
    for breakpoints, outputs in (([], times), ([0.6, 1.2], times[[0, 3, 6]]), ([], None)):
        found = solve_dae(
            tabulated, (0.5, 1.5), [1.75, 4.0], [4.0, 2.0], method=method, breakpoints=breakpoints, t_eval=outputs,
            rtol=1e-8, atol=1e-8,
        )  # fmt: skip
        assert found.success, found.message
        assert "did not satisfy" not in found.message
        # at its steps an integrator has an unknown without error control from the corrector
        allowed = 1e-3 if outputs is None else 2e-6
        np.testing.assert_allclose(found.y[:, 1], 3.0 + 2.0 * found.t, atol=allowed)


@pytest.mark.parametrize("method", METHODS)
def test_a_multiplier_that_starts_without_a_slope_stays_as_given(method):
    """Of x = t^1.5, which is no number before 0."""

    def rooted(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = y[0] - t * (np.sqrt(t) if t >= 0.0 else np.nan)

    found = solve_dae(rooted, (0.0, 1.0), [0.0, 0.0], method=method, t_eval=[0.0, 0.25, 1.0])
    assert found.success, found.message
    np.testing.assert_allclose(found.y[:, 1], [0.0, 0.75, 1.5], atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-11])
def test_a_multiplier_guessed_at_the_start_is_solved_for(rtol, method):
    """Also where rounding of the constraint, x = 1000 + sin 30 t, is more than its tolerance."""

    def swinging(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = y[0] - 1000.0 - np.sin(30.0 * t)

    found = solve_dae(swinging, (0.0, 0.2), [1000.0, 0.0], method=method, t_eval=[0.0, 0.2], rtol=rtol, atol=rtol)
    assert found.success, found.message
    np.testing.assert_allclose(found.y[:, 1], 30.0 * np.cos(30.0 * found.t), rtol=1e-5)


def pulsed(t, y, yp, out):
    """A pulse of index one, 0.09 long in all."""
    out[0] = yp[0] - y[1]
    out[1] = y[1] - 100.0 * np.exp(-(((t - 50.0) / 0.05) ** 2))


def displaced(t, y, yp, out):
    """One in a constraint, of index two."""
    out[0] = yp[0] - y[1]
    out[1] = y[0] - np.sin(0.1 * t) - np.exp(-(((t - 50.0) / 0.05) ** 2))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("problem", "rate", "when"), [(pulsed, 0.0, "50"), (displaced, 0.1, "50.1")])
def test_an_output_that_shows_what_no_step_has_seen_is_told(problem, rate, when, method):
    """A pulse shorter than the steps; where they are told of it they resolve it, and nothing is said."""
    times = np.linspace(0.0, 100.0, 1001)
    options = {"t_eval": times, "method": method}
    with pytest.warns(UserWarning, match=says(f"t = {when}", "y[1]", "breakpoints", "max_step")):
        passed = solve_dae(problem, (0.0, 100.0), [0.0, rate], **options)
    assert "max_step" in passed.message
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = solve_dae(problem, (0.0, 100.0), [0.0, rate], breakpoints=[50.0], **options)
        # without an output in it
        unseen = solve_dae(problem, (0.0, 100.0), [0.0, rate], **{**options, "t_eval": times[::300]})
    assert "max_step" not in told.message + unseen.message
    if problem is pulsed:
        np.testing.assert_allclose(told.y[-1, 0], np.sqrt(np.pi) * 5.0, rtol=1e-4)


@pytest.mark.parametrize("method", BDF)
def test_dense_output_that_shows_what_no_step_has_seen_is_told(method):
    passed = solve_dae(pulsed, (0.0, 100.0), [0.0, 0.0], dense_output=True, method=method)
    with pytest.warns(UserWarning, match=says("t = 50", "y[1]", "breakpoints", "max_step")):
        passed.sol(50.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        passed.sol(np.linspace(0.0, 49.0, 50))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_what_concerns_no_differential_unknown_is_not_told(method, rtol):
    """Read-outs, contacts, and jumps, at breakpoints or found, at outputs next to them too."""

    def stepped(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = y[1] - (3.0 if t >= 1.0 else 1.0)

    times = np.sort(np.append(np.linspace(0.0, 3.0, 61), [1.0 - 1e-6, np.nextafter(1.0, 0.0), np.nextafter(1.0, 2.0)]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solve_dae(read_out, (0.0, 3.0), [0.0, 0.0], rtol=rtol, t_eval=times, method=method)
        solve_dae(pressed, (0.0, 3.0), [1.0, 0.0, 1e3 * 0.5**1.5], rtol=rtol, t_eval=times, method=method)
        solve_dae(stepped, (0.0, 3.0), [0.0, 1.0], rtol=rtol, t_eval=times, method=method, breakpoints=[1.0])
        solve_dae(stepped, (0.0, 3.0), [0.0, 1.0], rtol=rtol, t_eval=times, method=method)
