"""A campaign: a plan, the folder it is carried out in, and what came of it."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearmbs.campaigns.folder import CampaignStatus, Folder, extend_folder, make_folder, read_status
from gearmbs.campaigns.plan import Plan
from gearmbs.campaigns.settings import CampaignError, limit, whole
from gearmbs.progress import alone, bars, watched

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.campaigns.surrogates import ResponseSurface

MOST_TRIES = 8
"""Attempts of a unit that end with a worker's death, after which the run gives up."""


class Campaign:
    """Many cases in a folder, which is queue, memory and result at once.

    Parameters
    ----------
    path : path-like
        Folder of the campaign.
    plan : Plan, optional
        Makes the folder; without it the campaign there is opened. A folder with the same plan is taken up again.

    Raises
    ------
    CampaignError
        If there is no campaign, another one, or if a corner of the plan is impossible.

    Examples
    --------
    >>> plan = make_plan(Case(), [Factor("operation.torque", 50.0, 200.0)], n=128)  # doctest: +SKIP
    >>> campaign = Campaign("torque.campaign", plan)  # doctest: +SKIP
    >>> campaign.run(workers=2)  # doctest: +SKIP
    >>> campaign.table["orders.line_of_action.1"].describe()  # doctest: +SKIP
    """

    def __init__(self, path: str | Path, plan: Plan | None = None) -> None:
        _needed()
        self.folder = Folder(path) if plan is None else make_folder(path, plan)

    @property
    def path(self) -> Path:
        """The folder."""
        return self.folder.path

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.folder.plan

    def __repr__(self) -> str:
        return f"Campaign({str(self.path)!r}): {self.status()}"

    def run(
        self,
        workers: int | None = None,
        *,
        client: Any = None,
        progress: bool | Callable[[CampaignStatus], None] | None = None,
        minutes: float | None = None,
    ) -> CampaignStatus:
        """Work on what is not done yet, until all is.

        Parameters
        ----------
        workers : int, optional
            Processes of this machine; default the cores. 0: in this process.
        client : distributed.Client, optional
            Work on its cluster instead.
        progress : bool or callable, optional
            A bar, see `gearmbs.progress`, or ``progress(status)`` after every unit.
        minutes : float, optional
            Start no unit after so long.

        Raises
        ------
        OSError
            If the disk is full. What is done stays, and another run goes on.
        CampaignError
            If workers die again and again over the same unit, or with ``on_failure="stop"`` at the first failed case.
        """
        from gearmbs.campaigns.cluster import DaskRunner
        from gearmbs.studies.run.engine import here, processes
        from gearmbs.studies.run.parallel import available_cores

        where: Any
        if workers is not None:
            workers = whole(workers, "workers", 0)
        if client is not None:
            if not hasattr(client, "nthreads"):
                raise CampaignError(f"client = {client!r}; give a distributed.Client, see dask_client")
            where = DaskRunner(client)
        else:
            # workers need modules only, which they import by name
            where = here if workers == 0 else partial(processes, own_main=False)
        return self._drive(where, workers or available_cores(), self._pending(), progress, minutes)

    def work(self, part: int, parts: int, *, minutes: float | None = None) -> CampaignStatus:
        """Work here on one part of the units: an element of a job array, without any coordination.

        Parameters
        ----------
        part, parts : int
            Part 1 to parts.
        minutes : float, optional
            Start no unit after so long.
        """
        from gearmbs.studies.run.engine import here

        if not 1 <= whole(part, "part", 0) <= whole(parts, "parts", 1):
            raise CampaignError(f"part {part} of {parts}: give a part from 1 to {parts}")
        mine = [unit for unit in self._pending() if unit % parts == part - 1]
        return self._drive(here, 1, mine, False, minutes)

    def _pending(self) -> list[int]:
        done = set(self.folder.done())
        return [unit for unit in range(self.folder.unit_count) if unit not in done]

    def _drive(self, where: Any, workers: int, units: list[int], progress: Any, minutes: Any) -> CampaignStatus:
        from gearmbs.campaigns.work import work_unit
        from gearmbs.studies.run.engine import WorkerDied, run_jobs

        minutes = _of_minutes(minutes)
        # drivers side by side begin at different ends, so that they rarely want the same unit
        offset = random.Random(os.getpid()).randrange(len(units)) if _driven(self.folder, units) else 0
        try:
            with _shown(progress, self.folder.path.name, self.status) as tell:
                run_jobs(
                    partial(work_unit, os.path.abspath(self.path)),
                    units[offset:] + units[:offset],
                    workers,
                    where=where,
                    done=lambda _unit, _done: tell(),
                    ledger=self.folder,
                    tries=MOST_TRIES,
                    seconds=None if minutes is None else 60.0 * minutes,
                )
        except WorkerDied as died:
            raise CampaignError(
                f"unit {died.job}: its worker died {MOST_TRIES} times, also with its cases in processes of their own; "
                f"is there enough memory for {self.plan.unit} results?"
            ) from died
        return self.status()

    def status(self) -> CampaignStatus:
        """Return how far it is; from anywhere, at any time."""
        return read_status(self.folder)

    def extend(self, n: int) -> Campaign:
        """Draw further points up to n, keep what is there; `run` then works on the new ones."""
        self.folder = extend_folder(self.folder, n)
        return self

    @property
    def table(self) -> pd.DataFrame:
        """One row a finished case: the plan's columns, ``id``, ``status``, ``message``, ``advice`` and what is kept."""
        from gearmbs.campaigns.results import read_table

        return read_table(self.folder)

    def failed(self) -> pd.DataFrame:
        """Return the rows of the cases that failed, each with its message and what to do about it."""
        table = self.table
        return table[table["status"] != "done"].reset_index(drop=True)

    def open(self) -> xr.Dataset:
        """Return everything along ``case`` as one Dataset; signals are read when they are asked for."""
        from gearmbs.campaigns.results import open_dataset

        return open_dataset(self.folder)

    def sensitivity(self, result: str) -> Any:
        """Return what decides a result, by the design; see `gearmbs.campaigns.sensitivity.sensitivity`."""
        from gearmbs.campaigns.sensitivity import sensitivity

        return sensitivity(self, result)

    def response_surface(self, result: str, degree: int = 2) -> ResponseSurface:
        """Return a polynomial of a result over the factors, with its error at points left out."""
        from gearmbs.campaigns.surrogates import response_surface

        return response_surface(self, result, degree)

    def export(self, target: str | Path, format: str = "parquet", **settings: Any) -> list[Path]:
        """Write the campaign as CSV, NetCDF, MATLAB or parquet; see `gearmbs.campaigns.results.export`."""
        from gearmbs.campaigns.results import export

        return export(self, target, format, **settings)

    def report(self, path: str | Path, results: list[str] | None = None) -> Path:
        """Write one HTML page with plan, results, what decides them, and failures."""
        from gearmbs.campaigns.report import write_report

        return write_report(self, path, results)

    def case(self, index: int) -> Any:
        """Return the thing that a case simulates, made again from the plan."""
        unit = self._unit_of(index)
        row = next(row for row in self.folder.cases(unit) if row["index"] == index)
        return self.plan.subject.check(self.plan.data(row), f"case {index}")

    def _unit_of(self, index: int) -> int:
        index = whole(index, "case", 0)
        for extent in self.folder.extents:
            if extent.first <= index < extent.last:
                return extent.first_unit + (index - extent.first) // self.plan.unit
        raise CampaignError(f"case {index}: there are cases 0 to {self.folder.case_count - 1}")

    def check(self, *, sweep: bool = False) -> list[str]:
        """Hold what is stored against the ledgers; return what is wrong, and what is left lying about.

        Parameters
        ----------
        sweep : bool
            Remove the litter of killed workers, and ledgers whose data are damaged, so that `run` does them again.
        """
        from gearmbs.campaigns.folder import check_folder

        return check_folder(self.folder, sweep=sweep)

    def retry(self) -> int:
        """Take failed cases' units out of the ledger, so that `run` does them again; return how many units."""
        again = [unit for unit in self.folder.done() if _has_failures(self.folder, unit)]
        for unit in again:
            self.folder.ledger(unit).unlink(missing_ok=True)
        return len(again)


def _of_minutes(minutes: float | None) -> float | None:
    if minutes is None:
        return None
    if isinstance(minutes, str):
        minutes = limit(minutes, "minutes", "55 min") / 60.0
    if not minutes >= 0.0:
        raise CampaignError(f"minutes = {minutes!r}; give the minutes after which no unit is started")
    return minutes


def _has_failures(folder: Folder, unit: int) -> bool:
    from gearmbs.campaigns.folder import read_ledger

    entry = read_ledger(folder.ledger(unit))
    return bool(entry and entry["failed"])


def _driven(folder: Folder, units: list[int]) -> bool:
    """Whether somebody is at work on some of the units."""
    return bool(units) and any((folder.path / "units").glob("*.claim"))


class _shown:
    """A bar on a terminal or in a notebook, or calls of a function, about once a second."""

    def __init__(self, progress: Any, name: str, status: Callable[[], CampaignStatus]) -> None:
        self._progress, self._name, self._status, self._last = progress, name, status, -1e9
        self._around = ExitStack()
        self._tell: Callable[[CampaignStatus], Any] | None = None

    def __enter__(self) -> Callable[[], None]:
        if callable(self._progress):
            self._tell = self._progress
        elif self._progress is True and watched() != "notebook":
            self._tell = self._status_bar()
        else:
            move = self._around.enter_context(bars(self._progress, [self._name]))
            self._tell = None if move is None else lambda status: move(self._name, status.fraction)
        self._look(force=True)
        return self._look

    def _status_bar(self) -> Callable[[CampaignStatus], None]:
        """Open a bar with the campaign's status beside it."""
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (BarColumn(), TextColumn("{task.percentage:>3.0f} %  {task.description}"), TimeElapsedColumn())
        self._around.enter_context(alone())
        bar = self._around.enter_context(Progress(*columns, console=Console(stderr=True), refresh_per_second=2))
        task = bar.add_task("", total=1.0)
        return lambda status: bar.update(task, completed=status.fraction, description=str(status))

    def _look(self, force: bool = False) -> None:
        # reading many ledgers is not free
        if self._tell is None or (not force and time.monotonic() - self._last < 1.0):
            return
        self._last = time.monotonic()
        self._tell(self._status())

    def __exit__(self, *_error: object) -> None:
        self._look(force=True)
        self._around.close()


def _needed() -> None:
    """Say what to install if it is missing; looked for, not imported, since it is not always used."""
    missing = [name for name in ("pyarrow", "zarr") if find_spec(name) is None]
    if missing:
        raise CampaignError(
            f"campaigns need {' and '.join(missing)}; install the extra: pip install 'gearmbs[campaigns]', "
            "in a checkout pip install '.[campaigns]'"
        )
