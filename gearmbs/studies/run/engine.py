"""Many runs by one engine: jobs, a ledger that says which are done, claims that say which somebody is at work on.

Series and sweeps of cases and campaigns are carried out by `run_jobs`. A job is done if and only if the ledger has its
result, a file that appears under its final name when it is whole: whatever is killed at whatever moment, the next run
goes on from there. Claims keep two runs of the same jobs from doing the same; they save work and decide nothing.

Where jobs are worked on, here, in threads of this process or in processes of this machine, is a generator ``(work,
jobs, workers)`` of *messages* ``(number, job, kind, value)``: the job's number from 0 in the order in which jobs were
taken, the job, and `PROGRESS` with a number, `RESULT` with what ``work(job, report)`` returned, `CLAIMED` with None if
somebody else is at work on the job, `FAILURE` with an exception, `REFUSED` with a `Refused` if the worker's
surroundings do not allow it, or `DEATH` with None if what worked on it ended without a word, or stood still and was
ended. A job is taken when a worker is free for it; closing the generator ends all workers.

A worker process is a fresh interpreter that ignores Ctrl-C, which a terminal sends to all of a command's processes; its
parent ends it. Its work, jobs and results are picklable.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import queue
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

from gearmbs.logs import logger
from gearmbs.studies.run.claims import STOPPED, Claimed, Ledger, owner, vacant
from gearmbs.system import deaf, leave_interrupts_to_parent, process_of, spent
from gearmbs.wording import warn

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
GRACE = 5.0
"""Seconds a worker process is given to end before it is killed."""

REPORT_SECONDS = 0.2
"""Shortest time between two reports of a job."""

PROGRESS, RESULT, CLAIMED, FAILURE, DEATH, REFUSED = "progress", "result", "claimed", "failure", "death", "refused"
ALIVE = "alive"
ENDS = {RESULT: "done", CLAIMED: "claimed elsewhere", FAILURE: "failed", DEATH: "process ended", REFUSED: "refused"}
"""What is logged of the end of a job."""

LOG = logger("studies")
END = object()

Work = Callable[[Any, Callable[[float], None]], Any]
Message = tuple[int, Any, str, Any]

POLL = 0.5
"""Seconds between looks at jobs that somebody else is at work on."""

NOTICE = 10.0
"""Seconds for which a run waits for others before it says for whom."""

HEARD, QUIET = 5.0, 60.0
"""Seconds between the signs of life of a worker process, and without any, nor any processor time, after which it is
taken for stuck: compiled code may keep the interpreter for itself, but then it computes."""

REFUSALS = 3
"""Times that workers may refuse a job, after which the run ends with the reason."""


class Refused(RuntimeError):
    """A worker cannot do a job for a reason of its own surroundings: the job is given back.

    Attributes
    ----------
    lasting : bool
        Whether this worker would refuse every job, as for a module that it lacks.
    worker : str
        Its address, where it has one.
    """

    def __init__(self, message: str, lasting: bool = False) -> None:
        super().__init__(message, lasting)
        self.lasting, self.worker = lasting, ""

    def __str__(self) -> str:
        return str(self.args[0])


class WorkerReplaced(UserWarning):
    """A worker stood still and was replaced, or refuses to work; the message says which one and why."""


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
    except Refused as error:
        return REFUSED, error
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
    sent: queue.SimpleQueue[Message] = queue.SimpleQueue()
    stop = threading.Event()

    def one(number: int, job: Any) -> None:
        def report(fraction: float) -> None:
            if stop.is_set():
                raise Cancelled("the job was stopped")
            sent.put((number, job, PROGRESS, fraction))

        found: tuple[str, Any] = (DEATH, None)
        try:
            found = outcome(work, job, report)
        finally:
            sent.put((number, job, *found))

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
                message = sent.get(timeout=1.0)
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
    watch = _Watch()
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
                    LOG.debug("worker process %s started", process.pid)
                    idle.append(ours)
                connection = idle.pop()
                at_work[connection] = taken  # type: ignore[assignment]
                # one that is dead already is found so below
                with suppress(ConnectionError):
                    connection.send(at_work[connection][1])
            if not at_work:
                return
            finished = set(wait(list(at_work), timeout=1.0))
            stuck = watch.stuck({c: started[c].pid for c in at_work}, finished)
            for connection in stuck:
                sent = f"worker process {started[connection].pid} stood still, it is ended and its job done by another"
                warn(sent, WorkerReplaced)
                started[connection].kill()
            for ready in [connection for connection in at_work if connection in {*finished, *stuck}]:
                try:
                    # a process that waits for a file server does not even end when it is killed
                    kind, value = (DEATH, None) if ready in stuck else ready.recv()
                except (EOFError, ConnectionError):
                    kind, value = DEATH, None
                if kind == ALIVE:
                    continue
                number, job = at_work[ready]
                if kind != PROGRESS:
                    del at_work[ready]
                if kind in (DEATH, REFUSED):
                    # another process may find what this one lacks
                    ready.close()
                    started.pop(ready).join(GRACE)
                elif kind != PROGRESS:
                    idle.append(ready)
                yield number, job, kind, value
    finally:
        _end(started, bool(at_work))


class _Watch:
    """Looks whether worker processes stand still: stopped, or silent without using the processor."""

    def __init__(self) -> None:
        self._quiet: dict[Connection, tuple[float, float | None]] = {}
        self._last = time.monotonic()

    def stuck(self, pids: dict[Connection, int], heard: set[Any]) -> list[Connection]:
        """Return those that stand still, of those at work."""
        # a look may be late because this process stood still itself
        passed, self._last = min(time.monotonic() - self._last, 2.0), time.monotonic()
        found = []
        for connection, pid in pids.items():
            seconds, before = self._quiet.get(connection, (0.0, None))
            now = spent(pid)
            moves = connection in heard or (now is not None and now != before)
            seconds = 0.0 if moves else seconds + passed
            self._quiet[connection] = seconds, now
            if seconds > (STOPPED if process_of(pid)[1] == "T" else QUIET):
                found.append(connection)
        self._quiet = {connection: self._quiet[connection] for connection in pids}
        return found


def _serve(work: Work, connection: Connection) -> None:
    """Work on the jobs that come through a pipe until it is closed."""
    leave_interrupts_to_parent()
    sending = threading.Lock()

    def send(message: Any) -> None:
        with sending:
            connection.send(message)

    busy = threading.Event()

    def beats() -> None:
        with suppress(OSError):
            while busy.wait():
                time.sleep(HEARD)
                if busy.is_set():
                    send((ALIVE, None))

    threading.Thread(target=beats, name="signs of life", daemon=True).start()
    while True:
        try:
            busy.clear()
            job = connection.recv()
            busy.set()
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
            kind, value = outcome(work, job, lambda number: send((PROGRESS, number)))
        try:
            send((kind, _portable(value) if kind == FAILURE else value))
        except ConnectionError:
            return
        except Exception as error:
            cause = RuntimeError(
                f"the result of {job!r}, of type {type(value).__name__}, cannot be sent from its worker process "
                f"({type(error).__name__}: {error}); return what can be pickled, or run in threads"
            )
            send((FAILURE, cause))


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


class _Run:
    """What has become of the jobs of one run: which wait, which others are at, and results by their numbers."""

    def __init__(self, jobs: Sequence[Any], done: Callable[[Any, Any], None] | None, tries: int) -> None:
        self.jobs, self.done, self.tries = jobs, done, tries
        self.queue, self.elsewhere = deque(range(len(jobs))), deque[int]()
        self.results: dict[int, Any] = {}
        self.begun: dict[int, float] = {}
        self.deaths: Counter[int] = Counter()
        self.refusals: Counter[int] = Counter()

    def ahead(self, taken: list[int], end: float) -> Iterator[Any]:
        """Yield the jobs that wait, while there is time, and note their numbers in ``taken``."""
        while self.queue and time.monotonic() < end:
            taken.append(self.queue.popleft())
            self.begun[taken[-1]] = time.monotonic()
            yield self.jobs[taken[-1]]

    def finish(self, k: int, value: Any) -> None:
        """Keep the result of a job."""
        self.results[k] = value
        if self.done is not None:
            self.done(self.jobs[k], value)

    def note(self, k: int, kind: str, value: Any) -> None:
        """Take what a worker says of a job: its result, or why there is none; raise what ends the run."""
        name = getattr(self.jobs[k], "name", self.jobs[k])
        seconds = time.monotonic() - self.begun.pop(k, time.monotonic())
        LOG.info(
            "%s: %s after %.1f s%s", name, ENDS[kind], seconds, f" ({value})" if kind in (FAILURE, REFUSED) else ""
        )
        if kind == FAILURE:
            raise value
        if kind == CLAIMED:
            self.elsewhere.append(k)
        elif kind == REFUSED:
            self.refusals[k] += 1
            if self.refusals[k] == REFUSALS:
                raise value
            # what a file server has lost for a moment may be there again
            time.sleep(0.1 * 4.0 ** (self.refusals[k] - 1))
            self.queue.append(k)
        elif kind == DEATH:
            self.deaths[k] += 1
            if self.deaths[k] == self.tries:
                raise WorkerDied(
                    "a worker process ended before its job was done. Is there enough memory? In a script of "
                    "your own, is the call under if __name__ == '__main__'?",
                    self.jobs[k],
                )
            self.queue.append(k)
        else:
            self.finish(k, value)

    def look_up(self, ledger: Ledger) -> None:
        """Take the results that others have entered; a job whose claim is void waits again."""
        for _ in range(len(self.elsewhere)):
            k = self.elsewhere.popleft()
            if (known := ledger.result(self.jobs[k])) is not None:
                self.finish(k, known)
            else:
                (self.queue if vacant(ledger.claim(self.jobs[k])) else self.elsewhere).append(k)


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
    waiting: Callable[[list[tuple[Any, dict[str, Any]]]], None] | None = None,
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
    waiting : callable, optional
        ``waiting([(job, owner), ...])`` where nothing but the work of others is left, after `NOTICE` seconds and ever
        more rarely; see `gearmbs.studies.run.claims.owner`.

    Raises
    ------
    WorkerDied
    Refused
        If workers refused a job again and again.
    Exception
        The first that a job raised; the other jobs are ended.
    """
    run = _Run(jobs, done, tries)
    begun, patience = time.monotonic(), NOTICE
    end = float("inf") if seconds is None else begun + seconds
    while (run.queue or run.elsewhere) and time.monotonic() < end:
        taken: list[int] = []
        # it ends when there is nothing to take; what came back meanwhile is taken up by the next round
        with closing(where(work, run.ahead(taken, end), workers)) as messages:
            for number, job, kind, value in messages:
                if kind == PROGRESS:
                    if progress is not None:
                        progress(job, value)
                else:
                    run.note(taken[number], kind, value)
        if run.elsewhere and not run.queue:
            assert ledger is not None
            time.sleep(POLL)
            run.look_up(ledger)
            if not run.elsewhere or run.queue:
                begun, patience = time.monotonic(), NOTICE
            elif waiting is not None and time.monotonic() - begun > patience:
                patience *= 2.0
                waiting([(jobs[k], who) for k in run.elsewhere if (who := owner(ledger.claim(jobs[k])))])
    results = run.results
    return Results((results[k] for k in sorted(results)), [job for k, job in enumerate(jobs) if k not in results])
