"""What operating systems do differently: all that asks for one of them stands here.

Processors, processes, forks, signals, timers, bounds of memory, locks of files, and the folder of a user's own. Each
function says what it does where a system does not have it; callers ask for nothing else (`tests/test_system.py`).
"""

from __future__ import annotations

import contextlib
import errno
import os
import platform
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import IO, Any

WINDOWS = os.name == "nt"

PROC = Path("/proc")
"""Where Linux tells of processes and of itself; other systems have no such folder."""

OF_PROCESSORS = (
    "vendor_id", "cpu family", "model", "model name", "stepping", "flags",
    "CPU implementer", "CPU architecture", "CPU variant", "CPU part", "Features",
)  # fmt: skip
"""What Linux tells of a processor that a compiler tells processors apart by: of x86, then of ARM."""

HELD = {errno.EDEADLK, errno.EACCES, getattr(errno, "EDEADLOCK", errno.EDEADLK)}
"""What Windows says of a lock that somebody else has had for ten seconds."""

RENAMING = 2.0
"""Seconds for which a file that a search or a virus scanner has open on Windows is waited for."""


# files


def rename_over(source: Path, target: Path) -> None:
    """Rename a file over another one; Windows, which refuses while somebody reads that one, is asked for a while.

    Raises
    ------
    OSError
        If it cannot be done.
    """
    end = time.monotonic() + RENAMING
    while True:
        try:
            return os.replace(source, target)
        except PermissionError:
            if not WINDOWS or time.monotonic() > end or target.is_dir():
                raise
            time.sleep(0.02)


def lock(stream: IO) -> None:
    """Wait until a file that is open for writing is this process's alone, up to when it is closed.

    Raises
    ------
    OSError
        Where there are no locks, as on some file servers.
    """
    if WINDOWS:
        import msvcrt

        while True:
            try:
                # of its first byte, which nobody reads or writes; it is asked for ten times, once a second
                stream.seek(0)
                return msvcrt.locking(stream.fileno(), msvcrt.LK_LOCK, 1)  # type: ignore[attr-defined,no-any-return]
            except OSError as error:
                if error.errno not in HELD:
                    raise
    import fcntl

    fcntl.flock(stream, fcntl.LOCK_EX)


def user_cache() -> Path | None:
    """Return the folder for what a user's programs keep, None if the user has none; it need not be there."""
    given = os.environ.get("XDG_CACHE_HOME")
    if given:
        return Path(given)
    try:
        return Path.home() / ".cache"
    except RuntimeError:
        return None


def umask() -> int:
    """Return which rights new files do not get."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


def forgive_output() -> None:
    """Let standard output and error replace what their code page cannot write, instead of ending the program."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


# processors


def cores() -> int:
    """Return the number of cores that this process may use; where that is not told, of all."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processor_lines() -> list[str]:
    """Return what the system tells of its processors, each line once; nothing where it tells nothing."""
    try:
        lines = (PROC / "cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    return sorted({line for line in lines if line.partition(":")[0].strip() in OF_PROCESSORS})


def processor_name() -> str:
    """Return what the system calls its processor."""
    return platform.processor() or platform.machine()


# processes


def is_linux_on_x86_64() -> bool:
    """Return whether this is Linux on a 64-bit processor of Intel's kind."""
    return (sys.platform, platform.machine()) == ("linux", "x86_64")


def knows_processes() -> bool:
    """Return whether a process of this machine can be asked for: on Windows signal 0, which does it, is Ctrl-C."""
    return not WINDOWS


def space_of_processes() -> str:
    """Return by what numbers of processes are told apart from those of other containers and of former starts."""
    found = []
    for read in (
        lambda: (PROC / "sys/kernel/random/boot_id").read_text(encoding="ascii"),
        lambda: os.readlink(PROC / "self/ns/pid"),
    ):
        with contextlib.suppress(OSError):
            found.append(read().strip())
    return " ".join(found)


def _stat(pid: int | str) -> list[str]:
    """Return what Linux tells of a process, from its state on."""
    return (PROC / f"{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()


def process_of(pid: int) -> tuple[str | None, str]:
    """Return when a process of this machine began, in its own units, None if there is none; and its state, "T" if it
    is stopped. Where the system only tells that there is one, it began at an "unknown" time."""
    try:
        fields = _stat(pid)
    except OSError:
        if (PROC / "self/stat").exists():
            return None, ""
        if not knows_processes():
            return "unknown", ""
        try:
            os.kill(pid, 0)
        except PermissionError:
            return "unknown", ""
        except OSError:
            return None, ""
        return "unknown", ""
    return (None if fields[0] in "ZX" else fields[19]), "T" if fields[0] in "Tt" else fields[0]


def spent(pid: int) -> float | None:
    """Return the processor time of a process of this machine in its own units; None where that is not known."""
    try:
        fields = _stat(pid)
    except OSError:
        return None
    return float(fields[11]) + float(fields[12])


def began() -> float:
    """Return when this process began, in seconds since 1970; where that is not known, now."""
    try:
        ticks = float(_stat("self")[19])
        uptime = float((PROC / "uptime").read_text(encoding="ascii").split()[0])
        return time.clock_gettime(time.CLOCK_REALTIME) - (uptime - ticks / os.sysconf("SC_CLK_TCK"))
    except (OSError, ValueError, IndexError, AttributeError):
        return time.time()


def survives(work: Callable[[], Any]) -> bool:
    """Return whether a process does some work without being killed by it; where there are no forks, it is not tried.

    The work is done in a copy of this process, whose exceptions are nobody's.
    """
    if not hasattr(os, "fork"):
        return True
    child = os.fork()
    if child == 0:
        try:
            work()
        finally:
            os._exit(0)
    return not os.WIFSIGNALED(os.waitpid(child, 0)[1])


# signals


ASKED_TO_END = int(signal.SIGINT)
"""Number of Ctrl-C's signal."""


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def end_like_interrupt(noted: Callable[[int], None]) -> None:
    """Take requests to end (SIGTERM) like Ctrl-C, also where that is ignored, as in a background job.

    Parameters
    ----------
    noted : callable
        Is told the number of the signal first.
    """

    def interrupt(number: int, _: FrameType | None) -> None:
        noted(number)
        if signal.getsignal(signal.SIGINT) in (signal.SIG_IGN, None):
            raise KeyboardInterrupt
        signal.raise_signal(signal.SIGINT)

    signal.signal(signal.SIGTERM, interrupt)


def leave_interrupts_to_parent() -> None:
    """Be deaf to Ctrl-C, which the parent hears, too, and end at a request to end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextlib.contextmanager
def deaf() -> Iterator[None]:
    """Let processes that start now be deaf to Ctrl-C, also while they import; without effect where there are no masks
    of signals."""
    if not _in_main_thread() or not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def rings(clock: str) -> bool:
    """Return whether a timer can interrupt this thread: by "processor" time, or by the clock on the "wall"."""
    return _in_main_thread() and hasattr(signal, "SIGPROF" if clock == "processor" else "SIGALRM")


@contextlib.contextmanager
def ringing(clock: str, seconds: float, late: Callable[[], None]) -> Iterator[None]:
    """Call a function, which may raise, in this thread after some seconds; only where it `rings`."""
    number, timer = (
        (signal.SIGPROF, signal.ITIMER_PROF) if clock == "processor" else (signal.SIGALRM, signal.ITIMER_REAL)
    )
    before = signal.signal(number, lambda *_: late())
    signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        signal.setitimer(timer, 0.0)
        signal.signal(number, before)


# memory


def address_space() -> int | None:
    """Return the bytes of memory that this process has reserved; None where that is not told, or cannot be bounded."""
    try:
        import resource

        pages = int((PROC / "self/statm").read_text(encoding="ascii").split()[0])
        return pages * resource.getpagesize()
    except (OSError, ImportError):
        return None


@contextlib.contextmanager
def bounded_memory(limit: float) -> Iterator[None]:
    """Let more than some bytes beyond what the process has raise MemoryError; only where `address_space` is told."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    bound = int((address_space() or 0) + limit)
    if hard != resource.RLIM_INFINITY:
        bound = min(bound, hard)
    resource.setrlimit(resource.RLIMIT_AS, (bound, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
