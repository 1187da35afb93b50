"""Units in processes of this machine that live for many units; one that dies is replaced."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial

from gearmbs.campaigns.work import DIED, UnitReport, work_unit
from gearmbs.studies.run.processes import DEATH, FAILURE, messages

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

    def __call__(self, path: str, units: Iterator[int]) -> Iterator[UnitReport]:
        """Yield the reports of units as they end."""
        # workers need modules only, which they import by name
        with closing(messages(partial(_work, path), units, self.workers, own_main=False, grace=GRACE)) as told:
            for _, unit, kind, value in told:
                if kind == FAILURE:
                    raise value
                yield UnitReport(unit, DIED) if kind == DEATH else value


def _work(path: str, unit: int, report: Callable[[float], None]) -> UnitReport:
    """Work on a unit; an error says which it was."""
    try:
        return work_unit(path, unit)
    except OSError as error:
        raise OSError(error.errno, f"unit {unit}: {error.strerror or error}", error.filename) from None
    except Exception as error:
        raise RuntimeError(f"unit {unit}: {type(error).__name__}: {error}") from None


# Units one after the other in this process: for parts of job arrays, for notebooks, for looking into a case.


class SerialRunner:
    """Works on units here."""

    workers = 1

    def __call__(self, path: str, units: Iterator[int]) -> Iterator[UnitReport]:
        """Yield the report of each unit in turn."""
        for unit in units:
            yield work_unit(path, unit)
