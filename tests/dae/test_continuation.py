"""Branches of periodic orbits against folds of an independent shooting."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import gearmbs as gm
from gearmbs.mechanism import ModelError
from gearmbs.studies import Case
from tests.dae.test_orbits import TAU, oscillator
from tests.says import says


def duffing(frequency):
    force = f"0.3*COS({frequency!r}*TIME)-0.1*VX(I,J)-DX(I,J)-DX(I,J)**3"
    return oscillator(force), TAU / frequency


def fold(start):
    """Return the frequency at which P(x) = x and det(dP/dx - 1) = 0, near (x, v, frequency)."""

    def equations(z):
        x, v, w = z

        def rates(t, y):
            jacobian = np.array([[0.0, 1.0], [-1.0 - 3.0 * y[0] ** 2, -0.1]])
            force = 0.3 * np.cos(w * t) - 0.1 * y[1] - y[0] - y[0] ** 3
            return np.concatenate([[y[1], force], (jacobian @ y[2:].reshape(2, 2)).ravel()])

        end = solve_ivp(rates, (0.0, TAU / w), [x, v, 1, 0, 0, 1], "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        return [end[0] - x, end[1] - v, np.linalg.det(end[2:].reshape(2, 2) - np.eye(2))]

    return fsolve(equations, start, xtol=1e-11)[2]


@pytest.mark.slow
def test_a_duffing_oscillator_turns_back_where_an_independent_shooting_has_its_folds():
    branch = gm.steady_branch(duffing, 1.0, 2.5, tol=1e-8, step=0.1, largest=0.3)
    assert len(branch.turns) == 2
    # three motions between the turning points, the middle one of which is unstable
    at = [k for k in range(1, len(branch.values)) if (branch.values[k - 1] - 1.6) * (branch.values[k] - 1.6) <= 0.0]
    assert [bool(branch.stable[k]) for k in at] == [True, False, True]
    found = []
    for turn in branch.turns:
        k = int(np.argmin(np.abs(branch.values - turn)))
        start = branch.motions[k].solution
        found.append(fold([start.com_position("mass")[0, 0], start.com_velocity("mass")[0, 0], turn]))
    assert branch.turns == pytest.approx(found, rel=1e-3)
    # a multiplier passes 1 there
    unstable = np.flatnonzero(~branch.stable)
    for inside, outside in ((unstable[0], unstable[0] - 1), (unstable[-1], unstable[-1] + 1)):
        assert abs(branch.motions[outside].multipliers[0]) < 1.0 < abs(branch.motions[inside].multipliers[0]) < 1.3


@pytest.mark.slow
def test_motions_of_a_branch_are_those_of_single_searches():
    def case(rpm):
        return Case(operation={"speed": f"{rpm!r} rpm", "torque": "100 N m"})

    branch = gm.steady_branch(case, 1500.0, 2500.0, largest=0.4)
    assert branch.stable.all()
    assert branch.values[-1] == 2500.0

    def force(solution):
        return solution.contact("mesh")["normal_force"]

    k = len(branch.values) // 2
    single = gm.steady(case(float(branch.values[k])), variables=["gmf_rms"])
    assert branch.levels(force)[k] == pytest.approx(abs(single.harmonics(force)[1]), rel=2e-3)
    assert branch.figure(branch.levels(force)).axes


def test_a_branch_of_equations_that_only_look_alike_at_the_ends_is_refused():
    def half(size):
        return oscillator(f"COS(2*TIME)+{size!r}*SIN(TIME)-VX(I,J)-4*DX(I,J)"), np.pi

    with pytest.raises(ModelError, match=says("period", "equation", "loads")):
        gm.steady_branch(half, 0.05, 0.06, step=0.5, largest=1.0)


def test_a_branch_needs_two_values_and_something_that_moves():
    with pytest.raises(ModelError, match=says("start", "stop", "different")):
        gm.steady_branch(duffing, 1.0, 1.0)
    with pytest.raises(ModelError, match=says("step", "100", "part", "span")):
        gm.steady_branch(duffing, 1.0, 2.0, step=100)
    with pytest.raises(ModelError, match=says("build", "3", "Case", "Mechanism")):
        gm.steady_branch(lambda value: 3, 1.0, 2.0)
