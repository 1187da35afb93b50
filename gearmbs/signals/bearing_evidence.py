"""How clearly the lines of a bearing stand in a spectrum of a squared envelope.

Without a defect the envelope of a record is noise, and the power r at a line, by the mean power round it, is
exponentially distributed. The sum over K harmonics of one frequency f, the same for all, then has a gamma distribution;
its largest value over all f that slip allows is exceeded by chance with the probability

    p = N P(gamma_K > max_f sum_k r(k f)),

N being the number of independent frequencies looked at. Lines at whole multiples of the shaft are left out, for they
are of shafts and gears.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft

HARMONICS = 4
SLIP = 0.015
"""Share by which a line may lie beside its kinematic place."""
AROUND = 0.2
"""Half width of the neighbourhood that gives the mean power, in shaft turns."""
LEAST_BINS = 25
SHAFT_BINS = 2.5
"""Half width of what belongs to a multiple of the shaft, in lines of the spectrum."""


@dataclass(frozen=True)
class Evidence:
    """What was found of one part of a bearing.

    Attributes
    ----------
    kinematic, found : float
        Hz: where the fundamental should be, and where the lines are that fit best.
    ratios : tuple of float
        Power of each harmonic by the mean power round it.
    log_chance : float
        Decimal logarithm of the probability of such lines by chance.
    """

    kinematic: float
    found: float
    ratios: tuple[float, ...]
    log_chance: float

    @property
    def slip(self) -> float:
        """found/kinematic - 1."""
        return self.found / self.kinematic - 1.0

    @property
    def level(self) -> float:
        """Power of the fundamental by its neighbourhood, dB."""
        return 10.0 * float(np.log10(max(self.ratios[0], 1e-3))) if self.ratios else float("-inf")

    @property
    def score(self) -> float:
        """Sum of the harmonics' levels above their neighbourhood, in decades; ranks parts."""
        return float(np.sum(np.log10(1.0 + np.asarray(self.ratios))))


def squared_envelope_power(
    values: np.ndarray, rate: float, band: tuple[float, float] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and power of the squared envelope of one channel in a band, Hann window."""
    n = values.size
    line = scipy.fft.rfft(values - values.mean())
    if band is not None:
        f = scipy.fft.rfftfreq(n, 1.0 / rate)
        line[(f < band[0]) | (f > band[1])] = 0.0
    full = np.zeros(n, dtype=complex)
    full[: line.size] = line
    square = np.abs(scipy.fft.ifft(full)) ** 2
    return power_of(square, rate)


def power_of(envelope: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and power of an envelope, its mean removed, Hann window."""
    spectrum = scipy.fft.rfft((envelope - envelope.mean()) * np.hanning(envelope.size))
    return scipy.fft.rfftfreq(envelope.size, 1.0 / rate), np.abs(spectrum) ** 2


def find_lines(
    frequency: np.ndarray,
    power: np.ndarray,
    line: float,
    shaft: float,
    *,
    slip: float = SLIP,
    harmonics: int = HARMONICS,
) -> Evidence:
    """Return the evidence for a family of lines.

    Parameters
    ----------
    frequency, power : ndarray, shape (m,)
        Spectrum of a squared envelope.
    line, shaft : float
        Kinematic fundamental and turns of the shaft, Hz.
    slip : float
        Share that the fundamental may lie off.
    harmonics : int
        How many harmonics count.
    """
    step = float(frequency[1] - frequency[0])
    around = max(round(AROUND * shaft / step), LEAST_BINS)
    fits = [k for k in range(1, harmonics + 1) if round(k * line * (1 + slip) / step) + around < power.size]
    spacing = step / (2.0 * max(fits, default=1))
    half = max(slip * line, spacing)
    candidates = np.linspace(line - half, line + half, 2 * int(half / spacing) + 1)
    ratios = np.ones((len(fits), candidates.size))
    for row, k in enumerate(fits):
        first = max(int(k * (line - half) / step) - around, 2)
        last = int(k * (line + half) / step) + around + 1
        mean = np.median(power[first:last]) / np.log(2.0)
        at = np.rint(k * candidates / step).astype(int)
        found = power[at] / max(mean, 1e-300)
        turns = k * candidates / shaft
        of_shaft = np.abs(turns - np.rint(turns)) * shaft < SHAFT_BINS * step
        ratios[row] = np.where(of_shaft & (np.rint(turns) >= 1), 1.0, found)
    if not fits:
        return Evidence(line, line, (), 0.0)
    total = ratios.sum(axis=0)
    best = int(np.argmax(total))
    trials = max(1.0, 2.0 * half / step * sum(fits) / len(fits))
    chance = log_tail(float(total[best]), len(fits)) + math.log(trials)
    return Evidence(
        line, float(candidates[best]), tuple(float(r) for r in ratios[:, best]), min(chance / math.log(10.0), 0.0)
    )


def log_tail(total: float, count: int) -> float:
    """Return ln P(gamma_K > x) for a whole number K, e^-x sum_(j < K) x^j/j!."""
    return -total + math.log(sum(total**j / math.factorial(j) for j in range(count)))
