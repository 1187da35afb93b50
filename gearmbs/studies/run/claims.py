"""Claims on jobs: who is at work on what, and whether somebody still is.

A claim is a file beside the job's result. It saves work and decides nothing: a job that is done twice has the same
result both times. A claim is void

* at once, if its process is of this machine and has ended;
* if it has given no sign of life for `LEASE` seconds; for `STOPPED`, if its process is of this machine and stopped.

Clocks of several machines need not agree: what counts is how long, by the clock of the one who looks, the file has
stayed as it is. So whoever looks for the first time takes a claim for alive.
"""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from gearmbs.files import write_whole
from gearmbs.system import knows_processes, process_of, space_of_processes

T = TypeVar("T")

LEASE = 180.0
"""Seconds without a sign of life after which a claim is void."""

BEAT = LEASE / 12.0
"""Seconds between the signs of life of a job, many to a lease: files show up to a minute late elsewhere."""

STOPPED = 10.0
"""Seconds for which a process of this machine must have been stopped, as by SIGSTOP."""

WRITING = 5.0
"""Seconds for which a claim that cannot be read is taken for one that is being written."""


class Claimed(Exception):
    """Somebody else is at work on the job."""


class Ledger(Protocol):
    """What is known of jobs, by their files."""

    def result(self, job: Any) -> Any:
        """Return what is stored of a job that is done, None of any other."""

    def claim(self, job: Any) -> Path:
        """Return the path of a job's claim."""


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
    """Claim a job; None if somebody is at work on it. A claim that is void is taken over, and the attempts counted."""
    if not knows_processes():
        return Claim(path, 0)
    attempts = 0
    for _ in range(3):
        try:
            handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
        except FileExistsError:
            if not vacant(path):
                return None
            attempts = max(attempts, int((_read(path) or {}).get("attempts", 0)) + 1)
            path.unlink(missing_ok=True)
            continue
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump({**_me(), "taken": time.time(), "attempts": attempts}, file)
        return Claim(path, attempts)
    return None


def vacant(path: Path) -> bool:
    """Return whether a job may be taken: nobody has claimed it, or the claim is void, which is then written into it."""
    try:
        stamp = path.stat()
    except OSError:
        return True
    claim = _read(path)
    if claim is None:
        # being written, or taken away, at this moment; or cut short by a kill
        void = _unchanged(path, stamp) >= WRITING
    else:
        void = not _alive(claim, path, stamp)
    if void and not (claim or {}).get("void"):
        # those who look for the first time must not wait again
        with suppress(OSError):
            write_whole(path, json.dumps({**(claim or _me()), "void": True}))
    return void


def owner(path: Path) -> dict[str, Any] | None:
    """Return who has claimed a job and is alive, or None.

    Returns
    -------
    dict
        Among others ``host``, ``pid``, and in seconds ``age`` of the claim and ``silent`` since its last sign of life,
        as far as clocks agree.
    """
    try:
        stamp = path.stat()
    except OSError:
        return None
    claim = _read(path)
    if not claim or not _alive(claim, path, stamp):
        return None
    seen, now = _unchanged(path, stamp), time.time()
    silent = max(seen, now - stamp.st_mtime)
    return claim | {"age": max(silent, now - float(claim.get("taken", now))), "silent": silent}


def told(claim: dict[str, Any]) -> str:
    """Return in words who is at work, for `owner`'s answer."""
    return (
        f"host {claim['host']}, process {claim['pid']}, for {claim['age']:.0f} s, "
        f"last sign of life {claim['silent']:.0f} s ago"
    )


_watched: dict[Path, tuple[tuple[int, int], float]] = {}


def _unchanged(path: Path, stamp: os.stat_result) -> float:
    """Return for how many seconds of this process's clock a file has been seen as it is."""
    mark, now = (stamp.st_mtime_ns, stamp.st_ino), time.monotonic()
    known = _watched.get(path)
    if known is None or known[0] != mark:
        _watched[path] = mark, now
        return 0.0
    return now - known[1]


def _read(path: Path) -> dict[str, Any] | None:
    try:
        claim = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return claim if isinstance(claim, dict) and {"host", "pid", "started"} <= claim.keys() else None


def _alive(claim: dict[str, Any], path: Path, stamp: os.stat_result) -> bool:
    if claim.get("void"):
        return False
    patience = LEASE
    me = _me()
    if claim["host"] == me["host"] and claim.get("space", me["space"]) == me["space"]:
        started, state = process_of(int(claim["pid"]))
        if started is None or started != claim["started"]:
            return False
        if state == "T":
            patience = STOPPED
    return _unchanged(path, stamp) < patience


def _me() -> dict[str, Any]:
    """Return by what a process is known: containers may share a host's name, and not its numbers of processes."""
    started, _ = process_of(os.getpid())
    return {"host": socket.gethostname(), "space": space_of_processes(), "pid": os.getpid(), "started": started}
