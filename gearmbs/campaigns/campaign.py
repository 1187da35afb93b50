"""A campaign: a plan, the folder it is carried out in, what came of it, and its report as one HTML page."""

from __future__ import annotations

import base64
import html
import io
import os
import random
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearmbs.campaigns.factors import Factor
from gearmbs.campaigns.folder import Folder, check_folder, extend_folder, litter, make_folder
from gearmbs.campaigns.plan import Plan
from gearmbs.campaigns.results import factor_names, result_names
from gearmbs.campaigns.sensitivity import SobolIndices, sensitivity
from gearmbs.campaigns.settings import CampaignError, CampaignWarning, limit, whole
from gearmbs.campaigns.sobol_bounds import first_indices, probability
from gearmbs.campaigns.status import CampaignStatus, read_status
from gearmbs.campaigns.surrogates import PolynomialChaos
from gearmbs.files import write_whole
from gearmbs.progress import alone, bars, watched
from gearmbs.schema.described import chosen
from gearmbs.studies.run.claims import owner, told

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearmbs.campaigns.surrogates import ResponseSurface

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
        other_code: str = "refuse",
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
        return self._drive(where, workers or available_cores(), None, progress, minutes, other_code)

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
        self, where: Any, workers: int, mine: Iterable[int] | None, progress: Any, minutes: Any, other_code: str
    ) -> CampaignStatus:
        from gearmbs.campaigns.work import work_unit
        from gearmbs.studies.run.engine import Refused, WorkerDied, run_jobs

        minutes = _of_minutes(minutes)
        self._heal(mine)
        self._compare(chosen(OTHER_CODE, other_code, "", CampaignError, "other_code"))
        done = set(self.folder.done())
        units = [unit for unit in (range(self.folder.unit_count) if mine is None else mine) if unit not in done]
        # drivers side by side begin at different ends, so that they rarely want the same unit
        offset = random.Random(os.getpid()).randrange(len(units)) if _driven(self.folder, units) else 0
        try:
            with _shown(progress, self.folder.path.name, self.status) as tell:
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
        return self.status()

    def _heal(self, units: Iterable[int] | None) -> None:
        """Put right what is damaged, and say what."""
        for line in check_folder(self.folder, units, sweep=True):
            warnings.warn(f"{self.path}: {line}; it is put right", CampaignWarning, stacklevel=4)

    def _compare(self, other_code: str) -> None:
        """Compare this process's code with that of the results so far, before anything is worked on."""
        from gearmbs.campaigns.codes import admit, plan_modules
        from gearmbs.studies.run.code import code_of

        code = code_of(plan_modules(self.folder))
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
        self.folder = extend_folder(self.folder, n)
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
            A condition such as ``"status == 'done' and operation.torque > 100"``, as constraints are written; where a
            name holds blanks or the like, underscores stand for them.

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
        pass

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
    return bool(units) and any(owner(claim) for claim in (folder.path / "units").glob("*.claim"))


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


STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:1em 0;font-size:14px}td,th{border-bottom:1px solid #ddd;padding:3px
10px;text-align:right}
td:first-child,th:first-child{text-align:left}img{max-width:100%}h2{margin-top:2em}small{color:#666}"""
MOST_RESULTS = 4
SHOWN_FAILURES = 50


def write_report(campaign: Campaign, path: str | Path, results: list[str] | None = None) -> Path:
    """Write the report of a campaign.

    Parameters
    ----------
    path : path-like
    results : list of str, optional
        Columns to look at; default the first few that vary.
    """
    table = campaign.table
    known = result_names(campaign.folder, table)
    if results is None:
        results = [name for name in known if table[name].std() > 0.0][:MOST_RESULTS]
    for name in results:
        if name not in known:
            raise CampaignError(f"report: result {name!r} is unknown; known are {', '.join(known[:12])} ...")
    parts = [f"<h1>{html.escape(campaign.path.name)}</h1>", _plan(campaign)]
    for name in results:
        parts += [f"<h2>{html.escape(name)}</h2>", _numbers(table[name]), _scatter(campaign, table, name)]
        parts.append(_decides(campaign, name))
    parts.append(_failures(campaign))
    head = f"<meta charset='utf-8'><title>{html.escape(campaign.path.name)}</title><style>{STYLE}</style>"
    return write_whole(path, f"<!doctype html><html><head>{head}</head><body>{''.join(parts)}</body></html>\n")


def _plan(campaign: Campaign) -> str:
    plan, status = campaign.plan, campaign.status()
    units = _units(campaign)
    spans = ((f.name, f"{_span(f)} {units.get(f.name, '')}".strip()) for f in plan.factors)
    rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{html.escape(span)}</td></tr>" for name, span in spans)
    about = (
        f"<p>{html.escape(plan.subject.kind)}, {html.escape(plan.design)} design, seed {plan.seed}. "
        f"{html.escape(str(status))}. "
        f"{status.processor_seconds:.4g} s of processor time.</p>"
    )
    return f"{about}<table><tr><th>factor</th><th>range</th></tr>{rows}</table>"


def _units(campaign: Campaign) -> dict[str, str]:
    """Return the SI units of the columns of those factors that have one."""
    plan = campaign.plan
    units = {f.name: plan.subject.unit_of(f.path) for f in plan.factors if isinstance(f, Factor)}
    return {name: unit for name, unit in units.items() if unit not in ("1", "dimensionless")}


def _span(factor: Any) -> str:
    if getattr(factor, "values", ()):
        return ", ".join(str(v) for v in factor.values)
    if hasattr(factor, "low"):
        return f"{factor.low:.5g} to {factor.high:.5g}" + (", logarithmic" if factor.scale == "log" else "")
    return ", ".join(factor.options) if hasattr(factor, "options") else f"{factor.draws} specimens"


def _numbers(values: pd.Series) -> str:
    q = values.quantile([0.0, 0.05, 0.5, 0.95, 1.0])
    cells = "".join(f"<td>{v:.5g}</td>" for v in (values.mean(), values.std(), *q))
    heads = "".join(f"<th>{n}</th>" for n in ("mean", "deviation", "least", "5 %", "median", "95 %", "largest"))
    return f"<table><tr>{heads}</tr><tr>{cells}</tr></table>"


def _scatter(campaign: Campaign, table: pd.DataFrame, result: str) -> str:
    """Return a picture of the result over each factor."""
    from gearmbs.view.figures.style import new_figure

    names = [n for n in factor_names(campaign.folder) if not n.endswith("severity")][:8]
    rows = -(-len(names) // 4)
    figure, units = new_figure(10.0, 2.6 * rows), _units(campaign)
    for k, name in enumerate(names):
        ax = figure.add_subplot(rows, min(4, len(names)), k + 1)
        x = table[name]
        if x.dtype.kind in "fi":
            ax.plot(x, table[result], ".", ms=3, alpha=0.5)
        else:
            levels = sorted(x.astype(str).unique())
            ax.boxplot([table[result][x.astype(str) == level].dropna() for level in levels], tick_labels=levels)
        ax.set_xlabel(f"{name}, {units[name]}" if name in units else name, fontsize=8)
        ax.tick_params(labelsize=7)
    return _picture(figure, f"{result} over the factors")


def _decides(campaign: Campaign, result: str) -> str:
    """Return what decides the result, where the design tells, else a response surface."""
    try:
        found = sensitivity(campaign, result)
    except CampaignError:
        return _at_hand(campaign, result) + _surface(campaign, result)
    if isinstance(found, PolynomialChaos):
        note = (
            f"<p><small>A sum of polynomials of degree {found.degrees.sum(axis=1).max()}; of points left out it "
            f"explains {found.q_squared:.1%} of the variance.</small></p>"
        )
        heading = "<h3>Sobol' indices from a polynomial chaos</h3>"
        return _at_hand(campaign, result) + heading + _table(found.table()) + note + _surface(campaign, result)
    if isinstance(found, SobolIndices):
        if campaign.plan.design == "grid":
            return "<h3>Parts of the grid's variance</h3>" + _table(found.table()[["first", "total"]])
        note = f"<p><small>{found.base_points} base points, {found.left_out} left out for want of results; "
        note += f"control variates explain {found.explained:.1%} of the variance of points left out.</small></p>"
        return "<h3>Sobol' indices</h3>" + _table(found.table()) + note
    if campaign.plan.design == "one at a time":
        return "<h3>One factor after the other</h3>" + _table(found)
    return "<h3>Effects</h3>" + _table(found.head(20))


def _at_hand(campaign: Campaign, result: str) -> str:
    """Return first indices from the points at hand, and for a condition how probable it is."""
    table = campaign.table
    values = table[result].to_numpy(dtype=float)
    text = ""
    if set(np.unique(values[np.isfinite(values)])) <= {0.0, 1.0}:
        p, low, high = probability(values)
        text = f"<p>Holds in {p:.1%} of the points (95 % interval {low:.1%} to {high:.1%}).</p>"
    found = first_indices({name: table[name].to_numpy() for name in factor_names(campaign.folder)}, values)
    return f"{text}<h3>First Sobol' indices from the points at hand</h3>" + _table(found)


def _surface(campaign: Campaign, result: str) -> str:
    from gearmbs.campaigns.surrogates import response_surface

    for degree in (2, 1):
        try:
            surface = response_surface(campaign, result, degree)
        except CampaignError:
            continue
        table = surface.table()
        table = table.reindex(table["coefficient"].abs().sort_values(ascending=False).index).head(12)
        note = (
            f"<p>R<sup>2</sup> = {surface.r_squared:.3f}, of points left out {surface.q_squared:.3f}, RMS error there "
            f"{surface.error:.3g}.</p>"
        )
        return f"<h3>Response surface of degree {degree}, factors from -1 to 1</h3>{note}" + _table(table)
    return ""


def _failures(campaign: Campaign) -> str:
    failed = campaign.failed()
    if failed.empty:
        return "<h2>Failures</h2><p>none</p>"
    shown = failed[["index", "status", "message", "advice"]].head(SHOWN_FAILURES)
    rows = "".join("<tr>" + "".join(f"<td>{html.escape(str(v))}</td>" for v in row) + "</tr>" for row in shown.values)
    return f"<h2>Failures</h2><p>{len(failed)} cases</p><table>{rows}</table>"


def _table(table: pd.DataFrame) -> str:
    index = ", ".join(str(name) for name in table.index.names)
    heads = "".join(f"<th>{html.escape(str(c))}</th>" for c in (index, *table.columns))
    rows = "".join(
        f"<tr><td>{html.escape(_label(name))}</td>" + "".join(f"<td>{v:.4g}</td>" for v in row) + "</tr>"
        for name, row in zip(table.index, np.asarray(table, dtype=float))
    )
    return f"<table><tr>{heads}</tr>{rows}</table>"


def _label(name: Any) -> str:
    parts = name if isinstance(name, tuple) else (name,)
    return ", ".join(f"{part:.5g}" if isinstance(part, float) else str(part) for part in parts)


def _picture(figure: Any, text: str) -> str:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f"<img alt='{html.escape(text)}' src='data:image/png;base64,{data}'>"
