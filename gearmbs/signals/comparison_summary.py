"""A comparison in short: what repeats at every load, and whether that was to be expected."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import pandas as pd
import xarray as xr

from .expectations import EXPECTED


class Compared(Protocol):
    """What the summary needs of a comparison; `ComparisonReport` has it."""

    data: xr.Dataset

    @property
    def faults(self) -> list[str]:
        """The states but the reference."""

    def changes(self, side: str = "experiment") -> xr.DataArray:
        """Change of each harmonic against the reference state, dB."""

    def expectations(self) -> pd.DataFrame:
        """Expected against found."""


MOSTLY = 0.75
"""Share of values from which "mostly" is said."""


def summary(report: Compared, change_db: float) -> list[str]:
    """Two sentences for each fault: which harmonics move the same way at every load, and how much of it was expected.

    Parameters
    ----------
    report : ComparisonReport
    change_db : float
        A harmonic rises or falls if it changes by more than this.
    """
    lines = []
    for state in report.faults:
        parts = [_harmonic(report, state, int(k), change_db) for k in report.data["harmonic"].values]
        loads = "at every load" if report.data.sizes["load"] > 1 else f"at load {report.data['load'].values[0]}"
        said = "; ".join(part for part in parts if part)
        found = f"{state}: {loads} {said}" if said else f"{state}: no harmonic moves the same way {loads}"
        lines.append(f"{found}.{_still(report, state, change_db)}")
        verdict = _verdict(report, state)
        if verdict:
            lines.append(f"{state}: {verdict}")
    return lines


def _moves(report: Compared, state: str, k: int) -> tuple[list[str], np.ndarray]:
    """Channel names, and changes in dB of shape (loads, channels)."""
    change = report.changes().sel(state=state, harmonic=k)
    if "channel" not in change.dims:
        return [""], np.asarray(change.values, dtype=float).reshape(-1, 1)
    names = [str(c) for c in change["channel"].values]
    return names, np.asarray(change.transpose("load", "channel").values, dtype=float)


def _harmonic(report: Compared, state: str, k: int, change_db: float) -> str:
    names, change = _moves(report, state, k)
    known = change[np.isfinite(change).all(axis=1)]
    if not known.size:
        return ""
    parts = []
    for word, sign in (("rises", 1.0), ("falls", -1.0)):
        same = np.flatnonzero((sign * known > change_db).all(axis=0))
        shown = [f"{names[c]} ({_numbers(known[:, c])} dB)".strip() for c in same]
        if shown:
            parts.append(f"{word} on {_listed(shown)}" if names != [""] else f"{word} {shown[0]}")
    return f"{k} x GMF " + " and ".join(parts) if parts else ""


def _still(report: Compared, state: str, change_db: float) -> str:
    """Name the channels on which no harmonic moves the same way at every load."""
    names, _ = _moves(report, state, int(report.data["harmonic"].values[0]))
    if names == [""]:
        return ""
    moved: set[int] = set()
    for k in report.data["harmonic"].values:
        change = _moves(report, state, int(k))[1]
        known = change[np.isfinite(change).all(axis=1)]
        for sign in (1.0, -1.0):
            moved |= set(np.flatnonzero((sign * known > change_db).all(axis=0)).tolist())
    still = [name for i, name in enumerate(names) if i not in moved]
    if not still or len(still) == len(names):
        return ""
    return f" On {_listed(still)} nothing does."


def _verdict(report: Compared, state: str) -> str:
    table = report.expectations()
    table = table[table["state"] == state]
    if not len(table):
        return f"no expectation is known for {state!r}; it is for {', '.join(EXPECTED)}."
    parts = []
    for word, rows in table.groupby("expected", sort=False):
        features = list(dict.fromkeys(rows["feature"]))
        met, total = int(rows["met"].sum()), int(rows["of"].sum())
        share = met / total
        verdict = (
            "as expected"
            if met == total
            else "mostly as expected"
            if share >= MOSTLY
            else "in part as expected"
            if share > 0.5
            else "not as expected"
        )
        first, space, rest = str(word).partition(" ")
        verb = str(word) if len(features) == 1 else f"{first.removesuffix('s')}{space}{rest}"
        parts.append(f"{_listed(features)} {verb}, which {met} of {total} values do: {verdict}")
    return f"expected is that {'; and that '.join(parts)}."


def _numbers(values: np.ndarray) -> str:
    return ", ".join(f"{v:+.1f}" for v in values)


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
