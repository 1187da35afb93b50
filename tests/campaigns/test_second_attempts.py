"""Cases that fail and are done at a tighter tolerance: their records, and who may take their results over."""

import json
from typing import ClassVar

import numpy as np
import pytest
import xarray as xr

from gearmbs.campaigns import Campaign, CampaignError, CampaignWarning, Kept, Subject, make_plan
from gearmbs.campaigns.folder import sealed, unsealed
from gearmbs.campaigns.stored.checks import file_digest


class Stiff(Subject):
    """Something that fails at the tolerance of 1 beyond a bound, with what it has computed until then."""

    kind: ClassVar[str] = "tests.campaigns.test_second_attempts:Stiff"
    keeps: ClassVar[tuple[str, ...]] = ("numbers", "record")

    def settings(self):
        return {}

    @classmethod
    def from_settings(cls, settings):
        return cls()

    def base(self):
        return {"a": 1.0, "tolerance": 1.0}

    def unit_of(self, path):
        return "1"

    def check(self, data, name):
        return dict(data)

    def canonical(self, thing):
        return thing

    def run(self, thing, progress, keep):
        if thing["tolerance"] > 0.5 and thing["a"] > 1.5:
            raise RuntimeError("too stiff")
        return xr.Dataset({"v": ("t", np.full(3, 10.0 * thing["a"]))})

    def reduce(self, thing, record, keep):
        return Kept({"y": float(record.v[0])})

    def partial(self, error):
        return xr.Dataset({"v": ("t", [-1.0])})

    def tightened(self, thing):
        return {**thing, "tolerance": 0.1} if thing["a"] < 3.5 else None


ROWS = [{"a": 1.0}, {"a": 2.0}, {"a": 4.0}, {"a": 3.0}]


def campaign(path, rows=ROWS, keep=("numbers", "record"), on_failure="tighter", **settings):
    settings = {"unit": 4, **settings}
    plan = make_plan(Stiff(), [], "list", options={"rows": rows}, keep=list(keep), on_failure=on_failure, **settings)
    made = Campaign(path, plan)
    made.run(workers=0, progress=False)
    return made


def records(made):
    return [made.record(k).v.values.tolist() for k in range(len(made.table))]


def with_ledger(made, unit=0, **entries):
    """Put entries into the ledger of a unit as another version would have written it; None takes one out."""
    ledger = made.folder.ledger(unit)
    entry = unsealed(ledger) | entries
    ledger.write_text(sealed({name: value for name, value in entry.items() if value is not None}))


@pytest.mark.slow
def test_the_record_is_that_of_the_attempt_that_was_done(tmp_path):
    made = campaign(tmp_path / "a", unit=2)
    assert made.table["status"].tolist() == ["done", "done", "failed", "done"]
    assert records(made) == [[10.0] * 3, [20.0] * 3, [-1.0], [30.0] * 3]
    assert sorted(p.name for p in (tmp_path / "a").rglob("failed/**/*.nc")) == ["0000002.nc"]
    assert made.check() == []
    # within a unit and from another campaign
    again = campaign(tmp_path / "b", [*ROWS[:2], ROWS[1]], reuse=[str(tmp_path / "a")])
    assert again.status().reused == 3
    assert records(again) == [[10.0] * 3, [20.0] * 3, [20.0] * 3]


def test_a_folder_with_both_files_of_a_case_is_read_right(tmp_path):
    made = campaign(tmp_path / "a")
    broken = tmp_path / "a" / "failed" / "00000" / "0000001.nc"
    broken.write_bytes((tmp_path / "a" / "failed" / "00000" / "0000002.nc").read_bytes())
    files = unsealed(made.folder.ledger(0))["files"]
    with_ledger(made, files={str(broken.relative_to(tmp_path / "a")): file_digest(broken), **files}, tightened=None)
    made = Campaign(tmp_path / "a")
    assert made.check() == []
    assert records(made)[1] == [20.0] * 3
    again = campaign(tmp_path / "b", ROWS[:2], reuse=[str(tmp_path / "a")])
    assert (again.status().reused, records(again)) == (2, [[10.0] * 3, [20.0] * 3])


def test_a_record_that_is_a_failed_attempts_is_noticed_and_done_again(tmp_path):
    source = campaign(tmp_path / "a")
    made = campaign(tmp_path / "b", ROWS[:2], reuse=[str(tmp_path / "a")])
    record = tmp_path / "b" / "records" / "00000" / "0000001.nc"
    record.write_bytes((tmp_path / "a" / "failed" / "00000" / "0000002.nc").read_bytes())
    files = unsealed(made.folder.ledger(0))["files"]
    with_ledger(made, files=files | {str(record.relative_to(tmp_path / "b")): file_digest(record)})
    assert len(found := Campaign(tmp_path / "b").check()) == 1
    assert "records/00000/0000001.nc is what a failed attempt had computed" in found[0]
    made = Campaign(tmp_path / "b")
    with pytest.warns(CampaignWarning, match="failed attempt"):
        made.run(workers=0, progress=False)
    assert (made.check(), records(made), source.check()) == ([], [[10.0] * 3, [20.0] * 3], [])


@pytest.mark.parametrize("old", [False, True])
@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.slow
def test_results_at_another_tolerance_are_those_of_plans_that_ask_for_it(tmp_path, old, packed):
    source = campaign(tmp_path / "a", keep=["numbers"], unit=2)
    if old:
        with_ledger(source, 0, tightened=None)
        with_ledger(source, 1, tightened=None)
    if packed:
        source.pack(unit=4)
    settings = {"keep": ["numbers"], "reuse": [str(tmp_path / "a")]}
    plain = campaign(tmp_path / "b", on_failure="record", **settings)
    assert plain.table["status"].tolist() == ["done", "failed", "failed", "failed"]
    # what was done at its own tolerance is taken over, where that is known
    assert plain.status().reused == (0 if old else 1)
    with pytest.raises(CampaignError, match="too stiff"):
        campaign(tmp_path / "c", on_failure="stop", **settings)
    same = campaign(tmp_path / "d", **settings)
    assert same.table["status"].tolist() == ["done", "done", "failed", "done"]
    assert same.status().reused == 3
    # and stays known where it was taken over
    last = campaign(tmp_path / "e", on_failure="record", keep=["numbers"], reuse=[str(tmp_path / "d")])
    assert last.table["status"].tolist() == ["done", "failed", "failed", "failed"]
    assert json.loads(same.folder.ledger(0).read_text())["tightened"] == ([0, 1, 3] if old else [1, 3])
