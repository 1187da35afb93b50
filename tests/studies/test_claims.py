"""Claims of others, workers that stand still, and workers that refuse."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys

import pytest

from gearmbs.studies.run import claims, engine
from gearmbs.studies.run.claims import claimed, owner, take, told, vacant
from gearmbs.studies.run.engine import Refused, WorkerReplaced, here, run_jobs
from tests.says import says
from tests.studies.jobs import refuse_at_first, stop_at_first
from tests.studies.test_parallel import Squares, square


@pytest.fixture
def clock(monkeypatch):
    """Return a clock that does not go by itself; that of the wall is wrong by a day."""
    now = [1000.0]
    monkeypatch.setattr(claims.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(claims, "_watched", {})
    return now


def elsewhere(path, **changes) -> None:
    """Write the claim of another machine."""
    path.write_text(json.dumps({"host": "other", "pid": 7, "started": "1", "attempts": 0, **changes}))


@pytest.mark.parametrize("skew", [-86400.0, 0.0, 86400.0])
def test_a_claim_of_another_machine_is_void_by_the_clock_of_who_looks(tmp_path, clock, skew):
    """However wrong its times are; a sign of life begins the lease anew, and a claim that is void is so for all."""
    path = tmp_path / "claim"
    elsewhere(path)
    for second in (0.0, 0.9 * claims.LEASE):
        when = 1.7e9 + skew + second
        os.utime(path, (when, when))
        clock[0] += second
        assert not vacant(path)
    clock[0] += 0.9 * claims.LEASE
    assert owner(path)["host"] == "other"
    assert take(path) is None
    clock[0] += 0.2 * claims.LEASE
    assert owner(path) is None
    assert vacant(path)
    claims._watched.clear()
    assert take(path).attempts == 1


def test_a_claim_that_cannot_be_read_is_being_written_for_a_while(tmp_path, clock):
    path = tmp_path / "claim"
    path.write_text("{")
    assert take(path) is None
    clock[0] += 2.0 * claims.WRITING
    assert take(path) is not None


def test_a_process_of_the_same_number_in_another_container_is_another_one(tmp_path, clock):
    path = tmp_path / "claim"
    elsewhere(path, host=socket.gethostname(), space="another")
    assert take(path) is None
    assert says_who(path) == f"host {socket.gethostname()}, process 7"
    elsewhere(path, host=socket.gethostname())
    assert take(path) is not None


def says_who(path) -> str:
    return told(owner(path)).partition(", for")[0]


def test_a_run_that_waits_says_for_whom(tmp_path, monkeypatch):
    """Then the other one is done."""
    monkeypatch.setattr(engine, "POLL", 0.0)
    monkeypatch.setattr(engine, "NOTICE", 0.0)
    ledger, seen = Squares(tmp_path), []
    theirs = take(ledger.claim(5))

    def waiting(others):
        seen.extend(others)
        (tmp_path / "5").write_text("25")
        theirs.release()

    def work(job, report):
        return claimed(ledger, job, lambda claim: square(job, report))

    assert run_jobs(work, [4, 5], where=here, ledger=ledger, waiting=waiting) == [16, 25]
    ((job, who),) = seen
    assert (job, who["pid"]) == (5, os.getpid())
    assert who["age"] >= who["silent"] >= 0.0


@pytest.mark.slow
def test_a_worker_that_refuses_is_replaced_and_its_job_goes_back(tmp_path):
    """The second process does what the first one could not; a reason that stays ends the run with itself."""
    job = str(tmp_path / "mark")
    assert run_jobs(refuse_at_first, [job], 1) == [job]
    with pytest.raises(Refused, match=says("no module", "host")):
        run_jobs(refuse_at_first, [""], 1)


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc")
def test_a_worker_that_is_stopped_is_replaced(tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "STOPPED", 0.5)
    job = str(tmp_path / "mark")
    with pytest.warns(WorkerReplaced, match=says("stood still")):
        assert run_jobs(stop_at_first, [job], 1, tries=2) == [job]
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "mark").read_text()), signal.SIGCONT)
