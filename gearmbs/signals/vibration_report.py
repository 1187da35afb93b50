"""What was found in a record of which no teeth are known, as data, tables and Markdown."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs._shown import Shown

from .features import By, feature_rows, rows_to_frame
from .report import markdown_table, significant
from .report_parts import BAND_FEATURES, IMPULSIVE, channel_table, missing_list, transposed


@dataclass
class VibrationReport(Shown):
    """What was found in one record of plain vibration.

    Attributes
    ----------
    source : str
        File or name of the record.
    rate, duration : float
        Hz and s.
    units : list of str
        One for each channel.
    levels : xarray.Dataset
        `rms`, `peak`, `peak_to_peak`, `crest`, `kurtosis`, `skewness`, `shape_factor` and `impulse_factor` of the
        record with its mean removed, dimension (channel,); `velocity_rms` (m/s, 10 Hz to 1 kHz) where units and length
        allow.
    spectrum : xarray.DataArray
        RMS spectrum averaged over 2 s segments, dimensions (frequency, channel).
    lines : pandas.DataFrame
        Its strongest lines by channel: `frequency` (Hz), `order` of the shaft (NaN without a speed), `rms`.
    impulsive : xarray.Dataset or None
        Kurtogram with the band of highest kurtosis by channel (`best_centre`, `best_bandwidth`, `best_kurtosis`).
    envelope : xarray.DataArray or None
        RMS spectrum of the envelope in the band of highest kurtosis that is wide enough for one (1/16 of half the
        sampling rate or more), dimensions (frequency, channel); coordinates `low` and `high` (Hz) along channel.
    envelope_lines : pandas.DataFrame or None
        Its strongest lines by channel, columns as of `lines`.
    orders : pandas.DataFrame or None
        RMS at the first multiples of the shaft's speed: `channel`, `order`, `frequency`, `rms`.
    speed : float or None
        Mean speed in rad/s.
    speed_range : tuple of float or None
        Lowest and highest speed in rad/s where it varies.
    speed_origin : str
        Where the speed comes from, in words.
    missing : dict of str to str
        What could not be computed, and why: no attribute is None without an entry here.
    notes : list of str
        What a reader should know about the results.
    """

    source: str
    rate: float
    duration: float
    units: list[str]
    levels: xr.Dataset
    spectrum: xr.DataArray
    lines: pd.DataFrame
    impulsive: xr.Dataset | None = None
    envelope: xr.DataArray | None = None
    envelope_lines: pd.DataFrame | None = None
    orders: pd.DataFrame | None = None
    speed: float | None = None
    speed_range: tuple[float, float] | None = None
    speed_origin: str = "not known"
    missing: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def channels(self) -> list[str]:
        """Names of the channels."""
        return [str(c) for c in self.levels["channel"].values]

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers as tables: levels, lines, spectrum, and where known orders, impulsive and envelope_lines."""
        spectrum = self.spectrum.to_series().unstack("channel")[self.channels].reset_index()
        tables = {"levels": channel_table(self.levels), "lines": self.lines, "spectrum": spectrum}
        if self.orders is not None:
            tables["orders"] = self.orders
        if self.impulsive is not None:
            tables["impulsive"] = channel_table(self.impulsive[list(IMPULSIVE)])
        if self.envelope_lines is not None:
            tables["envelope_lines"] = self.envelope_lines
        return tables

    def to_frame(self, by: By = "record") -> pd.DataFrame:
        """The numbers as one flat row, or one for each channel; see `features`."""
        return rows_to_frame(feature_rows(self, by))

    def record_features(self) -> dict[str, float]:
        """Numbers of the whole record."""
        return {"speed_rpm": math.nan if self.speed is None else self.speed * 30.0 / math.pi}

    def channel_features(self) -> xr.Dataset:
        """Numbers of each channel: levels, most impulsive band, strongest line, orders."""
        data = self.levels.copy()
        for key, name in BAND_FEATURES.items():
            values = np.full(len(self.channels), np.nan) if self.impulsive is None else self.impulsive[key].values
            data[name] = ("channel", values)
        for kind, table in (("line", self.lines), ("envelope_line", self.envelope_lines)):
            first = None if table is None else table.groupby("channel", sort=False).first()
            for column, name in (("frequency", f"{kind}_hz"), ("rms", f"{kind}_rms")):
                data[name] = ("channel", [_entry(first, channel, column) for channel in self.channels])
        if self.orders is not None:
            for order, rows in self.orders.groupby("order", sort=True):
                by_channel = rows.set_index("channel")
                data[f"order_{order:g}"] = ("channel", [_entry(by_channel, c, "rms") for c in self.channels])
        return data

    def to_markdown(self) -> str:
        """The report as Markdown text."""
        channels = [f"{c} [{u}]" for c, u in zip(self.channels, self.units)]
        parts = [
            f"# Vibration of {self.source}",
            "",
            f"- Record: {len(channels)} channel{'s' * (len(channels) > 1)}, {self.duration:.3f} s at {self.rate:g} Hz",
            f"- Speed: {self._speed_words()}",
            *(f"- {note}" for note in self.notes),
            "",
            "## Levels of the record",
            "",
            transposed(self.levels, channels),
            "",
        ]
        if self.orders is not None:
            table = self.orders.pivot(index=["order", "frequency"], columns="channel", values="rms")[self.channels]
            rows = [
                [f"{o:g}", f"{f:.2f}", *map(significant, row)] for (o, f), row in zip(table.index, table.to_numpy())
            ]
            parts += ["## Orders of the shaft, RMS", "", markdown_table(["order", "Hz", *channels], rows), ""]
        parts += ["## Strongest lines", "", self._line_table(self.lines), ""]
        if self.impulsive is not None:
            parts += ["## Most impulsive band", "", transposed(self.impulsive, channels, IMPULSIVE), ""]
        if self.envelope_lines is not None:
            parts += ["## Strongest lines of the envelope", "", *self._band_words(), ""]
            parts += [self._line_table(self.envelope_lines), ""]
        return "\n".join(parts + missing_list(self.missing))

    def _band_words(self) -> list[str]:
        assert self.envelope is not None
        ends = zip(self.channels, self.envelope["low"].values, self.envelope["high"].values)
        return ["; ".join(f"{name} in {low:.0f} to {high:.0f} Hz" for name, low, high in ends) + "."]

    def _speed_words(self) -> str:
        if self.speed is None:
            return self.speed_origin
        text = f"{self.speed * 30.0 / math.pi:.1f} rpm ({self.speed / math.tau:.4f} Hz), {self.speed_origin}"
        if self.speed_range is None:
            return text
        low, high = (value * 30.0 / math.pi for value in self.speed_range)
        return f"{low:.1f} to {high:.1f} rpm, on average {text}"

    def _line_table(self, table: pd.DataFrame) -> str:
        header = ["channel", "Hz", *(["x shaft"] if self.speed is not None else []), "RMS"]
        rows = [
            [
                r.channel,
                f"{r.frequency:.2f}",
                *([f"{r.order:.3f}"] if self.speed is not None else []),
                significant(r.rms),
            ]
            for r in table.itertuples()
        ]
        return markdown_table(header, rows)

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def __repr__(self) -> str:
        return (
            f"<VibrationReport of {self.source!r}: {self.levels.sizes['channel']} channels, {self.duration:.2f} s, "
            f"speed {self._speed_words()}>"
        )


def _entry(table: pd.DataFrame | None, channel: str, column: str) -> float:
    return math.nan if table is None or channel not in table.index else float(table.loc[channel, column])
