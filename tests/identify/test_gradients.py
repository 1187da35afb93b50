"""Fits whose model knows its derivatives: steady motions of cases, runs and motions of models of one's own."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from gearmbs.identify import CaseProblem, Free, IdentifyError, fit
from gearmbs.studies import Case
from gearmbs.studies.run.steady_levels import steady_levels
from tests.says import says

TRUTH = {"contact.depth": 1e-4, "contact.stiffness": 2.9852e5 * 1000.0**1.3, "friction.dynamic": 0.05}
CASES = {name: Case(operation={"torque": torque}) for name, torque in (("low", 100.0), ("high", 200.0))}
PRECISE = {"tolerance": 1e-8}


def measured(cases, seed=3, noise=0.02):
    """All components' mesh harmonics of steady motions, with noise."""
    rng = np.random.default_rng(seed)
    rows = []
    for name, case in cases.items():
        found = steady_levels(case.as_one_of_many().changed(solver=PRECISE)).levels("orders")
        rows += [(name, c, k, v * np.exp(noise * rng.standard_normal()), 0.02) for (c, k), v in found.items()]
    return pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])


def three(*factors):
    also = {"friction.dynamic": {"friction.static": 2.0}}
    return [Free(name, v * f, also=also.get(name, {})) for (name, v), f in zip(TRUTH.items(), factors, strict=True)]


def test_a_fit_with_derivatives_of_its_own_is_that_by_differences():
    x = np.linspace(0.0, 1.0, 30)
    y = 2.0 * np.exp(-0.5 * x) + 0.01 * np.random.default_rng(1).standard_normal(30)
    free = [Free("a", 1.0), Free("b", -1.0, log=False)]

    def model(p):
        return p[0] * np.exp(p[1] * x)

    def slopes(p):
        return np.stack([np.exp(p[1] * x), p[0] * x * np.exp(p[1] * x)], axis=1)

    one, other = fit(model, y, free, jacobian=slopes), fit(model, y, free)
    np.testing.assert_allclose(one.values, other.values, rtol=1e-9)
    np.testing.assert_allclose(one.errors, other.errors, rtol=1e-6)
    assert one.runs < other.runs / 2
    with pytest.raises(IdentifyError, match=says("jacobian", "(30, 1)", "each parameter")):
        fit(model, y, free, jacobian=lambda p: slopes(p)[:, :1])


@pytest.mark.slow
def test_derivatives_of_levels_are_those_of_motions_beside():
    case = Case(operation={"torque": 100.0}).as_one_of_many().changed(solver=PRECISE)

    def changed(depth, torque):
        return case.changed(contact={"depth": depth}, operation={"torque": torque})

    values = {"depth": 1e-4, "torque": 100.0}
    found, refused = steady_levels(case).derivatives(changed, values)
    assert not refused
    for name, value in values.items():
        # levels bend over this step, and sums over steps are off, by 5e-3 of the derivative
        beside = [changed(**(values | {name: value * f})).changed(solver={"tolerance": 1e-10}) for f in (1.005, 0.995)]
        sides = [steady_levels(one).values[1] for one in beside]
        wanted = (sides[0] - sides[1]) / (0.01 * value)
        assert np.abs(found[name][1] - wanted).max() < 1e-2 * np.abs(wanted).max()


@pytest.mark.slow
def test_what_changes_the_period_is_told_and_what_leaves_it_is_derived():
    case = Case(operation={"torque": 100.0}).as_one_of_many().changed(solver=PRECISE)
    found, refused = steady_levels(case).derivatives(
        lambda speed, torque: case.changed(operation={"speed": speed, "torque": torque}),
        {"speed": case.operation.speed, "torque": 100.0},
    )
    assert list(found) == ["torque"]
    assert "changes the period" in refused["speed"]


@pytest.mark.slow
def test_contact_and_friction_from_24_numbers_in_15_simulations():
    table = measured(CASES)
    assert len(table) == 24
    problems = {
        by: CaseProblem(table, CASES, three(1.5, 0.8, 0.6), way="orders", derivatives_by=by)
        for by in ("steady", "differences")
    }
    fits = {by: problem.fit() for by, problem in problems.items()}
    assert problems["steady"].simulations <= 15 < problems["differences"].simulations
    one, other = fits["steady"], fits["differences"]
    np.testing.assert_allclose(one.errors, other.errors, rtol=0.05)
    assert (np.abs(one.values - other.values) < 0.1 * other.errors).all()
    assert not one.notes


@pytest.mark.slow
def test_a_fit_goes_on_from_what_was_kept(tmp_path):
    cases = {"low": CASES["low"]}
    table, free = measured(cases), three(1.2, 1.0, 0.9)[::2]
    first = CaseProblem(table, cases, free, way="orders", store=tmp_path)
    done = first.fit()
    again = CaseProblem(table, cases, free, way="orders", store=tmp_path)
    assert (again.fit().values == done.values).all()
    assert first.simulations > 0 == again.simulations
    for rows, wanted in ((table[::-1], free), (table, free[::-1])):
        other = CaseProblem(rows, cases, wanted, way="orders", store=tmp_path)
        np.testing.assert_allclose(sorted(other.fit().values), sorted(done.values), rtol=1e-6)
        assert other.simulations == 0
    # of fewer rows the search goes other ways, but begins where this one did; one parameter of two was derived, too
    for rows, wanted in ((table[:6], free), (table, free[:1])):
        fewer = CaseProblem(rows, cases, wanted, way="orders", store=tmp_path)
        fewer.derivatives([item.start for item in wanted])
        assert fewer.simulations == (0 if len(wanted) == 2 else 1)
    files = sorted(tmp_path.iterdir())
    files[0].write_text("{")
    damaged = CaseProblem(table, cases, free, way="orders", store=tmp_path)
    assert (damaged.fit().values == done.values).all()
    assert damaged.simulations <= 2


@pytest.mark.slow
def test_a_record_of_some_length_takes_derivatives_of_its_motion_and_a_speed_differences():
    short = {"duration": 0.04, "run_up": 0.02, "settling": 0.02, "torque": 100.0}
    cases = {"short": Case(operation=short)}
    rows = [("short", "line_of_action", k, 1.0, 0.02) for k in (1, 2, 3)]
    table = pd.DataFrame(rows, columns=["case", "channel", "harmonic", "value", "sigma"])
    free = ["contact.depth", "operation.speed"]
    problem, by_differences = (
        CaseProblem(table, cases, free, way="orders", derivatives_by=by) for by in ("steady", "differences")
    )
    matrix, other = problem.derivatives(), by_differences.derivatives()
    assert np.abs(matrix - other).max() < 0.05 * np.abs(other).max()
    # the record, the motion whose derivatives are its own, and two records for the speed
    assert problem.simulations == 4
    assert any("operation.speed" in note and "period" in note for note in problem.notes)
