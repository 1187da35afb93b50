"""How far a campaign is, and whether what is stored is what was computed: read from its files by anybody."""

from __future__ import annotations

import hashlib
import json
import os
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from gearmbs.campaigns.folder import Folder
from gearmbs.campaigns.settings import CampaignError
from gearmbs.studies.run.engine import owner

REMEDY = "gearmbs campaign check --sweep takes out what is damaged, and run does it again"

RECENT = 20
"""Units by whose pace the remaining time is judged."""


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
        Seconds until the end at the pace of the last units; None if there is none yet.
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
        for count, word in ((self.failed, "failed"), (self.reused, "taken over"), (self.running, "in work")):
            if count:
                parts.append(f"{count} {word}")
        if self.eta is not None and not self.complete:
            parts.append(f"about {_duration(self.eta)} left")
        return ", ".join(parts)

    def _repr_html_(self) -> str:
        """Return the bar and the words, for notebooks."""
        return f"<progress value='{self.fraction:.4f}' max='1'></progress> {self}"


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


@lru_cache(maxsize=200_000)
def _counts(path: str, written: int) -> tuple[int, int, int, float, float, float, float] | None:
    """Return what is counted of a ledger that was written at a time; a ledger may be taken away and written again."""
    entry = read_ledger(Path(path))
    if entry is None:
        return None
    names = ("cases", "failed", "reused", "processor_seconds", "simulation_seconds", "started", "finished")
    return tuple(entry[name] for name in names)  # type: ignore[return-value]


def read_ledger(path: Path) -> dict[str, Any] | None:
    """Return a ledger, or None if it is not there.

    Raises
    ------
    CampaignError
        If it is damaged.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        return None
    except ValueError:
        raise CampaignError(f"{path}: this ledger is damaged; {REMEDY}") from None


def read_status(folder: Folder) -> CampaignStatus:
    """Return how far a campaign is."""
    rows, done, claims = [], set(), []
    with os.scandir(folder.path / "units") as files:
        for file in files:
            stem, _, kind = file.name.partition(".")
            if not stem.isdigit():
                continue
            if kind == "claim":
                claims.append(int(stem))
            elif kind == "json":
                try:
                    row = _counts(file.path, file.stat().st_mtime_ns)
                except OSError:
                    # taken away at this moment
                    continue
                if row is not None:
                    done.add(int(stem))
                    rows.append(row)
    at_work = [u for u in claims if u not in done and owner(folder.claim(u))]
    finished = sum(row[0] for row in rows)
    return CampaignStatus(
        cases=folder.case_count,
        done=finished,
        failed=sum(row[1] for row in rows),
        reused=sum(row[2] for row in rows),
        running=sum(folder.size(u) for u in at_work),
        units=folder.unit_count,
        units_done=len(rows),
        processor_seconds=sum(row[3] for row in rows),
        simulation_seconds=sum(row[4] for row in rows),
        eta=_eta(rows, folder.case_count - finished),
    )


def _eta(rows: list[tuple], left: int) -> float | None:
    """Return the remaining time at the pace of the last units."""
    last = sorted(rows, key=lambda row: row[6])[-RECENT:]
    if not last or left == 0:
        return None if not last else 0.0
    span = max(row[6] for row in last) - min(row[5] for row in last)
    return left * span / max(1, sum(row[0] for row in last))


def check_folder(folder: Folder, *, sweep: bool = False) -> list[str]:
    """Return what is wrong with what is stored and what was left by killed workers; see `Campaign.check`."""
    from gearmbs.campaigns.folder import stored_digest

    found = []
    for unit in folder.done():
        try:
            entry = read_ledger(folder.ledger(unit)) or {"digests": {}}
        except CampaignError:
            found.append(f"unit {unit}: the ledger is damaged")
            if sweep:
                folder.ledger(unit).unlink(missing_ok=True)
            continue
        wrong = []
        for name, digest in entry["digests"].items():
            try:
                now = (
                    hashlib.sha256(folder.table(unit).read_bytes()).hexdigest()
                    if name == "table"
                    else stored_digest(folder.signals, name, folder.plan.unit, unit)
                )
            except (OSError, KeyError) as error:
                now = f"missing ({error})"
            if now != digest:
                wrong.append(name)
        if wrong:
            found.append(f"unit {unit}: {', '.join(wrong)} not as the ledger says")
            if sweep:
                folder.ledger(unit).unlink(missing_ok=True)
    if sweep and folder.specs and not folder.signals.exists():
        from gearmbs.campaigns.folder import make_store

        make_store(folder.signals, folder.specs, folder.plan.unit, folder.unit_count)
    litter = [p for p in folder.path.rglob(".*") if p.is_file()]
    litter += [p for p in folder.path.rglob("*.partial*") if p.is_file()]
    litter += [p for p in (folder.path / "units").glob("*.claim") if owner(p) is None]
    for path in litter:
        # what is younger may belong to somebody at work
        if time.time() - path.stat().st_mtime > 60.0 or path.suffix == ".claim":
            found.append(f"litter: {path.relative_to(folder.path)}")
            # the claims of what is not done count its attempts
            if sweep and (path.suffix != ".claim" or path.with_suffix(".json").exists()):
                path.unlink(missing_ok=True)
    return found
