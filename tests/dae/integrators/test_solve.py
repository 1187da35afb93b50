"""The user's call: functions compiled or not, Jacobians, masks, events, methods."""

import numpy as np
import pytest
from numba import njit

from gearmbs.dae.integrators.differences import colour_columns
from gearmbs.dae.solve import solve_dae
from tests.dae.integrators.problems import pendulum
from tests.says import says


def robertson(t, y, yp, out):
    out[0] = yp[0] + 0.04 * y[0] - 1e4 * y[1] * y[2]
    out[1] = yp[1] - 0.04 * y[0] + 1e4 * y[1] * y[2] + 3e7 * y[1] ** 2
    out[2] = y[0] + y[1] + y[2] - 1.0


# published end values at t = 40, Hairer and Wanner II, section IV.10: 0.7158, 0.9185e-5, 0.2842
ROBERTSON_40 = np.array([0.7158270688, 9.185534765e-6, 0.2841637457])


@pytest.mark.slow
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF", "IDA"])
@pytest.mark.parametrize("compiled", [True, False])
def test_robertson(method, compiled):
    fun = njit(robertson) if compiled else robertson
    result = solve_dae(
        fun,
        (0.0, 40.0),
        [1.0, 0.0, 0.0],
        method=method,
        rtol=1e-7,
        atol=1e-11,
        t_eval=[40.0],
        error_mask=np.ones(3, bool),
    )
    assert result.success
    np.testing.assert_allclose(result.y[-1], ROBERTSON_40, rtol=2e-6)


def oscillator(t, y, yp, out, p):
    out[0] = yp[0] - y[1]
    out[1] = yp[1] + p[0] * y[0]


def oscillator_jacobian(t, y, yp, cj, out, p):
    out[0, 0], out[0, 1] = cj, -1.0
    out[1, 0], out[1, 1] = p[0], cj


def oscillator_entries(t, y, yp, cj, out, p):
    out[0], out[1], out[2], out[3] = cj, p[0], -1.0, cj


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("kind", ["differences", "dense", "entries"])
def test_jacobian_in_every_form(compiled, kind):
    wrap = njit if compiled else (lambda f: f)
    options = {"dense": {"jac": wrap(oscillator_jacobian)}, "differences": {}}.get(
        kind, {"jac": wrap(oscillator_entries), "jac_sparsity": np.ones((2, 2))}
    )
    result = solve_dae(wrap(oscillator), (0.0, 2.0), [1.0, 0.0], p=[9.0], rtol=1e-8, atol=1e-8, t_eval=[2.0], **options)
    assert result.y[-1, 0] == pytest.approx(np.cos(6.0), abs=1e-5)


@pytest.mark.slow
def test_jacobian_by_coloured_differences_on_a_band():
    n = 60

    @njit
    def heat(t, y, yp, out):
        for i in range(n):
            left = y[i - 1] if i > 0 else 0.0
            right = y[i + 1] if i < n - 1 else 0.0
            out[i] = yp[i] - 100.0 * (left - 2.0 * y[i] + right)

    x = np.arange(1, n + 1) * np.pi / (n + 1)
    decay = 200.0 * (1 - np.cos(np.pi / (n + 1)))
    band = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= 1
    result = solve_dae(heat, (0.0, 1.0), np.sin(x), rtol=1e-8, atol=1e-10, jac_sparsity=band, t_eval=[1.0])
    np.testing.assert_allclose(result.y[-1], np.sin(x) * np.exp(-decay), rtol=1e-5)


def test_a_band_needs_as_many_colours_as_its_width():
    n = 50
    rows = [np.arange(max(0, j - 1), min(n, j + 2)) for j in range(n)]
    indptr = np.concatenate(([0], np.cumsum([len(r) for r in rows]))).astype(np.int64)
    colours = np.empty(n, dtype=np.int64)
    assert colour_columns(indptr, np.concatenate(rows).astype(np.int64), colours) == 3
    for j in range(n - 2):
        assert len({*colours[j : j + 3]}) == 3


def falling(t, y, yp, out):
    out[0] = yp[0] - y[1]
    out[1] = yp[1] + 9.81


def height(t, y, yp):
    return y[0]


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False])
def test_terminal_event(compiled):
    wrap = njit if compiled else (lambda f: f)

    def ground(t, y, yp):
        return y[0]

    ground.terminal = True
    ground.direction = -1
    result = solve_dae(wrap(falling), (0.0, 10.0), [10.0, 0.0], rtol=1e-9, atol=1e-9, events=wrap(ground))
    impact = np.sqrt(20.0 / 9.81)
    assert result.status == 1
    assert result.t_last == pytest.approx(impact, abs=1e-7)
    assert result.t_events[0] == pytest.approx([impact], abs=1e-7)
    assert result.t[-1] == result.t_last
    assert abs(result.y[-1, 0]) < 1e-12
    np.testing.assert_allclose(result.y_events[0][0], result.y[-1], atol=1e-12)


@pytest.mark.parametrize("inner", [True, False])
@pytest.mark.slow
def test_attributes_of_a_compiled_event_stand_on_it_or_on_what_it_was_made_from(inner):
    def ground(t, y, yp):
        return y[0] - 4.0

    event = njit(ground)
    (ground if inner else event).terminal = True
    (ground if inner else event).direction = -1
    result = solve_dae(falling, (0.0, 1.3), [10.0, 0.0], rtol=1e-8, atol=1e-8, events=event)
    assert result.status == 1
    assert result.t_last == pytest.approx(np.sqrt(12.0 / 9.81), abs=1e-6)
    (ground if inner else event).direction = 1
    assert solve_dae(falling, (0.0, 1.3), [10.0, 0.0], rtol=1e-8, atol=1e-8, events=event).success


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
def test_terminal_counts_occurrences(compiled, method):
    """cos crosses zero upward at 3 pi/2 + 2 k pi; the third time ends the run, as in scipy."""
    wrap = njit if compiled else (lambda f: f)

    def circle(t, y, yp, out):
        out[0] = yp[0] + y[1]
        out[1] = yp[1] - y[0]

    def upward(t, y, yp):
        return y[0]

    def half(t, y, yp):
        return y[1] - 0.5

    upward.direction = 1
    upward.terminal = 3
    result = solve_dae(
        wrap(circle), (0.0, 50.0), [1.0, 0.0], [0.0, 1.0], rtol=1e-9, atol=1e-9, events=[wrap(upward), wrap(half)],
        method=method,
    )  # fmt: skip
    assert result.status == 1
    third = 1.5 * np.pi + 4.0 * np.pi
    assert result.t_last == pytest.approx(third, abs=1e-6)
    assert result.t_events[0] == pytest.approx(third - 2.0 * np.pi * np.array([2, 1, 0]), abs=1e-6)
    # sin = 1/2 twice a turn
    assert len(result.t_events[1]) == 6


@pytest.mark.parametrize("terminal", [-1, 1.5])
def test_terminal_must_be_a_count(terminal):
    def event(t, y, yp):
        return y[0]

    event.terminal = terminal
    with pytest.raises(ValueError, match="terminal of event is"):
        solve_dae(falling, (0.0, 1.0), [10.0, 0.0], events=event)


@pytest.mark.slow
def test_directions_and_several_events():
    """cos crosses zero downward at pi/2 + 2 k pi and upward at 3 pi/2 + 2 k pi; sin - 1/2 both ways."""

    @njit
    def circle(t, y, yp, out):
        out[0] = yp[0] + y[1]
        out[1] = yp[1] - y[0]

    def down(t, y, yp):
        return y[0]

    def up(t, y, yp):
        return y[0]

    def both(t, y, yp):
        return y[1] - 0.5

    down.direction, up.direction = -1, 1
    result = solve_dae(circle, (0.0, 13.0), [1.0, 0.0], rtol=1e-9, atol=1e-9, events=[down, up, both])
    expected = (
        np.pi * np.array([0.5, 2.5]),
        np.pi * np.array([1.5, 3.5]),
        np.pi * np.array([1 / 6, 5 / 6, 13 / 6, 17 / 6, 25 / 6]),
    )
    for found, times in zip(result.t_events, expected):
        np.testing.assert_allclose(found, times[times < 13.0], atol=1e-6)
    np.testing.assert_allclose(result.y_events[2][:, 1], 0.5, atol=1e-12)


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
@pytest.mark.parametrize("below", [1e-2, 1e-4, 1e-6, -1e-6])
def test_events_that_come_and_go_within_a_step_are_found(method, below):
    """A ball that rises above a level near its greatest height for less than a step; above its greatest it never is."""
    top = 10.0**2 / (2 * 9.81)

    def thrown(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = yp[1] + 9.81

    def level(t, y, yp):
        return y[0] - (top - below)

    found = solve_dae(thrown, (0.0, 2.0), [0.0, 10.0], events=level, rtol=1e-9, atol=1e-11, method=method)
    off = np.sqrt(2 * max(below, 0.0) / 9.81)
    expected = 10.0 / 9.81 + np.array([-off, off] if below > 0.0 else [])
    # the height may be off by its tolerance, times the growth of its error
    np.testing.assert_allclose(found.t_events[0], expected, atol=1e-7 / (9.81 * off) if off else 0.0)
    level.terminal = True
    level.direction = -1
    ended = solve_dae(thrown, (0.0, 2.0), [0.0, 10.0], events=level, rtol=1e-9, atol=1e-11, method=method)
    assert ended.t[-1] == (pytest.approx(expected[1], abs=1e-7 / (9.81 * off)) if off else 2.0)


@pytest.mark.parametrize(("below", "above"), [(1.0, 1.0), (1e9, 1.0), (1.0, 1e9)])
def test_a_jump_is_found_to_rounding(below, above):
    """A function that jumps through zero has no root, and its values say nothing of where it jumps."""

    def event(t, y, yp):
        return -below if t < 0.7312 else above

    event.terminal = True
    result = solve_dae(falling, (0.0, 1.0), [10.0, 0.0], events=event)
    assert result.t[-1] == pytest.approx(0.7312, rel=1e-15)
    assert result.t[-1] >= 0.7312


@pytest.mark.slow
def test_restart_at_an_event():
    """A spring that acts on one side only: the run lands on each contact, beyond which orders are low again."""

    @njit
    def one_sided(t, y, yp, out):
        out[0] = yp[0] - y[1]
        out[1] = yp[1] + (100.0 * y[0] if y[0] < 0.0 else 1.0 * y[0])

    def touch(t, y, yp):
        return y[0]

    touch.restart = True
    result = solve_dae(one_sided, (0.0, 5.0), [1.0, 0.0], rtol=1e-9, atol=1e-10, events=touch)
    # a quarter of the slow period, half of the fast one, half of the slow one
    times = np.pi * np.array([0.5, 0.6])
    np.testing.assert_allclose(result.t_events[0][:2], times, atol=1e-6)
    t, orders = result.stats.t_steps, result.stats.orders
    for mark in result.t_events[0]:
        # the past foretells the step beyond only as far as the kink allows: order one, or two where the step is short
        after = np.searchsorted(t, mark * (1 + 1e-12), side="right")
        assert orders[after] <= 2


@pytest.mark.slow
def test_masks_and_names_and_dense_output():
    result = solve_dae(
        njit(robertson), (0.0, 10.0), [1.0, 0.0, 0.0], rtol=1e-6, atol=1e-10, dense_output=True, names=["a", "b", "c"]
    )
    t = np.linspace(0.5, 9.5, 19)
    np.testing.assert_allclose(result.sol(t).sum(axis=1), 1.0, atol=1e-6)
    assert result.sol(0.0).tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize("method", ["WSTIFF", "GSTIFF"])
def test_index_three_with_the_positions_under_control(method):
    """A unit pendulum released from the horizontal: v^2 / 2 + g y = 0, so the rod pulls with v^2 - g y = -3 g y.

    Nothing controls the error of the force: with fixed leading coefficients it is off by up to 3 % behind a change of
    the step, and by less than 1 % between.
    """

    def residual(t, y, yp, out):
        out[0] = yp[0] - y[2]
        out[1] = yp[1] - y[3]
        out[2] = yp[2] + y[0] * y[4]
        out[3] = yp[3] + y[1] * y[4] + 9.81
        out[4] = y[0] ** 2 + y[1] ** 2 - 1.0

    positions = np.array([True, True, False, False, False])
    result = solve_dae(residual, (0.0, 1.0), [1.0, 0.0, 0.0, 0.0, 0.0], error_mask=positions, method=method)
    assert result.success
    energy = 0.5 * (result.y[:, 2] ** 2 + result.y[:, 3] ** 2) + 9.81 * result.y[:, 1]
    assert np.abs(energy).max() < 1e-3
    late = result.t > 0.5
    off = result.y[late, 4] / (-3.0 * 9.81 * result.y[late, 1]) - 1.0
    assert np.median(np.abs(off)) < 1e-2


@pytest.mark.slow
def test_rates_are_worked_out():
    result = solve_dae(njit(oscillator), (0.0, 1.0), [1.0, 0.0], p=[4.0])
    np.testing.assert_allclose(result.yp[0], [0.0, -4.0], atol=1e-9)


def test_problem_with_its_own_tolerances():
    a = solve_dae(pendulum(), (0.0, 1.0), tol=1e-9, t_eval=[1.0])
    b = solve_dae(pendulum(), (0.0, 1.0), tol=1e-9, t_eval=[1.0], method="IDA")
    np.testing.assert_allclose(a.y[-1, :4], b.y[-1, :4], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "names"),
    [
        ({"method": "Euler"}, says("method", "'Euler'", "choose", "WSTIFF")),
        ({"t_span": (1.0, 0.0)}, "t_span"),
        ({"y0": None}, says("y0", "missing")),
        ({"y0": []}, says("y0", "empty")),
        ({"yp0": [0.0]}, "yp0"),
        ({"atol": [1e-6] * 3}, "atol"),
        ({"atol": 0.0}, "atol"),
        ({"error_mask": [1, 0]}, says("error_mask", "2 booleans", "int64")),
        ({"error_mask": np.zeros(2, bool)}, says("error_mask", "set it", "unknowns")),
        ({"jac_sparsity": np.ones((3, 3))}, "jac_sparsity"),
        ({"fun": lambda t, y: None}, says("2 arguments", "4", "5", "p")),
        ({"method": "IDA", "dense_output": True}, says("method='IDA'", "dense_output", "tol")),
        ({"method": "IDA", "corrector": "modified"}, "corrector"),
        ({"corector": "modified"}, "corector; .* corrector, "),
        ({"method": "IDA", "max_order": 6}, "max_order"),
        ({"method": "IDA", "rtol": -1e-6}, "rtol"),
        ({"method": "IDA", "t_eval": []}, says("t_eval", "(0,)", "at least one")),
    ],
)
def test_wrong_arguments_are_named(change, names):
    arguments = {"fun": falling, "t_span": (0.0, 1.0), "y0": [1.0, 0.0]} | change
    with pytest.raises(ValueError, match=names):
        solve_dae(arguments.pop("fun"), arguments.pop("t_span"), arguments.pop("y0"), **arguments)
