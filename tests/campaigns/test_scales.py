"""What decides a result is the same in whatever units it is, also where squares are beyond all numbers, or zero."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

from gearmbs.campaigns import Campaign, CampaignWarning, Factor, FunctionSubject, make_plan
from gearmbs.campaigns.figures import deviation
from gearmbs.campaigns.plans.designs import morris, saltelli
from gearmbs.campaigns.sensitivity import grid_indices, main_effects, morris_effects, sobol_indices
from gearmbs.campaigns.sobol_bounds import first_indices, in_scale, total_bounds
from gearmbs.campaigns.surrogates import fit_chaos, fit_surface
from tests.says import says

EXPONENTS = [-1000, -600, 600, 996]
"""Of two: 1e-301 to 7e299."""

NAMES = ["a", "b", "c"]


def f(u):
    """Return a smooth function of three coordinates."""
    return 1.0 + u[:, 0] + 2.0 * u[:, 1] ** 2 + u[:, 0] * u[:, 2]


@pytest.fixture(params=EXPONENTS)
def exponent(request):
    return request.param


def told(ask):
    """Return what a question gives, whose variance is beyond all numbers."""
    with pytest.warns(CampaignWarning, match=says("variance", "infinite", "units")):
        return ask()


def test_indices_of_a_saltelli_design(exponent):
    points = saltelli(64, 3, 1)
    y = f(points)
    plain = sobol_indices(y, NAMES, points=points)
    ask = lambda: sobol_indices(np.ldexp(y, exponent), NAMES, points=points)  # noqa: E731
    found = told(ask) if exponent > 500 else ask()
    for name in ("first", "total", "first_confidence", "total_confidence", "explained"):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name))
    assert found.mean == np.ldexp(plain.mean, exponent)
    assert found.variance == (np.inf if exponent > 500 else np.ldexp(plain.variance, 2 * exponent))


def test_parts_of_a_grid(exponent):
    axes = np.meshgrid(*[np.linspace(0.0, 1.0, 3)] * 3, indexing="ij")
    y = f(np.stack([axis.ravel() for axis in axes], axis=1))
    plain = grid_indices(y, [3, 3, 3], NAMES)
    ask = lambda: grid_indices(np.ldexp(y, exponent), [3, 3, 3], NAMES)  # noqa: E731
    found = told(ask) if exponent > 500 else ask()
    np.testing.assert_array_equal(found.first, plain.first)
    np.testing.assert_array_equal(found.total, plain.total)


def test_effects(exponent):
    points = morris(20, 3, 1)
    plain, found = (morris_effects(np.ldexp(f(points), k), points, NAMES) for k in (0, exponent))
    np.testing.assert_array_equal(found, np.ldexp(plain, exponent))
    corners = 2.0 * np.array(list(np.ndindex(2, 2, 2))) - 1.0
    y = f(0.5 + 0.5 * corners)
    plain, found = (main_effects(corners, np.ldexp(y, k), NAMES) for k in (0, exponent))
    np.testing.assert_array_equal(found, np.ldexp(plain, exponent))


def test_polynomials(exponent):
    u = np.random.default_rng(0).random((60, 3))
    y = f(u) + 0.1 * np.sin(9.0 * u[:, 2])
    plain, found = (fit_chaos(u, np.ldexp(y, k), NAMES) for k in (0, exponent))
    np.testing.assert_array_equal(found.indices, plain.indices)
    np.testing.assert_array_equal(found.predict(u), np.ldexp(plain.predict(u), exponent))
    assert (found.q_squared, found.interaction("a", "c")) == (plain.q_squared, plain.interaction("a", "c"))
    plain, found = (fit_surface(u, np.ldexp(y, k), NAMES) for k in (0, exponent))
    np.testing.assert_array_equal(found.table(), np.ldexp(plain.table(), exponent))
    assert (found.r_squared, found.q_squared, found.error) == (
        plain.r_squared,
        plain.q_squared,
        np.ldexp(plain.error, exponent),
    )


def test_what_any_points_tell(exponent):
    u = np.random.default_rng(0).random((60, 3))
    y = f(u)
    columns = dict(zip(NAMES, u.T, strict=True))
    plain, found = (first_indices(columns, np.ldexp(y, k)) for k in (0, exponent))
    np.testing.assert_array_equal(found, plain)
    assert deviation(np.ldexp(y, exponent)) == np.ldexp(y.std(ddof=1), exponent)


@pytest.mark.slow
def test_bounds_of_total_indices(exponent):
    pytest.importorskip("sklearn")
    u = np.random.default_rng(0).random((40, 2))
    y = 1.0 + u[:, 0] + u[:, 0] * u[:, 1]
    plain, found = (total_bounds(u, np.ldexp(y, k), NAMES[:2]) for k in (0, exponent))
    np.testing.assert_array_equal(found.table(), plain.table())


def test_a_scale_changes_no_digit():
    for values in ([0.0, 0.0], [], [np.nan, 3.0, -5e-300], [1e308, -1e308, np.inf]):
        y = np.array(values)
        found, power = in_scale(y)
        np.testing.assert_array_equal(np.ldexp(found, power), y)


def ending(x1: float, x2: float) -> dict[str, float]:
    """Return a result that has no end for some."""
    return {"y": float("inf") if x1 > 0.8 else x1 + x2}


@pytest.mark.slow
def test_results_without_end_are_told_and_left_out(tmp_path):
    """Of the others a report and its figures tell all the same."""
    subject = FunctionSubject(ending, {"x1": 0.0, "x2": 0.0})
    plan = make_plan(subject, [Factor("x1", 0.0, 1.0), Factor("x2", 0.0, 1.0)], n=32)
    campaign = Campaign(tmp_path / "c", plan)
    assert campaign.run(workers=0).not_numbers == 7
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        with pytest.warns(CampaignWarning, match=says("y", "7 of 32", "no result")):
            text = campaign.report(tmp_path / "r.html").read_text()
        for kind in ("tornado", "parallel coordinates"):
            campaign.figure(kind, "y")
    assert "<h2>y</h2><p>7 of 32 cases have no such number.</p>" in text
    y = campaign.table.y
    assert f"<td>{y[np.isfinite(y)].mean():.5g}</td>" in text


def large(x1: float, x2: float) -> dict[str, float]:
    """Return a result that varies most, far out, and a small one."""
    return {"far": 1e300 * (x1 + 0.1 * x2), "near": 10.0 + x2}


@pytest.mark.slow
def test_a_report_of_results_far_out(tmp_path):
    """What varies most comes first, with its deviation."""
    subject = FunctionSubject(large, {"x1": 0.0, "x2": 0.0})
    plan = make_plan(subject, [Factor("x1", 0.0, 1.0), Factor("x2", 0.0, 1.0)], n=32)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    text = campaign.report(tmp_path / "r.html").read_text()
    assert text.index("<h2>far</h2>") < text.index("<h2>near</h2>")
    spread = np.std(campaign.table.far / 1e300, ddof=1)
    assert f"<td>{1e300 * spread:.5g}</td>" in text
    assert not re.search(r"<td>-?(inf|nan)</td>", text)
    indices = campaign.sensitivity("far").table()["first"]
    assert indices["x1"] == pytest.approx(1.0 / 1.01, abs=0.02)
