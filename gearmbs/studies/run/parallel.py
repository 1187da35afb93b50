"""Cases side by side: threads where the integrator frees them, processes where it does not."""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, Literal

import xarray as xr

from gearmbs.dae.methods import INTEGRATORS
from gearmbs.progress import bars
from gearmbs.studies.case.case import Case, CaseError
from gearmbs.studies.case.limits import check_record
from gearmbs.studies.run.processes import run_jobs
from gearmbs.studies.run.simulation import SimulationFailed, SimulationInterrupted, run_case
from gearmbs.studies.run.store import check_place, file_stem, keep_dataset, record_size, stored_record

REPORT_SECONDS = 0.2
"""Shortest time between two reports of a process."""


class StorageWarning(UserWarning):
    """A record could not be written where it was wanted; the message says where it is."""


class Cancelled(RuntimeError):
    """The run was stopped because another one failed or the user interrupted."""


def available_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def run_cases(
    cases: Sequence[Case],
    *,
    workers: int | None = None,
    progress: bool | Callable[[str, float], None] | None = None,
    done: Callable[[Case, xr.Dataset], None] | None = None,
    folder: str | Path | None = None,
    errors: Literal["raise", "keep"] = "raise",
) -> list[Any]:
    """Run cases in parallel and return their records in order.

    Parameters
    ----------
    cases : sequence of Case
        With different names.
    workers : int, optional
        Default: the cores available.
    progress : bool or callable, optional
        Bars, see `gearmbs.progress`; a callable is told ``progress(name, fraction)`` from time to time.
    done : callable, optional
        ``done(case, record)`` as soon as a case is finished, so that nothing computed is lost if a later one fails.
    folder : path, optional
        Records are written there as they come, ``<name>.nc``, and taken up again: what an interrupted call has
        finished is not computed twice. A record counts if every setting of its case and the version are the same.
    errors : {"raise", "keep"}
        What becomes of a case that fails: "raise" stops the others, "keep" puts the error in the place of its record.

    Returns
    -------
    list of Dataset
        With ``errors="keep"`` the `SimulationFailed` or `CaseError` of cases that failed, in their places.

    Raises
    ------
    ValueError
        If two cases share a name, or the record of one could not be evaluated; nothing is simulated then.
    SimulationFailed
        If a case fails; the others are stopped. What was computed of it is in its ``partial()``.
    OSError
        If the folder cannot be written or has not the room; nothing is simulated then.
    """
    if errors not in ("raise", "keep"):
        raise ValueError(f"errors: {errors!r} is unknown; choose raise or keep")
    names = [case.name for case in cases]
    if len(set(names)) != len(names):
        raise ValueError(f"cases: the names {names} are not all different; name each case")
    found: dict[str, Any] = {}
    for case in cases:
        try:
            check_record(case)
        except CaseError as error:
            if errors == "raise":
                raise
            found[case.name] = error
    if folder is not None:
        found |= _taken_up([case for case in cases if case.name not in found], folder)
        done = _storing(Path(folder), done)
    left = [case for case in cases if case.name not in found]
    with bars(progress, names) as move:
        for name in found if move is not None else ():
            move(name, 1.0)
        workers = max(1, min(workers or available_cores(), len(left)))
        compiled = all(INTEGRATORS[case.solver.integrator].compiled for case in left)
        run = _in_threads if workers == 1 or compiled else _in_processes
        found |= zip((case.name for case in left), run(left, workers, move, done, errors == "keep"), strict=True)
    return [found[name] for name in names]


def _taken_up(cases: Sequence[Case], folder: str | Path) -> dict[str, xr.Dataset]:
    """Return the records that a folder holds already, and see that there is room for the others."""
    found = {case.name: record for case in cases if (record := stored_record(folder, case)) is not None}
    needed = sum(record_size(case) for case in cases if case.name not in found)
    check_place(folder, needed, f"the study of {len(cases) - len(found)} records")
    return found


def _storing(folder: Path, done: Callable | None) -> Callable[[Case, xr.Dataset], None]:
    """Return what is done with a finished case: its record is written, elsewhere if need be, and handed on."""

    def store(case: Case, record: xr.Dataset) -> None:
        try:
            keep_dataset(folder / f"{file_stem(case.name)}.nc", record)
        except OSError as error:
            # the record is in memory all the same, and other cases are not to blame
            warnings.warn(str(error), StorageWarning, stacklevel=2)
        if done is not None:
            done(case, record)

    return store


def _span(case: Case) -> float:
    """Simulated time of a case up to the end of its record, s."""
    return case.operation.run_up + case.operation.settling + case.operation.duration


def _cost(case: Case) -> float:
    """Expected time of a case, in no particular unit: a second slice costs a tenth of the first."""
    return _span(case) * (9.0 + case.pair().face_slices)


def _in_threads(cases, workers, progress, done, keep) -> list[Any]:
    stop = threading.Event()

    def one(case: Case) -> xr.Dataset:
        def report(t: float) -> None:
            if stop.is_set():
                raise Cancelled(f"case '{case.name}' was stopped")
            if progress is not None:
                progress(case.name, min(t / _span(case), 1.0))

        return run_case(case, report)

    records: dict[str, Any] = {}
    # side by side the longest first, or the last one would keep the others waiting
    order = cases if workers == 1 else sorted(cases, key=_cost, reverse=True)
    with ThreadPoolExecutor(workers) as pool:
        futures = {pool.submit(one, case): case for case in order}
        pending = set(futures)
        try:
            while pending:
                finished, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in finished:
                    case = futures[future]
                    try:
                        records[case.name] = future.result()
                    except SimulationFailed as failure:
                        if not keep or isinstance(failure, SimulationInterrupted):
                            raise
                        records[case.name] = failure
                    _finished(case, records[case.name], progress, done)
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [records[case.name] for case in cases]


def _in_processes(cases, workers, progress, done, keep) -> list[Any]:
    return run_jobs(
        _run_keeping if keep else _run_reporting,
        cases,
        workers,
        progress=None if progress is None else lambda case, fraction: progress(case.name, fraction),
        done=lambda case, record: _finished(case, record, progress, done),
    )


def _run_reporting(case: Case, report: Callable[[float], None]) -> xr.Dataset:
    """Run a case and report the fraction of it that is done, not too often."""
    last = -REPORT_SECONDS

    def progress(t: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= REPORT_SECONDS:
            last = now
            report(min(t / _span(case), 1.0))

    return run_case(case, progress)


def _run_keeping(case: Case, report: Callable[[float], None]) -> Any:
    """Run a case and return its record, or the failure."""
    try:
        return _run_reporting(case, report)
    except SimulationFailed as failure:
        return failure


def _finished(case: Case, record: Any, progress, done) -> None:
    if progress is not None:
        progress(case.name, 1.0)
    if done is not None and not isinstance(record, SimulationFailed):
        done(case, record)
