"""The column of severities and what else may be called so."""

import numpy as np
import pytest

from gearmbs.campaigns import CampaignError, Choice, FunctionSubject, choose, make_plan
from tests.says import says

RANGES = {"none": {}, "worn": {"severity": (10.0, 20.0), "size": (0.0, 1.0)}}


def taking(defect=None, severity=None):
    """Return nothing of meaning."""
    return {"s": 0.0}


SUBJECT = FunctionSubject(taking, {"defect": {}, "severity": {}})


def test_a_range_that_is_called_severity():
    with pytest.raises(CampaignError, match=says("state", "state.severity")):
        make_plan(SUBJECT, Choice("defect", RANGES, name="state"), n=8)
    # without a name the column of severities is another one
    plan = make_plan(SUBJECT, Choice("defect", RANGES), n=8)
    columns = plan.columns(plan.points())
    worn = columns["defect"] == "worn"
    given = columns["defect.severity"][worn]
    np.testing.assert_allclose(columns["severity"][worn], (given - 10.0) / 10.0)
    assert np.isnan(columns["defect.severity"][~worn]).all()
    row = {name: column[np.flatnonzero(worn)[0]].item() for name, column in columns.items()}
    assert plan.data(row)["defect"]["severity"] == given[0]
    # and one with a name runs whose ranges are called otherwise
    plan = make_plan(SUBJECT, choose("defect", name="state", none={}, worn={"size": (0.0, 1.0)}), n=8)
    assert {"state.size", "state.severity"} <= {*plan.columns(plan.points())}


def test_a_choice_that_is_called_severity():
    with pytest.raises(CampaignError, match=says("severity", "its own", "name='...'")):
        make_plan(SUBJECT, choose("severity", low={}, high={"size": (0.0, 1.0)}), n=8)
    plan = make_plan(SUBJECT, choose("severity", name="state", low={}, high={"size": (0.0, 1.0)}), n=8)
    columns = plan.columns(plan.points())
    assert set(columns["state"]) == {"low", "high"}
    np.testing.assert_array_equal(columns["state.severity"], np.nan_to_num(columns["state.size"]))
