"""Many runs by one engine: jobs, a ledger that says which are done, claims that say which somebody is at work on.

Series and sweeps of cases and campaigns are carried out by `run_jobs`. A job is done if and only if the ledger has its
result, a file that appears under its final name when it is whole: whatever is killed at whatever moment, the next run
goes on from there. Claims keep two runs of the same jobs from doing the same; they save work and decide nothing.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from gearmbs.studies.run.workers import CLAIMED, DEATH, FAILURE, PROGRESS, Claimed, Work, processes

T = TypeVar("T")

POLL = 0.5
"""Seconds between looks at jobs that somebody else is at work on."""

LEASE = 1800.0
"""Seconds without a sign of life after which a claim of another machine is void."""

BEAT = LEASE / 30.0
"""Seconds between the signs of life of a job that reports progress, many to a lease: files show late elsewhere."""

WRITING = 5.0
"""Seconds for which a claim that cannot be read is taken for one that is being written."""


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
        One of `gearmbs.studies.run.workers`, or what yields the same messages.
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

    def beating(self, report: Callable[[float], None]) -> Callable[[float], None]:
        """Return a report of progress that gives a sign of life, now and then, as well."""
        last = time.monotonic()

        def both(number: float) -> None:
            nonlocal last
            if time.monotonic() - last >= BEAT:
                last = time.monotonic()
                self.beat()
            report(number)

        return both

    def beat(self) -> None:
        """Give a sign of life."""
        with contextlib.suppress(FileNotFoundError):
            os.utime(self.path)

    def release(self) -> None:
        """Give the job back."""
        self.path.unlink(missing_ok=True)


def claimed(ledger: Ledger, job: Any, work: Callable[[Claim], T]) -> T:
    """Return the result of a job that is done, else that of the work, during which the job is claimed.

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
        return work(claim) if known is None else known
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
