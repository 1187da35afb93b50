"""What campaigns write for others: in a place that will do, under names that the format takes, rows in their splits."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, CampaignError, CampaignWarning, Factor, FunctionSubject, choose, make_plan
from gearmbs.campaigns.datasets.splits import withhold
from gearmbs.campaigns.subjects.pair import PairSubject
from gearmbs.studies import Case
from tests.campaigns.support import small
from tests.says import says

FILES = ("csv", "netcdf", "matlab")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A campaign of eight cases that is done."""
    found = small(tmp_path_factory.mktemp("exports") / "c", n=8)
    found.run(workers=0)
    return found


@pytest.mark.parametrize("form", [*FILES, "parquet", "hf"])
def test_places_that_will_not_do_are_told(campaign, tmp_path, form):
    """A folder where a file is to be, and the other way round; what is no path. A folder that is new is made."""
    (tmp_path / "file").write_text("mine")
    wrong = [
        (tmp_path / "file" / "deeper", ("file", "choose another place")),
        (None, ("path", "None")),
        (5, ("path", "5")),
    ]
    wrong += [(tmp_path, ("folder", "name"))] if form in FILES else [(tmp_path / "file", ("file", "another place"))]
    for target, words in wrong:
        with pytest.raises(CampaignError, match=says(*words)):
            campaign.export(target, form)
    assert (tmp_path / "file").read_text() == "mine"
    written = campaign.export(tmp_path / "new" / "out", form)
    assert all(path.is_file() for path in written)


@pytest.mark.slow
def test_reports_and_pages_that_have_no_place(campaign, tmp_path):
    with pytest.raises(CampaignError, match=says("folder", "c.html")):
        campaign.report(tmp_path)
    with pytest.raises(CampaignError, match=says("path", "5")):
        campaign.run(workers=0, page=5)
    with pytest.raises(CampaignError, match=says("plan", "5", "make_plan")):
        Campaign(tmp_path / "x", 5)
    assert campaign.report(tmp_path / "r" / "r.html", "y").is_file()


def test_a_card_of_something_else_is_not_written_over(campaign, tmp_path):
    (tmp_path / "README.md").write_text("# Mine\n")
    with pytest.raises(CampaignError, match=says("README.md", "choose another folder")):
        campaign.export(tmp_path, "hf")
    assert list(tmp_path.iterdir()) == [tmp_path / "README.md"]
    # that of a former export is, and parquet alone has none
    campaign.export(tmp_path, "parquet")
    campaign.export(tmp_path / "again", "hf")
    campaign.export(tmp_path / "again", "hf")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"split": ["train"] * 3}, ("split", "(3,)", "8 rows")),
        ({"split": ["../x"] * 8}, ("split", "../x", "letters")),
        ({"split": np.arange(8)}, ("split", "0", "letters")),
        ({"split": ["test"] * 8, "split_by": "point"}, ("split_by", "give one")),
        ({"split_by": "point", "test": "a"}, ("test", "'a'", "parts")),
        ({"held_out": [("x1", 0, 1)]}, ("held out", "range", "severity")),
        ({"held_out": {"x1": 3}}, ("held out", "3", "lower")),
        ({"held_out": {"x1": ("a", 1)}}, ("held out", "'a'", "lower")),
        ({"held_out": {"x1": (-9, 9)}}, ("held out", "x1", "nothing to train on")),
        ({"add": {"z": [1, 2]}}, ("add", "z", "8 rows")),
        ({"add": {"x1": np.zeros(8)}}, ("add", "x1", "another name")),
        ({"add": {"signal.wave": np.zeros(8)}}, ("signal.wave", "twice")),
        ({"add": {"z": [object()] * 8}}, ("z", "parquet", "leave it out")),
    ],
)
def test_splits_and_columns_that_are_none(campaign, tmp_path, settings, words):
    with pytest.raises(CampaignError, match=says(*words)):
        campaign.export(tmp_path / "o", "parquet", **settings)
    assert not (tmp_path / "o" / "data").exists()


def nothing(x: float) -> dict[str, float]:
    """Return nothing, or a result without a name."""
    if x < 0.5:
        raise ValueError("x: too little")
    return {"": x}


@pytest.mark.slow
def test_nothing_is_exported_where_nothing_is_done(tmp_path):
    subject = FunctionSubject(nothing, {"x": 0.0})
    campaign = Campaign(tmp_path / "c", make_plan(subject, Factor("x", 0.0, 1.0), n=4))
    assert campaign.run(workers=0).failed == 4
    assert campaign.failed().message.str.contains("without a name").sum() == 2
    with pytest.raises(CampaignError, match=says("export", "none", "failed")):
        campaign.export(tmp_path / "o", "parquet")
    # the table says how each of them has ended
    assert len(pd.read_csv(campaign.export(tmp_path / "t.csv", "csv")[0])) == 4


def test_splits_and_columns_that_are_some(campaign, tmp_path):
    with pytest.raises(CampaignError, match=says("split_by", "csv", "parquet")):
        campaign.export(tmp_path / "t.csv", "csv", split_by="point")
    files = campaign.export(
        tmp_path / "o", "parquet", split=["train"] * 6 + ["test_1"] * 2, held_out={"x1": (-9, 0)}, add={"z": range(8)}
    )
    rows = pd.concat({path.name.split("-")[0]: pd.read_parquet(path) for path in files}).reset_index(0, names="split")
    assert sorted(rows.z) == list(range(8))
    assert set(rows.split[rows.z >= 6]) == {"test_1"}
    assert ((rows.split == "withheld") == ((rows.z < 6) & (rows.x1 <= 0))).all()
    with pytest.warns(CampaignWarning, match=says("held out", "x1", "no row")):
        campaign.export(tmp_path / "o", "parquet", held_out={"x1": (50, 60)})
    # a former split of another name is gone
    assert [path.name.split("-")[0] for path in (tmp_path / "o" / "data").iterdir()] == ["train"]


def states(path, **options) -> Campaign:
    """Return a campaign over a choice of states, of which some have sizes."""
    given = {"sound": "sound", "worn": {"size": (0.0, 1.0)}, "fixed": {"size": 0.5}, **options}
    subject = FunctionSubject(having, {"state": "sound"})
    found = Campaign(path, make_plan(subject, choose("state", **given), n=32, seed=2))
    found.run(workers=0)
    return found


def having(state) -> dict[str, float]:
    """Return the size of a state."""
    return {"y": 0.0 if state == "sound" else float(state["size"])}


@pytest.mark.slow
def test_a_state_without_size_is_not_held_out(tmp_path):
    """Its severity is 0 in the table, and it has none: a range of small ones takes the small ones of the others."""
    campaign = states(tmp_path / "c")
    files = campaign.export(tmp_path / "o", "parquet", held_out={"severity": (0.0, 0.3)})
    parts = {path.name.split("-")[0]: pd.read_parquet(path) for path in files}
    assert set(parts["withheld"].state) == {"worn"}
    assert (parts["withheld"].severity <= 0.3).all()
    assert set(parts["train"].state) == {"sound", "worn", "fixed"}
    assert (parts["train"].severity[parts["train"].state == "worn"] > 0.3).all()
    with pytest.warns(CampaignWarning, match=says("state", "'worn'", "narrower")):
        campaign.export(tmp_path / "o", "parquet", held_out={"severity": (0.0, 1.0)})


def test_nothing_is_withheld_of_what_has_no_severity():
    split = np.array(["train", "train", "test", "train"])
    held = withhold(split, np.array([0.1, np.nan, 0.1, 0.9]), 0.0, 0.5)
    assert held.tolist() == ["withheld", "train", "test", "train"]
    with pytest.raises(CampaignError, match=says("withhold", "lower end")):
        withhold(split, np.zeros(4), 0.6, 0.45)


def test_ranges_held_out_in_units(tmp_path):
    subject = FunctionSubject(torque, {"torque": 50.0}, units={"torque": "N m"})
    campaign = Campaign(tmp_path / "c", make_plan(subject, Factor("torque", "50 N m", "90 N m", levels=5), "grid"))
    campaign.run(workers=0)
    files = campaign.export(tmp_path / "o", "parquet", held_out={"torque": ("0.055 kN m", "0.075 kN m")})
    parts = {path.name.split("-")[0]: pd.read_parquet(path).torque.tolist() for path in files}
    assert parts == {"train": [50.0, 80.0, 90.0], "withheld": [60.0, 70.0]}


def torque(torque: float) -> float:
    """Return a number."""
    return 2.0 * torque


def oddly(x: float, how: str | None = None) -> dict[str, float]:
    """Return results under names that netCDF does not take, and one that is what another becomes."""
    return {"a/b": x, "a_b": 2.0 * x, "(c)": 3.0 * x, "d ": 4.0 * x, "e.f": 5.0 * x}


def test_names_that_netcdf_does_not_take(tmp_path):
    """A slash parts groups; what is renamed is told, and says its own name. Texts that are not given are empty."""
    rows = [{"x": 1.0, "how": "so"}, {"x": 2.0, "how": None}]
    subject = FunctionSubject(oddly, {"x": 0.0, "how": None})
    campaign = Campaign(tmp_path / "c", make_plan(subject, design="list", options={"rows": rows}))
    campaign.run(workers=0)
    with pytest.warns(CampaignWarning) as told:
        (nc,) = campaign.export(tmp_path / "t.nc", "netcdf")
    assert len(told) == 3
    with xr.open_dataset(nc) as data:
        for name, own, times in (
            ("a_b_2", "a/b", 1),
            ("a_b", None, 2),
            ("v_(c)", "(c)", 3),
            ("d", "d ", 4),
            ("e.f", None, 5),
        ):
            np.testing.assert_array_equal(data[name], [times, 2.0 * times])
            assert data[name].attrs.get("long_name") == own
        assert data["how"].values.tolist() == ["so", ""]


def test_names_that_netcdf_takes_stay(campaign, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error", CampaignWarning)
        (nc,) = campaign.export(tmp_path / "t.nc", "netcdf")
    with xr.open_dataset(nc) as data:
        np.testing.assert_array_equal(data.y, campaign.table.y)
        np.testing.assert_array_equal(data.wave, campaign.open().wave)


def test_names_of_dimensions_are_taken(tmp_path):
    """A factor or result of the name of a signal's axis would stand in its place."""
    subject = FunctionSubject(axes, {"wave_time": 1.0}, signals={"wave": (3, 1.0)})
    with pytest.raises(CampaignError, match=says("wave_time", "another column", "name=")):
        make_plan(subject, Factor("wave_time", 1.0, 2.0), n=2, keep=["numbers", "signal:wave"])
    plan = make_plan(subject, Factor("wave_time", 1.0, 2.0, name="t"), n=2, keep=["numbers", "signal:wave"])
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    data = campaign.open()
    np.testing.assert_array_equal(data["wave_time"], [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(data["result.wave_channel"], campaign.table.t)


def axes(wave_time: float) -> dict:
    """Return a signal and a number of the name of its axis."""
    return {"wave": np.arange(3.0), "wave_channel": wave_time}


def test_signals_of_a_pair_that_share_an_array_or_a_name():
    """Two components are two channels of one array; x of two forces are two columns."""
    from gearmbs.campaigns.stored.exports import signal_columns

    subject = PairSubject(Case(operation={"duration": 0.06}))
    things = [subject.check(subject.base(), "x")]

    def arrays(*names):
        return {spec.name: spec.channels for spec in subject.signals([f"signal:{name}" for name in names], things)}

    assert arrays("line_of_action", "tangential") == {"acceleration": ("line_of_action", "tangential")}
    assert arrays("line_of_action", "line_of_action") == {"acceleration": ("line_of_action",)}
    assert arrays("tangential", "acceleration")["acceleration"][:1] == ("tangential",)
    assert len(arrays("tangential", "acceleration")["acceleration"]) == 4
    specs = subject.signals(["signal:force_1", "signal:force_2", "signal:tangential"], things)
    columns = signal_columns(specs)
    assert columns["force_1", "x"] == "signal.force_1.x"
    assert columns["force_2", "x"] == "signal.force_2.x"
    assert columns["acceleration", "tangential"] == "signal.tangential"


@pytest.mark.slow
def test_signals_of_a_pair_are_those_of_its_record(tmp_path):
    base = Case(operation={"duration": 0.06, "run_up": 0.02, "settling": 0.02})
    keep = ["signal:tangential", "signal:line_of_action", "signal:force_1", "signal:force_2", "record"]
    campaign = Campaign(tmp_path / "c", make_plan(base, Factor("operation.torque", 80.0, 90.0), n=1, keep=keep))
    campaign.run(workers=0)
    data, record = campaign.open(), campaign.record(0)
    for channel in ("tangential", "line_of_action"):
        here = data.acceleration.sel(acceleration_channel=channel).values[0]
        np.testing.assert_allclose(here, record.acceleration.sel(component=channel).values, rtol=1e-6)
    (file,) = campaign.export(Path(tmp_path / "o"), "parquet")
    rows = pd.read_parquet(file)
    for force in ("force_1", "force_2"):
        np.testing.assert_array_equal(rows[f"signal.{force}.y"][0], data[force].values[0, 1])
    # without the acceleration nothing but the force is needed
    alone = Campaign(
        tmp_path / "d", make_plan(base, Factor("operation.torque", 80.0, 90.0), n=1, keep=["signal:force_1"])
    )
    assert alone.run(workers=0).failed == 0
