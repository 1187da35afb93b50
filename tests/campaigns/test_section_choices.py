"""Choices of several fields of a section together: the states of a gear pair as a user names them."""

import numpy as np
import pytest

from gearmbs.campaigns import Campaign, CampaignError, Choice, Factor, Specimens, choose, make_plan
from gearmbs.campaigns.plans.factors import factor_from, factor_table
from gearmbs.studies import Case
from tests.says import says

STATES = {
    "healthy": {},
    "broken": {"teeth": {"kind": "broken tooth", "lost": (0.2, 0.8)}},
    "misaligned": {"misalignment": ("0.2 deg", "1 deg")},
}
BASE = Case(operation={"duration": "0.1 s", "run_up": "0.02 s", "settling": "0.02 s"}, fault={"backlash": "80 um"})
GRADE = {"kind": "manufacturing grade", "grade": 6, "wheel": "driver", "seed": "drawn"}


def plan(*factors, design="sobol", **options):
    options = {"n": 4, "seed": 1, **options} if design == "sobol" else options
    return make_plan(BASE, list(factors), design, **options)


def faults(made):
    columns = made.columns(made.points())
    rows = [{name: column[k] for name, column in columns.items()} for k in range(len(columns["point"]))]
    return rows, [made.data(row)["fault"] for row in rows]


def test_each_option_sets_its_fields_and_leaves_the_others():
    made = plan(
        Factor("operation.torque", "80 N m", "120 N m"),
        choose("fault", crossed=True, name="state", **STATES),
        Specimens(2, errors={"fault.backlash": ("60 um", "140 um")}, faults=(GRADE,)),
    )
    rows, found = faults(made)
    assert [row["state"] for row in rows[:3]] == list(STATES)
    for row, fault in zip(rows, found, strict=True):
        assert 60e-6 <= fault["backlash"] <= 140e-6
        kinds = [tooth["kind"] for tooth in fault["teeth"]]
        assert kinds == [*["broken tooth"] * (row["state"] == "broken"), "manufacturing grade"]
        assert fault["misalignment"] == (row["state.misalignment"] if row["state"] == "misaligned" else 0.0)
        if row["state"] == "broken":
            assert fault["teeth"][0]["lost"] == row["state.teeth.lost"]
            assert 0.2 <= row["state.teeth.lost"] <= 0.8
        if row["state"] == "misaligned":
            assert np.deg2rad(0.2) <= fault["misalignment"] <= np.deg2rad(1.0)
    assert made.unit_of("state.misalignment") == "rad"


def test_the_base_stays_where_no_option_sets_a_field():
    _, found = faults(plan(choose("fault", **STATES)))
    assert {fault["backlash"] for fault in found} == {"80 um"}


def test_one_at_a_time_begins_at_the_option_that_the_base_has():
    made = plan(Factor("operation.torque", "80 N m", "120 N m"), choose("fault", **STATES), design="one at a time")
    rows, _ = faults(made)
    assert rows[0]["fault"] == "healthy"
    assert {row["fault"] for row in rows} == set(STATES)


def test_it_is_stored_and_read_again_and_others_are_as_before(tmp_path):
    made = plan(choose("fault", crossed=True, name="state", **STATES), Specimens(2))
    again = Campaign(tmp_path / "a.campaign", made).folder.plan
    assert again.factors[0] == made.factors[0]
    assert again.factors[0].section
    of_field = factor_table(choose("fault.teeth", none=(), broken={"kind": "broken tooth"}))
    assert "section" not in of_field
    assert not factor_from(of_field).section


def test_what_is_wrong_is_told():
    with pytest.raises(CampaignError, match=says("fault.misalignment", "several")):
        plan(choose("fault", **STATES), Specimens(2, errors={"fault.misalignment": (0.0, 0.01)}))
    with pytest.raises(CampaignError, match=says("fault.misalignmnt", "misalignment")):
        plan(choose("fault", a={"misalignmnt": (0.0, 0.01)}, b={}))
    with pytest.raises(CampaignError, match=says("fault", "a = 1", "table")):
        plan(choose("fault", a=1, b={}))
    with pytest.raises(CampaignError, match=says("misalignment", "mm")):
        plan(choose("fault", a={"misalignment": ("1 mm", "2 mm")}, b={}))
    with pytest.raises(CampaignError, match=says("fault", "fields of fault")):
        plan(Factor("fault", 0.0, 1.0))
    # a choice of a field and a specimen's error of another one of the section run together
    plan(Choice("fault.teeth", {"none": (), "broken": STATES["broken"]["teeth"]}), Specimens(2))
