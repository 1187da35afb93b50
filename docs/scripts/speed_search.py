"""How often the speed search finds the right mesh line: random made-up records whose speed is known."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from gearmbs.signals import SignalError, estimate_speed, make_signal

TOLERANCE = 5e-3
"""Relative error beyond which an answer is wrong: above the wander of the speed, below a sideband's distance, 1/70."""
DIFFICULTIES = ("easy", "usual", "hard")


@dataclass(frozen=True)
class Kind:
    """What records of one difficulty are like; ranges are drawn from uniformly.

    Attributes
    ----------
    floor : (float, float)
        Level of the mean line over the noise in a 2 s spectrum, dB.
    missing : float
        Probability that a mesh harmonic is absent from a channel.
    modulation : float
        Largest depth of the modulation by either shaft.
    wander : float
        Largest relative wander of the speed.
    strangers : int
        Largest number of lines that have nothing to do with the mesh.
    second_mesh : float
        Probability of another pair on the same shaft, 6 dB weaker.
    """

    floor: tuple[float, float]
    missing: float
    modulation: float
    wander: float
    strangers: int
    second_mesh: float


KINDS = {
    "easy": Kind((30.0, 45.0), 0.0, 0.2, 2e-4, 0, 0.0),
    "usual": Kind((18.0, 40.0), 0.25, 0.6, 1e-3, 3, 0.0),
    "hard": Kind((10.0, 25.0), 0.4, 1.0, 3e-3, 8, 0.5),
}


def record(kind: Kind, seed: int):
    """Return a made-up record and its true mean gear mesh frequency in Hz."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([12800.0, 25600.0]))
    teeth, mate = (int(z) for z in rng.integers(15, 70, 2))
    gmf = rng.uniform(max(150.0, 4.5 * teeth), min(0.22 * rate, 60.0 * teeth))
    seconds, channels = rng.uniform(3.0, 8.0), int(rng.integers(1, 5))
    t = np.arange(int(seconds * rate)) / rate
    slow = 2.0 * np.pi * rng.uniform(0.1, 0.5)
    # relative wander w of the speed: the angle of the line is 2 pi f (t + w sin(s t) / s)
    warped = t + rng.uniform(0, kind.wander) * np.sin(slow * t + rng.uniform(0, 6)) / slow
    mean = gmf * (warped[-1] - warped[0]) / (t[-1] - t[0])
    # noise of density 1 has lines of RMS sqrt(1.5 / 2 s) behind a Hann window
    floor = math.sqrt(1.5 / 2.0)
    data = np.empty((t.size, channels))
    for c in range(channels):
        level = floor * math.sqrt(2.0) * 10.0 ** (rng.uniform(*kind.floor) / 20.0)
        data[:, c] = _coloured(rng, t.size, rate)
        data[:, c] += level * _mesh(rng, kind, warped, gmf, teeth, mate)
        if rng.random() < kind.second_mesh:
            other = int(rng.integers(15, 70))
            data[:, c] += 0.5 * level * _mesh(rng, kind, warped, gmf * other / teeth, other, mate)
        for _ in range(int(rng.integers(0, kind.strangers + 1))):
            line = rng.choice([50.0, 100.0, 150.0, rng.uniform(20.0, 0.45 * rate)])
            data[:, c] += level * rng.uniform(0.1, 1.0) * np.cos(2 * np.pi * line * t + rng.uniform(0, 6))
        for k in (1, 2, 3):
            orders = rng.uniform(0, 0.5) * level
            data[:, c] += orders * np.cos(2 * np.pi * k * gmf / teeth * warped + rng.uniform(0, 6))
    return make_signal(data, rate, teeth=(teeth, mate)), mean


def _mesh(rng, kind: Kind, warped: np.ndarray, gmf: float, teeth: int, mate: int) -> np.ndarray:
    """Mesh harmonics with sidebands of both shafts; at least one harmonic is there."""
    total = np.zeros(warped.size)
    there = rng.random(5) >= kind.missing
    if not there[:3].any():
        there[int(rng.integers(0, 3))] = True
    for h in np.flatnonzero(there) + 1:
        one = rng.uniform(0.3, 1.0) / h**0.5 * np.cos(2 * np.pi * h * gmf * warped + rng.uniform(0, 6))
        for count in (teeth, mate):
            depth = rng.uniform(0, kind.modulation)
            one = one * (1 + depth * np.cos(2 * np.pi * gmf / count * warped + rng.uniform(0, 6)))
        total += one
    return total


def _coloured(rng, count: int, rate: float) -> np.ndarray:
    """White noise of density 1 plus one broad resonance of up to 15 dB."""
    line = np.fft.rfft(rng.standard_normal(count) * math.sqrt(rate / 2.0))
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    centre, width = rng.uniform(0.05, 0.45) * rate, rng.uniform(0.02, 0.1) * rate
    gain = 1.0 + rng.uniform(0.0, 4.6) * np.exp(-(((frequency - centre) / width) ** 2))
    return np.fft.irfft(line * gain, count)


def outcomes(count: int, first_seed: int = 0) -> pd.DataFrame:
    """Return, for `count` records of each difficulty, what was found: right, refused, multiple or wrong."""
    rows = []
    for difficulty in DIFFICULTIES:
        for seed in range(first_seed, first_seed + count):
            signal, truth = record(KINDS[difficulty], seed)
            try:
                found = estimate_speed(signal).gmf
            except SignalError:
                rows.append((difficulty, seed, truth, math.nan, "refused"))
                continue
            rows.append((difficulty, seed, truth, found, _verdict(found / truth)))
    return pd.DataFrame(rows, columns=["difficulty", "seed", "truth", "found", "outcome"])


def _verdict(ratio: float) -> str:
    if abs(ratio - 1.0) < TOLERANCE:
        return "right"
    whole = max(ratio, 1.0 / ratio)
    return "multiple" if abs(whole / round(whole) - 1.0) < TOLERANCE else "wrong"


def table(found: pd.DataFrame) -> pd.DataFrame:
    """Return the share of each outcome by difficulty, in percent."""
    counts = found.groupby(["difficulty", "outcome"]).size().unstack(fill_value=0)
    counts = counts.reindex(index=list(DIFFICULTIES), columns=["right", "refused", "multiple", "wrong"], fill_value=0)
    return 100.0 * counts.div(counts.sum(axis=1), axis=0)
