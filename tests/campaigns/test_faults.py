"""Whatever happens to a campaign and its files: complete and equal, or stopped with the cause.

The seed is ``GEARMBS_SEED``, the number of faults ``GEARMBS_CASES``.
"""

from __future__ import annotations

import random
import warnings

import numpy as np
import pytest
import xarray as xr

from benchmarks import campaign_faults
from benchmarks.lost_writes import Recorder
from gearmbs import files
from gearmbs.campaigns import Campaign, CampaignError, FunctionSubject, make_plan
from tests.campaigns.support import digest, ranges, small
from tests.generators import cases, seed


@pytest.mark.slow
def test_random_faults(tmp_path):
    """A kind after the other; two are stopped, with the name of what was edited."""
    ends = campaign_faults.faults(tmp_path, cases(len(campaign_faults.KINDS)), seed())
    stopped = {kind: [e for e in ended if e.startswith("stopped")] for kind, ended in ends.items()}
    assert not [e for ended in ends.values() for e in ended if e.startswith("silent")]
    assert sum(map(len, stopped.values())) <= sum(map(len, ends.values())) / 3
    assert not [kind for kind in stopped if stopped[kind] and kind not in ("other_code", "edited_plan", "bit_flip")]


def recorded(x1: float, x2: float, x3: float) -> xr.Dataset:
    """Return a record; of some places none, but an error."""
    if x1 > 3.0:
        raise ValueError("x1: beyond")
    wave = np.sin(x1 * np.arange(1500.0))
    return xr.Dataset({"y": x1 + x2 * x3, "wave": ("t", wave[:50]), "long": ("s", wave)})


def kept(path, n=12) -> Campaign:
    """Return a campaign that keeps all there is."""
    subject = FunctionSubject(recorded, {"x1": 0.0, "x2": 0.0, "x3": 0.0}, signals={"wave": (50, 10.0)})
    plan = make_plan(subject, ranges(), n=n, keep=["numbers", "record", "signal:wave"], unit=4)
    return Campaign(path, plan)


def read(path) -> list:
    """Return all that can be read of a campaign, in as many ways as there are; an error counts as an answer."""
    ways = [
        lambda c: c.table.to_json(double_precision=15),
        lambda c: c.read(["y", "x1"], "status == 'done'").to_json(double_precision=15),
        lambda c: c.open().wave.values.tobytes(),
        lambda c: str(c.open().wave.attrs) + str(c.open().wave_time.values),
        lambda c: str(c.status()) + str(c.status().processor_seconds),
        lambda c: c.failed().to_json(),
        lambda c: "".join(c.record(k).to_dict(data="array").__str__() for k in range(c.folder.case_count)),
        lambda c: str([c.case(k) for k in range(0, c.folder.case_count, 3)]),
        lambda c: str(c.plan),
    ]
    found = []
    for way in ways:
        try:
            found.append(way(Campaign(path)))
        except (CampaignError, OSError):
            found.append(None)
    return found


@pytest.mark.slow
def test_bits_that_are_flipped_change_no_number(tmp_path):
    """One bit of any file: all that is read is as it was, or an error; `check` finds it, or it does not matter."""
    campaign = kept(tmp_path / "c")
    campaign.run(workers=0)
    truth = read(campaign.path)
    assert None not in truth
    paths = sorted(p for p in campaign.path.rglob("*") if p.is_file())
    assert {p.relative_to(campaign.path).parts[0] for p in paths} == {
        "plan.json", "cases", "codes", "units", "table", "signals.zarr", "records"
    }  # fmt: skip
    chance = random.Random(seed())
    wrong = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for k in range(cases(30)):
            path = paths[k % len(paths)]
            whole = path.read_bytes()
            campaign_faults.flipped(path, chance)
            found = read(campaign.path)
            wrong += [(path.name, way) for way, (a, b) in enumerate(zip(truth, found)) if b is not None and a != b]
            path.write_bytes(whole)
    assert not wrong


def traced(tmp_path, monkeypatch) -> Recorder:
    """Carry out a campaign, and return what it did to its files."""
    campaign = small(tmp_path / "c", n=16, unit=4)
    recorder = Recorder(campaign.path)
    recorder.begin()
    for name in ("fsync", "replace", "link", "unlink", "mkdir"):
        # what the trace puts in their place is taken back
        monkeypatch.setattr(files.os, name, getattr(files.os, name))
    recorder.trace()
    campaign.run(workers=0)
    monkeypatch.undo()
    return recorder


def lies(path) -> list[str]:
    """Return what a folder says is done, and is not."""
    return [line for line in Campaign(path).check() if line.startswith("unit")]


@pytest.mark.slow
def test_a_power_cut_at_any_moment(tmp_path, monkeypatch):
    """Whatever a disk may have lost: what a ledger says is there, and the next run comes to the same bits."""
    truth = digest_of(tmp_path)
    recorder, chance = traced(tmp_path, monkeypatch), random.Random(seed())
    for _ in range(cases(12)):
        recorder.cut(chance)
        assert lies(recorder.root) == []
        campaign = Campaign(recorder.root)
        campaign.run(workers=0)
        assert digest(campaign) == truth


def digest_of(tmp_path) -> str:
    campaign = small(tmp_path / "alone", n=16, unit=4)
    campaign.run(workers=0)
    return digest(campaign)


def test_the_trace_finds_an_order_that_is_wrong(tmp_path, monkeypatch):
    """Files that are renamed before they are on the disk are lies in some of the power cuts."""
    monkeypatch.setattr(files, "to_disk", lambda path: None)
    recorder, chance = traced(tmp_path, monkeypatch), random.Random(1)
    found = []
    for _ in range(12):
        recorder.cut(chance)
        found += lies(recorder.root)
    assert found
