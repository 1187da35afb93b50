"""Campaigns are carried out whatever happens, and say what happened."""

from __future__ import annotations

import errno
import json
import os
import shutil
import socket
from functools import partial

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, CampaignError, CampaignWarning, Choice, Factor, FunctionSubject, make_plan
from gearmbs.campaigns.folder import sealed, unsealed
from gearmbs.campaigns.page import page_text
from gearmbs.campaigns.work import work_unit
from gearmbs.files import write_whole
from gearmbs.studies import Case
from gearmbs.studies.run import claims
from gearmbs.studies.run.engine import run_jobs, threads
from tests.campaigns.models import PLACES
from tests.campaigns.support import digest, function, ranges, small
from tests.says import says


def test_results_are_those_of_the_function(tmp_path):
    campaign = small(tmp_path / "c")
    status = campaign.run(workers=0)
    assert status.complete
    assert status.done == 40
    table = campaign.table
    expected = np.sin(table.x1) + 7 * np.sin(table.x2) ** 2 + 0.1 * table.x3**4 * np.sin(table.x1)
    np.testing.assert_array_equal(table.y, expected)
    data = campaign.open()
    assert data.wave.dims == ("case", "wave_channel", "wave_time")
    wave = data.wave.sel(case=11).values[0]
    np.testing.assert_array_equal(wave, np.sin(table.x1[11] * np.arange(50)).astype(np.float32))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    campaign = small(tmp_path_factory.mktemp("c") / "c")
    campaign.run(workers=0)
    return digest(campaign)


@pytest.mark.slow
def test_same_bits_from_processes_and_parts(tmp_path, undisturbed):
    one = small(tmp_path / "one")
    one.run(workers=2)
    assert digest(one) == undisturbed
    two = small(tmp_path / "two")
    for part in (3, 1, 2):
        two.work(part, 3)
    assert digest(two) == undisturbed


@pytest.mark.slow
def test_extension_keeps_what_is_there(tmp_path):
    campaign = small(tmp_path / "c", n=20)
    campaign.run(workers=0)
    before = {unit: campaign.folder.ledger(unit).read_bytes() for unit in campaign.folder.done()}
    campaign.extend(40).run(workers=0)
    assert all(campaign.folder.ledger(unit).read_bytes() == text for unit, text in before.items())
    assert campaign.status().done == 40
    whole = small(tmp_path / "whole")
    whole.run(workers=0)
    np.testing.assert_array_equal(campaign.table.y, whole.table.y)
    np.testing.assert_array_equal(campaign.open().wave, whole.open().wave)


@pytest.mark.slow
def test_equal_cases_of_another_campaign_are_taken_over(tmp_path):
    first = small(tmp_path / "first")
    first.run(workers=0)
    second = small(tmp_path / "second", unit=5, reuse=[str(tmp_path / "first")])
    status = second.run(workers=0)
    assert status.reused == 40
    np.testing.assert_array_equal(first.table.y, second.table.y)
    np.testing.assert_array_equal(first.open().wave, second.open().wave)
    wrong = small(tmp_path / "third", keep=["record"])
    with pytest.raises(CampaignError, match="does not keep"):
        small(tmp_path / "fourth", reuse=[str(wrong.path)]).run(workers=0)


def test_a_page_says_how_a_run_stands(tmp_path):
    """While it goes on the page refreshes itself; failures of one cause count as one, whatever numbers they name."""
    plan = make_plan(function("picky"), ranges(), n=16, unit=4, seed=3)
    campaign, seen = Campaign(tmp_path / "c", plan), []
    page = tmp_path / "c" / "page.html"
    status = campaign.run(workers=0, page=True, progress=lambda status: seen.append(page.read_text()))
    assert "http-equiv='refresh'" in seen[0]
    assert "0 of 16" in seen[0]
    text = page.read_text()
    assert "http-equiv='refresh'" not in text
    assert "<title>100% c</title>" in text
    assert f"<td>{status.failed}</td><td>impossible</td><td>ValueError: x1 = # is beyond #" in text
    # from another shell, while somebody is at work
    campaign.folder.ledger(1).unlink()
    claim = claims.take(campaign.folder.claim(1))
    found = page_text(campaign.folder, every=5.0)
    claim.release()
    assert "12 of 16" in found
    assert f"unit 1: host {socket.gethostname()}, process {os.getpid()}" in found
    assert "cases a minute" in found
    with pytest.raises(CampaignError, match=says("page", "x.html", "another folder")):
        campaign.run(workers=0, page=page / "x.html")


def moody(tmp_path, wall_limit=None, **moods) -> Campaign:
    """A campaign in which one case goes wrong in each of the given ways."""
    kinds = ["good"] * 9 + list(moods)
    rows = [{"x1": 0.1 * k, "x2": 0.0, "x3": 0.0, "mood": mood} for k, mood in enumerate(kinds)]
    subject = function("moody")
    subject.parameters["mood"] = "good"
    settings = {"options": {"rows": rows, "corners": "ignore"}, "unit": 5, "time_limit": 0.3, "memory_limit": 2e9}
    settings["wall_limit"] = wall_limit
    return Campaign(tmp_path / "c", make_plan(subject, (), "list", **settings))


@pytest.mark.slow
def test_failures_are_told_apart_and_harm_nobody(tmp_path):
    campaign = moody(tmp_path, impossible=1, fails=1, endless=1, hungry=1)
    status = campaign.run(workers=0)
    assert (status.done, status.failed) == (13, 4)
    failed = campaign.failed().set_index("mood")
    assert failed["status"].to_dict() == {
        "impossible": "impossible",
        "fails": "failed",
        "endless": "time limit",
        "hungry": "memory limit",
    }
    assert "no such thing" in failed.message["impossible"]
    assert (campaign.table[campaign.table.mood == "good"].status == "done").all()


@pytest.mark.slow
def test_a_case_that_kills_its_worker_is_found(tmp_path):
    campaign = moody(tmp_path, deadly=1)
    status = campaign.run(workers=1)
    assert status.failed == 1
    failed = campaign.failed()
    assert list(failed.mood) == ["deadly"]
    assert list(failed.status) == ["worker died"]
    assert "signal 9" in failed.message[0]


def test_stop_at_the_first_failure(tmp_path):
    plan = make_plan(
        function("moody", version="2"),
        [Factor("x1", 0.0, 1.0)],
        n=4,
        unit=2,
        on_failure="stop",
        options={"corners": "ignore"},
    )
    plan.subject.parameters["mood"] = "fails"
    with pytest.raises(CampaignError, match="did not converge"):
        Campaign(tmp_path / "c", plan).run(workers=0)


@pytest.mark.slow
def test_a_full_disk_ends_the_run_and_loses_nothing(tmp_path, monkeypatch, undisturbed):
    import pyarrow.parquet as pq

    campaign = small(tmp_path / "c")
    write, count = pq.write_table, []

    def full(*args, **kwargs):
        count.append(1)
        if len(count) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(*args, **kwargs)

    monkeypatch.setattr(pq, "write_table", full)
    with pytest.raises(OSError, match="No space left"):
        campaign.run(workers=0)
    assert campaign.status().units_done == 2
    campaign.run(workers=0)
    assert digest(campaign) == undisturbed


def test_claims_of_the_dead_are_taken_over(tmp_path, undisturbed):
    campaign = small(tmp_path / "c")
    claim = campaign.folder.claim(2)
    claim.write_text(json.dumps({"host": __import__("socket").gethostname(), "pid": 2**22 + 1, "started": "1"}))
    assert campaign.status().running == 0
    campaign.run(workers=0)
    assert digest(campaign) == undisturbed
    assert json.loads(campaign.folder.ledger(2).read_text())["attempts"] == 1
    assert not claim.exists()


@pytest.mark.slow
def test_damage_is_found_and_mended(tmp_path, undisturbed):
    campaign = small(tmp_path / "c")
    campaign.run(workers=0)
    campaign.folder.table(1).write_bytes(b"nonsense")
    # of another unit than the table
    shard = min(p for p in (campaign.folder.signals / "wave" / "c").rglob("0") if p.is_file())
    assert shard.relative_to(campaign.folder.signals).parts[2] == "0"
    shard.unlink()
    found = campaign.check(sweep=True)
    assert len(found) == 2
    assert "table" in "".join(found)
    assert "wave" in "".join(found)
    campaign.run(workers=0)
    assert digest(campaign) == undisturbed


@pytest.mark.slow
def test_failed_cases_may_be_tried_again(tmp_path):
    campaign = moody(tmp_path, fails=1)
    campaign.run(workers=0)
    assert campaign.status().failed == 1
    assert campaign.retry() == 1
    assert not campaign.status().complete
    # a ledger that was written anew counts as it is now
    campaign.run(workers=0)
    for unit in campaign.folder.done():
        ledger = campaign.folder.ledger(unit)
        write_whole(ledger, sealed(unsealed(ledger) | {"failed": 0}))
    assert campaign.status().failed == 0


def test_minutes_and_progress(tmp_path):
    campaign = small(tmp_path / "c")
    seen = []
    status = campaign.run(workers=0, minutes=0.0, progress=seen.append)
    assert status.done == 0
    assert seen
    assert "0 of 40 cases done" in str(seen[-1])


def test_crossed_choices_run(tmp_path):
    plan = make_plan(function(), [*ranges()[:2], Choice("x3", {"low": 0.5, "high": 2.0}, crossed=True)], n=4, unit=4)
    campaign = Campaign(tmp_path / "c", plan)
    campaign.run(workers=0)
    assert list(campaign.table["x3"]) == ["low", "high"] * 4
    assert campaign.case(1)["x3"] == 2.0


@pytest.mark.slow
def test_columns_and_conditions(tmp_path):
    """As of the whole table, whatever is read; names with dots are also found with underscores."""
    campaign = small(tmp_path / "c")
    campaign.run(workers=0)
    whole = campaign.table
    found = campaign.read(["y", "x2"])
    assert list(found.columns) == ["y", "x2"]
    assert found.equals(whole[["y", "x2"]])
    some = campaign.read(["index"], "status == 'done' and x1 > 0.5")
    assert list(some["index"]) == list(whole["index"][whole.x1 > 0.5])
    assert campaign.read(["y"], "x1 > 0.5").equals(whole.loc[whole.x1 > 0.5, ["y"]])
    assert campaign.read(where="x1 > 9").empty
    assert campaign.failed().empty
    with pytest.raises(CampaignError, match=says("columns", "nope", "x1")):
        campaign.read(["nope"])
    with pytest.raises(CampaignError, match=says("column", "'nope'")):
        campaign.read(where="nope > 1")


def test_results_that_are_no_numbers_are_counted(tmp_path):
    rows = [{"x1": x, "x2": 0.0, "x3": 0.0} for x in (0.0, np.inf, 1.0)]
    plan = make_plan(function(), (), "list", options={"rows": rows, "corners": "ignore"}, unit=2)
    campaign = Campaign(tmp_path / "c", plan)
    with np.errstate(invalid="ignore"):
        status = campaign.run(workers=0)
    assert (status.done, status.failed, status.not_numbers) == (3, 0, 1)
    assert "1 with results that are no numbers" in str(status)


@pytest.mark.slow
def test_a_case_that_sleeps_is_ended_by_the_clock(tmp_path):
    """Also one that goes on whatever interrupts it; its processor time is told wherever it was spent."""
    campaign = moody(tmp_path, wall_limit=0.2, asleep=1, deaf=1)
    status = campaign.run(workers=0)
    assert (status.done, status.failed) == (11, 2)
    failed = campaign.failed().set_index("mood")
    assert set(failed["status"]) == {"time limit"}
    assert "more than 0.2 s by the clock" in failed.message["asleep"]
    assert "heard no interruption" in failed.message["deaf"]
    assert status.processor_seconds > status.simulation_seconds


@pytest.mark.slow
def test_a_worker_is_replaced_whose_case_heeds_no_limit(tmp_path):
    campaign = moody(tmp_path, wall_limit=0.2, deaf=1)
    status = campaign.run(workers=1)
    assert (status.done, status.failed) == (10, 1)
    assert list(campaign.failed().mood) == ["deaf"]
    assert (campaign.table[campaign.table.mood == "good"].status == "done").all()


@pytest.mark.slow
def test_a_case_that_sleeps_in_a_thread_is_ended_with_its_process(tmp_path):
    """As those of Dask's workers are threads."""
    campaign = moody(tmp_path, wall_limit=0.2, asleep=1)
    run_jobs(partial(work_unit, str(campaign.path), False), [1], where=threads)
    assert list(campaign.failed().mood) == ["asleep"]
    assert "by the clock" in campaign.failed().message[0]


def test_limits_by_the_clock_follow_from_those_of_processor_time():
    assert make_plan(function(), ranges(), n=4).longest is None
    assert make_plan(function(), ranges(), n=4, time_limit="6 s").longest == 120.0
    assert make_plan(function(), ranges(), n=4, time_limit=6, wall_limit="1 min").longest == 60.0


@pytest.mark.parametrize(("n", "keep", "unit"), [(3, "numbers", 1), (1000, "numbers", 8), (1000, "signal:wave", 2)])
def test_units_follow_from_the_cases(tmp_path, n, keep, unit):
    """Work for a hundred workers, and no unit of more signals than some megabytes."""
    subject = FunctionSubject("tests.campaigns.models:ishigami", PLACES, signals={"wave": (7_000_000, 10.0)})
    assert Campaign(tmp_path / "c", make_plan(subject, ranges(), n=n, keep=[keep])).folder.unit_size == unit


def test_nobody_at_work_is_no_remaining_time(tmp_path):
    campaign = small(tmp_path / "c")
    campaign.work(1, 5)
    status = campaign.status()
    assert status.eta is None
    assert str(status) == "8 of 40 cases done, nobody at work"
    claims.take(campaign.folder.claim(3))
    status = campaign.status()
    assert status.running == 8
    assert status.eta > 0.0
    # it takes much longer than the first one
    claim = json.loads(campaign.folder.claim(3).read_text())
    campaign.folder.claim(3).write_text(json.dumps(claim | {"taken": claim["taken"] - 3600.0}))
    status = campaign.status()
    assert status.eta is None
    assert f"unit 3: host {claim['host']}, process {claim['pid']}, for 36" in str(status)


def recorded(x: float) -> xr.Dataset:
    """Return a record, of which a number and the end of a signal may be none."""
    hole = np.nan if x > 1.5 else 1.0
    return xr.Dataset({"wave": ("t", [x, hole * x]), "curve": ("s", [x, 2.0 * x, x])}, attrs={"y": x * hole})


def doubled(record: xr.Dataset) -> dict[str, float]:
    """Return a number of a record."""
    return {"double": 2.0 * record.attrs["y"]}


def tail(x: float) -> dict:
    """Return a signal that may end with no number."""
    return {"y": x, "wave": [x, np.nan if x > 1.5 else x]}


def listed(path, function, keep, **settings) -> Campaign:
    """Return a campaign of four cases, of which two are equal, that is done."""
    rows = [{"x": x} for x in (1.0, 2.0, 1.0, 3.0)]
    subject = FunctionSubject(function, {"x": 0.0}, signals={"wave": (4, 1.0)})
    plan = make_plan(subject, design="list", options={"rows": rows}, keep=keep, unit=3, **settings)
    campaign = Campaign(path, plan)
    campaign.run(workers=0)
    return campaign


@pytest.mark.slow
def test_records_are_taken_over_with_what_is_kept(tmp_path):
    first = listed(tmp_path / "first", recorded, ["numbers", "record", "signal:wave"])
    same = listed(tmp_path / "same", recorded, ["numbers", "record"], reuse=[str(first.path)])
    assert same.status().reused == 4
    for k in range(4):
        xr.testing.assert_identical(same.record(k), first.record(k))
    assert digest(same)
    # signals beyond those that are kept do no harm
    assert "wave" not in same.open()
    # of equal cases of one unit, too, if nothing is there to be taken
    (first.path / "records").rename(tmp_path / "gone")
    with pytest.warns(CampaignWarning, match=says("reuse", "damaged", "simulated")):
        anew = listed(tmp_path / "anew", recorded, ["numbers", "record"], reuse=[str(first.path)])
    assert anew.status().reused == 1
    xr.testing.assert_identical(anew.record(2), same.record(2))


def louder(x: float) -> dict:
    """Return a number and a signal."""
    return {"y": x, "wave": x * np.arange(1.0, 5.0)}


@pytest.mark.slow
def test_signals_that_do_not_fit_are_not_taken_over(tmp_path):
    """One that would be longer than planned, or of another rate, is simulated, and found wrong there."""

    def made(name, size, **settings):
        subject = FunctionSubject(louder, {"x": 0.0}, signals={"wave": size})
        plan = make_plan(subject, [Factor("x", 1.0, 2.0)], n=2, keep=["numbers", "signal:wave"], **settings)
        campaign = Campaign(tmp_path / name, plan)
        return campaign, campaign.run(workers=0)

    first, _ = made("first", (4, 1.0))
    longer, status = made("longer", (6, 1.0), reuse=[str(first.path)])
    assert status.reused == 2
    np.testing.assert_array_equal(longer.open().wave[..., :4], first.open().wave)
    _, status = made("rate", (4, 2.0), reuse=[str(first.path)])
    assert (status.reused, status.failed) == (0, 0)
    _, status = made("shorter", (3, 1.0), reuse=[str(first.path)])
    assert (status.reused, status.failed) == (0, 2)


@pytest.mark.slow
def test_components_of_a_pair_are_taken_over(tmp_path):
    """Their array has another name than the entry that keeps them."""
    base = Case(operation={"duration": 0.06, "run_up": 0.02, "settling": 0.02})

    def made(name, **settings):
        factor = Factor("operation.torque", 80.0, 90.0)
        keep = ["signal:tangential", "signal:line_of_action"]
        campaign = Campaign(tmp_path / name, make_plan(base, [factor], n=2, keep=keep, **settings))
        return campaign, campaign.run(workers=0)

    first, _ = made("first")
    second, status = made("second", reuse=[str(first.path)])
    assert status.reused == 2
    assert np.isfinite(second.open().acceleration).all()
    np.testing.assert_array_equal(second.open().acceleration, first.open().acceleration)


def test_reuse_brings_no_numbers_that_are_not_kept(tmp_path):
    more = ["numbers", f"{__name__}:doubled"]
    first = listed(tmp_path / "first", recorded, more)
    with pytest.raises(CampaignError, match=says("first", "doubled", "the same")):
        listed(tmp_path / "second", recorded, ["numbers"], reuse=[str(first.path)])
    third = listed(tmp_path / "third", recorded, more, reuse=[str(first.path)])
    assert third.status().reused == 4
    np.testing.assert_array_equal(third.table["double"], first.table["double"])


@pytest.mark.slow
@pytest.mark.parametrize("function", [recorded, tail])
def test_reuse_counts_what_is_no_number(tmp_path, function):
    """What ends a signal that is no number is not known of what is stored: such cases are simulated again."""
    keep = ["numbers", "signal:wave"]
    first = listed(tmp_path / "first", function, keep)
    second = listed(tmp_path / "second", function, keep, reuse=[str(first.path)])
    assert first.status().not_numbers == second.status().not_numbers == 2
    np.testing.assert_array_equal(second.open().wave, first.open().wave)


@pytest.mark.slow
def test_what_is_taken_over_is_looked_for_anew(tmp_path):
    """In a folder made anew, which keeps something else; equal cases of a unit are equal to the last bit."""
    rows = [{"x": x} for x in (1.0, 1.0 + 1e-13, 1.0)]

    def made(name, size, keep, **settings):
        subject = FunctionSubject(louder, {"x": 0.0}, signals={"wave": size})
        plan = make_plan(subject, design="list", options={"rows": rows}, keep=keep, unit=3, **settings)
        campaign = Campaign(tmp_path / name, plan)
        return campaign, campaign.run(workers=0)

    first, _ = made("first", (4, 1.0), ["numbers", "signal:wave"])
    reuse = [str(first.path)]
    made("second", (4, 1.0), ["numbers"], reuse=reuse)
    shutil.rmtree(tmp_path / "second")
    second, status = made("second", (4, 1.0), ["numbers", "signal:wave"], reuse=reuse)
    assert status.reused == 3
    np.testing.assert_array_equal(second.open().wave, first.open().wave)
    shutil.rmtree(first.path)
    rows[:] = [{"x": x} for x in (2.0, 2.0 + 1e-13, 2.0)]
    made("first", (4, 1.0), ["numbers", "signal:wave"])
    rows[:] = [{"x": x} for x in (1.0, 1.0 + 1e-13, 1.0)]
    shutil.rmtree(tmp_path / "second")
    second, status = made("second", (4, 1.0), ["numbers", "signal:wave"], reuse=reuse)
    assert status.reused == 1
    assert second.table["y"].tolist() == [row["x"] for row in rows]
