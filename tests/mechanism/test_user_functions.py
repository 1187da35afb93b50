"""Functions of the user in expressions: the same as written out, their derivatives, errors and names."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism, ModelError, expression


def mass_on_a_spring(force, functions=()):
    m = Mechanism("one mass")
    body = m.body("mass", 2.0, (1.0, 1.0, 1.0), position=(0.1, 0, 0))
    slide = m.translational("slide", body, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
    del slide
    for name, function, more in functions:
        m.function(name, function, **more)
    m.load("spring", body.marker(name="tip"), m.ground.marker(name="wall"), fx=force)
    return m


WRITTEN = "-200*DX(tip, wall) - 3*VX(tip, wall)*ABS(VX(tip, wall)) + SIN(5*TIME)"


def law(x, v, t):
    return -200 * x - 3 * v * abs(v) + math.sin(5 * t)


def by_hand(x, v, t):
    return -200.0, -6 * abs(v), 5 * math.cos(5 * t)


@pytest.mark.parametrize("more", [{}, {"partials": by_hand}])
@pytest.mark.parametrize("integrator", ["WSTIFF", "IDA"])
def test_a_force_is_that_of_the_expression(more, integrator):
    expected = mass_on_a_spring(WRITTEN).simulate(1.0, rate=50, tol=1e-9, integrator=integrator)
    called = mass_on_a_spring("LAW(DX(tip, wall), VX(tip, wall), TIME)", [("law", law, more)])
    found = called.simulate(1.0, rate=50, tol=1e-9, integrator=integrator)
    assert found.success
    atol = 2e-12 if more and integrator == "WSTIFF" else 2e-8
    np.testing.assert_allclose(found.com_position("mass"), expected.com_position("mass"), atol=atol)


def test_calls_can_be_nested_and_mixed():
    functions = [("half", lambda x: 0.5 * x, {}), ("both", lambda x, y: x + y, {})]
    m = mass_on_a_spring("both(2*HALF(-200*DX(tip, wall)), -3*VX(tip, wall)) + 0*half(TIME)", functions)
    plain = mass_on_a_spring("-200*DX(tip, wall) - 3*VX(tip, wall)").simulate(0.5, rate=50, tol=1e-9)
    np.testing.assert_allclose(
        m.simulate(0.5, rate=50, tol=1e-9).com_position("mass"), plain.com_position("mass"), atol=2e-8
    )


def test_states_and_variables_call_them():
    m = mass_on_a_spring("-VARVAL(pull)", [("decay", lambda z: -3 * z, {})])
    m.differential_state("filter", "decay(DIF(filter)) + DX(tip, wall)", start=1.0)
    m.variable("pull", "200*DX(tip, wall) + DIF(filter)")
    plain = mass_on_a_spring("-VARVAL(pull)")
    plain.differential_state("filter", "-3*DIF(filter) + DX(tip, wall)", start=1.0)
    plain.variable("pull", "200*DX(tip, wall) + DIF(filter)")
    runs = [one.simulate(0.5, rate=50, tol=1e-9).com_position("mass") for one in (m, plain)]
    np.testing.assert_allclose(runs[0], runs[1], atol=2e-8)


def test_a_motion_is_a_function_of_time():
    m = Mechanism("driven")
    body = m.body("arm", 1.0, (1.0, 1.0, 1.0))
    joint = m.revolute("hinge", body, m.ground, at=(0, 0, 0), axis=(0, 0, 1))
    m.function("swing", lambda t: 0.3 * math.sin(2 * t))
    m.rotation("drive", joint, "swing(TIME)")
    solution = m.simulate(1.0, rate=20, tol=1e-8)
    np.testing.assert_allclose(solution.joint_angle("hinge"), 0.3 * np.sin(2 * solution.t), atol=1e-7)
    np.testing.assert_allclose(solution.angular_velocity("arm")[:, 2], 0.6 * np.cos(2 * solution.t), atol=1e-6)


@pytest.mark.parametrize("partials", [None, lambda x, y, t: (-1.0, math.cos(y) + 0.2 * t, 0.2 * y)])
def test_a_constraint_is_that_of_the_expression(partials):
    def coupled(constraint):
        m = Mechanism("coupled", gravity=(0, -9.81, 0))
        slider, arm = m.body("slider", 1.0, (1, 1, 1)), m.body("arm", 1.0, (1, 1, 2), position=(1, 0, 0))
        m.translational("slide", slider, m.ground, at=(0, 0, 0), axis=(1, 0, 0))
        m.revolute("pin", arm, m.ground, at=(1, 0, 0), axis=(0, 0, 1))
        a, g = slider.marker(name="a"), m.ground.marker(name="g")
        arm.marker((1, 0, 0), name="b"), m.ground.marker((1, 0, 0), name="h")
        m.function("link", lambda x, y, t: math.sin(y) + 0.2 * y * t - x, partials)
        m.general_constraint("linked", constraint)
        m.load("pull", a, g, fx="3 - DX(a, g)")
        return m.simulate(1.0, rate=20, tol=1e-9)

    found = coupled("LINK(DX(a, g), AZ(b, h), TIME)")
    expected = coupled("SIN(AZ(b, h)) + 0.2*AZ(b, h)*TIME - DX(a, g)")
    assert found.success
    np.testing.assert_allclose(found.com_position("slider"), expected.com_position("slider"), atol=2e-8)


def test_what_fails_inside_is_raised_with_its_name():
    def breaks(x):
        if x < 0.05:
            raise RuntimeError("too near")
        return -200 * x

    m = mass_on_a_spring("breaks(DX(tip, wall))", [("breaks", breaks, {})])
    with pytest.raises(ModelError, match=r"function 'breaks': RuntimeError: too near"):
        m.simulate(1.0)
    # and the next run begins anew
    m.functions["BREAKS"].function = lambda x: -200 * x
    assert m.simulate(0.1).success


def test_an_interruption_gets_through():
    def interrupts(x):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mass_on_a_spring("interrupts(DX(tip, wall))", [("interrupts", interrupts, {})]).simulate(1.0)


@pytest.mark.parametrize(
    ("name", "function", "words"),
    [
        ("sin", lambda x: x, "the name is taken"),
        ("ptcv", lambda x: x, "the name is taken"),
        ("a b", lambda x: x, "letters, digits"),
        ("many", lambda *x: 0.0, "give count="),
        ("none", lambda: 0.0, "takes no numbers"),
    ],
)
def test_names_and_arguments_are_checked(name, function, words):
    with pytest.raises(ModelError, match=words):
        Mechanism("m").function(name, function)


def test_the_number_of_arguments_is_checked_where_it_is_called():
    m = mass_on_a_spring("law(DX(tip, wall))", [("law", law, {})])
    with pytest.raises(ModelError, match="LAW takes 3 arguments, got 1"):
        m.simulate(1.0)


def test_a_function_goes_to_another_process():
    m = Mechanism("m")
    own = m.function("root", math.sqrt, count=1)
    assert own.address
    copy = pickle.loads(pickle.dumps(own))
    assert copy.address
    assert copy.function(4.0) == 2.0


@pytest.mark.parametrize("lump", [False, True])
def test_functions_are_asked_where_the_motion_is_only(lump):
    """A torque of ln t, 1/angle of a driven wheel, sqrt(s - 1) and 1/omega, from t = 1 and the angle 2 on."""
    m = Mechanism("wheels")
    pins = []
    for name, turned, spin in (("driven", 2.0, 0.0), ("free", 0.0, 5.0)):
        x = float(len(pins))
        body = m.body(name, 1.0, (0.1, 0.1, 0.1), position=(x, 0.0, 0.0), angular_velocity=(0.0, 0.0, spin))
        hub = body.marker((0.0, 0.0, 0.0), Rotation.from_euler("z", turned).as_matrix())
        pins.append(m.revolute(f"pin_{name}", hub, m.ground.marker((x, 0.0, 0.0))))
    m.rotation("drive", pins[0], "2*TIME")
    m.differential_state("s", "1", start=2.0)
    m.function("LN", math.log, count=1)
    m.function("INV", lambda x: 1.0 / x)
    m.function("ROOT", math.sqrt, count=1)
    driven, free = (f"{pin.i.name}, {pin.j.name}" for pin in pins)
    m.axis_torque(
        "load", pins[1].i, pins[1].j, f"0.1*(LN(TIME) + INV(AZ({driven})) + ROOT(DIF(s) - 1) + INV(WZ({free})))"
    )
    solution = m.simulate(1.5, t_start=1.0, lump=lump, tol=1e-9)
    assert solution.success, solution.message

    def rate(t, w):
        return np.log(t) + 0.5 / t + np.sqrt(t) + 1.0 / w

    expected = solve_ivp(rate, (1.0, 1.5), [5.0], rtol=1e-11, atol=1e-11).y[0, -1]
    assert solution.angular_velocity("free")[-1, 2] == pytest.approx(expected, rel=1e-7)
    assert len(solution.reaction("pin_free")[0]) == len(solution)


@pytest.mark.slow
def test_the_integral_of_a_function_of_time():
    """Beside one of positions, of which it does not ask; its derivatives are the function and its rate."""
    m = Mechanism("integral")
    body = m.body("body", 2.0, (1, 1, 1), velocity=(1, 0, 0))
    asked = []
    m.function("push", lambda t: math.cos(3 * t))
    m.function("room", lambda x: asked.append(x) or 0.0)
    m.translation("along", m.translational("slide", body, m.ground, axis=(1, 0, 0)),
                  expression("ROOM(0*TIME) + INTEGRAL(PUSH(TIME), 0, 1)"))  # fmt: skip
    found = m.simulate(1.5, rate=20, tol=1e-8)
    np.testing.assert_allclose(found.com_position("body")[:, 0], np.sin(3 * found.t) / 3, atol=1e-9)
    np.testing.assert_allclose(found.com_velocity("body")[:, 0], np.cos(3 * found.t), atol=1e-7)
    assert not np.isnan(asked).any()
