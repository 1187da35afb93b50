"""Many runs by one engine: jobs, a ledger that says which are done, claims that say which somebody is at work on.

Series and sweeps of cases and campaigns are carried out by `run_jobs`. A job is done if and only if the ledger has its
result, a file that appears under its final name when it is whole: whatever is killed at whatever moment, the next run
goes on from there. Claims keep two runs of the same jobs from doing the same; they save work and decide nothing.

Where jobs are worked on, here, in threads of this process or in processes of this machine, is a generator ``(work,
jobs, workers)`` of *messages* ``(number, job, kind, value)``: the job's number from 0 in the order in which jobs were
taken, the job, and `PROGRESS` with a number, `RESULT` with what ``work(job, report)`` returned, `CLAIMED` with None if
somebody else is at work on the job, `FAILURE` with an exception, or `DEATH` with None if what worked on it ended
without a word. A job is taken when a worker is free for it; closing the generator ends all workers.

A worker process is a fresh interpreter that ignores Ctrl-C, which a terminal sends to all of a command's processes; its
parent ends it. Its work, jobs and results are picklable.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import pickle
import queue
import signal
import socket
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol, TypeVar

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
GRACE = 5.0
"""Seconds a worker process is given to end before it is killed."""

REPORT_SECONDS = 0.2
"""Shortest time between two reports of a job."""

PROGRESS, RESULT, CLAIMED, FAILURE, DEATH = "progress", "result", "claimed", "failure", "death"
END = object()

Work = Callable[[Any, Callable[[float], None]], Any]
Message = tuple[int, Any, str, Any]

T = TypeVar("T")

POLL = 0.5
"""Seconds between looks at jobs that somebody else is at work on."""

LEASE = 1800.0
"""Seconds without a sign of life after which a claim of another machine is void."""

BEAT = LEASE / 30.0
"""Seconds between the signs of life of a job, many to a lease: files show late elsewhere."""

WRITING = 5.0
"""Seconds for which a claim that cannot be read is taken for one that is being written."""


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


# The engine: jobs, their ledger, claims on them.


class WorkerDied(RuntimeError):
    """A worker ended without a word: killed, or out of memory.

    Attributes
    ----------
    job : object
        What it was at work on.
    """

    def __init__(self, message: str, job: Any = None) -> None:
        super().__init__(message)
        self.job = job


class Results(list[Any]):
    """Results of jobs, in order.

    Attributes
    ----------
    left : list
        The jobs that have none, since the time was up.
    """

    def __init__(self, results: Iterable[Any] = (), left: Iterable[Any] = ()) -> None:
        super().__init__(results)
        self.left = list(left)


class Ledger(Protocol):
    """What is known of jobs, by their files."""

    def result(self, job: Any) -> Any:
        """Return what is stored of a job that is done, None of any other."""

    def claim(self, job: Any) -> Path:
        """Return the path of a job's claim."""


def run_jobs(
    work: Work,
    jobs: Sequence[Any],
    workers: int = 1,
    *,
    where: Callable[[Work, Iterable[Any], int], Any] = processes,
    progress: Callable[[Any, float], None] | None = None,
    done: Callable[[Any, Any], None] | None = None,
    ledger: Ledger | None = None,
    tries: int = 1,
    seconds: float | None = None,
) -> Results:
    """Return ``work(job, report)`` of all jobs in order.

    Parameters
    ----------
    work : callable
        It may call ``report(number)`` as often as it likes, and is `claimed` where there is a ledger.
    jobs : sequence
    workers : int
    where : callable
        One of `gearmbs.studies.run.engine`, or what yields the same messages.
    progress : callable, optional
        ``progress(job, number)`` for each report.
    done : callable, optional
        ``done(job, result)`` as soon as a job is finished.
    ledger : Ledger, optional
        Where others enter what they do of the same jobs.
    tries : int
        A job whose worker has died so often ends the run.
    seconds : float, optional
        Start no job after so long; those that were not started are left out of the results and are their ``left``.

    Raises
    ------
    WorkerDied
    Exception
        The first that a job raised; the other jobs are ended.
    """
    results: dict[int, Any] = {}
    deaths: Counter[int] = Counter()
    queue, elsewhere = deque(range(len(jobs))), deque[int]()
    end = float("inf") if seconds is None else time.monotonic() + seconds

    def finish(k: int, value: Any) -> None:
        results[k] = value
        if done is not None:
            done(jobs[k], value)

    while (queue or elsewhere) and time.monotonic() < end:
        taken: list[int] = []

        def ahead(taken: list[int] = taken) -> Iterator[Any]:
            while queue and time.monotonic() < end:
                taken.append(queue.popleft())
                yield jobs[taken[-1]]

        # it ends when there is nothing to take; what came back meanwhile is taken up by the next round
        with closing(where(work, ahead(), workers)) as messages:
            for number, job, kind, value in messages:
                k = taken[number]
                if kind == PROGRESS:
                    if progress is not None:
                        progress(job, value)
                elif kind == FAILURE:
                    raise value
                elif kind == CLAIMED:
                    elsewhere.append(k)
                elif kind == DEATH:
                    deaths[k] += 1
                    if deaths[k] == tries:
                        raise WorkerDied(
                            "a worker process ended before its job was done. Is there enough memory? In a script of "
                            "your own, is the call under if __name__ == '__main__'?",
                            job,
                        )
                    queue.append(k)
                else:
                    finish(k, value)
        if elsewhere and not queue:
            assert ledger is not None
            time.sleep(POLL)
            for _ in range(len(elsewhere)):
                k = elsewhere.popleft()
                if (known := ledger.result(jobs[k])) is not None:
                    finish(k, known)
                else:
                    (elsewhere if owner(ledger.claim(jobs[k])) else queue).append(k)
    return Results((results[k] for k in sorted(results)), [job for k, job in enumerate(jobs) if k not in results])


@dataclass(frozen=True)
class Claim:
    """Who works on a job, and how often it was tried before."""

    path: Path
    attempts: int

    @contextmanager
    def beating(self) -> Iterator[None]:
        """Give signs of life from a thread of its own, for as long as the process lives: a job may report nothing."""
        over = threading.Event()

        def beats() -> None:
            while not over.wait(BEAT):
                self.beat()

        thread = threading.Thread(target=beats, name="signs of life", daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def beat(self) -> None:
        """Give a sign of life; a disk that does not take it now may take the next one."""
        with suppress(OSError):
            os.utime(self.path)

    def release(self) -> None:
        """Give the job back."""
        self.path.unlink(missing_ok=True)


def claimed(ledger: Ledger, job: Any, work: Callable[[Claim], T]) -> T:
    """Return the result of a job that is done, else that of the work, during which the job is claimed, however long.

    Raises
    ------
    Claimed
        If somebody else is at work on it.
    """
    claim = take(ledger.claim(job))
    if claim is None:
        raise Claimed
    try:
        known = ledger.result(job)
        if known is not None:
            return known
        with claim.beating():
            return work(claim)
    finally:
        claim.release()


def take(path: Path) -> Claim | None:
    """Claim a job; None if somebody is at work on it.

    A claim whose process has died, or that has shown no sign of life for `LEASE`, is taken over, and the attempts
    counted.
    """
    if os.name == "nt":
        # signal 0, which tells whether a process lives, is Ctrl-C there
        return Claim(path, 0)
    me = {"host": socket.gethostname(), "pid": os.getpid(), "started": _started(os.getpid())}
    attempts = 0
    for _ in range(3):
        try:
            handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
        except FileExistsError:
            old = _read(path)
            if old is None:
                # being written, or taken away, at this moment; or cut short by a kill
                if time.time() - _age_mark(path) < WRITING:
                    return None
                old = {}
            if old and _alive(old, path):
                return None
            attempts = max(attempts, int(old.get("attempts", 0)) + 1)
            path.unlink(missing_ok=True)
            continue
        with os.fdopen(handle, "w") as file:
            json.dump({**me, "attempts": attempts}, file)
        return Claim(path, attempts)
    return None


def owner(path: Path) -> dict[str, Any] | None:
    """Return who has claimed a job and is alive, or None."""
    old = _read(path)
    return old if old and _alive(old, path) else None


def _read(path: Path) -> dict[str, Any] | None:
    try:
        claim = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return claim if isinstance(claim, dict) and {"host", "pid", "started"} <= claim.keys() else None


def _age_mark(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return time.time()


def _alive(claim: dict[str, Any], path: Path) -> bool:
    if claim.get("host") == socket.gethostname():
        started = _started(int(claim["pid"]))
        return started is not None and started == claim.get("started")
    return time.time() - _age_mark(path) < LEASE


def _started(pid: int) -> str | None:
    """Return when a process of this machine began, in its own units; None if there is none."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        if Path("/proc/self/stat").exists():
            return None
        try:
            os.kill(pid, 0)
        except OSError:
            return None
        return "unknown"
    return None if fields[0] == "Z" else fields[19]
