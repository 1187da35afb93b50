"""Units on the workers of a Dask cluster: on this machine, or of a batch system through dask-jobqueue.

The cluster only moves numbers of units and small reports. A worker that is lost costs its unit, a scheduler that is
lost
costs a new start; what is done is in the folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.runners.processes import ONE_THREAD
from gearmbs.campaigns.work import DIED, UnitReport, work_unit

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
        self.client = client

    @property
    def workers(self) -> int:
        """Threads of the cluster's workers."""
        return sum(self.client.nthreads().values()) or 1

    def __call__(self, path: str, units: Iterator[int]) -> Iterator[UnitReport]:
        """Yield the reports of units as they end.

        Raises
        ------
        CampaignError
            If the scheduler is lost.
        """
        from distributed import wait
        from distributed.comm import CommClosedError

        path = os.path.abspath(path)
        at_work: dict[Any, int] = {}
        serial = 0
        try:
            while True:
                while len(at_work) < UNITS_A_WORKER * self.workers:
                    unit = next(units, None)
                    if unit is None:
                        break
                    serial += 1
                    key = f"unit-{unit}-{os.getpid()}-{id(self)}-{serial}"
                    at_work[self.client.submit(work_unit, path, unit, key=key, pure=False)] = unit
                if not at_work:
                    return
                for future in wait(list(at_work), return_when="FIRST_COMPLETED").done:
                    unit = at_work.pop(future)
                    yield self._report(future, unit)
                    future.release()
        except CommClosedError as error:
            at_work.clear()
            raise CampaignError(
                "the scheduler is lost; what is done is in the folder: start another one and run again"
            ) from error
        finally:
            if at_work:
                self.client.cancel(list(at_work))

    @staticmethod
    def _report(future: Any, unit: int) -> UnitReport:
        if future.status == "finished":
            return future.result()
        error = future.exception()
        # a worker that dies takes the units of its neighbours' queues with it: all are tried again
        if type(error).__name__ in ("KilledWorker", "CancelledError", "FutureCancelledError"):
            return UnitReport(unit, DIED, message=str(error))
        raise error


@contextmanager
def dask_client(address: str, workers: int | None = None) -> Iterator[Any]:
    """Yield a client of a scheduler by its address, or of a cluster of this machine for ``"local"``.

    Raises
    ------
    CampaignError
        Without the package distributed, or without an answer from the address.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise CampaignError("Dask is not installed; install the extra: pip install 'gearmbs[cluster]'") from None
    if address == "local":
        saved = {name: os.environ.get(name) for name in ONE_THREAD}
        os.environ.update(ONE_THREAD)
        try:
            with (
                LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
                Client(cluster) as client,
            ):
                yield client
        finally:
            for name, value in saved.items():
                if value is None:
                    os.environ.pop(name, None)
        return
    try:
        client = Client(address)
    except OSError as error:
        raise CampaignError(f"--dask {address}: no scheduler answers ({error})") from error
    with client:
        yield client
