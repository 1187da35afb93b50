"""Cases side by side: threads where the integrator frees them, processes where it does not."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait

import xarray as xr

from gearmbs.studies.case import Case
from gearmbs.studies.run import run_case

ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


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
        ``progress(name, fraction)`` from time to time; only at the end of each case when it runs in a process.
    done : callable, optional
        ``done(case, record)`` as soon as a case is finished, so that nothing computed is lost if a later one fails.

    Raises
    ------
    ValueError
        If two cases share a name.
    SimulationFailed
        If a case fails; the others are stopped.
    """
    names = [case.name for case in cases]
    if len(set(names)) != len(names):
        raise ValueError(f"cases: the names {names} are not all different; name each case")
    workers = max(1, min(workers or available_cores(), len(cases)))
    compiled = all(case.solver.integrator != "IDA" for case in cases)
    if workers == 1 or compiled:
        return _in_threads(cases, workers, progress, done)
    return _in_processes(cases, workers, progress, done)


def _in_threads(cases, workers, progress, done) -> list[xr.Dataset]:
    stop = threading.Event()

    def one(case: Case) -> xr.Dataset:
        operation = case.operation
        span = operation.run_up + operation.settling + operation.duration

        def report(t: float) -> None:
            if stop.is_set():
                raise Cancelled(f"case '{case.name}' was stopped")
            if progress is not None:
                progress(case.name, min(t / span, 1.0))

        return run_case(case, report)

    with ThreadPoolExecutor(workers) as pool:
        try:
            return _collect(pool, {pool.submit(one, case): case for case in cases}, cases, progress, done)
        except BaseException:
            stop.set()
            raise


def _in_processes(cases, workers, progress, done) -> list[xr.Dataset]:
    saved = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
            try:
                return _collect(pool, {pool.submit(run_case, case): case for case in cases}, cases, progress, done)
            except BaseException:
                for process in list((pool._processes or {}).values()):
                    process.terminate()
                raise
    finally:
        for name, value in saved.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _collect(pool: Executor, futures: dict[Future, Case], cases, progress, done) -> list[xr.Dataset]:
    records: dict[str, xr.Dataset] = {}
    pending = set(futures)
    try:
        while pending:
            finished, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            for future in finished:
                case = futures[future]
                records[case.name] = future.result()
                if progress is not None:
                    progress(case.name, 1.0)
                if done is not None:
                    done(case, records[case.name])
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    return [records[case.name] for case in cases]
