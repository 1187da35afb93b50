"""The paper's claims over its open settings."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, CampaignError, load_plan, make_plan
from gearmbs.campaigns.sobol_bounds import first_indices, probability
from gearmbs.campaigns.subjects.pair import ClaimsSubject, ratios
from tests.docs.support import DOCS
from tests.says import says


def levels(tilted, apart, high):
    """Harmonics of a made-up point: every amplitude 1, but for the factors given."""
    data = xr.DataArray(
        np.ones((2, 3, 1, 3)),
        dims=("load", "state", "component", "harmonic"),
        coords={
            "load": ["low", "high"],
            "state": ["healthy", "misaligned", "distance"],
            "component": ["line_of_action"],
            "harmonic": [1, 2, 3],
        },
    )
    data.loc[{"state": "misaligned", "harmonic": 2}] *= tilted
    data.loc[{"state": "distance"}] *= apart
    data.loc[{"load": "high"}] *= high
    return data


@pytest.mark.parametrize(
    ("point", "held"), [((3, 2, 2), 1), ((0.9, 2, 2), 0), ((3, 0.9, 2), 0), ((3, 2, 1.2), 0)], ids=str
)
def test_ratios_decide(point, held):
    found = ratios(levels(*point))
    assert found["misaligned.line_of_action"] == pytest.approx(point[0])
    assert found["distance.line_of_action"] == pytest.approx(point[1])
    assert found["load.line_of_action"] == pytest.approx(point[2])
    assert found["load_each.line_of_action"] == pytest.approx(1.0)
    assert found["all.line_of_action"] == held


def test_the_plan_of_the_documentation():
    plan = load_plan(DOCS / "data" / "claims.toml")
    assert len(plan.factors) == 10
    cases = plan.subject.check(plan.data({n: v[0] for n, v in plan.columns(plan.points(1)).items()}), "x")
    assert [case.operation.torque for case in cases] == [100.0] * 3 + [200.0] * 3
    assert cases[0].contact.stiffness.endswith(f"N/mm^{cases[0].contact.exponent!r}")


def test_given_data_find_what_acts():
    generator = np.random.default_rng(0)
    x = generator.random((2000, 3))
    y = np.sin(np.pi * (2 * x[:, 0] - 1)) + 7 * np.sin(np.pi * (2 * x[:, 1] - 1)) ** 2
    table = first_indices({"a": x[:, 0], "b": x[:, 1], "c": x[:, 2], "text": np.where(x[:, 2] > 0.5, "u", "v")}, y)
    exact = np.array([0.5, 49.0 / 8.0]) / (0.5 + 49.0 / 8.0)
    np.testing.assert_allclose(table["index"][["a", "b"]], exact, atol=0.03)
    assert (table["index"][["c", "text"]] < table["chance"][["c", "text"]]).all()


def test_given_data_of_a_few_values_do_not_hang_on_their_order():
    """On a grid, whose rows go by its factors, a factor without influence has none, and the only one has all."""
    slow, fast = (axis.ravel() for axis in np.meshgrid([0.0, 1.0], np.arange(100) // 10, indexing="ij"))
    columns = {
        "slow": slow,
        "fast": fast,
        "none": np.where(slow > 0.5, np.nan, 1.0),
        "each": np.arange(200).astype(str),
    }
    table = first_indices(columns, fast**2)
    assert table["index"]["fast"] == pytest.approx(1.0)
    assert (table["index"][["slow", "none"]] < table["chance"][["slow", "none"]]).all()
    assert np.isnan(table["index"]["each"])
    table = first_indices(columns, slow)
    np.testing.assert_allclose(table["index"][["slow", "none"]], 1.0)
    assert table["index"]["fast"] < table["chance"]["fast"]


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
@pytest.mark.slow
def test_given_data_are_right_on_average(share):
    """Of independent results over as many values as bins, five of each."""
    generator = np.random.default_rng(1)
    found = []
    for _ in range(300):
        x = generator.permutation(np.arange(100) // 5)
        y = np.sqrt(share) * (2.0 * (x % 2) - 1.0) + np.sqrt(1.0 - share) * generator.standard_normal(100)
        found.append(first_indices({"x": x}, y, bins=20)["index"]["x"])
    error = np.std(found) / np.sqrt(len(found))
    assert abs(np.mean(found) - share) < 4.0 * error + 0.005


def test_probability_has_its_interval():
    p, low, high = probability(np.array([1.0] * 30 + [0.0] * 70 + [np.nan]))
    assert p == 0.3
    np.testing.assert_allclose([low, high], [0.2189, 0.3958], atol=1e-4)
    for values in ([], [np.nan], [0.0, 3.0]):
        with pytest.raises(CampaignError, match=says("probability", "condition")):
            probability(values)


@pytest.mark.slow
def test_the_preset_is_the_paper(tmp_path):
    """At the preset the ratios are those of the study itself."""
    from gearmbs.studies import Case, run_paper

    plan = make_plan(ClaimsSubject(), (), "list", options={"rows": [{"depth": 1e-4}]}, unit=1)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    base = Case(operation={"duration": 0.1, "run_up": 0.03, "settling": 0.03})
    table = run_paper(base, workers=1, progress=False).table("line_of_action", "orders")
    expected = float((table.sel(state="misaligned") / table.sel(state="healthy")).sel(harmonic=2).min())
    assert campaign.table["misaligned.line_of_action"][0] == pytest.approx(expected, rel=1e-6)
