"""A campaign: a plan, the folder it is carried out in, and what came of it."""

from __future__ import annotations

import os
import random
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, nullcontext
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from gearmbs.campaigns.folder import Folder, extend_folder, make_folder
from gearmbs.campaigns.plans.plan import Plan
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, limit, local, whole
from gearmbs.campaigns.status import CampaignStatus, read_status
from gearmbs.campaigns.stored.checks import check_folder, litter
from gearmbs.progress import alone, bars, watched
from gearmbs.schema.described import chosen
from gearmbs.studies.run.claims import owner, told
from gearmbs.system import cores

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.campaigns.sensitivity import SobolIndices
    from gearmbs.campaigns.stored.exports import ExportKeywords
    from gearmbs.campaigns.surrogates import PolynomialChaos, ResponseSurface
    from gearmbs.view.figures.style import Picture

OTHER_CODE = ("refuse", "mix", "again")
"""What may become of units that other code has done."""

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
        if not (plan is None or isinstance(plan, Plan)):
            raise CampaignError(
                f"plan = {plan!r:.60}; give what make_plan or load_plan returns, or nothing to open a campaign"
            )
        self._folder = Folder(path) if plan is None else make_folder(path, plan)

    @property
    def folder(self) -> Folder:
        """What is in the folder, as it is now: others may have extended or packed it since it was opened."""
        if self._folder.changed:
            self._folder = Folder(self.path)
        return self._folder

    @property
    def path(self) -> Path:
        """The folder."""
        return self._folder.path

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
        other_code: str = "refuse",
        page: bool | str | Path = False,
    ) -> CampaignStatus:
        """Work on what is not done yet, until all is; what is damaged is done again.

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
        other_code : {"refuse", "mix", "again"}
            What becomes of it if results so far come from other code, versions or another kind of processor: refuse to
            work, go on all the same, or do those units again.
        page : bool or path-like
            Write every five seconds how it stands to this file of HTML, which a browser shows and refreshes: counts,
            pace, remaining time, failures by cause, who is at work. True: ``page.html`` in the folder.

        Raises
        ------
        OSError
            If the disk is full. What is done stays, and another run goes on.
        CampaignError
            If results so far come from other code; if workers die again and again over the same unit, or no worker can
            work, with the reason; or with ``on_failure="stop"`` at the first failed case.
        """
        from gearmbs.campaigns.cluster import DaskRunner
        from gearmbs.studies.run.engine import here, processes

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
        return self._drive(where, workers or cores(), None, progress, minutes, other_code, page)

    def work(
        self, part: int, parts: int, *, minutes: float | None = None, other_code: str = "refuse"
    ) -> CampaignStatus:
        """Work here on one part of the units: an element of a job array, without any coordination.

        Parameters
        ----------
        part, parts : int
            Part 1 to parts.
        minutes : float, optional
            Start no unit after so long.
        other_code : {"refuse", "mix", "again"}
            See `run`.
        """
        from gearmbs.studies.run.engine import here

        if not 1 <= whole(part, "part", 0) <= whole(parts, "parts", 1):
            raise CampaignError(f"part {part} of {parts}: give a part from 1 to {parts}")
        mine = range(part - 1, self.folder.unit_count, parts)
        return self._drive(here, 1, mine, False, minutes, other_code)

    def _drive(
        self,
        where: Any,
        workers: int,
        mine: Iterable[int] | None,
        progress: Any,
        minutes: Any,
        other_code: str,
        page: bool | str | Path = False,
    ) -> CampaignStatus:
        from gearmbs.campaigns.page import LivePage
        from gearmbs.campaigns.work import end_guards, work_unit
        from gearmbs.studies.run.engine import Refused, WorkerDied, run_jobs

        minutes = _of_minutes(minutes)
        self._heal(mine)
        self._compare(chosen(OTHER_CODE, other_code, "", CampaignError, "other_code"))
        done = set(self.folder.done())
        units = [unit for unit in (range(self.folder.unit_count) if mine is None else mine) if unit not in done]
        # drivers side by side begin at different ends, so that they rarely want the same unit
        offset = random.Random(os.getpid()).randrange(len(units)) if _driven(self.folder, units) else 0
        live = (
            LivePage(lambda: self.folder, self.path / "page.html" if page is True else local(page))
            if page
            else nullcontext()
        )
        try:
            with live, _shown(progress, self.folder.path.name, self.status) as tell:
                run_jobs(
                    partial(work_unit, os.path.abspath(self.path), other_code == "mix"),
                    units[offset:] + units[:offset],
                    workers,
                    where=where,
                    done=lambda _unit, _done: tell(),
                    ledger=self.folder,
                    tries=MOST_TRIES,
                    seconds=None if minutes is None else 60.0 * minutes,
                    waiting=_say_who,
                )
        except WorkerDied as died:
            raise CampaignError(
                f"unit {died.job}: its worker died {MOST_TRIES} times, also with its cases in processes of their own; "
                f"is there enough memory for {self.folder.unit_size} results?"
            ) from died
        except Refused as refused:
            raise CampaignError(f"{refused}; what is done is in the folder") from refused
        finally:
            end_guards()
        return self.status()

    def _heal(self, units: Iterable[int] | None) -> None:
        """Put right what is damaged, and say what."""
        for line in check_folder(self.folder, units, sweep=True):
            warnings.warn(f"{self.path}: {line}; it is put right", CampaignWarning, stacklevel=4)

    def _compare(self, other_code: str) -> None:
        """Compare this process's code with that of the results so far, before anything is worked on."""
        from gearmbs.campaigns.codes import admit, folder_code
        from gearmbs.studies.run.code import CodeChanged, code_of

        try:
            code = folder_code(self.folder, code_of)
        except CodeChanged as error:
            raise CampaignError(f"{self.path}: {error}; start the program again") from error
        except ImportError as error:
            raise CampaignError(
                f"{self.path}: {error}; what the plan names has to be there, installed or on the PYTHONPATH"
            ) from error
        if other_code == "again":
            for unit in self.folder.done():
                if self.folder.entry(unit)["code"] != code.digest:
                    self.folder.ledger(unit).unlink(missing_ok=True)
        # what nobody has come to an end with decides nothing
        fresh = not self.folder.done() and not _driven(self.folder, [0])
        admit(self.folder, code, mix=other_code == "mix", again=fresh or other_code == "again")

    def status(self) -> CampaignStatus:
        """Return how far it is; from anywhere, at any time."""
        return read_status(self.folder)

    def extend(self, n: int) -> Campaign:
        """Draw further points up to n, keep what is there; `run` then works on the new ones."""
        self._folder = extend_folder(self.folder, n)
        return self

    def pack(self, unit: int | None = None) -> Campaign:
        """Store what is done in fewer, larger units: the same results in fewer files.

        Former files go last, when what was written has been read back; a kill at any moment leaves the one or the
        other whole.

        Parameters
        ----------
        unit : int, optional
            Cases of a unit, a multiple of what they are now; default the most that units have where a plan does not
            say: 1024, or 64 MB of signals.

        Raises
        ------
        CampaignError
            If not all is done or something is damaged, results come from several codes, or units are as large already.
        """
        from gearmbs.campaigns.stored.packing import pack_folder

        self._folder = pack_folder(self.folder, unit)
        return self

    @property
    def table(self) -> pd.DataFrame:
        """One row a finished case: the plan's columns, ``id``, ``status``, ``message``, ``advice`` and what is kept."""
        return self.read()

    def read(self, columns: Sequence[str] | None = None, where: str | None = None) -> pd.DataFrame:
        """Return some columns of the table, of the cases for which a condition holds; see `table`.

        Parameters
        ----------
        columns : sequence of str, optional
            Names; default all. Others are not read: of a million cases three columns take some seconds.
        where : str, optional
            A condition such as ``"status == 'done' and orders.line_of_action.2 > 30"``, as constraints are written.
            Rows of the cases that fit have the numbers of these cases as their index.

        Raises
        ------
        CampaignError
            If nothing is finished, there is no such column, or what is stored is damaged, with the unit.
        """
        from gearmbs.campaigns.results import read_table

        return read_table(self.folder, columns, where)

    def failed(self) -> pd.DataFrame:
        """Return the rows of the cases that failed, each with its message and what to do about it."""
        from gearmbs.campaigns.results import read_table

        failed = [unit for unit in self.folder.done() if self.folder.entry(unit)["failed"]]
        return read_table(self.folder, where="status != 'done'", units=failed)

    def record(self, index: int) -> xr.Dataset:
        """Return the whole record of a case, or of a failed one what it had computed, if the plan keeps records.

        Raises
        ------
        CampaignError
            If there is none, or it is not as the ledger says.
        """
        from gearmbs.campaigns.results import read_record

        return read_record(self.folder, self._unit_of(index), index)

    def open(self) -> xr.Dataset:
        """Return everything along ``case`` as one Dataset; signals are read when they are asked for."""
        from gearmbs.campaigns.results import open_dataset

        return open_dataset(self.folder)

    # of which kind the answer is follows from the design, which a type does not say
    def sensitivity(self, result: str) -> SobolIndices | PolynomialChaos | pd.DataFrame:
        """Return what decides a result, by the design; see `gearmbs.campaigns.sensitivity.sensitivity`."""
        from gearmbs.campaigns.sensitivity import sensitivity

        return sensitivity(self, result)

    def response_surface(self, result: str, degree: int = 2) -> ResponseSurface:
        """Return a polynomial of a result over the factors, with its error at points left out."""
        from gearmbs.campaigns.surrogates import response_surface

        return response_surface(self, result, degree)

    def export(self, target: str | Path, format: str = "parquet", **settings: Unpack[ExportKeywords]) -> list[Path]:
        """Write the campaign as CSV, NetCDF, MATLAB or parquet; see `gearmbs.campaigns.stored.exports.export`."""
        from gearmbs.campaigns.stored.exports import export

        return export(self, target, format, **settings)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns of factors and results that have one."""
        from gearmbs.campaigns.results import column_units

        return column_units(self.folder)

    def figure(
        self,
        kind: str = "main effects",
        results: str | Sequence[str] | None = None,
        factors: str | Sequence[str] | None = None,
    ) -> Picture:
        """Draw results over factors.

        Parameters
        ----------
        kind : {"main effects", "tornado", "scatter matrix", "parallel coordinates"}
            Means of the results over the values of each factor; those at both ends of each, the strongest on top; every
            column over every other; each case as a line through all columns, coloured by the first result.
        results : str or sequence of str, optional
            Columns; default the three that vary most, each for what the others do not tell.
        factors : str or sequence of str, optional
            Columns; default all that vary and that every case has.

        Raises
        ------
        CampaignError
            For an unknown kind or column, with the nearest ones.
        """
        from gearmbs.campaigns.figures import figure

        return figure(self, kind, results, factors)

    def report(self, path: str | Path, results: str | Sequence[str] | None = None) -> Path:
        """Write one HTML page with plan, results, what decides them, and failures.

        Parameters
        ----------
        path : path-like
        results : str or sequence of str, optional
            Columns to look at; default those that vary most, each for what the others do not tell.
        """
        from gearmbs.campaigns.report import write_report

        return write_report(self, path, results)

    # what it is follows from the subject of the plan, which a campaign that is opened reads from its folder
    def case(self, index: int) -> Any:
        """Return the thing that a case simulates, made again from the plan."""
        unit = self._unit_of(index)
        row = next(row for row in self.folder.cases(unit) if row["index"] == index)
        return self.plan.subject.check(self.plan.data(row), f"case {index}")

    def _unit_of(self, index: int) -> int:
        index = whole(index, "case", 0)
        for extent in self.folder.extents:
            if extent.first <= index < extent.last:
                return extent.first_unit + (index - extent.first) // self.folder.unit_size
        raise CampaignError(f"case {index}: there are cases 0 to {self.folder.case_count - 1}")

    def check(self, *, sweep: bool = False) -> list[str]:
        """Hold what is stored against the ledgers; return what is wrong, and what is left lying about.

        Parameters
        ----------
        sweep : bool
            Remove the litter of killed workers, and ledgers whose data are damaged, so that `run` does them again.
        """
        from gearmbs.campaigns.codes import code_counts, known_code

        found = check_folder(self.folder, sweep=sweep)
        counts = code_counts(self.folder).most_common()
        if len(counts) > 1:
            most = known_code(self.folder, counts[0][0])
            for digest, units in counts[1:]:
                other = known_code(self.folder, digest)
                told = "another code" if most is None else most.differences(other)
                found.append(f"code: {units} of {sum(n for _, n in counts)} units by another one: {told}")
        return [*found, *litter(self.folder, sweep=sweep)]

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
    return bool(folder.entry(unit)["failed"])


def _say_who(others: list[tuple[int, dict[str, Any]]]) -> None:
    """Say for whom a run waits."""
    first = "; ".join(f"unit {unit}: {told(who)}" for unit, who in others[:3])
    more = f"; and {len(others) - 3} more" if len(others) > 3 else ""
    warnings.warn(f"nothing is left but what others are at work on: {first}{more}", CampaignWarning, stacklevel=2)


def _driven(folder: Folder, units: list[int]) -> bool:
    """Whether somebody is at work on some of the units."""
    return bool(units) and any(owner(claim) for claim in (folder.store / "units").glob("*.claim"))


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
