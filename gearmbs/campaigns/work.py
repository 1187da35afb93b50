"""A unit of cases: carried out, stored, entered in the ledger. A function of the folder and the unit's number.

Cases run within limits of processor time and memory, here or in a process of their own.

The order makes it safe to be killed at any moment: signals, then the table, then the ledger, each under its final name
only when whole. Without the ledger the unit is done again, with the same bits.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import hashlib
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.folder import Folder, check_signals, surroundings
from gearmbs.campaigns.settings import CampaignError, content_key
from gearmbs.campaigns.subjects.base import DIED, DONE, FAILED, MEMORY, TIME, Kept, Outcome
from gearmbs.files import whole_file, write_whole
from gearmbs.studies.run.engine import Claim, Claimed, claimed

DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO}
"""Errors of the disk and not of the case: they end the run, and the case is done again."""

DEATHS = 2
"""A case whose own process has died so often is recorded as the cause."""

_ALONE = threading.Lock()
"""Held while a bound of memory is in force, which is the whole process's."""

GUARD_AFTER = 2
"""Attempts of a unit that came to no end, after which its cases run in a process of their own."""

_folders: dict[str, tuple[float, Folder]] = {}


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
            command = [sys.executable, "-m", "gearmbs.campaigns.work", str(self.folder.path)]
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


# Results of equal cases of other campaigns, found by their content.


_known: dict[tuple[str, ...], Reuse] = {}


class Reuse:
    """The finished cases of some campaigns by their keys.

    Parameters
    ----------
    paths : sequence of path-like
        Folders of campaigns that keep the same.
    keep : tuple of str
        What the new campaign keeps.

    Raises
    ------
    CampaignError
        If one of them keeps something else: its results would not do.
    """

    def __init__(self, paths: tuple[str, ...], keep: tuple[str, ...]) -> None:
        import pyarrow.parquet as pq

        self._at: dict[str, tuple[Folder, int, int]] = {}
        self._tables: dict[tuple[Path, int], list[dict[str, Any]]] = {}
        for path in paths:
            folder = Folder(path)
            if set(keep) - set(folder.plan.keep):
                missing = ", ".join(sorted(set(keep) - set(folder.plan.keep)))
                raise CampaignError(f"reuse: {path} does not keep {missing}; leave it out, or keep the same")
            for unit in folder.done():
                ids = pq.ParquetFile(folder.table(unit)).read(["id", "status"]).to_pydict()
                for k, (key, status) in enumerate(zip(ids["id"], ids["status"])):
                    if status == DONE:
                        self._at.setdefault(key, (folder, unit, k))

    @classmethod
    def of(cls, folder: Folder) -> Reuse | None:
        """Return what a campaign may take over; None if nothing."""
        plan = folder.plan
        if not plan.reuse:
            return None
        key = (str(folder.path), *plan.reuse)
        if key not in _known:
            _known[key] = cls(plan.reuse, plan.keep)
        return _known[key]

    def find(self, key: str) -> CaseResult | None:
        """Return the stored result of a case with this key, or None."""
        import pyarrow.parquet as pq

        place = self._at.get(key)
        if place is None:
            return None
        folder, unit, k = place
        at = (folder.path, unit)
        if at not in self._tables:
            self._tables = {at: pq.ParquetFile(folder.table(unit)).read().to_pylist()}
        row = self._tables[at][k]
        skip = {*folder.cases(unit)[0], "slot", "id", "status", "message", "advice"}
        numbers = {n: float(v) for n, v in row.items() if n not in skip and v is not None}
        return CaseResult(Outcome(), Kept(numbers, self._signals(folder, row["slot"])), key, reused=True)

    def _signals(self, folder: Folder, slot: int) -> dict[str, np.ndarray]:
        if not folder.specs:
            return {}
        import zarr

        group = zarr.open_group(folder.signals, mode="r")
        found = {}
        for spec in folder.specs:
            array: Any = group[spec.name]
            values = np.asarray(array[slot])
            long = np.flatnonzero(np.isfinite(values).any(axis=0))
            found[spec.name] = values[:, : int(long[-1]) + 1 if long.size else 0]
        return found


def open_folder(path: str | Path) -> Folder:
    """Return the folder of a campaign, read again only when its plan has changed."""
    key, stamp = str(path), (Path(path) / "plan.json").stat().st_mtime
    if key not in _folders or _folders[key][0] != stamp:
        _folders[key] = (stamp, Folder(path))
    return _folders[key][1]


def work_unit(path: str, unit: int, _report: Callable[[float], None] | None = None) -> bool:
    """Carry out a unit unless it is done; it is claimed meanwhile. An error says which unit it was.

    Raises
    ------
    Claimed
        If somebody is at work on it.
    OSError
        If the disk does not take the results; the unit is not done then.
    CampaignError
        With ``on_failure="stop"`` if a case fails.
    """
    folder = open_folder(path)
    try:
        return claimed(folder, unit, partial(_work, folder, unit))
    except (Claimed, CampaignError):
        raise
    except OSError as error:
        raise OSError(error.errno, f"unit {unit}: {error.strerror or error}", error.filename) from error
    except Exception as error:
        raise RuntimeError(f"unit {unit}: {type(error).__name__}: {error}") from error


def _work(folder: Folder, unit: int, claim: Claim) -> bool:
    started, cpu = time.time(), time.process_time()
    rows = folder.cases(unit)
    guarded = claim.attempts >= GUARD_AFTER
    runner = GuardedRunner(folder) if guarded else CaseRunner(folder)
    reuse = Reuse.of(folder)
    results: list[CaseResult] = []
    known: dict[str, CaseResult] = {}
    stop = folder.plan.on_failure == "stop"
    try:
        for row in rows:
            result = _one(runner, row, known, reuse)
            if stop and result.outcome.status != DONE:
                case = f"case {row['index']}: {result.outcome.message}"
                raise CampaignError(f"stopped at the first failure, as the plan wants: {case}")
            results.append(result)
    finally:
        runner.close()
    digests = _store(folder, unit, rows, results)
    seconds = [round(r.seconds, 4) for r in results]
    entry = {
        "unit": unit,
        "cases": len(rows),
        "failed": sum(r.outcome.status != DONE for r in results),
        "reused": sum(r.reused for r in results),
        "index": [rows[0]["index"], rows[-1]["index"] + 1],
        "status": {str(row["index"]): r.outcome.status for row, r in zip(rows, results) if r.outcome.status != DONE},
        "seconds": seconds,
        "processor_seconds": round(time.process_time() - cpu, 4),
        "simulation_seconds": round(sum(seconds), 4),
        "started": started,
        "finished": time.time(),
        "attempts": claim.attempts,
        "guarded": guarded,
        "digests": digests,
        **surroundings(),
    }
    write_whole(folder.ledger(unit), json.dumps(entry))
    return True


def _one(runner: CaseRunner, row: dict[str, Any], known: dict[str, CaseResult], reuse: Reuse | None) -> CaseResult:
    """Return the result of a case: that of an equal one of this unit or of another campaign, or a new one."""
    if reuse is not None:
        thing, prepared = runner.prepare(row)
        if thing is not None:
            found = known.get(prepared.key) or reuse.find(prepared.key)
            if found is not None:
                return found
    result = runner.run(row)
    if reuse is not None and result.outcome.status == DONE:
        known[result.key] = CaseResult(result.outcome, result.kept, result.key, reused=True)
    return result


def _store(folder: Folder, unit: int, rows: list[dict[str, Any]], results: list[CaseResult]) -> dict[str, str]:
    """Write signals and table of a unit; return digests."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    plan = folder.plan
    digests: dict[str, str] = {}
    if folder.specs:
        from gearmbs.campaigns.folder import write_signals

        digests = write_signals(folder.signals, folder.specs, plan.unit, unit, [r.kept.signals for r in results])
    columns: dict[str, Any] = {name: [row[name] for row in rows] for name in rows[0]}
    columns["slot"] = [unit * plan.unit + k for k in range(len(rows))]
    columns["id"] = [r.key for r in results]
    for name in ("status", "message", "advice"):
        columns[name] = [getattr(r.outcome, name) for r in results]
    table = {name: pa.array(values) for name, values in columns.items()}
    taken = set(table)
    for name in dict.fromkeys(key for r in results for key in r.kept.numbers):
        # a result must not take the place of a factor or of the status
        column = f"result.{name}" if name in taken else name
        table[column] = pa.array([r.kept.numbers.get(name) for r in results], type=pa.float64())
    with whole_file(folder.table(unit)) as part:
        pq.write_table(pa.table(table), part, compression="zstd")
        digests["table"] = hashlib.sha256(part.read_bytes()).hexdigest()
    return digests


if __name__ == "__main__":
    # the classes of the answers must be those of the module, not of the script
    from gearmbs.campaigns.work import serve as serve_here

    serve_here(sys.argv[1])
