"""Whether what stands out of a record is at the mesh orders that the told teeth and lines say.

A pair of equal wheels turns with one ratio whatever its teeth are, and two discs of one count show that ratio whatever
the count is told to be. The mesh itself knows better: where it stands out of marks and noise it does so at an order and
at multiples of it. If these are others than the told ones, one of the numbers is wrong. Where the marks hide it, they
tell themselves: those of a disc recur with its own turn, whatever is told.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import scipy.fft

from gearmbs.signals.encoders.orders import Deviations, Gearing, folded
from gearmbs.signals.encoders.pulses import TURN, PulseTrain

STANDS = 4.0
"""Times the median of the largest lines beside it, one for each order, from which a line is the mesh's: of chance, with
marks or without, one in some thousands is."""
BESIDE, MODULATED = 8, 2
"""Orders to either side that say what is usual, and those next to a line that its modulation by the shafts may have."""
FEWEST_TEETH = 5
"""Orders below are the shafts' own."""
SEEN = 0.4
"""Share of the lines up to which straight lines between the pulses show an order."""
MULTIPLES = 3
CANDIDATES = 12
WIDTH = 1.5
"""Lines of the spectrum by which an order may seem to be off."""
STRAY, LEAST_STRAY, MOST_STRAY = 4.0, 0.02, 5
"""Lines of the spectrum to either side of a shaft's order that are its own; part of the largest line from which others
are told, and how many."""
LEAST_MARKS = 5e-4
"""Pitches, RMS: a mesh stands out of smaller errors; in simulations without noise they are those of splines."""
LARGE_HARMONICS, BESIDE_MESH = 6, 1
"""Mesh harmonics that are left out where marks are looked for, with the orders to either side of them."""
MOST_LEFT_OUT = 0.5
"""Share of the orders that the told mesh and its sidebands may take: of few lines all orders are theirs."""
FEWEST_LAG = 16
"""Pulses after which, at the earliest, marks of a disc recur."""
TURNS_SEEN = 3.0
"""Recurrences that a train must hold to show one."""
RECURS = 0.5
"""Correlation from which marks recur: of marks as large as all else, and no other motion, together."""
SAME_RECURRENCE = 0.85
"""Part of the best correlation from which another one is as good: of two equal ones the shorter is the turn."""
NOT_AT_ALL = 0.5
"""Part of the best correlation below which marks do not recur after the told turn."""
LOUDEST = 0.99
"""Share of a spectrum above which lines are cut off: those of a mesh, its sidebands and a supply are fewer."""
TICKS = 3.0
"""Steps of the counter's clock, RMS, below which intervals show how the clock rounds them, which recurs, too."""


def doubted_numbers(
    first: Deviations, second: Deviations, begin: float, end: float, gearing: Gearing, lines: Sequence[int],
    several: bool = False,
) -> str | None:  # fmt: skip
    """Return what is wrong with the told teeth and lines, or None.

    Parameters
    ----------
    first, second : Deviations
        Of both shafts, as angles of the first.
    begin, end : float
        Stretch of the common angle, rad.
    gearing : Gearing
    lines : (int, int)
    several : bool
        Whether there may be further meshes between the shafts, whose lines are no contradiction where the told one
        stands, too.
    """
    turns = (end - begin) / TURN
    limit = SEEN * min(lines[0], lines[1] / float(gearing.ratio))
    told = float(gearing.mesh)
    if limit < 2.0 * FEWEST_TEETH or told > limit:
        return None
    amplitude = _spectrum(first, second, begin, turns, limit)
    width = WIDTH / turns

    def line(order: float) -> int:
        low, high = (max(0, round((order + side) * turns)) for side in (-width, width))
        return low + int(np.argmax(amplitude[low : high + 1]))

    usual = _usual(amplitude, turns)

    def stands(order: float) -> bool:
        at = round(order)
        return order <= limit and at < usual.size and amplitude[line(order)] > STANDS * usual[at]

    inner = amplitude[1:-1]
    peaks = 1 + np.flatnonzero((inner > amplitude[:-2]) & (inner >= amplitude[2:]))
    peaks = peaks[(peaks >= FEWEST_TEETH * turns) & (peaks <= 0.5 * limit * turns)]
    peaks = peaks[np.argsort(amplitude[peaks])[::-1][:CANDIDATES]]
    families = []
    for peak in peaks / turns:
        own = [k for k in range(1, MULTIPLES + 1) if stands(k * peak)]
        if own[:1] == [1] and len(own) > 1:
            exact = line(own[-1] * peak) / turns / own[-1]
            families.append((sum(amplitude[line(k * peak)] for k in own), exact, own[-1]))
    if not families:
        return None
    if several and stands(told):
        return None
    _, found, count = max(families)
    times, part = found / told, told / found
    # the highest multiple tells it best
    if abs(found - told) <= width / count:
        return None
    # the mesh beyond half the lines is seen where it is folded to
    if any(
        abs(found - folded(k * told, n)) <= width for n in lines for k in range(1, 2 * MULTIPLES) if k * told > n / 2
    ):
        return None
    if stands(told) and abs(found - told) > 2.0 * width and not _whole(part, width / found):
        return None
    if _whole(times, width / told) and (
        count < MULTIPLES or any(stands(k * told) for k in (1, 3, 5) if k % round(times))
    ):
        return None
    return _words(found, told, gearing, lines, turns * count)


def stray_lines(
    first: Deviations, second: Deviations, begin: float, end: float, gearing: Gearing, lines: Sequence[int]
) -> list[tuple[float, float]]:
    """Return orders of the first shaft where lines stand that are whole orders of neither shaft, and their heights.

    They are those of shafts and meshes between the two. The heights are rad of the first shaft, the largest first.

    Parameters
    ----------
    first, second, begin, end, gearing, lines
        As for `doubted_numbers`.
    """
    turns, ratio = (end - begin) / TURN, float(gearing.ratio)
    limit = SEEN * min(lines[0], lines[1] / ratio)
    amplitude = _spectrum(first, second, begin, turns, limit)
    order = np.arange(amplitude.size) / turns
    off = np.minimum(*(np.abs(order * scale - np.rint(order * scale)) / scale for scale in (1.0, ratio)))
    mesh = np.abs(order - float(gearing.mesh) * np.maximum(np.rint(order / float(gearing.mesh)), 1.0))
    alone = (off > STRAY / turns) & (mesh > MODULATED) & (order > STRAY / turns)
    inner = amplitude[1:-1]
    peak = np.r_[False, (inner > amplitude[:-2]) & (inner >= amplitude[2:]), False] & alone
    level = STANDS * float(np.median(amplitude)) * math.sqrt(math.log(max(amplitude.size, 2)))
    # marks that are not known have lines at whole orders, and beside them where the speed varies
    level = max(level, STANDS * float(np.median(amplitude[off <= 0.5 / turns])))
    found = np.flatnonzero(peak & (amplitude > max(level, LEAST_STRAY * float(amplitude.max()))))
    found = found[np.argsort(amplitude[found])[::-1][:MOST_STRAY]]
    return [(float(order[k]), float(amplitude[k])) for k in found]


def repeating_marks(trains: Sequence[PulseTrain], mesh: Sequence[float], ratio: float = 1.0) -> str | None:
    """Return what the marks of some discs say against the told lines: that they recur after another count; or None.

    Parameters
    ----------
    trains : sequence of PulseTrain
    mesh : sequence of float
        Told mesh order of each shaft, about whose multiples nothing is taken for marks.
    ratio : float
        Speed of the first shaft by that of the second, whose wheels have errors of their own.
    """
    mates = (ratio, 1.0 / ratio)
    found = [_recurrence(train, order, mate) for train, order, mate in zip(trains, mesh, mates, strict=False)]
    words = [
        f"marks of the {train.name!r} recur after {count} pulses, of which {train.lines} are told for a turn"
        for train, count in zip(trains, found, strict=True)
        if count is not None
    ]
    if not words:
        return None
    # both turn in the told ratio, so that both are told wrongly alike
    share = next(count / train.lines for train, count in zip(trains, found, strict=True) if count is not None)
    counts = " and ".join(str(count or round(share * train.lines)) for train, count in zip(trains, found, strict=True))
    return f"CHECK THE LINES AND TEETH: {'; '.join(words)}; discs of {counts} lines would explain it."


def _recurrence(train: PulseTrain, mesh: float, mate: float) -> int | None:
    """Return after how many pulses marks recur, if that is not the told count of lines.

    Second differences of the times by the interval around them show the marks and hardly the motion. What recurs with
    the teeth and with the mate's turns, by the told numbers, is left out.
    """
    if train.referenced:
        return None
    _, times, there = train.every()
    interval = 0.5 * (times[2:] - times[:-2])
    bent = times[2:] - 2.0 * times[1:-1] + times[:-2]
    bent[~(there[2:] & there[1:-1] & there[:-2])] = 0.0
    if np.sqrt(np.mean(bent**2)) < TICKS * _tick(np.diff(times)):
        return None
    values = bent / interval
    size, most = values.size, int(values.size / TURNS_SEEN)
    if most <= max(train.lines, 2 * FEWEST_LAG):
        return None
    power = np.abs(scipy.fft.rfft(values, 2 * size)) ** 2
    order = np.arange(power.size) * (train.lines / (2.0 * size))
    for k in range(1, LARGE_HARMONICS + 1):
        power[np.abs(order - folded(k * mesh, train.lines)) <= BESIDE_MESH] = 0.0
    power = np.minimum(power, np.quantile(power, LOUDEST))
    # of independent errors second differences have six times the variance
    marks = math.sqrt(float(power[power > 0.0].mean()) / (6.0 * size))
    if marks < LEAST_MARKS or np.mean(power == 0.0) > MOST_LEFT_OUT:
        return None
    alike = scipy.fft.irfft(power)[: most + 1] / (1.0 - np.arange(most + 1) / size)
    alike = alike / alike[0] if alike[0] > 0.0 else alike
    lags = np.arange(FEWEST_LAG, most + 1)
    turn = train.lines * mate
    if abs(train.lines / turn - round(train.lines / turn)) * turn > 1.0:
        lags = lags[np.abs((lags + 0.5 * turn) % turn - 0.5 * turn) > 1.0]
    best = float(alike[lags].max())
    if best < RECURS:
        return None
    count = int(lags[np.argmax(alike[lags] >= SAME_RECURRENCE * best)])
    told = float(alike[train.lines])
    if count == train.lines or (count > train.lines and told >= NOT_AT_ALL * best):
        return None
    return count


def _tick(intervals: np.ndarray) -> float:
    """Return the step of the clock that intervals were counted by, s: their least difference."""
    steps = np.diff(np.unique(intervals))
    return float(steps.min(initial=math.inf)) if steps.size else math.inf


def _spectrum(first: Deviations, second: Deviations, begin: float, turns: float, limit: float) -> np.ndarray:
    """Return the amplitudes of the lag over orders, `turns` lines an order."""
    count = 2 * math.ceil(limit / SEEN * turns)
    phi = begin + TURN * turns * np.arange(count) / count
    lag = np.interp(phi, first.phi, first.values) - np.interp(phi, second.phi, second.values)
    window = 0.5 - 0.5 * np.cos(TURN * np.arange(count) / count)
    seen = np.abs(scipy.fft.rfft(window * (lag - lag.mean()))) * (4.0 / count)
    return seen[: math.ceil((limit + 1.0) * turns)]


def _usual(amplitude: np.ndarray, turns: float) -> np.ndarray:
    """Return for each whole order the median of the largest lines of the orders beside it."""
    edges = np.round((np.arange(math.floor(amplitude.size / turns)) + 0.5) * turns).astype(int)
    largest = np.array([amplitude[a:b].max() for a, b in pairwise(edges) if b > a])
    # the first of them is that of order 1
    out = np.full(largest.size + 1, np.inf)
    for k in range(1, out.size):
        near = np.arange(max(1, k - BESIDE), min(out.size, k + BESIDE + 1))
        near = near[np.abs(near - k) > MODULATED]
        out[k] = float(np.median(largest[near - 1])) if near.size else np.inf
    return out


def _whole(value: float, within: float) -> bool:
    """Return whether a quotient is a whole number above one."""
    return value > 1.5 and abs(value - round(value)) <= within * value


def _words(found: float, told: float, gearing: Gearing, lines: Sequence[int], turns: float) -> str:
    teeth = (found, found * float(gearing.ratio))
    counts = [n * told / found for n in lines]
    known = 1.0 / turns
    remedies = []
    if all(abs(z - round(z)) < known * max(1.0, float(gearing.ratio)) for z in teeth):
        remedies.append(f"teeth of {round(teeth[0])} and {round(teeth[1])}")
    if all(abs(n - round(n)) < 0.25 + n * known / found for n in counts):
        remedies.append(f"discs of {round(counts[0])} and {round(counts[1])} lines")
    would = f"; {' or '.join(remedies)} would explain it" if remedies else ""
    return (
        f"CHECK THE LINES AND TEETH: lines stand out at order {found:.5g} of the driver and its multiples, as a mesh's "
        f"do, and not at the told {told:.5g}{would}."
    )
