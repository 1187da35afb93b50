"""Units on the workers of a Dask cluster: on this machine, or of a batch system through dask-jobqueue.

The cluster only moves numbers of units. A worker that is lost costs its unit, a scheduler that is lost costs a new
start; what is done is in the folder.
"""

from __future__ import annotations

import itertools
import os
import shlex
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearmbs.campaigns.settings import CampaignError, whole
from gearmbs.studies.run.engine import (
    DEATH,
    FAILURE,
    ONE_THREAD,
    REFUSED,
    Message,
    Refused,
    Work,
    WorkerReplaced,
    one_thread,
    outcome,
    silent,
)

if TYPE_CHECKING:
    import distributed

# Job scripts for Slurm and PBS.


HEADS = {
    "slurm": """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{elements}
#SBATCH --time={minutes}
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --requeue
""",
    "pbs": """#!/bin/bash
#PBS -N {name}
#PBS -J 1-{elements}
#PBS -l walltime={hours:02d}:{rest:02d}:00
#PBS -l select=1:ncpus=1:mem=2gb
#PBS -r y
""",
}
VARIABLES = {"slurm": ("SLURM_TMPDIR", "SLURM_ARRAY_TASK_ID"), "pbs": ("TMPDIR", "PBS_ARRAY_INDEX")}
"""Where a system keeps the node's own disk and the number of an element."""

BODY = """
# compiled code on the node's own disk, so that nodes of different processors do not share it
export NUMBA_CACHE_DIR=${{{disk}:-/tmp}}/gearmbs-kernels
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1

gearmbs campaign work {folder} --part ${element}/{elements} --minutes {stop}
"""


def job_script(folder: str | Path, elements: int, minutes: int, system: str = "slurm") -> str:
    """Return the script of a job array whose elements work on parts of a campaign.

    Parameters
    ----------
    folder : path-like
    elements : int
        Parts.
    minutes : int
        Wall time of an element; it starts no unit in the last tenth.
    system : {"slurm", "pbs"}

    Raises
    ------
    CampaignError
        For another system, and for numbers below one.
    """
    if system not in HEADS:
        raise CampaignError(f"--system is {system!r}; choose {' or '.join(HEADS)}")
    elements, minutes = whole(elements, "--elements", 1), whole(minutes, "--minutes", 1)
    folder = Path(folder).resolve()
    stop = max(1, minutes - max(2, minutes // 10))
    disk, element = VARIABLES[system]
    given = {
        "name": folder.stem.replace(" ", "_"),
        "elements": elements,
        "folder": shlex.quote(str(folder)),
        "disk": disk,
        "element": element,
    }
    hours, rest = divmod(minutes, 60)
    return (HEADS[system] + BODY).format(**given, minutes=minutes, hours=hours, rest=rest, stop=stop)


BATCH = {"slurm": "SLURMCluster", "pbs": "PBSCluster"}
"""Clusters of dask-jobqueue by batch system."""

MOST_JOBS = 100
UNITS_A_WORKER = 3
"""Units on the way for each worker: enough to keep it at work, few enough to be given up lightly."""


class DaskRunner:
    """Works on units through a Dask client.

    Parameters
    ----------
    client : distributed.Client
        Its workers must see the campaign's folder under the same path.
    """

    def __init__(self, client: Any) -> None:
        self.client, self.refused = client, set[str]()

    def _willing(self) -> list[str]:
        """Return the workers that have not refused to work."""
        return [address for address in self.client.nthreads() if address not in self.refused]

    def _goes_on_without(self, refusal: Refused) -> bool:
        """Leave out a worker that cannot work, and say so; return whether there are others."""
        if refusal.worker not in self.refused:
            self.refused.add(refusal.worker)
            told = f"the Dask worker {refusal.worker} is left out: {refusal}"
            warnings.warn(told, WorkerReplaced, stacklevel=2)
        return bool(self._willing())

    @property
    def workers(self) -> int:
        """Threads of the cluster's workers."""
        return sum(self.client.nthreads().values()) or 1

    def __call__(self, work: Work, units: Iterable[int], _workers: int) -> Iterator[Message]:
        """Yield the messages of units as they end; see `gearmbs.studies.run.engine`.

        Raises
        ------
        CampaignError
            If the scheduler is lost.
        """
        from concurrent.futures import CancelledError

        from distributed import wait
        from distributed.comm import CommClosedError

        at_work: dict[Any, tuple[int, int]] = {}
        source, back = enumerate(units), deque[tuple[int, int]]()
        submitted = itertools.count()
        try:
            while True:
                while len(at_work) < UNITS_A_WORKER * self.workers:
                    taken = back.popleft() if back else next(source, None)
                    if taken is None:
                        break
                    key = f"unit-{taken[1]}-{os.getpid()}-{id(self)}-{next(submitted)}"
                    where = {"workers": self._willing()} if self.refused else {}
                    future = self.client.submit(_at_worker, work, taken[1], key=key, pure=False, **where)
                    at_work[future] = taken
                if not at_work:
                    return
                for future in wait(list(at_work), return_when="FIRST_COMPLETED").done:
                    unit, (kind, value) = at_work.pop(future), self._end(future)
                    future.release()
                    if kind == REFUSED and value.lasting and self._goes_on_without(value):
                        back.append(unit)
                    else:
                        yield *unit, kind, value
        except (CommClosedError, CancelledError) as error:
            # what waits for its answers is cancelled by the client that has lost the connection
            at_work.clear()
            raise CampaignError(
                "the scheduler is lost; what is done is in the folder: start another one and run again"
            ) from error
        finally:
            if at_work:
                self.client.cancel(list(at_work))

    @staticmethod
    def _end(future: Any) -> tuple[str, Any]:
        """Return kind and value of the message about a unit's end."""
        if future.status == "finished":
            return future.result()
        error = future.exception()
        if error is None:
            # its worker died with the result, and another one has found it since
            return future.result()
        # a worker that dies takes the units of its neighbours' queues with it: all are tried again
        if type(error).__name__ in ("KilledWorker", "CancelledError", "FutureCancelledError"):
            return DEATH, None
        if isinstance(error, ImportError):
            # the worker could not even read its unit
            return REFUSED, Refused(f"a Dask worker cannot work: {type(error).__name__}: {error}")
        return FAILURE, error


def _at_worker(work: Work, unit: int) -> tuple[str, Any]:
    """Return the end of a unit at a worker of Dask, with its address if it refuses."""
    from distributed import get_worker

    kind, value = outcome(work, unit, silent)
    if kind == REFUSED:
        value.worker = get_worker().address
    return kind, value


def batch_cluster(system: str, *, walltime: str = "01:00:00", memory: str = "2GB", **settings: Any) -> Any:
    """Return a cluster of a batch system whose jobs are workers of one thread; it has none yet, see its ``adapt``.

    A worker takes no further unit when nine tenths of its walltime are over, and hands back what it holds.

    Parameters
    ----------
    system : {"slurm", "pbs"}
    walltime : str
        Of a job, hours:minutes:seconds.
    memory : str
        Of a job.
    **settings
        Of dask-jobqueue's `SLURMCluster` or `PBSCluster`: queue, account, job_extra_directives, ...

    Raises
    ------
    CampaignError
        Without the package dask-jobqueue, or for a walltime of another form.
    """
    try:
        import dask_jobqueue
    except ImportError:
        raise CampaignError(
            "dask-jobqueue is not installed; install the extra: pip install 'gearmbs[cluster]'"
        ) from None
    parts = walltime.split(":")
    if len(parts) != 3 or not all(part.isdigit() for part in parts):
        raise CampaignError(f"walltime is {walltime!r}; write hours:minutes:seconds, as 01:00:00")
    seconds = sum(int(part) * size for part, size in zip(parts, (3600, 60, 1)))
    own = {
        "cores": 1,
        "processes": 1,
        "memory": memory,
        "walltime": walltime,
        "worker_extra_args": ["--lifetime", f"{int(0.9 * seconds)}s", "--lifetime-stagger", f"{seconds // 20}s"],
        # compiled code on the node's own disk, so that nodes of different processors do not share it
        "job_script_prologue": [
            "export NUMBA_CACHE_DIR=${TMPDIR:-/tmp}/gearmbs-kernels",
            *(f"export {name}={value}" for name, value in ONE_THREAD.items()),
        ],
    }
    return getattr(dask_jobqueue, BATCH[system])(**{**own, **settings})


# what a batch system takes beside is known to dask-jobqueue alone
@contextmanager
def dask_client(address: str, workers: int | None = None, **settings: Any) -> Iterator[distributed.Client]:
    """Yield a client of a scheduler.

    Parameters
    ----------
    address : str
        Of a scheduler that runs; ``"local"`` for a cluster of this machine; ``"slurm"`` or ``"pbs"`` for one whose
        workers are jobs of a batch system, as many as there is work for.
    workers : int, optional
        Of a cluster made here; the most there are of a batch system, default 100.
    **settings
        Of `batch_cluster`.

    Raises
    ------
    CampaignError
        Without the packages, or without an answer from the address.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise CampaignError("Dask is not installed; install the extra: pip install 'gearmbs[cluster]'") from None
    if address == "local":
        with (
            one_thread(),
            LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0") as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    if address in BATCH:
        with batch_cluster(address, **settings) as cluster, Client(cluster) as client:
            cluster.adapt(minimum=1, maximum=workers or MOST_JOBS)
            yield client
        return
    try:
        client = Client(address)
    except OSError as error:
        raise CampaignError(f"--dask {address}: no scheduler answers ({error})") from error
    with client:
        yield client
