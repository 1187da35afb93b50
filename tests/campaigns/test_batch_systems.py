"""Batch systems, played by scripts that run jobs on this machine: real workers, real job scripts, jobs that are cut."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from gearmbs.campaigns.cluster import job_script
from tests.campaigns.support import digest, small

SUBMIT = """#!/bin/bash
# keeps the script, runs it in a session of its own, and says its number as the batch system does
cp "${{@: -1}}" {folder}/job-$$.sh
setsid bash {folder}/job-$$.sh > {folder}/job-$$.log 2>&1 < /dev/null &
echo $! >> {folder}/jobs
echo "{answer}"
"""
CANCEL = """#!/bin/bash
kill -TERM -- -"${1%%.*}"
"""
# jobs of this machine keep the compiled code of the tests
DRIVER = """
from gearmbs.campaigns import Campaign, dask_client
settings = {{"job_script_prologue": [], "scheduler_options": {{"dashboard_address": None, "host": "127.0.0.1"}}}}
if __name__ == "__main__":
    with dask_client({batch!r}, 2, walltime="00:10:00", **settings) as client:
        Campaign({path!r}).run(client=client)
"""
LONGEST = 240.0
"""Seconds after which something hangs."""

SYSTEMS = {
    "slurm": ("sbatch", "scancel", "Submitted batch job $!"),
    "pbs": ("qsub", "qdel", "$!.machine"),
}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    campaign = small(tmp_path_factory.mktemp("c") / "c", "burning", n=64)
    campaign.run(workers=0)
    return digest(campaign)


@pytest.fixture
def batch(request, tmp_path, monkeypatch):
    """Put the commands of a batch system on the path; end what is left of its jobs."""
    submit, cancel, answer = SYSTEMS[request.param]
    folder = tmp_path / "batch"
    folder.mkdir()
    for name, text in ((submit, SUBMIT.format(folder=folder, answer=answer)), (cancel, CANCEL)):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(p or os.getcwd() for p in sys.path))
    yield request.param
    for number in started(folder):
        kill(number)


def started(folder) -> list[int]:
    """Return the numbers of the jobs so far."""
    jobs = folder / "jobs"
    return [int(line) for line in jobs.read_text().split()] if jobs.exists() else []


def kill(number: int) -> None:
    try:
        os.killpg(number, signal.SIGKILL)
    except ProcessLookupError:
        pass


@pytest.mark.slow
@pytest.mark.parametrize("batch", list(SYSTEMS), indirect=True)
def test_workers_that_are_jobs(tmp_path, batch, undisturbed):
    """Jobs are submitted, work, one is killed as by the end of its walltime, another takes its place: the same bits."""
    pytest.importorskip("dask_jobqueue")
    campaign = small(tmp_path / "c", "burning", n=64)
    folder = tmp_path / "batch"
    script = tmp_path / "driver.py"
    script.write_text(DRIVER.format(batch=batch, path=str(campaign.path)))
    driver = subprocess.Popen([sys.executable, str(script)], start_new_session=True)
    try:
        end = time.monotonic() + LONGEST
        while not campaign.status().done and driver.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        first = started(folder)[0]
        kill(first)
        assert driver.wait(LONGEST) == 0
    finally:
        kill(driver.pid)
    assert len(started(folder)) >= 2
    assert campaign.status().failed == 0
    assert digest(campaign) == undisturbed


@pytest.mark.slow
@pytest.mark.parametrize(("system", "number"), [("slurm", "SLURM_ARRAY_TASK_ID"), ("pbs", "PBS_ARRAY_INDEX")])
def test_elements_of_a_job_array(tmp_path, system, number, undisturbed):
    """The printed script, run once for each element as a batch system does, in any order."""
    campaign = small(tmp_path / "c", "burning", n=64)
    script = tmp_path / "job.sh"
    script.write_text(job_script(campaign.path, 3, 60, system))
    command = tmp_path / "gearmbs"
    command.write_text(f'#!/bin/bash\n[ "$1" = compile ] && exit 0\nexec {sys.executable} -m gearmbs "$@"\n')
    command.chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join(p or os.getcwd() for p in sys.path),
        "TMPDIR": str(tmp_path),
    }
    for element in (2, 3, 1):
        done = subprocess.run(
            ["bash", script], env={**environment, number: str(element)}, cwd=tmp_path, timeout=120, check=True,
            capture_output=True, text=True,
        )  # fmt: skip
    assert "64 of 64 cases done" in done.stdout
    assert digest(campaign) == undisturbed
