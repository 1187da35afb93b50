"""Columns of times in text tables: seconds, time stamps, dates and times of day; and columns that number the rows."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from .csv_layout import CsvLayout
from .errors import SignalFileError

FACTORS = {"ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
NAMED_UNIT = re.compile(r"[_\s](ms|us|ns|min)$", re.IGNORECASE)
DAY = 86400.0
EPOCHS = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3))
"""Numbers this large are not seconds since 1970 but parts of them."""


class Times:
    """Seconds of the rows of a table, block by block, from the first row on for time stamps."""

    def __init__(self, layout: CsvLayout, path: Path) -> None:
        self.layout, self.path = layout, path
        self.origin: float | None = None
        self.first_tick: int | None = None
        self.last = -np.inf
        self.days = 0.0

    def seconds(self, values: np.ndarray, stamped: pd.DataFrame | None) -> np.ndarray | None:
        """Times in s of a block, or None if the table has none.

        Raises
        ------
        SignalFileError
            If a stamp cannot be read.
        """
        layout = self.layout
        if layout.clock is None:
            return None
        if stamped is None:
            return self._of_numbers(values[:, layout.clock])
        texts = stamped.iloc[:, 0].astype(str).str.strip().str.strip('"')
        for column in stamped.columns[1:]:
            texts = texts + " " + stamped[column].astype(str).str.strip().str.strip('"')
        texts = texts.str.replace(",", ".", regex=False)
        if re.match(r"^\d{1,2}:", texts.iloc[0]):
            seconds = self._of_clocks(texts)
        else:
            seconds = self._of_dates(texts)
        if self.origin is None:
            self.origin = float(seconds[0])
        return seconds - self.origin

    def _of_numbers(self, column: np.ndarray) -> np.ndarray:
        clock = self.layout.clock
        assert clock is not None
        named = NAMED_UNIT.search(self.layout.names[clock])
        unit = (
            self.layout.units[clock].lower() if self.layout.units[clock] != "unknown" else (named[1] if named else "s")
        )
        factor = FACTORS.get(unit.lower(), 1.0)
        largest = float(np.nanmax(np.abs(column), initial=0.0))
        if factor == 1.0:
            factor = next((f for limit, f in EPOCHS if largest > limit), 1.0)
        if largest * factor > 1e8:
            # seconds since 1970 leave too few digits for the fraction
            self.origin = float(column[0]) if self.origin is None else self.origin
            return (column - self.origin) * factor
        return column * factor

    def _of_dates(self, texts: pd.Series) -> np.ndarray:
        try:
            found = pd.to_datetime(_iso(texts), format="ISO8601", utc=True)
        except (ValueError, OverflowError) as exc:
            raise SignalFileError(self.path, f"its time stamps cannot be read ({str(exc).splitlines()[0]})") from exc
        if found.isna().any():
            row = int(np.argmax(found.isna().to_numpy()))
            raise SignalFileError(
                self.path, f"its time stamp in row {row + 1} of the table is missing or cannot be read"
            )
        ticks = found.dt.as_unit("ns").astype("int64").to_numpy()
        self.first_tick = int(ticks[0]) if self.first_tick is None else self.first_tick
        return (ticks - self.first_tick) * 1e-9

    def _of_clocks(self, texts: pd.Series) -> np.ndarray:
        padded = texts.where(texts.str.count(":") == 2, texts + ":00")
        try:
            seconds = pd.to_timedelta(padded).dt.total_seconds().to_numpy(dtype=float)
        except ValueError as exc:
            raise SignalFileError(self.path, f"its times of day cannot be read ({str(exc).splitlines()[0]})") from exc
        before = np.concatenate(([self.last if np.isfinite(self.last) else seconds[0]], seconds[:-1]))
        midnights = np.cumsum(seconds - before < -0.5 * DAY)
        self.last = float(seconds[-1])
        out = seconds + DAY * (self.days / DAY + midnights)
        self.days += DAY * float(midnights[-1])
        return out


def _iso(texts: pd.Series) -> pd.Series:
    """Stamps with their dates as year-month-day; of 3/4/2024 the day comes first unless that cannot be."""
    year_first = texts.str.extract(r"^(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})(.*)$")
    if year_first[0].notna().all():
        parts = [year_first[k] for k in (0, 1, 2, 3)]
    else:
        found = texts.str.extract(r"^(\d{1,2})[-/.](\d{1,2})[-/.](\d{4})(.*)$")
        if found[0].isna().any():
            return texts
        american = bool((found[1].astype(int) > 12).any())
        parts = [found[k] for k in ((2, 0, 1, 3) if american else (2, 1, 0, 3))]
    year, month, day, rest = parts
    return year + "-" + month.str.zfill(2) + "-" + day.str.zfill(2) + rest


def index_meaning(column: np.ndarray, clock: np.ndarray | None) -> tuple[str | None, np.ndarray | None]:
    """What a first column without a name is: words for the reader, and seconds if it holds times; (None, None) if
    neither.

    0, 1, 2 ... number the rows; other numbers that rise evenly are times in s, where there is no other column of times.
    """
    if len(column) < 2 or not np.isfinite(column).all():
        return None, None
    steps = np.diff(column)
    if np.all(steps == 1.0) and column[0] == np.rint(column[0]):
        return "The first column only numbers the rows and is left out.", None
    even = np.all(steps > 0.0) and np.allclose(steps, steps.mean(), rtol=0.05)
    if even and clock is None:
        return "The first column has no name and rises evenly; it is taken for the time in s.", column
    return None, None
