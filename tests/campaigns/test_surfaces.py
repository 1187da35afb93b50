"""What a campaign's response surface predicts at points of its plan."""

import numpy as np
import pytest

from gearmbs.campaigns import Campaign, CampaignError, Choice, Factor, FunctionSubject, fit_surface, make_plan
from tests.says import says


def linear(v=1.0, z=0.0, kind="a"):
    """Return a sum of what varies."""
    return {"y": 3.0 * v + z + (4.0 if kind == "b" else 0.0)}


SUBJECT = FunctionSubject(linear, {"v": 1.0, "z": 0.0, "kind": "a"})
RANGE = Factor("z", 0.0, 1.0)


@pytest.mark.parametrize("factor", [
    Factor("v", 1.0, 3.0),
    Factor("v", values=[1.0, 2.0, 10.0]),
    Factor("v", values=[10.0, 2.0, 1.0]),
    Factor("v", 1, 6, whole=True),
    Factor("kind", values=["a", "b"]),
    Choice("kind", {"one": "a", "other": "b"}),
])  # fmt: skip
@pytest.mark.slow
def test_predictions_at_points_of_the_plan(tmp_path, factor):
    campaign = Campaign(tmp_path / "c", make_plan(SUBJECT, [factor, RANGE], "sobol", n=32, keep=["numbers"]))
    campaign.run(workers=0)
    surface = campaign.response_surface("y", degree=1)
    assert surface.q_squared == pytest.approx(1.0)
    np.testing.assert_allclose(surface.predict(campaign.plan.points()), campaign.table["y"])
    # and at others
    new = np.random.default_rng(3).random((20, 2))
    columns = campaign.plan.columns(new)
    kinds = columns.get("kind", np.full(20, "a"))
    expected = 3.0 * columns.get("v", 1.0) + columns["z"] + 4.0 * np.isin(kinds, ["b", "other"])
    np.testing.assert_allclose(surface.predict(new), expected)
    assert surface.predict(new[0])[0] == pytest.approx(expected[0])
    with pytest.raises(CampaignError, match=says("3", "coordinates", "z")):
        surface.predict(np.zeros((2, 3)))


def test_a_surface_without_a_plan_goes_by_its_own_points():
    u = np.random.default_rng(1).random((20, 2))
    surface = fit_surface(u, 1.0 + u[:, 0] - u[:, 1], ["a", "b"], 1)
    assert surface.predict([0.25, 0.5])[0] == pytest.approx(0.75)
