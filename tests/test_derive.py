"""Kernels written from definitions: the files are what follows, and the rules of differentiation are right."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from gearmbs.kernels import derive
from gearmbs.kernels.derive import ONE, ZERO, Function, along, choose, derivative, given, inputs, slopes, tangent
from gearmbs.kernels.named import names_in, told_names
from tests.jets import jets
from tests.says import says


@pytest.mark.parametrize(("module", "path"), derive.definitions())
@pytest.mark.slow
def test_files_are_what_follows_from_the_definitions(module, path):
    assert derive.derived(module) == path.read_text(encoding="utf-8"), f"run python -m {derive.__name__}"


@pytest.mark.slow
@pytest.mark.parametrize("seed", ["1", "2"])
def test_text_does_not_hang_on_hashes(seed):
    module, path = derive.definitions()[0]
    command = f"from gearmbs.kernels import derive; print(derive.derived({module!r}), end='')"
    there = {**os.environ, "PYTHONHASHSEED": seed}
    made = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, env=there, check=True)
    assert made.stdout == path.read_text(encoding="utf-8")


def test_lines_are_told_by_the_names_of_the_definition():
    derive.start()
    x, y = inputs("x y")

    def law(x, y):
        length = np.sqrt(x * x + y * y)
        force = [length * x, length * y]
        return force

    with names_in(__file__, derive.Value) as (single, items):
        force = law(x, y)
    first = derivative(np.sqrt(x * x + y * y), x)
    second, along = derivative(first, y), derivative(force[0], y)
    told = told_names(single, items, derive._slopes)
    assert told[np.sqrt(x * x + y * y)] == "length"
    assert told[force[1]] == "force[1]"
    assert told[first] == "d length / d x"
    assert told[second] == "d (d length / d x) / d y"
    assert told[along] == "d force[0] / d y"


def compiled(function: Function):
    """Return a written kernel as a function of Python."""
    space = {"np": np, "njit": lambda **_: lambda function: function}
    exec(function.source(), space)
    return space[function.name]


LAWS = {
    "sums": lambda x, y, z: 2.0 - x - (y - z) + -(x - 3.0 * y) * 0.5 + (x - y) / 4.0,
    "products": lambda x, y, z: (x - y) * (y - x) * -z * (2.0 * x) * (-3.0 * y) - z * z * z,
    "quotients": lambda x, y, z: x / (y + z) - 1.0 / (x * y) + -x / z,
    "roots": lambda x, y, z: np.sqrt(x * x + y * y + z * z) * np.sqrt(x + y),
    "powers": lambda x, y, z: x**1.5 + y ** (10.0 / 9.0) - z**2.0 + x**-0.25 + y**3.0 + x**z,
    "angles": lambda x, y, z: np.sin(x * y) * np.cos(z) - np.arctan2(y - 2.0, x - z),
}


@pytest.mark.parametrize("name", LAWS)
def test_first_and_second_derivatives(name):
    law, rng = LAWS[name], np.random.default_rng(3)
    variables = inputs("x y z")
    value = law(*variables)
    first = slopes(value, variables)
    second = [s for one in first for s in slopes(one, variables)]
    kernel = compiled(Function("law", "x, y, z", "", [value, *first, *second]))
    for _ in range(5):
        place = rng.uniform(0.5, 2.0, 3)
        exact = law(*jets(place))
        right = [exact.value, *exact.gradient, *exact.hessian.ravel()]
        assert kernel(*place) == pytest.approx(right, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", "tan tanh arctan exp log arcsin arccos sinh cosh".split())
def test_functions_by_complex_steps(name):
    (x,) = inputs("x")
    law = getattr(np, name)
    kernel = compiled(Function("law", "x", "", [law(x * x), *slopes(law(x * x), [x])]))
    assert kernel(0.7) == pytest.approx((law(0.49), law((0.7 + 1e-30j) ** 2).imag / 1e-30), rel=1e-13)


def test_powers_of_numbers_and_lengths_of_two():
    (x,) = inputs("x")
    kernel = compiled(Function("law", "x", "", slopes(2.0**x + np.hypot(x, 3.0), [x])))
    assert kernel(0.7) == pytest.approx(np.log(2.0) * 2.0**0.7 + 0.7 / np.hypot(0.7, 3.0), rel=1e-14)


@pytest.mark.parametrize("function", [lambda x: math.sqrt(x[0]), lambda x: float(x[1])])
def test_what_takes_floats_alone_is_refused(function):
    with pytest.raises(TypeError, match=says("float", "math", "numpy")):
        function(np.array(inputs("x y z")))


def test_choices_are_differentiated_on_the_side_that_is_chosen():
    """Of the other side, where it is no number, nothing is left; at the limit the second side counts."""
    x, y = inputs("x y")
    law = choose(x, y, np.sqrt(x - y), 3.0 * y) + np.maximum(x, 1.0) - np.minimum(y, 0.5) + np.abs(y - x)
    kernel = compiled(Function("law", "x, y", "", [law, *slopes(law, (x, y))]))
    with np.errstate(invalid="ignore", divide="ignore"):
        assert kernel(np.float64(2.0), np.float64(1.0)) == pytest.approx((3.5, 0.5 + 1.0 + 1.0, -0.5 - 1.0))
        assert kernel(np.float64(0.2), np.float64(0.4)) == pytest.approx((2.0, -1.0, 3.0 - 1.0 + 1.0))


def test_a_branch_of_python_is_refused():
    (x,) = inputs("x")
    for branch in (
        lambda: x > 0.0,
        lambda: bool(x),
        lambda: 1.0 >= x,
        lambda: x == 1.0,
        lambda: x != 1,
        lambda: x in (1, 2),
    ):
        with pytest.raises(TypeError, match=says("branch", "choose", "maximum")):
            branch()


def test_numbers_are_looked_up_by_those_who_trace_alone():
    x, y = inputs("x y")
    with derive.watched():
        for branch in (lambda: x == y, lambda: {1: 2.0}.get(x, 3.0), lambda: x in {1, 2}):
            with pytest.raises(TypeError, match=says("branch", "choose", "maximum")):
                branch()
        value = x * y + x
    assert {x: 1, y: 2}[y] == 2
    assert x != y
    assert derivative(value, y) is x


POWERS = {
    "of powers": lambda x: (x**-3) ** -1 + (x**0.3) ** -0.5 + (x**-0.5) ** 0.4,
    "of what is negative": lambda x: (-(x**-1)) ** -3 + (2.0 - 3.0 * x) ** -3,
    "in exponents": lambda x: x ** (x**-0.5) + 2.0 ** (x**-1),
}


@pytest.mark.parametrize("name", POWERS)
def test_powers_of_powers_are_written_as_they_are_meant(name):
    (x,) = inputs("x")
    kernel = compiled(Function("law", "x", "", [POWERS[name](x), *slopes(POWERS[name](x), [x])]))
    exact = (POWERS[name](0.5), POWERS[name](0.5 + 1e-30j).imag / 1e-30)
    # alone, no part of it has a name
    assert compiled(Function("law", "x", "", [POWERS[name](x)]))(0.5) == pytest.approx(exact[0], rel=1e-14)
    assert kernel(np.float64(0.5)) == pytest.approx(exact, rel=1e-13)


SLACK = {
    "roots": lambda x, e: np.sqrt(np.maximum(x, 0.0)) + np.sqrt(3.0 * np.maximum(x, 0.0) ** 3),
    "powers": lambda x, e: np.maximum(x, 0.0) ** 0.8 - (-2.0 * -np.maximum(x, 0.0)) ** 0.3,
    "scaled": lambda x, e: (np.maximum(x, 0.0) / 0.3) ** 0.8 + (np.maximum(x, 0.0) ** 1.5) ** 0.5,
    "exponents": lambda x, e: 5.0 * np.maximum(x, 0.0) ** e,
    "in between": lambda x, e: np.minimum(np.maximum(x, 0.0), 1.0) ** e,
}


@pytest.mark.parametrize("name", SLACK)
def test_slack_has_no_slope_whatever_the_exponent(name):
    """At -0.2 and 0 nothing acts, and nothing changes; at 0.7 it does as the formula says."""
    x, e = inputs("x e")
    value = SLACK[name](x, e)
    kernel = compiled(Function("law", "x, e", "", [value, *slopes(value, (x, e))]))
    with np.errstate(invalid="ignore", divide="ignore"):
        for at in (-0.2, 0.0):
            assert kernel(np.float64(at), np.float64(0.8)) == (0.0, 0.0, 0.0)
    h = 1e-6
    by = [
        (SLACK[name](0.7 + a * h, 0.8 + b * h) - SLACK[name](0.7 - a * h, 0.8 - b * h)) / (2.0 * h)
        for a, b in ((1, 0), (0, 1))
    ]
    assert kernel(np.float64(0.7), np.float64(0.8)) == pytest.approx((SLACK[name](0.7, 0.8), *by), rel=1e-8, abs=1e-12)


def test_infinite_bounds_are_written_and_nan_is_refused():
    (x,) = inputs("x")
    kernel = compiled(Function("law", "x", "", [np.minimum(np.maximum(x, -np.inf), np.inf)]))
    assert kernel(0.3) == 0.3
    with pytest.raises(TypeError, match=says("nan")):
        x + np.nan


def test_arrays_of_numbers_have_the_products_of_numpy():
    a, b = np.array(inputs("a_x a_y a_z")), np.array(inputs("b_x b_y b_z"))
    two = a[0] * b
    kernel = compiled(Function("law", "a_x, a_y, a_z, b_x, b_y, b_z", "", [a @ b, *np.cross(a, b), *(two + a - a)]))
    numbers = np.arange(1.0, 7.0)
    length = compiled(Function("law", "a_x, a_y, a_z", "", [np.linalg.norm(a)]))
    assert length(1.0, 2.0, 2.0) == 3.0
    right = [numbers[:3] @ numbers[3:], *np.cross(numbers[:3], numbers[3:]), *numbers[3:]]
    assert kernel(*numbers) == pytest.approx(right)


def test_what_others_compute_has_the_derivatives_they_give():
    """A table w(x), with its slope and curvature, in a law."""
    x, y, w, slope, curvature = inputs("x y w slope curvature")
    given(w, {x: slope})
    given(slope, {x: curvature})
    value = w * w * y
    kernel = compiled(Function("law", "x, y, w, slope, curvature", "", [derivative(derivative(value, x), x)]))
    at = 0.7
    exact = 3.0 * 2.0 * (np.cos(at) ** 2 - np.sin(at) ** 2)
    assert kernel(at, 3.0, np.sin(at), np.cos(at), -np.sin(at)) == pytest.approx(exact, rel=1e-14)


def test_nothing_is_computed_twice_and_zeros_are_left_off():
    x, y = inputs("x y")
    assert x * y is y * x
    assert (x + y) * ZERO is ZERO
    assert derivative(x * y, y) is x
    assert tangent(x * y, {x: 0.0, y: ONE}) is x
    source = Function(
        "law", "x, y, out", "", adds={"out[0]": ZERO, "out[1]": -(x * y), "out[2]": np.sqrt(x * y)}
    ).source()
    assert source.count("x * y") == 1
    assert "out[0]" not in source
    assert "out[1] -= " in source


@pytest.mark.parametrize("name", LAWS)
def test_one_pass_along_rates_is_the_sum_of_derivatives_times_rates(name):
    variables, rates = inputs("x y z"), inputs("u v w")
    value = choose(variables[0], variables[1], LAWS[name](*variables), variables[2] * variables[0])
    moves = dict(zip(variables, rates))
    made = compiled(Function("law", "x, y, z, u, v, w", "Law.", [tangent(value, moves), along(value, moves)]))
    for numbers in ([2.3, 1.1, 0.7, 0.2, -0.4, 1.3], [1.1, 2.3, 0.7, 0.2, -0.4, 1.3]):
        apart, together = made(*numbers)
        assert together == pytest.approx(apart, rel=1e-13)


def test_a_rule_of_an_expression_stands_for_the_chain():
    (x,) = inputs("x")
    cosine = np.cos(x)
    length = given(np.sqrt(1.0 - cosine * cosine), {x: cosine})
    assert derivative(length, x) is cosine
    assert derivative(2.0 * length, x) is 2.0 * cosine
