"""The speed at which a record is judged: the shaft's own line near the speed that is told, or all speeds near it.

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

from gearmbs.signals.diagnosis.bearing_judgement import LEAST_RATIO, EnvelopeSpectrum, log_tail, ratio_at

TOLERANCE = 0.005
"""Share by which a told speed may be off: a motor's slip changes by so much between a third and full load."""
REACH = 2.0
"""The shaft's line is looked for within so many tolerances: a nominal speed may be further off than it should."""
ORDERS = (12, 8, 5, 3)
"""Harmonics of the shaft that count: as many of these as are there, for their lines are as many times as exact as the
first, while lines of other families lie near multiples that are not there."""
MOST_MISSING = 0.25
"""Share of the harmonics that may be missing."""
EXACT = 0.2
"""Part of the tolerance to which the speed must be found."""
LIMIT = 12.0
"""A line's power by its neighbourhood counts up to this, as rare as 6e-6 in noise."""
FOUND_CHANCE = -8.0
"""Decimal logarithm of the chance from which a family is the shaft's."""
ALONE = 0.85
"""The next best family within reach must be below this part of the best one."""
APART = 0.4
"""Families are two if their first lines are further apart than this part of a spectrum's line: from the fourth
harmonic on these are then in different lines."""
PLATEAU = 0.98
"""Part of the best sum within which speeds are equally good: their mean is taken."""
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


def find_shaft(spectra: Sequence[EnvelopeSpectrum], told: float, tolerance: float = TOLERANCE) -> ShaftSpeed:
    """Return the speed at which a shaft's family stands clearest near the told one.

    Parameters
    ----------
    spectra : sequence of EnvelopeSpectrum
        Of the record and of its envelope, of all channels; evidence adds up.
    told : float
        Turns, Hz.
    tolerance : float
        Share by which ``told`` may be off.

    Returns
    -------
    ShaftSpeed
        ``found`` is False if no family stands out, or two as clear.
    """
    step = min(spectrum.step for spectrum in spectra)
    for orders in ORDERS:
        if step / (2.0 * orders) > EXACT * tolerance * told:
            break
        found, there = _clearest(spectra, told, tolerance, orders)
        if there >= 1.0 - MOST_MISSING:
            return found
    return ShaftSpeed(told, told)


def _clearest(
    spectra: Sequence[EnvelopeSpectrum], told: float, tolerance: float, orders: int
) -> tuple[ShaftSpeed, float]:
    """Return the speed at which so many harmonics stand clearest, and what share of them is there."""
    step = min(spectrum.step for spectrum in spectra)
    spacing = step / (2.0 * orders)
    half = round(REACH * tolerance * told / spacing)
    turns = told + spacing * np.arange(-half, half + 1)
    ratios = np.array([[ratio_at(spectrum, k * turns) for k in range(1, orders + 1)] for spectrum in spectra])
    total, count = np.minimum(ratios, LIMIT).sum(axis=(0, 1)), orders * len(spectra)
    best = int(np.argmax(total))
    there = float(np.mean(ratios[:, :, best].max(axis=0) >= LEAST_RATIO))
    trials = max(1.0, 2.0 * REACH * tolerance * told / step * (orders + 1) / 2.0)
    chance = (log_tail(float(total[best]), count) + math.log(trials)) / math.log(10.0)
    near = np.abs(turns - turns[best]) <= APART * step
    alone = bool(near.all()) or float(total[~near].max()) < ALONE * float(total[best])
    if chance > FOUND_CHANCE or not alone:
        return ShaftSpeed(told, told, min(chance, 0.0)), there
    good = turns[near & (total >= PLATEAU * total[best])]
    return ShaftSpeed(told, float(good.mean()), chance, True, spacing), there


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
