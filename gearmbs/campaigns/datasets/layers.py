"""What lies between a simulated vibration and a stored sample, as layers of their own, so that the clean signal stays.

In their order: drift of the speed, transfer path, anti-alias filter, noise, converter. What varies from specimen to
specimen (modes of the path, noise of its sensors) is drawn from the specimen's number, what varies from record to
record (drift, the noise's samples) from the record's. None knows the state of the teeth.

Records are simulated with margins before and after, which the filters use up: what is stored has no edges.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from gearmbs.campaigns.settings import CampaignError
from gearmbs.schema.quantities import Measure
from gearmbs.signals import ModalPath, Mode, accelerometer, make_signal, quantise
from gearmbs.signals.filters import apply_zero_phase, kaiser_taps
from gearmbs.signals.rotation.angular import MARGIN, interpolate

PASS, STOP = 0.4, 0.46
"""Band of the anti-alias filter as parts of the sampling rate: flat to the first, as converters with a ratio of 2.5
are, and down by `ATTENUATION` from the second on, above which a record holds noise alone."""

ATTENUATION = 100.0
"""dB, about the dynamic range of a converter of 16 bits."""

DRIFT_TERMS = 3
"""Cosines of the drift of the speed, of half, one and one and a half periods a record: slow against a turn."""

LARGEST_DRAW = 2.5
"""Standard deviations at which the drift's amplitudes are cut off, so that it stays within the margin."""


@dataclass(frozen=True)
class Noise:
    """The random part of a recording, as `identify_noise` finds it.

    Attributes
    ----------
    frequency : tuple of float
        As parts of the sampling rate, from 0 to 0.5.
    density : tuple of float
        Amplitude density at these, of any scale.
    level : float
        RMS over that of the part that repeats.
    """

    frequency: tuple[float, ...]
    density: tuple[float, ...]
    level: float

    def drawn(self, count: int, generator: np.random.Generator) -> np.ndarray:
        """Return samples of Gaussian noise of this density and an RMS of 1, shape (count,).

        They are cut out of a longer period, so that the end does not join the beginning.
        """
        length = 1 << (2 * count - 1).bit_length()
        gain = np.interp(np.fft.rfftfreq(length), self.frequency, self.density)
        x = np.fft.irfft(np.fft.rfft(generator.standard_normal(length)) * gain, length)
        power = np.r_[gain**2, gain[1:-1] ** 2].mean()
        return x[length // 4 : length // 4 + count] / math.sqrt(power)


WHITE = Noise((0.0, 0.5), (1.0, 1.0), 1.0)

FREQUENCY = Measure("frequency", above=0, remedy="give a positive frequency, Hz")
LIMITS = {
    "modes": Measure(low=0, whole=True, remedy="give a whole number from 0"),
    "lowest": FREQUENCY,
    "highest": FREQUENCY,
    "damping": Measure(above=0, below=1, several=2, remedy="give two damping ratios above 0 and below 1"),
    "noise": Measure(low=0, several=2, remedy="give two parts of the level from 0"),
    "wander": Measure(low=0, below=0.1, remedy="give a part of the speed from 0 to below 0.1"),
    "bits": Measure(low=2, high=32, whole=True, remedy="give a whole number from 2 to 32"),
    "headroom": Measure(above=0, remedy="give a positive number"),
    "seed": Measure(low=0, whole=True, remedy="give a whole number from 0"),
}
"""What the settings of layers may be. With a drift of a tenth of the speed the margins are half of the record."""


@dataclass(frozen=True)
class SensorLayers:
    """How clean signals become measured ones.

    Attributes
    ----------
    modes : int
        Modes of a transfer path with random frequencies, dampings and weights; 0 where the simulated housing is the
        path.
    paths : tuple of ModalPath
        Instead of modes: paths identified from recordings (`identify_path`), of which each sensor gets one.
    lowest, highest : float
        Range of their frequencies, Hz, drawn evenly in the logarithm.
    damping : tuple of float
        Range of their damping ratios.
    noise : tuple of float
        Range of the noise's RMS as a part of the level of the operating point, which is that of all states together.
    noises : tuple of Noise
        Random parts identified from recordings, of which each sensor gets one with its spectrum and its level; empty:
        white noise of the range above.
    wander : float
        Standard deviation of the speed within a record as a part of it, slow against a revolution.
    bits : int
        Of the converter.
    headroom : float
        Range of the converter over the largest sample of all states; below 1 it clips.
    seed : int

    Raises
    ------
    CampaignError
        Naming the setting, its value and what it may be.
    """

    modes: int = 0
    paths: tuple[ModalPath, ...] = ()
    lowest: float = 400.0
    highest: float = 5500.0
    damping: tuple[float, float] = (0.02, 0.08)
    noise: tuple[float, float] = (0.02, 0.2)
    noises: tuple[Noise, ...] = ()
    wander: float = 0.002
    bits: int = 16
    headroom: float = 1.25
    seed: int = 0

    def __post_init__(self) -> None:
        for name, limits in LIMITS.items():
            value = getattr(self, name)
            try:
                object.__setattr__(self, name, limits.as_given(value))
            except ValueError as error:
                raise CampaignError(f"layers: {name} = {value!r}; {error}") from None
        for name in ("damping", "noise"):
            low, high = getattr(self, name)
            if low > high:
                raise CampaignError(f"layers: {name} = {(low, high)!r}; give the lower end first")
        if self.lowest > self.highest:
            raise CampaignError(
                f"layers: lowest = {self.lowest:g} Hz is above highest = {self.highest:g} Hz; give the lower "
                "end of the modes' frequencies as lowest"
            )
        for name, kind in (("paths", ModalPath), ("noises", Noise)):
            given = getattr(self, name)
            if not (isinstance(given, (tuple, list)) and all(isinstance(one, kind) for one in given)):
                raise CampaignError(f"layers: {name} = {given!r:.60}; give a tuple of {kind.__name__}")
            object.__setattr__(self, name, tuple(given))

    def path(self, specimen: int, sensor: int = 0) -> ModalPath:
        """Return the transfer path of a specimen to a sensor.

        Frequencies and dampings are the specimen's, signs and weights also the sensor's.
        """
        u = np.random.default_rng([self.seed, 1, specimen]).random((self.modes, 2))
        generator = np.random.default_rng([self.seed, 3, specimen, sensor])
        if self.paths:
            return self.paths[int(generator.integers(len(self.paths)))]
        modes = []
        for k in range(self.modes):
            frequency = self.lowest * (self.highest / self.lowest) ** ((k + u[k, 0]) / self.modes)
            damping = self.damping[0] + u[k, 1] * (self.damping[1] - self.damping[0])
            weight = float(generator.choice([-1.0, 1.0]) * generator.uniform(0.3, 1.0))
            modes.append(Mode(float(frequency), float(damping), 1.0 / weight))
        return ModalPath(tuple(modes))

    def _settling(self, rate: float) -> int:
        """Return the samples in which the slowest path that may be drawn forgets its start."""
        slowest = ModalPath((Mode(self.lowest, self.damping[0], 1.0),))
        known = self.paths or ((slowest,) if self.modes else ())
        return math.ceil(max((path.settling for path in known), default=0.0) * rate)

    def _lost(self, samples: float) -> int:
        """Return the samples that drift, interpolation and filter take from either end of a record of so many."""
        shifts = sum(2.0 / (math.pi * k) for k in range(1, DRIFT_TERMS + 1))
        reach = self.wander * math.sqrt(2.0 / DRIFT_TERMS) * LARGEST_DRAW * shifts * samples
        return math.ceil(reach) + MARGIN + _anti_alias(1.0).size // 2

    def margins(self, duration: float, rate: float) -> tuple[int, int]:
        """Return the samples that have to be simulated before and after a record of a duration, s."""
        lost = self._lost(duration * rate)
        # the path's response to the end of what is known must not reach the record either
        return lost + self._settling(rate), lost + (MARGIN if self.modes or self.paths else 0)

    def longest(self, samples: int, rate: float) -> float:
        """Return the longest record, s, that a simulation of so many samples has the margins of.

        Raises
        ------
        CampaignError
            If the margins alone are longer.
        """
        for count in range(samples, 0, -1):
            if count + sum(self.margins(count / rate, rate)) <= samples:
                return count / rate
        raise CampaignError(f"layers: {samples} samples are fewer than the margins need; simulate longer records")

    def heard(
        self, clean: np.ndarray, rate: float, duration: float, specimen: int, record: int, sensor: int = 0
    ) -> np.ndarray:
        """Return what arrives at a converter without noise, shape (duration * rate,).

        Parameters
        ----------
        clean : ndarray, shape (n,)
            With the `margins` of the duration, m/s^2.
        rate : float
            Hz.
        duration : float
            Of what is returned, s.
        specimen, record : int
            Whose housing, and whose drift.
        sensor : int
            At which place, from 0.

        Raises
        ------
        CampaignError
            If the signal is too short.
        """
        count = round(duration * rate)
        before, after = self.margins(duration, rate)
        if clean.size < before + count + after:
            raise CampaignError(
                f"layers: {clean.size} samples are too few for {count} with margins of {before} and {after}; simulate "
                f"{(before + count + after) / rate:.4g} s"
            )
        x = clean[: before + count + after]
        # the machine drifts alike for all its sensors
        positions = before + self.times(rate, duration, record, (-before + MARGIN, count + after - MARGIN)) * rate
        x = interpolate(x - x.mean(), np.clip(positions, 0.0, x.size - 1.0))
        if self.modes or self.paths:
            path = self.path(specimen, sensor)
            scale = math.sqrt(float(np.mean(np.abs(path.accelerance(np.linspace(0.0, 0.5 * rate, 2049))) ** 2)))
            force = make_signal(x[:, None], rate, units="N", channels=["sensor"])
            x = accelerometer(force, path, settle="keep").values[:, 0] / scale
        x = apply_zero_phase(x[:, None], _anti_alias(rate), "trim")[0][:, 0]
        first = before - MARGIN - _anti_alias(rate).size // 2
        return x[first : first + count]

    def times(self, rate: float, duration: float, record: int, span: tuple[int, int] | None = None) -> np.ndarray:
        """Return when the machine of steady speed is where the drifting one is at each sample, s.

        Parameters
        ----------
        rate, duration : float
            Hz, s.
        record : int
        span : tuple of int, optional
            First sample and the one after the last; default those of the record.
        """
        first, stop = span or (0, round(duration * rate))
        t = np.arange(first, stop) / rate
        generator = np.random.default_rng([self.seed, 2, record])
        shift = np.zeros(t.size)
        for k in range(1, DRIFT_TERMS + 1):
            size = float(np.clip(generator.standard_normal(), -LARGEST_DRAW, LARGEST_DRAW))
            phase, w = generator.uniform(0.0, 2.0 * math.pi), math.pi * k / duration
            # the speed's part size * cos(w t + phase) and its integral from the record's beginning
            shift += self.wander * math.sqrt(2.0 / DRIFT_TERMS) * size * (np.sin(w * t + phase) - math.sin(phase)) / w
        return t + shift

    def noise_of(self, specimen: int, sensor: int = 0) -> Noise:
        """Return the noise of a specimen's sensor; its level is that over the operating point's."""
        generator = np.random.default_rng([self.seed, 5, specimen, sensor])
        if self.noises:
            return self.noises[int(generator.integers(len(self.noises)))]
        return Noise(WHITE.frequency, WHITE.density, float(generator.uniform(*self.noise)))

    def noisy(self, heard: np.ndarray, level: float, specimen: int, record: int, sensor: int = 0) -> np.ndarray:
        """Return a heard signal with the noise of its sensor; ``level`` is the operating point's, m/s^2."""
        noise = self.noise_of(specimen, sensor)
        generator = np.random.default_rng([self.seed, 4, record, sensor])
        return heard + level * noise.level * noise.drawn(heard.size, generator)

    def converted(self, x: np.ndarray, full_scale: float) -> tuple[np.ndarray, int]:
        """Return samples behind the converter, and how many it has clipped."""
        signal = make_signal(np.asarray(x, dtype=float)[:, None], 1.0, units="m/s^2", channels=["sensor"])
        found = quantise(signal, bits=self.bits, full_scale=full_scale)
        return found.values[:, 0], int(found.attrs["clipped"])

    def full_scale(self, largest: float) -> float:
        """Return the range of a converter for a largest sample of either sign, m/s^2.

        Whole numbers of n bits reach from -2^(n-1) to 2^(n-1) - 1: a range of the largest sample would clip a positive
        one.
        """
        top = 2.0 ** (self.bits - 1)
        return self.headroom * largest * top / (top - 1.0)

    def as_dict(self) -> dict[str, Any]:
        """Return the settings for a data card."""
        return asdict(self)


def checked_layers(layers: SensorLayers | None, seed: int = 0) -> SensorLayers:
    """Return layers, the default ones where none are given.

    Raises
    ------
    CampaignError
        If they are something else.
    """
    if layers is None:
        return SensorLayers(seed=seed)
    if not isinstance(layers, SensorLayers):
        raise CampaignError(f"layers = {layers!r:.60}; give SensorLayers(...)")
    return layers


def _anti_alias(rate: float) -> np.ndarray:
    return kaiser_taps(0.5 * (PASS + STOP) * rate, (STOP - PASS) * rate, rate, "lowpass", ATTENUATION)
