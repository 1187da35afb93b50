"""Cases side by side: order, progress from processes, and an end at once after a failure or Ctrl-C."""

import os
import pickle
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

import pytest

from gearmbs.studies import Case, SimulationFailed, run_case, run_cases
from gearmbs.studies.run.claims import Claim, claimed, take
from gearmbs.studies.run.engine import DEATH, RESULT, WorkerDied, here, processes, run_jobs, threads
from gearmbs.studies.run.simulation import simulate_case
from tests.says import says
from tests.studies.jobs import (
    Unreadable,
    fail_or_wait,
    raise_what_cannot_travel,
    return_what_cannot_travel,
    square,
    square_or_die,
)

SHORT = {"run_up": 0.02, "settling": 0.0, "duration": 0.07}


def gone(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False


@pytest.mark.slow
def test_results_in_order_with_progress():
    told, finished = [], {}
    results = run_jobs(
        square,
        [3, 1, 2],
        2,
        progress=lambda job, x: told.append((job, x)),
        done=lambda job, x: finished.update({job: x}),
    )
    assert results == [9, 1, 4]
    assert sorted(told) == [(1, 0.5), (2, 0.5), (3, 0.5)]
    assert finished == {3: 9, 1: 1, 2: 4}


@pytest.mark.parametrize(
    ("job", "kind", "words"),
    [
        ("fail", ValueError, "job failed"),
        ("die", WorkerDied, says("worker process", "memory", "__name__ == '__main__'")),
    ],
)
@pytest.mark.slow
def test_a_failure_ends_the_others(job, kind, words):
    """The other job would never end; its process is gone when the error arrives."""
    pids = []
    with pytest.raises(kind, match=words):
        run_jobs(fail_or_wait, ["wait", job], 2, progress=lambda job, pid: pids.append(pid))
    assert all(gone(pid) for pid in pids)


@pytest.mark.slow
def test_a_worker_that_dies_is_replaced_and_jobs_are_taken_when_one_is_free():
    taken = []

    def jobs():
        for job in ("die", 3, 2):
            taken.append(job)
            yield job

    told = processes(square_or_die, jobs(), 1)
    assert next(told) == (0, "die", DEATH, None)
    assert taken == ["die"]
    assert list(told) == [(1, 3, RESULT, 9), (2, 2, RESULT, 4)]


@pytest.mark.parametrize("where", [here, threads], ids=["here", "in threads"])
def test_jobs_run_elsewhere_by_the_same_engine(where):
    """Order, results as they come, the first error; after no time nothing is begun."""
    finished = []
    assert run_jobs(square, [3, 1, 2], 2, where=where, done=lambda job, x: finished.append(job)) == [9, 1, 4]
    assert sorted(finished) == [1, 2, 3]
    with pytest.raises(TypeError):
        run_jobs(square, [1, "text"], 2, where=where)
    assert run_jobs(square, [3, 1], 2, where=where, seconds=0.0) == []


def test_a_thread_that_ends_without_a_word_is_a_death():
    def leave(job, report):
        raise SystemExit(3)

    with pytest.raises(WorkerDied) as died:
        run_jobs(leave, ["job"], where=threads)
    assert died.value.job == "job"


@pytest.mark.slow
def test_a_job_whose_worker_dies_is_tried_again_so_often():
    finished = []
    with pytest.raises(WorkerDied) as died:
        run_jobs(square_or_die, ["die", 3], 1, tries=2, done=lambda job, x: finished.append(job))
    assert died.value.job == "die"
    assert finished == [3]


@dataclass
class Squares:
    """A ledger of squares, a text file a job."""

    folder: Path

    def result(self, job):
        path = self.folder / str(job)
        return int(path.read_text()) if path.exists() else None

    def claim(self, job):
        return self.folder / f"{job}.claim"


def test_what_others_are_at_work_on_is_theirs(tmp_path, monkeypatch):
    """One job is finished by somebody else, another one given back: each is worked on once, both are in the results."""
    monkeypatch.setattr("gearmbs.studies.run.engine.POLL", 0.0)
    ledger, worked = Squares(tmp_path), []
    theirs, given_back = (take(ledger.claim(job)) for job in (5, 6))

    def work(job, report):
        return claimed(ledger, job, lambda claim: worked.append(job) or square(job, report))

    def done(job, value):
        if job == 4:
            (tmp_path / "5").write_text("25")
            theirs.release()
            given_back.release()

    assert run_jobs(work, [4, 5, 6], where=here, done=done, ledger=ledger) == [16, 25, 36]
    assert worked == [4, 6]
    assert not list(tmp_path.glob("*.claim"))


def test_an_error_that_cannot_be_sent_arrives_as_text():
    with pytest.raises(RuntimeError, match="Local: only here"):
        run_jobs(raise_what_cannot_travel, [0], 1)


@pytest.mark.slow
def test_a_result_that_cannot_be_sent_is_no_death():
    with pytest.raises(RuntimeError, match=says("'case 7'", "function", "pickled", "threads")):
        run_jobs(return_what_cannot_travel, ["case 7"], 1)
    with pytest.raises(RuntimeError, match=says("ValueError", "'no number'", "modules", "imported")):
        run_jobs(square, [Unreadable()], 1)


def test_jobs_without_a_result_are_known():
    results = run_jobs(square, [3, 1, 2], 1, where=here)
    assert (results, results.left) == ([9, 1, 4], [])
    assert run_jobs(square, [3, 1], where=here, seconds=0.0).left == [3, 1]


def test_a_job_at_work_gives_signs_of_life_without_a_report(tmp_path, monkeypatch):
    """So that its claim is not taken over elsewhere after a lease, which here would have ended long ago."""
    monkeypatch.setattr("gearmbs.studies.run.claims.BEAT", 0.001)
    ledger, beaten = Squares(tmp_path), threading.Event()
    path = ledger.claim(7)
    here_too = Claim.beat

    def beat(claim):
        here_too(claim)
        if path.stat().st_mtime > 1e9:
            beaten.set()

    def work(claim):
        os.utime(path, (0.0, 0.0))
        beaten.clear()
        return beaten.wait(60.0)

    monkeypatch.setattr(Claim, "beat", beat)
    before = threading.active_count()
    assert claimed(ledger, 7, work)
    assert threading.active_count() == before
    assert not path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="signals to process groups are POSIX")
@pytest.mark.parametrize("everyone", [True, False], ids=["from the terminal", "to the parent"])
@pytest.mark.slow
def test_ctrl_c_ends_all_processes(everyone):
    """Both workers wait for ever. Ctrl-C in a terminal reaches all processes of the group, kill only the parent."""
    # a job in the background starts with the signal ignored
    code = (
        "import signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from gearmbs.studies.run.engine import run_jobs\n"
        "from tests.studies.jobs import fail_or_wait\n"
        "if __name__ == '__main__':\n"
        "    try:\n"
        "        run_jobs(fail_or_wait, ['a', 'b'], 2, progress=lambda job, pid: print(pid, flush=True))\n"
        "    except KeyboardInterrupt:\n"
        "        raise SystemExit(130)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )
    pids = [int(process.stdout.readline()) for _ in range(2)]
    if everyone:
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors == ""
    assert all(gone(pid) for pid in pids)


@pytest.mark.slow
def test_processes_and_threads_give_the_same_records():
    """IDA runs in processes when there is more than one worker; bars move before a case ends."""
    cases = [
        Case(name=f"{z}", gears={"teeth": (z, 29)}, operation=SHORT, solver={"integrator": "IDA"}) for z in (25, 31)
    ]
    told = []
    records = run_cases(cases, workers=2, progress=lambda name, fraction: told.append((name, fraction)))
    assert [record.attrs["case"] for record in records] == ["25", "31"]
    assert {name for name, fraction in told if 0.0 < fraction < 1.0} == {"25", "31"}
    alone = run_case(cases[0])
    assert records[0].gmf_rms.equals(alone.gmf_rms)


def test_a_failing_case_brings_what_it_computed_out_of_its_process():
    """The solution stays in the process, its record travels."""
    case = Case(operation=SHORT)
    solution = simulate_case(case)
    failure = pickle.loads(pickle.dumps(SimulationFailed("stopped", solution, case)))
    assert str(failure) == "stopped"
    assert failure.solution is None
    assert failure.case == case
    assert failure.partial().time.size == solution.t.size
    assert failure.partial().attrs["status"] == "SUCCESS"
