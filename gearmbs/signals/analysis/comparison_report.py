"""What a comparison of states and loads found, as data, tables and Markdown."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs._display import Shown
from gearmbs.signals.analysis.report import LOUD, markdown_table, significant
from gearmbs.signals.signal.signal import UNKNOWN_UNITS

# What each fault is expected to do to the mesh harmonics and the indicators.


# What each fault is expected to do, by harmonic or indicator: +1 rises, 0 stays, by name of the state.
# Misalignment and centre distance after the paper; local tooth faults after the usual reading: a short disturbance once
# a revolution spreads over many sidebands and leaves the mesh harmonics, averages over all teeth, much as they were.
EXPECTED: dict[str, dict[int | str, int]] = {
    "misaligned": {2: 1},
    "distance": {1: 1, 2: 1, 3: 1},
    "broken": {1: 0, 2: 0, 3: 0, "sideband_level": 1, "energy_ratio": 1, "fm4": 1, "kurtosis": 1},
    "chipped": {1: 0, 2: 0, 3: 0, "sideband_level": 1, "energy_ratio": 1, "fm4": 1, "kurtosis": 1},
}
"""What each fault is expected to do; see `ComparisonReport.expectations`."""
CALLED: dict[str, str] = {
    "misaligned": r"misalign(ed|ment)|tilt(ed)?|skew(ed)?|inclined",
    "distance": r"wid(e|er|ened)|(cent(er|re)|axis|axle)? ?distance|moved apart",
    "broken": r"broken|missing tooth",
    "chipped": r"chip(ped)?",
}
"""Words of the names of states by which they are known: the paper's third state is the widened one."""


def state_meant(name: str) -> str | None:
    """Return the fault of `EXPECTED` that a state's name speaks of, or None.

    Examples
    --------
    >>> [state_meant(name) for name in ("wider", "Centre distance +3 mm", "misalignment_2", "worn")]
    ['distance', 'distance', 'misaligned', None]
    """
    words = " ".join(re.findall(r"[a-z]+", name.lower()))
    found = [fault for fault, pattern in CALLED.items() if re.search(rf"\b({pattern})\b", words)]
    return found[0] if len(found) == 1 else None


# A comparison in short: what repeats at every load, and whether that was to be expected.


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


def _common_moves(report: Compared, state: str, k: int) -> tuple[list[str], np.ndarray]:
    """Channel names, and changes in dB of shape (loads, channels)."""
    change = report.changes().sel(state=state, harmonic=k)
    if "channel" not in change.dims:
        return [""], np.asarray(change.values, dtype=float).reshape(-1, 1)
    names = [str(c) for c in change["channel"].values]
    return names, np.asarray(change.transpose("load", "channel").values, dtype=float)


def _harmonic(report: Compared, state: str, k: int, change_db: float) -> str:
    names, change = _common_moves(report, state, k)
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
    names, _ = _common_moves(report, state, int(report.data["harmonic"].values[0]))
    if names == [""]:
        return ""
    moved: set[int] = set()
    for k in report.data["harmonic"].values:
        change = _common_moves(report, state, int(k))[1]
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
    meant = state_meant(state)
    if meant is None:
        return (
            f"no expectation is known for {state!r}; it is for {', '.join(EXPECTED)} and what else they are called "
            "(tilted, wider, centre distance)."
        )
    if not len(table):
        return f"what is expected of it as of {meant!r} cannot be told from the harmonics that are here."
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


# How well two tables of levels agree: in order, and in dB.


TIE = 0.01
"""Relative difference up to which two levels are equal: levels of a repeated measurement scatter by as much at best."""


def ordinal_agreement(experiment: np.ndarray, model: np.ndarray, tie: float = TIE) -> float:
    """Fraction of the pairs of states that two lists of values put in the same order.

    Values within the fraction `tie` of each other count as equal; equal in one list and not in the other is a
    disagreement of one half. 1 means the same order throughout, 0 the reverse.

    Parameters
    ----------
    experiment, model : ndarray of shape (states,)
    """
    score, pairs = 0.0, 0
    for i in range(len(experiment)):
        for j in range(i + 1, len(experiment)):
            a, b = _order(experiment[i], experiment[j], tie), _order(model[i], model[j], tie)
            score += 1.0 - 0.5 * abs(a - b)
            pairs += 1
    return score / pairs if pairs else math.nan


def level_distance(experiment: np.ndarray, model: np.ndarray) -> float:
    """Distance in dB: root mean square over all values of 20 log10(model / experiment); zero for equal tables."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = 20.0 * np.log10(np.asarray(model) / np.asarray(experiment))
    return float(np.sqrt(np.mean(ratio**2)))


def _order(a: float, b: float, tie: float) -> int:
    if abs(a - b) <= tie * max(abs(a), abs(b)):
        return 0
    return 1 if a > b else -1


CHANGE_DB = 1.0
"""From which a level counts as changed: an eighth, as two measurements of one machine differ."""
STAYS_DB = 3.0
"""Within which a level counts as unchanged where it is expected to stay: a factor 1.4."""
INDICATOR_TIE = 0.05
"""Relative change of an indicator from which it counts: a twentieth, as they scatter from record to record."""
LEVELS_APART_DB = 30.0
"""By which the whole of a record may differ from the reference: a factor of 32, where a thousandth of a unit is 60 dB
and a gain of a hundred 40."""
CONTRADICTION_DB = 3.0
"""By which a level has to fall on one channel and rise on another for the report to say that channels contradict."""


@dataclass
class ComparisonReport(Shown):
    """Gear mesh harmonics of states and loads.

    Attributes
    ----------
    data : xarray.Dataset
        `experiment` and, with a model, `model` (scaled) of dimensions (load, state, harmonic), plus channel without a
        model: RMS in the units of the experiment. Also `gmf` and `level` (RMS of the record) by load and state, the
        indicators, `factor` and `model_unscaled`.
    reference : str
        The state the others are held against.
    left_out : list of str
        Cases that only one side has.
    notes : list of str
        What was done to the records: conversions, drop-outs bridged.
    """

    data: xr.Dataset
    reference: str
    left_out: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def has_model(self) -> bool:
        """Whether there is a model to compare with."""
        return "model" in self.data

    @property
    def faults(self) -> list[str]:
        """The states but the reference."""
        return [str(s) for s in self.data["state"].values if s != self.reference]

    def changes(self, side: str = "experiment") -> xr.DataArray:
        """Change of each harmonic against the reference state, in dB, dimensions (load, state, harmonic[, channel])."""
        values = self.data[side]
        ratio = values / values.sel(state=self.reference, drop=True)
        change = ratio.copy(data=20.0 * np.log10(ratio.values))
        return change.sel(state=self.faults).assign_attrs(units="dB")

    def agreement(self) -> xr.Dataset:
        """Agreement of model and experiment.

        Returns
        -------
        xarray.Dataset
            `ordinal` (load, harmonic): fraction of the pairs of states in the same order; `ordinal_load` (state,
            harmonic): the same for the pairs of loads; `distance` (load,): dB, root mean square over states and
            harmonics; `same_direction` (load, state, harmonic): whether a fault moves the harmonic the same way.
        """
        if not self.has_model:
            raise ValueError("agreement: there is no model in this comparison")
        a, b = self.data["experiment"], self.data["model"]
        complete = np.isfinite(a.values) & np.isfinite(b.values)
        loads, states, numbers = self.data["load"].values, self.data["state"].values, self.data["harmonic"].values
        ordinal = np.empty((loads.size, numbers.size))
        by_load = np.empty((states.size, numbers.size))
        distance = np.empty(loads.size)
        for i in range(loads.size):
            kept = complete[i].all(axis=1)
            distance[i] = level_distance(a.values[i][kept], b.values[i][kept])
            for k in range(numbers.size):
                ordinal[i, k] = ordinal_agreement(a.values[i, kept, k], b.values[i, kept, k])
        for j in range(states.size):
            kept = complete[:, j].all(axis=1)
            for k in range(numbers.size):
                by_load[j, k] = ordinal_agreement(a.values[kept, j, k], b.values[kept, j, k])
        one, two = self.changes("experiment"), self.changes("model")
        same = one.copy(data=np.sign(one.values) == np.sign(two.values)).assign_attrs(units="1")
        return xr.Dataset(
            {
                "ordinal": (("load", "harmonic"), ordinal),
                "ordinal_load": (("state", "harmonic"), by_load),
                "distance": ("load", distance, {"units": "dB"}),
                "same_direction": same,
            },
            coords={"load": loads, "state": states, "harmonic": numbers},
        )

    def expectations(self, expected: Mapping[str, Mapping[int | str, int]] | None = None) -> pd.DataFrame:
        """Expected against found, fault by fault, in the experiment.

        Parameters
        ----------
        expected : mapping of state to mapping of harmonic number or indicator name to +1, 0 or -1, optional
            Rises, stays (harmonics only, within 3 dB) or falls; default `EXPECTED`, by what the states are called
            (`state_meant`).

        Returns
        -------
        pandas.DataFrame
            Columns load, state, feature, expected, found (median change over channels, in dB for harmonics and as a
            ratio for indicators), channels (how many moved as expected, of how many that show a mesh line), as_expected
            (more than half did), met and of (the numbers in channels).
        """
        rows = []
        names = self.data["channel"].values if "channel" in self.data["experiment"].dims else [""]
        votes = np.array([str(name) not in self.data.attrs.get("silent", ()) for name in names])
        for state in self.faults:
            own = EXPECTED.get(state_meant(state) or "", {}) if expected is None else expected.get(state, {})
            for feature, sign in own.items():
                for load in self.data["load"].values:
                    if isinstance(feature, int):
                        if feature not in self.data["harmonic"].values:
                            continue
                        change = np.atleast_1d(self.changes().sel(load=load, state=state, harmonic=feature).values)
                        change = change[votes]
                        if not np.isfinite(change).any():
                            continue
                        moved = sign * change > CHANGE_DB if sign else np.abs(change) <= STAYS_DB
                        shown = f"{np.nanmedian(change):+.1f} dB"
                        name = f"{feature} x GMF"
                    else:
                        pair = self.data[feature].sel(load=load)
                        ratio = np.atleast_1d((pair.sel(state=state) / pair.sel(state=self.reference)).values)[votes]
                        if not np.isfinite(ratio).any():
                            continue
                        moved, shown = sign * (ratio - 1.0) > INDICATOR_TIE, f"x {np.nanmedian(ratio):.2f}"
                        name = feature.replace("_", " ")
                    word = "rises" if sign > 0 else "falls" if sign < 0 else f"stays within {STAYS_DB:g} dB"
                    met, of = int(moved.sum()), moved.size
                    rows.append((load, state, name, word, shown, f"{met} of {of}", bool(2 * met > of), met, of))
        columns = ["load", "state", "feature", "expected", "found", "channels", "as_expected", "met", "of"]
        return pd.DataFrame(rows, columns=columns)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers as tables: harmonics (side by side), changes, expectations; with a model agreement, distance."""
        names = ["experiment", "model"] if self.has_model else ["experiment"]
        tables = {
            "harmonics": self.data[names].to_dataframe()[names].reset_index(),
            "changes": self.changes().to_dataframe(name="change_db")["change_db"].reset_index(),
            "expectations": self.expectations(),
        }
        if self.has_model:
            found = self.agreement()
            tables["agreement"] = found["ordinal"].to_dataframe().reset_index()
            tables["distance"] = found["distance"].to_dataframe().reset_index()
        return tables

    def sentences(self) -> list[str]:
        """What each fault does to the harmonics, in plain words, load by load."""
        found = []
        units = "channels" if not self.has_model else "channel"
        change = self.changes()
        other = self.changes("model") if self.has_model else None
        for state in self.faults:
            for load in self.data["load"].values:
                clauses = []
                for k in self.data["harmonic"].values:
                    values = np.atleast_1d(change.sel(load=load, state=state, harmonic=k).values)
                    if not np.isfinite(values).any():
                        continue
                    up, down = int((values > CHANGE_DB).sum()), int((values < -CHANGE_DB).sum())
                    middle = float(np.nanmedian(values))
                    if other is not None:
                        simulated = float(other.sel(load=load, state=state, harmonic=k))
                        clauses.append(
                            f"{k} x GMF {_moves(middle)} ({middle:+.1f} dB, in the model {simulated:+.1f} dB)"
                        )
                    else:
                        spread = f"{np.nanmin(values):+.1f} to {np.nanmax(values):+.1f} dB"
                        clauses.append(
                            f"{k} x GMF rises on {up} and falls on {down} of {values.size} {units} ({spread})"
                        )
                if clauses:
                    found.append(f"{state} against {self.reference} at load {load}: " + "; ".join(clauses) + ".")
        return found

    def summary(self) -> list[str]:
        """What repeats at every load, and whether it was expected: two plain sentences a fault.

        Before them those records are named of which a remark says that their levels may be wrong.
        """
        doubted = [where for note in self.notes for where, _, rest in [note.partition(": ")] if rest.startswith(LOUD)]
        said = []
        if doubted:
            names = _listed(list(dict.fromkeys(doubted)))
            said.append(f"CHECK THE RECORDS: levels of {names} may be wrong, see below.")
        level = self.data["level"]
        with np.errstate(divide="ignore", invalid="ignore"):
            change = 20.0 * np.log10((level / level.sel(state=self.reference, drop=True)).values)
        if (most := float(np.nanmax(np.abs(change)))) > LEVELS_APART_DB:
            said.append(
                f"CHECK THE UNITS: whole records differ from {self.reference!r} by up to {most:.0f} dB, as by a "
                "wrong unit or gain."
            )
        return [*said, *summary(self, CHANGE_DB)]

    def uncertain(self) -> list[str]:
        """Changes that speckle, marks or whatever else recurs with the shaft may have made or hidden.

        A mesh order has as much of it as the orders beside (`turn_floor`); where the ends of what that leaves would be
        told differently, the change is not certain.
        """
        if "least" not in self.data:
            return []
        found = []
        least, most = (self.data[name] for name in ("least", "most"))
        for state in self.faults:
            for load in self.data["load"].values:
                for k in self.data["harmonic"].values:
                    at = {"load": load, "harmonic": k}
                    with np.errstate(divide="ignore", invalid="ignore"):
                        low, high = (
                            20.0
                            * np.log10(
                                np.atleast_1d((a.sel(state=state, **at) / b.sel(state=self.reference, **at)).values)
                            )
                            for a, b in ((least, most), (most, least))
                        )
                    open_ones = [c for c in range(low.size) if _moves(low[c]) != _moves(high[c])]
                    if open_ones and np.isfinite(high[open_ones[0]]):
                        c = open_ones[0]
                        where = f" on {len(open_ones)} of {low.size} channels" if low.size > 1 else ""
                        found.append(
                            f"{state} at load {load}: {k} x GMF may have moved by {low[c]:+.1f} to {high[c]:+.1f} dB"
                            f"{where}; what recurs with the shaft beside it leaves that open."
                        )
        return found

    def cautions(self) -> list[str]:
        """Where channels contradict each other so much that the sensors, not the gears, may differ between records."""
        if "channel" not in self.data["experiment"].dims or self.data.sizes["channel"] < 2:
            return []
        change = self.changes()
        found = []
        for state in self.faults:
            for load in self.data["load"].values:
                for k in self.data["harmonic"].values:
                    values = change.sel(load=load, state=state, harmonic=k).values
                    low, high = float(np.nanmin(values)), float(np.nanmax(values))
                    if low < -CONTRADICTION_DB and high > CONTRADICTION_DB:
                        moves = f"{low:+.1f} dB on one channel and by {high:+.1f} dB on another"
                        found.append(
                            f"{state} at load {load}: {k} x GMF moves by {moves}; "
                            "sensors that were moved between the records would show the same."
                        )
        return found

    def to_markdown(self) -> str:
        """The report as Markdown text."""
        attrs = self.data.attrs
        parts = [f"# States against {self.reference!r}", ""]
        how = "in a band of" if attrs.get("way") == "band" else "of the line alone; bands would be"
        unit = "the files' own unit" if attrs.get("units") == UNKNOWN_UNITS else attrs.get("units")
        parts += [
            f"RMS of the gear mesh harmonics {how} +- {attrs.get('half_width')} GMF, in {unit}.",
            "",
        ]
        parts += ["## In short", "", *(f"- {line}" for line in self.summary()), ""]
        if self.left_out:
            parts += ["Left out, because only one side has it: " + "; ".join(self.left_out) + ".", ""]
        if self.notes:
            parts += ["## The records", "", *(f"- {note}" for note in self.notes), ""]
        open_ones = self.uncertain()
        if open_ones:
            parts += ["## Not certain", "", *(f"- {line}" for line in open_ones), ""]
        parts += ["## Harmonics", "", self._harmonic_table(), "", "## What the states do", ""]
        parts += [f"- {s}" for s in self.sentences() + self.cautions()] + [""]
        expected = self.expectations()
        if len(expected):
            parts += ["## Expected and found in the experiment", ""]
            rows = [
                [
                    r.load,
                    r.state,
                    r.feature,
                    r.expected,
                    r.found,
                    r.channels,
                    "as expected" if r.as_expected else "not as expected",
                ]
                for r in expected.itertuples()
            ]
            parts += [
                markdown_table(["load", "state", "feature", "expected", "median", "channels", "verdict"], rows),
                "",
            ]
        if self.has_model:
            parts += ["## Agreement of model and experiment", "", self._agreement_table(), ""]
        return "\n".join(parts)

    def _harmonic_table(self) -> str:
        numbers = self.data["harmonic"].values
        rows = []
        for load in self.data["load"].values:
            for state in self.data["state"].values:
                here = self.data.sel(load=load, state=state)
                if self.has_model:
                    pairs = zip(here["experiment"].values, here["model"].values)
                    cells = [f"{significant(a)} / {significant(b)}" for a, b in pairs]
                    rows.append([load, state, f"{float(here['gmf']):.2f}", f"{float(here['factor']):.4g}", *cells])
                else:
                    for channel in here["channel"].values:
                        cells = [significant(v) for v in here["experiment"].sel(channel=channel).values]
                        rows.append([load, state, f"{float(here['gmf']):.2f}", channel, *cells])
        third = "factor" if self.has_model else "channel"
        shown = "experiment / model" if self.has_model else "RMS"
        return markdown_table(["load", "state", "GMF, Hz", third, *(f"{k} x GMF, {shown}" for k in numbers)], rows)

    def _agreement_table(self) -> str:
        found = self.agreement()
        numbers = self.data["harmonic"].values
        rows = []
        for load in self.data["load"].values:
            ordinal = [f"{v:.2f}" for v in found["ordinal"].sel(load=load).values]
            rows.append(
                [f"order of the states at load {load}", *ordinal, f"{float(found['distance'].sel(load=load)):.1f}"]
            )
        if self.data.sizes["load"] > 1:
            for state in self.data["state"].values:
                rows.append(
                    [
                        f"order of the loads, {state}",
                        *(f"{v:.2f}" for v in found["ordinal_load"].sel(state=state).values),
                        "-",
                    ]
                )
        return markdown_table(
            ["share of pairs in the same order", *(f"{k} x GMF" for k in numbers), "distance, dB"], rows
        )

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def __repr__(self) -> str:
        sizes = self.data.sizes
        sides = "experiment and model" if self.has_model else "experiment"
        counts = f"{sizes['load']} loads, {sizes['state']} states, {sizes['harmonic']} harmonics"
        return f"<ComparisonReport of {sides}: {counts}>"


def _moves(change: float) -> str:
    if change > CHANGE_DB:
        return "rises"
    return "falls" if change < -CHANGE_DB else "stays"
