"""What real recordings tell: the spectrum and the level of what does not repeat, and the path to the sensors."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from scipy.linalg import solve_toeplitz

from gearmbs.campaigns.datasets.layers import STOP, Noise
from gearmbs.campaigns.settings import CampaignError, whole
from gearmbs.signals import ModalPath, Mode, discrete_random, rate_of, sample
from gearmbs.signals.signal.arguments import DataKeywords, takes_data
from gearmbs.signals.signal.units import Given

LINES = 64
"""Bands of the identified density: wider than lines and their sidebands, narrower than resonances of a housing."""

SEGMENT = 2048
"""Samples of a periodogram."""

MEMORY = 64
"""Order of the prediction whose poles are the modes: twice as many as a structure shows, the rest takes the noise."""

DAMPED = 0.3
"""Damping ratio above which a pole is the spectrum's slope and no mode."""

FALL, BESIDE = 0.5**0.5, 3.0
"""To which part of a mode's peak the spectrum falls on one of its sides at least, so many half-widths away. About one
mode alone it falls to 0.3 there; of white noise, whose poles stand in a row, it is level. A half-width away it is below
the peak on both sides, which it is not on the flank of another one."""

FEWEST = 4096
"""Samples of a recording: two periodograms, and so many for each tap that its spectrum scatters by a sixth."""


@takes_data(data_rate="frequency")
def identify_noise(signal: Any, data_rate: Given | None = None, **_data: Unpack[DataKeywords]) -> tuple[Noise, ...]:
    """Return the noise of each channel of a recording.

    The recording is parted into what can be predicted and what cannot, see `gearmbs.signals.discrete_random`; the
    second is noise of the sensor and random vibration of the machine, with its resonances.

    Parameters
    ----------
    signal : DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of. Give recordings of one state only, or of
        all equally: what is taken from them reaches every state of a data set.
    data_rate : float or str, optional
        Sampling rate of the data set, Hz, to which a faster recording is brought first, since frequencies of the noise
        are parts of it. Default: that of the recording.

    Raises
    ------
    CampaignError
        If the recording is too short or slower than the data set, or a channel stands still.
    """
    if data_rate is not None:
        data_rate = float(data_rate)
        if rate_of(signal) < data_rate:
            raise CampaignError(
                f"recording: {rate_of(signal):g} Hz is below the data set's {data_rate:g} Hz, of whose upper band it "
                "knows nothing; give a faster one"
            )
        signal = sample(signal, data_rate)
    repeating, random = _parted(signal)
    rate, window = rate_of(signal), np.hanning(SEGMENT)
    edges = np.linspace(0.0, 0.5, LINES + 1)
    middle = np.r_[0.0, 0.5 * (edges[1:] + edges[:-1]), 0.5]
    frequency = np.fft.rfftfreq(SEGMENT)
    band = np.clip(np.digitize(frequency, edges) - 1, 0, LINES - 1)
    found = []
    for lines, x in zip(repeating.T, random.T, strict=True):
        pieces = np.lib.stride_tricks.sliding_window_view(x, SEGMENT)[:: SEGMENT // 2]
        power = np.mean(np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2, axis=0)
        density = np.sqrt(np.bincount(band, power, LINES) / np.bincount(band, minlength=LINES) / rate)
        density = np.r_[density[0], density, density[-1]]
        found.append(Noise(tuple(map(float, middle)), tuple(map(float, density)), float(np.std(x) / np.std(lines))))
    return tuple(found)


@takes_data()
def identify_path(signal: Any, modes: int = 6, **_data: Unpack[DataKeywords]) -> tuple[ModalPath, ...]:
    """Return the transfer path to each channel of a recording, by the resonances of what does not repeat.

    Random vibration of a machine, of rolling and sliding, is taken for white where it arises: then linear prediction of
    what arrives has the poles of the structure and of the sensor's mounting [1]_. Frequencies, dampings and heights of
    the peaks are known by this, but neither the gain nor whether two modes move with or against each other: all are
    taken for with.

    Parameters
    ----------
    signal : DataArray
        Dimensions (time, channel), or whatever `to_signal` makes a signal of, of one state only, or of all equally.
    modes : int
        The strongest so many; fewer where fewer stand out.

    Raises
    ------
    CampaignError
        If the recording is too short, a channel stands still, or none of its resonances stands out.

    References
    ----------
    .. [1] J. Makhoul, Linear prediction: a tutorial review, Proc. IEEE 63, 1975.
    """
    count = whole(modes, "modes", 1)
    rate, found = rate_of(signal), []
    for name, x in zip(signal["channel"].values, _parted(signal)[1].T, strict=True):
        likeness = np.fft.irfft(np.abs(np.fft.rfft(x, 2 * x.size)) ** 2)[: MEMORY + 1]
        taps = np.r_[1.0, -solve_toeplitz(likeness[:-1], likeness[1:])]
        roots = np.roots(taps).astype(complex)
        # of 1/A the parts that belong to the poles, by their peaks
        size = np.abs(roots ** (MEMORY - 1) / np.polyval(np.polyder(taps), roots)) / (1.0 - np.abs(roots))
        poles = np.log(roots) * rate
        shown = (poles.imag > 0.0) & (-poles.real < DAMPED * np.abs(poles)) & (poles.imag < 2.0 * np.pi * STOP * rate)
        near, far = (_peak(taps, (poles.imag + poles.real * np.array([[-k], [k]])) / rate) for k in (1.0, BESIDE))
        peak = _peak(taps, poles.imag / rate)
        shown &= (near.max(axis=0) < peak) & (far.min(axis=0) < FALL * peak)
        if not shown.any():
            raise CampaignError(
                f"recording: no resonance of {name} stands out of what does not repeat; give one that hears a structure"
            )
        poles = poles[shown][np.argsort(-size[shown])[:count]]
        found.append(ModalPath(tuple(_mode(p, taps, rate) for p in poles)))
    return tuple(found)


def _parted(signal: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return what repeats and what does not without their means, (time, channel).

    Raises
    ------
    CampaignError
        If there is too little of it, or a channel stands still.
    """
    if signal.sizes["time"] < FEWEST:
        raise CampaignError(f"recording: {signal.sizes['time']} samples are too few; give {FEWEST} at least")
    still = [
        str(name) for name, x in zip(signal["channel"].values, signal.values.T) if not min(np.ptp(x), np.std(x)) > 0.0
    ]
    if still:
        raise CampaignError(f"recording: {', '.join(still)} stands still; give one of a machine that runs")
    repeating, random = (part.values - part.values.mean(axis=0) for part in discrete_random(signal))
    return repeating, random


def _peak(taps: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the prediction's spectrum at some angles, rad a sample."""
    return 1.0 / np.abs(np.exp(-1j * np.multiply.outer(angle, np.arange(taps.size))) @ taps)


def _mode(pole: complex, taps: np.ndarray, rate: float) -> Mode:
    """Return the mode of a pole, rad/s, whose peak is that of the prediction's spectrum there."""
    frequency, damping = float(abs(pole)) / (2.0 * np.pi), float(-pole.real / abs(pole))
    peak = float(_peak(taps, np.array([2.0 * np.pi * frequency / rate]))[0])
    return Mode(frequency, damping, 1.0 / (2.0 * damping * peak))
