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
from typing import Any

import numpy as np
import scipy.fft
import xarray as xr

from gearmbs.progress import waiting

from .angular import angular_resample
from .any_data import takes_data
from .errors import MissingMetadataError, SignalError
from .given import given_speed
from .phase import phase_from_speed
from .planetary import path_weight
from .planetary_lines import PLANET, RING, SUN, PlanetaryLines, planetary_lines
from .planetary_report import PlanetaryFinding, PlanetaryReport
from .signal import rate_of

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
    phase = _phase(signal, lines, speed, member) if phase is None else phase
    span = float(phase.values[-1] - phase.values[0]) / math.tau
    carrier = abs(span) / float(phase["time"].values[-1] - phase["time"].values[0])
    if abs(span) < LEAST_TURNS:
        raise SignalError(
            f"signal: holds {abs(span):.3g} turns of the carrier, lines of a planetary set need {LEAST_TURNS}; "
            f"give a record of {LEAST_TURNS / carrier:.3g} s or more at this speed"
        )
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
        notes=[*(str(note) for note in signal.attrs.get("notes", ())), *_hidden(lines)],
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
