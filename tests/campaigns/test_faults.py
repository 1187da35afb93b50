"""Whatever happens to a campaign and its files: complete and equal, or stopped with the cause.

The seed is ``GEARMBS_SEED``, the number of faults ``GEARMBS_CASES``.
"""

from __future__ import annotations

import random
import runpy
import sys

import pytest

from benchmarks import campaign_faults
from benchmarks.lost_writes import Recorder
from gearmbs import files
from gearmbs.campaigns import Campaign
from tests.campaigns.support import digest, small
from tests.generators import cases, seed


@pytest.mark.slow
def test_random_faults(tmp_path):
    """A kind after the other; two are stopped, with the name of what was edited."""
    ends = campaign_faults.faults(tmp_path, cases(len(campaign_faults.KINDS)), seed())
    stopped = {kind: [e for e in ended if e.startswith("stopped")] for kind, ended in ends.items()}
    assert not [e for ended in ends.values() for e in ended if e.startswith("silent")]
    assert sum(map(len, stopped.values())) <= sum(map(len, ends.values())) / 3
    assert not [kind for kind in stopped if stopped[kind] and kind not in ("other_code", "edited_plan", "bit_flip")]


@pytest.mark.slow
def test_bits_that_are_flipped_change_no_number(tmp_path):
    """One bit of any file: all that is read is as it was, or an error."""
    hit, wrong = campaign_faults.flips(tmp_path, cases(40), seed())
    assert not wrong
    assert set(hit) == {"plan.json", "cases", "codes", "units", "table", "signals.zarr", "records"}


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


COMMANDS = [
    (module, words, code)
    for module, wrong in (("campaign_faults", "many"), ("campaigns", "engine"), ("campaign_failures", "plant"))
    for words, code in ((["--help"], 0), (["place", wrong], 2), ([], 2))
]


@pytest.mark.parametrize(("module", "words", "code"), COMMANDS)
def test_the_commands_say_what_they_take(tmp_path, monkeypatch, capsys, module, words, code):
    """And begin with nothing before they know what is wanted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [module, *words])
    monkeypatch.delitem(sys.modules, f"benchmarks.{module}", raising=False)
    with pytest.raises(SystemExit) as ended:
        runpy.run_module(f"benchmarks.{module}", run_name="__main__")
    assert ended.value.code == code
    told = "".join(capsys.readouterr())
    assert "folder" in told
    assert len(words) < 2 or words[1] in told
    assert not list(tmp_path.iterdir())
