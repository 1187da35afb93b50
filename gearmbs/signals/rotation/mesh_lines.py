"""Which mesh line explains the lines of a spectrum: most of them, with fewest of its harmonics missing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.ndimage

LOCAL_BINS = 256
"""Width of the blocks over which it is found what height chance gives."""
SIGNIFICANT = 4.0
"""Robust standard deviations above the local median from which a height is a line."""
LEAST_SPREAD_DB = 1.0
"""Least standard deviation: without noise there is none, and a decibel is less than any line has."""
WANDER = 5e-4
"""Relative change of the speed, over which the line of a harmonic is spread."""
MISSING = 0.22
"""What a harmonic that is not there costs, as a part of the strongest that is: half the frequency of 1, 2 has two such,
the first of 2, 3, 4 one; with this the better of each two is ahead by the same ratio, 0.73."""
ALIKE = 0.8
"""Part of the best sum from which another mesh line explains a spectrum as well."""
SIDE = 0.25
"""Weight of the first sidebands and shaft orders beside harmonics; the k-th counts 1 / k of it, as half the speed
makes the first ones second ones."""
ORDERS = 3
STRONGEST = 12
PARTS = 4
"""Lines from which mesh lines are tried, each as its first to fourth harmonic."""
MOST_HARMONICS = 64
SAME = 5e-3
"""Relative difference of frequencies up to which two are one: less than a shaft order of 100 teeth."""


class Explained(NamedTuple):
    """What one mesh line explains."""

    gmf: float
    """Hz, at which its harmonics are."""
    total: float
    harmonics: tuple[int, ...]
    """Those that are there."""
    sides: int
    """Harmonics beside which both first sidebands are."""

    @property
    def certain(self) -> bool:
        """Whether two harmonics in succession are there, or one with its sidebands, and not high ones alone."""
        successive = any(k + 1 in self.harmonics for k in self.harmonics)
        return bool(self.harmonics) and self.harmonics[0] <= 2 and (successive or self.sides > 0)


class Lines:
    """Lines of a spectrum: heights over what chance gives around them.

    Parameters
    ----------
    power : ndarray of shape (m, channels)
        Averaged power spectrum.
    height : ndarray of shape (m,)
        Mean height over the floor in dB, of all its bins.
    bin_width : float
        Hz.
    """

    def __init__(self, power: np.ndarray, height: np.ndarray, bin_width: float) -> None:
        top = np.maximum(power.max(axis=0), 1e-300)
        level = np.log(np.maximum(power / top, 1e-30)).mean(axis=1)
        inner = (level[1:-1] >= level[:-2]) & (level[1:-1] >= level[2:])
        peaks = np.where(np.r_[False, inner, False], height, 0.0)
        index = np.arange(peaks.size)
        radius = 1 + (WANDER * index).astype(int)
        largest = np.zeros_like(peaks)
        for r in range(1, int(radius[-1]) + 1):
            here = radius == r
            largest[here] = scipy.ndimage.maximum_filter1d(peaks, 2 * r + 1)[here]
        starts = np.arange(0, max(1, peaks.size - LOCAL_BINS // 2), LOCAL_BINS)
        usual = np.interp(index, starts + LOCAL_BINS / 2, [np.median(largest[s : s + LOCAL_BINS]) for s in starts])
        over = largest - usual
        sigma = max(LEAST_SPREAD_DB, 1.4826 * float(np.median(np.abs(over - np.median(over)))))
        self.evidence = np.where(over >= SIGNIFICANT * sigma, over, 0.0)
        self.peaks, self.level, self.radius, self.bin_width = peaks, level, radius, bin_width

    def at(self, frequency: float) -> float:
        """Height in dB over what chance gives of the line at a frequency; zero where none is."""
        i = round(frequency / self.bin_width)
        return float(self.evidence[i]) if 0 < i < self.evidence.size - 1 else 0.0

    def place(self, frequency: float) -> float:
        """Frequency of the line near one, by a parabola through three logarithms."""
        i = round(frequency / self.bin_width)
        r = int(self.radius[i])
        i = max(1, i - r) + int(np.argmax(self.peaks[max(1, i - r) : i + r + 1]))
        a, b, c = self.level[i - 1 : i + 2]
        curve = a - 2.0 * b + c
        return (i + (float(np.clip(0.5 * (a - c) / curve, -0.5, 0.5)) if curve < 0.0 else 0.0)) * self.bin_width

    def strongest(self) -> list[float]:
        """Frequencies of the strongest lines, by power and by height."""
        found = self.evidence * (self.peaks > 0.0)
        by_power = np.argsort(np.where(found > 0.0, self.level, -np.inf))[-STRONGEST:]
        chosen = np.union1d(by_power, np.argsort(found + 1e-3 * self.level)[-STRONGEST:])
        return [self.place(i * self.bin_width) for i in chosen.tolist() if found[i] > 0.0]

    def explained(self, gmf: float, teeth: int) -> Explained:
        """What a mesh line of about this frequency explains, at the frequency at which its harmonics are.

        With the places f_k of the harmonics k that are there and their evidence w_k that is the least-squares frequency
        ``sum(w_k k f_k) / sum(w_k k^2)``.
        """
        top = (self.evidence.size - 2) * self.bin_width
        weight = moment = strength = 0.0
        there: list[int] = []
        evidence: list[float] = []
        for k in range(1, min(MOST_HARMONICS, int(top / gmf)) + 1):
            found = self.at(k * gmf)
            evidence.append(found)
            if found > 0.0:
                there.append(k)
                strength = max(strength, found)
                weight, moment = weight + found * k * k, moment + found * k * self.place(k * gmf)
                gmf = moment / weight
            elif there and k - there[-1] > PARTS:
                break
        sums = np.cumsum(np.array(evidence) - MISSING * strength)
        if not there or sums.max() <= 0.0:
            return Explained(gmf, 0.0, (), 0)
        last = int(np.argmax(sums)) + 1
        there = [k for k in there if k <= last]
        orders = 1.0 / np.arange(1, ORDERS + 1)
        shaft = np.array([[self.at((k + m / teeth) * gmf) for m in range(1, ORDERS + 1)] for k in (0, *there)])
        below = np.array([[self.at((k - m / teeth) * gmf) for m in range(1, ORDERS + 1)] for k in there])
        total = float(sums[last - 1] + SIDE * (shaft.sum(axis=0) + below.sum(axis=0)) @ orders)
        return Explained(gmf, total, tuple(there), int(((shaft[1:, 0] > 0.0) & (below[:, 0] > 0.0)).sum()))


def choose(lines: Lines, guess: float, teeth: int, low: float, high: float) -> tuple[Explained, list[Explained]]:
    """The mesh line that explains most with fewest, and others that explain as much.

    Harmonics count their height over what chance gives, those missing below the last a part of the strongest;
    sidebands of harmonics and shaft orders count a part of theirs. Where the guess explains as much, it is taken,
    unless it may be a sideband.

    Parameters
    ----------
    lines : Lines
    guess : float
        Frequency of the best comb, Hz.
    teeth : int
        Of the wheel whose shaft makes the sidebands.
    low, high : float
        Lowest and highest frequency to try, Hz.

    Returns
    -------
    best : Explained
    others : list of Explained
        Falling; empty if the best stands alone.
    """
    first = lines.explained(guess, teeth)
    tried = [f / part for f in lines.strongest() for part in range(1, PARTS + 1)]
    found = sorted((lines.explained(f, teeth) for f in tried if low <= f <= high), key=lambda e: -e.total)
    most = max([first, *found[:1]], key=lambda e: e.total)
    beside = most.sides > 0 and first.sides == 0
    best = first if first.total >= ALIKE * most.total and not beside else most
    others: list[Explained] = []
    for one in found:
        if one.total < ALIKE * most.total:
            break
        if all(abs(one.gmf / other.gmf - 1.0) > SAME for other in (best, *others)):
            others.append(one)
    return best, others
