"""Results of equal cases of other campaigns, found by their content."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gearmbs.campaigns.folder import Folder
from gearmbs.campaigns.plans.plan import TAKEN
from gearmbs.campaigns.settings import CampaignError, CampaignWarning
from gearmbs.campaigns.subjects.base import DONE, Kept, SignalSpec

_known: dict[tuple[str, ...], tuple[Folder, Reuse]] = {}


class Reuse:
    """The finished cases of some campaigns by their keys, which tell content and code.

    Parameters
    ----------
    paths : sequence of path-like
        Folders of campaigns that keep the same.
    keep : tuple of str
        What the new campaign keeps.
    specs : sequence of SignalSpec
        Its arrays of signals.
    on_failure : str
        What it does with a case that fails. Results at a tighter tolerance than the case's own are taken over where it
        would have come to them itself.

    Attributes
    ----------
    tightened : set of str
        Keys of cases with such results.

    Raises
    ------
    CampaignError
        If one of them keeps something else: its results would not do. Records and signals beyond those that are kept do
        no harm; of numbers nothing says which of the entries they come from.
    """

    def __init__(
        self, paths: tuple[str, ...], keep: tuple[str, ...], specs: Sequence[SignalSpec], on_failure: str = "record"
    ) -> None:
        self._specs = specs
        self.tightened: set[str] = set()
        self._at: dict[str, tuple[Folder, int, int]] = {}
        self._tables: dict[tuple[Path, int], list[dict[str, Any]]] = {}
        self.folders = [Folder(path) for path in paths]
        for path, folder in zip(paths, self.folders, strict=True):
            if set(keep) - set(folder.plan.keep):
                missing = ", ".join(sorted(set(keep) - set(folder.plan.keep)))
                raise CampaignError(f"reuse: {path} does not keep {missing}; leave it out, or keep the same")
            if more := sorted(item for item in set(folder.plan.keep) - set(keep) if not _apart(item)):
                raise CampaignError(
                    f"reuse: {path} keeps {', '.join(more)} besides, whose numbers cannot be told from the others; "
                    "leave it out, or keep the same"
                )
            for unit in folder.done():
                try:
                    ids = folder.unit_table(unit, ["id", "status", "index"]).to_pydict()
                    tighter = _tightened(folder, unit)
                except CampaignError as error:
                    warnings.warn(f"reuse: {path}: {error}; its cases are simulated", CampaignWarning, stacklevel=2)
                    continue
                for k, (key, status, index) in enumerate(zip(*(ids[name] for name in ("id", "status", "index")))):
                    of_another = tighter is None or index in tighter
                    if status != DONE or key in self._at or (of_another and on_failure != "tighter"):
                        continue
                    self._at[key] = folder, unit, k
                    if of_another:
                        self.tightened.add(key)

    @classmethod
    def of(cls, folder: Folder) -> Reuse | None:
        """Return what a campaign may take over; None if nothing."""
        plan = folder.plan
        if not plan.reuse:
            return None
        key = (str(folder.path), *plan.reuse)
        known = _known.get(key)
        # folders may be made anew under the same names
        if known is None or known[0] is not folder or any(source.changed for source in known[1].folders):
            _known[key] = known = folder, cls(plan.reuse, plan.keep, folder.specs, plan.on_failure)
        return known[1]

    def record(self, key: str) -> bytes | None:
        """Return the content of the file of the record of a case with this key, or None."""
        folder, unit, k = self._at[key]
        try:
            return folder.record(unit, folder.cases(unit)[k]["index"])
        except CampaignError as error:
            warnings.warn(f"reuse: {folder.path}: {error}; the case is simulated", CampaignWarning, stacklevel=2)
            return None

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
            planned = folder.cases(unit)[0]
            taken = folder.taken
            numbers = {
                # a name that a column of that plan had taken
                n.removeprefix("result.") if n.removeprefix("result.") in taken else n: float(v)
                for n, v in row.items()
                if n not in {*planned, *TAKEN} and v is not None
            }
            signals = _signals(folder, row["slot"], self._specs)
            kept = None if signals is None else Kept(numbers, signals)
            return None if kept is None or _in_doubt(folder, unit, kept) else kept
        except CampaignError as error:
            warnings.warn(f"reuse: {folder.path}: {error}; the case is simulated", CampaignWarning, stacklevel=2)
            return None


def _tightened(folder: Folder, unit: int) -> set[int] | None:
    """Return which cases of a unit were done at a tighter tolerance than their own; None if that is not known."""
    entry = folder.entry(unit)
    if "tightened" in entry:
        return set(entry["tightened"])
    return None if folder.plan.on_failure == "tighter" else set()


def _apart(item: str) -> bool:
    """Whether what an entry of ``keep`` leaves behind stands apart from the numbers."""
    return item == "record" or item.startswith("signal:")


def _in_doubt(folder: Folder, unit: int, kept: Kept) -> bool:
    """Whether a signal may end with values that are no numbers, which are stored as what lies beyond its end."""
    if not folder.entry(unit)["not_numbers"] or not kept.finite:
        return False
    return any(kept.signals[s.name].shape[1] < s.samples for s in folder.specs if s.name in kept.signals)


def _signals(folder: Folder, slot: int, specs: Sequence[SignalSpec]) -> dict[str, np.ndarray] | None:
    """Return the signals of a slot for the arrays of another campaign, by their channels; None if they do not fit."""
    stored = {spec.name: spec for spec in folder.specs}
    found = {}
    for spec in specs:
        there = stored.get(spec.name)
        if (
            there is None
            or (there.rate, there.units) != (spec.rate, spec.units)
            or set(spec.channels) - {*there.channels}
        ):
            return None
        values = folder.stored_signals(there, np.array([slot])).read((0, slice(None), slice(None)))
        values = values[[there.channels.index(channel) for channel in spec.channels]]
        long = np.flatnonzero(np.isfinite(values).any(axis=0))
        found[spec.name] = values[:, : int(long[-1]) + 1 if long.size else 0]
        if found[spec.name].shape[1] > spec.samples:
            return None
    return found
