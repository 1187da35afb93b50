"""Units in processes of this machine that live for many units; one that dies is replaced."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

from gearmbs.campaigns.work import DIED, UnitReport, work_unit

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
GRACE = 5.0
"""Seconds a worker is given to end before it is killed."""


class ProcessRunner:
    """Works on units in so many processes, each with one thread.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self.workers = max(1, int(workers))
        self._context = multiprocessing.get_context("spawn")
        self._processes: dict[Connection, Any] = {}

    def __call__(self, path: str, units: Iterator[int]) -> Iterator[UnitReport]:
        """Yield the reports of units as they end."""
        at_work: dict[Connection, int] = {}
        idle: list[Connection] = []
        try:
            while True:
                while len(at_work) < self.workers:
                    unit = next(units, None)
                    if unit is None:
                        break
                    connection = idle.pop() if idle else self._start(path)
                    at_work[connection] = unit
                    try:
                        connection.send(unit)
                    except ConnectionError:
                        pass  # found dead below
                if not at_work:
                    return
                for ready in wait(list(at_work), timeout=1.0):
                    assert isinstance(ready, Connection)
                    unit = at_work.pop(ready)
                    try:
                        answer = ready.recv()
                    except (EOFError, ConnectionError):
                        self._bury(ready)
                        yield UnitReport(unit, DIED)
                        continue
                    idle.append(ready)
                    if isinstance(answer, Exception):
                        raise answer
                    yield answer
        finally:
            self._end(at_work)

    def _start(self, path: str) -> Connection:
        with _inherited_settings(), _without_main():
            ours, theirs = self._context.Pipe()
            process = self._context.Process(target=_serve, args=(path, theirs), daemon=True)
            process.start()
            theirs.close()
        self._processes[ours] = process
        return ours

    def _bury(self, connection: Connection) -> None:
        process = self._processes.pop(connection)
        connection.close()
        process.join(GRACE)

    def _end(self, at_work: dict[Connection, int]) -> None:
        for connection, process in self._processes.items():
            connection.close()
            if connection in at_work:
                process.terminate()
        for process in self._processes.values():
            process.join(GRACE)
            if process.is_alive():
                process.kill()
                process.join()
        self._processes.clear()


def _serve(path: str, connection: Connection) -> None:
    """Work on the units that come through a pipe until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    while True:
        try:
            unit = connection.recv()
        except (EOFError, ConnectionError):
            return
        try:
            answer: Any = work_unit(path, unit)
        except OSError as error:
            answer = OSError(error.errno, f"unit {unit}: {error.strerror or error}", error.filename)
        except Exception as error:
            answer = RuntimeError(f"unit {unit}: {type(error).__name__}: {error}")
        try:
            connection.send(answer)
        except ConnectionError:
            return


@contextmanager
def _without_main() -> Iterator[None]:
    """Keep a new process from running the user's script again: it needs modules only, which it imports by name."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextmanager
def _inherited_settings() -> Iterator[None]:
    """Let a worker start with one thread for everything."""
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


# Units one after the other in this process: for parts of job arrays, for notebooks, for looking into a case.


class SerialRunner:
    """Works on units here."""

    workers = 1

    def __call__(self, path: str, units: Iterator[int]) -> Iterator[UnitReport]:
        """Yield the report of each unit in turn."""
        for unit in units:
            yield work_unit(path, unit)
