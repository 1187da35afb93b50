"""Limits of what a case may take: processor time, time by the clock, memory."""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import threading
import time
from collections.abc import Callable, Iterator

from gearmbs.system import address_space, bounded_memory, ringing, rings

_ALONE = threading.Lock()
"""Held while a bound of memory is in force, which is the whole process's."""


class TimeLimitReached(RuntimeError):
    """A case has used up its time."""


@contextlib.contextmanager
def limited(
    seconds: float | None, memory: float | None, wall: float | None = None, *, mortal: bool = False
) -> Iterator[Callable[[float], None]]:
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
    wall : float, optional
        Seconds by the clock. In a main thread what sleeps or waits is interrupted, too.
    mortal : bool
        Whether this process may be ended, `last` after its start, where what it does is deep in compiled code and hears
        no signal, or goes on whatever exception it meets.

    Raises
    ------
    TimeLimitReached
    """
    end = None if seconds is None else time.thread_time() + seconds
    late = None if wall is None else time.monotonic() + wall

    def check(fraction: float) -> None:
        if end is not None and time.thread_time() > end:
            raise TimeLimitReached(f"more than {seconds:g} s of processor time, at {100 * fraction:.0f} % of the run")
        if late is not None and time.monotonic() > late:
            raise TimeLimitReached(f"more than {wall:g} s by the clock, at {100 * fraction:.0f} % of the run")

    with _timer(seconds), _clock(wall, mortal), _memory(memory):
        yield check


def later(seconds: float) -> float:
    """Return a limit a little above one that is checked between steps, which can say how far a run has come."""
    return 1.1 * seconds + 0.1


def last(seconds: float) -> float:
    """Return when a process is ended that has not heard of its limit."""
    return 2.0 * later(seconds) + 1.0


@contextlib.contextmanager
def _timer(seconds: float | None) -> Iterator[None]:
    if seconds is None:
        yield
        return
    message = f"more than {seconds:g} s of processor time"
    if rings("processor"):
        with ringing("processor", later(seconds), lambda: _late(message)):
            yield
    elif hasattr(time, "pthread_getcpuclockid"):
        with _watched(later(seconds), message):
            yield
    else:
        yield


@contextlib.contextmanager
def _clock(seconds: float | None, mortal: bool) -> Iterator[None]:
    if seconds is None or not rings("wall"):
        yield
        return
    if mortal:
        faulthandler.dump_traceback_later(last(seconds), exit=True)
    try:
        message = f"more than {seconds:g} s by the clock"
        with ringing("wall", later(seconds), lambda: _late(message)):
            yield
    finally:
        if mortal:
            faulthandler.cancel_dump_traceback_later()


def _late(message: str) -> None:
    raise TimeLimitReached(message)


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
    if limit is None or address_space() is None:
        yield
        return
    with _ALONE, bounded_memory(limit):
        yield
