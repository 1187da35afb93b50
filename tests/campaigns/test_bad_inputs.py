"""What is given wrongly is refused before anything runs, in one line with the remedy; what is meant is taken."""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import (
    Campaign,
    CampaignError,
    CampaignWarning,
    Factor,
    FunctionSubject,
    Specimens,
    choose,
    condition_map,
    make_plan,
    make_subject,
)
from gearmbs.campaigns.folder import make_folder
from gearmbs.studies import Case
from gearmbs.studies.run.claims import take
from tests.campaigns.models import PLACES, ishigami
from tests.campaigns.support import function, ranges, small
from tests.says import says

TORQUE = Factor("operation.torque", 50.0, 60.0)
BAD_PLANS = [
    ({"n": 2.5}, "n = 2.5; give a whole number"),
    ({"n": "8"}, "n = '8'; give a whole number"),
    ({"seed": None}, "seed = None; give a whole number"),
    ({"seed": -1}, "seed = -1; give a whole number, 0 or more"),
    ({"unit": 2.5}, "unit = 2.5; give a whole number"),
    ({"uint": 4}, "unknown setting 'uint'; did you mean unit"),
    ({"time_limit": "60 N"}, "time_limit = '60 N'; give a positive number or text such as '60 s'"),
    ({"time_limit": -5}, "time_limit = -5; give a positive"),
    ({"memory_limit": "2 apples"}, "memory_limit = '2 apples'"),
    ({"factors": ["operation.torque"]}, "factors: 'operation.torque' is none; give Factor"),
    ({"factors": [TORQUE, Factor("operation.torque", 1.0, 2.0, name="other")]}, "is set by several of them"),
    ({"base": {"operation": {}}}, "give a Case or a Subject"),
    ({"design": "factorial", "options": {"generator": ["B=A"]}}, "did you mean generators"),
    ({"design": "list", "options": {"rows": "none"}}, "give options={'rows'"),
    ({"design": "morris", "options": {"levels": 3}}, "levels = 3; a morris design needs an even number"),
    ({"factors": [choose("fault.teeth", a={"kind": "broken tooth", "lost": (0.9, 0.1)})]}, "give the lower end first"),
    ({"factors": [Specimens(5, {"fault.backlash": ("160 um", "60 um")})]}, "160 um is above 60 um"),
]


@pytest.mark.parametrize(("settings", "words"), BAD_PLANS, ids=[" ".join(s) for s, _ in BAD_PLANS])
def test_bad_plans(settings, words):
    given = {"base": Case(), "factors": [TORQUE], "n": 4, **settings}
    with pytest.raises(CampaignError) as error:
        make_plan(**given)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"high": float("inf")}, "is not finite"),
        ({"values": "100 N m", "low": None, "high": None}, "give a list"),
        ({"levels": 0}, "levels = 0; give a whole number, 1 or more"),
        ({"levels": 2.5}, "levels = 2.5; give a whole number"),
        ({"low": 2.5, "high": 7.0, "whole": True}, "2.5 to 7 is no range of whole numbers"),
        ({"name": 5}, "path and name are texts"),
        ({"whole": "no"}, "whole is true or false"),
        ({"name": "index"}, "index is the name of another column"),
        ({"name": "case"}, "case is the name of another column"),
    ],
)
def test_bad_factors(settings, words):
    with pytest.raises(CampaignError) as error:
        make_plan(Case(), [Factor(**{"path": "operation.torque", "low": 1.0, "high": 2.0, **settings})], n=4)
    assert words in str(error.value)


def test_what_is_meant_is_taken():
    plan = make_plan(Case(), TORQUE, n=4.0, keep="harmonics", time_limit="2 min", memory_limit="2 GB", reuse="a")
    assert plan.n == 4
    assert plan.keep == ("harmonics",)
    assert plan.time_limit == 120.0
    assert plan.memory_limit == 2e9
    # workers need not run in the folder of this process
    assert plan.reuse == (str(Path("a").absolute()),)
    grid = make_plan(Case(), [TORQUE, Factor("operation.speed", 90.0, 110.0, levels=2)], "grid", options={"levels": 5})
    assert len(grid.points()) == 10


def test_rows_of_a_list_leave_out_what_stays():
    rows = [{"operation.torque": "100 N m"}, {"operation.torque": 120, "operation.speed": "900 rpm"}]
    plan = make_plan(Case(), design="list", options={"rows": rows})
    columns = plan.columns(plan.points())
    made = [plan.data({k: v[i] for k, v in columns.items()})["operation"] for i in range(2)]
    assert [m["torque"] for m in made] == [100.0, 120.0]
    assert made[0]["speed"] == Case().operation.speed
    assert made[1]["speed"] == pytest.approx(900 * np.pi / 30)


def test_wrong_everywhere_is_said_once():
    plan = make_plan(FunctionSubject("nowhere:f", {"x": 1.0}), [Factor("x", 0.0, 1.0)], n=2)
    with pytest.raises(CampaignError, match=says("plan", "'nowhere:f'")):
        plan.check()


def nested(x: float, law: dict, table: list) -> float:
    """Return one number of parameters that are none."""
    return x * law["stiffness"] + sum(table)


@pytest.mark.slow
def test_functions_of_more_than_numbers(tmp_path):
    parameters = {"x": 1.0, "law": {"stiffness": "2 N/mm", "kind": "soft"}, "table": np.arange(3)}
    subject = FunctionSubject(nested, parameters, units={"law.stiffness": "N/m"})
    campaign = Campaign(tmp_path / "c", make_plan(subject, [Factor("law.stiffness", "1 N/mm", "3 N/mm")], n=4))
    campaign.run(workers=0)
    np.testing.assert_allclose(campaign.table.nested, campaign.table["law.stiffness"] + 3.0)
    with pytest.raises(CampaignError, match=says("Case", "stored")):
        FunctionSubject(nested, {"x": Case()})
    with pytest.raises(CampaignError, match=says("function", "top", "module")):
        FunctionSubject(lambda x: x, {"x": 1.0})
    with pytest.raises(CampaignError, match=says("script or notebook")):
        FunctionSubject("__main__:f", {"x": 1.0})
    with pytest.raises(CampaignError, match="'zork' is no unit"):
        FunctionSubject(nested, {"x": 1.0}, units={"x": "zork"})
    with pytest.raises(CampaignError, match=says("law.damping", "such parameter")):
        subject.unit_of("law.damping")
    assert FunctionSubject(ishigami, PLACES).function == "tests.campaigns.models:ishigami"


def test_functions_of_which_nothing_is_kept_are_named():
    """Arrays and texts alone, without a signal that describes them; beside a number they may be left out."""
    subject = FunctionSubject(nested, {"x": 1.0})
    with pytest.raises(CampaignError, match=says("y", "3", "signal:")):
        subject.reduce({}, {"y": np.zeros(3), "t": "text"}, ["numbers"])
    with pytest.raises(CampaignError, match=says("nested", "empty")):
        subject.reduce({}, {}, ["numbers"])
    assert subject.reduce({}, {"y": np.zeros(3), "n": 1.0}, ["numbers"]).numbers == {"n": 1.0}
    assert subject.reduce({}, xr.Dataset({"y": ("t", np.zeros(3))}), ["record"]).numbers == {}
    with pytest.raises(CampaignError, match=says("nested", "dict", "Dataset")):
        subject.reduce({}, {"y": np.zeros(3)}, ["record"])
    with pytest.raises(CampaignError, match=says("nested", "c = (1+2j)", "number")):
        subject.reduce({}, {"y": 1.0, "c": 1 + 2j}, ["numbers"])
    for own, words in ((plural, ("y = [1.0, 2.0]", "number")), (single, ("2.0", "dictionary"))):
        with pytest.raises(CampaignError, match=says(own.__name__, *words)):
            subject.reduce({}, {"y": 1.0}, ["numbers", f"{__name__}:{own.__name__}"])


def plural(record) -> dict:
    """Return what is no number."""
    return {"y": [1.0, 2.0]}


def single(record) -> float:
    """Return a number without a name."""
    return 2.0


def unruly(x: float) -> dict:
    """Go wrong in a way of its own for each x, or return names that are taken."""
    if x == 1:
        raise FileNotFoundError(2, "No such file", "table.csv")
    if x == 2:
        sys.exit(3)
    if x == 3:
        return {"wave": np.zeros(9)}
    if x == 4:
        return None
    return {"x": 5.0, "status": 7.0, "wave": np.ones(4)}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((1, "x"), ("numbers", "texts", "one")),
        ((True, 2.5), ("numbers", "truth", "one")),
        ((1.0, float("nan")), ("nan", "number")),
        ((1, 2**70), ("64", "bits")),
        (([1, 2], [3, 4]), ("lists", "choose")),
    ],
)
def test_values_that_one_column_does_not_hold(values, words):
    """Texts beside numbers would make texts of them; in rows of a list as well."""
    subject = FunctionSubject(nested, {"x": 1.0})
    with pytest.raises(CampaignError, match=says(*words)):
        make_plan(subject, [Factor("x", values=values)], "grid")
    if not isinstance(values[0], list):
        with pytest.raises(CampaignError, match=says(*words)):
            make_plan(subject, design="list", options={"rows": [{"x": v} for v in values]})


@pytest.mark.parametrize("values", [(1, 2), (1, 2.5), ("a", "b"), (True, False), (None, 2.5), (float("inf"), 1.0)])
def test_values_that_one_column_holds(values):
    subject = FunctionSubject(nested, {"x": 1.0})
    plan = make_plan(subject, [Factor("x", values=values)], "grid")
    assert plan.columns(plan.points())["x"].tolist() == list(values)


@pytest.mark.parametrize("unit", ["1", "m"])
def test_none_is_a_value(tmp_path, unit):
    """It stays what it is, with a unit as well, is neither less nor more than a number, and another one."""
    subject = FunctionSubject("tests.campaigns.models:told", {"p": None, "i": 3}, units={"p": unit})
    values = ["3 m", None] if unit == "m" else [3.0, None]
    campaign = Campaign(tmp_path / "c", make_plan(subject, [Factor("p", values=values)], "grid", unit=1))
    campaign.run(workers=0)
    assert campaign.table.pp.tolist() == [3.0, -1.0]
    for condition, held in {"p > 2": [0], "2 * p < 9": [0], "not p > 2": [1], "p != 3": [1], "p == 3": [0]}.items():
        assert campaign.read(["index"], condition)["index"].tolist() == held, condition
    if unit == "m":
        assert campaign.read(["index"], "p >= '300 cm'")["index"].tolist() == [0]


@pytest.mark.parametrize("ends", [(None, 2), (1.0, float("inf")), ([1, 2], [3, 4])])
def test_ends_that_are_none(ends):
    subject = FunctionSubject(nested, {"x": 1.0, "t": {"kind": "a", "size": 1.0}})
    with pytest.raises(CampaignError, match=says("t.one.size", "range", "numbers")):
        make_plan(subject, [choose("t", one={"kind": "a", "size": ends})], n=2)
    with pytest.raises(CampaignError, match=says("x", "range", "numbers")):
        make_plan(subject, [Specimens(3, {"x": ends})], n=2)
    with pytest.raises(CampaignError, match=says("specimens", "x", "numbers")):
        make_plan(subject, [Specimens(3, {"x": ("a", "b")})], n=2)
    words = choose("t", one={"kind": "a", "size": ("a", "b")}, two={"kind": "a", "size": (1, 2)})
    assert make_plan(subject, [words, Specimens(3, {"x": (1.0, 2.0)})], n=2).size == 2


def several(x: float, how: str) -> dict | xr.Dataset:
    """Return results whose names or records are of some use, or of none."""
    found = xr.Dataset({"index": x, "y": x, "wave": ("t", np.where(np.arange(4) == 2, np.nan, 1.0))})
    if how == "clash":
        found["result.index"] = 7.0
    if how == "record":
        found.attrs["about"] = {"a": 1}
    return found


def test_results_keep_their_names(tmp_path):
    """Two that would have one name, and records that cannot be written, are the case's; the others are kept."""
    subject = FunctionSubject(several, {"x": 0.0, "how": "good"}, signals={"wave": (4, 1.0), "y": (1, 1.0)})
    rows = [{"x": float(k), "how": how} for k, how in enumerate(("good", "clash", "record"))]
    keep = ["numbers", "signal:wave", "record"]
    campaign = Campaign(tmp_path / "c", make_plan(subject, design="list", options={"rows": rows}, keep=keep))
    status = campaign.run(workers=0)
    assert (status.done, status.failed) == (3, 2)
    # a signal with a hole is no number either
    assert status.not_numbers == 1
    messages = campaign.failed().message.tolist()
    assert "result.index" in messages[0]
    assert "about = {'a': 1}" in messages[1]
    assert campaign.table["result.index"][0] == 0.0
    # a number and a signal of one name stand beside each other
    again = Campaign(tmp_path / "d", make_plan(subject, [Factor("x", 1.0, 2.0)], n=2, keep=["numbers", "signal:y"]))
    again.run(workers=0)
    data = again.open()
    np.testing.assert_allclose(data["result.y"], data["y"][:, 0, 0], rtol=1e-7)


@pytest.mark.parametrize(
    ("name", "size", "words"),
    [("../w", (4, 1.0), "without /"), ("w", (4, 0.0), "positive"), ("w", (4.5, 1.0), "4.5"), ("w", 4, "samples")],
)
def test_sizes_of_signals(name, size, words):
    with pytest.raises(CampaignError, match=re.escape(words)):
        FunctionSubject(nested, {"x": 1.0}, signals={name: size})
    assert FunctionSubject(nested, {"x": 1.0}, signals={"w 1.a": (4, "1 kHz")}).signal_sizes == {"w 1.a": (4, 1000.0)}


@pytest.mark.slow
def test_units_of_another_campaign_are_none_of_this_one(tmp_path):
    """Ledger and table that were copied from a campaign with another seed agree with each other."""
    mine, other = (small(tmp_path / name, seed=k) for k, name in enumerate(("a", "b")))
    for one in (mine, other):
        one.run(workers=0)
    truth = mine.table
    for path in (Path("units", "00001.json"), Path("table", "00001.parquet")):
        shutil.copy(other.path / path, mine.path / path)
    with pytest.raises(CampaignError, match=says("unit 1", "campaign")):
        mine.table  # noqa: B018
    with pytest.warns(CampaignWarning, match="unit 1"):
        mine.run(workers=0)
    assert mine.table.equals(truth)
    # an extension is no other campaign
    assert Campaign(mine.path).extend(48).table.equals(truth)


@pytest.mark.slow
def test_cases_that_go_wrong_in_odd_ways(tmp_path):
    """None of them ends the run, none takes the place of a column."""
    subject = FunctionSubject(unruly, {"x": 0}, signals={"wave": (4, 1.0)})
    rows = [{"x": k} for k in range(6)]
    plan = make_plan(subject, design="list", options={"rows": rows}, keep=["numbers", "signal:wave"], unit=3)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=1)
    failed = campaign.failed().set_index("x")
    assert sorted(failed.index) == [1, 2, 3, 4]
    assert "table.csv" in failed.message[1]
    assert failed.message[2] == "SystemExit: 3"
    assert "9 samples, planned for 4" in failed.message[3]
    assert "returned None; return a dictionary" in failed.message[4]
    done = campaign.table[campaign.table.status == "done"]
    assert list(done.x) == [0, 5]
    assert list(done["result.x"]) == [5.0, 5.0]
    assert list(done["result.status"]) == [7.0, 7.0]


@pytest.mark.slow
def test_a_script_without_a_guard_runs(tmp_path):
    """New processes import modules; they do not run the script again."""
    script = tmp_path / "script.py"
    script.write_text(
        "from tests.campaigns.support import small\nprint('begun')\n"
        f"print(small({str(tmp_path / 'c')!r}, n=16).run(workers=2))\n"
    )
    found = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=120, check=False,
        env={"PYTHONPATH": ":".join(p or "." for p in sys.path)},
    )  # fmt: skip
    assert found.stdout.count("begun") == 1
    assert "16 of 16 cases done" in found.stdout


def _make(path: str) -> None:
    make_folder(path, make_plan(function(), ranges(), n=64, unit=2, keep=["numbers", "signal:wave"]))


@pytest.mark.slow
def test_made_by_several_at_once(tmp_path):
    """Whoever comes second takes up what is there; nobody clears what another one has begun."""
    context = multiprocessing.get_context("fork")
    makers = [context.Process(target=_make, args=(str(tmp_path / "c"),)) for _ in range(4)]
    for maker in makers:
        maker.start()
    for maker in makers:
        maker.join(60)
    assert [maker.exitcode for maker in makers] == [0, 0, 0, 0]
    assert [p.name for p in tmp_path.iterdir()] == ["c"]
    assert Campaign(tmp_path / "c").folder.case_count == 64


@pytest.mark.parametrize("moment", ["mkdir", "iterdir", "rename"])
def test_made_by_another_at_any_moment(tmp_path, monkeypatch, moment):
    """The other maker is done just before this one makes the parent, looks into the folder, or moves its own there."""
    whole, real, begun = tmp_path / "c", getattr(Path, moment), []

    def late(self, *args, **options):
        if not begun:
            begun.append(self)
            _make(str(whole))
        return real(self, *args, **options)

    whole.mkdir()
    monkeypatch.setattr(Path, moment, late)
    _make(str(whole))
    assert begun
    monkeypatch.undo()
    assert [p.name for p in tmp_path.iterdir()] == ["c"]
    assert Campaign(whole).folder.case_count == 64


def test_places_that_will_not_do(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(CampaignError, match=says("holds something else")):
        small(tmp_path)
    with pytest.raises(CampaignError, match=says("holds something else")):
        small(tmp_path / "notes.txt")
    with pytest.raises(CampaignError, match="cannot be made"):
        small(tmp_path / "notes.txt" / "c")
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]


def test_an_edited_plan_is_told(tmp_path):
    small(tmp_path / "c", n=8)
    with pytest.raises(CampaignError, match=says("seed", "unit", "choose another folder")):
        small(tmp_path / "c", n=8, seed=4, unit=4)
    for n, remedy in ((16, "extend"), (4, "as it is")):
        with pytest.raises(CampaignError, match=says("8 points", f"n = {n}", remedy, "another folder")):
            small(tmp_path / "c", n=n)
    assert small(tmp_path / "c", n=8).folder.case_count == 8
    # a script whose campaign was extended since is run again
    Campaign(tmp_path / "c").extend(12)
    with pytest.warns(CampaignWarning, match=says("extended", "n = 8", "12 points")):
        assert small(tmp_path / "c", n=8).folder.case_count == 12
    with pytest.raises(CampaignError, match=says("12 points", "n = 10", "as it")):
        small(tmp_path / "c", n=10)


def test_other_numbers_of_points_of_a_hypercube_are_told(tmp_path):
    small(tmp_path / "c", design="latin hypercube", n=8)
    assert small(tmp_path / "c", design="latin hypercube", n=8).folder.case_count == 8
    with pytest.raises(CampaignError, match=says("8 points", "n = 12", "another folder")):
        small(tmp_path / "c", design="latin hypercube", n=12)


def test_damaged_files_are_named(tmp_path):
    campaign = small(tmp_path / "c", n=16)
    campaign.run(workers=0)
    whole = campaign.table
    ledger = campaign.folder.ledger(1)
    ledger.write_text(ledger.read_text()[:50])
    with pytest.raises(CampaignError, match=says("ledger is damaged", "00001.json", "gearmbs campaign run")):
        campaign.status()
    assert campaign.check(sweep=True) == ["unit 1: the ledger is damaged"]
    campaign.run(workers=0)
    campaign.folder.table(0).unlink()
    with pytest.raises(CampaignError, match=says("unit 0", "00000.parquet", "gearmbs campaign run")):
        _ = campaign.table
    for path in sorted(campaign.folder.signals.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    campaign.folder.signals.rmdir()
    campaign.folder.ledger(0).unlink()
    with pytest.raises(CampaignError, match=says("zarr.json", "missing")):
        campaign.open()
    # run says what it finds, and does it again
    with pytest.warns(CampaignWarning, match=says("unit 1", "wave")):
        campaign.run(workers=0)
    assert campaign.table.equals(whole)
    assert campaign.check() == []


def test_a_plan_is_what_it_was_made_as(tmp_path):
    """What is cut short or no text any more is taken from its copy, an edit is refused by the name of the entry."""
    campaign = small(tmp_path / "c", n=16)
    plan, cases = campaign.path / "plan.json", campaign.path / "cases" / "000-00000.parquet"
    made, drawn = plan.read_bytes(), cases.read_bytes()
    for damage in (made[:40], made.replace(b'"seed": 3', b'"seed"\xba 3')):  # one bit
        plan.write_bytes(damage)
        with pytest.warns(CampaignWarning, match=says("plan.json", "cases/plan.json")):
            assert Campaign(campaign.path).plan.seed == 3
    # of one digit, of two, and one that is no JSON any more
    for edit, name in ((b'"seed": 2', "plan: seed"), (b'"seed": 12', "plan: seed"), (b'"seed": 3,', "plan.json is")):
        plan.write_bytes(made.replace(b'"seed": 3', edit))
        with pytest.raises(CampaignError, match=says("plan.json", name, "remove the file")):
            Campaign(campaign.path)
    plan.unlink()
    with pytest.warns(CampaignWarning, match=says("plan.json", "its copy")):
        Campaign(campaign.path).run(workers=0)
    assert plan.read_bytes() == made
    plan.unlink()
    (campaign.path / "cases" / "plan.json").unlink()
    with pytest.raises(CampaignError, match=says("campaign here", "plan.json")):
        Campaign(campaign.path)
    plan.write_text(json.dumps({}))
    with pytest.raises(CampaignError, match=says("format", "None")):
        Campaign(campaign.path)
    plan.write_bytes(made)
    cases.write_bytes(drawn[:100])
    with pytest.raises(CampaignError, match=says("000-00000.parquet", "planned")):
        Campaign(campaign.path).case(0)
    with pytest.warns(CampaignWarning, match="cases/000-00000.parquet"):
        Campaign(campaign.path).run(workers=0)
    assert cases.read_bytes() == drawn


@pytest.mark.parametrize("name", ["units", "table", "cases", "codes"])
def test_folders_that_are_gone_are_made_again(tmp_path, name):
    campaign = small(tmp_path / "c", n=16)
    campaign.run(workers=0)
    before = campaign.table
    shutil.rmtree(campaign.path / name)
    assert campaign.status().done == (0 if name == "units" else 16)
    with pytest.warns(CampaignWarning, match=says(name, "missing")):
        campaign.run(workers=0)
    assert campaign.table.equals(before)
    assert campaign.check() == []


@pytest.mark.parametrize("place", ["s3://bucket/c", Path("gs://bucket/c"), "https://host/c"])
def test_addresses_of_object_stores_are_refused(place):
    with pytest.raises(CampaignError, match=says("object store", "folder")):
        small(place, n=4)
    with pytest.raises(CampaignError, match="object store"):
        Campaign(place)


def test_two_extensions_at_once(tmp_path):
    """Of two that begin at the same time one is refused with who is at it; after it the other finds its points."""
    campaign = small(tmp_path / "c", n=8)
    claim = take(campaign.path / "cases" / "plan.claim")
    with pytest.raises(CampaignError, match=says("extended", f"process {os.getpid()}")):
        campaign.extend(16)
    claim.release()
    other = Campaign(campaign.path)
    campaign.extend(16)
    with pytest.raises(CampaignError, match=says("n = 12", "16 points")):
        other.extend(12)
    assert other.extend(20).folder.case_count == 20


def test_questions_put_wrongly(tmp_path):
    campaign = small(tmp_path / "c", n=16)
    campaign.run(workers=0)
    asked = [
        (lambda: campaign.response_surface("y", 7), "degree = 7; give 1 or 2"),
        (lambda: campaign.sensitivity("message"), "is a column of texts"),
        (lambda: condition_map(campaign, "y > 1", "nope", "x1"), "'nope' is no column of numbers"),
        (lambda: condition_map(campaign, "y > 1", "x1", "x2", 0), "bins = 0"),
        (lambda: campaign.run("2"), "workers = '2'; give a whole number"),
        (lambda: campaign.run(client=3), "give a distributed.Client"),
        (lambda: campaign.run(0, minutes=-1), "minutes = -1"),
        (lambda: campaign.extend(9.5), "extend: n = 9.5; give a whole number"),
        (lambda: campaign.case("a"), "case = 'a'; give a whole number"),
        (lambda: campaign.export(tmp_path / "o", "hf", held_out={"nope": (0, 1)}), "'nope' is no column of numbers"),
        (lambda: campaign.export(tmp_path / "o", "hf", held_out={"x1": (2, 1)}), "give its lower and upper end"),
    ]
    for ask, words in asked:
        with pytest.raises(CampaignError) as error:
            ask()
        assert words in str(error.value)


@pytest.mark.slow
def test_a_grid_tells_what_decides(tmp_path):
    """Parts of variance by hand: y = a + b + c on levels, and an interaction in the total indices."""
    kinds = choose("x3", low=0.0, high=2.0)
    factors = [Factor("x1", 0.0, 1.0, levels=3), Factor("x2", 0.0, 1.0, levels=4), kinds]
    campaign = Campaign(tmp_path / "c", make_plan(function(), factors, "grid"))
    campaign.run(workers=0)
    found = campaign.sensitivity("y")
    y = campaign.table.y.to_numpy().reshape(3, 4, 2)
    means = [y.mean(axis=(1, 2)), y.mean(axis=(0, 2)), y.mean(axis=(0, 1))]
    np.testing.assert_allclose(found.first, [m.var() / y.var() for m in means])
    # x2 takes part in no interaction
    assert found.total[1] == pytest.approx(found.first[1], rel=1e-12)
    assert found.total[0] - found.first[0] == pytest.approx(found.total[2] - found.first[2], rel=1e-9)
    assert found.first.sum() + found.total[0] - found.first[0] == pytest.approx(1.0, rel=1e-12)
    assert "Parts of the grid's variance" in campaign.report(tmp_path / "r.html").read_text()


def test_rows_of_a_former_export_are_gone(tmp_path):
    """Other splits, or more files, have other names; whoever reads the folder would read both."""
    campaign = small(tmp_path / "c", n=8)
    campaign.run(workers=0)
    campaign.export(tmp_path / "out", "hf", split_by="point")
    (tmp_path / "out" / "data" / "mine.parquet").touch()
    (written, _) = campaign.export(tmp_path / "out", "hf")
    assert sorted((tmp_path / "out" / "data").iterdir()) == [tmp_path / "out" / "data" / "mine.parquet", written]


def test_ranges_held_out(tmp_path):
    campaign = small(tmp_path / "c", n=40)
    campaign.run(workers=0)
    campaign.export(tmp_path / "o", "hf", split_by="point", held_out={"x1": (0.0, 1.0)})
    import pyarrow.parquet as pq

    def inside(split):
        x = pq.read_table(next((tmp_path / "o" / "data").glob(f"{split}-*"))).to_pandas().x1
        return ((x >= 0.0) & (x <= 1.0)).mean()

    assert inside("withheld") == 1.0
    assert inside("train") == 0.0
    assert 0.0 < inside("test") < 1.0
    assert "split: withheld" in (tmp_path / "o" / "README.md").read_text()


@pytest.mark.parametrize(
    "settings",
    [
        {"draws": 2.5},
        {"draws": "5"},
        {"draws": 5, "errors": {"fault.backlash": 1e-4}},
        {"draws": 5, "errors": ["fault.backlash"]},
        {"draws": 5, "faults": {"kind": "wear"}},
        {"draws": 5, "faults": ["wear"]},
    ],
)
def test_bad_specimens(settings):
    with pytest.raises(CampaignError, match=r"draws = |give its two|errors = |faults = "):
        Specimens(**settings)


@pytest.mark.parametrize(
    ("kind", "settings", "words"),
    [
        ("function", {}, ("function", "missing", "module:name")),
        ("function", {"function": "m:f", "versoin": 2}, ("versoin", "version")),
        ("function", {"function": "m:f", "parameters": [1, 2]}, ("parameters = [1, 2]", "names")),
        ("function", {"function": "m:f", "units": ["m"]}, ("units = ['m']", "names")),
        ("drivetrain", {}, ("file", "tables")),
        ("drivetrain", {"tables": 3}, ("tables = 3", "names")),
        ("deck", {"file": "no.adm", "parameters": {}, "end": 1.0}, ("no.adm", "No such file")),
        ("deck", {"text": "t", "parameters": 3, "end": 1.0}, ("parameters = 3", "names")),
    ],
)
def test_subjects_described_wrongly(kind, settings, words):
    with pytest.raises(CampaignError, match=says(*words)):
        make_subject(kind, settings)


def test_a_base_without_a_place_on_a_logarithmic_range():
    plan = make_plan(function(), [Factor("x1", 1.0, 2.0, scale="log")], "one at a time")
    plan.subject.parameters["x1"] = 0.0
    with pytest.raises(CampaignError, match=says("logarithmic range")):
        plan.points()


def partly(x: float) -> dict[str, float]:
    """Return results beyond the middle."""
    if x < 0.5:
        raise ValueError("x: too little")
    return {"r": x, "orders.mesh.2": 2.0 * x}


def test_conditions_on_results_that_a_whole_unit_lacks(tmp_path):
    """Its cases have none: they fit no comparison, and names are those of all units."""
    rows = [{"x": x} for x in (0.1, 0.2, 0.6, 0.7, 0.3, 0.4)]
    subject = FunctionSubject(partly, {"x": 0.0})
    campaign = Campaign(tmp_path / "c", make_plan(subject, design="list", options={"rows": rows}, unit=2))
    campaign.run(workers=0)
    assert campaign.read(["x"], "r > 0.2")["x"].tolist() == [0.6, 0.7]
    assert campaign.read(["x"], "orders.mesh.2 > 1.3")["x"].tolist() == [0.7]
    assert campaign.read(["x", "r"], "x > 0.15 and not r > 0.65")["x"].tolist() == [0.6]
    assert campaign.read(where="r > 0.65")["index"].tolist() == [3]
    assert campaign.failed()["x"].tolist() == [0.1, 0.2, 0.3, 0.4]
    for ask in (lambda: campaign.read(["x"], "q > 1"), lambda: campaign.read(["q"])):
        with pytest.raises(CampaignError, match=says("q", "orders.mesh.2")):
            ask()
