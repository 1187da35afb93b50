"""What several records of one machine say of its bearings together: channels, times, loads.

A weak line that noise may have made once stands at the same place again if a bearing makes it. Of each record the
clearest channel is taken, its probabilities times the number of channels, since channels that hear the same blows are
no independent witnesses. Records are: of their probabilities p the statistic of Fisher, -sum ln p, has a gamma
distribution whose order is their number if none holds anything.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from gearmbs.signals.analysis.report import markdown_table
from gearmbs.signals.diagnosis.bearing_judgement import (
    CLEAR,
    FAINT_CHANCE,
    NONE,
    QUIET,
    SHIFTED,
    SIGNS,
    SIGNS_CHANCE,
    SMOOTH,
    log_tail,
)
from gearmbs.signals.diagnosis.bearing_report import CAGE, WORDS, BearingReport, PartFinding
from gearmbs.signals.errors import SignalError

SAME_SLIP = 3e-3
"""Standard deviation up to which slips are the same: load and temperature change the contact angle and the slip."""
MOST_ELSEWHERE, CLEAR_ELSEWHERE = 1e-2, 1e-4
"""Probability of so strong families elsewhere from which parts are named, and clear: one record has 1e-2 at best, two
of four such 1.8e-2, three of four 6e-4."""


@dataclass(frozen=True)
class CombinedBearings:
    """What several records say of bearings.

    Attributes
    ----------
    records : tuple of str
    table : DataFrame
        A row for each part of each bearing: how many records name it (``clear``, ``signs``), in how many lines
        above noise are of no other known cause (``heard``), decimal logarithms of the probabilities of such lines in
        noise (``log10_chance``) and of families as strong at other places (``log10_share``), the mean ``slip`` and its
        scatter over records (``slip_scatter``), and the ``grade``: "clear", "signs" or "none".
    grades : DataFrame
        The grade of the clearest channel, a row for each part, a column for each record.
    """

    records: tuple[str, ...]
    table: pd.DataFrame
    grades: pd.DataFrame

    @property
    def fault(self) -> str | None:
        """The part that is named, the clearest; None without."""
        named = self.table[self.table["grade"] != NONE]
        if named.empty:
            return None
        order = sorted(named.itertuples(), key=lambda r: (r.grade != CLEAR, r.part == CAGE, r.log10_chance))
        return str(order[0].part)

    @property
    def verdict(self) -> str:
        """What the records say, in words."""
        n = len(self.records)
        named = self.table[self.table["grade"] != NONE]
        if named.empty:
            by = f"{n} records together" if n > 1 else "one record alone"
            return f"No part of a bearing is named by {by}."
        return " ".join(
            f"{'Clear lines' if r.grade == CLEAR else 'Signs'} such as a defect of {WORDS[r.part]} of bearing "
            f"{r.bearing} makes, heard in {r.heard} of {n} records, {r.slip_percent:+.2f} % beside the kinematic place "
            f"with a scatter of {r.scatter_percent:.2f} %; in noise with a probability of 1e{r.log10_chance:.0f}, from "
            f"families of other causes with one of 1e{r.log10_share:.0f}."
            for r in named.itertuples()
        )

    def to_markdown(self) -> str:
        """The verdict, and the grades of all parts in all records."""
        head = ["bearing", "part", *self.records, "together"]
        rows = [
            [*key, *(str(grade) for grade in row), str(whole)]
            for key, row, whole in zip(self.grades.index, self.grades.to_numpy(), self.table["grade"], strict=True)
        ]
        return f"**{self.verdict}**\n\n{markdown_table(head, rows)}"

    def _repr_markdown_(self) -> str:
        return self.to_markdown()


def combine_bearings(reports: Mapping[str, BearingReport] | Sequence[BearingReport]) -> CombinedBearings:
    """Judge several records of one machine together.

    Parameters
    ----------
    reports : mapping or sequence of BearingReport
        Of the same bearings at several times, loads or speeds; the names of a mapping are shown.

    Returns
    -------
    CombinedBearings
        A part is named if its lines are heard in half of the records at the same slip and if neither noise nor
        families of other causes make so many so strong.

    Raises
    ------
    SignalError
        If there are no reports, or of different bearings, or two of one record.

    Examples
    --------
    >>> import numpy as np
    >>> from gearmbs.signals import diagnose_bearing, make_signal
    >>> rng = np.random.default_rng(0)
    >>> noise = [make_signal(rng.standard_normal(24000), 12000.0, units="m/s^2") for _ in range(3)]
    >>> combine_bearings([diagnose_bearing(one, "6205", "1800 rpm") for one in noise]).verdict
    'No part of a bearing is named by 3 records together.'
    """
    named = dict(reports) if isinstance(reports, Mapping) else {f"record {k + 1}": r for k, r in enumerate(reports)}
    if not named:
        raise SignalError("reports: none is given; give the reports of two records or more")
    first = next(iter(named.values()))
    for name, report in named.items():
        if [lines.orders for lines in report.bearings] != [lines.orders for lines in first.bearings]:
            raise SignalError(f"reports: {name!r} is of other bearings than the first; combine reports of the same")
    for (name, one), (again, other) in combinations(named.items(), 2):
        # levels of two records differ in their last digits at least
        if one.levels.equals(other.levels):
            raise SignalError(
                f"reports: {name!r} and {again!r} are of the same record, which is one witness; give each record once"
            )
    keys = [(lines.name, part) for lines in first.bearings for part in lines.orders]
    clearest = {key: [_clearest(report, k) for report in named.values()] for k, key in enumerate(keys)}
    rows = [(*key, *_together(found)) for key, found in clearest.items()]
    columns = ["bearing", "part", CLEAR, SIGNS, "heard", "log10_chance", "log10_share", "slip_percent",
               "scatter_percent", "grade"]  # fmt: skip
    index = pd.MultiIndex.from_tuples(keys, names=["bearing", "part"])
    grades = pd.DataFrame([[one.grade for one, _ in clearest[key]] for key in keys], index, list(named))
    return CombinedBearings(tuple(named), pd.DataFrame(rows, columns=columns), grades)


def _clearest(report: BearingReport, k: int) -> tuple[PartFinding, int]:
    """Return the finding of the k-th part in the clearest of a report's channels, and how many channels there are."""
    parts = sum(len(lines.orders) for lines in report.bearings)
    own = report.findings[k::parts]
    return min(own, key=lambda f: (f.grade not in (CLEAR, SIGNS), not _counts(f), f.log_chance)), len(own)


def _counts(finding: PartFinding) -> bool:
    """Return whether no cause but the bearing's part is known for its lines."""
    return not finding.beside and finding.grade not in (SHIFTED, QUIET, SMOOTH) and finding.multiple is None


def _together(found: Sequence[tuple[PartFinding, int]]) -> tuple[int, int, int, float, float, float, float, str]:
    """Return one row of the table, from the clearest channel of each record."""
    counted = [(one, channels) for one, channels in found if _counts(one)]
    heard = [one for one, channels in counted if one.log_chance + math.log10(channels) <= FAINT_CHANCE]
    chances = [min(one.log_chance + math.log10(channels), 0.0) for one, channels in counted]
    shares = [min(channels * (1 + one.stronger) / (1 + one.places), 1.0) for one, channels in counted]
    chances, shares = (
        values + [neutral] * (len(found) - len(counted)) for values, neutral in ((chances, 0.0), (shares, 1.0))
    )
    chance = _fisher(chances)
    share = _fisher([math.log10(p) for p in shares])
    slips = np.array([one.slip for one in heard])
    scatter = float(slips.std()) if slips.size else math.nan
    steady = slips.size >= 2 and scatter <= SAME_SLIP and 2 * slips.size >= len(found)
    accused = steady and chance <= SIGNS_CHANCE and share <= math.log10(MOST_ELSEWHERE)
    grades = [one.grade for one, _ in found]
    sure = share <= math.log10(CLEAR_ELSEWHERE) and chance <= 2 * SIGNS_CHANCE
    clear = sure or 2 * grades.count(CLEAR) >= len(found)
    grade = NONE if not accused else CLEAR if clear else SIGNS
    mean = float(slips.mean()) if slips.size else math.nan
    return (
        grades.count(CLEAR), grades.count(SIGNS), len(heard), chance, share, 100 * mean, 100 * scatter, grade
    )  # fmt: skip


def _fisher(logs: Sequence[float]) -> float:
    """Return the decimal logarithm of the probability of so small probabilities together."""
    return log_tail(-math.log(10.0) * float(np.sum(logs)), len(logs)) / math.log(10.0)
