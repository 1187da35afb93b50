"""Flank tolerances of ISO 1328-1:2013 and random deviations that just meet them.

The tolerances are the standard's formulas for grade A (1 to 11), in metres, unrounded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearmbs.gears.spec import GearSpec, require

MICRON = 1e-6


@dataclass(frozen=True)
class Tolerances:
    """Tolerances of one wheel, m.

    Attributes
    ----------
    single_pitch, total_pitch : float
        f_pT and F_pT.
    profile_slope, profile_form : float
        f_HalphaT and f_falphaT.
    lead_slope, lead_form : float
        f_HbetaT and f_fbetaT.
    """

    single_pitch: float
    total_pitch: float
    profile_slope: float
    profile_form: float
    lead_slope: float
    lead_form: float


def tolerances(gear: GearSpec, grade: int) -> Tolerances:
    """Tolerances of a wheel for an ISO 1328-1:2013 grade.

    Raises
    ------
    ValueError
        For grades outside 1 to 11.
    """
    require(isinstance(grade, int) and 1 <= grade <= 11, f"grade is {grade!r}; ISO 1328-1 has grades 1 to 11")
    d, m, b = 2e3 * gear.pitch_radius, 1e3 * gear.module, 1e3 * gear.face_width
    step = math.sqrt(2) ** (grade - 5) * MICRON
    return Tolerances(
        single_pitch=(0.001 * d + 0.4 * m + 5) * step,
        total_pitch=(0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12) * step,
        profile_slope=(0.001 * d + 0.4 * m + 4) * step,
        profile_form=(0.55 * m + 5) * step,
        lead_slope=(0.05 * math.sqrt(d) + 0.35 * math.sqrt(b) + 4) * step,
        lead_form=(0.07 * math.sqrt(d) + 0.45 * math.sqrt(b) + 4) * step,
    )


def random_pitch(gear: GearSpec, grade: int, generator: np.random.Generator) -> np.ndarray:
    """Index deviations of all teeth (cumulative pitch), m, shape (z,), that use up the grade's pitch tolerances.

    A once-per-revolution run-out and a random part, scaled so that neither the single pitch deviations nor the total
    exceed their tolerances and the nearer of the two is met.
    """
    limit = tolerances(gear, grade)
    z = gear.teeth
    angle = 2 * math.pi * np.arange(z) / z
    index = math.sin(1.0) * np.sin(angle + generator.uniform(0, 2 * math.pi))
    noise = np.cumsum(generator.normal(size=z)) / math.sqrt(z)
    index = index + noise - noise[-1] * np.arange(1, z + 1) / z
    index -= index.mean()
    single = np.abs(np.diff(np.append(index, index[0]))).max()
    return index * min(limit.single_pitch / single, limit.total_pitch / np.ptp(index))
