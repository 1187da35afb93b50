"""Conditions: what functions take, what is missing."""

import numpy as np
import pytest

from gearmbs.campaigns import (
    Campaign,
    CampaignError,
    CampaignWarning,
    Choice,
    Factor,
    FunctionSubject,
    condition_map,
    make_plan,
)
from gearmbs.campaigns.plans.conditions import names_in, satisfied
from tests.campaigns.models import Ringing, adding, picky, told
from tests.says import says

SUBJECT = FunctionSubject(adding, {"a": 1.0, "b": 2.0, "c": 3.0})


def of(*constraints):
    factors = [Factor(name, 1.0, 2.0) for name in "abc"]
    return make_plan(SUBJECT, factors, n=16, constraints=constraints)


@pytest.mark.parametrize("text", ["maximum(a, b, c) < 1.8", "max(a, b, c) < 1.8", "not max(a, b, c) >= 1.8"])
def test_the_largest_of_several(text):
    plan = of(text)
    columns = plan.columns(plan.points())
    before = {name: values.copy() for name, values in columns.items()}
    good = plan.allowed(columns)
    assert np.array_equal(good, np.max([columns[name] for name in "abc"], axis=0) < 1.8)
    assert 0 < good.sum() < 16
    for name, values in before.items():
        np.testing.assert_array_equal(columns[name], values)
    assert satisfied("min(a, b, c) <= minimum(minimum(a, b), c)", columns).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("log(a, b) > 0", ("log", "one", "2")),
        ("log(a, 10) < 1", ("log", "base")),
        ("sqrt() < 1", ("sqrt", "one")),
        ("maximum(a) < 2", ("maximum", "two")),
        ("maximum(a, b, where=0) < 2", ("maximum", "names")),
        ("abs(a, out=b) < 2", ("abs", "names")),
    ],
)
def test_what_functions_take(text, words):
    columns = {"a": np.array([1.0, 2.0]), "b": np.array([3.0, 4.0])}
    with pytest.raises(CampaignError, match=says(*words)):
        satisfied(text, columns)
    assert columns["b"].tolist() == [3.0, 4.0]
    assert satisfied("log(a) / log(10) < 0.1", columns).tolist() == [True, False]


def test_numbers_of_many_digits_and_blanks():
    columns = {"a": np.array([1.0, 2.0]), "result.s": np.array([1.0, 3.0])}
    assert satisfied(f"a < {'9' * 400}", columns).all()
    assert satisfied(f"a > -{'9' * 25}", columns).all()
    text = "a > 0 and result . s > 2"
    assert names_in(text, columns) == ["a", "result.s"]
    assert satisfied(text, columns).tolist() == [False, True]


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("not y >= 0", {"done", "negative"}),
        ("y != 1e9", {"done"}),
        ("y != 1e9 or status != 'done'", {"done", "failed"}),
        ("not (y >= 0 and x1 < 9)", {"done", "negative"}),
        ("not status == 'done'", {"failed"}),
        ("not y > 1e9 and not y < -1e9", {"done"}),
    ],
)
def test_failed_cases_fulfil_nothing_about_their_results(tmp_path, text, rows):
    subject = FunctionSubject(picky, {"x1": 0.0, "x2": 0.0, "x3": 0.0})
    plan = make_plan(subject, [Factor(name, -3.0, 3.0) for name in ("x1", "x2", "x3")], n=32, unit=8)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    table = campaign.table
    done = (table.status == "done").to_numpy()
    assert 0 < done.sum() < 32
    wanted = np.zeros(32, dtype=bool)
    wanted |= done & ("negative" not in rows or (table.y < 0).to_numpy()) if "done" in rows else False
    wanted |= ~done if "failed" in rows else False
    assert campaign.read(["index"], text)["index"].tolist() == table["index"][wanted].tolist()


ROWS = [{"a": 1.0, "b": 3.0}, {"a": 2.0}, {"a": 3.0, "b": 4.0}, {"a": 4.0, "b": 3.0}]


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("b < 10", [0, 2, 3]),
        ("b != 3", [2]),
        ("not b == 3", [2]),
        ("not (b > 3)", [0, 3]),
        ("not (b > 3 or a > 3.5)", [0]),
        ("b != 3 or a < 2.5", [0, 1, 2]),
        ("not b > 3 and not a > 3.5", [0]),
        ("2 * a - b != 100", [0, 2, 3]),
        ("a != 1", [1, 2, 3]),
    ],
)
def test_what_a_row_leaves_out_fulfils_nothing(tmp_path, text, rows):
    campaign = Campaign(tmp_path / "c", make_plan(SUBJECT, [], "list", options={"rows": ROWS}, unit=2))
    campaign.run(workers=0)
    assert campaign.read(["index"], text)["index"].tolist() == rows
    assert campaign.read(where=text)["index"].tolist() == rows
    plan = make_plan(SUBJECT, [], "list", options={"rows": ROWS}, constraints=[text])
    assert np.flatnonzero(plan.allowed(plan.columns(plan.points()))).tolist() == rows


def test_maps_leave_out_what_a_row_leaves_out(tmp_path):
    campaign = Campaign(tmp_path / "c", make_plan(SUBJECT, [], "list", options={"rows": ROWS}, unit=2))
    campaign.run(workers=0)
    with pytest.warns(CampaignWarning, match="1 without a number"):
        share, counts, *_ = condition_map(campaign, "b != 3", "a", "s", bins=1)
    assert (share.tolist(), counts.tolist()) == ([[1.0 / 3.0]], [[3.0]])


def test_none_that_a_row_gives_is_a_value():
    subject = FunctionSubject(told, {"p": 5.0, "i": 3})
    rows = [{"p": None}, {"i": 4}, {"p": 2.0}]
    plan = make_plan(subject, [], "list", options={"rows": rows}, constraints=["p != 3"])
    assert plan.allowed(plan.columns(plan.points())).tolist() == [True, False, True]


def test_a_range_that_an_option_has_not_fulfils_nothing():
    states = Choice("fault.teeth", {"healthy": [], "faulty": {"size": [0.1, 1.0]}}, name="state")
    plan = make_plan(Ringing(), [states], n=16)
    columns = plan.columns(plan.points())
    healthy = columns["state"] == "healthy"
    assert 0 < healthy.sum() < 16

    def allowed(text):
        return make_plan(Ringing(), [states], n=16, constraints=[text]).allowed(columns).tolist()

    large = columns["state.size"] > 0.5
    assert allowed("not state.size > 0.5") == (~large & ~healthy).tolist()
    assert allowed("state.size != 2") == (~healthy).tolist()
    assert allowed("state == 'healthy' or not state.size > 0.5") == (~large).tolist()
