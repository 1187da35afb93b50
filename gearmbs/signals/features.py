"""Reports as rows of a table, for statistics and learning: one row a record, or one a record and channel."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Literal, Protocol

import numpy as np
import pandas as pd
import xarray as xr

from .errors import SignalError

By = Literal["record", "channel"]


class Reported(Protocol):
    """What a row needs of a report; `AnalysisReport` and `VibrationReport` have it."""

    source: str
    rate: float
    duration: float
    notes: list[str]
    missing: dict[str, str]

    def channel_features(self) -> xr.Dataset:
        """Numbers of dimension (channel,)."""

    def record_features(self) -> dict[str, float]:
        """Numbers of the whole record."""


def features(reports: Iterable[Reported], *, by: By = "record") -> pd.DataFrame:
    """Put the numbers of reports into one table.

    Parameters
    ----------
    reports : iterable of AnalysisReport or VibrationReport
    by : {"record", "channel"}
        "record": one row a report, columns such as ``housing.rms``; "channel": one row a report and channel, columns
        such as ``rms`` and the column ``channel``.

    Returns
    -------
    DataFrame
        First `source`, `rate_hz`, `duration_s`, what is known of the speed, then the features, last `notes`: what a
        reader should know, and for each feature that is NaN because it could not be computed, why.

    Raises
    ------
    SignalError
        If there are no reports, something else is among them, or `by` is neither.

    See Also
    --------
    gearmbs.signals.series : many files to one such table.
    """
    rows = [row for report in reports for row in feature_rows(report, by)]
    if not rows:
        raise SignalError("reports: there are none")
    return rows_to_frame(rows)


def feature_rows(report: Reported, by: By = "record") -> list[dict[str, Any]]:
    """The numbers of a report as rows of plain values: one, or one for each channel."""
    if by not in ("record", "channel"):
        raise SignalError(f"by: must be 'record' or 'channel', got {by!r}")
    if not hasattr(report, "channel_features"):
        raise SignalError(f"reports: {type(report).__name__} is no report; give what analyse returns")
    data = report.channel_features()
    names = [str(c) for c in data["channel"].values]
    head = {"source": report.source, "rate_hz": report.rate, "duration_s": report.duration}
    head |= {key: float(value) for key, value in report.record_features().items()}
    reasons = [f"{name}: {reason}" for name, reason in report.missing.items()]
    tail = {"notes": "; ".join([*(note.rstrip(".") for note in report.notes), *reasons])}
    columns = {str(key): np.asarray(value.values, dtype=float) for key, value in data.data_vars.items()}
    if by == "record":
        found = {f"{name}.{key}": float(v[i]) for i, name in enumerate(names) for key, v in columns.items()}
        return [{**head, **found, **tail}]
    return [
        {**head, "channel": name, **{key: float(v[i]) for key, v in columns.items()}, **tail}
        for i, name in enumerate(names)
    ]


def rows_to_frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """Rows of plain values as a table; columns in the order in which they first come, notes last."""
    order = list(dict.fromkeys(key for row in rows for key in row if key != "notes"))
    return pd.DataFrame([{key: _plain(row.get(key)) for key in [*order, "notes"]} for row in rows])


def _plain(value: Any) -> Any:
    return math.nan if value is None else value
