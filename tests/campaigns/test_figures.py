"""Names and units of columns, what a report chooses, figures."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.campaigns import (
    Campaign,
    CampaignError,
    DrivetrainSubject,
    Factor,
    FunctionSubject,
    PairSubject,
    choose,
    make_plan,
)
from gearmbs.campaigns.figures import KINDS, varied_results
from gearmbs.campaigns.plans.conditions import satisfied
from gearmbs.campaigns.sensitivity import coordinates
from tests.campaigns.support import function, ranges
from tests.says import says


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Return a campaign of a function of three numbers, one of which has few values, that is done."""
    factors = [*ranges()[:2], Factor("x3", values=(-1.0, 0.5, 2.0))]
    found = Campaign(tmp_path_factory.mktemp("figures") / "c", make_plan(function("several"), factors, n=64, unit=64))
    found.run(workers=0)
    return found


COLUMNS = {
    "orders.line_of_action.2": np.array([1.0, 2.0, 3.0]),
    "orders.line_of_action.20": np.array([5.0, 5.0, 5.0]),
    "force of mesh.mesh.1": np.array([3.0, 2.0, 1.0]),
    "operation.torque": np.array([10.0, 20.0, 30.0]),
}


@pytest.mark.parametrize(
    ("text", "held"),
    [
        ("orders.line_of_action.2 > 1.5", [False, True, True]),
        ("orders.line_of_action.20 > orders.line_of_action.2 + 2.5", [True, True, False]),
        ("force of mesh.mesh.1 >= 2 and operation.torque < 15", [True, False, False]),
        ("2 * force of mesh.mesh.1 > abs(orders.line_of_action.2)", [True, True, False]),
    ],
)
def test_conditions_take_the_names_of_the_table(text, held):
    assert satisfied(text, COLUMNS).tolist() == held


@pytest.mark.parametrize(
    ("text", "held"),
    [
        ("operation.torque > '12 N m'", [False, True, True]),
        ("'12 N m' < operation.torque < '0.025 kN m' and status == 'done'", [False, True, False]),
        ("orders.line_of_action.2 >= '200 cm/s^2'", [False, True, True]),
    ],
)
def test_conditions_take_quantities_with_units(text, held):
    units = {"operation.torque": "N m", "orders.line_of_action.2": "m/s^2"}
    given = COLUMNS | {"status": np.array(["done"] * 3, dtype=object)}
    assert satisfied(text, given, lambda name: units.get(name, "")).tolist() == held


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("operation.torque > '12 mm'", says("operation.torque", "12 mm", "N m")),
        ("operation.torque > 'much'", says("operation.torque", "'much'", "N m")),
        ("orders.line_of_action.2 > '1 m/s^2'", says("orders.line_of_action.2", "without", "write")),
        ("2 * operation.torque > '12 N m'", says("operation.torque", "numbers in SI", "alone")),
        ("status > 3", says("status", "texts", "numbers in SI")),
        ("status == 1", says("status", "texts", "numbers in SI")),
        ("1 != status", says("status", "texts", "numbers in SI")),
        ("abs(operation.torque) == '50 N m'", says("operation.torque", "numbers in SI", "alone")),
    ],
)
def test_conditions_of_texts_and_numbers_are_refused(text, message):
    given = COLUMNS | {"status": np.array(["done"] * 3, dtype=object)}
    with pytest.raises(CampaignError, match=message):
        satisfied(text, given, lambda name: "N m" if name == "operation.torque" else "")


ODD = {
    "x": np.array([1, 2, 3]),
    "1": np.array([0.0, 0.0, 0.0]),
    "-2": np.array([9.0, 9.0, 9.0]),
    "and": np.array([9.0, 9.0, 9.0]),
    "time limit": np.array([5.0, 6.0, 7.0]),
    "n": np.array([5_000_000_000, 10, -(2**63)]),
    "seed": np.array([2**53, 2**53 + 1, 0]),
    "good": np.array([True, False, True]),
    "maybe": np.array([True, None, False], dtype=object),
    "status": np.array(["done", None, "time limit"], dtype=object),
    "none": np.array([None, None, None], dtype=object),
}
"""Columns with names and values that conditions could mistake."""


@pytest.mark.parametrize(
    ("text", "held"),
    [
        # numbers and words are never names
        ("x > 1", [False, True, True]),
        ("x > -2 and x < 3", [True, True, False]),
        # nor are texts
        ("status == 'time limit'", [False, False, True]),
        ('time limit > 5 and status != "done"', [False, True, True]),
        # products of whole numbers are beyond 64 bits; alone they are as exact as they are
        ("n * n <= 2e19", [False, True, False]),
        ("n * n * 10 > 2e19", [True, False, True]),
        ("abs(n) > 0 and -n > 0", [False, False, True]),
        ("4000000000 * 4000000000 > n", [True, True, True]),
        ("seed == 9007199254740993", [False, True, False]),
        # truth values are compared as such and as numbers, and what is missing with anything
        ("good == True", [True, False, True]),
        ("good == 1", [True, False, True]),
        ("maybe == True", [True, False, False]),
        ("none == 'done'", [False, False, False]),
        ("none != 1", [True, True, True]),
    ],
)
def test_conditions_take_numbers_and_texts_for_what_they_are(text, held):
    assert satisfied(text, ODD).tolist() == held


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("orders_line_of_action_2 > 1", says("orders_line_of_action_2", "did you mean orders.line_of_action.2")),
        ("orders.line_of_action.7 > 1", says("orders.line_of_action.7", "force of mesh.mesh.1")),
        ("operation.torq > 1", says("operation.torq", "did you mean operation.torque")),
    ],
)
def test_conditions_name_the_columns_there_are(text, message):
    with pytest.raises(CampaignError, match=message) as told:
        satisfied(text, COLUMNS)
    assert "_column_" not in str(told.value)


def test_coordinates_of_choices_have_the_names_of_columns():
    one = choose("fault.teeth", none=(), broken={"kind": "broken tooth", "lost": (0.2, 0.8), "tooth": (0, 28)})
    several = choose(
        "fault.teeth",
        broken={"kind": "broken tooth", "lost": (0.2, 0.8), "tooth": (0, 28)},
        worn={"kind": "wear", "depth": ("1 um", "2 um")},
    )
    for choice, names in ((one, ["lost", "tooth"]), (several, [None, "tooth"])):
        plan = make_plan(None, [choice], n=4)
        found = coordinates(type("Planned", (), {"plan": plan}))[0]
        wanted = [f"fault.teeth.{name}" if name else "severity" for name in names]
        assert found == ["fault.teeth", *wanted]
        assert set(found) <= set(plan.columns(plan.points()))


def test_units_of_results():
    pair, train = PairSubject(), DrivetrainSubject({"sensors": {"lid": {"kind": "accelerometer"}, "n": {}}})
    units = {
        "orders.line_of_action.1": "m/s^2",
        "error.peak_to_peak": "m",
        "force.max": "N",
        "two_flanks": "",
        "fm4.x": "",
    }
    assert {name: pair.unit_of_result(name) for name in units} == units
    units = {"mesh.normal_force.max": "N", "force of mesh.mesh.1": "N", "mesh.transmission_error.rms": "m",
             "mesh.pairs_back.mean": "", "lid.mesh.2": "m/s^2", "n.mesh.1": "rad/s"}  # fmt: skip
    assert {name: train.unit_of_result(name) for name in units} == units


def test_a_report_chooses_what_varies_and_tells_something_new(campaign):
    """`double` is twice `y`, `steady` varies by a hundredth."""
    assert varied_results(campaign) == ["y", "square", "steady"]
    assert varied_results(campaign, 1) == ["y"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_figures_show_all_columns_with_units(campaign, kind):
    picture = campaign.figure(kind)
    texts = [text.get_text() for text in picture.findobj(lambda item: hasattr(item, "get_text"))]
    text = "\n".join(texts).replace(",\n", ", ")
    for name in ("x1", "x2", "x3", "y", "square", "steady"):
        assert name in text
    with pytest.raises(CampaignError, match=says("result 'z'")):
        campaign.figure(kind, "z")
    with pytest.raises(CampaignError, match=says("factor 'x9'", "x1")):
        campaign.figure(kind, "y", "x9")


@pytest.mark.slow
def test_main_effects_are_means_over_the_values(campaign):
    table = campaign.table
    (ax,) = campaign.figure("main effects", "y", "x3").axes
    line = next(line for line in ax.lines if len(line.get_xdata()) == 3)
    np.testing.assert_allclose(line.get_ydata(), table.groupby("x3").y.mean())
    # of a range each point is the mean of a sixth of the cases
    (ax,) = campaign.figure("main effects", "y", "x1").axes
    line = next(line for line in ax.lines if len(line.get_xdata()) == 6)
    sixths = np.array_split(table.sort_values("x1").y.to_numpy(), 6)
    np.testing.assert_allclose(line.get_ydata()[0], sixths[0].mean(), rtol=0.2)


@pytest.mark.slow
def test_a_tornado_has_the_strongest_factor_on_top(campaign):
    (ax,) = campaign.figure("tornado", "steady").axes
    assert [text.get_text() for text in ax.get_yticklabels()][-1] == "x1"


def never(x1: float, x2: float, x3: float) -> dict:
    """Be impossible."""
    raise ValueError("x1: no such thing")


@pytest.mark.slow
def test_what_there_is_nothing_of_is_told(tmp_path):
    """A single case, of which one factor may be named; and cases that all failed."""
    one = Campaign(tmp_path / "one", make_plan(function("several"), ranges(), n=1))
    one.run(workers=0)
    for kind in KINDS:
        with pytest.raises(CampaignError, match=says("figure", "factors", "varies", "1")):
            one.figure(kind, "y")
    assert one.figure("tornado", "y", "x1").axes
    subject = FunctionSubject(never, dict.fromkeys(("x1", "x2", "x3"), 0.0))
    none = Campaign(tmp_path / "none", make_plan(subject, ranges(), n=2))
    none.run(workers=0)
    with pytest.raises(CampaignError, match=says("result 'y'", "2", "failed()")):
        none.sensitivity("y")


def test_unknown_figures_are_refused(campaign):
    with pytest.raises(CampaignError, match=says("figure 'pie'", "tornado")):
        campaign.figure("pie")


@pytest.mark.slow
def test_the_report_has_units_and_figures(campaign, tmp_path):
    page = campaign.report(tmp_path / "r.html").read_text()
    assert page.count("data:image/png;base64") == 2 + 2 * 3
    assert "<b>square</b>" in page
    assert "<b>double</b>" not in page
    with pytest.raises(CampaignError, match=says("report", "result 'z'")):
        campaign.report(tmp_path / "r.html", ["z"])
