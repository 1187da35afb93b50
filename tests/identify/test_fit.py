"""Fits of models whose statistics are known."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.identify import Free, IdentifyError, fit, posterior
from tests.says import says

T = np.linspace(0.0, 4.0, 60)


def decay(p):
    """Two exponentials, three numbers."""
    return p[0] * np.exp(-p[1] * T) + p[2] * np.exp(-0.3 * T)


TRUE = np.array([2.0, 2.5, 1.0])
FREE = [Free("a", 1.0, 0.05, 50.0), Free("rate", 1.0, 0.05, 50.0), Free("b", 2.0, 0.05, 50.0)]


def noisy(seed, sigma=0.02):
    return decay(TRUE) + sigma * np.random.default_rng(seed).standard_normal(T.size)


def test_covariance_is_that_of_the_jacobian():
    found = fit(decay, noisy(1), FREE, sigma=0.02)
    a, rate, _ = found.values
    j = np.array([np.exp(-rate * T), -a * T * np.exp(-rate * T), np.exp(-0.3 * T)]).T / 0.02
    np.testing.assert_allclose(found.errors, np.sqrt(np.diag(np.linalg.inv(j.T @ j))), rtol=1e-6)
    assert found.chi_square == pytest.approx(1.0, abs=0.4)


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_coverage_over_two_hundred_measurements(known):
    """The 95 % interval holds the truth in 95 +- 3 % of the measurements, parameter by parameter together."""
    inside = []
    for seed in range(200):
        found = fit(decay, noisy(seed), FREE, sigma=0.02 if known else None)
        ends = [found.interval(name) for name in found.names]
        inside += [low <= value <= high for (low, high), value in zip(ends, TRUE)]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)


def test_profile_of_a_linear_model_is_its_parabola():
    x = np.linspace(-1.0, 1.0, 30)
    y = 1.0 + 2.0 * x + 0.1 * np.random.default_rng(0).standard_normal(30)
    found = fit(lambda p: p[0] + p[1] * x, y, [Free("c", 0.5, log=False), Free("m", 1.0, log=False)], sigma=0.1)
    data = found.profile("m")
    np.testing.assert_allclose(data.rise, ((data.value - found["m"]) / found.errors[1]) ** 2, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(found.profile_interval("m", points=201), found.interval("m"), rtol=2e-3)


def test_profile_of_a_bent_model_is_not_symmetric():
    found = fit(decay, noisy(3, 0.1), FREE, sigma=0.1)
    low, high = found.profile_interval("rate")
    assert high - found["rate"] > 1.1 * (found["rate"] - low)


def test_outliers_do_not_move_a_robust_fit():
    y = noisy(0)
    y[::12] += 2.0
    plain, robust = (fit(decay, y, FREE, sigma=0.02, loss=loss) for loss in ("linear", "soft_l1"))
    assert np.abs(np.log(robust.values / TRUE)).max() < 0.15
    assert np.abs(np.log(plain.values / TRUE)).max() > 0.3


def test_several_starts_find_the_lower_valley():
    """A frequency: far from it every start ends in a valley of its own."""
    y = np.sin(6.0 * T)
    free = [Free("omega", 2.0, 1.0, 12.0)]
    alone = fit(lambda p: np.sin(p[0] * T), y, free)
    several = fit(lambda p: np.sin(p[0] * T), y, free, starts=16)
    assert abs(alone["omega"] - 6.0) > 0.5
    assert several["omega"] == pytest.approx(6.0, rel=1e-6)
    assert "searches ended" in several.report()


def test_posterior_agrees_with_the_normal_approximation():
    found = fit(decay, noisy(2), FREE, sigma=0.02)
    draws = posterior(found, draws=6000)
    np.testing.assert_allclose(draws.mean(), found.values, atol=0.2 * found.errors.max())
    np.testing.assert_allclose(draws.std(), found.errors, rtol=0.12)
    assert draws.attrs["surrogate_error"] < 0.2


def test_there_is_no_posterior_of_what_data_do_not_determine():
    """Only the product of two amplitudes acts; with one held there is one."""
    free = [Free("a", 1.0, 0.1, 10.0), Free("b", 1.0, 0.1, 10.0)]
    y = 2.0 * np.exp(-T) + 0.02 * np.random.default_rng(0).standard_normal(T.size)
    both = fit(lambda p: p[0] * p[1] * np.exp(-T), y, free, sigma=0.02)
    with pytest.raises(IdentifyError, match=says("a, b", "not determined", "hold")):
        posterior(both)
    one = fit(lambda p: p[0] * np.exp(-T), y, free[:1], sigma=0.02)
    assert posterior(one, draws=500)["a"].std() == pytest.approx(one.errors[0], rel=0.3)


def test_reports_and_errors():
    found = fit(decay, noisy(1), FREE)
    assert "standard error" in found.report()
    assert list(found.table().index) == ["a", "rate", "b"]
    assert found.aic < found.bic
    with pytest.raises(IdentifyError, match="fitted are a, rate, b"):
        found["c"]
    with pytest.raises(IdentifyError, match=says("2", "3", "independent values")):
        fit(lambda p: p[:2], [1.0, 2.0], FREE)
    with pytest.raises(IdentifyError, match="has no logarithm"):
        Free("x", -1.0)
    with pytest.raises(IdentifyError, match="not between"):
        fit(decay, noisy(1), [Free("a", 1.0, 2.0, 3.0), *FREE[1:]])


def test_a_fit_tells_how_far_it_is():
    x = np.linspace(0.0, 1.0, 20)
    free = [Free("a", 1.0), Free("b", -1.0, log=False)]
    told = []
    fit(
        lambda p: p[0] * np.exp(p[1] * x),
        2.0 * np.exp(-0.5 * x),
        free,
        progress=lambda fraction, stage: told.append((fraction, stage)),
    )
    fractions = [fraction for fraction, _ in told]
    assert fractions == sorted(fractions)
    assert 0.0 < fractions[0] < fractions[-1] <= 0.99
    counts = [int(stage.removesuffix(" evaluations")) for _, stage in told]
    # one at a time, and four for each Jacobian
    assert counts[0] == 1
    assert set(np.diff(counts)) <= {1, 4}


def test_the_report_tells_bounds_and_failures():
    x = np.linspace(0.0, 1.0, 20)
    y = 2.0 * np.exp(-0.5 * x)

    def model(p):
        return np.full(20, np.nan) if p[0] > 2.0 else p[0] * np.exp(p[1] * x)

    slope = Free("b", -1.0, log=False)
    free = fit(lambda p: p[0] * np.exp(p[1] * x), y, [Free("a", 1.0), slope], sigma=0.02)
    assert "bounds" not in free.report()
    assert "no values" not in free.report()
    held = fit(lambda p: p[0] * np.exp(p[1] * x), y, [Free("a", 1.0, 0.5, 1.5), slope], sigma=0.02)
    assert "The interval of a reaches beyond its bounds, 0.5 to 1.5" in held.report()
    blind = fit(model, y, [Free("a", 1.0), slope], sigma=0.02)
    assert "evaluations gave no values" in blind.report()


def test_parameters_that_cannot_be_told_apart_leave_the_others_their_errors():
    """Of (a + b) + c x only the sum is known; c has the error that it has with one constant."""
    x = np.linspace(0.0, 1.0, 40)
    y = 3.0 + 2.0 * x + 0.01 * np.random.default_rng(0).normal(size=x.size)

    def line(p):
        return sum(p[:-1]) + p[-1] * x

    free = [Free(name, 1.0, log=False) for name in "abc"]
    found, alone = fit(line, y, free, sigma=0.01), fit(line, y, free[1:], sigma=0.01)
    assert np.isinf(found.errors[:2]).all()
    assert found.errors[2] == pytest.approx(alone.errors[1], rel=1e-6)
    assert found.correlation[0, 1] == pytest.approx(-1.0, abs=1e-9)
    assert abs(found.correlation[0, 2]) < 1e-9
    assert "a and b are told apart badly" in found.report()
