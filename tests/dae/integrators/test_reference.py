"""The standard problems: exact Jacobians, references that agree, error that falls with the tolerance."""

import numpy as np
import pytest

from benchmarks.problems.chain import four_bar_chain
from benchmarks.problems.reference import chain_problem, reference_problems
from gearmbs.dae.integrators.bdf import HISTORY
from gearmbs.dae.integrators.wstiff import solve_wstiff

PROBLEMS = reference_problems()
SINGULAR_POSITIONS = 2
"""That the chain passes within two seconds: all its links are in line near t = 0.72 and 1.24 s."""
CASES = [(name, form) for name in PROBLEMS for form in ("I3", "SI2", "SI1")]


@pytest.mark.parametrize(("name", "formulation"), CASES)
@pytest.mark.slow
def test_jacobian_against_central_differences(name, formulation):
    problem = four_bar_chain(3, formulation) if "chain" in name else PROBLEMS[name].make(formulation)
    rng = np.random.default_rng(0)
    n = problem.n
    y = problem.y0 + 0.3 * rng.normal(size=n) * problem.scale
    yp = rng.normal(size=n) * problem.scale
    t, cj = 0.37, 2.3
    work, vals = np.zeros(problem.work_size), np.zeros(len(problem.indices))
    problem.jacobian(t, y, yp, cj, vals, problem.idata, problem.rdata, work)
    exact = np.zeros((n, n))
    exact[problem.indices, np.repeat(np.arange(n), np.diff(problem.indptr))] = vals

    def residual(d):
        out = np.zeros(n)
        problem.residual(t, y + d, yp + cj * d, out, problem.idata, problem.rdata, work)
        return out

    columns = []
    for j in range(n):
        d = np.zeros(n)
        d[j] = 1e-6 * problem.scale[j]
        columns.append((residual(d) - residual(-d)) / 2e-6)
    differenced = np.array(columns).T
    size = np.abs(differenced).max(axis=1, keepdims=True)
    assert (np.abs(exact * problem.scale - differenced) <= 1e-8 * size + 1e-14).all()


@pytest.mark.parametrize(("name", "formulation"), CASES)
def test_start_is_consistent(name, formulation):
    problem = PROBLEMS[name].make(formulation)
    out = np.zeros(problem.n)
    problem.residual(0.0, problem.y0, problem.yp0, out, problem.idata, problem.rdata, np.zeros(problem.work_size))
    assert np.abs(out).max() < 1e-12 * max(1.0, np.abs(problem.yp0).max())


@pytest.mark.parametrize("name", list(PROBLEMS))
def test_error_falls_with_the_tolerance(name):
    """Order k at fixed order gives an error of tol^(k/(k+1)): 0.75 to 0.86 for the orders 3 to 6 that are used.

    The order rises as the tolerance falls, which adds to the power; chaotic parts of the error scatter by +- 0.1.
    """
    reference = PROBLEMS[name]
    problem = reference.make("SI2")
    tolerances = 10.0 ** -np.arange(5.0, 9.1, 0.5)
    errors = []
    for tol in tolerances:
        result = solve_wstiff(problem, reference.times, tol=tol)
        assert result.success, result.message
        errors.append(reference.error(result.t, result.y))
    power = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.65 < power < 1.15
    # 1e-9 a step, up to 3,000 steps, and a growth of up to ten along the motion (heavy top)
    assert errors[-1] < 3e-5


@pytest.mark.parametrize(("k", "slack"), [(1, 0.12), (2, 0.12), (3, 0.15), (4, 0.15)])
def test_power_of_the_tolerance_at_fixed_order(k, slack):
    reference = PROBLEMS["slider crank"]
    problem = reference.make("SI2")
    tolerances = np.array([1e-4, 1e-5, 1e-6, 1e-7]) if k < 3 else np.array([1e-5, 1e-6, 1e-7, 1e-8, 1e-9])
    errors = []
    for tol in tolerances:
        result = solve_wstiff(problem, reference.times, tol=tol, max_order=k)
        errors.append(reference.error(result.t, result.y))
    power = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert power == pytest.approx(k / (k + 1), abs=slack + 0.05)


@pytest.mark.parametrize("formulation", ["SI2", "SI1"])
@pytest.mark.parametrize(("name", "digits"), [("car axis", 5), ("Andrews", 5)])
def test_digits_against_the_published_solutions(name, formulation, digits):
    reference = PROBLEMS[name]
    result = solve_wstiff(reference.make(formulation), reference.times, tol=1e-10)
    assert result.success
    assert -np.log10(reference.error(result.t, result.y)) > digits


@pytest.mark.parametrize("name", list(PROBLEMS))
def test_index_three_reaches_the_positions(name):
    reference = PROBLEMS[name]
    problem = reference.make("I3")
    positions = reference.columns < (problem.error_mask.sum())
    result = solve_wstiff(problem, reference.times, tol=1e-8, corrector="modified")
    assert result.success, result.message
    exact = reference.reference[:, positions]
    assert np.abs(result.y[:, reference.columns[positions]] - exact).max() < 2e-3


@pytest.mark.parametrize("corrector", ["original", "modified"])
@pytest.mark.parametrize("tol", [1e-4, 1e-6, 1e-7])
@pytest.mark.parametrize("loops", [2, 13, 40])
def test_chain_passes_its_singular_positions(loops, tol, corrector):
    """With all links in line rank drops by one for each loop; the motion goes on."""
    reference = chain_problem(loops, 2.0)
    result = solve_wstiff(reference.make("SI2"), reference.times, tol=tol, corrector=corrector)
    assert result.success, result.message
    assert reference.error(result.t, result.y) < 500 * tol**0.8


LOOPS = [10, 40, *(pytest.param(loops, marks=pytest.mark.slow) for loops in (80, 160))]


@pytest.mark.parametrize("formulation", ["SI2", "SI1"])
@pytest.mark.parametrize("loops", LOOPS)
@pytest.mark.parametrize("tol", [1e-8, 1e-9, 1e-10, 1e-11])
def test_chain_passes_at_the_level_of_rounding(formulation, loops, tol):
    """An angle d from a singular position rounding moves the velocities by about 1e-14 / d^2: 1e-10 at 1e-2.

    At 1e-8 it moves them by more than the tolerance within 1e-3 (10 loops) to 7e-3 (160) of either of two positions. A
    step is 0.036 long: by chance one at most ends in there, and is counted until it has left the history.
    """
    reference = chain_problem(loops, 2.0)
    result = solve_wstiff(reference.make(formulation), reference.times, tol=tol)
    assert result.success, result.message
    # at 1e-8 a step the free runs end within 2e-6; at 1e-11 noise of 1e-9 comes on top
    assert reference.error(result.t, result.y) < 400 * tol + 5e-9
    assert result.stats.newton_rejections <= 2
    if tol >= 1e-8:
        assert result.stats.noise_limited <= SINGULAR_POSITIONS * HISTORY


def other_rounding(problem, number):
    """Move the numbers of a problem by their last digit, up, down or not, none of them for the first."""
    signs = np.random.default_rng(number).integers(-1, 2, problem.rdata.size)
    problem.rdata *= 1.0 + min(number, 1) * np.finfo(float).eps * signs
    return problem


@pytest.mark.parametrize("loops", LOOPS)
@pytest.mark.parametrize("tol", [1e-8, 1e-9, 1e-10, 1e-11])
def test_chain_of_index_three_passes_at_the_level_of_rounding(loops, tol):
    """The bound of the other forms, and kicks of positions that end next to a singular position.

    Velocities are outside error control at index three. A step that ends there moves positions by up to the tolerance
    over the constant of its error, and by that times gamma it kicks the velocities for good. Whether one ends there is
    chance, and rounding draws, so that some runs are made whose numbers differ by their last digit.
    """
    reference = chain_problem(loops, 2.0)
    runs = [
        solve_wstiff(other_rounding(reference.make("I3"), number), reference.times, tol=tol)
        for number in range(5 if loops < 100 else 3)
    ]
    assert all(run.success for run in runs)
    # positions move by tol over 1 / (k + 1), velocities by gamma = 137 / (60 h) of that, at order k = 5 and h = 0.036
    kick = SINGULAR_POSITIONS * 6.0 * 137.0 / 60.0 / 0.036
    assert max(reference.error(run.t, run.y) for run in runs) < (400 + kick) * tol + 5e-9
    assert np.median([run.stats.newton_rejections for run in runs]) <= SINGULAR_POSITIONS
    if tol >= 1e-8:
        assert np.median([run.stats.noise_limited for run in runs]) == 0


@pytest.mark.slow
def test_a_tolerance_below_rounding_is_told():
    """At 1e-12 some tenth of a radian before the singular position is already lost in rounding."""
    reference = chain_problem(160, 2.0)
    result = solve_wstiff(reference.make("SI2"), reference.times, tol=1e-12)
    assert not result.success
    assert "Rounding alone moves the solution" in result.message
    assert "looser one" in result.message


def test_constraints_hold_along_the_pendulum():
    reference = PROBLEMS["pendulum"]
    result = solve_wstiff(reference.make("SI2"), np.linspace(0.0, 10.0, 301), tol=1e-7)
    x, y, u, v = result.y[:, :4].T
    assert np.abs(x * x + y * y - 1.0).max() < 1e-7
    assert np.abs(x * u + y * v).max() < 1e-6


def test_gstiff_solves_the_same_problems():
    for name in ("pendulum", "slider crank", "Andrews"):
        reference = PROBLEMS[name]
        result = solve_wstiff(reference.make("SI2"), reference.times, tol=1e-8, method="GSTIFF")
        assert result.success, result.message
        assert reference.error(result.t, result.y) < 2e-3
