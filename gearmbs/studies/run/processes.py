"""Jobs side by side in processes: progress while they run, and an end at once when one fails or the user interrupts.

Only picklable jobs and results. A worker is a fresh interpreter that ignores Ctrl-C, which a terminal sends to all of
a command's processes; its parent ends it.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
GRACE = 2.0
"""Seconds a worker is given to end before it is killed."""

PROGRESS, RESULT, FAILURE, DEATH = "progress", "result", "failure", "death"
END = object()

Work = Callable[[Any, Callable[[float], None]], Any]


class WorkerDied(RuntimeError):
    """A worker ended without a word: killed, or out of memory."""


def run_jobs(
    work: Work,
    jobs: Sequence[Any],
    workers: int,
    *,
    progress: Callable[[Any, float], None] | None = None,
    done: Callable[[Any, Any], None] | None = None,
) -> list[Any]:
    """Return ``work(job, report)`` of all jobs in order.

    Parameters
    ----------
    work : callable
        A function of a module; it may call ``report(number)`` as often as it likes.
    jobs : sequence
    workers : int
    progress : callable, optional
        ``progress(job, number)`` for each report.
    done : callable, optional
        ``done(job, result)`` as soon as a job is finished.

    Raises
    ------
    WorkerDied
        If a process ended before its job.
    Exception
        The first that a job raised; the other jobs are ended.
    """
    results: dict[int, Any] = {}
    with closing(messages(work, jobs, workers)) as told:
        for number, job, kind, value in told:
            if kind == DEATH:
                raise WorkerDied(
                    "a worker process ended before its job was done. Is there enough memory? In a script of your own, "
                    "is the call under if __name__ == '__main__'?"
                )
            if kind == FAILURE:
                raise value
            if kind == RESULT:
                results[number] = value
            tell = progress if kind == PROGRESS else done
            if tell is not None:
                tell(job, value)
    return [results[k] for k in range(len(jobs))]


def messages(
    work: Work, jobs: Iterable[Any], workers: int, *, own_main: bool = True, grace: float = GRACE
) -> Generator[tuple[int, Any, str, Any], None, None]:
    """Yield what becomes of jobs in processes that live for many jobs.

    A job is taken when a worker is free for it. A worker that dies is replaced by another one when the next job is
    taken. Closing the iterator ends all workers.

    Parameters
    ----------
    work : callable
        As for `run_jobs`.
    jobs : iterable
    workers : int
        At most so many processes.
    own_main : bool
        Whether a worker imports the user's script, as it must if ``work`` or the jobs are from there.
    grace : float
        Seconds a worker is given to end.

    Yields
    ------
    number, job, kind, value
        The job's number from 0, the job, and `PROGRESS` with a number, `RESULT` with what the work returned, `FAILURE`
        with an exception, or `DEATH` with None if the process ended without a word.
    """
    context = multiprocessing.get_context("spawn")
    source = enumerate(jobs)
    processes: dict[Connection, Any] = {}
    at_work: dict[Connection, tuple[int, Any]] = {}
    idle: list[Connection] = []
    try:
        while True:
            while len(at_work) < workers and (taken := next(source, END)) is not END:
                if not idle:
                    ours, theirs = context.Pipe()
                    process = context.Process(target=_serve, args=(work, theirs), daemon=True)
                    with deaf(), one_thread(), _with_main(own_main):
                        process.start()
                    theirs.close()
                    processes[ours] = process
                    idle.append(ours)
                connection = idle.pop()
                at_work[connection] = taken  # type: ignore[assignment]
                # one that is dead already is found so below
                with suppress(ConnectionError):
                    connection.send(at_work[connection][1])
            if not at_work:
                return
            finished = set(wait(list(at_work), timeout=1.0))
            for ready in [connection for connection in at_work if connection in finished]:
                try:
                    kind, value = ready.recv()
                except (EOFError, ConnectionError):
                    kind, value = DEATH, None
                number, job = at_work[ready]
                if kind != PROGRESS:
                    del at_work[ready]
                if kind == DEATH:
                    ready.close()
                    processes.pop(ready).join(grace)
                elif kind != PROGRESS:
                    idle.append(ready)
                yield number, job, kind, value
    finally:
        _end(processes, bool(at_work), grace)


def _serve(work: Work, connection: Connection) -> None:
    """Work on the jobs that come through a pipe until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    while True:
        try:
            job = connection.recv()
        except (EOFError, ConnectionError):
            return
        try:
            message = (RESULT, work(job, lambda number: connection.send((PROGRESS, number))))
        except Exception as error:
            message = (FAILURE, _portable(error))
        try:
            connection.send(message)
        except ConnectionError:
            return


def _portable(error: Exception) -> Exception:
    """Return the error, or one with its text if it cannot go through a pipe."""
    try:
        return pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")


def _end(processes: dict[Connection, Any], at_work: bool, grace: float) -> None:
    """Close the pipes and see every worker off; with some still at work all are terminated."""
    for ours, process in processes.items():
        ours.close()
        if at_work:
            process.terminate()
    for process in processes.values():
        process.join(grace)
        if process.is_alive():
            process.kill()
            process.join()


@contextmanager
def one_thread() -> Iterator[None]:
    """Let processes that start now have one thread for everything."""
    saved = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in saved.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def deaf() -> Iterator[None]:
    """Let processes that start now be deaf to Ctrl-C, also while they import."""
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextmanager
def _with_main(own: bool) -> Iterator[None]:
    """Unless its own is wanted, keep a new process from running the user's script again."""
    main = sys.modules["__main__"]
    if not own:
        sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
