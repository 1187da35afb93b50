"""What every report of one record has: levels, strongest lines, the most impulsive band, and their tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from .envelope import kurtogram
from .indicators import crest_factor, kurtosis, peak_to_peak
from .report import markdown_table, significant
from .signal import common_unit
from .spectra import spectrum

LINE_SECONDS = 2.0
KURTOGRAM_LEVELS = 6
SAME_LINE = 1e-9
"""Known lines closer than this part of their frequency are one."""
IMPULSIVE = {"best_centre": "centre, Hz", "best_bandwidth": "bandwidth, Hz", "best_kurtosis": "kurtosis - 2"}
BAND_FEATURES = {"best_centre": "band_centre_hz", "best_bandwidth": "band_width_hz", "best_kurtosis": "band_kurtosis"}
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


def name_lines(lines: pd.DataFrame, known: Mapping[str, float], within: float) -> pd.DataFrame:
    """Add the column ``of``: which of the known lines (name to Hz) is nearest, or empty if none is near enough.

    Lines at one frequency are all named, as those of shafts that turn together.
    """
    frequencies = np.array(list(known.values()))
    names = []
    for f in lines["frequency"]:
        nearest = frequencies[np.argmin(np.abs(frequencies - f))]
        same = [name for name, at in known.items() if math.isclose(at, nearest, rel_tol=SAME_LINE)]
        names.append(" or ".join(same) if abs(nearest - f) <= within else "")
    return lines.assign(of=names)


def line_spectrum(signal: xr.DataArray) -> xr.DataArray:
    """RMS spectrum averaged over segments of 2 s."""
    return spectrum(signal, scaling="rms", segment=LINE_SECONDS)


def impulsive_band(signal: xr.DataArray, progress: Callable[[float, str], None] | None = None) -> xr.Dataset | str:
    """Kurtogram of the record, or why there is none."""
    least = 2 * (16 << KURTOGRAM_LEVELS)
    if signal.sizes["time"] < least:
        return f"the record holds {signal.sizes['time']} samples, a kurtogram needs {least}"
    if not np.all(np.std(signal.values, axis=0) > 0.0):
        return "a channel does not change, which leaves nothing to find a band in"
    return kurtogram(signal, levels=KURTOGRAM_LEVELS, progress=progress)


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
