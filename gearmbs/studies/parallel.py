"""Cases side by side: threads where the integrator frees them, processes where it does not."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

import xarray as xr

from gearmbs.studies.case import Case
from gearmbs.studies.limits import check_record
from gearmbs.studies.processes import run_jobs
from gearmbs.studies.simulation import run_case

REPORT_SECONDS = 0.2
"""Shortest time between two reports of a process."""


class Cancelled(RuntimeError):
    """The run was stopped because another one failed or the user interrupted."""


def available_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


def run_cases(
    cases: Sequence[Case],
    *,
    workers: int | None = None,
    progress: Callable[[str, float], None] | None = None,
    done: Callable[[Case, xr.Dataset], None] | None = None,
) -> list[xr.Dataset]:
    """Run cases in parallel and return their records in order.

    Parameters
    ----------
    cases : sequence of Case
        With different names.
    workers : int, optional
        Default: the cores available.
    progress : callable, optional
        ``progress(name, fraction)`` from time to time.
    done : callable, optional
        ``done(case, record)`` as soon as a case is finished, so that nothing computed is lost if a later one fails.

    Raises
    ------
    ValueError
        If two cases share a name, or the record of one could not be evaluated; nothing is simulated then.
    SimulationFailed
        If a case fails; the others are stopped. What was computed of it is in its ``partial()``.
    """
    names = [case.name for case in cases]
    if len(set(names)) != len(names):
        raise ValueError(f"cases: the names {names} are not all different; name each case")
    for case in cases:
        check_record(case)
    workers = max(1, min(workers or available_cores(), len(cases)))
    compiled = all(case.solver.integrator != "IDA" for case in cases)
    if workers == 1 or compiled:
        return _in_threads(cases, workers, progress, done)
    return _in_processes(cases, workers, progress, done)


def _span(case: Case) -> float:
    """Simulated time of a case up to the end of its record, s."""
    return case.operation.run_up + case.operation.settling + case.operation.duration


def _cost(case: Case) -> float:
    """Expected time of a case, in no particular unit: a second slice costs a tenth of the first."""
    return _span(case) * (9.0 + case.pair().face_slices)


def _in_threads(cases, workers, progress, done) -> list[xr.Dataset]:
    stop = threading.Event()

    def one(case: Case) -> xr.Dataset:
        def report(t: float) -> None:
            if stop.is_set():
                raise Cancelled(f"case '{case.name}' was stopped")
            if progress is not None:
                progress(case.name, min(t / _span(case), 1.0))

        return run_case(case, report)

    records: dict[str, xr.Dataset] = {}
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
                    records[case.name] = future.result()
                    _finished(case, records[case.name], progress, done)
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [records[case.name] for case in cases]


def _in_processes(cases, workers, progress, done) -> list[xr.Dataset]:
    return run_jobs(
        _run_reporting,
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


def _finished(case: Case, record: xr.Dataset, progress, done) -> None:
    if progress is not None:
        progress(case.name, 1.0)
    if done is not None:
        done(case, record)
