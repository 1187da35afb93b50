"""From a record to a verdict on rolling bearings: prewhitened, squared envelope, evidence line by line."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from gearmbs.units import to_si

from .angular import angular_resample
from .bearing_evidence import HARMONICS, SLIP, Evidence, find_lines, power_of, squared_envelope_power
from .bearing_lines import CAGE, BearingLines, bearing_lines
from .bearing_report import BearingReport, PartFinding
from .door import to_signal
from .envelope import kurtogram
from .errors import MissingMetadataError, SignalError
from .phase import analytic
from .separation import level_lines, prewhiten
from .signal import like, rate_of, require, units_of

CLEAR, SIGNS, NONE = "clear", "signs", "none"
CLEAR_CHANCE, CLEAR_RATIO = -30.0, 30.0
SIGNS_CHANCE, SIGNS_RATIO = -6.0, 10.0
"""Decimal logarithm of the chance, and power of the fundamental by its neighbourhood, from which a part is named."""
EDGE = 0.95
"""Share of half the sampling rate above which no band is chosen: filters against aliasing end there."""
LEAST_LINES = 3.0
"""A band is at least so many times as wide as the highest fundamental."""
LEAST_TURNS = 20
NEIGHBOURHOOD = 4.0
"""Width over which lines are levelled, in shaft turns."""


@dataclass(frozen=True)
class _Channel:
    """Spectra of one channel's squared envelope, whole and in its band."""

    name: str
    band: tuple[float, float]
    spectra: tuple[tuple[np.ndarray, np.ndarray], ...]
    levelled: tuple[np.ndarray, np.ndarray]


def diagnose_bearing(
    signal: Any,
    bearing: Any,
    speed: float | str | None = None,
    *,
    band: tuple[float, float] | None = None,
    phase: xr.DataArray | None = None,
    slip: float = SLIP,
    harmonics: int = HARMONICS,
) -> BearingReport:
    """Look for the lines of one or several bearings in a record and say what they mean.

    The record is prewhitened, so that lines of gears and resonances do not stand out; its squared envelope is taken as
    a whole and in one band; the evidence for each part of each bearing is judged by the probability of its lines by
    chance (`gearmbs.signals.bearing_evidence`).

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of by itself.
    bearing : Bearing, str, mapping, BearingLines, or a sequence of these
        See `bearing_lines`; a mapping from names to (bearing, ratio) gives bearings on shafts of other speeds.
    speed : float or str, optional
        Of the inner ring's shaft, rad/s or text; default the signal's.
    band : (float, float), optional
        Hz; default: the band of the kurtogram that is wide enough for the lines and lies below the filter's edge.
    phase : xarray.DataArray, optional
        Angle of the shaft over time, rad, where the speed varies: envelopes are then followed in angle.
    slip : float
        Share by which lines may lie beside their kinematic place.
    harmonics : int
        How many harmonics count.

    Returns
    -------
    BearingReport

    Raises
    ------
    MissingMetadataError
        If no speed is known.
    SignalError
        If a bearing cannot be read, or the record is too short for its lines.
    """
    signal = to_signal(signal)
    known = _all_lines(bearing)
    if not 0.0 < slip < 0.2:
        raise SignalError(f"slip: must lie between 0 and 0.2, got {slip!r}")
    if not 1 <= harmonics <= 20:
        raise SignalError(f"harmonics: must lie between 1 and 20, got {harmonics!r}")
    shaft, notes = _shaft(signal, speed, phase)
    rate = rate_of(signal)
    turns = signal.sizes["time"] / rate * shaft
    if turns < LEAST_TURNS:
        raise SignalError(
            f"signal: holds {turns:.3g} turns of the shaft, lines of a bearing need {LEAST_TURNS}; give a longer record"
        )
    highest = max(order for lines in known for order in lines.orders.values()) * shaft
    if phase is None and 2.5 * highest > rate / 2:
        raise SignalError(
            f"signal: {highest:.4g} Hz, the highest line of the bearing, needs a sampling rate above "
            f"{5 * highest:.4g} Hz, it is {rate:g} Hz"
        )
    channels = [_channel(signal, c, band, phase, shaft, highest) for c in range(signal.sizes["channel"])]
    findings = [
        _finding(channel, lines, part, order, shaft, slip, harmonics)
        for channel in channels
        for lines in known
        for part, order in lines.orders.items()
    ]
    return BearingReport(
        source=str(signal.attrs.get("source", signal.name or "signal")),
        rate=rate,
        duration=signal.sizes["time"] / rate,
        shaft=shaft,
        bearings=known,
        findings=_judged(findings),
        bands={channel.name: channel.band for channel in channels},
        spectra=_spectra(channels, signal, highest * (harmonics + 1)),
        levels=_levels(signal),
        notes=notes,
    )


def _all_lines(bearing: Any) -> tuple[BearingLines, ...]:
    """Return the lines of all bearings given."""
    if isinstance(bearing, Mapping) and not {str(key).lower() for key in bearing} & {"ftf", "bpfo"}:
        found = []
        for name, given in bearing.items():
            item, ratio = given if isinstance(given, tuple) else (given, 1.0)
            lines = bearing_lines(item, float(ratio))
            found.append(BearingLines(str(name), lines.ftf, lines.bsf, lines.bpfo, lines.bpfi, lines.ratio))
        return tuple(found)
    if isinstance(bearing, Sequence) and not isinstance(bearing, str):
        return tuple(bearing_lines(item) for item in bearing)
    return (bearing_lines(bearing),)


def _shaft(signal: xr.DataArray, speed: Any, phase: xr.DataArray | None) -> tuple[float, list[str]]:
    """Return the mean speed in turns a second, and notes."""
    if phase is not None:
        time = phase["time"].values
        return float(phase.values[-1] - phase.values[0]) / (math.tau * float(time[-1] - time[0])), [
            "Envelopes are followed in angle; frequencies in Hz are those at the mean speed."
        ]
    try:
        given = None if speed is None else to_si(speed, "angular speed", "speed")
    except (TypeError, ValueError) as error:
        raise SignalError(str(error)) from None
    if given is None and signal.attrs.get("speed") is None:
        # a file may hold a number that looks like the speed
        told = [str(note) for note in signal.attrs.get("notes", ()) if "--speed" in str(note)]
        hint = " ".join(told).rstrip(".")
        remedy = hint[0].lower() + hint[1:] if hint else "pass speed='1500 rpm', say"
        raise MissingMetadataError("speed", "the diagnosis of a bearing", remedy)
    return float(require(signal, "speed", given, needed_for="the diagnosis of a bearing")) / math.tau, []


def _channel(
    signal: xr.DataArray, c: int, band: Any, phase: xr.DataArray | None, shaft: float, highest: float
) -> _Channel:
    one = signal.isel(channel=[c])
    rate = rate_of(one)
    chosen = choose_band(one, highest) if band is None else (float(band[0]), float(band[1]))
    if not 0.0 <= chosen[0] < chosen[1] <= rate / 2:
        raise SignalError(f"band: must lie inside 0 to {rate / 2:g} Hz, got {band}")

    def power(of: xr.DataArray, part: tuple[float, float] | None) -> tuple[np.ndarray, np.ndarray]:
        if phase is None:
            return squared_envelope_power(of.values[:, 0], rate, part)
        orders, found = _angular_power(of, part, phase)
        return orders * shaft, found

    white = prewhiten(one)
    bands = (chosen,) if band is not None else (None, chosen)
    levelled = power(level_lines(one, NEIGHBOURHOOD * shaft), bands[0])
    return _Channel(str(one["channel"].values[0]), chosen, tuple(power(white, part) for part in bands), levelled)


def _angular_power(
    signal: xr.DataArray, band: tuple[float, float] | None, phase: xr.DataArray
) -> tuple[np.ndarray, np.ndarray]:
    """Return orders and power of the squared envelope over the angle of the shaft."""
    values = signal.values[:, 0]
    if band is not None:
        line = np.fft.rfft(values)
        f = np.fft.rfftfreq(values.size, 1.0 / rate_of(signal))
        line[(f < band[0]) | (f > band[1])] = 0.0
        values = np.fft.irfft(line, values.size)
    square = like(signal, (np.abs(analytic(values)) ** 2)[:, None])
    angular = angular_resample(square, phase)
    return power_of(angular.values[:, 0], float(angular.attrs["samples_per_rev"]))


def choose_band(signal: xr.DataArray, highest: float) -> tuple[float, float]:
    """Return the band of highest kurtosis that is wide enough for a line and its sidebands, Hz.

    Parameters
    ----------
    signal : xarray.DataArray
        One channel counts, the first.
    highest : float
        Highest fundamental, Hz.
    """
    rate, n = rate_of(signal), min(signal.sizes["time"], 1 << 17)
    fits = int(math.log2(max(rate / 2 / (LEAST_LINES * highest), 2.0)))
    levels = max(1, min(fits, int(math.log2(max(n // 32, 2)))))
    found = kurtogram(signal, levels=levels)
    width, centre = found["bandwidth"].values, found["centre"].values
    value = np.where(np.isfinite(found["kurtosis"].values[:, 0]), found["kurtosis"].values[:, 0], -np.inf)
    good = (centre + 0.5 * width <= EDGE * rate / 2) | (found["bands"].values == 1)
    best = int(np.argmax(np.where(good & (width >= LEAST_LINES * highest), value, -np.inf)))
    top = min(centre[best] + 0.5 * width[best], EDGE * rate / 2)
    return float(centre[best] - 0.5 * width[best]), float(top)


def _finding(
    channel: _Channel, lines: BearingLines, part: str, order: float, shaft: float, slip: float, harmonics: int
) -> PartFinding:
    turns = shaft * lines.ratio
    found: list[Evidence] = [
        find_lines(f, power, order * turns, turns, slip=slip, harmonics=harmonics) for f, power in channel.spectra
    ]
    best = min(range(len(found)), key=lambda k: found[k].log_chance)
    evidence, (frequency, power) = found[best], channel.spectra[best]
    if not _stands_out(evidence, SIGNS_CHANCE, SIGNS_RATIO):
        # blows at perfectly even times make single lines, which prewhitening lowers to the noise; but so do gears:
        # only what is clear counts
        other = find_lines(*channel.levelled, order * turns, turns, slip=slip, harmonics=harmonics)
        if _stands_out(other, CLEAR_CHANCE, CLEAR_RATIO):
            evidence, (frequency, power), best = other, channel.levelled, 0
    # of several spectra the best was taken
    chance = min(evidence.log_chance + math.log10(len(found) + 1), 0.0)
    sides = _sidebands(frequency, power, evidence.found, lines.sidebands[part] * turns)
    whole = len(found) > 1 and best == 0
    return PartFinding(
        lines.name, part, channel.name, evidence.kinematic, evidence.found, evidence.ratios, chance, sides,
        "whole record" if whole else f"{channel.band[0]:.0f} to {channel.band[1]:.0f} Hz", evidence.score,
    )  # fmt: skip


def _stands_out(evidence: Evidence, chance: float, ratio: float) -> bool:
    return bool(evidence.ratios) and evidence.log_chance <= chance and evidence.ratios[0] >= ratio


def _sidebands(frequency: np.ndarray, power: np.ndarray, line: float, spacing: float) -> float:
    """Return the power of the first sidebands by that of the line; NaN where there are none to be expected."""
    if spacing <= 0.0:
        return math.nan
    step = float(frequency[1] - frequency[0])

    def near(f: float) -> float:
        k = round(f / step)
        return float(power[max(k - 2, 1) : k + 3].max(initial=0.0))

    return 0.5 * (near(line - spacing) + near(line + spacing)) / max(near(line), 1e-300)


def _judged(findings: list[PartFinding]) -> list[PartFinding]:
    """Grade each finding; where lines of parts coincide, the one that explains more of them is named."""
    graded = []
    for finding in findings:
        first = finding.ratios[0] if finding.ratios else 0.0
        grade = NONE
        if finding.log_chance <= SIGNS_CHANCE and first >= SIGNS_RATIO:
            # another shaft may turn as fast as a cage
            sure = finding.part != CAGE and finding.log_chance <= CLEAR_CHANCE and first >= CLEAR_RATIO
            grade = CLEAR if sure else SIGNS
        graded.append(finding.graded(grade))
    for k, finding in enumerate(graded):
        rivals = [
            f for f in graded if f.channel == finding.channel and f.bearing == finding.bearing and f.grade != NONE
        ]
        if finding.grade != NONE and any(f.score > finding.score for f in rivals):
            graded[k] = finding.graded(finding.grade, beside=True)
    return graded


def _spectra(channels: list[_Channel], signal: xr.DataArray, top: float) -> dict[str, pd.DataFrame]:
    """Return the envelope spectra that the verdict used, up to a frequency, as tables."""
    out = {}
    for channel in channels:
        frequency, power = channel.spectra[0]
        keep = frequency <= top
        mean = max(float(np.median(power[keep])) / math.log(2.0), 1e-300)
        out[channel.name] = pd.DataFrame({"frequency": frequency[keep], "power": power[keep] / mean})
    return out


def _levels(signal: xr.DataArray) -> pd.DataFrame:
    """Return RMS, crest factor and kurtosis by channel."""
    rows = []
    for c, unit in enumerate(units_of(signal)):
        values = signal.values[:, c] - signal.values[:, c].mean()
        rms = float(np.sqrt(np.mean(values**2)))
        shape = (
            (float(np.abs(values).max()) / rms, float(np.mean(values**4)) / rms**4) if rms > 0.0 else (np.nan, np.nan)
        )
        rows.append((str(signal["channel"].values[c]), unit, rms, *shape))
    return pd.DataFrame(rows, columns=["channel", "units", "rms", "crest", "kurtosis"])
