"""The speed at which a record is judged: the shaft's own line near the speed that is told, or all speeds near it.

Where no family stands near the told speed it is looked for further off, for a told speed may simply be wrong.

Lines of a bearing are told from those of the shaft by a few thousandths of their frequency, and a speed is seldom told
as well as that: a name plate states a motor's speed at full load, a display rounds, and load and temperature change it.
So the shaft's own family is looked for near the told speed, in the spectrum of the record itself and in that of its
envelope together. The mains, whose lines lie 0.2 % from the turns of an idling two-pole pair, do not modulate anything,
and a ratio counts up to a limit only, so that single lines of other machines make no family.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearmbs.signals.diagnosis.bearing_judgement import LEAST_RATIO, LINE_BINS, EnvelopeSpectrum, log_tail, ratio_at
from gearmbs.signals.rotation.speed import MAINS, MAINS_SHARE

TOLERANCE = 0.005
"""Share by which a told speed may be off: a motor's slip changes by so much between a third and full load."""
REACH = 2.0
"""The shaft's line is looked for within so many tolerances: a nominal speed may be further off than it should."""
ORDERS = (12, 8, 5, 3)
"""Harmonics of the shaft that count: as many of these as are there, for their lines are as many times as exact as the
first, while lines of other families lie near multiples that are not there."""
MOST_MISSING = 0.25
"""Share of the harmonics that may be missing."""
EXACT = 0.25
"""Part of the tolerance to which the speed must be found: three harmonics in 140 turns do."""
LIMIT = 12.0
"""A line's power by its neighbourhood counts up to this, as rare as 6e-6 in noise."""
FOUND_CHANCE = -8.0
"""Decimal logarithm of the chance from which a family is the shaft's."""
ALONE, LEAST_RIVAL = 0.85, 0.3
"""The next best family within reach must be below this part of the best one, in all or in those harmonics that the
record tells apart; there is none if these hold less than the second part of all evidence, one harmonic in three."""
APART = 0.4
"""Families are two if their first lines are further apart than this part of a spectrum's line: from the fourth
harmonic on these are then in different lines."""
SKIRT = 4.0
"""Power round a strong line may be so many times what the window makes of it: 6 dB, as its speed is not quite even."""
PLATEAU = 0.98
"""Part of the best sum within which speeds are equally good. The strongest of these counts, and the mean of those as
good as it."""
FAR = 0.06
"""Share by which a wrong speed may be off: below 1/13 no harmonic of the first twelve is taken for its neighbour."""
STEPS = 5
"""Speeds that are tried on either side of the told one within its tolerance: a thousandth apart by default."""


@dataclass(frozen=True)
class ShaftSpeed:
    """Turns of a shaft, told and found.

    Attributes
    ----------
    told, turns : float
        Hz: as told, and as used.
    log_chance : float
        Decimal logarithm of the probability of such a family in noise.
    found : bool
        Whether the shaft's own line says so; else `turns` is what was told.
    doubt : float
        Hz, by which a speed that was found may be off: the lines of its highest harmonic are as wide.
    """

    told: float
    turns: float
    log_chance: float = 0.0
    found: bool = False
    doubt: float = 0.0

    @property
    def deviation(self) -> float:
        """turns/told - 1."""
        return self.turns / self.told - 1.0


def find_shaft(
    spectra: Sequence[EnvelopeSpectrum], told: float, tolerance: float = TOLERANCE, reach: float | None = None
) -> ShaftSpeed:
    """Return the speed at which a shaft's family stands clearest near the told one.

    Parameters
    ----------
    spectra : sequence of EnvelopeSpectrum
        Of the record and of its envelope, of all channels; evidence adds up.
    told : float
        Turns, Hz.
    tolerance : float
        Share by which ``told`` may be off.
    reach : float, optional
        Share within which the family is looked for; default twice the tolerance.

    Returns
    -------
    ShaftSpeed
        ``found`` is False if no family stands out, or two as clear.
    """
    step = min(spectrum.step for spectrum in spectra)
    for orders in ORDERS:
        if step / (2.0 * orders) > EXACT * tolerance * told:
            break
        found, there = _clearest(spectra, told, REACH * tolerance if reach is None else reach, orders)
        if there >= 1.0 - MOST_MISSING:
            return found
    return ShaftSpeed(told, told)


def _clearest(spectra: Sequence[EnvelopeSpectrum], told: float, reach: float, orders: int) -> tuple[ShaftSpeed, float]:
    """Return the speed at which so many harmonics stand clearest, and what share of them is there."""
    step = min(spectrum.step for spectrum in spectra)
    spacing = step / (2.0 * orders)
    half = round(reach * told / spacing)
    turns = told + spacing * np.arange(-half, half + 1)
    k = np.arange(1, orders + 1)[:, None]
    ratios = np.array([ratio_at(spectrum, k * turns) for spectrum in spectra])
    total = np.minimum(ratios, LIMIT).sum(axis=(0, 1))
    # strong lines count fully at several speeds: their tops tell which it is
    good = total >= PLATEAU * total.max()
    heights = np.where(good, np.log(np.maximum(ratios, 1.0)).sum(axis=(0, 1)), 0.0)
    best = int(np.argmax(heights))
    there = float(np.mean(ratios[:, :, best].max(axis=0) >= LEAST_RATIO))
    trials = max(1.0, 2.0 * reach * told / step * (orders + 1) / 2.0)
    chance = (log_tail(float(total[best]), orders * len(spectra)) + math.log(trials)) / math.log(10.0)
    inside = 0 < best < turns.size - 1
    if chance > FOUND_CHANCE or not inside or not _alone(ratios, best, k * (turns - turns[best]) / step):
        return ShaftSpeed(told, told, min(chance, 0.0)), there
    near = np.abs(turns - turns[best]) <= 0.5 * step
    return ShaftSpeed(
        told, float(turns[near & (heights >= PLATEAU * heights[best])].mean()), chance, True, spacing
    ), there


def _alone(ratios: np.ndarray, best: int, bins: np.ndarray) -> bool:
    """Return whether no other family is as strong as the best one where their lines are told apart.

    Parameters
    ----------
    ratios : ndarray, shape (spectra, harmonics, speeds)
    best : int
        Number of the best speed.
    bins : ndarray, shape (harmonics, speeds)
        How far the lines of each speed lie beside those of the best one, in lines of the spectrum.
    """
    apart = np.abs(bins) > LINE_BINS
    # a Hann window's side lobes, below which nothing is a line of its own
    off = np.maximum(np.abs(bins), LINE_BINS)
    lobes = (math.pi * off * (off**2 - 1.0)) ** -2.0
    total = np.minimum(ratios, LIMIT).sum(axis=(0, 1))
    if float(total[np.abs(bins[0]) > APART].max(initial=0.0)) < ALONE * float(total[best]):
        return True
    # strong lines with few harmonics have broad feet
    own = ratios[:, :, [best]]
    counted = np.where(ratios > SKIRT * lobes * own, np.minimum(ratios, LIMIT), 1.0) - 1.0
    excess = np.minimum(own, LIMIT) - 1.0
    rival, same = (np.where(apart, values, 0.0).sum(axis=(0, 1)) for values in (counted, excess))
    return not bool(np.any((rival >= ALONE * same) & (rival >= LEAST_RIVAL * excess.sum())))


def far_shaft(
    spectra: Sequence[EnvelopeSpectrum], told: float, tolerance: float, others: Sequence[float] = ()
) -> ShaftSpeed:
    """Return the speed of the shaft's family further from the told one than the tolerance allows.

    Parameters
    ----------
    spectra, told, tolerance
        As of `find_shaft`.
    others : sequence of float
        Ratios of shafts whose families are known.
    """
    found = find_shaft(spectra, told, tolerance, FAR)
    known = [(ratio * told, tolerance) for ratio in others if ratio != 1.0] + [(mains, MAINS_SHARE) for mains in MAINS]
    if any(abs(found.turns / line - 1.0) <= share for line, share in known):
        return ShaftSpeed(told, told)
    return found


def tried_speeds(spectra: Sequence[EnvelopeSpectrum], told: float, tolerance: float) -> list[ShaftSpeed]:
    """Return what follows from speeds told within the tolerance, the told one in the middle, rising.

    Parameters
    ----------
    spectra, told, tolerance
        As of `find_shaft`; with a tolerance of zero the told speed alone.
    """
    if tolerance <= 0.0:
        return [ShaftSpeed(told, told)]
    shares = tolerance * np.arange(-STEPS, STEPS + 1) / STEPS
    return [find_shaft(spectra, told * (1.0 + float(share)), tolerance) for share in shares]
