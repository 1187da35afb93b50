"""Equations that are not linear in y', with solutions in closed form: from consistent, absent and wrong rates.

Units of unknown, equation and time are random: what holds must not depend on them. Where one y has several rates, the
given ones choose among them, and without any the start is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from gearmbs.dae.solve import solve_dae
from tests.generators import cases, seed
from tests.says import says

METHODS = ("WSTIFF", "GSTIFF", "IDA")
RTOL, ATOL = 1e-6, 1e-8


@dataclass(frozen=True)
class Implicit:
    """A problem in units of its own: x = t/end, h = y/unit, p = y' end/unit.

    Attributes
    ----------
    name : str
    equation : callable
        ``equation(x, h, p)`` returns G, shape (n,).
    exact, rate : callable
        Solution and its derivative at x, shape (n,).
    unique : bool
        Whether y alone determines y' of the differential unknowns.
    differential : tuple of bool
    """

    name: str
    equation: Callable
    exact: Callable[[float], np.ndarray]
    rate: Callable[[float], np.ndarray]
    unique: bool = True
    differential: tuple[bool, ...] = (True,)


def _families(rng: np.random.Generator) -> list[Implicit]:
    """Return one problem of each family."""
    a, b, phase, k = rng.uniform(0.5, 2.0), rng.uniform(1.0, 4.0), rng.uniform(0.0, 6.0), rng.uniform(0.0, 20.0)
    eps, sign, power = 10.0 ** rng.uniform(-3.0, 2.0), rng.choice([-1.0, 1.0]), int(rng.choice([2, 4]))
    slope = sign * rng.uniform(0.5, 3.0)

    def wave(x: float) -> np.ndarray:
        return np.array([a * np.sin(b * x + phase) + 0.3])

    def wave_rate(x: float) -> np.ndarray:
        return np.array([a * b * np.cos(b * x + phase)])

    def follows(name: str, law: Callable) -> Implicit:
        """Return law(y', y) = law(wave', wave) - k (y - wave), with a law that grows with y'."""

        def equation(x, h, p):
            s, r = wave(x), wave_rate(x)
            return law(p, h) - law(r, s) + k * (h - s)

        return Implicit(name, equation, wave, wave_rate)

    def pair(x: float) -> np.ndarray:
        return np.array([np.exp(-a * x), np.cos(b * x)])

    def pair_rate(x: float) -> np.ndarray:
        return np.array([-a * np.exp(-a * x), -b * np.sin(b * x)])

    def masses(p: np.ndarray, h: np.ndarray) -> np.ndarray:
        """Return M(y, y') y' with a symmetric, positive M."""
        m = 1.0 + h[0] ** 2 + p[0] ** 2
        return np.array([m * p[0] + 0.5 * np.sin(h[1]) * p[1], 0.5 * np.sin(h[1]) * p[0] + (2.0 + p[1] ** 2) * p[1]])

    def held(x: float) -> np.ndarray:
        r = wave_rate(x)[0]
        return np.array([wave(x)[0], r + eps * r**3])

    def held_rate(x: float) -> np.ndarray:
        r, change = wave_rate(x)[0], -b * b * (wave(x)[0] - 0.3)
        return np.array([r, change * (1.0 + 3.0 * eps * r * r)])

    def algebraic(x, h, p):
        s = held(x)
        return np.array([p[0] + eps * p[0] ** 3 - h[1], h[1] - s[1] + k * (h[0] - s[0])])

    return [
        follows("cubic", lambda p, h: p + eps * p**3),
        follows("exponential", lambda p, h: np.exp(0.3 * p)),
        follows("hyperbolic sine", lambda p, h: np.sinh(p)),
        follows("mass of the unknown and its rate", lambda p, h: (1.0 + h * h + p * p) * p),
        Implicit("mass matrix", lambda x, h, p: masses(p, h) - masses(pair_rate(x), pair(x)) + k * (h - pair(x)),
                 pair, pair_rate, differential=(True, True)),
        Implicit("algebraic unknown", algebraic, held, held_rate, differential=(True, False)),
        Implicit("root", lambda x, h, p: p * p - h, lambda x: np.array([(1.0 + 0.5 * sign * x) ** 2]),
                 lambda x: np.array([sign * (1.0 + 0.5 * sign * x)]), unique=False),
        Implicit("even power", lambda x, h, p: p**power - slope**power, lambda x: np.array([1.0 + slope * x]),
                 lambda x: np.array([slope]), unique=False),
        Implicit("circle", lambda x, h, p: p * p + h * h - 1.0, lambda x: np.array([sign * np.sin(x - 0.3)]),
                 lambda x: np.array([sign * np.cos(x - 0.3)]), unique=False),
    ]  # fmt: skip


NAMES = [problem.name for problem in _families(np.random.default_rng(0))]


def _posed(problem: Implicit, rng: np.random.Generator) -> tuple[Callable, float, float]:
    """Return the residual, the end and the unit of y."""
    end, unit, row = 10.0 ** rng.uniform(-2.0, 2.0), 10.0 ** rng.uniform(-3.0, 3.0), 10.0 ** rng.uniform(-4.0, 4.0)

    def residual(t, y, yp, out):
        out[:] = row * problem.equation(t / end, y / unit, yp * end / unit)

    return residual, end, unit


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", NAMES)
def test_each_solution_satisfies_the_equations(name, method):
    for case in range(cases(3)):
        rng = np.random.default_rng([seed(), case, NAMES.index(name)])
        problem = _families(rng)[NAMES.index(name)]
        residual, end, unit = _posed(problem, rng)
        y0, rates = unit * problem.exact(0.0), unit / end * problem.rate(0.0)
        wrong = rates * rng.uniform(0.4, 3.0)
        times = np.array([0.0, *np.sort(rng.uniform(0.05, 1.0, 4))]) * end
        for given in (rates, wrong, None):
            told = f"{name}, case {case}, rates {given}"
            settings = {"method": method, "rtol": RTOL, "atol": ATOL * unit, "t_eval": times}
            if given is None and not problem.unique:
                with pytest.raises(ValueError, match=says("Give yp0=")):
                    solve_dae(residual, (0.0, end), y0, **settings)
                continue
            result = solve_dae(residual, (0.0, end), y0, given, **settings)
            assert result.success, f"{told}: {result.message}"
            exact = unit * np.array([problem.exact(t / end) for t in times])
            slope = unit / end * np.array([problem.rate(t / end) for t in times])
            moving = np.array(problem.differential)
            # of the largest value so far: errors made there stay where the solution passes through zero
            off = np.abs(result.y - exact) / (ATOL * unit + RTOL * np.maximum.accumulate(np.abs(exact)))
            assert off[:, moving].max() <= 100.0, f"{told}: off by {off.max():.3g} tolerances"
            # rates are about as many tolerances off as there are steps in the span, some hundreds
            assert np.abs(result.yp - slope)[1:, moving].max() <= 1e-2 * np.abs(slope).max(), told
            changed = given is wrong and bool(rates[moving].any())
            assert ("Initial rates were moved" in result.message) == changed, f"{told}: {result.message}"


@pytest.mark.parametrize("method", METHODS)
def test_a_rate_that_is_not_determined_is_asked_for(method):
    def squared(t, y, yp, out):
        out[0] = yp[0] ** 2 - y[0]

    with pytest.raises(ValueError, match=says("y", "0", "Give yp0=")):
        solve_dae(squared, (0.0, 1.0), [1.0], method=method)
    for sign in (1.0, -1.0):
        result = solve_dae(squared, (0.0, 1.0), [1.0], [0.5 * sign], method=method)
        assert result.success, result.message
        assert result.y[-1, 0] == pytest.approx((1.0 + 0.5 * sign) ** 2, rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_no_run_goes_beyond_the_end_of_a_branch(method):
    # y = (1 - t/2)^2 until t = 2, where dG/dy' = 2 y' vanishes
    def squared(t, y, yp, out):
        out[0] = yp[0] ** 2 - y[0]

    beyond = solve_dae(squared, (0.0, 3.0), [1.0], [-1.0], method=method)
    before = solve_dae(squared, (0.0, 1.9), [1.0], [-1.0], method=method)
    assert before.success, before.message
    assert before.y[-1, 0] == pytest.approx(0.0025, rel=1e-2)
    assert not beyond.success
    assert beyond.message
