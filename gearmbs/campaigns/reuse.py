"""Results of equal cases of other campaigns, found by their content."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.case_runner import CaseResult
from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.folder import Folder
from gearmbs.campaigns.subjects.base import DONE, Kept, Outcome

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
