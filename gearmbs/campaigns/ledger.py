"""Claims and ledgers of units, as files.

A unit is done if and only if its ledger is there; it is written last, under its final name only when whole. A claim
says who is at work, so that two workers rarely do the same; should they, they write the same bits.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import socket
import time
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

LEASE = 1800.0
"""Seconds without a sign of life after which a claim of another machine is void."""


@dataclass(frozen=True)
class Claim:
    """Who works on a unit, and how often it was tried before."""

    path: Path
    attempts: int

    def beat(self) -> None:
        """Give a sign of life."""
        with contextlib.suppress(FileNotFoundError):
            os.utime(self.path)

    def release(self) -> None:
        """Give the unit back."""
        self.path.unlink(missing_ok=True)


def take(path: Path) -> Claim | None:
    """Claim a unit; None if somebody is at work on it.

    A claim whose process has died, or that has shown no sign of life for `LEASE`, is taken over, and the attempts
    counted.
    """
    me = {"host": socket.gethostname(), "pid": os.getpid(), "started": _started(os.getpid())}
    attempts = 0
    for _ in range(3):
        try:
            handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
        except FileExistsError:
            old = _read(path)
            if old is None:
                # being written, or taken away, at this moment; or cut short by a kill
                if time.time() - _age_mark(path) < 5.0:
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
    """Return who has claimed a unit and is alive, or None."""
    old = _read(path)
    return old if old and _alive(old, path) else None


def _read(path: Path) -> dict[str, Any] | None:
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


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


def surroundings() -> dict[str, str]:
    """Return versions and machine, which decide the last bits of a result."""
    found = {"host": socket.gethostname(), "machine": platform.machine(), "python": platform.python_version()}
    found["processor"] = _processor()
    for name in ("gearmbs", "numpy", "scipy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
