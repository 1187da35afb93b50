"""Speed of the shaft from the gear mesh frequency line, where no tacho is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Unpack

import numpy as np
import xarray as xr

from gearmbs.signals.errors import SignalError
from gearmbs.signals.rotation.mesh_lines import LEAST_SPREAD_DB, Explained, Lines, choose
from gearmbs.signals.rotation.phase import phase_from_line
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.signal import rate_of, require
from gearmbs.signals.signal.units import Given
from gearmbs.signals.spectra import periodograms
from gearmbs.wording import warn

SEGMENT_SECONDS = 2.0
"""Length of the segments of the spectrum: a resolution of half a hertz, over which speeds hold still."""
FLOOR_BINS = 64
CLIP_DB = 30.0
"""Height from which a line counts no more: a single strong line must not outweigh a comb."""
RANGE_DB = 120.0
"""Below the largest line, where spectra are cut off: logarithms of silence."""
HARMONICS = 4
SIDEBANDS = 3
SIDEBAND_WEIGHT = 0.5
"""Weight of sidebands in the score of a comb, beside its harmonics: they tell the right shaft, but are weaker."""
BETWEEN_WEIGHT = 0.5
"""Weight of what stands midway between harmonics, taken off the score: half the frequency would have lines there."""
FEWER_WEIGHT = 0.05
"""Part of its score that a comb loses for each harmonic beyond the end of the spectrum, which has not been seen."""
NEARLY_BEST = 0.97
"""Part of the best score from which combs are told apart by the power they carry."""
SLOWEST = 8.0 * math.pi
"""rad/s, 4 turns a second, where no range is given: sidebands are then eight bins of the segments' spectra apart, twice
the main lobe of their window."""
MIN_QUALITY = 0.05
"""Least quality of a line by which a changing speed is followed; see `phase_from_line`."""
MIN_SCORE_DB = 12.0
"""Mean height of harmonics from which a comb is believed at once."""
SAME_COMB = 0.01
"""Relative difference of frequencies up to which candidates belong to one comb."""
ALONE_BELOW = 0.35
"""Part of the sampling rate below which the mesh line may be the only harmonic there: its band fits below half."""
MIN_OTHERS = 100
"""Combs of other frequencies, at least, of which the best tells what chance gives: among a hundred it is at 2.5
standard deviations, and of fewer their own standard deviation is known badly."""


HOLLOW_POWER, HOLLOW_HEIGHT = 1.0 / 64.0, 0.5
"""Power and height in dB, as parts of the other comb's, below which a comb has no lines of its own."""


AGREED_BINS = 1.5
"""By which the peak at a harmonic may be off the frequency on which all agree; what is further off is another line."""
UNCHANGED = 1e-9
"""Part of its largest value by which a channel must change to be looked at: rounding of constants is far below."""
MAINS, MAINS_SHARE = (50.0, 60.0), 1e-3
"""Hz, and the share by which a large grid's frequency varies in daily work."""
MAINS_LINES = 8
"""Multiples of the supply's frequency that are looked at: hum has its strongest lines among these."""
MOST_NAMED = 3
"""Other mesh lines that are named in a doubt."""


ELSEWHERE = np.r_[np.linspace(0.55, 0.94, 30), np.linspace(1.06, 1.9, 60)]
"""Multiples of a speed at which nothing is expected; combs looked for there in the same way show what chance gives."""
SHARED = (2.0 / 3.0, 3.0 / 4.0, 4.0 / 3.0, 3.0 / 2.0)
"""Multiples whose combs have lines in common with that of the speed itself, and would be no chance."""
AHEAD = 4.5
"""Robust standard deviations over the median of those combs; the best of ninety in noise reaches three."""
FEWEST_ELSEWHERE = 20
FEWEST_BESIDE_ZERO = 4
"""Lowest bins, ignored because window leakage and the mean dominate them."""


# Falling, so that one lone line is its own fundamental and not the second or third harmonic of something lower.
HARMONIC_WEIGHTS = (1.0, 0.9, 0.8, 0.7)
# Weak lines count too, if their comb stands out from all others by that many robust standard deviations.
MIN_LEAD = 5.5


@dataclass(frozen=True)
class SpeedEstimate:
    """Speed found from the gear mesh line.

    Attributes
    ----------
    speed : float
        Mean speed of the wheel whose tooth count came first, rad/s.
    gmf : float
        Mean gear mesh frequency in Hz.
    resolution : float
        What one bin of the record's own length is worth, in Hz of GMF.
    spread : float
        Standard deviation of the GMF over the record in Hz, where it could be followed; else NaN.
    prominence : float
        Root mean square height of the mesh harmonics over the floor around them in dB.
    phase : xarray.DataArray or None
        Shaft angle (rad) from the line's phase, if it could be followed.
    score : float
        Height of the comb of harmonics, shaft orders and sidebands in dB, less what lies between (`estimate_speed`).
    doubt : str
        Why the mesh line may be another one, with the frequencies that explain the record as well; empty if none does.
    """

    speed: float
    gmf: float
    resolution: float
    spread: float
    prominence: float
    phase: xr.DataArray | None
    score: float = math.nan
    doubt: str = ""


@takes_data(speed_range="angular speed")
def estimate_speed(
    signal: Any,
    teeth: int | Sequence[int] | None = None,
    *,
    speed_range: tuple[Given, Given] | None = None,
    **_data: Unpack[DataKeywords],
) -> SpeedEstimate:
    """Find the gear mesh frequency, and with the tooth count the speed, from the record alone.

    1. Averaged spectrum (2 s segments), each channel as height over its local floor in dB, 0 to 30, mean over channels.
    2. Comb: for every candidate GMF f the mean height at f ... 4 f (weights 1 to 0.7), plus half of that at the first
       three shaft orders and sidebands, less half of that midway between the harmonics; less 5 % for each harmonic
       beyond half the rate. Of the candidates within 3 % of the best the one whose harmonics carry most power wins.
       It is accepted if its score is ahead of every other comb's by 5.5 robust standard deviations of all scores, or if
       its harmonics stand 12 dB (RMS) over the floor. Then, of all that the strongest lines suggest, the mesh line
       that explains most of them with fewest harmonics missing is taken. Where another one explains as much, or all
       rests on one line, a warning says so.
    3. The peak of the first harmonic that is there, then the mean of its phase's slope, where it can be followed.

    Parameters
    ----------
    signal : xarray.DataArray
        At nearly constant speed, dimensions (time, channel), or whatever `to_signal` makes a signal of, with ``rate``,
        ``units``, ``channels`` and ``gaps`` as there.
    teeth : int or sequence, optional
        Tooth count of the wheel whose speed is wanted (first); default the signal's.
    speed_range : pair of float or str, optional
        Lowest and highest speed to look for, rad/s or texts. Default: from 240 rpm to where two harmonics
        fit below half the sampling rate, or one where no other line is there.

    Returns
    -------
    SpeedEstimate

    Raises
    ------
    MissingMetadataError
        If the tooth count is unknown.
    SignalError
        If the range is empty, the record is too short, or no comb stands out.
    """
    span = None if speed_range is None else (float(speed_range[0]), float(speed_range[1]))
    found = followed_comb(signal, teeth, span)
    if found.doubt:
        warn(found.doubt, UserWarning)
    return found


def followed_comb(
    signal: xr.DataArray, teeth: int | Sequence[int] | None, speed_range: tuple[float, float] | None
) -> SpeedEstimate:
    """`estimate_speed` without its warning."""
    comb = find_comb(signal, teeth, speed_range=speed_range)
    count, gmf = comb.teeth, comb.gmf
    phase, spread = _follow(signal, gmf, count, comb.first)
    if phase is not None:
        gmf = float(phase.attrs["mean_speed"]) * count / (2.0 * math.pi)
    resolution = rate_of(signal) / signal.sizes["time"]
    return SpeedEstimate(
        2.0 * math.pi * gmf / count, gmf, resolution, spread, comb.prominence, phase, comb.score, comb.doubt
    )


class Comb(NamedTuple):
    """A mesh line found in the averaged spectrum: gear mesh frequency in Hz, heights in dB as of `SpeedEstimate`."""

    teeth: int
    gmf: float
    prominence: float
    score: float
    first: int = 1
    """The first harmonic that is there."""
    doubt: str = ""

    @property
    def speed(self) -> float:
        """Speed of the wheel, rad/s."""
        return 2.0 * math.pi * self.gmf / self.teeth


def find_comb(
    signal: xr.DataArray, teeth: int | Sequence[int] | None, *, speed_range: tuple[float, float] | None
) -> Comb:
    """Steps 1 and 2 of `estimate_speed`: the mesh line of the averaged spectrum, not followed over the record."""
    count = require(signal, "teeth", teeth, needed_for="finding the speed from the mesh line")[0]
    rate = rate_of(signal)
    n = signal.sizes["time"]
    low, high = (SLOWEST, math.inf) if speed_range is None else (float(s) for s in speed_range)
    low_gmf = low * count / (2.0 * math.pi)
    high_gmf = min(high * count / (2.0 * math.pi), rate / (4.0 if speed_range is None else 2.0) * 0.98)
    if not 0.0 < low_gmf < high_gmf:
        raise SignalError(
            f"speed_range: {speed_range} rad/s leaves no GMF below half the sampling rate ({rate / 2:g} Hz)"
        )
    length = min(n, round(SEGMENT_SECONDS * rate))
    bin_width = rate / length
    if low_gmf < 8 * bin_width:
        low_gmf = 8 * bin_width
        if low_gmf >= high_gmf:
            raise SignalError(f"signal: {n / rate:g} s are too short to tell a GMF below {high_gmf:g} Hz")
    power, names = _spectra(signal, length)
    candidates = np.arange(low_gmf, high_gmf, bin_width / (2 * HARMONICS))
    tried = _best_comb(power, candidates, bin_width, count)
    apart = ""
    if not tried.stands and len(names) > 1:
        # channels without the line hide it in the mean
        alone = [_best_comb(power[:, [c]], candidates, bin_width, count) for c in range(len(names))]
        standing = sorted((c for c, one in enumerate(alone) if one.stands), key=lambda c: -alone[c].height_db)
        if standing:
            first_one, tried = standing[0], alone[standing[0]]
            power, apart = power[:, [first_one]], _apart(names, alone, standing)
    score, direct, best, height, ahead = tried.score, tried.direct, tried.best, tried.height, tried.ahead
    if not tried.stands:
        where = f" in the mean of {', '.join(map(repr, names))}, nor in any of them" if len(names) > 1 else ""
        raise SignalError(
            f"signal: no gear mesh line stands out{where} (best {direct[best]:.1f} dB at {candidates[best]:.1f} Hz); "
            "give the speed, a tacho, or a narrower speed_range"
        )
    lines = Lines(power, height, bin_width)
    guess = float(candidates[best])
    one: Explained = lines.explained(guess, count)
    others: list[Explained] = []
    # a comb of each second or third of its harmonics lives on those of another one, whose double may lie too high
    ahead = ahead and (not one.harmonics or math.gcd(*one.harmonics) == 1)
    if not ahead:
        top = high_gmf if speed_range is not None else max(high_gmf, ALONE_BELOW * rate)
        one, others = choose(lines, guess, count, low_gmf, top)
    about = one.gmf if one.harmonics else guess
    first = one.harmonics[0] if one.harmonics else 1
    gmf = _peak(power, first * about, bin_width) / first
    if one.harmonics and first * abs(gmf - one.gmf) > AGREED_BINS * bin_width:
        gmf = one.gmf
    if abs(gmf / guess - 1.0) > SAME_COMB:
        score, direct = _comb(height, np.array([gmf]), bin_width, count)
        best = 0
    doubt = _mains(height, float(gmf), bin_width) or apart
    doubt = doubt or ("" if ahead else _doubt(one._replace(gmf=gmf), others, count))
    return Comb(count, float(gmf), float(direct[best]), float(score[best]), first, doubt)


class _Tried(NamedTuple):
    """Combs of a spectrum: score and RMS height of harmonics of each candidate, the best, heights of all lines."""

    score: np.ndarray
    direct: np.ndarray
    best: int
    height: np.ndarray
    ahead: bool
    at: float

    @property
    def height_db(self) -> float:
        return float(self.direct[self.best])

    @property
    def stands(self) -> bool:
        return self.ahead or self.height_db >= MIN_SCORE_DB


def _spectra(signal: xr.DataArray, length: int) -> tuple[np.ndarray, list[str]]:
    """Return averaged power spectra of the channels that change at all, and their names; of all if none does."""
    values = signal.values
    changes = np.ptp(values, axis=0) > UNCHANGED * np.abs(values).max(axis=0)
    changes |= not changes.any()
    power, _ = periodograms(values[:, changes], rate_of(signal), length, "hann", 0.5, True, "power")
    return power, [str(name) for name in signal["channel"].values[changes]]


def _best_comb(power: np.ndarray, candidates: np.ndarray, bin_width: float, count: int) -> _Tried:
    height = prominence(power).mean(axis=1)
    score, direct = _comb(height, candidates, bin_width, count)
    near = np.flatnonzero(score >= NEARLY_BEST * score.max())
    share = (power / np.maximum(power.sum(axis=0), 1e-300)).sum(axis=1)
    carried = sum((_at(share, h * candidates[near], bin_width) for h in range(1, HARMONICS + 1)), np.zeros(near.size))
    best = int(near[np.argmax(carried)])
    ahead = _lead(score, candidates, best) >= MIN_LEAD
    return _Tried(score, direct, best, height, ahead, float(candidates[best]))


def _apart(names: Sequence[str], alone: Sequence[_Tried], standing: Sequence[int]) -> str:
    """Why a line that stands in channels alone may be that of something else: others stand elsewhere; else empty."""
    first = standing[0]
    other = next((c for c in standing[1:] if abs(alone[c].at / alone[first].at - 1.0) > SAME_COMB), None)
    if other is None:
        return ""
    return (
        f"CHECK THE SPEED: the mesh line was taken to be {alone[first].at:.2f} Hz, which stands in {names[first]!r}, "
        f"but {alone[other].at:.2f} Hz stands in {names[other]!r}, and none in both. Give the speed or a tacho."
    )


def _mains(height: np.ndarray, gmf: float, bin_width: float) -> str:
    """Why a mesh line may be hum: at a multiple of the supply's frequency, of which others stand, too; else empty."""
    for mains in MAINS:
        k = round(gmf / mains)
        if k < 1 or abs(k * mains - gmf) > MAINS_SHARE * gmf:
            continue
        others = np.array([m * mains for m in range(1, 4 * k + 1) if m % k])
        others = others[others < (height.size - 1) * bin_width][:MAINS_LINES]
        if others.size > 1 and np.mean(_at(height, others, bin_width) >= MIN_SCORE_DB) > 0.5:
            return (
                f"CHECK THE SPEED: the mesh line was taken to be {gmf:.2f} Hz, {k} times the {mains:g} Hz of the "
                "mains, of which other multiples stand in the record as well. Give the speed or a tacho."
            )
    return ""


def _doubt(one: Explained, others: list[Explained], teeth: int) -> str:
    """Why a mesh line may be the wrong one, and what to do; empty if nothing speaks against it."""

    def named(gmf: float) -> str:
        return f"{gmf:.2f} Hz ({gmf / teeth * 60.0:.1f} rpm with {teeth} teeth)"

    if others:
        also = " or ".join(named(other.gmf) for other in others[:MOST_NAMED])
        why = f"the mesh line was taken to be {named(one.gmf)}, but {also} explains the lines of the record as well"
    elif one.certain:
        return ""
    else:
        why = (
            f"the mesh line was taken to be {named(one.gmf)} from one line alone, or without its first two harmonics; "
            "it may be a harmonic or a part of the true one, or a line of something else"
        )
    return f"CHECK THE SPEED: {why}. Give the speed, a tacho, or a narrower speed_range."


def line_near(signal: xr.DataArray, gmf: float, tolerance: float) -> float | None:
    """Frequency of the mesh line near an expected one, if it stands out from what is found elsewhere.

    The largest sum of the heights of up to four harmonics within the tolerance is compared with the same found near
    other frequencies, from about half to about twice the expected one: noise, and the lines and sidebands of another
    mesh, give as much there.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    gmf : float
        Expected gear mesh frequency, Hz.
    tolerance : float
        Part of it by which the line may be off.

    Returns
    -------
    float or None
        Hz; None if the line does not stand out, or nothing can be compared.
    """
    rate = rate_of(signal)
    length = min(signal.sizes["time"], round(SEGMENT_SECONDS * rate))
    power, _ = _spectra(signal, length)
    height = prominence(power).mean(axis=1)
    width, top = rate / length, 0.5 * rate / (1.0 + tolerance)
    harmonics = min(HARMONICS, math.floor(top / gmf))
    others = gmf * ELSEWHERE[np.abs(ELSEWHERE[:, None] / np.array(SHARED) - 1.0).min(axis=1) > 2.0 * tolerance]
    others = others[(others > FEWEST_BESIDE_ZERO * width) & (others * harmonics < top)]
    if harmonics < 1 or others.size < FEWEST_ELSEWHERE:
        return None

    def best(middle: float) -> tuple[float, float]:
        count = max(3, math.ceil(2.0 * tolerance * middle * 2 * HARMONICS / width))
        candidates = np.linspace(middle * (1.0 - tolerance), middle * (1.0 + tolerance), count)
        total = sum((_at(height, h * candidates, width) for h in range(1, harmonics + 1)), np.zeros(count))
        # several candidates share the bins of the best
        return float(total.max()), float(candidates[np.isclose(total, total.max())].mean())

    found, frequency = best(gmf)
    chance = np.array([best(other)[0] for other in others])
    middle = float(np.median(chance))
    sigma = max(LEAST_SPREAD_DB, 1.4826 * float(np.median(np.abs(chance - middle))))
    return frequency if found > chance.max() and found - middle > AHEAD * sigma else None


def own_lines_missing(signal: xr.DataArray, gmf: float, stronger: float) -> bool:
    """Whether a comb lives on the lines of another one, whose frequency is a multiple of its own.

    Parameters
    ----------
    signal : xarray.DataArray
        Dimensions (time, channel).
    gmf : float
        Frequency of the comb, Hz.
    stronger : float
        Frequency of the other one, Hz.

    Returns
    -------
    bool
        True if no harmonic that the other comb has not reaches an eighth of that one's first line, or half of its
        height in dB.
    """
    rate = rate_of(signal)
    length = min(signal.sizes["time"], round(SEGMENT_SECONDS * rate))
    power, _ = _spectra(signal, length)
    times = round(stronger / gmf)
    own = np.array([h * gmf for h in range(1, 2 * times) if h % times])
    first = np.array([stronger])
    share = (power / np.maximum(power.sum(axis=0), 1e-300)).sum(axis=1)
    height = prominence(power).mean(axis=1)
    bin_width = rate / length
    return bool(
        _at(share, own, bin_width).max() < HOLLOW_POWER * _at(share, first, bin_width)[0]
        or _at(height, own, bin_width).max() < HOLLOW_HEIGHT * _at(height, first, bin_width)[0]
    )


def prominence(power: np.ndarray) -> np.ndarray:
    """Height in dB (0 to 30) of each line over the median of its surroundings, of a power spectrum (m, channels)."""
    top = power.max(axis=0)
    level = 10.0 * np.log10(np.maximum(power, np.where(top > 0.0, top, 1.0) * 10.0 ** (-RANGE_DB / 10.0)))
    m = level.shape[0]
    edges = np.arange(0, max(1, m - FLOOR_BINS // 2), FLOOR_BINS)
    middles = [min(e + FLOOR_BINS / 2, m - 1) for e in edges]
    result = np.empty_like(level)
    for channel in range(level.shape[1]):
        floors = [np.median(level[e : e + FLOOR_BINS, channel]) for e in edges]
        result[:, channel] = level[:, channel] - np.interp(np.arange(m), middles, floors)
    return np.clip(result, 0.0, CLIP_DB)


def _comb(height: np.ndarray, candidates: np.ndarray, bin_width: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Comb score, and the RMS height of the harmonics present alone, for each candidate."""

    def at(frequency: np.ndarray) -> np.ndarray:
        return _at(height, frequency, bin_width)

    shaft = candidates / count
    present = np.minimum(HARMONICS, np.floor((height.size - 1) * bin_width / candidates))
    harmonics = np.zeros_like(candidates)
    between = np.zeros_like(candidates)
    squares = np.zeros_like(candidates)
    weights = np.zeros_like(candidates)
    for h, weight in enumerate(HARMONIC_WEIGHTS, 1):
        here = at(h * candidates)
        harmonics += weight * here
        squares += here**2
        weights += weight * (h <= present)
        between += at((h - 0.5) * candidates)
    harmonics /= weights
    between /= present
    sides = np.zeros_like(candidates)
    for k in range(1, SIDEBANDS + 1):
        sides += at(k * shaft) / SIDEBANDS
        for h in range(1, HARMONICS + 1):
            sides += (at(h * candidates - k * shaft) + at(h * candidates + k * shaft)) / (2 * SIDEBANDS * present)
    trust = 1.0 - FEWER_WEIGHT * (HARMONICS - present)
    score = trust * (harmonics + SIDEBAND_WEIGHT * sides - BETWEEN_WEIGHT * between)
    return score, np.sqrt(squares / present)


def _lead(score: np.ndarray, candidates: np.ndarray, best: int) -> float:
    """How far the best comb is ahead of the best of another frequency, in robust standard deviations of all scores."""
    sigma = 1.4826 * float(np.median(np.abs(score - np.median(score))))
    others = score[np.abs(candidates / candidates[best] - 1.0) > SAME_COMB]
    if others.size < MIN_OTHERS or sigma == 0.0:
        return 0.0
    return float(score[best] - others.max()) / sigma


def _at(line: np.ndarray, frequency: np.ndarray, bin_width: float) -> np.ndarray:
    """Largest of the three bins around each frequency, for the speed is never quite constant; zero beyond the end."""
    index = np.rint(frequency / bin_width).astype(int)
    inside = index < line.size - 1
    index = np.where(inside, index, 1)
    return np.where(inside, np.maximum(np.maximum(line[index - 1], line[index]), line[index + 1]), 0.0)


def _peak(power: np.ndarray, guess: float, bin_width: float) -> float:
    """Peak near `guess` by a parabola through the logarithms of three bins, channels weighted by their own level."""
    middle = round(guess / bin_width)
    low, high = max(1, middle - 3), min(power.shape[0] - 1, middle + 4)
    around = power[max(0, middle - FLOOR_BINS) : middle + FLOOR_BINS].max(axis=0)
    combined = (power[low - 1 : high + 1] / np.where(around > 0.0, around, 1.0)).sum(axis=1)
    k = 1 + int(np.argmax(combined[1:-1]))
    a, b, c = np.log(np.maximum(combined[k - 1 : k + 2], 1e-300))
    curve = a - 2.0 * b + c
    shift = 0.5 * (a - c) / curve if curve < 0.0 else 0.0
    return (low - 1 + k + float(np.clip(shift, -0.5, 0.5))) * bin_width


def _follow(signal: xr.DataArray, gmf: float, count: int, harmonic: int) -> tuple[xr.DataArray | None, float]:
    """Angle by the phase of a harmonic, and the standard deviation of the mesh frequency in Hz."""
    try:
        phase = phase_from_line(signal, harmonic * gmf, harmonic * count)
    except SignalError:
        return None, math.nan
    if phase.attrs["quality"] < MIN_QUALITY:
        return None, math.nan
    step = max(1, phase.size // 1000)
    coarse = phase.values[::step]
    speed = np.diff(coarse) / (step / rate_of(signal))
    return phase, float(np.std(speed)) * count / (2.0 * math.pi)
