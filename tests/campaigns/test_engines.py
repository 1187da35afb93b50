"""Kills, Dask, two drivers: the same bits."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import CancelledError

import pytest

from gearmbs.campaigns import Campaign, CampaignError
from gearmbs.campaigns.cluster import DaskRunner, batch_cluster, job_script
from gearmbs.campaigns.limits import TimeLimitReached, limited
from gearmbs.studies.run.engine import WorkerReplaced
from tests.campaigns.support import digest, small
from tests.says import says

DRIVER = (
    "import sys; from gearmbs.campaigns import Campaign\nif __name__ == '__main__': "
    "Campaign(sys.argv[1]).run(workers=2)"
)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    campaign = small(tmp_path_factory.mktemp("c") / "c", "burning", n=64)
    campaign.run(workers=0)
    return digest(campaign)


def start(path) -> subprocess.Popen:
    """Start a driver with two workers in a session of its own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    script = path.parent / "driver.py"
    script.write_text(DRIVER)
    return subprocess.Popen([sys.executable, str(script), str(path)], env=environment, start_new_session=True)


@pytest.mark.slow
def test_kills_of_driver_and_workers(tmp_path, undisturbed):
    campaign = small(tmp_path / "c", "burning", n=64)
    generator = random.Random(5)
    for _ in range(3):
        driver = start(campaign.path)
        # until something is at work, and then a moment more
        end = time.monotonic() + 60.0
        while not list((campaign.path / "units").glob("*.claim")) and time.monotonic() < end and driver.poll() is None:
            time.sleep(0.02)
        time.sleep(generator.uniform(0.0, 0.3))
        os.killpg(driver.pid, signal.SIGKILL)
        driver.wait()
    campaign.run(workers=0)
    assert digest(campaign) == undisturbed


@pytest.mark.slow
def test_time_is_limited_in_threads_that_have_no_timer():
    found: list[str] = []

    def work() -> None:
        try:
            with limited(0.05, None):
                while True:
                    pass
        except TimeLimitReached as error:
            found.append(str(error))
        with limited(60.0, None):
            found.append("undisturbed")

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(30.0)
    assert found == ["more than 0.05 s of processor time", "undisturbed"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the size of a process is read from /proc")
def test_limits_of_memory_side_by_side_leave_the_process_as_it_was():
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_AS)
    gate = threading.Barrier(2)

    def work(seconds: float) -> None:
        gate.wait(30.0)
        with limited(None, 4e9):
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                pass

    threads = [threading.Thread(target=work, args=(s,)) for s in (0.05, 0.1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30.0)
    assert resource.getrlimit(resource.RLIMIT_AS) == before


@pytest.mark.slow
def test_two_drivers_at_once(tmp_path, undisturbed):
    campaign = small(tmp_path / "c", "burning", n=64)
    drivers = [start(campaign.path) for _ in range(2)]
    assert [driver.wait(timeout=120) for driver in drivers] == [0, 0]
    assert digest(campaign) == undisturbed


@pytest.mark.slow
def test_dask_with_a_worker_killed(tmp_path, undisturbed):
    distributed = pytest.importorskip("distributed")
    campaign = small(tmp_path / "c", "burning", n=64)
    killed = []

    def kill_once(status):
        if status.done and not killed:
            claims = [json.loads(p.read_text()) for p in (campaign.path / "units").glob("*.claim")]
            if claims:
                killed.append(claims[0]["pid"])
                os.kill(killed[0], signal.SIGKILL)

    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        campaign.run(client=client, progress=kill_once)
    assert digest(campaign) == undisturbed
    assert Campaign(campaign.path).status().failed == 0


def _without_a_module() -> None:
    sys.modules["colorsys"] = None  # type: ignore[assignment]


@pytest.mark.slow
def test_a_dask_worker_that_lacks_a_module_is_left_out(tmp_path):
    """Its cases are not to blame, and the others do them; where none is left the run ends with the reason."""
    distributed = pytest.importorskip("distributed")
    campaign = small(tmp_path / "c", "leaning", n=32, unit=2)
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        broken, sound = client.scheduler_info()["workers"]
        client.run(_without_a_module, workers=[broken])
        with pytest.warns(WorkerReplaced, match=says(broken, "colorsys")):
            status = campaign.run(client=client)
        assert (status.done, status.failed) == (32, 0)
        client.run(_without_a_module, workers=[sound])
        with pytest.warns(WorkerReplaced), pytest.raises(CampaignError, match=says("colorsys", "host")):
            campaign.extend(64).run(client=client)
    assert campaign.status().failed == 0


@pytest.mark.parametrize("lost", ["closed", "cancelled"])
def test_a_scheduler_that_is_lost_is_told(monkeypatch, lost):
    """Whichever way the client notices it; an error of another kind stays what it is."""
    distributed = pytest.importorskip("distributed")
    errors = {"closed": distributed.comm.CommClosedError("gone"), "cancelled": CancelledError()}

    class Client:
        """One of a cluster of one worker, which takes everything and never answers."""

        def nthreads(self):
            return {"tcp://worker": 1}

        def submit(self, *_args, **_kwargs):
            return object()

        def cancel(self, _futures):
            raise AssertionError

    def failing(error):
        def wait(*_args, **_kwargs):
            raise error

        return wait

    monkeypatch.setattr(distributed, "wait", failing(errors[lost]))
    with pytest.raises(CampaignError, match=says("scheduler", "lost", "run again")):
        list(DaskRunner(Client())(None, range(3), 1))
    monkeypatch.setattr(distributed, "wait", failing(KeyError("x")))
    monkeypatch.setattr(Client, "cancel", lambda *_: None)
    with pytest.raises(KeyError):
        list(DaskRunner(Client())(None, range(3), 1))


def test_job_scripts_of_both_systems():
    slurm, pbs = (job_script("x/faults.campaign", 40, 150, system) for system in ("slurm", "pbs"))
    assert "--array=1-40" in slurm
    assert "--part $SLURM_ARRAY_TASK_ID/40 --minutes 135" in slurm
    assert "#PBS -l walltime=02:30:00" in pbs
    assert "--part $PBS_ARRAY_INDEX/40 --minutes 135" in pbs
    assert "${TMPDIR:-/tmp}/gearmbs-kernels" in pbs
    assert "work '/my data/a b.campaign' --part" in job_script("/my data/a b.campaign", 1, 60)
    with pytest.raises(CampaignError, match=says("0", "give a whole number")):
        job_script("x", 0, 60)
    with pytest.raises(CampaignError, match="choose slurm or pbs"):
        job_script("x", 1, 60, "lsf")


@pytest.mark.parametrize(("system", "words"), [("slurm", "#SBATCH -t 02:00:00"), ("pbs", "#PBS -l walltime=02:00:00")])
def test_clusters_of_batch_systems(system, words):
    pytest.importorskip("dask_jobqueue")
    with batch_cluster(system, walltime="02:00:00", queue="day") as cluster:
        script = cluster.job_script()
    assert words in script
    assert "--lifetime 6480s" in script
    assert "export NUMBA_NUM_THREADS=1" in script
    with pytest.raises(CampaignError, match="write hours"):
        batch_cluster(system, walltime="2h")


def test_a_result_that_was_lost_with_its_worker_and_found_again_counts():
    """The future is not finished when it is looked at, and has no error by the time it is asked for one."""

    class Lost:
        status = "lost"

        def exception(self):
            self.status = "finished"

        def result(self):
            return "done", 7

    assert DaskRunner._end(Lost()) == ("done", 7)
