"""What an analysis found, as data, tables and Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs._shown import Shown

from .features import By, feature_rows, rows_to_frame
from .indicators import INDICATORS
from .report import markdown_table, significant
from .report_parts import BAND_FEATURES, IMPULSIVE, channel_table, missing_list, transposed
from .speed import SpeedEstimate


@dataclass
class AnalysisReport(Shown):
    """What was found in one record.

    Attributes
    ----------
    source : str
        File or name of the record.
    rate, duration : float
        Hz and s.
    teeth : tuple of int
    speed : float
        Mean speed in rad/s of the wheel whose tooth count comes first.
    gmf : float
        Mean gear mesh frequency in Hz.
    speed_origin : str
        Where the speed comes from, in words.
    harmonics : xarray.Dataset
        `band` and `orders` of dimensions (harmonic, channel), as `gmf_rms`; coordinate `frequency` (Hz). `orders`
        follows the speed's drift: it is taken from the time-synchronous average.
    sidebands : xarray.DataArray or None
        RMS of the lines beside each harmonic, dimensions (harmonic, sideband, channel), sideband -3 ... 3 shaft
        orders.
    levels : xarray.Dataset
        `rms`, `peak_to_peak`, `crest`, `kurtosis` of the record with its mean removed, dimension (channel,).
    indicators : xarray.Dataset or None
        See `condition_indicators`; None if the record is too short for an average.
    lines : pandas.DataFrame
        The strongest lines of the spectrum by channel; in column ``of`` what they come from, if the signal's attribute
        ``known_lines`` (JSON, name to Hz) tells, as that of a drivetrain's record does.
    impulsive : xarray.Dataset or None
        Band with the highest kurtosis by channel (`best_centre`, `best_bandwidth`, `best_kurtosis`).
    average : xarray.DataArray or None
        The time-synchronous average, dimensions (angle, channel).
    speed_range : tuple of float or None
        Lowest and highest speed in rad/s where it varies, else None.
    missing : dict of str to str
        What could not be computed, and why: nothing is None or NaN throughout without an entry here.
    notes : list of str
        What a reader should know about the results.
    """

    source: str
    rate: float
    duration: float
    teeth: tuple[int, ...]
    speed: float
    gmf: float
    speed_origin: str
    harmonics: xr.Dataset
    levels: xr.Dataset
    lines: pd.DataFrame
    sidebands: xr.DataArray | None = None
    indicators: xr.Dataset | None = None
    impulsive: xr.Dataset | None = None
    average: xr.DataArray | None = None
    estimate: SpeedEstimate | None = None
    speed_range: tuple[float, float] | None = None
    missing: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers as tables: harmonics, levels, lines, and where known sidebands, indicators and impulsive."""
        stacked = self.harmonics[["band", "orders"]].to_dataframe().reset_index()
        keep = ["harmonic", "frequency", "channel", "band", "orders"]
        tables = {"harmonics": stacked[keep], "levels": channel_table(self.levels), "lines": self.lines}
        if self.sidebands is not None:
            tables["sidebands"] = self.sidebands.to_dataframe(name="rms").reset_index()[
                ["harmonic", "sideband", "channel", "rms"]
            ]
        if self.indicators is not None:
            tables["indicators"] = channel_table(self.indicators)
        if self.impulsive is not None:
            tables["impulsive"] = channel_table(self.impulsive[["best_centre", "best_bandwidth", "best_kurtosis"]])
        return tables

    def to_frame(self, by: By = "record") -> pd.DataFrame:
        """The numbers as one flat row, or one for each channel; see `features`."""
        return rows_to_frame(feature_rows(self, by))

    def record_features(self) -> dict[str, float]:
        """Numbers of the whole record."""
        return {"speed_rpm": self.speed * 30.0 / math.pi, "gmf_hz": self.gmf}

    def channel_features(self) -> xr.Dataset:
        """Numbers of each channel: levels, mesh harmonics, sidebands, indicators, most impulsive band."""
        data = self.levels.copy()
        for k in range(self.harmonics.sizes["harmonic"]):
            data[f"band_{k + 1}"] = ("channel", self.harmonics["band"].values[k])
            data[f"line_{k + 1}"] = ("channel", self.harmonics["orders"].values[k])
        for name in INDICATORS:
            values = np.full(data.sizes["channel"], np.nan) if self.indicators is None else self.indicators[name].values
            data[name if name not in self.levels else f"average_{name}"] = ("channel", values)
        for key, name in BAND_FEATURES.items():
            values = np.full(data.sizes["channel"], np.nan) if self.impulsive is None else self.impulsive[key].values
            data[name] = ("channel", values)
        return data

    def to_markdown(self) -> str:
        """The report as Markdown text."""
        units = [str(u) for u in self.harmonics["channel_units"].values]
        channels = [f"{c} [{u}]" for c, u in zip(self.harmonics["channel"].values, units)]
        rpm = self.speed * 30.0 / math.pi
        parts = [
            f"# Analysis of {self.source}",
            "",
            f"- Record: {len(channels)} channel{'s' * (len(channels) > 1)}, {self.duration:.3f} s at {self.rate:g} Hz",
            f"- Gear mesh frequency: {self.gmf:.2f} Hz = {self.teeth[0]} teeth x {self.speed / (2 * math.pi):.4f} Hz "
            f"({rpm:.1f} rpm), {self.speed_origin}",
            *(f"- {note}" for note in self.notes),
            "",
            "## RMS of the gear mesh harmonics",
            "",
            f"In the band of +- {self.harmonics.attrs['half_width']:g} GMF (in brackets: of the line alone).",
            "",
        ]
        rows = []
        for k in range(self.harmonics.sizes["harmonic"]):
            band, line = self.harmonics["band"].values[k], self.harmonics["orders"].values[k]
            cells = [f"{significant(b)} ({significant(o)})" for b, o in zip(band, line)]
            rows.append([f"{k + 1} x GMF", f"{self.harmonics['frequency'].values[k]:.2f}", *cells])
        parts += [markdown_table(["harmonic", "Hz", *channels], rows), "", "## Levels of the record", ""]
        parts += [transposed(self.levels, channels), ""]
        if self.indicators is not None:
            count = self.indicators.attrs["averages"]
            parts += [
                "## Condition indicators",
                "",
                f"Of the time-synchronous average over {count} revolutions.",
                "",
                transposed(self.indicators, channels),
                "",
            ]
        if self.sidebands is not None:
            parts += ["## Sidebands, dB relative to their harmonic", "", self._sideband_table(channels), ""]
        if self.impulsive is not None:
            parts += ["## Most impulsive band", "", transposed(self.impulsive, channels, IMPULSIVE), ""]
        header = ["channel", "Hz", "x GMF", "RMS", *(["what it is"] if "of" in self.lines else [])]
        rows = [
            [r.channel, f"{r.frequency:.2f}", f"{r.gmf_order:.3f}", significant(r.rms), getattr(r, "of", "")]
            for r in self.lines.itertuples()
        ]
        parts += ["## Strongest lines", "", markdown_table(header, [row[: len(header)] for row in rows]), ""]
        kept = {name: why for name, why in self.missing.items() if name != "estimate"}
        return "\n".join(parts + missing_list(kept))

    def _sideband_table(self, channels: Sequence[str]) -> str:
        assert self.sidebands is not None
        rows = []
        for k in self.sidebands["harmonic"].values:
            for s in self.sidebands["sideband"].values:
                if s == 0:
                    continue
                with np.errstate(divide="ignore", invalid="ignore"):
                    level = 20.0 * np.log10(
                        self.sidebands.sel(harmonic=k, sideband=s).values
                        / self.sidebands.sel(harmonic=k, sideband=0).values
                    )
                rows.append([f"{k} x GMF {s:+d} x shaft", *(f"{v:.1f}" for v in level)])
        return markdown_table(["line", *channels], rows)

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def __repr__(self) -> str:
        return (
            f"<AnalysisReport of {self.source!r}: GMF {self.gmf:.2f} Hz, {self.speed * 30 / math.pi:.1f} rpm, "
            f"{self.levels.sizes['channel']} channels, {self.duration:.2f} s>"
        )
