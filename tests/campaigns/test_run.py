"""Campaigns are carried out whatever happens, and say what happened."""

from __future__ import annotations

import errno
import json

import numpy as np
import pytest

from gearmbs.campaigns import Campaign, CampaignError, Choice, Factor, make_plan
from gearmbs.campaigns.folder import sealed, unsealed
from gearmbs.files import write_whole
from tests.campaigns.support import digest, function, ranges, small


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


def moody(tmp_path, **moods) -> Campaign:
    """A campaign in which one case goes wrong in each of the given ways."""
    kinds = ["good"] * 9 + list(moods)
    rows = [{"x1": 0.1 * k, "x2": 0.0, "x3": 0.0, "mood": mood} for k, mood in enumerate(kinds)]
    subject = function("moody")
    subject.parameters["mood"] = "good"
    settings = {"options": {"rows": rows, "corners": "ignore"}, "unit": 5, "time_limit": 0.3, "memory_limit": 2e9}
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
