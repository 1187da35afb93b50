"""A unit of cases: carried out, stored, entered in the ledger. A function of the folder and the unit's number.

The order makes it safe to be killed at any moment: signals, then the table, then the ledger, each under its final name
only when whole. Without the ledger the unit is done again, with the same bits.

What goes wrong is of three kinds. What a case does itself is recorded as its outcome. What is due to a worker itself,
see `gearmbs.campaigns.surroundings`, makes it refuse the unit, which goes back. A full disk ends the run.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import pickle
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import gearmbs
from gearmbs.campaigns.codes import admit, folder_code, has_grown, known_code, loaded_since, note
from gearmbs.campaigns.folder import Folder, is_record, sealed
from gearmbs.campaigns.limits import TimeLimitReached, last, limited
from gearmbs.campaigns.reuse import Reuse
from gearmbs.campaigns.settings import CampaignError, content_key
from gearmbs.campaigns.signals import check_signals, write_signals
from gearmbs.campaigns.subjects.base import DIED, DONE, FAILED, MEMORY, TIME, Kept, Outcome, check_real
from gearmbs.campaigns.surroundings import DISK, MOST_TRIED, Lacking, carries_out, refusal
from gearmbs.files import arrow_column, whole_file, write_whole
from gearmbs.studies.run.claims import Claim, Claimed, claimed
from gearmbs.studies.run.code import CodeChanged, running_code
from gearmbs.studies.run.engine import Refused, deaf

DEATHS = 2
"""A case whose own process has died so often is recorded as the cause."""

GUARD_AFTER = 2
"""Attempts of a unit that came to no end, after which its cases run in a process of their own."""

SILENT = 30.0
"""Seconds beyond its last that a process of its own is given to end itself, which one that is stopped does not."""

JUST_NOW = 1.0
"""Seconds for which a look at the sources holds when a unit is begun; there is another one before its results are
entered, which finds whatever was edited since."""

_folders: dict[str, Folder] = {}


@dataclass
class CaseResult:
    """What came of a case: how it ended, what is kept, its key, processor seconds inside the simulation, files, the
    modules that it has loaded, with their files, and whether it took a tighter tolerance than its own."""

    outcome: Outcome
    kept: Kept = field(default_factory=Kept)
    key: str = ""
    seconds: float = 0.0
    reused: bool = False
    files: list[str] = field(default_factory=list)
    loaded: dict[str, str] = field(default_factory=dict)
    tightened: bool = False

    @property
    def record(self) -> str | None:
        """The file of its record, None without one."""
        return next((name for name in self.files if is_record(name)), None)


class CaseRunner:
    """Carries out cases of a campaign in this process.

    Parameters
    ----------
    folder : Folder
    code : str
        Digest of the code, a part of each case's key.
    mortal : bool
        Whether this process may be ended with a case that does not end by itself.
    """

    def __init__(self, folder: Folder, code: str, mortal: bool = False) -> None:
        self.folder, self.plan, self.subject, self.code = folder, folder.plan, folder.plan.subject, code
        self.mortal = mortal
        # processor seconds of other processes than this one
        self.elsewhere = 0.0

    def prepare(self, row: dict[str, Any]) -> tuple[Any, CaseResult]:
        """Return the thing that a row stands for and a result with its key; None and the failure if it is
        impossible."""
        try:
            thing = self.subject.check(self.plan.data(row), f"case {row['index']}")
            thing = self.subject.as_simulated(thing, self.plan.keep)
            key = content_key(self.subject.kind, self.subject.canonical(thing), self.code)
            return thing, CaseResult(Outcome(), key=key)
        except Exception as error:
            if (cannot := refusal(error)) is not None:
                raise cannot from error
            return None, CaseResult(self.subject.explain(error))

    def run(self, row: dict[str, Any]) -> CaseResult:
        """Carry out a case; whatever it raises becomes its outcome.

        Raises
        ------
        Refused
            If it is not the case that is to blame.
        OSError
            If the disk is full.
        """
        thing, result = self.prepare(row)
        if thing is None:
            return result
        start, before = time.thread_time(), set(sys.modules)
        self._attempt(thing, result, row)
        if result.outcome.status == FAILED and self.plan.on_failure == "tighter":
            tighter = self.subject.tightened(thing)
            if tighter is not None:
                self._attempt(tighter, result, row)
                result.tightened = result.outcome.status == DONE
        result.seconds = time.thread_time() - start
        if len(sys.modules) > len(before):
            result.loaded = loaded_since(before)
        return result

    def _attempt(self, thing: Any, result: CaseResult, row: dict[str, Any]) -> None:
        plan = self.plan
        try:
            with limited(plan.time_limit, plan.memory_limit, plan.longest, mortal=self.mortal) as check:
                record = self.subject.run(thing, check, plan.keep)
                kept = self.subject.reduce(thing, record, plan.keep)
            check_signals(self.folder.specs, kept.signals)
            taken = self.folder.taken
            for name, value in kept.numbers.items():
                check_real(value, f"results: {name!r}")
                if name in taken and f"result.{name}" in kept.numbers:
                    raise CampaignError(f"results: {name!r} is called 'result.{name}', as another one is; rename one")
        except TimeLimitReached as error:
            result.outcome = Outcome(TIME, str(error), "Raise time_limit or wall_limit, or narrow the ranges.")
        except MemoryError as error:
            result.outcome = Outcome(MEMORY, f"MemoryError: {error}"[:500], "Raise memory_limit, or narrow the ranges.")
        except SystemExit as error:
            result.outcome = Outcome(FAILED, f"SystemExit: {error}", "What is simulated must not end its process.")
        except Exception as error:
            if isinstance(error, OSError) and error.errno in DISK:
                raise
            if (cannot := refusal(error)) is not None:
                raise cannot from error
            result.outcome = self.subject.explain(error)
            partial = self.subject.partial(error)
            if partial is not None:
                self._write("failed", row, partial, result)
        else:
            if "record" in plan.keep:
                try:
                    self._write("records", row, record, result)
                except (TypeError, ValueError, AttributeError) as error:
                    # a record that NetCDF does not take; what the disk does not take ends the run
                    result.outcome = self.subject.explain(error)
                    return
            # what an attempt before had computed when it failed is no record of what is done
            for name in [name for name in result.files if not is_record(name)]:
                result.files.remove(name)
                (self.folder.path / name).unlink(missing_ok=True)
            result.outcome, result.kept = Outcome(), kept

    def taken_over(
        self, row: dict[str, Any], kept: Kept, key: str, record: bytes | None, tightened: bool
    ) -> CaseResult:
        """Return the result of a case as that of an equal one, with the content of its record's file if it has one."""
        result = CaseResult(Outcome(), kept, key, reused=True, tightened=tightened)
        if record is not None:
            place = self._place("records", row)
            place.parent.mkdir(parents=True, exist_ok=True)
            write_whole(place, record, durable=self.folder.path)
            result.files.append(str(place.relative_to(self.folder.path)))
        return result

    def _place(self, kind: str, row: dict[str, Any]) -> Path:
        return self.folder.path / kind / f"{row['unit']:05d}" / f"{row['index']:07d}.nc"

    def _write(self, kind: str, row: dict[str, Any], record: Any, result: CaseResult) -> None:
        from gearmbs.studies.run.store import write_dataset

        place = self._place(kind, row)
        result.files.append(str(write_dataset(place, record, durable=self.folder.path).relative_to(self.folder.path)))

    def ended(self, row: dict[str, Any], outcome: Outcome) -> CaseResult:
        """Return the result of a case of which nothing but how it ended is known."""
        try:
            _, result = self.prepare(row)
        except Refused:
            result = CaseResult(outcome)
        result.outcome = outcome
        return result

    def close(self) -> None:
        """Let go of what the runner holds."""


class GuardedRunner(CaseRunner):
    """Carries out cases in a child process, whose death is that of one case.

    For units that did not come to an end before: the guilty case is found, and its neighbours are not harmed; and for
    limits by the clock where this process must not be ended.
    """

    def __init__(self, folder: Folder, code: str) -> None:
        super().__init__(folder, code)
        self._child: subprocess.Popen | None = None

    def run(self, row: dict[str, Any]) -> CaseResult:
        """Carry out a case in the child; one whose process dies twice is recorded as the cause."""
        longest = self.plan.longest
        for _ in range(DEATHS):
            child = self._start()
            assert child.stdin is not None
            assert child.stdout is not None
            begun = time.monotonic()
            try:
                pickle.dump(row, child.stdin)
                child.stdin.flush()
                if longest is not None and not select.select([child.stdout], [], [], last(longest) + SILENT)[0]:
                    child.kill()
                kind, value, spent = pickle.load(child.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                code = child.wait()
                self._child = None
                if longest is not None and time.monotonic() - begun > longest:
                    # it has ended itself, or was ended
                    told = f"more than {longest:g} s by the clock, and heard no interruption"
                    return self.ended(row, Outcome(TIME, told, "Raise wall_limit."))
                cause = f"signal {-code}" if code < 0 else f"exit status {code}"
                continue
            except BaseException:
                # nobody waits for the case any more
                child.kill()
                raise
            self.elsewhere += spent
            if kind == "error":
                raise value
            return value
        told = f"the process of this case died {DEATHS} times ({cause})"
        return self.ended(row, Outcome(DIED, told, "It may need more memory than there is."))

    def _start(self) -> subprocess.Popen:
        if self._child is None:
            command = [sys.executable, "-m", "gearmbs.campaigns.work", str(self.folder.path), self.code]
            # modules of the user are found where this process finds them
            environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
            with deaf():
                self._child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
            # it says when it can begin, from when on time counts; one that cannot is found by the first case
            assert self._child.stdout is not None
            self._child.stdout.readline()
        return self._child

    def close(self) -> None:
        """End the child."""
        if self._child is not None:
            assert self._child.stdin is not None
            with suppress(OSError):
                self._child.stdin.close()
            self._child.wait()
            self._child = None


def serve(path: str | Path, code: str) -> None:
    """Carry out the cases that come through standard input until it is closed."""
    # what a simulation prints, by whatever means, must not get into the answers
    source, sink = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    runner, before = CaseRunner(Folder(path), code, mortal=True), 0.0
    sink.write(b"\n")
    sink.flush()
    while True:
        try:
            row = pickle.load(source)
        except EOFError:
            return
        try:
            answer: tuple[str, Any] = ("result", runner.run(row))
        except (OSError, Refused) as error:
            answer = ("error", error)
        spent, before = time.process_time() - before, time.process_time()
        pickle.dump((*answer, spent), sink)
        sink.flush()


def open_folder(path: str | Path) -> Folder:
    """Return the folder of a campaign, read again only when its plan has changed."""
    key = str(path)
    if key not in _folders or _folders[key].changed:
        _folders[key] = Folder(path)
    return _folders[key]


def work_unit(path: str, mix: bool, unit: int, _report: Callable[[float], None] | None = None) -> bool:
    """Carry out a unit unless it is done; it is claimed meanwhile. An error says which unit it was.

    Parameters
    ----------
    path : str
        Of the folder.
    mix : bool
        Whether results of another code do not matter.
    unit : int

    Raises
    ------
    Claimed
        If somebody is at work on it.
    Refused
        If the surroundings of this process do not allow it.
    OSError
        If the disk does not take the results; the unit is not done then.
    CampaignError
        With ``on_failure="stop"`` if a case fails.
    """
    try:
        folder = open_folder(path)
        return claimed(folder, unit, partial(_work, folder, mix, unit))
    except (Claimed, Refused):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno in DISK:
            raise OSError(error.errno, f"unit {unit}: {error.strerror or error}", error.filename) from error
        if (cannot := refusal(error)) is not None:
            raise cannot from error
        if isinstance(error, CampaignError):
            raise
        raise RuntimeError(f"unit {unit}: {type(error).__name__}: {error}") from error


_guards: list[GuardedRunner] = []
"""The one whose child goes on from unit to unit: it takes some seconds to start."""


def _guard(folder: Folder, code: str, stays: bool) -> GuardedRunner:
    """Return a runner with a child, of which the main thread keeps one."""
    if not stays:
        return GuardedRunner(folder, code)
    if not any(guard.folder is folder and guard.code == code for guard in _guards):
        end_guards()
        _guards.append(GuardedRunner(folder, code))
    return _guards[0]


def end_guards() -> None:
    """End the child that this process keeps."""
    while _guards:
        _guards.pop().close()


_admitted: set[tuple[str, str, bool, int]] = set()


def _code(folder: Folder, mix: bool, within: float = 0.0) -> str:
    """Return the digest of the code that this process runs, if it may work on the campaign; see `code_of`."""
    digest = (code := folder_code(folder, partial(running_code, within=within))).digest
    first = folder.path / "codes" / "first.json"
    key = str(folder.path), digest, mix, first.stat().st_mtime_ns if first.exists() else 0
    if key not in _admitted:
        admit(folder, code, mix=mix)
        _admitted.add(key)
    return digest


def _work(folder: Folder, mix: bool, unit: int, claim: Claim) -> bool:
    code = _code(folder, mix, within=JUST_NOW)
    started, clock, cpu = time.time(), time.monotonic(), time.process_time()
    rows = folder.cases(unit)
    # a worker process ends with a case that does not heed its limit; for others, and threads that sleep, a child does
    mortal, main = multiprocessing.parent_process() is not None, threading.current_thread() is threading.main_thread()
    limited_by_clock = folder.plan.longest is not None
    guarded = claim.attempts >= (1 if limited_by_clock else GUARD_AFTER) or (limited_by_clock and not (mortal and main))
    runner = _guard(folder, code, main) if guarded else CaseRunner(folder, code, mortal)
    before = runner.elsewhere
    reuse = Reuse.of(folder)
    results: list[CaseResult] = []
    lacking: list[Lacking] = []
    known: dict[str, CaseResult] = {}
    stop = folder.plan.on_failure == "stop"
    try:
        for row in rows:
            try:
                result = _one(runner, row, known, reuse)
            except Lacking as error:
                lacking.append(error)
                result = runner.ended(row, error.outcome)
            results.append(result)
            # where it is all of them, nothing is to be gained by the others
            if lacking and (stop or len(lacking) == len(results) == MOST_TRIED):
                _look(runner, unit, rows, results, lacking[0])
            if stop and result.outcome.status != DONE:
                case = f"case {row['index']}: {result.outcome.message}"
                raise CampaignError(f"stopped at the first failure, as the plan wants: {case}")
        if lacking:
            _look(runner, unit, rows, results, lacking[0])
    finally:
        if runner not in _guards:
            runner.close()
    if loaded := {name: file for result in results for name, file in result.loaded.items()}:
        note(folder, loaded, getattr(known_code(folder, code), "sources", {}))
    digests = store(folder, unit, rows, results)
    while (now := _code(folder, mix)) != code:
        if not _has_grown(folder, now, code):
            raise CodeChanged("the code, or a file that cases read, was edited while the unit was done")
        # modules that cases load are known now, and with them the code and the keys of the cases are others
        code = now
        keys = CaseRunner(folder, code)
        for row, result in zip(rows, results, strict=True):
            result.key = keys.prepare(row)[1].key
        digests = store(folder, unit, rows, results)
    about = {
        "processor_seconds": round(time.process_time() - cpu + runner.elsewhere - before, 4),
        "wall_seconds": round(time.monotonic() - clock, 4),
        "started": started,
        "attempts": claim.attempts,
        "guarded": guarded,
        "code": code,
    }
    enter(folder, unit, rows, results, digests, about)
    return True


def _has_grown(folder: Folder, now: str, before: str) -> bool:
    """Return whether the code with a digest is that of another with modules more that cases have loaded."""
    code = known_code(folder, now)
    return code is not None and has_grown(folder, code, known_code(folder, before))


def _look(
    runner: CaseRunner, unit: int, rows: list[dict[str, Any]], results: list[CaseResult], lacking: Lacking
) -> None:
    """Look whether it is this worker that lacks something, and not some of the cases.

    Raises
    ------
    Lacking
        If it carries out no case.
    """
    done = (row for row, found in zip(rows, results) if found.outcome.status == DONE and not found.reused)
    if not carries_out(runner.folder, unit, lambda row: runner.run(row).outcome, next(done, None)):
        raise lacking


def enter(
    folder: Folder,
    unit: int,
    rows: list[dict[str, Any]],
    results: list[CaseResult],
    digests: dict[str, str],
    about: dict[str, Any],
) -> None:
    """Write the ledger of a unit whose results are stored."""
    seconds = [round(r.seconds, 4) for r in results]
    files = {name: hashlib.sha256((folder.path / name).read_bytes()).hexdigest() for r in results for name in r.files}
    entry = {
        "unit": unit,
        "plan": folder.identity(unit),
        "cases": len(rows),
        "failed": sum(r.outcome.status != DONE for r in results),
        "reused": sum(r.reused for r in results),
        "tightened": [row["index"] for row, r in zip(rows, results) if r.tightened],
        "not_numbers": sum(not r.kept.finite for r in results),
        "index": [rows[0]["index"], rows[-1]["index"] + 1],
        "status": {str(row["index"]): r.outcome.status for row, r in zip(rows, results) if r.outcome.status != DONE},
        "seconds": seconds,
        "simulation_seconds": round(sum(seconds), 4),
        "finished": time.time(),
        "digests": digests,
        "files": files,
        "gearmbs": gearmbs.__version__,
        "host": socket.gethostname(),
        **about,
    }
    write_whole(folder.ledger(unit), sealed(entry), durable=folder.path)


def _one(runner: CaseRunner, row: dict[str, Any], known: dict[str, CaseResult], reuse: Reuse | None) -> CaseResult:
    """Return the result of a case: that of an equal one of this unit or of another campaign, or a new one."""
    if reuse is not None:
        thing, prepared = runner.prepare(row)
        if thing is not None:
            # keys are rounded, so that units of other campaigns do not matter; here it is the same to the last bit
            content = repr(runner.plan.data(row))
            if (found := known.get(content)) is not None:
                record = (runner.folder.path / found.record).read_bytes() if found.record else None
                return runner.taken_over(row, found.kept, found.key, record, found.tightened)
            if (kept := reuse.find(prepared.key)) is not None:
                wanted = "record" in runner.plan.keep
                record = reuse.record(prepared.key) if wanted else None
                if record is not None or not wanted:
                    return runner.taken_over(row, kept, prepared.key, record, prepared.key in reuse.tightened)
    result = runner.run(row)
    if reuse is not None and result.outcome.status == DONE:
        known[repr(runner.plan.data(row))] = result
    return result


def store(folder: Folder, unit: int, rows: list[dict[str, Any]], results: list[CaseResult]) -> dict[str, str]:
    """Write signals and table of a unit; return digests."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    size = folder.unit_size
    signals = [r.kept.signals for r in results]
    digests = write_signals(folder.signals, folder.specs, size, unit, signals, folder.path)
    columns: dict[str, Any] = {name: [row[name] for row in rows] for name in rows[0]}
    columns["slot"] = [unit * size + k for k in range(len(rows))]
    columns["id"] = [r.key for r in results]
    for name in ("status", "message", "advice"):
        columns[name] = [getattr(r.outcome, name) for r in results]
    table = {name: arrow_column(values) for name, values in columns.items()}
    taken = folder.taken
    for name in dict.fromkeys(key for r in results for key in r.kept.numbers):
        column = f"result.{name}" if name in taken else name
        table[column] = arrow_column([r.kept.numbers.get(name) for r in results], pa.float64())
    with whole_file(folder.table(unit), durable=folder.path) as part:
        pq.write_table(pa.table(table), part, compression="zstd", write_page_checksum=True)
        digests["table"] = hashlib.sha256(part.read_bytes()).hexdigest()
    return digests


if __name__ == "__main__":
    # the classes of the answers must be those of the module, not of the script
    from gearmbs.campaigns.work import serve as serve_here

    serve_here(sys.argv[1], sys.argv[2])
