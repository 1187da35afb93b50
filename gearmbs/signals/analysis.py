"""From a record to the paper's features and a diagnosis table: one call, one report."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy.fft
import xarray as xr

from .analysis_report import AnalysisReport
from .angular import samples_per_revolution, time_synchronous_average
from .bands import HALF_WIDTH, TRANSITION, band_rms
from .envelope import kurtogram
from .errors import SignalError
from .indicators import condition_indicators, crest_factor, kurtosis, peak_to_peak
from .io import read_signal
from .phase import phase_from_line, phase_from_speed, phase_from_tacho
from .signal import common_unit, rate_of, require, units_of
from .spectra import spectrum
from .speed import MIN_QUALITY, SpeedEstimate, estimate_speed

Progress = Callable[[float, str], None]
SPEED_TOLERANCE = 0.02
"""How far from its nominal speed a drive is looked for, as a part of it."""

LINE_SECONDS = 2.0
SIDEBANDS = 3
MIN_AVERAGES = 2
KURTOGRAM_LEVELS = 6


@dataclass(frozen=True, kw_only=True)
class AnalysisOptions:
    """Settings of `analyse`; see there for what they mean."""

    teeth: int | Sequence[int] | None = None
    speed: float | None = None
    speed_range: tuple[float, float] | None = None
    tacho: str | None = None
    pulses_per_rev: float = 1.0
    wheel: int = 1
    harmonics: int = 3
    half_width: float = HALF_WIDTH
    lines: int = 5


def analyse(
    signal: xr.DataArray,
    teeth: int | Sequence[int] | None = None,
    *,
    progress: Progress | None = None,
    options: AnalysisOptions | None = None,
    **settings: Any,
) -> AnalysisReport:
    """Analyse a record of a running gear pair.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    teeth : int or sequence, optional
        Tooth counts, the wheel of the reference shaft first; default the signal's.
    progress : callable, optional
        Called as progress(fraction, stage).
    options : AnalysisOptions, optional
        The settings below in one object, instead of keywords.
    speed : float, optional
        Speed of that wheel in rad/s; default the signal's. The mesh line is looked for within 2 % of it, and used if
        found, for no drive holds its nominal speed exactly. Without a speed, see `estimate_speed`.
    speed_range : (float, float), optional
        Speeds in rad/s to look for, where none is given.
    tacho : str, optional
        Name of a tacho channel; it gives the angle and is left out of the analysis.
    pulses_per_rev : float
        Of the tacho, default 1.
    wheel : int
        Which wheel's shaft the average, its indicators and the sidebands follow: 1, the default, is the first of
        `teeth`, 2 its mate.
    harmonics : int
        Gear mesh harmonics wanted, default 3; those that do not fit below half the sampling rate are left out with a
        note.
    half_width : float
        Half width of the harmonics' bands, as a fraction of GMF, default 0.25.
    lines : int
        How many of the strongest spectral lines to list per channel, default 5.

    Returns
    -------
    AnalysisReport

    Raises
    ------
    MissingMetadataError
        If the tooth count is unknown.
    SignalError
        If no mesh line is found and no speed given, or the record is too short for the bands.
    TypeError
        For settings there are not.
    """
    if options is None:
        options = AnalysisOptions(teeth=teeth, **settings)
    elif settings or teeth is not None:
        raise TypeError(f"analyse: give options or {', '.join(['teeth'] * (teeth is not None) + list(settings))}")
    return _report(signal, options, _Stages(progress))


def analyse_file(
    path: str | Path,
    *,
    teeth: int | Sequence[int] | None = None,
    rate: float | None = None,
    units: str | Sequence[str] | Mapping[str, str] | None = None,
    speed: float | None = None,
    channels: Sequence[str] | None = None,
    format: str | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> AnalysisReport:
    """Read a file (`read_signal`) and analyse it.

    Parameters
    ----------
    path : str or Path
    teeth, rate, units, speed, channels, format, progress
        As for `read_signal`.
    **settings
        The other settings of `analyse`.

    Returns
    -------
    AnalysisReport

    Raises
    ------
    SignalFileError, MissingMetadataError, SignalError
        See `read_signal` and `analyse`.
    """
    options = AnalysisOptions(speed=speed, **settings)
    signal = read_signal(
        path, rate=rate, units=units, speed=speed, teeth=teeth, channels=channels, format=format, progress=progress
    )
    return analyse(signal, options=options, progress=progress)


def _report(signal: xr.DataArray, options: AnalysisOptions, tell: _Stages) -> AnalysisReport:
    """Carry out the stages of an analysis."""
    counts = require(signal, "teeth", options.teeth, needed_for="the gear mesh frequency")
    notes: list[str] = []
    tell("speed")
    shaft, signal = _shaft_angle(signal, counts, options, notes)
    gmf = counts[0] * shaft.speed / (2.0 * math.pi)
    rate = rate_of(signal)
    harmonics = _fitting_harmonics(rate, gmf, options, notes)
    tell("averaging")
    if not 1 <= options.wheel <= len(counts):
        raise SignalError(f"wheel: must be 1 to {len(counts)}, the number of tooth counts given, got {options.wheel!r}")
    own, phase = counts[options.wheel - 1], shaft.phase
    if options.wheel > 1:
        phase = phase * (counts[0] / own)
        notes.append(f"Averages, indicators and sidebands follow wheel {options.wheel} with {own} teeth.")
    average = _average(signal, phase, own, harmonics, shaft.speed * counts[0] / own, notes, tell)
    sidebands = None if average is None else _line_table(average, own, harmonics)
    by_orders = np.full((harmonics, signal.sizes["channel"]), np.nan)
    if sidebands is not None:
        by_orders = sidebands.sel(sideband=0).values
    bands = _band_levels(signal, gmf, harmonics, options.half_width, tell)
    tell("lines")
    strongest = _strongest(signal, gmf, options.lines)
    tell("kurtogram")
    impulsive = None
    if signal.sizes["time"] // 2 >= 16 << KURTOGRAM_LEVELS:
        impulsive = kurtogram(signal, levels=KURTOGRAM_LEVELS, progress=lambda f, _: tell("kurtogram", f))
    tell("done", 1.0)
    return AnalysisReport(
        source=str(signal.attrs.get("source", signal.name or "signal")),
        rate=rate,
        duration=signal.sizes["time"] / rate,
        teeth=counts,
        speed=shaft.speed,
        gmf=gmf,
        speed_origin=shaft.origin,
        harmonics=_harmonic_table(signal, bands, by_orders, gmf, options.half_width),
        levels=_levels(signal),
        lines=strongest,
        sidebands=sidebands,
        indicators=None if average is None else condition_indicators(average, own, harmonics=harmonics),
        impulsive=impulsive,
        average=average,
        estimate=shaft.estimate,
        notes=notes,
    )


def _fitting_harmonics(rate: float, gmf: float, options: AnalysisOptions, notes: list[str]) -> int:
    """Return how many of the harmonics wanted have their bands below half the sampling rate."""
    fitting = math.floor((rate / 2 / gmf - options.half_width - TRANSITION) * (1 - 1e-9))
    if fitting < 1:
        raise SignalError(
            f"gmf: the band around {gmf:g} Hz does not fit below half the sampling rate ({rate / 2:g} Hz)"
        )
    if fitting < options.harmonics:
        notes.append(f"Only {fitting} of {options.harmonics} mesh harmonics fit below half the sampling rate.")
    return min(fitting, options.harmonics)


def _band_levels(signal: xr.DataArray, gmf: float, harmonics: int, half_width: float, tell: _Stages) -> np.ndarray:
    """Return the RMS in the band of each harmonic, shape (harmonics, channels)."""
    widths = {"half_width": half_width * gmf, "transition": TRANSITION * gmf, "period": 1.0 / gmf}
    levels = []
    for k in range(1, harmonics + 1):
        tell("bands", (k - 1) / harmonics)
        levels.append(band_rms(signal, k * gmf, **widths).values)
    return np.stack(levels)


class _Stages:
    """Fractions of the whole, from fractions of its stages."""

    ORDER = ("speed", "averaging", "bands", "lines", "kurtogram", "done")
    STARTS = (0.0, 0.2, 0.45, 0.65, 0.7, 1.0)

    def __init__(self, progress: Progress | None) -> None:
        self.progress = progress

    def __call__(self, stage: str, fraction: float = 0.0) -> None:
        if self.progress is None:
            return
        i = self.ORDER.index(stage)
        start, stop = self.STARTS[i], self.STARTS[min(i + 1, len(self.STARTS) - 1)]
        self.progress(start + fraction * (stop - start), stage)


class _Shaft(NamedTuple):
    """Angle of the reference shaft over time, its mean speed (rad/s) and where they are from."""

    phase: xr.DataArray
    speed: float
    origin: str
    estimate: SpeedEstimate | None = None


def _shaft_angle(
    signal: xr.DataArray, counts: tuple[int, ...], options: AnalysisOptions, notes: list[str]
) -> tuple[_Shaft, xr.DataArray]:
    """Return the shaft's angle from the tacho, the given speed or the mesh line, and the channels left to analyse."""
    if options.tacho is not None:
        return _from_tacho(signal, options.tacho, options.pulses_per_rev)
    nominal = options.speed if options.speed is not None else signal.attrs.get("speed")
    if nominal is not None:
        return _near_speed(signal, counts, float(nominal), notes), signal
    estimate = estimate_speed(signal, counts, speed_range=options.speed_range)
    if estimate.phase is None:
        notes.append("The mesh line is too weak to follow in phase; the speed is taken as constant.")
    phase = phase_from_speed(signal, estimate.speed) if estimate.phase is None else estimate.phase
    return _Shaft(phase, estimate.speed, "estimated from the mesh line", estimate), signal


def _from_tacho(signal: xr.DataArray, tacho: str, pulses_per_rev: float) -> tuple[_Shaft, xr.DataArray]:
    phase = phase_from_tacho(signal, tacho, pulses_per_rev=pulses_per_rev)
    rest = [c for c in signal["channel"].values.tolist() if c != tacho]
    if not rest:
        raise SignalError(f"tacho: {tacho!r} is the only channel, nothing is left to analyse")
    mean = float(phase.values[-1] - phase.values[0]) / float(phase["time"].values[-1] - phase["time"].values[0])
    return _Shaft(phase, mean, f"from the tacho {tacho!r}"), signal.sel(channel=rest)


def _near_speed(signal: xr.DataArray, counts: tuple[int, ...], nominal: float, notes: list[str]) -> _Shaft:
    """Return the angle by the mesh line near a given speed, or at that speed where there is none."""
    around = (nominal * (1.0 - SPEED_TOLERANCE), nominal * (1.0 + SPEED_TOLERANCE))
    try:
        found = estimate_speed(signal, counts, speed_range=around)
    except SignalError:
        found = None
    if found is not None and found.phase is not None:
        words = f"from the mesh line, {100 * (found.speed / nominal - 1):+.3f} % off the given speed"
        return _Shaft(found.phase, found.speed, words, found)
    try:
        phase = phase_from_line(signal, nominal * counts[0] / (2.0 * math.pi), counts[0])
    except SignalError:
        phase = None
    if phase is not None and phase.attrs["quality"] >= MIN_QUALITY:
        followed = float(phase.attrs["mean_speed"])
        if abs(followed / nominal - 1) < SPEED_TOLERANCE:
            return _Shaft(phase, followed, "from the given speed, followed by the mesh line")
    notes.append("No mesh line could be followed near the given speed; it is taken as constant.")
    return _Shaft(phase_from_speed(signal, nominal), nominal, "as given")


def _average(
    signal: xr.DataArray,
    phase: xr.DataArray,
    teeth: int,
    harmonics: int,
    speed: float,
    notes: list[str],
    tell: _Stages,
) -> xr.DataArray | None:
    slowest = speed / (2.0 * math.pi)
    turns = float(phase.values[-1] - phase.values[0]) / (2.0 * math.pi)
    if turns < MIN_AVERAGES + 1:
        notes.append(f"The record holds {turns:.2f} revolutions, too few for an average and its indicators.")
        return None
    per_rev = max(samples_per_revolution(rate_of(signal), slowest), 4 * teeth * harmonics)
    return time_synchronous_average(signal, phase, samples_per_rev=per_rev, progress=lambda f, _: tell("averaging", f))


def _line_table(average: xr.DataArray, teeth: int, harmonics: int) -> xr.DataArray:
    amplitudes = 2.0 / average.sizes["angle"] * np.abs(scipy.fft.rfft(average.values, axis=0))
    sides = np.arange(-SIDEBANDS, SIDEBANDS + 1)
    numbers = np.arange(1, harmonics + 1)
    values = amplitudes[(numbers[:, None] * teeth + sides[None, :])] / math.sqrt(2.0)
    return xr.DataArray(
        values,
        dims=("harmonic", "sideband", "channel"),
        coords={"harmonic": numbers, "sideband": sides, "channel": average["channel"].values},
        attrs={"units": average.attrs["units"], "long_name": "RMS of the line"},
    )


def _harmonic_table(
    signal: xr.DataArray, band: np.ndarray, orders: np.ndarray, gmf: float, half_width: float
) -> xr.Dataset:
    dims = ("harmonic", "channel")
    numbers = np.arange(1, band.shape[0] + 1)
    units = {"units": common_unit(signal)}
    return xr.Dataset(
        {"band": (dims, band, units), "orders": (dims, orders, units)},
        coords={
            "harmonic": numbers,
            "frequency": ("harmonic", numbers * gmf, {"units": "Hz"}),
            "channel": signal["channel"].values,
            "channel_units": ("channel", np.asarray(units_of(signal), dtype=str)),
        },
        attrs={"gmf": gmf, "half_width": half_width, "transition": TRANSITION},
    )


def _levels(signal: xr.DataArray) -> xr.Dataset:
    measures: dict[str, Callable[[np.ndarray], float]] = {
        "rms": np.std,
        "peak_to_peak": peak_to_peak,
        "crest": crest_factor,
        "kurtosis": kurtosis,
    }
    found: dict[str, list[float]] = {name: [] for name in measures}
    for column in signal.values.T:
        one = np.ascontiguousarray(column)
        for name, measure in measures.items():
            found[name].append(float(measure(one)))
    unit = common_unit(signal)
    variables = {
        name: ("channel", np.asarray(values), {"units": "1" if name in ("crest", "kurtosis") else unit})
        for name, values in found.items()
    }
    return xr.Dataset(variables, coords={"channel": signal["channel"].values})


def _strongest(signal: xr.DataArray, gmf: float, count: int) -> pd.DataFrame:
    lines = spectrum(signal, scaling="rms", segment=LINE_SECONDS)
    frequency = lines["frequency"].values
    rows = []
    for name, column in zip(signal["channel"].values, lines.values.T):
        peaks = 1 + np.flatnonzero((column[1:-1] > column[:-2]) & (column[1:-1] >= column[2:]))
        for i in peaks[np.argsort(column[peaks])[::-1][:count]]:
            rows.append((str(name), float(frequency[i]), float(frequency[i] / gmf), float(column[i])))
    return pd.DataFrame(rows, columns=["channel", "frequency", "gmf_order", "rms"])
