"""Plans: units, choices, specimens, constraints, corners, extension."""

import re

import numpy as np
import pytest

from gearmbs.campaigns import (
    Campaign,
    CampaignError,
    Factor,
    Specimens,
    choose,
    load_plan,
    make_plan,
    make_subject,
    subject_kinds,
)
from gearmbs.studies import Case
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
