"""A unit of cases: carried out, stored, entered in the ledger. A function of the folder and the unit's number.

The order makes it safe to be killed at any moment: signals, then the table, then the ledger, each under its final name
only when whole. Without the ledger the unit is done again, with the same bits.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.case_runner import CaseResult, CaseRunner, GuardedRunner
from gearmbs.campaigns.folder import Folder, surroundings
from gearmbs.campaigns.settings import CampaignError
from gearmbs.campaigns.subjects.base import DONE, Kept, Outcome
from gearmbs.files import whole_file, write_whole
from gearmbs.studies.run.engine import Claim, claimed
from gearmbs.studies.run.workers import Claimed

# Results of equal cases of other campaigns, found by their content.


_known: dict[tuple[str, ...], Reuse] = {}


class Reuse:
    """The finished cases of some campaigns by their keys.

    Parameters
    ----------
    paths : sequence of path-like
        Folders of campaigns that keep the same.
    keep : tuple of str
        What the new campaign keeps.

    Raises
    ------
    CampaignError
        If one of them keeps something else: its results would not do.
    """

    def __init__(self, paths: tuple[str, ...], keep: tuple[str, ...]) -> None:
        import pyarrow.parquet as pq

        self._at: dict[str, tuple[Folder, int, int]] = {}
        self._tables: dict[tuple[Path, int], list[dict[str, Any]]] = {}
        for path in paths:
            folder = Folder(path)
            if set(keep) - set(folder.plan.keep):
                missing = ", ".join(sorted(set(keep) - set(folder.plan.keep)))
                raise CampaignError(f"reuse: {path} does not keep {missing}; leave it out, or keep the same")
            for unit in folder.done():
                ids = pq.ParquetFile(folder.table(unit)).read(["id", "status"]).to_pydict()
                for k, (key, status) in enumerate(zip(ids["id"], ids["status"])):
                    if status == DONE:
                        self._at.setdefault(key, (folder, unit, k))

    @classmethod
    def of(cls, folder: Folder) -> Reuse | None:
        """Return what a campaign may take over; None if nothing."""
        plan = folder.plan
        if not plan.reuse:
            return None
        key = (str(folder.path), *plan.reuse)
        if key not in _known:
            _known[key] = cls(plan.reuse, plan.keep)
        return _known[key]

    def find(self, key: str) -> CaseResult | None:
        """Return the stored result of a case with this key, or None."""
        import pyarrow.parquet as pq

        place = self._at.get(key)
        if place is None:
            return None
        folder, unit, k = place
        at = (folder.path, unit)
        if at not in self._tables:
            self._tables = {at: pq.ParquetFile(folder.table(unit)).read().to_pylist()}
        row = self._tables[at][k]
        skip = {*folder.cases(unit)[0], "slot", "id", "status", "message", "advice"}
        numbers = {n: float(v) for n, v in row.items() if n not in skip and v is not None}
        return CaseResult(Outcome(), Kept(numbers, self._signals(folder, row["slot"])), key, reused=True)

    def _signals(self, folder: Folder, slot: int) -> dict[str, np.ndarray]:
        if not folder.specs:
            return {}
        import zarr

        group = zarr.open_group(folder.signals, mode="r")
        found = {}
        for spec in folder.specs:
            array: Any = group[spec.name]
            values = np.asarray(array[slot])
            long = np.flatnonzero(np.isfinite(values).any(axis=0))
            found[spec.name] = values[:, : int(long[-1]) + 1 if long.size else 0]
        return found


GUARD_AFTER = 2
"""Attempts of a unit that came to no end, after which its cases run in a process of their own."""

_folders: dict[str, tuple[float, Folder]] = {}


def open_folder(path: str | Path) -> Folder:
    """Return the folder of a campaign, read again only when its plan has changed."""
    key, stamp = str(path), (Path(path) / "plan.json").stat().st_mtime
    if key not in _folders or _folders[key][0] != stamp:
        _folders[key] = (stamp, Folder(path))
    return _folders[key][1]


def work_unit(path: str, unit: int, _report: Callable[[float], None] | None = None) -> bool:
    """Carry out a unit unless it is done; it is claimed meanwhile. An error says which unit it was.

    Raises
    ------
    Claimed
        If somebody is at work on it.
    OSError
        If the disk does not take the results; the unit is not done then.
    CampaignError
        With ``on_failure="stop"`` if a case fails.
    """
    folder = open_folder(path)
    try:
        return claimed(folder, unit, partial(_work, folder, unit))
    except (Claimed, CampaignError):
        raise
    except OSError as error:
        raise OSError(error.errno, f"unit {unit}: {error.strerror or error}", error.filename) from error
    except Exception as error:
        raise RuntimeError(f"unit {unit}: {type(error).__name__}: {error}") from error


def _work(folder: Folder, unit: int, claim: Claim) -> bool:
    started, cpu = time.time(), time.process_time()
    rows = folder.cases(unit)
    guarded = claim.attempts >= GUARD_AFTER
    runner = GuardedRunner(folder) if guarded else CaseRunner(folder)
    reuse = Reuse.of(folder)
    results: list[CaseResult] = []
    known: dict[str, CaseResult] = {}
    stop = folder.plan.on_failure == "stop"
    try:
        for row in rows:
            claim.beat()
            result = _one(runner, row, known, reuse)
            if stop and result.outcome.status != DONE:
                case = f"case {row['index']}: {result.outcome.message}"
                raise CampaignError(f"stopped at the first failure, as the plan wants: {case}")
            results.append(result)
    finally:
        runner.close()
    digests = _store(folder, unit, rows, results)
    seconds = [round(r.seconds, 4) for r in results]
    entry = {
        "unit": unit,
        "cases": len(rows),
        "failed": sum(r.outcome.status != DONE for r in results),
        "reused": sum(r.reused for r in results),
        "index": [rows[0]["index"], rows[-1]["index"] + 1],
        "status": {str(row["index"]): r.outcome.status for row, r in zip(rows, results) if r.outcome.status != DONE},
        "seconds": seconds,
        "processor_seconds": round(time.process_time() - cpu, 4),
        "simulation_seconds": round(sum(seconds), 4),
        "started": started,
        "finished": time.time(),
        "attempts": claim.attempts,
        "guarded": guarded,
        "digests": digests,
        **surroundings(),
    }
    write_whole(folder.ledger(unit), json.dumps(entry))
    return True


def _one(runner: CaseRunner, row: dict[str, Any], known: dict[str, CaseResult], reuse: Reuse | None) -> CaseResult:
    """Return the result of a case: that of an equal one of this unit or of another campaign, or a new one."""
    if reuse is not None:
        thing, prepared = runner.prepare(row)
        if thing is not None:
            found = known.get(prepared.key) or reuse.find(prepared.key)
            if found is not None:
                return found
    result = runner.run(row)
    if reuse is not None and result.outcome.status == DONE:
        known[result.key] = CaseResult(result.outcome, result.kept, result.key, reused=True)
    return result


def _store(folder: Folder, unit: int, rows: list[dict[str, Any]], results: list[CaseResult]) -> dict[str, str]:
    """Write signals and table of a unit; return digests."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    plan = folder.plan
    digests: dict[str, str] = {}
    if folder.specs:
        from gearmbs.campaigns.folder import write_signals

        digests = write_signals(folder.signals, folder.specs, plan.unit, unit, [r.kept.signals for r in results])
    columns: dict[str, Any] = {name: [row[name] for row in rows] for name in rows[0]}
    columns["slot"] = [unit * plan.unit + k for k in range(len(rows))]
    columns["id"] = [r.key for r in results]
    for name in ("status", "message", "advice"):
        columns[name] = [getattr(r.outcome, name) for r in results]
    table = {name: pa.array(values) for name, values in columns.items()}
    taken = set(table)
    for name in dict.fromkeys(key for r in results for key in r.kept.numbers):
        # a result must not take the place of a factor or of the status
        column = f"result.{name}" if name in taken else name
        table[column] = pa.array([r.kept.numbers.get(name) for r in results], type=pa.float64())
    with whole_file(folder.table(unit)) as part:
        pq.write_table(pa.table(table), part, compression="zstd")
        digests["table"] = hashlib.sha256(part.read_bytes()).hexdigest()
    return digests
