"""Units one after the other in this process: for parts of job arrays, for notebooks, for looking into a case."""

from __future__ import annotations

from collections.abc import Iterator

from gearmbs.campaigns.work import UnitReport, work_unit


class SerialRunner:
    """Works on units here."""

    workers = 1

    def __call__(self, path: str, units: Iterator[int]) -> Iterator[UnitReport]:
        """Yield the report of each unit in turn."""
        for unit in units:
            yield work_unit(path, unit)
