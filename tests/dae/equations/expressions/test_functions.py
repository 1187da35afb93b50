"""Values and time derivatives of ADAMS's functions against their definitions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator, CubicSpline

from gearmbs.dae.equations.expressions import ExpressionError, SplineData
from gearmbs.dae.equations.expressions.spline_value import spline_value
from gearmbs.dae.equations.expressions.splines import spline_table
from gearmbs.mechanism.language.library import compile_expression
from gearmbs.mechanism.language.syntax import Scope, Units
from tests.says import says

from .support import World, time_series


def at(text: str, t: float, **scope) -> float:
    tape = compile_expression(text, Scope(**scope))
    if tape.constant is not None:
        return tape.constant
    return time_series(tape, t)[0]


def cubic_step(x, x0, h0, x1, h1):
    d = (x - x0) / (x1 - x0)
    if d <= 0 or d >= 1:
        return h0 if d <= 0 else h1
    return h0 + (h1 - h0) * d * d * (3 - 2 * d)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2+3*4", 14.0), ("-2**2", -4.0), ("2**3**2", 512.0), ("2**-1", 0.5), ("(1+2)*(3-5)/4", -1.5),
        ("10-4-3", 3.0), ("16/4/2", 2.0), ("1.5E2", 150.0), ("1.5D2", 150.0), (".5", 0.5), ("5.", 5.0),
        ("180D+360D", 3 * math.pi), ("180D+1.5", math.pi + 1.5),
        ("180D-PI", 0.0), ("-45D", -math.pi / 4), ("90d*RTOD", 90.0), ("DTOR*180", math.pi), ("0102", 102.0),
        ("MOD(-7,3)", -1.0), ("SIGN(-3,2)", 3.0), ("SIGN(3,-2)", -3.0), ("DIM(5,3)", 2.0), ("DIM(3,5)", 0.0),
        ("AINT(-2.7)", -2.0), ("ANINT(2.5)", 3.0), ("ANINT(-2.5)", -3.0), ("MIN(3,1,2)", 1.0), ("MAX(3,1,7)", 7.0),
        ("ATAN2(-1,-1)", -0.75 * math.pi), ("LOG10(1000)", 3.0), ("SQRT(2)**2", 2.0), ("ABS(-3)", 3.0),
        ("EXP(LOG(5))", 5.0), ("ASIN(1)+ACOS(0)", math.pi), ("TANH(0.5)-SINH(0.5)/COSH(0.5)", 0.0), ("+-+2", -2.0),
        ("IF(-1:10,20,30)", 10.0), ("IF(0:10,20,30)", 20.0), ("IF(2:10,20,30)", 30.0), ("IF(2,10,20,30)", 30.0),
        # p(x) = 1 + 2 (x-1) + 3 (x-1)^2 at 3; T2 = 2 x^2 - 1, T3 = 4 x^3 - 3 x at 0.5
        ("POLY(3,1,1,2,3)", 17.0), ("CHEBY(1.5,1,1,2,3,4)", 1 + 2 * 0.5 + 3 * (-0.5) + 4 * (0.5 - 1.5)),
        ("FORCOS(0.3,0.1,2,1,3,4)", 1 + 3 * math.cos(0.4) + 4 * math.cos(0.8)),
        ("FORSIN(0.3,0.1,2,1,3,4)", 1 + 3 * math.sin(0.4) + 4 * math.sin(0.8)),
        ("SHF(0.3,0.1,2,5,0.2,7)", 2 * math.sin(5 * 0.2 - 0.2) + 7),
        ("STEP(0.3,0,1,1,3)", cubic_step(0.3, 0, 1, 1, 3)), ("STEP(-1,0,1,1,3)", 1.0), ("STEP(2,0,1,1,3)", 3.0),
        # STEP5 at a quarter: d^3 (10 - 15 d + 6 d^2)
        ("STEP5(0.25,0,0,1,1)", 0.25**3 * (10 - 15 * 0.25 + 6 * 0.0625)),
        ("HAVSIN(0.25,0,2,1,4)", 3 + math.sin(math.pi * 0.25 - math.pi / 2)),
        # penetration 0.02 = 2 d: the damping step is 1; and 0.005 = d/2: the step is 1/2
        ("IMPACT(0.98,-0.5,1,1E4,1.5,10,0.01)", 1e4 * 0.02**1.5 + 10 * 0.5),
        ("IMPACT(0.995,0.5,1,1E4,1.5,10,0.01)", 1e4 * 0.005**1.5 - 10 * 0.5 * 0.5),
        ("IMPACT(0.995,500,1,1E4,1.5,10,0.01)", 0.0), ("IMPACT(1.1,-5,1,1E4,1.5,10,0.01)", 0.0),
        ("BISTOP(0.98,-0.5,1,2,1E4,1.5,10,0.01)", 1e4 * 0.02**1.5 + 10 * 0.5),
        ("BISTOP(2.02,0.5,1,2,1E4,1.5,10,0.01)", -(1e4 * 0.02**1.5 + 10 * 0.5)),
        ("BISTOP(1.5,9,1,2,1E4,1.5,10,0.01)", 0.0),
    ],
)  # fmt: skip
def test_values(text, expected):
    assert at(text, 0.0) == pytest.approx(expected, rel=1e-14, abs=1e-14)
    # the same with a variable that folding cannot see through
    assert at(f"({text})+0*TIME+(TIME-TIME)", 0.7) == pytest.approx(expected, rel=1e-14, abs=1e-14)


TIMED = [
    "TIME**3-2*TIME", "SIN(2*TIME)*EXP(-TIME/3)", "STEP(TIME,0,1,1,3)", "STEP5(TIME,0,1,1,3)", "HAVSIN(TIME,0,1,1,3)",
    "SQRT(1+TIME**2)", "LOG(2+TIME)/LOG10(3+TIME)", "ATAN2(SIN(TIME),2+TIME)", "TIME**2.5", "(1+TIME)**TIME",
    "ASIN(TIME/3)+ACOS(TIME/4)+ATAN(TIME)", "TAN(TIME)+TANH(TIME)-SINH(TIME)*COSH(TIME)", "360D*TIME",
    "IF(TIME-0.2:0,1,TIME**2)", "MAX(TIME,0.1)*MIN(TIME**2,5)", "SHF(TIME,0.1,2,5,0.2)", "FORCOS(TIME,0,7,1,2,3)",
    "SWEEP(TIME,2,0,1,2,5,0.1)", "IMPACT(0.2-TIME,-1,1,1E4,2.5,10,0.01)", "ABS(TIME-1)", "SIGN(TIME,-1)", "TIME/3",
    "POLY(TIME,0.5,1,2,3,4)", "CHEBY(TIME,0.5,1,2,3,4)", "CUBSPL(TIME,0,1)", "AKISPL(TIME*2,0,1)", "MOD(TIME,0.3)",
]  # fmt: skip


@pytest.mark.parametrize("text", TIMED)
def test_time_derivatives_against_differences(text):
    x = tuple(np.linspace(-1.0, 3.0, 9))
    data = SplineData(x, (tuple(np.sin(x)),))
    tape = compile_expression(text, Scope(splines={1: data}))
    h = 1e-5
    for t in (0.37, 0.81):
        f, f1, f2 = time_series(tape, t)
        high, low = time_series(tape, t + h), time_series(tape, t - h)
        scale = max(1.0, abs(f), abs(f1), abs(f2))
        assert f1 == pytest.approx((high[0] - low[0]) / (2 * h), abs=1e-8 * scale)
        assert f2 == pytest.approx((high[1] - low[1]) / (2 * h), abs=1e-7 * scale)


def test_sweep_ends_with_the_last_frequency():
    # after x1 = 2 the phase grows at f1 = 5 cycles per second; before, the frequency rises linearly from 1
    tape = compile_expression("SWEEP(TIME,1,0,1,2,5,0.01)", Scope())
    period = 1 / 5
    assert time_series(tape, 2.3)[0] == pytest.approx(time_series(tape, 2.3 + period)[0], abs=1e-12)
    # phase at t = 1: 1 + (5-1)/(2*2) = 2 cycles; the fade-in is over
    assert time_series(tape, 1.0)[0] == pytest.approx(0.0, abs=1e-12)
    assert time_series(tape, 1.0)[1] == pytest.approx(2 * math.pi * (1 + 4 * 1.0 / 2), rel=1e-12)


def spline_at(data, method, x, z=0.0, order=0):
    return np.array([spline_value(spline_table(data, method), 0, order, float(v), z)[0] for v in np.atleast_1d(x)])


@pytest.mark.slow
def test_cubic_spline_reproduces_cubics_and_is_smooth():
    x = np.array([-1.0, 0.0, 0.7, 2.0, 2.5, 4.0])
    exact = SplineData(tuple(x), (tuple(x**3 - 2 * x**2 + 3),))
    u = np.linspace(-1, 4, 41)
    np.testing.assert_allclose(spline_at(exact, "cubic", u), u**3 - 2 * u**2 + 3, atol=1e-12)
    np.testing.assert_allclose(spline_at(exact, "cubic", u, order=2), 6 * u - 4, atol=1e-11)
    # second derivatives agree on both sides of the knots
    data = SplineData(tuple(x), (tuple(np.cos(3 * x)),))
    np.testing.assert_allclose(spline_at(data, "cubic", x[1:-1] - 1e-9, order=2),
                               spline_at(data, "cubic", x[1:-1] + 1e-9, order=2), atol=1e-6)  # fmt: skip
    # with many points the ends do not matter: any C2 cubic agrees in the middle
    dense = np.linspace(0, 6, 61)
    reference = CubicSpline(dense, np.sin(dense))
    got = spline_at(SplineData(tuple(dense), (tuple(np.sin(dense)),)), "cubic", np.linspace(2, 4, 33))
    np.testing.assert_allclose(got, reference(np.linspace(2, 4, 33)), atol=1e-10)


@pytest.mark.slow
def test_akima_agrees_with_scipy():
    x = np.array([0.0, 1.0, 1.5, 3.0, 4.0, 6.0, 7.0])
    y = np.array([0.0, 2.0, 1.0, 1.0, 5.0, 4.0, 4.0])
    u = np.linspace(0, 7, 57)
    got = spline_at(SplineData(tuple(x), (tuple(y),)), "akima", u)
    np.testing.assert_allclose(got, Akima1DInterpolator(x, y)(u), atol=1e-12)


def test_spline_surface_is_linear_between_curves_and_extrapolates():
    x = tuple(np.linspace(0, 1, 5))
    data = SplineData(x, (tuple(np.square(x)), tuple(1 + np.square(x))), (10.0, 20.0))
    assert spline_at(data, "cubic", 0.3, 12.5)[0] == pytest.approx(0.09 + 0.25, abs=1e-13)
    assert spline_at(data, "cubic", 0.3, 99.0)[0] == pytest.approx(1.09, abs=1e-13)
    # beyond the end: the parabola itself, or its tangent 1 + 2 (x - 1)
    assert spline_at(data, "cubic", 2.0, 10.0)[0] == pytest.approx(4.0, abs=1e-12)
    straight = SplineData(x, (tuple(np.square(x)),), linear_extrapolate=True)
    assert spline_at(straight, "cubic", 2.0)[0] == pytest.approx(3.0, abs=1e-12)


@pytest.mark.parametrize(
    ("x", "y", "z", "words"),
    [
        ((0, 1, 2), ((1, 2, 3),), (), says("spline", "four x", "3")),
        ((0, 1, 1, 2), ((1, 2, 3, 4),), (), says("spline", "x values", "increase")),
        ((0, 1, 2, 3), ((1, 2, 3),), (), says("spline", "one y", "4 x values")),
        ((0, 1, 2, 3), ((1, 2, 3, 4), (1, 2, 3, 4)), (), says("spline", "2 curves", "z values", "0")),
        ((0, 1, 2, math.nan), ((1, 2, 3, 4),), (), says("spline", "finite")),
    ],
)
def test_bad_splines_are_refused(x, y, z, words):
    with pytest.raises(ValueError, match=words):
        SplineData(x, y, z)


def test_units_convert_once_at_the_border():
    """In mm and ms a spring of 5 N/mm stretched by DM - 100 mm is the same force in SI."""
    world = World(2)
    units = Units(length=1e-3, time=1e-3, force=1.0)
    tape = compile_expression("5*(DM(1,2)-100)+2*VR(1,2)+TIME", world.scope(units=units), "force")
    si = world.compile("5E3*(DM(1,2)-0.1)+2*VR(1,2)+TIME/1E-3")
    assert world.value(tape) == pytest.approx(world.value(si), rel=1e-13)
    torque = compile_expression("7", world.scope(units=units), "torque")
    assert torque.constant == pytest.approx(7e-3)
    # f = 3 t in mm with t in ms: 3 m/s
    assert time_series(compile_expression("3*TIME", Scope(units=units), "length"), 2.0)[1] == pytest.approx(3.0)


def test_variables_are_written_in_place_and_cycles_named():
    scope = {"variables": {1: "2*TIME", 2: "VARVAL(1)+VARVAL(1)**2", 3: "VARVAL(4)", 4: "VARVAL(3)"}}
    assert at("VARVAL(2)", 1.5, **scope) == pytest.approx(3 + 9)
    with pytest.raises(ExpressionError, match="VARIABLE/3 -> VARIABLE/4 -> VARIABLE/3 depends on itself"):
        compile_expression("VARVAL(3)", Scope(**scope))


def test_variables_in_a_row_are_no_deep_recursion():
    row = {1: "TIME", **{k: f"VARVAL({k - 1}) + 1" for k in range(2, 400)}}
    assert at("VARVAL(399)", 1.5, variables=row) == pytest.approx(1.5 + 398)
    with pytest.raises(ExpressionError, match=says("VARIABLE", "500 deep", "join")):
        at("VARVAL(700)", 1.5, variables={1: "TIME", **{k: f"VARVAL({k - 1}) + 1" for k in range(2, 701)}})
    with pytest.raises(ExpressionError, match=r"VARIABLE/1 -> .* -> \.\.\. -> .* -> VARIABLE/1 depends on itself"):
        at("VARVAL(1)", 0.0, variables={1: "VARVAL(399)", **{k: f"VARVAL({k - 1})" for k in range(2, 400)}})


def test_arrays_and_plants():
    scope = {"arrays": {3: (5.0, 6.0)}, "variables": {1: "TIME"}, "plants": {("pinput", 2): (1,)}}
    assert at("ARYVAL(3,2)", 0.0, **scope) == 6.0
    assert at("PINVAL(2,1)", 0.5, **scope) == 0.5
    with pytest.raises(ExpressionError, match="from 1 to 2"):
        at("ARYVAL(3,3)", 0.0, **scope)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("3*COS(2*TIME)", lambda t: 1.5 * np.sin(2 * t)),
        ("STEP(TIME,0.2,0,0.7,5)", lambda t: 5 * (t - 0.45)),
        ("POLY(TIME,0,1,2,3)", lambda t: t + t**2 + t**3),
        ("EXP(-TIME)*TIME", lambda t: 1 - (1 + t) * np.exp(-t)),
        ("7", lambda t: 7 * t),
        ("IF(TIME-0.33:0,0,1)", lambda t: t - 0.33),
        ("ABS(TIME-0.3377)", lambda t: 0.5 * (0.3377**2 + (t - 0.3377) ** 2)),
    ],
)
@pytest.mark.slow
def test_integrals_over_time(text, exact):
    """Inside the table, beyond it, and its derivatives: the integrand and the integrand's slope."""
    tape = compile_expression(f"2*INTEGRAL({text},0,1)", Scope())
    integrand = compile_expression(f"({text})+0*TIME+TIME-TIME", Scope())
    for t in (0.83, 1.0, 4.7):
        f, f1, f2 = time_series(tape, t)
        assert f == pytest.approx(2 * exact(t), rel=1e-11, abs=1e-11)
        if integrand.constant is None:
            g, g1, _ = time_series(integrand, t)
            assert (f1, f2) == pytest.approx((2 * g, 2 * g1), rel=1e-13, abs=1e-13)


@pytest.mark.slow
def test_the_integral_of_a_pulse_of_a_thousandth_of_the_span():
    tape = compile_expression("INTEGRAL(IF(TIME-0.33:0,1,IF(TIME-0.331:1,0,0)),0,1)", Scope())
    assert time_series(tape, 0.5)[0] == pytest.approx(1e-3, abs=2e-6)


def test_integral_starts_where_told_and_refuses_what_is_not_time():
    tape = compile_expression("INTEGRAL(TIME,2,3)", Scope(units=Units(time=1e-3)))
    # in ms: from 2 ms to 10 ms, (100 - 4)/2
    assert time_series(tape, 0.010)[0] == pytest.approx(48.0, rel=1e-12)
    world = World(1)
    with pytest.raises(ExpressionError, match="only a function of TIME"):
        world.compile("INTEGRAL(DX(1,2),0,1)")
    with pytest.raises(ExpressionError, match="only a function of TIME"):
        world.compile("INTEGRAL(INTEGRAL(TIME,0,1),0,1)")
    _, gradient, hessian = world.second(world.compile("DX(1,2)*INTEGRAL(COS(TIME),0,1)"), t=0.4)
    displacement = world.value(world.compile("DX(1,2)"))
    assert gradient[-1] == pytest.approx(displacement * np.cos(0.4), rel=1e-12)
    assert hessian[-1, -1] == pytest.approx(-displacement * np.sin(0.4), rel=1e-12)
