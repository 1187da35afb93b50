"""From a record at the ring of a planetary set to a verdict on its sun, planets and ring.

Followed over the angle of the carrier theta, in turns, whatever recurs with it lies on whole orders: the meshes, the
passing of the planets, errors of pins. A faulty tooth of the sun or a planet does not, for it meets its mates at
another place in each turn. So the signal is split in two,

    y = y_c + e,    y_c on whole orders of the carrier, e besides.

The energy of e is folded over the order a of each part: P(b), the sum of e^2 where frac(a theta) lies in the place b,
two places a tooth. For the sun a is z_r/z_s, once for each planet and shifted by its angle, so that its lines are at
N z_r/z_s; for a planet z_r/z_p. A faulty tooth makes a peak. How high peaks get by chance is learnt from the record
itself, by folding it over orders that no part has. A planet's tooth is heard when the planet passes the sensor, which
tells the planet.

A tooth of the ring meets all planets at one place, so it stays in y_c: as a pulse besides the smooth modulation of the
mesh harmonics, at the same place for each planet, against places that no planets have.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Unpack

import numpy as np
import pandas as pd
import scipy.fft
import xarray as xr

from gearmbs._display import Shown
from gearmbs.progress import waiting
from gearmbs.signals.analysis.report import markdown_table
from gearmbs.signals.diagnosis.planetary_averages import PLANET, RING, SUN, PlanetaryLines, path_weight, planetary_lines
from gearmbs.signals.errors import MissingMetadataError, SignalError
from gearmbs.signals.rotation.angular import angular_resample
from gearmbs.signals.rotation.phase import phase_from_speed
from gearmbs.signals.rotation.sweep import remark_sweep
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.given import given_speed
from gearmbs.signals.signal.signal import rate_of

# What was found of a planetary set in a record, as data, tables and words.


@dataclass(frozen=True, eq=False)
class PlanetaryFinding:
    """Evidence for a faulty tooth of one part in one channel.

    Attributes
    ----------
    part : {"sun", "planet", "ring"}
    channel : str
    kinematic, found : float
        Hz: how often a faulty tooth meets a mate, by the teeth, and where the record shows it best.
    share : float
        RMS of what was judged, by that of the record.
    peak : float
        Energy of the strongest place of the part's turn, by the mean.
    deviation : float
        How far that is above peaks by chance, in standard deviations of their logarithm.
    profile : ndarray
        Energy over a turn of the part, two places a tooth, 1 on the average.
    planet : int, optional
        Which planet, from 1, as far as the sensor's place tells it.
    grade : {"clear", "signs", "none"}
    """

    part: str
    channel: str
    kinematic: float
    found: float
    share: float
    peak: float
    deviation: float
    profile: np.ndarray
    planet: int | None = None
    grade: str = "none"

    def sentence(self) -> str:
        """Return what it means, with its grounds."""
        whose = f"planet {self.planet}" if self.part == PLANET and self.planet else f"the {self.part}"
        whose = "a planet" if whose == "the planet" else whose
        strength = "Clear lines" if self.grade == "clear" else "Signs"
        return (
            f"{strength} of a faulty tooth of {whose} in channel {self.channel}: {self.found:.3f} Hz, "
            f"{self.peak:.1f} times the mean energy at one place of its turn, {self.deviation:.1f} standard deviations "
            f"above what chance makes of this record; {20 * math.log10(max(self.share, 1e-15)):.0f} dB of the whole."
        )


@dataclass(eq=False)
class PlanetaryReport(Shown):
    """What was found of a planetary set in one record.

    Attributes
    ----------
    source : str
    rate, duration, carrier : float
        Sampling rate (Hz), length (s), turns of the carrier a second.
    turns : int
        Whole turns of the carrier that were used.
    lines : PlanetaryLines
    findings : list of PlanetaryFinding
        Sun, planets and ring in all channels.
    notes : list of str
    """

    source: str
    rate: float
    duration: float
    carrier: float
    turns: int
    lines: PlanetaryLines
    findings: list[PlanetaryFinding]
    notes: list[str] = field(default_factory=list)

    @property
    def accused(self) -> list[PlanetaryFinding]:
        """Findings that name a part, the strongest first."""
        named = [f for f in self.findings if f.grade != "none"]
        return sorted(named, key=lambda f: (f.grade != "clear", -f.deviation))

    @property
    def fault(self) -> str | None:
        """Part of the strongest finding: "sun", "planet 2", "planet", "ring"; None without."""
        if not self.accused:
            return None
        first = self.accused[0]
        return f"planet {first.planet}" if first.part == PLANET and first.planet else first.part

    @property
    def verdict(self) -> str:
        """What the record says of the set, in words with grounds."""
        if not self.accused:
            return "No lines of a faulty tooth of sun, planets or ring stand out. Wear of all teeth alike shows none."
        return " ".join(finding.sentence() for finding in self.accused)

    def tables(self) -> dict[str, pd.DataFrame]:
        """The numbers as tables: planetary_evidence, planetary_lines."""
        rows = [
            (f.channel, f.part, f.planet, f.kinematic, f.found, f.share, f.peak, f.deviation, f.grade)
            for f in self.findings
        ]
        columns = ["channel", "part", "planet", "kinematic", "found", "share", "peak", "deviation", "grade"]
        return {
            "planetary_evidence": pd.DataFrame(rows, columns=columns),
            "planetary_lines": self.lines.table(self.carrier),
        }

    def to_frame(self) -> pd.DataFrame:
        """Return one flat row: peak and deviation of each part in each channel, the verdict and the fault."""
        row: dict[str, object] = {"source": self.source, "carrier": self.carrier, "fault": self.fault}
        for f in self.findings:
            row[f"{f.channel}_{f.part}_peak"], row[f"{f.channel}_{f.part}_deviation"] = f.peak, f.deviation
        return pd.DataFrame([row])

    def to_markdown(self) -> str:
        """The report as Markdown text."""
        sun, own, ring = self.lines.teeth
        evidence = [
            [
                f.channel, f.part + (f" {f.planet}" if f.planet and f.grade != "none" else ""), f"{f.kinematic:.3f}",
                f"{f.found:.3f}", f"{20 * math.log10(max(f.share, 1e-15)):.0f}", f"{f.peak:.1f}", f"{f.deviation:.1f}",
                f.grade,
            ]
            for f in self.findings
        ]  # fmt: skip
        head = ["channel", "faulty tooth of", "kinematic Hz", "found Hz", "share dB", "peak", "deviations", "verdict"]
        table = self.lines.table(self.carrier)
        known = [[part, *(f"{f:.3f}" for f in group["frequency"])] for part, group in table.groupby("part", sort=False)]
        return "\n".join(
            [
                f"# Planetary set in {self.source}",
                "",
                f"- Record: {self.duration:.3f} s at {self.rate:g} Hz",
                f"- Teeth: sun {sun}, {self.lines.planets} planets of {own}, ring {ring}, at rest",
                f"- Carrier: {60 * self.carrier:.3f} rpm, {self.turns} turns",
                *(f"- {note}" for note in self.notes),
                "",
                f"**{self.verdict}**",
                "",
                "## Evidence",
                "",
                markdown_table(head, evidence),
                "",
                "## Kinematic lines, Hz",
                "",
                markdown_table(["line", "1 x", "2 x", "3 x"], known),
            ]
        )

    def _repr_markdown_(self) -> str:
        return self.to_markdown()

    def __repr__(self) -> str:
        return f"<PlanetaryReport of {self.source!r}: {self.verdict}>"


LEAST_TURNS = 8
"""Turns of the carrier without which the lines of sun and planets do not part from whole orders."""
PER_TOOTH = 32
"""Samples a tooth of the ring, at most."""
HALVES = 2
"""Places a tooth, in folding."""
REACH = 12
"""Carrier orders beside a mesh harmonic that smooth modulation fills."""
GUARD = 2.5
"""Half width of a line, in lines of the spectrum under a Hann window."""
HANN_POWER = 0.375
"""Mean square of a Hann window, 3/8."""
SLIP = 1e-3
"""Share by which the given speed may be off."""
FOREIGN = np.concatenate([np.linspace(0.8, 0.98, 200), np.linspace(1.02, 1.2, 200)])
"""Orders that no part has, by that of the part."""
FOREIGN_TEETH = 2.0
"""Teeth of the ring by which places that no planets have differ from the planets'."""
SIGNS, CLEAR = 4.0, 6.0
"""Standard deviations, of the logarithm of peaks by chance, from which a tooth is named."""
LEAST_SHARE = 1e-3
"""Least RMS of what is judged, by that of the whole record: 60 dB below it nothing is named."""


@takes_data()
@waiting("diagnosing the planetary set")
def diagnose_planetary(
    signal: Any,
    planetary: Any,
    speed: float | str | None = None,
    *,
    planets: int | Sequence[float] = 3,
    member: str = "carrier",
    phase: xr.DataArray | None = None,
    sensor_angle: float | None = None,
    **_data: Unpack[DataKeywords],
) -> PlanetaryReport:
    """Look for faulty teeth of a planetary set in a record and say what was found. The ring is at rest.

    Parameters
    ----------
    signal : xarray.DataArray
        Of a sensor at the ring, dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``,
        ``units``, ``channels`` and ``gaps`` as there.
    planetary : PlanetarySet, PlanetaryLines or (int, int, int)
        The set, or the teeth of sun, planet and ring.
    speed : float or str, optional
        rad/s or text; default the signal's.
    planets : int or sequence of float
        How many, or their angles on the carrier; of teeth only.
    member : {"carrier", "sun"}
        Whose speed it is.
    phase : xarray.DataArray, optional
        Angle of the carrier over time, rad, instead of a speed; default the signal's coordinate ``angle``.
    sensor_angle : float, optional
        Angle of the sensor, rad, in which planet 1 stands at the angle of the carrier; it tells which planet is meant.
        Default: 0 for a simulated record with its ``angle``; without, planets are not told apart.

    Returns
    -------
    PlanetaryReport

    Raises
    ------
    MissingMetadataError
        If no speed is known.
    SignalError
        If the record holds too few turns of the carrier, or is sampled too slowly for the mesh.
    """
    lines = planetary_lines(planetary, planets)
    if sensor_angle is None and phase is None and speed is None and "angle" in signal.coords:
        sensor_angle = 0.0
    timed = phase is not None or (speed is None and "angle" in signal.coords)
    phase = _phase(signal, lines, speed, member) if phase is None else phase
    span = float(phase.values[-1] - phase.values[0]) / math.tau
    carrier = abs(span) / float(phase["time"].values[-1] - phase["time"].values[0])
    if abs(span) < LEAST_TURNS:
        raise SignalError(
            f"signal: holds {abs(span):.3g} turns of the carrier, lines of a planetary set need {LEAST_TURNS}; "
            f"give a record of {LEAST_TURNS / carrier:.3g} s or more at this speed"
        )
    swept = [] if timed else remark_sweep(signal, math.tau * carrier)
    rate = rate_of(signal)
    if 2.5 * lines.mesh * carrier > rate:
        raise SignalError(
            f"signal: the mesh at {lines.mesh * carrier:.4g} Hz needs a sampling rate above "
            f"{2.5 * lines.mesh * carrier:.4g} Hz, it is {rate:g} Hz"
        )
    # an even number of samples a tooth, so that halves of a tooth are whole
    per_tooth = HALVES * int(np.clip(rate / carrier / lines.mesh / HALVES, 1, PER_TOOTH / HALVES))
    tracked = angular_resample(signal, phase if span > 0 else -phase, samples_per_rev=lines.mesh * per_tooth)
    turns = tracked.sizes["angle"] // (lines.mesh * per_tooth)
    first = float(tracked["angle"].values[0])
    findings = []
    for c, name in enumerate(tracked["channel"].values):
        values = tracked.values[: turns * lines.mesh * per_tooth, c]
        channel = _Channel(values - values.mean(), lines, turns, first)
        findings += [
            _tooth(channel, SUN, str(name), carrier),
            _tooth(channel, PLANET, str(name), carrier, sensor_angle),
            _ring_tooth(channel, str(name), carrier),
        ]
    return PlanetaryReport(
        source=str(signal.attrs.get("source", signal.name or "signal")),
        rate=rate,
        duration=signal.sizes["time"] / rate,
        carrier=carrier,
        turns=turns,
        lines=lines,
        findings=findings,
        notes=[*(str(note) for note in signal.attrs.get("notes", ())), *swept, *_hidden(lines)],
    )


def _hidden(lines: PlanetaryLines) -> list[str]:
    """Say which faults the teeth hide: of parts that stand the same after each turn of the carrier."""
    sun, own, ring = lines.teeth
    return [
        f"A faulty tooth of {part} recurs with each turn of the carrier, as {z} divides {ring}: it is not told from "
        "errors of pins."
        for part, z in (("the sun", sun), ("a planet", own))
        if ring % z == 0
    ]


def _phase(signal: xr.DataArray, lines: PlanetaryLines, speed: Any, member: str) -> xr.DataArray:
    """Return the carrier's angle from what is known of the speed."""
    if speed is None and "angle" in signal.coords:
        return signal["angle"].drop_vars("angle")
    given = given_speed(speed)
    given = given if given is not None else signal.attrs.get("speed")
    if given is None:
        raise MissingMetadataError("speed", "the diagnosis of a planetary set", "pass speed='120 rpm', the carrier's")
    return phase_from_speed(signal, lines.carrier(float(given), member))


class _Channel:
    """One channel over whole turns of the carrier: what recurs each turn, and the energy of what does not."""

    def __init__(self, values: np.ndarray, lines: PlanetaryLines, turns: int, first: float) -> None:
        self.lines = lines
        self.rms = max(float(np.sqrt(np.mean(values**2))), 1e-300)
        per_turn = values.size // turns
        # what recurs, without the mesh harmonics and their smooth modulation
        line = scipy.fft.rfft(values.reshape(turns, per_turn).mean(axis=0))
        order = np.arange(line.size)
        beside = np.abs(order - lines.mesh * np.rint(order / lines.mesh))
        regular = scipy.fft.irfft(np.where(beside > REACH, line, 0.0), per_turn)
        # the rest, under a window: lines that waver with the speed then go whole
        line = scipy.fft.rfft(values * np.hanning(values.size + 1)[:-1])
        order = np.arange(line.size) / turns
        line[np.abs(order - np.rint(order)) * turns < GUARD] = 0.0
        other = scipy.fft.irfft(line, values.size)
        self.regular_share = float(np.sqrt(np.mean(regular**2))) / self.rms
        self.other_share = float(np.sqrt(np.mean(other**2) / HANN_POWER)) / self.rms
        places = lines.mesh * HALVES
        self.regular = (regular**2).reshape(places, -1).sum(axis=1)
        self.energy = (other**2).reshape(turns * places, -1).sum(axis=1)
        self.turn = first + (np.arange(self.energy.size) + 0.5) / places

    def fold(self, order: float, places: int, shifts: Sequence[float]) -> np.ndarray:
        """Return the energy over one turn of a part, in so many places, 1 on the average."""
        profile = np.zeros(places)
        for shift in shifts:
            at = np.floor((order * self.turn - shift) % 1.0 * places).astype(int) % places
            profile += np.bincount(at, self.energy, places)
        return profile / max(profile.mean(), 1e-300)


def _tooth(
    channel: _Channel, part: str, name: str, carrier: float, sensor_angle: float | None = None
) -> PlanetaryFinding:
    """Judge the sun's teeth, or the planets'."""
    lines = channel.lines
    teeth = lines.teeth[0 if part == SUN else 1]
    order, places = lines.mesh / teeth, HALVES * teeth
    shifts = [a / math.tau for a in lines.angles] if part == SUN else [0.0]
    chance = [channel.fold(order * f, places, shifts).max() for f in FOREIGN]
    near = order * (1.0 + SLIP * np.linspace(-1.0, 1.0, 9))
    profiles = [channel.fold(a, places, shifts) for a in near]
    best = int(np.argmax([p.max() for p in profiles]))
    profile = profiles[best]
    per_turn = lines.orders[part]
    planet = _which_planet(channel, near[best], profile, sensor_angle) if sensor_angle is not None else None
    return PlanetaryFinding(
        part=part,
        channel=name,
        kinematic=per_turn * carrier,
        found=per_turn * carrier * float(near[best] / order),
        share=channel.other_share,
        peak=float(profile.max()),
        deviation=_deviation(profile.max(), chance),
        profile=profile,
        planet=planet,
        grade=_grade(profile.max(), chance, channel.other_share),
    )


def _ring_tooth(channel: _Channel, name: str, carrier: float) -> PlanetaryFinding:
    """Judge the ring's teeth: pulses at one place whichever planet passes."""
    lines, energy = channel.lines, channel.regular / max(channel.regular.mean(), 1e-300)

    def common(shifts: np.ndarray) -> np.ndarray:
        return np.min([np.roll(energy, round(s * energy.size)) for s in shifts], axis=0)

    own = np.array(lines.angles) / math.tau
    chance = [common(shifts).max() for shifts in _foreign_places(own, lines.mesh)]
    profile = common(own)
    rate = lines.orders[RING] * carrier
    return PlanetaryFinding(
        part=RING,
        channel=name,
        kinematic=rate,
        found=rate,
        share=channel.regular_share,
        peak=float(profile.max()),
        deviation=_deviation(profile.max(), chance),
        profile=profile,
        grade=_grade(profile.max(), chance, channel.regular_share),
    )


def _foreign_places(own: np.ndarray, teeth: int) -> list[np.ndarray]:
    """Draw places, in turns, no two of which lie as far apart as two of the planets do, nor at one place."""
    if own.size == 1:
        return [own]
    rng, clear = np.random.default_rng(0), FOREIGN_TEETH / teeth
    apart = np.unique(np.round((own[:, None] - own) % 1.0, 9))
    pairs = np.triu_indices(own.size, 1)
    drawn: list[np.ndarray] = []
    tries = 0
    while len(drawn) < FOREIGN.size and tries < 100 * FOREIGN.size:
        tries += 1
        places = rng.uniform(size=own.size)
        between = (places[pairs[0]] - places[pairs[1]])[:, None] - apart
        if np.abs(between - np.rint(between)).min() > clear:
            drawn.append(places)
    return drawn


def _which_planet(channel: _Channel, order: float, profile: np.ndarray, sensor_angle: float) -> int:
    """Return the planet, from 1, whose passing goes with the peak's energy."""
    lines, places = channel.lines, profile.size
    at = np.floor(order * channel.turn % 1.0 * places).astype(int) % places
    off = (at - int(profile.argmax()) + places // 2) % places - places // 2
    near = np.abs(off) <= 1
    heard = [path_weight(math.tau * channel.turn[near] + a - sensor_angle) ** 2 for a in lines.angles]
    return 1 + int(np.argmax([(channel.energy[near] * w).sum() / w.sum() for w in heard]))


def _deviation(peak: float, chance: Sequence[float]) -> float:
    logs = np.log(np.maximum(chance, 1e-300))
    return float((math.log(max(peak, 1e-300)) - logs.mean()) / max(logs.std(), 1e-300))


def _grade(peak: float, chance: Sequence[float], share: float) -> str:
    deviation = _deviation(peak, chance)
    if share < LEAST_SHARE or peak <= max(chance) or deviation < SIGNS:
        return "none"
    return "clear" if deviation >= CLEAR else "signs"
