"""Small helpers for reports as Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs._display import Shown
from gearmbs.signals.analysis.indicators import INDICATORS, crest_factor, kurtosis, peak_to_peak
from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.speed import SpeedEstimate
from gearmbs.signals.signal.signal import common_unit
from gearmbs.signals.spectra import kurtogram, spectrum


def significant(value: float, digits: int = 4) -> str:
    """A number with so many significant digits, plain where that is readable; a dash for what is not a number."""
    value = float(value)
    if math.isnan(value):
        return "-"
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    power = math.floor(math.log10(abs(value)))
    if -4 <= power < digits + 2:
        return f"{value:.{max(0, digits - 1 - power)}f}"
    return f"{value:.{digits - 1}e}"


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table; vertical bars inside cells are escaped."""
    lines = [_row(header), "|" + "|".join("---" for _ in header) + "|"]
    return "\n".join(lines + [_row(row) for row in rows])


def _row(cells: Sequence[Any]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"


# What every report of one record has: levels, strongest lines, the most impulsive band, and their tables.


LINE_SECONDS = 2.0
"""Length of the segments of spectra that are searched for lines: a resolution of half a hertz."""
KURTOGRAM_LEVELS = 6
SAME_LINE = 1e-9
"""Known lines closer than this part of their frequency are one."""
BEHIND = 100
"""Rank of a line that others come ahead of, beyond the frequencies that any line is a multiple of."""
IMPULSIVE = {"best_centre": "centre, Hz", "best_bandwidth": "bandwidth, Hz", "best_kurtosis": "kurtosis - 2"}
BAND_FEATURES = {"best_centre": "band_centre_hz", "best_bandwidth": "band_width_hz", "best_kurtosis": "band_kurtosis"}
LOUD = ("CHECK THE", "CLIPPED", "DROP-OUTS")
"""How remarks begin on which all numbers may depend."""
PURE = ("crest", "kurtosis", "skewness", "shape_factor", "impulse_factor")
"""Levels without a unit."""

Measure = Callable[[np.ndarray], float]
LEVELS: dict[str, Measure] = {"rms": np.std, "peak_to_peak": peak_to_peak, "crest": crest_factor, "kurtosis": kurtosis}


def peak(x: np.ndarray) -> float:
    """Largest distance from the mean."""
    return float(np.abs(x - x.mean()).max())


def skewness(x: np.ndarray) -> float:
    """Third moment about the mean over the cube of the standard deviation; NaN for a constant."""
    d = x - x.mean()
    spread = float(np.std(x))
    return float(np.mean(d**3)) / spread**3 if spread > 0.0 else float("nan")


def shape_factor(x: np.ndarray) -> float:
    """Standard deviation over the mean distance from the mean; NaN for a constant."""
    size = float(np.mean(np.abs(x - x.mean())))
    return float(np.std(x)) / size if size > 0.0 else float("nan")


def impulse_factor(x: np.ndarray) -> float:
    """Largest over mean distance from the mean; NaN for a constant."""
    size = float(np.mean(np.abs(x - x.mean())))
    return peak(x) / size if size > 0.0 else float("nan")


FULL_LEVELS: dict[str, Measure] = {
    "rms": LEVELS["rms"],
    "peak": peak,
    **{k: v for k, v in LEVELS.items() if k != "rms"},
    "skewness": skewness,
    "shape_factor": shape_factor,
    "impulse_factor": impulse_factor,
}


def levels(signal: xr.DataArray, measures: Mapping[str, Measure] = LEVELS) -> xr.Dataset:
    """Levels of the record with its mean removed, one variable each, dimension (channel,)."""
    found: dict[str, list[float]] = {name: [] for name in measures}
    for column in signal.values.T:
        one = np.ascontiguousarray(column)
        for name, measure in measures.items():
            found[name].append(float(measure(one)))
    unit = common_unit(signal)
    variables = {n: ("channel", np.asarray(v), {"units": "1" if n in PURE else unit}) for n, v in found.items()}
    return xr.Dataset(variables, coords={"channel": signal["channel"].values})


def strongest_lines(
    lines: xr.DataArray, count: int, fundamental: float | None = None, name: str = "order"
) -> pd.DataFrame:
    """The highest peaks of a spectrum by channel, with their frequency over the `fundamental` (NaN without one)."""
    frequency = lines["frequency"].values
    rows = []
    for channel, column in zip(lines["channel"].values, lines.values.T):
        peaks = 1 + np.flatnonzero((column[1:-1] > column[:-2]) & (column[1:-1] >= column[2:]))
        for i in peaks[np.argsort(column[peaks])[::-1][:count]]:
            order = float("nan") if fundamental is None else float(frequency[i] / fundamental)
            rows.append((str(channel), float(frequency[i]), order, float(column[i])))
    return pd.DataFrame(rows, columns=["channel", "frequency", name, "rms"])


def name_lines(
    lines: pd.DataFrame, known: Mapping[str, float], within: float, ahead: Collection[str] = ()
) -> pd.DataFrame:
    """Add the column ``of``: which of the known lines (name to Hz) is nearest, or empty if none is near enough.

    Of lines that are too near to be told apart those named ``ahead`` come first, and of these the simplest, a mesh
    harmonic before a sideband of another: one that is a multiple of fewer frequencies. Lines at one frequency are all
    named, as those of shafts that turn together.
    """
    frequencies = np.array(list(known.values()))
    parts = np.array([name.count(" x ") + (0 if name in ahead or not ahead else BEHIND) for name in known])
    names = []
    for f in lines["frequency"]:
        off = np.abs(frequencies - f)
        possible = off <= within
        if not possible.any():
            names.append("")
            continue
        simplest = possible & (parts == parts[possible].min())
        nearest = frequencies[np.flatnonzero(simplest)[np.argmin(off[simplest])]]
        alike = [math.isclose(at, nearest, rel_tol=SAME_LINE) for at in frequencies]
        names.append(" or ".join(name for name, one, same in zip(known, simplest, alike) if one and same))
    return lines.assign(of=names)


def line_spectrum(signal: xr.DataArray) -> xr.DataArray:
    """RMS spectrum averaged over segments of 2 s."""
    return spectrum(signal, scaling="rms", segment=LINE_SECONDS)


def impulsive_band(signal: xr.DataArray, progress: Callable[[float, str], None] | None = None) -> xr.Dataset | str:
    """Kurtogram of the record, NaN of channels that do not change (`unchanging` says so), or why there is none."""
    least = 2 * (16 << KURTOGRAM_LEVELS)
    if signal.sizes["time"] < least:
        return f"the record holds {signal.sizes['time']} samples, a kurtogram needs {least}"
    changes = np.std(signal.values, axis=0) > 0.0
    if not changes.any():
        return "no channel changes, which leaves nothing to find a band in"
    found = kurtogram(signal.isel(channel=changes), levels=KURTOGRAM_LEVELS, progress=progress)
    return found if changes.all() else found.reindex(channel=signal["channel"].values)


def unchanging(signal: xr.DataArray) -> str | None:
    """Return in words which channels do not change and so have no band, or None where all do."""
    still = [
        str(name) for name, spread in zip(signal["channel"].values, np.std(signal.values, axis=0)) if not spread > 0
    ]
    listed = ", ".join(map(repr, still))
    return f"{listed} does not change, which leaves nothing to find a band in" if still else None


def channel_table(data: xr.Dataset) -> pd.DataFrame:
    """Variables of dimension (channel,) as a table, one row a channel."""
    return pd.DataFrame({"channel": data["channel"].values, **{str(k): v.values for k, v in data.data_vars.items()}})


def transposed(data: xr.Dataset, channels: Sequence[str], names: Mapping[str, str] | None = None) -> str:
    """Variables of dimension (channel,) as a Markdown table, one column a channel.

    A variable with units of its own has them beside its name.
    """
    wanted = names or {
        str(k): str(k).replace("_", " ") + (f", {v.attrs['units']}" if "units" in v.attrs else "")
        for k, v in data.data_vars.items()
    }
    rows = [[label, *(significant(v) for v in data[key].values)] for key, label in wanted.items()]
    return markdown_table(["", *channels], rows)


def missing_list(missing: Mapping[str, str]) -> list[str]:
    """What a report lacks and why, as Markdown lines with a heading; nothing if it lacks nothing."""
    if not missing:
        return []
    lines = [f"- {name.replace('_', ' ')}: {reason}." for name, reason in missing.items()]
    return ["## Not available", "", *lines, ""]


# Reports as rows of a table, for statistics and learning: one row a record, or one a record and channel.


By = Literal["record", "channel"]


class Reported(Protocol):
    """What a row needs of a report; `AnalysisReport` and `VibrationReport` have it."""

    source: str
    rate: float
    duration: float
    notes: list[str]
    missing: dict[str, str]
    conditions: dict[str, float]

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
    head |= {f"{name}.mean": float(value) for name, value in report.conditions.items()}
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
    return pd.DataFrame([{key: _nan_for_none(row.get(key)) for key in [*order, "notes"]} for row in rows])


def _nan_for_none(value: Any) -> Any:
    return math.nan if value is None else value


# What an analysis found, as data, tables and Markdown.


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
        RMS by `band` and by `orders`, dimensions (harmonic, channel), as `gmf_rms`; coordinate `frequency` (Hz).
        `orders` follows the speed's drift: it is taken from the time-synchronous average.
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
    conditions : dict of str to float
        Means of the columns that say how the machine ran and are no vibration, temperatures and loads, by name, in
        their units.
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
    conditions: dict[str, float] = field(default_factory=dict)

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
