"""How clearly the lines of a bearing stand in a spectrum of a squared envelope.

Without a defect the envelope of a record is noise, and the power r at a line, by the mean power round it, is
exponentially distributed. The sum over K harmonics of one frequency f, the same for all, then has a gamma distribution;
its largest value over all f that slip allows is exceeded by chance with the probability

    p = N P(gamma_K > max_f sum_k r(k f)),

N being the number of independent frequencies looked at. The mean over several bands scatters less than that: there p is
an upper limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy.fft

HARMONICS = 4
SLIP = 0.015
"""Share by which a line may lie beside its kinematic place."""
AROUND = 0.4
"""Width of the neighbourhood that gives the mean power, in shaft turns."""
LEAST_BINS = 51
LINE_BINS = 2.5
"""Half width of what belongs to a line, in lines of the spectrum: the main lobe of a Hann window has two."""
LOWEST = 3
"""Lines at the bottom of a spectrum that the removed mean touches."""


@dataclass(frozen=True, eq=False)
class EnvelopeSpectrum:
    """Power of a squared envelope by its neighbourhood.

    Attributes
    ----------
    step : float
        Distance of its lines, Hz.
    ratio : ndarray, shape (m,)
        Power at k step by the mean power round it; 1 where it is not to count.
    where : str
        Which part of the record it shows, for reports.
    """

    step: float
    ratio: np.ndarray
    where: str = ""

    @classmethod
    def of(cls, power: np.ndarray, step: float, turns: float, where: str = "") -> EnvelopeSpectrum:
        """Return a spectrum by its neighbourhood, medians of which are not raised by single lines.

        Parameters
        ----------
        power : ndarray, shape (m,)
            Of the squared envelope, or the mean of several by their neighbourhoods.
        step : float
            Hz.
        turns : float
            Of the shaft, Hz.
        """
        width = min(max(round(AROUND * turns / step), LEAST_BINS), power.size)
        count = max(power.size // width, 1)
        blocks = power[: count * width].reshape(count, width)
        middle = (np.arange(count) + 0.5) * width - 0.5
        medians = np.median(blocks, axis=1) / math.log(2.0)
        level = np.interp(np.arange(power.size), middle, np.maximum(medians, 1e-300))
        return cls(step, power / level, where)

    @property
    def frequency(self) -> np.ndarray:
        """Hz, shape (m,)."""
        return self.step * np.arange(self.ratio.size)

    @property
    def top(self) -> float:
        """Highest frequency, Hz."""
        return self.step * (self.ratio.size - 1)

    def without(self, lines: Iterable[float], share: float) -> EnvelopeSpectrum:
        """Return the spectrum in which some lines do not count, nor what is within a share of them."""
        ratio = self.ratio.copy()
        for line in lines:
            half = LINE_BINS * self.step + share * line
            first, last = math.ceil((line - half) / self.step), math.floor((line + half) / self.step)
            if last >= 0 and first < ratio.size:
                ratio[max(first, 0) : last + 1] = 1.0
        return replace(self, ratio=ratio)


@dataclass(frozen=True)
class Evidence:
    """What was found of one family of lines.

    Attributes
    ----------
    kinematic, found : float
        Hz: where the fundamental should be, and where the lines are that fit best.
    ratios : tuple of float
        Power of each harmonic by the mean power round it.
    log_chance : float
        Decimal logarithm of the probability of such a family by chance.
    where : str
        The spectrum.
    """

    kinematic: float
    found: float
    ratios: tuple[float, ...]
    log_chance: float
    where: str = ""


def find_lines(
    spectrum: EnvelopeSpectrum,
    line: float,
    *,
    slip: float = SLIP,
    harmonics: int = HARMONICS,
) -> Evidence:
    """Return the evidence for a family of lines.

    Parameters
    ----------
    spectrum : EnvelopeSpectrum
    line : float
        Kinematic fundamental, Hz.
    slip : float
        Share that the fundamental may lie off.
    harmonics : int
        How many harmonics count.
    """
    step, size = spectrum.step, spectrum.ratio.size
    fits = [k for k in range(1, harmonics + 1) if round(k * line * (1 + slip) / step) < size]
    if not fits:
        return Evidence(line, line, (), 0.0, spectrum.where)
    spacing = step / (2.0 * fits[-1])
    half = max(slip * line, spacing)
    candidates = np.linspace(line - half, line + half, 2 * int(half / spacing) + 1)
    ratios = np.stack([_at(spectrum, k * candidates) for k in fits])
    trials = max(1.0, 2.0 * half / step * sum(fits) / len(fits))
    total = ratios.sum(axis=0)
    best = int(np.argmax(total))
    chance = log_tail(float(total[best]), len(fits)) + math.log(trials)
    found = tuple(float(r) for r in ratios[:, best])
    return Evidence(line, float(candidates[best]), found, min(chance / math.log(10.0), 0.0), spectrum.where)


def _at(spectrum: EnvelopeSpectrum, frequency: np.ndarray) -> np.ndarray:
    """Return the ratio at frequencies; 1 outside the spectrum."""
    place = np.rint(frequency / spectrum.step).astype(int)
    inside = (place >= LOWEST) & (place < spectrum.ratio.size)
    return np.where(inside, spectrum.ratio[np.clip(place, 0, spectrum.ratio.size - 1)], 1.0)


def log_tail(total: float, count: int) -> float:
    """Return ln P(gamma_K > x) for a whole number K, e^-x sum_(j < K) x^j/j!."""
    return -total + math.log(sum(total**j / math.factorial(j) for j in range(count)))


def squared_envelope(values: np.ndarray, rate: float, band: tuple[float, float] | None) -> np.ndarray:
    """Return the squared envelope of one channel in a band."""
    n = values.size
    line = scipy.fft.rfft(values - values.mean())
    if band is not None:
        f = scipy.fft.rfftfreq(n, 1.0 / rate)
        line[(f < band[0]) | (f > band[1])] = 0.0
    full = np.zeros(n, dtype=complex)
    full[: line.size] = line
    return np.abs(scipy.fft.ifft(full)) ** 2


def power_of(envelope: np.ndarray) -> np.ndarray:
    """Return the power of an envelope by frequency, its mean removed, Hann window."""
    return np.abs(scipy.fft.rfft((envelope - envelope.mean()) * np.hanning(envelope.size))) ** 2
