"""From a record to the paper's features and a diagnosis table: one call, one report."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Unpack, overload

import numpy as np
import scipy.fft
import xarray as xr

from gearmbs.progress import staged
from gearmbs.signals.analysis.bands import HALF_WIDTH, TRANSITION, band_rms, check_harmonics
from gearmbs.signals.analysis.indicators import condition_indicators
from gearmbs.signals.analysis.report import (
    AnalysisReport,
    impulsive_band,
    levels,
    line_spectrum,
    name_lines,
    strongest_lines,
    unchanging,
)
from gearmbs.signals.analysis.vibration import VibrationReport, vibration_report
from gearmbs.signals.diagnosis.planetary import PlanetaryReport, diagnose_planetary
from gearmbs.signals.diagnosis.planetary_averages import planetary_lines
from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.files.simulated import read_any
from gearmbs.signals.optical import instrument_faults
from gearmbs.signals.rotation.angular import angular_resample, samples_per_revolution, time_synchronous_average
from gearmbs.signals.rotation.keywords import SpeedKeywords
from gearmbs.signals.rotation.mesh_shaft import compare_with_mesh, mesh_shaft
from gearmbs.signals.rotation.shaft import Known, Shaft, known_shaft
from gearmbs.signals.signal.arguments import DataKeywords
from gearmbs.signals.signal.given import contradictions, given_rate, given_speed
from gearmbs.signals.signal.inputs import Given, Units, to_signal
from gearmbs.signals.signal.labels import CONDITIONS, UNIT_ASKED, measured
from gearmbs.signals.signal.signal import check_teeth, common_unit, make_signal, rate_of, units_of, with_metadata
from gearmbs.signals.spectra import spectrum

Progress = Callable[[float, str], None]
SIDEBANDS = 3
MIN_AVERAGES = 2
LINE_TURNS = 32


@dataclass(frozen=True, kw_only=True)
class AnalysisOptions:
    """Settings of `analyse`; see there for what they mean."""

    teeth: int | Sequence[int] | None = None
    speed: Any = None
    speed_range: tuple[float, float] | None = None
    phase: xr.DataArray | None = None
    tacho: str | None = None
    pulses_per_rev: float = 1.0
    speed_channel: str | None = None
    wheel: int = 1
    harmonics: int = 3
    half_width: float = HALF_WIDTH
    lines: int = 5
    planetary: Any = None
    planets: int | Sequence[float] = 3
    member: str = "carrier"

    @property
    def known(self) -> Known:
        """What is known of the shaft."""
        return Known(**{name: getattr(self, name) for name in Known._fields})


SETTINGS = tuple(f.name for f in fields(AnalysisOptions))


class AnalysisKeywords(SpeedKeywords, total=False):
    """Fields of `AnalysisOptions` but for teeth and a planetary set, for type checkers."""

    speed_range: tuple[float, float] | None
    wheel: int
    harmonics: int
    half_width: float
    lines: int
    planets: int | Sequence[float]
    member: str


class PlanetaryKeywords(AnalysisKeywords, DataKeywords, total=False):
    """What `analyse` takes beside a planetary set."""

    progress: Progress | None


class FileKeywords(PlanetaryKeywords, total=False):
    """What `analyse_file` takes: all of `analyse`, and ``format`` of `gearmbs.signals.read_signal`."""

    teeth: int | Sequence[int] | None
    planetary: Any
    options: AnalysisOptions | None
    format: str | None


# a planetary set is of gears, which signals do not know, and a speed has many shapes
@overload
def analyse(signal: Any, *, planetary: Any, **settings: Unpack[PlanetaryKeywords]) -> PlanetaryReport: ...


@overload
def analyse(
    signal: Any,
    teeth: int | Sequence[int],
    *,
    rate: Given | None = None,
    units: Units | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
    progress: Progress | None = None,
    **settings: Unpack[AnalysisKeywords],
) -> AnalysisReport: ...


@overload
def analyse(
    signal: Any,
    teeth: int | Sequence[int] | None = None,
    *,
    rate: Given | None = None,
    units: Units | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
    progress: Progress | None = None,
    options: AnalysisOptions | None = None,
    **settings: Unpack[AnalysisKeywords],
) -> AnalysisReport | VibrationReport: ...


@staged("analysing")
def analyse(
    signal: Any,
    teeth: int | Sequence[int] | None = None,
    *,
    rate: Given | None = None,
    units: Units | None = None,
    channels: Sequence[str] | None = None,
    gaps: str | None = None,
    progress: Progress | None = None,
    options: AnalysisOptions | None = None,
    **settings: Any,
) -> AnalysisReport | VibrationReport | PlanetaryReport:
    """Analyse a record: of a running gear pair if teeth are known, of a planetary set, or of plain vibration.

    Parameters
    ----------
    signal : array_like, DataFrame, DataArray, Dataset or path
        Data of any shape (`to_signal`): samples with `rate`, a table, a signal, a simulated record, a file.
    teeth : int or sequence, optional
        Tooth counts, the wheel of the reference shaft first; default the signal's. Without them the report is a
        `VibrationReport`.
    rate, units, channels, gaps : optional
        As for `to_signal`.
    progress : callable, optional
        Called as progress(fraction, stage); without it a bar is shown where somebody watches, see `gearmbs.progress`.
    options : AnalysisOptions, optional
        The settings below in one object, instead of keywords.
    speed : float, str or curve, optional
        Speed of that wheel in any shape that `speed_curve` reads; default the signal's. Near a constant speed the mesh
        line is looked for within 2 %, and used if found, for no drive holds its nominal speed exactly; a curve gives
        the angle as it is. Without a speed, see `estimate_speed`.
    speed_range : (float, float), optional
        Speeds in rad/s to look for, where none is given.
    phase : xarray.DataArray, optional
        The angle itself, rad, of dimension (time,).
    tacho : str, optional
        Name of a tacho channel; it gives the angle and is left out of the analysis.
    pulses_per_rev : float
        Of the tacho, default 1.
    speed_channel : str, optional
        Name of a channel that holds the speed in its own unit; it is left out of the analysis.
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
    planetary : PlanetarySet or (int, int, int), optional
        A planetary set, or the teeth of its sun, planets and ring; default what a simulated record holds. The speed is
        then that of the carrier, and the report a `PlanetaryReport` (`diagnose_planetary`).
    planets : int or sequence of float
        How many planets, or their angles, default 3.
    member : {"carrier", "sun"}
        Whose speed is given, of a planetary set.

    Returns
    -------
    AnalysisReport, VibrationReport or PlanetaryReport

    Raises
    ------
    MissingMetadataError
        If no sampling rate is known.
    SignalError
        If no mesh line is found and no speed given, or the record is too short for the bands.
    TypeError
        For settings there are not.
    """
    if options is None:
        unknown = [name for name in settings if name not in SETTINGS]
        if unknown:
            hint = "; of bearings see diagnose_bearing" if unknown[0].startswith("bearing") else ""
            raise TypeError(f"analyse: there is no setting {unknown[0]!r}; settings are {', '.join(SETTINGS)}{hint}")
        options = AnalysisOptions(teeth=teeth, **settings)
    elif settings or teeth is not None:
        raise TypeError(f"analyse: give options or {', '.join(['teeth'] * (teeth is not None) + list(settings))}")
    helpers = [name for name in (options.tacho, options.speed_channel) if name is not None]
    kept = None if channels is None else [*channels, *(name for name in helpers if name not in channels)]
    data = to_signal(signal, rate=rate, units=units, channels=kept, gaps=gaps)
    speed = None if isinstance(options.speed, Path) else given_speed(options.speed)
    own = data.attrs
    said = contradictions(
        own.get("teeth"), own.get("speed"), options.teeth, speed, str(own.get("source", "the signal"))
    )
    known = any(value is not None for value in (options.speed, options.phase, options.tacho, options.speed_channel))
    data, own_speed = measured(data, channels or (), helpers, known)
    said += instrument_faults(data, [*helpers, *([] if own_speed is None else [own_speed])])
    if said:
        data = with_metadata(data, notes=[*data.attrs.get("notes", ()), *said])
    if own_speed is not None:
        options = replace(options, speed_channel=own_speed)
    counts = options.teeth if options.teeth is not None else data.attrs.get("teeth")
    if options.planetary is not None or (counts is None and "planetary" in data.attrs):
        return _planetary(data, options)
    if counts is None:
        return vibration_report(data, options.known, lines=options.lines, progress=progress)
    try:
        return _report(data, check_teeth(counts), options, _Stages(progress))
    except MissingMetadataError:
        raise
    except SignalError as error:
        asked = [note for note in data.attrs.get("notes", ()) if note.startswith(UNIT_ASKED)]
        if not asked:
            raise
        raise SignalError(f"{error}; {asked[0]}") from error


def analyse_file(path: str | Path, **settings: Unpack[FileKeywords]) -> AnalysisReport | VibrationReport:
    """Read a file (`read_signal`) and analyse it; `analyse` takes a path as well.

    Parameters
    ----------
    path : str or Path
    **settings
        As for `analyse`, and `format` as for `read_signal`.

    Returns
    -------
    AnalysisReport or VibrationReport
        Or a `PlanetaryReport`, as `analyse`.

    Raises
    ------
    SignalFileError, MissingMetadataError, SignalError
        See `read_signal` and `analyse`.
    """
    given: dict[str, Any] = {**settings}
    if given.get("format") is None:
        given.pop("format", None)
        return analyse(path, **given)
    reading = {name: given.pop(name) for name in ("rate", "units", "gaps", "format") if name in given}
    return analyse(read_any(path, **{**reading, "rate": given_rate(reading.get("rate"))}), **given)


def _planetary(signal: xr.DataArray, options: AnalysisOptions) -> PlanetaryReport:
    """Carry out the analysis of a planetary set, with the carrier's angle from whatever gives it."""
    given, planets = options.planetary, options.planets
    if given is None:
        given, planets = signal.attrs["planetary"], signal.attrs["planet_angles"]
    if options.known == Known():
        return diagnose_planetary(signal, given, planets=planets)
    found, kept = known_shaft(signal, options.known)
    if isinstance(found, Shaft):
        lines = planetary_lines(given, planets)
        phase = found.phase * lines.carrier(1.0, options.member)
        return diagnose_planetary(kept, lines, phase=phase)
    return diagnose_planetary(kept, given, found, planets=planets, member=options.member)


def _report(signal: xr.DataArray, counts: tuple[int, ...], options: AnalysisOptions, tell: _Stages) -> AnalysisReport:
    """Carry out the stages of an analysis."""
    notes = [str(note) for note in signal.attrs.get("notes", ())]
    missing: dict[str, str] = {}
    tell("speed")
    if not 1 <= options.wheel <= len(counts):
        raise SignalError(f"wheel: must be 1 to {len(counts)}, the number of tooth counts given, got {options.wheel!r}")
    shaft, signal = mesh_shaft(signal, counts, options.known, notes)
    gmf = counts[0] * shaft.speed / (2.0 * math.pi)
    rate = rate_of(signal)
    top = gmf if shaft.range is None else gmf * shaft.range[1] / shaft.speed
    harmonics = _fitting_harmonics(rate, top, options, notes, shaft)
    tell("averaging")
    own, phase = counts[options.wheel - 1], shaft.phase
    if options.wheel > 1:
        phase = (phase * (counts[0] / own)).assign_attrs(**phase.attrs, wheel=options.wheel)
        notes.append(f"Averages, indicators and sidebands follow wheel {options.wheel} with {own} teeth.")
    average = _average(signal, phase, own, harmonics, shaft.speed * counts[0] / own, notes, tell)
    if average is None:
        turns = float(phase.values[-1] - phase.values[0]) / (2.0 * math.pi)
        why = f"the record holds {turns:.2f} revolutions, an average needs {MIN_AVERAGES + 1}"
        missing |= dict.fromkeys(("average", "indicators", "sidebands", "orders"), why)
    sidebands = None if average is None else _line_table(average, own, harmonics)
    by_orders = np.full((harmonics, signal.sizes["channel"]), np.nan)
    if sidebands is not None:
        by_orders = sidebands.sel(sideband=0).values
    followed = _in_angle(signal, shaft, counts[0], harmonics, notes)
    source, scale = (signal, 1.0) if followed is None else (followed, shaft.speed / math.tau)
    if followed is not None and not shaft.integrated:
        compare_with_mesh(make_signal(followed.values, scale * rate_of(followed)), counts, shaft, notes)
    bands = _band_levels(source, gmf / scale, harmonics, options.half_width, tell)
    tell("lines")
    spectral = line_spectrum(source) if followed is None else spectrum(source, scaling="rms", segment=float(LINE_TURNS))
    strongest = strongest_lines(
        spectral.assign_coords(frequency=spectral["frequency"] * scale), options.lines, gmf, "gmf_order"
    )
    if signal.attrs.get("known_lines") and strongest.size:
        within = 1.5 * scale * float(spectral["frequency"].diff("frequency")[0])
        strongest = name_lines(strongest, json.loads(signal.attrs["known_lines"]), within)
    tell("kurtogram")
    impulsive = impulsive_band(signal, lambda f, _: tell("kurtogram", f))
    if isinstance(impulsive, str):
        missing["impulsive"] = impulsive
    elif (still := unchanging(signal)) is not None:
        missing["impulsive"] = still
    if shaft.estimate is None:
        missing["estimate"] = f"the speed is {shaft.origin}, it was not estimated"
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
        levels=levels(signal),
        lines=strongest,
        sidebands=sidebands,
        indicators=None if average is None else condition_indicators(average, own, harmonics=harmonics),
        impulsive=None if isinstance(impulsive, str) else impulsive,
        average=average,
        estimate=shaft.estimate,
        speed_range=shaft.range,
        missing=missing,
        notes=notes,
        conditions=dict(signal.attrs.get(CONDITIONS, {})),
    )


def _in_angle(signal: xr.DataArray, shaft: Shaft, teeth: int, harmonics: int, notes: list[str]) -> xr.DataArray | None:
    """The record over revolutions, as a signal whose "Hz" are orders, where the speed varies; else None."""
    if shaft.range is None:
        return None
    per_rev = 1 << math.ceil(math.log2(2.5 * teeth * (harmonics + 1)))
    angular = angular_resample(signal, shaft.phase, samples_per_rev=per_rev)
    low, high = (value * 30.0 / math.pi for value in shaft.range)
    notes.append(
        f"The speed varies from {low:.1f} to {high:.1f} rpm: bands and lines follow it in angle, their frequencies "
        "in Hz are those at the mean speed."
    )
    return make_signal(
        angular.values, float(per_rev), channels=[str(c) for c in angular["channel"].values], units=units_of(signal)
    )


def _fitting_harmonics(rate: float, gmf: float, options: AnalysisOptions, notes: list[str], shaft: Shaft) -> int:
    """Return how many of the harmonics wanted have their bands below half the sampling rate."""
    check_harmonics(options.harmonics)
    fitting = math.floor((rate / 2 / gmf - options.half_width - TRANSITION) * (1 - 1e-9))
    if fitting < 1:
        pulses = options.pulses_per_rev
        each = f"{pulses:g} pulse{'s' * (pulses != 1)} a turn"
        tacho = (
            f"; the tacho {options.tacho!r} gives {shaft.speed * 30.0 / math.pi:.0f} rpm with {each}: if it has more, "
            "say how many (--pulses)"
        ) * shaft.tacho
        raise SignalError(
            f"gmf: the band around {gmf:g} Hz does not fit below half the sampling rate ({rate / 2:g} Hz){tacho}"
        )
    if fitting < options.harmonics:
        notes.append(f"Only {fitting} of {options.harmonics} mesh harmonics fit below half the sampling rate.")
    return min(fitting, options.harmonics)


def _band_levels(signal: xr.DataArray, gmf: float, harmonics: int, half_width: float, tell: _Stages) -> np.ndarray:
    """Return the RMS in the band of each harmonic, shape (harmonics, channels)."""
    widths = {"half_width": half_width * gmf, "transition": TRANSITION * gmf, "period": 1.0 / gmf}
    rows = []
    for k in range(1, harmonics + 1):
        tell("bands", (k - 1) / harmonics)
        rows.append(band_rms(signal, k * gmf, **widths).values)
    return np.stack(rows)


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
    units = common_unit(signal)
    return xr.Dataset(
        {
            "band": (dims, band, {"units": units, "long_name": "RMS in the band around the GMF harmonic"}),
            "orders": (dims, orders, {"units": units, "long_name": "RMS of the line at the GMF harmonic"}),
        },
        coords={
            "harmonic": numbers,
            "frequency": ("harmonic", numbers * gmf, {"units": "Hz"}),
            "channel": signal["channel"].values,
            "channel_units": ("channel", np.asarray(units_of(signal), dtype=str)),
        },
        attrs={"gmf": gmf, "half_width": half_width, "transition": TRANSITION},
    )
