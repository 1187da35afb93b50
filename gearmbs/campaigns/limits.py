"""Limits of a case: processor time and memory."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path


class TimeLimitReached(RuntimeError):
    """A case has used up its processor time."""


@contextlib.contextmanager
def limited(seconds: float | None, memory: float | None) -> Iterator[Callable[[float], None]]:
    """Bound what is done inside; yield a progress function that checks the time.

    Parameters
    ----------
    seconds : float, optional
        Of this thread's processor time. In a main thread a timer interrupts code that reports no progress, too.
    memory : float, optional
        Bytes that may be allocated beyond what the process has: more raises MemoryError. Without effect where the
        system cannot tell how much that is.

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
    if seconds is None or threading.current_thread() is not threading.main_thread() or not hasattr(signal, "SIGPROF"):
        yield
        return

    def late(*_args) -> None:
        raise TimeLimitReached(f"more than {seconds:g} s of processor time")

    before = signal.signal(signal.SIGPROF, late)
    # a little later than the check between steps, which can say how far the run has come
    signal.setitimer(signal.ITIMER_PROF, 1.1 * seconds + 0.1)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@contextlib.contextmanager
def _memory(limit: float | None) -> Iterator[None]:
    used = _address_space()
    if limit is None or used is None:
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    bound = int(used + limit)
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
