"""How far a campaign is, read from its files by anybody."""

from __future__ import annotations

import os
from contextlib import nullcontext
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from gearmbs.campaigns.codes import one_code
from gearmbs.campaigns.folder import Folder, read_ledger
from gearmbs.studies.run.claims import BEAT, owner, told

RECENT = 20
"""Units by whose pace the remaining time is judged."""

LONG = 10.0
"""Seconds after which a claim that is late is named."""

MUCH = 5.0
"""Times the longest of the last units that a unit may take before it is named."""


@dataclass(frozen=True)
class CampaignStatus:
    """How far a campaign is.

    Attributes
    ----------
    cases, done, failed, reused, running : int
        Cases: all, finished (with those that failed), failed, taken over from others, in units at work.
    units, units_done : int
    processor_seconds, simulation_seconds : float
        Spent on finished units, and of that inside simulations.
    eta : float or None
        Seconds until the end at the pace of the last units and with as many at work as now; None if nobody is at work,
        none is done yet, or somebody takes much longer than that.
    not_numbers : int
        Finished cases with a result that is NaN or infinite.
    codes : int
        Different codes that results come from; see `gearmbs.studies.run.code`.
    late : tuple of str
        Who is at work and has given no sign of life for `LONG` seconds, or is at work for much longer than the last
        units took.
    at_work : tuple of str
        All who are at work, with their units.
    rate : float or None
        Cases a second at that pace; None as ``eta``.
    """

    cases: int
    done: int
    failed: int
    reused: int
    running: int
    units: int
    units_done: int
    processor_seconds: float
    simulation_seconds: float
    eta: float | None
    not_numbers: int = 0
    codes: int = 1
    late: tuple[str, ...] = ()
    at_work: tuple[str, ...] = ()
    rate: float | None = None

    @property
    def fraction(self) -> float:
        """Part of the cases that is finished."""
        return self.done / self.cases if self.cases else 1.0

    @property
    def complete(self) -> bool:
        """Whether every unit is done."""
        return self.units_done == self.units

    @property
    def overhead(self) -> float:
        """Part of the processor time that was spent outside simulations and their evaluation."""
        spent = self.processor_seconds
        return 1.0 - self.simulation_seconds / spent if spent else 0.0

    def __str__(self) -> str:
        parts = [f"{self.done} of {self.cases} cases done"]
        for count, word in (
            (self.failed, "failed"),
            (self.not_numbers, "with results that are no numbers"),
            (self.reused, "taken over"),
            (self.running, "in work"),
        ):
            if count:
                parts.append(f"{count} {word}")
        if self.codes > 1:
            parts.append(f"from {self.codes} different codes")
        if not self.complete:
            if self.eta is not None:
                parts.append(f"about {duration(self.eta)} left")
            elif not self.running:
                parts.append("nobody at work")
        return "; ".join([", ".join(parts), *self.late])

    def _repr_html_(self) -> str:
        """Return the bar and the words, for notebooks."""
        return f"<progress value='{self.fraction:.4f}' max='1'></progress> {self}"


def duration(seconds: float) -> str:
    """Return a duration in words."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


@dataclass(frozen=True)
class _Unit:
    """What is counted of a ledger."""

    cases: int
    failed: int
    reused: int
    not_numbers: int
    processor_seconds: float
    simulation_seconds: float
    wall_seconds: float
    finished: float
    code: str


@lru_cache(maxsize=200_000)
def _counts(path: str, _written: tuple[int, int]) -> _Unit | None:
    """Return what is counted of a ledger as it was written; one may be taken away and written again."""
    entry = read_ledger(Path(path))
    return None if entry is None else _Unit(**{name: entry[name] for name in _Unit.__dataclass_fields__})


def read_status(folder: Folder) -> CampaignStatus:
    """Return how far a campaign is.

    Raises
    ------
    CampaignError
        If a ledger is damaged.
    """
    rows, done, claims = [], set(), []
    units = folder.store / "units"
    with os.scandir(units) if units.is_dir() else nullcontext(()) as files:
        for file in files:
            stem, _, kind = file.name.partition(".")
            if not stem.isdigit() or int(stem) >= folder.unit_count:
                continue
            if kind == "claim":
                claims.append(int(stem))
            elif kind == "json":
                try:
                    about = file.stat()
                except OSError:
                    # taken away at this moment
                    continue
                row = _counts(file.path, (about.st_mtime_ns, about.st_ino))
                if row is not None:
                    done.add(int(stem))
                    rows.append(row)
    at_work = {u: who for u in sorted(claims) if u not in done and (who := owner(folder.claim(u)))}
    finished = sum(row.cases for row in rows)
    last = sorted(rows, key=lambda row: row.finished)[-RECENT:]
    usual = max((row.wall_seconds for row in last), default=float("inf"))
    words = {u: f"unit {u}: {told(who)}" for u, who in at_work.items()}
    late = [u for u, who in at_work.items() if who["silent"] > LONG + BEAT or who["age"] > max(LONG, MUCH * usual)]
    left, rate = folder.case_count - finished, None if late else _rate(last, len(at_work))
    return CampaignStatus(
        cases=folder.case_count,
        done=finished,
        failed=sum(row.failed for row in rows),
        reused=sum(row.reused for row in rows),
        running=sum(folder.size(u) for u in at_work),
        units=folder.unit_count,
        units_done=len(rows),
        processor_seconds=sum(row.processor_seconds for row in rows),
        simulation_seconds=sum(row.simulation_seconds for row in rows),
        eta=0.0 if left == 0 else left / rate if rate else None,
        not_numbers=sum(row.not_numbers for row in rows),
        codes=max(1, len(one_code(folder, {row.code for row in rows}))),
        late=tuple(words[u] for u in late),
        at_work=tuple(words.values()),
        rate=rate,
    )


def _rate(last: list[_Unit], at_work: int) -> float | None:
    """Return the cases a second at the pace of the last units, by durations alone: clocks may differ."""
    seconds = sum(row.wall_seconds for row in last)
    return at_work * sum(row.cases for row in last) / seconds if seconds > 0.0 and at_work else None
