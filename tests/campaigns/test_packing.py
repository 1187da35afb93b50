"""Results in fewer, larger units: the same, whatever interrupts the packing."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.campaign_faults import recorded
from gearmbs.campaigns import Campaign, CampaignError, Choice, Factor, FunctionSubject, make_plan
from gearmbs.campaigns.folder import write_cases
from gearmbs.campaigns.stored import packing
from tests.campaigns.models import Ringing, picky
from tests.campaigns.support import function, ranges, small
from tests.says import says


def done(path, *extensions) -> Campaign:
    """Return a campaign of seven cases and more in units of two, some of which fail."""
    plan = make_plan(function(picky.__name__), ranges(), n=7, unit=2, seed=3, keep=["numbers", "signal:wave"])
    campaign = Campaign(path, plan)
    for n in extensions:
        campaign.extend(n)
    campaign.run(workers=0)
    return campaign


def read(campaign: Campaign) -> tuple:
    """Return all that is read of a campaign, without where it stands."""
    status = campaign.status()
    # seconds are summed in another order: see the test
    numbers = (status.done, status.failed, status.not_numbers, status.codes)
    table = campaign.table.drop(columns=["unit", "slot"])
    return table.to_json(double_precision=15), campaign.open().wave.values.tobytes(), numbers


def files(campaign: Campaign) -> int:
    return sum(p.is_file() for p in campaign.path.rglob("*"))


@pytest.mark.slow
def test_what_is_packed_is_the_same(tmp_path):
    campaign = done(tmp_path / "c", 12, 18)
    before, count, failed = read(campaign), files(campaign), len(campaign.failed())
    known, seconds = list(campaign.table["id"]), campaign.status().simulation_seconds
    campaign.pack(6)
    # extents of seven, five and six cases
    assert campaign.folder.unit_count == 4
    assert files(campaign) < 0.7 * count
    assert read(campaign) == before
    assert campaign.status().simulation_seconds == pytest.approx(seconds, rel=1e-9)
    assert campaign.check() == []
    again = Campaign(tmp_path / "c")
    assert read(again) == before
    assert len(again.failed()) == failed > 0
    # and goes on: nothing is done again, further points are, and are packed as well
    assert again.run(workers=0).done == 18
    again.extend(24).run(workers=0)
    assert again.pack(24).folder.unit_count == 4
    assert again.status().done == 24
    assert list(again.table["id"][:18]) == known
    assert again.check() == []


def test_records_are_found_after_packing(tmp_path):
    subject = FunctionSubject(recorded, dict.fromkeys(("x1", "x2", "x3"), 0.0))
    campaign = Campaign(tmp_path / "c", make_plan(subject, ranges(), n=4, unit=1, keep=["record"]))
    campaign.run(workers=0)
    wave = campaign.record(2).wave.values
    np.testing.assert_array_equal(campaign.pack(4).record(2).wave.values, wave)


@pytest.mark.slow
def test_a_handle_from_before_is_that_of_what_is_there_now(tmp_path):
    """Packed or extended by another one: nothing is lost, and signals yet to be read are not taken for damaged."""
    before = done(tmp_path / "c")
    content, data = read(before), before.open()
    Campaign(tmp_path / "c").pack(4)
    assert read(before) == content
    assert before.folder.unit_count == 2
    with pytest.raises(CampaignError, match=says("packed", "since", "opened")):
        data.wave.load()
    other = Campaign(tmp_path / "c").extend(9)
    assert before.status().cases == 9
    assert (other.run(workers=0).done, len(before.table)) == (9, 9)
    # nobody has changed it: what is open is read
    assert before.open().wave.load().shape[0] == 9


@pytest.mark.slow
def test_what_cannot_be_packed_is_told(tmp_path):
    campaign = small(tmp_path / "c", n=8, unit=2)
    with pytest.raises(CampaignError, match=says("pack", "4 units", "run it")):
        campaign.pack()
    campaign.run(workers=0)
    for unit in (2, 5):
        with pytest.raises(CampaignError, match=says("pack", f"{unit} are", "multiple of 2")):
            campaign.pack(unit)
    table = campaign.folder.table(1)
    content = table.read_bytes()
    table.write_bytes(content[:-1])
    with pytest.raises(CampaignError, match=says("pack", "unit 1", "gearmbs campaign run")):
        campaign.pack()
    table.write_bytes(content)
    assert campaign.pack().folder.unit_count == 1


class Killed(BaseException):
    """Ends a packing where it stands."""


def without_ranges(path) -> Campaign:
    """Return a campaign with columns that are empty in some rows: ranges that an option lacks."""
    options = {"healthy": [], "faulty": {"size": [0.1, 1.0]}}
    factors = [Factor("operation.speed", 90.0, 110.0), Choice("fault.teeth", options, name="state")]
    campaign = Campaign(path, make_plan(Ringing(), factors, n=7, unit=2, keep=["numbers", "signal:housing"]))
    campaign.run(workers=0)
    return campaign


@pytest.mark.slow
def test_columns_that_are_empty_in_some_rows(tmp_path):
    campaign = without_ranges(tmp_path / "c")
    before = campaign.table.drop(columns=["unit", "slot"])
    assert 0 < before["state.size"].isna().sum() < 7
    packed = campaign.pack(4)
    pd.testing.assert_frame_equal(packed.table.drop(columns=["unit", "slot"]), before)
    assert packed.check() == []
    rows = [{"x1": 1.0, "x2": 2.0}, {"x1": 0.5}, {"x1": 0.2}]
    plan = make_plan(function(), [], "list", options={"rows": rows}, keep=["numbers"], unit=1)
    listed = Campaign(tmp_path / "d", plan)
    listed.run(workers=0)
    assert listed.pack(2).folder.unit_count == 2


def test_other_cases_than_were_done_are_refused(tmp_path, monkeypatch):
    campaign = without_ranges(tmp_path / "c")
    seeded = lambda store, plan, *rest: write_cases(store, replace(plan, seed=plan.seed + 1), *rest)  # noqa: E731
    monkeypatch.setattr(packing, "write_cases", seeded)
    with pytest.raises(CampaignError, match="gives other cases"):
        campaign.pack(4)


def at(step: int, monkeypatch) -> list[int]:
    """Raise at a step of all that change what stands under a name; return how many there were."""
    steps = [0]

    def counted(change):
        def counting(*args, **settings):
            steps[0] += 1
            if steps[0] == step:
                raise Killed
            return change(*args, **settings)

        return counting

    monkeypatch.setattr(os, "replace", counted(os.replace))
    monkeypatch.setattr(shutil, "rmtree", counted(shutil.rmtree))
    monkeypatch.setattr(Path, "unlink", counted(Path.unlink))
    return steps


PLAN = "plan.json or its copy: missing, damaged or not the same"
"""Between the writing of the copy and that of the plan."""


@pytest.mark.slow
def test_packing_that_is_killed_at_any_step(tmp_path, monkeypatch):
    done(tmp_path / "whole")
    before = read(Campaign(tmp_path / "whole"))
    with monkeypatch.context() as patched:
        steps = at(0, patched)
        Campaign(shutil.copytree(tmp_path / "whole", tmp_path / "counted")).pack(6)
    assert steps[0] > 12
    for step in range(1, steps[0] + 1):
        place = shutil.copytree(tmp_path / "whole", tmp_path / f"c{step}")
        with monkeypatch.context() as patched:
            at(step, patched)
            with pytest.raises(Killed):
                Campaign(place).pack(6)
        killed = Campaign(place)
        assert read(killed) == before
        assert [line for line in killed.check() if not line.startswith("litter")] in ([], [PLAN])
        killed.run(workers=0)
        assert killed.folder.unit_count == 2 or killed.pack(6).folder.unit_count == 2
        killed.check(sweep=True)
        assert [line for line in killed.check() if "packed" in line or not line.startswith("litter")] == []
        assert read(Campaign(place)) == before
