"""DIFF and GSE with IMPLICIT against the same equations solved for the rates."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gearmbs.adams import parse_deck, run_deck
from tests.adams.decks import PENDULUM
from tests.adams.test_user_elements import CART, GSE, LOOP, LSE, deriv, output, run

IMPLICIT = GSE.replace("NS=2", "IMPLICIT, NS=2")
BESIDE = "REQUEST/1, F2=DIF(1)\\F3=DIF1(1)\\F4=DIF(2)\n"


def test_a_rate_that_no_function_gives():
    """r + r^3 = cos(t) - x with r = x'."""
    text = (
        CART + "DIFF/1, IMPLICIT, IC=0.5, FUNCTION=DIF1(1)+DIF1(1)**3-COS(TIME)+DIF(1)\nDIFF/2, FUNCTION=DIF1(1)**2\n"
    )
    found = run(text + BESIDE).request(1)

    def rate(t, x):
        return brentq(lambda r: r + r**3 - np.cos(t) + x, -2.0, 2.0, xtol=1e-14)

    times = np.linspace(0.0, 1.0, 41)
    x = solve_ivp(
        lambda t, y: [rate(t, y[0]), rate(t, y[0]) ** 2], (0, 1), [0.5, 0], t_eval=times, rtol=1e-11, atol=1e-12
    )
    np.testing.assert_allclose(found[:, 1], x.y[0], atol=1e-8)
    np.testing.assert_allclose(found[:, 2], [rate(t, v) for t, v in zip(times, x.y[0])], atol=1e-7)
    np.testing.assert_allclose(found[:, 3], x.y[1], atol=1e-8)


def test_a_rate_that_follows_a_reaction():
    """2 r = F of the pin of a pendulum, which the acceleration decides: the start finds both."""
    text = PENDULUM.replace("END\n", "DIFF/1, IMPLICIT, FUNCTION=2*DIF1(1)-JOINT(1,0,4,0)\n")
    result = run_deck(parse_deck(text + "REQUEST/9, F2=DIF1(1)\\F3=JOINT(1,0,4,0)\nEND\n"), end=0.2, steps=4, tol=1e-8)
    assert result.success
    rate, force = result.request(9)[:, 1:3].T
    assert abs(force[0]) > 0.1
    np.testing.assert_allclose(2.0 * rate, force, rtol=1e-6)


def test_an_equation_without_a_rate_determines_its_state():
    """Kepler's equation E - 0.3 sin E = t."""
    text = CART + "DIFF/1, IMPLICIT, IC=0.1, FUNCTION=DIF(1)-0.3*SIN(DIF(1))-TIME\nREQUEST/1, F2=DIF(1)\n"
    anomaly = run(text).request(1)[:, 1]
    np.testing.assert_allclose(anomaly - 0.3 * np.sin(anomaly), np.linspace(0.0, 1.0, 41), atol=1e-9)


def test_an_implicit_diff_settles_in_statics_unless_it_is_held():
    text = CART + "DIFF/1, IMPLICIT, IC=0.5{}, FUNCTION=3*DIF1(1)+2*DIF(1)-4\nSFORCE/1, TRANSLATIONAL, I=21, J=11,"
    text += " ACTIONONLY, FUNCTION=-40*DX(20,1)+DIF(1)\nREQUEST/1, F2=DX(20,1)\\F3=DIF(1)\n"
    for held, value in (("", 2.0), (", STATIC_HOLD", 0.5)):
        row = run(text.format(held), script="m\no\nSIMULATE/STATICS\n").request(1)[0]
        assert row[[1, 2]] == pytest.approx([value / 40.0, value], abs=1e-9)


def residual(call):
    """The rates of the explicit routine, mixed, so that no equation is of one rate alone."""
    first, second = call.xdot - np.array(deriv(call))
    return 2 * first + second, first - 3 * second


@njit
def compiled_residual(time, x, xd, u, parameters, xdot):
    first = xdot[0] - x[1]
    second = xdot[1] + parameters[1] * x[0] + parameters[0] * x[1] - 2.0 * u[0] + u[1]
    return np.array([2.0 * first + second, first - 3.0 * second])


@pytest.mark.parametrize("routine", [residual, compiled_residual], ids=["Python", "numba"])
@pytest.mark.slow
def test_implicit_state_equations_are_those_of_a_linear_system(routine):
    found = run(CART + LOOP + IMPLICIT, {"GSE/1": {"deriv": routine, "output": output}})
    assert found.success
    np.testing.assert_allclose(found.request(1), run(CART + LOOP + LSE).request(1), atol=1e-8)


@pytest.mark.slow
def test_a_state_without_a_rate():
    """E x' = A x + B u with a singular E: x2 = 4 x1 - u1, x1' = -x1 + x2."""

    def descriptor(call):
        first, second = call.x
        return second - 4 * first + call.u[0], call.xdot[0] + first - second

    found = run(CART + LOOP + IMPLICIT, {"gse_deriv": descriptor, "gse_output": lambda call: call.x[1]})
    same = "DIFF/1, IC=0.3, FUNCTION=3*DIF(1)-VARVAL(1)\n"
    force = LOOP.replace("ARYVAL(3,1)", "4*DIF(1)-VARVAL(1)").replace("ARYVAL(2,1)", "DIF(1)")
    expected = run(CART + force.replace("ARYVAL(2,2)", "4*DIF(1)-VARVAL(1)") + same)
    np.testing.assert_allclose(found.request(1), expected.request(1), atol=1e-8)


def test_implicit_states_settle_in_statics_unless_they_are_held():
    script = "m\no\nSIMULATE/STATICS\n"
    routines = {"gse_deriv": residual, "gse_output": output}
    row = run(CART + LOOP + IMPLICIT, routines, script).request(1)[0]
    assert row[[1, 2, 3]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    held = run(CART + LOOP + IMPLICIT.replace("IC=4", "IC=4, STATIC_HOLD"), routines, script).request(1)[0]
    force = 4 * 0.3 - 0.5 * 0.2
    assert held[[1, 2, 3, 5]] == pytest.approx([force / 40, 0.3, -0.2, force], abs=1e-9)
