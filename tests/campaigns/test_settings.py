"""What a plan or a question takes means something, and what a part of a campaign gives says so."""

from __future__ import annotations

import re
import warnings
from functools import partial

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import (
    BearingSubject,
    Campaign,
    CampaignError,
    CampaignWarning,
    Choice,
    DeckSubject,
    Factor,
    FunctionSubject,
    PairSubject,
    Specimens,
    choose,
    condition_figure,
    condition_map,
    make_plan,
)
from gearmbs.campaigns.datasets.splits import split_by_group
from tests.campaigns.support import function, ranges, small
from tests.says import says


@pytest.mark.parametrize(
    ("design", "settings", "words"),
    [
        ("grid", {"n": 100}, ("n = 100", "grid", "leave")),
        ("central composite", {"options": {"faced": "no"}}, ("faced", "'no'", "true")),
        ("central composite", {"options": {"centre": -1}}, ("centre", "-1")),
        ("box behnken", {"options": {"centre": "x"}}, ("centre", "'x'")),
        ("factorial", {"options": {"generators": [3]}}, ("generators", "texts")),
        ("factorial", {"options": {"generators": "C=AB"}}, ("generators", "texts")),
    ],
)
def test_options_that_mean_nothing(design, settings, words):
    with pytest.raises(CampaignError, match=says(*words)):
        make_plan(function(), ranges(), design, **settings)


@pytest.mark.parametrize(
    ("design", "options", "cases"),
    [
        ("central composite", {"faced": False, "centre": 2}, 16),
        ("box behnken", {"centre": 0}, 12),
        ("factorial", {"generators": ["C=AB"]}, 4),
    ],
)
def test_options_that_mean_something(design, options, cases):
    assert make_plan(function(), ranges(), design, options=options).size == cases


@pytest.mark.parametrize("design", ["factorial", "plackett burman"])
def test_designs_of_two_levels_take_no_names_without_order(design):
    def plan(*values):
        return make_plan(function(), [*ranges()[:2], Factor(ranges()[2].path, values=values)], design)

    with pytest.raises(CampaignError, match=says(design, "3 values", "grid")):
        plan("a", "b", "c")
    assert plan(0.0, 1.0).size == plan(0.0, 0.5, 1.0).size == plan(1.0, 0.5, 0.0).size
    with pytest.raises(CampaignError, match=says(design, "0.5", "1.0", "ascending")):
        plan(0.5, 0.0, 1.0)


@pytest.mark.parametrize(
    ("design", "options", "most"),
    [
        ("factorial", {}, 2),
        ("central composite", {}, 3),
        ("box behnken", {}, 3),
        ("morris", {}, 4),
        ("morris", {"levels": 6}, 6),
        ("sobol", {}, 9),
    ],
)
def test_alternatives_are_not_left_out_in_silence(design, options, most):
    """What has no order and has more alternatives than a design takes is refused, names and choices alike."""
    n = {"n": 4} if design in ("morris", "sobol") else {}
    for count in (most, most + 1):
        names = [f"v{k}" for k in range(count)]
        for last in (Factor(ranges()[2].path, values=names), Choice(ranges()[2].path, {name: 1.0 for name in names})):
            ask = partial(make_plan, function(), [*ranges()[:2], last], design, options=options, **n)
            if count == most or design == "sobol":
                assert ask().size > 0
            else:
                with pytest.raises(CampaignError, match=says(ranges()[2].path, f"{count} values", design, "order")):
                    ask()


def test_what_is_of_ranges_stands_beside_no_values():
    for settings in ({"levels": 3}, {"scale": "log"}):
        with pytest.raises(CampaignError, match=says("levels", "scale", "values")):
            Factor("x1", values=[1.0, 2.0], **settings)
        assert Factor("x1", 1.0, 2.0, **settings).in_si(function()).width == 1


def spring(spring: dict, m: float = 1.0) -> dict:
    """Return what a spring has."""
    return {"k": spring["k"], "words": float(len(spring.get("names", ())))}


@pytest.mark.slow
def test_tables_of_functions_have_ranges_with_units(tmp_path):
    choice = choose("spring", soft={"k": ("1 N/mm", "2 N/mm"), "names": ["x", "y"]}, stiff={"k": ("3 N/mm", "4 N/mm")})
    parameters = {"spring": {"k": 1.0}}
    subject = FunctionSubject(spring, parameters, units={"spring.k": "N/m"})
    campaign = Campaign(tmp_path / "c", make_plan(subject, [choice], n=8))
    assert campaign.run(workers=0).failed == 0
    table = campaign.table
    soft = table.spring == "soft"
    assert table.k[soft].between(1e3, 2e3).all()
    assert table.k[~soft].between(3e3, 4e3).all()
    assert (table.words == 2.0 * soft).all()
    with pytest.raises(CampaignError, match=says("spring.soft.k", "no unit", "numbers")):
        make_plan(FunctionSubject(spring, parameters), [choice], n=8)


def same(record) -> dict:
    """Return a number under a name that the record has."""
    return {"y": 1.0}


def test_numbers_of_one_name_are_told(tmp_path):
    own = f"{__name__}:same"
    campaign = small(tmp_path / "c", keep=["numbers", own], n=2)
    assert campaign.run(workers=0).failed == 2
    assert re.search(says("keep", "'numbers'", "y"), campaign.failed().message[0])
    alone = small(tmp_path / "d", keep=[own], n=2)
    alone.run(workers=0)
    assert set(alone.table.y) == {1.0}


ACCELERATION = xr.Dataset({"acceleration": (("channel", "t"), np.eye(3))}, coords={"channel": list("xyz")})
PERIODIC = xr.Dataset(attrs={"record_status": "periodic", "record_apart": 0.25, "record_deviation": 1e-6})


def level(record) -> dict:
    """Return a number under a name that bearings have."""
    return {"rms.y": -1.0}


def apart(record) -> dict:
    """Return a number under a name that records of pairs have."""
    return {"record.apart": -1.0}


def last(record) -> dict:
    """Return a number under a name that decks have."""
    return {"request_1.F2.last": -1.0}


@pytest.mark.parametrize(
    ("subject", "record", "keep", "own", "name"),
    [
        (BearingSubject({}), ACCELERATION, "levels", level, "rms.y"),
        (PairSubject(), PERIODIC, None, apart, "record.apart"),
        (DeckSubject("t\nEND\n", {}, end=1.0), {"request_1.F2": np.ones(4)}, "requests", last, "request_1.F2.last"),
    ],
)
def test_numbers_of_a_subject_are_not_written_over(subject, record, keep, own, name):
    """A function of one's own under the name of what the subject keeps; under another one both are there."""
    asked = [item for item in (keep, f"{__name__}:{own.__name__}") if item]
    with pytest.raises(CampaignError, match=says("keep", name, "rename")):
        subject.reduce(None, record, asked)
    other = next(f for f in (level, apart, last) if f is not own)
    kept = subject.reduce(None, record, [*asked[:-1], f"{__name__}:{other.__name__}"]).numbers
    assert name in kept
    assert kept[next(iter(other(None)))] == -1.0


def test_a_factor_is_no_result(tmp_path):
    """One that has the name of a result: that is then found under its own."""
    subject = FunctionSubject("tests.campaigns.models:told", {"p": 5.0, "i": 3})
    campaign = Campaign(tmp_path / "c", make_plan(subject, [Factor("p", 0.0, 1.0, name="pp")], n=8, unit=8))
    campaign.run(workers=0)
    with pytest.raises(CampaignError, match=says("result 'pp'", "plan", "result.pp")):
        campaign.sensitivity("pp")
    assert campaign.sensitivity("result.pp").indices[0][0] == pytest.approx(1.0)


def loud(x: float) -> dict:
    """Return a signal that single precision does not hold."""
    return {"y": x, "wave": [x * 1e39, 1.0]}


def test_signals_beyond_single_precision_are_counted(tmp_path):
    subject = FunctionSubject(loud, {"x": 0.0}, signals={"wave": (2, 1.0)})
    rows = [{"x": 1.0}, {"x": 0.1}]
    plan = make_plan(subject, design="list", options={"rows": rows}, keep=["numbers", "signal:wave"])
    campaign = Campaign(tmp_path / "c", plan)
    assert campaign.run(workers=0).not_numbers == 1
    assert np.isinf(campaign.open().wave.values[:, 0, 0]).tolist() == [True, False]


def test_a_specimen_has_a_whole_tooth():
    drawn = []
    for number in range(40):
        data = {}
        faults = [{"kind": "broken tooth", "lost": (0.2, 0.8), "tooth": (0, 3)}]
        Specimens(40, faults=faults).apply(data, {"specimen": number})
        drawn.append(data["fault"]["teeth"][0])
    assert {type(fault["tooth"]) for fault in drawn} == {int}
    assert {fault["tooth"] for fault in drawn} == {0, 1, 2, 3}
    assert all(0.2 <= fault["lost"] <= 0.8 for fault in drawn)


@pytest.mark.parametrize("groups", [[[1], [2], [3]], ["a", None, "b"], [[1], [2, 3]], []])
def test_groups_that_are_none(groups):
    with pytest.raises(CampaignError, match=says("groups", "specimen", "kind")):
        split_by_group(groups)
    assert set(split_by_group(list("aabbccdd"))) == {"train", "test", "validation"}


@pytest.mark.slow
def test_what_is_made_of_a_part_says_so(tmp_path):
    campaign = small(tmp_path / "c")
    campaign.work(1, 2)
    told = says("24 of 40", "left out", "16 not done")
    with pytest.warns(CampaignWarning, match=told):
        campaign.export(tmp_path / "a.csv", "csv")
    for make in (
        lambda: campaign.figure("main effects", "y"),
        lambda: campaign.figure("parallel coordinates", "y"),
        lambda: condition_figure(campaign, "y > 0", "x1", "x2", 2),
    ):
        with pytest.warns(CampaignWarning, match=told):
            picture = make()
        titles = [text.get_text() for text in (*picture.texts, *(ax.title for ax in picture.axes))]
        assert any(re.search(told, title) for title in titles)
    with pytest.warns(CampaignWarning, match=says("y", "no result", "surface")):
        campaign.response_surface("y", 1)
    with pytest.raises(CampaignError, match=says("test", "split_by")):
        campaign.export(tmp_path / "b", "hf", test=0.3)
    campaign.run(workers=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", CampaignWarning)
        campaign.export(tmp_path / "b", "hf", split_by="point", test=0.3)
        campaign.response_surface("y", 1)
        assert "left out" not in condition_figure(campaign, "y > 0", "x1", "x2", 2).axes[0].get_title()


@pytest.mark.slow
def test_results_that_are_no_numbers_are_left_out_of_maps_and_figures(tmp_path):
    """Neither a condition about them holds nor its opposite; what tells of other columns has all cases."""
    campaign = small(tmp_path / "c", "silent", keep=["numbers"], unit=64)
    campaign.run(workers=0)
    there = int((campaign.table["x1"] <= 0.0).sum())
    told = f"{there} of 40 cases; left out: {40 - there} without a number"
    maps = []
    for condition in ("y > 0", "not y > 0"):
        with pytest.warns(CampaignWarning, match=says(f"{there} of 40 cases", f"{40 - there} without a number")):
            share, counts, edges, _ = condition_map(campaign, condition, "x1", "x2", 2)
        assert counts.sum() == there
        assert edges[-1] <= 0.0
        maps.append(share)
    np.testing.assert_allclose(maps[0] + maps[1], 1.0)
    with pytest.warns(CampaignWarning, match=says(f"{there} of 40 cases", f"{40 - there} without a number")):
        picture = campaign.figure("main effects", "y")
    assert told in picture.texts[0].get_text()
    none = make_plan(function("silent"), [Factor("x1", 1.0, 2.0), Factor("x2", 0.0, 1.0)], "grid", keep=["numbers"])
    nothing = Campaign(tmp_path / "d", none)
    nothing.run(workers=0)
    with (
        pytest.warns(CampaignWarning, match=says("4 without a number")),
        pytest.raises(CampaignError, match=says("none of the cases")),
    ):
        condition_map(nothing, "y > 0", "x1", "x2")
    with warnings.catch_warnings():
        warnings.simplefilter("error", CampaignWarning)
        assert condition_map(campaign, "x1 > 0 or x2 > 9", "x1", "x2", 2)[1].sum() == 40


@pytest.mark.slow
def test_a_report_of_a_part_says_so_once(tmp_path):
    """The cases that are not done, and those that failed; a whole one has nothing to say."""
    campaign = small(tmp_path / "c", "picky")
    campaign.work(1, 2)
    with pytest.warns(CampaignWarning) as told:
        page = campaign.report(tmp_path / "r.html", "y").read_text()
    told = [warning for warning in told if "left out" in str(warning.message)]
    assert len(told) == 1
    failed = len(campaign.failed())
    assert failed > 0
    words = f"{24 - failed} of 40 cases; left out: 16 not done yet, {failed} failed"
    assert words in str(told[0].message)
    assert f"<b>{words}</b>" in page
    whole = small(tmp_path / "d")
    whole.run(workers=0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "of 40 cases;" not in whole.report(tmp_path / "s.html", "y").read_text()


@pytest.mark.slow
def test_one_run_at_the_centre_has_no_error_left_out(tmp_path):
    """It alone decides the constant; of three each is told by the others."""
    for centre, options in ((1, {}), (3, {"options": {"centre": 3}})):
        campaign = Campaign(tmp_path / str(centre), make_plan(function(), ranges(), "box behnken", **options))
        campaign.run(workers=0)
        assert len(campaign.table) == 12 + centre
        if centre == 3:
            assert np.isfinite(campaign.response_surface("y").q_squared)
            continue
        with pytest.warns(CampaignWarning, match=says("y", "leverage 1", "1 of 13 points", "'centre': 3")):
            surface = campaign.response_surface("y")
        assert np.isnan(surface.q_squared)
        assert surface.alone == 1
        with pytest.warns(CampaignWarning, match="leverage"):
            text = campaign.report(tmp_path / "r.html", "y").read_text()
        assert "nan" not in text.partition("Response surface")[2].partition("<table")[0]
        assert np.isfinite(campaign.response_surface("y", degree=1).q_squared)
