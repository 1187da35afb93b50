"""Jobs side by side in processes: progress while they run, and an end at once when one fails or the user interrupts.

Only picklable jobs and results. A worker is a fresh interpreter that ignores Ctrl-C, which a terminal sends to all of
a command's processes; its parent ends it.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from typing import Any

ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
GRACE = 2.0
"""Seconds a worker is given to end before it is killed."""

PROGRESS, RESULT, FAILURE = "progress", "result", "failure"


class WorkerDied(RuntimeError):
    """A worker ended without a word: killed, or out of memory."""


def run_jobs(
    work: Callable[[Any, Callable[[float], None]], Any],
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
    context = multiprocessing.get_context("spawn")
    results: dict[int, Any] = {}
    waiting = list(range(len(jobs)))[::-1]
    at_work: dict[Connection, int] = {}
    processes = []
    complete = False
    try:
        with _inherited_settings():
            for _ in range(min(workers, len(jobs))):
                ours, theirs = context.Pipe()
                process = context.Process(target=_serve, args=(work, theirs), daemon=True)
                process.start()
                theirs.close()
                processes.append((process, ours))
        for _, ours in processes:
            at_work[ours] = waiting.pop()
            ours.send(jobs[at_work[ours]])
        while at_work:
            finished = set(wait(list(at_work), timeout=1.0))
            for ready in [connection for connection in at_work if connection in finished]:
                index = at_work[ready]
                try:
                    kind, value = ready.recv()
                except (EOFError, ConnectionError):
                    raise WorkerDied(
                        "a worker process ended before its job was done. Is there enough memory? In a script of your "
                        "own, is the call under if __name__ == '__main__'?"
                    ) from None
                if kind == FAILURE:
                    raise value
                if kind == PROGRESS:
                    if progress is not None:
                        progress(jobs[index], value)
                    continue
                results[index] = value
                del at_work[ready]
                if waiting:
                    at_work[ready] = waiting.pop()
                    ready.send(jobs[at_work[ready]])
                if done is not None:
                    done(jobs[index], value)
        complete = True
    finally:
        _end(processes, complete)
    return [results[k] for k in range(len(jobs))]


def _serve(work: Callable, connection: Connection) -> None:
    """Work on the jobs that come through a pipe until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    while True:
        try:
            job = connection.recv()
        except EOFError:
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


def _end(processes: list, complete: bool) -> None:
    """Close the pipes and see every worker off; without ``complete`` those still at work are terminated."""
    for process, ours in processes:
        ours.close()
        if not complete:
            process.terminate()
    for process, _ in processes:
        process.join(GRACE)
        if process.is_alive():
            process.kill()
            process.join()


@contextmanager
def _inherited_settings() -> Iterator[None]:
    """Let workers start with one thread for linear algebra and deaf to Ctrl-C, also while they import."""
    saved = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    main = threading.current_thread() is threading.main_thread()
    mask = None
    if main and hasattr(signal, "pthread_sigmask"):
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for name, value in saved.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
