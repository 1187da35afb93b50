"""Coefficients of variable-step BDF against the classical ones, their defining property, and their order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.dae.integrators import bdf

ORDERS = range(1, bdf.MAX_ORDER + 1)

# y' h = sum_j a_j y_{n-j} on uniform steps, from expanding sum_{m=1..k} (1/m) (1 - E^{-1})^m
CLASSICAL = {
    1: [1, -1],
    2: [3 / 2, -2, 1 / 2],
    3: [11 / 6, -3, 3 / 2, -1 / 3],
    4: [25 / 12, -4, 3, -4 / 3, 1 / 4],
    5: [137 / 60, -5, 5, -10 / 3, 5 / 4, -1 / 5],
    6: [147 / 60, -6, 15 / 2, -20 / 3, 15 / 4, -6 / 5, 1 / 6],
}


def formula(t, past, k):
    """Weights of y_n, y_{n-1}, ... in y'_n, put together from predictor and leading coefficient."""
    value, slope = np.zeros(16), np.zeros(16)
    gamma = bdf.step_coefficients(t, past, k, value, slope)
    return np.concatenate(([gamma], (slope - gamma * value)[: k + 1]))


@pytest.mark.slow
@pytest.mark.parametrize("k", ORDERS)
def test_uniform_steps_give_the_classical_formulas(k):
    h = 0.37
    weights = formula(0.0, -h * np.arange(1.0, k + 2), k)
    np.testing.assert_allclose(h * weights[: k + 1], CLASSICAL[k], rtol=1e-12)
    assert abs(h * weights[k + 1]) < 1e-11  # the point that only the predictor uses drops out


@pytest.mark.slow
@pytest.mark.parametrize("k", ORDERS)
def test_error_constant_on_uniform_steps(k):
    # gamma h = H_k and T = (k + 1) h, so r/(1 + r) = 1/(1 + (k + 1) H_k); for k = 1 a third
    harmonic = sum(1 / m for m in range(1, k + 1))
    constant = bdf.error_constant(0.0, -0.2 * np.arange(1.0, k + 2), k)
    assert constant == pytest.approx(1 / (1 + (k + 1) * harmonic), rel=1e-12)


@pytest.mark.slow
@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.integers(1, 6), st.lists(st.floats(0.3, 3.0), min_size=7, max_size=7), st.integers(0, 1000))
def test_formula_differentiates_polynomials_of_its_order(k, gaps, seed):
    past = -np.cumsum(gaps)[: k + 1]
    polynomial = np.polynomial.Polynomial(np.random.default_rng(seed).normal(size=k + 1))
    weights = formula(0.0, past, k)
    values = polynomial(np.concatenate(([0.0], past)))
    assert weights @ values == pytest.approx(polynomial.deriv()(0.0), abs=1e-9 * np.abs(weights * values).sum())


@pytest.mark.slow
@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.integers(1, 7), st.lists(st.floats(0.2, 2.0), min_size=8, max_size=8))
def test_divided_difference_of_a_power(count, gaps):
    # f[t_1 .. t_m] of t^(m-1) is 1
    nodes = -np.cumsum(gaps)
    hist = (nodes[:, None] ** (count - 1)) * np.ones((1, 3))
    norm = bdf.divided_difference_norm(nodes, count, hist, np.array([1.0, 0.0, 0.5]), np.zeros(16))
    assert norm == pytest.approx(1.0, rel=1e-6)


def irregular_times(steps, seed, t_end=1.0):
    """Times with neighbouring steps in ratios between 0.8 and 1.25."""
    sizes = np.exp(np.random.default_rng(seed).uniform(-0.11, 0.11, size=steps))
    return np.concatenate(([0.0], np.cumsum(sizes) / sizes.sum())) * t_end


def integrate(k, times, exact, rate):
    """Order-k BDF on y' = exact' + rate (y - exact) from exact starting values."""
    values = [exact(t)[0] for t in times[: k + 1]]
    value, slope = np.zeros(16), np.zeros(16)
    for n in range(k + 1, len(times)):
        past = np.ascontiguousarray(times[n - 1 :: -1][: k + 1])
        gamma = bdf.step_coefficients(times[n], past, k, value, slope)
        history = np.array(values[: n - k - 2 : -1] if n > k + 1 else values[::-1])
        predicted, rate_predicted = value[: k + 1] @ history, slope[: k + 1] @ history
        y, yp = exact(times[n])
        # gamma (x - predicted) + rate_predicted = yp + rate (x - y)
        values.append((yp - rate * y + gamma * predicted - rate_predicted) / (gamma - rate))
    return np.array(values)


@pytest.mark.parametrize("k", ORDERS)
def test_convergence_order_on_irregular_steps(k):
    def exact(t):
        return np.sin(3 * t) + 0.5 * np.cos(5 * t), 3 * np.cos(3 * t) - 2.5 * np.sin(5 * t)

    errors = []
    counts = [60, 120, 240]
    for steps in counts:
        times = irregular_times(steps, seed=5)
        values = integrate(k, times, exact, -2.0)
        errors.append(np.abs(values - exact(times)[0]).max())
    slopes = np.diff(np.log(errors)) / np.diff(np.log(1.0 / np.array(counts)))
    assert slopes[-1] == pytest.approx(k, abs=0.35)


@pytest.mark.parametrize("k", ORDERS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_local_error_estimate_within_a_factor_three(k, seed):
    """One step from exact values on y' = cos t: true error of the corrector against r/(1+r)(y - y_pred)."""
    past = 1.0 - np.concatenate(([0.0], np.cumsum(0.05 * np.exp(np.random.default_rng(seed).uniform(-0.4, 0.4, k)))))
    t = 1.0 + 0.05
    value, slope = np.zeros(16), np.zeros(16)
    gamma = bdf.step_coefficients(t, past, k, value, slope)
    predicted = value[: k + 1] @ np.sin(past)
    y = predicted + (np.cos(t) - slope[: k + 1] @ np.sin(past)) / gamma
    estimate = bdf.error_constant(t, past, k) * (y - predicted)
    true = y - np.sin(t)
    assert 1 / 3 < abs(estimate / true) < 3


@pytest.mark.slow
@pytest.mark.parametrize("k", ORDERS)
def test_step_for_error_hits_its_target(k):
    nodes = -np.cumsum(np.random.default_rng(k).uniform(0.5, 1.5, 8))
    difference = 0.7
    h = bdf.step_for_error(1.0, nodes, k, difference, 0.25)
    e = bdf.local_error(h, nodes, k, difference)
    at_limit = h in (bdf.MAX_STEP_RATIO, 1 / bdf.MAX_STEP_RATIO)
    assert at_limit or e == pytest.approx(0.25, rel=0.5)
