"""From a record to a verdict on rolling bearings: prewhitened, squared envelope, evidence line by line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Unpack

import numpy as np
import pandas as pd
import scipy.fft
import xarray as xr

from gearmbs.progress import staged
from gearmbs.signals.conversion import DERIVATIVE, convert
from gearmbs.signals.diagnosis.bearing_judgement import (
    CLEAR,
    HARMONICS,
    NONE,
    QUIET,
    SHIFTED,
    SIGNS,
    SIGNS_CHANCE,
    SLIP,
    SMOOTH,
    SPEED_SHARE,
    EnvelopeSpectrum,
    Judged,
    find_lines,
    is_smooth,
    judge,
    needed_length,
    power_of,
    squared_envelope,
)
from gearmbs.signals.diagnosis.bearing_margins import (
    LEAST_LEVEL,
    OF_OWN,
    STIFFNESS,
    Answer,
    Weighed,
    carriers_from,
    modulated_level,
    own_level,
    weigh,
)
from gearmbs.signals.diagnosis.bearing_report import (
    CAGE,
    OUTER,
    BearingLines,
    BearingReport,
    PartFinding,
    bearing_lines,
)
from gearmbs.signals.diagnosis.bearing_speed import TOLERANCE
from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.optical import instrument_faults
from gearmbs.signals.rotation.angular import angular_resample
from gearmbs.signals.rotation.phase import phase_from_speed
from gearmbs.signals.rotation.separation import level_lines, prewhiten
from gearmbs.signals.rotation.shaft import shaft_phase
from gearmbs.signals.rotation.sweep import swept
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import like, rate_of, require, shaft_coords, units_of
from gearmbs.signals.signal.units import Given, unit_dimension
from gearmbs.signals.spectra import kurtogram
from gearmbs.units import to_si

# Spectra of a record's squared envelope in which lines of a bearing are looked for.
#
# Three, for no one suits all defects: the prewhitened record as a whole, in which lines of gears are levelled, and in
# one band, usually that of the highest kurtosis; and the mean over many narrow bands of the record flattened over
# neighbourhoods of its spectrum. The last is the integral of the squared spectral coherence over the carrier, after
# Antoni's enhanced envelope spectrum: weak lines that stand in many bands add up, and blows at perfectly even times,
# which prewhitening lowers to the noise, are kept.
#
# References
# ----------
# .. [1] J. Antoni, G. Xin, N. Hamzaoui, Fast computation of the spectral correlation, Mechanical Systems and Signal
#    Processing 92 (2017) 248-277.


EDGE = 0.95
"""Share of half the sampling rate above which no band is chosen: filters against aliasing end there."""
LEAST_LINES = 3.0
"""A band is at least so many times as wide as the highest fundamental."""
MOST_BANDS = 64
NEIGHBOURHOOD = 4.0
"""Width over which a spectrum is flattened, in shaft turns."""


def envelope_spectra(
    signal: xr.DataArray,
    turns: float,
    highest: float,
    *,
    band: tuple[float, float] | None = None,
    phase: xr.DataArray | None = None,
) -> tuple[tuple[float, float], list[EnvelopeSpectrum]]:
    """Return the band of one channel, and the spectra of its squared envelope.

    Parameters
    ----------
    signal : xarray.DataArray
        One channel.
    turns, highest : float
        Turns of the shaft and highest fundamental looked for, Hz.
    band : (float, float), optional
        Hz; default that of the kurtogram. A band that is given is the only part that is looked at.
    phase : xarray.DataArray, optional
        Angle of the shaft, rad: envelopes are followed in angle, and frequencies are those at the mean speed.
    """
    rate = rate_of(signal)
    chosen = choose_band(signal, highest) if band is None else (float(band[0]), float(band[1]))
    if not 0.0 <= chosen[0] < chosen[1] <= rate / 2:
        raise SignalError(f"band: must lie inside 0 to {rate / 2:g} Hz, got {band}")
    white = prewhiten(signal).values[:, 0]
    words = f"{chosen[0]:.0f} to {chosen[1]:.0f} Hz"

    def spectrum(square: np.ndarray, sampled: float, where: str) -> EnvelopeSpectrum:
        if phase is not None:
            square, sampled = _in_angle(signal, square, sampled, phase, turns)
        power = power_of(square)
        return EnvelopeSpectrum.of(power, sampled / square.size, turns, where)

    found = [] if band is not None else [spectrum(squared_envelope(white, rate, None), rate, "whole record")]
    found.append(spectrum(squared_envelope(white, rate, chosen), rate, words))
    flat = level_lines(signal, NEIGHBOURHOOD * turns).values[:, 0]
    limits = chosen if band is not None else (0.0, EDGE * rate / 2)
    pieces = [spectrum(square, sampled, "") for square, sampled in _narrow_bands(flat, rate, limits, highest)]
    size = min(piece.ratio.size for piece in pieces)
    mean = np.mean([piece.ratio[:size] for piece in pieces], axis=0)
    where = f"mean of {len(pieces)} bands" + ("" if band is None else f" in {words}")
    found.append(EnvelopeSpectrum.of(mean, pieces[0].step, turns, where))
    return chosen, found


def _narrow_bands(
    values: np.ndarray, rate: float, limits: tuple[float, float], highest: float
) -> Iterator[tuple[np.ndarray, float]]:
    """Yield the squared envelope in each of equal bands that do not overlap, and its sampling rate."""
    line = scipy.fft.rfft(values - values.mean())
    step = rate / values.size
    first, last = max(int(limits[0] / step), 1), min(int(limits[1] / step), line.size)
    width = max(int(LEAST_LINES * highest / step), (last - first) // MOST_BANDS)
    count = max((last - first) // width, 1)
    width = (last - first) // count
    for k in range(count):
        piece = line[first + k * width : first + (k + 1) * width]
        # the square of an envelope has twice the band's width
        yield np.abs(scipy.fft.ifft(piece, 2 * width)) ** 2, 2 * width * step


def _in_angle(
    signal: xr.DataArray, square: np.ndarray, sampled: float, phase: xr.DataArray, turns: float
) -> tuple[np.ndarray, float]:
    """Return a squared envelope over the angle of the shaft, and samples a second at the mean speed."""
    rate = rate_of(signal)
    if square.size != signal.sizes["time"]:
        at = np.arange(signal.sizes["time"]) * (sampled / rate)
        square = np.interp(at, np.arange(square.size), square)
    angular = angular_resample(like(signal, square[:, None]), phase)
    return angular.values[:, 0], float(angular.attrs["samples_per_rev"]) * turns


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


LEAST_TURNS = 20


@takes_data(band="frequency")
@staged("diagnosing bearings")
def diagnose_bearing(
    signal: Any,
    bearing: Any,
    speed: Any = None,
    *,
    band: tuple[Given, Given] | None = None,
    phase: xr.DataArray | None = None,
    shafts: Sequence[float] | None = None,
    slip: float = SLIP,
    harmonics: int = HARMONICS,
    tolerance: float = TOLERANCE,
    level: float = LEAST_LEVEL,
    progress: Callable[[float, str], None] | None = None,
    **_data: Unpack[DataKeywords],
) -> BearingReport:
    """Look for the lines of one or several bearings in a record and say what they mean.

    The shaft's own line is looked for near the told speed first (`gearmbs.signals.diagnosis.bearing_speed`). Lines of
    bearings are looked for in three spectra of the squared envelope (`gearmbs.signals.diagnosis.bearings`). A part is
    named if its lines are no noise, not those of known shafts, stronger than families of lines at hardly any other
    place of the record (`gearmbs.signals.diagnosis.bearing_judgement`), at whatever speed the tolerance allows, and
    louder than a sound bearing (`gearmbs.signals.diagnosis.bearing_margins`).

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``, ``units``,
        ``channels`` and ``gaps`` as there.
    bearing : Bearing, str, mapping, BearingLines, or a sequence of these
        See `bearing_lines`; a mapping from names to (bearing, ratio) gives bearings on shafts of other speeds. Those
        that are alike and turn alike have the same lines and are reported as one, "a or b".
    speed : float, str or curve, optional
        Of the inner ring's shaft, rad/s or text; default the signal's, constant or over time. Of a curve, as for
        `speed_curve`, the angle is taken, see ``phase``; if no family of the shaft's orders confirms it and no part is
        named, lines that would be clear if it were off by up to 6 % are told as not certain.
    band : pair of float or str, optional
        Hz or texts; default: the band of the kurtogram that is wide enough for the lines and lies below the filter's
        edge.
    phase : xarray.DataArray, optional
        Angle of the shaft over time, rad, where the speed varies: envelopes are then followed in angle, and the speed
        is taken for exact.
    shafts : sequence of float, optional
        Speeds of the machine's other shafts by that of the reference shaft; empty if there is none. Their lines and the
        sums of these are left out. Default: those of ``bearing`` and the ratio of the signal's ``teeth``; without any,
        other shafts are not known, and a line at the cage's turns accuses nothing, for another shaft may turn as fast.
    slip : float
        Share by which lines may lie beside their kinematic place.
    harmonics : int
        How many harmonics count.
    tolerance : float
        Share by which the told speed may be off; 0 if it is exact. The shaft's line is looked for within twice as much.
    level : float
        m/s^2 RMS that a part's lines must modulate far above their own rate; 0 to accuse quieter ones, too. Velocities
        and displacements are differentiated for it; of other quantities it is not asked, which is noted.
    progress : callable, optional
        Called as progress(fraction, channel); without it a bar is shown where somebody watches.

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
    known = _distinct(_all_lines(bearing))
    _check_search(slip, harmonics, tolerance, level)
    curve = False
    if phase is None and speed is not None and not isinstance(speed, (int, float, str)):
        phase, curve = phase_from_speed(signal, speed), True
    elif phase is None and speed is None and shaft_coords(signal):
        phase, curve = shaft_phase(signal), "angle" not in shaft_coords(signal)
    told, notes = _shaft(signal, speed, phase)
    notes += instrument_faults(signal)
    rate = rate_of(signal)
    highest = max(order for lines in known for order in lines.orders.values()) * told
    _check_record(signal.sizes["time"], rate, told, None if phase is not None else highest)
    others = _other_shafts(signal, known, shafts)
    wanted = None if band is None else (float(band[0]), float(band[1]))
    bands, heard = _heard(signal, told, highest, wanted, phase, progress)

    def judge_at(turns: float) -> Iterator[list[Judged]]:
        for spectra in heard.values():
            yield judge(spectra, known, turns, others, slip=slip, harmonics=harmonics, looks=len(heard))

    own = [] if phase is not None else [channel_spectrum(values, rate, told) for values in signal.values.T]
    spectra = [*own, *(each[-1] for each in heard.values())]
    timed = phase is not None
    weighed = weigh(spectra, told, 0.0 if timed else tolerance, others or (), judge_at, timed, curve)
    findings, clearest = _found(signal, weighed, heard, known, others, slip, level, highest)
    moved = [] if timed else swept(signal, math.tau * told)
    return BearingReport(
        source=str(signal.attrs.get("source", signal.name or "signal")),
        rate=rate,
        duration=signal.sizes["time"] / rate,
        shaft=weighed.speed.turns,
        bearings=known,
        findings=findings,
        bands=bands,
        spectra={name: _table(each, highest * (harmonics + 1)) for name, each in clearest.items()},
        levels=_levels(signal),
        shafts=others,
        notes=[*notes, *(words for words, doubted in moved if not doubted), *_without_level(signal, findings)],
        stability=_stability(weighed.answers),
        speed_remark=weighed.remark,
        swept=[words for words, doubted in moved if doubted],
    )


def _heard(
    signal: xr.DataArray,
    told: float,
    highest: float,
    band: tuple[float, float] | None,
    phase: xr.DataArray | None,
    progress: Callable[[float, str], None] | None,
) -> tuple[dict[str, tuple[float, float]], dict[str, list[EnvelopeSpectrum]]]:
    """Return the band of each channel, and the spectra of its envelope."""
    bands, heard = {}, {}
    names = [str(name) for name in signal["channel"].values]
    for c, name in enumerate(names):
        if progress is not None:
            progress((c + 0.5) / len(names), name)
        bands[name], heard[name] = envelope_spectra(signal.isel(channel=[c]), told, highest, band=band, phase=phase)
    return bands, heard


def _found(
    signal: xr.DataArray,
    weighed: Weighed,
    heard: Mapping[str, Sequence[EnvelopeSpectrum]],
    known: Sequence[BearingLines],
    others: Sequence[float] | None,
    slip: float,
    level: float,
    highest: float,
) -> tuple[list[PartFinding], dict[str, EnvelopeSpectrum]]:
    """Return what is to be told of each part in each channel, and the channels' clearest spectra."""
    shaft = weighed.speed.turns
    turning = [shaft * ratio for ratio in sorted({1.0, *(lines.ratio for lines in known), *(others or ())})]
    findings, clearest = [], {}
    for c, ((name, spectra), judged) in enumerate(zip(heard.items(), weighed.verdicts, strict=True)):
        one = signal.isel(channel=[c])
        findings += [_finding(one, each, spectra, shaft, turning, slip, level, highest) for each in judged]
        clearest[name] = _clearest_spectrum(spectra, judged)
    return findings, clearest


def _without_level(signal: xr.DataArray, findings: Sequence[PartFinding]) -> list[str]:
    """Return what is said of parts that are named in channels of which no level is known."""
    units = dict(zip(map(str, signal["channel"].values), units_of(signal), strict=True))
    named = {f.channel for f in findings if f.grade in (CLEAR, SIGNS) and math.isnan(f.modulated)}
    return [
        f"CHECK THE LEVEL: {name!r} is in {units[name]}, of which nothing tells blows from the stiffness that varies "
        "in a sound bearing, whose lines are as clear where no noise hides them; an acceleration, velocity or "
        "displacement of the housing does."
        for name in units
        if name in named
    ]


def channel_spectrum(values: np.ndarray, rate: float, turns: float) -> EnvelopeSpectrum:
    """Return the spectrum of a channel itself by its neighbourhood."""
    return EnvelopeSpectrum.of(power_of(values), rate / values.size, turns)


def _stability(answers: Sequence[Answer]) -> pd.DataFrame:
    """Return what would be named of each told speed."""
    leaders = [(answer.speed, answer.leading) for answer in answers]
    rows = [
        (s.told, s.turns, s.found, *((one.lines.name, one.part, one.grade) if one else (None, None, NONE)))
        for s, one in leaders
    ]
    return pd.DataFrame(rows, columns=["told", "used", "found", "bearing", "part", "grade"])


def _check_search(slip: float, harmonics: int, tolerance: float, level: float) -> None:
    """Refuse settings of the search that make no sense."""
    if not 0.0 <= tolerance <= 0.05:
        raise SignalError(f"tolerance: must lie between 0 and 0.05, a share of the told speed, got {tolerance!r}")
    if not 0.0 <= level < math.inf:
        raise SignalError(f"level: must be 0 or more, in m/s^2, got {level!r}")
    if not 0.0 < slip < 0.2:
        raise SignalError(f"slip: must lie between 0 and 0.2, got {slip!r}")
    if not 1 <= harmonics <= 20:
        raise SignalError(f"harmonics: must lie between 1 and 20, got {harmonics!r}")


def _check_record(samples: int, rate: float, shaft: float, highest: float | None) -> None:
    """Refuse a record that is too short for lines of a bearing, or sampled too slowly for the highest of them, Hz."""
    turns = samples / rate * shaft
    if turns < LEAST_TURNS:
        raise SignalError(
            f"signal: holds {turns:.3g} turns of the shaft, lines of a bearing need {LEAST_TURNS}; "
            f"give a record of {LEAST_TURNS / shaft:.3g} s or more at this speed"
        )
    if highest is not None and 2.5 * highest > rate / 2:
        raise SignalError(
            f"signal: {highest:.4g} Hz, the highest line of the bearing, needs a sampling rate above "
            f"{5 * highest:.4g} Hz, it is {rate:g} Hz"
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


def _distinct(bearings: Sequence[BearingLines]) -> tuple[BearingLines, ...]:
    """Return bearings with those of the same lines, as two alike on a shaft, as one: no record tells which it is."""
    names: dict[tuple[float, ...], list[str]] = {}
    for lines in bearings:
        names.setdefault((lines.ftf, lines.bsf, lines.bpfo, lines.bpfi, lines.ratio), []).append(lines.name)
    return tuple(BearingLines(" or ".join(dict.fromkeys(alike)), *lines) for lines, alike in names.items())


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


def _other_shafts(
    signal: xr.DataArray, bearings: Sequence[BearingLines], shafts: Sequence[float] | None
) -> tuple[float, ...] | None:
    """Return the ratios of shafts beside the reference shaft, None if they are not known."""
    if shafts is not None:
        found = tuple(float(ratio) for ratio in shafts)
        if not all(math.isfinite(ratio) and ratio > 0.0 for ratio in found):
            raise SignalError(f"shafts: give positive ratios to the speed of the reference shaft, got {shafts!r}")
        return found
    teeth = signal.attrs.get("teeth")
    if isinstance(teeth, Sequence) and len(teeth) == 2:
        return (float(teeth[0]) / float(teeth[1]),)
    return tuple(sorted({lines.ratio for lines in bearings} - {1.0})) or None


def _finding(
    signal: xr.DataArray,
    judged: Judged,
    spectra: Sequence[EnvelopeSpectrum],
    shaft: float,
    turns: Sequence[float],
    slip: float,
    level: float,
    highest: float,
) -> PartFinding:
    """Return what is to be told of a part in one channel."""
    lines, part, evidence, grade = judged.lines, judged.part, judged.evidence, judged.grade
    spectrum = next(s for s in spectra if s.where == evidence.where)
    sides = _sidebands(spectrum, evidence.found, lines.sidebands[part] * shaft * lines.ratio)
    loud = grade in (CLEAR, SIGNS, SHIFTED)
    # of a rate that is told too high, lines and bands are as much wider apart
    widest = highest * max(1.0, evidence.found / evidence.kinematic)
    modulated, own = _modulated(signal, evidence.found, widest, turns) if loud else (math.nan, math.nan)
    smooth = part == OUTER and modulated < STIFFNESS * level / LEAST_LEVEL and modulated < OF_OWN * own
    if modulated < level or smooth:
        grade = QUIET
    elif grade in (CLEAR, SIGNS) and part != CAGE and is_smooth(evidence):
        grade = SMOOTH
    step = None if grade != NONE else _multiple_of_turns(judged, spectra, shaft, slip)
    return PartFinding(
        lines.name, part, str(signal["channel"].values[0]), evidence.kinematic, evidence.found, evidence.ratios,
        evidence.log_chance, sides, evidence.where, grade, judged.beside, judged.stronger, judged.places,
        judged.fraction, needed_length(evidence, spectrum, turns), modulated, step,
    )  # fmt: skip


def _modulated(signal: xr.DataArray, line: float, highest: float, turns: Sequence[float]) -> tuple[float, float]:
    """Return the level that a line modulates and that of the line and the next ones, m/s^2; NaN for what is no motion.

    Of the line and the next ones those near whole turns of a shaft, in Hz, are left out.

    Velocities and displacements are differentiated, and so is their noise: of these only lines count that stand in it.
    """
    try:
        dimension, factor = unit_dimension(units_of(signal)[0])
    except SignalError:
        return math.nan, math.nan
    if dimension not in DERIVATIVE:
        return math.nan, math.nan
    rate = rate_of(signal)
    top = EDGE * rate / 2
    if motion := dimension != "acceleration":
        slow = convert(signal, "acceleration", band=(0.5 * line, top), edges="keep")
        own = own_level(slow.values[:, 0], rate, line, turns)
        low = 0.5 * carriers_from(line, top)
        signal, factor = convert(signal, "acceleration", band=(low, top), edges="keep"), 1.0
    else:
        own = factor * own_level(signal.values[:, 0], rate, line, turns)
    bands = lambda values, limits: _narrow_bands(values, rate, limits, highest)  # noqa: E731
    return factor * modulated_level(signal.values[:, 0], rate, line, bands, top, standing=motion), own


def _multiple_of_turns(judged: Judged, spectra: Sequence[EnvelopeSpectrum], shaft: float, slip: float) -> int | None:
    """Return m if lines at m turns of the bearing's shaft, near those of a part, stand in the record as a family."""
    turns, place = shaft * judged.lines.ratio, judged.evidence.kinematic
    m = round(place / turns)
    if judged.part == CAGE or abs(m * turns / place - 1.0) > slip:
        return None
    families = [find_lines(spectrum, m * turns, slip=SPEED_SHARE) for spectrum in spectra]
    return m if min(family.log_chance for family in families) <= SIGNS_CHANCE else None


def _sidebands(spectrum: EnvelopeSpectrum, line: float, spacing: float) -> float:
    """Return the power of the first sidebands by that of the line; NaN where there are none to be expected."""
    if spacing <= 0.0:
        return math.nan

    def near(f: float) -> float:
        k = round(f / spectrum.step)
        return float(spectrum.ratio[max(k - 2, 1) : k + 3].max(initial=0.0))

    return 0.5 * (near(line - spacing) + near(line + spacing)) / max(near(line), 1e-300)


def _clearest_spectrum(spectra: Sequence[EnvelopeSpectrum], judged: Sequence[Judged]) -> EnvelopeSpectrum:
    """Return the spectrum with the clearest of the lines that were named, without any the first."""
    named = [one.evidence for one in judged if one.grade in (CLEAR, SIGNS)]
    if not named:
        return spectra[0]
    where = min(named, key=lambda evidence: evidence.log_chance).where
    return next(spectrum for spectrum in spectra if spectrum.where == where)


def _table(spectrum: EnvelopeSpectrum, top: float) -> pd.DataFrame:
    """Return an envelope spectrum up to a frequency as a table."""
    keep = spectrum.frequency <= top
    return pd.DataFrame({"frequency": spectrum.frequency[keep], "power": spectrum.ratio[keep]})


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
