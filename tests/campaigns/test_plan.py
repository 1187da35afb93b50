"""Plans: units, choices, specimens, constraints, corners, extension."""

import re

import numpy as np
import pytest

from gearmbs.campaigns import (
    Campaign,
    CampaignError,
    Factor,
    FunctionSubject,
    Specimens,
    choose,
    load_plan,
    make_plan,
    make_subject,
    subject_kinds,
)
from gearmbs.studies import Case
from tests.campaigns import models
from tests.campaigns.models import told
from tests.campaigns.support import function, ranges, small
from tests.says import says

SHORT = Case(operation={"duration": 0.1})


def table(plan):
    return plan.columns(plan.points())


def test_factors_have_units():
    plan = make_plan(SHORT, [Factor("operation.torque", "50 N m", "0.2 kN m", scale="log")], n=64)
    torque = table(plan)["operation.torque"]
    assert 50.0 <= torque.min() < 52.0
    assert 195.0 < torque.max() <= 200.0
    assert np.median(torque) == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize(
    ("factor", "message"),
    [
        (Factor("operation.torque", "1 mm", "2 mm"), "is in mm"),
        (Factor("operation.tork", 1, 2), "fields of operation are"),
        (Factor("operations.torque", 1, 2), "no section 'operations'"),
        (Factor("operation.torque", 5, 2), "not below"),
        (Factor("fault.misalignment", "-1 deg", "1 deg", scale="log"), "no logarithm"),
    ],
)
def test_wrong_factors_are_named(factor, message):
    with pytest.raises(CampaignError, match=message):
        make_plan(SHORT, [factor], n=4)


def test_impossible_corners_are_named_before_anything_runs(tmp_path):
    plan = make_plan(SHORT, [Factor("contact.stiffness", "1 N/mm^1.3", "3e5 N/mm^1.3")], n=4)
    with pytest.raises(CampaignError, match=says("1", "2", "contact.stiffness")):
        Campaign(tmp_path / "c", plan)
    assert not (tmp_path / "c").exists()


def test_choices_have_ranges_of_their_own():
    broken = {"kind": "broken tooth", "lost": (0.2, 0.8), "tooth": (0, 28)}
    worn = {"kind": "wear", "depth": ("1 um", "50 um")}
    plan = make_plan(SHORT, [choose("fault.teeth", none=(), broken=broken, worn=worn)], n=256)
    columns = table(plan)
    names = columns["fault.teeth"]
    assert {n: int((names == n).sum()) for n in set(names)} == pytest.approx(
        {"none": 85, "broken": 85, "worn": 85}, abs=2
    )
    assert set(np.unique(columns["fault.teeth.tooth"][names == "broken"])) == set(range(29))
    assert np.isnan(columns["fault.teeth.lost"][names != "broken"]).all()
    row = next({k: v[i] for k, v in columns.items()} for i in range(256) if names[i] == "worn")
    case = plan.subject.check(plan.data(row), "x")
    assert case.fault.teeth[0]["depth"] == pytest.approx(row["fault.teeth.depth"])
    assert 1e-6 <= case.fault.teeth[0]["depth"] <= 5e-5


def test_crossed_choices_keep_point_and_specimen():
    grades = {"kind": "manufacturing grade", "grade": 6, "seed": "drawn"}
    plan = make_plan(
        SHORT,
        [
            Factor("operation.torque", 50.0, 100.0),
            choose("fault.teeth", crossed=True, none=(), broken={"kind": "broken tooth", "lost": (0.2, 0.8)}),
            Specimens(3, {"fault.backlash": ("60 um", "140 um")}, [grades]),
        ],
        n=6,
    )
    columns = table(plan)
    assert list(columns["fault.teeth"][:4]) == ["none", "broken"] * 2
    for name in ("operation.torque", "specimen", "point"):
        np.testing.assert_array_equal(columns[name][::2], columns[name][1::2])
    rows = [{k: v[i] for k, v in columns.items()} for i in range(2)]
    healthy, faulty = (plan.subject.check(plan.data(row), "x") for row in rows)
    assert healthy.fault.backlash == faulty.fault.backlash
    assert healthy.fault.teeth == faulty.fault.teeth[1:]
    assert len(healthy.fault.teeth) == 1


def test_constraints_leave_points_out(tmp_path):
    campaign = small(tmp_path / "c", constraints=["x1 + x2 <= 0", "x3 < 3 or x1 < 0"])
    rows = [row for unit in range(campaign.folder.unit_count) for row in campaign.folder.cases(unit)]
    assert 10 < len(rows) < 30
    assert all(row["x1"] + row["x2"] <= 0 for row in rows)
    assert [row["index"] for row in rows] == list(range(len(rows)))


@pytest.mark.parametrize(
    "text",
    ["x1 +", "x9 < 1", "x1 + 1", "__import__('os')", "x1.__class__ < 1", "x1 and x2", "x1 < 1 or x2", "not x1"],
)
def test_wrong_constraints_are_named(tmp_path, text):
    with pytest.raises(CampaignError, match=re.escape(f"constraint {text!r}: ")):
        small(tmp_path / "c", constraints=[text])


def test_powers_of_whole_numbers_end(tmp_path):
    """All digits of 9**9**9 would take hours."""
    with np.errstate(over="ignore"):
        campaign = small(tmp_path / "c", constraints=["x1 ** 2 < 9**9**9", "not x1 > 2", "2 ** -1 < 1"])
    rows = [row for unit in range(campaign.folder.unit_count) for row in campaign.folder.cases(unit)]
    assert 10 < len(rows) < 40
    assert all(row["x1"] <= 2.0 for row in rows)


def test_whole_numbers_on_a_logarithmic_range():
    plan = make_plan(function(), [Factor("x1", 1, 1000, scale="log", whole=True)], n=1 << 14)
    counts = np.bincount(table(plan)["x1"], minlength=1001)
    assert counts.size == 1001
    k = np.array([1, 2, 9, 30])
    np.testing.assert_allclose(counts[k] / (1 << 14), np.log1p(1.0 / k) / np.log(1001.0), atol=2e-4)
    # each number is at its own coordinate
    (factor,) = plan.factors
    u = np.array([[factor.coordinate(k, "1")] for k in range(1, 1001)])
    assert factor.columns(u)["x1"].tolist() == list(range(1, 1001))


def test_a_plan_in_a_file(tmp_path):
    (tmp_path / "plan.toml").write_text(
        """
        design = "factorial"
        keep = ["harmonics", "contact"]
        unit = 4
        [base.operation]
        duration = "0.1 s"
        [[factor]]
        path = "operation.torque"
        low = "50 N m"
        high = "100 N m"
        [[factor]]
        path = "fault.plane"
        values = ["skew", "inclination"]
        """
    )
    plan = load_plan(tmp_path / "plan.toml")
    columns = table(plan)
    assert sorted(zip(columns["operation.torque"], columns["fault.plane"])) == [
        (50.0, "inclination"), (50.0, "skew"), (100.0, "inclination"), (100.0, "skew")
    ]  # fmt: skip


@pytest.mark.parametrize("text", ["factor = 3", "subject = 4\nfactor = []", "[factor]\npath = 'x'", "factor = ['x']"])
def test_files_without_the_tables_of_plans(tmp_path, text):
    (tmp_path / "plan.toml").write_text(f"{text}\n")
    with pytest.raises(CampaignError, match=says("subject", "factor", "once")):
        load_plan(tmp_path / "plan.toml")


def test_rows_of_a_list(tmp_path):
    rows = [{"x1": 1.0, "x2": 2.0}, {"x1": 3.0, "x2": 4.0}]
    plan = make_plan(function(), (), "list", options={"rows": rows})
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert list(campaign.table["x2"]) == [2.0, 4.0]


def test_one_at_a_time_goes_through_the_base():
    plan = make_plan(SHORT, [Factor("operation.torque", 50.0, 200.0, levels=3)], "one at a time")
    assert list(table(plan)["operation.torque"]) == pytest.approx([100.0, 50.0, 125.0, 200.0])


def test_a_folder_holds_one_campaign(tmp_path):
    small(tmp_path / "c")
    small(tmp_path / "c")
    with pytest.raises(CampaignError, match="another campaign"):
        small(tmp_path / "c", seed=9)
    with pytest.raises(CampaignError, match="cannot go on"):
        small(tmp_path / "d", design="latin hypercube").extend(80)


def test_names_of_columns_are_different():
    with pytest.raises(CampaignError, match=says("names", "own")):
        make_plan(function(), [*ranges(), Factor("x1", 0.0, 1.0)], n=4)


@pytest.mark.parametrize(
    ("base", "wanted"), [(None, {"k": 1.0}), (2.0, {"k": 1.0}), ({"k": 2.0}, {"k": 1.0}), ([], [{"k": 1.0}])]
)
def test_a_table_is_one_of_several_in_a_list_alone(base, wanted):
    plan = make_plan(FunctionSubject(models.adding, {"a": base, "b": 1.0}), [choose("a", one={"k": 1.0})], "grid")
    columns = table(plan)
    assert plan.data({name: values[0] for name, values in columns.items()}) == {"a": wanted, "b": 1.0}


def test_what_moves_the_same_is_refused():
    """A table and an entry of it, of which the last would hold; other entries, and rows with either, are none."""
    subject = FunctionSubject(models.adding, {"a": {"k": 1.0, "c": 2.0}, "b": 1.0})
    whole = choose("a", soft={"k": 1.0, "c": 1.0}, hard={"k": 2.0, "c": 1.0})
    for factors in ([Factor("a.k", 1.0, 2.0), whole], [whole, Specimens(3, {"a.k": (1.0, 2.0)})]):
        with pytest.raises(CampaignError, match=says("factors", "a.k", "a", "leave")):
            make_plan(subject, factors, n=4)
    rows = [{"a": {"k": 1.0, "c": 1.0}}, {"a.k": 2.0}]
    with pytest.raises(CampaignError, match=says("factors", "a.k", "a", "leave")):
        make_plan(subject, design="list", options={"rows": [rows[0] | rows[1]]})
    assert make_plan(subject, design="list", options={"rows": rows}).size == 2
    assert make_plan(subject, [Factor("a.k", 1.0, 2.0), choose("a.c", one=1.0, two=2.0)], n=4).size == 4


def test_a_plan_is_printed_as_what_it_does():
    factors = [
        Factor("operation.torque", "50 N m", "200 N m", scale="log"),
        Factor("operation.speed", values=("500 rpm", "600 rpm")),
    ]
    lines = str(make_plan(Case(), factors, n=8)).splitlines()
    assert lines[0] == "plan of a pair: sobol, n = 8, seed 0, 2 dimensions"
    assert lines[1] == "  operation.torque: 50 to 200 N m, logarithmic"
    assert lines[2].startswith("  operation.speed: one of 52.3")
    assert lines[-1] == "  keeps harmonics"


def test_kinds_of_subjects_are_listed():
    assert {"pair", "drivetrain", "planetary", "bearing", "deck", "function"} <= set(subject_kinds())
    assert make_subject("pair", {}).base() == Case().as_one_of_many().settings()
    with pytest.raises(CampaignError, match=says("'wheel'", "pair", "choose")):
        make_subject("wheel", {})


@pytest.mark.parametrize("design", ["sobol", "halton", "random", "latin hypercube"])
def test_exactly_the_specimens_asked_for_are_drawn(design):
    """Twelve of them by a coordinate of 24 points would be nine or so."""
    factors = [Factor("operation.torque", 50.0, 200.0), Specimens(12, {"fault.backlash": ("60 um", "140 um")})]
    plan = make_plan(SHORT, factors, design, n=24)
    numbers = table(plan)["specimen"]
    assert np.bincount(numbers).tolist() == [2] * 12
    assert sorted(numbers[:12]) == sorted(numbers[12:]) == list(range(12))
    assert not np.array_equal(numbers[:12], numbers[12:])
    np.testing.assert_array_equal(plan.columns(plan.points(12))["specimen"], numbers[:12])


def test_errors_of_a_specimen_go_where_their_path_says():
    tables = {"meshes": {"stage": {"faults": [{"kind": "wear", "depth": 1e-5}]}, "other": {}}}
    grades = [
        {"path": f"meshes.{name}.faults", "kind": "manufacturing grade", "seed": "drawn"} for name in ("stage", "other")
    ]
    Specimens(3, faults=grades, seed=1).apply(tables, {"specimen": 2})
    stage, other = (tables["meshes"][name]["faults"] for name in ("stage", "other"))
    assert [fault["kind"] for fault in stage] == ["wear", "manufacturing grade"]
    assert list(other[0]) == ["kind", "seed"]
    assert stage[1]["seed"] != other[0]["seed"]


@pytest.mark.parametrize("scale", ["log", "linear"])
def test_ends_of_ranges_are_exact(scale):
    """Neither is missed by rounding, nor is one between them beyond; a base outside of them stays where it is."""
    for low, high in ((1.0, 100.0), (0.1, 0.7), (3.0, 7.3e5)):
        factor = Factor("x1", low, high, scale=scale)
        found = factor.columns(np.r_[0.0, np.nextafter(1.0, 0.0), 1.0, 0.5][:, None])["x1"]
        assert (found[0], found[2]) == (low, high)
        assert found.max() == high
        outside = factor.columns(np.array([[factor.coordinate(2.0 * high, "1")]]))["x1"]
        assert outside == pytest.approx(2.0 * high)


def test_a_grid_of_crossed_choices_has_every_point_once():
    """Wherever the choice stands, with the ranges of its options or without."""
    g = Factor("x1", 1.0, 3.0, levels=5)
    x2 = choose("x2", crossed=True, one=1.0, two=2.0)
    x3 = choose("x3", crossed=True, plain=0.0, of_a_range={"depth": (1.0, 2.0)})
    for factors in ([x2, g], [g, x2], [x3, g], [g, x3], [x2]):
        columns = table(make_plan(function(), factors, "grid"))
        rows = list(zip(*(columns[f.name] for f in factors)))
        assert len(rows) == len(set(rows)) == 2 * (5 if g in factors else 1)
        assert g not in factors or sorted(set(columns["x1"])) == [1.0, 1.5, 2.0, 2.5, 3.0]
    columns = table(make_plan(function(), [x2, Factor("x1", 1.0, 3.0)], "one at a time", options={"levels": 3}))
    assert columns["x1"].tolist() == [0.0] * 2 + [1.0] * 2 + [2.0] * 2 + [3.0] * 2


@pytest.mark.parametrize("order", [1, -1])
def test_one_at_a_time_stands_at_the_option_of_the_base(order):
    x2 = choose("x2", one=1.0, none=0.0, two=2.0)
    columns = table(make_plan(function(), [x2, Factor("x1", -1.0, 3.0, levels=3)][::order], "one at a time"))
    rows = list(zip(columns["x1"], columns["x2"]))
    assert rows[0] == (0.0, "none")
    assert sorted(rows[1:]) == [(-1.0, "none"), (0.0, "none"), (0.0, "one"), (0.0, "two"), (1.0, "none"), (3.0, "none")]
    with pytest.raises(CampaignError, match=says("x2", "base", "one more")):
        table(make_plan(function(), [choose("x2", one=1.0, two=2.0)], "one at a time"))


def test_one_at_a_time_with_ranges_of_options():
    broken = {"kind": "broken tooth", "lost": (0.2, 0.8), "tooth": (0, 28)}
    choice = choose("fault.teeth", none=(), broken=broken)
    torque = Factor("operation.torque", 50.0, 200.0)
    columns = table(make_plan(SHORT, [torque, choice], "one at a time"))
    assert columns["fault.teeth"].tolist() == ["none"] * 4 + ["broken"]
    assert columns["fault.teeth.lost"][4] == pytest.approx(0.5)
    base = Case(operation={"duration": 0.1}, fault={"teeth": [{"kind": "broken tooth", "lost": 0.3, "tooth": 5}]})
    columns = table(make_plan(base, [choice, torque], "one at a time"))
    assert columns["fault.teeth"].tolist() == ["broken", "none", "broken", "broken", "broken"]
    assert columns["fault.teeth.lost"][0] == pytest.approx(0.3)
    assert columns["fault.teeth.tooth"][0] == 5


def test_a_unit_that_goes_by_what_varies_is_refused():
    """N/mm^1.3 is no unit of a stiffness with another exponent; numbers in SI are taken for each as they are."""
    exponent, stiffness = Factor("contact.exponent", 1.3, 1.5), ("2e5 N/mm^1.3", "3e5 N/mm^1.3")
    rows = [{"contact.stiffness": stiffness[0], "contact.exponent": 1.5}]
    for given in (
        {"factors": [exponent, Factor("contact.stiffness", *stiffness)]},
        {"factors": [exponent, Factor("contact.stiffness", values=stiffness)]},
        {"design": "list", "options": {"rows": rows}},
    ):
        with pytest.raises(CampaignError, match=says("contact.stiffness", "N/m^1.3", "contact.exponent", "numbers")):
            make_plan(SHORT, **{"design": "grid", **given})
    assert make_plan(SHORT, [Factor("contact.stiffness", *stiffness)], "grid").size == 2
    assert make_plan(SHORT, [exponent, Factor("contact.stiffness", 1e9, 2e9)], "grid").size == 4
    rows = [{"contact.stiffness": 1e9, "contact.exponent": 1.5}]
    assert make_plan(SHORT, design="list", options={"rows": rows}).size == 1


@pytest.mark.parametrize("scale", ["linear", "log"])
@pytest.mark.parametrize("base", [1, 2, 5, 7])
def test_one_at_a_time_of_whole_numbers_stands_at_the_base(scale, base):
    """In the range or beside it; a base that is no whole number has no place on one."""
    subject = FunctionSubject(models.adding, {"a": base, "b": 1.0})
    factors = [Factor("a", 1, 5, whole=True, scale=scale), Factor("b", 0.0, 2.0)]
    assert table(make_plan(subject, factors, "one at a time"))["a"].tolist() == [base, 1, 5, base, base]
    subject.parameters["a"] = base + 0.5
    with pytest.raises(CampaignError, match=says("a", f"{base + 0.5}", "whole")):
        make_plan(subject, factors, "one at a time").points()


def test_values_of_a_grid_are_different():
    """Five of three whole numbers would weigh some of them twice; as many as there are have all of them."""
    for factor, options in (
        (Factor("x1", 1, 3, whole=True, levels=5), {}),
        (Factor("x1", 1, 3, whole=True), {"levels": 5}),
        (Factor("x1", 1, 5, whole=True, scale="log", levels=5), {}),
        (Factor("x1", values=[1.0, 2.0, 1.0]), {}),
    ):
        for design in ("grid", "one at a time"):
            with pytest.raises(CampaignError, match=says("factor 'x1'", "twice", "levels", "values")):
                make_plan(function(), [factor], design, options=options)
    plan = make_plan(function(), [Factor("x1", 1, 3, whole=True, levels=3)], "grid")
    assert table(plan)["x1"].tolist() == [1, 2, 3]
    assert make_plan(function(), [Factor("x1", values=[1.0, 2.0, 1.0])], n=8).size == 8


def test_two_kinds_of_specimens_are_drawn_apart():
    """With one seed the errors and the order of both would be the same."""

    def both(seed):
        drawn = [Specimens(8, {f"x{k}": (0.0, 1.0)}, seed=k * seed, name=f"kind {k}") for k in (1, 2)]
        plan = make_plan(function(), drawn, "random", n=64)
        columns = table(plan)
        rows = [plan.data({name: values[k] for name, values in columns.items()}) for k in range(64)]
        return np.corrcoef([row["x1"] for row in rows], [row["x2"] for row in rows])[0, 1]

    with pytest.raises(CampaignError, match=says("specimens", "kind 1", "kind 2", "seed")):
        both(0)
    assert abs(both(1)) < 0.3


def test_errors_of_specimens_are_of_fields_of_their_own():
    """Of two that set a field one would be lost without a word."""
    errors = Specimens(3, {"x1": (1.0, 2.0)})
    with pytest.raises(CampaignError, match=says("x1", "several")):
        make_plan(function(), [Factor("x1", 10.0, 20.0), errors], n=4)
    with pytest.raises(CampaignError, match=says("x1", "several")):
        make_plan(function(), [errors, Specimens(2, {"x1": (3.0, 4.0)}, name="part")], n=4)
    plan = make_plan(function(), [errors, Specimens(2, {"x2": (3.0, 4.0)}, seed=1, name="part")], n=4)
    assert {"specimen", "part"} <= table(plan).keys()


def test_rows_of_a_list_are_what_they_say(tmp_path):
    """None is None, whole numbers stay whole beside rows that leave them out; factors have no place there."""
    rows = [{"p": None, "i": 4}, {"p": 2.0}, {"i": 5}]
    subject = FunctionSubject(told, {"p": 5.0, "i": 3})
    campaign = Campaign(tmp_path / "c", make_plan(subject, design="list", options={"rows": rows}))
    campaign.run(workers=0)
    found = Campaign(tmp_path / "c").table
    assert found[["pp", "ii", "is_whole"]].to_numpy().tolist() == [[-1.0, 4.0, 1.0], [2.0, 3.0, 1.0], [5.0, 5.0, 1.0]]
    assert campaign.read(["index"], "i >= 4")["index"].tolist() == [0, 2]
    with pytest.raises(CampaignError, match=says("factors", "rows", "leave")):
        make_plan(subject, [Factor("i", 1, 5, whole=True)], design="list", options={"rows": rows})


def test_a_function_is_the_one_that_its_name_stands_for():
    parameters = {"a": 1.0}
    with pytest.raises(CampaignError, match=says("adding", "wraps", "'module:name'")):
        FunctionSubject(models.adding_tenfold, parameters)
    for given, result in (
        ("tests.campaigns.models:adding_tenfold", 60.0), (models.adding, 6.0), (models.doubling, 20.0),
    ):  # fmt: skip
        subject = FunctionSubject(given, parameters)
        assert subject.run(subject.check({"a": 1.0}, "x"), lambda _: None, ["numbers"])["s"] == result
