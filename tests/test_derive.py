"""Kernels written from definitions: the files are what follows, and the rules of differentiation are right."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from gearmbs.kernels import derive
from gearmbs.kernels.derive import ONE, ZERO, Function, derivative, given, inputs, slopes, tangent
from tests.jets import jets


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
    # exponents are constants of a law
    free = variables[:2] if name == "powers" else variables
    value = law(*variables)
    first = slopes(value, free)
    kernel = compiled(Function("law", "x, y, z", "", [value, *first, *(s for one in first for s in slopes(one, free))]))
    for _ in range(5):
        place = rng.uniform(0.5, 2.0, 3)
        exact = law(*jets(place))
        n = len(free)
        right = [exact.value, *exact.gradient[:n], *exact.hessian[:n, :n].ravel()]
        assert kernel(*place) == pytest.approx(right, rel=1e-12, abs=1e-12)


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
