"""Where jobs are worked on: here, in threads of this process, or in processes of this machine.

Each is a generator ``(work, jobs, workers)`` of *messages* ``(number, job, kind, value)``: the job's number from 0 in
the order in which jobs were taken, the job, and `PROGRESS` with a number, `RESULT` with what ``work(job, report)``
returned, `CLAIMED` with None if somebody else is at work on the job, `FAILURE` with an exception, or `DEATH` with None
if what worked on it ended without a word. A job is taken when a worker is free for it; closing the generator ends all
workers.

A worker process is a fresh interpreter that ignores Ctrl-C, which a terminal sends to all of a command's processes; its
parent ends it. Its work, jobs and results are picklable.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
GRACE = 5.0
"""Seconds a worker process is given to end before it is killed."""

REPORT_SECONDS = 0.2
"""Shortest time between two reports of a job."""

PROGRESS, RESULT, CLAIMED, FAILURE, DEATH = "progress", "result", "claimed", "failure", "death"
END = object()

Work = Callable[[Any, Callable[[float], None]], Any]
Message = tuple[int, Any, str, Any]


class Claimed(Exception):
    """Somebody else is at work on the job."""


class Cancelled(RuntimeError):
    """The run was stopped because another one failed or the user interrupted."""


def outcome(work: Work, job: Any, report: Callable[[float], None]) -> tuple[str, Any]:
    """Work on a job, whose reports go on now and then; return the kind and the value of the message about its end."""
    last = -REPORT_SECONDS

    def seldom(fraction: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= REPORT_SECONDS:
            last = now
            report(fraction)

    try:
        return RESULT, work(job, seldom)
    except Claimed:
        return CLAIMED, None
    except Exception as error:
        return FAILURE, error


def silent(_fraction: float) -> None:
    """Report no progress."""


def here(work: Work, jobs: Iterable[Any], workers: int = 1) -> Iterator[Message]:
    """Yield the messages of jobs that are worked on one after the other, here, without progress."""
    for number, job in enumerate(jobs):
        yield number, job, *outcome(work, job, silent)


def threads(work: Work, jobs: Iterable[Any], workers: int) -> Iterator[Message]:
    """Yield the messages of jobs in threads; a job that reports progress is stopped at its next report by the end."""
    told: queue.SimpleQueue[Message] = queue.SimpleQueue()
    stop = threading.Event()

    def one(number: int, job: Any) -> None:
        def report(fraction: float) -> None:
            if stop.is_set():
                raise Cancelled("the job was stopped")
            told.put((number, job, PROGRESS, fraction))

        found: tuple[str, Any] = (DEATH, None)
        try:
            found = outcome(work, job, report)
        finally:
            told.put((number, job, *found))

    source = enumerate(jobs)
    at_work = 0
    pool = ThreadPoolExecutor(workers)
    try:
        while True:
            while at_work < workers and (taken := next(source, END)) is not END:
                pool.submit(one, *taken)  # type: ignore[misc]
                at_work += 1
            if not at_work:
                return
            try:
                # without an end it would be deaf to Ctrl-C on some systems
                message = told.get(timeout=1.0)
            except queue.Empty:
                continue
            at_work -= message[2] != PROGRESS
            yield message
    finally:
        stop.set()
        pool.shutdown(wait=False, cancel_futures=True)


def processes(work: Work, jobs: Iterable[Any], workers: int, *, own_main: bool = True) -> Iterator[Message]:
    """Yield the messages of jobs in processes that live for many jobs; one that dies is replaced for the next job.

    Parameters
    ----------
    work : callable
        A function of a module.
    jobs : iterable
    workers : int
        At most so many processes.
    own_main : bool
        Whether a worker imports the user's script, as it must if ``work`` or the jobs are from there.
    """
    context = multiprocessing.get_context("spawn")
    source = enumerate(jobs)
    started: dict[Connection, Any] = {}
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
                    started[ours] = process
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
                    started.pop(ready).join(GRACE)
                elif kind != PROGRESS:
                    idle.append(ready)
                yield number, job, kind, value
    finally:
        _end(started, bool(at_work))


def _serve(work: Work, connection: Connection) -> None:
    """Work on the jobs that come through a pipe until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    while True:
        try:
            job = connection.recv()
        except (EOFError, ConnectionError):
            return
        except Exception as error:
            kind, value = (
                FAILURE,
                RuntimeError(
                    f"a job cannot be read in its worker process ({type(error).__name__}: {error}); what it is made of "
                    "must be in modules that can be imported there"
                ),
            )
        else:
            kind, value = outcome(work, job, lambda number: connection.send((PROGRESS, number)))
        try:
            connection.send((kind, _portable(value) if kind == FAILURE else value))
        except ConnectionError:
            return
        except Exception as error:
            cause = RuntimeError(
                f"the result of {job!r}, of type {type(value).__name__}, cannot be sent from its worker process "
                f"({type(error).__name__}: {error}); return what can be pickled, or run in threads"
            )
            connection.send((FAILURE, cause))


def _portable(error: Exception) -> Exception:
    """Return the error, or one with its text if it cannot go through a pipe."""
    try:
        return pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")


def _end(started: dict[Connection, Any], at_work: bool) -> None:
    """Close the pipes and see every worker off; with some still at work all are terminated."""
    for ours, process in started.items():
        ours.close()
        if at_work:
            process.terminate()
    for process in started.values():
        process.join(GRACE)
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
