"""One case of a unit, within limits of processor time and memory, carried out here or in a process of its own."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gearmbs.campaigns.folder import Folder, check_signals
from gearmbs.campaigns.settings import content_key
from gearmbs.campaigns.subjects.base import DIED, FAILED, MEMORY, TIME, Kept, Outcome

DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO}
"""Errors of the disk and not of the case: they end the run, and the case is done again."""

DEATHS = 2
"""A case whose own process has died so often is recorded as the cause."""

_ALONE = threading.Lock()
"""Held while a bound of memory is in force, which is the whole process's."""


@dataclass
class CaseResult:
    """What came of a case: how it ended, what is kept, its key, processor seconds inside the simulation."""

    outcome: Outcome
    kept: Kept = field(default_factory=Kept)
    key: str = ""
    seconds: float = 0.0
    reused: bool = False


class CaseRunner:
    """Carries out cases of a campaign in this process.

    Parameters
    ----------
    folder : Folder
    """

    def __init__(self, folder: Folder) -> None:
        self.folder, self.plan, self.subject = folder, folder.plan, folder.plan.subject

    def prepare(self, row: dict[str, Any]) -> tuple[Any, CaseResult]:
        """Return the thing that a row stands for and a result with its key; None and the failure if it is
        impossible."""
        try:
            thing = self.subject.check(self.plan.data(row), f"case {row['index']}")
            return thing, CaseResult(Outcome(), key=content_key(self.subject.kind, self.subject.canonical(thing)))
        except Exception as error:
            return None, CaseResult(self.subject.explain(error))

    def run(self, row: dict[str, Any]) -> CaseResult:
        """Carry out a case; whatever it raises becomes its outcome."""
        thing, result = self.prepare(row)
        if thing is None:
            return result
        start = time.thread_time()
        self._attempt(thing, result, row)
        if result.outcome.status == FAILED and self.plan.on_failure == "tighter":
            tighter = self.subject.tightened(thing)
            if tighter is not None:
                self._attempt(tighter, result, row)
        result.seconds = time.thread_time() - start
        return result

    def _attempt(self, thing: Any, result: CaseResult, row: dict[str, Any]) -> None:
        plan = self.plan
        try:
            with limited(plan.time_limit, plan.memory_limit) as check:
                record = self.subject.run(thing, check, plan.keep)
                kept = self.subject.reduce(thing, record, plan.keep)
            check_signals(self.folder.specs, kept.signals)
        except TimeLimitReached as error:
            result.outcome = Outcome(TIME, str(error), "Raise time_limit, or narrow the ranges.")
        except MemoryError as error:
            result.outcome = Outcome(MEMORY, f"MemoryError: {error}"[:500], "Raise memory_limit, or narrow the ranges.")
        except SystemExit as error:
            result.outcome = Outcome(FAILED, f"SystemExit: {error}", "What is simulated must not end its process.")
        except Exception as error:
            if isinstance(error, OSError) and error.errno in DISK:
                raise
            result.outcome = self.subject.explain(error)
            partial = self.subject.partial(error)
            if partial is not None:
                self._write("failed", row, partial)
        else:
            if "record" in plan.keep:
                self._write("records", row, record)
            result.outcome, result.kept = Outcome(), kept

    def _write(self, kind: str, row: dict[str, Any], record: Any) -> None:
        from gearmbs.studies.run.store import write_dataset

        write_dataset(self.folder.path / kind / f"{row['unit']:05d}" / f"{row['index']:07d}.nc", record)

    def close(self) -> None:
        """Let go of what the runner holds."""


class GuardedRunner(CaseRunner):
    """Carries out cases in a child process, whose death is that of one case.

    For units that did not come to an end before: the guilty case is found, and its neighbours are not harmed.
    """

    def __init__(self, folder: Folder) -> None:
        super().__init__(folder)
        self._child: subprocess.Popen | None = None

    def run(self, row: dict[str, Any]) -> CaseResult:
        """Carry out a case in the child; one whose process dies twice is recorded as the cause."""
        for _ in range(DEATHS):
            child = self._start()
            assert child.stdin is not None
            assert child.stdout is not None
            try:
                pickle.dump(row, child.stdin)
                child.stdin.flush()
                kind, value = pickle.load(child.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                code = child.wait()
                self._child = None
                cause = f"signal {-code}" if code < 0 else f"exit status {code}"
                continue
            if kind == "error":
                raise value
            return value
        _, result = self.prepare(row)
        result.outcome = Outcome(
            DIED, f"the process of this case died {DEATHS} times ({cause})", "It may need more memory than there is."
        )
        return result

    def _start(self) -> subprocess.Popen:
        if self._child is None:
            command = [sys.executable, "-m", "gearmbs.campaigns.case_runner", str(self.folder.path)]
            # modules of the user are found where this process finds them
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
            self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
        return self._child

    def close(self) -> None:
        """End the child."""
        if self._child is not None:
            assert self._child.stdin is not None
            self._child.stdin.close()
            self._child.wait()
            self._child = None


def serve(path: str | Path) -> None:
    """Carry out the cases that come through standard input until it is closed."""
    source, sink = sys.stdin.buffer, sys.stdout.buffer
    # what a simulation prints must not get into the answers
    sys.stdout = sys.stderr
    runner = CaseRunner(Folder(path))
    while True:
        try:
            row = pickle.load(source)
        except EOFError:
            return
        try:
            answer: tuple[str, Any] = ("result", runner.run(row))
        except OSError as error:
            answer = ("error", error)
        pickle.dump(answer, sink)
        sink.flush()


# Limits of processor time and memory.


class TimeLimitReached(RuntimeError):
    """A case has used up its processor time."""


@contextlib.contextmanager
def limited(seconds: float | None, memory: float | None) -> Iterator[Callable[[float], None]]:
    """Bound what is done inside; yield a progress function that checks the time.

    Parameters
    ----------
    seconds : float, optional
        Of this thread's processor time. Python code that reports no progress is interrupted, too: by a timer in a main
        thread, in others, as those of Dask's workers, by a thread that looks at the clock.
    memory : float, optional
        Bytes that may be allocated beyond what the process has: more raises MemoryError. Without effect where the
        system cannot tell how much that is. Threads of one process wait for each other, since the bound of one would
        be that of its neighbours.

    Raises
    ------
    TimeLimitReached
    """
    end = None if seconds is None else time.thread_time() + seconds

    def check(fraction: float) -> None:
        if end is not None and time.thread_time() > end:
            raise TimeLimitReached(f"more than {seconds:g} s of processor time, at {100 * fraction:.0f} % of the run")

    with _timer(seconds), _memory(memory):
        yield check


@contextlib.contextmanager
def _timer(seconds: float | None) -> Iterator[None]:
    if seconds is None:
        yield
        return
    message = f"more than {seconds:g} s of processor time"
    # a little later than the check between steps, which can say how far the run has come
    allowed = 1.1 * seconds + 0.1
    if threading.current_thread() is threading.main_thread() and hasattr(signal, "SIGPROF"):
        with _alarm(allowed, message):
            yield
    elif hasattr(time, "pthread_getcpuclockid"):
        with _watched(allowed, message):
            yield
    else:
        yield


@contextlib.contextmanager
def _alarm(allowed: float, message: str) -> Iterator[None]:
    def late(*_args) -> None:
        raise TimeLimitReached(message)

    before = signal.signal(signal.SIGPROF, late)
    signal.setitimer(signal.ITIMER_PROF, allowed)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@contextlib.contextmanager
def _watched(allowed: float, message: str) -> Iterator[None]:
    """Interrupt this thread from another one, which looks at its processor time."""

    class Late(TimeLimitReached):
        def __init__(self) -> None:
            # the interpreter makes it of the class alone
            super().__init__(message)

    interrupt = ctypes.pythonapi.PyThreadState_SetAsyncExc
    me = ctypes.c_ulong(threading.get_ident())
    clock = time.pthread_getcpuclockid(threading.get_ident())
    end = time.clock_gettime(clock) + allowed
    over, deciding = threading.Event(), threading.Lock()

    def watch() -> None:
        # processor time never runs faster than the clock on the wall
        while not over.wait(max(0.01, end - time.clock_gettime(clock))):
            with deciding:
                if not over.is_set() and time.clock_gettime(clock) >= end:
                    interrupt(me, ctypes.py_object(Late))
                    return

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield
    finally:
        with deciding:
            over.set()
            # what was sent and has not arrived must not hit the next case
            interrupt(me, None)


@contextlib.contextmanager
def _memory(limit: float | None) -> Iterator[None]:
    if limit is None or _address_space() is None:
        yield
        return
    import resource

    with _ALONE:
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        bound = int((_address_space() or 0) + limit)
        if hard != resource.RLIM_INFINITY:
            bound = min(bound, hard)
        resource.setrlimit(resource.RLIMIT_AS, (bound, hard))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _address_space() -> int | None:
    try:
        import resource

        return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except (OSError, ImportError):
        return None


if __name__ == "__main__":
    # the classes of the answers must be those of the module, not of the script
    from gearmbs.campaigns.case_runner import serve as serve_here

    serve_here(sys.argv[1])
