"""Results of equal cases of other campaigns, found by their content."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.folder import Folder
from gearmbs.campaigns.settings import CampaignError, CampaignWarning
from gearmbs.campaigns.subjects.base import DONE, Kept

_known: dict[tuple[str, ...], Reuse] = {}


class Reuse:
    """The finished cases of some campaigns by their keys, which tell content and code.

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
        self._at: dict[str, tuple[Folder, int, int]] = {}
        self._tables: dict[tuple[Path, int], list[dict[str, Any]]] = {}
        for path in paths:
            folder = Folder(path)
            if set(keep) - set(folder.plan.keep):
                missing = ", ".join(sorted(set(keep) - set(folder.plan.keep)))
                raise CampaignError(f"reuse: {path} does not keep {missing}; leave it out, or keep the same")
            for unit in folder.done():
                try:
                    ids = folder.unit_table(unit, ["id", "status"]).to_pydict()
                except CampaignError as error:
                    warnings.warn(f"reuse: {path}: {error}; its cases are simulated", CampaignWarning, stacklevel=2)
                    continue
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

    def find(self, key: str) -> Kept | None:
        """Return what is kept of a case with this key, or None."""
        place = self._at.get(key)
        if place is None:
            return None
        folder, unit, k = place
        at = (folder.path, unit)
        try:
            if at not in self._tables:
                self._tables = {at: folder.unit_table(unit).to_pylist()}
            row = self._tables[at][k]
            skip = {*folder.cases(unit)[0], "slot", "id", "status", "message", "advice"}
            numbers = {n: float(v) for n, v in row.items() if n not in skip and v is not None}
            return Kept(numbers, _signals(folder, row["slot"]))
        except CampaignError as error:
            warnings.warn(f"reuse: {folder.path}: {error}; the case is simulated", CampaignWarning, stacklevel=2)
            return None


def _signals(folder: Folder, slot: int) -> dict[str, np.ndarray]:
    found = {}
    for spec in folder.specs:
        values = folder.stored_signals(spec, np.array([slot])).read((0, slice(None), slice(None)))
        long = np.flatnonzero(np.isfinite(values).any(axis=0))
        found[spec.name] = values[:, : int(long[-1]) + 1 if long.size else 0]
    return found
