"""Analysis of a record of which no teeth are known: levels, spectrum, impulsive band, envelope, orders of the shaft."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs._display import Shown
from gearmbs.signals.analysis.bands import harmonic_amplitudes
from gearmbs.signals.analysis.report import (
    BAND_FEATURES,
    FULL_LEVELS,
    IMPULSIVE,
    LINE_SECONDS,
    By,
    channel_table,
    feature_rows,
    impulsive_band,
    levels,
    line_spectrum,
    markdown_table,
    missing_list,
    rows_to_frame,
    significant,
    strongest_lines,
    transposed,
    unchanging,
)
from gearmbs.signals.conversion import convert
from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.order_tracking import order_track
from gearmbs.signals.rotation.rate import MIXED, other_rate
from gearmbs.signals.rotation.shaft import Known, Shaft, known_shaft, refined_speed, remark_plausibility
from gearmbs.signals.rotation.sweep import remark_sweep
from gearmbs.signals.signal.labels import CONDITIONS
from gearmbs.signals.signal.signal import rate_of, units_of
from gearmbs.signals.signal.units import detected_unit, unit_dimension
from gearmbs.signals.spectra import envelope, spectrum

# What was found in a record of which no teeth are known, as data, tables and Markdown.


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
    conditions : dict of str to float
        Means of the columns that say how the machine ran and are no vibration, temperatures and loads, by name, in
        their units.
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
    conditions: dict[str, float] = field(default_factory=dict)

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
        known = (f"{name} in {low:.0f} to {high:.0f} Hz" for name, low, high in ends if not math.isnan(low))
        return ["; ".join(known) + "."]

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


ORDERS = 10
VELOCITY_BAND = (10.0, 1000.0)
"""Band of the RMS velocity in Hz, as in ISO 20816 for machines above 600 rpm."""
EDGE = 0.05
"""A band ends at least this part of its width above zero and below half the sampling rate."""
LEAST_FALL = 16.0
"""Least width of a band's fall, in reciprocal lengths of the record: a filter of 100 dB takes 6.4 reciprocal widths,
here 0.4 of the record."""
LEAST_BAND = 16
"""Envelopes are taken in bands of at least this part of half the sampling rate: a narrow one holds only slow lines."""
FAMILY = 3
"""Lines at orders of one shaft, at least, that tell another speed than the given one: of two one is chance."""
SPEED_DIFFERS = 1e-3
"""Share from which a report says in words that lines of the shaft are beside the given speed."""
NO_SPEED = "the speed is not known; give speed='1500 rpm' (--speed), a curve or a tacho"
Progress = Callable[[float, str], None]


def vibration_report(
    signal: xr.DataArray, known: Known, *, lines: int = 5, progress: Progress | None = None
) -> VibrationReport:
    """Analyse a record of plain vibration.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    known : Known
        What is known of the shaft.
    lines : int
        How many of the strongest lines to list per channel.
    progress : callable, optional
        Called as progress(fraction, stage).

    Returns
    -------
    VibrationReport
    """
    tell = progress or (lambda fraction, stage: None)
    notes = [str(note) for note in signal.attrs.get("notes", ())]
    missing: dict[str, str] = {}
    tell(0.0, "speed")
    found, kept = known_shaft(signal, known)
    if isinstance(found, Shaft):
        notes += found.phase.attrs.get("notes", ())
    speed, origin = _speed(kept, found, notes)
    remark_plausibility(kept, speed, False, notes)
    tell(0.1, "levels")
    table = levels(kept, FULL_LEVELS)
    velocity = _velocity(kept)
    table["velocity_rms"] = ("channel", velocity.values, {"units": "m/s"})
    if velocity.missing:
        missing["velocity_rms"] = velocity.missing
    tell(0.25, "lines")
    average = line_spectrum(kept)
    shaft_hz = None if speed is None else speed / math.tau
    varying = isinstance(found, Shaft) and found.range is not None
    orders = _orders(kept, found, speed)
    if isinstance(orders, str):
        missing["orders"] = orders
    tell(0.45, "kurtogram")
    impulsive = impulsive_band(kept, lambda f, _: tell(0.45 + 0.35 * f, "kurtogram"))
    demodulated = lines_of_envelope = None
    if isinstance(impulsive, str):
        missing["impulsive"] = impulsive
        missing["envelope"] = missing["envelope_lines"] = "there is no impulsive band to take it in: " + impulsive
    else:
        if (still := unchanging(kept)) is not None:
            missing["impulsive"] = still
        tell(0.8, "envelope")
        try:
            demodulated = _envelope(kept, impulsive)
            lines_of_envelope = strongest_lines(demodulated, lines, None if varying else shaft_hz)
        except SignalError as error:
            missing["envelope"] = missing["envelope_lines"] = str(error)
    if varying:
        notes.append("The speed varies: lines are listed in Hz as they are, orders are followed in angle.")
    tell(1.0, "done")
    return VibrationReport(
        source=str(signal.attrs.get("source", signal.name or "signal")),
        rate=rate_of(kept),
        duration=kept.sizes["time"] / rate_of(kept),
        units=units_of(kept),
        levels=table,
        spectrum=average,
        lines=strongest_lines(average, lines, None if varying else shaft_hz),
        impulsive=None if isinstance(impulsive, str) else impulsive,
        envelope=demodulated,
        envelope_lines=lines_of_envelope,
        orders=None if isinstance(orders, str) else orders,
        speed=speed,
        speed_range=found.range if isinstance(found, Shaft) else None,
        speed_origin=origin,
        missing=missing,
        notes=notes,
        conditions=dict(signal.attrs.get(CONDITIONS, {})),
    )


def _speed(signal: xr.DataArray, found: Shaft | float | None, notes: list[str]) -> tuple[float | None, str]:
    """Mean speed (rad/s) and where it is from."""
    if found is None:
        return None, "not known"
    if isinstance(found, Shaft):
        return found.speed, found.origin
    notes += remark_sweep(signal, found)
    told = refined_speed(signal, found)
    if told is None:
        notes.append("No line of the shaft stands out near the given speed; orders are taken at exactly that speed.")
        for ratio in MIXED:
            other = refined_speed(signal, ratio * found)
            if other is not None and len(other[1]) >= FAMILY and (words := other_rate(signal, other[0] / found)):
                notes.append(
                    f"CHECK THE SPEED: lines at orders {', '.join(map(str, other[1]))} of "
                    f"{other[0] * 30 / math.pi:.1f} rpm stand out, {other[0] / found:.3f} times the given speed.{words}"
                )
                break
        return found, "as given"
    refined, orders = told
    lines = f"the line at order {orders[0]}" if len(orders) == 1 else f"lines at orders {', '.join(map(str, orders))}"
    if abs(refined / found - 1.0) > SPEED_DIFFERS:
        said = "says" if len(orders) == 1 else "say"
        alone = " The diagnosis of bearings takes a speed from a family of orders only."
        notes.append(
            f"{lines[0].upper()}{lines[1:]} {said} {refined * 30.0 / math.pi:.1f} rpm, "
            f"{found * 30.0 / math.pi:.1f} rpm were given: orders are taken at the former."
            + alone
            * (len(orders) < FAMILY)
        )
    return refined, f"from {lines}, {100 * (refined / found - 1):+.3f} % off the given speed"


class _Velocity(NamedTuple):
    """RMS velocity of each channel, m/s, NaN where there is none, and why not in words."""

    values: np.ndarray
    missing: str


def _velocity(signal: xr.DataArray) -> _Velocity:
    """RMS velocity of those channels whose unit and rate allow."""
    rate, units = rate_of(signal), units_of(signal)
    names = [str(name) for name in signal["channel"].values]
    values = np.full(len(units), np.nan)
    low, high = VELOCITY_BAND
    if rate < 2.5 * high:
        return _Velocity(values, f"its band reaches to {high:g} Hz, the sampling rate is {rate:g} Hz")
    why: list[str] = []
    for i, (name, unit) in enumerate(zip(names, units, strict=True)):
        try:
            kind = unit_dimension(unit)[0]
        except SignalError:
            known = f"is {unit!r}, that of a level" if detected_unit(unit) is not None else "is not known"
            example = f"{{{name!r}: 'g'}} (--units '{name}=g')" if len(names) > 1 else "'m/s^2' or 'g'"
            why.append(f"the unit of {name!r} {known}; give units={example}")
            continue
        if kind not in ("acceleration", "velocity"):
            why.append(f"{name!r} is neither an acceleration nor a velocity")
            continue
        try:
            values[i] = np.std(convert(signal.isel(channel=[i]), "velocity", band=(low, high)).values)
        except SignalError as error:
            why.append(str(error))
    return _Velocity(values, "; ".join(dict.fromkeys(why)))


def _orders(signal: xr.DataArray, found: Shaft | float | None, speed: float | None) -> pd.DataFrame | str:
    """RMS at the first orders of the shaft by channel, or why there are none."""
    if found is None or speed is None:
        return NO_SPEED
    rate, shaft = rate_of(signal), speed / math.tau
    fitting = min(ORDERS, math.ceil(rate / 2 / shaft) - 1)
    if fitting < 1:
        return f"the shaft's {shaft:g} Hz are not below half the sampling rate ({rate / 2:g} Hz)"
    wanted = np.arange(1.0, fitting + 1.0)
    try:
        if isinstance(found, Shaft):
            tracked = order_track(signal, orders=wanted.tolist(), phase=found.phase, scaling="rms", revolutions=4.0)
            rms = np.sqrt((tracked.values**2).mean(axis=0))
        else:
            rms = np.abs(harmonic_amplitudes(signal.values, rate, shaft, wanted)) / math.sqrt(2.0)
    except SignalError as error:
        return str(error)
    rows = [
        (str(channel), float(order), float(order * shaft), float(rms[k, c]))
        for c, channel in enumerate(signal["channel"].values)
        for k, order in enumerate(wanted)
    ]
    return pd.DataFrame(rows, columns=["channel", "order", "frequency", "rms"])


def _envelope(signal: xr.DataArray, impulsive: xr.Dataset) -> xr.DataArray:
    """RMS spectrum of each channel's envelope in its most impulsive band, over segments of 2 s."""
    rate = rate_of(signal)
    cuts: list[xr.DataArray] = []
    bands: list[tuple[float, float]] = []
    changing = np.flatnonzero(np.isfinite(impulsive["best_kurtosis"].values))
    for i in map(int, changing):
        centre, width = _wide_band(impulsive, i, rate)
        low = max(centre - 0.5 * width, EDGE * width)
        high = min(centre + 0.5 * width, rate / 2 - EDGE * width)
        room = min(low, rate / 2 - high)
        # a short record has no room for a steep filter
        fall = min(max(0.1 * (high - low), LEAST_FALL * rate / signal.sizes["time"]), 1.9 * room)
        cut = envelope(signal.isel(channel=[i]), (low, high), transition=fall)
        cuts.append(cut)
        bands.append((low, high))
    # filters of different bands leave different lengths; one resolution for all
    length = min(round(LINE_SECONDS * rate), *(cut.sizes["time"] for cut in cuts))
    parts = [spectrum(cut, scaling="rms", segment=length) for cut in cuts]
    joined = xr.concat(parts, "channel", join="override", combine_attrs="override").transpose("frequency", "channel")
    joined = joined.assign_coords(
        low=("channel", [low for low, _ in bands], {"units": "Hz"}),
        high=("channel", [high for _, high in bands], {"units": "Hz"}),
    )
    return joined if changing.size == signal.sizes["channel"] else joined.reindex(channel=signal["channel"].values)


def _wide_band(impulsive: xr.Dataset, channel: int, rate: float) -> tuple[float, float]:
    """Centre and width in Hz of the band of highest kurtosis that is wide enough for an envelope of many lines."""
    wide = impulsive["bandwidth"].values >= 0.99 * rate / 2 / LEAST_BAND
    kurtosis = np.where(wide, impulsive["kurtosis"].values[:, channel], -np.inf)
    best = int(np.nanargmax(kurtosis))
    return float(impulsive["centre"].values[best]), float(impulsive["bandwidth"].values[best])
