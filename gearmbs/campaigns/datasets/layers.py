"""What lies between the force at a gear's seat and a stored sample, as layers of their own, so that the clean signal
stays.

Transfer path, noise, clipping and quantisation use `gearmbs.signals`. What varies from specimen to specimen (modes of
the housing and where its sensors sit) is drawn from the specimen's number, what varies from record to record (drift,
noise) from the record's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.signals import ModalPath, Mode, add_noise, make_signal, quantise


@dataclass(frozen=True)
class SensorLayers:
    """How clean signals become measured ones.

    Attributes
    ----------
    sensors : int
        Places on the housing: each sees the same modes with other weights, and has noise of its own.
    modes : int
        Modes of the housing between seat and sensor.
    lowest, highest : float
        Range of their frequencies, Hz, drawn evenly in the logarithm.
    damping : tuple of float
        Range of their damping ratios.
    noise : tuple of float
        Range of the noise's RMS as a part of the signal's.
    wander : float
        Standard deviation of the speed within a record as a part of it, slow against a revolution.
    bits : int
        Of the converter, whose range is four times the RMS of a healthy record; beyond it clips.
    seed : int
    """

    sensors: int = 4
    modes: int = 6
    lowest: float = 400.0
    highest: float = 5500.0
    damping: tuple[float, float] = (0.02, 0.08)
    noise: tuple[float, float] = (0.02, 0.2)
    wander: float = 0.002
    bits: int = 16
    seed: int = 0

    def path(self, specimen: int, sensor: int = 0) -> ModalPath:
        """Return the transfer path of a specimen to a sensor: modes with random frequencies, dampings, weights.

        Frequencies and dampings are the specimen's, signs and weights also the sensor's.
        """
        u = np.random.default_rng([self.seed, 1, specimen]).random((self.modes, 2))
        generator = np.random.default_rng([self.seed, 3, specimen, sensor])
        modes = []
        for k in range(self.modes):
            frequency = self.lowest * (self.highest / self.lowest) ** ((k + u[k, 0]) / self.modes)
            damping = self.damping[0] + u[k, 1] * (self.damping[1] - self.damping[0])
            weight = float(generator.choice([-1.0, 1.0]) * generator.uniform(0.3, 1.0))
            modes.append(Mode(float(frequency), float(damping), 1.0 / weight))
        return ModalPath(tuple(modes))

    def measured(
        self, clean: np.ndarray, rate: float, specimen: int, record: int, full_scale: float, sensor: int = 0
    ) -> np.ndarray:
        """Return the measured samples of a clean signal, shape (n,).

        Parameters
        ----------
        clean : ndarray, shape (n,)
            Force over the gear's mass, m/s^2.
        rate : float
            Hz.
        specimen, record : int
            Whose housing, and whose noise.
        full_scale : float
            Of the converter, in the unit of the measured signal.
        sensor : int
            At which place, from 0.
        """
        # the machine drifts alike for all its sensors
        x = self._wandering(clean, np.random.default_rng([self.seed, 2, record]))
        x = self.through(x, rate, specimen, sensor)
        generator = np.random.default_rng([self.seed, 4, record, sensor])
        level = float(generator.uniform(*self.noise)) * float(np.std(x))
        signal = make_signal(x[:, None], rate, units="m/s^2", channels=["sensor"])
        noisy = add_noise(signal, seed=int(generator.integers(1 << 31)), rms=level)
        return quantise(noisy, bits=self.bits, full_scale=full_scale).values[:, 0]

    def through(self, x: np.ndarray, rate: float, specimen: int, sensor: int = 0) -> np.ndarray:
        """Return a signal behind the transfer path, as it is when it has settled: by its spectrum over the record.

        The path is scaled so that white noise keeps its RMS.
        """
        frequency = np.fft.rfftfreq(x.size, 1.0 / rate)
        response = self.path(specimen, sensor).accelerance(frequency)
        response = response / np.sqrt(np.mean(np.abs(response) ** 2))
        return np.fft.irfft(np.fft.rfft(x - x.mean()) * response, x.size)

    def _wandering(self, x: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        """Return the signal of a machine whose speed drifts a little: time runs unevenly, its ends stay."""
        u = np.linspace(0.0, 1.0, x.size)
        shift = np.zeros(x.size)
        for k in (1, 2, 3):
            # a sine of the record's order k: its derivative is the part by which the speed differs
            shift += generator.standard_normal() * self.wander / (np.pi * k) * np.sin(np.pi * k * u) / np.sqrt(1.5)
        return np.interp(u + shift, u, x)

    def as_dict(self) -> dict[str, Any]:
        """Return the settings for a data card."""
        return asdict(self)


# Splits that do not leak: by physical individual, with severities withheld, and the leaking one for comparison.


def split_by_group(
    groups: Sequence[int] | np.ndarray, *, test: float = 0.2, validation: float = 0.1, seed: int = 0
) -> np.ndarray:
    """Return "train", "validation" or "test" for each row; all rows of a group are in the same split.

    Parameters
    ----------
    groups : array_like of int, shape (n,)
        Number of the specimen of each row.
    test, validation : float
        Parts of the groups, at least one each unless zero.

    Raises
    ------
    CampaignError
        If there are too few groups.
    """
    groups = np.asarray(groups)
    names = np.unique(groups)
    counts = [max(1, round(part * names.size)) if part > 0.0 else 0 for part in (test, validation)]
    if sum(counts) >= names.size:
        raise CampaignError(
            f"split: {names.size} groups are too few for test = {test:g} and validation = {validation:g}"
        )
    order = np.random.default_rng(seed).permutation(names)
    kind = dict.fromkeys(order[: counts[0]], "test") | dict.fromkeys(order[counts[0] : sum(counts)], "validation")
    return np.array([kind.get(g, "train") for g in groups])


def withhold(split: np.ndarray, severity: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return a split in which training rows of a range of severities are "withheld": can a model interpolate?"""
    inside = (np.asarray(severity) >= low) & (np.asarray(severity) <= high)
    return np.where((split == "train") & inside, "withheld", split)


def random_split(count: int, *, test: float = 0.2, seed: int = 0) -> np.ndarray:
    """Return a split row by row, whatever they come from: it leaks if rows are windows of the same record or
    specimen."""
    return np.where(np.random.default_rng(seed).random(count) < test, "test", "train")


def one_state_a_group(labels: np.ndarray, groups: np.ndarray, seed: int = 0) -> np.ndarray:
    """Return which rows are left if every group shows one state only, as where each fault is a part of its own.

    States are dealt out evenly. In such data an individual is known by its state, and a split row by row leaks it;
    where every individual is in all states, its other rows have other labels, and such a split misleads instead.
    """
    names, states = np.unique(groups), np.unique(labels)
    dealt = states[np.random.default_rng(seed).permutation(np.arange(names.size) % states.size)]
    return np.asarray(labels) == dealt[np.searchsorted(names, groups)]


def shared_groups(split: np.ndarray, groups: np.ndarray) -> dict[tuple[str, str], int]:
    """Return how many groups each pair of splits shares: zero everywhere if nothing leaks ("withheld" belongs to
    training)."""
    split = np.where(np.asarray(split) == "withheld", "train", split)
    inside = {name: set(np.asarray(groups)[split == name]) for name in np.unique(split)}
    names = sorted(inside)
    return {(a, b): len(inside[a] & inside[b]) for i, a in enumerate(names) for b in names[i + 1 :]}
